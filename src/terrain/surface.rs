//! The ground of a land on either domain, in a host's own pass.

use super::clipmap::Clipmap;
use super::globe_system::{GlobeTerrain, LIGHTS, cosine};
use super::system::{PlaneTerrain, TerrainLights, TerrainOptions};
use crate::clouds::CloudShadow;
use crate::error::Error;
use crate::landscape::{Resources, Targets, Work};
use crate::program::ProgramSet;
use crate::view::View;

#[derive(Debug)]
enum Ground {
    Plane(Box<PlaneTerrain>),
    Sphere(Box<GlobeTerrain>),
}

/// Draws a height field over a host's pass, and its depth.
///
/// ```no_run
/// # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView, depth: &wgpu::TextureView)
/// # -> Result<(), veduta::Error> {
/// use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
/// let targets = veduta::Targets { depth_format: Some(wgpu::TextureFormat::Depth32Float), ..Default::default() };
/// let mut terrain = Terrain::new(device, veduta::programs(), &targets, &TerrainOptions::default())?;
/// let view = veduta::View::default();
/// // Every frame: heights are baked only where the eye has uncovered ground.
/// let work = terrain.prepare(queue, encoder, &view, &TerrainLights::clear(view.sun.irradiance), 144)?;
/// println!("{} levels baked", work.bakes);
/// let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
///     color_attachments: &[Some(wgpu::RenderPassColorAttachment {
///         view: target, depth_slice: None, resolve_target: None, ops: wgpu::Operations::default(),
///     })],
///     depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
///         view: depth, depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }), stencil_ops: None,
///     }),
///     ..Default::default()
/// });
/// let _ = terrain.draw_opaque(&mut pass);
/// # Ok(()) }
/// ```
///
/// Over a ball (`Domain::Sphere`) the planet's centre lies at (0, -radius, 0) of the world, the view is in the world's frame, and nothing is baked. [`View::levelled`] is
/// the same view for systems that want y to be up at the eye, such as the sky.
#[derive(Debug)]
pub struct Terrain {
    ground: Ground,
}

impl Terrain {
    /// Builds pipelines and makes room for heights.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for targets that it cannot draw into or that have no depth, for options, and for a program's own function where none is plugged in; the faults of [`Settings::resolve`], the clipmap and
    /// [`Land::globe`].
    ///
    /// [`Settings::resolve`]: crate::Settings::resolve
    /// [`Land::globe`]: super::Land::globe
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        targets: &Targets,
        options: &TerrainOptions,
    ) -> Result<Terrain, Error> {
        let ground = if options.land.field.on_sphere() {
            Ground::Sphere(Box::new(GlobeTerrain::new(
                device, programs, targets, options,
            )?))
        } else {
            Ground::Plane(Box::new(PlaneTerrain::new(
                device, programs, targets, options,
            )?))
        };
        Ok(Terrain { ground })
    }

    /// The baked heights; over a ball there are none.
    pub fn clipmap(&self) -> Option<&Clipmap> {
        match &self.ground {
            Ground::Plane(plane) => Some(plane.clipmap()),
            Ground::Sphere(_) => None,
        }
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        match &self.ground {
            Ground::Plane(plane) => plane.resources(),
            Ground::Sphere(sphere) => sphere.resources(),
        }
    }

    /// The zenith cosines of the sun for which [`Terrain::set_lights_by_sun`] takes lights.
    pub fn sun_cosines() -> Vec<f64> {
        (0..LIGHTS).map(cosine).collect()
    }

    /// Lights on the level ground of a ball where the sun has the zenith cosines of [`Terrain::sun_cosines`], instead of those that [`Terrain::prepare`] is given, which else
    /// hold everywhere, with the sky's fading as the sun sinks. `None` takes them back; nothing happens over a plane.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for another number of lights, and as [`TerrainLights::check`].
    pub fn set_lights_by_sun(&mut self, lights: Option<&[TerrainLights]>) -> Result<(), Error> {
        if let Some(lights) = lights {
            if lights.len() != LIGHTS {
                return Err(Error::OutOfDomain {
                    name: "lights".to_owned(),
                    value: format!("{} of them", lights.len()),
                    domain: format!("{LIGHTS} of them"),
                });
            }
            for light in lights {
                light.check()?;
            }
        }
        if let Ground::Sphere(sphere) = &mut self.ground {
            sphere.set_lights(lights.map(<[_]>::to_vec));
        }
        Ok(())
    }

    /// Tells the shadow of a layer of clouds, by which the sun's light is less from the next [`Terrain::draw_opaque`] on; `None` where there is none. In every frame between
    /// [`Clouds::prepare`](crate::clouds::Clouds::prepare) for the same eye and the submission, since places are relative to the eye. The light of the sky stays as it is given.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for ground that was made without `cloud_shadows`; nothing happens over a ball.
    pub fn set_cloud_shadow(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shadow: Option<&CloudShadow<'_>>,
    ) -> Result<Work, Error> {
        match &mut self.ground {
            Ground::Plane(plane) => plane.set_cloud_shadow(device, queue, shadow),
            Ground::Sphere(_) => Ok(Work::default()),
        }
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
        match &mut self.ground {
            Ground::Plane(plane) => plane.prepare(queue, encoder, view, lights, rows),
            Ground::Sphere(sphere) => sphere.prepare(queue, view, lights, rows),
        }
    }

    /// Draws into the host's pass: over a plane one triangle below the skyline, over a ball the rectangle that can show it. A view that cannot show any draws nothing.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass<'_>) -> Work {
        match &self.ground {
            Ground::Plane(plane) => plane.draw_opaque(pass),
            Ground::Sphere(sphere) => sphere.draw_opaque(pass),
        }
    }
}
