//! `veduta bench`: run time against error.

use std::path::PathBuf;

use indicatif::ProgressBar;

use crate::bench::knob::{self, Effect, Knob};
use crate::bench::timing::{Clock, Rounds};
use crate::bench::{
    Bench, baseline, chapter6, cloud_flight, clouds, frames, ground, noise, presets, sky, terrain,
    write_text,
};
use crate::catalog::{Catalog, SourceArgs};
use crate::commands::render::{RenderArgs, read_json, write_json};
use crate::error::CliError;
use crate::image::check_folder;
use crate::render::Size;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Subject {
    /// Every preset on the frozen views.
    Presets,
    /// The evaluation of Leitner 2022, chapter 6.
    Chapter6,
    /// One knob of one effect.
    Knob,
    /// One frame of the frozen baseline, and how fast the machine is meanwhile.
    Baseline,
    /// Throughput of the noises.
    Noise,
    /// Tables and draws of the sky, against marches without tables.
    Sky,
    /// The terrain against that of the preset `thesis`.
    Terrain,
    /// A layer of clouds at equal error, beside the loop of `thesis`.
    Clouds,
    /// A layer that does not repeat, for an eye that flies.
    Flight,
    /// Whole frames of sky, terrain and clouds, beside `thesis`.
    Frames,
    /// A step of the living ground.
    Ground,
}

