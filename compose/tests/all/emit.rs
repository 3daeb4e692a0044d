//! What a build writes: variants, tables, blocks; the same bytes every time.

use std::path::{Path, PathBuf};
use std::process::Command;

use veduta_compose::Build;
use veduta_compose::build::Output;
use veduta_compose::reflect::{BindingType, SampleType, StageKind, ViewDimension};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(path)
}

fn build() -> Output {
    Build::of_veduta(fixture("project/shaders"), fixture("project/presets"))
        .run()
        .unwrap_or_else(|diags| panic!("{diags}"))
}

#[test]
fn variants_are_the_closure_of_scenes_and_presets() {
    let output = build();
    let variants: Vec<(&str, Vec<&str>)> = output
        .programs
        .iter()
        .map(|p| {
            (
                p.program.as_str(),
                p.features.iter().map(String::as_str).collect(),
            )
        })
        .collect();
    assert_eq!(
        variants,
        [
            ("count", vec![]),
            ("lake", vec![]),
            ("lake", vec!["LOW_QUALITY"]),
            ("lake", vec!["LOW_QUALITY", "WATER"]),
            ("lake", vec!["WATER"]),
        ]
    );
    assert_eq!(output.default_preset, "thesis");
    // The vertex stage is the same in all four, the fragment stage in the two without water.
    assert_eq!(output.rust.matches("static TEXT_").count(), 1 + 1 + 3);
    // What the writer would lose comes back.
    assert!(
        output.programs[1].stages[1]
            .wgsl
            .starts_with("diagnostic(off, derivative_uniformity);\n\n")
    );
    assert!(!output.rust.contains("fn still"));
    // Units in brackets are no links for rustdoc.
    assert!(
        output
            .rust
            .contains("/// Where the eye is \\[m\\]. (`vec3<f32>`)")
    );
}

#[test]
fn reflection_is_complete() {
    let output = build();
    let lake = &output.programs[4];
    let bindings: Vec<_> = lake
        .bindings
        .iter()
        .map(|b| (b.group, b.binding, b.name.as_str(), b.ty, b.visibility))
        .collect();
    let of = veduta_compose::reflect::Visibility::of;
    let mut both = of(StageKind::Vertex);
    both.add(StageKind::Fragment);
    let fragment = of(StageKind::Fragment);
    assert_eq!(
        bindings,
        [
            (0, 0, "view", BindingType::Uniform { min_size: 192 }, both),
            (
                1,
                0,
                "content",
                BindingType::Uniform { min_size: 32 },
                fragment
            ),
            (
                1,
                1,
                "waves",
                BindingType::Storage {
                    read_only: true,
                    min_size: 40
                },
                fragment
            ),
            (
                1,
                2,
                "bed",
                BindingType::Texture {
                    sample: SampleType::Float { filterable: true },
                    dim: ViewDimension::D2,
                    multisampled: false
                },
                fragment
            ),
            (
                1,
                3,
                "smooth_sampler",
                BindingType::Sampler {
                    comparison: false,
                    filtering: true
                },
                fragment
            ),
        ]
    );
    assert_eq!(lake.overrides.len(), 1);
    assert_eq!(lake.overrides[0].key.as_deref(), Some("STEPS"));
    assert_eq!(lake.overrides[0].default, Some(16.0));
    let names: Vec<&str> = lake.structs.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["Content", "View", "Wave", "Waves"]);
    let view = &lake.structs[1];
    let members: Vec<(&str, u32, String)> = view
        .members
        .iter()
        .map(|m| (m.name.as_str(), m.offset, m.ty.wgsl()))
        .collect();
    assert_eq!(
        members,
        [
            ("eye", 0, "vec3<f32>".into()),
            ("time", 12, "f32".into()),
            ("matrix", 16, "mat4x4<f32>".into()),
            ("normal_matrix", 80, "mat3x3<f32>".into()),
            ("points", 128, "array<vec3<f32>, 3>".into()),
            ("jitter", 176, "vec2<f32>".into()),
        ]
    );
    assert_eq!(view.members[0].doc, "Where the eye is [m].");
    let count = &output.programs[0];
    assert_eq!(count.stages[0].entry_points[0].workgroup_size, [8, 8, 1]);
    assert_eq!(count.stages[0].entry_points[1].name, "clear");
    assert_eq!(count.bindings.len(), 5);
}

#[test]
fn the_same_bytes_every_time() {
    let first = build().rust;
    assert_eq!(first, build().rust);
    // The order in which folders are named does not matter either.
    let project = fixture("project");
    let other = Build::of_veduta(project.join("shaders"), project.join("presets"))
        .modules(project.join("shaders/waves.wgsl"))
        .run();
    // The same file twice is no clash.
    assert_eq!(first, other.unwrap_or_else(|diags| panic!("{diags}")).rust);
}

