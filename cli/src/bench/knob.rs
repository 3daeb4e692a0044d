//! One knob of one effect: time and cost against error.

use std::path::Path;

use serde_json::json;
use veduta::program::{KeyKind, SceneTable};
use veduta::{ProgramSet, Value};

use super::plot::{Plot, Point, Series};
use super::timing::{Middle, Ratio, Rounds, beside_bases};
use super::truth::Truth;
use super::{Bench, JUDGED, judged_cells, judged_json, pareto, side_by_side, table, write_text};
use crate::commands::render::{Job, write_json};
use crate::error::CliError;
use crate::image::write_png;
use crate::metrics::{DepthDifference, Difference, Picture, depth_difference};

/// What is judged: it decides on the scene, and on what the converged picture is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Effect {
    /// Clouds over a bare planet.
    Clouds,
    /// Sky and aerial perspective over a bare planet.
    Atmosphere,
    /// Mountains without air.
    Terrain,
    /// The mountains' textures.
    Textures,
    /// The whole landscape.
    All,
}

/// Keys with their values.
type Values = &'static [(&'static str, Value)];

impl Effect {
    /// Scene, flags that leave other effects out, values of the converged textbook picture, rays in a pixel's row.
    fn plan(self) -> (&'static str, Values, Values, u32) {
        const OFF: Value = Value::Flag(false);
        const CLOUDS: [(&str, Value); 4] = [
            ("CLOUD_STEPS", Value::Int(512)),
            ("CLOUD_LIGHT_STEPS", Value::Int(32)),
            ("CLOUD_SKIP", OFF),
            ("CLOUD_JITTER", OFF),
        ];
        const AIR: [(&str, Value); 2] = [
            ("ATMOS_STEPS", Value::Int(256)),
            ("ATMOS_LIGHT_STEPS", Value::Int(64)),
        ];
        const GROUND: [(&str, Value); 5] = [
            ("STEP_FACTOR", Value::Float(0.25)),
            ("MAX_MARCHING_STEPS", Value::Int(1000)),
            ("MAX_MARCHING_STEPS_SHADOW", Value::Int(200)),
            ("TEXTURE_FILTERING", OFF),
            ("TEXTURE_LOW_QUALITY", OFF),
        ];
        const ALL: [(&str, Value); 7] = [
            CLOUDS[0], CLOUDS[1], CLOUDS[2], CLOUDS[3], GROUND[0], GROUND[1], GROUND[2],
        ];
        match self {
            Effect::Clouds => ("sky", &[], &CLOUDS, 1),
            Effect::Atmosphere => ("sky", &[("CLOUDS", OFF)], &AIR, 1),
            Effect::Terrain => ("clear", &[("ATMOSPHERE", OFF)], &GROUND, 4),
            Effect::Textures => ("clear", &[("ATMOSPHERE", OFF)], &GROUND, 4),
            Effect::All => ("thesis", &[], &ALL, 4),
        }
    }
}

/// A key and its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Knob {
    /// The key.
    pub key: String,
    /// The values, checked against the key's domain.
    pub values: Vec<Value>,
}

