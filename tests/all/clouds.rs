//! Clouds: layer, density, lighting, jitter, aerial perspective (rows L30 to L35).

use crate::accuracy::{assert_promise, bits, direction, log_between, rows, toward};
use crate::common::{Random, evaluator};
use veduta::reference::clouds::{self, CloudLayer};
use veduta::reference::phase::phase_double_henyey_greenstein;
use veduta::reference::{atmosphere, planet};

const RADIUS: f64 = 6.36e6;

const LAYER: &str = "
fn layer(coverage: f32, uniformity: f32, extinction: f32, backward_share: f32) -> CloudLayer {
    // (3.25, 3.5, 3.75) of 4 cells.
    return CloudLayer(vec3u(3489660928u, 3758096384u, 4026531840u), 0.0000625, 2u, 0.5, 4000.0, 1500.0, coverage, uniformity,
        extinction, 0.9, 0.7, -0.5, backward_share, 2u);
}
";

const SEEN: &str = "
fn seen(c: CloudLight) -> vec3f { return vec3f(c.scatter, c.transmittance, c.mean_distance); }
fn samples(c: CloudLight) -> vec2f { return vec2f(f32(c.density_samples), f32(c.light_samples)); }
";

fn layer(coverage: f64, uniformity: f64, extinction: f64, backward_share: f64) -> CloudLayer {
    CloudLayer {
        cell: [3, -1, 7],
        frac: [0.25, 0.5, 0.75],
        wavelength: 4000.0,
        period: 4,
        octaves: 6,
        hurst: 1.0,
        bottom: 4000.0,
        thickness: 1500.0,
        coverage,
        uniformity,
        extinction,
        albedo: f64::from(0.9_f32),
        g_forward: f64::from(0.7_f32),
        g_backward: -0.5,
        backward_share,
        seed: 2,
    }
}

/// One row of a cloud march: eye altitude, direction, direction to the sun, largest distance, jitter.
type Ray = [f32; 9];

fn ray(altitude: f32, dir: [f32; 3], to_sun: [f32; 3], max_distance: f32, jitter: f32) -> Ray {
    [
        altitude,
        dir[0],
        dir[1],
        dir[2],
        to_sun[0],
        to_sun[1],
        to_sun[2],
        max_distance,
        jitter,
    ]
}

/// Scatter, transmittance and mean distance of each ray.
fn march(layer: &str, radius: f64, list: &[Ray], steps: i32, light_steps: i32) -> Vec<[f64; 3]> {
    let expression = format!(
        "seen(march_clouds({layer}, {radius:?}, in.f[0], vec3f(in.f[1], in.f[2], in.f[3]), vec3f(in.f[4], in.f[5], in.f[6]), in.f[7], {steps}, {light_steps}, in.f[8]))"
    );
    let prelude = format!("{LAYER}{SEEN}");
    let imports = &[
        "veduta::clouds::field::{CloudLayer}",
        "veduta::clouds::march::{CloudLight, march_clouds}",
    ];
    let values = evaluator(imports, &prelude, &expression, 9)
        .run(&bits(list))
        .unwrap();
    values.chunks(3).map(|v| [v[0], v[1], v[2]]).collect()
}

fn wide(v: &[f32]) -> [f64; 3] {
    [f64::from(v[0]), f64::from(v[1]), f64::from(v[2])]
}

/// Density at (position, altitude, coverage, uniformity) rows.
fn density(list: &[[f32; 6]]) -> Vec<f64> {
    evaluator(
        &["veduta::clouds::field::{CloudLayer, cloud_density}"],
        LAYER,
        "cloud_density(layer(in.f[4], in.f[5], 0.06, 0.5), vec3f(in.f[0], in.f[1], in.f[2]), in.f[3])",
        6,
    )
    .run(&bits(list))
    .unwrap()
}

