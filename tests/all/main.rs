//! Every test of the library that runs on the device or builds something, in one binary.

mod accuracy;
mod air;
mod atmosphere;
mod clouds;
mod common;
mod downstream;
mod eval;
mod examples;
mod fractal;
mod getting_started;
mod hash;
mod landscape;
mod noise;
mod periodic;
mod phase;
mod planet;
mod probe;
mod reference;
mod simplex;
mod sky;
mod sweep;
mod terrain;
mod tone_map;
mod validators;
mod warp;
mod worley;
