//! Fractal sums against their twins and their defining properties (rows L07 to L10).

use crate::common::{Random, evaluator};
use crate::sweep::{
    POINTS, Truth, cell, check, check_all, float, floats, random_cell, random_frac,
};
use veduta::reference::fractal::*;
use veduta::reference::noise::gradient_noise_2d;

/// Points this near to a kink, in units of the quantity that is cut off or mirrored, have no determined gradient.
const KINK: f64 = 1e-6;

/// The bar of a fractal's value, and of its gradient relative to the sum of amplitude times frequency.
fn bar(octaves: i32) -> f64 {
    1e-6 * (1.0 + f64::from(octaves) / 2.0)
}

/// Columns: cells, fractions, seed, octaves, Hurst exponent, then two numbers in [0, 1].
fn fill<const N: usize>(random: &mut Random, row: &mut [u32]) {
    for axis in 0..N {
        row[axis] = random_cell(random);
        row[N + axis] = random_frac(random);
    }
    row[2 * N] = random.bits() as u32 >> (random.bits() & 31);
    // Few octaves more often than many; the hardest case, 16 octaves of the same amplitude, often enough.
    let hard = random.bits().is_multiple_of(64);
    let bits = random.bits();
    let few = (bits & 15).min(bits >> 8 & 15) as u32;
    row[2 * N + 1] = if hard { 16 } else { 1 + few };
    row[2 * N + 2] = if hard { 0.0 } else { random.between(0.0, 2.0) }.to_bits();
    row[2 * N + 3] = random.unit().to_bits();
    row[2 * N + 4] = random.unit().to_bits();
}

fn octaves<const N: usize>(row: &[u32]) -> i32 {
    row[2 * N + 1].cast_signed()
}

fn hurst<const N: usize>(row: &[u32]) -> f64 {
    float(row[2 * N + 2])
}

fn truth<const N: usize, const K: usize>(row: &[u32], value: [f64; K], kink: bool) -> Truth {
    let (octaves, hurst) = (octaves::<N>(row), hurst::<N>(row));
    let slope = bar(octaves) * slope_sum(octaves, hurst);
    let mut t = Truth {
        bar: [
            bar(octaves) * amplitude_sum(octaves, hurst),
            slope,
            slope,
            slope,
        ],
        kink,
        ..Default::default()
    };
    t.value[..K].copy_from_slice(&value);
    t
}

const AT_2D: &str = "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3])";
const AT_3D: &str = "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5])";

/// The noise of every octave, without amplitude.
fn noises(row: &[u32]) -> Vec<f64> {
    (0..octaves::<2>(row))
        .map(|i| octave_noise_2d(cell(row), floats(&row[2..]), i, row[4])[0])
        .collect()
}

#[test]
fn twins_differentiate_themselves_rightly() {
    let h = 1e-7;
    let mut random = Random(21);
    let mut compared = 0;
    for _ in 0..3000 {
        let mut row = [0; 9];
        fill::<2>(&mut random, &mut row);
        row[5] = 1 + row[5] % 6;
        let (c, seed, n, hurst) = (cell(&row), row[4], octaves::<2>(&row), hurst::<2>(&row));
        let f: [f64; 2] = std::array::from_fn(|_| f64::from(random.unit()));
        let (p, q) = (float(row[7]), float(row[8]));
        type Slope<'a> = &'a dyn Fn([f64; 2]) -> [f64; 3];
        let functions: [Slope<'_>; 4] = [
            &|f| fbm_2d_slope(c, f, n, hurst, seed),
            &|f| hybrid_multifractal_2d_slope(c, f, n, hurst, p, seed),
            &|f| ridged_multifractal_2d_slope(c, f, n, hurst, 4.0 * p, 0.0, seed),
            &|f| ridged_multifractal_2d_slope(c, f, n, hurst, 4.0 * p, 0.01 + q, seed),
        ];
        for function in functions {
            for axis in 0..2 {
                let mut ends = [f, f];
                ends[0][axis] -= h;
                ends[1][axis] += h;
                let [low, high] = ends.map(function);
                // A kink between the two ends shows as a jump of the gradient.
                if (low[axis + 1] - high[axis + 1]).abs() > 0.01 * slope_sum(n, hurst) {
                    continue;
                }
                compared += 1;
                let rise = (high[0] - low[0]) / (2.0 * h);
                let slope = function(f)[axis + 1];
                assert!(
                    (rise - slope).abs() < 1e-4 * slope_sum(n, hurst),
                    "{rise} {slope}"
                );
            }
        }
    }
    assert!(compared > 20_000, "{compared}");
}

