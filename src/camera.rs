//! The perspective camera: pinhole or thin lens.

use crate::math::{DVec3, Ray, Transform, Vec2, Vec3};
use crate::sampling::warp;

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, in world units, above 0.
    pub radius: f64,
    /// Distance along the view axis of the plane in focus, above 0.
    pub focus_distance: f64,
}

/// A perspective camera that looks along its local -Z with +Y up.
#[derive(Clone, Debug)]
pub struct Camera {
    world_from_camera: Transform,
    /// Half the picture's height (or, with the aspect, width) at unit distance.
    half_height: f64,
    lens: Option<Lens>,
}

impl Camera {
    /// A camera placed by a rotation and translation; `vertical_fov` is the full angle in radians, within `(0, pi)`.
    pub fn new(world_from_camera: Transform, vertical_fov: f64, lens: Option<Lens>) -> Self {
        Self { world_from_camera, half_height: (0.5 * vertical_fov).tan(), lens }
    }

    /// The lens, if any.
    pub fn lens(&self) -> Option<&Lens> {
        self.lens.as_ref()
    }

    /// Where the camera stands.
    pub fn position(&self) -> DVec3 {
        self.world_from_camera.point(DVec3::ZERO)
    }

    /// The ray through `film`, in pixels from the upper left corner of a picture of `size` pixels, from the point of the lens that `lens_u`
    /// (in the unit square) chooses. The direction is unit.
    #[inline]
    pub fn ray(&self, film: Vec2, size: [u32; 2], lens_u: [f32; 2]) -> Ray {
        let (width, height) = (f64::from(size[0]), f64::from(size[1]));
        let scale = 2.0 * self.half_height / height;
        let toward = DVec3::new((f64::from(film.x) - 0.5 * width) * scale, (0.5 * height - f64::from(film.y)) * scale, -1.0);
        let (origin, direction) = match &self.lens {
            None => (DVec3::ZERO, toward),
            Some(lens) => {
                let disk = warp::concentric_disk(lens_u);
                let on_lens = DVec3::new(f64::from(disk.x) * lens.radius, f64::from(disk.y) * lens.radius, 0.0);
                (on_lens, toward * lens.focus_distance - on_lens)
            }
        };
        let m = &self.world_from_camera;
        Ray::new(m.point(origin).as_vec3(), m.vector(direction).normalize().as_vec3())
    }

    /// Depth of a world point along the view axis.
    #[inline]
    pub fn depth(&self, p: DVec3) -> f32 {
        -self.world_from_camera.inverse_point(p).z as f32
    }

    /// Unit view direction in the world.
    pub fn axis(&self) -> Vec3 {
        self.world_from_camera.vector(-DVec3::Z).normalize().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(lens: Option<Lens>) -> Camera {
        Camera::new(Transform::from_translation(DVec3::new(1.0, 2.0, 3.0)), std::f64::consts::FRAC_PI_2, lens)
    }

    #[test]
    fn corners_of_a_wide_picture_span_the_field_of_view() {
        let ray = camera(None).ray(Vec2::new(0.0, 0.0), [200, 100], [0.5; 2]);
        let expected = Vec3::new(-2.0, 1.0, -1.0).normalize();
        assert!((ray.direction - expected).length() < 1e-6);
        let middle = camera(None).ray(Vec2::new(100.0, 50.0), [200, 100], [0.5; 2]);
        assert!((middle.direction + Vec3::Z).length() < 1e-7);
    }

    #[test]
    fn all_rays_of_a_film_point_meet_in_focus() {
        let lens = Lens { radius: 0.3, focus_distance: 5.0 };
        let sharp = camera(None).ray(Vec2::new(30.0, 20.0), [200, 100], [0.5; 2]);
        let focus = sharp.at(5.0 / -sharp.direction.z);
        for i in 0..100 {
            let u = [(i as f32 * 0.618_034) % 1.0, i as f32 / 100.0];
            let ray = camera(Some(lens)).ray(Vec2::new(30.0, 20.0), [200, 100], u);
            assert!((ray.at(5.0 / -ray.direction.z) - focus).length() < 1e-5);
            assert!((ray.origin - Vec3::new(1.0, 2.0, 3.0)).length() <= 0.300_001);
        }
    }

    #[test]
    fn depth_is_measured_along_the_axis() {
        assert!((camera(None).depth(DVec3::new(5.0, 2.0, -4.0)) - 7.0).abs() < 1e-6);
    }
}
