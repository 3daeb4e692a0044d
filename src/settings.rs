//! Values of keys: declaration, preset, scene and the caller's own, resolved and checked.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::error::Error;
use crate::program::{Key, KeyKind, ProgramSet, StructLayout, Value};

/// A quality preset.
///
/// The default is [`Preset::Thesis`], or [`Preset::ThesisLow`] with the Cargo feature `low_quality`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Preset {
    /// The frozen baseline: Leitner's landscape in normal quality.
    Thesis,
    /// The baseline with LOW_QUALITY: no clouds, lower counts.
    ThesisLow,
    /// The baseline with zero-density skipping and an early end.
    ThesisSkip,
    /// For devices that cannot afford more.
    Low,
    /// The picture of the baseline without its waste.
    Medium,
    /// Better than the baseline where it is visibly wrong.
    High,
    /// Converged, for comparisons.
    Reference,
    /// The preset that a user's own build made the default of its [`ProgramSet`].
    OfProgramSet,
    /// A preset by its file name without the ending.
    Named(Cow<'static, str>),
}

#[allow(clippy::derivable_impls)] // Which variant is the default depends on a Cargo feature.
impl Default for Preset {
    fn default() -> Self {
        if cfg!(feature = "low_quality") {
            Preset::ThesisLow
        } else {
            Preset::Thesis
        }
    }
}

impl Preset {
    /// The file name without its ending.
    pub fn name<'a>(&'a self, programs: &'a ProgramSet) -> &'a str {
        match self {
            Preset::Thesis => "thesis",
            Preset::ThesisLow => "thesis_low",
            Preset::ThesisSkip => "thesis_skip",
            Preset::Low => "low",
            Preset::Medium => "medium",
            Preset::High => "high",
            Preset::Reference => "reference",
            Preset::OfProgramSet => &programs.default_preset,
            Preset::Named(name) => name,
        }
    }
}

impl Key {
    /// Checks a value against the declared type and domain.
    ///
    /// # Errors
    /// [`Error::WrongType`] or [`Error::OutOfDomain`] with the value and what is allowed.
    pub fn check(&self, value: Value) -> Result<(), Error> {
        let wrong = || {
            Err(Error::WrongType {
                name: self.name.to_string(),
                value: value.to_string(),
                expected: self.ty.to_string(),
            })
        };
        let numbers: &[f64] = match (self.ty.as_ref(), &value) {
            ("flag", Value::Flag(_)) => return Ok(()),
            ("i32" | "u32" | "size", Value::Int(v)) => &[*v as f64],
            ("f32", Value::Float(v)) => std::slice::from_ref(v),
            ("f32", Value::Int(v)) => &[*v as f64],
            ("vec3", Value::Vec3(v)) => v,
            _ => return wrong(),
        };
        for &number in numbers {
            let inside = match self.domain {
                Some((low, high)) => number >= low && number <= high,
                None => number.is_finite(),
            };
            if !inside {
                return Err(Error::OutOfDomain {
                    name: self.name.to_string(),
                    value: value.to_string(),
                    domain: match self.domain {
                        Some((low, high)) => format!("in [{low}, {high}] {}", self.unit),
                        None => "finite".to_owned(),
                    },
                });
            }
        }
        Ok(())
    }

    /// Reads a value as the command line writes it: `true`, `1`, `0.5`, `0.1,0.2,0.3`.
    ///
    /// # Errors
    /// [`Error::WrongType`] or [`Error::OutOfDomain`] with the value and what is allowed.
    pub fn parse(&self, text: &str) -> Result<Value, Error> {
        let wrong = || Error::WrongType {
            name: self.name.to_string(),
            value: format!("`{text}`"),
            expected: self.ty.to_string(),
        };
        let number = |t: &str| t.trim().parse::<f64>().map_err(|_| wrong());
        let value = match self.ty.as_ref() {
            "flag" => match text.trim() {
                "true" | "1" => Value::Flag(true),
                "false" | "0" => Value::Flag(false),
                _ => return Err(wrong()),
            },
            "i32" | "u32" | "size" => Value::Int(text.trim().parse().map_err(|_| wrong())?),
            "f32" => Value::Float(number(text)?),
            _ => {
                let parts = text
                    .trim()
                    .trim_start_matches('(')
                    .trim_end_matches(')')
                    .split(',')
                    .map(number)
                    .collect::<Result<Vec<f64>, Error>>()?;
                Value::Vec3(parts.try_into().map_err(|_| wrong())?)
            }
        };
        self.check(value)?;
        Ok(value)
    }
}

