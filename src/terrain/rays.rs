//! Rays and where they meet a terrain: on the processor, by bracketing.

use super::field::Kind;
use super::ground::Prepared;
use super::land::Land;
use super::real::Real;
use crate::error::Error;
use crate::view::WorldPos;

/// A ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainRay {
    /// Where it starts.
    pub origin: WorldPos,
    /// Its direction, a unit vector: y up at the origin over a plane, along the world's axes over a ball.
    pub dir: [f64; 3],
    /// Where it ends at the latest (m), above 0; no ray goes beyond [`TerrainRay::FARTHEST`] or, over a ball, [`TerrainRay::FARTHEST_OVER_BALL`].
    pub far: f64,
}

/// What a ray found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainHit {
    /// Distance (m); infinite when nothing is met.
    pub distance: f64,
    /// Upward unit normal in the frame of the ray's direction; 0 when nothing is met.
    pub normal: [f64; 3],
    /// Height of the field under the hit (m).
    pub height: f64,
    /// Whether the ray ran out of steps, so that the answer is what is most likely; over a ball also whether it took longer steps than are sure, though its hit is bracketed.
    pub capped: bool,
}

impl TerrainHit {
    /// Nothing met.
    pub const MISS: TerrainHit = TerrainHit {
        distance: f64::INFINITY,
        normal: [0.0; 3],
        height: 0.0,
        capped: false,
    };
}

/// How the device follows rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayPath {
    /// By steps in proportion to the clearance (Leitner 2022, algorithm 4).
    Textbook,
    /// Many rays from one origin over baked heights with a last step on the field, and few rays over the field itself, by steps of half a footprint or longer ones that bounds allow, and a bracket.
    Fast,
}

impl TerrainRay {
    /// Where rays over the plane end (m), on the processor and on the device: a ray that starts 100 km up has left the planet long before.
    pub const FARTHEST: f64 = 1e6;

    /// Where rays over a ball end (m).
    pub const FARTHEST_OVER_BALL: f64 = 1e9;

    /// Checks its numbers.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] with the ray's index.
    pub fn check(&self, index: usize) -> Result<(), Error> {
        let length = self.dir.iter().map(|c| c * c).sum::<f64>().sqrt();
        let fault = |what: &str, value: String, domain: &str| Error::OutOfDomain {
            name: format!("{what} of ray {index}"),
            value,
            domain: domain.to_owned(),
        };
        if !self.origin.frac.is_finite() {
            let value = format!("{:?}", self.origin);
            return Err(fault("the origin", value, "finite"));
        }
        if length.is_nan() || (length - 1.0).abs() > 1e-3 {
            let value = format!("{:?}", self.dir);
            return Err(fault("the direction", value, "a unit vector"));
        }
        if self.far.is_nan() || self.far <= 0.0 {
            return Err(fault("the distance", self.far.to_string(), "above 0 m"));
        }
        Ok(())
    }
}

/// Altitude at a distance along a ray from altitude `start`, without cancellation; `mu` is its zenith cosine there.
pub(super) fn altitude_along(start: f64, radius: f64, mu: f64, t: f64) -> f64 {
    let q = t * (t + 2.0 * radius * mu);
    start + q / (radius + (radius * radius + q).max(0.0).sqrt())
}

/// Where a ray is looked for the ground, and how finely.
pub(super) struct Search {
    /// Altitude of its start and distance of that from the planet's centre (m).
    pub start: f64,
    pub radius: f64,
    /// Its zenith cosine there.
    pub mu: f64,
    /// No ground is above (m).
    pub top: f64,
    /// It ends here (m).
    pub far: f64,
    pub pixel_angle: f64,
    /// Step at the least, in footprints.
    pub share: f64,
    /// Least step (m).
    pub least: f64,
    /// No slope is steeper while so many octaves count, of a first one with cells of `wavelength` metres.
    pub steep: [f64; 17],
    pub wavelength: f64,
    /// What of a metre of the ray goes along the ground at most.
    pub level: f64,
}

/// Steps of a search at most.
const MOST_STEPS: usize = 1 << 18;

/// What a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    /// Distance of the ground (m).
    pub distance: Option<f64>,
    /// Whether the steps did not suffice.
    pub capped: bool,
}

impl Found {
    /// The hit, from what is found at a distance.
    pub fn hit(self, at: impl Fn(f64) -> TerrainHit) -> TerrainHit {
        TerrainHit {
            capped: self.capped,
            ..self.distance.map_or(TerrainHit::MISS, at)
        }
    }
}

/// Checks the radius of a planet (m).
///
/// # Errors
/// [`Error::OutOfDomain`].
pub(super) fn check_radius(planet_radius: f64) -> Result<(), Error> {
    if (1e5..=1e9).contains(&planet_radius) {
        return Ok(());
    }
    Err(Error::OutOfDomain {
        name: "planet_radius".to_owned(),
        value: planet_radius.to_string(),
        domain: "in [1e5, 1e9] m".to_owned(),
    })
}

