//! How much work a ray costs.

use crate::accel::inspect::TraversalCounts;
use crate::bench::bumpy_sphere;
use crate::bench::stability::geometry::{Rng, meshes};
use crate::bench::stability::scenes::{own, path_rays};
use crate::bench::stability::{Effort, Outcome};

pub(super) fn f9_visits(effort: Effort) -> Outcome {
    let geometry = meshes(vec![bumpy_sphere(70_000)]);
    let [camera, bounce, _] = path_rays(&geometry, &mut Rng::new(37), effort.pick(4_000, 100_000));
    let mut outcome = Outcome::new();
    for (name, accel) in own(&geometry) {
        let Some(inspect) = accel.inspect() else { continue };
        for (kind, rays) in [("camera", &camera), ("bounce", &bounce)] {
            let mut counts = TraversalCounts::default();
            for ray in rays {
                inspect.intersect_counted(ray, &mut counts);
            }
            let mean = (counts.nodes + counts.prims) as f64 / rays.len() as f64;
            outcome = outcome.tell(format!("{name}, {kind} rays"), mean);
        }
    }
    outcome
}
