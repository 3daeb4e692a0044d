//! What the sky costs and how far it is off: tables and draws of each preset beside marches without tables.

use std::time::Instant;

use serde_json::json;
use veduta::atmosphere::{
    Atmosphere, Eye, FastProbe, Orders, Probe, ProbeLight, ProbeOptions, ProbeRay, Sky, SkyOptions,
    SkyQuality, SkyTables,
};
use veduta::program::Value;
use veduta::reference::monte_carlo::Random;
use veduta::reference::probe::{Effort, probe as reference};
use veduta::view::direction;
use veduta::{Preset, Settings, Targets, View, WorldPos, wgpu};

use super::baseline::{AIM_SPEED, Gauge, Speed};
use super::timing::Middle;
use super::{Bench, table};
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::render::picture;

/// The presets that are measured.
pub const PRESETS: [&str; 3] = ["low", "medium", "high"];

/// Counts of marches without tables from which those are taken whose error is at most that of the tables: steps along the ray and towards the sun, the cheaper first.
const MARCHES: [[u32; 2]; 16] = [
    [2, 1],
    [2, 2],
    [3, 2],
    [4, 2],
    [3, 3],
    [4, 3],
    [6, 2],
    [5, 4],
    [6, 4],
    [8, 4],
    [8, 6],
    [12, 6],
    [16, 8],
    [24, 10],
    [32, 12],
    [48, 16],
];

/// Rays that errors are measured on.
const RAYS: usize = 600;

/// Milliseconds of one round.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Times {
    /// Every table.
    pub all: f64,
    /// The tables that follow the sun.
    pub sun: f64,
    /// The sky with current tables.
    pub draw: f64,
}

/// One round.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The machine's speed at that moment.
    pub speed: Speed,
    /// Of each preset.
    pub presets: Vec<Times>,
    /// A march of 16 steps and 8 towards the sun at every pixel: the preset `thesis`.
    pub thesis: f64,
    /// Marches without tables that are as exact as `high`: at the 99th centile, in the median.
    pub march: [f64; 2],
}

/// Relative errors against the f64 reference: median and 99th centile.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    /// Median.
    pub median: f64,
    /// 99th centile.
    pub most: f64,
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Errors of each preset's light scattered once.
    pub errors: Vec<Errors>,
    /// Counts and errors of the marches without tables.
    pub marches: [([u32; 2], Errors); 2],
    /// Bytes of each preset's tables.
    pub bytes: Vec<u64>,
}

fn spent<T>(what: impl FnOnce() -> Result<T, CliError>) -> Result<f64, CliError> {
    let (cpu, wall) = (CpuTime::now(), Instant::now());
    what()?;
    Ok(match (cpu, CpuTime::now()) {
        (Some(before), Some(after)) => after.since(&before),
        _ => wall.elapsed().as_secs_f64() * 1e3,
    })
}

/// Rays from 2 m to 36,000 km under suns of 0 to 96 degrees from the zenith, 12 from each eye.
pub fn rays(count: usize) -> Vec<ProbeRay> {
    let mut random = Random::new(1, 1);
    let (radius, top) = (6.36e6, 1e5);
    let mut rays = Vec::with_capacity(count);
    let (mut altitude, mut sun) = (0.0, 0.0);
    for i in 0..count {
        if i % 12 == 0 {
            altitude = (2.0_f64.ln() + random.unit() * (1.8e7_f64).ln()).exp();
            sun = (96.0 * random.unit()).to_radians();
        }
        let r: f64 = radius + altitude;
        let horizon = -(altitude * (2.0 * radius + altitude)).sqrt() / r;
        // Towards the air: anywhere, or dense on both sides of the horizon.
        let share = if i % 3 == 0 {
            random.unit()
        } else {
            random.unit().powi(3)
        };
        let mu = if altitude > top {
            let lowest: f64 = if i % 2 == 0 {
                radius + top * share
            } else {
                radius * (1.0 - share).sqrt()
            };
            -(1.0 - (lowest / r).powi(2)).max(0.0).sqrt()
        } else if i % 2 == 0 {
            horizon + (1.0 - horizon) * share
        } else {
            horizon - (1.0 + horizon) * share
        };
        let turn = std::f64::consts::TAU * random.unit();
        let sine = (1.0 - mu * mu).max(0.0).sqrt();
        rays.push(ProbeRay {
            altitude,
            dir: [sine * turn.cos(), mu, sine * turn.sin()],
            to_sun: [sun.sin(), sun.cos(), 0.0],
            distance: f64::INFINITY,
        });
    }
    rays
}

