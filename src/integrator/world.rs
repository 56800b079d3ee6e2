//! A scene with its accelerator: rays in, surface interactions out.

use super::cancel::Cancel;
use super::cones::Division;
use crate::accel::Accelerator;
use crate::color::Rgb;
use crate::geometry::{Detail, Hit, Shape, SurfaceInteraction};
use crate::id::MaterialId;
use crate::light::{FoundBy, Light};
use crate::material::Material;
use crate::math::float::step_past;
use crate::math::{Aabb, Ray, Vec3};
use crate::scene::{Scene, Surface};

/// How often a ray looks again behind hits that turn out to be rounding artefacts. Stacks of so many coplanar surfaces do not occur.
const MAX_RETRACES: u32 = 64;

/// Emitters in a row that a ray passes at most: it must not go on for ever.
const MAX_EMITTERS: u64 = 4096;

/// A scene and the accelerator over its geometry.
pub struct World<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The accelerator.
    pub accel: &'a dyn Accelerator,
    bounds: Aabb,
    /// Squared distance from the bounds up to which rays may start.
    reach_squared: f32,
    detail: Detail,
    /// By shape: whether nothing depends on its uv and tangents, though the scene has shapes where something does.
    skips_parameters: Vec<bool>,
    /// Of pictures of scenes with [filtered textures](crate::scene::Features::filtered_textures).
    pub(super) division: Option<Division>,
    /// Around all surfaces of media.
    pub(super) media_bounds: Aabb,
    /// Width and height of the picture in pixels, if it is part of one.
    pub(super) picture: Option<[u32; 2]>,
    /// Whether the camera sees light from infinity.
    pub(super) shows_background: bool,
    cancel: Option<&'a Cancel<'a>>,
}

