//! Evaluates a WGSL expression over rows of numbers on the device: the library behind `veduta eval` and behind the
//! tests that compare a module function with its f64 twin.
//!
//! A row has up to 16 columns. In the expression, column `k` is `in.i[k]`, `in.u[k]` or `in.f[k]`: the same 32 bits read
//! as `i32`, `u32` or `f32`. The result is a scalar or a vector and comes back bit by bit, so that a NaN stays what it
//! was.

use std::fmt::Write as _;

use veduta_compose::diag::{Diag, Diags, line_at};
use veduta_compose::library::Library;
use veduta_compose::link::{Def, LinkInput, Linker};

use crate::device::Gpu;
use crate::error::Error;

/// Largest number of columns of a row.
pub const MAX_COLUMNS: usize = 64;

/// What every row has room for, so that an expression may name columns that a narrow row leaves out.
const USUAL_COLUMNS: usize = 16;

const WORKGROUP: u32 = 64;
const CHUNK_ROWS: usize = 1 << 20;

/// The type of a column, which says how text and wider numbers are turned into its 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// A 32-bit signed integer.
    I,
    /// A 32-bit unsigned integer.
    U,
    /// A 32-bit float.
    F,
}

impl Column {
    /// Reads a list such as `i,i,f`.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for an unknown letter, an empty list or more than [`MAX_COLUMNS`] columns.
    pub fn parse_list(list: &str) -> Result<Vec<Column>, Error> {
        let fault = |value: &str| Error::OutOfDomain {
            name: "columns".to_owned(),
            value: format!("`{value}`"),
            domain: format!("1 to {MAX_COLUMNS} of i, u, f, divided by commas"),
        };
        let columns = list
            .split(',')
            .map(|c| match c.trim() {
                "i" => Ok(Column::I),
                "u" => Ok(Column::U),
                "f" => Ok(Column::F),
                _ => Err(fault(list)),
            })
            .collect::<Result<Vec<_>, _>>()?;
        if columns.len() > MAX_COLUMNS {
            return Err(fault(list));
        }
        Ok(columns)
    }
}

/// The type of the result's components.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultKind {
    /// `f32`
    F32,
    /// `i32`
    I32,
    /// `u32`
    U32,
    /// `bool`, stored as 0 or 1.
    Bool,
}

/// What to evaluate.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spec<'a> {
    /// Items to import, for instance `veduta::noise::value::value_noise_2d`.
    pub imports: &'a [&'a str],
    /// WGSL to put before the entry point: functions, constants, `override fn`.
    pub prelude: &'a str,
    /// The name of the prelude in messages, for instance its file's; `prelude` when empty.
    pub prelude_file: &'a str,
    /// The expression.
    pub expression: &'a str,
    /// The number of columns of a row, at most [`MAX_COLUMNS`].
    pub columns: usize,
    /// Flags that are on in the modules.
    pub features: &'a [&'a str],
}

/// A compiled expression.
#[derive(Debug)]
pub struct Evaluator {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    columns: usize,
    width: usize,
    kind: ResultKind,
    wgsl: String,
}

/// A text that the caller has given, and its lines in the text that is composed.
struct Part<'a> {
    file: &'a str,
    text: String,
    /// The line, from 1, on which it begins.
    first: u32,
    /// What stands before each of its lines.
    before: &'static str,
}

impl Part<'_> {
    fn lines(&self) -> u32 {
        self.text.lines().count().max(1) as u32
    }

    /// The place at its end, where what the caller has not closed is missed.
    fn end(&self) -> (u32, u32) {
        let last = self.text.lines().last().unwrap_or("");
        (self.lines(), last.chars().count() as u32 + 1)
    }
}

const IMPORT: &str = "#import ";

/// What is composed, and where the caller's parts lie in it.
struct Source<'a> {
    text: String,
    parts: Vec<Part<'a>>,
}

impl<'a> Source<'a> {
    fn add(&mut self, file: &'a str, text: String, before: &'static str) {
        let first = self.text.lines().count() as u32 + 1;
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        for line in text.lines() {
            self.text.push_str(before);
            self.text.push_str(line);
            self.text.push('\n');
        }
        self.parts.push(Part {
            file,
            text,
            first,
            before,
        });
    }

