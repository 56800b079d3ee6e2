//! Random numbers, warps beside their densities, discrete, piecewise-constant and bilinear distributions, weights that
//! combine strategies.

mod bilinear;
mod discrete;
mod mis;
mod piecewise;
mod sampler;
#[cfg(test)]
#[path = "../../crates/bench/src/stability/statistics.rs"]
pub mod statistics;
pub mod warp;

pub use bilinear::{BilinearDensity, BilinearTable, BilinearWarp, SliceMix};
pub use discrete::{AliasTable, DiscreteSample};
pub use mis::power_heuristic;
pub use piecewise::{Piecewise2d, PiecewiseCell, PiecewiseCellRows, PiecewiseSample, PiecewiseScratch};
pub use sampler::{PixelSeed, SampleIdRows, SampleRows, Sampler, SamplerKind};
