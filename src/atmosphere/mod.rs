//! The air of a planet: what it is made of, the sky that it makes, and the air before a host's own scene.

mod medium;

pub use medium::{Atmosphere, Layer, Phase, Profile, Sun};
