//! A scene with its accelerator: rays in, surface interactions out.

use super::emitter_prims::EmitterPrims;
use super::end_shapes::EndShapes;
use super::subsurface::SubsurfaceShapes;
use crate::accel::Accelerator;
use crate::color::Rgb;
use crate::geometry::{Analytic, Detail, Hit, Mesh, Shape, SurfaceInteraction};
use crate::id::{MaterialId, ShapeId};
use crate::light::{Light, MisCompensation};
use crate::material::Material;
use crate::math::float::step_past;
use crate::math::rows::whole_vectors;
use crate::math::vectorize::vectorize;
use crate::math::{Aabb, Ray, RayRows, Vec3};
use crate::scene::{Scene, Surface};

/// Most hits of a ray that are skipped as rounding artefacts. Stacks of as many coplanar surfaces do not occur.
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
    /// By shape: what depends on its parametrisation.
    parametrization: Vec<Parametrization>,
    /// Around all surfaces of media.
    pub(super) media_bounds: Aabb,
    /// By medium, whether light samples cannot reach it; see [`enclosed`](super::media::enclosed).
    pub(super) enclosed_media: Vec<bool>,
    /// Those that light enters for a random walk.
    pub(super) subsurface: SubsurfaceShapes,
    /// Emitters whose specular reflections are added without choosing among lobes.
    pub(super) emitter_prims: Option<EmitterPrims>,
    /// Lights that shadow rays to them need not be tested with; `None` if the accelerator skips none.
    pub(super) end_shapes: Option<EndShapes>,
}

impl<'a> World<'a> {
    /// A scene with its accelerator.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator) -> Self {
        let bounds = accel.bounds();
        Self {
            scene,
            accel,
            bounds,
            reach_squared: bounds.size().max_element().powi(2),
            parametrization: parametrization(scene),
            media_bounds: super::media::bounds(scene),
            enclosed_media: super::media::enclosed(scene),
            subsurface: SubsurfaceShapes::new(scene),
            emitter_prims: EmitterPrims::new(scene),
            end_shapes: EndShapes::new(scene, accel),
        }
    }

    /// How much of interactions with a shape is computed.
    #[inline]
    pub(super) fn detail(&self, shape: ShapeId) -> Detail {
        if self.parametrization[shape.index()] == Parametrization::Unused { Detail::Position } else { Detail::Full }
    }

    /// The shape if it is a mesh at rest of whose hits nothing but the point, the normals and perhaps uv is needed.
    #[inline(always)]
    pub(super) fn mesh_without_tangents(&self, shape: ShapeId) -> Option<&'a Mesh> {
        match self.scene.geometry.shape(shape) {
            Shape::Mesh(mesh)
                if !mesh.is_deforming() && self.parametrization[shape.index()] != Parametrization::Full =>
            {
                Some(mesh)
            }
            _ => None,
        }
    }

    /// Whether anything depends on the uv of a shape.
    #[inline(always)]
    pub(super) fn uses_uv(&self, shape: ShapeId) -> bool {
        self.parametrization[shape.index()] != Parametrization::Unused
    }

    /// Whether a shape is analytic and
    /// [`TransformedShape::resolve_rows`](crate::geometry::TransformedShape::resolve_rows) finds all that is needed of
    /// its hits.
    #[inline]
    pub(super) fn resolves_in_rows(&self, shape: ShapeId) -> bool {
        match self.scene.geometry.shape(shape) {
            Shape::Analytic(placed) => !self.uses_uv(shape) || matches!(placed.shape, Analytic::Quad(_)),
            Shape::Mesh(_) | Shape::Curves(_) | Shape::Points(_) => false,
        }
    }

    /// With the parametrisation of every surface, whether or not the scene needs it.
    pub fn in_full(self) -> Self {
        Self { parametrization: vec![Parametrization::Full; self.parametrization.len()], ..self }
    }

    /// The surface that a ray meets first.
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.resolve(ray, self.accel.intersect(ray))
    }

    /// The surface at the hit that the accelerator found for `ray`. A hit whose exact distance is not positive is an
    /// artefact of `f32` rounding near the ray's origin; the ray then looks again behind it.
    #[inline]
    pub fn resolve(&self, ray: &Ray, hit: Option<Hit>) -> Option<SurfaceInteraction> {
        let hit = hit?;
        let mut at = self.scene.geometry.interaction_with(self.detail(hit.shape), ray, &hit);
        if at.is_none() {
            at = self.retrace(ray, hit);
        } else if self.scene.features.normal_perturbations {
            at = at.map(|at| self.with_normal_perturbation(ray, &hit, at));
        }
        at
    }

    /// Whether camera rays pass through emitters: through those that are hidden, or through all.
    pub(super) fn skips_emitters(&self, all: bool) -> bool {
        all || self.scene.features.hidden_emitters
    }

    /// Lets `ray`, which has found `hit`, start behind the hidden emitters, or all, that it meets first. The result is
    /// its new hit and the number of rays traced.
    pub(super) fn skip_emitters(&self, ray: &mut Ray, mut hit: Option<Hit>, all: bool) -> (Option<Hit>, u64) {
        let emits = |at: &SurfaceInteraction| {
            let surface = self.scene.surface(at.shape);
            surface.hidden || (all && surface.light(at.prim).is_some())
        };
        for passed in 0..MAX_EMITTERS {
            let Some(at) = self.resolve(ray, hit).filter(emits) else {
                return (hit, passed);
            };
            ray.t_min = step_past(at.t.max(ray.t_min));
            hit = self.accel.intersect(ray);
        }
        (hit, MAX_EMITTERS)
    }

    /// With the shading normal of the surface's normal or bump map, if it has one.
    #[inline(never)]
    fn with_normal_perturbation(&self, ray: &Ray, hit: &Hit, at: SurfaceInteraction) -> SurfaceInteraction {
        let scene = self.scene;
        let Some(id) = scene.normal_perturbation(&at, ray.direction) else { return at };
        let dp_dv = scene.geometry.dp_dv(ray, hit);
        SurfaceInteraction {
            n_s: scene.normal_perturbations[id.index()].normal(&scene.geometry, &scene.textures, &at, dp_dv),
            ..at
        }
    }

    #[cold]
    fn retrace(&self, ray: &Ray, mut hit: Hit) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        for _ in 0..MAX_RETRACES {
            ray.t_min = step_past(hit.t);
            hit = self.accel.intersect(&ray)?;
            if let Some(at) = self.scene.geometry.interaction_with(self.detail(hit.shape), &ray, &hit) {
                return Some(self.with_normal_perturbation(&ray, &hit, at));
            }
        }
        None
    }

    /// Light that the surface emits towards `wo` (unit, away from it).
    pub fn emitted(&self, at: &SurfaceInteraction, wo: Vec3) -> Rgb {
        let light = self.scene.surface(at.shape).light(at.prim).map(|id| self.scene.lights.get(id));
        match light {
            Some(Light::Area(light)) => light.radiance(&self.scene.geometry, &self.scene.textures, at, wo),
            _ => Rgb::BLACK,
        }
    }

    /// Light that arrives from infinity along the unit `direction`.
    pub fn radiance_at_infinity(&self, direction: Vec3) -> Rgb {
        self.scene.lights.at_infinity().iter().fold(Rgb::BLACK, |sum, &id| {
            sum + self.scene.lights.get(id).eval_infinite(direction, MisCompensation::Off).radiance
        })
    }

    /// Moves camera rays that start far outside the scene along themselves (in `f64`) to just before the scene's box:
    /// accelerators compute in `f32` and lose as many digits as the origin is far away. Within a medium that is around
    /// everything they stay where they are.
    pub fn clip_to_scene(&self, rays: &mut RayRows, count: usize) {
        if self.scene.media.has_surroundings() {
            return;
        }
        vectorize!(clip_to_scene(self.bounds, self.reach_squared, rays, count));
    }
}

