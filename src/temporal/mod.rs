//! Temporal anti-aliasing and upsampling: many frames of one sample a pixel make one of many samples.
//!
//! The samples of each frame are shifted by less than a pixel. Those of earlier frames are found through the depth and the eye's movement, and joined with those of this
//! frame, each counted once: what stands still converges to a picture of as many samples as frames, at the cost of one. The host's picture may have fewer pixels than the
//! result; the shifted samples then fill the pixels between.
//!
//! Things that move by themselves are not followed: their history is held to the colours around them (`bound`). Source: Yang 2009, Karis 2014, Salvi 2016.

use glam::{DVec3, Mat4, Vec2, Vec4};

use crate::error::Error;
use crate::landscape::{Resources, Work};
use crate::program::{Pipeline, PipelineOptions, ProgramSet};
use crate::programs::blocks::TemporalView as ViewBlock;
use crate::view::{View, WorldPos};

/// Choices that are made once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemporalOptions {
    /// Width and height of the host's picture and its depth buffer, in [1, 16384].
    pub taken: [u32; 2],
    /// Width and height of the result: one to four times that of the picture, each.
    pub size: [u32; 2],
    /// Most samples that a history counts as, in [1, 4096]: what changed is forgotten with this time constant. What moves by `m` pixels a frame counts 1 + 8 m times less
    /// (but two), since a history is blurred whenever it is read between its pixels.
    pub frames: f32,
    /// Standard deviations of its neighbours' colours that a history may differ from their mean, in [0.1, 100]; infinite where nothing changes but the eye, which is sharper
    /// and costs less.
    pub bound: f32,
    /// Whether histories are read with a cubic through sixteen pixels; else with a line between two, which blurs what moves and costs less.
    pub sharp: bool,
    /// Whether nothing moves but the eye, and nothing comes or goes: a history is then left where what stood there and what is seen move apart by more than a quarter of a pixel in a
    /// frame, instead of where it stood at another distance than the samples around. Samples that miss what a pixel shows do not end its history, and nothing trails behind edges that the
    /// eye passes faster; but things that vanish stay, and so this is not for hosts with meshes that move.
    pub fixed: bool,
    /// Whether the host leaves what shows nothing transparent: where the depth is that of nothing and alpha is 0 all around, no frames are joined, and the result is 0.
    /// Leave it off where something is drawn without depth or alpha: clouds over a transparent target leave its alpha at 0, so that squares which show nothing but clouds would be dropped.
    pub has_empty: bool,
}

impl TemporalOptions {
    /// For a picture of this size and a result of the same.
    pub fn of(size: [u32; 2]) -> TemporalOptions {
        TemporalOptions {
            taken: size,
            size,
            frames: 16.0,
            bound: 3.0,
            sharp: true,
            fixed: false,
            has_empty: false,
        }
    }

