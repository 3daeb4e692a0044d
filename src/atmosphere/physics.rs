//! Layers from what they consist of: molecules by their refraction, aerosol by its turbidity.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use super::check::{each_within, within};
use super::medium::{Layer, Phase, Profile};
use crate::error::Error;

/// Scattering of a gas (1/m) for light of a `wavelength` in vacuum (m).
///
/// 8 pi^3 / 3 (n^2 - 1)^2 / (N l^4) (6 + 3 p) / (6 - 7 p), where n is the `refractive_index`, N the `number_density`
/// (1/m^3), both at the same pressure, and p the `depolarisation` of scattered light (Preetham, Shirley and Smits
/// 1999). Its phase function is Rayleigh's.
///
/// With n = 1.0003, N = 2.545e25 and p = 0.035 it is 1.24109e-30 m^3 / l^4: the air that computer graphics calls the
/// Earth's, about 18 % thicker than true.
pub fn rayleigh_scattering(
    wavelength: f64,
    refractive_index: f64,
    number_density: f64,
    depolarisation: f64,
) -> f64 {
    // n^2 - 1 without the difference of two numbers near 1.
    let excess = (refractive_index - 1.0) * (refractive_index + 1.0);
    let king = (6.0 + 3.0 * depolarisation) / (6.0 - 7.0 * depolarisation);
    8.0 * PI.powi(3) / 3.0 * excess * excess / (number_density * wavelength.powi(4)) * king
}

/// Concentration factor of aerosol (m), 0 where the fit falls below: (0.6544 T - 0.6510) 1e-18. The 1e-16 that is often
/// printed is for centimetres.
fn concentration(turbidity: f64) -> f64 {
    ((0.6544 * turbidity - 0.6510) * 1e-18).max(0.0)
}

/// Scattering of haze (1/m) of a `turbidity` (1 is pure air, 2 a clear day, 10 thick haze) for light of a `wavelength`
/// (m): 0.434 c pi (2 pi / l)^2 K, with K = `k` about 0.67 (Preetham, Shirley and Smits 1999, with c in metres).
///
/// The turbidity comes out as the ratio of the whole optical depth to that of the molecules at 550 nm only with a scale
/// height of about 1250 m.
pub fn aerosol_scattering(turbidity: f64, wavelength: f64, k: f64) -> f64 {
    0.434 * concentration(turbidity) * PI * (2.0 * PI / wavelength).powi(2) * k
}

/// A gas, described by what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Molecules {
    /// What it is, for messages.
    #[serde(default = "molecules")]
    pub name: String,
    /// Wavelengths of red, green and blue light in vacuum, each in [1e-7, 1e-5] m.
    pub wavelengths: [f64; 3],
    /// Refractive index at the ground, in [1, 2].
    pub refractive_index: f64,
    /// Molecules in a volume at the ground, in [1e15, 1e30] 1/m^3.
    pub number_density: f64,
    /// Depolarisation of scattered light, in [0, 0.8].
    pub depolarisation: f64,
    /// Scale height, in [1, 1e6] m.
    pub scale_height: f64,
}

fn molecules() -> String {
    "molecules".to_owned()
}

/// Haze, described by how turbid it makes the air.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aerosol {
    /// What it is, for messages.
    #[serde(default = "aerosol")]
    pub name: String,
    /// Turbidity, in [1, 1000]: 1 is pure air, 2 a clear day, 10 thick haze.
    pub turbidity: f64,
    /// Wavelengths of red, green and blue light, each in [1e-7, 1e-5] m.
    pub wavelengths: [f64; 3],
    /// The factor K of each wavelength, each in [0, 10]; about 0.67.
    pub k: [f64; 3],
    /// Scale height, in [1, 1e6] m.
    pub scale_height: f64,
    /// Mean cosine of the scattering angle, in [-0.98, 0.98]; 0.7 to 0.8 on the Earth.
    pub mean_cosine: f64,
}

fn aerosol() -> String {
    "aerosol".to_owned()
}

const WAVELENGTH: (f64, f64, &str) = (1e-7, 1e-5, "m");

impl Molecules {
    /// The layer: Rayleigh's phase function, no absorption.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`].
    pub fn layer(&self) -> Result<Layer, Error> {
        let field = |f: &str| format!("{} of {}", f, self.name);
        each_within(&field("wavelengths"), self.wavelengths, WAVELENGTH)?;
        within(
            &field("refractive_index"),
            self.refractive_index,
            (1.0, 2.0, "1"),
        )?;
        within(
            &field("number_density"),
            self.number_density,
            (1e15, 1e30, "1/m^3"),
        )?;
        within(
            &field("depolarisation"),
            self.depolarisation,
            (0.0, 0.8, "1"),
        )?;
        Ok(Layer {
            name: self.name.clone(),
            profile: Profile::Exponential {
                scale_height: self.scale_height,
            },
            scattering: self.wavelengths.map(|wavelength| {
                rayleigh_scattering(
                    wavelength,
                    self.refractive_index,
                    self.number_density,
                    self.depolarisation,
                )
            }),
            absorption: [0.0; 3],
            phase: Phase::Rayleigh,
        })
    }
}

impl Aerosol {
    /// The layer: Cornette and Shanks's phase function of the mean cosine, no absorption.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`].
    pub fn layer(&self) -> Result<Layer, Error> {
        let field = |f: &str| format!("{} of {}", f, self.name);
        within(&field("turbidity"), self.turbidity, (1.0, 1000.0, "1"))?;
        each_within(&field("wavelengths"), self.wavelengths, WAVELENGTH)?;
        each_within(&field("k"), self.k, (0.0, 10.0, "1"))?;
        Ok(Layer {
            name: self.name.clone(),
            profile: Profile::Exponential {
                scale_height: self.scale_height,
            },
            scattering: std::array::from_fn(|c| {
                aerosol_scattering(self.turbidity, self.wavelengths[c], self.k[c])
            }),
            absorption: [0.0; 3],
            phase: Phase::CornetteShanksMean {
                u: self.mean_cosine,
            },
        })
    }
}
