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
    "//! A hash.\n#define_import_path t::hash\n\nconst PRIME: u32 = 747796405u;\nconst OTHER: u32 = 5u;\n\n/// Mixes.\nfn pcg(x: u32) -> u32 {\n    return (x * PRIME) ^ (x >> 3u);\n}\n\nfn unused(x: u32) -> u32 { return x; }\n",
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
