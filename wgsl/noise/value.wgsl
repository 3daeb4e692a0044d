//! Value noise: random numbers at the lattice points, joined by the quintic fade.
//!
//! The interpolant is a choice of ours, the source names none; with the quintic fade the second derivative is continuous.
//! In 2D sums of `a (1 - f) + b f` never leave [0, 1], not even by a rounding. In 3D the
//! corners' numbers are the 23 lowest bits of a word, taken as the fraction of a number in [1, 2) without any conversion.
//!
//! source   Leitner2022 3.6; Perlin2002 Improving noise (quintic fade)
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · seed selects one of 2^32 noises [1]
#define_import_path veduta::noise::value

#import veduta::hash::lattice::{lattice_hash_2d, lattice_word_3d}
#import veduta::noise::lattice::{split_2d, split_3d, wrap_2d, wrap_3d, next_cell_2d, next_cell_3d, fade_2d, fade_3d, fade_slope_2d, fade_slope_3d}

// 2^-24: in 2D the corners' numbers are 24-bit integers until the very end.
const CORNER_UNIT: f32 = 5.9604644775390625e-8;

/// A corner's number in 2D, a 24-bit integer.
///
/// internal
fn corner_value_2d(x: i32, y: i32, seed: u32) -> f32 {
    return f32(bitcast<i32>(lattice_hash_2d(vec2<i32>(x, y), seed).x >> 8u));
}

/// A corner's number in 3D, in [1, 2).
///
/// internal
fn corner_value_3d(x: i32, y: i32, z: i32, seed: u32) -> f32 {
    return bitcast<f32>((lattice_word_3d(vec3<i32>(x, y, z), seed) & 0x7fffffu) | 0x3f800000u);
}

/// Value noise plus 1 between two opposite corners of a cell, which need not be neighbours: periodic lattices wrap them.
/// `f` is the faded fraction.
///
/// internal
fn value_plus_one_3d(low: vec3<i32>, high: vec3<i32>, f: vec3<f32>, seed: u32) -> f32 {
    let a00 = corner_value_3d(low.x, low.y, low.z, seed);
    let a10 = corner_value_3d(low.x, high.y, low.z, seed);
    let a01 = corner_value_3d(low.x, low.y, high.z, seed);
    let a11 = corner_value_3d(low.x, high.y, high.z, seed);
    let v00 = a00 + f.x * (corner_value_3d(high.x, low.y, low.z, seed) - a00);
    let v10 = a10 + f.x * (corner_value_3d(high.x, high.y, low.z, seed) - a10);
    let v01 = a01 + f.x * (corner_value_3d(high.x, low.y, high.z, seed) - a01);
    let v11 = a11 + f.x * (corner_value_3d(high.x, high.y, high.z, seed) - a11);
    let v0 = v00 + f.y * (v10 - v00);
    let v1 = v01 + f.y * (v11 - v01);
    return v0 + f.z * (v1 - v0);
}

/// Value noise between two opposite corners of a cell.
///
/// internal
fn value_between_3d(low: vec3<i32>, high: vec3<i32>, frac: vec3<f32>, seed: u32) -> f32 {
    return clamp(value_plus_one_3d(low, high, fade_3d(frac), seed) - 1.0, 0.0, 1.0);
}

