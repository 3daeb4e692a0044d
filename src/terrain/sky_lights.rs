//! Lights of the ground from the sky that is drawn above it.

use glam::Vec3;

use super::land::Material;
use super::surface::Terrain;
use super::system::TerrainLights;
use crate::atmosphere::{LightPlace, SkyQuery, SkyTables};
use crate::error::Error;
use crate::view::Light;

impl Material {
    /// Albedo that rock has in the mean, about: midway between the darkest and the lightest.
    pub fn rock_albedo(&self) -> Vec3 {
        0.5 * (Vec3::from_array(self.rock_dark) + Vec3::from_array(self.rock_light))
    }
}

impl TerrainLights {
    /// The lights on ground at an altitude (m), which is taken into the air: what the air leaves of the sun, the sky's irradiance on level ground, and what ground of an albedo (such as
    /// [`Material::rock_albedo`]) throws back of both onto a slope that sees as much of it as of the sky. Submits and waits, see [`SkyQuery::run`]; a host asks again when the sun has moved.
    ///
    /// ```no_run
    /// # fn run(device: &wgpu::Device, queue: &wgpu::Queue, sky: &mut veduta::atmosphere::Sky, view: &veduta::View) -> Result<(), veduta::Error> {
    /// use veduta::atmosphere::SkyQuery;
    /// use veduta::terrain::{Material, TerrainLights};
    /// let query = SkyQuery::new(device, veduta::programs(), sky.tables().atmosphere())?;
    /// let albedo = Material::default().rock_albedo();
    /// let lights = TerrainLights::from_sky(device, queue, &query, sky.tables_mut(), &view.sun, 1500.0, albedo)?;
    /// # Ok(()) }
    /// ```
    ///
    /// # Errors
    /// As [`SkyQuery::run`]; [`Error::OutOfDomain`] for an altitude or an albedo that is not finite.
    pub fn from_sky(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        query: &SkyQuery,
        tables: &mut SkyTables,
        sun: &Light,
        altitude: f64,
        albedo: Vec3,
    ) -> Result<TerrainLights, Error> {
        let to_sun = sun.to_light.as_dvec3().normalize_or(glam::DVec3::Y);
        let all = lit(
            (device, queue),
            query,
            tables,
            sun,
            &[to_sun.to_array()],
            altitude,
            albedo,
        )?;
        Ok(all[0])
    }

    /// The lights for [`Terrain::set_lights_by_sun`], one for each of [`Terrain::sun_cosines`], on ground of a ball at an altitude (m); of `sun` the direction says nothing.
    ///
    /// # Errors
    /// As [`TerrainLights::from_sky`].
    pub fn by_sun_from_sky(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        query: &SkyQuery,
        tables: &mut SkyTables,
        sun: &Light,
        altitude: f64,
        albedo: Vec3,
    ) -> Result<Vec<TerrainLights>, Error> {
        let places: Vec<[f64; 3]> = Terrain::sun_cosines()
            .iter()
            .map(|mu| [(1.0 - mu * mu).max(0.0).sqrt(), *mu, 0.0])
            .collect();
        lit(
            (device, queue),
            query,
            tables,
            sun,
            &places,
            altitude,
            albedo,
        )
    }
}

fn lit(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    query: &SkyQuery,
    tables: &mut SkyTables,
    sun: &Light,
    places: &[[f64; 3]],
    altitude: f64,
    albedo: Vec3,
) -> Result<Vec<TerrainLights>, Error> {
    sun.check("sun")?;
    if !(altitude.is_finite() && albedo.is_finite() && albedo.min_element() >= 0.0) {
        return Err(Error::OutOfDomain {
            name: "altitude and albedo".to_owned(),
            value: format!("{altitude} m and {albedo}"),
            domain: "finite, the albedo at least 0".to_owned(),
        });
    }
    let thickness = tables.atmosphere().thickness;
    // As `Sky` has it.
    let irradiance =
        sun.irradiance * Vec3::from_array(tables.atmosphere().sun.colour.map(|c| c as f32));
    let rows: Vec<LightPlace> = places
        .iter()
        .map(|to_sun| LightPlace {
            altitude: altitude.clamp(0.0, thickness),
            to_sun: *to_sun,
            normal: [0.0, 1.0, 0.0],
            sun_angular_radius: f64::from(sun.angular_radius),
        })
        .collect();
    let found = query.run(device, queue, tables, &rows)?;
    Ok(found
        .iter()
        .zip(places)
        .map(|(found, to_sun)| {
            let direct = irradiance * Vec3::from_array(found.sun);
            let sky = irradiance * Vec3::from_array(found.sky);
            let level = direct * (to_sun[1].max(0.0) as f32) + sky;
            TerrainLights {
                sun: direct,
                sky,
                bounce: 0.5 * albedo * level,
            }
        })
        .collect())
}
