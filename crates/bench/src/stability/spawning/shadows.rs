//! Shadow rays to emitters.

use std::f64::consts::TAU;

use super::{Effort, Faults, NAMES, Named, Outcome, accelerators, aimed, point_on, seen};
use crate::color::Rgb;
use crate::geometry::{
    Analytic, Disk, Frustum, Geometry, Mesh, Profile, Quad, Revolution, Shape, Sphere, TransformedShape,
};
use crate::id::{PrimId, ShapeId};
use crate::light::{AreaLight, Emission, LightSampleContext, ShadowTarget};
use crate::math::{DAffine3, DVec3, Transform};
use crate::stability::geometry::{Rng, grid, mesh, triangle, world};

const VALID: &str = "the emitters' parameters are valid";

/// Convex emitters within about 1 of the origin.
fn emitters() -> Vec<(&'static str, Shape)> {
    let placed = |shape| Shape::Analytic(TransformedShape::new(shape, Transform::IDENTITY));
    let spindle =
        Profile::bezier(&[[0.0, -0.9], [0.5, -0.9], [0.8, -0.4], [0.8, 0.0], [0.8, 0.4], [0.5, 0.9], [0.0, 0.9]])
            .expect(VALID);
    let corner = DVec3::new(-0.7, -0.5, 0.0);
    let (x, y) = (DVec3::X * 1.4, DVec3::Y);
    let kite = mesh(&[corner, corner + x, corner + x + 1.2 * y, corner + y], vec![[0, 1, 2], [0, 2, 3]]);
    vec![
        ("triangle", Shape::Mesh(triangle(corner, corner + x, corner + y))),
        ("rectangle of triangles", Shape::Mesh(grid(corner, x, y, 1, |_, _| 0.0))),
        ("two triangles", Shape::Mesh(kite)),
        ("quad", placed(Analytic::Quad(Quad::new(corner, x, y).expect(VALID)))),
        ("disk", placed(Analytic::Disk(Disk::new(0.8, 0.0, TAU).expect(VALID)))),
        ("ring sector", placed(Analytic::Disk(Disk::new(0.8, 0.3, 2.5).expect(VALID)))),
        ("sphere", placed(Analytic::Sphere(Sphere::full(0.8).expect(VALID)))),
        ("clipped sphere", placed(Analytic::Sphere(Sphere::new(0.8, -0.3, 0.6, 4.0).expect(VALID)))),
        ("cylinder", placed(Analytic::Frustum(Frustum::cylinder(0.5, 1.0, TAU).expect(VALID)))),
        ("cone", placed(Analytic::Frustum(Frustum::new(0.6, 0.0, 1.0, TAU).expect(VALID)))),
        ("frustum sector", placed(Analytic::Frustum(Frustum::new(0.6, 0.3, 1.0, 4.5).expect(VALID)))),
        ("revolution", placed(Analytic::Revolution(Revolution::new(&spindle, TAU).expect(VALID)))),
    ]
}

/// The shape after a further map.
fn mapped(shape: &Shape, map: DAffine3) -> Shape {
    match shape {
        Shape::Mesh(shape) => {
            let positions: Vec<DVec3> =
                shape.positions().iter().map(|p| map.transform_point3(DVec3::from_array(p.map(f64::from)))).collect();
            Shape::Mesh(mesh(&positions, shape.triangles().to_vec()))
        }
        Shape::Analytic(placed) => {
            let map = Transform::new(map * placed.transform.world_from_object).expect("the map is regular");
            Shape::Analytic(TransformedShape::new(placed.shape.clone(), map))
        }
        Shape::Curves(_) | Shape::Points(_) => unreachable!("emitters are meshes or analytic"),
    }
}

/// A floor below an emitter that is turned at random, its lowest point `distance` above.
struct Room {
    geometry: Geometry,
    floor: Mesh,
    n: DVec3,
}

