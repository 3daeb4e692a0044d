//! Located errors, the `.sp` reader, keys, presets, scenes, views and module headers.

mod diag;
mod header;
mod settings;
mod sp;
