//! Tone maps, transfer function and dithering (row L36).

use crate::accuracy::{assert_promise, bits, log_between, rows};
use crate::common::evaluator;
use veduta::reference::{post, tone_map};

const MAPS: [&str; 2] = ["exponential", "reinhard"];

/// A tone map of grey on the device.
fn map(name: &str, list: &[[f32; 2]]) -> Vec<f64> {
    evaluator(
        &[&format!("veduta::tone_map::{name}::{{{name}}}")],
        "",
        &format!("{name}(vec3f(in.f[0]), in.f[1]).x"),
        2,
    )
    .run(&bits(list))
    .unwrap()
}

#[test]
fn row_l36_tone_mapping_is_monotone_below_one_and_follows_the_exposure() {
    for name in MAPS {
        let ramp: Vec<[f32; 2]> = (0..20_000).map(|i| [0.001 * i as f32, 1.0]).collect();
        let values = map(name, &ramp);
        assert_eq!(values[0], 0.0);
        assert!(
            values.windows(2).all(|w| w[0] <= w[1]),
            "{name} is not monotone"
        );
        let extremes = map(name, &[[-1.0, 1.0], [1e30, 1.0], [3e38, 1e3], [1e-30, 1.0]]);
        assert!(
            extremes.iter().all(|v| (0.0..1.0).contains(v)),
            "{name}: {extremes:?}"
        );
        let exposed = map(name, &[[0.5, 0.5], [0.5, 1.0], [0.5, 2.0]]);
        assert!(
            exposed[0] < exposed[1] && exposed[1] < exposed[2],
            "{name}: {exposed:?}"
        );
    }
    let half = map("exponential", &[[1.0, 1.0]])[0];
    assert!((half - (1.0 - (-1.0_f64).exp())).abs() < 1e-6);
    assert_eq!(map("reinhard", &[[1.0, 1.0]])[0], 0.5);
}

#[test]
fn row_l36_the_transfer_function_is_srgb_and_its_own_inverse() {
    let values = evaluator(
        &["veduta::post::srgb::{encode_srgb}"],
        "",
        "encode_srgb(vec3f(in.f[0])).x",
        1,
    )
    .run(&bits(&[
        [0.0],
        [0.001],
        [0.003_130_8],
        [0.214_041_14],
        [1.0],
        [-1.0],
    ]))
    .unwrap();
    let expected = [0.0, 0.01292, 0.040_449_94, 0.5, 1.0, 0.0];
    for (v, e) in values.iter().zip(expected) {
        assert!((v - e).abs() < 2e-6, "{v}, not {e}");
    }
    // Every 8-bit code survives decoding and encoding: the gamma is applied once each way.
    let codes: Vec<[f32; 1]> = (0..256).map(|i| [i as f32 / 255.0]).collect();
    let back = evaluator(
        &["veduta::post::srgb::{encode_srgb, decode_srgb}"],
        "",
        "encode_srgb(decode_srgb(vec3f(in.f[0]))).x",
        1,
    )
    .run(&bits(&codes))
    .unwrap();
    for (i, v) in back.iter().enumerate() {
        assert!(
            (v * 255.0 - i as f64).abs() < 1e-3,
            "code {i}: {}",
            v * 255.0
        );
    }
}

