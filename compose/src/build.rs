//! For build scripts: reads the folders, composes every variant that is needed, writes one Rust file.
//!
//! A user's whole build script:
//! ```no_run
//! veduta_compose::Build::new().modules("shaders").programs("shaders").preset("thesis_low").write();
//! ```
//! and in the program `mod shaders { include!(concat!(env!("OUT_DIR"), "/veduta_programs.rs")); }`.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::compose::{Composed, Composer, Program};
use crate::diag::{Diag, Diags, line_at};
use crate::emit::{Emission, emit};
use crate::keys::{KeyType, Keys};
use crate::library::{Library, files_below, shown};
use crate::lint::push_new;
use crate::settings::{Presets, Scene, resolve};

/// What a build script composes, and from what. Folders are relative to the package that is built.
#[derive(Clone, Debug)]
pub struct Build {
    modules: Vec<PathBuf>,
    programs: Vec<PathBuf>,
    scenes: Vec<PathBuf>,
    keys: Vec<PathBuf>,
    presets: Vec<String>,
    plug_ins: Vec<String>,
    variants: Vec<(String, BTreeSet<String>)>,
    claims: Vec<String>,
    prefix: String,
    own: Option<(PathBuf, PathBuf)>,
    shipped_programs: Option<bool>,
    file: String,
}

