//! Everything that can be named on the command line: modules, programs, keys, presets, scenes and views, those that ship
//! and those of the user, and the variants that are composed at run time.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use veduta::program::{PresetTable, SceneTable};
use veduta::{Preset, ProgramSet, Settings, Value};
use veduta_compose::keys::Keys;
use veduta_compose::naga::valid::Capabilities;
use veduta_compose::settings::{Presets, Scene, View};
use veduta_compose::sp::SpFile;
use veduta_compose::{Composer, Diag, Diags, Library};

use crate::error::CliError;

/// Where shaders, presets, scenes and views come from, beside those that ship.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct SourceArgs {
    /// A folder with modules (.wgsl), programs (.sp) and their keys.ron, all of your own; may be repeated
    #[arg(long = "modules", value_name = "DIR")]
    pub modules: Vec<PathBuf>,
    /// A folder with keys.ron, presets (*.ron), scenes/*.ron and views/*.ron of your own; may be repeated
    #[arg(long = "presets", value_name = "DIR")]
    pub presets: Vec<PathBuf>,
    /// Leave out what veduta ships
    #[arg(long)]
    pub no_shipped: bool,
}

/// A capability beyond WebGPU's core that shaders may need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Claim {
    /// Half precision: `enable f16`.
    F16,
    /// Operations over subgroups: `enable subgroups`.
    Subgroups,
}

/// The capabilities that claims name.
pub fn claimed(claims: &[Claim]) -> Capabilities {
    let names = claims.iter().map(|claim| match claim {
        Claim::F16 => "f16",
        Claim::Subgroups => "subgroups",
    });
    names
        .filter_map(veduta_compose::compose::capability)
        .fold(Capabilities::empty(), |a, b| a | b)
}

/// A file's name without folder and ending, the file's name for messages, and its text.
pub type NamedText = (String, String, String);

/// The texts of files by what they are.
#[derive(Debug, Clone, Default)]
pub struct Texts {
    /// Modules and pieces of shaders: file and text.
    pub modules: Vec<(String, String)>,
    /// Programs.
    pub programs: Vec<NamedText>,
    /// Declarations of keys: file and text.
    pub keys: Vec<(String, String)>,
    /// Presets.
    pub presets: Vec<NamedText>,
    /// Scenes.
    pub scenes: Vec<NamedText>,
    /// Views.
    pub views: Vec<NamedText>,
    /// Atmospheres.
    pub atmospheres: Vec<NamedText>,
}

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A module or a piece of a shader.
    Module,
    /// A program.
    Program,
    /// Declarations of keys.
    Keys,
    /// A preset.
    Preset,
    /// A scene.
    Scene,
    /// A view.
    View,
    /// An atmosphere.
    Atmosphere,
}

impl Texts {
    /// Adds a text under what it is.
    pub fn add(&mut self, kind: FileKind, file: String, text: String) {
        let name = stem(Path::new(&file));
        match kind {
            FileKind::Module => self.modules.push((file, text)),
            FileKind::Program => self.programs.push((name, file, text)),
            FileKind::Keys => self.keys.push((file, text)),
            FileKind::Preset => self.presets.push((name, file, text)),
            FileKind::Scene => self.scenes.push((name, file, text)),
            FileKind::View => self.views.push((name, file, text)),
            FileKind::Atmosphere => self.atmospheres.push((name, file, text)),
        }
    }

    /// Takes a file out.
    pub fn remove(&mut self, file: &str) {
        self.modules.retain(|(name, _)| name != file);
        self.keys.retain(|(name, _)| name != file);
        for texts in [
            &mut self.programs,
            &mut self.presets,
            &mut self.scenes,
            &mut self.views,
            &mut self.atmospheres,
        ] {
            texts.retain(|(_, name, _)| name != file);
        }
    }

    /// What ships.
    pub fn shipped() -> Texts {
        let mut texts = Texts::default();
        for (file, text) in crate::shipped::FILES {
            if let Some(kind) = kind_by_place(Path::new(file)) {
                texts.add(kind, crate::shipped::name(file), (*text).to_owned());
            }
        }
        texts
    }

