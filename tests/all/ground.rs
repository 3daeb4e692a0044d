//! The living ground on the device: its balance, its rests, exact solutions, symmetry, its references.

use veduta::ground::{
    Boundary, CHANNELS, Erosion, Ground, GroundEdit, GroundOptions, GroundReport, GroundScene,
    GroundState, Scheme, Shape, Tool,
};
use veduta::reference::ground::{Cells, Edge, Shallow, Weather};

use crate::common::{Random, gpu};

pub fn made(options: &GroundOptions, state: &GroundState) -> Ground {
    let gpu = gpu();
    Ground::new(&gpu.device, &gpu.queue, veduta::programs(), options, state).unwrap()
}

pub fn steps(ground: &mut Ground, count: u32) {
    let mut left = count;
    while left > 0 {
        let now = left.min(256);
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let _ = ground.step(&mut encoder, now);
        gpu().queue.submit([encoder.finish()]);
        left -= now;
    }
}

pub fn run(
    options: &GroundOptions,
    state: &GroundState,
    count: u32,
) -> (GroundState, GroundReport) {
    let mut ground = made(options, state);
    steps(&mut ground, count);
    (ground.state(gpu()).unwrap(), ground.report(gpu()).unwrap())
}

pub fn flat(columns: usize, rows: usize, height: impl Fn(f64, f64) -> f64) -> GroundState {
    let heights: Vec<f32> = (0..rows * columns)
        .map(|k| height((k % columns) as f64, (k / columns) as f64) as f32)
        .collect();
    GroundState::from_heights(columns, rows, &heights).unwrap()
}

pub fn hilly(columns: usize, rows: usize, altitude: f64, seed: u64) -> GroundState {
    let mut random = Random(seed);
    let phase: Vec<f64> = (0..8)
        .map(|_| random.uniform(0.0, std::f64::consts::TAU))
        .collect();
    flat(columns, rows, |x, z| {
        let mut h = altitude;
        for (k, p) in phase.iter().enumerate() {
            let f = 0.05 * (k + 1) as f64;
            h += 4.0 / (k + 1) as f64 * (f * x + p).sin() * (f * z + 1.7 * p).cos();
        }
        h
    })
}

fn judge_balance(begin: &GroundState, end: &GroundState, report: &GroundReport, name: &str) {
    let gone = report.evaporated + report.seeped + report.run_off;
    let balance = (end.sums()[1] - begin.sums()[1] - report.gained + gone).abs();
    let moved = report.gained + gone;
    assert!(
        moved == 0.0 || balance <= 1e-4 * moved,
        "{name}: {balance} of {moved}"
    );
    let total = end.sums()[1].max(begin.sums()[1]);
    assert!(
        balance <= 1e-6 * total,
        "{name}: {balance} of {total} in all"
    );
    let solid = end.changes()[0] - begin.changes()[0] + end.sums()[2] - begin.sums()[2]
        + report.load_run_off;
    assert!(
        solid.abs() <= 1e-3 * end.changes()[1].max(1e-12),
        "{name}: ground and load {solid} of {}",
        end.changes()[1]
    );
    // Of all that is there, solids too.
    let all: f64 = (0..end.rows * end.columns)
        .map(|k| end.ground(k % end.columns, k / end.columns).abs())
        .sum::<f64>()
        + end.sums()[2];
    assert!(
        solid.abs() <= 1e-6 * all,
        "{name}: ground and load {solid} of {all} in all"
    );
    for (k, c) in end.cells.chunks_exact(CHANNELS).enumerate() {
        assert!(c.iter().all(|v| v.is_finite()), "{name}: cell {k}: {c:?}");
        assert!(c[1] >= 0.0 && c[2] >= -1e-9, "{name}: cell {k}: {c:?}");
    }
}

#[test]
fn ground_water_and_soil_are_kept() {
    for altitude in [0.0, 4000.0] {
        for scheme in [Scheme::Source, Scheme::Physical] {
            for boundary in [Boundary::Open, Boundary::Closed, Boundary::Periodic] {
                let begin = hilly(83, 70, altitude, 3);
                let options = GroundOptions {
                    scheme,
                    boundary,
                    step: 0.25,
                    rain: 10.0 / 3.6e6,
                    evaporation: 1.0 / 3.6e6,
                    seepage: 0.5 / 3.6e6,
                    erosion: (scheme == Scheme::Source).then(Erosion::default),
                    ..Default::default()
                };
                let (end, report) = run(&options, &begin, 3000);
                let name = format!("{altitude} m, {scheme:?}, {boundary:?}");
                judge_balance(&begin, &end, &report, &name);
                let expected = 3000.0 * 0.25 * 10.0 / 3.6e6 * 83.0 * 70.0;
                assert!((report.gained / expected - 1.0).abs() < 1e-5, "{name}");
                assert_eq!(report.run_off > 0.0, boundary == Boundary::Open, "{name}");
            }
        }
    }
}

#[test]
fn ground_lakes_rest() {
    for altitude in [0.0_f64, 4000.0] {
        for scheme in [Scheme::Source, Scheme::Physical] {
            let mut begin = hilly(64, 64, altitude, 5);
            let level = altitude + 1.0;
            for c in begin.cells.chunks_exact_mut(CHANNELS) {
                c[1] = (level - f64::from(c[0])).max(0.0) as f32;
                c[3] = c[1];
            }
            let options = GroundOptions {
                scheme,
                boundary: Boundary::Closed,
                step: if scheme == Scheme::Source { 0.25 } else { 0.0 },
                ..Default::default()
            };
            let (end, report) = run(&options, &begin, 2000);
            let allowed = (1e-5_f64).max(2.0 * f64::from((level as f32).next_up() - level as f32));
            for z in 0..64 {
                for x in 0..64 {
                    let (was, is) = (begin.water(x, z), end.water(x, z));
                    assert!(
                        (was - is).abs() <= allowed,
                        "{scheme:?} {altitude} {x} {z}: {was} {is}"
                    );
                }
            }
            assert_eq!(report.active_tiles, 0, "{scheme:?} at {altitude} m runs on");
        }
    }
}

