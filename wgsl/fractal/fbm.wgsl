//! Fractional Brownian motion: sums of noise at doubling frequencies and falling amplitudes.
//!
//! Octave i has the frequency f = 2^i and the amplitude f^-H. Each octave has its own seed and is shifted
//! against the others (veduta::noise::lattice). `fbm_*` is the plain sum of algorithm 1, within the sum of the amplitudes;
//! `fbm_value_*` is divided by that sum.
//!
//! source   Leitner2022 alg. 1
//! symbols  octaves number of octaves [1] · hurst Hurst exponent H, 1 smooth, 0 rough [1]
#define_import_path veduta::fractal::fbm

#import veduta::noise::lattice::{Lattice3d, split_2d, split_3d, wrap_3d, next_cell_3d, finer_2d, finer_3d, shifted_2d, shifted_3d, octave_seed, octave_frequency, octave_fall, fade_fraction_3d}
#import veduta::noise::gradient::{gradient_at_2d, gradient_at_3d, gradient_at_2d_slope, gradient_at_3d_slope}
#import veduta::hash::lattice::{SPREAD_3D, spread_zero_3d, lattice_keys_3d}
#import veduta::noise::value::{value_between_3d, value_plus_one_3d}

/// fBm of gradient noise in 2D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-16, 16] 1
/// error   4e-6 abs of reference::fractal::fbm_2d
/// outside undefined
/// source  Leitner2022 alg. 1
fn fbm_2d(cell: vec2<i32>, frac: vec2<f32>, octaves: i32, hurst: f32, seed: u32) -> f32 {
    let fall = octave_fall(hurst);
    var p = split_2d(cell, frac);
    var amplitude = 1.0;
    var sum = 0.0;
    for (var i = 0; i < octaves; i++) {
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        sum += amplitude * gradient_at_2d(q, octave_seed(seed, i));
        amplitude *= fall;
    }
    return sum;
}

/// fBm of gradient noise in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-16, 16] 1
/// error   3e-6 abs of reference::fractal::fbm_3d
/// outside undefined
/// source  Leitner2022 alg. 1
fn fbm_3d(cell: vec3<i32>, frac: vec3<f32>, octaves: i32, hurst: f32, seed: u32) -> f32 {
    let fall = octave_fall(hurst);
    var p = split_3d(cell, frac);
    var amplitude = 1.0;
    var sum = 0.0;
    for (var i = 0; i < octaves; i++) {
        let q = shifted_3d(p, i);
        p = finer_3d(p);
        sum += amplitude * gradient_at_3d(q, octave_seed(seed, i));
        amplitude *= fall;
    }
    return sum;
}

/// fBm of gradient noise in 2D and its gradient: (value, d/dx, d/dy), per cell of octave 0.
///
/// The gradient's error is relative to the sum of amplitude times frequency.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-400000, 400000] 1
/// error   0.1 abs of reference::fractal::fbm_2d_slope
/// outside undefined
/// source  Leitner2022 alg. 1
fn fbm_2d_slope(cell: vec2<i32>, frac: vec2<f32>, octaves: i32, hurst: f32, seed: u32) -> vec3<f32> {
    let fall = octave_fall(hurst);
    var p = split_2d(cell, frac);
    var amplitude = 1.0;
    var sum = vec3<f32>(0.0);
    for (var i = 0; i < octaves; i++) {
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        let n = gradient_at_2d_slope(q, octave_seed(seed, i));
        sum += amplitude * vec3<f32>(n.x, octave_frequency(i) * n.yz);
        amplitude *= fall;
    }
    return sum;
}

/// fBm of gradient noise in 3D and its gradient: (value, d/dx, d/dy, d/dz), per cell of octave 0.
///
/// The gradient's error is relative to the sum of amplitude times frequency.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-550000, 550000] 1
/// error   0.1 abs of reference::fractal::fbm_3d_slope
/// outside undefined
/// source  Leitner2022 alg. 1
fn fbm_3d_slope(cell: vec3<i32>, frac: vec3<f32>, octaves: i32, hurst: f32, seed: u32) -> vec4<f32> {
    let fall = octave_fall(hurst);
    var p = split_3d(cell, frac);
    var amplitude = 1.0;
    var sum = vec4<f32>(0.0);
    for (var i = 0; i < octaves; i++) {
        let q = shifted_3d(p, i);
        p = finer_3d(p);
        let n = gradient_at_3d_slope(q, octave_seed(seed, i));
        sum += amplitude * vec4<f32>(n.x, octave_frequency(i) * n.yzw);
        amplitude *= fall;
    }
    return sum;
}

