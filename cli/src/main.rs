//! The command `veduta`.

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    match veduta_cli::Args::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
