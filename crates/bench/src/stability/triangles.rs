//! Group A: triangles and watertightness.

use std::f64::consts::PI;

use super::geometry::{
    Rng, closest, cube, grid, instances, mesh, meshes, ray, ray_through, sphere_mesh, transform, triangle, world,
};
use super::scenes::hybrid_bvh;
use super::{Effort, Faults, Outcome};
use crate::accel::{self, AccelKind, Accelerator, LinearAccel};
use crate::geometry::{Analytic, Geometry, Mesh, MeshStep, Quad, Shape, SurfaceInteraction, TransformedShape};
use crate::id::PrimId;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DMat3, DVec3, Ray, Transform, Vec3};

checks! {
    "A1" a1_triangle_hits "accuracy of triangle hits":
        "unit triangle, rays from one unit away to points with barycentrics of at least 1e-3 (Embree, verify \
         TriangleHitTest)";
    "A2" a2_quad_hits "accuracy of hits of a quad":
        "unit square as an analytic shape, rays from one unit away to points at least 1e-3 from its edges (Embree, \
         verify QuadHitTest)";
    "A3" a3_watertight_meshes "closed sphere and plane, at rest and with two equal time steps":
        "sphere of radius 2 around the origin and far away, plane of 12 x 12 far away; random rays from within 0.5 of \
         the centre and at the plane, closest and any hit (Embree, verify WatertightTest)";
    "A4" a4_edges "rays at edges":
        "closed sphere, scale 1e-6 to 1e6, 0 to 1e7 radii from the origin; rays from the centre to random points of \
         edges, closest and any hit (Woop, Benthin, Wald, \"Watertight Ray/Triangle Intersection\")";
    "A5" a5_vertices "rays at vertices":
        "closed sphere; rays from the centre and from around it to vertices, closest and any hit (pbrt, \
         Triangle.Watertight). Embree computes edge functions in f32 and may lose the vertex itself: 3 % is a \
         picture's set of measure zero";
    "A6" a6_bumpy_mesh "closed mesh with bumps":
        "16 x 16 sphere mesh with radii of 1 to 6, random rays from near the centre, closest and any hit (pbrt, \
         Triangle.Watertight)";
    "A7" a7_small_far_triangles "small triangles far away":
        "tilted plane of 100 x 100 cells of size 1, origins in a cube of half size 1e6, rays at the centroids of \
         triangles, at least 0.1 rad from grazing (Embree, verify SmallTriangleHitTest). A direction in f32 misses the \
         centroid by up to 0.06 / sin: the other accelerators must find the triangle that the rounded ray meets";
    "A8" a8_solid_angle "solid angle of a triangle":
        "triangles with corners within 10 of a point: 65536 points by area, and random directions, against van \
         Oosterom and Strackee's formula (pbrt, Triangle.SolidAngle)";
    "A9" a9_bad_cases "slivers that are wrong in other programs":
        "a triangle without area (pbrt, Triangle.BadCases) and one that is a line in f32, with a ray along it: no hit, \
         or one with numbers";
    "A10" a10_both_sides "both sides of a triangle":
        "rays at a triangle from both sides, in the world and in a mirrored instance: all hit, the normal \
         distinguishes the sides (Embree, verify BackfaceCullingTest)";
    "A11" a11_axes "rays along axes":
        "inside of a cube, in the planes of faces' diagonals and next to faces, with zeros and negative zeros in the \
         direction, closest and any hit";
}

/// Where Embree's own watertightness test stands: coordinates are quantised to 1/64 there.
const FAR: DVec3 = DVec3::new(148_376.0, 1_234.0, -223_423.0);

type Named<'g> = (&'static str, Box<dyn Accelerator + 'g>);

/// Every accelerator but `hybrid`, whose triangles are Embree's; the linear one only for few triangles.
fn accelerators(geometry: &Geometry) -> Vec<Named<'_>> {
    const FEW: usize = 5_000;
    let prims: usize = geometry.shapes.iter().map(Shape::prim_count).sum();
    let is_feasible = |kind: AccelKind| match kind {
        AccelKind::Hybrid(_) => false,
        AccelKind::Linear => prims <= FEW,
        _ => true,
    };
    let feasible = AccelKind::ALL.into_iter().filter(|(kind, _)| is_feasible(*kind));
    let all = feasible.map(|(kind, name)| (name, accel::build(kind, geometry, 1).expect("accelerators build")));
    all.chain([("hybrid:bvh", hybrid_bvh(geometry))]).collect()
}

