//! `veduta simulate`: states, heights from files, pictures.

use npyz::WriterBuilder as _;
use veduta_cli::image::read_png;

use crate::common::{folder, json, veduta};

#[test]
fn simulate_draws_under_the_sky_and_from_above() {
    let here = folder("simulate");
    // A hollow of 24 x 20 cells, in metres.
    let heights: Vec<f32> = (0..24 * 20)
        .map(|k| {
            let (x, z) = ((k % 24) as f32 - 12.0, (k / 24) as f32 - 10.0);
            0.05 * (x * x + z * z) - 2.0
        })
        .collect();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[20, 24])
        .writer(std::fs::File::create(here.join("hollow.npy")).unwrap())
        .begin_nd()
        .unwrap();
    writer.extend(heights.iter().copied()).unwrap();
    writer.finish().unwrap();
    std::fs::write(
        here.join("pond.ron"),
        "(heights: (file: \"hollow.npy\"), columns: 24, rows: 20, depth: 1.5, options: (boundary: Closed))",
    )
    .unwrap();
    let common = [
        "--steps", "40", "--frames", "20", "--quiet", "--size", "64x48",
    ];
    let run = |more: &[&str]| veduta(&here, &[&["simulate"], &common[..], more].concat());
    run(&[
        "--scene",
        "pond.ron",
        "--pictures",
        "sky.png",
        "--out",
        "a.npy",
        "--stats",
        "a.json",
    ])
    .good();
    run(&[
        "--heights",
        "hollow.npy",
        "--set",
        "DEPTH=1.5",
        "--set",
        "BOUNDARY=closed",
        "--set",
        "RAIN=0",
        "--set",
        "EVAPORATION=0",
        "--set",
        "SCHEME=source",
        "--set",
        "STEP=0.25",
        "--set",
        "SPACING=1",
        "--pictures",
        "map.png",
        "--map",
        "--out",
        "b.npy",
        "--stats",
        "b.json",
    ])
    .good();
    // A scene with a map is the map in a scene.
    let bytes = |name: &str| std::fs::read(here.join(name)).unwrap();
    assert_eq!(bytes("a.npy"), bytes("b.npy"));
    for (name, size) in [("sky", (64, 48)), ("map", (24, 20))] {
        for number in 0..3 {
            let file = here.join(format!("{name}_000{number}.png"));
            let (width, height, rgb) = read_png(&file).unwrap();
            assert_eq!((width, height), size, "{}", file.display());
            let [low, high] = [rgb.iter().min(), rgb.iter().max()].map(|v| *v.unwrap());
            assert!(high > low + 60, "{} is flat", file.display());
        }
    }
    // The water runs together.
    assert_ne!(bytes("sky_0000.png"), bytes("sky_0002.png"));
    run(&["--eye", "1,2"]).bad(2, &["--eye", "three"]);
    run(&["--eye", "-5,30,-5", "--target", "-5,30,-5"]).bad(1, &["camera.target"]);
    run(&["--heights", "lost.npy"]).bad(1, &["lost.npy"]);
    run(&["--scene", "pond.ron", "--exposure=-1"]).bad(1, &["--exposure"]);
}

fn floats(path: &std::path::Path, shape: &[u64], numbers: &[f32]) {
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(std::fs::File::create(path).unwrap())
        .begin_nd()
        .unwrap();
    writer.extend(numbers.iter().copied()).unwrap();
    writer.finish().unwrap();
}

/// A run goes on through its file bit for bit, though what is dug has taken the least height over the half of a metre; states have 8 channels too, and channels first.
#[test]
fn simulate_goes_on_from_a_file() {
    let here = folder("simulate_in");
    std::fs::write(
        here.join("dug.ron"),
        "(options: (boundary: Closed, rain: 1e-3, erosion: Some((capacity: 2.0, dig: 0.5, lay: 0.5))))",
    )
    .unwrap();
    let run = |more: &[&str]| {
        let common = ["simulate", "--scene", "dug.ron", "--quiet"];
        veduta(&here, &[&common[..], more].concat())
    };
    // Least height 700.5001 m, with a spring's worth of water on it.
    let (rows, columns) = (20, 24);
    let cells: Vec<[f32; 8]> = (0..rows * columns)
        .map(|k| {
            let (x, z) = ((k % columns) as f32 - 9.0, (k / columns) as f32 - 8.0);
            let height = 700.5001 + 0.037 * (x * x + z * z) + 0.3 * (1.7 * x).sin().abs();
            [height, 0.3, 0.0, 0.1, 0.2, 0.0, 0.0, 0.1]
        })
        .collect();
    let shape = [rows as u64, columns as u64, 8];
    floats(&here.join("cells.npy"), &shape, cells.as_flattened());
    let planes: Vec<f32> = (0..8)
        .flat_map(|k| cells.iter().map(move |c| c[k]))
        .collect();
    floats(&here.join("planes.npy"), &[8, shape[0], shape[1]], &planes);
    let steps = |from: &str, steps: &str, to: &str| {
        let stats = format!("{to}.json");
        let arguments = ["--in", from, "--steps", steps, "--out", to];
        run(&[&arguments[..], &["--stats", &stats]].concat()).good();
    };
    steps("cells.npy", "120", "whole.npy");
    steps("planes.npy", "120", "planes_after.npy");
    steps("cells.npy", "80", "half.npy");
    steps("half.npy", "40", "rest.npy");
    let bytes = |name: &str| std::fs::read(here.join(name)).unwrap();
    let least = json(&here.join("half.npy.json"))["ground_min_m"]
        .as_f64()
        .unwrap();
    assert!(least < 700.5, "nothing was dug: {least}");
    assert!(bytes("whole.npy") == bytes("planes_after.npy"));
    assert!(bytes("whole.npy") == bytes("rest.npy"));
    run(&["--in", "cells.npy", "--heights", "cells.npy"]).bad(2, &["--heights"]);
}
