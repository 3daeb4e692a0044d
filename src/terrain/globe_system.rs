//! A ball's ground in a host's own pass, seen from orbit.

use glam::Vec3;

use super::clipmap::group;
use super::globe::Globe;
use super::land::Land;
use super::system::{TerrainLights, TerrainOptions, surface_pipeline};
use crate::error::Error;
use crate::landscape::{Depth, Projection, Resources, Targets, Work, output_of};
use crate::program::ProgramSet;
use crate::programs::blocks::{
    Globe as GlobeBlock, GlobeLight as LightBlock, GlobeView as ViewBlock, Rock as RockBlock,
};
use crate::settings::Settings;
use crate::view::View;

/// Zenith cosines of the sun for which a ball has lights.
pub(super) const LIGHTS: usize = 32;

/// The zenith cosine of the sun of light `k`.
pub(super) fn cosine(k: usize) -> f64 {
    1.2 * (k as f64 / (LIGHTS - 1) as f64).powi(2) - 0.2
}

/// Draws a ball over a host's pass, and its depth.
#[derive(Debug)]
pub(super) struct GlobeTerrain {
    globe: Globe<f32>,
    land: Land,
    far: f64,
    depth: Depth,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    buffers: [wgpu::Buffer; 3],
    held: [Vec<u8>; 3],
    lights: Option<Vec<TerrainLights>>,
    /// Whether the view shows any ground.
    seen: bool,
}

