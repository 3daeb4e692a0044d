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
/// [`super::LOWEST_SUN`]; where it is lower, and for layers of a long period ([`CloudDeck::is_windowed`]), rays of single scattering are marched on both paths.
///
/// # Errors
/// As [`CloudDeck::check`]; [`Error::OutOfDomain`] for options, and for all orders in a layer of a long period; the faults of making pipelines; [`Error::Device`].
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
    if all {
        check_period(deck)?;
        let textbook = path == ProbePath::Textbook;
        let shortest = deck.thickness / if textbook { 256.0 } else { 64.0 };
        let solver = LayerOrders::new(gpu, programs, deck, 64, shortest)?;
        let tile = Tile::new(&gpu.device, programs, deck, &[512], 64, true)?;
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
    let (mut marched, mut baked) = (None, None);
    for (to_sun, members) in &groups {
        let sun = to_sun.map(|c| c as f32);
        let fast = path == ProbePath::Fast && sun[1] >= LOWEST_SUN && !deck.is_windowed();
        let rows: Vec<[f32; 5]> = members
            .iter()
            .map(|i| {
                let ray = &rays[*i];
                let [x, y, z] = ray.dir.map(|c| c as f32);
                [x, y, z, ray.altitude as f32, ray.distance.min(1e9) as f32]
            })
            .collect();
        let (query, kind) = if fast {
            (&mut baked, Kind::Tile)
        } else {
            (&mut marched, Kind::March)
        };
        let query = match query {
            Some(query) => query,
            none => none.insert(Query::new(gpu, programs, deck, kind)?),
        };
        for (i, found) in members.iter().zip(query.ask(sun, &rows)?) {
            light[*i] = CubeLight {
                scatter: options.sun * found.scatter,
                ..found
            };
        }
    }
    Ok(light)
}

/// Share of the sun's light that a layer lets straight through to points: (x, altitude, z) in metres, from the tile that `Clouds` and `cloud_shadow` read, with suns
/// below [`super::LOWEST_SUN`] taken to be that high. What the clouds scatter down is not counted. Submits and waits.
///
/// # Errors
/// As [`CloudDeck::check`]; [`Error::OutOfDomain`] for points that are not finite and for layers of a long period ([`CloudDeck::is_windowed`]); the faults of making pipelines; [`Error::Device`].
pub fn layer_shadow(
    gpu: &Gpu,
    programs: &ProgramSet,
    deck: &CloudDeck,
    to_sun: [f64; 3],
    points: &[[f64; 3]],
) -> Result<Vec<f32>, Error> {
    deck.check()?;
    check_period(deck)?;
    for (number, point) in points.iter().enumerate() {
        if point.iter().any(|c| !c.is_finite()) {
            let value = format!("{point:?}");
            return Err(fault(&format!("point {number}"), value, "finite"));
        }
    }
    if deck.is_empty() {
        return Ok(vec![1.0; points.len()]);
    }
    let period = deck.period();
    let rows = points
        .iter()
        .map(|[x, y, z]| {
            let [x, z] = [x, z].map(|c| c.rem_euclid(period) as f32);
            [x, 0.0, z, *y as f32, 0.0]
        })
        .collect::<Vec<_>>();
    let query = Query::new(gpu, programs, deck, Kind::Shadow)?;
    let found = query.ask(to_sun.map(|c| c as f32), &rows)?;
    Ok(found.into_iter().map(|l| l.transmittance).collect())
}

/// A tile over a long period would have no texels for its clouds.
fn check_period(deck: &CloudDeck) -> Result<(), Error> {
    if deck.is_windowed() {
        let domain = "at most 4 for a query that bakes a tile of the whole period";
        return Err(fault(
            "deck.period_doublings",
            deck.period_doublings,
            domain,
        ));
    }
    Ok(())
}

/// What the program is asked for.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    March,
    Tile,
    Shadow,
}

/// The program with its tile, where it reads one.
struct Query<'a> {
    gpu: &'a Gpu,
    deck: &'a CloudDeck,
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    tile: Option<Tile>,
    /// A map of the weather for the march.
    weather: Option<wgpu::TextureView>,
}

