//! Group B: rays that leave a surface.

mod boxes;
mod moving;
mod schemes;
mod shadows;
mod shapes;
mod spheres;
mod triangles;

use super::geometry::{Closest, Rng, closest, ray_through};
use super::{Effort, Faults, Outcome};
use crate::accel::{self, Accelerator};
use crate::geometry::{Geometry, Mesh, SpawnPoint, SurfaceInteraction};
use crate::id::PrimId;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Ray, Vec3};
use crate::stability::scenes::packets;

use boxes::{b3_two_sides, b4_closed_boxes, b7_instances};
use moving::b14_moving;
use schemes::b13_schemes;
use shadows::{b12_emitters, b15_sliver_emitters};
use shapes::{b2_convex_shapes, b9_quads, b11_continue};
use spheres::b10_spheres;
use triangles::{b1_triangles, b5_slivers, b6_neighbours, b8_large_ground};

checks! {
    "B1" b1_triangles "a triangle is not found again":
        "random triangles, all corners of one size or each coordinate of its own, 1e-8 to 1e8; rays and segments that \
         leave to either side, half of them grazing down to 1e-5, closest and any hit (pbrt, Triangle.Reintersect)";
    "B2" b2_convex_shapes "a convex shape is not found again":
        "spheres, cylinders, cones, frusta and surfaces of revolution, whole and in part, disks, quads; radius 1e-4 to \
         1e4, turned, scaled by 1e-4 to 1e4, moved by 1e-8 to 1e8; rays and segments that leave outwards, half of them \
         grazing, closest and any hit (pbrt, TestReintersectConvex)";
    "B3" b3_two_sides "both sides of a hit point":
        "the origins on both sides of a point, a ray along the normal from each: one misses, one hits; cube and sphere \
         through 12 chains of transforms, at rest and moving, with scale and shear, at time 0.66 (OptiX Toolkit, \
         testSia)";
    "B4" b4_closed_boxes "closed boxes do not leak":
        "rotated cubes, half size 1e-6, 1 and 1e6, 0 and 1e4 half sizes from the origin; rays from inside, reflected \
         at random";
    "B5" b5_slivers "slivers are not found again":
        "single triangles of aspect 1 to 1e-4, flat ones (an obtuse angle near 180 degrees) and needles; rays and \
         segments, half of them grazing, closest and any hit. Retraces: hits that only the second look in f64 refuses";
    "B6" b6_neighbours "coplanar neighbours are not found":
        "tilted planar mesh of 6 x 6 cells, aspect 1 to 1e-2, right-angled and flat triangles, 0 to 100 sizes from the \
         origin; rays that leave, half of them grazing, closest and any hit, against exact hits of the rounded mesh";
    "B7" b7_instances "convex instances are not found again":
        "cube in an instance, scaled by 1e-2 to 1e2, also unevenly by up to 100 and mirrored, moved by up to 1e5 \
         scales, closest and any hit";
    "B8" b8_large_ground "a large ground is not found again near the world's origin":
        "triangle of size 1e4 to 1e6 through the origin, hit within 0.01 of it: the point is tiny and the error is not \
         (Computer Graphics Stack Exchange 8691)";
    "B9" b9_quads "rays go on through a quad":
        "quads at height -400 to 400, as analytic shape and as two triangles: a ray that hits goes on in its direction \
         (pbrt, BilinearPatch.Offset)";
    "B10" b10_spheres "pictures of tiny and huge spheres":
        "white sphere of radius 1e-3 or 3e5 at 3, 8000 and 2e5 radii from the camera, which is far away or moves the \
         sphere there; under a constant sky it is white, under a sun the picture is the same for all radii (OSPRay, \
         SpherePrecision)";
    "B11" b11_continue "a ray meets each of many surfaces once":
        "64 parallel quads, analytic or of triangles, 1 apart or 4 floats apart; after each hit the ray goes on from \
         the next float (Embree, next_hit)";
    "B12" b12_emitters "shadow rays reach the emitter":
        "from a floor to sampled points of an emitter of each shape, 1e-3 to 1e6 away: nothing is in the way (pbrt, \
         SpawnRayTo)";
    "B13" b13_schemes "offset schemes side by side":
        "rotated cube of half size 1e-6 to 1e6, and one of half size 1000 at 0 to 1e7 from the world's centre; rays \
         from inside, reflected at random: the own face again is a false hit, no hit is a leak. Others: none, from \
         1e-4 along the ray, Waechter and Binder (Ray Tracing Gems, ch. 6), along the normal by 8.94e-5 (1 + largest \
         coordinate) as Mitsuba";
    "B14" b14_moving "moving surfaces are not found again":
        "cube and sphere in instances that move, a deforming cube at rest and in one that moves, at random times and \
         at 0.66; rays that leave outwards, closest and any hit";
    "B15" b15_sliver_emitters "shadow rays reach emitters of slivers":
        "from a floor to sampled points of flat triangles of aspect 1e-2 and 1e-4, 1e-3 to 1e3 away";
}

/// What [`accelerators`] are called in reports.
const NAMES: [&str; 3] = ["embree", "bvh", "packets"];

type Named<'g> = (&'static str, Box<dyn Accelerator + 'g>);

