//! `veduta stress`: complete, green, and red for every kind of fault.

use veduta_cli::catalog::SourceArgs;
use veduta_cli::shipped;
use veduta_cli::stress::check::{Check, Fault, distance};
use veduta_cli::stress::subject::Subject;
use veduta_cli::stress::twins::{ELSEWHERE, Entry, registry};
use veduta_cli::stress::{Plan, effects, elsewhere, energy, functions, pairs};
use veduta_compose::Library;
use veduta_compose::header::ErrorKind;

use crate::common::{folder, json, veduta};

/// The shipped modules with parts of their texts replaced.
fn library(changes: &[(&str, &str)]) -> Library {
    let mut used = vec![false; changes.len()];
    let files = shipped::FILES
        .iter()
        .filter(|(path, _)| path.ends_with(".wgsl"))
        .map(|(path, text)| {
            let mut text = (*text).to_owned();
            for ((from, to), used) in changes.iter().zip(&mut used) {
                *used |= text.contains(from);
                text = text.replace(from, to);
            }
            ((*path).to_owned(), text)
        })
        .collect();
    assert!(used.iter().all(|u| *u), "{changes:?}");
    Library::from_sources(files).unwrap()
}

const SOME: Plan = Plan {
    evaluations: 40_000,
    least: 4096,
    tight: false,
};

/// What is wrong with a function.
fn faults_with(library: &Library, entries: &[Entry], plan: &Plan, filter: &str) -> Vec<Fault> {
    let gpu = veduta::device::shared().unwrap();
    let found = functions(gpu, library, entries, plan, filter, &|_, _| {}).unwrap();
    assert_eq!(found.len(), 1, "{filter}");
    found.into_iter().flat_map(|f| f.faults).collect()
}

fn faults(changes: &[(&str, &str)], plan: &Plan, filter: &str) -> Vec<Check> {
    faults_with(&library(changes), &registry(), plan, filter)
        .into_iter()
        .map(|f| f.check)
        .collect()
}

#[test]
fn every_public_function_has_one_twin() {
    let subjects = Subject::all(&library(&[])).unwrap();
    let mut entries = registry();
    assert!(subjects.len() > 150, "{}", subjects.len());
    assert_eq!(pairs(&subjects, &entries).unwrap().len(), subjects.len());
    // One that is missing is named, and so is one too many.
    let last = entries.pop().unwrap();
    let error = pairs(&subjects, &entries).unwrap_err().to_string();
    assert!(error.contains(last.path), "{error}");
    let path = last.path;
    entries.push(last);
    let fewer: Vec<Subject> = subjects.into_iter().filter(|s| s.path != path).collect();
    let error = pairs(&fewer, &entries).unwrap_err().to_string();
    assert!(error.contains(path), "{error}");
}

#[test]
fn every_function_that_reads_textures_names_its_test() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/all");
    let tests: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| std::fs::read_to_string(entry.unwrap().path()).unwrap())
        .collect();
    for (path, test) in elsewhere(&library(&[]), ELSEWHERE).unwrap() {
        let name = path.rsplit("::").next().unwrap();
        let judged = |text: &String| text.contains(&format!("fn {test}(")) && text.contains(name);
        assert!(tests.iter().any(judged), "no test `{test}` names `{name}`");
    }
    // One that no row names is an error, as is a row too many.
    let text = "//! Looked up.\n//! source   ours\n#define_import_path veduta::looked_up\n\n/// The first texel.\n///\n/// range   [0, 1] 1\n/// error   0 abs of reference::looked_up::first\n/// source  ours\nfn first(table: texture_2d<f32>) -> vec4<f32> {\n    return textureLoad(table, vec2<i32>(0, 0), 0);\n}\n";
    let sources = vec![("looked_up.wgsl".to_owned(), text.to_owned())];
    let one = Library::from_sources(sources).unwrap();
    assert!(Subject::all(&one).unwrap().is_empty());
    let path = "veduta::looked_up::first";
    let error = elsewhere(&one, &[]).unwrap_err().to_string();
    assert!(error.contains(path), "{error}");
    assert_eq!(
        elsewhere(&one, &[(path, "a_test")]).unwrap(),
        [(path.to_owned(), "a_test")]
    );
    let error = elsewhere(&one, &[(path, "a_test"), ("gone", "a_test")]).unwrap_err();
    assert!(error.to_string().contains("gone"), "{error}");
}

