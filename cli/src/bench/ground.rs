//! What a step of the living ground costs, by scheme, and what sleeping tiles spare.

use serde_json::json;
use veduta::glam::Vec3;
use veduta::ground::{
    Boundary, CHANNELS, Erosion, Ground, GroundCamera, GroundOptions, GroundPicture,
    GroundPictureOptions, GroundState, Scheme,
};
use veduta::terrain::TerrainLights;
use veduta::{Targets, View, WorldPos, wgpu};

use super::timing::Middle;
use super::{Bench, table};
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::render::{Size, picture};

/// Cells along each axis.
const SIZE: usize = 1024;

/// Steps of one measurement.
const STEPS: u32 = 6;

/// What a step of the source's scheme cannot do without: each field read once (water, what rounding took from it, mean, ground, four speeds) and each that changes written once, by
/// the same threads in the same order, and nothing computed.
const COPY: &str = "
@group(0) @binding(0) var<storage, read> source: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> into: array<vec4<f32>>;
@compute @workgroup_size(8)
fn copy(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let plane = arrayLength(&source) / 8u;
    for (var row = 0u; row < 32u; row++) {
        let at = id.x * 256u + row * 8u + lane;
        into[at] = source[at] + source[at + 7u * plane];
        into[at + plane] = source[at + plane];
        into[at + 2u * plane] = source[at + 2u * plane];
        into[at + 3u * plane] = source[at + 3u * plane];
        into[at + 4u * plane] = source[at + 4u * plane];
        into[at + 5u * plane] = source[at + 5u * plane];
        into[at + 6u * plane] = source[at + 6u * plane];
    }
}
";

/// Single floats that [`COPY`] reads and writes a cell.
const COPIED: f64 = 15.0;

/// Single floats that a step reads and writes a cell, counted from the programs: the source's scheme without and with erosion, the physical one.
const TOUCHED: [f64; 3] = [25.5, 43.0, 22.5];