/// Variants of veduta's own programs that no scene names, beside those without any feature: those of systems that a host takes alone, each once
/// more for air of many layers.
fn system_variants(program: &str) -> Vec<BTreeSet<String>> {
    let ways: &[&[&str]] = match program {
        "sky" => &[
            &[],
            &["SUN_DISC"],
            &["SKY_MARCH"],
            &["SKY_MARCH", "SUN_DISC"],
            &["AERIAL"],
            &["AERIAL", "AERIAL_TARGETS"],
            &["AERIAL", "AERIAL_ALPHA"],
        ],
        "air_columns" | "air_diffuse" | "air_transmittance" | "sky_view" | "sky_refine"
        | "sky_columns" | "sky_aerial" | "sky_probe" | "sky_query" | "probe" => &[&[]],
        "terrain" => {
            return vec![
                BTreeSet::new(),
                BTreeSet::from(["CLOUD_SHADOWS".to_owned()]),
            ];
        }
        "terrain_heights" | "terrain_globe" | "terrain_globe_heights" => {
            return vec![BTreeSet::new()];
        }
        "terrain_bake" => {
            return vec![
                BTreeSet::new(),
                BTreeSet::from(["CLIP_SECTORS".to_owned()]),
                BTreeSet::from(["CLIP_SHADES".to_owned()]),
            ];
        }
        "terrain_rays" | "terrain_globe_rays" => {
            return vec![BTreeSet::new(), BTreeSet::from(["TERRAIN_FAST".to_owned()])];
        }
        "cloud_tile" | "cloud_window" => {
            let mut kinds = vec![vec![], vec!["CLOUD_SHAPED"]];
            let mut bits = vec![vec![], vec!["CLOUD_WIDE"]];
            if program == "cloud_tile" {
                kinds.push(vec!["CLOUD_SHAPED", "CLOUD_MAPPED"]);
                bits.push(vec!["CLOUD_LOW_SUN"]);
                bits.push(vec!["CLOUD_LOW_SUN", "CLOUD_WIDE"]);
            }
            return bits
                .iter()
                .flat_map(|bits| kinds.iter().map(move |kind| [&kind[..], bits].concat()))
                .map(|flags| flags.into_iter().map(str::to_owned).collect())
                .collect();
        }
        "ground_plan" | "ground_level" | "ground_edit" | "ground_range" | "ground_shape"
        | "ground_smooth" | "ground_shallow" | "ground_advance" | "ground_query"
        | "ground_surface" | "ground_normals" | "ground_picture" => {
            return vec![BTreeSet::new()];
        }
        "ground_speeds" | "ground_transport" => {
            return vec![
                BTreeSet::new(),
                BTreeSet::from(["GROUND_EROSION".to_owned()]),
            ];
        }
        "cloud_probe" => {
            return vec![
                BTreeSet::new(),
                BTreeSet::from(["CLOUD_TILE".to_owned()]),
                BTreeSet::from(["CLOUD_SHADOW".to_owned()]),
                BTreeSet::from(["CLOUD_SHAPED".to_owned()]),
                BTreeSet::from(["CLOUD_MAPPED".to_owned(), "CLOUD_SHAPED".to_owned()]),
            ];
        }
        "cloud_layer" => {
            let ways: [&[&str]; 8] = [
                &[],
                &["CLOUD_OVER_DEPTH"],
                &["CLOUD_ORDERS"],
                &["CLOUD_ORDERS", "CLOUD_OVER_DEPTH"],
                &["CLOUD_ABOVE"],
                &["CLOUD_ABOVE", "CLOUD_OVER_DEPTH"],
                &["CLOUD_ABOVE", "CLOUD_ORDERS"],
                &["CLOUD_ABOVE", "CLOUD_ORDERS", "CLOUD_OVER_DEPTH"],
            ];
            let airs: [&[&str]; 3] = [&[], &["CLOUD_AIR"], &["CLOUD_AIR", "AIR_EIGHT_LANES"]];
            let set = |way: &[&str], air: &[&str]| {
                way.iter().chain(air).map(|f| (*f).to_owned()).collect()
            };
            let drawn = airs
                .iter()
                .flat_map(|air| ways.iter().map(move |way| set(way, air)));
            let windowed = airs.iter().flat_map(|air| {
                let own = [&["CLOUD_WINDOW"], *air].concat();
                ways.iter().map(move |way| set(way, &own))
            });
            let laid: [&[&str]; 2] = [&[], &["CLOUD_OVER_DEPTH"]];
            return drawn
                .chain(windowed)
                .chain(laid.iter().map(|way| set(&["CLOUD_UPSAMPLE"], way)))
                .collect();
        }
        "cloud_volume" => {
            let ways: [&[&str]; 15] = [
                &[],
                &["CLOUD_READS_NODES"],
                &["CLOUD_NODES"],
                &["CLOUD_CELLS"],
                &["CLOUD_SWEEP"],
                &["CLOUD_GATHER"],
                &["CLOUD_GATHER", "CLOUD_PROLONG"],
                &["CLOUD_LAYERED"],
                &["CLOUD_LAYERED", "CLOUD_CELLS"],
                &["CLOUD_LAYERED", "CLOUD_SWEEP"],
                &["CLOUD_LAYERED", "CLOUD_GATHER"],
                &["CLOUD_LAYERED", "CLOUD_GATHER", "CLOUD_PROLONG"],
                &["CLOUD_LAYERED", "CLOUD_PUBLISH"],
                &["CLOUD_LAYERED", "CLOUD_CELLS", "CLOUD_WINDOW"],
                &["CLOUD_LAYERED", "CLOUD_PUBLISH", "CLOUD_WINDOW"],
            ];
            let set = |flags: &&[&str]| flags.iter().map(|f| (*f).to_owned()).collect();
            return ways.iter().map(set).collect();
        }
        _ => &[],
    };
    let set = |flags: &[&str]| flags.iter().map(|f| (*f).to_owned()).collect();
    ways.iter()
        .flat_map(|way| [set(way), set(&[*way, &["AIR_EIGHT_LANES"]].concat())])
        .collect()
}

/// What a build comes to.
#[derive(Clone, Debug)]
pub struct Output {
    /// The Rust source.
    pub rust: String,
    /// The variants in it.
    pub programs: Vec<Composed>,
    /// The presets whose tables are in it.
    pub presets: Vec<String>,
    /// The preset that holds when none is named.
    pub default_preset: String,
}

impl Default for Build {
    fn default() -> Self {
        Self::new()
    }
}

