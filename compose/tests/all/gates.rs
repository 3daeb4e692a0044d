//! What passes the gates is accepted by others too; what the writer would lose comes back; panics are faults.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use naga::valid::Capabilities;
use veduta_compose::gate::{Target, Written, write_target};
use veduta_compose::{Build, Composed, Composer, Diags, Keys, Library};

fn fixture(path: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(path)
}

/// Composes one program over some modules, without keys.
fn compose(
    modules: &[(&str, &str)],
    program: &str,
    caps: Capabilities,
    plug_ins: &[&str],
) -> Result<Composed, Diags> {
    let library = Library::from_sources(
        modules
            .iter()
            .map(|(file, text)| (file.to_string(), text.to_string()))
            .collect(),
    )?;
    let mut composer = Composer::new(&library, Keys::default())
        .claim(caps)
        .plug_ins(plug_ins.iter().map(|p| p.to_string()).collect());
    let faults = composer.check_modules();
    faults.ok(())?;
    let sp = veduta_compose::sp::parse("p.sp", program)?;
    composer.compose(&sp, &BTreeSet::new(), &BTreeMap::new())
}

fn compute(body: &str) -> String {
    format!(
        "#PROGRAM{{ p }}#\n#COMPUTE{{ #CODE{{\n{body}\n@group(0) @binding(0) var<storage, read_write> out: array<f32>;\n@compute @workgroup_size(64)\nfn main(@builtin(global_invocation_id) id: vec3u) {{ out[id.x] = value(id.x); }}\n}}# }}#\n"
    )
}

fn wgsl(composed: Result<Composed, Diags>) -> String {
    composed.unwrap_or_else(|diags| panic!("{diags}")).stages[0]
        .wgsl
        .clone()
}

/// Whether a tool that the tests need is there; skipped only on demand.
fn tool(name: &str, package: &str, skip: &str) -> bool {
    if std::env::var(skip).is_ok_and(|value| value == "1") {
        eprintln!("{skip}=1: {name} is not asked");
        return false;
    }
    let found = Command::new(name)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok();
    assert!(
        found,
        "{name} is missing: `apt-get install {package}` (or {skip}=1 to do without)"
    );
    true
}

#[test]
fn spirv_val_accepts_what_is_composed() {
    if !tool("spirv-val", "spirv-tools", "VEDUTA_NO_SPIRV_VAL") {
        return;
    }
    let output = Build::of_veduta(fixture("project/shaders"), fixture("project/presets"))
        .run()
        .unwrap_or_else(|diags| panic!("{diags}"));
    let mut checked = BTreeSet::new();
    for program in &output.programs {
        for stage in &program.stages {
            if !checked.insert(&stage.wgsl) {
                continue;
            }
            let words = match write_target(&stage.wgsl, Target::Spirv, Capabilities::empty()) {
                Ok(words @ Written::Words(_)) => words.into_bytes(),
                other => panic!("{other:?}"),
            };
            assert_eq!(&words[..4], &[0x03, 0x02, 0x23, 0x07]);
            let mut child = Command::new("spirv-val")
                .args(["--target-env", "vulkan1.1", "-"])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            child.stdin.take().unwrap().write_all(&words).unwrap();
            let done = child.wait_with_output().unwrap();
            assert!(
                done.status.success(),
                "{} {:?}: {}{}\n{}",
                program.program,
                program.features,
                String::from_utf8_lossy(&done.stdout),
                String::from_utf8_lossy(&done.stderr),
                stage.wgsl
            );
        }
    }
    assert_eq!(checked.len(), 5);
}

#[test]
fn every_target_is_written() {
    let text = wgsl(compose(
        &[],
        &compute("fn value(i: u32) -> f32 { return f32(i); }"),
        Capabilities::empty(),
        &[],
    ));
    for (target, part) in [
        (Target::Wgsl, "@workgroup_size(64, 1, 1)"),
        (Target::Hlsl, "[numthreads(64, 1, 1)]"),
        (Target::Hlsl51, "[numthreads(64, 1, 1)]"),
        (Target::Msl, "kernel void"),
    ] {
        match write_target(&text, target, Capabilities::empty()) {
            Ok(Written::Text(out)) => assert!(out.contains(part), "{out}"),
            other => panic!("{other:?}"),
        }
    }
    let error = write_target("fn f() { return 1; }", Target::Spirv, Capabilities::empty());
    assert!(error.is_err());
}

#[test]
fn panics_of_writers_are_faults() {
    // naga validates this, and then its SPIR-V writer panics.
    let text = "fn assign(p: ptr<function, f32>) { *p = 1.0; }\n@compute @workgroup_size(1) fn main() { var a: array<f32, 4>; assign(&a[1]); }";
    let error = write_target(text, Target::Spirv, Capabilities::empty()).unwrap_err();
    assert!(error.starts_with("the SPIR-V writer panicked: "), "{error}");
}

