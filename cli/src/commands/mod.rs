//! One module a command: its arguments and `run`.

pub mod bench;
pub mod compose;
pub mod cost;
pub mod diff;
pub mod eval;
pub mod land;
pub mod lint;
pub mod list;
pub mod probe;
pub mod render;
pub mod simulate;
pub mod sky;
pub mod stress;
