//! Outputs as written.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::lists::{OneOrMore, one_or_more};

/// A file to write; its extension (`.exr` or `.png`) selects the format.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputDesc {
    /// Where, relative to the working directory.
    pub file: String,
    /// EXR: what to store beside the picture. Default: nothing.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<LayerKind>")]
    pub layers: Vec<LayerKind>,
    /// EXR: how channels are named and put into parts, for the program that reads the file. Default: default.
    #[serde(default, skip_serializing_if = "is_default")]
    pub profile: ExrProfileDesc,
    /// EXR: how colour and normals are stored. What 16 bits would spoil is always of 32. Default: half.
    #[serde(default)]
    pub pixel_type: PixelTypeDesc,
    /// EXR: how single layers are stored in place of that, such as `{ "albedo": "float" }`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub pixel_types: BTreeMap<LayerKind, PixelTypeDesc>,
    /// EXR: compression. Default: zip; zips with the profile nuke.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compression: Option<CompressionDesc>,
    /// EXR: how much dwaa and dwab lose; 0 is nearly nothing, 45 hard to see. Default: 45.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dwa_level: Option<f32>,
    /// EXR: store the whole picture, black around the crop, for programs that ignore data windows. Default: false.
    #[serde(default, skip_serializing_if = "is_default")]
    pub uncropped: bool,
    /// EXR: Cryptomatte ranks, the number of objects stored per pixel: an even number. Default: 6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crypto_depth: Option<u32>,
    /// EXR: where Cryptomatte's names are stored. Default: embedded.
    #[serde(default, skip_serializing_if = "is_default")]
    pub crypto_manifest: CryptoManifestDesc,
    /// EXR: the attribute `owner`. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub owner: Option<String>,
    /// EXR: text before the description of layers in the attribute `comments`. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comments: Option<String>,
    /// EXR: the attribute `framesPerSecond`. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames_per_second: Option<f64>,
    /// PNG: exposure in stops before the view. Default: 0.
    #[serde(default)]
    pub exposure: f32,
    /// PNG: how light becomes colours of the display. Default: agx; srgb with the integrators that show data in place
    /// of light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<ViewDesc>,
}

impl OutputDesc {
    /// An output with every default.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            layers: Vec::new(),
            profile: ExrProfileDesc::default(),
            pixel_type: PixelTypeDesc::default(),
            pixel_types: BTreeMap::new(),
            compression: None,
            dwa_level: None,
            uncropped: false,
            crypto_depth: None,
            crypto_manifest: CryptoManifestDesc::default(),
            owner: None,
            comments: None,
            frames_per_second: None,
            exposure: 0.0,
            view: None,
        }
    }
}

/// Reads a list of outputs, or one; each may be the name of its file alone.
pub fn outputs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<OutputDesc>, D::Error> {
    let entries: Vec<OutputEntry> = one_or_more(deserializer)?;
    Ok(entries.into_iter().map(|OutputEntry(output)| output).collect())
}

/// An output, or its file alone.
struct OutputEntry(OutputDesc);

impl<'de> Deserialize<'de> for OutputEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entry;

        impl<'de> Visitor<'de> for Entry {
            type Value = OutputDesc;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a file, or an output with the key \"file\"")
            }

            fn visit_str<E: Error>(self, file: &str) -> Result<Self::Value, E> {
                Ok(OutputDesc::new(file))
            }

            fn visit_map<A: MapAccess<'de>>(self, output: A) -> Result<Self::Value, A::Error> {
                OutputDesc::deserialize(MapAccessDeserializer::new(output))
            }
        }

        deserializer.deserialize_any(Entry).map(Self)
    }
}

/// An output, or the name of its file alone.
#[derive(JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
#[expect(dead_code, reason = "only its schema is needed")]
pub enum OutputEntrySchema {
    /// The name of the file, with every default.
    File(String),
    /// With more keys.
    Output(Box<OutputDesc>),
}

