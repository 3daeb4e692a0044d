//! The whole landscape in one fragment program: the textbook picture.

use glam::Vec3;

use crate::error::Error;
use crate::program::{
    ComposedProgram, PipelineOptions, ProgramSet, ReadyPipeline, StructLayout, Value,
};
use crate::programs::blocks::View as ViewBlock;
use crate::settings::{Preset, Settings};
use crate::view::{View, WorldPos};

/// How depth grows in the host's depth buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Depth {
    /// 0 near, 1 far.
    Normal,
    /// 1 near, 0 at a finite far plane.
    Reversed,
    /// 1 near, 0 at infinity.
    #[default]
    ReversedInfinite,
}

/// How the host projects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Projection {
    /// Rays from one point.
    #[default]
    Perspective,
    /// Parallel rays.
    Orthographic,
}

/// What the host's render pass draws into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Targets {
    /// Format of the colour target. Formats ending in `Srgb` get linear display colour, other integer formats encoded
    /// display colour, float formats scene radiance.
    pub color_format: wgpu::TextureFormat,
    /// Format of the pass's depth buffer, if it has one.
    pub depth_format: Option<wgpu::TextureFormat>,
    /// Samples a pixel of the pass, at least 1.
    pub sample_count: u32,
    /// How depth grows. `Landscape` neither reads nor writes depth; `Sky`, `Terrain` and `Clouds` do, and refuse a view whose projection grows otherwise.
    pub depth: Depth,
    /// How the host projects; as with depth.
    pub projection: Projection,
}

impl Targets {
    /// Checks what holds for every system.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a number of samples that no pass has.
    pub fn check(&self) -> Result<(), Error> {
        if matches!(self.sample_count, 1 | 2 | 4 | 8 | 16) {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: "targets.sample_count".to_owned(),
            value: self.sample_count.to_string(),
            domain: "1, 2, 4, 8 or 16".to_owned(),
        })
    }

    /// Checks what a device must be able to draw into. With the feature `TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES` formats and numbers of samples beyond those that every device has are the host's to know.
    ///
    /// # Errors
    /// As [`Targets::check`]; [`Error::OutOfDomain`] for a colour format that cannot be drawn into, a depth format without depth, and a number of samples that the device does not have for them.
    pub fn check_on(&self, device: &wgpu::Device) -> Result<(), Error> {
        self.check()?;
        let fault = |name: &str, value: String, domain: &str| Error::OutOfDomain {
            name: format!("targets.{name}"),
            value,
            domain: domain.to_owned(),
        };
        if let Some(depth) = self.depth_format
            && !depth.has_depth_aspect()
        {
            let domain = "None or a format with depth";
            return Err(fault("depth_format", format!("{depth:?}"), domain));
        }
        if self.color_format.is_depth_stencil_format() {
            let domain = "a colour format";
            return Err(fault(
                "color_format",
                format!("{:?}", self.color_format),
                domain,
            ));
        }
        let formats = [
            Some(("color_format", self.color_format)),
            self.depth_format.map(|f| ("depth_format", f)),
        ];
        for (name, format) in formats.into_iter().flatten() {
            if !device.features().contains(format.required_features()) {
                let domain = format!(
                    "a format that the device has: this one needs {:?}",
                    format.required_features()
                );
                return Err(fault(name, format!("{format:?}"), &domain));
            }
            if device
                .features()
                .contains(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
            {
                continue;
            }
            let can = format.guaranteed_format_features(device.features());
            if !can
                .allowed_usages
                .contains(wgpu::TextureUsages::RENDER_ATTACHMENT)
            {
                return Err(fault(
                    name,
                    format!("{format:?}"),
                    "a format that can be drawn into",
                ));
            }
            if !can.flags.sample_count_supported(self.sample_count) {
                let domain =
                    format!("what every device has for {format:?}: 1 or 4, for some only 1");
                return Err(fault(
                    "sample_count",
                    self.sample_count.to_string(),
                    &domain,
                ));
            }
        }
        Ok(())
    }
}

