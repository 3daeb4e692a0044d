//! The header grammar of WGSL modules: domain, range, error and source of every function, read and linted.
//!
//! The grammar is written down in `docs/header-grammar.md`.

use std::fmt;

use crate::diag::{Diag, Diags, Place, nearest, without_mark};

/// After this many faults a file is given up.
const MOST_FAULTS: usize = 100;

/// An end of an interval.
#[derive(Clone, Debug, PartialEq)]
pub enum Bound {
    /// A number; `inf`, `-inf`, `pi` and `-pi` are numbers too.
    Number(f64),
    /// A parameter (or a member of one), or its negative.
    Name {
        /// The parameter `NAME`, or `NAME.MEMBER`.
        name: String,
        /// Whether a `-` stands before it.
        negative: bool,
    },
}

impl Bound {
    /// The bound's value; `lookup` gives those of the parameters.
    pub fn value(&self, lookup: impl FnOnce(&str) -> Option<f64>) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            Self::Name { name, negative } => {
                lookup(name).map(|value| if *negative { -value } else { value })
            }
        }
    }

    fn number(&self) -> Option<f64> {
        self.value(|_| None)
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => f.write_str(&crate::ron_place::show(*x)),
            Self::Name { name, negative } => {
                write!(f, "{}{name}", if *negative { "-" } else { "" })
            }
        }
    }
}

/// An interval with a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub lo: Bound,
    /// The upper end.
    pub hi: Bound,
    /// Whether the lower end is left out, `(LO, ...`.
    pub lo_open: bool,
    /// Whether the upper end is left out, `..., HI)`.
    pub hi_open: bool,
    /// The unit, `1` for none.
    pub unit: String,
}

/// How samples of a domain are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Evenly.
    Lin,
    /// Evenly in the logarithm; the lower end is above 0.
    Log,
}

/// What a function is defined for, for one parameter; for a vector in each component.
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    /// The parameter `NAME`, or `NAME.MEMBER`.
    pub name: String,
    /// The values.
    pub interval: Interval,
    /// How a test spreads its samples.
    pub spacing: Spacing,
    /// Where the line's key stands.
    pub place: Place,
}

/// How an error is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// `abs`: the difference.
    Abs,
    /// `rel`: the difference over the reference's magnitude.
    Rel,
    /// `ulp`: the difference in units of the last place of the reference as an f32.
    Ulp,
}

/// How far a function may be from its reference.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorBound {
    /// The bound; finite, not negative.
    pub value: f64,
    /// How the error is measured.
    pub kind: ErrorKind,
    /// The path of the reference in the crate `veduta`, `reference::topic::name`.
    pub reference: String,
}

/// The header of a function.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FnHeader {
    /// The first paragraph.
    pub summary: String,
    /// The domains in the order of the lines; the names are distinct.
    pub domains: Vec<Domain>,
    /// The interval of the results.
    pub range: Option<Interval>,
    /// The error bound.
    pub error: Option<ErrorBound>,
    /// Parameters in which the function is monotone.
    pub monotone: Vec<String>,
    /// Where the formula is from; several lines are joined by `; `.
    pub source: Option<String>,
    /// Whether results outside of the domains may be infinite or NaN.
    pub outside_undefined: bool,
    /// Whether the function is not meant for importers.
    pub internal: bool,
}

impl FnHeader {
    /// The domain of a parameter.
    pub fn domain(&self, name: &str) -> Option<&Domain> {
        self.domains.iter().find(|domain| domain.name == name)
    }
}

/// A parameter of a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Param {
    /// The name.
    pub name: String,
    /// The type as it is written, without blanks.
    pub ty: String,
}

/// A function with its header.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Function {
    /// The name.
    pub name: String,
    /// The parameters.
    pub params: Vec<Param>,
    /// The type of the result as it is written, without blanks.
    pub result: Option<String>,
    /// The header.
    pub header: FnHeader,
    /// Where the name stands.
    pub place: Place,
}

