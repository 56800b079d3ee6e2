//! Analytic shapes, and surfaces in a row.

use std::f64::consts::TAU;

use super::{Effort, Faults, Leavings, NAMES, Outcome, accelerators, leaving};
use crate::accel::{self, AccelKind, Accelerator};
use crate::geometry::{Analytic, Disk, Frustum, Geometry, Profile, Quad, Revolution, Shape, Sphere, TransformedShape};
use crate::math::float::step_past;
use crate::math::{DVec3, Ray, Transform};
use crate::stability::geometry::{Rng, closest, grid, ray, ray_through, transform, world};

const VALID: &str = "the shapes' parameters are valid";

/// A convex shape of about this size, with a point inside; flat ones have none, and two sides.
fn convex(rng: &mut Rng, kind: usize, size: f64) -> (Analytic, Option<DVec3>) {
    let phi = if rng.unit() < 0.5 { TAU } else { rng.range(0.3, TAU) };
    let frustum = |bottom: f64, top: f64, height: f64| {
        (Analytic::Frustum(Frustum::new(bottom, top, height, phi).expect(VALID)), Some(DVec3::Z * 0.5 * height))
    };
    match kind {
        0 => (Analytic::Sphere(Sphere::full(size).expect(VALID)), Some(DVec3::ZERO)),
        1 => {
            let (low, high) = (rng.range(-1.0, 0.0), rng.range(0.1, 1.0));
            (Analytic::Sphere(Sphere::new(size, low * size, high * size, phi).expect(VALID)), Some(DVec3::ZERO))
        }
        2 => frustum(size, size, size * rng.range(0.2, 2.0)),
        3 => frustum(size, 0.0, size * rng.range(0.2, 2.0)),
        4 => frustum(size, size * rng.range(0.1, 0.9), size * rng.range(0.2, 2.0)),
        5 => {
            // Round and convex, from pole to pole.
            let (flat, tall) = (rng.range(0.3, 1.0) * size, rng.range(0.5, 1.5) * size);
            let profile = [
                [0.0, -tall],
                [0.55 * flat, -tall],
                [flat, -0.55 * tall],
                [flat, 0.0],
                [flat, 0.55 * tall],
                [0.55 * flat, tall],
                [0.0, tall],
            ];
            let profile = Profile::bezier(&profile).expect(VALID);
            (Analytic::Revolution(Revolution::new(&profile, phi).expect(VALID)), Some(DVec3::ZERO))
        }
        6 => (Analytic::Disk(Disk::new(size, rng.range(0.0, 0.8) * size, phi).expect(VALID)), None),
        _ => (Analytic::Quad(Quad::new(size * rng.cube(), size * rng.cube(), size * rng.cube()).expect(VALID)), None),
    }
}

const CONVEX: [&str; 8] =
    ["sphere", "partial sphere", "cylinder", "cone", "frustum", "surface of revolution", "disk", "quad"];

/// The direction out of the shape at the unit normal `n` of its point `p`.
fn outward(rng: &mut Rng, p: DVec3, n: DVec3, inside: Option<DVec3>) -> DVec3 {
    let flip = match inside {
        Some(inside) => n.dot(p - inside) < 0.0,
        None => rng.unit() < 0.5,
    };
    if flip { -n } else { n }
}

pub(super) fn b2_convex_shapes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(2);
    let mut outcome = Outcome::new();
    for (kind, what) in CONVEX.into_iter().enumerate() {
        let mut tally = <[Leavings; NAMES.len()]>::default();
        for _ in 0..effort.pick(100, 1_000) {
            let size = rng.magnitude(-4.0, 4.0);
            let (shape, inside) = convex(&mut rng, kind, size);
            let scale = rng.magnitude(-4.0, 4.0);
            let sign = |rng: &mut Rng| if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            let mut translation = || rng.magnitude(-8.0, 8.0) * sign(&mut rng);
            let translation = DVec3::new(translation(), translation(), translation());
            let placement = transform(rng.rotation() * scale, translation);
            let inside = inside.map(|p| placement.point(p));
            let geometry = world(vec![Shape::Analytic(TransformedShape::new(shape.clone(), placement))]);
            let reach = size * scale;
            for ((_, accel), tally) in accelerators(&geometry).iter().zip(&mut tally) {
                // Several rays leave each point.
                for _ in 0..effort.pick(8, 100) {
                    let sample = shape.sample([rng.unit(), rng.unit()]);
                    let (p, n) = (placement.point(sample.p), placement.normal(sample.n).normalize());
                    let away = outward(&mut rng, p, n, inside);
                    let from = p + (rng.direction() + 1.5 * away).normalize() * reach * rng.magnitude(-1.0, 3.0);
                    let Some(si) = closest(&**accel, &geometry, &ray_through(from, p)).found else { continue };
                    let away = outward(&mut rng, si.p, si.n_g.as_dvec3(), inside);
                    for _ in 0..10 {
                        let direction = leaving(&mut rng, away);
                        tally.leave(&**accel, &geometry, &si, direction, reach * rng.magnitude(-2.0, 4.0));
                    }
                }
            }
        }
        for (name, tally) in NAMES.iter().zip(&tally) {
            outcome = tally.report(outcome, &format!("{what}, {name}"));
        }
    }
    outcome
}

