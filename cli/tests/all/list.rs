//! `veduta list`.

use crate::common::{copy_fixture, folder, veduta};

#[test]
fn everything_is_listed() {
    let dir = folder("list");
    let text = veduta(&dir, &["list"]).good().out;
    for part in [
        "programs:",
        "landscape",
        "presets:",
        "thesis_low",
        "scenes:",
        "clear",
        "views:",
        "V12",
        "keys:",
        "CLOUD_COVERAGE",
        "adapters:",
    ] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    let views = veduta(&dir, &["list", "views", "--json"]).good().json();
    let names: Vec<&str> = views["views"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["name"].as_str().unwrap())
        .collect();
    let wanted: Vec<String> = (1..=12).map(|i| format!("V{i:02}")).collect();
    assert_eq!(names, wanted);
    let v12 = &views["views"][11];
    assert_eq!(
        (v12["eye_height"].as_f64(), v12["fov_deg"].as_f64()),
        (Some(1500.0), Some(10.0))
    );
}

#[test]
fn json_has_one_list_a_subject() {
    let dir = folder("list_json");
    let all = veduta(&dir, &["list", "--json"]).good().json();
    for subject in ["programs", "presets", "scenes", "views", "keys", "adapters"] {
        let entries = all[subject].as_array().unwrap();
        assert!(!entries.is_empty(), "{subject}");
        for entry in entries {
            assert!(
                entry["name"].is_string() && entry["description"].is_string(),
                "{entry}"
            );
        }
    }
    let programs = all["programs"].as_array().unwrap();
    let landscape = programs
        .iter()
        .find(|program| program["name"] == "landscape")
        .unwrap();
    assert!(landscape["variants"].as_array().unwrap().len() > 1);
}

#[test]
fn the_default_preset_is_marked() {
    let dir = folder("list_default");
    let all = veduta(&dir, &["list", "presets", "--json"]).good().json();
    let defaults: Vec<&str> = all["presets"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| p["default"] == true)
        .map(|p| p["name"].as_str().unwrap())
        .collect();
    let wanted = if cfg!(feature = "low_quality") {
        "thesis_low"
    } else {
        "thesis"
    };
    assert_eq!(defaults, [wanted]);
}

#[test]
fn own_folders_are_listed() {
    let dir = folder("list_own");
    copy_fixture("user_project/good", &dir);
    let own = [
        "list",
        "--json",
        "--modules",
        "shaders",
        "--presets",
        "presets",
    ];
    let all = veduta(&dir, &own).good().json();
    let has = |subject: &str, name: &str| {
        all[subject]
            .as_array()
            .unwrap()
            .iter()
            .any(|e| e["name"] == name)
    };
    assert!(has("programs", "map") && has("programs", "landscape"));
    assert!(has("presets", "coarse") && has("scenes", "dusk") && has("views", "hut"));
    assert!(has("keys", "TERRACES"));
    veduta(&dir, &["list", "--presets", "nowhere"]).bad(1, &["folder `nowhere` does not exist"]);
    let none = veduta(&dir, &["list", "scenes", "--json", "--no-shipped"])
        .good()
        .json();
    assert_eq!(none["scenes"].as_array().unwrap().len(), 0);
}
