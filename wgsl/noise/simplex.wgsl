//! Simplex noise: random vectors at the corners of triangles and tetrahedra, each within a round bump of its own.
//!
//! The lattices are those whose corners have whole or half coordinates, so that the noise is as exact far out as at the
//! origin and repeats after whole periods; the classic skewed lattice does neither.
//!
//! 2D: rows one cell apart, each shifted by half a cell against the next: triangles of base 1 and height 1 (regular ones
//! are 0.866 high). Two rows make one period along y. A bump (4/5 - r^2)^4 ends at the sides of its corner's triangles.
//!
//! 3D: the body-centred cubic lattice, corners and centres of all cells, whose tetrahedra are all alike; it is the
//! classic simplex lattice turned. In a cell, the centre and the centre across the nearest face are two corners of the
//! tetrahedron, the other two are the ends of that face's edge which is nearest. A bump is (1/2 - r^2)^4.
//!
//! The scales fit the noise into [-1, 1]: bumps with vectors that all point at the sample give 1 in the worst place, the
//! middle of a row's edge in 2D. Value, gradient and second derivative are continuous.
//!
//! source   Perlin2001 Noise hardware; Gustavson2022 Tiling simplex noise (the 2D lattice); departs: the search in 3D is ours
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · seed selects one of 2^32 noises [1]
#define_import_path veduta::noise::simplex

#import veduta::noise::lattice::{Lattice2d, Lattice3d, split_2d, split_3d, wrap_2d, wrap_3d, wrap_near_2d, wrap_near_3d}
#import veduta::noise::gradient::{lattice_gradient_2d, lattice_gradient_3d}

const SCALE_2D: f32 = 7.7274;
const SCALE_3D: f32 = 78.52;
// What the seed of the cells' centres differs by from that of their corners.
const CENTRES: u32 = 1540483477u;

/// A corner's bump with its gradient in 2D; d is the way from the corner.
///
/// internal
fn bump_2d(cell: vec2<i32>, d: vec2<f32>, seed: u32) -> vec3<f32> {
    let g = lattice_gradient_2d(cell, seed);
    let t = max(0.8 - dot(d, d), 0.0);
    let along = dot(g, d);
    let cube = t * t * t;
    return vec3<f32>(cube * t * along, cube * (t * g - 8.0 * along * d));
}

/// A corner's bump with its gradient in 3D; d is the way from the corner.
///
/// internal
fn bump_3d(cell: vec3<i32>, d: vec3<f32>, seed: u32) -> vec4<f32> {
    let g = lattice_gradient_3d(cell, seed);
    let t = max(0.5 - dot(d, d), 0.0);
    let along = dot(g, d);
    let cube = t * t * t;
    return vec4<f32>(cube * t * along, cube * (t * g - 8.0 * along * d));
}

/// Simplex noise and its gradient at a normalised 2D position; a `size` of 0 is a lattice that does not repeat.
///
/// internal
fn simplex_at_2d_slope(p: Lattice2d, size: vec2<i32>, seed: u32) -> vec3<f32> {
    // Corner (i, j) of the skewed lattice lies at (i - (odd + j) / 2, j) from the cell, odd being that of the cell's row;
    // it belongs to column i - (odd and j), row j.
    let odd = p.cell.y & 1;
    let half = 0.5 * f32(odd);
    let skewed = p.frac.x + half + 0.5 * p.frac.y;
    let beyond = skewed >= 1.0;
    let i = select(0, 1, beyond);
    let near = vec2<f32>(p.frac.x - (select(0.0, 1.0, beyond) - half), p.frac.y);
    let right = skewed - select(0.0, 1.0, beyond) > p.frac.y;
    let n0 = bump_2d(wrap_near_2d(p.cell + vec2<i32>(i, 0), size), near, seed);
    let side = select(vec2<i32>(i - odd, 1), vec2<i32>(i + 1, 0), right);
    let from_side = near - select(vec2<f32>(-0.5, 1.0), vec2<f32>(1.0, 0.0), right);
    let n1 = bump_2d(wrap_near_2d(p.cell + side, size), from_side, seed);
    let n2 = bump_2d(wrap_near_2d(p.cell + vec2<i32>(i + 1 - odd, 1), size), near - vec2<f32>(0.5, 1.0), seed);
    return SCALE_2D * (n0 + n1 + n2);
}

