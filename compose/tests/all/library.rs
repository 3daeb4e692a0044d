//! Reading folders of modules: order, cycles, clashes.

use std::path::{Path, PathBuf};

use veduta_compose::Library;

fn load(files: &[(&str, &str)]) -> Result<Library, String> {
    Library::from_sources(
        files
            .iter()
            .map(|(file, text)| (file.to_string(), text.to_string()))
            .collect(),
    )
    .map_err(|diags| diags.to_string())
}

#[test]
fn modules_come_after_what_they_import() {
    let files = [
        ("c.wgsl", "#define_import_path z::c\nconst C: f32 = 1.0;"),
        (
            "b.wgsl",
            "#define_import_path m::b\n#import z::c::C\nfn b() -> f32 { return C; }",
        ),
        (
            "a.wgsl",
            "#define_import_path a::a\n#import m::b::{b}\n#import z::c::{C}\nfn a() -> f32 { return b() + C; }",
        ),
        ("piece.wgsl", "const PIECE: f32 = 1.0;"),
    ];
    let library = load(&files).unwrap();
    assert_eq!(library.order(), ["z::c", "m::b", "a::a"]);
    let reached: Vec<&str> = library
        .reached(["m::b"])
        .iter()
        .map(|module| module.path.as_str())
        .collect();
    assert_eq!(reached, ["z::c", "m::b"]);
    assert!(library.get("piece").is_none());
    let mut turned = files;
    turned.reverse();
    assert_eq!(load(&turned).unwrap().order(), library.order());
}

#[test]
fn a_cycle_is_named() {
    let error = load(&[
        (
            "a.wgsl",
            "#define_import_path a\n#import b::b\nfn a() { b(); }",
        ),
        (
            "b.wgsl",
            "#define_import_path b\n#import c::c\nfn b() { c(); }",
        ),
        (
            "c.wgsl",
            "#define_import_path c\n#import a::a\nfn c() { a(); }",
        ),
    ])
    .unwrap_err();
    assert_eq!(
        error,
        "c.wgsl:2:9: import cycle: a -> b -> c -> a\n#import a::a\n        ^"
    );
    let error = load(&[(
        "a.wgsl",
        "#define_import_path a\n#import a::a\nfn a() { a(); }",
    )])
    .unwrap_err();
    assert_eq!(
        error,
        "a.wgsl:2:9: import cycle: a -> a\n#import a::a\n        ^"
    );
}

#[test]
fn one_path_in_two_files_is_a_clash() {
    let error = load(&[
        ("one/a.wgsl", "#define_import_path t::a"),
        ("two/a.wgsl", "// Mine.\n#define_import_path t::a"),
    ])
    .unwrap_err();
    assert_eq!(
        error,
        "two/a.wgsl:2:21: module `t::a` exists twice\n#define_import_path t::a\n                    ^\nnote: the other one is one/a.wgsl:1:21"
    );
}

#[test]
fn a_misspelt_path_directive_is_no_silent_piece() {
    let error = load(&[("a.wgsl", "#define_import_pth t::a\nfn a() {}")]).unwrap_err();
    assert_eq!(
        error,
        "a.wgsl:1:1: unknown directive `#define_import_pth`\n#define_import_pth t::a\n^\nnote: did you mean `#define_import_path`?"
    );
    let error = load(&[("a.wgsl", "#define_import_path\nfn a() {}")]).unwrap_err();
    assert_eq!(
        error,
        "a.wgsl:1:1: `#define_import_path` without a path\n#define_import_path\n^"
    );
    let error = load(&[("a.wgsl", "#define_import_path t.a\nfn a() {}")]).unwrap_err();
    assert_eq!(
        error,
        "a.wgsl:1:22: a module's path is names joined by `::`, for instance `veduta::noise::value`\n#define_import_path t.a\n                     ^"
    );
}

#[test]
fn too_many_ways_through_the_imports_are_refused() {
    let mut files = vec![(
        "m0.wgsl".to_owned(),
        "#define_import_path t::m0\nconst A: f32 = 1.0;\n".to_owned(),
    )];
    for n in 1..40 {
        let imports: String = (0..n)
            .map(|k| format!("#import t::m{k}::{{A as a{k}}}\n"))
            .collect();
        files.push((
            format!("m{n}.wgsl"),
            format!("#define_import_path t::m{n}\n{imports}const A: f32 = 1.0;\n"),
        ));
    }
    let error = Library::from_sources(files).unwrap_err();
    let first = error.0[0].to_string();
    assert!(
        first.starts_with("m18.wgsl:1:21: the imports of this module lead to other modules in more than 131072 ways"),
        "{first}"
    );
    assert_eq!(error.0.len(), 1);
}

#[test]
fn limits_of_the_linker() {
    let long = format!("#define_import_path t::a\n// {}\n", "x".repeat(1 << 20));
    let error = load(&[("a.wgsl", &long)]).unwrap_err();
    assert!(
        error.starts_with(
            "a.wgsl:1:21: a module of 1048605 bytes is longer than the limit of 1048576"
        ),
        "{error}"
    );
}

#[test]
fn folders_are_read_with_their_folders() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("library");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("deep/er")).unwrap();
    std::fs::write(
        folder.join("deep/er/a.wgsl"),
        "\u{feff}#define_import_path t::a\r\nconst A: f32 = 1.0;\r\n",
    )
    .unwrap();
    std::fs::write(folder.join("b.wgsl"), "#define_import_path t::b\n").unwrap();
    std::fs::write(folder.join("note.txt"), "#define_import_path t::c\n").unwrap();
    let library = Library::load(std::slice::from_ref(&folder)).unwrap();
    assert_eq!(library.order(), ["t::a", "t::b"]);

    std::fs::write(folder.join("c.wgsl"), b"// \xff\n").unwrap();
    let error = Library::load(&[folder.clone(), PathBuf::from("no/such/folder")])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("c.wgsl: is not UTF-8 after byte 3"),
        "{error}"
    );
    assert!(
        error.contains("no/such/folder: cannot be read: "),
        "{error}"
    );
}