#[test]
fn ground_dam_break_meets_ritter() {
    let h = 10.0_f64;
    let mut begin = flat(1000, 16, |_, _| 0.0);
    for k in 0..16_000 {
        if k % 1000 < 500 {
            begin.cells[k * CHANNELS + 1] = h as f32;
        }
    }
    let options = GroundOptions {
        scheme: Scheme::Physical,
        boundary: Boundary::Closed,
        step: 0.0,
        ..Default::default()
    };
    let (end, report) = run(&options, &begin, 1000);
    let (t, c) = (report.time, (9.81 * h).sqrt());
    assert!(2.0 * c * t < 450.0 && c * t > 100.0, "{t} s");
    let mut squares = 0.0;
    let mut front = 0.0;
    for x in 0..1000 {
        let xi = x as f64 + 0.5 - 500.0;
        let exact = if xi < -c * t {
            h
        } else if xi > 2.0 * c * t {
            0.0
        } else {
            (2.0 * c - xi / t).powi(2) / (9.0 * 9.81)
        };
        let is = end.water(x, 7);
        squares += (is - exact).powi(2);
        if is > 0.01 * h {
            front = xi + 0.5;
        }
    }
    let rms = (squares / 1000.0).sqrt() / h;
    let ratio = front / ((2.0 - 0.3) * c * t);
    println!(
        "t {t:.2} s: profile RMS {:.3} %, position of 1 % depth {:.2} % off",
        100.0 * rms,
        100.0 * (ratio - 1.0)
    );
    assert!(rms < 0.05, "{rms}");
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn ground_bowl_swings_as_thacker_says() {
    // A planar surface in a bowl 1 m deep of radius 40 m.
    let (a, h0, g, eta) = (40.0_f64, 1.0_f64, 9.81_f64, 8.0_f64);
    let n = 128;
    let middle = 63.5;
    let mut begin = flat(n, n, |x, z| {
        let r = ((x - middle).powi(2) + (z - middle).powi(2)) / (a * a);
        -h0 * (1.0 - r)
    });
    for z in 0..n {
        for x in 0..n {
            let level = eta * h0 / (a * a) * (2.0 * (x as f64 - middle) - eta);
            let c = begin.cell_mut(x, z);
            c[1] = (level - f64::from(c[0])).max(0.0) as f32;
        }
    }
    let omega = (2.0 * g * h0).sqrt() / a;
    let period = std::f64::consts::TAU / omega;
    let options = GroundOptions {
        scheme: Scheme::Physical,
        boundary: Boundary::Closed,
        step: 0.02,
        ..Default::default()
    };
    let mut ground = made(&options, &begin);
    // The centre of the water swings as a cosine: its second fall through the middle comes after a period and a quarter.
    let mut crossings = Vec::new();
    let mut before = f64::NAN;
    for k in 1..=400 {
        steps(&mut ground, 10);
        let state = ground.state(gpu()).unwrap();
        let (mut sum, mut all) = (0.0, 0.0);
        for z in 0..n {
            for x in 0..n {
                let w = state.water(x, z);
                sum += w * (x as f64 - middle);
                all += w;
            }
        }
        let centre = sum / all;
        if before > 0.0 && centre <= 0.0 {
            crossings.push((f64::from(k) - centre / (centre - before)) * 0.2);
        }
        before = centre;
    }
    assert!(
        crossings.len() >= 2,
        "{crossings:?}, a period is {period} s"
    );
    let found = crossings[1] - crossings[0];
    println!("period {found:.3} s, exact {period:.3} s");
    assert!((found / period - 1.0).abs() < 0.03, "{found} {period}");
}

#[test]
fn ground_symmetry_stays() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        for boundary in [Boundary::Open, Boundary::Closed] {
            let n = 64;
            let mut begin = flat(n, n, |x, z| {
                let (a, b) = ((x - 31.5).abs(), (z - 31.5).abs());
                0.01 * (a * a + b * b) + 0.7 * ((0.3 * a).sin() + (0.3 * b).sin())
            });
            for z in 0..n {
                for x in 0..n {
                    let (a, b) = ((x as f64 - 31.5).abs(), (z as f64 - 31.5).abs());
                    begin.cell_mut(x, z)[1] = if a.max(b) < 9.0 { 5.0 } else { 0.0 };
                }
            }
            let options = GroundOptions {
                scheme,
                boundary,
                step: 0.05,
                friction: 0.02,
                erosion: (scheme == Scheme::Source).then(Erosion::default),
                ..Default::default()
            };
            let (end, _) = run(&options, &begin, 400);
            for z in 0..n {
                for x in 0..n {
                    let pick = |x: usize, z: usize| {
                        let c = end.cell(x, z);
                        [c[1], c[2], c[8], c[10]].map(f32::to_bits)
                    };
                    let here = pick(x, z);
                    for (mx, mz) in [(n - 1 - x, z), (x, n - 1 - z), (z, x)] {
                        assert_eq!(here, pick(mx, mz), "{scheme:?} {boundary:?} {x} {z}");
                    }
                }
            }
        }
    }
}

fn edge(boundary: Boundary) -> Edge {
    match boundary {
        Boundary::Open => Edge::Open,
        Boundary::Closed => Edge::Closed,
        Boundary::Periodic => Edge::Periodic,
    }
}

