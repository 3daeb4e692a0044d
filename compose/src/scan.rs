//! A light scanner of WGSL with preprocessor lines: enough to lint, to find declarations and to evaluate conditions,
//! with the place of everything in the original text. Types and expressions are naga's business.

use std::collections::{BTreeMap, BTreeSet};

use crate::diag::{Diag, Diags};

/// The kind of a [`Token`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An identifier or a keyword.
    Ident,
    /// A number with its suffix.
    Number,
    /// One character of punctuation, or one of `::`, `&&`, `->`.
    Punct,
    /// `#{NAME}`.
    Size,
    /// A whole preprocessor line; the next entry of [`Scan::directives`].
    Directive,
}

/// A token of the text, by its byte range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    /// What it is.
    pub kind: Kind,
    /// First byte.
    pub start: usize,
    /// Byte after the last.
    pub end: usize,
}

/// The condition of an `#ifdef`, `#ifndef` or `#if` line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Test {
    /// `#ifdef NAME` or, negated, `#ifndef NAME`.
    Defined {
        /// The flag's name.
        name: String,
        /// Where the name stands.
        at: usize,
        /// `#ifndef`.
        negated: bool,
    },
    /// `#if NAME == 4`.
    Compare {
        /// The size's name.
        name: String,
        /// Where the name stands.
        at: usize,
        /// One of `==`, `!=`, `<`, `<=`, `>`, `>=`.
        op: &'static str,
        /// The number that it is compared with.
        value: i64,
    },
}

/// One imported item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Import {
    /// The module's path: everything before the last `::`.
    pub module: String,
    /// The item's name in its module.
    pub item: String,
    /// The name by which it is known here (`as`).
    pub local: String,
    /// Where the item's name stands.
    pub at: usize,
    /// Where the module's path starts.
    pub module_at: usize,
    /// The branches of conditions that the import stands in: number of the condition and of its branch.
    scope: Vec<(u32, u32)>,
}

impl Import {
    /// The whole path of the item.
    pub fn path(&self) -> String {
        if self.module.is_empty() {
            self.item.clone()
        } else {
            format!("{}::{}", self.module, self.item)
        }
    }

    /// Whether the two stand in different branches of one condition, so that only one of them is ever active.
    pub fn excludes(&self, other: &Import) -> bool {
        self.scope
            .iter()
            .any(|(id, branch)| other.scope.iter().any(|(i, b)| i == id && b != branch))
    }
}

/// What a preprocessor line says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DirectiveKind {
    /// `#ifdef`, `#ifndef`, `#if`, or one of them after `#else`.
    Condition {
        /// It follows an `#else` on the same line.
        is_else: bool,
        /// The condition.
        test: Test,
    },
    /// A plain `#else`.
    Else,
    /// `#endif`.
    Endif,
    /// `#import`, with the items in order.
    Import(Vec<Import>),
    /// `#define_import_path PATH`.
    ImportPath {
        /// The path.
        path: String,
        /// Where the path stands.
        at: usize,
    },
    /// A line with a fault, which stands in [`Scan::faults`].
    Faulty,
}

/// One preprocessor line (an import may span several).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Directive {
    /// The `#`.
    pub start: usize,
    /// Byte after the last.
    pub end: usize,
    /// What it says.
    pub kind: DirectiveKind,
}

/// The kind of a declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ItemKind {
    /// `fn`.
    Function,
    /// `virtual fn`.
    VirtualFunction,
    /// `override fn`: replaces an imported virtual function.
    OverridingFunction,
    /// `const`; `typed` if it states its type.
    Const {
        /// The type is stated.
        typed: bool,
    },
    /// `struct`.
    Struct,
    /// Module-scope `var`.
    Var,
    /// `override`.
    Override,
    /// `alias`.
    Alias,
}

/// A member of a struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Where the name stands.
    pub at: usize,
    /// The text of the doc comment before it.
    pub doc: String,
}

/// A declaration at module scope.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// Where the name stands.
    pub at: usize,
    /// What it is.
    pub kind: ItemKind,
    /// The names of its attributes (`vertex`, `group`, ...).
    pub attributes: Vec<String>,
    /// The members, of a struct.
    pub members: Vec<Member>,
    /// The text of the doc comment before it.
    pub doc: String,
}

/// A WGSL directive at the head of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// `enable`, `requires` or `diagnostic`.
    pub word: &'static str,
    /// The whole directive with its semicolon.
    pub text: String,
    /// The names that it lists: extensions, or severity and rule.
    pub names: Vec<(String, usize)>,
    /// First byte.
    pub start: usize,
    /// Byte after the semicolon.
    pub end: usize,
    /// It stands in a branch of a condition.
    pub conditional: bool,
}

