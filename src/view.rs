//! Where the eye is, where it looks, when, and under which lights.

use glam::{DVec3, I64Vec3, Mat4, Vec2, Vec3, Vec4};

use crate::error::Error;

/// A position on the endless plane: whole metres and the rest.
///
/// `x` and `z` lie in the plane, `y` is the altitude above the planet's reference radius. The split keeps a millimetre a
/// millimetre at any distance from the origin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WorldPos {
    /// Whole metres.
    pub cell: I64Vec3,
    /// The rest in metres, usually in [0, 1); any finite value is accepted.
    pub frac: Vec3,
}

/// Where a position lies on a noise lattice: the cell, wrapped to 32 bits as the shaders take it, and the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeCoordinate {
    /// The cell modulo 2^32.
    pub cell: i32,
    /// The rest in cells, in [0, 1).
    pub frac: f32,
}

impl WorldPos {
    /// A position from metres in double precision.
    ///
    /// Exact to the precision of `f64`; values beyond ±9.2e18 m become the nearest that fits.
    pub fn from_metres(p: DVec3) -> WorldPos {
        let cell = p.floor();
        WorldPos {
            cell: cell.as_i64vec3(),
            frac: (p - cell).as_vec3(),
        }
        .normalized()
    }

    /// The position in metres, rounded to `f64`.
    pub fn to_metres(self) -> DVec3 {
        self.cell.as_dvec3() + self.frac.as_dvec3()
    }

    /// The same position with `frac` in [0, 1).
    pub fn normalized(self) -> WorldPos {
        let whole = self.frac.floor();
        let frac = self.frac - whole;
        // Rounding may lift a tiny negative rest to exactly 1.
        let carry = Vec3::select(frac.cmpge(Vec3::ONE), Vec3::ONE, Vec3::ZERO);
        WorldPos {
            cell: self.cell.wrapping_add((whole + carry).as_i64vec3()),
            frac: frac - carry,
        }
    }

    /// This position moved by `metres`.
    pub fn moved_by(self, metres: DVec3) -> WorldPos {
        let cell = metres.floor();
        WorldPos {
            cell: self.cell.wrapping_add(cell.as_i64vec3()),
            frac: (self.frac.as_dvec3() + (metres - cell)).as_vec3(),
        }
        .normalized()
    }

    /// The vector from `origin` to this position in metres.
    pub fn relative_to(self, origin: WorldPos) -> DVec3 {
        self.cell.wrapping_sub(origin.cell).as_dvec3()
            + (self.frac.as_dvec3() - origin.frac.as_dvec3())
    }

    /// The altitude in metres.
    pub fn altitude(self) -> f64 {
        self.cell.y as f64 + f64::from(self.frac.y)
    }

    /// Where coordinate `axis` (0 x, 1 y, 2 z) lies on a lattice of `wavelength` metres.
    ///
    /// The wavelength is taken to the nearest 2^-20 m; the arithmetic is exact at any distance.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a wavelength outside [1e-3, 1e9] m or an axis above 2.
    pub fn lattice(self, axis: usize, wavelength: f64) -> Result<LatticeCoordinate, Error> {
        if !(1e-3..=1e9).contains(&wavelength) {
            return Err(Error::OutOfDomain {
                name: "wavelength".to_owned(),
                value: wavelength.to_string(),
                domain: "in [0.001, 1e9] m".to_owned(),
            });
        }
        if axis > 2 {
            return Err(Error::OutOfDomain {
                name: "axis".to_owned(),
                value: axis.to_string(),
                domain: "0, 1 or 2".to_owned(),
            });
        }
        const UNIT: f64 = (1_u64 << 20) as f64;
        let p = self.normalized();
        let period = (wavelength * UNIT).round() as i128;
        let fraction = f64::from(p.frac[axis]) * UNIT;
        let position = (i128::from(p.cell[axis]) << 20) + fraction.floor() as i128;
        let cell = position.div_euclid(period);
        let rest = position.rem_euclid(period) as f64 + fraction.fract();
        let frac = (rest / period as f64) as f32;
        // Rounding to f32 may reach 1, which is the next cell.
        let (cell, frac) = if frac >= 1.0 {
            (cell + 1, 0.0)
        } else {
            (cell, frac)
        };
        Ok(LatticeCoordinate {
            cell: (cell.rem_euclid(1 << 32) as u32).cast_signed(),
            frac,
        })
    }
}

