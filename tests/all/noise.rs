//! Lattices, value and gradient noise against their twins (rows L05, L06).

use crate::common::{Random, evaluator};
use crate::sweep::{
    POINTS, Truth, cell, check, check_all, float, floats, random_cell, random_frac,
};
use veduta::reference::noise::*;

/// A lattice position as the twins give it.
type Place = ([i32; 3], [f64; 3]);

const ONE_NOISE: f64 = 2e-6;
pub const ARGS_2D: &str = "vec2i(in.i[0], in.i[1]), vec2f(in.f[2], in.f[3]), in.u[4]";
pub const ARGS_3D: &str =
    "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), in.u[6]";

/// Columns: cells, fractions, seed.
pub fn fill<const N: usize>(random: &mut Random, row: &mut [u32]) {
    for axis in 0..N {
        row[axis] = random_cell(random);
        row[N + axis] = random_frac(random);
    }
    row[2 * N] = random.bits() as u32 >> (random.bits() & 31);
}

/// The twin's components with the bar of one noise.
pub fn truth<const K: usize>(value: [f64; K]) -> Truth {
    let mut t = Truth {
        bar: [ONE_NOISE; 4],
        ..Default::default()
    };
    t.value[..K].copy_from_slice(&value);
    t
}

#[test]
fn twins_differentiate_themselves_rightly() {
    // Central differences in f64: error about h^2 times the third derivative, 60 / 6, plus rounding / h.
    let h = 1e-5;
    let mut random = Random(11);
    for _ in 0..2000 {
        let mut row = [0; 7];
        fill::<3>(&mut random, &mut row);
        let c3: [i32; 3] = cell(&row);
        let f3: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
        let (c2, f2) = ([c3[0], c3[1]], [f3[0], f3[1]]);
        let seed = row[6];
        for axis in 0..3 {
            let at = |d: f64| {
                let mut f = f3;
                f[axis] += d;
                f
            };
            for noise in [value_noise_3d_slope, gradient_noise_3d_slope] {
                let slope = noise(c3, f3, seed)[axis + 1];
                let rise = noise(c3, at(h), seed)[0] - noise(c3, at(-h), seed)[0];
                assert!((slope - rise / (2.0 * h)).abs() < 1e-7);
            }
            if axis < 2 {
                let flat = |d: f64| [at(d)[0], at(d)[1]];
                for noise in [value_noise_2d_slope, gradient_noise_2d_slope] {
                    let slope = noise(c2, f2, seed)[axis + 1];
                    let rise = noise(c2, flat(h), seed)[0] - noise(c2, flat(-h), seed)[0];
                    assert!((slope - rise / (2.0 * h)).abs() < 1e-7);
                }
            }
        }
    }
}

#[test]
fn octaves_share_no_lattice_point() {
    // A lattice point n of octave i, p = (n - d) / 2^i, lies at 2^k (n - d) + d of octave i + k: how far from a lattice
    // point of that octave?
    let distance = |shift: &[f64]| {
        (1..=20)
            .map(|k| {
                let apart = |coarse: f64| {
                    let squares = shift.iter().map(|d| {
                        let place = d - octave_frequency(k) * coarse * d;
                        (place - place.round()).powi(2)
                    });
                    squares.sum::<f64>().sqrt()
                };
                // The coarser octave is octave 0, which is not shifted, or another one.
                apart(0.0).min(apart(1.0))
            })
            .fold(f64::INFINITY, f64::min)
    };
    let (flat, solid) = (distance(&SHIFT_2D), distance(&SHIFT_3D));
    println!(
        "lattice points of two octaves: at least {flat:.3} cells apart in 2D, {solid:.3} in 3D"
    );
    assert!(flat > 0.33 && solid > 0.44);
}

