//! The evaluation of Leitner 2022, chapter 6: normal against low quality over a flight, cloud steps against time and error,
//! jitter against stripes.

use std::path::Path;

use serde_json::json;
use veduta::Value;

use super::plot::{Plot, Series};
use super::timing::{Middle, Ratio, Rounds, in_turns};
use super::{Bench, decibels, side_by_side, table, write_text};
use crate::commands::render::write_json;
use crate::error::CliError;
use crate::image::write_png;
use crate::metrics::{Difference, Picture, amplified};

/// Steps along the view ray.
pub const PRIMARY: [i64; 5] = [16, 32, 64, 128, 512];
/// Steps towards the sun.
pub const SECONDARY: [i64; 4] = [6, 12, 24, 32];

/// One second of the flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Second {
    /// Simulated seconds.
    pub time: f64,
    /// Milliseconds in normal quality.
    pub normal: f64,
    /// Milliseconds with LOW_QUALITY.
    pub low: f64,
}

/// One pair of cloud steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Along the view ray.
    pub primary: i64,
    /// Towards the sun.
    pub secondary: i64,
    /// Milliseconds.
    pub time: Middle,
    /// To 64 and 12 steps.
    pub ratio: Ratio,
    /// From 512 and 32 steps.
    pub difference: Difference,
}

/// A picture of the jitter's comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    /// Along the view ray.
    pub primary: i64,
    /// Without jitter.
    pub off: Difference,
    /// With it.
    pub on: Difference,
    /// How alike neighbouring pixels' errors are, without jitter: 1 stripes, 0 noise.
    pub stripes_off: f64,
    /// With it.
    pub stripes_on: f64,
}

/// The whole evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The flight.
    pub flight: Vec<Second>,
    /// The sweep.
    pub sweep: Vec<Steps>,
    /// The jitter.
    pub jitter: Vec<Jitter>,
}

/// How much of it is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Frames of the flight, a simulated second each.
    pub seconds: u32,
    /// Rounds of timing of the sweep.
    pub rounds: Rounds,
    /// Only the cheapest pairs of steps, for tests.
    pub quick: bool,
}

fn steps(primary: i64, secondary: i64) -> [(&'static str, Value); 2] {
    [
        ("CLOUD_STEPS", Value::Int(primary)),
        ("CLOUD_LIGHT_STEPS", Value::Int(secondary)),
    ]
}

/// The view of the sweep and of the jitter: two thirds sky, as in the source.
const VIEW: &str = "V01";

/// The correlation of the errors of pixels that are neighbours in a row.
///
/// Of luminance, where there is an error at all; 0 without any.
pub fn stripes(picture: &Picture, reference: &Picture) -> f64 {
    let error: Vec<f64> = picture
        .rgb
        .chunks_exact(3)
        .zip(reference.rgb.chunks_exact(3))
        .map(|(a, b)| (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).sum())
        .collect();
    let (mut product, mut square) = (0.0, 0.0);
    for row in error.chunks_exact(picture.width) {
        for pair in row.windows(2) {
            product += pair[0] * pair[1];
            square += 0.5 * (pair[0] * pair[0] + pair[1] * pair[1]);
        }
    }
    if square == 0.0 { 0.0 } else { product / square }
}

/// Runs the evaluation and writes pictures into `folder` as it goes; `progress` hears what is next.
///
/// # Errors
/// Faults of the device, files that cannot be written.
pub fn run(
    bench: &Bench,
    plan: &Plan,
    folder: &Path,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))?;
    let (width, height) = (bench.size.width as usize, bench.size.height as usize);
    let flown = |preset: &str| {
        let mut args = bench.base.clone();
        args.scene = "thesis".to_owned();
        args.preset = Some(preset.to_owned());
        crate::commands::render::Job::new(&args)
    };
    let (normal, low) = (flown("thesis")?, flown("thesis_low")?);
    let mut subjects = vec![bench.subject(&normal, 0.0)?, bench.subject(&low, 0.0)?];
    for subject in &mut subjects {
        subject.renderer.warm_up(&subject.view)?;
    }
    let mut flight = Vec::new();
    for second in 0..plan.seconds {
        progress(&format!("flight: second {second} of {}", plan.seconds));
        let time = f64::from(second);
        subjects[0].view = normal.view(time, bench.size)?;
        subjects[1].view = low.view(time, bench.size)?;
        // In turns: even seconds begin with normal quality.
        let order = if second % 2 == 0 { [0, 1] } else { [1, 0] };
        let mut times = [0.0; 2];
        for k in order {
            times[k] = subjects[k].draw(bench.clock)?;
        }
        flight.push(Second {
            time,
            normal: times[0],
            low: times[1],
        });
    }
    drop(subjects);

    progress("cloud steps: reference");
    let (primary, secondary): (&[i64], &[i64]) = if plan.quick {
        (&PRIMARY[..2], &SECONDARY[..2])
    } else {
        (&PRIMARY, &SECONDARY)
    };
    let finest = if plan.quick {
        steps(64, 12)
    } else {
        steps(512, 32)
    };
    let converged = bench.job("thesis", "thesis", VIEW, &finest)?;
    let reference = bench.reference(&converged, 0.0, 1)?;
    let exposure = bench.exposure(&converged);
    let pairs: Vec<(i64, i64)> = primary
        .iter()
        .flat_map(|p| secondary.iter().map(|s| (*p, *s)))
        .collect();
    let mut jobs = vec![bench.job("thesis", "thesis", VIEW, &steps(64, 12))?];
    for (p, s) in &pairs {
        jobs.push(bench.job("thesis", "thesis", VIEW, &steps(*p, *s))?);
    }
    let mut subjects = jobs
        .iter()
        .map(|j| bench.subject(j, 0.0))
        .collect::<Result<Vec<_>, _>>()?;
    let mut draws = 0;
    let times = in_turns(&mut subjects, &[0], bench.clock, plan.rounds, &mut || {
        draws += 1;
        progress(&format!("cloud steps: draw {draws}"));
    })?;
    drop(subjects);
    let mut sweep = Vec::new();
    for (k, (p, s)) in pairs.iter().enumerate() {
        progress(&format!("cloud steps: picture of {p} x {s}"));
        let picture = bench.picture(&jobs[k + 1], 0.0, 1)?;
        sweep.push(Steps {
            primary: *p,
            secondary: *s,
            time: Middle::of(&times[k + 1]),
            ratio: Ratio::of(&times[k + 1], &times[0]),
            difference: picture.difference(&reference, exposure)?,
        });
    }

    let mut jitter = Vec::new();
    let mut shown = Vec::new();
    for p in if plan.quick { &[16][..] } else { &[16, 64][..] } {
        progress(&format!("jitter with {p} steps"));
        let [off, on] = [false, true].map(|on| {
            let values = [&steps(*p, 12)[..], &[("CLOUD_JITTER", Value::Flag(on))]].concat();
            bench.picture(&bench.job("thesis", "thesis", VIEW, &values)?, 0.0, 1)
        });
        let (off, on) = (off?, on?);
        jitter.push(Jitter {
            primary: *p,
            off: off.difference(&reference, exposure)?,
            on: on.difference(&reference, exposure)?,
            stripes_off: stripes(&off, &reference),
            stripes_on: stripes(&on, &reference),
        });
        shown.extend([off.display(exposure), on.display(exposure)]);
        let magnified: Vec<Vec<u8>> = [&off, &on]
            .map(|p| amplified(&p.display(exposure), &reference.display(exposure)))
            .into();
        let (w, h, rgb) = side_by_side(&magnified, width, height);
        write_png(&folder.join(format!("jitter_{p}_error_x8.png")), w, h, &rgb)?;
    }
    shown.push(reference.display(exposure));
    let (w, h, rgb) = side_by_side(&shown, width, height);
    write_png(&folder.join("jitter.png"), w, h, &rgb)?;
    Ok(Report {
        flight,
        sweep,
        jitter,
    })
}

