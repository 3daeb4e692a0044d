//! All tests of the composer in one binary.

mod link;
