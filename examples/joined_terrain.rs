//! Mountains at half of the pixels a side, joined from frame to frame: what the terrain's bench measures, in a program. Run it with
//! `cargo run --release --example joined_terrain -- picture.ppm 3.3`; the number is the eye's speed in metres a frame, 0 when left out.

use veduta::glam::{DVec3, Vec3};
use veduta::temporal::Temporal;
use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
use veduta::view::direction;
use veduta::{Light, Targets, View, WorldPos, wgpu};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Draws so many frames for an eye that flies at a speed in metres a frame, and returns the last one: radiance as half floats, red, green, blue and alpha, row by row.
pub fn draw(size: [u32; 2], frames: u32, speed: f64) -> Fallible<Vec<u8>> {
    let gpu = pollster::block_on(veduta::device::Gpu::open())?;
    let (device, queue, programs) = (&gpu.device, &gpu.queue, veduta::programs());
    let options = TerrainOptions {
        land: Land::named("alps")?,
        ..Default::default()
    };
    // How many pixels are drawn follows from the preset.
    let joined = options.joined(programs, size);
    let texture = |format| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: joined.taken[0],
                height: joined.taken[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    let color = texture(wgpu::TextureFormat::Rgba16Float).create_view(&Default::default());
    let depth = texture(wgpu::TextureFormat::Depth32Float).create_view(&Default::default());
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let mut terrain = Terrain::new(device, programs, &targets, &options)?;
    let mut temporal = Temporal::new(device, programs, &joined)?;
    temporal.set_host(device, &color, &depth)?;

    let field = options.land.prepare::<f64>()?;
    let lights = TerrainLights::clear(Vec3::splat(6.0));
    for frame in 0..frames {
        let ahead = DVec3::new(13_500.0, 0.0, -14_700.0 - speed * f64::from(frame));
        let foot = WorldPos::from_metres(ahead);
        let height = field.ground(foot, 0.0).height + 300.0;
        let mut view = View {
            eye: foot.moved_by(DVec3::Y * height),
            sun: Light {
                to_light: direction(0.5, 2.1).as_vec3(),
                ..Default::default()
            },
            ..Default::default()
        };
        view.look(0.0, -0.1, 1.0, size[0] as f32 / size[1] as f32);
        // Each frame: the view moved by a part of a pixel, the ground, and this frame with those before.
        let shifted = temporal.shifted(&view);
        let mut encoder = device.create_command_encoder(&Default::default());
        let rows = temporal.footprint_rows();
        let _ = terrain.prepare(queue, &mut encoder, &shifted, &lights, rows)?;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let _ = terrain.draw_opaque(&mut pass);
        drop(pass);
        let _ = temporal.resolve(queue, &mut encoder, &view)?;
        queue.submit([encoder.finish()]);
    }
    Ok(gpu.read_texture(temporal.result().texture())?)
}

/// A half float without sign.
pub fn number(bytes: [u8; 2]) -> f32 {
    let bits = u16::from_le_bytes(bytes);
    let (exponent, digits) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    match exponent {
        0 => digits * 2_f32.powi(-24),
        _ => (1.0 + digits / 1024.0) * 2_f32.powi(exponent - 15),
    }
}

fn main() -> Fallible<()> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "mountains.ppm".to_owned());
    let speed = std::env::args().nth(2).map_or(Ok(0.0), |s| s.parse())?;
    let size = [256, 144];
    let radiance = draw(size, 32, speed)?;
    let mut file = format!("P6\n{} {}\n255\n", size[0], size[1]).into_bytes();
    for pixel in radiance.chunks_exact(8) {
        for c in [0, 2, 4] {
            let light = 1.0 - (-1.5 * number([pixel[c], pixel[c + 1]])).exp();
            file.push((255.0 * light.powf(1.0 / 2.2)) as u8);
        }
    }
    std::fs::write(&path, file)?;
    println!("{path}");
    Ok(())
}
