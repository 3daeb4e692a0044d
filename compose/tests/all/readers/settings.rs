//! Keys, presets, scenes, views and their precedence, and every fault with its message.

use super::blocks;
use std::collections::{BTreeMap, BTreeSet};

use veduta_compose::diag::Diags;
use veduta_compose::keys::{KeyKind, KeyType, Keys, Value};
use veduta_compose::ron_place;
use veduta_compose::settings::{
    Origin, Preset, Presets, Scene, Settings, View, resolve, split_set,
};

const KEYS: &str = include_str!("../../fixtures/settings/keys.ron");
const BASE: &str = include_str!("../../fixtures/settings/base.ron");
const LOW: &str = include_str!("../../fixtures/settings/low.ron");
const LOWEST: &str = include_str!("../../fixtures/settings/lowest.ron");
const SCENE: &str = include_str!("../../fixtures/settings/scene.ron");
const VIEW: &str = include_str!("../../fixtures/settings/view.ron");

fn keys() -> Keys {
    Keys::load(&[("keys.ron", KEYS)]).unwrap_or_else(|e| panic!("{e}"))
}

fn presets() -> Presets {
    let files = [
        ("lowest", "lowest.ron", LOWEST),
        ("base", "base.ron", BASE),
        ("low", "low.ron", LOW),
    ];
    Presets::load(&keys(), &files).unwrap_or_else(|e| panic!("{e}"))
}

fn sets(texts: &[&str]) -> Vec<(String, String)> {
    texts.iter().map(|text| split_set(text).unwrap()).collect()
}

fn refused<T>(result: Result<T, Diags>) -> String {
    match result {
        Ok(_) => panic!("accepted"),
        Err(faults) => faults.to_string(),
    }
}

/// The faults of key declarations.
fn key_fault(text: &str) -> String {
    refused(Keys::load(&[("k.ron", text)]))
}

/// The faults of a preset with the given values.
fn value_fault(values: &str) -> String {
    let text = format!("(reason: \"r\",\nvalues: {{{values}}})");
    refused(Preset::parse(&keys(), "p", "p.ron", &text))
}

fn scene_fault(text: &str) -> String {
    refused(Scene::parse(&keys(), "s", "s.ron", text))
}

#[test]
fn declarations_are_read() {
    let keys = keys();
    let names: Vec<&str> = keys.names().collect();
    assert_eq!(
        names,
        [
            "CLOUD_STEPS",
            "SEED",
            "SNOW",
            "STEP_FACTOR",
            "SUN_COLOR",
            "SUN_HEIGHT",
            "TILE",
            "WATER"
        ]
    );
    let key = keys.get("SUN_COLOR").unwrap();
    assert_eq!((key.ty, key.kind), (KeyType::Vec3, KeyKind::Content));
    assert_eq!(key.domain, Some((0.0, 10.0)));
    assert_eq!(key.default, Value::Vec3([1.0, 0.9, 0.75]));
    assert_eq!(key.member(), "sun_color");
    let height = keys.get("SUN_HEIGHT").unwrap();
    assert_eq!(height.meaning, "The \"sun\".");
    assert_eq!(height.default, Value::Float(30.0));
    assert_eq!(
        (height.file.as_str(), height.unit.as_str()),
        ("keys.ron", "deg")
    );
    assert_eq!((height.place.line, height.place.column), (10, 12));
    assert_eq!(keys.get("SNOW").unwrap().domain, None);
    assert_eq!(keys.get("SEED").unwrap().domain, Some((0.0, 4294967295.0)));
}

#[test]
fn a_users_declarations_add_to_ours() {
    let mine = r#"[(name: "MOSS", type: "flag", kind: "quality", default: true, unit: "1", meaning: "m")]"#;
    let both = Keys::load(&[("keys.ron", KEYS), ("mine.ron", mine)]).unwrap();
    assert_eq!(both.len(), keys().len() + 1);
    let clash = mine.replace("MOSS", "SNOW");
    assert_eq!(
        refused(Keys::load(&[("keys.ron", KEYS), ("mine.ron", &clash)])),
        format!(
            "mine.ron:1:9: key `SNOW` is declared twice\n{clash}\n        ^\nnote: the first is at keys.ron:3:12"
        )
    );
}

