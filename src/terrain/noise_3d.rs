//! Gradient noise and craters in 3D on an integer lattice, in the device's order of operations.

use super::noise::{fade, fade_slope};
use super::real::Real;

/// A position on a lattice in 3D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place3d<T> {
    /// The lattice point below.
    pub cell: [i32; 3],
    /// The rest, in [0, 1].
    pub frac: [T; 3],
}

const SHIFT: [f64; 3] = [0.171875, 0.203125, 0.390625];

impl<T: Real> Place3d<T> {
    /// A cell with any fraction.
    #[inline]
    pub fn new(cell: [i32; 3], frac: [T; 3]) -> Place3d<T> {
        let whole = frac.map(T::whole);
        Place3d {
            cell: std::array::from_fn(|k| cell[k].wrapping_add(whole[k].wide() as i64 as i32)),
            frac: std::array::from_fn(|k| frac[k] - whole[k]),
        }
    }

    /// The same position on a lattice twice as fine.
    #[inline]
    pub fn finer(self) -> Place3d<T> {
        let over = self.frac.map(|f| f >= T::of(0.5));
        Place3d {
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
    pub fn shifted(self, i: i32) -> Place3d<T> {
        if i == 0 {
            return self;
        }
        let over: [bool; 3] = std::array::from_fn(|k| self.frac[k] >= T::of(1.0 - SHIFT[k]));
        Place3d {
            cell: std::array::from_fn(|k| self.cell[k].wrapping_add(i32::from(over[k]))),
            frac: std::array::from_fn(|k| {
                let shift = if over[k] { SHIFT[k] - 1.0 } else { SHIFT[k] };
                self.frac[k] + T::of(shift)
            }),
        }
    }
}

const START: u32 = 1_013_904_223;
const MULTIPLIER: u32 = 747_796_405;
const SEED: u32 = 2_654_435_761;
const SPREAD: [u32; 3] = [MULTIPLIER, 2_654_435_769, 2_246_822_519];

/// The random word of a lattice point that its vector is made of.
#[inline]
fn word(cell: [i32; 3], seed: u32) -> u32 {
    let start = [START, START, seed.wrapping_mul(SEED).wrapping_add(START)];
    let [x, y, z]: [u32; 3] = std::array::from_fn(|k| {
        let spread = cell[k]
            .cast_unsigned()
            .wrapping_mul(SPREAD[k])
            .wrapping_add(start[k]);
        spread ^ (spread >> 16)
    });
    let row = y.wrapping_add(z);
    (x.wrapping_mul(MULTIPLIER) ^ row).wrapping_mul(row | 1)
}

#[inline]
fn stir(word: u32) -> u32 {
    (word ^ (word >> 16)).wrapping_mul(MULTIPLIER)
}

/// Three random words of a lattice point.
#[inline]
fn words(cell: [i32; 3], seed: u32) -> [u32; 3] {
    let [x, mut y, mut z] = cell.map(|c| {
        c.cast_unsigned()
            .wrapping_mul(MULTIPLIER)
            .wrapping_add(START)
    });
    y = y.wrapping_add(stir(z));
    let row = stir(y).wrapping_add(z) ^ seed.wrapping_mul(SEED);
    let mixed = x.wrapping_add(row);
    let product = (mixed ^ (mixed >> 15)).wrapping_mul(y | 1);
    let x = product ^ (product >> 15);
    z = z.wrapping_add(stir(x ^ y));
    y = y.wrapping_add(stir(z));
    [x, y, z]
}

/// One of 24 vectors of the length 1.3847.
#[inline]
fn vector<T: Real>(word: u32) -> [T; 3] {
    let (long, short) = T::sides();
    let sides = if word & 0x10_0000 != 0 {
        [short, long]
    } else {
        [long, short]
    };
    let signed = |value: T, bit: u32| {
        if word >> bit & 1 == 1 { -value } else { value }
    };
    let (p, q) = (signed(sides[0], 22), signed(sides[1], 21));
    let zero = T::of(0.0);
    match word & 0xf_ffff {
        0..349_526 => [zero, p, q],
        349_526..=699_050 => [q, zero, p],
        _ => [p, q, zero],
    }
}

#[inline]
fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Gradient noise: value and slope per cell.
pub fn gradient_noise_3d<T: Real>(p: Place3d<T>, seed: u32) -> [T; 4] {
    let one = T::of(1.0);
    let t = p.frac;
    let s = t.map(|t| t - one);
    let at = |i: i32| [i & 1, i >> 1 & 1, i >> 2];
    let g: [[T; 3]; 8] = std::array::from_fn(|i| {
        let step = at(i as i32);
        let cell = std::array::from_fn(|k| p.cell[k].wrapping_add(step[k]));
        vector(word(cell, seed))
    });
    let n: [T; 8] = std::array::from_fn(|i| {
        let step = at(i as i32);
        dot(
            g[i],
            std::array::from_fn(|k| if step[k] == 0 { t[k] } else { s[k] }),
        )
    });
    let f = t.map(fade);
    let h = f.map(|f| one - f);
    // Along x, then y, then z.
    let rows: [T; 4] = std::array::from_fn(|i| n[2 * i] * h[0] + n[2 * i + 1] * f[0]);
    let [low, high]: [T; 2] = std::array::from_fn(|i| rows[2 * i] * h[1] + rows[2 * i + 1] * f[1]);
    let along: [T; 2] = std::array::from_fn(|i| {
        (n[4 * i + 1] - n[4 * i]) * h[1] + (n[4 * i + 3] - n[4 * i + 2]) * f[1]
    });
    let across = [
        along[0] * h[2] + along[1] * f[2],
        (rows[1] - rows[0]) * h[2] + (rows[3] - rows[2]) * f[2],
        high - low,
    ];
    let slope = t.map(fade_slope);
    let mean = |k: usize| {
        let row = |i: usize| g[2 * i][k] * h[0] + g[2 * i + 1][k] * f[0];
        let plane = |i: usize| row(2 * i) * h[1] + row(2 * i + 1) * f[1];
        plane(0) * h[2] + plane(1) * f[2]
    };
    [
        low * h[2] + high * f[2],
        mean(0) + slope[0] * across[0],
        mean(1) + slope[1] * across[1],
        mean(2) + slope[2] * across[2],
    ]
}

/// Profile of a crater, and its slope over the square of the distance.
#[inline]
fn profile<T: Real>(x: T, square: T) -> [T; 2] {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let hollow = (one - square).most(zero);
    let inverse = T::of(if x < one { 2.5 } else { 2.0 });
    let y = (x - one) * inverse;
    let ring = (one - y * y).most(zero);
    [
        T::of(-0.4) * hollow * hollow + T::of(0.08) * ring * ring,
        T::of(0.8) * hollow + T::of(-0.16) * ring * y * inverse / x.most(T::of(1e-4)),
    ]
}

/// Craters of one lattice on a ball of a radius in cells: value and slope per cell.
#[inline]
pub fn craters_3d<T: Real>(p: Place3d<T>, up: [T; 3], radius: T, share: T, seed: u32) -> [T; 4] {
    let [zero, one, two] = [0.0, 1.0, 2.0].map(T::of);
    let mut sum = [zero; 4];
    // No crater reaches farther than 0.72 cells from its middle, and that lies 0.25 within its cell: of three cells in a row the farthest has none.
    let low = p.frac.map(|f| if f >= T::of(0.5) { 0 } else { -1 });
    for k in 0..8_i32 {
        let step = [low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)];
        let cell = std::array::from_fn(|a| p.cell[a].wrapping_add(step[a]));
        let words = words(cell, seed);
        let upper = words.map(|w| T::of(f64::from(w >> 16)) * T::of(2f64.powi(-16)));
        let crater = T::of(0.15) + T::of(0.2) * upper[1] * upper[1];
        let way: [T; 3] = std::array::from_fn(|a| {
            let jitter = T::of(f64::from(words[a] & 0xffff)) * T::of(2f64.powi(-17)) + T::of(0.25);
            T::of(f64::from(step[a])) + jitter - p.frac[a]
        });
        let e = two * dot(up, way) + dot(way, way) / radius;
        let above = e / (one + (one + e / radius).most(zero).root());
        let scale = radius / (radius + above).most(T::of(0.1));
        let away: [T; 3] = std::array::from_fn(|a| (up[a] * above - way[a]) * (scale / crater));
        let square = dot(away, away);
        let profile = profile(square.root(), square);
        let depth = ((T::of(0.45) - above.size()) * T::of(8.0))
            .most(zero)
            .least(one);
        let there = if upper[0] < share {
            crater * depth
        } else {
            zero
        };
        let slope = profile[1] * two / crater;
        sum[0] += there * profile[0];
        for a in 0..3 {
            sum[a + 1] += there * (slope * away[a]);
        }
    }
    sum
}
