//! Light of all orders in a layer that repeats: the sweeps of [`super::volume`] over cells of its tile.

use super::directions::{directions, harmonics};
use super::phase::Lobes;
use super::tile::{Tile, slant};
use super::volume::{Kernel, WAY, dispatch, filled, groups, room, uniform_of};
use super::{CloudDeck, CubeLight};
use crate::atmosphere::ProbeRay;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::CloudGrid as GridBlock;

/// Cells along the horizontal edges and along the height, with sweeps: light that goes far is found on coarse grids.
const GRIDS: [(usize, usize, usize); 3] = [(24, 6, 80), (48, 12, 24), (96, 20, 8)];

/// What a layer is lit by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lighting {
    /// Irradiance of the sun.
    pub sun: f32,
    /// Radiance from above and from below.
    pub around: [f32; 2],
}

/// What is the same for every sun.
pub(super) struct LayerOrders<'a> {
    gpu: &'a Gpu,
    block: GridBlock,
    thickness: f64,
    /// Sine of the lowest sun.
    lowest: f32,
    peaks: wgpu::Buffer,
    fill: Kernel,
    sweep: Kernel,
    gather: Kernel,
    prolong: Kernel,
    rays: Kernel,
}

impl<'a> LayerOrders<'a> {
    /// For tiles of so many levels.
    pub fn new(
        gpu: &'a Gpu,
        programs: &ProgramSet,
        deck: &CloudDeck,
        levels: u32,
        shortest: f64,
    ) -> Result<LayerOrders<'a>, Error> {
        let (block, lobes) = block_of(deck, levels, 1.0);
        let (gain, momentum) = lobes.pace();
        let block = GridBlock {
            step: shortest as f32,
            gain,
            momentum,
            ..block
        };
        let kernel = |flags: &[&str]| {
            let flags: Vec<&str> = [&["CLOUD_LAYERED"], flags].concat();
            compute(&gpu.device, programs, "cloud_volume", &flags, &[])
        };
        let peaks: Vec<u8> = lobes
            .peak_table()
            .iter()
            .flat_map(|d| d.to_le_bytes())
            .collect();
        Ok(LayerOrders {
            gpu,
            block,
            thickness: deck.thickness,
            lowest: deck.lowest_sun(levels),
            peaks: filled(gpu, &peaks),
            fill: kernel(&["CLOUD_CELLS"])?,
            sweep: kernel(&["CLOUD_SWEEP"])?,
            gather: kernel(&["CLOUD_GATHER"])?,
            prolong: kernel(&["CLOUD_GATHER", "CLOUD_PROLONG"])?,
            rays: kernel(&[])?,
        })
    }

    fn block(&self, to_sun: [f64; 3], lighting: &Lighting) -> GridBlock {
        let to_sun = to_sun.map(|c| c as f32);
        GridBlock {
            to_sun,
            shear: slant(to_sun, self.lowest).shear,
            sun: lighting.sun,
            uniform_light: lighting.around[0],
            below: lighting.around[1],
            ..self.block
        }
    }

    /// What the cells scatter, for a sun that the tile was baked for.
    pub fn solve(&self, tile: &Tile, to_sun: [f64; 3], lighting: &Lighting) -> wgpu::Buffer {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let mut coarser: Option<(wgpu::Buffer, [i32; 3])> = None;
        for (edge, levels, sweeps) in GRIDS {
            let count = edge * edge * levels;
            let shape = [edge, levels, edge].map(|n| n as i32);
            let block = GridBlock {
                cells: shape,
                coarse: coarser.as_ref().map_or([1; 3], |c| c.1),
                ..self.block(to_sun, lighting)
            };
            let uniform = uniform_of(self.gpu, &block);
            let storage = |size| room(device, size, usage);
            let cells = storage(8 * count);
            let source = storage(4 * 24 * count);
            let moments = storage(64 * count);
            let last = storage(64 * count);
            let radiance = storage(4 * 24 * count);
            let faces = storage(4 * 24 * 2 * edge * edge);
            let ways = filled(
                self.gpu,
                &ways(self.block.size, self.thickness, edge, levels),
            );
            let head = vec![(0, uniform.as_entire_binding())];
            let aimed = vec![
                (0, uniform.as_entire_binding()),
                (1, ways.as_entire_binding()),
            ];
            let seen = vec![
                (0, wgpu::BindingResource::Sampler(&tile.sampler)),
                (1, wgpu::BindingResource::TextureView(&tile.views[0])),
            ];
            let mut encoder = device.create_command_encoder(&Default::default());
            let fill = groups(
                &self.gpu.device,
                &self.fill,
                &[head.clone(), seen, held(&[(1, &cells)])],
            );
            dispatch(&mut encoder, &self.fill, &fill, count.div_ceil(64));
            let gathered = |kernel: &Kernel, place: u32, from: &wgpu::Buffer| {
                let read = held(&[(3, &cells), (place, from)]);
                groups(
                    &self.gpu.device,
                    kernel,
                    &[
                        aimed.clone(),
                        read,
                        held(&[(3, &source), (4, &moments), (8, &last)]),
                    ],
                )
            };
            let gather = gathered(&self.gather, 5, &radiance);
            let read = held(&[(3, &cells), (4, &source)]);
            let sweep = groups(
                &self.gpu.device,
                &self.sweep,
                &[aimed.clone(), read, held(&[(2, &radiance), (6, &faces)])],
            );
            match &coarser {
                Some((coarse, _)) => {
                    let prolong = gathered(&self.prolong, 6, coarse);
                    dispatch(&mut encoder, &self.prolong, &prolong, count.div_ceil(64));
                }
                None => {
                    let mean = 0.5 * (lighting.around[0] + lighting.around[1]);
                    queue.write_buffer(&radiance, 0, &mean.to_le_bytes().repeat(24 * count));
                    dispatch(&mut encoder, &self.gather, &gather, count.div_ceil(64));
                }
            }
            for _ in 0..sweeps {
                dispatch(&mut encoder, &self.sweep, &sweep, 24);
                dispatch(&mut encoder, &self.gather, &gather, count.div_ceil(64));
            }
            queue.submit([encoder.finish()]);
            coarser = Some((moments, shape));
        }
        coarser.map_or_else(|| room(device, 64, usage), |c| c.0)
    }

    /// The light along rays, for the sun of `tile` and `moments`.
    pub fn run(
        &self,
        tile: &Tile,
        moments: &wgpu::Buffer,
        to_sun: [f64; 3],
        lighting: &Lighting,
        rays: &[ProbeRay],
    ) -> Result<Vec<CubeLight>, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let [n, levels] = [GRIDS[2].0, GRIDS[2].1].map(|n| n as i32);
        let block = GridBlock {
            count: rays.len() as i32,
            cells: [n, levels, n],
            ..self.block(to_sun, lighting)
        };
        let uniform = uniform_of(self.gpu, &block);
        let mut rows = Vec::with_capacity(32 * rays.len());
        for ray in rays {
            let [x, y, z] = ray.dir;
            let far = ray.distance.min(1e9);
            for number in [ray.altitude, far, 0.0, 0.0, x, y, z, 0.0] {
                rows.extend((number as f32).to_le_bytes());
            }
        }
        let exchange = Exchange::new(device, queue, &rows, 8 * rays.len());
        let read = vec![
            (0, wgpu::BindingResource::Sampler(&tile.sampler)),
            (1, wgpu::BindingResource::TextureView(&tile.views[0])),
            (7, exchange.input.as_entire_binding()),
            (8, self.peaks.as_entire_binding()),
            (9, moments.as_entire_binding()),
        ];
        let head = vec![(0, uniform.as_entire_binding())];
        let written = vec![(5, exchange.output.as_entire_binding())];
        let groups = groups(&self.gpu.device, &self.rays, &[head, read, written]);
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

