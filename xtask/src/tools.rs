//! The validators that the tests use beside naga: `spirv-val` and Tint.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::paths::Paths;
use crate::process::{answer, run};
use crate::{Fault, Options, apt};

/// A variable for the tests.
pub struct Variable {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: String,
}

/// A tool that is ready, or that cannot be had here.
pub struct Tool {
    /// What the tests have to be told.
    pub variables: Vec<Variable>,
    /// Why it cannot be had.
    pub skipped: Option<String>,
}

fn skipped(tool: &str, variable: &'static str, why: &str) -> Tool {
    Tool {
        variables: vec![Variable {
            name: variable,
            value: "1".to_owned(),
        }],
        skipped: Some(format!("SKIPPED {tool}: {why}")),
    }
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim()
}

/// The formatter and the linter, which a minimal Rust installation lacks.
pub fn rust_components(paths: &Paths, options: &Options) -> Result<(), Fault> {
    let missing: Vec<&str> = [("fmt", "rustfmt"), ("clippy", "clippy")]
        .into_iter()
        .filter(|(subcommand, _)| {
            let mut command = Command::new(&paths.cargo);
            command
                .current_dir(&paths.root)
                .args([subcommand, "--version"]);
            answer(&mut command).is_none()
        })
        .map(|(_, component)| component)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let line = format!("rustup component add {}", missing.join(" "));
    let fault = |why: &str| {
        format!(
            "Rust comes without {}, and {why}; run `{line}`",
            missing.join(" and ")
        )
    };
    if !options.install {
        return Err(fault("--no-install was given"));
    }
    let mut rustup = Command::new("rustup");
    rustup
        .current_dir(&paths.root)
        .args(["component", "add"])
        .args(&missing);
    run(&mut rustup).map_err(|why| fault(&why))
}

/// A C++ compiler, which the FLIP metric of the benchmarks is built with.
pub fn cpp_compiler(options: &Options) -> Result<(), Fault> {
    let works = || {
        let compiler = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
        answer(Command::new(compiler).arg("--version")).is_some()
    };
    if works() {
        return Ok(());
    }
    let fault = |why: &str| {
        format!(
            "the FLIP metric is built with a C++ compiler, and {why}; `{}` brings one",
            apt::line(&["g++"])
        )
    };
    apt::install(&["g++"], options.install).map_err(|why| fault(&why))?;
    if works() {
        Ok(())
    } else {
        Err(fault("the package g++ brought no `c++`"))
    }
}

/// `spirv-val` of the SPIR-V tools.
pub fn spirv_val(options: &Options) -> Tool {
    let version = || answer(Command::new("spirv-val").arg("--version"));
    let result = match version() {
        Some(v) => Ok(v),
        None => apt::install(&["spirv-tools"], options.install).and_then(|()| {
            version().ok_or_else(|| "the package spirv-tools brought no `spirv-val`".to_owned())
        }),
    };
    match result {
        Ok(version) => {
            println!("spirv-val: {}", first_line(&version));
            Tool {
                variables: vec![],
                skipped: None,
            }
        }
        Err(why) => skipped(
            "the SPIR-V validator",
            "VEDUTA_NO_SPIRV_VAL",
            &format!("{why}; it comes with `{}`", apt::line(&["spirv-tools"])),
        ),
    }
}

/// The oldest Node that runs the package of Tint.
const NODE: u32 = 18;

fn node_version() -> Option<(u32, String)> {
    let text = answer(Command::new("node").arg("--version"))?;
    let version = text.trim().to_owned();
    let major = version
        .trim_start_matches('v')
        .split('.')
        .next()?
        .parse()
        .ok()?;
    Some((major, version))
}

fn npm() -> Command {
    if cfg!(windows) {
        let mut command = Command::new("cmd");
        command.args(["/C", "npm"]);
        command
    } else {
        Command::new("npm")
    }
}

fn node(options: &Options) -> Result<String, Fault> {
    let npm_works = || answer(npm().arg("--version")).is_some();
    if node_version().is_none() || !npm_works() {
        let packages: &[&str] = match node_version() {
            Some(_) => &["npm"],
            None => &["nodejs", "npm"],
        };
        apt::install(packages, options.install)
            .map_err(|why| format!("{why}; it needs Node {NODE} or later with npm"))?;
    }
    match node_version() {
        Some((major, version)) if major >= NODE && npm_works() => Ok(version),
        Some((_, version)) => Err(format!(
            "it needs Node {NODE} or later with npm, and this is Node {version}"
        )),
        None => Err(format!("it needs Node {NODE} or later with npm")),
    }
}

fn install_tint(paths: &Paths, options: &Options) -> Result<(String, PathBuf), Fault> {
    let version = node(options)?;
    let folder = paths.target.join("tint");
    let source = paths.root.join("tools").join("tint");
    let lock = "package-lock.json";
    let wanted = fs::read(source.join(lock)).map_err(|e| format!("tools/tint/{lock}: {e}"))?;
    // The mark is written last, so that an install that broke off is done again.
    let mark = folder.join("installed.json");
    if fs::read(&mark).is_ok_and(|found| found == wanted) {
        return Ok((version, folder));
    }
    let broken = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(&folder).map_err(broken)?;
    for file in ["package.json", lock] {
        fs::copy(source.join(file), folder.join(file)).map_err(broken)?;
    }
    println!(
        "Installing Tint (the npm package `webgpu`) into {} ...",
        folder.display()
    );
    run(npm()
        .current_dir(&folder)
        .args(["ci", "--ignore-scripts", "--no-audit", "--no-fund"]))?;
    fs::write(&mark, wanted).map_err(broken)?;
    Ok((version, folder))
}

/// Tint, in the npm package `webgpu`.
pub fn tint(paths: &Paths, options: &Options) -> Tool {
    match install_tint(paths, options) {
        Ok((version, folder)) => {
            println!("Tint: the npm package `webgpu` under Node {version}");
            Tool {
                variables: vec![Variable {
                    name: "VEDUTA_TINT_DIR",
                    value: folder.display().to_string(),
                }],
                skipped: None,
            }
        }
        Err(why) => skipped("Tint", "VEDUTA_NO_TINT", &why),
    }
}