/// A fault of the text itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Where.
    pub at: usize,
    /// What.
    pub message: String,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Everything that one pass over a text finds.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// The tokens outside comments.
    pub tokens: Vec<Token>,
    /// The byte ranges of the comments.
    pub comments: Vec<(usize, usize)>,
    /// The preprocessor lines.
    pub directives: Vec<Directive>,
    /// The declarations at module scope, of all branches.
    pub items: Vec<Item>,
    /// `enable`, `requires` and `diagnostic` directives.
    pub heads: Vec<Head>,
    /// Faults, in the order of the text.
    pub faults: Vec<Fault>,
}

/// The value of a name in conditions and in `#{NAME}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Def {
    /// A flag that is on. A flag that is off is absent.
    Flag,
    /// A size.
    Int(i32),
}

/// Values by name.
pub type Defs = BTreeMap<String, Def>;

impl Scan {
    /// Scans a text; whatever it is, the result describes it.
    pub fn new(text: &str) -> Self {
        let mut scan = Self::default();
        scan.tokenize(text);
        scan.nesting();
        scan.find_items(text);
        scan.faults.sort_by_key(|fault| fault.at);
        scan
    }

    /// The text's faults as diagnostics.
    pub fn diags(&self, file: &str, text: &str) -> Diags {
        Diags(
            self.faults
                .iter()
                .map(|fault| {
                    let mut diag = Diag::at(file, text, fault.at, fault.message.clone());
                    diag.notes.clone_from(&fault.notes);
                    diag
                })
                .collect(),
        )
    }

    /// The imported items, in order.
    pub fn imports(&self) -> impl Iterator<Item = &Import> {
        self.directives
            .iter()
            .flat_map(|directive| match &directive.kind {
                DirectiveKind::Import(imports) => imports.as_slice(),
                _ => &[],
            })
    }

    /// The path that the text gives itself as a module, and where.
    pub fn import_path(&self) -> Option<(&str, usize)> {
        self.directives
            .iter()
            .find_map(|directive| match &directive.kind {
                DirectiveKind::ImportPath { path, at } => Some((path.as_str(), *at)),
                _ => None,
            })
    }

    /// The names in conditions, with their places; `true` for flags (`#ifdef`), `false` for sizes (`#if`).
    pub fn conditions(&self) -> impl Iterator<Item = (&str, usize, bool)> {
        self.directives
            .iter()
            .filter_map(|directive| match &directive.kind {
                DirectiveKind::Condition { test, .. } => Some(match test {
                    Test::Defined { name, at, .. } => (name.as_str(), *at, true),
                    Test::Compare { name, at, .. } => (name.as_str(), *at, false),
                }),
                _ => None,
            })
    }

