//! Properties of every analytic shape: derivatives, parameters, singular points, bounds, sampling, placement.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::*;
use crate::geometry::ProfileParameter;
use crate::id::{PrimId, ShapeId};
use crate::math::vectorize::with_each;

fn vase() -> Profile {
    Profile::bezier(&[[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]]).unwrap()
}

fn shapes() -> Vec<Analytic> {
    let mut shapes =
        vec![Analytic::Quad(Quad::new(dvec3(0.3, -0.2, 0.1), dvec3(1.5, 0.2, 0.3), dvec3(-0.1, 0.8, 0.4)).unwrap())];
    for phi_max in [1.0, 3.5, TAU] {
        shapes.push(Analytic::Sphere(Sphere::new(1.5, -1.5, 1.5, phi_max).unwrap()));
        shapes.push(Analytic::Sphere(Sphere::new(1.5, -0.6, 1.2, phi_max).unwrap()));
        shapes.push(Analytic::Disk(Disk::new(1.2, 0.0, phi_max).unwrap()));
        shapes.push(Analytic::Disk(Disk::new(1.2, 0.7, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::cylinder(0.8, 1.7, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::new(0.8, 0.0, 1.7, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::new(0.3, 1.1, 0.4, phi_max).unwrap()));
        for parameter in [ProfileParameter::Curve, ProfileParameter::Height, ProfileParameter::ArcLength] {
            shapes.push(Analytic::Revolution(
                Revolution::new(&vase(), phi_max).unwrap().with_parameter(parameter).unwrap(),
            ));
        }
    }
    shapes
}

fn hit_from_above(shape: &Analytic, p: DVec3, n: DVec3) -> Option<LocalSurface> {
    let ray = endless(p + 1e-3 * n, -n);
    let hit = shape.intersect(&ray)?;
    Some(shape.surface(&ray, &hit))
}

#[test]
fn derivatives_are_those_of_the_parameters() {
    let mut random = Rng::new(11);
    for shape in shapes() {
        let mut tried = 0;
        for _ in 0..400 {
            let sample = shape.sample([random.range(0.02, 0.98), random.range(0.05, 0.95)]);
            let Some(s) = hit_from_above(&shape, sample.p, sample.n) else { continue };
            for (step, expected) in [(s.dp_du, [1.0, 0.0]), (s.dp_dv, [0.0, 1.0])] {
                assert!(step.dot(s.n).abs() < 1e-9 * step.length(), "{shape:?} {s:?}");
                let eps = 1e-5;
                let Some(moved) = hit_from_above(&shape, s.p + eps * step, s.n) else { continue };
                for (k, expected) in expected.iter().enumerate() {
                    let change = (moved.uv[k] - s.uv[k]) / eps;
                    assert!((change - expected).abs() < 2e-2, "{shape:?} {s:?} {change}");
                }
                tried += 1;
            }
        }
        assert!(tried > 600, "{shape:?} {tried}");
    }
}

#[test]
fn samples_are_hit_where_they_are_with_the_same_density() {
    let mut random = Rng::new(12);
    for shape in shapes() {
        for _ in 0..2_000 {
            let sample = shape.sample([random.range(0.001, 0.999), random.range(0.001, 0.999)]);
            let s = hit_from_above(&shape, sample.p, sample.n).unwrap_or_else(|| panic!("{shape:?} {sample:?}"));
            assert!(
                (s.p - sample.p).length() < 1e-12 && (s.n - sample.n).length() < 1e-8,
                "{shape:?} {s:?} {sample:?}"
            );
            assert!((s.pdf_area - sample.pdf_area).abs() < 1e-7 * sample.pdf_area, "{shape:?} {s:?} {sample:?}");
            assert!(s.uv.iter().all(|x| (0.0..=1.0).contains(x)), "{s:?}");
        }
    }
}

/// Coordinates of a point that are uniform if the point is uniform by area; `None` for shapes without such a closed
/// form.
fn uniform_coordinates(shape: &Analytic, p: DVec3) -> Option<[f64; 2]> {
    let s = hit_from_above(shape, p, normal_at(shape, p)?)?;
    let v = match shape {
        Analytic::Sphere(_) => {
            let b = shape.bounds();
            (p.z - b.min.z) / (b.max.z - b.min.z)
        }
        Analytic::Quad(_) => s.uv[1],
        Analytic::Disk(disk) => {
            let inner = disk.radius() * disk.radius() - 2.0 * disk.area() / s.dp_du.length() * p.x.hypot(p.y);
            (p.length_squared() - inner) / (disk.radius() * disk.radius() - inner)
        }
        Analytic::Frustum(frustum) => {
            let [bottom, top] = frustum.radii();
            let v = s.uv[1];
            v * (2.0 * bottom + (top - bottom) * v) / (bottom + top)
        }
        Analytic::Revolution(_) => return None,
    };
    Some([s.uv[0], v])
}

fn normal_at(shape: &Analytic, p: DVec3) -> Option<DVec3> {
    Some(match shape {
        Analytic::Sphere(_) => p.normalize(),
        Analytic::Quad(quad) => quad.edge_u().cross(quad.edge_v()).normalize(),
        Analytic::Disk(_) => DVec3::Z,
        Analytic::Frustum(frustum) => {
            let [bottom, top] = frustum.radii();
            let rho = p.x.hypot(p.y);
            dvec3(frustum.height() * p.x / rho, frustum.height() * p.y / rho, bottom - top).normalize()
        }
        Analytic::Revolution(_) => return None,
    })
}

#[test]
fn samples_are_uniform_by_area() {
    const SIDE: usize = 12;
    const COUNT: usize = 40_000;
    let mut random = Rng::new(13);
    for shape in shapes() {
        if matches!(shape, Analytic::Revolution(_)) {
            continue;
        }
        let mut counts = [0f64; SIDE * SIDE];
        for _ in 0..COUNT {
            let sample = shape.sample([random.unit(), random.unit()]);
            assert!((sample.pdf_area * shape.area() - 1.0).abs() < 1e-12);
            let Some([u, v]) = uniform_coordinates(&shape, sample.p) else { continue };
            let cell = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
            counts[cell(v) * SIDE + cell(u)] += 1.0;
        }
        let total: f64 = counts.iter().sum();
        assert!(total > 0.999 * COUNT as f64, "{shape:?}: {total} of the samples are on the surface");
        let expected = total / counts.len() as f64;
        let chi_squared: f64 = counts.iter().map(|c| (c - expected).powi(2) / expected).sum();
        let p = ChiSquared::new((counts.len() - 1) as f64).unwrap().sf(chi_squared);
        assert!(p > 1e-6, "{shape:?}: p = {p}");
    }
}

#[test]
fn rays_that_are_none_are_not_hit() {
    for shape in shapes() {
        let placed = TransformedShape::new(shape.clone(), Transform::IDENTITY);
        for bad in [f32::NAN, f32::INFINITY] {
            for ray in [
                Ray::new(Vec3::new(bad, 0.0, 5.0), -Vec3::Z),
                Ray::new(Vec3::new(0.1, 0.1, 5.0), Vec3::new(0.0, bad, -1.0)),
                Ray::new(Vec3::new(0.1, 0.1, 5.0), Vec3::ZERO),
                Ray { t_max: f32::NAN, ..Ray::new(Vec3::new(0.4, 0.4, 5.0), -Vec3::Z) },
                Ray { t_min: f32::NAN, ..Ray::new(Vec3::new(0.4, 0.4, 5.0), -Vec3::Z) },
            ] {
                assert_eq!(placed.intersect(&ray), None, "{shape:?} {ray:?}");
                assert_eq!(shape.intersect(&RayF64::from(&ray)), None, "{shape:?} {ray:?}");
            }
        }
    }
}

fn transforms() -> Vec<Transform> {
    let shear = DMat3::from_cols(dvec3(1.2, 0.1, 0.0), dvec3(0.4, 0.7, -0.3), dvec3(0.0, 0.5, 2.0));
    let maps = [
        DAffine3::from_scale(dvec3(0.5, 2.0, 1.3)),
        DAffine3::from_rotation_y(1.1) * DAffine3::from_scale(dvec3(-1.0, 1.5, 0.25)),
        DAffine3 { matrix3: shear, translation: dvec3(10.0, -3.0, 100.0) },
    ];
    maps.iter().map(|map| Transform::new(*map).unwrap()).collect()
}

#[test]
fn placed_normals_stay_perpendicular_and_outside() {
    let mut random = Rng::new(15);
    for shape in shapes() {
        for transform in transforms() {
            let mut placed = TransformedShape::new(shape.clone(), transform);
            for reverse_normal in [false, true] {
                placed.reverse_normal = reverse_normal;
                for _ in 0..50 {
                    let s = shape.sample([random.range(0.01, 0.99), random.range(0.01, 0.99)]);
                    let Some(local) = hit_from_above(&shape, s.p, s.n) else { continue };
                    let point = placed.place(s.p, s.n, s.pdf_area);
                    let n = point.n.as_dvec3();
                    for tangent in [local.dp_du, local.dp_dv].map(|v| transform.vector(v)) {
                        assert!(n.dot(tangent).abs() < 1e-6 * tangent.length());
                    }
                    // What is outside before is outside after.
                    let side = n.dot(transform.vector(s.n));
                    assert!((side < 0.0) == reverse_normal, "{shape:?} {side}");

                    // From the front, the ray sees the same point, normal and density.
                    let outward = transform.vector(s.n).normalize() * 1e-2;
                    let ray = Ray::new((point.p + outward).as_vec3(), -outward.as_vec3());
                    let Some(seen) = interaction(&placed, &ray) else { continue };
                    if (seen.p - point.p).length() > 1e-4 {
                        continue;
                    }
                    assert!((seen.n_g - point.n).length() < 1e-2, "{shape:?}");
                    let pdf = placed.pdf_area(&ray).unwrap();
                    assert!((pdf / point.pdf_area - 1.0).abs() < 5e-3, "{shape:?} {pdf} {}", point.pdf_area);
                    if let Some(short) = placed.pdf_area_from_normal(seen.n_g) {
                        assert!((short / pdf - 1.0).abs() < 1e-6);
                    }
                }
            }
        }
    }
}

#[test]
fn placed_densities_integrate_to_one() {
    // Midpoints of a grid in the sampler's own square: the mean of 1 / pdf is the area, found here from derivatives of
    // the placed map.
    const SIDE: usize = 200;
    for shape in shapes() {
        for transform in transforms() {
            let placed = TransformedShape::new(shape.clone(), transform);
            let mid = |i: usize| (i as f32 + 0.5) / SIDE as f32;
            let (mut from_pdf, mut from_patches) = (0.0, 0.0);
            let corner =
                |i: usize, k: usize| transform.point(shape.sample([i as f64 / SIDE as f64, k as f64 / SIDE as f64]).p);
            for i in 0..SIDE {
                for k in 0..SIDE {
                    from_pdf += 1.0 / placed.sample_area([mid(i), mid(k)]).pdf_area / (SIDE * SIDE) as f64;
                    let (a, b, c, d) = (corner(i, k), corner(i + 1, k), corner(i, k + 1), corner(i + 1, k + 1));
                    from_patches += 0.5 * (d - a).cross(c - b).length();
                }
            }
            assert!((from_pdf / from_patches - 1.0).abs() < 2e-3, "{shape:?} {from_pdf} {from_patches}");
        }
    }
}

#[test]
fn hits_whose_distance_was_rounded_otherwise_are_found_again() {
    let placed = TransformedShape::new(Analytic::Sphere(Sphere::full(1.0).unwrap()), Transform::IDENTITY);
    let ray = Ray::new(Vec3::new(0.0, 0.0, -3.0), Vec3::Z);
    let hit = Hit { t: 1.999_99, ..NO_HIT };
    assert_eq!(placed.interaction(&ray, &hit).map(|at| at.t), Some(2.0));
    assert_eq!(placed.interaction(&ray, &Hit { instance: InstanceId(0), ..hit }).map(|at| at.t), Some(2.0));
    // The far side, seen through a hole in the near one.
    assert_eq!(placed.interaction(&ray, &Hit { t: 4.000_01, ..hit }).map(|at| at.t), Some(4.0));
    // The end of the ray may be the hit itself.
    assert!(placed.interaction(&Ray { t_max: 2.0, ..ray }, &Hit { t: 2.0, ..NO_HIT }).is_some());
}

#[test]
fn points_resolved_in_rows_are_those_of_single_hits() {
    let mut random = Rng::new(29);
    let [mut resolved, mut hits] = [0usize; 2];
    for shape in shapes() {
        let matrix = DMat3::from_cols(dvec3(0.6, 0.8, 0.1), dvec3(-0.8, 0.5, 0.0), dvec3(0.1, 0.2, 1.3));
        let transform = Transform::new(DAffine3 { matrix3: matrix, translation: dvec3(0.3, -2.0, 1.0) }).unwrap();
        let placed = TransformedShape::new(shape, transform);
        for count in [1, 16, 60, BATCH] {
            let (mut rays, mut t) = (RayRows::default(), [0.0; BATCH]);
            let mut found = Vec::new();
            while found.len() < count {
                let origin = (random.cube() * 4.0 - 2.0 + transform.point(DVec3::ZERO)).as_vec3();
                let toward = transform.point(random.cube() - 0.5).as_vec3();
                let ray = Ray::new(origin, toward - origin);
                let Some(hit) = placed.intersect(&ray) else { continue };
                rays.set(found.len(), &ray);
                t[found.len()] = hit.t as f32;
                found.push(Hit {
                    t: hit.t as f32,
                    u: 0.0,
                    v: 0.0,
                    shape: ShapeId(0),
                    prim: PrimId(0),
                    instance: Hit::NO_INSTANCE,
                });
            }
            let (mut points, mut normals) = (WorldPointRows::default(), WorldNormalRows::default());
            placed.resolve_rows(&rays, &t, count, &mut points, &mut normals);
            for (i, hit) in found.iter().enumerate().filter(|&(i, _)| normals.is_unresolved[i] == 0) {
                let at = placed.interaction(&rays.get(i), hit).unwrap();
                let found = (points.p.get(i), normals.t[i], normals.n.get(i), placed.error());
                assert_eq!(found, (at.p, at.t, at.n_g, at.error), "{placed:?} {i}");
                if matches!(placed.shape, Analytic::Quad(_)) {
                    let found = (normals.dp_du.get(i), normals.uv.get(i));
                    assert_eq!(found, (at.dp_du, at.uv), "{placed:?} {i}");
                }
                resolved += 1;
            }
            hits += if placed.intersects_packets() { count } else { 0 };
        }
    }
    assert!(resolved > hits * 9 / 10, "{resolved} of {hits}");
}

#[test]
fn packets_hit_what_single_rays_hit() {
    let mut random = Rng::new(23);
    let [mut met, mut open] = [0usize; 2];
    for shape in shapes() {
        for scale in [1.0, 1e-3] {
            let matrix = DMat3::from_cols(dvec3(0.6, 0.8, 0.1), dvec3(-0.8, 0.5, 0.0), dvec3(0.1, 0.2, 1.3)) * scale;
            let transform =
                Transform::new(DAffine3 { matrix3: matrix, translation: dvec3(0.3, -2.0, 1.0) * scale }).unwrap();
            let placed = TransformedShape::new(shape.clone(), transform);
            for round in 0..40 {
                let mut vector = |size: f64| {
                    dvec3(random.range(-size, size), random.range(-size, size), random.range(-size, size)).as_vec3()
                };
                let rays: [Ray; PACKET_SIZE] = std::array::from_fn(|i| {
                    let origin = vector(3.0 * scale) + transform.point(DVec3::ZERO).as_vec3();
                    let t_max = if i % 5 == 4 { 1.0 } else { f32::INFINITY };
                    let ray = Ray {
                        t_max,
                        ..Ray::new(origin, transform.point(DVec3::ZERO).as_vec3() - origin + vector(scale))
                    };
                    // On, or steps past, what it has met: the start of the interval decides.
                    let t_min =
                        if round % 4 == 3 { placed.intersect(&ray).map_or(0.0, |hit| hit.t as f32) } else { 0.0 };
                    Ray { t_min, ..ray }
                });
                let row = |of: fn(&Ray) -> f32| rays.each_ref().map(of);
                let rows = RayPacket {
                    origin: [row(|r| r.origin.x), row(|r| r.origin.y), row(|r| r.origin.z)],
                    t_min: row(|r| r.t_min),
                    direction: [row(|r| r.direction.x), row(|r| r.direction.y), row(|r| r.direction.z)],
                    t_max: row(|r| r.t_max),
                };
                if !placed.intersects_packets() {
                    assert!(placed.intersect_packet(&rows).is_undecided.iter().all(|&open| open != 0));
                    continue;
                }
                for hits in with_each!(intersect_packet(&placed, &rows)) {
                    for (i, ray) in rays.iter().enumerate().filter(|(i, _)| hits.is_undecided[*i] == 0) {
                        let single = placed.intersect(ray).map_or(-1.0, |hit| hit.t as f32);
                        assert_eq!(hits.t[i].to_bits(), single.to_bits(), "{placed:?} {ray:?}");
                    }
                }
                let hits = placed.intersect_packet(&rows);
                met += hits.t.iter().filter(|t| **t >= 0.0).count();
                open += hits.is_undecided.iter().filter(|open| **open != 0).count();
            }
        }
    }
    assert!(met > 5_000 && open < met / 10, "{met} {open}");
}
