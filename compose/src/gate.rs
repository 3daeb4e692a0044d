//! The gates that every output passes.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// `Some` while a call is watched: where the panic hook leaves the message.
    static WATCHED: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs a call into a library that may panic; the panic's message (with its place) is the error. Nothing is printed.
pub(crate) fn no_panic<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let watched = WATCHED.with_borrow_mut(|message| {
                let Some(message) = message else {
                    return false;
                };
                let payload = info.payload();
                let text = payload
                    .downcast_ref::<&str>()
                    .map(|text| (*text).to_owned())
                    .or_else(|| payload.downcast_ref::<String>().cloned())
                    .unwrap_or_else(|| "no message".to_owned());
                *message = text;
                true
            });
            if !watched {
                before(info);
            }
        }));
    });
    let outer = WATCHED.with_borrow_mut(|message| message.replace(String::new()));
    let outcome = catch_unwind(AssertUnwindSafe(call));
    let message = WATCHED.with_borrow_mut(|message| std::mem::replace(message, outer));
    outcome.map_err(|_| message.unwrap_or_default())
}

use naga::back::{hlsl, msl, spv};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Binding, BuiltIn, ImageClass, Module, StorageFormat, TypeInner};

/// A language to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// WGSL.
    Wgsl,
    /// SPIR-V 1.3.
    Spirv,
    /// HLSL for shader model 5.1.
    Hlsl51,
    /// HLSL for shader model 6.0.
    Hlsl,
    /// Metal 2.4.
    Msl,
}

impl Target {
    /// The name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "WGSL",
            Self::Spirv => "SPIR-V",
            Self::Hlsl51 => "HLSL (shader model 5.1)",
            Self::Hlsl => "HLSL",
            Self::Msl => "MSL",
        }
    }
}

/// What a writer wrote.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Written {
    /// Text.
    Text(String),
    /// SPIR-V words.
    Words(Vec<u32>),
}

impl Written {
    /// The bytes of a file with it (SPIR-V in little endian).
    pub fn into_bytes(self) -> Vec<u8> {
        match self {
            Self::Text(text) => text.into_bytes(),
            Self::Words(words) => words.iter().flat_map(|word| word.to_le_bytes()).collect(),
        }
    }
}

/// Writes plain WGSL (a composed stage) for a target; overrides take their defaults there, or 1 without one, except in
/// WGSL itself.
///
/// # Errors
/// What the parser, the validator or the writer says, panics included.
pub fn write_target(
    wgsl: &str,
    target: Target,
    capabilities: Capabilities,
) -> Result<Written, String> {
    no_panic(|| {
        let module =
            naga::front::wgsl::parse_str(wgsl).map_err(|error| error.emit_to_string(wgsl))?;
        let info = validate(&module, capabilities)?;
        match target {
            Target::Wgsl => Ok(Written::Text(wgsl.to_owned())),
            _ => {
                let (module, info) = with_defaults(&module, &info)?;
                write(&module, &info, target)
            }
        }
    })
    .unwrap_or_else(|panic| Err(format!("the {} writer panicked: {panic}", target.name())))
}

fn validate(module: &Module, capabilities: Capabilities) -> Result<ModuleInfo, String> {
    Validator::new(ValidationFlags::all(), capabilities)
        .validate(module)
        .map_err(|error| chain(error.as_inner()))
}

/// An error with its causes, on one line.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let more = inner.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = inner.source();
    }
    text.trim_end().replace('\n', " ")
}

/// The module with every override replaced by its default (1 without one).
fn with_defaults(module: &Module, info: &ModuleInfo) -> Result<(Module, ModuleInfo), String> {
    let constants: naga::back::PipelineConstants = module
        .overrides
        .iter()
        .filter(|(_, item)| item.init.is_none())
        .filter_map(|(_, item)| {
            let key = item
                .id
                .map(|id| id.to_string())
                .or_else(|| item.name.clone())?;
            Some((key, 1.0))
        })
        .collect();
    let (module, info) =
        naga::back::pipeline_constants::process_overrides(module, info, None, &constants)
            .map_err(|error| chain(&error))?;
    Ok((module.into_owned(), info.into_owned()))
}

