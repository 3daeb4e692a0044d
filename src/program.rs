//! Composed programs: plain WGSL with its tables, and the pipelines that they make.
//!
//! A *variant* is a program together with a set of features. The build composes the variants that the shipped scenes
//! and presets need; [`ProgramSet::get`] finds exactly the one that was asked for and never a larger one in silence.

use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::error::{Error, Nearest};

/// A text that is either embedded by the build or owned by a run-time composition.
pub type Text = Cow<'static, str>;
/// A list that is either embedded by the build or owned by a run-time composition.
pub type List<T> = Cow<'static, [T]>;

/// The stage that a piece of WGSL belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StageKind {
    /// Vertex stage.
    Vertex,
    /// Fragment stage.
    Fragment,
    /// Compute stage.
    Compute,
}

impl StageKind {
    /// The flag that `wgpu` uses for this stage.
    pub const fn visibility(self) -> wgpu::ShaderStages {
        match self {
            StageKind::Vertex => wgpu::ShaderStages::VERTEX,
            StageKind::Fragment => wgpu::ShaderStages::FRAGMENT,
            StageKind::Compute => wgpu::ShaderStages::COMPUTE,
        }
    }
}

/// An entry point of a stage.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EntryPoint {
    /// The function's name in the text.
    pub name: Text,
    /// Invocations of a workgroup along x, y and z; `[0, 0, 0]` outside compute.
    pub workgroup_size: [u32; 3],
}

/// One stage of a composed program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageSource {
    /// Which stage this is.
    pub stage: StageKind,
    /// Plain WGSL that holds only what the entry points reach.
    pub wgsl: Text,
    /// The entry points, in the order of the text.
    pub entry_points: List<EntryPoint>,
}

/// A resource that a program reads or writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    /// Bind group.
    pub group: u32,
    /// Binding inside the group.
    pub binding: u32,
    /// The variable's name in the text.
    pub name: Text,
    /// What has to be bound there.
    pub ty: wgpu::BindingType,
    /// The stages that use it.
    pub visibility: wgpu::ShaderStages,
}

/// The scalar type of an override or key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScalarType {
    /// `bool`
    Bool,
    /// `i32`
    I32,
    /// `u32`
    U32,
    /// `f32`
    F32,
}

/// A pipeline-overridable constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    /// The name in the text, which is what pipeline creation takes.
    pub name: Text,
    /// The stage whose text declares it.
    pub stages: wgpu::ShaderStages,
    /// Its type.
    pub ty: ScalarType,
    /// The value that holds when none is given; `None`: a value must be given.
    pub default: Option<f64>,
}

/// A member of a uniform or storage structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// The member's name in the text.
    pub name: Text,
    /// Bytes from the start of the structure.
    pub offset: u32,
    /// The type as WGSL writes it, for instance `vec3<f32>`.
    pub ty: Text,
}

/// The memory layout of a uniform or storage structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructLayout {
    /// The structure's name in the text.
    pub name: Text,
    /// Size in bytes.
    pub size: u32,
    /// The members in order.
    pub members: List<Member>,
}

/// A variant of a program: texts, bindings, overrides and layouts.
#[derive(Debug, Clone, PartialEq)]
pub struct ComposedProgram {
    /// The program's file name without its ending.
    pub program: Text,
    /// The features that are on, in alphabetical order.
    pub features: List<Text>,
    /// Every flag that the program mentions, on or off, in alphabetical order; others make no difference to it.
    pub mentions: List<Text>,
    /// The modules with an `override fn` that are plugged into it, in alphabetical order.
    pub plug_ins: List<Text>,
    /// The stages in pipeline order.
    pub stages: List<StageSource>,
    /// Every resource, ordered by group and binding.
    pub bindings: List<Binding>,
    /// Every pipeline-overridable constant, ordered by name.
    pub overrides: List<Override>,
    /// The layouts of the uniform and storage structures, ordered by name.
    pub structs: List<StructLayout>,
}

/// The value of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A feature that is on or off.
    Flag(bool),
    /// A whole number.
    Int(i64),
    /// A real number.
    Float(f64),
    /// Three real numbers: a colour or coefficients for red, green and blue.
    Vec3([f64; 3]),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Flag(v) => write!(f, "{v}"),
            Value::Int(v) => write!(f, "{v}"),
            Value::Float(v) => write!(f, "{v}"),
            Value::Vec3([a, b, c]) => write!(f, "({a}, {b}, {c})"),
        }
    }
}

/// How a key acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyKind {
    /// A flag, a size or an override: a change may create a pipeline.
    Quality,
    /// A uniform: a change never creates a pipeline.
    Content,
}

