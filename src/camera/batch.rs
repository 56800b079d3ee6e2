//! Rays through many points of the film at once.

use super::{Camera, Projection};
use crate::math::rows::{BATCH, Row, Vectors};
use crate::math::vectorize::{Kernel, vectorize};
use crate::math::{DVec3, Vec2, Vec3};

/// Points of the film, in pixels from the upper left corner, and the unit directions of the rays through them.
#[derive(Clone, Debug)]
pub struct FilmRows {
    /// The points.
    pub film: [Row; 2],
    /// The directions.
    pub direction: Vectors,
}

impl Default for FilmRows {
    fn default() -> Self {
        Self { film: [[0.0; BATCH]; 2], direction: Vectors::ZERO }
    }
}

impl Camera {
    /// Where all rays start of a pinhole camera at rest that sees everything in front of it; `None` for all others.
    #[inline]
    pub fn pinhole(&self) -> Option<Vec3> {
        let is_pinhole = matches!(self.projection, Projection::Perspective { lens: None, .. });
        (is_pinhole && self.near == 0.0 && !self.is_moving()).then(|| self.world_from_camera.point(DVec3::ZERO).as_vec3())
    }

    /// The directions of the [rays](Camera::ray) of a [pinhole](Camera::pinhole) camera through the first `count` points.
    pub fn pinhole_directions(&self, size: [u32; 2], rows: &mut FilmRows, count: usize) {
        if let Projection::Perspective { half_height, .. } = self.projection {
            vectorize(Directions { camera: self, half_height, size, rows, count });
        }
    }
}

struct Directions<'a> {
    camera: &'a Camera,
    half_height: f64,
    size: [u32; 2],
    rows: &'a mut FilmRows,
    count: usize,
}

impl Kernel for Directions<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { camera, half_height, size, rows, count } = self;
        for i in 0..count.min(BATCH) {
            let toward = camera.on_picture(Vec2::new(rows.film[0][i], rows.film[1][i]), size, half_height);
            rows.direction.set(i, camera.world_from_camera.vector(toward).normalize().as_vec3());
        }
    }
}
