//! `veduta stress`: adversarial inputs for every public function and every effect.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};

use crate::bench::{self, write_text};
use crate::catalog::{Catalog, SourceArgs};
use crate::commands::render::write_json;
use crate::error::CliError;
use crate::image::check_folder;
use crate::stress::report::Report;
use crate::stress::twins::{ELSEWHERE, registry};
use crate::stress::{Plan, effects, elsewhere, energy, functions};

/// Arguments of `veduta stress`.
#[derive(Debug, Clone, clap::Args)]
pub struct StressArgs {
    /// Only functions whose path holds this text, and no pictures
    #[arg(default_value = "")]
    pub filter: String,
    /// Less than two minutes on a software device: what the tests run
    #[arg(long, conflicts_with = "evaluations")]
    pub quick: bool,
    /// Evaluations of all functions together; from 1e9 on a bound fails that is more than eight times too generous
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub evaluations: Option<u64>,
    /// Fail bounds that are too generous, whatever the number of evaluations
    #[arg(long)]
    pub tight: bool,
    /// No pictures
    #[arg(long)]
    pub no_pictures: bool,
    /// The table as a document
    #[arg(long, value_name = "FILE.md")]
    pub out: Option<PathBuf>,
    /// Everything that was found
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
    /// Where shaders come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// From so many evaluations on a bound that is too generous fails.
const LONG: u64 = 1_000_000_000;
/// From so many evaluations on all pictures are drawn.
const ALL_PICTURES: u64 = 100_000_000;
const QUICK: u64 = 2_000_000;
const USUAL: u64 = 20_000_000;

fn parse_count(text: &str) -> Result<u64, String> {
    let number: f64 = text
        .parse()
        .map_err(|_| "a number is expected, for instance 1e9")?;
    if (1.0..=1e15).contains(&number) && number.fract() == 0.0 {
        Ok(number as u64)
    } else {
        Err("a whole number from 1 to 1e15 is expected".to_owned())
    }
}

impl StressArgs {
    /// What the arguments ask for.
    pub fn plan(&self) -> Plan {
        let evaluations = match (self.quick, self.evaluations) {
            (true, _) => QUICK,
            (false, Some(count)) => count,
            (false, None) => USUAL,
        };
        Plan {
            evaluations,
            least: (evaluations / 20_000).clamp(64, 4096),
            tight: self.tight || evaluations >= LONG,
        }
    }

    /// The line that repeats this run, without paths.
    fn command(&self) -> String {
        let mut line = "veduta stress".to_owned();
        if !self.filter.is_empty() {
            line += &format!(" {}", self.filter);
        }
        if self.quick {
            line += " --quick";
        }
        if let Some(count) = self.evaluations {
            line += &format!(" --evaluations {:e}", count as f64);
        }
        if self.tight {
            line += " --tight";
        }
        if self.no_pictures {
            line += " --no-pictures";
        }
        line
    }
}

/// Runs the command.
///
/// # Errors
/// [`CliError::Stress`] when anything is wrong; faults of arguments, files, composing and the device.
pub fn run(args: &StressArgs) -> Result<(), CliError> {
    for path in [&args.out, &args.json].into_iter().flatten() {
        check_folder(path)?;
    }
    let library = Catalog::load(&args.sources)?.library()?;
    let gpu = veduta::device::shared()?;
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {elapsed}") {
        bar.set_style(style);
    }
    bar.set_message("functions");
    let plan = args.plan();
    let findings = functions(
        gpu,
        &library,
        &registry(),
        &plan,
        &args.filter,
        &|done, all| {
            bar.set_length(all);
            bar.set_position(done);
        },
    )?;
    let (integral_evaluations, integral_faults) = energy::check(gpu, &library, &args.filter)?;
    let pictures = if args.filter.is_empty() && !args.no_pictures {
        let quick = plan.evaluations < ALL_PICTURES;
        Some(effects::check(gpu, &args.sources, quick, &|what| {
            bar.set_message(what.to_owned());
        })?)
    } else {
        None
    };
    bar.finish_and_clear();
    let report = Report {
        findings,
        elsewhere: elsewhere(&library, ELSEWHERE)?,
        integral_evaluations,
        integral_faults,
        pictures,
    };
    print!("{}", report.table());
    if let Some(p) = &report.pictures {
        println!(
            "{} pictures, {} pixels, {} values refused; the brightest pixel at {:.2e} of its bound",
            p.drawn, p.pixels, p.refused, p.share
        );
    }
    println!(
        "{} functions, {} evaluations",
        report.findings.len(),
        report.evaluations()
    );
    if let Some(path) = &args.out {
        write_text(
            path,
            &report.markdown(&bench::device_lines(gpu), &args.command()),
        )?;
    }
    if let Some(path) = &args.json {
        write_json(path, &report.json())?;
    }
    let count = report.faults().count();
    if count == 0 {
        return Ok(());
    }
    eprint!("{}", report.fault_lines());
    Err(CliError::Stress { count })
}
