//! Properties of every analytic shape: which root, derivatives, parameters, singular points, bounds, one answer for
//! both queries.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::accel::{self, AccelKind, Accelerator, Coherence, LinearAccel};
use crate::geometry::{
    Analytic, Disk, Frustum, Geometry, LocalSurface, Profile, Revolution, Shape, Sphere, TransformedShape,
};
use crate::math::float::{F64_CHAIN_ERROR, UNIT_ROUNDOFF};
use crate::math::{Bounds, DMat3, DVec3, Frame, Ray, RayF64, Transform, dvec3};
use crate::stability::geometry::{Rng, closest, ray_through, transform, world};
use crate::stability::oracle::{Answer, Case, ExactTransform, partial_cases, whole_cases};
use crate::stability::{Effort, Faults, Outcome};

const VALID: &str = "the checks' shapes are valid";
const VASE: [[f64; 2]; 7] = [[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]];

fn endless(origin: DVec3, direction: DVec3) -> RayF64 {
    RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
}

fn vase(phi_max: f64) -> Analytic {
    Analytic::Revolution(Revolution::new(&Profile::bezier(&VASE).expect(VALID), phi_max).expect(VALID))
}

/// Shapes of every kind, whole and cut.
fn shapes() -> Vec<(&'static str, Analytic)> {
    let quadrics = whole_cases().into_iter().chain(partial_cases()).map(|case| (case.name, case.shape));
    quadrics.chain([1.0, 3.5, TAU].map(|phi_max| ("revolution", vase(phi_max)))).collect()
}

fn placed(shape: &Analytic, linear: DMat3, translation: DVec3) -> Geometry {
    world(vec![Shape::Analytic(TransformedShape::new(shape.clone(), transform(linear, translation)))])
}

/// What a ray finds through the oracle of all accelerators.
fn distance(shape: &Analytic, ray: &Ray) -> Option<f32> {
    let geometry = placed(shape, DMat3::IDENTITY, DVec3::ZERO);
    closest(&LinearAccel::new(&geometry), &geometry, ray).found.map(|at| at.t)
}

fn hit_from_above(shape: &Analytic, p: DVec3, n: DVec3) -> Option<LocalSurface> {
    let ray = endless(p + 0.001 * n, -n);
    let hit = shape.intersect(&ray)?;
    Some(shape.surface(&ray, &hit))
}

/// Wrong distances of rays along the axes, at the heights beside the shapes, where each has the radius 2.
fn wrong_roots(shapes: [(&Analytic, f64); 3]) -> Faults {
    // Numbers with few digits: the answers are exact.
    let mut wrong = Faults::NONE;
    for (shape, z) in shapes {
        for axis in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y] {
            let ray = |start: f64, t_min: f32, t_max: f32| Ray {
                t_min,
                t_max,
                ..Ray::new((start * axis + z * DVec3::Z).as_vec3(), axis.as_vec3())
            };
            let far = f32::INFINITY;
            let expected = [
                (ray(-5.0, 0.0, far), Some(3.0)),
                (ray(-2.0, 0.0, far), Some(4.0)),
                (ray(-1.0, 0.0, far), Some(3.0)),
                (ray(0.0, 0.0, far), Some(2.0)),
                (ray(2.0, 0.0, far), None),
                (ray(5.0, 0.0, far), None),
                (ray(-5.0, 3.0, far), Some(3.0)),
                (ray(-5.0, 3f32.next_up(), far), Some(7.0)),
                (ray(-5.0, 3f32.next_up(), 7f32.next_down()), None),
                (ray(-5.0, 7.0, 7.0), Some(7.0)),
                (ray(-5.0, 0.0, 3f32.next_down()), None),
                (ray(-5.0, 0.0, 3.0), Some(3.0)),
            ];
            for (ray, t) in expected {
                let found = distance(shape, &ray);
                wrong.require(found == t, || format!("{shape:?}: {ray:?} has {found:?} in place of {t:?}"));
            }
        }
    }
    wrong
}

