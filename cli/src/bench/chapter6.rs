//! The evaluation of Leitner 2022, chapter 6: normal against low quality over a flight, cloud steps against time and error,
//! jitter against stripes.

use std::path::Path;

use serde_json::json;
use veduta::Value;

use super::plot::{Plot, Point, Series};
use super::timing::{Middle, Ratio, Rounds, beside_bases};
use super::{Bench, decibels, side_by_side, table, write_text};
use crate::commands::render::write_json;
use crate::error::CliError;
use crate::image::write_png;
use crate::metrics::{Difference, amplified};

/// Steps along the view ray.
pub const PRIMARY: [i64; 5] = [16, 32, 64, 128, 512];
/// Steps towards the sun.
pub const SECONDARY: [i64; 4] = [6, 12, 24, 32];
/// Steps towards the sun of the pictures side by side.
const SHOWN: i64 = 12;

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
    /// [`stripes`] without jitter.
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

/// How far a neighbourhood's mean reaches in [`stripes`].
const REACH: usize = 3;

/// The correlation of the errors of pixels that are neighbours in a row, after what is smooth has been taken away: 1 for
/// stripes along the rows, about 0 for noise, -1 for stripes one pixel wide along the columns.
///
/// Of 8-bit RGB pictures as they are displayed, where stripes are seen; in radiance a few bright pixels would decide. From
/// each pixel's error, the sum of the channels, goes the mean of the 7x7 pixels around it, so that neither a constant nor a
/// linear bias counts; pixels nearer to the edge than that are left out. 0 where nothing to speak of is left.
pub fn stripes(shown: &[u8], wanted: &[u8], width: usize) -> f64 {
    let error: Vec<f64> = shown
        .chunks_exact(3)
        .zip(wanted.chunks_exact(3))
        .map(|(a, b)| (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).sum())
        .collect();
    let height = error.len() / width.max(1);
    let rest = |x: usize, y: usize| {
        let around: f64 = (y - REACH..=y + REACH)
            .flat_map(|y| &error[y * width + x - REACH..=y * width + x + REACH])
            .sum();
        error[y * width + x] - around / ((2 * REACH + 1) * (2 * REACH + 1)) as f64
    };
    let (mut product, mut square) = (0.0, 0.0);
    for y in REACH..height.saturating_sub(REACH) {
        let row: Vec<f64> = (REACH..width.saturating_sub(REACH))
            .map(|x| rest(x, y))
            .collect();
        for pair in row.windows(2) {
            product += pair[0] * pair[1];
            square += 0.5 * (pair[0] * pair[0] + pair[1] * pair[1]);
        }
    }
    // Otherwise the rounding of a smooth error would be judged.
    let whole: f64 = error.iter().map(|e| e * e).sum();
    if square <= 1e-6 * whole {
        0.0
    } else {
        product / square
    }
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
    let save = |name: &str, pictures: &[Vec<u8>]| {
        let (w, h, rgb) = side_by_side(pictures, width, height);
        write_png(&folder.join(name), w, h, &rgb)
    };
    let mut shown = Vec::new();
    for job in [&normal, &low] {
        shown.push(bench.picture(job, 0.0, 1)?.display(bench.exposure(job)));
    }
    save("flight_quality.png", &shown)?;

    progress("cloud steps: reference");
    let (primary, secondary): (&[i64], &[i64]) = if plan.quick {
        (&PRIMARY[..3], &SECONDARY[..2])
    } else {
        (&PRIMARY, &SECONDARY)
    };
    let converged = bench.job("thesis", "thesis", VIEW, &steps(512, 32))?;
    let reference = bench.reference(&converged, 0.0, 1)?;
    let exposure = bench.exposure(&converged);
    let wanted = reference.display(exposure);
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
    let turns = beside_bases(&mut subjects, &[0], bench.clock, plan.rounds, &mut || {
        draws += 1;
        progress(&format!("cloud steps: draw {draws}"));
    })?;
    drop(subjects);
    let mut sweep = Vec::new();
    let (mut shown, mut errors) = (Vec::new(), Vec::new());
    for (k, (p, s)) in pairs.iter().enumerate() {
        progress(&format!("cloud steps: picture of {p} x {s}"));
        let picture = bench.picture(&jobs[k + 1], 0.0, 1)?;
        if *s == SHOWN {
            let display = picture.display(exposure);
            errors.push(amplified(&display, &wanted));
            shown.push(display);
        }
        sweep.push(Steps {
            primary: *p,
            secondary: *s,
            time: Middle::of(&turns.times[k + 1]),
            // The base's own cell is the base.
            ratio: turns.ratio(if (*p, *s) == (64, 12) { 0 } else { k + 1 }, 0),
            difference: picture.difference(&reference, exposure)?,
        });
    }

    shown.push(wanted.clone());
    save("cloud_steps.png", &shown)?;
    save("cloud_steps_error_x8.png", &errors)?;

    let mut jitter = Vec::new();
    let mut shown = Vec::new();
    for p in if plan.quick { &[16][..] } else { &[16, 64][..] } {
        progress(&format!("jitter with {p} steps"));
        let [off, on] = [false, true].map(|on| {
            let values = [&steps(*p, SHOWN)[..], &[("CLOUD_JITTER", Value::Flag(on))]].concat();
            bench.picture(&bench.job("thesis", "thesis", VIEW, &values)?, 0.0, 1)
        });
        let (off, on) = (off?, on?);
        let displays = [off.display(exposure), on.display(exposure)];
        jitter.push(Jitter {
            primary: *p,
            off: off.difference(&reference, exposure)?,
            on: on.difference(&reference, exposure)?,
            stripes_off: stripes(&displays[0], &wanted, width),
            stripes_on: stripes(&displays[1], &wanted, width),
        });
        let magnified = displays.each_ref().map(|d| amplified(d, &wanted));
        save(&format!("jitter_{p}_error_x8.png"), &magnified)?;
        shown.extend(displays);
    }
    shown.push(wanted);
    save("jitter.png", &shown)?;
    Ok(Report {
        flight,
        sweep,
        jitter,
    })
}

