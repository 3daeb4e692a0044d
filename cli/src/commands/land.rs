//! `veduta land`: a picture of a land under its sky.

use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;

use veduta::atmosphere::{Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::glam::{DQuat, DVec3, Mat4, Vec3};
use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
use veduta::view::direction;
use veduta::wgpu;
use veduta::{Light, Preset, Targets, View, WorldPos};

use super::probe::{atmosphere, land};
use super::sky::exposure_of;
use crate::cpu::CpuTime;
use crate::error::CliError;
use crate::image::{check_folder, check_output, write_exr, write_png};
use crate::metrics::Picture;
use crate::render::Size;

/// Arguments of `veduta land`.
#[derive(Debug, Clone, clap::Args)]
pub struct LandArgs {
    /// A shipped land or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "thesis")]
    pub land: String,
    /// A shipped atmosphere or a .ron file; `none` for a land without air
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// The preset
    #[arg(long, value_name = "NAME", default_value = "high")]
    pub preset: String,
    /// Place of the eye, x and z in metres, 13500,-14700 when left out; over a ball latitude and longitude in degrees, 20,0 when left out
    #[arg(
        long,
        value_name = "X,Z",
        value_delimiter = ',',
        num_args = 1..=2,
        allow_hyphen_values = true
    )]
    pub place: Option<Vec<f64>>,
    /// Height of the eye above the ground in metres, 0.1 to 1e7; over a ball up to 1e8
    #[arg(long, default_value_t = 300.0)]
    pub eye_height: f64,
    /// Direction of the view in degrees, clockwise from -z
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub yaw: f64,
    /// Elevation of the view in degrees
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub pitch: f64,
    /// Vertical field of view in degrees, 0.01 to 170
    #[arg(long, default_value_t = 60.0)]
    pub fov: f64,
    /// Height of the sun above the horizon in degrees
    #[arg(long, default_value_t = 30.0, allow_negative_numbers = true)]
    pub sun_height: f64,
    /// Azimuth of the sun in degrees, clockwise from -z
    #[arg(long, default_value_t = 120.0, allow_negative_numbers = true)]
    pub sun_azimuth: f64,
    /// Distance at which rays end in metres, 100 to 4e6, 1e5 when left out; over a ball up to 1e9, and not before when left out
    #[arg(long)]
    pub far: Option<f64>,
    /// Sectors in which the horizons around a place take light off the sky, 0 to 16
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=16))]
    pub sky_sectors: u32,
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "256x144")]
    pub size: Size,
    /// Factor on radiance before the tone map; found from the picture when left out
    #[arg(long)]
    pub exposure: Option<f64>,
    /// Frames whose processor time is printed, of a flight at 100 m/s with 30 frames a second; the picture is the last
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub frames: u32,
    /// The picture, .png or .exr (radiance for a sun of irradiance 1, not exposed)
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments out of their domains and files that cannot be written; what the library reports.
pub fn run(args: &LandArgs) -> Result<(), CliError> {
    let exr = args
        .out
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    check_output("--out", &args.out, if exr { "exr" } else { "png" })?;
    check_folder(&args.out)?;
    let within = |name: &str, value: f64, low: f64, high: f64| {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(CliError::argument(
            name,
            value.to_string(),
            format!("in [{low}, {high}]"),
        ))
    };
    within("--fov", args.fov, 0.01, 170.0)?;
    within("--pitch", args.pitch, -90.0, 90.0)?;
    within("--yaw", args.yaw, -360.0, 360.0)?;
    within("--sun-height", args.sun_height, -90.0, 90.0)?;
    within("--sun-azimuth", args.sun_azimuth, -360.0, 360.0)?;
    if let Some(exposure) = args.exposure {
        within("--exposure", exposure, 0.0, 1e12)?;
    }
    let gpu = veduta::device::shared()?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let land = land(&args.land)?;
    let ball = if land.field.on_sphere() {
        Some(land.globe::<f64>()?)
    } else {
        None
    };
    let most = if ball.is_some() { 1e8 } else { 1e7 };
    within("--eye-height", args.eye_height, 0.1, most)?;
    let far = args.far.unwrap_or(if ball.is_some() { 1e9 } else { 1e5 });
    within("--far", far, 100.0, if ball.is_some() { 1e9 } else { 4e6 })?;
    let place = match (&args.place, &ball) {
        (Some(place), _) => match place[..] {
            [x, z] => [x, z],
            _ => {
                return Err(CliError::argument(
                    "--place",
                    format!("{place:?}"),
                    "two numbers, as 1000,-2000".to_owned(),
                ));
            }
        },
        (None, Some(_)) => [20.0, 0.0],
        (None, None) => [13_500.0, -14_700.0],
    };
    if ball.is_some() {
        within("--place", place[0], -90.0, 90.0)?;
        within("--place", place[1], -360.0, 360.0)?;
    } else {
        for coordinate in place {
            within("--place", coordinate, -9e15, 9e15)?;
        }
    }
    let airless = args.atmosphere == "none";
    let mut air = atmosphere(if airless { "earth" } else { &args.atmosphere })?;
    air.planet_radius = land.planet_radius;
    let preset = Preset::Named(args.preset.clone().into());
    let format = wgpu::TextureFormat::Rgba32Float;
    let targets = Targets {
        color_format: format,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let (eye, ground) = if let Some(ball) = &ball {
        let place = place.map(f64::to_radians);
        let ground = ball.ground(ball.above(place, 0.0), 0.0).height;
        (ball.above(place, ground + args.eye_height), ground)
    } else {
        let foot = WorldPos::from_metres(DVec3::new(place[0], 0.0, place[1]));
        let ground = land.prepare::<f64>()?.ground(foot, 0.0).height;
        let up = DVec3::new(0.0, ground + args.eye_height, 0.0);
        (foot.moved_by(up), ground)
    };
    // From the frame with x to the east, y up and z to the south: over a ball it is turned.
    let turn = if ball.is_some() {
        let [latitude, longitude] = place.map(f64::to_radians);
        DQuat::from_rotation_y(longitude) * DQuat::from_rotation_x(FRAC_PI_2 - latitude)
    } else {
        DQuat::IDENTITY
    };
    let to_sun = direction(args.sun_height.to_radians(), args.sun_azimuth.to_radians());
    let mut view = View {
        eye,
        sun: Light {
            to_light: (turn * to_sun).as_vec3(),
            irradiance: Vec3::ONE,
            angular_radius: air.sun.angular_radius as f32,
        },
        ..Default::default()
    };
    let (width, height) = (args.size.width, args.size.height);
    view.look(
        args.yaw.to_radians(),
        args.pitch.to_radians(),
        args.fov.to_radians() as f32,
        width as f32 / height as f32,
    );
    view.world_from_view = Mat4::from_quat(turn.as_quat()) * view.world_from_view;
    let radius = land.planet_radius;
    let options = TerrainOptions {
        preset: preset.clone(),
        land,
        far,
        sky_sectors: args.sky_sectors,
        ..Default::default()
    };
    let mut terrain = Terrain::new(device, veduta::programs(), &targets, &options)?;
    let mut sky = if airless {
        None
    } else {
        let options = SkyOptions {
            preset,
            atmosphere: air,
            composition: SkyComposition::OverPicture,
            march: None,
        };
        let over = Targets {
            depth_format: None,
            ..targets
        };
        Some(Sky::new(device, veduta::programs(), &over, &options)?)
    };
    let mut lights = TerrainLights {
        sun: if to_sun.y > 0.0 || ball.is_some() {
            Vec3::ONE
        } else {
            Vec3::ZERO
        },
        sky: Vec3::ZERO,
        bounce: Vec3::ZERO,
    };
    if let Some(sky) = &mut sky {
        let query = SkyQuery::new(device, veduta::programs(), sky.tables().atmosphere())?;
        let (tables, sun) = (
            sky.tables_mut(),
            Light {
                // Over a plane y is up at the eye, as the sky has it.
                to_light: to_sun.as_vec3(),
                ..view.sun
            },
        );
        let albedo = options.land.material.rock_albedo();
        if ball.is_some() {
            let all =
                TerrainLights::by_sun_from_sky(device, queue, &query, tables, &sun, 0.0, albedo)?;
            terrain.set_lights_by_sun(Some(&all))?;
        } else {
            lights = TerrainLights::from_sky(device, queue, &query, tables, &sun, ground, albedo)?;
        }
    }
    let texture = |format| crate::render::picture(device, args.size, format);
    let (picture, shown) = (texture(format), texture(format));
    let depth = texture(wgpu::TextureFormat::Depth32Float);
    let [picture_view, shown_view, depth_view] =
        [&picture, &shown, &depth].map(|t| t.create_view(&Default::default()));
    let finish = |encoder: wgpu::CommandEncoder| -> Result<(), CliError> {
        queue.submit([encoder.finish()]);
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|e| veduta::Error::Device(e.to_string()))?;
        Ok(())
    };
    let now = CpuTime::now;
    let since = |before: Option<CpuTime>| match (before, now()) {
        (Some(before), Some(after)) => after.since(&before),
        _ => f64::NAN,
    };
    let draw = |encoder: &mut wgpu::CommandEncoder, terrain: &Terrain| {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &picture_view,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let _ = terrain.draw_opaque(&mut pass);
    };
    // The first frame bakes everything and compiles; the flight then shows what a frame costs.
    let (mut bakes, mut draws) = (Vec::new(), Vec::new());
    for frame in 0..args.frames {
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = terrain.prepare(queue, &mut encoder, &view, &lights, height)?;
        let before = now();
        finish(encoder)?;
        bakes.push(since(before));
        let mut encoder = device.create_command_encoder(&Default::default());
        draw(&mut encoder, &terrain);
        let before = now();
        finish(encoder)?;
        draws.push(since(before));
        if frame + 1 < args.frames {
            let ahead = turn * direction(0.0, args.yaw.to_radians());
            view.eye = view.eye.moved_by(ahead * (100.0 / 30.0));
        }
    }
    if let Some((first, others)) = bakes.split_first() {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        println!(
            "processor ms a frame: {:.2} drawn, {:.2} baked; the first bake {first:.0}; {} bytes on the device",
            mean(draws.get(1..).unwrap_or_default()),
            mean(others),
            terrain.resources().texture_bytes,
        );
    }
    let mut encoder = device.create_command_encoder(&Default::default());
    let _ = terrain.prepare(queue, &mut encoder, &view, &lights, height)?;
    draw(&mut encoder, &terrain);
    if let Some(sky) = &mut sky {
        sky.set_host(device, &depth_view, Some(&picture_view))?;
        let level = match ball {
            Some(_) => view.levelled(radius),
            None => view,
        };
        let _ = sky.prepare(queue, &mut encoder, &level)?;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &shown_view,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        let _ = sky.composite(&mut pass)?;
    }
    queue.submit([encoder.finish()]);
    let bytes = gpu.read_texture(if airless { &picture } else { &shown })?;
    let rgb: Vec<f32> = bytes
        .chunks_exact(16)
        .flat_map(|p| [0, 4, 8].map(|k| f32::from_le_bytes([p[k], p[k + 1], p[k + 2], p[k + 3]])))
        .collect();
    if exr {
        return write_exr(&args.out, width, height, &rgb);
    }
    let exposure = args.exposure.unwrap_or_else(|| exposure_of(&rgb));
    let shown = Picture::new(width as usize, height as usize, rgb)?.display(exposure);
    write_png(&args.out, width, height, &shown)
}
