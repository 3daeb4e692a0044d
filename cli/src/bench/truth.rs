//! What an effect's pixels should be by the f64 references, which share nothing with the shaders but the formulas.

use veduta::reference::atmosphere::Atmosphere;
use veduta::reference::clouds::{CloudLayer, cloud_density};
use veduta::reference::parallel::parallel_map;
use veduta::reference::planet::{ground_distance, segment_length, shell_segment};
use veduta::reference::sky::{Sky, SkyRay};
use veduta::reference::volume::{Region, Volume, VolumeRay};
use veduta::{Settings, Value, View, glam};

use super::Bench;
use super::knob::Effect;
use crate::commands::render::Job;
use crate::error::CliError;
use crate::metrics::Picture;
use crate::render::Size;

/// Pixels and their radiance in f64.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// What it is, in words.
    pub what: &'static str,
    /// Places in the picture, row by row from the top.
    pub pixels: Vec<usize>,
    /// Radiance of the three channels, for the sun of the view.
    pub radiance: Vec<[f64; 3]>,
    /// Root of the mean square of the estimated errors over that of the radiance.
    pub uncertainty: f64,
}

/// A ray and the pixel that it belongs to.
#[derive(Debug, Clone, Copy)]
struct PixelRay {
    pixel: usize,
    dir: [f64; 3],
}

impl Effect {
    /// Flags under which the picture holds this effect alone, as the reference computes it; `None` where there is none.
    pub fn alone(self) -> Option<&'static [(&'static str, Value)]> {
        match self {
            // Its scene's plan leaves the clouds out already.
            Effect::Atmosphere => Some(&[]),
            Effect::Clouds => Some(&[("ATMOSPHERE", Value::Flag(false))]),
            Effect::Terrain | Effect::Textures | Effect::All => None,
        }
    }
}

impl Truth {
    /// Computes pixels of a job that draws the effect alone, spread evenly over those whose rays meet neither
    /// the ground nor the sun's disc and, for clouds, cross the layer. `None` for effects without an f64 reference and for
    /// pictures without such a pixel.
    ///
    /// # Errors
    /// As [`Job::view`].
    pub fn of(bench: &Bench, effect: Effect, job: &Job) -> Result<Option<Truth>, CliError> {
        let count = match effect {
            Effect::Atmosphere => 256,
            Effect::Clouds => 64,
            Effect::Terrain | Effect::Textures | Effect::All => return Ok(None),
        };
        let view = job.view(0.0, bench.size)?;
        let settings = &job.settings;
        let eye_altitude = view.eye.altitude();
        let to_sun = wide(view.sun.to_light.normalize());
        let radius = number(settings, "PLANET_RADIUS");
        let (bottom, thickness) = (
            number(settings, "CLOUDS_HEIGHT"),
            number(settings, "CLOUDS_THICKNESS"),
        );
        let rays: Vec<PixelRay> = rays(&view, bench.size)?
            .into_iter()
            .filter(|r| {
                let disc =
                    f64::from(view.sun.angular_radius) + 2.0 * pixel_angle(&view, bench.size);
                let sun = r.dir.iter().zip(to_sun).map(|(a, b)| a * b).sum::<f64>();
                let crosses = || {
                    let segment =
                        shell_segment(radius, bottom, bottom + thickness, eye_altitude, r.dir[1]);
                    segment_length(segment) > 0.0
                };
                ground_distance(radius, eye_altitude.max(0.0), r.dir[1]) < 0.0
                    && sun.clamp(-1.0, 1.0).acos() > disc
                    && (effect == Effect::Atmosphere || crosses())
            })
            .collect();
        if rays.is_empty() {
            return Ok(None);
        }
        let step = (rays.len() as f64 / count as f64).max(1.0);
        let chosen: Vec<PixelRay> = (0..count.min(rays.len()))
            .map(|k| rays[((k as f64 + 0.5) * step) as usize % rays.len()])
            .collect();
        let irradiance = wide(view.sun.irradiance);
        let found: Vec<([f64; 3], [f64; 3])> = if effect == Effect::Atmosphere {
            let sky = Sky::new(&air(settings).into())?;
            parallel_map(chosen.len(), |k| {
                let light = sky.single_scatter(
                    &SkyRay {
                        eye_altitude,
                        dir: chosen[k].dir,
                        to_sun,
                        distance: f64::INFINITY,
                    },
                    1e-9,
                );
                (light.in_scatter, light.error)
            })
        } else {
            let layer = clouds(settings, &view)?;
            let region = Region::Shell {
                ground_radius: radius,
                bottom,
                top: bottom + thickness,
            };
            let volume = Volume {
                region,
                density: |p: [f64; 3]| {
                    // A rounding may lift a point out of the layer that the quadrature has put on its border.
                    let altitude = region.altitude(p).clamp(bottom, bottom + thickness);
                    cloud_density(&layer, p, altitude)
                },
                max_density: 1.0,
                extinction: layer.extinction,
                albedo: layer.albedo,
                g_forward: layer.g_forward,
                g_backward: layer.g_backward,
                backward_share: layer.backward_share,
            };
            parallel_map(chosen.len(), |k| {
                let ray = VolumeRay {
                    origin: [0.0, eye_altitude, 0.0],
                    dir: chosen[k].dir,
                    to_sun,
                    distance: number(settings, "MAX_CLOUD_DISTANCE"),
                };
                // Twice as many panels tell the error of half as many. (To settle each panel of a fractal takes minutes a ray.)
                let [half, light] =
                    [64, 128].map(|panels| volume.single_scatter_composite(&ray, panels, 3, 2e-3));
                ([light.scatter; 3], [light.scatter - half.scatter; 3])
            })
        };
        let square = |list: &mut dyn Iterator<Item = f64>| list.map(|v| v * v).sum::<f64>();
        let size = square(&mut found.iter().flat_map(|f| f.0));
        let error = square(&mut found.iter().flat_map(|f| f.1));
        Ok(Some(Truth {
            what: if effect == Effect::Atmosphere {
                "light scattered once by the air, adaptive Gauss-Kronrod quadrature in f64"
            } else {
                "light scattered once by the clouds without air, 384 Gauss points a ray and adaptive depths to the sun in f64"
            },
            pixels: chosen.iter().map(|r| r.pixel).collect(),
            radiance: found
                .iter()
                .map(|f| [0, 1, 2].map(|k| f.0[k] * irradiance[k]))
                .collect(),
            uncertainty: if size > 0.0 {
                (error / size).sqrt()
            } else {
                0.0
            },
        }))
    }

