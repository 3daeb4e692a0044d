//! What a layer of clouds is.

use serde::{Deserialize, Serialize};

use super::{WeatherMap, fault};
use crate::error::Error;

/// What forms the clouds of a layer: weather over the land, a profile over the height that goes from stratus to cumulonimbus, heaps of billows, and finer ones that fray
/// them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloudShape {
    /// Kind of the clouds, in [0, 1]: 0 stratus, 1/2 cumulus, 1 cumulonimbus, which fills the layer; the others lie in its lower part.
    pub kind: f64,
    /// What the weather adds to the kind at most, about; in [0, 1].
    pub kind_spread: f64,
    /// What the weather adds to the coverage at most, about; in [0, 2].
    pub coverage_spread: f64,
    /// The weather has 2 to this power cells over the period, in [1, 12].
    pub weather_doublings: u32,
    /// How far finer billows fray the edges, in [0, 1].
    pub detail: f64,
    /// Density over what the noise exceeds its threshold by, in [1, 32]: soft to hard edges.
    pub sharpness: f64,
    /// A map that tells the weather, in the place of noise: then `kind_spread` and `coverage_spread` must be 0.
    pub map: Option<WeatherMap>,
}

impl Default for CloudShape {
    /// Cumulus.
    fn default() -> Self {
        CloudShape {
            kind: 0.5,
            kind_spread: 0.2,
            coverage_spread: 0.4,
            weather_doublings: 2,
            detail: 0.5,
            sharpness: 5.0,
            map: None,
        }
    }
}

/// A layer of clouds between two spheres around a planet: six octaves of value noise cut by the coverage, or clouds with forms.
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
    /// Forms of the clouds; none for value noise.
    pub shape: Option<CloudShape>,
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
            shape: None,
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

shipped!("thesis", "cumulus", "stratus", "fair", "deck", "towers");

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
        if let Some(shape) = &self.shape {
            let doublings = f64::from(shape.weather_doublings);
            for (name, value, low, high) in [
                ("kind", shape.kind, 0.0, 1.0),
                ("kind_spread", shape.kind_spread, 0.0, 1.0),
                ("coverage_spread", shape.coverage_spread, 0.0, 2.0),
                ("weather_doublings", doublings, 1.0, 12.0),
                ("detail", shape.detail, 0.0, 1.0),
                ("sharpness", shape.sharpness, 1.0, 32.0),
            ] {
                if !(low..=high).contains(&value) {
                    return Err(fault(
                        &format!("deck.shape.{name}"),
                        value,
                        &format!("in [{low}, {high}]"),
                    ));
                }
            }
        }
        if let Some((shape, map)) = self.mapped() {
            for (name, value) in [
                ("kind_spread", shape.kind_spread),
                ("coverage_spread", shape.coverage_spread),
            ] {
                if value != 0.0 {
                    return Err(fault(
                        &format!("deck.shape.{name}"),
                        value,
                        "0 where a map tells the weather",
                    ));
                }
            }
            map.check(self.period())?;
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

    /// Whether its period is so long, more than 16 wavelengths, that [`super::Clouds`] bakes windows about the eye instead of a tile of the whole.
    pub fn is_windowed(&self) -> bool {
        self.period_doublings > 4
    }

    /// Sine of the lowest height of the sun whose rays the columns of a tile of so many levels follow, at least that of 7 degrees: rays that between
    /// two levels go at most an eighteenth of a wavelength across. For a lower sun columns stand upright; one below
    /// [`super::LOWEST_SUN`] is taken to be that high.
    pub fn lowest_sun(&self, levels: u32) -> f32 {
        self.lowest_across(levels, 18.0)
    }

    /// The same for the columns of windows, whose rays go at most a twelfth of a wavelength across; a lower sun is taken to be that high.
    pub(super) fn lowest_window_sun(&self, levels: u32) -> f32 {
        self.lowest_across(levels, 12.0)
    }

    fn lowest_across(&self, levels: u32, share: f64) -> f32 {
        let level = self.thickness / f64::from(levels.max(2) - 1);
        let tangent = share * level / self.wavelength;
        let sine = tangent / (1.0 + tangent * tangent).sqrt();
        (sine as f32).clamp(0.121_869, 0.99)
    }

    /// Forms whose weather a map tells.
    pub(crate) fn mapped(&self) -> Option<(&CloudShape, &WeatherMap)> {
        let shape = self.shape.as_ref()?;
        Some((shape, shape.map.as_ref()?))
    }

    /// Flags of the programs that have its noise.
    pub(super) fn flags(&self) -> &'static [&'static str] {
        if self.mapped().is_some() {
            &["CLOUD_SHAPED", "CLOUD_MAPPED"]
        } else if self.shape.is_some() {
            &["CLOUD_SHAPED"]
        } else {
            &[]
        }
    }

    /// Way without clouds for each unit that the density before its cut is below 0 (m): the noise seldom rises by more than its whole range over three
    /// quarters of a wavelength of the first octave (measured in V01: within 0.3 dB of half as far). Clouds with forms rise by their steepest slopes, which those of a kind's profile at its base are not; and by those of a
    /// map for the weather.
    pub(super) fn clear_way(&self) -> f64 {
        let map = self.mapped();
        self.clear_way_under(map.map_or([0.0; 2], |(_, m)| m.slopes(self.period())))
    }

    /// The same for a map whose coverage and kind rise at most by so much (1/m).
    pub(super) fn clear_way_under(&self, [cover, kind]: [f64; 2]) -> f64 {
        if let Some(shape) = &self.shape {
            let filled = 1.0 - self.uniformity;
            let along = (2.4 * filled + 5.0 * shape.detail) / self.wavelength;
            let along = along + self.coverage * (cover + 2.0 * shape.kind * kind);
            let slope = along + 8.0 / self.thickness.max(1.0);
            return 1.0 / (shape.sharpness * slope);
        }
        0.75 * self.coverage * self.wavelength / (1.0 - self.uniformity).max(0.01)
    }

    /// The least density before its cut that a tile tells: it has 8 bits from there to 1. Steps in the clear are at most as long as it says.
    pub(super) fn least_density(&self) -> f32 {
        if self.shape.is_some() {
            return -3.0;
        }
        let least = (1.0 - self.coverage) / self.coverage.max(1e-3);
        -least.clamp(0.5, 3.0) as f32
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

    /// Reads a layer's file, and that of its weather map, which is looked for beside it.
    ///
    /// # Errors
    /// [`Error::Ron`] for a file that cannot be read, and as [`CloudDeck::from_ron`]; as [`WeatherMap::read`].
    pub fn read(path: &std::path::Path) -> Result<CloudDeck, Error> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::Ron(format!("no clouds: {}: {e}", path.display())))?;
        let mut deck = CloudDeck::from_ron(&text)?;
        if let Some(map) = deck.shape.as_mut().and_then(|s| s.map.as_mut()) {
            map.read(path.parent().unwrap_or(std::path::Path::new("")))?;
        }
        Ok(deck)
    }
}