#[test]
fn check_names_value_and_domain() {
    let keys = keys();
    assert_eq!(keys.check("CLOUD_STEPS", &Value::Int(4096)), Ok(()));
    for (name, value, message) in [
        (
            "CLOUD_STEPS",
            Value::Int(4097),
            "`CLOUD_STEPS` is 4097: out of its domain [1, 4096]",
        ),
        (
            "CLOUD_STEPS",
            Value::Float(8.0),
            "`CLOUD_STEPS` is a whole number, but this is 8.0; allowed is [1, 4096]",
        ),
        (
            "STEP_FACTOR",
            Value::Float(f64::NAN),
            "`STEP_FACTOR` is NaN: not finite; allowed is [0.01, 1]",
        ),
        (
            "SUN_COLOR",
            Value::Vec3([1.0, f64::INFINITY, 1.0]),
            "`SUN_COLOR` is (1.0, inf, 1.0): not finite; allowed is [0, 10] for each component",
        ),
        (
            "SNOW",
            Value::Int(1),
            "`SNOW` is a flag (true, false, 1 or 0), but this is 1; allowed is true, false, 1 or 0",
        ),
        (
            "CLOUD_STEP",
            Value::Int(1),
            "unknown key `CLOUD_STEP`: did you mean `CLOUD_STEPS`?",
        ),
        ("PENGUIN", Value::Int(1), "unknown key `PENGUIN`"),
    ] {
        assert_eq!(keys.check(name, &value), Err(message.to_owned()));
    }
}

#[test]
fn the_precedence_is_set_scene_preset_declaration() {
    let (keys, presets) = (keys(), presets());
    let scene = Scene::parse(&keys, "scene", "scene.ron", SCENE).unwrap_or_else(|e| panic!("{e}"));
    let chain: Vec<&str> = presets
        .chain("lowest")
        .iter()
        .map(|p| p.name.as_str())
        .collect();
    assert_eq!(chain, ["lowest", "low", "base"]);
    let get =
        |settings: &Settings, name: &str| (settings.values[name], settings.origin[name].clone());

    let plain = resolve(&keys, &presets, "base", None, &[]).unwrap();
    assert_eq!(
        get(&plain, "CLOUD_STEPS"),
        (Value::Int(100), Origin::Preset("base".into()))
    );
    assert_eq!(
        get(&plain, "STEP_FACTOR"),
        (Value::Float(0.5), Origin::Declaration)
    );
    assert_eq!(
        get(&plain, "SNOW"),
        (Value::Flag(true), Origin::Preset("base".into()))
    );

    let full = resolve(
        &keys,
        &presets,
        "lowest",
        Some(&scene),
        &sets(&["SEED=9", "SUN_COLOR=(1, 2,3)", "WATER=0", " TILE = 4 "]),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    for (name, value, origin) in [
        (
            "CLOUD_STEPS",
            Value::Int(1),
            Origin::Preset("lowest".into()),
        ),
        (
            "STEP_FACTOR",
            Value::Float(1.0),
            Origin::Preset("low".into()),
        ),
        ("SNOW", Value::Flag(true), Origin::Scene),
        ("SUN_HEIGHT", Value::Float(10.0), Origin::Scene),
        ("SEED", Value::Int(9), Origin::Set),
        ("SUN_COLOR", Value::Vec3([1.0, 2.0, 3.0]), Origin::Set),
        ("WATER", Value::Flag(false), Origin::Set),
        ("TILE", Value::Int(4), Origin::Set),
    ] {
        assert_eq!(get(&full, name), (value, origin), "{name}");
    }
    assert_eq!(full.flags(), BTreeSet::from(["SNOW".to_owned()]));
    assert_eq!(full.sizes(), BTreeMap::from([("TILE".to_owned(), 4)]));
    assert_eq!(
        full.overrides(),
        [
            ("CLOUD_STEPS".to_owned(), 1.0),
            ("STEP_FACTOR".to_owned(), 1.0)
        ]
    );
    let content: Vec<String> = full.content().into_iter().map(|(name, _)| name).collect();
    assert_eq!(content, ["SEED", "SUN_COLOR", "SUN_HEIGHT"]);
    assert_eq!(full.values.len(), keys.len());
}

#[test]
fn numbers_keep_all_their_digits() {
    let text = "(reason: \"r\", values: {\"STEP_FACTOR\": 0.1234567890123456})";
    let preset = Preset::parse(&keys(), "p", "p.ron", text).unwrap();
    assert_eq!(preset.values[0].value, Value::Float(0.1234567890123456));
    assert_eq!(preset.values[0].value.to_string(), "0.1234567890123456");
}

#[test]
fn a_view_is_read() {
    let view = View::parse("v", "view.ron", VIEW).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (view.eye_height, view.pitch_deg, view.fov_deg),
        (300.0, 12.0, 60.0)
    );
    assert_eq!((view.sun_height_deg, view.sun_azimuth_deg), (-4.5, 120.0));
    assert_eq!((view.place, view.yaw_deg), ((1e6, -2.5), 0.0));
}

