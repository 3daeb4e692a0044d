//! Crates as users write them, built as users build them.
//!
//! The fixtures are copied into the target folder and built there with the profile and the dependencies of this
//! workspace, so that what is compiled already is not compiled again.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use veduta::program::StageKind;
use veduta::{Preset, Settings};

/// Nested builds share the target folder, so that only one runs at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    // Another test's failure leaves nothing behind that this one does not write anew.
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn scratch() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

fn target() -> &'static Path {
    scratch().parent().unwrap()
}

/// What a nested command did.
struct Outcome {
    success: bool,
    stdout: String,
    stderr: String,
}

impl Outcome {
    fn of(command: &mut Command) -> Outcome {
        let output = command.output().unwrap();
        Outcome {
            success: output.status.success(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    #[track_caller]
    fn expect_success(self) -> Outcome {
        assert!(self.success, "{}\n{}", self.stdout, self.stderr);
        self
    }

    /// The packages that Cargo compiled.
    fn compiled(&self) -> BTreeSet<&str> {
        self.stderr
            .lines()
            .filter_map(|l| l.trim_start().strip_prefix("Compiling "))
            .filter_map(|l| l.split(' ').next())
            .collect()
    }
}

/// Runs Cargo in `folder`, from what is on this machine already if that is enough.
fn cargo(folder: &Path, arguments: &[&str]) -> Outcome {
    let run = |more: &[&str]| {
        Outcome::of(
            Command::new(env!("CARGO"))
                .current_dir(folder)
                .args(arguments)
                .args(more)
                .env("CARGO_TARGET_DIR", target())
                .env("CARGO_TERM_COLOR", "never")
                .env_remove("CARGO_BUILD_TARGET_DIR"),
        )
    };
    let offline = run(&["--offline"]);
    if !offline.success && offline.stderr.contains("offline") {
        return run(&[]);
    }
    offline
}

fn build(folder: &Path) -> Outcome {
    cargo(folder, &["build", "--release", "--workspace", "--verbose"])
}

/// Writes a file only if that changes it, so that its time stays.
fn write(path: &Path, text: impl AsRef<[u8]>) {
    if fs::read(path).is_ok_and(|old| old == text.as_ref()) {
        return;
    }
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if path.file_name().unwrap() != "target" {
                all.extend(files(&path));
            }
        } else {
            all.push(path);
        }
    }
    all.sort();
    all
}

/// The path without `..`, with slashes, as TOML takes it.
fn plain(path: &Path) -> String {
    let mut plain = PathBuf::new();
    for part in path.components() {
        if part == Component::ParentDir {
            plain.pop();
        } else {
            plain.push(part);
        }
    }
    plain.display().to_string().replace('\\', "/")
}

/// A manifest whose path dependencies name by absolute paths the folders that they named from `home`.
fn with_absolute_paths(manifest: &str, home: &Path) -> String {
    const KEY: &str = "path = \"";
    let mut text = String::new();
    let mut rest = manifest;
    while let Some((before, after)) = rest.split_once(KEY) {
        let (path, after) = after.split_once('"').unwrap();
        let folder = home.join(path);
        let path = if folder.is_dir() {
            plain(&folder)
        } else {
            path.to_owned()
        };
        text += &format!("{before}{KEY}{path}\"");
        rest = after;
    }
    text + rest
}

/// The sections of a manifest whose headers `wanted` accepts, as they stand there.
fn sections(manifest: &str, wanted: impl Fn(&str) -> bool) -> String {
    let mut text = String::new();
    let mut inside = false;
    for line in manifest.lines() {
        if line.starts_with('[') {
            inside = wanted(line);
        }
        if inside {
            text += line;
            text.push('\n');
        }
    }
    text
}

/// Copies a crate, without what makes it a workspace of its own.
fn copy_crate(from: &Path, to: &Path) {
    let mut kept = BTreeSet::new();
    for file in files(from) {
        let name = file.strip_prefix(from).unwrap();
        if name == Path::new("Cargo.lock") {
            continue;
        }
        let copy = to.join(name);
        kept.insert(copy.clone());
        if name == Path::new("Cargo.toml") {
            let text = with_absolute_paths(&fs::read_to_string(&file).unwrap(), from);
            write(&copy, sections(&text, |header| header != "[workspace]"));
        } else {
            write(&copy, fs::read(&file).unwrap());
        }
    }
    for file in files(to) {
        if !kept.contains(&file) {
            fs::remove_file(file).unwrap();
        }
    }
}

/// Makes a folder a workspace with the profiles, the dependencies and the locked versions of ours.
fn make_workspace(folder: &Path, members: &[&str], more: &str) {
    let ours = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let dependencies = sections(&ours, |h| h == "[workspace.dependencies]");
    // What these crates do takes no time; how long they take to compile matters.
    let quick = ["veduta", "veduta-compose", "veduta-cli"];
    let of = |name: &str| format!("[profile.release.package.{name}]");
    let mut profiles = sections(&ours, |h| {
        h.starts_with("[profile") && !quick.iter().any(|name| h == of(name))
    });
    for name in quick {
        profiles += &format!("\n{}\nopt-level = 0\n", of(name));
    }
    assert!(dependencies.contains("wgpu") && profiles.contains("[profile.release]"));
    write(
        &folder.join("Cargo.toml"),
        format!(
            "[workspace]\nresolver = \"2\"\nmembers = {members:?}\n\n{}\n{profiles}\n{more}",
            with_absolute_paths(&dependencies, root())
        ),
    );
    // Cargo completes the lock file, so that it is laid anew only when ours has changed.
    let lock = fs::read(root().join("Cargo.lock")).unwrap();
    let of_ours = folder.join("Cargo.lock.of-workspace");
    if !fs::read(&of_ours).is_ok_and(|old| old == lock) || !folder.join("Cargo.lock").exists() {
        fs::write(folder.join("Cargo.lock"), &lock).unwrap();
        fs::write(of_ours, &lock).unwrap();
    }
}

/// A crate with the third-party dependencies of the command line, so that every crate has the features that it has in
/// our own build, and none is compiled again.
fn make_warm_crate(folder: &Path) {
    let cli = fs::read_to_string(root().join("cli/Cargo.toml")).unwrap();
    let dependencies = sections(&cli, |h| h == "[dependencies]");
    let package =
        "[package]\nname = \"downstream_warm\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n";
    write(
        &folder.join("warm/Cargo.toml"),
        format!("{package}{dependencies}"),
    );
    write(&folder.join("warm/src/lib.rs"), "//! Nothing.\n");
}

const FIXTURES: [&str; 5] = [
    "feature",
    "named_preset",
    "own_preset",
    "payer",
    "wgpu_alone",
];

/// The fixtures and the stranger's project of the examples, ready to build.
fn lay_out() -> PathBuf {
    let folder = scratch().join("downstream");
    let source = root().join("tests/fixtures/downstream");
    for name in FIXTURES {
        fs::create_dir_all(folder.join(name)).unwrap();
        copy_crate(&source.join(name), &folder.join(name));
    }
    write(
        &folder.join("report.rs"),
        fs::read(source.join("report.rs")).unwrap(),
    );
    fs::create_dir_all(folder.join("own_shader")).unwrap();
    copy_crate(
        &root().join("examples/own_shader"),
        &folder.join("own_shader"),
    );
    make_warm_crate(&folder);
    let members: Vec<&str> = FIXTURES.into_iter().chain(["own_shader", "warm"]).collect();
    make_workspace(&folder, &members, "");
    folder
}

fn program_file(name: &str) -> PathBuf {
    target()
        .join("release")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// What a fixture reports about itself.
struct Report {
    head: String,
    text: String,
    file: Vec<u8>,
}

impl Report {
    fn of(name: &str) -> Report {
        let file = program_file(name);
        let stdout = Outcome::of(&mut Command::new(&file))
            .expect_success()
            .stdout;
        let (head, text) = stdout.split_once("\ntext\n").unwrap();
        Report {
            head: head.to_owned(),
            text: text.strip_suffix('\n').unwrap().to_owned(),
            file: fs::read(file).unwrap(),
        }
    }

    #[track_caller]
    fn says(&self, line: &str) {
        assert!(
            self.head.lines().any(|l| l == line),
            "{line}\n{}",
            self.head
        );
    }

    /// Whether the text stands in the executable, byte by byte.
    fn embeds(&self, text: &str) -> bool {
        let needle = text.as_bytes();
        // Texts are long, so that comparing their first bytes sorts almost everything out.
        self.file
            .windows(needle.len())
            .any(|w| w[..8] == needle[..8] && w == needle)
    }
}

/// The fragment stage that this build has for a shipped preset.
fn shipped_text(preset: Preset) -> String {
    let programs = veduta::programs();
    let settings = Settings::resolve(programs, &preset, Some("thesis"), &[]).unwrap();
    let program = programs.get("landscape", &settings.features()).unwrap();
    program.stage(StageKind::Fragment).unwrap().wgsl.to_string()
}

/// This very build, in either of its two runs.
#[test]
fn the_default_preset_follows_the_cargo_feature() {
    let (wanted, clouds) = if cfg!(feature = "low_quality") {
        (Preset::ThesisLow, false)
    } else {
        (Preset::Thesis, true)
    };
    assert_eq!(Preset::default(), wanted);
    let name = Preset::default().name(veduta::programs()).to_owned();
    assert_eq!(veduta::programs().default_preset, name);
    let text = shipped_text(Preset::default());
    assert_eq!(text, shipped_text(wanted));
    assert_eq!(text.contains("march_clouds"), clouds);
}

#[test]
fn three_ways_of_switching_and_what_a_rebuild_does() {
    let _alone = alone();
    let folder = lay_out();
    let start = Instant::now();
    let built = build(&folder).expect_success();
    println!(
        "fixtures built in {:.1?}; compiled {:?}",
        start.elapsed(),
        built.compiled()
    );

    let normal = shipped_text(Preset::Thesis);
    let low = shipped_text(Preset::ThesisLow);
    assert_ne!(normal, low);
    assert!(normal.contains("march_clouds") && !low.contains("march_clouds"));

    // 1. The Cargo feature. Without it, the default is the other one.
    let feature = Report::of("downstream_feature");
    feature.says("preset thesis_low");
    feature.says("value LOW_QUALITY true");
    assert_eq!(feature.text, low);
    assert!(feature.embeds(&low));
    // See `the_default_preset_follows_the_cargo_feature`.

    // 2. A shipped preset that the user's build.rs names: nothing else is embedded.
    let named = Report::of("downstream_named_preset");
    named.says("preset thesis_low");
    named.says("value OCTAVES 8");
    assert_eq!(named.text, low);
    assert!(named.embeds(&low));
    assert!(
        !named.embeds(&normal),
        "the normal quality is not in the executable"
    );
    assert!(!named.embeds("march_clouds"));

    // 3. A preset file of the user's own.
    let own = Report::of("downstream_own_preset");
    own.says("preset handheld");
    own.says("value OCTAVES 5");
    own.says("value ATMOS_STEPS 7");
    own.says("value LOW_QUALITY true");
    assert!(own.embeds(&own.text) && !own.embeds("march_clouds"));

    stranger_is_rebuilt_when_and_only_when_needed(&folder);
}

fn stranger_is_rebuilt_when_and_only_when_needed(folder: &Path) {
    // Nothing has changed: nothing is compiled, and no build script runs.
    let second = build(folder).expect_success();
    assert_eq!(second.compiled(), BTreeSet::new(), "{}", second.stderr);
    for line in second.stderr.lines().map(str::trim_start) {
        assert!(
            !line.starts_with("Running") && !line.starts_with("Dirty"),
            "{line}"
        );
    }
    for name in ["veduta", "downstream_own_preset", "own_shader"] {
        let fresh = format!("Fresh {name} v");
        assert!(second.stderr.contains(&fresh), "{fresh}\n{}", second.stderr);
    }

    // A value in a preset file: only that crate, and the new value holds.
    let file = folder.join("own_preset/presets/handheld.ron");
    let before = fs::read_to_string(&file).unwrap();
    let after = before.replace("(value: 5,", "(value: 6,");
    assert_ne!(before, after);
    fs::write(&file, after).unwrap();
    let changed = build(folder).expect_success();
    assert_eq!(
        changed.compiled(),
        BTreeSet::from(["downstream_own_preset"]),
        "{}",
        changed.stderr
    );
    Report::of("downstream_own_preset").says("value OCTAVES 6");

    // A shader: only that crate, and the new text is embedded.
    let stranger = || {
        Outcome::of(&mut Command::new(program_file("own_shader")))
            .expect_success()
            .stdout
    };
    let first = stranger();
    let file = folder.join("own_shader/shaders/hills.sp");
    let before = fs::read_to_string(&file).unwrap();
    let after = before.replace("0.75", "0.25");
    assert_ne!(before, after);
    fs::write(&file, &after).unwrap();
    let changed = build(folder).expect_success();
    assert_eq!(
        changed.compiled(),
        BTreeSet::from(["own_shader"]),
        "{}",
        changed.stderr
    );
    assert_ne!(stranger(), first);

    // A mistake in it is a build error with its place.
    let (line, _) = after
        .lines()
        .enumerate()
        .find(|(_, l)| l.contains("gradient_noise_2d"))
        .unwrap();
    fs::write(
        &file,
        after.replace("gradient_noise_2d", "gradient_nose_2d"),
    )
    .unwrap();
    let broken = build(folder);
    assert!(!broken.success);
    let place = format!("hills.sp:{}:", line + 1);
    for part in [
        place.as_str(),
        "`gradient_nose_2d`",
        "did you mean `gradient_noise_2d`?",
    ] {
        assert!(broken.stderr.contains(part), "{part}\n{}", broken.stderr);
    }

    // Back as it was.
    fs::write(&file, before).unwrap();
    build(folder).expect_success();
    assert_eq!(stranger(), first);
}

/// The crates that a package brings along for its library and its build scripts, as (third-party, of this repository).
fn crates_of(folder: &Path, package: &str) -> (BTreeSet<String>, BTreeSet<String>) {
    let arguments = [
        "tree",
        "--edges",
        "normal,build",
        "--prefix",
        "none",
        "--package",
        package,
    ];
    let tree = cargo(folder, &arguments).expect_success();
    let lines = tree.stdout.lines().map(|l| l.trim_end_matches(" (*)"));
    let named = lines.filter(|l| !l.is_empty() && !l.starts_with(&format!("{package} ")));
    let (ours, theirs): (Vec<&str>, Vec<&str>) = named.partition(|l| l.starts_with("veduta"));
    let names = |lines: Vec<&str>| {
        lines
            .iter()
            .map(|l| l.split(' ').take(2).collect::<Vec<_>>().join(" "))
            .collect::<BTreeSet<_>>()
    };
    (names(theirs), names(ours))
}

#[test]
fn a_user_pays_at_most_20_crates_more_than_for_wgpu_alone() {
    let _alone = alone();
    let folder = lay_out();
    let (without, none) = crates_of(&folder, "downstream_wgpu_alone");
    assert!(none.is_empty() && without.len() > 20, "{without:?}");
    let (with, ours) = crates_of(&folder, "downstream_payer");
    assert_eq!(ours.len(), 2, "{ours:?}");
    let more: Vec<&String> = with.difference(&without).collect();
    println!(
        "wgpu alone: {} crates; veduta: {} more and its own two\n{more:?}",
        without.len(),
        more.len()
    );
    assert!(without.is_subset(&with), "veduta uses the same wgpu");
    assert!(more.len() <= 20, "{more:?}");
}

#[test]
fn composing_every_preset_takes_at_most_3_seconds_and_repeats_byte_by_byte() {
    let _alone = alone();
    // What the build script does, by the same code in the same optimisation.
    let build = veduta_compose::Build::of_veduta(root().join("wgsl"), root().join("presets"));
    let limit = Duration::from_secs(3);
    let mut best = Duration::MAX;
    let mut variants = 0;
    // Other programs only make it slower, so that the best of a few runs counts.
    for run in 0..12 {
        if run >= 2 && best <= limit {
            break;
        }
        let start = Instant::now();
        let output = build.run().unwrap();
        best = best.min(start.elapsed());
        variants = output.programs.len();
        let built = include_str!(concat!(env!("OUT_DIR"), "/veduta_programs.rs"));
        // The Cargo feature is told to build scripts only; it decides nothing but the default.
        let as_built = if cfg!(feature = "low_quality") {
            output.rust.replace("\"thesis\"", "\"thesis_low\"")
                == built.replace("\"thesis\"", "\"thesis_low\"")
        } else {
            output.rust == built
        };
        assert!(as_built, "run {run} differs from what the build made");
    }
    println!("composing {variants} variants: {best:.2?}");
    assert!(best <= limit, "{best:.2?}");
}

#[test]
fn packages_build_without_the_repository() {
    let _alone = alone();
    let folder = scratch().join("packages");
    let packed = folder.join("packed");
    if packed.exists() {
        fs::remove_dir_all(&packed).unwrap();
    }
    fs::create_dir_all(&packed).unwrap();
    let start = Instant::now();
    cargo(
        root(),
        &[
            "package",
            "--workspace",
            "--exclude",
            "xtask",
            "--no-verify",
            "--allow-dirty",
            "--quiet",
            "--target-dir",
            packed.to_str().unwrap(),
        ],
    )
    .expect_success();
    let version = env!("CARGO_PKG_VERSION");
    let mut patch = String::from("[patch.crates-io]\n");
    for name in ["veduta", "veduta-compose", "veduta-cli"] {
        let archive = packed.join(format!("package/{name}-{version}.crate"));
        let unpacked = folder.join("unpacked");
        fs::create_dir_all(&unpacked).unwrap();
        Outcome::of(
            Command::new("tar")
                .arg("-xzf")
                .arg(&archive)
                .arg("-C")
                .arg(&unpacked),
        )
        .expect_success();
        let package = unpacked.join(format!("{name}-{version}"));
        // Under an unchanging name and with unchanging times, so that what is built already stays.
        copy_crate(&package, &folder.join(name));
        patch += &format!("{name} = {{ path = \"{name}\" }}\n");
    }
    fs::remove_dir_all(folder.join("unpacked")).unwrap();
    write(
        &folder.join("user/Cargo.toml"),
        format!(
            "[package]\nname = \"downstream_user\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[dependencies]\nveduta = \"{version}\"\n"
        ),
    );
    write(
        &folder.join("user/src/main.rs"),
        "//! Prints every text.
fn main() {
    for program in veduta::programs().programs.iter() {
        for stage in program.stages.iter() {
            print!(\"{}\", stage.wgsl);
        }
    }
}
",
    );
    make_workspace(&folder, &["user", "veduta-cli"], &patch);
    let built = cargo(&folder, &["build", "--release", "--workspace"]).expect_success();
    println!(
        "packed, unpacked and built in {:.1?}; compiled {:?}",
        start.elapsed(),
        built.compiled()
    );

    let printed = Outcome::of(&mut Command::new(program_file("downstream_user")))
        .expect_success()
        .stdout;
    let ours: String = veduta::programs()
        .programs
        .iter()
        .flat_map(|p| p.stages.iter().map(|s| s.wgsl.as_ref()))
        .collect();
    assert!(
        printed == ours,
        "the packages compose other texts than the repository"
    );
}
