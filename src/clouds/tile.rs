//! The tile of a layer: density and optical depth to the sun, baked in rows.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{CloudDeck, WeatherTexels};
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::Work;
use crate::program::ProgramSet;
use crate::programs::blocks::TileRows as RowsBlock;

/// Sine of the lowest height of the sun that any tile is baked for; for a lower sun that of 7 degrees takes its place. [`CloudDeck::lowest_sun`] is that of a layer.
pub const LOWEST_SUN: f32 = 0.121_869;

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
    slots: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    target: wgpu::BindGroup,
    staging: wgpu::Buffer,
    pub sampler: wgpu::Sampler,
    weather: Option<Weather>,
}

/// A map of the weather, with what the program reads it by.
#[derive(Debug)]
struct Weather {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    /// The layer's own map, none for one that a host has told, and whether the device has it.
    own: Option<(WeatherTexels, wgpu::Texture, AtomicBool)>,
}

impl Weather {
    fn group(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        view: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta weather"),
            layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(view),
            }],
        })
    }
}

/// Horizontal way of the sun's ray per metre of height, and its whole way.
pub(super) fn slant(to_sun: [f32; 3], lowest: f32) -> ([f32; 2], f32) {
    let [x, y, z] = to_sun;
    let rise = y.max(lowest);
    let across = (x * x + z * z).sqrt();
    // The same length whatever the rise.
    let level = (1.0 - rise * rise).max(0.0).sqrt() / across.max(1e-12);
    ([x * level / rise, z * level / rise], 1.0 / rise)
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
        let weather = match deck.mapped() {
            Some((_, map)) => {
                let texels = map.known()?.clone();
                let texture = texels.texture(device);
                let view = texture.create_view(&Default::default());
                Some(Weather {
                    group: Weather::group(device, &layouts[1], &view),
                    layout: layouts[1].clone(),
                    own: Some((texels, texture, AtomicBool::new(false))),
                })
            }
            None => None,
        };
        Ok(Tile {
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
            weather.group = Weather::group(device, &weather.layout, view);
            weather.own = None;
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
        self.staging.size() + self.slots.len() as u64 * RowsBlock::SIZE as u64
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
        let (shear, slant) = slant(to_sun, deck.lowest_sun(self.levels));
        let texels = self.texels[texture];
        let first = part * ROWS;
        let rows = ROWS.min(texels - first);
        let shape = deck.shape.clone().unwrap_or_default();
        let block = RowsBlock {
            shear,
            edge: deck.period() as f32,
            slant,
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
            ..Default::default()
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
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, bound, &[]);
            if let Some(weather) = &self.weather {
                pass.set_bind_group(1, &weather.group, &[]);
            }
            pass.set_bind_group(2, &self.target, &[]);
            pass.dispatch_workgroups((texels * rows * self.texel / 4).div_ceil(64), 1, 1);
        }
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &self.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes(self.texel, texels)),
                    rows_per_image: Some(rows),
                },
            },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d {
                    x: 0,
                    y: first,
                    z: 0,
                },
                ..self.textures[texture].as_image_copy()
            },
            wgpu::Extent3d {
                width: texels,
                height: rows,
                depth_or_array_layers: self.levels,
            },
        );
        work
    }
}