pub(super) fn c2_choice_of_root(effort: Effort) -> Outcome {
    let mut rng = Rng::new(41);
    let sphere = Analytic::Sphere(Sphere::full(2.0).expect(VALID));
    let cylinder = Analytic::Frustum(Frustum::cylinder(2.0, 4.0, TAU).expect(VALID));
    let cone = Analytic::Frustum(Frustum::new(4.0, 0.0, 4.0, TAU).expect(VALID));
    let wrong = wrong_roots([(&sphere, 0.0), (&cylinder, 2.0), (&cone, 2.0)]);
    // Exactly tangent: either answer, but a number.
    let mut not_numbers = Faults::NONE;
    for shape in [&sphere, &cylinder] {
        for (from, d) in
            [(dvec3(-5.0, 2.0, 0.0), DVec3::X), (dvec3(2.0, -5.0, 0.0), DVec3::Y), (dvec3(-2.0, 9.0, 0.0), -DVec3::Y)]
        {
            let ray = Ray::new(from.as_vec3(), d.as_vec3());
            let found = distance(shape, &ray);
            not_numbers.require(found.is_none_or(f32::is_finite), || format!("{shape:?}: {ray:?} has {found:?}"));
        }
    }
    // From within and from next to the surface.
    let (mut rays, mut undecidable, mut disagree) = (0, 0usize, Faults::NONE);
    for case in whole_cases() {
        for _ in 0..effort.pick(5_000, 500_000) {
            let sample = case.shape.sample([rng.unit(), rng.unit()]);
            let height = rng.magnitude(-6.0, 0.3) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            let origin = rng.cube().as_vec3();
            let ray = Ray::new(origin, rng.direction().as_vec3());
            let at = Transform::from_translation(origin.as_dvec3() - (sample.p + height * sample.n));
            let geometry = placed(&case.shape, at.world_from_object.matrix3, at.world_from_object.translation);
            let found = closest(&LinearAccel::new(&geometry), &geometry, &ray).found;
            rays += 1;
            let answer = case.answer(&ExactTransform::new(&at), &ray, 4.0 * F64_CHAIN_ERROR);
            let is_right = match (answer, found) {
                (Answer::Undecidable, _) | (Answer::Miss, None) => true,
                // The distance is rounded to f32; of a grazing one more than that is in doubt.
                (Answer::Hit { t, p }, Some(at)) => {
                    (f64::from(at.t) - t).abs() <= UNIT_ROUNDOFF * t + 1e-9 && (at.p - p).length() < 1e-9
                }
                _ => false,
            };
            undecidable += usize::from(answer == Answer::Undecidable);
            disagree.require(is_right, || {
                let found = found.map(|at| (at.t, at.p));
                format!("{} at {at:?}: {ray:?} has {found:?} in place of {answer:?}", case.name)
            });
        }
    }
    Outcome::new()
        .none("wrong among exact cases", wrong)
        .none("tangents that give no number", not_numbers)
        .none("other roots than the oracle's from within 1e-6 to 2 of the surface", disagree)
        .at_most("share of rays that cannot be decided", undecidable as f64 / f64::from(rays), 1e-3)
}

