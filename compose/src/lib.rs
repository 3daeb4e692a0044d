//! The composer.

pub mod build;
pub mod compose;
pub mod diag;
pub mod emit;
pub mod fuzz;
pub mod gate;
pub mod header;
pub mod keys;
pub mod library;
pub mod link;
pub mod lint;
pub mod reflect;
pub mod ron_place;
pub mod scan;
pub mod settings;
pub mod sp;

pub use build::Build;
pub use compose::{Composed, Composer, finish};
pub use diag::{Diag, Diags};
pub use keys::Keys;
pub use library::Library;
pub use link::{Def, Defs, LinkInput, Linker};

/// The version of naga that this crate links and writes with.
pub use naga;