fn random_state(columns: usize, rows: usize, seed: u64, eroding: bool) -> GroundState {
    let mut random = Random(seed);
    let mut state = flat(columns, rows, |_, _| 0.0);
    for c in state.cells.chunks_exact_mut(CHANNELS) {
        c[0] = random.between(0.0, 3.0);
        c[1] = if random.unit() < 0.2 {
            0.0
        } else {
            random.between(0.0, 2.0)
        };
        c[2] = if eroding {
            random.between(0.0, 0.1)
        } else {
            0.0
        };
        for speed in &mut c[4..8] {
            *speed = random.between(0.0, 1.0);
        }
    }
    state
}

/// Weather of a step, for the device and for the references: rain, evaporation, seepage and two springs, one over an edge.
fn weathered(options: &mut GroundOptions) -> Weather {
    (options.rain, options.evaporation, options.seepage) = (3e-3, 2e-2, 1e-2);
    options.springs = [(9.0, 11.0, 3.5, 2.0), (0.0, 5.0, 6.2, 0.7)]
        .map(|(x, z, radius, rate)| veduta::ground::Spring { x, z, radius, rate })
        .to_vec();
    let spacing = f64::from(options.spacing);
    let springs = options.springs.iter().map(|s| {
        let [x, z, radius] = [s.x, s.z, s.radius].map(f64::from);
        let cells = (-20..60)
            .flat_map(|i| (-20..60).map(move |k| [f64::from(i), f64::from(k)]))
            .filter(|[i, k]| *i >= 0.0 && *k >= 0.0)
            .filter(|[i, k]| (i - x).powi(2) + (k - z).powi(2) <= radius * radius)
            .count() as f64;
        [
            x,
            z,
            radius,
            f64::from(s.rate) / (cells * spacing * spacing),
        ]
    });
    Weather {
        rain: f64::from(options.rain),
        evaporation: f64::from(options.evaporation),
        seepage: f64::from(options.seepage),
        springs: springs.collect(),
    }
}

/// Sizes whose last tiles are whole, narrow, low and both.
const SIZES: [[usize; 2]; 7] = [
    [37, 50],
    [64, 33],
    [100, 16],
    [16, 16],
    [83, 70],
    [200, 64],
    [1000, 20],
];

/// Of a number: what a bar of 1e-5 of it allows. Below a twentieth of the state's scale of 1 a float of what it is the difference of has no more digits.
fn allowed(exact: f64) -> f64 {
    1e-5 * exact.abs().max(0.05)
}

#[test]
fn ground_source_step_meets_its_reference() {
    let plain = Erosion {
        slope_limit: 0.5,
        ..Default::default()
    };
    let spotted = Erosion {
        hardness: 0.8,
        hard_wavelength: 7.0,
        dig: 0.3,
        lay: 0.4,
        capacity: 0.3,
        ..plain
    };
    let layered = Erosion {
        layer: 0.75,
        ..spotted
    };
    let worst = std::cell::Cell::new(0.0_f64);
    for (seed, boundary) in [Boundary::Open, Boundary::Closed, Boundary::Periodic]
        .into_iter()
        .enumerate()
    {
        for [columns, rows] in SIZES {
            for (erosion, weather) in [
                (None, false),
                (Some(plain), false),
                (None, true),
                (Some(spotted), true),
                (Some(layered), true),
            ] {
                // Whether water takes its speed along.
                let momentum = columns != 100;
                let mut begin = random_state(columns, rows, seed as u64, erosion.is_some());
                let mut random = Random(50 + seed as u64);
                for c in begin.cells.chunks_exact_mut(CHANNELS) {
                    c[3] = random.between(0.0, 2.0);
                }
                let mut options = GroundOptions {
                    boundary,
                    erosion,
                    momentum,
                    step: 0.3,
                    mean_weight: 0.1,
                    ..Default::default()
                };
                let sky = match weather {
                    true => weathered(&mut options),
                    false => Weather::default(),
                };
                let (end, report) = run(&options, &begin, 1);
                let column = |k: usize| -> Vec<f64> {
                    begin
                        .cells
                        .chunks_exact(CHANNELS)
                        .map(|c| f64::from(c[k]))
                        .collect()
                };
                let mut cells = Cells {
                    columns,
                    rows,
                    ground: column(0),
                    water: column(1),
                    load: column(2),
                    speeds: begin
                        .cells
                        .chunks_exact(CHANNELS)
                        .map(|c| [4, 5, 6, 7].map(|k| f64::from(c[k])))
                        .collect(),
                };
                let digging = erosion.map(|e| {
                    [
                        e.capacity,
                        e.deepest,
                        e.dig,
                        e.lay,
                        e.slope_limit,
                        e.slide,
                        e.hardness,
                        e.hard_wavelength,
                        e.layer,
                    ]
                    .map(f64::from)
                });
                // The speeds before they mix.
                let (step, damping) = (f64::from(0.3_f32), f64::from(0.97_f32));
                let mut plain = cells.clone();
                let _ = plain.source_step(edge(boundary), step, damping, false, digging, &sky);
                let went =
                    cells.source_step(edge(boundary), step, damping, momentum, digging, &sky);
                for k in 0..columns * rows {
                    let c = &end.cells[k * CHANNELS..];
                    let before = f64::from(begin.cells[k * CHANNELS + 1]);
                    let mean = f64::from(begin.cells[k * CHANNELS + 3]);
                    let pairs = [
                        // The change alone: what is dug is small beside the ground.
                        (
                            f64::from(c[8]) + f64::from(c[9]),
                            cells.ground[k] - f64::from(c[0]),
                        ),
                        (f64::from(c[1]) + f64::from(c[10]), cells.water[k]),
                        (f64::from(c[2]) + f64::from(c[11]), cells.load[k]),
                        (
                            f64::from(c[3]),
                            mean + (cells.water[k] - mean) * f64::from(0.1_f32),
                        ),
                        (f64::from(c[4]), cells.speeds[k][0]),
                        (f64::from(c[5]), cells.speeds[k][1]),
                        (f64::from(c[6]), cells.speeds[k][2]),
                        (f64::from(c[7]), cells.speeds[k][3]),
                    ];
                    let out = plain.speeds[k].iter().sum::<f64>() * step;
                    let limited = out >= before * 0.999998;
                    let kept = if limited { before * 1e-6 } else { before - out };
                    let (x, z) = ((k % columns) as i64, (k / columns) as i64);
                    // Speeds mix by what stays and what comes. Both are differences of floats of the scale of the levels: by what these change, the mixture may.
                    let mixture = |side: usize| {
                        let (dx, dz) = [(1, 0), (0, 1), (-1, 0), (0, -1)][side];
                        let (fx, fz) = (x - dx, z - dz);
                        let there =
                            (0..columns as i64).contains(&fx) && (0..rows as i64).contains(&fz);
                        if !momentum || !(there || boundary == Boundary::Periodic) {
                            return 0.0;
                        }
                        let from = fz.rem_euclid(rows as i64) * columns as i64
                            + fx.rem_euclid(columns as i64);
                        let (v, comes) = (plain.speeds[k][side], plain.speeds[from as usize][side]);
                        let arriving = comes * step;
                        let stays_off = if limited { 0.0 } else { 3e-7 * before.max(1.0) };
                        (comes - v).abs() * (arriving * stays_off + kept * 1e-7)
                            / (kept + arriving).max(1e-20).powi(2)
                    };
                    for (n, (is, exact)) in pairs.into_iter().enumerate() {
                        let most = allowed(exact) + if n < 4 { 0.0 } else { mixture(n - 4) };
                        worst.set(worst.get().max((is - exact).abs() / most));
                        assert!(
                            (is - exact).abs() <= most,
                            "{boundary:?} {columns}x{rows} cell {k} number {n}: {is} {exact}, {erosion:?} {weather}"
                        );
                    }
                }
                for (is, exact) in [
                    (report.run_off, went.run_off),
                    (report.gained, went.gained),
                    (report.evaporated, went.evaporated),
                    (report.seeped, went.seeped),
                    (report.load_run_off, went.load_off),
                ] {
                    assert!(
                        (is - exact).abs() <= 1e-5 * exact.max(1e-9),
                        "{is} {exact}: {report:?} {went:?}"
                    );
                }
                assert_eq!(report.gained > 0.0, weather);
            }
        }
    }
    println!("at most {:.2} of what is allowed", worst.get());
}

