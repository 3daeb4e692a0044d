//! `veduta cost`: what is counted, exactly; that times are there, not how long they are.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value as Json;
use veduta_cli::bench::timing::Clock;
use veduta_cli::commands::render::RenderArgs;
use veduta_cli::cost::{Change, Child, fresh, spirv_instructions, variants};
use veduta_cli::render::Size;

use crate::common::{folder, json, veduta};

/// Runs `veduta cost` without times; the report by scene.
fn counted(dir: &Path, args: &[&str]) -> BTreeMap<String, Json> {
    let rest = ["--no-time", "--size", "32x18", "--json", "cost.json"];
    veduta(dir, &[&["cost"], args, &rest].concat()).good();
    json(&dir.join("cost.json"))["scenes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| (s["scene"].as_str().unwrap().to_owned(), s.clone()))
        .collect()
}

/// The entry of a scene with this change, for instance `without CLOUDS`.
fn entry<'a>(scene: &'a Json, change: &str) -> &'a Json {
    let found = scene["entries"].as_array().unwrap().iter().find(|e| {
        let feature = e["feature"].as_str().unwrap_or_default();
        format!("{} {feature}", e["change"].as_str().unwrap()).trim() == change
    });
    found.unwrap_or_else(|| panic!("no {change:?} in {scene:#}"))
}

fn changes(scene: &Json) -> Vec<String> {
    let entries = scene["entries"].as_array().unwrap();
    let feature = |e: &Json| e["feature"].as_str().unwrap_or_default().to_owned();
    let all = entries.iter();
    all.map(|e| format!("{} {}", e["change"].as_str().unwrap(), feature(e)))
        .map(|c| c.trim().to_owned())
        .collect()
}

#[test]
fn a_scene_without_a_feature_is_the_scene_that_does_not_name_it() {
    let dir = folder("cost_scenes");
    let scenes = counted(&dir, &["thesis", "clear", "sky"]);
    let [thesis, clear, sky] = ["thesis", "clear", "sky"].map(|n| &scenes[n]);
    let without = ["ATMOSPHERE", "CLOUDS", "TERRAIN"].map(|f| format!("without {f}"));
    assert_eq!(
        changes(thesis),
        [&["whole".to_owned()], &without[..]].concat()
    );
    assert_eq!(
        changes(clear),
        [
            "whole",
            "without ATMOSPHERE",
            "with CLOUDS",
            "without TERRAIN"
        ]
    );
    // Two ways to one variant, seen from one place: nothing may differ.
    for (a, b) in [
        (entry(thesis, "without CLOUDS"), entry(clear, "whole")),
        (entry(thesis, "without TERRAIN"), entry(sky, "whole")),
        (entry(thesis, "whole"), entry(clear, "with CLOUDS")),
        (entry(thesis, "whole"), entry(sky, "with TERRAIN")),
    ] {
        for what in ["counts", "operations", "features"] {
            assert_eq!(a[what], b[what]);
        }
    }
    // Adding is the opposite of leaving out.
    assert_eq!(
        entry(thesis, "without CLOUDS")["adds"],
        entry(clear, "with CLOUDS")["adds"]
    );
    let adds = &entry(thesis, "without CLOUDS")["adds"];
    let (more, less) = (entry(thesis, "whole"), entry(thesis, "without CLOUDS"));
    for part in ["counts", "operations"] {
        for (name, value) in adds[part].as_object().unwrap() {
            let of = |e: &Json| e[part][name].as_f64().unwrap();
            assert_eq!(value.as_f64().unwrap(), of(more) - of(less), "{name}");
        }
    }
    for (scene, report) in &scenes {
        for e in report["entries"].as_array().unwrap() {
            let count = |name: &str| e["counts"][name].as_u64().unwrap();
            let features: Vec<&str> = e["features"]
                .as_array()
                .unwrap()
                .iter()
                .map(|f| f.as_str().unwrap())
                .collect();
            let has = |feature: &str| features.contains(&feature);
            assert_eq!(count("draws"), 1, "{scene} {features:?}");
            for none in ["textures", "texture_bytes", "dispatches", "still_work"] {
                assert_eq!(count(none), 0, "{scene} {features:?}: {none}");
            }
            let lattices = u64::from(has("TERRAIN") || has("CLOUDS"));
            assert_eq!(count("bindings"), 2 + lattices);
            assert_eq!(count("buffers"), 2 + lattices);
            assert_eq!(count("moved_writes"), 1 + lattices);
            let program = veduta::programs().get("landscape", &features);
            if let Ok(program) = program {
                let bytes: usize = program.stages.iter().map(|s| s.wgsl.len()).sum();
                assert_eq!(count("wgsl_bytes"), bytes as u64);
                let blocks: u32 = program.structs.iter().map(|s| s.size).sum();
                assert_eq!(count("buffer_bytes"), u64::from(blocks));
            }
            let some = |name: &str| e["operations"][name].as_f64().unwrap() > 0.0;
            assert_eq!(some("density"), has("CLOUDS"));
            assert_eq!(some("light"), has("CLOUDS"));
            assert_eq!(some("air"), has("ATMOSPHERE"));
            assert_eq!(some("noise"), has("CLOUDS") || has("TERRAIN"));
        }
    }
}