/// Where a ray that ran out of steps most likely meets the ground, as `veduta::terrain::clipmap::likely_end` says.
fn likely_end(start: f64, radius: f64, mu: f64, t: f64, clearance: f64, far: f64) -> Option<f64> {
    let below = altitude_along(start, radius, mu, t) - clearance;
    let square = mu * mu;
    let lowest = start - radius * square / (1.0 + (1.0 - square).max(0.0).sqrt());
    let fall = -(mu + t / radius);
    let close = clearance < 0.02 * t;
    if close {
        return Some(t.min(far));
    }
    (fall > 0.0 && lowest < below).then(|| (t + clearance.max(0.0) / fall.max(1e-3)).min(far))
}

impl Search {
    /// Distance at which the ray comes down to the highest ground; `None` when it does not.
    pub fn entry(&self) -> Option<f64> {
        let mut t = 0.0;
        while t < self.far {
            let above = altitude_along(self.start, self.radius, self.mu, t) - self.top;
            if above <= 0.0 {
                return Some(t);
            }
            let rise = self.rise(t);
            if rise >= 0.0 {
                return None;
            }
            // Altitude is convex: the tangent comes down to the highest ground before the ray does.
            t += (above / -rise).max(1e-3);
        }
        None
    }

    /// Zenith cosine of the ray at a distance.
    fn rise(&self, t: f64) -> f64 {
        let q = t * (t + 2.0 * self.radius * self.mu);
        (self.radius * self.mu + t) / (self.radius * self.radius + q).max(1.0).sqrt()
    }

    /// No slope of the field is steeper where a sample is at least so wide (m).
    fn steepest(&self, footprint: f64) -> f64 {
        let count = (2.0 * self.wavelength / footprint.max(1e-9)).log2().ceil();
        self.steep[count.clamp(0.0, 16.0) as usize] * (1.0 + 8.0 * self.pixel_angle)
    }

    /// The first distance at which the clearance is gone, by steps of a share of the footprint, or longer ones where the slope's bound shows the ray clear, and bisection.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a least step that is not above 0 and an angle that is below it.
    pub fn first(&self, clearance: impl Fn(f64) -> f64) -> Result<Found, Error> {
        for (name, value) in [("least", self.least), ("pixel_angle", self.pixel_angle)] {
            if !(value.is_finite() && value >= 0.0 && (name != "least" || value > 0.0)) {
                return Err(Error::OutOfDomain {
                    name: name.to_owned(),
                    value: value.to_string(),
                    domain: "finite and at least 0; the least step above 0".to_owned(),
                });
            }
        }
        let &Search {
            start,
            radius,
            mu,
            top,
            far,
            pixel_angle,
            share,
            least,
            ..
        } = self;
        let found = |distance| Found {
            distance,
            capped: false,
        };
        let mut t = 0.0;
        let mut left = clearance(0.0);
        if left <= 0.0 {
            return Ok(found(Some(0.0)));
        }
        let mut steps = 0;
        while t < far {
            if steps == MOST_STEPS {
                return Ok(Found {
                    distance: likely_end(start, radius, mu, t, left, far),
                    capped: true,
                });
            }
            steps += 1;
            let above = altitude_along(start, radius, mu, t) - top;
            let rise = self.rise(t);
            if above > 0.0 {
                if rise >= 0.0 {
                    return Ok(found(None));
                }
                // Altitude is convex: the tangent comes down to the highest ground before the ray does.
                t += (above / -rise).max(1e-3);
                left = 0.0;
                continue;
            }
            let footprint = pixel_angle * t;
            // From here on footprints grow and the ray bends upwards: neither makes it come down faster.
            let fall = (self.steepest(footprint) * self.level - rise).max(1e-9);
            // Some for what rounding of heights in `f32` may hide.
            let safe = (left - 0.01) / fall;
            let next = (t + (share * footprint).max(least).max(safe)).min(far);
            left = clearance(next);
            if left <= 0.0 {
                let (mut clear, mut below) = (t, next);
                for _ in 0..60 {
                    let middle = 0.5 * (clear + below);
                    if middle <= clear || middle >= below {
                        break;
                    }
                    if clearance(middle) <= 0.0 {
                        below = middle;
                    } else {
                        clear = middle;
                    }
                }
                return Ok(found(Some(clear)));
            }
            t = next;
        }
        Ok(found(None))
    }
}

impl<T: Real> Prepared<T> {
    /// The search along a ray whose numbers are checked.
    pub(super) fn search(
        &self,
        planet_radius: f64,
        ray: &TerrainRay,
        pixel_angle: f64,
        least: f64,
    ) -> Search {
        let start = ray.origin.altitude();
        let bounds = self.bounds();
        Search {
            start,
            radius: planet_radius + start,
            mu: ray.dir[1],
            top: bounds.map_or(2e4, |b| b.maximum),
            far: ray.far.min(TerrainRay::FARTHEST),
            pixel_angle,
            share: 0.5,
            least,
            steep: bounds.map_or([1e30; 17], |b| b.ladder(self.kind())),
            wavelength: self.lattice(),
            level: ray.dir[0].hypot(ray.dir[2]),
        }
    }

