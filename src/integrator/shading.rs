//! Shading normals that differ from the surface's own, on smooth meshes and under normal maps: no reflection below the
//! surface, and under normal maps no hard edge where the surface turns away from the light.

use super::World;
use crate::geometry::{SpawnPoint, SurfaceInteraction};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{Ray, Vec3};

/// The least cosine to the surface that a mirror reflection keeps, unless the incoming direction itself is shallower.
const LEAST_REFLECTION: f32 = 0.01;

/// The shading normal `n_s`, turned just as far that what is reflected like by a mirror leaves on the side of the
/// geometric normal `n_g` where it came from (Keller et al., "The Iray Light Transport Simulation and Rendering
/// System", section 4.3). All are unit, `back` points away from the surface, `n_s` lies in the hemisphere of `n_g`, and
/// so does the result, which `back` sees from the same side as `n_g`.
#[inline]
pub fn adapt_shading_normal(back: Vec3, n_s: Vec3, n_g: Vec3) -> Vec3 {
    if is_consistent(back, n_s, n_g) { n_s } else { adapted_normal(back, n_s, n_g) }
}

/// Whether the shading normal is to be used as it is.
#[inline(always)]
pub fn is_consistent(back: Vec3, n_s: Vec3, n_g: Vec3) -> bool {
    let cos = back.dot(n_g);
    let reflected_cos = 2.0 * back.dot(n_s) * n_s.dot(n_g) - cos;
    let least = LEAST_REFLECTION.min(0.9 * cos.abs());
    reflected_cos * 1f32.copysign(cos) >= least
}

/// In `f64`: at grazing angles the two directions nearly cancel.
#[cold]
pub fn adapted_normal(back: Vec3, n_s: Vec3, n_g: Vec3) -> Vec3 {
    let (back, n_s, normal) = (back.as_dvec3().normalize_or_zero(), n_s.as_dvec3(), n_g.as_dvec3());
    let cos = back.dot(normal);
    let side = 1f64.copysign(cos);
    let least = f64::from(LEAST_REFLECTION).min(0.9 * cos.abs());
    let reflected = 2.0 * back.dot(n_s) * n_s - back;
    let lifted = reflected + normal * (side * least - reflected.dot(normal));
    let half = lifted.normalize_or_zero() + back;
    // Seen exactly edge-on, nothing is left but the surface itself.
    if half.dot(normal) * side > 0.0 { (half.normalize() * side).as_vec3() } else { n_g }
}

/// How much of the light from a direction a surface gets whose shading normal sees it better than the surface does: 1
/// where the surface sees it at least as well, falling smoothly to 0 where the surface turns away (Chiang, Li and
/// Burley, "Taming the Shadow Terminator"). The cosines are those of the direction with both normals, on the side that
/// is lit, and of the normals with each other.
#[inline]
pub fn terminator_factor(cos_geometric: f32, cos_shading: f32, cos_normals: f32) -> f32 {
    let g = cos_geometric / (cos_shading * cos_normals);
    if g >= 1.0 {
        1.0
    } else if g > 0.0 {
        g * (1.0 + g * (1.0 - g))
    } else {
        0.0
    }
}

/// How far above a facet a ray may start at least, in roundings of its place: a multiple of the distances that rays
/// keep from surfaces.
const MIN_TERMINATOR_OFFSET: f64 = 256.0;

/// Where rays start that see more than the facet `at` does: above it on the side of the shading normal `n`, on the
/// smooth surface that the facet approximates, so that the shadow of a coarse mesh has no edges but its own. The second
/// is a ray from the facet to there: if anything occludes it, the start is not to be used, so that rays get nowhere
/// that rays from the facet cannot get in one step or two. `None` if that surface is not above the facet, and in scenes
/// with media, for the side of the facet determines the medium.
#[cold]
#[inline(never)]
pub fn terminator_start(world: &World, at: &SurfaceInteraction, n: Vec3) -> Option<(SurfaceInteraction, Ray)> {
    if world.scene.features.media {
        return None;
    }
    let p = world.scene.geometry.terminator_point(at, n)?;
    let offset = p - at.p;
    let rounding = UNIT_ROUNDOFF * at.p.abs().max_element() + f64::from(at.error);
    let on_lit_side = offset.dot(at.n_g.as_dvec3()) * f64::from(n.dot(at.n_g)) > 0.0;
    if !(on_lit_side && offset.length() > MIN_TERMINATOR_OFFSET * rounding) {
        return None;
    }
    // A little further, so that the distance which rays keep from surfaces is free too.
    let way = at.spawn_to(&SpawnPoint { p: p + offset * (16.0 / MIN_TERMINATOR_OFFSET), n: Vec3::ZERO, error: 0.0 });
    Some((SurfaceInteraction { p, n_g: n, ..*at }, way))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions over the sphere, the same ones each time.
    fn directions(count: usize) -> impl Iterator<Item = Vec3> {
        (0..count).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        })
    }

    #[test]
    fn nothing_is_reflected_below_the_surface() {
        let n_g = Vec3::Z;
        for n_s in directions(400).filter(|n| n.z > 0.0) {
            for back in directions(2_000) {
                let n = adapt_shading_normal(back, n_s, n_g);
                let reflected = 2.0 * back.dot(n) * n - back;
                let least = LEAST_REFLECTION.min(0.9 * back.z.abs());
                assert!((n.length() - 1.0).abs() < 1e-5 && n.z > 0.0, "{back} {n_s} {n}");
                assert!(reflected.z * back.z.signum() > 0.99 * least - 1e-6, "{back} {n_s}: {reflected}");
                assert!(back.dot(n) * back.z > 0.0, "{back} {n_s} {n}");
            }
        }
    }

    #[test]
    fn a_normal_is_turned_no_more_than_needed() {
        let (n_g, n_s) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        for back in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8)] {
            assert_eq!(adapt_shading_normal(back, n_s, n_g), n_s);
            assert_eq!(adapt_shading_normal(-back, n_s, n_g), n_s);
        }
        // Without a jump where turning begins, and where the shading normal turns away.
        let mut last: Option<Vec3> = None;
        for i in 0..10_000 {
            let (sin, cos) = (1.57 * (1.0 - 2.0 * i as f32 / 10_000.0)).sin_cos();
            let n = adapt_shading_normal(Vec3::new(sin, 0.0, cos), n_s, n_g);
            assert!(last.is_none_or(|last| (last - n).length() < 1e-3), "{i} {last:?} {n}");
            last = Some(n);
        }
    }

    #[test]
    fn the_terminator_factor_is_smooth_and_within_its_bounds() {
        assert_eq!(terminator_factor(0.5, 0.5, 1.0), 1.0);
        assert_eq!(terminator_factor(0.5, 0.4, 0.9), 1.0);
        assert_eq!(terminator_factor(0.0, 0.4, 0.9), 0.0);
        assert_eq!(terminator_factor(-0.1, 0.4, 0.9), 0.0);
        let mut last = 0.0;
        for i in 0..=1_000 {
            let factor = terminator_factor(0.9 * i as f32 / 1_000.0, 1.0, 0.9);
            assert!((0.0..=1.0).contains(&factor) && factor >= last && factor - last < 2e-3, "{i}: {factor}");
            last = factor;
        }
    }
}
