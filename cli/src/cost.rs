//! What each feature of a scene adds, and what is saved by each that it does not name.
//!
//! A feature is a flag that a scene names: the scene at hand or another one of the same program. A scene is composed whole,
//! without each feature that it names, and with each that it does not, all of them seen from one place.

use std::path::PathBuf;
use std::process::Command;

use serde_json::json;
use veduta::device::Gpu;
use veduta::glam::DVec3;
use veduta::landscape::Targets;
use veduta::program::{ComposedProgram, ScalarType};
use veduta::{Landscape, ProgramSet, Settings, Value, View, Work, wgpu};
use veduta_compose::gate::{Target, Written, write_target};
use veduta_compose::link::Linker;

use crate::bench::timing::{Clock, Middle, Ratio, Rounds, Subject, beside_bases};
use crate::bench::{Bench, table};
use crate::commands::compose::with_values;
use crate::commands::render::{Job, RenderArgs};
use crate::error::CliError;
use crate::render::{Output, Renderer, Size, guarded, median, picture};

/// How a variant differs from the scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    /// Not at all.
    Whole,
    /// Without a feature that the scene names.
    Without(String),
    /// With a feature that the scene does not name.
    With(String),
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Change::Whole => write!(f, "the scene"),
            Change::Without(feature) => write!(f, "without {feature}"),
            Change::With(feature) => write!(f, "with {feature}"),
        }
    }
}

/// A scene as it is, without one of its features, or with one more.
#[derive(Debug, Clone)]
pub struct Variant {
    /// What is changed.
    pub change: Change,
    /// What is drawn.
    pub job: Job,
    /// Where from: the same for all variants of a scene.
    pub view: View,
}

/// The features of a program: every flag that a scene of it names, in alphabetical order.
pub fn features_of(set: &ProgramSet, program: &str) -> Vec<String> {
    let mut names: Vec<String> = set
        .scenes
        .iter()
        .filter(|scene| scene.program == program)
        .flat_map(|scene| scene.features.iter().map(|f| f.to_string()))
        .collect();
    names.sort();
    names.dedup();
    names
}

/// The scene, then a variant for each feature of its program. The eye stands where the scene with every feature has it.
///
/// # Errors
/// As [`Job::new`], and faults of composing.
pub fn variants(args: &RenderArgs, size: Size) -> Result<Vec<Variant>, CliError> {
    let whole = Job::new(args)?;
    let set = whole.catalog.set();
    let program = set.scene(&whole.options.scene)?.program.to_string();
    let features = features_of(set, &program);
    let mut full: Settings = whole.settings.clone();
    for feature in &features {
        full.set(set, feature, Value::Flag(true))?;
    }
    let view = whole.camera.view(set, &full, args.time, size.aspect())?;
    let mut jobs = vec![(Change::Whole, whole.clone())];
    for feature in features {
        let named = whole.settings.get(&feature) == Some(Value::Flag(true));
        let mut job = whole.clone();
        let flag = Value::Flag(!named);
        job.settings.set(whole.catalog.set(), &feature, flag)?;
        job.options.values.retain(|(name, _)| *name != feature);
        job.options.values.push((feature.clone(), flag));
        job.catalog.ensure(&program, &job.settings)?;
        let change = if named {
            Change::Without(feature)
        } else {
            Change::With(feature)
        };
        jobs.push((change, job));
    }
    Ok(jobs
        .into_iter()
        .map(|(change, job)| Variant { change, job, view })
        .collect())
}

/// What is counted, without any clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Bytes of the WGSL of all stages.
    pub wgsl_bytes: u64,
    /// Instructions of the SPIR-V of all stages, with the preset's values as constants.
    pub spirv_instructions: u64,
    /// Bound resources.
    pub bindings: u64,
    /// Buffers.
    pub buffers: u64,
    /// Bytes of the buffers.
    pub buffer_bytes: u64,
    /// Textures; the target is not among them.
    pub textures: u64,
    /// Bytes of the textures.
    pub texture_bytes: u64,
    /// Compute dispatches of a frame with a moved eye, tables computed anew included.
    pub dispatches: u64,
    /// Draw calls of a frame.
    pub draws: u64,
    /// Buffers written for a frame with a moved eye.
    pub moved_writes: u64,
    /// Bytes uploaded for a frame with a moved eye.
    pub moved_bytes: u64,
    /// Everything that `prepare` does for a frame like the one before: tables, dispatches, draws, writes.
    pub still_work: u64,
}

