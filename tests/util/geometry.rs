//! Meshes and the closest-hit loop that tests share.

pub use steradian::bench::stability::geometry::*;
