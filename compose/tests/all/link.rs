//! Linking: what comes out, and where faults are located.

use veduta_compose::{Def, Defs, Library, LinkInput, Linker, finish};

fn library(files: &[(&str, &str)]) -> Library {
    Library::from_sources(
        files
            .iter()
            .map(|(file, text)| (file.to_string(), text.to_string()))
            .collect(),
    )
    .unwrap()
}

const HASH: (&str, &str) = (
    "hash.wgsl",
    "// A hash.\n#define_import_path t::hash\n\nconst PRIME: u32 = 747796405u;\nconst OTHER: u32 = 5u;\n\n/// Mixes.\nfn pcg(x: u32) -> u32 {\n    return (x * PRIME) ^ (x >> 3u);\n}\n\nfn unused(x: u32) -> u32 { return x; }\n",
);
const NOISE: (&str, &str) = (
    "noise.wgsl",
    "#define_import_path t::noise\n#import t::hash::{pcg}\n\nstruct Lattice { cell: vec3i, frac: vec3f }\n\nfn noise(x: u32) -> f32 {\n#ifdef WATER\n    return 0.0;\n#else\n    return f32(pcg(x) >> 8u) / 16777216.0;\n#endif\n}\n",
);

#[test]
fn links_and_strips() {
    let library = library(&[HASH, NOISE]);
    let mut linker = Linker::new(&library);
    let text = "#import t::noise::noise\n@group(0) @binding(0) var<storage, read_write> out: array<f32>;\n@compute @workgroup_size(#{TILE})\nfn main(@builtin(global_invocation_id) id: vec3u) { out[id.x] = noise(id.x); }\n";
    let mut defs = Defs::new();
    defs.insert("TILE".into(), Def::Int(64));
    let link = |linker: &mut Linker, defs: &Defs| {
        let module = linker
            .link(&LinkInput {
                text,
                file: "main.wgsl",
                defs,
                plug_ins: &[],
            })
            .unwrap_or_else(|diags| panic!("{diags}"));
        finish(module, naga::valid::Capabilities::empty())
            .unwrap()
            .wgsl
    };
    let wgsl = link(&mut linker, &defs);
    assert_eq!(
        wgsl,
        "const PRIME: u32 = 747796405u;\n\n@group(0) @binding(0) \nvar<storage, read_write> out: array<f32>;\n\nfn pcg(x: u32) -> u32 {\n    return ((x * PRIME) ^ (x >> 3u));\n}\n\nfn noise(x_1: u32) -> f32 {\n    let _e1 = pcg(x_1);\n    return (f32((_e1 >> 8u)) / 16777216f);\n}\n\n@compute @workgroup_size(64, 1, 1) \nfn main(@builtin(global_invocation_id) id: vec3<u32>) {\n    let _e5 = noise(id.x);\n    out[id.x] = _e5;\n    return;\n}\n"
    );
    defs.insert("WATER".into(), Def::Flag);
    let wgsl = link(&mut linker, &defs);
    assert!(
        wgsl.contains("return 0f;") && !wgsl.contains("PRIME"),
        "{wgsl}"
    );
}

#[test]
fn imports_in_branches_that_exclude_each_other() {
    let library = library(&[
        HASH,
        (
            "other.wgsl",
            "#define_import_path t::other\nfn pcg(x: u32) -> u32 { return x + 77u; }\n",
        ),
        (
            "either.wgsl",
            "#define_import_path t::either\n#ifdef WATER\n#import t::other::{pcg}\n#else\n#import t::hash::{pcg}\n#endif\nfn either(x: u32) -> u32 { return pcg(x); }\n",
        ),
    ]);
    let mut composer =
        veduta_compose::Composer::new(&library, veduta_compose::Keys::default()).flags(["WATER"]);
    assert_eq!(composer.check_modules().to_string(), "");
    let text =
        "#import t::either::{either}\n@compute @workgroup_size(1) fn main() { _ = either(1u); }";
    let mut link = |defs: &Defs| {
        let module = composer
            .linker()
            .link(&LinkInput {
                text,
                file: "main.wgsl",
                defs,
                plug_ins: &[],
            })
            .unwrap_or_else(|diags| panic!("{diags}"));
        finish(module, naga::valid::Capabilities::empty())
            .unwrap()
            .wgsl
    };
    let (dry, wet) = (Defs::new(), Defs::from([("WATER".to_owned(), Def::Flag)]));
    let first = link(&dry);
    assert!(first.contains("PRIME") && !first.contains("77u"), "{first}");
    let second = link(&wet);
    assert!(
        second.contains("77u") && !second.contains("PRIME"),
        "{second}"
    );
    assert_eq!(first, link(&dry));
}

