//! What the benchmarks share: models, rays, and the accelerators of other crates.

pub mod models;
pub mod others;
pub mod rays;
