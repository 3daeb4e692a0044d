//! Height fields: the device, the processor, and the definition; bounds, slopes and the filter.

use veduta::WorldPos;
use veduta::reference::field::{self as reference, Field};
use veduta::reference::parallel::parallel_map;
use veduta::terrain::{HeightField, Kind, Land, Place, Prepared, heights};

use crate::common::{Random, gpu};

/// One of each kind, with a relief of about 8 km, which is what the bars are for.
fn fields() -> Vec<(&'static str, HeightField)> {
    let with = |kind, wavelength, amplitude, hurst| HeightField {
        kind,
        wavelength,
        amplitude,
        hurst,
        octaves: 12,
        ..HeightField::default()
    };
    let ridged = |smoothness| Kind::Ridged {
        gain: 2.0,
        smoothness,
    };
    vec![
        ("fbm", with(Kind::Fbm, 8192.0, 3000.0, 1.0)),
        ("ridged", with(ridged(0.0), 16384.0, 4000.0, 1.0)),
        ("smooth", with(ridged(0.01), 10000.0, 4000.0, 0.9)),
        (
            "hybrid",
            with(Kind::Hybrid { offset: 0.7 }, 8192.0, 2500.0, 0.25),
        ),
        (
            "craters",
            with(
                Kind::Craters {
                    share: 0.6,
                    roughness: 0.1,
                },
                30000.0,
                9000.0,
                1.0,
            ),
        ),
        (
            "mesa",
            with(
                Kind::Mesa {
                    strata: 0.4,
                    hardness: 0.9,
                },
                16384.0,
                3000.0,
                0.95,
            ),
        ),
        (
            "mix",
            with(Kind::Mix { mountains: 3.0 }, 4096.0, 1500.0, 1.0),
        ),
    ]
}

fn position(random: &mut Random, reach: f64) -> WorldPos {
    let mut axis = || (f64::from(random.unit()) - 0.5) * 2.0 * reach;
    let (x, z) = (axis(), axis());
    let mut p = WorldPos::from_metres([x, 0.0, z].into());
    p.frac.x = random.unit();
    p.frac.z = random.unit();
    p
}

fn footprint(random: &mut Random) -> f32 {
    0.5 * 2000_f32.powf(random.unit())
}

