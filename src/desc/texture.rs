//! Textures as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ColorDesc;
use super::lists::{Spread, spread};

/// A texture. Every shape has its uv, described there; on an image the origin of uv is the bottom left corner and v
/// grows upward.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum TextureDesc {
    /// A checkerboard in uv.
    Checker {
        /// Colour of the square at the origin of uv. Default: 0.4.
        #[serde(default = "dark", deserialize_with = "spread")]
        #[schemars(with = "Spread<3>")]
        color0: [f32; 3],
        /// Colour of its neighbours. Default: 0.2.
        #[serde(default = "darker", deserialize_with = "spread")]
        #[schemars(with = "Spread<3>")]
        color1: [f32; 3],
        /// Repetitions of a pair of squares along u and v. Default: 1, 1.
        #[serde(default = "unit_scale", deserialize_with = "spread")]
        #[schemars(with = "Spread<2>")]
        scale: [f32; 2],
    },
    /// The same colour everywhere.
    Constant {
        /// The colour.
        #[serde(deserialize_with = "spread")]
        #[schemars(with = "Spread<3>")]
        color: [f32; 3],
    },
    /// An image, which fills the unit square of uv.
    Image {
        /// A PNG, JPEG, TGA, Radiance HDR or OpenEXR file of any size with grey or red, green and blue, with or without
        /// alpha, in 8 or 16 bits or floats; relative to the scene file. Colours are taken as they are stored, not
        /// divided by alpha.
        file: String,
        /// How whole numbers become colours. Default: `auto`.
        #[serde(default)]
        color_space: ColorSpaceDesc,
        /// What stands between the middles of pixels, and what is seen where they are small in the picture. Default:
        /// `trilinear`.
        #[serde(default)]
        filter: TextureFilterDesc,
        /// What lies beyond the edges: one word, or one for u and one for v. Default: `repeat`.
        #[serde(default)]
        wrap: WrapDesc,
        /// The image is looked up at `offset + R (scale * uv)`, where R turns from u towards v by `rotation_degrees`.
        /// So a scale of 2 shows it twice along each axis, and -1 mirrors it. Default: 1, 1.
        #[serde(default = "unit_scale", deserialize_with = "spread")]
        #[schemars(with = "Spread<2>")]
        scale: [f32; 2],
        /// See `scale`. Default: 0.
        #[serde(default)]
        rotation_degrees: f64,
        /// See `scale`. Default: 0, 0.
        #[serde(default)]
        offset: [f32; 2],
        /// One number of each pixel in place of its colour. Default: where a colour is needed, the colour; where a
        /// number is needed, its luminance.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        channel: Option<ChannelDesc>,
        /// Whether 1 minus the value is meant. Default: false.
        #[serde(default)]
        invert: bool,
    },
    /// The colour of the surface itself: between those of a mesh's vertices, which may have any. In a PLY file these
    /// are `red`, `green` and `blue` (or `r`, `g` and `b`) of the vertices, linear as floats and sRGB as whole numbers;
    /// in an OBJ file three numbers behind those of a position, sRGB. The same as `mesh_attribute` with the name
    /// `vertex_color`.
    VertexColor,
    /// An attribute of the mesh itself: numbers or colours, between those of its vertices or one for each face. Opacity
    /// and what is no colour take the luminance of a colour. For parameters of materials, opacity and emission, on
    /// meshes that have it.
    MeshAttribute {
        /// `vertex_NAME` or `face_NAME`. A PLY file has it if consecutive properties of its vertices or faces are
        /// called `NAME_0` (a number) or `NAME_0`, `NAME_1`, `NAME_2` (a colour; as well from `_1`, or with `_x`, `_y`,
        /// `_z`; with `_r`, `_g`, `_b` it is `NAME_color`); `r`, `g`, `b` and `red`, `green`, `blue` are `vertex_color`
        /// or `face_color`, linear as floats and sRGB as whole numbers. All others are taken as they are. Inline meshes
        /// have `attributes`.
        name: String,
        /// Factor on the values; with it they are from 0 to 1, of emission not below 0. Default: 1.
        #[serde(default = "one", skip_serializing_if = "is_one")]
        scale: f32,
    },
    /// The product of several colours and textures, such as an image and a tint.
    Product {
        /// What is multiplied: colours, numbers or textures by name.
        factors: Vec<ColorDesc>,
    },
}

/// How the whole numbers of an image become colours. Floats (HDR, EXR) and alpha are linear in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorSpaceDesc {
    /// As `srgb` for colours; as `linear` for data: roughness, normals, heights, opacity.
    #[default]
    Auto,
    /// By the sRGB transfer curve.
    Srgb,
    /// In proportion.
    Linear,
}

/// The filter of an image's pixels: how they are interpolated, and how they are averaged where they are smaller than
/// the footprint of a sample of the picture.
///
/// The footprint of a sample is its pixel divided by the samples per pixel requested for the render, traced through
/// mirrors and glass too; after other surfaces, that of the lobe that they sample from. So pictures have less noise,
/// and what is blurred vanishes as the samples become more. Opacity, normal and bump maps, emission and the amount of a
/// mix are always looked up as `bilinear` does it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureFilterDesc {
    /// The nearest pixel.
    Nearest,
    /// The four nearest pixels, blended in linear colours.
    Bilinear,
    /// As `bilinear`, in smaller versions of the image where a sample's footprint is larger than a pixel of it.
    #[default]
    Trilinear,
}

/// What lies beyond the edges of an image: the same along u and v, or `[along u, along v]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"repeat\", \"clamp\" or \"mirror\", or one of them for u and one for v")]
pub enum WrapDesc {
    /// The same along u and v.
    Both(WrapModeDesc),
    /// Along u, along v.
    Each([WrapModeDesc; 2]),
}

impl Default for WrapDesc {
    fn default() -> Self {
        Self::Both(WrapModeDesc::Repeat)
    }
}

/// What lies beyond the edges of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WrapModeDesc {
    /// The image again.
    Repeat,
    /// The colours of the edge.
    Clamp,
    /// The image's mirror image, then the image again.
    Mirror,
}

/// One of the numbers of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ChannelDesc {
    /// Red, or grey.
    R,
    /// Green, or grey.
    G,
    /// Blue, or grey.
    B,
    /// Alpha; 1 where the image has none.
    A,
}

fn one() -> f32 {
    1.0
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_one(scale: &f32) -> bool {
    *scale == 1.0
}

fn dark() -> [f32; 3] {
    [0.4; 3]
}

fn darker() -> [f32; 3] {
    [0.2; 3]
}

fn unit_scale() -> [f32; 2] {
    [1.0; 2]
}
