//! `veduta render`: draws a scene into pictures and writes down what that cost.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use veduta::device::Gpu;
use veduta::{LandscapeOptions, Preset, Settings, Value};

use crate::camera::{Camera, EyeHeight};
use crate::catalog::{Catalog, SourceArgs, parse_sets};
use crate::error::CliError;
use crate::image::{check_folder, check_output, numbered, write_exr, write_png};
use crate::render::{Cost, Output, Renderer, Size, Tiling, operation_counts};

/// Arguments of `veduta render`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct RenderArgs {
    /// A shipped scene or a .ron file of your own
    #[arg(default_value = "thesis")]
    pub scene: String,
    /// A shipped preset or a .ron file of your own
    #[arg(long)]
    pub preset: Option<String>,
    /// A shipped view or a .ron file of your own; without it the keys CAM_HEIGHT, SUN_HEIGHT and SUN_AZIMUTH hold
    #[arg(long)]
    pub view: Option<String>,
    /// A value that goes before those of scene and preset; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Width and height in pixels
    #[arg(long, default_value = "800x450", value_name = "WxH")]
    pub size: Option<Size>,
    /// Seconds of flight, at CAM_SPEED in the direction of the view's yaw
    #[arg(
        long,
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_name = "S"
    )]
    pub time: f64,
    /// The eye in metres, Y being the altitude; replaces the view's place and height
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,Z", value_parser = parse_numbers::<3>)]
    pub camera: Option<[f64; 3]>,
    /// Direction in degrees, yaw clockwise from -z and pitch upwards; replaces the view's
    #[arg(long, allow_hyphen_values = true, value_name = "YAW,PITCH", value_parser = parse_numbers::<2>)]
    pub look: Option<[f64; 2]>,
    /// Vertical field of view in degrees; replaces the view's
    #[arg(long, allow_hyphen_values = true, value_name = "DEG")]
    pub fov: Option<f64>,
    /// The picture, tone-mapped and sRGB-encoded
    #[arg(long, value_name = "PICTURE.png")]
    pub out: Option<PathBuf>,
    /// The picture as linear radiance
    #[arg(long, value_name = "PICTURE.exr")]
    pub linear: Option<PathBuf>,
    /// What was drawn, on what, and what it cost
    #[arg(long, value_name = "STATS.json")]
    pub stats: Option<PathBuf>,
    /// Operations a pixel: mean and maximum of noise evaluations, cloud density and light samples, atmosphere samples
    #[arg(long, value_name = "COUNTS.json")]
    pub count: Option<PathBuf>,
    /// How many numbered frames to draw
    #[arg(long, value_name = "N")]
    pub frames: Option<u32>,
    /// Frames a second
    #[arg(
        long,
        default_value_t = 25.0,
        requires = "frames",
        allow_hyphen_values = true,
        value_name = "F"
    )]
    pub fps: f64,
    /// Where shaders, scenes, presets and views come from.
    #[command(flatten)]
    pub sources: SourceArgs,
}

/// Reads numbers divided by commas.
fn parse_numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| format!("`{text}` is not {N} numbers divided by commas"))
}

/// What is drawn: the resolved answer to the arguments.
#[derive(Debug, Clone)]
pub struct Job {
    /// The programs, with every variant that the job needs.
    pub catalog: Catalog,
    /// Preset, scene and own values.
    pub options: LandscapeOptions,
    /// The resolved values.
    pub settings: Settings,
    /// The camera at time 0.
    pub camera: Camera,
}