#[test]
fn ground_shallow_step_meets_its_reference() {
    let mut worst = 0.0_f64;
    for (seed, boundary) in [Boundary::Open, Boundary::Closed, Boundary::Periodic]
        .into_iter()
        .enumerate()
    {
        for ([columns, rows], weather) in SIZES.iter().flat_map(|s| [(*s, false), (*s, true)]) {
            let begin = random_state(columns, rows, 10 + seed as u64, false);
            let mut options = GroundOptions {
                scheme: Scheme::Physical,
                boundary,
                step: 0.05,
                friction: 0.03,
                spacing: 2.0,
                ..Default::default()
            };
            let sky = match weather {
                true => weathered(&mut options),
                false => Weather::default(),
            };
            // The second of two steps, from what the first left, so that discharges are in use.
            let (middle, _) = run(&options, &begin, 1);
            let (end, report) = run(&options, &middle, 1);
            let number = |c: &[f32], k: usize| f64::from(c[k]);
            let index = |x: usize, z: usize| z * columns + x;
            let mut shallow = Shallow {
                columns,
                rows,
                ground: middle
                    .cells
                    .chunks_exact(CHANNELS)
                    .map(|c| number(c, 0))
                    .collect(),
                water: middle
                    .cells
                    .chunks_exact(CHANNELS)
                    .map(|c| number(c, 1))
                    .collect(),
                speeds: vec![[0.0; 2]; columns * rows],
                discharges: middle
                    .cells
                    .chunks_exact(CHANNELS)
                    .map(|c| [number(c, 12), number(c, 13)])
                    .collect(),
            };
            let speeds = |state: &GroundState, x: usize, z: usize| {
                let wraps = boundary == Boundary::Periodic;
                let back = |n: usize, size: usize| {
                    if n + 1 < size {
                        Some(n + 1)
                    } else {
                        wraps.then_some(0)
                    }
                };
                let c = state.cell(x, z);
                [
                    number(c, 4) - back(x, columns).map_or(0.0, |n| number(state.cell(n, z), 6)),
                    number(c, 5) - back(z, rows).map_or(0.0, |n| number(state.cell(x, n), 7)),
                ]
            };
            for z in 0..rows {
                for x in 0..columns {
                    shallow.speeds[index(x, z)] = speeds(&middle, x, z);
                }
            }
            let before = shallow.water.clone();
            let went = shallow.step(
                edge(boundary),
                f64::from(9.81_f32),
                f64::from(0.03_f32),
                2.0,
                f64::from(0.05_f32),
                &sky,
            );
            for z in 0..rows {
                for x in 0..columns {
                    let k = index(x, z);
                    let is = speeds(&end, x, z);
                    // Water that is thin over the higher ground of a face is the difference of depth and rise, in floats.
                    let thin = [(1, 0), (0, 1)].map(|(i, j)| {
                        let far = index((x + i) % columns, (z + j) % rows);
                        let rise = shallow.ground[far] - shallow.ground[k];
                        let over = |depth: f64, rise: f64| (depth - rise.max(0.0)).max(0.0);
                        let depth = 0.5 * (over(before[k], rise) + over(before[far], -rise));
                        3e-7 / depth.max(1e-6)
                    });
                    let pairs = [
                        (end.water(x, z), shallow.water[k]),
                        (is[0], shallow.speeds[k][0]),
                        (is[1], shallow.speeds[k][1]),
                    ];
                    for (n, (is, exact)) in pairs.into_iter().enumerate() {
                        let most = allowed(exact) + if n == 0 { 0.0 } else { thin[n - 1] };
                        worst = worst.max((is - exact).abs() / most);
                        assert!(
                            (is - exact).abs() <= most,
                            "{boundary:?} {columns}x{rows} at {x} {z} number {n}: {is} {exact}, {weather}"
                        );
                    }
                }
            }
            for (is, exact) in [
                (report.run_off, went.run_off),
                (report.gained, went.gained),
                (report.evaporated, went.evaporated),
                (report.seeped, went.seeped),
            ] {
                assert!(
                    (is - exact).abs() <= 1e-5 * exact.max(1e-9),
                    "{is} {exact}: {report:?} {went:?}"
                );
            }
            assert_eq!(report.gained > 0.0, weather);
        }
    }
    println!("at most {worst:.2} of what is allowed");
}

