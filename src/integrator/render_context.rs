//! The state of one render of a scene: the picture, and whether batches are to be cancelled.

use super::cancel::Cancel;
use super::cones::scattered;
use crate::geometry::SurfaceInteraction;
use crate::math::{DVec3, Ray, RayCone, Vec2, Vec3};
use crate::scene::Scene;

/// What a render adds to a scene.
#[derive(Clone, Copy, Debug)]
pub struct RenderContext<'a> {
    scene: &'a Scene,
    /// Width and height of the picture in pixels.
    size: [u32; 2],
    /// One over the root of the samples per pixel, of scenes with
    /// [filtered textures](crate::scene::SceneFeatures::filtered_textures).
    cone_share: Option<f32>,
    /// Whether the camera sees light from infinity.
    pub(super) shows_background: bool,
    cancel: Option<&'a Cancel<'a>>,
}

impl<'a> RenderContext<'a> {
    /// A picture of `size` pixels with `spp` samples each: texture lookups are filtered over the footprint of a sample.
    pub fn new(scene: &'a Scene, size: [u32; 2], spp: u32) -> Self {
        let cone_share = scene.features.filtered_textures.then(|| 1.0 / (spp.max(1) as f32).sqrt());
        Self { scene, size, cone_share, shows_background: true, cancel: None }
    }

    /// Where the camera does not see light from infinity: the picture is transparent there.
    #[must_use]
    pub fn without_background(self) -> Self {
        Self { shows_background: false, ..self }
    }

    /// With the flag that cancels batches.
    #[must_use]
    pub fn with_cancel(self, cancel: &'a Cancel<'a>) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// The picture's alpha where the camera sees no surface.
    #[inline]
    pub(super) fn background_alpha(&self) -> f32 {
        if self.shows_background && !self.scene.lights.at_infinity().is_empty() { 1.0 } else { 0.0 }
    }

    /// Whether the batch under way is to be cancelled.
    #[inline]
    pub(super) fn is_cancel_due(&self) -> bool {
        self.cancel.is_some_and(Cancel::is_due)
    }

    /// Whether a batch was cancelled.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(Cancel::is_cancelled)
    }

    /// The cone of a camera ray; `None` if no texture would make use of it.
    #[inline]
    pub(super) fn camera_cone(&self, ray: &Ray) -> Option<RayCone> {
        let share = self.cone_share?;
        let RayCone { width, spread } = self.scene.camera.pixel_cone(ray, self.size);
        Some(RayCone { width: width * share, spread: spread * share })
    }

    /// The cone of a ray that leaves a surface at the distance `t` along the ray of `cone`, in a direction chosen with
    /// density `pdf` (infinite for mirrors and glass).
    #[inline]
    pub(super) fn scattered_cone(&self, cone: RayCone, t: f32, pdf: f32) -> RayCone {
        scattered(cone, t, pdf, self.cone_share.unwrap_or(0.0))
    }

    /// How far a point of a surface moves in the picture while the shutter is open.
    pub(super) fn motion_of(&self, at: &SurfaceInteraction) -> Vec2 {
        let Scene { camera, geometry, features, .. } = self.scene;
        if features.motion { camera.film_motion(geometry.ends_of_motion(at), self.size) } else { Vec2::ZERO }
    }

    /// How far a point at rest moves in the picture while the shutter is open, in pixels to the right and down.
    pub(super) fn motion_of_point(&self, p: DVec3) -> Vec2 {
        let Scene { camera, features, .. } = self.scene;
        if features.motion { camera.film_motion([p; 2], self.size) } else { Vec2::ZERO }
    }

    /// How far what lies infinitely far away in a direction moves in the picture while the shutter is open.
    pub(super) fn motion_at_infinity(&self, direction: Vec3) -> Vec2 {
        self.scene.camera.film_motion_at_infinity(direction.as_dvec3(), self.size)
    }
}
