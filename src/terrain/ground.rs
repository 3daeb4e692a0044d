//! The field at a place, in the device's order of operations.

use std::sync::Arc;

use super::calibrate::Tails;
use super::field::{Bounds, HeightField, Kind};
use super::map::Pyramid;
use super::noise::{Place, craters, gradient_noise, octave_seed};
use super::real::Real;
use crate::view::WorldPos;

/// The filtered field at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground<T> {
    /// Height (m).
    pub height: T,
    /// Slope (dh/dx, dh/dz).
    pub slope: [T; 2],
    /// Mean square of the slopes that the filter took off.
    pub lost: T,
}

impl<T: Real> Ground<T> {
    /// The upward unit normal.
    pub fn normal(&self) -> [T; 3] {
        let [x, z] = self.slope;
        let one = T::of(1.0);
        let length = (one + x * x + z * z).root();
        [-x / length, one / length, -z / length]
    }
}

/// What strata make of a value of a given variance: the mean, its slope, and what its slope's square varies by.
pub(super) fn strata<T: Real>(value: T, period: T, hardness: T, variance: T) -> [T; 3] {
    let (one, two) = (T::of(1.0), T::of(2.0));
    let turn = value / period;
    let r = turn - (turn + T::of(0.5)).whole();
    let q = r * r;
    let series = |all: &[f64]| {
        all.iter()
            .skip(1)
            .fold(T::of(all[0]), |sum, c| sum * q + T::of(*c))
    };
    let s = r * series(&[
        0.0772201193526,
        -0.598045169271,
        2.55003137647,
        -5.16770687888,
        3.14159258004,
    ]);
    let c = series(&[
        -0.0243967164202,
        0.234937559128,
        -1.33521205679,
        4.05870916436,
        -4.93480213723,
        0.999999999781,
    ]);
    let sine = two * s * c;
    let cosine = one - two * s * s;
    let base = one / (one + T::of(1.23370055) * variance / (period * period));
    let power = |x: T| x * x;
    let e = power(power(power(power(base))));
    let e_four = power(power(e));
    let e_eight = power(e_four);
    let e_nine = e_eight * e;
    let e_sixteen = power(e_eight);
    let sine_two = two * cosine * sine;
    let cosine_two = two * cosine * cosine - one;
    let sine_three = two * cosine * sine_two - sine;
    let cosine_three = two * cosine * cosine_two - cosine;
    let sine_four = two * cosine * sine_three - sine_two;
    let cosine_four = two * cosine * cosine_three - cosine_two;
    let wave = T::of(0.8) * e * sine
        + T::of(0.3) * e_four * sine_two
        + T::of(0.13333333) * e_nine * sine_three
        + T::of(0.05) * e_sixteen * sine_four;
    let slope = T::of(0.8) * e * cosine
        + T::of(0.6) * e_four * cosine_two
        + T::of(0.4) * e_nine * cosine_three
        + T::of(0.2) * e_sixteen * cosine_four;
    let spread = T::of(0.64) * (one - e * e)
        + T::of(0.36) * (one - e_four * e_four)
        + T::of(0.16) * (one - e_nine * e_nine)
        + T::of(0.04) * (one - e_sixteen * e_sixteen);
    [
        value + T::of(std::f64::consts::FRAC_1_PI) * hardness * period * wave,
        one + two * hardness * slope,
        two * hardness * hardness * spread,
    ]
}

/// A field with all that follows from its numbers. In `f32` it does what the device does, operation by operation; see [`HeightField::prepare`].
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared<T> {
    kind: Kind,
    octaves: i32,
    seed: u32,
    lattice: f64,
    /// Place of the lattice's origin (x, z) (m).
    origin: [f64; 2],
    map: Option<Arc<Pyramid>>,
    bounds: Option<Arc<Bounds>>,
    /// Wavelength of the lattice (m).
    pub(super) wavelength: T,
    pub(super) amplitude: T,
    pub(super) base: T,
    pub(super) fall: T,
    pub(super) shape: T,
    pub(super) detail: T,
    /// Total, first, ratio, bend.
    pub(super) mean: [T; 4],
    pub(super) lost: [T; 4],
    /// Height of the sea.
    pub(super) sea: T,
}

