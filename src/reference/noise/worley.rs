//! Worley noise: the twin of `veduta::noise::worley`, by brute force.

use super::{split_2d, split_3d, wrap_2d, wrap_3d};
use crate::reference::hash::{lattice_hash_2d, lattice_word_3d};

/// How many cells away the functions here search; more than is needed (see [`nearest_points`]).
const REACH: i32 = 2;

fn unit_23(bits: u32) -> f64 {
    f64::from(bits & 0x7f_ffff) / f64::from(1_u32 << 23)
}

/// The point of a 2D cell, as a position within it.
pub fn cell_point_2d(cell: [i32; 2], seed: u32) -> [f64; 2] {
    lattice_hash_2d(cell, seed).map(|word| unit_23(word >> 9))
}

/// The point of a 3D cell, as a position within it: a word and two multiples of it modulo 2^23.
pub fn cell_point_3d(cell: [i32; 3], seed: u32) -> [f64; 3] {
    let word = lattice_word_3d(cell, seed);
    [1, 6_433_001, 2_396_377].map(|factor| unit_23(word.wrapping_mul(factor)))
}

/// A position minus the point that it belongs to, with the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found<const N: usize> {
    /// From the point to the position.
    pub from_point: [f64; N],
    /// Its length.
    pub distance: f64,
}

/// The three nearest points of all cells up to `reach` away, nearest first.
fn nearest_points<const N: usize>(
    frac: [f64; N],
    reach: i32,
    point: impl Fn([i32; N]) -> [f64; N],
) -> [Found<N>; 3] {
    let nothing = Found {
        from_point: [0.0; N],
        distance: f64::INFINITY,
    };
    let mut best = [nothing; 3];
    let side = 2 * reach + 1;
    for index in 0..side.pow(N as u32) {
        let offset: [i32; N] =
            std::array::from_fn(|axis| index / side.pow(axis as u32) % side - reach);
        let place = point(offset);
        let from_point: [f64; N] =
            std::array::from_fn(|axis| frac[axis] - f64::from(offset[axis]) - place[axis]);
        let mut found = Found {
            from_point,
            distance: from_point.iter().map(|d| d * d).sum::<f64>().sqrt(),
        };
        for slot in &mut best {
            if found.distance < slot.distance {
                std::mem::swap(slot, &mut found);
            }
        }
    }
    best
}

/// The three nearest points in 2D of all cells up to `reach` away; without a period the lattice does not repeat.
pub fn nearest_points_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    period: Option<[i32; 2]>,
    reach: i32,
    seed: u32,
) -> [Found<2>; 3] {
    let p = split_2d(cell, frac);
    let home = |cell| period.map_or(cell, |size| wrap_2d(cell, size));
    let base = home(p.cell);
    nearest_points(p.frac, reach, |offset| {
        let there = std::array::from_fn(|axis| base[axis].wrapping_add(offset[axis]));
        cell_point_2d(home(there), seed)
    })
}

/// The three nearest points in 3D of all cells up to `reach` away; without a period the lattice does not repeat.
pub fn nearest_points_3d(
    cell: [i32; 3],
    frac: [f64; 3],
    period: Option<[i32; 3]>,
    reach: i32,
    seed: u32,
) -> [Found<3>; 3] {
    let p = split_3d(cell, frac);
    let home = |cell| period.map_or(cell, |size| wrap_3d(cell, size));
    let base = home(p.cell);
    nearest_points(p.frac, reach, |offset| {
        let there = std::array::from_fn(|axis| base[axis].wrapping_add(offset[axis]));
        cell_point_3d(home(there), seed)
    })
}

impl Found<2> {
    /// Distance, d/dx, d/dy; at the point itself the gradient counts as 0.
    pub fn slope(self) -> [f64; 3] {
        let [x, y] = unit(self);
        [self.distance, x, y]
    }
}

impl Found<3> {
    /// Distance, d/dx, d/dy, d/dz; at the point itself the gradient counts as 0.
    pub fn slope(self) -> [f64; 4] {
        let [x, y, z] = unit(self);
        [self.distance, x, y, z]
    }
}

fn unit<const N: usize>(found: Found<N>) -> [f64; N] {
    found.from_point.map(|d| {
        if found.distance > 0.0 {
            d / found.distance
        } else {
            0.0
        }
    })
}

/// Distances to the two nearest points in 2D.
pub fn worley_noise_2d(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 2] {
    let [first, second, _] = nearest_points_2d(cell, frac, None, REACH, seed);
    [first.distance, second.distance]
}

/// Distance to the nearest point in 2D and its gradient.
pub fn worley_noise_2d_slope(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 3] {
    nearest_points_2d(cell, frac, None, REACH, seed)[0].slope()
}

/// Distance to the second nearest point in 2D and its gradient.
pub fn worley_second_2d_slope(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 3] {
    nearest_points_2d(cell, frac, None, REACH, seed)[1].slope()
}

/// Distances to the two nearest points in 2D on a lattice that repeats.
pub fn worley_noise_2d_periodic(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 2] {
    let [first, second, _] = nearest_points_2d(cell, frac, Some(period), REACH, seed);
    [first.distance, second.distance]
}

/// Distance to the nearest point in 2D and its gradient, on a lattice that repeats.
pub fn worley_noise_2d_periodic_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 3] {
    nearest_points_2d(cell, frac, Some(period), REACH, seed)[0].slope()
}

/// Distance to the second nearest point in 2D and its gradient, on a lattice that repeats.
pub fn worley_second_2d_periodic_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 3] {
    nearest_points_2d(cell, frac, Some(period), REACH, seed)[1].slope()
}

/// Distances to the two nearest points in 3D.
pub fn worley_noise_3d(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 2] {
    let [first, second, _] = nearest_points_3d(cell, frac, None, REACH, seed);
    [first.distance, second.distance]
}

/// Distance to the nearest point in 3D and its gradient.
pub fn worley_noise_3d_slope(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 4] {
    nearest_points_3d(cell, frac, None, REACH, seed)[0].slope()
}

/// Distance to the second nearest point in 3D and its gradient.
pub fn worley_second_3d_slope(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 4] {
    nearest_points_3d(cell, frac, None, REACH, seed)[1].slope()
}

/// Distances to the two nearest points in 3D on a lattice that repeats.
pub fn worley_noise_3d_periodic(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 2] {
    let [first, second, _] = nearest_points_3d(cell, frac, Some(period), REACH, seed);
    [first.distance, second.distance]
}

/// Distance to the nearest point in 3D and its gradient, on a lattice that repeats.
pub fn worley_noise_3d_periodic_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 4] {
    nearest_points_3d(cell, frac, Some(period), REACH, seed)[0].slope()
}

/// Distance to the second nearest point in 3D and its gradient, on a lattice that repeats.
pub fn worley_second_3d_periodic_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 4] {
    nearest_points_3d(cell, frac, Some(period), REACH, seed)[1].slope()
}