/// A distant light such as the sun or the moon.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Light {
    /// Unit vector towards the light.
    pub to_light: Vec3,
    /// Irradiance at the top of the air for red, green and blue, at least 0, in the picture's own unit.
    pub irradiance: Vec3,
    /// Angular radius of the disc in radians, in [0, 0.5].
    pub angular_radius: f32,
}

impl Default for Light {
    /// The sun 30 degrees above the horizon in the direction +X.
    fn default() -> Self {
        Light {
            to_light: Vec3::new(0.866_025_4, 0.5, 0.0),
            irradiance: Vec3::splat(20.0),
            angular_radius: 0.004_675,
        }
    }
}

/// One eye at one time.
///
/// Right-handed, +Y up; positions are relative to the eye. The projection maps to WebGPU's clip space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The eye.
    pub eye: WorldPos,
    /// Rotation from view space (x right, y up, looking along -z) to the world; a translation in it is ignored.
    pub world_from_view: Mat4,
    /// Projection from view space to clip space.
    pub projection: Mat4,
    /// Clip space of the previous frame from the world relative to this eye, for systems that keep a history.
    pub previous: Option<Mat4>,
    /// Shift of the pixel grid in pixels, each component in [-1, 1].
    pub jitter: Vec2,
    /// Factor on radiance before the tone map, at least 0.
    pub exposure: f32,
    /// Seconds since the start, in double precision.
    pub time: f64,
    /// The sun.
    pub sun: Light,
    /// The moon, if it gives light; it is checked, but nothing is lit by it yet.
    pub moon: Option<Light>,
}

impl Default for View {
    /// Looking along -Z from 3000 m, above the peaks of the default terrain, with a vertical field of view of 60 degrees and the aspect 16:9.
    fn default() -> Self {
        View {
            eye: WorldPos {
                cell: I64Vec3::new(0, 3000, 0),
                frac: Vec3::ZERO,
            },
            world_from_view: Mat4::IDENTITY,
            projection: perspective(60_f32.to_radians(), 16.0 / 9.0),
            previous: None,
            jitter: Vec2::ZERO,
            exposure: 1.0,
            time: 0.0,
            sun: Light::default(),
            moon: None,
        }
    }
}

/// Reversed, infinite perspective with the near plane at 0.1 m.
pub fn perspective(vertical_field_of_view: f32, aspect: f32) -> Mat4 {
    glam::camera::rh::proj::directx::perspective_infinite_reverse(
        vertical_field_of_view,
        aspect,
        0.1,
    )
}

/// Unit vector with this height above the horizon and this azimuth clockwise from -Z, both in radians.
pub fn direction(height: f64, azimuth: f64) -> DVec3 {
    DVec3::new(
        height.cos() * azimuth.sin(),
        height.sin(),
        -height.cos() * azimuth.cos(),
    )
}

impl View {
    /// Turns the view to `yaw` (clockwise from -Z) and `pitch` (upwards), with a vertical field of view, all in radians.
    pub fn look(&mut self, yaw: f64, pitch: f64, vertical_field_of_view: f32, aspect: f32) {
        self.world_from_view =
            Mat4::from_rotation_y(-yaw as f32) * Mat4::from_rotation_x(pitch as f32);
        self.projection = perspective(vertical_field_of_view, aspect);
    }

