//! What the terrain costs and how far it is off, beside that of the preset `thesis`, on the frozen views.

use serde_json::json;
use veduta::glam::Vec3;
use veduta::temporal::Temporal;
use veduta::terrain::{
    HitErrors, Land, Prepared, Terrain, TerrainHit, TerrainLights, TerrainOptions, TerrainRay,
    hit_errors,
};
use veduta::view::direction;
use veduta::{Preset, ProgramSet, Targets, Value, View, wgpu};

use super::timing::{Middle, Ratio};
use super::{Bench, table};
use crate::commands::render::Job;
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::metrics::{Picture, psnr};
use crate::render::{Output, Renderer, Size, Tiling, picture};

/// The presets that are measured beside `thesis`.
pub const PRESETS: [&str; 2] = ["high", "low"];

/// Samples a pixel of converged pictures, in each direction.
const SAMPLES: u32 = 8;

/// Where rays end (m).
const FAR: f64 = 100_000.0;

/// Speed of the flight (m/s), and its frames a second.
const FLIGHT: (f64, f64) = (100.0, 30.0);

/// Frames that are joined before an eye that stands is judged, and those of the flight.
const FRAMES: [usize; 2] = [32, 30];

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The views.
    pub views: Vec<String>,
    /// Rounds of timing.
    pub rounds: usize,
    /// Frames of the flight in which changes are compared; 0 leaves it out.
    pub frames: usize,
}

/// Of one preset on one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Milliseconds of a draw of all pixels, by round.
    pub alone: Vec<f64>,
    /// That picture against its own converged one (dB).
    pub alone_psnr: f64,
    /// Milliseconds of a draw of fewer pixels and of joining frames, by round.
    pub draws: Vec<f64>,
    /// The first bake (ms).
    pub first_bake: f64,
    /// Bakes in a flight, by frame (ms).
    pub bakes: Vec<f64>,
    /// Draws and joins in that flight (ms).
    pub flown: Vec<f64>,
    /// Joined frames of an eye that stands against the converged picture (dB).
    pub psnr: f64,
    /// The last frame of the flight against its converged picture (dB).
    pub flown_psnr: f64,
}

/// Of one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its name.
    pub view: String,
    /// Share of the picture that is ground.
    pub ground: f64,
    /// Milliseconds of the preset `thesis`, by round.
    pub thesis: Vec<f64>,
    /// The same half way along the flight.
    pub thesis_flying: Vec<f64>,
    /// `thesis` against its own converged picture (dB).
    pub thesis_psnr: f64,
    /// The presets.
    pub presets: Vec<Entry>,
    /// Hits of `high` against bracketing.
    pub hits: HitErrors,
}

/// Changes from frame to frame of a flight, in 8-bit steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Changes {
    /// Mean difference of a picture's change from that of its converged picture.
    pub unexplained: f64,
    /// Mean change of what is seen in both frames, followed by its depth.
    pub followed: f64,
    /// The same of the converged picture.
    pub truth_followed: f64,
    /// The pictures against their converged ones, mean over the frames (dB).
    pub psnr: f64,
}

/// Changes in a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Flicker {
    /// By what is drawn: `thesis`, and presets joined and alone.
    pub rows: Vec<(String, Changes)>,
    /// Mean way of what is seen in both frames (pixels a frame), and its share of the ground.
    pub motion: [f64; 2],
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The views.
    pub lines: Vec<Line>,
    /// The flight.
    pub flicker: Option<Flicker>,
    /// Bytes on the device of each preset.
    pub bytes: Vec<u64>,
}

/// A terrain with what it is drawn into.
struct Drawer {
    terrain: Terrain,
    color: wgpu::Texture,
    depth: wgpu::TextureView,
    size: Size,
    /// Joins frames, for presets that have fewer pixels than the picture.
    temporal: Option<Temporal>,
}

impl Drawer {
    /// One that joins frames to a picture of this size.
    fn joining(
        bench: &Bench,
        programs: &ProgramSet,
        preset: &str,
        size: Size,
        texels: u32,
    ) -> Result<Drawer, CliError> {
        let options = options(preset, texels)?.joined(programs, [size.width, size.height]);
        let [width, height] = options.taken;
        let mut drawer = Drawer::new(bench, programs, preset, Size { width, height }, texels)?;
        let mut temporal = Temporal::new(&bench.gpu.device, programs, &options)?;
        let color = drawer.color.create_view(&Default::default());
        temporal.set_host(&bench.gpu.device, &color, &drawer.depth)?;
        drawer.temporal = Some(temporal);
        Ok(drawer)
    }

    fn new(
        bench: &Bench,
        programs: &ProgramSet,
        preset: &str,
        size: Size,
        texels: u32,
    ) -> Result<Drawer, CliError> {
        let device = &bench.gpu.device;
        let format = wgpu::TextureFormat::Rgba32Float;
        let targets = Targets {
            color_format: format,
            depth_format: Some(wgpu::TextureFormat::Depth32Float),
            ..Default::default()
        };
        let options = options(preset, texels)?;
        let depth = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("depth"),
                size: wgpu::Extent3d {
                    width: size.width,
                    height: size.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Depth32Float,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
            .create_view(&Default::default());
        Ok(Drawer {
            temporal: None,
            terrain: Terrain::new(device, programs, &targets, &options)?,
            color: picture(device, size, format),
            depth,
            size,
        })
    }

    /// Milliseconds since a time.
    fn since(before: Option<CpuTime>) -> Result<f64, CliError> {
        match (before, CpuTime::now()) {
            (Some(before), Some(after)) => Ok(after.since(&before)),
            _ => Err(CliError::argument(
                "--clock",
                "cpu",
                "processor time, which this system does not tell",
            )),
        }
    }

    fn submit(bench: &Bench, encoder: wgpu::CommandEncoder) -> Result<f64, CliError> {
        let before = CpuTime::now();
        bench.gpu.queue.submit([encoder.finish()]);
        bench
            .gpu
            .device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|e| veduta::Error::Device(e.to_string()))?;
        Drawer::since(before)
    }