    /// The names in `#{NAME}`, with their places.
    pub fn sizes<'a>(&'a self, text: &'a str) -> impl Iterator<Item = (&'a str, usize)> {
        self.tokens
            .iter()
            .filter(|token| token.kind == Kind::Size)
            .map(|token| (size_name(&text[token.start..token.end]), token.start))
    }

    /// Every name that decides what the text becomes: flags and sizes.
    pub fn mentioned(&self, text: &str) -> BTreeSet<String> {
        self.conditions()
            .map(|(name, ..)| name)
            .chain(self.sizes(text).map(|(name, _)| name))
            .map(str::to_owned)
            .collect()
    }

    fn fault(&mut self, at: usize, message: impl Into<String>) -> &mut Fault {
        let at_end = self.faults.len();
        self.faults.push(Fault {
            at,
            message: message.into(),
            notes: Vec::new(),
        });
        &mut self.faults[at_end]
    }

    fn tokenize(&mut self, text: &str) {
        let bytes = text.as_bytes();
        let mut at = 0;
        // Nothing but blanks and comments so far on this line.
        let mut line_start = true;
        let mut quoted = false;
        while at < bytes.len() {
            let byte = bytes[at];
            if byte == b'\n' || byte == b'\r' {
                line_start = true;
                at += 1;
            } else if byte.is_ascii_whitespace() {
                at += 1;
            } else if let Some(end) = comment(text, at) {
                if byte == b'/'
                    && bytes[at + 1] == b'*'
                    && (end < at + 4 || &bytes[end - 2..end] != b"*/")
                {
                    self.fault(at, "this comment is never closed");
                }
                self.comments.push((at, end));
                if text[at..end].contains(['\n', '\r']) {
                    line_start = true;
                }
                at = end;
            } else if byte == b'#' {
                if let Some(end) = size_end(text, at) {
                    self.push(Kind::Size, at, end);
                    at = end;
                } else if line_start {
                    at = self.directive(text, at);
                } else {
                    self.fault(
                        at,
                        "`#` within a line: a size is written `#{NAME}`, a directive stands on a line of its own",
                    );
                    at += 1;
                }
                line_start = false;
            } else {
                line_start = false;
                let Some(c) = text[at..].chars().next() else {
                    break;
                };
                let end = if c == '_' || c.is_alphabetic() {
                    let end = ident_end(text, at);
                    self.push(Kind::Ident, at, end);
                    end
                } else if byte.is_ascii_digit()
                    || (byte == b'.' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit))
                {
                    let end = number_end(text, at);
                    self.push(Kind::Number, at, end);
                    end
                } else {
                    // The one that closes needs no report of its own.
                    if byte == b'"' {
                        quoted = !quoted;
                    }
                    if byte == b'"' && quoted {
                        self.fault(at, "a quotation mark is not WGSL");
                    }
                    let end = match &bytes[at..(at + 2).min(bytes.len())] {
                        b"::" | b"&&" | b"->" => at + 2,
                        _ => at + c.len_utf8(),
                    };
                    self.push(Kind::Punct, at, end);
                    end
                };
                at = end;
            }
        }
    }

    fn push(&mut self, kind: Kind, start: usize, end: usize) {
        self.tokens.push(Token { kind, start, end });
    }

    /// Reads the preprocessor line whose `#` is at `start`; the byte after it.
    fn directive(&mut self, text: &str, start: usize) -> usize {
        // The words of the line, comments skipped; an import goes on while a brace is open.
        let bytes = text.as_bytes();
        let mut words: Vec<(&str, usize)> = Vec::new();
        let mut at = start + 1;
        let mut end = start + 1;
        let mut open = 0i32;
        while at < bytes.len() {
            let byte = bytes[at];
            if byte == b'\n' || byte == b'\r' {
                let import = words.first().is_some_and(|(word, _)| *word == "import");
                if !(import && open > 0) {
                    break;
                }
                at += 1;
            } else if byte.is_ascii_whitespace() {
                at += 1;
            } else if let Some(comment_end) = comment(text, at) {
                if text[at..comment_end].contains(['\n', '\r']) && open == 0 {
                    break;
                }
                self.comments.push((at, comment_end));
                at = comment_end;
            } else {
                let Some(c) = text[at..].chars().next() else {
                    break;
                };
                let word_end = if c == '_' || c.is_alphabetic() {
                    ident_end(text, at)
                } else if byte.is_ascii_digit() {
                    number_end(text, at)
                } else {
                    match &bytes[at..(at + 2).min(bytes.len())] {
                        b"::" | b"&&" | b"||" | b"==" | b"!=" | b"<=" | b">=" => at + 2,
                        _ => at + c.len_utf8(),
                    }
                };
                match c {
                    '{' => open += 1,
                    '}' => open -= 1,
                    _ => {}
                }
                words.push((&text[at..word_end], at));
                at = word_end;
                end = word_end;
            }
        }
        let kind = self.directive_kind(start, &words);
        self.directives.push(Directive { start, end, kind });
        self.push(Kind::Directive, start, end);
        end
    }

    fn directive_kind(&mut self, start: usize, words: &[(&str, usize)]) -> DirectiveKind {
        let Some(&(word, word_at)) = words.first() else {
            self.fault(start, "`#` without a directive");
            return DirectiveKind::Faulty;
        };
        match word {
            "ifdef" | "ifndef" | "if" => self.condition(false, words),
            "else" => match words.get(1) {
                None => DirectiveKind::Else,
                Some(("ifdef" | "ifndef" | "if", _)) => self.condition(true, &words[1..]),
                Some(&(tail, at)) => {
                    self.fault(at, format!("unexpected `{tail}` after `#else`"));
                    DirectiveKind::Else
                }
            },
            "endif" => {
                if let Some(&(tail, at)) = words.get(1) {
                    self.fault(at, format!("unexpected `{tail}` after `#endif`"));
                }
                DirectiveKind::Endif
            }
            "import" => match parse_imports(&words[1..], start) {
                Ok(imports) => DirectiveKind::Import(imports),
                Err((at, message)) => {
                    self.fault(at, message);
                    DirectiveKind::Faulty
                }
            },
            "define_import_path" => {
                let mut path = String::new();
                let mut wants_name = true;
                for &(word, at) in &words[1..] {
                    let is_name = word.starts_with(|c: char| c == '_' || c.is_alphabetic());
                    if is_name != wants_name || (!is_name && word != "::") {
                        self.fault(
                            at,
                            "a module's path is names joined by `::`, for instance `veduta::noise::value`",
                        );
                        return DirectiveKind::Faulty;
                    }
                    path.push_str(word);
                    wants_name = !wants_name;
                }
                if wants_name {
                    self.fault(start, "`#define_import_path` without a path");
                    return DirectiveKind::Faulty;
                }
                DirectiveKind::ImportPath {
                    path,
                    at: words[1].1,
                }
            }
            "define" => {
                self.fault(start, "`#define` is not allowed")
                    .notes
                    .push("flags and sizes are declared in `keys.ron`; any other number is a `const` with its type".into());
                DirectiveKind::Faulty
            }
            "elif" | "elseif" | "elifdef" | "elifndef" => {
                self.fault(start, format!("unknown directive `#{word}`"))
                    .notes
                    .push(
                        "write `#else ifdef NAME`, `#else ifndef NAME` or `#else if NAME == 2`"
                            .into(),
                    );
                DirectiveKind::Faulty
            }
            _ => {
                const KNOWN: [&str; 7] = [
                    "ifdef",
                    "ifndef",
                    "if",
                    "else",
                    "endif",
                    "import",
                    "define_import_path",
                ];
                let near = crate::diag::nearest(word, KNOWN);
                let fault = self.fault(word_at.min(start), format!("unknown directive `#{word}`"));
                if let Some(near) = near {
                    fault.notes.push(format!("did you mean `#{near}`?"));
                } else {
                    fault.notes.push(
                        "known are `#ifdef`, `#ifndef`, `#if`, `#else`, `#endif`, `#import` and `#define_import_path`"
                            .into(),
                    );
                }
                DirectiveKind::Faulty
            }
        }
    }

    /// `words` starts with `ifdef`, `ifndef` or `if`.
    fn condition(&mut self, is_else: bool, words: &[(&str, usize)]) -> DirectiveKind {
        let (word, word_at) = words[0];
        let after = |(word, at): (&str, usize)| at + word.len();
        // A condition that cannot be read still opens a block, so that its `#endif` is not a second fault.
        let unreadable = |name: &str, at: usize| DirectiveKind::Condition {
            is_else,
            test: Test::Defined {
                name: name.to_owned(),
                at,
                negated: false,
            },
        };
        let Some(&(name, at)) = words.get(1) else {
            self.fault(after(words[0]), format!("`#{word}` without a name"));
            return unreadable("", word_at);
        };
        if !is_ident(name) {
            self.fault(
                at,
                format!("`#{word}` expects a name, which `{name}` is not"),
            );
            return unreadable("", at);
        }
        let test = if word == "if" {
            let op = match words.get(2).map(|w| w.0) {
                Some("==") => "==",
                Some("!=") => "!=",
                Some("<=") => "<=",
                Some(">=") => ">=",
                Some("<") => "<",
                Some(">") => ">",
                _ => {
                    self.fault(at, format!("`#if {name}` compares with nothing"))
                        .notes
                        .push(format!(
                            "a flag is tested by `#ifdef {name}`, a size by `#if {name} == 2`"
                        ));
                    return unreadable("", at);
                }
            };
            let (negative, number) = match (words.get(3), words.get(4)) {
                (Some(("-", _)), Some(number)) => (true, Some(*number)),
                (number, _) => (false, number.copied()),
            };
            let Some((number, number_at)) = number else {
                self.fault(
                    after(words[2]),
                    format!("`#if {name} {op}` expects a whole number"),
                );
                return unreadable("", at);
            };
            let digits = number.trim_end_matches(['u', 'i']);
            let Ok(value) = digits.parse::<i64>() else {
                self.fault(
                    number_at,
                    format!("`#if {name} {op}` expects a whole number, which `{number}` is not"),
                );
                return unreadable("", at);
            };
            let rest = if negative { 5 } else { 4 };
            self.no_tail(words, rest);
            Test::Compare {
                name: name.to_owned(),
                at,
                op,
                value: if negative { -value } else { value },
            }
        } else {
            self.no_tail(words, 2);
            Test::Defined {
                name: name.to_owned(),
                at,
                negated: word == "ifndef",
            }
        };
        DirectiveKind::Condition { is_else, test }
    }

    /// A fault if the line goes on after its condition.
    fn no_tail(&mut self, words: &[(&str, usize)], from: usize) {
        if let Some(&(tail, at)) = words.get(from) {
            let fault = self.fault(at, format!("unexpected `{tail}` after the condition"));
            if tail == "&&" || tail == "||" {
                fault.notes.push(
                    "a condition is a single test: nest `#ifdef` lines for `&&`, use `#else ifdef` for `||`".into(),
                );
            }
        }
    }

    /// Checks how conditions nest and records in which branches the imports stand.
    fn nesting(&mut self) {
        struct Open {
            at: usize,
            id: u32,
            branch: u32,
            else_at: Option<usize>,
        }
        let mut stack: Vec<Open> = Vec::new();
        let mut next_id = 0;
        let mut has_path = false;
        let mut faults = Vec::new();
        let mut fault = |at: usize, message: &str| {
            faults.push(Fault {
                at,
                message: message.to_owned(),
                notes: Vec::new(),
            });
        };
        for directive in &mut self.directives {
            match &mut directive.kind {
                DirectiveKind::Condition { is_else: false, .. } => {
                    stack.push(Open {
                        at: directive.start,
                        id: next_id,
                        branch: 0,
                        else_at: None,
                    });
                    next_id += 1;
                }
                DirectiveKind::Condition { is_else: true, .. } => match stack.last_mut() {
                    None => fault(directive.start, "`#else` without a condition before it"),
                    Some(open) => {
                        if open.else_at.is_some() {
                            fault(directive.start, "a branch after the last `#else`");
                        }
                        open.branch += 1;
                    }
                },
                DirectiveKind::Else => match stack.last_mut() {
                    None => fault(directive.start, "`#else` without a condition before it"),
                    Some(open) => {
                        if open.else_at.is_some() {
                            fault(directive.start, "a second `#else` for the same condition");
                        }
                        open.else_at = Some(directive.start);
                        open.branch += 1;
                    }
                },
                DirectiveKind::Endif => {
                    if stack.pop().is_none() {
                        fault(directive.start, "`#endif` without a condition before it");
                    }
                }
                DirectiveKind::Import(imports) => {
                    for import in imports {
                        import.scope = stack.iter().map(|open| (open.id, open.branch)).collect();
                    }
                }
                DirectiveKind::ImportPath { at, .. } => {
                    if has_path {
                        fault(*at, "a second `#define_import_path` in one file");
                    } else if !stack.is_empty() {
                        fault(*at, "`#define_import_path` must not depend on a condition");
                    }
                    has_path = true;
                }
                DirectiveKind::Faulty => {}
            }
        }
        for open in stack {
            fault(open.at, "this condition is never closed by `#endif`");
        }
        self.faults.append(&mut faults);
    }

    /// Finds declarations at module scope and head directives.
    fn find_items(&mut self, text: &str) {
        let word = |i: usize| -> &str {
            self.tokens
                .get(i)
                .map_or("", |token| &text[token.start..token.end])
        };
        let mut items: Vec<Item> = Vec::new();
        let mut heads: Vec<Head> = Vec::new();
        let mut attributes: Vec<String> = Vec::new();
        let mut depth = 0usize;
        // Depths at the open conditions: each branch starts where the first did.
        let mut depths: Vec<usize> = Vec::new();
        let mut directive = 0;
        let mut doc_from = 0;
        let mut i = 0;
        while i < self.tokens.len() {
            let token = self.tokens[i];
            if token.kind == Kind::Directive {
                match self.directives.get(directive).map(|d| &d.kind) {
                    Some(DirectiveKind::Condition { is_else: false, .. }) => depths.push(depth),
                    Some(DirectiveKind::Else | DirectiveKind::Condition { is_else: true, .. }) => {
                        depth = depths.last().copied().unwrap_or(depth)
                    }
                    Some(DirectiveKind::Endif) => {
                        depths.pop();
                    }
                    _ => {}
                }
                directive += 1;
                doc_from = token.end;
                i += 1;
                continue;
            }
            let here = word(i);
            match here {
                "{" => depth += 1,
                "}" => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth > 0 || here == "}" || here == ";" {
                if depth == 0 {
                    attributes.clear();
                    doc_from = token.end;
                }
                i += 1;
                continue;
            }
            if here == "@" {
                attributes.push(word(i + 1).to_owned());
                i += 2;
                if word(i) == "(" {
                    i = self.skip_group(text, i, "(", ")");
                }
                continue;
            }
            if token.kind != Kind::Ident {
                i += 1;
                continue;
            }
            if let Some(head) = ["enable", "requires", "diagnostic"]
                .into_iter()
                .find(|w| *w == here)
            {
                let mut names = Vec::new();
                let mut j = i + 1;
                while j < self.tokens.len() && word(j) != ";" {
                    if self.tokens[j].kind == Kind::Directive || word(j) == "{" {
                        break;
                    }
                    if self.tokens[j].kind == Kind::Ident {
                        names.push((word(j).to_owned(), self.tokens[j].start));
                    }
                    j += 1;
                }
                if word(j) == ";" {
                    let end = self.tokens[j].end;
                    heads.push(Head {
                        word: head,
                        text: text[token.start..end].to_owned(),
                        names,
                        start: token.start,
                        end,
                        conditional: !depths.is_empty(),
                    });
                    doc_from = end;
                    i = j + 1;
                    continue;
                }
            }
            // (kind, index of the name)
            let found = match here {
                "fn" => Some((ItemKind::Function, i + 1)),
                "virtual" if word(i + 1) == "fn" => Some((ItemKind::VirtualFunction, i + 2)),
                "override" if word(i + 1) == "fn" => Some((ItemKind::OverridingFunction, i + 2)),
                "override" => Some((ItemKind::Override, i + 1)),
                "struct" => Some((ItemKind::Struct, i + 1)),
                "alias" => Some((ItemKind::Alias, i + 1)),
                "const" => Some((
                    ItemKind::Const {
                        typed: word(i + 2) == ":",
                    },
                    i + 1,
                )),
                "var" => {
                    let mut j = i + 1;
                    if word(j) == "<" {
                        while j < self.tokens.len() && !matches!(word(j), ">" | ";" | "{") {
                            j += 1;
                        }
                        j += 1;
                    }
                    Some((ItemKind::Var, j))
                }
                _ => None,
            };
            let Some((kind, name)) = found.filter(|(_, n)| {
                self.tokens
                    .get(*n)
                    .is_some_and(|token| token.kind == Kind::Ident)
            }) else {
                i += 1;
                continue;
            };
            let members = if kind == ItemKind::Struct {
                self.members(text, name + 1)
            } else {
                Vec::new()
            };
            items.push(Item {
                name: word(name).to_owned(),
                at: self.tokens[name].start,
                kind,
                attributes: std::mem::take(&mut attributes),
                members,
                doc: self.doc(text, doc_from, token.start),
            });
            i = name + 1;
        }
        self.items = items;
        self.heads = heads;
    }

    /// The members of the struct whose `{` is token `open`.
    fn members(&self, text: &str, open: usize) -> Vec<Member> {
        let word = |i: usize| -> &str {
            self.tokens
                .get(i)
                .map_or("", |token| &text[token.start..token.end])
        };
        let mut members = Vec::new();
        if word(open) != "{" {
            return members;
        }
        let mut doc_from = self.tokens[open].end;
        let mut i = open + 1;
        while i < self.tokens.len() && word(i) != "}" {
            if word(i) == "@" {
                i += 2;
                if word(i) == "(" {
                    i = self.skip_group(text, i, "(", ")");
                }
                continue;
            }
            if self.tokens[i].kind == Kind::Ident && word(i + 1) == ":" {
                members.push(Member {
                    name: word(i).to_owned(),
                    at: self.tokens[i].start,
                    doc: self.doc(text, doc_from, self.tokens[i].start),
                });
                // The type, up to the comma that is in no bracket.
                let mut nested = 0i32;
                i += 2;
                while i < self.tokens.len() {
                    match word(i) {
                        "<" | "(" => nested += 1,
                        ">" | ")" => nested -= 1,
                        "," if nested <= 0 => break,
                        "}" => break,
                        _ => {}
                    }
                    i += 1;
                }
                if word(i) == "," {
                    doc_from = self.tokens[i].end;
                    i += 1;
                }
                continue;
            }
            i += 1;
        }
        members
    }

    /// The token after the group that opens at token `i`.
    fn skip_group(&self, text: &str, mut i: usize, open: &str, close: &str) -> usize {
        let mut depth = 0i32;
        while let Some(token) = self.tokens.get(i) {
            let word = &text[token.start..token.end];
            if word == open {
                depth += 1;
            } else if word == close {
                depth -= 1;
                if depth == 0 {
                    return i + 1;
                }
            }
            i += 1;
        }
        i
    }

    /// The text of the `///` comments between two places, one line each.
    fn doc(&self, text: &str, from: usize, to: usize) -> String {
        let first = self.comments.partition_point(|(start, _)| *start < from);
        self.comments[first..]
            .iter()
            .take_while(|(_, end)| *end <= to)
            .filter_map(|(start, end)| text[*start..*end].strip_prefix("///"))
            .map(str::trim)
            .collect::<Vec<_>>()
            .join("\n")
    }

    /// The text with its comments and WGSL directives blanked and its line breaks made `\n`: same lines, same columns.
    pub fn without_comments(&self, text: &str) -> String {
        let mut out = String::with_capacity(text.len() + 1);
        let mut at = 0;
        let mut blanks: Vec<(usize, usize)> = self.comments.clone();
        blanks.extend(self.heads.iter().map(|head| (head.start, head.end)));
        blanks.sort_unstable();
        for (start, end) in blanks {
            if start < at {
                continue;
            }
            out.push_str(&text[at..start]);
            for c in text[start..end].chars() {
                out.push(if c == '\n' || c == '\r' { c } else { ' ' });
            }
            at = end;
        }
        out.push_str(&text[at..]);
        let mut out = out.replace("\r\n", "\n").replace('\r', "\n");
        if !out.ends_with('\n') {
            out.push('\n');
        }
        out
    }

    /// The text for a given set of values: comments, conditions and what is switched off blanked, sizes inserted, WGSL
    /// directives blanked. The lines stay; a size may shift the columns after it. Imports for which `is_plug_in` holds are
    /// blanked too, and those that are active are returned by their paths.
    ///
    /// # Errors
    /// A size without a value, in an active place.
    pub fn preprocess(
        &self,
        text: &str,
        defs: &Defs,
        is_plug_in: &dyn Fn(&Import) -> bool,
    ) -> Result<(String, Vec<String>), Fault> {
        let mut plug_ins = Vec::new();
        // Ranges to blank or to replace, in the order of the text.
        let mut edits: Vec<(usize, usize, Option<String>)> = self
            .comments
            .iter()
            .chain(
                self.heads
                    .iter()
                    .map(|head| (head.start, head.end))
                    .collect::<Vec<_>>()
                    .iter(),
            )
            .map(|&(start, end)| (start, end, None))
            .collect();
        // Per open condition: (this branch is active, some branch was taken, the surroundings are active).
        let mut stack: Vec<(bool, bool, bool)> = Vec::new();
        let mut inactive_from: Option<usize> = None;
        let mut inactive: Vec<(usize, usize)> = Vec::new();
        for directive in &self.directives {
            let outer = stack.last().is_none_or(|s| s.0);
            match &directive.kind {
                DirectiveKind::Condition { is_else, test } => {
                    let holds = test.holds(defs);
                    if *is_else {
                        if let Some((active, taken, outer)) = stack.last_mut() {
                            *active = *outer && !*taken && holds;
                            *taken |= holds;
                        }
                    } else {
                        stack.push((outer && holds, holds, outer));
                    }
                    edits.push((directive.start, directive.end, None));
                }
                DirectiveKind::Else => {
                    if let Some((active, taken, outer)) = stack.last_mut() {
                        *active = *outer && !*taken;
                        *taken = true;
                    }
                    edits.push((directive.start, directive.end, None));
                }
                DirectiveKind::Endif => {
                    stack.pop();
                    edits.push((directive.start, directive.end, None));
                }
                DirectiveKind::Import(imports) => {
                    if imports.iter().any(is_plug_in) {
                        edits.push((directive.start, directive.end, None));
                        if outer {
                            plug_ins.extend(imports.iter().map(Import::path));
                        }
                    }
                }
                DirectiveKind::ImportPath { .. } | DirectiveKind::Faulty => {
                    edits.push((directive.start, directive.end, None));
                }
            }
            let active = stack.last().is_none_or(|s| s.0);
            match (active, inactive_from) {
                (false, None) => inactive_from = Some(directive.end),
                (true, Some(from)) => {
                    inactive.push((from, directive.start));
                    inactive_from = None;
                }
                _ => {}
            }
        }
        if let Some(from) = inactive_from {
            inactive.push((from, text.len()));
        }
        let is_inactive = |at: usize| {
            let i = inactive.partition_point(|(start, _)| *start <= at);
            i > 0 && at < inactive[i - 1].1
        };
        for token in self.tokens.iter().filter(|t| t.kind == Kind::Size) {
            if is_inactive(token.start) {
                continue;
            }
            let name = size_name(&text[token.start..token.end]);
            match defs.get(name) {
                Some(Def::Int(value)) => {
                    edits.push((token.start, token.end, Some(value.to_string())));
                }
                other => {
                    return Err(Fault {
                        at: token.start,
                        message: match other {
                            None => format!("`#{{{name}}}` has no value"),
                            Some(_) => format!("`#{{{name}}}` is a flag, not a size"),
                        },
                        notes: Vec::new(),
                    });
                }
            }
        }
        edits.retain(|(start, ..)| !is_inactive(*start));
        edits.extend(
            inactive
                .iter()
                .filter(|(from, to)| from < to)
                .map(|&(from, to)| (from, to, None)),
        );
        edits.sort_by_key(|(start, end, _)| (*start, *end));
        let mut out = String::with_capacity(text.len() + 1);
        let mut at = 0;
        for (start, end, with) in edits {
            // A comment inside a directive's range was blanked with it.
            if start < at {
                continue;
            }
            out.push_str(&text[at..start]);
            match with {
                Some(with) => out.push_str(&with),
                None => {
                    for c in text[start..end].chars() {
                        out.push(if c == '\n' || c == '\r' { c } else { ' ' });
                    }
                }
            }
            at = end;
        }
        out.push_str(&text[at..]);
        let mut out = out.replace("\r\n", "\n").replace('\r', "\n");
        if !out.ends_with('\n') {
            out.push('\n');
        }
        Ok((out, plug_ins))
    }
}

