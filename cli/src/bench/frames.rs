//! What whole frames cost and how far they are off: sky, terrain and clouds with joined frames, beside the preset `thesis`.

use serde_json::json;
use veduta::atmosphere::{Atmosphere, Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::clouds::{AirLights, CloudDeck, CloudLights, CloudQuality, Clouds, CloudsOptions};
use veduta::temporal::{Temporal, TemporalOptions};
use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
use veduta::{Preset, Targets, Value, View, wgpu};

use super::timing::{Middle, Ratio};
use super::{Bench, decibels, table};
use crate::commands::render::Job;
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::metrics::{Picture, psnr};
use crate::render::{Size, picture};

/// The presets that are measured beside `thesis`.
pub const PRESETS: [&str; 2] = ["high", "low"];

/// Samples a pixel of converged pictures in each direction: of the systems, and of `thesis`.
const SAMPLES: [u32; 2] = [8, 4];

/// Steps of the clouds of the converged `thesis`, along the ray and to the sun; without those that find no cloud.
const CONVERGED: (i64, i64) = (256, 24);

/// Where rays end (m): on the ground, and in the clouds.
const FAR: [f64; 2] = [100_000.0, 80_000.0];

/// Frames that are joined before a picture is judged.
const FRAMES: usize = 32;

/// Frames a second.
const PACE: f64 = 30.0;

/// Wind of the clouds (m/s).
const WIND: [f64; 2] = [10.0, 0.0];

/// Light is scaled by this and exposed by one over it, so that the sun's disc is a number of 16 bits.
const SCALE: f32 = 0.0625;

/// Altitude at which the ground is lit (m).
const LIT: f64 = 1000.0;

/// Parts of a frame.
pub const PIECES: [&str; 6] = [
    "tables and tiles",
    "terrain",
    "sky and air",
    "clouds",
    "joining",
    "tone map",
];

/// What of the pixels a side a preset draws before frames are joined, as it is written.
fn part(preset: &str) -> &'static str {
    if preset == "low" { "2/5" } else { "1/2" }
}

/// The picture that a preset draws for one of this size.
fn taken(preset: &str, size: Size) -> Size {
    let share = if preset == "low" { 0.4 } else { 0.5 };
    let [width, height] = TemporalOptions::of_share([size.width, size.height], share).taken;
    Size { width, height }
}

/// Of one preset on one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Milliseconds of whole frames, by round.
    pub times: Vec<f64>,
    /// Milliseconds of the parts of frames, by part and round.
    pub pieces: [Vec<f64>; 6],
    /// Joined frames of an eye that stands against its own converged picture (dB).
    pub psnr: f64,
}

/// Of one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its name.
    pub view: String,
    /// Milliseconds of the preset `thesis`, by round.
    pub thesis: Vec<f64>,
    /// `thesis` against its own converged picture (dB), and with 32 steps along the ray.
    pub thesis_psnr: [f64; 2],
    /// The presets.
    pub presets: Vec<Entry>,
}

/// How finely a frame is drawn.
struct Fineness<'a> {
    preset: &'a str,
    /// Of the picture that is drawn.
    taken: Size,
    /// Of the joined one; none for a picture that is drawn at once.
    joined: Option<Size>,
    /// Texels of the baked heights; 0 for the preset's.
    texels: u32,
    clouds: CloudQuality,
}

/// A view's air and lights.
struct Scene {
    air: Atmosphere,
    deck: CloudDeck,
    land: Land,
    ground: TerrainLights,
    clouds: CloudLights,
}

impl Scene {
    fn new(bench: &Bench, view: &View) -> Result<Scene, CliError> {
        let gpu = &bench.gpu;
        let air = Atmosphere::named("thesis")?;
        let deck = CloudDeck {
            wind: WIND,
            ..CloudDeck::named("thesis")?
        };
        let land = Land::named("thesis")?;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let query = SkyQuery::new(device, veduta::programs(), &air)?;
        let mut sky = sky(bench, "high", &air)?;
        let albedo = land.material.rock_albedo();
        let tables = sky.tables_mut();
        let ground =
            TerrainLights::from_sky(device, queue, &query, tables, &view.sun, LIT, albedo)?;
        let to_sun = view.sun.to_light.as_dvec3().to_array();
        let lights = AirLights::find(gpu, &air, &deck, to_sun)?;
        let clouds = CloudLights::under(&lights, view.sun.irradiance);
        Ok(Scene {
            air,
            deck,
            land,
            ground,
            clouds,
        })
    }
}

