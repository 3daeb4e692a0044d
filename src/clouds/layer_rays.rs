//! Light of a layer of clouds alone along given rays: a query.

use super::layer_orders::{LayerOrders, Lighting};
use super::tile::{LOWEST_SUN, Tile, slant};
use super::{CloudDeck, CubeLight, Orders, ProbePath, fault};
use crate::atmosphere::ProbeRay;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::LayerProbe as ProbeBlock;

/// How the light of a layer is found, and what lights it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerOptions {
    /// For light that is scattered once: `Textbook` marches through the noise and to the sun from every sample, `Fast` reads a tile. Light of all orders is
    /// found from the tile on both, `Textbook` with steps a fourth as long.
    pub path: ProbePath,
    /// Which orders of scattering.
    pub orders: Orders,
    /// Irradiance of the sun across its rays, at least 0.
    pub sun: f32,
    /// Radiance that comes to the layer from every direction above, and from every one below, at least 0; needs all orders.
    pub around: [f32; 2],
}

impl Default for LayerOptions {
    /// All orders of the sun's light, along the fast path.
    fn default() -> Self {
        LayerOptions {
            path: ProbePath::Fast,
            orders: Orders::All,
            sun: 1.0,
            around: [0.0; 2],
        }
    }
}

/// Light that a layer scatters into rays, without air, and its transmittance. Rays end at the ground, which is black but for the radiance that comes from
/// below. Submits and waits; a tile of 512 x 512 x 64 is baked for each sun where one is read.
///
/// Light of all orders is that of a layer over a plane that repeats, without the planet's curvature, swept over cells as in [`super::cube_light`]; what light
/// from above and from below shows of itself behind the clouds is not counted. The sun's depths are those of a sun that is at least as high as
/// [`LOWEST_SUN`]; where it is lower, rays of single scattering are marched on both paths.
///
/// # Errors
/// As [`CloudDeck::check`]; [`Error::OutOfDomain`] for options; the faults of making pipelines; [`Error::Device`].
pub fn layer_light(
    gpu: &Gpu,
    programs: &ProgramSet,
    deck: &CloudDeck,
    rays: &[ProbeRay],
    options: &LayerOptions,
) -> Result<Vec<CubeLight>, Error> {
    deck.check()?;
    for (name, value) in [
        ("sun", options.sun),
        ("around[0]", options.around[0]),
        ("around[1]", options.around[1]),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(fault(
                &format!("options.{name}"),
                value,
                "finite and at least 0",
            ));
        }
    }
    let all = options.orders == Orders::All;
    if !all && options.around != [0.0; 2] {
        return Err(fault(
            "options.around",
            format!("{:?}", options.around),
            "0 for single scattering",
        ));
    }
    let path = options.path;
    let clear = CubeLight {
        scatter: 0.0,
        transmittance: 1.0,
    };
    let mut light = vec![clear; rays.len()];
    if deck.is_empty() {
        return Ok(light);
    }
    let mut groups: Vec<([f64; 3], Vec<usize>)> = Vec::new();
    for (i, ray) in rays.iter().enumerate() {
        match groups.iter_mut().find(|(sun, _)| *sun == ray.to_sun) {
            Some((_, members)) => members.push(i),
            None => groups.push((ray.to_sun, vec![i])),
        }
    }
    let (device, queue) = (&gpu.device, &gpu.queue);
    if all {
        let textbook = path == ProbePath::Textbook;
        let shortest = deck.thickness / if textbook { 256.0 } else { 64.0 };
        let solver = LayerOrders::new(gpu, programs, deck, 64, shortest)?;
        let tile = Tile::new(device, programs, &[512], 64)?;
        let lighting = Lighting {
            sun: options.sun,
            around: options.around,
        };
        for (to_sun, members) in &groups {
            bake(gpu, &tile, deck, to_sun.map(|c| c as f32));
            let moments = solver.solve(&tile, *to_sun, &lighting);
            for part in members.chunks(1 << 12) {
                let rows: Vec<ProbeRay> = part.iter().map(|i| rays[*i]).collect();
                let found = solver.run(&tile, &moments, *to_sun, &lighting, &rows)?;
                for (i, found) in part.iter().zip(found) {
                    light[*i] = found;
                }
            }
        }
        return Ok(light);
    }
    let marched = compute(device, programs, "cloud_probe", &[], &[])?;
    let mut baked = None;
    for (to_sun, members) in &groups {
        let sun = to_sun.map(|c| c as f32);
        let fast = path == ProbePath::Fast && sun[1] >= LOWEST_SUN;
        if fast && baked.is_none() {
            let kernel = compute(device, programs, "cloud_probe", &["CLOUD_TILE"], &[])?;
            baked = Some((Tile::new(device, programs, &[512], 64)?, kernel));
        }
        let tile = baked.as_ref().filter(|_| fast);
        if let Some((tile, _)) = tile {
            bake(gpu, tile, deck, sun);
        }
        let (pipeline, layouts) = tile.map_or(&marched, |(_, kernel)| kernel);
        for part in members.chunks(1 << 12) {
            let block = ProbeBlock {
                to_sun: sun,
                ground_radius: deck.planet_radius as f32,
                shear: slant(sun).0,
                edge: deck.period() as f32,
                levels: 64.0,
                bottom: deck.bottom as f32,
                thickness: deck.thickness as f32,
                extinction: deck.extinction as f32,
                albedo: deck.albedo as f32,
                g_forward: deck.g_forward as f32,
                g_backward: deck.g_backward as f32,
                backward_share: deck.backward_share as f32,
                coverage: deck.coverage as f32,
                uniformity: deck.uniformity as f32,
                turns_per_metre: (1.0 / deck.period()) as f32,
                period_doublings: deck.period_doublings,
                seed: deck.seed,
                count: part.len() as i32,
                ..Default::default()
            };
            let uniform = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta layer probe"),
                size: ProbeBlock::SIZE as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            queue.write_buffer(&uniform, 0, &block.to_bytes());
            let mut rows = Vec::with_capacity(32 * part.len());
            for i in part {
                let ray = &rays[*i];
                let [x, y, z] = ray.dir;
                let far = ray.distance.min(1e9);
                for number in [x, y, z, ray.altitude, far, 0.0, 0.0, 0.0] {
                    rows.extend((number as f32).to_le_bytes());
                }
            }
            let exchange = Exchange::new(device, queue, &rows, 8 * part.len());
            let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
            let mut read = vec![entry(0, exchange.input.as_entire_binding())];
            if let Some((tile, _)) = tile {
                read.push(entry(1, wgpu::BindingResource::Sampler(&tile.sampler)));
                read.push(entry(2, wgpu::BindingResource::TextureView(&tile.views[0])));
            }
            let bound = [
                vec![entry(0, uniform.as_entire_binding())],
                read,
                vec![entry(0, exchange.output.as_entire_binding())],
            ];
            let groups: Vec<wgpu::BindGroup> = layouts
                .iter()
                .zip(&bound)
                .map(|(layout, entries)| {
                    device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("veduta layer probe"),
                        layout,
                        entries,
                    })
                })
                .collect();
            let encoder = device.create_command_encoder(&Default::default());
            let workgroups = part.len().div_ceil(64) as u32;
            let found = exchange.run(device, queue, encoder, pipeline, &groups, workgroups)?;
            let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            for (i, row) in part.iter().zip(found.chunks_exact(8)) {
                light[*i] = CubeLight {
                    scatter: options.sun * number(row),
                    transmittance: number(&row[4..]),
                };
            }
        }
    }
    Ok(light)
}

fn bake(gpu: &Gpu, tile: &Tile, deck: &CloudDeck, sun: [f32; 3]) {
    for part in 0..tile.parts(0) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = tile.bake(&gpu.queue, &mut encoder, deck, sun, 0, part);
        gpu.queue.submit([encoder.finish()]);
    }
}
