//! RON with places: `ron` parses, and a small tokenizer of our own finds where each key and value stands.
//!
//! `ron::Value` has no positions, and it silently keeps the last of two equal keys. The tokenizer reads the same text
//! once more, forgives everything, and its tree is walked in step with ron's; a part that does not match has the place
//! of its parent. The values are ron's.

use std::collections::BTreeMap;

use ron::value::Value;

use crate::diag::{Diag, Diags};

/// A value with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Offset of the value's first byte.
    pub start: usize,
    /// Offset behind the value's last byte.
    pub end: usize,
    /// The value.
    pub kind: Kind,
}

/// What a value is.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number that fits in 64 bits with sign.
    Int(i64),
    /// Any other number; may be infinite or not a number.
    Float(f64),
    /// A string.
    Text(String),
    /// A list `[a, b]` or a tuple `(a, b)`.
    List(Vec<Node>),
    /// A map `{"key": value}` or a struct `(key: value)`, in the order of the text; the keys are distinct.
    Map(Vec<Entry>),
    /// `None`.
    Nothing,
    /// What no file of ours holds: a bare word, a character, bytes, a range.
    Other(&'static str),
}

/// A key of a map and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Offset of the key's first byte (the quote of a string).
    pub start: usize,
    /// The value.
    pub value: Node,
}

impl Kind {
    /// The value's type for messages, with an article.
    pub fn describe(&self) -> &'static str {
        match self {
            Kind::Bool(_) => "a flag",
            Kind::Int(_) => "a whole number",
            Kind::Float(_) => "a number",
            Kind::Text(_) => "a string",
            Kind::List(_) => "a list",
            Kind::Map(_) => "a map",
            Kind::Nothing => "None",
            Kind::Other(what) => what,
        }
    }
}

impl Node {
    /// The entries of a map; empty for anything else.
    pub fn entries(&self) -> &[Entry] {
        match &self.kind {
            Kind::Map(entries) => entries,
            _ => &[],
        }
    }

    /// The value of a key, if this is a map that has it.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// The value at the end of a path of keys.
    pub fn at_path<'a>(&self, path: impl IntoIterator<Item = &'a str>) -> Option<&Node> {
        let mut node = self;
        for key in path {
            node = &node.get(key)?.value;
        }
        Some(node)
    }

    /// The number, whole or not.
    pub fn number(&self) -> Option<f64> {
        match self.kind {
            Kind::Int(n) => Some(n as f64),
            Kind::Float(x) => Some(x),
            _ => None,
        }
    }

    /// The value as it is written in `text`, shortened if it is long.
    pub fn shown<'t>(&self, text: &'t str) -> std::borrow::Cow<'t, str> {
        const LONGEST: usize = 40;
        let written = text.get(self.start..self.end).unwrap_or_default();
        if written.chars().count() <= LONGEST && !written.contains(['\n', '\r']) {
            return written.into();
        }
        let line = written.lines().next().unwrap_or_default();
        let short: String = line.chars().take(LONGEST).collect();
        format!("{short}...").into()
    }
}

/// Reads a RON file.
///
/// # Errors
/// What `ron` refuses; two equal keys in one map; a key that is no string.
pub fn read(file: &str, text: &str) -> Result<Node, Diags> {
    let value: Value = ron::from_str(text).map_err(|error| syntax(file, text, &error))?;
    let place = Tokens::new(text).document();
    let mut walk = Walk {
        file,
        text,
        faults: Vec::new(),
        exact: true,
    };
    let node = walk.node(value, &place);
    if walk.faults.is_empty() {
        Ok(node)
    } else {
        walk.faults.sort_by_key(|(at, _)| *at);
        Err(Diags(walk.faults.into_iter().map(|(_, d)| d).collect()))
    }
}

