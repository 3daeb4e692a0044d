//! The composer.

pub mod diag;
pub mod fuzz;
pub mod header;
pub mod keys;
pub mod ron_place;
pub mod settings;
pub mod sp;