/// Two patches of a fractal along x: differences of neighbours and of the whole.
fn energies(hurst: f64, octaves: i32) -> (f64, f64) {
    let device = evaluator(
        &["veduta::fractal::fbm::fbm_2d"],
        "",
        "fbm_2d(vec2i(in.i[0], 0), vec2f(in.f[1], 0.3), in.i[2], in.f[3], 1u)",
        4,
    );
    let mut rows = Vec::new();
    for c in 0..512_i32 {
        for k in 0..64 {
            rows.extend([
                c.cast_unsigned(),
                (k as f32 / 64.0).to_bits(),
                octaves.cast_unsigned(),
                (hurst as f32).to_bits(),
            ]);
        }
    }
    let v = device.run(&rows).unwrap();
    let mean = v.iter().sum::<f64>() / v.len() as f64;
    let total = v.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    let fine = v
        .windows(2)
        .map(|w| (w[1] - w[0]) * (w[1] - w[0]))
        .sum::<f64>();
    (fine, total)
}

#[test]
fn row_l07_fbm() {
    let prefix = "veduta::fractal::fbm::";
    let of = |name: &str| format!("{prefix}{name}");
    let flat = format!("{AT_2D}, in.i[5], in.f[6], in.u[4]");
    let solid = format!("{AT_3D}, in.i[7], in.f[8], in.u[6]");
    // The twins are the explicit octave sums of algorithm 1.
    let both = |name: &str| [of(name), of(&format!("{name}_slope"))];
    check_all(&both("fbm_2d"), &flat, 9, POINTS, fill::<2>, |r| {
        let (n, h) = (octaves::<2>(r), hurst::<2>(r));
        let v = fbm_2d_slope(cell(r), floats(&r[2..]), n, h, r[4]);
        truth::<2, 3>(r, v, false)
    });
    check_all(&both("fbm_3d"), &solid, 11, POINTS, fill::<3>, |r| {
        let (n, h) = (octaves::<3>(r), hurst::<3>(r));
        let v = fbm_3d_slope(cell(r), floats(&r[3..]), n, h, r[6]);
        truth::<3, 4>(r, v, false)
    });
    // Normalised: the bar of the sum divided by the sum of the amplitudes.
    let normalised = |r: &[u32], v: f64| Truth {
        value: [v, 0.0, 0.0, 0.0],
        bar: [bar(octaves::<3>(r)); 4],
        kink: false,
    };
    let s = check(&of("fbm_value_3d"), &solid, 11, POINTS, fill::<3>, |r| {
        let v = fbm_value_3d(
            cell(r),
            floats(&r[3..]),
            octaves::<3>(r),
            hurst::<3>(r),
            r[6],
        );
        normalised(r, v)
    });
    assert!(s.low >= 0.0 && s.high <= 1.0, "{s:?}");
    let periodic = |random: &mut Random, row: &mut [u32]| {
        fill::<3>(random, row);
        for axis in 0..3 {
            let bits = random.bits();
            row[11 + axis] = 1 + ((bits as u32 & 0x7fff) >> ((bits >> 32) % 15));
            row[11 + axis] = row[11 + axis].min(32767);
        }
    };
    let arguments =
        format!("{AT_3D}, vec3i(in.i[11], in.i[12], in.i[13]), in.i[7], in.f[8], in.u[6]");
    let name = of("fbm_value_3d_periodic");
    let s = check(&name, &arguments, 14, POINTS, periodic, |r| {
        let (n, h) = (octaves::<3>(r), hurst::<3>(r));
        let v = fbm_value_3d_periodic(cell(r), floats(&r[3..]), cell(&r[11..]), n, h, r[6]);
        normalised(r, v)
    });
    assert!(s.low >= 0.0 && s.high <= 1.0, "{s:?}");

    // Columns: turns, doublings, fall, seed.
    let torus = |random: &mut Random, row: &mut [u32]| {
        for word in &mut row[..3] {
            *word = random.bits() as u32;
        }
        row[3] = 1 + random.bits() as u32 % 16;
        row[4] = random.between(0.0625, 1.0).to_bits();
        row[5] = random.bits() as u32;
    };
    let name = of("fbm_value_3d_torus_six");
    let arguments = "vec3u(in.u[0], in.u[1], in.u[2]), in.u[3], in.f[4], in.u[5]";
    let s = check(&name, arguments, 6, POINTS, torus, |r| Truth {
        value: [
            fbm_value_3d_torus_six([r[0], r[1], r[2]], r[3], float(r[4]), r[5]),
            0.0,
            0.0,
            0.0,
        ],
        bar: [bar(6); 4],
        kink: false,
    });
    assert!(s.low >= 0.0 && s.high <= 1.0, "{s:?}");

    // A lower Hurst exponent raises the energy of fine detail, as a share of the whole.
    let shares = [1.0, 0.7, 0.4, 0.1].map(|hurst| {
        let (fine, total) = energies(hurst, 6);
        fine / total
    });
    println!("share of the differences of neighbours at hurst 1, 0.7, 0.4, 0.1: {shares:.4?}");
    assert!(shares.windows(2).all(|w| w[1] > 1.5 * w[0]), "{shares:?}");

    // One octave more changes detail only: never more than its amplitude, and nothing on average over the cells of the
    // coarser octaves.
    let device = evaluator(
        &[&of("fbm_2d")],
        "",
        "fbm_2d(vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), 6, 0.5, 1u) - fbm_2d(vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), 5, 0.5, 1u)",
        4,
    );
    let amplitude = octave_amplitude(5, 0.5);
    let mut rows = Vec::new();
    for c in 0..64_u32 {
        for k in 0..64 * 64 {
            let f = [k % 64, k / 64].map(|i| (i as f32 / 64.0).to_bits());
            rows.extend([c, c * 7, f[0], f[1]]);
        }
    }
    let changes = device.run(&rows).unwrap();
    let largest = changes.iter().fold(0.0_f64, |a, c| a.max(c.abs()));
    let means: Vec<f64> = changes
        .chunks(64 * 64)
        .map(|cell| cell.iter().sum::<f64>() / 4096.0)
        .collect();
    let largest_mean = means.iter().fold(0.0_f64, |a, c| a.max(c.abs()));
    println!(
        "octave 6 of amplitude {amplitude:.3}: changes up to {largest:.3}, cell means up to {largest_mean:.4}"
    );
    assert!(largest <= amplitude * 1.00001 && largest > 0.5 * amplitude);
    assert!(largest_mean < 0.05 * amplitude, "{largest_mean}");

    // One octave is the noise itself; no octave is 0.
    let device = evaluator(
        &[
            &of("fbm_2d"),
            &of("fbm_value_3d"),
            "veduta::noise::gradient::gradient_noise_2d",
        ],
        "",
        &format!(
            "vec3f(fbm_2d({AT_2D}, 1, 0.5, in.u[4]) - gradient_noise_2d({AT_2D}, in.u[4]), fbm_2d({AT_2D}, 0, 0.5, 1u), fbm_value_3d(vec3i(in.i[0]), vec3f(in.f[2]), 0, 0.5, 1u))"
        ),
        9,
    );
    let mut random = Random(22);
    let mut rows = vec![0; 9 * 1000];
    for row in rows.chunks_mut(9) {
        fill::<2>(&mut random, row);
    }
    for found in device.run(&rows).unwrap().chunks(3) {
        assert!(
            found[0].abs() < 1e-6 && found[1..] == [0.0, 0.0],
            "{found:?}"
        );
    }
}