impl Default for Targets {
    fn default() -> Self {
        Targets {
            color_format: wgpu::TextureFormat::Rgba8UnormSrgb,
            depth_format: None,
            sample_count: 1,
            depth: Depth::default(),
            projection: Projection::default(),
        }
    }
}

/// What a phase of a frame did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[must_use]
pub struct Work {
    /// Tables computed anew.
    pub bakes: u32,
    /// Compute dispatches recorded.
    pub dispatches: u32,
    /// Draw calls recorded.
    pub draws: u32,
    /// Buffers written.
    pub writes: u32,
    /// Bytes uploaded.
    pub bytes: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, more: Work) {
        self.bakes += more.bakes;
        self.dispatches += more.dispatches;
        self.draws += more.draws;
        self.writes += more.writes;
        self.bytes += more.bytes;
    }
}

/// What a system keeps on the device for as long as it lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Resources {
    /// Pipelines.
    pub pipelines: u32,
    /// Bind groups.
    pub bind_groups: u32,
    /// Resources bound in them.
    pub bindings: u32,
    /// Buffers.
    pub buffers: u32,
    /// Bytes of all buffers.
    pub buffer_bytes: u64,
    /// Textures; those that the host draws into are its own.
    pub textures: u32,
    /// Bytes of all textures.
    pub texture_bytes: u64,
    /// Samplers.
    pub samplers: u32,
}

/// Choices that are made once.
#[derive(Debug, Clone, PartialEq)]
pub struct LandscapeOptions {
    /// The quality.
    pub preset: Preset,
    /// The scene by its file name without the ending.
    pub scene: String,
    /// Values that go before those of scene and preset.
    pub values: Vec<(String, Value)>,
}

impl Default for LandscapeOptions {
    fn default() -> Self {
        LandscapeOptions {
            preset: Preset::default(),
            scene: "thesis".to_owned(),
            values: Vec::new(),
        }
    }
}

/// Draws terrain, sky and clouds over the whole target.
///
/// ```no_run
/// # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView)
/// # -> Result<(), veduta::Error> {
/// let targets = veduta::Targets::default();
/// let mut landscape = veduta::Landscape::new(device, veduta::programs(), &targets, &Default::default())?;
/// let work = landscape.prepare(device, queue, encoder, &veduta::View::default())?;
/// println!("{} bytes uploaded", work.bytes);
/// let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
///     color_attachments: &[Some(wgpu::RenderPassColorAttachment {
///         view: target, depth_slice: None, resolve_target: None, ops: wgpu::Operations::default(),
///     })],
///     ..Default::default()
/// });
/// landscape.composite(&mut pass);
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Landscape {
    settings: Settings,
    programs: ProgramSet,
    pipeline: wgpu::RenderPipeline,
    blocks: Vec<Block>,
    groups: Vec<wgpu::BindGroup>,
    frame: u32,
    /// View and frame that the blocks hold; `None` when content has changed since.
    prepared: Option<(View, u32)>,
}

/// What a uniform block of the program holds. A variant has only the blocks that it reads.
#[derive(Debug, Clone)]
enum Holds {
    View,
    Content(StructLayout),
    Anchors(StructLayout),
}

/// A uniform buffer that is written only when its bytes have changed.
#[derive(Debug)]
struct Block {
    holds: Holds,
    group: u32,
    binding: u32,
    buffer: wgpu::Buffer,
    bytes: Vec<u8>,
}

impl Block {
    /// The block at a binding; `None` when the program reads none there.
    fn new(
        device: &wgpu::Device,
        program: &ComposedProgram,
        [group, binding]: [u32; 2],
    ) -> Result<Option<Block>, Error> {
        if !program
            .bindings
            .iter()
            .any(|b| b.group == group && b.binding == binding)
        {
            return Ok(None);
        }
        let layout = |name| {
            program
                .layout(name)
                .cloned()
                .ok_or_else(|| Error::MissingStage {
                    program: program.program.to_string(),
                })
        };
        let (label, size, holds) = match (group, binding) {
            (0, _) => ("veduta view", ViewBlock::SIZE as u64, Holds::View),
            (_, 0) => {
                let layout = layout("Content")?;
                let size = u64::from(layout.size);
                ("veduta content", size, Holds::Content(layout))
            }
            _ => {
                let layout = layout("Anchors")?;
                let size = u64::from(layout.size);
                ("veduta anchors", size, Holds::Anchors(layout))
            }
        };
        Ok(Some(Block {
            holds,
            group,
            binding,
            buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            bytes: Vec::new(),
        }))
    }

