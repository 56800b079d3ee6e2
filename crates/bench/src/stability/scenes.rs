//! Scenes, rays at them, every kind of query, and when two hits are the same: for checks that compare accelerators.

use super::geometry::{
    Rng, cube, grid, instances, meshes, placed_analytic_shapes, ray, ray_through, reach, soup, sphere_mesh, transform,
    world,
};
use crate::accel::inspect::Inspect;
use crate::accel::{self, AccelKind, Accelerator, Coherence, EmbreeInfo};
use crate::bumpy_sphere;
use crate::geometry::{
    CurveBasis, CurveKind, Curves, Geometry, Hit, Instance, Mesh, MeshStep, Object, Points, Shape, Strands,
};
use crate::id::{ObjectId, ShapeId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{Aabb, DAffine3, DMat3, DVec3, Motion, Ray, Transform};

/// Checks build over their own geometry, which every accelerator takes.
const BUILDS: &str = "accelerators build over the geometry of checks";

/// An accelerator with one thread.
pub fn build(kind: AccelKind, geometry: &Geometry) -> Box<dyn Accelerator + '_> {
    accel::build(kind, geometry, 1).expect(BUILDS)
}

/// Accelerators of this crate with their names.
pub fn own(geometry: &Geometry) -> Vec<(&'static str, Box<dyn Accelerator + '_>)> {
    ["bvh", "bvh:binary", "kdtree", "kdtree:median", "octree"]
        .map(|name| (name, build(name.parse().expect(BUILDS), geometry)))
        .into()
}

/// [`own`], Embree, and packets.
pub fn all(geometry: &Geometry) -> Vec<(&'static str, Box<dyn Accelerator + '_>)> {
    let mut accels = own(geometry);
    accels.push(("embree", build(AccelKind::EMBREE, geometry)));
    accels.push(("packets", packets(geometry)));
    accels
}

/// Why bounds on Embree's distances are weaker on some processors.
pub const INEXACT_RECIPROCALS: &str = "on a processor without AVX-512, Embree divides by refined estimates of \
                                       reciprocals: distances to triangles may be 2^-22 off";

/// The relative error of an accelerator's distances to triangles, from [`all`].
pub fn distance_error(name: &str) -> f32 {
    if name == "embree" { EmbreeInfo::query().map_or(0.0, |info| info.reciprocal_error()) } else { 0.0 }
}

/// An accelerator whose answers to single rays are those to batches of one.
pub struct BatchesOfOne<'g>(pub Box<dyn Accelerator + 'g>);

impl Accelerator for BatchesOfOne<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut hits = [None];
        self.0.intersect_batch(&[*ray], &mut hits, Coherence::Incoherent);
        hits[0]
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut occluded = [false];
        self.0.occluded_batch(&[*ray], &mut occluded, Coherence::Incoherent);
        occluded[0]
    }

    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.0.memory_bytes()
    }

    fn description(&self) -> String {
        self.0.description()
    }

    fn inspect(&self) -> Option<&dyn Inspect> {
        self.0.inspect()
    }
}

/// Packets of rays, also for single ones.
pub fn packets(geometry: &Geometry) -> Box<dyn Accelerator + '_> {
    Box::new(BatchesOfOne(build(AccelKind::Packets, geometry)))
}

/// Embree with packets for analytic shapes, also for single rays.
pub fn hybrid(geometry: &Geometry) -> Box<dyn Accelerator + '_> {
    Box::new(BatchesOfOne(build(AccelKind::HYBRID, geometry)))
}

/// The BVH with packets for analytic shapes, floors and walls, also for single rays.
pub fn hybrid_bvh(geometry: &Geometry) -> Box<dyn Accelerator + '_> {
    Box::new(BatchesOfOne(build(AccelKind::HYBRID_BVH, geometry)))
}

/// What every entry point answers to these rays: single, in coherent batches and in incoherent ones.
pub fn all_answers(accel: &dyn Accelerator, rays: &[Ray]) -> Vec<(Vec<Option<Hit>>, Vec<bool>)> {
    let mut answers =
        vec![(rays.iter().map(|r| accel.intersect(r)).collect(), rays.iter().map(|r| accel.occluded(r)).collect())];
    for coherence in [Coherence::Coherent, Coherence::Incoherent] {
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        accel.intersect_batch(rays, &mut hits, coherence);
        accel.occluded_batch(rays, &mut occluded, coherence);
        answers.push((hits, occluded));
    }
    answers
}

