//! The film: samples go in, weighted by a pixel filter, and a picture with its layers comes out.
//!
//! A sample counts for all pixels that the filter reaches from it; tiles have borders for what reaches other tiles, so
//! they share nothing. Sums do not depend on the order of their terms. So any number of threads gives the same picture,
//! and so does any split of the samples.

mod accumulator;
mod cells;
mod coverage;
mod filter;
mod identities;
mod image;
mod layer;
mod nearest;
mod resolve;
mod sample;
mod shared_weights;
mod splats;
mod state;
mod sum;
mod tile;
mod tiles;

pub use crate::desc::LayerKind;
pub use coverage::{Coverage, CoverageCounts};
pub use filter::{Filter, FilterSample, VarianceKernel};
pub use identities::{Identities, Label, NameId, PlacementId, ShapeIdentity};
pub use image::{Crop, Image, Layer};
pub use layer::{Filtering, LayerInfo, LayerSet, LayerSource};
pub use sample::{
    LightAov, LightAovRequest, LightAovRows, LightAovSample, PixelSample, Sample, SampleBatch, ShapeKey, SurfaceSample,
};
pub use splats::Splats;
pub use sum::SumPlane;
pub use tile::{DroppedSample, FilmTile, WorldSample};
pub use tiles::{Film, FilmGrid, FilmShape, bytes_per_pixel};

use tiles::Layout;