/// The declaration of a flag, count or content value.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// The name in upper case with underscores.
    pub name: Text,
    /// How it acts.
    pub kind: KeyKind,
    /// The type as the declaration writes it: `flag`, `i32`, `u32`, `f32`, `size` or `vec3`.
    pub ty: Text,
    /// Smallest and largest value allowed, both included; `None` for a flag.
    pub domain: Option<(f64, f64)>,
    /// The value that holds when nobody gives one.
    pub default: Value,
    /// The unit, `1` for a pure number.
    pub unit: Text,
    /// What it does.
    pub meaning: Text,
}

/// Resolved values of a preset: every quality and content key that it or a base of it names.
#[derive(Debug, Clone, PartialEq)]
pub struct PresetTable {
    /// The file name without its ending.
    pub name: Text,
    /// The values, ordered by key.
    pub values: List<(Text, Value)>,
}

/// A shipped scene: the systems that it names and its content.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneTable {
    /// The file name without its ending.
    pub name: Text,
    /// The program that draws it.
    pub program: Text,
    /// The features that it names, in alphabetical order.
    pub features: List<Text>,
    /// Content values, ordered by key.
    pub content: List<(Text, Value)>,
    /// What one sees.
    pub meaning: Text,
}

/// Everything that a build has composed: variants, keys, presets and scenes.
#[derive(Debug, Clone, Default)]
pub struct ProgramSet {
    /// The variants, each exactly once.
    pub programs: List<ComposedProgram>,
    /// Every declared key, ordered by name.
    pub keys: List<Key>,
    /// The presets, ordered by name.
    pub presets: List<PresetTable>,
    /// The scenes, ordered by name.
    pub scenes: List<SceneTable>,
    /// The preset that holds when none is named.
    pub default_preset: Text,
}

impl ProgramSet {
    /// The variant of `program` with exactly these features.
    ///
    /// A feature that the program never mentions makes no difference: it is left out before the comparison.
    ///
    /// # Errors
    /// [`Error::UnknownProgram`] when no variant has this program's name, and [`Error::VariantNotBuilt`], with the
    /// nearest built feature set, when this one was not composed: `ProgramSet::get_or_compose` (feature `compose`) does it at
    /// run time.
    pub fn get(&self, program: &str, features: &[&str]) -> Result<&ComposedProgram, Error> {
        let of_program: Vec<&ComposedProgram> = self
            .programs
            .iter()
            .filter(|p| p.program == program)
            .collect();
        if of_program.is_empty() {
            let names: BTreeSet<&str> = self.programs.iter().map(|p| p.program.as_ref()).collect();
            return Err(Error::UnknownProgram {
                name: program.to_owned(),
                known: names.into_iter().map(str::to_owned).collect(),
            });
        }
        let wanted: BTreeSet<&str> = features
            .iter()
            .copied()
            .filter(|f| of_program.iter().any(|p| p.mentions.iter().any(|m| m == f)))
            .collect();
        let distance = |p: &&ComposedProgram| {
            let have: BTreeSet<&str> = p.features.iter().map(|f| f.as_ref()).collect();
            have.symmetric_difference(&wanted).count()
        };
        match of_program.iter().min_by_key(|p| distance(p)) {
            Some(p) if distance(p) == 0 => Ok(p),
            nearest => Err(Error::VariantNotBuilt {
                program: program.to_owned(),
                features: wanted.into_iter().map(str::to_owned).collect(),
                nearest: Nearest(
                    nearest
                        .map(|p| p.features.iter().map(|f| f.to_string()).collect())
                        .unwrap_or_default(),
                ),
            }),
        }
    }

    /// The declaration of `name`.
    ///
    /// # Errors
    /// [`Error::UnknownKey`] with the nearest declared name.
    pub fn key(&self, name: &str) -> Result<&Key, Error> {
        self.keys
            .iter()
            .find(|k| k.name == name)
            .ok_or_else(|| Error::UnknownKey {
                name: name.to_owned(),
                nearest: crate::error::nearest_name(
                    name,
                    self.keys.iter().map(|k| k.name.as_ref()),
                ),
            })
    }

    /// The resolved values of preset `name`.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] with the names that exist.
    pub fn preset(&self, name: &str) -> Result<&PresetTable, Error> {
        self.presets
            .iter()
            .find(|p| p.name == name)
            .ok_or_else(|| Error::UnknownPreset {
                name: name.to_owned(),
                known: self.presets.iter().map(|p| p.name.to_string()).collect(),
            })
    }

    /// The scene `name`.
    ///
    /// # Errors
    /// [`Error::UnknownScene`] with the names that exist.
    pub fn scene(&self, name: &str) -> Result<&SceneTable, Error> {
        self.scenes
            .iter()
            .find(|s| s.name == name)
            .ok_or_else(|| Error::UnknownScene {
                name: name.to_owned(),
                known: self.scenes.iter().map(|s| s.name.to_string()).collect(),
            })
    }
}

