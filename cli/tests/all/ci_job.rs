//! The shell job of `docs/ci-lint.md`, run as it stands there.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{Run, copy_fixture, folder};

/// The first `sh` block behind the mark.
fn job() -> String {
    let doc = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/ci-lint.md");
    let doc = std::fs::read_to_string(doc).unwrap();
    let (_, behind) = doc.split_once("<!-- the tests run this block").unwrap();
    let (_, block) = behind.split_once("```sh\n").unwrap();
    let (job, _) = block.split_once("```").unwrap();
    assert!(job.contains("veduta lint"), "{job}");
    job.to_owned()
}

fn run(fixture: &str) -> (Run, PathBuf) {
    let dir = folder(&format!("ci_{fixture}"));
    copy_fixture(&format!("user_project/{fixture}"), &dir);
    let programs = Path::new(env!("CARGO_BIN_EXE_veduta")).parent().unwrap();
    let mut path = std::ffi::OsString::from(programs);
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", &job()])
        .current_dir(&dir)
        .env("PATH", path)
        .output()
        .unwrap();
    (Run::of(output), dir)
}

#[test]
fn the_job_passes_a_good_project() {
    let (run, dir) = run("good");
    run.good();
    assert_eq!(
        crate::common::json(&dir.join("lint.json")),
        serde_json::json!([])
    );
}

#[test]
fn the_job_stops_at_a_fault() {
    let (run, dir) = run("faulty");
    let run = run.bad(1, &["faults found"]);
    assert!(run.out.contains("shaders/map.sp:"), "{}", run.out);
    let report = crate::common::json(&dir.join("lint.json"));
    assert!(report.as_array().unwrap().len() >= 5, "{report}");
}
