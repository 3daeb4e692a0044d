//! Lattices, value noise and gradient noise: the twins of `veduta::noise`.
//!
//! Written as the definition says: a sum over the 2^n corners of a cell, each weighted by a product of fades.

pub mod simplex;
pub mod worley;

use super::hash::{lattice_hash_2d, lattice_word_3d, unit_float};

/// A position on a 2D lattice, `cell + frac`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice2d {
    /// The lattice point below.
    pub cell: [i32; 2],
    /// The rest, in [0, 1).
    pub frac: [f64; 2],
}

/// A position on a 3D lattice, `cell + frac`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice3d {
    /// The lattice point below.
    pub cell: [i32; 3],
    /// The rest, in [0, 1).
    pub frac: [f64; 3],
}

/// `cell * 2^i + whole`, wrapped at 2^32.
fn refine(cell: i32, i: i32, whole: f64) -> i32 {
    let exact = (i64::from(cell) << i) + whole as i64;
    // The low 32 bits are the wrapped cell.
    exact as i32
}

fn place<const N: usize>(
    cell: [i32; N],
    frac: [f64; N],
    i: i32,
    shift: [f64; N],
) -> ([i32; N], [f64; N]) {
    let position: [f64; N] =
        std::array::from_fn(|axis| frac[axis] * octave_frequency(i) + shift[axis]);
    (
        std::array::from_fn(|axis| refine(cell[axis], i, position[axis].floor())),
        position.map(|p| p - p.floor()),
    )
}

/// Moves the whole cells of the fraction into the cell.
pub fn split_2d(cell: [i32; 2], frac: [f64; 2]) -> Lattice2d {
    let (cell, frac) = place(cell, frac, 0, [0.0; 2]);
    Lattice2d { cell, frac }
}

/// Moves the whole cells of the fraction into the cell.
pub fn split_3d(cell: [i32; 3], frac: [f64; 3]) -> Lattice3d {
    let (cell, frac) = place(cell, frac, 0, [0.0; 3]);
    Lattice3d { cell, frac }
}

/// 2^i.
pub fn octave_frequency(i: i32) -> f64 {
    2_f64.powi(i)
}

/// What the amplitude falls by from octave to octave, 2^-hurst.
pub fn octave_fall(hurst: f64) -> f64 {
    (-hurst).exp2()
}

/// The seed of octave i: a step of 2^32 / golden ratio an octave.
pub fn octave_seed(seed: u32, i: i32) -> u32 {
    seed.wrapping_add(i.cast_unsigned().wrapping_mul(0x9e37_79b9))
}

/// The shift of every octave but the first in 2D.
pub const SHIFT_2D: [f64; 2] = [11.0 / 64.0, 25.0 / 64.0];

/// The shift of every octave but the first in 3D.
pub const SHIFT_3D: [f64; 3] = [11.0 / 64.0, 13.0 / 64.0, 25.0 / 64.0];

/// A position on the lattice of octave i: p for octave 0, else 2^i p + d.
pub fn octave_2d(cell: [i32; 2], frac: [f64; 2], i: i32) -> Lattice2d {
    let (cell, frac) = place(cell, frac, i, if i > 0 { SHIFT_2D } else { [0.0; 2] });
    Lattice2d { cell, frac }
}

/// A position on the lattice of octave i in 3D: p for octave 0, else 2^i p + d.
pub fn octave_3d(cell: [i32; 3], frac: [f64; 3], i: i32) -> Lattice3d {
    let (cell, frac) = place(cell, frac, i, if i > 0 { SHIFT_3D } else { [0.0; 3] });
    Lattice3d { cell, frac }
}

fn wrap<const N: usize>(cell: [i32; N], period: [i32; N]) -> [i32; N] {
    std::array::from_fn(|axis| cell[axis].rem_euclid(period[axis].max(1)))
}

/// The 2D cell modulo the period, never negative. A period below 1 counts as 1.
pub fn wrap_2d(cell: [i32; 2], period: [i32; 2]) -> [i32; 2] {
    wrap(cell, period)
}

/// The cell modulo the period, never negative. A period below 1 counts as 1.
pub fn wrap_3d(cell: [i32; 3], period: [i32; 3]) -> [i32; 3] {
    wrap(cell, period)
}