/// The emitted file compiles, its assertions hold, and the blocks' bytes lie where the device reads them.
#[test]
fn the_emitted_rust_compiles_and_is_right() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let rust = build().rust;
    std::fs::write(folder.join("emitted.rs"), rust).unwrap();
    let main = folder.join("emitted_main.rs");
    std::fs::copy(fixture("emit/main.rs"), &main).unwrap();
    let binary = folder.join("emitted_main");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let compiled = Command::new(rustc)
        .args(["--edition", "2024", "-D", "warnings", "-o"])
        .arg(&binary)
        .arg(&main)
        .output()
        .unwrap();
    assert!(
        compiled.status.success(),
        "{}",
        String::from_utf8_lossy(&compiled.stderr)
    );
    let run = Command::new(&binary).output().unwrap();
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
}

#[test]
fn a_users_build_chooses_presets_and_programs() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own_preset.ron");
    std::fs::write(
        &out,
        "(based_on: \"thesis_low\", reason: \"Mine.\", values: { \"STEPS\": (value: 4, why: \"Slow device.\") })",
    )
    .unwrap();
    // What Cargo tells the build script of a dependent; no other test reads these variables.
    // (Set by the child process, as tests run in threads.)
    let child = Command::new(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "emit::child_of_a_users_build",
            "--ignored",
            "--nocapture",
        ])
        .env("DEP_VEDUTA_WGSL", fixture("project/shaders"))
        .env("DEP_VEDUTA_PRESETS", fixture("project/presets"))
        .env("OWN_PRESET", &out)
        .env("OUT_DIR", env!("CARGO_TARGET_TMPDIR"))
        .output()
        .unwrap();
    let stdout = String::from_utf8_lossy(&child.stdout);
    assert!(child.status.success(), "{stdout}");
    assert!(stdout.contains("1 passed"), "{stdout}");
    for line in [
        "cargo::rerun-if-changed=",
        "shaders/lake.sp",
        "shaders/waves.wgsl",
        "presets/keys.ron",
        "presets/scenes",
        "own_preset.ron",
    ] {
        assert!(stdout.contains(line), "{line} is missing in\n{stdout}");
    }
    let written =
        std::fs::read_to_string(Path::new(env!("CARGO_TARGET_TMPDIR")).join("veduta_programs.rs"))
            .unwrap();
    assert!(written.contains("::veduta::program::ProgramSet"));
    assert!(written.contains("default_preset: ::std::borrow::Cow::Borrowed(\"own_preset\")"));
}

#[test]
#[ignore = "runs as a child of a_users_build_chooses_presets_and_programs"]
fn child_of_a_users_build() {
    let Ok(preset) = std::env::var("OWN_PRESET") else {
        return;
    };
    let output = Build::new().preset(preset).try_write().unwrap();
    assert_eq!(output.presets, ["own_preset"]);
    let features: Vec<_> = output
        .programs
        .iter()
        .map(|p| p.features.join(" "))
        .collect();
    assert_eq!(features, ["", "LOW_QUALITY", "LOW_QUALITY WATER"]);
    let error = Build::new()
        .preset("thesis_lo")
        .run()
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "build.rs: there is no preset `thesis_lo`\nnote: did you mean `thesis_low`?"
    );
    // Keys beside the shaders count, and a user's override need not be a key.
    let own = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own_shaders");
    std::fs::create_dir_all(&own).unwrap();
    std::fs::copy(fixture("project/own_keys.ron"), own.join("keys.ron")).unwrap();
    std::fs::copy(fixture("project/own.sp"), own.join("own.sp")).unwrap();
    let build = Build::new().programs(&own).variant("own", ["RIPPLES"]);
    let output = build.run().unwrap_or_else(|diags| panic!("{diags}"));
    assert!(output.rust.contains("\"RIPPLES\""));
    assert_eq!(output.default_preset, "thesis");
    let features: Vec<_> = output
        .programs
        .iter()
        .map(|p| (p.program.as_str(), p.features.join(" ")))
        .collect();
    assert_eq!(features, [("own", "".into()), ("own", "RIPPLES".into())]);
    assert_eq!(output.programs[1].overrides[0].name, "FREQUENCY");
    let error = build
        .clone()
        .variant("owm", [])
        .run()
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "build.rs: there is no program `owm`\nnote: did you mean `own`?"
    );
    let error = build.claim("f61").run().unwrap_err().to_string();
    assert_eq!(
        error,
        "build.rs: there is no capability `f61` to claim\nnote: known are `f16` and `subgroups`"
    );
}
