//! Outputs as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A file to write; its extension (`.exr` or `.png`) says which kind.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputDesc {
    /// Where, relative to the working directory.
    pub file: String,
    /// EXR: what to store beside the picture. Default: nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<LayerDesc>,
    /// EXR: how colour is stored. Z and P are always 32-bit. Default: half.
    #[serde(default)]
    pub pixel_type: PixelTypeDesc,
    /// EXR: compression, always lossless. Default: zip.
    #[serde(default)]
    pub compression: CompressionDesc,
    /// PNG: exposure in stops before the sRGB curve. Default: 0.
    #[serde(default)]
    pub exposure: f32,
}

impl OutputDesc {
    /// An output with every default.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            layers: Vec::new(),
            pixel_type: PixelTypeDesc::default(),
            compression: CompressionDesc::default(),
            exposure: 0.0,
        }
    }
}

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
pub enum LayerDesc {
    /// Depth along the view axis (not ray length), or the distance from an environment camera, in world units; 1e10 where nothing was hit.
    Z,
    /// Shading normal in world space; zero where nothing was hit.
    N,
    /// Position in world space; zero where nothing was hit.
    P,
    /// Fraction of light scattered by the first surface.
    #[serde(rename = "albedo")]
    Albedo,
    /// Variance of the picture's red, green and blue, that is, their expected squared error, as far as the samples show it.
    #[serde(rename = "variance")]
    Variance,
    /// Number of samples.
    #[serde(rename = "samples")]
    Samples,
}

/// How colour is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PixelTypeDesc {
    /// 16-bit floats.
    #[default]
    Half,
    /// 32-bit floats.
    Float,
}

/// Lossless EXR compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CompressionDesc {
    /// Deflate over blocks of 16 lines.
    #[default]
    Zip,
    /// Deflate line by line.
    Zips,
    /// Wavelets.
    Piz,
    /// Run lengths.
    Rle,
    /// None.
    None,
}
