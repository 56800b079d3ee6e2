//! Lights, how one is chosen, and how a direction towards it is chosen.

mod area;
mod bounds;
mod directional;
mod environment;
mod equiangular;
mod groups;
mod ies;
mod point;
mod projector;
mod queue;
mod set;
mod spot;
#[cfg(test)]
mod test_support;
mod tree;

pub use area::{AreaLight, Emission, EmittedRay};
pub(crate) use area::{placed_area, triangle_point};
pub use directional::DirectionalLight;
pub use environment::{Environment, EnvironmentMap, EnvironmentMapError, EnvironmentScratch};
pub use equiangular::{Equiangular, RaySegment};
pub use groups::LightGroups;
pub use ies::{IesLight, IesProfile};
pub use point::PointLight;
pub use projector::{Projector, TextureProjection};
pub use queue::{LightContext, LightQueries, LightQueue, LightSampleRows, light_target};
pub use set::{LightChoice, LightSelection, LightSet};
pub use spot::SpotLight;
pub use tree::LightSampleContext;

use crate::color::Rgb;
use crate::geometry::{Geometry, SpawnPoint, SurfaceInteraction};
use crate::id::ShapeId;
use crate::math::rows::soa;
use crate::math::{DVec3, Ray, Vec3};
use crate::texture::Texture;
use bounds::LightBounds;

/// A light of the scene. There may be millions of emissive triangles, so everything else is boxed where it is larger.
#[derive(Clone, Debug)]
pub enum Light {
    /// An emissive shape, or one triangle of an emissive mesh.
    Area(AreaLight),
    /// Radiant intensity from a point.
    Point(PointLight),
    /// Radiant intensity within a cone.
    Spot(Box<SpotLight>),
    /// A picture from a point.
    Projector(Box<Projector>),
    /// Radiant intensity as measured of a luminaire.
    Ies(Box<IesLight>),
    /// Light from far away within a small (or no) angle.
    Directional(Box<DirectionalLight>),
    /// Light from everywhere.
    Environment(Environment),
}

/// Whether the densities of environments are lowered for combination with BSDF sampling, which finds every direction:
/// light sampling is then concentrated where there is more light than elsewhere (Karlík et al., "MIS Compensation").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MisCompensation {
    /// For light sampling alone.
    Off,
    /// For light sampling combined with BSDF sampling.
    On,
}

/// Light from infinity along a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InfiniteLightEval {
    /// Radiance arriving.
    pub radiance: Rgb,
    /// Density per solid angle with which the light's `sample` chooses the direction.
    pub pdf: f32,
}

soa! {
    /// As [`InfiniteLightEval`].
    pub struct InfiniteLightEvalRows {
        /// Radiance arriving.
        radiance: Rgb,
        /// Density per solid angle.
        pdf: f32,
    }
}

/// Where a shadow ray ends.
#[derive(Clone, Copy, Debug)]
pub enum ShadowTarget {
    /// At a point.
    Point(SpawnPoint),
    /// Nowhere: the light is infinitely far.
    Infinity,
}

/// Light arriving at a point from a chosen direction.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub wi: Vec3,
    /// Radiance along it, without occlusion; for a delta light, irradiance perpendicular to `wi`.
    pub radiance: Rgb,
    /// Density per solid angle; 1 for a delta light. Without the probability of choosing this light.
    pub pdf: f32,
    /// Whether no other strategy can find this direction.
    pub is_delta: bool,
    /// Where the shadow ray ends.
    pub target: ShadowTarget,
}

impl LightSample {
    /// Light from infinity.
    #[inline(always)]
    fn infinite_sample(wi: Vec3, radiance: Rgb, pdf: f32) -> Self {
        Self { wi, radiance, pdf, is_delta: false, target: ShadowTarget::Infinity }
    }
}

impl LightSample {
    /// The ray from a surface to where the light comes from.
    #[inline(always)]
    pub fn shadow_ray(&self, from: &SurfaceInteraction) -> Ray {
        match &self.target {
            ShadowTarget::Point(target) => from.spawn_to(target),
            ShadowTarget::Infinity => from.spawn(self.wi),
        }
    }
}