#[test]
fn the_quick_run_covers_everything_and_finds_nothing() {
    let dir = folder("stress_quick");
    let start = std::time::Instant::now();
    let run = veduta(
        &dir,
        &[
            "stress",
            "--quick",
            "--json",
            "found.json",
            "--out",
            "accuracy.md",
        ],
    )
    .good();
    println!("{:.1} s", start.elapsed().as_secs_f64());
    let found = json(&dir.join("found.json"));
    let list = found["functions"].as_array().unwrap();
    let subjects = Subject::all(&library(&[])).unwrap();
    assert_eq!(list.len(), subjects.len());
    let document = std::fs::read_to_string(dir.join("accuracy.md")).unwrap();
    for (entry, subject) in list.iter().zip(&subjects) {
        let name = entry["function"].as_str().unwrap();
        assert!(subjects.iter().any(|s| s.short() == name), "{name}");
        assert!(entry["evaluations"].as_u64().unwrap() >= 64, "{name}");
        assert!(run.out.contains(&format!("`{}`", subject.short())));
        assert!(document.contains(&format!("| `{}`", subject.short())));
        let (largest, mean) = (&entry["largest_error"], &entry["mean_error"]);
        assert!(largest.as_f64() >= mean.as_f64(), "{entry}");
    }
    assert!(found["evaluations"].as_u64().unwrap() >= 2_000_000);
    let pictures = &found["pictures"];
    assert!(pictures["drawn"].as_u64().unwrap() > 500, "{pictures}");
    assert!(pictures["refused"].as_u64().unwrap() > 400, "{pictures}");
    let share = pictures["share_of_bound"].as_f64().unwrap();
    assert!(share > 0.001 && share <= 1.0, "{share}");
    assert!(document.contains("veduta stress --quick") && document.contains("- device: "));
}

#[test]
fn each_check_of_functions_goes_red() {
    let neutral = "tone_map::neutral::neutral";
    assert_eq!(faults(&[], &SOME, neutral), []);
    let wrong = ("const START: f32 = 0.76;", "const START: f32 = 0.75;");
    assert!(faults(&[wrong], &SOME, neutral).contains(&Check::Error));
    let nothing = "bounce_direction";
    let guard = (
        "max(dot(to_sun.xz, to_sun.xz), 1e-10)",
        "dot(to_sun.xz, to_sun.xz)",
    );
    assert_eq!(faults(&[], &SOME, nothing), []);
    assert!(faults(&[guard], &SOME, nothing).contains(&Check::Finite));
    let narrow = ("range   [0, 27] 1/sr", "range   [0, 26] 1/sr");
    assert!(faults(&[narrow], &SOME, "phase_schlick").contains(&Check::Range));
    let falling = (
        "/// error   3e-7 rel of reference::phase::phase_rayleigh",
        "/// error   3e-7 rel of reference::phase::phase_rayleigh\n/// monotone mu",
    );
    assert!(faults(&[falling], &SOME, "phase_rayleigh").contains(&Check::Monotone));
    let silent = ("/// outside undefined\n", "");
    assert!(faults(&[silent], &SOME, "decode_srgb").contains(&Check::Outside));
    let brighter = (
        "return SkyLight(in_scatter,",
        "return SkyLight(3.0 * in_scatter,",
    );
    let few = Plan {
        evaluations: 4096,
        ..SOME
    };
    assert!(faults(&[brighter], &few, "march_sky").contains(&Check::Energy));
    let generous = (
        "error   6e-7 abs of reference::tone_map::neutral",
        "error   1e-4 abs of reference::tone_map::neutral",
    );
    let tight = Plan {
        tight: true,
        ..SOME
    };
    assert_eq!(faults(&[], &tight, neutral), []);
    assert_eq!(faults(&[generous], &SOME, neutral), []);
    assert_eq!(faults(&[generous], &tight, neutral), [Check::Generous]);
}

#[test]
fn jumps_do_not_excuse_everything() {
    let mut entries = registry();
    let sphere = "planet::shell::sphere_span";
    assert_eq!(faults_with(&library(&[]), &entries, &SOME, sphere), []);
    // Without the excuse tangent rays are faults.
    let entry = entries
        .iter_mut()
        .find(|e| e.path.ends_with(sphere))
        .unwrap();
    entry.jumps = None;
    let found = faults_with(&library(&[]), &entries, &SOME, sphere);
    assert!(found.iter().all(|f| f.check == Check::Error) && !found.is_empty());
    // An excuse for any argument leaves too many rows out.
    let neutral = "tone_map::neutral::neutral";
    let entry = entries
        .iter_mut()
        .find(|e| e.path.ends_with(neutral))
        .unwrap();
    entry.jumps = Some(("all places", 1.0));
    let wrong = library(&[("const START: f32 = 0.76;", "const START: f32 = 0.5;")]);
    let found = faults_with(&wrong, &entries, &SOME, neutral);
    assert!(found.iter().any(|f| f.check == Check::Undetermined));
    // A twin that the header does not name, and one of other arguments.
    let gpu = veduta::device::shared().unwrap();
    let error = |entries: &[Entry]| {
        functions(gpu, &library(&[]), entries, &SOME, neutral, &|_, _| {})
            .unwrap_err()
            .to_string()
    };
    let at = entries
        .iter()
        .position(|e| e.path.ends_with(neutral))
        .unwrap();
    entries[at].columns = 5;
    assert!(error(&entries).contains("those of its twin, 5"));
    entries[at].reference = "reference::tone_map::agx";
    assert!(error(&entries).contains("reference::tone_map::agx"));
}

