//! The sky behind a host's own scene and the air before it.

use glam::{DVec3, Vec3, Vec4};

use crate::error::Error;
use crate::landscape::{Depth, Projection, Resources, Targets, Work};
use crate::program::{ComposedProgram, Pipeline, PipelineOptions, ProgramSet, ReadyPipeline};
use crate::programs::blocks::SkyDraw as DrawBlock;
use crate::settings::{Preset, Settings};
use crate::view::View;

use super::Atmosphere;
use super::tables::{Eye, SkyQuality, SkyTables, bind_groups};

/// How the sky comes together with what the host has drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SkyComposition {
    /// The sky alone, at the far plane: drawn in the host's own pass after its opaque things, where its depth test lets it through.
    #[default]
    Background,
    /// Sky and air in a pass of their own that reads the host's picture (scene radiance) and depth and writes the whole target.
    OverPicture,
    /// As `OverPicture`, but depth stands in the picture's alpha, as [`Sky::set_host_with_alpha`] says: one target carries colour and linear
    /// depth.
    OverPictureWithAlpha,
    /// As `OverPicture`, but light and transmittance go into two targets of float formats, for a host that puts them together itself:
    /// picture * transmittance + light. The picture is not read.
    TwoTargets,
}

/// Choices that are made once.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyOptions {
    /// The quality of the tables.
    pub preset: Preset,
    /// The air.
    pub atmosphere: Atmosphere,
    /// How the sky comes together with what the host has drawn.
    pub composition: SkyComposition,
    /// `None`: from the tables. Else the textbook path, for an eye within the air's lower tenth and behind things ([`SkyComposition::Background`]) alone: every pixel marches so many
    /// steps along its ray, in [1, 512], and so many from each sample to the sun, in [1, 64], and has the light that is scattered once. With 0 steps to the sun paths to
    /// it are read from the table of columns, Afra's optical depth table, and light has all orders.
    pub march: Option<[u32; 2]>,
}

impl Default for SkyOptions {
    /// The Earth behind the host's things, with the preset `high`.
    fn default() -> Self {
        SkyOptions {
            preset: Preset::High,
            atmosphere: Atmosphere::default(),
            composition: SkyComposition::default(),
            march: None,
        }
    }
}

/// Draws the sky behind a host's scene, from any altitude, and the air before it.
///
/// ```no_run
/// # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView, depth: &wgpu::TextureView)
/// # -> Result<(), veduta::Error> {
/// use veduta::atmosphere::{Sky, SkyOptions};
/// let targets = veduta::Targets { depth_format: Some(wgpu::TextureFormat::Depth32Float), ..Default::default() };
/// let mut sky = Sky::new(device, veduta::programs(), &targets, &SkyOptions::default())?;
/// // Every frame: tables are made anew only when the sun or the eye's altitude has changed.
/// let work = sky.prepare(queue, encoder, &veduta::View::default())?;
/// println!("{} tables", work.bakes);
/// let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
///     color_attachments: &[Some(wgpu::RenderPassColorAttachment {
///         view: target, depth_slice: None, resolve_target: None, ops: wgpu::Operations::default(),
///     })],
///     depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
///         view: depth, depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }), stencil_ops: None,
///     }),
///     ..Default::default()
/// });
/// // The host draws its own things here.
/// let _ = sky.composite(&mut pass)?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Sky {
    tables: SkyTables,
    targets: Targets,
    composition: SkyComposition,
    /// What passes are made from when an eye first needs one.
    maker: PassMaker,
    /// By [`EyePlace`].
    passes: [Option<Pass>; 3],
    place: EyePlace,
    draw: wgpu::Buffer,
    draw_bytes: Vec<u8>,
    /// What linear depth in the picture's alpha is divided by.
    greatest_depth: f32,
    /// Whether the view can show air, and the sun's disc.
    shows: [bool; 2],
    host: Option<wgpu::BindGroup>,
}

/// Where the eye is: the values of the override `EYE_PLACE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EyePlace {
    /// Low in the air.
    Low = 0,
    /// So high that its table holds codes.
    High = 1,
    /// Above the air.
    Outside = 2,
}