    /// What ships, unless it is to be left out, and what the user's folders hold.
    ///
    /// # Errors
    /// [`CliError::Missing`] for a path that is no folder, [`CliError::Read`] for files that cannot be read.
    pub fn load(sources: &SourceArgs) -> Result<Texts, CliError> {
        let mut texts = if sources.no_shipped {
            Texts::default()
        } else {
            Texts::shipped()
        };
        for folder in &sources.modules {
            for path in files_below(folder)? {
                let kind = match path.extension().and_then(|e| e.to_str()) {
                    Some("wgsl") => FileKind::Module,
                    Some("sp") => FileKind::Program,
                    // A project may declare its keys beside its shaders.
                    _ if path == folder.join("keys.ron") => FileKind::Keys,
                    _ => continue,
                };
                let text = read(&path)?;
                texts.add(kind, shown(&path), text);
            }
        }
        for folder in &sources.presets {
            for path in files_below(folder)? {
                let below = path.strip_prefix(folder).unwrap_or(&path);
                if let Some(kind) = kind_in_presets(below) {
                    let text = read(&path)?;
                    texts.add(kind, shown(&path), text);
                }
            }
        }
        Ok(texts)
    }
}

/// The kind of a shipped file, whose path begins with `wgsl` or `presets`.
fn kind_by_place(path: &Path) -> Option<FileKind> {
    match path.extension()?.to_str()? {
        "wgsl" => Some(FileKind::Module),
        "sp" => Some(FileKind::Program),
        "ron" => kind_in_presets(path.strip_prefix("presets").ok()?),
        _ => None,
    }
}

/// The kind of a file by its path inside a folder of presets; `None` for a file that is none of ours.
fn kind_in_presets(path: &Path) -> Option<FileKind> {
    if path.extension()? != "ron" {
        return None;
    }
    let folder = path.parent().and_then(Path::to_str)?;
    match folder {
        "" if path.file_name()? == "keys.ron" => Some(FileKind::Keys),
        "" => Some(FileKind::Preset),
        "scenes" => Some(FileKind::Scene),
        "views" => Some(FileKind::View),
        "atmospheres" => Some(FileKind::Atmosphere),
        _ => None,
    }
}

/// A path with `/` on every system.
pub fn shown(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Reads a text file; anything that is not UTF-8 is a fault of the file.
///
/// # Errors
/// [`CliError::Read`], [`CliError::Faults`].
pub fn read(path: &Path) -> Result<String, CliError> {
    let bytes = std::fs::read(path).map_err(|e| CliError::read(path, e))?;
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Diags::from(Diag::whole_file(
            shown(path),
            format!("is not UTF-8 after byte {at}"),
        ))
        .into()
    })
}

/// Every file below a folder in the order of their paths; hidden files and folders and `target` are left out.
///
/// # Errors
/// [`CliError::Missing`] for a path that is no folder, [`CliError::Read`].
pub fn files_below(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    if !folder.is_dir() {
        return Err(CliError::Missing {
            what: "folder",
            name: folder.display().to_string(),
            hint: String::new(),
        });
    }
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        let entries = std::fs::read_dir(&folder).map_err(|e| CliError::read(&folder, e))?;
        for entry in entries {
            let entry = entry.map_err(|e| CliError::read(&folder, e))?;
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let kind = entry
                .file_type()
                .map_err(|e| CliError::read(&entry.path(), e))?;
            // A link to a folder is left out: it may lead back to where we come from.
            if kind.is_dir() {
                if !name.starts_with('.') && name != "target" {
                    open.push(entry.path());
                }
            } else if !name.starts_with('.') && entry.path().is_file() {
                files.push(entry.path());
            }
        }
    }
    files.sort();
    Ok(files)
}

/// All that can be named, read and checked.
#[derive(Debug, Clone)]
pub struct Catalog {
    texts: Texts,
    keys: Keys,
    presets: Presets,
    scenes: BTreeMap<String, Scene>,
    views: BTreeMap<String, View>,
    set: ProgramSet,
}

impl Catalog {
    /// Reads everything.
    ///
    /// # Errors
    /// [`CliError::Faults`] with every fault of keys, presets, scenes and views, and the faults of [`Texts::load`].
    pub fn load(sources: &SourceArgs) -> Result<Catalog, CliError> {
        Catalog::new(Texts::load(sources)?)
    }

