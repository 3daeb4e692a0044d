//! The whole picture: what it reads, that it is finite everywhere, what its keys change, and what it costs.

use crate::common::{Picture, cpu_seconds, draw, evaluator, gpu};
use veduta::compose::{Reloader, Source};
use veduta::glam::{DVec3, I64Vec3, Vec3};
use veduta::program::{KeyKind, StageKind};
use veduta::view::direction;
use veduta::{
    Error, Landscape, LandscapeOptions, Light, Preset, Settings, Targets, Value, View, Work,
    WorldPos, programs,
};

const HDR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const SMALL: [u32; 2] = [64, 36];

fn targets(color_format: wgpu::TextureFormat) -> Targets {
    Targets {
        color_format,
        ..Default::default()
    }
}

fn landscape(preset: &str, scene: &str, values: &[(&str, Value)]) -> Landscape {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = Source::read(&[&root.join("wgsl"), &root.join("presets")]).unwrap();
    let mut programs = programs().clone();
    let options = LandscapeOptions {
        preset: Preset::Named(preset.to_owned().into()),
        scene: scene.to_owned(),
        values: values.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect(),
    };
    // What the shipped presets do not need is composed here.
    let settings =
        Settings::resolve(&programs, &options.preset, Some(scene), &options.values).unwrap();
    programs
        .get_or_compose(&source, "landscape", &settings.features())
        .unwrap();
    Landscape::new(&gpu().device, &programs, &targets(HDR), &options).unwrap()
}