#[test]
fn fault_in_a_view() {
    let with = |from: &str, to: &str| {
        assert!(VIEW.contains(from));
        refused(View::parse("v", "v.ron", &VIEW.replace(from, to)))
    };
    assert_eq!(
        with("fov_deg: 60.0", "fov_deg: 171"),
        "v.ron:5:14: `fov_deg` is 171: out of its domain [1, 170]\n    fov_deg: 171,\n             ^"
    );
    assert_eq!(
        with("pitch_deg: 12", "pitch_deg: -inf"),
        "v.ron:4:16: `pitch_deg` is -inf: not finite; allowed is [-90, 90]\n    pitch_deg: -inf,\n               ^"
    );
    assert_eq!(
        with("eye_height: 300.0", "eye_height: 1e9"),
        "v.ron:3:17: `eye_height` is 1e9: out of its domain [0, 100000000]\n    eye_height: 1e9,\n                ^"
    );
    assert_eq!(
        with("fov_deg:", "fov:"),
        "v.ron:1:1: a view has no field `fov_deg`\n(\n^\n\
         v.ron:5:5: unknown field `fov` of a view\n    fov: 60.0,\n    ^\n\
         note: the fields are meaning, eye_height, pitch_deg, fov_deg, sun_height_deg, sun_azimuth_deg, place, yaw_deg"
    );
    assert_eq!(
        with("(1e6, -2.5)", "(1e6, -2.5, 0)"),
        "v.ron:8:12: `place` is `(x, z)`, two numbers\n    place: (1e6, -2.5, 0),\n           ^"
    );
    assert_eq!(
        with("-4.5", "\"low\""),
        "v.ron:6:21: `sun_height_deg` is a number, but this is a string\n    sun_height_deg: \"low\",\n                    ^"
    );
}

#[test]
fn fault_unknown_key() {
    assert_eq!(
        value_fault("\"CLOUD_STEP\": 8"),
        "p.ron:2:10: unknown key `CLOUD_STEP`\nvalues: {\"CLOUD_STEP\": 8})\n         ^\nnote: did you mean `CLOUD_STEPS`?"
    );
    assert_eq!(
        scene_fault("(program: \"p\", meaning: \"m\", features: [], content: (sun_height: 1))"),
        "s.ron:1:54: unknown key `sun_height`\n(program: \"p\", meaning: \"m\", features: [], content: (sun_height: 1))\n\
         \x20                                                    ^\nnote: did you mean `SUN_HEIGHT`?"
    );
}

