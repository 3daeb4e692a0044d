//! `cargo xtask demo`: both pictures of the thesis, from nothing.

use std::fs;
use std::process::Command;
use std::time::Instant;

use crate::paths::Paths;
use crate::process::{run as run_command, seconds};
use crate::{Fault, Options, driver};

const PRESETS: [&str; 2] = ["thesis", "thesis_low"];
const SIZE: &str = "800x450";
/// Two thirds sky, as in the pictures of the thesis.
const VIEW: &str = "V01";

/// Sets up, builds and renders.
pub fn run(options: &Options) -> Result<(), Fault> {
    let start = Instant::now();
    let paths = Paths::find()?;
    driver::before_build(options)?;
    println!("Building the command line in release (minutes the first time) ...");
    let build = Instant::now();
    driver::build_command_line(&paths)?;
    let build = build.elapsed();
    driver::after_build(&paths, options)?;

    let out = paths.root.join("out");
    fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let mut lines = vec![format!("{:<28} {:>12}", "build", seconds(build))];
    for (i, preset) in PRESETS.iter().enumerate() {
        println!(
            "Rendering {preset} at {SIZE} ({} of {}) ...",
            i + 1,
            PRESETS.len()
        );
        let picture = out.join(format!("{preset}.png"));
        let time = Instant::now();
        run_command(
            driver::quiet(&mut Command::new(&paths.veduta), &paths)
                .current_dir(&paths.root)
                .args([
                    "render", "--preset", preset, "--view", VIEW, "--size", SIZE, "--out",
                ])
                .arg(&picture),
        )?;
        let bytes = fs::metadata(&picture)
            .map_err(|e| format!("the picture {} is missing: {e}", picture.display()))?
            .len();
        lines.push(format!(
            "{:<28} {:>12}   {} ({} KiB)",
            format!("{preset}, {SIZE}"),
            seconds(time.elapsed()),
            picture.display(),
            bytes.div_ceil(1024)
        ));
    }
    lines.push(format!(
        "{:<28} {:>12}",
        "together",
        seconds(start.elapsed())
    ));
    println!("\n{}", lines.join("\n"));
    Ok(())
}
