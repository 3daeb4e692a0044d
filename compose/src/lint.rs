//! What naga_oil accepts in silence or rejects in riddles, as located faults.

use std::collections::{BTreeMap, BTreeSet};

use naga::valid::Capabilities;

use crate::diag::{Diag, Diags, nearest};
use crate::library::{Library, Module};
use crate::link::{LinkInput, Linker};
use crate::scan::{Def, Defs, Fault, Item, ItemKind, Kind, Scan};

/// The one module that may declare `virtual` functions: the terrain's height is the one plug-in.
pub const VIRTUAL_MODULES: [&str; 1] = ["veduta::terrain::height"];

/// The names that texts may test and insert.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Declared {
    /// Flags, for `#ifdef`.
    pub flags: BTreeSet<String>,
    /// Sizes, for `#{NAME}` and `#if NAME == 2`.
    pub sizes: BTreeSet<String>,
}

/// What kind of text is linted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Text<'a> {
    /// A module, with its path.
    Module(&'a str),
    /// A stage of a program.
    Stage,
}

fn fault(at: usize, message: impl Into<String>) -> Fault {
    Fault {
        at,
        message: message.into(),
        notes: Vec::new(),
    }
}

fn note(mut fault: Fault, note: impl Into<String>) -> Fault {
    fault.notes.push(note.into());
    fault
}

/// Lints one text; the scanner's own faults are not repeated.
pub fn lint(
    what: Text<'_>,
    text: &str,
    scan: &Scan,
    library: &Library,
    declared: &Declared,
    capabilities: Capabilities,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    names_in_conditions(what, text, scan, declared, &mut faults);
    imports(text, scan, library, &mut faults);
    heads(what, scan, capabilities, &mut faults);
    items(what, scan, &mut faults);
    tokens(text, scan, &mut faults);
    faults.sort_by_key(|fault| fault.at);
    faults.dedup();
    faults
}

fn names_in_conditions(
    what: Text<'_>,
    text: &str,
    scan: &Scan,
    declared: &Declared,
    faults: &mut Vec<Fault>,
) {
    let in_module = matches!(what, Text::Module(_));
    for (name, at, is_flag) in scan.conditions() {
        if name.is_empty() {
            continue;
        }
        if is_flag && declared.sizes.contains(name) {
            faults.push(note(
                fault(at, format!("`{name}` is a size, not a flag")),
                format!("compare it: `#if {name} == 2`"),
            ));
        } else if !is_flag && declared.flags.contains(name) {
            faults.push(note(
                fault(at, format!("`{name}` is a flag, not a size")),
                format!("test it by `#ifdef {name}`"),
            ));
        } else if !is_flag && in_module {
            faults.push(note(
                fault(at, "a module must not compare sizes"),
                "write two functions and let the program choose",
            ));
        } else {
            let known = if is_flag {
                &declared.flags
            } else {
                &declared.sizes
            };
            if !known.contains(name) {
                let kind = if is_flag { "flag" } else { "size" };
                faults.push(undeclared(at, kind, name, known));
            }
        }
    }
    for (name, at) in scan.sizes(text) {
        if in_module {
            faults.push(note(
                fault(at, format!("a module must not use `#{{{name}}}`")),
                "give the number as an argument",
            ));
        } else if declared.flags.contains(name) {
            faults.push(fault(at, format!("`{name}` is a flag, not a size")));
        } else if !declared.sizes.contains(name) {
            faults.push(undeclared(at, "size", name, &declared.sizes));
        }
    }
}

fn undeclared(at: usize, kind: &str, name: &str, known: &BTreeSet<String>) -> Fault {
    let found = fault(at, format!("{kind} `{name}` is not declared"));
    match nearest(name, known.iter().map(String::as_str)) {
        Some(near) => note(found, format!("did you mean `{near}`?")),
        None => note(found, format!("every {kind} is declared in `keys.ron`")),
    }
}