fn targets(depth: bool) -> Targets {
    Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        depth_format: depth.then_some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    }
}

fn sky(bench: &Bench, preset: &str, air: &Atmosphere) -> Result<Sky, CliError> {
    let options = SkyOptions {
        preset: Preset::Named(preset.to_owned().into()),
        atmosphere: air.clone(),
        composition: SkyComposition::OverPicture,
        ..Default::default()
    };
    Ok(Sky::new(
        &bench.gpu.device,
        veduta::programs(),
        &targets(false),
        &options,
    )?)
}

/// The systems of a frame, with what they draw into.
struct Frame<'a> {
    scene: &'a Scene,
    sky: Sky,
    terrain: Terrain,
    clouds: Clouds,
    temporal: Option<Temporal>,
    tone: Tone,
    /// Ground; with sky, air and clouds; its depth.
    views: [wgpu::TextureView; 3],
    taken: Size,
    /// Frames drawn.
    drawn: usize,
}

impl<'a> Frame<'a> {
    fn new(bench: &Bench, scene: &'a Scene, fine: &Fineness<'_>) -> Result<Frame<'a>, CliError> {
        let device = &bench.gpu.device;
        let programs = veduta::programs();
        let texture = |format| picture(device, fine.taken, format).create_view(&Default::default());
        let color = targets(false).color_format;
        let views = [
            texture(color),
            texture(color),
            texture(wgpu::TextureFormat::Depth32Float),
        ];
        let options = TerrainOptions {
            preset: Preset::Named(fine.preset.to_owned().into()),
            land: scene.land.clone(),
            far: FAR[0],
            texels: fine.texels,
            ..Default::default()
        };
        let terrain = Terrain::new(device, programs, &targets(true), &options)?;
        let mut sky = sky(bench, fine.preset, &scene.air)?;
        sky.set_host(device, &views[2], Some(&views[0]))?;
        let options = CloudsOptions {
            quality: fine.clouds,
            deck: scene.deck.clone(),
            far: FAR[1],
            over_depth: true,
            air: Some(scene.air.clone()),
            ..Default::default()
        };
        let mut clouds = Clouds::new(device, programs, &targets(false), &options)?;
        clouds.set_host(device, &views[2])?;
        clouds.set_air(device, sky.tables())?;
        let temporal = match fine.joined {
            Some(size) => {
                let options = TemporalOptions {
                    taken: [fine.taken.width, fine.taken.height],
                    size: [size.width, size.height],
                    bound: f32::INFINITY,
                    sharp: fine.preset != "low",
                    ..TemporalOptions::of([size.width, size.height])
                };
                let mut temporal = Temporal::new(device, programs, &options)?;
                temporal.set_host(device, &views[1], &views[2])?;
                Some(temporal)
            }
            None => None,
        };
        let shown = temporal.as_ref().map_or(&views[1], Temporal::result);
        let tone = Tone::new(device, shown, fine.joined.unwrap_or(fine.taken));
        Ok(Frame {
            scene,
            sky,
            terrain,
            clouds,
            temporal,
            tone,
            views,
            taken: fine.taken,
            drawn: 0,
        })
    }

    /// Lets tiles and the light in the clouds come to rest.
    fn settle(&mut self, bench: &Bench, view: &View) -> Result<(), CliError> {
        let gpu = &bench.gpu;
        for _ in 0..1000 {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let _ = self.sky.prepare(&gpu.queue, &mut encoder, view)?;
            let lights = &self.scene.clouds;
            let work = self
                .clouds
                .prepare(&gpu.queue, &mut encoder, view, lights)?;
            submit(bench, encoder)?;
            if work.dispatches == 0 {
                break;
            }
        }
        Ok(())
    }

    /// The view of the next frame.
    fn seen(&self, view: &View) -> View {
        View {
            time: self.drawn as f64 / PACE,
            ..*view
        }
    }

    /// Milliseconds of the parts of a frame; all of it in the first where they are not submitted one by one.
    fn draw(&mut self, bench: &Bench, view: &View, apart: bool) -> Result<[f64; 6], CliError> {
        let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
        let unshifted = self.seen(view);
        let (view, rows) = match &self.temporal {
            Some(t) => (t.shifted(&unshifted), t.footprint_rows()),
            None => (unshifted, self.taken.height),
        };
        let [ground, aired, depth] = &self.views;
        let color = |view, load| {
            [Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load,
                    store: wgpu::StoreOp::Store,
                },
            })]
        };
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut times = [0.0; 6];
        let mut held = None;
        let mut since = now()?;
        for (piece, time) in times.iter_mut().enumerate() {
            let mut encoder = held
                .take()
                .unwrap_or_else(|| device.create_command_encoder(&Default::default()));
            match piece {
                0 => {
                    let _ = self.sky.prepare(queue, &mut encoder, &view)?;
                    let lights = &self.scene.ground;
                    let _ = (self.terrain).prepare(queue, &mut encoder, &view, lights, rows)?;
                    let lights = &self.scene.clouds;
                    let _ = self.clouds.prepare(queue, &mut encoder, &view, lights)?;
                }
                1 => {
                    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                        color_attachments: &color(ground, clear),
                        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                            view: depth,
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
                2 => {
                    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                        color_attachments: &color(aired, clear),
                        ..Default::default()
                    });
                    let _ = self.sky.composite(&mut pass)?;
                }
                3 => {
                    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                        color_attachments: &color(aired, wgpu::LoadOp::Load),
                        ..Default::default()
                    });
                    let _ = self.clouds.composite(&mut pass)?;
                }
                4 => {
                    if let Some(temporal) = &mut self.temporal {
                        let _ = temporal.resolve(queue, &mut encoder, &unshifted)?;
                    }
                }
                _ => self.tone.draw(&mut encoder),
            }
            if apart || piece == 5 {
                submit(bench, encoder)?;
                let then = now()?;
                *time = then.since(&since);
                since = then;
            } else {
                held = Some(encoder);
            }
        }
        self.drawn += 1;
        if !apart {
            times.swap(0, 5);
        }
        Ok(times)
    }

    /// The picture drawn or joined last, as radiance.
    fn read(&self, bench: &Bench) -> Result<Picture, CliError> {
        let shown = self.temporal.as_ref();
        let texture = shown.map_or(&self.views[1], Temporal::result).texture();
        let rgb: Vec<f32> = bench
            .gpu
            .read_texture(texture)?
            .chunks_exact(8)
            .flat_map(|p| [0, 2, 4].map(|k| half(u16::from_le_bytes([p[k], p[k + 1]]))))
            .collect();
        if let Some(wrong) = rgb.iter().find(|v| !v.is_finite()) {
            return Err(veduta::Error::Device(format!("a frame with {wrong} in it")).into());
        }
        Picture::new(texture.width() as usize, texture.height() as usize, rgb)
    }
}

