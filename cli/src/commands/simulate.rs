//! `veduta simulate`: a living ground over time.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use veduta::WorldPos;
use veduta::ground::{
    CHANNELS, Ground, GroundCamera, GroundPicture, GroundPictureOptions, GroundReport, GroundScene,
    GroundState, Triangulation,
};
use veduta::terrain::{HeightMap, TerrainLights};

use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::image::{check_folder, check_output, numbered, write_png};
use crate::metrics::Picture;
use crate::render::Size;
use crate::table::{read_cube, write_cube};
use crate::under_sky::UnderSky;

use super::probe::atmosphere;
use super::sky::exposure_of;

/// Arguments of `veduta simulate`.
#[derive(Debug, Clone, clap::Args)]
pub struct SimulateArgs {
    /// A shipped ground (rain, dam_break, flood, erosion) or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "rain")]
    pub scene: String,
    /// A key of the scene, repeatable; RAIN, EVAPORATION and SEEPAGE are in mm/h
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Steps
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub steps: u64,
    /// The state to begin with, .npy: float32, rows, columns, 8 to 14 channels; the scene's own when left out. With it keys of --set that shape a new ground (SIZE, SEED, SHAPE, ...) do nothing
    #[arg(long = "in", value_name = "STATE.npy", conflicts_with = "heights")]
    pub input: Option<PathBuf>,
    /// Heights, a cell a texel, in the place of the scene's: .png (grey, 8 or 16 bits), .exr or .npy
    #[arg(long, value_name = "FILE")]
    pub heights: Option<PathBuf>,
    /// Height of a value of 0 in --heights in metres
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub lowest: f64,
    /// Height of a value of 1 in --heights in metres: the greatest of a .png; 1 for files that hold metres
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub highest: f64,
    /// Where the last state goes, .npy with 14 channels
    #[arg(long, value_name = "STATE.npy")]
    pub out: Option<PathBuf>,
    /// Steps between pictures, the first before the first step; 0: none
    #[arg(long, value_name = "EVERY", default_value_t = 0)]
    pub frames: u64,
    /// Pictures' path; beside --out or in this folder when left out
    #[arg(long, value_name = "PICTURE.png")]
    pub pictures: Option<PathBuf>,
    /// Draw the ground from above, a pixel a cell, instead of under the sky
    #[arg(long)]
    pub map: bool,
    /// Width and height of the pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "512x288")]
    pub size: Size,
    /// Place of the eye in metres from the first cell, y up; the scene's camera when left out
    #[arg(long, value_name = "X,Y,Z", value_parser = three, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// Place that the eye looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = three, allow_hyphen_values = true)]
    pub target: Option<[f64; 3]>,
    /// Vertical field of view in degrees, 0.01 to 170
    #[arg(long)]
    pub fov: Option<f64>,
    /// Height of the sun above the horizon in degrees
    #[arg(long, allow_negative_numbers = true)]
    pub sun_height: Option<f64>,
    /// Azimuth of the sun in degrees, clockwise from -z
    #[arg(long, allow_negative_numbers = true)]
    pub sun_azimuth: Option<f64>,
    /// A shipped atmosphere or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// Factor on radiance before the tone map; found from the first picture when left out
    #[arg(long)]
    pub exposure: Option<f64>,
    /// How squares become triangles
    #[arg(long, value_enum, default_value = "random")]
    pub triangles: Triangles,
    /// Where sums, times and extremes go
    #[arg(long, value_name = "STATS.json")]
    pub stats: Option<PathBuf>,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// How squares of the ground become triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Triangles {
    /// Two, along the same diagonal everywhere
    Fixed,
    /// Four around a middle
    FourWay,
    /// Two, along a diagonal by chance
    Random,
}

/// Three numbers between commas.
fn three(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|e| e.to_string()))
        .collect::<Result<_, _>>()?;
    numbers
        .try_into()
        .map_err(|v: Vec<f64>| format!("{} numbers, but three must be", v.len()))
}

/// The ground under its sky, from one place.
struct Painter {
    under: UnderSky,
    picture: GroundPicture,
    view: veduta::View,
    lights: TerrainLights,
    exposure: Option<f64>,
}

