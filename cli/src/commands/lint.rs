//! `veduta lint`: checks shaders, programs and RON files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::json;
use veduta_compose::keys::{KeyType, Keys, Value};
use veduta_compose::settings::{Presets, Scene, View, resolve};
use veduta_compose::{Diag, Diags, Library};

use crate::catalog::{
    Claim, FileKind, SourceArgs, Texts, claimed, composer, files_below, read, shown,
};
use crate::error::CliError;

/// Up to so many flags, every combination of them is composed.
const EVERY_COMBINATION: usize = 6;

/// Arguments of `veduta lint`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct LintArgs {
    /// Files and folders with .wgsl, .sp and .ron files
    #[arg(required = true)]
    pub paths: Vec<PathBuf>,
    /// One JSON array of faults
    #[arg(long)]
    pub json: bool,
    /// Every function of a module must have a header, as veduta's own modules do
    #[arg(long)]
    pub headers: bool,
    /// Allows what goes beyond WebGPU's core; may be repeated
    #[arg(long, value_enum)]
    pub claim: Vec<Claim>,
    /// What may be imported and named beside what is checked.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// What was checked and found.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// How many files were read.
    pub files: usize,
    /// How many variants of programs were composed.
    pub variants: usize,
    /// The faults, by file and place.
    pub faults: Vec<Diag>,
}

/// Runs the command.
///
/// # Errors
/// [`CliError::Lint`] when there is a fault, and the faults of [`check`].
pub fn run(args: &LintArgs) -> Result<(), CliError> {
    let report = check(&args.paths, &args.sources, args.headers, &args.claim)?;
    if args.json {
        let faults: Vec<_> = report.faults.iter().map(to_json).collect();
        println!("{:#}", serde_json::Value::Array(faults));
    } else {
        for fault in &report.faults {
            println!("{fault}");
        }
    }
    if report.faults.is_empty() {
        eprintln!(
            "{} files and {} variants: no fault",
            report.files, report.variants
        );
        Ok(())
    } else {
        Err(CliError::Lint {
            count: report.faults.len(),
        })
    }
}

/// A fault as `--json` prints it.
pub fn to_json(fault: &Diag) -> serde_json::Value {
    json!({
        "file": fault.file,
        "line": fault.line,
        "column": fault.column,
        "message": fault.message,
        "source": fault.source_line,
        "notes": fault.notes,
    })
}

/// Checks files and folders.
///
/// # Errors
/// [`CliError::Missing`] and [`CliError::Read`] for paths; faults inside the files are the report's.
pub fn check(
    paths: &[PathBuf],
    sources: &SourceArgs,
    headers: bool,
    claims: &[Claim],
) -> Result<Report, CliError> {
    let mut faults = Diags::new();
    let own = collect(paths, &mut faults)?;
    let mut all = Texts::load(sources)?;
    let mut reported: BTreeSet<String> = faults.iter().map(|d| d.file.clone()).collect();
    let mut files = reported.len();
    for (kind, file, text) in own {
        // The same file may also lie in a folder of --modules.
        if !reported.insert(file.clone()) {
            continue;
        }
        files += 1;
        all.remove(&file);
        all.add(kind, file, text);
    }
    let mut report = Report {
        files,
        ..Report::default()
    };
    check_texts(&all, headers, claims, &mut report, &mut faults);
    for fault in faults.0 {
        if reported.contains(&fault.file) && !report.faults.contains(&fault) {
            report.faults.push(fault);
        }
    }
    report
        .faults
        .sort_by(|a, b| (&a.file, a.line, a.column).cmp(&(&b.file, b.line, b.column)));
    Ok(report)
}

