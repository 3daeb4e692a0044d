//! Composition at run time: variants that the build has not made, and shaders that change while the host runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use veduta_compose::compose::Composed;
use veduta_compose::keys::Keys;
use veduta_compose::library::Library;
use veduta_compose::{Composer, reflect};

use crate::error::Error;
use crate::program::{
    Binding, ComposedProgram, EntryPoint, Member, Override, ProgramSet, ScalarType, StageKind,
    StageSource, StructLayout, Value,
};

/// The texts that programs are composed from: modules, programs and key declarations below some folders.
///
/// A folder's `.wgsl` files with a `#define_import_path` are modules, its `.sp` files are programs, and its `keys.ron`
/// declares flags, sizes and values.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Source {
    texts: BTreeMap<PathBuf, String>,
    plug_ins: Vec<String>,
}

impl Source {
    /// Reads every `.wgsl`, `.sp` and `keys.ron` file below the folders.
    ///
    /// # Errors
    /// [`Error::Compose`] that names the folder or file that cannot be read, or that is not UTF-8.
    pub fn read(folders: &[&Path]) -> Result<Source, Error> {
        let mut source = Source::default();
        for folder in folders {
            source.add(folder)?;
        }
        Ok(source)
    }

    /// Lets the `override fn` of a module take effect in every program that reaches the virtual function, as `veduta_compose::Build::plug_in` does in a build.
    #[must_use]
    pub fn plug_in(mut self, module: impl Into<String>) -> Source {
        self.plug_ins.push(module.into());
        self
    }

    fn add(&mut self, folder: &Path) -> Result<(), Error> {
        let fault = |path: &Path, e: std::io::Error| {
            Error::Compose(format!("{}: cannot be read: {e}", path.display()))
        };
        for entry in std::fs::read_dir(folder).map_err(|e| fault(folder, e))? {
            let path = entry.map_err(|e| fault(folder, e))?.path();
            if path.is_dir() {
                self.add(&path)?;
                continue;
            }
            let ending = path.extension().and_then(|e| e.to_str());
            if matches!(ending, Some("wgsl" | "sp")) || path.ends_with("keys.ron") {
                let text = std::fs::read_to_string(&path).map_err(|e| fault(&path, e))?;
                self.texts.insert(path, text);
            }
        }
        Ok(())
    }

    fn with_ending(&self, ending: &str) -> Vec<(String, String)> {
        self.texts
            .iter()
            .filter(|(path, _)| path.extension().is_some_and(|e| e == ending))
            .map(|(path, text)| (path.display().to_string().replace('\\', "/"), text.clone()))
            .collect()
    }

    /// Composes one variant of a program with the sizes as they are declared; flags that the program never mentions may
    /// be among the features.
    ///
    /// # Errors
    /// [`Error::UnknownProgram`], and [`Error::Compose`] with every fault of the texts and its place.
    pub fn compose(&self, program: &str, features: &[&str]) -> Result<ComposedProgram, Error> {
        self.compose_sized(program, features, &[])
    }

