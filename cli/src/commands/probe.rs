//! `veduta probe`: the light along given rays.

use std::path::{Path, PathBuf};

use veduta::Atmosphere;
use veduta::atmosphere::{Orders, ProbeOptions, ProbePath, ProbeRay, SkyQuality, probe};
use veduta::eval::ResultKind;
use veduta::reference;
use veduta::{Preset, Settings};

use crate::error::CliError;
use crate::image::check_folder;
use crate::table::{Format, Table, write_results};

/// Arguments of `veduta probe`.
#[derive(Debug, Clone, clap::Args)]
pub struct ProbeArgs {
    /// What to probe.
    #[command(subcommand)]
    pub what: What,
}

/// What can be probed.
#[derive(Debug, Clone, clap::Subcommand)]
pub enum What {
    /// Radiance and transmittance of the sky along rays
    Sky(SkyArgs),
}

/// How the light is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum How {
    /// In double precision on the processor: quadrature, and Monte Carlo for what is scattered more than once
    Reference,
    /// On the device, by marching
    Textbook,
    /// On the device, by tables
    Fast,
}

/// Which light is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Which {
    /// Scattered once by the air
    Single,
    /// Scattered any number of times, and reflected by the ground before
    All,
}

/// Arguments of `veduta probe sky`.
#[derive(Debug, Clone, clap::Args)]
pub struct SkyArgs {
    /// A shipped atmosphere or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// Albedo of the ground in all channels; the atmosphere's own when left out
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    pub albedo: Option<f64>,
    /// The rays, .npy or .csv: altitude, direction, direction to the sun, distance
    #[arg(long, value_name = "ROWS")]
    pub rays: PathBuf,
    /// How the light is found
    #[arg(long, value_enum, default_value = "reference")]
    pub path: How,
    /// Which light is counted
    #[arg(long, value_enum, default_value = "all")]
    pub orders: Which,
    /// The preset whose tables the path `fast` uses
    #[arg(long, value_name = "NAME", default_value = "high")]
    pub preset: String,
    /// Random paths a ray and channel of the reference, 2 to 1e9
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1_000_000_000), default_value = "4096")]
    pub samples: u32,
    /// Seed of the random paths
    #[arg(long, value_name = "S", default_value = "1")]
    pub seed: u64,
    /// Where radiance and transmittance go, .npy or .csv
    #[arg(long, value_name = "LIGHT")]
    pub out: PathBuf,
    /// Where the standard errors of the reference's radiance go, .npy or .csv
    #[arg(long, value_name = "ERRORS")]
    pub errors: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for names, files and rows that do not fit, with the row and what it must be; what the library reports.
pub fn run(args: &ProbeArgs) -> Result<(), CliError> {
    match &args.what {
        What::Sky(args) => sky(args),
    }
}

/// A shipped atmosphere by its name, or that of a `.ron` file.
///
/// # Errors
/// [`CliError::Read`], [`CliError::Table`] with the file and what is wrong in it, a name that does not exist.
pub fn atmosphere(name: &str) -> Result<Atmosphere, CliError> {
    let path = Path::new(name);
    if path.extension().is_none_or(|e| e != "ron") {
        return Ok(Atmosphere::named(name)?);
    }
    let text = std::fs::read_to_string(path).map_err(|e| CliError::read(path, e))?;
    Atmosphere::from_ron(&text).map_err(|e| CliError::Table {
        path: path.to_owned(),
        what: e.to_string(),
    })
}

fn sky(args: &SkyArgs) -> Result<(), CliError> {
    for path in [Some(&args.out), args.errors.as_ref()]
        .into_iter()
        .flatten()
    {
        Format::of(path)?;
        check_folder(path)?;
    }
    if args.errors.is_some() && args.path != How::Reference {
        return Err(CliError::argument(
            "--errors",
            "given",
            "left out for paths other than `reference`, which alone knows its errors",
        ));
    }
    let mut air = atmosphere(&args.atmosphere)?;
    if let Some(albedo) = args.albedo {
        air.ground_albedo = [albedo; 3];
        air.check()?;
    }
    let numbers = Table::read(&args.rays, 8)?.to_numbers(&args.rays)?;
    let rays = numbers
        .as_chunks::<8>()
        .0
        .iter()
        .enumerate()
        .map(|(row, numbers)| ProbeRay::from_row(row, *numbers))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| CliError::Table {
            path: args.rays.clone(),
            what: e.to_string(),
        })?;
    let orders = match args.orders {
        Which::Single => Orders::Single,
        Which::All => Orders::All,
    };
    let path = match args.path {
        How::Reference => None,
        How::Textbook => Some(ProbePath::Textbook),
        How::Fast => Some(ProbePath::Fast),
    };
    let mut light: Vec<u32> = Vec::with_capacity(6 * rays.len());
    if let Some(path) = path {
        let preset = Preset::Named(args.preset.clone().into());
        let settings = Settings::resolve(veduta::programs(), &preset, None, &[])?;
        let options = ProbeOptions {
            path,
            orders,
            quality: SkyQuality::of(&settings),
            ..Default::default()
        };
        for found in probe(veduta::device::shared()?, &air, &rays, &options)? {
            light.extend(found.in_scatter.map(f32::to_bits));
            light.extend(found.transmittance.map(f32::to_bits));
        }
    } else {
        let effort = reference::probe::Effort {
            samples: args.samples as usize,
            seed: args.seed,
            ..Default::default()
        };
        let bits = |value: f64| (value as f32).to_bits();
        let found = reference::probe::probe(&air, &rays, orders, &effort)?;
        for found in &found {
            light.extend(found.in_scatter.map(bits));
            light.extend(found.transmittance.map(bits));
        }
        if let Some(path) = &args.errors {
            let errors: Vec<u32> = found.iter().flat_map(|f| f.error.map(bits)).collect();
            write_results(path, &errors, 3, ResultKind::F32)?;
        }
    }
    write_results(&args.out, &light, 6, ResultKind::F32)
}
