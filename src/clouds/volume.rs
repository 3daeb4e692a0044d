//! Light in a cube of any density: a query that judges how clouds are lit.

use super::directions::{directions, harmonics};
use super::phase::Lobes;
use super::{Orders, ProbePath, fault};
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, bind_groups, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::CloudGrid as GridBlock;

/// A cube in vacuum, from 0 to 1 along each axis in its own coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityCube {
    /// Values along x, y and z.
    pub values: [usize; 3],
    /// The values at the centres of as many cells, x first, z last; between them linear, at the faces held. At least 0.
    pub density: Vec<f32>,
    /// Edge (m), in [1e-3, 1e7].
    pub size: f64,
    /// Extinction per unit of density (1/m), in [0, 1e6].
    pub extinction: f64,
    /// Scattered share of the extinction, in [0, 1].
    pub albedo: f64,
    /// Asymmetry of the phase function, one lobe of Henyey and Greenstein, in [-0.99, 0.99].
    pub g: f64,
}

/// A ray in the cube's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeRay {
    /// Where it starts, inside of the cube or not.
    pub origin: [f64; 3],
    /// Unit vector of the view.
    pub dir: [f64; 3],
    /// Unit vector to the sun.
    pub to_sun: [f64; 3],
}

/// The light of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeLight {
    /// Radiance that is scattered into the ray.
    pub scatter: f32,
    /// Transmittance.
    pub transmittance: f32,
}

/// How the light is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeOptions {
    /// `Textbook` marches to the sun from every sample, `Fast` reads depths from nodes.
    pub path: ProbePath,
    /// Which orders of scattering.
    pub orders: Orders,
    /// Irradiance of the sun across its rays, at least 0.
    pub sun: f32,
    /// Radiance that comes from every free direction, at least 0; needs all orders.
    pub uniform: f32,
}

impl Default for CubeOptions {
    /// All orders of the sun's light, along the fast path.
    fn default() -> Self {
        CubeOptions {
            path: ProbePath::Fast,
            orders: Orders::All,
            sun: 1.0,
            uniform: 0.0,
        }
    }
}

impl DensityCube {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let count = self.values.iter().product::<usize>();
        if !self.values.iter().all(|n| (1..=512).contains(n)) || count > 1 << 25 {
            let value = format!("{:?}", self.values);
            return Err(fault(
                "cube.values",
                value,
                "1 to 512 along each axis, 2^25 in all",
            ));
        }
        if self.density.len() != count {
            let domain = format!("{count} values");
            return Err(fault("cube.density", self.density.len(), &domain));
        }
        let good = |d: &&f32| !(**d >= 0.0 && d.is_finite());
        if let Some(bad) = self.density.iter().find(good) {
            return Err(fault("cube.density", bad, "finite and at least 0"));
        }
        for (name, value, low, high) in [
            ("cube.size", self.size, 1e-3, 1e7),
            ("cube.extinction", self.extinction, 0.0, 1e6),
            ("cube.albedo", self.albedo, 0.0, 1.0),
            ("cube.g", self.g, -0.99, 0.99),
        ] {
            if !(low..=high).contains(&value) {
                return Err(fault(name, value, &format!("in [{low}, {high}]")));
            }
        }
        Ok(())
    }

    /// Density at a point of the unit cube, without anything outside.
    pub fn density_at(&self, point: [f64; 3]) -> f64 {
        if point.iter().any(|c| !(0.0..=1.0).contains(c)) {
            return 0.0;
        }
        let q: [f64; 3] = std::array::from_fn(|k| point[k] * self.values[k] as f64 - 0.5);
        let mut sum = 0.0;
        for corner in 0..8 {
            let (mut weight, mut index, mut stride) = (1.0, 0, 1);
            for (k, place) in q.iter().enumerate() {
                let base = place.floor();
                let far = corner >> k & 1;
                let part = place - base;
                weight *= if far == 1 { part } else { 1.0 - part };
                let cell = (base as i64 + far).clamp(0, self.values[k] as i64 - 1);
                index += cell as usize * stride;
                stride *= self.values[k];
            }
            if weight > 0.0 {
                sum += weight * f64::from(self.density[index]);
            }
        }
        sum
    }
}

impl CubeRay {
    /// A ray of nine numbers, with directions made units.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] with the row, for an origin that is not finite and directions whose length is not 1 to 1e-3.
    pub fn from_row(row: usize, n: [f64; 9]) -> Result<CubeRay, Error> {
        let three = |k: usize| [n[k], n[k + 1], n[k + 2]];
        let unit = |name: &str, v: [f64; 3]| {
            let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-3 || length.is_nan() {
                return Err(fault(
                    &format!("{name} of row {row}"),
                    format!("{v:?}"),
                    "a unit vector",
                ));
            }
            Ok(v.map(|c| c / length))
        };
        let origin = three(0);
        if origin.iter().any(|c| c.is_nan() || c.abs() > 1e6) {
            let value = format!("{origin:?}");
            return Err(fault(
                &format!("origin of row {row}"),
                value,
                "within 1e6 edges",
            ));
        }
        Ok(CubeRay {
            origin,
            dir: unit("direction", three(3))?,
            to_sun: unit("direction to the sun", three(6))?,
        })
    }