/// Whether a shadow ray along `toward`, to a point in the direction `wi` where a light has the normal `n`, comes from
/// the front: neither rounding nor the offset of its start takes it through a flat light, or a sphere from outside.
#[inline(always)]
pub fn comes_from_front(toward: Vec3, wi: Vec3, n: Vec3) -> bool {
    /// Of the angle at the light.
    const LEAST_COSINE: f32 = 1e-3;
    (wi.dot(n) < 0.0) & (toward.dot(n) < -LEAST_COSINE * toward.length())
}

impl Light {
    /// Whether no ray ever meets this light.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Directional(light) => light.is_delta(),
            Self::Area(_) | Self::Environment(_) => false,
            Self::Point(_) | Self::Spot(_) | Self::Projector(_) | Self::Ies(_) => true,
        }
    }

    /// Whether rays that leave the scene can see this light.
    pub fn is_visible_at_infinity(&self) -> bool {
        match self {
            Self::Directional(light) => !light.is_delta(),
            Self::Environment(_) => true,
            Self::Area(_) | Self::Point(_) | Self::Spot(_) | Self::Projector(_) | Self::Ies(_) => false,
        }
    }

    /// Light that arrives along the unit direction `wi` at a ray that leaves the scene, with the density of sampling
    /// it; nothing from lights that such rays cannot see.
    #[inline]
    pub fn eval_infinite(&self, wi: Vec3, compensation: MisCompensation) -> InfiniteLightEval {
        match self {
            Self::Environment(light) => light.eval(wi, compensation),
            Self::Directional(light) => light.eval(wi),
            Self::Area(_) | Self::Point(_) | Self::Spot(_) | Self::Projector(_) | Self::Ies(_) => {
                InfiniteLightEval::default()
            }
        }
    }

    /// Whether the light stands infinitely far away.
    pub fn is_at_infinity(&self) -> bool {
        matches!(self, Self::Directional(_) | Self::Environment(_))
    }

    /// The analytic shape on which shadow rays to the light end, and that they hit nowhere before if they
    /// [come from its front](comes_from_front).
    pub fn end_shape(&self, geometry: &Geometry) -> Option<ShapeId> {
        if let Self::Area(light) = self { light.end_shape(geometry) } else { None }
    }

    /// Light that arrives from a chosen direction, `u` in the unit square; `None` where nothing can arrive.
    #[inline]
    pub fn sample(
        &self,
        geometry: &Geometry,
        textures: &[Texture],
        from: &LightSampleContext,
        u: [f32; 2],
        compensation: MisCompensation,
    ) -> Option<LightSample> {
        let p = from.p;
        match self {
            Self::Area(light) => light.sample(geometry, textures, from, u),
            Self::Point(light) => light.sample(p),
            Self::Spot(light) => light.sample(textures, p),
            Self::Projector(light) => light.sample(textures, p),
            Self::Ies(light) => light.sample(p),
            Self::Directional(light) => light.sample(u),
            Self::Environment(light) => light.sample(u, compensation),
        }
    }

    /// As [`AreaLight::side_factor`].
    pub fn side_factor(&self, from: &LightSampleContext, q: DVec3) -> f32 {
        if let Self::Area(light) = self { light.side_factor(from, q) } else { 1.0 }
    }

    /// Where the light is and how it shines; `None` for lights at infinity and those that do not shine.
    fn bounds(&self, geometry: &Geometry) -> Option<LightBounds> {
        match self {
            Self::Area(light) => light.bounds(geometry),
            Self::Point(light) => light.bounds(),
            Self::Spot(light) => light.bounds(),
            Self::Projector(light) => light.bounds(),
            Self::Ies(light) => light.bounds(),
            Self::Directional(_) | Self::Environment(_) => None,
        }
    }

    /// Emitted power in watts per unit of the radiance's bandwidth, as luminance; `scene_radius` bounds the scene for
    /// lights at infinity.
    pub fn power(&self, scene_radius: f64) -> f64 {
        match self {
            Self::Area(light) => light.power(),
            Self::Point(light) => light.power(),
            Self::Spot(light) => light.power(),
            Self::Projector(light) => light.power(),
            Self::Ies(light) => light.power(),
            Self::Directional(light) => light.power(scene_radius),
            Self::Environment(light) => light.power(scene_radius),
        }
    }

    /// The part of [`power`](Self::power) that sampling this light is to find.
    fn sampled_power(&self, scene_radius: f64, compensation: MisCompensation) -> f64 {
        match self {
            Self::Environment(light) => light.sampled_power(scene_radius, compensation),
            _ => self.power(scene_radius),
        }
    }
}
