//! Where the picture shows what is in the world: the inverse of the camera's rays, for motion vectors.

use std::f64::consts::{PI, TAU};

use super::{Camera, Projection};
use crate::math::{DAffine3, DVec2, DVec3, Vec2};

impl Camera {
    /// The point of a picture of `size` pixels, in pixels from its upper left corner, where the camera shows the world
    /// point `p` at the [time of a ray](crate::math::Ray::time); with a lens, the middle of where it does. `None` for
    /// what is not in front of the camera.
    pub fn film_point(&self, p: DVec3, size: [u32; 2], time: f32) -> Option<DVec2> {
        self.film_of(self.camera_from_world(time).transform_point3(p), size)
    }

    /// How many pixels of a picture of `size` pixels a unit of length at the world point `p` takes, seen face-on when
    /// the shutter opens; without end at a camera with a place.
    pub fn pixels_per_length(&self, p: DVec3, size: [u32; 2]) -> f64 {
        let (distance, height) = (self.camera_from_world(0.0).transform_point3(p).length(), f64::from(size[1]));
        match self.projection {
            Projection::Perspective { half_height, .. } => height / (2.0 * half_height * distance),
            Projection::Orthographic { half_height } => height / (2.0 * half_height),
            Projection::Environment => height / (PI * distance),
        }
    }

    /// [`film_point`](Self::film_point) of what lies infinitely far away in a direction; `None` for an orthographic
    /// camera too.
    pub fn film_direction(&self, direction: DVec3, size: [u32; 2], time: f32) -> Option<DVec2> {
        match self.projection {
            Projection::Orthographic { .. } => None,
            _ => self.film_of(self.camera_from_world(time).transform_vector3(direction), size),
        }
    }

    /// How far, in pixels to the right and down, the picture of a point moves that is at `open` when the shutter opens
    /// and at `close` when it closes. Zero where the camera does not see both; the shorter way round in an environment
    /// camera's picture.
    pub fn film_motion(&self, [open, close]: [DVec3; 2], size: [u32; 2]) -> Vec2 {
        self.way([self.film_point(open, size, 0.0), self.film_point(close, size, 1.0)], size)
    }

    /// [`film_motion`](Self::film_motion) of what lies infinitely far away in a direction: that of the camera alone.
    /// Zero for an orthographic camera.
    pub fn film_motion_at_infinity(&self, direction: DVec3, size: [u32; 2]) -> Vec2 {
        if !self.is_moving() {
            return Vec2::ZERO;
        }
        self.way([self.film_direction(direction, size, 0.0), self.film_direction(direction, size, 1.0)], size)
    }

    fn way(&self, points: [Option<DVec2>; 2], size: [u32; 2]) -> Vec2 {
        let [Some(open), Some(close)] = points else { return Vec2::ZERO };
        let mut way = close - open;
        if matches!(self.projection, Projection::Environment) {
            let width = f64::from(size[0]);
            way.x -= (way.x / width).round() * width;
        }
        if way.is_finite() { way.as_vec2() } else { Vec2::ZERO }
    }

    fn camera_from_world(&self, time: f32) -> DAffine3 {
        match &self.motion {
            None => self.world_from_camera.object_from_world,
            Some(motion) => motion.map_at(f64::from(time)).inverse(),
        }
    }