/// The programs without rain and springs find what those with them find, to the bit.
#[test]
fn ground_without_weather_is_the_same_to_the_bit() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let begin = random_state(70, 45, 21, false);
        let calm = GroundOptions {
            scheme,
            step: 0.04,
            evaporation: 1e-4,
            ..Default::default()
        };
        let dry_spring = GroundOptions {
            springs: vec![veduta::ground::Spring {
                x: 20.0,
                z: 20.0,
                radius: 9.0,
                rate: 0.0,
            }],
            ..calm.clone()
        };
        let (one, first) = run(&calm, &begin, 80);
        let (two, second) = run(&dry_spring, &begin, 80);
        assert_eq!(one, two, "{scheme:?}");
        assert_eq!(first, second, "{scheme:?}");
        // And rain that begins later falls.
        let mut ground = made(&calm, &begin);
        steps(&mut ground, 5);
        let rainy = GroundOptions { rain: 1e-3, ..calm };
        ground.set_options(&gpu().queue, &rainy).unwrap();
        steps(&mut ground, 5);
        let gained = ground.report(gpu()).unwrap().gained;
        let wanted = 5.0 * 0.04 * 1e-3 * 70.0 * 45.0;
        assert!((gained / wanted - 1.0).abs() < 1e-5, "{gained} {wanted}");
    }
}

/// Memory at sizes off the grid of tiles, and that the smallest and the narrowest run.
#[test]
fn ground_memory_stays_below_its_bar() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        for [columns, rows] in [
            [16, 16],
            [17, 16],
            [83, 70],
            [200, 64],
            [1000, 16],
            [33, 33],
            [16, 4096],
            [4096, 16],
        ] {
            let begin = random_state(columns, rows, 3, false);
            let options = GroundOptions {
                scheme,
                boundary: Boundary::Closed,
                step: 0.04,
                erosion: (scheme == Scheme::Source).then(Erosion::default),
                ..Default::default()
            };
            let mut ground = made(&options, &begin);
            let bytes = ground.bytes() as f64 / (columns * rows) as f64;
            println!("{scheme:?} {columns} x {rows}: {bytes:.1} bytes a cell");
            assert!(bytes <= 112.0, "{scheme:?} {columns} x {rows}: {bytes}");
            steps(&mut ground, 3);
            let (end, report) = (ground.state(gpu()).unwrap(), ground.report(gpu()).unwrap());
            judge_balance(
                &begin,
                &end,
                &report,
                &format!("{scheme:?} {columns} {rows}"),
            );
            assert_ne!(begin, end);
        }
    }
}

/// The largest ground: a few steps, balanced.
#[test]
#[ignore = "takes 5 GB of memory and a minute"]
fn ground_of_the_largest_size_runs() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut begin = flat(4096, 4096, |x, z| (0.01 * x).sin() + (0.013 * z).cos());
        for (k, c) in begin.cells.chunks_exact_mut(CHANNELS).enumerate() {
            c[1] = (k % 61) as f32 * 0.01;
        }
        let options = GroundOptions {
            scheme,
            step: 0.02,
            ..Default::default()
        };
        let (end, report) = run(&options, &begin, 1);
        assert_eq!(report.active_tiles, 128 * 128);
        judge_balance(&begin, &end, &report, "largest");
        assert_ne!(begin.cell(4095, 4095), end.cell(4095, 4095));
    }
}

#[test]
fn ground_goes_on_bit_for_bit() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut scene = GroundScene::named("rain").unwrap();
        scene.columns = 70;
        scene.rows = 50;
        scene.options.scheme = scheme;
        // The physical scheme finds its step from the data.
        scene.options.step = 0.1 * f32::from(u8::from(scheme == Scheme::Source));
        if scheme == Scheme::Source {
            scene.options.erosion = Some(Erosion::default());
        }
        let mut begin = scene.begin(gpu(), veduta::programs()).unwrap();
        // Waves from the start, fastest where water stands over a rise.
        for (k, cell) in begin.cells.chunks_exact_mut(CHANNELS).enumerate() {
            cell[1] = 0.3 + 0.2 * (0.37 * k as f32).sin();
        }
        let (whole, _) = run(&scene.options, &begin, 151);
        let (half, _) = run(&scene.options, &begin, 70);
        let (rest, _) = run(&scene.options, &half, 81);
        assert_eq!(whole, rest, "{scheme:?}");
        let (again, _) = run(&scene.options, &begin, 151);
        assert_eq!(whole, again, "{scheme:?}");
        assert!(whole.sums()[1] > 0.0);
    }
}

