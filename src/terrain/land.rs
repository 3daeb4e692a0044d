//! Land as a file has it: a height field on a planet. Those that come with the crate.

use serde::{Deserialize, Serialize};

use super::field::{Domain, HeightField};
use super::ground::Prepared;
use super::real::Real;
use crate::error::Error;

fn earth() -> f64 {
    6_360_000.0
}

/// What the ground is made of: rock, and snow where it is flat.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Albedo of the darkest rock, each channel in [0, 1].
    pub rock_dark: [f32; 3],
    /// Albedo of the lightest rock, each channel in [0, 1].
    pub rock_light: [f32; 3],
    /// Wavelength of the coarsest rock texture (m), in [1, 1e6].
    pub rock_wavelength: f32,
    /// Albedo of weathered stains as a share of the darkest rock's, in [0, 1].
    pub rock_stain: f32,
    /// Albedo of snow, each channel in [0, 1].
    pub snow: [f32; 3],
    /// Slope (1 - normal.y) up to which snow covers everything, in [-10, 2]; below -1 there is none.
    pub snow_edge_low: f32,
    /// Slope from which no snow lies, in [-10, 2].
    pub snow_edge_high: f32,
    /// How irregular the border of the snow is, in [0, 1].
    pub snow_noise: f32,
    /// Height below which no snow lies (m), in [-1e5, 1e5], blurred by 100 m; on a `Sphere` by 300 m, and it falls by 80 m for a degree of latitude.
    pub snow_line: f32,
}

impl Default for Material {
    /// The rock and the snow of the preset `thesis`.
    fn default() -> Self {
        Material {
            rock_dark: [0.10, 0.09, 0.08],
            rock_light: [0.34, 0.30, 0.26],
            rock_wavelength: 32.0,
            rock_stain: 0.6,
            snow: [0.85, 0.87, 0.90],
            snow_edge_low: 0.10,
            snow_edge_high: 0.32,
            snow_noise: 0.15,
            snow_line: -1e5,
        }
    }
}

impl Material {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name: &str, value: f32, low: f32, high: f32| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfDomain {
                name: format!("material.{name}"),
                value: value.to_string(),
                domain: format!("in [{low}, {high}]"),
            })
        };
        for (name, albedo) in [
            ("rock_dark", self.rock_dark),
            ("rock_light", self.rock_light),
            ("snow", self.snow),
        ] {
            for channel in albedo {
                within(name, channel, 0.0, 1.0)?;
            }
        }
        within("rock_wavelength", self.rock_wavelength, 1.0, 1e6)?;
        within("rock_stain", self.rock_stain, 0.0, 1.0)?;
        within("snow_line", self.snow_line, -1e5, 1e5)?;
        within("snow_edge_low", self.snow_edge_low, -10.0, 2.0)?;
        within("snow_edge_high", self.snow_edge_high, -10.0, 2.0)?;
        within("snow_noise", self.snow_noise, 0.0, 1.0)
    }
}

/// A sea: no ground is below its level. It is still, and as dull as the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sea {
    /// Height of its level (m), in [-2e4, 2e4].
    pub level: f64,
    /// Its albedo, each channel in [0, 1].
    pub albedo: [f32; 3],
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
    /// What it is made of.
    #[serde(default)]
    pub material: Material,
    /// A sea.
    #[serde(default)]
    pub sea: Option<Sea>,
}

impl Default for Land {
    /// The mountains of the preset `thesis` on the Earth.
    fn default() -> Self {
        Land {
            field: HeightField::default(),
            planet_radius: earth(),
            material: Material::default(),
            sea: None,
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

shipped!(
    "thesis", "alps", "hills", "islands", "lowlands", "mesa", "moon", "luna", "terra"
);

impl Land {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        self.field.check()?;
        self.material.check()?;
        let fault = |name: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: format!("land.{name}"),
                value,
                domain: domain.to_owned(),
            })
        };
        if !(1e5..=1e9).contains(&self.planet_radius) {
            let value = self.planet_radius.to_string();
            return fault("planet_radius", value, "in [1e5, 1e9] m");
        }
        let on_sphere = self.field.domain == Domain::Sphere;
        if on_sphere && self.field.wavelength > 0.25 * self.planet_radius {
            let value = self.field.wavelength.to_string();
            let domain = "at most a quarter of the planet's radius on a Sphere";
            return fault("field.wavelength", value, domain);
        }
        let Some(sea) = self.sea else {
            return Ok(());
        };
        if !(-2e4..=2e4).contains(&sea.level) {
            return fault("sea.level", sea.level.to_string(), "in [-2e4, 2e4] m");
        }
        match sea.albedo.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            Some(c) => fault("sea.albedo", c.to_string(), "in [0, 1]"),
            None => Ok(()),
        }
    }

    /// The field on the plane with the sea over it, in `f32` as the device computes it, or in `f64`.
    ///
    /// ```
    /// use veduta::WorldPos;
    /// use veduta::terrain::{HeightField, Land, Sea};
    /// let field = HeightField { base: -3000.0, ..Default::default() };
    /// let sea = Some(Sea { level: -1500.0, albedo: [0.02, 0.03, 0.05] });
    /// let land = Land { field, sea, ..Default::default() }.prepare::<f64>()?;
    /// assert!(land.ground(WorldPos::default(), 0.0).height >= -1500.0);
    /// # Ok::<(), veduta::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Land::check`] and [`HeightField::prepare`].
    pub fn prepare<T: Real>(&self) -> Result<Prepared<T>, Error> {
        self.check()?;
        let field = self.field.prepare()?;
        Ok(match self.sea {
            Some(sea) => field.under_sea(sea.level),
            None => field,
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