impl<'a> Query<'a> {
    fn new(
        gpu: &'a Gpu,
        programs: &ProgramSet,
        deck: &'a CloudDeck,
        kind: Kind,
    ) -> Result<Query<'a>, Error> {
        let flags = match kind {
            Kind::March => deck.flags(),
            Kind::Tile => &["CLOUD_TILE"],
            Kind::Shadow => &["CLOUD_SHADOW"],
        };
        let (pipeline, layouts) = compute(&gpu.device, programs, "cloud_probe", flags, &[])?;
        let tile = match kind {
            Kind::March => None,
            _ => Some(Tile::new(&gpu.device, programs, deck, &[512], 64, true)?),
        };
        let weather = match deck.mapped().filter(|_| kind == Kind::March) {
            Some((_, map)) => {
                let texels = map.known()?;
                let texture = texels.texture(&gpu.device);
                texels.upload(&gpu.queue, &texture);
                Some(texture.create_view(&Default::default()))
            }
            None => None,
        };
        Ok(Query {
            weather,
            gpu,
            deck,
            pipeline,
            layouts,
            tile,
        })
    }

    /// Rows of direction, altitude and distance, with the light of each.
    fn ask(&self, sun: [f32; 3], list: &[[f32; 5]]) -> Result<Vec<CubeLight>, Error> {
        let (gpu, deck) = (self.gpu, self.deck);
        let (device, queue) = (&gpu.device, &gpu.queue);
        if let Some(tile) = &self.tile {
            bake(gpu, tile, deck, sun);
        }
        let mut light = Vec::with_capacity(list.len());
        let slant = slant(sun, deck.lowest_sun(64));
        let shape = deck.shape.clone().unwrap_or_default();
        for part in list.chunks(1 << 12) {
            let block = ProbeBlock {
                to_sun: sun,
                ground_radius: deck.planet_radius as f32,
                shear: slant.shear,
                sunward: slant.sunward,
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
                kind: shape.kind as f32,
                kind_spread: shape.kind_spread as f32,
                coverage_spread: shape.coverage_spread as f32,
                detail: shape.detail as f32,
                sharpness: shape.sharpness as f32,
                weather_doublings: shape.weather_doublings,
                least: 1.0,
                repeats: shape.map.as_ref().map_or(1, |m| m.repeats(deck.period())),
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
            for [x, y, z, altitude, far] in part {
                for number in [*x, *y, *z, *altitude, *far, 0.0, 0.0, 0.0] {
                    rows.extend(number.to_le_bytes());
                }
            }
            let exchange = Exchange::new(device, queue, &rows, 8 * part.len());
            let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
            let mut read = vec![entry(0, exchange.input.as_entire_binding())];
            if let Some(tile) = &self.tile {
                read.push(entry(1, wgpu::BindingResource::Sampler(&tile.sampler)));
                read.push(entry(2, wgpu::BindingResource::TextureView(&tile.views[0])));
            }
            if let Some(view) = &self.weather {
                read.push(entry(3, wgpu::BindingResource::TextureView(view)));
            }
            let bound = [
                vec![entry(0, uniform.as_entire_binding())],
                read,
                vec![entry(0, exchange.output.as_entire_binding())],
            ];
            let groups: Vec<wgpu::BindGroup> = self
                .layouts
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
            let found =
                exchange.run(device, queue, encoder, &self.pipeline, &groups, workgroups)?;
            let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            light.extend(found.chunks_exact(8).map(|row| CubeLight {
                scatter: number(row),
                transmittance: number(&row[4..]),
            }));
        }
        Ok(light)
    }
}

fn bake(gpu: &Gpu, tile: &Tile, deck: &CloudDeck, sun: [f32; 3]) {
    for part in 0..tile.parts(0) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = tile.bake(&gpu.queue, &mut encoder, deck, sun, 0, part);
        gpu.queue.submit([encoder.finish()]);
    }
}
