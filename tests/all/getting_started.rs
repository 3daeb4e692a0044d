//! The code of the documents, compiled and run as it stands there.

// [scenery]
use veduta::{Landscape, LandscapeOptions, Preset, Targets, View, wgpu};

struct Scenery {
    landscape: Landscape,
}

impl Scenery {
    /// Once, and again when the quality changes.
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Result<Scenery, veduta::Error> {
        let targets = Targets {
            color_format: format,
            ..Default::default()
        };
        let options = LandscapeOptions {
            preset: Preset::Low,
            ..Default::default()
        };
        let landscape = Landscape::new(device, veduta::programs(), &targets, &options)?;
        Ok(Scenery { landscape })
    }

    /// Each frame, before your pass.
    fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        seconds: f64,
    ) -> Result<(), veduta::Error> {
        let mut view = View {
            time: seconds,
            ..Default::default()
        };
        view.look(0.5, 0.1, 1.0, 16.0 / 9.0);
        let work = self.landscape.prepare(device, queue, encoder, &view)?;
        println!("{} bytes uploaded", work.bytes);
        Ok(())
    }

    /// Each frame, in your pass; cannot fail.
    fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let work = self.landscape.composite(pass);
        println!("{} draw call", work.draws);
    }
}
// [end]

/// The text between two marks of this file, moved to the left by `indent`.
fn marked(name: &str, indent: &str) -> String {
    let (_, rest) = include_str!("getting_started.rs")
        .split_once(&format!("{indent}// [{name}]\n"))
        .unwrap();
    let (text, _) = rest.split_once(&format!("{indent}// [end]\n")).unwrap();
    text.lines()
        .map(|l| format!("{}\n", l.strip_prefix(indent).unwrap_or(l)))
        .collect()
}

fn target(gpu: &veduta::device::Gpu, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("target"),
        size: wgpu::Extent3d {
            width: 32,
            height: 18,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    })
}

/// Submits, and reports what the device has to say about it.
fn submit(gpu: &veduta::device::Gpu, encoder: wgpu::CommandEncoder) {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    gpu.queue.submit([encoder.finish()]);
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .unwrap();
    assert!(pollster::block_on(scope.pop()).is_none());
}

#[test]
fn the_code_of_getting_started_draws() {
    let document = include_str!("../../docs/getting-started.md");
    let code = marked("scenery", "");
    assert!(
        document.contains(&format!("```rust\n{code}```\n")),
        "docs/getting-started.md differs from\n{code}"
    );

    let gpu = pollster::block_on(veduta::device::Gpu::open()).unwrap();
    let format = wgpu::TextureFormat::Bgra8UnormSrgb;
    let view = target(&gpu, format);
    let mut scenery = Scenery::new(&gpu.device, format).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    scenery
        .prepare(&gpu.device, &gpu.queue, &mut encoder, 1.5)
        .unwrap();
    scenery.draw(&mut pass(&mut encoder, &view));
    submit(&gpu, encoder);
}

struct Surface {
    format: wgpu::TextureFormat,
}

/// The lines of the README inside a function, with what stands around them in an application.
fn readme(
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface: Surface,
    view_of_target: &wgpu::TextureView,
) -> Result<wgpu::CommandEncoder, veduta::Error> {
    let (yaw, pitch, vertical_field_of_view, aspect) = (0.5, 0.1, 1.0, 1.5);
    let mut encoder = device.create_command_encoder(&Default::default());
    // [readme]
    // Once: a pipeline for your target.
    let targets = veduta::Targets {
        color_format: surface.format,
        ..Default::default()
    };
    let options = veduta::LandscapeOptions::default();
    let mut landscape = veduta::Landscape::new(&device, veduta::programs(), &targets, &options)?;

    // Each frame: upload what has changed, then draw in your own pass.
    let mut view = veduta::View::default();
    view.look(yaw, pitch, vertical_field_of_view, aspect);
    let uploaded = landscape.prepare(&device, &queue, &mut encoder, &view)?;
    // [end]
    let mut pass = pass(&mut encoder, view_of_target);
    // [pass]
    let drawn = landscape.composite(&mut pass);
    // [end]
    drop(pass);
    assert!(uploaded.bytes > 0 && drawn.draws == 1);
    Ok(encoder)
}

#[test]
fn the_code_of_the_readme_draws() {
    let document = include_str!("../../README.md");
    let code = marked("readme", "    ") + &marked("pass", "    ");
    assert!(
        document.contains(&format!("```rust,ignore\n{code}```\n")),
        "README.md differs from\n{code}"
    );

    let gpu = pollster::block_on(veduta::device::Gpu::open()).unwrap();
    let format = wgpu::TextureFormat::Rgba16Float;
    let view = target(&gpu, format);
    let (device, queue) = (gpu.device.clone(), gpu.queue.clone());
    let encoder = readme(device, queue, Surface { format }, &view).unwrap();
    submit(&gpu, encoder);
}

#[test]
fn getting_started_shows_the_files_that_the_fixtures_build() {
    let document = include_str!("../../docs/getting-started.md");
    let dedented: String = document
        .lines()
        .map(|l| format!("{}\n", l.strip_prefix("   ").unwrap_or(l)))
        .collect();
    for (kind, file) in [
        (
            "rust,ignore",
            include_str!("../fixtures/downstream/named_preset/build.rs"),
        ),
        (
            "rust,ignore",
            include_str!("../fixtures/downstream/own_preset/build.rs"),
        ),
        (
            "ron",
            include_str!("../fixtures/downstream/own_preset/presets/handheld.ron"),
        ),
    ] {
        let block = format!("```{kind}\n{file}```\n");
        assert!(dedented.contains(&block), "{block}");
    }
    let build = include_str!("../../examples/own_shader/build.rs");
    assert!(document.contains(&format!("```rust,ignore\n{build}```\n")));
    assert_eq!(build.lines().count(), 3, "three lines");
}