pub(super) fn c3_grid_of_rays(effort: Effort) -> Outcome {
    let mut rng = Rng::new(42);
    let (mut wrong, mut rays) = (Faults::NONE, 0);
    for _ in 0..effort.pick(200, 10_000) {
        for radius in [1.0, 3.0] {
            let shape = Analytic::Sphere(Sphere::full(radius).expect(VALID));
            let geometry = placed(&shape, rng.rotation(), DVec3::ZERO);
            let accel = LinearAccel::new(&geometry);
            for i in 0..21 {
                for j in 0..21 {
                    let [x, y] = [i, j].map(|k| radius * (f64::from(k) * 0.115 - 1.15));
                    let ray = Ray::new(dvec3(x, y, -10.0).as_vec3(), crate::math::Vec3::Z);
                    let [x, y] = [f64::from(ray.origin.x), f64::from(ray.origin.y)];
                    let inside = radius * radius - x * x - y * y;
                    if inside.abs() > 1e-8 {
                        rays += 1;
                        let answers = [accel.intersect(&ray).is_some(), accel.occluded(&ray)];
                        wrong.require(answers == [inside > 0.0; 2], || {
                            format!("radius {radius}: {ray:?}: hit, occluded: {answers:?}")
                        });
                    }
                }
            }
        }
    }
    Outcome::new().none("hit outside or missed inside", wrong).record("rays", f64::from(rays))
}

pub(super) fn c4_derivatives(effort: Effort) -> Outcome {
    let mut rng = Rng::new(43);
    let (mut change, mut slope, mut tried, mut few) = (0f64, 0f64, 0usize, Faults::NONE);
    for (name, shape) in shapes() {
        let before = tried;
        for _ in 0..effort.pick(200, 20_000) {
            let sample = shape.sample([rng.range(0.02, 0.98), rng.range(0.05, 0.95)]);
            let Some(s) = hit_from_above(&shape, sample.p, sample.n) else { continue };
            for (step, expected) in [(s.dp_du, [1.0, 0.0]), (s.dp_dv, [0.0, 1.0])] {
                slope = slope.max(step.dot(s.n).abs() / step.length());
                // To both sides, since on one of them may be a joint of a profile.
                let eps = 1e-5;
                let moved =
                    [eps, -eps].map(|eps| hit_from_above(&shape, s.p + eps * step, s.n).map(|moved| (eps, moved)));
                let [Some(ahead), Some(behind)] = moved else { continue };
                for (k, expected) in expected.iter().enumerate() {
                    let error = |(eps, moved): &(f64, LocalSurface)| ((moved.uv[k] - s.uv[k]) / eps - expected).abs();
                    change = change.max(error(&ahead).min(error(&behind)));
                }
                tried += 1;
            }
        }
        few.require(tried - before >= effort.pick(300, 30_000), || format!("{name}: {}", tried - before));
    }
    Outcome::new()
        .at_most("error of the change of u and v", change, 2e-2)
        .at_most("sine between derivatives and tangent plane", slope, 1e-9)
        .none("shapes with few points tried", few)
        .record("points", tried as f64)
}

pub(super) fn c5_parameters_round_trip(effort: Effort) -> Outcome {
    let side = effort.pick(10, 100);
    let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(side);
    let mut rng = Rng::new(44);
    let (mut missed, mut place, mut parameters) = (Faults::NONE, 0f64, 0f64);
    let mut check = |shape: &Analytic, at: DVec3, uv: [f64; 2]| {
        let geometry = placed(shape, rng.rotation(), rng.cube());
        let Shape::Analytic(on) = geometry.shape(crate::id::ShapeId(0)) else { return };
        let p = on.transform.point(at);
        // From a side that sees the point, by the normal in the shape's own space.
        let (u, v) = (at.cross(DVec3::Z), at);
        let normal = [u, v, DVec3::Z, DVec3::X].into_iter().find_map(|n| {
            let n = if n.length() > 0.1 { n.normalize() } else { DVec3::Z };
            hit_from_above(shape, at, n).filter(|s| (s.p - at).length() < 1e-6).map(|s| s.n)
        });
        let Some(n) = normal.map(|n| on.transform.vector(n)) else {
            missed.require(false, || format!("{shape:?} at {at}, from all sides"));
            return;
        };
        let ray = ray_through(p + n * 0.125, p);
        match closest(&LinearAccel::new(&geometry), &geometry, &ray).found {
            Some(found) => {
                place = place.max((found.p - p).length());
                let uv_found = [found.uv.x, found.uv.y].map(f64::from);
                parameters = parameters.max((uv_found[0] - uv[0]).abs()).max((uv_found[1] - uv[1]).abs());
            }
            None => missed.require(false, || format!("{shape:?} at {at}: {ray:?}")),
        }
    };
    let cases: Vec<Case> = whole_cases().into_iter().chain(partial_cases()).collect();
    let profile = Profile::bezier(&VASE).expect(VALID);
    for i in 0..side {
        for j in 0..side {
            let uv = [middle(i), middle(j)];
            for case in &cases {
                check(&case.shape, case.point(uv[0], uv[1]), uv);
            }
            let (at, (sin, cos)) = (profile.point(2.0 * uv[1]), (3.5 * uv[0]).sin_cos());
            check(&vase(3.5), dvec3(at.x * sin, at.y, at.x * cos), uv);
        }
    }
    Outcome::new().none("missed", missed).at_most("error of the point", place, 1e-5).at_most(
        "error of u, v",
        parameters,
        1e-5,
    )
}

