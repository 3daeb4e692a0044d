//! Simplex noise: the twin of `veduta::noise::simplex`.
//!
//! Written as the definition says: a sum over all corners of the lattice near the position, of which the bumps of all but
//! those of its simplex are 0. No simplex is looked for.

use super::{lattice_gradient_2d, lattice_gradient_3d, split_2d, split_3d, wrap_2d, wrap_3d};

/// The square of the bump's radius in 2D.
const RADIUS_2D: f64 = 0.8;
/// The square of the bump's radius in 3D.
const RADIUS_3D: f64 = 0.5;
/// What the sum is multiplied by in 2D.
pub const SCALE_2D: f64 = 7.7274;
/// What the sum is multiplied by in 3D.
pub const SCALE_3D: f64 = 78.52;
/// What the seed of the cells' centres differs by from that of their corners.
const CENTRES: u32 = 1_540_483_477;

/// (radius^2 - d^2)^4 g.d and its gradient, value first.
fn bump<const N: usize>(radius: f64, d: [f64; N], g: [f64; N]) -> (f64, [f64; N]) {
    let inside = (radius - d.iter().map(|x| x * x).sum::<f64>()).max(0.0);
    let along: f64 = (0..N).map(|axis| g[axis] * d[axis]).sum();
    let slope = std::array::from_fn(|axis| {
        inside.powi(4) * g[axis] - 8.0 * inside.powi(3) * along * d[axis]
    });
    (inside.powi(4) * along, slope)
}

fn simplex_2d(cell: [i32; 2], frac: [f64; 2], period: Option<[i32; 2]>, seed: u32) -> [f64; 3] {
    let p = split_2d(cell, frac);
    let home = |corner: [i32; 2]| period.map_or(corner, |[x, y]| wrap_2d(corner, [x, y + (y & 1)]));
    let base = home(p.cell);
    let mut sum = [0.0; 3];
    for row in -2..=3 {
        for column in -2..=4 {
            let corner = [base[0].wrapping_add(column), base[1].wrapping_add(row)];
            // Odd rows lie half a cell to the left.
            let shift = if corner[1] & 1 == 1 { 0.5 } else { 0.0 };
            let d = [
                p.frac[0] - f64::from(column) + shift,
                p.frac[1] - f64::from(row),
            ];
            let g = lattice_gradient_2d(home(corner), seed);
            let (value, [dx, dy]) = bump(RADIUS_2D, d, g);
            for (total, part) in sum.iter_mut().zip([value, dx, dy]) {
                *total += SCALE_2D * part;
            }
        }
    }
    sum
}

fn simplex_3d(cell: [i32; 3], frac: [f64; 3], period: Option<[i32; 3]>, seed: u32) -> [f64; 4] {
    let p = split_3d(cell, frac);
    let home = |corner: [i32; 3]| period.map_or(corner, |size| wrap_3d(corner, size));
    let base = home(p.cell);
    let mut sum = [0.0; 4];
    for index in 0..4_i32.pow(3) {
        let offset: [i32; 3] = std::array::from_fn(|axis| (index >> (2 * axis) & 3) - 1);
        let corner = std::array::from_fn(|axis| base[axis].wrapping_add(offset[axis]));
        for (place, seed) in [(0.0, seed), (0.5, seed.wrapping_add(CENTRES))] {
            let d = std::array::from_fn(|axis| p.frac[axis] - f64::from(offset[axis]) - place);
            if d.iter().map(|x: &f64| x * x).sum::<f64>() >= RADIUS_3D {
                continue;
            }
            let g = lattice_gradient_3d(home(corner), seed);
            let (value, [dx, dy, dz]) = bump(RADIUS_3D, d, g);
            for (total, part) in sum.iter_mut().zip([value, dx, dy, dz]) {
                *total += SCALE_3D * part;
            }
        }
    }
    sum
}

/// Simplex noise in 2D and its gradient.
pub fn simplex_noise_2d_slope(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 3] {
    simplex_2d(cell, frac, None, seed)
}

/// Simplex noise in 2D.
pub fn simplex_noise_2d(cell: [i32; 2], frac: [f64; 2], seed: u32) -> f64 {
    simplex_noise_2d_slope(cell, frac, seed)[0]
}

/// Simplex noise in 2D and its gradient, on a lattice that repeats.
pub fn simplex_noise_2d_periodic_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 3] {
    simplex_2d(cell, frac, Some(period), seed)
}

/// Simplex noise in 2D, on a lattice that repeats.
pub fn simplex_noise_2d_periodic(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> f64 {
    simplex_noise_2d_periodic_slope(cell, frac, period, seed)[0]
}

/// Simplex noise in 3D and its gradient.
pub fn simplex_noise_3d_slope(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 4] {
    simplex_3d(cell, frac, None, seed)
}

/// Simplex noise in 3D.
pub fn simplex_noise_3d(cell: [i32; 3], frac: [f64; 3], seed: u32) -> f64 {
    simplex_noise_3d_slope(cell, frac, seed)[0]
}

/// Simplex noise in 3D and its gradient, on a lattice that repeats.
pub fn simplex_noise_3d_periodic_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 4] {
    simplex_3d(cell, frac, Some(period), seed)
}

/// Simplex noise in 3D, on a lattice that repeats.
pub fn simplex_noise_3d_periodic(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> f64 {
    simplex_noise_3d_periodic_slope(cell, frac, period, seed)[0]
}
