//! From hits to vertices: points in `f64`, normals, shading frames.

use super::Context;
use super::block::{AnalyticScratch, PointRows, TriangleRows, VertexRows, Vertices, vertex_flags};
use super::wave::{PathRows, Wave};
use crate::accel::HitRows;
use crate::color::Rgb;
use crate::geometry::{
    Hit, Mesh, PointWithNormals, Shape, TrianglePoints, interpolated_normal, interpolated_uv, uv_area, uv_density,
};
use crate::id::{InstanceId, ShapeId};
use crate::integrator::shading::{adapted_normal, is_consistent};
use crate::math::compact::{Compaction, collect_lanes};
use crate::math::prefetch::{address, prefetch_lines};
use crate::math::rows::{BATCH, Element, Row, Vec3Rows, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Frame, Ray, RayRows, Vec2};

/// Finds the vertices of a block's paths, and which paths miss.
pub(super) fn find(context: &Context, wave: &mut Wave, block: usize) {
    let count = wave.block_len(block);
    let Wave { vertices, paths, rays, hits, .. } = wave;
    let (paths, rays, hits) = (&paths[block], &rays[block], &hits[block]);
    let features = &context.scene.features;
    let lanes = Compaction::different(&hits.shape, HitRows::MISS, count);
    collect_lanes(&mut vertices.misses, count, |path| !lanes.contains(path));
    start_vertices(vertices, &lanes, paths, rays, hits);
    if let Some(meshes) = gather_indices(context, vertices) {
        transform_instanced_rays(context, vertices);
        gather_triangles(context, vertices, &meshes);
        let Vertices { count, rows, triangles, points, .. } = vertices;
        match (features.shading_normals, features.parameters) {
            (false, false) => vectorize!(intersect_triangles::<false, false>(triangles, rows, points, *count)),
            (true, false) => vectorize!(intersect_triangles::<true, false>(triangles, rows, points, *count)),
            (false, true) => vectorize!(intersect_triangles::<false, true>(triangles, rows, points, *count)),
            (true, true) => vectorize!(intersect_triangles::<true, true>(triangles, rows, points, *count)),
        }
        place_instanced(context, vertices);
    }
    if features.analytic_shapes {
        lanes.compact(&rays.t_min, &mut vertices.analytic.t_min);
        lanes.compact(&hits.t, &mut vertices.analytic.t);
        resolve_analytic(context, vertices);
    }
    for lane in 0..vertices.count.min(BATCH) {
        if vertices.rows.is_unresolved[lane] != 0 {
            let path = vertices.path(lane);
            if vertices.is_medium(lane) {
                set_medium_vertex(vertices, lane, &rays.get(path), hits.t[path]);
                continue;
            }
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

/// Sets the vertex where a medium scatters a ray: a point with a normal against it.
#[inline(never)]
fn set_medium_vertex(vertices: &mut Vertices, lane: usize, ray: &Ray, t: f32) {
    let n = -ray.direction.normalize();
    let rows = &mut vertices.rows;
    vertices.points.p.set(lane, ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t));
    (rows.t[lane], rows.error[lane]) = (t, 0.0);
    rows.n_g.set(lane, n);
    rows.n_s.set(lane, n);
    rows.flags[lane] = vertex_flags::MEDIUM;
}

/// Starts a vertex for each of the chosen paths.
fn start_vertices(vertices: &mut Vertices, lanes: &Compaction, paths: &PathRows, rays: &RayRows, hits: &HitRows) {
    const INDICES: Row<u32> = {
        let mut indices = [0; BATCH];
        let mut i = 0;
        while i < BATCH {
            indices[i] = i as u32;
            i += 1;
        }
        indices
    };
    let Vertices { count, rows, triangles, .. } = vertices;
    *count = lanes.len();
    lanes.compact(&INDICES, &mut rows.path);
    lanes.compact(&paths.slot, &mut rows.slot);
    lanes.compact(&paths.seed, &mut rows.seed);
    lanes.compact(&paths.sample, &mut rows.sample);
    lanes.compact(&paths.flags, &mut rows.path_flags);
    lanes.compact_3(&paths.throughput.0, &mut rows.throughput.0);
    lanes.compact(&paths.rr_scale, &mut rows.rr_scale);
    lanes.compact_3(&rays.origin.0, &mut triangles.origin.0);
    lanes.compact_3(&rays.direction.0, &mut rows.direction.0);
    lanes.compact(&rays.time, &mut rows.time);
    lanes.compact(&hits.u, &mut triangles.u);
    lanes.compact(&hits.v, &mut triangles.v);
    lanes.compact(&hits.shape, &mut rows.shape);
    lanes.compact(&hits.prim, &mut rows.prim);
    lanes.compact(&hits.instance, &mut rows.instance);
    rows.flags = [0; BATCH];
    // Not every hit sets them.
    rows.dp_du = Vec3Rows::ZERO;
    rows.uv = <Vec2 as Element>::ZERO;
    rows.uv_density = [0.0; BATCH];
}

/// Resolves hits on analytic shapes in the world that need no more than rows have, many on one shape at a time.
fn resolve_analytic(context: &Context, vertices: &mut Vertices) {
    let Vertices { count, rows, points, triangles, analytic, .. } = vertices;
    let AnalyticScratch { t_min, t, rays, ray_t, points: found, normals } = analytic;
    let open = Compaction::different(&rows.is_unresolved, 0, *count).and(&Compaction::equal(
        &rows.instance,
        Hit::NO_INSTANCE.0,
        *count,
    ));
    for (shape, lanes) in open.groups(&rows.shape) {
        let Shape::Analytic(placed) = context.scene.geometry.shape(ShapeId(shape)) else { continue };
        if lanes.len() < MIN_ANALYTIC_LANES || !context.world.resolves_in_rows(ShapeId(shape)) {
            continue;
        }
        for lane in lanes.lanes() {
            (rows.error[lane], rows.uv_density[lane]) = (placed.error(), 0.0);
        }
        lanes.compact_3(&triangles.origin.0, &mut rays.origin.0);
        lanes.compact_3(&rows.direction.0, &mut rays.direction.0);
        lanes.compact(t_min, &mut rays.t_min);
        lanes.compact(t, ray_t);
        placed.resolve_rows(rays, ray_t, lanes.len(), found, normals);
        // What is not resolved here is set by `World::resolve`.
        lanes.expand_3(&found.p.0, &mut points.p.0);
        lanes.expand(&normals.t, &mut rows.t);
        lanes.expand_3(&normals.n.0, &mut rows.n_g.0);
        lanes.expand_3(&normals.n.0, &mut rows.n_s.0);
        lanes.expand_3(&normals.dp_du.0, &mut rows.dp_du.0);
        (0..2).for_each(|k| lanes.expand(&normals.uv.0[k], &mut rows.uv.0[k]));
        lanes.expand(&normals.is_unresolved, &mut rows.is_unresolved);
    }
}

/// Hits on one shape that are worth a vector.
const MIN_ANALYTIC_LANES: usize = 3;

/// Gathers the indices of the triangles' corners; the result is the meshes, if there are any.
fn gather_indices<'a>(context: &Context<'a>, vertices: &mut Vertices) -> Option<[Option<&'a Mesh>; BATCH]> {
    let Vertices { count, rows, triangles, instanced, .. } = vertices;
    let mut meshes = [None; BATCH];
    let mut has_triangles = false;
    instanced.clear();
    // Prefetched, so that all lanes wait for memory together.
    for (lane, mesh) in meshes.iter_mut().enumerate().take(*count) {
        if rows.instance[lane] != Hit::MEDIUM.0 {
            *mesh = context.world.mesh_without_tangents(ShapeId(rows.shape[lane]));
        }
        rows.is_unresolved[lane] = u32::from(mesh.is_none());
        if let Some(mesh) = mesh {
            has_triangles = true;
            prefetch_lines(address(mesh.triangles(), rows.prim[lane] as usize), 1);
            if rows.instance[lane] != Hit::NO_INSTANCE.0 {
                instanced.push(lane as u8);
            }
        }
    }
    if !has_triangles {
        return None;
    }
    for (lane, mesh) in meshes.iter().enumerate().take(*count) {
        if let Some(mesh) = mesh {
            [triangles.a_index[lane], triangles.b_index[lane], triangles.c_index[lane]] =
                mesh.triangles()[rows.prim[lane] as usize];
        }
    }
    Some(meshes)
}

/// Takes rays that hit triangles of instances into the spaces of these.
fn transform_instanced_rays(context: &Context, vertices: &mut Vertices) {
    let Vertices { rows, triangles, instanced, .. } = vertices;
    triangles.direction = rows.direction.clone();
    for &lane in &*instanced {
        let lane = usize::from(lane);
        let (origin, direction) = (triangles.origin.get(lane), rows.direction.get(lane));
        let ray = Ray { time: rows.time[lane], ..Ray::new(origin, direction) };
        let ray = context.scene.geometry.instance(InstanceId(rows.instance[lane])).object_ray(&ray);
        triangles.origin.set(lane, ray.origin);
        triangles.direction.set(lane, ray.direction);
    }
}

/// Places the points of instanced triangles, and their normals, in the world.
fn place_instanced(context: &Context, vertices: &mut Vertices) {
    let Vertices { rows, points, instanced, .. } = vertices;
    for &lane in &*instanced {
        let lane = usize::from(lane);
        let instance = context.scene.geometry.instance(InstanceId(rows.instance[lane]));
        let (p, error) = (points.p.get(lane), rows.error[lane]);
        let local = PointWithNormals { p, error, n_g: rows.n_g.get(lane), n_s: rows.n_s.get(lane) };
        let at = instance.point_at(&local, rows.time[lane]);
        points.p.set(lane, at.p);
        rows.n_g.set(lane, at.n_g);
        rows.n_s.set(lane, at.n_s);
        // Zero: the density per area of the object is not that of the world.
        (rows.error[lane], rows.uv_density[lane]) = (at.error, 0.0);
    }
}

/// Gathers the corners of the triangles.
fn gather_triangles(context: &Context, vertices: &mut Vertices, meshes: &[Option<&Mesh>; BATCH]) {
    let features = &context.scene.features;
    let Vertices { count, rows, triangles, .. } = vertices;
    for (lane, mesh) in meshes.iter().enumerate().take(*count) {
        let Some(mesh) = mesh else { continue };
        let indices = [triangles.a_index[lane], triangles.b_index[lane], triangles.c_index[lane]];
        let TrianglePoints { a, b, c } = mesh.points(indices);
        triangles.a.set(lane, a);
        triangles.b.set(lane, b);
        triangles.c.set(lane, c);
        if features.shading_normals {
            // Without normals of its own, a triangle is flat.
            let [a, b, c] = mesh.vertex_normals(indices).unwrap_or_default();
            triangles.n_a.set(lane, a);
            triangles.n_b.set(lane, b);
            triangles.n_c.set(lane, c);
        }
        if features.parameters {
            let [a, b, c] = if context.world.uses_uv(ShapeId(rows.shape[lane])) {
                mesh.vertex_uvs(indices)
            } else {
                [Vec2::ZERO; 3]
            };
            triangles.uv_a.set(lane, a);
            triangles.uv_b.set(lane, b);
            triangles.uv_c.set(lane, c);
        }
    }
}

// Rows are parameters of their own here and below: the compiler then knows that they do not overlap.
#[inline(always)]
fn intersect_triangles<const SMOOTH: bool, const UV: bool>(
    triangles: &TriangleRows,
    rows: &mut VertexRows,
    points: &mut PointRows,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let corners = TrianglePoints { a: triangles.a.get(i), b: triangles.b.get(i), c: triangles.c.get(i) };
        let hit = corners.intersect_plane(triangles.origin.get(i), triangles.direction.get(i));
        points.p.set(i, hit.p);
        rows.t[i] = hit.t as f32;
        rows.error[i] = hit.error;
        rows.is_unresolved[i] |= u32::from(!hit.is_valid());
        rows.n_g.set(i, hit.n_g);
        let n_s = if SMOOTH {
            let normals = [triangles.n_a.get(i), triangles.n_b.get(i), triangles.n_c.get(i)];
            interpolated_normal(normals, [triangles.u[i], triangles.v[i]], hit.n_g).0
        } else {
            hit.n_g
        };
        rows.n_s.set(i, n_s);
        if UV {
            let corners = [triangles.uv_a.get(i), triangles.uv_b.get(i), triangles.uv_c.get(i)];
            rows.uv.set(i, interpolated_uv(corners, [triangles.u[i], triangles.v[i]]));
            rows.uv_density[i] = uv_density(uv_area(corners), hit.double_area);
        }
    }
}

