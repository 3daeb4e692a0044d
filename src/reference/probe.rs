//! The light along single rays: scattered once by quadrature, more often by Monte Carlo.

use super::parallel::parallel_map;
use super::sky::{Sky, SkyRay};
use super::sky_paths::{Paths, trace_sky};
use crate::atmosphere::{Atmosphere, Orders, ProbeRay};
use crate::error::Error;

/// The light along a ray with what is known of its error, for a point of a sun whose irradiance is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probed {
    /// Radiance scattered into the ray [1/sr], without that of the ground at its end.
    pub in_scatter: [f64; 3],
    /// One standard error of that, the quadrature's estimate included.
    pub error: [f64; 3],
    /// Transmittance to the end of the ray.
    pub transmittance: [f64; 3],
}

/// How exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Relative error of single scattering, in [1e-11, 1].
    pub tolerance: f64,
    /// Paths a ray and channel for all other orders, at least 2.
    pub samples: usize,
    /// Seed of the paths.
    pub seed: u64,
}

impl Default for Effort {
    /// 1e-8 and 4096 paths.
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            samples: 4096,
            seed: 1,
        }
    }
}

impl From<ProbeRay> for SkyRay {
    fn from(ray: ProbeRay) -> Self {
        SkyRay {
            eye_altitude: ray.altitude,
            dir: ray.dir,
            to_sun: ray.to_sun,
            distance: ray.distance,
        }
    }
}

/// The light along rays, on all cores. A ray that misses the air has exactly 0 and 1.
///
/// # Errors
/// As [`Atmosphere::check`].
pub fn probe(
    atmosphere: &Atmosphere,
    rays: &[ProbeRay],
    orders: Orders,
    effort: &Effort,
) -> Result<Vec<Probed>, Error> {
    let sky = Sky::new(atmosphere)?;
    let paths = Paths {
        samples: effort.samples.max(2),
        seed: effort.seed,
        first_order: 2,
        seen_ground: false,
        ..Default::default()
    };
    Ok(parallel_map(rays.len(), |i| {
        let ray = SkyRay::from(rays[i]);
        let once = sky.single_scatter(&ray, effort.tolerance);
        let mut probed = Probed {
            in_scatter: once.in_scatter,
            error: once.error,
            transmittance: once.transmittance,
        };
        if orders == Orders::All {
            let more = trace_sky(&sky, &ray, &paths, i as u64);
            for c in 0..3 {
                probed.in_scatter[c] += more.mean[c];
                probed.error[c] = probed.error[c].hypot(more.standard_error[c]);
            }
        }
        probed
    }))
}
