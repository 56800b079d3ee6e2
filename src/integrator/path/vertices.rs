//! From hits to vertices: points in `f64`, normals, shading frames.

use super::Context;
use super::block::{PointRows, TriangleRows, VertexRows, Vertices, vertex_flags};
use super::wave::Wave;
use crate::accel::HitRows;
use crate::color::Rgb;
use crate::geometry::{Hit, Mesh, Shape, TrianglePoints, interpolated_normal};
use crate::id::ShapeId;
use crate::integrator::shading::{adapted_normal, is_consistent};
use crate::math::Frame;
use crate::math::rows::BATCH;
use crate::math::vectorize::{Kernel, vectorize};

/// Finds the vertices of a block's paths, and which paths miss.
#[inline(never)]
pub(super) fn find(context: &Context, wave: &mut Wave, block: usize) {
    let count = wave.block_len(block);
    let Wave { vertices, paths, rays, hits, .. } = wave;
    let (paths, rays, hits) = (&paths[block], &rays[block], &hits[block]);
    let smooth = context.scene.features.shading_normals;
    vertices.count = 0;
    vertices.misses.clear();
    let mut triangles = 0;
    for path in 0..count {
        if hits.shape[path] == HitRows::MISS {
            vertices.misses.push(path as u8);
            continue;
        }
        let lane = vertices.count;
        vertices.count += 1;
        let rows = &mut vertices.rows;
        rows.path[lane] = path as u32;
        rows.direction.set(lane, rays.direction.get(path));
        rows.time[lane] = rays.time[path];
        (rows.shape[lane], rows.prim[lane], rows.instance[lane]) = (hits.shape[path], hits.prim[path], hits.instance[path]);
        rows.throughput.set(lane, paths.throughput.get(path));
        rows.rr_scale[lane] = paths.rr_scale[path];
        rows.flags[lane] = 0;
        let mesh = if hits.instance[path] == Hit::NO_INSTANCE.0 { plain_mesh(context, ShapeId(hits.shape[path])) } else { None };
        rows.is_unresolved[lane] = u32::from(mesh.is_none());
        if let Some(mesh) = mesh {
            triangles += 1;
            vertices.triangles.origin.set(lane, rays.origin.get(path));
            // The positions are gathered in a loop of their own: here all lanes wait for memory together.
            let [a, b, c] = mesh.triangles()[hits.prim[path] as usize];
            let indices = &mut vertices.triangles;
            (indices.a_index[lane], indices.b_index[lane], indices.c_index[lane]) = (a, b, c);
            (indices.u[lane], indices.v[lane]) = (hits.u[path], hits.v[path]);
        }
    }
    if triangles > 0 {
        gather_triangles(context, vertices, smooth);
        let Vertices { count, rows, triangles, points, .. } = vertices;
        if smooth {
            vectorize(IntersectTriangles::<true> { triangles, rows, points, count: *count });
        } else {
            vectorize(IntersectTriangles::<false> { triangles, rows, points, count: *count });
        }
    }
    for lane in 0..vertices.count {
        if vertices.rows.is_unresolved[lane] != 0 {
            let path = vertices.path(lane);
            match context.world.resolve(&rays.get(path), hits.get(path)) {
                Some(at) => vertices.set_interaction(lane, &at),
                None => {
                    vertices.misses.push(path as u8);
                    vertices.rows.flags[lane] = vertex_flags::MISS;
                    vertices.rows.throughput.set(lane, Rgb::BLACK);
                }
            }
        }
    }
}

/// The mesh of a shape in the world that is at rest, if nothing depends on its parametrisation.
#[inline(always)]
fn plain_mesh<'a>(context: &Context<'a>, shape: ShapeId) -> Option<&'a Mesh> {
    match context.scene.geometry.shape(shape) {
        Shape::Mesh(mesh) if context.world.is_plain_mesh(shape) => Some(mesh),
        _ => None,
    }
}

/// Gathers the corners of the triangles.
fn gather_triangles(context: &Context, vertices: &mut Vertices, smooth: bool) {
    let Vertices { count, rows, triangles, .. } = vertices;
    for lane in (0..*count).filter(|&lane| rows.is_unresolved[lane] == 0) {
        let Shape::Mesh(mesh) = context.scene.geometry.shape(ShapeId(rows.shape[lane])) else { continue };
        let indices = [triangles.a_index[lane], triangles.b_index[lane], triangles.c_index[lane]];
        let TrianglePoints { a, b, c } = mesh.points(indices);
        triangles.a.set(lane, a);
        triangles.b.set(lane, b);
        triangles.c.set(lane, c);
        if smooth {
            // Without normals of its own, a triangle is flat.
            let [a, b, c] = mesh.vertex_normals(indices).unwrap_or_default();
            triangles.n_a.set(lane, a);
            triangles.n_b.set(lane, b);
            triangles.n_c.set(lane, c);
        }
    }
}

