//! Paths through media: where the medium changes, and what is absorbed on the way.

use super::World;
use super::path::SegmentVertex;
use crate::bsdf::Bsdf;
use crate::color::Rgb;
use crate::geometry::{Hit, SurfaceInteraction};
use crate::id::ShapeId;
use crate::math::{Aabb, Ray, Vec3, vec3};
use crate::medium::{BoundaryMedia, Medium, MediumStack, RelativeIor, random_of_ray};
use crate::scene::Scene;

/// Surfaces on one straight way, at most; a way along a surface must not go on for ever.
pub(super) const MAX_SURFACES: u32 = 4096;

/// The unit direction in which the media around the camera are counted. No axis and no diagonal, where scenes have
/// their edges and poles.
const PROBE: Vec3 = vec3(0.169_031, 0.961_236, 0.217_947);

/// A path within media.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MediaState {
    /// The media that contain its end.
    pub current: MediumStack,
    /// The colour channel that it follows, once dispersion has parted them.
    pub channel: Option<usize>,
    /// At a boundary between media: the index of refraction of the inside over that of the outside.
    pub ior: Option<f32>,
    /// If its end is a point of a medium: the way there, if distances on it were chosen for lights.
    pub arrival: Option<SegmentVertex>,
    /// The same for its last vertex.
    pub departure: Option<SegmentVertex>,
}

/// The part of a ray before the first surface that scatters: up to there it passes boundaries within one medium.
pub(super) struct MediumSegment {
    /// On the ray, which starts at the last boundary that it has passed.
    pub hit: Option<Hit>,
    /// What is left of light on the way.
    pub transmittance: Rgb,
    /// Surfaces passed.
    pub passed: u32,
    /// At a boundary between media, the relative index of refraction.
    pub ior: Option<RelativeIor>,
}

/// A surface between two media.
pub(super) struct MediumBoundary {
    pub sides: BoundaryMedia,
    pub ior: RelativeIor,
}

/// A box around all surfaces of media.
pub(super) fn bounds(scene: &Scene) -> Aabb {
    if !scene.features.media {
        return Aabb::EMPTY;
    }
    bounds_of(scene, |id| scene.surface(id).medium.is_some())
}

/// Whether surfaces that bend light enclose each medium of a scene that scatters, and no light: there shadow rays never
/// arrive. Empty of scenes without such media.
pub(super) fn enclosed(scene: &Scene) -> Vec<bool> {
    if !scene.features.participating_media {
        return Vec::new();
    }
    let (media, geometry) = (&scene.media, &scene.geometry);
    let empty = Medium::clear(0);
    let is_enclosed = |medium: &Medium| {
        let id = media.id(medium);
        let mut others = media.iter().filter(|other| *other != medium).chain([&empty]);
        let is_of = |shape: ShapeId| scene.surface(shape).medium == id;
        !medium.scattering.is_black()
            && media.surroundings() != Some(medium)
            && others.all(|other| other.ior.iter().zip(medium.ior).all(|(a, b)| *a != b))
            && !(0..geometry.shapes.len()).map(ShapeId::new).any(|id| is_of(id) && scene.boundary_masks.has_holes(id))
            && !scene.lights.is_any_within(geometry, &bounds_of(scene, is_of))
    };
    media.iter().map(is_enclosed).collect()
}

/// A box around the shapes that are chosen.
pub(super) fn bounds_of(scene: &Scene, is_chosen: impl Fn(ShapeId) -> bool) -> Aabb {
    let geometry = &scene.geometry;
    let of_shapes = |ids: &[ShapeId]| {
        let chosen = ids.iter().filter(|&&id| is_chosen(id));
        chosen.fold(Aabb::EMPTY, |b, &id| b.union(&geometry.shape(id).bounds()))
    };
    geometry.instances.iter().fold(of_shapes(&geometry.world), |b, instance| {
        let inside = of_shapes(&geometry.object(instance.object).shapes);
        if inside.is_empty() { b } else { b.union(&instance.bounds(&inside)) }
    })
}

/// Whether a ray that came along `from` crosses the surface by going on along `to`; as in
/// [`Vertex::shadowing`](super::vertex::Vertex).
pub(super) fn crosses(at: &SurfaceInteraction, from: Vec3, to: Vec3) -> bool {
    let reflects = to.dot(at.n_g) * (-from).dot(at.n_g) > 0.0;
    !reflects
}