#[test]
fn tone_maps_and_transfer_keep_their_promised_error() {
    let (device_rows, list) = rows(100_000, 7, |r| {
        [
            log_between(r, 1e-6, 1e6),
            log_between(r, 1e-3, 1e3),
            r.unit(),
        ]
    });
    let check = |module: &str, name: &str, arguments: &str, twin: &dyn Fn(&[f64; 3]) -> f64| {
        let truth: Vec<f64> = list.iter().map(twin).collect();
        let import = format!("veduta::{}::{{{name}}}", module.replace('/', "::"));
        let values = evaluator(&[&import], "", &format!("{name}({arguments}).y"), 3)
            .run(&device_rows)
            .unwrap();
        assert_promise(module, name, &values, &truth);
    };
    check(
        "tone_map/exponential",
        "exponential",
        "vec3f(in.f[0]), in.f[1]",
        &|r| tone_map::exponential([r[0]; 3], r[1])[1],
    );
    check(
        "tone_map/reinhard",
        "reinhard",
        "vec3f(in.f[0]), in.f[1]",
        &|r| tone_map::reinhard([r[0]; 3], r[1])[1],
    );
    check("post/srgb", "encode_srgb", "vec3f(in.f[2])", &|r| {
        post::encode_srgb([r[2]; 3])[1]
    });
    check("post/srgb", "decode_srgb", "vec3f(in.f[2])", &|r| {
        post::decode_srgb([r[2]; 3])[1]
    });
}

/// Module, function and arguments beside the colour of the tone maps with more to them.
const FILMIC: [(&str, &str, &str); 5] = [
    ("reinhard", "reinhard_extended", ", 4.0"),
    ("aces", "aces_hill", ""),
    ("aces", "aces_narkowicz", ""),
    ("agx", "agx", ""),
    ("neutral", "neutral", ""),
];

/// A tone map of colours on the device; columns are red, green, blue and the exposure.
fn map_colors(module: &str, name: &str, more: &str, list: &[[f32; 4]]) -> Vec<f64> {
    evaluator(
        &[&format!("veduta::tone_map::{module}::{{{name}}}")],
        "",
        &format!("{name}(vec3f(in.f[0], in.f[1], in.f[2]), in.f[3]{more})"),
        4,
    )
    .run(&bits(list))
    .unwrap()
}

#[test]
fn filmic_maps_are_monotone_from_black_to_white() {
    for (module, name, more) in FILMIC {
        let map = |list: &[[f32; 4]]| map_colors(module, name, more, list);
        // Greys, evenly and over all magnitudes.
        let even: Vec<[f32; 4]> = (0..20_000).map(|i| [0.001 * i as f32; 4]).collect();
        let even: Vec<[f32; 4]> = even.iter().map(|c| [c[0], c[1], c[2], 1.0]).collect();
        let wide: Vec<[f32; 4]> = (0..20_000)
            .map(|i| {
                let c = 10_f32.powf(i as f32 / 1000.0 - 10.0);
                [c, c, c, 1.0]
            })
            .collect();
        for ramp in [even, wide] {
            let values = map(&ramp);
            for c in 0..3 {
                let channel: Vec<f64> = values.iter().skip(c).step_by(3).copied().collect();
                let drop = channel.windows(2).map(|w| w[0] - w[1]).fold(0.0, f64::max);
                // Falls are roundings, in AgX those of the device's logarithm.
                let bar = if name == "agx" { 1.5e-6 } else { 6e-7 };
                assert!(drop <= bar, "{name} falls by {drop:e}");
                assert!(channel.iter().all(|v| (0.0..=1.0).contains(v)), "{name}");
                assert!(
                    *channel.last().unwrap() > 0.98,
                    "{name}: {:?}",
                    channel.last()
                );
            }
        }
        // Black is black; nothing leaves [0, 1] or is no number.
        let dark = map(&[[0.0, 0.0, 0.0, 1.0], [-1.0, -2.0, -3.0, 1.0]]);
        assert_eq!(dark, [0.0; 6], "{name}");
        let extreme = [
            0.0, -0.0, -1e30, 1e-40, 1e-30, 1e-6, 0.04, 0.76, 1.0, 1e6, 1e30, 3e38,
        ];
        let mut list = Vec::new();
        for r in extreme {
            for g in extreme {
                for b in extreme {
                    list.push([r, g, b, 1.0]);
                    list.push([r, g, b, 1000.0]);
                }
            }
        }
        let values = map(&list);
        for (k, v) in values.iter().enumerate() {
            assert!((0.0..=1.0).contains(v), "{name} {:?}: {v}", list[k / 3]);
        }
        // Exposure is a factor of the colour.
        let twice = map(&[[0.25, 0.5, 0.125, 2.0], [0.5, 1.0, 0.25, 1.0]]);
        assert_eq!(twice[..3], twice[3..], "{name}");
    }
}