#[test]
fn row_l30_clouds_lie_between_the_spheres_and_nowhere_else() {
    let inside =
        density(&[3999.0, 4000.0, 4700.0, 5500.0, 5501.0].map(|h| [1e3, 0.0, -2e3, h, 0.5, 1.0]));
    assert_eq!(inside, [0.0, 1.0, 1.0, 1.0, 0.0]);
    // The transmittance of a homogeneous layer measures the path within it: entry and exit are the analytic roots.
    let mut list = Vec::new();
    for altitude in [
        2.0, 300.0, 3999.0, 4001.0, 4750.0, 5499.0, 5501.0, 9000.0, 30000.0,
    ] {
        for height in [
            -89.0, -40.0, -10.0, -4.0, -2.5, -1.5, -0.5, 0.5, 3.0, 10.0, 60.0, 90.0,
        ] {
            list.push(ray(
                altitude,
                toward(height, 40.0),
                toward(30.0, 0.0),
                4e5,
                0.5,
            ));
        }
    }
    let values = march("layer(0.5, 1.0, 2e-5, 0.5)", RADIUS, &list, 64, 1);
    let (mut met, mut gaps) = (0, 0);
    for (row, value) in list.iter().zip(&values) {
        let whole =
            planet::shell_segment(RADIUS, 4000.0, 5500.0, f64::from(row[0]), f64::from(row[2]));
        let segment = planet::clip_segment(whole, 4e5);
        let (length, path) = (planet::segment_length(segment), -value[1].ln() / 2e-5);
        assert!(
            (path - length).abs() < 1e-3 * length + 0.5,
            "{row:?}: {path} m in the layer, not {length}"
        );
        assert!(
            value[2] >= segment.near * 0.999 - 0.1 && value[2] <= segment.far * 1.001 + 0.1,
            "{row:?}: {value:?} {segment:?}"
        );
        met += usize::from(length > 0.0);
        gaps += usize::from(segment.gap_far > segment.gap_near);
    }
    println!(
        "{met} of {} rays meet the layer, {gaps} dip below it on the way",
        list.len()
    );
    assert!(met > 50 && gaps > 3 && met < list.len());
    // Nothing before the entry, and terrain cuts the layer.
    let up = toward(50.0, 0.0);
    let entry = planet::shell_segment(RADIUS, 4000.0, 5500.0, 300.0, f64::from(up[1])).near;
    let cut = [entry as f32 - 1.0, entry as f32 + 1000.0]
        .map(|d| ray(300.0, up, toward(30.0, 0.0), d, 0.5));
    let values = march("layer(0.5, 1.0, 2e-5, 0.5)", RADIUS, &cut, 64, 1);
    assert_eq!((values[0][0], values[0][1]), (0.0, 1.0));
    assert!(
        (-values[1][1].ln() / 2e-5 - 1000.0).abs() < 1.0,
        "{:?}",
        values[1]
    );
}

#[test]
fn row_l31_density_and_coverage() {
    let mut random = Random(21);
    let points: Vec<[f32; 4]> = (0..20_000)
        .map(|_| {
            [
                random.between(-3e4, 3e4),
                0.0,
                random.between(-3e4, 3e4),
                random.between(4000.0, 5500.0),
            ]
        })
        .collect();
    let covered = |i: usize| {
        points
            .iter()
            .map(move |p| [p[0], p[1], p[2], p[3], 0.05 * i as f32, 0.0])
    };
    let all = density(&(0..=20).flat_map(covered).collect::<Vec<_>>());
    let at = |i: usize| all[i * points.len()..(i + 1) * points.len()].to_vec();
    let mut last = at(0);
    assert!(last.iter().all(|&d| d == 0.0), "coverage 0 gives none");
    let mut shares = vec![];
    for i in 1..=20 {
        let next = at(i);
        assert!(next.iter().all(|d| (0.0..=1.0).contains(d)));
        assert!(
            last.iter().zip(&next).all(|(a, b)| *b > 0.0 || *a == 0.0),
            "no covered point gets clear"
        );
        shares.push(next.iter().filter(|&&d| d > 0.0).count() as f64 / next.len() as f64);
        last = next;
    }
    println!("covered share of the volume over coverage: {shares:.3?}");
    assert!(shares.windows(2).all(|w| w[1] >= w[0]));
    assert!(shares[9] > 0.2 && shares[9] < 0.8 && shares[19] > 0.99);
    // At coverage 1 the density is the noise itself: six octaves, and all of them tell.
    let twin = |octaves: i32| -> Vec<f64> {
        let layer = CloudLayer {
            octaves,
            ..layer(1.0, 0.0, 0.06, 0.5)
        };
        points
            .iter()
            .take(500)
            .map(|p| clouds::cloud_density(&layer, wide(&p[..3]), f64::from(p[3])))
            .collect()
    };
    let difference = |a: &[f64]| {
        a.iter()
            .zip(&last)
            .map(|(x, y)| (x - y).abs())
            .fold(0.0, f64::max)
    };
    assert!(
        difference(&twin(6)) < 1e-4 && difference(&twin(5)) > 5e-3 && difference(&twin(7)) > 2e-3
    );
}

