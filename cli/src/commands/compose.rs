//! `veduta compose`: writes a program for a target.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use veduta::Preset;
use veduta_compose::gate::{Target as Writer, write_target};
use veduta_compose::keys::Value;
use veduta_compose::link::Linker;
use veduta_compose::settings::{Presets, Settings, resolve, split_set};
use veduta_compose::{Diags, Library, compose::Composed};

use crate::catalog::{Catalog, Claim, SourceArgs, claimed};
use crate::error::CliError;

/// A language to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Target {
    /// Plain WGSL.
    #[default]
    Wgsl,
    /// SPIR-V 1.3, a binary file.
    Spirv,
    /// HLSL for shader model 6.0.
    Hlsl,
    /// Metal 2.4.
    Msl,
}

impl Target {
    fn writer(self) -> Writer {
        match self {
            Target::Wgsl => Writer::Wgsl,
            Target::Spirv => Writer::Spirv,
            Target::Hlsl => Writer::Hlsl,
            Target::Msl => Writer::Msl,
        }
    }

    fn ending(self) -> &'static str {
        match self {
            Target::Wgsl => "wgsl",
            Target::Spirv => "spv",
            Target::Hlsl => "hlsl",
            Target::Msl => "metal",
        }
    }
}

/// A stage of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Stage {
    /// The vertex stage.
    Vertex,
    /// The fragment stage.
    Fragment,
    /// The compute stage.
    Compute,
}

impl Stage {
    fn name(self) -> &'static str {
        match self {
            Stage::Vertex => "vertex",
            Stage::Fragment => "fragment",
            Stage::Compute => "compute",
        }
    }
}

/// Arguments of `veduta compose`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ComposeArgs {
    /// A shipped program or a .sp file of your own
    pub program: String,
    /// A shipped preset or a .ron file of your own
    #[arg(long)]
    pub preset: Option<String>,
    /// A shipped scene or a .ron file of your own; for the program of the scene `thesis` that one holds when none is given
    #[arg(long)]
    pub scene: Option<String>,
    /// A value that goes before those of scene and preset; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// The language to write
    #[arg(long, value_enum, default_value_t)]
    pub target: Target,
    /// A folder for PROGRAM.STAGE.ENDING, or a file for one stage; stdout when left out
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Allows what goes beyond WebGPU's core; may be repeated
    #[arg(long, value_enum)]
    pub claim: Vec<Claim>,
    /// Only this stage
    #[arg(long, value_enum)]
    pub stage: Option<Stage>,
    /// Where shaders, presets and scenes come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for names, files and faults of the program.
pub fn run(args: &ComposeArgs) -> Result<(), CliError> {
    if args.target == Target::Spirv && args.out.is_none() {
        return Err(CliError::argument(
            "--out",
            "",
            "given for SPIR-V, which is binary",
        ));
    }
    let (composed, settings) = compose(args)?;
    let wanted: Vec<_> = composed
        .stages
        .iter()
        .filter(|s| args.stage.is_none_or(|w| w.name() == s.kind.to_string()))
        .collect();
    if let (Some(stage), true) = (args.stage, wanted.is_empty()) {
        let stages: Vec<String> = composed.stages.iter().map(|s| s.kind.to_string()).collect();
        return Err(CliError::argument(
            "--stage",
            stage.name(),
            format!("a stage of `{}`: {}", composed.program, stages.join(", ")),
        ));
    }
    let capabilities =
        Linker::with_capabilities(&Library::default(), claimed(&args.claim)).capabilities();
    let mut texts: Vec<(String, Vec<u8>)> = Vec::new();
    for stage in wanted {
        let wgsl = with_values(&stage.wgsl, &values(&composed, &settings));
        let written = write_target(&wgsl, args.target.writer(), capabilities)
            .map_err(veduta::Error::Compose)?;
        let name = format!(
            "{}.{}.{}",
            composed.program,
            stage.kind,
            args.target.ending()
        );
        let mut bytes = written.into_bytes();
        if args.target != Target::Spirv && !bytes.ends_with(b"\n") {
            bytes.push(b'\n');
        }
        texts.push((name, bytes));
    }
    match &args.out {
        None => {
            use std::io::Write as _;
            let mut out = std::io::stdout().lock();
            for (name, bytes) in &texts {
                let fault = |e| CliError::write(Path::new("stdout"), e);
                writeln!(out, "// {name}").map_err(fault)?;
                out.write_all(bytes).map_err(fault)?;
            }
        }
        Some(path) if path.extension().is_some_and(|e| e == args.target.ending()) => {
            let [(_, bytes)] = texts.as_slice() else {
                let names: Vec<&str> = texts.iter().map(|(name, _)| name.as_str()).collect();
                return Err(CliError::argument(
                    "--out",
                    path.display().to_string(),
                    format!(
                        "a folder, or --stage given, for there are {}",
                        names.join(", ")
                    ),
                ));
            };
            write(path, bytes)?;
        }
        Some(folder) => {
            std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))?;
            for (name, bytes) in &texts {
                write(&folder.join(name), bytes)?;
            }
        }
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    std::fs::write(path, bytes).map_err(|e| CliError::write(path, e))?;
    println!("{}", path.display());
    Ok(())
}

