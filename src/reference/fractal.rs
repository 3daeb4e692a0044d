//! Fractal sums of noise: the twins of `veduta::fractal`.
//!
//! Octave i has frequency 2^i and amplitude 2^(-i H) throughout. Fewer than one octave gives 0.

pub mod warp;

use super::noise::{
    Lattice2d, Lattice3d, gradient_noise_2d_slope, gradient_noise_3d_slope, octave_2d, octave_3d,
    octave_frequency, octave_seed, split_3d, value_noise_3d, value_noise_3d_periodic, wrap_3d,
};

/// The amplitude of octave i, f^-H.
pub fn octave_amplitude(i: i32, hurst: f64) -> f64 {
    octave_frequency(i).powf(-hurst)
}

/// The sum of the amplitudes, which bounds a fractal.
pub fn amplitude_sum(octaves: i32, hurst: f64) -> f64 {
    (0..octaves).map(|i| octave_amplitude(i, hurst)).sum()
}

/// The sum of amplitude times frequency, which scales a fractal's gradient.
pub fn slope_sum(octaves: i32, hurst: f64) -> f64 {
    (0..octaves)
        .map(|i| octave_amplitude(i, hurst) * octave_frequency(i))
        .sum()
}

/// Gradient noise of octave i with its gradient per cell of octave 0.
pub fn octave_noise_2d(cell: [i32; 2], frac: [f64; 2], i: i32, seed: u32) -> [f64; 3] {
    let Lattice2d { cell, frac } = octave_2d(cell, frac, i);
    let [n, dx, dy] = gradient_noise_2d_slope(cell, frac, octave_seed(seed, i));
    let f = octave_frequency(i);
    [n, f * dx, f * dy]
}

/// fBm in 2D and its gradient. Leitner 2022, alg. 1.
pub fn fbm_2d_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    seed: u32,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for i in 0..octaves {
        let a = octave_amplitude(i, hurst);
        let n = octave_noise_2d(cell, frac, i, seed);
        sum = std::array::from_fn(|k| sum[k] + a * n[k]);
    }
    sum
}

/// fBm in 2D.
pub fn fbm_2d(cell: [i32; 2], frac: [f64; 2], octaves: i32, hurst: f64, seed: u32) -> f64 {
    fbm_2d_slope(cell, frac, octaves, hurst, seed)[0]
}

/// fBm in 3D and its gradient.
pub fn fbm_3d_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    octaves: i32,
    hurst: f64,
    seed: u32,
) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for i in 0..octaves {
        let a = octave_amplitude(i, hurst);
        let f = octave_frequency(i);
        let Lattice3d { cell, frac } = octave_3d(cell, frac, i);
        let [n, dx, dy, dz] = gradient_noise_3d_slope(cell, frac, octave_seed(seed, i));
        let term = [n, f * dx, f * dy, f * dz];
        sum = std::array::from_fn(|k| sum[k] + a * term[k]);
    }
    sum
}

/// fBm in 3D.
pub fn fbm_3d(cell: [i32; 3], frac: [f64; 3], octaves: i32, hurst: f64, seed: u32) -> f64 {
    fbm_3d_slope(cell, frac, octaves, hurst, seed)[0]
}

/// fBm of value noise in 3D, divided by the sum of the amplitudes.
pub fn fbm_value_3d(cell: [i32; 3], frac: [f64; 3], octaves: i32, hurst: f64, seed: u32) -> f64 {
    if octaves < 1 {
        return 0.0;
    }
    let sum: f64 = (0..octaves)
        .map(|i| {
            let p = octave_3d(cell, frac, i);
            octave_amplitude(i, hurst) * value_noise_3d(p.cell, p.frac, octave_seed(seed, i))
        })
        .sum();
    sum / amplitude_sum(octaves, hurst)
}

/// fBm of value noise in 3D on a lattice that repeats after `period` cells of octave 0, divided by the sum of the
/// amplitudes.
pub fn fbm_value_3d_periodic(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    octaves: i32,
    hurst: f64,
    seed: u32,
) -> f64 {
    if octaves < 1 {
        return 0.0;
    }
    // Wrapping the cell first keeps the finer cells from wrapping at 2^32, which is no multiple of the period.
    let base = split_3d(cell, frac);
    let home = wrap_3d(base.cell, period);
    let sum: f64 = (0..octaves)
        .map(|i| {
            let p = octave_3d(home, base.frac, i);
            let size = period.map(|length| length << i);
            let n = value_noise_3d_periodic(p.cell, p.frac, size, octave_seed(seed, i));
            octave_amplitude(i, hurst) * n
        })
        .sum();
    sum / amplitude_sum(octaves, hurst)
}

/// Six octaves of value noise in 3D on a torus of 2^doublings cells of octave 0 on each axis, at a position in turns of
/// 2^32, divided by the sum of the amplitudes; `fall` is what the amplitude falls by from octave to octave.
pub fn fbm_value_3d_torus_six(turn: [u32; 3], doublings: u32, fall: f64, seed: u32) -> f64 {
    let below = 32 - doublings;
    let cell = turn.map(|t| (t >> below).cast_signed());
    let frac = turn.map(|t| f64::from(t << doublings) / 2_f64.powi(32));
    let period = [1 << doublings; 3];
    fbm_value_3d_periodic(cell, frac, period, 6, -fall.log2(), seed)
}

/// The product rule for (value, d/dx, d/dy).
fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[0] * b[2] + a[2] * b[0],
    ]
}

