//! What a layer that does not repeat costs an eye that flies: windows about the eye beside the loop of the preset `thesis`, bakes included.

use serde_json::json;
use veduta::clouds::{CloudDeck, CloudQuality, Clouds, CloudsOptions, Orders, WindowQuality};
use veduta::program::Value;
use veduta::{Preset, Targets, wgpu};

use super::clouds::{CONVERGED, Canvas, Point, time_at};
use super::{Bench, decibels, table};
use crate::error::CliError;
use crate::metrics::Picture;
use crate::render::picture;

/// The clouds repeat after 2 to this power wavelengths: 16384 km.
const DOUBLINGS: u32 = 12;
/// Speed of the eye (m/s), frames a second and frames.
const SPEED: f64 = 100.0;
const RATE: f64 = 30.0;
const FRAMES: usize = 240;
/// Pictures are judged in every so manieth frame, and the loop is drawn there too.
const JUDGED: usize = 80;
/// Counts of the loop that are compared.
const LOOPS: [(i64, i64); 3] = [(64, 12), (96, 12), (128, 12)];
/// The PSNR of the aim (dB).
const AIM: f64 = 36.0;

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The view that the flight begins with.
    pub view: String,
    /// The loop of `thesis`, means over the judged places.
    pub loops: Vec<Point>,
    /// The same with skipping.
    pub skipping: Vec<Point>,
    /// The system, means over all frames but the first, and of the PSNR.
    pub system: Vec<Point>,
    /// Of each of those: the first frame's time, the longest other, the share of frames that baked, and bytes on the device.
    pub more: Vec<(f64, f64, f64, u64)>,
}

/// Qualities that fly, and which light they show.
fn qualities() -> Vec<(String, CloudQuality, Orders)> {
    let of = |name: &str, preset: Preset, steps: u32, orders: Orders| {
        let quality = CloudQuality {
            steps,
            ..CloudQuality::of(&preset)
        };
        let WindowQuality { texels, levels, .. } = quality.windows;
        let light = match orders {
            Orders::All => ", light of all orders",
            Orders::Single => "",
        };
        let text =
            format!("`{name}`, windows of {texels} x {texels} x {levels}, {steps} steps{light}");
        (text, quality, orders)
    };
    vec![
        of("low", Preset::Low, 24, Orders::Single),
        of("low", Preset::Low, 64, Orders::Single),
        of("medium", Preset::Medium, 48, Orders::Single),
        of("medium", Preset::Medium, 96, Orders::Single),
        of("high", Preset::High, 64, Orders::Single),
        of("high", Preset::High, 96, Orders::Single),
        of("high", Preset::High, 128, Orders::Single),
        of("high", Preset::High, 96, Orders::All),
    ]
}

/// Measures.
///
/// # Errors
/// Faults of the device.
pub fn run(
    bench: &Bench,
    view_name: &str,
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
                ("CLOUD_PERIOD_DOUBLINGS", Value::Int(i64::from(DOUBLINGS))),
                ("CAM_SPEED", Value::Float(SPEED)),
            ],
        )
    };
    let converged = job(CONVERGED, false, true)?;
    let exposure = bench.exposure(&converged);
    let judged: Vec<usize> = (1..=FRAMES).filter(|k| k % JUDGED == 0).collect();
    let mut truths: Vec<Picture> = Vec::new();
    for frame in &judged {
        progress(&format!("converged picture of frame {frame}"));
        truths.push(bench.reference(&converged, *frame as f64 / RATE, 1)?);
    }
    let bare = bench.picture(&job((1, 1), false, false)?, 0.0, 1)?;
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        ..Default::default()
    };
    let canvas = Canvas {
        bench,
        texture: picture(&gpu.device, size, wgpu::TextureFormat::Rgba16Float),
        bare: &bare,
    };
    // All of them fly side by side, and the loop is drawn where pictures are judged, so that a slow time of the machine is one for all.
    let mut flyers = Vec::new();
    for (name, quality, orders) in qualities() {
        let options = CloudsOptions {
            quality,
            deck: CloudDeck {
                period_doublings: DOUBLINGS,
                ..Default::default()
            },
            orders,
            ..Default::default()
        };
        let clouds = Clouds::new(&gpu.device, veduta::programs(), &targets, &options)?;
        // The loop scatters once: other light is not judged by it.
        let psnr = match orders {
            Orders::Single => 0.0,
            Orders::All => f64::NAN,
        };
        flyers.push((name, clouds, Vec::new(), psnr, 0));
    }
    let mut loops = Vec::new();
    for skip in [false, true] {
        for steps in LOOPS {
            let job = job(steps, skip, true)?;
            loops.push((steps, skip, job, Vec::new(), 0.0));
        }
    }
    for frame in 0..=FRAMES {
        let time = frame as f64 / RATE;
        let view = converged.view(time, size)?;
        if frame % 20 == 0 {
            progress(&format!("frame {frame} of {FRAMES}"));
        }
        let place = judged.iter().position(|k| *k == frame);
        for (_, clouds, times, psnr, baked) in &mut flyers {
            let (spent, bakes) = canvas.draw_and_count(clouds, &view)?;
            times.push(spent);
            *baked += usize::from(bakes > 0 && frame > 0);
            if let Some(at) = place {
                let found = canvas.picture()?.difference(&truths[at], exposure)?.psnr;
                *psnr += found / judged.len() as f64;
            }
        }
        let Some(at) = place else { continue };
        for (_, _, job, times, psnr) in &mut loops {
            let found = bench.picture(job, time, 1)?;
            let found = found.difference(&truths[at], exposure)?.psnr;
            *psnr += found / judged.len() as f64;
            let mut subject = bench.subject(job, time)?;
            subject.renderer.warm_up(&subject.view)?;
            times.push(subject.draw(bench.clock)?);
        }
    }
    let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
    let points = |wanted: bool| -> Vec<Point> {
        loops
            .iter()
            .filter(|(_, skip, ..)| *skip == wanted)
            .map(|(steps, _, _, times, psnr)| Point {
                name: format!("{} x {}", steps.0, steps.1),
                time: mean(times),
                psnr: *psnr,
            })
            .collect()
    };
    let system = flyers
        .iter()
        .map(|(name, _, times, psnr, _)| Point {
            name: name.clone(),
            time: mean(&times[1..]),
            psnr: *psnr,
        })
        .collect();
    let more = flyers
        .iter()
        .map(|(_, clouds, times, _, baked)| {
            let held = clouds.resources();
            let longest = times[1..].iter().fold(0.0_f64, |a, b| a.max(*b));
            (
                times[0],
                longest,
                *baked as f64 / FRAMES as f64,
                held.texture_bytes + held.buffer_bytes,
            )
        })
        .collect();
    Ok(Report {
        view: view_name.to_owned(),
        loops: points(false),
        skipping: points(true),
        system,
        more,
    })
}