fn errors(found: &[ProbeLight], truth: &[[f64; 3]]) -> Errors {
    let mut all: Vec<f64> = found
        .iter()
        .zip(truth)
        .flat_map(|(f, t)| {
            (0..3).map(|k| (f64::from(f.in_scatter[k]) - t[k]).abs() / t[k].max(1e-6))
        })
        .collect();
    all.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * all.len().saturating_sub(1) as f64;
        all.get(place.round() as usize).copied().unwrap_or(0.0)
    };
    Errors {
        median: at(0.5),
        most: at(0.99),
    }
}

struct Subject {
    /// Every table there is, the air before things too.
    tables: SkyTables,
    sky: Sky,
    view: View,
    turn: u32,
}

impl Subject {
    /// Draws, or makes the tables.
    fn frame(
        &mut self,
        bench: &Bench,
        target: Option<&wgpu::TextureView>,
    ) -> Result<f64, CliError> {
        let gpu = &bench.gpu;
        spent(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let sun = &self.view.sun;
            let eye = Eye {
                altitude: self.view.eye.altitude(),
                to_sun: sun.to_light.as_dvec3().normalize().to_array(),
                sun_angular_radius: f64::from(sun.angular_radius),
            };
            if target.is_none() {
                let _ = self.tables.prepare(&gpu.queue, &mut encoder, &eye)?;
            }
            if let Some(view) = target {
                let _ = self.sky.prepare(&gpu.queue, &mut encoder, &self.view)?;
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view,
                        depth_slice: None,
                        resolve_target: None,
                        ops: Default::default(),
                    })],
                    ..Default::default()
                });
                let _ = self.sky.composite(&mut pass)?;
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|e| veduta::Error::Device(e.to_string()))?;
            Ok(())
        })
    }

    fn times(&mut self, bench: &Bench, target: &wgpu::TextureView) -> Result<Times, CliError> {
        self.turn += 1;
        let step = f64::from(self.turn % 64);
        let sun = direction((20.0 + 0.1 * step).to_radians(), 0.3);
        self.view.sun.to_light = sun.as_vec3();
        let moved = self.frame(bench, None)?;
        let mut air = self.tables.atmosphere().clone();
        air.thickness = 1e5 + 1.0 + step;
        self.tables.set_atmosphere(&air)?;
        let all = self.frame(bench, None)?;
        // The first draw after other work warms the caches.
        self.frame(bench, Some(target))?;
        Ok(Times {
            all,
            sun: moved,
            draw: self.frame(bench, Some(target))?,
        })
    }
}

