//! Every preset on the frozen views: its time against the baseline's, its error against the converged picture.

use serde_json::json;

use super::timing::{Middle, Ratio, Rounds, beside_bases};
use super::{Bench, JUDGED, decibels, judged_cells, judged_json, table};
use crate::error::CliError;
use crate::metrics::Difference;

/// What is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The scene.
    pub scene: String,
    /// Presets; `thesis` and `thesis_skip` are added in front, because all ratios are to them.
    pub presets: Vec<String>,
    /// Views.
    pub views: Vec<String>,
    /// The preset of the converged picture.
    pub reference: String,
    /// Rays a pixel of the reference: so many in a row and in a column, 4 or more where there is terrain.
    pub samples: u32,
    /// Rounds of timing.
    pub rounds: Rounds,
}

/// One preset on one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The preset.
    pub preset: String,
    /// The view.
    pub view: String,
    /// Milliseconds.
    pub time: Middle,
    /// To `thesis`.
    pub to_thesis: Ratio,
    /// To `thesis_skip`.
    pub to_skip: Ratio,
    /// Noise evaluations, cloud density samples, cloud light samples, atmosphere samples a pixel.
    pub counts: [f64; 4],
    /// From the reference.
    pub difference: Difference,
}

const BASES: [&str; 2] = ["thesis", "thesis_skip"];

