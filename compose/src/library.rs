//! The modules that can be imported: reading the folders, who imports whom, and the faults that show without a program.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::diag::{Diag, Diags, nearest};
use crate::scan::{Import, Item, ItemKind, Scan};

/// The longest text of one module or of one stage, in bytes: naga_oil keeps places in 21 bits, and the header that it
/// puts before a text counts too.
pub const LONGEST_TEXT: usize = 1 << 20;

/// The most modules in one library: naga_oil numbers them in what is left of 32 bits.
pub const MOST_MODULES: usize = 2000;

/// The most ways from one module through its imports to others: naga_oil walks each of them.
pub const MOST_WAYS: u64 = 1 << 17;

/// One module: a `.wgsl` file with `#define_import_path`.
#[derive(Clone, Debug)]
pub struct Module {
    /// Its import path, for instance `veduta::noise::value`.
    pub path: String,
    /// The file's name for messages.
    pub file: String,
    /// The file's text.
    pub text: String,
    /// What the scanner found.
    pub scan: Scan,
    /// The flags that the module tests.
    pub flags: BTreeSet<String>,
}

impl Module {
    /// The declaration of a name.
    pub fn item(&self, name: &str) -> Option<&Item> {
        self.scan.items.iter().find(|item| item.name == name)
    }

    /// The paths of the modules that this one imports.
    pub fn imported(&self) -> BTreeSet<&str> {
        self.scan
            .imports()
            .map(|import| import.module.as_str())
            .collect()
    }

    /// The module replaces virtual functions of others.
    pub fn overrides_functions(&self) -> bool {
        self.scan
            .items
            .iter()
            .any(|item| item.kind == ItemKind::OverridingFunction)
    }

    /// A fault at a byte of this module.
    pub fn diag(&self, at: usize, message: impl Into<String>) -> Diag {
        Diag::at(self.file.clone(), &self.text, at, message)
    }
}

/// All modules, by path.
#[derive(Clone, Debug, Default)]
pub struct Library {
    modules: BTreeMap<String, Module>,
    order: Vec<String>,
    /// `.wgsl` files without an import path: pieces for `SRC`, not modules.
    pieces: Vec<String>,
}

impl Library {
    /// Reads every `*.wgsl` file under the folders that has a `#define_import_path`.
    ///
    /// # Errors
    /// A folder or file that cannot be read, a path that two files claim, an import cycle.
    pub fn load(folders: &[PathBuf]) -> Result<Self, Diags> {
        let mut diags = Diags::new();
        let mut files = BTreeMap::new();
        for folder in folders {
            for path in files_below(folder, "wgsl", &mut diags) {
                match std::fs::read(&path).map(String::from_utf8) {
                    Ok(Ok(text)) => {
                        files.insert(shown(&path), text);
                    }
                    Ok(Err(error)) => diags.push(Diag::whole_file(
                        shown(&path),
                        format!(
                            "is not UTF-8 after byte {}",
                            error.utf8_error().valid_up_to()
                        ),
                    )),
                    Err(error) => {
                        diags.push(Diag::whole_file(
                            shown(&path),
                            format!("cannot be read: {error}"),
                        ));
                    }
                }
            }
        }
        match Self::from_sources(files.into_iter().collect()) {
            Ok(library) => diags.ok(library),
            Err(mut more) => {
                diags.append(std::mem::take(&mut more));
                Err(diags)
            }
        }
    }

