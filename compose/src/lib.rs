//! The composer.

pub mod compose;
pub mod diag;
pub mod gate;
pub mod library;
pub mod link;
pub mod scan;

pub use compose::finish;
pub use diag::{Diag, Diags};
pub use library::Library;
pub use link::{Def, Defs, LinkInput, Linker};
pub mod sp;
