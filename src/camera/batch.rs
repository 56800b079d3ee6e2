//! Rays through many points of the film at once.

use super::{Camera, Projection};
use crate::math::rows::{Row, pair, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{RayRows, Vec2};

impl Camera {
    /// Whether [`pinhole_rays`](Self::pinhole_rays) finds the rays: of a pinhole camera at rest.
    #[inline]
    pub fn is_pinhole(&self) -> bool {
        matches!(self.projection, Projection::Perspective { lens: None, .. }) && !self.is_moving()
    }

    /// The [rays](Camera::ray) through the first `count` points of the `film`, in pixels from the upper left corner of
    /// a picture of `size` pixels. Their times stay as they are.
    pub fn pinhole_rays(&self, size: [u32; 2], film: &[Row; 2], rays: &mut RayRows, count: usize) {
        if let Projection::Perspective { half_height, .. } = self.projection {
            vectorize!(pinhole_rays(self, Picture { size, half_height }, film, rays, count));
        }
    }
}

/// A picture's pixels, and half its height one unit before a pinhole.
#[derive(Clone, Copy)]
struct Picture {
    size: [u32; 2],
    half_height: f64,
}

#[inline(always)]
fn pinhole_rays(camera: &Camera, picture: Picture, film: &[Row; 2], rays: &mut RayRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let toward = camera.on_picture(Vec2::from(pair(film, i)), picture.size, picture.half_height);
        let start = camera.pinhole_start(toward);
        rays.origin.set(i, camera.world_from_camera.point(start).as_vec3());
        rays.direction.set(i, camera.world_from_camera.vector(toward).normalize().as_vec3());
        (rays.t_min[i], rays.t_max[i]) = (0.0, f32::INFINITY);
    }
}