/// Composes the variant that the arguments name.
///
/// # Errors
/// [`CliError`] for names, files and faults of the program.
pub fn compose(args: &ComposeArgs) -> Result<(Composed, Settings), CliError> {
    let mut catalog = Catalog::load(&args.sources)?;
    let sp = catalog.program(&args.program)?;
    let name = Path::new(sp.file())
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let scene = match &args.scene {
        Some(scene) => Some(catalog.scene(scene)?),
        None => catalog
            .scene_of("thesis")
            .filter(|scene| scene.program == name)
            .map(|scene| scene.name.clone()),
    };
    let scene = scene.and_then(|name| catalog.scene_of(&name).cloned());
    if let Some(scene) = &scene
        && scene.program != name
    {
        return Err(CliError::argument(
            "--scene",
            &scene.name,
            format!(
                "a scene of the program `{name}`, not of `{}`",
                scene.program
            ),
        ));
    }
    let preset = match &args.preset {
        Some(preset) => catalog.preset(preset)?.name(catalog.set()).to_owned(),
        None => Preset::default().name(catalog.set()).to_owned(),
    };
    let sets = args
        .sets
        .iter()
        .map(|text| split_set(text))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Diags::from)?;
    // Without shipped presets the declared defaults hold.
    let bare = [(
        preset.as_str(),
        "",
        "(reason: \"declared defaults\", values: {})",
    )];
    let declared = Presets::load(catalog.keys(), &bare)?;
    let presets = match (&args.preset, catalog.preset_table().get(&preset)) {
        (None, None) => &declared,
        _ => catalog.preset_table(),
    };
    let settings = resolve(catalog.keys(), presets, &preset, scene.as_ref(), &sets)?;
    let composed = catalog.composer()?.claim(claimed(&args.claim)).compose(
        &sp,
        &settings.flags(),
        &settings.sizes(),
    )?;
    Ok((composed, settings))
}

/// The resolved values of overrides by their names, as WGSL.
fn values<'a>(composed: &'a Composed, settings: &Settings) -> BTreeMap<&'a str, String> {
    composed
        .overrides
        .iter()
        .filter_map(|item| {
            let key = item.key.as_deref()?;
            let value = match (item.ty.wgsl(), settings.values.get(key)?) {
                ("bool", Value::Flag(v)) => v.to_string(),
                ("i32", Value::Int(v)) => format!("i32({v})"),
                ("u32", Value::Int(v)) => format!("{v}u"),
                ("f32", Value::Int(v)) => format!("f32({v})"),
                ("f32", Value::Float(v)) => format!("f32({v:?})"),
                _ => return None,
            };
            Some((item.name.as_str(), value))
        })
        .collect()
}

/// The text with these values as defaults of its overrides.
pub(crate) fn with_values(wgsl: &str, values: &BTreeMap<&str, String>) -> String {
    let mut text = String::with_capacity(wgsl.len());
    for line in wgsl.split_inclusive('\n') {
        // One declaration a line, as the writer has it: `override NAME: TYPE = VALUE;`.
        let declared = line.find("override ").and_then(|at| {
            let (name, _) = line[at + "override ".len()..].split_once(':')?;
            let value = values.get(name.trim())?;
            let end = line.find([';', '='])?;
            Some(format!("{} = {value};\n", line[..end].trim_end()))
        });
        match declared {
            Some(declared) => text.push_str(&declared),
            None => text.push_str(line),
        }
    }
    text
}
