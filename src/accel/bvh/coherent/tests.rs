use pulp::x86::{V3, V4};

use super::*;
use crate::accel::bvh::tests::{corner, mesh, soup};
use crate::accel::bvh::{Bvh, BvhOptions, PacketRun};
use crate::accel::tree::TwoLevel;
use crate::accel::tree::testing::Sequence;
use crate::accel::{Accelerator, Coherence, HitRows};
use crate::geometry::{Analytic, Geometry, Shape, Sphere, TransformedShape};
use crate::id::{PrimId, ShapeId};
use crate::math::{Ray, Transform};

#[test]
fn packets_are_traced_while_they_are_faster_and_measured_again_when_not() {
    let mut occupancy = Occupancy::default();
    let mut trace = |entering: u32, batches: usize| {
        let chosen = (0..batches).filter(|_| {
            let is_chosen = occupancy.next();
            if is_chosen {
                occupancy.add(1_600, entering);
            }
            is_chosen
        });
        chosen.count()
    };
    assert_eq!(trace(600, 160), 160);
    assert!((10..=20).contains(&trace(300, 160)));
    assert!(trace(600, 1_600) > 1_500);
}

const TRIANGLES: usize = 3_000;

/// Rays from about one point through about one point, by `spread`, or through points of an edge of the scene.
fn coherent_rays(random: &mut Sequence, spread: f32, geometry: &Geometry, size: f32) -> Vec<Ray> {
    let Shape::Mesh(soup) = &geometry.shapes[0] else { panic!("no mesh") };
    let edge = soup.triangle_points(PrimId::new(random.below(TRIANGLES)));
    let (origin, target) = (corner(random) * 2.0 * size, corner(random) * size);
    let (has_lens, is_at_edge) = (random.below(2) == 0, random.below(2) == 0);
    (0..BATCH)
        .map(|_| {
            let from = if has_lens { origin + random.vec() * spread * size } else { origin };
            let through = match is_at_edge {
                true => edge.a.lerp(edge.b, random.next()),
                false => target + random.vec() * spread * size,
            };
            let t_max = if random.below(40) == 0 { random.next().abs() * 2.0 } else { f32::INFINITY };
            Ray { t_max, ..Ray::new(from, through - from) }
        })
        .collect()
}

/// The triangles of a soup, and a sphere.
fn scene(random: &mut Sequence, size: f32) -> Geometry {
    let soup = soup(random, TRIANGLES);
    let Shape::Mesh(soup) = &soup.shapes[0] else { panic!("no mesh") };
    let triangles: Vec<_> = (0..TRIANGLES)
        .map(|i| soup.triangle_points(PrimId::new(i)))
        .map(|points| [points.a, points.b, points.c].map(|p| p * size))
        .collect();
    let mut geometry = mesh(&triangles);
    let radius = 0.3 * f64::from(size);
    let sphere = Analytic::Sphere(Sphere::new(radius, -radius, radius, std::f64::consts::TAU).unwrap());
    geometry.world.push(ShapeId(1));
    geometry.shapes.push(Shape::Analytic(TransformedShape::new(sphere, Transform::IDENTITY)));
    geometry
}

/// Hits of rays that were traced in packets, with each instruction set, and which these are.
fn trace_packets(accel: &TwoLevel<'_, Bvh>, rays: &RayRows) -> Vec<(HitRows, Row<u32>)> {
    let (wide, v3) = (accel.world().as_wide().unwrap(), V3::try_new().unwrap());
    let batch = &Batch { accel, rays, count: BATCH, end_shapes: None };
    let mut traced = Vec::new();
    for v4 in [None, V4::try_new()] {
        let (scratch, answers) = (&mut *Box::<Scratch>::default(), &mut HitRows::default());
        scratch.prepare(wide, batch, answers);
        match v4 {
            Some(v4) => v4.vectorize(PacketRun { simd: v4, wide, batch, scratch, answers }),
            None => v3.vectorize(PacketRun { simd: v3, wide, batch, scratch, answers }),
        }
        traced.push((answers.clone(), scratch.prepared.is_valid.map(|is_valid| 1 - is_valid)));
    }
    traced
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn packets_have_the_answers_of_single_rays() {
    let mut random = Sequence(17);
    for size in [1.0, 1e-15, 1e15] {
        let geometry = scene(&mut random, size);
        let accel = TwoLevel::<Bvh>::new(&geometry, &BvhOptions::default(), 1);
        let mut in_packets = [0; 2];
        for i in 0..800 {
            let rays = coherent_rays(&mut random, [0.3, 0.03, 0.003, 0.0][i % 4], &geometry, size);
            let rows = RayRows::of(&rays);
            let mut found = HitRows::default();
            accel.intersect_rows(&rows, BATCH, &mut found, Coherence::Coherent);
            let traced = trace_packets(&accel, &rows);
            for (lane, ray) in rays.iter().enumerate() {
                let hit = accel.intersect(ray);
                assert_eq!(found.get(lane), hit, "{ray:?}");
                for (found, _) in traced.iter().filter(|(_, is_traced)| is_traced[lane] != 0) {
                    assert_eq!(found.get(lane), hit, "{ray:?}");
                    in_packets[usize::from(hit.is_some())] += 1;
                }
            }
        }
        assert!(in_packets.iter().all(|&count| count > 10_000), "{size} {in_packets:?}");
    }
}
