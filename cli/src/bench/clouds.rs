//! What a layer of clouds costs at equal error: the system `Clouds` beside the loop of the preset `thesis`.

use std::time::Instant;

use serde_json::json;
use veduta::clouds::{CloudLights, CloudQuality, Clouds, CloudsOptions};
use veduta::glam::Vec3;
use veduta::program::Value;
use veduta::{Preset, Targets, View, wgpu};

use super::timing::Middle;
use super::{Bench, decibels, table};
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::metrics::Picture;
use crate::render::picture;

/// Counts of the loop along the ray and towards the sun that stand for the converged picture.
pub(super) const CONVERGED: (i64, i64) = (512, 32);

/// Counts of the loop that are compared.
const LOOPS: [(i64, i64); 5] = [(64, 12), (128, 12), (128, 24), (192, 24), (256, 24)];

/// Texels, levels and steps of the system, and whether texels have 16 bits a number.
const FINENESS: [(u32, u32, u32, bool); 18] = [
    (128, 32, 32, false),
    (128, 32, 48, false),
    (192, 32, 48, false),
    (192, 64, 48, false),
    (192, 32, 64, false),
    (256, 64, 48, false),
    (256, 64, 64, false),
    (256, 64, 96, false),
    (384, 64, 64, false),
    (384, 64, 96, false),
    (384, 64, 128, false),
    (512, 64, 128, false),
    (512, 64, 192, false),
    (512, 96, 192, false),
    (512, 128, 256, false),
    (512, 64, 192, true),
    (512, 96, 192, true),
    (512, 128, 256, true),
];

/// Steps, and whether with half resolution and shifted starts.
const OPTIONS: [(u32, bool, bool); 5] = [
    (96, false, false),
    (96, true, false),
    (32, false, false),
    (32, false, true),
    (48, true, true),
];

/// Frames of the sun that moves, and degrees a frame: one a second at 30 frames a second.
const FRAMES: usize = 72;
const TURN: f64 = 1.0 / 30.0;

/// A loop or a count of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What it is.
    pub name: String,
    /// Milliseconds of a frame.
    pub time: f64,
    /// Against the converged loop, dB.
    pub psnr: f64,
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The view.
    pub view: String,
    /// The loop of `thesis`.
    pub loops: Vec<Point>,
    /// The same with skipping.
    pub skipping: Vec<Point>,
    /// The system under a sun that stands.
    pub system: Vec<Point>,
    /// The same with options.
    pub options: Vec<Point>,
    /// The first frame with the quality of `high` and a first tile of 256, bake included.
    pub first: Point,
    /// Frames of a sun that moves, bakes included: mean time, and the least PSNR.
    pub moving: Point,
    /// Bytes on the device of `low`, `medium`, `high` and of the tile above.
    pub bytes: [u64; 4],
}

fn spent(what: impl FnOnce() -> Result<(), CliError>) -> Result<f64, CliError> {
    let (cpu, wall) = (CpuTime::now(), Instant::now());
    what()?;
    Ok(match (cpu, CpuTime::now()) {
        (Some(before), Some(after)) => after.since(&before),
        _ => wall.elapsed().as_secs_f64() * 1e3,
    })
}

/// Where clouds are drawn: light, and transmittance in alpha.
pub(super) struct Canvas<'a> {
    pub bench: &'a Bench,
    pub texture: wgpu::Texture,
    /// The picture without clouds.
    pub bare: &'a Picture,
}