struct Copy {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

impl Copy {
    fn new(device: &wgpu::Device) -> Copy {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("copy"),
            source: wgpu::ShaderSource::Wgsl(COPY.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("copy"),
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        let planes = || {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("planes"),
                size: (8 * SIZE * SIZE * 4) as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let buffers = [planes(), planes()];
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(&buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("copy"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Copy { pipeline, group }
    }

    fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        for _ in 0..STEPS {
            pass.dispatch_workgroups((SIZE * SIZE / 1024) as u32, 1, 1);
        }
    }
}

/// Pixels of the pictures.
const PICTURE: Size = Size {
    width: 256,
    height: 144,
};

/// A picture of a ground, by itself, and its frame.
struct Drawing {
    picture: GroundPicture,
    view: View,
    lights: TerrainLights,
    /// Of the colour and of the depth.
    views: [wgpu::TextureView; 2],
}

impl Drawing {
    fn new(device: &wgpu::Device, ground: &Ground) -> Result<Drawing, CliError> {
        let depth = wgpu::TextureFormat::Depth32Float;
        let targets = Targets {
            depth_format: Some(depth),
            ..Default::default()
        };
        let camera = GroundCamera::over(ground.size(), 1.0, ground.range());
        let aspect = f64::from(PICTURE.width) / f64::from(PICTURE.height);
        let options = GroundPictureOptions::default();
        Ok(Drawing {
            picture: GroundPicture::new(device, veduta::programs(), &targets, ground, &options)?,
            view: camera.view(WorldPos::default(), aspect)?,
            lights: TerrainLights {
                sun: Vec3::splat(0.8),
                sky: Vec3::splat(0.15),
                bounce: Vec3::splat(0.1),
            },
            views: [targets.color_format, depth]
                .map(|format| picture(device, PICTURE, format).create_view(&Default::default())),
        })
    }

    fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        ground: &Ground,
    ) -> Result<(), CliError> {
        let _ = self
            .picture
            .prepare(queue, encoder, ground, &self.view, &self.lights)?;
        Ok(())
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.views[0],
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.views[1],
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let _ = self.picture.draw_opaque(&mut pass);
    }
}

/// The worlds: a name, options, and the share of the columns that hold moving water.
fn worlds() -> Vec<(&'static str, GroundOptions, f64)> {
    let source = GroundOptions {
        boundary: Boundary::Closed,
        ..Default::default()
    };
    let eroding = GroundOptions {
        erosion: Some(Erosion::default()),
        ..source.clone()
    };
    let physical = GroundOptions {
        scheme: Scheme::Physical,
        step: 0.02,
        ..source.clone()
    };
    vec![
        ("source", source.clone(), 1.0),
        ("source with erosion", eroding, 1.0),
        ("physical", physical.clone(), 1.0),
        ("source, half dry", source.clone(), 0.5),
        ("physical, half dry", physical, 0.5),
        ("source, still", source, 0.0),
    ]
}

fn state(share: f64) -> Result<GroundState, CliError> {
    let heights: Vec<f32> = (0..SIZE * SIZE)
        .map(|k| {
            let (x, z) = ((k % SIZE) as f32, (k / SIZE) as f32);
            let wall = if share < 1.0 && (x - share as f32 * SIZE as f32).abs() < 1.0 {
                30.0
            } else {
                0.0
            };
            3.0 * (0.031 * x).sin() * (0.023 * z).cos() + (0.11 * x + 0.07 * z).sin() + wall
        })
        .collect();
    let mut state = GroundState::from_heights(SIZE, SIZE, &heights)?;
    for (k, cell) in state.cells.chunks_exact_mut(CHANNELS).enumerate() {
        let (x, z) = ((k % SIZE) as f32, (k / SIZE) as f32);
        if f64::from(x) + 1.0 < share * SIZE as f64 {
            cell[1] = 2.0 + (0.2 * x).sin() * (0.3 * z).sin();
            cell[3] = cell[1];
        }
    }
    Ok(state)
}

/// Processor seconds a step, of each world and round, and the share of tiles that ran.
#[derive(Debug, Clone)]
pub struct Report {
    /// By world: name, seconds of each round, share of tiles that ran, bytes a cell.
    pub worlds: Vec<(&'static str, Vec<f64>, f64, f64)>,
    /// Processor seconds of each round for what a step reads and writes at least.
    pub copy: Vec<f64>,
    /// Processor seconds of each round for finding levels and normals, for drawing, and for a frame with one step of the source's scheme.
    pub drawn: [Vec<f64>; 3],
}

/// Measures all worlds in turn, `rounds` times.
///
/// # Errors
/// What the library reports.
pub fn run(
    bench: &Bench,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    let gpu = &bench.gpu;
    let mut grounds = Vec::new();
    let time =
        |steps: u32, record: &mut dyn FnMut(&mut wgpu::CommandEncoder)| -> Result<f64, CliError> {
            let before = CpuTime::now();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            record(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
            gpu.device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|e| veduta::Error::Device(e.to_string()))?;
            Ok(match (before, CpuTime::now()) {
                (Some(before), Some(after)) => after.since(&before) / 1e3 / f64::from(steps),
                _ => f64::NAN,
            })
        };
    for (name, options, share) in worlds() {
        let mut ground = Ground::new(
            &gpu.device,
            &gpu.queue,
            veduta::programs(),
            &options,
            &state(share)?,
        )?;
        // The first steps compile, and dry tiles fall asleep.
        time(3, &mut |encoder| {
            let _ = ground.step(encoder, 3);
        })?;
        grounds.push((name, ground, Vec::new()));
    }
    let copy = Copy::new(&gpu.device);
    time(STEPS, &mut |encoder| copy.record(encoder))?;
    let mut copied = Vec::new();
    let mut drawn = [const { Vec::new() }; 3];
    let mut drawing = Drawing::new(&gpu.device, &grounds[0].1)?;
    time(1, &mut |encoder| {
        let _ = drawing.prepare(&gpu.queue, encoder, &grounds[0].1);
        drawing.draw(encoder);
    })?;
    for _ in 0..rounds {
        for (name, ground, times) in &mut grounds {
            progress(name);
            times.push(time(STEPS, &mut |encoder| {
                let _ = ground.step(encoder, STEPS);
            })?);
        }
        copied.push(time(STEPS, &mut |encoder| copy.record(encoder))?);
        progress("drawing");
        let (_, ground, _) = &mut grounds[0];
        let mut fault = Ok(());
        // As if it had changed.
        let options = ground.options().clone();
        ground.set_options(&gpu.queue, &options)?;
        drawn[0].push(time(1, &mut |encoder| {
            fault = drawing.prepare(&gpu.queue, encoder, ground);
        })?);
        std::mem::replace(&mut fault, Ok(()))?;
        drawn[1].push(time(1, &mut |encoder| drawing.draw(encoder))?);
        drawn[2].push(time(1, &mut |encoder| {
            let _ = ground.step(encoder, 1);
            fault = drawing.prepare(&gpu.queue, encoder, ground);
            drawing.draw(encoder);
        })?);
        fault?;
    }
    let mut found = Vec::new();
    for (name, ground, times) in grounds {
        let report = ground.report(gpu)?;
        let share = f64::from(report.active_tiles) / f64::from(report.tiles);
        found.push((
            name,
            times,
            share,
            ground.bytes() as f64 / (SIZE * SIZE) as f64,
        ));
    }
    Ok(Report {
        worlds: found,
        copy: copied,
        drawn,
    })
}

/// The table.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let mut rows = vec![
        [
            "world",
            "ns a cell and step",
            "million cell steps a processor second",
            "tiles that ran",
            "bytes a cell",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for (name, times, share, bytes) in &report.worlds {
        let middle = Middle::of(times).median;
        let cells = (SIZE * SIZE) as f64;
        rows.push(vec![
            (*name).to_owned(),
            format!("{:.2}", middle / cells * 1e9),
            format!("{:.1}", cells / middle / 1e6),
            format!("{:.0} %", 100.0 * share),
            format!("{bytes:.0}"),
        ]);
    }
    let cells = (SIZE * SIZE) as f64;
    let copy = Middle::of(&report.copy).median / cells * 1e9;
    rows.push(vec![
        "copy of 8 planes into 7".to_owned(),
        format!("{copy:.2}"),
        format!("{:.1}", 1e3 / copy),
        "100 %".to_owned(),
        "64".to_owned(),
    ]);
    let bounds: Vec<Vec<String>> = ["source", "source with erosion", "physical"]
        .iter()
        .zip(TOUCHED)
        .map(|(name, touched)| {
            let least = touched * copy / COPIED;
            vec![
                (*name).to_owned(),
                format!("{touched:.1}"),
                format!("{least:.1}"),
                format!("{:.0}", 1e3 / least),
            ]
        })
        .collect();
    let mut frames = vec![
        [
            "of a frame",
            "ms",
            "ns a cell",
            "million cells a processor second",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    let names = [
        "levels and normals, when the ground has changed".to_owned(),
        format!("drawing at {}x{}", PICTURE.width, PICTURE.height),
        "one step of the source's scheme, levels, normals and drawing".to_owned(),
    ];
    for (name, times) in names.into_iter().zip(&report.drawn) {
        let middle = Middle::of(times).median;
        frames.push(vec![
            name,
            format!("{:.1}", middle * 1e3),
            format!("{:.2}", middle / cells * 1e9),
            format!("{:.1}", cells / middle / 1e6),
        ]);
    }
    let heads = [
        "scheme",
        "floats read and written a cell",
        "ns at the copy's pace",
        "million cell steps a second at most",
    ];
    let bounds = [vec![heads.map(str::to_owned).to_vec()], bounds].concat();
    format!(
        "# What a step of the living ground costs\n\nWritten by `{command}`.\n\n{}\nProcessor time of the process at {SIZE} x {SIZE} cells, medians of {} rounds of {STEPS} steps, the worlds in turn.\n\n{}\n\
         The copy reads every field of the source's scheme once, writes every field that changes once, and computes nothing. What the schemes read and write at its pace:\n\n{}\n\
         Drawing, with the water of the source's world: a `GroundPicture` alone, without sky.\n\n{}",
        bench.machine(),
        report.worlds.first().map_or(0, |w| w.1.len()),
        table(&rows),
        table(&bounds),
        table(&frames),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, report: &Report, command: &str) -> serde_json::Value {
    let mut document = bench.head(command);
    document["worlds"] = report
        .worlds
        .iter()
        .map(|(name, times, share, bytes)| {
            json!({
                "world": name,
                "seconds_a_step": times,
                "cell_steps_a_processor_second": (SIZE * SIZE) as f64 / Middle::of(times).median,
                "tiles_that_ran": share,
                "bytes_a_cell": bytes,
            })
        })
        .collect();
    document["drawn_seconds"] = json!({
        "prepare": report.drawn[0], "draw": report.drawn[1], "frame_with_a_step": report.drawn[2],
    });
    document["copy_seconds"] = report.copy.clone().into();
    document
}