    /// Uploads what a view needs, and records the baking.
    fn bake(
        &mut self,
        bench: &Bench,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
    ) -> Result<(), CliError> {
        let (view, rows) = match &self.temporal {
            Some(t) => (&t.shifted(view), t.footprint_rows()),
            None => (view, self.size.height),
        };
        let lights = TerrainLights::clear(view.sun.irradiance);
        let _ = self
            .terrain
            .prepare(&bench.gpu.queue, encoder, view, &lights, rows)?;
        Ok(())
    }

    /// Records the draw.
    fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let target = self.color.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let _ = self.terrain.draw_opaque(&mut pass);
    }

    /// Records the joining, if there is any.
    fn join(
        &mut self,
        bench: &Bench,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
    ) -> Result<(), CliError> {
        if let Some(temporal) = &mut self.temporal {
            let _ = temporal.resolve(&bench.gpu.queue, encoder, view)?;
        }
        Ok(())
    }

    /// Milliseconds of baking, and of drawing with joining, which a host submits together.
    fn frame(&mut self, bench: &Bench, view: &View) -> Result<[f64; 2], CliError> {
        let device = &bench.gpu.device;
        let mut encoder = device.create_command_encoder(&Default::default());
        self.bake(bench, &mut encoder, view)?;
        let baked = Drawer::submit(bench, encoder)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        self.draw(&mut encoder);
        self.join(bench, &mut encoder, view)?;
        Ok([baked, Drawer::submit(bench, encoder)?])
    }

    /// Milliseconds of a frame as a host makes it: all of it in one submission, with what the program itself does for it.
    fn whole(&mut self, bench: &Bench, view: &View) -> Result<f64, CliError> {
        let before = CpuTime::now();
        let mut encoder = bench.gpu.device.create_command_encoder(&Default::default());
        self.bake(bench, &mut encoder, view)?;
        self.draw(&mut encoder);
        self.join(bench, &mut encoder, view)?;
        Drawer::submit(bench, encoder)?;
        Drawer::since(before)
    }

    /// Milliseconds of the parts of a frame, each submitted alone: what the program does before it is submitted, baking, drawing, joining.
    fn pieces(&mut self, bench: &Bench, view: &View) -> Result<[f64; 4], CliError> {
        let device = &bench.gpu.device;
        let before = CpuTime::now();
        let mut encoder = device.create_command_encoder(&Default::default());
        self.bake(bench, &mut encoder, view)?;
        let host = Drawer::since(before)?;
        let baked = Drawer::submit(bench, encoder)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        self.draw(&mut encoder);
        let drawn = Drawer::submit(bench, encoder)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        self.join(bench, &mut encoder, view)?;
        Ok([host, baked, drawn, Drawer::submit(bench, encoder)?])
    }

    /// The picture drawn or joined last: radiance, and the share of it that is ground.
    fn read(&self, bench: &Bench) -> Result<(Picture, f64), CliError> {
        let numbers: Vec<f32> = match &self.temporal {
            Some(temporal) => bench
                .gpu
                .read_texture(temporal.result().texture())?
                .chunks_exact(2)
                .map(|b| half(u16::from_le_bytes([b[0], b[1]])))
                .collect(),
            None => bench
                .gpu
                .read_texture(&self.color)?
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                .collect(),
        };
        let size = match &self.temporal {
            Some(temporal) => {
                let texture = temporal.result().texture();
                [texture.width(), texture.height()]
            }
            None => [self.size.width, self.size.height],
        };
        let ground = numbers.chunks_exact(4).filter(|p| p[3] > 0.0).count();
        let rgb = numbers
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        let [width, height] = size.map(|n| n as usize);
        let picture = Picture::new(width, height, rgb)?;
        Ok((picture, ground as f64 / (width * height) as f64))
    }
}

/// A half-precision number without sign.
fn half(bits: u16) -> f32 {
    let (exponent, digits) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    match exponent {
        0 => digits * 2_f32.powi(-24),
        _ => (1.0 + digits / 1024.0) * 2_f32.powi(exponent - 15),
    }
}

/// The thesis's mountains alone, with the programs of the systems in its catalog.
fn thesis(bench: &Bench, view: &str) -> Result<Job, CliError> {
    let mut job = bench.job(
        "clear",
        "thesis",
        view,
        &[("ATMOSPHERE", Value::Flag(false))],
    )?;
    // Of the user's own sources, where nothing shipped is asked for.
    for (program, features) in [
        ("terrain", [].as_slice()),
        ("terrain_bake", &[]),
        ("terrain_bake", &["CLIP_SECTORS"]),
        ("terrain_bake", &["CLIP_SHADES"]),
        ("temporal", &[]),
    ] {
        job.catalog.ensure_variant(program, features)?;
    }
    Ok(job)
}

/// What of the pixels a side a preset draws before frames are joined, as it is written.
fn part(preset: &str) -> &'static str {
    if preset == "low" { "13/50" } else { "1/2" }
}

/// The ground that is measured.
fn options(preset: &str, texels: u32) -> Result<TerrainOptions, CliError> {
    Ok(TerrainOptions {
        preset: Preset::Named(preset.to_owned().into()),
        land: Land::named("thesis")?,
        far: FAR,
        texels,
        ..Default::default()
    })
}

fn larger(size: Size, by: u32) -> Size {
    Size {
        width: size.width * by,
        height: size.height * by,
    }
}

/// The rays through the middles of the pixels of a drawn picture, row by row, where its depth says that they meet the ground, and the angle of a pixel.
fn drawn_hits(
    bench: &Bench,
    drawer: &Drawer,
    view: &View,
) -> Result<(Vec<TerrainRay>, Vec<TerrainHit>, f64), CliError> {
    let size = drawer.size;
    let pixels = view.pixels([size.width, size.height])?;
    let bytes = bench.gpu.read_texture(drawer.depth.texture())?;
    let (mut rays, mut hits) = (Vec::new(), Vec::new());
    for (i, b) in (0..).zip(bytes.chunks_exact(4)) {
        let depth = f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let at = [i % size.width, i / size.width].map(|k: u32| f64::from(k) + 0.5);
        rays.push(TerrainRay {
            origin: view.eye,
            dir: pixels.direction(at).to_array(),
            far: FAR,
        });
        hits.push(TerrainHit {
            distance: pixels.distance(at, depth),
            ..TerrainHit::MISS
        });
    }
    Ok((rays, hits, pixels.angle()))
}

