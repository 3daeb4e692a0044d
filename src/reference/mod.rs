//! The f64 twins of the module functions, written from the formulas.

pub mod atmosphere;
pub mod clouds;
pub mod fractal;
pub mod hash;
pub mod intersect;
pub mod math;
pub mod medium;
pub mod monte_carlo;
pub mod noise;
pub mod parallel;
pub mod phase;
pub mod planet;
pub mod post;
pub mod quadrature;
pub mod sky;
pub mod sky_paths;
pub mod terrain;
pub mod tone_map;
