//! Gradient (Perlin) noise: random unit vectors at the lattice points, joined by the quintic fade.
//!
//! The vectors are scaled so that the noise just fits in [-1, 1]. The largest noise is that of vectors which all point at
//! the sample: in 2D the weighted mean distance to the corners, largest in the middle of the cell, 1/sqrt(2), so that the
//! scale is sqrt(2); in 3D, with the directions there are, 0.72216 (the bound of any unit vectors is sqrt(3)/2), so that
//! the scale is 1.3847.
//!
//! 2D directions are uniform on the circle: 23 bits of the hash are an angle within an octant, three more choose the
//! octant. The sine is a polynomial of ours, because WGSL promises only 2^-11 for its own. 3D directions are the 24
//! vertices of the two icosahedra with axes along the lattice's: vectors (0, +-a, +-b) and their permutations with a/b the
//! golden ratio, a spherical 5-design. (The usual twelve edge centres are a 3-design: noise along the diagonals differs
//! from noise along the axes.)
//!
//! source   Leitner2022 3.7; Perlin2002 Improving noise
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · seed selects one of 2^32 noises [1]
#define_import_path veduta::noise::gradient

#import veduta::hash::lattice::{lattice_hash_2d, lattice_words_2d, lattice_word_3d, SPREAD_3D, spread_3d, lattice_keys_3d, rows_of_keys_3d, words_of_rows_3d}
#import veduta::noise::lattice::{Lattice2d, Lattice3d, split_2d, split_3d, wrap_2d, wrap_3d, next_cell_2d, next_cell_3d, fade_2d, fade_3d, fade_slope_2d, fade_slope_3d}

const SIGN: u32 = 2147483648u;
// The icosahedron's two coordinates times 1.3847, 1.17789617 and 0.72797987, as bits.
const LONG_SIDE: u32 = 0x3f96c54du;
const SHORT_SIDE: u32 = 0x3f3a5ce4u;

/// Four vectors in 2D.
struct Vectors2d {
    x: vec4<f32>,
    y: vec4<f32>,
}

/// Random directions from words, length sqrt(2).
///
/// sqrt(2) sin(pi/4 u) over an octant is u plus a minimax polynomial, so that there is one rounding of its size; the
/// cosine follows from the length.
///
/// internal
fn directions_2d(words: vec4<u32>) -> Vectors2d {
    let u = bitcast<vec4<f32>>((words >> vec4<u32>(9u)) | vec4<u32>(0x3f800000u)) - 1.0;
    let q = u * u;
    let short = u + u * (q * (q * (q * -5.0847045569e-5 + 0.00352140138907) - 0.114191288864) + 0.110720731116);
    let long = sqrt(2.0 - short * short);
    let swap = (words & vec4<u32>(4u)) != vec4<u32>(0u);
    return Vectors2d(
        bitcast<vec4<f32>>(bitcast<vec4<u32>>(select(long, short, swap)) ^ (words << vec4<u32>(31u))),
        bitcast<vec4<f32>>(bitcast<vec4<u32>>(select(short, long, swap)) ^ ((words << vec4<u32>(30u)) & vec4<u32>(SIGN))),
    );
}

/// The vector at a lattice point in 2D: a random direction, length sqrt(2).
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.4142136, 1.4142136] 1
/// error   1.5e-7 abs of reference::noise::lattice_gradient_2d
/// source  Leitner2022 3.7
fn lattice_gradient_2d(cell: vec2<i32>, seed: u32) -> vec2<f32> {
    let v = directions_2d(vec4<u32>(lattice_hash_2d(cell, seed).x));
    return vec2<f32>(v.x.x, v.y.x);
}

