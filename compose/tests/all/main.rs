//! All tests of the composer in one binary.

mod emit;
mod faults;
mod fuzz;
mod gates;
mod library;
mod link;
mod readers;