#[test]
fn filmic_maps_have_their_published_values() {
    let near = |found: f64, expected: f64, bar: f64, what: &str| {
        assert!(
            (found - expected).abs() < bar,
            "{what}: {found}, not {expected}"
        );
    };
    // Reinhard: white becomes 1, and without a white point it is the simple map.
    let extended = map_colors(
        "reinhard",
        "reinhard_extended",
        ", 4.0",
        &[[4.0, 1.0, 9.0, 1.0]],
    );
    near(extended[0], 1.0, 1e-7, "white");
    near(extended[1], (1.0 + 1.0 / 16.0) / 2.0, 1e-7, "1 under 4");
    assert_eq!(extended[2], 1.0);
    let simple = map_colors(
        "reinhard",
        "reinhard_extended",
        ", 1e6",
        &[[1.0, 3.0, 0.25, 1.0]],
    );
    for (found, x) in simple.iter().zip([1.0, 3.0, 0.25]) {
        near(*found, x / (1.0 + x), 1e-6, "far white");
    }
    // Narkowicz at 1: (2.51 + 0.03) / (2.43 + 0.59 + 0.14). It exceeds 1 from about 7.24 on.
    let curve = map_colors("aces", "aces_narkowicz", "", &[[1.0, 7.3, 7.1, 1.0]]);
    near(curve[0], 2.54 / 3.16, 2e-7, "Narkowicz at 1");
    assert!(curve[1] == 1.0 && curve[2] < 1.0, "{curve:?}");
    // Hill: matrices that keep grey, within their five digits; the curve at 1 and at middle grey; 1.0165 beyond.
    let curve = |v: f64| {
        (v * v + 0.0245786 * v - 0.000090537) / (0.983729 * v * v + 0.432951 * v + 0.238081)
    };
    for grey in [0.18_f32, 1.0, 4.0] {
        let found = map_colors("aces", "aces_hill", "", &[[grey, grey, grey, 1.0]]);
        for v in found {
            near(v, curve(f64::from(grey)), 4e-5, "Hill's grey");
        }
    }
    // Very bright red turns towards white instead of staying red.
    let red = map_colors(
        "aces",
        "aces_hill",
        "",
        &[[1.0, 0.0, 0.0, 1.0], [1e4, 0.0, 0.0, 1.0]],
    );
    assert!(red[1] < 0.1 && red[4] > 0.5, "{red:?}");
    // AgX: middle grey becomes the code 1/2; slope 2 there; the ends of its 16.5 stops.
    let sigmoid = |list: &[f32]| {
        let list: Vec<[f32; 1]> = list.iter().map(|x| [*x]).collect();
        evaluator(
            &["veduta::tone_map::agx::{agx_sigmoid}"],
            "",
            "agx_sigmoid(in.f[0])",
            1,
        )
        .run(&bits(&list))
        .unwrap()
    };
    let middle = 20.0_f32 / 33.0;
    let s = sigmoid(&[0.0, middle, 1.0, middle - 0.01, middle + 0.01]);
    near(s[0], 0.0, 1e-6, "foot");
    near(s[1], 0.5, 1e-6, "middle");
    near(s[2], 1.0, 1e-6, "head");
    near((s[4] - s[3]) / 0.02, 2.0, 1e-3, "slope");
    let ramp: Vec<f32> = (0..=100_000).map(|k| k as f32 / 100_000.0).collect();
    let values = sigmoid(&ramp);
    let drop = values.windows(2).map(|w| w[0] - w[1]).fold(0.0, f64::max);
    assert!(drop <= 2e-7, "the sigmoid falls by {drop:e}");
    let truth: Vec<f64> = ramp
        .iter()
        .map(|&x| tone_map::agx_sigmoid(f64::from(x)))
        .collect();
    assert_promise("tone_map/agx", "agx_sigmoid", &values, &truth);
    let grey = map_colors("agx", "agx", "", &[[0.18, 0.18, 0.18, 1.0]]);
    for v in grey {
        near(v, 0.5_f64.powf(2.2), 1e-4, "AgX's middle grey");
    }
    // A well-known polynomial fit to the same sigmoid agrees within its own error.
    for k in 0..=100 {
        let x = f64::from(k) / 100.0;
        let powers = [-0.00232, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5];
        let fit = powers.iter().rev().fold(0.0, |sum, p| sum * x + p);
        near(fit, tone_map::agx_sigmoid(x), 0.006, "Wrensch's fit");
    }
    // Neutral: base colours from 0.08 to 0.8 lose 0.04, the dark 6.25 of its square is kept; the start of compression
    // is smooth, white comes at infinity.
    let found = map_colors(
        "neutral",
        "neutral",
        "",
        &[
            [0.5, 0.3, 0.08, 1.0],
            [0.04, 0.04, 0.04, 1.0],
            [1.0, 1.0, 1.0, 1.0],
            [0.0, 0.7, 0.3, 1.0],
        ],
    );
    let peak = 1.0 - 0.24 * 0.24 / (0.96 + 0.24 - 0.76);
    let expected = [
        0.46, 0.26, 0.04, 0.01, 0.01, 0.01, peak, peak, peak, 0.0, 0.7, 0.3,
    ];
    for (found, expected) in found.iter().zip(expected) {
        near(*found, expected, 2e-7, "neutral");
    }
}

