//! Outdoor landscapes for wgpu: composable WGSL modules and ready-to-bind pipelines.
//!
//! The user owns instance, device, queue, surface and submission; this crate records into them. A system is built once
//! with `new`, uploads and bakes in `prepare`, and draws into the host's passes.
//!
//! The WGSL is composed while this crate is built; `programs` holds the variants of every shipped scene and preset.

pub mod device;
pub mod error;
#[cfg(feature = "compose")]
pub mod eval;
pub mod program;
#[cfg(feature = "reference")]
pub mod reference;
pub mod settings;
pub mod view;

pub use error::Error;
pub use glam;
pub use program::{ComposedProgram, ProgramSet, Value};
pub use settings::{Preset, Settings};
pub use view::{Light, View, WorldPos};
pub use wgpu;
