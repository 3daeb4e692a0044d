//! The ridged multifractal: crests where the noise is 0, each octave weighted by the one before.
//!
//! `ridged_multifractal_2d` squares the inverted noise in every octave, as Musgrave's original and the source's own text
//! have it; `ridged_multifractal_printed_2d` squares the first octave only, as the source's algorithm is printed.
//!
//! Smooth ridges: |n| becomes sqrt(n^2 + smoothness). The crest is rounded over a width of sqrt(smoothness) in noise units
//! and lowered; elsewhere |n| changes by less than smoothness / (2 |n|). With smoothness 0 it is |n| exactly.
//!
//! source   Leitner2022 alg. 3; Musgrave2003 Texturing and Modeling, ridged multifractal
//! symbols  octaves number of octaves [1] · hurst Hurst exponent [1] · gain weight of the next octave [1]
//! symbols  smoothness square of the width over which crests are rounded [1]
#define_import_path veduta::fractal::ridged

#import veduta::noise::lattice::{split_2d, finer_2d, shifted_2d, octave_seed, octave_frequency, octave_fall}
#import veduta::noise::gradient::{gradient_at_2d, gradient_at_2d_slope}

/// |n|, rounded about 0.
///
/// domain  n in [-1, 1] 1 lin
/// domain  smoothness in [0, 1] 1 lin
/// range   [0, 1.4142136] 1
/// error   2e-7 abs of reference::fractal::smooth_abs
/// outside undefined
/// source  ours, after Leitner2022 4.4
fn smooth_abs(n: f32, smoothness: f32) -> f32 {
    return select(abs(n), sqrt(n * n + smoothness), smoothness > 0.0);
}

/// Ridged multifractal of gradient noise in 2D. Musgrave's start values: hurst 1, gain 2.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  gain in [0, 4] 1 lin
/// domain  smoothness in [0, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 16] 1
/// error   1e-5 abs of reference::fractal::ridged_multifractal_2d
/// outside undefined
/// source  Leitner2022 alg. 3; departs: squared in every octave
fn ridged_multifractal_2d(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    gain: f32,
    smoothness: f32,
    seed: u32,
) -> f32 {
    let fall = octave_fall(hurst);
    var p = split_2d(cell, frac);
    var amplitude = 1.0;
    var weight = 1.0;
    var sum = 0.0;
    for (var i = 0; i < octaves; i++) {
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        let ridge = 1.0 - smooth_abs(gradient_at_2d(q, octave_seed(seed, i)), smoothness);
        let signal = ridge * ridge * weight;
        sum += amplitude * signal;
        weight = clamp(signal * gain, 0.0, 1.0);
        amplitude *= fall;
    }
    return sum;
}

/// Ridged multifractal in 2D and its gradient: (value, d/dx, d/dy), per cell of octave 0.
///
/// With smoothness 0 the gradient jumps at crests; it always jumps where a weight reaches 1. Where a weight is cut off it
/// has no gradient. The gradient's error is relative to the sum of amplitude times frequency.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  gain in [0, 4] 1 lin
/// domain  smoothness in [0, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-inf, inf] 1
/// error   1.5 abs of reference::fractal::ridged_multifractal_2d_slope
/// outside undefined
/// source  Leitner2022 alg. 3; departs: squared in every octave
fn ridged_multifractal_2d_slope(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    gain: f32,
    smoothness: f32,
    seed: u32,
) -> vec3<f32> {
    let fall = octave_fall(hurst);
    var p = split_2d(cell, frac);
    var amplitude = 1.0;
    var weight = vec3<f32>(1.0, 0.0, 0.0);
    var sum = vec3<f32>(0.0);
    for (var i = 0; i < octaves; i++) {
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        let n = gradient_at_2d_slope(q, octave_seed(seed, i));
        let size = smooth_abs(n.x, smoothness);
        let ridge = 1.0 - size;
        // d size = n / size dn, the sign of n without smoothness; the floor makes it 0 at a crest.
        let fall_off = -2.0 * ridge * (n.x / max(size, 1e-30)) * octave_frequency(i);
        let square = ridge * ridge;
        let signal = vec3<f32>(square * weight.x, fall_off * weight.x * n.yz + square * weight.yz);
        sum += amplitude * signal;
        let next = signal * gain;
        weight = select(next, vec3<f32>(1.0, 0.0, 0.0), next.x >= 1.0);
        amplitude *= fall;
    }
    return sum;
}

/// The ridged multifractal as the source prints it: squared in the first octave only, softer.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  gain in [0, 4] 1 lin
/// domain  smoothness in [0, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-7, 16] 1
/// error   1.2e-5 abs of reference::fractal::ridged_multifractal_printed_2d
/// outside undefined
/// source  Leitner2022 alg. 3
fn ridged_multifractal_printed_2d(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    gain: f32,
    smoothness: f32,
    seed: u32,
) -> f32 {
    let fall = octave_fall(hurst);
    var p = split_2d(cell, frac);
    var amplitude = 1.0;
    var weight = 1.0;
    var sum = 0.0;
    for (var i = 0; i < octaves; i++) {
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        let ridge = 1.0 - smooth_abs(gradient_at_2d(q, octave_seed(seed, i)), smoothness);
        let signal = select(ridge, ridge * ridge, i == 0) * weight;
        sum += amplitude * signal;
        weight = clamp(signal * gain, 0.0, 1.0);
        amplitude *= fall;
    }
    return sum;
}
