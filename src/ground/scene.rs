//! A ground as a file has it: how it begins and what it obeys. Those that come with the crate.

use serde::{Deserialize, Serialize};

use super::camera::GroundCamera;
use super::options::{Boundary, Erosion, GroundOptions};
use super::picture::GroundLook;
use super::shape::Form;
use super::state::{CHANNELS, GroundState};
use crate::device::Gpu;
use crate::error::Error;
use crate::program::ProgramSet;
use crate::terrain::{HeightField, HeightMap, heights};
use crate::view::WorldPos;

/// What is added to the heights of the field, over the middle of the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Shape {
    /// Nothing.
    #[default]
    Even,
    /// A hill in the middle, `relief` high.
    Hill,
    /// A hollow in the middle, `relief` deep.
    Lake,
    /// A valley along z, `relief` deep.
    Valley,
    /// A ridge along z, `relief` high.
    Ridge,
    /// A slope that falls by `relief` from the first to the last column.
    Slope,
    /// A plain that falls by half of `relief` from the first to the last column, with a winding river bed along x, half of `relief` deep.
    Bed,
}

impl Shape {
    /// Share of the relief at a place of the unit square.
    pub fn share(self, x: f64, z: f64) -> f64 {
        let bump = |r: f64| {
            let t = (1.0 - r.abs()).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        let (a, b) = (2.0 * x - 1.0, 2.0 * z - 1.0);
        match self {
            Shape::Even => 0.0,
            Shape::Hill => bump((a * a + b * b).sqrt()),
            Shape::Lake => -bump((a * a + b * b).sqrt()),
            Shape::Valley => -bump(a),
            Shape::Ridge => bump(a),
            Shape::Slope => -x,
            Shape::Bed => {
                let middle = 0.2 * (4.0 * std::f64::consts::PI * x).sin();
                -0.5 * x - 0.5 * bump((b - middle) / 0.1)
            }
        }
    }
}

/// How a ground begins, and what it obeys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundScene {
    /// Cells along x, in [16, 4096].
    pub columns: u32,
    /// Cells along z, in [16, 4096].
    pub rows: u32,
    /// Heights; `None`: a plane.
    pub field: Option<HeightField>,
    /// Heights of a map, a texel a cell from the first on, added to the field; its `origin` must be 0. A map's file is read by `GroundScene::read` (feature `height_maps`).
    pub heights: Option<HeightMap>,
    /// Where the first cell lies on the field (m).
    pub origin: [f64; 2],
    /// Added to the field.
    pub shape: Shape,
    /// Height of the shape (m), in [-1e4, 1e4].
    pub relief: f64,
    /// Added everywhere (m), in [-1e4, 1e4].
    pub altitude: f64,
    /// Passes of smoothing, in [0, 1000]: each cell becomes the mean of itself and its eight neighbours, over the edges where the boundary is `Periodic`.
    pub smooth: u32,
    /// Water stands up to this altitude (m) in the first columns.
    pub water_level: Option<f64>,
    /// Share of the columns that it stands in, in [0, 1].
    pub water_share: f64,
    /// Depth of water everywhere (m), in [0, 1e4].
    pub depth: f64,
    /// What it obeys.
    pub options: GroundOptions,
    /// Where it is seen from; `None`: from the south and above.
    pub camera: Option<GroundCamera>,
    /// How its picture is coloured.
    pub look: GroundLook,
}

impl Default for GroundScene {
    fn default() -> Self {
        GroundScene {
            columns: 256,
            rows: 256,
            field: None,
            heights: None,
            origin: [0.0; 2],
            shape: Shape::Even,
            relief: 0.0,
            altitude: 0.0,
            smooth: 0,
            water_level: None,
            water_share: 1.0,
            depth: 0.0,
            options: GroundOptions::default(),
            camera: None,
            look: GroundLook::default(),
        }
    }
}

const SHIPPED: &[(&str, &str)] = &[
    ("rain", include_str!("../../presets/grounds/rain.ron")),
    (
        "dam_break",
        include_str!("../../presets/grounds/dam_break.ron"),
    ),
    ("flood", include_str!("../../presets/grounds/flood.ron")),
    ("erosion", include_str!("../../presets/grounds/erosion.ron")),
];