/// A fractal's value with its gradient, and how near it is to a kink: the least distance of a weight from where it is cut
/// off, or of a noise from where it is mirrored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinked {
    /// Value, d/dx, d/dy.
    pub slope: [f64; 3],
    /// Distance to the nearest kink, infinite if there is none.
    pub kink: f64,
}

/// Hybrid multifractal in 2D with its gradient and its kinks. Leitner 2022, alg. 2.
pub fn hybrid_multifractal_2d_kinked(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    offset: f64,
    seed: u32,
) -> Kinked {
    let signal = |i: i32| {
        let [n, dx, dy] = octave_noise_2d(cell, frac, i, seed);
        [n + offset, dx, dy].map(|v| octave_amplitude(i, hurst) * v)
    };
    let mut kink = f64::INFINITY;
    if octaves < 1 {
        let slope = [0.0; 3];
        return Kinked { slope, kink };
    }
    let mut result = signal(0);
    let mut weight = result;
    for i in 1..octaves {
        kink = kink.min((weight[0] - 1.0).abs());
        if weight[0] > 1.0 {
            weight = [1.0, 0.0, 0.0];
        }
        weight = times(weight, signal(i));
        result = std::array::from_fn(|k| result[k] + weight[k]);
    }
    Kinked {
        slope: result,
        kink,
    }
}

/// Hybrid multifractal in 2D and its gradient.
pub fn hybrid_multifractal_2d_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    offset: f64,
    seed: u32,
) -> [f64; 3] {
    hybrid_multifractal_2d_kinked(cell, frac, octaves, hurst, offset, seed).slope
}

/// Hybrid multifractal in 2D.
pub fn hybrid_multifractal_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    offset: f64,
    seed: u32,
) -> f64 {
    hybrid_multifractal_2d_slope(cell, frac, octaves, hurst, offset, seed)[0]
}

/// |n|, rounded about 0: sqrt(n^2 + smoothness).
pub fn smooth_abs(n: f64, smoothness: f64) -> f64 {
    (n * n + smoothness.max(0.0)).sqrt()
}

/// 1 - |n| of octave i, smoothed, with its gradient; and how near it is to a kink.
fn ridge(cell: [i32; 2], frac: [f64; 2], i: i32, smoothness: f64, seed: u32) -> Kinked {
    let [n, dx, dy] = octave_noise_2d(cell, frac, i, seed);
    let size = smooth_abs(n, smoothness);
    let change = if size > 0.0 { n / size } else { 0.0 };
    Kinked {
        slope: [1.0 - size, -change * dx, -change * dy],
        kink: if smoothness > 0.0 {
            f64::INFINITY
        } else {
            size
        },
    }
}

fn clamped_weight(signal: [f64; 3], gain: f64) -> [f64; 3] {
    let weight = signal.map(|v| v * gain);
    if weight[0] >= 1.0 {
        [1.0, 0.0, 0.0]
    } else if weight[0] < 0.0 {
        [0.0; 3]
    } else {
        weight
    }
}

/// Ridged multifractal in 2D with its gradient and its kinks, squared in every octave. Leitner 2022, alg. 3, corrected.
#[allow(clippy::too_many_arguments)]
pub fn ridged_multifractal_2d_kinked(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    gain: f64,
    smoothness: f64,
    seed: u32,
) -> Kinked {
    let mut kink = f64::INFINITY;
    let mut square = |i: i32| {
        let r = ridge(cell, frac, i, smoothness, seed);
        kink = kink.min(r.kink);
        times(r.slope, r.slope)
    };
    if octaves < 1 {
        let slope = [0.0; 3];
        return Kinked { slope, kink };
    }
    let mut signal = square(0);
    let mut result = signal;
    let mut cut = f64::INFINITY;
    for i in 1..octaves {
        cut = cut.min((signal[0] * gain - 1.0).abs());
        let weight = clamped_weight(signal, gain);
        signal = times(square(i), weight);
        let a = octave_amplitude(i, hurst);
        result = std::array::from_fn(|k| result[k] + a * signal[k]);
    }
    Kinked {
        slope: result,
        kink: kink.min(cut),
    }
}

/// Ridged multifractal in 2D and its gradient.
#[allow(clippy::too_many_arguments)]
pub fn ridged_multifractal_2d_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    gain: f64,
    smoothness: f64,
    seed: u32,
) -> [f64; 3] {
    ridged_multifractal_2d_kinked(cell, frac, octaves, hurst, gain, smoothness, seed).slope
}

/// Ridged multifractal in 2D.
#[allow(clippy::too_many_arguments)]
pub fn ridged_multifractal_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    gain: f64,
    smoothness: f64,
    seed: u32,
) -> f64 {
    ridged_multifractal_2d_slope(cell, frac, octaves, hurst, gain, smoothness, seed)[0]
}

/// The ridged multifractal as printed: only the first octave is squared. Leitner 2022, alg. 3.
#[allow(clippy::too_many_arguments)]
pub fn ridged_multifractal_printed_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    gain: f64,
    smoothness: f64,
    seed: u32,
) -> f64 {
    if octaves < 1 {
        return 0.0;
    }
    let first = ridge(cell, frac, 0, smoothness, seed).slope[0];
    let mut signal = first * first;
    let mut result = signal;
    for i in 1..octaves {
        let weight = (signal * gain).clamp(0.0, 1.0);
        signal = ridge(cell, frac, i, smoothness, seed).slope[0] * weight;
        result += octave_amplitude(i, hurst) * signal;
    }
    result
}
