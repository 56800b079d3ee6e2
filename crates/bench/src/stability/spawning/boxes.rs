//! Boxes: closed ones that must not leak, and instances of them.

use super::{Effort, Faults, Leavings, NAMES, Outcome, accelerators};
use crate::accel::{self, AccelKind, Accelerator};
use crate::geometry::{
    Analytic, Geometry, Instance, Mesh, MeshStep, Object, Shape, Sphere, SurfaceInteraction, TransformedShape,
};
use crate::id::{ObjectId, ShapeId};
use crate::math::{DAffine3, DMat3, DVec3, Motion, Ray, Transform};
use crate::stability::geometry::{Rng, closest, cube, instances, meshes, ray, ray_through, transform, world};

pub(super) fn b4_closed_boxes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(4);
    let mut outcome = Outcome::new();
    for (half, offset) in [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (1e-6, 1e-2), (1.0, 1e4), (1e6, 1e10), (1000.0, 1e7)] {
        let mut tallies = <[(usize, Faults, Faults); NAMES.len()]>::default();
        for _ in 0..4 {
            let center = DVec3::new(0.8, -0.5, 0.3) * offset;
            let geometry = meshes(vec![cube(rng.rotation() * half, center)]);
            for ((_, accel), (rays, own, leaks)) in accelerators(&geometry).iter().zip(&mut tallies) {
                for _ in 0..effort.pick(3_000, 30_000) {
                    let Some(si) = closest(&**accel, &geometry, &ray(center, rng.direction())).found else { continue };
                    let direction = rng.direction_around(-si.n_g.as_dvec3());
                    let leaving = si.spawn(direction.as_vec3());
                    let next = closest(&**accel, &geometry, &leaving).found;
                    *rays += 1;
                    leaks.require(next.is_some(), || format!("{leaving:?} from {si:?}"));
                    own.require(next.as_ref().is_none_or(|hit| hit.prim != si.prim), || {
                        format!("{leaving:?} from {si:?} meets {next:?}")
                    });
                }
            }
        }
        let allowed = if offset == 0.0 { 0.0 } else { 5e-4 };
        for (name, (rays, own, leaks)) in NAMES.iter().zip(tallies) {
            let what = format!("half size {half:e} at {offset:e}, {name}");
            outcome = outcome
                .at_least(format!("{what}: rays"), rays as f64, 0.999 * 4.0 * effort.pick(3_000.0, 30_000.0))
                .none(format!("{what}: own triangle"), own)
                .at_most(format!("{what}: fraction leaked"), leaks.count as f64 / rays as f64, allowed)
                .shown_by(&leaks);
        }
    }
    outcome
}

pub(super) fn b7_instances(effort: Effort) -> Outcome {
    let mut rng = Rng::new(7);
    let mut outcome = Outcome::new();
    for anisotropy in [1.0, 10.0, 100.0] {
        let mut tally = <[Leavings; NAMES.len()]>::default();
        for _ in 0..effort.pick(60, 600) {
            let scale = rng.magnitude(-2.0, 2.0);
            let mirror = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            let stretch = DMat3::from_diagonal(DVec3::new(
                mirror,
                rng.range(1.0, anisotropy),
                1.0 / rng.range(1.0, anisotropy).sqrt(),
            ));
            let linear = rng.rotation() * stretch * rng.rotation() * scale;
            let translation = rng.cube() * scale * rng.magnitude(-1.0, 5.0);
            let placement = transform(linear, translation);
            let geometry = instances(vec![Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO))], &[placement]);
            for ((_, accel), tally) in accelerators(&geometry).iter().zip(&mut tally) {
                for _ in 0..effort.pick(200, 2_000) {
                    let target = placement.point(rng.cube());
                    let from = target + rng.direction() * 4.0 * scale * anisotropy;
                    let Some(si) = closest(&**accel, &geometry, &ray_through(from, target)).found else { continue };
                    // Rounding may have taken the ray to a face from inside; outside is where the normal points.
                    let direction = rng.direction_around(si.n_g.as_dvec3());
                    tally.leave(&**accel, &geometry, &si, direction, scale * rng.magnitude(-1.0, 3.0));
                }
            }
        }
        let allowed = if anisotropy == 1.0 { 0.0 } else { 2e-4 };
        for (name, tally) in NAMES.iter().zip(&tally) {
            outcome = tally.report_within(outcome, &format!("anisotropy {anisotropy}, {name}"), allowed);
        }
    }
    outcome
}