impl<T: Real> Prepared<T> {
    pub(super) fn new(
        field: &HeightField,
        tails: &Tails,
        map: Option<Arc<Pyramid>>,
        bounds: Option<Bounds>,
    ) -> Prepared<T> {
        let [mut shape, detail] = field.kind.parameters();
        if let Some(map) = &map {
            shape = f64::from(map.edge.number());
        }
        // Detail without height takes no rounds.
        let plain = map.is_some() && field.amplitude == 0.0;
        let four = |t: &super::calibrate::Tail| [t.total, t.first, t.ratio, t.bend].map(T::of);
        Prepared {
            kind: field.kind,
            octaves: if plain { 0 } else { field.octaves as i32 },
            seed: field.seed,
            lattice: field.lattice_wavelength(),
            origin: field.map.as_ref().map_or([0.0; 2], |m| m.origin),
            map,
            bounds: bounds.map(Arc::new),
            wavelength: T::of(field.lattice_wavelength()),
            amplitude: T::of(field.amplitude),
            base: T::of(field.base),
            fall: T::of((-field.hurst).exp2()),
            shape: T::of(shape),
            detail: T::of(detail),
            mean: four(&tails.mean),
            lost: four(&tails.lost),
            sea: T::of(-1e30),
        }
    }

    /// With a sea of a level (m) over it.
    pub(super) fn under_sea(mut self, level: f64) -> Prepared<T> {
        self.sea = T::of(level);
        if let Some(bounds) = self.bounds.as_deref() {
            let mut bounds = bounds.clone();
            bounds.minimum = bounds.minimum.max(level);
            bounds.maximum = bounds.maximum.max(level);
            self.bounds = Some(Arc::new(bounds));
        }
        self
    }

    /// What it is made of.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What holds everywhere on it; `None` for a program's own function of which nothing is said.
    pub fn bounds(&self) -> Option<&Bounds> {
        self.bounds.as_deref()
    }

    /// Wavelength of the lattice (m).
    pub(super) fn lattice(&self) -> f64 {
        self.lattice
    }

    /// Octaves.
    pub fn octaves(&self) -> i32 {
        self.octaves
    }

    /// Seed of the lattice.
    pub fn seed(&self) -> u32 {
        self.seed
    }

    /// Where a position lies on the field's lattice, exact to the last place of the fraction at any distance from the origin.
    pub fn place(&self, position: WorldPos) -> Place<T> {
        const UNIT: f64 = (1_u64 << 20) as f64;
        let mut p = position.normalized();
        if self.origin != [0.0; 2] {
            p = p.moved_by([-self.origin[0], 0.0, -self.origin[1]].into());
        }
        let period = (self.lattice * UNIT).round() as i128;
        let axis = |axis: usize| {
            let fraction = f64::from(p.frac[axis]) * UNIT;
            let at = (i128::from(p.cell[axis]) << 20) + fraction.floor() as i128;
            let cell = at.div_euclid(period);
            let rest = at.rem_euclid(period) as f64 + fraction.fract();
            let frac = T::of(rest / period as f64);
            // Rounding may reach 1, which is the next cell.
            let over = frac >= T::of(1.0);
            let mut cell = cell + i128::from(over);
            if let Some(map) = &self.map {
                cell = map.reduced(cell, axis / 2);
            }
            let wrapped = cell.rem_euclid(1 << 32) as u32;
            let frac = if over { T::of(0.0) } else { frac };
            (wrapped.cast_signed(), frac)
        };
        let (x, z) = (axis(0), axis(2));
        Place {
            cell: [x.0, z.0],
            frac: [x.1, z.1],
        }
    }

    /// The field at a position, filtered by a footprint (m); 0 takes it as it is, and so do footprints below 0 and NaN. NaN for a program's own function, which only the device knows.
    pub fn ground(&self, position: WorldPos, footprint: T) -> Ground<T> {
        self.ground_at(self.place(position), footprint)
    }

    /// The field at an offset (x, z) in metres from a place, as the device has it from the eye's, filtered by a footprint (m) as in [`Prepared::ground`].
    pub fn ground_from(&self, eye: Place<T>, offset: [T; 2], footprint: T) -> Ground<T> {
        self.ground_at(self.moved(eye, offset), footprint)
    }

    /// The place so many metres (x, z) from another.
    pub(super) fn moved(&self, eye: Place<T>, offset: [T; 2]) -> Place<T> {
        // Whole cells are taken off before the division, by parts whose products are exact.
        let (high, low) = self.wavelength.parts();
        let whole = offset.map(|o| (o / self.wavelength).whole());
        let frac = std::array::from_fn(|k| {
            let rest = (offset[k] - whole[k] * high) - whole[k] * low;
            eye.frac[k] + rest / self.wavelength
        });
        let place = Place::new(eye.cell, frac);
        let cell =
            std::array::from_fn(|k| place.cell[k].wrapping_add(whole[k].wide() as i64 as i32));
        Place { cell, ..place }
    }