/// Judges the hits that a preset draws of all pixels. Those that eight times the steps change are told as out of steps.
fn judged(
    bench: &Bench,
    set: &ProgramSet,
    preset: &str,
    view: &View,
) -> Result<HitErrors, CliError> {
    let mut patient = set.clone();
    for key in patient.keys.to_mut() {
        if let ("CLIP_STEPS", Value::Int(steps)) = (&*key.name, &mut key.default) {
            *steps *= 8;
        }
    }
    let mut found = Vec::new();
    for set in [set, &patient] {
        let mut drawer = Drawer::new(bench, set, preset, bench.size, 0)?;
        drawer.frame(bench, view)?;
        found.push(drawn_hits(bench, &drawer, view)?);
    }
    let (_, patient, _) = found.swap_remove(1);
    let (rays, mut hits, angle) = found.swap_remove(0);
    for (hit, other) in hits.iter_mut().zip(patient) {
        hit.capped = hit.distance.to_bits() != other.distance.to_bits();
    }
    let land = Land::named("thesis")?;
    Ok(hit_errors(
        &land,
        &rays,
        bench.size.width as usize,
        angle,
        &hits,
    )?)
}

fn line(bench: &Bench, name: &str, plan: &Plan) -> Result<Line, CliError> {
    let job = thesis(bench, name)?;
    let set = job.catalog.set();
    let view = job.view(0.0, bench.size)?;
    let exposure = f64::from(view.exposure);
    let shown = |p: &Picture| p.display(exposure);
    // Pictures first: they warm everything up.
    let once = bench.picture(&job, 0.0, 1)?;
    let thesis_psnr = psnr(&shown(&once), &shown(&bench.reference(&job, 0.0, SAMPLES)?));
    let mut renderer = Renderer::new(
        &bench.gpu,
        job.catalog.set(),
        &job.options,
        bench.size,
        Output::Linear,
    )?;
    renderer.warm_up(&view)?;
    let field = Land::named("thesis")?.prepare()?;
    let mut drawers = Vec::new();
    let mut presets = Vec::new();
    let mut ground = 0.0;
    for preset in PRESETS {
        // The converged pictures have the finest heights there are, and the rock of their preset.
        let mut fine = Drawer::new(bench, set, preset, larger(bench.size, SAMPLES), 1024)?;
        let mut converged = Vec::new();
        for view in [view, flown(&field, &view, FRAMES[1])] {
            fine.frame(bench, &view)?;
            converged.push(shown(&fine.read(bench)?.0.averaged(SAMPLES as usize)?));
        }
        drop(fine);
        let mut alone = Drawer::new(bench, set, preset, bench.size, 0)?;
        alone.frame(bench, &view)?;
        let (own, share) = alone.read(bench)?;
        ground = share;
        let mut entry = Entry {
            alone: Vec::new(),
            alone_psnr: psnr(&shown(&own), &converged[0]),
            draws: Vec::new(),
            first_bake: 0.0,
            bakes: Vec::new(),
            flown: Vec::new(),
            psnr: 0.0,
            flown_psnr: 0.0,
        };
        let mut joining = Drawer::joining(bench, set, preset, bench.size, 0)?;
        entry.first_bake = joining.frame(bench, &view)?[0];
        for _ in 1..FRAMES[0] {
            joining.frame(bench, &view)?;
        }
        entry.psnr = psnr(&shown(&joining.read(bench)?.0), &converged[0]);
        for frame in 1..=FRAMES[1] {
            let [baked, drawn] = joining.frame(bench, &flown(&field, &view, frame))?;
            entry.bakes.push(baked);
            entry.flown.push(drawn);
        }
        entry.flown_psnr = psnr(&shown(&joining.read(bench)?.0), &converged[1]);
        presets.push(entry);
        drawers.push([alone, joining]);
    }
    let (mut times, mut flying) = (Vec::new(), Vec::new());
    let midway = flown(&field, &view, FRAMES[1] / 2);
    for _ in 0..plan.rounds {
        for (times, view) in [(&mut times, view), (&mut flying, midway)] {
            let cost = renderer.draw(&view, Tiling::Adaptive, &mut |_| {})?;
            times.push(cost.cpu_ms.unwrap_or(f64::NAN));
        }
        for ([alone, joining], entry) in drawers.iter_mut().zip(&mut presets) {
            entry.alone.push(alone.frame(bench, &view)?[1]);
            joining.frame(bench, &view)?;
            entry.draws.push(joining.frame(bench, &view)?[1]);
        }
    }
    Ok(Line {
        view: name.to_owned(),
        ground,
        thesis: times,
        thesis_flying: flying,
        thesis_psnr,
        presets,
        hits: judged(bench, set, PRESETS[0], &view)?,
    })
}

/// Hits that `high` draws on the given views, and the milliseconds of its draws of all pixels: nothing else is measured.
///
/// # Errors
/// As [`run`].
pub fn hits(
    bench: &Bench,
    plan: &Plan,
    progress: &mut dyn FnMut(&str),
) -> Result<String, CliError> {
    let mut rows = Vec::new();
    let mut times = String::new();
    for name in &plan.views {
        progress(name);
        let job = thesis(bench, name)?;
        let set = job.catalog.set();
        let view = job.view(0.0, bench.size)?;
        let mut drawer = Drawer::new(bench, set, PRESETS[0], bench.size, 0)?;
        drawer.frame(bench, &view)?;
        let draws: Vec<f64> = (0..plan.rounds)
            .map(|_| Ok(drawer.frame(bench, &view)?[1]))
            .collect::<Result<_, CliError>>()?;
        times += &format!("- {name}: {:.1} ms\n", middle(&draws));
        rows.push((name.clone(), judged(bench, set, PRESETS[0], &view)?));
    }
    let rows = hit_rows(rows.iter().map(|(name, h)| (name.as_str(), h)));
    Ok(format!(
        "{}\nDraws of all pixels by `high`:\n\n{times}",
        table(&rows)
    ))
}

