//! The tile of a layer: density and optical depth to the sun, baked in rows.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use super::{CloudDeck, WeatherTexels};
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::Work;
use crate::program::ProgramSet;
use crate::programs::blocks::TileRows as RowsBlock;

/// Sine of the lowest height of the sun that any tile is baked for; for a lower sun that of a degree takes its place. Down to [`CloudDeck::lowest_sun`] columns of the tile follow the sun's
/// rays; below they stand upright, and depths are summed along rays in parts.
pub const LOWEST_SUN: f32 = 0.017_452;

/// The fields of `CloudTile` for no clouds: everything is lit by the one texel of the clear tile.
pub(crate) const CLEAR: [f32; 13] = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0,
];

/// A tile without depth.
pub(crate) fn clear_tile(device: &wgpu::Device) -> wgpu::TextureView {
    device
        .create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta no clouds"),
            size: Default::default(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rg16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
        .create_view(&Default::default())
}

/// Rows that are baked at once: what the buffer between program and texture holds.
const ROWS: u32 = 8;

/// Bytes of a row in the buffer: copies want multiples of 256.
fn row_bytes(texel: u32, texels: u32) -> u32 {
    (texel * texels).next_multiple_of(256)
}

/// Textures of a layer with what bakes them.
#[derive(Debug)]
pub(super) struct Tile {
    pub levels: u32,
    /// Bytes of a texel.
    texel: u32,
    /// What programs are told as the least density: 1 where texels have 16 bits a number.
    pub least: f32,
    /// Texels of the edge of each texture.
    pub texels: Vec<u32>,
    pub views: Vec<wgpu::TextureView>,
    textures: Vec<wgpu::Texture>,
    pipeline: wgpu::ComputePipeline,
    /// For a low sun, with what is bound to its ways.
    low: (wgpu::ComputePipeline, wgpu::Buffer, wgpu::BindGroup),
    slots: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    target: wgpu::BindGroup,
    staging: wgpu::Buffer,
    pub sampler: wgpu::Sampler,
    weather: Option<Weather>,
    low_layout: wgpu::BindGroupLayout,
}

/// A map of the weather, with what the program reads it by.
#[derive(Debug)]
struct Weather {
    view: wgpu::TextureView,
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    /// The layer's own map, none for one that a host has told, and whether the device has it.
    own: Option<(WeatherTexels, wgpu::Texture, AtomicBool)>,
}

/// What a program reads besides its uniforms: a map of the weather, the ways of a low sun.
fn bound(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    weather: Option<&wgpu::TextureView>,
    ways: Option<&wgpu::Buffer>,
) -> wgpu::BindGroup {
    let weather = weather.map(wgpu::BindingResource::TextureView);
    let ways = ways.map(wgpu::Buffer::as_entire_binding);
    let entries: Vec<_> = [(0, weather), (1, ways)]
        .into_iter()
        .filter_map(|(binding, resource)| {
            resource.map(|resource| wgpu::BindGroupEntry { binding, resource })
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("veduta cloud rows"),
        layout,
        entries: &entries,
    })
}

/// How the sun's rays and the columns of a tile go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slant {
    /// Horizontal way of a column per metre of height: that of a ray, or 0 for a sun lower than columns follow.
    pub shear: [f32; 2],
    /// Horizontal way of a ray per metre of height.
    pub sunward: [f32; 2],
    /// Its whole way.
    length: f32,
    /// Whether the sun is so low that columns stand upright.
    low: bool,
}

/// Where a sun will be in so many frames if it goes on by `step` a frame, at most 4.6 degrees on: it may stop.
pub(super) fn ahead_of(to_sun: Vec3, step: Vec3, frames: f32) -> Vec3 {
    (to_sun + (frames * step).clamp_length_max(0.08)).normalize_or(to_sun)
}

