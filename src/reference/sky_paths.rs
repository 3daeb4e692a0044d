//! Sky radiance of all orders of scattering by tracing paths from the eye, with standard errors.
//!
//! Every channel has its own paths, so that the channels' errors are independent. Units as in [`super::sky`].

use super::math::{add, dot, length, scale};
use super::monte_carlo::{
    Measured, Random, Tally, direction_about, lambert, sample_lambert, sample_lobe,
};
use super::parallel::parallel_map;
use super::sky::{Chord, Reach, Sky, SkyRay};
use crate::atmosphere::{Lobe, MOST_LANES};
use std::f64::consts::PI;

/// How distances and transmittances are found. Both are unbiased and share no step of that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// The first scattering is placed by importance along the view ray, weighted with its exact transmittance, and the
    /// sun's light is the exact transmittance by quadrature. The least variance.
    #[default]
    Quadrature,
    /// Delta tracking for distances and ratio tracking for the sun's light; no quadrature at all.
    Tracking,
}

/// What to trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paths {
    /// Paths a ray and channel, at least 2 for a standard error.
    pub samples: usize,
    /// Scatterings and reflections counted at most; 1 is single scattering and the ground under the sun alone.
    pub max_order: u32,
    /// Scatterings and reflections counted at least, from 1; 2 leaves out what quadrature knows exactly.
    pub first_order: u32,
    /// Whether the light that the ground at the end of the view ray sends straight to the eye is counted.
    pub seen_ground: bool,
    /// Seed of the random numbers.
    pub seed: u64,
    /// How the estimate is made.
    pub estimator: Estimator,
    /// Irradiance of the sun across its rays, outside the air.
    pub sun: f64,
    /// Radiance that comes into the air from every direction, in place of black space.
    pub uniform: f64,
}

impl Default for Paths {
    /// 1024 paths of up to 1000 orders under the sun alone.
    fn default() -> Self {
        Self {
            samples: 1024,
            max_order: 1000,
            first_order: 1,
            seen_ground: true,
            seed: 1,
            estimator: Estimator::Quadrature,
            sun: 1.0,
            uniform: 0.0,
        }
    }
}

/// Where a flight ended.
enum End {
    /// At a particle.
    Air([f64; 3]),
    /// At the ground.
    Ground([f64; 3]),
    /// Outside the air.
    Space,
    /// At the end of the view ray.
    Limit,
}

/// What a place scatters.
struct Scattering {
    /// By each scatterer.
    parts: [f64; MOST_LANES],
    /// By all.
    sum: f64,
}

const NOTHING: Scattering = Scattering {
    parts: [0.0; MOST_LANES],
    sum: 0.0,
};

/// One channel of one ray's paths.
struct Tracer<'a> {
    sky: &'a Sky,
    paths: &'a Paths,
    to_sun: [f64; 3],
    channel: usize,
    albedo: f64,
    /// The channel's extinction of each profile.
    extinctions: [f64; MOST_LANES],
    /// The channel's scattering of each scatterer, which profile it has, and its lobe.
    scatterers: Vec<(f64, usize, Lobe)>,
}

/// Stretches of the view ray with the probability of each.
struct Bins {
    edges: Vec<f64>,
    cumulative: Vec<f64>,
}

impl Bins {
    /// A place with its density.
    fn sample(&self, random: &mut Random) -> (f64, f64) {
        let u = random.unit();
        let i = self
            .cumulative
            .partition_point(|c| *c <= u)
            .min(self.cumulative.len() - 1);
        let before = if i > 0 { self.cumulative[i - 1] } else { 0.0 };
        let share = self.cumulative[i] - before;
        let width = self.edges[i + 1] - self.edges[i];
        (self.edges[i] + width * random.unit(), share / width)
    }
}

impl<'a> Tracer<'a> {
    fn new(sky: &'a Sky, paths: &'a Paths, to_sun: [f64; 3], channel: usize) -> Self {
        let mut extinctions = [0.0; MOST_LANES];
        for (to, from) in extinctions.iter_mut().zip(&sky.extinctions) {
            *to = from[channel];
        }
        Self {
            sky,
            paths,
            to_sun,
            channel,
            albedo: sky.atmosphere().ground_albedo[channel],
            extinctions,
            scatterers: sky
                .scatterers
                .iter()
                .map(|s| (s.scattering[channel], s.profile, s.lobe))
                .collect(),
        }
    }