/// A pipeline with what is bound to it.
#[derive(Debug)]
struct Layer {
    pipeline: wgpu::RenderPipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    groups: Vec<wgpu::BindGroup>,
    /// Of the host's too.
    bindings: u32,
}

/// What is drawn: the sky, and over it the sun's disc in a square of its own, so that no other pixel pays for it.
#[derive(Debug)]
struct Pass {
    sky: Layer,
    disc: Option<Layer>,
}

/// What passes are made from.
#[derive(Debug)]
struct PassMaker {
    device: wgpu::Device,
    sky: ComposedProgram,
    disc: Option<ComposedProgram>,
    formats: Vec<Option<wgpu::ColorTargetState>>,
    depth_stencil: Option<wgpu::DepthStencilState>,
    sample_count: u32,
    output: f64,
    march: Option<[u32; 2]>,
}

impl PassMaker {
    fn pass(
        &self,
        tables: &SkyTables,
        draw: &wgpu::Buffer,
        place: EyePlace,
    ) -> Result<Pass, Error> {
        let layer = |program: &ComposedProgram| self.layer(program, tables, draw, place);
        Ok(Pass {
            sky: layer(&self.sky)?,
            disc: self.disc.as_ref().map(layer).transpose()?,
        })
    }

    fn layer(
        &self,
        program: &ComposedProgram,
        tables: &SkyTables,
        draw: &wgpu::Buffer,
        place: EyePlace,
    ) -> Result<Layer, Error> {
        let [steps, light_steps] = self.march.unwrap_or_default().map(f64::from);
        let constants: Vec<(&str, f64)> = program
            .overrides
            .iter()
            .map(|o| {
                let value = match o.name.as_ref() {
                    "OUTPUT" => self.output,
                    "MARCH_STEPS" => steps,
                    "MARCH_LIGHT_STEPS" => light_steps,
                    _ => f64::from(place as u8),
                };
                (o.name.as_ref(), value)
            })
            .collect();
        let ReadyPipeline {
            pipeline,
            bind_group_layouts: layouts,
        } = program.pipeline(
            &self.device,
            &PipelineOptions {
                targets: &self.formats,
                depth_stencil: self.depth_stencil.clone(),
                sample_count: self.sample_count,
                constants: &constants,
                ..Default::default()
            },
        )?;
        let Pipeline::Render(pipeline) = pipeline else {
            return Err(Error::MissingStage {
                program: "sky".to_owned(),
            });
        };
        // A variant has only the bindings that it reads.
        let has = |group: u32, binding: u32| {
            program
                .bindings
                .iter()
                .any(|b| b.group == group && b.binding == binding)
        };
        let view = wgpu::BindingResource::TextureView;
        let mut first = vec![
            (0, tables.air().as_entire_binding()),
            (1, tables.eye().as_entire_binding()),
            (2, draw.as_entire_binding()),
            (3, tables.look().as_entire_binding()),
        ];
        first.retain(|(binding, _)| has(0, *binding));
        let before = [(2, tables.aerial()), (3, tables.aerial_depths())];
        let mut second = vec![
            (0, wgpu::BindingResource::Sampler(tables.sampler())),
            (1, view(tables.sky())),
            (4, view(tables.columns())),
            (5, view(tables.diffuse())),
        ];
        second.extend(before.into_iter().filter_map(|(k, t)| Some((k, view(t?)))));
        second.retain(|(binding, _)| has(1, *binding));
        let groups = bind_groups(
            &self.device,
            "veduta sky",
            &layouts[..layouts.len().min(2)],
            &[&first, &second],
        );
        Ok(Layer {
            pipeline,
            layouts,
            groups,
            bindings: program.bindings.len() as u32,
        })
    }
}

