//! Light along given rays, read from tables.

use std::collections::BTreeMap;

use crate::error::Error;
use crate::program::ProgramSet;

use super::Atmosphere;
use super::probe::{ProbeLight, ProbeRay, checked};
use super::ray::AirRay;
use super::tables::{Eye, SkyQuality, SkyTables, bind_groups, compute};
use crate::exchange::{Exchange, three};

/// Rays of one dispatch.
const MOST_RAYS: usize = 1 << 20;

/// Reads the light along rays from the tables of their eyes.
#[derive(Debug)]
pub struct FastProbe {
    tables: SkyTables,
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
}

const RAY: usize = 16;
const RESULT: usize = 32;
const WORKGROUP: u32 = 64;

impl FastProbe {
    /// Builds the pipelines. With `march` above 0, in [1, 256], every ray is marched with so many steps of two samples a stretch through
    /// the tables of the air alone; with 0 the tables of the eye are read.
    ///
    /// # Errors
    /// As [`SkyTables::new`].
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        quality: &SkyQuality,
        march: u32,
    ) -> Result<FastProbe, Error> {
        let tables = SkyTables::new(device, programs, atmosphere, quality)?;
        let (pipeline, layouts) = compute(
            device,
            programs,
            atmosphere,
            "sky_probe",
            &[
                ("PROBE_MARCH", f64::from(march.min(256))),
                ("ALL_ORDERS", f64::from(u8::from(quality.all_orders))),
            ],
        )?;
        Ok(FastProbe {
            tables,
            pipeline,
            layouts,
        })
    }

    /// The light along each ray, in their order, under a point sun. Submits and waits. Rays from one altitude under one height
    /// of the sun share their tables.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a ray out of its domain, with its place in the list; [`Error::Device`].
    pub fn run(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        rays: &[ProbeRay],
    ) -> Result<Vec<ProbeLight>, Error> {
        let rays = rays
            .iter()
            .enumerate()
            .map(|(at, ray)| checked(ray, at))
            .collect::<Result<Vec<ProbeRay>, Error>>()?;
        let mut groups: BTreeMap<(u64, u64), Vec<usize>> = BTreeMap::new();
        let air = self.tables.atmosphere();
        let (radius, top) = (air.planet_radius, air.thickness);
        for (i, ray) in rays.iter().enumerate() {
            // What misses the air, or has no length, is found in f64: a device's floats know the limb to metres.
            if AirRay::new(radius, top, ray).length == 0.0 {
                continue;
            }
            let key = (ray.altitude.to_bits(), ray.to_sun[1].to_bits());
            groups.entry(key).or_default().push(i);
        }
        let mut results = vec![
            ProbeLight {
                in_scatter: [0.0; 3],
                transmittance: [1.0; 3]
            };
            rays.len()
        ];
        for members in groups.values().flat_map(|m| m.chunks(MOST_RAYS)) {
            let first = rays[members[0]];
            let flat = first.to_sun[0].hypot(first.to_sun[2]);
            let eye = Eye {
                altitude: first.altitude,
                to_sun: [flat, first.to_sun[1], 0.0],
                sun_angular_radius: 0.0,
            };
            let mut bytes = Vec::with_capacity(members.len() * RAY);
            for &i in members {
                // Turned about the vertical until the sun stands over +x.
                let ray = rays[i];
                let flat = ray.to_sun[0].hypot(ray.to_sun[2]);
                let (c, s) = if flat > 0.0 {
                    (ray.to_sun[0] / flat, ray.to_sun[2] / flat)
                } else {
                    (1.0, 0.0)
                };
                let [x, y, z] = ray.dir;
                for number in [c * x + s * z, y, c * z - s * x, ray.distance] {
                    bytes.extend((number.min(1e30) as f32).to_le_bytes());
                }
            }
            let found = self.run_group(device, queue, &eye, &bytes)?;
            for (&i, result) in members.iter().zip(found) {
                results[i] = result;
            }
        }
        Ok(results)
    }

    /// The tables that rays are read from, whose [`SkyTables::total_work`] tells what the rays have made.
    pub fn tables(&self) -> &SkyTables {
        &self.tables
    }

    fn run_group(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        eye: &Eye,
        rays: &[u8],
    ) -> Result<Vec<ProbeLight>, Error> {
        let count = rays.len() / RAY;
        let exchange = Exchange::new(device, queue, rays, count * RESULT);
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = self.tables.prepare(queue, &mut encoder, eye)?;
        let tables = &self.tables;
        let view = wgpu::BindingResource::TextureView;
        let mut read = vec![
            (0, wgpu::BindingResource::Sampler(tables.sampler())),
            (1, view(tables.sky())),
            (4, exchange.input.as_entire_binding()),
            (5, view(tables.columns())),
            (6, view(tables.diffuse())),
        ];
        let before = [(2, tables.aerial()), (3, tables.aerial_depths())];
        read.extend(before.into_iter().filter_map(|(k, t)| Some((k, view(t?)))));
        let groups = bind_groups(
            device,
            "veduta probe",
            &self.layouts,
            &[
                &[
                    (0, tables.air().as_entire_binding()),
                    (1, tables.eye().as_entire_binding()),
                ],
                &read,
                &[(0, exchange.output.as_entire_binding())],
            ],
        );
        let workgroups = (count as u32).div_ceil(WORKGROUP);
        let data = exchange.run(device, queue, encoder, &self.pipeline, &groups, workgroups)?;
        Ok(data
            .chunks_exact(RESULT)
            .map(|result| ProbeLight {
                in_scatter: three(result, 0),
                transmittance: three(result, 16),
            })
            .collect())
    }
}