#[test]
fn lattice_positions_on_the_device_equal_their_twins() {
    let mut random = Random(12);
    let columns = 8;
    let mut rows = vec![0_u32; 1_000_000 * columns];
    for row in rows.chunks_exact_mut(columns) {
        fill::<3>(&mut random, row);
        row[7] = random.bits() as u32 % 22;
    }
    // The place as one number, axis by axis: a fraction rounded up to a whole cell counts as that cell.
    let check = |name: &str, arguments: &str, twin: &dyn Fn(&[u32]) -> Place, bound: f64| {
        let import = format!("veduta::noise::lattice::{name}");
        let mut worst = 0.0_f64;
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            if axis == 2 && name.ends_with("2d") {
                continue;
            }
            let prelude = format!(
                "fn place(p: Lattice{}) -> vec2u {{ return vec2u(bitcast<u32>(p.cell.{letter}), bitcast<u32>(p.frac.{letter})); }}",
                &name[name.len() - 2..]
            );
            let structure = format!("veduta::noise::lattice::Lattice{}", &name[name.len() - 2..]);
            let device = evaluator(
                &[&import, &structure],
                &prelude,
                &format!("place({name}({arguments}))"),
                columns,
            );
            let found = device.run_bits(&rows).unwrap();
            for (row, found) in rows.chunks(columns).zip(found.chunks(2)) {
                let (cell, frac) = twin(row);
                let whole = found[0]
                    .wrapping_sub(cell[axis].cast_unsigned())
                    .cast_signed();
                let got = float(found[1]);
                assert!((0.0..=1.0).contains(&got), "{name} {row:?}: {got}");
                worst = worst.max((f64::from(whole) + got - frac[axis]).abs());
            }
        }
        println!("veduta::noise::lattice::{name}: error {worst:.2e}");
        assert!(worst <= bound, "{name}: {worst}");
    };
    let split2 = |row: &[u32]| {
        let p = split_2d(cell(row), floats(&row[3..]).map(|f: f64| 100.0 * f - 50.0));
        ([p.cell[0], p.cell[1], 0], [p.frac[0], p.frac[1], 0.0])
    };
    let split3 = |row: &[u32]| {
        let p = split_3d(cell(row), floats(&row[3..]));
        (p.cell, p.frac)
    };
    let octave2 = |row: &[u32]| {
        let p = octave_2d(cell(row), floats(&row[3..]), row[7].cast_signed());
        ([p.cell[0], p.cell[1], 0], [p.frac[0], p.frac[1], 0.0])
    };
    let octave3 = |row: &[u32]| {
        let p = octave_3d(cell(row), floats(&row[3..]), row[7].cast_signed());
        (p.cell, p.frac)
    };
    const C2: &str = "vec2i(in.i[0], in.i[1])";
    const C3: &str = "vec3i(in.i[0], in.i[1], in.i[2])";
    const F2: &str = "vec2f(in.f[3], in.f[4])";
    const F3: &str = "vec3f(in.f[3], in.f[4], in.f[5])";
    let stated =
        |name: &str| crate::sweep::header_error(&format!("veduta::noise::lattice::{name}"));
    // The argument itself is rounded twice here, by 2^-18 each time.
    check(
        "split_2d",
        &format!("{C2}, 100.0 * {F2} - 50.0"),
        &split2,
        stated("split_2d") + 8e-6,
    );
    check(
        "split_3d",
        &format!("{C3}, {F3}"),
        &split3,
        stated("split_3d"),
    );
    check(
        "octave_2d",
        &format!("{C2}, {F2}, in.i[7]"),
        &octave2,
        stated("octave_2d"),
    );
    check(
        "octave_3d",
        &format!("{C3}, {F3}, in.i[7]"),
        &octave3,
        stated("octave_3d"),
    );
    // Negative fractions, the exact ones among them.
    let device = evaluator(
        &["veduta::noise::lattice::split_2d"],
        "fn place(c: i32, f: f32) -> vec2f { let p = split_2d(vec2i(c), vec2f(f)); return vec2f(f32(p.cell.x), p.frac.y); }",
        "place(in.i[0], in.f[1])",
        2,
    );
    for (c, f, expected) in [
        (0, -0.25_f32, [-1.0, 0.75]),
        (5, -3.0, [2.0, 0.0]),
        (5, 2.5, [7.0, 0.5]),
        (0, -1e-9, [-1.0, 1.0]),
        (0, -0.0, [0.0, 0.0]),
    ] {
        let found = device.run(&[i32::cast_unsigned(c), f.to_bits()]).unwrap();
        assert_eq!(found, expected, "{c} + {f}");
    }
}

