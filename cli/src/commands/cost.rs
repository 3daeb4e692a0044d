//! `veduta cost`: what each feature of a scene costs.

use std::path::PathBuf;

use indicatif::ProgressBar;
use serde_json::json;

use crate::bench::timing::{Clock, Rounds};
use crate::bench::{Bench, write_text};
use crate::catalog::SourceArgs;
use crate::commands::render::{RenderArgs, write_json};
use crate::cost::{Child, Timing, fresh, markdown, run as count, variants};
use crate::error::CliError;
use crate::image::{check_folder, check_output};
use crate::render::Size;

/// Arguments of `veduta cost`.
#[derive(Debug, Clone, clap::Args)]
pub struct CostArgs {
    /// Shipped scenes or .ron files of your own
    #[arg(default_value = "thesis", value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// A shipped preset or a .ron file of your own
    #[arg(long)]
    pub preset: Option<String>,
    /// A shipped view or a .ron file of your own
    #[arg(long, default_value = "V01")]
    pub view: String,
    /// A value that goes before those of scene and preset; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Width and height in pixels, for operations a pixel and frame times
    #[arg(long, default_value = "128x72", value_name = "WxH")]
    pub size: Size,
    /// Only what is counted, no times
    #[arg(long)]
    pub no_time: bool,
    /// Rounds of timing at least
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub rounds: u16,
    /// Rounds of timing at most, while a ratio is not conclusive
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub most_rounds: u16,
    /// What is measured; processor time on a device in software, else timestamps, else wall time
    #[arg(long, value_enum)]
    pub clock: Option<Clock>,
    /// A file for the tables, which go to stdout as well
    #[arg(long, value_name = "COST.md")]
    pub out: Option<PathBuf>,
    /// A file for the numbers
    #[arg(long, value_name = "COST.json")]
    pub json: Option<PathBuf>,
    /// Writes the times of one round of first draws as JSON, nothing else: the process that `cost` itself starts.
    #[arg(long, hide = true)]
    pub fresh_round: Option<usize>,
    /// Where shaders, scenes, presets and views come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

impl CostArgs {
    /// What decides on the variants of a scene, as `render` takes it.
    fn of_scene(&self, scene: &str) -> RenderArgs {
        RenderArgs {
            scene: scene.to_owned(),
            preset: self.preset.clone(),
            view: Some(self.view.clone()),
            sets: self.sets.clone(),
            sources: self.sources.clone(),
            ..RenderArgs::default()
        }
    }

    /// The line that repeats this run, without paths.
    fn command(&self) -> String {
        let mut line = "veduta cost".to_owned();
        for scene in &self.scenes {
            line += &format!(" {scene}");
        }
        if let Some(preset) = &self.preset {
            line += &format!(" --preset {preset}");
        }
        line += &format!(" --view {} --size {}", self.view, self.size);
        for set in &self.sets {
            line += &format!(" --set {set}");
        }
        if self.no_time {
            line += " --no-time";
        }
        line
    }

    /// The process that measures first draws of a scene.
    fn child(&self, scene: &str, clock: Clock) -> Result<Child, CliError> {
        let program = std::env::current_exe().map_err(|e| CliError::Child {
            what: e.to_string(),
        })?;
        let clock = if clock == Clock::Cpu { "cpu" } else { "wall" };
        let mut arguments = vec!["cost".to_owned(), scene.to_owned()];
        let mut add = |name: &str, value: String| arguments.extend([name.to_owned(), value]);
        add("--view", self.view.clone());
        add("--size", self.size.to_string());
        add("--clock", clock.to_owned());
        if let Some(preset) = &self.preset {
            add("--preset", preset.clone());
        }
        for set in &self.sets {
            add("--set", set.clone());
        }
        for (name, folders) in [
            ("--modules", &self.sources.modules),
            ("--presets", &self.sources.presets),
        ] {
            for folder in folders {
                add(name, folder.display().to_string());
            }
        }
        if self.sources.no_shipped {
            arguments.push("--no-shipped".to_owned());
        }
        arguments.push("--fresh-round".to_owned());
        Ok(Child { program, arguments })
    }
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments, files and devices.
pub fn run(args: &CostArgs) -> Result<(), CliError> {
    for (name, path, ending) in [("--out", &args.out, "md"), ("--json", &args.json, "json")] {
        if let Some(path) = path {
            check_output(name, path, ending)?;
            check_folder(path)?;
        }
    }
    if let Some(round) = args.fresh_round {
        let mut times = Vec::new();
        for scene in &args.scenes {
            let variants = variants(&args.of_scene(scene), args.size)?;
            times.extend(fresh(&variants, args.clock.unwrap_or(Clock::Wall), round)?);
        }
        println!("{}", json!(times));
        return Ok(());
    }
    let gpu = veduta::device::shared()?;
    args.size.check(&gpu.device)?;
    let natural = Clock::of(&gpu.adapter.get_info(), gpu.device.features());
    let bench = Bench {
        gpu: gpu.clone(),
        clock: args.clock.unwrap_or(natural),
        size: args.size,
        cache: None,
        base: RenderArgs::default(),
    };
    let bar = ProgressBar::new_spinner();
    let mut progress = |what: &str| {
        bar.set_message(what.to_owned());
        bar.tick();
    };
    let mut reports = Vec::new();
    for scene in &args.scenes {
        let timing = if args.no_time {
            None
        } else {
            Some(Timing {
                rounds: Rounds {
                    least: usize::from(args.rounds),
                    most: usize::from(args.most_rounds.max(args.rounds)),
                },
                child: args.child(scene, bench.clock)?,
            })
        };
        reports.push(count(
            &bench,
            &args.of_scene(scene),
            timing.as_ref(),
            &mut progress,
        )?);
    }
    bar.finish_and_clear();
    let command = args.command();
    let text = markdown(&bench, &reports, !args.no_time, &command);
    print!("{text}");
    if let Some(path) = &args.out {
        write_text(path, &text)?;
    }
    if let Some(path) = &args.json {
        let info = gpu.adapter.get_info();
        let value = json!({
            "command": command,
            "adapter": info.name,
            "driver": info.driver,
            "driver_info": info.driver_info,
            "clock": bench.clock.describe(),
            "size": [args.size.width, args.size.height],
            "scenes": reports.iter().map(|r| r.to_json()).collect::<Vec<_>>(),
        });
        write_json(path, &value)?;
    }
    Ok(())
}