fn imports(text: &str, scan: &Scan, library: &Library, faults: &mut Vec<Fault>) {
    let imports: Vec<_> = scan.imports().collect();
    // Where each name is used: not after `.` (a member) and not after `@` (an attribute).
    let mut uses: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut before = "";
    for token in &scan.tokens {
        let word = &text[token.start..token.end];
        if token.kind == Kind::Ident && before != "." && before != "@" {
            uses.entry(word).or_default().push(token.start);
        }
        before = word;
    }
    for (i, import) in imports.iter().enumerate() {
        if let Some(first) = imports[..i]
            .iter()
            .find(|first| first.local == import.local && !first.excludes(import))
        {
            let found = fault(import.at, format!("`{}` is imported twice", import.local));
            faults.push(if first.path() == import.path() {
                found
            } else {
                note(
                    found,
                    format!(
                        "here it is `{}`, before it was `{}`: rename one by `as`",
                        import.path(),
                        first.path()
                    ),
                )
            });
            continue;
        }
        let plug_in = library.is_plug_in(import);
        if plug_in || library.check_import("", text, import).is_some() {
            continue;
        }
        match uses.get(import.local.as_str()) {
            None => {
                let found = fault(
                    import.at,
                    format!("`{}` is imported but never used", import.local),
                );
                // A name that reads like it and is nobody else's may be its misspelling.
                let others = uses.keys().copied().filter(|word| {
                    !imports.iter().any(|other| other.local == *word)
                        && !scan.items.iter().any(|item| item.name == *word)
                });
                faults.push(match nearest(&import.local, others) {
                    Some(near) => note(found, format!("is `{near}` a misspelling of it?")),
                    None => found,
                });
            }
            Some(places) => {
                let first = imports
                    .iter()
                    .filter(|other| other.local == import.local)
                    .map(|other| other.at)
                    .min();
                if let Some(early) = places.iter().find(|at| Some(**at) < first) {
                    faults.push(fault(
                        *early,
                        format!("`{}` is used before its import", import.local),
                    ));
                }
            }
        }
    }
    for item in &scan.items {
        let import = imports.iter().find(|import| import.local == item.name);
        match (import, item.kind) {
            (None, ItemKind::OverridingFunction) => faults.push(note(
                fault(
                    item.at,
                    format!("`override fn {}` replaces nothing", item.name),
                ),
                "import the virtual function that it is to replace",
            )),
            (Some(import), ItemKind::OverridingFunction) => {
                let original = library
                    .get(&import.module)
                    .and_then(|module| module.item(&import.item));
                if original.is_some_and(|o| o.kind != ItemKind::VirtualFunction) {
                    faults.push(fault(
                        item.at,
                        format!("`{}` is not a virtual function", import.path()),
                    ));
                }
            }
            (Some(import), _) => faults.push(note(
                fault(
                    item.at,
                    format!("`{}` is both imported and declared", item.name),
                ),
                format!("it is imported from `{}`", import.module),
            )),
            (None, _) => {}
        }
        for member in &item.members {
            if let Some(import) = imports.iter().find(|import| import.local == member.name) {
                faults.push(note(
                    fault(
                        member.at,
                        format!(
                            "member `{}` bears the name of an imported item",
                            member.name
                        ),
                    ),
                    format!(
                        "the linker would rename one and not the other; import `{}` by another name with `as`",
                        import.path()
                    ),
                ));
            }
        }
    }
}

fn heads(what: Text<'_>, scan: &Scan, capabilities: Capabilities, faults: &mut Vec<Fault>) {
    let first_item = scan.items.iter().map(|item| item.at).min();
    for head in &scan.heads {
        if first_item.is_some_and(|first| first < head.start) {
            faults.push(fault(
                head.start,
                format!("`{}` must come before every declaration", head.word),
            ));
        }
        if head.conditional {
            faults.push(fault(
                head.start,
                format!("`{}` must not depend on a condition", head.word),
            ));
        }
        match head.word {
            "enable" => {
                for (name, at) in &head.names {
                    if name == "f16" {
                        if !capabilities.contains(Capabilities::SHADER_FLOAT16) {
                            faults.push(note(
                                fault(
                                    *at,
                                    "`enable f16` needs the capability `f16`, which is not claimed",
                                ),
                                "claim it in the build: `.claim(\"f16\")`",
                            ));
                        }
                    } else if name == "subgroups" {
                        faults.push(note(
                            fault(*at, "`enable subgroups` cannot be composed"),
                            "naga 30 refuses the line and browsers demand it, so that no single text serves both",
                        ));
                    } else {
                        faults.push(note(
                            fault(*at, format!("`enable {name}` is not supported")),
                            "the one extension that the composer carries through is `f16`",
                        ));
                    }
                }
            }
            _ if matches!(what, Text::Module(_)) => faults.push(fault(
                head.start,
                format!("`{}` belongs in a program, not in a module", head.word),
            )),
            "requires" if naga::front::wgsl::parse_str(&head.text).is_err() => {
                let names: Vec<&str> = head.names.iter().map(|(name, _)| name.as_str()).collect();
                faults.push(fault(
                    head.start,
                    format!("naga 30 does not know {}", quoted(&names)),
                ));
            }
            "diagnostic" => {
                const SEVERITIES: [&str; 4] = ["off", "info", "warning", "error"];
                match head.names.first() {
                    Some((severity, at)) if !SEVERITIES.contains(&severity.as_str()) => {
                        faults.push(note(
                            fault(*at, format!("`{severity}` is no severity")),
                            "severities are `off`, `info`, `warning` and `error`",
                        ));
                    }
                    Some(_) if head.names.len() >= 2 => {}
                    _ => faults.push(fault(
                        head.start,
                        "`diagnostic` expects a severity and a rule",
                    )),
                }
            }
            _ => {}
        }
    }
}

