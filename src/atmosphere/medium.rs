//! What the air is made of.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use super::check::{each_within, fault, within};
use super::file::AtmosphereFile;
use crate::error::Error;

/// The most lanes that the device takes: lobes of all layers together.
pub const MOST_LANES: usize = 8;

/// Words of 32 bits in the block `Air` of `wgsl/atmosphere/medium.wgsl`.
pub const AIR_WORDS: usize = 148;

/// The air of a planet, the ground below it and the sun above. SI units.
///
/// `Atmosphere::default()` is the Earth, [`Atmosphere::named`] has more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "AtmosphereFile", into = "AtmosphereFile")]
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
        /// Where it begins, in [-1e7, 1e7] m.
        bottom: f64,
        /// Where it is densest, at least 1 m above the bottom (m).
        peak: f64,
        /// Where it ends, at least 1 m above the peak, in [-1e7, 1e7] m.
        top: f64,
    },
    /// 1 between two altitudes, 0 elsewhere. On the device the density falls to 0 over half a metre outside of them: a
    /// step has no place there, because altitudes come in steps of 8 mm at 100 km.
    Constant {
        /// Where it begins, in [-1e7, 1e7] m.
        bottom: f64,
        /// Where it ends, at least 1 m above the bottom, in [-1e7, 1e7] m.
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

/// One lobe of a phase function: (level + square nu^2) (1 + g^2 - 2 g nu)^(-3/2), normalised to 1 over the sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// Share of the phase function, which the numbers below leave out.
    pub weight: f64,
    /// Asymmetry.
    pub g: f64,
    /// Square over level: Draine's alpha.
    pub alpha: f64,
    /// Level (1/sr).
    pub level: f64,
    /// Coefficient of nu^2 (1/sr).
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
            alpha,
            level: share * (1.0 - g * g) / (4.0 * PI),
            square: share * alpha * (1.0 - g * g) / (4.0 * PI),
            first: share * (g + alpha * (2.0 * g.powi(3) + 3.0 * g) / 5.0),
            second: share * (g * g + alpha * (3.0 * fourth - square) / 2.0),
        }
    }

    /// Its value for a cosine of the scattering angle, weight left out (1/sr).
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
    /// The lobes that it is the sum of; one without weight is left out.
    pub fn lobes(&self) -> Vec<Lobe> {
        let mut lobes = match *self {
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
        };
        lobes.retain(|lobe| lobe.weight > 0.0);
        lobes
    }

    /// Its value for a cosine of the scattering angle, 1 forward (1/sr).
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

/// A layer, or one lobe of its phase function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lane {
    /// Density with altitude; lobes of one layer have the same.
    pub profile: Profile,
    /// Extinction at density 1 (1/m). The first lane of a layer has that of the whole layer, the others have none.
    pub extinction: [f64; 3],
    /// Scattering into this lobe at density 1 (1/m).
    pub scattering: [f64; 3],
    /// The lobe, with the weight 1; `None` for a layer that does not scatter.
    pub lobe: Option<Lobe>,
}

impl Lane {
    /// Whether the lobe is so peaked that tables keep its light apart: |g| > 0.3.
    pub fn peaked(&self) -> bool {
        self.lobe.is_some_and(|lobe| lobe.g.abs() > 0.3)
    }
}

impl Default for Atmosphere {
    /// The Earth: `earth` of [`Atmosphere::named`].
    fn default() -> Self {
        let layer = |name: &str, profile, scattering, absorption, phase| Layer {
            name: name.to_owned(),
            profile,
            scattering,
            absorption,
            phase,
        };
        let exponential = |scale_height| Profile::Exponential { scale_height };
        Atmosphere {
            planet_radius: 6_360_000.0,
            thickness: 100_000.0,
            ground_albedo: [0.3; 3],
            sun: Sun::default(),
            layers: vec![
                layer(
                    "molecules",
                    exponential(8000.0),
                    [5.802e-6, 13.558e-6, 33.1e-6],
                    [0.0; 3],
                    Phase::Rayleigh,
                ),
                layer(
                    "haze",
                    exponential(1200.0),
                    [3.996e-6; 3],
                    [0.444e-6; 3],
                    Phase::CornetteShanks { g: 0.8 },
                ),
                layer(
                    "ozone",
                    Profile::Tent {
                        bottom: 10_000.0,
                        peak: 25_000.0,
                        top: 40_000.0,
                    },
                    [0.0; 3],
                    [0.650e-6, 1.881e-6, 0.085e-6],
                    Phase::Isotropic,
                ),
            ],
        }
    }
}

impl Default for Sun {
    /// White, as large as from the Earth.
    fn default() -> Self {
        Sun {
            angular_radius: 0.004652,
            colour: [1.0; 3],
        }
    }
}

impl Profile {
    /// Altitudes (m) between which the density is smooth.
    pub fn bends(&self) -> Vec<f64> {
        match *self {
            Profile::Exponential { .. } => vec![],
            Profile::Tent { bottom, peak, top } => vec![bottom, peak, top],
            Profile::Constant { bottom, top } => vec![bottom, top],
        }
    }

