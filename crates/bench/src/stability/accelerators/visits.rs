//! How much work a ray costs.

use crate::accel::inspect::TraversalCounts;
use crate::bumpy_sphere;
use crate::math::{DVec3, Ray};
use crate::stability::geometry::{Rng, grid, meshes};
use crate::stability::scenes::{own, path_rays};
use crate::stability::{Effort, Faults, Outcome};

/// The most nodes and primitives of camera and of bounce rays on the mean.
const MOST: [(&str, [f64; 2]); 5] = [
    ("bvh", [15.0, 40.0]),
    ("bvh:binary", [40.0, 128.0]),
    ("kdtree", [64.0, 128.0]),
    ("kdtree:median", [160.0, 320.0]),
    ("octree", [64.0, 96.0]),
];

/// Those of the mesh alone as recorded, to notice a change.
const RECORDED: [(&str, [f64; 2]); 4] =
    [("bvh", [8.50, 25.0]), ("bvh:binary", [17.2, 48.8]), ("kdtree", [36.0, 96.7]), ("octree", [10.3, 32.7])];

/// The entry of a table.
fn of<T: Copy>(table: &[(&str, T)], name: &str) -> Option<T> {
    table.iter().find(|(entry, _)| *entry == name).map(|(_, value)| *value)
}

pub(super) fn f9_visits(effort: Effort) -> Outcome {
    let mesh = || bumpy_sphere(70_000);
    // Trees that halve space or require every half to be smaller do not get through a small mesh on a large floor.
    let floor = grid(DVec3::new(-20.0, -20.0, -1.5), 40.0 * DVec3::X, 40.0 * DVec3::Y, 1, |_, _| 0.0);
    let scenes = [("alone", meshes(vec![mesh()])), ("on a floor", meshes(vec![mesh(), floor]))];
    // At the mesh, not at the floor.
    let [camera, bounce, _] = path_rays(&scenes[0].1, &mut Rng::new(37), effort.pick(4_000, 100_000));
    let (mut outcome, mut differ) = (Outcome::new(), Faults::NONE);
    for (place, geometry) in &scenes {
        for (name, accel) in own(geometry) {
            let (Some(most), Some(inspect)) = (of(&MOST, name), accel.inspect()) else { continue };
            let mut mean = |rays: &[Ray]| {
                let mut counts = TraversalCounts::default();
                for ray in rays {
                    let found = inspect.intersect_counted(ray, &mut counts);
                    differ.require(found == accel.intersect(ray), || format!("{name}: {ray:?} has {found:?}"));
                }
                (counts.nodes + counts.prims) as f64 / rays.len() as f64
            };
            let found = [mean(&camera), mean(&bounce)];
            for (i, kind) in ["camera rays", "bounce rays"].into_iter().enumerate() {
                outcome = outcome.at_most(format!("{name}, {kind}, {place}"), found[i], most[i]);
                if let Some(recorded) = of(&RECORDED, name).filter(|_| *place == "alone") {
                    let what = format!("{name}, {kind} over the recorded figure");
                    outcome = outcome.within(what, found[i] / recorded[i], 0.9, 1.1);
                }
            }
        }
    }
    outcome.none("counted answers that differ from those not counted", differ)
}