    fn update(&mut self, queue: &wgpu::Queue, bytes: Vec<u8>) -> Work {
        if self.bytes == bytes {
            return Work::default();
        }
        queue.write_buffer(&self.buffer, 0, &bytes);
        self.bytes = bytes;
        Work {
            writes: 1,
            bytes: self.bytes.len() as u64,
            ..Default::default()
        }
    }
}

/// What the program writes for a colour format: the value of the override `OUTPUT`.
pub(crate) fn output_of(format: wgpu::TextureFormat) -> Result<f64, Error> {
    if format.is_depth_stencil_format()
        || format.is_compressed()
        || format.components() < 3
        || matches!(
            format.sample_type(None, None),
            Some(wgpu::TextureSampleType::Uint | wgpu::TextureSampleType::Sint) | None
        )
    {
        return Err(Error::OutOfDomain {
            name: "targets.color_format".to_owned(),
            value: format!("{format:?}"),
            domain: "a colour format with at least three channels that a shader writes as floats"
                .to_owned(),
        });
    }
    Ok(if format.is_srgb() {
        1.0
    } else if matches!(
        format,
        wgpu::TextureFormat::Rgba16Float
            | wgpu::TextureFormat::Rgba32Float
            | wgpu::TextureFormat::Rg11b10Ufloat
    ) {
        2.0
    } else {
        0.0
    })
}

