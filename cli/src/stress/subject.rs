//! The public functions of modules: parameters and results taken apart into numbers, and the text that evaluates them.

use std::collections::BTreeMap;

use veduta::device::Gpu;
use veduta::eval::{Evaluator, Spec};
use veduta_compose::header::{Function, Headers, Param, parse_headers};
use veduta_compose::{Diags, Library};

use super::airs;
use crate::error::CliError;

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// `f32`
    F32,
    /// `i32`
    I32,
    /// `u32`
    U32,
    /// `bool`, 0 or 1 in its column.
    Bool,
}

impl Scalar {
    /// What 32 bits mean.
    pub fn value(self, bits: u32) -> f64 {
        match self {
            Scalar::F32 => f64::from(f32::from_bits(bits)),
            Scalar::I32 => f64::from(bits.cast_signed()),
            Scalar::U32 => f64::from(bits),
            Scalar::Bool => f64::from(u8::from(bits != 0)),
        }
    }

    /// The same as text that gives the bits back.
    pub fn show(self, bits: u32) -> String {
        match self {
            Scalar::F32 => format!("{:?}", f32::from_bits(bits)),
            Scalar::I32 => bits.cast_signed().to_string(),
            Scalar::U32 => bits.to_string(),
            Scalar::Bool => (bits != 0).to_string(),
        }
    }
}

/// One number of a parameter or of a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaf {
    /// The parameter or member, `frac` or `layer.bottom`; empty for a result that is no structure.
    pub name: String,
    /// The component of a vector.
    pub axis: Option<usize>,
    /// The type.
    pub scalar: Scalar,
    /// How many values it chooses among, if it stands for a value that does not fit into columns.
    pub choices: Option<u32>,
}

impl Leaf {
    /// `layer.bottom`, `frac.x`.
    pub fn show(&self) -> String {
        match self.axis {
            Some(axis) => format!("{}.{}", self.name, AXES[axis]),
            None => self.name.clone(),
        }
    }
}

const AXES: [&str; 4] = ["x", "y", "z", "w"];

/// A public function of a module.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The full name, `veduta::noise::value::value_noise_2d`.
    pub path: String,
    /// The function with its header.
    pub function: Function,
    /// The numbers of its arguments, one a column.
    pub inputs: Vec<Leaf>,
    /// The numbers of its result.
    pub outputs: Vec<Leaf>,
    imports: Vec<String>,
    call: String,
    /// The expressions of the results' bits, at most four numbers each.
    packs: Vec<String>,
}

/// Scalar and number of components of a type that is no structure.
fn plain(ty: &str) -> Option<(Scalar, usize)> {
    let scalar = |name: &str| match name {
        "f32" | "f" => Some(Scalar::F32),
        "i32" | "i" => Some(Scalar::I32),
        "u32" | "u" => Some(Scalar::U32),
        "bool" => Some(Scalar::Bool),
        _ => None,
    };
    let Some(rest) = ty.strip_prefix("vec") else {
        return (ty.len() > 1).then(|| scalar(ty)).flatten().map(|s| (s, 1));
    };
    let count = rest.get(..1)?.parse().ok()?;
    let inner = rest[1..].trim_start_matches('<').trim_end_matches('>');
    Some((scalar(inner)?, count))
}

/// The structures by name, each with its module's path.
type Structs = BTreeMap<String, (String, Vec<Param>)>;

fn leaves(name: &str, ty: &str, structs: &Structs, found: &mut Vec<Leaf>) -> Option<()> {
    if let Some((scalar, count)) = plain(ty) {
        found.extend((0..count).map(|axis| Leaf {
            name: name.to_owned(),
            axis: (count > 1).then_some(axis),
            scalar,
            choices: None,
        }));
        return Some(());
    }
    if ty == airs::TYPE {
        found.push(Leaf {
            name: name.to_owned(),
            axis: None,
            scalar: Scalar::U32,
            choices: Some(airs::COUNT),
        });
        return Some(());
    }
    let (_, members) = structs.get(ty)?;
    for member in members {
        let path = if name.is_empty() {
            member.name.clone()
        } else {
            format!("{name}.{}", member.name)
        };
        leaves(&path, &member.ty, structs, found)?;
    }
    Some(())
}