/// The weight before it is cut off, of every octave but the first, and what it would be without any cut.
fn hybrid_weights(row: &[u32], offset: f64) -> Vec<[f64; 2]> {
    let hurst = hurst::<2>(row);
    let mut kept = 1.0_f64;
    let mut uncut = 1.0;
    noises(row)
        .into_iter()
        .enumerate()
        .map(|(i, n)| {
            let signal = octave_amplitude(i as i32, hurst) * (n + offset);
            kept = kept.min(1.0) * signal;
            uncut *= signal;
            [kept, uncut]
        })
        .collect()
}

#[test]
fn row_l08_hybrid() {
    let prefix = "veduta::fractal::hybrid::";
    let of = |name: &str| format!("{prefix}{name}");
    let arguments = format!("{AT_2D}, in.i[5], in.f[6], in.f[7], in.u[4]");
    let both = [
        of("hybrid_multifractal_2d"),
        of("hybrid_multifractal_2d_slope"),
    ];
    let found = check_all(&both, &arguments, 9, POINTS, fill::<2>, |r| {
        let (n, h, offset) = (octaves::<2>(r), hurst::<2>(r), float(r[7]));
        let v = hybrid_multifractal_2d_kinked(cell(r), floats(&r[2..]), n, h, offset, r[4]);
        truth::<2, 3>(r, v.slope, v.kink < KINK)
    });
    assert!(found[1].kinks < POINTS / 1000, "{found:?}");

    // With offset 1 the weights would pass 1 without the cut; with it no octave adds more than its amplitude times
    // (1 + offset).
    let device = evaluator(
        &[&of("hybrid_multifractal_2d")],
        "fn term(cell: vec2i, frac: vec2f, i: i32, seed: u32) -> f32 { return hybrid_multifractal_2d(cell, frac, i + 1, 0.25, 1.0, seed) - hybrid_multifractal_2d(cell, frac, i, 0.25, 1.0, seed); }",
        &format!("term({AT_2D}, in.i[5], in.u[4])"),
        9,
    );
    let mut random = Random(23);
    let mut rows = vec![0; 9 * 200_000];
    for row in rows.chunks_mut(9) {
        fill::<2>(&mut random, row);
        row[5] = 1 + row[5] % 9;
        row[6] = 0.25_f32.to_bits();
    }
    let terms = device.run(&rows).unwrap();
    let mut beyond = 0;
    for (row, term) in rows.chunks(9).zip(terms) {
        let i = octaves::<2>(row);
        let largest = octave_amplitude(i, 0.25) * 2.0;
        assert!(term.abs() <= largest + 1e-5, "octave {i}: {term}");
        let mut whole = row.to_vec();
        whole[5] += 1;
        let weights = hybrid_weights(&whole, 1.0);
        beyond += usize::from(weights[i as usize][1] > largest + 1e-5);
    }
    println!("hybrid: {beyond} of 200000 terms would pass their bound without the cut");
    assert!(beyond > 1000);

    // Rough heights, smooth depths: the part of octaves 4 to 8 in the lowest and in the highest quarter.
    let device = evaluator(
        &[&of("hybrid_multifractal_2d")],
        "",
        &format!(
            "vec2f(hybrid_multifractal_2d({AT_2D}, 8, 0.25, 0.7, 1u), hybrid_multifractal_2d({AT_2D}, 3, 0.25, 0.7, 1u))"
        ),
        9,
    );
    let values = device.run(&rows).unwrap();
    let mut points: Vec<(f64, f64)> = values.chunks(2).map(|v| (v[1], v[0] - v[1])).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let deviation = |part: &[(f64, f64)]| {
        let mean = part.iter().map(|p| p.1).sum::<f64>() / part.len() as f64;
        let square = part.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>();
        (square / part.len() as f64).sqrt()
    };
    let (low, high) = (deviation(&points[..50_000]), deviation(&points[150_000..]));
    println!("hybrid: detail of the lowest quarter {low:.4}, of the highest {high:.4}");
    assert!(high > 3.0 * low);
}

