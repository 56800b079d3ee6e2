//! What layers need of the first surface of a sample, and denoisers of the first one that is no mirror and no clear
//! glass.

use super::{PassContext, World};
use crate::color::Rgb;
use crate::film::{ShapeKey, SurfaceSample};
use crate::geometry::{Detail, Hit, SurfaceInteraction};
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::texture::Footprint;

/// Which parts of [`SurfaceSample`] are requested; the rest is not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceAovs {
    /// Any of depth, normals, position and the shape.
    pub geometry: bool,
    /// Surface parameters.
    pub uv: bool,
    /// Motion in the picture.
    pub motion: bool,
    /// Albedo.
    pub albedo: bool,
    /// Albedo and normal for denoisers.
    pub features: bool,
}

/// What the layers need of the place of the first surface, which `ray` meets at `at`; `hit` is what the accelerator
/// found.
pub(super) fn geometry_aovs(
    pass: &PassContext,
    surface_aovs: SurfaceAovs,
    at: &SurfaceInteraction,
    hit: Option<&Hit>,
) -> SurfaceSample {
    let (world, mut sample) = (pass.world, SurfaceSample::default());
    if surface_aovs.geometry {
        sample.depth = world.scene.camera.depth(at.p, at.time);
        sample.normal = at.n_s;
        sample.geometric_normal = at.n_g;
        sample.position = world.scene.camera.render_space().world_point(at.p).as_vec3();
        sample.visible_shape = ShapeKey { instance: at.instance.0, shape: at.shape.0 };
    }
    if surface_aovs.uv {
        sample.uv = world.uv(at, hit).to_array();
    }
    if surface_aovs.motion {
        sample.motion = pass.render.motion_of(at).to_array();
    }
    sample
}

/// What the layers need of the place where a medium scatters a camera ray.
pub(super) fn medium_aovs(pass: &PassContext, surface_aovs: SurfaceAovs, at: &SurfaceInteraction) -> SurfaceSample {
    let (camera, mut sample) = (&pass.world.scene.camera, SurfaceSample::default());
    if surface_aovs.geometry {
        sample.depth = camera.depth(at.p, at.time);
        sample.position = camera.render_space().world_point(at.p).as_vec3();
        sample.visible_shape = ShapeKey { instance: ShapeKey::MEDIUM, shape: at.shape.0 };
    }
    if surface_aovs.motion {
        sample.motion = pass.render.motion_of_point(at.p).to_array();
    }
    sample
}

/// The first surface of a camera ray.
pub(super) struct FirstSurface<'a> {
    pub ray: &'a Ray,
    /// As the accelerator found it.
    pub hit: Option<&'a Hit>,
    pub at: &'a SurfaceInteraction,
}

/// The AOVs of the first surface, for integrators that do not follow specular paths for denoising features.
pub(super) fn surface_sample<'f>(
    pass: &PassContext,
    surface_aovs: SurfaceAovs,
    FirstSurface { ray, hit, at }: FirstSurface,
    footprint: impl FnOnce() -> Footprint<'f>,
) -> SurfaceSample {
    let mut sample = geometry_aovs(pass, surface_aovs, at, hit);
    if surface_aovs.albedo || surface_aovs.features {
        sample.albedo = albedo_at(pass.world, at, ray, footprint);
    }
    if surface_aovs.features {
        let albedo = sample.albedo;
        set_features(&mut sample, Rgb::WHITE, albedo, at.n_s);
    }
    sample
}

/// What a surface scatters of the light that goes back along a ray.
pub(super) fn albedo_at<'f>(
    world: &World,
    at: &SurfaceInteraction,
    ray: &Ray,
    footprint: impl FnOnce() -> Footprint<'f>,
) -> Rgb {
    let frame = Frame::from_normal(at.n_s);
    world.scene.bsdf(at, ray.direction, footprint).albedo(frame.to_local(-ray.direction))
}

/// Sets the denoising features to the surface reached last, through mirrors and clear glass of this `throughput`.
pub(super) fn set_features(sample: &mut SurfaceSample, throughput: Rgb, albedo: Rgb, normal: Vec3) {
    sample.feature_albedo = (throughput * albedo).map(|value| value.clamp(0.0, 1.0));
    sample.feature_normal = normal;
}

impl World<'_> {
    /// Surface parameters at the point of a hit.
    fn uv(&self, at: &SurfaceInteraction, hit: Option<&Hit>) -> Vec2 {
        if self.detail(at.shape) == Detail::Position { self.scene.geometry.uv(at, hit) } else { at.uv }
    }
}
