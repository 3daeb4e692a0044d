//! The two commands that set everything up and run it: `cargo xtask demo` and `cargo xtask test`.

mod apt;
mod demo;
mod driver;
mod paths;
mod process;
mod test;
mod tools;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask <command> [--no-install]

commands:
  demo    renders both thesis presets at 800x450 into out/
  test    formatting, lints, documentation and every test, with what they need

options:
  --no-install    never calls the system's package manager; says what is missing instead";

/// Why a command did not succeed, as the user reads it.
type Fault = String;

struct Options {
    /// Whether the system's package manager may be called.
    install: bool,
}

fn main() -> ExitCode {
    let mut command = None;
    let mut options = Options { install: true };
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--no-install" => options.install = false,
            "--help" | "-h" | "help" => {
                println!("{USAGE}");
                return ExitCode::SUCCESS;
            }
            "demo" | "test" if command.is_none() => command = Some(argument),
            other => {
                eprintln!("xtask: `{other}` is not understood\n\n{USAGE}");
                return ExitCode::from(2);
            }
        }
    }
    let outcome = match command.as_deref() {
        Some("demo") => demo::run(&options),
        Some("test") => test::run(&options),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}
