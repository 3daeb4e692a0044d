//! Baked heights around the eye, made anew only where the eye has uncovered ground.

use super::field::{HeightField, Kind, field_kind};
use super::ground::Prepared;
use super::land::Land;
use super::map::Relief;
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::{Resources, Work};
use crate::program::ProgramSet;
use crate::programs::blocks::{
    Clip as ClipBlock, Rectangle as RectangleBlock, Shade as ShadeBlock, Sweep as SweepBlock,
};
use crate::view::WorldPos;

/// How finely and how far heights are baked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClipmapOptions {
    /// Texels of a level's side: 128, 256, 512 or 1024. A texel is about as wide as a pixel where it is used when this is 3.5 over the angle of a pixel.
    pub texels: u32,
    /// Levels at most, in [1, 16].
    pub levels: u32,
    /// Distance that the coarsest level shall reach (m), in [100, 4e6].
    pub reach: f64,
    /// Texels that a sector around the eye is wide, 4, 8 or 16; half as many are a side of the squares of which the greatest heights are kept. Windows move by 32 texels with 4, else by an eighth of a
    /// level.
    pub width: u32,
}

impl Default for ClipmapOptions {
    /// 512 texels, to 60 km.
    fn default() -> Self {
        ClipmapOptions {
            texels: 512,
            levels: 16,
            reach: 60_000.0,
            width: 4,
        }
    }
}

/// Rings around the eye at most, a multiple of 64.
const RINGS: u32 = 1024;

/// How near the baked ground rays look for the field itself (texels), where texels are wider than pixels. Of V12, whose pixels are a fifth of them, 0.1 leaves 0.37 % of the rays wrong at the
/// silhouette, 0.2 0.2 %, 0.25 0.17 % and 0.35 0.12 %, for more steps each.
const MARGIN: f32 = 0.25;

/// Where rays look for the field itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Searched {
    /// Nowhere: the last steps from the baked ground have to do.
    Nowhere,
    /// Near the baked ground where its texels are wider than pixels.
    Lens,
    /// Near the baked ground, and in a wider margin.
    Everywhere,
}

/// How near the baked ground that is (texels) for rays that look for it everywhere.
const WIDE_MARGIN: f32 = 0.5;

/// Where an eye looks, as far as baking is concerned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gaze {
    /// Levels with finer texels wait until they are needed (m).
    pub least: f64,
    /// Distance from the eye within which rings are of one width (m): about that of the nearest ground.
    pub near: f64,
    /// Distance at which rays end (m).
    pub far: f64,
    /// Angle of a pixel (rad), and where rays look for the field itself.
    pub pixel_angle: f64,
    pub searched: Searched,
    /// The azimuths that are looked at, from +x towards +z: the first and the extent (rad).
    pub azimuths: [f64; 2],
    /// The light that throws shadows: the unit vector to it, and its angular radius (rad).
    pub sun: Option<([f64; 3], f64)>,
}

/// The sun that shadows were made for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SweptSun {
    to_sun: [f64; 3],
    angular_radius: f64,
}

/// By how much of its radius the sun may move before shadows are made anew.
const SUN_SLACK: f64 = 0.05;

impl SweptSun {
    /// Whether another sun is so near that nobody sees it.
    fn serves(&self, other: &SweptSun) -> bool {
        let off: f64 = (0..3)
            .map(|k| (self.to_sun[k] - other.to_sun[k]).powi(2))
            .sum();
        self.angular_radius == other.angular_radius && off.sqrt() <= SUN_SLACK * self.angular_radius
    }

    fn block(&self, planet_radius: f64) -> SweepBlock {
        let [x, y, z] = self.to_sun;
        let axis = usize::from(z.abs() > x.abs());
        let (main, side) = if axis == 0 { (x, z) } else { (z, x) };
        // A sun this near the zenith throws no shadow that is seen.
        let elevation = y.atan2(x.hypot(z));
        let most = 89_f64.to_radians();
        let tangent = |e: f64| e.clamp(-most, most).tan();
        let middle = tangent(elevation).clamp(-12.0, 12.0);
        SweepBlock {
            axis: axis as i32,
            shear: if main.abs() > 1e-9 {
                (side / main) as f32
            } else {
                0.0
            },
            upper: tangent(elevation + self.angular_radius) as f32,
            lower: tangent(elevation - self.angular_radius) as f32,
            growth: ((1.0 + middle * middle) / planet_radius) as f32,
            sign: if main < 0.0 { -1.0 } else { 1.0 },
        }
    }
}

