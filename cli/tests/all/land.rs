//! `veduta land`, `veduta probe height`, `veduta probe terrain`, `veduta bench terrain`: what they write, small.

use std::path::Path;

use veduta::WorldPos;
use veduta::terrain::{Land, TerrainRay};

use crate::common::{exr, folder, json, png, veduta};

fn read(path: &Path) -> (Vec<u64>, Vec<f32>) {
    let file = npyz::NpyFile::new(std::fs::File::open(path).unwrap()).unwrap();
    (file.shape().to_vec(), file.into_vec().unwrap())
}

fn lines<const N: usize>(rows: &[[f64; N]]) -> String {
    rows.iter()
        .map(|row| row.map(|v| v.to_string()).join(",") + "\n")
        .collect()
}

#[test]
fn heights_stand_in_the_order_of_their_places() {
    let dir = folder("probe_height");
    let places = [[0.0, 0.0], [1500.0, -300.0], [1e9, -2e9]];
    std::fs::write(dir.join("places.csv"), lines(&places)).unwrap();
    let land = Land::named("alps").unwrap();
    let field = land.field.prepare::<f64>().unwrap();
    for (on, most) in [("reference", 1e-3), ("cpu", 0.03), ("device", 0.03)] {
        veduta(
            &dir,
            &[
                "probe",
                "height",
                "--scene",
                "alps",
                "--points",
                "places.csv",
                "--footprint",
                "3",
                "--on",
                on,
                "--out",
                "h.npy",
            ],
        )
        .good();
        let (shape, found) = read(&dir.join("h.npy"));
        assert_eq!(shape.iter().product::<u64>(), 3, "{shape:?}");
        assert_eq!(shape[0], 3);
        for ([x, z], h) in places.iter().zip(found) {
            let truth = field
                .ground(WorldPos::from_metres([*x, 0.0, *z].into()), 3.0)
                .height;
            assert!((f64::from(h) - truth).abs() < most, "{on}: {h} {truth}");
        }
    }
    let run = |name: &str, text: &str| {
        std::fs::write(dir.join(name), text).unwrap();
        veduta(
            &dir,
            &["probe", "height", "--points", name, "--out", "h.csv"],
        )
    };
    run("far.csv", "1e17,0\n").bad(1, &["row 0", "9e15"]);
    std::fs::write(
        dir.join("own.ron"),
        "(field: (kind: Own(gain: 2, smoothness: 0), wavelength: 4096, amplitude: 300, octaves: 8, hurst: 0.9))",
    )
    .unwrap();
    std::fs::write(dir.join("here.csv"), "0,0\n").unwrap();
    for on in ["cpu", "device", "reference"] {
        let arguments = [
            "probe", "height", "--scene", "own.ron", "--points", "here.csv", "--on", on, "--out",
            "h.npy",
        ];
        veduta(&dir, &arguments).bad(1, &["field.kind", "Own"]);
    }
    let rest = ["--out", "h.npy"];
    for (more, named) in [
        (["--footprint", "-1"], "--footprint"),
        (["--footprint", "NaN"], "--footprint"),
        (["--scene", "nowhere"], "nowhere"),
    ] {
        let arguments = [
            &["probe", "height", "--points", "here.csv"],
            &more[..],
            &rest,
        ]
        .concat();
        let answer = veduta(&dir, &arguments);
        answer.bad(1, &[named]);
    }
    std::fs::write(dir.join("pole.csv"), "95,0\n").unwrap();
    let arguments = [
        "probe", "height", "--scene", "terra", "--points", "pole.csv", "--out", "h.npy",
    ];
    veduta(&dir, &arguments).bad(1, &["row 0", "95"]);
}

#[test]
fn hits_are_distance_normal_and_height() {
    let dir = folder("probe_terrain");
    let rows = [
        [0.0, 5000.0, 0.0, 0.0, -1.0, 0.0, 1e5],
        [1000.0, 5000.0, -2000.0, 0.6, -0.8, 0.0, 1e5],
        [0.0, 5000.0, 0.0, 0.0, 1.0, 0.0, 1e5],
        [0.0, 5000.0, 0.0, 0.0, -1.0, 0.0, 10.0],
        [-3000.0, 5000.0, 0.0, 0.0, -0.28, 0.96, f64::INFINITY],
    ];
    std::fs::write(dir.join("rays.csv"), lines(&rows)).unwrap();
    let land = Land::named("thesis").unwrap();
    let rays = rows.map(|[x, y, z, u, v, w, far]| TerrainRay {
        origin: WorldPos::from_metres([x, y, z].into()),
        dir: [u, v, w],
        far,
    });
    let truth = land.ray_hits(&rays, 0.002).unwrap();
    for path in ["reference", "textbook", "fast"] {
        veduta(
            &dir,
            &[
                "probe",
                "terrain",
                "--scene",
                "thesis",
                "--rays",
                "rays.csv",
                "--pixel-angle",
                "0.002",
                "--path",
                path,
                "--out",
                "hits.npy",
            ],
        )
        .good();
        let (shape, found) = read(&dir.join("hits.npy"));
        assert_eq!(shape, [5, 5]);
        for (row, t) in found.chunks(5).zip(&truth) {
            if !t.distance.is_finite() {
                assert_eq!(row, [f32::INFINITY, 0.0, 0.0, 0.0, 0.0], "{path}");
                continue;
            }
            let [distance, x, y, z, height] = [0, 1, 2, 3, 4].map(|k| f64::from(row[k]));
            // The march stops a thousandth of the distance above the ground.
            let most = if path == "textbook" { 0.004 } else { 1e-5 } * t.distance;
            assert!(
                (distance - t.distance).abs() < most + 0.05,
                "{path}: {row:?} {t:?}"
            );
            assert!(
                (x * x + y * y + z * z - 1.0).abs() < 1e-4 && y > 0.0,
                "{path}: {row:?}"
            );
            let turn = x * t.normal[0] + y * t.normal[1] + z * t.normal[2];
            assert!(path == "textbook" || turn > 0.99, "{path}: {row:?} {t:?}");
            assert!(
                (height - t.height).abs() < most + 1.0,
                "{path}: {row:?} {t:?}"
            );
        }
    }
    std::fs::write(dir.join("bad.csv"), "0,0,0,0,-2,0,1\n").unwrap();
    veduta(
        &dir,
        &["probe", "terrain", "--rays", "bad.csv", "--out", "h.csv"],
    )
    .bad(1, &["row 0", "direction"]);
}