#[test]
fn cells_wrap_exactly() {
    let mut random = Random(13);
    let mut rows = Vec::new();
    for k in 0..2_000_000_u32 {
        let period = match k % 4 {
            0 => 1 + k / 4 % 64,
            1 => 1 + random.bits() as u32 % 1_000_000,
            2 => 1 << (k / 4 % 31),
            _ => 1 + random.bits() as u32 % (1 << 30),
        };
        let cell = match k % 3 {
            // Multiples of the period and their neighbours, where a quotient can be rounded the wrong way.
            0 => (random.bits() as u32 / period)
                .wrapping_mul(period)
                .wrapping_add(k % 5)
                .wrapping_sub(2),
            1 => random.bits() as u32,
            _ => (random.bits() as u32 % 2000).wrapping_sub(1000),
        };
        rows.extend([cell, period]);
    }
    for c in [i32::MIN, i32::MIN + 1, i32::MAX, i32::MAX - 1, 0, -1] {
        for p in [1, 2, 3, 7, (1 << 30) - 1, 1 << 30] {
            rows.extend([c, p].map(i32::cast_unsigned));
        }
    }
    for (name, call) in [
        ("wrap_3d", "wrap_3d(vec3i(in.i[0]), vec3i(in.i[1])).y"),
        ("wrap_2d", "wrap_2d(vec2i(in.i[0]), vec2i(in.i[1])).y"),
    ] {
        let device = evaluator(&[&format!("veduta::noise::lattice::{name}")], "", call, 2);
        let found = device.run_bits(&rows).unwrap();
        for (row, found) in rows.chunks(2).zip(found) {
            let expected = wrap_3d([row[0].cast_signed(); 3], [row[1].cast_signed(); 3])[0];
            assert_eq!(found.cast_signed(), expected, "{name} {row:?}");
        }
    }
}

#[test]
fn turns_wrap_and_keep_their_promised_error() {
    let mut random = Random(14);
    let mut rows: Vec<u32> = (0..1_000_000)
        .map(|k| match k % 4 {
            0 => random.between(-1.0, 1.0),
            1 => random.between(-64.0, 64.0),
            2 => random.between(-4_194_304.0, 4_194_304.0),
            _ => (random.between(-100.0, 100.0) * 2.0).round() / 2.0,
        })
        .map(f32::to_bits)
        .collect();
    rows.extend(
        [
            0.0_f32,
            -0.0,
            0.5,
            -0.5,
            1.5,
            -1e-30,
            4_194_304.0,
            -4_194_304.0,
        ]
        .map(f32::to_bits),
    );
    let device = evaluator(
        &["veduta::noise::lattice::turn_3d"],
        "",
        "turn_3d(vec3f(1.0, in.f[0], 0.5)).y",
        1,
    );
    let found = device.run_bits(&rows).unwrap();
    let stated = crate::sweep::header_error("veduta::noise::lattice::turn_3d");
    let mut worst = 0;
    for (&row, found) in rows.iter().zip(found) {
        let expected = turn_3d([float(row); 3])[1];
        let error = found.wrapping_sub(expected).cast_signed().unsigned_abs();
        worst = worst.max(error);
        assert!(
            f64::from(error) <= stated,
            "{}: {found} {expected}",
            float(row)
        );
    }
    println!("turn_3d: error {worst} of 2^32");
}

