//! `veduta compose`.

use crate::common::{copy_fixture, folder, veduta};

#[test]
fn shipped_programs_are_written_for_every_target() {
    let dir = folder("compose_targets");
    for (target, ending, mark) in [
        ("wgsl", "wgsl", "@fragment"),
        ("hlsl", "hlsl", "SV_Target"),
        ("msl", "metal", "#include <metal_stdlib>"),
    ] {
        let out = veduta(
            &dir,
            &[
                "compose",
                "landscape",
                "--preset",
                "low",
                "--target",
                target,
                "--out",
                "out",
            ],
        )
        .good()
        .out;
        for stage in ["vertex", "fragment"] {
            assert!(
                out.contains(&format!("landscape.{stage}.{ending}")),
                "{out}"
            );
        }
        let text =
            std::fs::read_to_string(dir.join(format!("out/landscape.fragment.{ending}"))).unwrap();
        assert!(text.contains(mark), "{target}");
    }
    veduta(
        &dir,
        &["compose", "landscape", "--target", "spirv", "--out", "out"],
    )
    .good();
    let bytes = std::fs::read(dir.join("out/landscape.vertex.spv")).unwrap();
    assert_eq!(&bytes[..4], &0x0723_0203_u32.to_le_bytes());
    assert_eq!(bytes.len() % 4, 0);
}

#[test]
fn presets_scenes_and_values_decide_the_text() {
    let dir = folder("compose_variants");
    let wgsl = |args: &[&str]| {
        let mut all = vec!["compose", "landscape", "--stage", "fragment"];
        all.extend(args);
        veduta(&dir, &all).good().out
    };
    let thesis = wgsl(&["--preset", "thesis"]);
    assert!(thesis.starts_with("// landscape.fragment.wgsl\n"));
    assert!(!thesis.contains("#ifdef") && !thesis.contains("#import"));
    assert!(
        thesis.contains("override CLOUD_STEPS: i32 = i32(64);"),
        "{thesis}"
    );
    assert_eq!(thesis, wgsl(&["--preset", "thesis"]), "not the same twice");
    assert!(wgsl(&["--preset", "low"]).contains("override CLOUD_STEPS: i32 = i32(32);"));
    assert!(!wgsl(&["--preset", "thesis_low"]).contains("CLOUD_STEPS"));
    assert!(!wgsl(&["--preset", "thesis", "--scene", "clear"]).contains("CLOUD_STEPS"));
    let set = wgsl(&[
        "--preset",
        "thesis",
        "--set",
        "CLOUD_STEPS=7",
        "--set",
        "STEP_FACTOR=0.25",
    ]);
    assert!(set.contains("override CLOUD_STEPS: i32 = i32(7);"));
    assert!(set.contains("override STEP_FACTOR: f32 = f32(0.25);"));
}

#[test]
fn own_programs_are_composed() {
    let dir = folder("compose_own");
    copy_fixture("user_project/good", &dir);
    let own = |args: &[&str]| {
        let mut all = vec![
            "compose",
            "shaders/map.sp",
            "--modules",
            "shaders",
            "--presets",
            "presets",
        ];
        all.extend(args);
        veduta(&dir, &all)
    };
    let plain = own(&[]).good().out;
    assert!(plain.starts_with("// map.compute.wgsl\n") && plain.contains("@compute"));
    assert!(!plain.contains("floor((8"));
    let steps = own(&["--set", "TERRACES=true", "--preset", "coarse"])
        .good()
        .out;
    assert!(
        steps.contains("override MAP_OCTAVES: i32 = i32(3);"),
        "{steps}"
    );
    assert_ne!(plain.len(), steps.len());
    own(&["--out", "map.wgsl"]).good();
    assert_eq!(
        plain.strip_prefix("// map.compute.wgsl\n").unwrap(),
        std::fs::read_to_string(dir.join("map.wgsl")).unwrap()
    );
    own(&["--stage", "vertex"]).bad(1, &["--stage", "vertex", "compute"]);
}

#[test]
fn faults_are_told() {
    let dir = folder("compose_faults");
    copy_fixture("user_project/faulty", &dir);
    let run = |args: &[&str]| veduta(&dir, &[&["compose"], args].concat());
    run(&["landscap"]).bad(
        1,
        &[
            "program `landscap` does not exist",
            "did you mean `landscape`",
        ],
    );
    run(&["nowhere.sp"]).bad(1, &["nowhere.sp", "cannot be read"]);
    run(&["landscape", "--preset", "lw"]).bad(1, &["preset `lw`", "`low`"]);
    run(&["landscape", "--scene", "cleer"]).bad(1, &["scene `cleer`", "`clear`"]);
    run(&["landscape", "--set", "OCTAVES"]).bad(1, &["KEY=VALUE"]);
    run(&["landscape", "--set", "OCTAVS=3"]).bad(1, &["OCTAVS", "OCTAVES"]);
    run(&["landscape", "--set", "OCTAVES=99"]).bad(1, &["OCTAVES", "99", "16"]);
    run(&["landscape", "--target", "spirv"]).bad(1, &["--out", "binary"]);
    run(&["landscape", "--out", "one.wgsl"]).bad(1, &["one.wgsl", "--stage"]);
    // The fixture's program tests a flag that nobody declares.
    run(&["shaders/map.sp", "--modules", "shaders", "--no-shipped"]).bad(1, &["map.sp:"]);
}
