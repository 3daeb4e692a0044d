//! Layers of clouds under a sky: the sky is drawn first, then the layers from back to front, each lit by the air. Run it with
//! `cargo run --release --example cloudscape -- picture.ppm fair 300 15 50 120` for the layer `fair` (several with commas between, or files), an eye at 300 m, a view 15 degrees
//! up, and a sun at 50 degrees, 120 degrees to the right of the view.

use veduta::atmosphere::{Sky, SkyComposition, SkyOptions};
use veduta::clouds::{AirLights, CloudDeck, CloudLights, Clouds, CloudsOptions, back_to_front};
use veduta::glam::{DVec3, Vec3};
use veduta::{Light, Targets, View, WorldPos, wgpu};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// What is seen.
pub struct Shot {
    /// Names of shipped layers, or files.
    pub decks: Vec<String>,
    /// Altitude of the eye (m).
    pub altitude: f64,
    /// Elevation of the view (degrees).
    pub pitch: f64,
    /// Height of the sun (degrees).
    pub sun_height: f64,
    /// Azimuth of the sun from the view, to the right (degrees).
    pub sun_azimuth: f64,
    /// Frames that are drawn before the picture, in which tiles and light come to rest.
    pub frames: u32,
}

fn deck(name: &str) -> Fallible<CloudDeck> {
    Ok(if name.ends_with(".ron") {
        CloudDeck::from_ron(&std::fs::read_to_string(name)?)?
    } else {
        CloudDeck::named(name)?
    })
}

/// Draws the last of the frames and returns its scene radiance: red, green, blue and alpha as 16-bit floats, row by row.
pub fn draw(size: [u32; 2], shot: &Shot) -> Fallible<Vec<u8>> {
    let gpu = pollster::block_on(veduta::device::Gpu::open())?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let picture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size[0],
            height: size[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        depth_format: None,
        ..Default::default()
    };
    let options = SkyOptions {
        composition: SkyComposition::Background,
        ..Default::default()
    };
    let mut sky = Sky::new(device, veduta::programs(), &targets, &options)?;

    let to_sun =
        veduta::view::direction(shot.sun_height.to_radians(), shot.sun_azimuth.to_radians());
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(0.0, shot.altitude, 0.0)),
        sun: Light {
            to_light: to_sun.as_vec3(),
            irradiance: Vec3::splat(10.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let aspect = size[0] as f32 / size[1] as f32;
    view.look(0.0, shot.pitch.to_radians(), 1.0, aspect);

    // Each layer with its lights: the sun behind the air, the sky above, sky and ground below.
    let mut layers = Vec::new();
    for name in &shot.decks {
        let options = CloudsOptions {
            deck: deck(name)?,
            far: 300_000.0,
            ..Default::default()
        };
        let air = AirLights::find(&gpu, &Default::default(), &options.deck, to_sun.to_array())?;
        let lights = CloudLights::under(&air, view.sun.irradiance);
        layers.push((
            Clouds::new(device, veduta::programs(), &targets, &options)?,
            lights,
        ));
    }
    let decks: Vec<&CloudDeck> = layers.iter().map(|(clouds, _)| clouds.deck()).collect();
    let order = back_to_front(shot.altitude, &decks)?;
    for _ in 0..shot.frames.max(1) {
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = sky.prepare(queue, &mut encoder, &view)?;
        for (clouds, lights) in &mut layers {
            let _ = clouds.prepare(queue, &mut encoder, &view, lights)?;
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &picture.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        let _ = sky.composite(&mut pass)?;
        for layer in &order {
            let _ = layers[*layer].0.composite(&mut pass)?;
        }
        drop(pass);
        queue.submit([encoder.finish()]);
    }
    Ok(gpu.read_texture(&picture)?)
}

/// A 16-bit float that is finite and not negative.
fn half(low: u8, high: u8) -> f32 {
    let bits = u16::from_le_bytes([low, high]);
    let (exponent, rest) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    if exponent == 0 {
        rest * 2.0_f32.powi(-24)
    } else {
        (1.0 + rest / 1024.0) * 2.0_f32.powi(exponent - 15)
    }
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, otherwise: f64| arguments.get(at).map_or(Ok(otherwise), |a| a.parse());
    let names = arguments.get(1).map_or("fair", String::as_str);
    let shot = Shot {
        decks: names.split(',').map(str::to_owned).collect(),
        altitude: number(2, 300.0)?,
        pitch: number(3, 15.0)?,
        sun_height: number(4, 50.0)?,
        sun_azimuth: number(5, 120.0)?,
        frames: number(6, 60.0)? as u32,
    };
    let size = [number(7, 480.0)? as u32, number(8, 270.0)? as u32];
    let pixels = draw(size, &shot)?;
    // The host's finish: exposed for a white cloud, rounded off, encoded.
    let exposure = 0.4_f32;
    let mut text = format!("P6\n{} {}\n255\n", size[0], size[1]).into_bytes();
    for pixel in pixels.chunks_exact(8) {
        for c in pixel.chunks_exact(2).take(3) {
            let x = exposure * half(c[0], c[1]);
            let shown = 1.0 - (-x).exp();
            text.push((255.0 * shown.powf(1.0 / 2.2)).round() as u8);
        }
    }
    let path = arguments.first().map_or("cloudscape.ppm", String::as_str);
    std::fs::write(path, text)?;
    Ok(())
}
