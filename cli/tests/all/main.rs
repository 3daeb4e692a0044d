//! The command line from end to end.

mod bench;
mod ci_job;
mod common;
mod compose;
mod cost;
mod eval;
mod frozen;
mod land;
mod lint;
mod list;
mod probe;
mod render;
mod simulate;
mod stress;
mod usage;
