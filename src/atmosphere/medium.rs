//! What the air is made of.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use crate::error::Error;

/// The air of a planet, the ground below it and the sun above. SI units.
///
/// `Atmosphere::default()` is the Earth, `Atmosphere::named` has more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Atmosphere {
    /// Radius of the ground sphere, in [1e3, 1e9] m.
    pub planet_radius: f64,
    /// Thickness of the air, in [1, 1e7] m; the air ends there.
    pub thickness: f64,
    /// Albedo of the ground in red, green and blue, each in [0, 1].
    pub ground_albedo: [f64; 3],
    /// The sun.
    pub sun: Sun,
    /// What the air consists of; all layers together have at most eight lobes (see [`Phase`]).
    pub layers: Vec<Layer>,
}

/// The light outside the air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Angular radius of the disc, in [0, 0.5] rad.
    pub angular_radius: f64,
    /// Irradiance in red, green and blue relative to a white sun, each in [0, 1000].
    pub colour: [f64; 3],
}

/// A substance in the air.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// What it is, for messages.
    pub name: String,
    /// How its density changes with altitude.
    pub profile: Profile,
    /// Scattering where the density is 1, in red, green and blue, each in [0, 1] 1/m.
    pub scattering: [f64; 3],
    /// Absorption where the density is 1, in red, green and blue, each in [0, 1] 1/m.
    pub absorption: [f64; 3],
    /// Where scattered light goes.
    pub phase: Phase,
}

/// Density of a layer relative to its greatest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Profile {
    /// exp(-h / scale_height).
    Exponential {
        /// In [1, 1e6] m.
        scale_height: f64,
    },
    /// Linear from 0 at the bottom to 1 at the peak and back to 0 at the top.
    Tent {
        /// Where it begins [m].
        bottom: f64,
        /// Where it is densest [m].
        peak: f64,
        /// Where it ends [m].
        top: f64,
    },
    /// 1 between two altitudes, 0 elsewhere.
    Constant {
        /// Where it begins [m].
        bottom: f64,
        /// Where it ends [m].
        top: f64,
    },
}

/// A phase function, normalised to 1 over the sphere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Phase {
    /// The same everywhere.
    Isotropic,
    /// Of molecules.
    Rayleigh,
    /// Henyey and Greenstein 1941.
    HenyeyGreenstein {
        /// Mean cosine, in [-0.99, 0.99].
        g: f64,
    },
    /// Cornette and Shanks 1992.
    CornetteShanks {
        /// Asymmetry, in [-0.99, 0.99]; not the mean cosine.
        g: f64,
    },
    /// Cornette and Shanks 1992, given by the mean cosine.
    CornetteShanksMean {
        /// Mean cosine, in [-0.98, 0.98].
        u: f64,
    },
    /// Draine 2003.
    Draine {
        /// Asymmetry, in [-0.99, 0.99].
        g: f64,
        /// In [0, 100]: 0 is Henyey and Greenstein's, 1 Cornette and Shanks's.
        alpha: f64,
    },
    /// Two lobes of Henyey and Greenstein; counts as two.
    TwoLobes {
        /// Mean cosine of the forward lobe, in [-0.99, 0.99].
        forward: f64,
        /// Mean cosine of the backward lobe, in [-0.99, 0.99].
        backward: f64,
        /// Share of the backward lobe, in [0, 1].
        backward_share: f64,
    },
}

/// One lobe: weight (level + square nu^2) (1 + g^2 - 2 g nu)^(-3/2), with the weight left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// Share of the phase function.
    pub weight: f64,
    /// Asymmetry.
    pub g: f64,
    /// Level [1/sr].
    pub level: f64,
    /// Coefficient of nu^2 [1/sr].
    pub square: f64,
    /// First Legendre moment.
    pub first: f64,
    /// Second Legendre moment.
    pub second: f64,
}

impl Lobe {
    /// The lobe (1 + alpha nu^2) times Henyey and Greenstein's, normalised.
    fn draine(weight: f64, g: f64, alpha: f64) -> Lobe {
        let share = 1.0 / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
        let fourth = (8.0 * g.powi(4) + 20.0 * g * g + 7.0) / 35.0;
        let square = (1.0 + 2.0 * g * g) / 3.0;
        Lobe {
            weight,
            g,
            level: share * (1.0 - g * g) / (4.0 * PI),
            square: share * alpha * (1.0 - g * g) / (4.0 * PI),
            first: share * (g + alpha * (2.0 * g.powi(3) + 3.0 * g) / 5.0),
            second: share * (g * g + alpha * (3.0 * fourth - square) / 2.0),
        }
    }

    /// Its value for a cosine of the scattering angle, weight left out [1/sr].
    pub fn value(&self, nu: f64) -> f64 {
        let base = (1.0 - self.g).powi(2) + 2.0 * self.g * (1.0 - nu);
        (self.level + self.square * nu * nu) / (base * base.sqrt())
    }
}

/// Asymmetry of Cornette and Shanks's phase function for a mean cosine `u` in (-1, 1): the root of
/// u = 3 g (4 + g^2) / (5 (2 + g^2)).
pub fn cornette_shanks_asymmetry(u: f64) -> f64 {
    let linear = 5.0 * u / 9.0;
    let x = linear
        + 125.0 * u.powi(3) / 729.0
        + (64.0 / 27.0 - 325.0 * u * u / 243.0 + 1250.0 * u.powi(4) / 2187.0).sqrt();
    linear - (4.0 / 3.0 - 25.0 * u * u / 81.0) / x.cbrt() + x.cbrt()
}

impl Phase {
    /// The lobes that it is the sum of.
    pub fn lobes(&self) -> Vec<Lobe> {
        match *self {
            Phase::Isotropic => vec![Lobe::draine(1.0, 0.0, 0.0)],
            Phase::Rayleigh => vec![Lobe::draine(1.0, 0.0, 1.0)],
            Phase::HenyeyGreenstein { g } => vec![Lobe::draine(1.0, g, 0.0)],
            Phase::CornetteShanks { g } => vec![Lobe::draine(1.0, g, 1.0)],
            Phase::CornetteShanksMean { u } => {
                vec![Lobe::draine(1.0, cornette_shanks_asymmetry(u), 1.0)]
            }
            Phase::Draine { g, alpha } => vec![Lobe::draine(1.0, g, alpha)],
            Phase::TwoLobes {
                forward,
                backward,
                backward_share,
            } => vec![
                Lobe::draine(1.0 - backward_share, forward, 0.0),
                Lobe::draine(backward_share, backward, 0.0),
            ],
        }
    }

    /// Its value for a cosine of the scattering angle, 1 forward [1/sr].
    pub fn value(&self, nu: f64) -> f64 {
        self.lobes().iter().map(|l| l.weight * l.value(nu)).sum()
    }
}

impl Profile {
    /// Density at an altitude; below 0 that at 0.
    pub fn density(&self, h: f64) -> f64 {
        let h = h.max(0.0);
        match *self {
            Profile::Exponential { scale_height } => (-h / scale_height).exp(),
            Profile::Tent { bottom, peak, top } => {
                let up = (h - bottom) / (peak - bottom);
                let down = (top - h) / (top - peak);
                up.min(down).clamp(0.0, 1.0)
            }
            Profile::Constant { bottom, top } => f64::from(u8::from(h >= bottom && h <= top)),
        }
    }
}
