//! The call into naga_oil, behind one type: text and values in, naga IR or located faults out.
//!
//! [`Linker::link`] is all that the rest of the composer uses, so that another linker can take its place.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ComposerError, ComposerErrorInner, ErrSource,
    ImportDefinition, NagaModuleDescriptor, ShaderDefValue,
};

use crate::diag::{Diag, Diags, line_at};
use crate::library::{LONGEST_TEXT, Library};
use crate::scan::{Kind, Scan, Token};

pub use crate::scan::{Def, Defs};

/// What is to be linked.
#[derive(Clone, Copy, Debug)]
pub struct LinkInput<'a> {
    /// WGSL with `#import`, `#ifdef` and `#{NAME}`; need not have an entry point.
    pub text: &'a str,
    /// The text's name in messages.
    pub file: &'a str,
    /// The flags that are on and the sizes. Names that the text does not use do no harm.
    pub defs: &'a Defs,
    /// Modules whose `override fn` is to take effect although no item of them is imported.
    pub plug_ins: &'a [String],
}

/// Links texts with the modules of a library; one linker serves a whole build.
pub struct Linker {
    library: Library,
    /// `None` after a panic: nobody knows what state it was in.
    composer: Option<Composer>,
    capabilities: naga::valid::Capabilities,
    added: BTreeSet<String>,
}

thread_local! {
    /// Composers that nobody uses: most of the time to make one goes into its regular expressions.
    static POOL: RefCell<Vec<Composer>> = const { RefCell::new(Vec::new()) };
}

/// A composer without modules.
fn fresh(capabilities: naga::valid::Capabilities) -> Composer {
    let mut composer = POOL.with_borrow_mut(Vec::pop).unwrap_or_default();
    composer.capabilities = capabilities;
    composer
}

impl Drop for Linker {
    fn drop(&mut self) {
        let Some(mut composer) = self.composer.take() else {
            return;
        };
        composer.module_sets.clear();
        composer.module_index.clear();
        // The thread may be ending.
        let _ = POOL.try_with(|pool| pool.borrow_mut().push(composer));
    }
}

/// The first line of what naga_oil gets is ours: WGSL directives must come before everything else.
const HEAD_LINES: usize = 1;

/// naga_oil's marks in names.
const MARK: &str = "X_naga_oil_";

impl Linker {
    /// A linker over the modules of a library, which claims no optional capability.
    pub fn new(library: &Library) -> Self {
        Self::with_capabilities(library, naga::valid::Capabilities::empty())
    }

    /// The same with capabilities that go beyond WebGPU's core.
    pub fn with_capabilities(library: &Library, capabilities: naga::valid::Capabilities) -> Self {
        Self {
            library: library.clone(),
            composer: None,
            capabilities,
            added: BTreeSet::new(),
        }
    }

    /// The modules that can be imported.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The capabilities that were claimed.
    pub fn capabilities(&self) -> naga::valid::Capabilities {
        self.capabilities
    }

    /// Links one text with what it imports. The module that results is validated, but its names still bear naga_oil's marks
    /// and nothing is stripped: [`crate::compose::finish`] does that.
    ///
    /// # Errors
    /// Every fault of the text and of the modules that it reaches, at its place in the original file.
    pub fn link(&mut self, input: &LinkInput<'_>) -> Result<naga::Module, Diags> {
        let scan = Scan::new(input.text);
        self.link_scanned(input, &scan)
    }

