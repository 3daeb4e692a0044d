//! Phase functions, the medium, and elementary series (row L25).

use crate::accuracy::{assert_promise, bits, log_between, rows};
use crate::common::evaluator;
use std::f64::consts::PI;
use veduta::reference::math::gauss_legendre;
use veduta::reference::{math, medium, phase};

/// Values on the device at the given mu.
fn device(expression: &str, mu: &[f64]) -> Vec<f64> {
    let list: Vec<[f32; 1]> = mu.iter().map(|&m| [m as f32]).collect();
    let used = expression.split('(').next().unwrap();
    let import = format!("veduta::lighting::phase::{{{used}}}");
    evaluator(&[&import], "", expression, 1)
        .run(&bits(&list))
        .unwrap()
}

#[test]
fn row_l25_phase_functions_integrate_to_one_and_have_their_mean_cosine() {
    let rule = gauss_legendre(400);
    let nodes: Vec<f64> = rule.iter().map(|p| p.0).collect();
    let cases = [
        ("phase_isotropic()", 0.0),
        ("phase_rayleigh(in.f[0])", 0.0),
        ("phase_henyey_greenstein(in.f[0], 0.76)", 0.76),
        ("phase_henyey_greenstein(in.f[0], -0.5)", -0.5),
        (
            "phase_double_henyey_greenstein(in.f[0], 0.7, -0.5, 0.5)",
            0.1,
        ),
        ("phase_schlick(in.f[0], 0.3)", 0.3135),
        ("phase_schlick(in.f[0], 0.5)", 0.5320),
        ("phase_schlick(in.f[0], 0.76)", 0.8283),
        ("phase_cornette_shanks(in.f[0], 0.76)", 0.8098),
    ];
    for (expression, mean) in cases {
        let values = device(expression, &nodes);
        let whole: f64 = rule
            .iter()
            .zip(&values)
            .map(|(p, v)| 2.0 * PI * p.1 * v)
            .sum();
        let cosine: f64 = rule
            .iter()
            .zip(&values)
            .map(|(p, v)| 2.0 * PI * p.1 * p.0 * v)
            .sum();
        println!("{expression}: integral {whole:.7}, mean cosine {cosine:.5}");
        assert!((whole - 1.0).abs() < 1e-4, "{expression}: {whole}");
        assert!((cosine - mean).abs() < 1e-4, "{expression}: {cosine}");
    }
}

#[test]
fn row_l25_phase_functions_have_the_tabulated_values_and_peak_towards_the_sun() {
    let near = |expression: &str, mu: f64, expected: f64| {
        let value = device(expression, &[mu])[0];
        assert!(
            (value / expected - 1.0).abs() < 2e-6,
            "{expression} at {mu}: {value}, not {expected}"
        );
    };
    near("phase_cornette_shanks(in.f[0], 0.76)", 1.0, 2.829_997_50);
    near("phase_cornette_shanks(in.f[0], 0.76)", -1.0, 0.007_175_99);
    near(
        "phase_double_henyey_greenstein(in.f[0], 0.7, -0.5, 0.5)",
        1.0,
        0.760_406_95,
    );
    near(
        "phase_double_henyey_greenstein(in.f[0], 0.7, -0.5, 0.5)",
        0.0,
        0.032_509_97,
    );
    near(
        "phase_double_henyey_greenstein(in.f[0], 0.7, -0.5, 0.5)",
        -1.0,
        0.242_862_73,
    );
    for (g, k) in [(0.3, 0.45015), (0.5, 0.70625), (0.76, 0.93656)] {
        // At mu = 0 Schlick's function is (1 - k^2) / (4 pi).
        let value = device(&format!("phase_schlick(in.f[0], {g})"), &[0.0])[0];
        assert!(
            ((1.0 - 4.0 * PI * value).sqrt() - k).abs() < 1e-5,
            "g = {g}"
        );
    }
    for name in [
        "phase_henyey_greenstein",
        "phase_schlick",
        "phase_cornette_shanks",
    ] {
        let values = device(
            &format!("{name}(in.f[0], 0.76)"),
            &[1.0, 0.5, 0.0, -0.5, -1.0],
        );
        assert!(
            values[0] > 10.0 * values[2] && values[0] > values[1] && values[0] > 100.0 * values[4],
            "{name}: {values:?}"
        );
    }
    // The limits of g give numbers, not NaN.
    for expression in [
        "phase_henyey_greenstein(in.f[0], 1.0)",
        "phase_cornette_shanks(in.f[0], -1.0)",
    ] {
        assert!(
            device(expression, &[1.0, 0.0, -1.0])
                .iter()
                .all(|v| v.is_finite())
        );
    }
}

