//! `cargo xtask test`: what the tests need, then every check.

use std::process::Command;
use std::time::{Duration, Instant};

use crate::paths::Paths;
use crate::process::{Counts, run as run_command, run_tests, seconds, shown};
use crate::tools::{Tool, Variable};
use crate::{Fault, Options, driver, tools};

/// A check.
struct Step {
    /// Its name in the summary.
    name: &'static str,
    /// The arguments of `cargo`.
    arguments: &'static str,
    /// A variable that it needs.
    variable: Option<(&'static str, &'static str)>,
    /// Whether it runs tests, which are counted.
    tests: bool,
}

const STEPS: [Step; 5] = [
    Step {
        name: "formatting",
        arguments: "fmt --all --check",
        variable: None,
        tests: false,
    },
    Step {
        name: "lints",
        arguments: "clippy --release --workspace --all-targets --all-features -- -D warnings",
        variable: None,
        tests: false,
    },
    Step {
        name: "documentation",
        arguments: "doc --release --workspace --no-deps --all-features",
        variable: Some(("RUSTDOCFLAGS", "-D warnings")),
        tests: false,
    },
    Step {
        name: "tests",
        arguments: "test --release --workspace --features veduta-cli/flip",
        variable: None,
        tests: true,
    },
    // The same packages as above, so that only our own crates are compiled again.
    Step {
        name: "preset tests, low_quality",
        arguments: "test --release --workspace --features veduta/low_quality,veduta-cli/low_quality,veduta-cli/flip --test all -- preset",
        variable: None,
        tests: true,
    },
];

struct Row {
    name: String,
    time: Duration,
    outcome: String,
}

fn summary(rows: &[Row], total: Duration, skipped: &[String]) -> String {
    let width = rows.iter().map(|r| r.name.len()).max().unwrap_or(0).max(5);
    let mut text = format!("\n{:<width$}  {:>12}  result\n", "step", "time");
    for row in rows {
        text += &format!(
            "{:<width$}  {:>12}  {}\n",
            row.name,
            seconds(row.time),
            row.outcome
        );
    }
    text += &format!("{:<width$}  {:>12}\n", "total", seconds(total));
    for line in skipped {
        text += &format!("{line}\n");
    }
    text
}

fn carry_out(step: &Step, paths: &Paths, variables: &[&Variable]) -> (Counts, Result<(), Fault>) {
    let mut command = Command::new(&paths.cargo);
    driver::quiet(&mut command, paths)
        .current_dir(&paths.root)
        .args(step.arguments.split_whitespace());
    for variable in variables {
        command.env(variable.name, &variable.value);
    }
    if let Some((name, value)) = step.variable {
        command.env(name, value);
    }
    println!("\n== {}: {}", step.name, shown(&command));
    if step.tests {
        run_tests(&mut command, &mut std::io::stdout())
    } else {
        (Counts::default(), run_command(&mut command))
    }
}

/// Sets up and runs every check; stops at the first that fails.
pub fn run(options: &Options) -> Result<(), Fault> {
    let start = Instant::now();
    let paths = Paths::find()?;
    println!("== set-up");
    tools::rust_components(&paths, options)?;
    tools::cpp_compiler(options)?;
    driver::before_build(options)?;
    let tools = [tools::spirv_val(options), tools::tint(&paths, options)];
    let skipped: Vec<String> = tools
        .iter()
        .filter_map(|t: &Tool| t.skipped.clone())
        .collect();
    for line in &skipped {
        println!("{line}");
    }
    let variables: Vec<&Variable> = tools.iter().flat_map(|t| &t.variables).collect();
    let mut rows = vec![Row {
        name: "set-up".to_owned(),
        time: start.elapsed(),
        outcome: match skipped.len() {
            0 => "done".to_owned(),
            n => format!("done, {n} SKIPPED"),
        },
    }];
    let mut all = Counts::default();
    let mut fault = None;
    for step in &STEPS {
        let time = Instant::now();
        // An adapter is needed by the tests only, so that lints report before the long build.
        let (counts, result) = if step.name == "tests" {
            println!("\n== the command line and the graphics adapter");
            let ready = driver::build_command_line(&paths)
                .and_then(|()| driver::after_build(&paths, options));
            match ready {
                Ok(()) => carry_out(step, &paths, &variables),
                Err(fault) => (Counts::default(), Err(fault)),
            }
        } else {
            carry_out(step, &paths, &variables)
        };
        all.passed += counts.passed;
        all.failed += counts.failed;
        all.ignored += counts.ignored;
        let tests = if step.tests {
            format!(", {} tests", counts.passed + counts.failed)
        } else {
            String::new()
        };
        println!("== {}: {}", step.name, seconds(time.elapsed()));
        rows.push(Row {
            name: step.name.to_owned(),
            time: time.elapsed(),
            outcome: match &result {
                Ok(()) => format!("passed{tests}"),
                Err(_) => format!("FAILED{tests}"),
            },
        });
        if let Err(f) = result {
            fault = Some(f);
            break;
        }
    }
    println!("{}", summary(&rows, start.elapsed(), &skipped));
    println!(
        "{} passed, {} failed, {} skipped",
        all.passed, all.failed, all.ignored
    );
    match fault {
        Some(fault) => Err(fault),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_names_every_step_and_what_was_skipped() {
        let rows: Vec<Row> = STEPS
            .iter()
            .map(|s| Row {
                name: s.name.to_owned(),
                time: Duration::from_millis(1500),
                outcome: "passed".to_owned(),
            })
            .collect();
        let text = summary(
            &rows,
            Duration::from_secs(200),
            &["SKIPPED Tint: why".to_owned()],
        );
        for step in &STEPS {
            assert!(text.contains(step.name), "{text}");
        }
        assert!(
            text.contains("3 min 20 s") && text.contains("\nSKIPPED Tint: why\n"),
            "{text}"
        );
    }
}