fn parse<T: std::str::FromStr>(key: &str, value: &str, what: &str) -> Result<T, Error> {
    value.trim().parse().map_err(|_| Error::WrongType {
        name: key.to_owned(),
        value: value.to_owned(),
        expected: what.to_owned(),
    })
}

fn word<T: serde::de::DeserializeOwned>(key: &str, value: &str, what: &str) -> Result<T, Error> {
    let mut letters = value.trim().chars();
    let name: String = letters
        .next()
        .map(|c| c.to_uppercase().collect::<String>() + &letters.as_str().to_lowercase())
        .unwrap_or_default();
    ron::from_str(&name).map_err(|_| Error::WrongType {
        name: key.to_owned(),
        value: value.to_owned(),
        expected: what.to_owned(),
    })
}

/// The keys that [`GroundScene::set`] knows.
const KEYS: &[&str] = &[
    "COLUMNS",
    "ROWS",
    "SIZE",
    "SHAPE",
    "RELIEF",
    "ALTITUDE",
    "SMOOTH",
    "SEED",
    "WATER_LEVEL",
    "WATER_SHARE",
    "DEPTH",
    "SCHEME",
    "BOUNDARY",
    "SPACING",
    "STEP",
    "DAMPING",
    "MOMENTUM",
    "RAIN",
    "EVAPORATION",
    "SEEPAGE",
    "MEAN_WEIGHT",
    "GRAVITY",
    "COURANT",
    "FRICTION",
    "LONGEST_STEP",
    "EROSION",
    "CAPACITY",
    "DEEPEST",
    "DIG",
    "LAY",
    "SLOPE_LIMIT",
    "SLIDE",
    "HARDNESS",
    "HARD_WAVELENGTH",
    "LAYER",
    "SPRING",
];