/// In which order layers over one picture are to be laid, the first first, for an eye at an altitude (m): those above the eye from the highest down, then those below from the
/// lowest up, last the one that the eye is in. So each lies before what is farther along every ray that meets it once.
///
/// # Errors
/// [`Error::OutOfDomain`] for layers that overlap.
pub fn back_to_front(altitude: f64, decks: &[&CloudDeck]) -> Result<Vec<usize>, Error> {
    let mut order: Vec<usize> = (0..decks.len()).collect();
    order.sort_by(|a, b| decks[*a].bottom.total_cmp(&decks[*b].bottom));
    let top = |k: usize| decks[k].bottom + decks[k].thickness;
    if let Some(pair) = order.windows(2).find(|p| top(p[0]) > decks[p[1]].bottom) {
        return Err(fault(
            &format!("decks[{}].bottom", pair[1]),
            decks[pair[1]].bottom,
            &format!("at least {} m, the top of the layer below it", top(pair[0])),
        ));
    }
    let (above, rest): (Vec<usize>, Vec<usize>) =
        order.into_iter().partition(|k| decks[*k].bottom > altitude);
    let (inside, below): (Vec<usize>, Vec<usize>) =
        rest.into_iter().partition(|k| top(*k) > altitude);
    Ok(above.into_iter().rev().chain(below).chain(inside).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_laid_from_back_to_front() {
        let [low, middle, high] = [1000.0, 4000.0, 9000.0].map(|bottom| CloudDeck {
            bottom,
            thickness: 1000.0,
            ..CloudDeck::default()
        });
        let order = |altitude: f64| back_to_front(altitude, &[&middle, &high, &low]).unwrap();
        assert_eq!(order(0.0), [1, 0, 2]);
        assert_eq!(order(3000.0), [1, 0, 2]);
        assert_eq!(order(6000.0), [1, 2, 0]);
        assert_eq!(order(20_000.0), [2, 0, 1]);
        assert_eq!(order(4500.0), [1, 2, 0]);
        assert_eq!(order(1500.0), [1, 0, 2]);
        let error = back_to_front(0.0, &[&low, &low]).unwrap_err().to_string();
        assert!(error.contains("decks[1].bottom"), "{error}");
    }

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
            ("(shape: Some((kind: 2)))", "deck.shape.kind"),
            ("(cover: 1)", "no clouds"),
        ] {
            let error = CloudDeck::from_ron(text).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
