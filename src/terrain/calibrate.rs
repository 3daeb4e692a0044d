//! What the octaves that a footprint leaves out would have been in the mean, from the distribution of the noise.

use std::sync::OnceLock;

use super::field::{Domain, HeightField, Kind};
use super::noise::{Place, craters, gradient_noise};
use super::noise_3d::{Place3d, craters_3d, gradient_noise_3d};

/// The sum of a geometric series over the octaves left, and its bend with the weight: see `veduta::terrain::field`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tail {
    /// The whole sum.
    pub total: f64,
    /// Its first term.
    pub first: f64,
    /// The ratio of the terms.
    pub ratio: f64,
    /// How it departs from being in proportion to the weight.
    pub bend: f64,
}

/// Mean and mean square of the slopes of what is left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tails {
    /// Of the value.
    pub mean: Tail,
    /// Of the squared slope, per cell of the lattice.
    pub lost: Tail,
}

/// A value of a noise and its slope, squared.
type Sample = [f64; 2];

const SAMPLES: usize = 2048;

/// Places spread evenly over random cells.
fn places() -> impl Iterator<Item = (Place<f64>, u32)> {
    (0..SAMPLES as i32).map(|i| {
        // Roberts' additive recurrence in two dimensions.
        let at = |step: f64| (f64::from(i) * step).fract();
        let place = Place {
            cell: [i.wrapping_mul(7919), i.wrapping_mul(-104_729)],
            frac: [at(0.754_877_666_246_693), at(0.569_840_290_998_053)],
        };
        (place, i.cast_unsigned().wrapping_mul(0x85eb_ca6b))
    })
}

fn sample([value, x, z]: [f64; 3]) -> Sample {
    [value, x * x + z * z]
}

fn noise() -> &'static [Sample] {
    static NOISE: OnceLock<Vec<Sample>> = OnceLock::new();
    NOISE.get_or_init(|| {
        places()
            .map(|(place, seed)| sample(gradient_noise(place, seed)))
            .collect()
    })
}

/// Places spread evenly over random cells in 3D, each with a random way that is up.
fn places_3d() -> impl Iterator<Item = (Place3d<f64>, [f64; 3], u32)> {
    (0..SAMPLES as i32).map(|i| {
        // Roberts' additive recurrence in five dimensions.
        let at = |step: f64| (f64::from(i) * step).fract();
        let place = Place3d {
            cell: [7919, -104_729, 15_485_863].map(|n: i32| i.wrapping_mul(n)),
            frac: [
                at(0.881_271_407_148_6),
                at(0.776_639_293_066_8),
                at(0.684_430_002_545_2),
            ],
        };
        let (height, turn) = (2.0 * at(0.603_168_596_9) - 1.0, at(0.531_555_235));
        let level = (1.0 - height * height).sqrt();
        let (sine, cosine) = (std::f64::consts::TAU * turn).sin_cos();
        let up = [level * cosine, height, level * sine];
        (place, up, i.cast_unsigned().wrapping_mul(0x85eb_ca6b))
    })
}

/// Value, and square of the slope across `up`.
fn sample_3d([value, x, y, z]: [f64; 4], up: [f64; 3]) -> Sample {
    let along = x * up[0] + y * up[1] + z * up[2];
    [value, x * x + y * y + z * z - along * along]
}

fn noise_3d() -> &'static [Sample] {
    static NOISE: OnceLock<Vec<Sample>> = OnceLock::new();
    NOISE.get_or_init(|| {
        places_3d()
            .map(|(place, up, seed)| sample_3d(gradient_noise_3d(place, seed), up))
            .collect()
    })
}

/// Points of the weight on which the means are kept.
const GRID: usize = 17;

/// A function of the weight.
#[derive(Clone, Copy)]
struct Curve([f64; GRID]);

impl Curve {
    /// Value and slope, along the first piece for weights below 0.
    fn at(&self, weight: f64) -> [f64; 2] {
        let x = weight * (GRID - 1) as f64;
        let i = (x.max(0.0) as usize).min(GRID - 2);
        let rise = self.0[i + 1] - self.0[i];
        [self.0[i] + rise * (x - i as f64), rise * (GRID - 1) as f64]
    }
}

/// The geometric series that comes closest to sums, relative to their size, and the mean bend.
fn fit(sums: &[Curve]) -> Tail {
    let ends: Vec<f64> = sums.iter().map(|c| c.0[GRID - 1]).collect();
    if ends[0].abs() < 1e-9 {
        return Tail::default();
    }
    let count = ends.len();
    let mut best = (f64::INFINITY, Tail::default());
    for step in 0..600 {
        let ratio = 0.01 * 600_f64.powf(f64::from(step) / 600.0);
        let shape: Vec<f64> = (0..count)
            .map(|k| (k..count).map(|j| ratio.powi(j as i32)).sum())
            .collect();
        let (mut top, mut bottom) = (0.0, 0.0);
        for (s, e) in shape.iter().zip(&ends) {
            let x = s / e;
            (top, bottom) = (top + x, bottom + x * x);
        }
        let first = top / bottom;
        let error: f64 = shape
            .iter()
            .zip(&ends)
            .map(|(s, e)| (first * s / e - 1.0).powi(2))
            .sum();
        if error < best.0 {
            let total = first * shape[0];
            best = (
                error,
                Tail {
                    total,
                    first,
                    ratio,
                    bend: 0.0,
                },
            );
        }
    }
    let bends = sums
        .iter()
        .map(|c| 4.0 * c.at(0.5)[0] / c.0[GRID - 1] - 2.0);
    Tail {
        bend: bends.sum::<f64>() / count as f64,
        ..best.1
    }
}