/// An error of ron.
fn syntax(file: &str, text: &str, error: &ron::error::SpannedError) -> Diag {
    let start = offset_of(text, error.span.start.line, error.span.start.col);
    let end = offset_of(text, error.span.end.line, error.span.end.col);
    let what = lower_first(&error.code.to_string());
    // A span ends where the parser gave up and may begin a token too early.
    let span = text.get(start..end).unwrap_or_default();
    let blank = span.len() - span.trim_start().len();
    if matches!(error.code, ron::Error::ExpectedComma) && end >= text.trim_end().len() {
        Diag::at(
            file,
            text,
            end,
            format!("RON: {what}, but the file ends: is a bracket not closed?"),
        )
    } else if blank < span.len() {
        Diag::at(file, text, start + blank, format!("RON: {what}"))
    } else {
        Diag::at(file, text, end, format!("RON: {what}"))
    }
}

/// Whether the tokenizer understands `text` just as `ron` does, so that every part has its own place; `None` if `ron`
/// refuses the text. A check for tests.
pub fn is_exact(text: &str) -> Option<bool> {
    let value: Value = ron::from_str(text).ok()?;
    let mut walk = Walk {
        file: "",
        text,
        faults: Vec::new(),
        exact: true,
    };
    walk.node(value, &Tokens::new(text).document());
    Some(walk.exact)
}

/// The byte offset of one of ron's positions (lines end with `\n`, columns count characters, both from 1).
fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start = text
        .split_inclusive('\n')
        .take(line.saturating_sub(1))
        .map(str::len)
        .sum::<usize>();
    let rest = text.get(start..).unwrap_or_default();
    rest.char_indices()
        .nth(column.saturating_sub(1))
        .map_or(text.len(), |(at, _)| start + at)
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    match (chars.next(), chars.clone().next()) {
        (Some(first), Some(second)) if first.is_uppercase() && !second.is_uppercase() => {
            first.to_lowercase().chain(chars).collect()
        }
        _ => text.to_owned(),
    }
}

/// A value's place as the tokenizer sees it.
struct Place {
    start: usize,
    end: usize,
    shape: Shape,
}

enum Shape {
    Leaf,
    List(Vec<Place>),
    Map(Vec<(Key, Place)>),
    /// `Some(x)`.
    Wrapped(Box<Place>),
}

struct Key {
    start: usize,
    /// The key as ron has it.
    name: Option<String>,
}

/// After this many faults a file is given up.
const MOST_FAULTS: usize = 100;

/// Deeper than ron goes.
const DEEPEST: usize = 200;