/// Heights that shadows reach.
#[derive(Debug)]
struct Shades {
    pipeline: wgpu::ComputePipeline,
    levels: Vec<Slot>,
    /// What each level reads: heights and the next level; and where it writes.
    sources: Vec<wgpu::BindGroup>,
    targets: Vec<wgpu::BindGroup>,
    view: wgpu::TextureView,
    sun: Option<SweptSun>,
    windows: Vec<Option<Window>>,
}

/// The part of a level that is baked: its lower corner in texels of the world.
type Window = [i64; 2];

/// A rectangle of texels of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Span {
    from: [i64; 2],
    to: [i64; 2],
}

/// Texels that a window which moves by so many keeps between what it serves and its border.
fn border(block: i64) -> i64 {
    block / 2 + 4
}

/// Distance from an eye to the nearest ground (m), about, from heights below it and around it, wherever it looks; over a program's own function the height above all ground, and 1 where that is not
/// known.
pub(super) fn nearest_ground(field: &Prepared<f32>, eye: WorldPos) -> f64 {
    let below = eye.altitude() - f64::from(field.ground(eye, 0.0).height);
    if below.is_nan() {
        return field
            .bounds()
            .map_or(1.0, |b| (eye.altitude() - b.maximum).max(1.0));
    }
    // Nothing farther off than the ground below can be nearer.
    let (place, reach) = (field.place(eye), below.abs());
    let mut nearest = reach;
    for i in 0..16 {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(i) / 16.0).sin_cos();
        for share in [0.15, 0.3, 0.5, 0.75] {
            let d = share * reach;
            let at = [cosine * d, sine * d].map(|c| c as f32);
            let ground = field.ground_from(place, at, (0.1 * d) as f32);
            let rise = eye.altitude() - f64::from(ground.height);
            nearest = nearest.min(d.hypot(rise));
        }
    }
    nearest
}

/// What of the new window the old one does not cover: at most two rectangles.
fn uncovered(old: Option<Window>, new: Window, size: i64) -> Vec<Span> {
    let whole = Span {
        from: new,
        to: new.map(|c| c.wrapping_add(size)),
    };
    let Some(old) = old else {
        return vec![whole];
    };
    let moved: [i64; 2] = std::array::from_fn(|k| new[k].wrapping_sub(old[k]));
    // Eyes that jump over half of the world wrap, and are far off all the same.
    if moved
        .iter()
        .any(|m| m.unsigned_abs() >= size.unsigned_abs())
    {
        return vec![whole];
    }
    let mut spans = Vec::new();
    // All columns that are new, then the new rows of the others.
    let mut rest = whole;
    for (k, by) in moved.into_iter().enumerate() {
        if by == 0 {
            continue;
        }
        let mut part = rest;
        if by > 0 {
            part.from[k] = rest.to[k] - by;
            rest.to[k] = part.from[k];
        } else {
            part.to[k] = rest.from[k] - by;
            rest.from[k] = part.to[k];
        }
        spans.push(part);
    }
    spans
}

/// A uniform buffer with its group.
#[derive(Debug)]
struct Slot {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Heights of nested levels around the eye, with the maxima of blocks; see `veduta::terrain::clipmap`.
#[derive(Debug)]
pub struct Clipmap {
    field: Prepared<f32>,
    planet_radius: f64,
    texels: i64,
    /// Texels of a side of the squares of which the greatest heights are kept, as in the program `terrain_bake`.
    peak: i64,
    /// By what the windows move (texels), a multiple of `peak`.
    block: i64,
    spacing: f64,
    levels: usize,
    top: f32,
    windows: Vec<Option<Window>>,
    first: usize,
    bake: wgpu::ComputePipeline,
    sweep: wgpu::ComputePipeline,
    rectangles: Vec<Slot>,
    bake_source: wgpu::BindGroup,
    bake_target: wgpu::BindGroup,
    relief: Relief,
    sweep_groups: [wgpu::BindGroup; 3],
    /// Heights, tangents by sector and ring, places of the levels.
    pub(super) views: [wgpu::TextureView; 3],
    /// Sectors around the eye; the first that is made, and how many are.
    sectors: [i32; 3],
    pub(super) wrapping: wgpu::Sampler,
    shades: Option<Shades>,
    /// The uniform `Sweep`.
    pub(super) swept: wgpu::Buffer,
    places: wgpu::Texture,
    places_bytes: Vec<u8>,
    clip: wgpu::Buffer,
    clip_bytes: Vec<u8>,
}

fn buffer(device: &wgpu::Device, label: &str, size: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A bind group of resources in the order of their bindings.
pub(crate) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("veduta terrain"),
        layout,
        entries: &entries,
    })
}

