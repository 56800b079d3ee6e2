//! The film: samples go in, weighted by a pixel filter, and a picture with its layers comes out.
//!
//! Filters are importance sampled, so a sample touches one pixel and tiles share nothing: any number of threads gives the same sums.

mod filter;
mod image;
mod layer;
mod tile;

pub use filter::{Filter, FilterSample};
pub use image::{Crop, Image, Layer};
pub use layer::{LayerInfo, LayerKind, LayerSet};
pub use tile::{DroppedSample, Film, FilmTile, bytes_per_pixel};

use crate::color::Rgb;
use crate::math::Vec3;

/// What one sample of a pixel brings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance, without the filter's weight.
    pub radiance: Rgb,
    /// 1 where something was hit, 0 where not.
    pub alpha: f32,
    /// The first surface; zero where `alpha` is.
    pub surface: SurfaceSample,
}

/// What layers other than the picture need of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceSample {
    /// Depth along the view axis.
    pub depth: f32,
    /// Shading normal, world.
    pub normal: Vec3,
    /// Position, world.
    pub position: Vec3,
    /// Fraction of light scattered.
    pub albedo: Rgb,
}