/// Arguments of `veduta bench`.
#[derive(Debug, Clone, clap::Args)]
pub struct BenchArgs {
    /// What to measure; `knob` when --knob is given
    pub subject: Option<Subject>,
    /// What a knob belongs to, `all` when left out: scene and converged picture follow from it
    #[arg(long, value_enum, requires = "knob")]
    pub effect: Option<Effect>,
    /// A key and its values: KEY=8..256 (doubling), KEY=1,2,3, or a flag's name
    #[arg(long, value_name = "KEY=VALUES")]
    pub knob: Option<String>,
    /// The preset whose knob is turned [default: thesis]
    #[arg(long, requires = "knob")]
    pub preset: Option<String>,
    /// Views of presets, divided by commas, or the one of a knob [default: V01 to V12; V01]
    #[arg(long, value_delimiter = ',')]
    pub views: Vec<String>,
    /// Presets beside `thesis` and `thesis_skip`, divided by commas [default: thesis_low,low,medium,high]
    #[arg(long = "of", value_name = "PRESETS", value_delimiter = ',')]
    pub of: Vec<String>,
    /// A value that holds everywhere; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Width and height in pixels [default: 256x144; presets 128x72]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Of the terrain only where rays hit, and what a draw takes
    #[arg(long)]
    pub hits: bool,
    /// Of the terrain only what frames cost, standing and flying and by their parts, and how sharp they are
    #[arg(long, conflicts_with = "hits")]
    pub costs: bool,
    /// Of the terrain only changes from frame to frame of a flight, of `thesis` and the presets or of those of them that --of names
    #[arg(long, conflicts_with_all = ["hits", "costs", "views"])]
    pub changes: bool,
    /// Seconds of the flight of chapter 6 [default: 60]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: Option<u32>,
    /// Rounds of timing at least
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub rounds: u16,
    /// Rounds of timing at most, while a ratio is not conclusive
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub most_rounds: u16,
    /// What is measured; processor time on a device in software, else timestamps, else wall time
    #[arg(long, value_enum)]
    pub clock: Option<Clock>,
    /// A file (presets, baseline, noise) or a folder (chapter6, knob) for the results; the table goes to stdout as well
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// The JSON file of an earlier run of presets, whose ratios are compared with the new ones
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// A folder for converged pictures, which later runs take from there
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Where shaders, scenes, presets and views come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

impl BenchArgs {
    /// The line that repeats this run, without paths.
    fn command(&self, subject: Subject) -> String {
        let lower = |text: String| text.to_lowercase();
        let mut line = format!("veduta bench {}", lower(format!("{subject:?}")));
        if let Some(effect) = self.effect {
            line += &format!(" --effect {}", lower(format!("{effect:?}")));
        }
        for (name, value) in [("--knob", &self.knob), ("--preset", &self.preset)] {
            if let Some(value) = value {
                line += &format!(" {name} {value}");
            }
        }
        for (name, list) in [("--views", &self.views), ("--of", &self.of)] {
            if !list.is_empty() {
                line += &format!(" {name} {}", list.join(","));
            }
        }
        if let Some(size) = self.size {
            line += &format!(" --size {size}");
        }
        if let Some(seconds) = self.seconds {
            line += &format!(" --seconds {seconds}");
        }
        for (name, value, usual) in [
            ("--rounds", self.rounds, 9),
            ("--most-rounds", self.most_rounds, 25),
        ] {
            if value != usual {
                line += &format!(" {name} {value}");
            }
        }
        if let Some(clock) = self.clock {
            line += &format!(" --clock {}", lower(format!("{clock:?}")));
        }
        if self.hits {
            line += " --hits";
        }
        if self.costs {
            line += " --costs";
        }
        if self.changes {
            line += " --changes";
        }
        for set in &self.sets {
            line += &format!(" --set {set}");
        }
        line
    }
}

/// A list as it was given; `None` when it was not.
fn as_given(list: &[String]) -> Option<String> {
    (!list.is_empty()).then(|| list.join(","))
}

/// A list as it was given, else the usual one.
fn or_usual(list: &[String], usual: &[&str]) -> Vec<String> {
    if list.is_empty() {
        usual.iter().map(|&s| s.to_owned()).collect()
    } else {
        list.to_vec()
    }
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments, files and devices.
pub fn run(args: &BenchArgs) -> Result<(), CliError> {
    let subject = match (args.subject, &args.knob) {
        (Some(Subject::Knob), None) => {
            return Err(CliError::argument(
                "--knob",
                "",
                "given: a key and its values, for instance CLOUD_STEPS=8..256",
            ));
        }
        (None, Some(_)) => Subject::Knob,
        (
            Some(
                Subject::Presets
                | Subject::Chapter6
                | Subject::Baseline
                | Subject::Noise
                | Subject::Sky
                | Subject::Terrain
                | Subject::Clouds
                | Subject::Flight
                | Subject::Frames
                | Subject::Ground,
            ),
            Some(knob),
        ) => {
            return Err(CliError::argument(
                "--knob",
                knob.as_str(),
                "left out, or the subject `knob`",
            ));
        }
        (subject, _) => subject.unwrap_or(Subject::Presets),
    };
    const VIEWS: [&str; 12] = [
        "V01", "V02", "V03", "V04", "V05", "V06", "V07", "V08", "V09", "V10", "V11", "V12",
    ];
    let others = |allowed: &[Subject]| !allowed.contains(&subject);
    for (name, given, wrong, allowed) in [
        (
            "--views",
            as_given(&args.views),
            others(&[
                Subject::Presets,
                Subject::Knob,
                Subject::Terrain,
                Subject::Clouds,
                Subject::Flight,
                Subject::Frames,
            ]) || (matches!(subject, Subject::Knob | Subject::Clouds | Subject::Flight)
                && args.views.len() > 1),
            "left out, or the subject `presets`, `terrain` or `frames`, or one view of a knob or of clouds",
        ),
        (
            "--of",
            as_given(&args.of),
            others(&[Subject::Presets])
                && !((args.costs || args.changes) && subject == Subject::Terrain),
            "left out, or the subject `presets`, or `terrain` with --costs or --changes",
        ),
        (
            "--hits",
            args.hits.then(|| "given".to_owned()),
            others(&[Subject::Terrain]),
            "left out, or the subject `terrain`",
        ),
        (
            "--costs",
            args.costs.then(|| "given".to_owned()),
            others(&[Subject::Terrain]),
            "left out, or the subject `terrain`",
        ),
        (
            "--changes",
            args.changes.then(|| "given".to_owned()),
            others(&[Subject::Terrain]),
            "left out, or the subject `terrain`",
        ),
        (
            "--seconds",
            args.seconds.map(|s| s.to_string()),
            others(&[Subject::Chapter6]),
            "left out, or the subject `chapter6`",
        ),
        (
            "--rounds",
            (args.rounds > args.most_rounds).then(|| args.rounds.to_string()),
            true,
            "at most --most-rounds",
        ),
    ] {
        if let (Some(given), true) = (given, wrong) {
            return Err(CliError::argument(name, given, allowed));
        }
    }
    if let Some(path) = &args.out {
        if matches!(subject, Subject::Chapter6 | Subject::Knob) {
            std::fs::create_dir_all(path).map_err(|e| CliError::write(path, e))?;
        } else {
            check_folder(path)?;
        }
    }
    let rounds = Rounds {
        least: usize::from(args.rounds),
        most: usize::from(args.most_rounds),
    };
    let gpu = veduta::device::shared()?;
    let natural = Clock::of(&gpu.adapter.get_info(), gpu.device.features());
    let (width, height) = match subject {
        Subject::Presets => (128, 72),
        Subject::Sky => (800, 450),
        _ => (256, 144),
    };
    let size = args.size.unwrap_or(Size { width, height });
    size.check(&gpu.device)?;
    let bench = Bench {
        gpu: gpu.clone(),
        clock: args.clock.unwrap_or(natural),
        size,
        cache: args.cache.clone(),
        base: RenderArgs {
            sets: args.sets.clone(),
            sources: args.sources.clone(),
            ..RenderArgs::default()
        },
    };
    let command = args.command(subject);
    // Before the long work: a file that cannot be read is told at once.
    let earlier = match (&args.against, subject) {
        (None, _) => None,
        (Some(path), Subject::Presets) => Some(read_json(path)?),
        (Some(path), _) => {
            return Err(CliError::argument(
                "--against",
                path.display().to_string(),
                "left out, or the subject `presets`",
            ));
        }
    };
    let bar = ProgressBar::new_spinner();
    let mut progress = |what: &str| {
        bar.set_message(what.to_owned());
        bar.tick();
    };
    match subject {
        Subject::Presets => {
            let plan = presets::Plan {
                scene: "thesis".to_owned(),
                presets: or_usual(&args.of, &["thesis_low", "low", "medium", "high"]),
                views: or_usual(&args.views, &VIEWS),
                reference: "reference".to_owned(),
                samples: 4,
                rounds,
            };
            let entries = presets::run(&bench, &plan, &mut progress)?;
            bar.finish_and_clear();
            let mut text = presets::markdown(&bench, &plan, &entries, &command);
            if let Some(earlier) = &earlier {
                text += &presets::repeatability(&entries, earlier);
            }
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &presets::to_json(&bench, &entries, &command),
                )?;
            }
        }
        Subject::Baseline => {
            let rounds = baseline::run(&bench, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = baseline::markdown(&bench, &rounds, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
            }
        }
        Subject::Noise => {
            let rounds = noise::run(&bench, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = noise::markdown(&bench, &rounds, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &noise::to_json(&bench, &rounds, &command),
                )?;
            }
        }
        Subject::Ground => {
            let report = ground::run(&bench, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = ground::markdown(&bench, &report, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &ground::to_json(&bench, &report, &command),
                )?;
            }
        }
        Subject::Sky => {
            let report = sky::run(&bench, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = sky::markdown(&bench, &report, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &sky::to_json(&bench, &report, &command),
                )?;
            }
        }
        Subject::Terrain => {
            let plan = terrain::Plan {
                views: or_usual(&args.views, &VIEWS),
                rounds: rounds.least,
                frames: if args.views.is_empty() { 60 } else { 0 },
            };
            if args.hits || args.costs || args.changes {
                let text = if args.hits {
                    terrain::hits(&bench, &plan, &mut progress)?
                } else if args.changes {
                    terrain::changes(&bench, &plan, &args.of, &mut progress)?
                } else {
                    terrain::costs(&bench, &plan, &args.of, &mut progress)?
                };
                let title = if args.hits {
                    "Where the terrain's rays end"
                } else if args.changes {
                    "How terrain changes in a flight"
                } else {
                    "What whole frames of terrain cost"
                };
                let text = format!(
                    "# {title}\n\nWritten by `{command}`.\n\n{}\n\n{text}",
                    bench.machine()
                );
                bar.finish_and_clear();
                print!("{text}");
                return match &args.out {
                    Some(path) => write_text(path, &text),
                    None => Ok(()),
                };
            }
            let report = terrain::run(&bench, &plan, &mut progress)?;
            bar.finish_and_clear();
            let text = terrain::markdown(&bench, &report, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &terrain::to_json(&bench, &report, &command),
                )?;
            }
        }
        Subject::Clouds => {
            let view = args.views.first().map_or("V01", String::as_str);
            let report = clouds::run(&bench, view, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = clouds::markdown(&bench, &report, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &clouds::to_json(&bench, &report, &command),
                )?;
            }
        }
        Subject::Flight => {
            let view = args.views.first().map_or("V01", String::as_str);
            let report = cloud_flight::run(&bench, view, &mut progress)?;
            bar.finish_and_clear();
            let text = cloud_flight::markdown(&bench, &report, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &cloud_flight::to_json(&bench, &report, &command),
                )?;
            }
        }
        Subject::Frames => {
            let views = or_usual(&args.views, &VIEWS);
            let lines = frames::run(&bench, &views, rounds.least, &mut progress)?;
            bar.finish_and_clear();
            let text = frames::markdown(&bench, &lines, &command);
            print!("{text}");
            if let Some(path) = &args.out {
                write_text(path, &text)?;
                write_json(
                    &path.with_extension("json"),
                    &frames::to_json(&bench, &lines, &command),
                )?;
            }
        }
        Subject::Chapter6 => {
            let folder = args
                .out
                .clone()
                .unwrap_or_else(|| PathBuf::from("chapter6"));
            let plan = chapter6::Plan {
                seconds: args.seconds.unwrap_or(60),
                rounds,
                quick: false,
            };
            let report = chapter6::run(&bench, &plan, &folder, &mut progress)?;
            bar.finish_and_clear();
            chapter6::write(&bench, &report, &command, &folder)?;
            print!("{}", chapter6::markdown(&bench, &report, &command));
        }
        Subject::Knob => {
            let catalog = Catalog::load(&args.sources)?;
            let knob = Knob::parse(catalog.set(), args.knob.as_deref().unwrap_or(""))?;
            let view = args.views.first().map_or("V01", String::as_str);
            let report = knob::run(
                &bench,
                args.effect.unwrap_or(Effect::All),
                &knob,
                args.preset.as_deref().unwrap_or("thesis"),
                view,
                rounds,
                &mut progress,
            )?;
            bar.finish_and_clear();
            if let Some(folder) = &args.out {
                knob::write(&bench, &knob, &report, &command, folder)?;
            }
            print!("{}", knob::markdown(&bench, &knob, &report, &command));
        }
    }
    Ok(())
}
