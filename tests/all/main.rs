//! Every test of the library that runs on the device or builds something, in one binary.

mod common;
mod eval;
