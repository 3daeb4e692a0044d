//! Located errors, the `.sp` reader, keys, presets, scenes, views and module headers.

mod diag;
mod settings;
mod sp;
