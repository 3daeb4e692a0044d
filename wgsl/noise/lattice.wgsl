//! Positions on an integer lattice: a cell and a fraction, and the finer lattices of a fractal's octaves.
//!
//! The cell is an integer and the fraction small, so that a noise is as exact at cell 100 000 000 as at 0. Cells wrap at
//! 2^32.
//!
//! The lattice of octave i is 2^i times as fine and shifted by a constant, or all octaves would share the lattice points
//! of the first one, where gradient noise is 0 and value noise flat. The shifts are odd multiples of 1/64 (octave 0: none):
//! 2^k times any multiple of 1/64 is an even one, so that no lattice point of one octave is one of another. They step by
//! the fractional parts of the powers of the plastic number (in 3D of its successor), which spreads them evenly.
//!
//! source   Perlin2002 Improving noise (quintic fade); Roberts2018 R2 and R3 sequences (shifts)
//! symbols  cell lattice point [cell] · frac position within the cell [cell] · i octave [1]
#define_import_path veduta::noise::lattice

// 2^32 times the inverse powers of the plastic number (2D) and of the root of x^4 = x + 1 (3D).
const SHIFT_STEP_2D: vec2<u32> = vec2<u32>(3242174889u, 2447445413u);
const SHIFT_STEP_3D: vec3<u32> = vec3<u32>(3518319155u, 2882110345u, 2360945575u);
const SEED_SPREAD: u32 = 2654435761u;
// 2^32 / golden ratio.
const SEED_STEP: u32 = 2654435769u;

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

/// Moves the whole cells of the fraction into the cell.
///
/// The new fraction is exact, except that of a negative fraction above -2^-1, which is rounded to 2^-25; it is 1 just for
/// those above -2^-25.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [-8388608, 8388608] cell lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::split_2d
/// source  ours
fn split_2d(cell: vec2<i32>, frac: vec2<f32>) -> Lattice2d {
    let whole = floor(frac);
    return Lattice2d(cell + vec2<i32>(whole), frac - whole);
}

/// Moves the whole cells of the fraction into the cell.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [-8388608, 8388608] cell lin
/// range   [0, 1] cell
/// error   3e-8 abs of reference::noise::split_3d
/// source  ours
fn split_3d(cell: vec3<i32>, frac: vec3<f32>) -> Lattice3d {
    let whole = floor(frac);
    return Lattice3d(cell + vec3<i32>(whole), frac - whole);
}

/// 2^i, exact.
///
/// domain  i in [0, 126] 1 lin
/// range   [1, 8.507059e37] 1
/// error   0 abs of reference::noise::octave_frequency
/// monotone i
/// source  Leitner2022 alg. 1 (lacunarity 2)
fn octave_frequency(i: i32) -> f32 {
    return bitcast<f32>((i + 127) << 23u);
}

/// The seed of octave i; that of octave 0 is the seed itself.
///
/// domain  seed in [0, 4294967295] 1 lin
/// domain  i in [0, 22] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::noise::octave_seed
/// source  ours
fn octave_seed(seed: u32, i: i32) -> u32 {
    return seed + bitcast<u32>(i) * SEED_STEP;
}

/// The shift of octave i's lattice: an odd multiple of 1/64 a component, 0 for octave 0.
///
/// domain  i in [0, 22] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] cell
/// error   0 abs of reference::noise::octave_shift_2d
/// source  Roberts2018 R2 sequence, from a seed-derived start, rounded
fn octave_shift_2d(i: i32, seed: u32) -> vec2<f32> {
    let word = vec2<u32>(seed * SEED_SPREAD) + bitcast<u32>(i) * SHIFT_STEP_2D;
    let shift = vec2<f32>(bitcast<vec2<i32>>((word >> vec2<u32>(26u)) | vec2<u32>(1u))) * 0.015625;
    return select(shift, vec2<f32>(0.0), i == 0);
}

/// The shift of octave i's lattice in 3D.
///
/// domain  i in [0, 22] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] cell
/// error   0 abs of reference::noise::octave_shift_3d
/// source  Roberts2018 R3 sequence, from a seed-derived start, rounded
fn octave_shift_3d(i: i32, seed: u32) -> vec3<f32> {
    let word = vec3<u32>(seed * SEED_SPREAD) + bitcast<u32>(i) * SHIFT_STEP_3D;
    let shift = vec3<f32>(bitcast<vec3<i32>>((word >> vec3<u32>(26u)) | vec3<u32>(1u))) * 0.015625;
    return select(shift, vec3<f32>(0.0), i == 0);
}

/// A position on the lattice of octave i.
///
/// Scaling by 2^i and taking off the whole cells are exact; adding the shift rounds once, by at most 2^-24. The
/// fraction must be below 2^23 / 2^i.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  i in [0, 22] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] cell
/// error   6e-8 abs of reference::noise::octave_2d
/// source  Leitner2022 alg. 1; departs: shifted lattices, integer cells
fn octave_2d(cell: vec2<i32>, frac: vec2<f32>, i: i32, seed: u32) -> Lattice2d {
    let scaled = frac * octave_frequency(i);
    let whole = floor(scaled);
    let shifted = (scaled - whole) + octave_shift_2d(i, seed);
    let carry = floor(shifted);
    return Lattice2d((cell << vec2<u32>(bitcast<u32>(i))) + vec2<i32>(whole + carry), shifted - carry);
}

/// A position on the lattice of octave i in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  i in [0, 22] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] cell
/// error   6e-8 abs of reference::noise::octave_3d
/// source  Leitner2022 alg. 1; departs: shifted lattices, integer cells
fn octave_3d(cell: vec3<i32>, frac: vec3<f32>, i: i32, seed: u32) -> Lattice3d {
    let scaled = frac * octave_frequency(i);
    let whole = floor(scaled);
    let shifted = (scaled - whole) + octave_shift_3d(i, seed);
    let carry = floor(shifted);
    return Lattice3d((cell << vec3<u32>(bitcast<u32>(i))) + vec3<i32>(whole + carry), shifted - carry);
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

/// The quintic fade 6 t^5 - 15 t^4 + 10 t^3, written about t = 1/2, where nothing cancels; 0 and 1 are exact.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   2e-7 abs of reference::noise::fade
/// source  Perlin2002
fn fade_2d(t: vec2<f32>) -> vec2<f32> {
    let s = t - 0.5;
    let q = s * s;
    return s * (q * (q * 6.0 - 5.0) + 1.875) + 0.5;
}

/// The quintic fade, three at once.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   2e-7 abs of reference::noise::fade
/// source  Perlin2002
fn fade_3d(t: vec3<f32>) -> vec3<f32> {
    let s = t - 0.5;
    let q = s * s;
    return s * (q * (q * 6.0 - 5.0) + 1.875) + 0.5;
}

/// The derivative of the quintic fade, 30 t^2 (1 - t)^2.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1.875] 1
/// error   5e-7 abs of reference::noise::fade_slope
/// source  Perlin2002
fn fade_slope_2d(t: vec2<f32>) -> vec2<f32> {
    let s = t - 0.5;
    let q = 0.25 - s * s;
    return 30.0 * (q * q);
}

/// The derivative of the quintic fade, three at once.
///
/// domain  t in [0, 1] 1 lin
/// range   [0, 1.875] 1
/// error   5e-7 abs of reference::noise::fade_slope
/// source  Perlin2002
fn fade_slope_3d(t: vec3<f32>) -> vec3<f32> {
    let s = t - 0.5;
    let q = 0.25 - s * s;
    return 30.0 * (q * q);
}
