//! Positions on an integer lattice: a cell and a fraction, and the finer lattices of a fractal's octaves.
//!
//! The cell is an integer and the fraction small, so that a noise is as exact at cell 100 000 000 as at 0. Cells wrap at
//! 2^32.
//!
//! Octave 0 of a fractal lies at p, octave i at 2^i p + d. Without the shift d all octaves would share the lattice points
//! of the first one, where gradient noise is 0 and value noise flat. d is made of odd multiples of 1/64, so that a lattice
//! point n of octave 0 lies at 2^k n + d of octave k, and one of octave i at 2^k n - (2^k - 1) d of octave i + k: never a
//! whole number. The multiples are those that keep it farthest from one: a third of a cell in 2D, 0.44 in 3D, for all k.
//!
//! source   Perlin2002 Improving noise (quintic fade)
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · i octave [1]
#define_import_path veduta::noise::lattice

const SHIFT_2D: vec2<f32> = vec2<f32>(0.171875, 0.390625);
const SHIFT_3D: vec3<f32> = vec3<f32>(0.171875, 0.203125, 0.390625);
// 2^32 / golden ratio.
const SEED_STEP: u32 = 2654435769u;

// Of the fade as 1/2 + s ((s^2 - a)^2 + b): 6^(1/5) / 2^32, a = 5/2 6^(-3/5) and b = 15/8 6^(-1/5) - a^2.
const FADE_UNIT: f32 = 3.33173452203e-10;
const FADE_A: f32 = 0.853196879616;
const FADE_B: f32 = 0.58235593231;

/// A position on a 2D lattice: `cell + frac`.
struct Lattice2d {
    /// The lattice point below [cell].
    cell: vec2<i32>,
    /// The rest [cell], in [0, 1].
    frac: vec2<f32>,
}

/// A position on a 3D lattice: `cell + frac`.
struct Lattice3d {
    /// The lattice point below [cell].
    cell: vec3<i32>,
    /// The rest [cell], in [0, 1].
    frac: vec3<f32>,
}

/// A whole number of at most 2^22 as an integer, exact: 1.5 x 2^23 + n has n in its low bits.
///
/// A plain conversion costs several times as much, because WGSL wants it clamped.
///
/// internal
fn integer_2d(n: vec2<f32>) -> vec2<i32> {
    return bitcast<vec2<i32>>(n + 12582912.0) - 0x4b400000;
}

/// A whole number of at most 2^22 as an integer, three at once.
///
/// internal
fn integer_3d(n: vec3<f32>) -> vec3<i32> {
    return bitcast<vec3<i32>>(n + 12582912.0) - 0x4b400000;
}

/// Moves the whole cells of the fraction into the cell.
///
/// The new fraction is exact, except that of a negative fraction above -2^-1, which is rounded to 2^-25; it is 1 just for
/// those above -2^-25.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [-4194304, 4194304] cell lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::split_2d
/// source  ours
fn split_2d(cell: vec2<i32>, frac: vec2<f32>) -> Lattice2d {
    let whole = floor(frac);
    return Lattice2d(cell + integer_2d(whole), frac - whole);
}

/// Moves the whole cells of the fraction into the cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [-4194304, 4194304] cell lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::split_3d
/// source  ours
fn split_3d(cell: vec3<i32>, frac: vec3<f32>) -> Lattice3d {
    let whole = floor(frac);
    return Lattice3d(cell + integer_3d(whole), frac - whole);
}

/// 2^i, exact.
///
/// domain  i in [0, 126] 1 lin
/// range   [1, 8.507059e37] 1
/// error   0 abs of reference::noise::octave_frequency
/// monotone i
/// outside undefined
/// source  Leitner2022 alg. 1 (lacunarity 2)
fn octave_frequency(i: i32) -> f32 {
    return bitcast<f32>((i + 127) << 23u);
}

/// What the amplitude falls by from octave to octave, 2^-hurst.
///
/// Its error counts once an octave, and in weighted sums more often; `exp2` has three times as much. A minimax polynomial
/// on [-1/2, 1/2] and an exact power of two.
///
/// domain  hurst in [0, 4] 1 lin
/// range   [0.0625, 1] 1
/// error   1.2e-7 rel of reference::noise::octave_fall
/// monotone hurst
/// outside undefined
/// source  Leitner2022 alg. 1 (amplitude f^-H)
fn octave_fall(hurst: f32) -> f32 {
    let whole = floor(hurst + 0.5);
    let r = hurst - whole;
    let high = (r * 0.000154531629451 - 0.00133908633647) * r + 0.00961808255728;
    let low = ((high * r - 0.0555035711422) * r + 0.240226507606) * r - 0.693147188026;
    return (1.0 + r * low) * bitcast<f32>((127 - i32(whole)) << 23u);
}