fn now() -> Result<CpuTime, CliError> {
    CpuTime::now().ok_or_else(|| {
        let domain = "processor time, which this system does not tell";
        CliError::argument("--clock", "cpu", domain)
    })
}

fn submit(bench: &Bench, encoder: wgpu::CommandEncoder) -> Result<(), CliError> {
    bench.gpu.queue.submit([encoder.finish()]);
    bench
        .gpu
        .device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| veduta::Error::Device(e.to_string()))?;
    Ok(())
}

/// A number of 16 bits.
fn half(bits: u16) -> f32 {
    let (exponent, digits) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => digits * 2_f32.powi(-24),
        31 => f32::INFINITY,
        _ => (1.0 + digits / 1024.0) * 2_f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The host's finish, as that of the thesis: exposed, rounded off, encoded.
struct Tone {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    target: wgpu::TextureView,
}

const TONE: &str = "
@group(0) @binding(0) var picture: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

@fragment
fn draw(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let shown = 1.0 - exp(-16.0 * textureLoad(picture, vec2<i32>(at.xy), 0).rgb);
    let high = 1.055 * pow(max(shown, vec3<f32>(0.0)), vec3<f32>(0.41666667)) - 0.055;
    return vec4<f32>(select(high, 12.92 * shown, shown <= vec3<f32>(0.0031308)), 1.0);
}
";

impl Tone {
    fn new(device: &wgpu::Device, shown: &wgpu::TextureView, size: Size) -> Tone {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("tone map"),
            source: wgpu::ShaderSource::Wgsl(TONE.into()),
        });
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("tone map"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("cover"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("draw"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tone map"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(shown),
            }],
        });
        let target = picture(device, size, format).create_view(&Default::default());
        Tone {
            pipeline,
            group,
            target,
        }
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.target,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The converged clouds: a finer tile, finer cells and more steps of the same system.
fn converged() -> CloudQuality {
    CloudQuality {
        texels: 768,
        first_texels: 64,
        levels: 96,
        steps: 256,
        min_transmittance: 1e-4,
        second_tile: false,
        frames: 8,
        cells: [64, 32],
        wide: true,
        ..CloudQuality::of(&Preset::High)
    }
}

