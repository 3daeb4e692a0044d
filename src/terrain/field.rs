//! Height fields as plain data: which noise, how large, how rough.

use serde::{Deserialize, Serialize};

use super::calibrate;
use super::ground::Prepared;
use super::map::HeightMap;
use super::real::Real;
use crate::error::Error;
use crate::program::ProgramSet;

/// Where the field lies.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Domain {
    /// x and z on an endless integer lattice.
    #[default]
    Plane,
    /// Noise in 3D, on an integer lattice, of the direction from the planet's centre times its radius: a ball that is seen from orbit. [`Land::globe`] prepares it.
    ///
    /// [`Land::globe`]: super::Land::globe
    Sphere,
}

/// What the field is made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Kind {
    /// Sum of octaves (Leitner 2022, algorithm 1): the same roughness everywhere.
    Fbm,
    /// Hybrid multifractal (algorithm 2): low places stay smooth.
    Hybrid {
        /// Moves the noise towards positive values, in [0, 1]; 0.7 is usual.
        offset: f64,
    },
    /// Ridged multifractal (algorithm 3, squared in every octave): sharp crests. The thesis's mountains.
    Ridged {
        /// Weight of an octave by the one before it, in [0, 4]; 2 is usual.
        gain: f64,
        /// Rounding of the crests, in [0, 1]; 0 keeps them sharp.
        smoothness: f64,
    },
    /// Bowls with rims of all sizes on the octaves' lattices.
    Craters {
        /// Share of the cells that hold a crater, in [0, 1].
        share: f64,
        /// Height of the noise between craters, in [0, 1].
        roughness: f64,
    },
    /// Lowlands and jagged mountains from Perlin noise at three scales. The wavelength is that of the finest of them; the coarsest has eight times as
    /// much, and the heights are up to about 1.2 amplitudes for a power of 1.
    Mix {
        /// Power of the mountains, whole, in [1, 6].
        mountains: f64,
    },
    /// An fBm in strata: benches and cliffs, as in mesa and canyon land.
    Mesa {
        /// Thickness of a stratum in amplitudes, in [0.02, 2].
        strata: f64,
        /// How flat benches are and how steep cliffs, in [0, 1]; 0 is an fBm, 1 makes cliffs five times as steep as that.
        hardness: f64,
    },
    /// The program's own WGSL function, put in the place of `veduta::terrain::height::height`. It has no height on the processor.
    Own {
        /// Handed on as the terrain's gain.
        gain: f64,
        /// Handed on as the terrain's smoothness.
        smoothness: f64,
        /// What holds of the function everywhere, whatever the footprint; without it rays end at 20 km of height, and take no longer steps where they are clear of the ground.
        #[serde(default)]
        bounds: Option<OwnBounds>,
    },
    /// The field's height map, with an fBm as detail: the wavelength is the width of a texel, the amplitude is that of the detail; 0 leaves it out.
    Map,
}

/// What a program says of its own function.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnBounds {
    /// No value is below (m), in [-2e4, 2e4]; the field's base is added to it.
    pub minimum: f64,
    /// No value is above (m), in [-2e4, 2e4].
    pub maximum: f64,
    /// No slope is steeper, at least 0; infinite where that is not known.
    pub lipschitz: f64,
}

impl OwnBounds {
    fn check(&self) -> Result<(), Error> {
        let fault = |name: &str, value: f64, domain: &str| {
            Err(Error::OutOfDomain {
                name: format!("field.kind.bounds.{name}"),
                value: value.to_string(),
                domain: domain.to_owned(),
            })
        };
        if !(-2e4..=2e4).contains(&self.minimum) {
            return fault("minimum", self.minimum, "in [-2e4, 2e4] m");
        }
        if !(self.minimum..=2e4).contains(&self.maximum) {
            return fault("maximum", self.maximum, "from the minimum to 2e4 m");
        }
        if self.lipschitz.is_nan() || self.lipschitz < 0.0 {
            return fault("lipschitz", self.lipschitz, "at least 0");
        }
        Ok(())
    }
}