/// The tokenizer: it never fails, it only finds less.
struct Tokens<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Tokens<'a> {
    fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn bump(&mut self) {
        self.at += self.peek().map_or(0, char::len_utf8);
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        if found {
            self.at += c.len_utf8();
        }
        found
    }

    /// Skips blanks and comments.
    fn blanks(&mut self) {
        loop {
            let rest = self.rest();
            let trimmed = rest.trim_start_matches(|c: char| {
                c.is_whitespace() || matches!(c, '\u{200e}' | '\u{200f}')
            });
            self.at += rest.len() - trimmed.len();
            if trimmed.starts_with("//") {
                self.at += trimmed.find('\n').unwrap_or(trimmed.len());
            } else if trimmed.starts_with("/*") {
                self.at += block_comment(trimmed);
            } else {
                return;
            }
        }
    }

    fn document(mut self) -> Place {
        self.blanks();
        while self.rest().starts_with("#!") || self.rest().starts_with('#') {
            // An attribute: `#![enable(...)]` or `#![type = "..."]`.
            while let Some(c) = self.peek() {
                match c {
                    ']' => {
                        self.bump();
                        break;
                    }
                    '"' => self.string(),
                    _ => {
                        self.bump();
                        self.blanks();
                    }
                }
            }
            self.blanks();
        }
        self.value(0)
    }

    fn value(&mut self, depth: usize) -> Place {
        self.blanks();
        let start = self.at;
        let shape = self.shape(depth);
        Place {
            start,
            end: self.at.max(start),
            shape,
        }
    }

    fn shape(&mut self, depth: usize) -> Shape {
        if depth > DEEPEST {
            self.at = self.text.len();
            return Shape::Leaf;
        }
        match self.peek() {
            None => Shape::Leaf,
            Some('[') => {
                self.bump();
                Shape::List(self.list(']', depth))
            }
            Some('{') => {
                self.bump();
                self.map(depth)
            }
            Some('(') => self.parens(depth),
            Some('"') => {
                self.string();
                Shape::Leaf
            }
            Some('\'') => {
                self.character();
                Shape::Leaf
            }
            Some(_) if self.quoted_prefix() => Shape::Leaf,
            Some(_) => {
                let word = self.word();
                let end = self.at;
                self.blanks();
                if word == "Some" {
                    // With `implicit_some` the parentheses may be missing.
                    let closed = self.eat('(');
                    let inner = self.value(depth + 1);
                    if closed {
                        self.blanks();
                        self.eat(',');
                        self.blanks();
                        self.eat(')');
                    }
                    return Shape::Wrapped(Box::new(inner));
                }
                if self.peek() == Some('(') {
                    return self.parens(depth);
                }
                self.at = end;
                Shape::Leaf
            }
        }
    }

    /// A struct or a tuple.
    fn parens(&mut self, depth: usize) -> Shape {
        self.bump();
        self.blanks();
        let back = self.at;
        let word = self.word();
        self.blanks();
        let named = !word.is_empty() && self.peek() == Some(':');
        self.at = back;
        if !named {
            return Shape::List(self.list(')', depth));
        }
        let mut fields = Vec::new();
        loop {
            self.blanks();
            if self.eat(')') || self.at >= self.text.len() {
                return Shape::Map(fields);
            }
            let before = self.at;
            let start = self.at;
            let word = self.word();
            let name = Some(word.strip_prefix("r#").unwrap_or(word).to_owned());
            self.blanks();
            self.eat(':');
            let value = self.value(depth + 1);
            fields.push((Key { start, name }, value));
            self.blanks();
            self.eat(',');
            if self.at == before {
                self.bump();
            }
        }
    }

    fn map(&mut self, depth: usize) -> Shape {
        let mut entries = Vec::new();
        loop {
            self.blanks();
            if self.eat('}') || self.at >= self.text.len() {
                return Shape::Map(entries);
            }
            let before = self.at;
            let key = self.value(depth + 1);
            let written = &self.text[key.start..key.end];
            let name = ron::from_str::<String>(written).ok();
            self.blanks();
            self.eat(':');
            let value = self.value(depth + 1);
            let start = key.start;
            entries.push((Key { start, name }, value));
            self.blanks();
            self.eat(',');
            if self.at == before {
                self.bump();
            }
        }
    }

    fn list(&mut self, close: char, depth: usize) -> Vec<Place> {
        let mut items = Vec::new();
        loop {
            self.blanks();
            if self.eat(close) || self.at >= self.text.len() {
                return items;
            }
            let before = self.at;
            items.push(self.value(depth + 1));
            self.blanks();
            self.eat(',');
            if self.at == before {
                self.bump();
            }
        }
    }

    /// A number, a word or a raw name; stops at blanks, brackets, commas, colons and comments.
    fn word(&mut self) -> &'a str {
        let start = self.at;
        while let Some(c) = self.peek() {
            match c {
                // `b'x'` is a number for ron.
                '\'' if self.text[start..self.at].ends_with('b') => self.character(),
                ',' | ':' | '(' | ')' | '[' | ']' | '{' | '}' | '"' | '\'' | '/' => break,
                '\u{200e}' | '\u{200f}' => break,
                c if c.is_whitespace() => break,
                _ => self.bump(),
            }
        }
        &self.text[start..self.at]
    }

    /// Strings with a prefix: `r"..."`, `r#"..."#`, `b"..."`, `br"..."`, `br#"..."#`.
    fn quoted_prefix(&mut self) -> bool {
        let rest = self.rest();
        let body = rest.strip_prefix('b').unwrap_or(rest);
        if let Some(raw) = body.strip_prefix('r') {
            let hashes = raw.len() - raw.trim_start_matches('#').len();
            if !raw[hashes..].starts_with('"') {
                return false;
            }
            let close = format!("\"{}", "#".repeat(hashes));
            let from = rest.len() - raw.len() + hashes + 1;
            self.at += rest[from..]
                .find(&close)
                .map_or(rest.len(), |end| from + end + close.len());
            return true;
        }
        if body.len() < rest.len() && body.starts_with('"') {
            self.at += 1;
            self.string();
            return true;
        }
        false
    }

    fn string(&mut self) {
        self.bump();
        while let Some(c) = self.peek() {
            self.bump();
            match c {
                '"' => return,
                '\\' => self.bump(),
                _ => {}
            }
        }
    }

    fn character(&mut self) {
        self.bump();
        if self.eat('\\') {
            self.bump();
            // `\u{1f600}` and `\x41`.
            while self
                .peek()
                .is_some_and(|c| c.is_ascii_alphanumeric() || matches!(c, '{' | '}'))
            {
                self.bump();
            }
        } else {
            self.bump();
        }
        self.eat('\'');
    }
}