/// Intersects rays and the planes of their triangles in `f64`.
struct IntersectTriangles<'a, const SMOOTH: bool> {
    triangles: &'a TriangleRows,
    rows: &'a mut VertexRows,
    points: &'a mut PointRows,
    count: usize,
}

impl<const SMOOTH: bool> Kernel for IntersectTriangles<'_, SMOOTH> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        intersect_triangles::<SMOOTH>(self.triangles, self.rows, self.points, self.count);
    }
}

// Rows are parameters of their own here and below: the compiler then knows that they do not overlap.
#[inline(always)]
fn intersect_triangles<const SMOOTH: bool>(triangles: &TriangleRows, rows: &mut VertexRows, points: &mut PointRows, count: usize) {
    for i in 0..count.min(BATCH) {
        let corners = TrianglePoints { a: triangles.a.get(i), b: triangles.b.get(i), c: triangles.c.get(i) };
        let place = corners.place(triangles.origin.get(i), rows.direction.get(i));
        points.p.set(i, place.p);
        rows.t[i] = place.t as f32;
        rows.error[i] = place.error;
        rows.is_unresolved[i] |= u32::from(!place.is_ahead());
        rows.n_g.set(i, place.n_g);
        let n_s = if SMOOTH {
            let normals = [triangles.n_a.get(i), triangles.n_b.get(i), triangles.n_c.get(i)];
            interpolated_normal(normals, [triangles.u[i], triangles.v[i]], place.n_g).0
        } else {
            place.n_g
        };
        rows.n_s.set(i, n_s);
    }
}

/// Finds the shading frames of the vertices.
pub(super) fn build_frames(context: &Context, wave: &mut Wave) {
    let features = &context.scene.features;
    let vertices = &mut wave.vertices;
    let count = vertices.count;
    if features.shading_normals {
        vectorize(AdaptNormals { rows: &mut vertices.rows, count });
        let rows = &mut vertices.rows;
        for lane in (0..count).filter(|&lane| rows.is_consistent[lane] == 0) {
            let n = adapted_normal(-rows.direction.get(lane), rows.n_s.get(lane), rows.n_g.get(lane));
            rows.n.set(lane, n);
        }
    }
    match (features.shading_normals, features.anisotropic) {
        (false, false) => vectorize(BuildFrames::<false, false> { rows: &mut vertices.rows, count }),
        (true, false) => vectorize(BuildFrames::<true, false> { rows: &mut vertices.rows, count }),
        (false, true) => vectorize(BuildFrames::<false, true> { rows: &mut vertices.rows, count }),
        (true, true) => vectorize(BuildFrames::<true, true> { rows: &mut vertices.rows, count }),
    }
    if features.reliefs {
        for lane in 0..count {
            if vertices.is_miss(lane) {
                continue;
            }
            let at = vertices.interaction(lane);
            let has_relief = context.scene.relief(&at, vertices.rows.direction.get(lane)).is_some();
            let n = vertices.rows.n.get(lane);
            // On a smooth mesh the factor would show the facets, for it jumps with the geometric normal.
            vertices.rows.cos_normals[lane] = if has_relief && n != at.n_g { n.dot(at.n_g) } else { 0.0 };
        }
    }
}

/// Takes the shading normals that reflect nothing below the surface.
struct AdaptNormals<'a> {
    rows: &'a mut VertexRows,
    count: usize,
}

impl Kernel for AdaptNormals<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows, count } = self;
        for i in 0..count.min(BATCH) {
            let n_s = rows.n_s.get(i);
            rows.is_consistent[i] = u32::from(is_consistent(-rows.direction.get(i), n_s, rows.n_g.get(i)));
            rows.n.set(i, n_s);
        }
    }
}

struct BuildFrames<'a, const SMOOTH: bool, const TANGENTS: bool> {
    rows: &'a mut VertexRows,
    count: usize,
}

impl<const SMOOTH: bool, const TANGENTS: bool> Kernel for BuildFrames<'_, SMOOTH, TANGENTS> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows, count } = self;
        for i in 0..count.min(BATCH) {
            let (back, n_g) = (-rows.direction.get(i), rows.n_g.get(i));
            let n = if SMOOTH { rows.n.get(i) } else { n_g };
            let frame = if TANGENTS { Frame::from_normal_and_tangent(n, rows.dp_du.get(i)) } else { Frame::from_normal(n) };
            rows.frame_x.set(i, frame.x);
            rows.frame_y.set(i, frame.y);
            rows.n.set(i, n);
            rows.wo.set(i, frame.to_local(back));
            rows.cos_geometric[i] = back.dot(n_g);
            rows.cos_normals[i] = 0.0;
        }
    }
}
