//! Key declarations (`keys.ron`): every flag, count and content value that presets, scenes and `--set` may name.

use std::collections::BTreeMap;
use std::fmt;

use crate::diag::{Diag, Diags, Place, without_mark};
use crate::ron_place::{self, Form, Kind, Node, show};

/// What values a key has, and what it is in the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum KeyType {
    /// `flag`: a shader definition that is there or not (`#ifdef NAME`).
    Flag,
    /// `i32`: a whole number with sign.
    I32,
    /// `u32`: a whole number from 0.
    U32,
    /// `f32`: a number.
    F32,
    /// `size`: a whole number from 0 that is put into the text (`#{NAME}`).
    Size,
    /// `vec3`: three numbers; the domain holds for each.
    Vec3,
}

const TYPES: [(&str, KeyType); 6] = [
    ("flag", KeyType::Flag),
    ("i32", KeyType::I32),
    ("u32", KeyType::U32),
    ("f32", KeyType::F32),
    ("size", KeyType::Size),
    ("vec3", KeyType::Vec3),
];

impl KeyType {
    /// What a value of the type is, with an article.
    fn describe(self) -> &'static str {
        match self {
            Self::Flag => "a flag (true, false, 1 or 0)",
            Self::I32 | Self::U32 | Self::Size => "a whole number",
            Self::F32 => "a number",
            Self::Vec3 => "three numbers",
        }
    }

    /// The least and the greatest number of the type.
    fn limits(self) -> (f64, f64) {
        match self {
            Self::Flag => (0.0, 1.0),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::U32 => (0.0, u32::MAX.into()),
            Self::Size => (0.0, i32::MAX.into()),
            Self::F32 | Self::Vec3 => (f32::MIN.into(), f32::MAX.into()),
        }
    }

    fn is_whole(self) -> bool {
        matches!(self, Self::I32 | Self::U32 | Self::Size)
    }
}

impl fmt::Display for KeyType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = TYPES.iter().find(|(_, ty)| ty == self).map_or("", |t| t.0);
        f.write_str(name)
    }
}

/// Whether a change of a key may create a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum KeyKind {
    /// `quality`: a flag, a size or a WGSL override. A change may create a pipeline.
    Quality,
    /// `content`: a member of a uniform, named like the key in lower case. A change never creates a pipeline.
    Content,
}

impl fmt::Display for KeyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Quality => "quality",
            Self::Content => "content",
        })
    }
}

/// The value of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Of a key of the type `flag`.
    Flag(bool),
    /// Of a key of the types `i32`, `u32` and `size`.
    Int(i64),
    /// Of a key of the type `f32`.
    Float(f64),
    /// Of a key of the type `vec3`.
    Vec3([f64; 3]),
}

impl fmt::Display for Value {
    /// The notation of RON and of `--set`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(b) => write!(f, "{b}"),
            Self::Int(n) => write!(f, "{n}"),
            Self::Float(x) => write!(f, "{x:?}"),
            Self::Vec3([x, y, z]) => write!(f, "({x:?}, {y:?}, {z:?})"),
        }
    }
}

/// The declaration of a key.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Key {
    /// The name, in upper case with underscores.
    pub name: String,
    /// What values it has.
    pub ty: KeyType,
    /// Whether a change of it may create a pipeline.
    pub kind: KeyKind,
    /// The least and the greatest allowed value, both finite; `None` for a flag only.
    pub domain: Option<(f64, f64)>,
    /// The value where nothing else gives one.
    pub default: Value,
    /// What it means, in a sentence.
    pub meaning: String,
    /// The unit, `1` if it has none.
    pub unit: String,
    /// The file that declares it.
    pub file: String,
    /// Where in that file its name stands.
    pub place: Place,
}

impl Key {
    /// The name of the uniform's member, for a content key that is no flag.
    pub fn member(&self) -> String {
        self.name.to_ascii_lowercase()
    }

