//! Scenes and rays for tests that compare accelerators.

pub use steradian::bench::stability::scenes::*;
