//! Procedural terrain: height fields that are filtered by the footprint, the same on the device and on the processor.

mod calibrate;
mod field;
mod ground;
mod land;
mod noise;
mod probe;
mod real;

pub use calibrate::{Tail, Tails};
pub use field::{Bounds, Domain, HeightField, Kind};
pub use ground::{Ground, Prepared};
pub use land::Land;
pub use noise::Place;
pub use probe::heights;
pub use real::Real;
