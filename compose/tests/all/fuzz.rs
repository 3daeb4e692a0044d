//! Mutated inputs: no panic, no hang, and every fault has a place that exists.

use std::time::Duration;

use veduta_compose::diag::{Diags, line_at};
use veduta_compose::fuzz::{Mutator, Pcg, count, run};
use veduta_compose::header::parse_headers;
use veduta_compose::keys::Keys;
use veduta_compose::ron_place;
use veduta_compose::settings::{Preset, Presets, Scene, View, resolve};
use veduta_compose::sp::{StageKind, parse_bytes};

/// An input that takes longer hangs, also on a busy machine.
const LIMIT: Duration = Duration::from_secs(20);

const SP: [&str; 4] = [
    include_str!("../fixtures/appendix_a/speeds.sp"),
    include_str!("../fixtures/appendix_a/terrain.sp"),
    "#PROGRAM{ P }#\n#DEFINE{ #A{ x }# #B{#{A}#{B}}# }#\n#COMPUTE {#USE{A}##SRC{ a/../b.wgsl }##CODE{}#}#",
    "#PROGRAM{P}##GEOMETRY{#PARAMS{#IN{LINES}##OUT{POINTS}##CNT{3}#}##CODE{x}#}##VERTEX{#CODE{#if 1}#}#",
];

const SP_TOKENS: [&str; 30] = [
    "#PROGRAM{",
    "#DEFINE{",
    "#VERTEX{",
    "#FRAGMENT {",
    "#COMPUTE{",
    "#GEOMETRY{",
    "#CODE{",
    "#SRC{",
    "#USE{",
    "#PARAMS{",
    "#IN{",
    "#OUT{",
    "#CNT{",
    "}#",
    "{",
    "}",
    "#",
    "#{A}",
    "#{A}#{B}",
    "#A{",
    "#A{x}#",
    "#code{",
    "\n",
    "../",
    "/",
    "A",
    "LINES",
    "4294967296",
    "#é{",
    "#USE{A}#",
];

const RON: [&str; 7] = [
    include_str!("../fixtures/settings/keys.ron"),
    include_str!("../fixtures/settings/base.ron"),
    include_str!("../fixtures/settings/low.ron"),
    include_str!("../fixtures/settings/lowest.ron"),
    include_str!("../fixtures/settings/scene.ron"),
    include_str!("../fixtures/settings/view.ron"),
    "#![enable(implicit_some)] Outer(a: {\"b\\\"]\": [1, r##\"x\"# }\"##, (c: 'x', d: Some(-2.5e3))]}, r#e: b\"}\", f: '\\'', g: \"\\\\\", h: 0x1F, i: b'a', j: 1..2)",
];

const RON_TOKENS: [&str; 44] = [
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "\"",
    "'",
    "\\",
    "r#\"",
    "\"#",
    "b\"",
    "br#\"",
    "//",
    "/*",
    "*/",
    "\n",
    "inf",
    "-inf",
    "NaN",
    "1e999",
    "-0.0",
    "0x",
    "1_000u8",
    "2.5f32",
    "18446744073709551616",
    "None",
    "Some(",
    "()",
    "true",
    "\"SNOW\": 1,",
    "SNOW: 1,",
    "CLOUD_STEPS",
    "(value: 1, why: \"x\")",
    "..=",
    "'\\u{1F600}'",
    "b'x'",
    "r#x",
    "\"\\x41\"",
    "#![enable(unwrap_newtypes)]",
    "a.b",
    "-",
];

const WGSL: [&str; 2] = [
    "//! Title.\n//! source   ours\n//! symbols  h\n#define_import_path a::b\n#import c::{d, e}\n\n/// One.\n///\n\
     /// domain  h in [0, top] m lin\n/// domain  top in (-pi, inf] 1/m lin\n/// domain  s.x in [1, 2] 1 log\n\
     /// range   [-inf, inf) m\n/// error   1e-6 rel of reference::a::f\n/// monotone h\n/// source  ours,\n///         more\n\
     @must_use\nfn f(h: f32, top: vec3<f32>, s: S, /* c */ t: texture_2d<f32>,) -> f32 { if a { return b; } }\n",
    "//! T\n//!\n//! source s\nstruct S { /// x\n a: f32, }\n/// Two.\n/// internal\nvirtual fn g(x: array<vec2<f32>, 3>) {}",
];

const WGSL_TOKENS: [&str; 36] = [
    "//!",
    "///",
    "//",
    "/*",
    "*/",
    "fn ",
    "fn f(",
    "(",
    ")",
    "{",
    "}",
    "<",
    ">",
    "->",
    "@x(",
    "#ifdef X\n",
    "#import a::{",
    "\n",
    "/// domain  ",
    "/// range   [",
    "/// error   ",
    "/// monotone ",
    "/// source  ",
    "/// internal\n",
    " in ",
    "[",
    "]",
    ",",
    "inf",
    "-",
    "pi",
    " lin",
    " log",
    "reference::a::b",
    ";",
    "virtual ",
];

/// Every fault has a place in the text, and can be shown.
fn check_places(faults: &Diags, file: &str, text: &str) {
    assert!(!faults.is_empty());
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for fault in faults.iter().filter(|fault| fault.file == file) {
        assert!(!fault.message.is_empty() && !fault.to_string().is_empty());
        if fault.line == 0 {
            continue;
        }
        let line = line_at(text, fault.line);
        assert_eq!(line, fault.source_line, "{fault}");
        assert!(
            fault.column >= 1 && fault.column as usize <= line.chars().count() + 1,
            "{fault}"
        );
    }
}