impl Build {
    /// A build of a package that depends on veduta. Without further words it composes veduta's own programs with
    /// veduta's default preset.
    pub fn new() -> Self {
        Self {
            modules: Vec::new(),
            programs: Vec::new(),
            scenes: Vec::new(),
            keys: Vec::new(),
            presets: Vec::new(),
            plug_ins: Vec::new(),
            variants: Vec::new(),
            claims: Vec::new(),
            prefix: "::veduta".to_owned(),
            own: None,
            shipped_programs: None,
            file: "veduta_programs.rs".to_owned(),
        }
    }

    /// The build of veduta itself: its folders of modules and programs and of presets.
    pub fn of_veduta(wgsl: impl Into<PathBuf>, presets: impl Into<PathBuf>) -> Self {
        let mut build = Self::new();
        build.prefix = "crate".to_owned();
        build.own = Some((wgsl.into(), presets.into()));
        build
    }

    /// Adds a folder of modules: every `.wgsl` file with `#define_import_path` below it.
    #[must_use]
    pub fn modules(mut self, folder: impl Into<PathBuf>) -> Self {
        self.modules.push(folder.into());
        self
    }

    /// Adds a folder of programs: every `.sp` file below it. veduta's own programs are then left out, unless
    /// [`Build::shipped_programs`] asks for them.
    #[must_use]
    pub fn programs(mut self, folder: impl Into<PathBuf>) -> Self {
        self.programs.push(folder.into());
        self
    }

    /// Whether to compose veduta's own programs. Default: if no folder of programs is given.
    #[must_use]
    pub fn shipped_programs(mut self, yes: bool) -> Self {
        self.shipped_programs = Some(yes);
        self
    }

    /// Adds a folder of scenes: every `.ron` file in it. Their features decide which variants are composed.
    #[must_use]
    pub fn scenes(mut self, folder: impl Into<PathBuf>) -> Self {
        self.scenes.push(folder.into());
        self
    }

    /// Adds a file with declarations of keys beyond veduta's.
    #[must_use]
    pub fn keys(mut self, file: impl Into<PathBuf>) -> Self {
        self.keys.push(file.into());
        self
    }

    /// Adds a preset: the name of one that veduta ships (`thesis_low`), or the path of a `.ron` file. The first one
    /// holds when none is named at run time.
    #[must_use]
    pub fn preset(mut self, preset: impl Into<String>) -> Self {
        self.presets.push(preset.into());
        self
    }

    /// Lets the `override fn` of a module take effect in every program that reaches the virtual function.
    #[must_use]
    pub fn plug_in(mut self, module: impl Into<String>) -> Self {
        self.plug_ins.push(module.into());
        self
    }