/// What WGSL and the preprocessor are made of.
const TOKENS: [&str; 64] = [
    "#import ",
    "fixture::waves::{Wave, wave}",
    "fixture::waves::",
    "t::noise::noise",
    "::",
    "*",
    " as ",
    "{",
    "}",
    "(",
    ")",
    "#ifdef WATER\n",
    "#ifndef LOW_QUALITY\n",
    "#if TILE == 8\n",
    "#else\n",
    "#else ifdef WATER\n",
    "#endif\n",
    "#define N 5\n",
    "#{TILE}",
    "#{",
    "#define_import_path fixture::other\n",
    "virtual ",
    "override ",
    "override fn wave",
    "fn f() {",
    "struct ",
    "const A: f32 = ",
    "const B = 3.5;",
    "alias Real = f32;",
    "var<private> p: f32;",
    "@group(0) @binding(0) ",
    "@binding(auto)",
    "@workgroup_size(8)",
    "@compute ",
    "@fragment ",
    "@diagnostic(off, derivative_uniformity)",
    "enable f16;",
    "enable subgroups;",
    "requires x;",
    "diagnostic(off, x);",
    "&a[1]",
    "&s.x",
    "vec3<f32>(",
    "1.0",
    "1e39",
    "0x1p-3",
    "4294967296u",
    "array<f32, 4>",
    "textureSample(",
    "dpdx(",
    "atomicAdd(&",
    "return ",
    ";",
    ",",
    "/*",
    "*/",
    "//",
    "\n",
    "X_naga_oil_mod_XMFX",
    "p0",
    "__",
    "loop {}",
    "for (var i = 0; i < 4; i++) {",
    "if true {",
];

/// Mutated modules and programs: no panic, no hang, every fault at a place that exists.
#[test]
fn mutated_links() {
    let inputs = match std::env::var("VEDUTA_FUZZ_LINKS") {
        Ok(text) => text.parse().unwrap(),
        Err(_) => 500,
    };
    let waves = include_str!("../fixtures/project/shaders/waves.wgsl");
    let lake = include_str!("../fixtures/project/shaders/lake.sp");
    let count = include_str!("../fixtures/project/shaders/count.sp");
    let keys = include_str!("../fixtures/project/presets/keys.ron");
    let corpus = [waves, lake, count, HASH.1, NOISE.1];
    let mutator = veduta_compose::fuzz::Mutator::new(7, &corpus, &TOKENS);
    let keys = veduta_compose::Keys::load(&[("keys.ron", keys)]).unwrap();
    let features = ["WATER".to_owned()].into();
    let limit = std::time::Duration::from_secs(30);
    let report = veduta_compose::fuzz::run(inputs, mutator, limit, move |input| {
        let Ok(text) = std::str::from_utf8(input) else {
            return false;
        };
        let is_program = text.contains("#PROGRAM");
        let (module, program) = if is_program {
            (waves, text)
        } else if text.contains("fixture::waves") {
            (text, lake)
        } else {
            (text, count)
        };
        let outcome = compose_texts(&keys, &features, module, program);
        match outcome {
            Ok(composed) => {
                assert!(
                    composed
                        .stages
                        .iter()
                        .all(|stage| !stage.wgsl.contains("naga_oil"))
                );
                true
            }
            Err(faults) => {
                assert!(!faults.is_empty());
                for fault in faults.iter() {
                    let text = match fault.file.as_str() {
                        "program.sp" => program,
                        "module.wgsl" => module,
                        _ => continue,
                    };
                    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
                    assert!(!fault.message.is_empty(), "{fault:?}");
                    if fault.line == 0 {
                        continue;
                    }
                    let line = veduta_compose::diag::line_at(text, fault.line);
                    assert_eq!(line, fault.source_line, "{fault}");
                    let length = line.chars().count();
                    assert!(
                        fault.column >= 1 && fault.column as usize <= length + 1,
                        "{fault:?}"
                    );
                }
                false
            }
        }
    })
    .unwrap_or_else(|failure| panic!("{failure}"));
    println!("{report:?}");
    assert_eq!(report.inputs, inputs);
    assert!(report.accepted > inputs / 100, "{report:?}");
    assert!(report.accepted < inputs - inputs / 100, "{report:?}");
}

fn compose_texts(
    keys: &veduta_compose::Keys,
    features: &std::collections::BTreeSet<String>,
    module: &str,
    program: &str,
) -> Result<veduta_compose::Composed, veduta_compose::Diags> {
    let library = Library::from_sources(vec![
        ("module.wgsl".to_owned(), module.to_owned()),
        (HASH.0.to_owned(), HASH.1.to_owned()),
    ])?;
    let mut composer = veduta_compose::Composer::new(&library, keys.clone());
    composer.check_modules().ok(())?;
    let sp = veduta_compose::sp::parse("program.sp", program)?;
    composer.compose(&sp, features, &std::collections::BTreeMap::new())
}