impl Knob {
    /// Reads `KEY=a..b` (doubling from a up to b, both more than 0), `KEY=a,b,c`, or for a flag `KEY`.
    ///
    /// # Errors
    /// [`CliError::Argument`] for another form; an unknown key or a value out of its domain.
    pub fn parse(set: &ProgramSet, text: &str) -> Result<Knob, CliError> {
        let fault = || {
            CliError::argument(
                "--knob",
                text,
                "KEY=FROM..TO (doubling), KEY=A,B,C or a flag's name",
            )
        };
        let (name, list) = text.split_once('=').unwrap_or((text, "false,true"));
        let key = set.key(name.trim())?;
        let named = |scene: &SceneTable| scene.features.iter().any(|f| **f == *key.name);
        if key.kind != KeyKind::Quality || set.scenes.iter().any(named) {
            return Err(CliError::argument(
                "--knob",
                name.trim(),
                "a quality key that no scene names: content is no error",
            ));
        }
        let texts: Vec<String> = match list.split_once("..") {
            None => list.split(',').map(|t| t.trim().to_owned()).collect(),
            Some((from, to)) => {
                let number = |t: &str| {
                    t.trim()
                        .parse::<f64>()
                        .ok()
                        .filter(|n| n.is_finite() && *n > 0.0)
                };
                let (Some(mut at), Some(to)) = (number(from), number(to)) else {
                    return Err(fault());
                };
                let mut texts = Vec::new();
                while at <= to * (1.0 + 1e-9) && texts.len() < 64 {
                    texts.push(at.to_string());
                    at *= 2.0;
                }
                texts
            }
        };
        if texts.is_empty() {
            return Err(fault());
        }
        let values = texts
            .iter()
            .map(|t| Ok(key.parse(t)?))
            .collect::<Result<Vec<_>, CliError>>()?;
        if (1..values.len()).any(|k| values[..k].contains(&values[k])) {
            return Err(CliError::argument("--knob", text, "each value once"));
        }
        Ok(Knob {
            key: name.trim().to_owned(),
            values,
        })
    }
}

/// One setting of the knob.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The value.
    pub value: Value,
    /// Milliseconds.
    pub time: Middle,
    /// To the preset as it is.
    pub ratio: Ratio,
    /// Noise evaluations, cloud density samples, cloud light samples, atmosphere samples a pixel.
    pub counts: [f64; 4],
    /// From the converged picture.
    pub difference: Difference,
    /// Relative RMSE of the effect alone from the f64 reference, where there is one.
    pub to_truth: Option<f64>,
    /// Where the rays meet the ground, against the converged rays; of effects of the ground.
    pub depth: Option<DepthDifference>,
    /// Nothing that was measured is both faster and nearer.
    pub on_front: bool,
}

/// Everything of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Settings in the order of the knob's values.
    pub entries: Vec<Entry>,
    /// 8-bit pictures of the settings, then of the reference.
    pub pictures: Vec<Vec<u8>>,
    /// The view.
    pub view: String,
    /// What the converged picture is.
    pub reference: String,
    /// The f64 reference, where there is one.
    pub truth: Option<Truth>,
}

