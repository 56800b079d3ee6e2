use std::f64::consts::TAU;

use pulp::x86::{V3, V4};
use pulp::{Scalar, Simd, WithSimd};

use super::traverse::{Closest, LeftOut, Occluded};
use super::*;
use crate::accel::LinearAccel;
use crate::accel::tree::testing::{Sequence, mesh_geometry};
use crate::geometry::{Analytic, Disk, Frustum, Mesh, Quad, Sphere, TransformedShape, TrianglePoints};
use crate::id::ShapeId;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DAffine3, DVec3, Transform, Vec3};

/// A cube of corners at ±1, of two triangles a side, with the inner edges and the first corners anywhere.
fn cube(turns: usize) -> Vec<TrianglePoints> {
    let mut triangles = Vec::new();
    for side in 0..6 {
        let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        let at = |s: f32, t: f32| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, s, t);
            Vec3::from_array(p)
        };
        let mut corners = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        corners.rotate_left(side % 4);
        let [a, b, c, d] = corners;
        let mut pair = [[a, b, c], [a, c, d]];
        pair[0].rotate_left((side + turns) % 3);
        pair[1].rotate_left((side + 2 * turns) % 3);
        triangles.extend(pair.map(|[a, b, c]| TrianglePoints { a, b, c }));
    }
    triangles
}

fn soup(random: &mut Sequence, count: usize) -> Vec<TrianglePoints> {
    let mut corner = || {
        let p = random.vec();
        // On a coarse grid now and then, so that edges and corners are met exactly.
        if random.below(2) == 0 { (p * 4.0).round() * 0.25 } else { p }
    };
    (0..count).map(|_| TrianglePoints { a: corner(), b: corner(), c: corner() }).collect()
}

fn geometries(random: &mut Sequence) -> Vec<Geometry> {
    let mut all: Vec<Geometry> = (0..3).map(|turns| mesh_geometry(&cube(turns))).collect();
    all.extend([1, 7, 60].map(|count| mesh_geometry(&soup(random, count))));
    let mut mixed = mesh_geometry(&cube(1));
    let sphere = |radius: f64| Analytic::Sphere(Sphere::new(radius, -radius, radius, TAU).unwrap());
    let disk = |radius: f64, hole: f64| Analytic::Disk(Disk::new(radius, hole, TAU).unwrap());
    let quad = Quad::new(DVec3::new(-0.4, -0.3, 0.1), DVec3::X * 0.8, DVec3::new(0.1, 0.6, 0.2)).unwrap();
    let shapes = [
        sphere(0.5),
        disk(0.7, 0.0),
        sphere(0.2),
        sphere(0.1),
        Analytic::Quad(quad),
        disk(0.4, 0.2),
        Analytic::Frustum(Frustum::cylinder(0.2, 0.6, TAU).unwrap()),
        Analytic::Frustum(Frustum::new(0.3, 0.0, 0.5, 4.0).unwrap()),
    ];
    for (i, shape) in shapes.into_iter().enumerate() {
        // Some of them pass through each other, and the last touch.
        let place = DAffine3::from_translation(DVec3::new(0.3 * (i % 4) as f64 - 0.5, 0.2, 0.4 - 0.3 * (i % 4) as f64));
        mixed.world.push(ShapeId::new(mixed.shapes.len()));
        mixed.shapes.push(Shape::Analytic(TransformedShape::new(shape, Transform::new(place).unwrap())));
    }
    all.push(mixed);
    all
}

/// Rays of all kinds, among them some at corners and along edges, some that are traced alone, and some that are not
/// valid.
fn rays(random: &mut Sequence, geometry: &Geometry) -> Vec<Ray> {
    let corners: Vec<Vec3> = match &geometry.shapes[0] {
        Shape::Mesh(mesh) => mesh.positions().iter().map(|&p| Vec3::from_array(p)).collect(),
        _ => Vec::new(),
    };
    let mut ray = || {
        let corner = corners[random.below(corners.len())];
        let origin = match random.below(8) {
            0 => corner,
            1 => random.vec() * 1e4,
            2 => Vec3::ZERO,
            _ => random.vec() * 2.0,
        };
        let direction = match random.below(8) {
            0 => [Vec3::X, -Vec3::Y, Vec3::new(0.0, -0.0, 1.0), Vec3::new(1.0, 1e-38, 1e-42)][random.below(4)],
            1 => corner - origin,
            2 => 0.5 * (corner + corners[random.below(corners.len())]) - origin,
            3 => random.vec() * 1e-12,
            _ => random.vec(),
        };
        let t_max = if random.below(3) == 0 { random.next().abs() * 3.0 } else { f32::INFINITY };
        let time = if random.below(50) == 0 { f32::NAN } else { 0.5 };
        Ray {
            t_max,
            t_min: if random.below(3) == 0 { t_max.min(0.3) } else { 0.0 },
            time,
            ..Ray::new(origin, direction)
        }
    };
    (0..if cfg!(miri) { 40 } else { 20_000 }).map(|_| ray()).collect()
}