impl<'a> World<'a> {
    /// A scene with its accelerator.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator) -> Self {
        let detail = if scene.features.parameters { Detail::Full } else { Detail::Place };
        let bounds = accel.bounds();
        Self {
            scene,
            accel,
            bounds,
            reach_squared: bounds.size().max_element().powi(2),
            detail,
            skips_parameters: if scene.features.parameters { shapes_without_parameters(scene) } else { Vec::new() },
            division: None,
            media_bounds: super::media::bounds(scene),
            picture: None,
            shows_background: true,
            cancel: None,
        }
    }

    /// Where the camera does not see light from infinity: the picture is transparent there.
    pub fn without_background(self) -> Self {
        Self { shows_background: false, ..self }
    }

    /// The picture's alpha where the camera sees no surface.
    #[inline]
    pub(super) fn background_alpha(&self) -> f32 {
        if self.shows_background && !self.scene.lights.at_infinity().is_empty() { 1.0 } else { 0.0 }
    }

    /// With what says that batches are to be given up.
    pub fn with_cancel(self, cancel: &'a Cancel<'a>) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// Whether the batch under way is to be given up.
    #[inline]
    pub(super) fn gives_up(&self) -> bool {
        self.cancel.is_some_and(Cancel::is_due)
    }

    /// Whether a batch was given up.
    #[inline]
    pub fn has_given_up(&self) -> bool {
        self.cancel.is_some_and(Cancel::given_up)
    }

    /// Whether places are all that is found of surfaces, without parameters.
    #[inline]
    pub(super) fn finds_places_only(&self) -> bool {
        self.detail == Detail::Place
    }

    /// With the parametrisation of every surface, whether or not the scene needs it.
    pub fn in_full(self) -> Self {
        Self { detail: Detail::Full, skips_parameters: Vec::new(), ..self }
    }

    /// The surface that a ray meets first.
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.resolve(ray, self.accel.intersect(ray))
    }

    /// The surface at the hit that the accelerator found for `ray`. A hit whose exact distance is not positive is an artefact of `f32`
    /// rounding near the ray's origin; the ray then looks again behind it.
    #[inline]
    pub fn resolve(&self, ray: &Ray, hit: Option<Hit>) -> Option<SurfaceInteraction> {
        let hit = hit?;
        let detail = if self.skips_parameters.get(hit.shape.index()) == Some(&true) { Detail::Place } else { self.detail };
        let mut at = self.scene.geometry.interaction_with(detail, ray, &hit);
        if at.is_none() {
            at = self.retrace(ray, hit);
        } else if self.scene.features.reliefs {
            at = at.map(|at| self.with_relief(ray, &hit, at));
        }
        at
    }

    /// Lets camera rays, which have found `hits`, pass all that gives off light; says how many rays that took.
    #[cold]
    pub(super) fn pass_all_emitters(&self, rays: &mut [Ray], hits: &mut [Option<Hit>]) -> u64 {
        rays.iter_mut().zip(hits).map(|(ray, hit)| self.pass_emitters(ray, hit)).sum()
    }

    /// Lets `ray`, which has found `hit`, start behind the emitters that it meets first; says how many rays that took.
    pub(super) fn pass_emitters(&self, ray: &mut Ray, hit: &mut Option<Hit>) -> u64 {
        let emits = |at: &SurfaceInteraction| self.scene.surface(at.shape).light(at.prim).is_some();
        for passed in 0..MAX_EMITTERS {
            let Some(at) = self.resolve(ray, *hit).filter(emits) else {
                return passed;
            };
            ray.t_min = step_past(at.t.max(ray.t_min));
            *hit = self.accel.intersect(ray);
        }
        MAX_EMITTERS
    }

    /// With the shading normal that the surface's relief gives, if it has one.
    #[inline(never)]
    fn with_relief(&self, ray: &Ray, hit: &Hit, at: SurfaceInteraction) -> SurfaceInteraction {
        let scene = self.scene;
        let Some(id) = scene.relief(&at, ray.direction) else { return at };
        let dp_dv = scene.geometry.dp_dv(ray, hit);
        SurfaceInteraction { n_s: scene.reliefs[id.index()].normal(&scene.geometry, &scene.textures, &at, dp_dv), ..at }
    }

    #[cold]
    fn retrace(&self, ray: &Ray, mut hit: Hit) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        for _ in 0..MAX_RETRACES {
            ray.t_min = step_past(hit.t);
            hit = self.accel.intersect(&ray)?;
            if let Some(at) = self.scene.geometry.interaction_with(self.detail, &ray, &hit) {
                return Some(self.with_relief(&ray, &hit, at));
            }
        }
        None
    }

    /// Light that the surface gives off towards `wo` (unit, away from it).
    pub fn emitted(&self, at: &SurfaceInteraction, wo: Vec3) -> Rgb {
        let light = self.scene.surface(at.shape).light(at.prim).map(|id| self.scene.lights.get(id));
        match light {
            Some(Light::Area(light)) => light.radiance(&self.scene.geometry, &self.scene.textures, at, wo),
            _ => Rgb::BLACK,
        }
    }

    /// Light that arrives from infinity along the unit `direction`.
    pub fn radiance_at_infinity(&self, direction: Vec3) -> Rgb {
        self.scene
            .lights
            .at_infinity()
            .iter()
            .fold(Rgb::BLACK, |sum, &id| sum + self.scene.lights.get(id).eval_at_infinity(direction, FoundBy::Lights).radiance)
    }

    /// A camera ray that starts far outside the scene, moved along itself (in `f64`) to just before the scene's box: accelerators compute
    /// in `f32` and lose as many digits as the origin is far away.
    #[inline]
    pub fn approach(&self, ray: Ray) -> Ray {
        let nearest = ray.origin.clamp(self.bounds.min, self.bounds.max);
        let gap_squared = (nearest - ray.origin).length_squared();
        // Within one box length of the scene the loss is as small as inside it. An empty box gives NaN or infinity and stays here too.
        if gap_squared <= self.reach_squared {
            return ray;
        }
        self.approach_distant(ray, gap_squared.sqrt())
    }

    #[inline(never)]
    fn approach_distant(&self, ray: Ray, gap: f32) -> Ray {
        let extent = self.bounds.size().max_element();
        if !(gap > extent && gap < f32::INFINITY) {
            return ray;
        }
        let origin = ray.origin.as_dvec3();
        let direction = ray.direction.as_dvec3();
        let distance = f64::from(gap - 0.5 * extent) / direction.length();
        Ray { origin: (origin + direction * distance).as_vec3(), ..ray }
    }
}

/// By shape, whether nothing depends on its uv and tangents; only analytic shapes, whose uv cost arctangents. Empty if there are none.
fn shapes_without_parameters(scene: &Scene) -> Vec<bool> {
    if !scene.features.analytic_shapes || scene.features.anisotropic || !scene.part_reliefs.is_empty() {
        return Vec::new();
    }
    let suffices = |(surface, shape): (&Surface, &Shape)| {
        let shines_evenly = surface.first_light.is_none_or(|id| match scene.lights.get(id) {
            Light::Area(light) => light.emission.texture.is_none() && light.emission.opacity.is_none(),
            _ => false,
        });
        matches!(shape, Shape::Analytic(_)) && surface.relief.is_none() && shines_evenly && is_uniform(scene, surface.material)
    };
    scene.surfaces.iter().zip(&scene.geometry.shapes).map(suffices).collect()
}

/// Whether a material scatters alike at all points and in all directions of the tangent plane.
fn is_uniform(scene: &Scene, id: MaterialId) -> bool {
    match &scene.materials[id.index()] {
        Material::Constant(bsdf) => !bsdf.is_anisotropic(),
        Material::TwoSided { front, back } => [*front, *back].into_iter().all(|id| is_uniform(scene, id)),
        Material::Varying(_) | Material::Mix { .. } => false,
    }
}
