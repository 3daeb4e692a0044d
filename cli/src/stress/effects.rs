//! The landscape at extreme settings and from extreme places: every pixel finite, not negative, not above a bound.

use veduta::device::Gpu;
use veduta::program::KeyKind;
use veduta::{Settings, Value, View};

use super::check::{Check, Fault};
use super::samples::Random;
use crate::bench::truth::{directions, pixel_angle};
use crate::camera::{Camera, EyeHeight};
use crate::catalog::SourceArgs;
use crate::commands::render::{Job, RenderArgs};
use crate::error::CliError;
use crate::render::{Output, Renderer, Size, Tiling};

/// What the pictures were found to be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pictures {
    /// Pictures drawn.
    pub drawn: u64,
    /// Their pixels.
    pub pixels: u64,
    /// Values outside of their domain that were refused with an error.
    pub refused: u64,
    /// The largest radiance as a share of the bound.
    pub share: f64,
    /// What is wrong.
    pub faults: Vec<Fault>,
}

/// Width and height of the pictures.
const SIZE: Size = Size {
    width: 32,
    height: 18,
};

/// Counts that keep a picture of this size cheap.
const CHEAP: [&str; 10] = [
    "MAX_MARCHING_STEPS=80",
    "MAX_MARCHING_STEPS_SHADOW=20",
    "ATMOS_STEPS=8",
    "ATMOS_LIGHT_STEPS=4",
    "CLOUD_STEPS=16",
    "CLOUD_LIGHT_STEPS=4",
    "OCTAVES=6",
    "OCTAVES_SHADOW=4",
    "OCTAVES_NORMAL=6",
    "FILTERING_SAMPLES=2",
];

/// Scenes with flags of their own.
const VARIANTS: [(&str, &[&str]); 4] = [
    ("thesis", &[]),
    (
        "thesis",
        &[
            "CLOUD_SKIP=true",
            "CLOUD_JITTER=true",
            "TEXTURE_FILTERING=true",
            "SMOOTH_RIDGES=true",
        ],
    ),
    ("sky", &["CLOUD_SKIP=true"]),
    ("clear", &["TEXTURE_LOW_QUALITY=true"]),
];

/// Altitudes of the eye [m]: the lowest that is accepted, below the ground, on the sphere, just above it, about the cloud
/// layer's borders, about the end of the air, in orbits, as far as is accepted.
const ALTITUDES: [f64; 18] = [
    -1e4, -100.0, -1e-3, 0.0, 1e-3, 2.0, 500.0, 4000.0, 4750.0, 5500.0, 5501.0, 2e4, 99_999.0, 1e5,
    4e5, 3.6e7, 9.9e7, 1e8,
];

/// Heights of the sun [deg], from the zenith to the nadir.
const SUNS: [f64; 17] = [
    90.0, 89.99, 60.0, 30.0, 10.0, 3.0, 1.0, 0.1, 0.0, -0.1, -1.0, -3.0, -6.0, -18.0, -45.0,
    -89.99, -90.0,
];

/// Pitches of the camera [deg].
const PITCHES: [f64; 9] = [-90.0, -45.0, -10.0, -1.0, 0.0, 1.0, 10.0, 45.0, 90.0];

/// The largest value of Cornette and Shanks' phase function.
fn largest_cornette_shanks(g: f64) -> f64 {
    let g = g.abs();
    3.0 / (4.0 * std::f64::consts::PI) * (1.0 - g * g) / ((2.0 + g * g) * (1.0 - g).powi(3))
}

/// The largest value of Henyey and Greenstein's phase function.
fn largest_henyey_greenstein(g: f64) -> f64 {
    let g = g.abs();
    (1.0 + g) / (4.0 * std::f64::consts::PI * (1.0 - g).powi(2))
}

