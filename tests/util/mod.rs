//! What several test modules share.

pub mod folder;
pub mod program;
pub mod render;

pub use steradian::bench::stability::{geometry, scenes};
