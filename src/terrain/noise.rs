//! Gradient noise and craters on an integer lattice, in the device's order of operations.

use super::real::Real;

/// A position on a lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<T> {
    /// The lattice point below.
    pub cell: [i32; 2],
    /// The rest, in [0, 1].
    pub frac: [T; 2],
}

const SHIFT: [f64; 2] = [0.171875, 0.390625];

impl<T: Real> Place<T> {
    /// A cell with any fraction.
    #[inline]
    pub fn new(cell: [i32; 2], frac: [T; 2]) -> Place<T> {
        let whole = frac.map(T::whole);
        Place {
            cell: std::array::from_fn(|k| cell[k].wrapping_add(whole[k].wide() as i64 as i32)),
            frac: std::array::from_fn(|k| frac[k] - whole[k]),
        }
    }

    /// The same position on a lattice twice as fine.
    #[inline]
    pub fn finer(self) -> Place<T> {
        let over = self.frac.map(|f| f >= T::of(0.5));
        Place {
            cell: std::array::from_fn(|k| {
                self.cell[k]
                    .wrapping_mul(2)
                    .wrapping_add(i32::from(over[k]))
            }),
            frac: std::array::from_fn(|k| {
                self.frac[k] + self.frac[k] - T::of(f64::from(u8::from(over[k])))
            }),
        }
    }

    /// Shifted as octave `i` is.
    #[inline]
    pub fn shifted(self, i: i32) -> Place<T> {
        if i == 0 {
            return self;
        }
        let over: [bool; 2] = std::array::from_fn(|k| self.frac[k] >= T::of(1.0 - SHIFT[k]));
        Place {
            cell: std::array::from_fn(|k| self.cell[k].wrapping_add(i32::from(over[k]))),
            frac: std::array::from_fn(|k| {
                let shift = if over[k] { SHIFT[k] - 1.0 } else { SHIFT[k] };
                self.frac[k] + T::of(shift)
            }),
        }
    }
}

/// The seed of octave `i`.
#[inline]
pub fn octave_seed(seed: u32, i: i32) -> u32 {
    seed.wrapping_add(i.cast_unsigned().wrapping_mul(0x9e37_79b9))
}

const MULTIPLIER: u32 = 747_796_405;
const INCREMENT: u32 = 1_013_904_223;

#[inline]
fn stir(word: u32) -> u32 {
    (word ^ (word >> 16)).wrapping_mul(MULTIPLIER)
}

#[inline]
fn finish(word: u32, factor: u32) -> u32 {
    let product = (word ^ (word >> 15)).wrapping_mul(factor | 1);
    product ^ (product >> 15)
}

/// Two random words of a lattice point.
#[inline]
pub fn words(cell: [i32; 2], seed: u32) -> [u32; 2] {
    let w = cell.map(|c| {
        c.cast_unsigned()
            .wrapping_mul(MULTIPLIER)
            .wrapping_add(INCREMENT)
    });
    let row = stir(w[1]) ^ seed.wrapping_mul(2_654_435_761);
    let x = finish(w[0].wrapping_add(row), row);
    [x, w[1].wrapping_add(stir(x))]
}

/// Gradient noise: value and slope per cell.
pub fn gradient_noise<T: Real>(p: Place<T>, seed: u32) -> [T; 3] {
    let one = T::of(1.0);
    let t = p.frac;
    let s = t.map(|t| t - one);
    let corner = |i: i32, j: i32| {
        let cell = [p.cell[0].wrapping_add(i), p.cell[1].wrapping_add(j)];
        T::vector(words(cell, seed)[0])
    };
    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let n = [
        a[0] * t[0] + a[1] * t[1],
        b[0] * s[0] + b[1] * t[1],
        c[0] * t[0] + c[1] * s[1],
        d[0] * s[0] + d[1] * s[1],
    ];
    let f = t.map(fade);
    let g = f.map(|f| one - f);
    let m = [n[0] * g[0] + n[1] * f[0], n[2] * g[0] + n[3] * f[0]];
    let rise = [n[1] - n[0], n[3] - n[2]];
    let across = [rise[0] * g[1] + rise[1] * f[1], m[1] - m[0]];
    let along = |k: usize| [a[k] * g[0] + b[k] * f[0], c[k] * g[0] + d[k] * f[0]];
    let slope = t.map(fade_slope);
    let mean = |k: usize| {
        let [low, high] = along(k);
        low * g[1] + high * f[1]
    };
    [
        m[0] * g[1] + m[1] * f[1],
        mean(0) + slope[0] * across[0],
        mean(1) + slope[1] * across[1],
    ]
}

#[inline]
pub(super) fn fade<T: Real>(t: T) -> T {
    let s = t - T::of(0.5);
    let w = T::of(0.25) - s * s;
    (s * w * (w * T::of(6.0) + T::of(2.0)) + t).most(T::of(0.0))
}

#[inline]
pub(super) fn fade_slope<T: Real>(t: T) -> T {
    let s = t - T::of(0.5);
    let q = s * s;
    T::of(1.875) - q * (T::of(15.0) - T::of(30.0) * q)
}

/// Profile of a crater, and its slope over the square of the distance.
#[inline]
fn crater_profile<T: Real>(x: T, square: T) -> [T; 2] {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let hollow = (one - square).most(zero);
    let inverse = T::of(if x < one { 2.5 } else { 1.0 });
    let y = (x - one) * inverse;
    let ring = (one - y * y).most(zero);
    [
        T::of(-0.4) * hollow * hollow + T::of(0.08) * ring * ring,
        T::of(0.8) * hollow + T::of(-0.16) * ring * y * inverse / x.most(T::of(1e-4)),
    ]
}

/// Craters of one lattice: value and slope per cell.
pub fn craters<T: Real>(p: Place<T>, share: T, seed: u32) -> [T; 3] {
    let mut sum = [T::of(0.0); 3];
    for k in 0..9_i32 {
        let step = [k % 3 - 1, k / 3 - 1];
        let cell = std::array::from_fn(|a| p.cell[a].wrapping_add(step[a]));
        let words = words(cell, seed);
        let sixteenth = T::of(2f64.powi(-16));
        let upper = words.map(|w| T::of(f64::from(w >> 16)) * sixteenth);
        let radius = T::of(0.15) + T::of(0.25) * upper[1] * upper[1];
        let away: [T; 2] = std::array::from_fn(|a| {
            let jitter = T::of(f64::from(words[a] & 0xffff)) * T::of(2f64.powi(-17)) + T::of(0.25);
            (p.frac[a] - T::of(f64::from(step[a])) - jitter) / radius
        });
        let square = away[0] * away[0] + away[1] * away[1];
        let profile = crater_profile(square.root(), square);
        let there = if upper[0] < share { radius } else { T::of(0.0) };
        let slope = |a: usize| profile[1] * T::of(2.0) * away[a] / radius;
        sum[0] += there * profile[0];
        sum[1] += there * slope(0);
        sum[2] += there * slope(1);
    }
    sum
}
