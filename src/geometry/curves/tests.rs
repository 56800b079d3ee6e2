use std::f64::consts::TAU;

use super::*;
use crate::geometry::{Analytic, Frustum, Hit, Shape, SurfaceInteraction, TransformedShape};
use crate::id::ShapeId;
use crate::math::{DMat3, DVec3, Rng, Transform, Vec3};

fn curves(points: &[[f32; 4]], basis: CurveBasis, kind: CurveKind) -> Curves {
    Curves::new(Strands { points: points.to_vec(), counts: vec![points.len() as u32] }, basis, kind).unwrap()
}

/// The first hit with any segment, and its interaction.
fn seen(curves: &Curves, ray: &Ray) -> Option<(f32, SurfaceInteraction)> {
    let hits = (0..curves.prim_count()).map(PrimId::new).filter_map(|prim| Some((curves.intersect(prim, ray)?, prim)));
    let (t, prim) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let hit = Hit { t, u: 0.0, v: 0.0, shape: ShapeId(0), prim, instance: Hit::NO_INSTANCE };
    let (at, _) = curves.interaction_and_dp_dv(ray, &hit).expect("a hit is found again");
    Some((t, at))
}

fn random_strand(rng: &mut Rng, points: usize, radius: f64) -> Vec<[f32; 4]> {
    let mut p = rng.cube() * 0.3;
    let strand = (0..points).map(|_| {
        p += rng.cube() * 0.5;
        [p.x as f32, p.y as f32, p.z as f32, (radius * rng.range(0.5, 1.0)) as f32]
    });
    strand.collect()
}

fn random_ray(rng: &mut Rng, points: &[[f32; 4]], radius: f64) -> Ray {
    let [x, y, z, _] = points[1 + rng.below(points.len() - 2)].map(f64::from);
    let target = DVec3::new(x, y, z) + rng.cube() * 2.0 * radius;
    let origin = target + rng.cube().normalize() * 3.0;
    let length = rng.range(0.1, 10.0);
    Ray::new(origin.as_vec3(), ((target - origin).normalize() * length).as_vec3())
}

#[test]
fn a_straight_curve_is_a_cylinder() {
    let mut rng = Rng::new(1);
    let mut hits = 0;
    for _ in 0..40 {
        let (a, b) = (rng.cube(), rng.cube());
        let radius = 10f64.powf(rng.range(-4.0, -1.0)) as f32;
        let [a, b] = [a, b].map(DVec3::as_vec3);
        let points = [a, b].map(|p: Vec3| [p.x, p.y, p.z, radius]);
        let line = curves(&points, CurveBasis::Linear, CurveKind::Round);
        let axis = b.as_dvec3() - a.as_dvec3();
        let z = axis.normalize();
        let x = z.any_orthonormal_vector();
        let frame = crate::math::DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), a.as_dvec3());
        let cylinder = Frustum::cylinder(f64::from(radius), axis.length(), TAU).unwrap();
        let cylinder = TransformedShape::new(Analytic::Frustum(cylinder), Transform::new(frame).unwrap());
        for _ in 0..500 {
            let target = a.as_dvec3() + axis * rng.unit() + rng.cube() * 1.5 * f64::from(radius);
            let origin = target + rng.cube().normalize() * rng.range(1.0, 100.0);
            let ray = Ray::new(origin.as_vec3(), (target - origin).as_vec3());
            let found = seen(&line, &ray);
            let Some(expected) = cylinder.intersect(&ray) else {
                assert!(found.is_none(), "{ray:?}");
                continue;
            };
            let outside = |t: f64| {
                let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * t;
                let n = (p - a.as_dvec3()).reject_from(axis);
                n.dot(ray.direction.as_dvec3()) < 0.0
            };
            // From inside, which is where rays through an open end meet it, the curve is not hit.
            if !outside(expected.t) {
                assert!(found.is_none(), "{ray:?}");
                continue;
            }
            let (t, at) = found.unwrap_or_else(|| panic!("{ray:?}"));
            hits += 1;
            assert!((f64::from(t) - expected.t).abs() <= 1e-6 * expected.t, "{t} {}", expected.t);
            let n = (at.p - a.as_dvec3()).reject_from(axis);
            let off = (n.length() - f64::from(radius)).abs();
            assert!(
                off < 1e-12 * (1.0 + 1.0 / f64::from(radius)),
                "{off} {radius} {ray:?} {at:?} {expected:?} {a} {b}"
            );
            assert!((at.n_g.as_dvec3() - n.normalize()).length() < 1e-5);
            assert!((at.dp_du.as_dvec3().normalize() - z).length() < 1e-6);
        }
    }
    assert!(hits > 5_000, "{hits}");
}