    /// Relative root mean square error of a picture at the truth's pixels.
    pub fn relative_rmse(&self, picture: &Picture) -> f64 {
        let (mut error, mut size) = (0.0, 0.0);
        for (pixel, radiance) in self.pixels.iter().zip(&self.radiance) {
            for (k, true_value) in radiance.iter().enumerate() {
                let drawn = picture.rgb.get(3 * pixel + k).copied().unwrap_or(f32::NAN);
                error += (f64::from(drawn) - true_value).powi(2);
                size += true_value * true_value;
            }
        }
        (error / size).sqrt()
    }
}

fn number(settings: &Settings, key: &str) -> f64 {
    settings.number(key).unwrap_or(0.0)
}

fn wide(v: glam::Vec3) -> [f64; 3] {
    v.as_dvec3().to_array()
}

/// Unit vectors through the middles of all pixels, row by row from the top.
///
/// # Errors
/// As [`View::rays`].
pub fn directions(view: &View, size: Size) -> Result<Vec<[f64; 3]>, CliError> {
    Ok(rays(view, size)?.into_iter().map(|r| r.dir).collect())
}

fn rays(view: &View, size: Size) -> Result<Vec<PixelRay>, CliError> {
    let [middle, right, up] = view.rays()?.map(|r| r.as_dvec3());
    let mut list = Vec::new();
    for y in 0..size.height {
        for x in 0..size.width {
            let clip_x = (f64::from(x) + 0.5) / f64::from(size.width) * 2.0 - 1.0;
            let clip_y = 1.0 - (f64::from(y) + 0.5) / f64::from(size.height) * 2.0;
            list.push(PixelRay {
                pixel: (y * size.width + x) as usize,
                dir: (middle + clip_x * right + clip_y * up)
                    .normalize()
                    .to_array(),
            });
        }
    }
    Ok(list)
}

/// About the angle that a pixel in the middle spans, in radians.
pub fn pixel_angle(view: &View, size: Size) -> f64 {
    view.rays().map_or(0.0, |[middle, right, _]| {
        f64::from(right.length() / middle.length()) * 2.0 / f64::from(size.width)
    })
}

fn air(settings: &Settings) -> Atmosphere {
    let rayleigh = match settings.get("RAYLEIGH_SCATTERING") {
        Some(Value::Vec3(v)) => v,
        _ => [0.0; 3],
    };
    Atmosphere {
        ground_radius: number(settings, "PLANET_RADIUS"),
        top: number(settings, "ATMOSPHERE_HEIGHT"),
        rayleigh_scattering: rayleigh,
        rayleigh_height: number(settings, "RAYLEIGH_HEIGHT"),
        mie_scattering: number(settings, "MIE_SCATTERING"),
        mie_extinction: number(settings, "MIE_EXTINCTION"),
        mie_height: number(settings, "MIE_HEIGHT"),
        mie_g: number(settings, "MIE_G"),
    }
}

fn clouds(settings: &Settings, view: &View) -> Result<CloudLayer, CliError> {
    let wavelength = number(settings, "CLOUD_SCALE");
    let mut cell = [0; 3];
    let mut frac = [0.0; 3];
    for axis in [0, 2] {
        let place = view.eye.lattice(axis, wavelength)?;
        cell[axis] = place.cell;
        frac[axis] = f64::from(place.frac);
    }
    let (scattering, absorption) = (
        number(settings, "CLOUD_SCATTERING"),
        number(settings, "CLOUD_ABSORPTION"),
    );
    Ok(CloudLayer {
        cell,
        frac,
        wavelength,
        period: 1 << (number(settings, "CLOUD_PERIOD_DOUBLINGS") as u32).min(30),
        octaves: 6,
        hurst: 1.0,
        bottom: number(settings, "CLOUDS_HEIGHT"),
        thickness: number(settings, "CLOUDS_THICKNESS"),
        coverage: number(settings, "CLOUD_COVERAGE"),
        uniformity: 0.0,
        extinction: number(settings, "CLOUD_DENSITY") * (scattering + absorption),
        albedo: scattering / (scattering + absorption).max(1e-20),
        g_forward: number(settings, "CLOUD_G_FORWARD"),
        g_backward: number(settings, "CLOUD_G_BACKWARD"),
        backward_share: number(settings, "CLOUD_BACKWARD_SHARE"),
        seed: number(settings, "CLOUD_SEED") as u32,
    })
}