    /// For a result of this size, from a picture of a share of its pixels a side, in whole pixels. [`TemporalOptions::check`] refuses what comes of shares that are not in [0.25, 1].
    pub fn of_share(size: [u32; 2], share: f64) -> TemporalOptions {
        let taken = size.map(|n| {
            let least = if share >= 0.25 { n.div_ceil(4) } else { 0 };
            ((f64::from(n) * share).round() as u32).max(least)
        });
        TemporalOptions {
            taken,
            ..TemporalOptions::of(size)
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        for axis in 0..2 {
            let (taken, size) = (self.taken[axis], self.size[axis]);
            if !(1..=16384).contains(&taken) {
                let value = format!("{:?}", self.taken);
                return Err(fault("options.taken", value, "in [1, 16384] pixels"));
            }
            if !(taken..=taken.saturating_mul(4).min(16384)).contains(&size) {
                let value = format!("{:?}", self.size);
                let domain = format!(
                    "one to four times {:?}, and at most 16384 pixels",
                    self.taken
                );
                return Err(fault("options.size", value, &domain));
            }
        }
        if !(1.0..=4096.0).contains(&self.frames) {
            return Err(fault("options.frames", self.frames, "in [1, 4096]"));
        }
        if !(0.1..=100.0).contains(&self.bound) && self.bound != f32::INFINITY {
            let domain = "in [0.1, 100], or infinite";
            return Err(fault("options.bound", self.bound, domain));
        }
        Ok(())
    }
}

fn fault(name: &str, value: impl ToString, domain: &str) -> Error {
    Error::OutOfDomain {
        name: name.to_owned(),
        value: value.to_string(),
        domain: domain.to_owned(),
    }
}

/// Joins the frames of a host's picture of scene radiance.
///
/// ```no_run
/// # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, color: &wgpu::TextureView, depth: &wgpu::TextureView)
/// # -> Result<(), veduta::Error> {
/// use veduta::temporal::{Temporal, TemporalOptions};
/// // Half as many pixels a side are drawn.
/// let options = TemporalOptions { taken: [960, 540], ..TemporalOptions::of([1920, 1080]) };
/// let mut temporal = Temporal::new(device, veduta::programs(), &options)?;
/// temporal.set_host(device, color, depth)?;
/// let view = veduta::View::default();
/// // Every frame: draw with `shifted`, then join.
/// let shifted = temporal.shifted(&view);
/// // … terrain.prepare(queue, encoder, &shifted, &lights, temporal.footprint_rows())?; a pass into `color` and `depth` …
/// let _ = temporal.resolve(queue, encoder, &view)?;
/// let picture: &wgpu::TextureView = temporal.result();
/// # let _ = (shifted, picture); Ok(()) }
/// ```
#[derive(Debug)]
pub struct Temporal {
    options: TemporalOptions,
    pipeline: wgpu::RenderPipeline,
    /// For an eye that stands, whose history needs no filter.
    still: wgpu::RenderPipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    block: wgpu::Buffer,
    block_group: wgpu::BindGroup,
    nearest: wgpu::Sampler,
    history: [[wgpu::TextureView; 3]; 2],
    result: wgpu::TextureView,
    /// Reads either history and writes the other; none before the host's picture is known.
    groups: Option<[wgpu::BindGroup; 2]>,
    frame: u32,
    /// The eye of the last frame, and its clip space from the world relative to it.
    last: Option<(WorldPos, Mat4)>,
}

fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    device
        .create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta temporal"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
        .create_view(&Default::default())
}

/// Number `index` of a sequence that fills [0, 1)² evenly: multiples of the inverse powers of the plastic number (Roberts 2018).
fn even(index: u32) -> [f64; 2] {
    [0.754_877_666_246_692_7, 0.569_840_290_998_053_3]
        .map(|step| (0.5 + step * f64::from(index)).fract())
}

