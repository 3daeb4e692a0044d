//! Radiance and transmittance along given rays: a query, not a part of a frame.

use super::check::{fault, within};
use super::fast::FastProbe;
use super::medium::Atmosphere;
use super::ray::AirRay;
use super::tables::SkyQuality;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, three};
use crate::program::{PipelineOptions, ProgramSet};

/// A ray whose light is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeRay {
    /// Altitude of the eye (m), at least 0.
    pub altitude: f64,
    /// Direction of the view, a unit vector in the frame of the eye, y up.
    pub dir: [f64; 3],
    /// Direction to the sun, a unit vector in the same frame.
    pub to_sun: [f64; 3],
    /// Where the ray ends (m), if not at the ground or the top of the air before; above 0, may be infinite.
    pub distance: f64,
}

/// The light along a ray, for a point of a sun whose irradiance outside the air is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeLight {
    /// Radiance scattered into the ray (1/sr), without that of the ground at its end. 0 for a ray that misses the air.
    pub in_scatter: [f32; 3],
    /// Transmittance to the end of the ray. 1 for a ray that misses the air.
    pub transmittance: [f32; 3],
}

/// Which light is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orders {
    /// What the air has scattered once.
    Single,
    /// What the air has scattered once and more often, and what the ground has reflected before.
    All,
}

/// How the device finds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbePath {
    /// By marching.
    Textbook,
    /// By tables.
    Fast,
}

impl ProbeRay {
    /// The ray of a row of eight numbers: altitude, direction, direction to the sun, distance. The directions are made
    /// unit vectors.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] naming the row, which `row` is the number of, for an altitude below 0 or not finite, a
    /// direction whose length is not within 1e-3 of 1, and a distance below 0.
    pub fn from_row(row: usize, numbers: [f64; 8]) -> Result<ProbeRay, Error> {
        let [altitude, dx, dy, dz, sx, sy, sz, distance] = numbers;
        let name = |what: &str| format!("{what} of row {row}");
        if !(altitude >= 0.0 && altitude.is_finite()) {
            let domain = "finite and at least 0 m".to_owned();
            return Err(fault(&name("the altitude"), altitude, domain));
        }
        let unit = |what: &str, v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let what = name(&format!("the length of the {what}"));
            within(&what, length, (0.999, 1.001, "1"))?;
            Ok(v.map(|x| x / length))
        };
        if distance.is_nan() || distance < 0.0 {
            let domain = "at least 0 m, or infinite".to_owned();
            return Err(fault(&name("the distance"), distance, domain));
        }
        Ok(ProbeRay {
            altitude,
            dir: unit("direction", [dx, dy, dz])?,
            to_sun: unit("direction to the sun", [sx, sy, sz])?,
            distance,
        })
    }
}

/// Choices that are made once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeOptions {
    /// How the light is found.
    pub path: ProbePath,
    /// Which light is counted.
    pub orders: Orders,
    /// How finely the tables of the path `Fast` are made.
    pub quality: SkyQuality,
    /// Steps along each stretch of a ray, at least 1; a step has two samples.
    pub steps: u32,
    /// Steps towards the sun at every sample, at least 1. Some devices end loops after 65,535 rounds, so that
    /// `4 steps (2 light_steps + 3)` must stay below that.
    pub light_steps: u32,
}

impl Default for ProbeOptions {
    /// Converged to about 1e-5 in the air of the Earth.
    fn default() -> Self {
        ProbeOptions {
            path: ProbePath::Textbook,
            orders: Orders::Single,
            quality: SkyQuality::finest(),
            steps: 96,
            light_steps: 24,
        }
    }
}