    /// [`Source::compose`] with other values for some sizes; those that the program never mentions do no harm.
    ///
    /// # Errors
    /// As [`Source::compose`].
    pub fn compose_sized(
        &self,
        program: &str,
        features: &[&str],
        sizes: &[(&str, i64)],
    ) -> Result<ComposedProgram, Error> {
        let faults = |e: veduta_compose::Diags| Error::Compose(e.to_string());
        let programs = self.with_ending("sp");
        let stem = |file: &str| {
            Path::new(file)
                .file_stem()
                .map(|s| s.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        let Some((file, text)) = programs.iter().find(|(file, _)| stem(file) == program) else {
            return Err(Error::UnknownProgram {
                name: program.to_owned(),
                known: programs.iter().map(|(file, _)| stem(file)).collect(),
            });
        };
        let keys = Keys::load(&self.with_ending("ron")).map_err(faults)?;
        let library = Library::from_sources(self.with_ending("wgsl")).map_err(faults)?;
        let sp = veduta_compose::sp::parse(file, text).map_err(faults)?;
        let features: BTreeSet<String> = features.iter().map(|f| (*f).to_owned()).collect();
        let sizes: BTreeMap<String, i64> =
            sizes.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
        let composed = Composer::new(&library, keys)
            .plug_ins(self.plug_ins.clone())
            .compose(&sp, &features, &sizes)
            .map_err(faults)?;
        self::program(&composed)
    }
}

impl ProgramSet {
    /// [`ProgramSet::get`], or the variant composed from `source` when the build has not made it; the set keeps it.
    ///
    /// The sizes are those of the set's default preset, as in a build that asks for a further variant.
    ///
    /// # Errors
    /// As [`Source::compose`].
    pub fn get_or_compose(
        &mut self,
        source: &Source,
        program: &str,
        features: &[&str],
    ) -> Result<&ComposedProgram, Error> {
        if self.get(program, features).is_err() {
            let preset = self.presets.iter().find(|p| p.name == self.default_preset);
            let sizes: Vec<(&str, i64)> = preset
                .iter()
                .flat_map(|preset| preset.values.iter())
                .filter_map(|(name, value)| match value {
                    Value::Int(n) if self.key(name).is_ok_and(|key| key.ty == "size") => {
                        Some((name.as_ref(), *n))
                    }
                    _ => None,
                })
                .collect();
            let composed = source.compose_sized(program, features, &sizes)?;
            self.programs.to_mut().push(composed);
        }
        self.get(program, features)
    }
}

/// Composes a program anew when one of its files has changed.
#[derive(Debug, Clone)]
pub struct Reloader {
    folders: Vec<PathBuf>,
    program: String,
    features: Vec<String>,
    source: Source,
    current: ComposedProgram,
}

impl Reloader {
    /// Reads the folders and composes the program for the first time, with the sizes as they are declared.
    ///
    /// # Errors
    /// As [`Source::read`] and [`Source::compose`].
    pub fn new(folders: &[&Path], program: &str, features: &[&str]) -> Result<Reloader, Error> {
        let source = Source::read(folders)?;
        Ok(Reloader {
            folders: folders.iter().map(|f| f.to_path_buf()).collect(),
            program: program.to_owned(),
            features: features.iter().map(|f| (*f).to_owned()).collect(),
            current: source.compose(program, features)?,
            source,
        })
    }

    /// The program as it was composed last without a fault.
    pub fn current(&self) -> &ComposedProgram {
        &self.current
    }

    /// Reads the files again; `true` when their text has changed and the program was composed anew.
    ///
    /// Call it between frames, as often as edits shall show.
    ///
    /// # Errors
    /// As [`Source::read`] and [`Source::compose`]; the program of before then stays, and the next call tries again.
    pub fn poll(&mut self) -> Result<bool, Error> {
        let folders: Vec<&Path> = self.folders.iter().map(PathBuf::as_path).collect();
        let source = Source::read(&folders)?;
        if source == self.source {
            return Ok(false);
        }
        let features: Vec<&str> = self.features.iter().map(String::as_str).collect();
        self.current = source.compose(&self.program, &features)?;
        self.source = source;
        Ok(true)
    }
}

/// The tables of a composed program, as a build embeds them.
///
/// # Errors
/// [`Error::MissingFeature`] for a storage format that `wgpu` does not have.
pub fn program(composed: &Composed) -> Result<ComposedProgram, Error> {
    Ok(ComposedProgram {
        program: composed.program.clone().into(),
        features: composed.features.iter().cloned().map(Into::into).collect(),
        mentions: composed.mentions.iter().cloned().map(Into::into).collect(),
        plug_ins: composed.plug_ins.iter().cloned().map(Into::into).collect(),
        stages: composed
            .stages
            .iter()
            .map(|stage| StageSource {
                stage: stage_kind(stage.kind),
                wgsl: stage.wgsl.clone().into(),
                entry_points: stage
                    .entry_points
                    .iter()
                    .map(|entry| EntryPoint {
                        name: entry.name.clone().into(),
                        workgroup_size: entry.workgroup_size,
                    })
                    .collect(),
            })
            .collect(),
        bindings: composed
            .bindings
            .iter()
            .map(|binding| {
                Ok(Binding {
                    group: binding.group,
                    binding: binding.binding,
                    name: binding.name.clone().into(),
                    ty: binding_type(binding.ty)?,
                    visibility: stages(binding.visibility),
                })
            })
            .collect::<Result<_, Error>>()?,
        overrides: composed
            .overrides
            .iter()
            .map(|item| Override {
                // A host addresses an override with a number by that number.
                name: item
                    .id
                    .map_or_else(|| item.name.clone(), |id| id.to_string())
                    .into(),
                stages: stages(item.visibility),
                ty: match item.ty {
                    reflect::ScalarType::Bool => ScalarType::Bool,
                    reflect::ScalarType::I32 => ScalarType::I32,
                    reflect::ScalarType::U32 => ScalarType::U32,
                    reflect::ScalarType::F32 => ScalarType::F32,
                },
                default: item.default,
            })
            .collect(),
        structs: composed
            .structs
            .iter()
            .map(|layout| StructLayout {
                name: layout.name.clone().into(),
                size: layout.size,
                members: layout
                    .members
                    .iter()
                    .map(|member| Member {
                        name: member.name.clone().into(),
                        offset: member.offset,
                        ty: member.ty.wgsl().into(),
                    })
                    .collect(),
            })
            .collect(),
    })
}

fn stage_kind(kind: reflect::StageKind) -> StageKind {
    match kind {
        reflect::StageKind::Vertex => StageKind::Vertex,
        reflect::StageKind::Fragment => StageKind::Fragment,
        reflect::StageKind::Compute => StageKind::Compute,
    }
}

fn stages(visibility: reflect::Visibility) -> wgpu::ShaderStages {
    let mut stages = wgpu::ShaderStages::NONE;
    stages.set(wgpu::ShaderStages::VERTEX, visibility.vertex);
    stages.set(wgpu::ShaderStages::FRAGMENT, visibility.fragment);
    stages.set(wgpu::ShaderStages::COMPUTE, visibility.compute);
    stages
}

fn dimension(dim: reflect::ViewDimension) -> wgpu::TextureViewDimension {
    match dim {
        reflect::ViewDimension::D1 => wgpu::TextureViewDimension::D1,
        reflect::ViewDimension::D2 => wgpu::TextureViewDimension::D2,
        reflect::ViewDimension::D2Array => wgpu::TextureViewDimension::D2Array,
        reflect::ViewDimension::Cube => wgpu::TextureViewDimension::Cube,
        reflect::ViewDimension::CubeArray => wgpu::TextureViewDimension::CubeArray,
        reflect::ViewDimension::D3 => wgpu::TextureViewDimension::D3,
    }
}

fn buffer(ty: wgpu::BufferBindingType, min_size: u64) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: std::num::NonZeroU64::new(min_size),
    }
}