/// Measures times and errors.
///
/// # Errors
/// Faults of the device.
pub fn run(
    bench: &Bench,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    let gpu = &bench.gpu;
    let programs = veduta::programs();
    let air = Atmosphere::default();
    let quality = |preset: &str| -> Result<SkyQuality, CliError> {
        let preset = Preset::Named(preset.to_owned().into());
        Ok(SkyQuality::of(&Settings::resolve(
            programs,
            &preset,
            None,
            &[],
        )?))
    };

    progress("errors");
    let rays = rays(RAYS);
    let effort = Effort::default();
    let truth: Vec<[f64; 3]> = reference(&air, &rays, Orders::Single, &effort)?
        .iter()
        .map(|found| found.in_scatter)
        .collect();
    let mut found = Vec::new();
    for preset in PRESETS {
        let quality = SkyQuality {
            all_orders: false,
            ..quality(preset)?
        };
        let mut probe = FastProbe::new(&gpu.device, programs, &air, &quality, 0)?;
        found.push(errors(&probe.run(&gpu.device, &gpu.queue, &rays)?, &truth));
    }
    let high = found[PRESETS.len() - 1];
    let mut marches = [None; 2];
    for [steps, light_steps] in MARCHES {
        if marches.iter().all(Option::is_some) {
            break;
        }
        let options = ProbeOptions {
            steps,
            light_steps,
            ..Default::default()
        };
        let march = Probe::new(&gpu.device, programs, &air, &options)?;
        let off = errors(&march.run(&gpu.device, &gpu.queue, &rays)?, &truth);
        for (kept, fits) in marches
            .iter_mut()
            .zip([off.most <= high.most, off.median <= high.median])
        {
            if fits && kept.is_none() {
                *kept = Some(([steps, light_steps], off));
            }
        }
    }
    // The last of the list, when none is as exact.
    let marches = marches.map(|m| m.unwrap_or((MARCHES[MARCHES.len() - 1], Errors::default())));

    let size = bench.size;
    let texture = picture(&gpu.device, size, wgpu::TextureFormat::Rgba16Float);
    let target = texture.create_view(&Default::default());
    let mut view = View {
        eye: WorldPos::from_metres(veduta::glam::DVec3::new(0.0, 2.0, 0.0)),
        ..Default::default()
    };
    view.look(0.3, 0.5, 1.0, size.width as f32 / size.height as f32);
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        ..Default::default()
    };
    let mut subjects = Vec::new();
    for preset in PRESETS {
        let options = SkyOptions {
            preset: Preset::Named(preset.into()),
            ..Default::default()
        };
        subjects.push(Subject {
            tables: SkyTables::with_ground(&gpu.device, programs, &air, &quality(preset)?)?,
            sky: Sky::new(&gpu.device, programs, &targets, &options)?,
            view,
            turn: 0,
        });
    }
    let mut job = bench.job("sky", "thesis", "V01", &[("CLOUDS", Value::Flag(false))])?;
    job.options.scene = "sky".to_owned();
    let mut thesis = bench.subject(&job, 0.0)?;
    thesis.renderer.warm_up(&thesis.view)?;
    let mut marched = Vec::new();
    for (counts, _) in marches {
        let options = SkyOptions {
            march: Some(counts),
            ..Default::default()
        };
        marched.push(Subject {
            tables: SkyTables::with_ground(&gpu.device, programs, &air, &quality("low")?)?,
            sky: Sky::new(&gpu.device, programs, &targets, &options)?,
            view,
            turn: 0,
        });
    }
    let gauge = Gauge::new(&bench.gpu, &job.catalog.library()?)?;
    for subject in &mut subjects {
        subject.times(bench, &target)?;
    }
    for subject in &mut marched {
        subject.frame(bench, Some(&target))?;
    }
    let mut done = Vec::new();
    for k in 0..rounds.max(1) {
        progress(&format!("round {} of {}", k + 1, rounds.max(1)));
        let speed = gauge.speed()?;
        let presets = subjects
            .iter_mut()
            .map(|subject| subject.times(bench, &target))
            .collect::<Result<_, _>>()?;
        let mut march = [0.0; 2];
        for (time, subject) in march.iter_mut().zip(&mut marched) {
            *time = subject.frame(bench, Some(&target))?;
        }
        done.push(Round {
            speed,
            presets,
            thesis: thesis.draw(bench.clock)?,
            march,
        });
    }
    Ok(Report {
        rounds: done,
        errors: found,
        marches,
        bytes: subjects
            .iter()
            .map(|s| s.tables.resources().texture_bytes)
            .collect(),
    })
}

/// Median of the rounds as measured, and at the speed of the aim.
fn medians(report: &Report, of: &dyn Fn(&Round) -> f64) -> [f64; 2] {
    let column = |f: &dyn Fn(&Round) -> f64| {
        Middle::of(&report.rounds.iter().map(f).collect::<Vec<f64>>()).median
    };
    [
        column(of),
        column(&|r| of(r) * r.speed.side_by_side / AIM_SPEED.side_by_side),
    ]
}