    fn new(texts: Texts) -> Result<Catalog, CliError> {
        let keys = Keys::load(&texts.keys)?;
        let mut faults = Diags::new();
        let presets = match Presets::load(&keys, &texts.presets) {
            Ok(presets) => presets,
            Err(found) => {
                faults.append(found);
                Presets::default()
            }
        };
        let mut scenes = BTreeMap::new();
        for (name, file, text) in &texts.scenes {
            match Scene::parse(&keys, name, file, text) {
                Ok(scene) => insert(&mut scenes, "scene", name, file, scene, &mut faults),
                Err(found) => faults.append(found),
            }
        }
        let mut views = BTreeMap::new();
        for (name, file, text) in &texts.views {
            match View::parse(name, file, text) {
                Ok(view) => insert(&mut views, "view", name, file, view, &mut faults),
                Err(found) => faults.append(found),
            }
        }
        let mut programs = BTreeMap::new();
        for (name, file, _) in &texts.programs {
            insert(&mut programs, "program", name, file, (), &mut faults);
        }
        let mut catalog = Catalog {
            texts,
            keys,
            presets,
            scenes,
            views,
            set: ProgramSet::default(),
        };
        faults.ok(())?;
        // A program of the user may have the name of one that ships only when nothing ships.
        let shipped = veduta::programs();
        catalog.set.default_preset = shipped.default_preset.clone();
        if catalog
            .texts
            .programs
            .iter()
            .any(|(_, file, _)| crate::shipped::text(file).is_some())
        {
            catalog.set.programs = shipped.programs.clone();
        }
        catalog.fill_set();
        Ok(catalog)
    }

    /// Puts keys, presets and scenes into the set of programs, whose shipped tables are the same values.
    fn fill_set(&mut self) {
        self.set.keys = self.keys.iter().map(key_table).collect();
        self.set.presets = self
            .presets
            .names()
            .map(|name| preset_table(&self.presets, name))
            .collect();
        self.set.scenes = self.scenes.values().map(scene_table).collect();
    }

    /// Keys, presets, scenes and the variants that were built or composed so far.
    pub fn set(&self) -> &ProgramSet {
        &self.set
    }

    /// The names of the programs, in alphabetical order.
    pub fn programs(&self) -> impl Iterator<Item = &str> {
        let names: BTreeSet<&str> = self
            .texts
            .programs
            .iter()
            .map(|(name, ..)| name.as_str())
            .collect();
        names.into_iter()
    }

    /// The declared keys.
    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    /// The presets.
    pub fn presets(&self) -> Vec<&veduta_compose::settings::Preset> {
        self.presets.iter().collect()
    }

    /// The preset tables, for [`veduta_compose::settings::resolve`].
    pub fn preset_table(&self) -> &Presets {
        &self.presets
    }

    /// The scenes in the order of their names.
    pub fn scenes(&self) -> Vec<&Scene> {
        self.scenes.values().collect()
    }

    /// The views in the order of their names.
    pub fn views(&self) -> Vec<&View> {
        self.views.values().collect()
    }

    /// A preset by its name or file; a file's preset becomes part of the catalog.
    ///
    /// # Errors
    /// [`CliError::Missing`] for an unknown name or a missing file, [`CliError::Faults`] for a faulty file.
    pub fn preset(&mut self, name: &str) -> Result<Preset, CliError> {
        if let Some((name, file, text)) = own_file(name)? {
            let mut files = self.texts.presets.clone();
            files.retain(|(known, ..)| *known != name);
            files.push((name.clone(), file, text));
            self.presets = Presets::load(&self.keys, &files)?;
            self.texts.presets = files;
            self.fill_set();
            return Ok(Preset::Named(Cow::Owned(name)));
        }
        if self.presets.get(name).is_none() {
            return Err(missing("preset", name, self.presets.names()));
        }
        Ok(Preset::Named(Cow::Owned(name.to_owned())))
    }