#[test]
fn fades_keep_their_bounds() {
    let fill = |random: &mut Random, row: &mut [u32]| row[0] = random_frac(random);
    for (name, arguments) in [("fade_2d", "vec2f(in.f[0])"), ("fade_3d", "vec3f(in.f[0])")] {
        let path = format!("veduta::noise::lattice::{name}");
        let s = check(&path, arguments, 1, 1_000_000, fill, |row| Truth {
            value: [fade(float(row[0])); 4],
            bar: [1e-6; 4],
            kink: false,
        });
        assert_eq!((s.low, s.high), (0.0, 1.0));
    }
    let path = "veduta::noise::lattice::fade_fraction_3d";
    let fill_word = |random: &mut Random, row: &mut [u32]| row[0] = random.bits() as u32;
    check(path, "vec3u(in.u[0])", 1, 1_000_000, fill_word, |row| {
        Truth {
            value: [fade_fraction(row[0]); 4],
            bar: [1.8e-7; 4],
            kink: false,
        }
    });
    for (name, arguments) in [
        ("fade_slope_2d", "vec2f(in.f[0])"),
        ("fade_slope_3d", "vec3f(in.f[0])"),
    ] {
        let path = format!("veduta::noise::lattice::{name}");
        check(&path, arguments, 1, 1_000_000, fill, |row| Truth {
            value: [fade_slope(float(row[0])); 4],
            bar: [1e-6; 4],
            kink: false,
        });
    }
}

#[test]
fn frequency_fall_and_seed_of_octaves() {
    let import = |name: &str| format!("veduta::noise::lattice::{name}");
    let device = evaluator(
        &[&import("octave_frequency"), &import("octave_seed")],
        "",
        "vec2u(bitcast<u32>(octave_frequency(in.i[0])), octave_seed(in.u[1], in.i[0]))",
        2,
    );
    for i in 0..=126 {
        let found = device.run_bits(&[i, 77]).unwrap();
        let i = i.cast_signed();
        assert_eq!(float(found[0]), octave_frequency(i));
        assert_eq!(found[1], octave_seed(77, i));
    }
    let device = evaluator(&[&import("octave_fall")], "", "octave_fall(in.f[0])", 1);
    let rows: Vec<u32> = (0..=1 << 20)
        .map(|k| (k as f32 / 262_144.0).to_bits())
        .collect();
    let found = device.run(&rows).unwrap();
    let worst = rows
        .iter()
        .zip(&found)
        .map(|(&h, found)| (found / octave_fall(float(h)) - 1.0).abs())
        .fold(0.0, f64::max);
    println!("octave_fall: error {worst:.2e} rel");
    assert!(worst <= crate::sweep::header_error("veduta::noise::lattice::octave_fall"));
    assert!(found.windows(2).all(|w| w[0] >= w[1]), "not monotone");
    assert_eq!(
        (found[0], found[1 << 18], found[1 << 20]),
        (1.0, 0.5, 0.0625)
    );
}

/// Values across the faces of cells: the last of one cell, the first of the next, and their slopes.
fn jumps_across_faces(module: &str, kind: &str) -> f64 {
    let mut worst = 0.0_f64;
    for (dimensions, width) in [(2, 3), (3, 4)] {
        let name = format!("{kind}_noise_{dimensions}d_slope");
        let import = format!("veduta::noise::{module}::{name}");
        let arguments = if dimensions == 2 { ARGS_2D } else { ARGS_3D };
        let columns = 2 * dimensions + 1;
        let device = evaluator(&[&import], "", &format!("{name}({arguments})"), columns);
        let mut random = Random(14);
        let mut rows = Vec::new();
        for k in 0..20_000 {
            let mut row = vec![0; columns];
            if dimensions == 2 {
                fill::<2>(&mut random, &mut row);
            } else {
                fill::<3>(&mut random, &mut row);
            }
            let axis = k % dimensions;
            row[dimensions + axis] = 1_f32.to_bits();
            rows.extend(&row);
            row[axis] = row[axis].wrapping_add(1);
            row[dimensions + axis] = 0;
            rows.extend(&row);
        }
        let values = device.run(&rows).unwrap();
        for pair in values.chunks(2 * width) {
            for k in 0..width {
                worst = worst.max((pair[k] - pair[k + width]).abs());
            }
        }
    }
    worst
}

