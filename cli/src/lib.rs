//! The library behind the command `veduta`: rendering in tiles, pictures and tables as files, run-time composition.

pub mod args;
pub mod bench;
pub mod camera;
pub mod catalog;
pub mod commands;
pub mod cost;
pub mod cpu;
pub mod error;
pub mod image;
pub mod metrics;
pub mod render;
pub mod shipped;
pub mod stress;
pub mod table;
pub mod under_sky;

pub use args::Args;
pub use error::CliError;