impl Job {
    /// Finds scene, preset and view, and composes the variant if it was not built.
    ///
    /// # Errors
    /// Whatever is unknown, out of its domain or cannot be composed.
    pub fn new(args: &RenderArgs) -> Result<Job, CliError> {
        let mut catalog = Catalog::load(&args.sources)?;
        let preset = match &args.preset {
            Some(name) => catalog.preset(name)?,
            None => Preset::default(),
        };
        let scene = catalog.scene(&args.scene)?;
        let values = parse_sets(catalog.set(), &args.sets)?;
        let settings = Settings::resolve(catalog.set(), &preset, Some(&scene), &values)?;
        let program = catalog.set().scene(&scene)?.program.to_string();
        catalog.ensure(&program, &settings)?;
        let mut camera = match &args.view {
            Some(name) => {
                let view = catalog.view(name)?;
                Camera {
                    x: view.place.0,
                    z: view.place.1,
                    height: EyeHeight::AboveGround(view.eye_height),
                    yaw: view.yaw_deg,
                    pitch: view.pitch_deg,
                    field_of_view: view.fov_deg,
                    sun_height: view.sun_height_deg,
                    sun_azimuth: view.sun_azimuth_deg,
                }
            }
            None => Camera::from_settings(&settings),
        };
        if let Some([x, y, z]) = args.camera {
            camera = Camera {
                x,
                z,
                height: EyeHeight::Altitude(y),
                ..camera
            };
        }
        if let Some([yaw, pitch]) = args.look {
            camera = Camera {
                yaw,
                pitch,
                ..camera
            };
        }
        if let Some(fov) = args.fov {
            camera.field_of_view = fov;
        }
        Ok(Job {
            catalog,
            options: LandscapeOptions {
                preset,
                scene,
                values,
            },
            settings,
            camera,
        })
    }
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments, files and devices.
pub fn run(args: &RenderArgs) -> Result<(), CliError> {
    if [&args.out, &args.linear, &args.stats, &args.count]
        .iter()
        .all(|path| path.is_none())
    {
        return Err(CliError::argument(
            "render",
            "without a result",
            "given at least one of --out, --linear, --stats, --count",
        ));
    }
    for (name, path, ending) in [
        ("--out", &args.out, "png"),
        ("--linear", &args.linear, "exr"),
        ("--stats", &args.stats, "json"),
        ("--count", &args.count, "json"),
    ] {
        if let Some(path) = path {
            check_output(name, path, ending)?;
            check_folder(path)?;
        }
    }
    let frames = args.frames.unwrap_or(1);
    if !(1..=MOST_FRAMES).contains(&frames) {
        return Err(CliError::argument(
            "--frames",
            frames.to_string(),
            format!("at least 1 and at most {MOST_FRAMES}"),
        ));
    }
    if !(args.fps > 0.0 && args.fps.is_finite()) {
        return Err(CliError::argument(
            "--fps",
            args.fps.to_string(),
            "finite and more than 0",
        ));
    }
    let size = args.size.unwrap_or(DEFAULT_SIZE);
    let job = Job::new(args)?;
    let gpu = veduta::device::shared()?;
    size.check(&gpu.device)?;
    // Every moment is checked before the first long draw.
    let time_of = |frame: u32| args.time + f64::from(frame) / args.fps;
    for frame in [0, frames - 1] {
        job.view(time_of(frame), size)?;
    }
    let bar = progress(&job, frames, args);
    let mut stats = None;
    for (output, path) in [
        (Output::Display, args.out.as_deref()),
        (Output::Linear, args.linear.as_deref()),
    ] {
        let for_stats_alone = output == Output::Display
            && args.stats.is_some()
            && args.out.is_none()
            && args.linear.is_none();
        if path.is_none() && !for_stats_alone {
            continue;
        }
        let mut renderer = Renderer::new(gpu, job.catalog.set(), &job.options, size, output)?;
        let first = renderer.warm_up(&job.view(args.time, size)?)?;
        let mut costs = Vec::new();
        for i in 0..frames {
            renderer.set_frame(i);
            let time = time_of(i);
            let view = job.view(time, size)?;
            let cost = renderer.draw(&view, Tiling::Adaptive, &mut |share| {
                bar.set_position((1000.0 * (f64::from(i) + share)) as u64);
            })?;
            if args.stats.is_some() {
                costs.push((time, cost));
            }
            if let Some(path) = path {
                let path = match args.frames {
                    Some(_) => numbered(path, i),
                    None => path.to_owned(),
                };
                save(&renderer, output, &path)?;
                bar.suspend(|| {
                    println!(
                        "{}: {size} in {:.2} s",
                        path.display(),
                        cost.wall.as_secs_f64()
                    );
                });
            }
        }
        if stats.is_none() && args.stats.is_some() {
            stats = Some(job.stats(gpu, &renderer, args, output, &first, &costs)?);
        }
    }
    if let (Some(path), Some(stats)) = (&args.stats, &stats) {
        write_json(path, stats)?;
    }
    if let Some(path) = &args.count {
        let counts = job.count(gpu, size, args.time)?;
        write_json(path, &counts)?;
    }
    bar.finish_and_clear();
    Ok(())
}

/// Four days of film at 25 frames a second; the costs of so many fit into the memory.
const MOST_FRAMES: u32 = 10_000_000;

/// The size of a picture when none is given.
const DEFAULT_SIZE: Size = Size {
    width: 800,
    height: 450,
};

/// A bar on stderr; hidden when that is no terminal.
fn progress(job: &Job, frames: u32, args: &RenderArgs) -> ProgressBar {
    let bar = ProgressBar::new(1000 * u64::from(frames));
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {elapsed}") {
        bar.set_style(style);
    }
    bar.set_message(format!(
        "{} {}",
        job.options.scene,
        args.view.as_deref().unwrap_or("")
    ));
    bar
}

