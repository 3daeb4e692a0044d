//! Clouds: a layer over a host's picture, and the light along given rays as a query.

mod air_lights;
mod deck;
mod directions;
mod layer_orders;
mod layer_rays;
mod order_table;
mod phase;
mod system;
mod tile;
pub mod volume;
mod weather;
mod window;

pub use air_lights::AirLights;
pub use deck::{CloudDeck, CloudShape, back_to_front};
pub use layer_rays::{LayerOptions, layer_light, layer_shadow};
pub use system::{CloudLights, CloudQuality, CloudShadow, Clouds, CloudsOptions};
pub use tile::LOWEST_SUN;
pub(crate) use tile::{CLEAR, clear_tile};
pub use volume::{CubeLight, CubeOptions, CubeRay, DensityCube, cube_light};
pub use weather::{WeatherMap, WeatherTexels};
pub use window::WindowQuality;

/// Which light of a cloud is counted and how it is found: the same as of the air.
pub use crate::atmosphere::{Orders, ProbePath};

use crate::error::Error;

fn fault(name: &str, value: impl ToString, domain: &str) -> Error {
    Error::OutOfDomain {
        name: name.to_owned(),
        value: value.to_string(),
        domain: domain.to_owned(),
    }
}