fn embree(geometry: &Geometry) -> Box<dyn Accelerator + '_> {
    accel::build(AccelKind::EMBREE, geometry, 1).expect("Embree builds")
}

/// Counts by accelerator.
#[derive(Default)]
struct Tally {
    rays: usize,
    lost: Vec<(&'static str, Faults)>,
}

impl Tally {
    /// Counts the rays that every accelerator loses, by closest and by any hit. Each must hit something. The linear one
    /// is slow and gets every eighth.
    fn trace(&mut self, accels: &[Named], rays: &[Ray]) {
        self.rays += rays.len();
        for (name, accel) in accels {
            let rays = if *name == "linear" { &rays[..rays.len() / 8] } else { rays };
            let is_lost = |ray: &Ray| usize::from(accel.intersect(ray).is_none()) + usize::from(!accel.occluded(ray));
            let lost = Faults::of(rays, is_lost, |ray| format!("{ray:?}"));
            match self.lost.iter_mut().find(|(known, _)| known == name) {
                Some((_, sum)) => *sum += lost,
                None => self.lost.push((name, lost)),
            }
        }
    }

    /// A measure for each accelerator: nothing may be lost.
    fn report(self, mut outcome: Outcome, what: &str) -> Outcome {
        outcome = outcome.at_least(format!("{what}rays"), self.rays as f64, 1.0);
        for (name, lost) in self.lost {
            outcome = outcome.none(format!("{what}lost by {name}"), lost);
        }
        outcome
    }
}

/// The errors of hits of the unit triangle or square in the plane z = 0 by rays from one unit away.
struct HitErrors {
    missed: Faults,
    parameters: f64,
    place: f64,
    normal: f64,
}

fn hit_errors(geometry: &Geometry, mut target: impl FnMut() -> DVec3, count: usize) -> HitErrors {
    let (embree, linear) = (embree(geometry), LinearAccel::new(geometry));
    let mut errors = HitErrors { missed: Faults::NONE, parameters: 0.0, place: 0.0, normal: 0.0 };
    for _ in 0..count {
        let target = target();
        let ray = ray_through(-DVec3::Z, target);
        for accel in [&*embree, &linear] {
            let Some(si) = accel.intersect(&ray).and_then(|hit| geometry.interaction(&ray, &hit)) else {
                errors.missed.require(false, || format!("{ray:?}"));
                continue;
            };
            let parameters = [f64::from(si.uv.x) - target.x, f64::from(si.uv.y) - target.y, f64::from(si.t) - 1.0];
            errors.parameters = parameters.iter().fold(errors.parameters, |worst, e| worst.max(e.abs()));
            errors.place = errors.place.max((si.p - target).abs().max_element());
            errors.normal = errors.normal.max((si.n_g.as_dvec3() - DVec3::Z).length());
        }
    }
    errors
}

impl HitErrors {
    fn report(self) -> Outcome {
        // 16 units in the last place of one.
        const BOUND: f64 = 16.0 * f32::EPSILON as f64;
        Outcome::new()
            .none("missed", self.missed)
            .at_most("error of u, v, t", self.parameters, BOUND)
            .at_most("error of the point", self.place, BOUND)
            .at_most("error of the normal", self.normal, BOUND)
    }
}

fn a1_triangle_hits(effort: Effort) -> Outcome {
    let geometry = meshes(vec![triangle(DVec3::ZERO, DVec3::X, DVec3::Y)]);
    let mut rng = Rng::new(1);
    let target = || {
        let [_, u, v] = rng.barycentric().map(|b| 1e-3 + 0.997 * b);
        DVec3::new(u, v, 0.0)
    };
    hit_errors(&geometry, target, effort.pick(10_000, 1_000_000)).report()
}

fn a2_quad_hits(effort: Effort) -> Outcome {
    let quad = Quad::new(DVec3::ZERO, DVec3::X, DVec3::Y).expect("the unit square has an area");
    let geometry = world(vec![Shape::Analytic(TransformedShape::new(Analytic::Quad(quad), Transform::IDENTITY))]);
    let mut rng = Rng::new(2);
    let target = || DVec3::new(rng.range(1e-3, 0.999), rng.range(1e-3, 0.999), 0.0);
    hit_errors(&geometry, target, effort.pick(10_000, 1_000_000)).report()
}

/// The same mesh again as the second of two time steps.
fn with_two_steps(mesh: Mesh) -> Mesh {
    let step = MeshStep { positions: mesh.positions().to_vec(), normals: None };
    mesh.deforming(vec![step]).expect("equal steps have as many vertices")
}

fn a3_watertight_meshes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(3);
    let (slices, rings) = effort.pick((60, 30), (500, 250));
    let count = effort.pick(4_000, 100_000);
    let mut from_inside = |center: DVec3| -> (Mesh, Vec<Ray>) {
        let rays = (0..count).map(|_| Ray { time: rng.unit_f32(), ..ray(center + 0.5 * rng.cube(), rng.direction()) });
        (sphere_mesh(center, 2.0, slices, rings), rays.collect())
    };
    let mut scenes = vec![from_inside(DVec3::ZERO), from_inside(FAR)];
    let (x, y) = (12.0 * DVec3::X, 12.0 * DVec3::Y);
    let corner = FAR - 0.5 * (x + y);
    let at_plane = (0..count).map(|_| {
        let target = corner + x * rng.range(0.05, 0.95) + y * rng.range(0.05, 0.95);
        let from = target + DVec3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(1.0, 4.0));
        Ray { time: rng.unit_f32(), ..ray_through(from, target) }
    });
    scenes.push((grid(corner, x, y, effort.pick(40, 500), |_, _| 0.0), at_plane.collect()));

    let (mut still, mut moving) = (Tally::default(), Tally::default());
    for (mesh, rays) in scenes {
        let geometry = meshes(vec![mesh.clone()]);
        still.trace(&accelerators(&geometry), &rays);
        let geometry = meshes(vec![with_two_steps(mesh)]);
        moving.trace(&accelerators(&geometry), &rays);
    }
    moving.report(still.report(Outcome::new(), ""), "two equal time steps: ")
}

