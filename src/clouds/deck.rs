//! What a layer of clouds is.

use serde::{Deserialize, Serialize};

use super::fault;
use crate::error::Error;

/// A layer of clouds between two spheres around a planet: six octaves of value noise, cut by the coverage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloudDeck {
    /// Radius of the planet (m), in [1e5, 1e9].
    pub planet_radius: f64,
    /// Altitude of the lower sphere (m), in [0, 1e5].
    pub bottom: f64,
    /// Distance between the spheres (m), in [0, 1e5].
    pub thickness: f64,
    /// Share of the noise's range that is cloud, in [0, 1]: 0 none, 1 everything.
    pub coverage: f64,
    /// How far the noise is filled up, in [0, 1]: 0 separate clouds, 1 a homogeneous deck of full density.
    pub uniformity: f64,
    /// Wavelength of the first octave (m), in [1, 1e6].
    pub wavelength: f64,
    /// The field repeats after 2 to this power wavelengths, in [1, 12].
    pub period_doublings: u32,
    /// Extinction at full density (1/m), in [0, 1e6].
    pub extinction: f64,
    /// Scattered share of the extinction, in [0, 1].
    pub albedo: f64,
    /// Asymmetry of the forward lobe, in [0, 0.999].
    pub g_forward: f64,
    /// Asymmetry of the backward lobe, in [-0.999, 0].
    pub g_backward: f64,
    /// Share of the backward lobe, in [0, 1].
    pub backward_share: f64,
    /// Seed of the noise.
    pub seed: u32,
    /// Velocity along x and z (m/s), each in [-1000, 1000].
    pub wind: [f64; 2],
}

impl Default for CloudDeck {
    /// The layer of the preset `thesis`.
    fn default() -> Self {
        CloudDeck {
            planet_radius: 6_360_000.0,
            bottom: 4000.0,
            thickness: 1500.0,
            coverage: 0.5,
            uniformity: 0.0,
            wavelength: 4000.0,
            period_doublings: 2,
            extinction: 0.06,
            albedo: 1.0,
            g_forward: 0.7,
            g_backward: -0.5,
            backward_share: 0.5,
            seed: 2,
            wind: [0.0; 2],
        }
    }
}

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// The names with their texts, the default first.
        const SHIPPED: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../presets/clouds/", $name, ".ron")))),+
        ];
    };
}

shipped!("thesis", "cumulus", "stratus");

impl CloudDeck {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        for (name, value, low, high) in [
            ("planet_radius", self.planet_radius, 1e5, 1e9),
            ("bottom", self.bottom, 0.0, 1e5),
            ("thickness", self.thickness, 0.0, 1e5),
            ("coverage", self.coverage, 0.0, 1.0),
            ("uniformity", self.uniformity, 0.0, 1.0),
            ("wavelength", self.wavelength, 1.0, 1e6),
            (
                "period_doublings",
                f64::from(self.period_doublings),
                1.0,
                12.0,
            ),
            ("extinction", self.extinction, 0.0, 1e6),
            ("albedo", self.albedo, 0.0, 1.0),
            ("g_forward", self.g_forward, 0.0, 0.999),
            ("g_backward", self.g_backward, -0.999, 0.0),
            ("backward_share", self.backward_share, 0.0, 1.0),
            ("wind[0]", self.wind[0], -1e3, 1e3),
            ("wind[1]", self.wind[1], -1e3, 1e3),
        ] {
            if !(low..=high).contains(&value) {
                return Err(fault(
                    &format!("deck.{name}"),
                    value,
                    &format!("in [{low}, {high}]"),
                ));
            }
        }
        if self.period() > 1e9 {
            return Err(fault(
                "deck.wavelength with deck.period_doublings",
                self.period(),
                "a period of at most 1e9 m",
            ));
        }
        Ok(())
    }

    /// Edge of the tile after which the field repeats along x and z (m).
    pub fn period(&self) -> f64 {
        self.wavelength * f64::from(self.period_doublings.min(31)).exp2()
    }

    /// Way without clouds for each unit that the density before its cut is below 0 (m): the noise seldom rises by more than its whole range over half a
    /// wavelength of the first octave.
    pub(super) fn clear_way(&self) -> f64 {
        0.5 * self.coverage * self.wavelength / (1.0 - self.uniformity).max(0.01)
    }

    /// Whether there is nothing to see of it.
    pub fn is_empty(&self) -> bool {
        self.thickness <= 0.0 || self.coverage <= 0.0 || self.extinction <= 0.0
    }

    /// The names that [`CloudDeck::named`] knows, the default first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// A layer that comes with the crate.
    ///
    /// # Errors
    /// [`Error::UnknownClouds`].
    pub fn named(name: &str) -> Result<CloudDeck, Error> {
        match SHIPPED.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => CloudDeck::from_ron(text),
            None => Err(Error::UnknownClouds {
                name: name.to_owned(),
                known: CloudDeck::names().map(str::to_owned).collect(),
            }),
        }
    }

    /// Reads a layer as the files of `presets/clouds` have it; what is left out is that of the preset `thesis`.
    ///
    /// # Errors
    /// [`Error::Ron`] with line and column; as [`CloudDeck::check`].
    pub fn from_ron(text: &str) -> Result<CloudDeck, Error> {
        let deck: CloudDeck =
            ron::from_str(text).map_err(|fault| Error::Ron(format!("no clouds: {fault}")))?;
        deck.check()?;
        Ok(deck)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_layers_are_read_and_faults_are_named() {
        for name in CloudDeck::names() {
            assert!(!CloudDeck::named(name).unwrap().is_empty());
        }
        assert_eq!(CloudDeck::named("thesis").unwrap(), CloudDeck::default());
        assert!(CloudDeck::named("fog").is_err());
        for (text, name) in [
            ("(coverage: 1.5)", "deck.coverage"),
            ("(extinction: NaN)", "deck.extinction"),
            ("(cover: 1)", "no clouds"),
        ] {
            let error = CloudDeck::from_ron(text).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
