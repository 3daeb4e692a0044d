//! Domain warping against its twins, and the chain rule against differences.

use crate::accuracy::{assert_promise, rows};
use crate::common::{Random, evaluator};
use crate::noise::fill;
use crate::sweep::{Truth, assert_tight, cell, check_all, float, floats};
use veduta::reference::fractal::warp::*;
use veduta::reference::fractal::{amplitude_sum, octave_amplitude, slope_sum};

const SWEEP: usize = 1_000_000;

fn of(name: &str) -> String {
    format!("veduta::fractal::warp::{name}")
}

/// Columns of the noises' `fill`, then octaves, Hurst exponent and strength.
fn fill_warp<const N: usize>(random: &mut Random, row: &mut [u32]) {
    fill::<N>(random, row);
    // The hardest case now and then.
    let hard = random.bits().is_multiple_of(16);
    row[2 * N + 1] = if hard {
        8
    } else {
        1 + random.bits() as u32 % 8
    };
    row[2 * N + 2] = if hard { 0.5 } else { random.between(0.5, 2.0) }.to_bits();
    row[2 * N + 3] = if hard { 2.0 } else { random.between(0.0, 2.0) }.to_bits();
}

/// Bars: the moved place is off by about 1e-6 of the amplitudes; that times slope and curvature of the fractal, and for
/// the gradient times what the warp stretches it by.
fn bars<const N: usize, const K: usize>(r: &[u32], value: [f64; K]) -> Truth {
    let (octaves, hurst, strength) = parameters::<N>(r);
    let amplitude = amplitude_sum(octaves, hurst);
    let slope = slope_sum(octaves, hurst);
    let curvature: f64 = (0..octaves)
        .map(|i| octave_amplitude(i, hurst) * 4_f64.powi(i))
        .sum();
    let place = 1e-6 * (1.0 + strength * amplitude);
    let stretch = 1.0 + 3.0 * strength * slope;
    let mut t = Truth {
        bar: [place * (1.0 + 3.0 * slope); 4],
        ..Default::default()
    };
    t.bar[1..].fill(place * (10.0 * curvature) * stretch);
    t.value[..K].copy_from_slice(&value);
    t
}

fn parameters<const N: usize>(r: &[u32]) -> (i32, f64, f64) {
    let at = 2 * N + 1;
    (r[at].cast_signed(), float(r[at + 1]), float(r[at + 2]))
}

#[test]
fn warped_fractals_equal_their_twins() {
    let both = |name: &str| [of(name), of(&format!("{name}_slope"))];
    let flat = both("warped_fbm_2d");
    let arguments =
        "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), in.i[5], in.f[6], in.f[7], in.u[4]";
    let found = check_all(&flat, arguments, 8, SWEEP, fill_warp::<2>, |r| {
        let (octaves, hurst, strength) = parameters::<2>(r);
        let (c, f) = (cell(r), floats(&r[2..]));
        bars::<2, 3>(r, warped_fbm_2d_slope(c, f, octaves, hurst, strength, r[4]))
    });
    assert_tight(&flat, &found);
    let solid = both("warped_fbm_3d");
    let arguments = "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), \
         in.i[7], in.f[8], in.f[9], in.u[6]";
    let found = check_all(&solid, arguments, 10, SWEEP, fill_warp::<3>, |r| {
        let (octaves, hurst, strength) = parameters::<3>(r);
        let (c, f) = (cell(r), floats(&r[3..]));
        bars::<3, 4>(r, warped_fbm_3d_slope(c, f, octaves, hurst, strength, r[6]))
    });
    assert_tight(&solid, &found);
}

#[test]
fn warped_twins_differentiate_themselves_rightly() {
    let h = 1e-6;
    let mut random = Random(61);
    for _ in 0..2000 {
        let mut row = [0; 10];
        fill_warp::<3>(&mut random, &mut row);
        let c: [i32; 3] = cell(&row);
        let f: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
        let (_, hurst, strength) = parameters::<3>(&row);
        let (octaves, seed) = (1 + (row[7] % 4).cast_signed(), row[6]);
        let bar = 1e-6 * (1.0 + strength * slope_sum(octaves, hurst)).powi(3);
        for axis in 0..3 {
            let at = |d: f64| {
                let mut f = f;
                f[axis] += d;
                f
            };
            let solid = |d| warped_fbm_3d_slope(c, at(d), octaves, hurst, strength, seed);
            let rise = (solid(h)[0] - solid(-h)[0]) / (2.0 * h);
            let slope = solid(0.0)[axis + 1];
            assert!((slope - rise).abs() < bar, "{slope} {rise} {bar}");
            if axis < 2 {
                let flat = |d: f64| {
                    let f = [at(d)[0], at(d)[1]];
                    warped_fbm_2d_slope([c[0], c[1]], f, octaves, hurst, strength, seed)
                };
                let rise = (flat(h)[0] - flat(-h)[0]) / (2.0 * h);
                let slope = flat(0.0)[axis + 1];
                assert!((slope - rise).abs() < bar, "{slope} {rise} {bar}");
            }
        }
    }
}

#[test]
fn the_chain_rule_keeps_its_promised_error_and_its_limits() {
    let (device_rows, list) = rows::<13>(200_000, 62, |random| {
        std::array::from_fn(|k| {
            if k == 12 {
                random.between(0.0, 4.0)
            } else {
                random.between(-64.0, 64.0)
            }
        })
    });
    let v = |at: usize, n: usize| -> String {
        let parts: Vec<_> = (at..at + n).map(|k| format!("in.f[{k}]")).collect();
        format!("vec{n}f({})", parts.join(", "))
    };
    let run = |call: &str| {
        let name = call.split('(').next().unwrap();
        evaluator(&[&of(name)], "", call, 13)
            .run(&device_rows)
            .unwrap()
    };
    let three = |r: &[f64; 13], at: usize| -> [f64; 3] { std::array::from_fn(|k| r[at + k]) };
    let call = format!(
        "warped_slope_2d({}, {}, {}, in.f[12])",
        v(0, 3),
        v(3, 3),
        v(6, 3)
    );
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| warped_slope_2d(three(r, 0), three(r, 3), three(r, 6), r[12]))
        .collect();
    assert_promise("fractal/warp", "warped_slope_2d", &run(&call), &truth);
    // The four vectors overlap: there are 16 columns at most.
    let four = |r: &[f64; 13], at: usize| -> [f64; 4] { std::array::from_fn(|k| r[at + k]) };
    let call = format!(
        "warped_slope_3d({}, {}, {}, {}, in.f[12])",
        v(0, 4),
        v(3, 4),
        v(6, 4),
        v(8, 4)
    );
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| warped_slope_3d(four(r, 0), four(r, 3), four(r, 6), four(r, 8), r[12]))
        .collect();
    assert_promise("fractal/warp", "warped_slope_3d", &run(&call), &truth);

    // Without strength it is the fractal itself, bit by bit.
    let row = [7, 9, 0.3_f32.to_bits(), 0.6_f32.to_bits(), 5];
    let plain = evaluator(
        &["veduta::fractal::fbm::fbm_2d_slope"],
        "",
        "fbm_2d_slope(vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), 5, 0.8, in.u[4])",
        5,
    );
    let still = evaluator(
        &[&of("warped_fbm_2d_slope")],
        "",
        "warped_fbm_2d_slope(vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), 5, 0.8, 0.0, in.u[4])",
        5,
    );
    assert_eq!(plain.run(&row).unwrap(), still.run(&row).unwrap());
}