    fn radius(&self) -> f64 {
        self.sky.ground()
    }

    fn altitude(&self, place: [f64; 3]) -> f64 {
        (length(place) - self.radius()).max(0.0)
    }

    /// Extinction of densities.
    fn extinction(&self, densities: &[f64; MOST_LANES]) -> f64 {
        let count = self.sky.profiles.len();
        let pairs = densities[..count].iter().zip(&self.extinctions);
        pairs.map(|(d, e)| d * e).sum()
    }

    /// Scattering of densities.
    fn scattering(&self, densities: &[f64; MOST_LANES]) -> Scattering {
        let mut parts = [0.0; MOST_LANES];
        let mut sum = 0.0;
        for (part, (scattering, profile, _)) in parts.iter_mut().zip(&self.scatterers) {
            *part = scattering * densities[*profile];
            sum += *part;
        }
        Scattering { parts, sum }
    }

    fn scattering_at(&self, place: [f64; 3]) -> Scattering {
        self.scattering(&self.sky.densities(self.altitude(place)))
    }

    /// Mean of the phase functions at a place.
    fn phase(&self, scattering: &Scattering, nu: f64) -> f64 {
        let parts = self.scatterers.iter().zip(scattering.parts);
        let sum: f64 = parts
            .filter(|(_, part)| *part > 0.0)
            .map(|((_, _, lobe), part)| part * lobe.value(nu))
            .sum();
        if scattering.sum > 0.0 {
            sum / scattering.sum
        } else {
            0.0
        }
    }

    /// A bound on the extinction above an altitude, above 0.
    fn majorant(&self, lowest: f64) -> f64 {
        let mut densities = [0.0; MOST_LANES];
        for (density, profile) in densities.iter_mut().zip(&self.sky.profiles) {
            *density = profile.greatest_above(lowest);
        }
        self.extinction(&densities).max(1e-300)
    }

    /// Share of the light met at a place that is scattered, not absorbed.
    fn survival(&self, place: [f64; 3]) -> f64 {
        let densities = self.sky.densities(self.altitude(place));
        self.scattering(&densities).sum / self.extinction(&densities)
    }

    /// Delta tracking along a ray from a place inside the air, up to `limit`.
    fn fly(&self, place: [f64; 3], dir: [f64; 3], limit: f64, random: &mut Random) -> End {
        let start = dot(place, dir);
        let closest = (dot(place, place) - start * start).max(0.0).sqrt();
        let half = |radius: f64| {
            let square = (radius - closest) * (radius + closest);
            (square > 0.0).then(|| square.sqrt())
        };
        let floor = if start < 0.0 {
            half(self.radius())
        } else {
            None
        };
        let end = match floor {
            Some(floor) => -floor - start,
            None => half(self.sky.top_radius()).unwrap_or(0.0) - start,
        };
        let lowest = match floor {
            Some(_) => 0.0,
            None if start < 0.0 => closest - self.radius(),
            None => self.altitude(place),
        };
        let majorant = self.majorant(lowest.max(0.0));
        let mut t = 0.0;
        loop {
            t += random.exponential() / majorant;
            if t >= end.min(limit) {
                return match floor {
                    _ if limit < end => End::Limit,
                    Some(_) => {
                        let there = add(place, scale(dir, end));
                        End::Ground(scale(there, self.radius() / length(there)))
                    }
                    None => End::Space,
                };
            }
            let there = add(place, scale(dir, t));
            let densities = self.sky.densities(self.altitude(there));
            if random.unit() * majorant < self.extinction(&densities) {
                return End::Air(there);
            }
        }
    }

