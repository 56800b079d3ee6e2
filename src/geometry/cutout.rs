//! Surfaces with holes: which hits count.

use std::fmt::Debug;
use std::sync::Arc;

use super::{Detail, Geometry, Hit, Shape};
use crate::id::ShapeId;
use crate::math::random::mix_32;
use crate::math::vectorize::vectorize;
use crate::math::{Ray, RayRows};

/// Opacity of surfaces, decided stochastically hit by hit during traversal.
///
/// A hit counts if a number in `[0, 1)`, hashed from the ray, the ids and the side, lies below alpha. So the result is
/// the same in any order of visits, for closest and any hits, and a ray that looks again meets the same surfaces.
pub trait AlphaMask: Debug + Send + Sync {
    /// Whether a shape has holes; [`alpha`](Self::alpha) is evaluated on no other.
    fn has_holes(&self, shape: ShapeId) -> bool;

    /// Opacity from 0 to 1 where `ray` (in the space the shape is placed in) hits it.
    fn alpha(&self, shape: &Shape, ray: &Ray, hit: &Hit) -> f32;
}

/// [`AlphaMask`] of the shapes of a [`Geometry`], or of none.
#[derive(Clone, Debug, Default)]
pub struct AlphaMasks(Option<Arc<dyn AlphaMask>>);

impl AlphaMasks {
    /// The mask of a scene's shapes.
    pub fn new(mask: Arc<dyn AlphaMask>) -> Self {
        Self(Some(mask))
    }

    /// Whether no shape has holes.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Whether this shape has holes.
    #[inline(always)]
    pub fn has_holes(&self, shape: ShapeId) -> bool {
        self.0.as_ref().is_some_and(|mask| mask.has_holes(shape))
    }

    /// The key of a world-space ray for [`counts`](Self::counts); the ends of the ray do not matter.
    #[inline(always)]
    pub fn key(&self, ray: &Ray) -> u32 {
        if self.is_empty() { 0 } else { ray_key(ray) }
    }

    /// [`key`](Self::key) for rays from the lane `first` on.
    #[inline(always)]
    pub fn set_keys(&self, rays: &RayRows, first: usize, keys: &mut [u32]) {
        if !self.is_empty() {
            vectorize!(set_ray_keys(rays, first, keys));
        }
    }

    /// Whether a hit of a world-space ray with a shape of `geometry` counts, by these masks.
    pub fn counts_in(&self, geometry: &Geometry, ray: &Ray, hit: &Hit) -> bool {
        if self.is_empty() {
            return true;
        }
        let key = self.key(ray);
        if hit.instance == Hit::NO_INSTANCE {
            return self.counts(&geometry.shapes, key, ray, hit);
        }
        self.counts(&geometry.shapes, key, &geometry.instance(hit.instance).object_ray(ray), hit)
    }

    /// Whether a hit of the ray with this key counts. `ray` is in the space the shapes are placed in; `hit` names its
    /// instance.
    #[inline(always)]
    pub fn counts(&self, shapes: &[Shape], key: u32, ray: &Ray, hit: &Hit) -> bool {
        match &self.0 {
            Some(mask) if mask.has_holes(hit.shape) => {
                let shape = &shapes[hit.shape.index()];
                is_covered(mask.alpha(shape, ray, hit), key ^ side(shape, ray, hit), hit)
            }
            _ => true,
        }
    }
}

/// Distinguishes the hits of a ray with one primitive that is no triangle, which have the same ids: it enters and
/// leaves from different sides. Distances would not do, for accelerators round them differently.
fn side(shape: &Shape, ray: &Ray, hit: &Hit) -> u32 {
    match shape {
        Shape::Mesh(_) => 0,
        _ => shape.interaction(Detail::Position, ray, hit).is_some_and(|at| at.n_g.dot(ray.direction) > 0.0).into(),
    }
}

#[inline(never)]
fn ray_key(ray: &Ray) -> u32 {
    let words = [ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z, ray.time];
    words.iter().fold(KEY_SEED, |hash, word| mix_32(hash ^ word.to_bits()))
}

/// [`ray_key`] for rays in rows.
#[inline(always)]
fn set_ray_keys(rays: &RayRows, first: usize, keys: &mut [u32]) {
    keys.fill(KEY_SEED);
    for row in rays.origin.0.iter().chain(&rays.direction.0).chain([&rays.time]) {
        for (key, word) in keys.iter_mut().zip(&row[first..]) {
            *key = mix_32(*key ^ word.to_bits());
        }
    }
}

/// Where the hashes of rays begin.
const KEY_SEED: u32 = 0x9e37_79b9;

#[inline(never)]
fn is_covered(coverage: f32, key: u32, hit: &Hit) -> bool {
    if coverage <= 0.0 || coverage >= 1.0 {
        return coverage > 0.0;
    }
    let hash = [hit.instance.0, hit.shape.0, hit.prim.0].iter().fold(key, |hash, word| mix_32(hash ^ word));
    // 24 bits fill the mantissa.
    (hash >> 8) as f32 * (1.0 / 16_777_216.0) < coverage
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::{InstanceId, PrimId};
    use crate::math::Vec3;
    use crate::math::vectorize::with_each;

    #[test]
    fn hits_count_as_often_as_the_surface_is_there() {
        for coverage in [0.0, 0.25, 0.5, 0.9, 1.0] {
            let n = 100_000;
            let counted = (0..n).filter(|&i| {
                let ray = Ray::new(Vec3::new(i as f32, 0.0, 0.0), Vec3::Z);
                let hit =
                    Hit { t: 1.0, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(i % 7), instance: InstanceId(3) };
                is_covered(coverage, ray_key(&ray), &hit)
            });
            let fraction = counted.count() as f32 / n as f32;
            // Five standard deviations: false alarm 6e-7; none where the answer is certain.
            let bound = 5.0 * (coverage * (1.0 - coverage) / n as f32).sqrt();
            assert!((fraction - coverage).abs() <= bound, "{coverage}: {fraction}");
        }
    }

    #[test]
    fn keys_in_rows_are_those_of_single_rays() {
        let rays: Vec<_> =
            (0..40).map(|i| Ray { time: 0.01 * i as f32, ..Ray::new(Vec3::splat(i as f32), Vec3::Y) }).collect();
        for keys in with_each!({
            let mut keys = [0; 16];
            set_ray_keys(&RayRows::of(&rays), 16, &mut keys);
            keys
        }) {
            assert!(keys.iter().zip(&rays[16..]).all(|(key, ray)| *key == ray_key(ray)));
        }
    }

    #[test]
    fn surfaces_along_one_ray_are_independent() {
        let n = 40_000;
        let both = (0..n).filter(|&i| {
            let key = ray_key(&Ray::new(Vec3::new(0.0, i as f32, 0.0), Vec3::Z));
            let hit = |prim| Hit {
                t: 1.0,
                u: 0.0,
                v: 0.0,
                shape: ShapeId(1),
                prim: PrimId(prim),
                instance: Hit::NO_INSTANCE,
            };
            is_covered(0.5, key, &hit(0)) && is_covered(0.5, key, &hit(1))
        });
        let fraction = both.count() as f64 / f64::from(n);
        assert!((fraction - 0.25).abs() <= 5.0 * (0.25 * 0.75 / f64::from(n)).sqrt(), "{fraction}");
    }
}
