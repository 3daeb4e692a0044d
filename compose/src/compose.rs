//! From programs to plain WGSL with its tables.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;
use std::rc::Rc;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use crate::diag::{Diag, Diags, nearest};
use crate::gate::{self, GateFault};
use crate::keys::{KeyKind, KeyType, Keys, Value};
use crate::library::Library;
use crate::link::{LinkInput, Linker, demangle, module_of};
use crate::lint::{self, Declared, Text, push_new};
use crate::reflect::{
    self, Binding, BindingType, EntryPoint, Override, SampleType, ScalarType, StageKind,
    StageTables, StructLayout,
};
use crate::scan::{Def, Defs, Scan};
use crate::sp::{SpFile, Stitched};

/// One stage of a composed program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Which stage.
    pub kind: StageKind,
    /// The entry points in the order of the text: one, but any number in a compute stage.
    pub entry_points: Vec<EntryPoint>,
    /// Plain WGSL with what the entry points reach and nothing else.
    pub wgsl: String,
}

/// A variant of a program: texts and tables.
#[derive(Clone, Debug, PartialEq)]
pub struct Composed {
    /// The program's file name without folder and ending.
    pub program: String,
    /// The features that are on, of those that make a difference; in alphabetical order.
    pub features: Vec<String>,
    /// Every flag that the program or a module that it reaches mentions, on or off; in alphabetical order.
    pub mentions: Vec<String>,
    /// The modules with an `override fn` that are plugged into it; in alphabetical order.
    pub plug_ins: Vec<String>,
    /// The stages in pipeline order.
    pub stages: Vec<Stage>,
    /// The resources by group and binding, each with all stages that use it.
    pub bindings: Vec<Binding>,
    /// The overrides by name.
    pub overrides: Vec<Override>,
    /// The structures of uniform and storage buffers by name.
    pub structs: Vec<StructLayout>,
}

/// Reads the file of a `SRC` tag, given its path (the `.sp` file's folder joined with what the tag says).
pub type Reader = Box<dyn Fn(&str) -> io::Result<String>>;

/// Composes programs; one composer serves a whole build.
pub struct Composer {
    linker: Linker,
    keys: Keys,
    declared: Declared,
    plug_ins: Vec<String>,
    any_override: bool,
    require_headers: bool,
    read: Reader,
    /// By file, stage and values; with the text, as a file may come again with another one.
    stages: BTreeMap<(String, StageKind, Defs), (String, Rc<DoneStage>)>,
    passed: BTreeSet<String>,
}

/// A program whose stages are stitched and linted.
#[derive(Clone, Debug)]
pub struct Program {
    /// The program's file name without folder and ending.
    pub name: String,
    /// The `.sp` file's name in messages.
    pub file: String,
    /// The flags and sizes that make a difference to it.
    pub relevant: BTreeSet<String>,
    any_override: bool,
    stages: Vec<SourceStage>,
}

#[derive(Clone, Debug)]
struct SourceStage {
    kind: StageKind,
    stitched: Stitched,
    scan: Scan,
    relevant: BTreeSet<String>,
    plug_ins: Vec<String>,
    /// All that are plugged in: those of the build, and those that the text imports.
    plugged: Vec<String>,
    place: Diag,
}

impl SourceStage {
    /// A fault at the declaration of a name, or at the stage's first entry point, or at its tag.
    fn diag_of(&self, item: Option<&str>, message: &str) -> Diag {
        let found = item
            .and_then(|name| self.scan.items.iter().find(|item| item.name == name))
            .or_else(|| {
                self.scan.items.iter().find(|item| {
                    item.attributes
                        .iter()
                        .any(|a| matches!(a.as_str(), "vertex" | "fragment" | "compute"))
                })
            });
        match found {
            Some(item) => self.stitched.diag_at(item.at, message),
            None => {
                let mut diag = self.place.clone();
                diag.message = message.to_owned();
                diag
            }
        }
    }

    /// A gate's fault at the declaration of its item, which may be in a module.
    fn gate_diag(&self, fault: &GateFault, library: &Library) -> Diag {
        let here = |name: &str| self.scan.items.iter().any(|item| item.name == name);
        if let Some(name) = &fault.item
            && !here(name)
        {
            let reached = library.reached(self.scan.imports().map(|import| import.module.as_str()));
            for module in reached {
                if let Some(item) = module.item(name) {
                    return module.diag(item.at, fault.message.clone());
                }
            }
        }
        self.diag_of(fault.item.as_deref(), &fault.message)
    }
}