pub(super) fn c6_singularities(_: Effort) -> Outcome {
    let directions = [
        DVec3::Z,
        -DVec3::Z,
        DVec3::Y,
        -DVec3::Y,
        dvec3(0.3, -0.0, 1.0),
        dvec3(-0.0, 0.2, -1.0),
        DVec3::X,
        dvec3(1e-300, 0.0, 1.0),
    ];
    let points =
        [DVec3::ZERO, DVec3::Z, -DVec3::Z, 2.0 * DVec3::Z, 1.5 * DVec3::Z, 0.75 * DVec3::Z, DVec3::Y, -DVec3::Y];
    let (mut broken, mut hits, mut unit, mut frame) = (Faults::NONE, 0usize, 0f64, 0f64);
    for (name, shape) in shapes() {
        for p in points {
            for d in directions {
                let ray = endless(p - 2.0 * d, d);
                let Some(hit) = shape.intersect(&ray) else { continue };
                let s = shape.surface(&ray, &hit);
                hits += 1;
                let finite = hit.t.is_finite() && s.p.is_finite() && s.dp_du.is_finite() && s.dp_dv.is_finite();
                let in_range =
                    s.uv.iter().all(|x| (0.0..=1.0).contains(x)) && s.pdf_area.is_finite() && s.pdf_area > 0.0;
                let describe = || format!("{name}: {ray:?} meets {s:?} at {}", hit.t);
                broken.require(finite && in_range, describe);
                unit = unit.max((s.n.length() - 1.0).abs());
                let Frame { x, y, z } = Frame::from_normal_and_tangent(s.n.as_vec3(), s.dp_du.as_vec3());
                let [x, y, z] = [x, y, z].map(crate::math::Vec3::as_dvec3);
                let lengths = [x, y, z].map(|v| (v.length() - 1.0).abs());
                let angles = [x.dot(y), y.dot(z), z.dot(x)].map(f64::abs);
                frame = lengths.into_iter().chain(angles).fold(frame, f64::max);
                // A NaN is lost in a maximum.
                broken.require(x.is_finite() && y.is_finite() && s.n.is_finite(), describe);
            }
        }
    }
    Outcome::new()
        .none("not finite or out of range", broken)
        .at_most("| |n| - 1 |", unit, 1e-6)
        .at_most("error of the frame", frame, 1e-6)
        .at_least("hits", hits as f64, 300.0)
}