impl Counts {
    /// Every count with its name in tables and in JSON.
    pub fn columns(&self) -> [(&'static str, &'static str, u64); 12] {
        [
            ("WGSL [B]", "wgsl_bytes", self.wgsl_bytes),
            (
                "SPIR-V instructions",
                "spirv_instructions",
                self.spirv_instructions,
            ),
            ("bindings", "bindings", self.bindings),
            ("buffers", "buffers", self.buffers),
            ("buffer [B]", "buffer_bytes", self.buffer_bytes),
            ("textures", "textures", self.textures),
            ("texture [B]", "texture_bytes", self.texture_bytes),
            ("dispatches", "dispatches", self.dispatches),
            ("draws", "draws", self.draws),
            ("moved: writes", "moved_writes", self.moved_writes),
            ("moved [B]", "moved_bytes", self.moved_bytes),
            ("still: work", "still_work", self.still_work),
        ]
    }
}

/// The number of instructions of a SPIR-V module: the first word of each holds its length.
///
/// # Errors
/// [`CliError::Argument`] for words that are no module.
pub fn spirv_instructions(words: &[u32]) -> Result<u64, CliError> {
    const HEADER: usize = 5;
    const MAGIC: u32 = 0x0723_0203;
    let fault = || CliError::argument("SPIR-V", "broken", "a whole module");
    if words.first() != Some(&MAGIC) || words.len() < HEADER {
        return Err(fault());
    }
    let (mut at, mut count) = (HEADER, 0);
    while let Some(word) = words.get(at) {
        let length = (word >> 16) as usize;
        if length == 0 || at + length > words.len() {
            return Err(fault());
        }
        at += length;
        count += 1;
    }
    Ok(count)
}

/// SPIR-V instructions of a program with resolved values.
fn instructions(program: &ComposedProgram, settings: &Settings) -> Result<u64, CliError> {
    let values = program
        .overrides
        .iter()
        .filter_map(|o| {
            let value = settings.number(&o.name)?;
            let text = match o.ty {
                ScalarType::Bool => (value != 0.0).to_string(),
                ScalarType::I32 => format!("i32({value})"),
                ScalarType::U32 => format!("{value}u"),
                ScalarType::F32 => format!("f32({value:?})"),
            };
            Some((o.name.as_ref(), text))
        })
        .collect();
    let capabilities = Linker::new(&Default::default()).capabilities();
    let mut count = 0;
    for stage in program.stages.iter() {
        let text = with_values(&stage.wgsl, &values);
        match write_target(&text, Target::Spirv, capabilities).map_err(veduta::Error::Compose)? {
            Written::Words(words) => count += spirv_instructions(&words)?,
            Written::Text(_) => return Err(CliError::argument("SPIR-V", "text", "words")),
        }
    }
    Ok(count)
}

impl Variant {
    fn program(&self) -> Result<&ComposedProgram, CliError> {
        let set = self.job.catalog.set();
        let program = set.scene(&self.job.options.scene)?.program.to_string();
        Ok(set.get(&program, &self.job.settings.features())?)
    }