/// A structure with the types of its members.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Struct {
    /// The name.
    pub name: String,
    /// The members in their order.
    pub members: Vec<Param>,
}

/// The headers of a module.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Headers {
    /// The first line of the module's header.
    pub title: String,
    /// The module's sources; at least one.
    pub sources: Vec<String>,
    /// The module's symbols, if it explains any.
    pub symbols: Option<String>,
    /// All functions in the order of the file.
    pub functions: Vec<Function>,
    /// All structures in the order of the file.
    pub structs: Vec<Struct>,
}

/// Reads and lints the headers of a module file.
///
/// # Errors
/// A missing or faulty module header; a function without a header; a line that is not of the grammar, names no
/// parameter or contradicts itself; a missing domain, range, error or source.
pub fn parse_headers(file: &str, text: &str) -> Result<Headers, Diags> {
    let text = without_mark(text);
    let mut lint = Lint {
        file,
        text,
        faults: Vec::new(),
    };
    let mut headers = lint.module();
    let (functions, structs) = Scan::new(text).declarations();
    headers.structs = structs;
    for raw in functions {
        if lint.faults.len() >= MOST_FAULTS {
            break;
        }
        headers.functions.push(lint.function(raw));
    }
    if lint.faults.is_empty() {
        Ok(headers)
    } else {
        lint.faults.sort_by_key(|(at, _)| *at);
        Err(Diags(lint.faults.into_iter().map(|(_, d)| d).collect()))
    }
}

/// A line of a header: offset of its text and the text, without the marker and trailing blanks.
#[derive(Clone, Copy)]
struct Line<'a> {
    at: usize,
    text: &'a str,
}

impl<'a> Line<'a> {
    /// The line with leading blanks left out.
    fn trimmed(self) -> Self {
        let text = self.text.trim_start();
        Self {
            at: self.at + (self.text.len() - text.len()),
            text,
        }
    }

    /// The first word and the rest.
    fn split(self) -> (&'a str, Self) {
        let line = self.trimmed();
        let end = line.text.find(char::is_whitespace);
        let (word, rest) = line.text.split_at(end.unwrap_or(line.text.len()));
        let rest = Self {
            at: line.at + word.len(),
            text: rest,
        };
        (word, rest.trimmed())
    }

    /// Whether the line goes on with the one before: at least two blanks more than the usual one.
    fn continues(self) -> bool {
        self.text.len() - self.text.trim_start().len() >= 3 && !self.text.trim().is_empty()
    }
}

/// A function as the scanner finds it.
struct RawFunction<'a> {
    name: &'a str,
    name_at: usize,
    params: Vec<Param>,
    result: Option<String>,
    doc: Vec<Line<'a>>,
}

/// Finds functions and the comments before them.
struct Scan<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    doc: Vec<Line<'a>>,
}