pub(super) fn c8_bounds(effort: Effort) -> Outcome {
    let mut rng = Rng::new(45);
    let (mut outside, mut excess, mut lack) = (Faults::NONE, 0f64, 0f64);
    let mut compare = |bounds: Bounds, tight: Bounds| {
        let (over, under) = (
            (bounds.max - tight.max).max(tight.min - bounds.min),
            (tight.max - bounds.max).max(bounds.min - tight.min),
        );
        excess = excess.max(over.max_element());
        lack = lack.max(under.max_element());
    };
    for case in whole_cases().into_iter().chain(partial_cases()) {
        // The extremes of an arc are at its ends and where it crosses an axis.
        let phi_max = case.phi_max();
        let turns =
            [0.0, 1.0].into_iter().chain((1..4).map(|k| f64::from(k) * FRAC_PI_2 / phi_max).filter(|u| *u < 1.0));
        let mut tight = Bounds::EMPTY;
        for u in turns {
            for i in 0..=1_000 {
                tight = tight.extended(case.point(u, f64::from(i) * 0.001));
            }
        }
        compare(case.shape.bounds(), tight);
    }
    for phi_max in [1.0, 3.5, TAU] {
        let profile = Profile::bezier(&VASE).expect(VALID);
        let mut tight = Bounds::EMPTY;
        for phi in (0..=4).map(|k| f64::from(k) * FRAC_PI_2).filter(|phi| *phi < phi_max).chain([phi_max]) {
            for i in 0..=2_000 {
                let (at, (sin, cos)) = (profile.point(f64::from(i) * 0.001), phi.sin_cos());
                tight = tight.extended(dvec3(at.x * sin, at.y, at.x * cos));
            }
        }
        compare(vase(phi_max).bounds(), tight);
    }
    let shear = DMat3::from_cols(dvec3(1.2, 0.1, 0.0), dvec3(0.4, 0.7, -0.3), dvec3(0.0, 0.5, 2.0));
    for (name, shape) in shapes() {
        for (linear, translation) in
            [(DMat3::IDENTITY, DVec3::ZERO), (rng.rotation(), 1e4 * rng.cube()), (shear, dvec3(10.0, -3.0, 100.0))]
        {
            let placed = TransformedShape::new(shape.clone(), transform(linear, translation));
            let padded = placed.bounds().padded();
            for i in 0..effort.pick(400, 100_000) {
                // Corners and edges as well.
                let edge = |k: i32, u: f64| if i % 7 == k { f64::from(i % 2) } else { u };
                let u = [edge(1, rng.unit()), edge(2, rng.unit())];
                let p = placed.transform.point(placed.shape.sample(u).p).as_vec3();
                outside.require(padded.contains(p), || format!("{name}: {p} for {u:?}, box {padded:?}"));
            }
        }
    }
    Outcome::new()
        .none("points outside the accelerator's box", outside)
        .at_most("reach of the box beyond the tight one", excess, 1e-5)
        .at_most("reach of the tight box beyond it", lack, 64.0 * f64::EPSILON)
}