/// A layer of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayerKind {
    /// The picture: radiance, premultiplied by coverage, and coverage. It is always there, so scenes do not name it.
    #[serde(skip)]
    Color,
    /// Depth along the view axis (not ray length), or the distance from an environment camera, in world units; 1e10
    /// where nothing was hit.
    #[serde(rename = "Z")]
    Z,
    /// Shading normal in world space; zero where nothing was hit.
    #[serde(rename = "N")]
    N,
    /// Geometric normal in world space; zero where nothing was hit.
    #[serde(rename = "Ng")]
    Ng,
    /// Position in world space; zero where nothing was hit.
    #[serde(rename = "P")]
    P,
    /// Surface parameters; zero where nothing was hit.
    Uv,
    /// How far the surface moves in the picture from when the shutter opens to when it closes, in pixels to the right
    /// and down.
    Motion,
    /// Fraction of light scattered by the first surface.
    Albedo,
    /// Light scattered once, by diffuse reflection. This and the nine that follow sum to the picture.
    DiffuseDirect,
    /// Light scattered more than once, the last time before the camera by diffuse reflection.
    DiffuseIndirect,
    /// Light scattered once, by specular reflection.
    SpecularDirect,
    /// Light scattered more than once, the last time before the camera by specular reflection.
    SpecularIndirect,
    /// Light scattered once, through a surface.
    TransmissionDirect,
    /// Light scattered more than once, the last time before the camera through a surface.
    TransmissionIndirect,
    /// Light scattered once, by a medium.
    VolumeDirect,
    /// Light scattered more than once, the last time before the camera by a medium.
    VolumeIndirect,
    /// Light emitted by the surface that is seen, or by a medium before it.
    Emission,
    /// Light from infinity that is seen directly.
    Background,
    /// A layer `light_NAME` for each group of lights and `light_default` for lights in no group; they sum to the
    /// picture.
    LightGroups,
    /// Variance of the picture's red, green and blue, that is, their expected squared error, as far as the samples show
    /// it.
    Variance,
    /// Number of samples.
    Samples,
    /// Fraction of light scattered by the first surface that is no mirror and no clear glass: the albedo feature for
    /// denoisers.
    FeatureAlbedo,
    /// Mean shading normal of that surface in world space: the normal feature for denoisers.
    FeatureNormal,
    /// The picture before it was denoised, which denoisers add.
    #[serde(skip)]
    Noisy,
    /// A number for the object that covers most of the pixel, 0 for none.
    ObjectId,
    /// A number for the material that covers most of the pixel, 0 for none.
    MaterialId,
    /// A number for the instance that covers most of the pixel, 0 for none.
    InstanceId,
    /// Cryptomatte of objects: mattes by name.
    CryptoObject,
    /// Cryptomatte of materials.
    CryptoMaterial,
    /// Cryptomatte of assets, which are groups of objects.
    CryptoAsset,
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

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// How scene-linear light becomes the 8-bit colours of an sRGB display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViewDesc {
    /// AgX (Troy Sobotka): 16.5 stops, bright colours tend to white; middle grey, 0.18, is code value 0.5.
    #[default]
    Agx,
    /// The filmic curve of Uncharted 2 (John Hable), each channel by itself; 5.6 and more is white.
    Filmic,
    /// The sRGB curve alone: 1 and more is white. For data and exact values.
    Srgb,
}

impl ViewDesc {
    /// Every view with its name.
    pub const ALL: [(Self, &'static str); 3] = [(Self::Agx, "agx"), (Self::Filmic, "filmic"), (Self::Srgb, "srgb")];

    /// The view's name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// The application that an EXR file is made for: channel names, parts and compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExrProfileDesc {
    /// One part with names that every program reads.
    #[default]
    Default,
    /// As the default, compressed line by line, which Nuke reads fastest.
    Nuke,
    /// One part with the names of Blender's passes.
    Blender,
    /// Three parts: picture and colour layers, data, Cryptomatte. A program reads only the parts it needs.
    Multipart,
}

impl ExrProfileDesc {
    /// Every profile with its name.
    pub const ALL: [(Self, &'static str); 4] =
        [(Self::Default, "default"), (Self::Nuke, "nuke"), (Self::Blender, "blender"), (Self::Multipart, "multipart")];

    /// The profile's name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// Where Cryptomatte's names are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CryptoManifestDesc {
    /// In the picture's metadata.
    #[default]
    Embedded,
    /// In files beside the picture, one for each kind of matte.
    Sidecar,
}

/// EXR compression; lossless except for dwaa and dwab.
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
    /// Lossy cosine transform over blocks of 32 lines, for colour only.
    Dwaa,
    /// Lossy cosine transform over blocks of 256 lines, for colour only.
    Dwab,
}