impl Kind {
    /// The number that the modules know it by (`FIELD_..` of `veduta::terrain::field`).
    pub fn number(self) -> i32 {
        match self {
            Kind::Fbm => 0,
            Kind::Hybrid { .. } => 1,
            Kind::Ridged { .. } => 2,
            Kind::Craters { .. } => 3,
            Kind::Mix { .. } => 4,
            Kind::Own { .. } => 5,
            Kind::Mesa { .. } => 6,
            Kind::Map => 7,
        }
    }

    /// Its two parameters.
    pub(super) fn parameters(self) -> [f64; 2] {
        match self {
            Kind::Fbm | Kind::Map => [0.0; 2],
            Kind::Hybrid { offset } => [offset, 0.0],
            Kind::Ridged { gain, smoothness }
            | Kind::Own {
                gain, smoothness, ..
            } => [gain, smoothness],
            Kind::Craters { share, roughness } => [share, roughness],
            Kind::Mix { mountains } => [mountains, 0.0],
            Kind::Mesa { strata, hardness } => [strata, hardness],
        }
    }
}

/// A height field.
///
/// ```
/// use veduta::terrain::HeightField;
/// use veduta::WorldPos;
/// let field = HeightField::default().prepare::<f64>()?;
/// // A hundred million metres from the origin, as one sample of a metre's width sees it.
/// let far = WorldPos { cell: [100_000_000, 0, 7].into(), ..Default::default() };
/// let ground = field.ground(far, 1.0);
/// assert!((0.0..2800.0).contains(&ground.height));
/// # Ok::<(), veduta::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightField {
    /// What it is made of.
    pub kind: Kind,
    /// Where it lies.
    #[serde(default)]
    pub domain: Domain,
    /// Wavelength of the first octave (m), in [16, 1e6]; it is rounded to `f32`. For `Map` the width of a texel, in [0.125, 1e6].
    pub wavelength: f64,
    /// Height of a value of 1 (m), in [0, 2e4].
    pub amplitude: f64,
    /// Height of a value of 0 (m), in [-2e4, 2e4].
    #[serde(default)]
    pub base: f64,
    /// Octaves, in [1, 16].
    pub octaves: u32,
    /// Hurst exponent, in [0, 2]: octave i has the amplitude 2^(-i hurst).
    pub hurst: f64,
    /// Seed of the lattice.
    #[serde(default)]
    pub seed: u32,
    /// The height map of the kind `Map`; `None` for all others.
    #[serde(default)]
    pub map: Option<HeightMap>,
}

impl Default for HeightField {
    /// The mountains of the preset `thesis`, with sharp crests.
    fn default() -> Self {
        HeightField {
            kind: Kind::Ridged {
                gain: 2.0,
                smoothness: 0.0,
            },
            domain: Domain::Plane,
            wavelength: 8192.0,
            amplitude: 1400.0,
            base: 0.0,
            octaves: 10,
            hurst: 1.0,
            seed: 1,
            map: None,
        }
    }
}

/// What holds everywhere on a field, whatever the footprint.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// No height is below (m).
    pub minimum: f64,
    /// No height is above (m).
    pub maximum: f64,
    /// No slope is steeper (rise over run), where there is a slope.
    pub lipschitz: f64,
    /// No octave adds a steeper slope; what a height map adds is not among them.
    pub octaves: Vec<f64>,
}

impl Bounds {
    /// No slope is steeper while so many octaves count, with one for what their means add.
    pub(super) fn ladder(&self, kind: Kind) -> [f64; 17] {
        let whole = self.lipschitz.min(1e30);
        let rest = (whole - self.octaves.iter().sum::<f64>()).max(0.0);
        // Which octave of the lattice each of them is.
        let level = |i: usize| match (kind, i) {
            (Kind::Mix { .. }, 0) => 0,
            (Kind::Mix { .. }, 1..=3) => i + 1,
            (Kind::Mix { .. }, _) => i - 1,
            _ => i,
        };
        std::array::from_fn(|count| {
            let counted = (0..)
                .zip(&self.octaves)
                .filter(|(i, _)| level(*i) < count || count == 16);
            1.01 * (rest + counted.map(|(_, s)| s).sum::<f64>())
        })
    }
}

/// No gradient noise in 2D has a steeper slope, per cell: the largest over all places and vectors is 2.9262.
const NOISE_SLOPE: f64 = 2.927;