/// Every file of ours with what it is; files that are not UTF-8 are faults.
fn collect(
    paths: &[PathBuf],
    faults: &mut Diags,
) -> Result<Vec<(FileKind, String, String)>, CliError> {
    let mut found = Vec::new();
    for path in paths {
        let named = path.is_file();
        let files = if named {
            vec![path.clone()]
        } else if path.is_dir() {
            files_below(path)?
        } else {
            return Err(CliError::Missing {
                what: "path",
                name: path.display().to_string(),
                hint: String::new(),
            });
        };
        for file in files {
            let ending = file.extension().and_then(|e| e.to_str()).unwrap_or("");
            if !matches!(ending, "wgsl" | "sp" | "ron") {
                if named {
                    return Err(CliError::argument(
                        "PATHS",
                        file.display().to_string(),
                        "a folder or a .wgsl, .sp or .ron file",
                    ));
                }
                continue;
            }
            let text = match read(&file) {
                Ok(text) => text,
                Err(CliError::Faults(more)) => {
                    faults.append(more);
                    continue;
                }
                Err(error) => return Err(error),
            };
            match kind_of(&file, ending, &text) {
                Some(kind) => found.push((kind, shown(&file), text)),
                None if named => faults.push(Diag::whole_file(
                    shown(&file),
                    "is neither key declarations nor a preset, a scene, a view or an atmosphere",
                )),
                None => {}
            }
        }
    }
    Ok(found)
}

/// What a file is, by its ending, its folder and its fields; `None` for a `.ron` file that is none of ours.
fn kind_of(path: &Path, ending: &str, text: &str) -> Option<FileKind> {
    match ending {
        "wgsl" => return Some(FileKind::Module),
        "sp" => return Some(FileKind::Program),
        _ => {}
    }
    let folder = path
        .parent()
        .and_then(Path::file_name)
        .and_then(|n| n.to_str());
    let has = |field: &str| text.contains(field);
    if path.file_name().is_some_and(|n| n == "keys.ron") {
        Some(FileKind::Keys)
    } else if folder == Some("scenes") || (has("program:") && has("features:")) {
        Some(FileKind::Scene)
    } else if folder == Some("views") || (has("eye_height:") && has("fov_deg:")) {
        Some(FileKind::View)
    } else if folder == Some("atmospheres")
        || (has("planet_radius:") && has("thickness:") && has("layers:"))
    {
        Some(FileKind::Atmosphere)
    } else if folder == Some("presets") || (has("reason:") && has("values:")) {
        Some(FileKind::Preset)
    } else if has("name:") && has("type:") && has("kind:") && has("meaning:") {
        Some(FileKind::Keys)
    } else {
        None
    }
}

fn check_texts(
    all: &Texts,
    headers: bool,
    claims: &[Claim],
    report: &mut Report,
    faults: &mut Diags,
) {
    for (name, file, text) in &all.views {
        if let Err(found) = View::parse(name, file, text) {
            faults.append(found);
        }
    }
    for (_, file, text) in &all.atmospheres {
        if let Err(found) = veduta::Atmosphere::from_ron(text) {
            faults.push(Diag::whole_file(file, found.to_string()));
        }
    }
    let keys = match Keys::load(&all.keys) {
        Ok(keys) => keys,
        Err(found) => {
            // Whatever names a key would be reported for no fault of its own.
            faults.append(found);
            return;
        }
    };
    let presets = match Presets::load(&keys, &all.presets) {
        Ok(presets) => presets,
        Err(found) => {
            faults.append(found);
            Presets::default()
        }
    };
    let program_names: BTreeSet<&str> = all.programs.iter().map(|(n, ..)| n.as_str()).collect();
    let mut scenes = Vec::new();
    for (name, file, text) in &all.scenes {
        match Scene::parse(&keys, name, file, text) {
            Ok(scene) => {
                if !program_names.contains(scene.program.as_str()) {
                    faults.push(
                        Diag::whole_file(file, format!("there is no program `{}`", scene.program))
                            .suggest(&scene.program, program_names.iter().copied()),
                    );
                }
                scenes.push(scene);
            }
            Err(found) => faults.append(found),
        }
    }
    clashes("program", &all.programs, faults);
    clashes("scene", &all.scenes, faults);
    clashes("view", &all.views, faults);
    let library = match Library::from_sources(all.modules.clone()) {
        Ok(library) => library,
        Err(found) => {
            faults.append(found);
            return;
        }
    };
    let mut composer = composer(&library, keys.clone())
        .require_headers(headers)
        .claim(claimed(claims));
    faults.append(composer.check_modules());
    for (name, file, text) in &all.programs {
        let program = veduta_compose::sp::parse(file, text).and_then(|sp| composer.prepare(&sp));
        let program = match program {
            Ok(program) => program,
            Err(found) => {
                faults.append(found);
                continue;
            }
        };
        let flags: Vec<&str> = keys
            .iter()
            .filter(|k| k.ty == KeyType::Flag && program.relevant.contains(&k.name))
            .map(|k| k.name.as_str())
            .collect();
        let sizes = sizes(name, &program.relevant, &keys, &presets, &scenes);
        let variants = variants(name, &flags, &keys, &presets, &scenes);
        for (features, sizes) in variants
            .iter()
            .flat_map(|features| sizes.iter().map(move |sizes| (features, sizes)))
        {
            report.variants += 1;
            let composed = composer.compose_prepared(&program, features, sizes);
            if let Err(found) = composed {
                for mut fault in found.0 {
                    let known = faults.iter().any(|f| {
                        (&f.file, f.line, f.column, &f.message)
                            == (&fault.file, fault.line, fault.column, &fault.message)
                    });
                    if !known {
                        if !sizes.is_empty() {
                            let with: Vec<String> =
                                sizes.iter().map(|(n, v)| format!("{n} = {v}")).collect();
                            fault = fault.note(format!("with {}", with.join(", ")));
                        }
                        faults.push(fault);
                    }
                }
            }
        }
    }
}