impl Painter {
    fn new(args: &SimulateArgs, scene: &GroundScene, ground: &Ground) -> Result<Painter, CliError> {
        let spacing = f64::from(scene.options.spacing);
        let mut camera = scene
            .camera
            .unwrap_or_else(|| GroundCamera::over(ground.size(), spacing, ground.range()));
        camera.eye = args.eye.unwrap_or(camera.eye);
        camera.target = args.target.unwrap_or(camera.target);
        camera.field_of_view = args.fov.unwrap_or(camera.field_of_view);
        camera.sun_height = args.sun_height.unwrap_or(camera.sun_height);
        camera.sun_azimuth = args.sun_azimuth.unwrap_or(camera.sun_azimuth);
        if let Some(exposure) = args.exposure
            && !(0.0..=1e12).contains(&exposure)
        {
            return Err(CliError::argument(
                "--exposure",
                exposure.to_string(),
                "in [0, 1e12]",
            ));
        }
        let air = atmosphere(&args.atmosphere)?;
        let aspect = f64::from(args.size.width) / f64::from(args.size.height);
        let mut view = camera.view(WorldPos::default(), aspect)?;
        view.sun.angular_radius = air.sun.angular_radius as f32;
        let mut under = UnderSky::new(air, args.size)?;
        let lights = under.lights(&view, f64::from(ground.range()[0]))?;
        let options = GroundPictureOptions {
            triangulation: match args.triangles {
                Triangles::Fixed => Triangulation::Fixed,
                Triangles::FourWay => Triangulation::FourWay,
                Triangles::Random => Triangulation::Random,
            },
            look: scene.look,
            ..Default::default()
        };
        let gpu = veduta::device::shared()?;
        let programs = veduta::programs();
        let targets = UnderSky::targets();
        let picture = GroundPicture::new(&gpu.device, programs, &targets, ground, &options)?;
        Ok(Painter {
            under,
            picture,
            view,
            lights,
            exposure: args.exposure,
        })
    }

    fn paint(&mut self, ground: &Ground, path: &Path) -> Result<(), CliError> {
        let queue = &veduta::device::shared()?.queue;
        let Painter {
            under,
            picture,
            view,
            lights,
            exposure,
        } = self;
        let cell = std::cell::RefCell::new(picture);
        let rgb = under.paint(
            view,
            |encoder| {
                let _ = cell
                    .borrow_mut()
                    .prepare(queue, encoder, ground, view, lights)?;
                Ok(())
            },
            |pass| {
                let _ = cell.borrow().draw_opaque(pass);
            },
        )?;
        let exposure = *exposure.get_or_insert_with(|| exposure_of(&rgb));
        let Size { width, height } = under.size();
        let shown = Picture::new(width as usize, height as usize, rgb)?.display(exposure);
        write_png(path, width, height, &shown)
    }
}