    /// The pyramid of a height map.
    pub(super) fn map(&self) -> Option<Arc<Pyramid>> {
        self.map.clone()
    }

    /// The field at a place on its lattice, filtered by a footprint (m) as in [`Prepared::ground`], or the level sea above it where there is one.
    pub fn ground_at(&self, place: Place<T>, footprint: T) -> Ground<T> {
        let bare = self.bare_at(place, footprint);
        if bare.height < self.sea {
            let none = T::of(0.0);
            return Ground {
                height: self.sea,
                slope: [none; 2],
                lost: none,
            };
        }
        bare
    }

    /// The field at a place on its lattice, below the sea too.
    pub(super) fn bare_at(&self, place: Place<T>, footprint: T) -> Ground<T> {
        // NaN too.
        let footprint = footprint.most(T::of(0.0));
        if let Some(map) = &self.map {
            let detail = self.octave_sum(place, footprint);
            let map = map.ground(place, self.wavelength, footprint);
            return Ground {
                height: map.height + detail.height,
                slope: [0, 1].map(|k| map.slope[k] + detail.slope[k]),
                lost: map.lost + detail.lost,
            };
        }
        match self.kind {
            Kind::Own { .. } => {
                let none = T::of(f64::NAN);
                Ground {
                    height: none,
                    slope: [none; 2],
                    lost: none,
                }
            }
            Kind::Mix { .. } => self.mix_sum(place, footprint),
            _ => self.octave_sum(place, footprint),
        }
    }

    fn octave_sum(&self, start: Place<T>, footprint: T) -> Ground<T> {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(T::of);
        let mut p = start;
        let mut reach = self.wavelength / footprint.most(T::of(1e-6));
        let (mut amplitude, mut frequency) = (one, one);
        let mut weight = [one, zero, zero];
        let mut sum = [zero; 3];
        let [mut tail, mut tail_step, ..] = self.mean;
        let [mut rough, mut rough_step, ..] = self.lost;
        let mesa = matches!(self.kind, Kind::Mesa { .. });
        // The mesa follows the variance of what is left in the place of its mean, which is 0.
        let mut mean = [if mesa { zero } else { tail }, zero, zero];
        let mut variance = tail;
        let mut lost = rough;
        for i in 0..self.octaves {
            if reach <= one {
                break;
            }
            let x = (reach - one).least(one);
            let keep = x * x * (T::of(3.0) - two * x);
            let seed = octave_seed(self.seed, i);
            let q = p.shifted(i);
            p = p.finer();
            let n = gradient_noise(q, seed);
            let mut term = [n[0], frequency * n[1], frequency * n[2]];
            match self.kind {
                Kind::Ridged { .. } => {
                    let size = if self.detail > zero {
                        (n[0] * n[0] + self.detail).root()
                    } else {
                        n[0].size()
                    };
                    let ridge = one - size;
                    let square = ridge * ridge;
                    let off = -two * ridge * (n[0] / size.most(T::of(1e-30))) * frequency;
                    let along = |k: usize| off * weight[0] * n[k] + square * weight[k];
                    term = [square * weight[0], along(1), along(2)];
                    let next = term.map(|t| self.shape * t);
                    weight = if next[0] >= one {
                        [one, zero, zero]
                    } else {
                        next
                    };
                    term = term.map(|t| t * amplitude);
                }
                Kind::Hybrid { .. } => {
                    let signal = [
                        amplitude * (n[0] + self.shape),
                        amplitude * (frequency * n[1]),
                        amplitude * (frequency * n[2]),
                    ];
                    let along = |k: usize| weight[0] * signal[k] + signal[0] * weight[k];
                    term = [weight[0] * signal[0], along(1), along(2)];
                    weight = if term[0] >= one {
                        [one, zero, zero]
                    } else {
                        term
                    };
                }
                Kind::Craters { .. } => {
                    let bowls = craters(q, self.shape, seed);
                    let both: [T; 3] = std::array::from_fn(|k| bowls[k] + self.detail * n[k]);
                    term = [
                        amplitude * both[0],
                        amplitude * (frequency * both[1]),
                        amplitude * (frequency * both[2]),
                    ];
                }
                _ => term = term.map(|t| t * amplitude),
            }
            for k in 0..3 {
                sum[k] += term[k];
            }
            if let Kind::Hybrid { .. } = self.kind {
                tail *= self.mean[2];
                rough *= self.lost[2];
            } else {
                tail -= tail_step;
                rough -= rough_step;
            }
            tail_step *= self.mean[2];
            rough_step *= self.lost[2];
            frequency *= two;
            amplitude *= self.fall;
            reach *= T::of(0.5);
            let left = if i + 1 == self.octaves { zero } else { one };
            let means = if mesa { zero } else { left * tail };
            let rest = means * (one + self.mean[3] * (one - weight[0]));
            let slope = means * (one + self.mean[3] * (one - two * weight[0]));
            let after = [
                sum[0] + rest * weight[0],
                sum[1] + slope * weight[1],
                sum[2] + slope * weight[2],
            ];
            let after_lost =
                left * rough.most(zero) * weight[0] * (one + self.lost[3] * (one - weight[0]));
            for k in 0..3 {
                mean[k] = mean[k] * (one - keep) + after[k] * keep;
            }
            let after_variance = left * tail.most(zero);
            variance = after_variance + (one - keep * keep) * (variance - after_variance);
            lost = (after_lost + (one - keep * keep) * (lost - after_lost)).most(zero);
        }
        if mesa {
            let across = footprint / self.wavelength;
            let within = T::of(0.083_333_333) * across * across * (self.lost[0] - lost).most(zero);
            let [value, slope, spread] = strata(
                mean[0],
                self.shape,
                self.detail,
                variance.most(zero) + within,
            );
            let square = mean[1] * mean[1] + mean[2] * mean[2];
            lost = lost * (slope * slope + spread) + spread * square;
            mean = [value, slope * mean[1], slope * mean[2]];
        }
        self.scaled(mean, lost)
    }