/// What a host has to say to get a pipeline of a composed program.
#[derive(Debug, Clone)]
pub struct PipelineOptions<'a> {
    /// Colour targets of a render pipeline, in the order of the fragment outputs.
    pub targets: &'a [Option<wgpu::ColorTargetState>],
    /// Depth and stencil of a render pipeline.
    pub depth_stencil: Option<wgpu::DepthStencilState>,
    /// Samples a pixel of a render pipeline.
    pub sample_count: u32,
    /// Vertex buffers of a render pipeline.
    pub vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// Primitive state of a render pipeline.
    pub primitive: wgpu::PrimitiveState,
    /// Values for overrides by name; those not given keep their defaults.
    pub constants: &'a [(&'a str, f64)],
    /// Entry point of the vertex or compute stage; `None`: the only one.
    pub entry: Option<&'a str>,
    /// Entry point of the fragment stage; `None`: the only one.
    pub fragment_entry: Option<&'a str>,
    /// Label of the pipeline for graphics debuggers; `None`: the program's name.
    pub label: Option<&'a str>,
}

impl Default for PipelineOptions<'_> {
    fn default() -> Self {
        PipelineOptions {
            targets: &[],
            depth_stencil: None,
            sample_count: 1,
            vertex_buffers: &[],
            primitive: wgpu::PrimitiveState::default(),
            constants: &[],
            entry: None,
            fragment_entry: None,
            label: None,
        }
    }
}

/// The pipeline that a program makes.
#[derive(Debug, Clone)]
pub enum Pipeline {
    /// Vertex with or without fragment stage.
    Render(wgpu::RenderPipeline),
    /// Compute stage.
    Compute(wgpu::ComputePipeline),
}

/// A pipeline with the layouts of its bind groups.
#[derive(Debug, Clone)]
pub struct ReadyPipeline {
    /// The pipeline.
    pub pipeline: Pipeline,
    /// One layout a group; groups that the program leaves out are empty.
    pub bind_group_layouts: Vec<wgpu::BindGroupLayout>,
}

impl ReadyPipeline {
    /// The render pipeline, when the program has a vertex stage.
    pub fn render(&self) -> Option<&wgpu::RenderPipeline> {
        match &self.pipeline {
            Pipeline::Render(p) => Some(p),
            Pipeline::Compute(_) => None,
        }
    }

    /// The compute pipeline, when the program has a compute stage.
    pub fn compute(&self) -> Option<&wgpu::ComputePipeline> {
        match &self.pipeline {
            Pipeline::Compute(p) => Some(p),
            Pipeline::Render(_) => None,
        }
    }
}

impl ComposedProgram {
    /// The stage of this kind, if the program has it.
    pub fn stage(&self, kind: StageKind) -> Option<&StageSource> {
        self.stages.iter().find(|s| s.stage == kind)
    }

    /// The layout of the uniform or storage structure `name`.
    pub fn layout(&self, name: &str) -> Option<&StructLayout> {
        self.structs.iter().find(|s| s.name == name)
    }

    /// The entries of one bind group, ordered by binding.
    pub fn bind_group_entries(&self, group: u32) -> Vec<wgpu::BindGroupLayoutEntry> {
        self.bindings
            .iter()
            .filter(|b| b.group == group)
            .map(|b| wgpu::BindGroupLayoutEntry {
                binding: b.binding,
                visibility: b.visibility,
                ty: b.ty,
                count: None,
            })
            .collect()
    }

