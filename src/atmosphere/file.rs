//! Atmospheres as RON, and those that come with the crate.

use serde::{Deserialize, Serialize};

use super::medium::{Atmosphere, Layer, Sun};
use super::physics::{Aerosol, Molecules};
use crate::error::Error;

/// An atmosphere as a file has it: layers by their coefficients or by what they consist of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Atmosphere", deny_unknown_fields)]
pub(super) struct AtmosphereFile {
    planet_radius: f64,
    thickness: f64,
    ground_albedo: [f64; 3],
    sun: Sun,
    layers: Vec<LayerFile>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum LayerFile {
    Layer(Layer),
    Molecules(Molecules),
    Aerosol(Aerosol),
}

impl TryFrom<AtmosphereFile> for Atmosphere {
    type Error = Error;

    fn try_from(file: AtmosphereFile) -> Result<Atmosphere, Error> {
        let layers = file.layers.into_iter().map(|layer| match layer {
            LayerFile::Layer(layer) => Ok(layer),
            LayerFile::Molecules(molecules) => molecules.layer(),
            LayerFile::Aerosol(aerosol) => aerosol.layer(),
        });
        let atmosphere = Atmosphere {
            planet_radius: file.planet_radius,
            thickness: file.thickness,
            ground_albedo: file.ground_albedo,
            sun: file.sun,
            layers: layers.collect::<Result<_, Error>>()?,
        };
        atmosphere.check()?;
        Ok(atmosphere)
    }
}

impl From<Atmosphere> for AtmosphereFile {
    fn from(atmosphere: Atmosphere) -> AtmosphereFile {
        AtmosphereFile {
            planet_radius: atmosphere.planet_radius,
            thickness: atmosphere.thickness,
            ground_albedo: atmosphere.ground_albedo,
            sun: atmosphere.sun,
            layers: atmosphere
                .layers
                .into_iter()
                .map(LayerFile::Layer)
                .collect(),
        }
    }
}

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// The names with their texts, the default first.
        const SHIPPED: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../presets/atmospheres/", $name, ".ron")))),+
        ];
    };
}

shipped!("earth", "thesis", "hazy", "afra", "mars");

fn ron() -> ron::Options {
    ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES)
}

impl Atmosphere {
    /// The names that [`Atmosphere::named`] knows, the default first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// An atmosphere that comes with the crate:
    ///
    /// - `earth`: the default, as Hillaire 2020 has it, with ozone;
    /// - `thesis`: Leitner 2022, clear air without ozone over black ground;
    /// - `hazy`: the same with ten times the haze;
    /// - `afra`: molecules and haze by their physics, at Afra's wavelengths;
    /// - `mars`: thin carbon dioxide with dust that makes a blue sunset.
    ///
    /// # Errors
    /// [`Error::UnknownAtmosphere`].
    pub fn named(name: &str) -> Result<Atmosphere, Error> {
        match SHIPPED.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Atmosphere::from_ron(text),
            None => Err(Error::UnknownAtmosphere {
                name: name.to_owned(),
                known: Atmosphere::names().map(str::to_owned).collect(),
            }),
        }
    }

    /// Reads an atmosphere as the files of `presets/atmospheres` have it. A layer is `Layer(..)` with its coefficients,
    /// `Molecules(..)` with the fields of [`Molecules`], or `Aerosol(..)` with those of [`Aerosol`].
    ///
    /// # Errors
    /// [`Error::Ron`] with line and column; as [`Atmosphere::check`].
    pub fn from_ron(text: &str) -> Result<Atmosphere, Error> {
        let file: AtmosphereFile = ron()
            .from_str(text)
            .map_err(|fault| Error::Ron(format!("no atmosphere: {fault}")))?;
        file.try_into()
    }

    /// Writes the atmosphere so that [`Atmosphere::from_ron`] gives an equal one, every layer by its coefficients.
    ///
    /// # Errors
    /// As [`Atmosphere::check`].
    pub fn to_ron(&self) -> Result<String, Error> {
        self.check()?;
        let pretty = ron::ser::PrettyConfig::new().depth_limit(3);
        ron()
            .to_string_pretty(&AtmosphereFile::from(self.clone()), pretty)
            .map_err(|fault| Error::Ron(format!("the atmosphere cannot be written: {fault}")))
    }
}
