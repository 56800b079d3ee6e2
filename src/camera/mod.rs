//! Cameras: perspective (pinhole or thin lens), orthographic, and the environment camera that sees every direction.

mod batch;
mod lens;
mod matrices;
mod project;
#[cfg(test)]
mod tests;

pub use lens::{Blades, Lens, lens_equation};

use std::f64::consts::{PI, TAU};

use crate::math::{Bounds, DVec3, Motion, Ray, RayCone, RenderSpace, Transform, Vec2, Vec3};

/// How points of the picture become directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays of a pinhole (or of each point of a lens) leave from one point.
    Perspective {
        /// Half the picture's height at unit distance: the tangent of half the vertical angle of view, above 0.
        half_height: f64,
        /// A thin lens; without it everything is in focus.
        lens: Option<Lens>,
    },
    /// All rays are parallel.
    Orthographic {
        /// Half the picture's height in world units, above 0.
        half_height: f64,
    },
    /// Every direction: columns are the azimuth about +Y, rows the angle from +Y, laid out as in environment lights
    /// (the middle of the picture is -Z, +X lies at three quarters of the width).
    Environment,
}

/// Where the picture lies in what the projection sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Width of a pixel over its height, above 0.
    pub pixel_aspect: f64,
    /// By how much of its width and height the picture is moved to the right and up, as by a lens that is moved against
    /// its film.
    pub shift: [f64; 2],
}

impl Default for Framing {
    fn default() -> Self {
        Self { pixel_aspect: 1.0, shift: [0.0; 2] }
    }
}

/// A camera that looks along its local -Z with +Y up. It is placed in the scene's [render space](RenderSpace), which is
/// the world unless [`in_render_space`](Self::in_render_space) made it another; there are its rays and the points it is
/// given.
#[derive(Clone, Debug)]
pub struct Camera {
    /// At the opening of the shutter, if the camera moves.
    world_from_camera: Transform,
    motion: Option<Box<Motion>>,
    projection: Projection,
    /// Of perspective and orthographic cameras.
    framing: Framing,
    near: f64,
    shutter: [f64; 2],
    render_space: RenderSpace,
}

impl Camera {
    /// A camera placed by a rotation and translation.
    pub fn new(world_from_camera: Transform, projection: Projection) -> Self {
        Self {
            world_from_camera,
            motion: None,
            projection,
            framing: Framing::default(),
            near: 0.0,
            shutter: [0.0, 1.0],
            render_space: RenderSpace::WORLD,
        }
    }

    /// This camera with another framing; environment cameras have none.
    #[must_use]
    pub fn with_framing(self, framing: Framing) -> Self {
        Self { framing, ..self }
    }

    /// This camera, which does not see what is nearer than `near`: in depth along the view axis, or in distance for an
    /// environment camera.
    #[must_use]
    pub fn with_near(self, near: f64) -> Self {
        Self { near, ..self }
    }

    /// This camera with another shutter interval, `open <= close`, in the scene's time.
    #[must_use]
    pub fn with_shutter(self, shutter: [f64; 2]) -> Self {
        Self { shutter, ..self }
    }

    /// This camera on the way of `motion`, which rotates and translates (and takes the place of where it stood). Its
    /// times are shares of the shutter interval; a constant one makes the camera rest. `None` if the motion is
    /// singular.
    pub fn with_motion(self, motion: Motion) -> Option<Self> {
        let world_from_camera = Transform::new(motion.map_at(0.0))?;
        let motion = motion.as_constant().is_none().then(|| Box::new(motion));
        Some(Self { world_from_camera, motion, ..self })
    }

