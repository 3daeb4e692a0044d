//! The f64 twins of the module functions, written from the formulas.