#[derive(Debug)]
struct DoneStage {
    wgsl: String,
    module: naga::Module,
    tables: StageTables,
}

impl Composer {
    /// A composer over a library with declared keys. It claims no optional capability and reads the files of `SRC` tags
    /// from the disk.
    pub fn new(library: &Library, keys: Keys) -> Self {
        let mut declared = Declared::default();
        for key in keys.iter() {
            match key.ty {
                KeyType::Flag => declared.flags.insert(key.name.clone()),
                KeyType::Size => declared.sizes.insert(key.name.clone()),
                _ => false,
            };
        }
        Self {
            linker: Linker::new(library),
            keys,
            declared,
            plug_ins: Vec::new(),
            any_override: false,
            require_headers: false,
            read: Box::new(|path| std::fs::read_to_string(path)),
            stages: BTreeMap::new(),
            passed: BTreeSet::new(),
        }
    }

    /// Claims capabilities beyond WebGPU's core: what is composed may need them.
    #[must_use]
    pub fn claim(mut self, capabilities: Capabilities) -> Self {
        let library = self.linker.library().clone();
        let all = self.linker.capabilities() | capabilities;
        self.linker = Linker::with_capabilities(&library, all);
        self
    }

    /// Declares flags beyond those of the keys.
    #[must_use]
    pub fn flags<'a>(mut self, flags: impl IntoIterator<Item = &'a str>) -> Self {
        self.declared
            .flags
            .extend(flags.into_iter().map(str::to_owned));
        self
    }

    /// Modules whose `override fn` takes effect in every program that reaches the function.
    #[must_use]
    pub fn plug_ins(mut self, modules: Vec<String>) -> Self {
        self.plug_ins = modules;
        self
    }

    /// Whether the programs that are prepared from now on may declare overrides that are no keys. Default: no.
    pub fn allow_any_override(&mut self, any: bool) {
        self.any_override = any;
    }

    /// Whether every module must have headers in the grammar of `docs/modules.md`; else only those that start with `//!`.
    #[must_use]
    pub fn require_headers(mut self, yes: bool) -> Self {
        self.require_headers = yes;
        self
    }

    /// Reads the files of `SRC` tags by a function instead of from the disk.
    #[must_use]
    pub fn reader(mut self, read: Reader) -> Self {
        self.read = read;
        self
    }

    /// The modules.
    pub fn library(&self) -> &Library {
        self.linker.library()
    }

    /// The keys.
    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    /// The linker, for texts that are no programs.
    pub fn linker(&mut self) -> &mut Linker {
        &mut self.linker
    }

    /// Checks every module by itself: lints, and composes it with its flags off and with each of them on.
    pub fn check_modules(&mut self) -> Diags {
        let mut diags = Diags::new();
        for module in self.linker.library().modules() {
            if (self.require_headers || module.text.trim_start().starts_with("//!"))
                && let Err(found) = crate::header::parse_headers(&module.file, &module.text)
            {
                diags.append(found);
            }
        }
        diags.append(lint::check_modules(&mut self.linker, &self.declared));
        diags
    }

    /// Stitches and lints a program.
    ///
    /// # Errors
    /// Every fault that shows without composing a variant.
    pub fn prepare(&self, sp: &SpFile) -> Result<Program, Diags> {
        let mut diags = Diags::new();
        let mut stages = Vec::new();
        let folder = match sp.file().rfind(['/', '\\']) {
            Some(end) => &sp.file()[..=end],
            None => "",
        };
        let mut sources: Vec<_> = sp.stages.iter().collect();
        sources.sort_by_key(|stage| stage.kind);
        if sources.is_empty() {
            // A program with nothing but a geometry stage: the stitcher explains.
            if let Err(found) = sp.stitch(StageKind::Vertex, &mut |_| Ok(String::new())) {
                diags.append(found);
            }
        }
        for source in sources {
            let read = &mut |path: &str| (self.read)(&format!("{folder}{path}"));
            let stitched = match sp.stitch(source.kind, read) {
                Ok(stitched) => stitched,
                Err(found) => {
                    for diag in found.0 {
                        push_new(&mut diags, diag);
                    }
                    continue;
                }
            };
            let scan = Scan::new(&stitched.text);
            let stage = self.source_stage(
                source.kind,
                stitched,
                scan,
                sp.diag(source.place, ""),
                &mut diags,
            );
            stages.push(stage);
        }
        self.lint_program(sp, &stages, &mut diags);
        let relevant = stages
            .iter()
            .flat_map(|stage| stage.relevant.iter().cloned())
            .collect();
        let name = Path::new(sp.file()).file_stem().map_or_else(
            || sp.name.clone(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        diags.ok(Program {
            name,
            file: sp.file().to_owned(),
            relevant,
            any_override: self.any_override,
            stages,
        })
    }

    /// Lints one stage's text.
    fn source_stage(
        &self,
        kind: StageKind,
        stitched: Stitched,
        scan: Scan,
        place: Diag,
        diags: &mut Diags,
    ) -> SourceStage {
        let library = self.linker.library();
        let text = &stitched.text;
        for import in scan.imports() {
            if let Some(found) = library.check_import("", text, import) {
                let mut diag = stitched.diag(found.line, found.column, found.message);
                diag.notes = found.notes;
                push_new(diags, diag);
            }
        }
        let lints = lint::lint(
            Text::Stage,
            text,
            &scan,
            library,
            &self.declared,
            self.linker.capabilities(),
        );
        for fault in scan.faults.iter().cloned().chain(lints) {
            let mut diag = stitched.diag_at(fault.at, fault.message);
            diag.notes = fault.notes;
            push_new(diags, diag);
        }
        for item in &scan.items {
            for attribute in &item.attributes {
                let wanted = match attribute.as_str() {
                    "vertex" => StageKind::Vertex,
                    "fragment" => StageKind::Fragment,
                    "compute" => StageKind::Compute,
                    _ => continue,
                };
                if wanted != kind {
                    push_new(
                        diags,
                        stitched.diag_at(
                            item.at,
                            format!("`@{wanted} fn {}` in the {kind} stage", item.name),
                        ),
                    );
                }
            }
        }
        let roots: Vec<String> = scan
            .imports()
            .map(|import| {
                if library.is_plug_in(import) {
                    import.path()
                } else {
                    import.module.clone()
                }
            })
            .collect();
        let mut reached = library.reached(roots.iter().map(String::as_str));
        // A plug-in counts where the module that it changes is reached.
        let plug_ins: Vec<String> = self
            .plug_ins
            .iter()
            .filter(|path| {
                library.get(path).is_some_and(|module| {
                    module
                        .imported()
                        .iter()
                        .any(|import| reached.iter().any(|r| r.path == **import))
                })
            })
            .cloned()
            .collect();
        reached.extend(library.reached(plug_ins.iter().map(String::as_str)));
        let plugged = reached
            .iter()
            .filter(|module| module.overrides_functions())
            .map(|module| module.path.clone())
            .collect();
        let mut relevant = scan.mentioned(text);
        relevant.extend(
            reached
                .iter()
                .flat_map(|module| module.flags.iter().cloned()),
        );
        SourceStage {
            kind,
            stitched,
            scan,
            relevant,
            plug_ins,
            plugged,
            place,
        }
    }

    /// What concerns more than one stage.
    fn lint_program(&self, sp: &SpFile, stages: &[SourceStage], diags: &mut Diags) {
        let has = |kind| sp.stage(kind).is_some();
        if let Some(stage) = sp.stage(StageKind::Fragment)
            && !has(StageKind::Vertex)
        {
            diags.push(sp.diag(
                stage.place,
                "a fragment stage needs a vertex stage in the same program",
            ));
        }
        if let Some(stage) = sp.stage(StageKind::Compute)
            && has(StageKind::Vertex)
        {
            diags.push(sp.diag(
                stage.place,
                "a program either draws or computes: a compute stage stands alone",
            ));
        }
        let mut entries: BTreeMap<&str, (&SourceStage, usize)> = BTreeMap::new();
        for stage in stages {
            for item in &stage.scan.items {
                let is_entry = item
                    .attributes
                    .iter()
                    .any(|a| matches!(a.as_str(), "vertex" | "fragment" | "compute"));
                if !is_entry {
                    continue;
                }
                match entries.get(item.name.as_str()) {
                    Some((first, at)) if first.kind != stage.kind => {
                        let first = first.stitched.diag_at(*at, "");
                        push_new(
                            diags,
                            stage
                                .stitched
                                .diag_at(
                                    item.at,
                                    format!(
                                        "entry point `{}` exists twice in this program",
                                        item.name
                                    ),
                                )
                                .note(format!(
                                    "the other one is {}:{}:{}",
                                    first.file, first.line, first.column
                                )),
                        );
                    }
                    Some(_) => {}
                    None => {
                        entries.insert(&item.name, (stage, item.at));
                    }
                }
            }
        }
    }

    /// Composes one variant.
    ///
    /// Features that the program and its modules never mention make no difference. A size that is not given has its
    /// key's default.
    ///
    /// # Errors
    /// Every fault, at its place in the original file.
    pub fn compose(
        &mut self,
        sp: &SpFile,
        features: &BTreeSet<String>,
        sizes: &BTreeMap<String, i64>,
    ) -> Result<Composed, Diags> {
        let program = self.prepare(sp)?;
        self.compose_prepared(&program, features, sizes)
    }

    /// [`Composer::compose`] for a program that is prepared already.
    ///
    /// # Errors
    /// As [`Composer::compose`].
    pub fn compose_prepared(
        &mut self,
        program: &Program,
        features: &BTreeSet<String>,
        sizes: &BTreeMap<String, i64>,
    ) -> Result<Composed, Diags> {
        let mut diags = Diags::new();
        for feature in features {
            if !self.declared.flags.contains(feature) {
                diags.push(
                    Diag::whole_file(
                        &program.file,
                        format!("feature `{feature}` is not declared"),
                    )
                    .suggest(feature, self.declared.flags.iter().map(String::as_str)),
                );
            }
        }
        if !diags.is_empty() {
            return Err(diags);
        }
        let mut defs: Defs = features
            .iter()
            .filter(|feature| program.relevant.contains(*feature))
            .map(|feature| (feature.clone(), Def::Flag))
            .collect();
        let feature_names: Vec<String> = defs.keys().cloned().collect();
        for name in &program.relevant {
            if !self.declared.sizes.contains(name) {
                continue;
            }
            let value = sizes.get(name).copied().or_else(|| {
                match self.keys.get(name).map(|key| key.default) {
                    Some(Value::Int(value)) => Some(value),
                    _ => None,
                }
            });
            match value.map(i32::try_from) {
                None => {}
                Some(Ok(value)) => {
                    defs.insert(name.clone(), Def::Int(value));
                }
                Some(Err(_)) => diags.push(Diag::whole_file(
                    &program.file,
                    format!("size `{name}` does not fit 32 bits"),
                )),
            }
        }
        let mut done: Vec<(&SourceStage, Rc<DoneStage>)> = Vec::new();
        for stage in &program.stages {
            match self.stage(program, stage, &defs) {
                Ok(outcome) => done.push((stage, outcome)),
                Err(found) => {
                    for diag in found.0 {
                        push_new(&mut diags, diag);
                    }
                }
            }
        }
        if diags.is_empty() {
            let module = |kind| done.iter().find(|(stage, _)| stage.kind == kind);
            if let (Some((_, vertex)), Some((stage, fragment))) =
                (module(StageKind::Vertex), module(StageKind::Fragment))
            {
                for fault in gate::check_interface(&vertex.module, &fragment.module) {
                    diags.push(stage.gate_diag(&fault, self.linker.library()));
                }
            }
        }
        let merged = merge(&done, &mut diags);
        if !diags.is_empty() {
            if !feature_names.is_empty() {
                let on = format!("with {} on", feature_names.join(", "));
                for diag in &mut diags.0 {
                    diag.notes.push(on.clone());
                }
            }
            return Err(diags);
        }
        let mut structs: BTreeMap<String, StructLayout> = merged.2;
        self.document(program, &mut structs);
        Ok(Composed {
            program: program.name.clone(),
            features: feature_names,
            mentions: program
                .relevant
                .intersection(&self.declared.flags)
                .cloned()
                .collect(),
            plug_ins: done
                .iter()
                .flat_map(|(stage, _)| stage.plugged.iter().cloned())
                .collect::<BTreeSet<String>>()
                .into_iter()
                .collect(),
            stages: done
                .iter()
                .map(|(stage, outcome)| Stage {
                    kind: stage.kind,
                    entry_points: outcome.tables.entry_points.clone(),
                    wgsl: outcome.wgsl.clone(),
                })
                .collect(),
            bindings: merged.0,
            overrides: merged.1,
            structs: structs.into_values().collect(),
        })
    }

    /// One stage of one variant, from the cache if it was composed before.
    fn stage(
        &mut self,
        program: &Program,
        stage: &SourceStage,
        defs: &Defs,
    ) -> Result<Rc<DoneStage>, Diags> {
        let defs: Defs = defs
            .iter()
            .filter(|(name, _)| stage.relevant.contains(*name))
            .map(|(name, def)| (name.clone(), *def))
            .collect();
        let key = (program.file.clone(), stage.kind, defs);
        if let Some((text, done)) = self.stages.get(&key)
            && *text == stage.stitched.text
        {
            return Ok(done.clone());
        }
        let done = Rc::new(self.compose_stage(program, stage, &key.2)?);
        self.stages
            .insert(key, (stage.stitched.text.clone(), done.clone()));
        Ok(done)
    }

    fn compose_stage(
        &mut self,
        program: &Program,
        stage: &SourceStage,
        defs: &Defs,
    ) -> Result<DoneStage, Diags> {
        let input = LinkInput {
            text: &stage.stitched.text,
            file: &program.file,
            defs,
            plug_ins: &stage.plug_ins,
        };
        let module = self
            .linker
            .link_scanned(&input, &stage.scan)
            .map_err(|found| {
                Diags(
                    found
                        .0
                        .into_iter()
                        .map(|diag| {
                            if diag.file == program.file && diag.line != 0 {
                                let mut located =
                                    stage.stitched.diag(diag.line, diag.column, diag.message);
                                located.notes = diag.notes;
                                located
                            } else {
                                diag
                            }
                        })
                        .collect(),
                )
            })?;
        if let Some(item) = reflect::computed_default(&module) {
            return Err(stage
                .diag_of(
                    Some(&item),
                    &format!(
                        "the default of override `{item}` must be a number, not an expression"
                    ),
                )
                .into());
        }
        let capabilities = self.linker.capabilities();
        let mut finished = gate::no_panic(|| finish(module, capabilities))
            .unwrap_or_else(|panic| Err(format!("the WGSL writer panicked: {panic}")))
            .map_err(|error| stage.diag_of(None, &format!("cannot be written as WGSL: {error}")))?;
        let heads: String = stage
            .scan
            .heads
            .iter()
            .filter(|head| head.word != "enable")
            .map(|head| head.text.split_whitespace().collect::<Vec<_>>().join(" ") + "\n")
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect();
        if !heads.is_empty() {
            finished.wgsl = format!("{heads}\n{}", finished.wgsl);
        }
        let mut diags = Diags::new();
        let entries = finished.module.entry_points.len();
        if entries == 0 || (entries > 1 && stage.kind != StageKind::Compute) {
            diags.push(stage.diag_of(
                None,
                &format!(
                    "the {} stage has {entries} entry points; it needs {}",
                    stage.kind,
                    if stage.kind == StageKind::Compute {
                        "at least one"
                    } else {
                        "exactly one"
                    }
                ),
            ));
            return Err(diags);
        }
        if !self.passed.contains(&finished.wgsl) {
            for fault in gate::check(&finished.wgsl, &finished.module, capabilities) {
                push_new(&mut diags, stage.gate_diag(&fault, self.linker.library()));
            }
            if diags.is_empty() {
                // More than any build has; a program that reloads for days must not grow.
                if self.passed.len() >= 4096 {
                    self.passed.clear();
                }
                self.passed.insert(finished.wgsl.clone());
            }
        }
        let mut tables = match reflect::stage(stage.kind, &finished.module, &finished.info) {
            Ok(tables) => tables,
            Err((item, why)) => {
                diags.push(stage.diag_of(Some(&item), &format!("`{item}`: {why}")));
                return Err(diags);
            }
        };
        for item in &mut tables.overrides {
            self.check_override(item, program, stage, &mut diags);
        }
        diags.ok(DoneStage {
            wgsl: finished.wgsl,
            module: finished.module,
            tables,
        })
    }

    /// An override bears the name, type and default of a quality key.
    fn check_override(
        &self,
        item: &mut Override,
        program: &Program,
        stage: &SourceStage,
        diags: &mut Diags,
    ) {
        let name = item.name.clone();
        let mut push = |message: String, notes: Vec<String>| {
            let mut diag = stage.diag_of(Some(&name), &message);
            diag.notes = notes;
            push_new(diags, diag);
        };
        let Some(key) = self.keys.get(&item.name) else {
            if !program.any_override {
                let overridable = self.keys.iter().filter(|key| {
                    key.kind == KeyKind::Quality
                        && matches!(key.ty, KeyType::I32 | KeyType::U32 | KeyType::F32)
                });
                let near = nearest(&item.name, overridable.map(|key| key.name.as_str()));
                push(
                    format!("override `{}` is not declared", item.name),
                    vec![match near {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => "every override is a quality key of `keys.ron`".to_owned(),
                    }],
                );
            }
            return;
        };
        let declared = format!("declared at {}:{}", key.file, key.place.line);
        let wanted = match (key.kind, key.ty) {
            (KeyKind::Quality, KeyType::I32) => ScalarType::I32,
            (KeyKind::Quality, KeyType::U32) => ScalarType::U32,
            (KeyKind::Quality, KeyType::F32) => ScalarType::F32,
            (kind, ty) => {
                push(
                    format!(
                        "override `{}` bears the name of a {kind} key of type {ty}",
                        item.name
                    ),
                    vec![declared],
                );
                return;
            }
        };
        if item.ty != wanted {
            push(
                format!(
                    "override `{}` is {}, but its key is {}",
                    item.name,
                    item.ty.wgsl(),
                    wanted.wgsl()
                ),
                vec![declared],
            );
            return;
        }
        let default = match key.default {
            Value::Int(value) => value as f64,
            Value::Float(value) => f64::from(value as f32),
            _ => return,
        };
        if let Some(value) = item.default
            && value != default
        {
            push(
                format!(
                    "override `{}` defaults to {value}, but its key to {}",
                    item.name, key.default
                ),
                vec![declared],
            );
            return;
        }
        item.key = Some(key.name.clone());
    }

    /// Puts the doc comments of the sources into the layouts.
    fn document(&self, program: &Program, structs: &mut BTreeMap<String, StructLayout>) {
        let library = self.linker.library();
        for layout in structs.values_mut() {
            let in_program = program.stages.iter().flat_map(|stage| &stage.scan.items);
            let reached = program.stages.iter().flat_map(|stage| {
                library.reached(stage.scan.imports().map(|import| import.module.as_str()))
            });
            let in_modules = reached.flat_map(|module| &module.scan.items);
            let Some(item) = in_program.chain(in_modules).find(|item| {
                item.kind == crate::scan::ItemKind::Struct && item.name == layout.name
            }) else {
                continue;
            };
            layout.doc.clone_from(&item.doc);
            for member in &mut layout.members {
                if let Some(source) = item.members.iter().find(|m| m.name == member.name) {
                    member.doc.clone_from(&source.doc);
                }
            }
        }
    }
}

type Merged = (Vec<Binding>, Vec<Override>, BTreeMap<String, StructLayout>);

/// Merges the tables of the stages; what contradicts itself is a fault.
fn merge(done: &[(&SourceStage, Rc<DoneStage>)], diags: &mut Diags) -> Merged {
    let mut bindings: BTreeMap<(u32, u32), (Binding, &SourceStage)> = BTreeMap::new();
    let mut overrides: BTreeMap<String, (Override, &SourceStage)> = BTreeMap::new();
    let mut structs: BTreeMap<String, (StructLayout, &SourceStage)> = BTreeMap::new();
    for (stage, outcome) in done {
        for binding in &outcome.tables.bindings {
            let place = (binding.group, binding.binding);
            let message = if let Some((known, _)) = bindings.get_mut(&place) {
                if known.name != binding.name {
                    Some(format!(
                        "binding {} of group {} is `{}` here and `{}` in another stage",
                        place.1, place.0, binding.name, known.name
                    ))
                } else if let Some(ty) = common_type(known.ty, binding.ty) {
                    known.ty = ty;
                    known.visibility.add(stage.kind);
                    None
                } else {
                    Some(format!(
                        "`{}` has another type than in another stage",
                        binding.name
                    ))
                }
            } else if let Some((other, _)) = bindings
                .iter()
                .find(|(_, (known, _))| known.name == binding.name)
            {
                Some(format!(
                    "`{}` is binding {} of group {} here and binding {} of group {} in another stage",
                    binding.name, place.1, place.0, other.1, other.0
                ))
            } else {
                bindings.insert(place, (binding.clone(), stage));
                None
            };
            if let Some(message) = message {
                push_new(diags, stage.diag_of(Some(&binding.name), &message));
            }
        }
        for item in &outcome.tables.overrides {
            match overrides.get_mut(&item.name) {
                None => {
                    overrides.insert(item.name.clone(), (item.clone(), stage));
                }
                Some((known, _)) => {
                    if (known.ty, known.default, known.id) != (item.ty, item.default, item.id) {
                        push_new(
                            diags,
                            stage.diag_of(
                                Some(&item.name),
                                &format!(
                                    "override `{}` differs from that of another stage",
                                    item.name
                                ),
                            ),
                        );
                    }
                    known.visibility.add(stage.kind);
                }
            }
        }
        for (name, layout) in &outcome.tables.structs {
            match structs.get(name) {
                None => {
                    structs.insert(name.clone(), (layout.clone(), stage));
                }
                Some((known, _)) if known != layout => push_new(
                    diags,
                    stage.diag_of(
                        Some(name),
                        &format!("structure `{name}` differs from that of another stage"),
                    ),
                ),
                Some(_) => {}
            }
        }
    }
    (
        bindings.into_values().map(|(binding, _)| binding).collect(),
        overrides.into_values().map(|(item, _)| item).collect(),
        structs
            .into_iter()
            .map(|(name, (layout, _))| (name, layout))
            .collect(),
    )
}

/// The binding type that serves both stages.
fn common_type(a: BindingType, b: BindingType) -> Option<BindingType> {
    use BindingType as B;
    match (a, b) {
        (B::Uniform { min_size: x }, B::Uniform { min_size: y }) => {
            Some(B::Uniform { min_size: x.max(y) })
        }
        (
            B::Texture {
                sample: SampleType::Float { filterable: x },
                dim,
                multisampled,
            },
            B::Texture {
                sample: SampleType::Float { filterable: y },
                dim: other,
                multisampled: m,
            },
        ) if dim == other && multisampled == m => Some(B::Texture {
            sample: SampleType::Float { filterable: x || y },
            dim,
            multisampled,
        }),
        (
            B::Sampler {
                comparison: false,
                filtering: x,
            },
            B::Sampler {
                comparison: false,
                filtering: y,
            },
        ) => Some(B::Sampler {
            comparison: false,
            filtering: x || y,
        }),
        _ if a == b => Some(a),
        _ => None,
    }
}

/// A finished stage.
#[derive(Clone, Debug)]
pub struct Finished {
    /// Plain WGSL.
    pub wgsl: String,
    /// The IR that it was written from.
    pub module: naga::Module,
    /// naga's findings about the IR.
    pub info: ModuleInfo,
}

/// The capability beyond WebGPU's core of a name that can be claimed: `f16` or `subgroups`.
pub fn capability(name: &str) -> Option<Capabilities> {
    match name {
        "f16" => Some(Capabilities::SHADER_FLOAT16),
        "subgroups" => Some(Capabilities::SUBGROUP),
        _ => None,
    }
}

/// Makes plain WGSL of linked IR: readable names, only what the entry points reach (all functions if there is no entry
/// point), validated, written.
///
/// # Errors
/// What naga's validator or writer says; [`crate::link::Linker::link`] has validated the module already, so that this is
/// a fault of the composer rather than of the text.
pub fn finish(mut module: naga::Module, capabilities: Capabilities) -> Result<Finished, String> {
    rename(&mut module);
    if !module.entry_points.is_empty() {
        naga::compact::compact(&mut module, naga::compact::KeepUnused::No);
        strip_consts(&mut module);
    }
    let info = Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .map_err(|error| error.emit_to_string(""))?;
    let mut wgsl =
        naga::back::wgsl::write_string(&module, &info, naga::back::wgsl::WriterFlags::empty())
            .map_err(|error| error.to_string())?;
    if uses_f16(&module) && !wgsl.contains("enable f16;") {
        wgsl.insert_str(0, "enable f16;\n\n");
    }
    Ok(Finished { wgsl, module, info })
}

/// Takes naga_oil's marks off every name; where two modules use one name, the second gets its module's name appended.
fn rename(module: &mut naga::Module) {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    // What is not marked belongs to the program and keeps its name.
    let unmarked = |name: &Option<String>| {
        name.as_ref()
            .filter(|name| demangle(name) == name.as_str())
            .cloned()
    };
    taken.extend(module.entry_points.iter().map(|ep| ep.name.clone()));
    taken.extend(
        module
            .functions
            .iter()
            .filter_map(|(_, f)| unmarked(&f.name)),
    );
    taken.extend(
        module
            .constants
            .iter()
            .filter_map(|(_, c)| unmarked(&c.name)),
    );
    taken.extend(
        module
            .overrides
            .iter()
            .filter_map(|(_, o)| unmarked(&o.name)),
    );
    taken.extend(
        module
            .global_variables
            .iter()
            .filter_map(|(_, g)| unmarked(&g.name)),
    );
    taken.extend(module.types.iter().filter_map(|(_, t)| unmarked(&t.name)));

    let mut plain = |name: &str| -> String {
        let short = demangle(name);
        let mut new = short.to_owned();
        if taken.contains(&new) {
            let owner = module_of(name).unwrap_or_default();
            let last = owner.rsplit("::").next().unwrap_or("module");
            new = format!("{short}_{last}");
            let mut n = 'b';
            while taken.contains(&new) {
                new = format!("{short}_{last}_{n}");
                n = ((n as u8).saturating_add(1)) as char;
            }
        }
        taken.insert(new.clone());
        new
    };
    let marked = |name: &Option<String>| {
        name.as_ref()
            .filter(|name| demangle(name) != name.as_str())
            .cloned()
    };
    let types: Vec<(naga::Handle<naga::Type>, naga::Type)> = module
        .types
        .iter()
        .filter(|(_, ty)| marked(&ty.name).is_some())
        .map(|(handle, ty)| (handle, ty.clone()))
        .collect();
    for (handle, mut ty) in types {
        ty.name = ty.name.as_deref().map(&mut plain);
        module.types.replace(handle, ty);
    }
    for (_, constant) in module.constants.iter_mut() {
        if let Some(name) = marked(&constant.name) {
            constant.name = Some(plain(&name));
        }
    }
    for (_, item) in module.overrides.iter_mut() {
        if let Some(name) = marked(&item.name) {
            item.name = Some(plain(&name));
        }
    }
    for (_, global) in module.global_variables.iter_mut() {
        if let Some(name) = marked(&global.name) {
            global.name = Some(plain(&name));
        }
    }
    for (_, function) in module.functions.iter_mut() {
        if let Some(name) = marked(&function.name) {
            function.name = Some(plain(&name));
        }
        rename_locals(function);
    }
    for entry_point in &mut module.entry_points {
        rename_locals(&mut entry_point.function);
    }
}

/// A local that bears the name of an imported item is marked too.
fn rename_locals(function: &mut naga::Function) {
    let strip = |name: &mut Option<String>| {
        if let Some(name) = name {
            name.truncate(demangle(name).len());
        }
    };
    for argument in &mut function.arguments {
        strip(&mut argument.name);
    }
    for (_, local) in function.local_variables.iter_mut() {
        strip(&mut local.name);
    }
    for name in function.named_expressions.values_mut() {
        name.truncate(demangle(name).len());
    }
}

/// Drops the named constants that nothing refers to: naga's compaction keeps every constant with a name.
fn strip_consts(module: &mut naga::Module) {
    loop {
        let mut used = BTreeSet::new();
        let mut note = |expressions: &naga::Arena<naga::Expression>| {
            for (_, expression) in expressions.iter() {
                if let naga::Expression::Constant(handle) = expression {
                    used.insert(*handle);
                }
            }
        };
        note(&module.global_expressions);
        for (_, function) in module.functions.iter() {
            note(&function.expressions);
        }
        for entry_point in &module.entry_points {
            note(&entry_point.function.expressions);
        }
        let mut dropped = false;
        for (handle, constant) in module.constants.iter_mut() {
            if !used.contains(&handle) && constant.name.take().is_some() {
                dropped = true;
            }
        }
        if !dropped {
            return;
        }
        naga::compact::compact(module, naga::compact::KeepUnused::No);
    }
}

/// Whether half precision occurs anywhere, even where naga's writer does not look.
fn uses_f16(module: &naga::Module) -> bool {
    let half = |scalar: naga::Scalar| scalar.kind == naga::ScalarKind::Float && scalar.width == 2;
    let typed = module.types.iter().any(|(_, ty)| match ty.inner {
        naga::TypeInner::Scalar(scalar)
        | naga::TypeInner::Vector { scalar, .. }
        | naga::TypeInner::Matrix { scalar, .. }
        | naga::TypeInner::ValuePointer { scalar, .. } => half(scalar),
        _ => false,
    });
    let in_arena = |arena: &naga::Arena<naga::Expression>| {
        arena.iter().any(|(_, expression)| match *expression {
            naga::Expression::Literal(naga::Literal::F16(_)) => true,
            naga::Expression::As { kind, convert, .. } => {
                kind == naga::ScalarKind::Float && convert == Some(2)
            }
            _ => false,
        })
    };
    typed
        || in_arena(&module.global_expressions)
        || module
            .functions
            .iter()
            .any(|(_, function)| in_arena(&function.expressions))
        || module
            .entry_points
            .iter()
            .any(|ep| in_arena(&ep.function.expressions))
}
