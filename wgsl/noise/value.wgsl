//! Value noise: random numbers at the lattice points, joined by the quintic fade.
//!
//! The interpolant is a choice of ours, the source names none; with the quintic fade the second derivative is continuous.
//! In 2D sums of `a (1 - f) + b f` never leave [0, 1], not even by a rounding. In 3D the
//! corners' numbers are the 23 lowest bits of a word, taken as the fraction of a number in [1, 2) without any conversion.
//!
//! source   Leitner2022 3.6; Perlin2002 Improving noise (quintic fade)
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · seed selects one of 2^32 noises [1]
#define_import_path veduta::noise::value

#import veduta::hash::lattice::{lattice_hash_2d, SPREAD_3D, spread_3d, lattice_keys_3d, rows_of_keys_3d, words_of_rows_3d}
#import veduta::noise::lattice::{split_2d, split_3d, wrap_2d, wrap_3d, next_cell_2d, next_cell_3d, fade_2d, fade_3d, fade_slope_2d, fade_slope_3d}

// 2^-24: in 2D the corners' numbers are 24-bit integers until the very end.
const CORNER_UNIT: f32 = 5.9604644775390625e-8;

/// A corner's number in 2D, a 24-bit integer.
///
/// internal
fn corner_value_2d(x: i32, y: i32, seed: u32) -> f32 {
    return f32(bitcast<i32>(lattice_hash_2d(vec2<i32>(x, y), seed).x >> 8u));
}

/// The numbers of the four points of a lattice plane of constant x, each in [1, 2), from the keys of x and of the rows.
///
/// internal
fn plane_values_3d(x: u32, rows: vec4<u32>) -> vec4<f32> {
    return bitcast<vec4<f32>>((words_of_rows_3d(x, rows) & vec4<u32>(0x7fffffu)) | vec4<u32>(0x3f800000u));
}

/// Value noise plus 1 between the corners of a cell, from the keys of the lower and the higher coordinates.
/// `f` is the faded fraction.
///
/// internal
fn value_plus_one_3d(low: vec3<u32>, high: vec3<u32>, f: vec3<f32>) -> f32 {
    let rows = rows_of_keys_3d(low, high);
    let a = plane_values_3d(low.x, rows);
    let b = plane_values_3d(high.x, rows);
    let v = a + f.x * (b - a);
    let w = v.xz + f.y * (v.yw - v.xz);
    return w.x + f.z * (w.y - w.x);
}

/// Value noise between two opposite corners of a cell.
///
/// internal
fn value_between_3d(low: vec3<i32>, high: vec3<i32>, frac: vec3<f32>, seed: u32) -> f32 {
    let a = lattice_keys_3d(spread_3d(low, seed));
    let b = lattice_keys_3d(spread_3d(high, seed));
    return clamp(value_plus_one_3d(a, b, fade_3d(frac)) - 1.0, 0.0, 1.0);
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
    let low = spread_3d(p.cell, seed);
    let n = value_plus_one_3d(lattice_keys_3d(low), lattice_keys_3d(low + SPREAD_3D), fade_3d(p.frac));
    return clamp(n - 1.0, 0.0, 1.0);
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
    return value_between_3d(low, next_cell_3d(low, period), p.frac, seed);
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
    let a = lattice_keys_3d(spread_3d(low, seed));
    let b = lattice_keys_3d(spread_3d(high, seed));
    let rows = rows_of_keys_3d(a, b);
    let low_x = plane_values_3d(a.x, rows);
    let high_x = plane_values_3d(b.x, rows);
    let v = low_x * g.x + high_x * f.x;
    let w = v.xz * g.y + v.yw * f.y;
    let rise = high_x - low_x;
    let along_x = rise.xz * g.y + rise.yw * f.y;
    let along_y = v.yw - v.xz;
    let n = clamp(w.x * g.z + w.y * f.z - 1.0, 0.0, 1.0);
    return vec4<f32>(n, df.x * (along_x.x * g.z + along_x.y * f.z), df.y * (along_y.x * g.z + along_y.y * f.z), df.z * (w.y - w.x));
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