/// Finds the shading frames of the vertices.
pub(super) fn build_frames(context: &Context, wave: &mut Wave) {
    let features = &context.scene.features;
    let vertices = &mut wave.vertices;
    let count = vertices.count;
    if features.shading_normals {
        vectorize!(adapt_normals(&mut vertices.rows, count));
        let rows = &mut vertices.rows;
        for lane in (0..count).filter(|&lane| rows.is_consistent[lane] == 0) {
            let n = adapted_normal(-rows.direction.get(lane), rows.n_s.get(lane), rows.n_g.get(lane));
            rows.n.set(lane, n);
        }
    }
    match (features.shading_normals, features.anisotropic) {
        (false, false) => vectorize!(set_frames::<false, false>(&mut vertices.rows, count)),
        (true, false) => vectorize!(set_frames::<true, false>(&mut vertices.rows, count)),
        (false, true) => vectorize!(set_frames::<false, true>(&mut vertices.rows, count)),
        (true, true) => vectorize!(set_frames::<true, true>(&mut vertices.rows, count)),
    }
    if features.normal_perturbations {
        for lane in 0..count {
            if vertices.is_miss(lane) || vertices.is_medium(lane) {
                continue;
            }
            let at = vertices.interaction(lane);
            let is_perturbed = context.scene.normal_perturbation(&at, vertices.rows.direction.get(lane)).is_some();
            let n = vertices.rows.n.get(lane);
            // On a smooth mesh the factor would show the facets, for it jumps with the geometric normal.
            vertices.rows.cos_normals[lane] = if is_perturbed && n != at.n_g { n.dot(at.n_g) } else { 0.0 };
        }
    }
}

