//! Presets, scenes and views, and the values that they and `--set` give to the declared keys.

use std::collections::{BTreeMap, BTreeSet};

use crate::diag::{Diag, Diags, Place, line_at, nearest, without_mark};
use crate::keys::{Key, KeyKind, KeyType, Keys, Value};
use crate::ron_place::{self, Entry, Form, Kind, Node};

/// A value that a preset gives to a key.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The key.
    pub key: String,
    /// The value; it lies in the key's domain.
    pub value: Value,
    /// Why this value; always there in a preset that is based on another.
    pub why: Option<String>,
    /// Where the key stands.
    pub place: Place,
}

/// A preset (`presets/*.ron`): values for keys of either kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Preset {
    /// The name, which is that of its file without `.ron`.
    pub name: String,
    /// The preset whose values hold where this one gives none.
    pub based_on: Option<String>,
    /// What the preset is for.
    pub reason: String,
    /// The values in the order of the file; the keys are distinct.
    pub values: Vec<Setting>,
    /// The file's name as it was given.
    pub file: String,
    /// Where `based_on` stands.
    based_on_at: Option<(Place, String)>,
}

impl Preset {
    /// Reads a preset.
    ///
    /// # Errors
    /// All faults of the file; whether `based_on` exists is checked by [`Presets::load`].
    pub fn parse(keys: &Keys, name: &str, file: &str, text: &str) -> Result<Self, Diags> {
        const WHAT: &str = "a preset";
        let text = without_mark(text);
        let root = ron_place::read(file, text)?;
        let mut form = Form::new(file, text);
        if !form.is_map(&root, WHAT, &["based_on", "reason", "values"]) {
            return form.finish(None);
        }
        let reason = form.text(&root, WHAT, "reason");
        let base = root.get("based_on").map(|entry| &entry.value);
        let base = base.filter(|node| node.kind != Kind::Nothing);
        let based_on = base.and_then(|node| form.filled(node, "based_on"));
        let based_on_at = base.map(|node| {
            let place = Place::of(text, node.start);
            (place, line_at(text, place.line).to_owned())
        });
        let mut values = Vec::new();
        if let Some(node) = form.required(&root, WHAT, "values")
            && is_key_map(&mut form, node, "values")
        {
            for entry in node.entries() {
                values.extend(setting(&mut form, keys, entry, base.is_some()));
            }
        }
        form.finish(reason.map(|reason| Self {
            name: name.to_owned(),
            based_on,
            reason,
            values,
            file: file.to_owned(),
            based_on_at,
        }))
    }
}

/// Whether the value of a field is a map of keys.
fn is_key_map(form: &mut Form, node: &Node, field: &str) -> bool {
    let is_map = matches!(node.kind, Kind::Map(_));
    // `()` is the empty struct.
    let is_empty = matches!(&node.kind, Kind::List(items) if items.is_empty())
        || form.text.get(node.start..node.end) == Some("()");
    if !is_map && !is_empty {
        form.fault(
            node.start,
            format!(
                "`{field}` is a map of keys, but this is {}",
                node.kind.describe()
            ),
        );
    }
    is_map
}

/// The declaration of the key of an entry.
fn declared<'k>(form: &mut Form, keys: &'k Keys, entry: &Entry) -> Option<&'k Key> {
    let found = keys.get(&entry.key);
    if found.is_none() {
        form.fault_with(
            entry.start,
            format!("unknown key `{}`", entry.key),
            |diag| diag.suggest(&entry.key, keys.names()),
        );
    }
    found
}

/// The value at a node.
fn value(form: &mut Form, key: &Key, node: &Node) -> Option<Value> {
    match key.value_of(node, form.text) {
        Ok(value) => Some(value),
        Err(message) => {
            form.fault(node.start, message);
            None
        }
    }
}