    /// The ray from where it enters the cube.
    fn entered(&self) -> [f64; 3] {
        let mut near = 0.0_f64;
        for k in 0..3 {
            if self.dir[k].abs() > 1e-12 {
                let [a, b] = [0.0, 1.0].map(|face| (face - self.origin[k]) / self.dir[k]);
                near = near.max(a.min(b));
            }
        }
        // A little before, so that rounding does not lose an edge.
        let near = (near - 1e-4).max(0.0);
        std::array::from_fn(|k| self.origin[k] + near * self.dir[k])
    }
}

/// The light along rays, in their order. Submits and waits. Rays with one sun share what is prepared for it.
///
/// # Errors
/// As [`DensityCube::check`]; [`Error::OutOfDomain`] for options; the faults of making pipelines; [`Error::Device`].
pub fn cube_light(
    gpu: &Gpu,
    programs: &ProgramSet,
    cube: &DensityCube,
    rays: &[CubeRay],
    options: &CubeOptions,
) -> Result<Vec<CubeLight>, Error> {
    cube.check()?;
    for (name, value) in [("sun", options.sun), ("uniform", options.uniform)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(fault(
                &format!("options.{name}"),
                value,
                "finite and at least 0",
            ));
        }
    }
    if options.uniform > 0.0 && options.orders == Orders::Single {
        return Err(fault(
            "options.uniform",
            options.uniform,
            "0 for single scattering",
        ));
    }
    let mut light = vec![
        CubeLight {
            scatter: 0.0,
            transmittance: 1.0
        };
        rays.len()
    ];
    let mut groups: Vec<([f64; 3], Vec<usize>)> = Vec::new();
    for (i, ray) in rays.iter().enumerate() {
        match groups.iter_mut().find(|(sun, _)| *sun == ray.to_sun) {
            Some((_, members)) => members.push(i),
            None => groups.push((ray.to_sun, vec![i])),
        }
    }
    let solver = Solver::new(gpu, programs, cube, options)?;
    for (to_sun, members) in &groups {
        let prepared = solver.prepare(*to_sun)?;
        // What llvmpipe does at once without being taken for hung.
        for part in members.chunks(1 << 14) {
            let rows: Vec<CubeRay> = part.iter().map(|i| rays[*i]).collect();
            let found = solver.run(&prepared, &rows)?;
            for (i, found) in part.iter().zip(found) {
                light[*i] = found;
            }
        }
    }
    Ok(light)
}

/// What is the same for every sun.
struct Solver<'a> {
    gpu: &'a Gpu,
    options: &'a CubeOptions,
    block: GridBlock,
    density: wgpu::Buffer,
    peaks: wgpu::Buffer,
    nodes: Kernel,
    fill: Kernel,
    sweep: Kernel,
    gather: Kernel,
    prolong: Kernel,
    rays: Kernel,
}

pub(super) type Kernel = (wgpu::ComputePipeline, Vec<wgpu::BindGroupLayout>);

/// What holds for one sun.
struct Prepared {
    block: GridBlock,
    depths: wgpu::Buffer,
    moments: wgpu::Buffer,
}

/// Cells along an edge of each grid, with sweeps: light that goes far is found on coarse ones.
const GRIDS: [(usize, usize); 3] = [(8, 96), (16, 40), (32, 24)];
pub(super) const WAY: usize = 112;

