//! `veduta sky`: pictures of an atmosphere from any altitude, one for each height of the sun.

use std::path::PathBuf;

use veduta::atmosphere::{Sky, SkyComposition, SkyOptions};
use veduta::glam::{DVec3, Vec3};
use veduta::view::direction;
use veduta::{Light, Preset, Targets, View, WorldPos};

use super::probe::atmosphere;
use crate::error::CliError;
use crate::image::{check_folder, check_output, write_exr, write_png};
use crate::metrics::Picture;
use crate::render::{Size, picture};

/// Arguments of `veduta sky`.
#[derive(Debug, Clone, clap::Args)]
pub struct SkyArgs {
    /// A shipped atmosphere or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// The preset of the tables
    #[arg(long, value_name = "NAME", default_value = "high")]
    pub preset: String,
    /// Altitude of the eye in metres, 0 to 1e9
    #[arg(long, default_value_t = 2.0, allow_negative_numbers = true)]
    pub altitude: f64,
    /// Heights of the sun above the horizon in degrees, divided by commas: a picture each, side by side
    #[arg(
        long,
        value_name = "DEGREES",
        value_delimiter = ',',
        default_value = "30",
        allow_hyphen_values = true
    )]
    pub sun_height: Vec<f64>,
    /// A day from midnight to midnight in so many pictures, 2 to 1440, instead of heights: the sun moves as at --latitude and --declination. With
    /// `%d` in --out a file each, numbered from 0
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["sun_height", "sun_azimuth"])]
    pub day: Option<u32>,
    /// Latitude of the day in degrees
    #[arg(long, default_value_t = 45.0, allow_negative_numbers = true)]
    pub latitude: f64,
    /// Declination of the sun on that day in degrees, -23.45 to 23.45 on Earth
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub declination: f64,
    /// Azimuth of the sun in degrees, clockwise from -z
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub sun_azimuth: f64,
    /// Direction of the view in degrees, clockwise from -z
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub yaw: f64,
    /// Elevation of the view in degrees
    #[arg(long, default_value_t = 15.0, allow_negative_numbers = true)]
    pub pitch: f64,
    /// Vertical field of view in degrees, 0.01 to 170
    #[arg(long, default_value_t = 60.0)]
    pub fov: f64,
    /// Width and height of each picture in pixels
    #[arg(long, value_name = "WxH", default_value = "256x144")]
    pub size: Size,
    /// Factor on radiance before the tone map; when left out that of the brightest picture is found, and darker ones follow it with the power 0.8 of how much darker they are
    #[arg(long)]
    pub exposure: Option<f64>,
    /// The picture, .png or .exr (radiance for a sun of irradiance 1, not exposed)
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Height and azimuth of the sun in degrees, clockwise from -z that is north, at an hour angle from noon in radians.
fn sun_of_day(latitude: f64, declination: f64, hour: f64) -> [f64; 2] {
    let (latitude, declination) = (latitude.to_radians(), declination.to_radians());
    let up = latitude.sin() * declination.sin() + latitude.cos() * declination.cos() * hour.cos();
    let north =
        latitude.cos() * declination.sin() - latitude.sin() * declination.cos() * hour.cos();
    let east = -declination.cos() * hour.sin();
    [
        up.clamp(-1.0, 1.0).asin().to_degrees(),
        east.atan2(north).to_degrees(),
    ]
}

/// The exposure with which a bright part of the picture (the 80th centile of the brightest channel) is shown at a displayed 0.75.
pub(crate) fn exposure_of(rgb: &[f32]) -> f64 {
    let mut brightest: Vec<f32> = rgb
        .chunks_exact(3)
        .map(|p| p[0].max(p[1]).max(p[2]))
        .filter(|v| *v > 0.0)
        .collect();
    if brightest.is_empty() {
        return 1.0;
    }
    brightest.sort_by(f32::total_cmp);
    let bright = brightest[(brightest.len() - 1) * 8 / 10];
    // 1 - exp(-x) is about 0.52 in linear light, which is displayed at 0.75. Night stays night: what the last twilight leaves is not lit up.
    (0.74 / f64::from(bright.max(1e-20))).min(1e8)
}

