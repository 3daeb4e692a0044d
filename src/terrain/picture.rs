//! The picture of a land on the plane in `f64`, without anything that is baked: what `Terrain` is judged against.

use super::ground::{Ground, Prepared};
use super::land::Land;
use super::rays::{TerrainRay, altitude_along};
use super::system::TerrainLights;
use crate::error::Error;
use crate::reference::field::height_spread;
use crate::reference::math::{dot, smoothstep};
use crate::reference::parallel::parallel_map;
use crate::reference::terrain::{
    Rock, ThreeLights, faded_noise, rock_high_faded, shade_rough, snow_blend,
};
use crate::view::View;

/// A pixel that shows ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPixel {
    /// Radiance, in the unit of the lights.
    pub radiance: [f64; 3],
    /// Distance along the ray (m).
    pub distance: f64,
    /// Share of the sun's disc above the horizon.
    pub sun: f64,
    /// Radiance if the whole disc were.
    pub lit: [f64; 3],
}

/// Renders what `Terrain` draws with the preset `high`, row by row from the top; `None` where no ground is seen before `far` (m). Hits are found by bracketing in steps of a twentieth of a footprint, and the
/// share of the sun by looking along its azimuth for the horizon, both over the field itself in `f64`.
///
/// # Errors
/// As [`Land::check`] and [`View::check`]; [`Error::OutOfDomain`] for a land on a `Sphere` and a picture without pixels.
pub fn land_picture(
    land: &Land,
    view: &View,
    lights: &TerrainLights,
    size: [usize; 2],
    far: f64,
) -> Result<Vec<Option<GroundPixel>>, Error> {
    shaded(land, view, lights, size, far, None)
}

/// As [`land_picture`], with the distances (m) at which the rays of the pixels are said to meet the ground, infinite where they do not: light and shadow apart from hits.
///
/// # Errors
/// As [`land_picture`]; [`Error::OutOfDomain`] for another number of distances than of pixels.
pub fn land_picture_at(
    land: &Land,
    view: &View,
    lights: &TerrainLights,
    size: [usize; 2],
    far: f64,
    distances: &[f64],
) -> Result<Vec<Option<GroundPixel>>, Error> {
    if distances.len() != size[0] * size[1] {
        return Err(Error::OutOfDomain {
            name: "distances".to_owned(),
            value: format!("{} of them", distances.len()),
            domain: format!("one for each of {}x{} pixels", size[0], size[1]),
        });
    }
    shaded(land, view, lights, size, far, Some(distances))
}

/// The share of a footprint that lies above the sea, of the bare field at its middle.
fn dry_share(field: &Prepared<f64>, bare: &Ground<f64>, footprint: f64) -> f64 {
    let octaves = f64::from(field.octaves());
    let left = (octaves - (field.wavelength / footprint).log2()).clamp(0.0, octaves);
    let spread = height_spread(bare.slope, bare.lost, footprint, left, field.fall);
    let width = (2.24 * spread).max(0.01);
    smoothstep(-width, width, bare.height - field.sea)
}