impl<'a> Solver<'a> {
    fn new(
        gpu: &'a Gpu,
        programs: &ProgramSet,
        cube: &DensityCube,
        options: &'a CubeOptions,
    ) -> Result<Solver<'a>, Error> {
        let device = &gpu.device;
        let lobes = Lobes {
            albedo: cube.albedo,
            g_forward: cube.g,
            g_backward: 0.0,
            backward_share: 0.0,
        };
        let most = cube.values.into_iter().max().unwrap_or(1);
        let textbook = options.path == ProbePath::Textbook;
        // Steps of half a voxel, a whole one where there are many.
        let step = 1.0 / (most.clamp(16, 256) as f64 * if most > 100 { 1.0 } else { 2.0 });
        let block = GridBlock {
            voxels: cube.values.map(|n| n as i32),
            size: cube.size as f32,
            extinction: cube.extinction as f32,
            nodes: (2 * most + 1).clamp(65, 129) as i32,
            albedo: cube.albedo as f32,
            g: cube.g as f32,
            peak: lobes.peak() as f32,
            sun: options.sun,
            degrees: lobes.degrees().map(|d| d as f32),
            uniform_light: options.uniform,
            step: step as f32,
            step_depth: if textbook { 0.1 } else { 1.0 },
            all_orders: i32::from(options.orders == Orders::All),
            gain: 1.0,
            ..Default::default()
        };
        let kernel = |flags: &[&str]| compute(device, programs, "cloud_volume", flags, &[]);
        let density: Vec<u8> = cube.density.iter().flat_map(|d| d.to_le_bytes()).collect();
        let peaks: Vec<u8> = lobes
            .peak_table()
            .iter()
            .flat_map(|d| d.to_le_bytes())
            .collect();
        Ok(Solver {
            gpu,
            options,
            block,
            density: filled(gpu, &density),
            peaks: filled(gpu, &peaks),
            nodes: kernel(&["CLOUD_NODES"])?,
            fill: kernel(&["CLOUD_CELLS"])?,
            sweep: kernel(&["CLOUD_SWEEP"])?,
            gather: kernel(&["CLOUD_GATHER"])?,
            prolong: kernel(&["CLOUD_GATHER", "CLOUD_PROLONG"])?,
            rays: kernel(if textbook {
                &[]
            } else {
                &["CLOUD_READS_NODES"]
            })?,
        })
    }

    fn groups(&self, kernel: &Kernel, bound: [&[(u32, &wgpu::Buffer)]; 3]) -> Vec<wgpu::BindGroup> {
        fn whole<'a>(list: &[(u32, &'a wgpu::Buffer)]) -> Vec<(u32, wgpu::BindingResource<'a>)> {
            list.iter()
                .map(|(binding, buffer)| (*binding, buffer.as_entire_binding()))
                .collect()
        }
        groups(&self.gpu.device, kernel, &bound.map(whole))
    }

    fn prepare(&self, to_sun: [f64; 3]) -> Result<Prepared, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut block = GridBlock {
            to_sun: to_sun.map(|c| c as f32),
            cells: [1; 3],
            ..self.block
        };
        let storage = |size| {
            room(
                device,
                size,
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            )
        };
        let all = self.block.all_orders != 0;
        let fast = self.options.path == ProbePath::Fast;
        if !all && !fast {
            return Ok(Prepared {
                block,
                depths: storage(16),
                moments: storage(64),
            });
        }
        let n = self.block.nodes as usize;
        let depths = storage(4 * n * n * n);
        let mut encoder = device.create_command_encoder(&Default::default());
        let uniform = uniform_of(self.gpu, &block);
        let bound: [&[_]; 3] = [&[(0, &uniform)], &[(0, &self.density)], &[(0, &depths)]];
        let groups = self.groups(&self.nodes, bound);
        dispatch(&mut encoder, &self.nodes, &groups, (n * n * n).div_ceil(64));
        queue.submit([encoder.finish()]);
        if !all {
            return Ok(Prepared {
                block,
                depths,
                moments: storage(64),
            });
        }
        let mut coarser: Option<(wgpu::Buffer, usize)> = None;
        for (edge, sweeps) in GRIDS {
            let count = edge * edge * edge;
            block.cells = [edge as i32; 3];
            block.coarse = [coarser.as_ref().map_or(1, |c| c.1 as i32); 3];
            let uniform = uniform_of(self.gpu, &block);
            let cells = storage(8 * count);
            let source = storage(4 * 24 * count);
            let moments = storage(64 * count);
            let last = storage(64 * count);
            let radiance = storage(4 * 24 * count);
            let (ways, _) = self.ways(edge);
            let mut encoder = device.create_command_encoder(&Default::default());
            let bound: [&[_]; 3] = [
                &[(0, &uniform)],
                &[(0, &self.density), (1, &depths)],
                &[(1, &cells)],
            ];
            let groups = self.groups(&self.fill, bound);
            dispatch(&mut encoder, &self.fill, &groups, count.div_ceil(64));
            let gathered = |kernel: &Kernel, place: u32, from: &wgpu::Buffer| {
                let bound: [&[_]; 3] = [
                    &[(0, &uniform), (1, &ways)],
                    &[(3, &cells), (place, from)],
                    &[(3, &source), (4, &moments), (8, &last)],
                ];
                self.groups(kernel, bound)
            };
            let gather = gathered(&self.gather, 5, &radiance);
            let bound: [&[_]; 3] = [
                &[(0, &uniform), (1, &ways)],
                &[(3, &cells), (4, &source)],
                &[(2, &radiance)],
            ];
            let sweep = self.groups(&self.sweep, bound);
            match &coarser {
                Some((coarse, _)) => {
                    let prolong = gathered(&self.prolong, 6, coarse);
                    dispatch(&mut encoder, &self.prolong, &prolong, count.div_ceil(64));
                }
                None => {
                    let start = self.options.uniform.to_le_bytes().repeat(24 * count);
                    queue.write_buffer(&radiance, 0, &start);
                    dispatch(&mut encoder, &self.gather, &gather, count.div_ceil(64));
                }
            }
            for _ in 0..sweeps {
                dispatch(&mut encoder, &self.sweep, &sweep, 24);
                dispatch(&mut encoder, &self.gather, &gather, count.div_ceil(64));
            }
            queue.submit([encoder.finish()]);
            coarser = Some((moments, edge));
        }
        let moments = coarser.map_or_else(|| storage(64), |c| c.0);
        Ok(Prepared {
            block,
            depths,
            moments,
        })
    }

    /// The directions with how each goes through cells.
    fn ways(&self, edge: usize) -> (wgpu::Buffer, usize) {
        let width = f64::from(self.block.size) / edge as f64;
        let n = edge as i32;
        let strides = [1, n, n * n];
        let mut bytes = Vec::with_capacity(24 * WAY);
        let all = directions();
        for dir in &all {
            let along = (0..3)
                .max_by(|a, b| dir[*a].abs().total_cmp(&dir[*b].abs()))
                .unwrap_or(0);
            let [a, b] = [(along + 1) % 3, (along + 2) % 3];
            for h in harmonics(*dir) {
                bytes.extend((h as f32).to_le_bytes());
            }
            let sense = if dir[along] < 0.0 { -1 } else { 1 };
            for number in [n, n, n, sense, strides[along], strides[a], strides[b], 0] {
                bytes.extend(i32::to_le_bytes(number));
            }
            let speed = dir[along].abs();
            for number in [-dir[a] / speed, -dir[b] / speed, width / speed, 0.0] {
                bytes.extend((number as f32).to_le_bytes());
            }
        }
        (filled(self.gpu, &bytes), all.len())
    }

    fn run(&self, prepared: &Prepared, rays: &[CubeRay]) -> Result<Vec<CubeLight>, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let block = GridBlock {
            count: rays.len() as i32,
            ..prepared.block
        };
        let uniform = uniform_of(self.gpu, &block);
        let mut rows = Vec::with_capacity(32 * rays.len());
        for ray in rays {
            for v in [ray.entered(), ray.dir] {
                for c in [v[0], v[1], v[2], 0.0] {
                    rows.extend((c as f32).to_le_bytes());
                }
            }
        }
        let exchange = Exchange::new(device, queue, &rows, 8 * rays.len());
        let mut read = vec![
            (0, &self.density),
            (1, &prepared.depths),
            (7, &exchange.input),
            (8, &self.peaks),
            (9, &prepared.moments),
        ];
        if self.options.path == ProbePath::Textbook {
            read.remove(1);
        }
        let groups = self.groups(
            &self.rays,
            [&[(0, &uniform)], &read, &[(5, &exchange.output)]],
        );
        let encoder = device.create_command_encoder(&Default::default());
        let workgroups = rays.len().div_ceil(64) as u32;
        let found = exchange.run(device, queue, encoder, &self.rays.0, &groups, workgroups)?;
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        Ok(found
            .chunks_exact(8)
            .map(|row| CubeLight {
                scatter: number(row),
                transmittance: number(&row[4..]),
            })
            .collect())
    }
}