#[test]
fn row_l05_value_noise() {
    use veduta::reference::hash::{lattice_hash_2d, lattice_word_3d, unit_float};
    let prefix = "veduta::noise::value::";
    let of = |name: &str| format!("{prefix}{name}");
    let near_ends = |s: crate::sweep::Summary| {
        assert!(s.low >= 0.0 && s.high <= 1.0, "{s:?}");
        assert!(s.low < 0.001 && s.high > 0.999, "{s:?}");
    };
    let both = |name: &str| [of(name), of(&format!("{name}_slope"))];
    for s in check_all(
        &both("value_noise_2d"),
        ARGS_2D,
        5,
        POINTS,
        fill::<2>,
        |r| truth(value_noise_2d_slope(cell(r), floats(&r[2..]), r[4])),
    ) {
        near_ends(s);
    }
    for s in check_all(
        &both("value_noise_3d"),
        ARGS_3D,
        7,
        POINTS,
        fill::<3>,
        |r| truth(value_noise_3d_slope(cell(r), floats(&r[3..]), r[6])),
    ) {
        near_ends(s);
    }
    // Periods from 1 to 2^30, small ones as often as large ones.
    let periodic = |random: &mut Random, row: &mut [u32]| {
        fill::<3>(random, row);
        for axis in 0..3 {
            let bits = random.bits();
            row[7 + axis] = 1 + ((bits as u32 >> 2) >> ((bits >> 32) % 30));
        }
    };
    near_ends(check(
        &of("value_noise_3d_periodic"),
        "vec3i(in.i[0], in.i[1], in.i[2]), vec3f(in.f[3], in.f[4], in.f[5]), vec3i(in.i[7], in.i[8], in.i[9]), in.u[6]",
        10,
        POINTS,
        periodic,
        |r| {
            truth([value_noise_3d_periodic(
                cell(r),
                floats(&r[3..]),
                cell(&r[7..]),
                r[6],
            )])
        },
    ));

    // At lattice points it is the lattice's number, whether the point is reached from below or from above.
    let mut random = Random(15);
    let flat = evaluator(
        &[&of("value_noise_2d")],
        "",
        &format!("value_noise_2d({ARGS_2D})"),
        5,
    );
    let solid = evaluator(
        &[&of("value_noise_3d")],
        "",
        &format!("value_noise_3d({ARGS_3D})"),
        7,
    );
    let (mut rows2, mut rows3, mut numbers2, mut numbers3) = (vec![], vec![], vec![], vec![]);
    for k in 0..10_000_u32 {
        let mut row = [0; 7];
        fill::<3>(&mut random, &mut row);
        let end = |axis: u32| if k >> axis & 1 == 1 { 1_u32 } else { 0 };
        let ends = [end(0), end(1), end(2)];
        let point: [i32; 3] = std::array::from_fn(|a| row[a].wrapping_add(ends[a]).cast_signed());
        let fracs = ends.map(|e| (e as f32).to_bits());
        rows2.extend([row[0], row[1], fracs[0], fracs[1], row[6]]);
        rows3.extend([row[0], row[1], row[2], fracs[0], fracs[1], fracs[2], row[6]]);
        numbers2.push(unit_float(lattice_hash_2d([point[0], point[1]], row[6])[0]));
        numbers3.push(f64::from(lattice_word_3d(point, row[6]) & 0x7f_ffff) / 2_f64.powi(23));
    }
    assert_eq!(flat.run(&rows2).unwrap(), numbers2);
    assert_eq!(solid.run(&rows3).unwrap(), numbers3);

    let jump = jumps_across_faces("value", "value");
    println!("value noise: values and slopes jump by at most {jump:.1e} across faces");
    assert!(jump < 2e-6);

    // One period on, it is the same number, also from negative cells.
    let device = evaluator(
        &[&of("value_noise_3d_periodic")],
        "",
        "value_noise_3d_periodic(vec3i(in.i[0], 4, -3), vec3f(in.f[1]), vec3i(5, 7, 9), 1u)",
        2,
    );
    let mut rows = Vec::new();
    for k in -20..20_i32 {
        for i in 0..10 {
            rows.extend([(k * 5).cast_unsigned(), (i as f32 / 10.0).to_bits()]);
        }
    }
    let values = device.run(&rows).unwrap();
    assert!(values.chunks(10).all(|v| v == &values[..10]));
}

