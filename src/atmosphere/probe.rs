//! The light along single rays.

use super::check::{fault, within};
use super::medium::Atmosphere;
use crate::device::Gpu;
use crate::error::Error;

/// A ray whose light is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeRay {
    /// Altitude of the eye (m), at least 0.
    pub altitude: f64,
    /// Direction of the view, a unit vector in the frame of the eye, y up.
    pub dir: [f64; 3],
    /// Direction to the sun, a unit vector in the same frame.
    pub to_sun: [f64; 3],
    /// Where the ray ends (m), if not at the ground or the top of the air before; above 0, may be infinite.
    pub distance: f64,
}

/// The light along a ray, for a point of a sun whose irradiance outside the air is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeLight {
    /// Radiance scattered into the ray (1/sr), without that of the ground at its end. 0 for a ray that misses the air.
    pub in_scatter: [f32; 3],
    /// Transmittance to the end of the ray. 1 for a ray that misses the air.
    pub transmittance: [f32; 3],
}

/// Which light is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orders {
    /// What the air has scattered once.
    Single,
    /// What the air has scattered once and more often, and what the ground has reflected before.
    All,
}

/// How the device finds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbePath {
    /// By marching.
    Textbook,
    /// By tables.
    Fast,
}

impl ProbeRay {
    /// The ray of a row of eight numbers: altitude, direction, direction to the sun, distance. The directions are made
    /// unit vectors.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] naming the row, which `row` is the number of, for an altitude below 0 or not finite, a
    /// direction whose length is not within 1e-3 of 1, and a distance that is not above 0.
    pub fn from_row(row: usize, numbers: [f64; 8]) -> Result<ProbeRay, Error> {
        let [altitude, dx, dy, dz, sx, sy, sz, distance] = numbers;
        let name = |what: &str| format!("{what} of row {row}");
        if !(altitude >= 0.0 && altitude.is_finite()) {
            let domain = "finite and at least 0 m".to_owned();
            return Err(fault(&name("the altitude"), altitude, domain));
        }
        let unit = |what: &str, v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let what = name(&format!("the length of the {what}"));
            within(&what, length, (0.999, 1.001, "1"))?;
            Ok(v.map(|x| x / length))
        };
        if distance.is_nan() || distance <= 0.0 {
            let domain = "above 0 m, or infinite".to_owned();
            return Err(fault(&name("the distance"), distance, domain));
        }
        Ok(ProbeRay {
            altitude,
            dir: unit("direction", [dx, dy, dz])?,
            to_sun: unit("direction to the sun", [sx, sy, sz])?,
            distance,
        })
    }
}

/// The light along rays, on the device.
///
/// # Errors
/// As [`Atmosphere::check`]; [`Error::NotYet`].
pub fn probe(
    _gpu: &Gpu,
    atmosphere: &Atmosphere,
    _rays: &[ProbeRay],
    path: ProbePath,
    _orders: Orders,
) -> Result<Vec<ProbeLight>, Error> {
    atmosphere.check()?;
    let name = match path {
        ProbePath::Textbook => "textbook",
        ProbePath::Fast => "fast",
    };
    Err(Error::NotYet(format!("the path `{name}` of probes")))
}
