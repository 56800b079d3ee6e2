//! Triangle meshes: positions, corners, and optionally normals and uv per vertex.

use std::sync::OnceLock;

use super::attributes::weights;
use super::mesh_error::MeshError;
use super::tangents::{self, CornerTangents};
pub use super::triangle::TrianglePoints;
use super::uv::{derivatives, interpolated_uv, uv_area};
use super::{Detail, Hit, SurfaceInteraction};
use crate::attribute::Attribute;
use crate::id::PrimId;
use crate::math::float::{EMBREE_LARGE, UNIT_ROUNDOFF};
use crate::math::{Aabb, Bounds, DVec3, Ray, Transform, Vec2, Vec3};

/// An indexed triangle mesh, validated: every number is finite, every index in range.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// One more than there are vertices: Embree reads 16 bytes of the last.
    positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Option<Vec<[f32; 3]>>,
    pub(super) uvs: Option<Vec<[f32; 2]>>,
    /// What textures take; empty if they take nothing.
    pub(super) attributes: Box<[Attribute]>,
    /// Of a mesh that deforms, its vertices at further times.
    pub(super) later: Vec<MeshStep>,
    /// For normal maps, those of each triangle at each time; else empty.
    pub(super) tangents: Vec<Vec<CornerTangents>>,
    has_slivers: bool,
    /// Computed on first use.
    bounds: OnceLock<Aabb>,
}

/// Whether the buffers are the same; bounds follow from them.
impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        let Self { positions, triangles, normals, uvs, attributes, later, tangents, has_slivers, bounds: _ } = self;
        *positions == other.positions
            && *triangles == other.triangles
            && *normals == other.normals
            && *uvs == other.uvs
            && *attributes == other.attributes
            && *later == other.later
            && *tangents == other.tangents
            && *has_slivers == other.has_slivers
    }
}