/// The vector at a lattice point in 3D: one of 24 directions, length 1.3847.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.178, 1.178] 1
/// error   6e-8 abs of reference::noise::lattice_gradient_3d
/// source  Leitner2022 3.7; departs: 24 directions
fn lattice_gradient_3d(cell: vec3<i32>, seed: u32) -> vec3<f32> {
    let word = lattice_word_3d(cell, seed);
    let swap = (LONG_SIDE ^ SHORT_SIDE) & bitcast<u32>(bitcast<i32>(word << 11u) >> 31u);
    let p = LONG_SIDE ^ swap ^ ((word << 9u) & SIGN);
    let q = SHORT_SIDE ^ swap ^ ((word << 10u) & SIGN);
    // Thirds of the 20 bits below say which component is 0. Signs of differences make masks, which cost less than choosing.
    let share = bitcast<i32>(word & 0xfffffu);
    let first = bitcast<u32>((share - 349526) >> 31u);
    let third = bitcast<u32>((699050 - share) >> 31u);
    let second = ~(first | third);
    return bitcast<vec3<f32>>(vec3<u32>((q & second) | (p & third), (p & first) | (q & third), (q & first) | (p & second)));
}

/// Gradient noise at a normalised 2D position.
///
/// internal
fn gradient_at_2d(p: Lattice2d, seed: u32) -> f32 {
    let t = p.frac;
    let s = t - 1.0;
    let v = directions_2d(lattice_words_2d(p.cell, p.cell + 1, seed));
    let n = v.x * vec4<f32>(t.x, s.x, t.x, s.x) + v.y * vec4<f32>(t.y, t.y, s.y, s.y);
    let f = fade_2d(t);
    let g = 1.0 - f;
    let m = n.xz * g.x + n.yw * f.x;
    return m.x * g.y + m.y * f.y;
}

