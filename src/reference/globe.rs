//! Height fields on a ball filtered by the footprint, from their definition: the twin of `veduta::terrain::globe`.

use super::field::{crater, kept, remainder};
use super::fractal::octave_amplitude;
use super::hash::lattice_hash_3d;
use super::math::{add, dot, length, normalize, scale};
use super::noise::{
    Lattice3d, gradient_noise_3d_slope, octave_3d, octave_frequency, octave_seed, split_3d,
};

/// A height field on a ball and where the eye is: the members of `veduta::terrain::globe::Globe`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Globe {
    /// Lattice cell of the eye's direction times the radius.
    pub cell: [i32; 3],
    /// Wavelength of the lattice.
    pub wavelength: f64,
    /// Fraction within that cell.
    pub frac: [f64; 3],
    /// Height of a value of 1.
    pub amplitude: f64,
    /// Unit vector from the centre to the eye.
    pub up: [f64; 3],
    /// Height of a value of 0.
    pub base: f64,
    /// Radius of the planet.
    pub ground_radius: f64,
    /// Altitude of the eye.
    pub eye_altitude: f64,
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
    /// Height of the sea.
    pub sea: f64,
    /// Series of the mean of what is left out: total, first, ratio, bend.
    pub mean: [f64; 4],
    /// Series of the squared slope of what is left out.
    pub lost: [f64; 4],
    /// No ground is below.
    pub low: f64,
    /// No ground is above.
    pub high: f64,
    /// No slope is steeper.
    pub steepest: f64,
    /// No octave adds more.
    pub tallest: f64,
    /// Steepest slope of octave 0.
    pub steep: f64,
    /// Growth of that from octave to octave.
    pub steep_growth: f64,
}

/// The filtered field at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobeGround {
    /// Height.
    pub height: f64,
    /// Change of the height along the ball.
    pub slope: [f64; 3],
    /// Mean square of the slopes left out.
    pub lost: f64,
}

/// A value and its gradient.
type Slope = [f64; 4];

fn sum(a: Slope, b: Slope) -> Slope {
    std::array::from_fn(|k| a[k] + b[k])
}

fn times(a: Slope, b: Slope) -> Slope {
    std::array::from_fn(|k| {
        if k == 0 {
            a[0] * b[0]
        } else {
            a[0] * b[k] + b[0] * a[k]
        }
    })
}

/// The craters of octave i about a point of the ball: value and gradient per cell of octave 0.
fn crater_octave(globe: &Globe, p: &Lattice3d, up: [f64; 3], i: i32) -> Slope {
    let radius = globe.ground_radius / globe.wavelength * octave_frequency(i);
    let mut all = [0.0; 4];
    for k in 0..27_i32 {
        let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
        let home = std::array::from_fn(|a| p.cell[a].wrapping_add(step[a]));
        let words = lattice_hash_3d(home, octave_seed(globe.seed, i));
        if f64::from(words[0] >> 16) / 65536.0 >= globe.shape {
            continue;
        }
        let size = 0.15 + 0.2 * (f64::from(words[1] >> 16) / 65536.0).powi(2);
        // From the planet's centre, in cells: the point, and the crater's middle.
        let point = scale(up, radius);
        let middle = std::array::from_fn(|a| {
            let jitter = 0.25 + 0.5 * f64::from(words[a] & 0xffff) / 65536.0;
            point[a] + f64::from(step[a]) + jitter - p.frac[a]
        });
        let above = length(middle) - radius;
        let depth = ((0.45 - above.abs()) * 8.0).clamp(0.0, 1.0);
        let away = add(point, scale(normalize(middle), -radius));
        let distance = length(away);
        let [value, slope] = crater(distance / size, 0.5);
        all[0] += depth * size * value;
        for a in 0..3 {
            // The middle of a bowl is level.
            all[a + 1] += octave_frequency(i) * depth * slope * away[a] / distance.max(1e-12);
        }
    }
    all
}

