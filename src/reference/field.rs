//! Height fields filtered by the footprint, from their definition: whole fractals of k octaves, and the mean of what follows.

use super::fractal::{
    fbm_2d_slope, hybrid_multifractal_2d_slope, octave_amplitude, octave_noise_2d,
    ridged_multifractal_2d_slope,
};
use super::hash::lattice_hash_2d;
use super::noise::{octave_2d, octave_frequency, octave_seed, split_2d};

/// A height field and where the eye is on it: the members of `veduta::terrain::field::Field`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Lattice cell of the eye's foot point.
    pub cell: [i32; 2],
    /// Fraction within that cell.
    pub frac: [f64; 2],
    /// Wavelength of the lattice.
    pub wavelength: f64,
    /// Height of a value of 1.
    pub amplitude: f64,
    /// Height of a value of 0.
    pub base: f64,
    /// Fall of the amplitude from octave to octave.
    pub fall: f64,
    /// First parameter of the kind.
    pub shape: f64,
    /// Second parameter of the kind.
    pub detail: f64,
    /// Octaves.
    pub octaves: i32,
    /// Seed of the lattice.
    pub seed: u32,
    /// Series of the mean of what is left out: total, first, ratio, bend.
    pub mean: [f64; 4],
    /// Series of the squared slope of what is left out.
    pub lost: [f64; 4],
    /// Height of the sea; no ground of a land is below it.
    pub sea: f64,
}

/// The filtered field at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Height.
    pub height: f64,
    /// Slope (dh/dx, dh/dz).
    pub slope: [f64; 2],
    /// Mean square of the slopes left out.
    pub lost: f64,
}