    /// The same view, when the planet's centre lies at (0, -radius, 0) of the world and the eye anywhere, in a frame with +Y up at the eye: the eye stands at (0, altitude, 0).
    /// Depths stay as they are. The previous frame is left out.
    pub fn levelled(&self, planet_radius: f64) -> View {
        let p = self.eye.to_metres();
        let out = DVec3::new(p.x, p.y + planet_radius, p.z);
        let q = p.length_squared() + 2.0 * planet_radius * p.y;
        let altitude = q / (planet_radius + (planet_radius * planet_radius + q).max(0.0).sqrt());
        let turn = glam::DQuat::from_rotation_arc(out.normalize_or(DVec3::Y), DVec3::Y);
        let light = |light: &Light| Light {
            to_light: (turn * light.to_light.as_dvec3()).as_vec3(),
            ..*light
        };
        View {
            eye: WorldPos::from_metres(DVec3::new(0.0, altitude, 0.0)),
            world_from_view: Mat4::from_quat(turn.as_quat()) * self.world_from_view,
            sun: light(&self.sun),
            moon: self.moon.as_ref().map(light),
            previous: None,
            ..*self
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let fault = |name: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: name.to_owned(),
                value,
                domain: domain.to_owned(),
            })
        };
        if !self.eye.frac.is_finite() {
            return fault("view.eye.frac", self.eye.frac.to_string(), "finite");
        }
        if !self.world_from_view.is_finite() || self.world_from_view.determinant().abs() < 1e-6 {
            return fault(
                "view.world_from_view",
                format!("{:?}", self.world_from_view.to_cols_array()),
                "finite and invertible",
            );
        }
        if !self.projection.is_finite() || self.projection.determinant() == 0.0 {
            return fault(
                "view.projection",
                format!("{:?}", self.projection.to_cols_array()),
                "finite and invertible",
            );
        }
        if !self.jitter.is_finite() || self.jitter.abs().max_element() > 1.0 {
            return fault("view.jitter", self.jitter.to_string(), "in [-1, 1] pixels");
        }
        if !(self.exposure >= 0.0 && self.exposure.is_finite()) {
            return fault(
                "view.exposure",
                self.exposure.to_string(),
                "finite and at least 0",
            );
        }
        if !self.time.is_finite() {
            return fault("view.time", self.time.to_string(), "finite");
        }
        self.sun.check("view.sun")?;
        match &self.moon {
            Some(moon) => moon.check("view.moon"),
            None => Ok(()),
        }
    }

    /// The direction of the ray through the middle of the picture and its change to the right and upper edge, so that
    /// the ray at clip coordinates (x, y) is along `middle + x right + y up`.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a projection without a vanishing point: this crate draws perspectives.
    pub fn rays(&self) -> Result<[Vec3; 3], Error> {
        let inverse = self.projection.inverse();
        let at = |x: f32, y: f32| {
            // Two depths of one pixel make a line that does not depend on the depth convention.
            let a = inverse * Vec4::new(x, y, 0.25, 1.0);
            let b = inverse * Vec4::new(x, y, 0.75, 1.0);
            let difference = a.truncate() * b.w - b.truncate() * a.w;
            let ray = if difference.z > 0.0 {
                -difference
            } else {
                difference
            };
            // Scaled so that every ray reaches the same depth: directions are then linear in x and y.
            ray / -ray.z
        };
        let middle = at(0.0, 0.0);
        let right = at(1.0, 0.0) - middle;
        let up = at(0.0, 1.0) - middle;
        if !(middle.is_finite() && right.is_finite() && up.is_finite())
            || right.length_squared() == 0.0
            || up.length_squared() == 0.0
        {
            return Err(Error::OutOfDomain {
                name: "view.projection".to_owned(),
                value: format!("{:?}", self.projection.to_cols_array()),
                domain: "a perspective projection".to_owned(),
            });
        }
        let rotate = |v: Vec3| self.world_from_view.transform_vector3(v);
        Ok([rotate(middle), rotate(right), rotate(up)])
    }
}

/// The rays of a picture's pixels, to pick what lies under a cursor and to read depth back.
///
/// ```
/// use veduta::terrain::{Land, TerrainRay};
/// let land = Land::named("hills")?;
/// let mut view = veduta::View::default();
/// view.eye = veduta::WorldPos::from_metres([0.0, 2000.0, 0.0].into());
/// view.look(0.0, -0.5, 1.0, 16.0 / 9.0);
/// let pixels = view.pixels([1280, 720])?;
/// // What is under the cursor, which is 200 pixels from the left and 500 from the top.
/// let dir = pixels.direction([200.0, 500.0]).to_array();
/// let hit = land.ray_hits(&[TerrainRay { origin: view.eye, dir, far: 1e5 }], pixels.angle())?[0];
/// assert!(hit.distance < 1e4);
/// # Ok::<(), veduta::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixels {
    middle: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    size: [f64; 2],
    /// Of the projection: what depth and w of clip space have of z and of 1.
    depth: [f64; 4],
}

impl View {
    /// The rays of a picture of so many pixels across and down.
    ///
    /// # Errors
    /// As [`View::check`] and [`View::rays`]; [`Error::OutOfDomain`] for a picture without pixels.
    pub fn pixels(&self, size: [u32; 2]) -> Result<Pixels, Error> {
        if size.contains(&0) {
            return Err(Error::OutOfDomain {
                name: "size".to_owned(),
                value: format!("{}x{}", size[0], size[1]),
                domain: "at least 1x1".to_owned(),
            });
        }
        self.check()?;
        let [middle, right, up] = self.rays()?.map(|v| v.as_dvec3());
        let p = &self.projection;
        Ok(Pixels {
            middle,
            right,
            up,
            forward: self
                .world_from_view
                .transform_vector3(Vec3::NEG_Z)
                .as_dvec3()
                .normalize(),
            size: size.map(f64::from),
            depth: [p.z_axis.z, p.w_axis.z, p.z_axis.w, p.w_axis.w].map(f64::from),
        })
    }
}