    /// This camera, which is in the world, in a render space. `None` if that leaves no regular transform.
    pub fn in_render_space(self, space: RenderSpace) -> Option<Self> {
        if space.is_world() {
            return Some(self);
        }
        let scale = space.scale();
        let projection = match self.projection {
            Projection::Perspective { half_height, lens } => Projection::Perspective {
                half_height,
                lens: lens.map(|lens| Lens {
                    radius: lens.radius * scale,
                    focus_distance: lens.focus_distance * scale,
                    ..lens
                }),
            },
            Projection::Orthographic { half_height } => Projection::Orthographic { half_height: half_height * scale },
            Projection::Environment => Projection::Environment,
        };
        let unscale = Motion::constant(RenderSpace::unscaling(scale));
        let motion = self.motion.map(|motion| Box::new(space.place_motion(&motion).after(&unscale)));
        let world_from_camera = Transform::new(space.place_rigid(&self.world_from_camera.world_from_object))?;
        Some(Self { world_from_camera, motion, projection, near: self.near * scale, render_space: space, ..self })
    }

    /// The space in which the camera is placed.
    #[inline]
    pub fn render_space(&self) -> &RenderSpace {
        &self.render_space
    }

    /// Whether the camera moves while the shutter is open.
    pub fn is_moving(&self) -> bool {
        self.motion.is_some()
    }

    /// The projection.
    pub fn projection(&self) -> &Projection {
        &self.projection
    }

    /// The lens, if any.
    pub fn lens(&self) -> Option<&Lens> {
        match &self.projection {
            Projection::Perspective { lens, .. } => lens.as_ref(),
            Projection::Orthographic { .. } | Projection::Environment => None,
        }
    }

    /// Takes the lens away: everything is in focus.
    pub fn remove_lens(&mut self) {
        if let Projection::Perspective { lens, .. } = &mut self.projection {
            *lens = None;
        }
    }

    /// The framing; without a meaning for environment cameras.
    pub fn framing(&self) -> Framing {
        self.framing
    }

    /// When the shutter opens and closes, in the scene's time.
    pub fn shutter(&self) -> [f64; 2] {
        self.shutter
    }

    /// The [time of a ray](Ray::time) for `u` in `[0, 1)`: uniform over the shutter interval, 0 if that has no length.
    #[inline]
    pub fn time(&self, u: f32) -> f32 {
        if self.shutter[1] > self.shutter[0] { u } else { 0.0 }
    }

    /// Where the camera stands when the shutter opens.
    pub fn position(&self) -> DVec3 {
        self.world_from_camera.point(DVec3::ZERO)
    }

    /// Bounds of the places where the camera stands while the shutter is open.
    pub fn places(&self) -> Bounds {
        let local = Bounds { min: DVec3::ZERO, max: DVec3::ZERO };
        match &self.motion {
            None => local.transformed(&self.world_from_camera.world_from_object),
            Some(motion) => motion.bounds(&local),
        }
    }

    /// The ray through `film`, in pixels from the upper left corner of a picture of `size` pixels, from the point of
    /// the lens that `lens_u` (in the unit square) chooses, at a [time](Self::time). The direction is unit.
    #[inline]
    pub fn ray(&self, film: Vec2, size: [u32; 2], lens_u: [f32; 2], time: f32) -> Ray {
        let (origin, direction) = match &self.projection {
            Projection::Perspective { half_height, lens } => {
                let toward = self.on_picture(film, size, *half_height);
                let (from, direction) = match lens {
                    None => (DVec3::ZERO, toward),
                    Some(lens) => lens.through(lens.sample(lens_u), toward),
                };
                (self.at_near(from, direction), direction)
            }
            Projection::Orthographic { half_height } => {
                let from = self.on_picture(film, size, *half_height) + DVec3::Z;
                (self.at_near(from, -DVec3::Z), -DVec3::Z)
            }
            Projection::Environment => {
                let direction = everywhere(film, size);
                (DVec3::ZERO + direction * self.near, direction)
            }
        };
        let (origin, direction) = match &self.motion {
            None => (self.world_from_camera.point(origin), self.world_from_camera.vector(direction)),
            Some(motion) => moved(motion, time, origin, direction),
        };
        Ray { time, ..Ray::new(origin.as_vec3(), direction.normalize().as_vec3()) }
    }

