//! The ground in a host's own pass, with its depth.

use glam::Vec3;

use super::clipmap::{Clipmap, ClipmapOptions, Gaze, Searched, group, nearest_ground};
use super::cloud_shade::{CLOUD_BLOCK, CLOUD_BYTES, CloudShade};
use super::field::field_kind;
use super::ground::Prepared;
use super::land::Land;
use crate::clouds::CloudShadow;
use crate::error::Error;
use crate::landscape::{Depth, Projection, Resources, Targets, Work, output_of};
use crate::program::{Pipeline, PipelineOptions, ProgramSet};
use crate::programs::blocks::{Field as FieldBlock, Rock as RockBlock, TerrainView as ViewBlock};
use crate::settings::{Preset, Settings};
use crate::temporal::TemporalOptions;
use crate::view::{View, WorldPos};

/// Irradiances on the ground, in the picture's own unit. A host that has an atmosphere takes them [from it](TerrainLights::from_sky).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainLights {
    /// Of the sun on a plane across its direction, behind the air.
    pub sun: Vec3,
    /// Of the sky on level ground.
    pub sky: Vec3,
    /// Of light from the ground, on a plane that faces away from the sun.
    pub bounce: Vec3,
}

impl TerrainLights {
    /// Checks every light.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the light, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        for (name, light) in [
            ("lights.sun", self.sun),
            ("lights.sky", self.sky),
            ("lights.bounce", self.bounce),
        ] {
            if !(light.is_finite() && light.min_element() >= 0.0) {
                return Err(Error::OutOfDomain {
                    name: name.to_owned(),
                    value: light.to_string(),
                    domain: "finite and at least 0".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Lights of a clear day for a sun of this irradiance, as in the preset `thesis`.
    pub fn clear(sun: Vec3) -> TerrainLights {
        TerrainLights {
            sun: sun * Vec3::new(1.0, 0.9, 0.75),
            sky: sun * Vec3::new(0.05, 0.08, 0.13),
            bounce: sun * Vec3::new(0.13, 0.11, 0.09),
        }
    }
}

/// Choices that are made once.
#[derive(Debug, Clone, PartialEq)]
pub struct TerrainOptions {
    /// The quality. Of its keys these are read: CLIP_STEPS, CLIP_TEXELS, CLIP_WIDTH, REFINE_STEPS, SEARCH_STEPS and TEXTURE_LOW_QUALITY on the plane, GLOBE_STEPS and GLOBE_STEPS_SHADOW over a ball; all others are those of
    /// other systems, and of the landscape's own march.
    pub preset: Preset,
    /// The ground.
    pub land: Land,
    /// Distance at which rays end (m), in [100, 4e6]; to 1e9 where the domain is `Sphere`.
    pub far: f64,
    /// Sectors in which the horizons around a place take light off the sky (ambient occlusion), in [0, 16]; 0 leaves all of it. Over a ball
    /// they are looked for in the field itself, which costs six heights a sector and pixel.
    pub sky_sectors: u32,
    /// Texels of a side of each level of baked heights: 128, 256, 512 or 1024. A texel is about as wide as a pixel where it is used when this is 3.5 over the angle of a pixel. 0 leaves it to the
    /// preset's CLIP_TEXELS, 512. Where they are finer than these, rays take as many more steps. Nothing comes of it over a ball, where nothing is baked.
    pub texels: u32,
    /// Whether rays look for the field itself wherever they come near what is baked, and towards the sun over the field, too, at a multiple of the time: with a preset that refines hits and has all of
    /// the rock (`high`), pictures of ridges are those of `f64` to 60 dB, too (`docs/terrain.md`). `sky_sectors` are looked for over baked heights all the same. Nothing comes of it over a ball, where nothing is baked.
    pub exact: bool,
    /// Whether a layer of clouds shades the ground, which [`Terrain::set_cloud_shadow`](super::Terrain::set_cloud_shadow) tells. Nothing comes of it over a ball.
    pub cloud_shadows: bool,
}

impl Default for TerrainOptions {
    /// The mountains of the preset `thesis` with the preset `high`, to 60 km.
    fn default() -> Self {
        TerrainOptions {
            preset: Preset::High,
            land: Land::default(),
            far: 60_000.0,
            sky_sectors: 0,
            texels: 0,
            exact: false,
            cloud_shadows: false,
        }
    }
}

impl TerrainOptions {
    /// How frames of the ground alone are joined to a picture of a size, as `docs/terrain.md` measures them: `high` from half of its pixels a side, `low` from 0.26 of them and without the cubic,
    /// other presets from all of them. The host draws a picture of [`TemporalOptions::taken`] pixels, leaves it transparent where there is no ground, and nothing moves but the eye.
    pub fn joined(&self, programs: &ProgramSet, size: [u32; 2]) -> TemporalOptions {
        let name = self.preset.name(programs);
        let share = match name {
            "high" => 0.5,
            "low" => 0.26,
            _ => 1.0,
        };
        TemporalOptions {
            bound: f32::INFINITY,
            sharp: name != "low",
            fixed: true,
            has_empty: true,
            ..TemporalOptions::of_share(size, share)
        }
    }
}

/// Draws a field on the plane over a host's pass, and its depth.
#[derive(Debug)]
pub(super) struct PlaneTerrain {
    clipmap: Clipmap,
    land: Land,
    far: f64,
    depth: Depth,
    pipeline: wgpu::RenderPipeline,
    groups: Vec<wgpu::BindGroup>,
    view: wgpu::Buffer,
    field: wgpu::Buffer,
    rock: wgpu::Buffer,
    held: [Vec<u8>; 3],
    /// What the program reads of clouds.
    shade: Option<CloudShade>,
    /// Where rays look for the field itself.
    searched: Searched,
    /// Whether the view shows any ground.
    seen: bool,
    /// The nearest ground that was looked for last.
    looked: Option<Looked>,
}

/// The nearest ground, of all and in view, as it was found for an eye.
#[derive(Debug)]
struct Looked {
    eye: WorldPos,
    rays: [Vec3; 3],
    nearest: f64,
    shown: Option<[f64; 2]>,
}

impl Looked {
    /// The same for an eye that has hardly moved, or turned by no more than samples are shifted in few pixels: nearer by as much as it has moved.
    fn seen_near(&self, eye: WorldPos, rays: [Vec3; 3]) -> Option<(f64, Option<[f64; 2]>)> {
        let moved = eye.relative_to(self.eye).length();
        // Of a picture that is higher than it is wide its width counts.
        let least = self
            .rays
            .iter()
            .map(|ray| ray.length())
            .fold(f32::MAX, f32::min);
        let turned = (0..3).any(|k| {
            let off = (rays[k] - self.rays[k]).length();
            off > 0.06 * least
        });
        if turned || moved.is_nan() || moved > 0.05 * self.nearest {
            return None;
        }
        let nearer = |d: f64| (d - moved).max(0.0);
        Some((
            nearer(self.nearest),
            self.shown
                .map(|[along, through]| [nearer(along), nearer(through)]),
        ))
    }
}

/// A pipeline that draws ground into targets with a depth of the given format, and the layouts of its groups.
pub(crate) fn surface_pipeline(
    device: &wgpu::Device,
    programs: &ProgramSet,
    (program, features): (&str, &[&str]),
    targets: &Targets,
    depth_format: wgpu::TextureFormat,
    constants: &[(&str, f64)],
) -> Result<(wgpu::RenderPipeline, Vec<wgpu::BindGroupLayout>), Error> {
    let ready = programs.get(program, features)?.pipeline(
        device,
        &PipelineOptions {
            targets: &[Some(targets.color_format.into())],
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth_format,
                depth_write_enabled: Some(true),
                depth_compare: Some(match targets.depth {
                    Depth::Normal => wgpu::CompareFunction::Less,
                    Depth::Reversed | Depth::ReversedInfinite => wgpu::CompareFunction::Greater,
                }),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            sample_count: targets.sample_count,
            constants,
            ..Default::default()
        },
    )?;
    match ready.pipeline {
        Pipeline::Render(pipeline) => Ok((pipeline, ready.bind_group_layouts)),
        Pipeline::Compute(_) => Err(Error::MissingStage {
            program: program.to_owned(),
        }),
    }
}

/// The azimuths that a picture shows, from +x towards +z: the first and the extent (rad), from the ray through its middle and those from there to its borders.
fn azimuths([middle, right, up]: [Vec3; 3]) -> [f64; 2] {
    let [middle, right, up] = [middle, right, up].map(|v| v.as_dvec3());
    let all = [0.0, std::f64::consts::TAU];
    // Where the vertical meets the picture.
    let axes = glam::DMat3::from_cols(middle, right, up);
    if axes.determinant().abs() < 1e-12 {
        return all;
    }
    let zenith = axes.inverse() * glam::DVec3::Y;
    let edge = 1.001 * zenith.x.abs();
    if zenith.y.abs() <= edge && zenith.z.abs() <= edge {
        return all;
    }
    // Borders are great circles, along which the azimuth is monotone.
    let turn =
        |v: glam::DVec3| (middle.x * v.z - middle.z * v.x).atan2(middle.x * v.x + middle.z * v.z);
    let turns = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
        .map(|[x, y]| turn(middle + x * right + y * up));
    let first = turns.into_iter().fold(0.0, f64::min);
    let last = turns.into_iter().fold(0.0, f64::max);
    if last - first > 3.1 {
        return all;
    }
    [middle.z.atan2(middle.x) + first, last - first]
}

/// The nearest ground that a picture shows, about: its distance along the ground and through the air (m); none where it shows none up to `far`. Azimuths are those of [`azimuths`], no distance is
/// taken below that of the nearest ground of all. The planet is taken for flat, so that ground is nearer than it is.
fn nearest_in_view(
    field: &Prepared<f32>,
    eye: WorldPos,
    [middle, right, up]: [Vec3; 3],
    [first, extent]: [f64; 2],
    [nearest, far]: [f64; 2],
) -> Option<[f64; 2]> {
    let all = Some([0.0, nearest]);
    let tangent = |x: f32, y: f32| {
        let ray = middle + x * right + y * up;
        f64::from(ray.y) / f64::from(ray.x.hypot(ray.z)).max(1e-6)
    };
    // Of the lowest ray, which lies on the border unless the picture shows the nadir.
    let mut lowest = f64::INFINITY;
    for i in 0..16 {
        let along = i as f32 / 8.0 - 1.0;
        for [x, y] in [[along, -1.0], [1.0, along], [-along, 1.0], [-1.0, -along]] {
            lowest = lowest.min(tangent(x, y));
        }
    }
    let nadir = glam::Mat3::from_cols(middle, right, up).inverse() * Vec3::NEG_Y;
    let shows_nadir = nadir.x > 0.0 && nadir.y.abs().max(nadir.z.abs()) <= nadir.x;
    if shows_nadir || lowest < -2.0 || !nearest.is_finite() {
        return all;
    }
    // Ground between the places that are asked may stand higher.
    let lowest = lowest - 0.1 * (1.0 + lowest.abs());
    let place = field.place(eye);
    let mut found = f64::INFINITY;
    for i in 0..9 {
        let (sine, cosine) = (first + extent * f64::from(i) / 8.0).sin_cos();
        let mut distance = 0.25 * nearest.max(1.0);
        // The last place lies behind the end, for what comes into view before it.
        while distance < found.min(1.25 * far) {
            let at = [cosine * distance, sine * distance].map(|c| c as f32);
            let ground = field.ground_from(place, at, (0.1 * distance) as f32);
            let rise = f64::from(ground.height) - eye.altitude();
            if rise.is_nan() {
                return all;
            }
            if rise >= lowest * distance {
                found = distance;
            }
            distance *= 1.25;
        }
    }
    // The step before may have been missed.
    let along = 0.8 * found;
    found.is_finite().then_some([along, along.max(nearest)])
}

impl PlaneTerrain {
    /// Builds pipelines and makes room for heights.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for targets that it cannot draw into or that have no depth, and for options; the faults of [`Settings::resolve`] and the clipmap.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &TerrainOptions,
    ) -> Result<PlaneTerrain, Error> {
        targets.check_on(device)?;
        if targets.projection == Projection::Orthographic {
            return Err(Error::OutOfDomain {
                name: "targets.projection".to_owned(),
                value: "Orthographic".to_owned(),
                domain: "Perspective: footprints grow with the distance".to_owned(),
            });
        }
        let Some(depth_format) = targets.depth_format else {
            return Err(Error::OutOfDomain {
                name: "targets.depth_format".to_owned(),
                value: "None".to_owned(),
                domain: "the format of a depth buffer, which the terrain writes".to_owned(),
            });
        };
        if options.sky_sectors > 16 {
            return Err(Error::OutOfDomain {
                name: "terrain.sky_sectors".to_owned(),
                value: options.sky_sectors.to_string(),
                domain: "in [0, 16]".to_owned(),
            });
        }
        let output = output_of(targets.color_format)?;
        let settings = Settings::resolve(programs, &options.preset, None, &[])?;
        let number = |key: &str, or: f64| settings.number(key).unwrap_or(or);
        let (name, texels) = match options.texels {
            0 => ("CLIP_TEXELS", number("CLIP_TEXELS", 512.0) as u32),
            n => ("terrain.texels", n),
        };
        let fault = |name: &str, value: String, domain: &str| Error::OutOfDomain {
            name: name.to_owned(),
            value,
            domain: domain.to_owned(),
        };
        if !matches!(texels, 128 | 256 | 512 | 1024) {
            return Err(fault(name, texels.to_string(), "128, 256, 512 or 1024"));
        }
        let width = number("CLIP_WIDTH", 4.0);
        if ![4.0, 8.0, 16.0].contains(&width) {
            return Err(fault("CLIP_WIDTH", width.to_string(), "4, 8 or 16"));
        }
        if !(100.0..=4e6).contains(&options.far) {
            let value = options.far.to_string();
            return Err(fault("terrain.far", value, "in [100, 4e6] m on the plane"));
        }
        // Finer texels than the preset's take more steps.
        let finer = (f64::from(texels) / number("CLIP_TEXELS", 512.0)).max(1.0);
        let mut steps = (finer * number("CLIP_STEPS", 500.0)).round();
        let mut searches = number("SEARCH_STEPS", 48.0);
        if options.exact {
            (steps, searches) = (4.0 * steps, 4000.0);
        }
        let clipmap = Clipmap::new(
            device,
            programs,
            &options.land,
            &ClipmapOptions {
                texels,
                levels: 16,
                reach: options.far,
                width: width as u32,
            },
            !options.exact,
        )?;
        let features: &[&str] = if options.cloud_shadows {
            &["CLOUD_SHADOWS"]
        } else {
            &[]
        };
        let constants = [
            field_kind(programs, ("terrain", features), &options.land.field)?,
            ("OUTPUT", output),
            ("CLIP_STEPS", steps),
            ("REFINE_STEPS", number("REFINE_STEPS", 2.0)),
            ("SEARCH_STEPS", searches),
            ("SUN_STEPS", if options.exact { 20_000.0 } else { 0.0 }),
            ("ROCK_CHEAP", number("TEXTURE_LOW_QUALITY", 0.0)),
            ("SKY_SECTORS", f64::from(options.sky_sectors)),
        ];
        let (pipeline, layouts) = surface_pipeline(
            device,
            programs,
            ("terrain", features),
            targets,
            depth_format,
            &constants,
        )?;
        let buffer = |label, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let view = buffer("veduta terrain view", ViewBlock::SIZE);
        let field = buffer("veduta field", FieldBlock::SIZE);
        let rock = buffer("veduta rock", RockBlock::SIZE);
        let [heights, sectors, places] = &clipmap.views;
        let shades = clipmap.shades().unwrap_or(heights);
        let texture = wgpu::BindingResource::TextureView;
        let groups = vec![
            group(
                device,
                &layouts[0],
                &[
                    view.as_entire_binding(),
                    field.as_entire_binding(),
                    clipmap.clip().as_entire_binding(),
                    rock.as_entire_binding(),
                    clipmap.swept.as_entire_binding(),
                ],
            ),
            group(
                device,
                &layouts[1],
                &[
                    texture(heights),
                    texture(sectors),
                    texture(places),
                    texture(shades),
                    wgpu::BindingResource::Sampler(&clipmap.wrapping),
                    texture(clipmap.relief()),
                ],
            ),
        ];
        let shade = layouts
            .get(2)
            .filter(|_| options.cloud_shadows)
            .map(|layout| CloudShade::new(device, layout))
            .transpose()?;
        Ok(PlaneTerrain {
            clipmap,
            land: options.land.clone(),
            far: options.far,
            depth: targets.depth,
            pipeline,
            groups,
            view,
            field,
            rock,
            held: Default::default(),
            shade,
            searched: if options.exact {
                Searched::Everywhere
            } else if searches > 0.0 {
                Searched::Lens
            } else {
                Searched::Nowhere
            },
            seen: true,
            looked: None,
        })
    }

    /// The baked heights.
    pub fn clipmap(&self) -> &Clipmap {
        &self.clipmap
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        let clipmap = self.clipmap.resources();
        let shade = u32::from(self.shade.is_some());
        Resources {
            pipelines: clipmap.pipelines + 1,
            bind_groups: clipmap.bind_groups + 2 + shade,
            bindings: clipmap.bindings + 11 + 3 * shade,
            buffers: clipmap.buffers + 3 + shade,
            buffer_bytes: clipmap.buffer_bytes
                + (ViewBlock::SIZE + FieldBlock::SIZE + RockBlock::SIZE) as u64
                + u64::from(CLOUD_BLOCK * shade),
            textures: clipmap.textures + shade,
            texture_bytes: clipmap.texture_bytes + u64::from(4 * shade),
            samplers: clipmap.samplers + shade,
        }
    }

    /// Takes the shadow of clouds for the next frame.
    pub fn set_cloud_shadow(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shadow: Option<&CloudShadow<'_>>,
    ) -> Result<Work, Error> {
        let Some(shade) = &mut self.shade else {
            return Err(Error::OutOfDomain {
                name: "terrain.cloud_shadows".to_owned(),
                value: "false".to_owned(),
                domain: "true for ground that is told a shadow".to_owned(),
            });
        };
        let writes = shade.set(device, queue, shadow);
        Ok(Work {
            writes,
            bytes: u64::from(CLOUD_BYTES * writes),
            ..Work::default()
        })
    }

    /// Uploads what has changed, and records the baking of the ground that the eye has uncovered. `rows` is the height of the target in pixels, from which
    /// footprints follow.
    ///
    /// # Errors
    /// As [`View::check`]; [`Error::OutOfDomain`] for lights, a number of rows that is 0, and a projection that does not fit the targets.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        lights: &TerrainLights,
        rows: u32,
    ) -> Result<Work, Error> {
        view.check()?;
        let fault = |name: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: name.to_owned(),
                value,
                domain: domain.to_owned(),
            })
        };
        lights.check()?;
        if rows == 0 {
            return fault("rows", "0".to_owned(), "at least 1");
        }
        let [middle, right, up] = view.rays()?;
        let (scale, offset) = (view.projection.z_axis.z, view.projection.w_axis.z);
        if (offset > 0.0) != (self.depth != Depth::Normal) {
            let value = format!("{:?}", view.projection.to_cols_array());
            let domain = format!("one with the depth of the targets, {:?}", self.depth);
            return fault("view.projection", value, &domain);
        }
        let pixel_angle = 2.0 * up.length() / rows as f32;
        let eye = view.eye.normalized();
        let field = self.clipmap.field().clone();
        // A level finer than a pixel on the nearest ground would not be used.
        let far = self.far.min(self.clipmap.reach());
        let rays = [middle, right, up];
        let azimuths = azimuths(rays);
        let (nearest, shown) = match self.looked.as_ref().and_then(|l| l.seen_near(eye, rays)) {
            Some(known) => known,
            None => {
                let nearest = nearest_ground(&field, eye);
                let shown = nearest_in_view(&field, eye, rays, azimuths, [nearest, far]);
                self.looked = Some(Looked {
                    eye,
                    rays,
                    nearest,
                    shown,
                });
                (nearest, shown)
            }
        };
        // One that serves no place in view would not be used either. Texels stay small beside the distance to the ground all around, which must not come up to the eye.
        let pixel = f64::from(pixel_angle);
        let unused = shown.map_or(far, |[along, distance]| {
            let served = along * std::f64::consts::FRAC_1_SQRT_2;
            (0.35 * pixel * distance).max(self.clipmap.coarsest_within(served))
        });
        let least = unused.min(0.25 * nearest).max(0.35 * pixel * nearest);
        let gaze = Gaze {
            least,
            near: nearest,
            far,
            azimuths,
            pixel_angle: f64::from(pixel_angle),
            searched: self.searched,
            sun: (lights.sun != Vec3::ZERO && self.clipmap.shades().is_some()).then(|| {
                let to_sun = view.sun.to_light.normalize_or(Vec3::Y).as_dvec3();
                (to_sun.to_array(), f64::from(view.sun.angular_radius))
            }),
        };
        let mut work = self.clipmap.prepare(queue, encoder, eye, &gaze);
        // From above all ground, rays that rise meet none; those of a picture lie between those of its corners.
        let rises = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .iter()
            .all(|[x, y]| (middle + *x * right + *y * up).y > 0.0);
        self.seen = !(rises && eye.altitude() > self.clipmap.top());
        let m = &self.land.material;
        let block = ViewBlock {
            ray_middle: middle.to_array(),
            pixel_angle,
            ray_right: right.to_array(),
            far: far as f32,
            ray_up: up.to_array(),
            exposure: view.exposure,
            forward: view
                .world_from_view
                .transform_vector3(Vec3::NEG_Z)
                .normalize_or(Vec3::NEG_Z)
                .to_array(),
            depth_numerator: offset,
            to_sun: view.sun.to_light.normalize_or(Vec3::Y).to_array(),
            depth_offset: scale,
            sun_light: lights.sun.to_array(),
            sky_light: lights.sky.to_array(),
            snow_edge_low: m.snow_edge_low,
            bounce_light: lights.bounce.to_array(),
            snow_edge_high: m.snow_edge_high,
            snow_albedo: m.snow,
            snow_noise: m.snow_noise,
            snow_line: m.snow_line,
            sea_albedo: self.land.sea.map_or([0.0; 3], |s| s.albedo),
            highest: self.clipmap.top() as f32,
            sun_radius: view.sun.angular_radius.max(1e-6),
            ..Default::default()
        };
        let wavelength = f64::from(m.rock_wavelength);
        let [x, z] = [eye.lattice(0, wavelength)?, eye.lattice(2, wavelength)?];
        let rock = RockBlock {
            cell: [x.cell, 0, z.cell],
            frac: [x.frac, 0.0, z.frac],
            wavelength: m.rock_wavelength,
            octaves: 5,
            hurst: 1.0,
            dark: m.rock_dark,
            light: m.rock_light,
            stain: m.rock_dark.map(|c| m.rock_stain * c),
            seed: self.land.field.seed.wrapping_add(101),
            ..Default::default()
        };
        let blocks = [
            (&self.view, block.to_bytes().to_vec()),
            (
                &self.field,
                field.block(field.place(eye)).to_bytes().to_vec(),
            ),
            (&self.rock, rock.to_bytes().to_vec()),
        ];
        for ((buffer, bytes), held) in blocks.into_iter().zip(&mut self.held) {
            if bytes != *held {
                queue.write_buffer(buffer, 0, &bytes);
                work.writes += 1;
                work.bytes += bytes.len() as u64;
                *held = bytes;
            }
        }
        Ok(work)
    }

    /// Draws into the host's pass: one triangle over the part of the picture below the highest ground that it shows. From above all ground a view that looks up draws nothing.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'_>) -> Work {
        if !self.seen {
            return Work::default();
        }
        pass.set_pipeline(&self.pipeline);
        let shade = self.shade.iter().map(|shade| &shade.group);
        for (index, group) in (0..).zip(self.groups.iter().chain(shade)) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.draw(0..3, 0..1);
        Work {
            draws: 1,
            ..Work::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ground_in_view_is_nearer_than_is_said() {
        let land = Land::default();
        let field = land.prepare::<f32>().unwrap();
        let far = 4e5;
        let (mut away, mut through_the_air) = (0, 0);
        for k in 0..75 {
            let turn = f64::from(k) * 0.37;
            let at = glam::DVec3::new(900.0 * f64::from(k), 0.0, -7_000.0 * turn);
            let ground = f64::from(field.ground(WorldPos::from_metres(at), 0.0).height);
            let height = [3.0, 40.0, 300.0, 3000.0, 20_000.0][k as usize / 5 % 5];
            let eye = WorldPos::from_metres(at + glam::DVec3::Y * (ground + height));
            let mut view = View {
                eye,
                ..Default::default()
            };
            let pitch = [-70.0, -30.0, 0.0, 15.0, 60.0][k as usize % 5];
            view.look(
                turn,
                f64::to_radians(pitch),
                [1.0, 0.4][k as usize % 2],
                1.8,
            );
            let rays = view.rays().unwrap();
            let nearest = nearest_ground(&field, eye);
            let said = nearest_in_view(&field, eye, rays, azimuths(rays), [nearest, far]);
            let (along, through) = said.map_or((far, far), |[a, t]| (a, t));
            away += u32::from(along > 2.0 * nearest);
            // All ground on a fine grid that is nearer, along the ground or through the air, lies beyond the border of the picture.
            let axes = glam::Mat3::from_cols(rays[0], rays[1], rays[2]).inverse();
            for i in 0..360 {
                let (sine, cosine) = f64::to_radians(f64::from(i)).sin_cos();
                for j in 1..200 {
                    let distance = 0.005 * f64::from(j) * along.max(through);
                    let p = [cosine * distance, sine * distance].map(|c| c as f32);
                    let ground = field.ground_from(field.place(eye), p, 0.01 * distance as f32);
                    let rise = f64::from(ground.height) - eye.altitude();
                    let seen = axes * Vec3::new(p[0], rise as f32, p[1]);
                    let inside = seen.x > 0.0 && seen.y.abs().max(seen.z.abs()) < seen.x;
                    through_the_air += u32::from(inside && distance < 0.95 * through);
                    assert!(
                        !inside || distance >= 0.999 * along,
                        "{k}: ground at {distance} m, said {along} m"
                    );
                    assert!(
                        !inside || distance.hypot(rise) > 0.8 * through,
                        "{k}: ground {} m away through the air, said {through} m",
                        distance.hypot(rise)
                    );
                }
            }
        }
        assert!(away > 10, "{away} of 75");
        // Places nearer along the ground than what is said through the air: only there the second bound says more than the first.
        assert!(through_the_air > 1000, "{through_the_air}");
    }

    #[test]
    fn ground_is_looked_for_anew_once_the_eye_has_moved_or_turned() {
        let eye = WorldPos::from_metres(glam::DVec3::new(5e6, 700.0, -3e5));
        let rays = [Vec3::NEG_Z, 0.9 * Vec3::X, 0.5 * Vec3::Y];
        let looked = Looked {
            eye,
            rays,
            nearest: 100.0,
            shown: Some([150.0, 180.0]),
        };
        let moved = |metres: f64| eye.moved_by(glam::DVec3::X * metres);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-3;
        let (nearest, shown) = looked.seen_near(moved(4.0), rays).unwrap();
        assert!(near(nearest, 96.0), "{nearest}");
        assert!(shown.is_some_and(|[a, t]| near(a, 146.0) && near(t, 176.0)));
        assert!(looked.seen_near(moved(-5.5), rays).is_none());
        let turned = |by: f32| rays.map(|v| glam::Mat3::from_rotation_y(by) * v);
        assert!(looked.seen_near(eye, turned(0.005)).is_some());
        assert!(looked.seen_near(eye, turned(0.06)).is_none());
        // A fifth of its half width shows other ground, however high a picture is.
        let upright = [rays[0], 0.1 * Vec3::X, 0.9 * Vec3::Y];
        let narrow = Looked {
            rays: upright,
            ..looked
        };
        let aside = |by: f32| [upright[0] + by * Vec3::X, upright[1], upright[2]];
        assert!(narrow.seen_near(eye, aside(0.005)).is_some());
        assert!(narrow.seen_near(eye, aside(0.02)).is_none());
        let farther = [rays[0], 0.5 * rays[1], 0.5 * rays[2]];
        assert!(looked.seen_near(eye, farther).is_none());
    }

    #[test]
    fn ground_is_looked_for_as_far_as_rays_go() {
        let land = Land::default();
        let field = land.prepare::<f32>().unwrap();
        let said = |height: f64, pitch: f64, far: f64| {
            let mut view = View {
                eye: WorldPos::from_metres(glam::DVec3::Y * height),
                ..Default::default()
            };
            view.look(0.3, pitch.to_radians(), 40_f32.to_radians(), 1.8);
            let rays = view.rays().unwrap();
            let nearest = nearest_ground(&field, view.eye);
            nearest_in_view(&field, view.eye, rays, azimuths(rays), [nearest, far])
        };
        // Rays 5 degrees below the horizon meet level ground at 230 km.
        let [along, through] = said(20_000.0, 15.0, 4e5).unwrap();
        assert!((7e4..2.3e5).contains(&along) && through >= along, "{along}");
        assert_eq!(said(20_000.0, 15.0, 5e4), None);
        // From 600 km the search begins beyond 100 km.
        let [along, _] = said(6e5, 0.0, 4e6).unwrap();
        assert!((5e5..1.7e6).contains(&along), "{along}");
        assert_eq!(said(6e5, 30.0, 4e6), None);
    }
}