    /// [`Linker::link`] for a text that is already scanned.
    pub(crate) fn link_scanned(
        &mut self,
        input: &LinkInput<'_>,
        scan: &Scan,
    ) -> Result<naga::Module, Diags> {
        let mut diags = scan.diags(input.file, input.text);
        for import in scan.imports() {
            diags
                .0
                .extend(self.library.check_import(input.file, input.text, import));
        }
        if input.text.len() > LONGEST_TEXT {
            diags.push(Diag::whole_file(
                input.file,
                format!(
                    "a text of {} bytes is longer than the limit of {LONGEST_TEXT}",
                    input.text.len()
                ),
            ));
        }
        if !diags.is_empty() {
            return Err(diags);
        }
        let library = &self.library;
        let (body, mut plug_ins) = scan
            .preprocess(input.text, input.defs, &|import| library.is_plug_in(import))
            .map_err(|fault| Diag::at(input.file, input.text, fault.at, fault.message))?;
        plug_ins.extend_from_slice(input.plug_ins);
        let source = with_heads(scan, &body);

        let wanted: Vec<&str> = scan
            .imports()
            .map(|import| import.module.as_str())
            .chain(plug_ins.iter().map(String::as_str))
            .collect();
        self.add_modules(&wanted)?;

        let shader_defs: HashMap<String, ShaderDefValue> = input
            .defs
            .iter()
            .map(|(name, def)| {
                let value = match def {
                    Def::Flag => ShaderDefValue::Bool(true),
                    Def::Int(value) => ShaderDefValue::Int(*value),
                };
                (name.clone(), value)
            })
            .collect();
        let additional: Vec<ImportDefinition> = plug_ins
            .into_iter()
            .map(|import| ImportDefinition {
                import,
                items: Vec::new(),
            })
            .collect();
        let composer = self.composer();
        let outcome = crate::gate::no_panic(|| {
            composer
                .make_naga_module(NagaModuleDescriptor {
                    source: &source,
                    file_path: input.file,
                    shader_defs,
                    additional_imports: &additional,
                    ..Default::default()
                })
                .map_err(Box::new)
        });
        match outcome {
            Ok(Ok(module)) => Ok(module),
            Ok(Err(error)) => Err(self.diag(&error, Some((input, scan))).into()),
            Err(panic) => {
                self.composer = None;
                Err(panicked(input.file, &panic).into())
            }
        }
    }

    /// naga_oil's composer; a new one has none of the modules yet.
    fn composer(&mut self) -> &mut Composer {
        let (capabilities, added) = (self.capabilities, &mut self.added);
        self.composer.get_or_insert_with(|| {
            added.clear();
            fresh(capabilities)
        })
    }

    /// Adds the modules that are reached and not there yet, each after those that it imports.
    fn add_modules(&mut self, wanted: &[&str]) -> Result<(), Diags> {
        self.composer();
        let missing: Vec<String> = self
            .library
            .reached(wanted.iter().copied())
            .into_iter()
            .filter(|module| !self.added.contains(&module.path))
            .map(|module| module.path.clone())
            .collect();
        for path in missing {
            let Some(module) = self.library.get(&path) else {
                continue;
            };
            let mut diags = module.scan.diags(&module.file, &module.text);
            for import in module.scan.imports() {
                diags.0.extend(
                    self.library
                        .check_import(&module.file, &module.text, import),
                );
            }
            if !diags.is_empty() {
                return Err(diags);
            }
            let source = with_heads(&module.scan, &module.scan.without_comments(&module.text));
            let file = module.file.clone();
            let composer = self.composer();
            let outcome = crate::gate::no_panic(|| {
                composer
                    .add_composable_module(ComposableModuleDescriptor {
                        source: &source,
                        file_path: &file,
                        ..Default::default()
                    })
                    .map(|_| ())
                    .map_err(Box::new)
            });
            match outcome {
                Ok(Ok(())) => {
                    self.added.insert(path);
                }
                Ok(Err(error)) => return Err(self.diag(&error, None).into()),
                Err(panic) => {
                    self.composer = None;
                    return Err(panicked(&file, &panic).into());
                }
            }
        }
        Ok(())
    }

