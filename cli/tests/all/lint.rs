//! `veduta lint`.

use std::path::Path;

use crate::common::{copy_fixture, folder, veduta};

#[test]
fn a_good_project_has_no_fault() {
    let dir = folder("lint_good");
    copy_fixture("user_project/good", &dir);
    let run = veduta(&dir, &["lint", "shaders", "presets"]).good();
    assert_eq!(run.out, "");
    // Six files; one flag makes two variants.
    assert!(run.err.contains("6 files and"), "{}", run.err);
    let json = veduta(&dir, &["lint", "--json", "."]).good().json();
    assert_eq!(json, serde_json::json!([]));
}

#[test]
fn every_fault_has_its_place() {
    let dir = folder("lint_faulty");
    copy_fixture("user_project/faulty", &dir);
    let run = veduta(&dir, &["lint", "--json", "shaders", "presets"]).bad(1, &["faults found"]);
    let faults = run.json();
    let faults = faults.as_array().unwrap();
    for fault in faults {
        for field in ["file", "message", "source"] {
            assert!(fault[field].is_string(), "{fault}");
        }
        assert!(fault["line"].is_u64() && fault["column"].is_u64() && fault["notes"].is_array());
    }
    // File, text at the place, a word of the message.
    for (file, at, word) in [
        ("presets/coarse.ron", "30", "30"),
        ("presets/coarse.ron", "\"OCTAVE\"", "`OCTAVE`"),
        ("presets/views/hut.ron", "200.0", "pitch_deg"),
        ("shaders/hills.wgsl", "fbm_2}", "fbm_2"),
        ("shaders/map.sp", "TERRACE", "TERRACE"),
    ] {
        let found = faults
            .iter()
            .find(|f| f["file"] == file && f["message"].as_str().unwrap().contains(word));
        let fault = found.unwrap_or_else(|| panic!("no fault of {word} in {faults:#?}"));
        let text = std::fs::read_to_string(dir.join(file)).unwrap();
        let line = text
            .lines()
            .nth(fault["line"].as_u64().unwrap() as usize - 1)
            .unwrap();
        assert_eq!(fault["source"], line);
        let rest: String = line
            .chars()
            .skip(fault["column"].as_u64().unwrap() as usize - 1)
            .collect();
        assert!(rest.starts_with(at), "{fault} points at {rest}");
    }
    let text = veduta(&dir, &["lint", "shaders", "presets"]).bad(1, &["faults found"]);
    assert!(text.out.contains("shaders/hills.wgsl:4:"), "{}", text.out);
    assert!(
        text.out.contains("#import veduta::fractal::fbm::{fbm_2}\n"),
        "{}",
        text.out
    );
}

#[test]
fn variants_are_composed() {
    let dir = folder("lint_variant");
    copy_fixture("user_project/good", &dir);
    // Broken only when the flag is on.
    let path = dir.join("shaders/map.sp");
    let text = std::fs::read_to_string(&path).unwrap();
    let broken = text.replace(
        "height = floor(8.0 * height) / 8.0;",
        "height = flor(8.0 * height) / 8.0;",
    );
    assert_ne!(text, broken);
    std::fs::write(&path, broken).unwrap();
    let run = veduta(&dir, &["lint", "shaders", "presets"]).bad(1, &["1 fault found"]);
    assert!(
        run.out.contains("shaders/map.sp:21:") && run.out.contains("flor"),
        "{}",
        run.out
    );
    assert!(run.out.contains("TERRACES"), "{}", run.out);
}

#[test]
fn the_sizes_of_presets_are_composed() {
    let dir = folder("lint_sizes");
    for (file, text) in [
        (
            "keys.ron",
            r#"[(name: "TILE", type: "size", kind: "quality", domain: (1, 256), default: 8, unit: "1", meaning: "Tile."),
                (name: "WIDE", type: "flag", kind: "quality", default: false, unit: "1", meaning: "Wide.")]"#,
        ),
        (
            "broken.sp",
            "#PROGRAM{ broken }#\n#COMPUTE{ #CODE{\n@group(0) @binding(0) var<storage, read_write> values: array<u32>;\n@compute @workgroup_size(#{TILE})\nfn run(@builtin(global_invocation_id) id: vec3<u32>) {\n#ifdef WIDE\n    values[id.x] = 2u;\n#endif\n#if TILE == 16\n    values[id.x] = nought;\n#endif\n#if TILE == 4\n    values[id.x] = never;\n#endif\n    values[0] = 1u;\n}\n}# }#\n",
        ),
        ("small.ron", r#"(reason: "x", values: {"TILE": 8})"#),
        ("large.ron", r#"(reason: "x", values: {"TILE": 16})"#),
        (
            "larger.ron",
            r#"(reason: "x", values: {"TILE": 16, "WIDE": true})"#,
        ),
    ] {
        std::fs::write(dir.join(file), text).unwrap();
    }
    let run = veduta(&dir, &["lint", "--no-shipped", "."]).bad(1, &["1 fault found"]);
    for part in ["broken.sp:10:20: ", "nought", "with TILE = 16"] {
        assert!(run.out.contains(part), "no {part} in {}", run.out);
    }
    std::fs::remove_file(dir.join("large.ron")).unwrap();
    std::fs::remove_file(dir.join("larger.ron")).unwrap();
    let run = veduta(&dir, &["lint", "--no-shipped", "."]).good();
    // Two sets of features with the one size.
    assert!(run.err.contains("and 2 variants"), "{}", run.err);
}

#[test]
fn what_ships_has_no_fault() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let run = veduta(
        &root,
        &["lint", "--no-shipped", "--headers", "wgsl", "presets"],
    )
    .good();
    assert_eq!(run.out, "");
}

