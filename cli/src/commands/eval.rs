//! `veduta eval`: evaluates a WGSL expression over rows on the device.

use std::path::PathBuf;

use veduta::eval::{Column, Evaluator, Spec};

use crate::catalog::{Catalog, SourceArgs, shown};
use crate::error::CliError;
use crate::image::check_folder;
use crate::table::{Format, Table, write_results};

/// Arguments of `veduta eval`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct EvalArgs {
    /// An item to import, for instance veduta::noise::value::value_noise_2d; may be repeated
    #[arg(long = "import", value_name = "MODULE::ITEM")]
    pub imports: Vec<String>,
    /// The WGSL expression; column k of a row is `in.f[k]`, `in.i[k]` or `in.u[k]`
    #[arg(long = "expr", value_name = "WGSL", allow_hyphen_values = true)]
    pub expression: String,
    /// The type of each column, up to 64: i (i32), u (u32) or f (f32)
    #[arg(long, value_name = "i,f,...")]
    pub columns: String,
    /// The rows, .npy or .csv
    #[arg(long = "in", value_name = "ROWS")]
    pub input: PathBuf,
    /// Where the results go, .npy or .csv
    #[arg(long = "out", value_name = "VALUES")]
    pub output: PathBuf,
    /// A file of WGSL to put before the expression: functions, constants, `override fn`
    #[arg(long, value_name = "FILE")]
    pub prelude: Option<PathBuf>,
    /// Where shaders come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for files, columns and values that do not fit, and for faults of the expression with their place.
pub fn run(args: &EvalArgs) -> Result<(), CliError> {
    let columns = Column::parse_list(&args.columns)?;
    Format::of(&args.output)?;
    check_folder(&args.output)?;
    let table = Table::read(&args.input, columns.len())?;
    let rows = table.to_bits(&args.input, &columns)?;
    let prelude = match &args.prelude {
        Some(path) => std::fs::read_to_string(path).map_err(|e| CliError::read(path, e))?,
        None => String::new(),
    };
    let prelude_file = args.prelude.as_deref().map(shown).unwrap_or_default();
    let library = Catalog::load(&args.sources)?.library()?;
    let imports: Vec<&str> = args.imports.iter().map(String::as_str).collect();
    let evaluator = Evaluator::new(
        veduta::device::shared()?,
        &library,
        &Spec {
            imports: &imports,
            prelude: &prelude,
            prelude_file: &prelude_file,
            expression: &args.expression,
            columns: columns.len(),
            features: &[],
        },
    )?;
    let results = evaluator.run_bits(&rows)?;
    write_results(&args.output, &results, evaluator.width(), evaluator.kind())
}
