//! From linked IR to plain WGSL.

use std::collections::BTreeSet;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use crate::link::{demangle, module_of};

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