    /// Share of the sun's light at a place, exact or by ratio tracking.
    fn sunlight(&self, place: [f64; 3], random: &mut Random) -> f64 {
        let Some(chord) = self.sky.sun_chord(place, self.to_sun) else {
            return 0.0;
        };
        if self.paths.estimator == Estimator::Quadrature {
            return self.sky.transmittance(self.sky.chord_columns(chord))[self.channel];
        }
        let Chord { closest, from, to } = chord;
        let lowest = if from < 0.0 {
            closest - self.radius()
        } else {
            self.altitude(place)
        };
        let majorant = self.majorant(lowest.max(0.0));
        let (mut t, mut left) = (from, 1.0);
        loop {
            t += random.exponential() / majorant;
            if t >= to || left == 0.0 {
                return left;
            }
            let h = closest.hypot(t) - self.radius();
            left *= (1.0 - self.extinction(&self.sky.densities(h)) / majorant).max(0.0);
        }
    }

    /// Radiance gathered from an event on: the light scattered or reflected there towards where the path came from, and that
    /// of all that follows. `weight` is that of the light scattered at the event.
    fn gather(
        &self,
        mut place: [f64; 3],
        mut dir: [f64; 3],
        mut weight: f64,
        mut at_ground: bool,
        random: &mut Random,
    ) -> f64 {
        let little = 0.02 * weight;
        let mut sum = 0.0;
        for order in 1..=self.paths.max_order {
            let scattering = if at_ground {
                NOTHING
            } else {
                self.scattering_at(place)
            };
            if self.paths.sun > 0.0 && order >= self.paths.first_order {
                let towards = if at_ground {
                    lambert(1.0, 1.0, dot(place, self.to_sun) / length(place))
                } else {
                    self.phase(&scattering, dot(dir, self.to_sun))
                };
                if towards > 0.0 {
                    sum += weight * self.paths.sun * towards * self.sunlight(place, random);
                }
            }
            if weight == 0.0 || (order == self.paths.max_order && self.paths.uniform == 0.0) {
                break;
            }
            dir = if at_ground {
                direction_about(
                    scale(place, 1.0 / length(place)),
                    sample_lambert(random),
                    random,
                )
            } else {
                let mut left = random.unit() * scattering.sum;
                let lobe = self
                    .scatterers
                    .iter()
                    .zip(scattering.parts)
                    .find(|(_, part)| {
                        left -= part;
                        left < 0.0
                    });
                // Rounding may leave nothing; what scatters last is as good then.
                match lobe.map(|(s, _)| s).or(self.scatterers.last()) {
                    Some((_, _, lobe)) => direction_about(dir, sample_lobe(lobe, random), random),
                    None => break,
                }
            };
            match self.fly(place, dir, f64::INFINITY, random) {
                End::Air(there) => {
                    weight *= self.survival(there);
                    (place, at_ground) = (there, false);
                }
                End::Ground(there) => {
                    weight *= self.albedo;
                    (place, at_ground) = (there, true);
                }
                End::Space => {
                    sum += weight * self.paths.uniform;
                    break;
                }
                End::Limit => break,
            }
            // A path that carries little goes on with a tenth of the probability and ten times the weight.
            if weight < little {
                if random.unit() >= 0.1 {
                    break;
                }
                weight *= 10.0;
            }
        }
        sum
    }

    /// One path by delta tracking from the eye.
    fn tracked(&self, ray: &SkyRay, reach: &Reach, random: &mut Random) -> f64 {
        let entry = self.sky.place(ray, reach.near);
        let (place, weight, at_ground) =
            match self.fly(entry, ray.dir, ray.distance - reach.near, random) {
                End::Air(there) => (there, self.survival(there), false),
                End::Ground(there) if self.paths.seen_ground => (there, self.albedo, true),
                End::Ground(_) => return 0.0,
                End::Space => return self.paths.uniform,
                End::Limit => return 0.0,
            };
        self.gather(place, ray.dir, weight, at_ground, random)
    }

