//! The table of transmittance: the sun's colour at any place of the air with one texture read.

use crate::error::Error;
use crate::landscape::{Resources, Work};
use crate::program::ProgramSet;

use super::Atmosphere;
use super::tables::{Bake, Table, bind_groups, compute, upload};

/// Transmittance from every altitude towards the sun, for shaders that ask at many places; read with `table_transmittance` of
/// `veduta::atmosphere::transmittance`. The tables of the sky do without it: columns are as exact with half the texels, and hold for any coefficients.
///
/// `Rgba16Float`; a texel holds the roots of red, green and blue. Needs a linear sampler that clamps.
#[derive(Debug)]
pub struct TransmittanceTable {
    features: &'static [&'static str],
    size: [u32; 2],
    air: wgpu::Buffer,
    air_bytes: Vec<u8>,
    table: Table,
    bake: Bake,
    made: bool,
}

impl TransmittanceTable {
    /// Makes texture and pipeline for airs with the same [`Atmosphere::features`] as this one. `size` is zenith angles by altitudes, each in
    /// `[2, 1024]`; 128 x 64 is right to 0.0025 for 99 of 100 paths.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a size out of its domain; the faults of [`Atmosphere::check`], [`ProgramSet::get`] and of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        size: [u32; 2],
    ) -> Result<TransmittanceTable, Error> {
        if size.iter().any(|s| !(2..=1024).contains(s)) {
            return Err(Error::OutOfDomain {
                name: "size".to_owned(),
                value: format!("{size:?}"),
                domain: "each in [2, 1024]".to_owned(),
            });
        }
        let bytes = atmosphere.air_bytes()?;
        let air = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta air"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let table = Table::new(device, "veduta transmittance", size, None);
        let (pipeline, layouts) = compute(device, programs, atmosphere, "air_transmittance", &[])?;
        let groups = bind_groups(
            device,
            "veduta transmittance",
            &layouts,
            &[
                &[(0, air.as_entire_binding())],
                &[],
                &[(0, wgpu::BindingResource::TextureView(&table.view))],
            ],
        );
        Ok(TransmittanceTable {
            features: atmosphere.features(),
            size,
            air,
            air_bytes: Vec::new(),
            table,
            bake: Bake {
                pipeline,
                groups,
                workgroups: size.map(|s| s.div_ceil(8)),
            },
            made: false,
        })
    }

    /// Records the table when the air is another than before.
    ///
    /// # Errors
    /// As [`Atmosphere::check`]; [`Error::OutOfDomain`] for an air with other [`Atmosphere::features`] than that of [`TransmittanceTable::new`], or
    /// the other way round.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        atmosphere: &Atmosphere,
    ) -> Result<Work, Error> {
        let bytes = atmosphere.air_bytes()?;
        atmosphere.check_features("atmosphere.layers", self.features)?;
        let mut work = Work::default();
        upload(queue, &self.air, &mut self.air_bytes, bytes, &mut work);
        if work.writes > 0 || !self.made {
            self.bake.record(encoder, "veduta transmittance", &mut work);
            self.made = true;
        }
        Ok(work)
    }

    /// Counts the table as not made: the next [`TransmittanceTable::prepare`] records it. For a host that has dropped the encoder.
    pub fn forget(&mut self) {
        self.made = false;
    }

    /// Zenith angles by altitudes.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The table.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.table.view
    }

    /// Its texture, to copy it from.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.table.texture
    }

    /// What it keeps on the device.
    pub fn resources(&self) -> Resources {
        Resources {
            pipelines: 1,
            bind_groups: self.bake.groups.len() as u32,
            bindings: 2,
            buffers: 1,
            buffer_bytes: self.air.size(),
            textures: 1,
            texture_bytes: self.table.bytes(),
            samplers: 0,
        }
    }
}