    /// naga_oil's error as a diagnostic at its place in the original file.
    fn diag(&self, error: &ComposerError, top: Option<(&LinkInput<'_>, &Scan)>) -> Diag {
        // An error while the top text is built names a module without a name.
        let module = match &error.source {
            ErrSource::Module { name, .. } => self.library.get(name),
            ErrSource::Constructing { path, .. } => self
                .library
                .modules()
                .find(|module| top.is_none() && module.file == *path),
        };
        let none = Scan::default();
        let (file, original, scan) = match (module, top) {
            (Some(module), _) => (module.file.as_str(), module.text.as_str(), &module.scan),
            (None, Some((input, scan))) => (input.file, input.text, scan),
            (None, None) => ("naga_oil", "", &none),
        };
        let (message, mut notes, offset) = describe(&error.inner);
        // `override fn` with another signature: naga_oil gives no place.
        if let (ComposerErrorInner::RedirectError(_), Some((input, scan))) = (&error.inner, top) {
            return self.redirect_diag(input, scan, &message);
        }
        let decorated = match &error.source {
            ErrSource::Constructing { source, .. } => source.clone(),
            ErrSource::Module { name, .. } => match &self.composer {
                Some(composer) if composer.contains_module(name) => {
                    crate::gate::no_panic(|| error.source.source(composer).into_owned())
                        .unwrap_or_default()
                }
                _ => String::new(),
            },
        };
        let said = message.to_lowercase();
        notes.retain(|note| {
            const IDLE: [&str; 4] = [
                "naga::ir::",
                "see msg",
                "unknown identifier",
                "definition of",
            ];
            !said.contains(&note.to_lowercase()) && !IDLE.iter().any(|idle| note.starts_with(idle))
        });
        let Some(offset) = offset else {
            let mut diag = Diag::whole_file(file, message);
            diag.notes = notes;
            return diag;
        };
        let offset = match offset {
            Place::Span(at) => (at & ((1 << 21) - 1)).saturating_sub(error.source.offset()),
            Place::Byte(at) => at,
        };
        let (line, column) = original_place(&decorated, offset, &scan.without_comments(original));
        let mut diag = Diag::new(file, line, column, line_at(original, line), message);
        diag.notes = notes;
        diag
    }

    fn redirect_diag(&self, input: &LinkInput<'_>, scan: &Scan, message: &str) -> Diag {
        let mut modules = vec![(input.file, input.text, scan)];
        let wanted = scan
            .imports()
            .map(|import| import.module.as_str())
            .chain(input.plug_ins.iter().map(String::as_str));
        for module in self.library.reached(wanted) {
            modules.push((&module.file, &module.text, &module.scan));
        }
        let overriding = modules.iter().find_map(|(file, text, scan)| {
            scan.items
                .iter()
                .find(|item| {
                    item.kind == crate::scan::ItemKind::OverridingFunction
                        && message.contains(&item.name)
                })
                .map(|item| Diag::at(*file, text, item.at, message))
        });
        overriding.unwrap_or_else(|| Diag::whole_file(input.file, message))
    }
}

/// A text as naga_oil wants it: one line with `enable` directives, then the rest. The other directives mean nothing to
/// naga's IR; the composer puts them before what it writes.
fn with_heads(scan: &Scan, body: &str) -> String {
    let names: BTreeSet<&str> = scan
        .heads
        .iter()
        .filter(|head| head.word == "enable")
        .flat_map(|head| head.names.iter().map(|(name, _)| name.as_str()))
        .collect();
    let mut source = String::with_capacity(body.len() + 16);
    if !names.is_empty() {
        let names: Vec<&str> = names.into_iter().collect();
        source.push_str(&format!("enable {};", names.join(", ")));
    }
    source.push('\n');
    source.push_str(body);
    source
}

/// The panic of a front end as a diagnostic.
fn panicked(file: &str, message: &str) -> Diag {
    Diag::whole_file(file, format!("the WGSL front end panicked: {message}"))
}

enum Place {
    /// A span of naga: the low 21 bits, with the header's length in it.
    Span(usize),
    /// A byte of the preprocessed text.
    Byte(usize),
}

/// Message, notes and place of an error.
fn describe(error: &ComposerErrorInner) -> (String, Vec<String>, Option<Place>) {
    use ComposerErrorInner as E;
    let plain = |text: &str| without_handles(&demangle_text(text));
    match error {
        E::WgslParseError(e) => {
            let mut labels = e.labels();
            let first = labels.next();
            let notes = first
                .iter()
                .map(|(_, note)| plain(note))
                .chain(labels.map(|(_, note)| plain(note)))
                .collect();
            let place = first.and_then(|(span, _)| span.to_range());
            (
                plain(e.message()),
                notes,
                Some(Place::Span(place.map_or(0, |range| range.start))),
            )
        }
        E::ShaderValidationError(e) | E::HeaderValidationError(e) => {
            let mut notes: Vec<String> = Vec::new();
            let mut message = plain(&e.as_inner().to_string());
            if let naga::valid::ValidationError::EntryPoint {
                source: naga::valid::EntryPointError::BindingCollision(_),
                ..
            } = e.as_inner()
            {
                message = "this variable has the group and binding of another one".into();
            }
            let mut source = std::error::Error::source(e.as_inner())
                .filter(|_| !message.starts_with("this variable"));
            while let Some(inner) = source {
                notes.push(std::mem::replace(&mut message, plain(&inner.to_string())));
                source = inner.source();
            }
            notes.reverse();
            // The last span is the innermost.
            let place = e.spans().filter_map(|(span, _)| span.to_range()).last();
            notes.extend(
                e.spans()
                    .map(|(_, note)| plain(note))
                    .filter(|n| !n.is_empty()),
            );
            (
                message,
                notes,
                Some(Place::Span(place.map_or(0, |range| range.start))),
            )
        }
        E::InvalidIdentifier { original, at } => (
            format!(
                "`{}` is not a name that a module can export: naga would rename it",
                plain(original)
            ),
            vec!["struct members must not end in a digit or `_`; no name may contain `__`".into()],
            Some(Place::Span(at.to_range().map_or(0, |range| range.start))),
        ),
        E::ImportParseError(text, at) => (plain(text), Vec::new(), Some(Place::Byte(*at))),
        E::ImportNotFound(module, at) => (
            format!("there is no module `{}`", plain(module)),
            Vec::new(),
            Some(Place::Byte(*at)),
        ),
        E::OverrideNotVirtual { name, pos } => (
            format!("`override fn {name}`: the imported function is not virtual"),
            Vec::new(),
            Some(Place::Byte(*pos)),
        ),
        E::RedirectError(error) => {
            use naga_oil::redirect::RedirectError as R;
            let message = match error {
                R::ArgumentMismatch(name, _) => format!(
                    "`override fn {}` has other parameters than the virtual function",
                    plain(name)
                ),
                R::ReturnTypeMismatch(name, _) => format!(
                    "`override fn {}` has another result than the virtual function",
                    plain(name)
                ),
                other => plain(&other.to_string()),
            };
            (message, Vec::new(), None)
        }
        E::DecorationInSource(range) => (
            "`X_naga_oil_` is reserved for the linker".into(),
            Vec::new(),
            Some(Place::Byte(range.start)),
        ),
        E::NotEnoughEndIfs(at)
        | E::TooManyEndIfs(at)
        | E::ElseWithoutCondition(at)
        | E::DefineInModule(at)
        | E::UnknownShaderDef { pos: at, .. }
        | E::UnknownShaderDefOperator { pos: at, .. }
        | E::InvalidShaderDefComparisonValue { pos: at, .. }
        | E::InvalidShaderDefDefinitionValue { pos: at, .. } => (
            plain(&error.to_string()),
            Vec::new(),
            Some(Place::Byte(*at)),
        ),
        _ => (plain(&error.to_string()), Vec::new(), None),
    }
}

/// Line and column in the original text of a byte in the text that naga_oil made of it. The lines are the same; within
/// the line the n-th token is the same, however long the linker made it.
fn original_place(decorated: &str, offset: usize, original: &str) -> (u32, u32) {
    let mut offset = offset.min(decorated.len());
    while !decorated.is_char_boundary(offset) {
        offset -= 1;
    }
    let line = decorated[..offset].matches('\n').count();
    let start = decorated[..offset].rfind('\n').map_or(0, |n| n + 1);
    let decorated_line = decorated[start..].split('\n').next().unwrap_or("");
    let within = offset - start;
    let number = (line + 1).saturating_sub(HEAD_LINES).max(1) as u32;
    let original_line = line_at(original, number);

    let before = line_tokens(decorated_line);
    let mut after = line_tokens(original_line);
    // naga_oil blanks `virtual` and `override` before `fn`.
    while let Some(i) = (0..after.len().saturating_sub(1)).find(|&i| {
        let word = |i: usize| &original_line[after[i].0..after[i].1];
        matches!(word(i), "virtual" | "override") && word(i + 1) == "fn"
    }) {
        if before.len() >= after.len() {
            break;
        }
        after.remove(i);
    }
    let column = if before.len() == after.len() {
        let i = before.partition_point(|(start, _)| *start <= within);
        match i.checked_sub(1) {
            Some(i) => {
                let into = decorated_line
                    .get(before[i].0..within)
                    .map_or(0, |text| text.chars().count());
                let (from, to) = after[i];
                let length = original_line[from..to].chars().count();
                original_line[..from].chars().count() + into.min(length)
            }
            None => within,
        }
    } else {
        // What was blanked (a comment, an inactive line) does not shift.
        decorated_line
            .get(..within)
            .map_or(0, |text| text.chars().count())
            .min(original_line.chars().count())
    };
    (number, column as u32 + 1)
}

/// The tokens of a line: paths with `::`, `#{NAME}`, numbers and single characters; comments are left out.
fn line_tokens(line: &str) -> Vec<(usize, usize)> {
    let scan = Scan::new(line);
    let mut tokens: Vec<(usize, usize)> = Vec::new();
    let mut join = false;
    let mut before: Option<&Token> = None;
    for token in &scan.tokens {
        let text = &line[token.start..token.end];
        if token.kind == Kind::Directive {
            continue;
        }
        // A size becomes one word with what it touches.
        let touches = before.is_some_and(|before| {
            before.end == token.start
                && (before.kind == Kind::Size || token.kind == Kind::Size)
                && before.kind != Kind::Punct
                && token.kind != Kind::Punct
        });
        before = Some(token);
        if text == "::" || touches || (join && token.kind == Kind::Ident) {
            if let Some(last) = tokens.last_mut() {
                last.1 = token.end;
            }
        } else {
            tokens.push((token.start, token.end));
        }
        join = text == "::";
    }
    tokens
}

/// A name without naga_oil's marks.
pub(crate) fn demangle(name: &str) -> &str {
    name.find(MARK).map_or(name, |at| &name[..at])
}

/// The module that a marked name belongs to.
pub(crate) fn module_of(name: &str) -> Option<String> {
    let at = name.rfind("X_naga_oil_mod_X")?;
    let coded = name[at + "X_naga_oil_mod_X".len()..].strip_suffix('X')?;
    base32(coded)
}

/// Decodes base 32 (RFC 4648, no padding) into text.
fn base32(coded: &str) -> Option<String> {
    let mut out = Vec::new();
    let (mut bits, mut count) = (0u32, 0);
    for byte in coded.bytes() {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'2'..=b'7' => byte - b'2' + 26,
            _ => return None,
        };
        bits = bits << 5 | u32::from(digit);
        count += 5;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    String::from_utf8(out).ok()
}

/// A message without naga_oil's marks.
pub(crate) fn demangle_text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(MARK) {
        out.push_str(&rest[..at]);
        let tail = &rest[at + MARK.len()..];
        let end = tail
            .find(|c: char| !(c == '_' || c.is_ascii_alphanumeric()))
            .unwrap_or(tail.len());
        rest = &tail[end..];
    }
    out.push_str(rest);
    out
}

/// A message of naga without the numbers of types and expressions, which nobody can look up.
fn without_handles(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(" Some([") {
        let digits = rest[at + 7..]
            .find(|c: char| !c.is_ascii_digit())
            .map_or(rest.len(), |n| at + 7 + n);
        if rest[digits..].starts_with("])") {
            out.push_str(&rest[..at]);
            rest = &rest[digits + 2..];
        } else {
            out.push_str(&rest[..at + 7]);
            rest = &rest[at + 7..];
        }
    }
    out.push_str(rest);
    out
}

/// Values by name, for callers that have no other use for them.
pub fn no_defs() -> &'static Defs {
    static NONE: Defs = BTreeMap::new();
    &NONE
}
