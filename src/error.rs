//! What can go wrong, in one sentence each.

use std::fmt;

/// A feature set that was built, nearest to the one asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Nearest(pub Vec<String>);

impl fmt::Display for Nearest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{{{}}}", self.0.join(", "))
    }
}

/// Every fault that a call into this crate can report.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No program has this name.
    #[error("no program is called `{name}`; the set holds {}", list(.known))]
    UnknownProgram {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// The program exists, but not with these features.
    #[error(
        "`{program}` was not built with the features {}; the nearest variant has {nearest}; build it, or compose it with `ProgramSet::get_or_compose` (feature `compose`)",
        list(.features)
    )]
    VariantNotBuilt {
        /// The program.
        program: String,
        /// The features asked for.
        features: Vec<String>,
        /// The features of the nearest variant.
        nearest: Nearest,
    },
    /// No key has this name.
    #[error("no key is called `{name}`{}", suggestion(.nearest))]
    UnknownKey {
        /// The name asked for.
        name: String,
        /// The nearest declared name.
        nearest: Option<String>,
    },
    /// A file that holds no height map.
    #[error("the height map {file}: {what}")]
    HeightMap {
        /// The file.
        file: String,
        /// What is wrong with it.
        what: String,
    },
    /// A file that holds no weather map.
    #[error("the weather map {file}: {what}")]
    WeatherMap {
        /// The file.
        file: String,
        /// What is wrong with it.
        what: String,
    },
    /// No preset has this name.
    #[error("no preset is called `{name}`; the set holds {}", list(.known))]
    UnknownPreset {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// No scene has this name.
    #[error("no scene is called `{name}`; the set holds {}", list(.known))]
    UnknownScene {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// No atmosphere has this name.
    #[error("no atmosphere is called `{name}`; there are {}", list(.known))]
    UnknownAtmosphere {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// No land has this name.
    #[error("no land is called `{name}`; there are {}", list(.known))]
    UnknownLand {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// No layer of clouds has this name.
    #[error("no clouds are called `{name}`; there are {}", list(.known))]
    UnknownClouds {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// A text is not the RON that it should be, or cannot be written as RON.
    #[error("{0}")]
    Ron(String),
    /// A value lies outside what is allowed, or is not finite.
    #[error("`{name}` is {value}, but must be {domain}")]
    OutOfDomain {
        /// The field or key.
        name: String,
        /// The value given.
        value: String,
        /// What is allowed.
        domain: String,
    },
    /// A value has the wrong type.
    #[error("`{name}` is {value}, but its type is {expected}")]
    WrongType {
        /// The field or key.
        name: String,
        /// The value given.
        value: String,
        /// The declared type.
        expected: String,
    },
    /// The program declares no such override.
    #[error("`{program}` has no override `{name}`{}", suggestion(.nearest))]
    UnknownOverride {
        /// The program.
        program: String,
        /// The name given.
        name: String,
        /// The nearest declared name.
        nearest: Option<String>,
    },
    /// An override without a default got no value.
    #[error("`{program}` needs a value for its override `{name}`")]
    MissingOverride {
        /// The program.
        program: String,
        /// The override.
        name: String,
    },
    /// The program has no such entry point, or several and none was named.
    #[error("`{program}` has no entry point `{name}`; it has {}", list(.known))]
    EntryPoint {
        /// The program.
        program: String,
        /// The name given.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// The program has neither a vertex nor a compute stage.
    #[error("`{program}` has neither a vertex nor a compute stage, so there is nothing to run")]
    MissingStage {
        /// The program.
        program: String,
    },
    /// The device lacks a feature.
    #[error("the device lacks the feature {name}, which {why}")]
    MissingFeature {
        /// The feature.
        name: String,
        /// What needs it.
        why: String,
    },
    /// The device's limit is too low.
    #[error("the device's limit {name} is {available}, but {needed} is needed")]
    MissingLimit {
        /// The limit.
        name: &'static str,
        /// What is needed.
        needed: u64,
        /// What the device allows.
        available: u64,
    },
    /// No adapter answers.
    #[error(
        "no graphics adapter was found: {why}; on Debian or Ubuntu install one with `apt-get install mesa-vulkan-drivers`"
    )]
    NoAdapter {
        /// What the request said.
        why: String,
    },
    /// The device was refused, lost or reported an error.
    #[error("the graphics device failed: {0}")]
    Device(String),
    /// Input rows do not fit their description.
    #[error("{0}")]
    Rows(String),
    /// Composing at run time failed; each fault stands on its own line with its place.
    #[error("{0}")]
    Compose(String),
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        "nothing".to_owned()
    } else {
        names
            .iter()
            .map(|n| format!("`{n}`"))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

fn suggestion(nearest: &Option<String>) -> String {
    match nearest {
        Some(name) => format!("; did you mean `{name}`?"),
        None => String::new(),
    }
}

/// The candidate with the smallest edit distance, when it is near enough to be a slip of the finger.
pub(crate) fn nearest_name<'a>(
    name: &str,
    candidates: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let allowed = (name.chars().count() / 3).max(1);
    candidates
        .map(|c| (edit_distance(name, c), c))
        .filter(|(d, _)| *d <= allowed)
        .min()
        .map(|(_, c)| c.to_owned())
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substitution = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substitution.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