impl Sky {
    /// Builds tables and pipelines.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for targets that it cannot draw into: integer or depth formats, a number of samples that is none, more than
    /// one sample with a composition that reads the host's depth, a format for `TwoTargets` that is not float; the faults of
    /// [`Settings::resolve`] and [`SkyTables::new`].
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &SkyOptions,
    ) -> Result<Sky, Error> {
        targets.check_on(device)?;
        let reads_depth = options.composition != SkyComposition::Background;
        if reads_depth && targets.sample_count != 1 {
            return Err(Error::OutOfDomain {
                name: "targets.sample_count".to_owned(),
                value: targets.sample_count.to_string(),
                domain: "1 for a sky that is composed with the host's depth".to_owned(),
            });
        }
        let output = crate::landscape::output_of(targets.color_format)?;
        if options.composition == SkyComposition::TwoTargets && output != 2.0 {
            return Err(Error::OutOfDomain {
                name: "targets.color_format".to_owned(),
                value: format!("{:?}", targets.color_format),
                domain: "a float format, since light and transmittance are not for display"
                    .to_owned(),
            });
        }
        if let Some(march) = options.march {
            let [steps, light_steps] = march.map(u64::from);
            let fits = (1..=512).contains(&steps)
                && (0..=64).contains(&light_steps)
                && 4 * steps * (2 * light_steps + 3) < 65_520;
            if reads_depth || !fits {
                return Err(fault(
                    "march",
                    format!("{march:?} with {:?}", options.composition),
                    "Background with steps in [1, 512] and steps to the sun in [0, 64] of which 4 steps (2 light steps + 3) stays below 65,520",
                ));
            }
        }
        let settings = Settings::resolve(programs, &options.preset, None, &[])?;
        let quality = SkyQuality::of(&settings);
        let tables =
            SkyTables::of_sky(device, programs, &options.atmosphere, &quality, reads_depth)?;
        let mut features = options.atmosphere.features().to_vec();
        if options.march.is_some() {
            features.push("SKY_MARCH");
        }
        match options.composition {
            SkyComposition::Background => {}
            SkyComposition::OverPicture => features.push("AERIAL"),
            SkyComposition::OverPictureWithAlpha => features.extend(["AERIAL", "AERIAL_ALPHA"]),
            SkyComposition::TwoTargets => features.extend(["AERIAL", "AERIAL_TARGETS"]),
        }
        let draw = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta sky view"),
            size: DrawBlock::SIZE as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let depth_stencil =
            targets
                .depth_format
                .filter(|_| !reads_depth)
                .map(|format| wgpu::DepthStencilState {
                    format,
                    depth_write_enabled: Some(false),
                    depth_compare: Some(match targets.depth {
                        Depth::Normal => wgpu::CompareFunction::LessEqual,
                        Depth::Reversed | Depth::ReversedInfinite => {
                            wgpu::CompareFunction::GreaterEqual
                        }
                    }),
                    stencil: Default::default(),
                    bias: Default::default(),
                });
        let format = Some(targets.color_format.into());
        let both = [format.clone(), format];
        let count = 1 + usize::from(options.composition == SkyComposition::TwoTargets);
        let maker = PassMaker {
            device: device.clone(),
            sky: programs.get("sky", &features)?.clone(),
            disc: if reads_depth || targets.projection == Projection::Orthographic {
                None
            } else {
                features.push("SUN_DISC");
                Some(programs.get("sky", &features)?.clone())
            },
            formats: both[..count].to_vec(),
            depth_stencil,
            sample_count: targets.sample_count,
            output,
            march: options.march,
        };
        let mut sky = Sky {
            tables,
            targets: *targets,
            composition: options.composition,
            maker,
            passes: [None, None, None],
            place: EyePlace::Low,
            draw,
            draw_bytes: Vec::new(),
            greatest_depth: 0.0,
            shows: [true; 2],
            host: None,
        };
        sky.pass(EyePlace::Low)?;
        Ok(sky)
    }

    /// The pass for an eye, made when there is none.
    fn pass(&mut self, place: EyePlace) -> Result<&Pass, Error> {
        let held = &mut self.passes[place as usize];
        let pass = match held.take() {
            Some(pass) => pass,
            None => self.maker.pass(&self.tables, &self.draw, place)?,
        };
        Ok(held.insert(pass))
    }

    /// The tables.
    pub fn tables(&self) -> &SkyTables {
        &self.tables
    }

    /// The tables, to change their air.
    pub fn tables_mut(&mut self) -> &mut SkyTables {
        &mut self.tables
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let tables = self.tables.resources();
        let layers = || {
            self.passes
                .iter()
                .flatten()
                .flat_map(|pass| [Some(&pass.sky), pass.disc.as_ref()])
                .flatten()
        };
        Resources {
            pipelines: tables.pipelines + layers().count() as u32,
            bind_groups: tables.bind_groups
                + layers().map(|l| l.groups.len() as u32).sum::<u32>()
                + u32::from(self.host.is_some()),
            bindings: tables.bindings + layers().map(|l| l.bindings).sum::<u32>(),
            buffers: tables.buffers + 1,
            buffer_bytes: tables.buffer_bytes + self.draw.size(),
            ..tables
        }
    }

    /// Tells which pictures of the host [`Sky::composite`] reads: its depth, and for `OverPicture` its scene radiance, as large as the target. Again after each change of
    /// size. Of a format with stencil the view has to be of the depth alone.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a sky that reads none, for a missing picture, for one of another kind (format, samples, usage), and for two of different sizes.
    pub fn set_host(
        &mut self,
        device: &wgpu::Device,
        depth: &wgpu::TextureView,
        picture: Option<&wgpu::TextureView>,
    ) -> Result<(), Error> {
        check_host("depth", depth, true)?;
        if let Some(picture) = picture.filter(|_| self.composition == SkyComposition::OverPicture) {
            check_host("picture", picture, false)?;
            let size = |view: &wgpu::TextureView| [view.texture().width(), view.texture().height()];
            if size(picture) != size(depth) {
                return Err(fault(
                    "picture",
                    format!("{:?} pixels", size(picture)),
                    &format!("{:?}, as the depth has", size(depth)),
                ));
            }
        }
        let mut bound = vec![(0, wgpu::BindingResource::TextureView(depth))];
        match (self.composition, picture) {
            (SkyComposition::Background | SkyComposition::OverPictureWithAlpha, _) => {
                return Err(fault(
                    "composition",
                    format!("{:?}", self.composition),
                    "one that reads the host's depth buffer",
                ));
            }
            (SkyComposition::OverPicture, None) => {
                return Err(fault(
                    "picture",
                    "missing".to_owned(),
                    "the host's scene radiance",
                ));
            }
            (SkyComposition::OverPicture, Some(picture)) => {
                bound.push((1, wgpu::BindingResource::TextureView(picture)));
            }
            (SkyComposition::TwoTargets, _) => {}
        }
        self.bind_host(device, &bound)
    }

    /// As [`Sky::set_host`] for `OverPictureWithAlpha`: a picture of scene radiance whose alpha is the depth along the view's direction over
    /// `greatest_depth` in metres, in [1, 1e12]; where it is 1 or more there is sky. A 32-bit format keeps millimetres near the eye; `Rgba16Float` a
    /// thousandth of the depth. Before [`Sky::prepare`], which uploads the depth.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a sky of another composition, for a depth out of its domain, and for a picture of another kind (format, samples, usage).
    pub fn set_host_with_alpha(
        &mut self,
        device: &wgpu::Device,
        picture: &wgpu::TextureView,
        greatest_depth: f32,
    ) -> Result<(), Error> {
        if self.composition != SkyComposition::OverPictureWithAlpha {
            return Err(fault(
                "composition",
                format!("{:?}", self.composition),
                "OverPictureWithAlpha",
            ));
        }
        if !(1.0..=1e12).contains(&greatest_depth) {
            return Err(fault(
                "greatest_depth",
                greatest_depth.to_string(),
                "in [1, 1e12] m",
            ));
        }
        check_host("picture", picture, false)?;
        self.greatest_depth = greatest_depth;
        self.bind_host(device, &[(1, wgpu::BindingResource::TextureView(picture))])
    }

    fn bind_host(
        &mut self,
        device: &wgpu::Device,
        bound: &[(u32, wgpu::BindingResource<'_>)],
    ) -> Result<(), Error> {
        let layouts = &self.pass(self.place)?.sky.layouts;
        self.host = bind_groups(
            device,
            "veduta host",
            layouts.get(2..).unwrap_or_default(),
            &[bound],
        )
        .pop();
        Ok(())
    }

    /// Uploads what has changed and records the tables that have to be made anew. The sun's irradiance is the view's times the colour of the
    /// atmosphere's sun; its angular radius is the view's.
    ///
    /// # Errors
    /// As [`View::check`] and [`SkyTables::prepare`]; [`Error::OutOfDomain`] for a projection that does not fit the targets.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
    ) -> Result<Work, Error> {
        view.check()?;
        let eye = Eye {
            altitude: view.eye.altitude().max(0.0),
            to_sun: view.sun.to_light.as_dvec3().normalize().to_array(),
            sun_angular_radius: f64::from(view.sun.angular_radius),
        };
        let colour = self.tables.atmosphere().sun.colour;
        // Depth in a picture's alpha has no direction.
        let reads_depth = matches!(
            self.composition,
            SkyComposition::OverPicture | SkyComposition::TwoTargets
        );
        let mut block = draw_block(&self.targets, reads_depth, colour, view)?;
        block.greatest_depth = self.greatest_depth;
        let altitude = eye.altitude as f32;
        let top = self.tables.atmosphere().thickness as f32;
        // As `sky_coded` of the modules has it.
        self.place = if altitude > top {
            EyePlace::Outside
        } else if altitude > 0.1 * top {
            EyePlace::High
        } else {
            EyePlace::Low
        };
        if self.maker.march.is_some() && self.place != EyePlace::Low {
            return Err(fault(
                "view.eye",
                format!("{altitude} m"),
                "within the lower tenth of the air, for a sky that is marched",
            ));
        }
        self.pass(self.place)?;
        self.shows = self.in_view(&block, &eye);
        // A view that shows neither air nor sun reads no table.
        let mut work = if self.shows == [false; 2] {
            eye.check()?;
            Work::default()
        } else {
            self.tables.prepare(queue, encoder, &eye)?
        };
        let bytes = block.to_bytes().to_vec();
        if bytes != self.draw_bytes {
            queue.write_buffer(&self.draw, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            self.draw_bytes = bytes;
        }
        Ok(work)
    }

    /// Whether any pixel can show air or ground, and whether any can show the sun's disc; by cones about the view.
    fn in_view(&self, block: &DrawBlock, eye: &Eye) -> [bool; 2] {
        if self.composition != SkyComposition::Background || block.parallel != 0 {
            return [true; 2];
        }
        let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let [middle, right, up] = [block.ray_middle, block.ray_right, block.ray_up].map(vector);
        // As far as a corner is from the middle, and a little more for the edge of the sun's square.
        let reach = [right + up, right - up]
            .into_iter()
            .flat_map(|corner| [middle + corner, middle - corner])
            .map(|corner| middle.angle_between(corner))
            .fold(0.0, f64::max)
            + 0.01;
        let air = self.tables.atmosphere();
        let r = air.planet_radius + eye.altitude;
        let nadir = middle.angle_between(DVec3::NEG_Y);
        let limb = ((air.planet_radius + air.thickness) / r).min(1.0).asin();
        let dip = (air.planet_radius / r).min(1.0).acos();
        let to_sun = DVec3::from_array(eye.to_sun);
        let radius = eye.sun_angular_radius + 0.01;
        [
            self.place != EyePlace::Outside || nadir < reach + limb,
            to_sun.angle_between(middle) < reach + radius
                && to_sun.y.clamp(-1.0, 1.0).asin() > -dip - radius,
        ]
    }

    /// Draws into the host's pass, or into one of its own that [`Sky::set_host`] fits. As `Background` it draws nothing
    /// where the view shows neither air nor ground, and no disc where the sun is out of the view or has set.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] when the host's depth has not been set for a sky that reads it.
    pub fn composite(&self, pass: &mut wgpu::RenderPass<'_>) -> Result<Work, Error> {
        if self.composition != SkyComposition::Background && self.host.is_none() {
            return Err(Error::OutOfDomain {
                name: "host".to_owned(),
                value: "not set".to_owned(),
                domain: "what `Sky::set_host` has been given".to_owned(),
            });
        }
        let mut work = Work::default();
        // `prepare` has made it; the first is there from the start.
        let Some(Pass { sky, disc }) = &self.passes[self.place as usize] else {
            return Ok(work);
        };
        let layers = [(Some(sky), 3), (disc.as_ref(), 6)];
        for ((layer, vertices), shown) in layers.into_iter().zip(self.shows) {
            let Some(layer) = layer.filter(|_| shown) else {
                continue;
            };
            pass.set_pipeline(&layer.pipeline);
            for (group, index) in layer.groups.iter().chain(&self.host).zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.draw(0..vertices, 0..1);
            work.draws += 1;
        }
        Ok(work)
    }
}

/// Whether a host's picture can be read as depth, or as colour.
pub(crate) fn check_host(name: &str, view: &wgpu::TextureView, depth: bool) -> Result<(), Error> {
    let texture = view.texture();
    let format = texture.format();
    let kind = if depth {
        format.has_depth_aspect()
    } else {
        matches!(
            format.sample_type(None, None),
            Some(wgpu::TextureSampleType::Float { .. })
        )
    };
    let read = texture
        .usage()
        .contains(wgpu::TextureUsages::TEXTURE_BINDING);
    if kind
        && read
        && texture.sample_count() == 1
        && texture.dimension() == wgpu::TextureDimension::D2
    {
        return Ok(());
    }
    Err(fault(
        name,
        format!(
            "{:?} {format:?}, {} samples, {:?}",
            texture.dimension(),
            texture.sample_count(),
            texture.usage()
        ),
        if depth {
            "a flat depth texture of one sample with the usage TEXTURE_BINDING"
        } else {
            "a flat float texture of one sample with the usage TEXTURE_BINDING"
        },
    ))
}

fn fault(name: &str, value: String, domain: &str) -> Error {
    Error::OutOfDomain {
        name: name.to_owned(),
        value,
        domain: domain.to_owned(),
    }
}

/// What the draws get of a view.
fn draw_block(
    targets: &Targets,
    reads_depth: bool,
    colour: [f64; 3],
    view: &View,
) -> Result<DrawBlock, Error> {
    let parallel = targets.projection == Projection::Orthographic;
    let projection = view.projection;
    let (scale, offset) = (projection.z_axis.z, projection.w_axis.z);
    let rotate = |v: Vec3| view.world_from_view.transform_vector3(v);
    let [middle, right, up] = if parallel {
        let inverse = projection.inverse();
        let at = |x: f32, y: f32| {
            let p = inverse * Vec4::new(x, y, 0.0, 1.0);
            let p = p.truncate() / p.w;
            Vec3::new(p.x, p.y, 0.0)
        };
        let middle = at(0.0, 0.0);
        let all = [middle, at(1.0, 0.0) - middle, at(0.0, 1.0) - middle];
        if projection.z_axis.w != 0.0 || scale == 0.0 || !all.iter().all(|v| v.is_finite()) {
            return Err(Error::OutOfDomain {
                name: "view.projection".to_owned(),
                value: format!("{:?}", projection.to_cols_array()),
                domain: "an orthographic projection, as the targets say".to_owned(),
            });
        }
        all.map(rotate)
    } else {
        view.rays()?
    };
    // Depth falls with distance when it is reversed.
    let falls = if parallel { scale > 0.0 } else { offset > 0.0 };
    if reads_depth && falls != (targets.depth != Depth::Normal) {
        return Err(Error::OutOfDomain {
            name: "view.projection".to_owned(),
            value: format!("{:?}", projection.to_cols_array()),
            domain: format!("one with the depth of the targets, {:?}", targets.depth),
        });
    }
    let colour = Vec3::from_array(colour.map(|c| c as f32));
    Ok(DrawBlock {
        ray_middle: middle.to_array(),
        far_depth: match targets.depth {
            Depth::Normal => 1.0,
            Depth::Reversed | Depth::ReversedInfinite => 0.0,
        },
        ray_right: right.to_array(),
        depth_numerator: if parallel { -1.0 / scale } else { offset },
        ray_up: up.to_array(),
        depth_offset: if parallel { offset } else { scale },
        forward: rotate(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z).to_array(),
        exposure: view.exposure,
        sun_irradiance: (view.sun.irradiance * colour).to_array(),
        parallel: u32::from(parallel),
        ..DrawBlock::ZERO
    })
}

#[cfg(test)]
mod tests {
    use glam::camera::rh::proj::directx;
    use glam::{DVec4, Mat4};

    use super::*;

    /// The place of a depth at clip coordinates, as the program rebuilds it, in `f64` or rounded at every step.
    fn rebuilt(block: &DrawBlock, [x, y]: [f64; 2], depth: f64, round: fn(f64) -> f64) -> [f64; 3] {
        let numerator = f64::from(block.depth_numerator);
        let offset = f64::from(block.depth_offset);
        std::array::from_fn(|k| {
            let [middle, right, up, forward] = [
                block.ray_middle,
                block.ray_right,
                block.ray_up,
                block.forward,
            ]
            .map(|v| f64::from(v[k]));
            let ray = round(round(middle + round(x * right)) + round(y * up));
            if block.parallel == 1 {
                let along = round(round(depth - offset) * numerator);
                return round(ray + round(forward * along));
            }
            round(ray * round(numerator / round(depth + offset)))
        })
    }

    #[test]
    fn places_come_back_from_depth() {
        let (aspect, far) = (1.7_f32, 2e5_f32);
        let turn = Mat4::from_rotation_y(0.7) * Mat4::from_rotation_x(-0.3);
        // With a near plane of 0.1 m; depth that is not reversed resolves so far only from a near plane of 2 km on.
        for (depth, parallel, near, rounds) in [
            (Depth::Normal, false, 0.1, false),
            (Depth::Normal, false, 2000.0, true),
            (Depth::Reversed, false, 0.1, true),
            (Depth::ReversedInfinite, false, 0.1, true),
            (Depth::Normal, true, 0.1, true),
            (Depth::Reversed, true, 0.1, true),
        ] {
            let (from, to) = match depth {
                Depth::Normal => (near, far),
                _ => (far, near),
            };
            let view = View {
                world_from_view: turn,
                projection: match (parallel, depth) {
                    (true, _) => directx::orthographic(-3e4, 3e4, -2e4, 2e4, from, to),
                    (_, Depth::ReversedInfinite) => {
                        directx::perspective_infinite_reverse(1.0, aspect, near)
                    }
                    _ => directx::perspective(1.0, aspect, from, to),
                },
                ..Default::default()
            };
            let targets = Targets {
                depth,
                projection: if parallel {
                    Projection::Orthographic
                } else {
                    Projection::Perspective
                },
                ..Default::default()
            };
            let block = draw_block(&targets, true, [1.0; 3], &view).unwrap();
            let (project, world) = (view.projection.as_dmat4(), turn.as_dmat4());
            let (mut exact, mut rounded) = (0.0_f64, 0.0_f64);
            for i in 0..2000_u32 {
                let share = |k: u32| f64::from((i * k) % 997) / 997.0;
                let d = f64::from(near) * f64::from(far / near).powf(share(7));
                let half = if parallel {
                    [3e4, 2e4]
                } else {
                    [0.9 * d, 0.5 * d]
                };
                let at = DVec4::new(
                    (2.0 * share(31) - 1.0) * half[0],
                    (2.0 * share(57) - 1.0) * half[1],
                    -d,
                    1.0,
                );
                let clip = project * at;
                let (xy, z) = ([clip.x / clip.w, clip.y / clip.w], clip.z / clip.w);
                let truth = (world * at).truncate().to_array();
                let off = |found: [f64; 3]| {
                    (0..3)
                        .map(|k| (found[k] - truth[k]).abs())
                        .fold(0.0, f64::max)
                        / f64::from(far)
                };
                exact = exact.max(off(rebuilt(&block, xy, z, |v| v)));
                let single = |v: f64| f64::from(v as f32);
                rounded = rounded.max(off(rebuilt(&block, xy, single(z), single)));
            }
            println!(
                "{depth:?}, parallel {parallel}, near {near}: {exact:.1e}, rounded {rounded:.1e}"
            );
            assert!(exact < 1e-5);
            assert!(!rounds || rounded < 1e-5);
        }
    }
}