    /// What is counted.
    ///
    /// # Errors
    /// Faults of the writer and of the device.
    pub fn counts(&self, gpu: &Gpu) -> Result<Counts, CliError> {
        let program = self.program()?;
        let mut landscape = guarded(gpu, || {
            Ok(Landscape::new(
                &gpu.device,
                self.job.catalog.set(),
                &Targets::default(),
                &self.job.options,
            )?)
        })?;
        let kept = landscape.resources();
        let mut moved = self.view;
        moved.eye = moved.eye.moved_by(DVec3::ONE);
        let _ = frame(gpu, &mut landscape, &self.view)?;
        let (moving, drawn) = frame(gpu, &mut landscape, &moved)?;
        let (still, _) = frame(gpu, &mut landscape, &moved)?;
        let reflected = program.bindings.len();
        if kept.bindings as usize != reflected {
            return Err(CliError::argument(
                "bindings",
                kept.bindings.to_string(),
                format!("{reflected}, as the program declares"),
            ));
        }
        Ok(Counts {
            wgsl_bytes: program.stages.iter().map(|s| s.wgsl.len() as u64).sum(),
            spirv_instructions: instructions(program, &self.job.settings)?,
            bindings: u64::from(kept.bindings),
            buffers: u64::from(kept.buffers),
            buffer_bytes: kept.buffer_bytes,
            textures: u64::from(kept.textures),
            texture_bytes: kept.texture_bytes,
            dispatches: u64::from(moving.dispatches + drawn.dispatches),
            draws: u64::from(moving.draws + drawn.draws),
            moved_writes: u64::from(moving.writes),
            moved_bytes: moving.bytes,
            still_work: u64::from(still.bakes + still.dispatches + still.draws + still.writes),
        })
    }
}

/// Records a frame of 8x8 pixels; what `prepare` and `composite` did.
fn frame(gpu: &Gpu, landscape: &mut Landscape, view: &View) -> Result<(Work, Work), CliError> {
    guarded(gpu, || {
        let size = Size {
            width: 8,
            height: 8,
        };
        let texture = picture(&gpu.device, size, Targets::default().color_format);
        let target = texture.create_view(&Default::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let prepared = landscape.prepare(&gpu.device, &gpu.queue, &mut encoder, view)?;
        let drawn =
            landscape.composite(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("frame"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations::default(),
                })],
                ..Default::default()
            }));
        gpu.queue.submit([encoder.finish()]);
        Ok((prepared, drawn))
    })
}

/// Milliseconds of creating a pipeline and of the first draw, one pixel.
pub type Fresh = [f64; 2];

/// Measures pipeline creation and first draw of each variant, each on a device of its own, backwards in odd rounds, after
/// a first variant that does not count. A driver may still take compiled shaders from a cache on the disk: see
/// [`Child::round`].
///
/// # Errors
/// Faults of the device; [`CliError::Argument`] for a clock that does not run here.
pub fn fresh(variants: &[Variant], clock: Clock, round: usize) -> Result<Vec<Fresh>, CliError> {
    let measure = |variant: &Variant| -> Result<Fresh, CliError> {
        let gpu = pollster::block_on(Gpu::open())?;
        let mut renderer = Renderer::new(
            &gpu,
            variant.job.catalog.set(),
            &variant.job.options,
            Size {
                width: 8,
                height: 8,
            },
            Output::Display,
        )?;
        let first = renderer.warm_up(&variant.view)?;
        // No timestamp of the device covers what its driver compiles.
        if clock == Clock::Cpu {
            let all = (renderer.pipeline_cpu_ms(), first.cpu_ms);
            let (Some(pipeline), Some(first)) = all else {
                return Err(CliError::argument(
                    "--clock",
                    "cpu",
                    "one that runs on this system",
                ));
            };
            Ok([pipeline, first])
        } else {
            let ms = [renderer.pipeline_time(), first.wall];
            Ok(ms.map(|t| t.as_secs_f64() * 1e3))
        }
    };
    if let Some(first) = variants.first() {
        measure(first)?;
    }
    let mut times = vec![[0.0; 2]; variants.len()];
    for turn in 0..variants.len() {
        let k = if round.is_multiple_of(2) {
            turn
        } else {
            variants.len() - 1 - turn
        };
        times[k] = measure(&variants[k])?;
    }
    Ok(times)
}

/// How to measure [`fresh`] in a process whose driver keeps no shaders.
#[derive(Debug, Clone)]
pub struct Child {
    /// The program `veduta`.
    pub program: PathBuf,
    /// Its arguments, without the round's number, which is added as the last.
    pub arguments: Vec<String>,
}

/// Turns the disk caches of drivers off that can be turned off: those of Mesa and of NVIDIA.
pub const NO_CACHE: [(&str, &str); 2] = [
    ("MESA_SHADER_CACHE_DISABLE", "true"),
    ("__GL_SHADER_DISK_CACHE", "0"),
];

