//! The ground and its water in a host's own pass: a grid of triangles whose heights are read where it is drawn.

use glam::{DVec3, Mat4, Vec3};
use serde::{Deserialize, Serialize};

use super::options::within;
use super::system::Ground;
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::{Depth, Projection, Resources, Targets, Work, output_of};
use crate::program::ProgramSet;
use crate::programs::blocks::{GroundView as ViewBlock, Shore as ShoreBlock};
use crate::terrain::{TerrainLights, group, surface_pipeline};
use crate::view::{View, WorldPos};

/// Squares along a side of a block.
const BLOCK: usize = 64;

/// How a square of four cells becomes triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Triangulation {
    /// Two, along the same diagonal everywhere.
    Fixed,
    /// Four around a middle, which has the mean height and normal of the corners.
    FourWay,
    /// Two, along a diagonal by chance, the same in every block of 64 x 64 squares.
    #[default]
    Random,
}

impl Triangulation {
    /// Triangles of a block of 64 x 64 squares. Vertices are the corners by rows of 65, then the middles by rows of 64. All turn alike.
    pub fn triangles(self) -> Vec<[u16; 3]> {
        let mut all = Vec::with_capacity(4 * BLOCK * BLOCK);
        for k in 0..BLOCK * BLOCK {
            let (x, z) = (k % BLOCK, k / BLOCK);
            let corner = |i: usize, j: usize| ((z + j) * (BLOCK + 1) + x + i) as u16;
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
            let turned = match self {
                Triangulation::FourWay => {
                    let m = ((BLOCK + 1) * (BLOCK + 1) + k) as u16;
                    all.extend([[a, c, m], [c, d, m], [d, b, m], [b, a, m]]);
                    continue;
                }
                Triangulation::Fixed => false,
                // The high bits of a product are well mixed.
                Triangulation::Random => {
                    let mut h = (k as u32 ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
                    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
                    h >> 31 == 1
                }
            };
            all.extend(if turned {
                [[a, c, b], [c, d, b]]
            } else {
                [[a, c, d], [a, d, b]]
            });
        }
        all
    }
}

/// Plain colours of ground and water. Albedos are in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundLook {
    /// Albedo of gentle ground at and below the altitude `low`.
    pub low_albedo: [f32; 3],
    /// Albedo of gentle ground at and above the altitude `high`.
    pub high_albedo: [f32; 3],
    /// These altitudes (m), the second above the first; `None`: the range of heights that the ground had when the picture was made.
    pub altitudes: Option<[f32; 2]>,
    /// Albedo of steep ground.
    pub steep_albedo: [f32; 3],
    /// Slopes between which ground becomes steep, in [0, 100], the second above the first.
    pub steep: [f32; 2],
    /// Albedo of gentle ground that is wet.
    pub mud_albedo: [f32; 3],
    /// Mean depth of water from which ground is all wet (m), in [1e-6, 100].
    pub mud_depth: f32,
    /// Extinction of light in water (1/m), in [0, 1e3].
    pub extinction: [f32; 3],
    /// Albedo of deep water.
    pub water_albedo: [f32; 3],
    /// Depth from which water is shown as it is (m), in [1e-3, 10].
    pub least_depth: f32,
    /// How far below the ground the surface of dry cells is drawn (m), in [0, 100].
    pub sink: f32,
}

impl Default for GroundLook {
    /// Grass, dry above, on grey rock, brown mud and water that is a little turbid.
    fn default() -> Self {
        GroundLook {
            low_albedo: [0.11, 0.17, 0.05],
            high_albedo: [0.25, 0.23, 0.14],
            altitudes: None,
            steep_albedo: [0.21, 0.19, 0.17],
            steep: [0.6, 1.1],
            mud_albedo: [0.11, 0.085, 0.055],
            mud_depth: 0.1,
            extinction: [1.6, 0.9, 0.75],
            water_albedo: [0.025, 0.065, 0.08],
            least_depth: 0.1,
            sink: 2.0,
        }
    }
}

