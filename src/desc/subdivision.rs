//! Subdivision surfaces and displacement.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lists::{OneOrMore, one_or_more};

/// A subdivision surface, by the rules of OpenSubdiv. Faces are refined when the scene is loaded, and their vertices
/// moved to the limit surface.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubdivisionDesc {
    /// How faces are refined. Default: `catmull_clark`.
    #[serde(default)]
    pub scheme: SubdivisionSchemeDesc,
    /// Levels, from 0 to 16; each makes four faces of one. With `catmull_clark` the first, which makes quadrilaterals
    /// of all faces, is always made. With `edge_length` no face is refined more often. Default: 2, or 10 with
    /// `edge_length`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<u32>,
    /// Refines only faces with an edge of more pixels of the `film` than this, above 0, as seen face-on from the camera
    /// when the shutter opens; of an object, its 64 instances that look largest count. Default: all faces are refined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_length: Option<f64>,
    /// Edges that are creases. Default: none.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<CreaseDesc>")]
    pub creases: Vec<CreaseDesc>,
    /// Vertices that are sharp. Default: none.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<CornerDesc>")]
    pub corners: Vec<CornerDesc>,
    /// What borders of the mesh are. Default: `edge_and_corner`.
    #[serde(default)]
    pub boundary: BoundaryDesc,
    /// How uv are refined. Default: `smooth_inside`.
    #[serde(default)]
    pub uvs: SubdivisionUvsDesc,
    /// The most triangles, from 1 to 536870912. More `levels` than that allows are an error; refinement by
    /// `edge_length` ends at about so many, with a warning. Default: 8388608.
    #[serde(default = "max_triangles")]
    pub max_triangles: u64,
}

/// How faces are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SubdivisionSchemeDesc {
    /// Catmull and Clark's scheme, for quadrilaterals and other faces.
    #[default]
    CatmullClark,
    /// Loop's scheme, for triangles; other faces are cut into triangles before.
    Loop,
}

/// What borders of a mesh become.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoundaryDesc {
    /// Smooth curves, but vertices of only one face stay corners.
    #[default]
    EdgeAndCorner,
    /// Smooth curves.
    EdgeOnly,
}

/// How uv are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SubdivisionUvsDesc {
    /// As positions, but the borders of charts stay as they are, so that textures are not distorted.
    #[default]
    SmoothInside,
    /// Linearly over each face.
    Linear,
}

/// Edges in a row that are a crease.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CreaseDesc {
    /// Two vertices or more, from 0: each and the next are the ends of an edge. Not for OBJ files, which number
    /// positions, not vertices.
    pub vertices: Vec<u32>,
    /// How many levels the edges stay sharp; 10 or more for all. Default: 10.
    #[serde(default = "sharp")]
    pub sharpness: f32,
}

/// Vertices that are sharp.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CornerDesc {
    /// Vertices, from 0. Not for OBJ files.
    pub vertices: Vec<u32>,
    /// How many levels the vertices stay sharp; 10 or more for all. Default: 10.
    #[serde(default = "sharp")]
    pub sharpness: f32,
}

/// Moves the vertices of a mesh by a texture: by `scale` times what the texture is above `midlevel`. Lengths are those
/// of the mesh's own space, before its `transform`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisplacementDesc {
    /// The texture's name; numbers are linear unless the texture specifies otherwise. Attributes of meshes cannot be
    /// used.
    pub texture: String,
    /// The length that a step of 1 in the texture is. Default: 1.
    #[serde(default = "one")]
    pub scale: f64,
    /// The value of the texture that moves nothing. Default: 0.5 along normals, else 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub midlevel: Option<f64>,
    /// Where to. Default: `normal`.
    #[serde(default)]
    pub space: DisplacementSpaceDesc,
}

/// In which directions vertices are moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DisplacementSpaceDesc {
    /// Along the smooth normal, by the texture's luminance or chosen channel.
    #[default]
    Normal,
    /// By the texture's colour: red along u, green along v, blue along the smooth normal, in the frame of normal maps.
    Tangent,
    /// By the texture's colour: red, green and blue along x, y and z of the mesh's space.
    Object,
}

impl Default for SubdivisionDesc {
    fn default() -> Self {
        Self {
            scheme: SubdivisionSchemeDesc::default(),
            levels: None,
            edge_length: None,
            creases: Vec::new(),
            corners: Vec::new(),
            boundary: BoundaryDesc::default(),
            uvs: SubdivisionUvsDesc::default(),
            max_triangles: max_triangles(),
        }
    }
}

fn max_triangles() -> u64 {
    1 << 23
}

fn sharp() -> f32 {
    10.0
}

fn one() -> f64 {
    1.0
}
