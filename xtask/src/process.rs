//! Running other programs.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::Fault;

/// The command as one would type it.
pub fn shown(command: &Command) -> String {
    let mut text = command.get_program().to_string_lossy().into_owned();
    if let Some((_, file)) = text.rsplit_once(['/', '\\']) {
        text = file.to_owned();
    }
    for argument in command.get_args() {
        let argument = argument.to_string_lossy();
        text.push(' ');
        if argument.contains(' ') {
            text.push_str(&format!("'{argument}'"));
        } else {
            text.push_str(&argument);
        }
    }
    text
}

/// Runs a command with our own output and waits for it; any exit code but 0 is a fault.
pub fn run(command: &mut Command) -> Result<(), Fault> {
    let status = command
        .status()
        .map_err(|e| format!("`{}` cannot be started: {e}", shown(command)))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("`{}` failed with {status}", shown(command)))
    }
}

/// Runs a command and returns what it printed on its standard output; `None` when it cannot be started or fails.
pub fn answer(command: &mut Command) -> Option<String> {
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    if output.status.success() {
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        None
    }
}

/// Tests that ran.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Tests that passed.
    pub passed: u64,
    /// Tests that failed.
    pub failed: u64,
    /// Tests that were left out.
    pub ignored: u64,
}

impl Counts {
    /// Adds the numbers of a line such as `test result: ok. 3 passed; 0 failed; 1 ignored; ...`.
    fn add_line(&mut self, line: &str) {
        let Some(rest) = line.strip_prefix("test result: ") else {
            return;
        };
        let words: Vec<&str> = rest
            .split(|c: char| c.is_whitespace() || c == ';')
            .filter(|w| !w.is_empty())
            .collect();
        for pair in words.windows(2) {
            if let Ok(number) = pair[0].parse::<u64>() {
                match pair[1] {
                    "passed" => self.passed += number,
                    "failed" => self.failed += number,
                    "ignored" => self.ignored += number,
                    _ => {}
                }
            }
        }
    }
}

/// Runs a test command, writing its output to `shown_to` as it comes, and counts the tests of all its test programs.
///
/// The counts of what ran are returned even when the command failed.
pub fn run_tests(command: &mut Command, shown_to: &mut dyn Write) -> (Counts, Result<(), Fault>) {
    let mut counts = Counts::default();
    let result = (|| {
        let cannot = |e: std::io::Error, c: &Command| format!("`{}` cannot be run: {e}", shown(c));
        let mut child = command
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| cannot(e, command))?;
        if let Some(stdout) = child.stdout.take() {
            let mut reader = BufReader::new(stdout);
            let mut line = Vec::new();
            loop {
                line.clear();
                let length = reader
                    .read_until(b'\n', &mut line)
                    .map_err(|e| cannot(e, command))?;
                if length == 0 {
                    break;
                }
                shown_to
                    .write_all(&line)
                    .and_then(|()| shown_to.flush())
                    .map_err(|e| cannot(e, command))?;
                counts.add_line(&String::from_utf8_lossy(&line));
            }
        }
        let status = child.wait().map_err(|e| cannot(e, command))?;
        if !status.success() {
            return Err(format!("`{}` failed with {status}", shown(command)));
        }
        if counts.passed == 0 {
            return Err(format!("`{}` ran no test", shown(command)));
        }
        Ok(())
    })();
    (counts, result)
}

/// A duration as a person reads it.
pub fn seconds(time: Duration) -> String {
    let s = time.as_secs_f64();
    if s < 99.95 {
        format!("{s:.1} s")
    } else {
        let whole = s.round() as u64;
        format!("{} min {:02} s", whole / 60, whole % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_over_test_programs() {
        let mut counts = Counts::default();
        for line in [
            "running 4 tests",
            "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 7 filtered out; finished in 0.01s",
            "test a ... ok",
            "test result: FAILED. 2 passed; 5 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            counts.add_line(line);
        }
        assert_eq!(
            counts,
            Counts {
                passed: 5,
                failed: 5,
                ignored: 1
            }
        );
    }

    #[test]
    fn commands_and_times_are_readable() {
        let mut command = Command::new("some/where/cargo");
        command.args(["test", "a b"]);
        assert_eq!(shown(&command), "cargo test 'a b'");
        assert_eq!(seconds(Duration::from_millis(12_340)), "12.3 s");
        assert_eq!(seconds(Duration::from_millis(99_960)), "1 min 40 s");
        assert_eq!(seconds(Duration::from_secs(3_601)), "60 min 01 s");
    }

    #[cfg(unix)]
    #[test]
    fn a_test_command_without_tests_or_with_a_failure_is_a_fault() {
        let shell = |script: &str| {
            let mut shown_to = Vec::new();
            let outcome = run_tests(Command::new("sh").args(["-c", script]), &mut shown_to);
            assert!(!shown_to.is_empty());
            outcome
        };
        let (counts, result) = shell("echo nothing");
        assert_eq!(counts, Counts::default());
        assert!(result.unwrap_err().contains("ran no test"));
        let line = "echo 'test result: ok. 2 passed; 0 failed; 0 ignored; 0 measured'";
        let (counts, result) = shell(line);
        assert_eq!((counts.passed, result), (2, Ok(())));
        let (_, result) = shell(&format!("{line}; exit 3"));
        assert!(result.unwrap_err().contains("failed with"));
    }
}
