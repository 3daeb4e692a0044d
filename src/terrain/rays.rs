//! Where rays meet a terrain: on the device, along both paths, and on the processor.

use super::clipmap::{Clipmap, ClipmapOptions, Gaze, group, nearest_ground};
use super::ground::Prepared;
use super::land::Land;
use super::map::Relief;
use super::real::Real;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::{Field as FieldBlock, Planet as PlanetBlock};
use crate::view::WorldPos;

/// A ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainRay {
    /// Where it starts.
    pub origin: WorldPos,
    /// Its direction, a unit vector: y up at the origin over a plane, along the world's axes over a ball.
    pub dir: [f64; 3],
    /// Where it ends at the latest (m).
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
    /// Whether the ray ran out of steps, so that the answer is what is most likely.
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
    /// Over baked heights, with a last step on the field.
    Fast,
}

impl TerrainRay {
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

/// Follows rays on the device. The footprint grows with the distance by `pixel_angle` (rad). Submits and waits; rays with one origin are followed together,
/// and on the path `Fast` heights are baked around each origin. Over a ball each ray starts where it comes below the highest ground, which is found in `f64`.
///
/// # Errors
/// As [`Land::check`] and [`TerrainRay::check`]; the faults of making pipelines; [`Error::Device`].
pub fn ray_hits(
    gpu: &Gpu,
    programs: &ProgramSet,
    land: &Land,
    rays: &[TerrainRay],
    pixel_angle: f32,
    path: RayPath,
) -> Result<Vec<TerrainHit>, Error> {
    for (i, ray) in rays.iter().enumerate() {
        ray.check(i)?;
    }
    if !(pixel_angle.is_finite() && pixel_angle > 0.0) {
        return Err(Error::OutOfDomain {
            name: "pixel_angle".to_owned(),
            value: pixel_angle.to_string(),
            domain: "finite and above 0 rad".to_owned(),
        });
    }
    if land.field.on_sphere() {
        return super::globe_rays::hits(gpu, programs, land, rays, pixel_angle, path);
    }
    let (device, queue) = (&gpu.device, &gpu.queue);
    let farthest = rays.iter().map(|r| r.far.min(1e6)).fold(1000.0, f64::max);
    // A texel about as wide as a pixel.
    let texels = match 3.5 / f64::from(pixel_angle) {
        n if n <= 300.0 => 256,
        n if n <= 700.0 => 512,
        _ => 1024,
    };
    let options = ClipmapOptions {
        texels,
        reach: farthest,
        ..ClipmapOptions::default()
    };
    let fast = path == RayPath::Fast;
    let mut clipmap = if fast {
        Some(Clipmap::new(device, programs, land, &options, false)?)
    } else {
        None
    };
    let field = land.field.prepare::<f32>()?;
    let mut relief = Relief::new(device, if fast { None } else { field.map() })?;
    let _ = relief.upload(queue);
    let features: &[&str] = if fast { &["TERRAIN_FAST"] } else { &[] };
    let constants = [
        ("FIELD_KIND", f64::from(land.field.kind.number())),
        ("MAX_MARCHING_STEPS", 4000.0),
        ("REFINE_STEPS", 2.0),
    ];
    // The march has no steps of refinement.
    let constants = &constants[..if fast { 3 } else { 2 }];
    let (pipeline, layouts) = compute(device, programs, "terrain_rays", features, constants)?;
    use wgpu::BufferUsages as Usage;
    let buffer = |label, size: usize, usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    let uniform = Usage::UNIFORM | Usage::COPY_DST;
    let field_buffer = buffer("veduta field", FieldBlock::SIZE, uniform);
    let planet_buffer = buffer("veduta planet", PlanetBlock::SIZE, uniform);
    let mut hits = vec![TerrainHit::MISS; rays.len()];
    let mut at = 0;
    while at < rays.len() {
        let eye = rays[at].origin;
        let count = rays[at..]
            .iter()
            .take(1 << 14)
            .take_while(|r| r.origin == eye)
            .count();
        let part = &rays[at..at + count];
        let block = field.block(field.place(eye)).to_bytes();
        queue.write_buffer(&field_buffer, 0, &block);
        let mut encoder = device.create_command_encoder(&Default::default());
        let planet = PlanetBlock {
            ground_radius: land.planet_radius as f32,
            eye_altitude: eye.altitude() as f32,
        };
        queue.write_buffer(&planet_buffer, 0, &planet.to_bytes());
        let mut rows = Vec::with_capacity(32 * count);
        for ray in part {
            let [x, y, z] = ray.dir.map(|c| c as f32);
            let far = ray.far.min(1e6) as f32;
            for number in [0.0, 0.0, 0.0, far, x, y, z, pixel_angle] {
                rows.extend(number.to_le_bytes());
            }
        }
        let exchange = Exchange::new(device, queue, &rows, 48 * count);
        let groups = if let Some(clipmap) = &mut clipmap {
            let above = nearest_ground(&field, eye);
            let gaze = Gaze {
                least: 0.35 * f64::from(pixel_angle) * above,
                near: above,
                far: farthest,
                azimuths: [0.0, std::f64::consts::TAU],
                sun: None,
            };
            let _ = clipmap.prepare(queue, &mut encoder, eye, &gaze);
            let view = wgpu::BindingResource::TextureView;
            let [heights, sectors, places] = &clipmap.views;
            [
                group(
                    device,
                    &layouts[0],
                    &[
                        field_buffer.as_entire_binding(),
                        clipmap.clip().as_entire_binding(),
                    ],
                ),
                group(
                    device,
                    &layouts[1],
                    &[
                        exchange.input.as_entire_binding(),
                        view(heights),
                        view(sectors),
                        view(places),
                        wgpu::BindingResource::Sampler(&clipmap.wrapping),
                        view(clipmap.relief()),
                    ],
                ),
                group(device, &layouts[2], &[exchange.output.as_entire_binding()]),
            ]
        } else {
            [
                group(
                    device,
                    &layouts[0],
                    &[
                        field_buffer.as_entire_binding(),
                        planet_buffer.as_entire_binding(),
                    ],
                ),
                group(
                    device,
                    &layouts[1],
                    &[
                        exchange.input.as_entire_binding(),
                        wgpu::BindingResource::TextureView(&relief.view),
                    ],
                ),
                group(device, &layouts[2], &[exchange.output.as_entire_binding()]),
            ]
        };
        let workgroups = count.div_ceil(64) as u32;
        let data = exchange.run(device, queue, encoder, &pipeline, &groups, workgroups)?;
        for (i, row) in data.chunks_exact(48).enumerate() {
            let bits = |k: usize| [row[k], row[k + 1], row[k + 2], row[k + 3]];
            let number = |k: usize| f64::from(f32::from_le_bytes(bits(k)));
            let capped = i32::from_le_bytes(bits(32)) < 0;
            hits[at + i] = if number(0) < 0.0 {
                TerrainHit {
                    capped,
                    ..TerrainHit::MISS
                }
            } else {
                TerrainHit {
                    distance: number(0),
                    normal: [number(16), number(20), number(24)],
                    height: number(28),
                    capped,
                }
            };
        }
        at += count;
    }
    Ok(hits)
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
    /// Least step (m).
    pub least: f64,
}

impl Search {
    /// The first distance at which the clearance is gone, by steps of half a footprint and bisection.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a least step that is not above 0 and an angle that is below it.
    pub fn first(&self, clearance: impl Fn(f64) -> f64) -> Result<Option<f64>, Error> {
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
            least,
        } = self;
        let mut t = 0.0;
        if clearance(0.0) <= 0.0 {
            return Ok(Some(0.0));
        }
        while t < far {
            let above = altitude_along(start, radius, mu, t) - top;
            if above > 0.0 {
                let q = t * (t + 2.0 * radius * mu);
                let rise = (radius * mu + t) / (radius * radius + q).max(1.0).sqrt();
                if rise >= 0.0 {
                    return Ok(None);
                }
                // Altitude is convex: the tangent comes down to the highest ground before the ray does.
                t += (above / -rise).max(1e-3);
                continue;
            }
            let next = (t + (0.5 * pixel_angle * t).max(least)).min(far);
            if clearance(next) <= 0.0 {
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
                return Ok(Some(clear));
            }
            t = next;
        }
        Ok(None)
    }
}

impl<T: Real> Prepared<T> {
    /// The first place where a ray meets the field as its footprint filters it, by bracketing: steps of half a footprint, at least `least` metres, and
    /// bisection. A stretch below the ground that is shorter than a step may be missed; nothing else can be. Above `top` (m) there is no ground, see
    /// [`super::HeightField::bounds`].
    ///
    /// # Errors
    /// As [`TerrainRay::check`].
    pub fn ray_hit(
        &self,
        planet_radius: f64,
        top: f64,
        ray: &TerrainRay,
        pixel_angle: f64,
        least: f64,
    ) -> Result<TerrainHit, Error> {
        ray.check(0)?;
        let eye = self.place(ray.origin);
        let start = ray.origin.altitude();
        let radius = planet_radius + start;
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
        let search = Search {
            start,
            radius,
            mu: ray.dir[1],
            top,
            far: ray.far.min(1e7),
            pixel_angle,
            least,
        };
        Ok(search.first(clearance)?.map_or(TerrainHit::MISS, hit))
    }
}