#[test]
fn row_l32_a_homogeneous_layer_equals_the_analytic_single_scatter() {
    // A planet so large that the layer is plane.
    let radius = 1e8;
    let mut cases: Vec<(Ray, f64)> = vec![];
    for (view, sun) in [
        (90.0, 90.0),
        (90.0, 40.0),
        (60.0, 30.0),
        (45.0, 60.0),
        (30.0, 30.0),
    ] {
        for depth in [0.05, 0.5, 1.5, 4.0] {
            cases.push((
                ray(0.0, toward(view, 20.0), toward(sun, 0.0), 1e5, 0.5),
                depth,
            ));
        }
    }
    let mut list: Vec<Ray> = cases.iter().map(|c| c.0).collect();
    // The jitter is 0.5 throughout; its column carries the extinction.
    for (row, case) in list.iter_mut().zip(&cases) {
        row[8] = (case.1 / 1500.0) as f32;
    }
    let runs = [64, 256, 1024].map(|steps| {
        let expression = format!(
            "seen(march_clouds(layer(0.5, 1.0, in.f[8], 0.5), {radius:?}, in.f[0], vec3f(in.f[1], in.f[2], in.f[3]), vec3f(in.f[4], in.f[5], in.f[6]), in.f[7], {steps}, 4, 0.5))"
        );
        let imports = &["veduta::clouds::field::{CloudLayer}", "veduta::clouds::march::{CloudLight, march_clouds}"];
        (steps, evaluator(imports, &format!("{LAYER}{SEEN}"), &expression, 9).run(&bits(&list)).unwrap())
    });
    let mut worst: f64 = 0.0;
    for (i, (row, depth)) in cases.iter().enumerate() {
        let (dir, to_sun) = (wide(&row[1..4]), wide(&row[4..7]));
        let nu: f64 = (0..3).map(|k| dir[k] * to_sun[k]).sum();
        let model = layer(0.5, 1.0, depth / 1500.0, 0.5);
        let phase = phase_double_henyey_greenstein(nu, model.g_forward, model.g_backward, 0.5);
        let truth = clouds::slab_single_scatter(*depth, model.albedo, phase, dir[1], to_sun[1]);
        let mut previous = f64::INFINITY;
        for (steps, values) in &runs {
            let error = values[3 * i] / truth - 1.0;
            let step_depth = depth / dir[1] / f64::from(*steps);
            assert!(
                error.abs() < 0.6 * step_depth + 2e-4,
                "{row:?} {depth} {steps}: {error}"
            );
            assert!(error.abs() < previous.max(2e-4), "more steps, less error");
            assert!((values[3 * i + 1].ln() + depth / dir[1]).abs() < 1e-3 * depth + 1e-4);
            if *steps == 64 {
                worst = worst.max(error.abs());
            }
            previous = error.abs();
        }
    }
    println!(
        "homogeneous slab, depth to 4 (8 along the ray), 64 steps: at most {:.2} % from the analytic value",
        100.0 * worst
    );
}

#[test]
fn row_l33_back_scattering_brightens_clouds_opposite_to_the_sun() {
    let list: Vec<Ray> = (0..40)
        .map(|i| {
            ray(
                300.0,
                toward(20.0, 180.0 + 0.5 * f64::from(i)),
                toward(30.0, 0.0),
                8e4,
                0.5,
            )
        })
        .collect();
    let double = march("layer(0.6, 0.0, 0.06, 0.5)", RADIUS, &list, 64, 6);
    let single = march("layer(0.6, 0.0, 0.06, 0.0)", RADIUS, &list, 64, 6);
    let seen = double.iter().filter(|v| v[0] > 0.0).count();
    assert!(seen > 20, "{seen}");
    for (d, s) in double.iter().zip(&single).filter(|(d, _)| d[0] > 0.0) {
        assert!(d[0] > 3.0 * s[0], "{d:?} {s:?}");
        assert_eq!(d[1], s[1]);
    }
}

