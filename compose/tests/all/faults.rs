//! Every fault class: its exact message, at its exact place.

use std::collections::{BTreeMap, BTreeSet};

use veduta_compose::{Composer, Diags, Keys, Library};

const KEYS: &str = r#"[
    (name: "WATER", type: "flag", kind: "quality", default: false, unit: "1", meaning: "Water."),
    (name: "CLOUDS", type: "flag", kind: "quality", default: false, unit: "1", meaning: "Clouds."),
    (name: "TILE", type: "size", kind: "quality", domain: (1, 256), default: 8, unit: "1", meaning: "Tile."),
    (name: "STEPS", type: "i32", kind: "quality", domain: (1, 4096), default: 16, unit: "1", meaning: "Steps."),
    (name: "REACH", type: "f32", kind: "quality", domain: (1.0, 4096.0), default: 16.5, unit: "m", meaning: "Reach."),
    (name: "COVER", type: "f32", kind: "content", domain: (0.0, 1.0), default: 0.5, unit: "1", meaning: "Cover."),
]"#;

/// A project in memory: `.wgsl` modules and one `.sp` program.
pub struct Project {
    files: Vec<(String, String)>,
    caps: naga::valid::Capabilities,
}

impl Project {
    pub fn new(files: &[(&str, &str)]) -> Self {
        Self {
            files: files
                .iter()
                .map(|(file, text)| (file.to_string(), text.to_string()))
                .collect(),
            caps: naga::valid::Capabilities::empty(),
        }
    }

    /// Loads, checks all modules, composes all programs with the features.
    pub fn run(&self, features: &[&str]) -> Result<Vec<veduta_compose::Composed>, Diags> {
        let modules = self
            .files
            .iter()
            .filter(|(file, _)| file.ends_with(".wgsl"))
            .cloned()
            .collect();
        let library = Library::from_sources(modules)?;
        let keys = Keys::load(&[("keys.ron", KEYS)])?;
        let files: BTreeMap<String, String> = self.files.iter().cloned().collect();
        let mut composer = Composer::new(&library, keys)
            .claim(self.caps)
            .reader(Box::new(move |path| {
                files
                    .get(path)
                    .cloned()
                    .ok_or_else(|| std::io::ErrorKind::NotFound.into())
            }));
        let mut diags = composer.check_modules();
        let mut out = Vec::new();
        let features: BTreeSet<String> = features.iter().map(|f| f.to_string()).collect();
        for (file, text) in self.files.iter().filter(|(file, _)| file.ends_with(".sp")) {
            let outcome = veduta_compose::sp::parse(file, text)
                .and_then(|sp| composer.compose(&sp, &features, &BTreeMap::new()));
            match outcome {
                Ok(composed) => out.push(composed),
                Err(found) => diags.append(found),
            }
        }
        diags.ok(out)
    }
}

/// A module at `m.wgsl` with path `t::m` whose fourth line is the given text.
fn module(body: &str) -> String {
    format!("// A module.\n#define_import_path t::m\n\n{body}\n")
}

const HEIGHT: &str = "#define_import_path veduta::terrain::height\n\nvirtual fn height(x: f32) -> f32 { return x; }\nfn slope(x: f32) -> f32 { return height(x + 1.0) - height(x); }\n";

const USED: &str = "#define_import_path t::used\n\nconst LIMIT: f32 = 2.5;\nstruct Pair { left: f32, right: f32 }\nfn gain(x: f32) -> f32 { return x * LIMIT; }\nfn offset(x: f32) -> f32 { return x + LIMIT; }\n";

/// A compute program at `p.sp`: line 3 is the first of the body, an entry point follows it.
fn program(body: &str) -> String {
    format!(
        "#PROGRAM{{ p }}#\n#COMPUTE{{ #CODE{{\n{body}\n@group(0) @binding(0) var<storage, read_write> out: array<f32>;\n@compute @workgroup_size(64)\nfn main(@builtin(global_invocation_id) id: vec3u) {{ out[id.x] = value(id.x); }}\n}}# }}#\n"
    )
}

fn faults(files: &[(&str, &str)], features: &[&str]) -> String {
    match Project::new(files).run(features) {
        Ok(_) => "no fault".to_owned(),
        Err(diags) => diags.to_string(),
    }
}