/// The accelerators that leave a surface each in its way: Embree and packets with `f32`, and the others (one primitive
/// test) by the bounding volume hierarchy.
fn accelerators(geometry: &Geometry) -> Vec<Named<'_>> {
    let single = |name: &'static str| {
        (name, accel::build(name.parse().expect("names of accelerators"), geometry, 1).expect("accelerators build"))
    };
    vec![single("embree"), single("bvh"), ("packets", packets(geometry))]
}

/// A random point inside one triangle of a mesh.
fn point_on(rng: &mut Rng, mesh: &Mesh, prim: PrimId) -> DVec3 {
    let points = mesh.triangle_points(prim);
    let [a, b, c] = rng.barycentric();
    points.a.as_dvec3() * a + points.b.as_dvec3() * b + points.c.as_dvec3() * c
}

/// A ray aimed at `target` from the side `n`, at about the distance `far`.
fn aimed(rng: &mut Rng, target: DVec3, n: DVec3, far: f64) -> Ray {
    ray_through(target + rng.direction_around(n) * far * rng.range(0.1, 2.0), target)
}

/// The interaction of a ray aimed at a point; `None` if rounding takes it past an edge.
fn seen(accel: &dyn Accelerator, geometry: &Geometry, ray: &Ray) -> Option<SurfaceInteraction> {
    closest(accel, geometry, ray).found
}

/// Half of the time a random direction to the side `n`, else a grazing one down to 1e-5. It stays on that side when it
/// is rounded.
fn leaving(rng: &mut Rng, n: DVec3) -> DVec3 {
    // Of a normal rounded to `f32`, the part along a direction near it would not vanish from the tangent.
    let n = n.normalize();
    let d = rng.direction_around(n);
    let along = (d - n * d.dot(n)).normalize();
    if rng.unit() < 0.5 { (along + n * rng.magnitude(-5.0, -1.0)).normalize() } else { (d + n * 1e-5).normalize() }
}

/// A random one of the two sides.
fn either(rng: &mut Rng, n: Vec3) -> DVec3 {
    n.as_dvec3() * if rng.unit() < 0.5 { -1.0 } else { 1.0 }
}

/// The segment to a point `distance` away in `direction`; `None` where rounding may take that point to the other side
/// of the tangent plane.
fn free_segment(si: &SurfaceInteraction, direction: DVec3, distance: f64) -> Option<Ray> {
    let p = si.p + direction * distance;
    let n = si.n_g.as_dvec3().abs();
    let resolved = UNIT_ROUNDOFF * (n.dot(si.p.abs()) + n.dot(p.abs()) + distance) + f64::from(si.error);
    let height = (direction * distance).dot(si.n_g.as_dvec3()).abs();
    (height > 8.0 * resolved).then(|| si.spawn_to(&SpawnPoint { p, n: Vec3::ZERO, error: 0.0 }))
}

/// What became of rays that leave a body that should not be in their way.
#[derive(Default)]
struct Leavings {
    rays: usize,
    segments: usize,
    /// Closest hits that stand in `f64`.
    found_again: Faults,
    /// Rays without an end that any-hit queries call occluded.
    occluded: Faults,
    /// The same of segments to free points.
    segments_occluded: Faults,
    retraces: usize,
}

impl Leavings {
    /// Leaves in `direction`, without an end and to a point `distance` away.
    fn leave(
        &mut self,
        accel: &dyn Accelerator,
        geometry: &Geometry,
        si: &SurfaceInteraction,
        direction: DVec3,
        distance: f64,
    ) {
        let ray = si.spawn(direction.as_vec3());
        let Closest { found, retraces } = closest(accel, geometry, &ray);
        self.rays += 1;
        self.found_again.require(found.is_none(), || format!("{ray:?} from {si:?} meets {found:?}"));
        self.occluded.require(!accel.occluded(&ray), || format!("{ray:?} from {si:?}"));
        self.retraces += retraces;
        if let Some(segment) = free_segment(si, direction, distance) {
            self.segments += 1;
            self.segments_occluded.require(!accel.occluded(&segment), || format!("{segment:?} from {si:?}"));
        }
    }

    /// None may be found again, and there must be some.
    fn report(&self, outcome: Outcome, what: &str) -> Outcome {
        self.report_within(outcome, what, 0.0)
    }

    /// At most this fraction of each kind may be found again.
    fn report_within(&self, outcome: Outcome, what: &str, fraction: f64) -> Outcome {
        let allowed = (fraction * self.rays as f64).floor();
        outcome
            .at_least(format!("{what}: rays"), self.rays as f64, 1_000.0)
            .at_least(format!("{what}: segments"), self.segments as f64, 500.0)
            .at_most(format!("{what}: found again"), self.found_again.count as f64, allowed)
            .shown_by(&self.found_again)
            .at_most(format!("{what}: rays called occluded"), self.occluded.count as f64, allowed)
            .shown_by(&self.occluded)
            .at_most(format!("{what}: segments called occluded"), self.segments_occluded.count as f64, allowed)
            .shown_by(&self.segments_occluded)
    }

    fn retraces_per_ray(&self) -> f64 {
        self.retraces as f64 / self.rays as f64
    }
}