/// An object that shares a shape with the world, and ids that do not start at zero.
fn mixed(rng: &mut Rng, placements: &[Transform]) -> Geometry {
    let soups = [0.3, 0.3, 0.2].map(|size| Shape::Mesh(soup(rng, 50, size)));
    let mut mixed = instances(soups.into(), placements);
    mixed.objects[0].shapes.remove(0);
    mixed.world = vec![ShapeId(0), ShapeId(2)];
    mixed
}

/// Scenes with their names, all of them at rest.
pub fn scenes() -> Vec<(&'static str, Geometry)> {
    let mut rng = Rng::new(11);
    let far = DVec3::new(5e3, -2e3, 1e4);
    let turned = |rng: &mut Rng, scale: f64| transform(rng.rotation() * scale, 2.0 * rng.cube());
    let placements: Vec<_> = (0..12).map(|i| turned(&mut rng, 0.2 + 0.1 * f64::from(i))).collect();
    let mut scenes = vec![
        ("soup", meshes(vec![soup(&mut rng, 400, 0.2)])),
        ("small soup", meshes(vec![soup(&mut rng, 1000, 0.02)])),
        ("two soups", meshes(vec![soup(&mut rng, 200, 0.3), soup(&mut rng, 200, 0.1)])),
        ("sphere", meshes(vec![sphere_mesh(DVec3::ZERO, 1.0, 32, 16)])),
        ("far sphere", meshes(vec![sphere_mesh(far, 1.0, 32, 16)])),
        (
            "stairs",
            meshes((0..8).map(|i| cube(DMat3::IDENTITY * 0.125, DVec3::splat(-0.875 + 0.25 * f64::from(i)))).collect()),
        ),
        ("one triangle", meshes(vec![soup(&mut rng, 1, 1.0)])),
        (
            "hills",
            meshes(vec![grid(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 20, |s, t| {
                0.2 * (9.0 * s).sin() * (7.0 * t).cos()
            })]),
        ),
        (
            "slivers",
            meshes(vec![grid(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, DVec3::new(0.3, 0.02, 0.5), 16, |s, t| {
                0.1 * s * t
            })]),
        ),
        (
            "instances",
            instances(
                vec![Shape::Mesh(soup(&mut rng, 30, 0.4)), Shape::Mesh(cube(DMat3::IDENTITY * 0.5, DVec3::ZERO))],
                &placements,
            ),
        ),
    ];
    scenes.push(("mixed", mixed(&mut rng, &placements[..3])));
    let analytic = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    scenes.push(("analytic", world(analytic.clone())));
    scenes.push(("far analytic", world(placed_analytic_shapes(&mut rng, far))));
    scenes.push(("analytic instances", instances(analytic, &placements[..4])));
    scenes.push(("nothing", Geometry::default()));
    scenes.push(("bumpy sphere", meshes(vec![bumpy_sphere(1_000)])));
    scenes.push(("tiny sphere", meshes(vec![sphere_mesh(DVec3::ZERO, 1e-6, 32, 16)])));
    // Every hit is a tie.
    let twice = || {
        Shape::Mesh(grid(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 8, |s, t| {
            0.3 * (7.0 * s * t).sin()
        }))
    };
    scenes.push(("overlapping", world(vec![twice(), twice()])));
    scenes.push(("curves", world(curves_of_all_kinds(&mut rng))));
    scenes.push(("points", world(vec![points(&mut rng, 300), Shape::Mesh(soup(&mut rng, 50, 0.3))])));
    scenes
}

/// Strands of every basis and kind.
fn curves_of_all_kinds(rng: &mut Rng) -> Vec<Shape> {
    let all = [
        (CurveBasis::BSpline, CurveKind::Round),
        (CurveBasis::Linear, CurveKind::Round),
        (CurveBasis::Bezier, CurveKind::Flat),
        (CurveBasis::CatmullRom, CurveKind::Cylinder),
    ];
    all.iter().map(|&(basis, kind)| curves(rng, 40, basis, kind)).collect()
}