    /// Adds a variant that no scene needs.
    #[must_use]
    pub fn variant<'a>(
        mut self,
        program: impl Into<String>,
        features: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        self.variants.push((
            program.into(),
            features.into_iter().map(str::to_owned).collect(),
        ));
        self
    }

    /// Claims a capability beyond WebGPU's core; known are `f16` and `subgroups`.
    #[must_use]
    pub fn claim(mut self, capability: impl Into<String>) -> Self {
        self.claims.push(capability.into());
        self
    }

    /// The name of the file in `OUT_DIR`; `veduta_programs.rs` if not given.
    #[must_use]
    pub fn file(mut self, name: impl Into<String>) -> Self {
        self.file = name.into();
        self
    }

    /// Composes and writes `OUT_DIR/veduta_programs.rs`. A fault is printed for Cargo, with its place, and ends the
    /// build.
    pub fn write(&self) {
        if let Err(diags) = self.try_write() {
            for diag in diags.iter() {
                for line in diag.to_string().lines() {
                    println!("cargo::error={line}");
                }
            }
            std::process::exit(1);
        }
    }

    /// [`Build::write`] for those who want to handle the faults.
    ///
    /// # Errors
    /// Every fault of every file, and an `OUT_DIR` that is missing or cannot be written.
    pub fn try_write(&self) -> Result<Output, Diags> {
        for name in [
            "DEP_VEDUTA_WGSL",
            "DEP_VEDUTA_PRESETS",
            "DEP_VEDUTA_DEFAULT_PRESET",
        ] {
            println!("cargo::rerun-if-env-changed={name}");
        }
        let mut watched = BTreeSet::new();
        let outcome = self.run_watched(&mut watched);
        // Also after a fault, so that mending the file starts the next try.
        for path in &watched {
            println!("cargo::rerun-if-changed={}", shown(path));
        }
        let output = outcome?;
        let Some(out) = std::env::var_os("OUT_DIR") else {
            return Err(
                Diag::whole_file("OUT_DIR", "is not set: this belongs in a build script").into(),
            );
        };
        let path = Path::new(&out).join(&self.file);
        std::fs::write(&path, &output.rust).map_err(|error| {
            Diag::whole_file(shown(&path), format!("cannot be written: {error}"))
        })?;
        Ok(output)
    }

    /// Composes without writing anything.
    ///
    /// # Errors
    /// Every fault of every file.
    pub fn run(&self) -> Result<Output, Diags> {
        self.run_watched(&mut BTreeSet::new())
    }

    fn run_watched(&self, watched: &mut BTreeSet<PathBuf>) -> Result<Output, Diags> {
        let (wgsl, presets, default) = self.shipped()?;
        let mut diags = Diags::new();

        // Keys, presets, scenes.
        let mut key_files = vec![presets.join("keys.ron")];
        key_files.extend(self.keys.iter().cloned());
        let mut own_keys: BTreeSet<PathBuf> = BTreeSet::new();
        for folder in self.modules.iter().chain(&self.programs) {
            // A project may declare its keys beside its shaders.
            let file = folder.join("keys.ron");
            if file.is_file() && !key_files.contains(&file) && own_keys.insert(file.clone()) {
                key_files.push(file);
            }
        }
        let keys = Keys::load(&read_all(&key_files, watched, &mut diags));
        let keys = match keys {
            Ok(keys) if diags.is_empty() => keys,
            Ok(_) => return Err(diags),
            Err(found) => {
                diags.append(found);
                return Err(diags);
            }
        };
        let mut preset_files = ron_files(&presets, watched, &mut diags);
        preset_files.retain(|path| path.file_name().is_none_or(|name| name != "keys.ron"));
        let mut preset_names = Vec::new();
        for preset in &self.presets {
            if preset.ends_with(".ron") || preset.contains(['/', '\\']) {
                let path = PathBuf::from(preset);
                preset_names.push(stem(&path));
                if !preset_files.contains(&path) {
                    preset_files.push(path);
                }
            } else {
                preset_names.push(preset.clone());
            }
        }
        let named: Vec<(String, String, String)> = read_all(&preset_files, watched, &mut diags)
            .into_iter()
            .map(|(file, text)| (stem(Path::new(&file)), file, text))
            .collect();
        let presets_read = match Presets::load(&keys, &named) {
            Ok(read) => read,
            Err(found) => {
                diags.append(found);
                return Err(diags);
            }
        };
        if preset_names.is_empty() {
            match (&self.own, default) {
                // veduta itself carries all of its presets.
                (Some(_), default) => {
                    let default = default.unwrap_or_else(|| "thesis".to_owned());
                    preset_names.push(default.clone());
                    let others = presets_read.names().filter(|name| *name != default);
                    preset_names.extend(others.map(str::to_owned));
                }
                (None, default) => {
                    preset_names.push(default.unwrap_or_else(|| "thesis".to_owned()))
                }
            }
        }
        for name in &preset_names {
            if presets_read.get(name).is_none() {
                diags.push(
                    Diag::whole_file("build.rs", format!("there is no preset `{name}`"))
                        .suggest(name, presets_read.names()),
                );
            }
        }
        let with_shipped = self.shipped_programs.unwrap_or(self.programs.is_empty());
        let mut scene_files = Vec::new();
        if with_shipped {
            scene_files.extend(ron_files(&presets.join("scenes"), watched, &mut diags));
        }
        for folder in &self.scenes {
            scene_files.extend(ron_files(folder, watched, &mut diags));
        }
        let mut scenes = Vec::new();
        for (file, text) in read_all(&scene_files, watched, &mut diags) {
            match Scene::parse(&keys, &stem(Path::new(&file)), &file, &text) {
                Ok(scene) => scenes.push(scene),
                Err(found) => diags.append(found),
            }
        }
        if !diags.is_empty() {
            return Err(diags);
        }

        // Modules and programs.
        let mut folders = vec![wgsl.clone()];
        folders.extend(self.modules.iter().cloned());
        for folder in folders.iter().chain(&self.programs) {
            watch(folder, watched);
        }
        let library = Library::load(&folders)?;
        let mut program_files = Vec::new();
        if with_shipped {
            program_files.extend(files_below(&wgsl, "sp", &mut diags));
        }
        for folder in &self.programs {
            program_files.extend(files_below(folder, "sp", &mut diags));
        }
        program_files.dedup();

        let mut composer = Composer::new(&library, keys)
            .plug_ins(self.plug_ins.clone())
            .require_headers(self.own.is_some());
        for claim in &self.claims {
            match crate::compose::capability(claim) {
                Some(capability) => composer = composer.claim(capability),
                None => diags.push(
                    Diag::whole_file(
                        "build.rs",
                        format!("there is no capability `{claim}` to claim"),
                    )
                    .note("known are `f16` and `subgroups`"),
                ),
            }
        }
        for plug_in in &self.plug_ins {
            if !library
                .get(plug_in)
                .is_some_and(crate::library::Module::overrides_functions)
            {
                diags.push(Diag::whole_file(
                    "build.rs",
                    format!("`{plug_in}` is no module with an `override fn`"),
                ));
            }
        }
        diags.append(composer.check_modules());

        let mut programs: BTreeMap<(String, Vec<String>), (Composed, Origin)> = BTreeMap::new();
        let mut known = BTreeSet::new();
        for path in &program_files {
            let file = shown(path);
            let bytes = match std::fs::read(path) {
                Ok(bytes) => bytes,
                Err(error) => {
                    diags.push(Diag::whole_file(file, format!("cannot be read: {error}")));
                    continue;
                }
            };
            // veduta's own programs declare every override as a key; a user's need not.
            composer.allow_any_override(!path.starts_with(&wgsl));
            let prepared = crate::sp::parse_bytes(&file, &bytes).and_then(|sp| {
                let folder = path.parent().unwrap_or(Path::new(""));
                watched.extend(sp.sources().into_iter().map(|source| folder.join(source)));
                composer.prepare(&sp)
            });
            let prepared = match prepared {
                Ok(prepared) => prepared,
                Err(found) => {
                    for diag in found.0 {
                        push_new(&mut diags, diag);
                    }
                    continue;
                }
            };
            if !known.insert(prepared.name.clone()) {
                diags.push(Diag::whole_file(
                    &file,
                    format!(
                        "there is another program with the file name `{}`",
                        prepared.name
                    ),
                ));
                continue;
            }
            for (features, origin) in self.variants_of(
                &prepared,
                composer.keys(),
                &presets_read,
                &preset_names,
                &scenes,
                &mut diags,
            ) {
                match composer.compose_prepared(&prepared, &features, &origin.sizes) {
                    Ok(composed) => {
                        let variant = (composed.program.clone(), composed.features.clone());
                        match programs.entry(variant) {
                            Entry::Vacant(free) => {
                                free.insert((composed, origin));
                            }
                            Entry::Occupied(first) if first.get().0 == composed => {}
                            Entry::Occupied(first) => {
                                let (composed, first) = first.get();
                                push_new(
                                    &mut diags,
                                    sizes_clash(composed, first, &origin, &presets_read, &named),
                                );
                            }
                        }
                    }
                    Err(found) => {
                        for diag in found.0 {
                            push_new(&mut diags, diag);
                        }
                    }
                }
            }
        }
        for (program, _) in &self.variants {
            if !known.contains(program) && diags.is_empty() {
                diags.push(
                    Diag::whole_file("build.rs", format!("there is no program `{program}`"))
                        .suggest(program, known.iter().map(String::as_str)),
                );
            }
        }
        for scene in &scenes {
            if !known.contains(&scene.program) && diags.is_empty() {
                diags.push(
                    Diag::whole_file(
                        &scene.file,
                        format!("there is no program `{}`", scene.program),
                    )
                    .suggest(&scene.program, known.iter().map(String::as_str)),
                );
            }
        }
        if !diags.is_empty() {
            return Err(diags);
        }
        let programs: Vec<Composed> = programs.into_values().map(|(c, _)| c).collect();
        let default_preset = preset_names.first().cloned().unwrap_or_default();
        let rust = emit(&Emission {
            prefix: &self.prefix,
            programs: &programs,
            keys: composer.keys(),
            presets: &presets_read,
            preset_names: &preset_names,
            scenes: &scenes,
            default_preset: &default_preset,
        });
        Ok(Output {
            rust,
            programs,
            presets: preset_names,
            default_preset,
        })
    }

    /// veduta's folders, and the preset that is its default, as far as a build script is told.
    fn shipped(&self) -> Result<(PathBuf, PathBuf, Option<String>), Diags> {
        if let Some((wgsl, presets)) = &self.own {
            let low = std::env::var_os("CARGO_FEATURE_LOW_QUALITY").is_some();
            let default = if low { "thesis_low" } else { "thesis" };
            return Ok((wgsl.clone(), presets.clone(), Some(default.to_owned())));
        }
        let folder = |name: &str| {
            std::env::var_os(name).map(PathBuf::from).ok_or_else(|| {
                Diags::from(
                    Diag::whole_file("build.rs", format!("{name} is not set"))
                        .note("Cargo sets it for packages that have `veduta` among their `[dependencies]`"),
                )
            })
        };
        Ok((
            folder("DEP_VEDUTA_WGSL")?,
            folder("DEP_VEDUTA_PRESETS")?,
            std::env::var("DEP_VEDUTA_DEFAULT_PRESET").ok(),
        ))
    }

    /// The sets of features that a program is needed with: of each scene that names it, with each preset; and those that
    /// were asked for, with the sizes of the first preset unless a preset has these features already.
    fn variants_of(
        &self,
        program: &Program,
        keys: &Keys,
        presets: &Presets,
        preset_names: &[String],
        scenes: &[Scene],
        diags: &mut Diags,
    ) -> Vec<(BTreeSet<String>, Origin)> {
        let relevant = &program.relevant;
        let mut variants: Vec<(BTreeSet<String>, Origin)> = Vec::new();
        let mut of_program: Vec<Option<&Scene>> = scenes
            .iter()
            .filter(|scene| scene.program == program.name)
            .map(Some)
            .collect();
        if of_program.is_empty() {
            of_program.push(None);
        }
        for preset in preset_names {
            for scene in &of_program {
                match resolve(keys, presets, preset, *scene, &[]) {
                    Ok(settings) => {
                        let mut features = settings.flags();
                        features.retain(|name| relevant.contains(name));
                        let mut sizes = settings.sizes();
                        sizes.retain(|name, _| relevant.contains(name));
                        let known = |(f, o): &(_, Origin)| *f == features && o.sizes == sizes;
                        if !variants.iter().any(known) {
                            let preset = preset.clone();
                            variants.push((features, Origin { preset, sizes }));
                        }
                    }
                    Err(found) => {
                        for diag in found.0 {
                            push_new(diags, diag);
                        }
                    }
                }
            }
        }
        let shipped = if self.shipped_programs.unwrap_or(self.programs.is_empty()) {
            system_variants(&program.name)
        } else {
            Vec::new()
        };
        let asked = self
            .variants
            .iter()
            .filter(|(name, _)| *name == program.name)
            .map(|(_, features)| features);
        for features in asked.chain(&shipped) {
            let acting: BTreeSet<String> = features.intersection(relevant).cloned().collect();
            let declared = |name| keys.get(name).is_some_and(|key| key.ty == KeyType::Flag);
            if variants.iter().any(|(f, _)| *f == acting) && features.iter().all(|f| declared(f)) {
                continue;
            }
            let origin = variants.first().map(|(_, o)| o.clone()).unwrap_or_default();
            // With the features that make no difference: they must be declared all the same.
            variants.push((features.clone(), origin));
        }
        variants
    }
}