/// The vertices of a deforming mesh at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshStep {
    /// As many positions as the mesh has.
    pub positions: Vec<[f32; 3]>,
    /// As many normals, if the mesh has any.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl Mesh {
    /// The most times at which a mesh can have positions: Embree's `RTC_MAX_TIME_STEP_COUNT`.
    pub const MAX_STEPS: usize = 129;

    /// A mesh from its buffers.
    ///
    /// # Errors
    /// If a number is not finite, an index out of range, an attribute's count wrong, or there is no triangle.
    pub fn new(
        mut positions: Vec<[f32; 3]>,
        mut triangles: Vec<[u32; 3]>,
        normals: Option<Vec<[f32; 3]>>,
        uvs: Option<Vec<[f32; 2]>>,
    ) -> Result<Self, MeshError> {
        let vertices = positions.len();
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(i) = positions.iter().position(|p| !p.iter().all(|x| x.abs() < EMBREE_LARGE)) {
            return Err(MeshError::Position(i));
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::Index { triangle, index, count: vertices });
            }
        }
        if let Some(normals) = &normals {
            if normals.len() != vertices {
                return Err(MeshError::Count { what: "normals", count: normals.len(), vertices });
            }
            if let Some(i) = normals.iter().position(|n| !n.iter().all(|x| x.is_finite())) {
                return Err(MeshError::Normal(i));
            }
        }
        if let Some(uvs) = &uvs {
            if uvs.len() != vertices {
                return Err(MeshError::Count { what: "uvs", count: uvs.len(), vertices });
            }
            if let Some(i) = uvs.iter().position(|uv| !uv.iter().all(|x| x.is_finite())) {
                return Err(MeshError::Uv(i));
            }
        }
        positions.push([0.0; 3]);
        positions.shrink_to_fit();
        triangles.shrink_to_fit();
        let mut mesh = Self {
            positions,
            triangles,
            normals,
            uvs,
            attributes: Box::default(),
            later: Vec::new(),
            tangents: Vec::new(),
            has_slivers: false,
            bounds: OnceLock::new(),
        };
        mesh.has_slivers = (0..mesh.triangles.len()).any(|i| mesh.triangle_points(PrimId::new(i)).is_sliver());
        Ok(mesh)
    }

    /// This mesh deforming: its own vertices are those at the opening of the shutter, `later` has those at further
    /// times, evenly spaced to the closing. Between them vertices move along straight lines.
    ///
    /// # Errors
    /// If a number is not finite, or there are more or fewer than this mesh has.
    pub fn deforming(self, later: Vec<MeshStep>) -> Result<Self, MeshError> {
        let vertices = self.positions().len();
        let mut checked = Vec::with_capacity(later.len());
        let mut has_slivers = self.has_slivers;
        for step in later {
            if step.positions.len() != vertices {
                return Err(MeshError::Count {
                    what: "positions at a later time",
                    count: step.positions.len(),
                    vertices,
                });
            }
            let normals = step.normals.filter(|_| self.has_normals());
            if self.has_normals() && normals.is_none() {
                return Err(MeshError::Count { what: "normals at a later time", count: 0, vertices });
            }
            let step = Self::new(step.positions, self.triangles.clone(), normals, None)?;
            has_slivers |= step.has_slivers;
            checked.push(MeshStep { positions: step.positions, normals: step.normals });
        }
        Ok(Self { later: checked, tangents: Vec::new(), has_slivers, bounds: OnceLock::new(), ..self })
    }

    /// Whether a triangle is so flat that [hits are to be confirmed](Self::confirms_hit).
    pub fn has_slivers(&self) -> bool {
        self.has_slivers
    }

    /// Whether a triangle that was found in `f32` to be hit lies ahead of the ray.
    pub fn confirms_hit(&self, prim: PrimId, ray: &Ray) -> bool {
        self.triangle_points_at(prim, ray.time).intersect_plane(ray.origin, ray.direction).t > 0.0
    }

    /// Whether vertices move.
    #[inline(always)]
    pub fn is_deforming(&self) -> bool {
        !self.later.is_empty()
    }

    /// [`padded_positions`](Self::padded_positions) at each time, the first one included.
    pub fn padded_steps(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        std::iter::once(self.positions.as_slice()).chain(self.later.iter().map(|step| step.positions.as_slice()))
    }

    /// The two steps around a time from 0 to 1, and how far it is from the first to the second.
    fn steps_around(&self, time: f32) -> ([usize; 2], f32) {
        let last = self.later.len();
        let at = time * last as f32;
        let first = (at as usize).min(last - 1);
        ([first, first + 1], at - first as f32)
    }

    /// The corners of one triangle at a time from 0 to 1.
    #[inline]
    pub fn triangle_points_at(&self, prim: PrimId, time: f32) -> TrianglePoints {
        if self.is_deforming() { self.deformed_points(prim, time) } else { self.triangle_points(prim) }
    }

    #[inline(never)]
    fn deformed_points(&self, prim: PrimId, time: f32) -> TrianglePoints {
        let ([first, second], s) = self.steps_around(time);
        let positions = |step: usize| if step == 0 { &self.positions } else { &self.later[step - 1].positions };
        let (from, to) = (positions(first), positions(second));
        let at = |i: u32| Vec3::from(from[i as usize]) * (1.0 - s) + Vec3::from(to[i as usize]) * s;
        let [a, b, c] = self.triangles[prim.index()];
        TrianglePoints { a: at(a), b: at(b), c: at(c) }
    }

    /// The normals of a triangle's corners at a time from 0 to 1, if normals are interpolated.
    #[inline]
    pub(crate) fn corner_normals(&self, prim: PrimId, time: f32) -> Option<[Vec3; 3]> {
        let corners = self.triangles[prim.index()];
        if !self.is_deforming() {
            return self.vertex_normals(corners);
        }
        let normals = self.normals.as_ref()?;
        let of = |normals: &[[f32; 3]]| corners.map(|i| Vec3::from(normals[i as usize]));
        let ([first, second], s) = self.steps_around(time);
        let step = |step: usize| if step == 0 { Some(normals) } else { self.later[step - 1].normals.as_ref() };
        let (from, to) = (of(step(first)?), of(step(second)?));
        Some([0, 1, 2].map(|i| from[i] * (1.0 - s) + to[i] * s))
    }

    /// Bounds of one triangle over the whole shutter interval.
    pub fn triangle_bounds(&self, prim: PrimId) -> Aabb {
        let corners = self.triangles[prim.index()];
        let of = |bounds: Aabb, positions: &[[f32; 3]]| {
            corners.iter().fold(bounds, |b, &i| b.extended(Vec3::from(positions[i as usize])))
        };
        let moved = self.padded_steps().fold(Aabb::EMPTY, of);
        if !self.is_deforming() {
            return moved;
        }
        // A point between two others is rounded three times, and may lie beyond both of them.
        let exact = Bounds { min: moved.min.as_dvec3(), max: moved.max.as_dvec3() };
        exact.grown(4.0 * UNIT_ROUNDOFF * exact.min.abs().max(exact.max.abs()).max_element()).padded()
    }

    /// The vertices' positions.
    #[inline]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions[..self.positions.len() - 1]
    }

    /// The positions and one unused vertex behind them, so that 16 bytes of each may be read.
    pub fn padded_positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The corners of each triangle as vertex indices.
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Whether normals are interpolated.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// Whether the mesh has uv coordinates.
    pub fn has_uvs(&self) -> bool {
        self.uvs.is_some()
    }

    /// The corners of one triangle.
    #[inline]
    pub fn triangle_points(&self, prim: PrimId) -> TrianglePoints {
        self.points(self.triangles[prim.index()])
    }

    /// The positions of three vertices.
    #[inline(always)]
    pub(crate) fn points(&self, [a, b, c]: [u32; 3]) -> TrianglePoints {
        let at = |i: u32| Vec3::from(self.positions[i as usize]);
        TrianglePoints { a: at(a), b: at(b), c: at(c) }
    }

    /// The normals of three vertices of a mesh at rest, if normals are interpolated.
    #[inline(always)]
    pub(crate) fn vertex_normals(&self, corners: [u32; 3]) -> Option<[Vec3; 3]> {
        let normals = self.normals.as_ref()?;
        // Not by `map`, which is a call.
        let [a, b, c] = corners;
        Some([Vec3::from(normals[a as usize]), Vec3::from(normals[b as usize]), Vec3::from(normals[c as usize])])
    }

    /// The uv of three vertices; without uvs those whose interpolation gives the barycentric coordinates.
    #[inline(always)]
    pub(crate) fn vertex_uvs(&self, [a, b, c]: [u32; 3]) -> [Vec2; 3] {
        match &self.uvs {
            Some(uvs) => [Vec2::from(uvs[a as usize]), Vec2::from(uvs[b as usize]), Vec2::from(uvs[c as usize])],
            None => [Vec2::ZERO, Vec2::X, Vec2::Y],
        }
    }

    /// The uv at barycentric coordinates `u`, `v` of a triangle's second and third vertex; without uvs these
    /// coordinates themselves.
    pub fn uv(&self, prim: PrimId, u: f32, v: f32) -> Vec2 {
        interpolated_uv(self.vertex_uvs(self.triangles[prim.index()]), [u, v])
    }

    /// Bounds of all triangles.
    pub fn bounds(&self) -> Aabb {
        *self.bounds.get_or_init(|| {
            if self.is_deforming() {
                return (0..self.triangles.len())
                    .fold(Aabb::EMPTY, |b, i| b.union(&self.triangle_bounds(PrimId::new(i))));
            }
            self.triangles
                .iter()
                .flatten()
                .fold(Aabb::EMPTY, |b, &i| b.extended(Vec3::from(self.positions[i as usize])))
        })
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        let normals = self.normals.as_ref().map_or(0, |n| size_of_val(n.as_slice()));
        let uvs = self.uvs.as_ref().map_or(0, |n| size_of_val(n.as_slice()));
        let attributes: usize = self.attributes.iter().map(|attribute| size_of_val(attribute.values.numbers())).sum();
        let of_step = |step: &MeshStep| {
            size_of_val(step.positions.as_slice()) + step.normals.as_ref().map_or(0, |n| size_of_val(n.as_slice()))
        };
        let later: usize = self.later.iter().map(of_step).sum();
        let tangents: usize = self.tangents.iter().map(|t| size_of_val(t.as_slice())).sum();
        size_of_val(self.positions.as_slice())
            + size_of_val(self.triangles.as_slice())
            + normals
            + uvs
            + attributes
            + later
            + tangents
    }

    /// The interaction for a hit of `ray`; see [`Geometry::interaction`](super::Geometry::interaction).
    #[inline]
    pub fn interaction(&self, detail: Detail, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        self.interaction_and_dp_dv(detail, ray, hit).map(|(at, _)| at)
    }

    /// The interaction with the change of the point with v.
    #[inline(always)]
    pub(super) fn interaction_and_dp_dv(
        &self,
        detail: Detail,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<(SurfaceInteraction, Vec3)> {
        let points = self.triangle_points_at(hit.prim, ray.time);

        let plane_hit = points.intersect_plane(ray.origin, ray.direction);
        if !plane_hit.is_valid() {
            return None;
        }
        let (p, n_g, mut error) = (plane_hit.p, plane_hit.n_g, plane_hit.error);
        if self.is_deforming() {
            // Moving a corner to its place takes three roundings.
            let size = points.a.abs().max(points.b.abs()).max(points.c.abs());
            error += 4.0 * UNIT_ROUNDOFF as f32 * n_g.abs().dot(size);
        }

        let (n_s, length) = self.shading_normal(hit, n_g, ray.time);
        let parameters = if detail == Detail::Full {
            self.parameters(hit, &points, n_s, length, ray.time)
        } else {
            Parameters::default()
        };
        let at = SurfaceInteraction {
            p,
            t: plane_hit.t as f32,
            error,
            n_g,
            n_s,
            dp_du: parameters.dp_du,
            uv: parameters.uv,
            shape: hit.shape,
            prim: hit.prim,
            instance: hit.instance,
            time: ray.time,
        };
        Some((at, parameters.dp_dv))
    }

    /// The unit shading normal at a hit, and the length of the interpolated vector that it comes from.
    #[inline(always)]
    fn shading_normal(&self, hit: &Hit, n_g: Vec3, time: f32) -> (Vec3, f32) {
        let Some([n_a, n_b, n_c]) = self.corner_normals(hit.prim, time) else { return (n_g, 1.0) };
        interpolated_normal([n_a, n_b, n_c], [hit.u, hit.v], n_g)
    }

    /// The point `p` of a triangle moved to the surface that the corners' normals suggest (Hanika, "Hacking the Shadow
    /// Terminator"): to the mean of its projections onto the planes through the corners at right angles to their
    /// normals. Only outwards on the side of `toward`; `None` where it stays. `p` and `toward` are in the world, where
    /// `placement` puts the mesh.
    pub(super) fn terminator_point(
        &self,
        prim: PrimId,
        p: DVec3,
        toward: DVec3,
        time: f32,
        placement: Option<&Transform>,
    ) -> Option<DVec3> {
        let normals = self.corner_normals(prim, time)?.map(|n| {
            let n = n.as_dvec3();
            placement.map_or(n, |t| t.normal(n)).normalize_or_zero()
        });
        let points = self.triangle_points_at(prim, time);
        let from_corner = [points.a, points.b, points.c].map(|corner| {
            let corner = corner.as_dvec3();
            p - placement.map_or(corner, |t| t.point(corner))
        });
        let weights = weights(from_corner);
        let side = 1f64.copysign((0..3).map(|i| weights[i] * normals[i].dot(toward)).sum());
        let depths = [0, 1, 2].map(|i| (-side * normals[i].dot(from_corner[i])).max(0.0));
        let raise = (0..3).map(|i| normals[i] * (side * depths[i] * weights[i])).sum::<DVec3>();
        (raise != DVec3::ZERO && raise.is_finite()).then_some(p + raise)
    }

    /// The parametrisation at a hit with the shading normal of this [length](Self::shading_normal).
    #[inline(never)]
    fn parameters(&self, hit: &Hit, points: &TrianglePoints, n_s: Vec3, length: f32, time: f32) -> Parameters {
        let corners = self.triangles[hit.prim.index()];
        let (edge_b, edge_c) = (points.b - points.a, points.c - points.a);
        let uvs = self.vertex_uvs(corners);
        let uv = interpolated_uv(uvs, [hit.u, hit.v]);
        if let Some((tangent, side)) = self.tangent(hit.prim, [1.0 - hit.u - hit.v, hit.u, hit.v], time) {
            // MikkTSpace's frame is that of the interpolated vectors before they are normalised, up to a factor common
            // to all three.
            return Parameters { dp_du: tangent / length, dp_dv: n_s.cross(tangent) * side, uv };
        }
        let [dp_du, dp_dv] = derivatives([edge_b, edge_c], uvs);
        let (dp_du, dp_dv) = if dp_du.is_finite() && dp_dv.is_finite() { (dp_du, dp_dv) } else { (edge_b, edge_c) };
        Parameters { dp_du, dp_dv, uv }
    }

    /// Two edges of a triangle, and the area in uv of the parallelogram between them, with the sign of their order.
    pub(super) fn edges_and_uv_area(&self, prim: PrimId, time: f32) -> ([Vec3; 2], f32) {
        let points = self.triangle_points_at(prim, time);
        ([points.b - points.a, points.c - points.a], uv_area(self.vertex_uvs(self.triangles[prim.index()])))
    }

    /// The interpolated tangent for normal maps and the side of the bitangent; `None` where the mesh has none.
    #[inline]
    fn tangent(&self, prim: PrimId, weights: [f32; 3], time: f32) -> Option<(Vec3, f32)> {
        let first = &self.tangents.first()?[prim.index()];
        if !self.is_deforming() {
            return tangents::interpolate(first, weights);
        }
        let ([first, second], s) = self.steps_around(time);
        let at = |step: usize| tangents::interpolate(&self.tangents[step][prim.index()], weights);
        let ((from, side), (to, _)) = (at(first)?, at(second)?);
        Some((from * (1.0 - s) + to * s, side))
    }
}