/// The first distance by brute force: the smallest local minimum, over many points of the curve, of the distance to the
/// sphere there, and the least squared half chord that decided.
fn brute_force(curve: &Curves, ray: &Ray) -> (Option<f64>, f64) {
    const STEPS: usize = 20_000;
    let space = RaySpace::new(ray);
    let (mut best, mut margin) = (None, f64::INFINITY);
    for prim in (0..curve.prim_count()).map(PrimId::new) {
        let segment = curve.segment(prim).in_space(&space);
        let value = |i: usize| {
            let p = segment.at(i as f64 / STEPS as f64)[0];
            let below = p.w * p.w - p.x * p.x - p.y * p.y;
            match curve.kind {
                CurveKind::Round => (if below > 0.0 { p.z - below.sqrt() } else { f64::INFINITY }, below / (p.w * p.w)),
                _ => (p.x * p.x + p.y * p.y, below / (p.w * p.w)),
            }
        };
        let values: Vec<_> = (0..=STEPS).map(value).collect();
        for i in 1..STEPS {
            let [before, here, after] = [values[i - 1].0, values[i].0, values[i + 1].0];
            if !(here <= before && here <= after) {
                continue;
            }
            margin = margin.min(values[i].1.abs());
            if values[i].1 <= 0.0 || !here.is_finite() {
                continue;
            }
            let p = segment.at(i as f64 / STEPS as f64)[0];
            let z = if curve.kind == CurveKind::Round { here } else { p.z };
            if z > 0.0 && best.is_none_or(|best| z < best) {
                best = Some(z);
            }
        }
        let most = values.iter().map(|v| v.1).fold(f64::NEG_INFINITY, f64::max);
        margin = margin.min(most.abs());
    }
    (best.map(|z| z / space.length), margin)
}

#[test]
fn curves_are_met_where_brute_force_meets_them() {
    let mut rng = Rng::new(2);
    let (mut hits, mut misses) = (0, 0);
    for basis in [CurveBasis::BSpline, CurveBasis::CatmullRom, CurveBasis::Bezier, CurveBasis::Linear] {
        for kind in [CurveKind::Round, CurveKind::Flat] {
            for _ in 0..12 {
                let radius = 10f64.powf(rng.range(-3.0, -1.5));
                let points = random_strand(&mut rng, 4, radius);
                let curve = curves(&points, basis, kind);
                for _ in 0..8 {
                    let ray = random_ray(&mut rng, &points, radius);
                    let (expected, margin) = brute_force(&curve, &ray);
                    // At silhouettes, and where a joint of straight lines is met, brute force decides nothing.
                    if margin < 1e-3 || basis == CurveBasis::Linear && kind == CurveKind::Round && expected.is_none() {
                        continue;
                    }
                    let found = seen(&curve, &ray);
                    match (expected, found) {
                        (None, None) => misses += 1,
                        (Some(expected), Some((t, _))) => {
                            hits += 1;
                            let tolerance =
                                (1e-3 * radius + 1e-4) / f64::from(ray.direction.length()) + 1e-6 * expected;
                            let ahead = basis == CurveBasis::Linear && f64::from(t) < expected;
                            assert!(
                                ahead || (f64::from(t) - expected).abs() < tolerance,
                                "{basis:?} {kind:?} {t} {expected}"
                            );
                        }
                        (expected, found) => panic!("{basis:?} {kind:?} {expected:?} {:?}", found.map(|f| f.0)),
                    }
                }
            }
        }
    }
    assert!(hits > 100 && misses > 200, "{hits} {misses}");
}

