//! What several test modules share.

pub mod folder;
pub mod geometry;
pub mod render;
pub mod scenes;