#[test]
fn instructions_are_those_that_compose_writes() {
    let dir = folder("cost_spirv");
    // A value that is its key's default nowhere, so that forgetting the preset's values would show.
    let set = ["--preset", "low", "--set", "MAX_MARCHING_STEPS=123"];
    let scenes = counted(&dir, &[&["clear"], &set[..]].concat());
    let write = [
        "compose",
        "landscape",
        "--scene",
        "clear",
        "--target",
        "spirv",
        "--out",
        "out",
    ];
    veduta(&dir, &[&write, &set[..]].concat()).good();
    let mut sum = 0;
    for stage in ["vertex", "fragment"] {
        let bytes = std::fs::read(dir.join(format!("out/landscape.{stage}.spv"))).unwrap();
        let words: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        sum += spirv_instructions(&words).unwrap();
        // In the middle of the first instruction, a capability.
        assert!(spirv_instructions(&words[..6]).is_err());
    }
    let counts = &entry(&scenes["clear"], "whole")["counts"];
    assert_eq!(counts["spirv_instructions"].as_u64().unwrap(), sum);
}

#[test]
fn what_the_preset_leaves_out_adds_nothing() {
    let dir = folder("cost_low");
    let scenes = counted(&dir, &["--preset", "thesis_low"]);
    let clouds = entry(&scenes["thesis"], "without CLOUDS");
    for part in ["counts", "operations"] {
        for (name, value) in clouds["adds"][part].as_object().unwrap() {
            assert_eq!(value.as_f64(), Some(0.0), "{name}");
        }
    }
    let terrain = entry(&scenes["thesis"], "without TERRAIN");
    assert!(terrain["adds"]["counts"]["wgsl_bytes"].as_f64().unwrap() > 10_000.0);
    // A flag that --set turns off is none that the scene names.
    let scenes = counted(&dir, &["--set", "TERRAIN=false"]);
    entry(&scenes["thesis"], "with TERRAIN");
    // A scene of one's own, with a feature of its own and without all others.
    std::fs::write(
        dir.join("shaken.ron"),
        r#"(program: "landscape", meaning: "Jitter.", features: ["CLOUD_JITTER"], content: {})"#,
    )
    .unwrap();
    let scenes = counted(&dir, &["shaken.ron"]);
    assert_eq!(
        changes(&scenes["shaken"]),
        [
            "whole",
            "with ATMOSPHERE",
            "with CLOUDS",
            "without CLOUD_JITTER",
            "with TERRAIN"
        ]
    );
    let jitter = &entry(&scenes["shaken"], "without CLOUD_JITTER")["adds"]["counts"];
    assert_eq!(jitter["wgsl_bytes"].as_f64(), Some(0.0), "without clouds");
}

#[test]
fn times_are_measured_in_turns() {
    let dir = folder("cost_times");
    let run = veduta(
        &dir,
        &[
            "cost",
            "clear",
            "--preset",
            "thesis_low",
            "--size",
            "16x9",
            "--rounds",
            "1",
            "--most-rounds",
            "1",
            "--out",
            "cost.md",
            "--json",
            "cost.json",
        ],
    )
    .good();
    let text = std::fs::read_to_string(dir.join("cost.md")).unwrap();
    assert_eq!(run.out, text);
    for part in [
        "veduta cost clear --preset thesis_low --view V01 --size 16x9",
        "## `clear`, preset `thesis_low`, view `V01`",
        "| TERRAIN adds ",
        "| CLOUDS would add ",
        "first draw",
        "MESA_SHADER_CACHE_DISABLE",
    ] {
        assert!(text.contains(part), "{part}");
    }
    let report = &json(&dir.join("cost.json"))["scenes"][0];
    for e in report["entries"].as_array().unwrap() {
        for kind in ["pipeline", "first_draw", "frame"] {
            let time = &e["times_ms"][kind];
            assert_eq!(time["rounds"], 1);
            assert!(time["median"].as_f64().unwrap() > 0.0, "{e:#}");
            // One round concludes nothing.
            let adds = &e["adds"]["times_ms"][kind];
            assert!(adds.is_null() || adds["conclusive"] == false, "{adds}");
        }
    }
}