/// The seed of octave i; that of octave 0 is the seed itself.
///
/// domain  seed in [0, 4294967295] 1 lin
/// domain  i in [0, 21] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::noise::octave_seed
/// source  ours
fn octave_seed(seed: u32, i: i32) -> u32 {
    return seed + bitcast<u32>(i) * SEED_STEP;
}

/// A position on a lattice twice as fine, exact.
///
/// internal
fn finer_2d(p: Lattice2d) -> Lattice2d {
    let over = p.frac >= vec2<f32>(0.5);
    return Lattice2d(
        p.cell + p.cell + select(vec2<i32>(0), vec2<i32>(1), over),
        p.frac + p.frac - select(vec2<f32>(0.0), vec2<f32>(1.0), over),
    );
}

/// A position on a lattice twice as fine in 3D, exact.
///
/// internal
fn finer_3d(p: Lattice3d) -> Lattice3d {
    let over = p.frac >= vec3<f32>(0.5);
    return Lattice3d(
        p.cell + p.cell + select(vec3<i32>(0), vec3<i32>(1), over),
        p.frac + p.frac - select(vec3<f32>(0.0), vec3<f32>(1.0), over),
    );
}

/// A position on octave i's unshifted lattice, shifted; rounds once, by at most 2^-25.
///
/// internal
fn shifted_2d(p: Lattice2d, i: i32) -> Lattice2d {
    let over = (p.frac >= 1.0 - SHIFT_2D) & vec2<bool>(i > 0);
    let shift = select(vec2<f32>(0.0), select(SHIFT_2D, SHIFT_2D - 1.0, over), i > 0);
    return Lattice2d(p.cell + select(vec2<i32>(0), vec2<i32>(1), over), p.frac + shift);
}

/// A position on octave i's unshifted lattice, shifted, in 3D.
///
/// internal
fn shifted_3d(p: Lattice3d, i: i32) -> Lattice3d {
    let over = (p.frac >= 1.0 - SHIFT_3D) & vec3<bool>(i > 0);
    let shift = select(vec3<f32>(0.0), select(SHIFT_3D, SHIFT_3D - 1.0, over), i > 0);
    return Lattice3d(p.cell + select(vec3<i32>(0), vec3<i32>(1), over), p.frac + shift);
}

/// A position on the lattice of octave i: p itself for octave 0, else 2^i p + d.
///
/// Scaling by 2^i and taking off the whole cells are exact; adding the shift rounds once, by at most 2^-25. The
/// fraction must be below 2^22 / 2^i.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  i in [0, 21] 1 lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::octave_2d
/// outside undefined
/// source  Leitner2022 alg. 1; departs: shifted lattices, integer cells
fn octave_2d(cell: vec2<i32>, frac: vec2<f32>, i: i32) -> Lattice2d {
    let scaled = frac * octave_frequency(i);
    let whole = floor(scaled);
    let fine = (cell << vec2<u32>(bitcast<u32>(i))) + integer_2d(whole);
    return shifted_2d(Lattice2d(fine, scaled - whole), i);
}

/// A position on the lattice of octave i in 3D: p itself for octave 0, else 2^i p + d.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  i in [0, 21] 1 lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::octave_3d
/// outside undefined
/// source  Leitner2022 alg. 1; departs: shifted lattices, integer cells
fn octave_3d(cell: vec3<i32>, frac: vec3<f32>, i: i32) -> Lattice3d {
    let scaled = frac * octave_frequency(i);
    let whole = floor(scaled);
    let fine = (cell << vec3<u32>(bitcast<u32>(i))) + integer_3d(whole);
    return shifted_3d(Lattice3d(fine, scaled - whole), i);
}

/// The cell wrapped into [0, period), also from negative cells.
///
/// Two divisions in `f32`: the first leaves less than `period + 512`, the second corrects it to within one period. All
/// that counts is integer arithmetic, so the result is exact; integer division would cost a multiple on a CPU.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  period in [1, 1073741824] cell lin
/// range   [0, 1073741823] cell
/// error   0 abs of reference::noise::wrap_3d
/// source  ours
fn wrap_3d(cell: vec3<i32>, period: vec3<i32>) -> vec3<i32> {
    let inverse = vec3<f32>(1.0) / vec3<f32>(period);
    let near = cell - vec3<i32>(floor(vec3<f32>(cell) * inverse)) * period;
    let rest = near - vec3<i32>(floor(vec3<f32>(near) * inverse)) * period;
    let low = select(rest, rest + period, rest < vec3<i32>(0));
    return select(low, low - period, low >= period);
}

/// The 2D cell wrapped into [0, period), also from negative cells; see `wrap_3d`.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  period in [1, 1073741824] cell lin
/// range   [0, 1073741823] cell
/// error   0 abs of reference::noise::wrap_2d
/// source  ours
fn wrap_2d(cell: vec2<i32>, period: vec2<i32>) -> vec2<i32> {
    return wrap_3d(cell.xyy, period.xyy).xy;
}