impl Canvas<'_> {
    /// A frame; milliseconds.
    fn draw(&self, clouds: &mut Clouds, view: &View) -> Result<f64, CliError> {
        Ok(self.draw_and_count(clouds, view)?.0)
    }

    /// A frame; milliseconds, and what it has baked.
    pub fn draw_and_count(&self, clouds: &mut Clouds, view: &View) -> Result<(f64, u32), CliError> {
        let gpu = &self.bench.gpu;
        let lights = CloudLights {
            sun: view.sun.irradiance,
            above: Vec3::ZERO,
            below: Vec3::ZERO,
        };
        let target = self.texture.create_view(&Default::default());
        let mut bakes = 0;
        let time = spent(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            bakes = clouds
                .prepare(&gpu.queue, &mut encoder, view, &lights)?
                .bakes;
            let _ = clouds.encode_volumes(&mut encoder)?;
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &target,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations {
                            load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                            store: wgpu::StoreOp::Store,
                        },
                    })],
                    ..Default::default()
                });
                let _ = clouds.composite(&mut pass)?;
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|e| veduta::Error::Device(e.to_string()))?;
            Ok(())
        })?;
        Ok((time, bakes))
    }

    /// What was drawn, over the picture without clouds.
    pub fn picture(&self) -> Result<Picture, CliError> {
        let bytes = self.bench.gpu.read_texture(&self.texture)?;
        let number = |b: &[u8]| half(u16::from_le_bytes([b[0], b[1]]));
        let rgb = bytes
            .chunks_exact(8)
            .zip(self.bare.rgb.chunks_exact(3))
            .flat_map(|(p, bare)| {
                let left = number(&p[6..]);
                [0, 1, 2].map(|k| number(&p[2 * k..]) + left * bare[k])
            })
            .collect();
        Picture::new(self.bare.width, self.bare.height, rgb)
    }
}

/// A number of 16 bits, finite and not negative.
fn half(bits: u16) -> f32 {
    let (exponent, rest) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    if exponent == 0 {
        rest * 2.0_f32.powi(-24)
    } else {
        (1.0 + rest / 1024.0) * 2.0_f32.powi(exponent - 15)
    }
}

fn median(times: &[f64]) -> f64 {
    Middle::of(times).median
}

