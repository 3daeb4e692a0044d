//! What a host has to know about a composed program: bindings, overrides, entry points, memory layouts.

use std::collections::{BTreeMap, BTreeSet};

use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, ArraySize, Handle, ImageClass, ImageDimension, Module, ScalarKind, StorageAccess,
    Type, TypeInner,
};

pub use crate::sp::StageKind;

/// An entry point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EntryPoint {
    /// The function's name.
    pub name: String,
    /// Invocations of a workgroup along x, y and z; `[0, 0, 0]` outside compute.
    pub workgroup_size: [u32; 3],
}

/// What a shader does with a storage texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `read`
    Read,
    /// `write`
    Write,
    /// `read_write`
    ReadWrite,
}

/// The shape of a texture's view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewDimension {
    /// `texture_1d`
    D1,
    /// `texture_2d`
    D2,
    /// `texture_2d_array`
    D2Array,
    /// `texture_cube`
    Cube,
    /// `texture_cube_array`
    CubeArray,
    /// `texture_3d`
    D3,
}

/// What reading a texture gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Floats; filterable if the program samples the texture through a sampler. Gathers do not count.
    Float {
        /// A sampler filters it.
        filterable: bool,
    },
    /// Depth.
    Depth,
    /// Signed integers.
    Sint,
    /// Unsigned integers.
    Uint,
}

/// What has to be bound; enough for a bind group layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingType {
    /// A uniform buffer.
    Uniform {
        /// Least size of the binding in bytes.
        min_size: u64,
    },
    /// A storage buffer.
    Storage {
        /// The program does not write it.
        read_only: bool,
        /// Least size of the binding in bytes; an array without a length counts as one element.
        min_size: u64,
    },
    /// A sampled texture.
    Texture {
        /// What reading gives.
        sample: SampleType,
        /// The view.
        dim: ViewDimension,
        /// More than one sample a texel.
        multisampled: bool,
    },
    /// A storage texture.
    StorageTexture {
        /// The texel format.
        format: naga::StorageFormat,
        /// What is done with it.
        access: Access,
        /// The view.
        dim: ViewDimension,
    },
    /// A sampler.
    Sampler {
        /// It compares.
        comparison: bool,
        /// It filters, and does not only gather.
        filtering: bool,
    },
}

/// The stages that use something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visibility {
    /// The vertex stage.
    pub vertex: bool,
    /// The fragment stage.
    pub fragment: bool,
    /// The compute stage.
    pub compute: bool,
}

impl Visibility {
    /// One stage.
    pub fn of(stage: StageKind) -> Self {
        let mut visibility = Self::default();
        visibility.add(stage);
        visibility
    }

    /// Adds a stage.
    pub fn add(&mut self, stage: StageKind) {
        match stage {
            StageKind::Vertex => self.vertex = true,
            StageKind::Fragment => self.fragment = true,
            StageKind::Compute => self.compute = true,
        }
    }

    /// No stage uses it.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }
}

/// A resource.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Bind group.
    pub group: u32,
    /// Number within the group.
    pub binding: u32,
    /// The variable's name in the source.
    pub name: String,
    /// What has to be bound.
    pub ty: BindingType,
    /// Who uses it.
    pub visibility: Visibility,
    /// The structure of a buffer, if its type is one.
    pub structure: Option<String>,
}

/// The scalar type of an override.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

impl ScalarType {
    /// The WGSL name.
    pub fn wgsl(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::I32 => "i32",
            Self::U32 => "u32",
            Self::F32 => "f32",
        }
    }
}

/// A pipeline-overridable constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Its name.
    pub name: String,
    /// Its number, if it has one (`@id`).
    pub id: Option<u16>,
    /// Its type.
    pub ty: ScalarType,
    /// The value that holds when none is given; `None`: a value must be given.
    pub default: Option<f64>,
    /// The quality key of the same name.
    pub key: Option<String>,
    /// The stages that declare it.
    pub visibility: Visibility,
}

