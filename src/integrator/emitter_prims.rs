//! The emitting primitives of scenes with few of them: which one a ray meets first, without regard to occlusion.

use super::World;
use crate::geometry::{Geometry, Shape, SurfaceInteraction};
use crate::id::{PrimId, ShapeId};
use crate::light::Light;
use crate::math::float::step_past;
use crate::math::{Aabb, Bounds, DVec3, Ray, Transform, Vec3};
use crate::scene::Scene;

/// Up to this number of primitives, testing all of them costs less than what is gained.
const MAX_PRIMS: usize = 16;

/// Hits of a primitive that are skipped as rounding artefacts, as those of [`World::resolve`].
const MAX_RETRACES: u32 = 4;

/// Relative widening of boxes, far above the errors of `f32`.
const ROUNDING: f32 = 1e-5;

/// The primitives that emit.
pub(super) struct EmitterPrims(Vec<EmitterPrim>);

struct EmitterPrim {
    shape: ShapeId,
    prim: PrimId,
    bounds: OrientedBox,
}

/// A box around a primitive, which its shape's transformation has turned with it.
pub(super) struct OrientedBox {
    center: Vec3,
    /// Rows of the linear map from the world to the space of the box.
    rows: [Vec3; 3],
    half_size: Vec3,
    /// By how much the box is wider for each unit of the largest coordinate of a point relative to the centre, and
    /// how much in any case: rounding must not make rays miss.
    slack: [f32; 2],
}

impl EmitterPrims {
    /// Those of a scene; `None` if there are none or many, or if any has holes or is placed by instances.
    pub fn new(scene: &Scene) -> Option<Self> {
        let mut shapes: Vec<ShapeId> = Vec::new();
        for light in scene.lights.lights() {
            let Light::Area(light) = light else { continue };
            if shapes.last() != Some(&light.shape) {
                shapes.push(light.shape);
            }
            if shapes.len() > MAX_PRIMS {
                return None;
            }
        }
        let geometry = &scene.geometry;
        let count: usize = shapes.iter().map(|&shape| geometry.shape(shape).prim_count()).sum();
        let is_plain = |shape: &ShapeId| geometry.world.contains(shape) && !geometry.cutouts.has_holes(*shape);
        if count == 0 || count > MAX_PRIMS || !shapes.iter().all(is_plain) {
            return None;
        }
        let prims = shapes.iter().flat_map(|&shape| {
            (0..geometry.shape(shape).prim_count()).map(move |i| EmitterPrim::of(geometry, shape, PrimId::new(i)))
        });
        Some(Self(prims.collect()))
    }

    /// The box around each.
    pub fn boxes(&self) -> impl Iterator<Item = &OrientedBox> {
        self.0.iter().map(|prim| &prim.bounds)
    }

    /// The first that a ray meets of those whose bits are set in `candidates`.
    pub fn closest(&self, world: &World, ray: &Ray, mut candidates: u32) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        let mut closest = None;
        while candidates != 0 {
            if let Some(at) = self.0[candidates.trailing_zeros() as usize].intersect(world, &ray) {
                ray.t_max = at.t;
                closest = Some(at);
            }
            candidates &= candidates - 1;
        }
        closest
    }
}

impl EmitterPrim {
    fn of(geometry: &Geometry, shape: ShapeId, prim: PrimId) -> Self {
        let bounds = match geometry.shape(shape) {
            Shape::Analytic(placed) => OrientedBox::new(&placed.shape.bounds(), &placed.transform),
            shape => {
                let Aabb { min, max } = shape.prim_bounds(prim);
                OrientedBox::new(&Bounds { min: min.as_dvec3(), max: max.as_dvec3() }, &Transform::IDENTITY)
            }
        };
        Self { shape, prim, bounds }
    }

    fn intersect(&self, world: &World, ray: &Ray) -> Option<SurfaceInteraction> {
        let geometry = &world.scene.geometry;
        let mut ray = *ray;
        for _ in 0..MAX_RETRACES {
            let hit = geometry.shape(self.shape).intersect_prim(&ray, self.shape, self.prim)?;
            if let Some(at) = geometry.interaction_with(world.detail(self.shape), &ray, &hit) {
                return Some(at);
            }
            ray.t_min = step_past(hit.t);
        }
        None
    }
}