fn setting(form: &mut Form, keys: &Keys, entry: &Entry, why_needed: bool) -> Option<Setting> {
    let key = declared(form, keys, entry)?;
    let (node, why) = if let Kind::Map(_) = entry.value.kind {
        let what = format!("the value of `{}`", key.name);
        if !form.is_map(&entry.value, &what, &["value", "why"]) {
            return None;
        }
        let why = match entry.value.get("why") {
            Some(why) => Some(form.filled(&why.value, "why")?),
            None => None,
        };
        (form.required(&entry.value, &what, "value")?, why)
    } else {
        (&entry.value, None)
    };
    let value = value(form, key, node)?;
    if why_needed && why.is_none() {
        form.fault(
            entry.start,
            format!(
                "`{0}` has no reason: a preset that is based on another gives one for each value, `\"{0}\": (value: {1}, why: \"...\")`",
                key.name, value
            ),
        );
        return None;
    }
    Some(Setting {
        key: key.name.clone(),
        value,
        why,
        place: Place::of(form.text, entry.start),
    })
}

/// All presets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presets {
    presets: BTreeMap<String, Preset>,
}

impl Presets {
    /// Reads presets, given as name, file name and text: our own and those of the user.
    ///
    /// # Errors
    /// All faults of all files; two presets of one name; a base that does not exist; a circle of bases.
    pub fn load<N, F, T>(keys: &Keys, files: &[(N, F, T)]) -> Result<Self, Diags>
    where
        N: AsRef<str>,
        F: AsRef<str>,
        T: AsRef<str>,
    {
        let mut presets: BTreeMap<String, Preset> = BTreeMap::new();
        let mut faults = Diags::new();
        // Also those with faults, so that a preset on top of one is not reported.
        let mut names: BTreeMap<&str, &str> = BTreeMap::new();
        for (name, file, text) in files {
            let (name, file) = (name.as_ref(), file.as_ref());
            if let Some(first) = names.insert(name, file) {
                faults.push(
                    Diag::whole_file(file, format!("a second preset `{name}`"))
                        .note(format!("the first is {first}")),
                );
                continue;
            }
            match Preset::parse(keys, name, file, text.as_ref()) {
                Ok(preset) => {
                    presets.insert(name.to_owned(), preset);
                }
                Err(found) => faults.append(found),
            }
        }
        for preset in presets.values() {
            let Some(base) = &preset.based_on else {
                continue;
            };
            if !names.contains_key(base.as_str()) {
                let fault = preset.base_fault(format!("no preset `{base}` to be based on"));
                faults.push(fault.suggest(base, names.keys().copied()));
            } else if let Some(circle) = circle(&presets, preset) {
                faults.push(preset.base_fault(format!("presets in a circle: {circle}")));
            }
        }
        faults.ok(Self { presets })
    }

    /// A preset.
    pub fn get(&self, name: &str) -> Option<&Preset> {
        self.presets.get(name)
    }

    /// All presets in the order of their names.
    pub fn iter(&self) -> impl Iterator<Item = &Preset> {
        self.presets.values()
    }

    /// All names in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.presets.keys().map(String::as_str)
    }

    /// A preset and those that it is based on, itself first; empty if there is none of the name.
    pub fn chain(&self, name: &str) -> Vec<&Preset> {
        let mut chain: Vec<&Preset> = Vec::new();
        let mut next = self.get(name);
        while let Some(preset) = next {
            if chain.iter().any(|seen| seen.name == preset.name) {
                break;
            }
            chain.push(preset);
            next = preset.based_on.as_deref().and_then(|base| self.get(base));
        }
        chain
    }
}

impl Preset {
    fn base_fault(&self, message: String) -> Diag {
        match &self.based_on_at {
            Some((place, line)) => Diag::new(&self.file, place.line, place.column, line, message),
            None => Diag::whole_file(&self.file, message),
        }
    }
}

/// The circle that a preset is part of, as `a -> b -> a`. It is named once, from its first preset by name.
fn circle(presets: &BTreeMap<String, Preset>, from: &Preset) -> Option<String> {
    let mut path = vec![from.name.as_str()];
    let mut next = from.based_on.as_deref();
    while let Some(name) = next {
        if name == from.name {
            let first = path.iter().min() == Some(&from.name.as_str());
            path.push(name);
            return first.then(|| path.join(" -> "));
        }
        if path.contains(&name) {
            return None;
        }
        path.push(name);
        next = presets.get(name).and_then(|p| p.based_on.as_deref());
    }
    None
}

