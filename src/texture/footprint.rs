//! Footprints of texture lookups.

use crate::attribute::AttributePoint;
use crate::math::Vec2;

/// The least cosine between a ray and a surface: what is seen edge-on has no end.
const LEAST_COSINE: f32 = 1e-3;

/// A place on a surface: in uv, with the footprint in uv, and the attributes of the mesh there.
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

    /// Where a cone of this `width`, whose unit axis meets the surface's unit normal at the cosine `cos`, meets a
    /// surface with this [area in uv per area](crate::geometry::Geometry::uv_density); a point where uv do not span the
    /// surface.
    #[inline]
    pub fn of_cone(uv: Vec2, width: f32, cos: f32, uv_density: f32) -> Self {
        // In f64: uv may span kilometres or micrometres.
        let section = f64::from(width).powi(2) / f64::from(cos.abs().max(LEAST_COSINE));
        let area = (section * f64::from(uv_density)) as f32;
        Self { area: if area.is_finite() { area } else { 0.0 }, ..Self::point(uv) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;

    #[test]
    fn a_cone_covers_more_of_a_surface_that_is_tilted() {
        let area = |cos| Footprint::of_cone(vec2(0.1, 0.2), 0.3, cos, 0.5).area;
        assert!((area(1.0) - 0.09 / 2.0).abs() < 1e-6);
        assert!((area(-0.6) - 0.09 / 2.0 / 0.6).abs() < 1e-6);
        assert!(area(0.0).is_finite());
    }

    #[test]
    fn a_surface_without_a_parametrisation_is_looked_up_at_a_point() {
        for density in [0.0, f32::INFINITY, f32::NAN] {
            assert_eq!(Footprint::of_cone(vec2(0.1, 0.2), 0.3, 1.0, density), Footprint::point(vec2(0.1, 0.2)));
        }
    }
}