#[test]
fn paths_and_files_of_others() {
    let dir = folder("lint_paths");
    veduta(&dir, &["lint", "nowhere"]).bad(1, &["path `nowhere` does not exist"]);
    std::fs::write(dir.join("notes.txt"), "").unwrap();
    veduta(&dir, &["lint", "notes.txt"]).bad(1, &["notes.txt", ".wgsl, .sp or .ron"]);
    std::fs::write(dir.join("window.ron"), "(width: 3)").unwrap();
    veduta(&dir, &["lint", "."]).good();
    let run = veduta(&dir, &["lint", "window.ron"]).bad(1, &["1 fault"]);
    assert!(run.out.contains("window.ron: is neither"), "{}", run.out);
    std::fs::write(dir.join("latin.wgsl"), b"// caf\xe9\n").unwrap();
    let run = veduta(&dir, &["lint", "."]).bad(1, &["1 fault"]);
    assert!(
        run.out.contains("latin.wgsl: is not UTF-8 after byte 6"),
        "{}",
        run.out
    );
}

#[test]
fn broken_keys_and_clashes_are_told() {
    let dir = folder("lint_keys");
    copy_fixture("user_project/good", &dir);
    std::fs::copy(
        dir.join("presets/scenes/dusk.ron"),
        dir.join("presets/scenes/thesis.ron"),
    )
    .unwrap();
    let run = veduta(&dir, &["lint", "."]).bad(1, &["fault"]);
    assert!(run.out.contains("a second scene `thesis`"), "{}", run.out);
    let keys = dir.join("presets/keys.ron");
    let text = std::fs::read_to_string(&keys)
        .unwrap()
        .replace("TERRACES", "CLOUDS");
    std::fs::write(&keys, text).unwrap();
    let run = veduta(&dir, &["lint", "."]).bad(1, &["fault"]);
    assert!(
        run.out
            .contains("presets/keys.ron:2:12: key `CLOUDS` is declared twice"),
        "{}",
        run.out
    );
}

#[test]
fn half_precision_must_be_claimed() {
    let dir = folder("lint_claim");
    let text = "enable f16;\n#define_import_path own::half\n\nfn halve(x: f32) -> f32 { return f32(f16(x) * 0.5h); }\n";
    std::fs::write(dir.join("half.wgsl"), text).unwrap();
    let run = veduta(&dir, &["lint", "half.wgsl"]).bad(1, &["1 fault"]);
    let message = "half.wgsl:1:8: `enable f16` needs the capability `f16`, which is not claimed";
    assert!(run.out.contains(message), "{}", run.out);
    veduta(&dir, &["lint", "--claim", "f16", "half.wgsl"]).good();
    veduta(&dir, &["lint", "--claim", "f61", "half.wgsl"]).bad(2, &["f61"]);
    std::fs::write(
        dir.join("own.sp"),
        "#PROGRAM{ own }#\n#COMPUTE{ #CODE{\nenable f16;\n#import own::half::halve\n@group(0) @binding(0) var<storage, read_write> values: array<f32>;\n@compute @workgroup_size(64)\nfn run(@builtin(global_invocation_id) id: vec3<u32>) { values[id.x] = halve(values[id.x]); }\n}# }#\n",
    )
    .unwrap();
    let compose = ["compose", "own.sp", "--modules", ".", "--target", "wgsl"];
    veduta(&dir, &compose).bad(1, &["`f16`", "not claimed"]);
    let run = veduta(&dir, &[&compose[..], &["--claim", "f16"]].concat()).good();
    assert!(run.out.contains("enable f16;"), "{}", run.out);
}