    fn scaled(&self, value: [T; 3], lost: T) -> Ground<T> {
        let steepness = self.amplitude / self.wavelength;
        Ground {
            height: self.base + self.amplitude * value[0],
            slope: [steepness * value[1], steepness * value[2]],
            lost: steepness * steepness * lost,
        }
    }

    /// A part of the mix: value, slope per cell, and the mean square of the slopes left out.
    fn mix_part(
        &self,
        start: Place<T>,
        [level, octaves]: [i32; 2],
        total: T,
        seed: u32,
        footprint: T,
    ) -> [T; 4] {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(T::of);
        let mut p = start;
        let mut frequency = one;
        for _ in 0..level {
            p = p.finer();
            frequency *= two;
        }
        let mut reach = self.wavelength / (frequency * footprint.most(T::of(1e-6)));
        let mut amplitude = one;
        let mut rough_step = self.lost[1] * frequency * frequency;
        let mut rough = total;
        let mut sum = [zero; 3];
        let mut lost = rough;
        for i in 0..octaves {
            if reach <= one {
                break;
            }
            let x = (reach - one).least(one);
            let keep = x * x * (T::of(3.0) - two * x);
            let n = gradient_noise(p.shifted(level + i), octave_seed(seed, i));
            p = p.finer();
            let scale = amplitude * keep;
            sum[0] += scale * n[0];
            sum[1] += scale * (frequency * n[1]);
            sum[2] += scale * (frequency * n[2]);
            rough = if i + 1 == octaves {
                zero
            } else {
                rough - rough_step
            };
            lost = (rough + (one - keep * keep) * rough_step).most(zero);
            rough_step *= self.lost[2];
            frequency *= two;
            amplitude *= self.fall;
            reach *= T::of(0.5);
        }
        [sum[0], sum[1], sum[2], lost]
    }

    fn mix_sum(&self, start: Place<T>, footprint: T) -> Ground<T> {
        let [zero, one] = [0.0, 1.0].map(T::of);
        let [tenth, fifth] = [0.1, 0.2].map(T::of);
        let part = |shape: [i32; 2], total: T, seed: u32| {
            self.mix_part(start, shape, total, self.seed.wrapping_add(seed), footprint)
        };
        let fine = part([3, self.octaves], self.lost[0], 0);
        let middle = part([2, 3], self.mean[0], 1);
        let coarse = part([0, 1], self.lost[1], 2);
        let lift = (one + middle[0]).most(zero);
        let (mut power, mut below) = (one, zero);
        for _ in 0..self.shape.wide() as i32 {
            below = power;
            power *= lift;
        }
        let bend = tenth * fine[0] * self.shape * below;
        let along = |k: usize| tenth * power * fine[k] + (bend + fifth) * middle[k] + coarse[k];
        let value = [
            tenth * fine[0] * power + fifth * middle[0] + coarse[0],
            along(1),
            along(2),
        ];
        let lost = T::of(0.01) * power * power * fine[3]
            + (bend + fifth) * (bend + fifth) * middle[3]
            + coarse[3];
        self.scaled(value, lost)
    }
}