/// A body with the map that places it at the time looked at.
struct Chain {
    geometry: Geometry,
    at_time: DAffine3,
}

/// A regular map with scale and shear.
fn sheared(rng: &mut Rng) -> DAffine3 {
    let stretch =
        DMat3::from_diagonal(DVec3::new(rng.magnitude(-0.5, 0.5), rng.magnitude(-0.5, 0.5), rng.magnitude(-0.5, 0.5)));
    DAffine3 { matrix3: rng.rotation() * stretch * rng.rotation(), translation: 3.0 * rng.cube() }
}

fn motion(rng: &mut Rng) -> Motion {
    // Keyframes near each other, so that no map between them is nearly singular.
    let start = sheared(rng);
    let step = DAffine3 { matrix3: DMat3::from_axis_angle(rng.direction(), 0.7) * 1.3, translation: rng.cube() };
    Motion::keyframed(&[(0.0, start), (1.0, step * start)]).expect("the keyframes are regular")
}

/// The cube that moves linearly from one map to another.
fn deforming_cube(from: DAffine3, to: DAffine3) -> Mesh {
    let at = |map: DAffine3| cube(map.matrix3, map.translation);
    let step = MeshStep { positions: at(to).positions().to_vec(), normals: None };
    at(from).deforming(vec![step]).expect("both have eight vertices")
}

fn in_instance(shape: Shape, motion: Motion, time: f64) -> Chain {
    let at_time = motion.map_at(time);
    let instance = Instance::moving(ObjectId(0), motion).expect("the motion is regular");
    let objects = vec![Object { shapes: vec![ShapeId(0)] }];
    Chain {
        geometry: Geometry { shapes: vec![shape], objects, instances: vec![instance], ..Geometry::default() },
        at_time,
    }
}

/// Twelve ways to place a cube, and half of them a sphere too.
fn chains(rng: &mut Rng, time: f64) -> Vec<Chain> {
    let unit_cube = || Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO));
    let sphere = |map: DAffine3| {
        let shape = Analytic::Sphere(Sphere::full(1.0).expect("1 is a radius"));
        Shape::Analytic(TransformedShape::new(shape, Transform::new(map).expect("the map is regular")))
    };
    let mut all = Vec::new();
    // In the world: as it is, mapped, deforming.
    let map = sheared(rng);
    all.push(Chain { geometry: world(vec![unit_cube()]), at_time: DAffine3::IDENTITY });
    all.push(Chain { geometry: world(vec![Shape::Mesh(cube(map.matrix3, map.translation))]), at_time: map });
    all.push(Chain { geometry: world(vec![sphere(map)]), at_time: map });
    let (from, to) =
        (sheared(rng), DAffine3 { matrix3: DMat3::from_diagonal(DVec3::new(0.2, 0.1, 0.3)), translation: rng.cube() });
    let to =
        DAffine3 { matrix3: from.matrix3 + from.matrix3 * to.matrix3, translation: from.translation + to.translation };
    let between = DAffine3 {
        matrix3: from.matrix3 * (1.0 - time) + to.matrix3 * time,
        translation: from.translation * (1.0 - time) + to.translation * time,
    };
    all.push(Chain { geometry: world(vec![Shape::Mesh(deforming_cube(from, to))]), at_time: between });
    // In instances: at rest, moving, and products of both.
    let (still, moving) = (Motion::constant(sheared(rng)), motion(rng));
    let other = motion(rng);
    let products = [
        still.clone(),
        moving.clone(),
        still.after(&moving),
        moving.after(&still),
        moving.after(&other),
        still.after(&moving).after(&still),
    ];
    for product in products {
        all.push(in_instance(unit_cube(), product.clone(), time));
        all.push(in_instance(sphere(DAffine3::IDENTITY), product, time));
    }
    for product in [still.clone(), moving.clone(), moving.after(&still)] {
        let mut chain = in_instance(Shape::Mesh(deforming_cube(from, to)), product, time);
        chain.at_time *= between;
        all.push(chain);
    }
    all
}