/// A ground as its file says, or one that ships.
fn scene(name: &str) -> Result<GroundScene, CliError> {
    let path = Path::new(name);
    if path.extension().is_none_or(|e| e != "ron") {
        return Ok(GroundScene::named(name)?);
    }
    GroundScene::read(path).map_err(|e| CliError::Table {
        path: path.to_owned(),
        what: e.to_string(),
    })
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments out of their domains, files that cannot be read or written; what the library reports.
pub fn run(args: &SimulateArgs) -> Result<(), CliError> {
    if let Some(out) = &args.out {
        check_output("--out", out, "npy")?;
    }
    if let Some(stats) = &args.stats {
        check_output("--stats", stats, "json")?;
    }
    let pictures = args.pictures.clone().unwrap_or_else(|| match &args.out {
        Some(out) => out.with_extension("png"),
        None => PathBuf::from("ground.png"),
    });
    if args.frames > 0 {
        check_output("--pictures", &pictures, "png")?;
        check_folder(&pictures)?;
    }
    let mut scene = scene(&args.scene)?;
    if let Some(file) = &args.heights {
        let mut map = HeightMap {
            file: file.display().to_string(),
            lowest: args.lowest,
            highest: args.highest,
            ..Default::default()
        };
        map.read(Path::new(""))?;
        scene.take_heights(map)?;
    }
    for pair in &args.set {
        let Some((key, value)) = pair.split_once('=') else {
            return Err(CliError::argument("--set", pair, "KEY=VALUE"));
        };
        scene.set(key.trim(), value)?;
    }
    scene.check()?;
    let gpu = veduta::device::shared()?;
    let begin = match &args.input {
        None => scene.begin(gpu, veduta::programs())?,
        Some(path) => {
            let (shape, data) = read_cube(path)?;
            let (shape, data) = channels_last(shape, data);
            GroundState::from_channels(shape[1], shape[0], shape[2], &data).map_err(|e| {
                CliError::Table {
                    path: path.clone(),
                    what: e.to_string(),
                }
            })?
        }
    };
    let mut ground = Ground::new(
        &gpu.device,
        &gpu.queue,
        veduta::programs(),
        &scene.options,
        &begin,
    )?;
    let bar = if args.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(args.steps)
    };
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let mut painter = if args.frames > 0 && !args.map {
        Some(Painter::new(args, &scene, &ground)?)
    } else {
        None
    };
    let mut picture = |ground: &Ground, step: u64| -> Result<(), CliError> {
        let number = u32::try_from(step / args.frames.max(1)).unwrap_or(u32::MAX);
        let path = numbered(&pictures, number);
        if let Some(painter) = &mut painter {
            return painter.paint(ground, &path);
        }
        let state = ground.state(gpu)?;
        let rgb = relief(&state, scene.options.spacing);
        write_png(&path, state.columns as u32, state.rows as u32, &rgb)
    };
    if args.frames > 0 {
        picture(&ground, 0)?;
    }
    let (started, mut cpu) = (Instant::now(), 0.0);
    let mut chunk = 4_u64;
    let mut done = 0;
    while done < args.steps {
        let mut now = chunk.min(args.steps - done);
        if let Some(phase) = done.checked_rem(args.frames) {
            now = now.min(args.frames - phase);
        }
        let (before, clock) = (CpuTime::now(), Instant::now());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = ground.step(&mut encoder, u32::try_from(now).unwrap_or(1));
        gpu.queue.submit([encoder.finish()]);
        gpu.device
            .poll(veduta::wgpu::PollType::wait_indefinitely())
            .map_err(|e| veduta::Error::Device(e.to_string()))?;
        if let (Some(before), Some(after)) = (before, CpuTime::now()) {
            cpu += after.since(&before);
        }
        // About a fifth of a second a submission.
        let took = clock.elapsed();
        if took < Duration::from_millis(100) {
            chunk = (chunk * 2).min(4096);
        } else if took > Duration::from_millis(400) {
            chunk = (chunk / 2).max(1);
        }
        done += now;
        bar.set_position(done);
        if args.frames > 0 && done.is_multiple_of(args.frames) {
            picture(&ground, done)?;
        }
    }
    bar.finish_and_clear();
    let end = ground.state(gpu)?;
    let report = ground.report(gpu)?;
    let stats = statistics(
        &begin,
        &end,
        &report,
        ground.bytes(),
        cpu,
        started.elapsed(),
    );
    if let Some(path) = &args.out {
        write_cube(path, [end.rows, end.columns, CHANNELS], &end.cells)?;
    }
    let text =
        serde_json::to_string_pretty(&stats).map_err(|e| CliError::write(Path::new("stats"), e))?;
    match &args.stats {
        Some(path) => std::fs::write(path, text + "\n").map_err(|e| CliError::write(path, e))?,
        None => println!("{text}"),
    }
    let wild = end.cells.iter().filter(|v| !v.is_finite()).count();
    if wild > 0 {
        return Err(CliError::argument(
            "the state",
            format!("not finite in {wild} numbers"),
            "finite",
        ));
    }
    Ok(())
}

/// Planes of channels as cells of channels; a ground has at least 16 rows and columns, and fewer channels.
fn channels_last(shape: [usize; 3], data: Vec<f32>) -> ([usize; 3], Vec<f32>) {
    let [channels, rows, columns] = shape;
    if channels > CHANNELS || columns <= CHANNELS {
        return (shape, data);
    }
    let plane = rows * columns;
    let cells = (0..plane)
        .flat_map(|k| (0..channels).map(move |c| c * plane + k))
        .map(|k| data[k])
        .collect();
    ([rows, columns, channels], cells)
}