/// Spacing of the finest level that a field can use: an eighth of its finest cells, a power of two.
fn finest(field: &HeightField) -> f64 {
    let last = match field.kind {
        // A map without detail.
        Kind::Map if field.amplitude == 0.0 => 0,
        _ => field.octaves - 1,
    };
    let cells = f64::from(field.wavelength as f32) / f64::from(last).exp2();
    (cells / 8.0).log2().floor().clamp(-4.0, 10.0).exp2()
}

impl Clipmap {
    /// Makes textures and pipelines; nothing is baked. Shadows cost twice the memory of heights.
    ///
    /// # Errors
    /// As [`Land::check`]; [`Error::OutOfDomain`] for options; the faults of [`ProgramSet::get`] and of making the pipelines.
    pub(super) fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        land: &Land,
        options: &ClipmapOptions,
        shaded: bool,
    ) -> Result<Clipmap, Error> {
        land.check()?;
        let fault = |name: &str, value: String, domain: &str| Error::OutOfDomain {
            name: format!("clipmap.{name}"),
            value,
            domain: domain.to_owned(),
        };
        if !matches!(options.texels, 128 | 256 | 512 | 1024) {
            let value = options.texels.to_string();
            return Err(fault("texels", value, "128, 256, 512 or 1024"));
        }
        if !(1..=16).contains(&options.levels) {
            return Err(fault("levels", options.levels.to_string(), "in [1, 16]"));
        }
        if !(100.0..=4e6).contains(&options.reach) {
            return Err(fault("reach", options.reach.to_string(), "in [100, 4e6] m"));
        }
        if !matches!(options.width, 4 | 8 | 16) {
            return Err(fault("width", options.width.to_string(), "4, 8 or 16"));
        }
        let field = land.prepare::<f32>()?;
        let texels = i64::from(options.texels);
        let peak = i64::from(options.width / 2);
        let block = if options.width == 4 { 32 } else { texels / 8 };
        let half = (texels / 2 - border(block)) as f64;
        let needed = (options.reach / half).log2().ceil().exp2();
        // From the coarsest on down, as many as there may be.
        let spacing = finest(&land.field)
            .max(needed / f64::from(options.levels - 1).exp2())
            .min(needed);
        let levels = (needed / spacing).log2().round() as usize + 1;
        let relief = Relief::new(device, field.map())?;
        let kind = [field_kind(programs, ("terrain_bake", &[]), &land.field)?];
        let (bake, bake_layouts) = compute(device, programs, "terrain_bake", &[], &kind)?;
        let (sweep, sweep_layouts) =
            compute(device, programs, "terrain_bake", &["CLIP_SECTORS"], &[])?;
        let texture = |label, width: u32, height: u32, layers: u32, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: layers,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let heights = texture(
            "veduta heights",
            options.texels,
            options.texels,
            levels as u32,
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::STORAGE_BINDING,
        )
        .create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let peaks = texture(
            "veduta peaks",
            options.texels / peak as u32,
            options.texels / peak as u32,
            levels as u32,
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::STORAGE_BINDING,
        )
        .create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        // Sectors that are narrower than four texels save rays fewer steps than they cost (measured).
        let count = 2 * options.texels / options.width;
        let sectors = texture(
            "veduta sectors",
            RINGS + RINGS / 8 + RINGS / 64,
            count,
            1,
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::STORAGE_BINDING,
        )
        .create_view(&Default::default());
        let places = texture(
            "veduta levels",
            16,
            2,
            1,
            wgpu::TextureFormat::Rgba32Float,
            wgpu::TextureUsages::COPY_DST,
        );
        let view = wgpu::BindingResource::TextureView;
        let rectangles = (0..2 * levels)
            .map(|_| {
                let buffer = buffer(device, "veduta rectangle", RectangleBlock::SIZE);
                let group = group(device, &bake_layouts[0], &[buffer.as_entire_binding()]);
                Slot { buffer, group }
            })
            .collect();
        // Without bounds (a program's own function) no ground is taken to be above 20 km.
        let top = field.bounds().map_or(2e4, |b| b.maximum) as f32;
        let places_view = places.create_view(&Default::default());
        let clip = buffer(device, "veduta clipmap", ClipBlock::SIZE);
        let wrapping = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("veduta repeats"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            ..Default::default()
        });
        let swept = buffer(device, "veduta sun", SweepBlock::SIZE);
        let shades = if shaded {
            let (pipeline, layouts) =
                compute(device, programs, "terrain_bake", &["CLIP_SHADES"], &[])?;
            // With one level the second is a place to read nothing from.
            let layers = levels.max(2) as u32;
            let shades = texture(
                "veduta shadows",
                options.texels,
                options.texels,
                layers,
                wgpu::TextureFormat::Rg32Float,
                wgpu::TextureUsages::STORAGE_BINDING,
            );
            let layer = |layer: u32, count: u32| {
                shades.create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2Array),
                    base_array_layer: layer,
                    array_layer_count: Some(count),
                    ..Default::default()
                })
            };
            Some(Shades {
                levels: (0..levels)
                    .map(|_| {
                        let buffer = buffer(device, "veduta shadows of a level", ShadeBlock::SIZE);
                        let group = group(device, &layouts[0], &[buffer.as_entire_binding()]);
                        Slot { buffer, group }
                    })
                    .collect(),
                sources: (0..levels as u32)
                    .map(|l| {
                        let next = layer((l + 1) % layers, 1);
                        let resources = [
                            wgpu::BindingResource::TextureView(&heights),
                            wgpu::BindingResource::TextureView(&next),
                            wgpu::BindingResource::Sampler(&wrapping),
                        ];
                        group(device, &layouts[1], &resources)
                    })
                    .collect(),
                targets: (0..levels as u32)
                    .map(|l| {
                        let own = layer(l, 1);
                        group(
                            device,
                            &layouts[2],
                            &[wgpu::BindingResource::TextureView(&own)],
                        )
                    })
                    .collect(),
                pipeline,
                view: layer(0, layers),
                sun: None,
                windows: vec![None; levels],
            })
        } else {
            None
        };
        let sweep_groups = [
            group(device, &sweep_layouts[0], &[clip.as_entire_binding()]),
            group(
                device,
                &sweep_layouts[1],
                &[
                    view(&peaks),
                    view(&places_view),
                    wgpu::BindingResource::Sampler(&wrapping),
                ],
            ),
            group(device, &sweep_layouts[2], &[view(&sectors)]),
        ];
        Ok(Clipmap {
            field,
            planet_radius: land.planet_radius,
            texels,
            peak,
            block,
            spacing,
            levels,
            top,
            windows: vec![None; levels],
            first: 0,
            bake,
            sweep,
            rectangles,
            bake_source: group(device, &bake_layouts[1], &[view(&relief.view)]),
            bake_target: group(device, &bake_layouts[2], &[view(&heights), view(&peaks)]),
            relief,
            sweep_groups,
            views: [heights, sectors, places_view],
            sectors: [count as i32, 0, 0],
            wrapping,
            shades,
            swept,
            places,
            places_bytes: Vec::new(),
            clip,
            clip_bytes: Vec::new(),
        })
    }

    /// The field.
    pub fn field(&self) -> &Prepared<f32> {
        &self.field
    }

    /// No ground is above it (m).
    pub(super) fn top(&self) -> f64 {
        f64::from(self.top)
    }

    /// Heights that shadows reach, if they were asked for.
    pub(super) fn shades(&self) -> Option<&wgpu::TextureView> {
        self.shades.as_ref().map(|s| &s.view)
    }

    /// The field's height map.
    pub(super) fn relief(&self) -> &wgpu::TextureView {
        &self.relief.view
    }

    /// The uniform `Clip`.
    pub(super) fn clip(&self) -> &wgpu::Buffer {
        &self.clip
    }

    /// Distance that it reaches on each side of the eye (m).
    pub fn reach(&self) -> f64 {
        (self.texels / 2 - border(self.block)) as f64
            * self.spacing
            * ((self.levels - 1) as f64).exp2()
    }

    /// Spacing of the finest level that serves places farther than `distance` from the eye along an axis (m), or a little more.
    pub(super) fn coarsest_within(&self, distance: f64) -> f64 {
        2.0 * distance / (self.texels / 2 - border(self.block)) as f64
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let side = self.texels as u64;
        let level = 4 * side * side;
        let sectors = 4 * self.sectors[0] as u64 * u64::from(RINGS + RINGS / 8 + RINGS / 64);
        let slots = self.rectangles.len() as u32;
        let shaded = self.shades.as_ref().map_or(0, |s| s.levels.len());
        let shades = 2 * level * if shaded == 0 { 0 } else { shaded.max(2) as u64 };
        Resources {
            pipelines: 2 + u32::from(shaded > 0),
            bind_groups: slots + 5 + 3 * shaded as u32,
            bindings: slots + 8 + 5 * shaded as u32,
            buffers: slots + 2 + shaded as u32,
            buffer_bytes: (self.rectangles.len() * RectangleBlock::SIZE
                + ClipBlock::SIZE
                + SweepBlock::SIZE
                + shaded * ShadeBlock::SIZE) as u64,
            samplers: 1,
            textures: 5 + u32::from(shaded > 0),
            texture_bytes: (level + level / (self.peak * self.peak) as u64) * self.levels as u64
                + shades
                + sectors
                + 512
                + self.relief.bytes(),
        }
    }

    /// Records what has to be baked for an eye, and uploads where it is on every level.
    pub(super) fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        eye: WorldPos,
        gaze: &Gaze,
    ) -> Work {
        let mut work = Work::default();
        let (writes, bytes) = self.relief.upload(queue);
        work.writes += writes;
        work.bytes += bytes;
        let mut moved = false;
        let eye = eye.normalized();
        self.first =
            ((gaze.least / self.spacing).max(1.0).log2().floor() as usize).min(self.levels - 1);
        let mut places = Vec::with_capacity(512);
        let mut in_windows = Vec::with_capacity(256);
        let mut eyes = Vec::with_capacity(16);
        let mut jobs: Vec<(usize, [i64; 2])> = Vec::new();
        for level in 0..16_usize {
            if level >= self.levels {
                places.extend([0; 16]);
                in_windows.extend([0; 16]);
                continue;
            }
            let spacing = self.spacing * (level as f64).exp2();
            // Texels of the world, exact: whole metres are divided as integers.
            let at = |axis: usize| -> (i64, f64) {
                let frac = f64::from(eye.frac[axis]);
                if spacing >= 1.0 {
                    let width = spacing as i64;
                    let cell = eye.cell[axis].div_euclid(width);
                    let rest = eye.cell[axis].rem_euclid(width) as f64 + frac;
                    (cell, rest / spacing)
                } else {
                    let many = (1.0 / spacing) as i64;
                    let inner = (frac * many as f64).floor();
                    let cell = eye.cell[axis].wrapping_mul(many).wrapping_add(inner as i64);
                    (cell, frac * many as f64 - inner)
                }
            };
            let [x, z] = [at(0), at(2)];
            for (cell, rest) in [x, z] {
                let within = cell.rem_euclid(self.texels) as f64 + rest;
                places.extend((within as f32).to_le_bytes());
            }
            places.extend(((1.0 / spacing) as f32).to_le_bytes());
            places.extend((spacing as f32).to_le_bytes());
            let corner = |cell: i64| {
                cell.wrapping_sub((self.texels - self.block) / 2)
                    .div_euclid(self.block)
                    .wrapping_mul(self.block)
            };
            let window = [corner(x.0), corner(z.0)];
            let eye_in: [f32; 2] = [(x, 0), (z, 1)]
                .map(|((cell, rest), k)| (cell.wrapping_sub(window[k]) as f64 + rest) as f32);
            in_windows.extend(eye_in.iter().flat_map(|c| c.to_le_bytes()));
            in_windows.extend([0; 8]);
            eyes.push((window, eye_in));
            if level < self.first {
                continue;
            }
            if self.windows[level] == Some(window) {
                continue;
            }
            for span in uncovered(self.windows[level], window, self.texels) {
                let slot = jobs.len();
                let size: [i64; 2] = std::array::from_fn(|k| span.to[k] - span.from[k]);
                let metres = |texel: i64| -> (i64, f64) {
                    if spacing >= 1.0 {
                        (texel.wrapping_mul(spacing as i64), 0.0)
                    } else {
                        let many = (1.0 / spacing) as i64;
                        let rest = texel.rem_euclid(many) as f64 * spacing;
                        (texel.div_euclid(many), rest)
                    }
                };
                let [mx, mz] = span.from.map(metres);
                let corner = WorldPos {
                    cell: [mx.0, 0, mz.0].into(),
                    frac: [mx.1 as f32, 0.0, mz.1 as f32].into(),
                };
                let block = RectangleBlock {
                    field: self.field.block(self.field.place(corner)),
                    corner: span.from.map(|c| c.rem_euclid(self.texels) as i32),
                    size: size.map(|s| s as i32),
                    texels: self.texels as i32,
                    level: level as i32,
                    spacing: spacing as f32,
                    ..Default::default()
                };
                let bytes = block.to_bytes();
                queue.write_buffer(&self.rectangles[slot].buffer, 0, &bytes);
                work.writes += 1;
                work.bytes += bytes.len() as u64;
                jobs.push((slot, size));
            }
            self.windows[level] = Some(window);
            work.bakes += 1;
        }
        places.extend(in_windows);
        let shaded = self.plan_shades(queue, &eyes, gaze, &mut work);
        let width = std::f64::consts::TAU / f64::from(self.sectors[0]);
        let [from, extent] = gaze.azimuths;
        let first = (from / width).floor() as i32 - 1;
        let count = ((extent / width).ceil() as i32 + 3).min(self.sectors[0]);
        // A view that is shifted by less than a pixel keeps the sectors that it has.
        let [all, made, made_count] = self.sectors;
        let before = (first - made).rem_euclid(all);
        let covered = made_count == all || before + count <= made_count;
        if !covered || count + 6 < made_count {
            self.sectors[1] = (first - 1).rem_euclid(all);
            self.sectors[2] = (count + 2).min(all);
        }
        let count = self.sectors[2];
        // No ring is wider than 32 texels near the eye, however high that is.
        let texel = self.spacing * (self.first as f64).exp2();
        let scale = gaze.near.min(32.0 * texel / width).max(4.0 * texel);
        let span = (gaze.far.min(self.reach() * std::f64::consts::SQRT_2) / scale).asinh();
        let growth = width.max(span / f64::from(RINGS));
        let reach = (self.texels / 2 - border(self.block)) as f32;
        let rings = ((span / growth / 64.0).ceil() as u32 * 64).min(RINGS);
        let clip = ClipBlock {
            rings: rings as i32,
            sectors: self.sectors[0],
            first_sector: self.sectors[1],
            made_sectors: count,
            ring_scale: scale as f32,
            ring_growth: growth as f32,
            ground_radius: self.planet_radius as f32,
            eye_altitude: eye.altitude() as f32,
            spacing: self.spacing as f32,
            reach,
            texels: self.texels as i32,
            first: self.first as i32,
            levels: self.levels as i32,
            // A texel is one to two of its distance over the reach wide.
            margin: match gaze.searched {
                Searched::Everywhere => WIDE_MARGIN,
                Searched::Lens if gaze.pixel_angle * f64::from(reach) < 1.0 => MARGIN,
                _ => 0.0,
            },
        };
        let bytes = clip.to_bytes().to_vec();
        if bytes != self.clip_bytes {
            queue.write_buffer(&self.clip, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            self.clip_bytes = bytes;
            moved = true;
        }
        if places != self.places_bytes {
            queue.write_texture(
                self.places.as_image_copy(),
                &places,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(256),
                    rows_per_image: None,
                },
                self.places.size(),
            );
            work.writes += 1;
            work.bytes += places.len() as u64;
            self.places_bytes = places;
            moved = true;
        }
        if jobs.is_empty() && !moved && shaded.is_empty() {
            return work;
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.bake);
        pass.set_bind_group(1, &self.bake_source, &[]);
        pass.set_bind_group(2, &self.bake_target, &[]);
        for (slot, size) in &jobs {
            pass.set_bind_group(0, &self.rectangles[*slot].group, &[]);
            let [x, z] = size.map(|s| (s as u32).div_ceil(8 * self.peak as u32));
            pass.dispatch_workgroups(x, z, 1);
            work.dispatches += 1;
        }
        if moved || !jobs.is_empty() {
            pass.set_pipeline(&self.sweep);
            for (index, group) in (0..).zip(&self.sweep_groups) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups((self.sectors[2] as u32).div_ceil(8), rings / 64, 1);
            work.dispatches += 1;
        }
        if let Some(shades) = &self.shades {
            pass.set_pipeline(&shades.pipeline);
            // From the coarsest, which lies nearest to the sun of all that a line meets.
            for level in shaded.into_iter().rev() {
                pass.set_bind_group(0, &shades.levels[level].group, &[]);
                pass.set_bind_group(1, &shades.sources[level], &[]);
                pass.set_bind_group(2, &shades.targets[level], &[]);
                pass.dispatch_workgroups((self.texels as u32).div_ceil(64), 1, 1);
                work.dispatches += 1;
            }
        }
        work
    }

    /// Uploads what the shadows need, and says of which levels they have to be made.
    fn plan_shades(
        &mut self,
        queue: &wgpu::Queue,
        eyes: &[(Window, [f32; 2])],
        gaze: &Gaze,
        work: &mut Work,
    ) -> Vec<usize> {
        let (Some(shades), Some((to_sun, angular_radius))) = (&mut self.shades, gaze.sun) else {
            return Vec::new();
        };
        let sun = SweptSun {
            to_sun,
            angular_radius,
        };
        let same = shades.sun.is_some_and(|s| s.serves(&sun));
        if !same {
            shades.sun = Some(sun);
            shades.windows.fill(None);
        }
        let block = shades.sun.unwrap_or(sun).block(self.planet_radius);
        let mut send = |buffer: &wgpu::Buffer, bytes: &[u8]| {
            queue.write_buffer(buffer, 0, bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
        };
        if !same {
            send(&self.swept, &block.to_bytes());
        }
        let mut levels = Vec::new();
        for level in self.first..self.levels {
            let (window, eye) = eyes[level];
            if shades.windows[level] == Some(window) {
                continue;
            }
            shades.windows[level] = Some(window);
            let next = level + 1;
            let shade = ShadeBlock {
                sweep: block,
                corner: window.map(|c| c.rem_euclid(self.texels) as i32),
                eye,
                next_eye: eyes.get(next).map_or([0.0; 2], |e| e.1),
                texels: self.texels as i32,
                level: level as i32,
                next: if next < self.levels { next as i32 } else { -1 },
                spacing: (self.spacing * (level as f64).exp2()) as f32,
                ..Default::default()
            };
            send(&shades.levels[level].buffer, &shade.to_bytes());
            levels.push(level);
        }
        work.bakes += levels.len() as u32;
        levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_move_uncovers_is_baked_once() {
        let size = 8;
        for old in [None, Some([3, -4])] {
            for dx in -9..=9 {
                for dz in -9..=9 {
                    let new = [3 + dx, -4 + dz];
                    let spans = uncovered(old, new, size);
                    for z in new[1]..new[1] + size {
                        for x in new[0]..new[0] + size {
                            let inside = |from: Window, s: i64| {
                                (from[0]..from[0] + s).contains(&x)
                                    && (from[1]..from[1] + s).contains(&z)
                            };
                            let had = old.is_some_and(|o| inside(o, size));
                            let baked = spans
                                .iter()
                                .filter(|s| {
                                    (s.from[0]..s.to[0]).contains(&x)
                                        && (s.from[1]..s.to[1]).contains(&z)
                                })
                                .count();
                            let far = old.is_none_or(|_| dx.abs() >= size || dz.abs() >= size);
                            assert_eq!(baked, usize::from(far || !had));
                        }
                    }
                }
            }
        }
    }
}
