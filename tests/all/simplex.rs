//! Simplex noise: against the sum over all corners, in its range, continuous across cells.

use crate::common::{Random, evaluator};
use crate::noise::{ARGS_2D, ARGS_3D, fill, truth};
use crate::sweep::{Summary, Truth, assert_tight, cell, check_all, floats, random_cell};
use veduta::reference::noise::simplex::*;

const SWEEP: usize = 2_000_000;

fn of(name: &str) -> String {
    format!("veduta::noise::simplex::{name}")
}

fn sweep(
    name: &str,
    arguments: &str,
    columns: usize,
    fill: fn(&mut Random, &mut [u32]),
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Summary {
    let functions = [of(name), of(&format!("{name}_slope"))];
    let twin = |r: &[u32]| Truth {
        bar: [1e-6, 4e-6, 4e-6, 4e-6],
        ..twin(r)
    };
    let found = check_all(&functions, arguments, columns, SWEEP, fill, twin);
    assert_tight(&functions, &found);
    for s in &found {
        assert!(s.low >= -1.0 && s.high <= 1.0, "{s:?}");
        assert!(s.low < -0.85 && s.high > 0.85, "{s:?}");
    }
    found[0]
}

#[test]
fn simplex_noise_equals_the_sum_over_all_corners() {
    sweep("simplex_noise_2d", ARGS_2D, 5, fill::<2>, |r| {
        truth(simplex_noise_2d_slope(cell(r), floats(&r[2..]), r[4]))
    });
    sweep("simplex_noise_3d", ARGS_3D, 7, fill::<3>, |r| {
        truth(simplex_noise_3d_slope(cell(r), floats(&r[3..]), r[6]))
    });
    let fill_periodic_2d = |random: &mut Random, row: &mut [u32]| {
        fill::<2>(random, row);
        for axis in 0..2 {
            let bits = random.bits();
            row[5 + axis] = 1 + ((bits as u32 >> 2) >> ((bits >> 32) % 30));
        }
    };
    sweep(
        "simplex_noise_2d_periodic",
        "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), vec2i(in.i[5], in.i[6]), in.u[4]",
        7,
        fill_periodic_2d,
        |r| {
            let (c, f, size) = (cell(r), floats(&r[2..]), cell(&r[5..]));
            truth(simplex_noise_2d_periodic_slope(c, f, size, r[4]))
        },
    );
    let fill_periodic_3d = |random: &mut Random, row: &mut [u32]| {
        fill::<3>(random, row);
        for axis in 0..3 {
            let bits = random.bits();
            row[7 + axis] = 1 + ((bits as u32 >> 2) >> ((bits >> 32) % 30));
        }
    };
    sweep(
        "simplex_noise_3d_periodic",
        "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), \
         vec3i(in.i[7], in.i[8], in.i[9]), in.u[6]",
        10,
        fill_periodic_3d,
        |r| {
            let (c, f, size) = (cell(r), floats(&r[3..]), cell(&r[7..]));
            truth(simplex_noise_3d_periodic_slope(c, f, size, r[6]))
        },
    );
}

#[test]
fn simplex_twins_differentiate_themselves_rightly() {
    let h = 1e-5;
    let mut random = Random(41);
    for _ in 0..2000 {
        let mut row = [0; 7];
        fill::<3>(&mut random, &mut row);
        let c: [i32; 3] = cell(&row);
        let f: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
        let seed = row[6];
        for axis in 0..3 {
            let at = |d: f64| {
                let mut f = f;
                f[axis] += d;
                f
            };
            let slope = simplex_noise_3d_slope(c, f, seed)[axis + 1];
            let rise = simplex_noise_3d(c, at(h), seed) - simplex_noise_3d(c, at(-h), seed);
            assert!((slope - rise / (2.0 * h)).abs() < 1e-6);
            if axis < 2 {
                let (c, flat) = ([c[0], c[1]], |d: f64| [at(d)[0], at(d)[1]]);
                let slope = simplex_noise_2d_slope(c, flat(0.0), seed)[axis + 1];
                let rise = simplex_noise_2d(c, flat(h), seed) - simplex_noise_2d(c, flat(-h), seed);
                assert!((slope - rise / (2.0 * h)).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn simplex_noise_is_continuous_and_zero_at_its_corners() {
    let mut random = Random(42);
    for (n, width, arguments) in [(2, 3, ARGS_2D), (3, 4, ARGS_3D)] {
        let name = format!("simplex_noise_{n}d_slope");
        let columns = 2 * n + 1;
        let device = evaluator(&[&of(&name)], "", &format!("{name}({arguments})"), columns);
        // Across the faces of cells: the last of one, the first of the next.
        let mut rows = Vec::new();
        for k in 0..40_000 {
            let mut row = vec![0; columns];
            if n == 2 {
                fill::<2>(&mut random, &mut row);
            } else {
                fill::<3>(&mut random, &mut row);
            }
            let axis = k % n;
            row[n + axis] = 1_f32.to_bits();
            rows.extend(&row);
            row[axis] = row[axis].wrapping_add(1);
            row[n + axis] = 0;
            rows.extend(&row);
        }
        let values = device.run(&rows).unwrap();
        let jump = values
            .chunks(2 * width)
            .flat_map(|pair| (0..width).map(|k| (pair[k] - pair[k + width]).abs()))
            .fold(0.0, f64::max);
        println!("{n}D: values and slopes jump by at most {jump:.1e} across faces");
        assert!(jump < 4e-6);
        // The corners, and in 3D the centres.
        let mut rows = Vec::new();
        for k in 0..10_000_u32 {
            let mut row: Vec<u32> = (0..n).map(|_| random_cell(&mut random)).collect();
            let centre = n == 3 && k % 2 == 1;
            let odd = n == 2 && row[1] & 1 == 1;
            let x = if centre || odd { 0.5_f32 } else { 0.0 };
            row.extend((0..n).map(|axis| if axis == 0 || centre { x.to_bits() } else { 0 }));
            row.push(k);
            rows.extend(row);
        }
        let values = device.run(&rows).unwrap();
        assert!(values.chunks(width).all(|v| v[0] == 0.0), "{n}D");
    }
}

/// The largest noise at a place: each corner's vector is the one that points there best.
fn largest(t: [f64; 3], n: usize) -> f64 {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let mut sum = 0.0;
    for index in 0..6_i32.pow(n as u32) {
        let offset: [f64; 3] =
            std::array::from_fn(|axis| f64::from(index / 6_i32.pow(axis as u32) % 6 - 2));
        if n == 2 {
            let shift = 0.5 * offset[1].rem_euclid(2.0);
            let d2 = (t[0] - offset[0] + shift).powi(2) + (t[1] - offset[1]).powi(2);
            sum += SCALE_2D * (0.8 - d2).max(0.0).powi(4) * (2.0 * d2).sqrt();
            continue;
        }
        for place in [0.0, 0.5] {
            let mut d: [f64; 3] =
                std::array::from_fn(|axis| (t[axis] - offset[axis] - place).abs());
            let d2: f64 = d.iter().map(|x| x * x).sum();
            d.sort_by(f64::total_cmp);
            let along = 1.3847 * (golden * d[2] + d[1]) / golden.hypot(1.0);
            sum += SCALE_3D * (0.5 - d2).max(0.0).powi(4) * along;
        }
    }
    sum
}

#[test]
fn simplex_noise_just_fits_its_range() {
    for n in [2, 3] {
        let steps = if n == 2 { 200_i32 } else { 24 };
        let mut best = (0.0_f64, [0.0; 3]);
        for index in 0..steps.pow(n as u32) {
            let t: [f64; 3] = std::array::from_fn(|axis| {
                f64::from(index / steps.pow(axis as u32) % steps) / f64::from(steps)
            });
            if largest(t, n) > best.0 {
                best = (largest(t, n), t);
            }
        }
        let mut step = 0.02;
        while step > 1e-8 {
            let mut better = false;
            for axis in 0..n {
                for side in [-step, step] {
                    let mut next = best.1;
                    next[axis] += side;
                    if largest(next, n) > best.0 {
                        best = (largest(next, n), next);
                        better = true;
                    }
                }
            }
            if !better {
                step /= 2.0;
            }
        }
        println!("{n}D: at most {} at {:?}", best.0, best.1);
        assert!(best.0 <= 1.0 - 1e-6 && best.0 > 0.9999, "{n}D: {}", best.0);
    }
}