#[test]
fn packets_hit_what_the_oracle_hits() {
    let mut random = Sequence(1);
    for (number, geometry) in geometries(&mut random).iter().enumerate() {
        let rays = rays(&mut random, geometry);
        let (packets, oracle) = (PacketBvh::new(geometry, 1), LinearAccel::new(geometry));
        assert!(packets.packets.is_some(), "{number}");
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![true; rays.len()]);
        packets.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
        packets.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
        let mut found = 0;
        for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(&occluded) {
            let expected = oracle.intersect(ray);
            assert_eq!(expected.is_some(), *occluded, "{number}: {ray:?} {hit:?} {expected:?}");
            let (Some(hit), Some(expected)) = (hit, expected) else {
                assert_eq!(*hit, expected, "{number}: {ray:?}");
                continue;
            };
            found += 1;
            // Distances along the normal are found within a few roundings of those from the origin to a corner.
            let reach = f64::from((ray.origin.abs().max_element() + 2.0) * if hit.shape.0 > 0 { 1.0 } else { 1e3 });
            let off = f64::from((hit.t - expected.t).abs() * ray.direction.length());
            assert!(off <= 8.0 * UNIT_ROUNDOFF * reach, "{number}: {ray:?} {hit:?} {expected:?} {off}");
            if hit.prim == expected.prim && hit.shape == expected.shape {
                assert!(
                    (hit.u - expected.u).abs() < 1e-3 && (hit.v - expected.v).abs() < 1e-3,
                    "{number}: {ray:?} {hit:?} {expected:?}"
                );
            }
        }
        assert!(found > rays.len() / 50, "{number}: {found}");
    }
}

/// The hits of packets for a block of rays.
fn answers<S: Simd>(simd: S, packets: &Hierarchy<'_>, rays: &[Ray]) -> (Vec<Option<Hit>>, Vec<bool>) {
    let (rows, count) = (RayRows::of(rays), rays.len());
    let (mut hits, mut occluded) = (HitRows::default(), [false; BATCH]);
    let (ends, left_out) = (&mut [0.0; BATCH], &mut LeftOut::new());
    let HitRows { t, shape: prims, .. } = &mut hits;
    Closest::<false> { hierarchy: packets, rays: &rows, count, t, prims, ends, left_out }.with_simd(simd);
    packets.complete_all(&rows, count, &mut hits);
    Occluded { hierarchy: packets, rays: &rows, count, occluded: &mut occluded, alone: |_: &Ray| false }
        .with_simd(simd);
    ((0..count).map(|lane| hits.get(lane)).collect(), occluded[..count].to_vec())
}

#[test]
#[cfg_attr(any(miri, not(avx512)), ignore = "needs AVX-512")]
fn every_instruction_set_gives_the_same_bits() {
    let mut random = Sequence(2);
    for geometry in geometries(&mut random) {
        let packets = of_world(&geometry).unwrap();
        for rays in rays(&mut random, &geometry)[..2_000].chunks(100) {
            let alone = answers(Scalar::new(), &packets, rays);
            assert_eq!(answers(V3::try_new().unwrap(), &packets, rays), alone);
            assert_eq!(answers(V4::try_new().unwrap(), &packets, rays), alone);
        }
    }
}

#[test]
fn few_primitives_at_rest_suit_packets() {
    assert!(PacketBvh::suits(&mesh_geometry(&cube(0))));
    assert!(!PacketBvh::suits(&Geometry::default()));
    let mut random = Sequence(3);
    assert!(
        PacketBvh::suits(&mesh_geometry(&soup(&mut random, FEW)))
            && !PacketBvh::suits(&mesh_geometry(&soup(&mut random, FEW + 1)))
    );
    // Flat pairs count once.
    let many: Vec<_> = std::iter::repeat_n(cube(0), FEW / 6).flatten().collect();
    assert!(many.len() > FEW && PacketBvh::suits(&mesh_geometry(&many)));
    let balls = |count: usize, radius: f64| {
        let ball = Analytic::Sphere(Sphere::new(radius, -radius, radius, TAU).unwrap());
        let at = |i: usize| Transform::new(DAffine3::from_translation(DVec3::X * i as f64)).unwrap();
        let shapes = (0..count).map(|i| Shape::Analytic(TransformedShape::new(ball.clone(), at(i)))).collect();
        Geometry { shapes, world: (0..count).map(ShapeId::new).collect(), ..Geometry::default() }
    };
    assert!(PacketBvh::suits(&balls(MANY_QUADRICS, 0.3)) && !PacketBvh::suits(&balls(MANY_QUADRICS + 1, 0.3)));
    let Shape::Mesh(mesh) = mesh_geometry(&cube(0)).shapes.remove(0) else { panic!("a mesh") };
    let step = crate::geometry::MeshStep { positions: mesh.positions().to_vec(), normals: None };
    let moving: Mesh = mesh.deforming(vec![step]).unwrap();
    let geometry = Geometry { shapes: vec![Shape::Mesh(moving)], world: vec![ShapeId(0)], ..Geometry::default() };
    assert!(!PacketBvh::suits(&geometry) && PacketBvh::new(&geometry, 1).packets.is_none());
}
