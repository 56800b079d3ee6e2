//! Shapes of lights that shadow rays to them need not be tested with.

use crate::accel::{Accelerator, AnyHitRays};
use crate::light::{Light, LightSampleRows, comes_from_front};
use crate::math::rows::{BATCH, Row, Vec3Rows, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::scene::Scene;

/// By light: its shape if that is skipped by the accelerator, or [`AnyHitRays::NO_TARGET`].
pub(super) struct ShadowTargets(Vec<u32>);

impl ShadowTargets {
    /// Of a scene; `None` if the accelerator skips no shape of a light.
    pub fn new(scene: &Scene, accel: &dyn Accelerator) -> Option<Self> {
        let shape = |light: &Light| light.shadow_target(&scene.geometry).filter(|shape| accel.skips_target(*shape));
        let targets = scene.lights.lights().iter().map(|light| shape(light).map_or(AnyHitRays::NO_TARGET, |id| id.0));
        let targets: Vec<u32> = targets.collect();
        targets.iter().any(|target| *target != AnyHitRays::NO_TARGET).then_some(Self(targets))
    }

    /// The [targets](AnyHitRays::targets) of shadow rays in these directions, to the light samples of a block.
    pub fn of_samples(&self, lights: &LightSampleRows, directions: &Vec3Rows, count: usize) -> Row<u32> {
        let mut targets = [AnyHitRays::NO_TARGET; BATCH];
        for (target, &light) in targets.iter_mut().zip(&lights.light).take(count) {
            *target = self.0.get(light as usize).copied().unwrap_or(AnyHitRays::NO_TARGET);
        }
        vectorize!(remove_others(&mut targets, lights, directions, count));
        targets
    }
}

/// Removes the targets of rays that may come from behind or from within.
#[inline(always)]
fn remove_others(targets: &mut Row<u32>, lights: &LightSampleRows, directions: &Vec3Rows, count: usize) {
    for (i, target) in targets.iter_mut().enumerate().take(whole_vectors(count)) {
        let is_in_front = comes_from_front(directions.get(i), lights.direction.get(i), lights.target_n.get(i));
        *target = if is_in_front { *target } else { AnyHitRays::NO_TARGET };
    }
}
