//! Worley noise: against brute force, in its range, exact where nine or 27 cells are not enough.

use crate::common::{Random, evaluator};
use crate::noise::{ARGS_2D, ARGS_3D, fill, truth};
use crate::sweep::{Summary, Truth, assert_tight, cell, check_all, floats};
use veduta::reference::noise::worley::*;

const SWEEP: usize = 1_000_000;
/// So near to a tie, or to a point, the gradient is not determined.
const TIE: f64 = 2e-6;
const TIP: f64 = 1e-12;

fn of(name: &str) -> String {
    format!("veduta::noise::worley::{name}")
}

/// A period after the columns of [`fill`], small ones as often as large ones.
fn fill_periodic<const N: usize>(random: &mut Random, row: &mut [u32]) {
    fill::<N>(random, row);
    for axis in 0..N {
        let bits = random.bits();
        row[2 * N + 1 + axis] = 1 + ((bits as u32 >> 2) >> ((bits >> 32) % 30));
    }
}

fn sweep(
    name: &str,
    arguments: &str,
    columns: usize,
    fill: fn(&mut Random, &mut [u32]),
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Summary {
    let functions = [of(name)];
    let found = check_all(&functions, arguments, columns, SWEEP, fill, twin);
    assert_tight(&functions, &found);
    found[0]
}

fn kinked<const K: usize>(value: [f64; K], gap: f64) -> Truth {
    Truth {
        kink: gap < TIE || value[0] < TIP,
        ..truth(value)
    }
}

#[test]
fn worley_noise_2d_equals_brute_force() {
    let periodic =
        "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), vec2i(in.i[5], in.i[6]), in.u[4]";
    for tiled in [false, true] {
        let name = |before: &str, after: &str| {
            format!("{before}_2d{}{after}", if tiled { "_periodic" } else { "" })
        };
        let (arguments, columns) = if tiled { (periodic, 7) } else { (ARGS_2D, 5) };
        let fill = if tiled { fill_periodic::<2> } else { fill::<2> };
        let near = |r: &[u32]| {
            let period = tiled.then(|| cell(&r[5..]));
            nearest_points_2d(cell(r), floats(&r[2..]), period, 2, r[4])
        };
        let s = sweep(&name("worley_noise", ""), arguments, columns, fill, |r| {
            let [a, b, _] = near(r);
            truth([a.distance, b.distance])
        });
        assert!(s.low >= 0.0 && s.low < 0.01, "{s:?}");
        assert!(s.high > 1.0 && s.high <= 2_f64.sqrt(), "{s:?}");
        let first = name("worley_noise", "_slope");
        let s = sweep(&first, arguments, columns, fill, |r| {
            let [a, b, _] = near(r);
            kinked(a.slope(), b.distance - a.distance)
        });
        assert!(s.kinks < SWEEP / 1000, "{s:?}");
        let second = name("worley_second", "_slope");
        let s = sweep(&second, arguments, columns, fill, |r| {
            let [a, b, c] = near(r);
            let gap = (b.distance - a.distance).min(c.distance - b.distance);
            kinked(b.slope(), gap)
        });
        assert!(s.kinks < SWEEP / 100 && s.high <= 2.5_f64.sqrt(), "{s:?}");
    }
}

#[test]
fn worley_noise_3d_equals_brute_force() {
    let periodic = "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), \
         vec3i(in.i[7], in.i[8], in.i[9]), in.u[6]";
    for tiled in [false, true] {
        let name = |before: &str, after: &str| {
            format!("{before}_3d{}{after}", if tiled { "_periodic" } else { "" })
        };
        let (arguments, columns) = if tiled { (periodic, 10) } else { (ARGS_3D, 7) };
        let fill = if tiled { fill_periodic::<3> } else { fill::<3> };
        let near = |r: &[u32]| {
            let period = tiled.then(|| cell(&r[7..]));
            nearest_points_3d(cell(r), floats(&r[3..]), period, 2, r[6])
        };
        let s = sweep(&name("worley_noise", ""), arguments, columns, fill, |r| {
            let [a, b, _] = near(r);
            truth([a.distance, b.distance])
        });
        assert!(s.low >= 0.0 && s.low < 0.03, "{s:?}");
        assert!(s.high > 1.0 && s.high <= 3_f64.sqrt(), "{s:?}");
        let first = name("worley_noise", "_slope");
        let s = sweep(&first, arguments, columns, fill, |r| {
            let [a, b, _] = near(r);
            kinked(a.slope(), b.distance - a.distance)
        });
        assert!(s.kinks < SWEEP / 1000, "{s:?}");
        let second = name("worley_second", "_slope");
        let s = sweep(&second, arguments, columns, fill, |r| {
            let [a, b, c] = near(r);
            let gap = (b.distance - a.distance).min(c.distance - b.distance);
            kinked(b.slope(), gap)
        });
        assert!(s.kinks < SWEEP / 100 && s.high <= 3_f64.sqrt(), "{s:?}");
    }
}

#[test]
fn the_search_is_exact_where_the_next_cells_are_not_enough() {
    // Rows whose two nearest points do not both lie in the 3^n cells about them, found on a fine grid.
    let mut random = Random(31);
    let (mut rows2, mut rows3) = (vec![], vec![]);
    let (mut true2, mut true3) = (vec![], vec![]);
    let (mut first2, mut first3) = (0, 0);
    for k in 0..400_000 {
        let mut row = [0; 7];
        fill::<3>(&mut random, &mut row);
        let (c, seed) = (cell::<3>(&row), row[6]);
        // Mostly near a face or an edge of the cell, where it happens.
        let f: [f32; 3] = std::array::from_fn(|axis| {
            let t = random.unit();
            if (k >> axis) & 1 == 1 { 0.01 * t } else { t }
        });
        let exact = f.map(f64::from);
        let at = |reach| nearest_points_2d([c[0], c[1]], [exact[0], exact[1]], None, reach, seed);
        let (near, far) = (at(1), at(4));
        // What the twins use is as good as a much wider search.
        assert_eq!(at(2)[..2], far[..2]);
        if near[..2] != far[..2] {
            first2 += usize::from(near[0] != far[0]);
            rows2.extend([row[0], row[1], f[0].to_bits(), f[1].to_bits(), seed]);
            true2.extend([far[0].distance, far[1].distance]);
        }
        if k % 4 == 0 {
            let at = |reach| nearest_points_3d(c, exact, None, reach, seed);
            let (near, far) = (at(1), at(3));
            assert_eq!(at(2)[..2], far[..2]);
            if near[..2] != far[..2] {
                first3 += usize::from(near[0] != far[0]);
                rows3.extend([row[0], row[1], row[2]]);
                rows3.extend(f.map(f32::to_bits));
                rows3.push(seed);
                true3.extend([far[0].distance, far[1].distance]);
            }
        }
    }
    println!(
        "3^n cells are wrong at {} places in 2D ({first2} of the nearest), {} in 3D ({first3})",
        true2.len() / 2,
        true3.len() / 2
    );
    assert!(first2 > 10 && true2.len() > 200 && true3.len() > 2);
    for (name, arguments, columns, rows, expected) in [
        ("worley_noise_2d", ARGS_2D, 5, &rows2, &true2),
        ("worley_noise_3d", ARGS_3D, 7, &rows3, &true3),
    ] {
        let call = format!("{name}({arguments})");
        let found = evaluator(&[&of(name)], "", &call, columns)
            .run(rows)
            .unwrap();
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-6,
                "{name}: {found} {expected}"
            );
        }
    }
}

