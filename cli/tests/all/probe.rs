//! `veduta probe`.

use std::path::Path;

use npyz::WriterBuilder as _;
use veduta::Atmosphere;
use veduta::atmosphere::{Orders, ProbeRay};
use veduta::reference::probe::{Effort, probe};

use crate::common::{folder, veduta};

fn write(path: &Path, rows: &[[f64; 8]]) {
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[rows.len() as u64, 8])
        .writer(std::fs::File::create(path).unwrap())
        .begin_nd()
        .unwrap();
    writer.extend(rows.iter().flatten().copied()).unwrap();
    writer.finish().unwrap();
}

fn read(path: &Path) -> (Vec<u64>, Vec<f32>) {
    let file = npyz::NpyFile::new(std::fs::File::open(path).unwrap()).unwrap();
    (file.shape().to_vec(), file.into_vec().unwrap())
}

/// From the ground, from within the air to a near place, from space to the limb and past it.
const ROWS: [[f64; 8]; 4] = [
    [2.0, 0.6, 0.8, 0.0, 0.0, 0.6, 0.8, f64::INFINITY],
    [9000.0, 0.0, -0.6, 0.8, 0.8, 0.6, 0.0, 3000.0],
    [
        4e5,
        0.943_870_5,
        -0.330_316_9,
        0.0,
        0.0,
        1.0,
        0.0,
        f64::INFINITY,
    ],
    [4e5, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, f64::INFINITY],
];

