//! Every test of the library that runs on the device or builds something, in one binary.

mod accuracy;
mod atmosphere;
mod clouds;
mod common;
mod eval;
mod fractal;
mod hash;
mod landscape;
mod noise;
mod phase;
mod planet;
mod sweep;
mod terrain;
mod tone_map;