/// A frozen view as the command line places it, `time` seconds into the flight.
pub fn frozen(name: &str, time: f64) -> View {
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("presets/views/{name}.ron")),
    )
    .unwrap();
    let number = |field: &str| -> Option<f64> {
        let rest = text.split(&format!("{field}:")).nth(1)?;
        rest.split([',', ')']).next()?.trim().parse().ok()
    };
    let place = text
        .split("place: (")
        .nth(1)
        .map(|rest| {
            let mut numbers = rest
                .split([',', ')'])
                .map(|n| n.trim().parse::<f64>().unwrap());
            [numbers.next().unwrap(), numbers.next().unwrap()]
        })
        .unwrap_or([0.0; 2]);
    let yaw = number("yaw_deg").unwrap_or(0.0).to_radians();
    let speed = 50.0;
    let foot = DVec3::new(place[0], 0.0, place[1]) + direction(0.0, yaw) * (speed * time);
    let mut view = View {
        eye: WorldPos::from_metres(foot),
        exposure: 1.0,
        time,
        sun: Light {
            to_light: direction(
                number("sun_height_deg").unwrap().to_radians(),
                yaw + number("sun_azimuth_deg").unwrap().to_radians(),
            )
            .as_vec3(),
            irradiance: Vec3::splat(20.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let ground = ground_height(view.eye);
    view.eye = view
        .eye
        .moved_by(DVec3::new(0.0, ground + number("eye_height").unwrap(), 0.0));
    view.look(
        yaw,
        number("pitch_deg").unwrap().to_radians(),
        (number("fov_deg").unwrap() as f32).to_radians(),
        16.0 / 9.0,
    );
    view
}

/// Height of the thesis terrain under a position, in double precision.
fn ground_height(place: WorldPos) -> f64 {
    let settings = veduta::Settings::resolve(programs(), &Preset::Thesis, None, &[]).unwrap();
    let number = |name: &str| settings.number(name).unwrap();
    let x = place.lattice(0, number("TERRAIN_SCALE")).unwrap();
    let z = place.lattice(2, number("TERRAIN_SCALE")).unwrap();
    number("TERRAIN_HEIGHT")
        * veduta::reference::fractal::ridged_multifractal_2d(
            [x.cell, z.cell],
            [f64::from(x.frac), f64::from(z.frac)],
            number("OCTAVES") as i32,
            number("TERRAIN_HURST"),
            number("TERRAIN_GAIN"),
            0.0,
            number("TERRAIN_SEED") as u32,
        )
}

fn difference(a: &Picture, b: &Picture) -> f64 {
    a.pixels
        .iter()
        .zip(&b.pixels)
        .flat_map(|(p, q)| p.iter().zip(q).map(|(x, y)| f64::from((x - y).abs())))
        .sum::<f64>()
        / a.pixels.len() as f64
}

#[test]
fn row_l01_one_fragment_pass_without_textures() {
    for program in programs()
        .programs
        .iter()
        .filter(|p| p.program == "landscape")
    {
        assert_eq!(
            program.stages.len(),
            2,
            "a covering triangle and the picture"
        );
        for binding in program.bindings.iter() {
            assert!(
                matches!(
                    binding.ty,
                    wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        ..
                    }
                ),
                "{} is more than parameters",
                binding.name
            );
        }
        let vertex = program.stage(StageKind::Vertex).unwrap();
        assert!(!vertex.wgsl.contains("@location(1)"), "no vertex data");
    }
    let mut work = landscape("thesis_low", "thesis", &[]);
    assert!(draw(&mut work, &frozen("V01", 0.0), SMALL, HDR).mean(|_, _| true)[2] > 0.01);
}

#[test]
fn every_frozen_view_is_finite_in_both_presets() {
    for preset in ["thesis", "thesis_low"] {
        let mut land = landscape(preset, "thesis", &[("CLOUD_STEPS", Value::Int(16))]);
        for n in 1..=12 {
            let name = format!("V{n:02}");
            let picture = draw(&mut land, &frozen(&name, 0.0), SMALL, HDR);
            assert_eq!(picture.not_finite(), 0, "{preset} {name}");
            let mean = picture.mean(|_, _| true);
            assert!(mean.iter().all(|m| *m >= 0.0), "{preset} {name} {mean:?}");
            assert!(mean[2] > 1e-7, "{preset} {name} is black: {mean:?}");
        }
    }
}

#[test]
fn the_first_view_is_about_two_thirds_sky() {
    let mut land = landscape("thesis_low", "clear", &[("MIE_G", Value::Float(0.0))]);
    let mut black = frozen("V01", 0.0);
    // Without air the sky is black and the ground is not.
    black.sun.to_light = direction(0.5, 2.0).as_vec3();
    land.set_content("RAYLEIGH_SCATTERING", Value::Vec3([0.0; 3]))
        .unwrap();
    land.set_content("MIE_SCATTERING", Value::Float(0.0))
        .unwrap();
    land.set_content("MIE_EXTINCTION", Value::Float(0.0))
        .unwrap();
    let picture = draw(&mut land, &black, [128, 72], HDR);
    let sky =
        picture.pixels.iter().filter(|p| p[2] == 0.0).count() as f64 / picture.pixels.len() as f64;
    println!("sky share of V01: {sky:.3}");
    assert!((0.5..0.75).contains(&sky), "{sky}");
}

#[test]
fn row_l15_octaves_act_apart() {
    // A low sun, so that there are shadows.
    let mut view = frozen("V01", 0.0);
    view.sun.to_light = direction(0.15, 2.0).as_vec3();
    let mut base = landscape("thesis", "clear", &[]);
    let whole = draw(&mut base, &view, SMALL, HDR);
    for (key, value) in [("OCTAVES", 5), ("OCTAVES_SHADOW", 1), ("OCTAVES_NORMAL", 5)] {
        let mut other = landscape("thesis", "clear", &[(key, Value::Int(value))]);
        let picture = draw(&mut other, &view, SMALL, HDR);
        let change = difference(&whole, &picture);
        println!("{key} = {value} changes the picture by {change:.5}");
        assert!(change > 1e-6, "{key} changes nothing");
        if key != "OCTAVES" {
            // The sky, where no ground is met, stays the same to the bit.
            let sky = SMALL[0] as usize;
            assert_eq!(
                whole.pixels[..sky],
                picture.pixels[..sky],
                "{key} changes the sky as well"
            );
        }
    }
}

#[test]
fn row_l34_jitter_trades_stripes_for_noise() {
    let view = frozen("V08", 0.0);
    let size = [128, 72];
    let picture = |jitter: bool| {
        let mut land = landscape(
            "thesis",
            "sky",
            &[
                ("CLOUD_STEPS", Value::Int(8)),
                ("CLOUD_LIGHT_STEPS", Value::Int(4)),
                ("CLOUD_JITTER", Value::Flag(jitter)),
            ],
        );
        draw(&mut land, &view, size, HDR)
    };
    let (striped, noisy) = (picture(false), picture(true));
    // Noise: the difference between neighbours that a smooth picture does not have.
    let roughness = |p: &Picture| {
        let w = p.width as usize;
        (0..p.pixels.len())
            .filter(|i| i % w >= 1 && i % w + 1 < w)
            .map(|i| {
                // The sun itself is left out.
                let green = |i: usize| p.pixels[i][1].min(5.0);
                f64::from(green(i - 1) - 2.0 * green(i) + green(i + 1)).abs()
            })
            .sum::<f64>()
            / p.pixels.len() as f64
    };
    let (a, b) = (roughness(&striped), roughness(&noisy));
    println!("second difference without jitter {a:.5}, with {b:.5}");
    assert!(b > 1.2 * a, "jitter adds no noise");
    let without_sun = |p: &Picture| p.mean(|x, y| p.pixels[y * p.width as usize + x][1] < 5.0);
    let (ma, mb) = (without_sun(&striped), without_sun(&noisy));
    for c in 0..3 {
        assert!(
            (ma[c] - mb[c]).abs() < 0.05 * ma[c],
            "mean changed: {ma:?} {mb:?}"
        );
    }
}

/// That the eye moves as it should is a test of the command line, which places it.
#[test]
fn a_moved_eye_sees_other_ground_and_other_clouds() {
    let mut land = landscape("thesis", "thesis", &[("CLOUD_STEPS", Value::Int(8))]);
    let size = [48, 27];
    let start = draw(&mut land, &frozen("V01", 0.0), size, HDR);
    let later = draw(&mut land, &frozen("V01", 60.0), size, HDR);
    let far = draw(&mut land, &frozen("V01", 1e6), size, HDR);
    assert!(difference(&start, &later) > 1e-3 && difference(&start, &far) > 1e-3);
    assert_eq!(far.not_finite(), 0);
    // The clouds move too: straight up, with no ground in the picture.
    let mut up = landscape("thesis", "sky", &[("CLOUD_STEPS", Value::Int(8))]);
    let mut view = frozen("V08", 0.0);
    let before = draw(&mut up, &view, size, HDR);
    view.eye = view.eye.moved_by(DVec3::new(0.0, 0.0, -50.0 * 60.0));
    assert!(difference(&before, &draw(&mut up, &view, size, HDR)) > 1e-4);
}

/// The world repeats after a whole period of every lattice, so that a picture there must be the same picture: what is
/// lost far out would show.
#[test]
fn far_from_the_origin_nothing_is_lost() {
    let mut land = landscape("thesis", "thesis", &[("CLOUD_STEPS", Value::Int(8))]);
    let view = frozen("V03", 0.0);
    let near = draw(&mut land, &view, SMALL, HDR);
    // 2^32 cells of 8192 m are 2^45 m; 125 times that is a whole number of 2^32 cells of the rock (32 m) and of periods of
    // the clouds (16,000 m = 125 x 2^7 m) as well.
    let mut away = view;
    away.eye.cell += I64Vec3::new(125 << 45, 0, 125 << 45);
    let there = draw(&mut land, &away, SMALL, HDR);
    assert_eq!(near.pixels, there.pixels);
    // A quarter of the clouds' period further the sky is another one, and a whole period further it is the same again.
    let mut land = landscape("thesis", "sky", &[("CLOUD_STEPS", Value::Int(8))]);
    let view = frozen("V08", 0.0);
    let here = draw(&mut land, &view, SMALL, HDR);
    let mut shifted = view;
    shifted.eye.cell += I64Vec3::new(4000, 0, 0);
    assert!(difference(&here, &draw(&mut land, &shifted, SMALL, HDR)) > 1e-2);
    shifted.eye.cell += I64Vec3::new(12_000 + 16_000 * 125, 0, 16_000 * 125);
    assert_eq!(here.pixels, draw(&mut land, &shifted, SMALL, HDR).pixels);
}

#[test]
fn row_l38_every_parameter_exists_and_acts() {
    // Section 10 of the source, and the parameters that it mentions without a name.
    let named = [
        "LOW_QUALITY",
        "MAX_RENDERING_DISTANCE",
        "MAX_MARCHING_STEPS",
        "MAX_MARCHING_STEPS_SHADOW",
        "TEXTURE_LOW_QUALITY",
        "TEXTURE_FILTERING",
        "FILTERING_SAMPLES",
        "ATMOS_STEPS",
        "ATMOS_LIGHT_STEPS",
        "CLOUD_STEPS",
        "CLOUD_LIGHT_STEPS",
        "CLOUD_COVERAGE",
        "OCTAVES",
        "OCTAVES_SHADOW",
        "OCTAVES_NORMAL",
        "SMOOTH_RIDGES",
        "CLOUDS_HEIGHT",
        "CLOUDS_THICKNESS",
        "CAM_HEIGHT",
        "CAM_SPEED",
        "SUN_HEIGHT",
        "SUN_AZIMUTH",
        "TERRAIN_HEIGHT",
        "TERRAIN_SCALE",
        "CLOUD_SCATTERING",
        "CLOUD_ABSORPTION",
        "CLOUD_DENSITY",
        "CLOUD_G_FORWARD",
        "CLOUD_G_BACKWARD",
        "CLOUD_BACKWARD_SHARE",
    ];
    let thesis = programs().preset("thesis").unwrap();
    for name in named {
        let key = programs().key(name).unwrap();
        assert!(key.meaning.len() > 10, "{name} has no meaning");
        assert!(
            thesis.values.iter().any(|(n, _)| n == name),
            "thesis.ron lacks {name}"
        );
        key.check(key.default).unwrap();
    }
    // Content keys of the picture change it and never make a pipeline; what they do not name stays.
    let view = frozen("V01", 0.0);
    let mut land = landscape(
        "thesis",
        "thesis",
        &[
            ("CLOUD_STEPS", Value::Int(8)),
            ("SMOOTH_RIDGES", Value::Flag(true)),
        ],
    );
    let base = draw(&mut land, &view, SMALL, HDR);
    let layout = programs()
        .get("landscape", &["TERRAIN", "ATMOSPHERE", "CLOUDS"])
        .unwrap()
        .layout("Content")
        .unwrap();
    for member in layout.members.iter() {
        let name = member.name.to_uppercase();
        let key = programs().key(&name).unwrap();
        assert_eq!(key.kind, KeyKind::Content, "{name}");
        let old = land.settings().get(&name).unwrap();
        let new = match old {
            Value::Float(0.0) => Value::Float(0.01),
            Value::Float(v) => Value::Float(v * 0.7),
            Value::Int(v) => Value::Int(v + 1),
            Value::Vec3(v) => Value::Vec3(v.map(|x| x * 0.5)),
            flag => flag,
        };
        land.set_content(&name, new).unwrap();
        let changed = draw(&mut land, &view, SMALL, HDR);
        assert_eq!(changed.not_finite(), 0, "{name}");
        assert!(difference(&base, &changed) > 1e-7, "{name} changes nothing");
        land.set_content(&name, old).unwrap();
    }
    assert_eq!(draw(&mut land, &view, SMALL, HDR).pixels, base.pixels);
}

/// What a quality key acts on, and with that what it must leave as it is.
#[derive(Clone, Copy, PartialEq)]
enum Acts {
    /// The ground and how it is lit; the sky stays.
    Ground,
    /// The clouds; a scene without them stays, and so does the ground in front of them.
    Clouds,
    /// Everything.
    Everything,
}

#[test]
fn row_l38_every_quality_key_acts_where_it_should() {
    use Acts::{Clouds, Everything, Ground};
    let int = Value::Int;
    let float = Value::Float;
    let on = Value::Flag(true);
    let filtered = [("TEXTURE_FILTERING", on)];
    // Key, another value, what must be set beside it, what it acts on.
    type Case<'a> = (&'a str, Value, &'a [(&'a str, Value)], Acts);
    let cases: &[Case<'_>] = &[
        ("TEXTURE_LOW_QUALITY", on, &[], Ground),
        ("TEXTURE_FILTERING", on, &[], Ground),
        ("FILTERING_SAMPLES", int(5), &filtered, Ground),
        ("SMOOTH_RIDGES", on, &[], Ground),
        ("MAX_MARCHING_STEPS", int(20), &[], Ground),
        ("MAX_MARCHING_STEPS_SHADOW", int(3), &[], Ground),
        ("STEP_FACTOR", float(0.3), &[], Ground),
        ("MARCH_EPSILON", float(20.0), &[], Ground),
        ("MAX_RENDERING_DISTANCE", float(5000.0), &[], Ground),
        ("OCTAVES", int(5), &[], Ground),
        ("OCTAVES_SHADOW", int(1), &[], Ground),
        ("OCTAVES_NORMAL", int(5), &[], Ground),
        ("CLOUD_STEPS", int(11), &[], Clouds),
        ("CLOUD_LIGHT_STEPS", int(5), &[], Clouds),
        ("MAX_CLOUD_DISTANCE", float(9000.0), &[], Clouds),
        ("CLOUD_SKIP", on, &[], Clouds),
        ("CLOUD_JITTER", on, &[], Clouds),
        ("ATMOS_STEPS", int(5), &[], Everything),
        ("ATMOS_LIGHT_STEPS", int(3), &[], Everything),
        ("LOW_QUALITY", on, &[], Everything),
        ("COUNT_OPERATIONS", on, &[], Everything),
        ("SHOW_DISTANCE", on, &[], Everything),
    ];
    let acts_on = |key: &str, landscape: bool| {
        let all = programs().programs.iter();
        all.filter(|p| (p.program == "landscape") == landscape)
            .any(|p| {
                p.mentions.iter().any(|m| m == key) || p.overrides.iter().any(|o| o.name == key)
            })
    };
    for key in programs().keys.iter() {
        // A scene turns these on, and the target's format decides on the last.
        let elsewhere = ["TERRAIN", "ATMOSPHERE", "CLOUDS", "OUTPUT"];
        // Sizes of the sky's tables and of the terrain's levels and sectors, which no program names.
        let size = ["CLIP_TEXELS", "CLIP_WIDTH"].contains(&key.name.as_ref())
            || ["COLUMNS_", "DIFFUSE_", "SKY_", "AERIAL_"]
                .iter()
                .any(|table| key.name.starts_with(table))
                && (key.name.ends_with("_WIDTH") || key.name.ends_with("_HEIGHT"));
        let known = size || cases.iter().any(|(name, ..)| key.name == *name);
        let of_others = !acts_on(&key.name, true) && acts_on(&key.name, false);
        assert!(
            key.kind == KeyKind::Content
                || elsewhere.contains(&key.name.as_ref())
                || known
                || of_others,
            "no case for {}",
            key.name
        );
    }
    // A low sun, so that there are shadows.
    let mut view = frozen("V01", 0.0);
    view.sun.to_light = direction(0.15, 2.0).as_vec3();
    let width = SMALL[0] as usize;
    let picture = |scene: &str, beside: &[(&str, Value)]| {
        let cheap = [("CLOUD_STEPS", int(8)), ("CLOUD_LIGHT_STEPS", int(3))];
        let values = [&cheap, beside].concat();
        draw(&mut landscape("thesis", scene, &values), &view, SMALL, HDR)
    };
    let (clear, cloudy) = (picture("clear", &[]), picture("thesis", &[]));
    let clear_filtered = picture("clear", &filtered);
    for (key, value, beside, acts) in cases {
        let scene = if *acts == Ground { "clear" } else { "thesis" };
        let changed = picture(scene, &[*beside, &[(*key, *value)]].concat());
        assert_eq!(changed.not_finite(), 0, "{key}");
        let base = match (*acts, beside.is_empty()) {
            (Ground, true) => &clear,
            (Ground, false) => &clear_filtered,
            _ => &cloudy,
        };
        let change = difference(base, &changed);
        println!("{key} = {value} changes the picture by {change:.2e}");
        assert!(change > 1e-7, "{key} changes nothing");
        let (first, last) = (0..width, base.pixels.len() - width..base.pixels.len());
        match acts {
            Ground => assert_eq!(
                base.pixels[first.clone()],
                changed.pixels[first],
                "{key} changes the sky"
            ),
            Clouds => {
                assert_eq!(
                    base.pixels[last.clone()],
                    changed.pixels[last],
                    "{key} changes the ground"
                );
                let without = picture("clear", &[(*key, *value)]);
                assert_eq!(clear.pixels, without.pixels, "{key} acts without clouds");
            }
            Everything => {}
        }
    }
}

