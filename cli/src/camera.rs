//! Where the eye is and where it looks, from a view file, keys, flags and the time of flight.

use veduta::glam::{DVec3, Vec3};
use veduta::reference::terrain::{Terrain, height};
use veduta::view::direction;
use veduta::{Light, ProgramSet, Settings, View, WorldPos};

use crate::error::CliError;

/// Farthest distance from the origin along x and z in metres: beyond it `f64` no longer tells metres apart.
pub const FARTHEST: f64 = 1e15;

/// How high the eye is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EyeHeight {
    /// Metres above the ground under the eye.
    AboveGround(f64),
    /// Metres above the planet's sphere.
    Altitude(f64),
}

/// A camera at time 0; angles in degrees, lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Place along x.
    pub x: f64,
    /// Place along z.
    pub z: f64,
    /// Height of the eye.
    pub height: EyeHeight,
    /// Direction of flight and sight, clockwise from -z.
    pub yaw: f64,
    /// Upwards, in [-90, 90].
    pub pitch: f64,
    /// Vertical field of view, in [0.01, 170].
    pub field_of_view: f64,
    /// Height of the sun above the horizon, in [-90, 90].
    pub sun_height: f64,
    /// Azimuth of the sun, clockwise from the direction of flight.
    pub sun_azimuth: f64,
}

impl Camera {
    /// The camera that holds without a view: the keys CAM_HEIGHT, SUN_HEIGHT and SUN_AZIMUTH, at the origin, looking
    /// along -z with a field of view of 60 degrees.
    pub fn from_settings(settings: &Settings) -> Camera {
        let number = |name: &str, default| settings.number(name).unwrap_or(default);
        Camera {
            x: 0.0,
            z: 0.0,
            height: EyeHeight::AboveGround(number("CAM_HEIGHT", 300.0)),
            yaw: 0.0,
            pitch: 0.0,
            field_of_view: 60.0,
            sun_height: number("SUN_HEIGHT", 30.0),
            sun_azimuth: number("SUN_AZIMUTH", 120.0),
        }
    }

    /// The view at `time` seconds: the eye has flown with CAM_SPEED in the direction of its yaw, keeping its height.
    ///
    /// # Errors
    /// [`CliError::Argument`] that names the value and what is allowed.
    pub fn view(
        &self,
        programs: &ProgramSet,
        settings: &Settings,
        time: f64,
        aspect: f64,
    ) -> Result<View, CliError> {
        let check = |name: &str, value: f64, low: f64, high: f64, unit: &str| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(CliError::argument(
                    name,
                    value.to_string(),
                    format!("in [{low}, {high}] {unit}"),
                ))
            }
        };
        let number = |name: &str, default| settings.number(name).unwrap_or(default);
        check("--time", time, -f64::MAX, f64::MAX, "s")?;
        check("yaw", self.yaw, -1e6, 1e6, "degrees")?;
        check("pitch", self.pitch, -90.0, 90.0, "degrees")?;
        check("field of view", self.field_of_view, 0.01, 170.0, "degrees")?;
        check("sun height", self.sun_height, -90.0, 90.0, "degrees")?;
        check("sun azimuth", self.sun_azimuth, -1e6, 1e6, "degrees")?;
        let yaw = self.yaw.to_radians();
        let distance = number("CAM_SPEED", 0.0) * time;
        let flight = direction(0.0, yaw) * distance;
        let (x, z) = (self.x + flight.x, self.z + flight.z);
        check("x of the eye", x, -FARTHEST, FARTHEST, "m")?;
        check("z of the eye", z, -FARTHEST, FARTHEST, "m")?;
        let foot = WorldPos::from_metres(DVec3::new(x, 0.0, z));
        let altitude = match self.height {
            EyeHeight::Altitude(y) => y,
            EyeHeight::AboveGround(h) => ground_height(programs, settings, foot)? + h,
        };
        check("altitude of the eye", altitude, -1e4, 1e8, "m")?;
        let mut view = View {
            eye: foot.moved_by(DVec3::new(0.0, altitude, 0.0)),
            exposure: number("EXPOSURE", 1.0) as f32,
            time,
            sun: Light {
                to_light: direction(
                    self.sun_height.to_radians(),
                    yaw + self.sun_azimuth.to_radians(),
                )
                .as_vec3(),
                irradiance: Vec3::splat(number("SUN_INTENSITY", 20.0) as f32),
                ..Light::default()
            },
            ..View::default()
        };
        view.look(
            yaw,
            self.pitch.to_radians(),
            self.field_of_view.to_radians() as f32,
            aspect as f32,
        );
        Ok(view)
    }
}

/// Altitude of the ground at a foot point in metres, in double precision; 0 for a scene without TERRAIN.
///
/// The number of octaves is the declared default of OCTAVES, so that every preset sees the same view from the same place.
///
/// # Errors
/// [`veduta::Error::OutOfDomain`] for a TERRAIN_SCALE that no lattice can have.
pub fn ground_height(
    programs: &ProgramSet,
    settings: &Settings,
    foot: WorldPos,
) -> Result<f64, CliError> {
    let number = |name: &str| settings.number(name).unwrap_or(0.0);
    if number("TERRAIN") == 0.0 {
        return Ok(0.0);
    }
    let wavelength = number("TERRAIN_SCALE");
    let (x, z) = (foot.lattice(0, wavelength)?, foot.lattice(2, wavelength)?);
    let terrain = Terrain {
        cell: [x.cell, z.cell],
        frac: [f64::from(x.frac), f64::from(z.frac)],
        wavelength,
        amplitude: number("TERRAIN_HEIGHT"),
        hurst: number("TERRAIN_HURST"),
        gain: number("TERRAIN_GAIN"),
        smoothness: if number("SMOOTH_RIDGES") == 0.0 {
            0.0
        } else {
            number("RIDGE_SMOOTHNESS")
        },
        // The key's domain is that of u32.
        seed: number("TERRAIN_SEED") as u32,
    };
    let octaves = match programs.key("OCTAVES")?.default {
        veduta::Value::Int(octaves) => i32::try_from(octaves).unwrap_or(i32::MAX),
        _ => 1,
    };
    Ok(height(&terrain, [0.0, 0.0], octaves))
}