    /// The domain as it is shown in messages.
    fn domain_text(&self) -> String {
        match self.domain {
            Some((lo, hi)) => {
                let each = if self.ty == KeyType::Vec3 {
                    " for each component"
                } else {
                    ""
                };
                format!("[{}, {}]{each}", show(lo), show(hi))
            }
            None => "true, false, 1 or 0".to_owned(),
        }
    }

    /// Whether a value has the key's type and lies in its domain.
    ///
    /// # Errors
    /// A sentence that names the value and the domain.
    pub fn check(&self, value: &Value) -> Result<(), String> {
        let name = &self.name;
        let fits = match (self.ty, value) {
            (KeyType::Flag, Value::Flag(_)) => return Ok(()),
            (ty, Value::Int(_)) => ty.is_whole(),
            (ty, Value::Float(_)) => ty == KeyType::F32,
            (ty, Value::Vec3(_)) => ty == KeyType::Vec3,
            _ => false,
        };
        if !fits {
            return Err(format!(
                "`{name}` is {}, but this is {value}; allowed is {}",
                self.ty.describe(),
                self.domain_text()
            ));
        }
        let numbers: &[f64] = match value {
            Value::Flag(_) => &[],
            Value::Int(n) => &[*n as f64],
            Value::Float(x) => &[*x],
            Value::Vec3(v) => v,
        };
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err(format!(
                "`{name}` is {value}: not finite; allowed is {}",
                self.domain_text()
            ));
        }
        let (lo, hi) = self.domain.unwrap_or_else(|| self.ty.limits());
        if numbers.iter().any(|x| *x < lo || *x > hi) {
            return Err(format!(
                "`{name}` is {value}: out of its domain {}",
                self.domain_text()
            ));
        }
        Ok(())
    }

    /// Reads the value from RON; `text` is the file's text, for messages.
    pub(crate) fn value_of(&self, node: &Node, text: &str) -> Result<Value, String> {
        let value = raw_value(self.ty, node).ok_or_else(|| {
            format!(
                "`{}` is {}, but this is {} ({}); allowed is {}",
                self.name,
                self.ty.describe(),
                node.kind.describe(),
                node.shown(text),
                self.domain_text()
            )
        })?;
        self.check(&value)?;
        Ok(value)
    }

    /// Reads the value from the text of `--set KEY=VALUE`.
    ///
    /// A flag is `true`, `false`, `1` or `0`; a `vec3` is `X,Y,Z`, with or without parentheses.
    ///
    /// # Errors
    /// The text is no value of the key's type, or out of its domain.
    pub fn parse_value(&self, text: &str) -> Result<Value, String> {
        let text = text.trim();
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let value = match self.ty {
            KeyType::Flag => match text {
                "true" | "1" => Some(Value::Flag(true)),
                "false" | "0" => Some(Value::Flag(false)),
                _ => None,
            },
            KeyType::I32 | KeyType::U32 | KeyType::Size => text.parse().ok().map(Value::Int),
            KeyType::F32 => number(text).map(Value::Float),
            KeyType::Vec3 => {
                let bare = text
                    .strip_prefix('(')
                    .and_then(|rest| rest.strip_suffix(')'))
                    .unwrap_or(text);
                let parts: Option<Vec<f64>> = bare.split(',').map(number).collect();
                match parts.as_deref() {
                    Some(&[x, y, z]) => Some(Value::Vec3([x, y, z])),
                    _ => None,
                }
            }
        };
        let value = value.ok_or_else(|| {
            format!(
                "`{}` is {}, but this is `{text}`; allowed is {}",
                self.name,
                self.ty.describe(),
                self.domain_text()
            )
        })?;
        self.check(&value)?;
        Ok(value)
    }
}

/// The value of a type that RON gives, without its domain.
fn raw_value(ty: KeyType, node: &Node) -> Option<Value> {
    match (ty, &node.kind) {
        (KeyType::Flag, Kind::Bool(b)) => Some(Value::Flag(*b)),
        (KeyType::Flag, Kind::Int(n @ (0 | 1))) => Some(Value::Flag(*n == 1)),
        (KeyType::I32 | KeyType::U32 | KeyType::Size, Kind::Int(n)) => Some(Value::Int(*n)),
        (KeyType::F32, _) => node.number().map(Value::Float),
        (KeyType::Vec3, Kind::List(items)) => match items.as_slice() {
            [x, y, z] => Some(Value::Vec3([x.number()?, y.number()?, z.number()?])),
            _ => None,
        },
        _ => None,
    }
}