/// A variant that is composed at run time has the sizes that a build would have given it.
#[test]
fn sizes_of_the_default_preset_hold_at_run_time() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("sizes");
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write(
        "keys.ron",
        r#"[(name: "TILE", type: "size", kind: "quality", domain: (1, 256), default: 8, unit: "1", meaning: "Tile.")]"#,
    );
    write(
        "sized.sp",
        "#PROGRAM{ sized }#\n#COMPUTE{ #CODE{\n@group(0) @binding(0) var<storage, read_write> values: array<u32>;\n@compute @workgroup_size(#{TILE})\nfn run(@builtin(global_invocation_id) id: vec3<u32>) { values[id.x] = id.x; }\n}# }#\n",
    );
    let source = Source::read(&[&folder]).unwrap();
    let width = |p: &veduta::program::ComposedProgram| p.stages[0].entry_points[0].workgroup_size;
    assert_eq!(width(&source.compose("sized", &[]).unwrap()), [8, 1, 1]);
    let sized = source.compose_sized("sized", &[], &[("TILE", 32), ("OTHER", 3)]);
    assert_eq!(width(&sized.unwrap()), [32, 1, 1]);
    let mut set = veduta::ProgramSet {
        keys: vec![veduta::program::Key {
            name: "TILE".into(),
            kind: KeyKind::Quality,
            ty: "size".into(),
            domain: Some((1.0, 256.0)),
            default: Value::Int(8),
            unit: "1".into(),
            meaning: "Tile.".into(),
        }]
        .into(),
        presets: vec![veduta::program::PresetTable {
            name: "wide".into(),
            values: vec![("TILE".into(), Value::Int(16))].into(),
        }]
        .into(),
        default_preset: "wide".into(),
        ..Default::default()
    };
    let composed = set.get_or_compose(&source, "sized", &[]).unwrap();
    assert_eq!(width(composed), [16, 1, 1]);
}