#[test]
fn row_l34_jitter_turns_stripes_into_noise_and_keeps_the_mean() {
    let mut random = Random(34);
    let picture = |jitter: &mut dyn FnMut() -> f32| -> Vec<Ray> {
        (0..48 * 48)
            .map(|i| {
                let (x, y) = (f64::from(i / 48), f64::from(i % 48));
                ray(
                    300.0,
                    toward(25.0 + 0.04 * y, 0.7 * x),
                    toward(40.0, 90.0),
                    8e4,
                    jitter(),
                )
            })
            .collect()
    };
    // Thin clouds, where the source sees the stripes.
    let clouds = "layer(0.6, 0.0, 0.0004, 0.5)";
    let few = 12;
    let fine = march(clouds, RADIUS, &picture(&mut || 0.5), 192, 4);
    let fixed = march(clouds, RADIUS, &picture(&mut || 0.5), few, 4);
    let jittered = march(clouds, RADIUS, &picture(&mut || random.unit()), few, 4);
    let light = |v: &[[f64; 3]]| v.iter().map(|p| p[0]).collect::<Vec<f64>>();
    let (fine, fixed, jittered) = (light(&fine), light(&fixed), light(&jittered));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    // Stripes are errors that neighbours share: the correlation of the error from one ray to the next.
    let stripes = |v: &[f64]| {
        let error: Vec<f64> = v.iter().zip(&fine).map(|(a, b)| a - b).collect();
        let middle = mean(&error);
        let pairs = || (0..48 * 48).filter(|i| i % 48 != 47);
        let together: f64 = pairs()
            .map(|i| (error[i] - middle) * (error[i + 1] - middle))
            .sum();
        let alone: f64 = pairs().map(|i| (error[i] - middle).powi(2)).sum();
        together / alone
    };
    let noise = |v: &[f64]| {
        (0..48 * 48)
            .filter(|i| i % 48 != 47)
            .map(|i| (v[i + 1] - v[i]).powi(2))
            .sum::<f64>()
    };
    println!(
        "error shared by neighbours {:.2} without and {:.2} with jitter; neighbour noise {:.1e} and {:.1e}; mean {:.4e}, {:.4e}, converged {:.4e}",
        stripes(&fixed),
        stripes(&jittered),
        noise(&fixed),
        noise(&jittered),
        mean(&fixed),
        mean(&jittered),
        mean(&fine)
    );
    assert!(stripes(&fixed) > 0.9 && stripes(&jittered) < 0.6);
    assert!(noise(&jittered) > 3.0 * noise(&fixed));
    assert!((mean(&jittered) / mean(&fixed) - 1.0).abs() < 0.02);
}