impl OrientedBox {
    fn new(bounds: &Bounds, transform: &Transform) -> Self {
        let center = transform.point(0.5 * (bounds.min + bounds.max));
        let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| transform.inverse_vector(axis).as_vec3());
        let rows = std::array::from_fn(|k| Vec3::from_array(columns.map(|column| column[k])));
        let scale = rows.iter().fold(0.0, |scale: f32, row| scale.max(row.abs().element_sum()));
        let slack = ROUNDING * scale;
        let center = center.as_vec3();
        let half_size = (0.5 * (bounds.max - bounds.min)).as_vec3();
        Self { center, rows, half_size, slack: [slack, slack * center.abs().max_element()] }
    }

    /// Whether a ray may meet it, by the axes that separate a line from a box; without branches. It may where numbers
    /// are infinite.
    #[inline(always)]
    pub fn may_be_met(&self, origin: Vec3, direction: Vec3) -> bool {
        let from = origin - self.center;
        let local = |v: Vec3| Vec3::new(self.rows[0].dot(v), self.rows[1].dot(v), self.rows[2].dot(v));
        let (o, d) = (local(from), local(direction));
        let largest = from.x.abs().max(from.y.abs()).max(from.z.abs());
        let half = self.half_size + Vec3::splat(self.slack[0] * largest + self.slack[1]);
        let size = d.abs();
        let is_behind = o.dot(d) > half.length() * d.length();
        let is_apart = is_behind
            | ((o.y * d.z - o.z * d.y).abs() > half.y * size.z + half.z * size.y)
            | ((o.z * d.x - o.x * d.z).abs() > half.z * size.x + half.x * size.z)
            | ((o.x * d.y - o.y * d.x).abs() > half.x * size.y + half.y * size.x);
        !is_apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Analytic, Disk, Quad, Sphere, TransformedShape};
    use crate::math::{DAffine3, Rng};

    /// Rays through points of a box around a shape, from near and from 10,000 times its size away.
    #[test]
    fn boxes_are_met_by_all_rays_that_meet_what_is_within() {
        let mut random = Rng::new(5);
        let mut hits = 0;
        for i in 0..60 {
            let shape = match i % 3 {
                0 => Analytic::Quad(Quad::new(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y).unwrap()),
                1 => Analytic::Sphere(Sphere::new(0.5, -0.5, 0.5, std::f64::consts::TAU).unwrap()),
                _ => Analytic::Disk(Disk::new(0.7, 0.2, 4.0).unwrap()),
            };
            let size = DVec3::new(1.0, 0.2 + f64::from(random.unit_f32()), 0.5);
            let turn = DAffine3::from_axis_angle(random.direction(), f64::from(i));
            let place = DAffine3::from_translation(random.direction() * f64::from(i) * 2.0);
            let map = place * turn * DAffine3::from_scale(size);
            let shape = Shape::Analytic(TransformedShape::new(shape, Transform::new(map).unwrap()));
            let geometry = Geometry { shapes: vec![shape], world: vec![ShapeId(0)], ..Geometry::default() };
            let prim = EmitterPrim::of(&geometry, ShapeId(0), PrimId(0));
            for k in 0..2_000 {
                let local = random.direction() * f64::from(random.unit_f32()) * 0.8;
                let target = map.transform_point3(local);
                let distance = 10f64.powi(k % 7 - 2);
                let from = (target + random.direction() * distance).as_vec3();
                let ray = Ray::new(from, (target - from.as_dvec3()).normalize().as_vec3());
                if geometry.shape(ShapeId(0)).intersect_prim(&ray, ShapeId(0), PrimId(0)).is_some() {
                    hits += 1;
                    assert!(prim.bounds.may_be_met(ray.origin, ray.direction), "{i} {k} {ray:?}");
                }
            }
        }
        assert!(hits > 20_000, "{hits}");
    }
}