/// All declared keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keys {
    keys: BTreeMap<String, Key>,
}

impl Keys {
    /// Reads the declarations of several files, given as name and text: our own and those of the user.
    ///
    /// # Errors
    /// All faults of all files; a key that two files declare.
    pub fn load<F: AsRef<str>, T: AsRef<str>>(files: &[(F, T)]) -> Result<Self, Diags> {
        let mut keys = Self::default();
        let mut faults = Diags::new();
        for (file, text) in files {
            match declarations(file.as_ref(), without_mark(text.as_ref()), &keys) {
                Ok(declared) => keys
                    .keys
                    .extend(declared.into_iter().map(|key| (key.name.clone(), key))),
                Err(found) => faults.append(found),
            }
        }
        faults.ok(keys)
    }

    /// The declaration of a key.
    pub fn get(&self, name: &str) -> Option<&Key> {
        self.keys.get(name)
    }

    /// All declarations in the order of their names.
    pub fn iter(&self) -> impl Iterator<Item = &Key> {
        self.keys.values()
    }

    /// All names in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.keys.keys().map(String::as_str)
    }

    /// How many keys are declared.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Whether no key is declared.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Whether a key is declared and a value has its type and lies in its domain.
    ///
    /// # Errors
    /// A sentence that names the value and the domain, or the nearest key.
    pub fn check(&self, name: &str, value: &Value) -> Result<(), String> {
        match self.get(name) {
            Some(key) => key.check(value),
            None => Err(match crate::diag::nearest(name, self.names()) {
                Some(near) => format!("unknown key `{name}`: did you mean `{near}`?"),
                None => format!("unknown key `{name}`"),
            }),
        }
    }

    /// The declaration, or the fault of an unknown key, which `diag` places.
    pub(crate) fn find(&self, name: &str, diag: impl FnOnce(String) -> Diag) -> Result<&Key, Diag> {
        self.get(name)
            .ok_or_else(|| diag(format!("unknown key `{name}`")).suggest(name, self.names()))
    }
}

const FIELDS: [&str; 7] = [
    "name", "type", "kind", "domain", "default", "meaning", "unit",
];

/// The keys of one file; `known` are those of the files before it.
fn declarations(file: &str, text: &str, known: &Keys) -> Result<Vec<Key>, Diags> {
    let root = ron_place::read(file, text)?;
    let mut form = Form::new(file, text);
    let Kind::List(items) = &root.kind else {
        form.fault(
            root.start,
            format!(
                "key declarations are a list, but this is {}",
                root.kind.describe()
            ),
        );
        return form.finish(None);
    };
    let mut keys: Vec<Key> = Vec::new();
    let mut names: BTreeMap<String, Place> = BTreeMap::new();
    for item in items {
        if !form.is_map(item, "a key declaration", &FIELDS) {
            continue;
        }
        let Some(name) = form.text(item, "a key declaration", "name") else {
            continue;
        };
        let at = item.get("name").map_or(item.start, |e| e.value.start);
        if !is_upper_snake(&name) {
            form.fault(
                at,
                format!(
                    "`{name}` is no name of a key: upper-case letters, digits and single underscores, a letter first"
                ),
            );
            continue;
        }
        let place = Place::of(text, at);
        let first = match (names.insert(name.clone(), place), known.get(&name)) {
            (Some(first), _) => Some((file.to_owned(), first)),
            (None, Some(first)) => Some((first.file.clone(), first.place)),
            (None, None) => None,
        };
        if let Some((first_file, first)) = first {
            form.fault_with(at, format!("key `{name}` is declared twice"), |diag| {
                diag.note(format!(
                    "the first is at {first_file}:{}:{}",
                    first.line, first.column
                ))
            });
            continue;
        }
        if let Some(key) = declaration(&mut form, item, name, place) {
            keys.push(key);
        }
    }
    form.finish(Some(keys))
}

