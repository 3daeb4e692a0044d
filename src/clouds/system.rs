//! A layer of clouds over a host's picture.

use glam::Vec3;

use super::order_table::{OrderTable, Source, check_cells};
use super::tile::{CLEAR, Tile, ahead_of, clear_tile, slant};
use super::window::{WindowQuality, Windows};
use super::{AirLights, CloudDeck, Orders, fault};
use crate::atmosphere::{Atmosphere, SkyTables};
use crate::error::Error;
use crate::landscape::{Depth, Projection, Resources, Targets, Work, output_of};
use crate::program::{Pipeline, PipelineOptions, ProgramSet};
use crate::programs::blocks::CloudDraw as DrawBlock;
use crate::settings::Preset;
use crate::view::View;

/// Light that falls on the clouds, in the picture's own unit. A host that has an atmosphere takes it from its `SkyQuery`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudLights {
    /// Irradiance of the sun on a plane across its direction at the clouds' altitude, behind the air; 0 when it has set there.
    pub sun: Vec3,
    /// Mean radiance that comes from above to the layer's upper sphere, without the sun's own.
    pub above: Vec3,
    /// Mean radiance that comes from below to its lower sphere, of ground and air.
    pub below: Vec3,
}

impl CloudLights {
    /// Lights of a clear day for a sun of this irradiance.
    pub fn clear(sun: Vec3) -> CloudLights {
        CloudLights {
            sun: sun * Vec3::new(1.0, 0.95, 0.88),
            above: sun * Vec3::new(0.02, 0.033, 0.059),
            below: sun * Vec3::new(0.02, 0.023, 0.025),
        }
    }

    /// Lights under an air, for a sun of this irradiance at the top of it.
    pub fn under(air: &AirLights, sun: Vec3) -> CloudLights {
        CloudLights {
            sun: sun * air.sun,
            above: sun * air.above,
            below: sun * air.below,
        }
    }
}

/// Format of a layer in half as many pixels a side.
const COARSE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// How finely a layer is baked and marched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudQuality {
    /// Texels of the tile's edge, a multiple of 64 in [64, 1024].
    pub texels: u32,
    /// Texels of the edge of the tile that the first frame is drawn with, a multiple of 64 in [64, 1024].
    pub first_texels: u32,
    /// Levels of the tile, in [2, 256].
    pub levels: u32,
    /// Steps along a ray that is eight times as long in the layer as the layer is thick, in [1, 4096]: their number goes with the root of the length, up to
    /// four times this.
    pub steps: u32,
    /// The march ends when less is left, in [0, 0.1].
    pub min_transmittance: f32,
    /// Whether a second tile of full size is kept, in which a new one is baked while the other is shown, for a sun that moves; without it the
    /// first frame's tile takes its turn.
    pub second_tile: bool,
    /// Frames that a new tile takes while the first is shown, at least 1.
    pub frames: u32,
    /// Cells along the edge of the table of light of all orders, a multiple of 32 in [32, 128], and along its height, in [2, 64].
    pub cells: [u32; 2],
    /// Of a layer that does not repeat near enough ([`CloudDeck::is_windowed`]): in place of a tile windows about the eye, each twice as wide as the one before.
    pub windows: WindowQuality,
    /// Whether texels of the tile have 16 bits a number instead of 8: twice the memory, for errors below a hundredth.
    pub wide: bool,
    /// Whether the march is drawn for half as many pixels a side, by [`Clouds::encode_volumes`], and laid over the picture by the four around each pixel whose rays end as far away.
    pub half: bool,
    /// Whether marches start at places that a mask of the pixels shifts: noise without coarse grain, where too few steps would show bands. Projections that a host shifts from frame to
    /// frame, as those of [`Temporal`](crate::temporal::Temporal), shift the mask too, so that joined frames are those of many steps.
    pub jitter: bool,
}

impl CloudQuality {
    /// That of a preset: `low`, `medium` and the rest.
    pub fn of(preset: &Preset) -> CloudQuality {
        let (texels, first_texels, levels, steps, cell_levels) = match preset {
            Preset::Low => (128, 64, 32, 24, 8),
            Preset::Medium => (192, 128, 64, 48, 8),
            _ => (384, 192, 64, 96, 16),
        };
        CloudQuality {
            texels,
            first_texels,
            levels,
            steps,
            min_transmittance: 1e-3,
            second_tile: true,
            frames: 30,
            cells: [32, cell_levels],
            windows: WindowQuality::of(preset),
            wide: false,
            half: false,
            jitter: false,
        }
    }