impl Temporal {
    /// Builds the pipeline and makes room for histories.
    ///
    /// # Errors
    /// As [`TemporalOptions::check`]; [`Error::OutOfDomain`] for a result larger than the device's textures; the faults of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        options: &TemporalOptions,
    ) -> Result<Temporal, Error> {
        options.check()?;
        let most = device.limits().max_texture_dimension_2d;
        if options.size.iter().any(|s| *s > most) {
            let value = format!("{:?}", options.size);
            let domain = format!("at most {most} pixels, the device's limit");
            return Err(fault("options.size", value, &domain));
        }
        // Samples that are so far apart that two never lie in a pixel; a cubic is not for those who save.
        let sparse = !options.sharp
            && (0..2).all(|k| f64::from(options.size[k]) >= 1.25 * f64::from(options.taken[k]));
        let flag = |on: bool| f64::from(u8::from(on));
        let make = |still: bool| {
            let ready = programs.get("temporal", &[])?.pipeline(
                device,
                &PipelineOptions {
                    targets: &[
                        Some(wgpu::TextureFormat::Rgba16Float.into()),
                        Some(wgpu::TextureFormat::R32Uint.into()),
                        Some(wgpu::TextureFormat::R32Uint.into()),
                        Some(wgpu::TextureFormat::R32Uint.into()),
                    ],
                    constants: &[
                        ("TEMPORAL_BOUNDED", flag(options.bound != f32::INFINITY)),
                        ("TEMPORAL_SHARP", flag(options.sharp)),
                        ("TEMPORAL_STILL", flag(still)),
                        ("TEMPORAL_SPARSE", flag(sparse)),
                        ("TEMPORAL_FIXED", flag(options.fixed)),
                    ],
                    ..Default::default()
                },
            )?;
            match ready.pipeline {
                Pipeline::Render(pipeline) => Ok((pipeline, ready.bind_group_layouts)),
                Pipeline::Compute(_) => Err(Error::MissingStage {
                    program: "temporal".to_owned(),
                }),
            }
        };
        let (pipeline, layouts) = make(false)?;
        let (still, _) = make(true)?;
        let block = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta temporal view"),
            size: ViewBlock::SIZE as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let block_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta temporal view"),
            layout: &layouts[0],
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: block.as_entire_binding(),
            }],
        });
        let kept =
            || std::array::from_fn(|_| texture(device, options.size, wgpu::TextureFormat::R32Uint));
        Ok(Temporal {
            options: *options,
            pipeline,
            still,
            layouts,
            block,
            block_group,
            nearest: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("veduta temporal"),
                ..Default::default()
            }),
            history: [kept(), kept()],
            result: texture(device, options.size, wgpu::TextureFormat::Rgba16Float),
            groups: None,
            frame: 0,
            last: None,
        })
    }

    /// Tells the host's picture of scene radiance, of any format that a shader reads as floats, and the view of the depth of its depth buffer. Again after each change of
    /// either.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for textures of another size than the options say, for more than one sample a pixel, for formats that are not read as floats or as depth, and for
    /// textures that cannot be bound.
    pub fn set_host(
        &mut self,
        device: &wgpu::Device,
        color: &wgpu::TextureView,
        depth: &wgpu::TextureView,
    ) -> Result<(), Error> {
        for (name, view) in [("color", color), ("depth", depth)] {
            let of = view.texture();
            if [of.width(), of.height()] != self.options.taken {
                let value = format!("{} x {} pixels", of.width(), of.height());
                let domain = format!("{:?}, as options.taken", self.options.taken);
                return Err(fault(name, value, &domain));
            }
            if of.sample_count() != 1 {
                let value = format!("{} samples a pixel", of.sample_count());
                return Err(fault(name, value, "1"));
            }
            if !of.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) {
                let value = format!("{:?}", of.usage());
                return Err(fault(name, value, "with TEXTURE_BINDING"));
            }
            let format = of.format();
            let right = match name {
                "depth" => format.has_depth_aspect(),
                _ => matches!(
                    format.sample_type(None, None),
                    Some(wgpu::TextureSampleType::Float { .. })
                ),
            };
            if !right {
                let domain = match name {
                    "depth" => "a format with depth",
                    _ => "a format that a shader reads as floats",
                };
                return Err(fault(name, format!("{format:?}"), domain));
            }
        }
        let bound = wgpu::BindingResource::TextureView;
        let group = |from: usize| {
            let resources = [
                bound(color),
                bound(depth),
                wgpu::BindingResource::Sampler(&self.nearest),
                bound(&self.history[from][0]),
                bound(&self.history[from][1]),
                bound(&self.history[from][2]),
            ];
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("veduta temporal"),
                layout: &self.layouts[1],
                entries: &entries,
            })
        };
        self.groups = Some([group(0), group(1)]);
        Ok(())
    }

    /// Shift of this frame's samples from the middles of the pixels of the host's picture, right and down, in [-0.5, 0.5) pixels.
    pub fn shift(&self) -> Vec2 {
        let [x, y] = even(self.frame);
        Vec2::new((x - 0.5) as f32, (y - 0.5) as f32)
    }

    /// The view that this frame is drawn with: its projection is shifted by [`Temporal::shift`]. Systems and the host's own things are drawn with it.
    pub fn shifted(&self, view: &View) -> View {
        let shift = self.shift();
        let [width, height] = self.options.taken.map(|n| n as f32);
        // Where the middle of a pixel is drawn, the thing beside it is seen.
        let moved = glam::Vec3::new(-2.0 * shift.x / width, 2.0 * shift.y / height, 0.0);
        View {
            projection: Mat4::from_translation(moved) * view.projection,
            ..*view
        }
    }

    /// Rows of a picture whose pixels are as large as footprints should be, for systems that filter by footprint: frames filter the rest.
    pub fn footprint_rows(&self) -> u32 {
        2 * self.options.size[1]
    }

    /// The joined picture: scene radiance, as rgba16float.
    pub fn result(&self) -> &wgpu::TextureView {
        &self.result
    }

    /// Forgets all frames, as after a cut.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let [width, height] = self.options.size.map(u64::from);
        Resources {
            pipelines: 2,
            bind_groups: 1 + 2 * u32::from(self.groups.is_some()),
            bindings: 1 + 12 * u32::from(self.groups.is_some()),
            buffers: 1,
            buffer_bytes: ViewBlock::SIZE as u64,
            textures: 7,
            texture_bytes: width * height * (2 * 12 + 8),
            samplers: 1,
        }
    }

    /// Joins the host's picture, drawn with [`Temporal::shifted`] of this view, with the frames before it. `view` itself is not shifted; where its `previous` is given, it
    /// stands for the last frame's view.
    ///
    /// # Errors
    /// As [`View::check`]; [`Error::OutOfDomain`] for a projection that is no perspective, and before [`Temporal::set_host`].
    pub fn resolve(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
    ) -> Result<Work, Error> {
        view.check()?;
        let Some(groups) = &self.groups else {
            let domain = "a picture and its depth, told with `set_host`";
            return Err(fault("host", "none", domain));
        };
        let [middle, right, up] = view.rays()?;
        let eye = view.eye.normalized();
        let clip = view.projection
            * Mat4::from_mat3(glam::Mat3::from_mat4(view.world_from_view)).inverse();
        let before = match (view.previous, self.last) {
            (_, None) => None,
            (Some(previous), _) => Some(previous),
            (None, Some((last, clip))) => {
                let moved: DVec3 = eye.relative_to(last);
                Some(clip * Mat4::from_translation(moved.as_vec3()))
            }
        };
        let rows = before.unwrap_or(clip).transpose();
        let row = |r: Vec4| r.to_array();
        let block = ViewBlock {
            ray_middle: middle.to_array(),
            depth_offset: view.projection.z_axis.z,
            ray_right: right.to_array(),
            inverse_numerator: 1.0 / view.projection.w_axis.z,
            ray_up: up.to_array(),
            frames: if before.is_some() {
                self.options.frames
            } else {
                0.0
            },
            before_x: row(rows.x_axis),
            before_y: row(rows.y_axis),
            before_w: row(rows.w_axis),
            shift: self.shift().to_array(),
            bound: self.options.bound.min(100.0),
            frame: self.frame,
            taken: self.options.taken.map(|n| n as f32),
            size: self.options.size.map(|n| n as f32),
            has_empty: u32::from(self.options.has_empty),
            ..Default::default()
        };
        let bytes = block.to_bytes();
        queue.write_buffer(&self.block, 0, &bytes);
        {
            let from = (self.frame & 1) as usize;
            let kept = &self.history[1 - from];
            let target = |view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("veduta temporal"),
                color_attachments: &[
                    target(&self.result),
                    target(&kept[0]),
                    target(&kept[1]),
                    target(&kept[2]),
                ],
                ..Default::default()
            });
            pass.set_pipeline(if before == Some(clip) {
                &self.still
            } else {
                &self.pipeline
            });
            pass.set_bind_group(0, &self.block_group, &[]);
            pass.set_bind_group(1, &groups[from], &[]);
            // Squares of 32 pixels.
            let [columns, rows] = self.options.size.map(|n| n.div_ceil(32));
            pass.draw(0..6 * columns * rows, 0..1);
        }
        self.frame = self.frame.wrapping_add(1);
        self.last = Some((eye, clip));
        Ok(Work {
            draws: 1,
            writes: 1,
            bytes: bytes.len() as u64,
            ..Work::default()
        })
    }
}