fn declaration(form: &mut Form, item: &Node, name: String, place: Place) -> Option<Key> {
    let what = format!("key `{name}`");
    let ty = choice(form, item, &what, "type", &TYPES);
    let kinds = [("quality", KeyKind::Quality), ("content", KeyKind::Content)];
    let kind = choice(form, item, &what, "kind", &kinds);
    let meaning = form.text(item, &what, "meaning");
    let unit = form.text(item, &what, "unit");
    let default = form.required(item, &what, "default");
    let (ty, kind) = (ty?, kind?);
    let kind_at = item.get("kind").map_or(item.start, |e| e.value.start);
    match (ty, kind) {
        (KeyType::Vec3, KeyKind::Quality) => {
            form.fault(
                kind_at,
                format!("{what}: a vec3 cannot be quality, for no WGSL override is a vector"),
            );
            return None;
        }
        (KeyType::Size, KeyKind::Content) => {
            form.fault(
                kind_at,
                format!("{what}: a size cannot be content, for it is put into the shader's text"),
            );
            return None;
        }
        _ => {}
    }
    let domain = domain(form, item, &what, ty)?;
    let mut key = Key {
        name,
        ty,
        kind,
        domain,
        default: Value::Flag(false),
        meaning: meaning?,
        unit: unit?,
        file: form.file.to_owned(),
        place,
    };
    let default = default?;
    match key.value_of(default, form.text) {
        Ok(value) => key.default = value,
        Err(message) => {
            form.fault(default.start, format!("the default: {message}"));
            return None;
        }
    }
    Some(key)
}

fn choice<T: Copy>(
    form: &mut Form,
    item: &Node,
    what: &str,
    field: &str,
    choices: &[(&str, T)],
) -> Option<T> {
    let name = form.text(item, what, field)?;
    let found = choices.iter().find(|(n, _)| *n == name).map(|(_, v)| *v);
    if found.is_none() {
        let at = item.get(field).map_or(item.start, |e| e.value.start);
        let names: Vec<&str> = choices.iter().map(|(n, _)| *n).collect();
        form.fault_with(
            at,
            format!(
                "{what}: unknown {field} `{name}`; allowed is {}",
                names.join(", ")
            ),
            |diag| diag.suggest(&name, names.iter().copied()),
        );
    }
    found
}

/// The domain; `Some(None)` for a flag, which has none, `None` for a fault.
fn domain(form: &mut Form, item: &Node, what: &str, ty: KeyType) -> Option<Option<(f64, f64)>> {
    if ty == KeyType::Flag {
        if let Some(entry) = item.get("domain") {
            form.fault(entry.start, format!("{what}: a flag has no domain"));
            return None;
        }
        return Some(None);
    }
    let node = form.required(item, what, "domain")?;
    let bounds = match &node.kind {
        Kind::List(items) if items.len() == 2 => items,
        _ => {
            form.fault(
                node.start,
                format!("{what}: a domain is `(least, greatest)`"),
            );
            return None;
        }
    };
    let mut numbers = [0.0; 2];
    for (bound, number) in bounds.iter().zip(&mut numbers) {
        *number = form.number(bound, "domain", ty.limits())?;
        if ty.is_whole() && !matches!(bound.kind, Kind::Int(_)) {
            form.fault(
                bound.start,
                format!("{what}: the bounds of type {ty} are whole numbers"),
            );
            return None;
        }
    }
    let [lo, hi] = numbers;
    if lo > hi {
        form.fault(
            node.start,
            format!("{what}: the domain ({}, {}) is empty", show(lo), show(hi)),
        );
        return None;
    }
    Some(Some((lo, hi)))
}

/// Upper-case letters, digits and single underscores between them, a letter first.
pub(crate) fn is_upper_snake(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name
            .bytes()
            .all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_')
        && !name.contains("__")
        && !name.ends_with('_')
}
