//! Height fields of noise on an endless plane, filtered by the footprint: height, gradient, and what the filter took off.
//!
//! Octave i has lattice cells of l / 2^i, and most of its power at wavelengths of about 1.7 cells. It counts fully while a cell is 2 footprints or more, and
//! is gone at 1, where the mean over a footprint still holds half of it, but two thirds of its power could not be sampled. What takes its place is not 0: let H_k be
//! the mean of the field over all that octaves k, k + 1, .. may be, with the octaves before them as they are. In a sum H_k is the sum so far, but in a
//! multifractal it also depends on the weight W that octave k inherits; H_k = sum + t_k W (1 + b (1 - W)), where t_k is the sum of a geometric series
//! over the octaves left. The filtered field mixes H_k and H_(k+1) by the share of the one octave that is fading, so that it keeps its mean, and changes
//! smoothly with the footprint. The mean square of the slopes that are left out is followed in the same way, for shading.
//!
//! The mesa is an fBm whose values pass through strata: T(v) = v + h s sum of w_j sin(2 pi j v / s) / (pi j), with Fejer's weights, so that it never falls: flat benches and cliffs five
//! times as steep. Its mean over values with a variance follows harmonic by harmonic.
//!
//! source   Leitner2022 alg. 1 to 3; Musgrave2003 (hybrid and ridged multifractal); the filter: ours
//! symbols  offset place from the eye, (x, z) [m] · footprint width of what one sample stands for [m] · kind which field [1]
#define_import_path veduta::terrain::field

#import veduta::noise::lattice::{Lattice2d, split_2d, finer_2d, shifted_2d, octave_seed}
#import veduta::noise::gradient::{gradient_at_2d_slope}
#import veduta::hash::lattice::{lattice_hash_2d}
#import veduta::fractal::ridged::{smooth_abs}
#import veduta::terrain::height::{Terrain, height as own_height}

const FIELD_FBM: i32 = 0;
const FIELD_HYBRID: i32 = 1;
const FIELD_RIDGED: i32 = 2;
const FIELD_CRATERS: i32 = 3;
const FIELD_MIX: i32 = 4;
const FIELD_OWN: i32 = 5;
const FIELD_MESA: i32 = 6;
/// An fBm, to which `veduta::terrain::relief` adds a height map.
const FIELD_MAP: i32 = 7;

/// A height field and where the eye is on it; the host makes it (`veduta::terrain::HeightField`).
struct Field {
    /// Lattice cell of the eye's foot point, in units of the wavelength.
    cell: vec2<i32>,
    /// Fraction within that cell, in [0, 1).
    frac: vec2<f32>,
    /// Wavelength of the lattice [m], > 0.
    wavelength: f32,
    /// Height of a value of 1 [m].
    amplitude: f32,
    /// Height of a value of 0 [m].
    base: f32,
    /// What the amplitude falls by from octave to octave.
    fall: f32,
    /// Offset of the hybrid, gain of the ridged multifractal, share of cells with a crater, power of the mountains, period of the strata, or edge of the map.
    shape: f32,
    /// Rounding of the crests of the ridged multifractal; height of the noise between craters; hardness of the strata.
    detail: f32,
    /// Octaves.
    octaves: i32,
    /// Seed of the lattice.
    seed: u32,
    /// The mean of what follows octave 0: t_0, what octave 0 takes off it, by what that falls from octave to octave, and the bend b.
    mean: vec4<f32>,
    /// The same of the mean square of the slopes, per cell.
    lost: vec4<f32>,
    /// Height of the sea, below which there is no ground [m]; -1e30 without a sea.
    sea: f32,
}

/// The filtered field at a place.
struct Ground {
    /// Height [m].
    height: f32,
    /// Slope (dh/dx, dh/dz).
    slope: vec2<f32>,
    /// Mean square of the slopes that the filter took off.
    lost: f32,
}