/// Two files of one name.
fn clashes(what: &str, texts: &[crate::catalog::NamedText], faults: &mut Diags) {
    let mut names: BTreeMap<&str, &str> = BTreeMap::new();
    for (name, file, _) in texts {
        if let Some(first) = names.insert(name, file) {
            faults.push(
                Diag::whole_file(file, format!("a second {what} `{name}`"))
                    .note(format!("the first is {first}")),
            );
        }
    }
}

/// The sizes to compose with: those that are declared, and those of every preset with every scene of the program; only
/// sizes that make a difference, each set of values once.
fn sizes(
    program: &str,
    relevant: &BTreeSet<String>,
    keys: &Keys,
    presets: &Presets,
    scenes: &[Scene],
) -> BTreeSet<BTreeMap<String, i64>> {
    let declared = keys
        .iter()
        .filter(|k| k.ty == KeyType::Size && relevant.contains(&k.name))
        .filter_map(|k| match k.default {
            Value::Int(value) => Some((k.name.clone(), value)),
            _ => None,
        })
        .collect();
    let mut maps = BTreeSet::from([declared]);
    for preset in presets.names() {
        for scene in drawn(program, scenes) {
            // The preset exists and nothing else is set: this cannot fail.
            let Ok(settings) = resolve(keys, presets, preset, scene, &[]) else {
                continue;
            };
            let mut sizes = settings.sizes();
            sizes.retain(|name, _| relevant.contains(name));
            maps.insert(sizes);
        }
    }
    maps
}

/// The scenes that name the program; without any, the program without a scene.
fn drawn<'a>(program: &str, scenes: &'a [Scene]) -> Vec<Option<&'a Scene>> {
    let drawn: Vec<_> = scenes
        .iter()
        .filter(|s| s.program == program)
        .map(Some)
        .collect();
    if drawn.is_empty() { vec![None] } else { drawn }
}

/// The sets of features to compose: all combinations of a few flags; of many those of presets and scenes, and the first of
/// these with each single flag the other way round.
fn variants(
    program: &str,
    flags: &[&str],
    keys: &Keys,
    presets: &Presets,
    scenes: &[Scene],
) -> BTreeSet<BTreeSet<String>> {
    let mut sets: BTreeSet<BTreeSet<String>> = BTreeSet::new();
    if flags.len() <= EVERY_COMBINATION {
        for bits in 0..1_u32 << flags.len() {
            sets.insert(
                flags
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| bits >> i & 1 == 1)
                    .map(|(_, flag)| (*flag).to_owned())
                    .collect(),
            );
        }
        return sets;
    }
    for preset in presets.names() {
        for scene in drawn(program, scenes) {
            // The preset exists and nothing else is set: this cannot fail.
            let Ok(settings) = resolve(keys, presets, preset, scene, &[]) else {
                continue;
            };
            let mut features = settings.flags();
            features.retain(|f| flags.contains(&f.as_str()));
            sets.insert(features);
        }
    }
    let first = sets
        .iter()
        .max_by_key(|set| set.len())
        .cloned()
        .unwrap_or_default();
    for flag in flags {
        let mut other = first.clone();
        if !other.remove(*flag) {
            other.insert((*flag).to_owned());
        }
        sets.insert(other);
    }
    sets.insert(BTreeSet::new());
    sets
}