    /// The name of a scene by its name or file; a file's scene becomes part of the catalog.
    ///
    /// # Errors
    /// As [`Catalog::preset`], and [`CliError::Missing`] for a scene whose program does not exist.
    pub fn scene(&mut self, name: &str) -> Result<String, CliError> {
        let name = match own_file(name)? {
            Some((name, file, text)) => {
                let scene = Scene::parse(&self.keys, &name, &file, &text)?;
                self.scenes.insert(name.clone(), scene);
                self.fill_set();
                name
            }
            None => name.to_owned(),
        };
        let Some(scene) = self.scenes.get(&name) else {
            return Err(missing(
                "scene",
                &name,
                self.scenes.keys().map(String::as_str),
            ));
        };
        if !self.programs().any(|p| p == scene.program) {
            return Err(missing("program", &scene.program, self.programs()));
        }
        Ok(name)
    }

    /// The scene of a name that [`Catalog::scene`] has returned.
    pub fn scene_of(&self, name: &str) -> Option<&Scene> {
        self.scenes.get(name)
    }

    /// A view by its name or file.
    ///
    /// # Errors
    /// As [`Catalog::preset`].
    pub fn view(&self, name: &str) -> Result<View, CliError> {
        if let Some((name, file, text)) = own_file(name)? {
            return Ok(View::parse(&name, &file, &text)?);
        }
        self.views
            .get(name)
            .cloned()
            .ok_or_else(|| missing("view", name, self.views.keys().map(String::as_str)))
    }

    /// A program by its name or `.sp` file; with the file comes its folder of shaders for `SRC`.
    ///
    /// # Errors
    /// [`CliError::Missing`] for an unknown name, [`CliError::Faults`] for a faulty file.
    pub fn program(&self, name: &str) -> Result<SpFile, CliError> {
        if is_file_name(name, "sp") {
            let path = Path::new(name);
            return Ok(veduta_compose::sp::parse(&shown(path), &read(path)?)?);
        }
        let found = self.texts.programs.iter().find(|(known, ..)| known == name);
        match found {
            Some((_, file, text)) => Ok(veduta_compose::sp::parse(file, text)?),
            None => Err(missing("program", name, self.programs())),
        }
    }

    /// The modules.
    ///
    /// # Errors
    /// [`CliError::Faults`]: a path that two files claim, an import cycle.
    pub fn library(&self) -> Result<Library, CliError> {
        Ok(Library::from_sources(self.texts.modules.clone())?)
    }

    /// A composer over the modules; the files of `SRC` tags come from what ships where they are there, else from the disk.
    ///
    /// # Errors
    /// As [`Catalog::library`].
    pub fn composer(&self) -> Result<Composer, CliError> {
        Ok(composer(&self.library()?, self.keys.clone()))
    }

    /// Sees to it that the set holds the variant of a program that these settings name.
    ///
    /// # Errors
    /// [`CliError::Faults`] with every fault of the program.
    pub fn ensure(&mut self, program: &str, settings: &Settings) -> Result<(), CliError> {
        let features = settings.features();
        // The variants that were built have the declared sizes.
        let sized = self.keys.iter().any(|key| {
            key.ty == veduta_compose::keys::KeyType::Size
                && settings.get(&key.name) != Some(value_of(key.default))
        });
        if !sized && self.set.get(program, &features).is_ok() {
            return Ok(());
        }
        let sp = self.program(program)?;
        let features: BTreeSet<String> = features.iter().map(|f| (*f).to_owned()).collect();
        let sizes: BTreeMap<String, i64> = settings
            .iter()
            .filter_map(|(name, value)| match value {
                Value::Int(size) => Some((name.to_owned(), size)),
                _ => None,
            })
            .collect();
        let composed = self.composer()?.compose(&sp, &features, &sizes)?;
        let mut composed = veduta::compose::program(&composed)?;
        composed.program = program.to_owned().into();
        let programs = self.set.programs.to_mut();
        programs.retain(|p| p.program != composed.program || p.features != composed.features);
        programs.push(composed);
        Ok(())
    }
}

impl Catalog {
    /// Sees to it that the set holds a variant of a system's program, with the declared sizes.
    ///
    /// # Errors
    /// As [`Catalog::ensure`].
    pub fn ensure_variant(&mut self, program: &str, features: &[&str]) -> Result<(), CliError> {
        if self.set.get(program, features).is_ok() {
            return Ok(());
        }
        let sp = self.program(program)?;
        let features: BTreeSet<String> = features.iter().map(|f| (*f).to_owned()).collect();
        let composed = self.composer()?.compose(&sp, &features, &BTreeMap::new())?;
        let mut composed = veduta::compose::program(&composed)?;
        composed.program = program.to_owned().into();
        self.set.programs.to_mut().push(composed);
        Ok(())
    }
}