fn write(module: &Module, info: &ModuleInfo, target: Target) -> Result<Written, String> {
    match target {
        Target::Wgsl => {
            naga::back::wgsl::write_string(module, info, naga::back::wgsl::WriterFlags::empty())
                .map(Written::Text)
                .map_err(|error| chain(&error))
        }
        Target::Spirv => {
            let options = spv::Options {
                lang_version: (1, 3),
                flags: spv::WriterFlags::ADJUST_COORDINATE_SPACE
                    | spv::WriterFlags::LABEL_VARYINGS
                    | spv::WriterFlags::CLAMP_FRAG_DEPTH,
                ..Default::default()
            };
            spv::write_vec(module, info, &options, None)
                .map(Written::Words)
                .map_err(|error| chain(&error))
        }
        Target::Hlsl51 | Target::Hlsl => {
            let options = hlsl::Options {
                shader_model: if target == Target::Hlsl {
                    hlsl::ShaderModel::V6_0
                } else {
                    hlsl::ShaderModel::V5_1
                },
                ..Default::default()
            };
            let mut text = String::new();
            let pipeline = hlsl::PipelineOptions::default();
            hlsl::Writer::new(&mut text, &options, &pipeline)
                .write(module, info, None)
                .map_err(|error| chain(&error))?;
            Ok(Written::Text(text))
        }
        Target::Msl => {
            let options = msl::Options {
                lang_version: (2, 4),
                ..Default::default()
            };
            msl::write_string(module, info, &options, &msl::PipelineOptions::default())
                .map(|(text, _)| Written::Text(text))
                .map_err(|error| chain(&error))
        }
    }
}

/// A fault of an output: the name of the item that it concerns (an entry point, a global, an override), and what is
/// wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GateFault {
    /// Name of the item, `None` for the stage as a whole.
    pub item: Option<String>,
    /// What is wrong.
    pub message: String,
}

impl GateFault {
    fn of(item: &str, message: String) -> Self {
        Self {
            item: Some(item.to_owned()),
            message,
        }
    }

    fn whole(message: String) -> Self {
        Self {
            item: None,
            message,
        }
    }
}

/// Sends one composed stage through all gates: re-parse and validation of the written text, the names that a host needs,
/// all writers, WebGPU's default limits.
pub fn check(wgsl: &str, written_from: &Module, capabilities: Capabilities) -> Vec<GateFault> {
    let mut faults = Vec::new();
    let parsed = no_panic(|| {
        let module =
            naga::front::wgsl::parse_str(wgsl).map_err(|error| error.message().to_owned())?;
        let info = validate(&module, capabilities)?;
        Ok::<_, String>((module, info))
    });
    let (module, info) = match parsed {
        Ok(Ok(parsed)) => parsed,
        Ok(Err(error)) => {
            faults.push(GateFault::whole(format!(
                "the composed WGSL does not parse again: {error}"
            )));
            return faults;
        }
        Err(panic) => {
            faults.push(GateFault::whole(format!(
                "the WGSL front end panicked on the composed text: {panic}"
            )));
            return faults;
        }
    };
    same_names(written_from, &module, &mut faults);
    let processed = match no_panic(|| with_defaults(&module, &info)) {
        Ok(Ok(processed)) => processed,
        Ok(Err(error)) | Err(error) => {
            faults.push(GateFault::whole(format!(
                "the defaults of the overrides do not fit: {error}"
            )));
            return faults;
        }
    };
    let (module, info) = &processed;
    faults.extend(partial_pointers(written_from));
    let pointers = !faults.is_empty();
    for target in [Target::Spirv, Target::Hlsl51, Target::Hlsl, Target::Msl] {
        if pointers && target == Target::Spirv {
            continue;
        }
        let name = target.name();
        match no_panic(|| write(module, info, target)) {
            Ok(Ok(_)) => {}
            Ok(Err(error)) => {
                faults.push(GateFault::whole(format!(
                    "cannot be written as {name}: {error}"
                )));
            }
            Err(panic) => {
                faults.push(GateFault::whole(format!(
                    "the {name} writer panicked: {panic}"
                )));
            }
        }
    }
    limits(module, info, &mut faults);
    faults
}