/// Measures everything; `progress` hears what is next.
///
/// # Errors
/// Unknown names, faults of the device.
pub fn run(
    bench: &Bench,
    plan: &Plan,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Entry>, CliError> {
    let mut presets: Vec<&str> = BASES.to_vec();
    presets.extend(
        plan.presets
            .iter()
            .map(String::as_str)
            .filter(|p| !BASES.contains(p)),
    );
    // All names before the long work: one that does not exist is told at once.
    let mut work = Vec::new();
    for view in &plan.views {
        let converged = bench.job(&plan.scene, &plan.reference, view, &[])?;
        let jobs = presets
            .iter()
            .map(|preset| bench.job(&plan.scene, preset, view, &[]))
            .collect::<Result<Vec<_>, _>>()?;
        work.push((view, converged, jobs));
    }
    let mut entries = Vec::new();
    for (view, converged, jobs) in &work {
        progress(&format!("{view}: reference"));
        let reference = bench.reference(converged, 0.0, plan.samples)?;
        let mut subjects = jobs
            .iter()
            .map(|job| bench.subject(job, 0.0))
            .collect::<Result<Vec<_>, _>>()?;
        progress(&format!("{view}: times"));
        let turns = beside_bases(&mut subjects, &[0, 1], bench.clock, plan.rounds, &mut || {})?;
        drop(subjects);
        progress(&format!("{view}: pictures"));
        for (k, job) in jobs.iter().enumerate() {
            let picture = bench.picture(job, 0.0, 1)?;
            let counts = job.operation_counts(&bench.gpu, bench.size, 0.0)?;
            entries.push(Entry {
                preset: presets[k].to_owned(),
                view: (*view).clone(),
                time: Middle::of(&turns.times[k]),
                to_thesis: turns.ratio(k, 0),
                to_skip: turns.ratio(k, 1),
                counts: counts.map(|c| c.0),
                difference: picture.difference(&reference, bench.exposure(converged))?,
            });
        }
    }
    Ok(entries)
}

/// The share of ratios to others than themselves that are conclusive.
pub fn conclusive_share(entries: &[Entry]) -> f64 {
    let (mut all, mut good) = (0.0, 0.0);
    for entry in entries {
        for (base, ratio) in BASES.iter().zip([entry.to_thesis, entry.to_skip]) {
            if entry.preset != *base {
                all += 1.0;
                good += f64::from(u8::from(ratio.conclusive()));
            }
        }
    }
    if all == 0.0 { 1.0 } else { good / all }
}

/// Tables: one a preset with a line a view, and one of all presets with the geometric mean of the ratios.
pub fn markdown(bench: &Bench, plan: &Plan, entries: &[Entry], command: &str) -> String {
    let mut text = String::from("# Presets: time and error on the frozen views\n\nWritten by `");
    text += command;
    text += "`.\n\n";
    text += &bench.machine();
    text += &format!(
        "- reference: preset `{}`, {} rays a pixel; scene `{}`\n- a ratio in parentheses with a question mark scattered too much to conclude from; {:.0} % of the ratios are conclusive\n\n",
        plan.reference,
        plan.samples * plan.samples,
        plan.scene,
        100.0 * conclusive_share(entries)
    );
    text += "PSNR, FLIP and the worst pixel (largest step of a channel of 255) are of the 8-bit pictures, the relative RMSE is of\nthe radiance. Counts are a pixel's mean.\n\n";
    let mut names: Vec<&str> = Vec::new();
    for entry in entries {
        if !names.contains(&entry.preset.as_str()) {
            names.push(&entry.preset);
        }
    }
    let of = |name: &str| {
        entries
            .iter()
            .filter(move |e| e.preset == name)
            .collect::<Vec<_>>()
    };
    let mean = |values: Vec<f64>| {
        let finite: Vec<f64> = values
            .into_iter()
            .filter(|v| v.is_finite() && *v > 0.0)
            .collect();
        (finite.iter().map(|v| v.ln()).sum::<f64>() / finite.len().max(1) as f64).exp()
    };
    let mut rows = vec![
        [
            "preset",
            "time / thesis",
            "time / thesis_skip",
            "PSNR [dB], mean",
            "worst view",
            "FLIP, mean",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for name in &names {
        let list = of(name);
        let psnr: Vec<f64> = list.iter().map(|e| e.difference.psnr).collect();
        let least = psnr.iter().copied().fold(f64::INFINITY, f64::min);
        let finite: Vec<f64> = psnr.iter().copied().filter(|p| p.is_finite()).collect();
        let flips: Option<Vec<f64>> = list.iter().map(|e| e.difference.flip).collect();
        rows.push(vec![
            (*name).to_owned(),
            format!(
                "{:.3}",
                mean(list.iter().map(|e| e.to_thesis.median).collect())
            ),
            format!(
                "{:.3}",
                mean(list.iter().map(|e| e.to_skip.median).collect())
            ),
            decibels(finite.iter().sum::<f64>() / finite.len() as f64),
            decibels(least),
            flips.map_or("-".to_owned(), |f| {
                format!("{:.4}", f.iter().sum::<f64>() / f.len() as f64)
            }),
        ]);
    }
    text += "## All views together\n\nGeometric means of the ratios.\n\n";
    text += &table(&rows);
    for name in &names {
        text += &format!("\n## `{name}`\n\n");
        let head = ["view", "time [ms]", "/ thesis", "/ thesis_skip"];
        let mut rows = vec![
            [&head[..], &JUDGED]
                .concat()
                .into_iter()
                .map(str::to_owned)
                .collect(),
        ];
        for e in of(name) {
            let mut row = vec![
                e.view.clone(),
                format!("{:.1}", e.time.median),
                e.to_thesis.to_string(),
                e.to_skip.to_string(),
            ];
            row.extend(judged_cells(&e.counts, &e.difference));
            rows.push(row);
        }
        text += &table(&rows);
    }
    text
}

/// How far the ratios that are conclusive in this run and in an earlier one (its JSON) are apart.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Repeatability {
    /// Ratios that are conclusive in both.
    pub both: usize,
    /// Those of them that differ by more than 10 %.
    pub apart: usize,
    /// The largest relative difference.
    pub largest: f64,
}

/// Compares with the JSON of an earlier run; entries that it lacks are passed over.
pub fn compare(entries: &[Entry], earlier: &serde_json::Value) -> Repeatability {
    let mut found = Repeatability::default();
    let list = earlier["entries"].as_array().map_or(&[][..], Vec::as_slice);
    for entry in entries {
        let Some(before) = list
            .iter()
            .find(|e| e["preset"] == entry.preset.as_str() && e["view"] == entry.view.as_str())
        else {
            continue;
        };
        let ratios = [
            ("thesis", "to_thesis", entry.to_thesis),
            ("thesis_skip", "to_thesis_skip", entry.to_skip),
        ];
        for (base, name, now) in ratios {
            let old = &before[name];
            let (Some(median), Some(true)) = (old["median"].as_f64(), old["conclusive"].as_bool())
            else {
                continue;
            };
            if entry.preset == base || !now.conclusive() || median <= 0.0 {
                continue;
            }
            let difference = (now.median / median - 1.0).abs();
            found.both += 1;
            found.apart += usize::from(difference > 0.1);
            found.largest = found.largest.max(difference);
        }
    }
    found
}

/// The comparison as a section of the document.
pub fn repeatability(entries: &[Entry], earlier: &serde_json::Value) -> String {
    let found = compare(entries, earlier);
    format!(
        "\n## Against an earlier run\n\nOf {} ratios that are conclusive in both runs, {} differ by more than 10 %; the largest difference is {:.1} %.\n",
        found.both,
        found.apart,
        100.0 * found.largest
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, entries: &[Entry], command: &str) -> serde_json::Value {
    let ratio = |r: Ratio| json!({ "median": r.median, "uncertainty": r.uncertainty, "conclusive": r.conclusive() });
    let list: Vec<serde_json::Value> = entries
        .iter()
        .map(|e| {
            let mut entry = json!({
                "preset": e.preset,
                "view": e.view,
                "time_ms": e.time.median,
                "quartiles_ms": [e.time.quartiles.0, e.time.quartiles.1],
                "to_thesis": ratio(e.to_thesis),
                "to_thesis_skip": ratio(e.to_skip),
            });
            judged_json(&mut entry, &e.counts, &e.difference);
            entry
        })
        .collect();
    let mut document = bench.head(command);
    document["entries"] = list.into();
    document
}