/// Profile of one crater against the distance from its middle in radii, squared, and its slope over that square: a bowl, a rim, and ejecta that end at 2.
///
/// internal
fn crater_profile(x: f32, square: f32) -> vec2<f32> {
    let hollow = max(1.0 - square, 0.0);
    // The rim falls off faster inwards than outwards.
    let inverse = select(1.0, 2.5, x < 1.0);
    let y = (x - 1.0) * inverse;
    let ring = max(1.0 - y * y, 0.0);
    let bowl = vec2<f32>(-0.4 * hollow * hollow, 0.8 * hollow);
    return bowl + vec2<f32>(0.08 * ring * ring, -0.16 * ring * y * inverse / max(x, 1e-4));
}

/// Craters of one lattice: value and slope per cell. Each cell may hold one crater of a radius of 0.15 to 0.4 cells, in the middle half of the cell.
///
/// internal
fn crater_cells(p: Lattice2d, share: f32, seed: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var k = 0; k < 9; k++) {
        let step = vec2<i32>(k % 3 - 1, k / 3 - 1);
        let words = lattice_hash_2d(p.cell + step, seed);
        let jitter = vec2<f32>(words & vec2<u32>(0xffffu)) * 7.62939453125e-6 + 0.25;
        let chance = f32(words.x >> 16u) * 1.52587890625e-5;
        let size = f32(words.y >> 16u) * 1.52587890625e-5;
        // Small craters are more common.
        let radius = 0.15 + 0.25 * size * size;
        let away = (p.frac - vec2<f32>(step) - jitter) / radius;
        let square = dot(away, away);
        let profile = crater_profile(sqrt(square), square);
        let there = select(0.0, radius, chance < share);
        sum += there * vec3<f32>(profile.x, profile.y * 2.0 * away / radius);
    }
    return sum;
}

/// What the strata make of a value of a given variance: the mean, its slope, and what its slope's square varies by.
///
/// internal
fn strata(value: f32, period: f32, hardness: f32, variance: f32) -> vec3<f32> {
    let turn = value / period;
    let r = turn - floor(turn + 0.5);
    let q = r * r;
    // Sine and cosine of half the angle.
    let s = r * ((((0.0772201193526 * q - 0.598045169271) * q + 2.55003137647) * q - 5.16770687888) * q + 3.14159258004);
    let c = ((((-0.0243967164202 * q + 0.234937559128) * q - 1.33521205679) * q + 4.05870916436) * q - 4.93480213723) * q + 0.999999999781;
    let sine = 2.0 * s * c;
    let cosine = 1.0 - 2.0 * s * s;
    // exp(-y) as (1 + y/16)^-16, y = (2 pi / period)^2 variance / 2.
    let base = 1.0 / (1.0 + 1.23370055 * variance / (period * period));
    let square = base * base;
    let fourth = square * square;
    let eighth = fourth * fourth;
    let e = eighth * eighth;
    let e_two = e * e;
    let e_four = e_two * e_two;
    let e_eight = e_four * e_four;
    let e_nine = e_eight * e;
    let e_sixteen = e_eight * e_eight;
    let sine_two = 2.0 * cosine * sine;
    let cosine_two = 2.0 * cosine * cosine - 1.0;
    let sine_three = 2.0 * cosine * sine_two - sine;
    let cosine_three = 2.0 * cosine * cosine_two - cosine;
    let sine_four = 2.0 * cosine * sine_three - sine_two;
    let cosine_four = 2.0 * cosine * cosine_three - cosine_two;
    let wave = 0.8 * e * sine + 0.3 * e_four * sine_two + 0.13333333 * e_nine * sine_three + 0.05 * e_sixteen * sine_four;
    let slope = 0.8 * e * cosine + 0.6 * e_four * cosine_two + 0.4 * e_nine * cosine_three + 0.2 * e_sixteen * cosine_four;
    let spread = 0.64 * (1.0 - e * e) + 0.36 * (1.0 - e_four * e_four) + 0.16 * (1.0 - e_nine * e_nine) + 0.04 * (1.0 - e_sixteen * e_sixteen);
    return vec3<f32>(value + 0.31830988618 * hardness * period * wave, 1.0 + 2.0 * hardness * slope, 2.0 * hardness * hardness * spread);
}