#[test]
fn row_l35_distant_clouds_fade_towards_the_sky() {
    let air = atmosphere::Atmosphere::default();
    let (dir, sun) = (toward(0.5, 30.0), toward(30.0, 120.0));
    let distances = [0.0, 1e3, 1e4, 5e4, 1e5, 2e5, 4e5];
    let background =
        atmosphere::march_sky(&air, 300.0, wide(&dir), wide(&sun), 1e9, 64, 16).in_scatter;
    let list: Vec<[f32; 7]> = distances
        .iter()
        .map(|&d| {
            let front = atmosphere::march_sky(&air, 300.0, wide(&dir), wide(&sun), d, 64, 16);
            let (i, t) = (front.in_scatter, front.transmittance);
            [i[0], i[1], i[2], t[0], t[1], t[2], 0.0].map(|v| v as f32)
        })
        .collect();
    let expression = format!(
        "composite_clouds(CloudLight(0.5, 0.2, 1e4, 64, 768), vec3f(0.9, 0.8, 0.6), SkyLight(vec3f(in.f[0], in.f[1], in.f[2]), vec3f(in.f[3], in.f[4], in.f[5])), vec3f({:?}, {:?}, {:?}))",
        background[0], background[1], background[2]
    );
    let imports = &[
        "veduta::atmosphere::march::{SkyLight}",
        "veduta::clouds::march::{CloudLight}",
        "veduta::clouds::composite::{composite_clouds}",
    ];
    let values = evaluator(imports, "", &expression, 7)
        .run(&bits(&list))
        .unwrap();
    let gap = |v: &[f64]| {
        (0..3)
            .map(|k| (v[k] - background[k]).abs())
            .fold(0.0, f64::max)
    };
    let gaps: Vec<f64> = values.chunks(3).map(gap).collect();
    println!("difference of a cloud to the sky behind it over distance: {gaps:.4?}");
    assert!(
        gaps.windows(2).all(|w| w[1] < w[0]) && gaps[6] < 0.3 * gaps[0],
        "{gaps:?}"
    );
    let cloud = clouds::CloudLight {
        scatter: 0.5,
        transmittance: f64::from(0.2_f32),
        mean_distance: 1e4,
    };
    let light = [0.9_f32, 0.8, 0.6].map(f64::from);
    let behind = background.map(|b| f64::from(b as f32));
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| {
            let front = atmosphere::SkyLight {
                in_scatter: wide(&r[..3]),
                transmittance: wide(&r[3..6]),
            };
            clouds::composite_clouds(cloud, light, front, behind)
        })
        .collect();
    assert_promise("clouds/composite", "composite_clouds", &values, &truth);
}