    /// The greatest density at and above an altitude.
    pub fn greatest_above(&self, h: f64) -> f64 {
        match *self {
            Profile::Exponential { .. } => self.density(h),
            Profile::Tent { peak, .. } => self.density(h.max(peak)),
            Profile::Constant { top, .. } => f64::from(u8::from(h.max(0.0) <= top)),
        }
    }

    fn check(&self, name: &str) -> Result<(), Error> {
        let level = (-1e7, 1e7, "m");
        let field = |f: &str| format!("{name}.profile.{f}");
        let above = |upper: (&str, f64), lower: (&str, f64)| {
            if upper.1 - lower.1 >= 1.0 {
                return Ok(());
            }
            let domain = format!("at least 1 m above `{}`, {:?} m", lower.0, lower.1);
            Err(fault(&field(upper.0), upper.1, domain))
        };
        match *self {
            Profile::Exponential { scale_height } => {
                within(&field("scale_height"), scale_height, (1.0, 1e6, "m"))
            }
            Profile::Tent { bottom, peak, top } => {
                for (f, value) in [("bottom", bottom), ("peak", peak), ("top", top)] {
                    within(&field(f), value, level)?;
                }
                above(("peak", peak), ("bottom", bottom))?;
                above(("top", top), ("peak", peak))
            }
            Profile::Constant { bottom, top } => {
                for (f, value) in [("bottom", bottom), ("top", top)] {
                    within(&field(f), value, level)?;
                }
                above(("top", top), ("bottom", bottom))
            }
        }
    }

    /// Whether the density is made of ramps rather than of an exponential.
    fn is_ramps(&self) -> bool {
        !matches!(self, Profile::Exponential { .. })
    }

    /// Fall, rise, its offset, sink and its offset, as `FourLayers` has them.
    fn ramps(&self) -> [f64; 5] {
        match *self {
            Profile::Exponential { scale_height } => [-1.0 / scale_height, 0.0, 1.0, 0.0, 1.0],
            Profile::Tent { bottom, peak, top } => {
                let (rise, sink) = ((peak - bottom).recip(), (top - peak).recip());
                [0.0, rise, -bottom * rise, -sink, top * sink]
            }
            // Slopes of two in a metre are exact; the offsets round by less than a metre's worth.
            Profile::Constant { bottom, top } => {
                [0.0, 2.0, 1.0 - 2.0 * bottom, -2.0, 1.0 + 2.0 * top]
            }
        }
    }
}

impl Phase {
    fn check(&self, name: &str) -> Result<(), Error> {
        let field = |f: &str| format!("{name}.phase.{f}");
        let asymmetry = (-0.99, 0.99, "1");
        match *self {
            Phase::Isotropic | Phase::Rayleigh => Ok(()),
            Phase::HenyeyGreenstein { g } | Phase::CornetteShanks { g } => {
                within(&field("g"), g, asymmetry)
            }
            Phase::CornetteShanksMean { u } => within(&field("u"), u, (-0.98, 0.98, "1")),
            Phase::Draine { g, alpha } => {
                within(&field("g"), g, asymmetry)?;
                within(&field("alpha"), alpha, (0.0, 100.0, "1"))
            }
            Phase::TwoLobes {
                forward,
                backward,
                backward_share,
            } => {
                within(&field("forward"), forward, asymmetry)?;
                within(&field("backward"), backward, asymmetry)?;
                within(&field("backward_share"), backward_share, (0.0, 1.0, "1"))
            }
        }
    }
}

impl Layer {
    fn check(&self, index: usize) -> Result<(), Error> {
        let name = format!("layers[{index}] ({})", self.name);
        self.profile.check(&name)?;
        each_within(
            &format!("{name}.scattering"),
            self.scattering,
            (0.0, 1.0, "1/m"),
        )?;
        each_within(
            &format!("{name}.absorption"),
            self.absorption,
            (0.0, 1.0, "1/m"),
        )?;
        self.phase.check(&name)
    }

    fn lanes(&self) -> Vec<Lane> {
        let lane = Lane {
            profile: self.profile,
            extinction: std::array::from_fn(|c| self.scattering[c] + self.absorption[c]),
            scattering: [0.0; 3],
            lobe: None,
        };
        if self.scattering == [0.0; 3] {
            return vec![lane];
        }
        let lobes = self.phase.lobes().into_iter().enumerate();
        lobes
            .map(|(i, lobe)| Lane {
                extinction: if i == 0 { lane.extinction } else { [0.0; 3] },
                scattering: self.scattering.map(|s| lobe.weight * s),
                lobe: Some(Lobe {
                    weight: 1.0,
                    ..lobe
                }),
                ..lane
            })
            .collect()
    }
}

/// The least angular radius (rad) over which light of higher orders fades in at the edge of the planet's shadow: smaller suns would fall between its table's columns.
const SMALLEST_FADE: f64 = 0.002;