/// How much dearer points of the loop are than the system at the PSNR of the aim.
fn ratio(loops: &[Point], system: &[Point]) -> Option<f64> {
    let judged: Vec<Point> = system
        .iter()
        .filter(|p| !p.psnr.is_nan())
        .cloned()
        .collect();
    Some(time_at(loops, AIM)? / time_at(&judged, AIM)?)
}

/// The report as a document.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let heads = [
        "what",
        "frame [ms]",
        "PSNR [dB]",
        "loop of that PSNR, times as dear",
        "first frame [ms]",
        "longest frame after it [ms]",
        "frames that bake [%]",
        "memory [MiB]",
    ];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    let dash = || "-".to_owned();
    for (name, points) in [
        ("loop of `thesis`", &report.loops),
        ("the same with skipping", &report.skipping),
    ] {
        for p in points {
            let text = format!("{name}, {}", p.name);
            let mut row = vec![text, format!("{:.1}", p.time), decibels(p.psnr)];
            row.extend((0..5).map(|_| dash()));
            rows.push(row);
        }
    }
    for (p, (first, longest, baked, bytes)) in report.system.iter().zip(&report.more) {
        let cheaper = time_at(&report.loops, p.psnr).filter(|_| !p.psnr.is_nan());
        let psnr = if p.psnr.is_nan() {
            dash()
        } else {
            decibels(p.psnr)
        };
        rows.push(vec![
            p.name.clone(),
            format!("{:.1}", p.time),
            psnr,
            cheaper.map_or(dash(), |t| format!("{:.1}", t / p.time)),
            format!("{first:.0}"),
            format!("{longest:.0}"),
            format!("{:.1}", 100.0 * baked),
            format!("{:.1}", *bytes as f64 / f64::from(1 << 20)),
        ]);
    }
    let text = |found: Option<f64>| found.map_or("none so good".to_owned(), |r| format!("{r:.1}"));
    format!(
        "Written by `{command}`.\n\n{}\nView {}, from which the eye flies ahead at {SPEED:.0} m/s, {FRAMES} frames of {RATE:.0} a second; the clouds of the preset `thesis` with \
         {DOUBLINGS} doublings of the period, alone, without air, scattered once.\nPSNR of the tone-mapped picture against the loop with {} x {} steps, mean over {} places; times of \
         the system are means over all frames but the first, bakes included, of all qualities in turns.\nAt {AIM:.0} dB the loop takes {} times as long as the cheapest quality, \
         the loop with skipping {} times.\n\n{}",
        bench.machine(),
        report.view,
        CONVERGED.0,
        CONVERGED.1,
        FRAMES / JUDGED,
        text(ratio(&report.loops, &report.system)),
        text(ratio(&report.skipping, &report.system)),
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
    document["more"] = report
        .more
        .iter()
        .map(|(first, longest, baked, bytes)| {
            json!({ "first_ms": first, "longest_ms": longest, "frames_that_bake": baked, "bytes": bytes })
        })
        .collect();
    document["ratio_at_36_db"] = ratio(&report.loops, &report.system).into();
    document["ratio_of_skipping_at_36_db"] = ratio(&report.skipping, &report.system).into();
    document
}