fn report(name: &str, mutator: Mutator, check: impl FnMut(&[u8]) -> bool + Send + 'static) {
    let inputs = count(20_000).unwrap();
    let report = run(inputs, mutator, LIMIT, check).unwrap_or_else(|failure| panic!("{failure}"));
    println!("{name}: {report:?}");
    assert_eq!(report.inputs, inputs);
    if inputs >= 1000 {
        // Neither everything nor nothing gets through, or the mutations test nothing.
        assert!(report.accepted > inputs / 100, "{report:?}");
        assert!(report.accepted < inputs - inputs / 100, "{report:?}");
    }
}

#[test]
fn sp_programs() {
    report("sp", Mutator::new(1, &SP, &SP_TOKENS), |input| {
        let program = match parse_bytes("a.sp", input) {
            Ok(program) => program,
            Err(faults) => {
                if let Ok(text) = std::str::from_utf8(input) {
                    check_places(&faults, "a.sp", text);
                }
                return false;
            }
        };
        for stage in [StageKind::Vertex, StageKind::Fragment, StageKind::Compute] {
            let stitched = program.stitch(stage, &mut |path| {
                assert!(!path.starts_with('/') && !path.split('/').any(|part| part == ".."));
                Ok(format!("// {path}\nfn é() {{}}\r\n"))
            });
            match stitched {
                Ok(stitched) => {
                    let lines: Vec<&str> = stitched.text.split('\n').collect();
                    assert_eq!(lines.len(), stitched.lines.len());
                    for (number, line) in (1..).zip(lines) {
                        let (_, row, column, source) = stitched.locate(number, 1);
                        assert!(row >= 1);
                        let rest: String = source.chars().skip(column as usize - 1).collect();
                        assert!(rest.starts_with(line), "{rest:?} {line:?}");
                    }
                }
                Err(faults) => check_places(&faults, "a.sp", program.text()),
            }
        }
        true
    });
}

#[test]
fn ron_files() {
    let keys = Keys::load(&[("keys.ron", RON[0])]).unwrap();
    report("ron", Mutator::new(2, &RON, &RON_TOKENS), move |input| {
        let text = String::from_utf8_lossy(input);
        // Each part that ron reads is found in the text.
        assert_ne!(ron_place::is_exact(&text), Some(false));
        let mut accepted = false;
        let mut note = |faults: Option<Diags>| match faults {
            Some(faults) => check_places(&faults, "a.ron", &text),
            None => accepted = true,
        };
        note(Keys::load(&[("a.ron", &text)]).err());
        let preset = Preset::parse(&keys, "a", "a.ron", &text);
        let scene = Scene::parse(&keys, "a", "a.ron", &text);
        let view = View::parse("a", "a.ron", &text);
        if let Ok(view) = &view {
            assert!((1.0..=170.0).contains(&view.fov_deg) && view.place.0.is_finite());
        }
        if preset.is_ok() {
            let files = [
                ("a", "a.ron", &*text),
                ("base", "base.ron", RON[1]),
                ("low", "low.ron", RON[2]),
            ];
            if let Ok(presets) = Presets::load(&keys, &files) {
                let settings = resolve(&keys, &presets, "a", scene.as_ref().ok(), &[]).unwrap();
                for (name, value) in &settings.values {
                    assert_eq!(keys.check(name, value), Ok(()));
                }
            }
        }
        if let Ok(scene) = &scene {
            for (name, value) in &scene.content {
                assert_eq!(keys.check(name, value), Ok(()));
            }
        }
        note(preset.err());
        note(scene.err());
        note(view.err());
        accepted
    });
}

#[test]
fn module_headers() {
    report("headers", Mutator::new(3, &WGSL, &WGSL_TOKENS), |input| {
        let text = String::from_utf8_lossy(input);
        match parse_headers("a.wgsl", &text) {
            Ok(headers) => {
                assert!(!headers.title.is_empty() && !headers.sources.is_empty());
                for function in &headers.functions {
                    let header = &function.header;
                    assert!(header.internal || (header.range.is_some() && header.error.is_some()));
                }
                true
            }
            Err(faults) => {
                check_places(&faults, "a.wgsl", &text);
                false
            }
        }
    });
}

#[test]
fn the_same_seed_gives_the_same_inputs() {
    let inputs = |seed| {
        let mut mutator = Mutator::new(seed, &SP, &SP_TOKENS);
        (0..200).map(|_| mutator.next_input()).collect::<Vec<_>>()
    };
    assert_eq!(inputs(7), inputs(7));
    assert_ne!(inputs(7), inputs(8));
    // The numbers that the reference implementation's demonstration prints.
    let mut rng = Pcg::new(42);
    let numbers = [(); 6].map(|()| rng.next_u32());
    assert_eq!(
        numbers,
        [
            0xa15c02b7, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e
        ]
    );
    let mut counts = [0usize; 5];
    for _ in 0..50_000 {
        counts[rng.below(5)] += 1;
    }
    assert!(
        counts.iter().all(|n| n.abs_diff(10_000) < 500),
        "{counts:?}"
    );
}

#[test]
fn a_panic_and_a_hang_are_found() {
    let mutator = || Mutator::new(4, &["seed"], &["boom"]);
    let found = run(100_000, mutator(), LIMIT, |input| {
        // Resumed without the hook, which would print the panic of this test.
        if input.starts_with(b"boom") {
            std::panic::resume_unwind(Box::new("boom"));
        }
        true
    });
    let failure = found.unwrap_err();
    assert!(failure.input.starts_with(b"boom"));
    assert!(
        failure.to_string().contains("panic: boom\nboom"),
        "{failure}"
    );

    let found = run(10, mutator(), Duration::from_millis(50), |_| {
        std::thread::sleep(Duration::from_secs(5));
        true
    });
    let failure = found.unwrap_err();
    assert_eq!(
        (failure.index, failure.what.as_str()),
        (0, "no end after 50ms")
    );
}