fn statistics(
    begin: &GroundState,
    end: &GroundState,
    report: &GroundReport,
    bytes: u64,
    cpu: f64,
    wall: Duration,
) -> serde_json::Value {
    let cells = (begin.columns * begin.rows) as f64;
    let (first, last) = (begin.sums(), end.sums());
    let (changed, last_changed) = (begin.changes(), end.changes());
    let balance =
        (last[1] - first[1]) - (report.gained - report.evaporated - report.seeped - report.run_off);
    let solid = (last_changed[0] - changed[0]) + (last[2] - first[2]) + report.load_run_off;
    let mut extremes = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    let mut fastest = 0.0_f64;
    let mut wet = 0_u64;
    for c in end.cells.chunks_exact(CHANNELS) {
        let height = f64::from(c[0]) + f64::from(c[8]);
        extremes[0] = extremes[0].min(height);
        extremes[1] = extremes[1].max(height);
        extremes[2] = extremes[2].min(f64::from(c[1]));
        extremes[3] = extremes[3].max(f64::from(c[1]));
        fastest = c[4..8].iter().fold(fastest, |a, b| a.max(f64::from(*b)));
        wet += u64::from(c[1] > 1e-3);
    }
    // What came, went or stood there: what rounding is judged by.
    let moved = report.gained + report.evaporated + report.seeped + report.run_off;
    serde_json::json!({
        "columns": begin.columns, "rows": begin.rows, "steps": report.steps, "time_s": report.time, "last_step_s": report.last_step,
        "water_begin_m": first[1], "water_end_m": last[1], "gained_m": report.gained, "evaporated_m": report.evaporated,
        "seeped_m": report.seeped, "run_off_m": report.run_off, "water_balance_m": balance,
        "water_balance_of_moved": if moved > 0.0 { balance.abs() / moved } else { 0.0 },
        "water_balance_of_total": balance.abs() / last[1].max(first[1]).max(1e-300),
        "sediment_begin_m": first[2], "sediment_end_m": last[2], "sediment_run_off_m": report.load_run_off,
        "ground_change_m": last_changed[0] - changed[0], "ground_moved_m": last_changed[1],
        "solid_balance_m": solid,
        "solid_balance_of_moved": if last_changed[1] > 0.0 { solid.abs() / last_changed[1] } else { 0.0 },
        "ground_ever_m": report.heights, "ground_min_m": extremes[0], "ground_max_m": extremes[1], "water_min_m": extremes[2], "water_max_m": extremes[3],
        "fastest_m_s": fastest, "wet_cells": wet, "active_tiles": report.active_tiles, "tiles": report.tiles, "tile_steps": report.tile_steps,
        "device_bytes": bytes, "bytes_per_cell": bytes as f64 / cells, "cpu_s": cpu / 1e3, "wall_s": wall.as_secs_f64(),
        "cell_steps_per_cpu_s": if cpu > 0.0 { cells * f64::from(report.steps) / (cpu / 1e3) } else { 0.0 },
    })
}

/// The ground from above, lit from the upper left, with its water.
fn relief(state: &GroundState, spacing: f32) -> Vec<u8> {
    let (columns, rows) = (state.columns, state.rows);
    let spacing = f64::from(spacing);
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for z in 0..rows {
        for x in 0..columns {
            let g = state.ground(x, z);
            (low, high) = (low.min(g), high.max(g));
        }
    }
    let mut rgb = Vec::with_capacity(3 * columns * rows);
    for z in 0..rows {
        for x in 0..columns {
            let (l, r) = (x.saturating_sub(1), (x + 1).min(columns - 1));
            let (d, u) = (z.saturating_sub(1), (z + 1).min(rows - 1));
            let slope = [
                (state.ground(r, z) - state.ground(l, z)) / (2.0 * spacing),
                (state.ground(x, u) - state.ground(x, d)) / (2.0 * spacing),
            ];
            let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
            let light = ((0.5 * slope[0] + 0.5 * slope[1] + 0.7) / length).max(0.0) + 0.15;
            let share = (state.ground(x, z) - low) / (high - low).max(1e-9);
            let steep = (1.0 - 1.0 / length).min(1.0);
            let earth = [
                0.25 + 0.35 * share + 0.2 * steep,
                0.34 + 0.22 * share,
                0.16 + 0.25 * share + 0.1 * steep,
            ];
            let water = state.water(x, z).max(0.0);
            let cover = 1.0 - (-water / 0.15).exp();
            let cover = if water > 2e-3 { cover.max(0.15) } else { 0.0 };
            let deep = 1.0 - (-water / 4.0).exp();
            let sea = [0.20 - 0.15 * deep, 0.42 - 0.25 * deep, 0.62 - 0.22 * deep];
            for (earth, sea) in earth.iter().zip(sea) {
                let shown = earth * light * (1.0 - cover) + sea * cover;
                rgb.push((255.0 * shown.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8);
            }
        }
    }
    rgb
}