/// The first `count` octaves and the weight that the next inherits, with gradients per cell of octave 0.
fn first_octaves(
    globe: &Globe,
    kind: i32,
    start: &Lattice3d,
    up: [f64; 3],
    count: i32,
) -> [Slope; 2] {
    let hurst = -globe.fall.log2();
    let one = [1.0, 0.0, 0.0, 0.0];
    let (mut total, mut weight) = ([0.0; 4], one);
    for i in 0..count {
        let p = octave_3d(start.cell, start.frac, i);
        let mut n = gradient_noise_3d_slope(p.cell, p.frac, octave_seed(globe.seed, i));
        for slope in &mut n[1..] {
            *slope *= octave_frequency(i);
        }
        let a = octave_amplitude(i, hurst);
        let (term, next) = match kind {
            1 => {
                n[0] += globe.shape;
                let term = times(weight, n.map(|v| a * v));
                (term, term)
            }
            2 => {
                let size = (n[0] * n[0] + globe.detail).sqrt();
                let change = if size > 0.0 { -n[0] / size } else { 0.0 };
                let ridge = [1.0 - size, change * n[1], change * n[2], change * n[3]];
                let signal = times(times(ridge, ridge), weight);
                (signal.map(|v| a * v), signal.map(|v| globe.shape * v))
            }
            3 => {
                let both = sum(crater_octave(globe, &p, up, i), n.map(|v| globe.detail * v));
                (both.map(|v| a * v), one)
            }
            _ => (n.map(|v| a * v), one),
        };
        total = sum(total, term);
        weight = if next[0] >= 1.0 { one } else { next };
    }
    [total, weight]
}

/// The field at a place of the ball's lattice, filtered by a footprint.
#[allow(clippy::too_many_arguments)]
pub fn ground(
    globe: &Globe,
    kind: i32,
    cell: [i32; 3],
    frac: [f64; 3],
    up: [f64; 3],
    footprint: f64,
) -> GlobeGround {
    let start = split_3d(cell, frac);
    let share = |i: i32| kept(globe.wavelength / octave_frequency(i), footprint);
    let whole = (0..globe.octaves).take_while(|i| share(*i) >= 1.0).count() as i32;
    // The mean over all that follows octave k, and the square of its slopes.
    let held = |k: i32| {
        let [value, w] = first_octaves(globe, kind, &start, up, k);
        if k == globe.octaves {
            return (value, 0.0);
        }
        let (rest, bend) = (remainder(kind, globe.mean, k), globe.mean[3]);
        let slope = rest * (1.0 + bend * (1.0 - 2.0 * w[0]));
        let mean = [
            rest * w[0] * (1.0 + bend * (1.0 - w[0])),
            slope * w[1],
            slope * w[2],
            slope * w[3],
        ];
        let lost =
            remainder(kind, globe.lost, k).max(0.0) * w[0] * (1.0 + globe.lost[3] * (1.0 - w[0]));
        (sum(value, mean), lost)
    };
    let (mut value, mut lost) = held(whole);
    if whole < globe.octaves {
        let keep = share(whole);
        if keep > 0.0 {
            let (next, next_lost) = held(whole + 1);
            value = std::array::from_fn(|a| value[a] + keep * (next[a] - value[a]));
            lost = next_lost + (1.0 - keep * keep) * (lost - next_lost);
        }
    }
    let height = globe.base + globe.amplitude * value[0];
    if height < globe.sea {
        return GlobeGround {
            height: globe.sea,
            slope: [0.0; 3],
            lost: 0.0,
        };
    }
    let steepness = globe.amplitude / globe.wavelength;
    let gradient = [value[1], value[2], value[3]].map(|s| steepness * s);
    GlobeGround {
        height,
        slope: add(gradient, scale(up, -dot(up, gradient))),
        lost: steepness * steepness * lost.max(0.0),
    }
}

/// The field below or above a place relative to the eye.
pub fn ground_from(globe: &Globe, kind: i32, at: [f64; 3], footprint: f64) -> GlobeGround {
    let eye = scale(globe.up, globe.ground_radius + globe.eye_altitude);
    let up = normalize(add(eye, at));
    let moved = scale(
        add(up, scale(globe.up, -1.0)),
        globe.ground_radius / globe.wavelength,
    );
    let frac = add(globe.frac, moved);
    ground(globe, kind, globe.cell, frac, up, footprint)
}