/// The quintic fade 6 t^5 - 15 t^4 + 10 t^3.
pub fn fade(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// The quintic fade of a fraction given as an integer of 2^32 a cell.
pub fn fade_fraction(fraction: u32) -> f64 {
    fade(f64::from(fraction) / 2_f64.powi(32))
}

/// The position within a torus in turns of 2^32, at `turns` turns from its start.
pub fn turn_3d(turns: [f64; 3]) -> [u32; 3] {
    turns.map(|t| ((t - t.floor()) * 2_f64.powi(32)) as u64 as u32)
}

/// The derivative of the quintic fade, 30 t^2 (1 - t)^2.
pub fn fade_slope(t: f64) -> f64 {
    let q = t * (1.0 - t);
    30.0 * q * q
}

/// Sums `corner(offset)`, a value and its gradient with respect to the position, over all corners of a cell with the
/// product of the fades as weight. The answer is the value, then the gradient.
fn blend<const N: usize>(
    frac: [f64; N],
    corner: impl Fn([i32; N]) -> (f64, [f64; N]),
) -> (f64, [f64; N]) {
    let rise = frac.map(fade);
    let slope = frac.map(fade_slope);
    let mut sum = 0.0;
    let mut gradient = [0.0; N];
    for index in 0..1_usize << N {
        let offset: [i32; N] = std::array::from_fn(|axis| i32::from(index >> axis & 1 == 1));
        let weight = |axis: usize| {
            if offset[axis] == 1 {
                rise[axis]
            } else {
                1.0 - rise[axis]
            }
        };
        let (value, change) = corner(offset);
        let whole: f64 = (0..N).map(weight).product();
        sum += whole * value;
        for axis in 0..N {
            let others: f64 = (0..N).filter(|&k| k != axis).map(weight).product();
            let sign = f64::from(2 * offset[axis] - 1);
            gradient[axis] += whole * change[axis] + others * sign * slope[axis] * value;
        }
    }
    (sum, gradient)
}

fn neighbour<const N: usize>(cell: [i32; N], offset: [i32; N]) -> [i32; N] {
    std::array::from_fn(|axis| cell[axis].wrapping_add(offset[axis]))
}

/// Value noise in 2D and its gradient, with the cells of the corners passed through `home`. The cell itself is, before its
/// neighbours are taken: beyond the largest integer there are none.
fn value_2d(
    cell: [i32; 2],
    frac: [f64; 2],
    seed: u32,
    home: impl Fn([i32; 2]) -> [i32; 2],
) -> [f64; 3] {
    let p = split_2d(cell, frac);
    let base = home(p.cell);
    let (value, [dx, dy]) = blend(p.frac, |offset| {
        let word = lattice_hash_2d(home(neighbour(base, offset)), seed)[0];
        (unit_float(word), [0.0; 2])
    });
    [value, dx, dy]
}

/// Value noise in 2D and its gradient: value, d/dx, d/dy.
pub fn value_noise_2d_slope(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 3] {
    value_2d(cell, frac, seed, |corner| corner)
}

/// The 23 lowest bits of a word as a number in [0, 1).
fn low_unit(word: u32) -> f64 {
    f64::from(word & 0x7f_ffff) / f64::from(1_u32 << 23)
}

/// Value noise in 3D and its gradient, with the cells of the corners passed through `home`.
fn value_3d(
    cell: [i32; 3],
    frac: [f64; 3],
    seed: u32,
    home: impl Fn([i32; 3]) -> [i32; 3],
) -> [f64; 4] {
    let p = split_3d(cell, frac);
    let base = home(p.cell);
    let (value, [dx, dy, dz]) = blend(p.frac, |offset| {
        let word = lattice_word_3d(home(neighbour(base, offset)), seed);
        (low_unit(word), [0.0; 3])
    });
    [value, dx, dy, dz]
}

/// Value noise in 3D and its gradient: value, d/dx, d/dy, d/dz.
pub fn value_noise_3d_slope(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 4] {
    value_3d(cell, frac, seed, |corner| corner)
}

/// Value noise in 2D.
pub fn value_noise_2d(cell: [i32; 2], frac: [f64; 2], seed: u32) -> f64 {
    value_noise_2d_slope(cell, frac, seed)[0]
}

/// Value noise in 3D.
pub fn value_noise_3d(cell: [i32; 3], frac: [f64; 3], seed: u32) -> f64 {
    value_noise_3d_slope(cell, frac, seed)[0]
}

/// Value noise in 2D and its gradient, on a lattice that repeats after `period` cells.
pub fn value_noise_2d_periodic_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 3] {
    value_2d(cell, frac, seed, |corner| wrap_2d(corner, period))
}

/// Value noise in 3D and its gradient, on a lattice that repeats after `period` cells.
pub fn value_noise_3d_periodic_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 4] {
    value_3d(cell, frac, seed, |corner| wrap_3d(corner, period))
}

/// Value noise in 2D whose lattice repeats after `period` cells.
pub fn value_noise_2d_periodic(cell: [i32; 2], frac: [f64; 2], period: [i32; 2], seed: u32) -> f64 {
    value_noise_2d_periodic_slope(cell, frac, period, seed)[0]
}

/// Value noise in 3D whose lattice repeats after `period` cells.
pub fn value_noise_3d_periodic(cell: [i32; 3], frac: [f64; 3], period: [i32; 3], seed: u32) -> f64 {
    value_noise_3d_periodic_slope(cell, frac, period, seed)[0]
}