fn items(what: Text<'_>, scan: &Scan, faults: &mut Vec<Fault>) {
    if let (Text::Stage, Some((path, at))) = (what, scan.import_path()) {
        faults.push(fault(
            at,
            format!("a program is no module: `#define_import_path {path}` has no place in it"),
        ));
    }
    for item in &scan.items {
        if naga::keywords::wgsl::BUILTIN_IDENTIFIERS.contains(&item.name.as_str()) {
            faults.push(fault(
                item.at,
                format!("`{}` is the name of a WGSL built-in", item.name),
            ));
        }
        for item in [(&item.name, item.at)]
            .into_iter()
            .chain(item.members.iter().map(|member| (&member.name, member.at)))
        {
            reserved_name(item.0, item.1, faults);
        }
        match what {
            Text::Module(path) => module_item(path, item, faults),
            Text::Stage => program_item(item, faults),
        }
    }
}

/// Names that the linker or naga cannot carry through.
fn reserved_name(name: &str, at: usize, faults: &mut Vec<Fault>) {
    if name.contains("X_naga_oil_") {
        faults.push(fault(at, "`X_naga_oil_` is reserved for the linker"));
    } else if name.contains("__") {
        faults.push(fault(at, format!("`{name}`: a name must not contain `__`")));
    } else if name.starts_with('_') {
        faults.push(fault(
            at,
            format!("`{name}`: a name must not start with `_`"),
        ));
    }
}

fn module_item(path: &str, item: &Item, faults: &mut Vec<Fault>) {
    let name = &item.name;
    match item.kind {
        ItemKind::Const { typed: false } => faults.push(note(
            fault(
                item.at,
                format!("constant `{name}` of a module must state its type"),
            ),
            format!("for instance `const {name}: f32 = ...;`"),
        )),
        ItemKind::Alias => faults.push(note(
            fault(
                item.at,
                format!("a module must not declare an alias (`{name}`)"),
            ),
            "the linker cannot export it: write the type itself",
        )),
        ItemKind::Override => faults.push(note(
            fault(
                item.at,
                format!("a module must not declare an override (`{name}`)"),
            ),
            "declare it in the program and give it to the function as an argument",
        )),
        ItemKind::Var => faults.push(note(
            fault(
                item.at,
                format!("a module must not declare a global variable (`{name}`)"),
            ),
            "declare it in the program and give it to the function as an argument",
        )),
        ItemKind::VirtualFunction if !VIRTUAL_MODULES.contains(&path) => faults.push(note(
            fault(item.at, format!("`virtual fn {name}` is not allowed here")),
            format!(
                "only {} may declare virtual functions",
                quoted(&VIRTUAL_MODULES)
            ),
        )),
        _ => {}
    }
    if let Some(stage) = item
        .attributes
        .iter()
        .find(|a| matches!(a.as_str(), "vertex" | "fragment" | "compute"))
    {
        faults.push(fault(
            item.at,
            format!("a module must not have an entry point (`@{stage} fn {name}`)"),
        ));
    }
    for member in &item.members {
        if member
            .name
            .ends_with(|c: char| c == '_' || c.is_ascii_digit())
        {
            faults.push(note(
                fault(
                    member.at,
                    format!(
                        "member `{}` of a module's struct must not end in a digit or `_`",
                        member.name
                    ),
                ),
                "naga would rename it",
            ));
        }
    }
}