    /// That of a preset for frames that [`Temporal`](crate::temporal::Temporal) joins: fewer steps, at places that the frames shift.
    pub fn joined(preset: &Preset) -> CloudQuality {
        let quality = CloudQuality::of(preset);
        CloudQuality {
            steps: quality.steps.min(40),
            jitter: true,
            ..quality
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        for (name, texels) in [("texels", self.texels), ("first_texels", self.first_texels)] {
            if !(64..=1024).contains(&texels) || !texels.is_multiple_of(64) {
                let domain = "a multiple of 64 in [64, 1024]";
                return Err(fault(&format!("quality.{name}"), texels, domain));
            }
        }
        self.windows.check()?;
        for (name, value, low, high) in [
            ("levels", self.levels, 2, 256),
            ("steps", self.steps, 1, 4096),
            ("frames", self.frames, 1, u32::MAX),
        ] {
            if !(low..=high).contains(&value) {
                let domain = format!("in [{low}, {high}]");
                return Err(fault(&format!("quality.{name}"), value, &domain));
            }
        }
        if !(0.0..=0.1).contains(&self.min_transmittance) {
            return Err(fault(
                "quality.min_transmittance",
                self.min_transmittance,
                "in [0, 0.1]",
            ));
        }
        check_cells(self.cells)
    }
}

/// Choices that are made once.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudsOptions {
    /// How finely.
    pub quality: CloudQuality,
    /// The layer.
    pub deck: CloudDeck,
    /// Distance at which rays end (m), in [100, 1e9].
    pub far: f64,
    /// Whether the host's depth buffer hides clouds; [`Clouds::set_host`] tells it.
    pub over_depth: bool,
    /// Whether tile and place are kept up for views that cannot show the layer too, so that [`Clouds::shadow`] is that of every eye. Refused for a layer with windows.
    pub shadows: bool,
    /// The air before the clouds, if they are to show it to eyes within the air; to those above it clouds show none: [`Clouds::set_air`] tells the tables of the sky that it is taken from. The picture below must have its air in it already.
    pub air: Option<Atmosphere>,
    /// Whether another layer shades this one, which [`Clouds::set_above`] tells.
    pub under: bool,
    /// Which light: scattered once, with what comes from sky and ground scattered without shadows; or any number of times, of all three.
    pub orders: Orders,
}

impl Default for CloudsOptions {
    /// The layer of the preset `thesis` with the quality of `high`, to 80 km, without a depth buffer or air, light of all orders.
    fn default() -> Self {
        CloudsOptions {
            quality: CloudQuality::of(&Preset::High),
            deck: CloudDeck::default(),
            far: 80_000.0,
            over_depth: false,
            shadows: false,
            air: None,
            under: false,
            orders: Orders::All,
        }
    }
}

/// Draws a layer of clouds, lit by light of all orders, over a host's picture of scene radiance, from below, inside and above.
///
/// ```no_run
/// # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView)
/// # -> Result<(), veduta::Error> {
/// use veduta::clouds::{CloudLights, Clouds, CloudsOptions};
/// let targets = veduta::Targets { color_format: wgpu::TextureFormat::Rgba16Float, ..Default::default() };
/// let mut clouds = Clouds::new(device, veduta::programs(), &targets, &CloudsOptions::default())?;
/// let view = veduta::View::default();
/// // Every frame: the tile is baked only when the sun has moved; wind and flight are free.
/// let work = clouds.prepare(queue, encoder, &view, &CloudLights::clear(view.sun.irradiance))?;
/// println!("{} tiles begun", work.bakes);
/// let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
///     color_attachments: &[Some(wgpu::RenderPassColorAttachment {
///         view: target, depth_slice: None, resolve_target: None,
///         ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
///     })],
///     ..Default::default()
/// });
/// let _ = clouds.composite(&mut pass)?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Clouds {
    deck: CloudDeck,
    quality: CloudQuality,
    far: f64,
    depth: Depth,
    /// As good as none where there are windows.
    tile: Tile,
    /// For a layer that does not repeat near enough.
    windows: Option<Windows>,
    /// Light of many orders; none for single scattering.
    orders: Option<OrderTable>,
    /// For an eye within the air, and where air is shown for one above it.
    pipelines: Vec<wgpu::RenderPipeline>,
    /// Whether the eye is above the air.
    outside: bool,
    /// What lays a picture of half as many pixels a side over the host's.
    half: Option<Half>,
    layouts: Vec<wgpu::BindGroupLayout>,
    view: wgpu::Buffer,
    view_group: wgpu::BindGroup,
    held: Vec<u8>,
    host: Option<wgpu::TextureView>,
    over_depth: bool,
    /// Whether tile and place are kept up for shadows.
    shadows: bool,
    /// Flags of the program for the air that is shown; none without.
    air_features: Option<&'static [&'static str]>,
    /// The tables of the sky, the colour of its sun and the thickness of the air (m).
    air: Option<(wgpu::BindGroup, Vec3, f64)>,
    /// The layer that shades this one.
    above: Option<Above>,
    /// One for each tile.
    groups: Vec<wgpu::BindGroup>,
    /// Which tile is shown, and for which sun it was baked; none before the first.
    shown: Option<(usize, Vec3)>,
    /// The sun that the other tile is being baked for, and how many parts it has.
    coming: Option<(Vec3, u32)>,
    /// Share of a part of it that the frames so far have left.
    owed: f64,
    /// The sun of the last frame.
    last_sun: Option<Vec3>,
    /// Whether the first tile was baked in this frame.
    fresh: bool,
    /// Fields of `CloudTile` for the last eye.
    placed: Option<[f32; 13]>,
    /// Way in the clear (m).
    clear: f64,
    seen: bool,
}

/// A layer that shades another.
#[derive(Debug)]
struct Above {
    layer: wgpu::Buffer,
    /// Bound where there is none.
    clear: wgpu::TextureView,
    /// Its tile; none for the clear one.
    tile: Option<wgpu::TextureView>,
    /// The fields of `CloudTile` that the buffer holds; none before the first.
    held: Option<[f32; 13]>,
}

/// What a layer in half as many pixels a side is laid over a picture with.
#[derive(Debug)]
struct Half {
    pipeline: wgpu::RenderPipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    view_group: wgpu::BindGroup,
    /// The layer, and what reads it; none before a size is told.
    coarse: Option<(wgpu::TextureView, wgpu::BindGroup)>,
    /// Pixels a side of the layer for each of the host's picture.
    share: [f32; 2],
}

