//! Rays through many points of the film at once.

use super::{Camera, Projection};
use crate::math::Vec2;
use crate::math::rows::{BATCH, Row, Vectors};
use crate::math::vectorize::{Kernel, vectorize};

/// Points of the film and the rays through them.
#[derive(Clone, Debug)]
pub struct FilmRows {
    /// The points, in pixels from the upper left corner.
    pub film: [Row; 2],
    /// Where the rays start.
    pub origin: Vectors,
    /// Their unit directions.
    pub direction: Vectors,
}

impl Default for FilmRows {
    fn default() -> Self {
        Self { film: [[0.0; BATCH]; 2], origin: Vectors::ZERO, direction: Vectors::ZERO }
    }
}

impl Camera {
    /// Whether [`pinhole_rays`](Self::pinhole_rays) finds the rays: of a pinhole camera at rest.
    #[inline]
    pub fn is_pinhole(&self) -> bool {
        matches!(self.projection, Projection::Perspective { lens: None, .. }) && !self.is_moving()
    }

    /// The [rays](Camera::ray) through the first `count` points.
    pub fn pinhole_rays(&self, size: [u32; 2], rows: &mut FilmRows, count: usize) {
        if let Projection::Perspective { half_height, .. } = self.projection {
            vectorize(PinholeRays { camera: self, half_height, size, rows, count });
        }
    }
}

struct PinholeRays<'a> {
    camera: &'a Camera,
    half_height: f64,
    size: [u32; 2],
    rows: &'a mut FilmRows,
    count: usize,
}

impl Kernel for PinholeRays<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { camera, half_height, size, rows, count } = self;
        for i in 0..count.min(BATCH) {
            let toward = camera.on_picture(Vec2::new(rows.film[0][i], rows.film[1][i]), size, half_height);
            let start = camera.pinhole_start(toward);
            rows.origin.set(i, camera.world_from_camera.point(start).as_vec3());
            rows.direction.set(i, camera.world_from_camera.vector(toward).normalize().as_vec3());
        }
    }
}