/// What a variant was composed for.
#[derive(Clone, Debug, Default)]
struct Origin {
    preset: String,
    /// The sizes that make a difference to the program.
    sizes: BTreeMap<String, i64>,
}

/// Two presets that turn on the same features of a program but give it other sizes: whoever asks for the features could
/// get either.
fn sizes_clash(
    composed: &Composed,
    first: &Origin,
    second: &Origin,
    presets: &Presets,
    texts: &[(String, String, String)],
) -> Diag {
    let value = |origin: &Origin, name: &str| origin.sizes.get(name).copied().unwrap_or_default();
    let size = second
        .sizes
        .keys()
        .find(|name| value(first, name) != value(second, name))
        .map_or("", String::as_str);
    // Where a preset or a base of it gives the size its value.
    let setting = |origin: &Origin| {
        presets
            .chain(&origin.preset)
            .into_iter()
            .find_map(|preset| {
                let setting = preset.values.iter().find(|s| s.key == size)?;
                Some((preset.file.as_str(), setting.place))
            })
    };
    let says = |origin: &Origin| {
        format!(
            "preset `{}` sets it to {}",
            origin.preset,
            value(origin, size)
        )
    };
    // One of the two differs from the declaration, so that a preset sets it.
    let (here, other) = match setting(second) {
        Some(_) => (second, first),
        None => (first, second),
    };
    let message = format!(
        "size `{size}` is {} here and {} in preset `{}`, but program `{}` has the same features in both{}",
        value(here, size),
        value(other, size),
        other.preset,
        composed.program,
        match composed.features.as_slice() {
            [] => " (none)".to_owned(),
            features => format!(" ({})", features.join(", ")),
        }
    );
    let diag = match setting(here) {
        Some((file, place)) => {
            let text = texts.iter().find(|(_, name, _)| name == file);
            let line = text.map_or("", |(.., text)| line_at(text, place.line));
            Diag::new(file, place.line, place.column, line, message)
        }
        None => Diag::whole_file("build.rs", message),
    };
    let diag = match setting(other) {
        Some((file, place)) => diag.note(format!(
            "{}: {file}:{}:{}",
            says(other),
            place.line,
            place.column
        )),
        None => diag.note(format!(
            "preset `{}` leaves it as it is declared",
            other.preset
        )),
    };
    diag.note("a variant is told by its program and its features alone: let a flag of the program differ too, or compose the presets in two builds")
}