/// Finds the light along rays through one air.
///
/// ```no_run
/// # fn run(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), veduta::Error> {
/// use veduta::atmosphere::probe::{Probe, ProbeOptions, ProbeRay};
/// let air = veduta::Atmosphere::default();
/// let probe = Probe::new(device, veduta::programs(), &air, &ProbeOptions::default())?;
/// let zenith = ProbeRay {
///     altitude: 2.0, dir: [0.0, 1.0, 0.0], to_sun: [0.8, 0.6, 0.0], distance: f64::INFINITY,
/// };
/// println!("{:?}", probe.run(device, queue, &[zenith])?[0].in_scatter);
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Probe {
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    air: wgpu::Buffer,
    ground_radius: f64,
    top: f64,
    /// Rays of one dispatch.
    tile: usize,
}

/// Rounds of loops that every device runs.
const MOST_ROUNDS: u64 = 65_535;

/// Rounds of inner loops in one dispatch: about a second on a software device.
const TILE_ROUNDS: u64 = 1 << 25;

const WORKGROUP: usize = 64;

/// Bytes of a result in the buffer: two vectors in 16 bytes each.
const RESULT: usize = 32;

fn outside(name: &str, value: impl std::fmt::Display, domain: &str) -> Error {
    Error::OutOfDomain {
        name: name.to_owned(),
        value: value.to_string(),
        domain: domain.to_owned(),
    }
}

/// The ray with unit vectors, or what is wrong with it.
pub(super) fn checked(ray: &ProbeRay, at: usize) -> Result<ProbeRay, Error> {
    let name = |field: &str| format!("rays[{at}].{field}");
    if !(0.0..=1e9).contains(&ray.altitude) {
        return Err(outside(&name("altitude"), ray.altitude, "in [0, 1e9] m"));
    }
    if ray.distance.is_nan() || ray.distance < 0.0 {
        return Err(outside(&name("distance"), ray.distance, "at least 0 m"));
    }
    let unit = |field: &str, v: [f64; 3]| {
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (length - 1.0).abs() <= 1e-5 {
            Ok(v.map(|c| c / length))
        } else {
            Err(outside(
                &name(field),
                format!("{v:?}"),
                "a unit vector, to 1e-5",
            ))
        }
    };
    Ok(ProbeRay {
        dir: unit("dir", ray.dir)?,
        to_sun: unit("to_sun", ray.to_sun)?,
        ..*ray
    })
}