/// Value noise in 2D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::noise::value_noise_2d
/// source  Leitner2022 3.6
fn value_noise_2d(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> f32 {
    let p = split_2d(cell, frac);
    let c = p.cell;
    let f = fade_2d(p.frac);
    let g = 1.0 - f;
    let v0 = corner_value_2d(c.x, c.y, seed) * g.x + corner_value_2d(c.x + 1, c.y, seed) * f.x;
    let v1 = corner_value_2d(c.x, c.y + 1, seed) * g.x + corner_value_2d(c.x + 1, c.y + 1, seed) * f.x;
    return (v0 * g.y + v1 * f.y) * CORNER_UNIT;
}

/// Value noise in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::noise::value_noise_3d
/// source  Leitner2022 3.6
fn value_noise_3d(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> f32 {
    let p = split_3d(cell, frac);
    return value_between_3d(p.cell, p.cell + 1, p.frac, seed);
}

/// Value noise in 3D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::noise::value_noise_3d_periodic
/// source  Leitner2022 3.6; departs: periodic lattice
fn value_noise_3d_periodic(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> f32 {
    let p = split_3d(cell, frac);
    let low = wrap_3d(p.cell, period);
    let next = low + 1;
    return value_between_3d(low, select(next, vec3<i32>(0), next >= period), p.frac, seed);
}

/// Value noise and its gradient between two opposite corners of a 2D cell, which need not be neighbours.
///
/// internal
fn value_between_2d_slope(low: vec2<i32>, high: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    let f = fade_2d(frac);
    let g = 1.0 - f;
    let df = fade_slope_2d(frac);
    let v00 = corner_value_2d(low.x, low.y, seed);
    let v10 = corner_value_2d(high.x, low.y, seed);
    let v01 = corner_value_2d(low.x, high.y, seed);
    let v11 = corner_value_2d(high.x, high.y, seed);
    let v0 = v00 * g.x + v10 * f.x;
    let v1 = v01 * g.x + v11 * f.x;
    let along_x = (v10 - v00) * g.y + (v11 - v01) * f.y;
    return vec3<f32>(v0 * g.y + v1 * f.y, df.x * along_x, df.y * (v1 - v0)) * CORNER_UNIT;
}

/// Value noise in 2D and its gradient: (value, d/dx, d/dy), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.875, 1.875] 1
/// error   1e-6 abs of reference::noise::value_noise_2d_slope
/// source  Leitner2022 3.6; Quilez2008 Value noise derivatives
fn value_noise_2d_slope(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    let p = split_2d(cell, frac);
    return value_between_2d_slope(p.cell, p.cell + 1, p.frac, seed);
}

/// Value noise in 2D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::noise::value_noise_2d_periodic
/// source  Leitner2022 3.6; departs: periodic lattice
fn value_noise_2d_periodic(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> f32 {
    return value_noise_2d_periodic_slope(cell, frac, period, seed).x;
}

/// Value noise in 2D on a lattice that repeats after `period` cells on each axis, and its gradient: (value, d/dx, d/dy),
/// per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.875, 1.875] 1
/// error   1e-6 abs of reference::noise::value_noise_2d_periodic_slope
/// source  Leitner2022 3.6; Quilez2008 Value noise derivatives; departs: periodic lattice
fn value_noise_2d_periodic_slope(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec3<f32> {
    let p = split_2d(cell, frac);
    let low = wrap_2d(p.cell, period);
    return value_between_2d_slope(low, next_cell_2d(low, period), p.frac, seed);
}

/// Value noise and its gradient between two opposite corners of a 3D cell, which need not be neighbours.
///
/// internal
fn value_between_3d_slope(low: vec3<i32>, high: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    let f = fade_3d(frac);
    let g = 1.0 - f;
    let df = fade_slope_3d(frac);
    let v000 = corner_value_3d(low.x, low.y, low.z, seed);
    let v100 = corner_value_3d(high.x, low.y, low.z, seed);
    let v010 = corner_value_3d(low.x, high.y, low.z, seed);
    let v110 = corner_value_3d(high.x, high.y, low.z, seed);
    let v001 = corner_value_3d(low.x, low.y, high.z, seed);
    let v101 = corner_value_3d(high.x, low.y, high.z, seed);
    let v011 = corner_value_3d(low.x, high.y, high.z, seed);
    let v111 = corner_value_3d(high.x, high.y, high.z, seed);
    let v00 = v000 * g.x + v100 * f.x;
    let v10 = v010 * g.x + v110 * f.x;
    let v01 = v001 * g.x + v101 * f.x;
    let v11 = v011 * g.x + v111 * f.x;
    let v0 = v00 * g.y + v10 * f.y;
    let v1 = v01 * g.y + v11 * f.y;
    let along_x0 = (v100 - v000) * g.y + (v110 - v010) * f.y;
    let along_x1 = (v101 - v001) * g.y + (v111 - v011) * f.y;
    let along_x = along_x0 * g.z + along_x1 * f.z;
    let along_y = (v10 - v00) * g.z + (v11 - v01) * f.z;
    let n = clamp(v0 * g.z + v1 * f.z - 1.0, 0.0, 1.0);
    return vec4<f32>(n, df.x * along_x, df.y * along_y, df.z * (v1 - v0));
}

/// Value noise in 3D and its gradient: (value, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.875, 1.875] 1
/// error   1e-6 abs of reference::noise::value_noise_3d_slope
/// source  Leitner2022 3.6; Quilez2008 Value noise derivatives
fn value_noise_3d_slope(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    let p = split_3d(cell, frac);
    return value_between_3d_slope(p.cell, p.cell + 1, p.frac, seed);
}

/// Value noise in 3D on a lattice that repeats after `period` cells on each axis, and its gradient: (value, d/dx, d/dy,
/// d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.875, 1.875] 1
/// error   1e-6 abs of reference::noise::value_noise_3d_periodic_slope
/// source  Leitner2022 3.6; Quilez2008 Value noise derivatives; departs: periodic lattice
fn value_noise_3d_periodic_slope(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec4<f32> {
    let p = split_3d(cell, frac);
    let low = wrap_3d(p.cell, period);
    return value_between_3d_slope(low, next_cell_3d(low, period), p.frac, seed);
}