#[test]
fn fault_wrong_type() {
    for (values, at, message) in [
        (
            "\"CLOUD_STEPS\": 8.0",
            25,
            "`CLOUD_STEPS` is a whole number, but this is a number (8.0); allowed is [1, 4096]",
        ),
        (
            "\"CLOUD_STEPS\": \"8\"",
            25,
            "`CLOUD_STEPS` is a whole number, but this is a string (\"8\"); allowed is [1, 4096]",
        ),
        (
            "\"SNOW\": 2",
            18,
            "`SNOW` is a flag (true, false, 1 or 0), but this is a whole number (2); allowed is true, false, 1 or 0",
        ),
        (
            "\"SUN_COLOR\": (1, 2)",
            23,
            "`SUN_COLOR` is three numbers, but this is a list ((1, 2)); allowed is [0, 10] for each component",
        ),
        (
            "\"STEP_FACTOR\": true",
            25,
            "`STEP_FACTOR` is a number, but this is a flag (true); allowed is [0.01, 1]",
        ),
        (
            "\"STEP_FACTOR\": None",
            25,
            "`STEP_FACTOR` is a number, but this is None (None); allowed is [0.01, 1]",
        ),
        (
            "\"STEP_FACTOR\": half",
            25,
            "`STEP_FACTOR` is a number, but this is a bare word (half); allowed is [0.01, 1]",
        ),
    ] {
        assert_eq!(
            value_fault(values),
            format!(
                "p.ron:2:{at}: {message}\nvalues: {{{values}}})\n{}^",
                " ".repeat(at - 1)
            )
        );
    }
}

#[test]
fn fault_out_of_domain() {
    for (values, at, message) in [
        (
            "\"CLOUD_STEPS\": 0",
            25,
            "`CLOUD_STEPS` is 0: out of its domain [1, 4096]",
        ),
        (
            "\"STEP_FACTOR\": 1.5",
            25,
            "`STEP_FACTOR` is 1.5: out of its domain [0.01, 1]",
        ),
        (
            "\"SEED\": -1",
            18,
            "`SEED` is -1: out of its domain [0, 4294967295.0]",
        ),
        (
            "\"SUN_COLOR\": (1, 11, 1)",
            23,
            "`SUN_COLOR` is (1.0, 11.0, 1.0): out of its domain [0, 10] for each component",
        ),
    ] {
        assert_eq!(
            value_fault(values),
            format!(
                "p.ron:2:{at}: {message}\nvalues: {{{values}}})\n{}^",
                " ".repeat(at - 1)
            )
        );
    }
}

#[test]
fn fault_not_finite() {
    for word in ["inf", "-inf", "NaN", "1e999"] {
        let shown = match word {
            "1e999" => "inf",
            word => word,
        };
        assert_eq!(
            value_fault(&format!("\"STEP_FACTOR\": {word}")),
            format!(
                "p.ron:2:25: `STEP_FACTOR` is {shown}: not finite; allowed is [0.01, 1]\n\
                 values: {{\"STEP_FACTOR\": {word}}})\n{}^",
                " ".repeat(24)
            )
        );
    }
}

#[test]
fn fault_duplicate_key() {
    assert_eq!(
        value_fault("\"SNOW\": true, \"SNOW\": false"),
        "p.ron:2:24: key `SNOW` is given twice\nvalues: {\"SNOW\": true, \"SNOW\": false})\n                       ^\n\
         note: the first is at p.ron:2:10"
    );
    let text = "(reason: \"a\", reason: \"b\", values: {})";
    assert_eq!(
        refused(Preset::parse(&keys(), "p", "p.ron", text)),
        format!(
            "p.ron:1:15: key `reason` is given twice\n{text}\n              ^\nnote: the first is at p.ron:1:2"
        )
    );
}

