//! `veduta list`: what there is.

use serde_json::{Value, json};
use veduta::wgpu;

use crate::catalog::{Catalog, SourceArgs};
use crate::error::CliError;

/// What to list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Subject {
    /// Programs and how many variants of them were built.
    Programs,
    /// Presets.
    Presets,
    /// Scenes.
    Scenes,
    /// Views.
    Views,
    /// Declared keys.
    Keys,
    /// Graphics adapters of this machine.
    Adapters,
}

const ALL: [Subject; 6] = [
    Subject::Programs,
    Subject::Presets,
    Subject::Scenes,
    Subject::Views,
    Subject::Keys,
    Subject::Adapters,
];

/// Arguments of `veduta list`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ListArgs {
    /// What to list; everything when left out
    pub subject: Option<Subject>,
    /// As JSON: an object with one list a subject
    #[arg(long)]
    pub json: bool,
    /// Where programs, scenes, presets and views come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for folders that cannot be read.
pub fn run(args: &ListArgs) -> Result<(), CliError> {
    let catalog = Catalog::load(&args.sources)?;
    let subjects: Vec<Subject> = match args.subject {
        Some(subject) => vec![subject],
        None => ALL.to_vec(),
    };
    let mut all = serde_json::Map::new();
    for subject in subjects {
        let name = format!("{subject:?}").to_lowercase();
        all.insert(name, Value::Array(list(&catalog, subject)));
    }
    if args.json {
        println!("{:#}", Value::Object(all));
        return Ok(());
    }
    let many = all.len() > 1;
    for (subject, entries) in &all {
        if many {
            println!("{subject}:");
        }
        let entries = entries.as_array().map_or(&[][..], Vec::as_slice);
        let text = |entry: &Value, field: &str| {
            entry[field]
                .as_str()
                .map_or_else(|| entry[field].to_string(), str::to_owned)
        };
        let width = entries
            .iter()
            .map(|e| text(e, "name").chars().count())
            .max()
            .unwrap_or(0);
        if entries.is_empty() {
            println!("  (none)");
        }
        for entry in entries {
            println!(
                "  {:width$}  {}",
                text(entry, "name"),
                text(entry, "description")
            );
        }
    }
    Ok(())
}

/// One object an entry, each with `name` and `description`.
fn list(catalog: &Catalog, subject: Subject) -> Vec<Value> {
    let set = catalog.set();
    match subject {
        Subject::Programs => catalog
            .programs()
            .map(|name| {
                let variants: Vec<Vec<String>> = set
                    .programs
                    .iter()
                    .filter(|p| p.program == name)
                    .map(|p| p.features.iter().map(|f| f.to_string()).collect())
                    .collect();
                json!({
                    "name": name,
                    "description": format!("{} variants built", variants.len()),
                    "variants": variants,
                })
            })
            .collect(),
        Subject::Presets => catalog
            .presets()
            .iter()
            .map(|p| {
                json!({
                    "name": p.name,
                    "description": p.reason,
                    "based_on": p.based_on,
                    "default": p.name == veduta::Preset::default().name(set),
                })
            })
            .collect(),
        Subject::Scenes => catalog
            .scenes()
            .iter()
            .map(|s| {
                json!({
                    "name": s.name,
                    "description": s.meaning,
                    "program": s.program,
                    "features": s.features,
                })
            })
            .collect(),
        Subject::Views => catalog
            .views()
            .iter()
            .map(|v| {
                json!({
                    "name": v.name,
                    "description": v.meaning,
                    "eye_height": v.eye_height,
                    "pitch_deg": v.pitch_deg,
                    "fov_deg": v.fov_deg,
                    "sun_height_deg": v.sun_height_deg,
                    "sun_azimuth_deg": v.sun_azimuth_deg,
                    "place": [v.place.0, v.place.1],
                    "yaw_deg": v.yaw_deg,
                })
            })
            .collect(),
        Subject::Keys => catalog
            .keys()
            .iter()
            .map(|k| {
                let domain = k.domain.map(|(low, high)| [low, high]);
                let shown = match domain {
                    Some([low, high]) => format!("{} in [{low}, {high}]", k.ty),
                    None => k.ty.to_string(),
                };
                json!({
                    "name": k.name,
                    "description": format!("{shown}, default {}: {}", k.default, k.meaning),
                    "type": k.ty.to_string(),
                    "kind": k.kind.to_string(),
                    "domain": domain,
                    "default": k.default.to_string(),
                    "unit": k.unit,
                    "meaning": k.meaning,
                })
            })
            .collect(),
        Subject::Adapters => {
            let instance = wgpu::Instance::new(
                wgpu::InstanceDescriptor::new_without_display_handle_from_env(),
            );
            pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
                .into_iter()
                .map(|adapter| {
                    let info = adapter.get_info();
                    json!({
                        "name": info.name,
                        "description": format!("{} ({:?}), {} {}", info.backend, info.device_type, info.driver, info.driver_info),
                        "backend": info.backend.to_string(),
                        "device_type": format!("{:?}", info.device_type),
                        "driver": info.driver,
                        "driver_info": info.driver_info,
                        "timestamps": adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
                    })
                })
                .collect()
        }
    }
}
