//! How the normals of meshes are found, and what their vertices and triangles have.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a mesh's normals are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshShadingDesc {
    /// Given normals are interpolated; without them the mesh is flat.
    #[default]
    Auto,
    /// Flat, even where normals are given.
    Flat,
    /// Smooth: given normals, or computed ones where none are given.
    Smooth,
    /// Smooth with computed normals, even where normals are given.
    Computed,
}

/// How computed normals are averaged over the triangles around a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NormalWeightDesc {
    /// By the angle of the triangle at the vertex: does not depend on how faces are cut into triangles.
    #[default]
    Angle,
    /// By the area of the triangle: large faces stay flatter.
    Area,
    /// All the same.
    Uniform,
}

/// Which triangles computed normals are averaged over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SmoothByDesc {
    /// Those with a corner at the same position: no seams where a file has several vertices at one place, for their uv.
    #[default]
    Position,
    /// Those with the same vertex.
    Index,
}

/// The values of an attribute of a mesh: a number each, or a linear colour each.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "expected a list of numbers, or of colours such as [0.5, 0.2, 0.1]")]
pub enum AttributeDesc {
    /// Numbers.
    Numbers(Vec<f32>),
    /// Linear colours.
    Colors(Vec<[f32; 3]>),
}