#[test]
fn row_l06_gradient_noise() {
    let prefix = "veduta::noise::gradient::";
    let of = |name: &str| format!("{prefix}{name}");
    let both = |name: &str| [of(name), of(&format!("{name}_slope"))];
    let inside = |s: crate::sweep::Summary| {
        assert!(s.low >= -1.0 && s.high <= 1.0, "{s:?}");
        assert!(s.low < -0.9 && s.high > 0.9, "{s:?}");
    };
    for s in check_all(
        &both("gradient_noise_2d"),
        ARGS_2D,
        5,
        POINTS,
        fill::<2>,
        |r| truth(gradient_noise_2d_slope(cell(r), floats(&r[2..]), r[4])),
    ) {
        inside(s);
    }
    for s in check_all(
        &both("gradient_noise_3d"),
        ARGS_3D,
        7,
        POINTS,
        fill::<3>,
        |r| truth(gradient_noise_3d_slope(cell(r), floats(&r[3..]), r[6])),
    ) {
        inside(s);
    }
    check(
        &of("lattice_gradient_2d"),
        "vec2i(in.i[0], in.i[1]), in.u[4]",
        5,
        1_000_000,
        fill::<2>,
        |r| truth(lattice_gradient_2d(cell(r), r[4])),
    );
    check(
        &of("lattice_gradient_3d"),
        "vec3i(in.i[0], in.i[1], in.i[2]), in.u[6]",
        7,
        1_000_000,
        fill::<3>,
        |r| truth(lattice_gradient_3d(cell(r), r[6])),
    );

    // 0 at lattice points.
    let mut random = Random(16);
    for (name, arguments, dimensions) in [
        ("gradient_noise_2d", ARGS_2D, 2),
        ("gradient_noise_3d", ARGS_3D, 3),
    ] {
        let device = evaluator(
            &[&of(name)],
            "",
            &format!("{name}({arguments})"),
            2 * dimensions + 1,
        );
        let mut rows = Vec::new();
        for k in 0..20_000_u32 {
            rows.extend((0..dimensions).map(|_| random_cell(&mut random)));
            rows.extend((0..dimensions).map(|a| ((k >> a & 1) as f32).to_bits()));
            rows.push(k);
        }
        assert!(
            device.run(&rows).unwrap().iter().all(|&v| v == 0.0),
            "{name}"
        );
    }

    let jump = jumps_across_faces("gradient", "gradient");
    println!("gradient noise: values and slopes jump by at most {jump:.1e} across faces");
    assert!(jump < 4e-6);
}

