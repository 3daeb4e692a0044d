//! Pictures of what a system draws, under the sky of an atmosphere.

use veduta::atmosphere::{Atmosphere, Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::device::Gpu;
use veduta::glam::Vec3;
use veduta::terrain::TerrainLights;
use veduta::wgpu;
use veduta::{Preset, Targets, View};

use crate::error::CliError;
use crate::render::{Size, picture};

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

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
            depth_format: Some(DEPTH),
            ..Default::default()
        }
    }

    /// Makes tables and textures.
    ///
    /// # Errors
    /// What the library reports.
    pub fn new(air: Atmosphere, size: Size) -> Result<UnderSky, CliError> {
        let gpu = veduta::device::shared()?;
        let targets = UnderSky::targets();
        let texture = |format| picture(&gpu.device, size, format);
        let (scene, shown) = (texture(targets.color_format), texture(targets.color_format));
        let depth = texture(DEPTH);
        let views = [&scene, &depth, &shown].map(|t| t.create_view(&Default::default()));
        let over = Targets {
            depth_format: None,
            ..targets
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

    /// Lights on level ground of an albedo of a fifth at an altitude (m).
    ///
    /// # Errors
    /// What the library reports.
    pub fn lights(&mut self, view: &View, altitude: f64) -> Result<TerrainLights, CliError> {
        Ok(TerrainLights::from_sky(
            &self.gpu.device,
            &self.gpu.queue,
            &self.query,
            self.sky.tables_mut(),
            &view.sun,
            altitude,
            Vec3::splat(0.2),
        )?)
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