/// A scene (`presets/scenes/*.ron`): what is in the picture.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Scene {
    /// The name, which is that of its file without `.ron`.
    pub name: String,
    /// The program that draws it.
    pub program: String,
    /// What the scene shows.
    pub meaning: String,
    /// The flags that it sets, in the order of the file; distinct.
    pub features: Vec<String>,
    /// The values that it gives to content keys, in the order of the file; the keys are distinct.
    pub content: Vec<(String, Value)>,
    /// The file's name as it was given.
    pub file: String,
}

impl Scene {
    /// Reads a scene.
    ///
    /// # Errors
    /// All faults of the file. Whether its program exists is the caller's to check.
    pub fn parse(keys: &Keys, name: &str, file: &str, text: &str) -> Result<Self, Diags> {
        const WHAT: &str = "a scene";
        let text = without_mark(text);
        let root = ron_place::read(file, text)?;
        let mut form = Form::new(file, text);
        if !form.is_map(&root, WHAT, &["program", "meaning", "features", "content"]) {
            return form.finish(None);
        }
        let program = form.text(&root, WHAT, "program");
        let meaning = form.text(&root, WHAT, "meaning");
        let features = match form.required(&root, WHAT, "features") {
            Some(node) => features(&mut form, keys, node),
            None => Vec::new(),
        };
        let mut content = Vec::new();
        if let Some(node) = root.get("content").map(|entry| &entry.value)
            && is_key_map(&mut form, node, "content")
        {
            for entry in node.entries() {
                let Some(key) = declared(&mut form, keys, entry) else {
                    continue;
                };
                if key.kind == KeyKind::Quality {
                    let flag = key.ty == KeyType::Flag;
                    form.fault_with(
                        entry.start,
                        format!(
                            "`{}` is a quality key: a scene gives content, quality is the preset's",
                            key.name
                        ),
                        |diag| {
                            if flag {
                                diag.note("a flag that the scene needs stands in `features`")
                            } else {
                                diag
                            }
                        },
                    );
                    continue;
                }
                if let Some(value) = value(&mut form, key, &entry.value) {
                    if features.contains(&key.name) && value != Value::Flag(true) {
                        form.fault(
                            entry.start,
                            format!("`{}` is a feature of the scene and also {value}", key.name),
                        );
                    }
                    content.push((key.name.clone(), value));
                }
            }
        }
        let scene = program.zip(meaning).map(|(program, meaning)| Self {
            name: name.to_owned(),
            program,
            meaning,
            features,
            content,
            file: file.to_owned(),
        });
        form.finish(scene)
    }
}

fn features(form: &mut Form, keys: &Keys, node: &Node) -> Vec<String> {
    let mut features: Vec<String> = Vec::new();
    let items: &[Node] = match &node.kind {
        Kind::List(items) => items,
        // `()` and `[]`.
        _ if form.text.get(node.start..node.end) == Some("()") => &[],
        other => {
            let what = other.describe();
            form.fault(
                node.start,
                format!("`features` is a list of flags, but this is {what}"),
            );
            &[]
        }
    };
    for item in items {
        let Some(name) = form.filled(item, "features") else {
            continue;
        };
        match keys.get(&name) {
            None => {
                let flags = || {
                    let flags = keys.iter().filter(|key| key.ty == KeyType::Flag);
                    flags.map(|key| key.name.as_str())
                };
                form.fault_with(item.start, format!("unknown feature `{name}`"), |diag| {
                    match nearest(&name, flags()) {
                        Some(near) => diag.note(format!("did you mean `{near}`?")),
                        None => diag,
                    }
                });
            }
            Some(key) if key.ty != KeyType::Flag => form.fault(
                item.start,
                format!("`{name}` is of the type {}: a feature is a flag", key.ty),
            ),
            Some(_) if features.contains(&name) => {
                form.fault(item.start, format!("feature `{name}` is given twice"));
            }
            Some(_) => features.push(name),
        }
    }
    features
}