/// The type of a structure's member.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MemberType {
    /// `f32`, `i32`, `u32` (and atomics of the integers), `f16`.
    Scalar(&'static str),
    /// `vecN<T>`: number of components and component.
    Vector(u32, &'static str),
    /// `matCxR<T>`: columns, rows, component.
    Matrix(u32, u32, &'static str),
    /// `array<T, N>` with the bytes from one element to the next; `None`: of any length.
    Array(Box<MemberType>, Option<u32>, u32),
    /// Another structure.
    Struct(String),
}

impl MemberType {
    /// The type as WGSL writes it.
    pub fn wgsl(&self) -> String {
        match self {
            Self::Scalar(scalar) => (*scalar).to_owned(),
            Self::Vector(n, scalar) => format!("vec{n}<{scalar}>"),
            Self::Matrix(columns, rows, scalar) => format!("mat{columns}x{rows}<{scalar}>"),
            Self::Array(base, Some(n), _) => format!("array<{}, {n}>", base.wgsl()),
            Self::Array(base, None, _) => format!("array<{}>", base.wgsl()),
            Self::Struct(name) => name.clone(),
        }
    }
}

/// A member of a structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemberLayout {
    /// Its name in the source.
    pub name: String,
    /// Bytes from the start of the structure.
    pub offset: u32,
    /// Its type.
    pub ty: MemberType,
    /// Its doc comment.
    pub doc: String,
}

/// The memory layout of a uniform or storage structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Its name in the source.
    pub name: String,
    /// Bytes; an array without a length at the end counts as one element.
    pub size: u32,
    /// Alignment in bytes.
    pub align: u32,
    /// The members in order.
    pub members: Vec<MemberLayout>,
    /// Its doc comment.
    pub doc: String,
}

/// What one stage tells.
#[derive(Clone, Debug, Default)]
pub(crate) struct StageTables {
    pub entry_points: Vec<EntryPoint>,
    pub bindings: Vec<Binding>,
    pub overrides: Vec<Override>,
    pub structs: BTreeMap<String, StructLayout>,
}

/// Reads the tables of one stage.
///
/// # Errors
/// Name of what cannot be described, and why.
pub(crate) fn stage(
    kind: StageKind,
    module: &Module,
    info: &ModuleInfo,
) -> Result<StageTables, (String, String)> {
    let mut tables = StageTables::default();
    for entry_point in &module.entry_points {
        tables.entry_points.push(EntryPoint {
            name: entry_point.name.clone(),
            workgroup_size: if kind == StageKind::Compute {
                entry_point.workgroup_size
            } else {
                [0; 3]
            },
        });
    }
    let mut filtered = filtered(module);
    // A sampler that filters wants textures that can be, where it only gathers too.
    for index in 0..module.entry_points.len() {
        for key in &info.get_entry_point(index).sampling_set {
            if filtered.contains(&key.sampler) {
                filtered.insert(key.image);
            }
        }
    }
    let mut used: BTreeSet<Handle<naga::GlobalVariable>> = BTreeSet::new();
    for index in 0..module.entry_points.len() {
        let entry = info.get_entry_point(index);
        used.extend(
            module
                .global_variables
                .iter()
                .map(|(handle, _)| handle)
                .filter(|handle| !entry[*handle].is_empty()),
        );
    }
    for (handle, global) in module.global_variables.iter() {
        let name = global.name.clone().unwrap_or_default();
        let Some(place) = &global.binding else {
            continue;
        };
        if !used.contains(&handle) {
            continue;
        }
        let ty = binding_type(module, global, filtered.contains(&handle))
            .map_err(|why| (name.clone(), why))?;
        if matches!(
            ty,
            BindingType::Uniform { .. } | BindingType::Storage { .. }
        ) {
            collect_structs(module, global.ty, &mut tables.structs)
                .map_err(|why| (name.clone(), why))?;
        }
        let structure = match &module.types[global.ty].inner {
            TypeInner::Struct { .. } => module.types[global.ty].name.clone(),
            _ => None,
        };
        tables.bindings.push(Binding {
            group: place.group,
            binding: place.binding,
            name,
            ty,
            visibility: Visibility::of(kind),
            structure,
        });
    }
    tables
        .bindings
        .sort_by_key(|binding| (binding.group, binding.binding));
    for (_, item) in module.overrides.iter() {
        let name = item.name.clone().unwrap_or_default();
        let ty = match module.types[item.ty].inner {
            TypeInner::Scalar(naga::Scalar::BOOL) => ScalarType::Bool,
            TypeInner::Scalar(naga::Scalar::I32) => ScalarType::I32,
            TypeInner::Scalar(naga::Scalar::U32) => ScalarType::U32,
            TypeInner::Scalar(naga::Scalar::F32) => ScalarType::F32,
            _ => {
                return Err((
                    name,
                    "an override is `bool`, `i32`, `u32` or `f32`".to_owned(),
                ));
            }
        };
        let default = item.init.and_then(|init| constant(module, init));
        tables.overrides.push(Override {
            name,
            id: item.id,
            ty,
            default,
            key: None,
            visibility: Visibility::of(kind),
        });
    }
    tables.overrides.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(tables)
}

/// The name of an override whose default is an expression: naga's WGSL writer cannot write all of them, and a host could
/// not know the value.
pub(crate) fn computed_default(module: &Module) -> Option<String> {
    module
        .overrides
        .iter()
        .find(|(_, item)| {
            item.init
                .is_some_and(|init| constant(module, init).is_none())
        })
        .map(|(_, item)| item.name.clone().unwrap_or_default())
}

