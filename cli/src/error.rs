//! What can go wrong on the command line, in one sentence each.

use std::path::{Path, PathBuf};

use veduta_compose::Diags;

/// Every fault that a command reports.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// A fault of the library.
    #[error(transparent)]
    Veduta(#[from] veduta::Error),
    /// Faults of shaders, programs or RON files, each with its place.
    #[error("{0}")]
    Faults(#[from] Diags),
    /// An argument that cannot be read or lies outside what is allowed.
    #[error("`{name}` is `{value}`, but must be {domain}")]
    Argument {
        /// The argument.
        name: String,
        /// The value given.
        value: String,
        /// What is allowed.
        domain: String,
    },
    /// A file that cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file that cannot be written.
    #[error("{}: cannot be written: {why}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// A file of rows that does not hold what is needed.
    #[error("{}: {what}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// A cell of a file of rows that does not fit its column.
    #[error("{}: row {row}, column {column} (counted from 0) is {value}, but {needed}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The row, from 0; a header line does not count.
        row: usize,
        /// The column, from 0.
        column: usize,
        /// The value.
        value: String,
        /// What the column needs.
        needed: String,
    },
    /// Paths or names that lead nowhere.
    #[error("{what} `{name}` does not exist{}", or_else(.hint))]
    Missing {
        /// What was looked for.
        what: &'static str,
        /// The name or path given.
        name: String,
        /// What exists instead; may be empty.
        hint: String,
    },
    /// A process that measures has failed.
    #[error("measuring in a process of its own failed: {what}")]
    Child {
        /// What it said.
        what: String,
    },
    /// `veduta stress` has found something wrong; it has been printed.
    #[error("{count} thing{} wrong", if *.count == 1 { " is" } else { "s are" })]
    Stress {
        /// How many.
        count: usize,
    },
    /// `veduta lint` has found faults; they have been printed.
    #[error("{count} fault{} found", if *.count == 1 { "" } else { "s" })]
    Lint {
        /// How many.
        count: usize,
    },
}

fn or_else(hint: &str) -> String {
    if hint.is_empty() {
        String::new()
    } else {
        format!("; {hint}")
    }
}

impl CliError {
    /// A fault of an argument.
    pub fn argument(
        name: impl Into<String>,
        value: impl Into<String>,
        domain: impl Into<String>,
    ) -> CliError {
        CliError::Argument {
            name: name.into(),
            value: value.into(),
            domain: domain.into(),
        }
    }

    /// A fault in writing `path`.
    pub fn write(path: &Path, why: impl ToString) -> CliError {
        CliError::Write {
            path: path.to_owned(),
            why: why.to_string(),
        }
    }

    /// A fault in reading `path`.
    pub fn read(path: &Path, source: std::io::Error) -> CliError {
        CliError::Read {
            path: path.to_owned(),
            source,
        }
    }
}