/// The report as a document.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let heads = [
        "what",
        "all tables [ms]",
        "after the sun moved [ms]",
        "sky [ms]",
        "thesis march / sky",
        "march as exact / sky: 99th centile, median",
        "median error",
        "99th centile",
        "tables [KiB]",
    ];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    let both = |[measured, scaled]: [f64; 2]| format!("{measured:.1} ({scaled:.1})");
    let percent = |e: f64| format!("{:.2} %", 100.0 * e);
    let over = |above: &dyn Fn(&Round) -> f64, k: usize| {
        let ratios: Vec<f64> = report
            .rounds
            .iter()
            .map(|r| above(r) / r.presets[k].draw)
            .collect();
        format!("{:.1}", Middle::of(&ratios).median)
    };
    for (k, preset) in PRESETS.iter().enumerate() {
        rows.push(vec![
            format!("`{preset}`"),
            both(medians(report, &|r| r.presets[k].all)),
            both(medians(report, &|r| r.presets[k].sun)),
            both(medians(report, &|r| r.presets[k].draw)),
            over(&|r| r.thesis, k),
            format!("{}, {}", over(&|r| r.march[0], k), over(&|r| r.march[1], k)),
            percent(report.errors[k].median),
            percent(report.errors[k].most),
            format!("{:.0}", report.bytes[k] as f64 / 1024.0),
        ]);
    }
    let dash = || "-".to_owned();
    for (k, ([steps, light_steps], off)) in report.marches.iter().enumerate() {
        rows.push(vec![
            format!("march without tables, {steps} x {light_steps}"),
            dash(),
            dash(),
            both(medians(report, &|r| r.march[k])),
            dash(),
            dash(),
            percent(off.median),
            percent(off.most),
            "0".to_owned(),
        ]);
    }
    rows.push(vec![
        "aim for `high`".to_owned(),
        "(30)".to_owned(),
        "(15)".to_owned(),
        "(8)".to_owned(),
        "12".to_owned(),
        "8".to_owned(),
        dash(),
        dash(),
        "4096".to_owned(),
    ]);
    rows.push(vec![
        "march of the preset `thesis`, 16 x 8".to_owned(),
        dash(),
        dash(),
        both(medians(report, &|r| r.thesis)),
        dash(),
        dash(),
        dash(),
        dash(),
        "0".to_owned(),
    ]);
    let speeds: Vec<f64> = report.rounds.iter().map(|r| r.speed.side_by_side).collect();
    format!(
        "# What the sky costs and how far it is off\n\nWritten by `{command}`.\n\n{}\n\
         Milliseconds, medians of {} rounds; in parentheses at the speed of a machine that makes {:.0} million PCG hashes a second in\n\
         four chains side by side, where this one made {:.0} in the middle. Atmosphere `earth`, eye at 2 m. *All tables* is everything\n\
         after a change of the air, *after the sun moved* what follows the sun. Errors are of light scattered once, relative to the f64\n\
         reference with a floor of 1e-6 of the sun's irradiance, on {RAYS} rays from 2 m to 36,000 km under suns of 0 to 96 degrees from the\n\
         zenith. The marches without tables are drawn over the same view (`SkyOptions::march`), with the fewest steps that are as exact as `high` on these rays at the\n\
         99th centile and in the median. The sky of the tables has light of all orders in it at no further cost for a picture; the marches have the first alone.\n\n{}",
        bench.machine(),
        report.rounds.len(),
        AIM_SPEED.side_by_side,
        Middle::of(&speeds).median,
        table(&rows),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, report: &Report, command: &str) -> serde_json::Value {
    let list: Vec<serde_json::Value> = PRESETS
        .iter()
        .enumerate()
        .map(|(k, preset)| {
            json!({
                "preset": preset,
                "all_tables": medians(report, &|r| r.presets[k].all),
                "sun_moved": medians(report, &|r| r.presets[k].sun),
                "sky": medians(report, &|r| r.presets[k].draw),
                "median_error": report.errors[k].median,
                "centile_99_error": report.errors[k].most,
                "bytes": report.bytes[k],
            })
        })
        .collect();
    let mut document = bench.head(command);
    document["presets"] = list.into();
    let marches: Vec<serde_json::Value> = report
        .marches
        .iter()
        .enumerate()
        .map(|(k, (counts, off))| {
            json!({
                "counts": counts,
                "time": medians(report, &|r| r.march[k]),
                "median_error": off.median,
                "centile_99_error": off.most,
            })
        })
        .collect();
    document["marches"] = marches.into();
    document["thesis"] = json!(medians(report, &|r| r.thesis));
    document
}
