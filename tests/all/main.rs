//! Every test of the library that runs on the device or builds something, in one binary.

mod accuracy;
mod atmosphere;
mod common;
mod eval;
mod phase;
mod planet;
mod tone_map;
