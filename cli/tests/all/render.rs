//! `veduta render`, and the library behind it.

use veduta::eval::{Evaluator, Spec};
use veduta::{LandscapeOptions, Value, WorldPos};
use veduta_cli::camera::{Camera, EyeHeight, ground_height};
use veduta_cli::catalog::{Catalog, SourceArgs};
use veduta_cli::commands::render::{Job, RenderArgs};
use veduta_cli::render::{Output, Renderer, Size, Tiling, measure};

use crate::common::{copy_fixture, exr, folder, json, png, veduta};

fn args(scene: &str, preset: &str, view: Option<&str>) -> RenderArgs {
    RenderArgs {
        scene: scene.to_owned(),
        preset: Some(preset.to_owned()),
        view: view.map(str::to_owned),
        ..RenderArgs::default()
    }
}

fn renderer(job: &Job, size: Size, output: Output) -> Renderer {
    let gpu = veduta::device::shared().unwrap();
    Renderer::new(gpu, job.catalog.set(), &job.options, size, output).unwrap()
}

const SMALL: Size = Size {
    width: 64,
    height: 36,
};

#[test]
fn every_result_of_one_frame() {
    let dir = folder("render_all");
    let run = veduta(
        &dir,
        &[
            "render", "--preset", "thesis", "--view", "V01", "--size", "64x36", "--out", "a.png",
            "--linear", "a.exr", "--stats", "s.json", "--count", "c.json",
        ],
    )
    .good();
    assert!(
        run.out.contains("a.png: 64x36 in ") && run.out.contains("a.exr: 64x36 in "),
        "{}",
        run.out
    );
    assert!(
        !run.err.contains('%'),
        "a progress bar without a terminal: {}",
        run.err
    );
    let (width, height, bytes) = png(&dir.join("a.png"));
    assert_eq!((width, height, bytes.len()), (64, 36, 64 * 36 * 3));
    let (width, height, radiance) = exr(&dir.join("a.exr"));
    assert_eq!((width, height, radiance.len()), (64, 36, 64 * 36 * 3));
    assert!(radiance.iter().all(|v| v.is_finite() && *v >= 0.0));
    // The picture is the radiance, tone-mapped and encoded, and half a step of dither.
    for (byte, radiance) in bytes.iter().zip(&radiance) {
        let linear = 1.0 - (-f64::from(*radiance)).exp();
        let encoded = if linear <= 0.003_130_8 {
            12.92 * linear
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        assert!(
            (f64::from(*byte) - 255.0 * encoded).abs() <= 1.1,
            "{byte} {radiance}"
        );
    }
    let stats = json(&dir.join("s.json"));
    for (field, wanted) in [
        ("program", "landscape"),
        ("preset", "thesis"),
        ("scene", "thesis"),
        ("view", "V01"),
        ("output", "display"),
    ] {
        assert_eq!(stats[field], wanted, "{stats}");
    }
    assert_eq!(stats["size"], serde_json::json!([64, 36]));
    assert_eq!(
        stats["features"],
        serde_json::json!(["ATMOSPHERE", "CLOUDS", "TERRAIN"])
    );
    for field in ["adapter", "backend", "device_type", "driver", "driver_info"] {
        assert!(stats[field].is_string(), "{field}");
    }
    assert!(stats["wgsl_bytes"].as_u64().unwrap() > 10_000);
    assert!(stats["pipeline_ms"].as_f64().unwrap() > 0.0);
    let frames = stats["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 1);
    for cost in [&stats["first_draw"], &frames[0]] {
        assert!(cost["wall_ms"].as_f64().unwrap() > 0.0);
        assert!(cost["submissions"].as_u64().unwrap() >= 1);
        if cfg!(target_os = "linux") {
            assert!(cost["cpu_ms"].as_f64().unwrap() > 0.0, "{cost}");
        }
    }
    assert!(stats["first_draw"]["bytes_uploaded"].as_u64().unwrap() > 0);
    // Nothing has changed since the first draw.
    assert_eq!(frames[0]["bytes_uploaded"], 0);
    let counts = json(&dir.join("c.json"));
    assert_eq!(counts["preset"], "thesis");
    for field in ["noise", "density", "light", "air"] {
        let (mean, max) = (
            counts[field]["mean"].as_f64().unwrap(),
            counts[field]["max"].as_f64().unwrap(),
        );
        assert!(0.0 < mean && mean <= max && max < 1e6, "{field} {counts}");
    }
    // The atmosphere is marched once or twice with 16 steps and 8 towards the sun at each.
    assert_eq!(counts["air"]["max"], 2.0 * 16.0 * 9.0);
    assert!(counts["density"]["max"].as_f64().unwrap() <= 64.0);
}

#[test]
fn frames_are_numbered_and_fly() {
    let dir = folder("render_frames");
    veduta(
        &dir,
        &[
            "render",
            "clear",
            "--preset",
            "low",
            "--size",
            "32x18",
            "--frames",
            "3",
            "--fps",
            "2",
            "--time",
            "10",
            "--set",
            "CAM_SPEED=900",
            "--out",
            "f.png",
            "--stats",
            "s.json",
        ],
    )
    .good();
    let frames: Vec<Vec<u8>> = (0..3)
        .map(|i| png(&dir.join(format!("f_{i:04}.png"))).2)
        .collect();
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    assert!(!dir.join("f.png").exists() && !dir.join("f_0003.png").exists());
    let times: Vec<f64> = json(&dir.join("s.json"))["frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f["time"].as_f64().unwrap())
        .collect();
    assert_eq!(times, [10.0, 10.5, 11.0]);
    // The same moment by itself is the same picture but for the number that seeds the dither and jitter.
    veduta(
        &dir,
        &[
            "render",
            "clear",
            "--preset",
            "low",
            "--size",
            "32x18",
            "--time",
            "11",
            "--set",
            "CAM_SPEED=900",
            "--out",
            "one.png",
        ],
    )
    .good();
    assert_eq!(png(&dir.join("one.png")).2, frames[2]);
}

#[test]
fn the_default_preset_follows_the_cargo_feature() {
    let dir = folder("render_default");
    veduta(&dir, &["render", "--size", "16x9", "--stats", "s.json"]).good();
    let wanted = if cfg!(feature = "low_quality") {
        "thesis_low"
    } else {
        "thesis"
    };
    assert_eq!(json(&dir.join("s.json"))["preset"], wanted);
    assert!(!dir.join("s.png").exists());
}

#[test]
fn own_files_are_drawn_and_composed_on_the_spot() {
    let dir = folder("render_own");
    copy_fixture("user_project/good", &dir);
    let own = |extra: &[&str], stats: &str| {
        let all = [
            "render",
            "presets/scenes/dusk.ron",
            "--preset",
            "presets/coarse.ron",
            "--presets",
            "presets",
            "--size",
            "32x18",
            "--stats",
            stats,
        ];
        veduta(&dir, &[&all[..], extra].concat()).good();
        json(&dir.join(stats))
    };
    let stats = own(
        &[
            "--view",
            "presets/views/hut.ron",
            "--set",
            "SMOOTH_RIDGES=true",
        ],
        "a.json",
    );
    assert_eq!(
        (&stats["preset"], &stats["scene"]),
        (&"coarse".into(), &"dusk".into())
    );
    let features: Vec<&str> = stats["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f.as_str().unwrap())
        .collect();
    // No shipped preset smooths ridges: this variant was composed at run time.
    assert_eq!(
        features,
        [
            "ATMOSPHERE",
            "CLOUD_SKIP",
            "SMOOTH_RIDGES",
            "TERRAIN",
            "TEXTURE_LOW_QUALITY"
        ]
    );
    let built = veduta::programs().get("landscape", &features);
    assert!(built.is_err());
    own(&["--view", "hut"], "b.json");
}

#[test]
fn tiles_leave_no_trace() {
    let job = Job::new(&args("thesis", "low", Some("V03"))).unwrap();
    let size = Size {
        width: 150,
        height: 70,
    };
    let view = job.view(3.0, size).unwrap();
    let mut renderer = renderer(&job, size, Output::Display);
    let mut draw = |tiling| {
        let mut last = 0.0;
        let cost = renderer
            .draw(&view, tiling, &mut |share| {
                assert!(share > last && share <= 1.0);
                last = share;
            })
            .unwrap();
        assert_eq!(last, 1.0);
        (renderer.read_rgb8().unwrap(), cost)
    };
    let (whole, cost) = draw(Tiling::Whole);
    assert_eq!(cost.submissions, 1);
    assert!(whole.iter().max() != whole.iter().min());
    let (tiled, cost) = draw(Tiling::Fixed(32));
    assert_eq!(cost.submissions, 5 * 3);
    assert!(tiled == whole, "tiles of 32 pixels differ");
    let (odd, _) = draw(Tiling::Fixed(37));
    assert!(odd == whole, "tiles of 37 pixels differ");
    let (adaptive, cost) = draw(Tiling::Adaptive);
    assert!(cost.submissions > 1);
    assert!(adaptive == whole, "adaptive tiles differ");
    assert!(renderer.draw(&view, Tiling::Fixed(0), &mut |_| {}).is_err());
    assert!(renderer.read_rgba32().is_err());
}

#[test]
fn the_flight_goes_on_for_ever() {
    let mut flight = args("clear", "thesis_low", Some("V03"));
    flight.look = Some([30.0, -15.0]);
    let job = Job::new(&flight).unwrap();
    let mut renderer = renderer(&job, SMALL, Output::Linear);
    let start = job.view(0.0, SMALL).unwrap().eye.to_metres();
    let mut pictures = Vec::new();
    for time in [0.0, 60.0, 1e6] {
        let view = job.view(time, SMALL).unwrap();
        let eye = view.eye.to_metres();
        let distance = 50.0 * time;
        assert!((eye.x - start.x - 0.5 * distance).abs() < 1e-3, "{eye}");
        assert!(
            (eye.z - start.z + 0.75_f64.sqrt() * distance).abs() < 1e-3,
            "{eye}"
        );
        // 50 m above the ground, whose height lies between 0 and twice the first octave.
        assert!((50.0..2850.0).contains(&eye.y), "{eye}");
        renderer.draw(&view, Tiling::Whole, &mut |_| {}).unwrap();
        let pixels = renderer.read_rgba32().unwrap();
        assert!(pixels.iter().all(|v| v.is_finite()));
        let green: Vec<f32> = pixels.iter().skip(1).step_by(4).copied().collect();
        let mean = green.iter().sum::<f32>() / green.len() as f32;
        let spread = green.iter().map(|g| (g - mean).abs()).sum::<f32>() / green.len() as f32;
        assert!(
            mean > 0.01 && spread > 0.05 * mean,
            "{time}: {mean} {spread}"
        );
        pictures.push(pixels);
    }
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
}

#[test]
fn row_l37_the_flight_follows_the_ground_at_its_speed() {
    for (height, speed, sets) in [
        (300.0, 50.0, &[][..]),
        (120.0, 50.0, &["CAM_HEIGHT=120"][..]),
        (300.0, -7.5, &["CAM_SPEED=-7.5"][..]),
        (45.5, 900.0, &["CAM_HEIGHT=45.5", "CAM_SPEED=900"][..]),
    ] {
        let mut flight = args("thesis", "thesis", None);
        flight.sets = sets.iter().map(|s| (*s).to_owned()).collect();
        let job = Job::new(&flight).unwrap();
        let start = job.view(0.0, SMALL).unwrap().eye.to_metres();
        let mut grounds = Vec::new();
        for time in [0.0, 1.0, 60.0, 1e6] {
            let view = job.view(time, SMALL).unwrap();
            assert_eq!(view.time, time);
            let ground = ground_height(job.catalog.set(), &job.settings, view.eye).unwrap();
            let above = view.eye.altitude() - ground;
            assert!(
                (above - height).abs() < 1e-3,
                "{sets:?} at {time} s: {above} m above the ground"
            );
            let eye = view.eye.to_metres();
            assert!(
                (start.z - eye.z - speed * time).abs() < 1e-3 && (eye.x - start.x).abs() < 1e-3,
                "{sets:?} at {time} s: {eye} from {start}"
            );
            grounds.push(ground);
        }
        // It is not flat, so that following it means something.
        assert!((grounds[2] - grounds[0]).abs() > 1.0 && (grounds[3] - grounds[0]).abs() > 1.0);
    }
}

#[test]
fn the_ground_is_where_the_device_draws_it() {
    let catalog = Catalog::load(&SourceArgs::default()).unwrap();
    let job = Job::new(&args("thesis", "thesis", None)).unwrap();
    let evaluator = Evaluator::new(
        veduta::device::shared().unwrap(),
        &catalog.library().unwrap(),
        &Spec {
            imports: &["veduta::terrain::height::{height, Terrain}"],
            prelude: "",
            prelude_file: "",
            expression: "height(Terrain(vec2<i32>(in.i[0], in.i[1]), vec2<f32>(in.f[2], in.f[3]), 8192.0, 1400.0, 1.0, 2.0, 0.0, 1u), vec2<f32>(0.0), 10)",
            columns: 4, features: &[], },
    )
    .unwrap();
    let places = [[0.0, 0.0], [-3e3, 12_345.6], [4e7, -3e7], [1e12, 7.0]];
    let mut rows = Vec::new();
    let mut twins = Vec::new();
    for [x, z] in places {
        let foot = WorldPos::from_metres(veduta::glam::DVec3::new(x, 0.0, z));
        let at = [0, 2].map(|axis| foot.lattice(axis, 8192.0).unwrap());
        rows.extend(at.map(|l| l.cell.cast_unsigned()));
        rows.extend(at.map(|l| l.frac.to_bits()));
        twins.push(ground_height(job.catalog.set(), &job.settings, foot).unwrap());
    }
    for (drawn, twin) in evaluator.run(&rows).unwrap().into_iter().zip(twins) {
        assert!((drawn - twin).abs() < 0.05, "{drawn} {twin}");
    }
    // No terrain: the sphere.
    let sky = Job::new(&args("sky", "thesis", None)).unwrap();
    let height = ground_height(sky.catalog.set(), &sky.settings, WorldPos::default()).unwrap();
    assert_eq!(height, 0.0);
}

#[test]
fn cameras_look_where_they_should() {
    let mut wanted = args("clear", "thesis", None);
    wanted.sets = vec![
        "SUN_INTENSITY=7".to_owned(),
        "EXPOSURE=0.5".to_owned(),
        "SUN_HEIGHT=10".to_owned(),
    ];
    wanted.camera = Some([1e3, 2.5e3, -2e3]);
    wanted.look = Some([90.0, 20.0]);
    wanted.fov = Some(40.0);
    let job = Job::new(&wanted).unwrap();
    let camera = Camera {
        x: 1e3,
        z: -2e3,
        height: EyeHeight::Altitude(2.5e3),
        yaw: 90.0,
        pitch: 20.0,
        field_of_view: 40.0,
        sun_height: 10.0,
        sun_azimuth: 120.0,
    };
    assert_eq!(job.camera, camera);
    let view = job
        .view(
            2.0,
            Size {
                width: 200,
                height: 100,
            },
        )
        .unwrap();
    let eye = view.eye.to_metres();
    // East, 50 m/s.
    assert!(
        (eye - veduta::glam::DVec3::new(1100.0, 2500.0, -2000.0)).length() < 1e-3,
        "{eye}"
    );
    assert_eq!((view.exposure, view.time), (0.5, 2.0));
    assert_eq!(view.sun.irradiance, veduta::glam::Vec3::splat(7.0));
    let sun = veduta::view::direction(10_f64.to_radians(), 210_f64.to_radians()).as_vec3();
    assert!((view.sun.to_light - sun).length() < 1e-6);
    let [middle, right, up] = view.rays().unwrap();
    let forward = veduta::view::direction(20_f64.to_radians(), 90_f64.to_radians()).as_vec3();
    assert!((middle.normalize() - forward).length() < 1e-5);
    let tangent = 20_f32.to_radians().tan();
    assert!((up.length() / middle.length() - tangent).abs() < 1e-5);
    assert!((right.length() / middle.length() - 2.0 * tangent).abs() < 1e-5);
    // A view gives place, height, direction and sun.
    let job = Job::new(&args("clear", "thesis", Some("V12"))).unwrap();
    assert_eq!(job.camera.height, EyeHeight::AboveGround(1500.0));
    assert_eq!(
        (job.camera.field_of_view, job.camera.sun_azimuth),
        (10.0, 100.0)
    );
}

#[test]
fn precedence_is_set_scene_preset_declaration() {
    let dir = folder("render_precedence");
    std::fs::write(
        dir.join("p.ron"),
        r#"(reason: "a test", values: {"CLOUD_COVERAGE": 0.1, "TERRAIN_HEIGHT": 100.0, "CAM_SPEED": 5.0})"#,
    )
    .unwrap();
    std::fs::write(
        dir.join("s.ron"),
        r#"(program: "landscape", meaning: "a test", features: ["TERRAIN"], content: {"CLOUD_COVERAGE": 0.2, "TERRAIN_HEIGHT": 200.0})"#,
    )
    .unwrap();
    let file = |name: &str| dir.join(name).to_str().unwrap().to_owned();
    let mut wanted = args(&file("s.ron"), &file("p.ron"), None);
    wanted.sets = vec!["CLOUD_COVERAGE=0.3".to_owned()];
    let job = Job::new(&wanted).unwrap();
    let values = [
        "CLOUD_COVERAGE",
        "TERRAIN_HEIGHT",
        "CAM_SPEED",
        "TERRAIN_SCALE",
    ]
    .map(|key| job.settings.number(key).unwrap());
    assert_eq!(values, [0.3, 200.0, 5.0, 8192.0]);
}

#[test]
fn frames_are_measured() {
    let job = Job::new(&args("clear", "low", Some("V01"))).unwrap();
    let view = job.view(0.0, SMALL).unwrap();
    let mut renderer = renderer(&job, SMALL, Output::Display);
    let measured = measure(&mut renderer, &view, 3).unwrap();
    assert_eq!(measured.frames.len(), 3);
    assert!(measured.frames.iter().all(|f| f.submissions == 1));
    assert!(measured.median_wall_ms().unwrap() > 0.0);
    if cfg!(target_os = "linux") {
        assert!(measured.median_cpu_ms().unwrap() > 0.0);
    }
    assert!(measure(&mut renderer, &view, 0).is_err());
    renderer
        .set_content("CLOUD_COVERAGE", Value::Float(0.7))
        .unwrap();
    assert!(renderer.set_content("OCTAVES", Value::Int(3)).is_err());
}

#[test]
fn operation_counts_do_not_depend_on_tiles_or_time() {
    let job = Job::new(&args("thesis", "thesis", Some("V01"))).unwrap();
    let gpu = veduta::device::shared().unwrap();
    let first = job.operation_counts(gpu, SMALL, 0.0).unwrap();
    assert_eq!(first, job.operation_counts(gpu, SMALL, 0.0).unwrap());
    let skip = Job::new(&args("thesis", "thesis_skip", Some("V01"))).unwrap();
    let skip = skip.operation_counts(gpu, SMALL, 0.0).unwrap();
    // Skipping spares light samples and leaves the terrain alone.
    assert!(
        skip[2].0 < first[2].0 && skip[3] == first[3],
        "{skip:?} {first:?}"
    );
}

#[test]
fn bad_options_are_told() {
    let dir = folder("render_bad");
    let run = |args: &[&str]| veduta(&dir, &[&["render"], args].concat());
    run(&[]).bad(1, &["at least one of --out, --linear, --stats, --count"]);
    run(&["--out", "a.jpg"]).bad(1, &["--out", "a.jpg", "`.png`"]);
    run(&["--linear", "a.png"]).bad(1, &["--linear", "`.exr`"]);
    run(&["--stats", "a.txt"]).bad(1, &["--stats", "`.json`"]);
    run(&["--out", "no/a.png"]).bad(1, &["no/a.png", "folder does not exist"]);
    run(&["--size", "0x9", "--out", "a.png"]).bad(1, &["--size", "0x9", "1 to 8192"]);
    run(&["--size", "16x8193", "--out", "a.png"]).bad(1, &["16x8193", "1 to 8192"]);
    run(&["thesi", "--out", "a.png"]).bad(1, &["scene `thesi`", "did you mean `thesis`"]);
    run(&["nowhere.ron", "--out", "a.png"]).bad(1, &["nowhere.ron", "cannot be read"]);
    run(&["--preset", "best", "--out", "a.png"]).bad(1, &["preset `best`", "thesis_low"]);
    run(&["--view", "V13", "--out", "a.png"]).bad(1, &["view `V13`", "`V1"]);
    run(&["--set", "OCTAVES", "--out", "a.png"]).bad(1, &["KEY=VALUE"]);
    run(&["--set", "OCTAVS=3", "--out", "a.png"]).bad(1, &["OCTAVS", "did you mean `OCTAVES`"]);
    run(&["--set", "OCTAVES=99", "--out", "a.png"]).bad(1, &["OCTAVES", "99", "[1, 16]"]);
    run(&["--set", "OCTAVES=many", "--out", "a.png"]).bad(1, &["OCTAVES", "many", "i32"]);
    run(&["--set", "EXPOSURE=NaN", "--out", "a.png"]).bad(1, &["EXPOSURE", "NaN"]);
    run(&["--set", "OCTAVES=3", "--set", "OCTAVES=4", "--out", "a.png"])
        .bad(1, &["OCTAVES=4", "once"]);
    run(&["--time", "inf", "--out", "a.png"]).bad(1, &["--time", "inf"]);
    run(&["--time", "NaN", "--out", "a.png"]).bad(1, &["--time", "NaN"]);
    run(&["--time", "1e300", "--out", "a.png"]).bad(1, &["of the eye", "1000000000000000"]);
    run(&["--fov", "0", "--out", "a.png"]).bad(1, &["field of view", "[0.01, 170]"]);
    run(&["--fov", "180", "--out", "a.png"]).bad(1, &["field of view", "180"]);
    run(&["--look", "0,91", "--out", "a.png"]).bad(1, &["pitch", "91", "[-90, 90]"]);
    run(&["--camera", "0,1e9,0", "--out", "a.png"]).bad(1, &["altitude", "1000000000"]);
    run(&["--camera", "NaN,0,0", "--out", "a.png"]).bad(1, &["x of the eye", "NaN"]);
    run(&["--frames", "0", "--out", "a.png"]).bad(1, &["--frames", "at least 1"]);
    for frames in ["10000001", "4294967295"] {
        run(&["--frames", frames, "--out", "a.png"])
            .bad(1, &["--frames", frames, "at most 10000000"]);
    }
    // The last of many moments is checked before the first is drawn.
    run(&["--frames", "10000000", "--fps", "1e-7", "--out", "a.png"]).bad(1, &["of the eye"]);
    run(&["--frames", "2", "--fps", "0", "--out", "a.png"]).bad(1, &["--fps", "more than 0"]);
    std::fs::write(
        dir.join("bad.ron"),
        "(reason: \"x\", values: {\"OCTAVES\": 0.5})",
    )
    .unwrap();
    run(&["--preset", "bad.ron", "--out", "a.png"]).bad(1, &["bad.ron:1:", "OCTAVES"]);
    std::fs::write(
        dir.join("odd.ron"),
        r#"(program: "sea", meaning: "x", features: [], content: {})"#,
    )
    .unwrap();
    run(&["odd.ron", "--out", "a.png"]).bad(1, &["program `sea` does not exist"]);
    assert!(!dir.join("a.png").exists());
    // The limit also holds for the library.
    let job = Job::new(&args("clear", "low", None)).unwrap();
    let options: &LandscapeOptions = &job.options;
    let size = Size {
        width: 0,
        height: 1,
    };
    let gpu = veduta::device::shared().unwrap();
    assert!(Renderer::new(gpu, job.catalog.set(), options, size, Output::Display).is_err());
}

/// What a pixel of V01 costs, of the presets that ratios divide by. The frozen baseline never changes: a difference here is
/// a fault of the program, not of these numbers. Ways of rounding decide for a pixel or two whether a ray meets a crest,
/// hence one part in a thousand.
#[test]
fn operation_counts_of_the_frozen_baseline() {
    let dir = folder("render_counts");
    let golden = [
        (
            "thesis",
            [
                ("noise", 3465.457, 6992.0),
                ("density", 38.658, 64.0),
                ("light", 463.896, 768.0),
                ("air", 230.980, 288.0),
            ],
        ),
        (
            "thesis_skip",
            [
                ("noise", 1038.424, 6682.0),
                ("density", 25.677, 64.0),
                ("light", 72.372, 768.0),
                ("air", 230.980, 288.0),
            ],
        ),
        (
            "thesis_low",
            [
                ("noise", 352.606, 1445.0),
                ("density", 0.0, 0.0),
                ("light", 0.0, 0.0),
                ("air", 84.0, 84.0),
            ],
        ),
    ];
    for (preset, counts) in golden {
        veduta(
            &dir,
            &[
                "render", "--preset", preset, "--view", "V01", "--size", "256x144", "--count",
                "c.json",
            ],
        )
        .good();
        let found = json(&dir.join("c.json"));
        for (what, mean, largest) in counts {
            let of = |part: &str| found[what][part].as_f64().unwrap();
            let (got_mean, got_largest) = (of("mean"), of("max"));
            println!("{preset}: {what} {got_mean:.3}, at most {got_largest}");
            assert!(
                (got_mean - mean).abs() <= 1e-3 * mean,
                "{preset} {what}: {got_mean} instead of {mean}"
            );
            assert!(
                (got_largest - largest).abs() <= 0.02 * largest,
                "{preset} {what}: at most {got_largest} instead of {largest}"
            );
        }
    }
}
