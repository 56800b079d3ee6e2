//! Ray cones: footprints of paths for texture filtering (Akenine-Möller et al., "Improved Shader and
//! Texture Level of Detail Using Ray Cones").
//!
//! A camera ray's cone is as wide as its pixel divided by the root of the samples per pixel: the samples share the
//! pixel, so with more of them each looks up a smaller part, and the picture converges to that of point lookups. The
//! cone keeps its spread at mirrors and glass, whose curvature does not count. At all other surfaces it spreads at
//! least as the solid angle `1 / pdf` around the direction that was chosen, again shared by the samples.

use std::f32::consts::PI;

use super::World;
use crate::geometry::{Hit, SurfaceInteraction};
use crate::math::{Ray, RayCone, Vec3};
use crate::texture::Footprint;

impl World<'_> {
    /// The footprint in uv of `ray`, whose hit led to `at`.
    #[inline(never)]
    pub(super) fn footprint(
        &self,
        cone: Option<&RayCone>,
        ray: &Ray,
        hit: Option<&Hit>,
        at: &SurfaceInteraction,
    ) -> Footprint<'_> {
        // By a rounding artefact, the ray meets another surface than that of the hit.
        let hit = hit.filter(|hit| (hit.instance, hit.shape, hit.prim) == at.ids());
        let (Some(cone), Some(hit)) = (cone, hit) else { return self.scene.texture_point(at) };
        self.covered(cone, ray.direction, at, self.scene.geometry.uv_density(ray, hit))
    }

    /// The footprint in uv of a ray in `direction` at a point of this
    /// [density of uv](crate::geometry::Geometry::uv_density).
    #[inline]
    pub(super) fn covered(
        &self,
        cone: &RayCone,
        direction: Vec3,
        at: &SurfaceInteraction,
        uv_density: f32,
    ) -> Footprint<'_> {
        self.scene
            .with_attributes(at, Footprint::of_cone(at.uv, cone.width_at(at.t), direction.dot(at.n_g), uv_density))
    }
}

/// The cone of a ray that leaves a surface, for a `share` of one over the root of the samples per pixel.
#[inline]
pub(super) fn scattered(cone: RayCone, t: f32, pdf: f32, share: f32) -> RayCone {
    RayCone { width: cone.width_at(t), spread: cone.spread.max(share / (PI * pdf).sqrt()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_spread_at_rough_surfaces_and_not_at_mirrors() {
        let cone = RayCone { width: 0.5, spread: 0.01 };
        let after = |pdf| scattered(cone, 20.0, pdf, 0.25);
        assert_eq!(after(f32::INFINITY), RayCone { width: 0.7, spread: 0.01 });
        // The middle of a diffuse lobe, and a lobe so narrow that the cone is wider.
        assert_eq!(after(1.0 / PI), RayCone { width: 0.7, spread: 0.25 });
        assert_eq!(after(1e6).spread, 0.01);
    }
}