/// The sum over octaves for all kinds but the mix.
///
/// internal
fn octave_sum(field: Field, kind: i32, start: Lattice2d, footprint: f32) -> Ground {
    var p = start;
    var reach = field.wavelength / max(footprint, 1e-6);
    var amplitude = 1.0;
    var frequency = 1.0;
    var weight = vec3<f32>(1.0, 0.0, 0.0);
    var sum = vec3<f32>(0.0);
    var tail = field.mean.x;
    var tail_step = field.mean.y;
    var rough = field.lost.x;
    var rough_step = field.lost.y;
    // The mesa follows the variance of what is left in the place of its mean, which is 0.
    var mean = vec3<f32>(select(tail, 0.0, kind == FIELD_MESA), 0.0, 0.0);
    var variance = tail;
    var lost = rough;
    for (var i = 0; i < field.octaves; i++) {
        if reach <= 1.0 {
            break;
        }
        let x = min(reach - 1.0, 1.0);
        let keep = x * x * (3.0 - 2.0 * x);
        let seed = octave_seed(field.seed, i);
        let q = shifted_2d(p, i);
        p = finer_2d(p);
        let n = gradient_at_2d_slope(q, seed);
        var term = vec3<f32>(n.x, frequency * n.yz);
        if kind == FIELD_RIDGED {
            let size = smooth_abs(n.x, field.detail);
            let ridge = 1.0 - size;
            let square = ridge * ridge;
            let off = -2.0 * ridge * (n.x / max(size, 1e-30)) * frequency;
            term = vec3<f32>(square * weight.x, off * weight.x * n.yz + square * weight.yz);
            let next = field.shape * term;
            weight = select(next, vec3<f32>(1.0, 0.0, 0.0), next.x >= 1.0);
            term *= amplitude;
        } else if kind == FIELD_HYBRID {
            // Compilers take the sums of the noise and this one in any order; a bound that no noise reaches keeps them apart.
            let signal = amplitude * vec3<f32>(max(n.x, -8.0) + field.shape, frequency * n.yz);
            term = vec3<f32>(weight.x * signal.x, weight.x * signal.yz + signal.x * weight.yz);
            weight = select(term, vec3<f32>(1.0, 0.0, 0.0), term.x >= 1.0);
        } else if kind == FIELD_CRATERS {
            let craters = crater_cells(q, field.shape, seed);
            let both = craters + field.detail * n;
            term = amplitude * vec3<f32>(both.x, frequency * both.yz);
        } else {
            term *= amplitude;
        }
        sum += term;
        if kind == FIELD_HYBRID {
            // Weights shrink so fast there that the first octave left is nearly all: a geometric sequence, not a sum.
            tail *= field.mean.z;
            rough *= field.lost.z;
        } else {
            tail -= tail_step;
            rough -= rough_step;
        }
        tail_step *= field.mean.z;
        rough_step *= field.lost.z;
        frequency *= 2.0;
        amplitude *= field.fall;
        reach *= 0.5;
        // Nothing follows the last octave: rounding must not leave any of it.
        let left = select(1.0, 0.0, i + 1 == field.octaves);
        let means = select(left * tail, 0.0, kind == FIELD_MESA);
        let rest = means * (1.0 + field.mean.w * (1.0 - weight.x));
        let slope = means * (1.0 + field.mean.w * (1.0 - 2.0 * weight.x));
        let after = sum + vec3<f32>(rest * weight.x, slope * weight.yz);
        let after_lost = left * max(rough, 0.0) * weight.x * (1.0 + field.lost.w * (1.0 - weight.x));
        mean = mean * (1.0 - keep) + after * keep;
        let after_variance = left * max(tail, 0.0);
        variance = after_variance + (1.0 - keep * keep) * (variance - after_variance);
        lost = max(after_lost + (1.0 - keep * keep) * (lost - after_lost), 0.0);
    }
    let steepness = field.amplitude / field.wavelength;
    if kind == FIELD_MESA {
        // What the footprint holds of the slopes that are left makes values vary, too.
        let across = footprint / field.wavelength;
        let beds = strata(mean.x, field.shape, field.detail, max(variance, 0.0) + 0.083333333 * across * across * max(field.lost.x - lost, 0.0));
        lost = lost * (beds.y * beds.y + beds.z) + beds.z * dot(mean.yz, mean.yz);
        mean = vec3<f32>(beds.x, beds.y * mean.yz);
    }
    return Ground(field.base + field.amplitude * mean.x, steepness * mean.yz, steepness * steepness * lost);
}

