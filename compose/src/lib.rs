//! The composer.

pub mod diag;
pub mod sp;