/// The gradient at a lattice point in 2D: length sqrt(2), an angle of 23 bits in the first octant, a swap of the
/// components, two signs.
pub fn lattice_gradient_2d(cell: [i32; 2], seed: u32) -> [f64; 2] {
    let word = lattice_hash_2d(cell, seed)[0];
    let angle = std::f64::consts::FRAC_PI_4 * f64::from(word >> 9) / f64::from(1_u32 << 23);
    let (sine, cosine) = angle.sin_cos();
    let sign = |bit: u32| if word >> bit & 1 == 1 { -1.0 } else { 1.0 };
    let [x, y] = if word >> 2 & 1 == 1 {
        [sine, cosine]
    } else {
        [cosine, sine]
    };
    let length = std::f64::consts::SQRT_2;
    [length * sign(0) * x, length * sign(1) * y]
}

/// The gradient at a lattice point in 3D: length 1.3847, one of the 24 vectors (0, +-a, +-b) and permutations with
/// a/b the golden ratio or its inverse.
pub fn lattice_gradient_3d(cell: [i32; 3], seed: u32) -> [f64; 3] {
    let word = lattice_word_3d(cell, seed);
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let length = 1.3847;
    let long = length * golden / (1.0 + golden * golden).sqrt();
    let short = length / (1.0 + golden * golden).sqrt();
    let sign = |bit: u32| if word >> bit & 1 == 1 { -1.0 } else { 1.0 };
    let sides = if word >> 20 & 1 == 1 {
        [short, long]
    } else {
        [long, short]
    };
    let p = sign(22) * sides[0];
    let q = sign(21) * sides[1];
    // The third of their range in which the 20 lowest bits lie says which component is 0; the others follow cyclically.
    let third = ((word & 0xf_ffff) * 3) >> 20;
    match third {
        0 => [0.0, p, q],
        1 => [q, 0.0, p],
        _ => [p, q, 0.0],
    }
}

/// Gradient noise and its gradient, with the vector of a corner at `offset` from `vector`.
fn gradient_blend<const N: usize>(
    frac: [f64; N],
    vector: impl Fn([i32; N]) -> [f64; N],
) -> (f64, [f64; N]) {
    blend(frac, |offset| {
        let g = vector(offset);
        let product = (0..N)
            .map(|axis| g[axis] * (frac[axis] - f64::from(offset[axis])))
            .sum();
        (product, g)
    })
}

/// Gradient noise in 2D and its gradient: value, d/dx, d/dy.
pub fn gradient_noise_2d_slope(cell: [i32; 2], frac: [f64; 2], seed: u32) -> [f64; 3] {
    let p = split_2d(cell, frac);
    let (value, [dx, dy]) = gradient_blend(p.frac, |offset| {
        lattice_gradient_2d(neighbour(p.cell, offset), seed)
    });
    [value, dx, dy]
}

/// Gradient noise in 3D and its gradient: value, d/dx, d/dy, d/dz.
pub fn gradient_noise_3d_slope(cell: [i32; 3], frac: [f64; 3], seed: u32) -> [f64; 4] {
    let p = split_3d(cell, frac);
    let (value, [dx, dy, dz]) = gradient_blend(p.frac, |offset| {
        lattice_gradient_3d(neighbour(p.cell, offset), seed)
    });
    [value, dx, dy, dz]
}

/// Gradient noise in 2D and its gradient, on a lattice that repeats after `period` cells.
pub fn gradient_noise_2d_periodic_slope(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> [f64; 3] {
    let p = split_2d(cell, frac);
    let base = wrap_2d(p.cell, period);
    let (value, [dx, dy]) = gradient_blend(p.frac, |offset| {
        lattice_gradient_2d(wrap_2d(neighbour(base, offset), period), seed)
    });
    [value, dx, dy]
}

/// Gradient noise in 3D and its gradient, on a lattice that repeats after `period` cells.
pub fn gradient_noise_3d_periodic_slope(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> [f64; 4] {
    let p = split_3d(cell, frac);
    let base = wrap_3d(p.cell, period);
    let (value, [dx, dy, dz]) = gradient_blend(p.frac, |offset| {
        lattice_gradient_3d(wrap_3d(neighbour(base, offset), period), seed)
    });
    [value, dx, dy, dz]
}

/// Gradient noise in 2D whose lattice repeats after `period` cells.
pub fn gradient_noise_2d_periodic(
    cell: [i32; 2],
    frac: [f64; 2],
    period: [i32; 2],
    seed: u32,
) -> f64 {
    gradient_noise_2d_periodic_slope(cell, frac, period, seed)[0]
}

/// Gradient noise in 3D whose lattice repeats after `period` cells.
pub fn gradient_noise_3d_periodic(
    cell: [i32; 3],
    frac: [f64; 3],
    period: [i32; 3],
    seed: u32,
) -> f64 {
    gradient_noise_3d_periodic_slope(cell, frac, period, seed)[0]
}

/// Gradient noise in 2D.
pub fn gradient_noise_2d(cell: [i32; 2], frac: [f64; 2], seed: u32) -> f64 {
    gradient_noise_2d_slope(cell, frac, seed)[0]
}

/// Gradient noise in 3D.
pub fn gradient_noise_3d(cell: [i32; 3], frac: [f64; 3], seed: u32) -> f64 {
    gradient_noise_3d_slope(cell, frac, seed)[0]
}
