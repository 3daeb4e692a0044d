//! A second and a third opinion on every shipped variant: Tint on the WGSL, `spirv-val` on the SPIR-V.
//!
//! `cargo xtask test` brings both tools. Without them the tests fail, unless VEDUTA_NO_TINT or VEDUTA_NO_SPIRV_VAL says
//! that they cannot be had.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use veduta::program::ComposedProgram;
use veduta::wgpu::naga;

/// A folder of this test, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether a validator cannot be had here; says so aloud.
fn left_out(variable: &str, tool: &str) -> bool {
    let out = std::env::var_os(variable).is_some_and(|v| v == "1");
    if out {
        println!("SKIPPED {tool}: {variable}=1");
    }
    out
}

fn shown(output: &Output) -> String {
    format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// Each shipped text under a file name that says what it is.
fn texts() -> Vec<(String, &'static str, &'static ComposedProgram)> {
    let programs = veduta::programs();
    let mut texts = Vec::new();
    for (i, program) in programs.programs.iter().enumerate() {
        for stage in program.stages.iter() {
            let name = format!("{}-{i:03}-{:?}", program.program, stage.stage).to_lowercase();
            texts.push((name, stage.wgsl.as_ref(), program));
        }
    }
    assert!(texts.len() >= 2, "the build composed nothing");
    texts
}

fn tint(paths: &[&Path]) -> Output {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/tint/check.mjs");
    Command::new("node")
        .arg(script)
        .args(paths)
        .output()
        .expect("`node` runs; `cargo xtask test` installs it, and VEDUTA_NO_TINT=1 leaves it out")
}

#[test]
fn tint_accepts_every_shipped_variant() {
    if left_out("VEDUTA_NO_TINT", "Tint") {
        return;
    }
    let folder = folder("tint");
    let texts = texts();
    for (name, wgsl, program) in &texts {
        let head = format!("// features: {}\n", program.features.join(", "));
        // Directives have to stand first, and a comment may stand before them.
        fs::write(folder.join(format!("{name}.wgsl")), head + wgsl).unwrap();
    }
    let output = tint(&[&folder]);
    let said = shown(&output);
    assert!(output.status.success(), "{said}");
    let count = format!("tint: {} files, 0 errors", texts.len());
    assert!(said.lines().any(|l| l == count), "{said}");
}

#[test]
fn tint_rejects_what_naga_accepts() {
    if left_out("VEDUTA_NO_TINT", "Tint") {
        return;
    }
    let wgsl = "@fragment
fn main(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
    if p.x > 3.0 {
        return vec4<f32>(dpdx(p.y));
    }
    return vec4<f32>(1.0);
}
";
    // The rest of the message would change with naga; here it only matters that there is none.
    spirv(wgsl).expect("naga accepts a derivative after a branch that is not uniform");
    let file = folder("tint-control").join("control.wgsl");
    fs::write(&file, wgsl).unwrap();
    let output = tint(&[&file]);
    let said = shown(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("control.wgsl:4:26: error:"), "{said}");
    assert!(said.contains("uniform control flow"), "{said}");
}

#[test]
fn tint_that_cannot_run_is_not_a_pass() {
    if left_out("VEDUTA_NO_TINT", "Tint") {
        return;
    }
    let empty = folder("tint-empty");
    let output = tint(&[&empty]);
    assert_eq!(output.status.code(), Some(2), "{}", shown(&output));
    let output = tint(&[&empty.join("gone.wgsl")]);
    assert_eq!(output.status.code(), Some(2), "{}", shown(&output));
}

/// SPIR-V 1.3 of each entry point of a text, with the defaults of its overrides, by entry point.
fn spirv(wgsl: &str) -> Result<BTreeMap<String, Vec<u32>>, String> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    let info = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default(),
    )
    .validate(&module)
    .map_err(|e| e.emit_to_string(wgsl))?;
    let options = naga::back::spv::Options {
        lang_version: (1, 3),
        ..Default::default()
    };
    let mut words = BTreeMap::new();
    for entry in &module.entry_points {
        let chosen = Some((entry.stage, entry.name.as_str()));
        let (module, info) = naga::back::pipeline_constants::process_overrides(
            &module,
            &info,
            chosen,
            &Default::default(),
        )
        .map_err(|e| format!("{}: {e}", entry.name))?;
        let pipeline = naga::back::spv::PipelineOptions {
            shader_stage: entry.stage,
            entry_point: entry.name.clone(),
        };
        let written = naga::back::spv::write_vec(&module, &info, &options, Some(&pipeline))
            .map_err(|e| format!("{}: {e}", entry.name))?;
        words.insert(entry.name.clone(), written);
    }
    Ok(words)
}

fn spirv_val(file: &Path, words: &[u32]) -> Output {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    fs::write(file, bytes).unwrap();
    Command::new("spirv-val")
        .args(["--target-env", "vulkan1.1"])
        .arg(file)
        .output()
        .expect("`spirv-val` runs; `cargo xtask test` installs it, and VEDUTA_NO_SPIRV_VAL=1 leaves it out")
}

#[test]
fn spirv_val_accepts_every_shipped_variant() {
    if left_out("VEDUTA_NO_SPIRV_VAL", "spirv-val") {
        return;
    }
    let folder = folder("spirv");
    let mut modules = 0;
    for (name, wgsl, program) in texts() {
        let entries = spirv(wgsl).unwrap_or_else(|e| panic!("{name} {:?}: {e}", program.features));
        assert!(!entries.is_empty(), "{name} has no entry point");
        for (entry, words) in entries {
            let output = spirv_val(&folder.join(format!("{name}-{entry}.spv")), &words);
            assert!(
                output.status.success(),
                "{name} {:?}: {entry}: {}",
                program.features,
                shown(&output)
            );
            modules += 1;
        }
    }
    println!("{modules} SPIR-V modules");
}

#[test]
fn spirv_val_rejects_a_corrupted_word() {
    if left_out("VEDUTA_NO_SPIRV_VAL", "spirv-val") {
        return;
    }
    let folder = folder("spirv-control");
    let (name, wgsl, _) = texts().swap_remove(0);
    let (_, mut words) = spirv(wgsl).unwrap().pop_first().unwrap();
    let file = folder.join("control.spv");
    let output = spirv_val(&file, &words);
    assert!(output.status.success(), "{name}: {}", shown(&output));
    // The type of the last function's `OpFunction` names an id beyond the bound.
    const OP_FUNCTION: u32 = 54 | (5 << 16);
    let at = words.iter().rposition(|w| *w == OP_FUNCTION).unwrap();
    words[at + 1] = words[3] + 1;
    let output = spirv_val(&file, &words);
    assert!(
        !output.status.success(),
        "{name}: the corrupted word went unnoticed"
    );
    assert!(shown(&output).contains("error"), "{}", shown(&output));
}