    /// The same for texts in memory, each with the file name for messages.
    ///
    /// # Errors
    /// As [`Library::load`].
    pub fn from_sources(files: Vec<(String, String)>) -> Result<Self, Diags> {
        let mut diags = Diags::new();
        let mut library = Self::default();
        for (file, mut text) in files {
            if text.starts_with('\u{feff}') {
                text.drain(..'\u{feff}'.len_utf8());
            }
            let scan = Scan::new(&text);
            let Some((path, at)) = scan.import_path() else {
                // A piece for SRC, unless it tries to be a module.
                let in_path_line = |at: usize| {
                    let start = text[..at].rfind(['\n', '\r']).map_or(0, |n| n + 1);
                    text[start..].trim_start().starts_with("#def")
                };
                for fault in scan.faults.iter().filter(|fault| in_path_line(fault.at)) {
                    let mut diag = Diag::at(file.clone(), &text, fault.at, fault.message.clone());
                    diag.notes.clone_from(&fault.notes);
                    diags.push(diag);
                }
                library.pieces.push(file);
                continue;
            };
            let module = Module {
                path: path.to_owned(),
                flags: scan
                    .conditions()
                    .filter(|(.., is_flag)| *is_flag)
                    .map(|(name, ..)| name.to_owned())
                    .collect(),
                file,
                text,
                scan: scan.clone(),
            };
            if module.text.len() > LONGEST_TEXT {
                diags.push(module.diag(
                    at,
                    format!(
                        "a module of {} bytes is longer than the limit of {LONGEST_TEXT}",
                        module.text.len()
                    ),
                ));
                continue;
            }
            if let Some(first) = library.modules.get(&module.path) {
                let message = format!("module `{}` exists twice", module.path);
                diags.push(
                    module
                        .diag(at, message)
                        .note(format!("the other one is {}", place_of_path(first))),
                );
                continue;
            }
            library.modules.insert(module.path.clone(), module);
        }
        if library.modules.len() > MOST_MODULES {
            diags.push(Diag::whole_file(
                "library",
                format!(
                    "{} modules are more than the limit of {MOST_MODULES}",
                    library.modules.len()
                ),
            ));
        }
        library.sort(&mut diags);
        if diags.is_empty() {
            library.count_ways(&mut diags);
        }
        diags.ok(library)
    }

    /// The module of a path.
    pub fn get(&self, path: &str) -> Option<&Module> {
        self.modules.get(path)
    }

    /// All modules, by path.
    pub fn modules(&self) -> impl Iterator<Item = &Module> {
        self.modules.values()
    }

    /// The paths of all modules, every module after those that it imports.
    pub fn order(&self) -> &[String] {
        &self.order
    }