#[test]
fn the_reference_is_that_of_the_library() {
    let dir = folder("probe_reference");
    write(&dir.join("rays.npy"), &ROWS);
    let run = |more: &[&str]| {
        let mut line = vec!["probe", "sky", "--rays", "rays.npy", "--out", "l.npy"];
        line.extend(more);
        veduta(&dir, &line)
    };
    run(&[
        "--atmosphere",
        "hazy",
        "--albedo",
        "0.3",
        "--path",
        "reference",
        "--orders",
        "all",
        "--samples",
        "500",
        "--seed",
        "7",
        "--errors",
        "e.npy",
    ])
    .good();
    let (shape, light) = read(&dir.join("l.npy"));
    assert_eq!(shape, [4, 6]);
    let (shape, errors) = read(&dir.join("e.npy"));
    assert_eq!(shape, [4, 3]);
    let mut air = Atmosphere::named("hazy").unwrap();
    air.ground_albedo = [0.3; 3];
    let rays: Vec<ProbeRay> = (0..4)
        .map(|i| ProbeRay::from_row(i, ROWS[i]).unwrap())
        .collect();
    let effort = Effort {
        samples: 500,
        seed: 7,
        ..Effort::default()
    };
    let expected = probe(&air, &rays, Orders::All, &effort).unwrap();
    for (i, e) in expected.iter().enumerate() {
        for c in 0..3 {
            assert_eq!(light[6 * i + c], e.in_scatter[c] as f32);
            assert_eq!(light[6 * i + 3 + c], e.transmittance[c] as f32);
            assert_eq!(errors[3 * i + c], e.error[c] as f32);
        }
    }
    assert_eq!(light[18..], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    // A file of one's own, given once more as CSV, is the same as the shipped one.
    let own = air.to_ron().unwrap();
    std::fs::write(dir.join("own.ron"), own).unwrap();
    let text: String = ROWS
        .iter()
        .map(|row| row.map(|x| x.to_string()).join(",") + "\n")
        .collect();
    std::fs::write(dir.join("rays.csv"), text).unwrap();
    veduta(
        &dir,
        &[
            "probe",
            "sky",
            "--atmosphere",
            "own.ron",
            "--rays",
            "rays.csv",
            "--orders",
            "single",
            "--out",
            "once.npy",
        ],
    )
    .good();
    let (_, once) = read(&dir.join("once.npy"));
    assert!(once[0] > 0.0 && once[0] < light[0]);
    assert_eq!(once[3..6], light[3..6]);
}

/// Every path and both orders find the light of the reference: once scattered to 3 %, of all orders to 8 % and what paths leave open.
#[test]
fn every_path_meets_the_reference() {
    let dir = folder("probe_paths");
    let rows: Vec<[f64; 8]> = [0.3_f64, 1.0, 1.4]
        .iter()
        .flat_map(|zenith| {
            let (up, flat) = (zenith.cos(), zenith.sin());
            [[2.0, flat], [5000.0, -flat]]
                .map(|[h, x]| [h, x, up, 0.0, 0.8, 0.6, 0.0, f64::INFINITY])
        })
        .collect();
    write(&dir.join("rays.npy"), &rows);
    let run = |path: &str, orders: &str, out: &str| {
        let line = [
            "probe", "sky", "--rays", "rays.npy", "--path", path, "--orders", orders, "--out", out,
        ];
        let samples = ["--samples", "20000", "--errors", "e.npy"];
        let reference = path == "reference" && orders == "all";
        let line = [&line[..], if reference { &samples } else { &[] }].concat();
        veduta(&dir, &line).good();
        let (shape, light) = read(&dir.join(out));
        assert_eq!(shape, [6, 6]);
        light
    };
    for (orders, bar) in [("single", 0.03), ("all", 0.08)] {
        let truth = run("reference", orders, "t.npy");
        let own = match orders {
            "all" => read(&dir.join("e.npy")).1,
            _ => vec![0.0; 18],
        };
        for path in ["textbook", "fast"] {
            let found = run(path, orders, "f.npy");
            for (i, (f, t)) in found.iter().zip(&truth).enumerate() {
                let (ray, c) = (i / 6, i % 6);
                let open = if c < 3 { 3.0 * own[3 * ray + c] } else { 0.0 };
                assert!(
                    (f - t).abs() <= bar * t + open,
                    "{path} {orders} ray {ray}, {c}: {f} of {t}"
                );
            }
        }
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let dir = folder("probe_faults");
    write(&dir.join("rays.npy"), &ROWS);
    let run = |more: &[&str]| {
        let mut line = vec!["probe", "sky", "--out", "l.npy"];
        line.extend(more);
        veduta(&dir, &line)
    };
    run(&["--rays", "rays.npy", "--atmosphere", "venus"]).bad(1, &["`venus`", "`mars`"]);
    run(&["--rays", "rays.npy", "--atmosphere", "no.ron"]).bad(1, &["no.ron"]);
    run(&["--rays", "rays.npy", "--albedo", "1.5"]).bad(1, &["ground_albedo", "1.5", "[0.0, 1.0]"]);
    run(&["--rays", "rays.npy", "--samples", "1"]).bad(2, &["2..="]);
    run(&["--rays", "rays.npy", "--path", "table"]).bad(2, &["textbook"]);
    run(&["--rays", "rays.npy", "--path", "fast", "--errors", "e.npy"]).bad(1, &["--errors"]);
    std::fs::write(dir.join("bad.ron"), "(planet_radius: 1)").unwrap();
    run(&["--rays", "rays.npy", "--atmosphere", "bad.ron"]).bad(1, &["bad.ron", "1:"]);
    let mut rows = ROWS;
    rows[2][0] = -3.0;
    write(&dir.join("below.npy"), &rows);
    run(&["--rays", "below.npy"]).bad(1, &["below.npy", "altitude of row 2", "-3", "at least 0"]);
    rows = ROWS;
    rows[1][2] = 0.5;
    write(&dir.join("short.npy"), &rows);
    run(&["--rays", "short.npy"]).bad(1, &["direction of row 1", "[0.999, 1.001]"]);
    std::fs::write(dir.join("few.csv"), "1,2,3\n").unwrap();
    run(&["--rays", "few.csv"]).bad(1, &["few.csv", "8"]);
    assert!(!dir.join("l.npy").exists());
}