/// Calls that pass a pointer to a part of a variable: naga validates them, and then its SPIR-V writer panics. The faults
/// concern the calling functions.
pub fn partial_pointers(module: &Module) -> Vec<GateFault> {
    fn calls(block: &naga::Block, found: &mut dyn FnMut(&naga::Statement)) {
        for statement in block {
            match statement {
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
                other => found(other),
            }
        }
    }
    let mut faults = Vec::new();
    let functions = module
        .functions
        .iter()
        .map(|(_, function)| (function.name.as_deref().unwrap_or_default(), function));
    let entries = module
        .entry_points
        .iter()
        .map(|entry| (entry.name.as_str(), &entry.function));
    for (name, function) in functions.chain(entries) {
        calls(&function.body, &mut |statement| {
            let naga::Statement::Call {
                function: callee,
                arguments,
                ..
            } = statement
            else {
                return;
            };
            let callee = &module.functions[*callee];
            for (argument, parameter) in arguments.iter().zip(&callee.arguments) {
                let pointer = matches!(
                    module.types[parameter.ty].inner,
                    TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
                );
                let part = matches!(
                    function.expressions[*argument],
                    naga::Expression::Access { .. } | naga::Expression::AccessIndex { .. }
                );
                if pointer && part {
                    let callee = crate::link::demangle(callee.name.as_deref().unwrap_or_default());
                    faults.push(GateFault::of(
                        name,
                        format!(
                            "`{name}` passes a pointer to a part of a variable to `{callee}`, on which naga's SPIR-V writer fails"
                        ),
                    ));
                }
            }
        });
    }
    faults
}

/// Entry points and overrides must bear the same names in the text as in the source: the host asks for them.
fn same_names(source: &Module, written: &Module, faults: &mut Vec<GateFault>) {
    for (a, b) in source.entry_points.iter().zip(&written.entry_points) {
        if a.name != b.name {
            faults.push(GateFault::of(
                &a.name,
                format!(
                    "entry point `{}` would be renamed to `{}`: choose another name",
                    a.name, b.name
                ),
            ));
        }
    }
    let names = |module: &Module| -> Vec<String> {
        let mut names: Vec<String> = module
            .overrides
            .iter()
            .filter_map(|(_, item)| item.name.clone())
            .collect();
        names.sort();
        names
    };
    let written = names(written);
    for name in names(source) {
        if !written.contains(&name) {
            faults.push(GateFault::of(
                &name,
                format!("override `{name}` would be renamed: choose another name"),
            ));
        }
    }
}

/// WebGPU's default limits, which every device has.
pub mod limit {
    /// Bind groups of a pipeline.
    pub const BIND_GROUPS: u32 = 4;
    /// Bindings of a bind group.
    pub const BINDINGS_PER_GROUP: u32 = 1000;
    /// Uniform buffers of a stage.
    pub const UNIFORM_BUFFERS: u32 = 12;
    /// Storage buffers of a stage.
    pub const STORAGE_BUFFERS: u32 = 8;
    /// Sampled textures of a stage.
    pub const SAMPLED_TEXTURES: u32 = 16;
    /// Samplers of a stage.
    pub const SAMPLERS: u32 = 16;
    /// Storage textures of a stage.
    pub const STORAGE_TEXTURES: u32 = 4;
    /// Bytes of a uniform binding.
    pub const UNIFORM_BYTES: u64 = 65536;
    /// Bytes of a storage binding.
    pub const STORAGE_BYTES: u64 = 134_217_728;
    /// Bytes of workgroup memory.
    pub const WORKGROUP_BYTES: u64 = 16384;
    /// Invocations of a workgroup.
    pub const INVOCATIONS: u32 = 256;
    /// Invocations of a workgroup along x, y and z.
    pub const WORKGROUP_SIZE: [u32; 3] = [256, 256, 64];
    /// Variables between vertex and fragment stage.
    pub const INTER_STAGE: u32 = 16;
    /// Vertex attributes.
    pub const VERTEX_ATTRIBUTES: u32 = 16;
    /// Colour attachments.
    pub const COLOR_ATTACHMENTS: u32 = 8;
}