fn corners(mesh: &Mesh, prim: usize) -> [DVec3; 3] {
    let points = mesh.triangle_points(PrimId::new(prim));
    [points.a, points.b, points.c].map(Vec3::as_dvec3)
}

fn a4_edges(effort: Effort) -> Outcome {
    let mut rng = Rng::new(4);
    let mut tally = Tally::default();
    for scale in [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6] {
        for offset in [0.0, 1e5, 1e7] {
            let center = DVec3::new(0.7, -0.4, 0.6) * offset * scale;
            let mesh = sphere_mesh(center, 2.0 * scale, 48, 24);
            let geometry = meshes(vec![mesh.clone()]);
            // At the largest offset a sphere is a few floats wide: rays start in the middle, the one point that is
            // inside for sure.
            let next = || {
                let [a, b, _] = corners(&mesh, rng.below(mesh.triangles().len()));
                ray_through(center, a.lerp(b, rng.unit()))
            };
            let rays: Vec<Ray> = std::iter::repeat_with(next).take(effort.pick(1_000, 10_000)).collect();
            tally.trace(&accelerators(&geometry), &rays);
        }
    }
    tally.report(Outcome::new(), "")
}

fn a5_vertices(effort: Effort) -> Outcome {
    let mut rng = Rng::new(5);
    let sphere = sphere_mesh(DVec3::ZERO, 2.0, 48, 24);
    let geometry = meshes(vec![sphere.clone()]);
    let next = || {
        let p = sphere.positions()[rng.below(sphere.positions().len())];
        // From the centre the ray passes exactly through the vertex; from elsewhere up to the rounding of the
        // direction.
        let from = if rng.unit() < 0.5 { DVec3::ZERO } else { 0.5 * rng.cube() };
        ray_through(from, DVec3::from_array(p.map(f64::from)))
    };
    let rays: Vec<Ray> = std::iter::repeat_with(next).take(effort.pick(5_000, 100_000)).collect();
    let mut tally = Tally::default();
    tally.trace(&accelerators(&geometry), &rays);
    let queries = 2.0 * rays.len() as f64;
    tally.lost.into_iter().fold(Outcome::new(), |outcome, (name, lost)| {
        if name == "embree" {
            outcome.at_most("fraction lost by embree", lost.count as f64 / queries, 0.03).shown_by(&lost)
        } else {
            outcome.none(format!("lost by {name}"), lost)
        }
    })
}