/// fBm of value noise in 3D, divided by the sum of the amplitudes: the cloud field.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::fractal::fbm_value_3d
/// outside undefined
/// source  Leitner2022 8.2; departs: normalised
fn fbm_value_3d(cell: vec3<i32>, frac: vec3<f32>, octaves: i32, hurst: f32, seed: u32) -> f32 {
    let fall = octave_fall(hurst);
    var p = split_3d(cell, frac);
    var amplitude = 1.0;
    var sum = 0.0;
    var total = 0.0;
    for (var i = 0; i < octaves; i++) {
        let q = shifted_3d(p, i);
        p = finer_3d(p);
        sum += amplitude * value_between_3d(q.cell, q.cell + 1, q.frac, octave_seed(seed, i));
        total += amplitude;
        amplitude *= fall;
    }
    // The total is at least 1; the floor only makes 0 octaves a 0.
    return sum / max(total, 1.0);
}

/// Octave i of a periodic sum: value noise at a position on a lattice of `size` cells, not yet shifted.
///
/// internal
fn periodic_octave_3d(p: Lattice3d, size: vec3<i32>, i: i32, seed: u32) -> f32 {
    // The cell is below the size, the shift carries at most one.
    let q = shifted_3d(p, i);
    let low = select(q.cell, vec3<i32>(0), q.cell >= size);
    return value_between_3d(low, next_cell_3d(low, size), q.frac, octave_seed(seed, i));
}

/// fBm of value noise in 3D on a lattice that repeats after `period` cells of octave 0 on each axis, divided by the sum
/// of the amplitudes.
///
/// The period times 2^octaves must stay below 2^31.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 32767] cell lin
/// domain  octaves in [1, 16] 1 lin
/// domain  hurst in [0, 2] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::fractal::fbm_value_3d_periodic
/// outside undefined
/// source  Leitner2022 8.2; departs: normalised, periodic lattice
fn fbm_value_3d_periodic(
    cell: vec3<i32>,
    frac: vec3<f32>,
    period: vec3<i32>,
    octaves: i32,
    hurst: f32,
    seed: u32,
) -> f32 {
    let fall = octave_fall(hurst);
    let base = split_3d(cell, frac);
    var p = Lattice3d(wrap_3d(base.cell, period), base.frac);
    var size = period;
    var amplitude = 1.0;
    var sum = 0.0;
    var total = 0.0;
    for (var i = 0; i < octaves; i++) {
        sum += amplitude * periodic_octave_3d(p, size, i, seed);
        p = finer_3d(p);
        size += size;
        total += amplitude;
        amplitude *= fall;
    }
    return sum / max(total, 1.0);
}

/// Octave i, plus 1, of a sum on a torus of 2^bits cells; `turn` is shifted already.
///
/// internal
fn torus_octave_3d(turn: vec3<u32>, bits: u32, seed: u32) -> f32 {
    let cell = turn >> vec3<u32>(32u - bits);
    let zero = spread_zero_3d(seed);
    let low = cell * SPREAD_3D + zero;
    let high = select(low + SPREAD_3D, zero, cell == vec3<u32>((1u << bits) - 1u));
    return value_plus_one_3d(lattice_keys_3d(low), lattice_keys_3d(high), fade_fraction_3d(turn << vec3<u32>(bits)));
}

/// Six octaves of value noise in 3D on a torus, divided by the sum of the amplitudes: the cloud field. It is
/// `fbm_value_3d_periodic` with a period of 2^bits cells of octave 0 on each axis, at a position that is given in turns of
/// that period, 2^32 of them a whole one: wrapping, doubling and shifting are then integer operations of one instruction.
/// Without a loop it is cheaper, and a nested march does not run into the number of rounds after which a software device
/// ends all loops (65,535). `fall` is what the amplitude falls by from octave to octave (see `octave_fall`).
///
/// domain  turn in [0, 4294967295] turn/2^32 lin
/// domain  bits in [1, 16] 1 lin
/// domain  fall in [0.0625, 1] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::fractal::fbm_value_3d_torus_six
/// source  Leitner2022 8.2; departs: normalised, periodic lattice
fn fbm_value_3d_torus_six(turn: vec3<u32>, bits: u32, fall: f32, seed: u32) -> f32 {
    // SHIFT_3D of octave 0, in turns.
    let shift = vec3<u32>(11u, 13u, 25u) << vec3<u32>(26u - bits);
    let n0 = torus_octave_3d(turn, bits, seed);
    let n1 = torus_octave_3d(turn + (shift >> vec3<u32>(1u)), bits + 1u, octave_seed(seed, 1));
    let n2 = torus_octave_3d(turn + (shift >> vec3<u32>(2u)), bits + 2u, octave_seed(seed, 2));
    let n3 = torus_octave_3d(turn + (shift >> vec3<u32>(3u)), bits + 3u, octave_seed(seed, 3));
    let n4 = torus_octave_3d(turn + (shift >> vec3<u32>(4u)), bits + 4u, octave_seed(seed, 4));
    let n5 = torus_octave_3d(turn + (shift >> vec3<u32>(5u)), bits + 5u, octave_seed(seed, 5));
    let sum = n0 + fall * (n1 + fall * (n2 + fall * (n3 + fall * (n4 + fall * n5))));
    let total = 1.0 + fall * (1.0 + fall * (1.0 + fall * (1.0 + fall * (1.0 + fall))));
    return clamp(sum * (1.0 / total) - 1.0, 0.0, 1.0);
}