/// A view (`presets/views/*.ron`): where the eye is and where it looks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct View {
    /// The name, which is that of its file without `.ron`.
    pub name: String,
    /// What the view shows.
    pub meaning: String,
    /// Height of the eye above the ground \[m\], in [0, 1e8].
    pub eye_height: f64,
    /// Pitch above the horizon \[degree\], in [-90, 90].
    pub pitch_deg: f64,
    /// Field of view \[degree\], in [1, 170].
    pub fov_deg: f64,
    /// Height of the sun above the horizon \[degree\], in [-90, 90].
    pub sun_height_deg: f64,
    /// Azimuth of the sun from the view \[degree\], in [-360, 360].
    pub sun_azimuth_deg: f64,
    /// Where the eye is over the ground, x and z \[m\], each in [-1e12, 1e12]; (0, 0) if not given.
    pub place: (f64, f64),
    /// Azimuth of the view \[degree\], in [-360, 360]; 0 if not given.
    pub yaw_deg: f64,
}

impl View {
    /// Reads a view.
    ///
    /// # Errors
    /// All faults of the file.
    pub fn parse(name: &str, file: &str, text: &str) -> Result<Self, Diags> {
        const WHAT: &str = "a view";
        const NUMBERS: [(&str, (f64, f64)); 5] = [
            ("eye_height", (0.0, 1e8)),
            ("pitch_deg", (-90.0, 90.0)),
            ("fov_deg", (1.0, 170.0)),
            ("sun_height_deg", (-90.0, 90.0)),
            ("sun_azimuth_deg", TURN),
        ];
        const TURN: (f64, f64) = (-360.0, 360.0);
        const EVERYWHERE: (f64, f64) = (-1e12, 1e12);
        let text = without_mark(text);
        let root = ron_place::read(file, text)?;
        let mut form = Form::new(file, text);
        let mut fields = vec!["meaning"];
        fields.extend(NUMBERS.iter().map(|(field, _)| *field));
        fields.extend(["place", "yaw_deg"]);
        if !form.is_map(&root, WHAT, &fields) {
            return form.finish(None);
        }
        let meaning = form.text(&root, WHAT, "meaning");
        let numbers = NUMBERS.map(|(field, domain)| {
            let node = form.required(&root, WHAT, field)?;
            form.number(node, field, domain)
        });
        let yaw_deg = match root.get("yaw_deg") {
            Some(entry) => form.number(&entry.value, "yaw_deg", TURN),
            None => Some(0.0),
        };
        let place = match root.get("place").map(|entry| &entry.value) {
            None => Some((0.0, 0.0)),
            Some(node) => match &node.kind {
                Kind::List(items) if items.len() == 2 => {
                    let x = form.number(&items[0], "place", EVERYWHERE);
                    let z = form.number(&items[1], "place", EVERYWHERE);
                    x.zip(z)
                }
                _ => {
                    form.fault(node.start, "`place` is `(x, z)`, two numbers");
                    None
                }
            },
        };
        let view = (|| {
            let [
                eye_height,
                pitch_deg,
                fov_deg,
                sun_height_deg,
                sun_azimuth_deg,
            ] = numbers;
            Some(Self {
                name: name.to_owned(),
                meaning: meaning?,
                eye_height: eye_height?,
                pitch_deg: pitch_deg?,
                fov_deg: fov_deg?,
                sun_height_deg: sun_height_deg?,
                sun_azimuth_deg: sun_azimuth_deg?,
                place: place?,
                yaw_deg: yaw_deg?,
            })
        })();
        form.finish(view)
    }
}

/// What gave a key its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// `--set`.
    Set,
    /// The scene.
    Scene,
    /// The preset of the name (which may be one that the chosen preset is based on).
    Preset(String),
    /// The declaration's default.
    Declaration,
}

/// A value for each declared key.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The values.
    pub values: BTreeMap<String, Value>,
    /// Where each value comes from; the same keys as `values`.
    pub origin: BTreeMap<String, Origin>,
    /// Type and kind of each key.
    kinds: BTreeMap<String, (KeyType, KeyKind)>,
}

impl Settings {
    /// The values of keys of some types and kinds, in the order of their names.
    fn select(
        &self,
        wanted: impl Fn(KeyType, KeyKind) -> bool,
    ) -> impl Iterator<Item = (&String, &Value)> {
        self.values.iter().filter(move |(name, _)| {
            self.kinds
                .get(*name)
                .is_some_and(|(ty, kind)| wanted(*ty, *kind))
        })
    }

