//! Heights of given places on the device: a query, not a part of a frame.

use super::field::HeightField;
use super::ground::{Ground, Prepared};
use super::land::Land;
use super::noise::Place;
use super::query::TerrainQuery;
use crate::device::Gpu;
use crate::error::Error;
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
            sea: self.sea,
            ..Default::default()
        }
    }
}

/// The field at positions without any sea, filtered by a footprint (m), as the device computes it. Submits and waits. Compiles what it needs at each call: [`TerrainQuery::heights`] does not.
///
/// # Errors
/// As [`HeightField::check`]; [`Error::OutOfDomain`] for a footprint that is not finite or below 0 and for positions that are not finite, and for a program's own function where none is plugged in; the faults of [`ProgramSet::get`] and of making
/// the pipeline; [`Error::Device`].
pub fn heights(
    gpu: &Gpu,
    programs: &ProgramSet,
    field: &HeightField,
    positions: &[WorldPos],
    footprint: f32,
) -> Result<Vec<Ground<f32>>, Error> {
    let land = Land {
        field: field.clone(),
        ..Land::default()
    };
    field.check()?;
    TerrainQuery::new(gpu, programs, &land)?.heights(positions, footprint)
}