#[test]
fn fault_unknown_field() {
    assert_eq!(
        refused(Preset::parse(
            &keys(),
            "p",
            "p.ron",
            "(\n reasons: \"r\", reason: \"r\", values: {})"
        )),
        "p.ron:2:2: unknown field `reasons` of a preset\n reasons: \"r\", reason: \"r\", values: {})\n ^\n\
         note: did you mean `reason`?"
    );
    assert_eq!(
        value_fault("\"SNOW\": (value: true, because: \"x\")"),
        "p.ron:2:32: unknown field `because` of the value of `SNOW`\n\
         values: {\"SNOW\": (value: true, because: \"x\")})\n                               ^\n\
         note: the fields are value, why"
    );
}

#[test]
fn fault_ron_syntax() {
    let fault = |text: &str| refused(Preset::parse(&keys(), "p", "p.ron", text));
    assert_eq!(
        fault("(\n    reason: \"r\"\n    values: {},\n)"),
        "p.ron:3:5: RON: expected comma\n    values: {},\n    ^"
    );
    assert_eq!(
        fault("(reason: \"r\",\n values: {\"A\": 1 \"B\": 2})"),
        "p.ron:2:18: RON: expected comma\n values: {\"A\": 1 \"B\": 2})\n                 ^"
    );
    assert_eq!(
        fault("(reason: \"r\", values: {}"),
        "p.ron:1:25: RON: expected comma, but the file ends: is a bracket not closed?\n(reason: \"r\", values: {}\n                        ^"
    );
    assert_eq!(
        fault("(reason: \"r\", values: {}) more"),
        "p.ron:1:27: RON: non-whitespace trailing characters\n(reason: \"r\", values: {}) more\n                          ^"
    );
    assert_eq!(
        fault("(reason: \"r\", values: {SNOW: true})"),
        "p.ron:1:24: a key is no string: write `{\"KEY\": value}` or `(KEY: value)`\n\
         (reason: \"r\", values: {SNOW: true})\n                       ^"
    );
}

#[test]
fn fault_a_value_of_a_delta_without_why() {
    let keys = keys();
    let text = "(based_on: \"base\", reason: \"r\", values: {\n\"CLOUD_STEPS\": 8})";
    assert_eq!(
        refused(Preset::parse(&keys, "p", "p.ron", text)),
        "p.ron:2:1: `CLOUD_STEPS` has no reason: a preset that is based on another gives one for each value, \
         `\"CLOUD_STEPS\": (value: 8, why: \"...\")`\n\"CLOUD_STEPS\": 8})\n^"
    );
    let blank = text.replace("8}", "(value: 8, why: \" \")}");
    assert_eq!(
        refused(Preset::parse(&keys, "p", "p.ron", &blank)),
        "p.ron:2:32: `why` is empty\n\"CLOUD_STEPS\": (value: 8, why: \" \")})\n                               ^"
    );
    let free = text.replace("based_on: \"base\", ", "");
    let preset = Preset::parse(&keys, "p", "p.ron", &free).unwrap();
    assert_eq!(
        (preset.values[0].value, &preset.values[0].why),
        (Value::Int(8), &None)
    );
}

#[test]
fn fault_base_of_a_preset() {
    let keys = keys();
    let delta = |base: &str| format!("(based_on: \"{base}\",\n reason: \"r\", values: {{}})");
    assert_eq!(
        refused(Presets::load(
            &keys,
            &[("base", "base.ron", BASE), ("p", "p.ron", &delta("bade"))]
        )),
        "p.ron:1:12: no preset `bade` to be based on\n(based_on: \"bade\",\n           ^\nnote: did you mean `base`?"
    );
    assert_eq!(
        refused(Presets::load(
            &keys,
            &[
                ("a", "a.ron", &delta("b")),
                ("b", "b.ron", &delta("c")),
                ("c", "c.ron", &delta("a")),
                ("d", "d.ron", &delta("a")),
            ]
        )),
        "a.ron:1:12: presets in a circle: a -> b -> c -> a\n(based_on: \"b\",\n           ^"
    );
    assert_eq!(
        refused(Presets::load(&keys, &[("a", "a.ron", &delta("a"))])),
        "a.ron:1:12: presets in a circle: a -> a\n(based_on: \"a\",\n           ^"
    );
    assert_eq!(
        refused(Presets::load(
            &keys,
            &[("base", "base.ron", BASE), ("base", "mine/base.ron", BASE)]
        )),
        "mine/base.ron: a second preset `base`\nnote: the first is base.ron"
    );
}