#[test]
fn row_l39_the_preset_of_low_quality_leaves_clouds_out_and_is_twice_as_fast() {
    let low = programs()
        .get(
            "landscape",
            &[
                "TERRAIN",
                "ATMOSPHERE",
                "LOW_QUALITY",
                "TEXTURE_LOW_QUALITY",
            ],
        )
        .or_else(|_| {
            programs().get(
                "landscape",
                &[
                    "TERRAIN",
                    "ATMOSPHERE",
                    "CLOUDS",
                    "LOW_QUALITY",
                    "TEXTURE_LOW_QUALITY",
                ],
            )
        })
        .unwrap();
    assert!(
        !low.stage(StageKind::Fragment)
            .unwrap()
            .wgsl
            .contains("march_clouds")
    );
    let view = frozen("V01", 0.0);
    let size = [128, 72];
    let mut normal = landscape("thesis", "thesis", &[]);
    let mut cheap = landscape("thesis_low", "thesis", &[]);
    let (a, b) = paired(
        15,
        || drop(draw(&mut normal, &view, size, HDR)),
        || drop(draw(&mut cheap, &view, size, HDR)),
    );
    println!(
        "normal {:.1} ms, low {:.1} ms of CPU at 128x72: {:.2} times",
        a * 1e3,
        b * 1e3,
        a / b
    );
    assert!(a / b > 1.9, "{}", a / b);
}

/// Least CPU seconds of two works, run in turns after one warm-up each. The least, because the time is the whole process's
/// and other tests run beside.
fn paired(rounds: usize, mut a: impl FnMut(), mut b: impl FnMut()) -> (f64, f64) {
    a();
    b();
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..rounds {
        for (i, work) in [&mut a as &mut dyn FnMut(), &mut b].into_iter().enumerate() {
            let start = cpu_seconds();
            work();
            times[i].push(cpu_seconds() - start);
        }
    }
    let least = |t: &[f64]| t.iter().copied().fold(f64::INFINITY, f64::min);
    (least(&times[0]), least(&times[1]))
}

