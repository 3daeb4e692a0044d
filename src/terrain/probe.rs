//! Heights of given places on the device: a query, not a part of a frame.

use super::clipmap::group;
use super::field::HeightField;
use super::ground::{Ground, Prepared};
use super::map::Relief;
use super::noise::Place;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::Field as FieldBlock;
use crate::view::WorldPos;

impl Prepared<f32> {
    /// The block `Field` of the modules, for an eye at a place.
    pub fn block(&self, eye: Place<f32>) -> FieldBlock {
        FieldBlock {
            cell: eye.cell,
            frac: eye.frac,
            wavelength: self.wavelength,
            amplitude: self.amplitude,
            base: self.base,
            fall: self.fall,
            shape: self.shape,
            detail: self.detail,
            octaves: self.octaves(),
            seed: self.seed(),
            mean: self.mean,
            lost: self.lost,
        }
    }
}

/// Bytes of a place in the buffer, and of a result.
const ROW: usize = 24;
const RESULT: usize = 16;

/// Places of one dispatch.
const CHUNK: usize = 1 << 16;

/// The field at positions, filtered by a footprint (m), as the device computes it. Submits and waits.
///
/// # Errors
/// As [`HeightField::check`]; [`Error::OutOfDomain`] for a footprint that is not finite or below 0; the faults of [`ProgramSet::get`] and of making
/// the pipeline; [`Error::Device`].
pub fn heights(
    gpu: &Gpu,
    programs: &ProgramSet,
    field: &HeightField,
    positions: &[WorldPos],
    footprint: f32,
) -> Result<Vec<Ground<f32>>, Error> {
    let prepared = field.prepare::<f32>()?;
    if !(footprint >= 0.0 && footprint.is_finite()) {
        return Err(Error::OutOfDomain {
            name: "footprint".to_owned(),
            value: footprint.to_string(),
            domain: "finite and at least 0 m".to_owned(),
        });
    }
    let (device, queue) = (&gpu.device, &gpu.queue);
    let kind = [("FIELD_KIND", f64::from(field.kind.number()))];
    let (pipeline, layouts) = compute(device, programs, "terrain_heights", &[], &kind)?;
    let mut relief = Relief::new(device, prepared.map())?;
    let _ = relief.upload(queue);
    let block = prepared.block(Place {
        cell: [0; 2],
        frac: [0.0; 2],
    });
    let uniform = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("veduta field"),
        size: FieldBlock::SIZE as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&uniform, 0, &block.to_bytes());
    let mut results = Vec::with_capacity(positions.len());
    for part in positions.chunks(CHUNK) {
        let mut rows = Vec::with_capacity(part.len() * ROW);
        for position in part {
            let place = prepared.place(*position);
            rows.extend(place.cell.iter().flat_map(|c| c.to_le_bytes()));
            rows.extend(place.frac.iter().flat_map(|f| f.to_le_bytes()));
            rows.extend(footprint.to_le_bytes());
            rows.extend([0; 4]);
        }
        let exchange = Exchange::new(device, queue, &rows, part.len() * RESULT);
        let groups = [
            group(device, &layouts[0], &[uniform.as_entire_binding()]),
            group(
                device,
                &layouts[1],
                &[
                    exchange.input.as_entire_binding(),
                    wgpu::BindingResource::TextureView(&relief.view),
                ],
            ),
            group(device, &layouts[2], &[exchange.output.as_entire_binding()]),
        ];
        let encoder = device.create_command_encoder(&Default::default());
        let workgroups = part.len().div_ceil(64) as u32;
        let data = exchange.run(device, queue, encoder, &pipeline, &groups, workgroups)?;
        results.extend(data.chunks_exact(RESULT).map(|row| {
            let number =
                |k: usize| f32::from_le_bytes([row[k], row[k + 1], row[k + 2], row[k + 3]]);
            Ground {
                height: number(0),
                lost: number(4),
                slope: [number(8), number(12)],
            }
        }));
    }
    Ok(results)
}