/// The square of half size `half` at height `z`, as analytic shape and as two triangles.
fn squares(half: f64, z: f64) -> [Shape; 2] {
    let corner = DVec3::new(-half, -half, z);
    let quad = Quad::new(corner, 2.0 * half * DVec3::X, 2.0 * half * DVec3::Y).expect(VALID);
    let grid = grid(corner, 2.0 * half * DVec3::X, 2.0 * half * DVec3::Y, 1, |_, _| 0.0);
    [Shape::Analytic(TransformedShape::new(Analytic::Quad(quad), Transform::IDENTITY)), Shape::Mesh(grid)]
}

pub(super) fn b9_quads(effort: Effort) -> Outcome {
    let mut rng = Rng::new(9);
    let (mut rays, mut again, mut occluded) = (0, Faults::NONE, Faults::NONE);
    for i in 0..effort.pick(100, 2_000) {
        // At height 0 the rounding of the point to f32 gives no distance.
        let (half, z) = (rng.magnitude(-2.0, 3.0), if i % 4 == 0 { 0.0 } else { rng.range(-400.0, 400.0) });
        for shape in squares(half, z) {
            let geometry = world(vec![shape]);
            for (name, accel) in accelerators(&geometry) {
                for _ in 0..100 {
                    let target = DVec3::new(half * rng.range(-1.0, 1.0), half * rng.range(-1.0, 1.0), z);
                    let primary = ray_through(target + half * rng.direction() * rng.magnitude(-1.0, 2.0), target);
                    let Some(si) = closest(&*accel, &geometry, &primary).found else { continue };
                    let on = si.spawn(primary.direction);
                    rays += 1;
                    again.require(closest(&*accel, &geometry, &on).found.is_none(), || format!("{name}: {on:?}"));
                    occluded.require(!accel.occluded(&on), || format!("{name}: {on:?}"));
                }
            }
        }
    }
    Outcome::new()
        .at_least("rays", f64::from(rays), 10_000.0)
        .none("found again", again)
        .none("called occluded", occluded)
}

/// The shapes that a ray meets when it goes on from the float after each hit.
fn met(accel: &dyn Accelerator, ray: &Ray, limit: usize) -> Vec<u32> {
    let mut ray = *ray;
    let next = || {
        let hit = accel.intersect(&ray)?;
        ray.t_min = step_past(hit.t);
        Some(hit.shape.0)
    };
    std::iter::from_fn(next).take(limit).collect()
}

pub(super) fn b11_continue(effort: Effort) -> Outcome {
    const COUNT: usize = 64;
    let mut rng = Rng::new(11);
    let mut outcome = Outcome::new();
    // Far enough apart for any arithmetic, and at four floats between 2 and 4.
    for (spacing, what) in [(1.0, "1 apart"), (4.0 * f64::from(f32::EPSILON) * 2.0, "4 floats apart")] {
        let planes: Vec<[Shape; 2]> = (0..COUNT).map(|i| squares(100.0, 2.0 + spacing * i as f64)).collect();
        let [analytic, triangles]: [Geometry; 2] =
            [0, 1].map(|k| world(planes.iter().map(|pair| pair[k].clone()).collect()));
        for (geometry, shapes) in [(analytic, "quads"), (triangles, "triangles")] {
            for (kind, name) in AccelKind::ALL {
                let accel = accel::build(kind, &geometry, 1).expect("accelerators build");
                let mut wrong = Faults::NONE;
                for _ in 0..effort.pick(100, 5_000) {
                    // Close planes are met straight on, where distances are their heights.
                    let across = if spacing < 1.0 { DVec3::ZERO } else { 0.5 * rng.cube() * (DVec3::X + DVec3::Y) };
                    let from = 10.0 * rng.cube() * (DVec3::X + DVec3::Y);
                    let ray = ray(from, DVec3::Z + across);
                    let order = met(&*accel, &ray, 2 * COUNT);
                    wrong.require(order.iter().copied().eq(0..COUNT as u32), || format!("{ray:?} meets {order:?}"));
                }
                outcome = outcome.none(format!("{shapes} {what}, {name}: rays that miss one or meet one twice"), wrong);
            }
        }
    }
    outcome
}