/// The source's algorithm 5 shades inside the march, algorithm 6 after it. Both give the same picture; the times are
/// printed, since on a software device the layout may matter less than on the source's card.
#[test]
fn row_l40_marching_only_finds_the_hit() {
    let prelude = "
fn land() -> Terrain { return Terrain(vec2<i32>(3, 5), vec2<f32>(0.3, 0.6), 8192.0, 1400.0, 1.0, 2.0, 0.0, 1u); }
fn lit(dir: vec3<f32>, t: f32) -> f32 {
    let point = dir * t;
    let normal = terrain_normal(land(), 6.36e6, 2500.0, point, max(0.002 * t, 0.05), 8);
    let sun = vec3<f32>(0.6, 0.64, 0.48);
    let shadow = soft_shadow(land(), 6.36e6, 2500.0, point, normal, sun, 2.0, 3e4, 24.0, 0.5, 1.0, 40, 6);
    return 0.1 + max(dot(normal, sun), 0.0) * shadow.light;
}
fn sequential(dir: vec3<f32>) -> f32 {
    let hit = march(land(), 6.36e6, 2500.0, dir, 1.0, 3e4, 0.5, 1.0, 200, 8);
    if hit.distance < 0.0 { return 0.0; }
    return lit(dir, hit.distance);
}
fn nested(dir: vec3<f32>) -> f32 {
    var t = 1.0;
    var light = 0.0;
    for (var i = 0; i < 200; i++) {
        let clearance = ray_clearance(land(), 6.36e6, 2500.0, dir, t, 8);
        if clearance < 0.001 * t {
            light = lit(dir, t);
            break;
        }
        t += 0.5 * clearance;
        if t > 3e4 { break; }
    }
    return light;
}
";
    let imports = [
        "veduta::terrain::height::Terrain",
        "veduta::terrain::march::{march, ray_clearance}",
        "veduta::terrain::normal::terrain_normal",
        "veduta::terrain::shadow::soft_shadow",
    ];
    let make = |name: &str| {
        evaluator(
            &imports,
            prelude,
            &format!("{name}(normalize(vec3f(in.f[0], in.f[1], -1.0)))"),
            2,
        )
    };
    let (a, b) = (make("sequential"), make("nested"));
    let mut rows = Vec::new();
    for y in 0..72 {
        for x in 0..128 {
            rows.push(((x as f32 - 63.5) / 64.0).to_bits());
            rows.push(((30.0 - y as f32) / 64.0).to_bits());
        }
    }
    let (va, vb) = (a.run(&rows).unwrap(), b.run(&rows).unwrap());
    let worst = va
        .iter()
        .zip(&vb)
        .map(|(x, y)| (x - y).abs())
        .fold(0.0, f64::max);
    assert!(worst < 1e-3, "the layouts disagree by {worst}");
    assert!(va.iter().filter(|v| **v > 0.0).count() > va.len() / 4);
    let (ta, tb) = paired(9, || drop(a.run(&rows)), || drop(b.run(&rows)));
    println!(
        "march, then shade {:.1} ms; shade inside the march {:.1} ms of CPU: {:.2} times",
        ta * 1e3,
        tb * 1e3,
        tb / ta
    );
    assert!(
        ta < 1.5 * tb,
        "the sequential layout costs {ta}, the nested one {tb}"
    );
}

#[test]
fn a_still_frame_uploads_nothing_and_content_makes_no_pipeline() {
    let gpu = gpu();
    let mut land = landscape("thesis_skip", "thesis", &[]);
    let mut view = frozen("V01", 0.0);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut prepare = |land: &mut Landscape, view: &View| {
        land.prepare(&gpu.device, &gpu.queue, &mut encoder, view)
            .unwrap()
    };
    let written = |writes: u32, bytes: u64| Work {
        writes,
        bytes,
        ..Default::default()
    };
    let program = programs()
        .get("landscape", &["TERRAIN", "ATMOSPHERE", "CLOUDS"])
        .unwrap();
    let [of_view, of_content, of_anchors] =
        ["View", "Content", "Anchors"].map(|n| u64::from(program.layout(n).unwrap().size));
    let all = written(3, of_view + of_content + of_anchors);
    assert_eq!(land.resources().buffer_bytes, all.bytes);
    assert_eq!(prepare(&mut land, &view), all);
    assert_eq!(prepare(&mut land, &view), Work::default());
    // Time alone moves nothing.
    view.time += 1.0;
    assert_eq!(prepare(&mut land, &view), Work::default());
    // Each change writes the block that it concerns, once.
    let mut change = |land: &mut Landscape, view: &View, bytes: u64, what: &str| {
        assert_eq!(prepare(land, view), written(1, bytes), "{what}");
        assert_eq!(prepare(land, view), Work::default(), "{what}, again");
    };
    view.exposure = 2.0;
    change(&mut land, &view, of_view, "exposure");
    view.sun.to_light = direction(0.1, 1.0).as_vec3();
    change(&mut land, &view, of_view, "sun");
    land.set_frame(7);
    change(&mut land, &view, of_view, "frame");
    view.eye = view.eye.moved_by(DVec3::new(0.0, 10.0, 0.0));
    change(&mut land, &view, of_view, "altitude");
    view.eye = view.eye.moved_by(DVec3::new(10.0, 0.0, 0.0));
    change(&mut land, &view, of_anchors, "place");
    let before = land.pipeline().clone();
    let resources = land.resources();
    land.set_content("CLOUD_COVERAGE", Value::Float(0.9))
        .unwrap();
    land.set_content("TERRAIN_HEIGHT", Value::Float(500.0))
        .unwrap();
    change(&mut land, &view, of_content, "content");
    land.set_content("CLOUD_COVERAGE", Value::Float(0.9))
        .unwrap();
    assert_eq!(prepare(&mut land, &view), Work::default(), "the same value");
    land.set_content("CLOUD_SCALE", Value::Float(2000.0))
        .unwrap();
    assert_eq!(
        prepare(&mut land, &view),
        written(2, of_content + of_anchors),
        "a wavelength, on which the lattice depends"
    );
    assert_eq!(&before, land.pipeline(), "content made a new pipeline");
    assert_eq!(resources, land.resources(), "content made new resources");
    let refused = land.set_content("CLOUD_STEPS", Value::Int(3)).unwrap_err();
    assert!(refused.to_string().contains("a quality key"), "{refused}");
    // Another format needs another landscape, which owes nothing to the first.
    let options = LandscapeOptions {
        preset: Preset::ThesisSkip,
        ..Default::default()
    };
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut other = Landscape::new(&gpu.device, programs(), &targets(format), &options).unwrap();
    assert_ne!(&before, other.pipeline());
    assert_eq!(prepare(&mut other, &view), all);
}