/// Simplex noise and its gradient at a normalised 3D position; a `size` of 0 is a lattice that does not repeat.
///
/// internal
fn simplex_at_3d_slope(p: Lattice3d, size: vec3<i32>, seed: u32) -> vec4<f32> {
    let s = p.frac - 0.5;
    let t = abs(s);
    let xy = t.x >= t.y;
    let xz = t.x >= t.z;
    let yz = t.y >= t.z;
    let largest = vec3<bool>(xy & xz, !xy & yz, !xz & !yz);
    let smallest = vec3<bool>(!xy & !xz, xy & !yz, xz & yz);
    let above = s >= vec3<f32>(0.0);
    let corner = select(vec3<i32>(0), vec3<i32>(1), above);
    let side = select(vec3<f32>(-1.0), vec3<f32>(1.0), above);
    let across = select(vec3<i32>(0), corner + corner - 1, largest);
    let other = select(corner, 1 - corner, smallest);
    let from_across = s - select(vec3<f32>(0.0), side, largest);
    let from_corner = s - 0.5 * side;
    let from_other = select(from_corner, s + 0.5 * side, smallest);
    let n0 = bump_3d(p.cell, s, seed + CENTRES);
    let n1 = bump_3d(wrap_near_3d(p.cell + across, size), from_across, seed + CENTRES);
    let n2 = bump_3d(wrap_near_3d(p.cell + corner, size), from_corner, seed);
    let n3 = bump_3d(wrap_near_3d(p.cell + other, size), from_other, seed);
    return SCALE_3D * ((n0 + n1) + (n2 + n3));
}

/// Simplex noise in 2D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::noise::simplex::simplex_noise_2d
/// source  Gustavson2022 2D
fn simplex_noise_2d(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> f32 {
    return simplex_noise_2d_slope(cell, frac, seed).x;
}

/// Simplex noise in 2D and its gradient: (value, d/dx, d/dy), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-5.3, 5.3] 1
/// error   4e-6 abs of reference::noise::simplex::simplex_noise_2d_slope
/// source  Gustavson2022 2D
fn simplex_noise_2d_slope(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    return simplex_at_2d_slope(split_2d(cell, frac), vec2<i32>(0), seed);
}

/// Simplex noise in 2D on a lattice that repeats after `period` cells on each axis.
///
/// Along y, an odd period counts as the next even number.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::noise::simplex::simplex_noise_2d_periodic
/// source  Gustavson2022 2D
fn simplex_noise_2d_periodic(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> f32 {
    return simplex_noise_2d_periodic_slope(cell, frac, period, seed).x;
}

/// Simplex noise in 2D on a lattice that repeats after `period` cells on each axis, and its gradient:
/// (value, d/dx, d/dy), per cell.
///
/// Along y, an odd period counts as the next even number.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-5.3, 5.3] 1
/// error   4e-6 abs of reference::noise::simplex::simplex_noise_2d_periodic_slope
/// source  Gustavson2022 2D
fn simplex_noise_2d_periodic_slope(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec3<f32> {
    let size = vec2<i32>(period.x, period.y + (period.y & 1));
    let p = split_2d(cell, frac);
    return simplex_at_2d_slope(Lattice2d(wrap_2d(p.cell, size), p.frac), size, seed);
}

/// Simplex noise in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::noise::simplex::simplex_noise_3d
/// source  Perlin2001; departs: the lattice turned, 24 directions
fn simplex_noise_3d(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> f32 {
    return simplex_noise_3d_slope(cell, frac, seed).x;
}

/// Simplex noise in 3D and its gradient: (value, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-5.8, 5.8] 1
/// error   4e-6 abs of reference::noise::simplex::simplex_noise_3d_slope
/// source  Perlin2001; departs: the lattice turned, 24 directions
fn simplex_noise_3d_slope(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    return simplex_at_3d_slope(split_3d(cell, frac), vec3<i32>(0), seed);
}

/// Simplex noise in 3D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::noise::simplex::simplex_noise_3d_periodic
/// source  Perlin2001; departs: the lattice turned, 24 directions, periodic
fn simplex_noise_3d_periodic(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> f32 {
    return simplex_noise_3d_periodic_slope(cell, frac, period, seed).x;
}

/// Simplex noise in 3D on a lattice that repeats after `period` cells on each axis, and its gradient:
/// (value, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-5.8, 5.8] 1
/// error   4e-6 abs of reference::noise::simplex::simplex_noise_3d_periodic_slope
/// source  Perlin2001; departs: the lattice turned, 24 directions, periodic
fn simplex_noise_3d_periodic_slope(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec4<f32> {
    let p = split_3d(cell, frac);
    return simplex_at_3d_slope(Lattice3d(wrap_3d(p.cell, period), p.frac), period, seed);
}