impl GroundScene {
    /// The names that [`GroundScene::named`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The keys that [`GroundScene::set`] knows.
    pub fn keys() -> &'static [&'static str] {
        KEYS
    }

    /// A ground that comes with the crate.
    ///
    /// # Errors
    /// [`Error::UnknownScene`].
    pub fn named(name: &str) -> Result<GroundScene, Error> {
        match SHIPPED.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => GroundScene::from_ron(text),
            None => Err(Error::UnknownScene {
                name: name.to_owned(),
                known: GroundScene::names().map(str::to_owned).collect(),
            }),
        }
    }

    /// Reads a ground as the files of `presets/grounds` have it.
    ///
    /// # Errors
    /// [`Error::Ron`] with line and column; as [`GroundScene::check`].
    pub fn from_ron(text: &str) -> Result<GroundScene, Error> {
        let ron = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let scene: GroundScene = ron
            .from_str(text)
            .map_err(|fault| Error::Ron(format!("no ground: {fault}")))?;
        scene.check()?;
        Ok(scene)
    }

    /// Sets a key, which is a field's name in upper case; RAIN, EVAPORATION and SEEPAGE in mm/h; SPRING adds one by `x,z,radius,rate`, `none` takes all away; EROSION is `on` or `off`.
    /// Whether a number is allowed is said by [`GroundScene::check`].
    ///
    /// # Errors
    /// [`Error::UnknownKey`], [`Error::WrongType`]; [`Error::OutOfDomain`] for a SEED of a ground without a field.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), Error> {
        let real = || parse::<f64>(key, value, "a number");
        let single = || parse::<f32>(key, value, "a number");
        let whole = || parse::<u32>(key, value, "a whole number");
        let yes = || match value.trim() {
            "on" | "true" | "1" | "yes" => Ok(true),
            "off" | "false" | "0" | "no" => Ok(false),
            _ => Err(Error::WrongType {
                name: key.to_owned(),
                value: value.to_owned(),
                expected: "on or off".to_owned(),
            }),
        };
        let o = &mut self.options;
        const HOURLY: f64 = 1.0 / 3.6e6;
        match key.to_uppercase().as_str() {
            "COLUMNS" => self.columns = whole()?,
            "ROWS" => self.rows = whole()?,
            "SIZE" => [self.columns, self.rows] = [whole()?; 2],
            "SHAPE" => {
                self.shape = word(key, value, "Even, Hill, Lake, Valley, Ridge, Slope or Bed")?
            }
            "RELIEF" => self.relief = real()?,
            "ALTITUDE" => self.altitude = real()?,
            "SMOOTH" => self.smooth = whole()?,
            "SEED" => {
                let seed = whole()?;
                let Some(field) = &mut self.field else {
                    return Err(Error::OutOfDomain {
                        name: key.to_owned(),
                        value: value.to_owned(),
                        domain: "left out for a ground without a field, which has no seed"
                            .to_owned(),
                    });
                };
                field.seed = seed;
            }
            "WATER_LEVEL" => {
                self.water_level = if value.trim() == "none" {
                    None
                } else {
                    Some(real()?)
                };
            }
            "WATER_SHARE" => self.water_share = real()?,
            "DEPTH" => self.depth = real()?,
            "SCHEME" => o.scheme = word(key, value, "Source or Physical")?,
            "BOUNDARY" => o.boundary = word(key, value, "Open, Closed or Periodic")?,
            "SPACING" => o.spacing = single()?,
            "STEP" => o.step = single()?,
            "DAMPING" => o.damping = single()?,
            "MOMENTUM" => o.momentum = yes()?,
            "RAIN" => o.rain = (real()? * HOURLY) as f32,
            "EVAPORATION" => o.evaporation = (real()? * HOURLY) as f32,
            "SEEPAGE" => o.seepage = (real()? * HOURLY) as f32,
            "MEAN_WEIGHT" => o.mean_weight = single()?,
            "GRAVITY" => o.gravity = single()?,
            "COURANT" => o.courant = single()?,
            "FRICTION" => o.friction = single()?,
            "LONGEST_STEP" => o.longest_step = single()?,
            "EROSION" => o.erosion = yes()?.then(|| o.erosion.unwrap_or_default()),
            "SPRING" if value.trim() == "none" => o.springs.clear(),
            "SPRING" => {
                let numbers = value
                    .split(',')
                    .map(|part| parse::<f32>(key, part, "x,z,radius,rate"))
                    .collect::<Result<Vec<f32>, Error>>()?;
                let &[x, z, radius, rate] = numbers.as_slice() else {
                    return Err(Error::WrongType {
                        name: key.to_owned(),
                        value: value.to_owned(),
                        expected: "x,z,radius,rate".to_owned(),
                    });
                };
                o.springs.push(super::Spring { x, z, radius, rate });
            }
            name => {
                let coefficient: fn(&mut Erosion) -> &mut f32 = match name {
                    "CAPACITY" => |e| &mut e.capacity,
                    "DEEPEST" => |e| &mut e.deepest,
                    "DIG" => |e| &mut e.dig,
                    "LAY" => |e| &mut e.lay,
                    "SLOPE_LIMIT" => |e| &mut e.slope_limit,
                    "SLIDE" => |e| &mut e.slide,
                    "HARDNESS" => |e| &mut e.hardness,
                    "HARD_WAVELENGTH" => |e| &mut e.hard_wavelength,
                    "LAYER" => |e| &mut e.layer,
                    _ => {
                        return Err(Error::UnknownKey {
                            name: key.to_owned(),
                            nearest: crate::error::nearest_name(name, KEYS.iter().copied()),
                        });
                    }
                };
                *coefficient(o.erosion.get_or_insert_default()) = single()?;
            }
        }
        Ok(())
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfDomain {
                name: format!("ground.{name}"),
                value: value.to_string(),
                domain: format!("in [{low}, {high}]"),
            })
        };
        within("columns", self.columns.into(), 16.0, 4096.0)?;
        within("rows", self.rows.into(), 16.0, 4096.0)?;
        within("relief", self.relief, -1e4, 1e4)?;
        within("altitude", self.altitude, -1e4, 1e4)?;
        within("smooth", self.smooth.into(), 0.0, 1000.0)?;
        within("water_level", self.water_level.unwrap_or(0.0), -1e4, 2e4)?;
        within("water_share", self.water_share, 0.0, 1.0)?;
        within("depth", self.depth, 0.0, 1e4)?;
        for origin in self.origin {
            within("origin", origin, -1e12, 1e12)?;
        }
        if let Some(field) = &self.field {
            field.check()?;
        }
        if let Some(map) = &self.heights {
            map.check()?;
            for origin in map.origin {
                within("heights.origin", origin, 0.0, 0.0)?;
            }
        }
        if let Some(camera) = &self.camera {
            camera.check()?;
        }
        self.look.check()?;
        self.options.check()
    }

    /// Reads a ground's file, and that of its height map, which is looked for beside it.
    ///
    /// # Errors
    /// [`Error::Ron`] for a file that cannot be read, and as [`GroundScene::from_ron`]; as [`HeightMap::read`].
    #[cfg(feature = "height_maps")]
    pub fn read(path: &std::path::Path) -> Result<GroundScene, Error> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::Ron(format!("no ground: {}: {e}", path.display())))?;
        let mut scene = GroundScene::from_ron(&text)?;
        let folder = path.parent().unwrap_or(std::path::Path::new(""));
        let field = scene.field.as_mut().and_then(|f| f.map.as_mut());
        for map in scene.heights.iter_mut().chain(field) {
            map.read(folder)?;
        }
        Ok(scene)
    }

    /// Takes a height map in the place of field and shape, a cell a texel.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map without values.
    pub fn take_heights(&mut self, map: HeightMap) -> Result<(), Error> {
        let size = map.texels.as_ref().map(|t| t.size());
        // As every use of it says.
        let _ = map.heights(0, 0)?;
        if let Some([columns, rows]) = size {
            [self.columns, self.rows] = [columns as u32, rows as u32];
        }
        self.field = None;
        self.shape = Shape::Even;
        self.heights = Some(map);
        Ok(())
    }

    /// How it begins. Heights of the field, shape and smoothing are found on the device: submits and waits.
    ///
    /// # Errors
    /// As [`GroundScene::check`], [`heights`], a height map without values, and [`GroundState::from_channels`].
    pub fn begin(&self, gpu: &Gpu, programs: &ProgramSet) -> Result<GroundState, Error> {
        self.check()?;
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        let spacing = f64::from(self.options.spacing);
        let mut ground = vec![0.0_f32; columns * rows];
        if let Some(field) = &self.field {
            let places: Vec<WorldPos> = (0..rows * columns)
                .map(|k| {
                    let x = self.origin[0] + (k % columns) as f64 * spacing;
                    let z = self.origin[1] + (k / columns) as f64 * spacing;
                    WorldPos::from_metres(glam::DVec3::new(x, 0.0, z))
                })
                .collect();
            let found = heights(gpu, programs, field, &places, spacing as f32)?;
            for (to, from) in ground.iter_mut().zip(&found) {
                *to = from.height;
            }
        }
        if let Some(map) = &self.heights {
            let found = map.heights(self.columns as i32, self.rows as i32)?;
            for (to, from) in ground.iter_mut().zip(found) {
                *to = (f64::from(*to) + from) as f32;
            }
        }
        let form = Form {
            size: [columns, rows],
            shape: self.shape,
            relief: self.relief,
            altitude: self.altitude,
            smooth: self.smooth,
            wraps: self.options.boundary == Boundary::Periodic,
        };
        let heights = form.applied(gpu, programs, &ground)?;
        let mut state = GroundState::from_heights(columns, rows, &heights)?;
        let wet = (self.water_share * columns as f64).round() as usize;
        for (k, cell) in state.cells.chunks_exact_mut(CHANNELS).enumerate() {
            let mut water = self.depth;
            if let Some(level) = self.water_level
                && k % columns < wet
            {
                water = water.max(level - f64::from(cell[0]));
            }
            cell[1] = water as f32;
            cell[3] = water as f32;
        }
        Ok(state)
    }
}