fn program_item(item: &Item, faults: &mut Vec<Fault>) {
    let name = &item.name;
    let is_entry = item
        .attributes
        .iter()
        .any(|a| matches!(a.as_str(), "vertex" | "fragment" | "compute"));
    let ends_badly = name.ends_with(|c: char| c == '_' || c.is_ascii_digit());
    if item.kind == ItemKind::VirtualFunction {
        faults.push(fault(
            item.at,
            format!("`virtual fn {name}` has no place in a program: nothing can import it"),
        ));
    }
    if ends_badly && (is_entry || item.kind == ItemKind::Override) {
        let kind = if is_entry { "entry point" } else { "override" };
        faults.push(note(
            fault(
                item.at,
                format!("{kind} `{name}` must not end in a digit or `_`"),
            ),
            "naga would rename it, and the host could not find it",
        ));
    }
}

fn quoted(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn tokens(text: &str, scan: &Scan, faults: &mut Vec<Fault>) {
    let word = |i: usize| -> &str {
        scan.tokens
            .get(i)
            .map_or("", |token| &text[token.start..token.end])
    };
    let overrides: BTreeSet<&str> = scan
        .items
        .iter()
        .filter(|item| item.kind == ItemKind::Override)
        .map(|item| item.name.as_str())
        .collect();
    for (i, token) in scan.tokens.iter().enumerate() {
        match (token.kind, word(i)) {
            (Kind::Punct, "::") if i >= 2 && word(i - 2) == "::" => {}
            (Kind::Punct, "::") => faults.push(note(
                fault(token.start, "a path with `::` outside an import"),
                "import the item and use its name",
            )),
            (Kind::Punct, "@") => match word(i + 1) {
                "diagnostic" => faults.push(note(
                    fault(token.start, "the attribute `@diagnostic` would get lost"),
                    "write the directive `diagnostic(off, derivative_uniformity);` at the head of the program's stage",
                )),
                "binding" if word(i + 3) == "auto" => faults.push(note(
                    fault(token.start, "`@binding(auto)` is not allowed"),
                    "the number would change with every module that is added: state it",
                )),
                "workgroup_size" => {
                    let mut j = i + 2;
                    let mut depth = 0;
                    while let Some(part) = scan.tokens.get(j) {
                        match word(j) {
                            "(" => depth += 1,
                            ")" => {
                                depth -= 1;
                                if depth <= 0 {
                                    break;
                                }
                            }
                            name if part.kind == Kind::Ident && overrides.contains(name) => {
                                faults.push(note(
                                    fault(
                                        part.start,
                                        format!("`@workgroup_size` cannot depend on the override `{name}`"),
                                    ),
                                    format!("make it a size: `@workgroup_size(#{{{name}}})`"),
                                ));
                            }
                            _ => {}
                        }
                        j += 1;
                    }
                }
                _ => {}
            },
            (Kind::Punct, "&") => {
                if let Some(callee) = callee(scan, text, i)
                    && !naga::keywords::wgsl::BUILTIN_IDENTIFIERS.contains(&callee)
                    && is_part(scan, text, i + 1)
                {
                    faults.push(note(
                        fault(
                            token.start,
                            format!("a pointer to a part of a variable cannot be passed to `{callee}`"),
                        ),
                        "naga's SPIR-V writer fails on it: pass the value, or a pointer to the whole variable",
                    ));
                }
            }
            (Kind::Ident, name)
                if name.contains("X_naga_oil_")
                    && !scan.items.iter().any(|item| item.at == token.start) =>
            {
                faults.push(fault(token.start, "`X_naga_oil_` is reserved for the linker"));
            }
            _ => {}
        }
    }
}

/// The function in whose argument list the unary `&` at token `at` starts an argument.
fn callee<'a>(scan: &Scan, text: &'a str, at: usize) -> Option<&'a str> {
    let word = |i: usize| -> &'a str {
        scan.tokens
            .get(i)
            .map_or("", |token| &text[token.start..token.end])
    };
    if !matches!(word(at.checked_sub(1)?), "(" | ",") {
        return None;
    }
    let mut depth = 0;
    let mut i = at - 1;
    loop {
        match word(i) {
            ")" | "]" => depth += 1,
            "[" => depth -= 1,
            "(" if depth == 0 => {
                let before = scan.tokens.get(i.checked_sub(1)?)?;
                return (before.kind == Kind::Ident)
                    .then(|| &text[before.start..before.end])
                    .filter(|name| !matches!(*name, "return" | "if" | "while" | "switch" | "for"));
            }
            "(" => depth -= 1,
            ";" | "{" | "}" => return None,
            _ => {}
        }
        i = i.checked_sub(1)?;
    }
}