impl GroundLook {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        for (name, albedo) in [
            ("look.low_albedo", self.low_albedo),
            ("look.high_albedo", self.high_albedo),
            ("look.steep_albedo", self.steep_albedo),
            ("look.mud_albedo", self.mud_albedo),
            ("look.water_albedo", self.water_albedo),
        ] {
            for value in albedo {
                within(name, value, 0.0, 1.0)?;
            }
        }
        let pairs = [
            ("look.altitudes", self.altitudes.unwrap_or([0.0, 1.0]), 1e5),
            ("look.steep", self.steep, 100.0),
        ];
        for (name, pair, most) in pairs {
            for value in pair {
                within(name, value, if most > 1e3 { -most } else { 0.0 }, most)?;
            }
            if pair[1] <= pair[0] {
                return Err(Error::OutOfDomain {
                    name: format!("ground.{name}"),
                    value: format!("{pair:?}"),
                    domain: "a lower number, then a higher one".to_owned(),
                });
            }
        }
        for value in self.extinction {
            within("look.extinction", value, 0.0, 1e3)?;
        }
        within("look.mud_depth", self.mud_depth, 1e-6, 100.0)?;
        within("look.least_depth", self.least_depth, 1e-3, 10.0)?;
        within("look.sink", self.sink, 0.0, 100.0)
    }
}

/// Choices that are made once.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundPictureOptions {
    /// How squares become triangles.
    pub triangulation: Triangulation,
    /// The colours.
    pub look: GroundLook,
    /// Where the first cell lies; its altitude is that of the ground's height 0.
    pub corner: WorldPos,
}

/// Draws a [`Ground`] and its water into a host's pass, with depth. The ground is flat: the planet's curvature is left out.
///
/// ```no_run
/// # fn frame(gpu: &veduta::device::Gpu, ground: &veduta::ground::Ground, view: &veduta::View, lights: &veduta::terrain::TerrainLights,
/// #   pass: &mut veduta::wgpu::RenderPass<'_>, encoder: &mut veduta::wgpu::CommandEncoder) -> Result<(), veduta::Error> {
/// use veduta::ground::{GroundPicture, GroundPictureOptions};
/// let targets = veduta::Targets { depth_format: Some(veduta::wgpu::TextureFormat::Depth32Float), ..Default::default() };
/// let mut picture = GroundPicture::new(&gpu.device, veduta::programs(), &targets, ground, &GroundPictureOptions::default())?;
/// // Every frame, after the steps: levels and normals are found anew only when the ground has stepped or been changed.
/// let work = picture.prepare(&gpu.queue, encoder, ground, view, lights)?;
/// println!("{} dispatches", work.dispatches);
/// // In a pass with that depth, cleared to the far plane.
/// let _ = picture.draw_opaque(pass);
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct GroundPicture {
    device: wgpu::Device,
    options: GroundPictureOptions,
    altitudes: [f32; 2],
    depth: Depth,
    size: [usize; 2],
    blocks: u32,
    indices: wgpu::Buffer,
    index_count: u32,
    surface: wgpu::Texture,
    normals: wgpu::Texture,
    passes: [(wgpu::ComputePipeline, Vec<wgpu::BindGroupLayout>); 2],
    shore: wgpu::Buffer,
    view: wgpu::Buffer,
    view_bytes: Vec<u8>,
    layers: [wgpu::RenderPipeline; 2],
    groups: Vec<wgpu::BindGroup>,
    /// What the textures were made of; `None`: nothing yet.
    held: Option<(f32, u64)>,
}

