//! Debian's package manager.

use std::env;
use std::path::Path;
use std::process::Command;

use crate::Fault;
use crate::process::{answer, run};

/// The line that a user types to install packages.
pub fn line(packages: &[&str]) -> String {
    let sudo = if is_root() { "" } else { "sudo " };
    format!(
        "{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {}",
        packages.join(" ")
    )
}

fn is_root() -> bool {
    answer(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0")
}

fn on_path(program: &str) -> bool {
    env::var_os("PATH")
        .is_some_and(|path| env::split_paths(&path).any(|folder| folder.join(program).is_file()))
}

/// The words before `apt-get`, or why it may not be called.
fn permission(allowed: bool) -> Result<Vec<&'static str>, Fault> {
    if !allowed {
        return Err("--no-install was given".to_owned());
    }
    if !cfg!(target_os = "linux")
        || !(on_path("apt-get") || Path::new("/usr/bin/apt-get").is_file())
    {
        return Err("this system has no apt-get".to_owned());
    }
    if is_root() {
        return Ok(vec![]);
    }
    if answer(Command::new("sudo").args(["-n", "true"])).is_some() {
        return Ok(vec!["sudo", "-n"]);
    }
    Err("apt-get needs root, and sudo asks for a password".to_owned())
}

/// Installs packages, or says why it may not or could not.
pub fn install(packages: &[&str], allowed: bool) -> Result<(), Fault> {
    let before = permission(allowed)?;
    println!("Installing {} with apt-get ...", packages.join(", "));
    let apt = |arguments: &[&str]| {
        let mut words = before.clone();
        words.extend(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
        words.extend([
            "-q",
            "-o",
            "Acquire::Retries=3",
            "-o",
            "DPkg::Lock::Timeout=300",
        ]);
        words.extend(arguments);
        run(Command::new(words[0]).args(&words[1..]))
    };
    // A source of the user's own that does not answer spoils the update, but seldom the packages that we need.
    if let Err(fault) = apt(&["update"]) {
        eprintln!("warning: {fault}");
    }
    let mut arguments = vec!["install", "-y", "--no-install-recommends"];
    arguments.extend(packages);
    apt(&arguments)
}
