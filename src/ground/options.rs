//! What a ground obeys: scheme, edges, weather, erosion.

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// How water moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Scheme {
    /// That of the source: four outflow speeds a cell from differences of level, damped each step. Its speeds are metres in a step of 1.
    #[default]
    Source,
    /// Shallow water with advection, metres and seconds.
    Physical,
}

/// What lies beyond the edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Boundary {
    /// The same ground without water: water runs off.
    #[default]
    Open,
    /// A wall ("aquarium").
    Closed,
    /// The opposite edge.
    Periodic,
}

/// A place where water springs up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Column of its middle.
    pub x: f32,
    /// Row of its middle.
    pub z: f32,
    /// Radius (cells), in [0, 4096].
    pub radius: f32,
    /// What springs up (m^3/s), in [0, 1e9].
    pub rate: f32,
}

/// What running water does to the ground. Only the scheme of the source erodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Erosion {
    /// Load that water carries, per its speed and depth, in [0, 10].
    pub capacity: f32,
    /// Depth from which more water carries no more (m), in [0, 100].
    pub deepest: f32,
    /// Share of the missing load that is dug in a step, in [0, 1].
    pub dig: f32,
    /// Share of the excess load that is laid down in a step, in [0, 1].
    pub lay: f32,
    /// Slope from which ground slides (1), in [0, 1e3].
    pub slope_limit: f32,
    /// Share of what stands too high that slides over an edge in a step, in [0, 0.2].
    pub slide: f32,
    /// Share by which the hardest ground resists, in [0, 1].
    pub hardness: f32,
    /// Wavelength of hard spots (cells), in [0, 4096]; 0: none.
    pub hard_wavelength: f32,
    /// Thickness of a pair of layers, hard and soft (m), in [0, 1e4]; 0: none, else instead of spots.
    pub layer: f32,
}

impl Default for Erosion {
    fn default() -> Self {
        Erosion {
            capacity: 0.05,
            deepest: 1.0,
            dig: 0.02,
            lay: 0.05,
            slope_limit: 1.2,
            slide: 0.1,
            hardness: 0.0,
            hard_wavelength: 12.0,
            layer: 0.0,
        }
    }
}

/// What a ground obeys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundOptions {
    /// How water moves.
    pub scheme: Scheme,
    /// What lies beyond the edges.
    pub boundary: Boundary,
    /// Distance of cells (m), in [1e-3, 1e4].
    pub spacing: f32,
    /// Length of a step (s). `Source`: in [1e-4, 0.5], beyond which it is not stable. `Physical`: in [0, 1e3]; 0: from the data by `courant`; a fixed step holds speeds below
    /// 0.249 cells a step.
    pub step: f32,
    /// Factor on the speeds in each step of `Source`, in [0, 1].
    pub damping: f32,
    /// Whether moving water takes its speed along (`Source`).
    pub momentum: bool,
    /// Rain everywhere (m/s), in [0, 1].
    pub rain: f32,
    /// Evaporation (m/s), in [0, 1].
    pub evaporation: f32,
    /// Seepage (m/s), in [0, 1].
    pub seepage: f32,
    /// Share of a step's water in the running mean, in [1e-3, 1].
    pub mean_weight: f32,
    /// Gravity of `Physical` (m/s^2), in [0.01, 100].
    pub gravity: f32,
    /// Cells that the fastest wave of `Physical` crosses in a step, in [0.01, 0.5].
    pub courant: f32,
    /// Manning's coefficient of `Physical` (s/m^(1/3)), in [0, 1].
    pub friction: f32,
    /// Longest step from the data (s), in [1e-4, 1e3].
    pub longest_step: f32,
    /// Erosion; `None`: the ground stays.
    pub erosion: Option<Erosion>,
    /// Springs, up to 4.
    pub springs: Vec<Spring>,
}

impl Default for GroundOptions {
    fn default() -> Self {
        GroundOptions {
            scheme: Scheme::Source,
            boundary: Boundary::Open,
            spacing: 1.0,
            step: 0.25,
            damping: 0.97,
            momentum: true,
            rain: 0.0,
            evaporation: 0.0,
            seepage: 0.0,
            mean_weight: 0.01,
            gravity: 9.81,
            courant: 0.2,
            friction: 0.0,
            longest_step: 1.0,
            erosion: None,
            springs: Vec::new(),
        }
    }
}

pub(super) fn within(name: &str, value: f32, low: f32, high: f32) -> Result<(), Error> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::OutOfDomain {
        name: format!("ground.{name}"),
        value: value.to_string(),
        domain: format!("in [{low}, {high}]"),
    })
}

impl GroundOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        within("spacing", self.spacing, 1e-3, 1e4)?;
        match self.scheme {
            Scheme::Source => within("step", self.step, 1e-4, 0.5)?,
            Scheme::Physical => within("step", self.step, 0.0, 1e3)?,
        }
        within("damping", self.damping, 0.0, 1.0)?;
        within("rain", self.rain, 0.0, 1.0)?;
        within("evaporation", self.evaporation, 0.0, 1.0)?;
        within("seepage", self.seepage, 0.0, 1.0)?;
        within("mean_weight", self.mean_weight, 1e-3, 1.0)?;
        within("gravity", self.gravity, 0.01, 100.0)?;
        within("courant", self.courant, 0.01, 0.5)?;
        within("friction", self.friction, 0.0, 1.0)?;
        within("longest_step", self.longest_step, 1e-4, 1e3)?;
        if let Some(e) = &self.erosion {
            if self.scheme == Scheme::Physical {
                return Err(Error::OutOfDomain {
                    name: "ground.erosion".to_owned(),
                    value: "given".to_owned(),
                    domain: "left out with the scheme `Physical`, which does not erode".to_owned(),
                });
            }
            within("erosion.capacity", e.capacity, 0.0, 10.0)?;
            within("erosion.deepest", e.deepest, 0.0, 100.0)?;
            within("erosion.dig", e.dig, 0.0, 1.0)?;
            within("erosion.lay", e.lay, 0.0, 1.0)?;
            within("erosion.slope_limit", e.slope_limit, 0.0, 1e3)?;
            within("erosion.slide", e.slide, 0.0, 0.2)?;
            within("erosion.hardness", e.hardness, 0.0, 1.0)?;
            within("erosion.hard_wavelength", e.hard_wavelength, 0.0, 4096.0)?;
            within("erosion.layer", e.layer, 0.0, 1e4)?;
        }
        if self.springs.len() > 4 {
            return Err(Error::OutOfDomain {
                name: "ground.springs".to_owned(),
                value: format!("{} of them", self.springs.len()),
                domain: "up to 4 of them".to_owned(),
            });
        }
        for spring in &self.springs {
            within("springs.x", spring.x, 0.0, 4096.0)?;
            within("springs.z", spring.z, 0.0, 4096.0)?;
            within("springs.radius", spring.radius, 0.0, 4096.0)?;
            within("springs.rate", spring.rate, 0.0, 1e9)?;
        }
        Ok(())
    }
}