#[test]
fn phase_functions_keep_their_promised_error() {
    let (device_rows, list) = rows(100_000, 1, |r| {
        [
            r.between(-1.0, 1.0),
            r.between(-0.99, 0.99),
            r.between(0.0, 0.99),
            r.between(-0.99, 0.0),
            r.unit(),
        ]
    });
    let run = |expression: &str| {
        let used = expression.split('(').next().unwrap();
        evaluator(
            &[&format!("veduta::lighting::phase::{{{used}}}")],
            "",
            expression,
            5,
        )
        .run(&device_rows)
        .unwrap()
    };
    let check = |name: &str, arguments: &str, twin: &dyn Fn(&[f64; 5]) -> f64| {
        let truth: Vec<f64> = list.iter().map(twin).collect();
        assert_promise(
            "lighting/phase",
            name,
            &run(&format!("{name}({arguments})")),
            &truth,
        );
    };
    check("phase_isotropic", "", &|_| phase::phase_isotropic());
    check("phase_rayleigh", "in.f[0]", &|r| {
        phase::phase_rayleigh(r[0])
    });
    check("phase_henyey_greenstein", "in.f[0], in.f[1]", &|r| {
        phase::phase_henyey_greenstein(r[0], r[1])
    });
    check(
        "phase_double_henyey_greenstein",
        "in.f[0], in.f[2], in.f[3], in.f[4]",
        &|r| phase::phase_double_henyey_greenstein(r[0], r[2], r[3], r[4]),
    );
    check("phase_schlick", "in.f[0], in.f[1] * 0.90625", &|r| {
        phase::phase_schlick(r[0], f64::from((r[1] as f32) * 0.90625))
    });
    check("phase_cornette_shanks", "in.f[0], in.f[1]", &|r| {
        phase::phase_cornette_shanks(r[0], r[1])
    });
}