fn binding_type(ty: reflect::BindingType) -> Result<wgpu::BindingType, Error> {
    use reflect::BindingType as B;
    Ok(match ty {
        B::Uniform { min_size } => buffer(wgpu::BufferBindingType::Uniform, min_size),
        B::Storage {
            read_only,
            min_size,
        } => buffer(wgpu::BufferBindingType::Storage { read_only }, min_size),
        B::Texture {
            sample,
            dim,
            multisampled,
        } => wgpu::BindingType::Texture {
            sample_type: match sample {
                reflect::SampleType::Float { filterable } => {
                    wgpu::TextureSampleType::Float { filterable }
                }
                reflect::SampleType::Depth => wgpu::TextureSampleType::Depth,
                reflect::SampleType::Sint => wgpu::TextureSampleType::Sint,
                reflect::SampleType::Uint => wgpu::TextureSampleType::Uint,
            },
            view_dimension: dimension(dim),
            multisampled,
        },
        B::StorageTexture {
            format,
            access,
            dim,
        } => wgpu::BindingType::StorageTexture {
            access: match access {
                reflect::Access::Read => wgpu::StorageTextureAccess::ReadOnly,
                reflect::Access::Write => wgpu::StorageTextureAccess::WriteOnly,
                reflect::Access::ReadWrite => wgpu::StorageTextureAccess::ReadWrite,
            },
            // Both name a format alike.
            format: storage_format(&format!("{format:?}"))?,
            view_dimension: dimension(dim),
        },
        B::Sampler {
            comparison,
            filtering,
        } => wgpu::BindingType::Sampler(match (comparison, filtering) {
            (true, _) => wgpu::SamplerBindingType::Comparison,
            (false, true) => wgpu::SamplerBindingType::Filtering,
            (false, false) => wgpu::SamplerBindingType::NonFiltering,
        }),
    })
}

fn storage_format(name: &str) -> Result<wgpu::TextureFormat, Error> {
    use wgpu::TextureFormat as F;
    const FORMATS: [F; 40] = [
        F::R8Unorm,
        F::R8Snorm,
        F::R8Uint,
        F::R8Sint,
        F::R16Uint,
        F::R16Sint,
        F::R16Float,
        F::Rg8Unorm,
        F::Rg8Snorm,
        F::Rg8Uint,
        F::Rg8Sint,
        F::R32Uint,
        F::R32Sint,
        F::R32Float,
        F::Rg16Uint,
        F::Rg16Sint,
        F::Rg16Float,
        F::Rgba8Unorm,
        F::Rgba8Snorm,
        F::Rgba8Uint,
        F::Rgba8Sint,
        F::Bgra8Unorm,
        F::Rgb10a2Uint,
        F::Rgb10a2Unorm,
        F::Rg11b10Ufloat,
        F::Rg32Uint,
        F::Rg32Sint,
        F::Rg32Float,
        F::Rgba16Uint,
        F::Rgba16Sint,
        F::Rgba16Float,
        F::Rgba32Uint,
        F::Rgba32Sint,
        F::Rgba32Float,
        F::R16Unorm,
        F::R16Snorm,
        F::Rg16Unorm,
        F::Rg16Snorm,
        F::Rgba16Unorm,
        F::Rgba16Snorm,
    ];
    FORMATS
        .into_iter()
        .find(|f| format!("{f:?}") == name)
        .ok_or_else(|| Error::MissingFeature {
            name: format!("storage format {name}"),
            why: "the program uses".to_owned(),
        })
}