fn limits(module: &Module, info: &ModuleInfo, faults: &mut Vec<GateFault>) {
    use naga::ShaderStage as Stage;
    for (_, global) in module.global_variables.iter() {
        global_limits(module, global, faults);
    }
    for (index, entry) in module.entry_points.iter().enumerate() {
        let uses = info.get_entry_point(index);
        let name = entry.name.as_str();
        let mut counts = [0u32; 5];
        const KINDS: [(&str, u32); 5] = [
            ("uniform buffers", limit::UNIFORM_BUFFERS),
            ("storage buffers", limit::STORAGE_BUFFERS),
            ("sampled textures", limit::SAMPLED_TEXTURES),
            ("samplers", limit::SAMPLERS),
            ("storage textures", limit::STORAGE_TEXTURES),
        ];
        let mut workgroup = 0u64;
        for (handle, global) in module.global_variables.iter() {
            if uses[handle].is_empty() {
                continue;
            }
            let ty = &module.types[global.ty].inner;
            match (global.space, ty) {
                (AddressSpace::Uniform, _) => counts[0] += 1,
                (AddressSpace::Storage { access }, _) => {
                    counts[1] += 1;
                    if entry.stage == Stage::Vertex && access.contains(naga::StorageAccess::STORE) {
                        let global = global.name.as_deref().unwrap_or_default();
                        faults.push(GateFault::of(
                            global,
                            format!("the vertex stage must not write storage (`{global}`)"),
                        ));
                    }
                }
                (
                    _,
                    TypeInner::Image {
                        class: ImageClass::Storage { access, .. },
                        ..
                    },
                ) => {
                    counts[4] += 1;
                    if entry.stage == Stage::Vertex && access.contains(naga::StorageAccess::STORE) {
                        let global = global.name.as_deref().unwrap_or_default();
                        faults.push(GateFault::of(
                            global,
                            format!("the vertex stage must not write storage (`{global}`)"),
                        ));
                    }
                }
                (_, TypeInner::Image { .. }) => counts[2] += 1,
                (_, TypeInner::Sampler { .. }) => counts[3] += 1,
                (AddressSpace::WorkGroup, _) => {
                    workgroup += u64::from(ty.size(module.to_ctx())).next_multiple_of(16);
                }
                _ => {}
            }
        }
        for (count, (what, most)) in counts.into_iter().zip(KINDS) {
            if count > most {
                faults.push(GateFault::of(
                    name,
                    format!(
                        "{count} {what} in `{name}` are more than WebGPU's default limit of {most}"
                    ),
                ));
            }
        }
        if workgroup > limit::WORKGROUP_BYTES {
            faults.push(GateFault::of(
                name,
                format!(
                    "{workgroup} bytes of workgroup memory in `{name}` are more than WebGPU's default limit of {}",
                    limit::WORKGROUP_BYTES
                ),
            ));
        }
        if entry.stage == Stage::Compute {
            let size = entry.workgroup_size;
            for ((axis, size), most) in ["x", "y", "z"]
                .into_iter()
                .zip(size)
                .zip(limit::WORKGROUP_SIZE)
            {
                if size > most {
                    faults.push(GateFault::of(
                        name,
                        format!("workgroup size {size} along {axis} of `{name}` is more than WebGPU's default limit of {most}"),
                    ));
                }
            }
            let all = size.iter().map(|n| u64::from(*n)).product::<u64>();
            if all > u64::from(limit::INVOCATIONS) {
                faults.push(GateFault::of(
                    name,
                    format!(
                        "{all} invocations in a workgroup of `{name}` are more than WebGPU's default limit of {}",
                        limit::INVOCATIONS
                    ),
                ));
            }
        }
        interface_limits(module, entry, faults);
    }
}

