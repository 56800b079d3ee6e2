//! What part of a texture a lookup stands for.

use crate::attribute::AttributePoint;
use crate::math::{Vec2, Vec3};

/// The least cosine between a ray and a surface: what is seen edge-on has no end.
const LEAST_COSINE: f32 = 1e-3;

/// A place on a surface: in uv, with how much of uv around it a sample stands for, and the attributes of the mesh there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint<'a> {
    /// The middle.
    pub uv: Vec2,
    /// An area, in units of uv squared; zero for a point.
    pub area: f32,
    /// Of a mesh that has any which textures take.
    pub attributes: Option<AttributePoint<'a>>,
}

impl Footprint<'_> {
    /// Nothing but a point.
    #[inline]
    pub fn point(uv: Vec2) -> Self {
        Self { uv, area: 0.0, attributes: None }
    }

    /// Where a cone of this `width`, whose unit axis meets the surface's unit normal at the cosine `cos`, meets a surface that changes with u
    /// and v by `derivatives`; a point where these do not span the surface.
    pub fn of_cone(uv: Vec2, width: f32, cos: f32, derivatives: [Vec3; 2]) -> Self {
        // In f64, for the product of lengths: uv may span kilometres or micrometres.
        let [du, dv] = derivatives.map(Vec3::as_dvec3);
        let section = f64::from(width).powi(2) / f64::from(cos.abs().max(LEAST_COSINE));
        let area = (section / du.cross(dv).length()) as f32;
        Self { area: if area.is_finite() { area } else { 0.0 }, ..Self::point(uv) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;

    #[test]
    fn a_cone_covers_more_of_a_surface_that_is_tilted() {
        let uv = vec2(0.1, 0.2);
        let area = |cos, derivatives| Footprint::of_cone(uv, 0.3, cos, derivatives).area;
        let (du, dv) = (Vec3::X * 4.0, Vec3::Y * 0.5);
        assert!((area(1.0, [du, dv]) - 0.09 / 2.0).abs() < 1e-6);
        assert!((area(-0.6, [du, dv]) - 0.09 / 2.0 / 0.6).abs() < 1e-6);
        // A shear keeps areas.
        assert!((area(0.6, [du, dv + Vec3::X * 3.0]) - 0.09 / 2.0 / 0.6).abs() < 1e-6);
        assert!(area(0.0, [du, dv]).is_finite());
    }

    #[test]
    fn a_surface_without_a_parametrisation_is_looked_up_at_a_point() {
        for (du, dv) in [(Vec3::ZERO, Vec3::Y), (Vec3::X, Vec3::X), (Vec3::X, Vec3::splat(f32::NAN)), (Vec3::INFINITY, Vec3::Y)] {
            assert_eq!(Footprint::of_cone(vec2(0.1, 0.2), 0.3, 1.0, [du, dv]), Footprint::point(vec2(0.1, 0.2)));
        }
    }
}
