//! Outdoor landscapes for wgpu: composable WGSL modules and ready-to-bind pipelines.
//!
//! The user owns instance, device, queue, surface and submission; this crate records into them. A system is built once
//! with `new`, uploads and bakes in `prepare`, and draws into the host's passes. See [`Landscape`].
//!
//! The WGSL is composed while this crate is built; [`programs()`] holds the variants of every shipped scene and preset.

pub mod atmosphere;
pub mod clouds;
#[cfg(feature = "compose")]
pub mod compose;
pub mod device;
pub mod error;
#[cfg(feature = "compose")]
pub mod eval;
mod exchange;
pub mod ground;
pub mod landscape;
#[cfg(feature = "height_maps")]
mod map_file;
pub mod program;
#[cfg(feature = "reference")]
pub mod reference;
pub mod settings;
pub mod temporal;
pub mod terrain;
pub mod view;

/// The programs that this crate's build composed, with the layouts of their parameter blocks.
#[allow(clippy::all)]
pub mod programs {
    include!(concat!(env!("OUT_DIR"), "/veduta_programs.rs"));
}

pub use atmosphere::Atmosphere;
pub use error::Error;
pub use glam;
pub use landscape::{Landscape, LandscapeOptions, Resources, Targets, Work};
pub use program::{ComposedProgram, ProgramSet, Value};
pub use programs::programs;
pub use settings::{Preset, Settings};
pub use view::{Light, View, WorldPos};
pub use wgpu;