#[test]
fn rays_that_start_on_a_curve_do_not_meet_it_again_where_it_is_straight() {
    let mut rng = Rng::new(3);
    let points: Vec<[f32; 4]> = (0..8).map(|i| [i as f32 * 0.3, 0.01 * i as f32, 7.0, 0.02]).collect();
    let mut started = 0;
    for (basis, kind) in [
        (CurveBasis::BSpline, CurveKind::Round),
        (CurveBasis::Linear, CurveKind::Round),
        (CurveBasis::BSpline, CurveKind::Flat),
        (CurveBasis::CatmullRom, CurveKind::Cylinder),
    ] {
        let curve = curves(&points, basis, kind);
        for _ in 0..500 {
            let ray = random_ray(&mut rng, &points, 0.02);
            let Some((_, at)) = seen(&curve, &ray) else { continue };
            for _ in 0..8 {
                // Outward, and inward: light that crosses a hair leaves it.
                let direction = rng.cube().normalize().as_vec3();
                // Along a ribbon it faces the ray far ahead.
                if kind != CurveKind::Round && direction.x.abs() > 0.7 {
                    continue;
                }
                assert!(seen(&curve, &at.spawn(direction)).is_none(), "{kind:?} {direction} {at:?}");
                started += 1;
            }
        }
    }
    assert!(started > 2_000, "{started}");
}

#[test]
fn joints_have_neither_gaps_nor_seams() {
    let mut rng = Rng::new(4);
    // Seen along z, the ray through any point of the axis meets the curve; at the joints of straight lines, the sphere.
    let points: Vec<[f32; 4]> = (0..10).map(|i| [i as f32, if i % 2 == 0 { 0.0 } else { 0.7 }, 0.0, 0.05]).collect();
    for basis in [CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom] {
        let curve = curves(&points, basis, CurveKind::Round);
        for prim in (0..curve.prim_count()).map(PrimId::new) {
            let us = (0..200).map(|_| rng.unit()).chain([0.0, 1e-9, 1e-7, 1.0 - 1e-7, 1.0]);
            for u in us {
                if (prim.0 == 0 && u < 1e-3) || (prim.index() + 1 == curve.prim_count() && u > 0.999) {
                    continue;
                }
                let p = curve.segment(prim).at(u)[0];
                let ray = Ray::new(Vec3::new(p.x as f32, p.y as f32, 3.0), -Vec3::Z);
                let (t, at) = seen(&curve, &ray).unwrap_or_else(|| panic!("{basis:?} {prim:?} {u}"));
                assert!((t - 2.95).abs() < 1e-3, "{basis:?} {prim:?} {u}: {t}");
                assert!(at.n_g.z > 0.99, "{basis:?} {prim:?} {u}: {}", at.n_g);
            }
        }
    }
    // Beyond the corner, only the sphere is there.
    let corner = curves(
        &[[-1.0, -1.0, 0.0, 0.1], [0.0, 0.0, 0.0, 0.1], [1.0, -1.0, 0.0, 0.1]],
        CurveBasis::Linear,
        CurveKind::Round,
    );
    let (t, _) = seen(&corner, &Ray::new(Vec3::new(0.0, 0.09, 1.0), -Vec3::Z)).unwrap();
    assert!((f64::from(t) - (1.0 - (0.01f64 - 0.0081).sqrt())).abs() < 1e-6);
    assert!(seen(&corner, &Ray::new(Vec3::new(0.0, 0.101, 1.0), -Vec3::Z)).is_none());
}