    /// The picture of a point in the camera's space.
    fn film_of(&self, local: DVec3, size: [u32; 2]) -> Option<DVec2> {
        let (width, height) = (f64::from(size[0]), f64::from(size[1]));
        let (x, y, half_height) = match self.projection {
            Projection::Perspective { half_height, .. } if local.z < 0.0 => {
                (local.x / -local.z, local.y / -local.z, half_height)
            }
            Projection::Orthographic { half_height } if local.z < 0.0 => (local.x, local.y, half_height),
            Projection::Perspective { .. } | Projection::Orthographic { .. } => return None,
            Projection::Environment => {
                let azimuth = local.x.atan2(-local.z);
                let theta = local.x.hypot(local.z).atan2(local.y);
                return (local != DVec3::ZERO).then(|| DVec2::new((azimuth / TAU + 0.5) * width, theta / PI * height));
            }
        };
        let scale = 2.0 * half_height / height;
        let [right, up] = self.framing.shift;
        Some(DVec2::new(
            x / (scale * self.framing.pixel_aspect) + (0.5 - right) * width,
            (0.5 + up) * height - y / scale,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Framing, Lens};
    use crate::math::{Motion, Transform};

    const SIZE: [u32; 2] = [300, 200];

    fn cameras() -> Vec<Camera> {
        let place =
            DAffine3::from_rotation_translation(crate::math::DQuat::from_rotation_y(0.7), DVec3::new(1.0, 2.0, 3.0));
        let later = DAffine3::from_translation(DVec3::new(0.5, -0.25, 0.1)) * place * DAffine3::from_rotation_x(0.2);
        let framing = Framing { pixel_aspect: 1.5, shift: [0.2, -0.1] };
        let projections = [
            Projection::Perspective { half_height: 0.4, lens: None },
            Projection::Orthographic { half_height: 2.0 },
            Projection::Environment,
        ];
        let moving = Motion::keyframed(&[(0.0, place), (1.0, later)]).unwrap();
        projections
            .into_iter()
            .flat_map(|projection| {
                let still =
                    Camera::new(Transform::new(place).unwrap(), projection).with_framing(framing).with_near(0.2);
                [still.clone(), still.with_motion(moving.clone()).unwrap()]
            })
            .collect()
    }

    #[test]
    fn what_a_ray_meets_is_shown_where_the_ray_starts() {
        for camera in cameras() {
            for film in [Vec2::new(10.5, 20.25), Vec2::new(150.0, 100.0), Vec2::new(290.0, 180.0)] {
                for time in [0.0, 0.4, 1.0] {
                    let ray = camera.ray(film, SIZE, [0.5; 2], time);
                    let p = ray.origin.as_dvec3() + 3.0 * ray.direction.as_dvec3();
                    let found = camera.film_point(p, SIZE, time).unwrap();
                    assert!((found - film.as_dvec2()).length() < 1e-3, "{:?} {film}: {found}", camera.projection());
                    if let Some(far) = camera.film_direction(ray.direction.as_dvec3(), SIZE, time) {
                        assert!((far - film.as_dvec2()).length() < 1e-3, "{:?} {film}: {far}", camera.projection());
                    }
                }
            }
        }
        let behind = DVec3::new(1.0, 2.0, 3.0) - cameras()[0].axis().as_dvec3();
        assert!(
            cameras()[0].film_point(behind, SIZE, 0.0).is_none()
                && cameras()[2].film_point(behind, SIZE, 0.0).is_none()
        );
        assert!(cameras()[4].film_point(behind, SIZE, 0.0).is_some());
    }

    #[test]
    fn a_lens_shows_a_point_around_where_a_pinhole_does() {
        let lens = Lens { radius: 0.3, focus_distance: 4.0, blades: None };
        let camera = Camera::new(Transform::IDENTITY, Projection::Perspective { half_height: 0.5, lens: Some(lens) });
        // In focus, all rays of a film point meet.
        let ray = camera.ray(Vec2::new(70.0, 30.0), SIZE, [0.9, 0.2], 0.0);
        let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * (4.0 / f64::from(-ray.direction.z));
        assert!((camera.film_point(p, SIZE, 0.0).unwrap() - DVec2::new(70.0, 30.0)).length() < 1e-3);
    }

    #[test]
    fn motion_is_to_the_right_and_down() {
        // A picture 2 high at distance 1: a pixel is 0.01 there.
        let camera = Camera::new(Transform::IDENTITY, Projection::Perspective { half_height: 1.0, lens: None });
        let moved = camera.film_motion([DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.1, 0.3, -2.0)], SIZE);
        assert!((moved - Vec2::new(5.0, -15.0)).length() < 1e-4, "{moved}");
        assert_eq!(camera.film_motion([DVec3::new(0.0, 0.0, -2.0), DVec3::Z], SIZE), Vec2::ZERO);
        assert_eq!(camera.film_motion_at_infinity(-DVec3::Z, SIZE), Vec2::ZERO);

        // A camera that moves to the right sees what stands still go left, and what is far away stay.
        let to_the_right =
            Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_translation(0.1 * DVec3::X))]).unwrap();
        let camera = camera.with_motion(to_the_right).unwrap();
        let moved = camera.film_motion([-DVec3::Z; 2], SIZE);
        assert!((moved - Vec2::new(-10.0, 0.0)).length() < 1e-4, "{moved}");
        assert_eq!(camera.film_motion_at_infinity(-DVec3::Z, SIZE), Vec2::ZERO);

        // One that turns to the left by 0.1 sees both go right.
        let turn = Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_rotation_y(0.1))]).unwrap();
        let turning = |projection| Camera::new(Transform::IDENTITY, projection).with_motion(turn.clone()).unwrap();
        let perspective = turning(Projection::Perspective { half_height: 1.0, lens: None });
        for moved in
            [perspective.film_motion([-5.0 * DVec3::Z; 2], SIZE), perspective.film_motion_at_infinity(-DVec3::Z, SIZE)]
        {
            assert!((f64::from(moved.x) - 100.0 * 0.1f64.tan()).abs() < 1e-3 && moved.y.abs() < 1e-4, "{moved}");
        }
        // Around the seam of a picture of everything, the shorter way.
        let everything = turning(Projection::Environment).film_motion_at_infinity(DVec3::new(0.01, 0.0, 1.0), SIZE);
        assert!(
            (f64::from(everything.x) - 300.0 * 0.1 / TAU).abs() < 1e-3 && everything.y.abs() < 1e-4,
            "{everything}"
        );
    }
}