/// A composer over a library that reads the files of `SRC` tags from what ships where they are there, else from the disk.
pub fn composer(library: &Library, keys: Keys) -> Composer {
    Composer::new(library, keys).reader(Box::new(|path| match crate::shipped::text(path) {
        Some(text) => Ok(text.to_owned()),
        None => std::fs::read_to_string(path),
    }))
}

fn insert<T>(
    map: &mut BTreeMap<String, T>,
    what: &str,
    name: &str,
    file: &str,
    value: T,
    faults: &mut Diags,
) {
    if map.insert(name.to_owned(), value).is_some() {
        faults.push(Diag::whole_file(file, format!("a second {what} `{name}`")));
    }
}

fn missing<'a>(what: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> CliError {
    let known: Vec<&str> = known.collect();
    let hint = match veduta_compose::diag::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", known.join(", ")),
    };
    CliError::Missing {
        what,
        name: name.to_owned(),
        hint,
    }
}

fn is_file_name(name: &str, ending: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| e == ending)
}

/// The name, file and text of a `.ron` file of the user; `None` when `name` is no file name.
fn own_file(name: &str) -> Result<Option<NamedText>, CliError> {
    if !is_file_name(name, "ron") {
        return Ok(None);
    }
    let path = Path::new(name);
    Ok(Some((stem(path), shown(path), read(path)?)))
}

/// Reads the values of `--set`.
///
/// # Errors
/// [`CliError::Faults`] for a text without `=`, the faults of [`veduta::program::Key::parse`], and [`CliError::Argument`] for a key
/// that is given twice.
pub fn parse_sets(set: &ProgramSet, sets: &[String]) -> Result<Vec<(String, Value)>, CliError> {
    let mut values: Vec<(String, Value)> = Vec::new();
    for text in sets {
        let (name, value) = veduta_compose::settings::split_set(text).map_err(Diags::from)?;
        let value = set.key(&name)?.parse(&value)?;
        if values.iter().any(|(known, _)| *known == name) {
            return Err(CliError::argument("--set", text, "given once for each key"));
        }
        values.push((name, value));
    }
    Ok(values)
}

fn value_of(value: veduta_compose::keys::Value) -> Value {
    use veduta_compose::keys::Value as V;
    match value {
        V::Flag(v) => Value::Flag(v),
        V::Int(v) => Value::Int(v),
        V::Float(v) => Value::Float(v),
        V::Vec3(v) => Value::Vec3(v),
    }
}

fn key_table(key: &veduta_compose::keys::Key) -> veduta::program::Key {
    use veduta::program::KeyKind;
    veduta::program::Key {
        name: key.name.clone().into(),
        kind: match key.kind {
            veduta_compose::keys::KeyKind::Quality => KeyKind::Quality,
            veduta_compose::keys::KeyKind::Content => KeyKind::Content,
        },
        ty: key.ty.to_string().into(),
        domain: key.domain,
        default: value_of(key.default),
        unit: key.unit.clone().into(),
        meaning: key.meaning.clone().into(),
    }
}

/// The values of a preset and of those that it is based on.
fn preset_table(presets: &Presets, name: &str) -> PresetTable {
    let mut values = BTreeMap::new();
    for preset in presets.chain(name).into_iter().rev() {
        for setting in &preset.values {
            values.insert(setting.key.clone(), value_of(setting.value));
        }
    }
    PresetTable {
        name: name.to_owned().into(),
        values: values.into_iter().map(|(k, v)| (k.into(), v)).collect(),
    }
}

fn scene_table(scene: &Scene) -> SceneTable {
    let mut features = scene.features.clone();
    features.sort();
    let content: BTreeMap<&String, Value> = scene
        .content
        .iter()
        .map(|(k, v)| (k, value_of(*v)))
        .collect();
    SceneTable {
        name: scene.name.clone().into(),
        program: scene.program.clone().into(),
        features: features.into_iter().map(Into::into).collect(),
        content: content
            .into_iter()
            .map(|(k, v)| (k.clone().into(), v))
            .collect(),
        meaning: scene.meaning.clone().into(),
    }
}
