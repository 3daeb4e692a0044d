//! The first place where a ray meets the ground, without missing any: steps bounded by a Lipschitz constant.

/// How a search along a ray ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Search {
    /// The clearance changes sign here first.
    Hit {
        /// Distance of the crossing: the clear end of the last bracket.
        distance: f64,
        /// Width of the last bracket.
        error: f64,
        /// Values of the clearance taken.
        evaluations: usize,
    },
    /// No crossing up to the end of the ray.
    Clear {
        /// Least clearance among the samples.
        least: f64,
        /// Values of the clearance taken.
        evaluations: usize,
    },
    /// The allowed number of evaluations was used up.
    Exhausted {
        /// Distance up to which there is no crossing.
        reached: f64,
    },
}

impl Search {
    /// Distance of the hit, if there is one.
    pub fn distance(&self) -> Option<f64> {
        match self {
            Self::Hit { distance, .. } => Some(*distance),
            _ => None,
        }
    }
}

/// What is searched and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracketing {
    /// Start of the search along the ray (m).
    pub near: f64,
    /// End of the search (m).
    pub far: f64,
    /// Bound on the change of the clearance over the distance along the ray; see [`lipschitz_of_terrain`].
    pub lipschitz: f64,
    /// Least step (m). A stretch below the ground that is shorter than this, so less than `lipschitz * least_step / 2`
    /// deep, may be missed; nothing else can be.
    pub least_step: f64,
    /// Width of the last bracket (m); 0 halves it down to neighbouring numbers.
    pub tolerance: f64,
    /// Values of the clearance at most.
    pub evaluations: usize,
}

impl Default for Bracketing {
    /// 0 to 100 km, a clearance that changes by at most 2 m a metre, steps of a millimetre or more, ten million at most.
    fn default() -> Self {
        Self {
            near: 0.0,
            far: 100_000.0,
            lipschitz: 2.0,
            least_step: 1e-3,
            tolerance: 0.0,
            evaluations: 10_000_000,
        }
    }
}

/// Bound on the change of a ray's clearance over its distance: a ground no steeper than `max_slope` (rise over run),
/// seen along the unit vector `dir`, on a plane or on a sphere.
pub fn lipschitz_of_terrain(dir: [f64; 3], max_slope: f64) -> f64 {
    1.0 + max_slope * dir[0].hypot(dir[2])
}

/// First zero of `clearance` on the ray. From a sample with the clearance c the ray is free for c over the Lipschitz
/// constant, which is the next step; a sign change is then halved down to the tolerance. A start below the ground is a hit
/// at the start.
pub fn first_crossing(clearance: impl Fn(f64) -> f64, search: &Bracketing) -> Search {
    let least_step = search
        .least_step
        .max(f64::EPSILON * search.far.abs().max(search.near.abs()));
    let mut t = search.near;
    let mut height = clearance(t);
    let mut evaluations = 1;
    let mut least = height;
    if height <= 0.0 {
        return Search::Hit {
            distance: t,
            error: 0.0,
            evaluations,
        };
    }
    while t < search.far {
        if evaluations >= search.evaluations {
            return Search::Exhausted { reached: t };
        }
        let next = (t + (height / search.lipschitz).max(least_step)).min(search.far);
        let there = clearance(next);
        evaluations += 1;
        if there <= 0.0 {
            let (mut clear, mut below) = (t, next);
            while below - clear > search.tolerance {
                let middle = 0.5 * (clear + below);
                if middle <= clear || middle >= below {
                    break;
                }
                evaluations += 1;
                if clearance(middle) <= 0.0 {
                    below = middle;
                } else {
                    clear = middle;
                }
            }
            return Search::Hit {
                distance: clear,
                error: below - clear,
                evaluations,
            };
        }
        (t, height) = (next, there);
        least = least.min(height);
    }
    Search::Clear { least, evaluations }
}