impl Room {
    fn new(rng: &mut Rng, emitter: &Shape, distance: f64) -> Self {
        let turned = mapped(emitter, DAffine3 { matrix3: rng.rotation(), translation: DVec3::ZERO });
        let lowest = f64::from(turned.bounds().min.z);
        // The whole room turns, so that no plane is one of a coordinate.
        let room = DAffine3 { matrix3: rng.rotation(), translation: rng.cube() };
        let [a, b, c] =
            [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::Y].map(|p| room.transform_point3(p));
        let floor = triangle(a, b, c);
        let emitter = mapped(&turned, room * DAffine3::from_translation(DVec3::Z * (distance - lowest)));
        Self { geometry: world(vec![Shape::Mesh(floor.clone()), emitter]), floor, n: room.matrix3.z_axis }
    }
}

/// By accelerator: how many shadow rays there were, and those that are occluded.
type Tallies = [(usize, Faults); NAMES.len()];

/// Samples each light of `emitter` from the floor.
fn shadow_rays(rng: &mut Rng, emitter: &Shape, distance: f64, count: usize, tallies: &mut Tallies) {
    let room = Room::new(rng, emitter, distance);
    let lights = AreaLight::for_shape(ShapeId(1), Emission::constant(Rgb::WHITE), &room.geometry, &[]);
    let accels: Vec<Named> = accelerators(&room.geometry);
    for ((_, accel), (rays, occluded)) in accels.iter().zip(tallies) {
        for _ in 0..count {
            let target = point_on(rng, &room.floor, PrimId(0));
            let Some(si) = seen(&**accel, &room.geometry, &aimed(rng, target, room.n, (0.4 * distance).min(1.0)))
            else {
                continue;
            };
            let light = &lights[rng.below(lights.len())];
            if si.shape != ShapeId(0) {
                continue;
            }
            let Some(sample) = light.sample(&room.geometry, &[], &LightSampleContext::from_any_side(si.p), rng.pair())
            else {
                continue;
            };
            // The floor is lit from above.
            if f64::from(sample.wi.dot(si.n_g)) * si.n_g.as_dvec3().dot(room.n) < 1e-6 {
                continue;
            }
            // Of an emitter seen edge on, the rounding of its normal decides on the side.
            if let ShadowTarget::Point(target) = &sample.target
                && sample.wi.dot(target.n).abs() < 1e-6
            {
                continue;
            }
            *rays += 1;
            let ray = sample.shadow_ray(&si);
            occluded.require(!accel.occluded(&ray), || format!("{ray:?} from {si:?} to {sample:?}"));
        }
    }
}

fn report(outcome: Outcome, what: &str, tallies: Tallies) -> Outcome {
    NAMES.iter().zip(tallies).fold(outcome, |outcome, (name, (rays, occluded))| {
        outcome
            .at_least(format!("{what}, {name}: shadow rays"), rays as f64, 500.0)
            .none(format!("{what}, {name}: occluded"), occluded)
    })
}

pub(super) fn b12_emitters(effort: Effort) -> Outcome {
    let mut rng = Rng::new(12);
    emitters().iter().fold(Outcome::new(), |outcome, (name, emitter)| {
        let mut tallies = Tallies::default();
        for _ in 0..effort.pick(60, 600) {
            let distance = rng.magnitude(-3.0, 6.0);
            shadow_rays(&mut rng, emitter, distance, effort.pick(60, 300), &mut tallies);
        }
        report(outcome, name, tallies)
    })
}

pub(super) fn b15_sliver_emitters(effort: Effort) -> Outcome {
    let mut rng = Rng::new(15);
    [1e-2, 1e-4].iter().fold(Outcome::new(), |outcome, &aspect| {
        let mut tallies = Tallies::default();
        for _ in 0..effort.pick(100, 1_000) {
            let tip = DVec3::new(rng.range(0.2, 0.8), aspect, 0.0);
            let emitter = Shape::Mesh(triangle(DVec3::ZERO, DVec3::X, tip));
            let distance = rng.magnitude(-3.0, 3.0);
            shadow_rays(&mut rng, &emitter, distance, effort.pick(60, 300), &mut tallies);
        }
        report(outcome, &format!("aspect {aspect}"), tallies)
    })
}