/// The value of a constant expression.
fn constant(module: &Module, expression: Handle<naga::Expression>) -> Option<f64> {
    match module.global_expressions[expression] {
        naga::Expression::Literal(literal) => match literal {
            naga::Literal::F32(value) => Some(f64::from(value)),
            naga::Literal::I32(value) => Some(f64::from(value)),
            naga::Literal::U32(value) => Some(f64::from(value)),
            naga::Literal::Bool(value) => Some(f64::from(u8::from(value))),
            _ => None,
        },
        naga::Expression::ZeroValue(_) => Some(0.0),
        naga::Expression::Constant(handle) => constant(module, module.constants[handle].init),
        naga::Expression::Unary {
            op: naga::UnaryOperator::Negate,
            expr,
        } => constant(module, expr).map(|value| -value),
        _ => None,
    }
}

/// Where a texture or a sampler comes from.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    Global(Handle<naga::GlobalVariable>),
    Argument(u32),
}

fn origin(function: &naga::Function, of: Handle<naga::Expression>) -> Option<Origin> {
    match function.expressions[of] {
        naga::Expression::GlobalVariable(handle) => Some(Origin::Global(handle)),
        naga::Expression::FunctionArgument(index) => Some(Origin::Argument(index)),
        naga::Expression::Access { base, .. } | naga::Expression::AccessIndex { base, .. } => {
            origin(function, base)
        }
        _ => None,
    }
}

/// The functions that a block calls, with their arguments.
fn calls<'a>(
    block: &'a naga::Block,
    found: &mut Vec<(Handle<naga::Function>, &'a [Handle<naga::Expression>])>,
) {
    for statement in block.iter() {
        match statement {
            naga::Statement::Call {
                function,
                arguments,
                ..
            } => found.push((*function, arguments)),
            naga::Statement::Block(inner) => calls(inner, found),
            naga::Statement::If { accept, reject, .. } => {
                calls(accept, found);
                calls(reject, found);
            }
            naga::Statement::Switch { cases, .. } => {
                for case in cases {
                    calls(&case.body, found);
                }
            }
            naga::Statement::Loop {
                body, continuing, ..
            } => {
                calls(body, found);
                calls(continuing, found);
            }
            _ => {}
        }
    }
}

/// Textures and samplers with which a program filters, and not only gathers.
fn filtered(module: &Module) -> BTreeSet<Handle<naga::GlobalVariable>> {
    let mut by_function: Vec<BTreeSet<Origin>> = Vec::new();
    let within = |function: &naga::Function, known: &[BTreeSet<Origin>]| {
        let mut origins = BTreeSet::new();
        for (_, expression) in function.expressions.iter() {
            if let naga::Expression::ImageSample {
                image,
                sampler,
                gather: None,
                ..
            } = expression
            {
                origins.extend(origin(function, *image));
                origins.extend(origin(function, *sampler));
            }
        }
        let mut called = Vec::new();
        calls(&function.body, &mut called);
        for (callee, arguments) in called {
            // A function stands behind those that it calls.
            let Some(inner) = known.get(callee.index()) else {
                continue;
            };
            origins.extend(inner.iter().filter_map(|o| {
                match o {
                    Origin::Global(_) => Some(*o),
                    Origin::Argument(index) => arguments
                        .get(*index as usize)
                        .and_then(|argument| origin(function, *argument)),
                }
            }));
        }
        origins
    };
    for (_, function) in module.functions.iter() {
        let found = within(function, &by_function);
        by_function.push(found);
    }
    module
        .entry_points
        .iter()
        .flat_map(|entry| within(&entry.function, &by_function))
        .filter_map(|o| match o {
            Origin::Global(handle) => Some(handle),
            Origin::Argument(_) => None,
        })
        .collect()
}