/// A part of the mix: fBm from octave `level` of the lattice on. Value, slope per cell, and the mean square of the slopes left out.
///
/// internal
fn mix_part(field: Field, start: Lattice2d, level: i32, octaves: i32, total: f32, seed: u32, footprint: f32) -> vec4<f32> {
    var p = start;
    var frequency = 1.0;
    for (var i = 0; i < level; i++) {
        p = finer_2d(p);
        frequency *= 2.0;
    }
    var reach = field.wavelength / (frequency * max(footprint, 1e-6));
    var amplitude = 1.0;
    var rough_step = field.lost.y * frequency * frequency;
    var rough = total;
    var sum = vec3<f32>(0.0);
    var lost = rough;
    for (var i = 0; i < octaves; i++) {
        if reach <= 1.0 {
            break;
        }
        let x = min(reach - 1.0, 1.0);
        let keep = x * x * (3.0 - 2.0 * x);
        let n = gradient_at_2d_slope(shifted_2d(p, level + i), octave_seed(seed, i));
        p = finer_2d(p);
        sum += amplitude * keep * vec3<f32>(n.x, frequency * n.yz);
        rough = select(rough - rough_step, 0.0, i + 1 == octaves);
        lost = max(rough + (1.0 - keep * keep) * rough_step, 0.0);
        rough_step *= field.lost.z;
        frequency *= 2.0;
        amplitude *= field.fall;
        reach *= 0.5;
    }
    return vec4<f32>(sum, lost);
}

/// Lowlands and jagged mountains: 0.1 n1 (1 + n2)^m + 0.2 n2 + n3, with n1, n2 and n3 at octaves 3, 2 and 0 of the lattice.
///
/// internal
fn mix_sum(field: Field, start: Lattice2d, footprint: f32) -> Ground {
    let fine = mix_part(field, start, 3, field.octaves, field.lost.x, field.seed, footprint);
    let middle = mix_part(field, start, 2, 3, field.mean.x, field.seed + 1u, footprint);
    let coarse = mix_part(field, start, 0, 1, field.lost.y, field.seed + 2u, footprint);
    let lift = max(1.0 + middle.x, 0.0);
    var power = 1.0;
    var below = 0.0;
    for (var i = 0; i < i32(field.shape); i++) {
        below = power;
        power *= lift;
    }
    let bend = 0.1 * fine.x * field.shape * below;
    let value = 0.1 * fine.x * power + 0.2 * middle.x + coarse.x;
    let slope = 0.1 * power * fine.yz + (bend + 0.2) * middle.yz + coarse.yz;
    let lost = 0.01 * power * power * fine.w + (bend + 0.2) * (bend + 0.2) * middle.w + coarse.w;
    let steepness = field.amplitude / field.wavelength;
    return Ground(field.base + field.amplitude * value, steepness * slope, steepness * steepness * lost);
}

/// The program's own function (`veduta::terrain::height::height`) with so many octaves and a share of one more.
///
/// internal
fn own_faded(terrain: Terrain, offset: vec2<f32>, octaves: i32, share: f32) -> f32 {
    let coarse = own_height(terrain, offset, octaves);
    if share <= 0.0 {
        return coarse;
    }
    return mix(coarse, own_height(terrain, offset, octaves + 1), share);
}

