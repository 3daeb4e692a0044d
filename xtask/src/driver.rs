//! Making sure that there is a graphics adapter.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::paths::Paths;
use crate::process::{answer, run};
use crate::{Fault, Options, apt};

const PACKAGE: &str = "mesa-vulkan-drivers";

/// The folders in which Vulkan's loader looks for drivers.
const FOLDERS: [&str; 4] = [
    "/usr/share/vulkan/icd.d",
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
    "/usr/local/etc/vulkan/icd.d",
];

/// The variables that replace the loader's search, the stronger one first.
const VARIABLES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

fn has_manifest(path: &Path) -> bool {
    if path.is_dir() {
        std::fs::read_dir(path).is_ok_and(|entries| {
            entries
                .flatten()
                .any(|e| e.path().extension().is_some_and(|x| x == "json"))
        })
    } else {
        path.is_file()
    }
}

/// What can be said about drivers before anything is built.
#[derive(Debug, PartialEq, Eq)]
enum Found {
    /// A driver's manifest is there, or this system does not use such files.
    Driver,
    /// There is none.
    Nothing,
    /// A variable names files none of which exists.
    Misled(&'static str, String),
}

fn look(variable: impl Fn(&str) -> Option<String>, folders: &[PathBuf]) -> Found {
    for name in VARIABLES {
        if let Some(value) = variable(name).filter(|v| !v.is_empty()) {
            return if env::split_paths(&value).any(|p| has_manifest(&p)) {
                Found::Driver
            } else {
                Found::Misled(name, value)
            };
        }
    }
    if folders.iter().any(|folder| has_manifest(folder)) {
        Found::Driver
    } else {
        Found::Nothing
    }
}

fn missing(why: &str) -> Fault {
    format!(
        "this machine has no graphics adapter, and {why}.\nInstall a software Vulkan driver with this line, then run the \
         command again:\n\n    {}\n",
        apt::line(&[PACKAGE])
    )
}

/// Makes sure, before the long build, that a driver is installed.
pub fn before_build(options: &Options) -> Result<(), Fault> {
    if !cfg!(target_os = "linux") {
        return Ok(());
    }
    let mut folders: Vec<PathBuf> = FOLDERS.iter().map(PathBuf::from).collect();
    let home = env::var_os("HOME").map(PathBuf::from);
    let data = env::var_os("XDG_DATA_HOME")
        .map(PathBuf::from)
        .or_else(|| home.map(|h| h.join(".local/share")));
    folders.extend(data.map(|d| d.join("vulkan/icd.d")));
    match look(|name| env::var(name).ok(), &folders) {
        Found::Driver => Ok(()),
        Found::Nothing => apt::install(&[PACKAGE], options.install).map_err(|why| missing(&why)),
        Found::Misled(name, value) => Err(format!(
            "{name} is `{value}`, but no such file exists, so that no Vulkan driver can be loaded; correct or unset it"
        )),
    }
}

/// Builds the command line in release.
///
/// The whole workspace is selected, so that every command uses the same features and nothing is compiled twice.
pub fn build_command_line(paths: &Paths) -> Result<(), Fault> {
    run(Command::new(&paths.cargo).current_dir(&paths.root).args([
        "build",
        "--release",
        "--workspace",
        "--bin",
        "veduta",
    ]))
}

/// Gives a command that opens adapters a runtime folder where the session has none: without one, the OpenGL driver prints
/// an error for every adapter that it opens, which has no other effect.
pub fn quiet<'a>(command: &'a mut Command, paths: &Paths) -> &'a mut Command {
    const NAME: &str = "XDG_RUNTIME_DIR";
    let folder = paths.target.join("tmp").join("runtime");
    if cfg!(target_os = "linux")
        && env::var_os(NAME).is_none()
        && std::fs::create_dir_all(&folder).is_ok()
    {
        command.env(NAME, folder);
    }
    command
}

fn adapters(paths: &Paths) -> Option<String> {
    let list = answer(Command::new(&paths.veduta).args(["list", "adapters", "--json"]))?;
    list.contains("\"name\"").then_some(list)
}

/// Makes sure, after the build, that an adapter answers; a driver without a device is no adapter.
pub fn after_build(paths: &Paths, options: &Options) -> Result<(), Fault> {
    if adapters(paths).is_some() {
        return Ok(());
    }
    if cfg!(target_os = "linux") {
        apt::install(&[PACKAGE], options.install).map_err(|why| missing(&why))?;
        if adapters(paths).is_some() {
            return Ok(());
        }
    }
    Err("`veduta list adapters` finds no graphics adapter; update the driver of this machine's graphics card".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manifests_and_variables() {
        let folder = env::temp_dir().join(format!("veduta-xtask-{}", std::process::id()));
        let (empty, full) = (folder.join("empty"), folder.join("full"));
        std::fs::create_dir_all(&empty).unwrap();
        std::fs::create_dir_all(&full).unwrap();
        let manifest = full.join("lvp_icd.json");
        std::fs::write(&manifest, "{}").unwrap();
        let unset = |_: &str| None;
        assert_eq!(look(unset, &[empty.clone(), full.clone()]), Found::Driver);
        assert_eq!(
            look(unset, &[empty.clone(), folder.join("none")]),
            Found::Nothing
        );
        let set = |to: &Path| {
            let to = to.display().to_string();
            move |name: &str| (name == "VK_ICD_FILENAMES").then(|| to.clone())
        };
        assert_eq!(
            look(set(&manifest), std::slice::from_ref(&empty)),
            Found::Driver
        );
        let gone = folder.join("gone.json");
        assert_eq!(
            look(set(&gone), std::slice::from_ref(&full)),
            Found::Misled("VK_ICD_FILENAMES", gone.display().to_string())
        );
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