/// A radiance that nothing exceeds: the sum of what surfaces, the sun's disc, air and clouds can give at most, all at
/// once and without loss.
///
/// - a surface: albedo over pi times the sum of the three lights;
/// - the disc, in pixels that may see it: 1 over its solid angle;
/// - air, before everything and once more before the clouds: what is scattered out of the ray, at most all of it, times
///   the largest value of the phase function. Where the aerosol scatters more than it takes away, what it scatters is at
///   most the ratio of both, and at most the optical depth of scattering along the longest path;
/// - clouds: the share that is scattered, at most all, times albedo and phase function. The march is of first order in a
///   step's optical depth x, so that 1 becomes at most 1 + x.
pub fn radiance_bound(settings: &Settings, view: &View, disc: bool) -> f64 {
    let number = |name: &str| settings.number(name).unwrap_or(0.0);
    let most = |name: &str| match settings.get(name) {
        Some(Value::Vec3(v)) => v.iter().copied().fold(0.0, f64::max),
        _ => 0.0,
    };
    let albedo = ["ROCK_DARK", "ROCK_LIGHT", "SNOW_ALBEDO"].map(most);
    let lights = ["SUN_LIGHT", "SKY_LIGHT", "BOUNCE_LIGHT"].map(most);
    let surface = albedo.iter().copied().fold(0.0, f64::max) * lights.iter().sum::<f64>()
        / std::f64::consts::PI;
    let disc = if disc {
        1.0 / (std::f64::consts::PI * f64::from(view.sun.angular_radius).powi(2))
    } else {
        0.0
    };
    let path = 2.0 * (number("PLANET_RADIUS") + number("ATMOSPHERE_HEIGHT"));
    let (scattering, extinction) = (number("MIE_SCATTERING"), number("MIE_EXTINCTION"));
    let excess = (scattering / extinction.max(1e-30))
        .min(scattering * path)
        .max(1.0);
    let air =
        3.0 / (8.0 * std::f64::consts::PI) + excess * largest_cornette_shanks(number("MIE_G"));
    let depth = number("CLOUD_DENSITY") * (number("CLOUD_SCATTERING") + number("CLOUD_ABSORPTION"));
    let step = number("MAX_CLOUD_DISTANCE") / number("CLOUD_STEPS").max(1.0);
    let lobe = largest_henyey_greenstein(number("CLOUD_G_FORWARD"))
        .max(largest_henyey_greenstein(number("CLOUD_G_BACKWARD")));
    let clouds = if settings.features().contains(&"CLOUDS") {
        (1.0 + depth * step) * lobe
    } else {
        0.0
    };
    f64::from(view.sun.irradiance.max_element()) * (surface + disc + 2.0 * air + clouds) * 1.001
}

/// One scene with its renderer.
struct Stage {
    job: Job,
    renderer: Renderer,
    found: Pictures,
}

impl Stage {
    fn new(
        gpu: &Gpu,
        sources: &SourceArgs,
        scene: &str,
        flags: &[&str],
    ) -> Result<Stage, CliError> {
        let sets = CHEAP.iter().chain(flags).map(|s| (*s).to_owned()).collect();
        let job = Job::new(&RenderArgs {
            scene: scene.to_owned(),
            preset: Some("thesis".to_owned()),
            sets,
            sources: sources.clone(),
            ..RenderArgs::default()
        })?;
        let renderer = Renderer::new(gpu, job.catalog.set(), &job.options, SIZE, Output::Linear)?;
        Ok(Stage {
            job,
            renderer,
            found: Pictures::default(),
        })
    }

    fn fault(&mut self, check: Check, what: String) {
        if self
            .found
            .faults
            .iter()
            .filter(|f| f.check == check)
            .count()
            < 5
        {
            self.found.faults.push(Fault {
                subject: format!("picture of {}", self.job.options.scene),
                check,
                what,
            });
        }
    }