#[test]
fn droplets_scatter_as_their_twins_and_all_that_they_scatter() {
    let (device_rows, list) = rows(200_000, 3, |r| {
        // Towards the light as often as anywhere: there the lobe is sharp.
        let beside = log_between(r, 1e-7, 2.0);
        let mu = if r.unit() < 0.5 {
            1.0 - beside
        } else {
            r.between(-1.0, 1.0)
        };
        [
            mu.max(-1.0),
            r.between(-0.99, 0.99),
            r.between(0.0, 100.0),
            log_between(r, 5.0e-6, 5.0e-5),
            log_between(r, 0.002, 0.03),
            r.between(0.3, 0.5),
            r.between(15.0, 40.0),
            r.unit(),
        ]
    });
    let check = |name: &str, expression: &str, twin: &dyn Fn(&[f64; 8]) -> Vec<f64>| {
        let truth: Vec<f64> = list.iter().flat_map(twin).collect();
        let imports: Vec<String> = ["phase_droplets", "DropletPhase", name]
            .iter()
            .map(|name| format!("veduta::lighting::phase::{name}"))
            .collect();
        let imports: Vec<&str> = imports.iter().map(String::as_str).collect();
        let imports = if name == "phase_droplets" {
            &imports[..2]
        } else {
            &imports
        };
        let prelude = "fn list(p: DropletPhase) -> vec4f { return vec4f(p.sharp_gap, p.broad_gap, p.alpha, p.broad_share); }";
        let values = evaluator(imports, prelude, expression, 8)
            .run(&device_rows)
            .unwrap();
        assert_promise("lighting/phase", name, &values, &truth);
    };
    check(
        "phase_draine",
        "phase_draine(in.f[0], in.f[1], in.f[2])",
        &|r| vec![phase::phase_draine(r[0], r[1], r[2])],
    );
    check("droplet_phase", "list(droplet_phase(in.f[3]))", &|r| {
        let p = phase::droplet_phase(r[3]);
        vec![p.sharp_gap, p.broad_gap, p.alpha, p.broad_share]
    });
    check(
        "phase_droplets",
        "phase_droplets(in.f[0], DropletPhase(in.f[4], in.f[5], in.f[6], in.f[7]))",
        &|r| {
            let lobes = phase::DropletPhase {
                sharp_gap: r[4],
                broad_gap: r[5],
                alpha: r[6],
                broad_share: r[7],
            };
            vec![phase::phase_droplets(r[0], lobes)]
        },
    );
    check(
        "phase_henyey_greenstein_draine",
        "phase_henyey_greenstein_draine(in.f[0], in.f[3])",
        &|r| vec![phase::phase_henyey_greenstein_draine(r[0], r[3])],
    );

    // All of it over the sphere, by 1 - mu = 2 u^8, which spreads the sharp lobe out; and its mean cosine.
    let rule = gauss_legendre(400);
    let moments = |f: &dyn Fn(f64) -> f64| {
        let mut sum = [0.0; 2];
        for &(x, w) in &rule {
            let u: f64 = 0.5 * (x + 1.0);
            let mu = 1.0 - 2.0 * u.powi(8);
            let weight = 2.0 * PI * 0.5 * w * 16.0 * u.powi(7);
            sum[0] += weight * f(mu);
            sum[1] += weight * mu * f(mu);
        }
        sum
    };
    let mut before = 0.0;
    for diameter in [5e-6, 8e-6, 1.2e-5, 2e-5, 3.5e-5, 5e-5] {
        let [whole, cosine] = moments(&|mu| phase::phase_henyey_greenstein_draine(mu, diameter));
        println!("droplets of {diameter} m: integral {whole:.9}, mean cosine {cosine:.5}");
        assert!((whole - 1.0).abs() < 1e-6, "{diameter}: {whole}");
        // The larger the droplets, the more of it goes on forward.
        assert!(cosine > before && (0.8..0.9).contains(&cosine), "{cosine}");
        before = cosine;
    }
    for (g, alpha) in [
        (0.0, 5.0),
        (0.6, 25.0),
        (-0.7, 1.0),
        (0.9, 0.0),
        (0.97, 60.0),
    ] {
        let [whole, cosine] = moments(&|mu| phase::phase_draine(mu, g, alpha));
        assert!((whole - 1.0).abs() < 1e-6, "{g} {alpha}: {whole}");
        // Draine's closed form of the mean cosine.
        let expected = g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0)
            / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
        assert!((cosine - expected).abs() < 1e-6, "{g} {alpha}: {cosine}");
    }
    // The two functions between which Draine's lies, and one place computed by hand.
    for mu in [-1.0, -0.3, 0.5, 1.0] {
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        near(
            phase::phase_draine(mu, 0.7, 0.0),
            phase::phase_henyey_greenstein(mu, 0.7),
        );
        near(
            phase::phase_draine(mu, 0.7, 1.0),
            phase::phase_cornette_shanks(mu, 0.7),
        );
    }
}

#[test]
fn medium_and_series_keep_their_promised_error() {
    let (device_rows, list) = rows(100_000, 2, |r| {
        [
            log_between(r, 1e-20, 1e6),
            log_between(r, 1e-9, 10.0),
            log_between(r, 1e-3, 1e6),
            r.between(0.0, 80.0),
        ]
    });
    let check = |module: &str, name: &str, arguments: &str, twin: &dyn Fn(&[f64; 4]) -> f64| {
        let truth: Vec<f64> = list.iter().map(twin).collect();
        let import = format!("veduta::{}::{{{name}}}", module.replace('/', "::"));
        let values = evaluator(&[&import], "", &format!("{name}({arguments})"), 4)
            .run(&device_rows)
            .unwrap();
        assert_promise(module, name, &values, &truth);
    };
    check("math/series", "one_minus_exp_over_x", "in.f[0]", &|r| {
        math::one_minus_exp_over_x(r[0])
    });
    check("math/series", "one_minus_exp", "in.f[0]", &|r| {
        math::one_minus_exp(r[0])
    });
    check(
        "medium/transmittance",
        "step_integral",
        "in.f[1], in.f[2]",
        &|r| medium::step_integral(r[1], r[2]),
    );
    let values = evaluator(
        &["veduta::medium::transmittance::{beer_lambert}"],
        "",
        "beer_lambert(vec3f(in.f[3]))",
        4,
    )
    .run(&device_rows)
    .unwrap();
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| medium::beer_lambert([r[3]; 3]))
        .collect();
    assert_promise("medium/transmittance", "beer_lambert", &values, &truth);
    // The limit at 0, and a step of two halves equals the whole.
    let limits = evaluator(
        &["veduta::math::series::{one_minus_exp_over_x}"],
        "",
        "one_minus_exp_over_x(in.f[0])",
        1,
    );
    assert_eq!(limits.run(&bits(&[[0.0], [1e-30]])).unwrap(), [1.0, 1.0]);
}