impl<'a> Scan<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text,
            at: 0,
            depth: 0,
            doc: Vec::new(),
        }
    }

    fn byte(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    /// The rest of the current line, without its line break.
    fn line(&self) -> &'a str {
        let rest = &self.text[self.at..];
        &rest[..rest.find(['\n', '\r']).unwrap_or(rest.len())]
    }

    fn declarations(mut self) -> (Vec<RawFunction<'a>>, Vec<Struct>) {
        let mut found = Vec::new();
        let mut structs = Vec::new();
        while let Some(byte) = self.byte() {
            match byte {
                b'/' if self.comment() => {}
                b'#' => self.directive(),
                b'{' => {
                    self.depth += 1;
                    self.doc.clear();
                    self.at += 1;
                }
                b'}' => {
                    self.depth = self.depth.saturating_sub(1);
                    self.doc.clear();
                    self.at += 1;
                }
                b'@' => self.attribute(),
                b'_' | b'a'..=b'z' | b'A'..=b'Z' | 0x80.. => {
                    let word = self.word();
                    if self.depth > 0 || matches!(word, "virtual" | "override") {
                        // `override fn` keeps its header; an override constant ends it with its semicolon.
                        continue;
                    }
                    let doc = std::mem::take(&mut self.doc);
                    match word {
                        "fn" => found.extend(self.function(doc)),
                        "struct" => structs.extend(self.structure()),
                        _ => {}
                    }
                }
                b';' => {
                    self.doc.clear();
                    self.at += 1;
                }
                _ => self.at += 1,
            }
        }
        (found, structs)
    }

    /// A comment; lines of headers are kept.
    fn comment(&mut self) -> bool {
        let line = self.line();
        if let Some(text) = line.strip_prefix("///") {
            if self.depth == 0 {
                self.doc.push(Line {
                    at: self.at + 3,
                    text: text.trim_end(),
                });
            }
            self.at += line.len();
            return true;
        }
        if line.starts_with("//") {
            self.at += line.len();
            return true;
        }
        if !line.starts_with("/*") {
            return false;
        }
        let bytes = self.text.as_bytes();
        let mut level = 0usize;
        while self.at < bytes.len() {
            if bytes[self.at..].starts_with(b"/*") {
                level += 1;
                self.at += 2;
            } else if bytes[self.at..].starts_with(b"*/") {
                level -= 1;
                self.at += 2;
                if level == 0 {
                    break;
                }
            } else {
                self.at += 1;
            }
        }
        true
    }

    /// A preprocessor line, or the lines of an import in braces.
    fn directive(&mut self) {
        let line = self.line();
        let mut level = 0isize;
        let mut end = self.at;
        if line.starts_with("#import") {
            for byte in self.text.as_bytes()[self.at..].iter() {
                match byte {
                    b'{' => level += 1,
                    b'}' => level -= 1,
                    b'\n' | b'\r' if level <= 0 => break,
                    _ => {}
                }
                end += 1;
            }
            self.at = end;
        } else {
            self.at += line.len().max(1);
        }
    }

    /// `@name(...)`.
    fn attribute(&mut self) {
        self.at += 1;
        self.blanks();
        self.word();
        self.blanks();
        if self.byte() == Some(b'(') {
            self.group();
        }
    }

    /// Skips blanks and comments.
    fn blanks(&mut self) {
        while let Some(byte) = self.byte() {
            match byte {
                b' ' | b'\t' | b'\n' | b'\r' => self.at += 1,
                b'/' if self.comment() => {}
                _ => return,
            }
        }
    }

    fn word(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        let word = &rest[..rest
            .find(|c: char| !(c.is_alphanumeric() || c == '_'))
            .unwrap_or(rest.len())];
        // A character outside of ASCII that is no letter is skipped.
        self.at += if word.is_empty() {
            rest.chars().next().map_or(0, char::len_utf8)
        } else {
            word.len()
        };
        word
    }

    /// Skips a group in parentheses, with those in it.
    fn group(&mut self) {
        let mut level = 0usize;
        while let Some(byte) = self.byte() {
            match byte {
                b'(' => level += 1,
                b')' => level -= 1,
                b'/' if self.comment() => continue,
                _ => {}
            }
            self.at += 1;
            if level == 0 {
                return;
            }
        }
    }

    /// The rest of a function behind `fn`, to its body.
    fn function(&mut self, doc: Vec<Line<'a>>) -> Option<RawFunction<'a>> {
        self.blanks();
        let name_at = self.at;
        let mut name = self.word();
        // `override fn module::name`.
        while self.text[self.at..].starts_with("::") {
            self.at += 2;
            let part = self.word();
            name = &self.text[name_at..self.at];
            if part.is_empty() {
                break;
            }
        }
        self.blanks();
        if name.is_empty() || self.byte() != Some(b'(') {
            return None;
        }
        self.at += 1;
        let params = self.params();
        self.blanks();
        let mut result = None;
        if self.text[self.at..].starts_with("->") {
            self.at += 2;
            self.blanks();
            while self.byte() == Some(b'@') {
                self.attribute();
                self.blanks();
            }
            let from = self.at;
            while self
                .byte()
                .is_some_and(|byte| !matches!(byte, b'{' | b';' | b'\n' | b'\r'))
            {
                self.at += 1;
            }
            result = Some(squeezed(&self.text[from..self.at]));
        }
        self.doc.clear();
        Some(RawFunction {
            name,
            name_at,
            params,
            result,
            doc,
        })
    }

    /// The rest of a structure behind `struct`, up to its last member.
    fn structure(&mut self) -> Option<Struct> {
        self.blanks();
        let name = self.word();
        self.blanks();
        if name.is_empty() || self.byte() != Some(b'{') {
            return None;
        }
        self.at += 1;
        let members = self.params();
        self.doc.clear();
        Some(Struct {
            name: name.to_owned(),
            members,
        })
    }

    /// The parameters, behind `(`, and the closing parenthesis; or the members of a structure, and its closing brace.
    fn params(&mut self) -> Vec<Param> {
        let mut params = Vec::new();
        loop {
            self.blanks();
            match self.byte() {
                None | Some(b'{' | b';') => return params,
                Some(b')' | b'}') => {
                    self.at += 1;
                    return params;
                }
                Some(b',') => {
                    self.at += 1;
                    continue;
                }
                Some(b'@') => {
                    self.attribute();
                    continue;
                }
                Some(_) => {}
            }
            let before = self.at;
            let name = self.word().to_owned();
            self.blanks();
            if self.byte() == Some(b':') {
                self.at += 1;
            }
            let mut ty = String::new();
            let mut level = 0usize;
            loop {
                self.blanks();
                let Some(c) = self.text[self.at..].chars().next() else {
                    break;
                };
                match c {
                    '<' | '(' | '[' => level += 1,
                    ',' | ')' if level == 0 => break,
                    '>' | ')' | ']' => level = level.saturating_sub(1),
                    '{' | '}' | ';' => break,
                    _ => {}
                }
                ty.push(c);
                self.at += c.len_utf8();
            }
            if !name.is_empty() {
                params.push(Param { name, ty });
            }
            if self.at == before {
                self.at += 1;
            }
        }
    }
}

