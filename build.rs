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
    veduta_compose::Build::of_veduta("wgsl", "presets").write();
}