#[test]
fn cloud_functions_keep_their_promised_error() {
    let (device_rows, list) = rows(20_000, 31, |r| {
        [
            r.unit(),
            r.unit(),
            r.unit(),
            r.between(4000.0, 5500.0),
            r.between(-1.0, 1.0),
            0.0,
        ]
    });
    let values = evaluator(
        &["veduta::clouds::field::{shape_coverage}"],
        "",
        "shape_coverage(in.f[0], 0.01 + 0.99 * in.f[1], in.f[2])",
        6,
    )
    .run(&device_rows)
    .unwrap();
    let truth: Vec<f64> = list
        .iter()
        .map(|r| {
            clouds::shape_coverage(r[0], f64::from(0.01_f32) + f64::from(0.99_f32) * r[1], r[2])
        })
        .collect();
    assert_promise("clouds/field", "shape_coverage", &values, &truth);
    let model = layer(0.6, 0.0, 0.06, 0.5);
    let values = evaluator(
        &[
            "veduta::clouds::field::{CloudLayer}",
            "veduta::clouds::march::{layer_exit}",
        ],
        LAYER,
        "layer_exit(layer(0.6, 0.0, 0.06, 0.5), 6.36e6, in.f[3], in.f[4])",
        6,
    )
    .run(&device_rows)
    .unwrap();
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::layer_exit(&model, RADIUS, r[3], r[4]))
        .collect();
    assert_promise("clouds/march", "layer_exit", &values, &truth);

    let coverage = f64::from(0.6_f32);
    let model = layer(coverage, 0.0, f64::from(0.06_f32), 0.5);
    let (device_rows, list) = rows(5000, 32, |r| {
        let s = direction(r);
        [
            r.between(-8e4, 8e4),
            0.0,
            r.between(-8e4, 8e4),
            r.between(4000.0, 5500.0),
            s[0],
            s[1],
            s[2],
        ]
    });
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::cloud_density(&model, [r[0], r[1], r[2]], r[3]))
        .collect();
    let values = evaluator(
        &["veduta::clouds::field::{CloudLayer, cloud_density}"],
        LAYER,
        "cloud_density(layer(0.6, 0.0, 0.06, 0.5), vec3f(in.f[0], in.f[1], in.f[2]), in.f[3])",
        7,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("clouds/field", "cloud_density", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::uncut_density(&model, [r[0], r[1], r[2]], r[3]))
        .collect();
    let values = evaluator(
        &["veduta::clouds::field::{CloudLayer, uncut_density}"],
        LAYER,
        "uncut_density(layer(0.6, 0.0, 0.06, 0.5), vec3f(in.f[0], in.f[1], in.f[2]), in.f[3])",
        7,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("clouds/field", "uncut_density", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::mean_density(r[4], r[5]))
        .collect();
    let values = evaluator(
        &["veduta::clouds::integral::{mean_density}"],
        "",
        "mean_density(in.f[4], in.f[5])",
        7,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("clouds/integral", "mean_density", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .take(1000)
        .map(|r| {
            clouds::sun_depth(
                &model,
                RADIUS,
                [r[0], r[1], r[2]],
                r[3],
                [r[4], r[5], r[6]],
                r[5],
                12,
            )
        })
        .collect();
    let values = evaluator(
        &["veduta::clouds::field::{CloudLayer}", "veduta::clouds::march::{sun_depth}"],
        LAYER,
        "sun_depth(layer(0.6, 0.0, 0.06, 0.5), 6.36e6, vec3f(in.f[0], in.f[1], in.f[2]), in.f[3], vec3f(in.f[4], in.f[5], in.f[6]), in.f[5], 12)",
        7,
    )
    .run(&device_rows[..7000])
    .unwrap();
    assert_promise("clouds/march", "sun_depth", &values, &truth);
}

#[test]
fn clouds_with_forms_keep_their_promised_error_and_repeat() {
    let model = layer(f64::from(0.6_f32), 0.0, f64::from(0.06_f32), 0.5);
    let shape = clouds::CloudShape {
        kind: 0.5,
        kind_spread: 0.25,
        coverage_spread: 0.5,
        detail: 0.5,
        sharpness: 4.0,
        weather_doublings: 2,
    };
    let (device_rows, list) = rows(5000, 35, |r| {
        [
            r.between(-8e4, 8e4),
            0.0,
            r.between(-8e4, 8e4),
            r.between(4000.0, 5500.0),
            r.unit(),
            r.unit(),
        ]
    });
    let values = evaluator(
        &[
            "veduta::clouds::field::{CloudLayer}",
            "veduta::clouds::shape::{CloudShape, shaped_density}",
        ],
        LAYER,
        "shaped_density(layer(0.6, 0.0, 0.06, 0.5), CloudShape(0.5, 0.25, 0.5, 0.5, 4.0, 2u), vec3f(in.f[0], in.f[1], in.f[2]), in.f[3])",
        6,
    )
    .run(&device_rows)
    .unwrap();
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::shaped_density(&model, &shape, [r[0], r[1], r[2]], r[3]))
        .collect();
    assert_promise("clouds/shape", "shaped_density", &values, &truth);
    let cloudy = truth.iter().filter(|d| **d > 0.0).count();
    assert!((500..4500).contains(&cloudy), "{cloudy}");
    // A period of four wavelengths.
    for (r, d) in list.iter().zip(&truth).take(500) {
        let next = clouds::shaped_density(
            &model,
            &shape,
            [r[0] + 16_000.0, r[1], r[2] - 32_000.0],
            r[3],
        );
        assert!((next - d).abs() < 1e-6, "{next} {d}");
    }
    let values = evaluator(
        &["veduta::clouds::shape::{kind_profile}"],
        "",
        "kind_profile(in.f[4], in.f[5])",
        6,
    )
    .run(&device_rows)
    .unwrap();
    let truth: Vec<f64> = list
        .iter()
        .map(|r| clouds::kind_profile(r[4], r[5]))
        .collect();
    assert_promise("clouds/shape", "kind_profile", &values, &truth);
    let turns: Vec<u32> = device_rows
        .chunks(6)
        .flat_map(|r| {
            [
                r[0].wrapping_mul(2_654_435_761),
                r[2].wrapping_mul(747_796_405),
                r[3].wrapping_mul(2_246_822_519),
            ]
        })
        .collect();
    let values = evaluator(
        &["veduta::clouds::shape::{billows}"],
        "",
        "billows(vec3u(in.u[0], in.u[1], in.u[2]), 3u, 7u)",
        3,
    )
    .run(&turns)
    .unwrap();
    let truth: Vec<f64> = turns
        .chunks(3)
        .map(|t| clouds::billows([0, 1, 2].map(|k| f64::from(t[k]) * 0.5_f64.powi(32)), 3, 7))
        .collect();
    assert_promise("clouds/shape", "billows", &values, &truth);
}

#[test]
fn the_cloud_march_keeps_its_promised_error_and_its_counts() {
    let mut random = Random(33);
    let list: Vec<Ray> = (0..400)
        .map(|_| {
            let altitude = if random.unit() < 0.5 {
                log_between(&mut random, 1.0, 4000.0)
            } else {
                random.between(4000.0, 12000.0)
            };
            let (mut dir, to_sun) = (direction(&mut random), direction(&mut random));
            if altitude < 4000.0 {
                dir[1] = dir[1].abs();
            }
            ray(altitude, dir, to_sun, 8e4, random.unit())
        })
        .collect();
    let model = layer(f64::from(0.6_f32), 0.0, f64::from(0.06_f32), 0.5);
    let twin: Vec<clouds::CloudLight> = list
        .iter()
        .map(|r| {
            let (dir, to_sun) = (wide(&r[1..4]), wide(&r[4..7]));
            clouds::march_clouds(
                &model,
                RADIUS,
                f64::from(r[0]),
                dir,
                to_sun,
                f64::from(r[7]),
                32,
                6,
                f64::from(r[8]),
            )
        })
        .collect();
    let text = "layer(0.6, 0.0, 0.06, 0.5)";
    let plain = march(text, RADIUS, &list, 32, 6);
    let flat = |v: &[[f64; 3]]| v.iter().flat_map(|p| [p[0], p[1]]).collect::<Vec<_>>();
    let truth: Vec<f64> = twin
        .iter()
        .flat_map(|t| [t.scatter, t.transmittance])
        .collect();
    let cloudy = twin.iter().filter(|t| t.scatter > 1e-3).count();
    println!("{cloudy} of {} rays with light from clouds", list.len());
    assert!(cloudy > 30);
    assert_promise("clouds/march", "march_clouds", &flat(&plain), &truth);
    for (p, t) in plain
        .iter()
        .zip(&twin)
        .filter(|(_, t)| t.transmittance < 0.99)
    {
        assert!((p[2] / t.mean_distance - 1.0).abs() < 1e-3, "{p:?} {t:?}");
    }
    let run = |function: &str, part: &str, floor: &str| {
        let expression = format!(
            "{part}({function}({text}, 6.36e6, in.f[0], vec3f(in.f[1], in.f[2], in.f[3]), vec3f(in.f[4], in.f[5], in.f[6]), in.f[7], 32, 6, {floor}in.f[8]))"
        );
        let import = format!("veduta::clouds::march::{{CloudLight, {function}}}");
        evaluator(
            &["veduta::clouds::field::{CloudLayer}", &import],
            &format!("{LAYER}{SEEN}"),
            &expression,
            9,
        )
        .run(&bits(&list))
        .unwrap()
    };
    let skipped: Vec<[f64; 3]> = run("march_clouds_skip", "seen", "1e-4, ")
        .chunks(3)
        .map(|v| [v[0], v[1], v[2]])
        .collect();
    assert_promise("clouds/march", "march_clouds_skip", &flat(&skipped), &truth);
    // The textbook takes every sample; skipping takes fewer of both kinds.
    assert!(
        run("march_clouds", "samples", "")
            .chunks(2)
            .all(|c| c == [32.0, 192.0])
    );
    let few = run("march_clouds_skip", "samples", "1e-4, ");
    let (views, lights) = few
        .chunks(2)
        .fold((0.0, 0.0), |s, c| (s.0 + c[0], s.1 + c[1]));
    println!(
        "skipping takes {:.0} % of the view and {:.0} % of the light samples",
        views / 128.0,
        lights / 768.0
    );
    assert!(views < 0.9 * 12_800.0 && lights < 0.5 * 76_800.0);
    // Nothing breaks at the ends of the arguments.
    let odd = [
        ray(0.0, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], 0.0, 1.0),
        ray(1e5, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], 8e4, 0.0),
    ];
    for value in march(text, RADIUS, &odd, 0, 0) {
        assert_eq!((value[0], value[1]), (0.0, 1.0));
    }
}