/// The file name without folder and ending.
fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}

/// The `.ron` files in a folder, not below it.
fn ron_files(folder: &Path, watched: &mut BTreeSet<PathBuf>, diags: &mut Diags) -> Vec<PathBuf> {
    watched.insert(folder.to_owned());
    let mut files = files_below(folder, "ron", diags);
    files.retain(|file| file.parent() == Some(folder));
    files
}

/// Name and text of files.
fn read_all(
    files: &[PathBuf],
    watched: &mut BTreeSet<PathBuf>,
    diags: &mut Diags,
) -> Vec<(String, String)> {
    let mut texts = Vec::new();
    for path in files {
        watched.insert(path.clone());
        match std::fs::read_to_string(path) {
            Ok(text) => texts.push((shown(path), text)),
            Err(error) => diags.push(Diag::whole_file(
                shown(path),
                format!("cannot be read: {error}"),
            )),
        }
    }
    texts
}

/// A folder, its folders and its files.
fn watch(folder: &Path, watched: &mut BTreeSet<PathBuf>) {
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        if let Ok(entries) = std::fs::read_dir(&path) {
            for entry in entries.flatten() {
                let path = entry.path();
                if path.is_dir() {
                    open.push(path);
                } else if path
                    .extension()
                    .is_some_and(|e| e == "wgsl" || e == "sp" || e == "ron")
                {
                    watched.insert(path);
                }
            }
        }
        watched.insert(path);
    }
}