#[inline(always)]
fn clip_to_scene(bounds: Aabb, reach_squared: f32, rays: &mut RayRows, count: usize) {
    let extent = bounds.size().max_element();
    for i in 0..whole_vectors(count) {
        let origin = rays.origin.get(i);
        let nearest = origin.max(bounds.min).min(bounds.max);
        let gap_squared = (nearest - origin).length_squared();
        let gap = gap_squared.sqrt();
        // Within one box length of the scene the loss is as small as inside it. An empty box gives NaN or infinity and
        // stays here too.
        let is_far = (gap_squared > reach_squared) & (gap > extent) & (gap < f32::INFINITY);
        let (o, d) = (origin.as_dvec3(), rays.direction.get(i).as_dvec3());
        let moved = (o + d * (f64::from(gap - 0.5 * extent) / d.length())).as_vec3();
        let choose = |a: f32, b: f32| if is_far { a } else { b };
        rays.origin.set(i, Vec3::new(choose(moved.x, origin.x), choose(moved.y, origin.y), choose(moved.z, origin.z)));
    }
}

/// What depends on a shape's parametrisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Parametrization {
    /// Nothing.
    Unused,
    /// What is looked up by uv.
    Uv,
    /// Directions in the tangent plane, too.
    Full,
}

/// By shape, what depends on its parametrisation.
fn parametrization(scene: &Scene) -> Vec<Parametrization> {
    let of = |surface: &Surface| {
        let emits_evenly = surface.first_light.is_none_or(|id| match scene.lights.get(id) {
            Light::Area(light) => light.emission.texture.is_none() && light.emission.opacity.is_none(),
            _ => false,
        });
        let is_perturbed = surface.normal_perturbation.is_some() || !scene.part_normal_perturbations.is_empty();
        if is_perturbed || has_part(scene, surface.material, |material| material.flags().is_anisotropic()) {
            Parametrization::Full
        } else if emits_evenly && !has_part(scene, surface.material, Material::is_textured) {
            Parametrization::Unused
        } else {
            Parametrization::Uv
        }
    };
    scene
        .surfaces
        .iter()
        .map(|surface| if scene.features.parameters { of(surface) } else { Parametrization::Unused })
        .collect()
}

/// Whether a material or one of those that it consists of has a property.
pub(super) fn has_part(scene: &Scene, id: MaterialId, has: fn(&Material) -> bool) -> bool {
    let material = &scene.materials[id.index()];
    has(material) || material.parts().is_some_and(|parts| parts.into_iter().any(|part| has_part(scene, part, has)))
}