/// A twin of a colour and its row.
type Colors<'a> = &'a dyn Fn([f64; 3], &[f64; 5]) -> [f64; 3];

#[test]
fn filmic_maps_keep_their_promised_error() {
    let (device_rows, list) = rows(300_000, 8, |r| {
        let exposure = log_between(r, 1e-3, 1e3);
        // Any colour, greys, and colours about white.
        let any = [0; 3].map(|_| log_between(r, 1e-6, 1e6));
        let about = [0; 3].map(|_| log_between(r, 1e-3, 30.0) / exposure);
        let c = match r.bits() % 4 {
            0 => any,
            1 => [any[0]; 3],
            _ => about,
        };
        [c[0], c[1], c[2], exposure, log_between(r, 0.5, 1e6)]
    });
    let check = |module: &str, name: &str, more: &str, twin: Colors<'_>| {
        let truth: Vec<f64> = list
            .iter()
            .flat_map(|r| twin([r[0], r[1], r[2]], r))
            .collect();
        let values = evaluator(
            &[&format!("veduta::tone_map::{module}::{{{name}}}")],
            "",
            &format!("{name}(vec3f(in.f[0], in.f[1], in.f[2]), in.f[3]{more})"),
            5,
        )
        .run(&device_rows)
        .unwrap();
        assert_promise(&format!("tone_map/{module}"), name, &values, &truth);
    };
    check("reinhard", "reinhard_extended", ", in.f[4]", &|c, r| {
        tone_map::reinhard_extended(c, r[3], r[4])
    });
    check("aces", "aces_hill", "", &|c, r| {
        tone_map::aces_hill(c, r[3])
    });
    check("aces", "aces_narkowicz", "", &|c, r| {
        tone_map::aces_narkowicz(c, r[3])
    });
    check("agx", "agx", "", &|c, r| tone_map::agx(c, r[3]));
    check("neutral", "neutral", "", &|c, r| tone_map::neutral(c, r[3]));
}