/// Files below a folder.
fn files(dir: &Path) -> usize {
    std::fs::read_dir(dir).map_or(0, |entries| {
        entries
            .map(|e| e.unwrap().path())
            .map(|p| if p.is_dir() { files(&p) } else { 1 })
            .sum()
    })
}

#[cfg(target_os = "linux")]
#[test]
fn first_draws_take_nothing_from_the_cache_of_the_driver() {
    let dir = folder("cost_cache");
    let folders = ["kept", "none"].map(|name| {
        let path = dir.join(name);
        std::fs::create_dir_all(&path).unwrap();
        path
    });
    let arguments = |cache: &Path| -> Vec<String> {
        let mut all = vec![
            format!("MESA_SHADER_CACHE_DIR={}", cache.display()),
            env!("CARGO_BIN_EXE_veduta").to_owned(),
        ];
        let rest = "cost clear --preset thesis_low --clock wall --fresh-round";
        all.extend(rest.split(' ').map(str::to_owned));
        all
    };
    let kept = std::process::Command::new("env")
        .args(arguments(&folders[0]))
        .arg("0")
        .output()
        .unwrap();
    assert!(kept.status.success());
    let child = |arguments: Vec<String>| Child {
        program: "env".into(),
        arguments,
    };
    let times = child(arguments(&folders[1])).round(1).unwrap();
    assert_eq!(times.len(), 4, "the scene and a variant for each feature");
    assert!(times.iter().flatten().all(|t| *t > 0.0));
    println!("{} files, and {}", files(&folders[0]), files(&folders[1]));
    let info = veduta::device::shared().unwrap().adapter.get_info();
    if info.driver_info.contains("Mesa") {
        assert!(
            files(&folders[0]) > 0,
            "the driver has no cache to turn off"
        );
    }
    assert_eq!(files(&folders[1]), 0);
    // What goes wrong in the process is said.
    let mut wrong = arguments(&folders[1]);
    wrong.insert(3, "nowhere".to_owned());
    let fault = child(wrong).round(0).unwrap_err().to_string();
    assert!(fault.contains("nowhere"), "{fault}");
    let fault = Child {
        program: dir.join("no such program"),
        arguments: Vec::new(),
    };
    assert!(fault.round(0).is_err());
    assert!(child(vec!["echo".to_owned()]).round(7).is_err(), "no times");
}

#[test]
fn every_variant_is_measured_once_a_round() {
    let args = RenderArgs {
        scene: "sky".to_owned(),
        preset: Some("thesis_low".to_owned()),
        ..RenderArgs::default()
    };
    let size = Size {
        width: 16,
        height: 9,
    };
    let all = variants(&args, size).unwrap();
    assert_eq!(all[0].change, Change::Whole);
    assert_eq!(all[3].change, Change::With("TERRAIN".to_owned()));
    assert!(
        all.iter().all(|v| v.view == all[0].view),
        "seen from one place"
    );
    // Above the ground that the scene does not have.
    assert!(all[0].view.eye.altitude() > 301.0);
    for round in 0..2 {
        let times = fresh(&all, Clock::Wall, round).unwrap();
        assert!(times.len() == 4 && times.iter().flatten().all(|t| *t > 0.0));
    }
    assert!(fresh(&[], Clock::Wall, 0).unwrap().is_empty());
}

#[test]
fn wrong_arguments_are_named() {
    let dir = folder("cost_wrong");
    veduta(&dir, &["cost", "moon"]).bad(1, &["scene", "moon", "there are"]);
    veduta(&dir, &["cost", "--preset", "ultra"]).bad(1, &["preset", "ultra"]);
    veduta(&dir, &["cost", "--view", "V99"]).bad(1, &["V99"]);
    veduta(&dir, &["cost", "--set", "CLOUD_STEP=1"]).bad(1, &["CLOUD_STEPS"]);
    veduta(&dir, &["cost", "--set", "CLOUDS=maybe"]).bad(1, &["CLOUDS", "maybe"]);
    veduta(&dir, &["cost", "--size", "0x9"]).bad(1, &["--size", "0x9"]);
    veduta(&dir, &["cost", "--size", "9"]).bad(2, &["--size"]);
    veduta(&dir, &["cost", "--rounds", "0"]).bad(2, &["--rounds"]);
    veduta(&dir, &["cost", "--out", "cost.txt"]).bad(1, &["--out", "cost.txt", "md"]);
    veduta(&dir, &["cost", "--json", "no/cost.json"]).bad(1, &["no"]);
    veduta(&dir, &["cost", "--fresh-round", "0", "--view", "V99"]).bad(1, &["V99"]);
}
