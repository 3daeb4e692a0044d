//! Procedural terrain: height fields that are filtered by the footprint, the same on the device and on the processor; rays over them, and the ground in a
//! host's own pass.

mod calibrate;
mod clipmap;
mod cloud_shade;
mod field;
mod globe;
mod globe_rays;
mod globe_system;
mod ground;
#[cfg(feature = "reference")]
mod judge;
mod land;
mod local;
mod map;
#[cfg(feature = "height_maps")]
mod map_file;
mod noise;
mod noise_3d;
#[cfg(feature = "reference")]
mod picture;
mod probe;
mod query;
mod rays;
mod real;
mod sky_lights;
mod surface;
mod system;

pub use calibrate::{Tail, Tails};
pub use clipmap::Clipmap;
pub(crate) use clipmap::group;
pub use field::{Bounds, Domain, HeightField, Kind, OwnBounds};
pub use globe::{Globe, GlobeGround, GlobePlace};
pub use globe_rays::globe_heights;
pub use ground::{Ground, Prepared};
#[cfg(feature = "reference")]
pub use judge::{HitErrors, hit_errors};
pub use land::{Land, Material, Sea};
pub use local::LocalBounds;
pub use map::{Edge, HeightMap, MapTexels};
pub use noise::Place;
#[cfg(feature = "reference")]
pub use picture::{GroundPixel, land_picture, land_picture_at};
pub use probe::heights;
pub use query::{TerrainQuery, ray_hits};
pub use rays::{RayPath, TerrainHit, TerrainRay};
pub use real::Real;
pub use surface::Terrain;
pub(crate) use system::surface_pipeline;
pub use system::{TerrainLights, TerrainOptions};