/// Water that falls gains what the fall gives and no more: films over steep ground do not race.
#[test]
fn ground_shallow_water_has_the_speed_of_its_fall() {
    let (columns, rows) = (96, 96);
    let heights: Vec<f32> = (0..columns * rows)
        .map(|k| {
            let (x, z) = ((k % columns) as f32, (k / columns) as f32);
            20.0 * (0.11 * x).sin() * (0.13 * z).cos() + 6.0 * (0.7 * x + 0.5 * z).sin()
        })
        .collect();
    let mut state = GroundState::from_heights(columns, rows, &heights).unwrap();
    let mut head = [f32::INFINITY, f32::NEG_INFINITY];
    for (cell, height) in state.cells.chunks_exact_mut(CHANNELS).zip(&heights) {
        cell[1] = (4.0 - height).max(0.0);
        head = [head[0].min(*height), head[1].max(height + cell[1])];
    }
    let options = GroundOptions {
        scheme: Scheme::Physical,
        step: 0.0,
        rain: 1e-4,
        springs: vec![veduta::ground::Spring {
            x: 40.0,
            z: 40.0,
            radius: 4.0,
            rate: 20.0,
        }],
        ..Default::default()
    };
    let most = (2.0 * options.gravity * (head[1] - head[0])).sqrt();
    let mut fastest = 0.0_f32;
    for _ in 0..4 {
        let (after, report) = run(&options, &state, 500);
        let now = after
            .cells
            .chunks_exact(CHANNELS)
            .flat_map(|c| c[4..8].iter().copied())
            .fold(0.0, f32::max);
        println!("{now:.1} m/s of {most:.1}, step {:.4} s", report.last_step);
        fastest = fastest.max(now);
        state = after;
    }
    assert!(fastest > 1.0 && fastest < most);
}

/// Edits that follow steps in one submission are not slept through, and each has its own tool.
#[test]
fn ground_edits_in_one_submission_all_act() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let options = GroundOptions {
            scheme,
            step: 0.5 * f32::from(u8::from(scheme == Scheme::Source)),
            boundary: Boundary::Closed,
            ..Default::default()
        };
        let state = GroundState::from_heights(96, 64, &vec![0.0; 96 * 64]).unwrap();
        let gpu = gpu();
        let mut ground = Ground::new(
            &gpu.device,
            &gpu.queue,
            veduta::programs(),
            &options,
            &state,
        )
        .unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let pour = |x: f32, strength: f32| GroundEdit {
            tool: Tool::Water,
            x,
            z: 30.0,
            radius: Some(6.0),
            strength,
            seed: 0,
        };
        let _ = ground.step(&mut encoder, 40);
        for edit in [pour(20.0, 3.0), pour(70.0, 1.0)] {
            let _ = ground.edit(&gpu.device, &mut encoder, &edit).unwrap();
        }
        let _ = ground.step(&mut encoder, 1);
        gpu.queue.submit([encoder.finish()]);
        let report = ground.report(gpu).unwrap();
        println!("{scheme:?}: first step {:.4} s", report.last_step);
        if scheme == Scheme::Physical {
            // The waves of what was poured bound it.
            assert!(report.last_step <= f64::from(0.2 / (9.81_f32 * 2.9).sqrt()));
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = ground.step(&mut encoder, 30);
        gpu.queue.submit([encoder.finish()]);
        let after = ground.state(gpu).unwrap();
        // Both hills of water are there, the higher with three times as much, and both have run beyond their edge.
        let sums = [0, 48].map(|first| -> f64 {
            (0..64)
                .flat_map(|z| (first..first + 48).map(move |x| (x, z)))
                .map(|(x, z)| after.water(x, z))
                .sum()
        });
        println!("{sums:?}");
        assert!(sums[1] > 20.0 && sums[0] > 2.0 * sums[1]);
        assert!(
            [20, 70]
                .map(|x| after.water(x, 37))
                .iter()
                .all(|w| *w > 1e-4)
        );
    }
    let state = GroundState::from_heights(32, 32, &vec![0.0; 1024]).unwrap();
    let astray = GroundOptions {
        springs: vec![veduta::ground::Spring {
            x: 100.0,
            z: 5.0,
            radius: 3.0,
            rate: 1.0,
        }],
        ..Default::default()
    };
    let gpu = gpu();
    let refused = Ground::new(&gpu.device, &gpu.queue, veduta::programs(), &astray, &state);
    assert!(
        matches!(&refused, Err(veduta::Error::OutOfDomain { name, .. }) if name == "ground.springs[0]")
    );
}

#[test]
fn ground_bears_adversarial_states() {
    let mut random = Random(77);
    let extremes = [0.0, 1e-30, 1e-7, 1e-3, 1.0, 30.0, 1e4];
    for scheme in [Scheme::Source, Scheme::Physical] {
        for boundary in [Boundary::Open, Boundary::Closed, Boundary::Periodic] {
            let mut begin = flat(33, 34, |_, _| 0.0);
            for c in begin.cells.chunks_exact_mut(CHANNELS) {
                let mut pick = || extremes[(random.bits() % 7) as usize] as f32;
                c[0] = pick() - pick();
                c[1] = pick();
                c[2] = pick().min(1.0);
                for speed in &mut c[4..8] {
                    *speed = pick();
                }
            }
            let options = GroundOptions {
                scheme,
                boundary,
                step: if scheme == Scheme::Source { 0.5 } else { 1.0 },
                rain: 1.0,
                evaporation: 0.5,
                erosion: (scheme == Scheme::Source).then(|| Erosion {
                    capacity: 10.0,
                    dig: 1.0,
                    lay: 1.0,
                    slide: 0.2,
                    ..Default::default()
                }),
                ..Default::default()
            };
            let (end, report) = run(&options, &begin, 300);
            judge_balance(&begin, &end, &report, &format!("{scheme:?} {boundary:?}"));
        }
    }
    let bad = GroundOptions {
        step: 0.6,
        ..Default::default()
    };
    assert!(bad.check().is_err());
    assert!(GroundState::from_channels(16, 16, 8, &[f32::NAN; 2048]).is_err());
}