/// The cell next to a wrapped one on each axis, wrapped.
///
/// internal
fn next_cell_2d(cell: vec2<i32>, period: vec2<i32>) -> vec2<i32> {
    let next = cell + 1;
    return select(next, vec2<i32>(0), next >= period);
}

/// The cell next to a wrapped one on each axis in 3D, wrapped.
///
/// internal
fn next_cell_3d(cell: vec3<i32>, period: vec3<i32>) -> vec3<i32> {
    let next = cell + 1;
    return select(next, vec3<i32>(0), next >= period);
}

/// A cell at most two away from a wrapped one, wrapped without a division; a size of 0 leaves it as it is.
///
/// internal
fn wrap_near_2d(cell: vec2<i32>, size: vec2<i32>) -> vec2<i32> {
    var c = select(cell, cell + size, cell < vec2<i32>(0));
    c = select(c, c + size, c < vec2<i32>(0));
    c = select(c, c - size, c >= size);
    return select(c, c - size, c >= size);
}

/// A 3D cell at most two away from a wrapped one, wrapped without a division; a size of 0 leaves it as it is.
///
/// internal
fn wrap_near_3d(cell: vec3<i32>, size: vec3<i32>) -> vec3<i32> {
    var c = select(cell, cell + size, cell < vec3<i32>(0));
    c = select(c, c + size, c < vec3<i32>(0));
    c = select(c, c - size, c >= size);
    return select(c, c - size, c >= size);
}

/// The quintic fade 6 t^5 - 15 t^4 + 10 t^3, as t + s w (2 + 6 w) with s = t - 1/2 and w = t (1 - t), where
/// little cancels; 0 and 1 are exact. The floor takes off a rounding below 0.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-7 abs of reference::noise::fade
/// outside undefined
/// source  Perlin2002
fn fade_2d(t: vec2<f32>) -> vec2<f32> {
    let s = t - 0.5;
    let w = 0.25 - s * s;
    return max(s * w * (w * 6.0 + 2.0) + t, vec2<f32>(0.0));
}

/// The quintic fade, three at once.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-7 abs of reference::noise::fade
/// outside undefined
/// source  Perlin2002
fn fade_3d(t: vec3<f32>) -> vec3<f32> {
    let s = t - 0.5;
    let w = 0.25 - s * s;
    return max(s * w * (w * 6.0 + 2.0) + t, vec3<f32>(0.0));
}

/// The quintic fade of a fraction given as an integer of 2^32 a cell; cheaper than `fade_3d`, and not held above 0.
///
/// With s = 6^(1/5) (t - 1/2) the fade is 1/2 + s ((s^2 - a)^2 + b), which takes the fewest operations.
///
/// domain  fraction in [0, 4294967295] cell/2^32 lin
/// range   [-1.2e-7, 1.00000012] 1
/// error   1.8e-7 abs of reference::noise::fade_fraction
/// source  Perlin2002
fn fade_fraction_3d(fraction: vec3<u32>) -> vec3<f32> {
    let s = vec3<f32>(bitcast<vec3<i32>>(fraction ^ vec3<u32>(0x80000000u))) * FADE_UNIT;
    let d = s * s - FADE_A;
    return s * (d * d + FADE_B) + 0.5;
}

/// The position within a torus, in turns of 2^32, at `turns` whole and broken turns from its start.
///
/// domain  turns in [-4194304, 4194304] 1 lin
/// range   [0, 4294967295] turn/2^32
/// error   256 abs of reference::noise::turn_3d
/// source  ours; beside the error stands that of the turns as given, 2^-24 of them
fn turn_3d(turns: vec3<f32>) -> vec3<u32> {
    // Through an integer, because a compiler may take two sums that undo each other for nothing.
    let nearest = vec3<f32>(bitcast<vec3<i32>>(turns + 12582912.0) - 0x4b400000);
    return bitcast<vec3<u32>>(vec3<i32>((turns - nearest) * 4294967296.0));
}

/// The derivative of the quintic fade, 30 t^2 (1 - t)^2, expanded about t = 1/2, where it is largest.
///
/// domain  t in [0, 1] 1 lin
/// range   [-2e-7, 1.875] 1
/// error   4e-7 abs of reference::noise::fade_slope
/// outside undefined
/// source  Perlin2002
fn fade_slope_2d(t: vec2<f32>) -> vec2<f32> {
    let s = t - 0.5;
    let q = s * s;
    return 1.875 - q * (15.0 - 30.0 * q);
}

/// The derivative of the quintic fade, three at once.
///
/// domain  t in [0, 1] 1 lin
/// range   [-2e-7, 1.875] 1
/// error   4e-7 abs of reference::noise::fade_slope
/// outside undefined
/// source  Perlin2002
fn fade_slope_3d(t: vec3<f32>) -> vec3<f32> {
    let s = t - 0.5;
    let q = s * s;
    return 1.875 - q * (15.0 - 30.0 * q);
}
