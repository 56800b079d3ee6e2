//! Random walks below the surfaces of materials (Chiang, Kutz and Burley, "Practical and Controllable Subsurface
//! Scattering for Production Path Tracing").
//!
//! Light enters diffusely, is scattered in a medium whose half-space has the base's colour at the point of entry, and
//! leaves diffusely where the walk first is outside of all surfaces of such materials. All other surfaces are not there
//! for it. What does not come out within [`MAX_STEPS`] is lost, and so is what leaves a box around these surfaces,
//! through a hole in one.

use super::World;
use super::media::bounds_of;
use super::participating::{DistanceSample, Track, travel};
use super::world::has_part;
use crate::color::Rgb;
use crate::geometry::{Hit, SurfaceInteraction};
use crate::id::ShapeId;
use crate::material::Material;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{Aabb, Ray, Rng, Vec3};
use crate::medium::{Medium, Subsurface};
use crate::scene::Scene;

/// Scatterings and surfaces of one walk, at most: of white light that enters a half-space, 1 in 200 goes farther.
const MAX_STEPS: u64 = 1 << 14;

/// Roulette may end a walk that has less than this left of what has entered.
const ROULETTE_BELOW: f32 = 0.5;

/// The least radius, in roundings of points: points of a walk must not be on the wrong side of its surface.
const MIN_RADIUS: f64 = 64.0;

/// Points that are so near to a surface, in roundings, are on it.
const NEAR: f64 = 4.0;

/// How far in front of the surface, in roundings, the ray starts that stands in for the last one of a walk.
const EXIT_DISTANCE: f64 = 4096.0;

/// The shapes with a random walk below their surface.
pub(super) struct SubsurfaceShapes {
    /// By shape; empty if it is below none.
    is_one: Vec<bool>,
    /// Around all of them, three times as large.
    bounds: Aabb,
}

impl SubsurfaceShapes {
    pub fn new(scene: &Scene) -> Self {
        if !scene.features.subsurface {
            return Self { is_one: Vec::new(), bounds: Aabb::EMPTY };
        }
        let has_walk = |surface: &crate::scene::Surface| has_part(scene, surface.material, Material::has_walk);
        let is_one: Vec<bool> = scene.surfaces.iter().map(has_walk).collect();
        let bounds = bounds_of(scene, |id| is_one[id.index()]);
        // A flat surface has an inside, too.
        let around = Vec3::splat(bounds.size().max_element());
        Self { is_one, bounds: Aabb { min: bounds.min - around, max: bounds.max + around } }
    }

    fn contains(&self, shape: ShapeId) -> bool {
        self.is_one[shape.index()]
    }
}

/// A path that has entered a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    medium: Medium,
    /// 1 where it has entered against the normal, else -1.
    side: f32,
    /// How near to a surface points are on it.
    near: f32,
}

/// Where a walk starts.
pub(super) struct WalkStart {
    /// From the surface, with what it meets first.
    pub ray: Ray,
    pub hit: Option<Hit>,
    /// The path's throughput.
    pub carried: Rgb,
    /// For the first scattering: the choice of a channel and the distance to it, and its direction.
    pub u: [f32; 4],
    pub random: Rng,
}

/// Where a walk leaves the surface.
pub(super) struct WalkEnd {
    /// A ray that meets the surface there from outside, and its hit.
    pub ray: Ray,
    pub hit: Hit,
    /// Factor on the path's throughput.
    pub weight: Rgb,
}

impl Walk {
    /// Into a surface of this colour, which a ray along `direction` has met.
    pub fn new(subsurface: &Subsurface, color: Rgb, at: &SurfaceInteraction, direction: Vec3) -> Self {
        let [least, near] = [MIN_RADIUS, NEAR].map(|factor| (factor * rounding(at)) as f32);
        Self { medium: subsurface.medium(color, least), side: -1f32.copysign(direction.dot(at.n_g)), near }
    }

    /// The end of a walk at a surface.
    fn end(&self, at: &SurfaceInteraction, hit: Hit, weight: Rgb) -> WalkEnd {
        let outward = at.n_g * self.side;
        let distance = EXIT_DISTANCE * rounding(at);
        let origin = (at.p + outward.as_dvec3() * distance).as_vec3();
        let (instance, shape, prim) = at.ids();
        let hit = Hit { t: distance as f32, instance, shape, prim, ..hit };
        WalkEnd { ray: Ray { time: at.time, ..Ray::new(origin, -outward) }, hit, weight }
    }
}

/// How far a point of a surface may be from where it should be.
fn rounding(at: &SurfaceInteraction) -> f64 {
    UNIT_ROUNDOFF * at.p.abs().max_element() + f64::from(at.error)
}

impl World<'_> {
    /// Follows a walk to where it leaves the surface, if it does; with the number of rays that it takes beside the
    /// first.
    pub(super) fn walk(&self, walk: &Walk, start: WalkStart) -> (Option<WalkEnd>, u64) {
        let WalkStart { mut ray, mut hit, carried, u: [u, v, mut x, mut y], mut random } = start;
        let medium = &walk.medium;
        let mut weight = Rgb::WHITE;
        let mut sample = DistanceSample::new(carried, [u, v], random.clone());
        let mut track = Track::new(&sample);
        let mut surfaces = 1;
        for traced in 0..MAX_STEPS {
            let at = self.resolve(&ray, hit);
            let distance = at.as_ref().map_or(f32::INFINITY, |at| at.t);
            if let Some(free) = travel(medium, distance, &mut sample, &mut track) {
                weight *= track.weight();
                let left = (carried * weight).max_channel() / carried.max_channel();
                if left < ROULETTE_BELOW {
                    if random.unit_f32() >= left {
                        return (None, traced);
                    }
                    weight = weight / left;
                }
                let p = match at.filter(|at| at.t - free < walk.near) {
                    Some(at) => at.spawn(-ray.direction).origin,
                    None => (ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(free)).as_vec3(),
                };
                let direction = medium.phase.sample(-ray.direction, 0.0, [x, y]).map(|sample| sample.wi);
                let Some(direction) = direction.filter(|_| self.subsurface.bounds.contains(p)) else {
                    return (None, traced);
                };
                ray = Ray { time: ray.time, ..Ray::new(p, direction) };
                sample = DistanceSample::new(carried * weight, random.pair(), random.clone());
                track = Track::new(&sample);
                [x, y] = random.pair();
            } else {
                let (Some(at), Some(met)) = (at, hit) else { return (None, traced) };
                if self.subsurface.contains(at.shape) {
                    let leaves = ray.direction.dot(at.n_g) * walk.side > 0.0;
                    surfaces += if leaves { -1 } else { 1 };
                    if surfaces == 0 {
                        return (Some(walk.end(&at, met, weight * track.weight())), traced);
                    }
                }
                ray = at.spawn(ray.direction);
            }
            ray.t_max = sample.reach(medium) + walk.near;
            hit = self.accel.intersect(&ray);
        }
        (None, MAX_STEPS)
    }
}