    /// Draws a picture and checks its pixels.
    fn picture(&mut self, camera: &Camera, values: &[(String, Value)]) -> Result<(), CliError> {
        for (name, value) in values {
            self.renderer.set_content(name, *value)?;
        }
        let settings = self.renderer.settings().clone();
        let set = self.job.catalog.set();
        let view = match camera.view(set, &settings, 0.0, SIZE.aspect()) {
            Ok(view) => view,
            // A terrain higher than the highest eye, say.
            Err(CliError::Argument { .. }) => {
                self.found.refused += 1;
                return self.reset(values);
            }
            Err(error) => return Err(error),
        };
        match self.renderer.draw(&view, Tiling::Fixed(16), &mut |_| {}) {
            Ok(_) => {}
            // An eye near the centre of a small planet.
            Err(CliError::Veduta(veduta::Error::OutOfDomain { .. })) => {
                self.found.refused += 1;
                return self.reset(values);
            }
            Err(error) => return Err(error),
        }
        let rgba = self.renderer.read_rgba32()?;
        // The disc itself and the pixels that it reaches into, as wide as the widest pixel may be seen.
        let reach = f64::from(view.sun.angular_radius) + 4.0 * pixel_angle(&view, SIZE);
        let to_sun = view.sun.to_light.as_dvec3().normalize().to_array();
        let [plain, sunny] =
            [false, true].map(|disc| radiance_bound(&settings, &view, disc).max(1.0));
        let bounds: Vec<f64> = directions(&view, SIZE)?
            .iter()
            .map(|dir| {
                let cosine = dir.iter().zip(to_sun).map(|(a, b)| a * b).sum::<f64>();
                if cosine >= reach.cos() { sunny } else { plain }
            })
            .collect();
        self.found.drawn += 1;
        let case = |i: usize, value: f32| {
            let values: Vec<String> = values.iter().map(|(k, v)| format!("{k}={v}")).collect();
            format!(
                "{value:?} at pixel ({}, {}), flags {}, eye {:?}, yaw {}, pitch {}, sun {}, {}",
                i / 4 % SIZE.width as usize,
                i / 4 / SIZE.width as usize,
                settings.features().join(" "),
                camera.height,
                camera.yaw,
                camera.pitch,
                camera.sun_height,
                values.join(" ")
            )
        };
        self.found.pixels += rgba.len() as u64 / 4;
        let bad = rgba.iter().position(|v| !v.is_finite());
        let negative = rgba.iter().position(|v| *v < 0.0);
        let bright = rgba
            .iter()
            .zip(0..)
            .position(|(v, i): (&f32, usize)| v.is_finite() && f64::from(*v) > bounds[i / 4]);
        for (v, i) in rgba.iter().zip(0..) {
            // The alpha channel is 1.
            if v.is_finite() && i % 4 < 3 {
                self.found.share = self.found.share.max(f64::from(*v) / bounds[i / 4]);
            }
        }
        if let Some(i) = bad {
            let count = rgba.iter().filter(|v| !v.is_finite()).count();
            self.fault(
                Check::Finite,
                format!("{count} numbers, {}", case(i, rgba[i])),
            );
        }
        if let Some(i) = negative {
            self.fault(Check::Range, case(i, rgba[i]));
        }
        if let Some(i) = bright {
            self.fault(
                Check::Energy,
                format!("above {:e}: {}", bounds[i / 4], case(i, rgba[i])),
            );
        }
        self.reset(values)
    }

    /// Gives content keys the job's values again.
    fn reset(&mut self, values: &[(String, Value)]) -> Result<(), CliError> {
        for (name, _) in values {
            if let Some(value) = self.job.settings.get(name) {
                self.renderer.set_content(name, value)?;
            }
        }
        Ok(())
    }

    /// A value that must be refused.
    fn refuses(&mut self, name: &str, value: Value) {
        if self.renderer.set_content(name, value).is_ok() {
            self.fault(Check::Outside, format!("{name}={value} is accepted"));
        } else {
            self.found.refused += 1;
        }
    }
}

/// A content key's value at an end of its domain.
fn extreme(ty: &str, value: f64) -> Value {
    match ty {
        "vec3" => Value::Vec3([value; 3]),
        "u32" | "i32" => Value::Int(value as i64),
        _ => Value::Float(value),
    }
}