/// Measures all values of a knob on a view with a preset.
///
/// # Errors
/// Unknown names, values out of their domain, faults of the device.
pub fn run(
    bench: &Bench,
    effect: Effect,
    knob: &Knob,
    preset: &str,
    view: &str,
    rounds: Rounds,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    let (scene, off, converged, samples) = effect.plan();
    let job = |values: &[(&str, Value)]| -> Result<Job, CliError> {
        bench.job(scene, preset, view, &[off, values].concat())
    };
    progress("reference");
    let target = job(converged)?;
    let reference: Picture = bench.reference(&target, 0.0, samples)?;
    let exposure = bench.exposure(&target);
    let mut jobs = vec![job(&[])?];
    for value in &knob.values {
        jobs.push(job(&[(knob.key.as_str(), *value)])?);
    }
    progress("counts");
    let mut counts = Vec::new();
    for (job, value) in jobs.iter().skip(1).zip(&knob.values) {
        let pixel = job.operation_counts(&bench.gpu, bench.size, 0.0)?;
        bench.check_loops(&format!("{}={value}", knob.key), &pixel)?;
        counts.push(pixel);
    }
    let mut subjects = jobs
        .iter()
        .map(|j| bench.subject(j, 0.0))
        .collect::<Result<Vec<_>, _>>()?;
    progress("times");
    let turns = beside_bases(&mut subjects, &[0], bench.clock, rounds, &mut || {})?;
    drop(subjects);
    progress("f64 reference");
    let alone = |value: Option<&Value>| -> Result<Option<Job>, CliError> {
        let Some(flags) = effect.alone() else {
            return Ok(None);
        };
        let mut values = [off, flags].concat();
        values.extend(value.map(|v| (knob.key.as_str(), *v)));
        Ok(Some(bench.job(scene, preset, view, &values)?))
    };
    let truth = match alone(None)? {
        Some(job) => Truth::of(bench, effect, &job)?,
        None => None,
    };
    let grounded = matches!(effect, Effect::Terrain | Effect::All);
    let true_depths = if grounded {
        target.distances(&bench.gpu, bench.size, 0.0)?
    } else {
        Vec::new()
    };
    let mut entries = Vec::new();
    let mut pictures = Vec::new();
    for (k, value) in knob.values.iter().enumerate() {
        progress(&format!("{}={value}", knob.key));
        let job = &jobs[k + 1];
        let picture = bench.picture(job, 0.0, 1)?;
        let to_truth = match (&truth, alone(Some(value))?) {
            // Alone is as it is drawn anyway, where nothing is to be left out.
            (Some(truth), _) if effect.alone() == Some(&[]) => Some(truth.relative_rmse(&picture)),
            (Some(truth), Some(job)) => Some(truth.relative_rmse(&bench.picture(&job, 0.0, 1)?)),
            _ => None,
        };
        let depth = if grounded {
            let depths = job.distances(&bench.gpu, bench.size, 0.0)?;
            Some(depth_difference(&depths, &true_depths))
        } else {
            None
        };
        entries.push(Entry {
            value: *value,
            time: Middle::of(&turns.times[k + 1]),
            ratio: turns.ratio(k + 1, 0),
            counts: counts[k].map(|c| c.0),
            difference: picture.difference(&reference, exposure)?,
            to_truth,
            depth,
            on_front: false,
        });
        pictures.push(picture.display(exposure));
    }
    pictures.push(reference.display(exposure));
    let points: Vec<(f64, f64)> = entries
        .iter()
        .map(|e| (e.ratio.median, -e.difference.psnr))
        .collect();
    for k in pareto(&points) {
        entries[k].on_front = true;
    }
    let values: Vec<String> = converged
        .iter()
        .map(|(key, value)| format!("{key}={value}"))
        .collect();
    Ok(Report {
        entries,
        pictures,
        view: view.to_owned(),
        reference: format!(
            "{}, {} a pixel",
            values.join(" "),
            if samples == 1 {
                "1 ray".to_owned()
            } else {
                format!("{} rays", samples * samples)
            }
        ),
        truth,
    })
}

/// A table of a report.
pub fn markdown(bench: &Bench, knob: &Knob, report: &Report, command: &str) -> String {
    let mut text = format!(
        "# {}: time against error\n\nWritten by `{command}`.\n\n{}",
        knob.key,
        bench.machine()
    );
    text += &format!(
        "- view: {}\n- reference: {}\n",
        report.view, report.reference
    );
    if let Some(truth) = &report.truth {
        text += &format!(
            "- f64: relative RMSE of the effect alone on {} rays of the sky from {}, whose own error it estimates at {:.1e}\n",
            truth.pixels.len(),
            truth.what,
            truth.uncertainty
        );
    }
    let grounded = report.entries.iter().any(|e| e.depth.is_some());
    if grounded {
        text += "- flips: rays that meet the ground here and not in the reference, or the reverse; depth: relative difference of the\n  distances of the others, that which 1 % exceed\n";
    }
    text += "- `front`: nothing here is both faster and nearer to the reference\n\n";
    let mut head = [&[knob.key.as_str(), "time [ms]", "/ preset"][..], &JUDGED].concat();
    if report.truth.is_some() {
        head.push("f64");
    }
    if grounded {
        head.extend(["flips", "depth"]);
    }
    head.push("front");
    let mut rows = vec![head.into_iter().map(str::to_owned).collect()];
    for e in &report.entries {
        let mut row = vec![
            e.value.to_string(),
            format!("{:.1}", e.time.median),
            e.ratio.to_string(),
        ];
        row.extend(judged_cells(&e.counts, &e.difference));
        row.extend(e.to_truth.map(|t| format!("{t:.5}")));
        if let Some(d) = &e.depth {
            row.extend([d.flips.to_string(), format!("{:.1e}", d.percentile_99)]);
        }
        row.push(if e.on_front { "front" } else { "" }.to_owned());
        rows.push(row);
    }
    text + &table(&rows)
}