    /// Stretches of the view ray, finer towards its lowest point, weighted with a guess of what each scatters to the eye.
    fn bins(&self, ray: &SkyRay, reach: &Reach) -> Bins {
        let count = 32;
        let start = reach.chord.from - reach.near;
        let low = (-start).clamp(reach.near, reach.end);
        let mut edges = Vec::new();
        for i in (1..=count).rev() {
            edges.push(low - (low - reach.near) * (f64::from(i) / f64::from(count)).powi(2));
        }
        for i in 0..=count {
            edges.push(low + (reach.end - low) * (f64::from(i) / f64::from(count)).powi(2));
        }
        // A stretch in which a layer begins or ends may look empty from its middle, and must not be.
        edges.extend(self.sky.bends_along(reach));
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let nu = dot(ray.dir, self.to_sun);
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = edges
            .windows(2)
            .map(|pair| {
                let t = 0.5 * (pair[0] + pair[1]);
                let place = self.sky.place(ray, t);
                let scattering = self.scattering_at(place);
                let sun = self.sky.sunlight(place, self.to_sun)[self.channel];
                let phase = if self.paths.first_order > 1 {
                    1.0 / (4.0 * PI)
                } else {
                    self.phase(&scattering, nu)
                };
                let around = 0.02;
                let guess = scattering.sum * (phase * sun + around);
                sum += guess * self.view_transmittance(reach, t) * (pair[1] - pair[0]);
                sum
            })
            .collect();
        if sum == 0.0 {
            edges.clear();
        }
        cumulative.iter_mut().for_each(|c| *c /= sum);
        Bins { edges, cumulative }
    }

    /// Exact transmittance from the eye to a place on the view ray.
    fn view_transmittance(&self, reach: &Reach, t: f64) -> f64 {
        let chord = Chord {
            to: reach.chord.from - reach.near + t,
            ..reach.chord
        };
        self.sky.transmittance(self.sky.chord_columns(chord))[self.channel]
    }

    /// One path whose first scattering is placed by importance, and another from the ground that the ray ends on.
    fn placed(
        &self,
        ray: &SkyRay,
        reach: &Reach,
        bins: &Bins,
        left: f64,
        random: &mut Random,
    ) -> f64 {
        let mut sum = 0.0;
        if reach.space {
            sum += left * self.paths.uniform;
        }
        let albedo = self.albedo;
        if reach.ground && albedo > 0.0 && self.paths.seen_ground {
            let there = self.sky.place(ray, reach.end);
            let there = scale(there, self.radius() / length(there));
            sum += self.gather(there, ray.dir, left * albedo, true, random);
        }
        if bins.edges.len() > 1 {
            let (t, density) = bins.sample(random);
            let place = self.sky.place(ray, t);
            let weight =
                self.scattering_at(place).sum * self.view_transmittance(reach, t) / density;
            sum += self.gather(place, ray.dir, weight, false, random);
        }
        sum
    }
}

/// Radiance of all orders up to `paths.max_order` along a view ray, light from the ground it ends on included and the sun's
/// disc excluded. `stream` tells the rays of one seed apart.
///
/// The standard error is honest where many samples carry light. It is not for a ray in the planet's shadow that order 1 alone
/// would light through a sliver of its length: when every sample is 0, so is the error. Use [`Sky::single_scatter`] there.
pub fn trace_sky(sky: &Sky, ray: &SkyRay, paths: &Paths, stream: u64) -> Measured {
    let Some(reach) = sky.reach(ray) else {
        let escapes = ray.distance == f64::INFINITY;
        return Measured {
            mean: [if escapes { paths.uniform } else { 0.0 }; 3],
            standard_error: [0.0; 3],
        };
    };
    let tallies = std::array::from_fn(|channel| {
        let tracer = Tracer::new(sky, paths, ray.to_sun, channel);
        let mut random = Random::new(
            paths.seed,
            stream.wrapping_mul(3).wrapping_add(channel as u64),
        );
        let mut tally = Tally::default();
        match paths.estimator {
            Estimator::Tracking => {
                for _ in 0..paths.samples {
                    tally.add(tracer.tracked(ray, &reach, &mut random));
                }
            }
            Estimator::Quadrature => {
                let bins = tracer.bins(ray, &reach);
                let left = tracer.view_transmittance(&reach, reach.end);
                for _ in 0..paths.samples {
                    tally.add(tracer.placed(ray, &reach, &bins, left, &mut random));
                }
            }
        }
        tally
    });
    Measured::of(&tallies)
}

/// The radiance of many rays, on all cores; ray number i takes the random stream i, whatever the machine.
pub fn trace_skies(sky: &Sky, rays: &[SkyRay], paths: &Paths) -> Vec<Measured> {
    parallel_map(rays.len(), |i| trace_sky(sky, &rays[i], paths, i as u64))
}