fn global_limits(module: &Module, global: &naga::GlobalVariable, faults: &mut Vec<GateFault>) {
    let name = global.name.as_deref().unwrap_or_default();
    let ty = &module.types[global.ty].inner;
    let mut over = |what: String, most: u64| {
        faults.push(GateFault::of(
            name,
            format!("{what} of `{name}` is more than WebGPU's default limit allows ({most})"),
        ));
    };
    if let Some(place) = &global.binding {
        if place.group >= limit::BIND_GROUPS {
            over(
                format!("bind group {}", place.group),
                u64::from(limit::BIND_GROUPS) - 1,
            );
        }
        if place.binding >= limit::BINDINGS_PER_GROUP {
            over(
                format!("binding {}", place.binding),
                u64::from(limit::BINDINGS_PER_GROUP) - 1,
            );
        }
    }
    match global.space {
        AddressSpace::Uniform => {
            let size = u64::from(ty.size(module.to_ctx()));
            if size > limit::UNIFORM_BYTES {
                over(
                    format!("a uniform size of {size} bytes"),
                    limit::UNIFORM_BYTES,
                );
            }
        }
        AddressSpace::Storage { .. } => {
            let size = u64::from(ty.size(module.to_ctx()));
            if size > limit::STORAGE_BYTES {
                over(
                    format!("a storage size of {size} bytes"),
                    limit::STORAGE_BYTES,
                );
            }
        }
        AddressSpace::Immediate => faults.push(GateFault::of(
            name,
            format!(
                "`{name}` is in the address space `immediate`, which WebGPU's core does not have"
            ),
        )),
        _ => {}
    }
    if let TypeInner::Image {
        class: ImageClass::Storage { format, access },
        ..
    } = ty
    {
        use StorageFormat as F;
        let read_write = access.contains(naga::StorageAccess::LOAD | naga::StorageAccess::STORE);
        let core = match format {
            F::R32Uint | F::R32Sint | F::R32Float => true,
            F::Rgba8Unorm
            | F::Rgba8Snorm
            | F::Rgba8Uint
            | F::Rgba8Sint
            | F::Rgba16Uint
            | F::Rgba16Sint
            | F::Rgba16Float
            | F::Rg32Uint
            | F::Rg32Sint
            | F::Rg32Float
            | F::Rgba32Uint
            | F::Rgba32Sint
            | F::Rgba32Float => !read_write,
            _ => false,
        };
        if !core {
            let format = format!("{format:?}").to_lowercase();
            let access = if read_write { " with `read_write`" } else { "" };
            faults.push(GateFault::of(
                name,
                format!(
                    "storage texture format `{format}`{access} of `{name}` is not in WebGPU's core"
                ),
            ));
        }
    }
}

/// The bindings of an entry point's arguments or result.
fn bindings(
    module: &Module,
    ty: naga::Handle<naga::Type>,
    binding: Option<&Binding>,
) -> Vec<(Binding, naga::Handle<naga::Type>)> {
    match (binding, &module.types[ty].inner) {
        (Some(binding), _) => vec![(binding.clone(), ty)],
        (None, TypeInner::Struct { members, .. }) => members
            .iter()
            .filter_map(|member| Some((member.binding.clone()?, member.ty)))
            .collect(),
        _ => Vec::new(),
    }
}

fn inputs(module: &Module, entry: &naga::EntryPoint) -> Vec<(Binding, naga::Handle<naga::Type>)> {
    entry
        .function
        .arguments
        .iter()
        .flat_map(|argument| bindings(module, argument.ty, argument.binding.as_ref()))
        .collect()
}