#[test]
fn integrals_that_are_not_1_are_found() {
    let gpu = veduta::device::shared().unwrap();
    let (evaluations, faults) = energy::check(gpu, &library(&[]), "").unwrap();
    assert!(evaluations > 1_000_000 && faults.is_empty(), "{faults:?}");
    let wrong = library(&[("3.0 / (16.0 * PI)", "3.01 / (16.0 * PI)")]);
    let (_, faults) = energy::check(gpu, &wrong, "phase_rayleigh").unwrap();
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].check, Check::Energy);
}

#[test]
fn pictures_that_are_negative_too_bright_or_not_finite_are_found() {
    let broken = |name: &str, from: &str, to: &str| {
        let dir = folder(name);
        for (path, text) in shipped::FILES {
            let file = dir.join(path);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, text.replace(from, to)).unwrap();
        }
        let sources = SourceArgs {
            modules: vec![dir.join("wgsl")],
            presets: vec![dir.join("presets")],
            no_shipped: true,
        };
        let gpu = veduta::device::shared().unwrap();
        effects::check(gpu, &sources, true, &|_| {}).unwrap().faults
    };
    let sun = broken(
        "stress_pictures",
        "return coverage / (PI * area);",
        "let factor = select(select(-1.0, 1e20, dir.y > 0.1), 1e38, dir.y > 0.4);\n    \
         return factor * coverage / (PI * area);",
    );
    for check in [Check::Range, Check::Energy, Check::Finite] {
        assert!(sun.iter().any(|f| f.check == check), "{check:?}: {sun:?}");
    }
    // Rocks a thousand times too bright are far below the sun's disc.
    let rocks = broken(
        "stress_rocks",
        "const INVERSE_PI: f32 = 0.31830989;",
        "const INVERSE_PI: f32 = 318.30989;",
    );
    assert!(rocks.iter().any(|f| f.check == Check::Energy), "{rocks:?}");
}

#[test]
fn errors_are_measured_as_the_grammar_says() {
    assert_eq!(distance(ErrorKind::Abs, 2.5, 2.0), 0.5);
    assert_eq!(distance(ErrorKind::Rel, 2.5, -2.0), 2.25);
    assert_eq!(
        distance(ErrorKind::Ulp, 1.0 + f64::from(f32::EPSILON), 1.0),
        1.0
    );
    assert_eq!(
        distance(ErrorKind::Ulp, 2.0 + f64::from(f32::EPSILON), 2.0),
        0.5
    );
    assert_eq!(distance(ErrorKind::Rel, 0.0, 0.0), 0.0);
    // Flushed to 0.
    assert!(distance(ErrorKind::Rel, 0.0, 1e-42) < 1e-3);
    assert!(distance(ErrorKind::Abs, f64::NAN, 1.0).is_nan());
}

#[test]
fn arguments_of_the_command_are_checked() {
    let dir = folder("stress_arguments");
    veduta(&dir, &["stress", "no_such_function"]).bad(1, &["no_such_function"]);
    for count in ["0", "-1", "1.5", "1e16", "many"] {
        let count = format!("--evaluations={count}");
        veduta(&dir, &["stress", &count]).bad(2, &["--evaluations"]);
    }
    veduta(&dir, &["stress", "--quick", "--evaluations", "1e6"]).bad(2, &["cannot be used with"]);
    veduta(&dir, &["stress", "--out", "nowhere/table.md"]).bad(1, &["nowhere"]);
    let run = veduta(&dir, &["stress", "tone_map::agx", "--evaluations", "1e4"]).good();
    assert!(run.out.contains("`tone_map::agx::agx_sigmoid`") && run.out.contains("2 functions, "));
    assert!(!run.out.contains("pictures"), "{}", run.out);
}
