//! How much work a ray costs.

use crate::accel::inspect::TraversalCounts;
use crate::bumpy_sphere;
use crate::math::Ray;
use crate::stability::geometry::{Rng, meshes};
use crate::stability::scenes::{build, path_rays};
use crate::stability::{Effort, Outcome};

/// Nodes and primitives of camera and of bounce rays as recorded, to notice a change; with the most that is acceptable
/// for camera rays.
const RECORDED: [(&str, [f64; 2], f64); 4] = [
    ("bvh", [8.50, 25.0], 40.0),
    ("bvh:binary", [17.2, 48.8], 40.0),
    ("kdtree", [36.0, 96.7], 64.0),
    ("octree", [10.3, 32.7], 64.0),
];

pub(super) fn f9_visits(effort: Effort) -> Outcome {
    let geometry = meshes(vec![bumpy_sphere(70_000)]);
    let [camera, bounce, _] = path_rays(&geometry, &mut Rng::new(37), effort.pick(4_000, 100_000));
    let mut outcome = Outcome::new();
    for (name, [of_camera, of_bounce], most) in RECORDED {
        let Ok(kind) = name.parse() else { continue };
        let accel = build(kind, &geometry);
        let Some(inspect) = accel.inspect() else { continue };
        let mean = |rays: &[Ray]| {
            let mut counts = TraversalCounts::default();
            for ray in rays {
                inspect.intersect_counted(ray, &mut counts);
            }
            (counts.nodes + counts.prims) as f64 / rays.len() as f64
        };
        let (camera, bounce) = (mean(&camera), mean(&bounce));
        outcome = outcome
            .at_most(format!("{name}, camera rays"), camera, most)
            .within(format!("{name}, camera rays over the recorded figure"), camera / of_camera, 0.9, 1.1)
            .within(format!("{name}, bounce rays over the recorded figure"), bounce / of_bounce, 0.9, 1.1)
            .record(format!("{name}, bounce rays"), bounce);
    }
    outcome
}
