//! The hybrid multifractal: each octave is weighted by the sum so far, so that low places stay smooth.
//!
//! source   Leitner2022 alg. 2; Musgrave2003 Texturing and Modeling, hybrid multifractal
//! symbols  octaves number of octaves [1] · hurst Hurst exponent [1] · offset moves the noise towards positive values [1]
#define_import_path veduta::fractal::hybrid

#import veduta::noise::lattice::{split_2d, finer_2d, shifted_2d, octave_seed, octave_frequency, octave_fall}
#import veduta::noise::gradient::{gradient_at_2d, gradient_at_2d_slope}

/// Hybrid multifractal of gradient noise in 2D. Musgrave's start values: hurst 0.25, offset 0.7.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  offset in [0, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-5000, 32] 1
/// error   3e-5 abs of reference::fractal::hybrid_multifractal_2d
/// outside undefined
/// source  Leitner2022 alg. 2
fn hybrid_multifractal_2d(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    offset: f32,
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
        let signal = amplitude * (gradient_at_2d(q, octave_seed(seed, i)) + offset);
        weight = min(weight, 1.0) * signal;
        sum += weight;
        amplitude *= fall;
    }
    return sum;
}

/// Hybrid multifractal in 2D and its gradient: (value, d/dx, d/dy), per cell of octave 0.
///
/// Where a weight is cut off at 1 it has no gradient, and the gradient jumps. Its error is relative to the sum of
/// amplitude times frequency.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  offset in [0, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-inf, inf] 1
/// error   0.4 abs of reference::fractal::hybrid_multifractal_2d_slope
/// outside undefined
/// source  Leitner2022 alg. 2
fn hybrid_multifractal_2d_slope(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    offset: f32,
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
        let signal = amplitude * vec3<f32>(n.x + offset, octave_frequency(i) * n.yz);
        let cut = select(weight, vec3<f32>(1.0, 0.0, 0.0), weight.x >= 1.0);
        weight = vec3<f32>(cut.x * signal.x, cut.x * signal.yz + signal.x * cut.yz);
        sum += weight;
        amplitude *= fall;
    }
    return sum;
}
