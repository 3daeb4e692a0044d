//! A host application without a window: it owns the device, the texture, the encoder and the pass, and lets veduta draw
//! the landscape into them.
//!
//!     cargo run --release --example host_app

use veduta::{Landscape, LandscapeOptions, Preset, Targets, View, wgpu};

const SIZE: wgpu::Extent3d = wgpu::Extent3d {
    width: 128,
    height: 72,
    depth_or_array_layers: 1,
};

/// Draws one frame and returns the mean of red, green and blue, each in [0, 255].
pub fn draw() -> Result<[f64; 3], Box<dyn std::error::Error>> {
    // What a host has anyway: a device with its queue, and something to draw into.
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: SIZE,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });

    // Once: the pipeline for the host's target.
    let targets = Targets {
        color_format: texture.format(),
        ..Default::default()
    };
    let options = LandscapeOptions {
        preset: Preset::ThesisLow,
        ..Default::default()
    };
    let mut landscape = Landscape::new(&device, veduta::programs(), &targets, &options)?;

    // Each frame: a view, then `prepare` and `composite` between the host's own commands.
    let mut view = View::default();
    view.look(0.5, 0.1, 1.0, SIZE.width as f32 / SIZE.height as f32);
    let mut encoder = device.create_command_encoder(&Default::default());
    let uploaded = landscape.prepare(&device, &queue, &mut encoder, &view)?;
    println!("{} bytes uploaded", uploaded.bytes);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &texture.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    let drawn = landscape.composite(&mut pass);
    println!("{} draw call", drawn.draws);
    drop(pass);

    // The rest reads the picture back, as a test or a tool would; a host with a window presents instead.
    let row = 4 * SIZE.width;
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: u64::from(row * SIZE.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row),
        rows_per_image: None,
    };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout,
        },
        SIZE,
    );
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let picture = buffer.slice(..).get_mapped_range()?.to_vec();
    let pixels = f64::from(SIZE.width * SIZE.height);
    Ok([0, 1, 2].map(|c| {
        picture
            .iter()
            .skip(c)
            .step_by(4)
            .map(|b| f64::from(*b))
            .sum::<f64>()
            / pixels
    }))
}

#[allow(dead_code)] // The tests call `draw`.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("mean colour {:.1?}", draw()?);
    Ok(())
}