pub(super) fn room(device: &wgpu::Device, size: usize, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("veduta cube"),
        size: size as u64,
        usage,
        mapped_at_creation: false,
    })
}

pub(super) fn uniform_of(gpu: &Gpu, block: &GridBlock) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let buffer = room(&gpu.device, GridBlock::SIZE, usage);
    gpu.queue.write_buffer(&buffer, 0, &block.to_bytes());
    buffer
}

/// The groups of a kernel, from what is bound in each by number.
pub(super) fn groups(
    device: &wgpu::Device,
    kernel: &Kernel,
    bound: &[Vec<(u32, wgpu::BindingResource<'_>)>; 3],
) -> Vec<wgpu::BindGroup> {
    let bound = bound.each_ref().map(Vec::as_slice);
    bind_groups(device, "veduta cloud light", &kernel.1, &bound)
}

pub(super) fn dispatch(
    encoder: &mut wgpu::CommandEncoder,
    kernel: &Kernel,
    groups: &[wgpu::BindGroup],
    count: usize,
) {
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&kernel.0);
    for (index, group) in (0..).zip(groups) {
        pass.set_bind_group(index, group, &[]);
    }
    pass.dispatch_workgroups(count as u32, 1, 1);
}

pub(super) fn filled(gpu: &Gpu, bytes: &[u8]) -> wgpu::Buffer {
    use wgpu::BufferUsages as Usage;
    let usage = Usage::STORAGE | Usage::UNIFORM | Usage::COPY_DST;
    let buffer = room(&gpu.device, bytes.len(), usage);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}