fn a6_bumpy_mesh(effort: Effort) -> Outcome {
    let mut rng = Rng::new(6);
    let mut tally = Tally::default();
    for _ in 0..10 {
        let smooth = sphere_mesh(DVec3::ZERO, 1.0, 16, 16);
        let positions =
            smooth.positions().iter().map(|p| DVec3::from_array(p.map(f64::from)) * (1.0 + 5.0 * rng.unit()));
        let bumpy = mesh(&positions.collect::<Vec<_>>(), smooth.triangles().to_vec());
        let geometry = meshes(vec![bumpy]);
        let next = || ray(0.25 * rng.cube(), rng.direction());
        let rays: Vec<Ray> = std::iter::repeat_with(next).take(effort.pick(1_000, 100_000)).collect();
        tally.trace(&accelerators(&geometry), &rays);
    }
    tally.report(Outcome::new(), "")
}

/// How far `p` is outside of the triangle in its plane with the unit normal `n`; negative inside.
fn outside([a, b, c]: [DVec3; 3], n: DVec3, p: DVec3) -> f64 {
    let past = |from: DVec3, to: DVec3| (p - from).dot((to - from).cross(n).normalize());
    past(a, b).max(past(b, c)).max(past(c, a))
}

fn a7_small_far_triangles(effort: Effort) -> Outcome {
    let mut rng = Rng::new(7);
    let linear_map = rng.rotation() * 100.0;
    let (x, y) = (linear_map.x_axis, linear_map.y_axis);
    let n = x.cross(y).normalize();
    let plane = grid(-0.5 * (x + y), x, y, 100, |_, _| 0.0);
    let geometry = meshes(vec![plane.clone()]);
    let accels: Vec<Named> = accelerators(&geometry);
    let (mut rays, mut other, mut off) = (0, 0, 0f64);
    let [mut missed, mut missed_by_embree, mut wrong] = [const { Faults::NONE }; 3];
    for _ in 0..effort.pick(4_000, 1_000_000) {
        let prim = rng.below(plane.triangles().len());
        let [a, b, c] = corners(&plane, prim);
        let centroid = (a + b + c) / 3.0;
        let ray = ray_through(1e6 * rng.cube(), centroid);
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let sine = direction.normalize().dot(n).abs();
        // Not so near the border that a rounded ray passes beside it.
        let inside = [x, y].iter().all(|axis| centroid.dot(*axis).abs() <= 45.0 * axis.length());
        if sine < 0.1 || !inside {
            continue;
        }
        rays += 1;
        let p = origin + direction * (n.dot(a - origin) / n.dot(direction));
        for (name, accel) in &accels {
            let Some(found) = accel.intersect(&ray).map(|hit| hit.prim.index()) else {
                let missed = if *name == "embree" { &mut missed_by_embree } else { &mut missed };
                missed.require(false, || format!("{name}: {ray:?}"));
                continue;
            };
            // On the way into the plane the distance from the ray grows by the inverse sine.
            let beside = outside(corners(&plane, found), n, p).max(0.0) * sine / (origin.length() * UNIT_ROUNDOFF);
            if *name == "embree" {
                other += usize::from(found != prim);
                off = off.max(beside);
            } else {
                let describe = || format!("{name}: {ray:?} hits triangle {found} in place of {prim}");
                wrong.require(found == prim || outside(corners(&plane, prim), n, p) >= -1e-4, describe);
                wrong.require(beside * UNIT_ROUNDOFF <= 1e-9, describe);
            }
        }
    }
    Outcome::new()
        .at_least("rays", f64::from(rays), 1_000.0)
        .none("missed by other accelerators", missed)
        // At 1e6 corners less the origin lie on a grid of 1/16, so that some rays meet corners exactly, of which Embree
        // loses a few (A5).
        .at_most("fraction missed by Embree", missed_by_embree.count as f64 / f64::from(rays), 2e-5)
        .shown_by(&missed_by_embree)
        .none("other triangles than the ray meets, other accelerators", wrong)
        // Corners less the origin have one unit of roundoff, the edge functions made of them up to seven more.
        .at_most("embree: distance of the ray from the triangle found, units of roundoff of the origin", off, 8.0)
        .record("embree: fraction with another triangle than aimed at", other as f64 / f64::from(rays))
        .short(
            "Embree forms edge functions in f32 from corners less the origin, which are 0.03 units off at 1e6; the \
             catalogue requires 99.998 % right, which f32 rays cannot name",
        )
}

