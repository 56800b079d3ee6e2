//! Rays through many points of the film at once.

use super::{Camera, Lens, Projection};
use crate::math::rows::{Row, pair, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{DVec3, RayRows, Vec2};
use crate::sampling::SampleRows;

/// A perspective camera's picture.
#[derive(Clone, Copy)]
pub struct Perspective {
    /// Width and height in pixels.
    size: [u32; 2],
    /// Half the height of the picture, one unit before the camera.
    half_height: f64,
    /// A lens without blades, or a pinhole.
    lens: Option<Lens>,
}

impl Camera {
    /// What [`perspective_rays`](Self::perspective_rays) needs to find the rays of a picture of `size` pixels: those of
    /// a pinhole or of a lens without blades, at rest.
    #[inline]
    pub fn perspective(&self, size: [u32; 2]) -> Option<Perspective> {
        match self.projection {
            Projection::Perspective { half_height, lens } => {
                let is_round = lens.is_none_or(|lens| lens.blades.is_none());
                (is_round && !self.is_moving()).then_some(Perspective { size, half_height, lens })
            }
            Projection::Orthographic { .. } | Projection::Environment => None,
        }
    }

    /// The [rays](Camera::ray) through the first `count` points of the `film`, in pixels from the upper left corner,
    /// from the points of the lens that the last two of their numbers choose. Their times stay as they are.
    pub fn perspective_rays(
        &self,
        picture: &Perspective,
        film: &[Row; 2],
        numbers: &SampleRows,
        rays: &mut RayRows,
        count: usize,
    ) {
        match picture.lens {
            None => vectorize!(self.set_rays(
                picture,
                film,
                #[inline(always)]
                |_, toward| (DVec3::ZERO, toward),
                rays,
                count
            )),
            Some(lens) => vectorize!(self.set_rays(
                picture,
                film,
                #[inline(always)]
                |i, toward| {
                    let [_, _, u, v] = numbers.of(i);
                    lens.through(lens.on_disk([u, v]), toward)
                },
                rays,
                count
            )),
        }
    }

    #[inline(always)]
    fn set_rays(
        &self,
        picture: &Perspective,
        film: &[Row; 2],
        through: impl Fn(usize, DVec3) -> (DVec3, DVec3),
        rays: &mut RayRows,
        count: usize,
    ) {
        for i in 0..whole_vectors(count) {
            let toward = self.on_picture(Vec2::from(pair(film, i)), picture.size, picture.half_height);
            let (from, direction) = through(i, toward);
            rays.origin.set(i, self.world_from_camera.point(self.at_near(from, direction)).as_vec3());
            rays.direction.set(i, self.world_from_camera.vector(direction).normalize().as_vec3());
            (rays.t_min[i], rays.t_max[i]) = (0.0, f32::INFINITY);
        }
    }
}
