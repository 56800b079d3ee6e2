//! pbrt-v4 scenes.

mod area_light;
mod bilinear;
mod camera;
mod colors;
mod curves;
mod directives;
mod lights;
mod materials;
mod media;
mod octahedral;
mod options;
mod params;
mod shapes;
mod state;
mod subsurface;
mod textures;
mod tokens;
mod transforms;
mod triangles;
mod volumes;

#[cfg(test)]
mod tests;

use std::path::Path;

use super::{ImportOptions, Imported};
use crate::error::Result;

/// Reads a pbrt file.
pub fn read(path: &Path, _options: &ImportOptions) -> Result<Imported> {
    directives::Reader::new(path).read()
}