/// Length of the (nested) block comment at the start of `text`.
fn block_comment(text: &str) -> usize {
    let bytes = text.as_bytes();
    let (mut at, mut level) = (0, 0usize);
    while at < bytes.len() {
        if bytes[at..].starts_with(b"/*") {
            level += 1;
            at += 2;
        } else if bytes[at..].starts_with(b"*/") {
            level -= 1;
            at += 2;
            if level == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    text.len()
}

/// Walks ron's tree and the tokenizer's in step.
struct Walk<'a> {
    file: &'a str,
    text: &'a str,
    faults: Vec<(usize, Diag)>,
    exact: bool,
}

impl Walk<'_> {
    fn fault(&mut self, at: usize, message: String, note: Option<String>) {
        if self.faults.len() < MOST_FAULTS {
            let mut diag = Diag::at(self.file, self.text, at, message);
            diag.notes.extend(note);
            self.faults.push((at, diag));
        }
    }

    fn node(&mut self, value: Value, place: &Place) -> Node {
        let kind = match (value, &place.shape) {
            (Value::Option(Some(inner)), Shape::Wrapped(place)) => return self.node(*inner, place),
            (Value::Option(Some(inner)), _) => {
                self.exact = false;
                return self.node(*inner, place);
            }
            (Value::Seq(values), Shape::List(places)) if values.len() == places.len() => {
                let pairs = values.into_iter().zip(places);
                Kind::List(pairs.map(|(v, p)| self.node(v, p)).collect())
            }
            (Value::Seq(values), _) => {
                self.exact = false;
                let leaf = leaf(place);
                Kind::List(values.into_iter().map(|v| self.node(v, &leaf)).collect())
            }
            // `1..2` is a map for ron.
            (Value::Map(_), Shape::Leaf) => Kind::Other("a range"),
            (Value::Map(map), shape) => self.map(map, shape, place),
            (value, shape) => {
                let empty = match (&value, shape) {
                    (_, Shape::Leaf) => true,
                    // `()` is the unit.
                    (Value::Unit, Shape::List(places)) => places.is_empty(),
                    _ => false,
                };
                self.exact &= empty;
                scalar(value)
            }
        };
        Node {
            start: place.start,
            end: place.end,
            kind,
        }
    }

    fn map(&mut self, mut map: ron::Map, shape: &Shape, place: &Place) -> Kind {
        let mut entries: Vec<Entry> = Vec::with_capacity(map.len());
        let mut seen: BTreeMap<&String, usize> = BTreeMap::new();
        if let Shape::Map(places) = shape {
            // Of equal keys ron keeps the last.
            let last: BTreeMap<&String, &Place> = places
                .iter()
                .filter_map(|(key, place)| Some((key.name.as_ref()?, place)))
                .collect();
            for (key, _) in places {
                let Some(name) = &key.name else {
                    continue;
                };
                if let Some(&first) = seen.get(name) {
                    let (line, column) = crate::diag::line_column(self.text, first);
                    let note = format!("the first is at {}:{line}:{column}", self.file);
                    self.fault(
                        key.start,
                        format!("key `{name}` is given twice"),
                        Some(note),
                    );
                    continue;
                }
                seen.insert(name, key.start);
                let value = map.remove(&Value::String(name.clone()));
                if let (Some(value), Some(&place)) = (value, last.get(name)) {
                    let value = self.node(value, place);
                    entries.push(Entry {
                        key: name.clone(),
                        start: key.start,
                        value,
                    });
                } else {
                    self.exact = false;
                }
            }
        }
        // What is left has a key that is no string, or that the tokenizer did not find.
        let mut unnamed: Vec<usize> = match shape {
            Shape::Map(places) => places
                .iter()
                .filter(|(key, _)| key.name.is_none())
                .map(|(key, _)| key.start)
                .collect(),
            _ => Vec::new(),
        };
        for (key, value) in map {
            if let Value::String(key) = key {
                self.exact = false;
                let value = self.node(value, &leaf(place));
                entries.push(Entry {
                    key,
                    start: place.start,
                    value,
                });
            } else if unnamed.is_empty() {
                self.exact = false;
                unnamed.push(place.start);
            }
        }
        for at in unnamed {
            let message = "a key is no string: write `{\"KEY\": value}` or `(KEY: value)`";
            self.fault(at, message.to_owned(), None);
        }
        Kind::Map(entries)
    }
}