impl GlobeTerrain {
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &TerrainOptions,
    ) -> Result<GlobeTerrain, Error> {
        targets.check_on(device)?;
        let fault = |name: &str, value: String, domain: &str| Error::OutOfDomain {
            name: name.to_owned(),
            value,
            domain: domain.to_owned(),
        };
        if targets.projection == Projection::Orthographic {
            let domain = "Perspective: footprints grow with the distance";
            return Err(fault(
                "targets.projection",
                "Orthographic".to_owned(),
                domain,
            ));
        }
        let Some(format) = targets.depth_format else {
            let domain = "the format of a depth buffer, which the terrain writes";
            return Err(fault("targets.depth_format", "None".to_owned(), domain));
        };
        if !(100.0..=1e9).contains(&options.far) {
            let value = options.far.to_string();
            return Err(fault("terrain.far", value, "in [100, 1e9] m over a ball"));
        }
        let globe = options.land.globe::<f32>()?;
        if options.sky_sectors > 16 {
            let value = options.sky_sectors.to_string();
            return Err(fault("terrain.sky_sectors", value, "in [0, 16]"));
        }
        let settings = Settings::resolve(programs, &options.preset, None, &[])?;
        let number = |key: &str, or: f64| settings.number(key).unwrap_or(or);
        let constants = [
            ("FIELD_KIND", f64::from(options.land.field.kind.number())),
            ("OUTPUT", output_of(targets.color_format)?),
            ("GLOBE_STEPS", number("GLOBE_STEPS", 600.0)),
            ("GLOBE_STEPS_SHADOW", number("GLOBE_STEPS_SHADOW", 40.0)),
            ("ROCK_CHEAP", number("TEXTURE_LOW_QUALITY", 0.0)),
            ("SKY_SECTORS", f64::from(options.sky_sectors)),
        ];
        let (pipeline, layouts) = surface_pipeline(
            device,
            programs,
            ("terrain_globe", &[]),
            targets,
            format,
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
        let buffers = [
            buffer("veduta globe view", ViewBlock::SIZE),
            buffer("veduta globe", GlobeBlock::SIZE),
            buffer("veduta rock", RockBlock::SIZE),
        ];
        let entries = buffers.each_ref().map(|b| b.as_entire_binding());
        Ok(GlobeTerrain {
            group: group(device, &layouts[0], &entries),
            globe,
            land: options.land.clone(),
            far: options.far,
            depth: targets.depth,
            pipeline,
            buffers,
            held: Default::default(),
            lights: None,
            seen: true,
        })
    }

    pub fn resources(&self) -> Resources {
        Resources {
            pipelines: 1,
            bind_groups: 1,
            bindings: 3,
            buffers: 3,
            buffer_bytes: (ViewBlock::SIZE + GlobeBlock::SIZE + RockBlock::SIZE) as u64,
            ..Default::default()
        }
    }

    /// Lights for the zenith cosines of the sun of [`cosine`].
    pub fn set_lights(&mut self, lights: Option<Vec<TerrainLights>>) {
        self.lights = lights;
    }

    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        view: &View,
        lights: &TerrainLights,
        rows: u32,
    ) -> Result<Work, Error> {
        view.check()?;
        lights.check()?;
        if rows == 0 {
            return Err(Error::OutOfDomain {
                name: "rows".to_owned(),
                value: "0".to_owned(),
                domain: "at least 1".to_owned(),
            });
        }
        let [middle, right, up] = view.rays()?;
        let (scale, offset) = (view.projection.z_axis.z, view.projection.w_axis.z);
        if (offset > 0.0) != (self.depth != Depth::Normal) {
            return Err(Error::OutOfDomain {
                name: "view.projection".to_owned(),
                value: format!("{:?}", view.projection.to_cols_array()),
                domain: format!("one with the depth of the targets, {:?}", self.depth),
            });
        }
        let pixel_angle = 2.0 * up.length() / rows as f32;
        let eye = view.eye.normalized();
        let top = self.globe.bounds().maximum;
        let altitude = self.globe.altitude(eye);
        let nearest = f64::from(pixel_angle) * (altitude - top).max(0.0);
        let globe = self.globe.block(eye, nearest);
        // How far from the way down the ball reaches.
        let rim_cosine = if altitude > top {
            let sine = (self.globe.radius() + top) / (self.globe.radius() + altitude);
            (1.0 - sine * sine).sqrt()
        } else {
            -1.0
        };
        let axis = middle.normalize();
        let widest = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .iter()
            .map(|[x, y]| axis.dot((middle + *x * right + *y * up).normalize()))
            .fold(1.0, f32::min);
        let down = axis.dot(-Vec3::from_array(globe.up)).clamp(-1.0, 1.0);
        let reach = (rim_cosine as f32).acos() + widest.clamp(-1.0, 1.0).acos();
        self.seen = down.acos() < reach + 2e-3;
        let m = &self.land.material;
        let to_sun = view.sun.to_light.normalize_or(Vec3::Y);
        let by_height = |k: usize| -> LightBlock {
            let here = match &self.lights {
                Some(table) => table[k],
                None => {
                    // The sky of a given place fades with the sun.
                    let day = (cosine(k).max(0.0) * 5.0).min(1.0) as f32;
                    TerrainLights {
                        sun: lights.sun,
                        sky: day * lights.sky,
                        bounce: day * lights.bounce,
                    }
                }
            };
            LightBlock {
                sun: here.sun.to_array(),
                sky: here.sky.to_array(),
                bounce: here.bounce.to_array(),
                ..Default::default()
            }
        };
        let block = ViewBlock {
            ray_middle: middle.to_array(),
            pixel_angle,
            ray_right: right.to_array(),
            far: self.far as f32,
            ray_up: up.to_array(),
            exposure: view.exposure,
            forward: view
                .world_from_view
                .transform_vector3(Vec3::NEG_Z)
                .normalize_or(Vec3::NEG_Z)
                .to_array(),
            depth_numerator: offset,
            to_sun: to_sun.to_array(),
            depth_offset: scale,
            sun_width: view.sun.angular_radius.tan().max(1e-4),
            snow_edge_low: m.snow_edge_low,
            snow_edge_high: m.snow_edge_high,
            snow_noise: m.snow_noise,
            snow_albedo: m.snow,
            snow_line: m.snow_line,
            sea_albedo: self.land.sea.map_or([0.0; 3], |s| s.albedo),
            rim_cosine: rim_cosine as f32,
            lights: std::array::from_fn(by_height),
        };
        // The rock's lattice has the world's axes, too, from the eye's foot point.
        let foot = self.globe.foot(eye);
        let wavelength = f64::from(m.rock_wavelength);
        let lattice = foot.map(|c| {
            let at = c / wavelength;
            (at.floor() as i32, (at - at.floor()) as f32)
        });
        let rock = RockBlock {
            cell: lattice.map(|l| l.0),
            frac: lattice.map(|l| l.1),
            wavelength: m.rock_wavelength,
            octaves: 8,
            hurst: 0.8,
            dark: m.rock_dark,
            light: m.rock_light,
            stain: m.rock_dark.map(|c| m.rock_stain * c),
            seed: self.land.field.seed.wrapping_add(101),
            ..Default::default()
        };
        let blocks = [
            block.to_bytes().to_vec(),
            globe.to_bytes().to_vec(),
            rock.to_bytes().to_vec(),
        ];
        let mut work = Work::default();
        for ((buffer, bytes), held) in self.buffers.iter().zip(blocks).zip(&mut self.held) {
            if bytes != *held {
                queue.write_buffer(buffer, 0, &bytes);
                work.writes += 1;
                work.bytes += bytes.len() as u64;
                *held = bytes;
            }
        }
        Ok(work)
    }

    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'_>) -> Work {
        if !self.seen {
            return Work::default();
        }
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..6, 0..1);
        Work {
            draws: 1,
            ..Work::default()
        }
    }
}