#[test]
fn fault_in_a_scene() {
    let scene = |features: &str, content: &str| {
        scene_fault(&format!(
            "(program: \"p\", meaning: \"m\",\nfeatures: [{features}],\ncontent: {{{content}}})"
        ))
    };
    assert_eq!(
        scene("", "\"CLOUD_STEPS\": 8"),
        "s.ron:3:11: `CLOUD_STEPS` is a quality key: a scene gives content, quality is the preset's\n\
         content: {\"CLOUD_STEPS\": 8})\n          ^"
    );
    assert_eq!(
        scene("", "\"SNOW\": true"),
        "s.ron:3:11: `SNOW` is a quality key: a scene gives content, quality is the preset's\n\
         content: {\"SNOW\": true})\n          ^\nnote: a flag that the scene needs stands in `features`"
    );
    assert_eq!(
        scene("\"SNOV\"", ""),
        "s.ron:2:12: unknown feature `SNOV`\nfeatures: [\"SNOV\"],\n           ^\nnote: did you mean `SNOW`?"
    );
    assert_eq!(
        scene("\"SEED\"", ""),
        "s.ron:2:12: `SEED` is of the type u32: a feature is a flag\nfeatures: [\"SEED\"],\n           ^"
    );
    assert_eq!(
        scene("\"SNOW\", \"SNOW\"", ""),
        "s.ron:2:20: feature `SNOW` is given twice\nfeatures: [\"SNOW\", \"SNOW\"],\n                   ^"
    );
    assert_eq!(
        scene("\"WATER\"", "\"WATER\": false"),
        "s.ron:3:11: `WATER` is a feature of the scene and also false\ncontent: {\"WATER\": false})\n          ^"
    );
    assert_eq!(
        scene_fault("(meaning: \"m\", features: {}, content: [1])"),
        "s.ron:1:1: a scene has no field `program`\n(meaning: \"m\", features: {}, content: [1])\n^\n\
         s.ron:1:26: `features` is a list of flags, but this is a map\n(meaning: \"m\", features: {}, content: [1])\n\
         \x20                        ^\n\
         s.ron:1:39: `content` is a map of keys, but this is a list\n(meaning: \"m\", features: {}, content: [1])\n\
         \x20                                     ^"
    );
    assert!(scene_fault("[]").starts_with("s.ron:1:1: a scene is a map, but this is a list"));
    let empty = Scene::parse(
        &keys(),
        "s",
        "s.ron",
        "(program: \"p\", meaning: \"m\", features: (), content: ())",
    )
    .unwrap();
    assert!(empty.features.is_empty() && empty.content.is_empty());
}