pub(super) fn c9_both_queries_agree(effort: Effort) -> Outcome {
    let mut rng = Rng::new(46);
    let (mut rays, mut differ, mut late, mut lost) = (0, Faults::NONE, Faults::NONE, Faults::NONE);
    for (name, shape) in shapes() {
        let center = rng.cube();
        let geometry = placed(&shape, rng.rotation(), center);
        let embree = accel::build(AccelKind::EMBREE, &geometry, 1).expect("Embree builds");
        let linear = LinearAccel::new(&geometry);
        let accels: [&dyn Accelerator; 2] = [&linear, &*embree];
        for i in 0..effort.pick(500, 20_000) {
            let from =
                center + rng.direction() * if i % 3 == 0 { rng.range(0.0, 1.0) } else { rng.magnitude(0.5, 4.0) };
            let Shape::Analytic(on) = geometry.shape(crate::id::ShapeId(0)) else { continue };
            let target = on.transform.point(on.shape.sample([rng.unit(), rng.unit()]).p) + 0.1 * rng.cube();
            let ray = ray_through(from, target);
            for accel in accels {
                let Some(first) = accel.intersect(&ray) else {
                    rays += 1;
                    differ.require(!accel.occluded(&ray), || format!("{name}: {ray:?} is occluded by nothing"));
                    continue;
                };
                let t = first.t;
                let ends = [(0.0, f32::INFINITY), (0.0, t), (0.0, t.next_down()), (0.0, t.next_up())];
                let starts = [t, t.next_down(), t.next_up()].map(|start| (start, f32::INFINITY));
                for (t_min, t_max) in ends.into_iter().chain(starts) {
                    let part = Ray { t_min, t_max, ..ray };
                    let hit = accel.intersect(&part);
                    rays += 1;
                    let (mut batch, mut any) = ([None; 3], [false; 3]);
                    accel.intersect_batch(&[part; 3], &mut batch, Coherence::Incoherent);
                    accel.occluded_batch(&[part; 3], &mut any, Coherence::Incoherent);
                    let describe = || format!("{name}: {part:?} has {hit:?}, {batch:?}, {any:?}; the ray {first:?}");
                    let agree =
                        accel.occluded(&part) == hit.is_some() && batch == [hit; 3] && any == [hit.is_some(); 3];
                    differ.require(agree, describe);
                    late.require(hit.is_none_or(|hit| t_min <= hit.t && hit.t <= t_max), describe);
                    // One float beyond a hit or before it leaves it inside whatever its rounding.
                    let must = t_max == t.next_up() || t_min == t.next_down();
                    let is_wrong =
                        must && hit.is_none_or(|hit| hit.t != t) || (t_max == t.next_down() && hit.is_some());
                    lost.require(!is_wrong, describe);
                }
            }
        }
    }
    Outcome::new()
        .none("closest hit, any hit and batches disagree", differ)
        .none("hits outside the interval", late)
        .none("hits lost or kept one float from the end of the interval", lost)
        .record("rays", f64::from(rays))
}

/// Points with whole coordinates on the circle of radius 65: a ray goes through such a rim itself.
const ON_CIRCLE: [[f64; 2]; 8] =
    [[65.0, 0.0], [0.0, 65.0], [16.0, 63.0], [63.0, -16.0], [-33.0, 56.0], [-25.0, -60.0], [39.0, 52.0], [-52.0, 39.0]];

/// A frustum and a disk at each end that has a radius; `at` places what is mapped and moved up by a height.
fn capped_frustum([bottom, top]: [f64; 2], height: f64, at: impl Fn(DMat3, f64) -> Transform) -> Vec<Shape> {
    let flip = DMat3::from_cols(DVec3::X, -DVec3::Y, -DVec3::Z);
    let side = Analytic::Frustum(Frustum::new(bottom, top, height, TAU).expect(VALID));
    let mut shapes = vec![Shape::Analytic(TransformedShape::new(side, at(DMat3::IDENTITY, 0.0)))];
    for (radius, linear, z) in [(bottom, flip, 0.0), (top, DMat3::IDENTITY, height)] {
        if radius > 0.0 {
            let cap = Analytic::Disk(Disk::new(radius, 0.0, TAU).expect(VALID));
            shapes.push(Shape::Analytic(TransformedShape::new(cap, at(linear, z))));
        }
    }
    shapes
}

