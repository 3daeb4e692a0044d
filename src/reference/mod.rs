//! The f64 twins of the module functions, written from the formulas.

pub mod fractal;
pub mod hash;
pub mod noise;
