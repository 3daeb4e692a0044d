//! A host application without a window: it owns the device, the texture, the encoder and the pass; veduta draws the
//! landscape into them. Run it with `cargo run --release --example host_app`.

use veduta::{Landscape, LandscapeOptions, Preset, Targets, View, wgpu};

const SIZE: [u32; 2] = [128, 72];

/// Draws one frame and returns its pixels: red, green, blue and alpha, row by row.
pub fn draw() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    // What a host has anyway: a device with its queue, and something to draw into.
    let gpu = pollster::block_on(veduta::device::Gpu::open())?;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d {
            width: SIZE[0],
            height: SIZE[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });

    // Once: the landscape, with the pipeline for the host's target. The defaults are the scene and preset `thesis`.
    let targets = Targets {
        color_format: texture.format(),
        ..Default::default()
    };
    let options = LandscapeOptions {
        preset: Preset::ThesisLow,
        ..Default::default()
    };
    let mut landscape = Landscape::new(&gpu.device, veduta::programs(), &targets, &options)?;

    // Each frame: `prepare` uploads what has changed, `composite` draws in the host's own pass.
    let mut view = View::default();
    view.eye.cell.y = 2500; // metres
    view.look(0.5, -0.1, 1.0, SIZE[0] as f32 / SIZE[1] as f32);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let uploaded = landscape.prepare(&gpu.device, &gpu.queue, &mut encoder, &view)?;
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &texture.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    });
    let drawn = landscape.composite(&mut pass);
    drop(pass);
    println!("{} bytes, {} draw call", uploaded.bytes, drawn.draws);

    // A host with a window presents now; this one reads the picture back.
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: u64::from(4 * SIZE[0] * SIZE[1]),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let rows = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            bytes_per_row: Some(4 * SIZE[0]),
            ..Default::default()
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), rows, texture.size());
    gpu.queue.submit([encoder.finish()]);
    Ok(gpu.read_staging(&buffer)?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{} bytes of pixels", draw()?.len());
    Ok(())
}