impl Atmosphere {
    /// Checks every field against its domain.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for the first one outside.
    pub fn check(&self) -> Result<(), Error> {
        within("planet_radius", self.planet_radius, (1e3, 1e9, "m"))?;
        let most = self.planet_radius.min(1e7);
        within("thickness", self.thickness, (1.0, most, "m"))?;
        each_within("ground_albedo", self.ground_albedo, (0.0, 1.0, "1"))?;
        within(
            "sun.angular_radius",
            self.sun.angular_radius,
            (0.0, 0.5, "rad"),
        )?;
        each_within("sun.colour", self.sun.colour, (0.0, 1000.0, "1"))?;
        for (index, layer) in self.layers.iter().enumerate() {
            layer.check(index)?;
        }
        let lanes = self.lanes().len();
        if lanes > MOST_LANES {
            return Err(Error::OutOfDomain {
                name: "layers".to_owned(),
                value: format!("{} with {lanes} lobes", self.layers.len()),
                domain: format!("layers with at most {MOST_LANES} lobes in all"),
            });
        }
        Ok(())
    }

    /// Altitude of the top of the air plus the radius of the ground (m).
    pub fn top_radius(&self) -> f64 {
        self.planet_radius + self.thickness
    }

    /// The lanes: every lobe of every layer, and every layer that only absorbs; those that are not exponential first, else
    /// in order.
    pub fn lanes(&self) -> Vec<Lane> {
        let mut lanes: Vec<Lane> = self.layers.iter().flat_map(Layer::lanes).collect();
        lanes.sort_by_key(|lane| !lane.profile.is_ramps());
        lanes
    }

    /// The lobe that tables leave out of the light of peaked lanes: of those the one with the largest g.
    pub fn peak(&self) -> Option<Lobe> {
        let lanes = self.lanes().into_iter();
        lanes
            .filter(Lane::peaked)
            .filter_map(|lane| lane.lobe)
            .max_by(|a, b| a.g.total_cmp(&b.g))
    }

    /// The block `Air` of `wgsl/atmosphere/medium.wgsl`, word by word, for a uniform or a storage buffer.
    ///
    /// # Errors
    /// As [`Atmosphere::check`].
    pub fn air_words(&self) -> Result<[u32; AIR_WORDS], Error> {
        /// Where the lanes begin, and how many words four of them take.
        const LANES: usize = 12;
        const FOUR: usize = 68;
        self.check()?;
        let mut words = [0; AIR_WORDS];
        let bits = |value: f64| (value as f32).to_bits();
        let lanes = self.lanes();
        words[0] = bits(self.planet_radius);
        words[1] = bits(self.thickness);
        words[2] = lanes.len() as u32;
        if let Some(peak) = self.peak() {
            words[3..6].copy_from_slice(&[peak.g, peak.level, peak.square].map(bits));
        }
        words[6] = bits(self.sun.angular_radius.max(SMALLEST_FADE));
        words[8..11].copy_from_slice(&self.ground_albedo.map(bits));
        for (i, lane) in lanes.iter().enumerate() {
            let lobe = lane.lobe.map_or([0.0; 5], |lobe| {
                [lobe.g, lobe.level, lobe.square, lobe.first, lobe.second]
            });
            let numbers = lane
                .profile
                .ramps()
                .into_iter()
                .chain(lane.extinction)
                .chain(lane.scattering)
                .chain(lobe)
                .chain([f64::from(u8::from(lane.peaked()))]);
            for (member, number) in numbers.enumerate() {
                words[LANES + FOUR * (i / 4) + 4 * member + i % 4] = bits(number);
            }
        }
        Ok(words)
    }

    /// The flags that the programs of the atmosphere need for this air: `AIR_EIGHT_LANES` for more than four lanes, for more than one
    /// that is not exponential, and for one that is not and scatters.
    pub fn features(&self) -> &'static [&'static str] {
        let lanes = self.lanes();
        let ramps = lanes.iter().filter(|lane| lane.profile.is_ramps()).count();
        let scatters =
            |lane: &Lane| lane.profile.is_ramps() && lane.scattering.iter().any(|s| *s > 0.0);
        if lanes.len() > 4 || ramps > 1 || lanes.iter().any(scatters) {
            &["AIR_EIGHT_LANES"]
        } else {
            &[]
        }
    }

    /// Whether this air runs with programs that were composed for air with `features`.
    pub(crate) fn check_features(&self, name: &str, features: &[&str]) -> Result<(), Error> {
        if self.features() == features {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: name.to_owned(),
            value: format!("air with the features {:?}", self.features()),
            domain: format!(
                "air with the features {features:?}, as before; other air needs an object of its own"
            ),
        })
    }

    /// What the table of columns depends on: radius, thickness and profiles, as bytes to compare.
    pub(crate) fn profile_bytes(&self) -> Vec<u8> {
        let profiles = self
            .lanes()
            .into_iter()
            .flat_map(|lane| lane.profile.ramps());
        [self.planet_radius, self.thickness]
            .into_iter()
            .chain(profiles)
            .flat_map(f64::to_le_bytes)
            .collect()
    }

    /// The same as bytes.
    ///
    /// # Errors
    /// As [`Atmosphere::check`].
    pub fn air_bytes(&self) -> Result<Vec<u8>, Error> {
        let words = self.air_words()?;
        Ok(words.iter().flat_map(|word| word.to_le_bytes()).collect())
    }
}