/// Takes the shading normals that reflect nothing below the surface.
#[inline(always)]
fn adapt_normals(rows: &mut VertexRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let n_s = rows.n_s.get(i);
        rows.is_consistent[i] = u32::from(is_consistent(-rows.direction.get(i), n_s, rows.n_g.get(i)));
        rows.n.set(i, n_s);
    }
}

#[inline(always)]
fn set_frames<const SMOOTH: bool, const TANGENTS: bool>(rows: &mut VertexRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let (back, n_g) = (-rows.direction.get(i), rows.n_g.get(i));
        let n = if SMOOTH { rows.n.get(i) } else { n_g };
        let frame = if TANGENTS { Frame::from_normal_and_tangent(n, rows.dp_du.get(i)) } else { Frame::from_normal(n) };
        rows.frame_x.set(i, frame.x);
        rows.frame_y.set(i, frame.y);
        rows.n.set(i, n);
        let wo = frame.to_local(back);
        rows.wo.set(i, wo);
        let side = if rows.flags[i] & vertex_flags::TRANSMITS != 0 { 0.0 } else { 1f32.copysign(wo.z) };
        rows.light_context_n.set(i, n * side);
        rows.cos_geometric[i] = back.dot(n_g);
        rows.cos_normals[i] = 0.0;
    }
}
