//! Shapes of lights that shadow rays to them need not be tested with.

use crate::accel::{Accelerator, AnyHitRays};
use crate::light::{Light, LightSampleRows, comes_from_front};
use crate::math::rows::{BATCH, Row, Vec3Rows, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::scene::Scene;

/// By light: its shape if that is skipped by the accelerator, or [`AnyHitRays::NO_SHAPE`].
pub(super) struct EndShapes(Vec<u32>);

impl EndShapes {
    /// Of a scene; `None` if the accelerator skips no shape of a light.
    pub fn new(scene: &Scene, accel: &dyn Accelerator) -> Option<Self> {
        let shape = |light: &Light| light.end_shape(&scene.geometry).filter(|shape| accel.skips_end_shape(*shape));
        let ids = scene.lights.lights().iter().map(|light| shape(light).map_or(AnyHitRays::NO_SHAPE, |id| id.0));
        let shapes: Vec<u32> = ids.collect();
        shapes.iter().any(|shape| *shape != AnyHitRays::NO_SHAPE).then_some(Self(shapes))
    }

    /// The [end shapes](AnyHitRays::end_shapes) of shadow rays in these directions, to the light samples of a block.
    pub fn of_samples(&self, lights: &LightSampleRows, directions: &Vec3Rows, count: usize) -> Row<u32> {
        let mut shapes = [AnyHitRays::NO_SHAPE; BATCH];
        for (shape, &light) in shapes.iter_mut().zip(&lights.light).take(count) {
            *shape = self.0.get(light as usize).copied().unwrap_or(AnyHitRays::NO_SHAPE);
        }
        vectorize!(keep_frontal(&mut shapes, lights, directions, count));
        shapes
    }
}

/// Keeps the shapes of rays that come from the front.
#[inline(always)]
fn keep_frontal(shapes: &mut Row<u32>, lights: &LightSampleRows, directions: &Vec3Rows, count: usize) {
    for (i, shape) in shapes.iter_mut().enumerate().take(whole_vectors(count)) {
        let is_in_front = comes_from_front(directions.get(i), lights.direction.get(i), lights.target_n.get(i));
        *shape = if is_in_front { *shape } else { AnyHitRays::NO_SHAPE };
    }
}
