//! What several test modules share.

pub mod folder;
pub mod render;

pub use steradian::bench::stability::{geometry, scenes};