pub(super) fn c11_capped_solids(effort: Effort) -> Outcome {
    let mut rng = Rng::new(47);
    let [mut leaks, mut at_rims, mut exact] = [const { Faults::NONE }; 3];
    for (bottom, top, height) in [(65.0, 65.0, 64.0), (65.0, 0.0, 128.0), (16.25, 65.0, 32.0)] {
        for turned in [false, true] {
            let (turn, offset) =
                if turned { (rng.rotation(), 100.0 * rng.cube()) } else { (DMat3::IDENTITY, DVec3::ZERO) };
            let geometry = world(capped_frustum([bottom, top], height, |linear, z| {
                transform(turn * linear, offset + turn * (z * DVec3::Z))
            }));
            let embree = accel::build(AccelKind::EMBREE, &geometry, 1).expect("Embree builds");
            let linear = LinearAccel::new(&geometry);
            let judge = |leaks: &mut Faults, ray: Ray| {
                let all: [&dyn Accelerator; 2] = [&*embree, &linear];
                let is_closed = all.iter().all(|a| a.intersect(&ray).is_some() && a.occluded(&ray));
                leaks.require(is_closed, || format!("radii {bottom} and {top}, height {height}: {ray:?}"));
            };
            let place = |p: DVec3| offset + turn * p;
            for i in 0..effort.pick(50_000, 1_000_000) {
                let z = height * rng.range(0.05, 0.9);
                let rho = 0.9 * (bottom + (top - bottom) * z / height) * rng.unit();
                let (sin, cos) = rng.range(0.0, TAU).sin_cos();
                let from = place(dvec3(rho * cos, rho * sin, z));
                if i % 10 > 0 {
                    judge(&mut leaks, Ray::new(from.as_vec3(), rng.direction().as_vec3()));
                    continue;
                }
                let (sin, cos) = rng.range(0.0, TAU).sin_cos();
                let (r, z) = if i % 20 == 0 { (bottom, 0.0) } else { (top, height) };
                judge(&mut at_rims, ray_through(from, place(dvec3(r * cos, r * sin, z))));
            }
            for [x, y] in ON_CIRCLE {
                for k in 1..effort.pick(20, 500) {
                    let from =
                        dvec3(0.25 * f64::from(k % 7), 0.125 * f64::from(k % 5), height * f64::from(k % 15 + 1) / 32.0);
                    for (r, z) in [(bottom, 0.0), (top, height)] {
                        let target = place(dvec3(x * r / 65.0, y * r / 65.0, z));
                        judge(&mut exact, ray_through(place(from), target));
                    }
                }
            }
        }
    }
    Outcome::new()
        .none("leaks", leaks)
        .none("leaks of rays at rims", at_rims)
        .none("leaks of rays exactly through rims", exact)
}

pub(super) fn c12_nudged_points(effort: Effort) -> Outcome {
    const NUDGE: f64 = 0.001;
    let mut rng = Rng::new(48);
    let mut hits = 0usize;
    let [mut sides, mut back, mut missed] = [const { Faults::NONE }; 3];
    for case in whole_cases().iter().filter(|case| !case.is_flat()) {
        for _ in 0..effort.pick(1_000, 50_000) {
            let geometry = placed(&case.shape, rng.rotation(), DVec3::ZERO);
            let Shape::Analytic(on) = geometry.shape(crate::id::ShapeId(0)) else { continue };
            let b = case.shape.bounds();
            let center = on.transform.point(0.5 * (b.min + b.max));
            let ray = ray_through(center + rng.direction() * 4.0 * case.size, center);
            let accel = LinearAccel::new(&geometry);
            let Some(found) = closest(&accel, &geometry, &ray).found else {
                // The middle may be seen through an open end.
                missed.require(!matches!(case.shape, Analytic::Sphere(_)), || format!("{ray:?}"));
                continue;
            };
            hits += 1;
            let inside = |p: DVec3| case.is_inside(on.transform.inverse_point(p));
            let n = found.n_g.as_dvec3();
            sides.require(inside(found.p - NUDGE * n) && !inside(found.p + NUDGE * n), || {
                format!("{}: {} with the normal {n}", case.name, found.p)
            });
            if n.dot(ray.direction.as_dvec3()) < 0.0 {
                let away = Ray::new((found.p + NUDGE * n).as_vec3(), -ray.direction);
                back.require(accel.intersect(&away).is_none(), || format!("{}: {away:?}", case.name));
            }
        }
    }
    Outcome::new()
        .none("points 1e-3 along the normal on the wrong side", sides)
        .none("rays back from outside that hit", back)
        .none("spheres missed by rays to their centre", missed)
        .at_least("hits", hits as f64, 1_000.0)
}
