//! The film: samples go in, weighted by a pixel filter, and a picture with its layers comes out.
//!
//! Filters are importance sampled, so a sample touches one pixel and tiles share nothing. Sums do not depend on the order of their terms. So any
//! number of threads gives the same picture, and so does any split of the samples.

mod coverage;
mod filter;
mod identities;
mod image;
mod layer;
mod sample;
mod state;
mod sum;
mod tile;
mod tiles;

pub use coverage::{Coverage, CoverageCounts};
pub use filter::{Filter, FilterSample};
pub use identities::{Identities, Label, NameId, PlacementId, ShapeIdentity};
pub use image::{Crop, Image, Layer};
pub use layer::{Average, LayerInfo, LayerKind, LayerSet, Source};
pub use sample::{Part, PartNeeds, PixelSample, Sample, SampleBatch, ShapeKey, SurfaceSample};
pub use sum::Sums;
pub use tile::{DroppedSample, FilmTile};
pub use tiles::{Film, bytes_per_pixel};

use tiles::FilmLayers;