/// The tables of a report.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let mut text = format!(
        "# Chapter 6 of Leitner 2022, repeated\n\nWritten by `{command}`.\n\n{}\n",
        bench.machine()
    );
    let column =
        |f: fn(&Second) -> f64| Middle::of(&report.flight.iter().map(f).collect::<Vec<_>>());
    let (normal, low) = (column(|s| s.normal), column(|s| s.low));
    let ratio = Ratio::of(
        &report.flight.iter().map(|s| s.normal).collect::<Vec<_>>(),
        &report.flight.iter().map(|s| s.low).collect::<Vec<_>>(),
    );
    let extremes = |f: fn(&Second) -> f64| {
        let values = report.flight.iter().map(f);
        values.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)))
    };
    text += &format!(
        "## Normal quality and LOW_QUALITY over {} s of flight\n\nOne frame a simulated second, both qualities in turns.\n\n",
        report.flight.len()
    );
    let mut rows = vec![
        [
            "quality",
            "median [ms]",
            "quartiles [ms]",
            "least and most [ms]",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for (name, middle, (least, most)) in [
        ("normal (`thesis`)", normal, extremes(|s| s.normal)),
        ("LOW_QUALITY (`thesis_low`)", low, extremes(|s| s.low)),
    ] {
        rows.push(vec![
            name.to_owned(),
            format!("{:.1}", middle.median),
            format!("{:.1} to {:.1}", middle.quartiles.0, middle.quartiles.1),
            format!("{least:.1} to {most:.1}"),
        ]);
    }
    text += &table(&rows);
    text += &format!(
        "\nNormal quality takes {ratio} times as long as LOW_QUALITY (median of the frames' ratios). ![flight](flight.svg)\n\n"
    );
    text += "## Cloud steps\n\nTime over that of 64 x 12 steps, and PSNR in dB against 512 x 32 steps, view V01. A ratio in parentheses scattered too\nmuch to conclude from.\n\n";
    let mut secondary: Vec<i64> = report.sweep.iter().map(|s| s.secondary).collect();
    secondary.sort_unstable();
    secondary.dedup();
    let mut head = vec!["primary \\ secondary".to_owned()];
    head.extend(secondary.iter().map(i64::to_string));
    let (mut times, mut errors) = (vec![head.clone()], vec![head]);
    let mut primary: Vec<i64> = report.sweep.iter().map(|s| s.primary).collect();
    primary.dedup();
    for p in primary {
        let row = |cell: &dyn Fn(&Steps) -> String| {
            let mut row = vec![p.to_string()];
            row.extend(report.sweep.iter().filter(|s| s.primary == p).map(cell));
            row
        };
        times.push(row(&|s| s.ratio.to_string()));
        errors.push(row(&|s| decibels(s.difference.psnr)));
    }
    text += &table(&times);
    text += "\n";
    text += &table(&errors);
    text += "\n![cloud steps](cloud_steps.svg)\n\n## Jitter\n\nThe stripes' measure is the correlation of the errors of neighbouring pixels: 1 for stripes, 0 for noise. Pictures, from\nthe left: 16 steps without and with jitter, 64 steps without and with, reference. ![jitter](jitter.png) Errors, eight times:\n![16 steps](jitter_16_error_x8.png)\n\n";
    let mut rows = vec![
        [
            "primary steps",
            "PSNR without [dB]",
            "PSNR with [dB]",
            "stripes without",
            "stripes with",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for j in &report.jitter {
        rows.push(vec![
            j.primary.to_string(),
            decibels(j.off.psnr),
            decibels(j.on.psnr),
            format!("{:.3}", j.stripes_off),
            format!("{:.3}", j.stripes_on),
        ]);
    }
    text + &table(&rows)
}

/// Writes tables, JSON and plots beside the pictures.
///
/// # Errors
/// [`CliError::Write`].
pub fn write(bench: &Bench, report: &Report, command: &str, folder: &Path) -> Result<(), CliError> {
    write_text(
        &folder.join("chapter6.md"),
        &markdown(bench, report, command),
    )?;
    let document = json!({
        "flight": report.flight.iter().map(|s| json!([s.time, s.normal, s.low])).collect::<Vec<_>>(),
        "cloud_steps": report.sweep.iter().map(|s| json!({
            "primary": s.primary, "secondary": s.secondary, "time_ms": s.time.median, "ratio": s.ratio.median,
            "uncertainty": s.ratio.uncertainty, "conclusive": s.ratio.conclusive(), "psnr_db": s.difference.psnr,
            "flip": s.difference.flip, "relative_rmse": s.difference.relative_rmse,
        })).collect::<Vec<_>>(),
        "jitter": report.jitter.iter().map(|j| json!({
            "primary": j.primary, "psnr_off_db": j.off.psnr, "psnr_on_db": j.on.psnr,
            "stripes_off": j.stripes_off, "stripes_on": j.stripes_on,
        })).collect::<Vec<_>>(),
    });
    write_json(&folder.join("chapter6.json"), &document)?;
    let line = |name: &str, f: fn(&Second) -> f64| Series {
        name: name.to_owned(),
        points: report
            .flight
            .iter()
            .map(|s| (s.time, f(s), String::new()))
            .collect(),
        joined: true,
    };
    Plot {
        title: "Time of a frame over the flight",
        x: "simulated time [s]",
        y: &format!("{} of a frame [ms]", bench.clock.describe()),
        log_x: false,
        series: &[
            line("normal (thesis)", |s| s.normal),
            line("LOW_QUALITY (thesis_low)", |s| s.low),
        ],
    }
    .write(&folder.join("flight.svg"))?;
    let series: Vec<Series> = SECONDARY
        .iter()
        .map(|secondary| Series {
            name: format!("{secondary} steps to the sun"),
            points: report
                .sweep
                .iter()
                .filter(|s| s.secondary == *secondary)
                .map(|s| (s.ratio.median, s.difference.psnr, s.primary.to_string()))
                .collect(),
            joined: true,
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    Plot {
        title: "Cloud steps: PSNR against 512 x 32 steps over time",
        x: "time over that of 64 x 12 steps (logarithmic)",
        y: "PSNR [dB]",
        log_x: true,
        series: &series,
    }
    .write(&folder.join("cloud_steps.svg"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_and_noise_are_told_apart() {
        let flat = Picture::new(64, 8, vec![1.0; 3 * 64 * 8]).unwrap();
        let with = |f: &dyn Fn(usize, usize) -> f32| {
            let rgb = (0..64 * 8)
                .flat_map(|i| [1.0 + f(i % 64, i / 64); 3])
                .collect();
            Picture::new(64, 8, rgb).unwrap()
        };
        let bands = with(&|_, y| if y % 2 == 0 { 0.1 } else { -0.1 });
        let noise = with(&|x, y| {
            if (x * 7919 + y * 104_729) / 3 % 2 == 0 {
                0.1
            } else {
                -0.1
            }
        });
        assert!((stripes(&bands, &flat) - 1.0).abs() < 1e-6);
        assert!(stripes(&noise, &flat).abs() < 0.5);
        assert_eq!(stripes(&flat, &flat), 0.0);
    }
}