impl Test {
    /// Whether the condition holds; a size without a value compares false.
    pub fn holds(&self, defs: &Defs) -> bool {
        match self {
            Self::Defined { name, negated, .. } => defs.contains_key(name) != *negated,
            Self::Compare {
                name, op, value, ..
            } => {
                let Some(Def::Int(have)) = defs.get(name) else {
                    return false;
                };
                let have = i64::from(*have);
                match *op {
                    "==" => have == *value,
                    "!=" => have != *value,
                    "<" => have < *value,
                    "<=" => have <= *value,
                    ">" => have > *value,
                    _ => have >= *value,
                }
            }
        }
    }
}

/// The name in `#{NAME}`.
fn size_name(token: &str) -> &str {
    token
        .trim_start_matches("#{")
        .trim_end_matches('}')
        .trim_matches([' ', '\t'])
}

/// The end of `#{NAME}` at `at`, if it is one.
fn size_end(text: &str, at: usize) -> Option<usize> {
    let rest = text[at..].strip_prefix("#{")?;
    let close = rest.find('}')?;
    is_ident(rest[..close].trim_matches([' ', '\t'])).then_some(at + 2 + close + 1)
}

/// Whether a word is an identifier.
pub fn is_ident(word: &str) -> bool {
    let mut chars = word.chars();
    chars.next().is_some_and(|c| c == '_' || c.is_alphabetic())
        && chars.all(|c| c == '_' || c.is_alphanumeric())
}