/// Draws every case; `quick` draws a part of the views and fewer combinations.
///
/// # Errors
/// Faults of composing and of the device. What pictures show stands in the answer.
pub fn check(
    gpu: &Gpu,
    sources: &SourceArgs,
    quick: bool,
    progress: &dyn Fn(&str),
) -> Result<Pictures, CliError> {
    let mut all = Pictures::default();
    for (variant, (scene, flags)) in VARIANTS.iter().enumerate() {
        progress(&format!("pictures of {scene}"));
        let mut stage = Stage::new(gpu, sources, scene, flags)?;
        let mut random = Random(variant as u64);
        let keys: Vec<(String, String, (f64, f64))> = stage
            .job
            .catalog
            .set()
            .keys
            .iter()
            .filter(|k| k.kind == KeyKind::Content)
            .filter_map(|k| Some((k.name.to_string(), k.ty.to_string(), k.domain?)))
            .collect();
        let at = |height: EyeHeight, pitch: f64, sun: f64, towards_sun: bool| Camera {
            x: 13_500.0,
            z: -14_700.0,
            height,
            yaw: 30.0,
            pitch,
            field_of_view: 60.0,
            sun_height: sun,
            sun_azimuth: if towards_sun { 0.0 } else { 120.0 },
        };
        let camera = |altitude: f64, pitch: f64, sun: f64, towards_sun: bool| {
            at(EyeHeight::Altitude(altitude), pitch, sun, towards_sun)
        };
        // On the ground, under it and a millimetre above.
        for above in [0.0, -0.5, 1e-3] {
            for (k, pitch) in [-90.0, -5.0, 0.0, 30.0].into_iter().enumerate() {
                let sun = SUNS[(5 * k + variant) % SUNS.len()];
                stage.picture(
                    &at(EyeHeight::AboveGround(above), pitch, sun, k % 2 == 0),
                    &[],
                )?;
            }
        }
        // Views: all of them, or a part that changes from variant to variant.
        let mut index = variant;
        for altitude in ALTITUDES {
            for sun in SUNS {
                for pitch in PITCHES.into_iter().chain([sun]) {
                    index += 1;
                    if !quick || index.is_multiple_of(29) {
                        stage
                            .picture(&camera(altitude, pitch, sun, index.is_multiple_of(2)), &[])?;
                    }
                }
            }
        }
        // Keys one at a time, then several together.
        let places = [(300.0, 5.0, 30.0), (4750.0, 0.0, 1.0), (4e5, -60.0, -3.0)];
        for (k, (name, ty, (lo, hi))) in keys.iter().enumerate() {
            for end in [*lo, *hi] {
                for (p, (altitude, pitch, sun)) in places.iter().enumerate() {
                    if !quick || p == (k + variant) % places.len() {
                        let values = [(name.clone(), extreme(ty, end))];
                        stage.picture(&camera(*altitude, *pitch, *sun, p == 0), &values)?;
                    }
                }
            }
            let wrong = match ty.as_str() {
                "vec3" => vec![Value::Vec3([f64::NAN; 3]), Value::Vec3([hi * 2.0 + 1.0; 3])],
                "u32" | "i32" => vec![Value::Int(*hi as i64 + 1), Value::Int(*lo as i64 - 1)],
                _ => vec![
                    Value::Float(f64::NAN),
                    Value::Float(f64::INFINITY),
                    Value::Float(hi + hi.abs() * 1e-6 + 1e-6),
                    Value::Float(lo - lo.abs() * 1e-6 - 1e-6),
                ],
            };
            for value in wrong {
                stage.refuses(name, value);
            }
        }
        for _ in 0..if quick { 30 } else { 600 } {
            let mut values = Vec::new();
            for (name, ty, (lo, hi)) in &keys {
                match random.below(8) {
                    0 => values.push((name.clone(), extreme(ty, *lo))),
                    1 => values.push((name.clone(), extreme(ty, *hi))),
                    _ => {}
                }
            }
            let altitude = ALTITUDES[random.below(ALTITUDES.len())];
            let (pitch, sun) = (PITCHES[random.below(9)], SUNS[random.below(SUNS.len())]);
            stage.picture(&camera(altitude, pitch, sun, random.below(2) == 0), &values)?;
        }
        // Eyes that are refused.
        for altitude in [-10_001.0, 1.001e8, f64::NAN, f64::INFINITY] {
            let set = stage.job.catalog.set();
            let view = camera(altitude, 0.0, 30.0, true).view(
                set,
                &stage.job.settings,
                0.0,
                SIZE.aspect(),
            );
            match view {
                Err(CliError::Argument { .. }) => stage.found.refused += 1,
                _ => stage.fault(
                    Check::Outside,
                    format!("an eye at {altitude} m is accepted"),
                ),
            }
        }
        all.drawn += stage.found.drawn;
        all.pixels += stage.found.pixels;
        all.refused += stage.found.refused;
        all.share = all.share.max(stage.found.share);
        all.faults.append(&mut stage.found.faults);
    }
    Ok(all)
}
