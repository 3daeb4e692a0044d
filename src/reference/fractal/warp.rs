//! Domain warping: the twin of `veduta::fractal::warp`.

use super::{fbm_2d_slope, fbm_3d_slope};

/// What the seeds of the moving fractals differ by from that of the moved one.
const SEEDS: [u32; 3] = [374_761_393, 668_265_263, 1_274_126_177];

/// Where the moving fractals are read, in parts of a cell.
const AWAY: [[f64; 3]; 3] = [
    [19.0 / 64.0, 41.0 / 64.0, 29.0 / 64.0],
    [47.0 / 64.0, 23.0 / 64.0, 37.0 / 64.0],
    [27.0 / 64.0, 17.0 / 64.0, 45.0 / 64.0],
];

/// The chain rule: the gradient `outer` at the moved place, times the unit matrix plus `strength` times that of the
/// warp's derivatives.
fn chain<const N: usize>(outer: [f64; N], warp: [[f64; N]; N], strength: f64) -> [f64; N] {
    std::array::from_fn(|axis| {
        let moved: f64 = (0..N).map(|k| outer[k] * warp[k][axis]).sum();
        outer[axis] + strength * moved
    })
}

/// Value and gradient in 2D of what is read at a moved place.
pub fn warped_slope_2d(
    outer: [f64; 3],
    warp_x: [f64; 3],
    warp_y: [f64; 3],
    strength: f64,
) -> [f64; 3] {
    let gradient = |v: [f64; 3]| [v[1], v[2]];
    let warp = [gradient(warp_x), gradient(warp_y)];
    let [x, y] = chain(gradient(outer), warp, strength);
    [outer[0], x, y]
}

/// Value and gradient in 3D of what is read at a moved place.
pub fn warped_slope_3d(
    outer: [f64; 4],
    warp_x: [f64; 4],
    warp_y: [f64; 4],
    warp_z: [f64; 4],
    strength: f64,
) -> [f64; 4] {
    let gradient = |v: [f64; 4]| [v[1], v[2], v[3]];
    let warp = [gradient(warp_x), gradient(warp_y), gradient(warp_z)];
    let [x, y, z] = chain(gradient(outer), warp, strength);
    [outer[0], x, y, z]
}

/// fBm in 2D, warped by two others, and its gradient.
pub fn warped_fbm_2d_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    strength: f64,
    seed: u32,
) -> [f64; 3] {
    let [x, y] = std::array::from_fn(|k| {
        let at = std::array::from_fn(|axis| frac[axis] + AWAY[k][axis]);
        fbm_2d_slope(cell, at, octaves, hurst, seed.wrapping_add(SEEDS[k]))
    });
    let moved = [frac[0] + strength * x[0], frac[1] + strength * y[0]];
    let outer = fbm_2d_slope(cell, moved, octaves, hurst, seed);
    warped_slope_2d(outer, x, y, strength)
}

/// fBm in 2D, warped by two others.
pub fn warped_fbm_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    octaves: i32,
    hurst: f64,
    strength: f64,
    seed: u32,
) -> f64 {
    warped_fbm_2d_slope(cell, frac, octaves, hurst, strength, seed)[0]
}

/// fBm in 3D, warped by three others, and its gradient.
pub fn warped_fbm_3d_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    octaves: i32,
    hurst: f64,
    strength: f64,
    seed: u32,
) -> [f64; 4] {
    let [x, y, z] = std::array::from_fn(|k| {
        let at = std::array::from_fn(|axis| frac[axis] + AWAY[k][axis]);
        fbm_3d_slope(cell, at, octaves, hurst, seed.wrapping_add(SEEDS[k]))
    });
    let warp = [x[0], y[0], z[0]];
    let moved = std::array::from_fn(|axis| frac[axis] + strength * warp[axis]);
    let outer = fbm_3d_slope(cell, moved, octaves, hurst, seed);
    warped_slope_3d(outer, x, y, z, strength)
}

/// fBm in 3D, warped by three others.
pub fn warped_fbm_3d(
    cell: [i32; 3],
    frac: [f64; 3],
    octaves: i32,
    hurst: f64,
    strength: f64,
    seed: u32,
) -> f64 {
    warped_fbm_3d_slope(cell, frac, octaves, hurst, strength, seed)[0]
}
