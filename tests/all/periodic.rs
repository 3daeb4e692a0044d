//! Noises that repeat: against their twins, and bit by bit the same one period on.

use crate::common::{Random, evaluator};
use crate::noise::{fill, truth};
use crate::sweep::{assert_tight, cell, check_all, floats};
use veduta::reference::noise::*;

const SWEEP: usize = 2_000_000;
const AT_2D: &str =
    "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), vec2i(in.i[5], in.i[6]), in.u[4]";
const AT_3D: &str = "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), \
     vec3i(in.i[7], in.i[8], in.i[9]), in.u[6]";

/// Columns of [`fill`], then a period: from 1 to 2^30, small ones as often as large ones.
fn fill_periodic<const N: usize>(random: &mut Random, row: &mut [u32]) {
    fill::<N>(random, row);
    for axis in 0..N {
        let bits = random.bits();
        row[2 * N + 1 + axis] = 1 + ((bits as u32 >> 2) >> ((bits >> 32) % 30));
    }
}

#[test]
fn periodic_value_and_gradient_noise_equal_their_twins() {
    let of = |module: &str, name: &str| {
        let path = format!("veduta::noise::{module}::{name}");
        [path.clone(), format!("{path}_slope")]
    };
    let value = of("value", "value_noise_2d_periodic");
    let found = check_all(&value, AT_2D, 7, SWEEP, fill_periodic::<2>, |r| {
        let (c, f, size) = (cell(r), floats(&r[2..]), cell(&r[5..]));
        truth(value_noise_2d_periodic_slope(c, f, size, r[4]))
    });
    assert_tight(&value, &found);
    let value = of("value", "value_noise_3d_periodic");
    let found = check_all(&value, AT_3D, 10, SWEEP, fill_periodic::<3>, |r| {
        let (c, f, size) = (cell(r), floats(&r[3..]), cell(&r[7..]));
        truth(value_noise_3d_periodic_slope(c, f, size, r[6]))
    });
    assert_tight(&value, &found);
    let gradient = of("gradient", "gradient_noise_2d_periodic");
    let found = check_all(&gradient, AT_2D, 7, SWEEP, fill_periodic::<2>, |r| {
        let (c, f, size) = (cell(r), floats(&r[2..]), cell(&r[5..]));
        truth(gradient_noise_2d_periodic_slope(c, f, size, r[4]))
    });
    assert_tight(&gradient, &found);
    let gradient = of("gradient", "gradient_noise_3d_periodic");
    let found = check_all(&gradient, AT_3D, 10, SWEEP, fill_periodic::<3>, |r| {
        let (c, f, size) = (cell(r), floats(&r[3..]), cell(&r[7..]));
        truth(gradient_noise_3d_periodic_slope(c, f, size, r[6]))
    });
    assert_tight(&gradient, &found);
}

#[test]
fn periodic_twins_differentiate_themselves_rightly() {
    let h = 1e-5;
    let mut random = Random(53);
    for _ in 0..1000 {
        let mut row = [0; 10];
        fill_periodic::<3>(&mut random, &mut row);
        let size: [i32; 3] = std::array::from_fn(|axis| 1 + row[7 + axis].cast_signed() % 6);
        let (c, seed) = (cell::<3>(&row), row[6]);
        let f: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
        for axis in 0..3 {
            let at = |d: f64| {
                let mut f = f;
                f[axis] += d;
                f
            };
            for noise in [
                value_noise_3d_periodic_slope,
                gradient_noise_3d_periodic_slope,
                simplex::simplex_noise_3d_periodic_slope,
            ] {
                let rise = noise(c, at(h), size, seed)[0] - noise(c, at(-h), size, seed)[0];
                let slope = noise(c, f, size, seed)[axis + 1];
                assert!((slope - rise / (2.0 * h)).abs() < 1e-6);
            }
            if axis == 2 {
                continue;
            }
            let (c, size) = ([c[0], c[1]], [size[0], size[1]]);
            let flat = |d: f64| [at(d)[0], at(d)[1]];
            for noise in [
                value_noise_2d_periodic_slope,
                gradient_noise_2d_periodic_slope,
                simplex::simplex_noise_2d_periodic_slope,
            ] {
                let rise = noise(c, flat(h), size, seed)[0] - noise(c, flat(-h), size, seed)[0];
                let slope = noise(c, flat(0.0), size, seed)[axis + 1];
                assert!((slope - rise / (2.0 * h)).abs() < 1e-6);
            }
        }
    }
}

