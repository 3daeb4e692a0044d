//! Procedural terrain: height fields that are filtered by the footprint, the same on the device and on the processor; rays over them, and the ground in a
//! host's own pass.

mod calibrate;
mod clipmap;
mod field;
mod ground;
#[cfg(feature = "reference")]
mod judge;
mod land;
mod noise;
mod probe;
mod rays;
mod real;
mod system;

pub use calibrate::{Tail, Tails};
pub use clipmap::{Clipmap, ClipmapOptions};
pub use field::{Bounds, Domain, HeightField, Kind};
pub use ground::{Ground, Prepared};
#[cfg(feature = "reference")]
pub use judge::{HitErrors, hit_errors};
pub use land::{Land, Material};
pub use noise::Place;
pub use probe::heights;
pub use rays::{RayPath, TerrainHit, TerrainRay, ray_hits};
pub use real::Real;
pub use system::{Terrain, TerrainLights, TerrainOptions};
