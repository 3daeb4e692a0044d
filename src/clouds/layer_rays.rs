//! Light of a layer of clouds alone along given rays: a query.

use super::tile::{LOWEST_SUN, Tile, slant};
use super::{CloudDeck, CubeLight, ProbePath};
use crate::atmosphere::ProbeRay;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::LayerProbe as ProbeBlock;

/// Light that a layer scatters once into rays, for a sun of irradiance 1 without air and without light from the ground, and its transmittance: marched
/// through the noise, or on the path `Fast` from a tile of 512 x 512 x 64. Rays end at the ground. Submits and waits; a tile is baked for each sun.
/// Where the sun is lower than a tile may be baked for (see [`LOWEST_SUN`]) rays are marched.
///
/// # Errors
/// As [`CloudDeck::check`]; the faults of making pipelines; [`Error::Device`].
pub fn layer_light(
    gpu: &Gpu,
    programs: &ProgramSet,
    deck: &CloudDeck,
    rays: &[ProbeRay],
    path: ProbePath,
) -> Result<Vec<CubeLight>, Error> {
    deck.check()?;
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
            for part in 0..tile.parts(0) {
                let mut encoder = device.create_command_encoder(&Default::default());
                let _ = tile.bake(queue, &mut encoder, deck, sun, 0, part);
                queue.submit([encoder.finish()]);
            }
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
                    scatter: number(row),
                    transmittance: number(&row[4..]),
                };
            }
        }
    }
    Ok(light)
}
