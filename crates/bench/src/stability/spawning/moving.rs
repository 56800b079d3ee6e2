//! Bodies that move while the shutter is open.

use super::boxes::moving_chains;
use super::{Effort, Leavings, Outcome, leaving};
use crate::accel::{self, AccelKind};
use crate::math::Ray;
use crate::stability::geometry::{Rng, closest, ray_through};

pub(super) fn b14_moving(effort: Effort) -> Outcome {
    let mut rng = Rng::new(14);
    let mut tally: [Leavings; AccelKind::ALL.len()] = Default::default();
    for round in 0..effort.pick(8, 80) {
        let time = if round % 2 == 0 { 0.66 } else { rng.unit_f32() };
        for (geometry, at_time) in moving_chains(&mut rng, f64::from(time)) {
            for ((kind, _), tally) in AccelKind::ALL.into_iter().zip(&mut tally) {
                let accel = accel::build(kind, &geometry, 1).expect("accelerators build");
                for _ in 0..effort.pick(50, 1_000) {
                    let target = at_time.transform_point3(0.5 * rng.cube());
                    let primary = Ray { time, ..ray_through(target + 20.0 * rng.direction(), target) };
                    let Some(si) = closest(&*accel, &geometry, &primary).found else { continue };
                    let direction = leaving(&mut rng, si.n_g.as_dvec3());
                    tally.leave(&*accel, &geometry, &si, direction, rng.magnitude(-2.0, 2.0));
                }
            }
        }
    }
    AccelKind::ALL.iter().zip(&tally).fold(Outcome::new(), |outcome, ((_, name), tally)| tally.report(outcome, name))
}