/// Refuses names of presets that are not measured.
fn check_names(of: &[String], known: &[&str]) -> Result<(), CliError> {
    match of.iter().find(|o| !known.contains(&o.as_str())) {
        Some(other) => Err(CliError::argument(
            "--of",
            other.clone(),
            format!("of {}", known.join(", ")),
        )),
        None => Ok(()),
    }
}

/// Frames of a round of costs, standing and flying.
const PACED: usize = 4;

/// What whole frames of the presets cost beside `thesis`, standing and flying, what of it is the program's own work, baking, drawing and joining, and how sharp they are: nothing else is measured.
/// Rounds go on with one flight.
///
/// # Errors
/// As [`run`].
pub fn costs(
    bench: &Bench,
    plan: &Plan,
    of: &[String],
    progress: &mut dyn FnMut(&str),
) -> Result<String, CliError> {
    check_names(of, &PRESETS)?;
    let named = |p: &&str| of.is_empty() || of.iter().any(|o| o == p);
    let presets: Vec<&str> = PRESETS.into_iter().filter(named).collect();
    let columns = [
        "standing", "host", "bake", "draw", "join", "flying", "host", "bake", "draw", "join",
    ];
    let mut tables = String::new();
    // By preset and view: ratios standing and flying, and what is said of the sharpness.
    let mut lines = vec![Vec::new(); presets.len()];
    let field = Land::named("thesis")?.prepare()?;
    for name in &plan.views {
        progress(name);
        let job = thesis(bench, name)?;
        let set = job.catalog.set();
        let view = job.view(0.0, bench.size)?;
        let exposure = f64::from(view.exposure);
        let shown = |p: &Picture| p.display(exposure);
        let once = bench.picture(&job, 0.0, 1)?;
        let reference = bench.reference(&job, 0.0, SAMPLES)?;
        let own = psnr(&shown(&once), &shown(&reference));
        let mut renderer = Renderer::new(
            &bench.gpu,
            job.catalog.set(),
            &job.options,
            bench.size,
            Output::Linear,
        )?;
        renderer.warm_up(&view)?;
        let mut drawers = Vec::new();
        for preset in &presets {
            let mut fine = Drawer::new(bench, set, preset, larger(bench.size, SAMPLES), 1024)?;
            let mut converged = Vec::new();
            for view in [view, flown(&field, &view, FRAMES[1])] {
                fine.frame(bench, &view)?;
                converged.push(shown(&fine.read(bench)?.0.averaged(SAMPLES as usize)?));
            }
            let mut sharp = Vec::new();
            let mut flying = Drawer::joining(bench, set, preset, bench.size, 0)?;
            for k in 0..FRAMES[0] + FRAMES[1] {
                let frame = (k + 1).saturating_sub(FRAMES[0]);
                let there = match frame {
                    0 => view,
                    n => flown(&field, &view, n),
                };
                flying.frame(bench, &there)?;
                if k + 1 == FRAMES[0] || k + 1 == FRAMES[0] + FRAMES[1] {
                    let truth = &converged[sharp.len()];
                    sharp.push(psnr(&shown(&flying.read(bench)?.0), truth));
                }
            }
            let mut standing = Drawer::joining(bench, set, preset, bench.size, 0)?;
            for _ in 0..4 {
                standing.frame(bench, &view)?;
            }
            drawers.push(([standing, flying], sharp));
        }
        // `thesis` standing, and where the flight is.
        let mut baseline = [Vec::new(), Vec::new()];
        let mut measured = vec![vec![Vec::new(); columns.len()]; presets.len()];
        for round in 0..plan.rounds {
            let middle_frame = FRAMES[1] + 2 * PACED * round + PACED;
            for (times, view) in baseline
                .iter_mut()
                .zip([view, flown(&field, &view, middle_frame)])
            {
                let cost = renderer.draw(&view, Tiling::Adaptive, &mut |_| {})?;
                times.push(cost.cpu_ms.unwrap_or(f64::NAN));
            }
            for ((both, _), times) in drawers.iter_mut().zip(&mut measured) {
                for (k, drawer) in both.iter_mut().enumerate() {
                    let mut sums = [0.0; 5];
                    for i in 0..2 * PACED {
                        // Whole frames and frames in parts take turns, in one flight.
                        let frame = FRAMES[1] + 1 + 2 * PACED * round + i;
                        let view = match k {
                            0 => view,
                            _ => flown(&field, &view, frame),
                        };
                        if i % 2 == 0 {
                            sums[0] += drawer.whole(bench, &view)?;
                        } else {
                            let pieces = drawer.pieces(bench, &view)?;
                            sums[1..].iter_mut().zip(pieces).for_each(|(s, p)| *s += p);
                        }
                    }
                    for (i, sum) in sums.into_iter().enumerate() {
                        times[5 * k + i].push(sum / PACED as f64);
                    }
                }
            }
        }
        let empty: Vec<f64> = (0..9)
            .map(|_| {
                Drawer::submit(
                    bench,
                    bench.gpu.device.create_command_encoder(&Default::default()),
                )
            })
            .collect::<Result<_, _>>()?;
        for (k, ((_, sharp), times)) in drawers.iter().zip(&measured).enumerate() {
            let ratio = |i: usize| Ratio::of(&times[i], &baseline[usize::from(i >= 5)]);
            // What is baked comes by fits and starts in a flight.
            let typical = |i: usize| {
                if i < 5 {
                    middle(&times[i])
                } else {
                    average(&times[i])
                }
            };
            let mut row = vec![
                name.clone(),
                format!("{:.1}", middle(&baseline[0])),
                format!("{:.1}", middle(&baseline[1])),
                ratio(0).to_string(),
                ratio(5).to_string(),
            ];
            row.extend((0..times.len()).map(|i| format!("{:.2}", typical(i))));
            row.push(format!("{:.2}", middle(&empty)));
            row.extend([own, sharp[0], sharp[1]].map(|p| format!("{p:.1}")));
            let mut numbers: Vec<f64> = vec![middle(&baseline[0])];
            numbers.extend((0..times.len()).map(typical));
            numbers.extend([own, sharp[0], sharp[1], middle(&baseline[1])]);
            lines[k].push((row, numbers));
        }
    }
    let mut head = [
        "View",
        "`thesis` standing [ms]",
        "flying",
        "standing / thesis",
        "flying / thesis",
    ]
    .map(str::to_owned)
    .to_vec();
    head.extend(columns.map(str::to_owned));
    head.extend(["empty", "`thesis` [dB]", "standing [dB]", "flying [dB]"].map(str::to_owned));
    for (preset, lines) in presets.iter().zip(lines) {
        let shown: Vec<&Vec<f64>> = lines
            .iter()
            .map(|(_, n)| n)
            .filter(|n| n[11].is_finite())
            .collect();
        let mean = |i: usize| finite(shown.iter().map(|n| n[i]));
        let mut last = vec![
            "mean".to_owned(),
            format!("{:.1}", mean(0)),
            format!("{:.1}", mean(14)),
            format!("{:.4}", mean(1) / mean(0)),
            format!("{:.4}", mean(6) / mean(14)),
        ];
        last.extend((1..11).map(|i| format!("{:.2}", mean(i))));
        last.push(String::new());
        last.extend((11..14).map(|i| format!("{:.2}", mean(i))));
        let mut rows = vec![head.clone()];
        rows.extend(lines.into_iter().map(|(row, _)| row));
        rows.push(last);
        tables += &format!(
            "`{preset}`, joined from {}; milliseconds of processor time, means of frames, medians of rounds standing and means flying; parts are submitted alone, an empty submission takes what `empty` says:\n\n{}\n",
            part(preset),
            table(&rows),
        );
    }
    Ok(tables)
}