/// Measures.
///
/// # Errors
/// Faults of the device.
pub fn run(
    bench: &Bench,
    view_name: &str,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    let gpu = &bench.gpu;
    let size = bench.size;
    let job = |steps: (i64, i64), skip: bool, clouds: bool| {
        bench.job(
            "sky",
            if skip { "thesis_skip" } else { "thesis" },
            view_name,
            &[
                ("ATMOSPHERE", Value::Flag(false)),
                ("CLOUDS", Value::Flag(clouds)),
                ("CLOUD_STEPS", Value::Int(steps.0)),
                ("CLOUD_LIGHT_STEPS", Value::Int(steps.1)),
            ],
        )
    };
    progress("converged picture");
    let converged = job(CONVERGED, false, true)?;
    let exposure = bench.exposure(&converged);
    let truth = bench.reference(&converged, 0.0, 1)?;
    let view = converged.view(0.0, size)?;

    let mut pictures: [Vec<Point>; 2] = Default::default();
    for (skip, points) in [false, true].into_iter().zip(&mut pictures) {
        for steps in LOOPS {
            let name = format!("{} x {}", steps.0, steps.1);
            progress(&name);
            let job = job(steps, skip, true)?;
            let psnr = bench
                .picture(&job, 0.0, 1)?
                .difference(&truth, exposure)?
                .psnr;
            let mut subject = bench.subject(&job, 0.0)?;
            subject.renderer.warm_up(&subject.view)?;
            let mut times = Vec::new();
            for _ in 0..rounds.clamp(1, 3) {
                times.push(subject.draw(bench.clock)?);
            }
            points.push(Point {
                name,
                time: median(&times),
                psnr,
            });
        }
    }
    let [loops, skipping] = pictures;

    // What clouds are laid over: the same picture without any.
    let bare = bench.picture(&job((1, 1), false, false)?, 0.0, 1)?;
    let texture = picture(&gpu.device, size, wgpu::TextureFormat::Rgba16Float);
    let canvas = Canvas {
        bench,
        texture,
        bare: &bare,
    };
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        ..Default::default()
    };
    let programs = veduta::programs();
    let system = |quality: CloudQuality| {
        // As the loop scatters.
        let options = CloudsOptions {
            quality,
            orders: veduta::clouds::Orders::Single,
            ..Default::default()
        };
        let mut clouds = Clouds::new(&gpu.device, programs, &targets, &options)?;
        if quality.half {
            clouds.set_size(&gpu.device, [size.width, size.height])?;
        }
        Ok::<Clouds, CliError>(clouds)
    };
    let fine = CloudQuality {
        texels: 512,
        second_tile: false,
        frames: 1,
        ..CloudQuality::of(&Preset::High)
    };
    let plain = FINENESS.map(|(texels, levels, steps, wide)| {
        let bits = if wide { 16 } else { 8 };
        let name = format!("tile of {texels} x {texels} x {levels}, {bits} bits, {steps} steps");
        let quality = CloudQuality {
            texels,
            first_texels: texels,
            levels,
            steps,
            wide,
            ..fine
        };
        (name, quality)
    });
    let optional = OPTIONS.map(|(steps, half, jitter)| {
        let name = format!(
            "tile of 384 x 384 x 64, {steps} steps{}{}",
            if half { ", half resolution" } else { "" },
            if jitter {
                ", starts shifted by the mask"
            } else {
                ""
            }
        );
        let quality = CloudQuality {
            texels: 384,
            first_texels: 384,
            steps,
            half,
            jitter,
            ..fine
        };
        (name, quality)
    });
    let mut points = Vec::new();
    for (name, quality) in plain.into_iter().chain(optional) {
        progress(&name);
        let mut clouds = system(quality)?;
        for _ in 0..3 {
            canvas.draw(&mut clouds, &view)?;
        }
        let psnr = canvas.picture()?.difference(&truth, exposure)?.psnr;
        let mut times = Vec::new();
        for k in 0..rounds.max(3) {
            // They drift, as far as a wind of 10 m/s takes them in a frame; the tile stays.
            let mut drifted = view;
            drifted.eye = view
                .eye
                .moved_by(veduta::glam::DVec3::new(k as f64 / 3.0, 0.0, 0.0));
            times.push(canvas.draw(&mut clouds, &drifted)?);
        }
        points.push(Point {
            name,
            time: median(&times),
            psnr,
        });
    }

    let options = points.split_off(FINENESS.len());

    progress("first frame");
    let high = CloudQuality {
        first_texels: 256,
        ..CloudQuality::of(&Preset::High)
    };
    let mut times = Vec::new();
    let mut psnr = 0.0;
    for _ in 0..3 {
        let mut clouds = system(high)?;
        times.push(canvas.draw(&mut clouds, &view)?);
        psnr = canvas.picture()?.difference(&truth, exposure)?.psnr;
    }
    let first = Point {
        name: format!(
            "first frame, tile of {0} x {0} x {1}, 96 steps",
            high.first_texels, high.levels
        ),
        time: median(&times),
        psnr,
    };

    progress("moving sun");
    let mut clouds = system(CloudQuality {
        texels: 256,
        first_texels: 192,
        steps: 48,
        frames: 16,
        ..high
    })?;
    let mut times = Vec::new();
    let mut worst = f64::INFINITY;
    let mut moved = job(CONVERGED, false, true)?;
    for k in 0..FRAMES {
        moved.camera.sun_height = converged.camera.sun_height + TURN * k as f64;
        let view = moved.view(0.0, size)?;
        let time = canvas.draw(&mut clouds, &view)?;
        // The first frame has a figure of its own.
        if k > 0 {
            times.push(time);
        }
        if k % 24 == 23 {
            let truth = bench.reference(&moved, 0.0, 1)?;
            let psnr = canvas.picture()?.difference(&truth, exposure)?.psnr;
            worst = worst.min(psnr);
        }
    }
    let moving = Point {
        name: format!(
            "sun of 1 degree a second, tile of 256 x 256 x 64 in 16 frames, 48 steps, mean of {} frames",
            times.len()
        ),
        time: times.iter().sum::<f64>() / times.len() as f64,
        psnr: worst,
    };
    let bytes = |quality: CloudQuality| -> Result<u64, CliError> {
        let options = CloudsOptions {
            quality,
            ..Default::default()
        };
        let held = Clouds::new(&gpu.device, programs, &targets, &options)?.resources();
        Ok(held.texture_bytes + held.buffer_bytes)
    };
    Ok(Report {
        view: view_name.to_owned(),
        loops,
        skipping,
        system: points,
        options,
        first,
        moving,
        bytes: [
            bytes(CloudQuality::of(&Preset::Low))?,
            bytes(CloudQuality::of(&Preset::Medium))?,
            bytes(CloudQuality::of(&Preset::High))?,
            bytes(fine)?,
        ],
    })
}