/// A type without its blanks.
fn squeezed(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace()).collect()
}

/// Scalars and vectors that a domain is asked for: floats, signed integers and vectors of anything.
fn needs_domain(ty: &str) -> bool {
    matches!(ty, "f32" | "f16" | "i32")
        || ty
            .strip_prefix("vec")
            .is_some_and(|rest| rest.starts_with(['2', '3', '4']))
}

/// The least and the greatest number of the components of a type that has domains.
fn limits(ty: &str) -> Option<(f64, f64, bool)> {
    let of = |name: &str, letter: char| {
        ty == name
            || ty.starts_with("vec") && (ty.ends_with(&format!("<{name}>")) || ty.ends_with(letter))
    };
    if of("i32", 'i') {
        Some((i32::MIN.into(), i32::MAX.into(), true))
    } else if of("u32", 'u') {
        Some((0.0, u32::MAX.into(), true))
    } else if of("f32", 'f') {
        Some((f32::MIN.into(), f32::MAX.into(), false))
    } else if of("f16", 'h') {
        Some((-65504.0, 65504.0, false))
    } else {
        None
    }
}

const KEYS: [&str; 7] = [
    "domain", "range", "error", "monotone", "outside", "source", "internal",
];

const FORM_DOMAIN: &str = "`domain NAME in [LO, HI] UNIT lin|log`";
const FORM_RANGE: &str = "`range [LO, HI] UNIT`";
const FORM_ERROR: &str = "`error VALUE abs|rel|ulp of REFERENCE`";