/// The expression of a value of type `ty` whose numbers begin in `column`.
fn build(ty: &str, structs: &Structs, column: &mut usize, imports: &mut Vec<String>) -> String {
    if let Some((scalar, count)) = plain(ty) {
        let parts: Vec<String> = (0..count)
            .map(|_| {
                let k = *column;
                *column += 1;
                match scalar {
                    Scalar::F32 => format!("in.f[{k}]"),
                    Scalar::I32 => format!("in.i[{k}]"),
                    Scalar::U32 => format!("in.u[{k}]"),
                    Scalar::Bool => format!("(in.u[{k}] != 0u)"),
                }
            })
            .collect();
        return match count {
            1 => parts.join(""),
            _ => format!("{ty}({})", parts.join(", ")),
        };
    }
    let Some((module, members)) = structs.get(ty) else {
        return String::new();
    };
    imports.push(format!("{module}::{ty}"));
    if ty == airs::TYPE {
        imports.push(format!("{module}::FourLayers"));
        let k = *column;
        *column += 1;
        return format!("stress_air(in.u[{k}])");
    }
    let parts: Vec<String> = members
        .iter()
        .map(|member| build(&member.ty, structs, column, imports))
        .collect();
    format!("{ty}({})", parts.join(", "))
}

/// The headers of all modules, by path.
fn headers(library: &Library) -> Result<Vec<(String, Headers)>, CliError> {
    let mut faults = Diags::new();
    let mut headers = Vec::new();
    for module in library.modules() {
        match parse_headers(&module.file, &module.text) {
            Ok(found) => headers.push((module.path.clone(), found)),
            Err(more) => faults.append(more),
        }
    }
    faults.ok(headers).map_err(CliError::from)
}

fn reads_textures(function: &Function) -> bool {
    let mut types = function.params.iter().map(|p| p.ty.as_str());
    types.any(|ty| ty.starts_with("texture_") || ty.starts_with("sampler"))
}

impl Subject {
    /// The public functions of a library, by path, without those that read textures.
    ///
    /// # Errors
    /// Faults of headers; a type that has no numbers.
    pub fn all(library: &Library) -> Result<Vec<Subject>, CliError> {
        let headers = headers(library)?;
        let structs: Structs = headers
            .iter()
            .flat_map(|(path, found)| {
                let each = found.structs.iter();
                each.map(|s| (s.name.clone(), (path.clone(), s.members.clone())))
            })
            .collect();
        let mut subjects = Vec::new();
        for (module, found) in headers {
            for function in found.functions {
                if !function.header.internal && !reads_textures(&function) {
                    subjects.push(Subject::new(&module, function, &structs)?);
                }
            }
        }
        Ok(subjects)
    }

    /// The full names of the public functions of a library that read textures.
    ///
    /// # Errors
    /// Faults of headers.
    pub fn textured(library: &Library) -> Result<Vec<String>, CliError> {
        let mut names = Vec::new();
        for (module, found) in headers(library)? {
            let functions = found.functions.iter();
            names.extend(
                functions
                    .filter(|f| !f.header.internal && reads_textures(f))
                    .map(|f| format!("{module}::{}", f.name)),
            );
        }
        Ok(names)
    }