    /// The flags that are set.
    pub fn flags(&self) -> BTreeSet<String> {
        self.select(|ty, _| ty == KeyType::Flag)
            .filter(|(_, value)| **value == Value::Flag(true))
            .map(|(name, _)| name.clone())
            .collect()
    }

    /// The sizes, which are put into the text of a program.
    pub fn sizes(&self) -> BTreeMap<String, i64> {
        self.select(|ty, _| ty == KeyType::Size)
            .filter_map(|(name, value)| match value {
                Value::Int(n) => Some((name.clone(), *n)),
                _ => None,
            })
            .collect()
    }

    /// The values of the WGSL overrides: the quality keys that are numbers, in the order of their names.
    pub fn overrides(&self) -> Vec<(String, f64)> {
        self.select(|ty, kind| {
            kind == KeyKind::Quality && !matches!(ty, KeyType::Flag | KeyType::Size)
        })
        .filter_map(|(name, value)| match value {
            Value::Int(n) => Some((name.clone(), *n as f64)),
            Value::Float(x) => Some((name.clone(), *x)),
            Value::Flag(_) | Value::Vec3(_) => None,
        })
        .collect()
    }

    /// The values of the content keys that are members of uniforms, in the order of their names.
    pub fn content(&self) -> Vec<(String, Value)> {
        self.select(|ty, kind| kind == KeyKind::Content && ty != KeyType::Flag)
            .map(|(name, value)| (name.clone(), *value))
            .collect()
    }
}

/// Splits the text of `--set KEY=VALUE`.
///
/// # Errors
/// There is no `=`, or nothing before or behind it.
pub fn split_set(text: &str) -> Result<(String, String), Diag> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err(Diag::at(
            "--set",
            text,
            text.find('=').unwrap_or(text.len()),
            "`KEY=VALUE` is expected",
        )),
    }
}

/// The value of each key: from `--set`, else the scene, else the preset or those that it is based on, else the
/// declaration.
///
/// # Errors
/// There is no preset of the name, or a `--set` names no key, has a value that the key cannot have, or gives one key
/// twice. These faults have the file name `--preset` or `--set`.
pub fn resolve(
    keys: &Keys,
    presets: &Presets,
    preset: &str,
    scene: Option<&Scene>,
    sets: &[(String, String)],
) -> Result<Settings, Diags> {
    let mut faults = Diags::new();
    let mut settings = Settings {
        values: BTreeMap::new(),
        origin: BTreeMap::new(),
        kinds: BTreeMap::new(),
    };
    for key in keys.iter() {
        settings.kinds.insert(key.name.clone(), (key.ty, key.kind));
        settings.give(&key.name, key.default, Origin::Declaration);
    }
    let chain = presets.chain(preset);
    if chain.is_empty() {
        faults.push(
            Diag::at("--preset", preset, 0, format!("no preset `{preset}`"))
                .suggest(preset, presets.names()),
        );
    }
    for preset in chain.into_iter().rev() {
        for setting in &preset.values {
            settings.give(
                &setting.key,
                setting.value,
                Origin::Preset(preset.name.clone()),
            );
        }
    }
    if let Some(scene) = scene {
        for (key, value) in &scene.content {
            settings.give(key, *value, Origin::Scene);
        }
        for flag in &scene.features {
            settings.give(flag, Value::Flag(true), Origin::Scene);
        }
    }
    for (name, text) in sets {
        let shown = format!("{name}={text}");
        let value = keys
            .find(name, |message| Diag::at("--set", &shown, 0, message))
            .and_then(|key| {
                key.parse_value(text)
                    .map_err(|message| Diag::at("--set", &shown, name.len() + 1, message))
            });
        match value {
            Ok(_) if settings.origin.get(name) == Some(&Origin::Set) => {
                faults.push(Diag::at(
                    "--set",
                    &shown,
                    0,
                    format!("key `{name}` is given twice"),
                ));
            }
            Ok(value) => settings.give(name, value, Origin::Set),
            Err(fault) => faults.push(fault),
        }
    }
    faults.ok(settings)
}

impl Settings {
    fn give(&mut self, key: &str, value: Value, origin: Origin) {
        self.values.insert(key.to_owned(), value);
        self.origin.insert(key.to_owned(), origin);
    }
}