/// The share of an octave that is left: 1 while its cells are two footprints wide, 0 at one.
pub fn kept(wavelength: f64, footprint: f64) -> f64 {
    let x = (wavelength / footprint.max(1e-6) - 1.0).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// What is left of a series after so many of its terms; the hybrid's is a geometric sequence.
pub(super) fn remainder(kind: i32, [total, first, ratio, _]: [f64; 4], terms: i32) -> f64 {
    if kind == 1 {
        return total * ratio.powi(terms);
    }
    total - (0..terms).map(|i| first * ratio.powi(i)).sum::<f64>()
}

/// Profile of a crater and its slope; `outside` is how far its ejecta reach beyond the rim.
pub(super) fn crater(x: f64, outside: f64) -> [f64; 2] {
    let mut all = [0.0; 2];
    if x < 1.0 {
        all[0] -= 0.4 * (1.0 - x * x).powi(2);
        all[1] += 1.6 * x * (1.0 - x * x);
    }
    let width = if x < 1.0 { 0.4 } else { outside };
    let y = (x - 1.0) / width;
    if y.abs() < 1.0 {
        all[0] += 0.08 * (1.0 - y * y).powi(2);
        all[1] -= 0.32 * y * (1.0 - y * y) / width;
    }
    all
}

/// The craters of octave i: value and slope per cell of octave 0.
fn crater_octave(field: &Field, cell: [i32; 2], frac: [f64; 2], i: i32) -> [f64; 3] {
    let p = octave_2d(cell, frac, i);
    let mut sum = [0.0; 3];
    for dy in -1..=1 {
        for dx in -1..=1 {
            let home = [p.cell[0].wrapping_add(dx), p.cell[1].wrapping_add(dy)];
            let words = lattice_hash_2d(home, octave_seed(field.seed, i));
            if f64::from(words[0] >> 16) / 65536.0 >= field.shape {
                continue;
            }
            let radius = 0.15 + 0.25 * (f64::from(words[1] >> 16) / 65536.0).powi(2);
            let middle = words.map(|w| 0.25 + 0.5 * f64::from(w & 0xffff) / 65536.0);
            let away = [
                p.frac[0] - f64::from(dx) - middle[0],
                p.frac[1] - f64::from(dy) - middle[1],
            ];
            let distance = away[0].hypot(away[1]);
            let [value, slope] = crater(distance / radius, 1.0);
            sum[0] += radius * value;
            for k in 0..2 {
                // The middle of a bowl is level.
                sum[k + 1] += octave_frequency(i) * slope * away[k] / distance.max(1e-12);
            }
        }
    }
    sum
}

/// The first k octaves with slopes per cell, and the weight that the next inherits, with its slopes.
fn first_octaves(
    field: &Field,
    kind: i32,
    cell: [i32; 2],
    frac: [f64; 2],
    count: i32,
) -> [[f64; 3]; 2] {
    let hurst = -field.fall.log2();
    let one = [1.0, 0.0, 0.0];
    let fractal = |k: i32| match kind {
        1 => hybrid_multifractal_2d_slope(cell, frac, k, hurst, field.shape, field.seed),
        2 => ridged_multifractal_2d_slope(
            cell,
            frac,
            k,
            hurst,
            field.shape,
            field.detail,
            field.seed,
        ),
        3 => {
            let mut sum = [0.0; 3];
            for i in 0..k {
                let craters = crater_octave(field, cell, frac, i);
                let noise = octave_noise_2d(cell, frac, i, field.seed);
                for a in 0..3 {
                    sum[a] += octave_amplitude(i, hurst) * (craters[a] + field.detail * noise[a]);
                }
            }
            sum
        }
        _ => fbm_2d_slope(cell, frac, k, hurst, field.seed),
    };
    let sum = fractal(count);
    if count == 0 || !(kind == 1 || kind == 2) {
        return [sum, one];
    }
    // The last octave's term, from which the weight of the next follows.
    let before = fractal(count - 1);
    let factor = if kind == 2 {
        field.shape / octave_amplitude(count - 1, hurst)
    } else {
        1.0
    };
    let weight: [f64; 3] = std::array::from_fn(|a| (sum[a] - before[a]) * factor);
    [sum, if weight[0] >= 1.0 { one } else { weight }]
}

/// The strata's mean over values with a variance, its slope, and the variance of its slope.
fn strata(value: f64, period: f64, hardness: f64, variance: f64) -> [f64; 3] {
    use std::f64::consts::{PI, TAU};
    let mut all = [value, 1.0, 0.0];
    for j in 1..=4 {
        let (j, weight) = (f64::from(j), 1.0 - f64::from(j) / 5.0);
        let turn = TAU * j / period;
        // A Gaussian's effect on a wave, exp(-y), as the device has it.
        let left = (1.0 + (TAU / period).powi(2) * variance / 32.0).powf(-16.0 * j * j);
        all[0] += hardness * period * weight / (PI * j) * left * (turn * value).sin();
        all[1] += 2.0 * hardness * weight * left * (turn * value).cos();
        all[2] += 2.0 * (hardness * weight).powi(2) * (1.0 - left * left);
    }
    all
}

/// An fBm in strata: values vary by what is left out, and within the footprint by the slopes that are not.
fn mesa(field: &Field, cell: [i32; 2], frac: [f64; 2], footprint: f64) -> Ground {
    let hurst = -field.fall.log2();
    let mut value = [0.0; 3];
    for i in 0..field.octaves {
        let keep = kept(field.wavelength / octave_frequency(i), footprint);
        let n = octave_noise_2d(cell, frac, i, field.seed);
        for a in 0..3 {
            value[a] += keep * octave_amplitude(i, hurst) * n[a];
        }
    }
    let share = |i: i32| kept(field.wavelength / octave_frequency(i), footprint);
    let whole = (0..field.octaves).take_while(|i| share(*i) >= 1.0).count() as i32;
    // What is left by the octaves that count, and of the one that fades by as much as its square.
    let left = |series: [f64; 4]| {
        let after = |k: i32| {
            if k >= field.octaves {
                0.0
            } else {
                remainder(6, series, k).max(0.0)
            }
        };
        let keep = if whole < field.octaves {
            share(whole)
        } else {
            0.0
        };
        after(whole) - keep * keep * (after(whole) - after(whole + 1))
    };
    let (variance, lost) = (left(field.mean), left(field.lost));
    let within = (footprint / field.wavelength).powi(2) / 12.0 * (field.lost[0] - lost).max(0.0);
    let [height, slope, spread] = strata(
        value[0],
        field.shape,
        field.detail,
        variance.max(0.0) + within,
    );
    let square = value[1] * value[1] + value[2] * value[2];
    let lost = lost.max(0.0) * (slope * slope + spread) + spread * square;
    scaled(field, [height, slope * value[1], slope * value[2]], lost)
}

/// The field at an offset (x, z) from the eye, filtered by a footprint.
pub fn ground(field: &Field, kind: i32, offset: [f64; 2], footprint: f64) -> Ground {
    let place: [f64; 2] = std::array::from_fn(|k| field.frac[k] + offset[k] / field.wavelength);
    let p = split_2d(field.cell, place);
    if kind == 5 {
        return own(field, offset, footprint);
    }
    if kind == 4 {
        return mix(field, p.cell, p.frac, footprint);
    }
    if kind == 6 {
        return mesa(field, p.cell, p.frac, footprint);
    }
    let share = |i: i32| kept(field.wavelength / octave_frequency(i), footprint);
    let whole = (0..field.octaves).take_while(|i| share(*i) >= 1.0).count() as i32;
    // The mean over all that follows octave k, and the square of its slopes.
    let held = |k: i32| {
        let [sum, w] = first_octaves(field, kind, p.cell, p.frac, k);
        if k == field.octaves {
            return (sum, 0.0);
        }
        let (rest, bend) = (remainder(kind, field.mean, k), field.mean[3]);
        let value = sum[0] + rest * w[0] * (1.0 + bend * (1.0 - w[0]));
        let slope = rest * (1.0 + bend * (1.0 - 2.0 * w[0]));
        let lost =
            remainder(kind, field.lost, k).max(0.0) * w[0] * (1.0 + field.lost[3] * (1.0 - w[0]));
        ([value, sum[1] + slope * w[1], sum[2] + slope * w[2]], lost)
    };
    let (mut value, mut lost) = held(whole);
    if whole < field.octaves {
        let keep = share(whole);
        if keep > 0.0 {
            let (next, next_lost) = held(whole + 1);
            value = std::array::from_fn(|a| value[a] + keep * (next[a] - value[a]));
            lost = next_lost + (1.0 - keep * keep) * (lost - next_lost);
        }
    }
    scaled(field, value, lost.max(0.0))
}

/// The program's own function, which is `veduta::terrain::height` unless a program has another, with octaves that fade and slopes by differences over the footprint.
fn own(field: &Field, offset: [f64; 2], footprint: f64) -> Ground {
    let width = footprint.max(1e-3);
    let reach = (field.wavelength / width).max(1.0);
    let whole = reach.log2().floor() as i32;
    let x = (reach / f64::from(whole).exp2() - 1.0).clamp(0.0, 1.0);
    let share = if whole >= 1 && whole < field.octaves {
        x * x * (3.0 - 2.0 * x)
    } else {
        0.0
    };
    let octaves = whole.clamp(1, field.octaves.max(1));
    let land = super::terrain::Terrain {
        cell: field.cell,
        frac: field.frac,
        wavelength: field.wavelength,
        amplitude: field.amplitude,
        hurst: -field.fall.log2(),
        gain: field.shape,
        smoothness: field.detail,
        seed: field.seed,
    };
    let at = |x: f64, z: f64| {
        let place = [offset[0] + x, offset[1] + z];
        let coarse = super::terrain::height(&land, place, octaves);
        if share <= 0.0 {
            return coarse;
        }
        coarse + share * (super::terrain::height(&land, place, octaves + 1) - coarse)
    };
    Ground {
        height: field.base + at(0.0, 0.0),
        slope: [
            (at(width, 0.0) - at(-width, 0.0)) / (2.0 * width),
            (at(0.0, width) - at(0.0, -width)) / (2.0 * width),
        ],
        lost: 0.0,
    }
}

fn scaled(field: &Field, value: [f64; 3], lost: f64) -> Ground {
    let steepness = field.amplitude / field.wavelength;
    Ground {
        height: field.base + field.amplitude * value[0],
        slope: [steepness * value[1], steepness * value[2]],
        lost: steepness * steepness * lost,
    }
}

/// Lowlands and jagged mountains.
fn mix(field: &Field, cell: [i32; 2], frac: [f64; 2], footprint: f64) -> Ground {
    let part = |level: i32, octaves: i32, seed: u32| -> [f64; 4] {
        let mut sum = [0.0; 4];
        for i in 0..octaves {
            let at = octave_2d(cell, frac, level + i);
            let n = super::noise::gradient_noise_2d_slope(
                at.cell,
                at.frac,
                octave_seed(field.seed.wrapping_add(seed), i),
            );
            let f = octave_frequency(level + i);
            let a = field.fall.powi(i);
            let keep = kept(field.wavelength / f, footprint);
            sum[0] += a * keep * n[0];
            sum[1] += a * keep * f * n[1];
            sum[2] += a * keep * f * n[2];
            sum[3] += (1.0 - keep * keep) * field.lost[1] * (a * f).powi(2);
        }
        sum
    };
    let (fine, middle, coarse) = (part(3, field.octaves, 0), part(2, 3, 1), part(0, 1, 2));
    let lift = (1.0 + middle[0]).max(0.0);
    let m = field.shape.floor();
    let power = lift.powf(m);
    let bend = 0.1 * fine[0] * m * lift.powf(m - 1.0) + 0.2;
    let value = std::array::from_fn(|a| match a {
        0 => 0.1 * fine[0] * power + 0.2 * middle[0] + coarse[0],
        _ => 0.1 * power * fine[a] + bend * middle[a] + coarse[a],
    });
    let lost = 0.01 * power * power * fine[3] + bend * bend * middle[3] + coarse[3];
    scaled(field, value, lost)
}

/// Standard deviation of the heights within a footprint (m).
pub fn height_spread(slope: [f64; 2], lost: f64, footprint: f64, left: f64, fall: f64) -> f64 {
    let growth = 4.0 * fall * fall;
    let share = if (growth - 1.0).abs() < 1e-2 {
        1.0 / left.max(1.0)
    } else {
        (growth - 1.0) / (growth.powf(left.max(1.0)) - 1.0)
    };
    let square = slope[0] * slope[0] + slope[1] * slope[1];
    footprint * (square / 12.0 + 0.18 * share * lost).sqrt()
}