    /// Moves a fault to the part where it stands; one in the lines between them, to the end of the part before, which has
    /// left something open.
    fn place(&self, mut diag: Diag) -> Diag {
        if diag.file != WHOLE || diag.line == 0 {
            return diag;
        }
        let Some((expression, others)) = self.parts.split_last() else {
            return diag;
        };
        // The statement that holds the expression begins on the line before it.
        let part = if diag.line + 1 >= expression.first {
            expression
        } else {
            let others = others.iter().rev().filter(|part| !part.text.is_empty());
            others
                .into_iter()
                .find(|part| part.first <= diag.line)
                .unwrap_or(expression)
        };
        let line = diag.line.saturating_sub(part.first) + 1;
        (diag.line, diag.column) = if part.first > diag.line {
            (1, 1)
        } else if line <= part.lines() {
            let before = part.before.chars().count() as u32;
            (line, diag.column.saturating_sub(before).max(1))
        } else {
            part.end()
        };
        diag.file = part.file.to_owned();
        diag.source_line = line_at(&part.text, diag.line).to_owned();
        diag
    }
}

/// The name of the whole text; it is never shown for a fault in a line.
const WHOLE: &str = "expression";

fn source<'a>(spec: &Spec<'a>, store: &str, width: usize) -> Source<'a> {
    let mut source = Source {
        text: String::new(),
        parts: Vec::new(),
    };
    if !spec.imports.is_empty() {
        source.add("import", spec.imports.join("\n"), IMPORT);
    }
    let prelude_file = match spec.prelude_file {
        "" => "prelude",
        name => name,
    };
    source.add(prelude_file, spec.prelude.to_owned(), "");
    let columns = spec.columns;
    let room = columns.max(USUAL_COLUMNS);
    let _ = writeln!(
        source.text,
        "struct EvalRow {{ i: array<i32, {room}>, u: array<u32, {room}>, f: array<f32, {room}> }}
@group(0) @binding(0) var<storage, read> eval_rows: array<u32>;
@group(0) @binding(1) var<storage, read_write> eval_results: array<u32>;
@compute @workgroup_size({WORKGROUP})
fn evaluate(@builtin(global_invocation_id) id: vec3<u32>) {{
    let row = id.x;
    if row * {columns}u >= arrayLength(&eval_rows) {{ return; }}
    var in: EvalRow;
    for (var k = 0u; k < {columns}u; k++) {{
        let bits = eval_rows[row * {columns}u + k];
        in.i[k] = bitcast<i32>(bits);
        in.u[k] = bits;
        in.f[k] = bitcast<f32>(bits);
    }}
    var value ="
    );
    source.add("expression", spec.expression.to_owned(), "");
    let _ = writeln!(
        source.text,
        ";
    let base = row * {width}u;
    {store}
}}"
    );
    source
}

fn result_type(module: &naga::Module) -> Result<(usize, ResultKind), Error> {
    let value = module
        .entry_points
        .iter()
        .find(|e| e.name == "evaluate")
        .and_then(|e| {
            let mut locals = e.function.local_variables.iter();
            locals.find(|(_, local)| local.name.as_deref() == Some("value"))
        })
        .ok_or_else(|| Error::Compose("the expression has no value".to_owned()))?
        .1;
    let inner = &module.types[value.ty].inner;
    let (width, scalar) = match *inner {
        naga::TypeInner::Scalar(s) => (1, s),
        naga::TypeInner::Vector { size, scalar } => (size as usize, scalar),
        _ => {
            return Err(Error::Compose(
                "the expression must be a scalar or a vector of f32, i32, u32 or bool".to_owned(),
            ));
        }
    };
    let kind = match scalar.kind {
        naga::ScalarKind::Float => ResultKind::F32,
        naga::ScalarKind::Sint => ResultKind::I32,
        naga::ScalarKind::Uint => ResultKind::U32,
        naga::ScalarKind::Bool => ResultKind::Bool,
        _ => {
            return Err(Error::Compose(
                "the expression is abstract: give it a type, for instance f32(1)".to_owned(),
            ));
        }
    };
    Ok((width, kind))
}

