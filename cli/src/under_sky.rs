//! Pictures of what a system draws, under the sky of an atmosphere.

use veduta::atmosphere::{Atmosphere, LightPlace, Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::device::Gpu;
use veduta::glam::{DVec3, Vec3};
use veduta::terrain::TerrainLights;
use veduta::wgpu;
use veduta::{Preset, Targets, View};

use crate::error::CliError;
use crate::render::Size;

/// A picture of one size, its depth, and the sky over it.
pub struct UnderSky {
    gpu: &'static Gpu,
    sky: Sky,
    query: SkyQuery,
    size: Size,
    shown: wgpu::Texture,
    /// Of the scene, of its depth, and of what is shown in the end.
    views: [wgpu::TextureView; 3],
}

impl UnderSky {
    /// What systems draw into.
    pub fn targets() -> Targets {
        Targets {
            color_format: wgpu::TextureFormat::Rgba32Float,
            depth_format: Some(wgpu::TextureFormat::Depth32Float),
            ..Default::default()
        }
    }

    /// Makes tables and textures.
    ///
    /// # Errors
    /// What the library reports.
    pub fn new(air: Atmosphere, size: Size) -> Result<UnderSky, CliError> {
        let gpu = veduta::device::shared()?;
        let texture = |format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d {
                    width: size.width,
                    height: size.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let (color, read) = (
            wgpu::TextureFormat::Rgba32Float,
            wgpu::TextureUsages::TEXTURE_BINDING,
        );
        let scene = texture(color, read);
        let depth = texture(wgpu::TextureFormat::Depth32Float, read);
        let shown = texture(color, wgpu::TextureUsages::COPY_SRC);
        let views = [&scene, &depth, &shown].map(|t| t.create_view(&Default::default()));
        let over = Targets {
            depth_format: None,
            ..UnderSky::targets()
        };
        let query = SkyQuery::new(&gpu.device, veduta::programs(), &air)?;
        let options = SkyOptions {
            preset: Preset::High,
            atmosphere: air,
            composition: SkyComposition::OverPicture,
            ..Default::default()
        };
        let mut sky = Sky::new(&gpu.device, veduta::programs(), &over, &options)?;
        sky.set_host(&gpu.device, &views[1], Some(&views[0]))?;
        Ok(UnderSky {
            gpu,
            sky,
            query,
            size,
            shown,
            views,
        })
    }

    /// Lights on level ground at an altitude (m).
    ///
    /// # Errors
    /// What the library reports.
    pub fn lights(&mut self, view: &View, altitude: f64) -> Result<TerrainLights, CliError> {
        let to_sun: DVec3 = view.sun.to_light.as_dvec3().normalize_or(DVec3::Y);
        let thickness = self.sky.tables().atmosphere().thickness;
        let place = LightPlace {
            altitude: altitude.clamp(0.0, thickness),
            to_sun: to_sun.to_array(),
            normal: [0.0, 1.0, 0.0],
            sun_angular_radius: f64::from(view.sun.angular_radius),
        };
        let found = self.query.run(
            &self.gpu.device,
            &self.gpu.queue,
            self.sky.tables_mut(),
            &[place],
        )?;
        let (sun, sky) = found.first().map_or((Vec3::ZERO, Vec3::ZERO), |f| {
            (Vec3::from_array(f.sun), Vec3::from_array(f.sky))
        });
        // What ground of an albedo of a fifth throws back onto a slope that faces it by half.
        let bounce = 0.1 * (sun * (to_sun.y.max(0.0) as f32) + sky);
        Ok(TerrainLights { sun, sky, bounce })
    }

    /// Linear RGB by rows from the top, of what `record` prepares and `draw` draws, with the air before it.
    ///
    /// # Errors
    /// What the library and `record` report.
    pub fn paint(
        &mut self,
        view: &View,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), CliError>,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) -> Result<Vec<f32>, CliError> {
        let Gpu { device, queue, .. } = self.gpu;
        let mut encoder = device.create_command_encoder(&Default::default());
        record(&mut encoder)?;
        let _ = self.sky.prepare(queue, &mut encoder, view)?;
        let [scene, depth, shown] = &self.views;
        let target = |view| {
            [Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })]
        };
        draw(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &target(scene),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        }));
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &target(shown),
                ..Default::default()
            });
            let _ = self.sky.composite(&mut pass)?;
        }
        queue.submit([encoder.finish()]);
        let bytes = self.gpu.read_texture(&self.shown)?;
        Ok(bytes
            .chunks_exact(16)
            .flat_map(|p| {
                [0, 4, 8].map(|k| f32::from_le_bytes([p[k], p[k + 1], p[k + 2], p[k + 3]]))
            })
            .collect())
    }

    /// Width and height (pixels).
    pub fn size(&self) -> Size {
        self.size
    }
}