#[test]
fn what_makes_no_curve_is_refused_and_what_is_degenerate_is_traced() {
    let point = |x: f32, r: f32| [x, 0.0, 0.0, r];
    let new = |points: Vec<[f32; 4]>, counts: Vec<u32>, basis| {
        Curves::new(Strands { points, counts }, basis, CurveKind::Round).map(|_| ())
    };
    assert_eq!(new(vec![], vec![], CurveBasis::Linear), Err(CurvesError::Empty));
    assert_eq!(new(vec![point(f32::NAN, 1.0); 2], vec![2], CurveBasis::Linear), Err(CurvesError::Position(0)));
    let bad = |radius: f32| new(vec![point(0.0, 1.0), point(1.0, radius)], vec![2], CurveBasis::Linear);
    assert_eq!(bad(-1.0), Err(CurvesError::Radius { point: 1, radius: -1.0 }));
    assert!(bad(f32::NAN).is_err() && bad(f32::INFINITY).is_err());
    for (basis, count) in [(CurveBasis::Linear, 1), (CurveBasis::Bezier, 6), (CurveBasis::BSpline, 3)] {
        let few = new(vec![point(0.0, 1.0); count], vec![count as u32], basis);
        assert_eq!(few, Err(CurvesError::Points { strand: 0, count, basis }));
    }
    let unused = new(vec![point(0.0, 1.0); 5], vec![2, 2], CurveBasis::Linear);
    assert_eq!(unused, Err(CurvesError::Counts { counted: 4, points: 5 }));
    assert!(curves(&[point(0.0, 1.0); 4], CurveBasis::Linear, CurveKind::Round).with_root_uvs(vec![]).is_err());

    let mut rng = Rng::new(5);
    let degenerate = [
        vec![point(0.0, 0.0), point(1.0, 0.0), point(2.0, 0.0), point(3.0, 0.0)],
        vec![point(1.0, 0.1); 4],
        vec![point(0.0, 0.1), point(0.0, 0.1), point(0.0, 0.1), point(1.0, 0.1)],
        vec![point(0.0, 1.0), point(0.1, 0.0), point(0.2, 1.0), point(0.3, 0.0)],
        vec![point(0.0, 1e-30), point(1e-30, 1e-30), point(2e-30, 1e-30), point(3e-30, 0.0)],
        vec![point(-1e17, 1e15), point(1e17, 1e15), point(2e17, 1e15), point(3e17, 1e15)],
    ];
    for points in degenerate {
        for basis in [CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom] {
            for kind in [CurveKind::Round, CurveKind::Flat, CurveKind::Cylinder] {
                let curve = curves(&points, basis, kind);
                let invisible = points.iter().all(|p| p[3] == 0.0);
                for i in 0..200 {
                    let scale = if points[0][0] < -1.0 { 1e17 } else { 1.0 };
                    let origin = rng.cube() * 3.0 * scale;
                    let toward = if i % 4 == 0 { DVec3::X } else { DVec3::X * rng.unit() * scale - origin };
                    let ray = Ray::new(origin.as_vec3(), toward.as_vec3());
                    if let Some((t, at)) = seen(&curve, &ray) {
                        assert!(!invisible && t >= 0.0 && at.p.is_finite() && at.uv.is_finite(), "{points:?} {at:?}");
                        assert!((at.n_g.length() - 1.0).abs() < 1e-5 && at.dp_du.is_finite(), "{points:?} {at:?}");
                        assert!(at.error.is_finite());
                    }
                }
            }
        }
    }
}

#[test]
fn parameters_run_along_and_around() {
    let points = [[0.0, 0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.1], [2.0, 0.0, 0.0, 0.1]];
    for (kind, edge) in [(CurveKind::Round, 0.0), (CurveKind::Flat, 0.05)] {
        let curve = curves(&points, CurveBasis::Linear, kind);
        for x in [0.1f32, 0.9, 1.3] {
            let (_, at) = seen(&curve, &Ray::new(Vec3::new(x, edge, 3.0), -Vec3::Z)).unwrap();
            assert!((at.uv.x - x / 2.0).abs() < 1e-6 && (0.0..=1.0).contains(&at.uv.y), "{}", at.uv);
            assert!((at.dp_du.x - 2.0).abs() < 1e-5);
        }
        let rooted = curve.with_root_uvs(vec![[0.25, 0.75]]).unwrap();
        let (_, at) = seen(&rooted, &Ray::new(Vec3::new(0.5, edge, 3.0), -Vec3::Z)).unwrap();
        assert_eq!(at.uv.to_array(), [0.25, 0.75]);
    }
    // A ribbon with a tube's normals turns them from edge to edge.
    let ribbon = curves(&points, CurveBasis::Linear, CurveKind::Cylinder);
    for h in [-0.9f32, -0.3, 0.0, 0.5, 0.9] {
        let (_, at) = seen(&ribbon, &Ray::new(Vec3::new(0.5, 0.1 * h, 3.0), -Vec3::Z)).unwrap();
        assert!((at.n_g.y - h).abs() < 1e-5 && (at.n_g.z - (1.0 - h * h).sqrt()).abs() < 1e-5, "{h} {}", at.n_g);
    }
    assert!(matches!(Shape::Curves(Box::new(ribbon)).prim_count(), 2));
}