    /// The modules that a text with these imports reaches, in [`Library::order`].
    pub fn reached<'a>(&self, imports: impl IntoIterator<Item = &'a str>) -> Vec<&Module> {
        let mut reached: BTreeSet<&str> = BTreeSet::new();
        let mut open: Vec<&Module> = imports
            .into_iter()
            .filter_map(|path| self.modules.get(path))
            .collect();
        while let Some(module) = open.pop() {
            if reached.insert(&module.path) {
                open.extend(
                    module
                        .imported()
                        .into_iter()
                        .filter_map(|path| self.modules.get(path)),
                );
            }
        }
        self.order
            .iter()
            .filter(|path| reached.contains(path.as_str()))
            .filter_map(|path| self.modules.get(path))
            .collect()
    }

    /// Whether an import names a whole module for the sake of its `override fn`: a plug-in.
    pub fn is_plug_in(&self, import: &Import) -> bool {
        !self.modules.contains_key(&import.module)
            && self
                .modules
                .get(&import.path())
                .is_some_and(Module::overrides_functions)
    }

    /// A fault if an import names nothing, with the nearest name.
    pub fn check_import(&self, file: &str, text: &str, import: &Import) -> Option<Diag> {
        let at = |at: usize, message: String| Diag::at(file, text, at, message);
        if import.module.is_empty() {
            return Some(
                at(
                    import.at,
                    format!("`{}` is no item of a module", import.item),
                )
                .note("an import names the item: `#import veduta::hash::pcg::pcg_3d`"),
            );
        }
        let Some(module) = self.modules.get(&import.module) else {
            let whole = import.path();
            if let Some(module) = self.modules.get(&whole) {
                if module.overrides_functions() && import.local == import.item {
                    return None;
                }
                let some: Vec<&str> = module
                    .scan
                    .items
                    .iter()
                    .map(|item| item.name.as_str())
                    .take(2)
                    .collect();
                return Some(
                    at(
                        import.module_at,
                        format!("`{whole}` is a module; an import names its items"),
                    )
                    .note(format!(
                        "for instance `#import {whole}::{{{}}}`",
                        some.join(", ")
                    )),
                );
            }
            let mut diag = at(
                import.module_at,
                format!("there is no module `{}`", import.module),
            );
            if let Some(near) = nearest(&import.module, self.modules.keys().map(String::as_str)) {
                diag = diag.note(format!("did you mean `{near}`?"));
            } else if !self.pieces.is_empty() {
                diag = diag.note(format!(
                    "files without `#define_import_path` are no modules: {}",
                    self.pieces.join(", ")
                ));
            }
            return Some(diag);
        };
        if module.item(&import.item).is_none() {
            let diag = at(
                import.at,
                format!("module `{}` has no item `{}`", module.path, import.item),
            );
            return Some(diag.suggest(
                &import.item,
                module.scan.items.iter().map(|item| item.name.as_str()),
            ));
        }
        None
    }

    /// A fault for the first module with too many ways through its imports.
    fn count_ways(&self, diags: &mut Diags) {
        let mut ways: BTreeMap<&str, u64> = BTreeMap::new();
        for module in self.order.iter().filter_map(|path| self.modules.get(path)) {
            let mut own = 1u64;
            for import in module.imported() {
                own = own.saturating_add(ways.get(import).copied().unwrap_or(0));
            }
            if own > MOST_WAYS {
                let at = module.scan.import_path().map_or(0, |(_, at)| at);
                diags.push(
                    module
                        .diag(
                            at,
                            format!(
                                "the imports of this module lead to other modules in more than {MOST_WAYS} ways"
                            ),
                        )
                        .note("naga_oil walks each of them: import from fewer modules, or merge some"),
                );
                return;
            }
            ways.insert(&module.path, own);
        }
    }

    /// Orders the modules and names a cycle.
    fn sort(&mut self, diags: &mut Diags) {
        #[derive(Clone, Copy, PartialEq)]
        enum State {
            New,
            Open,
            Done,
        }
        let mut state: BTreeMap<&str, State> = self
            .modules
            .keys()
            .map(|path| (path.as_str(), State::New))
            .collect();
        let mut order = Vec::new();
        for start in self.modules.keys() {
            if state[start.as_str()] != State::New {
                continue;
            }
            // Depth first, without recursion: (module, what it imports, the next of them).
            let mut stack: Vec<(&Module, Vec<&str>, usize)> = Vec::new();
            let enter = |path: &str| {
                self.modules
                    .get(path)
                    .map(|module| (module, module.imported().into_iter().collect(), 0))
            };
            stack.extend(enter(start));
            state.insert(start, State::Open);
            while let Some((module, imported, next)) = stack.last_mut() {
                let Some(path) = imported.get(*next).copied() else {
                    state.insert(&module.path, State::Done);
                    order.push(module.path.clone());
                    stack.pop();
                    continue;
                };
                *next += 1;
                match state.get(path).copied() {
                    None | Some(State::Done) => {}
                    Some(State::New) => {
                        state.insert(path, State::Open);
                        stack.extend(enter(path));
                    }
                    Some(State::Open) => {
                        let first = stack
                            .iter()
                            .position(|(module, ..)| module.path == path)
                            .unwrap_or(0);
                        let mut names: Vec<&str> = stack[first..]
                            .iter()
                            .map(|(module, ..)| module.path.as_str())
                            .collect();
                        names.push(path);
                        let Some((module, ..)) = stack.last() else {
                            continue;
                        };
                        let at = module
                            .scan
                            .imports()
                            .find(|import| import.module == path)
                            .map_or(0, |import| import.module_at);
                        diags
                            .push(module.diag(at, format!("import cycle: {}", names.join(" -> "))));
                    }
                }
            }
        }
        self.order = order;
    }
}

/// `file:line` of a module's import path.
fn place_of_path(module: &Module) -> String {
    let at = module.scan.import_path().map_or(0, |(_, at)| at);
    let (line, column) = crate::diag::line_column(&module.text, at);
    format!("{}:{line}:{column}", module.file)
}

/// A path for messages: with `/` on every system.
pub(crate) fn shown(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// The files with an ending below a folder (or the file itself), sorted.
pub(crate) fn files_below(folder: &Path, ending: &str, diags: &mut Diags) -> Vec<PathBuf> {
    let mut files = Vec::new();
    if folder.is_file() {
        if folder.extension().is_some_and(|e| e == ending) {
            files.push(folder.to_owned());
        }
        return files;
    }
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        let entries = match std::fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                diags.push(Diag::whole_file(
                    shown(&folder),
                    format!("cannot be read: {error}"),
                ));
                continue;
            }
        };
        for entry in entries.flatten() {
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == ending) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}