/// Whether the place that starts at token `i` is a part of a variable: `a[1]`, `(a)[1]`, `s.a`.
fn is_part(scan: &Scan, text: &str, mut i: usize) -> bool {
    let word = |i: usize| -> &str {
        scan.tokens
            .get(i)
            .map_or("", |token| &text[token.start..token.end])
    };
    while matches!(word(i), "(" | "*") {
        i += 1;
    }
    i += 1;
    while word(i) == ")" {
        i += 1;
        // The end of the argument list.
        if !matches!(word(i), "[" | ".") {
            return false;
        }
    }
    matches!(word(i), "[" | ".")
}

impl Module {
    /// Every fault of the module that shows without composing it.
    pub fn lint(
        &self,
        library: &Library,
        declared: &Declared,
        capabilities: Capabilities,
    ) -> Diags {
        let mut diags = self.scan.diags(&self.file, &self.text);
        for import in self.scan.imports() {
            diags
                .0
                .extend(library.check_import(&self.file, &self.text, import));
        }
        for fault in lint(
            Text::Module(&self.path),
            &self.text,
            &self.scan,
            library,
            declared,
            capabilities,
        ) {
            let mut diag = self.diag(fault.at, fault.message);
            diag.notes = fault.notes;
            diags.push(diag);
        }
        diags.0.sort_by_key(|diag| (diag.line, diag.column));
        diags
    }
}

/// Composes every module by itself, with all its flags off and with each of them on: functions that nobody calls are
/// validated too. Returns all faults.
pub fn check_modules(linker: &mut Linker, declared: &Declared) -> Diags {
    let library = linker.library().clone();
    let mut diags = Diags::new();
    // A module that imports a faulty one would repeat its faults.
    let mut faulty: BTreeSet<&str> = BTreeSet::new();
    for path in library.order() {
        let Some(module) = library.get(path) else {
            continue;
        };
        let found = module.lint(&library, declared, linker.capabilities());
        let broken = !found.is_empty();
        diags.append(found);
        if broken
            || module
                .imported()
                .iter()
                .any(|import| faulty.contains(import))
        {
            faulty.insert(path);
            continue;
        }
        let mut sets = vec![Defs::new()];
        sets.extend(
            module
                .flags
                .iter()
                .map(|flag| Defs::from([(flag.clone(), Def::Flag)])),
        );
        let plug_in = [path.clone()];
        for defs in sets {
            // As a top text all its functions are validated; as an import its names are.
            let texts: [(&str, &[String]); 2] = [(&module.text, &[]), ("", &plug_in)];
            let outcome = texts.into_iter().try_for_each(|(text, plug_ins)| {
                let linked = linker.link(&LinkInput {
                    text,
                    file: &module.file,
                    defs: &defs,
                    plug_ins,
                })?;
                // What is imported bears the linker's marks, and was checked before.
                let found: Diags = Diags(
                    crate::gate::partial_pointers(&linked)
                        .into_iter()
                        .filter_map(|fault| {
                            let item = module.item(fault.item.as_deref()?)?;
                            Some(module.diag(item.at, fault.message))
                        })
                        .collect(),
                );
                found.ok(())
            });
            if let Err(more) = outcome {
                for mut diag in more.0 {
                    // As an import the module has no text of its own for what concerns it as a whole.
                    if diag.file == module.file
                        && crate::diag::line_at(&module.text, diag.line) != diag.source_line
                    {
                        let notes = std::mem::take(&mut diag.notes);
                        diag = Diag::whole_file(&module.file, diag.message);
                        diag.notes = notes;
                    }
                    if !defs.is_empty() {
                        let on: Vec<&str> = defs.keys().map(String::as_str).collect();
                        diag = diag.note(format!("with {} on", quoted(&on)));
                    }
                    push_new(&mut diags, diag);
                }
                faulty.insert(path);
                break;
            }
        }
    }
    diags
}

/// Adds a diagnostic unless its place and message are there already.
pub(crate) fn push_new(diags: &mut Diags, diag: Diag) {
    let known = diags.iter().any(|d| {
        (&d.file, d.line, d.column, &d.message)
            == (&diag.file, diag.line, diag.column, &diag.message)
    });
    if !known {
        diags.push(diag);
    }
}
