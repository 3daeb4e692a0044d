//! Worley (cellular) noise: distances to the nearest of scattered points, one in every cell of the lattice.
//!
//! The search is exact. All points nearer than 1 + e lie in the 3^n cells about the sample, e being its distance from the
//! nearest face of its own cell; where a result is farther than that, 5^n cells are searched, which hold all nearer than 2.
//! That is enough for the two nearest: in 2D they are never farther than sqrt(2) and sqrt(5/2), in 3D both not farther than
//! sqrt(3), as the sample's own cell and the next one across its nearest face have a point each.
//!
//! In 2D a point's two coordinates are the upper 23 bits of two hashes. In 3D one word of 23 bits gives all three: it and
//! its multiples modulo 2^23 make a lattice of 2^23 points that fills the cell evenly (its shortest dual vectors are at
//! least 0.82 as long as those of the best lattices there are, in the cell and on its faces).
//!
//! A distance has a kink where two points are equally far, and a tip at a point, where its gradient counts as 0.
//!
//! source   Worley1996 A cellular texture basis function; departs: one point a cell, exact search
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · seed selects one of 2^32 noises [1]
#define_import_path veduta::noise::worley

#import veduta::hash::lattice::{lattice_hash_2d, lattice_word_3d}
#import veduta::noise::lattice::{Lattice2d, Lattice3d, split_2d, split_3d, wrap_2d, wrap_3d, wrap_near_2d, wrap_near_3d}

const POINT_Y: u32 = 6433001u;
const POINT_Z: u32 = 2396377u;
// Farther than any point.
const FAR: f32 = 100.0;
const TINY: f32 = 1e-20;

/// The two nearest points in 2D: where the sample lies from them, and the square of the distance.
struct Nearest2d {
    /// From the nearest point (x, y), squared distance [cell].
    first: vec3<f32>,
    /// The same of the second nearest.
    second: vec3<f32>,
}

/// The two nearest points in 3D: where the sample lies from them, and the square of the distance.
struct Nearest3d {
    /// From the nearest point (x, y, z), squared distance [cell].
    first: vec4<f32>,
    /// The same of the second nearest.
    second: vec4<f32>,
}

/// The scattered point of a 2D cell, as a position within it.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1) cell
/// error   0 abs of reference::noise::worley::cell_point_2d
/// source  Worley1996
fn cell_point_2d(cell: vec2<i32>, seed: u32) -> vec2<f32> {
    let words = lattice_hash_2d(cell, seed);
    return bitcast<vec2<f32>>((words >> vec2<u32>(9u)) | vec2<u32>(0x3f800000u)) - 1.0;
}

/// The scattered point of a 3D cell, as a position within it.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1) cell
/// error   0 abs of reference::noise::worley::cell_point_3d
/// source  Worley1996; the three coordinates of one word are ours
fn cell_point_3d(cell: vec3<i32>, seed: u32) -> vec3<f32> {
    let words = lattice_word_3d(cell, seed) * vec3<u32>(1u, POINT_Y, POINT_Z);
    return bitcast<vec3<f32>>((words & vec3<u32>(0x7fffffu)) | vec3<u32>(0x3f800000u)) - 1.0;
}

/// The two nearest points of the cells up to `reach` away; a `size` of 0 is a lattice that does not repeat.
///
/// internal
fn nearest_within_2d(p: Lattice2d, size: vec2<i32>, reach: i32, seed: u32) -> Nearest2d {
    var best = Nearest2d(vec3<f32>(FAR), vec3<f32>(FAR));
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let offset = vec2<i32>(x, y);
            let point = cell_point_2d(wrap_near_2d(p.cell + offset, size), seed);
            // The sum is exact where a point is near, so that small differences keep all their digits.
            let d = p.frac - (vec2<f32>(offset) + point);
            let found = vec3<f32>(d, dot(d, d));
            let first = found.z < best.first.z;
            let second = select(best.second, found, found.z < best.second.z);
            best.second = select(second, best.first, first);
            best.first = select(best.first, found, first);
        }
    }
    return best;
}

