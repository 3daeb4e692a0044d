//! Composes the programs.
fn main() {}