#[test]
fn a_land_is_drawn_under_its_sky() {
    let dir = folder("land");
    let run = |more: &[&str]| {
        let mut line = vec![
            "land", "--land", "hills", "--preset", "low", "--size", "16x9", "--frames", "2",
        ];
        line.extend(more);
        veduta(&dir, &line).good()
    };
    let said = run(&["--out", "a.png"]);
    assert!(said.out.contains("processor ms a frame"), "{}", said.out);
    let (width, height, bytes) = png(&dir.join("a.png"));
    assert_eq!((width, height, bytes.len()), (16, 9, 3 * 16 * 9));
    run(&["--out", "b.exr", "--exposure", "1"]);
    let (width, height, light) = exr(&dir.join("b.exr"));
    assert_eq!((width, height), (16, 9));
    // Blue above, and not below.
    let mean = |rows: std::ops::Range<usize>, c: usize| {
        light[48 * rows.start..48 * rows.end]
            .iter()
            .skip(c)
            .step_by(3)
            .sum::<f32>()
            / (16 * rows.len()) as f32
    };
    assert!(mean(0..2, 2) > 1.3 * mean(0..2, 0), "{light:?}");
    assert!(mean(7..9, 2) < 1.3 * mean(7..9, 0));
    assert!(light.iter().all(|v| v.is_finite() && *v >= 0.0));
    veduta(&dir, &["land", "--land", "venus", "--out", "c.png"]).bad(1, &["venus", "alps"]);
    // A place is two numbers, with a comma or a space between them.
    run(&["--out", "d.png", "--place", "-500,250"]);
    run(&["--out", "e.png", "--place", "-500", "250"]);
    assert_eq!(png(&dir.join("d.png")), png(&dir.join("e.png")));
    assert_ne!(png(&dir.join("d.png")), png(&dir.join("a.png")));
    let one = ["land", "--land", "hills", "--out", "f.png", "--place", "7"];
    veduta(&dir, &one).bad(1, &["--place", "two numbers"]);
}

#[test]
fn the_bench_of_the_terrain_has_its_tables() {
    let dir = folder("bench_terrain");
    let said = veduta(
        &dir,
        &[
            "bench",
            "terrain",
            "--views",
            "V01",
            "--size",
            "16x9",
            "--rounds",
            "1",
            "--most-rounds",
            "1",
            "--clock",
            "cpu",
            "--out",
            "t.md",
        ],
    )
    .good();
    let text = std::fs::read_to_string(dir.join("t.md")).unwrap();
    assert!(said.out.contains("# What the terrain costs"));
    for head in [
        "`high` joined from 1/2 [ms]",
        "`low` joined from 13/50 [ms]",
        "/ thesis",
        "flight [ms]",
        "baked",
        "alone",
        "wrong [%]",
        "at the silhouette [%]",
        "99 %",
    ] {
        assert!(text.contains(head), "{head}: {text}");
    }
    let report = json(&dir.join("t.json"));
    let view = &report["views"][0];
    assert_eq!(view["view"], "V01");
    assert!(view["ground"].as_f64().unwrap() > 0.1);
    assert_eq!(view["hits"]["rays"], 144);
    assert_eq!(view["hits"]["wrong"], 0);
    assert!(view["hits"]["centile_99"].as_f64().unwrap() < 0.5);
    for (preset, name) in view["presets"]
        .as_array()
        .unwrap()
        .iter()
        .zip(["high", "low"])
    {
        assert_eq!(preset["preset"], name);
        for number in [
            "alone_psnr",
            "psnr",
            "flight_psnr",
            "first_bake",
            "flight_draw",
            "flight_bake",
        ] {
            assert!(preset[number].as_f64().unwrap() > 0.0, "{name} {number}");
        }
    }
}
