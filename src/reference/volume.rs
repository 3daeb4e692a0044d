//! Light in a medium of any density, a cloud for one: scattered once by adaptive quadrature, of all orders by paths.
//!
//! Lengths in metres, coefficients in 1/m, y up. The plane ground is y = 0; a planet's centre lies its radius below the
//! origin. Radiance is relative to the irradiance of the sun across its rays.

use super::math::{add, dot, length, scale};
use super::monte_carlo::{Random, Tally, direction_about, sample_henyey_greenstein};
use super::parallel::parallel_map;
use super::phase::phase_double_henyey_greenstein;
use super::quadrature::{Rule, Tolerance, integrate_kronrod};
use crate::atmosphere::ProbeRay;
use crate::clouds::{CloudDeck, CubeRay, DensityCube, Orders};

/// Where a medium is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Between two planes, with nothing opaque anywhere.
    Slab {
        /// Height of the lower plane.
        bottom: f64,
        /// Height of the upper plane.
        top: f64,
    },
    /// Between two spheres around a planet, whose ground is black.
    Shell {
        /// Radius of the ground.
        ground_radius: f64,
        /// Altitude of the lower sphere, >= 0.
        bottom: f64,
        /// Altitude of the upper sphere.
        top: f64,
    },
    /// A cube from 0 to `size` along each axis, in vacuum.
    Cube {
        /// Its edge.
        size: f64,
    },
}

impl Region {
    /// Altitude of a point.
    pub fn altitude(&self, point: [f64; 3]) -> f64 {
        match *self {
            Self::Slab { .. } | Self::Cube { .. } => point[1],
            Self::Shell { ground_radius, .. } => {
                length([point[0], point[1] + ground_radius, point[2]]) - ground_radius
            }
        }
    }

    /// Distances at which the ray crosses the surface at an altitude, the nearer first.
    fn crossings(&self, level: f64, origin: [f64; 3], dir: [f64; 3]) -> Option<(f64, f64)> {
        match *self {
            Self::Slab { .. } | Self::Cube { .. } => {
                let t = (level - origin[1]) / dir[1];
                t.is_finite().then_some((t, t))
            }
            Self::Shell { ground_radius, .. } => {
                let from_centre = [origin[0], origin[1] + ground_radius, origin[2]];
                let along = dot(from_centre, dir);
                let aside = length(add(from_centre, scale(dir, -along)));
                let radius = ground_radius + level;
                let square = (radius - aside) * (radius + aside);
                (square > 0.0).then(|| (-along - square.sqrt(), -along + square.sqrt()))
            }
        }
    }

    /// Distance at which the ray meets the ground.
    fn ground(&self, origin: [f64; 3], dir: [f64; 3]) -> Option<f64> {
        match self {
            Self::Slab { .. } | Self::Cube { .. } => None,
            Self::Shell { .. } => {
                let (near, far) = self.crossings(0.0, origin, dir)?;
                (far > 0.0 && near > -1e-6).then_some(near.max(0.0))
            }
        }
    }

    /// The stretches of a ray inside the region, up to the ground and to `distance`, which must be finite when the ray is
    /// level inside a slab.
    pub fn stretches(&self, origin: [f64; 3], dir: [f64; 3], distance: f64) -> Vec<(f64, f64)> {
        let (bottom, top) = match *self {
            Self::Slab { bottom, top } | Self::Shell { bottom, top, .. } => (bottom, top),
            Self::Cube { size } => {
                let (mut near, mut far) = (0.0_f64, distance);
                for k in 0..3 {
                    if dir[k] == 0.0 {
                        if !(0.0..=size).contains(&origin[k]) {
                            return Vec::new();
                        }
                        continue;
                    }
                    let [a, b] = [0.0, size].map(|face| (face - origin[k]) / dir[k]);
                    near = near.max(a.min(b));
                    far = far.min(a.max(b));
                }
                return if near < far {
                    vec![(near, far)]
                } else {
                    Vec::new()
                };
            }
        };
        let end = distance.min(self.ground(origin, dir).unwrap_or(f64::INFINITY));
        let mut cuts = vec![0.0, end];
        for level in [bottom, top] {
            if let Some((a, b)) = self.crossings(level, origin, dir) {
                cuts.extend([a, b]);
            }
        }
        cuts.retain(|t| (0.0..=end).contains(t));
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2)
            .map(|pair| (pair[0], pair[1]))
            .filter(|&(a, b)| {
                // A stretch without an end is outside or level; its start tells.
                let middle = if b.is_finite() {
                    0.5 * (a + b)
                } else {
                    a + 1.0
                };
                let altitude = self.altitude(add(origin, scale(dir, middle)));
                b > a && altitude > bottom && altitude < top
            })
            .collect()
    }
}

