//! Normal maps and bump maps as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An image of normals in tangent space: red along u, green along v (upward in the image), blue along the normal, each
/// as `2 x - 1` of a linear value. On meshes the frame is MikkTSpace's, with the mesh's normals; on other shapes it is
/// that of u and v.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalMapDesc {
    /// The texture's name. Its `color_space` must not be `srgb`.
    pub texture: String,
    /// Factor on the tilt, from 0 to 16. Default: 1.
    #[serde(default = "one")]
    pub strength: f32,
    /// Whether green grows downward in the image, as in maps made for DirectX. Default: false.
    #[serde(default)]
    pub flip_y: bool,
}

/// A texture of heights along the normal.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BumpMapDesc {
    /// The texture's name.
    pub texture: String,
    /// Height in world units where the texture is 1; below 0 turns bumps into dents. Default: 1.
    #[serde(default = "one")]
    pub height: f32,
}

fn one() -> f32 {
    1.0
}
