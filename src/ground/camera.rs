//! Where a ground is seen from.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::view::{Light, View, WorldPos, direction};

/// An eye over a ground. Places count from the first cell, heights are altitudes (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundCamera {
    /// Place of the eye (x, y, z) (m), within 1e7.
    pub eye: [f64; 3],
    /// What it looks at (m), within 1e7, not the eye itself.
    pub target: [f64; 3],
    /// Vertical field of view (degrees), in [0.01, 170].
    #[serde(default = "fifty")]
    pub field_of_view: f64,
    /// Height of the sun above the horizon (degrees), in [-90, 90].
    #[serde(default = "thirty")]
    pub sun_height: f64,
    /// Azimuth of the sun (degrees, clockwise from -z), in [-360, 360].
    #[serde(default = "west")]
    pub sun_azimuth: f64,
}

fn fifty() -> f64 {
    50.0
}

fn thirty() -> f64 {
    30.0
}

fn west() -> f64 {
    -120.0
}

impl GroundCamera {
    /// From the south and above, with a ground of this size, spacing (m) and range of heights (m) filling the picture.
    pub fn over([columns, rows]: [usize; 2], spacing: f64, [low, high]: [f32; 2]) -> GroundCamera {
        let [w, d] = [columns, rows].map(|n| (n - 1) as f64 * spacing);
        let (low, high) = (f64::from(low), f64::from(high));
        let reach = w.max(d);
        GroundCamera {
            eye: [0.5 * w, high + 0.45 * reach, d + 0.45 * reach],
            target: [0.5 * w, low + 0.4 * (high - low), 0.5 * d],
            field_of_view: fifty(),
            sun_height: thirty(),
            sun_azimuth: west(),
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfDomain {
                name: format!("camera.{name}"),
                value: value.to_string(),
                domain: format!("in [{low}, {high}]"),
            })
        };
        for (name, place) in [("eye", self.eye), ("target", self.target)] {
            for value in place {
                within(name, value, -1e7, 1e7)?;
            }
        }
        if (DVec3::from_array(self.eye) - DVec3::from_array(self.target)).length() < 1e-6 {
            return Err(Error::OutOfDomain {
                name: "camera.target".to_owned(),
                value: format!("{:?}", self.target),
                domain: "another place than the eye".to_owned(),
            });
        }
        within("field_of_view", self.field_of_view, 0.01, 170.0)?;
        within("sun_height", self.sun_height, -90.0, 90.0)?;
        within("sun_azimuth", self.sun_azimuth, -360.0, 360.0)
    }

    /// What it sees in a picture of this aspect, with the first cell at the place `corner` and a sun of irradiance 1.
    ///
    /// # Errors
    /// As [`GroundCamera::check`].
    pub fn view(&self, corner: WorldPos, aspect: f64) -> Result<View, Error> {
        self.check()?;
        let ahead = DVec3::from_array(self.target) - DVec3::from_array(self.eye);
        let mut view = View {
            eye: corner.moved_by(DVec3::from_array(self.eye)),
            sun: Light {
                to_light: direction(self.sun_height.to_radians(), self.sun_azimuth.to_radians())
                    .as_vec3(),
                irradiance: Vec3::ONE,
                ..Light::default()
            },
            ..View::default()
        };
        view.look(
            ahead.x.atan2(-ahead.z),
            ahead.y.atan2(ahead.x.hypot(ahead.z)),
            self.field_of_view.to_radians() as f32,
            aspect as f32,
        );
        Ok(view)
    }
}