/// Exposures of pictures that belong together: the brightest has its own, and a darker one follows with the power 0.8 of how much darker it is, so that noon, dusk and night
/// keep their order and no exposure jumps from one frame of a day to the next.
fn exposures_of(pictures: &[Vec<f32>]) -> Vec<f64> {
    let own: Vec<f64> = pictures.iter().map(|rgb| exposure_of(rgb)).collect();
    let least = own.iter().copied().fold(f64::INFINITY, f64::min);
    own.iter()
        .map(|own| least * (own / least).powf(0.8))
        .collect()
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for arguments out of their domains and files that cannot be written; what the library reports.
pub fn run(args: &SkyArgs) -> Result<(), CliError> {
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
    within("--altitude", args.altitude, 0.0, 1e9)?;
    within("--fov", args.fov, 0.01, 170.0)?;
    within("--pitch", args.pitch, -90.0, 90.0)?;
    within("--yaw", args.yaw, -360.0, 360.0)?;
    within("--sun-azimuth", args.sun_azimuth, -360.0, 360.0)?;
    for height in &args.sun_height {
        within("--sun-height", *height, -90.0, 90.0)?;
    }
    if let Some(exposure) = args.exposure {
        within("--exposure", exposure, 0.0, 1e12)?;
    }
    within("--latitude", args.latitude, -90.0, 90.0)?;
    within("--declination", args.declination, -90.0, 90.0)?;
    let suns: Vec<[f64; 2]> = match args.day {
        Some(count) => {
            within("--day", f64::from(count), 2.0, 1440.0)?;
            (0..count)
                .map(|k| {
                    let hour = std::f64::consts::TAU * (f64::from(k) / f64::from(count) - 0.5);
                    sun_of_day(args.latitude, args.declination, hour)
                })
                .collect()
        }
        None => args
            .sun_height
            .iter()
            .map(|height| [*height, args.sun_azimuth])
            .collect(),
    };
    let gpu = veduta::device::shared()?;
    let options = SkyOptions {
        preset: Preset::Named(args.preset.clone().into()),
        atmosphere: atmosphere(&args.atmosphere)?,
        composition: SkyComposition::Background,
        march: None,
    };
    let format = veduta::wgpu::TextureFormat::Rgba32Float;
    let targets = Targets {
        color_format: format,
        ..Default::default()
    };
    let mut sky = Sky::new(&gpu.device, veduta::programs(), &targets, &options)?;
    let (width, height) = (args.size.width, args.size.height);
    let texture = picture(&gpu.device, args.size, format);
    let target = texture.create_view(&Default::default());
    let mut pictures = Vec::new();
    for [sun_height, sun_azimuth] in suns {
        let to_sun = direction(sun_height.to_radians(), sun_azimuth.to_radians());
        let mut view = View {
            eye: WorldPos::from_metres(DVec3::new(0.0, args.altitude, 0.0)),
            sun: Light {
                to_light: to_sun.as_vec3(),
                irradiance: Vec3::ONE,
                angular_radius: options.atmosphere.sun.angular_radius as f32,
            },
            ..Default::default()
        };
        view.look(
            args.yaw.to_radians(),
            args.pitch.to_radians(),
            args.fov.to_radians() as f32,
            width as f32 / height as f32,
        );
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = sky.prepare(&gpu.queue, &mut encoder, &view)?;
        {
            let mut pass = encoder.begin_render_pass(&veduta::wgpu::RenderPassDescriptor {
                color_attachments: &[Some(veduta::wgpu::RenderPassColorAttachment {
                    view: &target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Default::default(),
                })],
                ..Default::default()
            });
            let _ = sky.composite(&mut pass)?;
        }
        gpu.queue.submit([encoder.finish()]);
        let bytes = gpu.read_texture(&texture)?;
        let rgb: Vec<f32> = bytes
            .chunks_exact(16)
            .flat_map(|p| {
                [0, 4, 8].map(|k| f32::from_le_bytes([p[k], p[k + 1], p[k + 2], p[k + 3]]))
            })
            .collect();
        pictures.push(rgb);
    }
    let (w, h) = (width as usize, height as usize);
    let exposures = match args.exposure {
        Some(exposure) => vec![exposure; pictures.len()],
        None => exposures_of(&pictures),
    };
    let shown = |(rgb, exposure): (Vec<f32>, f64)| {
        Ok::<_, CliError>(Picture::new(w, h, rgb)?.display(exposure))
    };
    let name = args.out.to_string_lossy().into_owned();
    if args.day.is_some() && name.contains("%d") {
        let digits = (pictures.len() - 1).to_string().len();
        for (k, (rgb, exposure)) in pictures.into_iter().zip(exposures).enumerate() {
            let file = PathBuf::from(name.replace("%d", &format!("{k:0digits$}")));
            if exr {
                write_exr(&file, width, height, &rgb)?;
            } else {
                write_png(&file, width, height, &shown((rgb, exposure))?)?;
            }
        }
        return Ok(());
    }
    let count = pictures.len() as u32;
    if exr {
        return write_exr(&args.out, width * count, height, &beside(&pictures, w, h));
    }
    let shown = pictures
        .into_iter()
        .zip(exposures)
        .map(shown)
        .collect::<Result<Vec<Vec<u8>>, CliError>>()?;
    write_png(&args.out, width * count, height, &beside(&shown, w, h))
}

/// Pictures of one size side by side.
fn beside<T: Copy>(pictures: &[Vec<T>], width: usize, height: usize) -> Vec<T> {
    (0..height)
        .flat_map(|y| {
            pictures
                .iter()
                .map(move |p| &p[3 * width * y..3 * width * (y + 1)])
        })
        .flatten()
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{exposures_of, sun_of_day};

    #[test]
    fn darker_pictures_stay_darker() {
        let pictures = [[1.0_f32; 12], [0.1; 12], [0.1; 12]].map(|p| p.to_vec());
        let found = exposures_of(&pictures);
        assert_eq!(found[1], found[2]);
        let shown = [found[0], 0.1 * found[1]];
        assert!((shown[1] / shown[0] - 0.1_f64.powf(0.2)).abs() < 1e-6);
    }

    #[test]
    fn the_sun_of_a_day_stands_where_spherical_triangles_say() {
        // Noon in the south at 90 - latitude + declination; midnight in the north below the horizon.
        let [height, azimuth] = sun_of_day(45.0, 20.0, 0.0);
        assert!((height - 65.0).abs() < 1e-9 && (azimuth.abs() - 180.0).abs() < 1e-9);
        let [height, azimuth] = sun_of_day(45.0, 20.0, std::f64::consts::PI);
        assert!((height + 25.0).abs() < 1e-9 && azimuth.abs() < 1e-9);
        // On an equinox it rises in the east six hours before noon.
        let [height, azimuth] = sun_of_day(50.0, 0.0, -std::f64::consts::FRAC_PI_2);
        assert!(height.abs() < 1e-9 && (azimuth - 90.0).abs() < 1e-9);
    }
}