/// A medium that scatters with two lobes of Henyey and Greenstein.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume<F> {
    /// Where it is.
    pub region: Region,
    /// Density at a point; >= 0.
    pub density: F,
    /// A bound on the density; a greater one that is met is an error and panics.
    pub max_density: f64,
    /// Extinction at a density of 1.
    pub extinction: f64,
    /// Scattered share of the extinction, 0 to 1.
    pub albedo: f64,
    /// Asymmetry of the forward lobe.
    pub g_forward: f64,
    /// Asymmetry of the backward lobe.
    pub g_backward: f64,
    /// Share of the backward lobe.
    pub backward_share: f64,
}

/// Light scattered once along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeLight {
    /// Radiance scattered into the ray [1/sr].
    pub scatter: f64,
    /// Estimated absolute error of that.
    pub error: f64,
    /// Transmittance of the ray.
    pub transmittance: f64,
    /// Points of the ray that were summed; each costs an optical depth towards the sun.
    pub evaluations: usize,
}

/// What to trace through a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePaths {
    /// Paths, at least 2 for a standard error.
    pub samples: usize,
    /// Scatterings counted at most.
    pub max_order: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Irradiance of the sun across its rays.
    pub sun: f64,
    /// Radiance that comes from every direction that is free.
    pub uniform: f64,
}

impl Default for VolumePaths {
    /// 1024 paths of up to 100 000 orders under the sun alone.
    fn default() -> Self {
        Self {
            samples: 1024,
            max_order: 100_000,
            seed: 1,
            sun: 1.0,
            uniform: 0.0,
        }
    }
}

impl<F: Fn([f64; 3]) -> f64> Volume<F> {
    /// Extinction at a point.
    pub fn extinction_at(&self, point: [f64; 3]) -> f64 {
        let density = (self.density)(point);
        assert!(
            (0.0..=self.max_density).contains(&density),
            "the density {density} is outside 0 to {}",
            self.max_density
        );
        self.extinction * density
    }

    /// Value of the phase function for the cosine `mu` between the view and the light [1/sr].
    pub fn phase(&self, mu: f64) -> f64 {
        phase_double_henyey_greenstein(mu, self.g_forward, self.g_backward, self.backward_share)
    }

    /// Optical depth from a point to the sun with its error; infinite behind the planet. The `tolerance` is absolute up to a
    /// depth of 1 and relative above, where little light is left.
    pub fn sun_depth(&self, point: [f64; 3], to_sun: [f64; 3], tolerance: f64) -> (f64, f64) {
        if self.region.ground(point, to_sun).is_some() {
            return (f64::INFINITY, 0.0);
        }
        let depth = integrate_kronrod(
            |t| [self.extinction_at(add(point, scale(to_sun, t)))],
            &self.region.stretches(point, to_sun, f64::INFINITY),
            Tolerance {
                relative: tolerance,
                absolute: tolerance,
                panels: 500,
            },
        );
        (depth.value[0], depth.error[0])
    }

    /// One panel: light scattered towards its start, the error of that from the depths towards the sun, and its depth. Depths
    /// from the panel's start to the points of the rule are by the same rule, so that the order of the rule is kept.
    fn panel(&self, rule: &Rule, ray: &VolumeRay, a: f64, b: f64, tolerance: f64) -> [f64; 3] {
        let at = |t: f64| self.extinction_at(add(ray.origin, scale(ray.dir, t)));
        let [scatter, error, depth] = rule.integrate(
            |t| {
                let extinction = at(t);
                if extinction == 0.0 {
                    return [0.0; 3];
                }
                let before = rule.integrate(|s| [at(s)], a, t)[0];
                let point = add(ray.origin, scale(ray.dir, t));
                let (sun, sun_error) = self.sun_depth(point, ray.to_sun, tolerance);
                let light = extinction * (-before - sun).exp();
                [light, light * sun_error, extinction]
            },
            a,
            b,
        );
        [scatter, error, depth]
    }