/// Module, name before the dimension, name after it.
const PERIODIC: [(&str, &str, &str); 4] = [
    ("value", "value_noise", "_slope"),
    ("gradient", "gradient_noise", "_slope"),
    ("simplex", "simplex_noise", "_slope"),
    ("worley", "worley_noise", "_slope"),
];

#[test]
fn periodic_noises_are_the_same_one_period_on_bit_by_bit() {
    let mut random = Random(51);
    for n in [2, 3] {
        let columns = 3 * n + 1;
        let (mut here, mut there) = (Vec::new(), Vec::new());
        for k in 0..100_000 {
            let mut row = vec![0; columns];
            if n == 2 {
                fill::<2>(&mut random, &mut row);
            } else {
                fill::<3>(&mut random, &mut row);
            }
            for axis in 0..n {
                let largest = if k % 2 == 0 { 8 } else { 1000 };
                let any = 1 + random.bits() as u32 % largest;
                // Along y, simplex noise in 2D has even periods only.
                let period = if n == 2 && axis == 1 { 2 * any } else { any };
                row[2 * n + 1 + axis] = period;
                // About the seams, on both sides of 0.
                let turns = random.bits() as u32 % 7;
                let near = (random.bits() as u32 % 5).wrapping_sub(2);
                row[axis] = period
                    .wrapping_mul(turns.wrapping_sub(3))
                    .wrapping_add(near);
            }
            here.extend(&row);
            for axis in 0..n {
                let turns = (random.bits() as u32 % 2001).wrapping_sub(1000);
                let period = row[2 * n + 1 + axis];
                row[axis] = row[axis].wrapping_add(period.wrapping_mul(turns));
            }
            there.extend(&row);
        }
        for (module, before, after) in PERIODIC {
            for after in ["", after] {
                let name = format!("{before}_{n}d_periodic{after}");
                let import = format!("veduta::noise::{module}::{name}");
                let arguments = if n == 2 { AT_2D } else { AT_3D };
                let device = evaluator(&[&import], "", &format!("{name}({arguments})"), columns);
                let (a, b) = (
                    device.run_bits(&here).unwrap(),
                    device.run_bits(&there).unwrap(),
                );
                assert!(a == b, "{name} does not repeat");
                assert!(a.iter().any(|&bits| bits != a[0]), "{name} is constant");
            }
        }
    }
}

#[test]
fn away_from_the_seams_periodic_noises_are_the_endless_ones() {
    let mut random = Random(52);
    for n in [2, 3] {
        let columns = 3 * n + 1;
        let mut rows = Vec::new();
        for _ in 0..50_000 {
            let mut row = vec![0; columns];
            if n == 2 {
                fill::<2>(&mut random, &mut row);
            } else {
                fill::<3>(&mut random, &mut row);
            }
            for axis in 0..n {
                row[axis] = 2 + random.bits() as u32 % 1000;
                row[2 * n + 1 + axis] = 1010;
            }
            rows.extend(&row);
        }
        let (cells, fracs, seed, period) = if n == 2 {
            (
                "vec2i(in.i[0], in.i[1])",
                "vec2f(in.f[2], in.f[3])",
                "in.u[4]",
                "vec2i(in.i[5], in.i[6])",
            )
        } else {
            (
                "vec3i(in.i[0], in.i[1], in.i[2])",
                "vec3f(in.f[3], in.f[4], in.f[5])",
                "in.u[6]",
                "vec3i(in.i[7], in.i[8], in.i[9])",
            )
        };
        for (module, before, after) in PERIODIC {
            let endless = format!("{before}_{n}d{after}");
            let periodic = format!("{before}_{n}d_periodic{after}");
            let run = |name: &str, arguments: String| {
                let import = format!("veduta::noise::{module}::{name}");
                evaluator(&[&import], "", &format!("{name}({arguments})"), columns)
                    .run_bits(&rows)
                    .unwrap()
            };
            let a = run(&endless, format!("{cells}, {fracs}, {seed}"));
            let b = run(&periodic, format!("{cells}, {fracs}, {period}, {seed}"));
            assert!(a == b, "{periodic} differs from {endless}");
        }
    }
}
