//! Every test that needs more than one module.

mod downstream;
mod examples;
mod getting_started;
mod validators;