/// The unit shading normal where the corners' normals have these weights but the first one's, and the length of the
/// interpolated vector.
#[inline(always)]
pub(crate) fn interpolated_normal([n_a, n_b, n_c]: [Vec3; 3], [u, v]: [f32; 2], n_g: Vec3) -> (Vec3, f32) {
    let n = n_a * (1.0 - u - v) + n_b * u + n_c * v;
    let length_squared = n.length_squared();
    let length = length_squared.sqrt();
    let n = n / length;
    // A vanishing interpolated normal (opposite corners) falls back to the flat one, as does a NaN.
    if !(length_squared > 1e-12) {
        (n_g, 1.0)
    } else if n.dot(n_g) < 0.0 {
        // A mesh may be wound against its normals: the shading normal follows the front.
        (-n, length)
    } else {
        (n, length)
    }
}

#[derive(Default)]
struct Parameters {
    dp_du: Vec3,
    dp_dv: Vec3,
    uv: Vec2,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::ShapeId;

    fn triangle() -> Mesh {
        Mesh::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]], None, None).unwrap()
    }

    #[test]
    fn malformed_buffers_are_refused_with_their_place() {
        let p = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(Mesh::new(p.clone(), vec![], None, None).unwrap_err(), MeshError::Empty);
        let far = Mesh::new(p.clone(), vec![[0, 1, 3]], None, None).unwrap_err();
        assert_eq!(far, MeshError::Index { triangle: 0, index: 3, count: 3 });
        let mut nan = p.clone();
        nan[1][2] = f32::NAN;
        assert_eq!(Mesh::new(nan, vec![[0, 1, 2]], None, None).unwrap_err(), MeshError::Position(1));
        assert!(Mesh::new(p.clone(), vec![[0, 1, 2]], Some(vec![[0.0; 3]]), None).is_err());
        assert!(Mesh::new(p, vec![[0, 1, 2]], None, Some(vec![[f32::NAN; 2]; 3])).is_err());
    }

    #[test]
    fn a_hit_behind_the_origin_is_false() {
        let hit = Hit { t: 0.0, u: 0.2, v: 0.2, shape: ShapeId(0), prim: PrimId(0), instance: Hit::NO_INSTANCE };
        let away = Ray::new(Vec3::new(0.2, 0.2, 1e-7), Vec3::Z);
        assert!(triangle().interaction(Detail::Full, &away, &hit).is_none());
        let toward = Ray::new(Vec3::new(0.2, 0.2, 1e-7), -Vec3::Z);
        let si = triangle().interaction(Detail::Full, &toward, &hit).unwrap();
        assert_eq!(si.n_g, Vec3::Z);
        assert_eq!(si.p.z, 0.0);
    }
}