/// The two nearest points of the cells up to `reach` away in 3D; a `size` of 0 is a lattice that does not repeat.
///
/// internal
fn nearest_within_3d(p: Lattice3d, size: vec3<i32>, reach: i32, seed: u32) -> Nearest3d {
    var best = Nearest3d(vec4<f32>(FAR), vec4<f32>(FAR));
    for (var z = -reach; z <= reach; z++) {
        for (var y = -reach; y <= reach; y++) {
            for (var x = -reach; x <= reach; x++) {
                let offset = vec3<i32>(x, y, z);
                let point = cell_point_3d(wrap_near_3d(p.cell + offset, size), seed);
                let d = p.frac - (vec3<f32>(offset) + point);
                let found = vec4<f32>(d, dot(d, d));
                let first = found.w < best.first.w;
                let second = select(best.second, found, found.w < best.second.w);
                best.second = select(second, best.first, first);
                best.first = select(best.first, found, first);
            }
        }
    }
    return best;
}

/// The nearest points of a normalised 2D position; the second nearest is certain only if `both`.
///
/// internal
fn nearest_points_2d(p: Lattice2d, size: vec2<i32>, both: bool, seed: u32) -> Nearest2d {
    let near = nearest_within_2d(p, size, 1, seed);
    let inside = min(p.frac, 1.0 - p.frac);
    let certain = 1.0 + min(inside.x, inside.y);
    if (select(near.first.z, near.second.z, both) > certain * certain) {
        return nearest_within_2d(p, size, 2, seed);
    }
    return near;
}

/// The nearest points of a normalised 3D position; the second nearest is certain only if `both`.
///
/// internal
fn nearest_points_3d(p: Lattice3d, size: vec3<i32>, both: bool, seed: u32) -> Nearest3d {
    let near = nearest_within_3d(p, size, 1, seed);
    let inside = min(p.frac, 1.0 - p.frac);
    let certain = 1.0 + min(inside.x, min(inside.y, inside.z));
    if (select(near.first.w, near.second.w, both) > certain * certain) {
        return nearest_within_3d(p, size, 2, seed);
    }
    return near;
}

/// A distance with its gradient, a unit vector away from the point.
///
/// internal
fn distance_slope_2d(from_point: vec3<f32>) -> vec3<f32> {
    let distance = sqrt(from_point.z);
    return vec3<f32>(distance, from_point.xy / max(distance, TINY));
}

/// A distance with its gradient in 3D.
///
/// internal
fn distance_slope_3d(from_point: vec4<f32>) -> vec4<f32> {
    let distance = sqrt(from_point.w);
    return vec4<f32>(distance, from_point.xyz / max(distance, TINY));
}

/// A 2D position on a lattice that repeats.
///
/// internal
fn wrapped_2d(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>) -> Lattice2d {
    let p = split_2d(cell, frac);
    return Lattice2d(wrap_2d(p.cell, period), p.frac);
}

/// A 3D position on a lattice that repeats.
///
/// internal
fn wrapped_3d(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>) -> Lattice3d {
    let p = split_3d(cell, frac);
    return Lattice3d(wrap_3d(p.cell, period), p.frac);
}