/// Strands of seven control points each.
fn curves(rng: &mut Rng, count: usize, basis: CurveBasis, kind: CurveKind) -> Shape {
    const POINTS: usize = 7;
    let mut strands = Strands { points: Vec::new(), counts: vec![POINTS as u32; count] };
    for _ in 0..count {
        let (mut p, radius) = (0.8 * rng.cube(), rng.range(0.005, 0.03));
        for i in 0..POINTS {
            p += 0.15 * rng.cube();
            strands.points.push([p.x as f32, p.y as f32, p.z as f32, (radius * (1.0 - 0.1 * i as f64)) as f32]);
        }
    }
    Shape::Curves(Box::new(Curves::new(strands, basis, kind).expect("the strands are valid")))
}

/// Spheres of many sizes, some within others.
fn points(rng: &mut Rng, count: usize) -> Shape {
    let point = |rng: &mut Rng| {
        let [x, y, z] = rng.cube().to_array().map(|x| x as f32);
        [x, y, z, rng.magnitude(-3.0, -0.5) as f32]
    };
    Shape::Points(Box::new(Points::new((0..count).map(|_| point(rng)).collect()).expect("the points are valid")))
}

fn place(rng: &mut Rng, reach: f64) -> DAffine3 {
    DAffine3 { matrix3: rng.rotation() * rng.range(0.5, 1.2), translation: reach * rng.cube() }
}

/// Through three places, or such a way carried along another.
pub fn motion(rng: &mut Rng) -> Motion {
    let mut keyframed = || {
        Motion::keyframed(&[(0.0, place(rng, 1.5)), (0.4, place(rng, 1.5)), (1.0, place(rng, 1.5))])
            .expect("maps without mirroring")
    };
    let (outer, inner) = (keyframed(), keyframed());
    if rng.unit() < 0.5 { outer.after(&inner) } else { outer }
}

/// A mesh whose vertices move along a path of three corners.
pub fn deforming(rng: &mut Rng, triangles: usize) -> Mesh {
    let start = soup(rng, triangles, 0.4);
    let mut step = || MeshStep {
        positions: start
            .positions()
            .iter()
            .map(|p| (DVec3::from(p.map(f64::from)) + 0.5 * rng.cube()).as_vec3().to_array())
            .collect(),
        normals: None,
    };
    let later = vec![step(), step()];
    start.deforming(later).expect("as many vertices at each time")
}

/// Analytic shapes and triangles that move as instances, one instance and one mesh at rest, and a mesh that deforms.
pub fn moving_scene(rng: &mut Rng) -> Geometry {
    let mut shapes = placed_analytic_shapes(rng, DVec3::ZERO);
    shapes.push(Shape::Mesh(soup(rng, 60, 0.5)));
    shapes.push(Shape::Mesh(cube(DMat3::IDENTITY * 0.5, DVec3::ZERO)));
    let moving = shapes.len();
    shapes.push(Shape::Mesh(soup(rng, 60, 0.4)));
    shapes.push(Shape::Mesh(deforming(rng, 80)));
    let objects = (0..moving).map(|i| Object { shapes: vec![ShapeId::new(i)] }).collect();
    let mut instances: Vec<_> = (0..moving).filter_map(|i| Instance::moving(ObjectId::new(i), motion(rng))).collect();
    instances.extend(Instance::moving(ObjectId(0), Motion::constant(place(rng, 1.5))));
    Geometry {
        shapes,
        world: vec![ShapeId::new(moving), ShapeId::new(moving + 1)],
        objects,
        instances,
        ..Geometry::default()
    }
}

/// Rays of each kind that a path tracer sends: from a camera, onwards from what those hit, and from there to a point.
pub fn path_rays(geometry: &Geometry, rng: &mut Rng, count: usize) -> [Vec<Ray>; 3] {
    let resolution = ((count as f64).sqrt() as usize).next_multiple_of(4);
    let mut camera = camera_rays(geometry, resolution);
    camera.truncate(count);
    let oracle = build(AccelKind::ALL[1].0, geometry);
    let bounds = geometry.bounds();
    let light = if bounds.is_empty() { DVec3::ZERO } else { bounds.max.as_dvec3() + bounds.size().as_dvec3() };
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for i in 0..4 * count {
        if bounce.len() == count {
            break;
        }
        let start = if i < camera.len() { camera[i] } else { test_rays(rng, geometry, 1)[0] };
        let Some(si) = oracle.intersect(&start).and_then(|hit| geometry.interaction(&start, &hit)) else { continue };
        bounce.push(si.spawn(rng.direction().as_vec3()));
        shadow.push(si.spawn((light - si.p).as_vec3()));
    }
    [camera, bounce, shadow]
}