fn leaf(place: &Place) -> Place {
    Place {
        start: place.start,
        end: place.end,
        shape: Shape::Leaf,
    }
}

fn scalar(value: Value) -> Kind {
    match value {
        Value::Bool(b) => Kind::Bool(b),
        Value::String(s) => Kind::Text(s),
        Value::Number(number) => number_kind(number),
        Value::Char(_) => Kind::Other("a character"),
        Value::Bytes(_) => Kind::Other("bytes"),
        Value::Option(_) => Kind::Nothing,
        Value::Unit => Kind::Other("a bare word"),
        // Handled by the caller.
        Value::Seq(_) => Kind::Other("a list"),
        Value::Map(_) => Kind::Other("a map"),
    }
}

fn number_kind(number: ron::Number) -> Kind {
    use ron::Number;
    match number {
        Number::I8(n) => Kind::Int(n.into()),
        Number::I16(n) => Kind::Int(n.into()),
        Number::I32(n) => Kind::Int(n.into()),
        Number::I64(n) => Kind::Int(n),
        Number::U8(n) => Kind::Int(n.into()),
        Number::U16(n) => Kind::Int(n.into()),
        Number::U32(n) => Kind::Int(n.into()),
        Number::U64(n) => i64::try_from(n).map_or(Kind::Float(n as f64), Kind::Int),
        Number::F32(x) => Kind::Float(x.get().into()),
        Number::F64(x) => Kind::Float(x.get()),
        other => Kind::Float(other.into_f64()),
    }
}

/// A number for messages: whole ones without a point, large and small ones with an exponent.
pub(crate) fn show(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e9 {
        format!("{x}")
    } else {
        format!("{x:?}")
    }
}

/// The faults of one file while its values are read, with the checks that all files share.
pub(crate) struct Form<'a> {
    pub file: &'a str,
    pub text: &'a str,
    faults: Vec<(usize, Diag)>,
}

