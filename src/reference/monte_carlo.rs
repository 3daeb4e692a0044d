//! What the random estimators share: streams of random numbers, sampled directions, and honest statistics.

use super::math::{add, dot, normalize, scale};
use crate::atmosphere::Lobe;
use std::f64::consts::{PI, TAU};

/// 2^64 over the golden ratio, odd.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The next 64 bits of the generator splitmix64 (Steele, Lea and Flood 2014) and its next state: enough to choose samples
/// with, and to start a better generator.
pub fn splitmix64(state: &mut u64) -> u64 {
    *state = state.wrapping_add(GOLDEN);
    mix(*state)
}

/// A stream of random numbers: xoshiro256++ (Blackman and Vigna 2021) behind a seed and a stream number.
#[derive(Clone, Debug, PartialEq)]
pub struct Random {
    state: [u64; 4],
}

impl Random {
    /// The stream `stream` of the seed `seed`; equal arguments give equal numbers, others unrelated ones.
    pub fn new(seed: u64, stream: u64) -> Self {
        // A start that depends on both words.
        let mut word = mix(seed ^ GOLDEN).wrapping_add(mix(!stream));
        let state = std::array::from_fn(|_| splitmix64(&mut word));
        Self { state }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let [a, b, c, d] = self.state;
        let result = a.wrapping_add(d).rotate_left(23).wrapping_add(a);
        let (c1, d1) = (c ^ a, d ^ b);
        self.state = [a ^ d1, b ^ c1, c1 ^ (b << 17), d1.rotate_left(45)];
        result
    }

    /// The next number in [0, 1), a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// The next number of the exponential distribution with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -(-self.unit()).ln_1p()
    }
}

/// A direction of cosine `mu` with the unit vector `axis`, at a random turn about it.
pub fn direction_about(axis: [f64; 3], mu: f64, random: &mut Random) -> [f64; 3] {
    // The coordinate axis farthest from `axis` gives a well-conditioned perpendicular.
    let least = (0..3).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs()));
    let mut helper = [0.0; 3];
    helper[least.unwrap_or(0)] = 1.0;
    let first = normalize(add(helper, scale(axis, -dot(helper, axis))));
    let second = [
        axis[1] * first[2] - axis[2] * first[1],
        axis[2] * first[0] - axis[0] * first[2],
        axis[0] * first[1] - axis[1] * first[0],
    ];
    let sine = ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt();
    let (s, c) = (TAU * random.unit()).sin_cos();
    normalize(add(
        scale(axis, mu),
        add(scale(first, sine * c), scale(second, sine * s)),
    ))
}

/// Cosine of a scattering angle with the density of Rayleigh's phase function, by inversion of its cubic distribution.
pub fn sample_rayleigh(random: &mut Random) -> f64 {
    let q = 2.0 - 4.0 * random.unit();
    // mu^3 + 3 mu + 2 q = 0. The root of the larger magnitude loses no digits.
    let u = (q.abs() + (q * q + 1.0).sqrt()).cbrt();
    let mu = u - 1.0 / u;
    (if q > 0.0 { -mu } else { mu }).clamp(-1.0, 1.0)
}

/// Cosine of a scattering angle with the density of Henyey and Greenstein's phase function, |g| < 1, by inversion.
pub fn sample_henyey_greenstein(g: f64, random: &mut Random) -> f64 {
    let s = 2.0 * random.unit() - 1.0;
    if g.abs() < 1e-6 {
        return s;
    }
    let ratio = (1.0 - g * g) / (1.0 + g * s);
    ((1.0 + g * g - ratio * ratio) / (2.0 * g)).clamp(-1.0, 1.0)
}

/// Cosine of a scattering angle with the density of Cornette and Shanks's phase function, |g| < 1: Henyey and
/// Greenstein's, kept with the probability (1 + mu^2) / 2.
pub fn sample_cornette_shanks(g: f64, random: &mut Random) -> f64 {
    loop {
        let mu = sample_henyey_greenstein(g, random);
        if random.unit() < 0.5 * (1.0 + mu * mu) {
            return mu;
        }
    }
}

/// Cosine of a scattering angle with the density of a lobe of Draine's form, |g| < 1.
pub fn sample_lobe(lobe: &Lobe, random: &mut Random) -> f64 {
    let Lobe { g, alpha, .. } = *lobe;
    if g == 0.0 && alpha == 1.0 {
        return sample_rayleigh(random);
    }
    loop {
        let mu = sample_henyey_greenstein(g, random);
        if alpha == 0.0 || random.unit() * (1.0 + alpha) < 1.0 + alpha * mu * mu {
            return mu;
        }
    }
}

/// Cosine with a surface's normal of a direction that a Lambertian surface reflects into.
pub fn sample_lambert(random: &mut Random) -> f64 {
    random.unit().sqrt()
}

/// Radiance that a Lambertian surface reflects: `albedo` in [0, 1], `irradiance` on a plane across the light, and the
/// cosine of the light with the normal.
pub fn lambert(albedo: f64, irradiance: f64, cosine: f64) -> f64 {
    albedo / PI * irradiance * cosine.max(0.0)
}

/// Mean and variance of samples, updated one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Tally {
    /// Adds a sample.
    pub fn add(&mut self, sample: f64) {
        self.count += 1.0;
        let before = sample - self.mean;
        self.mean += before / self.count;
        self.squares += before * (sample - self.mean);
    }

    /// Mean of the samples.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance of the samples; 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count > 1.0 {
            self.squares / (self.count - 1.0)
        } else {
            0.0
        }
    }

    /// Standard error of the mean; 0 for fewer than two samples, of which it says nothing.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1.0)).sqrt()
    }
}

/// A random estimate of three channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Mean over the samples.
    pub mean: [f64; 3],
    /// Standard error of the mean, from the samples' own variance.
    pub standard_error: [f64; 3],
}

impl Measured {
    /// The estimate of three tallies.
    pub fn of(tallies: &[Tally; 3]) -> Self {
        Self {
            mean: tallies.map(|t| t.mean()),
            standard_error: tallies.map(|t| t.standard_error()),
        }
    }
}

/// Difference of two estimates over its standard error; 0 for equal estimates without error. Over many independent
/// pairs it has mean 0 and variance 1 when the errors are honest.
pub fn z_score(a: f64, error_a: f64, b: f64, error_b: f64) -> f64 {
    if a == b {
        0.0
    } else {
        (a - b) / error_a.hypot(error_b)
    }
}
