//! `veduta bench`: run time against error.

use std::path::PathBuf;

use indicatif::ProgressBar;

use crate::bench::knob::{self, Effect, Knob};
use crate::bench::timing::{Clock, Rounds};
use crate::bench::{Bench, baseline, chapter6, noise, presets, write_text};
use crate::catalog::{Catalog, SourceArgs};
use crate::commands::render::{RenderArgs, read_json, write_json};
use crate::error::CliError;
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
}

/// Arguments of `veduta bench`.
#[derive(Debug, Clone, clap::Args)]
pub struct BenchArgs {
    /// What to measure; `knob` when --knob is given
    pub subject: Option<Subject>,
    /// What a knob belongs to: scene and converged picture follow from it
    #[arg(long, value_enum, default_value = "all")]
    pub effect: Effect,
    /// A key and its values: KEY=8..256 (doubling), KEY=1,2,3, or a flag's name
    #[arg(long, value_name = "KEY=VALUES")]
    pub knob: Option<String>,
    /// The preset whose knob is turned
    #[arg(long, default_value = "thesis")]
    pub preset: String,
    /// Views, divided by commas; a knob takes the first
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "V01,V02,V03,V04,V05,V06,V07,V08,V09,V10,V11,V12"
    )]
    pub views: Vec<String>,
    /// Presets beside `thesis` and `thesis_skip`, divided by commas
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "thesis_low,low,medium,high"
    )]
    pub presets: Vec<String>,
    /// A value that holds everywhere; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Width and height in pixels [default: 256x144; presets 128x72]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Seconds of the flight of chapter 6
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
    /// Rounds of timing at least
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub rounds: u16,
    /// Rounds of timing at most, while a ratio is not conclusive
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=1000))]
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
        let mut line = format!("veduta bench {}", format!("{subject:?}").to_lowercase());
        if let Some(knob) = &self.knob {
            line += &format!(
                " --effect {} --knob {knob}",
                format!("{:?}", self.effect).to_lowercase()
            );
        }
        if self.preset != "thesis" {
            line += &format!(" --preset {}", self.preset);
        }
        if let Some(size) = self.size {
            line += &format!(" --size {size}");
        }
        for set in &self.sets {
            line += &format!(" --set {set}");
        }
        line
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
            Some(Subject::Presets | Subject::Chapter6 | Subject::Baseline | Subject::Noise),
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
    let rounds = Rounds {
        least: usize::from(args.rounds),
        most: usize::from(args.most_rounds.max(args.rounds)),
    };
    let gpu = veduta::device::shared()?;
    let natural = Clock::of(&gpu.adapter.get_info(), gpu.device.features());
    let size = args.size.unwrap_or(if subject == Subject::Presets {
        Size {
            width: 128,
            height: 72,
        }
    } else {
        Size {
            width: 256,
            height: 144,
        }
    });
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
                presets: args.presets.clone(),
                views: args.views.clone(),
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
                write_json(&path.with_extension("json"), &presets::to_json(&entries))?;
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
                write_json(&path.with_extension("json"), &noise::to_json(&rounds))?;
            }
        }
        Subject::Chapter6 => {
            let folder = args
                .out
                .clone()
                .unwrap_or_else(|| PathBuf::from("chapter6"));
            let plan = chapter6::Plan {
                seconds: args.seconds,
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
                args.effect,
                &knob,
                &args.preset,
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