impl GroundPicture {
    /// Builds pipelines and makes room for the levels and normals of a ground.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for targets that it cannot draw into or that have no depth, and for colours; the faults of [`ProgramSet::get`] and of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        ground: &Ground,
        options: &GroundPictureOptions,
    ) -> Result<GroundPicture, Error> {
        targets.check_on(device)?;
        options.look.check()?;
        if targets.projection == Projection::Orthographic {
            return Err(Error::OutOfDomain {
                name: "targets.projection".to_owned(),
                value: "Orthographic".to_owned(),
                domain: "Perspective".to_owned(),
            });
        }
        let Some(depth_format) = targets.depth_format else {
            return Err(Error::OutOfDomain {
                name: "targets.depth_format".to_owned(),
                value: "None".to_owned(),
                domain: "the format of a depth buffer, which the ground writes".to_owned(),
            });
        };
        let output = output_of(targets.color_format)?;
        let size = ground.size();
        let [columns, rows] = size;
        let passes = [
            compute(device, programs, "ground_surface", &[], &[])?,
            compute(device, programs, "ground_normals", &[], &[])?,
        ];
        let layer = |number: f64| {
            surface_pipeline(
                device,
                programs,
                ("ground_picture", &[]),
                targets,
                depth_format,
                &[("OUTPUT", output), ("GROUND_LAYER", number)],
            )
        };
        let (bare, layouts) = layer(0.0)?;
        let (wet, _) = layer(1.0)?;
        use wgpu::TextureUsages as Usage;
        let texture = |label, format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: columns as u32,
                    height: rows as u32,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: Usage::STORAGE_BINDING | Usage::TEXTURE_BINDING | Usage::COPY_SRC,
                view_formats: &[],
            })
        };
        let surface = texture("veduta ground surface", wgpu::TextureFormat::Rgba32Float);
        let normals = texture("veduta ground normals", wgpu::TextureFormat::Rg32Uint);
        let buffer = |label, size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: true,
            })
        };
        let filled = |label, bytes: &[u8], usage| -> Result<wgpu::Buffer, Error> {
            let made = buffer(label, bytes.len(), usage);
            made.slice(..)
                .get_mapped_range_mut()
                .map_err(|e| Error::Device(e.to_string()))?
                .copy_from_slice(bytes);
            made.unmap();
            Ok(made)
        };
        let triangles = options.triangulation.triangles();
        let corners: Vec<u8> = triangles
            .iter()
            .flatten()
            .flat_map(|index| index.to_le_bytes())
            .collect();
        let indices = filled("veduta triangles", &corners, wgpu::BufferUsages::INDEX)?;
        let block = ShoreBlock {
            least: options.look.least_depth,
            sink: options.look.sink,
        };
        let uniform = wgpu::BufferUsages::UNIFORM;
        let shore = filled("veduta shore", &block.to_bytes(), uniform)?;
        let view = filled("veduta ground view", &[0; ViewBlock::SIZE], uniform)?;
        let seen = [&surface, &normals].map(|t| t.create_view(&Default::default()));
        let groups = vec![
            group(device, &layouts[0], &[view.as_entire_binding()]),
            group(
                device,
                &layouts[1],
                &[
                    wgpu::BindingResource::TextureView(&seen[0]),
                    wgpu::BindingResource::TextureView(&seen[1]),
                ],
            ),
        ];
        let [low, high] = ground.range();
        Ok(GroundPicture {
            device: device.clone(),
            options: *options,
            altitudes: options.look.altitudes.unwrap_or([low, high.max(low + 1.0)]),
            depth: targets.depth,
            size,
            blocks: ((columns - 1).div_ceil(BLOCK) * (rows - 1).div_ceil(BLOCK)) as u32,
            indices,
            index_count: 3 * triangles.len() as u32,
            surface,
            normals,
            passes,
            shore,
            view,
            view_bytes: Vec::new(),
            layers: [bare, wet],
            groups,
            held: None,
        })
    }

    /// What is shown of every cell, `Rgba32Float`: height and displayed level of the water over the ground's reference level, depth and mean of the water (m).
    pub fn surface(&self) -> &wgpu::Texture {
        &self.surface
    }

    /// Normals of every cell, `Rg32Uint`: x and z of that of the ground, and of that of the water, as signed fractions of 16 bits.
    pub fn normals(&self) -> &wgpu::Texture {
        &self.normals
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let buffers = [&self.indices, &self.shore, &self.view];
        let cells = (self.size[0] * self.size[1]) as u64;
        Resources {
            pipelines: 4,
            bind_groups: 2,
            bindings: 3,
            buffers: buffers.len() as u32,
            buffer_bytes: buffers.iter().map(|b| b.size()).sum(),
            textures: 2,
            texture_bytes: cells * (16 + 8),
            samplers: 0,
        }
    }

    /// Uploads the view when it has changed, and records the finding of levels and normals when the ground has stepped or been changed.
    ///
    /// # Errors
    /// As [`View::check`] and [`TerrainLights::check`]; [`Error::OutOfDomain`] for a ground of another size, and a projection that does not fit the targets.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        ground: &Ground,
        view: &View,
        lights: &TerrainLights,
    ) -> Result<Work, Error> {
        view.check()?;
        lights.check()?;
        let fault = |name: &str, value: String, domain: String| {
            Err(Error::OutOfDomain {
                name: name.to_owned(),
                value,
                domain,
            })
        };
        if ground.size() != self.size {
            let [a, b] = [ground.size(), self.size].map(|s| format!("{} x {}", s[0], s[1]));
            return fault("ground.size", a, b);
        }
        // A perspective tells its depth by the sign of what it adds.
        let _ = view.rays()?;
        if (view.projection.w_axis.z > 0.0) != (self.depth != Depth::Normal) {
            let value = format!("{:?}", view.projection.to_cols_array());
            let domain = format!("one with the depth of the targets, {:?}", self.depth);
            return fault("view.projection", value, domain);
        }
        let (reference, changes) = ground.shown_as();
        let up = DVec3::new(0.0, f64::from(reference), 0.0);
        let corner = self.options.corner.relative_to(view.eye) + up;
        if corner.length() > 1e7 {
            return fault(
                "view.eye",
                format!("{:?}", view.eye),
                "within 1e7 m of the ground".to_owned(),
            );
        }
        let turn = Mat4::from_mat3(glam::Mat3::from_mat4(view.world_from_view));
        let o = &self.options.look;
        let block = ViewBlock {
            clip_from_place: (view.projection * turn.inverse()).to_cols_array_2d(),
            corner: corner.as_vec3().to_array(),
            spacing: ground.options().spacing,
            to_sun: view.sun.to_light.normalize_or(Vec3::Y).to_array(),
            exposure: view.exposure,
            sun_light: lights.sun.to_array(),
            reference,
            sky_light: lights.sky.to_array(),
            columns: self.size[0] as i32,
            bounce_light: lights.bounce.to_array(),
            rows: self.size[1] as i32,
            low_albedo: o.low_albedo,
            low: self.altitudes[0],
            high_albedo: o.high_albedo,
            high: self.altitudes[1],
            steep_albedo: o.steep_albedo,
            steep_from: o.steep[0],
            mud_albedo: o.mud_albedo,
            steep_to: o.steep[1],
            extinction: o.extinction,
            mud_depth: o.mud_depth,
            water_albedo: o.water_albedo,
            blocks_x: (self.size[0] - 1).div_ceil(BLOCK) as i32,
        };
        let mut work = Work::default();
        let bytes = block.to_bytes().to_vec();
        if bytes != self.view_bytes {
            queue.write_buffer(&self.view, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            self.view_bytes = bytes;
        }
        if self.held == Some((reference, changes)) {
            return Ok(work);
        }
        let [step, height, water, means] = ground.shown();
        let views = [&self.surface, &self.normals].map(|t| t.create_view(&Default::default()));
        let [seen, written] = views.each_ref().map(wgpu::BindingResource::TextureView);
        let device = &self.device;
        let [first, second] = &self.passes;
        let sets = [
            (
                first,
                [
                    group(
                        device,
                        &first.1[0],
                        &[step.as_entire_binding(), self.shore.as_entire_binding()],
                    ),
                    group(
                        device,
                        &first.1[1],
                        &[height, water, means].map(|b| b.as_entire_binding()),
                    ),
                    group(device, &first.1[2], std::slice::from_ref(&seen)),
                ],
            ),
            (
                second,
                [
                    group(device, &second.1[0], &[step.as_entire_binding()]),
                    group(device, &second.1[1], &[seen]),
                    group(device, &second.1[2], &[written]),
                ],
            ),
        ];
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("veduta ground surface"),
            timestamp_writes: None,
        });
        let tiles = self.size.map(|n| (n as u32).div_ceil(8));
        for ((pipeline, _), groups) in &sets {
            pass.set_pipeline(pipeline);
            for (group, index) in groups.iter().zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(tiles[0], tiles[1], 1);
            work.dispatches += 1;
        }
        self.held = Some((reference, changes));
        Ok(work)
    }

    /// Draws into the host's pass: the ground, then its water.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'_>) -> Work {
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint16);
        for (index, group) in (0..).zip(&self.groups) {
            pass.set_bind_group(index, group, &[]);
        }
        for layer in &self.layers {
            pass.set_pipeline(layer);
            pass.draw_indexed(0..self.index_count, 0, 0..self.blocks);
        }
        Work {
            draws: 2,
            ..Work::default()
        }
    }
}