impl World<'_> {
    /// The medium's boundary that a ray meets at the surface of its hit; `None` where the surface or this point of it
    /// is none. Light passes holes without refraction.
    pub(super) fn boundary(
        &self,
        ray: &Ray,
        hit: Option<Hit>,
        at: &SurfaceInteraction,
        state: &MediaState,
    ) -> Option<MediumBoundary> {
        let medium = self.scene.surface(at.shape).medium?;
        let masks = &self.scene.boundary_masks;
        let is_hole = hit.is_some_and(|hit| !masks.counts_in(&self.scene.geometry, ray, &hit));
        if !is_hole && !self.scene.met_material(at, ray.direction).flags().transmits() {
            return None;
        }
        let sides = BoundaryMedia::new(state.current, medium, ray.direction.dot(at.n_g) < 0.0);
        let ior = if is_hole { RelativeIor::Same(1.0) } else { self.scene.media.relative_ior(&sides, state.channel) };
        Some(MediumBoundary { sides, ior })
    }

    /// The scattering at a boundary between media, if a path has arrived at one.
    #[inline(never)]
    pub(super) fn boundary_bsdf(&self, at: &SurfaceInteraction, direction: Vec3, state: &MediaState) -> Option<Bsdf> {
        let ior = state.ior?;
        self.scene.met_material(at, direction).boundary(&self.scene.textures, || self.scene.texture_point(at), ior)
    }

    /// The media beyond a surface, if a path that came along `from` crosses it by going on along `to`; else those it is
    /// in.
    pub(super) fn media_toward(
        &self,
        at: &SurfaceInteraction,
        from: Vec3,
        to: Vec3,
        current: &MediumStack,
    ) -> MediumStack {
        if at.instance == Hit::MEDIUM {
            return *current;
        }
        match self.scene.surface(at.shape).medium {
            Some(medium) if crosses(at, from, to) => {
                let is_front = from.dot(at.n_g) < 0.0;
                BoundaryMedia::new(*current, medium, is_front).beyond(is_front)
            }
            _ => *current,
        }
    }

    /// What is left of the light along a ray that meets nothing on its way, which lies within the media `current`.
    pub(super) fn transmittance(&self, current: &MediumStack, ray: &Ray) -> Rgb {
        self.scene.media.transmittance(current, ray, || random_of_ray(ray))
    }

    /// Follows `ray`, which has found `hit`, through all surfaces where light passes as if there were none.
    pub(super) fn trace_through_null_boundaries(
        &self,
        ray: &mut Ray,
        mut hit: Option<Hit>,
        state: &mut MediaState,
    ) -> MediumSegment {
        let mut transmittance = Rgb::WHITE;
        let mut passed = 0;
        loop {
            let at = self.resolve(ray, hit);
            let way = Ray { t_max: at.as_ref().map_or(f32::INFINITY, |at| at.t), ..*ray };
            transmittance *= self.transmittance(&state.current, &way);
            let boundary = at.as_ref().and_then(|at| self.boundary(ray, hit, at, state));
            let ior = boundary.as_ref().map(|boundary| boundary.ior);
            let (Some(at), Some(boundary), true) =
                (at, boundary, ior.is_some_and(|ior| ior.is_one()) && passed < MAX_SURFACES)
            else {
                return MediumSegment { hit, transmittance, passed, ior };
            };
            state.current = boundary.sides.beyond(ray.direction.dot(at.n_g) < 0.0);
            *ray = at.spawn(ray.direction);
            hit = self.accel.intersect(ray);
            passed += 1;
        }
    }

    /// The media around the start of a camera ray, by counting surfaces from there to infinity.
    pub(super) fn media_at_start(&self, ray: &Ray) -> MediumStack {
        let start = ray.at(ray.t_min);
        if !self.media_bounds.contains(start) {
            return MediumStack::default();
        }
        let mut probe = Ray { time: ray.time, ..Ray::new(start, PROBE) };
        let mut crossings = Vec::new();
        while let Some(at) = self.closest(&probe) {
            if let Some(medium) = self.scene.surface(at.shape).medium {
                crossings.push((medium, PROBE.dot(at.n_g) < 0.0));
            }
            if crossings.len() > MAX_SURFACES as usize {
                break;
            }
            probe = at.spawn(PROBE);
        }
        // On the way back from infinity, where nothing contains anything.
        crossings.iter().rev().fold(MediumStack::default(), |current, &(medium, entering)| {
            if entering { current.popped(medium) } else { current.pushed(medium) }
        })
    }
}