/// The table of hits.
fn hit_rows<'a>(judged: impl Iterator<Item = (&'a str, &'a HitErrors)>) -> Vec<Vec<String>> {
    let head = [
        "View",
        "rays",
        "hits",
        "wrong [%]",
        "at the silhouette [%]",
        "out of steps",
        "median",
        "95 %",
        "99 %",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (view, h) in judged {
        let percent = |n: usize| format!("{:.3}", 100.0 * n as f64 / h.rays.max(1) as f64);
        rows.push(vec![
            view.to_owned(),
            h.rays.to_string(),
            h.across.len().to_string(),
            percent(h.wrong),
            percent(h.at_silhouette),
            h.capped.to_string(),
            format!("{:.3}", h.centile(0.5)),
            format!("{:.3}", h.centile(0.95)),
            format!("{:.3}", h.centile(0.99)),
        ]);
    }
    rows
}

/// Least height over the ground of the flight (m).
const LOWEST: f64 = 2.0;

/// The view after some frames of the flight: level, or over the ground where that rises.
fn flown(field: &Prepared<f64>, view: &View, frame: usize) -> View {
    let forward = view
        .world_from_view
        .transform_vector3(Vec3::NEG_Z)
        .as_dvec3();
    let azimuth = forward.x.atan2(-forward.z);
    let mut view = *view;
    view.eye = view
        .eye
        .moved_by(direction(0.0, azimuth) * (FLIGHT.0 / FLIGHT.1 * frame as f64));
    let lowest = field.ground(view.eye, 0.0).height + LOWEST;
    let rise = (lowest - view.eye.altitude()).max(0.0);
    view.eye = view.eye.moved_by([0.0, rise, 0.0].into());
    view
}

/// Mean change between frames, of pictures less their converged ones.
fn unexplained(frames: &[(Vec<u8>, Vec<u8>)]) -> f64 {
    let mut sum = 0.0;
    let mut count = 0_usize;
    for pair in frames.windows(2) {
        let [(shown, truth), (next_shown, next_truth)] = pair else {
            continue;
        };
        for k in 0..shown.len() {
            let change = f64::from(next_shown[k]) - f64::from(shown[k]);
            let motion = f64::from(next_truth[k]) - f64::from(truth[k]);
            sum += (change - motion).abs();
            count += 1;
        }
    }
    sum / count.max(1) as f64
}

/// A frame of the flight: its view, and the distances along its axis by pixel, infinite where no ground is.
struct Seen {
    view: View,
    size: Size,
    distances: Vec<f64>,
}

impl Seen {
    /// Of a drawn picture of whole times as many pixels: those of the samples next to the pixels' middles.
    fn of(bench: &Bench, drawer: &Drawer, view: &View, size: Size) -> Result<Seen, CliError> {
        let [from, scale] = [view.projection.w_axis.z, view.projection.z_axis.z].map(f64::from);
        let bytes = bench.gpu.read_texture(drawer.depth.texture())?;
        let by = drawer.size.width / size.width;
        let mut distances = Vec::new();
        for y in 0..size.height {
            for x in 0..size.width {
                let k = ((by * y + by / 2) * drawer.size.width + by * x + by / 2) as usize;
                let depth = bytes[4 * k..4 * k + 4]
                    .try_into()
                    .map_or(0.0, f32::from_le_bytes);
                distances.push(if depth > 0.0 {
                    from / (f64::from(depth) + scale)
                } else {
                    f64::INFINITY
                });
            }
        }
        Ok(Seen {
            view: *view,
            size,
            distances,
        })
    }