#[test]
fn fault_in_set() {
    let (keys, presets) = (keys(), presets());
    let fault = |texts: &[&str]| refused(resolve(&keys, &presets, "base", None, &sets(texts)));
    for (set, at, message) in [
        (
            "CLOUD_STEPS=0",
            13,
            "`CLOUD_STEPS` is 0: out of its domain [1, 4096]",
        ),
        (
            "CLOUD_STEPS=8.5",
            13,
            "`CLOUD_STEPS` is a whole number, but this is `8.5`; allowed is [1, 4096]",
        ),
        (
            "SNOW=yes",
            6,
            "`SNOW` is a flag (true, false, 1 or 0), but this is `yes`; allowed is true, false, 1 or 0",
        ),
        (
            "SUN_COLOR=1,2",
            11,
            "`SUN_COLOR` is three numbers, but this is `1,2`; allowed is [0, 10] for each component",
        ),
        (
            "STEP_FACTOR=nan",
            13,
            "`STEP_FACTOR` is NaN: not finite; allowed is [0.01, 1]",
        ),
    ] {
        assert_eq!(
            fault(&[set]),
            format!("--set:1:{at}: {message}\n{set}\n{}^", " ".repeat(at - 1))
        );
    }
    assert_eq!(
        fault(&["CLOUDSTEPS=1"]),
        "--set:1:1: unknown key `CLOUDSTEPS`\nCLOUDSTEPS=1\n^\nnote: did you mean `CLOUD_STEPS`?"
    );
    assert_eq!(
        fault(&["SEED=1", "SEED=2"]),
        "--set:1:1: key `SEED` is given twice\nSEED=2\n^"
    );
    assert_eq!(
        split_set("SEED").unwrap_err().to_string(),
        "--set:1:5: `KEY=VALUE` is expected\nSEED\n    ^"
    );
    assert!(split_set("=1").is_err() && split_set("SEED= ").is_err());
    assert_eq!(
        refused(resolve(&keys, &presets, "loww", None, &[])),
        "--preset:1:1: no preset `loww`\nloww\n^\nnote: did you mean `low`?"
    );
}

#[test]
fn fault_in_a_declaration() {
    let good = "(name: \"A\", type: \"f32\", kind: \"content\", domain: (0, 1), default: 0.5, meaning: \"m\", unit: \"1\")";
    assert!(Keys::load(&[("k.ron", format!("[{good}]"))]).is_ok());
    let with = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        let line = good.replace(from, to);
        let fault = key_fault(&format!("[\n{line}\n]"));
        let mut lines = fault.lines();
        let head = lines.next().unwrap().to_owned();
        assert_eq!(lines.next(), Some(line.as_str()), "{fault}");
        let caret = lines.next().unwrap();
        assert!(
            head.starts_with(&format!("k.ron:2:{}: ", caret.len())),
            "{fault}"
        );
        let notes: Vec<&str> = lines.collect();
        let message = head.split(": ").skip(1).collect::<Vec<_>>().join(": ");
        let there = line.get(caret.len() - 1..).unwrap_or("");
        (message, there.to_owned(), notes.join("; "))
    };
    let check = |from: &str, to: &str, message: &str, there: &str| {
        let (got, at, _) = with(from, to);
        assert_eq!(got, message);
        assert!(at.starts_with(there), "{got}: {at}");
    };
    let (message, _, note) = with("\"f32\"", "\"vec\"");
    assert_eq!(
        message,
        "key `A`: unknown type `vec`; allowed is flag, i32, u32, f32, size, vec3"
    );
    assert_eq!(note, "note: did you mean `vec3`?");
    for (from, to, message, there) in [
        (
            "\"A\"",
            "\"a_b\"",
            "`a_b` is no name of a key: upper-case letters, digits and single underscores, a letter first",
            "\"a_b\"",
        ),
        (
            "content",
            "contents",
            "key `A`: unknown kind `contents`; allowed is quality, content",
            "\"contents\"",
        ),
        (
            "(0, 1)",
            "(1, 0)",
            "key `A`: the domain (1, 0) is empty",
            "(1, 0)",
        ),
        (
            "(0, 1)",
            "0.5",
            "key `A`: a domain is `(least, greatest)`",
            "0.5",
        ),
        (
            "(0, 1)",
            "(0, inf)",
            "`domain` is inf: not finite; allowed is [-3.4028234663852886e38, 3.4028234663852886e38]",
            "inf",
        ),
        (
            "0.5",
            "2.5",
            "the default: `A` is 2.5: out of its domain [0, 1]",
            "2.5",
        ),
        (
            "0.5",
            "true",
            "the default: `A` is a number, but this is a flag (true); allowed is [0, 1]",
            "true",
        ),
        (
            "meaning: \"m\"",
            "meaning: \"\"",
            "`meaning` is empty",
            "\"\"",
        ),
        (", unit: \"1\"", "", "key `A` has no field `unit`", "(name"),
        (
            "\"f32\"",
            "\"flag\"",
            "key `A`: a flag has no domain",
            "domain",
        ),
        (
            "\"f32\"",
            "\"size\"",
            "key `A`: a size cannot be content, for it is put into the shader's text",
            "\"content\"",
        ),
        (
            "\"f32\", kind: \"content\"",
            "\"vec3\", kind: \"quality\"",
            "key `A`: a vec3 cannot be quality, for no WGSL override is a vector",
            "\"quality\"",
        ),
        (
            "\"f32\", kind: \"content\", domain: (0, 1)",
            "\"i32\", kind: \"content\", domain: (0, 1.5)",
            "key `A`: the bounds of type i32 are whole numbers",
            "1.5",
        ),
        (
            "\"f32\", kind: \"content\", domain: (0, 1)",
            "\"u32\", kind: \"content\", domain: (-1, 1)",
            "`domain` is -1: out of its domain [0, 4294967295.0]",
            "-1",
        ),
        (
            "name:",
            "nmae:",
            "a key declaration has no field `name`",
            "(nmae",
        ),
    ] {
        if message.contains("`name`") {
            let fault = key_fault(&format!("[\n{}\n]", good.replace(from, to)));
            assert!(
                fault.contains(message) && fault.contains("unknown field `nmae`"),
                "{fault}"
            );
            continue;
        }
        check(from, to, message, there);
    }
    assert!(
        key_fault("(name: \"A\")")
            .starts_with("k.ron:1:1: key declarations are a list, but this is a map")
    );
}