/// What was left unwritten was there already: views in any order give the pictures of a landscape that has seen no other.
#[test]
fn a_view_that_comes_back_gives_the_same_picture() {
    let mut land = landscape("thesis_low", "thesis", &[]);
    let pictures = ["V01", "V01", "V03", "V01", "V03"].map(|name| {
        let picture = draw(&mut land, &frozen(name, 0.0), SMALL, HDR);
        let mut fresh = landscape("thesis_low", "thesis", &[]);
        let expected = draw(&mut fresh, &frozen(name, 0.0), SMALL, HDR);
        assert!(picture.pixels == expected.pixels, "{name}");
        picture
    });
    assert!(difference(&pictures[0], &pictures[2]) > 1e-3);
}

/// The features that a scene can name, and what only they bring: a word that the others' texts do not hold, and modules.
const FEATURES: [(&str, &[&str], &[&str]); 3] = [
    (
        "TERRAIN",
        &["terrain", "ridge", "snow", "rock_light", "soft_shadow"],
        &["height", "march", "material", "normal", "shadow"],
    ),
    (
        "ATMOSPHERE",
        &["atmos", "rayleigh", "mie_", "march_sky", "sun_disc"],
        &["march", "sun_disc"],
    ),
    ("CLOUDS", &["cloud"], &["composite", "field", "march"]),
];

/// Every set of features, with and without LOW_QUALITY.
fn feature_sets() -> Vec<Vec<&'static str>> {
    (0..16)
        .map(|bits| {
            let names = FEATURES.iter().map(|f| f.0).chain(["LOW_QUALITY"]);
            names
                .enumerate()
                .filter(|(i, _)| bits >> i & 1 == 1)
                .map(|(_, name)| name)
                .collect()
        })
        .collect()
}

/// Whether a set draws a feature: clouds are not drawn in low quality.
fn draws(set: &[&str], feature: &str) -> bool {
    set.contains(&feature) && !(feature == "CLOUDS" && set.contains(&"LOW_QUALITY"))
}

/// The text without what stands under flags that are off, and without any flag: written apart from the composer.
fn stripped(text: &str, on: &[&str]) -> String {
    let mut open: Vec<bool> = Vec::new();
    let mut kept = String::new();
    for line in text.lines() {
        let word = line.trim();
        if let Some(flag) = word.strip_prefix("#ifdef ") {
            open.push(on.contains(&flag));
        } else if let Some(flag) = word.strip_prefix("#ifndef ") {
            open.push(!on.contains(&flag));
        } else if word == "#else" {
            let last = open.last_mut().unwrap();
            *last = !*last;
        } else if word == "#endif" {
            open.pop().unwrap();
        } else if open.iter().all(|o| *o) {
            kept += line;
            kept.push('\n');
        }
    }
    assert!(open.is_empty());
    kept
}

#[test]
fn a_feature_that_is_not_named_adds_no_byte() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = Source::read(&[&root.join("wgsl"), &root.join("presets")]).unwrap();
    let text = std::fs::read_to_string(root.join("wgsl/programs/landscape.sp")).unwrap();
    let mut texts = std::collections::BTreeMap::new();
    for set in feature_sets() {
        let name = if set.is_empty() {
            "NOTHING".to_owned()
        } else {
            set.join("_")
        };
        let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join("stripped")
            .join(name);
        let _ = std::fs::remove_dir_all(&folder);
        copy(&root.join("wgsl"), &folder);
        std::fs::copy(root.join("presets/keys.ron"), folder.join("keys.ron")).unwrap();
        // The program as somebody would write it who has never heard of the other features, nor has their modules.
        let bare = stripped(&text, &set);
        assert!(!bare.contains("#if") && !bare.contains("#else"));
        std::fs::write(folder.join("programs/landscape.sp"), &bare).unwrap();
        for (feature, _, modules) in FEATURES {
            for module in modules.iter().filter(|_| !draws(&set, feature)) {
                let file = format!("{}/{module}.wgsl", feature.to_lowercase());
                std::fs::remove_file(folder.join(file)).unwrap();
            }
        }
        let by_hand = Source::read(&[&folder])
            .unwrap()
            .compose("landscape", &[])
            .unwrap();
        let by_flags = source.compose("landscape", &set).unwrap();
        assert!(
            by_hand.stages == by_flags.stages,
            "{set:?}: the texts differ"
        );
        assert_eq!(by_hand.bindings, by_flags.bindings, "{set:?}");
        assert_eq!(by_hand.overrides, by_flags.overrides, "{set:?}");
        assert_eq!(by_hand.structs, by_flags.structs, "{set:?}");
        // Neither is there a word of it.
        let whole: String = by_flags
            .stages
            .iter()
            .map(|s| s.wgsl.to_lowercase())
            .collect();
        for (feature, words, _) in FEATURES {
            for word in words {
                assert_eq!(
                    whole.contains(word),
                    draws(&set, feature),
                    "{set:?}: {word}"
                );
            }
        }
        // What is drawn decides on the text, and all of it.
        let drawn = FEATURES.map(|f| draws(&set, f.0));
        assert_eq!(texts.entry(drawn).or_insert(whole.clone()), &whole);
    }
    let distinct: std::collections::BTreeSet<_> = texts.values().collect();
    assert_eq!((texts.len(), distinct.len()), (8, 8));
}

fn copy(from: &std::path::Path, to: &std::path::Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).unwrap();
        }
    }
}

