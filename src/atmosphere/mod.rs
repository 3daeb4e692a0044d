//! The air of a planet: what it is made of, the sky that it makes, and the air before a host's own scene.

mod check;
mod fast;
mod file;
mod medium;
mod physics;
pub mod probe;
mod query;
pub mod ray;
mod sky;
mod tables;
mod transmittance;

pub use fast::FastProbe;
pub use medium::{
    AIR_WORDS, Atmosphere, Lane, Layer, Lobe, MOST_LANES, Phase, Profile, Sun,
    cornette_shanks_asymmetry,
};
pub use physics::{Aerosol, Molecules, aerosol_scattering, rayleigh_scattering};
pub use probe::{Orders, Probe, ProbeLight, ProbeOptions, ProbePath, ProbeRay, probe};
pub use query::{LightPlace, PlaceLight, SkyQuery};
pub use ray::AirRay;
pub use sky::{Sky, SkyComposition, SkyOptions};
pub use tables::{Eye, SkyQuality, SkyTables};
pub use transmittance::TransmittanceTable;