#[test]
fn dithering_keeps_the_mean_and_uses_every_threshold_once() {
    let block: Vec<u32> = (0..64).flat_map(|i| [i % 8 + 16, i / 8 + 8]).collect();
    let values = evaluator(
        &["veduta::post::dither::{bayer_8x8}"],
        "",
        "bayer_8x8(vec2u(in.u[0], in.u[1]))",
        2,
    )
    .run(&block)
    .unwrap();
    let truth: Vec<f64> = block
        .chunks(2)
        .map(|p| post::bayer_8x8([p[0], p[1]]))
        .collect();
    assert_promise("post/dither", "bayer_8x8", &values, &truth);
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    assert!(
        sorted
            .iter()
            .enumerate()
            .all(|(k, v)| *v == (k as f64 + 0.5) / 64.0)
    );
    // Rounding to 8 bits after dithering keeps the mean of a flat signal to 1/64 of a step.
    for signal in [0.1_f32, 0.333, 0.5, 0.77] {
        let rows: Vec<u32> = block
            .chunks(2)
            .flat_map(|p| [p[0], p[1], signal.to_bits()])
            .collect();
        let dithered = evaluator(
            &["veduta::post::dither::{dither}"],
            "",
            "dither(vec3f(in.f[2]), vec2u(in.u[0], in.u[1]), 255.0).z",
            3,
        )
        .run(&rows)
        .unwrap();
        let truth: Vec<f64> = block
            .chunks(2)
            .map(|p| post::dither([f64::from(signal); 3], [p[0], p[1]], 255.0)[2])
            .collect();
        assert_promise("post/dither", "dither", &dithered, &truth);
        let mean = dithered.iter().map(|v| (v * 255.0).round()).sum::<f64>() / 64.0;
        assert!(
            (mean - f64::from(signal) * 255.0).abs() <= 1.0 / 64.0,
            "{signal}: {mean}"
        );
        let plain = (f64::from(signal) * 255.0).round();
        assert!(
            (mean - f64::from(signal) * 255.0).abs()
                <= (plain - f64::from(signal) * 255.0).abs() + 1e-9
        );
    }
}

/// The mask is even over any patch, and has hardly anything of coarse grain: its power below an eighth of a cycle a pixel, beside that of white noise.
#[test]
fn the_blue_mask_has_no_coarse_grain() {
    let pixels: Vec<[u32; 2]> = (0..64)
        .flat_map(|y| (0..64).map(move |x| [x + 300, y + 4000]))
        .collect();
    let values = evaluator(
        &["veduta::post::dither::{blue_mask}"],
        "",
        "blue_mask(vec2u(in.u[0], in.u[1]))",
        2,
    )
    .run(&pixels.concat())
    .unwrap();
    let truth: Vec<f64> = pixels.iter().map(|p| post::blue_mask(*p)).collect();
    assert_promise("post/dither", "blue_mask", &values, &truth);
    let mut tenths = [0; 10];
    for v in &values {
        tenths[(10.0 * v) as usize] += 1;
    }
    println!("{tenths:?}");
    assert!(tenths.iter().all(|n| (389..=430).contains(n)));
    let coarse = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / 4096.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4096.0;
        let (mut power, mut count) = (0.0, 0);
        for (u, v) in (0..=8_i32).flat_map(|u| (-8..=8_i32).map(move |v| (u, v))) {
            if (u, v) == (0, 0) || u * u + v * v > 64 {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (k, value) in values.iter().enumerate() {
                let at = f64::from(u * (k as i32 % 64) + v * (k as i32 / 64)) / 64.0;
                let (sin, cos) = (std::f64::consts::TAU * at).sin_cos();
                re += (value - mean) * cos;
                im += (value - mean) * sin;
            }
            power += (re * re + im * im) / 4096.0;
            count += 1;
        }
        power / f64::from(count) / variance
    };
    let mut state = 1_u64;
    let white: Vec<f64> = (0..4096)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / 2_f64.powi(31)
        })
        .collect();
    let (mask, noise) = (coarse(&values), coarse(&white));
    println!("power of coarse grain, of white noise 1: mask {mask:.3}, noise {noise:.3}");
    assert!(mask < 0.15 && noise > 0.7, "{mask} {noise}");
}