/// The landscape's account of what it keeps, against `wgpu`'s own.
#[test]
fn a_feature_that_is_not_named_allocates_nothing() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = Source::read(&[&root.join("wgsl"), &root.join("presets")]).unwrap();
    let mut set = programs().clone();
    // An instance of our own: other tests run beside.
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
    let count = || {
        let hub = instance.generate_report().unwrap().hub;
        [
            hub.render_pipelines,
            hub.compute_pipelines,
            hub.bind_groups,
            hub.buffers,
            hub.textures,
            hub.texture_views,
            hub.samplers,
            hub.query_sets,
        ]
        .map(|r| r.num_allocated as u32)
    };
    let view = frozen("V01", 0.0);
    for features in feature_sets() {
        let program = set.get_or_compose(&source, "landscape", &features).unwrap();
        let bindings = program.bindings.len() as u32;
        let size = |name: &str| program.layout(name).map_or(0, |l| u64::from(l.size));
        let bytes = size("View") + size("Content") + size("Anchors");
        let flags = FEATURES.iter().map(|f| f.0).chain(["LOW_QUALITY"]);
        let options = LandscapeOptions {
            values: flags
                .map(|f| (f.to_owned(), Value::Flag(features.contains(&f))))
                .collect(),
            ..Default::default()
        };
        let before = count();
        let mut land = Landscape::new(&device, &set, &targets(HDR), &options).unwrap();
        let after = count();
        let made: Vec<u32> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let kept = land.resources();
        assert_eq!(
            made,
            [
                kept.pipelines,
                0,
                kept.bind_groups,
                kept.buffers,
                kept.textures,
                0,
                kept.samplers,
                0
            ],
            "{features:?}"
        );
        // One block for the view, one for content, and a third for the lattices of terrain and clouds.
        let lattices = draws(&features, "TERRAIN") || draws(&features, "CLOUDS");
        assert_eq!(kept.bindings, 2 + u32::from(lattices), "{features:?}");
        assert_eq!((kept.bindings, kept.buffers), (bindings, bindings));
        assert_eq!(kept.buffer_bytes, bytes, "{features:?}");
        assert_eq!((kept.textures, kept.texture_bytes), (0, 0));
        let mut encoder = device.create_command_encoder(&Default::default());
        for expected in [bindings, 0] {
            let work = land.prepare(&device, &queue, &mut encoder, &view).unwrap();
            assert_eq!(work.writes, expected);
            assert_eq!((work.bakes, work.dispatches, work.draws), (0, 0, 0));
        }
        // Content that the program does not have is not uploaded either.
        for (feature, key) in [
            ("TERRAIN", "TERRAIN_HEIGHT"),
            ("ATMOSPHERE", "MIE_HEIGHT"),
            ("CLOUDS", "CLOUD_DENSITY"),
        ] {
            land.set_content(key, Value::Float(900.0)).unwrap();
            let work = land.prepare(&device, &queue, &mut encoder, &view).unwrap();
            assert_eq!(work.writes, u32::from(draws(&features, feature)), "{key}");
        }
        assert_eq!(count(), after, "{features:?}: `prepare` made something");
    }
}

#[test]
fn a_feature_that_is_not_named_does_no_work() {
    let view = frozen("V01", 0.0);
    let on = ("COUNT_OPERATIONS", Value::Flag(true));
    let counts = |set: &[&str]| {
        let mut values = vec![on, ("CLOUD_STEPS", Value::Int(8))];
        let flags = FEATURES.iter().map(|f| f.0).chain(["LOW_QUALITY"]);
        values.extend(flags.map(|f| (f, Value::Flag(set.contains(&f)))));
        let mut land = landscape("thesis", "thesis", &values);
        draw(&mut land, &view, SMALL, HDR).pixels
    };
    let with = |feature: &str, pixels: &[[f32; 4]]| {
        let some = |channel: usize| pixels.iter().any(|p| p[channel] > 0.0);
        match feature {
            "TERRAIN" => some(0),
            "ATMOSPHERE" => some(3),
            _ => some(1) && some(2),
        }
    };
    let all = feature_sets().into_iter().map(|set| (counts(&set), set));
    let all: Vec<(Vec<[f32; 4]>, Vec<&str>)> = all.collect();
    for (pixels, set) in &all {
        for feature in ["ATMOSPHERE", "CLOUDS"] {
            assert_eq!(
                with(feature, pixels),
                draws(set, feature),
                "{set:?}: {feature}"
            );
        }
        // Noise is evaluated by terrain and clouds, and by nothing else.
        let noisy = draws(set, "TERRAIN") || draws(set, "CLOUDS");
        assert_eq!(with("TERRAIN", pixels), noisy, "{set:?}");
    }
    // Without clouds the terrain costs what it costs with them, to the evaluation.
    let of = |set: &[&str]| &all.iter().find(|(_, s)| s == set).unwrap().0;
    let (clear, cloudy) = (
        of(&["TERRAIN", "ATMOSPHERE"]),
        of(&["TERRAIN", "ATMOSPHERE", "CLOUDS"]),
    );
    for (a, b) in clear.iter().zip(cloudy) {
        assert_eq!(a[0], b[0] - 6.0 * (b[1] + b[2]));
    }
}