/// The program's own function, with as many octaves as the footprint leaves, the last of which fades as those of other kinds do, and slopes by differences over it.
///
/// internal
fn own_sum(field: Field, offset: vec2<f32>, footprint: f32) -> Ground {
    let width = max(footprint, 1e-3);
    let reach = max(field.wavelength / width, 1.0);
    let whole = i32(floor(log2(reach)));
    let octaves = clamp(whole, 1, field.octaves);
    // By how much the cells of the octave after these exceed the footprint.
    let x = clamp(reach / exp2(f32(whole)) - 1.0, 0.0, 1.0);
    let share = select(0.0, x * x * (3.0 - 2.0 * x), whole >= 1 && whole < field.octaves);
    let terrain = Terrain(field.cell, field.frac, field.wavelength, field.amplitude, -log2(field.fall), field.shape, field.detail, field.seed);
    let east = own_faded(terrain, offset + vec2<f32>(width, 0.0), octaves, share);
    let west = own_faded(terrain, offset - vec2<f32>(width, 0.0), octaves, share);
    let south = own_faded(terrain, offset + vec2<f32>(0.0, width), octaves, share);
    let north = own_faded(terrain, offset - vec2<f32>(0.0, width), octaves, share);
    let middle = own_faded(terrain, offset, octaves, share);
    return Ground(field.base + middle, vec2<f32>(east - west, south - north) / (2.0 * width), 0.0);
}

/// The place on the lattice at an offset from the eye. Whole cells are taken off the offset before it is divided: the wavelength stands in two parts, of which the first times a number of cells
/// below 32,768 is exact.
///
/// internal
fn field_place(field: Field, offset: vec2<f32>) -> Lattice2d {
    let whole = floor(offset / field.wavelength);
    let high = bitcast<f32>(bitcast<u32>(field.wavelength) & 0xffff8000u);
    let rest = (offset - whole * high) - whole * (field.wavelength - high);
    let at = split_2d(field.cell, field.frac + rest / field.wavelength);
    return Lattice2d(at.cell + vec2<i32>(whole), at.frac);
}

/// The field at a place, filtered by the footprint. `kind` is one of the constants `FIELD_..`; given as an override it costs nothing. Of `FIELD_MAP` this is the detail.
///
/// domain  kind in [0, 7] 1 lin
/// domain  offset in [-1e5, 1e5] m lin
/// domain  footprint in [1e-3, 1e5] m log
/// range   [-1e5, 1e5] 1
/// error   0.1 abs of reference::field::ground
/// outside undefined
/// source  Leitner2022 alg. 1 to 3; the filter: ours
fn ground_at(field: Field, kind: i32, offset: vec2<f32>, footprint: f32) -> Ground {
    if kind == FIELD_OWN {
        return own_sum(field, offset, footprint);
    }
    let start = field_place(field, offset);
    if kind == FIELD_MIX {
        return mix_sum(field, start, footprint);
    }
    return octave_sum(field, kind, start, footprint);
}

/// How much the heights within a footprint differ: their standard deviation, from the slope that is seen and the mean square of those that are left out, which `left` octaves share, each `fall` as
/// high as the one before. [m]
///
/// domain  slope in [-10, 10] 1 lin
/// domain  lost in [0, 100] 1 lin
/// domain  footprint in [1e-3, 1e5] m log
/// domain  left in [0, 16] 1 lin
/// domain  fall in [0.1, 1] 1 lin
/// range   [0, 1e6] m
/// error   1e-4 rel of reference::field::height_spread
/// outside undefined
/// source  ours: a slope over a square, and the part of the lost slopes that the coarsest octave has, over its cells
fn height_spread(slope: vec2<f32>, lost: f32, footprint: f32, left: f32, fall: f32) -> f32 {
    // Squared slopes grow by this from octave to octave; the coarsest has this share of their sum.
    let growth = 4.0 * fall * fall;
    let whole = exp2(max(left, 1.0) * log2(growth));
    let near = abs(growth - 1.0) < 1e-2;
    let share = select((growth - 1.0) / select(whole - 1.0, 1.0, near), 1.0 / max(left, 1.0), near);
    return footprint * sqrt(0.083333333 * dot(slope, slope) + 0.18 * share * lost);
}
