//! The f64 twins of the module functions, written from the formulas, and the references that they are judged by.
//!
//! References, each with an error: [`quadrature`], [`sky`] (scattered once), [`sky_paths`] (all orders), [`probe`] (both),
//! [`volume`] (both, in any medium), [`intersect`].
//! What they stand on: [`monte_carlo`], [`parallel`].

pub mod air_ray;
pub mod air_tables;
pub mod atmosphere;
pub mod clouds;
pub mod field;
pub mod fractal;
pub mod globe;
pub mod ground;
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
pub mod probe;
pub mod quadrature;
pub mod relief;
pub mod sky;
pub mod sky_paths;
pub mod terrain;
pub mod textbook;
pub mod tone_map;
pub mod volume;