/// Bounds over squares, against 200 places in each, at random and at the corners; and how much wider they are than what these find.
#[test]
fn bounds_over_a_square_hold_and_are_close_over_a_small_one() {
    let mut random = Random(7);
    for (name, field) in fields() {
        if let Kind::Own { .. } = field.kind {
            continue;
        }
        let double = field.prepare::<f64>().unwrap();
        let whole = field.bounds().unwrap();
        for (size, width) in [
            (4.0, 0.0),
            (60.0, 0.0),
            (60.0, 30.0),
            (900.0, 0.0),
            (900.0, 200.0),
        ] {
            let (mut wide, mut found, mut steep, mut climbed) = (0.0, 0.0, 0.0, 0.0_f64);
            for _ in 0..6 {
                let corner = position(&mut random, 1e7);
                let over = double.bounds_over(corner, size, width).unwrap();
                assert!(over.minimum >= whole.minimum && over.maximum <= whole.maximum);
                assert!(over.lipschitz <= whole.lipschitz);
                let eye = double.place(corner);
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for k in 0..200 {
                    let at = match k {
                        0..4 => [f64::from(k % 2), f64::from(k / 2)],
                        _ => [random.unit(), random.unit()].map(f64::from),
                    };
                    let g = double.ground_from(eye, at.map(|a| a * size), width);
                    let slope = g.slope[0].hypot(g.slope[1]);
                    assert!(
                        over.minimum <= g.height && g.height <= over.maximum,
                        "{name}, {size} m, {width} m: {} of {over:?}",
                        g.height
                    );
                    assert!(slope <= over.lipschitz, "{name}: {slope} of {over:?}");
                    (low, high) = (low.min(g.height), high.max(g.height));
                    climbed = climbed.max(slope);
                }
                wide += over.maximum - over.minimum;
                found += high - low;
                steep += over.lipschitz / 6.0;
            }
            println!(
                "{name}, {size} m, samples of {width} m: {:.1} times as high as found, slope {steep:.2} of {:.2}, found {climbed:.2}",
                wide / found,
                whole.lipschitz
            );
            // Followed octave by octave: over a square that all octaves are wider than, and far below the bounds of the whole field.
            if size == 4.0
                && matches!(
                    field.kind,
                    Kind::Fbm | Kind::Ridged { .. } | Kind::Hybrid { .. }
                )
            {
                assert!(wide / 6.0 < 0.2 * (whole.maximum - whole.minimum), "{name}");
                assert!(steep < 0.7 * whole.lipschitz, "{name}: {steep}");
            }
        }
        let corner = WorldPos::default();
        for (size, width, what) in [
            (-1.0, 0.0, "size"),
            (f64::NAN, 0.0, "size"),
            (1.0, 2e6, "footprint"),
        ] {
            let error = double
                .bounds_over(corner, size, width)
                .unwrap_err()
                .to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}

#[test]
fn the_device_is_the_processor_to_its_last_places_and_truth_to_thirty_millimetres() {
    let mut random = Random(1);
    for (name, field) in fields() {
        let single = field.prepare::<f32>().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let mut same = 0;
        let (mut worst, mut off, mut total) = (0_f64, 0_f64, 0);
        let (mut alone, mut far_apart) = (0_f64, 0);
        for reach in [1e4, 1e8, 1e14] {
            for width in [0.0, footprint(&mut random), footprint(&mut random)] {
                let places: Vec<WorldPos> =
                    (0..4000).map(|_| position(&mut random, reach)).collect();
                let found = heights(gpu(), veduta::programs(), &field, &places, width).unwrap();
                for (p, g) in places.iter().zip(found) {
                    let twin = single.ground(*p, width);
                    let truth = double.ground(*p, f64::from(width));
                    total += 1;
                    same += i32::from(twin == g);
                    let apart = f64::from((g.height - twin.height).abs());
                    let unit = 0.5 * f64::from(f32::EPSILON);
                    // Where a sum passes 0 its own last place says nothing: the amplitude is the least size.
                    let size = f64::from(g.height).abs().max(field.amplitude);
                    worst = worst.max(apart / (unit * size));
                    let own = f64::from(g.height).abs();
                    if own > 1.0 {
                        alone = alone.max(apart / (unit * own));
                    }
                    far_apart += i32::from(apart > 4.0 * unit * own.max(1.0));
                    off = off.max((f64::from(g.height) - truth.height).abs());
                    assert!(g.lost >= 0.0 && g.lost.is_finite());
                }
            }
        }
        println!(
            "{name}: {same} of {total} bit by bit, {worst:.1} places, {alone:.1} of the height itself above 1 m ({far_apart} beyond 4), {:.1} mm",
            1e3 * off
        );
        if let Kind::Mix { .. } = field.kind {
            assert!(worst <= 4.0, "{name}: {worst} places");
            // Measured: 1.2 % of all heights beyond 4 of their own last places, where the three noises nearly cancel, up to 317 of a height above 1 m.
            assert!(
                far_apart * 50 < total && alone < 1000.0,
                "{name}: {far_apart}, {alone}"
            );
        } else {
            // The same operations in the same order.
            assert_eq!(same, total, "{name}: {worst} places");
        }
        assert!(off <= 0.030, "{name}: {off} m");
    }
}

/// The members of the reference's field, for an eye at a place. `single` is the field prepared, which costs more than all the rest.
fn members(field: &HeightField, single: &Prepared<f32>, place: Place<f64>) -> Field {
    let block = single.block(Place {
        cell: [0; 2],
        frac: [0.0; 2],
    });
    Field {
        cell: place.cell,
        frac: place.frac,
        wavelength: f64::from(block.wavelength),
        amplitude: field.amplitude,
        base: field.base,
        fall: (-field.hurst).exp2(),
        shape: f64::from(block.shape),
        detail: f64::from(block.detail),
        octaves: block.octaves,
        seed: block.seed,
        mean: block.mean.map(f64::from),
        lost: block.lost.map(f64::from),
        sea: f64::from(block.sea),
    }
}

#[test]
fn double_precision_is_the_definition() {
    let mut random = Random(2);
    for (name, field) in fields() {
        let single = field.prepare::<f32>().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let (mut height, mut slope, mut lost) = (0_f64, 0_f64, 0_f64);
        for i in 0..1000 {
            let p = position(&mut random, 1e8);
            let width = if i % 3 == 0 {
                0.0
            } else {
                f64::from(footprint(&mut random))
            };
            let found = double.ground(p, width);
            let place = double.place(p);
            let truth = reference::ground(
                &members(&field, &single, place),
                field.kind.number(),
                [0.0; 2],
                width,
            );
            height = height.max((found.height - truth.height).abs());
            for k in 0..2 {
                slope = slope.max((found.slope[k] - truth.slope[k]).abs());
            }
            lost = lost.max((found.lost - truth.lost).abs() / (0.1 + truth.lost));
        }
        println!("{name}: height {height:.1e} m, slope {slope:.1e}, lost {lost:.1e}");
        // The series have f32 members in the reference's field.
        assert!(height < 1e-2 && slope < 1e-2 && lost < 1e-3, "{name}");
    }
}

#[test]
fn slopes_are_those_of_the_heights() {
    let mut random = Random(3);
    for (name, field) in fields() {
        let double = field.prepare::<f64>().unwrap();
        let step = 1e-4;
        let mut bad = 0;
        let total = 4000;
        for i in 0..total {
            let p = position(&mut random, 1e6);
            let width = if i % 2 == 0 {
                0.0
            } else {
                f64::from(footprint(&mut random))
            };
            let eye = double.place(p);
            let at = |x: f64, z: f64| double.ground_from(eye, [x, z], width);
            let found = at(0.0, 0.0);
            let central = [
                (at(step, 0.0).height - at(-step, 0.0).height) / (2.0 * step),
                (at(0.0, step).height - at(0.0, -step).height) / (2.0 * step),
            ];
            let size = 1.0 + found.slope[0].hypot(found.slope[1]);
            let off = (0..2)
                .map(|k| (found.slope[k] - central[k]).abs())
                .fold(0.0, f64::max);
            bad += i32::from(off > 1e-4 * size);
        }
        println!("{name}: {bad} of {total} at a kink");
        // Kinks (crests, weights that are cut off) are lines: a step of 0.1 mm hardly ever meets one.
        assert!(bad <= 4, "{name}: {bad}");
    }
}

#[test]
fn bounds_hold_where_a_climber_looks_for_their_breach() {
    let mut random = Random(4);
    for (name, field) in fields() {
        let bounds = field.bounds().unwrap();
        let double = field.prepare::<f64>().unwrap();
        assert_eq!(
            bounds.octaves.len(),
            if name == "mix" { 16 } else { 12 },
            "{name}"
        );
        let (mut low, mut high, mut steep) = (f64::INFINITY, f64::NEG_INFINITY, 0_f64);
        for start in 0..60 {
            let sign = if start % 2 == 0 { 1.0 } else { -1.0 };
            let width = if start % 3 == 0 {
                f64::from(footprint(&mut random))
            } else {
                0.0
            };
            let eye = double.place(position(&mut random, 1e8));
            // Random steps that shrink, kept when they lead up (or down), and when they are steeper.
            let (mut at, mut best) = ([0.0; 2], f64::NEG_INFINITY);
            for i in 0..400 {
                let reach = field.wavelength * 0.5_f64.powf(f64::from(i) / 28.0);
                let try_at: [f64; 2] =
                    std::array::from_fn(|k| at[k] + reach * f64::from(random.between(-1.0, 1.0)));
                let g = double.ground_from(eye, try_at, width);
                let slope = g.slope[0].hypot(g.slope[1]);
                low = low.min(g.height);
                high = high.max(g.height);
                steep = steep.max(slope);
                let goal = if start % 4 < 2 {
                    sign * g.height
                } else {
                    slope
                };
                if goal > best {
                    (at, best) = (try_at, goal);
                }
            }
        }
        println!(
            "{name}: heights {low:.0} .. {high:.0} of {:.0} .. {:.0}, slope {steep:.1} of {:.1}",
            bounds.minimum, bounds.maximum, bounds.lipschitz
        );
        assert!(low >= bounds.minimum && high <= bounds.maximum, "{name}");
        assert!(steep <= bounds.lipschitz, "{name}");
        // Nor are they so wide as to say nothing.
        if name == "fbm" || name == "ridged" {
            assert!(
                high - low > 0.4 * (bounds.maximum - bounds.minimum),
                "{name}"
            );
        }
    }
}

/// Mean of the unfiltered field over a square footprint, by 16 x 16 points.
fn averaged(field: &Prepared<f64>, eye: Place<f64>, at: [f64; 2], width: f64) -> f64 {
    let mut sum = 0.0;
    for j in 0..16 {
        for i in 0..16 {
            let [x, z] = [i, j].map(|k| width * ((f64::from(k) + 0.5) / 16.0 - 0.5));
            sum += field.ground_from(eye, [at[0] + x, at[1] + z], 0.0).height;
        }
    }
    sum / 256.0
}

#[test]
fn the_filtered_field_is_nearer_to_the_mean_over_the_footprint() {
    let mut random = Random(5);
    for (name, field) in fields() {
        let double = field.prepare::<f64>().unwrap();
        for share in [0.4, 0.1, 0.02] {
            let width = share * field.wavelength;
            let (mut with, mut without, mut bias) = (0.0, 0.0, 0.0);
            let count = 500_u32;
            let eyes: Vec<_> = (0..count)
                .map(|_| double.place(position(&mut random, 1e7)))
                .collect();
            let three = parallel_map(eyes.len(), |i| {
                let height = |width| double.ground_from(eyes[i], [0.0; 2], width).height;
                let truth = averaged(&double, eyes[i], [0.0; 2], width);
                [truth, height(width), height(0.0)]
            });
            for [truth, filtered, whole] in three {
                with += (filtered - truth).powi(2);
                without += (whole - truth).powi(2);
                bias += filtered - truth;
            }
            let [with, without] = [with, without].map(|s| (s / f64::from(count)).sqrt());
            let bias = bias / f64::from(count);
            println!(
                "{name}, footprint {width:.0} m: filtered {with:.1} m, unfiltered {without:.1} m, bias {bias:.2} m"
            );
            assert!(with < without, "{name}");
            assert!(bias.abs() < 0.35 * with, "{name}: {bias}");
        }
    }
}

#[test]
fn slopes_that_the_filter_takes_off_are_accounted_for() {
    let mut random = Random(6);
    for (name, field) in fields() {
        let double = field.prepare::<f64>().unwrap();
        for share in [0.3, 0.05, 0.01] {
            let width = share * field.wavelength;
            let (mut all, mut kept, mut lost) = (0.0, 0.0, 0.0);
            for _ in 0..6000 {
                let place = double.place(position(&mut random, 1e8));
                let square = |s: [f64; 2]| s[0] * s[0] + s[1] * s[1];
                all += square(double.ground_at(place, 0.0).slope);
                let g = double.ground_at(place, width);
                kept += square(g.slope);
                lost += g.lost;
            }
            println!(
                "{name}, footprint {width:.0} m: slopes {:.3}, kept {:.3}, lost {:.3}",
                all / 6000.0,
                kept / 6000.0,
                lost / 6000.0
            );
            // The hybrid's weights are not those of a geometric sequence.
            let bar = if name == "hybrid" { 0.35 } else { 0.15 };
            assert!(((kept + lost) / all - 1.0).abs() < bar, "{name}");
        }
    }
}

/// Places far off, found by whole numbers: the lattice cell and the fraction of positions of which `f64` would know no metre.
#[test]
fn nothing_changes_far_from_the_origin() {
    let mut random = Random(7);
    for (name, field) in fields() {
        let single = field.prepare::<f32>().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let lattice = field.lattice_wavelength();
        assert_eq!(lattice.fract(), 0.0);
        let period = (lattice as i128) << 24;
        let places: Vec<WorldPos> = (0..300)
            .map(|_| {
                let mut p = position(&mut random, 1e5);
                // Not a multiple of any wavelength.
                p.cell +=
                    veduta::glam::I64Vec3::new(300_000_000_000_000_123, 0, -77_777_777_777_777_777);
                p
            })
            .collect();
        let found = heights(gpu(), veduta::programs(), &field, &places, 0.5).unwrap();
        let (mut worst, mut near) = (0_f64, 0_f64);
        for (p, g) in places.iter().zip(&found) {
            let axis = |k: usize| {
                // Fractions are multiples of 2^-24.
                let at =
                    (i128::from(p.cell[k]) << 24) + (f64::from(p.frac[k]) * 16_777_216.0) as i128;
                let cell = at.div_euclid(period).rem_euclid(1 << 32) as u32;
                (
                    cell.cast_signed(),
                    at.rem_euclid(period) as f64 / period as f64,
                )
            };
            let ((x, u), (z, v)) = (axis(0), axis(2));
            let place = Place {
                cell: [x, z],
                frac: [u, v],
            };
            let truth = reference::ground(
                &members(&field, &single, place),
                field.kind.number(),
                [0.0; 2],
                0.5,
            );
            worst = worst.max((f64::from(g.height) - truth.height).abs());
            near = near.max((double.ground(*p, 0.5).height - truth.height).abs());
        }
        println!(
            "{name}: device {:.1} mm, f64 {:.2} mm",
            1e3 * worst,
            1e3 * near
        );
        assert!(worst <= 0.03 && near <= 0.01, "{name}");
    }
}

/// Heights at offsets from the eye, as rays and pictures ask for them.
#[test]
fn heights_a_hundred_kilometres_from_the_eye_are_true_to_thirty_millimetres() {
    let mut random = Random(8);
    for (name, field) in fields() {
        let single = field.prepare::<f32>().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let eye = position(&mut random, 1e8);
        let block = single.block(single.place(eye));
        let four = |v: [f32; 4]| format!("vec4f({:e}, {:e}, {:e}, {:e})", v[0], v[1], v[2], v[3]);
        let prelude = format!(
            "fn land() -> Field {{ return Field(vec2i({}, {}), vec2f({:e}, {:e}), {:e}, {:e}, {:e}, {:e}, {:e}, {:e}, {}, {}u, {}, {}, {:e}); }}",
            block.cell[0],
            block.cell[1],
            block.frac[0],
            block.frac[1],
            block.wavelength,
            block.amplitude,
            block.base,
            block.fall,
            block.shape,
            block.detail,
            block.octaves,
            block.seed,
            four(block.mean),
            four(block.lost),
            block.sea,
        );
        let expression = format!(
            "ground_at(land(), {}, vec2f(in.f[0], in.f[1]), in.f[2]).height",
            field.kind.number()
        );
        let rows: Vec<[f32; 3]> = (0..4000)
            .map(|i| {
                let away = 1e5 * (i as f32 / 4000.0);
                let (sine, cosine) = random.between(0.0, std::f32::consts::TAU).sin_cos();
                [
                    away * cosine,
                    away * sine,
                    if i % 2 == 0 { 0.0 } else { away * 0.001 },
                ]
            })
            .collect();
        let bits: Vec<u32> = rows.iter().flatten().map(|v| v.to_bits()).collect();
        let found = crate::common::evaluator(
            &["veduta::terrain::field::{Field, ground_at}"],
            &prelude,
            &expression,
            3,
        )
        .run(&bits)
        .unwrap();
        let (mut off, mut apart, mut same) = (0_f64, 0_f64, 0);
        for ([x, z, width], g) in rows.iter().zip(&found) {
            let at = [f64::from(*x), f64::from(*z)];
            let truth = double.ground_from(double.place(eye), at, f64::from(*width));
            let twin = single.ground_from(single.place(eye), [*x, *z], *width);
            off = off.max((g - truth.height).abs());
            let size = g.abs().max(field.amplitude);
            let gap = (g - f64::from(twin.height)).abs();
            apart = apart.max(gap / (0.5 * f64::from(f32::EPSILON) * size));
            same += i32::from(*g == f64::from(twin.height));
        }
        println!(
            "{name}: {:.1} mm off, {same} of {} as on the processor, {:.1} places apart",
            1e3 * off,
            rows.len(),
            apart
        );
        assert!(off <= 0.030, "{name}: {off} m");
        match field.kind {
            Kind::Mix { .. } | Kind::Mesa { .. } => {
                assert!(apart <= 4.0, "{name}: {apart} places");
            }
            _ => assert_eq!(same as usize, rows.len(), "{name}: {apart} places"),
        }
    }
}

#[test]
fn files_make_fields_and_faults_name_what_is_wrong() {
    for name in Land::names() {
        let land = Land::named(name).unwrap();
        assert_eq!(Land::from_ron(&land.to_ron().unwrap()).unwrap(), land);
    }
    let fault = |field: HeightField| field.check().unwrap_err().to_string();
    let good = HeightField::default();
    let bad = fault(HeightField {
        wavelength: f64::NAN,
        ..good.clone()
    });
    assert!(
        bad.contains("field.wavelength") && bad.contains("NaN"),
        "{bad}"
    );
    let bad = fault(HeightField {
        kind: Kind::Mix { mountains: 2.5 },
        ..good.clone()
    });
    assert!(bad.contains("mountains") && bad.contains("whole"), "{bad}");
    let bad = fault(HeightField {
        octaves: 17,
        ..good.clone()
    });
    assert!(bad.contains("octaves") && bad.contains("[1, 16]"), "{bad}");
    assert!(
        Land::named("venus")
            .unwrap_err()
            .to_string()
            .contains("`moon`")
    );
    assert!(
        HeightField::from_ron("(kind: Fbm)")
            .unwrap_err()
            .to_string()
            .contains("1:")
    );
    let own = HeightField {
        kind: Kind::Own {
            gain: 2.0,
            smoothness: 0.0,
            bounds: None,
        },
        ..good
    };
    assert!(own.bounds().is_err());
    assert!(
        own.prepare::<f64>()
            .unwrap()
            .ground(WorldPos::default(), 0.0)
            .height
            .is_nan()
    );
}
