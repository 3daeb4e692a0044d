//! Writes the table of the files that `veduta` ships, which its build script names.

use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut table = String::from("&[\n");
    let mut files = Vec::new();
    for (name, variable) in [
        ("presets", "DEP_VEDUTA_PRESETS"),
        ("wgsl", "DEP_VEDUTA_WGSL"),
    ] {
        println!("cargo::rerun-if-env-changed={variable}");
        let folder = PathBuf::from(
            std::env::var(variable)
                .map_err(|e| format!("{variable}: {e}: veduta's build names it"))?,
        );
        println!("cargo::rerun-if-changed={}", folder.display());
        collect(&folder, name, &mut files)?;
    }
    files.sort();
    for (name, path) in files {
        table.push_str(&format!(
            "({name:?}, include_str!({:?})),\n",
            path.display().to_string()
        ));
    }
    table.push_str("]\n");
    let out = PathBuf::from(std::env::var("OUT_DIR")?).join("shipped.rs");
    std::fs::write(out, table)?;
    Ok(())
}

fn collect(
    folder: &Path,
    name: &str,
    files: &mut Vec<(String, PathBuf)>,
) -> Result<(), Box<dyn std::error::Error>> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(file) = path.file_name().and_then(|n| n.to_str()) else {
            continue;
        };
        let name = format!("{name}/{file}");
        if path.is_dir() {
            collect(&path, &name, files)?;
        } else if !file.starts_with('.') {
            files.push((name, path));
        }
    }
    Ok(())
}