    fn entry<'a>(
        &'a self,
        stage: &'a StageSource,
        wanted: Option<&str>,
    ) -> Result<&'a EntryPoint, Error> {
        let known = || {
            stage
                .entry_points
                .iter()
                .map(|e| e.name.to_string())
                .collect()
        };
        match (wanted, stage.entry_points.as_ref()) {
            (None, [only]) => Ok(only),
            (None, _) => Err(Error::EntryPoint {
                program: self.program.to_string(),
                name: "(none named)".to_owned(),
                known: known(),
            }),
            (Some(name), all) => {
                all.iter()
                    .find(|e| e.name == name)
                    .ok_or_else(|| Error::EntryPoint {
                        program: self.program.to_string(),
                        name: name.to_owned(),
                        known: known(),
                    })
            }
        }
    }

    fn constants<'a>(
        &self,
        given: &[(&'a str, f64)],
        stage: StageKind,
    ) -> Result<Vec<(&'a str, f64)>, Error> {
        let mut constants = Vec::new();
        for &(name, value) in given {
            let Some(found) = self.overrides.iter().find(|o| o.name == name) else {
                return Err(Error::UnknownOverride {
                    program: self.program.to_string(),
                    name: name.to_owned(),
                    nearest: crate::error::nearest_name(
                        name,
                        self.overrides.iter().map(|o| o.name.as_ref()),
                    ),
                });
            };
            let fits = match found.ty {
                ScalarType::Bool => value == 0.0 || value == 1.0,
                ScalarType::I32 => {
                    value.fract() == 0.0
                        && value >= f64::from(i32::MIN)
                        && value <= f64::from(i32::MAX)
                }
                ScalarType::U32 => {
                    value.fract() == 0.0 && value >= 0.0 && value <= f64::from(u32::MAX)
                }
                ScalarType::F32 => value.is_finite() && value.abs() <= f64::from(f32::MAX),
            };
            if !fits {
                return Err(Error::OutOfDomain {
                    name: name.to_owned(),
                    value: value.to_string(),
                    domain: format!("a finite value that a {:?} can hold", found.ty),
                });
            }
            if found.stages.contains(stage.visibility()) {
                constants.push((name, value));
            }
        }
        for o in self.overrides.iter() {
            if o.default.is_none()
                && o.stages.contains(stage.visibility())
                && !constants.iter().any(|(n, _)| *n == o.name)
            {
                return Err(Error::MissingOverride {
                    program: self.program.to_string(),
                    name: o.name.to_string(),
                });
            }
        }
        Ok(constants)
    }

    /// The pipeline of this program and the layouts of its bind groups.
    ///
    /// The pipeline is a render pipeline when the program has a vertex stage and a compute pipeline otherwise.
    ///
    /// # Errors
    /// [`Error::UnknownOverride`], [`Error::MissingOverride`] and [`Error::OutOfDomain`] for the constants,
    /// [`Error::EntryPoint`] for the entry points, [`Error::MissingStage`] when there is nothing to run, and
    /// [`Error::MissingLimit`] when the device has fewer bind groups than the program.
    pub fn pipeline(
        &self,
        device: &wgpu::Device,
        options: &PipelineOptions<'_>,
    ) -> Result<ReadyPipeline, Error> {
        let groups = self.bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
        let allowed = device.limits().max_bind_groups;
        if groups > allowed {
            return Err(Error::MissingLimit {
                name: "max_bind_groups",
                needed: u64::from(groups),
                available: u64::from(allowed),
            });
        }
        let label = options.label.unwrap_or(&self.program);
        let bind_group_layouts: Vec<wgpu::BindGroupLayout> = (0..groups)
            .map(|group| {
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some(label),
                    entries: &self.bind_group_entries(group),
                })
            })
            .collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &bind_group_layouts.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let module = |stage: &StageSource| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(stage.wgsl.as_ref())),
            })
        };
        for name in options.constants {
            if !self.overrides.iter().any(|o| o.name == name.0) {
                self.constants(&[*name], StageKind::Vertex)?;
            }
        }
        if let Some(vertex) = self.stage(StageKind::Vertex) {
            let vertex_entry = self.entry(vertex, options.entry)?;
            let vertex_constants = self.constants(options.constants, StageKind::Vertex)?;
            let vertex_module = module(vertex);
            let fragment = match self.stage(StageKind::Fragment) {
                Some(stage) => Some((
                    module(stage),
                    self.entry(stage, options.fragment_entry)?,
                    self.constants(options.constants, StageKind::Fragment)?,
                )),
                None => None,
            };
            let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &vertex_module,
                    entry_point: Some(&vertex_entry.name),
                    compilation_options: wgpu::PipelineCompilationOptions {
                        constants: &vertex_constants,
                        ..Default::default()
                    },
                    buffers: options.vertex_buffers,
                },
                primitive: options.primitive,
                depth_stencil: options.depth_stencil.clone(),
                multisample: wgpu::MultisampleState {
                    count: options.sample_count,
                    ..Default::default()
                },
                fragment: fragment
                    .as_ref()
                    .map(|(module, entry, constants)| wgpu::FragmentState {
                        module,
                        entry_point: Some(&entry.name),
                        compilation_options: wgpu::PipelineCompilationOptions {
                            constants,
                            ..Default::default()
                        },
                        targets: options.targets,
                    }),
                multiview_mask: None,
                cache: None,
            });
            return Ok(ReadyPipeline {
                pipeline: Pipeline::Render(pipeline),
                bind_group_layouts,
            });
        }
        let Some(compute) = self.stage(StageKind::Compute) else {
            return Err(Error::MissingStage {
                program: self.program.to_string(),
            });
        };
        let entry = self.entry(compute, options.entry)?;
        let constants = self.constants(options.constants, StageKind::Compute)?;
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module(compute),
            entry_point: Some(&entry.name),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        });
        Ok(ReadyPipeline {
            pipeline: Pipeline::Compute(pipeline),
            bind_group_layouts,
        })
    }
}