fn save(renderer: &Renderer, output: Output, path: &Path) -> Result<(), CliError> {
    let Size { width, height } = renderer.size();
    match output {
        Output::Display => write_png(path, width, height, &renderer.read_rgb8()?),
        Output::Linear => {
            let rgb: Vec<f32> = renderer
                .read_rgba32()?
                .chunks_exact(4)
                .flat_map(|p| [p[0], p[1], p[2]])
                .collect();
            write_exr(path, width, height, &rgb)
        }
    }
}

/// Writes readable JSON with a line break at its end.
pub(crate) fn write_json(path: &Path, value: &serde_json::Value) -> Result<(), CliError> {
    std::fs::write(path, format!("{value:#}\n")).map_err(|e| CliError::write(path, e))
}

/// Reads a JSON file.
pub(crate) fn read_json(path: &Path) -> Result<serde_json::Value, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| CliError::read(path, e))?;
    serde_json::from_str(&text).map_err(|e| CliError::read(path, e.into()))
}

fn ms(duration: std::time::Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn cost_json(cost: &Cost) -> serde_json::Value {
    json!({
        "wall_ms": ms(cost.wall),
        "cpu_ms": cost.cpu_ms,
        "submissions": cost.submissions,
        "longest_submission_ms": ms(cost.longest),
        "bytes_uploaded": cost.bytes,
    })
}

impl Job {
    /// The view at `time`.
    ///
    /// # Errors
    /// As [`Camera::view`].
    pub fn view(&self, time: f64, size: Size) -> Result<veduta::View, CliError> {
        self.camera
            .view(self.catalog.set(), &self.settings, time, size.aspect())
    }

    fn names(&self) -> Result<(String, String), CliError> {
        let set = self.catalog.set();
        let program = set.scene(&self.options.scene)?.program.to_string();
        Ok((program, self.options.preset.name(set).to_owned()))
    }

    fn stats(
        &self,
        gpu: &Gpu,
        renderer: &Renderer,
        args: &RenderArgs,
        output: Output,
        first: &Cost,
        frames: &[(f64, Cost)],
    ) -> Result<serde_json::Value, CliError> {
        let (program, preset) = self.names()?;
        let features = self.settings.features();
        let variant = self.catalog.set().get(&program, &features)?;
        let wgsl: usize = variant.stages.iter().map(|s| s.wgsl.len()).sum();
        let info = gpu.adapter.get_info();
        let frames: Vec<serde_json::Value> = frames
            .iter()
            .map(|(time, cost)| {
                let mut frame = cost_json(cost);
                frame["time"] = json!(time);
                frame
            })
            .collect();
        Ok(json!({
            "program": program,
            "preset": preset,
            "scene": self.options.scene,
            "view": args.view,
            "features": features,
            "output": match output { Output::Display => "display", Output::Linear => "linear" },
            "size": [renderer.size().width, renderer.size().height],
            "adapter": info.name,
            "backend": info.backend.to_string(),
            "device_type": format!("{:?}", info.device_type),
            "driver": info.driver,
            "driver_info": info.driver_info,
            "wgsl_bytes": wgsl,
            "pipeline_ms": ms(renderer.pipeline_time()),
            "first_draw": cost_json(first),
            "frames": frames,
        }))
    }

    /// Mean and maximum a pixel of what the program counts.
    fn count(&self, gpu: &Gpu, size: Size, time: f64) -> Result<serde_json::Value, CliError> {
        let (program, preset) = self.names()?;
        let counts = self.operation_counts(gpu, size, time)?;
        let entry = |i: usize| json!({ "mean": counts[i].0, "max": counts[i].1 });
        Ok(json!({
            "program": program,
            "preset": preset,
            "scene": self.options.scene,
            "features": self.settings.features(),
            "size": [size.width, size.height],
            "time": time,
            "noise": entry(0),
            "density": entry(1),
            "light": entry(2),
            "air": entry(3),
        }))
    }

    /// Mean and maximum a pixel of noise evaluations, cloud density samples, cloud light samples and atmosphere samples,
    /// from the variant with COUNT_OPERATIONS, which is composed now if it was not built.
    ///
    /// # Errors
    /// Faults of composing and of the device.
    pub fn operation_counts(
        &self,
        gpu: &Gpu,
        size: Size,
        time: f64,
    ) -> Result<[(f64, f64); 4], CliError> {
        self.operation_counts_at(gpu, size, &self.view(time, size)?)
    }

    /// [`Job::operation_counts`] as any view sees it.
    ///
    /// # Errors
    /// Faults of composing and of the device.
    pub fn operation_counts_at(
        &self,
        gpu: &Gpu,
        size: Size,
        view: &veduta::View,
    ) -> Result<[(f64, f64); 4], CliError> {
        Ok(operation_counts(&self.measured(
            "COUNT_OPERATIONS",
            gpu,
            size,
            view,
        )?))
    }

    /// Distances in metres to the ground or the planet, row by row; -1 where a ray meets neither. From the variant with
    /// SHOW_DISTANCE, which is composed now if it was not built.
    ///
    /// # Errors
    /// Faults of composing and of the device.
    pub fn distances(&self, gpu: &Gpu, size: Size, time: f64) -> Result<Vec<f64>, CliError> {
        let rgba = self.measured("SHOW_DISTANCE", gpu, size, &self.view(time, size)?)?;
        Ok(rgba.iter().step_by(4).map(|d| f64::from(*d)).collect())
    }

    /// What the variant with a flag that replaces the picture by numbers draws.
    fn measured(
        &self,
        flag: &str,
        gpu: &Gpu,
        size: Size,
        view: &veduta::View,
    ) -> Result<Vec<f32>, CliError> {
        let mut job = self.clone();
        job.options
            .values
            .push((flag.to_owned(), Value::Flag(true)));
        job.settings
            .set(self.catalog.set(), flag, Value::Flag(true))?;
        let (program, _) = self.names()?;
        job.catalog.ensure(&program, &job.settings)?;
        let mut renderer =
            Renderer::new(gpu, job.catalog.set(), &job.options, size, Output::Linear)?;
        renderer.draw(view, Tiling::Adaptive, &mut |_| {})?;
        renderer.read_rgba32()
    }
}