struct Lint<'a> {
    file: &'a str,
    text: &'a str,
    faults: Vec<(usize, Diag)>,
}

impl<'a> Lint<'a> {
    fn fault(&mut self, at: usize, message: impl Into<String>) {
        self.fault_with(at, message, |diag| diag);
    }

    fn fault_with(
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

    /// The module's own header.
    fn module(&mut self) -> Headers {
        let mut headers = Headers::default();
        let mut at = self.text.len() - self.text.trim_start().len();
        let mut lines = Vec::new();
        while let Some(line) = self.text[at..].lines().next() {
            let Some(text) = line.strip_prefix("//!") else {
                break;
            };
            lines.push(Line {
                at: at + 3,
                text: text.trim_end(),
            });
            at += line.len();
            at += usize::from(self.text[at..].starts_with("\r\n"))
                + usize::from(self.text[at..].starts_with(['\n', '\r']));
        }
        let Some(first) = lines.first() else {
            let at = self.text.len() - self.text.trim_start().len();
            self.fault(
                at,
                "the module has no header: it begins with `//!` lines, the first is its title",
            );
            return headers;
        };
        let title = first.trimmed();
        headers.title = title.text.to_owned();
        let (word, _) = title.split();
        if title.text.is_empty() || matches!(word, "source" | "symbols") {
            self.fault(
                title.at,
                "the first line of the module's header is its title",
            );
        }
        // The text of the keyed line that a continued line adds to.
        let mut open: Option<&mut String> = None;
        let mut symbols = Vec::new();
        let mut entries: Vec<(bool, usize, String)> = Vec::new();
        for line in &lines[1..] {
            let (word, rest) = line.split();
            if matches!(word, "source" | "symbols") {
                entries.push((word == "source", rest.at, rest.text.to_owned()));
                open = entries.last_mut().map(|(_, _, text)| text);
            } else if line.continues()
                && let Some(text) = open.as_deref_mut()
            {
                text.push(' ');
                text.push_str(line.trimmed().text);
            } else {
                open = None;
            }
        }
        for (is_source, at, text) in entries {
            if text.is_empty() {
                let key = if is_source { "source" } else { "symbols" };
                self.fault(at, format!("`{key}` is empty"));
            }
            if is_source {
                headers.sources.push(text);
            } else {
                symbols.push(text);
            }
        }
        if !symbols.is_empty() {
            headers.symbols = Some(symbols.join(" · "));
        }
        if headers.sources.is_empty() {
            self.fault(first.at - 3, "the module's header has no line `source`");
        }
        headers
    }

    fn function(&mut self, raw: RawFunction<'a>) -> Function {
        let header = self.header(&raw);
        Function {
            name: raw.name.to_owned(),
            place: Place::of(self.text, raw.name_at),
            params: raw.params,
            result: raw.result,
            header,
        }
    }

    fn header(&mut self, raw: &RawFunction<'a>) -> FnHeader {
        let mut header = FnHeader::default();
        let name = raw.name;
        if raw.doc.is_empty() {
            self.fault(raw.name_at, format!("function `{name}` has no header"));
            return header;
        }
        let before = self.faults.len();
        let mut keyed = false;
        let mut in_summary = true;
        let mut in_source = false;
        for line in &raw.doc {
            let (word, rest) = line.split();
            if word.is_empty() {
                in_summary &= header.summary.is_empty();
                in_source = false;
                continue;
            }
            if line.continues() && in_source {
                if let Some(source) = &mut header.source {
                    source.push(' ');
                    source.push_str(line.trimmed().text);
                }
                continue;
            }
            in_source = false;
            let at = line.trimmed().at;
            match word {
                "domain" => self.domain(raw, &mut header, at, rest),
                "range" => {
                    let range = self.range(raw, rest);
                    if header.range.is_some() {
                        self.fault(at, "a second `range`");
                    }
                    header.range = range.or(header.range);
                }
                "error" => {
                    let error = self.error(rest);
                    if header.error.is_some() {
                        self.fault(at, "a second `error`");
                    }
                    header.error = error.or(header.error);
                }
                "monotone" => self.monotone(raw, &mut header, rest),
                "source" => {
                    if rest.text.is_empty() {
                        self.fault(rest.at, "`source` is empty");
                    }
                    in_source = true;
                    header.source = Some(match header.source.take() {
                        Some(source) => format!("{source}; {}", rest.text),
                        None => rest.text.to_owned(),
                    });
                }
                "outside" => {
                    if rest.text != "undefined" {
                        self.fault(at, "the form is `outside undefined`");
                    } else if header.outside_undefined {
                        self.fault(at, "a second `outside undefined`");
                    }
                    header.outside_undefined = true;
                }
                "internal" if rest.text.is_empty() => header.internal = true,
                _ if keyed => self.fault_with(
                    at,
                    format!("`{word}` is no key of a header: {} are", KEYS.join(", ")),
                    |diag| diag.suggest(word, KEYS),
                ),
                _ => {
                    if in_summary {
                        if !header.summary.is_empty() {
                            header.summary.push(' ');
                        }
                        header.summary.push_str(line.trimmed().text);
                    }
                    continue;
                }
            }
            keyed = true;
            in_summary = false;
        }
        let start = raw.doc[0].at - 3;
        if header.summary.is_empty() {
            self.fault(
                start,
                format!(
                    "the header of `{name}` does not begin with a sentence that says what it is"
                ),
            );
        }
        // A line with a fault is not missing as well.
        if header.internal || self.faults.len() > before {
            return header;
        }
        for param in &raw.params {
            let covered = header.domains.iter().any(|domain| {
                domain.name == param.name || domain.name.starts_with(&format!("{}.", param.name))
            });
            if needs_domain(&param.ty) && !covered {
                self.fault(
                    raw.name_at,
                    format!(
                        "the header of `{name}` has no domain of `{}`: {FORM_DOMAIN}",
                        param.name
                    ),
                );
            }
        }
        for (missing, form) in [
            (header.range.is_none(), FORM_RANGE),
            (header.error.is_none(), FORM_ERROR),
            (header.source.is_none(), "`source KEY ...`"),
        ] {
            if missing {
                self.fault_with(
                    raw.name_at,
                    format!("the header of `{name}` has no line {form}"),
                    |diag| {
                        diag.note(
                            "a helper that is not meant for importers has the line `internal`",
                        )
                    },
                );
            }
        }
        header
    }

    /// Whether `name` is a parameter or a member of one.
    fn is_param(raw: &RawFunction, name: &str) -> bool {
        let (base, member) = match name.split_once('.') {
            Some((base, member)) => (base, Some(member)),
            None => (name, None),
        };
        is_name(base)
            && member.is_none_or(|member| member.split('.').all(is_name))
            && raw.params.iter().any(|param| param.name == base)
    }

    /// Reports a name that is no parameter.
    fn unknown_param(&mut self, raw: &RawFunction, at: usize, name: &str) {
        let names: Vec<&str> = raw.params.iter().map(|param| param.name.as_str()).collect();
        self.fault_with(
            at,
            format!("`{name}` is no parameter of `{}`", raw.name),
            |diag| match nearest(name, names.iter().copied()) {
                Some(near) => diag.note(format!("did you mean `{near}`?")),
                None if names.is_empty() => diag.note("the function has no parameters"),
                None => diag.note(format!("the parameters are {}", names.join(", "))),
            },
        );
    }

    fn domain(&mut self, raw: &RawFunction, header: &mut FnHeader, at: usize, rest: Line) {
        let name_at = rest.at;
        let (name, rest) = rest.split();
        let (word, after) = rest.split();
        if name.is_empty() || word != "in" {
            return self.fault(rest.at, format!("the form is {FORM_DOMAIN}"));
        }
        if !Self::is_param(raw, name) {
            return self.unknown_param(raw, name_at, name);
        }
        if header.domain(name).is_some() {
            return self.fault(name_at, format!("a second domain of `{name}`"));
        }
        let ty = raw
            .params
            .iter()
            .find(|param| param.name == name)
            .map_or("", |param| param.ty.as_str());
        let Some((interval, rest)) = self.interval(raw, after, FORM_DOMAIN, limits(ty)) else {
            return;
        };
        let (word, end) = rest.split();
        let spacing = match word {
            "lin" => Spacing::Lin,
            "log" => Spacing::Log,
            _ => {
                return self.fault(
                    rest.at,
                    format!("`lin` or `log` is expected: {FORM_DOMAIN}"),
                );
            }
        };
        if !end.text.is_empty() {
            return self.fault(end.at, format!("more than {FORM_DOMAIN}"));
        }
        if spacing == Spacing::Log && interval.lo.number().is_some_and(|lo| lo <= 0.0) {
            return self.fault(
                rest.at,
                format!("`log` needs a lower bound above 0, not {}", interval.lo),
            );
        }
        header.domains.push(Domain {
            name: name.to_owned(),
            interval,
            spacing,
            place: Place::of(self.text, at),
        });
    }

    fn range(&mut self, raw: &RawFunction, rest: Line) -> Option<Interval> {
        let (interval, end) = self.interval(raw, rest, FORM_RANGE, None)?;
        if !end.text.is_empty() {
            self.fault(end.at, format!("more than {FORM_RANGE}"));
            return None;
        }
        Some(interval)
    }

    /// `[LO, HI] UNIT` and what follows.
    fn interval<'t>(
        &mut self,
        raw: &RawFunction,
        line: Line<'t>,
        form: &str,
        limits: Option<(f64, f64, bool)>,
    ) -> Option<(Interval, Line<'t>)> {
        let lo_open = line.text.starts_with('(');
        let close = line.text.find([']', ')']);
        let (Some(close), true) = (close, lo_open || line.text.starts_with('[')) else {
            self.fault(
                line.at,
                format!("an interval `[LO, HI]` is expected: {form}"),
            );
            return None;
        };
        let inner = &line.text[1..close];
        let Some((lo_text, hi_text)) = inner.split_once(',') else {
            self.fault(
                line.at,
                format!("an interval `[LO, HI]` is expected: {form}"),
            );
            return None;
        };
        let lo = self.bound(raw, line.at + 1, lo_text, limits)?;
        let hi = self.bound(raw, line.at + 2 + lo_text.len(), hi_text, limits)?;
        let hi_open = line.text[close..].starts_with(')');
        if let (Some(a), Some(b)) = (lo.number(), hi.number())
            && (a > b || (a == b && (lo_open || hi_open || a.is_infinite())))
        {
            self.fault(line.at, format!("the interval from {lo} to {hi} is empty"));
            return None;
        }
        let rest = Line {
            at: line.at + close + 1,
            text: &line.text[close + 1..],
        };
        let (unit, after) = rest.split();
        let is_unit = !unit.is_empty()
            && unit
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || matches!(c, '/' | '^' | '*' | '-' | '%'))
            && !matches!(unit, "lin" | "log");
        if !is_unit {
            let at = rest.trimmed().at;
            self.fault(at, format!("a unit is expected (`1` for none): {form}"));
            return None;
        }
        let interval = Interval {
            lo,
            hi,
            lo_open,
            hi_open,
            unit: unit.to_owned(),
        };
        Some((interval, after))
    }

    fn bound(
        &mut self,
        raw: &RawFunction,
        at: usize,
        text: &str,
        limits: Option<(f64, f64, bool)>,
    ) -> Option<Bound> {
        let at = at + (text.len() - text.trim_start().len());
        let text = text.trim();
        let (negative, word) = match text.strip_prefix('-') {
            Some(word) => (true, word),
            None => (false, text),
        };
        let signed = |x: f64| Bound::Number(if negative { -x } else { x });
        match word {
            "inf" => return Some(signed(f64::INFINITY)),
            "pi" => return Some(signed(std::f64::consts::PI)),
            _ => {}
        }
        if let Some(number) = number(word) {
            let x = if negative { -number } else { number };
            let (lo, hi, whole) = limits.unwrap_or((f64::MIN, f64::MAX, false));
            if x < lo || x > hi || (whole && x.fract() != 0.0) {
                self.fault(at, format!("{text} is no value of the parameter's type"));
                return None;
            }
            return Some(Bound::Number(x));
        }
        if word.is_empty() || !word.split('.').all(is_name) {
            self.fault(
                at,
                format!(
                    "`{text}` is no bound: a number, `inf`, `pi` or a parameter's name is expected"
                ),
            );
            return None;
        }
        if !Self::is_param(raw, word) {
            self.unknown_param(raw, at + usize::from(negative), word);
            return None;
        }
        Some(Bound::Name {
            name: word.to_owned(),
            negative,
        })
    }

    fn error(&mut self, line: Line) -> Option<ErrorBound> {
        let (value, rest) = line.split();
        let Some(value) = number(value).filter(|value| value.is_finite()) else {
            self.fault(
                line.at,
                format!("a number from 0 is expected: {FORM_ERROR}"),
            );
            return None;
        };
        let (kind, after) = rest.split();
        let kind = match kind {
            "abs" => ErrorKind::Abs,
            "rel" => ErrorKind::Rel,
            "ulp" => ErrorKind::Ulp,
            _ => {
                self.fault(
                    rest.at,
                    format!("`abs`, `rel` or `ulp` is expected: {FORM_ERROR}"),
                );
                return None;
            }
        };
        let (of, reference) = after.split();
        if of != "of" {
            self.fault(after.at, format!("`of` is expected: {FORM_ERROR}"));
            return None;
        }
        let (path, end) = reference.split();
        let mut parts = path.split("::");
        if parts.next() != Some("reference")
            || path.matches("::").count() < 2
            || !parts.all(is_name)
        {
            self.fault(
                reference.at,
                "a path `reference::TOPIC::NAME` is expected, that of the function's f64 twin",
            );
            return None;
        }
        if !end.text.is_empty() {
            self.fault(end.at, format!("more than {FORM_ERROR}"));
            return None;
        }
        Some(ErrorBound {
            value,
            kind,
            reference: path.to_owned(),
        })
    }

    fn monotone(&mut self, raw: &RawFunction, header: &mut FnHeader, line: Line) {
        let (name, end) = line.split();
        if name.is_empty() || !end.text.is_empty() {
            let at = if name.is_empty() { line.at } else { end.at };
            return self.fault(at, "the form is `monotone NAME`");
        }
        if !Self::is_param(raw, name) {
            return self.unknown_param(raw, line.at, name);
        }
        if header.monotone.iter().any(|known| known == name) {
            return self.fault(line.at, format!("a second `monotone {name}`"));
        }
        header.monotone.push(name.to_owned());
    }
}

fn is_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// A number without sign: digits, a fraction, an exponent.
fn number(text: &str) -> Option<f64> {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let (mantissa, exponent) = match text.find(['e', 'E']) {
        Some(at) => (&text[..at], Some(&text[at + 1..])),
        None => (text, None),
    };
    let (whole, fraction) = match mantissa.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let exponent = exponent.map(|e| e.strip_prefix(['+', '-']).unwrap_or(e));
    if !digits(whole)
        || fraction.is_some_and(|f| !digits(f))
        || exponent.is_some_and(|e| !digits(e))
    {
        return None;
    }
    text.parse().ok()
}
