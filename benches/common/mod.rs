//! What the benchmarks share: models, rays, and what others' accelerators answer. Each benchmark uses a part.
#![allow(dead_code)]

pub mod models;
pub mod others;
pub mod rays;
