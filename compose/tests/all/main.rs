//! All tests of the composer in one binary.

mod faults;
mod link;
mod readers;
