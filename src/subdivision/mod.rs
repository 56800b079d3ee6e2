//! Subdivision surfaces: Catmull and Clark's scheme ("Recursively Generated B-Spline Surfaces on Arbitrary Topological
//! Meshes") and Loop's ("Smooth Subdivision Surfaces Based on Triangles"), with semi-sharp creases (DeRose, Kass and
//! Truong, "Subdivision Surfaces in Character Animation"), by the rules of OpenSubdiv.
//!
//! The faces of a cage are refined level by level, all of them or those with too long edges. Then the vertices are
//! moved to the limit surface and get its normals. A face beside finer ones has their vertices on its edges, so that
//! there are no cracks.

mod edges;
mod limit;
mod rules;
mod stitch;
mod surface;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use crate::math::DVec3;

/// Sharpness from which an edge or a vertex stays sharp at every level, as in OpenSubdiv.
pub const SHARP: f32 = 10.0;

/// How faces are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// Faces of any number of corners become quadrilaterals.
    CatmullClark,
    /// Triangles; weights of vertices by Loop.
    Loop,
    /// Triangles; weights of vertices by Warren ("Subdivision Methods for Geometric Design"), as in pbrt.
    LoopWarren,
}

/// How uv change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UvRule {
    /// Linearly over each face.
    Linear,
    /// Smooth as the positions, but linear along the borders of charts.
    SmoothInside,
}

/// A mesh of control points. Each corner of a face has a point, and a vertex that has all but the position.
#[derive(Clone, Debug, Default)]
pub struct Cage {
    /// The number of corners of each face, at least 3; with Loop's scheme 3.
    pub sizes: Vec<u32>,
    /// The point of each corner, face by face; those of a face differ.
    pub points: Vec<u32>,
    /// The vertex of each corner.
    pub vertices: Vec<u32>,
    /// Positions of the points, at one time or several.
    pub positions: Vec<Vec<DVec3>>,
    /// uv of the vertices; z is 0.
    pub uvs: Option<Vec<DVec3>>,
    /// Values of the vertices that change linearly over each face.
    pub linear: Vec<Vec<DVec3>>,
    /// Sharpness of edges, by their points in ascending order.
    pub creases: HashMap<[u32; 2], f32>,
    /// Sharpness of points.
    pub corners: HashMap<u32, f32>,
    /// Whether the points at borders with one face are sharp.
    pub sharp_border_corners: bool,
}

/// How far a cage is refined.
#[derive(Clone, Copy)]
pub struct Refinement<'a> {
    /// The scheme.
    pub scheme: Scheme,
    /// The rule for uv.
    pub uv_rule: UvRule,
    /// Levels; at least one with Catmull and Clark's scheme, for the limit is that of quadrilaterals.
    pub levels: u32,
    /// Where given, faces are refined only as long as one of their edges is too long.
    pub is_too_long: Option<&'a (dyn Fn(DVec3, DVec3) -> bool + Sync)>,
    /// With `is_too_long`, refinement ends where there would be more triangles.
    pub max_triangles: u64,
}

/// A refined mesh on the limit surface.
#[derive(Clone, Debug, Default)]
pub struct Refined {
    /// Positions of the vertices at each time.
    pub positions: Vec<Vec<[f32; 3]>>,
    /// Their unit normals at each time; zero where there is none.
    pub normals: Vec<Vec<[f32; 3]>>,
    /// Their uv.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// What changes linearly.
    pub linear: Vec<Vec<[f32; 3]>>,
    /// The triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The face of the cage that each triangle is a part of.
    pub faces: Vec<u32>,
    /// Of each vertex, the point: vertices that differ in normal or uv may share it.
    pub points: Vec<u32>,
    /// Of each vertex, the normal: those that differ in uv may share it.
    pub smooth: Vec<u32>,
    /// Whether refinement ended for the number of triangles.
    pub is_cut_short: bool,
    /// Edges of the cage with more than two faces, or with two that are wound differently; they are sharp.
    pub irregular_edges: usize,
}

/// How many triangles a cage with this many corners in this many faces becomes.
pub fn triangle_count(scheme: Scheme, corners: u64, faces: u64, levels: u32) -> u64 {
    let times = |count: u64, levels: u32| count.saturating_mul(1u64.checked_shl(2 * levels).unwrap_or(u64::MAX));
    match scheme {
        Scheme::CatmullClark => times(corners, levels.max(1) - 1).saturating_mul(2),
        Scheme::Loop | Scheme::LoopWarren => times(faces, levels),
    }
}

/// Refines a cage.
pub fn refine(cage: Cage, how: &Refinement) -> Refined {
    let mut surface = surface::RefinedSurface::new(cage, how);
    let (smallest, is_adaptive) = (u32::from(how.scheme == Scheme::CatmullClark), how.is_too_long.is_some());
    let levels = how.levels.max(smallest);
    for level in 0..=levels {
        let is_last = level == levels;
        let edges = surface.edges();
        if level >= smallest && (is_last || is_adaptive) {
            surface.find_limit(&edges);
        }
        let chosen = if is_last {
            Vec::new()
        } else if level < smallest {
            vec![true; surface.face_count()]
        } else {
            surface.too_long(how.is_too_long)
        };
        let most = if level < smallest { u64::MAX } else { how.max_triangles };
        if surface.emit(&chosen, most) {
            break;
        }
        surface = surface.refined(&chosen, edges);
    }
    surface.finish()
}