/// These rays at times of all kinds: both ends, a keyframe, and any.
pub fn at_times(rng: &mut Rng, mut rays: Vec<Ray>) -> Vec<Ray> {
    for (i, ray) in rays.iter_mut().enumerate() {
        ray.time = [0.0, 0.4, 0.5, 1.0, rng.unit_f32()][i % 5];
    }
    rays
}

/// Random, axis-parallel and grazing rays at a scene, with unit and other directions.
pub fn test_rays(rng: &mut Rng, geometry: &Geometry, count: usize) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let (center, half) = if bounds.is_empty() {
        (DVec3::ZERO, DVec3::ONE)
    } else {
        (bounds.center().as_dvec3(), 0.5 * bounds.size().as_dvec3())
    };
    let size = half.max_element();
    let mut next = |i: usize| {
        let inside = center + half * rng.cube();
        match i % 4 {
            0 => ray(inside, rng.direction()),
            1 => ray_through(center + rng.direction() * size * 4.0, inside),
            2 => {
                // One or two zero components, with either sign.
                let axis = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, -0.8, 0.0), DVec3::new(-0.0, 0.6, 0.8)]
                    [rng.below(5)];
                let axis = if rng.unit() < 0.5 { -axis } else { axis };
                ray(inside - axis * 3.0 * size, axis)
            }
            _ => {
                // Along a face of the bounds, nearly.
                let face = DVec3::new(inside.x, inside.y, center.z + half.z * (1.0 + 1e-4 * rng.range(-1.0, 1.0)));
                let d = rng.direction() * DVec3::new(1.0, 1.0, 1e-3);
                ray(face - d * 3.0 * size, d)
            }
        }
    };
    (0..count).map(&mut next).collect()
}

/// Camera rays: blocks of 4 by 4 pixels in order.
pub fn camera_rays(geometry: &Geometry, resolution: usize) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let (center, size) = if bounds.is_empty() {
        (DVec3::ZERO, 1.0)
    } else {
        (bounds.center().as_dvec3(), f64::from(bounds.size().max_element()))
    };
    let eye = center + DVec3::new(0.9, 1.1, 0.8) * size;
    let (right, up) = (DVec3::new(-0.77, 0.63, 0.0), DVec3::new(-0.31, -0.38, 0.87));
    let blocks = (resolution / 4).pow(2);
    let pixel = |i: usize| {
        let (block, within) = (i / 16, i % 16);
        let x = (block % (resolution / 4)) * 4 + within % 4;
        let y = (block / (resolution / 4)) * 4 + within / 4;
        let at = |p: usize| (p as f64 + 0.5) / resolution as f64 - 0.5;
        ray_through(eye, center + (right * at(x) + up * at(y)) * size * 1.5)
    };
    (0..blocks * 16).map(pixel).collect()
}

/// Whether two hits of `ray` are the same within rounding: 8 ulp of t, and over the cosine with the surface 4 roundoffs
/// of the reach and the error with which an accelerator may see the surface (in the space of an instance rays are
/// rounded again).
pub fn same(geometry: &Geometry, ray: &Ray, a: &Hit, b: &Hit) -> bool {
    let length = f64::from(ray.direction.length());
    let slack = |hit: &Hit| {
        let seen = geometry
            .interaction(ray, hit)
            .map(|si| (f64::from(si.n_g.dot(ray.direction).abs()) / length, f64::from(si.error)));
        let (cosine, error) = seen.unwrap_or((1.0, 0.0));
        let off_plane = 4.0 * UNIT_ROUNDOFF * reach(geometry, ray, hit) + error;
        16.0 * UNIT_ROUNDOFF * f64::from(hit.t) + off_plane / (length * cosine.max(1e-6))
    };
    (f64::from(a.t) - f64::from(b.t)).abs() <= slack(a) + slack(b)
}