fn shaded(
    land: &Land,
    view: &View,
    lights: &TerrainLights,
    [columns, rows]: [usize; 2],
    far: f64,
    distances: Option<&[f64]>,
) -> Result<Vec<Option<GroundPixel>>, Error> {
    land.check()?;
    view.check()?;
    lights.check()?;
    if columns == 0 || rows == 0 {
        return Err(Error::OutOfDomain {
            name: "size".to_owned(),
            value: format!("{columns}x{rows}"),
            domain: "at least 1x1".to_owned(),
        });
    }
    let field = land.prepare::<f64>()?;
    let top = field.bounds().map_or(2e4, |b| b.maximum);
    let [middle, right, up] = view.rays()?.map(|v| v.as_dvec3());
    let angle = 2.0 * up.length() / rows as f64;
    let eye = view.eye.normalized();
    let place = field.place(eye);
    let start = eye.altitude();
    let to_sun = view.sun.to_light.as_dvec3().normalize_or(glam::DVec3::Y);
    let elevation = to_sun.y.atan2(to_sun.x.hypot(to_sun.z));
    let ahead = glam::DVec2::new(to_sun.x, to_sun.z).normalize_or_zero();
    let limb = f64::from(view.sun.angular_radius).max(1e-6);
    let m = &land.material;
    let wavelength = f64::from(m.rock_wavelength);
    let [x, z] = [eye.lattice(0, wavelength)?, eye.lattice(2, wavelength)?];
    let wide = |c: [f32; 3]| c.map(f64::from);
    let dark = wide(m.rock_dark);
    let rock = Rock {
        cell: [x.cell, 0, z.cell],
        frac: [f64::from(x.frac), 0.0, f64::from(z.frac)],
        wavelength,
        octaves: 5,
        hurst: 1.0,
        dark,
        light: wide(m.rock_light),
        stain: dark.map(|c| f64::from(m.rock_stain) * c),
        seed: land.field.seed.wrapping_add(101),
    };
    let of = |v: glam::Vec3| v.as_dvec3().to_array();
    let lights = ThreeLights {
        sun_color: of(lights.sun),
        sky_color: of(lights.sky),
        bounce_color: of(lights.bounce),
    };
    // How much of the sun's disc stands above the ground towards it, from a place on the ground.
    let sun_share = |at: [f64; 2], altitude: f64, footprint: f64| {
        let radius = land.planet_radius + altitude;
        let mu = elevation.sin();
        let mut horizon = f64::NEG_INFINITY;
        let mut d = footprint;
        while d < far && altitude_along(altitude, radius, mu, d) < top + (1.1 * limb).max(0.02) * d
        {
            let there = [at[0] + ahead.x * d, at[1] + ahead.y * d];
            let width = footprint.max(0.01 * d);
            let g = field.ground_from(place, there, width).height;
            horizon = horizon.max(((g - altitude) / d - 0.5 * d / radius).atan());
            d += 0.5 * width;
        }
        let x = ((elevation - horizon) / limb).clamp(-1.0, 1.0);
        0.5 + x * (0.75 - 0.25 * x * x)
    };
    let pixel = |i: usize| -> Result<Option<GroundPixel>, Error> {
        let at = |k: usize, n: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
        let ray = middle + right * at(i % columns, columns) - up * at(i / columns, rows);
        let dir = ray.normalize();
        let ray = TerrainRay {
            origin: eye,
            dir: dir.to_array(),
            far,
        };
        let t = match distances {
            Some(distances) => distances[i],
            None => {
                field
                    .first_hit(land.planet_radius, &ray, angle, 0.02, 0.05)?
                    .distance
            }
        };
        if !t.is_finite() {
            return Ok(None);
        }
        let offset = [dir.x * t, dir.z * t];
        let facing = -dot(
            field.ground_from(place, offset, angle * t).normal(),
            ray.dir,
        );
        let footprint = angle * t / facing.max(0.05);
        let mut ground = field.bare_at(field.moved(place, offset), footprint);
        // The border of the sea is blended over the heights that a footprint holds.
        let dry = dry_share(&field, &ground, footprint);
        ground = Ground {
            height: ground.height.max(field.sea),
            slope: ground.slope.map(|s| dry * s),
            lost: dry * ground.lost,
        };
        let altitude = altitude_along(start, land.planet_radius + start, dir.y, t);
        let there = [offset[0], altitude, offset[1]];
        let border = faded_noise(&rock, there, [1; 3], 7, footprint);
        let [sx, sz] = ground.slope;
        let level = 1.0 / (1.0 + sx * sx + sz * sz + ground.lost).sqrt();
        let blur = 1.2 * level * level * (ground.lost * (1.0 - level * level)).sqrt();
        let line = f64::from(m.snow_line);
        let rise = ((altitude + 200.0 * border - line + 100.0) / 200.0).clamp(0.0, 1.0);
        let [low, high, noise] = [m.snow_edge_low, m.snow_edge_high, m.snow_noise].map(f64::from);
        let snow = rise
            * rise
            * (3.0 - 2.0 * rise)
            * snow_blend(level, border, low - blur, high + blur, noise);
        let bare = rock_high_faded(&rock, there, footprint);
        let sun = sun_share(offset, ground.height, footprint);
        let radiance = |sun: f64| {
            let light = shade_rough(&lights, ground.slope, ground.lost, to_sun.to_array(), sun);
            std::array::from_fn(|k| {
                let rock = bare[k] + snow * (f64::from(m.snow[k]) - bare[k]);
                let wet = land.sea.map_or(rock, |s| f64::from(s.albedo[k]));
                let albedo = wet + dry * (rock - wet);
                std::f64::consts::FRAC_1_PI * albedo * light[k]
            })
        };
        Ok(Some(GroundPixel {
            radiance: radiance(sun),
            distance: t,
            sun,
            lit: radiance(1.0),
        }))
    };
    parallel_map(columns * rows, pixel).into_iter().collect()
}
