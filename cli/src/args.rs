//! The arguments of `veduta`.

use clap::{Parser, Subcommand};

use crate::commands;

/// Outdoor landscapes for wgpu: render, sky, land, simulate, compose, lint, list, bench, cost, stress, diff, eval, probe.
#[derive(Debug, Clone, Parser)]
#[command(name = "veduta", version, about, arg_required_else_help = true)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Clone, Subcommand)]
#[allow(clippy::large_enum_variant)] // There is one of them.
pub enum Command {
    /// Draw a scene into a picture
    Render(commands::render::RenderArgs),
    /// Write a program as plain WGSL, SPIR-V, HLSL or MSL
    Compose(commands::compose::ComposeArgs),
    /// Draw an atmosphere from any altitude
    Sky(commands::sky::SkyArgs),
    /// Draw a land under its sky
    Land(commands::land::LandArgs),
    /// Let water run over a ground, dig and carry
    Simulate(commands::simulate::SimulateArgs),
    /// Check modules, programs, presets, scenes and views; for continuous integration
    Lint(commands::lint::LintArgs),
    /// Show what there is: programs, presets, scenes, views, keys, adapters
    List(commands::list::ListArgs),
    /// Measure run time against error
    Bench(Box<commands::bench::BenchArgs>),
    /// Count and measure what each feature of a scene adds
    Cost(commands::cost::CostArgs),
    /// Try adversarial inputs on every public function and every effect
    Stress(commands::stress::StressArgs),
    /// Compare two pictures: PSNR, FLIP, relative RMSE, worst pixel
    Diff(commands::diff::DiffArgs),
    /// Evaluate a WGSL expression over rows of numbers on the device
    Eval(commands::eval::EvalArgs),
    /// Find the light along given rays, heights of given places, or where rays meet a land
    Probe(commands::probe::ProbeArgs),
}

impl Args {
    /// Runs the command.
    ///
    /// # Errors
    /// Whatever the command reports.
    pub fn run(&self) -> Result<(), crate::CliError> {
        match &self.command {
            Command::Render(args) => commands::render::run(args),
            Command::Sky(args) => commands::sky::run(args),
            Command::Land(args) => commands::land::run(args),
            Command::Simulate(args) => commands::simulate::run(args),
            Command::Compose(args) => commands::compose::run(args),
            Command::Lint(args) => commands::lint::run(args),
            Command::List(args) => commands::list::run(args),
            Command::Bench(args) => commands::bench::run(args),
            Command::Cost(args) => commands::cost::run(args),
            Command::Stress(args) => commands::stress::run(args),
            Command::Diff(args) => commands::diff::run(args),
            Command::Eval(args) => commands::eval::run(args),
            Command::Probe(args) => commands::probe::run(args),
        }
    }
}