impl<'a> Form<'a> {
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self {
            file,
            text,
            faults: Vec::new(),
        }
    }

    pub fn fault(&mut self, at: usize, message: impl Into<String>) {
        self.fault_with(at, message, |diag| diag);
    }

    /// A fault with notes that `notes` adds.
    pub fn fault_with(
        &mut self,
        at: usize,
        message: impl Into<String>,
        notes: impl FnOnce(Diag) -> Diag,
    ) {
        if self.faults.len() < MOST_FAULTS {
            let diag = Diag::at(self.file, self.text, at, message);
            self.faults.push((at, notes(diag)));
        }
    }

    /// Whether `node` is a map; its fields must be among `allowed`.
    pub fn is_map(&mut self, node: &Node, what: &str, allowed: &[&str]) -> bool {
        if !matches!(node.kind, Kind::Map(_)) {
            self.fault(
                node.start,
                format!("{what} is a map, but this is {}", node.kind.describe()),
            );
            return false;
        }
        for entry in node.entries() {
            if !allowed.contains(&entry.key.as_str()) {
                self.fault_with(
                    entry.start,
                    format!("unknown field `{}` of {what}", entry.key),
                    |diag| match crate::diag::nearest(&entry.key, allowed.iter().copied()) {
                        Some(near) => diag.note(format!("did you mean `{near}`?")),
                        None => diag.note(format!("the fields are {}", allowed.join(", "))),
                    },
                );
            }
        }
        true
    }

    /// A field that must be there.
    pub fn required<'n>(&mut self, node: &'n Node, what: &str, field: &str) -> Option<&'n Node> {
        let found = node.get(field).map(|entry| &entry.value);
        if found.is_none() {
            self.fault(node.start, format!("{what} has no field `{field}`"));
        }
        found
    }

    /// A field that must be there and hold a string that is not blank.
    pub fn text(&mut self, node: &Node, what: &str, field: &str) -> Option<String> {
        let value = self.required(node, what, field)?;
        self.filled(value, field)
    }

    /// A string that is not blank.
    pub fn filled(&mut self, value: &Node, field: &str) -> Option<String> {
        match &value.kind {
            Kind::Text(text) if !text.trim().is_empty() => Some(text.clone()),
            Kind::Text(_) => {
                self.fault(value.start, format!("`{field}` is empty"));
                None
            }
            other => {
                self.fault(
                    value.start,
                    format!("`{field}` is a string, but this is {}", other.describe()),
                );
                None
            }
        }
    }

    /// A finite number in a closed domain.
    pub fn number(&mut self, value: &Node, field: &str, domain: (f64, f64)) -> Option<f64> {
        let Some(number) = value.number() else {
            self.fault(
                value.start,
                format!(
                    "`{field}` is a number, but this is {}",
                    value.kind.describe()
                ),
            );
            return None;
        };
        let shown = value.shown(self.text);
        let (lo, hi) = (show(domain.0), show(domain.1));
        if !number.is_finite() {
            self.fault(
                value.start,
                format!("`{field}` is {shown}: not finite; allowed is [{lo}, {hi}]"),
            );
            return None;
        }
        if number < domain.0 || number > domain.1 {
            self.fault(
                value.start,
                format!("`{field}` is {shown}: out of its domain [{lo}, {hi}]"),
            );
            return None;
        }
        Some(number)
    }

    /// The value if there is no fault. A value that is missing without a fault is a fault of the whole file.
    pub fn finish<T>(mut self, value: Option<T>) -> Result<T, Diags> {
        match value {
            Some(value) if self.faults.is_empty() => Ok(value),
            _ => {
                if self.faults.is_empty() {
                    self.fault(0, "the file cannot be read");
                }
                self.faults.sort_by_key(|(at, _)| *at);
                Err(Diags(self.faults.into_iter().map(|(_, d)| d).collect()))
            }
        }
    }
}