fn ident_end(text: &str, at: usize) -> usize {
    text[at..]
        .find(|c: char| !(c == '_' || c.is_alphanumeric()))
        .map_or(text.len(), |n| at + n)
}

fn number_end(text: &str, at: usize) -> usize {
    let bytes = text.as_bytes();
    let hex = matches!(bytes.get(at + 1), Some(b'x' | b'X'));
    let mut end = at + 1;
    while end < bytes.len() {
        let byte = bytes[end];
        let before = bytes[end - 1];
        let exponent = if hex {
            matches!(before, b'p' | b'P')
        } else {
            matches!(before, b'e' | b'E')
        };
        if byte.is_ascii_alphanumeric()
            || byte == b'.'
            || byte == b'_'
            || (exponent && matches!(byte, b'+' | b'-'))
        {
            end += 1;
        } else {
            break;
        }
    }
    end
}

/// The end of the comment that starts at `at`, if one does. Block comments nest; an unclosed one reaches to the end.
fn comment(text: &str, at: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    match bytes.get(at..at + 2)? {
        b"//" => Some(text[at..].find(['\n', '\r']).map_or(text.len(), |n| at + n)),
        b"/*" => {
            let mut depth = 1;
            let mut i = at + 2;
            while i < bytes.len() {
                match bytes.get(i..i + 2) {
                    Some(b"/*") => {
                        depth += 1;
                        i += 2;
                    }
                    Some(b"*/") => {
                        depth -= 1;
                        i += 2;
                        if depth == 0 {
                            return Some(i);
                        }
                    }
                    _ => i += 1,
                }
            }
            Some(bytes.len())
        }
        _ => None,
    }
}