impl Child {
    /// One round of [`fresh`] in a process of its own, with [`NO_CACHE`] set before the driver is loaded.
    ///
    /// # Errors
    /// [`CliError::Child`] when the process fails or says something else than times.
    pub fn round(&self, round: usize) -> Result<Vec<Fresh>, CliError> {
        let fault = |what: String| CliError::Child { what };
        let output = Command::new(&self.program)
            .args(&self.arguments)
            .arg(round.to_string())
            .envs(NO_CACHE)
            .output()
            .map_err(|e| fault(e.to_string()))?;
        if !output.status.success() {
            return Err(fault(
                String::from_utf8_lossy(&output.stderr).trim().to_owned(),
            ));
        }
        let answer: serde_json::Value =
            serde_json::from_slice(&output.stdout).map_err(|e| fault(e.to_string()))?;
        let times = answer.as_array().and_then(|rows| {
            rows.iter()
                .map(|row| Some([row.get(0)?.as_f64()?, row.get(1)?.as_f64()?]))
                .collect::<Option<Vec<Fresh>>>()
        });
        times.ok_or_else(|| fault("no times".to_owned()))
    }
}

/// Milliseconds of one variant, a number a round.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Times {
    /// Creating the pipeline.
    pub pipeline: Vec<f64>,
    /// Drawing one pixel for the first time.
    pub first_draw: Vec<f64>,
    /// A frame.
    pub frame: Vec<f64>,
    /// Frames over those of the whole scene drawn beside them.
    pub to_scene: Option<Ratio>,
}

/// One variant of a scene and what it costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What is changed.
    pub change: Change,
    /// The flags that are on.
    pub features: Vec<String>,
    /// What is counted.
    pub counts: Counts,
    /// Mean a pixel of noise evaluations, cloud density samples, cloud light samples, atmosphere samples.
    pub operations: [f64; 4],
    /// Times, if they were measured.
    pub times: Option<Times>,
}

/// A scene and what it costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The scene.
    pub scene: String,
    /// The preset.
    pub preset: String,
    /// The view; none: the keys hold.
    pub view: Option<String>,
    /// The scene first, then its variants.
    pub entries: Vec<Entry>,
}

/// How times are measured.
#[derive(Debug, Clone)]
pub struct Timing {
    /// Rounds.
    pub rounds: Rounds,
    /// For pipeline creation and first draw.
    pub child: Child,
}

