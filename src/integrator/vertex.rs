//! A surface point with its scattering, as one path sees it.

use std::borrow::Cow;

use super::World;
use super::shading::{adapt_shading_normal, terminator_factor, terminator_start};
use crate::bsdf::{Bsdf, BsdfEval};
use crate::geometry::SurfaceInteraction;
use crate::light::LightSampleContext;
use crate::math::{Frame, Ray, Vec3};
use crate::texture::Footprint;

/// Whether two directions are on the same side of a surface: of its shading normal, and of its geometric one.
#[derive(Clone, Copy)]
pub(super) struct HemisphereTest {
    pub in_frame: bool,
    pub in_geometry: bool,
}

impl HemisphereTest {
    /// From the cosines of both directions with the shading normal and with the geometric one.
    #[inline(always)]
    pub fn new(shading: [f32; 2], geometric: [f32; 2]) -> Self {
        Self { in_frame: shading[0] * shading[1] > 0.0, in_geometry: geometric[0] * geometric[1] > 0.0 }
    }

    /// Whether both normals agree.
    #[inline(always)]
    pub fn agrees(self) -> bool {
        self.in_frame == self.in_geometry
    }

    /// Whether the shading normal sees a reflection that the facet hides.
    #[inline(always)]
    pub fn is_below_facet(self) -> bool {
        self.in_frame && !self.in_geometry
    }
}

/// A surface point with its scattering and the frame for it.
pub(super) struct Vertex<'a> {
    pub at: &'a SurfaceInteraction,
    pub bsdf: Cow<'a, Bsdf>,
    pub frame: Frame,
    /// The direction back, in the frame.
    pub wo: Vec3,
    /// Cosine between the direction back and the geometric normal.
    cos_geometric: f32,
    /// Cosine between the shading and the geometric normal, if they differ by a normal map or a bump map.
    cos_normals: Option<f32>,
}

impl<'a> Vertex<'a> {
    /// The vertex at `at`, where `ray` arrives with `footprint`.
    #[inline(always)]
    pub fn new(
        world: &'a World,
        at: &'a SurfaceInteraction,
        ray: &Ray,
        footprint: impl FnOnce() -> Footprint<'a>,
    ) -> Self {
        let back = -ray.direction;
        let cos_geometric = back.dot(at.n_g);
        let n_s =
            if world.scene.features.shading_normals { adapt_shading_normal(back, at.n_s, at.n_g) } else { at.n_g };
        let frame = if world.scene.features.anisotropic {
            Frame::from_normal_and_tangent(n_s, at.dp_du)
        } else {
            Frame::from_normal(n_s)
        };
        let bsdf = world.scene.bsdf(at, ray.direction, footprint);
        // On a smooth mesh the factor would show the facets, for it jumps with the geometric normal.
        let is_perturbed =
            world.scene.features.normal_perturbations && world.scene.normal_perturbation(at, ray.direction).is_some();
        let cos_normals = (is_perturbed && n_s != at.n_g).then(|| n_s.dot(at.n_g));
        Self { at, bsdf, frame, wo: frame.to_local(back), cos_geometric, cos_normals }
    }

    /// The point and the side of it that light must reach.
    #[inline]
    pub fn light_context(&self) -> LightSampleContext {
        let n = if self.bsdf.flags().transmits() { Vec3::ZERO } else { self.frame.z * 1f32.copysign(self.wo.z) };
        LightSampleContext { p: self.at.p, n }
    }

    /// What the surface lets through of light from a direction, beyond its BSDF: nothing where the shading frame and
    /// the geometry disagree on its side, for it would leak through, and less where only the shading normal sees it
    /// well. 1 for most.
    #[inline]
    pub fn shadowing(&self, local: Vec3, world: Vec3) -> f32 {
        let cos = world.dot(self.at.n_g);
        let sides = HemisphereTest::new([self.wo.z, local.z], [self.cos_geometric, cos]);
        if !sides.agrees() {
            return 0.0;
        }
        match self.cos_normals {
            Some(cos_normals) if sides.in_frame => terminator_factor(cos, local.z, cos_normals),
            _ => 1.0,
        }
    }

    #[inline(always)]
    fn eval(&self, direction: Vec3) -> Option<BsdfEval> {
        let wi = self.frame.to_local(direction);
        let shadowing = self.shadowing(wi, direction);
        if shadowing == 0.0 {
            return None;
        }
        let BsdfEval { value, pdf } = self.bsdf.eval(self.wo, wi);
        (!value.is_black()).then(|| BsdfEval { value: value * shadowing, pdf })
    }

    /// What is scattered from a direction, and where a ray in that direction starts: here, or above the facet if that
    /// hides it.
    #[inline(always)]
    pub fn eval_toward(&self, world: &World, direction: Vec3) -> Option<(BsdfEval, Cow<'a, SurfaceInteraction>)> {
        match self.eval(direction) {
            Some(eval) => Some((eval, Cow::Borrowed(self.at))),
            None => self.eval_raised(world, direction).map(|(eval, start)| (eval, Cow::Owned(start))),
        }
    }

    /// What is reflected into a direction that the shading normal sees and the facet does not. `None` for other
    /// directions, and where [`terminator_start`] finds no start.
    #[inline]
    fn eval_raised(&self, world: &World, direction: Vec3) -> Option<(BsdfEval, SurfaceInteraction)> {
        let start = self.terminator_point(world, direction)?;
        Some((self.bsdf.eval(self.wo, self.frame.to_local(direction)), start))
    }

    /// Where a ray starts in a direction that the shading normal sees and the facet does not.
    #[inline]
    fn terminator_point(&self, world: &World, direction: Vec3) -> Option<SurfaceInteraction> {
        let sides = HemisphereTest::new(
            [self.wo.z, direction.dot(self.frame.z)],
            [self.cos_geometric, direction.dot(self.at.n_g)],
        );
        // Under a normal map, the factor has darkened what comes near. Where light passes, the side of the facet
        // decides the medium of a ray.
        if !sides.is_below_facet()
            || !world.scene.features.shading_normals
            || self.cos_normals.is_some()
            || self.bsdf.flags().transmits()
        {
            return None;
        }
        let (start, way) = terminator_start(world, self.at, self.light_context().n)?;
        (!world.accel.occluded(&way)).then_some(start)
    }
}