/// The geometric sequence through the first and the third of sums, and the mean bend.
fn sequence(sums: &[Curve]) -> Tail {
    let end = |k: usize| sums[k].0[GRID - 1];
    let middle = (sums.len() - 1).min(2);
    if end(0).abs() < 1e-9 || middle == 0 {
        return Tail {
            total: end(0),
            ratio: 1.0,
            ..Tail::default()
        };
    }
    Tail {
        total: end(0),
        first: 0.0,
        ratio: (end(middle) / end(0)).powf(1.0 / middle as f64),
        bend: 4.0 * sums[0].at(0.5)[0] / end(0) - 2.0,
    }
}

/// The tails of a field.
pub fn tails(field: &HeightField) -> Tails {
    let octaves = field.octaves as i32;
    let fall = |i: i32| (-field.hurst * f64::from(i)).exp2();
    let basis = match field.domain {
        Domain::Plane => noise(),
        Domain::Sphere => noise_3d(),
    };
    let mean_square = basis.iter().map(|s| s[1]).sum::<f64>() / SAMPLES as f64;
    let ratio = 4.0 * fall(2);
    let series = |count: i32, frequency: f64| {
        mean_square * frequency * frequency * (0..count).map(|i| ratio.powi(i)).sum::<f64>()
    };
    let own: Vec<Sample>;
    let samples = match field.kind {
        Kind::Own { .. } => return Tails::default(),
        Kind::Mix { .. } => {
            // Sums only: of the fine and the middle part the totals are kept, and the noise's own mean square.
            let mean = Tail {
                total: series(3, 4.0),
                ..Tail::default()
            };
            let lost = Tail {
                total: series(octaves, 8.0),
                first: mean_square,
                ratio,
                bend: 0.0,
            };
            return Tails { mean, lost };
        }
        Kind::Mesa { .. } => {
            // In the mean's place stands the variance of the values that are left out.
            let own = basis.iter().map(|s| s[0] * s[0]).sum::<f64>() / SAMPLES as f64;
            let sum = |first: f64, ratio: f64| Tail {
                total: first * (0..octaves).map(|i| ratio.powi(i)).sum::<f64>(),
                first,
                ratio,
                bend: 0.0,
            };
            return Tails {
                mean: sum(own, fall(2)),
                lost: sum(mean_square, ratio),
            };
        }
        Kind::Fbm | Kind::Map => {
            let lost = Tail {
                total: series(octaves, 1.0),
                first: mean_square,
                ratio,
                bend: 0.0,
            };
            let mean = Tail::default();
            return Tails { mean, lost };
        }
        Kind::Craters { share, roughness } if field.domain == Domain::Sphere => {
            own = places_3d()
                .map(|(place, up, seed)| {
                    let bowls = craters_3d(place, up, 1000.0, share, seed);
                    let between = gradient_noise_3d(place, seed);
                    let both = std::array::from_fn(|k| bowls[k] + roughness * between[k]);
                    sample_3d(both, up)
                })
                .collect();
            &own[..]
        }
        Kind::Craters { share, roughness } => {
            own = places()
                .map(|(place, seed)| {
                    let bowls = craters(place, share, seed);
                    let between = gradient_noise(place, seed);
                    sample(std::array::from_fn(|k| bowls[k] + roughness * between[k]))
                })
                .collect();
            &own[..]
        }
        Kind::Hybrid { .. } | Kind::Ridged { .. } => basis,
    };
    let [shape, detail] = field.kind.parameters();
    // What octave i adds for a weight and a noise, its change with the noise, the weight of the next and its change.
    let step = |i: i32, weight: f64, n: f64| -> [f64; 4] {
        let a = fall(i);
        match field.kind {
            Kind::Hybrid { .. } => {
                let term = weight * a * (n + shape);
                if term >= 1.0 {
                    [term, weight * a, 1.0, 0.0]
                } else {
                    [term, weight * a, term, weight * a]
                }
            }
            Kind::Ridged { .. } => {
                let size = (n * n + detail).sqrt();
                let ridge = 1.0 - size;
                let term = weight * ridge * ridge;
                let change = -2.0 * weight * ridge * n / size.max(1e-30);
                if shape * term >= 1.0 {
                    [a * term, a * change, 1.0, 0.0]
                } else {
                    [a * term, a * change, shape * term, shape * change]
                }
            }
            _ => [a * n, a, 1.0, 0.0],
        }
    };
    let count = samples.len() as f64;
    let mut means = vec![Curve([0.0; GRID]); octaves as usize + 1];
    let mut losts = means.clone();
    for i in (0..octaves).rev() {
        let at = i as usize;
        let (next_mean, next_lost) = (means[at + 1], losts[at + 1]);
        for g in 0..GRID {
            let weight = g as f64 / (GRID - 1) as f64;
            let (mut mean, mut lost) = (0.0, 0.0);
            for [n, square] in samples {
                let [term, change, next, next_change] = step(i, weight, *n);
                let [rest, slope] = next_mean.at(next);
                mean += term + rest;
                let through = change + slope * next_change;
                lost += 4_f64.powi(i) * square * through * through + next_lost.at(next)[0];
            }
            means[at].0[g] = mean / count;
            losts[at].0[g] = lost / count;
        }
    }
    means.pop();
    losts.pop();
    if let Kind::Hybrid { .. } = field.kind {
        return Tails {
            mean: sequence(&means),
            lost: sequence(&losts),
        };
    }
    let (mut mean, mut lost) = (fit(&means), fit(&losts));
    if let Kind::Craters { .. } = field.kind {
        // There is no weight.
        (mean.bend, lost.bend) = (0.0, 0.0);
    }
    Tails { mean, lost }
}