/// Counts and, if wanted, measures a scene; `progress` hears what is next.
///
/// # Errors
/// As [`variants`], faults of the device and of the child.
pub fn run(
    bench: &Bench,
    args: &RenderArgs,
    timing: Option<&Timing>,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, CliError> {
    let variants = variants(args, bench.size)?;
    let mut entries = Vec::new();
    for variant in &variants {
        progress(&format!("{}: {}", args.scene, variant.change));
        let operations = variant
            .job
            .operation_counts_at(&bench.gpu, bench.size, &variant.view)?;
        entries.push(Entry {
            change: variant.change.clone(),
            features: variant
                .job
                .settings
                .features()
                .into_iter()
                .map(str::to_owned)
                .collect(),
            counts: variant.counts(&bench.gpu)?,
            operations: operations.map(|o| o.0),
            times: None,
        });
    }
    if let Some(timing) = timing {
        let times = times(bench, &variants, timing, progress)?;
        for (entry, times) in entries.iter_mut().zip(times) {
            entry.times = Some(times);
        }
    }
    let (scene, preset) = variants.first().map_or_else(Default::default, |v| {
        let preset = v.job.options.preset.name(v.job.catalog.set());
        (v.job.options.scene.clone(), preset.to_owned())
    });
    Ok(Report {
        scene,
        preset,
        view: args.view.clone(),
        entries,
    })
}

fn times(
    bench: &Bench,
    variants: &[Variant],
    timing: &Timing,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Times>, CliError> {
    let mut times = vec![Times::default(); variants.len()];
    for round in 0..timing.rounds.most.max(timing.rounds.least).max(1) {
        progress(&format!("first draws, round {}", round + 1));
        let measured = timing.child.round(round)?;
        if measured.len() != variants.len() {
            return Err(CliError::Child {
                what: format!("{} times for {} variants", measured.len(), variants.len()),
            });
        }
        for (times, [pipeline, first]) in times.iter_mut().zip(measured) {
            times.pipeline.push(pipeline);
            times.first_draw.push(first);
        }
        let settled = |of: fn(&Times) -> &[f64]| {
            (times.iter()).all(|t| Ratio::of(of(t), of(&times[0])).conclusive())
        };
        if round + 1 >= timing.rounds.least
            && settled(|t| &t.pipeline)
            && settled(|t| &t.first_draw)
        {
            break;
        }
    }
    progress("frames");
    let mut subjects = variants
        .iter()
        .map(|variant| {
            Ok(Subject {
                renderer: Renderer::new(
                    &bench.gpu,
                    variant.job.catalog.set(),
                    &variant.job.options,
                    bench.size,
                    Output::Display,
                )?,
                view: variant.view,
            })
        })
        .collect::<Result<Vec<_>, CliError>>()?;
    let turns = beside_bases(&mut subjects, &[0], bench.clock, timing.rounds, &mut || {})?;
    for (k, times) in times.iter_mut().enumerate() {
        times.to_scene = Some(turns.ratio(k, 0));
    }
    for (times, frames) in times.iter_mut().zip(turns.times) {
        times.frame = frames;
    }
    Ok(times)
}

/// How many milliseconds one variant takes more than another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Added {
    /// The median of the rounds' differences.
    pub median: f64,
    /// One standard error of that median, from the scatter of the rounds, as in [`Ratio`]; infinite for fewer than three.
    pub error: f64,
}

impl Added {
    /// Round by round `more` minus `less`.
    pub fn of(more: &[f64], less: &[f64]) -> Added {
        let differences: Vec<f64> = more.iter().zip(less).map(|(a, b)| a - b).collect();
        let Some(middle) = median(differences.clone()) else {
            return Added {
                median: f64::NAN,
                error: f64::INFINITY,
            };
        };
        let deviations: Vec<f64> = differences.iter().map(|d| (d - middle).abs()).collect();
        let deviation = 1.4826 * median(deviations).unwrap_or(0.0);
        Added {
            median: middle,
            error: if differences.len() < 3 {
                f64::INFINITY
            } else {
                1.2533 * deviation / (differences.len() as f64).sqrt()
            },
        }
    }

    /// Whether it differs from nothing by three standard errors.
    pub fn conclusive(self) -> bool {
        self.median.abs() >= 3.0 * self.error
    }
}

impl std::fmt::Display for Added {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.conclusive() {
            write!(f, "{:+.1} ± {:.1}", self.median, self.error)
        } else {
            write!(f, "({:+.1} ± {:.1}?)", self.median, self.error)
        }
    }
}

impl Report {
    /// Each variant with what its feature adds: the index of the one with the feature and of the one without.
    fn pairs(&self) -> impl Iterator<Item = (&Entry, Option<(&Entry, &Entry, String)>)> {
        let whole = self.entries.first();
        self.entries.iter().map(move |entry| {
            let pair = match (&entry.change, whole) {
                (Change::Without(feature), Some(whole)) => {
                    Some((whole, entry, format!("{feature} adds")))
                }
                (Change::With(feature), Some(whole)) => {
                    Some((entry, whole, format!("{feature} would add")))
                }
                _ => None,
            };
            (entry, pair)
        })
    }

    fn rows(
        &self,
        head: Vec<String>,
        alone: &dyn Fn(&Entry) -> Vec<String>,
        added: &dyn Fn(&Entry, &Entry) -> Vec<String>,
    ) -> String {
        let mut rows = vec![[vec![String::new()], head].concat()];
        for (entry, pair) in self.pairs() {
            rows.push([vec![entry.change.to_string()], alone(entry)].concat());
            if let Some((more, less, name)) = pair {
                rows.push([vec![name], added(more, less)].concat());
            }
        }
        table(&rows)
    }