    /// Light scattered once on a view ray: composite Gauss-Legendre with `panels` panels of `order` points on each stretch
    /// inside the region. The error falls with the power of twice the order where the density is smooth; `error` holds
    /// only the part of the depths towards the sun, which are adaptive to the `tolerance` (see [`Volume::sun_depth`]).
    pub fn single_scatter_composite(
        &self,
        ray: &VolumeRay,
        panels: usize,
        order: usize,
        tolerance: f64,
    ) -> VolumeLight {
        let rule = Rule::new(order);
        let mut light = self.no_light();
        let mut depth = 0.0f64;
        for (from, to) in self.region.stretches(ray.origin, ray.dir, ray.distance) {
            let edge = |i: usize| from + (to - from) * i as f64 / panels as f64;
            for i in 0..panels {
                let [scatter, error, through] =
                    self.panel(&rule, ray, edge(i), edge(i + 1), tolerance);
                light.scatter += (-depth).exp() * scatter;
                light.error += (-depth).exp() * error;
                light.evaluations += order;
                depth += through;
            }
        }
        self.finish(light, depth, ray)
    }

    /// Light scattered once on a view ray, to about the relative `tolerance` (1e-8 is reached where the density is smooth, 1e-5
    /// costs little in a noise): panels of 5 points from the eye on, halved until halving changes neither the light nor the
    /// depth by more than their share of the tolerance.
    pub fn single_scatter(&self, ray: &VolumeRay, tolerance: f64) -> VolumeLight {
        let rule = Rule::new(5);
        let stretches = self.region.stretches(ray.origin, ray.dir, ray.distance);
        let whole: f64 = stretches.iter().map(|(a, b)| b - a).sum();
        let guess = self.single_scatter_composite(ray, 8, 3, 0.01);
        let level = guess.scatter / (self.albedo * self.phase(dot(ray.dir, ray.to_sun)));
        let level = if level.is_finite() { level } else { 0.0 };
        let mut light = self.no_light();
        let mut depth = 0.0f64;
        // Error of the depth so far, which every later contribution inherits.
        let mut depth_error = 0.0f64;
        for (from, to) in stretches {
            let parts = 8;
            let edge = |i: i32| from + (to - from) * f64::from(i) / f64::from(parts);
            let mut open: Vec<(f64, f64, i32, Option<[f64; 3]>)> = (0..parts)
                .rev()
                .map(|i| (edge(i), edge(i + 1), 0, None))
                .collect();
            while let Some((a, b, halvings, known)) = open.pop() {
                if depth > 60.0 {
                    break;
                }
                let middle = 0.5 * (a + b);
                let mut panel = |a, b| {
                    light.evaluations += rule.points.len();
                    self.panel(&rule, ray, a, b, 0.1 * tolerance)
                };
                let one = known.unwrap_or_else(|| panel(a, b));
                let (left, right) = (panel(a, middle), panel(middle, b));
                let second = (-left[2]).exp();
                let two = [
                    left[0] + second * right[0],
                    left[1] + second * right[1],
                    left[2] + right[2],
                ];
                let before = (-depth).exp();
                let share = tolerance * (b - a) / whole;
                let off = before * (two[0] - one[0]).abs();
                let off_depth = (two[2] - one[2]).abs();
                let near_enough = off <= share * level.max(light.scatter) && off_depth <= share;
                if near_enough || halvings >= 30 {
                    light.scatter += before * two[0];
                    light.error += off + before * (two[1] + two[0] * depth_error);
                    depth += two[2];
                    depth_error += off_depth;
                } else {
                    open.push((middle, b, halvings + 1, Some(right)));
                    open.push((a, middle, halvings + 1, Some(left)));
                }
            }
        }
        self.finish(light, depth, ray)
    }

    fn no_light(&self) -> VolumeLight {
        VolumeLight {
            scatter: 0.0,
            error: 0.0,
            transmittance: 1.0,
            evaluations: 0,
        }
    }

    /// Albedo and phase function, which the sums leave out.
    fn finish(&self, mut light: VolumeLight, depth: f64, ray: &VolumeRay) -> VolumeLight {
        let factor = self.albedo * self.phase(dot(ray.dir, ray.to_sun));
        light.scatter *= factor;
        light.error *= factor;
        light.transmittance = (-depth).exp();
        light
    }

    /// First collision on a ray by delta tracking.
    fn collide(
        &self,
        origin: [f64; 3],
        dir: [f64; 3],
        distance: f64,
        random: &mut Random,
    ) -> Option<[f64; 3]> {
        let majorant = self.extinction * self.max_density;
        for (from, to) in self.region.stretches(origin, dir, distance) {
            let mut t = from;
            loop {
                t += random.exponential() / majorant;
                if t >= to {
                    break;
                }
                let point = add(origin, scale(dir, t));
                if random.unit() * majorant < self.extinction_at(point) {
                    return Some(point);
                }
            }
        }
        None
    }

