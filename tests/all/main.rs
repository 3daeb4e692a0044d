//! Every test of the library that runs on the device or builds something, in one binary.

mod accuracy;
mod atmosphere;
mod clouds;
mod common;
mod downstream;
mod eval;
mod examples;
mod getting_started;
mod phase;
mod planet;
mod terrain;
mod tone_map;
mod validators;