    /// The tables of this scene.
    pub fn markdown(&self) -> String {
        let mut text = format!("\n## `{}`, preset `{}`", self.scene, self.preset);
        if let Some(view) = &self.view {
            text += &format!(", view `{view}`");
        }
        text += "\n\n";
        text += &self.rows(
            Counts::default()
                .columns()
                .map(|(name, ..)| name.to_owned())
                .to_vec(),
            &|e| e.counts.columns().map(|c| c.2.to_string()).to_vec(),
            &|more, less| {
                let pairs = more.counts.columns().into_iter().zip(less.counts.columns());
                pairs
                    .map(|(a, b)| signed(a.2 as f64 - b.2 as f64, 0))
                    .collect()
            },
        );
        text += "\nOperations a pixel, mean:\n\n";
        text += &self.rows(
            OPERATIONS.map(|(name, _)| name.to_owned()).to_vec(),
            &|e| e.operations.map(|o| format!("{o:.1}")).to_vec(),
            &|more, less| {
                let pairs = more.operations.iter().zip(less.operations);
                pairs.map(|(a, b)| signed(a - b, 1)).collect()
            },
        );
        if self.entries.iter().all(|e| e.times.is_some()) {
            text += "\nMilliseconds:\n\n";
            text += &self.rows(
                ["pipeline", "first draw", "frame", "frame / the scene's"]
                    .map(str::to_owned)
                    .to_vec(),
                &|e| {
                    let times = e.times.clone().unwrap_or_default();
                    let mut row: Vec<String> = KINDS
                        .iter()
                        .map(|(_, of)| format!("{:.1}", Middle::of(of(&times)).median))
                        .collect();
                    row.push(times.to_scene.map_or_else(String::new, |r| r.to_string()));
                    row
                },
                &|more, less| {
                    let [more, less] = [more, less].map(|e| e.times.clone().unwrap_or_default());
                    let mut row: Vec<String> = KINDS
                        .iter()
                        .map(|(_, of)| Added::of(of(&more), of(&less)).to_string())
                        .collect();
                    row.push(String::new());
                    row
                },
            );
        }
        text
    }

    /// The same as JSON.
    pub fn to_json(&self) -> serde_json::Value {
        let entries: Vec<serde_json::Value> = self
            .pairs()
            .map(|(entry, pair)| {
                let numbers = |value: &dyn Fn(usize) -> f64, names: &[&str]| {
                    let map = names.iter().enumerate();
                    map.map(|(i, name)| ((*name).to_owned(), json!(value(i))))
                        .collect::<serde_json::Map<_, _>>()
                };
                let names = entry.counts.columns().map(|c| c.1);
                let operations = OPERATIONS.map(|o| o.0);
                let (change, feature) = match &entry.change {
                    Change::Whole => ("whole", None),
                    Change::Without(feature) => ("without", Some(feature)),
                    Change::With(feature) => ("with", Some(feature)),
                };
                let counts: serde_json::Map<_, _> = (entry.counts.columns().iter())
                    .map(|c| (c.1.to_owned(), json!(c.2)))
                    .collect();
                let times = entry.times.as_ref().map(|times| {
                    let all = KINDS.iter().map(|(name, of)| {
                        let middle = Middle::of(of(times));
                        let value = json!({
                            "median": middle.median,
                            "quartiles": [middle.quartiles.0, middle.quartiles.1],
                            "rounds": of(times).len(),
                        });
                        ((*name).to_owned(), value)
                    });
                    all.collect::<serde_json::Map<_, _>>()
                });
                let adds = pair.map(|(more, less, _)| {
                    let of = |e: &Entry, i: usize| e.counts.columns()[i].2 as f64;
                    let times = more.times.as_ref().zip(less.times.as_ref());
                    json!({
                        "counts": numbers(&|i| of(more, i) - of(less, i), &names),
                        "operations": numbers(&|i| more.operations[i] - less.operations[i], &operations),
                        "times_ms": times.map(|(more, less)| {
                            let all = KINDS.iter().map(|(name, of)| {
                                let added = Added::of(of(more), of(less));
                                let value = json!({
                                    "median": added.median,
                                    "standard_error": added.error,
                                    "conclusive": added.conclusive(),
                                });
                                ((*name).to_owned(), value)
                            });
                            all.collect::<serde_json::Map<_, _>>()
                        }),
                    })
                });
                json!({
                    "change": change,
                    "feature": feature,
                    "features": entry.features,
                    "counts": counts,
                    "operations": numbers(&|i| entry.operations[i], &operations),
                    "times_ms": times,
                    "adds": adds,
                })
            })
            .collect();
        json!({
            "scene": self.scene,
            "preset": self.preset,
            "view": self.view,
            "entries": entries,
        })
    }
}