/// The same in 3D, found by a search over places and directions, with the steepest of the 24 vectors at every corner: 3.5869.
const NOISE_SLOPE_3D: f64 = 3.588;

/// The interval of a product.
fn product([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    let all = [a * c, a * d, b * c, b * d];
    [
        all.iter().copied().fold(f64::INFINITY, f64::min),
        all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Bounds of the value and of the slope per cell of every octave, for an fBm of so many octaves from a frequency on.
fn fbm_bounds(octaves: u32, hurst: f64, frequency: f64, steep: f64) -> (f64, Vec<f64>) {
    let amplitude = |i: u32| (-hurst * f64::from(i)).exp2();
    (
        (0..octaves).map(amplitude).sum(),
        (0..octaves)
            .map(|i| steep * amplitude(i) * frequency * f64::from(i).exp2())
            .collect(),
    )
}

impl HeightField {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name: &str, value: f64, low: f64, high: f64, unit: &str| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfDomain {
                name: format!("field.{name}"),
                value: value.to_string(),
                domain: format!("in [{low}, {high}]{unit}"),
            })
        };
        let mapped = self.kind == Kind::Map;
        let least = if mapped { 0.125 } else { 16.0 };
        within("wavelength", self.wavelength, least, 1e6, " m")?;
        within("amplitude", self.amplitude, 0.0, 2e4, " m")?;
        within("base", self.base, -2e4, 2e4, " m")?;
        within("octaves", f64::from(self.octaves), 1.0, 16.0, "")?;
        within("hurst", self.hurst, 0.0, 2.0, "")?;
        if let (
            Domain::Sphere,
            Kind::Mix { .. } | Kind::Own { .. } | Kind::Mesa { .. } | Kind::Map,
        ) = (self.domain, self.kind)
        {
            return Err(Error::OutOfDomain {
                name: "field.kind".to_owned(),
                value: format!("{:?}", self.kind),
                domain: "Fbm, Hybrid, Ridged or Craters on a Sphere".to_owned(),
            });
        }
        if mapped != self.map.is_some() {
            return Err(Error::OutOfDomain {
                name: "field.map".to_owned(),
                value: if mapped { "None" } else { "Some" }.to_owned(),
                domain: "a height map for the kind Map, and None for all others".to_owned(),
            });
        }
        match self.kind {
            Kind::Fbm => Ok(()),
            Kind::Map => self.map.as_ref().map_or(Ok(()), HeightMap::check),
            Kind::Hybrid { offset } => within("kind.offset", offset, 0.0, 1.0, ""),
            Kind::Ridged { gain, smoothness } => {
                within("kind.gain", gain, 0.0, 4.0, "")?;
                within("kind.smoothness", smoothness, 0.0, 1.0, "")
            }
            Kind::Own {
                gain,
                smoothness,
                bounds,
            } => {
                within("kind.gain", gain, 0.0, 4.0, "")?;
                within("kind.smoothness", smoothness, 0.0, 1.0, "")?;
                bounds.map_or(Ok(()), |b| b.check())
            }
            Kind::Craters { share, roughness } => {
                within("kind.share", share, 0.0, 1.0, "")?;
                within("kind.roughness", roughness, 0.0, 1.0, "")
            }
            Kind::Mesa { strata, hardness } => {
                within("kind.strata", strata, 0.02, 2.0, "")?;
                within("kind.hardness", hardness, 0.0, 1.0, "")
            }
            Kind::Mix { mountains } => {
                within("kind.mountains", mountains, 1.0, 6.0, "")?;
                if mountains.fract() == 0.0 {
                    return Ok(());
                }
                Err(Error::OutOfDomain {
                    name: "field.kind.mountains".to_owned(),
                    value: mountains.to_string(),
                    domain: "whole".to_owned(),
                })
            }
        }
    }

    /// Wavelength of the lattice (m): that of the coarsest noise, rounded as the device has it.
    pub fn lattice_wavelength(&self) -> f64 {
        let rounded = f64::from(self.wavelength as f32);
        match self.kind {
            Kind::Mix { .. } => 8.0 * rounded,
            _ => rounded,
        }
    }

    /// The field with all that follows from its numbers, in `f32` as the device computes it, or in `f64`.
    ///
    /// # Errors
    /// As [`HeightField::check`]; [`Error::OutOfDomain`] on a `Sphere`, which `Land::globe` prepares, since it needs the planet's radius, and for a height map that has not been read.
    pub fn prepare<T: Real>(&self) -> Result<Prepared<T>, Error> {
        self.check()?;
        if self.domain != Domain::Plane {
            return Err(Error::OutOfDomain {
                name: "field.domain".to_owned(),
                value: format!("{:?}", self.domain),
                domain: "Plane; Land::globe takes a Sphere".to_owned(),
            });
        }
        let map = match &self.map {
            Some(map) => Some(map.pyramid(self.lattice_wavelength())?),
            None => None,
        };
        let bounds = self.bounds().ok();
        Ok(Prepared::new(self, &calibrate::tails(self), map, bounds))
    }

    /// What holds everywhere on it, by interval arithmetic from octave to octave.
    ///
    /// # Errors
    /// As [`HeightField::check`]; [`Error::OutOfDomain`] for a program's own function of which nothing is said, and for a height map that has not been read.
    pub fn bounds(&self) -> Result<Bounds, Error> {
        self.check()?;
        let fall = |i: u32| (-self.hurst * f64::from(i)).exp2();
        let frequency = |i: u32| f64::from(i).exp2();
        let (mut values, mut slopes) = ([0.0_f64; 2], Vec::new());
        // The steepest noise, and how many bowls and rims of a lattice can meet in a point, and the largest radius.
        let (steep_noise, bowls, rims, largest) = match self.domain {
            Domain::Plane => (NOISE_SLOPE, 4.0, 9.0, 0.4),
            Domain::Sphere => (NOISE_SLOPE_3D, 8.0, 8.0, 0.35),
        };
        match self.kind {
            Kind::Fbm | Kind::Map => {
                let (sum, each) = fbm_bounds(self.octaves, self.hurst, 1.0, steep_noise);
                (values, slopes) = ([-sum, sum], each);
            }
            Kind::Mesa { strata, hardness } => {
                let (sum, each) = fbm_bounds(self.octaves, self.hurst, 1.0, steep_noise);
                // The waves of the strata at their greatest, and with all slopes joined.
                let most = sum + hardness * strata * std::f64::consts::FRAC_1_PI * 1.284;
                values = [-most, most];
                slopes = each.iter().map(|s| s * (1.0 + 4.0 * hardness)).collect();
            }
            Kind::Craters { roughness, .. } => {
                for i in 0..self.octaves {
                    values[0] -= fall(i) * (bowls * 0.4 * largest + roughness);
                    values[1] += fall(i) * (rims * largest * 0.08 + roughness);
                    let slope = bowls * 0.93 + (rims - bowls) * 0.13 + roughness * steep_noise;
                    slopes.push(fall(i) * frequency(i) * slope);
                }
            }
            Kind::Hybrid { offset } => {
                let (mut weight, mut steep) = ([1.0_f64; 2], 0.0);
                for i in 0..self.octaves {
                    let a = fall(i);
                    let signal = [a * (offset - 1.0), a * (offset + 1.0)];
                    let most = weight[0].abs().max(weight[1].abs());
                    steep = most * a * frequency(i) * steep_noise + signal[1] * steep;
                    weight = product(weight, signal);
                    values = [values[0] + weight[0], values[1] + weight[1]];
                    slopes.push(steep);
                    weight = weight.map(|w| w.min(1.0));
                }
            }
            Kind::Ridged { gain, smoothness } => {
                let top = (1.0 - smoothness.sqrt()).powi(2);
                let deep = (1.0 - (1.0 + smoothness).sqrt()).powi(2);
                let most = top.max(deep);
                let mut steep = 0.0;
                for i in 0..self.octaves {
                    // |d ridge^2| is at most 2 |ridge| |dn|.
                    steep = 2.0 * most.sqrt() * frequency(i) * steep_noise + most * gain * steep;
                    slopes.push(fall(i) * steep);
                    values[1] += fall(i) * most;
                }
            }
            Kind::Mix { mountains } => {
                let (fine, fine_slopes) = fbm_bounds(self.octaves, self.hurst, 8.0, steep_noise);
                let (middle, middle_slopes) = fbm_bounds(3, self.hurst, 4.0, steep_noise);
                let lift = (1.0 + middle).powf(mountains);
                let sum = 0.1 * fine * lift + 0.2 * middle + 1.0;
                values = [-sum, sum];
                let bend = 0.1 * fine * mountains * (1.0 + middle).powf(mountains - 1.0) + 0.2;
                slopes.push(steep_noise);
                slopes.extend(middle_slopes.iter().map(|s| s * bend));
                slopes.extend(fine_slopes.iter().map(|s| s * 0.1 * lift));
            }
            Kind::Own {
                bounds: Some(own), ..
            } => {
                return Ok(Bounds {
                    minimum: self.base + own.minimum,
                    maximum: self.base + own.maximum,
                    lipschitz: own.lipschitz,
                    octaves: Vec::new(),
                });
            }
            Kind::Own { bounds: None, .. } => {
                return Err(Error::OutOfDomain {
                    name: "field.kind.bounds".to_owned(),
                    value: "None".to_owned(),
                    domain: "what holds of the program's own function".to_owned(),
                });
            }
        }
        let steepness = self.amplitude / self.lattice_wavelength();
        let octaves: Vec<f64> = slopes.iter().map(|s| s * steepness).collect();
        let [low, high, steep] = match &self.map {
            Some(map) => {
                let pyramid = map.pyramid(self.lattice_wavelength())?;
                [pyramid.minimum, pyramid.maximum, pyramid.lipschitz]
            }
            None => [0.0; 3],
        };
        Ok(Bounds {
            minimum: self.base + low + self.amplitude * values[0],
            maximum: self.base + high + self.amplitude * values[1],
            lipschitz: steep + octaves.iter().sum::<f64>(),
            octaves,
        })
    }

    /// What an octave adds to the height at most, per amplitude.
    pub(super) fn tallest(&self) -> f64 {
        match self.kind {
            Kind::Hybrid { offset } => 1.0 + offset,
            Kind::Ridged { smoothness, .. } => {
                let deep = (1.0 - (1.0 + smoothness).sqrt()).powi(2);
                (1.0 - smoothness.sqrt()).powi(2).max(deep)
            }
            Kind::Craters { roughness, .. } => match self.domain {
                Domain::Plane => 9.0 * 0.4 * 0.08 + roughness,
                Domain::Sphere => 8.0 * 0.35 * 0.08 + roughness,
            },
            _ => 1.0,
        }
    }

    /// Reads a field from RON, for instance `(kind: Ridged(gain: 2, smoothness: 0), wavelength: 8192, amplitude: 1400, octaves: 10, hurst: 1)`.
    ///
    /// # Errors
    /// [`Error::Ron`] with line and column; as [`HeightField::check`].
    pub fn from_ron(text: &str) -> Result<HeightField, Error> {
        let field: HeightField =
            ron::from_str(text).map_err(|fault| Error::Ron(format!("no height field: {fault}")))?;
        field.check()?;
        Ok(field)
    }

    /// Writes the field so that [`HeightField::from_ron`] gives an equal one.
    ///
    /// # Errors
    /// As [`HeightField::check`].
    pub fn to_ron(&self) -> Result<String, Error> {
        self.check()?;
        ron::to_string(self)
            .map_err(|fault| Error::Ron(format!("the field cannot be written: {fault}")))
    }
}

/// The override that says which field a program has.
///
/// # Errors
/// The faults of [`ProgramSet::get`]; [`Error::OutOfDomain`] for a program's own function where none is plugged in.
pub(super) fn field_kind(
    programs: &ProgramSet,
    (program, features): (&str, &[&str]),
    field: &HeightField,
) -> Result<(&'static str, f64), Error> {
    let own = matches!(field.kind, Kind::Own { .. });
    if own && programs.get(program, features)?.plug_ins.is_empty() {
        return Err(Error::OutOfDomain {
            name: "field.kind".to_owned(),
            value: "Own".to_owned(),
            domain: format!(
                "a kind that the program `{program}` has: no module with an `override fn height` is plugged into it (`veduta_compose::Build::plug_in`, `Source::plug_in`)"
            ),
        });
    }
    Ok(("FIELD_KIND", f64::from(field.kind.number())))
}