const RIDGED: &str =
    "in.i[5], in.f[6], 4.0 * in.f[7], select(0.0, in.f[8], in.f[8] > 0.5), in.u[4]";

/// Gain and smoothness of a row: gains up to 4; half of the rows with sharp crests.
fn ridged_parameters(row: &[u32]) -> (f64, f64) {
    let k = float(row[8]);
    (4.0 * float(row[7]), if k > 0.5 { k } else { 0.0 })
}

#[test]
fn row_l09_ridged() {
    let prefix = "veduta::fractal::ridged::";
    let of = |name: &str| format!("{prefix}{name}");
    let arguments = format!("{AT_2D}, {RIDGED}");
    let both = [
        of("ridged_multifractal_2d"),
        of("ridged_multifractal_2d_slope"),
    ];
    let found = check_all(&both, &arguments, 9, POINTS, fill::<2>, |r| {
        let (n, h, (gain, k)) = (octaves::<2>(r), hurst::<2>(r), ridged_parameters(r));
        let v = ridged_multifractal_2d_kinked(cell(r), floats(&r[2..]), n, h, gain, k, r[4]);
        truth::<2, 3>(r, v.slope, v.kink < KINK)
    });
    assert!(found[1].kinks < POINTS / 1000, "{found:?}");
    check(
        &of("ridged_multifractal_printed_2d"),
        &arguments,
        9,
        POINTS,
        fill::<2>,
        |r| {
            let (n, h, (gain, k)) = (octaves::<2>(r), hurst::<2>(r), ridged_parameters(r));
            let v = ridged_multifractal_printed_2d(cell(r), floats(&r[2..]), n, h, gain, k, r[4]);
            truth::<2, 1>(r, [v], false)
        },
    );
    check(
        &of("smooth_abs"),
        "2.0 * in.f[3] - 1.0, in.f[7]",
        9,
        1_000_000,
        fill::<2>,
        |r| Truth {
            value: [smooth_abs(2.0 * float(r[3]) - 1.0, float(r[7])); 4],
            bar: [1e-6; 4],
            kink: false,
        },
    );

    // 0 <= value <= the sum of the amplitudes.
    let device = evaluator(
        &[&of("ridged_multifractal_2d")],
        "",
        &format!("ridged_multifractal_2d({arguments})"),
        9,
    );
    let mut random = Random(24);
    let mut rows = vec![0; 9 * 500_000];
    for row in rows.chunks_mut(9) {
        fill::<2>(&mut random, row);
    }
    for (row, value) in rows.chunks(9).zip(device.run(&rows).unwrap()) {
        let most = amplitude_sum(octaves::<2>(row), hurst::<2>(row));
        assert!(
            (0.0..=most * (1.0 + 1e-6)).contains(&value),
            "{value} of {most}"
        );
    }

    // Crests where the noise is 0: the first octave reaches its largest value, 1, there and falls off on both sides.
    let device = evaluator(
        &[&of("ridged_multifractal_2d")],
        "",
        &format!("ridged_multifractal_2d({AT_2D}, 1, 1.0, 2.0, 0.0, 1u)"),
        4,
    );
    let mut rows = Vec::new();
    for [c, at] in crests(1).into_iter().take(2000) {
        for f in [at, at - 0.001, at + 0.001] {
            rows.extend([
                (c as i32).cast_unsigned(),
                0,
                (f as f32).to_bits(),
                0.3_f32.to_bits(),
            ]);
        }
    }
    let values = device.run(&rows).unwrap();
    assert!(values.len() >= 1000 * 3, "{}", values.len());
    for v in values.chunks(3) {
        assert!(v[0] > 1.0 - 1e-5 && v[1] < v[0] && v[2] < v[0], "{v:?}");
    }
}

