//! What a step of the living ground costs, by scheme, and what sleeping tiles spare.

use serde_json::json;
use veduta::ground::{Boundary, CHANNELS, Erosion, Ground, GroundOptions, GroundState, Scheme};
use veduta::wgpu;

use super::timing::Middle;
use super::{Bench, table};
use crate::cpu::CpuTime;
use crate::error::CliError;

/// Cells along each axis.
const SIZE: usize = 1024;

/// Steps of one measurement.
const STEPS: u32 = 6;

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
    let run = |ground: &mut Ground, steps: u32| -> Result<f64, CliError> {
        let before = CpuTime::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = ground.step(&mut encoder, steps);
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
        run(&mut ground, 3)?;
        grounds.push((name, ground, Vec::new()));
    }
    for _ in 0..rounds {
        for (name, ground, times) in &mut grounds {
            progress(name);
            times.push(run(ground, STEPS)?);
        }
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
    Ok(Report { worlds: found })
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
    format!(
        "# What a step of the living ground costs\n\nWritten by `{command}`.\n\n{}\nProcessor time of the process at {SIZE} x {SIZE} cells, medians of {} rounds of {STEPS} steps, the worlds in turn.\n\n{}",
        bench.machine(),
        report.worlds.first().map_or(0, |w| w.1.len()),
        table(&rows),
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
    document
}
