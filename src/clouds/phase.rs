//! A phase function as a part of four degrees, of which cells hold all orders of scattering, and a peak that hardly turns light.

use std::f64::consts::PI;

/// Angles and depths of the table of the peak's light.
pub(super) const PEAK_ANGLES: usize = 128;
/// See [`PEAK_ANGLES`].
pub(super) const PEAK_DEPTHS: usize = 64;

/// Two lobes of Henyey and Greenstein.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lobes {
    pub albedo: f64,
    pub g_forward: f64,
    pub g_backward: f64,
    pub backward_share: f64,
}

impl Lobes {
    fn moment(&self, degree: i32) -> f64 {
        (1.0 - self.backward_share) * self.g_forward.powi(degree)
            + self.backward_share * self.g_backward.powi(degree)
    }

    /// Share of the peak: the fourth moment, less where a moment of the rest would fall below -1.
    pub fn peak(&self) -> f64 {
        let least = (1..4).map(|l| self.moment(l)).fold(1.0, f64::min);
        self.moment(4).min(0.5 * (1.0 + least)).max(0.0)
    }

    /// Albedo times moment of the degrees 0 to 3 of what is left without the peak, where the peak counts as light that was not scattered.
    pub fn degrees(&self) -> [f64; 4] {
        let f = self.peak();
        let kept = 1.0 - self.albedo * f;
        std::array::from_fn(|l| self.albedo * (self.moment(l as i32) - f) / kept)
    }

    /// Gain and momentum with which orders of scattering are summed: the best (Polyak) for light that each order keeps up to 49 fiftieths of, and turns round
    /// at most as far as the degrees do.
    pub fn pace(&self) -> (f32, f32) {
        let turned = self.degrees().into_iter().fold(0.0, f64::min);
        let (most, least) = ((1.15 - turned).sqrt(), 0.02_f64.sqrt());
        let gain = (2.0 / (most + least)).powi(2);
        let momentum = ((most - least) / (most + least)).powi(2);
        (gain as f32, momentum as f32)
    }

    /// Weights of the two parts of the sun's own light that `march_tile_orders` sums, at 128 angles between view and sun whose roots are even, two to a row. Together
    /// they are albedo times phase function, so that thin clouds are exact; how they share it is fitted to the peak's light, by least squares over depths to
    /// the sun and to the eye that are alike.
    pub fn sun_weights(&self) -> [[f32; 4]; 64] {
        let f = self.peak();
        let kept = 1.0 - self.albedo * f;
        let terms = self.terms();
        let degrees = self.degrees();
        let depth = |k: usize| 0.125 * k as f64;
        let weigh = |l: usize, term: f64| (2 * l + 1) as f64 / (4.0 * PI) * term;
        // The peak's light by depth, without and with what the depths to sun and eye take away.
        let factors: Vec<Vec<f64>> = (0..48)
            .map(|k| {
                let peak = |(l, m): (usize, &f64)| {
                    let left = (-depth(k) * self.albedo * (f - m)).exp();
                    weigh(l, self.albedo * m * left)
                };
                terms.iter().enumerate().map(peak).collect()
            })
            .collect();
        let mut weights = [[0.0; 4]; 64];
        for i in 0..128 {
            let x = i as f64 / 127.0;
            let legendre = legendre((PI * x * x).cos(), terms.len());
            let peak =
                |k: usize| -> f64 { factors[k].iter().zip(&legendre).map(|(a, b)| a * b).sum() };
            let turned: f64 = (0..4)
                .map(|l| kept * weigh(l, degrees[l]) * legendre[l])
                .sum();
            let straight = peak(0);
            let (mut above, mut below) = (0.0, 0.0);
            for k in 1..factors.len() {
                let whole = (-2.0 * depth(k)).exp();
                let part = (-2.0 * kept * depth(k)).exp() - whole;
                let wanted = peak(k) * (-(1.0 + kept) * depth(k)).exp() - straight * whole;
                above += part * wanted;
                below += part * part;
            }
            let share = if below > 0.0 { above / below } else { 0.0 };
            let row = &mut weights[i / 2][2 * (i % 2)..];
            row[0] = (straight - share) as f32;
            row[1] = (share + turned) as f32;
        }
        weights
    }

    /// Legendre moments of the peak, until they are below 1e-7.
    fn terms(&self) -> Vec<f64> {
        let f = self.peak();
        let largest = self.g_forward.abs().max(self.g_backward.abs());
        let count = if largest < 1e-3 {
            5
        } else {
            (5.0 + 16.1 / -largest.min(0.999).ln()).ceil() as i32
        };
        (0..count)
            .map(|l| if l < 4 { f } else { self.moment(l) })
            .collect()
    }

    /// The table of light that the peak alone has scattered, once or more often, per unit of sunlight that a depth has left of what the peak leaves: by
    /// Legendre sums, in which every further scattering is a power of the moment.
    pub fn peak_table(&self) -> Vec<f32> {
        let f = self.peak();
        let moments = self.terms();
        let mut table = Vec::with_capacity(PEAK_ANGLES * PEAK_DEPTHS);
        let factors: Vec<Vec<f64>> = (0..PEAK_DEPTHS)
            .map(|j| {
                let y = j as f64 / (PEAK_DEPTHS - 1) as f64;
                let depth = 64.0 * y * y;
                (0..)
                    .zip(&moments)
                    .map(|(l, m)| {
                        f64::from(2 * l + 1) / (4.0 * PI)
                            * self.albedo
                            * m
                            * (-depth * self.albedo * (f - m)).exp()
                    })
                    .collect()
            })
            .collect();
        for i in 0..PEAK_ANGLES {
            let x = i as f64 / (PEAK_ANGLES - 1) as f64;
            let legendre = legendre((PI * x * x).cos(), moments.len());
            for row in &factors {
                let sum: f64 = row.iter().zip(&legendre).map(|(a, b)| a * b).sum();
                table.push(sum as f32);
            }
        }
        table
    }
}

/// Legendre polynomials of so many degrees, at least two.
fn legendre(mu: f64, count: usize) -> Vec<f64> {
    let mut all = vec![1.0; count];
    all[1] = mu;
    for l in 2..count {
        let n = l as f64;
        all[l] = ((2.0 * n - 1.0) * mu * all[l - 1] - (n - 1.0) * all[l - 2]) / n;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_the_sun_add_up_to_the_phase_function() {
        for (g_forward, g_backward, backward_share) in [(0.7, -0.5, 0.5), (0.85, 0.0, 0.0)] {
            let lobes = Lobes {
                albedo: 0.9,
                g_forward,
                g_backward,
                backward_share,
            };
            let weights = lobes.sun_weights();
            for i in 0..128 {
                let x = i as f64 / 127.0;
                let nu = (PI * x * x).cos();
                let pair = &weights[i / 2][2 * (i % 2)..];
                let sum = f64::from(pair[0]) + f64::from(pair[1]);
                let lobe =
                    |g: f64| (1.0 - g * g) / (4.0 * PI) / (1.0 + g * g - 2.0 * g * nu).powf(1.5);
                let mixed =
                    (1.0 - backward_share) * lobe(g_forward) + backward_share * lobe(g_backward);
                let wanted = 0.9 * mixed;
                assert!(
                    (sum - wanted).abs() < 1e-5 * (1.0 + wanted),
                    "{i} {sum} {wanted}"
                );
            }
        }
    }
}