    /// Where what a pixel shows was in another frame's picture [pixels, from the middle of the first one], if it shows ground and the other frame does there, at no more than a tenth
    /// nearer or farther.
    fn found_in(&self, other: &Seen, pixel: usize) -> Option<[f64; 2]> {
        let distance = self.distances[pixel];
        if !distance.is_finite() {
            return None;
        }
        let [width, height] = [self.size.width, self.size.height].map(f64::from);
        let [middle, right, up] = self.view.rays().ok()?.map(|v| v.as_dvec3());
        let columns = self.size.width as usize;
        let x = 2.0 * ((pixel % columns) as f64 + 0.5) / width - 1.0;
        let y = 1.0 - 2.0 * ((pixel / columns) as f64 + 0.5) / height;
        let forward = self.view.world_from_view.z_axis.truncate().as_dvec3() * -1.0;
        let ray = middle + x * right + y * up;
        let point = ray * (distance / ray.dot(forward)) + self.view.eye.relative_to(other.view.eye);
        let back = other.view.world_from_view.as_dmat4().inverse();
        let clip = other.view.projection.as_dmat4() * back.transform_vector3(point).extend(1.0);
        let at = [
            (0.5 + 0.5 * clip.x / clip.w) * width - 0.5,
            (0.5 - 0.5 * clip.y / clip.w) * height - 0.5,
        ];
        let inside = clip.w > 0.0
            && (0.0..=width - 1.0).contains(&at[0])
            && (0.0..=height - 1.0).contains(&at[1]);
        if !inside {
            return None;
        }
        let there = corners(at, columns).all(|(k, _)| {
            let ratio = other.distances[k] / clip.w;
            (0.9..=1.1).contains(&ratio)
        });
        there.then_some(at)
    }
}

/// The four pixels around a place and how much they count, by a line along both axes.
fn corners([x, y]: [f64; 2], columns: usize) -> impl Iterator<Item = (usize, f64)> {
    let (left, top) = (x.floor(), y.floor());
    let (share_x, share_y) = (x - left, y - top);
    let first = top as usize * columns + left as usize;
    [
        (first, (1.0 - share_x) * (1.0 - share_y)),
        (first + 1, share_x * (1.0 - share_y)),
        (first + columns, (1.0 - share_x) * share_y),
        (first + columns + 1, share_x * share_y),
    ]
    .into_iter()
    // On the last row or column there is nothing beyond.
    .filter(|(_, share)| *share > 0.0)
}

/// Mean change between frames of what is seen in both, and its mean way (pixels) and share of the ground.
fn followed<'a>(frames: impl Iterator<Item = (&'a [u8], &'a Seen)>) -> [f64; 3] {
    let (mut change, mut way, mut count, mut ground) = (0.0, 0.0, 0_usize, 0_usize);
    let mut before: Option<(&[u8], &Seen)> = None;
    for (shown, seen) in frames {
        if let Some((old, was)) = before {
            let columns = seen.size.width as usize;
            for pixel in 0..seen.distances.len() {
                ground += usize::from(seen.distances[pixel].is_finite());
                let Some(at) = seen.found_in(was, pixel) else {
                    continue;
                };
                for channel in 0..3 {
                    let there: f64 = corners(at, columns)
                        .map(|(k, share)| share * f64::from(old[3 * k + channel]))
                        .sum();
                    change += (f64::from(shown[3 * pixel + channel]) - there).abs() / 3.0;
                }
                way += (at[0] - (pixel % columns) as f64).hypot(at[1] - (pixel / columns) as f64);
                count += 1;
            }
        }
        before = Some((shown, seen));
    }
    let by = 1.0 / count.max(1) as f64;
    [change * by, way * by, count as f64 / ground.max(1) as f64]
}

impl Changes {
    /// Of frames and their converged ones.
    fn of(frames: &[(Vec<u8>, Vec<u8>)], seen: &[Seen]) -> Changes {
        let both = || frames.iter().zip(seen);
        Changes {
            unexplained: unexplained(frames),
            followed: followed(both().map(|((shown, _), s)| (shown.as_slice(), s)))[0],
            truth_followed: followed(both().map(|((_, truth), s)| (truth.as_slice(), s)))[0],
            psnr: average(&frames.iter().map(|(p, t)| psnr(p, t)).collect::<Vec<_>>()),
        }
    }
}

/// A flight with V01's eye and sun, at half the size, of `thesis` and the presets, or of those that are named.
fn flicker(bench: &Bench, frames: usize, of: &[String]) -> Result<Flicker, CliError> {
    check_names(of, &["thesis", PRESETS[0], PRESETS[1]])?;
    let named = |p: &&str| of.is_empty() || of.iter().any(|o| o == p);
    let small = Size {
        width: bench.size.width / 2,
        height: bench.size.height / 2,
    };
    let samples = SAMPLES;
    let field = Land::named("thesis")?.prepare()?;
    let job = thesis(bench, "V01")?;
    let set = job.catalog.set();
    let mut view = job.view(0.0, small)?;
    view.look(0.0, -0.1, 60_f32.to_radians(), small.aspect() as f32);
    let exposure = f64::from(view.exposure);
    let mut seen = Vec::new();
    let mut rows = Vec::new();
    for preset in PRESETS {
        let wanted = named(&preset);
        if !wanted && preset != PRESETS[0] {
            continue;
        }
        // As fine for its pixels as it is by default for those of the size that is measured.
        let texels = 256;
        let mut drawers = [
            Drawer::joining(bench, set, preset, small, texels)?,
            Drawer::new(bench, set, preset, small, texels)?,
        ];
        let mut fine = Drawer::new(bench, set, preset, larger(small, samples), 1024)?;
        let mut shown = [Vec::new(), Vec::new()];
        for frame in 0..frames {
            let view = flown(&field, &view, frame);
            fine.frame(bench, &view)?;
            // All are followed by the ground of the first.
            if preset == PRESETS[0] {
                seen.push(Seen::of(bench, &fine, &view, small)?);
            }
            if !wanted {
                continue;
            }
            let truth = fine.read(bench)?.0.averaged(samples as usize)?;
            for (drawer, shown) in drawers.iter_mut().zip(&mut shown) {
                drawer.frame(bench, &view)?;
                shown.push((
                    drawer.read(bench)?.0.display(exposure),
                    truth.display(exposure),
                ));
            }
        }
        if wanted {
            for (name, shown) in [
                format!("`{preset}` joined from {}", part(preset)),
                format!("`{preset}` alone"),
            ]
            .into_iter()
            .zip(&shown)
            {
                rows.push((name, Changes::of(shown, &seen)));
            }
        }
    }
    if named(&"thesis") {
        let mut renderers = Vec::new();
        for size in [small, larger(small, samples)] {
            renderers.push(Renderer::new(
                &bench.gpu,
                job.catalog.set(),
                &job.options,
                size,
                Output::Linear,
            )?);
        }
        let mut shown = Vec::new();
        for frame in 0..frames {
            let view = flown(&field, &view, frame);
            let mut both = Vec::new();
            for (renderer, by) in renderers.iter_mut().zip([1, samples]) {
                renderer.draw(&view, Tiling::Adaptive, &mut |_| {})?;
                let rgb: Vec<f32> = renderer
                    .read_rgba32()?
                    .chunks_exact(4)
                    .flat_map(|p| [p[0], p[1], p[2]])
                    .collect();
                let size = larger(small, by);
                let picture = Picture::new(size.width as usize, size.height as usize, rgb)?;
                both.push(picture.averaged(by as usize)?.display(exposure));
            }
            let truth = both.pop().unwrap_or_default();
            shown.push((both.pop().unwrap_or_default(), truth));
        }
        rows.insert(0, ("`thesis`".to_owned(), Changes::of(&shown, &seen)));
    }
    let black = vec![0; 3 * (small.width * small.height) as usize];
    let [_, way, share] = followed(seen.iter().map(|s| (black.as_slice(), s)));
    Ok(Flicker {
        rows,
        motion: [way, share],
    })
}