/// Writes table, JSON, plot and pictures into a folder.
///
/// # Errors
/// [`CliError::Write`].
pub fn write(
    bench: &Bench,
    knob: &Knob,
    report: &Report,
    command: &str,
    folder: &Path,
) -> Result<(), CliError> {
    std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))?;
    let name = knob.key.to_ascii_lowercase();
    let values: Vec<String> = report.entries.iter().map(|e| e.value.to_string()).collect();
    let text = format!(
        "{}\n![error against time]({name}.svg)\n\n![pictures]({name}.png)\n\nFrom the left: {} = {}, then the reference.\n",
        markdown(bench, knob, report, command),
        knob.key,
        values.join(", "),
    );
    write_text(&folder.join(format!("{name}.md")), &text)?;
    let entries: Vec<serde_json::Value> = report
        .entries
        .iter()
        .map(|e| {
            let mut entry = json!({
                "value": e.value.to_string(), "time_ms": e.time.median, "ratio": e.ratio.median,
                "uncertainty": e.ratio.uncertainty, "conclusive": e.ratio.conclusive(), "front": e.on_front,
            });
            judged_json(&mut entry, &e.counts, &e.difference);
            if let Some(to_truth) = e.to_truth {
                entry["to_f64"] = to_truth.into();
            }
            if let Some(d) = &e.depth {
                entry["flips"] = d.flips.into();
                entry["depth"] = json!({
                    "both": d.both, "median": d.median, "percentile_99": d.percentile_99, "largest": d.largest,
                });
            }
            entry
        })
        .collect();
    let mut document = bench.head(command);
    document["key"] = knob.key.as_str().into();
    document["view"] = report.view.as_str().into();
    document["reference"] = report.reference.as_str().into();
    document["entries"] = entries.into();
    write_json(&folder.join(format!("{name}.json")), &document)?;
    // Each setting is in one of the two, so that no mark hides another.
    let series: Vec<Series> = [("Pareto front", true), ("beaten by another setting", false)]
        .into_iter()
        .map(|(name, front)| {
            let mut list: Vec<&Entry> = report
                .entries
                .iter()
                .filter(|e| e.on_front == front)
                .collect();
            list.sort_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median));
            let point = |e: &&Entry| Point {
                x: e.ratio.median,
                y: e.difference.psnr,
                label: e.value.to_string(),
                conclusive: e.ratio.conclusive(),
            };
            Series {
                name: name.to_owned(),
                points: list.iter().map(point).collect(),
                joined: front,
            }
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    let labels = format!("labels: {}", knob.key);
    let mut notes = vec![labels.as_str()];
    if report
        .entries
        .iter()
        .any(|e| !e.difference.psnr.is_finite())
    {
        notes.push("settings equal to the reference have no finite PSNR and are left out");
    }
    Plot {
        title: &format!("{}: error against time", knob.key),
        x: "time over that of the preset as it is",
        y: "PSNR against the converged picture [dB]",
        log_x: true,
        y_from_zero: false,
        series: &series,
        notes: &notes,
    }
    .write(&folder.join(format!("{name}.svg")))?;
    let (width, height) = (bench.size.width as usize, bench.size.height as usize);
    let (w, h, rgb) = side_by_side(&report.pictures, width, height);
    write_png(&folder.join(format!("{name}.png")), w, h, &rgb)
}