#[test]
fn places_are_found_in_any_notation() {
    let text = "#![enable(implicit_some)]\n// \"a\": {\nOuter /* ( */ (\n  a: { \"b\\\"]\": [1, r##\"x\"# }\"##, (c: 'x', d: Some(-2.5e3))], },\n  r#e: b\"}\", f: '\\'', g: \"\\\\\",\n)";
    let root = ron_place::read("a", text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(ron_place::is_exact(text), Some(true));
    let at = |path: &[&str]| {
        let node = root.at_path(path.iter().copied()).unwrap();
        &text[node.start..node.end]
    };
    let list = root.at_path(["a", "b\"]"]).unwrap();
    let ron_place::Kind::List(items) = &list.kind else {
        panic!("{list:?}");
    };
    let shown: Vec<&str> = items.iter().map(|n| &text[n.start..n.end]).collect();
    assert_eq!(shown, ["1", "r##\"x\"# }\"##", "(c: 'x', d: Some(-2.5e3))"]);
    let d = items[2].get("d").unwrap();
    assert_eq!(&text[d.start..d.value.end], "d: Some(-2.5e3");
    assert_eq!(d.value.number(), Some(-2500.0));
    assert_eq!(
        (at(&["e"]), at(&["f"]), at(&["g"])),
        ("b\"}\"", "'\\''", "\"\\\\\"")
    );
}

#[test]
fn the_examples_of_the_documentation_are_read() {
    let document = include_str!("../../../../docs/presets.md");
    let of = |kind: &str| {
        let found = blocks(document, &format!("ron {kind}"));
        assert!(!found.is_empty(), "{kind}");
        found
    };
    let keys = Keys::load(&[("keys.ron", of("keys")[0])]).unwrap_or_else(|e| panic!("{e}"));
    let presets = of("preset");
    let presets = Presets::load(
        &keys,
        &[("base", "a", presets[0]), ("low", "b", presets[1])],
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::parse(&keys, "s", "s", of("scene")[0]).unwrap_or_else(|e| panic!("{e}"));
    View::parse("v", "v", of("view")[0]).unwrap_or_else(|e| panic!("{e}"));
    let settings = resolve(&keys, &presets, "low", Some(&scene), &[]).unwrap();
    assert_eq!(settings.values["CLOUD_STEPS"], Value::Int(32));
    assert_eq!(settings.values["CLOUD_COVERAGE"], Value::Float(0.8));
    assert_eq!(settings.flags().len(), 1);
}