impl Landscape {
    /// Builds the pipeline and its parameter blocks.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a target that it cannot draw into; the faults of [`Settings::resolve`],
    /// [`ProgramSet::get`] and [`crate::program::ComposedProgram::pipeline`]. `get` finds what was built: for flags that no
    /// shipped preset and scene turn on together, compose the variant into `programs` first, with
    /// `ProgramSet::get_or_compose` (feature `compose`).
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &LandscapeOptions,
    ) -> Result<Landscape, Error> {
        if targets.projection == Projection::Orthographic {
            return Err(Error::OutOfDomain {
                name: "targets.projection".to_owned(),
                value: "Orthographic".to_owned(),
                domain: "Perspective: the landscape is drawn from one eye".to_owned(),
            });
        }
        targets.check_on(device)?;
        let output = output_of(targets.color_format)?;
        let settings = Settings::resolve(
            programs,
            &options.preset,
            Some(&options.scene),
            &options.values,
        )?;
        let scene = programs.scene(&options.scene)?;
        let program = programs.get(&scene.program, &settings.features())?;
        let constants: Vec<(&str, f64)> = program
            .overrides
            .iter()
            .filter_map(|o| {
                let value = if o.name == "OUTPUT" {
                    Some(output)
                } else {
                    settings.number(&o.name)
                };
                Some((o.name.as_ref(), value?))
            })
            .collect();
        let ReadyPipeline {
            pipeline,
            bind_group_layouts,
        } = program.pipeline(
            device,
            &PipelineOptions {
                targets: &[Some(targets.color_format.into())],
                depth_stencil: targets.depth_format.map(|format| wgpu::DepthStencilState {
                    format,
                    depth_write_enabled: Some(false),
                    depth_compare: Some(wgpu::CompareFunction::Always),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                sample_count: targets.sample_count,
                constants: &constants,
                ..Default::default()
            },
        )?;
        let crate::program::Pipeline::Render(pipeline) = pipeline else {
            return Err(Error::MissingStage {
                program: program.program.to_string(),
            });
        };
        let mut blocks = Vec::new();
        for place in [[0, 0], [1, 0], [1, 1]] {
            blocks.extend(Block::new(device, program, place)?);
        }
        let groups = bind_group_layouts
            .iter()
            .zip(0..)
            .map(|(layout, group)| {
                let entries: Vec<wgpu::BindGroupEntry<'_>> = blocks
                    .iter()
                    .filter(|block| block.group == group)
                    .map(|block| wgpu::BindGroupEntry {
                        binding: block.binding,
                        resource: block.buffer.as_entire_binding(),
                    })
                    .collect();
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("veduta landscape"),
                    layout,
                    entries: &entries,
                })
            })
            .collect();
        Ok(Landscape {
            settings,
            programs: programs.clone(),
            pipeline,
            blocks,
            groups,
            frame: 0,
            prepared: None,
        })
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let blocks = self.blocks.len() as u32;
        Resources {
            pipelines: 1,
            bind_groups: self.groups.len() as u32,
            bindings: blocks,
            buffers: blocks,
            buffer_bytes: self.blocks.iter().map(|b| b.buffer.size()).sum(),
            // The textbook picture reads parameters only.
            ..Default::default()
        }
    }

    /// The resolved values.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The pipeline; it is the same object for as long as the landscape lives.
    pub fn pipeline(&self) -> &wgpu::RenderPipeline {
        &self.pipeline
    }

    /// Gives a content key a value; the next [`Landscape::prepare`] uploads it. No pipeline is made.
    ///
    /// # Errors
    /// [`Error::UnknownKey`], [`Error::WrongType`], [`Error::OutOfDomain`]; a quality key needs a new `Landscape`.
    pub fn set_content(&mut self, name: &str, value: Value) -> Result<(), Error> {
        if self.programs.key(name)?.kind != crate::program::KeyKind::Content {
            return Err(Error::WrongType {
                name: name.to_owned(),
                value: value.to_string(),
                expected: "content; a quality key is given to `Landscape::new`".to_owned(),
            });
        }
        self.settings.set(&self.programs, name, value)?;
        self.prepared = None;
        Ok(())
    }

    /// The bytes of the block `Anchors`, which has the members of the variant's features only.
    fn anchors(&self, layout: &StructLayout, eye: WorldPos) -> Result<Vec<u8>, Error> {
        let foot = WorldPos {
            cell: glam::I64Vec3::new(eye.cell.x, 0, eye.cell.z),
            frac: Vec3::new(eye.frac.x, 0.0, eye.frac.z),
        };
        let number = |name: &str| self.settings.number(name).unwrap_or(1.0);
        let place = |name: &str| -> Result<([i32; 3], [f32; 3]), Error> {
            let wavelength = number(name);
            let mut cell = [0; 3];
            let mut frac = [0.0; 3];
            for axis in 0..3 {
                let at = foot.lattice(axis, wavelength)?;
                cell[axis] = at.cell;
                frac[axis] = at.frac;
            }
            Ok((cell, frac))
        };
        let cell = |name: &str| Ok::<_, Error>(place(name)?.0.map(i32::to_le_bytes));
        let frac = |name: &str| Ok::<_, Error>(place(name)?.1.map(f32::to_le_bytes));
        let flat = |[x, _, z]: [[u8; 4]; 3]| vec![x, z];
        let mut bytes = vec![0; layout.size as usize];
        for member in layout.members.iter() {
            let words = match member.name.as_ref() {
                "terrain_cell" => flat(cell("TERRAIN_SCALE")?),
                "terrain_frac" => flat(frac("TERRAIN_SCALE")?),
                "rock_cell" => cell("ROCK_SCALE")?.to_vec(),
                "rock_frac" => frac("ROCK_SCALE")?.to_vec(),
                "cloud_turn" => {
                    let (cell, frac) = place("CLOUD_SCALE")?;
                    // Period and wavelength differ by a power of two, so that the cell and the fraction give the turn
                    // exactly. The key's domain is [1, 12], so that a cell takes 20 to 31 of a turn's 32 bits.
                    let bits = 32_u32.wrapping_sub(number("CLOUD_PERIOD_DOUBLINGS") as u32);
                    let size = f64::from(1_u32.wrapping_shl(bits));
                    let turn = |axis: usize| {
                        let within = (f64::from(frac[axis]) * size) as u32;
                        let whole = cell[axis].cast_unsigned().wrapping_shl(bits);
                        whole.wrapping_add(within).to_le_bytes()
                    };
                    [0, 1, 2].map(turn).to_vec()
                }
                other => {
                    return Err(Error::UnknownKey {
                        name: other.to_owned(),
                        nearest: None,
                    });
                }
            };
            let words = words.concat();
            let at = member.offset as usize;
            bytes
                .get_mut(at..at + words.len())
                .ok_or_else(|| Error::WrongType {
                    name: member.name.to_string(),
                    value: format!("{} bytes", words.len()),
                    expected: member.ty.to_string(),
                })?
                .copy_from_slice(&words);
        }
        Ok(bytes)
    }

    /// Uploads what has changed since the last call: each block of parameters whose bytes are others, nothing for a view,
    /// frame number and content as they were.
    ///
    /// Nothing is submitted; `encoder` is the one that the pass of [`Landscape::composite`] is recorded in.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field of the view, its value and what is allowed.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
    ) -> Result<Work, Error> {
        // The textbook picture has no tables, so that nothing is recorded ahead of the pass.
        let _ = (device, encoder);
        if self.prepared == Some((*view, self.frame)) {
            return Ok(Work::default());
        }
        view.check()?;
        let altitude = view.eye.altitude();
        if !(-1e4..=1e8).contains(&altitude) {
            return Err(Error::OutOfDomain {
                name: "view.eye altitude".to_owned(),
                value: format!("{altitude} m"),
                domain: "in [-10000, 1e8] m".to_owned(),
            });
        }
        // Below the centre of a small planet there is no up.
        let radius = self
            .settings
            .number("PLANET_RADIUS")
            .unwrap_or(f64::INFINITY);
        if altitude < -0.5 * radius {
            return Err(Error::OutOfDomain {
                name: "view.eye altitude".to_owned(),
                value: format!("{altitude} m"),
                domain: format!(
                    "at least half of PLANET_RADIUS, {radius} m, above the planet's centre"
                ),
            });
        }
        let [ray_middle, ray_right, ray_up] = view.rays()?.map(|v| v.to_array());
        let block = ViewBlock {
            ray_middle,
            eye_altitude: altitude as f32,
            ray_right,
            exposure: view.exposure,
            ray_up,
            sun_angular_radius: view.sun.angular_radius,
            to_sun: view.sun.to_light.normalize().to_array(),
            frame: self.frame,
            sun_irradiance: view.sun.irradiance.to_array(),
            jitter: view.jitter.to_array(),
            ..Default::default()
        };
        let contents = self
            .blocks
            .iter()
            .map(|b| match &b.holds {
                Holds::View => Ok(block.to_bytes().to_vec()),
                Holds::Content(layout) => self.settings.uniform_bytes(&self.programs, layout),
                Holds::Anchors(layout) => self.anchors(layout, view.eye),
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let mut work = Work::default();
        for (block, bytes) in self.blocks.iter_mut().zip(contents) {
            let done = block.update(queue, bytes);
            work.writes += done.writes;
            work.bytes += done.bytes;
        }
        self.prepared = Some((*view, self.frame));
        Ok(work)
    }

    /// Sets the number that seeds the step jitter; give each frame its own to make the noise change.
    pub fn set_frame(&mut self, frame: u32) {
        self.frame = frame;
    }

    /// Draws over every pixel of the pass.
    pub fn composite(&self, pass: &mut wgpu::RenderPass<'_>) -> Work {
        pass.set_pipeline(&self.pipeline);
        for (i, group) in self.groups.iter().enumerate() {
            pass.set_bind_group(i as u32, group, &[]);
        }
        pass.draw(0..3, 0..1);
        Work {
            draws: 1,
            ..Default::default()
        }
    }
}
