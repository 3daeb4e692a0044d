//! Where the repository, its build output and its programs are.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::Fault;

/// The folders and programs that both commands use.
pub struct Paths {
    /// The repository.
    pub root: PathBuf,
    /// Cargo's build output, usually `target` in the repository.
    pub target: PathBuf,
    /// The release build of the command line.
    pub veduta: PathBuf,
    /// Cargo itself.
    pub cargo: OsString,
}

impl Paths {
    /// Finds everything from what Cargo tells a program that it runs.
    pub fn find() -> Result<Paths, Fault> {
        let not_cargo = || "call this as `cargo xtask` inside the repository".to_owned();
        let package = env::var_os("CARGO_MANIFEST_DIR").ok_or_else(not_cargo)?;
        let root = Path::new(&package)
            .parent()
            .ok_or_else(not_cargo)?
            .to_path_buf();
        let this = env::current_exe().map_err(|e| format!("cannot find its own path: {e}"))?;
        let release = this.parent().ok_or_else(not_cargo)?;
        Ok(Paths {
            root,
            target: release.parent().ok_or_else(not_cargo)?.to_path_buf(),
            veduta: release.join(format!("veduta{}", env::consts::EXE_SUFFIX)),
            cargo: env::var_os("CARGO").unwrap_or_else(|| "cargo".into()),
        })
    }
}