#[test]
fn points_are_where_the_twins_have_them_and_spread_evenly() {
    let columns = 7;
    let mut random = Random(32);
    let mut rows = vec![0; 1_000_000 * columns];
    for row in rows.chunks_exact_mut(columns) {
        fill::<3>(&mut random, row);
    }
    let run = |name: &str, arguments: &str| {
        evaluator(&[&of(name)], "", &format!("{name}({arguments})"), columns)
            .run(&rows)
            .unwrap()
    };
    let flat = run("cell_point_2d", "vec2i(in.i[0], in.i[1]), in.u[6]");
    let solid = run("cell_point_3d", "vec3i(in.i[0], in.i[1], in.i[2]), in.u[6]");
    for ((row, a), b) in rows
        .chunks(columns)
        .zip(flat.chunks(2))
        .zip(solid.chunks(3))
    {
        assert_eq!(a, cell_point_2d(cell(row), row[6]));
        assert_eq!(b, cell_point_3d(cell(row), row[6]));
    }
    // Counts in 10^n boxes of a block of cells: chi squared against evenness.
    let chi = |points: &[f64], n: usize| {
        let mut boxes = vec![0.0_f64; 10_usize.pow(n as u32)];
        for p in points.chunks(n) {
            boxes[p.iter().fold(0, |i, x| 10 * i + (10.0 * x) as usize)] += 1.0;
        }
        let mean = points.len() as f64 / (n * boxes.len()) as f64;
        let sum: f64 = boxes.iter().map(|b| (b - mean) * (b - mean) / mean).sum();
        (sum, boxes.len() as f64 - 1.0)
    };
    let cells = |k: i32| [k % 100 - 50, k / 100 % 100, k / 10_000];
    let flat: Vec<f64> = (0..1_000_000)
        .flat_map(|k| cell_point_2d([k % 1000, k / 1000], 5))
        .collect();
    let solid: Vec<f64> = (0..1_000_000)
        .flat_map(|k| cell_point_3d(cells(k), 5))
        .collect();
    for (name, (sum, free)) in [("2D", chi(&flat, 2)), ("3D", chi(&solid, 3))] {
        println!("{name} points: chi squared {sum:.0} of {free}");
        assert!((sum - free).abs() < 5.0 * (2.0 * free).sqrt(), "{name}");
    }
}

#[test]
fn worley_twins_differentiate_themselves_rightly() {
    let h = 1e-6;
    let mut random = Random(33);
    let mut compared = 0;
    for _ in 0..2000 {
        let mut row = [0; 7];
        fill::<3>(&mut random, &mut row);
        let (c, seed) = (cell::<3>(&row), row[6]);
        let f: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
        let near = nearest_points_3d(c, f, None, 2, seed);
        let gap = (near[1].distance - near[0].distance).min(near[2].distance - near[1].distance);
        if gap < 1e-3 || near[0].distance < 0.03 {
            continue;
        }
        for axis in 0..3 {
            let at = |d: f64| {
                let mut f = f;
                f[axis] += d;
                f
            };
            for noise in [worley_noise_3d_slope, worley_second_3d_slope] {
                let rise = noise(c, at(h), seed)[0] - noise(c, at(-h), seed)[0];
                let slope = noise(c, f, seed)[axis + 1];
                assert!((slope - rise / (2.0 * h)).abs() < 1e-7);
                compared += 1;
            }
        }
        // Unit gradients.
        let [_, x, y, z] = worley_noise_3d_slope(c, f, seed);
        assert!((x * x + y * y + z * z - 1.0).abs() < 1e-12);
    }
    assert!(compared > 8000, "{compared}");
}