/// Operations by the channels of COUNT_OPERATIONS.
const OPERATIONS: [(&str, usize); 4] = [("noise", 0), ("density", 1), ("light", 2), ("air", 3)];

type Kind = (&'static str, fn(&Times) -> &[f64]);

const KINDS: [Kind; 3] = [
    ("pipeline", |t| &t.pipeline),
    ("first_draw", |t| &t.first_draw),
    ("frame", |t| &t.frame),
];

/// With its sign; nothing is a plain 0.
fn signed(value: f64, digits: usize) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:+.digits$}")
    }
}

/// A document with the tables of several scenes.
pub fn markdown(bench: &Bench, reports: &[Report], timed: bool, command: &str) -> String {
    let mut text = format!("# What the features of a scene cost\n\nWritten by `{command}`.\n\n");
    text += &bench.machine();
    text += "
A feature is a flag that a scene names. A scene is composed whole, without each feature that it names (\"adds\": the
whole minus that), and with each that it does not name (\"would add\": what it saves). Features act together, so that what
they add does not sum up to the whole: the clouds are seen through air, for instance, if there is any. The eye stands
where the scene with every feature has it.

- WGSL and SPIR-V are of all stages; SPIR-V as naga writes it, with the preset's values as constants.
- Buffers and textures are those that `Landscape` keeps; the target belongs to the host.
- A moved frame is one whose eye has moved by a metre along each axis; dispatches and draws are of such a frame. A still
  frame is like the one before; its work is everything that `prepare` does.
";
    if timed {
        text += "- Pipeline creation and first draw (one pixel) are each on a device of its own in a process that has set
  `MESA_SHADER_CACHE_DISABLE=true` and `__GL_SHADER_DISK_CACHE=0`, so that the driver compiles; other drivers may keep
  shaders where this does not reach. Where frames are measured by the device's timestamps, these are wall time.
- Times are medians of rounds in turns, differences medians of the rounds' differences with one standard error. In
  parentheses with a question mark stands a difference below three standard errors and a ratio that scattered too much.
";
    }
    for report in reports {
        text += &report.markdown();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_walked_by_their_lengths() {
        let header = [0x0723_0203, 0x0001_0300, 0, 9, 0];
        let with = |body: &[u32]| spirv_instructions(&[&header, body].concat());
        assert_eq!(with(&[]).unwrap(), 0);
        // OpCapability of two words, OpNop of one, OpMemoryModel of three.
        let body = [2 << 16 | 17, 1, 1 << 16, 3 << 16 | 14, 0, 1];
        assert_eq!(with(&body).unwrap(), 3);
        assert!(with(&body[..5]).is_err(), "cut off");
        assert!(with(&[0]).is_err(), "of no length");
        assert!(spirv_instructions(&[1, 2, 3]).is_err());
        assert!(spirv_instructions(&[]).is_err());
    }

    #[test]
    fn differences_cancel_a_drift_and_say_when_they_say_nothing() {
        let less = [10.0, 20.0, 15.0, 30.0, 12.0];
        let more = less.map(|t| t + 2.5);
        let added = Added::of(&more, &less);
        assert_eq!((added.median, added.conclusive()), (2.5, true));
        assert_eq!(added.to_string(), "+2.5 ± 0.0");
        let none = Added::of(&[9.0, 11.0, 10.0, 8.0, 12.0], &[10.0; 5]);
        assert!(!none.conclusive() && none.to_string().starts_with("(+0.0 ±"));
        assert!(
            !Added::of(&[3.0, 3.0], &[1.0, 1.0]).conclusive(),
            "two rounds"
        );
        assert!(Added::of(&[], &[]).median.is_nan());
        assert_eq!(
            [signed(0.0, 1), signed(-2.0, 0), signed(1.25, 1)],
            ["0", "-2", "+1.2"]
        );
    }
}
