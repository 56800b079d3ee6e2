//! Scenes written as JSON values, rendered and judged.

pub use steradian::bench::stability::render::*;
