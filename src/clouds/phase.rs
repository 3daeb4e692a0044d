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

    /// The table of light that the peak alone has scattered, once or more often, per unit of sunlight that a depth has left of what the peak leaves: by
    /// Legendre sums, in which every further scattering is a power of the moment.
    pub fn peak_table(&self) -> Vec<f32> {
        let f = self.peak();
        let largest = self.g_forward.abs().max(self.g_backward.abs());
        // Until the moments are below 1e-7.
        let count = if largest < 1e-3 {
            5
        } else {
            (5.0 + 16.1 / -largest.min(0.999).ln()).ceil() as i32
        };
        let moments: Vec<f64> = (0..count)
            .map(|l| if l < 4 { f } else { self.moment(l) })
            .collect();
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
        let mut legendre = vec![1.0; moments.len()];
        for i in 0..PEAK_ANGLES {
            let x = i as f64 / (PEAK_ANGLES - 1) as f64;
            let mu = (PI * x * x).cos();
            legendre[1] = mu;
            for l in 2..moments.len() {
                let n = l as f64;
                legendre[l] =
                    ((2.0 * n - 1.0) * mu * legendre[l - 1] - (n - 1.0) * legendre[l - 2]) / n;
            }
            for row in &factors {
                let sum: f64 = row.iter().zip(&legendre).map(|(a, b)| a * b).sum();
                table.push(sum as f32);
            }
        }
        table
    }
}
