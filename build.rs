//! Composes the shipped programs for every shipped scene and preset, and tells dependents where modules and presets are.

use std::path::Path;

fn main() {
    let root = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let folder = |name: &str| Path::new(&root).join(name).display().to_string();
    println!("cargo::metadata=WGSL={}", folder("wgsl"));
    println!("cargo::metadata=PRESETS={}", folder("presets"));
    let low = std::env::var_os("CARGO_FEATURE_LOW_QUALITY").is_some();
    let default = if low { "thesis_low" } else { "thesis" };
    println!("cargo::metadata=DEFAULT_PRESET={default}");
    let mut build = veduta_compose::Build::of_veduta("wgsl", "presets")
        .variant("sky", ["AERIAL"])
        .variant("sky", ["SUN_DISC"])
        .variant("sky", ["AERIAL", "AERIAL_TARGETS"]);
    for program in [
        "air_columns",
        "air_diffuse",
        "sky_view",
        "sky_aerial",
        "sky_probe",
        "sky_query",
        "probe",
    ] {
        build = build.variant(program, ["AIR_EIGHT_LANES"]);
    }
    for more in [
        &["AERIAL"][..],
        &["SUN_DISC"],
        &["AERIAL", "AERIAL_TARGETS"],
        &[],
    ] {
        build = build.variant("sky", more.iter().copied().chain(["AIR_EIGHT_LANES"]));
    }
    build.write();
}