    /// Where a ray `from` z = 0 in the camera's space starts, as far along the view axis as nothing nearer is seen.
    #[inline(always)]
    fn at_near(&self, from: DVec3, direction: DVec3) -> DVec3 {
        if self.near > 0.0 { from + direction * (self.near / -direction.z) } else { from }
    }

    /// The cone of a pixel around one of the camera's rays, which may start further along: as wide as the root of the
    /// pixel's area across the ray, without what a lens or the camera's motion adds.
    pub fn pixel_cone(&self, ray: &Ray, size: [u32; 2]) -> RayCone {
        let (width, height) = (f64::from(size[0]), f64::from(size[1]));
        let from_pinhole = |spread: f64| {
            let gone = if self.is_moving() { 0.0 } else { (ray.origin.as_dvec3() - self.position()).length() };
            RayCone { width: (spread * gone) as f32, spread: spread as f32 }
        };
        match &self.projection {
            Projection::Perspective { half_height, .. } => {
                // A pixel's solid angle shrinks with the third power of the cosine to the view axis.
                let cos = f64::from(self.axis().dot(ray.direction)).clamp(0.0, 1.0);
                from_pinhole(2.0 * half_height / height * (self.framing.pixel_aspect * cos.powi(3)).sqrt())
            }
            Projection::Orthographic { half_height } => {
                RayCone { width: (2.0 * half_height / height * self.framing.pixel_aspect.sqrt()) as f32, spread: 0.0 }
            }
            Projection::Environment => {
                let cos = f64::from(self.up().dot(ray.direction));
                from_pinhole((PI / height * TAU / width * (1.0 - cos * cos).max(0.0).sqrt()).sqrt())
            }
        }
    }

    /// The point of a picture at z = -1.
    #[inline(always)]
    fn on_picture(&self, film: Vec2, size: [u32; 2], half_height: f64) -> DVec3 {
        let (width, height) = (f64::from(size[0]), f64::from(size[1]));
        let scale = 2.0 * half_height / height;
        let [right, up] = self.framing.shift;
        let x = (f64::from(film.x) - (0.5 - right) * width) * scale * self.framing.pixel_aspect;
        let y = ((0.5 + up) * height - f64::from(film.y)) * scale;
        DVec3::new(x, y, -1.0)
    }

    /// Depth of a point in world units at the [time of a ray](Ray::time): along the view axis, or the distance from an
    /// environment camera.
    #[inline]
    pub fn depth(&self, p: DVec3, time: f32) -> f32 {
        let local = match &self.motion {
            None => self.world_from_camera.inverse_point(p),
            Some(motion) => motion.map_at(f64::from(time)).inverse().transform_point3(p),
        };
        let depth = match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => -local.z,
            Projection::Environment => local.length(),
        };
        self.render_space.world_length(depth) as f32
    }

    /// Unit view direction in the world when the shutter opens.
    pub fn axis(&self) -> Vec3 {
        self.world_from_camera.vector(-DVec3::Z).normalize().as_vec3()
    }

    /// Unit upward direction in the world, perpendicular to the view direction, when the shutter opens.
    pub fn up(&self) -> Vec3 {
        self.world_from_camera.vector(DVec3::Y).normalize().as_vec3()
    }
}

/// A point and a vector of a moving camera in the world; out of the way of cameras at rest.
#[inline(never)]
fn moved(motion: &Motion, time: f32, point: DVec3, vector: DVec3) -> (DVec3, DVec3) {
    let map = motion.map_at(f64::from(time));
    (map.transform_point3(point), map.transform_vector3(vector))
}

/// The unit direction of a point of a lat-long picture. Above the upper edge the picture goes on over the pole, as
/// filters need it.
#[inline(never)]
fn everywhere(film: Vec2, size: [u32; 2]) -> DVec3 {
    let azimuth = TAU * (f64::from(film.x) / f64::from(size[0]) - 0.5);
    let theta = PI * f64::from(film.y) / f64::from(size[1]);
    let ((sin_a, cos_a), (sin_t, cos_t)) = (azimuth.sin_cos(), theta.sin_cos());
    DVec3::new(sin_a * sin_t, cos_t, -cos_a * sin_t)
}