/// Distances to the nearest and to the second nearest point in 2D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1.5812] cell
/// error   4e-7 abs of reference::noise::worley::worley_noise_2d
/// source  Worley1996 F1 and F2; departs: one point a cell
fn worley_noise_2d(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec2<f32> {
    let near = nearest_points_2d(split_2d(cell, frac), vec2<i32>(0), true, seed);
    return sqrt(vec2<f32>(near.first.z, near.second.z));
}

/// Distance to the nearest point in 2D and its gradient: (distance, d/dx, d/dy), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.5812] 1
/// error   4e-7 abs of reference::noise::worley::worley_noise_2d_slope
/// source  Worley1996 F1; departs: one point a cell
fn worley_noise_2d_slope(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    return distance_slope_2d(nearest_points_2d(split_2d(cell, frac), vec2<i32>(0), false, seed).first);
}

/// Distance to the second nearest point in 2D and its gradient: (distance, d/dx, d/dy), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.5812] 1
/// error   4e-7 abs of reference::noise::worley::worley_second_2d_slope
/// source  Worley1996 F2; departs: one point a cell
fn worley_second_2d_slope(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> vec3<f32> {
    return distance_slope_2d(nearest_points_2d(split_2d(cell, frac), vec2<i32>(0), true, seed).second);
}

/// Distances to the nearest and to the second nearest point in 2D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1.5812] cell
/// error   4e-7 abs of reference::noise::worley::worley_noise_2d_periodic
/// source  Worley1996 F1 and F2; departs: one point a cell, periodic lattice
fn worley_noise_2d_periodic(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec2<f32> {
    let near = nearest_points_2d(wrapped_2d(cell, frac, period), period, true, seed);
    return sqrt(vec2<f32>(near.first.z, near.second.z));
}

/// Distance to the nearest point in 2D and its gradient: (distance, d/dx, d/dy), per cell, on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.5812] 1
/// error   4e-7 abs of reference::noise::worley::worley_noise_2d_periodic_slope
/// source  Worley1996 F1; departs: one point a cell, periodic lattice
fn worley_noise_2d_periodic_slope(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec3<f32> {
    return distance_slope_2d(nearest_points_2d(wrapped_2d(cell, frac, period), period, false, seed).first);
}

/// Distance to the second nearest point in 2D and its gradient: (distance, d/dx, d/dy), per cell, on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.5812] 1
/// error   4e-7 abs of reference::noise::worley::worley_second_2d_periodic_slope
/// source  Worley1996 F2; departs: one point a cell, periodic lattice
fn worley_second_2d_periodic_slope(cell: vec2<i32>, frac: vec2<f32>, period: vec2<i32>, seed: u32) -> vec3<f32> {
    return distance_slope_2d(nearest_points_2d(wrapped_2d(cell, frac, period), period, true, seed).second);
}

/// Distances to the nearest and to the second nearest point in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1.7321] cell
/// error   4e-7 abs of reference::noise::worley::worley_noise_3d
/// source  Worley1996 F1 and F2; departs: one point a cell
fn worley_noise_3d(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec2<f32> {
    let near = nearest_points_3d(split_3d(cell, frac), vec3<i32>(0), true, seed);
    return sqrt(vec2<f32>(near.first.w, near.second.w));
}

/// Distance to the nearest point in 3D and its gradient: (distance, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.7321] 1
/// error   4e-7 abs of reference::noise::worley::worley_noise_3d_slope
/// source  Worley1996 F1; departs: one point a cell
fn worley_noise_3d_slope(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    return distance_slope_3d(nearest_points_3d(split_3d(cell, frac), vec3<i32>(0), false, seed).first);
}

/// Distance to the second nearest point in 3D and its gradient: (distance, d/dx, d/dy, d/dz), per cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.7321] 1
/// error   4e-7 abs of reference::noise::worley::worley_second_3d_slope
/// source  Worley1996 F2; departs: one point a cell
fn worley_second_3d_slope(cell: vec3<i32>, frac: vec3<f32>, seed: u32) -> vec4<f32> {
    return distance_slope_3d(nearest_points_3d(split_3d(cell, frac), vec3<i32>(0), true, seed).second);
}

/// Distances to the nearest and to the second nearest point in 3D on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1.7321] cell
/// error   4e-7 abs of reference::noise::worley::worley_noise_3d_periodic
/// source  Worley1996 F1 and F2; departs: one point a cell, periodic lattice
fn worley_noise_3d_periodic(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec2<f32> {
    let near = nearest_points_3d(wrapped_3d(cell, frac, period), period, true, seed);
    return sqrt(vec2<f32>(near.first.w, near.second.w));
}

/// Distance to the nearest point in 3D and its gradient: (distance, d/dx, d/dy, d/dz), per cell, on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.7321] 1
/// error   4e-7 abs of reference::noise::worley::worley_noise_3d_periodic_slope
/// source  Worley1996 F1; departs: one point a cell, periodic lattice
fn worley_noise_3d_periodic_slope(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec4<f32> {
    return distance_slope_3d(nearest_points_3d(wrapped_3d(cell, frac, period), period, false, seed).first);
}

/// Distance to the second nearest point in 3D and its gradient: (distance, d/dx, d/dy, d/dz), per cell, on a lattice that repeats after `period` cells on each axis.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  period in [1, 1073741824] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-1.000001, 1.7321] 1
/// error   4e-7 abs of reference::noise::worley::worley_second_3d_periodic_slope
/// source  Worley1996 F2; departs: one point a cell, periodic lattice
fn worley_second_3d_periodic_slope(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, seed: u32) -> vec4<f32> {
    return distance_slope_3d(nearest_points_3d(wrapped_3d(cell, frac, period), period, true, seed).second);
}