/// Reads the words after `#import`.
fn parse_imports(words: &[(&str, usize)], start: usize) -> Result<Vec<Import>, (usize, String)> {
    let mut words = words;
    if let Some((&(";", _), rest)) = words.split_last() {
        words = rest;
    }
    let mut imports = Vec::new();
    let mut i = 0;
    import_tree(words, &mut i, start, &[], 0, &mut imports)?;
    if let Some(&(word, at)) = words.get(i) {
        return Err((at, format!("unexpected `{word}` after the import")));
    }
    Ok(imports)
}

const IMPORT_DEPTH: usize = 16;

fn import_tree(
    words: &[(&str, usize)],
    i: &mut usize,
    start: usize,
    prefix: &[(&str, usize)],
    depth: usize,
    out: &mut Vec<Import>,
) -> Result<(), (usize, String)> {
    let end = words.last().map_or(start, |(word, at)| at + word.len());
    let place = |i: usize| words.get(i).map_or(end, |(_, at)| *at);
    if depth > IMPORT_DEPTH {
        return Err((place(*i), "an import with too many nested braces".into()));
    }
    let mut path: Vec<(&str, usize)> = prefix.to_vec();
    loop {
        match words.get(*i) {
            Some(&(word, at)) if is_ident(word) => {
                path.push((word, at));
                *i += 1;
            }
            Some(&("*", at)) => {
                return Err((
                    at,
                    "importing everything by `*` is not supported: name the items".into(),
                ));
            }
            Some(&(word, at)) => {
                return Err((
                    at,
                    format!("an import expects a name, which `{word}` is not"),
                ));
            }
            None => return Err((end, "an import without an item".into())),
        }
        if words.get(*i).map(|w| w.0) != Some("::") {
            break;
        }
        *i += 1;
        if words.get(*i).map(|w| w.0) == Some("{") {
            let open = place(*i);
            *i += 1;
            let mut any = false;
            loop {
                match words.get(*i) {
                    Some(("}", _)) => {
                        *i += 1;
                        break;
                    }
                    None => return Err((open, "this brace of the import is never closed".into())),
                    Some(_) => {}
                }
                import_tree(words, i, start, &path, depth + 1, out)?;
                any = true;
                match words.get(*i) {
                    Some((",", _)) => *i += 1,
                    Some(("}", _)) => {}
                    Some(&(word, at)) => {
                        return Err((
                            at,
                            format!("expected `,` or `}}` in the import, found `{word}`"),
                        ));
                    }
                    None => return Err((open, "this brace of the import is never closed".into())),
                }
            }
            if !any {
                return Err((open, "an import without an item".into()));
            }
            return Ok(());
        }
    }
    let Some((&(item, at), module)) = path.split_last() else {
        return Err((end, "an import without an item".into()));
    };
    let mut local = item;
    if words.get(*i).map(|w| w.0) == Some("as") {
        *i += 1;
        match words.get(*i) {
            Some(&(word, _)) if is_ident(word) => {
                local = word;
                *i += 1;
            }
            _ => return Err((place(*i), "`as` without a name".into())),
        }
    }
    out.push(Import {
        module: module
            .iter()
            .map(|(word, _)| *word)
            .collect::<Vec<_>>()
            .join("::"),
        item: item.to_owned(),
        local: local.to_owned(),
        at,
        module_at: module.first().map_or(at, |(_, at)| *at),
        scope: Vec::new(),
    });
    Ok(())
}