#[test]
fn bad_input_gets_a_typed_error() {
    let device = &gpu().device;
    let new = |targets: Targets, options: LandscapeOptions| {
        Landscape::new(device, programs(), &targets, &options).unwrap_err()
    };
    let with = |name: &str, value: Value| LandscapeOptions {
        values: vec![(name.to_owned(), value)],
        ..Default::default()
    };
    let fault = |e: Error, parts: &[&str]| {
        let text = e.to_string();
        for part in parts {
            assert!(text.contains(part), "`{text}` lacks `{part}`");
        }
    };
    let ok = targets(HDR);
    fault(
        new(
            targets(wgpu::TextureFormat::Depth32Float),
            Default::default(),
        ),
        &["targets.color_format", "Depth32Float"],
    );
    fault(
        new(targets(wgpu::TextureFormat::R8Unorm), Default::default()),
        &["three channels"],
    );
    fault(
        new(
            Targets {
                sample_count: 3,
                ..ok
            },
            Default::default(),
        ),
        &["sample_count", "3", "1, 2, 4"],
    );
    fault(
        new(
            Targets {
                projection: veduta::landscape::Projection::Orthographic,
                ..ok
            },
            Default::default(),
        ),
        &["Perspective"],
    );
    fault(
        new(ok, with("CLOUD_STEPS", Value::Int(0))),
        &["CLOUD_STEPS", "0", "[1, 4096]"],
    );
    fault(
        new(ok, with("CLOUD_COVERAGE", Value::Float(f64::NAN))),
        &["CLOUD_COVERAGE", "NaN", "[0, 1]"],
    );
    fault(
        new(ok, with("CLOUD_COVERAGE", Value::Flag(true))),
        &["CLOUD_COVERAGE", "true", "f32"],
    );
    fault(
        new(ok, with("CLOUD_COVERAGES", Value::Int(1))),
        &["CLOUD_COVERAGES", "did you mean `CLOUD_COVERAGE`"],
    );
    fault(
        new(
            ok,
            LandscapeOptions {
                scene: "moon".into(),
                ..Default::default()
            },
        ),
        &["moon", "`thesis`"],
    );
    fault(
        new(
            ok,
            LandscapeOptions {
                preset: Preset::Named("ultra".into()),
                ..Default::default()
            },
        ),
        &["ultra", "`high`"],
    );
    let not_built = programs()
        .get("landscape", &["TERRAIN", "COUNT_OPERATIONS"])
        .unwrap_err();
    assert!(
        matches!(not_built, Error::VariantNotBuilt { .. }),
        "{not_built}"
    );
    fault(
        not_built,
        &[
            "COUNT_OPERATIONS",
            "nearest",
            "`ProgramSet::get_or_compose`",
        ],
    );
    assert!(matches!(
        programs().get("ocean", &[]).unwrap_err(),
        Error::UnknownProgram { .. }
    ));
    let mut land = landscape("thesis_low", "thesis", &[]);
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut refuse = |change: &dyn Fn(&mut View), part: &str| {
        let mut view = View::default();
        change(&mut view);
        let text = land
            .prepare(&gpu.device, &gpu.queue, &mut encoder, &view)
            .unwrap_err()
            .to_string();
        assert!(text.contains(part), "`{text}` lacks `{part}`");
    };
    refuse(&|v| v.exposure = -1.0, "view.exposure");
    refuse(&|v| v.time = f64::INFINITY, "view.time");
    refuse(&|v| v.sun.to_light = Vec3::ZERO, "view.sun.to_light");
    refuse(&|v| v.sun.irradiance.x = f32::NAN, "view.sun.irradiance");
    refuse(&|v| v.eye.frac.x = f32::NAN, "view.eye.frac");
    refuse(&|v| v.eye.cell.y = 1 << 40, "altitude");
    refuse(
        &|v| v.projection = veduta::glam::Mat4::ZERO,
        "view.projection",
    );
    refuse(&|v| v.jitter.x = 3.0, "view.jitter");
}

#[test]
fn every_colour_format_gets_its_own_output() {
    let view = frozen("V01", 0.0);
    let formats = [
        wgpu::TextureFormat::Rgba8Unorm,
        wgpu::TextureFormat::Rgba8UnormSrgb,
        HDR,
    ];
    let [unorm, srgb, hdr] = formats.map(|format| {
        let mut land = Landscape::new(
            &gpu().device,
            programs(),
            &targets(format),
            &LandscapeOptions {
                preset: Preset::ThesisLow,
                ..Default::default()
            },
        )
        .unwrap();
        draw(&mut land, &view, SMALL, format)
    });
    let mut worst = 0.0_f32;
    for ((a, b), radiance) in unorm.pixels.iter().zip(&srgb.pixels).zip(&hdr.pixels) {
        for c in 0..3 {
            // The sRGB target stores what the other was given, up to one step of rounding.
            assert!((a[c] - b[c]).abs() <= 1.01 / 255.0, "{a:?} {b:?}");
            let mapped = 1.0 - (-radiance[c]).exp();
            let encoded = if mapped <= 0.003_130_8 {
                12.92 * mapped
            } else {
                1.055 * mapped.powf(1.0 / 2.4) - 0.055
            };
            worst = worst.max((a[c] - encoded).abs());
        }
    }
    println!(
        "largest difference from the encoded tone map: {:.3} of a step",
        worst * 255.0
    );
    assert!(
        worst * 255.0 < 1.05,
        "dither moves by half a step and rounding by another"
    );
}

#[test]
fn row_w04_an_edit_shows_without_a_restart_and_a_bad_file_keeps_the_old_one() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("reload");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("paint.sp");
    let paint = |color: &str| {
        let text = format!(
            "#PROGRAM{{ paint }}#
#VERTEX{{ #CODE{{
@vertex fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {{
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}}
}}# }}#
#FRAGMENT{{ #CODE{{
@fragment fn draw() -> @location(0) vec4<f32> {{ return {color}; }}
}}# }}#"
        );
        std::fs::write(&file, text).unwrap();
    };
    paint("vec4<f32>(1.0, 0.0, 0.0, 1.0)");
    let mut reloader = Reloader::new(&[&folder], "paint", &[]).unwrap();
    let color = |reloader: &Reloader| {
        let target: wgpu::ColorTargetState = HDR.into();
        let ready = reloader
            .current()
            .pipeline(
                &gpu().device,
                &veduta::program::PipelineOptions {
                    targets: &[Some(target)],
                    ..Default::default()
                },
            )
            .unwrap();
        let picture = crate::common::draw_with([4, 4], HDR, |pass| {
            pass.set_pipeline(ready.render().unwrap());
            pass.draw(0..3, 0..1);
        });
        picture.pixels[5]
    };
    assert_eq!(color(&reloader), [1.0, 0.0, 0.0, 1.0]);
    assert!(!reloader.poll().unwrap(), "nothing has changed");
    paint("vec4<f32>(0.0, 1.0, 0.0, 1.0)");
    assert!(reloader.poll().unwrap());
    assert_eq!(color(&reloader), [0.0, 1.0, 0.0, 1.0]);
    paint("vec4<f32>(0.0, 1.0, 0.0)");
    let fault = reloader.poll().unwrap_err().to_string();
    assert!(fault.contains("paint.sp:8:"), "{fault}");
    assert_eq!(
        color(&reloader),
        [0.0, 1.0, 0.0, 1.0],
        "the old program stays"
    );
    paint("vec4<f32>(0.0, 0.0, 1.0, 1.0)");
    assert!(reloader.poll().unwrap());
    assert_eq!(color(&reloader), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn a_feature_that_a_program_never_mentions_makes_no_difference() {
    let with = programs()
        .get(
            "landscape",
            &["TERRAIN", "ATMOSPHERE", "A_FLAG_OF_ANOTHER_PROGRAM"],
        )
        .unwrap();
    assert_eq!(
        with,
        programs()
            .get("landscape", &["TERRAIN", "ATMOSPHERE"])
            .unwrap()
    );
    assert!(with.mentions.iter().any(|m| m == "COUNT_OPERATIONS"));
}
