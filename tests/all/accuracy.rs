//! Comparison of a device function with its f64 twin, against the error that the function's own header promises.

use crate::common::Random;

/// The promise in a header's `error` line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The bound.
    pub value: f64,
    /// Relative to the true value, else absolute.
    pub relative: bool,
}

/// The promise of `function` in the module file `wgsl/<module>.wgsl`.
pub fn promise(module: &str, function: &str) -> Promise {
    let path = format!("{}/wgsl/{module}.wgsl", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    let mut last = None;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match (words.next(), words.next(), words.next(), words.next()) {
            (Some("///"), Some("error"), Some(value), Some(kind)) => {
                assert!(kind == "abs" || kind == "rel", "{path}: {line}");
                last = Some(Promise {
                    value: value.parse().unwrap(),
                    relative: kind == "rel",
                });
            }
            _ if line.contains(&format!("fn {function}(")) => {
                return last.unwrap_or_else(|| panic!("{path}: {function} promises nothing"));
            }
            _ if line.starts_with('}') => last = None,
            _ => {}
        }
    }
    panic!("{path} has no function {function}");
}

/// Prints the largest error of `device` against `truth` and asserts that every number is finite and every error within
/// the header's promise.
pub fn assert_promise(module: &str, function: &str, device: &[f64], truth: &[f64]) {
    let bound = promise(module, function);
    let (worst, at) = largest_error(device, truth, bound.relative);
    let kind = if bound.relative { "rel" } else { "abs" };
    println!(
        "{module} {function}: largest error {worst:.2e} of {:.0e} {kind} in {} values",
        bound.value,
        truth.len()
    );
    assert!(
        worst <= bound.value,
        "{function}: {worst:e} {kind} at {at}: {} instead of {}",
        device[at],
        truth[at]
    );
}

/// The largest absolute or relative error and its place.
pub fn largest_error(device: &[f64], truth: &[f64], relative: bool) -> (f64, usize) {
    assert_eq!(device.len(), truth.len());
    let mut worst = (0.0, 0);
    for (i, (&d, &t)) in device.iter().zip(truth).enumerate() {
        assert!(d.is_finite() && t.is_finite(), "value {i}: {d}, {t}");
        let mut error = (d - t).abs();
        if relative && error > 0.0 {
            error /= t.abs();
        }
        if error > worst.0 {
            worst = (error, i);
        }
    }
    worst
}

/// `count` rows of random columns, as bits for the device and as exact f64 for the twin.
pub fn rows<const N: usize>(
    count: usize,
    seed: u64,
    mut make: impl FnMut(&mut Random) -> [f32; N],
) -> (Vec<u32>, Vec<[f64; N]>) {
    let mut random = Random(seed);
    let list: Vec<[f32; N]> = (0..count).map(|_| make(&mut random)).collect();
    (
        bits(&list),
        list.iter().map(|row| row.map(f64::from)).collect(),
    )
}

/// Rows as bits for the device.
pub fn bits<const N: usize>(list: &[[f32; N]]) -> Vec<u32> {
    list.iter().flat_map(|row| row.map(f32::to_bits)).collect()
}

/// A number spread evenly on a logarithmic scale.
pub fn log_between(random: &mut Random, low: f32, high: f32) -> f32 {
    (low.ln() + (high / low).ln() * random.unit()).exp()
}

/// A random unit vector.
pub fn direction(random: &mut Random) -> [f32; 3] {
    let y = random.between(-1.0, 1.0);
    let around = random.between(0.0, std::f32::consts::TAU);
    let r = (1.0 - y * y).max(0.0).sqrt();
    [r * around.cos(), y, r * around.sin()]
}

/// The unit vector of a height above the horizon and an azimuth, both in degrees, azimuth 0 towards +x.
pub fn toward(height: f64, azimuth: f64) -> [f32; 3] {
    let (h, a) = (height.to_radians(), azimuth.to_radians());
    [
        (h.cos() * a.cos()) as f32,
        h.sin() as f32,
        (h.cos() * a.sin()) as f32,
    ]
}
