//! Shapes, objects and instances as written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::curves::{CurveBasisDesc, CurveKindDesc, radius_scale};
use super::lists::{OneOrMore, object_option, one_or_more};
use super::mesh::{AttributeDesc, MeshShadingDesc, NormalWeightDesc, SmoothByDesc};
use super::{DisplacementDesc, EmissionDesc, KeyframeDesc, SubdivisionDesc, TransformDesc};

/// Declares the shapes: a struct for each, the fields that all share, and the enum over them.
macro_rules! shapes {
    ($($(#[$doc:meta])* $variant:ident($name:ident) { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
            #[serde(deny_unknown_fields)]
            pub struct $name {
                $($(#[$field_doc])* pub $field: $type,)*
                /// What the shape is called in layers that pick objects; those of the same name are picked together.
                /// Default: its file or its kind with the place in the list, as in `sphere_3`.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub name: Option<String>,
                /// A material by name. Default: diffuse with albedo 0.5.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub material: Option<String>,
                /// Where the shape stands.
                #[serde(default, skip_serializing_if = "TransformDesc::is_empty")]
                pub transform: TransformDesc,
                /// How the shape moves, after `transform`. Default: not at all.
                #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
                #[schemars(with = "OneOrMore<KeyframeDesc>")]
                pub motion: Vec<KeyframeDesc>,
                /// How much of the surface is there: a number from 0 to 1, or `{ "texture": "name" }`. Rays, shadow
                /// rays too, pass through the rest. Default: 1, or that of an MTL. Not with `emission`.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub opacity: Option<OpacityDesc>,
                /// Light that the shape emits.
                #[serde(default, deserialize_with = "object_option", skip_serializing_if = "Option::is_none")]
                pub emission: Option<EmissionDesc>,
                /// Whether the front is the side against the shape's own normal.
                #[serde(default, skip_serializing_if = "std::ops::Not::not")]
                pub reverse_normal: bool,
            }

            impl $name {
                /// The shape with its own parameters and every other default.
                #[allow(clippy::too_many_arguments, clippy::new_without_default)]
                pub fn new($($field: $type,)*) -> Self {
                    Self {
                        $($field,)*
                        name: None,
                        material: None,
                        transform: TransformDesc::default(),
                        motion: Vec::new(),
                        opacity: None,
                        emission: None,
                        reverse_normal: false,
                    }
                }
            }
        )*

        /// A shape in the world or in an object.
        #[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
        #[serde(tag = "type", rename_all = "snake_case")]
        pub enum ShapeDesc {
            $($(#[$doc])* $variant($name),)*
        }

        impl ShapeDesc {
            /// What all shapes share, to be changed.
            pub fn common_mut(&mut self) -> ShapeCommonMut<'_> {
                match self {
                    $(Self::$variant(shape) => ShapeCommonMut {
                        name: &mut shape.name,
                        material: &mut shape.material,
                        transform: &mut shape.transform,
                        motion: &mut shape.motion,
                        opacity: &mut shape.opacity,
                        emission: &mut shape.emission,
                        reverse_normal: &mut shape.reverse_normal,
                    },)*
                }
            }

            /// What all shapes share.
            pub fn common(&self) -> ShapeCommon<'_> {
                match self {
                    $(Self::$variant(shape) => ShapeCommon {
                        name: shape.name.as_deref(),
                        material: shape.material.as_deref(),
                        transform: &shape.transform,
                        motion: &shape.motion,
                        opacity: shape.opacity.as_ref(),
                        emission: shape.emission.as_ref(),
                        reverse_normal: shape.reverse_normal,
                    },)*
                }
            }
        }
    };
}

/// What all shapes share.
#[derive(Clone, Copy, Debug)]
pub struct ShapeCommon<'a> {
    /// Free text.
    pub name: Option<&'a str>,
    /// A material by name.
    pub material: Option<&'a str>,
    /// Where the shape stands.
    pub transform: &'a TransformDesc,
    /// How it moves.
    pub motion: &'a [KeyframeDesc],
    /// How much of the surface is there.
    pub opacity: Option<&'a OpacityDesc>,
    /// Light that the shape emits.
    pub emission: Option<&'a EmissionDesc>,
    /// Whether the front is the side against the shape's own normal.
    pub reverse_normal: bool,
}

/// What all shapes share, to be changed; see [`ShapeCommon`].
#[derive(Debug)]
#[allow(missing_docs)]
pub struct ShapeCommonMut<'a> {
    pub name: &'a mut Option<String>,
    pub material: &'a mut Option<String>,
    pub transform: &'a mut TransformDesc,
    pub motion: &'a mut Vec<KeyframeDesc>,
    pub opacity: &'a mut Option<OpacityDesc>,
    pub emission: &'a mut Option<EmissionDesc>,
    pub reverse_normal: &'a mut bool,
}

shapes! {
    /// A triangle mesh from a file, or inline by `positions` and `triangles`.
    Mesh(MeshDesc) {
        /// A PLY (binary or ASCII) or OBJ file, relative to the scene file. Without a `material` here, an OBJ uses
        /// those of its MTL: `illum` 5 is a mirror of colour Ks; 4, 6, 7 and 9 are glass of index Ni; a specular colour
        /// Ks with an exponent Ns has alpha = sqrt(2 / (Ns + 2)) and is a metal of that colour if Kd is black, plastic
        /// with base Kd otherwise; all else is diffuse with Kd. Ke is radiance emitted. `map_Kd` is a texture times
        /// Kd (times 1 if Kd is black), where the faces have uv, and so are `map_Ke` times Ke and, on mirrors and
        /// metals, `map_Ks` times Ks; `norm` is a normal map, `bump` and `map_Bump` are one if their image has colours,
        /// else heights in world units times `-bm`. `d` (or 1 - `Tr`) is the opacity of what is not glass, times
        /// `map_d` (its alpha, else its luminance) or the alpha of `map_Kd`. Of the options of maps, `-s`, `-o`,
        /// `-clamp`, `-bm` and `-imfchan` count. Other maps are not used.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Inline: positions of the vertices.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        positions: Option<Vec<[f64; 3]>>,
        /// Inline: corners of each triangle as indices from 0, counter-clockwise seen from the front.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        triangles: Option<Vec<[u32; 3]>>,
        /// Inline, in place of `triangles`: corners of each face, three or more; convex faces but for subdivision.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faces: Option<Vec<Vec<u32>>>,
        /// Inline: a normal for each vertex.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        normals: Option<Vec<[f32; 3]>>,
        /// Inline: a uv for each vertex.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        uvs: Option<Vec<[f32; 2]>>,
        /// Inline: a linear colour for each vertex, which is the attribute `vertex_color`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        colors: Option<Vec<[f32; 3]>>,
        /// Inline: numbers, or colours, for each vertex (`vertex_NAME`) or each triangle (`face_NAME`) by name, for
        /// textures of type `mesh_attribute`.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        attributes: BTreeMap<String, AttributeDesc>,
        /// A mesh that deforms: the files with its vertices at further times, evenly spaced until the shutter closes,
        /// as many and in the same order as in `file`, which has those at its opening. Between them vertices move along
        /// straight lines.
        #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
        #[schemars(with = "OneOrMore<String>")]
        deform_files: Vec<String>,
        /// Inline: as `deform_files`, the positions at further times.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        deform_positions: Vec<Vec<[f64; 3]>>,
        /// How normals are found. Default: given ones are interpolated, else the mesh is flat.
        #[serde(default)]
        shading: MeshShadingDesc,
        /// Where normals are computed: triangles at an angle above this are not smoothed together, from 0 to 180
        /// degrees. Default: 180, no creases.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        crease_angle_degrees: Option<f64>,
        /// Where normals are computed: how triangles around a vertex are weighted. Default: `angle`.
        #[serde(default)]
        normal_weight: NormalWeightDesc,
        /// Where normals are computed: what triangles around a vertex are. Default: `position`.
        #[serde(default)]
        smooth_by: SmoothByDesc,
        /// Makes a subdivision surface of the mesh. Vertices that count as the same, by `smooth_by`, are one. Normals
        /// are those of the limit surface unless `shading` is `computed` or `flat`. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        subdivision: Option<Box<SubdivisionDesc>>,
        /// Moves the vertices, after subdivision; then normals are computed unless `shading` is `flat`. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        displacement: Option<Box<DisplacementDesc>>,
    }
    /// A sphere about the origin, or the part of it between two heights and within an angle about +z. u is the angle
    /// over `phi_max`; v runs from the bottom to the top of what is kept, by the angle from -z.
    Sphere(SphereDesc) {
        /// Radius, above 0. Default: 1.
        #[serde(default = "one")]
        radius: f64,
        /// Smallest z kept. Default: all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        z_min: Option<f64>,
        /// Largest z kept. Default: all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        z_max: Option<f64>,
        /// Largest angle kept, from +x towards +y, in degrees. Default: 360.
        #[serde(default = "full_turn")]
        phi_max_degrees: f64,
    }
    /// A parallelogram; the normal is `edge_u` x `edge_v`. Default: the square `[-1, 1]²` at z = 0 with normal +z. u
    /// and v run from 0 to 1 along the edges, so a texture with a `scale` of the edges' lengths over that of a tile
    /// shows tiles.
    Quad(QuadDesc) {
        /// One corner.
        #[serde(default = "quad_origin")]
        origin: [f64; 3],
        /// The edge along which u grows.
        #[serde(default = "quad_edge_u")]
        edge_u: [f64; 3],
        /// The edge along which v grows.
        #[serde(default = "quad_edge_v")]
        edge_v: [f64; 3],
    }
    /// A plane through `point`, without end: a square that reaches 10,000 times as far as everything else in the scene
    /// and the camera. u and v are lengths from `point`: textures repeat. It stands in the world, not in an object, and
    /// can neither move nor emit light.
    Plane(PlaneDesc) {
        /// A point of the plane, where u and v are 0. Default: the origin.
        #[serde(default)]
        point: [f64; 3],
        /// The normal; any length. u grows along +x cross normal (+y cross normal if the normal is along x by more than
        /// a tenth), v along normal cross u. Default: +y.
        #[serde(default = "plane_normal")]
        normal: [f64; 3],
    }
    /// The cube `[-1, 1]³` with normals outward. Each face has u and v from 0 to 1.
    Cube(CubeDesc) {}
    /// A disk, ring or sector at z = 0 about the origin, with normal +z. u is the angle over `phi_max`; v runs from the
    /// inner to the outer radius.
    Disk(DiskDesc) {
        /// Outer radius, above 0. Default: 1.
        #[serde(default = "one")]
        radius: f64,
        /// Inner radius, from 0 to below `radius`. Default: 0.
        #[serde(default)]
        inner_radius: f64,
        /// Largest angle kept, from +x towards +y, in degrees. Default: 360.
        #[serde(default = "full_turn")]
        phi_max_degrees: f64,
    }
    /// A cylinder about +z from z = 0 to `height`, without caps, with normals outward. u is the angle over `phi_max`; v
    /// is `z / height`.
    Cylinder(CylinderDesc) {
        /// Radius, above 0. Default: 1.
        #[serde(default = "one")]
        radius: f64,
        /// Height, above 0. Default: 1.
        #[serde(default = "one")]
        height: f64,
        /// Largest angle kept, from +x towards +y, in degrees. Default: 360.
        #[serde(default = "full_turn")]
        phi_max_degrees: f64,
    }
    /// A cone about +z with its base at z = 0 and its apex (or, with a `top_radius`, its upper rim) at `height`,
    /// without caps, with normals outward. u is the angle over `phi_max`; v is `z / height`.
    Cone(ConeDesc) {
        /// Radius of the base. Default: 1.
        #[serde(default = "one")]
        radius: f64,
        /// Radius at the top; above 0 makes a frustum. Default: 0.
        #[serde(default)]
        top_radius: f64,
        /// Height, above 0. Default: 1.
        #[serde(default = "one")]
        height: f64,
        /// Largest angle kept, from +x towards +y, in degrees. Default: 360.
        #[serde(default = "full_turn")]
        phi_max_degrees: f64,
    }
    /// A surface of revolution: a profile curve in the xy plane turned about +y. x is the distance from the axis and
    /// must not be negative. u is the angle over `phi_max`; v runs from 0 to 1 along the profile. A profile that runs
    /// towards +y has normals outward.
    Revolution(RevolutionDesc) {
        /// The profile.
        profile: ProfileDesc,
        /// What v grows with. Default: `curve`.
        #[serde(default, skip_serializing_if = "is_default")]
        v: ProfileParameterDesc,
        /// Largest angle kept, from +z towards +x, in degrees. Default: 360.
        #[serde(default = "full_turn")]
        phi_max_degrees: f64,
    }
    /// Curves: hair, fur, grass, threads; strands of control points with a radius each, from a file or inline by
    /// `strands`. u runs from 0 to 1 along each strand from its first point; v runs around a tube and across a ribbon,
    /// unless there are `root_uvs`. Rays meet curves from outside only, also those that have crossed one: materials
    /// scatter light as a whole fibre does. The ends of strands are open. The transform keeps angles; curves cannot
    /// emit light.
    Curves(CurvesDesc) {
        /// A file of strands, relative to the scene file: as text, a line `x y z radius` for each control point and an
        /// empty line between strands, as those of Mitsuba; or in binary form: the bytes `STRANDS1`, the number of
        /// strands and that of points, the number of points of each strand (whole numbers of 32 bits) and x, y, z and
        /// radius of each point (floats of 32 bits), all with the lowest byte first.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Inline: the control points `[x, y, z, radius]` of each strand.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        strands: Option<Vec<Vec<[f64; 4]>>>,
        /// How control points make a curve. Default: `b_spline`.
        #[serde(default)]
        basis: CurveBasisDesc,
        /// What the surface is. Default: `round`.
        #[serde(default)]
        kind: CurveKindDesc,
        /// Factor on all radii, above 0. Default: 1.
        #[serde(default = "radius_scale", skip_serializing_if = "is_one")]
        radius_scale: f64,
        /// A linear colour for each strand, or for each control point of all strands, which is the attribute
        /// `vertex_color`. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        colors: Option<Vec<[f32; 3]>>,
        /// One uv for each strand, such as that of its root on the skin, for textures in place of those along and
        /// across. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        root_uvs: Option<Vec<[f32; 2]>>,
    }
    /// Spheres by the million as one shape: `centers` inline, or the vertices of a PLY file. uv are those of a sphere.
    /// The transform keeps angles; points cannot emit light.
    Points(PointsDesc) {
        /// A PLY file, relative to the scene file, whose vertices are the centres. Its attribute `vertex_radius`, if
        /// it has one (a property `radius_x`), has the radii.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Inline: the centres.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        centers: Option<Vec<[f64; 3]>>,
        /// Inline: a radius for each centre; 0 makes a sphere invisible. Default: `radius` for all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radii: Option<Vec<f32>>,
        /// The radius of all, or a factor on the radii of the file or of `radii`; above 0. Default: 1.
        #[serde(default = "radius_scale")]
        radius: f64,
    }
}

/// A profile curve of points `[x, y]`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ProfileDesc {
    /// Joined cubic Bezier curves: 3n + 1 control points.
    Bezier(Vec<[f64; 2]>),
    /// A uniform cubic B-spline: at least 4 control points. The curve does not reach its end points unless they are
    /// tripled.
    BSpline(Vec<[f64; 2]>),
}