/// Changes in the flight, in words and a table.
fn flicker_rows(flicker: &Flicker) -> String {
    let head = [
        "",
        "unexplained",
        "/ `thesis`",
        "followed",
        "/ `thesis`",
        "followed, converged",
        "[dB]",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let thesis = flicker
        .rows
        .iter()
        .find(|(name, _)| name == "`thesis`")
        .map(|(_, c)| *c);
    let over = |value: f64, of: &dyn Fn(&Changes) -> f64| {
        thesis
            .as_ref()
            .map_or(String::new(), |t| format!("{:.2}", value / of(t)))
    };
    for (name, c) in &flicker.rows {
        rows.push(vec![
            name.clone(),
            format!("{:.2}", c.unexplained),
            over(c.unexplained, &|t| t.unexplained),
            format!("{:.2}", c.followed),
            over(c.followed, &|t| t.followed),
            format!("{:.2}", c.truth_followed),
            format!("{:.1}", c.psnr),
        ]);
    }
    format!(
        "In a flight from V01's place, level with a view 6 degrees down (half the size, converged pictures of {SAMPLES} x {SAMPLES} samples), in steps of 8 bits. `unexplained`: mean change from frame to\n\
         frame less that of the converged frames, over the whole picture, so that what is blurred counts wherever converged frames change, and they change by more than motion. `followed`: mean\n\
         change of the ground that is seen in both frames, followed by its depth ({:.2} pixels a frame; {:.1} % of the ground is), which is what flickers; the converged frames' own beside it. The last\n\
         column is the pictures' mean sharpness in the flight, against their converged ones.\n\n{}",
        flicker.motion[0],
        100.0 * flicker.motion[1],
        table(&rows),
    )
}

/// Changes in a flight of `thesis` and the presets, or of those that are named: nothing else is measured.
///
/// # Errors
/// As [`run`].
pub fn changes(
    bench: &Bench,
    plan: &Plan,
    of: &[String],
    progress: &mut dyn FnMut(&str),
) -> Result<String, CliError> {
    progress("flight");
    Ok(flicker_rows(&flicker(bench, plan.frames, of)?))
}

/// Measures every view.
///
/// # Errors
/// Faults of the device, views that do not exist, a system that does not tell processor times.
pub fn run(bench: &Bench, plan: &Plan, progress: &mut dyn FnMut(&str)) -> Result<Report, CliError> {
    let mut lines = Vec::new();
    for view in &plan.views {
        progress(view);
        lines.push(line(bench, view, plan)?);
    }
    let flicker = if plan.frames > 1 {
        progress("flight");
        Some(flicker(bench, plan.frames, &[])?)
    } else {
        None
    };
    let bytes = PRESETS
        .iter()
        .map(|p| {
            Ok(Drawer::new(bench, veduta::programs(), p, bench.size, 0)?
                .terrain
                .resources()
                .texture_bytes)
        })
        .collect::<Result<_, CliError>>()?;
    Ok(Report {
        lines,
        flicker,
        bytes,
    })
}

/// Means over the views that show ground.
fn mean(report: &Report, of: &dyn Fn(&Line) -> f64) -> f64 {
    finite(report.lines.iter().filter(|l| l.ground > 0.0).map(of))
}

fn middle(values: &[f64]) -> f64 {
    Middle::of(values).median
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The mean of what is a number: a flight that has left the ground behind has no error to speak of.
fn finite(values: impl Iterator<Item = f64>) -> f64 {
    average(&values.filter(|v| v.is_finite()).collect::<Vec<_>>())
}

/// The report as a document.
pub fn markdown(bench: &Bench, report: &Report, command: &str) -> String {
    let mut rows = vec![
        ["View", "ground", "`thesis` [ms]"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let mut sharpness = vec![["View", "`thesis` [dB]"].map(str::to_owned).to_vec()];
    for preset in PRESETS {
        rows[0].push(format!("`{preset}` joined from {} [ms]", part(preset)));
        for head in ["/ thesis", "flight [ms]", "baked", "alone"] {
            rows[0].push(head.to_owned());
        }
        sharpness[0].push(format!("`{preset}` joined from {} [dB]", part(preset)));
        for head in ["flight", "alone"] {
            sharpness[0].push(head.to_owned());
        }
    }
    for l in &report.lines {
        let mut row = vec![
            l.view.clone(),
            format!("{:.0} %", 100.0 * l.ground),
            format!("{:.1}", middle(&l.thesis)),
        ];
        let mut sharp = vec![l.view.clone(), format!("{:.1}", l.thesis_psnr)];
        for p in &l.presets {
            row.push(format!("{:.1}", middle(&p.draws)));
            row.push(Ratio::of(&p.draws, &l.thesis).to_string());
            row.push(format!("{:.1}", average(&p.flown)));
            row.push(format!("{:.1}", average(&p.bakes)));
            row.push(format!("{:.1}", middle(&p.alone)));
            for psnr in [p.psnr, p.flown_psnr, p.alone_psnr] {
                sharp.push(format!("{psnr:.1}"));
            }
        }
        rows.push(row);
        sharpness.push(sharp);
    }
    let thesis = mean(report, &|l| middle(&l.thesis));
    let mut row = vec!["mean".to_owned(), String::new(), format!("{thesis:.1}")];
    let mut sharp = vec![
        "mean".to_owned(),
        format!("{:.1}", mean(report, &|l| l.thesis_psnr)),
    ];
    for k in 0..PRESETS.len() {
        let draw = mean(report, &|l| middle(&l.presets[k].draws));
        row.push(format!("{draw:.1}"));
        row.push(format!("{:.3}", draw / thesis));
        let of: [&dyn Fn(&Entry) -> f64; 3] =
            [&|p| average(&p.flown), &|p| average(&p.bakes), &|p| {
                middle(&p.alone)
            }];
        for of in of {
            row.push(format!("{:.1}", mean(report, &|l| of(&l.presets[k]))));
        }
        let of: [&dyn Fn(&Entry) -> f64; 3] = [&|p| p.psnr, &|p| p.flown_psnr, &|p| p.alone_psnr];
        for of in of {
            sharp.push(format!("{:.1}", mean(report, &|l| of(&l.presets[k]))));
        }
    }
    rows.push(row);
    sharpness.push(sharp);
    let whole: Vec<String> = PRESETS
        .iter()
        .enumerate()
        .map(|(k, preset)| {
            let of = |p: &Entry| average(&p.flown) + average(&p.bakes);
            let all = mean(report, &|l| of(&l.presets[k]));
            format!(
                "`{preset}` {:.3}",
                all / mean(report, &|l| middle(&l.thesis_flying))
            )
        })
        .collect();
    let hits = hit_rows(report.lines.iter().map(|l| (l.view.as_str(), &l.hits)));
    let flight = report.flicker.as_ref().map_or(String::new(), |f| {
        format!(
            "\n## Changes that motion does not explain\n\n{}",
            flicker_rows(f)
        )
    });
    let bakes: Vec<String> = PRESETS
        .iter()
        .enumerate()
        .map(|(k, p)| {
            format!(
                "`{p}` {:.0} ms and {:.1} MB",
                mean(report, &|l| l.presets[k].first_bake),
                report.bytes[k] as f64 / 1e6
            )
        })
        .collect();
    format!(
        "# What the terrain costs and how far it is off\n\nWritten by `{command}`.\n\n{}\n\
         The mountains of the preset `thesis` alone, without air or clouds, and the land `thesis` with its lights. Presets draw fewer pixels than the picture has, `high` half\n\
         and `low` 0.26 of them a side, and `Temporal` joins the frames (`low` without its cubic); `alone` draws all pixels and joins nothing. Milliseconds are those of a draw with joining\n\
         (median) and, in a flight at 100 m/s with 30 frames a second, of a draw with joining and of baking (means). Flights with bakes over `thesis` half way along them, means: {}.\n\
         The first bake and the memory of heights: {}.\n\n{}\n\
         ## Against many samples\n\nPSNR of each against itself with {SAMPLES} x {SAMPLES} samples a pixel: of `thesis`, of an eye that stands after {} frames, of the last of {} frames of the\n\
         flight, and of one frame of all pixels alone. The last line is the mean over the views that show ground.\n\n{}\n\
         ## Hits\n\nWhere the depth that `high` draws of all pixels says that they are, against bracketing in f64; errors across the ray in footprints (bars: 0.02 % wrong, 0.3 % at the\nsilhouette, 0.5 for 99 %). Out of steps are those that eight times the steps change.\n\n{}{flight}",
        bench.machine(),
        whole.join(", "),
        bakes.join(", "),
        table(&rows),
        FRAMES[0],
        FRAMES[1],
        table(&sharpness),
        table(&hits),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, report: &Report, command: &str) -> serde_json::Value {
    let mut document = bench.head(command);
    document["views"] = report
        .lines
        .iter()
        .map(|l| {
            json!({
                "view": l.view,
                "ground": l.ground,
                "thesis": l.thesis,
                "thesis_flying": l.thesis_flying,
                "thesis_psnr": l.thesis_psnr,
                "presets": PRESETS.iter().zip(&l.presets).map(|(name, p)| json!({
                    "preset": name,
                    "alone": p.alone,
                    "alone_psnr": p.alone_psnr,
                    "draws": p.draws,
                    "first_bake": p.first_bake,
                    "flight_draw": average(&p.flown),
                    "flight_bake": average(&p.bakes),
                    "psnr": p.psnr,
                    "flight_psnr": p.flown_psnr,
                })).collect::<Vec<_>>(),
                "hits": {
                    "rays": l.hits.rays,
                    "met": l.hits.across.len(),
                    "wrong": l.hits.wrong,
                    "at_silhouette": l.hits.at_silhouette,
                    "out_of_steps": l.hits.capped,
                    "centile_99": l.hits.centile(0.99),
                },
            })
        })
        .collect::<Vec<_>>()
        .into();
    if let Some(f) = &report.flicker {
        document["changes"] = f
            .rows
            .iter()
            .map(|(name, c)| {
                json!({
                    "of": name,
                    "unexplained": c.unexplained,
                    "followed": c.followed,
                    "truth_followed": c.truth_followed,
                    "psnr": c.psnr,
                })
            })
            .collect::<Vec<_>>()
            .into();
    }
    document
}