#[test]
fn half_precision_is_enabled_again() {
    let f16 = Capabilities::SHADER_FLOAT16;
    // In literals only, where naga's writer does not see it; in a module; in types.
    let literal = "enable f16;\nfn value(i: u32) -> f32 { return f32(f16(i) + 0.5h); }";
    let module = (
        "half.wgsl",
        "enable f16;\n#define_import_path t::half\n\nstruct Half { x: f16 }\nfn halve(x: f32) -> f32 { return f32(f16(x) * 0.5h); }\nfn make(x: f32) -> Half { return Half(f16(x)); }\n",
    );
    let imported = "enable f16;\n#import t::half::{halve, make}\nfn value(i: u32) -> f32 { return halve(1.0) + f32(make(1.0).x); }";
    for body in [literal, imported] {
        let text = wgsl(compose(&[module], &compute(body), f16, &[]));
        assert!(text.starts_with("enable f16;"), "{text}");
        assert_eq!(text.matches("enable f16;").count(), 1, "{text}");
    }
    // Without the directive there is no half precision.
    let text = wgsl(compose(
        &[module],
        &compute("fn value(i: u32) -> f32 { return 1.0; }"),
        f16,
        &[],
    ));
    assert!(!text.contains("f16"), "{text}");
}

#[test]
fn directives_are_kept() {
    let text = wgsl(compose(
        &[],
        &compute(
            "diagnostic(off,\n derivative_uniformity);\nrequires readonly_and_readwrite_storage_textures;\nfn value(i: u32) -> f32 { return 1.0; }",
        ),
        Capabilities::empty(),
        &[],
    ));
    assert!(
        text.starts_with("diagnostic(off, derivative_uniformity);\nrequires readonly_and_readwrite_storage_textures;\n\n"),
        "{text}"
    );
}

#[test]
fn subgroup_operations_need_a_claim() {
    let program = compute("fn value(i: u32) -> f32 { return subgroupAdd(f32(i)); }");
    let error = compose(&[], &program, Capabilities::empty(), &[])
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("p.sp:3:"), "{error}");
    let text = wgsl(compose(&[], &program, Capabilities::SUBGROUP, &[]));
    assert!(text.contains("subgroupAdd"));
}

const HEIGHT: (&str, &str) = (
    "height.wgsl",
    "#define_import_path veduta::terrain::height\n\nvirtual fn height(x: f32) -> f32 { return x; }\nfn slope(x: f32) -> f32 { return height(x + 1.0) - height(x); }\n",
);
const STEEP: (&str, &str) = (
    "steep.wgsl",
    "#define_import_path mine::steep\n#import veduta::terrain::height::{height}\n\nconst FACTOR: f32 = 7.5;\noverride fn height(x: f32) -> f32 { return height(x) * FACTOR; }\n",
);

#[test]
fn a_height_function_is_plugged_in() {
    let plain =
        "#import veduta::terrain::height::{slope}\nfn value(i: u32) -> f32 { return slope(1.0); }";
    let of = |body: &str, plug_ins: &[&str]| {
        wgsl(compose(
            &[HEIGHT, STEEP],
            &compute(body),
            Capabilities::empty(),
            plug_ins,
        ))
    };
    assert!(!of(plain, &[]).contains("FACTOR"));
    // By the build, by an import for its effect, in the program itself.
    let by_build = of(plain, &["mine::steep"]);
    assert!(by_build.contains("const FACTOR: f32 = 7.5f;"), "{by_build}");
    let by_import = of(&format!("#import mine::steep\n{plain}"), &[]);
    assert_eq!(by_build, by_import);
    let by_program = of(
        "#import veduta::terrain::height::{height, slope}\noverride fn height(x: f32) -> f32 { return 3.5; }\nfn value(i: u32) -> f32 { return slope(1.0); }",
        &[],
    );
    assert!(by_program.contains("3.5f"), "{by_program}");
    // A program that does not reach the height function is left alone.
    let other = of("fn value(i: u32) -> f32 { return 1.0; }", &["mine::steep"]);
    assert!(!other.contains("FACTOR"), "{other}");
}

