//! The composer.

pub mod diag;