/// For a sun, where columns follow its rays down to `lowest`, a sine.
pub(super) fn slant(to_sun: [f32; 3], lowest: f32) -> Slant {
    let [x, y, z] = to_sun;
    let rise = y.clamp(LOWEST_SUN, 1.0);
    let across = (x * x + z * z).sqrt();
    // One that is straight below lies in no direction: any will do.
    let ([x, z], across) = if across > 1e-6 {
        ([x, z], across)
    } else {
        ([1.0, 0.0], 1.0)
    };
    // The same length whatever the rise.
    let level = (1.0 - rise * rise).sqrt() / across;
    let sunward = [x * level / rise, z * level / rise];
    let low = rise < lowest;
    Slant {
        shear: if low { [0.0; 2] } else { sunward },
        sunward,
        length: 1.0 / rise,
        low,
    }
}

/// Horizontal ways of a low sun's ray from each level of a tile to the one above (m), on a round planet: the ways from any level up to the last are as long as those of a ray that begins
/// there at the sun's height.
fn ways_up(deck: &CloudDeck, slant: &Slant, levels: u32) -> Vec<f64> {
    let tangent = 1.0
        / slant
            .sunward
            .map(f64::from)
            .map(|w| w * w)
            .iter()
            .sum::<f64>()
            .sqrt();
    let height = deck.thickness / f64::from(levels - 1);
    let way = |rise: f64| {
        2.0 * rise / (tangent + (tangent * tangent + 2.0 * rise / deck.planet_radius).sqrt())
    };
    (1..levels)
        .rev()
        .map(|k| way(height * f64::from(k)) - way(height * f64::from(k - 1)))
        .collect()
}

/// Parts that such a way is taken in: so many that a part goes at most a twelfth of a wavelength across.
fn parts_of(deck: &CloudDeck, way: f64) -> f64 {
    (12.0 * way / deck.wavelength).ceil().clamp(1.0, 256.0)
}