    /// The first place where a ray meets the field as its footprint filters it, by bracketing: steps of half a footprint, at least `least` metres, longer where bounds show the ray clear, and
    /// bisection. A stretch below the ground that is shorter than half a footprint may be missed; nothing else can be. A ray that has taken 2^18 steps (about half a second) ends as
    /// [`TerrainHit::capped`]. The plane is bent below the ray's origin to a ball of the radius `planet_radius` (m), in [1e5, 1e9]; the footprint grows by `pixel_angle` (rad) with the distance.
    /// [`Land::ray_hits`] is the same for a whole land.
    ///
    /// # Errors
    /// As [`TerrainRay::check`]; [`Error::OutOfDomain`] for a radius outside of its domain, an angle that is below 0, a least step that is not above it, and a program's own function, which the
    /// processor does not know.
    pub fn ray_hit(
        &self,
        planet_radius: f64,
        ray: &TerrainRay,
        pixel_angle: f64,
        least: f64,
    ) -> Result<TerrainHit, Error> {
        self.first_hit(planet_radius, ray, pixel_angle, least, 0.5)
    }

    /// [`Prepared::ray_hit`] by steps of another share of the footprint, which is what may be missed.
    pub(super) fn first_hit(
        &self,
        planet_radius: f64,
        ray: &TerrainRay,
        pixel_angle: f64,
        least: f64,
        share: f64,
    ) -> Result<TerrainHit, Error> {
        ray.check(0)?;
        check_radius(planet_radius)?;
        if let Kind::Own { .. } = self.kind() {
            return Err(Error::OutOfDomain {
                name: "field.kind".to_owned(),
                value: "Own".to_owned(),
                domain: "a kind that the processor knows; ray_hits asks the device".to_owned(),
            });
        }
        let search = Search {
            share,
            ..self.search(planet_radius, ray, pixel_angle, least)
        };
        let (start, radius) = (search.start, search.radius);
        let eye = self.place(ray.origin);
        let altitude = |t: f64| altitude_along(start, radius, ray.dir[1], t);
        let ground = |t: f64| {
            let offset = [ray.dir[0] * t, ray.dir[2] * t].map(T::of);
            self.ground_from(eye, offset, T::of(pixel_angle * t))
        };
        let clearance = |t: f64| altitude(t) - ground(t).height.wide();
        let hit = |t: f64| {
            let g = ground(t);
            let (x, y, z) = (ray.dir[0] * t, ray.dir[1] * t, ray.dir[2] * t);
            let out = [x, y + radius, z];
            let length = out.iter().map(|c| c * c).sum::<f64>().sqrt();
            let gradient = [
                out[0] / length - g.slope[0].wide(),
                out[1] / length,
                out[2] / length - g.slope[1].wide(),
            ];
            let size = gradient.iter().map(|c| c * c).sum::<f64>().sqrt();
            TerrainHit {
                distance: t,
                normal: gradient.map(|c| c / size),
                height: g.height.wide(),
                capped: false,
            }
        };
        Ok(search.first(clearance)?.hit(hit))
    }
}

impl Land {
    /// Where rays meet the land, on the processor in `f64`, on the plane and over a ball: [`Prepared::ray_hit`] and [`Globe::ray_hit`] of the field, which is prepared once. Steps are at least 5 cm.
    ///
    /// ```
    /// use veduta::WorldPos;
    /// use veduta::terrain::{Land, TerrainRay};
    /// let land = Land::named("hills")?;
    /// let origin = WorldPos::from_metres([0.0, 3000.0, 0.0].into());
    /// let down = TerrainRay { origin, dir: [0.0, -1.0, 0.0], far: 1e4 };
    /// let hit = land.ray_hits(&[down], 0.001)?[0];
    /// assert!((3000.0 - hit.distance - hit.height).abs() < 0.1);
    /// # Ok::<(), veduta::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Land::check`] and [`TerrainRay::check`], with the ray's index; as [`Prepared::ray_hit`].
    ///
    /// [`Globe::ray_hit`]: super::Globe::ray_hit
    pub fn ray_hits(
        &self,
        rays: &[TerrainRay],
        pixel_angle: f64,
    ) -> Result<Vec<TerrainHit>, Error> {
        self.check()?;
        for (i, ray) in rays.iter().enumerate() {
            ray.check(i)?;
        }
        if self.field.on_sphere() {
            let globe = self.globe::<f64>()?;
            return rays
                .iter()
                .map(|ray| globe.ray_hit(ray, pixel_angle, 0.05))
                .collect();
        }
        let field = self.prepare::<f64>()?;
        rays.iter()
            .map(|ray| field.ray_hit(self.planet_radius, ray, pixel_angle, 0.05))
            .collect()
    }
}
