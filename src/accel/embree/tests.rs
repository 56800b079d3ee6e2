//! Curves that Embree intersects itself, against the intersector of all other accelerators.

use super::*;
use crate::accel::LinearAccel;
use crate::geometry::{CurveBasis, CurveKind, Curves, Shape, Strands};
use crate::math::{DVec3, Rng, Vec3};

fn geometry(strands: Strands, basis: CurveBasis) -> Geometry {
    let curves = Curves::new(strands, basis, CurveKind::Round).unwrap();
    Geometry { shapes: vec![Shape::Curves(Box::new(curves))], world: vec![ShapeId(0)], ..Geometry::default() }
}

/// Bent strands around the origin, of which the radii halve from end to end.
fn tuft(basis: CurveBasis, radius: f32) -> Strands {
    let mut rng = Rng::new(1);
    let count = if basis == CurveBasis::Bezier { 4 } else { 6 };
    let mut strands = Strands::default();
    for _ in 0..60 {
        let (root, along, bend) = (rng.cube() * 0.5, rng.cube().normalize(), rng.cube() * 0.3);
        for i in 0..count {
            let s = f64::from(i) / f64::from(count - 1);
            let p = (root + along * s + bend * (s * s)).as_vec3();
            strands.points.push([p.x, p.y, p.z, radius * (1.0 - 0.5 * s as f32)]);
        }
        strands.counts.push(count as u32);
    }
    strands
}

fn is_native(accel: &EmbreeAccel) -> bool {
    accel.registered().user_geometries == 0
}

const BASES: [CurveBasis; 3] = [CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom];

#[test]
fn curves_of_embree_are_those_of_all_accelerators() {
    let mut rng = Rng::new(2);
    let (mut hits, mut different, mut rays) = (0, 0, 0);
    for basis in BASES {
        for radius in [0.001, 0.01, 0.04] {
            let geometry = geometry(tuft(basis, radius), basis);
            let (embree, oracle) = (EmbreeAccel::new(&geometry, 1).unwrap(), LinearAccel::new(&geometry));
            assert!(is_native(&embree), "{basis:?} {radius}");
            let mut trace = |ray: &Ray| {
                let (found, expected) = (embree.intersect(ray), oracle.intersect(ray));
                rays += 1;
                hits += usize::from(expected.is_some());
                let points = [found, expected].map(|hit| geometry.interaction(ray, &hit?));
                let is_same = match &points {
                    [None, None] => true,
                    [Some(a), Some(b)] => (a.p - b.p).length() < 1e-4 * f64::from(radius),
                    _ => false,
                };
                different += usize::from(!is_same || embree.occluded(ray) != expected.is_some());
                points[0]
            };
            for _ in 0..3_000 {
                let (target, origin) = (rng.cube(), rng.cube().normalize() * rng.range(2.0, 20.0));
                let ray = Ray::new(origin.as_vec3(), ((target - origin) * rng.range(0.1, 10.0)).as_vec3());
                // Those that leave a curve outward, inward, and along it.
                let Some(at) = trace(&ray) else { continue };
                for direction in [rng.cube(), -at.n_g.as_dvec3() + 0.5 * rng.cube(), at.dp_du.as_dvec3() + rng.cube()] {
                    trace(&at.spawn(direction.normalize().as_vec3()));
                }
            }
        }
    }
    // The radius differs by up to (slope)^2 / 2: silhouettes.
    assert!(hits > 5_000 && different * 500 < rays, "{different} of {rays}, {hits} hits");
}

#[test]
fn rays_leave_straight_curves_of_embree() {
    let mut rng = Rng::new(3);
    let points: Vec<[f32; 4]> = (0..8).map(|i| [0.3 * i as f32, 0.01 * i as f32, 7.0, 0.02]).collect();
    let strands = Strands { points, counts: vec![8] };
    let geometry = geometry(strands, CurveBasis::BSpline);
    let embree = EmbreeAccel::new(&geometry, 1).unwrap();
    assert!(is_native(&embree));
    let mut started = 0;
    for _ in 0..3_000 {
        let target = DVec3::new(rng.range(0.3, 1.8), 0.03, 7.0) + 0.02 * rng.cube();
        let origin = target + 3.0 * rng.cube().normalize();
        let ray = Ray::new(origin.as_vec3(), (target - origin).as_vec3());
        let Some(at) = embree.intersect(&ray).and_then(|hit| geometry.interaction(&ray, &hit)) else { continue };
        for _ in 0..8 {
            let leaving = at.spawn(rng.cube().normalize().as_vec3());
            assert!(embree.intersect(&leaving).is_none() && !embree.occluded(&leaving), "{leaving:?} {at:?}");
            started += 1;
        }
    }
    assert!(started > 5_000, "{started}");
}

