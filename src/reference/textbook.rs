//! The march of one scattering through any air, with the device's schedule of samples: its twin, not a reference. What
//! schedule and rule miss is judged by [`super::sky`].

use super::air_ray::{AirRay, lowest_distance, ray_altitude, ray_sun_cosine};
use super::air_tables::path_to_top;
use super::medium::{air_densities, air_extinction, air_phases, air_scattering};
use super::planet::altitude_along;
use crate::atmosphere::{Atmosphere, MOST_LANES};

/// Light that a ray brings and light that it leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirLight {
    /// Radiance scattered into the ray [1/sr].
    pub in_scatter: [f64; 3],
    /// Transmittance of the ray.
    pub transmittance: [f64; 3],
}

/// Places of the two samples of a step.
fn places() -> [f64; 2] {
    let aside = 3_f64.sqrt() / 6.0;
    [0.5 - aside, 0.5 + aside]
}

/// Densities times lengths over a rising line of the length `size`, in `steps` steps of two samples whose ends lie at the
/// squares of equal shares.
fn rising(air: &Atmosphere, h: f64, mu: f64, size: f64, steps: i32) -> [f64; MOST_LANES] {
    let mut sum = [0.0; MOST_LANES];
    let edge = |i: i32| size * (f64::from(i) / f64::from(steps)).powi(2);
    for i in 0..steps {
        let (a, b) = (edge(i), edge(i + 1));
        for place in places() {
            let t = a + place * (b - a);
            let amounts = air_densities(air, altitude_along(air.planet_radius, h, mu, t));
            for (sum, amount) in sum.iter_mut().zip(amounts) {
                *sum += 0.5 * (b - a) * amount;
            }
        }
    }
    sum
}

/// Optical depth from altitude `h` to the sun at the zenith cosine `sun_mu`; a sun below the horizon counts as just above, one within 1e-12 of level as
/// level.
pub fn march_sun_depth(air: &Atmosphere, h: f64, sun_mu: f64, steps: i32) -> [f64; 3] {
    let (radius, steps) = (air.planet_radius, steps.max(1));
    let sun_mu = if sun_mu.abs() < 1e-12 { 0.0 } else { sun_mu };
    let path = path_to_top(radius, air.thickness, h, sun_mu);
    let rise = rising(air, path.lowest, sun_mu.max(0.0), path.rises, steps);
    let fall = rising(air, path.lowest, 0.0, path.falls, steps);
    air_extinction(air, std::array::from_fn(|k| rise[k] + fall[k]))
}

/// Light scattered once into a ray, with the device's steps.
pub fn march_air(air: &Atmosphere, ray: &AirRay, steps: i32, light_steps: i32) -> AirLight {
    let steps = steps.max(1);
    let low = lowest_distance(air.planet_radius, ray);
    let [dark_from, dark_to] = if ray.dark_from < ray.dark_to {
        [ray.dark_from, ray.dark_to].map(|t| t.clamp(0.0, ray.length))
    } else {
        [ray.length; 2]
    };
    let mut ends = [0.0, low, dark_from, dark_to, ray.length];
    ends.sort_by(f64::total_cmp);
    let phases = air_phases(air, ray.nu);
    let inner = 0.25;
    let outer = 3_f64.sqrt() / 6.0;
    let mut depth = [0.0; 3];
    let mut light = [0.0; 3];
    for pair in ends.windows(2) {
        let (begin, end) = (pair[0], pair[1]);
        let middle = 0.5 * (begin + end);
        let lit = middle < dark_from || middle > dark_to;
        let edge = |i: i32| {
            let share = f64::from(i) / f64::from(steps);
            if middle < low {
                end - (end - begin) * (1.0 - share).powi(2)
            } else {
                begin + (end - begin) * share.powi(2)
            }
        };
        for i in (0..steps).filter(|_| end > begin) {
            let (a, b) = (edge(i), edge(i + 1));
            let samples = places().map(|place| {
                let t = a + place * (b - a);
                let h = ray_altitude(air.planet_radius, ray, t).max(0.0);
                (t, h, air_densities(air, h))
            });
            let losses = samples.map(|(_, _, d)| air_extinction(air, d).map(|e| e * (b - a)));
            for (k, (t, h, densities)) in samples.iter().enumerate().filter(|_| lit) {
                let mu = ray_sun_cosine(air.planet_radius, ray, *h, *t);
                let sun = march_sun_depth(air, *h, mu, light_steps);
                let scattered = air_scattering(air, *densities, phases);
                let other = inner + if k == 0 { -outer } else { outer };
                for c in 0..3 {
                    let own = inner * losses[k][c] + other * losses[1 - k][c];
                    let passed = depth[c] + own.max(0.0) + sun[c];
                    light[c] += 0.5 * (b - a) * (-passed).exp() * scattered[c];
                }
            }
            for c in 0..3 {
                depth[c] += 0.5 * (losses[0][c] + losses[1][c]);
            }
        }
    }
    AirLight {
        in_scatter: light,
        transmittance: depth.map(|d| (-d).exp()),
    }
}