/// What rays along the normal from both sides of points have met.
#[derive(Default)]
struct Sides {
    points: usize,
    both: Faults,
    only_front: Faults,
    neither: Faults,
}

impl Sides {
    fn add(&mut self, accel: &dyn Accelerator, geometry: &Geometry, si: &SurfaceInteraction) {
        let front = si.spawn(si.n_g);
        let back = Ray { direction: si.n_g, ..si.spawn(-si.n_g) };
        let [of_front, of_back] = [front, back].map(|ray| closest(accel, geometry, &ray).found);
        let describe = || format!("{front:?} and {back:?} from {si:?} meet {of_front:?} and {of_back:?}");
        self.points += 1;
        match (of_front.is_some(), of_back.is_some()) {
            (true, true) => self.both.add(1, describe),
            (true, false) => self.only_front.add(1, describe),
            (false, false) => self.neither.add(1, describe),
            (false, true) => {}
        }
    }

    fn report(&self, outcome: Outcome, name: &str) -> Outcome {
        let all = self.points as f64;
        let only_back = self.points - self.both.count - self.only_front.count - self.neither.count;
        outcome
            .at_least(format!("{name}: points"), all, 1_000.0)
            .none(format!("{name}: both hit"), self.both.clone())
            .none(format!("{name}: only the front one hits"), self.only_front.clone())
            .at_most(format!("{name}: fraction where neither hits"), self.neither.count as f64 / all, 0.01)
            .shown_by(&self.neither)
            .at_least(format!("{name}: fraction where only the back one hits"), only_back as f64 / all, 0.99)
    }
}

pub(super) fn b3_two_sides(effort: Effort) -> Outcome {
    const TIME: f32 = 0.66;
    let mut rng = Rng::new(3);
    let mut sides = <[Sides; 2]>::default();
    for _ in 0..effort.pick(4, 40) {
        for Chain { geometry, at_time } in chains(&mut rng, f64::from(TIME)) {
            for ((kind, _), sides) in [AccelKind::ALL[0], AccelKind::ALL[1]].into_iter().zip(&mut sides) {
                let accel = accel::build(kind, &geometry, 1).expect("accelerators build");
                for _ in 0..effort.pick(100, 2_000) {
                    let target = at_time.transform_point3(0.5 * rng.cube());
                    let primary = Ray { time: TIME, ..ray_through(target + 20.0 * rng.direction(), target) };
                    let Some(si) = closest(&*accel, &geometry, &primary).found else { continue };
                    sides.add(&*accel, &geometry, &si);
                }
            }
        }
    }
    ["embree", "bvh"].iter().zip(&sides).fold(Outcome::new(), |outcome, (name, sides)| sides.report(outcome, name))
}

/// The chains that move or deform, for rays that leave outwards.
pub(super) fn moving_chains(rng: &mut Rng, time: f64) -> Vec<(Geometry, DAffine3)> {
    chains(rng, time)
        .into_iter()
        .filter(|chain| chain.geometry.is_moving())
        .map(|chain| (chain.geometry, chain.at_time))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(geometry: &Geometry) -> Box<dyn Accelerator + '_> {
        accel::build(AccelKind::EMBREE, geometry, 1).expect("Embree builds cubes")
    }

    /// Rays from a cube, traced through other scenes than it.
    #[test]
    fn rays_that_meet_too_little_or_too_much_are_counterexamples() {
        let of_cubes =
            |sizes: &[f64]| meshes(sizes.iter().map(|&size| cube(DMat3::IDENTITY * size, DVec3::ZERO)).collect());
        let geometry = of_cubes(&[1.0]);
        let ray = ray(DVec3::new(0.1, 0.2, -5.0), DVec3::Z);
        let si = closest(&*build(&geometry), &geometry, &ray).found.expect("the ray is aimed at the cube");
        let sides = |sizes: &[f64]| {
            let (other, mut sides) = (of_cubes(sizes), Sides::default());
            sides.add(&*build(&other), &other, &si);
            sides
        };
        let right = sides(&[1.0]);
        assert_eq!((right.both.count, right.only_front.count, right.neither.count), (0, 0, 0));
        assert!(sides(&[0.5]).neither.first.is_some_and(|text| text.ends_with("meet None and None")));
        assert!(sides(&[1.0, 2.0]).both.first.is_some_and(|text| text.contains("meet Some")));
    }
}
