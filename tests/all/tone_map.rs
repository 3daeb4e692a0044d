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
