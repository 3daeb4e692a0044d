//! A height field on a ball: places, the field there in the device's order of operations, and rays.

use super::calibrate;
use super::field::{Bounds, Domain, HeightField, Kind};
use super::ground::Prepared;
use super::land::Land;
use super::noise::octave_seed;
use super::noise_3d::{Place3d, craters_3d, gradient_noise_3d};
use super::rays::{Search, TerrainHit, TerrainRay, altitude_along};
use super::real::Real;
use crate::error::Error;
use crate::programs::blocks::Globe as GlobeBlock;
use crate::view::WorldPos;

/// Where a position lies on the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobePlace<T> {
    /// Lattice cell of the direction times the planet's radius.
    pub cell: [i32; 3],
    /// The rest, in [0, 1].
    pub frac: [T; 3],
    /// Unit vector away from the planet's centre.
    pub up: [T; 3],
}

/// The filtered field at a place of the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobeGround<T> {
    /// Height above the planet's radius (m).
    pub height: T,
    /// Change of the height along the ball of the planet's radius, along the world's axes.
    pub slope: [T; 3],
    /// Mean square of the slopes that the filter took off.
    pub lost: T,
}

/// A height field on a ball with all that follows from its numbers: noise in 3D of the direction from the planet's centre times its radius. The centre lies at (0, -radius, 0)
/// of the world, so that altitudes are y at the origin. See [`Land::globe`].
///
/// ```
/// use veduta::WorldPos;
/// use veduta::terrain::Land;
/// let moon = Land::named("luna")?.globe::<f64>()?;
/// // Below an eye 400 km above the equator, as seen by a sample of a kilometre's width.
/// let eye = moon.above([0.0, 1.0], 400e3);
/// assert!((moon.altitude(eye) - 400e3).abs() < 1e-3);
/// assert!(moon.ground(eye, 1000.0).height.abs() < 2e4);
/// # Ok::<(), veduta::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Globe<T> {
    field: Prepared<T>,
    radius: f64,
    sea: f64,
    bounds: Bounds,
    lattice: f64,
    tallest: f64,
}

impl Land {
    /// The field of a land whose domain is `Sphere`, in `f32` as the device computes it, or in `f64`.
    ///
    /// # Errors
    /// As [`Land::check`]; [`Error::OutOfDomain`] for a field on the plane, which [`HeightField::prepare`] prepares.
    pub fn globe<T: Real>(&self) -> Result<Globe<T>, Error> {
        self.check()?;
        if self.field.domain != Domain::Sphere {
            return Err(Error::OutOfDomain {
                name: "land.field.domain".to_owned(),
                value: format!("{:?}", self.field.domain),
                domain: "Sphere; Land::prepare takes a plane".to_owned(),
            });
        }
        let mut bounds = self.field.bounds()?;
        let sea = self.sea.map_or(-1e30, |s| s.level);
        bounds.minimum = bounds.minimum.max(sea);
        bounds.maximum = bounds.maximum.max(sea);
        Ok(Globe {
            field: Prepared::new(&self.field, &calibrate::tails(&self.field), None, None),
            radius: self.planet_radius,
            sea,
            bounds,
            lattice: self.field.lattice_wavelength(),
            tallest: self.field.tallest(),
        })
    }
}

fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<T: Real> Globe<T> {
    /// Radius of the planet (m).
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// What holds everywhere on it.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// What it is made of.
    pub fn kind(&self) -> Kind {
        self.field.kind()
    }

    /// From the planet's centre (m).
    fn out_from_centre(&self, position: WorldPos) -> [f64; 3] {
        let p = position.to_metres();
        [p.x, p.y + self.radius, p.z]
    }

    /// Altitude of a position above the planet's radius (m).
    pub fn altitude(&self, position: WorldPos) -> f64 {
        let p = position.to_metres();
        let q = p.length_squared() + 2.0 * self.radius * p.y;
        q / (self.radius + (self.radius * self.radius + q).max(0.0).sqrt())
    }

    /// The position at a latitude and a longitude (rad) and an altitude (m). The poles lie on the world's y axis; the longitude 0 is towards +z, and grows towards +x.
    pub fn above(&self, [latitude, longitude]: [f64; 2], altitude: f64) -> WorldPos {
        let r = self.radius + altitude;
        let level = latitude.cos();
        let out = [
            level * longitude.sin(),
            latitude.sin(),
            level * longitude.cos(),
        ];
        WorldPos::from_metres([r * out[0], r * out[1] - self.radius, r * out[2]].into())
    }

    /// The point on the ball of the planet's radius below or above a position, from the centre (m).
    pub(super) fn foot(&self, position: WorldPos) -> [f64; 3] {
        let out = self.out_from_centre(position);
        let length = dot(out, out).sqrt();
        out.map(|c| c * (self.radius / length.max(1e-30)))
    }

    /// Where a position lies on the ball.
    pub fn place(&self, position: WorldPos) -> GlobePlace<T> {
        self.place_of(self.out_from_centre(position))
    }

    fn place_of(&self, from_centre: [f64; 3]) -> GlobePlace<T> {
        let length = dot(from_centre, from_centre).sqrt();
        // At the centre itself any way is up.
        let up = if length > 0.0 {
            from_centre.map(|c| c / length)
        } else {
            [0.0, 1.0, 0.0]
        };
        let axis = |k: usize| {
            let at = up[k] * (self.radius / self.lattice);
            let cell = at.floor();
            let frac = T::of(at - cell);
            // Rounding may reach 1, which is the next cell.
            if frac >= T::of(1.0) {
                (cell as i32 + 1, T::of(0.0))
            } else {
                (cell as i32, frac)
            }
        };
        let all = [axis(0), axis(1), axis(2)];
        GlobePlace {
            cell: all.map(|a| a.0),
            frac: all.map(|a| a.1),
            up: up.map(T::of),
        }
    }

    /// The field below or above a position, filtered by a footprint (m); 0 takes it as it is, and so do footprints below 0 and NaN.
    pub fn ground(&self, position: WorldPos, footprint: T) -> GlobeGround<T> {
        self.ground_at(self.place(position), footprint)
    }

    /// The unit normal of the ground at a place.
    pub fn normal(&self, place: GlobePlace<T>, ground: &GlobeGround<T>) -> [T; 3] {
        let radius = T::of(self.radius);
        let share = radius / (radius + ground.height);
        let out: [T; 3] = std::array::from_fn(|k| place.up[k] - share * ground.slope[k]);
        let length = dot(out, out).root();
        out.map(|c| c / length)
    }

    /// The field at a place of the ball, filtered by a footprint (m) as in [`Globe::ground`].
    pub fn ground_at(&self, place: GlobePlace<T>, footprint: T) -> GlobeGround<T> {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(T::of);
        let field = &self.field;
        let mut p = Place3d::new(place.cell, place.frac);
        let mut reach = field.wavelength / footprint.most(T::of(1e-6));
        let (mut amplitude, mut frequency) = (one, one);
        let mut weight = [one, zero, zero, zero];
        let mut sum = [zero; 4];
        let [mut tail, mut tail_step, ..] = field.mean;
        let [mut rough, mut rough_step, ..] = field.lost;
        let mut mean = [tail, zero, zero, zero];
        let mut lost = rough;
        let cells = T::of(self.radius) / field.wavelength;
        let octaves = field.octaves();
        for i in 0..octaves {
            if reach <= one {
                break;
            }
            let x = (reach - one).least(one);
            let keep = x * x * (T::of(3.0) - two * x);
            let seed = octave_seed(field.seed(), i);
            let q = p.shifted(i);
            p = p.finer();
            let n = gradient_noise_3d(q, seed);
            let mut term = [n[0], frequency * n[1], frequency * n[2], frequency * n[3]];
            match field.kind() {
                Kind::Ridged { .. } => {
                    let size = if field.detail > zero {
                        (n[0] * n[0] + field.detail).root()
                    } else {
                        n[0].size()
                    };
                    let ridge = one - size;
                    let square = ridge * ridge;
                    let off = -two * ridge * (n[0] / size.most(T::of(1e-30))) * frequency;
                    let along = |k: usize| off * weight[0] * n[k] + square * weight[k];
                    term = [square * weight[0], along(1), along(2), along(3)];
                    let next = term.map(|t| field.shape * t);
                    weight = if next[0] >= one {
                        [one, zero, zero, zero]
                    } else {
                        next
                    };
                    term = term.map(|t| t * amplitude);
                }
                Kind::Hybrid { .. } => {
                    let signal = [
                        amplitude * (n[0] + field.shape),
                        amplitude * (frequency * n[1]),
                        amplitude * (frequency * n[2]),
                        amplitude * (frequency * n[3]),
                    ];
                    let along = |k: usize| weight[0] * signal[k] + signal[0] * weight[k];
                    term = [weight[0] * signal[0], along(1), along(2), along(3)];
                    weight = if term[0] >= one {
                        [one, zero, zero, zero]
                    } else {
                        term
                    };
                }
                Kind::Craters { .. } => {
                    let bowls = craters_3d(q, place.up, frequency * cells, field.shape, seed);
                    let both: [T; 4] = std::array::from_fn(|k| bowls[k] + field.detail * n[k]);
                    term = [
                        amplitude * both[0],
                        amplitude * (frequency * both[1]),
                        amplitude * (frequency * both[2]),
                        amplitude * (frequency * both[3]),
                    ];
                }
                _ => term = term.map(|t| t * amplitude),
            }
            for k in 0..4 {
                sum[k] += term[k];
            }
            if let Kind::Hybrid { .. } = field.kind() {
                tail *= field.mean[2];
                rough *= field.lost[2];
            } else {
                tail -= tail_step;
                rough -= rough_step;
            }
            tail_step *= field.mean[2];
            rough_step *= field.lost[2];
            frequency *= two;
            amplitude *= field.fall;
            reach *= T::of(0.5);
            let left = if i + 1 == octaves { zero } else { one };
            let rest = left * tail * (one + field.mean[3] * (one - weight[0]));
            let slope = left * tail * (one + field.mean[3] * (one - two * weight[0]));
            let after = [
                sum[0] + rest * weight[0],
                sum[1] + slope * weight[1],
                sum[2] + slope * weight[2],
                sum[3] + slope * weight[3],
            ];
            let after_lost =
                left * rough.most(zero) * weight[0] * (one + field.lost[3] * (one - weight[0]));
            for k in 0..4 {
                mean[k] = mean[k] * (one - keep) + after[k] * keep;
            }
            lost = (after_lost + (one - keep * keep) * (lost - after_lost)).most(zero);
        }
        let steepness = field.amplitude / field.wavelength;
        let height = field.base + field.amplitude * mean[0];
        let sea = T::of(self.sea);
        if height < sea {
            return GlobeGround {
                height: sea,
                slope: [zero; 3],
                lost: zero,
            };
        }
        let gradient = [mean[1], mean[2], mean[3]];
        let outward = dot(place.up, gradient);
        GlobeGround {
            height,
            slope: std::array::from_fn(|k| steepness * (gradient[k] - place.up[k] * outward)),
            lost: steepness * steepness * lost,
        }
    }

    /// The first place where a ray meets the field as its footprint filters it, by bracketing: steps of half a footprint, at least `least` metres, longer where bounds show the ray clear, and
    /// bisection. A stretch below the ground that is shorter than half a footprint may be missed; nothing else can be. Its places are found in double precision. A ray that has taken 2^18 steps ends
    /// as [`TerrainHit::capped`].
    ///
    /// # Errors
    /// As [`TerrainRay::check`]; [`Error::OutOfDomain`] for an angle that is below 0 and a least step that is not above it.
    pub fn ray_hit(
        &self,
        ray: &TerrainRay,
        pixel_angle: f64,
        least: f64,
    ) -> Result<TerrainHit, Error> {
        ray.check(0)?;
        let eye = self.out_from_centre(ray.origin);
        let start = self.altitude(ray.origin);
        let radius = self.radius + start;
        let mu = dot(eye, ray.dir) / radius;
        let at = |t: f64| std::array::from_fn(|k| eye[k] + ray.dir[k] * t);
        let altitude = |t: f64| altitude_along(start, radius, mu, t);
        let ground = |t: f64| {
            let place = self.place_of(at(t));
            (place, self.ground_at(place, T::of(pixel_angle * t)))
        };
        let clearance = |t: f64| altitude(t) - ground(t).1.height.wide();
        let hit = |t: f64| {
            let (place, g) = ground(t);
            let share = self.radius / (self.radius + altitude(t));
            let out: [f64; 3] =
                std::array::from_fn(|k| place.up[k].wide() - share * g.slope[k].wide());
            let length = dot(out, out).sqrt();
            TerrainHit {
                distance: t,
                normal: out.map(|c| c / length),
                height: g.height.wide(),
                capped: false,
            }
        };
        let search = Search {
            start,
            radius,
            mu,
            top: self.bounds.maximum,
            far: ray.far.min(TerrainRay::FARTHEST_OVER_BALL),
            pixel_angle,
            share: 0.5,
            least,
            steep: self.bounds.ladder(self.kind()),
            wavelength: self.lattice,
            level: 1.01,
        };
        Ok(search.first(clearance)?.hit(hit))
    }
}