/// Gradient noise in 2D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   4e-7 abs of reference::noise::gradient_noise_2d
/// source  Leitner2022 3.7
fn gradient_noise_2d(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> f32 {
    return gradient_at_2d(split_2d(cell, frac), seed);
}

/// The noises of the vectors at four points of a lattice plane of constant x: `dx`, `dy` and `dz` lead from the points to
/// the sample. Of the vector's three coordinates one is 0 and is left out; which, is decided as in `lattice_gradient_3d`.
///
/// internal
fn plane_noises_3d(words: vec4<u32>, dx: f32, dy: vec4<f32>, dz: vec4<f32>) -> vec4<f32> {
    let swap = vec4<u32>(LONG_SIDE ^ SHORT_SIDE) & bitcast<vec4<u32>>(bitcast<vec4<i32>>(words << vec4<u32>(11u)) >> vec4<u32>(31u));
    let p = bitcast<vec4<f32>>(vec4<u32>(LONG_SIDE) ^ swap ^ ((words << vec4<u32>(9u)) & vec4<u32>(SIGN)));
    let q = bitcast<vec4<f32>>(vec4<u32>(SHORT_SIDE) ^ swap ^ ((words << vec4<u32>(10u)) & vec4<u32>(SIGN)));
    let share = words & vec4<u32>(0xfffffu);
    let first = share < vec4<u32>(349526u);
    let third = share > vec4<u32>(699050u);
    let x = vec4<f32>(dx);
    return p * select(select(dz, x, third), dy, first) + q * select(select(x, dy, third), dz, first);
}

/// Gradient noise at a normalised 3D position.
///
/// internal
fn gradient_at_3d(p: Lattice3d, seed: u32) -> f32 {
    let t = p.frac;
    let s = t - 1.0;
    let spread = spread_3d(p.cell, seed);
    let low = lattice_keys_3d(spread);
    let high = lattice_keys_3d(spread + SPREAD_3D);
    let rows = rows_of_keys_3d(low, high);
    let dy = vec4<f32>(t.y, s.y, t.y, s.y);
    let dz = vec4<f32>(t.z, t.z, s.z, s.z);
    let a = plane_noises_3d(words_of_rows_3d(low.x, rows), t.x, dy, dz);
    let b = plane_noises_3d(words_of_rows_3d(high.x, rows), s.x, dy, dz);
    let f = fade_3d(t);
    let g = 1.0 - f;
    let n = a * g.x + b * f.x;
    let m = n.xz * g.y + n.yw * f.y;
    return m.x * g.z + m.y * f.z;
}

/// Gradient noise in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   5e-7 abs of reference::noise::gradient_noise_3d
/// source  Leitner2022 3.7; departs: 24 directions
fn gradient_noise_3d(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> f32 {
    return gradient_at_3d(split_3d(cell, frac), seed);
}

/// Gradient noise and its gradient between two opposite corners of a 2D cell, which need not be neighbours.
///
/// internal
fn gradient_between_2d_slope(low: vec2<i32>, high: vec2<i32>, t: vec2<f32>, seed: u32) -> vec3<f32> {
    let s = t - 1.0;
    let v = directions_2d(lattice_words_2d(low, high, seed));
    let n = v.x * vec4<f32>(t.x, s.x, t.x, s.x) + v.y * vec4<f32>(t.y, t.y, s.y, s.y);
    let f = fade_2d(t);
    let g = 1.0 - f;
    let m = n.xz * g.x + n.yw * f.x;
    let rise = n.yw - n.xz;
    let across = vec2<f32>(rise.x * g.y + rise.y * f.y, m.y - m.x);
    let along_x = v.x.xz * g.x + v.x.yw * f.x;
    let along_y = v.y.xz * g.x + v.y.yw * f.x;
    let mean = vec2<f32>(along_x.x, along_y.x) * g.y + vec2<f32>(along_x.y, along_y.y) * f.y;
    return vec3<f32>(m.x * g.y + m.y * f.y, mean + fade_slope_2d(t) * across);
}

/// Gradient noise and its gradient at a normalised 2D position.
///
/// internal
fn gradient_at_2d_slope(p: Lattice2d, seed: u32) -> vec3<f32> {
    return gradient_between_2d_slope(p.cell, p.cell + 1, p.frac, seed);
}

/// Gradient noise in 2D and its gradient: (value, d/dx, d/dy), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-6, 6] 1
/// error   1.5e-6 abs of reference::noise::gradient_noise_2d_slope
/// source  Leitner2022 3.7; Quilez2017 Gradient noise derivatives
fn gradient_noise_2d_slope(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    return gradient_at_2d_slope(split_2d(cell, frac), seed);
}

/// Gradient noise and its gradient between two opposite corners of a 3D cell, which need not be neighbours.
///
/// internal
fn gradient_between_3d_slope(low: vec3<i32>, high: vec3<i32>, t: vec3<f32>, seed: u32) -> vec4<f32> {
    let s = t - 1.0;
    let g000 = lattice_gradient_3d(low, seed);
    let g100 = lattice_gradient_3d(vec3<i32>(high.x, low.y, low.z), seed);
    let g010 = lattice_gradient_3d(vec3<i32>(low.x, high.y, low.z), seed);
    let g110 = lattice_gradient_3d(vec3<i32>(high.x, high.y, low.z), seed);
    let g001 = lattice_gradient_3d(vec3<i32>(low.x, low.y, high.z), seed);
    let g101 = lattice_gradient_3d(vec3<i32>(high.x, low.y, high.z), seed);
    let g011 = lattice_gradient_3d(vec3<i32>(low.x, high.y, high.z), seed);
    let g111 = lattice_gradient_3d(high, seed);
    let n000 = dot(g000, t);
    let n100 = dot(g100, vec3<f32>(s.x, t.y, t.z));
    let n010 = dot(g010, vec3<f32>(t.x, s.y, t.z));
    let n110 = dot(g110, vec3<f32>(s.x, s.y, t.z));
    let n001 = dot(g001, vec3<f32>(t.x, t.y, s.z));
    let n101 = dot(g101, vec3<f32>(s.x, t.y, s.z));
    let n011 = dot(g011, vec3<f32>(t.x, s.y, s.z));
    let n111 = dot(g111, s);
    let f = fade_3d(t);
    let g = 1.0 - f;
    let n00 = n000 * g.x + n100 * f.x;
    let n10 = n010 * g.x + n110 * f.x;
    let n01 = n001 * g.x + n101 * f.x;
    let n11 = n011 * g.x + n111 * f.x;
    let n0 = n00 * g.y + n10 * f.y;
    let n1 = n01 * g.y + n11 * f.y;
    let along_x0 = (n100 - n000) * g.y + (n110 - n010) * f.y;
    let along_x1 = (n101 - n001) * g.y + (n111 - n011) * f.y;
    let across = vec3<f32>(
        along_x0 * g.z + along_x1 * f.z,
        (n10 - n00) * g.z + (n11 - n01) * f.z,
        n1 - n0,
    );
    let mean0 = (g000 * g.x + g100 * f.x) * g.y + (g010 * g.x + g110 * f.x) * f.y;
    let mean1 = (g001 * g.x + g101 * f.x) * g.y + (g011 * g.x + g111 * f.x) * f.y;
    return vec4<f32>(n0 * g.z + n1 * f.z, mean0 * g.z + mean1 * f.z + fade_slope_3d(t) * across);
}

/// Gradient noise and its gradient at a normalised 3D position.
///
/// internal
fn gradient_at_3d_slope(p: Lattice3d, seed: u32) -> vec4<f32> {
    return gradient_between_3d_slope(p.cell, p.cell + 1, p.frac, seed);
}

/// Gradient noise in 3D and its gradient: (value, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-8, 8] 1
/// error   1.5e-6 abs of reference::noise::gradient_noise_3d_slope
/// source  Leitner2022 3.7; Quilez2017 Gradient noise derivatives
fn gradient_noise_3d_slope(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    return gradient_at_3d_slope(split_3d(cell, frac), seed);
}

/// Gradient noise in 2D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   4e-7 abs of reference::noise::gradient_noise_2d_periodic
/// source  Leitner2022 3.7; departs: periodic lattice
fn gradient_noise_2d_periodic(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> f32 {
    return gradient_noise_2d_periodic_slope(cell, frac, period, seed).x;
}

/// Gradient noise in 2D on a lattice that repeats after `period` cells on each axis, and its gradient: (value, d/dx, d/dy),
/// per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-6, 6] 1
/// error   1.5e-6 abs of reference::noise::gradient_noise_2d_periodic_slope
/// source  Leitner2022 3.7; Quilez2017 Gradient noise derivatives; departs: periodic lattice
fn gradient_noise_2d_periodic_slope(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec3<f32> {
    let p = split_2d(cell, frac);
    let low = wrap_2d(p.cell, period);
    return gradient_between_2d_slope(low, next_cell_2d(low, period), p.frac, seed);
}

/// Gradient noise in 3D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   5e-7 abs of reference::noise::gradient_noise_3d_periodic
/// source  Leitner2022 3.7; departs: 24 directions, periodic lattice
fn gradient_noise_3d_periodic(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> f32 {
    return gradient_noise_3d_periodic_slope(cell, frac, period, seed).x;
}

/// Gradient noise in 3D on a lattice that repeats after `period` cells on each axis, and its gradient: (value, d/dx, d/dy,
/// d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-8, 8] 1
/// error   1.5e-6 abs of reference::noise::gradient_noise_3d_periodic_slope
/// source  Leitner2022 3.7; Quilez2017 Gradient noise derivatives; departs: 24 directions, periodic lattice
fn gradient_noise_3d_periodic_slope(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec4<f32> {
    let p = split_3d(cell, frac);
    let low = wrap_3d(p.cell, period);
    return gradient_between_3d_slope(low, next_cell_3d(low, period), p.frac, seed);
}