/// Runs the cases of a golden file (`== name`, the text, `-- says`, what the user reads). With `VEDUTA_BLESS=1` the
/// findings are written into the file instead; look at the difference before you commit it.
fn check(file: &str, least: usize, run: impl Fn(&str) -> String) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/faults")
        .join(file);
    let golden = std::fs::read_to_string(&path).unwrap();
    let mut blessed = String::new();
    let mut wrong = String::new();
    let mut count = 0;
    let golden = format!("\n{golden}");
    for case in golden.split("\n== ").filter(|case| !case.trim().is_empty()) {
        let (name, rest) = case.split_once('\n').unwrap();
        let (text, wanted) = rest.split_once("-- says").unwrap();
        let text = text.strip_suffix('\n').unwrap();
        let found = run(text);
        count += 1;
        blessed.push_str(&format!("== {name}\n{text}\n-- says\n{found}\n"));
        if found.trim() != wanted.trim() {
            wrong.push_str(&format!(
                "== {name}\n-- found\n{found}\n-- wanted\n{}\n",
                wanted.trim()
            ));
        }
    }
    assert!(count >= least, "{file} has {count} cases");
    if std::env::var_os("VEDUTA_BLESS").is_some() {
        std::fs::write(path, blessed).unwrap();
    } else {
        assert!(wrong.is_empty(), "{wrong}");
    }
}

#[test]
fn faults_of_modules() {
    check("modules.txt", 11, |text| {
        faults(&[("m.wgsl", &module(text)), ("used.wgsl", USED)], &[])
    });
}

#[test]
fn faults_of_programs() {
    check("programs.txt", 11, |text| {
        faults(
            &[
                ("p.sp", &program(text)),
                ("used.wgsl", USED),
                ("height.wgsl", HEIGHT),
            ],
            &["WATER"],
        )
    });
}

#[test]
fn faults_of_stages() {
    check("stages.txt", 11, |text| {
        let piece = "const PIECE: f32 = 1.0;\nfn piece() -> f32 { return PIECE + missing; }\n";
        faults(
            &[("p.sp", text), ("used.wgsl", USED), ("piece.wgsl", piece)],
            &[],
        )
    });
}

/// What is wrong with presets and scenes only when a whole project is built. Each `@ FILE` line begins a file of it.
#[test]
fn faults_of_builds() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("fault_builds");
    check("builds.txt", 4, |text| {
        let _ = std::fs::remove_dir_all(&folder);
        let write = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        write("presets/keys.ron", KEYS);
        std::fs::create_dir_all(folder.join("presets/scenes")).unwrap();
        let mut variant = None;
        for file in format!("\n{text}\n").split("\n@ ").skip(1) {
            let (name, text) = file.split_once('\n').unwrap_or((file, ""));
            match name.strip_prefix("variant ") {
                Some(features) => variant = Some(features.to_owned()),
                None => write(name, text),
            }
        }
        let mut build =
            veduta_compose::Build::of_veduta(folder.join("wgsl"), folder.join("presets"));
        if let Some(features) = &variant {
            let features: Vec<&str> = features.split_whitespace().collect();
            build = build.variant("p", features);
        }
        let prefix = format!("{}/", folder.display()).replace('\\', "/");
        match build.run() {
            Ok(output) => {
                let texts = output.programs.iter().map(|p| {
                    let size = p.stages[0].entry_points[0].workgroup_size;
                    format!("{:?} {size:?}", p.features)
                });
                format!("no fault\n{}", texts.collect::<Vec<_>>().join("\n"))
            }
            Err(diags) => diags.to_string().replace(&prefix, ""),
        }
    });
}

#[test]
fn headers_are_linted() {
    let run = |text: &str, required: bool| {
        let library = Library::from_sources(vec![("m.wgsl".to_owned(), text.to_owned())]).unwrap();
        Composer::new(&library, Keys::default())
            .require_headers(required)
            .check_modules()
            .to_string()
    };
    let bare = "#define_import_path t::m\nfn f() -> f32 { return 1.0; }\n";
    assert_eq!(run(bare, false), "");
    let error = run(bare, true);
    assert!(
        error.contains("m.wgsl:2:4: function `f` has no header"),
        "{error}"
    );
    // Who starts with a header must do it well.
    let titled = format!("//! A module.\n//! source  ours\n{bare}");
    assert!(run(&titled, false).contains("m.wgsl:4:4: function `f` has no header"));
}
