//! Altitudes, roots and shells of the planet.

use crate::accuracy::{assert_promise, bits, direction, log_between, rows};
use crate::common::evaluator;
use veduta::reference::planet;

/// Runs an expression over rows with one import from the shell module.
fn run(name: &str, expression: &str, columns: usize, device_rows: &[u32]) -> Vec<f64> {
    evaluator(
        &[&format!("veduta::planet::shell::{{{name}}}")],
        "",
        expression,
        columns,
    )
    .run(device_rows)
    .unwrap()
}

#[test]
fn altitudes_keep_their_promised_error() {
    let (device_rows, list) = rows(200_000, 3, |r| {
        let d = direction(r);
        let t = log_between(r, 1.0, 1e6);
        [
            log_between(r, 3e6, 1e8),
            r.between(0.0, 1e5),
            d[0],
            d[1],
            d[2],
            t,
            r.between(-1.0, 1.0),
            r.between(-1.0, 1.0),
        ]
    });
    let truth: Vec<f64> = list
        .iter()
        .map(|r| planet::altitude_along(r[0], r[1], r[3], r[5]))
        .collect();
    let values = run(
        "altitude_along",
        "altitude_along(in.f[0], in.f[1], in.f[3], in.f[5])",
        8,
        &device_rows,
    );
    assert_promise("planet/shell", "altitude_along", &values, &truth);
    let relative = |r: &[f64; 8]| [2, 3, 4].map(|k| f64::from(r[k] as f32 * (0.5 * r[5]) as f32));
    let relative_device = "vec3f(in.f[2], in.f[3], in.f[4]) * (0.5 * in.f[5])";
    let truth: Vec<f64> = list
        .iter()
        .map(|r| planet::altitude_of(r[0], r[1], relative(r)))
        .collect();
    let values = run(
        "altitude_of",
        &format!("altitude_of(in.f[0], in.f[1], {relative_device})"),
        8,
        &device_rows,
    );
    assert_promise("planet/shell", "altitude_of", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| planet::up_at(r[0], r[1], relative(r)))
        .collect();
    let values = run(
        "up_at",
        &format!("up_at(in.f[0], in.f[1], {relative_device})"),
        8,
        &device_rows,
    );
    assert_promise("planet/shell", "up_at", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .map(|r| planet::direction_cosine_along(r[0], r[1], 5e4, r[6], r[7], r[5]))
        .collect();
    let values = run(
        "direction_cosine_along",
        "direction_cosine_along(in.f[0], in.f[1], 5e4, in.f[6], in.f[7], in.f[5])",
        8,
        &device_rows,
    );
    assert_promise("planet/shell", "direction_cosine_along", &values, &truth);
}

#[test]
fn an_altitude_near_the_ground_is_exact_to_a_millimetre() {
    // The radius form r - R resolves 0.25 to 0.5 m here.
    let (device_rows, list) = rows(50_000, 4, |r| {
        [
            r.between(0.0, 10.0),
            r.between(-0.01, 0.3),
            log_between(r, 0.1, 1000.0),
        ]
    });
    let values = run(
        "altitude_along",
        "altitude_along(6.36e6, in.f[0], in.f[1], in.f[2])",
        3,
        &device_rows,
    );
    let worst = values
        .iter()
        .zip(&list)
        .map(|(v, r)| (v - planet::altitude_along(6.36e6, r[0], r[1], r[2])).abs())
        .fold(0.0, f64::max);
    println!("altitude near the ground: largest error {worst:.1e} m");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn distances_keep_their_promised_error() {
    let (_, list) = rows(200_000, 5, |r| {
        let height = if r.unit() < 0.5 {
            log_between(r, 0.1, 1e5)
        } else {
            r.between(0.0, 1e5)
        };
        [
            log_between(r, 3e6, 1e8),
            r.between(0.0, 1e5),
            r.between(1e5, 2e5),
            height,
            r.between(-1.0, 1.0),
        ]
    });
    // Rays within 1e-6 of a tangent may be on either side of it in f32.
    let tangent = |r: &[f64; 5], level: f64| {
        let b = (r[0] + r[3]) * r[4];
        let c = (r[3] - level) * (2.0 * r[0] + r[3] + level);
        (b * b - c).abs() < 1e-6 * (b * b + c.abs())
    };
    let clear: Vec<[f64; 5]> = list
        .into_iter()
        .filter(|r| !tangent(r, 0.0) && !tangent(r, r[1]))
        .collect();
    println!(
        "{} of 200000 rays left out as tangent",
        200_000 - clear.len()
    );
    assert!(clear.len() > 190_000);
    let device_rows = bits(
        &clear
            .iter()
            .map(|r| r.map(|v| v as f32))
            .collect::<Vec<_>>(),
    );
    let truth: Vec<f64> = clear
        .iter()
        .map(|r| planet::top_distance(r[0], r[2], r[3], r[4]))
        .collect();
    let values = run(
        "top_distance",
        "top_distance(in.f[0], in.f[2], in.f[3], in.f[4])",
        5,
        &device_rows,
    );
    assert_promise("planet/shell", "top_distance", &values, &truth);
    let truth: Vec<f64> = clear
        .iter()
        .map(|r| planet::ground_distance(r[0], r[3], r[4]))
        .collect();
    let values = run(
        "ground_distance",
        "ground_distance(in.f[0], in.f[3], in.f[4])",
        5,
        &device_rows,
    );
    assert!(truth.iter().any(|&t| t > 0.0) && truth.contains(&-1.0));
    assert_promise("planet/shell", "ground_distance", &values, &truth);
    let truth: Vec<f64> = clear
        .iter()
        .flat_map(|r| {
            let span = planet::sphere_span(r[0], r[1], r[3], r[4]);
            [span.near, span.far]
        })
        .collect();
    let values = run(
        "sphere_span",
        "vec2f(sphere_span(in.f[0], in.f[1], in.f[3], in.f[4]).near, sphere_span(in.f[0], in.f[1], in.f[3], in.f[4]).far)",
        5,
        &device_rows,
    );
    assert_promise("planet/shell", "sphere_span", &values, &truth);
}

#[test]
fn the_horizon_at_eye_height_is_right() {
    // d = sqrt(2 R h + h^2); the form r*r - R*R is 4.8 % wrong here.
    for h in [1.7_f64, 10.0, 300.0] {
        let d = (h * (2.0 * 6.36e6 + h)).sqrt();
        let dip = -(d / (6.36e6 + h)) * (1.0 + 1e-5);
        let value = run(
            "ground_distance",
            "ground_distance(6.36e6, in.f[0], in.f[1])",
            2,
            &bits(&[[h as f32, dip as f32]]),
        )[0];
        assert!((value / d - 1.0).abs() < 0.01, "{h}: {value}, not {d}");
        let level = run(
            "top_distance",
            "top_distance(6.36e6, in.f[0], 0.0, 0.0)",
            1,
            &bits(&[[h as f32]]),
        )[0];
        assert!((level / d - 1.0).abs() < 1e-6, "{h}: {level}, not {d}");
    }
}

#[test]
fn segments_of_the_shell_equal_the_sorted_roots_and_cut_and_leap_exactly() {
    let prelude = "fn parts(s: ShellSegment) -> vec4f { return vec4f(s.near, s.far, s.gap_near, s.gap_far); }";
    let import = &[
        "veduta::planet::shell::{ShellSegment, shell_segment, clip_segment, segment_length, segment_distance}",
    ];
    let (_, list) = rows(100_000, 6, |r| {
        let height = match r.bits() % 4 {
            0 => r.between(0.0, 4000.0),
            1 => r.between(4000.0, 5500.0),
            _ => r.between(5500.0, 6e4),
        };
        let mu = if r.unit() < 0.5 {
            r.between(-0.15, 0.15)
        } else {
            r.between(-1.0, 1.0)
        };
        [height, mu, r.between(0.0, 2e5), r.unit()]
    });
    let radius = 6.36e6;
    let segment = |r: &[f64; 4]| planet::shell_segment(radius, 4000.0, 5500.0, r[0], r[1]);
    let tangent = |r: &[f64; 4]| {
        [0.0, 4000.0, 5500.0].iter().any(|level| {
            let b = (radius + r[0]) * r[1];
            let c = (r[0] - level) * (2.0 * radius + r[0] + level);
            (b * b - c).abs() < 1e-5 * (b * b + c.abs())
        })
    };
    let clear: Vec<[f64; 4]> = list.into_iter().filter(|r| !tangent(r)).collect();
    let device_rows = bits(
        &clear
            .iter()
            .map(|r| r.map(|v| v as f32))
            .collect::<Vec<_>>(),
    );
    let eval = |expression: &str| {
        let text = format!(
            "{prelude}\nfn keep(s: ShellSegment) -> f32 {{ return segment_length(clip_segment(s, 0.0)) + segment_distance(s, 0.0) * 0.0; }}"
        );
        evaluator(import, &text, expression, 4)
            .run(&device_rows)
            .unwrap()
    };
    let four = |s: planet::ShellSegment| [s.near, s.far, s.gap_near, s.gap_far];
    let truth: Vec<f64> = clear.iter().flat_map(|r| four(segment(r))).collect();
    let kinds = [
        clear
            .iter()
            .filter(|r| r[0] < 4000.0 && segment(r).far > segment(r).near)
            .count(),
        clear
            .iter()
            .filter(|r| segment(r).near == 0.0 && segment(r).far > 0.0)
            .count(),
        clear
            .iter()
            .filter(|r| r[0] > 5500.0 && segment(r).far > segment(r).near)
            .count(),
        clear
            .iter()
            .filter(|r| segment(r).gap_far > segment(r).gap_near)
            .count(),
        clear.iter().filter(|r| segment(r).far == 0.0).count(),
    ];
    println!(
        "from below {}, inside {}, above {}, with a gap {}, none {}",
        kinds[0], kinds[1], kinds[2], kinds[3], kinds[4]
    );
    assert!(kinds.iter().all(|&n| n > 500), "{kinds:?}");
    let values = eval("parts(shell_segment(6.36e6, 4000.0, 5500.0, in.f[0], in.f[1]))");
    assert_promise("planet/shell", "shell_segment", &values, &truth);
    // The rest is judged on the device's own segments, so that errors do not add.
    let own: Vec<planet::ShellSegment> = values
        .chunks(4)
        .map(|v| planet::ShellSegment {
            near: v[0],
            far: v[1],
            gap_near: v[2],
            gap_far: v[3],
        })
        .collect();
    let clipped = eval(
        "parts(clip_segment(shell_segment(6.36e6, 4000.0, 5500.0, in.f[0], in.f[1]), in.f[2]))",
    );
    let truth: Vec<f64> = own
        .iter()
        .zip(&clear)
        .flat_map(|(s, r)| four(planet::clip_segment(*s, r[2])))
        .collect();
    assert_promise("planet/shell", "clip_segment", &clipped, &truth);
    let lengths = eval("segment_length(shell_segment(6.36e6, 4000.0, 5500.0, in.f[0], in.f[1]))");
    let truth: Vec<f64> = own.iter().map(|s| planet::segment_length(*s)).collect();
    assert_promise("planet/shell", "segment_length", &lengths, &truth);
    let at = eval(
        "segment_distance(shell_segment(6.36e6, 4000.0, 5500.0, in.f[0], in.f[1]), 1e5 * in.f[3])",
    );
    let steps: Vec<f64> = clear
        .iter()
        .map(|r| f64::from(1e5_f32 * r[3] as f32))
        .collect();
    let edge = |s: &planet::ShellSegment, step: f64| (s.near + step - s.gap_near).abs() < 0.1;
    let kept: Vec<usize> = (0..own.len())
        .filter(|&i| !edge(&own[i], steps[i]))
        .collect();
    let truth: Vec<f64> = kept
        .iter()
        .map(|&i| planet::segment_distance(own[i], steps[i]))
        .collect();
    let at: Vec<f64> = kept.iter().map(|&i| at[i]).collect();
    assert_promise("planet/shell", "segment_distance", &at, &truth);
}