    /// Share of light that passes from a point to the sun, by ratio tracking; what falls below a hundredth goes on with half
    /// the probability and twice the weight.
    fn sunlight(&self, point: [f64; 3], to_sun: [f64; 3], random: &mut Random) -> f64 {
        if self.region.ground(point, to_sun).is_some() {
            return 0.0;
        }
        let majorant = self.extinction * self.max_density;
        let mut left = 1.0;
        for (from, to) in self.region.stretches(point, to_sun, f64::INFINITY) {
            let mut t = from;
            loop {
                t += random.exponential() / majorant;
                if t >= to {
                    break;
                }
                left *= 1.0 - self.extinction_at(add(point, scale(to_sun, t))) / majorant;
                if left < 0.01 {
                    if random.unit() < 0.5 {
                        return 0.0;
                    }
                    left *= 2.0;
                }
            }
        }
        left
    }

    /// Radiance of all orders up to `paths.max_order` along a view ray, with its standard error, by delta tracking with the
    /// sun's light at every collision. `stream` tells the rays of one seed apart.
    pub fn trace(&self, ray: &VolumeRay, paths: &VolumePaths, stream: u64) -> (f64, f64) {
        let mut random = Random::new(paths.seed, stream);
        let mut tally = Tally::default();
        for _ in 0..paths.samples {
            tally.add(self.path(ray, paths, &mut random));
        }
        (tally.mean(), tally.standard_error())
    }

    fn path(&self, ray: &VolumeRay, paths: &VolumePaths, random: &mut Random) -> f64 {
        let (mut origin, mut dir, mut distance) = (ray.origin, ray.dir, ray.distance);
        let (mut sum, mut weight) = (0.0, 1.0);
        for order in 0..=paths.max_order {
            let Some(point) = self.collide(origin, dir, distance, random) else {
                let free = distance == f64::INFINITY && self.region.ground(origin, dir).is_none();
                return sum + if free { weight * paths.uniform } else { 0.0 };
            };
            if order == paths.max_order {
                break;
            }
            weight *= self.albedo;
            if paths.sun > 0.0 {
                let light = self.sunlight(point, ray.to_sun, random);
                sum += weight * paths.sun * light * self.phase(dot(dir, ray.to_sun));
            }
            let g = if random.unit() < self.backward_share {
                self.g_backward
            } else {
                self.g_forward
            };
            dir = direction_about(dir, sample_henyey_greenstein(g, random), random);
            (origin, distance) = (point, f64::INFINITY);
            if weight < 0.02 {
                if random.unit() >= 0.1 {
                    break;
                }
                weight *= 10.0;
            }
        }
        sum
    }
}

/// The light of rays through a cube of densities, on all cores: radiance, its error (one standard error for all orders) and transmittance.
pub fn cube_light(
    cube: &DensityCube,
    rays: &[CubeRay],
    orders: Orders,
    paths: &VolumePaths,
) -> Vec<[f64; 3]> {
    let most = f64::from(cube.density.iter().copied().fold(0.0, f32::max));
    let volume = Volume {
        region: Region::Cube { size: cube.size },
        density: |p: [f64; 3]| cube.density_at(p.map(|c| (c / cube.size).clamp(0.0, 1.0))),
        // Rounding may lift a mean of equal values.
        max_density: most * (1.0 + 1e-9) + 1e-30,
        extinction: cube.extinction,
        albedo: cube.albedo,
        g_forward: cube.g,
        g_backward: 0.0,
        backward_share: 0.0,
    };
    parallel_map(rays.len(), |i| {
        let ray = VolumeRay {
            origin: scale(rays[i].origin, cube.size),
            dir: rays[i].dir,
            to_sun: rays[i].to_sun,
            distance: f64::INFINITY,
        };
        if orders == Orders::Single {
            let once = volume.single_scatter(&ray, 1e-5);
            return [
                once.scatter * paths.sun,
                once.error * paths.sun,
                once.transmittance,
            ];
        }
        let depth = integrate_kronrod(
            |t| [volume.extinction_at(add(ray.origin, scale(ray.dir, t)))],
            &volume.region.stretches(ray.origin, ray.dir, ray.distance),
            Tolerance {
                relative: 1e-7,
                absolute: 1e-7,
                panels: 500,
            },
        );
        let through = (-depth.value[0]).exp();
        let (mean, error) = volume.trace(&ray, paths, i as u64);
        [mean - paths.uniform * through, error, through]
    })
}