#[test]
fn ground_sleeps_where_nothing_moves() {
    let mut begin = flat(256, 256, |_, _| 0.0);
    for z in 0..256 {
        for x in 0..128 {
            begin.cell_mut(x, z)[0] = if x == 127 { 10.0 } else { -1.0 };
        }
        for x in 20..40 {
            let c = begin.cell_mut(x, z);
            (c[1], c[3]) = (1.0, 1.0);
        }
    }
    for scheme in [Scheme::Source, Scheme::Physical] {
        let options = GroundOptions {
            scheme,
            boundary: Boundary::Closed,
            step: 0.1,
            ..Default::default()
        };
        let (end, report) = run(&options, &begin, 400);
        assert!(
            report.active_tiles >= 32 && report.active_tiles <= 40,
            "{report:?}"
        );
        judge_balance(&begin, &end, &report, "half dry");
        assert!(report.gained == 0.0);
    }
}

#[test]
fn ground_erodes_lays_down_and_slides() {
    // Rain on a slope that ends in a basin: dug above, laid down below; soft ground loses more.
    let mut lost = Vec::new();
    for hardness in [0.0, 0.9] {
        let begin = flat(
            96,
            32,
            |x, _| if x < 64.0 { 0.3 * (64.0 - x) } else { -3.0 },
        );
        let options = GroundOptions {
            boundary: Boundary::Closed,
            rain: 2e-4,
            erosion: Some(Erosion {
                hardness,
                hard_wavelength: 12.0,
                slope_limit: 2.0,
                ..Default::default()
            }),
            ..Default::default()
        };
        let (end, report) = run(&options, &begin, 3000);
        judge_balance(&begin, &end, &report, "slope");
        let sum = |low: usize, high: usize| -> f64 {
            (low..high)
                .map(|x| end.ground(x, 16) - begin.ground(x, 16))
                .sum()
        };
        assert!(
            sum(5, 60) < -1e-3 * (1.0 - f64::from(hardness)),
            "{}",
            sum(5, 60)
        );
        // Hard ground above yields so little that the basin itself may lose some.
        if hardness == 0.0 {
            assert!(sum(68, 92) > 1e-4, "{}", sum(68, 92));
        }
        lost.push(sum(5, 60));
    }
    assert!(
        lost[1].abs() < 0.9 * lost[0].abs(),
        "hard ground loses as much: {lost:?}"
    );
    // A step of 10 m slides until no slope is above the limit; one below it stays.
    let options = GroundOptions {
        boundary: Boundary::Closed,
        erosion: Some(Erosion {
            slope_limit: 1.0,
            ..Default::default()
        }),
        ..Default::default()
    };
    let begin = flat(64, 32, |x, _| if x < 32.0 { 10.0 } else { 0.0 });
    let (end, report) = run(&options, &begin, 3000);
    judge_balance(&begin, &end, &report, "step");
    for x in 0..63 {
        let drop = end.ground(x, 9) - end.ground(x + 1, 9);
        assert!(drop <= 1.05, "{x}: {drop}");
    }
    let begin = flat(64, 32, |x, _| 0.9 * x);
    let (end, report) = run(&options, &begin, 50);
    assert_eq!(end.changes(), [0.0, 0.0]);
    assert_eq!(report.active_tiles, 0);
}

pub fn edited(ground: &mut Ground, edit: &GroundEdit) {
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    let _ = ground.edit(&gpu().device, &mut encoder, edit).unwrap();
    gpu().queue.submit([encoder.finish()]);
}

#[test]
fn ground_edits_change_only_what_the_cursor_covers() {
    let begin = hilly(64, 48, 100.0, 9);
    let tools = [
        (Tool::Raise, 2.0),
        (Tool::Raise, -3.0),
        (Tool::Smooth, 1.0),
        (Tool::Noise { wavelength: 4.0 }, 1.0),
        (Tool::Water, 2.0),
        (Tool::Flatten { height: 103.0 }, 1.0),
    ];
    for scheme in [Scheme::Source, Scheme::Physical] {
        for (tool, strength) in tools {
            let options = GroundOptions {
                scheme,
                ..Default::default()
            };
            let mut ground = made(&options, &begin);
            let edit = GroundEdit {
                tool,
                x: 30.0,
                z: 20.0,
                radius: Some(8.0),
                strength,
                seed: 1,
            };
            edited(&mut ground, &edit);
            let end = ground.state(gpu()).unwrap();
            let rough = |s: &GroundState| -> f64 {
                (25..35)
                    .map(|x| {
                        (s.ground(x + 1, 20) + s.ground(x - 1, 20) - 2.0 * s.ground(x, 20)).abs()
                    })
                    .sum()
            };
            for z in 0..48 {
                for x in 0..64 {
                    let r2 = ((x as f64 - 30.0).powi(2) + (z as f64 - 20.0).powi(2)) / 64.0;
                    let lift = end.ground(x, z) - begin.ground(x, z);
                    let fade = (1.0 - r2).max(0.0).powi(2);
                    match tool {
                        _ if r2 >= 1.0 => {
                            assert_eq!(
                                begin.cell(x, z)[..12],
                                end.cell(x, z)[..12],
                                "{tool:?} {x} {z}"
                            );
                        }
                        Tool::Raise => {
                            assert!((lift - f64::from(strength) * fade).abs() < 1e-5, "{lift}")
                        }
                        Tool::Water => assert!((end.water(x, z) - 2.0 * fade).abs() < 1e-5),
                        Tool::Flatten { .. } => {
                            let wanted = fade * (103.0 - begin.ground(x, z));
                            assert!((lift - wanted).abs() < 2e-5, "{lift} {wanted}");
                        }
                        Tool::Noise { .. } => assert!(lift.abs() <= fade + 1e-6),
                        Tool::Smooth => {}
                    }
                }
            }
            match tool {
                Tool::Smooth => assert!(rough(&end) < rough(&begin)),
                Tool::Noise { .. } => assert_ne!(rough(&end), rough(&begin)),
                _ => {}
            }
            // What was poured runs on, in both buffers of the physical scheme.
            if tool == Tool::Water {
                let poured = end.sums()[1];
                steps(&mut ground, 20);
                let after = ground.state(gpu()).unwrap();
                assert!((after.sums()[1] - poured).abs() < 1e-6 * poured);
                assert_ne!(after.water(30, 20), end.water(30, 20));
            }
        }
    }
}