/// Time of the system at a PSNR: between the cheapest points on both sides of it, by the logarithm of the time; none above its best.
pub(super) fn time_at(points: &[Point], psnr: f64) -> Option<f64> {
    let mut best: Vec<&Point> = points.iter().collect();
    best.sort_by(|a, b| a.time.total_cmp(&b.time));
    let mut reached = f64::NEG_INFINITY;
    best.retain(|p| {
        let better = p.psnr > reached;
        reached = reached.max(p.psnr);
        better
    });
    if best.first().is_some_and(|p| p.psnr >= psnr) {
        return best.first().map(|p| p.time);
    }
    best.windows(2)
        .find(|w| w[0].psnr < psnr && w[1].psnr >= psnr)
        .map(|w| {
            let share = (psnr - w[0].psnr) / (w[1].psnr - w[0].psnr);
            (w[0].time.ln() + share * (w[1].time / w[0].time).ln()).exp()
        })
}

/// The report as a document.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let ratio = |p: &Point| {
        time_at(&report.system, p.psnr)
            .map_or("none so good".to_owned(), |t| format!("{:.1}", p.time / t))
    };
    let heads = [
        "what",
        "frame [ms]",
        "PSNR [dB]",
        "times dearer than the system at that PSNR",
    ];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    let mut row = |name: String, p: &Point, last: String| {
        rows.push(vec![name, format!("{:.1}", p.time), decibels(p.psnr), last]);
    };
    for p in &report.loops {
        row(format!("loop of `thesis`, {}", p.name), p, ratio(p));
    }
    for p in &report.skipping {
        row(format!("the same with skipping, {}", p.name), p, ratio(p));
    }
    for p in report.system.iter().chain(&report.options) {
        row(format!("`Clouds`, {}", p.name), p, "-".to_owned());
    }
    for p in [&report.first, &report.moving] {
        let cheaper = time_at(&report.loops, p.psnr).map_or("none so good".to_owned(), |t| {
            format!("the loop takes {:.1} times as long for it", t / p.time)
        });
        row(format!("`Clouds`, {}", p.name), p, cheaper);
    }
    let mib = report.bytes.map(|b| b as f64 / f64::from(1 << 20));
    format!(
        "Written by `{command}`.\n\n{}\nView {}, the clouds of the preset `thesis` alone, without air, scattered once; PSNR of the tone-mapped picture \
         against the loop with {} x {} steps.\nThe sun stands and the clouds drift, but in the last row. Memory, light of all orders: `low` {:.1}, `medium` {:.1}, \
         `high` {:.1} MiB, and {:.1} MiB with the tile of 512.\n\n{}",
        bench.machine(),
        report.view,
        CONVERGED.0,
        CONVERGED.1,
        mib[0],
        mib[1],
        mib[2],
        mib[3],
        table(&rows),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, report: &Report, command: &str) -> serde_json::Value {
    let list = |points: &[Point]| -> Vec<serde_json::Value> {
        points
            .iter()
            .map(|p| json!({ "name": p.name, "ms": p.time, "psnr_db": p.psnr }))
            .collect()
    };
    let mut document = bench.head(command);
    document["view"] = report.view.clone().into();
    document["loops"] = list(&report.loops).into();
    document["skipping"] = list(&report.skipping).into();
    document["system"] = list(&report.system).into();
    document["options"] = list(&report.options).into();
    document["first_and_moving"] = list(&[report.first.clone(), report.moving.clone()]).into();
    document["bytes"] = report.bytes.to_vec().into();
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_lie_between_those_measured() {
        let point = |time: f64, psnr: f64| Point {
            name: String::new(),
            time,
            psnr,
        };
        let points = [point(1.0, 30.0), point(4.0, 40.0)];
        assert_eq!(time_at(&points, 35.0), Some(2.0));
        assert_eq!(time_at(&points, 20.0), Some(1.0));
        assert_eq!(time_at(&points, 41.0), None);
    }

    #[test]
    fn halves_are_read() {
        for (bits, value) in [
            (0x3c00, 1.0),
            (0x3555, 0.333_25),
            (0, 0.0),
            (1, 5.960_464_5e-8),
            (0x7bff, 65504.0),
        ] {
            assert!((half(bits) - value).abs() <= 1e-4 * value, "{bits:x}");
        }
    }
}