/// The light of a layer alone along rays of the sky's kind, on all cores: radiance, its error (one standard error for all orders) and transmittance. Single
/// scattering is found to about 1e-4; in clouds with forms by paths that end at it, with their standard error. A weather map that was not read shows nothing.
pub fn layer_light(
    deck: &CloudDeck,
    rays: &[ProbeRay],
    orders: Orders,
    paths: &VolumePaths,
) -> Vec<[f64; 3]> {
    if deck.is_empty() {
        return vec![[0.0, 0.0, 1.0]; rays.len()];
    }
    let layer = super::clouds::CloudLayer::of(deck);
    let shape = deck.shape.as_ref().map(|s| super::clouds::CloudShape {
        kind: s.kind,
        kind_spread: s.kind_spread,
        coverage_spread: s.coverage_spread,
        detail: s.detail,
        sharpness: s.sharpness,
        weather_doublings: s.weather_doublings,
    });
    let clear = crate::clouds::WeatherTexels::new(1, vec![[0.0; 2]]).ok();
    let map = deck.mapped().and_then(|(_, map)| {
        let texels = map.texels.as_ref().or(clear.as_ref())?;
        Some((texels, map.repeats(deck.period())))
    });
    let top = deck.bottom + deck.thickness;
    let region = Region::Shell {
        ground_radius: deck.planet_radius,
        bottom: deck.bottom,
        top,
    };
    let volume = Volume {
        region,
        density: |p: [f64; 3]| {
            let altitude = region.altitude(p).clamp(deck.bottom, top);
            let across = [p[0], 0.0, p[2]];
            match &shape {
                Some(shape) => match map {
                    Some((texels, repeats)) => super::clouds::mapped_density(
                        &layer, shape, texels, repeats, across, altitude,
                    ),
                    None => super::clouds::shaped_density(&layer, shape, across, altitude),
                }
                .clamp(0.0, 1.0),
                None => super::clouds::cloud_density(&layer, across, altitude),
            }
        },
        max_density: 1.0 + 1e-12,
        extinction: deck.extinction,
        albedo: deck.albedo,
        g_forward: deck.g_forward,
        g_backward: deck.g_backward,
        backward_share: deck.backward_share,
    };
    parallel_map(rays.len(), |i| {
        let ray = VolumeRay {
            origin: [0.0, rays[i].altitude, 0.0],
            dir: rays[i].dir,
            to_sun: rays[i].to_sun,
            distance: rays[i].distance,
        };
        if orders == Orders::Single && shape.is_none() {
            let once = volume.single_scatter(&ray, 1e-4);
            return [
                once.scatter * paths.sun,
                once.error * paths.sun,
                once.transmittance,
            ];
        }
        // So short that no cloud lies between the points of the first rule.
        let pieces: Vec<(f64, f64)> = volume
            .region
            .stretches(ray.origin, ray.dir, ray.distance)
            .into_iter()
            .flat_map(|(from, to)| {
                let count = ((to - from) / (0.125 * deck.wavelength))
                    .ceil()
                    .clamp(1.0, 1e4);
                let edge = move |k: f64| from + (to - from) * k / count;
                (0..count as i32).map(move |k| (edge(f64::from(k)), edge(f64::from(k + 1))))
            })
            .collect();
        let depth = integrate_kronrod(
            |t| [volume.extinction_at(add(ray.origin, scale(ray.dir, t)))],
            &pieces,
            Tolerance {
                relative: 1e-5,
                absolute: 1e-5,
                panels: 2000 + pieces.len(),
            },
        );
        let once = VolumePaths {
            max_order: paths.max_order.min(1),
            ..*paths
        };
        let counted = if orders == Orders::Single {
            &once
        } else {
            paths
        };
        let (mean, error) = volume.trace(&ray, counted, i as u64);
        [mean, error, (-depth.value[0]).exp()]
    })
}

/// A view ray through a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeRay {
    /// Start.
    pub origin: [f64; 3],
    /// Unit vector of the view.
    pub dir: [f64; 3],
    /// Unit vector to the sun.
    pub to_sun: [f64; 3],
    /// Where the ray ends; may be infinite.
    pub distance: f64,
}