    fn new(module: &str, function: Function, structs: &Structs) -> Result<Subject, CliError> {
        let path = format!("{module}::{}", function.name);
        let mut imports = vec![path.clone()];
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        let mut arguments = Vec::new();
        let mut column = 0;
        let result = function.result.clone().unwrap_or_default();
        let known = function
            .params
            .iter()
            .try_for_each(|p| leaves(&p.name, &p.ty, structs, &mut inputs))
            .and_then(|()| leaves("", &result, structs, &mut outputs));
        if known.is_none() {
            return Err(CliError::argument(
                path,
                "a function",
                "one of numbers, vectors and structures of them",
            ));
        }
        for param in &function.params {
            arguments.push(build(&param.ty, structs, &mut column, &mut imports));
        }
        // The result's structures are imported for the type of a variable.
        build(&result, structs, &mut 0, &mut imports);
        imports.sort();
        imports.dedup();
        let packs = outputs
            .chunks(4)
            .map(|chunk| {
                let bits: Vec<String> = chunk
                    .iter()
                    .map(|leaf| {
                        let shown = leaf.show();
                        let place = if shown.is_empty() || shown.starts_with('.') {
                            format!("r{shown}")
                        } else {
                            format!("r.{shown}")
                        };
                        match leaf.scalar {
                            Scalar::Bool => format!("select(0u, 1u, {place})"),
                            Scalar::U32 => place,
                            _ => format!("bitcast<u32>({place})"),
                        }
                    })
                    .collect();
                match chunk.len() {
                    1 => bits.join(""),
                    n => format!("vec{n}<u32>({})", bits.join(", ")),
                }
            })
            .collect();
        Ok(Subject {
            call: format!("{}({})", function.name, arguments.join(", ")),
            path,
            function,
            inputs,
            outputs,
            imports,
            packs,
        })
    }

    /// The module's path without `veduta::`, and the function's name.
    pub fn short(&self) -> &str {
        self.path.strip_prefix("veduta::").unwrap_or(&self.path)
    }

    /// A row as text, `cell.x = 3, frac.x = 0.5`.
    pub fn show(&self, row: &[u32]) -> String {
        let parts: Vec<String> = self
            .inputs
            .iter()
            .zip(row)
            .map(|(leaf, bits)| format!("{} = {}", leaf.show(), leaf.scalar.show(*bits)))
            .collect();
        parts.join(", ")
    }

    /// Compiles the function for the device.
    ///
    /// # Errors
    /// Faults of composing and of the device.
    pub fn compile(&self, gpu: &Gpu, library: &Library) -> Result<Device, CliError> {
        let imports: Vec<&str> = self.imports.iter().map(String::as_str).collect();
        let result = self.function.result.clone().unwrap_or_default();
        let airs = if self.inputs.iter().any(|leaf| leaf.choices.is_some()) {
            airs::wgsl()
        } else {
            String::new()
        };
        let parts = self
            .packs
            .iter()
            .zip(self.outputs.chunks(4))
            .map(|(pack, chunk)| {
                let width = chunk.len();
                let ty = match width {
                    1 => "u32".to_owned(),
                    n => format!("vec{n}<u32>"),
                };
                let evaluator = Evaluator::new(
                    gpu,
                    library,
                    &Spec {
                        imports: &imports,
                        prelude: &format!(
                            "{airs}fn stress_bits(r: {result}) -> {ty} {{ return {pack}; }}"
                        ),
                        prelude_file: "",
                        expression: &format!("stress_bits({})", self.call),
                        columns: self.columns(),
                        features: &["AIR_EIGHT_LANES"],
                    },
                )?;
                Ok((evaluator, width))
            })
            .collect::<Result<_, CliError>>()?;
        Ok(Device {
            parts,
            width: self.outputs.len(),
        })
    }

    /// Columns of a row; a function without parameters has one that it does not read.
    pub fn columns(&self) -> usize {
        self.inputs.len().max(1)
    }
}

/// A function on the device.
#[derive(Debug)]
pub struct Device {
    parts: Vec<(Evaluator, usize)>,
    width: usize,
}

impl Device {
    /// The bits of the results, row after row.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn run(&self, rows: &[u32]) -> Result<Vec<u32>, CliError> {
        if let [(whole, _)] = &self.parts[..] {
            return Ok(whole.run_bits(rows)?);
        }
        let mut results = Vec::new();
        let mut at = 0;
        for (part, width) in &self.parts {
            let found = part.run_bits(rows)?;
            results.resize(found.len() / width * self.width, 0);
            for (to, from) in results
                .chunks_exact_mut(self.width)
                .zip(found.chunks_exact(*width))
            {
                to[at..at + width].copy_from_slice(from);
            }
            at += width;
        }
        Ok(results)
    }
}