fn binding_type(
    module: &Module,
    global: &naga::GlobalVariable,
    filterable: bool,
) -> Result<BindingType, String> {
    let ty = &module.types[global.ty].inner;
    let size = || u64::from(ty.size(module.to_ctx()));
    Ok(match (global.space, ty) {
        (AddressSpace::Uniform, _) => BindingType::Uniform { min_size: size() },
        (AddressSpace::Storage { access }, _) => BindingType::Storage {
            read_only: !access.contains(StorageAccess::STORE),
            min_size: size(),
        },
        (
            _,
            TypeInner::Image {
                dim,
                arrayed,
                class,
            },
        ) => {
            let dim = match (dim, arrayed) {
                (ImageDimension::D1, _) => ViewDimension::D1,
                (ImageDimension::D2, false) => ViewDimension::D2,
                (ImageDimension::D2, true) => ViewDimension::D2Array,
                (ImageDimension::D3, _) => ViewDimension::D3,
                (ImageDimension::Cube, false) => ViewDimension::Cube,
                (ImageDimension::Cube, true) => ViewDimension::CubeArray,
            };
            match *class {
                ImageClass::Sampled { kind, multi } => BindingType::Texture {
                    sample: match kind {
                        ScalarKind::Sint => SampleType::Sint,
                        ScalarKind::Uint => SampleType::Uint,
                        _ => SampleType::Float {
                            filterable: filterable && !multi,
                        },
                    },
                    dim,
                    multisampled: multi,
                },
                ImageClass::Depth { multi } => BindingType::Texture {
                    sample: SampleType::Depth,
                    dim,
                    multisampled: multi,
                },
                ImageClass::Storage { format, access } => BindingType::StorageTexture {
                    format,
                    access: match (
                        access.contains(StorageAccess::LOAD),
                        access.contains(StorageAccess::STORE),
                    ) {
                        (true, true) => Access::ReadWrite,
                        (true, false) => Access::Read,
                        _ => Access::Write,
                    },
                    dim,
                },
                ImageClass::External => {
                    return Err("external textures are not supported".to_owned());
                }
            }
        }
        (_, TypeInner::Sampler { comparison }) => BindingType::Sampler {
            comparison: *comparison,
            filtering: filterable,
        },
        _ => return Err("a binding of this type is not supported".to_owned()),
    })
}

fn scalar_name(scalar: naga::Scalar) -> Option<&'static str> {
    Some(match (scalar.kind, scalar.width) {
        (ScalarKind::Float, 4) => "f32",
        (ScalarKind::Float, 2) => "f16",
        (ScalarKind::Sint, 4) => "i32",
        (ScalarKind::Uint, 4) => "u32",
        _ => return None,
    })
}

fn member_type(module: &Module, ty: Handle<Type>) -> Result<MemberType, String> {
    let found = &module.types[ty];
    let unknown = || "a buffer with a type that has no description".to_owned();
    let scalar = |scalar| scalar_name(scalar).ok_or_else(unknown);
    Ok(match &found.inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) => MemberType::Scalar(scalar(*s)?),
        TypeInner::Vector { size, scalar: s } => MemberType::Vector(*size as u32, scalar(*s)?),
        TypeInner::Matrix {
            columns,
            rows,
            scalar: s,
        } => MemberType::Matrix(*columns as u32, *rows as u32, scalar(*s)?),
        TypeInner::Array { base, size, stride } => {
            let length = match size {
                ArraySize::Constant(n) => Some(n.get()),
                ArraySize::Dynamic => None,
                ArraySize::Pending(_) => return Err(unknown()),
            };
            MemberType::Array(Box::new(member_type(module, *base)?), length, *stride)
        }
        TypeInner::Struct { .. } => MemberType::Struct(found.name.clone().unwrap_or_default()),
        _ => return Err(unknown()),
    })
}

/// Describes the structures in a buffer's type, nested ones included.
fn collect_structs(
    module: &Module,
    ty: Handle<Type>,
    out: &mut BTreeMap<String, StructLayout>,
) -> Result<(), String> {
    let found = &module.types[ty];
    match &found.inner {
        TypeInner::Array { base, .. } => collect_structs(module, *base, out),
        TypeInner::Struct { members, span } => {
            let name = found.name.clone().unwrap_or_default();
            if out.contains_key(&name) {
                return Ok(());
            }
            let mut layout = StructLayout {
                name: name.clone(),
                size: *span,
                align: align(module, ty),
                members: Vec::new(),
                doc: String::new(),
            };
            for member in members {
                layout.members.push(MemberLayout {
                    name: member.name.clone().unwrap_or_default(),
                    offset: member.offset,
                    ty: member_type(module, member.ty)?,
                    doc: String::new(),
                });
                collect_structs(module, member.ty, out)?;
            }
            out.insert(name, layout);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// The alignment of a host-shareable type.
fn align(module: &Module, ty: Handle<Type>) -> u32 {
    let vector = |size: naga::VectorSize, scalar: naga::Scalar| {
        let n = if size == naga::VectorSize::Bi { 2 } else { 4 };
        n * u32::from(scalar.width)
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) => u32::from(s.width),
        TypeInner::Vector { size, scalar } => vector(*size, *scalar),
        TypeInner::Matrix { rows, scalar, .. } => vector(*rows, *scalar),
        TypeInner::Array { base, .. } => align(module, *base),
        TypeInner::Struct { members, .. } => members
            .iter()
            .map(|member| align(module, member.ty))
            .max()
            .unwrap_or(1),
        _ => 1,
    }
}