/// What the error pictures have in common.
const MAGNIFIED: &str = "Grey is no difference; errors are magnified\neight times and clipped";

/// The tables of a report, with the pictures and plots that [`run`] and [`write()`] leave beside it.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let mut text = format!(
        "# Chapter 6 of Leitner 2022, repeated\n\nWritten by `{command}`. What it says against the source: [`reading.md`](reading.md).\n\n{}\n",
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
        "\nNormal quality takes {ratio} times as long as LOW_QUALITY (median of the frames' ratios).\n\n![time of a frame over the flight](flight.svg)\n\n\
         ![normal and LOW_QUALITY](flight_quality.png)\n\n\
         From the left: normal quality, LOW_QUALITY, both at second 0, as displayed.\n\n"
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
    let listed: Vec<String> = primary.iter().map(i64::to_string).collect();
    let listed = listed.join(", ");
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
    text += &format!(
        "\n![PSNR over time of the cloud steps](cloud_steps.svg)\n\n![cloud steps](cloud_steps.png)\n\n\
         From the left: {listed} primary steps with {SHOWN} secondary ones, then the reference, 512 x 32.\n\n\
         ![errors of the cloud steps](cloud_steps_error_x8.png)\n\n\
         The same pictures' errors, without the reference. {MAGNIFIED}.\n\n## Jitter\n\n"
    );
    text += "The stripes' measure is the correlation of the errors of neighbouring pixels in a row, of the displayed pictures, after\n\
             the mean of the 7x7 pixels around has been subtracted from each, so that neither a constant nor a linear bias counts: 1\n\
             for stripes along the rows, about 0 for noise.\n\n";
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
    text += &table(&rows);
    let shown: Vec<String> = report
        .jitter
        .iter()
        .map(|j| format!("{} primary steps without and with jitter", j.primary))
        .collect();
    text += &format!(
        "\n![jitter](jitter.png)\n\nFrom the left: {}, then the reference,\n512 x 32; all others with {SHOWN} secondary steps.\n",
        shown.join(",\n")
    );
    for j in &report.jitter {
        text += &format!(
            "\n![errors with {0} primary steps](jitter_{0}_error_x8.png)\n\n\
             From the left: errors of {0} primary steps without and with jitter. {MAGNIFIED}.\n",
            j.primary
        );
    }
    text
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
    let mut document = bench.head(command);
    let results = json!({
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
    if let (Some(head), Some(results)) = (document.as_object_mut(), results.as_object()) {
        head.extend(results.clone());
    }
    write_json(&folder.join("chapter6.json"), &document)?;
    let line = |name: &str, f: fn(&Second) -> f64| Series {
        name: name.to_owned(),
        points: report
            .flight
            .iter()
            .map(|s| Point {
                x: s.time,
                y: f(s),
                label: String::new(),
                conclusive: true,
            })
            .collect(),
        joined: true,
    };
    Plot {
        title: "Time of a frame over the flight",
        x: "simulated time [s]",
        y: &format!("{} of a frame [ms]", bench.clock.describe()),
        log_x: false,
        y_from_zero: true,
        series: &[
            line("normal (thesis)", |s| s.normal),
            line("LOW_QUALITY (thesis_low)", |s| s.low),
        ],
        notes: &[],
    }
    .write(&folder.join("flight.svg"))?;
    let series: Vec<Series> = SECONDARY
        .iter()
        .map(|secondary| Series {
            name: format!("{secondary} secondary steps (towards the sun)"),
            points: report
                .sweep
                .iter()
                .filter(|s| s.secondary == *secondary)
                .map(|s| Point {
                    x: s.ratio.median,
                    y: s.difference.psnr,
                    label: s.primary.to_string(),
                    conclusive: s.ratio.conclusive(),
                })
                .collect(),
            joined: true,
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    Plot {
        title: "Cloud steps: error over time; labels are primary steps, lines secondary steps",
        x: "time over that of 64 x 12 steps",
        y: "PSNR against 512 x 32 steps [dB]",
        log_x: true,
        y_from_zero: false,
        series: &series,
        notes: &[
            "labels: primary steps (along the view ray)",
            "512 x 32 is the reference and has no finite PSNR: it is left out",
        ],
    }
    .write(&folder.join("cloud_steps.svg"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_and_noise_are_told_apart() {
        let flat = vec![100; 3 * 64 * 32];
        let bands = |_, y: usize| if y.is_multiple_of(2) { 10 } else { -10 };
        let noise = |x: usize, y: usize| {
            let mixed = (x as u32 + 64 * y as u32 + 1).wrapping_mul(0x9e37_79b9);
            let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b);
            ((mixed ^ (mixed >> 13)) >> 8) as i32 % 21 - 10
        };
        let ramp = |x: usize, y: usize| 20 + x as i32 - y as i32;
        let of = |f: &dyn Fn(usize, usize) -> i32| {
            let shown: Vec<u8> = (0..64 * 32)
                .flat_map(|i| [(100 + f(i % 64, i / 64)) as u8; 3])
                .collect();
            stripes(&shown, &flat, 64)
        };
        assert!((of(&bands) - 1.0).abs() < 1e-5);
        assert!((of(&|x, y| bands(x, y) + ramp(x, y)) - 1.0).abs() < 1e-5);
        assert!(of(&noise).abs() < 0.1, "{}", of(&noise));
        assert!(of(&|x, y| noise(x, y) + ramp(x, y)).abs() < 0.1);
        assert!(of(&|_, _| 30).abs() < 1e-6);
        assert!(of(&ramp).abs() < 1e-6);
        assert!(of(&|x, y| bands(y, x)) < -0.8);
        assert_eq!(stripes(&flat, &flat, 64), 0.0);
    }
}