fn quality(preset: &str) -> CloudQuality {
    CloudQuality::joined(if preset == "low" {
        &Preset::Low
    } else {
        &Preset::High
    })
}

fn line(
    bench: &Bench,
    name: &str,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Line, CliError> {
    let job = |values: &[(&str, Value)]| bench.job("thesis", "thesis", name, values);
    let steps = |n: (i64, i64), skip: bool| {
        [
            ("CLOUD_STEPS", Value::Int(n.0)),
            ("CLOUD_LIGHT_STEPS", Value::Int(n.1)),
            ("CLOUD_SKIP", Value::Flag(skip)),
        ]
    };
    let whole: Job = job(&[])?;
    let mut view = whole.view(0.0, bench.size)?;
    let exposure = f64::from(view.exposure);
    progress(&format!("{name}: thesis, converged"));
    let truth = bench.reference(&job(&steps(CONVERGED, true))?, 0.0, SAMPLES[1])?;
    let truth = truth.display(exposure);
    let mut thesis_psnr = [0.0; 2];
    for (found, job) in thesis_psnr
        .iter_mut()
        .zip([job(&[])?, job(&steps((32, 12), false))?])
    {
        *found = psnr(&bench.picture(&job, 0.0, 1)?.display(exposure), &truth);
    }

    view.sun.irradiance *= SCALE;
    let scene = Scene::new(bench, &view)?;
    let exposure = exposure / f64::from(SCALE);
    let mut frames = Vec::new();
    let mut presets = Vec::new();
    for preset in PRESETS {
        progress(&format!("{name}: {preset}"));
        let mut frame = Frame::new(
            bench,
            &scene,
            &Fineness {
                preset,
                taken: taken(preset, bench.size),
                joined: Some(bench.size),
                texels: 0,
                clouds: quality(preset),
            },
        )?;
        frame.settle(bench, &view)?;
        for _ in 0..FRAMES {
            frame.draw(bench, &view, false)?;
        }
        let shown = frame.read(bench)?.display(exposure);
        progress(&format!("{name}: {preset}, converged"));
        let large = Size {
            width: SAMPLES[0] * bench.size.width,
            height: SAMPLES[0] * bench.size.height,
        };
        let mut fine = Frame::new(
            bench,
            &scene,
            &Fineness {
                preset,
                taken: large,
                joined: None,
                texels: 1024,
                clouds: converged(),
            },
        )?;
        fine.settle(bench, &view)?;
        // The clouds have drifted as far as in the last of the joined frames.
        fine.drawn = FRAMES - 1;
        fine.draw(bench, &view, false)?;
        let truth = fine.read(bench)?.averaged(SAMPLES[0] as usize)?;
        presets.push(Entry {
            times: Vec::new(),
            pieces: Default::default(),
            psnr: psnr(&shown, &truth.display(exposure)),
        });
        frames.push(frame);
    }
    progress(&format!("{name}: times"));
    let mut subject = bench.subject(&whole, 0.0)?;
    subject.renderer.warm_up(&subject.view)?;
    let mut thesis = Vec::new();
    for _ in 0..rounds {
        thesis.push(subject.draw(bench.clock)?);
        for (frame, entry) in frames.iter_mut().zip(&mut presets) {
            // The first of each finds the caches as another picture has left them.
            frame.draw(bench, &view, false)?;
            entry.times.push(frame.draw(bench, &view, false)?[0]);
            let pieces = frame.draw(bench, &view, true)?;
            for (list, time) in entry.pieces.iter_mut().zip(pieces) {
                list.push(time);
            }
        }
    }
    Ok(Line {
        view: name.to_owned(),
        thesis,
        thesis_psnr,
        presets,
    })
}

/// Measures every view.
///
/// # Errors
/// Faults of the device, views that do not exist, a system that does not tell processor times.
pub fn run(
    bench: &Bench,
    views: &[String],
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Line>, CliError> {
    views
        .iter()
        .map(|view| line(bench, view, rounds, progress))
        .collect()
}

fn middle(values: &[f64]) -> f64 {
    Middle::of(values).median
}

fn mean(lines: &[Line], of: &dyn Fn(&Line) -> f64) -> f64 {
    lines.iter().map(of).sum::<f64>() / lines.len().max(1) as f64
}

/// Times that a preset is cheaper than `thesis`: by the means of the times, and the geometric mean of the views' ratios.
pub fn cheaper(lines: &[Line], preset: usize) -> [f64; 2] {
    let of = |l: &Line| middle(&l.presets[preset].times);
    let logs = mean(lines, &|l| (middle(&l.thesis) / of(l)).ln());
    [
        mean(lines, &|l| middle(&l.thesis)) / mean(lines, &of),
        logs.exp(),
    ]
}

/// The report as a document.
pub fn markdown(bench: &Bench, lines: &[Line], command: &str) -> String {
    let mut heads = vec!["View".to_owned(), "`thesis` [ms]".to_owned()];
    for preset in PRESETS {
        heads.push(format!("`{preset}` [ms]"));
        heads.push("/ thesis".to_owned());
    }
    let mut dbs = vec![
        "View".to_owned(),
        "`thesis` [dB]".to_owned(),
        "with 32 x 12 steps".to_owned(),
    ];
    dbs.extend(PRESETS.map(|p| format!("`{p}` [dB]")));
    let (mut times, mut sharpness) = (vec![heads], vec![dbs]);
    for l in lines {
        let mut row = vec![l.view.clone(), format!("{:.1}", middle(&l.thesis))];
        let mut sharp = vec![l.view.clone()];
        sharp.extend(l.thesis_psnr.map(decibels));
        for p in &l.presets {
            row.push(format!("{:.1}", middle(&p.times)));
            row.push(Ratio::of(&p.times, &l.thesis).to_string());
            sharp.push(decibels(p.psnr));
        }
        times.push(row);
        sharpness.push(sharp);
    }
    let mut row = vec![
        "mean".to_owned(),
        format!("{:.1}", mean(lines, &|l| middle(&l.thesis))),
    ];
    let mut sharp = vec!["mean".to_owned()];
    sharp.extend([0, 1].map(|k| decibels(mean(lines, &|l| l.thesis_psnr[k]))));
    for k in 0..PRESETS.len() {
        row.push(format!(
            "{:.1}",
            mean(lines, &|l| middle(&l.presets[k].times))
        ));
        row.push(format!("{:.4}", 1.0 / cheaper(lines, k)[0]));
        sharp.push(decibels(mean(lines, &|l| l.presets[k].psnr)));
    }
    times.push(row);
    sharpness.push(sharp);
    let mut pieces = vec![
        ["preset", "pixels drawn"]
            .into_iter()
            .chain(PIECES)
            .map(str::to_owned)
            .collect::<Vec<_>>(),
    ];
    for (k, preset) in PRESETS.iter().enumerate() {
        let mut row = vec![format!("`{preset}`"), format!("{} a side", part(preset))];
        for piece in 0..PIECES.len() {
            let time = mean(lines, &|l| middle(&l.presets[k].pieces[piece]));
            row.push(format!("{time:.2}"));
        }
        pieces.push(row);
    }
    let ratios: Vec<String> = PRESETS
        .iter()
        .enumerate()
        .map(|(k, p)| {
            let [means, views] = cheaper(lines, k);
            format!("`{p}` {means:.1} times ({views:.1} in the geometric mean of the views)")
        })
        .collect();
    format!(
        "# What whole frames cost and how far they are off\n\nWritten by `{command}`.\n\n{}\n\
         `thesis` is the program `landscape` with the preset and the scene `thesis`. The presets are `Sky` over `Terrain` (land `thesis`) with `Clouds` (deck `thesis`, light of all orders)\n\
         before it, air in front of all of them, joined by `Temporal` from fewer pixels, and a tone map: the atmosphere `thesis` has the same coefficients, and light of all orders. The eye and\n\
         the sun stand, clouds drift with {} m/s, tiles and the light in the clouds are at rest.\n\n\
         Cheaper than `thesis`, means of the times over the views: {}.\n\n{}\n\
         ## Against many samples\n\nPSNR of tone-mapped pictures, each against its own converged one, so that an air that is right is no error: of `thesis` itself with {} x {} steps in clouds and {} x {} samples a pixel; of the presets the\n\
         last of {} joined frames against the same systems at once with {} x {} samples a pixel, heights of 1024 texels, clouds of a tile of 768 x 768 x 96, 64 x 64 x 32 cells and 256 steps.\n\n{}\n\
         ## Where the time goes\n\nMilliseconds of parts that are submitted one by one, means over the views of medians.\n\n{}",
        bench.machine(),
        WIND[0],
        ratios.join(", "),
        table(&times),
        CONVERGED.0,
        CONVERGED.1,
        SAMPLES[1],
        SAMPLES[1],
        FRAMES,
        SAMPLES[0],
        SAMPLES[0],
        table(&sharpness),
        table(&pieces),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, lines: &[Line], command: &str) -> serde_json::Value {
    let mut document = bench.head(command);
    document["views"] = lines
        .iter()
        .map(|l| {
            json!({
                "view": l.view,
                "thesis": l.thesis,
                "thesis_psnr": l.thesis_psnr[0],
                "thesis_32_12_psnr": l.thesis_psnr[1],
                "presets": PRESETS.iter().zip(&l.presets).map(|(name, p)| json!({
                    "preset": name,
                    "ms": p.times,
                    "psnr": p.psnr,
                    "pieces": PIECES.iter().zip(&p.pieces).map(|(piece, times)| json!({
                        "piece": piece,
                        "ms": times,
                    })).collect::<Vec<_>>(),
                })).collect::<Vec<_>>(),
            })
        })
        .collect::<Vec<_>>()
        .into();
    document["cheaper"] = PRESETS
        .iter()
        .enumerate()
        .map(|(k, p)| json!({ "preset": p, "by": cheaper(lines, k)[0] }))
        .collect::<Vec<_>>()
        .into();
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_those_of_the_means() {
        let line = |thesis: f64, time: f64| Line {
            view: String::new(),
            thesis: vec![thesis],
            thesis_psnr: [0.0; 2],
            presets: vec![Entry {
                times: vec![time],
                pieces: Default::default(),
                psnr: 0.0,
            }],
        };
        let [means, views] = cheaper(&[line(100.0, 10.0), line(900.0, 10.0)], 0);
        assert!((means - 50.0).abs() < 1e-9 && (views - 30.0).abs() < 1e-9);
    }

    #[test]
    fn halves_have_signs_and_no_end() {
        assert_eq!(half(0xbc00), -1.0);
        assert_eq!(half(0x7c00), f32::INFINITY);
        assert_eq!(half(0x0001), 2_f32.powi(-24));
    }
}