#[test]
fn ground_queries_find_what_the_state_holds() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut begin = hilly(40, 32, 4000.0, 11);
        for c in begin.cells.chunks_exact_mut(CHANNELS) {
            c[1] = 0.5;
        }
        let options = GroundOptions {
            scheme,
            step: 0.1,
            spacing: 2.0,
            ..Default::default()
        };
        let mut ground = made(&options, &begin);
        steps(&mut ground, 5);
        let state = ground.state(gpu()).unwrap();
        let mut random = Random(4);
        let places: Vec<[f32; 2]> = (0..300)
            .map(|_| [random.between(1.0, 38.0), random.between(1.0, 30.0)])
            .collect();
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let mut query = ground
            .query(&gpu().device, &gpu().queue, &mut encoder, &places)
            .unwrap();
        gpu().queue.submit([encoder.finish()]);
        let mut found = None;
        while found.is_none() {
            found = query.take(&gpu().device, &mut ground).unwrap();
        }
        let [low, high] = ground.range();
        for (place, point) in places.iter().zip(found.unwrap()) {
            let mix = |f: &dyn Fn(usize, usize) -> f64| {
                let (x, z) = (place[0].floor() as usize, place[1].floor() as usize);
                let (a, b) = (f64::from(place[0].fract()), f64::from(place[1].fract()));
                (f(x, z) * (1.0 - a) + f(x + 1, z) * a) * (1.0 - b)
                    + (f(x, z + 1) * (1.0 - a) + f(x + 1, z + 1) * a) * b
            };
            let height = mix(&|x, z| state.ground(x, z));
            assert!(
                (f64::from(point.height) - height).abs() < 5e-4,
                "{} {height}",
                point.height
            );
            assert!((f64::from(point.depth) - mix(&|x, z| state.water(x, z))).abs() < 1e-5);
            let along = mix(&|x, z| {
                let c = state.cell(x, z);
                match scheme {
                    Scheme::Source => f64::from(c[4]) - f64::from(c[6]),
                    Scheme::Physical => {
                        let left = state.cell(x - 1, z);
                        0.5 * (f64::from(c[4]) - f64::from(state.cell(x + 1, z)[6])
                            + f64::from(left[4])
                            - f64::from(c[6]))
                    }
                }
            });
            assert!(
                (f64::from(point.velocity[0]) - along).abs() < 1e-4,
                "{:?} {along}",
                point.velocity
            );
            let n = point.normal;
            assert!((n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0).abs() < 1e-4 && n[1] > 0.3);
            assert!(point.height >= low && point.height <= high);
        }
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        assert!(
            ground
                .query(&gpu().device, &gpu().queue, &mut encoder, &[])
                .is_err()
        );
    }
}

#[test]
fn ground_shapes_are_those_that_they_are_called() {
    let profile = |shape: Shape, smooth: u32| {
        let mut scene = GroundScene::named("rain").unwrap();
        (scene.columns, scene.rows) = (96, 80);
        (scene.shape, scene.relief, scene.smooth) = (shape, 100.0, smooth);
        let state = scene.begin(gpu(), veduta::programs()).unwrap();
        assert_eq!(state, scene.begin(gpu(), veduta::programs()).unwrap());
        state
    };
    let even = profile(Shape::Even, 0);
    let over = |state: &GroundState, x: usize, z: usize| state.ground(x, z) - even.ground(x, z);
    for (shape, middle, side, end) in [
        (Shape::Hill, 99.0, 0.0, 0.0),
        (Shape::Lake, -99.0, 0.0, 0.0),
        (Shape::Valley, -99.0, 0.0, -99.0),
        (Shape::Ridge, 99.0, 0.0, 99.0),
        // The river begins and crosses in the middle of the plain.
        (Shape::Bed, -75.3, -50.3, -25.3),
    ] {
        let state = profile(shape, 0);
        for (found, wanted) in [
            (over(&state, 48, 40), middle),
            (over(&state, 0, 40), side),
            (over(&state, 48, 0), end),
        ] {
            assert!((found - wanted).abs() < 1.5, "{shape:?}: {found} {wanted}");
        }
    }
    let rough = |s: &GroundState| -> f64 {
        (1..95)
            .map(|x| (s.ground(x + 1, 40) + s.ground(x - 1, 40) - 2.0 * s.ground(x, 40)).abs())
            .sum()
    };
    let passes: Vec<f64> = (0..4).map(|n| rough(&profile(Shape::Even, n))).collect();
    assert!(passes.windows(2).all(|w| w[1] < w[0]), "{passes:?}");
}
