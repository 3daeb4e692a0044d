//! Land as a file has it: a height field on a planet. Those that come with the crate.

use serde::{Deserialize, Serialize};

use super::field::HeightField;
use crate::error::Error;

fn earth() -> f64 {
    6_360_000.0
}

/// A height field on a planet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Land {
    /// The heights above the planet's radius.
    pub field: HeightField,
    /// Radius of the planet (m), in [1e5, 1e9]; the plane of the field is bent to it below the eye.
    #[serde(default = "earth")]
    pub planet_radius: f64,
}

impl Default for Land {
    /// The mountains of the preset `thesis` on the Earth.
    fn default() -> Self {
        Land {
            field: HeightField::default(),
            planet_radius: earth(),
        }
    }
}

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// The names with their texts, the default first.
        const SHIPPED: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../presets/terrains/", $name, ".ron")))),+
        ];
    };
}

shipped!("thesis", "alps", "hills", "islands", "lowlands", "moon");

impl Land {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        self.field.check()?;
        if (1e5..=1e9).contains(&self.planet_radius) {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: "land.planet_radius".to_owned(),
            value: self.planet_radius.to_string(),
            domain: "in [1e5, 1e9] m".to_owned(),
        })
    }

    /// The names that [`Land::named`] knows, the default first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// A land that comes with the crate.
    ///
    /// # Errors
    /// [`Error::UnknownLand`].
    pub fn named(name: &str) -> Result<Land, Error> {
        match SHIPPED.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Land::from_ron(text),
            None => Err(Error::UnknownLand {
                name: name.to_owned(),
                known: Land::names().map(str::to_owned).collect(),
            }),
        }
    }

    /// Reads a land as the files of `presets/terrains` have it.
    ///
    /// # Errors
    /// [`Error::Ron`] with line and column; as [`Land::check`].
    pub fn from_ron(text: &str) -> Result<Land, Error> {
        let land: Land =
            ron::from_str(text).map_err(|fault| Error::Ron(format!("no land: {fault}")))?;
        land.check()?;
        Ok(land)
    }

    /// Writes the land so that [`Land::from_ron`] gives an equal one.
    ///
    /// # Errors
    /// As [`Land::check`].
    pub fn to_ron(&self) -> Result<String, Error> {
        self.check()?;
        ron::ser::to_string_pretty(self, ron::ser::PrettyConfig::new().depth_limit(2))
            .map_err(|fault| Error::Ron(format!("the land cannot be written: {fault}")))
    }
}