/// What a host's shader needs for the shadow of a layer: `cloud_shadow` of the module `veduta::clouds::tile`.
#[derive(Debug, Clone, Copy)]
pub struct CloudShadow<'a> {
    /// The tile, `texture_3d<f32>`. Another one after some calls of [`Clouds::prepare`] while the sun moves: bind it anew then.
    pub tile: &'a wgpu::TextureView,
    /// Its sampler, which filters.
    pub sampler: &'a wgpu::Sampler,
    /// The fields of `CloudTile` in their order, for positions relative to the eye of the last [`Clouds::prepare`]; anew after each.
    pub layer: [f32; 13],
}

impl Clouds {
    /// Builds pipelines and makes room for tiles.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for targets that do not hold scene radiance, for options; the faults of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &CloudsOptions,
    ) -> Result<Clouds, Error> {
        targets.check_on(device)?;
        options.deck.check()?;
        options.quality.check()?;
        if output_of(targets.color_format)? != 2.0 || targets.color_format.components() < 3 {
            let value = format!("{:?}", targets.color_format);
            return Err(fault(
                "targets.color_format",
                value,
                "a float format: clouds are laid over scene radiance",
            ));
        }
        let wide = matches!(
            targets.color_format,
            wgpu::TextureFormat::Rgba32Float | wgpu::TextureFormat::Rg32Float
        );
        if wide
            && !device
                .features()
                .contains(wgpu::Features::FLOAT32_BLENDABLE)
        {
            return Err(fault(
                "targets.color_format",
                format!("{:?}", targets.color_format),
                "a format that blends: of 32 bits only on a device with FLOAT32_BLENDABLE",
            ));
        }
        if targets.projection == Projection::Orthographic {
            return Err(fault("targets.projection", "Orthographic", "Perspective"));
        }
        if options.over_depth && targets.sample_count != 1 {
            return Err(fault(
                "targets.sample_count",
                targets.sample_count,
                "1 over a depth buffer",
            ));
        }
        if !(100.0..=1e9).contains(&options.far) {
            return Err(fault("options.far", options.far, "in [100, 1e9] m"));
        }
        let quality = options.quality;
        let mut texels = vec![quality.first_texels, quality.texels];
        if quality.second_tile {
            texels.push(quality.texels);
        }
        let windowed = options.deck.is_windowed() && !options.deck.is_empty();
        if windowed && options.shadows {
            return Err(fault(
                "options.shadows",
                true,
                "false for a layer of more than 4 doublings of the period: a host has no program that reads windows",
            ));
        }
        if windowed && options.deck.mapped().is_some() {
            return Err(fault(
                "options.deck.shape.map",
                "a map",
                "none for a layer of more than 4 doublings of the period",
            ));
        }
        let windows = if windowed {
            Some(Windows::new(
                device,
                programs,
                &options.deck,
                &quality,
                options.far,
            )?)
        } else {
            None
        };
        // What shows nothing has no tile worth its name, nor what has windows.
        let (texels, levels) = if options.deck.is_empty() || windowed {
            (vec![64, 64], 2)
        } else {
            (texels, quality.levels)
        };
        let tile = Tile::new(
            device,
            programs,
            &options.deck,
            &texels,
            levels,
            quality.wide,
        )?;
        let all = options.orders == Orders::All;
        let orders = if all && !options.deck.is_empty() {
            let source = match &windows {
                Some(windows) => windows.lit_source(),
                None => Source {
                    views: &tile.views,
                    sampler: &tile.sampler,
                    levels: tile.levels,
                    least: tile.least,
                    window: None,
                },
            };
            let table = OrderTable::new(device, programs, &options.deck, &source, quality.cells)?;
            Some(table)
        } else {
            None
        };
        let mut features = Vec::new();
        if windowed {
            features.push("CLOUD_WINDOW");
        }
        if options.over_depth {
            features.push("CLOUD_OVER_DEPTH");
        }
        if orders.is_some() {
            features.push("CLOUD_ORDERS");
        }
        if options.under {
            features.push("CLOUD_ABOVE");
        }
        let air_features = options.air.as_ref().map(Atmosphere::features);
        if let (Some(air), Some(own)) = (&options.air, air_features) {
            air.check()?;
            features.push("CLOUD_AIR");
            features.extend(own);
        }
        let over = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::SrcAlpha,
            operation: wgpu::BlendOperation::Add,
        };
        let keep = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::Zero,
            dst_factor: wgpu::BlendFactor::SrcAlpha,
            operation: wgpu::BlendOperation::Add,
        };
        let program = programs.get("cloud_layer", &features)?;
        // From above the air the clouds are drawn without it: llvmpipe 22.3 falls over the program for such an eye.
        let bare: Vec<&str> = features
            .iter()
            .copied()
            .filter(|f| !matches!(*f, "CLOUD_AIR" | "AIR_EIGHT_LANES"))
            .collect();
        let bare = programs.get("cloud_layer", &bare)?;
        let laid_features: &[&str] = if options.over_depth {
            &["CLOUD_UPSAMPLE", "CLOUD_OVER_DEPTH"]
        } else {
            &["CLOUD_UPSAMPLE"]
        };
        // The march, or what lays a coarse one over the picture.
        let ready = |march: bool, outside: bool| {
            let mut constants = Vec::new();
            if march {
                constants = vec![
                    ("CLOUD_STEPS", f64::from(quality.steps)),
                    ("CLOUD_MASK", f64::from(u8::from(quality.jitter))),
                ];
                if options.over_depth {
                    constants.push(("CLOUD_HALF", f64::from(u8::from(quality.half))));
                }
            }
            // A coarse picture holds nothing but the layer.
            let coarse = march && quality.half;
            let options = PipelineOptions {
                targets: &[Some(wgpu::ColorTargetState {
                    format: if coarse { COARSE } else { targets.color_format },
                    blend: (!coarse).then_some(wgpu::BlendState {
                        color: over,
                        alpha: keep,
                    }),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
                depth_stencil: targets
                    .depth_format
                    .filter(|_| !options.over_depth && !coarse)
                    .map(|format| wgpu::DepthStencilState {
                        format,
                        depth_write_enabled: Some(false),
                        depth_compare: Some(wgpu::CompareFunction::Always),
                        stencil: Default::default(),
                        bias: Default::default(),
                    }),
                sample_count: if coarse { 1 } else { targets.sample_count },
                constants: &constants,
                ..Default::default()
            };
            let ready = if march {
                let program = if outside { bare } else { program };
                program.pipeline(device, &options)?
            } else {
                programs
                    .get("cloud_layer", laid_features)?
                    .pipeline(device, &options)?
            };
            match ready.pipeline {
                Pipeline::Render(pipeline) => Ok((pipeline, ready.bind_group_layouts)),
                Pipeline::Compute(_) => Err(Error::MissingStage {
                    program: "cloud_layer".to_owned(),
                }),
            }
        };
        let (inside, layouts) = ready(true, false)?;
        let mut pipelines = vec![inside];
        if air_features.is_some() {
            pipelines.push(ready(true, true)?.0);
        }
        let view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta cloud view"),
            size: DrawBlock::SIZE as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let above = options.under.then(|| Above {
            layer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta clouds above"),
                size: 64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            clear: clear_tile(device),
            tile: None,
            held: None,
        });
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta cloud view"),
            layout: &layouts[0],
            entries: &[
                Some((0, &view)),
                orders.as_ref().map(|table| (1, &table.weights)),
                windows.as_ref().map(|windows| (2, &windows.uniform)),
                above.as_ref().map(|above| (3, &above.layer)),
            ]
            .into_iter()
            .flatten()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect::<Vec<_>>(),
        });
        let half = if quality.half {
            let (pipeline, layouts) = ready(false, false)?;
            Some(Half {
                view_group: device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("veduta cloud view"),
                    layout: &layouts[0],
                    entries: &[wgpu::BindGroupEntry {
                        binding: 0,
                        resource: view.as_entire_binding(),
                    }],
                }),
                pipeline,
                layouts,
                coarse: None,
                share: [0.5; 2],
            })
        } else {
            None
        };
        let mut clouds = Clouds {
            clear: options.deck.clear_way(),
            deck: options.deck.clone(),
            quality,
            far: options.far,
            depth: targets.depth,
            tile,
            windows,
            orders,
            pipelines,
            outside: false,
            half,
            layouts,
            view,
            view_group,
            held: Vec::new(),
            host: None,
            over_depth: options.over_depth,
            shadows: options.shadows,
            air_features,
            above,
            air: None,
            groups: Vec::new(),
            shown: None,
            coming: None,
            owed: 0.0,
            last_sun: None,
            fresh: false,
            placed: None,
            seen: true,
        };
        if !options.over_depth {
            clouds.bind(device);
        }
        Ok(clouds)
    }

    fn bind(&mut self, device: &wgpu::Device) {
        let (views, sampler) = match &self.windows {
            Some(windows) => (std::slice::from_ref(&windows.view), &windows.sampler),
            None => (&self.tile.views[..], &self.tile.sampler),
        };
        self.groups = views
            .iter()
            .map(|view| {
                let mut entries = vec![
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: wgpu::BindingResource::Sampler(sampler),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: wgpu::BindingResource::TextureView(view),
                    },
                ];
                if let Some(depth) = &self.host {
                    entries.push(wgpu::BindGroupEntry {
                        binding: 2,
                        resource: wgpu::BindingResource::TextureView(depth),
                    });
                }
                if let Some(table) = &self.orders {
                    entries.push(wgpu::BindGroupEntry {
                        binding: 3,
                        resource: wgpu::BindingResource::TextureView(&table.view),
                    });
                    if let Some(mean) = table.mean_view() {
                        entries.push(wgpu::BindGroupEntry {
                            binding: 5,
                            resource: wgpu::BindingResource::TextureView(mean),
                        });
                    }
                }
                if let Some(above) = &self.above {
                    let tile = above.tile.as_ref().unwrap_or(&above.clear);
                    entries.push(wgpu::BindGroupEntry {
                        binding: 6,
                        resource: wgpu::BindingResource::TextureView(tile),
                    });
                }
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("veduta clouds"),
                    layout: &self.layouts[1],
                    entries: &entries,
                })
            })
            .collect();
    }

    /// Tells the host's depth buffer, before which clouds are drawn. Again after each change of size.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for clouds that were made without `over_depth`.
    pub fn set_host(
        &mut self,
        device: &wgpu::Device,
        depth: &wgpu::TextureView,
    ) -> Result<(), Error> {
        if !self.over_depth {
            return Err(fault(
                "options.over_depth",
                false,
                "true for clouds that are told a depth buffer",
            ));
        }
        self.host = Some(depth.clone());
        self.bind(device);
        if self.half.is_some() {
            let texture = depth.texture();
            self.set_size(device, [texture.width(), texture.height()])?;
        }
        Ok(())
    }

    /// Tells width and height of the host's picture to clouds of [`CloudQuality::half`]; [`Clouds::set_host`] does it by the depth buffer. Again after each change of size.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for clouds without `half`, for a size that the device's textures cannot have, and over a depth buffer that [`Clouds::set_host`] has not told.
    pub fn set_size(&mut self, device: &wgpu::Device, size: [u32; 2]) -> Result<(), Error> {
        let most = device.limits().max_texture_dimension_2d;
        if !size.iter().all(|n| (1..=most).contains(n)) {
            let domain = format!("each in [1, {most}] pixels");
            return Err(fault("size", format!("{size:?}"), &domain));
        }
        if self.over_depth && self.host.is_none() {
            let domain = "a depth buffer, told with `set_host`, which tells the size too";
            return Err(fault("host", "none", domain));
        }
        let Some(half) = &mut self.half else {
            let domain = "true for clouds that are told a size";
            return Err(fault("quality.half", false, domain));
        };
        let target = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("veduta coarse clouds"),
                size: wgpu::Extent3d {
                    width: size[0].div_ceil(2),
                    height: size[1].div_ceil(2),
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: COARSE,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
            .create_view(&Default::default());
        let entries: Vec<_> = self
            .host
            .iter()
            .map(|depth| (2, depth))
            .chain([(4, &target)])
            .map(|(binding, view)| wgpu::BindGroupEntry {
                binding,
                resource: wgpu::BindingResource::TextureView(view),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta coarse clouds"),
            layout: &half.layouts[1],
            entries: &entries,
        });
        half.coarse = Some((target, group));
        half.share = size.map(|n| n.div_ceil(2) as f32 / n as f32);
        Ok(())
    }

    /// Tells the tables of the sky behind the clouds, from which the air before them is taken: up to the mean distance of what is seen of the clouds. Again after a change of
    /// [`SkyTables::set_atmosphere`]. In every frame the sky's `prepare`, for the same view, comes before what is drawn here.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for clouds that were made without `air`, or for air that needs other programs; for tables without the air before things, which a sky as
    /// [`Background`](crate::atmosphere::SkyComposition::Background) does not keep.
    pub fn set_air(&mut self, device: &wgpu::Device, tables: &SkyTables) -> Result<(), Error> {
        let Some(features) = self.air_features else {
            let domain = "given for clouds that are told tables of the air";
            return Err(fault("options.air", "none", domain));
        };
        tables
            .atmosphere()
            .check_features("tables.atmosphere", features)?;
        let (Some(light), Some(depths)) = (tables.aerial(), tables.aerial_depths()) else {
            let domain = "tables of a sky that is composed with the host's depth, or made by `SkyTables::new`";
            return Err(fault("tables.aerial", "none", domain));
        };
        let resources = [
            tables.air().as_entire_binding(),
            tables.eye().as_entire_binding(),
            wgpu::BindingResource::Sampler(tables.sampler()),
            wgpu::BindingResource::TextureView(light),
            wgpu::BindingResource::TextureView(depths),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta air before clouds"),
            layout: &self.layouts[2],
            entries: &entries,
        });
        let colour = tables.atmosphere().sun.colour.map(|c| c as f32);
        let thickness = tables.atmosphere().thickness;
        self.air = Some((group, Vec3::from_array(colour), thickness));
        Ok(())
    }

    /// Tells the shadow of a layer above, with [`CloudsOptions::under`]; none for none. In every frame, after the `prepare` of that layer for the same view, which has
    /// [`CloudsOptions::shadows`] if it may be out of view where its shadow is not. The sun's light that comes straight through it, at the mean distance of what a ray sees of this layer, is the
    /// light that a ray's clouds have, also of all orders: one fetch of its tile a pixel. What it scatters down is the host's to add to [`CloudLights::above`]. A layer below shades nothing.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for clouds that were made without `under`.
    pub fn set_above(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shadow: Option<&CloudShadow<'_>>,
    ) -> Result<Work, Error> {
        let Some(above) = &mut self.above else {
            let domain = "true for clouds that are told a layer above";
            return Err(fault("options.under", false, domain));
        };
        let mut work = Work::default();
        let layer = shadow.map_or(CLEAR, |s| s.layer);
        if above.held != Some(layer) {
            let bytes = layer.map(f32::to_le_bytes).concat();
            queue.write_buffer(&above.layer, 0, &bytes);
            work.writes = 1;
            work.bytes = bytes.len() as u64;
            above.held = Some(layer);
        }
        let tile = shadow.map(|s| s.tile);
        if tile != above.tile.as_ref() {
            above.tile = tile.cloned();
            if !self.groups.is_empty() {
                self.bind(device);
            }
        }
        Ok(work)
    }

    /// Tells a host's own map of the weather, in the place of the layer's: a 2D texture of floats whose first two numbers are coverage and kind, in [0, 1] (others are cut off), over the
    /// extent of the layer's map, which must have one to begin with. All tiles are baked anew, the first in the next frame, and so again after each call: tell a texture that has changed once more.
    /// Where it falls from 1 to 0 from texel to texel no step in the clear passes over it, so that its marches are slower than those of a smooth map of the layer's own.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a layer without a map, and for a texture that cannot be such a map.
    pub fn set_weather(
        &mut self,
        device: &wgpu::Device,
        view: &wgpu::TextureView,
    ) -> Result<(), Error> {
        let Some((_, map)) = self.deck.mapped() else {
            let domain = "given for clouds that are told a map";
            return Err(fault("options.deck.shape.map", "none", domain));
        };
        let texture = view.texture();
        let format = texture.format();
        let kind = format.sample_type(None, None);
        let size = [texture.width(), texture.height()];
        if !matches!(kind, Some(wgpu::TextureSampleType::Float { .. }))
            || format.components() < 2
            || texture.dimension() != wgpu::TextureDimension::D2
            || texture.depth_or_array_layers() != 1
            || texture.sample_count() != 1
            || !texture
                .usage()
                .contains(wgpu::TextureUsages::TEXTURE_BINDING)
            || size.iter().any(|n| *n > 4096)
        {
            let value = format!("{format:?}, {size:?}, {:?}", texture.usage());
            let domain = "a 2D texture of two floats or more with TEXTURE_BINDING, at most 4096 texels a side";
            return Err(fault("view", value, domain));
        }
        let texels = size[0].max(size[1]);
        let extent = self.deck.period() / f64::from(map.repeats(self.deck.period()));
        let steepest = f64::from(texels) / extent;
        self.clear = self.deck.clear_way_under([steepest; 2]);
        let _ = self.tile.set_weather(device, view);
        (self.shown, self.coming) = (None, None);
        Ok(())
    }

    /// What hosts need to shade their own things, for the eye of the last [`Clouds::prepare`]; none before the first, for a layer without clouds, whose shadow is 1 everywhere, and without
    /// [`CloudsOptions::shadows`] for a view that cannot show the layer; none for a layer with windows ([`CloudDeck::is_windowed`]). Straight light alone: what the clouds scatter down is not in it.
    pub fn shadow(&self) -> Option<CloudShadow<'_>> {
        if self.windows.is_some() {
            return None;
        }
        let (shown, _) = self.shown.filter(|_| self.seen || self.shadows)?;
        Some(CloudShadow {
            tile: &self.tile.views[shown],
            sampler: &self.tile.sampler,
            layer: self.placed?,
        })
    }

    /// The layer.
    pub fn deck(&self) -> &CloudDeck {
        &self.deck
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let windows = self.windows.as_ref();
        let parts = self.tile.slots() + windows.map_or(0, Windows::bind_groups);
        let own = u32::from(windows.is_some());
        let tiles = self.groups.len() as u32;
        let orders = self.orders.as_ref().map(OrderTable::holds);
        let (textures, bytes, buffers, groups) = orders.unwrap_or_default();
        let more = u32::from(orders.is_some());
        let air = u32::from(self.air.is_some());
        let coarse = self.half.as_ref().and_then(|half| half.coarse.as_ref());
        let laid = u32::from(self.half.is_some());
        let held = u32::from(coarse.is_some());
        let (map_bytes, mapped) = self.tile.weather();
        let under = u32::from(self.above.is_some());
        let (maps, mapped) = (u32::from(map_bytes > 0), u32::from(mapped));
        let coarse_bytes = coarse.map_or(0, |(view, _)| {
            8 * u64::from(view.texture().width()) * u64::from(view.texture().height())
        });
        Resources {
            pipelines: 2 + self.pipelines.len() as u32 + 5 * more + laid + own,
            bind_groups: parts + 3 + tiles + groups + air + laid + held + mapped,
            bindings: parts
                + 3
                + own
                + more
                + (2 + more + under + u32::from(self.over_depth)) * tiles
                + under
                + 2 * groups
                + 5 * air
                + laid
                + 2 * mapped
                + held * (1 + u32::from(self.over_depth)),
            buffers: self.tile.slots() + 3 + 3 * own + buffers + under,
            buffer_bytes: self.tile.buffer_bytes()
                + windows.map_or(0, Windows::buffer_bytes)
                + DrawBlock::SIZE as u64
                + bytes
                + 64 * u64::from(under),
            textures: self.tile.views.len() as u32 + own + more + held + maps + under,
            texture_bytes: self.tile.texture_bytes()
                + windows.map_or(0, Windows::texture_bytes)
                + textures
                + coarse_bytes
                + map_bytes
                + 4 * u64::from(under),
            samplers: 1 + own,
        }
    }

    /// Uploads what has changed, and bakes: a small tile at first, then shares of one of full size, and of a new one while the sun moves. Nothing is done for clouds that there
    /// are not, and for views that cannot show any.
    ///
    /// # Errors
    /// As [`View::check`]; [`Error::OutOfDomain`] for lights and a projection that does not fit the targets.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        lights: &CloudLights,
    ) -> Result<Work, Error> {
        view.check()?;
        for (name, light) in [
            ("lights.sun", lights.sun),
            ("lights.above", lights.above),
            ("lights.below", lights.below),
        ] {
            if !(light.is_finite() && light.min_element() >= 0.0) {
                return Err(fault(name, light, "finite and at least 0"));
            }
        }
        let [middle, right, up] = view.rays()?;
        let (scale, offset) = (view.projection.z_axis.z, view.projection.w_axis.z);
        if self.over_depth && (offset > 0.0) != (self.depth != Depth::Normal) {
            let value = format!("{:?}", view.projection.to_cols_array());
            let domain = format!("one with the depth of the targets, {:?}", self.depth);
            return Err(fault("view.projection", value, &domain));
        }
        let eye = view.eye.normalized();
        self.seen = !self.deck.is_empty() && self.may_show(eye.altitude(), [middle, right, up]);
        let mut work = Work::default();
        if self.deck.is_empty() || !(self.seen || self.shadows) {
            // The way of the sun meanwhile is not that of a frame.
            if let Some(windows) = &mut self.windows {
                windows.forget_step();
            }
            self.last_sun = None;
            return Ok(work);
        }
        let to_sun = view.sun.to_light.normalize_or(Vec3::Y);
        let before = self.shown;
        let deck = &self.deck;
        if let Some(windows) = &mut self.windows {
            let drift = glam::DVec3::new(deck.wind[0], 0.0, deck.wind[1]) * view.time;
            let moved = view.eye.moved_by(-drift);
            // At night they follow the eye alone.
            let day = lights.sun.max_element() > 0.0 || self.shown.is_none();
            let sun = day.then_some(to_sun);
            self.fresh = windows.advance(queue, encoder, deck, moved, sun, &mut work);
            self.shown = windows.sun().map(|sun| (0, sun));
        } else if lights.sun.max_element() > 0.0 || self.shown.is_none() {
            self.bake(queue, encoder, to_sun, &mut work);
        } else {
            // At night no tile is needed for where the sun goes.
            (self.last_sun, self.fresh) = (None, false);
        }
        if let (Some(table), Some((shown, mut sun))) = (&mut self.orders, self.shown) {
            let mut fresh = self.fresh;
            if let Some(windows) = &mut self.windows {
                let lit = windows.lit(self.quality.cells[0]);
                (fresh, sun) = (lit.fresh, lit.sun);
                table.set_slot(lit.slot);
                if lit.moved {
                    table.renew();
                }
            }
            let swapped = before.is_some_and(|b| b.0 != shown);
            let baked = (shown, sun.to_array());
            table.advance(queue, encoder, baked, fresh, swapped, &mut work);
        }
        let top = self.air.as_ref().map_or(f64::INFINITY, |air| air.2);
        self.outside = eye.altitude() > top;
        let sun = self.shown.map_or(to_sun, |s| s.1);
        let deck = &self.deck;
        let period = deck.period();
        let moved = view.eye.moved_by(-glam::DVec3::new(
            (deck.wind[0] * view.time).rem_euclid(period),
            0.0,
            (deck.wind[1] * view.time).rem_euclid(period),
        ));
        let place = |axis| -> Result<f32, Error> { Ok(moved.lattice(axis, period)?.frac) };
        // What scatters once takes the light around for even.
        let (albedo, above, below) = match &self.orders {
            Some(_) => (1.0, lights.above, lights.below),
            None => {
                let albedo = deck.albedo as f32;
                let around = 0.5 * albedo * (lights.above + lights.below);
                (albedo, around, around)
            }
        };
        let slant = slant(sun.to_array(), deck.lowest_sun(self.tile.levels));
        let block = DrawBlock {
            ray_middle: middle.to_array(),
            eye_altitude: eye.altitude() as f32,
            ray_right: right.to_array(),
            ground_radius: deck.planet_radius as f32,
            ray_up: up.to_array(),
            far: match &self.windows {
                Some(windows) => self.far.min(windows.reach(deck)),
                None => self.far,
            } as f32,
            forward: view
                .world_from_view
                .transform_vector3(Vec3::NEG_Z)
                .normalize_or(Vec3::NEG_Z)
                .to_array(),
            depth_numerator: offset,
            to_sun: to_sun.to_array(),
            depth_offset: scale,
            sun_light: (albedo * lights.sun).to_array(),
            min_transmittance: self.quality.min_transmittance,
            above: above.to_array(),
            below: below.to_array(),
            kept: self.orders.as_ref().map_or(1.0, |table| table.kept),
            extinction: deck.extinction as f32,
            place: [place(0)?, place(2)?],
            shear: slant.shear,
            tiles_per_metre: (1.0 / period) as f32,
            bottom: deck.bottom as f32,
            thickness: deck.thickness as f32,
            levels: self.quality.levels as f32,
            g_forward: deck.g_forward as f32,
            g_backward: deck.g_backward as f32,
            backward_share: deck.backward_share as f32,
            sky_depth: if self.depth == Depth::Normal {
                1.0
            } else {
                0.0
            },
            clear: self.clear as f32,
            least: self.tile.least,
            // The same for one projection, and as good as any for each of those that frames are shifted by.
            start: if self.quality.jitter {
                let [x, y] = [view.projection.z_axis.x, view.projection.z_axis.y];
                (12_345.68 * x + 7654.321 * y)
                    .rem_euclid(1.0)
                    .min(0.999_999)
            } else {
                0.0
            },
            coarse: self.half.as_ref().map_or([0.5; 2], |half| half.share),
            air_light: self
                .air
                .as_ref()
                .map_or(Vec3::ZERO, |(_, colour, _)| view.sun.irradiance * colour)
                .to_array(),
            ..Default::default()
        };
        self.placed = Some([
            block.place[0],
            block.place[1],
            block.shear[0],
            block.shear[1],
            slant.sunward[0],
            slant.sunward[1],
            block.tiles_per_metre,
            block.bottom,
            block.thickness,
            block.levels,
            block.extinction,
            block.clear,
            block.least,
        ]);
        let bytes = block.to_bytes().to_vec();
        if let Some(above) = self.above.as_mut().filter(|above| above.held.is_none()) {
            queue.write_buffer(&above.layer, 0, &CLEAR.map(f32::to_le_bytes).concat());
            above.held = Some(CLEAR);
            work.writes += 1;
        }
        if bytes != self.held {
            queue.write_buffer(&self.view, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            self.held = bytes;
        }
        Ok(work)
    }

    /// Brings the tiles up to a sun.
    fn bake(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        to_sun: Vec3,
        work: &mut Work,
    ) {
        self.fresh = false;
        let step = self.last_sun.map_or(Vec3::ZERO, |last| to_sun - last);
        self.last_sun = Some(to_sun);
        // A sun that jumps by more than ten degrees is begun anew.
        self.shown = self.shown.filter(|s| (to_sun - s.1).length() < 0.17);
        if self.shown.is_none() {
            self.coming = None;
        }
        // What is being baked for a sun that has not come.
        self.coming = self.coming.filter(|c| (to_sun - c.0).length() < 0.17);
        let Some((shown, baked_for)) = self.shown else {
            for part in 0..self.tile.parts(0) {
                add(
                    work,
                    self.tile
                        .bake(queue, encoder, &self.deck, to_sun.to_array(), 0, part),
                );
            }
            work.bakes += 1;
            self.shown = Some((0, to_sun));
            self.fresh = true;
            return;
        };
        let other = match (shown, self.tile.views.len()) {
            (1, 3) => 2,
            (1, _) => 0,
            _ => 1,
        };
        if self.coming.is_none() {
            // A sun within a tenth of a minute of arc is the same.
            if shown > 0 && (to_sun - baked_for).length() < 3e-5 {
                return;
            }
            // The new tile is shown for as long as the one after it takes: it is baked for the middle of that time.
            let taken = self.frames_of(to_sun) as f32;
            self.coming = Some((ahead_of(to_sun, step, 1.5 * taken), 0));
            self.owed = 0.0;
            work.bakes += 1;
        }
        let parts = self.tile.parts(other);
        let frames = self.frames_of(self.coming.map_or(to_sun, |c| c.0));
        self.owed += f64::from(parts) / frames;
        // By a hair more than whole, so that sums that should be whole are.
        let share = (self.owed + 1e-6).floor();
        self.owed -= share;
        let share = share as u32;
        if let Some((sun, done)) = &mut self.coming {
            for part in *done..(*done + share).min(parts) {
                add(
                    work,
                    self.tile
                        .bake(queue, encoder, &self.deck, sun.to_array(), other, part),
                );
            }
            *done += share;
            if *done >= parts {
                self.shown = Some((other, *sun));
                self.coming = None;
            }
        }
    }

    /// Frames that a tile takes: the more, the dearer it is for a low sun.
    fn frames_of(&self, to_sun: Vec3) -> f64 {
        f64::from(self.quality.frames) * self.tile.cost(&self.deck, to_sun.to_array())
    }

    /// Whether a ray of the picture can meet the layer.
    fn may_show(&self, altitude: f64, [middle, right, up]: [Vec3; 3]) -> bool {
        let axis = middle.normalize_or(Vec3::NEG_Z);
        let cosine = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .iter()
            .map(|[x, y]| (middle + *x * right + *y * up).normalize_or(axis).dot(axis))
            .fold(1.0, f32::min);
        let wide = f64::from(cosine.clamp(-1.0, 1.0)).acos() + 1e-4;
        let pitch = f64::from(axis.y.clamp(-1.0, 1.0)).asin();
        let radius = self.deck.planet_radius;
        let top = self.deck.bottom + self.deck.thickness;
        // How far below level a sphere's edge is seen.
        let dip = |level: f64| ((radius + level) / (radius + altitude.max(level))).acos();
        if altitude > top {
            pitch - wide <= -dip(top)
        } else if altitude < self.deck.bottom {
            // Below the horizon there is ground.
            pitch + wide >= -dip(0.0_f64.min(altitude))
        } else {
            true
        }
    }

    /// Draws the layer in half as many pixels a side, for [`CloudQuality::half`]: after the host's things stand in the depth buffer, and before the pass of [`Clouds::composite`].
    /// Nothing is done for other clouds.
    ///
    /// # Errors
    /// As [`Clouds::composite`].
    pub fn encode_volumes(&self, encoder: &mut wgpu::CommandEncoder) -> Result<Work, Error> {
        let Some(half) = self.half.as_ref().filter(|_| self.seen) else {
            return Ok(Work::default());
        };
        let Some((target, _)) = &half.coarse else {
            return Err(fault("size", "none", "told with `set_size` or `set_host`"));
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("veduta coarse clouds"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        self.march(&mut pass)
    }

    /// Lays the clouds over what the pass holds: radiance times transmittance, plus light. Clouds over a depth buffer must be drawn in a pass that does not
    /// write it.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] when a depth buffer is needed and [`Clouds::set_host`] has told none, or tables of the air and [`Clouds::set_air`] has told none.
    pub fn composite(&self, pass: &mut wgpu::RenderPass<'_>) -> Result<Work, Error> {
        if !self.seen {
            return Ok(Work::default());
        }
        let Some(half) = &self.half else {
            return self.march(pass);
        };
        let Some((_, coarse)) = &half.coarse else {
            return Err(fault("size", "none", "told with `set_size` or `set_host`"));
        };
        pass.set_pipeline(&half.pipeline);
        pass.set_bind_group(0, &half.view_group, &[]);
        pass.set_bind_group(1, coarse, &[]);
        pass.draw(0..3, 0..1);
        Ok(Work {
            draws: 1,
            ..Work::default()
        })
    }

    /// Draws the march.
    fn march(&self, pass: &mut wgpu::RenderPass<'_>) -> Result<Work, Error> {
        let shown = self.shown.map_or(0, |s| s.0);
        let Some(group) = self.groups.get(shown) else {
            return Err(fault(
                "host",
                "none",
                "a depth buffer, told with `set_host`",
            ));
        };
        if self.air_features.is_some() && self.air.is_none() {
            let domain = "tables of the sky, told with `set_air`";
            return Err(fault("air", "none", domain));
        }
        pass.set_pipeline(&self.pipelines[usize::from(self.outside)]);
        pass.set_bind_group(0, &self.view_group, &[]);
        pass.set_bind_group(1, group, &[]);
        if let Some((air, ..)) = self.air.as_ref().filter(|_| !self.outside) {
            pass.set_bind_group(2, air, &[]);
        }
        pass.draw(0..3, 0..1);
        Ok(Work {
            draws: 1,
            ..Work::default()
        })
    }
}

fn add(work: &mut Work, more: Work) {
    work.dispatches += more.dispatches;
    work.writes += more.writes;
    work.bytes += more.bytes;
}