impl Tile {
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        deck: &CloudDeck,
        texels: &[u32],
        levels: u32,
        wide: bool,
    ) -> Result<Tile, Error> {
        let most = texels.iter().copied().max().unwrap_or(64);
        let bits: &[&str] = if wide { &["CLOUD_WIDE"] } else { &[] };
        let texel = if wide { 4 } else { 2 };
        let flags = [deck.flags(), bits].concat();
        let (pipeline, layouts) = compute(device, programs, "cloud_tile", &flags, &[])?;
        let (low, low_layouts) = compute(
            device,
            programs,
            "cloud_tile",
            &[&flags[..], &["CLOUD_LOW_SUN"]].concat(),
            &[],
        )?;
        let textures: Vec<wgpu::Texture> = texels
            .iter()
            .map(|&texels| {
                device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("veduta cloud tile"),
                    size: wgpu::Extent3d {
                        width: texels,
                        height: texels,
                        depth_or_array_layers: levels,
                    },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D3,
                    format: if wide {
                        wgpu::TextureFormat::Rg16Float
                    } else {
                        wgpu::TextureFormat::Rg8Snorm
                    },
                    usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                    view_formats: &[],
                })
            })
            .collect();
        let buffer = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta cloud rows"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let staging = buffer(
            u64::from(row_bytes(texel, most) * ROWS * levels),
            Usage::STORAGE | Usage::COPY_SRC,
        );
        let group = |layout, buffer: &wgpu::Buffer| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("veduta cloud rows"),
                layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: buffer.as_entire_binding(),
                }],
            })
        };
        let slots = (0..most.div_ceil(ROWS))
            .map(|_| {
                let uniform = buffer(RowsBlock::SIZE as u64, Usage::UNIFORM | Usage::COPY_DST);
                let bound = group(&layouts[0], &uniform);
                (uniform, bound)
            })
            .collect();
        let ways = buffer(32 * u64::from(levels), Usage::STORAGE | Usage::COPY_DST);
        let weather = match deck.mapped() {
            Some((_, map)) => {
                let texels = map.known()?.clone();
                let texture = texels.texture(device);
                let view = texture.create_view(&Default::default());
                Some(Weather {
                    group: bound(device, &layouts[1], Some(&view), None),
                    layout: layouts[1].clone(),
                    view,
                    own: Some((texels, texture, AtomicBool::new(false))),
                })
            }
            None => None,
        };
        let view = weather.as_ref().map(|w| &w.view);
        let low_group = bound(device, &low_layouts[1], view, Some(&ways));
        Ok(Tile {
            low: (low, ways, low_group),
            low_layout: low_layouts[1].clone(),
            weather,
            levels,
            texel,
            least: if wide { 1.0 } else { deck.least_density() },
            texels: texels.to_vec(),
            views: textures
                .iter()
                .map(|t| t.create_view(&Default::default()))
                .collect(),
            textures,
            pipeline,
            slots,
            target: group(&layouts[2], &staging),
            staging,
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("veduta cloud tile"),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                address_mode_w: wgpu::AddressMode::ClampToEdge,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
        })
    }

    /// Bakes with a host's map from now on; whether the layer has its weather from a map at all.
    pub fn set_weather(&mut self, device: &wgpu::Device, view: &wgpu::TextureView) -> bool {
        if let Some(weather) = &mut self.weather {
            weather.group = bound(device, &weather.layout, Some(view), None);
            weather.view = view.clone();
            weather.own = None;
            self.low.2 = bound(device, &self.low_layout, Some(view), Some(&self.low.1));
        }
        self.weather.is_some()
    }

    /// Bytes of the layer's own map, and whether there is any.
    pub fn weather(&self) -> (u64, bool) {
        let own = self.weather.as_ref().and_then(|w| w.own.as_ref());
        (own.map_or(0, |(t, ..)| t.bytes()), self.weather.is_some())
    }

    /// Parts that a texture is baked in.
    pub fn parts(&self, texture: usize) -> u32 {
        self.texels[texture].div_ceil(ROWS)
    }

    pub fn slots(&self) -> u32 {
        self.slots.len() as u32
    }

    pub fn texture_bytes(&self) -> u64 {
        let texels = |n: &u32| u64::from(*n) * u64::from(*n);
        u64::from(self.texel * self.levels) * self.texels.iter().map(texels).sum::<u64>()
    }

    pub fn buffer_bytes(&self) -> u64 {
        self.staging.size() + self.low.1.size() + self.slots.len() as u64 * RowsBlock::SIZE as u64
    }

    /// Parts that a low sun's ray takes between two levels, in the mean: how many times as dear a tile is.
    pub fn cost(&self, deck: &CloudDeck, to_sun: [f32; 3]) -> f64 {
        let slant = slant(to_sun, deck.lowest_sun(self.levels));
        if !slant.low {
            return 1.0;
        }
        let ways = ways_up(deck, &slant, self.levels);
        let count = ways.len() as f64;
        ways.into_iter().map(|w| parts_of(deck, w)).sum::<f64>() / count
    }

    /// The ways of a low sun's rays as the program reads them, for an edge of so many texels; and how many rows they have gone from their own at each level. At every level they are at
    /// the middle of a texel, the first of a word.
    fn low_ways(&self, deck: &CloudDeck, slant: &Slant, texels: u32) -> (Vec<u8>, Vec<u32>) {
        let texel = deck.period() / f64::from(texels);
        let height = deck.thickness / f64::from(self.levels - 1);
        let sunward = slant.sunward.map(f64::from);
        let level = sunward[0].hypot(sunward[1]);
        let steps = [f64::from(4 / self.texel), 1.0];
        let ways = ways_up(deck, slant, self.levels);
        // Texels from the first level on.
        let mut gone = vec![[0.0; 2]];
        let mut sum = 0.0;
        for way in &ways {
            sum += way;
            gone.push(std::array::from_fn(|k| {
                (sum * sunward[k] / level / texel / steps[k]).round() * steps[k]
            }));
        }
        let within = |n: f64| n.rem_euclid(f64::from(texels));
        let mut bytes = Vec::with_capacity(32 * gone.len());
        for (k, at) in gone.iter().enumerate() {
            let (next, parts, length) = match (gone.get(k + 1), ways.get(k)) {
                (Some(next), Some(way)) => (*next, parts_of(deck, *way), way.hypot(height)),
                _ => (*at, 1.0, 0.0),
            };
            for number in [
                within(at[0]),
                within(at[1]),
                (next[0] - at[0]) * texel,
                (next[1] - at[1]) * texel,
                parts,
                deck.extinction * length / parts,
                0.0,
                0.0,
            ] {
                bytes.extend((number as f32).to_le_bytes());
            }
        }
        (bytes, gone.iter().map(|at| within(at[1]) as u32).collect())
    }

    /// Records the baking of a part of one of the textures.
    pub fn bake(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        deck: &CloudDeck,
        to_sun: [f32; 3],
        texture: usize,
        part: u32,
    ) -> Work {
        let slant = slant(to_sun, deck.lowest_sun(self.levels));
        let texels = self.texels[texture];
        let first = part * ROWS;
        let rows = ROWS.min(texels - first);
        let shape = deck.shape.clone().unwrap_or_default();
        let block = RowsBlock {
            shear: slant.shear,
            edge: deck.period() as f32,
            slant: slant.length,
            texels: texels as i32,
            levels: self.levels as i32,
            first_row: first as i32,
            rows: rows as i32,
            turns_per_metre: (1.0 / deck.period()) as f32,
            period_doublings: deck.period_doublings,
            bottom: deck.bottom as f32,
            thickness: deck.thickness as f32,
            coverage: deck.coverage as f32,
            uniformity: deck.uniformity as f32,
            extinction: deck.extinction as f32,
            seed: deck.seed,
            kind: shape.kind as f32,
            kind_spread: shape.kind_spread as f32,
            coverage_spread: shape.coverage_spread as f32,
            detail: shape.detail as f32,
            sharpness: shape.sharpness as f32,
            weather_doublings: shape.weather_doublings,
            least: self.least,
            repeats: shape.map.map_or(1, |m| m.repeats(deck.period())),
        };
        let (uniform, bound) = &self.slots[part as usize];
        let bytes = block.to_bytes();
        queue.write_buffer(uniform, 0, &bytes);
        let mut work = Work {
            dispatches: 1,
            writes: 1,
            bytes: bytes.len() as u64,
            ..Work::default()
        };
        let own = self.weather.as_ref().and_then(|w| w.own.as_ref());
        if let Some((map, texture, held)) = own
            && !held.swap(true, Ordering::Relaxed)
        {
            map.upload(queue, texture);
            work.writes += 1;
            work.bytes += map.bytes();
        }
        let shifts = if slant.low {
            let (ways, shifts) = self.low_ways(deck, &slant, texels);
            queue.write_buffer(&self.low.1, 0, &ways);
            work.writes += 1;
            work.bytes += ways.len() as u64;
            shifts
        } else {
            Vec::new()
        };
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(if slant.low {
                &self.low.0
            } else {
                &self.pipeline
            });
            pass.set_bind_group(0, bound, &[]);
            if slant.low {
                pass.set_bind_group(1, &self.low.2, &[]);
            } else if let Some(weather) = &self.weather {
                pass.set_bind_group(1, &weather.group, &[]);
            }
            pass.set_bind_group(2, &self.target, &[]);
            pass.dispatch_workgroups((texels * rows * self.texel / 4).div_ceil(64), 1, 1);
        }
        // Rows from a level on, of so many levels, to rows of the texture.
        let mut copy = |level: u32, levels: u32, from: u32, to: u32, count: u32| {
            let bytes = row_bytes(self.texel, texels);
            encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo {
                    buffer: &self.staging,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: u64::from((level * rows + from) * bytes),
                        bytes_per_row: Some(bytes),
                        rows_per_image: Some(rows),
                    },
                },
                wgpu::TexelCopyTextureInfo {
                    origin: wgpu::Origin3d {
                        x: 0,
                        y: to,
                        z: level,
                    },
                    ..self.textures[texture].as_image_copy()
                },
                wgpu::Extent3d {
                    width: texels,
                    height: count,
                    depth_or_array_layers: levels,
                },
            );
        };
        if shifts.is_empty() {
            copy(0, self.levels, 0, first, rows);
        }
        for (level, shift) in (0..).zip(shifts) {
            // Rows go on at the other edge.
            let to = (first + shift) % texels;
            let before = rows.min(texels - to);
            copy(level, 1, 0, to, before);
            if before < rows {
                copy(level, 1, before, 0, rows - before);
            }
        }
        work
    }
}
