//! Triangles, alone and among their neighbours.

use super::{Effort, Faults, Leavings, NAMES, Outcome, accelerators, aimed, either, leaving, point_on, seen};
use crate::accel::{Accelerator, LinearAccel};
use crate::geometry::{Mesh, Shape};
use crate::id::PrimId;
use crate::math::{DVec3, Vec3};
use crate::stability::geometry::{Rng, closest, grid, meshes, triangle};

/// Leaves the one triangle of `mesh` `directions` times, through every accelerator.
fn leave_triangle(rng: &mut Rng, mesh: Mesh, directions: usize, tally: &mut [Leavings; NAMES.len()]) {
    let size = f64::from(mesh.bounds().size().max_element());
    let n = mesh.triangle_points(PrimId(0)).cross().normalize();
    let geometry = meshes(vec![mesh.clone()]);
    for ((_, accel), tally) in accelerators(&geometry).iter().zip(tally) {
        for _ in 0..directions {
            let target = point_on(rng, &mesh, PrimId(0));
            let Some(si) = seen(&**accel, &geometry, &aimed(rng, target, n, size)) else { continue };
            let side = either(rng, si.n_g);
            let direction = leaving(rng, side);
            tally.leave(&**accel, &geometry, &si, direction, size * rng.magnitude(-3.0, 3.0));
        }
    }
}

fn report(mut outcome: Outcome, what: &str, tally: &[Leavings; NAMES.len()]) -> Outcome {
    for (name, tally) in NAMES.iter().zip(tally) {
        outcome = tally.report(outcome, &format!("{what}, {name}"));
    }
    outcome
}

pub(super) fn b1_triangles(effort: Effort) -> Outcome {
    let mut rng = Rng::new(1);
    let (count, directions) = effort.pick((300, 40), (1_000, 1_000));
    let mut even = <[Leavings; NAMES.len()]>::default();
    for _ in 0..count {
        let size = rng.magnitude(-8.0, 8.0);
        let mesh = triangle(rng.cube() * size, rng.cube() * size, rng.cube() * size);
        leave_triangle(&mut rng, mesh, directions, &mut even);
    }
    let mut wild = <[Leavings; NAMES.len()]>::default();
    for _ in 0..count {
        let mut coordinate = || rng.magnitude(-8.0, 8.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let [a, b, c] = [(); 3].map(|()| DVec3::new(coordinate(), coordinate(), coordinate()));
        leave_triangle(&mut rng, triangle(a, b, c), directions, &mut wild);
    }
    report(report(Outcome::new(), "one size", &even), "many sizes", &wild)
}

pub(super) fn b5_slivers(effort: Effort) -> Outcome {
    let mut rng = Rng::new(5);
    let mut outcome = Outcome::new();
    let (count, directions) = effort.pick((100, 60), (500, 1_000));
    for aspect in [1.0, 1e-2, 1e-4] {
        for (shape, tip) in [("flat", [0.2, 0.8]), ("needle", [0.0, aspect])] {
            let mut tally = <[Leavings; NAMES.len()]>::default();
            for _ in 0..count {
                let frame = rng.rotation() * rng.magnitude(-3.0, 3.0);
                let center = rng.cube() * rng.magnitude(-3.0, 3.0);
                let tip = DVec3::new(rng.range(tip[0], tip[1]), aspect, 0.0);
                let mut corners = [DVec3::ZERO, DVec3::X, tip].map(|p| frame * p + center);
                // Programs single out a corner.
                corners.rotate_left(rng.below(3));
                let [a, b, c] = corners;
                leave_triangle(&mut rng, triangle(a, b, c), directions, &mut tally);
            }
            let what = format!("{shape}, aspect {aspect}");
            outcome = report(outcome, &what, &tally);
            let retraces = tally[0].retraces_per_ray();
            let what = format!("{what}, embree: retraces per ray");
            outcome =
                if aspect == 1.0 { outcome.at_most(what, retraces, 0.002) } else { outcome.record(what, retraces) };
        }
    }
    outcome
}

pub(super) fn b6_neighbours(effort: Effort) -> Outcome {
    let mut rng = Rng::new(6);
    let (mut rays, mut falsely, mut occluded) = (0, Faults::NONE, Faults::NONE);
    for _ in 0..effort.pick(40, 400) {
        let aspect = rng.magnitude(-2.0, 0.0);
        let frame = rng.rotation() * rng.magnitude(-3.0, 3.0);
        // Cells with right angles, or cut into triangles with angles near 180 degrees.
        let shear = if rng.unit() < 0.5 { 0.0 } else { -0.5 };
        let (x, y) = (frame * DVec3::X, frame * DVec3::new(shear, aspect, 0.0));
        let corner = x.length() * rng.cube() * [0.0, 1.0, 100.0][rng.below(3)];
        let plane = grid(corner, x, y, 6, |_, _| 0.0);
        let n = x.cross(y).normalize();
        let geometry = meshes(vec![plane.clone()]);
        let oracle = LinearAccel::new(&geometry);
        let accels = accelerators(&geometry);
        for _ in 0..effort.pick(250, 3_000) {
            let prim = PrimId::new(rng.below(plane.triangles().len()));
            let target = point_on(&mut rng, &plane, prim);
            for (name, accel) in &accels {
                let Some(si) = seen(&**accel, &geometry, &aimed(&mut rng, target, n, x.length())) else { continue };
                let side = either(&mut rng, si.n_g);
                let ray = si.spawn(leaving(&mut rng, side).as_vec3());
                // Rounded corners make real bumps.
                if oracle.intersect(&ray).is_some() {
                    continue;
                }
                rays += 1;
                let found = closest(&**accel, &geometry, &ray).found;
                falsely.require(found.is_none(), || format!("{name}: {ray:?} from {si:?} meets {found:?}"));
                occluded.require(!accel.occluded(&ray), || format!("{name}: {ray:?} from {si:?}"));
            }
        }
    }
    let rays = f64::from(rays);
    Outcome::new()
        .at_least("rays", rays, 1_000.0)
        .at_most("fraction with a false hit", falsely.count as f64 / rays, 1e-5)
        .shown_by(&falsely)
        .at_most("fraction called occluded", occluded.count as f64 / rays, 1e-5)
        .shown_by(&occluded)
}

pub(super) fn b8_large_ground(effort: Effort) -> Outcome {
    let mut rng = Rng::new(8);
    let mut outcome = Outcome::new();
    for size in [1e4, 1e5, 1e6] {
        let frame = rng.rotation() * size;
        let [a, b, c] =
            [DVec3::new(-1.0, -0.8, 0.0), DVec3::new(1.1, -0.7, 0.0), DVec3::new(0.1, 1.2, 0.0)].map(|p| frame * p);
        let geometry = meshes(vec![triangle(a, b, c)]);
        let Shape::Mesh(ground) = &geometry.shapes[0] else { return outcome };
        let n: DVec3 = ground.triangle_points(PrimId(0)).cross().normalize();
        for (name, accel) in accelerators(&geometry) {
            let mut tally = Leavings::default();
            for _ in 0..effort.pick(10_000, 1_000_000) {
                let target = 0.01 * rng.cube();
                let Some(si) = seen(&*accel, &geometry, &aimed(&mut rng, target, n, 1.0)) else { continue };
                let side: Vec3 = either(&mut rng, si.n_g).as_vec3();
                let direction = leaving(&mut rng, side.as_dvec3());
                tally.leave(&*accel, &geometry, &si, direction, rng.magnitude(2.0, 6.0));
            }
            outcome = tally.report(outcome, &format!("size {size:e}, {name}"));
        }
    }
    outcome
}