#[test]
fn names_that_clash_stay_readable() {
    let march = |topic: &str, value: &str| {
        (
            format!("{topic}.wgsl"),
            format!(
                "#define_import_path t::{topic}::march\n\nstruct Hit {{ distance: f32 }}\nconst LIMIT: f32 = {value};\nfn limit(x: f32) -> f32 {{ return x * LIMIT; }}\nfn march(x: f32) -> Hit {{ return Hit(limit(x)); }}\n"
            ),
        )
    };
    let (a, b) = (march("air", "1.5"), march("sea", "2.5"));
    let text = wgsl(compose(
        &[(&a.0, &a.1), (&b.0, &b.1)],
        &compute(
            "#import t::air::march::{march as march_air}\n#import t::sea::march::{march as march_sea}\nfn value(i: u32) -> f32 { return march_air(1.0).distance + march_sea(1.0).distance; }",
        ),
        Capabilities::empty(),
        &[],
    ));
    for name in ["struct Hit {", "fn march(", "const LIMIT:", "fn limit("] {
        assert_eq!(text.matches(name).count(), 1, "{name} in\n{text}");
    }
    assert!(
        !text.contains("naga_oil") && !text.contains("_1("),
        "{text}"
    );
}

#[test]
fn many_ways_through_the_imports() {
    // Each module imports both of the level before: the number of ways doubles with each level.
    let levels = 14;
    let mut modules = vec![
        (
            "a0.wgsl".to_owned(),
            "#define_import_path t::a0\nfn fa(x: f32) -> f32 { return x; }\n".to_owned(),
        ),
        (
            "b0.wgsl".to_owned(),
            "#define_import_path t::b0\nfn fb(x: f32) -> f32 { return x + 1.0; }\n".to_owned(),
        ),
    ];
    for level in 1..levels {
        for side in ["a", "b"] {
            modules.push((
                format!("{side}{level}.wgsl"),
                format!(
                    "#define_import_path t::{side}{level}\n#import t::a{0}::{{fa as left}}\n#import t::b{0}::{{fb as right}}\nfn f{side}(x: f32) -> f32 {{ return left(x) + right(x); }}\n",
                    level - 1
                ),
            ));
        }
    }
    let modules: Vec<(&str, &str)> = modules
        .iter()
        .map(|(f, t)| (f.as_str(), t.as_str()))
        .collect();
    let start = std::time::Instant::now();
    let text = wgsl(compose(
        &modules,
        &compute(&format!(
            "#import t::a{}::{{fa}}\nfn value(i: u32) -> f32 {{ return fa(1.0); }}",
            levels - 1
        )),
        Capabilities::empty(),
        &[],
    ));
    eprintln!("{:?}", start.elapsed());
    assert_eq!(
        text.matches("\nfn ").count(),
        2 * (levels - 1) + 1 + 2 - 1 + 1
    );
}

/// A sampler with which a program only gathers need not filter, nor the texture be filterable, through however many calls.
#[test]
fn gathers_do_not_filter() {
    use veduta_compose::reflect::{BindingType, SampleType};
    let modules = [(
        "m.wgsl",
        "#define_import_path t::m\nfn inner(t: texture_2d<f32>, s: sampler, at: vec2f) -> f32 { return textureGather(0, t, s, at).x; }\n\
         fn gathered(t: texture_2d<f32>, s: sampler, at: vec2f) -> f32 { var sum = 0.0; loop { sum += inner(t, s, at); if sum > 1.0 { break; } } return sum; }\n\
         fn sampled(t: texture_2d<f32>, s: sampler, at: vec2f) -> f32 { if at.x > 0.0 { return textureSampleLevel(t, s, at, 0.0).x; } return 0.0; }\n\
         fn beside(o: texture_2d<f32>, t: texture_2d<f32>, s: sampler, at: vec2f) -> f32 { return sampled(o, s, at) + inner(t, s, at); }\n",
    )];
    let bindings = |call: &str| {
        let name = &call[..call.find('(').unwrap()];
        let body = format!(
            "#import t::m::{{{name}}}\n@group(1) @binding(0) var t: texture_2d<f32>;\n@group(1) @binding(1) var s: sampler;\n@group(1) @binding(2) var other: texture_2d<f32>;\nfn value(k: u32) -> f32 {{ return {call}; }}"
        );
        let composed = compose(&modules, &compute(&body), Capabilities::empty(), &[]);
        let composed = composed.unwrap_or_else(|diags| panic!("{diags}"));
        let of = |name: &str| {
            composed
                .bindings
                .iter()
                .find(|b| b.name == name)
                .unwrap()
                .ty
        };
        (of("t"), of("s"))
    };
    for (call, filters) in [
        ("gathered(t, s, vec2f(f32(k)))", false),
        ("sampled(t, s, vec2f(f32(k)))", true),
        // What is only gathered, with a sampler that filters something else.
        ("beside(other, t, s, vec2f(f32(k)))", true),
    ] {
        let (texture, sampler) = bindings(call);
        assert!(
            matches!(texture, BindingType::Texture { sample: SampleType::Float { filterable }, .. } if filterable == filters),
            "{call}: {texture:?}"
        );
        let expected = BindingType::Sampler {
            comparison: false,
            filtering: filters,
        };
        assert_eq!(sampler, expected, "{call}");
    }
}