impl Probe {
    /// Builds the pipeline and uploads the air. It marches light that is scattered once: `quality` is not read.
    ///
    /// # Errors
    /// As [`Atmosphere::check`]; [`Error::OutOfDomain`] for counts, and for a path or orders that it does not follow, which [`probe`] and [`FastProbe`] do; the faults of [`ProgramSet::get`] and of making the pipeline.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        options: &ProbeOptions,
    ) -> Result<Probe, Error> {
        let bytes = atmosphere.air_bytes()?;
        if options.path != ProbePath::Textbook || options.orders != Orders::Single {
            return Err(outside(
                "path and orders",
                format!("{:?} and {:?}", options.path, options.orders),
                "Textbook and Single; `FastProbe` and `probe` have the others",
            ));
        }
        let (steps, light_steps) = (u64::from(options.steps), u64::from(options.light_steps));
        for (name, count) in [("steps", steps), ("light_steps", light_steps)] {
            if !(1..=4096).contains(&count) {
                return Err(outside(name, count, "in [1, 4096]"));
            }
        }
        let rounds = 4 * steps * (2 * light_steps + 3) + 16;
        if rounds > MOST_ROUNDS {
            return Err(outside(
                "steps",
                format!("{steps} with {light_steps} light steps"),
                "so few that 4 steps (2 light_steps + 3) stays below 65,535",
            ));
        }
        let program = programs.get("probe", atmosphere.features())?;
        let ready = program.pipeline(
            device,
            &PipelineOptions {
                constants: &[
                    ("PROBE_STEPS", f64::from(options.steps)),
                    ("PROBE_LIGHT_STEPS", f64::from(options.light_steps)),
                ],
                ..Default::default()
            },
        )?;
        let crate::program::Pipeline::Compute(pipeline) = ready.pipeline else {
            return Err(Error::MissingStage {
                program: "probe".to_owned(),
            });
        };
        let air = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta probe air"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM,
            mapped_at_creation: true,
        });
        air.slice(..)
            .get_mapped_range_mut()
            .map_err(|e| Error::Device(e.to_string()))?
            .copy_from_slice(&bytes);
        air.unmap();
        let tile = (TILE_ROUNDS / (2 * steps * light_steps)) as usize;
        Ok(Probe {
            pipeline,
            layouts: ready.bind_group_layouts,
            air,
            ground_radius: atmosphere.planet_radius,
            top: atmosphere.thickness,
            tile: tile.clamp(1, 4096).next_multiple_of(WORKGROUP),
        })
    }

    /// The light along each ray, in their order. Submits and waits: many rays take as many dispatches, so that none runs long.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] with the index of the ray that has an altitude outside [0, 1e9] m, a negative distance or a
    /// direction that is no unit vector; [`Error::Device`].
    pub fn run(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        rays: &[ProbeRay],
    ) -> Result<Vec<ProbeLight>, Error> {
        let mut bytes = Vec::with_capacity(rays.len() * AirRay::SIZE);
        for (at, ray) in rays.iter().enumerate() {
            let ray = checked(ray, at)?;
            bytes.extend(AirRay::new(self.ground_radius, self.top, &ray).bytes());
        }
        let mut results = Vec::with_capacity(rays.len());
        for part in bytes.chunks(self.tile * AirRay::SIZE) {
            self.run_tile(device, queue, part, &mut results)?;
        }
        Ok(results)
    }

    fn run_tile(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        rays: &[u8],
        results: &mut Vec<ProbeLight>,
    ) -> Result<(), Error> {
        let count = rays.len() / AirRay::SIZE;
        let exchange = Exchange::new(device, queue, rays, count * RESULT);
        let bound: [&[&wgpu::Buffer]; 3] =
            [&[], &[&self.air, &exchange.input], &[&exchange.output]];
        let groups: Vec<wgpu::BindGroup> = self
            .layouts
            .iter()
            .zip(bound)
            .map(|(layout, buffers)| {
                let entries: Vec<_> = (0..)
                    .zip(buffers)
                    .map(|(binding, buffer)| wgpu::BindGroupEntry {
                        binding,
                        resource: buffer.as_entire_binding(),
                    })
                    .collect();
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("veduta probe"),
                    layout,
                    entries: &entries,
                })
            })
            .collect();
        let encoder = device.create_command_encoder(&Default::default());
        let workgroups = count.div_ceil(WORKGROUP) as u32;
        let data = exchange.run(device, queue, encoder, &self.pipeline, &groups, workgroups)?;
        results.extend(data.chunks_exact(RESULT).map(|result| ProbeLight {
            in_scatter: three(result, 0),
            transmittance: three(result, 16),
        }));
        Ok(())
    }
}

/// The light along rays, on the device: straight from the sun along the path `Textbook` by marching to the sun from every sample; of all
/// orders along it by marching 64 steps through the finest tables of the air, whatever counts and quality say; along the path `Fast` from the tables of each ray's eye. For more than one
/// batch of rays keep a [`Probe`] or a [`FastProbe`].
///
/// # Errors
/// As [`Probe::new`], [`FastProbe::new`] and their `run`.
pub fn probe(
    gpu: &Gpu,
    atmosphere: &Atmosphere,
    rays: &[ProbeRay],
    options: &ProbeOptions,
) -> Result<Vec<ProbeLight>, Error> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let programs = crate::programs::programs();
    let all_orders = options.orders == Orders::All;
    let (quality, march) = match (options.path, options.orders) {
        (ProbePath::Textbook, Orders::Single) => {
            return Probe::new(device, programs, atmosphere, options)?.run(device, queue, rays);
        }
        (ProbePath::Textbook, Orders::All) => (SkyQuality::finest(), 64),
        (ProbePath::Fast, _) => (options.quality, 0),
    };
    let quality = SkyQuality {
        all_orders,
        ..quality
    };
    FastProbe::new(device, programs, atmosphere, &quality, march)?.run(device, queue, rays)
}