pub(super) fn held<'b>(list: &[(u32, &'b wgpu::Buffer)]) -> Vec<(u32, wgpu::BindingResource<'b>)> {
    list.iter()
        .map(|(k, b)| (*k, b.as_entire_binding()))
        .collect()
}

/// The directions with how each goes through cells, from level to level.
pub(super) fn ways(period: f32, thickness: f64, edge: usize, levels: usize) -> Vec<u8> {
    let across = f64::from(period) / edge as f64;
    let up = thickness / levels as f64;
    let [n, k] = [edge as i32, levels as i32];
    let mut bytes = Vec::with_capacity(24 * WAY);
    for dir in directions() {
        for h in harmonics(dir) {
            bytes.extend((h as f32).to_le_bytes());
        }
        let sense = if dir[1] < 0.0 { -1 } else { 1 };
        for number in [k, n, n, sense, n, 1, n * k, 0] {
            bytes.extend(i32::to_le_bytes(number));
        }
        let rise = dir[1].abs();
        let shift = up / across / rise;
        for number in [-dir[0] * shift, -dir[2] * shift, up / rise, 0.0] {
            bytes.extend((number as f32).to_le_bytes());
        }
    }
    bytes
}

/// What is the same for every sun and grid.
pub(super) fn block_of(deck: &CloudDeck, levels: u32, least: f32) -> (GridBlock, Lobes) {
    let lobes = Lobes {
        albedo: deck.albedo,
        g_forward: deck.g_forward,
        g_backward: deck.g_backward,
        backward_share: deck.backward_share,
    };
    let block = GridBlock {
        size: deck.period() as f32,
        extinction: deck.extinction as f32,
        albedo: deck.albedo as f32,
        peak: lobes.peak() as f32,
        degrees: lobes.degrees().map(|d| d as f32),
        all_orders: 1,
        bottom: deck.bottom as f32,
        thickness: deck.thickness as f32,
        ground_radius: deck.planet_radius as f32,
        levels: levels as f32,
        least,
        ..Default::default()
    };
    (block, lobes)
}
