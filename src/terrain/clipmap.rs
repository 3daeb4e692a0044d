//! Baked heights around the eye, made anew only where the eye has uncovered ground.

use super::field::HeightField;
use super::ground::Prepared;
use super::land::Land;
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::{Resources, Work};
use crate::program::ProgramSet;
use crate::programs::blocks::{Bake as BakeBlock, Clip as ClipBlock, Rectangle as RectangleBlock};
use crate::view::WorldPos;

/// How finely and how far heights are baked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipmapOptions {
    /// Texels of a level's side: 128, 256, 512 or 1024. A texel is about as wide as a pixel where it is used when this is 3.5 over the angle of a pixel.
    pub texels: u32,
    /// Levels at most, in [1, 16].
    pub levels: u32,
    /// Distance that the coarsest level shall reach (m), in [100, 4e6].
    pub reach: f64,
}

impl Default for ClipmapOptions {
    /// 512 texels, to 60 km.
    fn default() -> Self {
        ClipmapOptions {
            texels: 512,
            levels: 16,
            reach: 60_000.0,
        }
    }
}

/// Blocks of maxima, and by what the windows move (texels).
const BLOCK: i64 = 32;

/// Texels that a window keeps between what it serves and its border: half a move, and a block.
const BORDER: i64 = BLOCK / 2 + BLOCK;

/// The part of a level that is baked: its lower corner in texels of the world.
type Window = [i64; 2];

/// A rectangle of texels of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Span {
    from: [i64; 2],
    to: [i64; 2],
}