/// Zeros of the first octave's noise along the row of cells y = 0, frac.y = 0.3: (cell, fraction), inside cells and
/// steep.
fn crests(seed: u32) -> Vec<[f64; 2]> {
    let y = f64::from(0.3_f32);
    let noise = |c: i32, f: f64| gradient_noise_2d([c, 0], [f, y], seed);
    let mut found = Vec::new();
    for c in 0..4000 {
        for k in 1..15 {
            let (mut low, mut high) = (f64::from(k) / 16.0, f64::from(k + 1) / 16.0);
            if noise(c, low) * noise(c, high) >= 0.0 {
                continue;
            }
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if noise(c, low) * noise(c, middle) <= 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let steep = (noise(c, low + 0.001) - noise(c, low - 0.001)).abs() / 0.002;
            if steep > 0.3 && (0.01..0.99).contains(&low) {
                found.push([f64::from(c), low]);
            }
        }
    }
    found
}

#[test]
fn row_l10_smooth_ridges() {
    let path = "veduta::fractal::ridged::ridged_multifractal_2d_slope";
    let device = evaluator(
        &[path],
        "",
        &format!("ridged_multifractal_2d_slope({AT_2D}, 1, 1.0, 2.0, in.f[4], 1u)"),
        5,
    );
    // The slope along x a little before and behind each crest, sharp and smooth. The distance is 2^-14 of a cell.
    let k = 0.01_f32;
    let step = 2_f64.powi(-14);
    let crests = crests(1);
    let mut rows = Vec::new();
    for [c, at] in &crests {
        for smoothness in [0.0, k] {
            for f in [at - step, at + step] {
                rows.extend([(*c as i32).cast_unsigned(), 0]);
                rows.extend([f as f32, 0.3, smoothness].map(f32::to_bits));
            }
        }
    }
    let slopes: Vec<f64> = device.run(&rows).unwrap().chunks(3).map(|v| v[1]).collect();
    let (mut sharp, mut smooth) = (f64::INFINITY, 0.0_f64);
    for s in slopes.chunks(4) {
        sharp = sharp.min((s[1] - s[0]).abs());
        smooth = smooth.max((s[3] - s[2]).abs());
    }
    println!(
        "{} crests: the slope jumps by {sharp:.3} or more without smoothing, changes by {smooth:.4} or less with it",
        crests.len()
    );
    assert!(crests.len() > 1000);
    // Without: twice 2 |dn/dx| with |dn/dx| > 0.3. With: |dn/dx|^2 2 / sqrt(k) a cell, |dn/dx| < 6.
    assert!(sharp > 1.0);
    assert!(smooth < 72.0 / f64::from(k).sqrt() * 2.0 * step);

    // Elsewhere: |n| changes by at most k / (2 |n|), and (1 - |n|)^2 by at most twice that.
    let device = evaluator(
        &[
            "veduta::fractal::ridged::ridged_multifractal_2d",
            "veduta::noise::gradient::gradient_noise_2d",
        ],
        "",
        &format!(
            "vec3f(ridged_multifractal_2d({AT_2D}, 1, 1.0, 2.0, in.f[8], in.u[4]), ridged_multifractal_2d({AT_2D}, 1, 1.0, 2.0, 0.0, in.u[4]), gradient_noise_2d({AT_2D}, in.u[4]))"
        ),
        9,
    );
    let mut random = Random(25);
    let mut rows = vec![0; 9 * 500_000];
    for row in rows.chunks_mut(9) {
        fill::<2>(&mut random, row);
        row[8] = random.between(0.0, 0.1).to_bits();
    }
    for (row, v) in rows.chunks(9).zip(device.run(&rows).unwrap().chunks(3)) {
        let k = float(row[8]);
        let bound = (k / v[2].abs()).min(2.0 * k.sqrt());
        assert!((v[0] - v[1]).abs() <= bound + 1e-6, "{v:?}, k = {k}");
    }
    // Smoothness 0 is the sharp crest exactly.
    let device = evaluator(
        &["veduta::fractal::ridged::smooth_abs"],
        "",
        "smooth_abs(in.f[0], 0.0)",
        1,
    );
    for n in [0.0_f32, -0.0, 1e-30, -1e-30, 0.3, -1.0] {
        assert_eq!(device.run(&[n.to_bits()]).unwrap(), [f64::from(n.abs())]);
    }
}