#[test]
fn no_noise_leaves_its_range() {
    // The largest noise at a place: each corner's vector is the one that points at the place best.
    // In 2D that is any direction, in 3D (0, a, b) with the larger side along the longer component.
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let norm = golden.hypot(1.0);
    let best = |mut d: [f64; 3], dimensions: usize| {
        if dimensions == 2 {
            return std::f64::consts::SQRT_2 * d[0].hypot(d[1]);
        }
        d = d.map(f64::abs);
        d.sort_by(f64::total_cmp);
        1.3847 * (golden * d[2] + d[1]) / norm
    };
    let largest = |t: [f64; 3], dimensions: usize| {
        (0..1 << dimensions)
            .map(|corner| {
                let mut weight = 1.0;
                let d: [f64; 3] = std::array::from_fn(|axis| {
                    let far = f64::from(u8::from(axis < dimensions && corner >> axis & 1 == 1));
                    if axis < dimensions {
                        weight *= far * fade(t[axis]) + (1.0 - far) * (1.0 - fade(t[axis]));
                    }
                    t[axis] - far
                });
                weight * best(d, dimensions)
            })
            .sum::<f64>()
    };
    let n = 200;
    let mut worst = [(0.0_f64, [0.0; 3]); 2];
    for a in 0..=n {
        for b in 0..=n {
            for c in (0..=n / 2).step_by(5) {
                let t = [a, b, c].map(|k| f64::from(k) / f64::from(n));
                for (k, worst) in worst.iter_mut().enumerate() {
                    let found = largest(t, k + 2);
                    if found > worst.0 {
                        *worst = (found, t);
                    }
                }
            }
        }
    }
    // Then uphill in halving steps.
    for (k, (found, t)) in worst.iter_mut().enumerate() {
        let mut step = 0.01;
        while step > 1e-9 {
            let mut better = false;
            for axis in 0..3 {
                for side in [-step, step] {
                    let mut next = *t;
                    next[axis] += side;
                    if largest(next, k + 2) > *found {
                        (*found, *t) = (largest(next, k + 2), next);
                        better = true;
                    }
                }
            }
            if !better {
                step /= 2.0;
            }
        }
        println!("{}D: at most {found} at {t:?}", k + 2);
        assert!(*found <= 1.0 + 1e-12 && *found > 0.9999, "{found}");
    }
}

#[test]
fn gradients_are_spread_evenly() {
    // 2D: uniform on the circle.
    const PARTS: usize = 360;
    const COUNT: usize = 1_000_000;
    let mut bins = [0.0_f64; PARTS];
    for k in 0..COUNT as i32 {
        let [x, y] = lattice_gradient_2d([k % 1000, k / 1000], 3);
        assert!((x.hypot(y) - std::f64::consts::SQRT_2).abs() < 1e-12);
        let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
        bins[((turn * PARTS as f64) as usize).min(PARTS - 1)] += 1.0;
    }
    let mean = COUNT as f64 / PARTS as f64;
    let chi: f64 = bins.iter().map(|b| (b - mean) * (b - mean) / mean).sum();
    // Chi squared of 359 degrees of freedom: mean 359, standard deviation 26.8.
    println!("2D directions: chi squared {chi:.0} of 359");
    assert!((chi - 359.0).abs() < 4.0 * 26.8, "{chi}");

    // 3D: 24 directions, equally frequent.
    let mut seen: Vec<([f64; 3], f64)> = Vec::new();
    for k in 0..COUNT as i32 {
        let g = lattice_gradient_3d([k % 100, k / 100 % 100, k / 10_000], 3);
        match seen.iter_mut().find(|(d, _)| *d == g) {
            Some((_, count)) => *count += 1.0,
            None => seen.push((g, 1.0)),
        }
    }
    assert_eq!(seen.len(), 24);
    let mean = COUNT as f64 / 24.0;
    let chi: f64 = seen
        .iter()
        .map(|(_, b)| (b - mean) * (b - mean) / mean)
        .sum();
    println!("3D directions: chi squared {chi:.1} of 23");
    assert!(chi < 23.0 + 4.0 * 6.8, "{chi}");
    // A spherical 5-design: along every axis d, the means of (g.d)^2 and (g.d)^4 are the sphere's, 1/3 and 1/5.
    let mut random = Random(17);
    for _ in 0..100 {
        let d: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()) - 0.5);
        let norm = d.iter().map(|c| c * c).sum::<f64>().sqrt() * 1.3847;
        let mean = |power: i32| {
            let products = seen
                .iter()
                .map(|(g, _)| (0..3).map(|k| g[k] * d[k]).sum::<f64>() / norm);
            products.map(|p| p.powi(power)).sum::<f64>() / 24.0
        };
        for (power, expected) in [(1, 0.0), (2, 1.0 / 3.0), (3, 0.0), (4, 0.2), (5, 0.0)] {
            assert!((mean(power) - expected).abs() < 1e-12, "power {power}");
        }
    }
}