/// What of the new window the old one does not cover: at most two rectangles.
fn uncovered(old: Option<Window>, new: Window, size: i64) -> Vec<Span> {
    let whole = Span {
        from: new,
        to: new.map(|c| c + size),
    };
    let Some(old) = old else {
        return vec![whole];
    };
    let moved: [i64; 2] = std::array::from_fn(|k| new[k] - old[k]);
    if moved.iter().any(|m| m.abs() >= size) {
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
    spacing: f64,
    levels: usize,
    top: f32,
    windows: Vec<Option<Window>>,
    first: usize,
    bake: wgpu::ComputePipeline,
    maxima: wgpu::ComputePipeline,
    tops: wgpu::ComputePipeline,
    horizon: wgpu::ComputePipeline,
    rectangles: Vec<Slot>,
    all_maxima: Vec<Slot>,
    bake_target: wgpu::BindGroup,
    maxima_source: wgpu::BindGroup,
    maxima_target: wgpu::BindGroup,
    tops_source: wgpu::BindGroup,
    tops_target: wgpu::BindGroup,
    horizon_groups: [wgpu::BindGroup; 3],
    /// How high the ground reaches in each sector around the eye.
    pub(super) skyline: wgpu::TextureView,
    /// Heights, maxima of blocks of 8, maxima of blocks of 32, places of the levels.
    pub(super) views: [wgpu::TextureView; 4],
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
pub(super) fn group(
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
    let cells = f64::from(field.wavelength as f32) / f64::from(field.octaves - 1).exp2();
    (cells / 8.0).log2().floor().clamp(-4.0, 10.0).exp2()
}

impl Clipmap {
    /// Makes textures and pipelines; nothing is baked.
    ///
    /// # Errors
    /// As [`Land::check`]; [`Error::OutOfDomain`] for options; the faults of [`ProgramSet::get`] and of making the pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        land: &Land,
        options: &ClipmapOptions,
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
        let field = land.field.prepare::<f32>()?;
        let texels = i64::from(options.texels);
        let half = (texels / 2 - BORDER) as f64;
        let needed = (options.reach / half).log2().ceil().exp2();
        // From the coarsest on down, as many as there may be.
        let spacing = finest(&land.field)
            .max(needed / f64::from(options.levels - 1).exp2())
            .min(needed);
        let levels = (needed / spacing).log2().round() as usize + 1;
        let kind = [("FIELD_KIND", f64::from(land.field.kind.number()))];
        let (bake, bake_layouts) = compute(device, programs, "terrain_bake", &[], &kind)?;
        let (maxima, maxima_layouts) =
            compute(device, programs, "terrain_bake", &["CLIP_MAXIMA"], &[])?;
        let (tops, tops_layouts) = compute(device, programs, "terrain_bake", &["CLIP_TOPS"], &[])?;
        let (horizon, horizon_layouts) =
            compute(device, programs, "terrain_bake", &["CLIP_HORIZON"], &[])?;
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
        let layered = |label, side: u32, rows: u32| {
            texture(
                label,
                side,
                rows,
                levels as u32,
                wgpu::TextureFormat::R32Float,
                wgpu::TextureUsages::STORAGE_BINDING,
            )
            .create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let [side, of_8, of_32] = [1, 8, 32].map(|n| options.texels / n);
        let heights = layered("veduta heights", side, side);
        let fine = layered("veduta maxima of 8", of_8, of_8);
        // The maximum of the level stands below.
        let coarse = layered("veduta maxima of 32", of_32, of_32 + 1);
        let skyline = texture(
            "veduta skyline",
            64,
            1,
            1,
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::STORAGE_BINDING,
        )
        .create_view(&Default::default());
        let places = texture(
            "veduta levels",
            16,
            1,
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
        let all_maxima = (0..levels)
            .map(|_| {
                let buffer = buffer(device, "veduta level", BakeBlock::SIZE);
                let group = group(device, &maxima_layouts[0], &[buffer.as_entire_binding()]);
                Slot { buffer, group }
            })
            .collect();
        // Without bounds (a program's own function) rays end at 20 km.
        let top = land.field.bounds().map_or(2e4, |b| b.maximum) as f32;
        let places_view = places.create_view(&Default::default());
        let clip = buffer(device, "veduta clipmap", ClipBlock::SIZE);
        let horizon_groups = [
            group(device, &horizon_layouts[0], &[clip.as_entire_binding()]),
            group(
                device,
                &horizon_layouts[1],
                &[view(&fine), view(&places_view)],
            ),
            group(device, &horizon_layouts[2], &[view(&skyline)]),
        ];
        Ok(Clipmap {
            field,
            planet_radius: land.planet_radius,
            texels,
            spacing,
            levels,
            top,
            windows: vec![None; levels],
            first: 0,
            bake,
            maxima,
            tops,
            horizon,
            rectangles,
            all_maxima,
            bake_target: group(device, &bake_layouts[2], &[view(&heights)]),
            maxima_source: group(device, &maxima_layouts[1], &[view(&heights)]),
            maxima_target: group(device, &maxima_layouts[2], &[view(&fine), view(&coarse)]),
            tops_source: group(device, &tops_layouts[1], &[view(&fine)]),
            tops_target: group(device, &tops_layouts[2], &[view(&coarse)]),
            horizon_groups,
            skyline,
            views: [heights, fine, coarse, places_view],
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

    /// The uniform `Clip`.
    pub(super) fn clip(&self) -> &wgpu::Buffer {
        &self.clip
    }

    /// Distance that it reaches on each side of the eye (m).
    pub fn reach(&self) -> f64 {
        (self.texels / 2 - BORDER) as f64 * self.spacing * ((self.levels - 1) as f64).exp2()
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let side = self.texels as u64;
        let level = 4 * (side * side + side * side / 64 + side * side / 1024 + side / 32);
        let slots = (self.rectangles.len() + self.all_maxima.len()) as u32;
        Resources {
            pipelines: 4,
            bind_groups: slots + 8,
            bindings: slots + 10,
            buffers: slots + 1,
            buffer_bytes: (self.rectangles.len() * RectangleBlock::SIZE
                + self.all_maxima.len() * BakeBlock::SIZE
                + ClipBlock::SIZE) as u64,
            textures: 5,
            texture_bytes: level * self.levels as u64 + 512,
            ..Default::default()
        }
    }

    /// Records what has to be baked for an eye, and uploads where it is on every level. Levels that are finer than `least` metres wait until they are
    /// needed.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        eye: WorldPos,
        least: f64,
    ) -> Work {
        let mut work = Work::default();
        let mut moved = false;
        let eye = eye.normalized();
        self.first = ((least / self.spacing).max(1.0).log2().floor() as usize).min(self.levels - 1);
        let mut places = Vec::with_capacity(256);
        let mut jobs: Vec<(usize, usize, [i64; 2])> = Vec::new();
        for level in 0..16_usize {
            if level >= self.levels {
                places.extend([0; 16]);
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
            if level < self.first {
                continue;
            }
            let corner = |cell: i64| (cell - self.texels / 2 + BLOCK / 2).div_euclid(BLOCK) * BLOCK;
            let window = [corner(x.0), corner(z.0)];
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
                jobs.push((level, slot, size));
            }
            self.windows[level] = Some(window);
            let block = BakeBlock {
                texels: self.texels as i32,
                level: level as i32,
            };
            let bytes = block.to_bytes();
            queue.write_buffer(&self.all_maxima[level].buffer, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
        }
        let clip = ClipBlock {
            ground_radius: self.planet_radius as f32,
            eye_altitude: eye.altitude() as f32,
            spacing: self.spacing as f32,
            reach: (self.texels / 2 - BORDER) as f32,
            top: self.top,
            texels: self.texels as i32,
            first: self.first as i32,
            levels: self.levels as i32,
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
        if jobs.is_empty() && !moved {
            return work;
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.bake);
        pass.set_bind_group(2, &self.bake_target, &[]);
        for (_, slot, size) in &jobs {
            pass.set_bind_group(0, &self.rectangles[*slot].group, &[]);
            let [x, z] = size.map(|s| (s as u32).div_ceil(8));
            pass.dispatch_workgroups(x, z, 1);
            work.dispatches += 1;
        }
        pass.set_pipeline(&self.maxima);
        pass.set_bind_group(1, &self.maxima_source, &[]);
        pass.set_bind_group(2, &self.maxima_target, &[]);
        let mut levels: Vec<usize> = jobs.iter().map(|j| j.0).collect();
        levels.dedup();
        for level in &levels {
            pass.set_bind_group(0, &self.all_maxima[*level].group, &[]);
            let groups = (self.texels / BLOCK) as u32;
            pass.dispatch_workgroups(groups, groups, 1);
            work.dispatches += 1;
            work.bakes += 1;
        }
        pass.set_pipeline(&self.tops);
        pass.set_bind_group(1, &self.tops_source, &[]);
        pass.set_bind_group(2, &self.tops_target, &[]);
        for level in &levels {
            pass.set_bind_group(0, &self.all_maxima[*level].group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
            work.dispatches += 1;
        }
        pass.set_pipeline(&self.horizon);
        for (index, group) in (0..).zip(&self.horizon_groups) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(1, 1, 1);
        work.dispatches += 1;
        work
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