impl Evaluator {
    /// Composes and compiles the expression.
    ///
    /// # Errors
    /// [`Error::Compose`] with every fault of the text and its place, [`Error::OutOfDomain`] for the number of columns.
    pub fn new(gpu: &Gpu, library: &Library, spec: &Spec<'_>) -> Result<Evaluator, Error> {
        if spec.columns == 0 || spec.columns > MAX_COLUMNS {
            return Err(Error::OutOfDomain {
                name: "columns".to_owned(),
                value: spec.columns.to_string(),
                domain: format!("1 to {MAX_COLUMNS}"),
            });
        }
        let mut linker = Linker::new(library);
        let defs = spec
            .features
            .iter()
            .map(|flag| ((*flag).to_owned(), Def::Flag))
            .collect();
        let mut link = |source: &Source<'_>| {
            linker
                .link(&LinkInput {
                    text: &source.text,
                    file: WHOLE,
                    defs: &defs,
                    plug_ins: &[],
                })
                .map_err(|found| {
                    let faults = found.0.into_iter().map(|diag| source.place(diag));
                    Error::Compose(Diags(faults.collect()).to_string())
                })
        };
        let probe = link(&source(spec, "eval_results[base] = 0u;", 1))?;
        let (width, kind) = result_type(&probe)?;
        let mut store = String::new();
        for j in 0..width {
            let component = match width {
                1 => "value".to_owned(),
                _ => format!("value[{j}]"),
            };
            let bits = match kind {
                ResultKind::U32 => component,
                ResultKind::Bool => format!("select(0u, 1u, {component})"),
                ResultKind::F32 | ResultKind::I32 => format!("bitcast<u32>({component})"),
            };
            let _ = writeln!(store, "    eval_results[base + {j}u] = {bits};");
        }
        let module = link(&source(spec, &store, width))?;
        let wgsl = veduta_compose::compose::finish(module, naga::valid::Capabilities::empty())
            .map_err(Error::Compose)?
            .wgsl;
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let shader = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("eval"),
                source: wgpu::ShaderSource::Wgsl(wgsl.as_str().into()),
            });
        let pipeline = gpu
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("eval"),
                layout: None,
                module: &shader,
                entry_point: Some("evaluate"),
                compilation_options: Default::default(),
                cache: None,
            });
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(Error::Device(error.to_string()));
        }
        Ok(Evaluator {
            gpu: gpu.clone(),
            pipeline,
            columns: spec.columns,
            width,
            kind,
            wgsl,
        })
    }

    /// The number of components of the result.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The type of the result's components.
    pub fn kind(&self) -> ResultKind {
        self.kind
    }

    /// The composed text that runs.
    pub fn wgsl(&self) -> &str {
        &self.wgsl
    }

    /// Evaluates every row; `rows` holds the columns of each row as 32-bit patterns, row after row, and the answer the
    /// components of each result in the same way.
    ///
    /// # Errors
    /// [`Error::Rows`] when the length is no multiple of the columns, [`Error::Device`] when the device fails.
    pub fn run_bits(&self, rows: &[u32]) -> Result<Vec<u32>, Error> {
        if !rows.len().is_multiple_of(self.columns) {
            return Err(Error::Rows(format!(
                "{} numbers do not make whole rows of {} columns",
                rows.len(),
                self.columns
            )));
        }
        let mut results = Vec::with_capacity(rows.len() / self.columns * self.width);
        for chunk in rows.chunks(CHUNK_ROWS * self.columns) {
            let count = chunk.len() / self.columns;
            let bytes: Vec<u8> = chunk.iter().flat_map(|w| w.to_le_bytes()).collect();
            let device = &self.gpu.device;
            let input = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("eval rows"),
                size: bytes.len() as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            self.gpu.queue.write_buffer(&input, 0, &bytes);
            let size = (count * self.width * 4) as u64;
            let output = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("eval results"),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("eval"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: input.as_entire_binding(),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: output.as_entire_binding(),
                    },
                ],
            });
            let mut encoder = device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, &bind_group, &[]);
                pass.dispatch_workgroups((count as u32).div_ceil(WORKGROUP), 1, 1);
            }
            self.gpu.queue.submit([encoder.finish()]);
            let data = self.gpu.read_buffer(&output, size)?;
            results.extend(
                data.chunks_exact(4)
                    .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            );
        }
        Ok(results)
    }

    /// [`Evaluator::run_bits`] with the results turned into numbers by their type.
    ///
    /// # Errors
    /// As [`Evaluator::run_bits`].
    pub fn run(&self, rows: &[u32]) -> Result<Vec<f64>, Error> {
        let kind = self.kind;
        Ok(self
            .run_bits(rows)?
            .into_iter()
            .map(|bits| match kind {
                ResultKind::F32 => f64::from(f32::from_bits(bits)),
                ResultKind::I32 => f64::from(bits.cast_signed()),
                ResultKind::U32 | ResultKind::Bool => f64::from(bits),
            })
            .collect())
    }
}