#[test]
fn curves_that_embree_would_make_differently_are_intersected_here() {
    let point = |x: f32, r: f32| [x, 0.0, 0.0, r];
    let strand = |points: Vec<[f32; 4]>, basis| {
        let counts = vec![points.len() as u32];
        geometry(Strands { points, counts }, basis)
    };
    let slender: Vec<_> = (0..7).map(|i| point(i as f32, 0.1)).collect();
    let cases = [
        (strand(slender.clone(), CurveBasis::BSpline), true),
        (strand(slender[..4].to_vec(), CurveBasis::Bezier), true),
        (strand(slender.clone(), CurveBasis::Linear), false),
        // With joints, where spheres may show.
        (strand(slender.clone(), CurveBasis::Bezier), false),
        (strand((0..4).map(|i| point(i as f32, 0.2 * i as f32)).collect(), CurveBasis::BSpline), false),
        (strand(vec![point(1.0, 0.1); 4], CurveBasis::BSpline), false),
        (strand((0..4).map(|i| point(i as f32, 0.0)).collect(), CurveBasis::BSpline), false),
        (strand((0..4).map(|i| point(i as f32 * 1e-20, 1e-22)).collect(), CurveBasis::BSpline), false),
        (strand((0..4).map(|i| point(i as f32 * 1e12, 1e10)).collect(), CurveBasis::BSpline), false),
    ];
    for (i, (geometry, expected)) in cases.iter().enumerate() {
        let embree = EmbreeAccel::new(geometry, 1).unwrap();
        assert_eq!(is_native(&embree), *expected, "{i}");
        let scale = geometry.shape(ShapeId(0)).bounds().size().x;
        let from = Vec3::new(0.4 * scale, 0.0, 3.0 * scale);
        let _ = embree.intersect(&Ray::new(from, -Vec3::Z));
    }
}

#[test]
fn extreme_curves_do_not_stop_embree() {
    let mut rng = Rng::new(4);
    let mut native = 0;
    for round in 0..300 {
        let basis = BASES[round % 3];
        let scale = 10f64.powf(rng.range(-7.0, 7.0));
        let radius = scale * 10f64.powf(rng.range(-5.0, -1.0));
        // Among a hundred straight ones, a strand whose points may coincide, turn back, and have no radius.
        let mut strands = Strands::default();
        for i in 0..101 {
            let (step, bend) = (rng.direction(), if i == 100 { 10f64.powf(rng.range(-8.0, 0.5)) } else { 0.01 });
            let step = if i == 100 && round % 2 == 0 { DVec3::ZERO } else { step };
            for k in 0..4 {
                let p = (step * f64::from(k) + rng.cube() * bend * f64::from(rng.below(2) as u8)) * scale;
                let r = if i == 100 { radius * rng.below(3) as f64 } else { radius };
                strands.points.push([p.x as f32, p.y as f32, p.z as f32, r as f32]);
            }
            strands.counts.push(4);
        }
        let geometry = geometry(strands, basis);
        let embree = EmbreeAccel::new(&geometry, 1).unwrap();
        native += usize::from(is_native(&embree));
        for _ in 0..100 {
            let origin = rng.cube() * scale * 10f64.powf(rng.range(-3.0, 3.0));
            let toward = if rng.below(4) == 0 { DVec3::X } else { rng.cube() * radius - origin };
            let ray = Ray::new(origin.as_vec3(), toward.as_vec3());
            let hit = embree.intersect(&ray);
            assert!(hit.is_none_or(|hit| hit.t >= 0.0 && hit.t <= ray.t_max));
            if let Some(at) = hit.and_then(|hit| geometry.interaction(&ray, &hit)) {
                let _ = embree.occluded(&at.spawn(rng.direction().as_vec3()));
            }
        }
    }
    assert!(native > 250, "{native}");
}