/// What v of a surface of revolution grows with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProfileParameterDesc {
    /// The curve's parameter, the same share of v for each of its segments.
    #[default]
    Curve,
    /// The height: v = 0 at the lowest point of the profile, 1 at the highest. Where the profile turns back, values
    /// occur again.
    Height,
    /// The length of the curve: images are not stretched along it.
    ArcLength,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde expects")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn one() -> f64 {
    1.0
}

fn full_turn() -> f64 {
    360.0
}

fn plane_normal() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn quad_origin() -> [f64; 3] {
    [-1.0, -1.0, 0.0]
}

fn quad_edge_u() -> [f64; 3] {
    [2.0, 0.0, 0.0]
}

fn quad_edge_v() -> [f64; 3] {
    [0.0, 2.0, 0.0]
}

/// How much of a surface is there, from 0 to 1.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected an opacity: a number, or { \"texture\": name, \"threshold\": number }"
)]
pub enum OpacityDesc {
    /// The same everywhere.
    Number(f32),
    /// A texture by name.
    Texture {
        /// The texture's name. An image with alpha and no `channel` gives its alpha, other textures their luminance.
        texture: String,
        /// Where the texture is below this number within `[0, 1]` there is a hole, elsewhere all of the surface: an
        /// alpha test, of the texture as filtered. Default: none, the texture is the fraction of light that the surface
        /// stops.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        threshold: Option<f32>,
    },
}

/// A group of shapes, and instances of other objects.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectDesc {
    /// Shapes of the group.
    #[serde(deserialize_with = "one_or_more")]
    #[schemars(with = "OneOrMore<ShapeDesc>")]
    pub shapes: Vec<ShapeDesc>,
    /// Other objects inside this one; any depth, no cycles.
    #[serde(deserialize_with = "one_or_more")]
    #[schemars(with = "OneOrMore<InstanceDesc>")]
    pub instances: Vec<InstanceDesc>,
}

/// A placement of an object.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstanceDesc {
    /// The object's name.
    pub object: String,
    /// What the instance is called in layers that pick objects; those of the same name are picked together. Default:
    /// the object's name with the place in the list, as in `tree_17`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it stands.
    #[serde(default, skip_serializing_if = "TransformDesc::is_empty")]
    pub transform: TransformDesc,
    /// How it moves, after `transform`. Default: not at all.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<KeyframeDesc>")]
    pub motion: Vec<KeyframeDesc>,
}
