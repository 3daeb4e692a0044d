//! Sunlight and the light of the sky at places in the air: what a host lights its own things with.

use crate::error::Error;
use crate::program::ProgramSet;

use super::Atmosphere;
use super::tables::{SkyTables, bind_groups, compute};
use crate::exchange::{Exchange, three};

/// A plane in the air whose light is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightPlace {
    /// Altitude (m), from 0 to the top of the air.
    pub altitude: f64,
    /// Direction to the sun, a unit vector in the frame of the place, y up.
    pub to_sun: [f64; 3],
    /// The plane's normal, a unit vector in the same frame.
    pub normal: [f64; 3],
    /// Angular radius of the sun in [0, 0.5] rad; 0 for a point.
    pub sun_angular_radius: f64,
}

/// The light of a place, for a sun whose irradiance outside the air is 1: multiply by that of the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceLight {
    /// Irradiance of the sun's own light on a plane across its direction: what is left after the air and the planet's horizon.
    pub sun: [f32; 3],
    /// Irradiance of the sky, and of the ground below, on the place's plane.
    pub sky: [f32; 3],
}

impl LightPlace {
    /// Checks every field, for an air of this thickness; `name` stands before the field in the message.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self, name: &str, thickness: f64) -> Result<(), Error> {
        let fault = |field: &str, value: String, domain: String| {
            Err(Error::OutOfDomain {
                name: format!("{name}.{field}"),
                value,
                domain,
            })
        };
        if !(0.0..=thickness).contains(&self.altitude) {
            let domain = format!("in [0, {thickness}] m, within the air");
            return fault("altitude", self.altitude.to_string(), domain);
        }
        for (field, v) in [("to_sun", self.to_sun), ("normal", self.normal)] {
            let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-3 || length.is_nan() {
                return fault(field, format!("{v:?}"), "a unit vector".to_owned());
            }
        }
        if !(0.0..=0.5).contains(&self.sun_angular_radius) {
            let value = self.sun_angular_radius.to_string();
            return fault("sun_angular_radius", value, "in [0, 0.5] rad".to_owned());
        }
        Ok(())
    }

    fn bytes(&self) -> [u8; PLACE] {
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            v.map(|c| c / length)
        };
        let ([x, y, z], [u, v, w]) = (unit(self.to_sun), unit(self.normal));
        let words = [x, y, z, self.altitude, u, v, w, self.sun_angular_radius];
        let mut bytes = [0; PLACE];
        for (to, word) in bytes.chunks_exact_mut(4).zip(words) {
            to.copy_from_slice(&(word as f32).to_le_bytes());
        }
        bytes
    }
}

/// Finds the light at places in the air from the tables of a [`Sky`](super::Sky) or tables of one's own.
///
/// ```no_run
/// # fn run(device: &wgpu::Device, queue: &wgpu::Queue, sky: &mut veduta::atmosphere::Sky) -> Result<(), veduta::Error> {
/// use veduta::atmosphere::{LightPlace, SkyQuery};
/// let query = SkyQuery::new(device, veduta::programs(), sky.tables().atmosphere())?;
/// let ground = LightPlace { altitude: 0.0, to_sun: [0.8, 0.6, 0.0], normal: [0.0, 1.0, 0.0], sun_angular_radius: 0.00467 };
/// let light = query.run(device, queue, sky.tables_mut(), &[ground])?;
/// println!("{:?} of the sun, {:?} of the sky", light[0].sun, light[0].sky);
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct SkyQuery {
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    features: &'static [&'static str],
}

const PLACE: usize = 32;
const RESULT: usize = 32;
/// Workgroups of one dispatch, by WebGPU's default limits; a workgroup finds the light of one place.
const MOST_WORKGROUPS: usize = 65_535;

impl SkyQuery {
    /// Builds the pipeline; the tables that are asked later must be of this air or of one with the same [`Atmosphere::features`].
    ///
    /// # Errors
    /// The faults of [`ProgramSet::get`] and of making the pipeline.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
    ) -> Result<SkyQuery, Error> {
        let (pipeline, layouts) = compute(device, programs, atmosphere, "sky_query", &[])?;
        Ok(SkyQuery {
            pipeline,
            layouts,
            features: atmosphere.features(),
        })
    }

    /// The light at each place, in their order. Submits and waits; makes those tables anew that the air of `tables` asks for, none for an
    /// eye; [`SkyTables::total_work`] counts them. What [`SkyTables::prepare`] has recorded before must have been submitted. The sky's light is summed over 768 directions of every
    /// place, each a march through the tables.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] with the index of a place outside of its domain, and for tables of another kind of air or without light of all
    /// orders; [`Error::Device`].
    pub fn run(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tables: &mut SkyTables,
        places: &[LightPlace],
    ) -> Result<Vec<PlaceLight>, Error> {
        let fault = |name: &str, value: usize, domain: &str| {
            Err(Error::OutOfDomain {
                name: name.to_owned(),
                value: value.to_string(),
                domain: domain.to_owned(),
            })
        };
        tables
            .atmosphere()
            .check_features("tables", self.features)?;
        if !tables.quality().all_orders {
            return fault("tables.all_orders", 0, "on");
        }
        let mut bytes = Vec::with_capacity(places.len() * PLACE);
        for (at, place) in places.iter().enumerate() {
            place.check(&format!("places[{at}]"), tables.atmosphere().thickness)?;
            bytes.extend(place.bytes());
        }
        let mut results = Vec::with_capacity(places.len());
        for part in bytes.chunks(MOST_WORKGROUPS * PLACE) {
            self.run_part(device, queue, tables, part, &mut results)?;
        }
        Ok(results)
    }

    fn run_part(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tables: &mut SkyTables,
        places: &[u8],
        results: &mut Vec<PlaceLight>,
    ) -> Result<(), Error> {
        let count = places.len() / PLACE;
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = tables.prepare_air(queue, &mut encoder)?;
        let exchange = Exchange::new(device, queue, places, count * RESULT);
        let view = wgpu::BindingResource::TextureView;
        let groups = bind_groups(
            device,
            "veduta query",
            &self.layouts,
            &[
                &[(0, tables.air().as_entire_binding())],
                &[
                    (0, wgpu::BindingResource::Sampler(tables.sampler())),
                    (1, view(tables.columns())),
                    (2, view(tables.diffuse())),
                    (3, exchange.input.as_entire_binding()),
                ],
                &[(0, exchange.output.as_entire_binding())],
            ],
        );
        let found = exchange.run(
            device,
            queue,
            encoder,
            &self.pipeline,
            &groups,
            count as u32,
        )?;
        results.extend(found.chunks_exact(RESULT).map(|result| PlaceLight {
            sun: three(result, 0),
            sky: three(result, 16),
        }));
        Ok(())
    }
}