impl Pixels {
    /// Unit direction, along the world's axes, of the ray through a place of the picture, in pixels from its upper left corner: the middle of the first pixel is at (0.5, 0.5).
    pub fn direction(&self, at: [f64; 2]) -> DVec3 {
        let [x, y] = [
            2.0 * at[0] / self.size[0] - 1.0,
            1.0 - 2.0 * at[1] / self.size[1],
        ];
        (self.middle + x * self.right + y * self.up).normalize()
    }

    /// Angle of a pixel in the middle of the picture (rad).
    pub fn angle(&self) -> f64 {
        2.0 * self.up.length() / self.size[1]
    }

    /// Distance from the eye (m) along the ray through a place of the picture, from what the depth buffer has there, by whichever depth the view's projection has; infinite where that is behind the eye or at
    /// infinity. A projection with a far plane cleared to it says the distance of that plane.
    pub fn distance(&self, at: [f64; 2], depth: f32) -> f64 {
        let d = f64::from(depth);
        let [zz, zw, wz, ww] = self.depth;
        let ahead = (zw - d * ww) / (zz - d * wz);
        let distance = ahead / self.direction(at).dot(self.forward);
        if distance.is_finite() && distance > 0.0 {
            distance
        } else {
            f64::INFINITY
        }
    }
}

impl Light {
    /// Checks every field; `name` stands before the field in the message.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self, name: &str) -> Result<(), Error> {
        let fault = |field: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: format!("{name}.{field}"),
                value,
                domain: domain.to_owned(),
            })
        };
        let off = (self.to_light.length() - 1.0).abs();
        if off > 1e-3 || off.is_nan() {
            return fault("to_light", self.to_light.to_string(), "a unit vector");
        }
        if !self.irradiance.is_finite() || self.irradiance.min_element() < 0.0 {
            return fault(
                "irradiance",
                self.irradiance.to_string(),
                "finite and at least 0",
            );
        }
        if !(0.0..=0.5).contains(&self.angular_radius) {
            return fault(
                "angular_radius",
                self.angular_radius.to_string(),
                "in [0, 0.5] rad",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_is_exact_far_out() {
        for metres in [0_i64, -1, 8191, 8192, -8193, 1 << 40, -(1 << 52) + 3] {
            let p = WorldPos {
                cell: I64Vec3::new(metres, 0, 0),
                frac: Vec3::new(0.25, 0.0, 0.0),
            };
            let l = p.lattice(0, 8192.0).unwrap();
            let cell = metres.div_euclid(8192);
            assert_eq!(l.cell, cell as u32 as i32);
            let frac = (metres.rem_euclid(8192) as f64 + 0.25) / 8192.0;
            assert!((f64::from(l.frac) - frac).abs() < 1e-7);
        }
        assert!(WorldPos::default().lattice(0, f64::NAN).is_err());
        assert!(WorldPos::default().lattice(3, 1.0).is_err());
    }

    #[test]
    fn positions_normalise_and_differ() {
        let p = WorldPos {
            cell: I64Vec3::new(5, 0, i64::MAX - 1),
            frac: Vec3::new(-1e-12, 2.5, 0.0),
        };
        let n = p.normalized();
        assert!(n.frac.cmpge(Vec3::ZERO).all() && n.frac.cmplt(Vec3::ONE).all());
        let q = p.moved_by(DVec3::new(-3.25, 0.0, 0.5));
        assert!((q.relative_to(p) - DVec3::new(-3.25, 0.0, 0.5)).length() < 1e-6);
    }

    #[test]
    fn rays_do_not_depend_on_the_depth_convention() {
        let mut view = View::default();
        view.look(0.3, 0.2, 1.0, 1.5);
        let infinite = view.rays().unwrap();
        view.projection = glam::camera::rh::proj::directx::perspective(1.0, 1.5, 0.5, 1000.0);
        let normal = view.rays().unwrap();
        for (a, b) in infinite.iter().zip(normal) {
            assert!((*a - b).length() < 1e-4, "{a} {b}");
        }
        let forward = direction(0.2, 0.3).as_vec3();
        assert!((infinite[0].normalize() - forward).length() < 1e-6);
        view.projection =
            glam::camera::rh::proj::directx::orthographic(-1.0, 1.0, -1.0, 1.0, 0.0, 10.0);
        assert!(view.rays().is_err());
    }
}
