//! Layers of clouds under a sky: the sky is drawn first, then the layers from back to front, each lit by the air and behind the air before it. Run it with
//! `cargo run --release --example cloudscape -- picture.ppm fair 300 15 50 120` for the layer `fair` (several with commas between, or files), an eye at 300 m, a view 15 degrees
//! up, and a sun at 50 degrees, 120 degrees to the right of the view; then frames that are drawn before it, width, height, and the speed that the eye flies ahead with meanwhile (m/s at 30
//! frames a second). With `-- sheet.png` alone it draws the sheet of `docs/clouds`.

use veduta::atmosphere::{Eye, Sky, SkyComposition, SkyOptions, SkyQuality, SkyTables};
use veduta::clouds::{AirLights, CloudDeck, CloudLights, Clouds, CloudsOptions, back_to_front};
use veduta::glam::{DVec3, Vec3};
use veduta::{Light, Preset, Settings, Targets, View, WorldPos, wgpu};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// What is seen.
#[derive(Debug, Clone)]
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
    /// Speed of the eye (m/s), at 30 frames a second.
    pub speed: f64,
}

fn deck(name: &str) -> Fallible<CloudDeck> {
    Ok(if name.ends_with(".ron") {
        CloudDeck::read(name.as_ref())?
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
    // The air before the clouds has tables of its own, which a sky behind things does not keep.
    let air = options.atmosphere;
    let settings = Settings::resolve(veduta::programs(), &Preset::High, None, &[])?;
    let quality = SkyQuality::of(&settings);
    let mut tables = SkyTables::new(device, veduta::programs(), &air, &quality)?;

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
            far: if shot.altitude > 50_000.0 {
                5e6
            } else {
                300_000.0
            },
            air: Some(air.clone()),
            ..Default::default()
        };
        let found = AirLights::find(&gpu, &air, &options.deck, to_sun.to_array())?;
        let lights = CloudLights::under(&found, view.sun.irradiance);
        let mut clouds = Clouds::new(device, veduta::programs(), &targets, &options)?;
        clouds.set_air(device, &tables)?;
        layers.push((clouds, lights));
    }
    let decks: Vec<&CloudDeck> = layers.iter().map(|(clouds, _)| clouds.deck()).collect();
    let order = back_to_front(shot.altitude, &decks)?;
    let start = view.eye;
    for frame in 0..shot.frames.max(1) {
        let flown = shot.speed * f64::from(frame) / 30.0;
        view.eye = start.moved_by(DVec3::new(0.0, 0.0, -flown));
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = sky.prepare(queue, &mut encoder, &view)?;
        let eye = Eye {
            altitude: shot.altitude,
            to_sun: to_sun.to_array(),
            sun_angular_radius: f64::from(view.sun.angular_radius),
        };
        let _ = tables.prepare(queue, &mut encoder, &eye)?;
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

/// The host's finish: exposed for a white cloud, rounded off, encoded.
fn finished(pixels: &[u8]) -> Vec<u8> {
    let exposure = 0.4_f32;
    let shown = |c: &[u8]| {
        let x = 1.0 - (-exposure * half(c[0], c[1])).exp();
        (255.0 * x.powf(1.0 / 2.2)).round() as u8
    };
    pixels
        .chunks_exact(8)
        .flat_map(|pixel| [0, 2, 4].map(|k| shown(&pixel[k..k + 2])))
        .collect()
}

/// What the sheet shows, by rows: fair cumulus at noon, stratus from below and from above, towers at sunset; a broken layer from the ground, from 10 km and from orbit, and within a cloud.
const SHEET: [(&str, [f64; 4]); 8] = [
    ("fair", [300.0, 15.0, 70.0, 120.0]),
    ("deck", [300.0, 15.0, 40.0, 60.0]),
    ("deck", [4000.0, -10.0, 40.0, 60.0]),
    ("towers", [300.0, 10.0, 4.0, 40.0]),
    ("thesis", [300.0, 12.0, 30.0, 120.0]),
    ("thesis", [10_000.0, -12.0, 30.0, 120.0]),
    ("thesis", [400_000.0, -35.0, 40.0, 120.0]),
    ("thesis", [4750.0, 0.0, 30.0, 60.0]),
];

/// Draws the sheet, four pictures a row, with 6 bits a channel so that the file is small.
fn sheet(path: &str) -> Fallible<()> {
    let [width, height] = [192_usize, 108];
    let mut rgb = vec![0; 3 * 4 * width * 2 * height];
    for (k, (deck, [altitude, pitch, sun_height, sun_azimuth])) in SHEET.into_iter().enumerate() {
        let shot = Shot {
            decks: vec![deck.to_owned()],
            altitude,
            pitch,
            sun_height,
            sun_azimuth,
            frames: 60,
            speed: 0.0,
        };
        let shown = finished(&draw([width as u32, height as u32], &shot)?);
        for (y, row) in shown.chunks_exact(3 * width).enumerate() {
            let at = 3 * width * (4 * (y + height * (k / 4)) + k % 4);
            for (to, from) in rgb[at..].iter_mut().zip(row) {
                *to = (f32::from(*from) / 255.0 * 63.0).round() as u8 * 4;
            }
        }
    }
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, 4 * width as u32, 2 * height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&rgb)?;
    Ok(())
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [path] = &arguments[..]
        && path.ends_with(".png")
    {
        return sheet(path);
    }
    let number = |at: usize, otherwise: f64| arguments.get(at).map_or(Ok(otherwise), |a| a.parse());
    let names = arguments.get(1).map_or("fair", String::as_str);
    let shot = Shot {
        decks: names.split(',').map(str::to_owned).collect(),
        altitude: number(2, 300.0)?,
        pitch: number(3, 15.0)?,
        sun_height: number(4, 50.0)?,
        sun_azimuth: number(5, 120.0)?,
        frames: number(6, 60.0)? as u32,
        speed: number(9, 0.0)?,
    };
    let size = [number(7, 480.0)? as u32, number(8, 270.0)? as u32];
    let pixels = draw(size, &shot)?;
    let mut text = format!("P6\n{} {}\n255\n", size[0], size[1]).into_bytes();
    text.extend(finished(&pixels));
    let path = arguments.first().map_or("cloudscape.ppm", String::as_str);
    std::fs::write(path, text)?;
    Ok(())
}