/// A value for every declared key.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    values: BTreeMap<String, Value>,
}

impl Settings {
    /// Resolves declaration, preset, scene and the caller's own values, the later before the earlier.
    ///
    /// A scene's features are flags that it turns on. Every value is checked.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`], [`Error::UnknownScene`], [`Error::UnknownKey`], [`Error::WrongType`],
    /// [`Error::OutOfDomain`].
    pub fn resolve(
        programs: &ProgramSet,
        preset: &Preset,
        scene: Option<&str>,
        own: &[(String, Value)],
    ) -> Result<Settings, Error> {
        let mut settings = Settings {
            values: programs
                .keys
                .iter()
                .map(|k| (k.name.to_string(), k.default))
                .collect(),
        };
        for (name, value) in programs.preset(preset.name(programs))?.values.iter() {
            settings.set(programs, name, *value)?;
        }
        if let Some(scene) = scene {
            let scene = programs.scene(scene)?;
            for feature in scene.features.iter() {
                settings.set(programs, feature, Value::Flag(true))?;
            }
            for (name, value) in scene.content.iter() {
                settings.set(programs, name, *value)?;
            }
        }
        for (name, value) in own {
            settings.set(programs, name, *value)?;
        }
        Ok(settings)
    }

    /// Gives `name` a value.
    ///
    /// # Errors
    /// [`Error::UnknownKey`], [`Error::WrongType`], [`Error::OutOfDomain`]; the old value then stays.
    pub fn set(&mut self, programs: &ProgramSet, name: &str, value: Value) -> Result<(), Error> {
        programs.key(name)?.check(value)?;
        self.values.insert(name.to_owned(), value);
        Ok(())
    }

    /// The value of `name`, if it is declared.
    pub fn get(&self, name: &str) -> Option<Value> {
        self.values.get(name).copied()
    }

    /// The value of a number; 0 for a flag that is off, 1 for one that is on, `None` for a vector or an undeclared name.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.get(name)? {
            Value::Flag(v) => Some(f64::from(u8::from(v))),
            Value::Int(v) => Some(v as f64),
            Value::Float(v) => Some(v),
            Value::Vec3(_) => None,
        }
    }

    /// The flags that are on, in alphabetical order.
    pub fn features(&self) -> Vec<&str> {
        self.values
            .iter()
            .filter(|(_, v)| **v == Value::Flag(true))
            .map(|(n, _)| n.as_str())
            .collect()
    }

    /// Every value by its key, in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Value)> {
        self.values.iter().map(|(n, v)| (n.as_str(), *v))
    }

    /// The bytes of a uniform structure whose members are content keys in lower case.
    ///
    /// # Errors
    /// [`Error::UnknownKey`] for a member without a key, [`Error::WrongType`] for one of another type.
    pub fn uniform_bytes(
        &self,
        programs: &ProgramSet,
        layout: &StructLayout,
    ) -> Result<Vec<u8>, Error> {
        let mut bytes = vec![0; layout.size as usize];
        for member in layout.members.iter() {
            let name = member.name.to_uppercase();
            let key = programs.key(&name)?;
            let value = self.get(&name).unwrap_or(key.default);
            let wrong = || Error::WrongType {
                name: name.clone(),
                value: value.to_string(),
                expected: member.ty.to_string(),
            };
            if key.kind != KeyKind::Content {
                return Err(wrong());
            }
            let words: Vec<[u8; 4]> = match (member.ty.as_ref(), value) {
                ("f32", Value::Float(v)) => vec![(v as f32).to_le_bytes()],
                ("f32", Value::Int(v)) => vec![(v as f32).to_le_bytes()],
                ("i32", Value::Int(v)) => {
                    vec![i32::try_from(v).map_err(|_| wrong())?.to_le_bytes()]
                }
                ("u32", Value::Int(v)) => {
                    vec![u32::try_from(v).map_err(|_| wrong())?.to_le_bytes()]
                }
                ("vec3<f32>", Value::Vec3(v)) => {
                    v.iter().map(|x| (*x as f32).to_le_bytes()).collect()
                }
                _ => return Err(wrong()),
            };
            for (i, word) in words.iter().enumerate() {
                let at = member.offset as usize + 4 * i;
                bytes
                    .get_mut(at..at + 4)
                    .ok_or_else(wrong)?
                    .copy_from_slice(word);
            }
        }
        Ok(bytes)
    }
}