impl Globe<f32> {
    /// The block `Globe` of the modules, for an eye. Steps of rays rely on no footprint being smaller than `nearest` (m).
    pub fn block(&self, eye: WorldPos, nearest: f64) -> GlobeBlock {
        let place = self.place(eye);
        let field = &self.field;
        // One octave more than counts: the means of what follows have slopes, too.
        let counted = (0..)
            .zip(&self.bounds.octaves)
            .take_while(|(i, _)| self.lattice * 2.0 > nearest * f64::from(*i).exp2());
        let slopes = &self.bounds.octaves;
        let growth = slopes
            .windows(2)
            .map(|pair| pair[1] / pair[0].max(1e-30))
            .fold(0.0, f64::max);
        GlobeBlock {
            cell: place.cell,
            wavelength: field.wavelength,
            frac: place.frac,
            amplitude: field.amplitude,
            up: place.up,
            base: field.base,
            ground_radius: self.radius as f32,
            eye_altitude: self.altitude(eye) as f32,
            fall: field.fall,
            shape: field.shape,
            detail: field.detail,
            octaves: field.octaves(),
            seed: field.seed(),
            sea: self.sea as f32,
            mean: field.mean,
            lost: field.lost,
            low: self.bounds.minimum as f32,
            high: self.bounds.maximum as f32,
            steepest: (1.01 * counted.map(|(_, s)| s).sum::<f64>()) as f32,
            tallest: (1.0001 * self.tallest) as f32,
            steep: (1.0001 * slopes[0]) as f32,
            steep_growth: (1.0001 * growth) as f32,
            ..Default::default()
        }
    }
}

impl HeightField {
    /// Whether it lies on a ball.
    pub fn on_sphere(&self) -> bool {
        self.domain == Domain::Sphere
    }
}