/// The solid angle of a triangle seen from the origin (van Oosterom and Strackee, "The Solid Angle of a Plane
/// Triangle").
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(DVec3::normalize);
    2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

fn a8_solid_angle(effort: Effort) -> Outcome {
    const POINTS: u32 = 65_536;
    let mut rng = Rng::new(8);
    let (mut by_area, mut expected_hits, mut hits) = (0f64, 0.0, 0);
    let directions = effort.pick(20_000, 2_000_000);
    let mut variance = 0.0;
    for _ in 0..50 {
        let mesh = triangle(10.0 * rng.cube(), 10.0 * rng.cube(), 10.0 * rng.cube());
        let points = mesh.triangle_points(PrimId(0));
        let exact = solid_angle(corners(&mesh, 0));
        let shift = rng.pair();
        let terms = (0..POINTS).map(|i| {
            // The additive recurrence of the plastic number (Roberts, "The Unreasonable Effectiveness of Quasirandom
            // Sequences").
            let u = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| f64::from(i) * step);
            let u = [0, 1].map(|k| (u[k] + f64::from(shift[k])).fract() as f32);
            points.sample(u).map_or(0.0, |s| {
                let distance = s.p.length();
                s.n.as_dvec3().dot(s.p / distance).abs() / (distance * distance * s.pdf_area)
            })
        });
        let estimate = terms.sum::<f64>() / f64::from(POINTS);
        by_area = by_area.max((estimate / exact - 1.0).abs());

        let geometry = meshes(vec![mesh]);
        let accel = LinearAccel::new(&geometry);
        hits += (0..directions).filter(|_| accel.occluded(&ray(DVec3::ZERO, rng.direction()))).count();
        let fraction = exact / (4.0 * PI);
        expected_hits += fraction * f64::from(directions);
        variance += fraction * (1.0 - fraction) * f64::from(directions);
    }
    Outcome::new().at_most("relative error by area", by_area, 0.015).at_most(
        // A normal deviation beyond 4.9 is a false alarm of 1e-6.
        "random directions: standard errors from the formula",
        ((hits as f64 - expected_hits) / variance.sqrt()).abs(),
        4.9,
    )
}

fn a9_bad_cases(_: Effort) -> Outcome {
    let collinear = [
        [-1113.45459, -79.049614, -56.2431908],
        [-1113.45459, -87.0922699, -56.2431908],
        [-1113.45459, -79.2090149, -56.2431908],
    ];
    let across = Ray {
        t_max: 0.9999,
        ..Ray::new(Vec3::new(-1_081.479_2, 99.999_95, 87.770_11), Vec3::new(-32.107_3, -183.355_87, -144.607_64))
    };
    let line =
        [[-1113.4546, -79.049614, -56.24319], [-1113.4546, -79.049614, -56.24319], [-1113.4547, -79.04961, -56.24319]];
    let along = Ray::new(Vec3::ZERO, Vec3::new(-1_113.454_6, -79.049_61, -56.243_19));
    let (mut hits, mut not_finite) = (Faults::NONE, Faults::NONE);
    for (corners, ray) in [(collinear, across), (line, along)] {
        let [a, b, c] = corners.map(DVec3::from_array);
        let mesh = triangle(a, b, c);
        let sample = mesh.triangle_points(PrimId(0)).sample([0.3, 0.4]);
        let is_finite = sample.is_none_or(|s| s.p.is_finite() && s.n.is_finite() && s.pdf_area.is_finite());
        not_finite.require(is_finite, || format!("{corners:?}: {sample:?}"));
        let geometry = meshes(vec![mesh]);
        for (name, accel) in accelerators(&geometry) {
            let (hit, occluded) = (accel.intersect(&ray), accel.occluded(&ray));
            hits.add(usize::from(hit.is_some()) + usize::from(occluded), || {
                format!("{name}: {ray:?} has {hit:?} (occluded: {occluded})")
            });
        }
    }
    Outcome::new().none("hits", hits).none("samples that are not finite", not_finite)
}