fn outputs(module: &Module, entry: &naga::EntryPoint) -> Vec<(Binding, naga::Handle<naga::Type>)> {
    entry
        .function
        .result
        .iter()
        .flat_map(|result| bindings(module, result.ty, result.binding.as_ref()))
        .collect()
}

fn interface_limits(module: &Module, entry: &naga::EntryPoint, faults: &mut Vec<GateFault>) {
    use naga::ShaderStage as Stage;
    let name = entry.name.as_str();
    let mut check = |what: &str,
                     list: &[(Binding, naga::Handle<naga::Type>)],
                     most: u32,
                     builtins: u32| {
        let locations: Vec<u32> = list
            .iter()
            .filter_map(|(binding, _)| match binding {
                Binding::Location { location, .. } => Some(*location),
                Binding::BuiltIn(_) => None,
            })
            .collect();
        let count = locations.len() as u32 + builtins;
        if count > most {
            faults.push(GateFault::of(
                name,
                format!(
                    "{count} {what} of `{name}` are more than WebGPU's default limit of {most}"
                ),
            ));
        } else if let Some(location) = locations.iter().find(|location| **location >= most) {
            faults.push(GateFault::of(
                name,
                format!("location {location} among the {what} of `{name}` is more than WebGPU's default limit allows ({})", most - 1),
            ));
        }
    };
    match entry.stage {
        Stage::Vertex => {
            let (inputs, outputs) = (inputs(module, entry), outputs(module, entry));
            check("vertex attributes", &inputs, limit::VERTEX_ATTRIBUTES, 0);
            check("inter-stage variables", &outputs, limit::INTER_STAGE, 0);
        }
        Stage::Fragment => {
            let (inputs, outputs) = (inputs(module, entry), outputs(module, entry));
            let builtins = inputs
                .iter()
                .filter(|(binding, _)| {
                    matches!(
                        binding,
                        Binding::BuiltIn(
                            BuiltIn::FrontFacing | BuiltIn::SampleIndex | BuiltIn::SampleMask
                        )
                    )
                })
                .count();
            check(
                "inter-stage variables",
                &inputs,
                limit::INTER_STAGE,
                builtins as u32,
            );
            check("colour attachments", &outputs, limit::COLOR_ATTACHMENTS, 0);
        }
        _ => {}
    }
}

/// Whether the fragment stage gets from the vertex stage what it asks for; faults concern the fragment's entry point.
pub fn check_interface(vertex: &Module, fragment: &Module) -> Vec<GateFault> {
    let mut faults = Vec::new();
    for from in &vertex.entry_points {
        let given = outputs(vertex, from);
        for to in &fragment.entry_points {
            for (binding, ty) in inputs(fragment, to) {
                let Binding::Location {
                    location,
                    interpolation,
                    sampling,
                    ..
                } = binding
                else {
                    continue;
                };
                let found = given.iter().find_map(|(binding, ty)| match binding {
                    Binding::Location {
                        location: l,
                        interpolation,
                        sampling,
                        ..
                    } if *l == location => Some((*ty, *interpolation, *sampling)),
                    _ => None,
                });
                let (a, b) = (from.name.as_str(), to.name.as_str());
                match found {
                    None => faults.push(GateFault::of(
                        b,
                        format!("`{b}` reads location {location}, which `{a}` does not write"),
                    )),
                    Some((other, ..)) if vertex.types[other].inner != fragment.types[ty].inner => {
                        faults.push(GateFault::of(
                            b,
                            format!("location {location} has another type in `{b}` than in `{a}`"),
                        ));
                    }
                    Some((_, i, s)) if (i, s) != (interpolation, sampling) => {
                        faults.push(GateFault::of(
                            b,
                            format!("location {location} is interpolated otherwise in `{b}` than in `{a}`"),
                        ));
                    }
                    Some(_) => {}
                }
            }
        }
    }
    faults
}
