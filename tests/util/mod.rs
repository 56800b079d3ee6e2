//! What several test modules share.

pub mod folder;
pub mod program;
pub mod render;

use std::path::Path;

pub use steradian_bench::stability::{geometry, scenes};

/// The folder of the repository.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