fn a10_both_sides(effort: Effort) -> Outcome {
    let mut rng = Rng::new(10);
    let (mut missed, mut wrong_side) = (Faults::NONE, Faults::NONE);
    let mirror =
        transform(DMat3::from_diagonal(DVec3::new(-1.5, 0.8, 1.2)) * rng.rotation(), DVec3::new(3.0, 1.0, -2.0));
    let (a, b, c) = (rng.cube(), rng.cube(), rng.cube());
    let shape = || Shape::Mesh(triangle(a, b, c));
    for (geometry, placement) in
        [(world(vec![shape()]), Transform::IDENTITY), (instances(vec![shape()], &[mirror]), mirror)]
    {
        let accels = accelerators(&geometry);
        let front = placement.normal((b - a).cross(c - a)).normalize();
        for i in 0..effort.pick(1_000, 100_000) {
            let [u, v, w] = rng.barycentric().map(|weight| 1e-3 + 0.997 * weight);
            let target = placement.point(a * u + b * v + c * w);
            let side = if i % 2 == 0 { front } else { -front };
            let ray = ray_through(target + rng.direction_around(side) + 0.1 * side, target);
            for (name, accel) in &accels {
                let found: Option<SurfaceInteraction> = closest(&**accel, &geometry, &ray).found;
                let describe = || format!("{name}: {ray:?} has the normal {:?}", found.map(|si| si.n_g));
                missed.add(usize::from(found.is_none()) + usize::from(!accel.occluded(&ray)), describe);
                let is_right = found.is_none_or(|si| si.n_g.dot(ray.direction) * (side.dot(front) as f32) < 0.0);
                wrong_side.require(is_right, describe);
            }
        }
    }
    // A closed body of such triangles has its fronts outside.
    let geometry = meshes(vec![cube(rng.rotation(), DVec3::ZERO)]);
    for (name, accel) in accelerators(&geometry) {
        for _ in 0..effort.pick(200, 20_000) {
            let ray = ray(0.5 * rng.cube(), rng.direction());
            let found = closest(&*accel, &geometry, &ray).found;
            wrong_side.require(found.is_some_and(|si| si.n_g.dot(ray.direction) > 0.0), || {
                format!("{name}: {ray:?} from within a cube has the normal {:?}", found.map(|si| si.n_g))
            });
        }
    }
    Outcome::new().none("missed", missed).none("normals on the wrong side", wrong_side)
}

fn a11_axes(effort: Effort) -> Outcome {
    let geometry = meshes(vec![cube(DMat3::IDENTITY, DVec3::ZERO)]);
    let steps = effort.pick(5, 41);
    let places = (0..steps).map(|i| 0.999 * (f64::from(i) / f64::from(steps - 1) * 2.0 - 1.0));
    let mut rays = Vec::new();
    for x in places.clone() {
        for y in places.clone() {
            for zero in [0.0, -0.0] {
                for d in [
                    DVec3::new(zero, zero, 1.0),
                    DVec3::new(zero, 1.0, zero),
                    DVec3::new(-1.0, zero, zero),
                    DVec3::new(-1.0, 1.0, zero),
                ] {
                    rays.push(ray(DVec3::new(x, y, 0.25), d));
                }
            }
        }
    }
    let mut tally = Tally::default();
    tally.trace(&accelerators(&geometry), &rays);
    tally.report(Outcome::new(), "")
}
