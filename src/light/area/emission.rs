//! Rays that leave emitters, for paths that start at lights.

use std::f32::consts::FRAC_1_PI;

use super::{AreaLight, EmitterShape, triangle_point};
use crate::color::Rgb;
use crate::geometry::{Geometry, Shape, SpawnPoint};
use crate::id::PrimId;
use crate::math::{Frame, Vec3};
use crate::sampling::warp;

/// Light that leaves a point of an emitter.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay {
    /// The point, with the unit normal of the front.
    pub point: SpawnPoint,
    /// Unit direction.
    pub direction: Vec3,
    /// Radiance.
    pub radiance: Rgb,
    /// Density per area and solid angle, over the cosine of the direction and the normal.
    pub pdf_per_cos: f32,
}

impl AreaLight {
    /// A ray that leaves the surface: the point from `u`, the direction from `v`, each in the unit square, distributed
    /// as the cosine. `None` from lights that [`emitted_pdf_per_cos`](Self::emitted_pdf_per_cos) has no density of.
    pub fn sample_emitted(&self, geometry: &Geometry, u: [f32; 2], v: [f32; 2]) -> Option<EmittedRay> {
        let point = self.sample_point(geometry, u)?;
        let pdf_per_cos = self.emitted_pdf_per_cos(geometry, point.n)?;
        // Of two-sided emitters, half of the numbers are for either side.
        let is_back = self.emission.two_sided && v[0] < 0.5;
        let v = if self.emission.two_sided { [2.0 * v[0] - f32::from(u8::from(!is_back)), v[1]] } else { v };
        let side = if is_back { -1.0 } else { 1.0 };
        let direction = Frame::from_normal(point.n * side).to_world(warp::cosine_hemisphere(v));
        Some(EmittedRay { point, direction, radiance: self.emission.radiance, pdf_per_cos })
    }

    /// The density per area and solid angle of [`sample_emitted`](Self::sample_emitted) over the cosine of the
    /// direction and the normal, at a point with the unit normal `n`; `None` for lights with textures and surfaces
    /// whose density the normal does not determine.
    #[inline]
    pub fn emitted_pdf_per_cos(&self, geometry: &Geometry, n: Vec3) -> Option<f32> {
        if !self.emission.is_even() {
            return None;
        }
        let pdf_area = match &self.form {
            EmitterShape::TransformedShape { .. } => match geometry.shape(self.shape) {
                Shape::Analytic(placed) => placed.pdf_area_from_normal(n)?,
                Shape::Mesh(_) | Shape::Curves(_) | Shape::Points(_) => return None,
            },
            EmitterShape::Sphere(_) | EmitterShape::Parallelogram(_) | EmitterShape::Triangle { .. } => {
                1.0 / self.area()
            }
        };
        let sides = if self.emission.two_sided { 0.5 } else { 1.0 };
        Some(sides * FRAC_1_PI * pdf_area as f32)
    }

    /// A point of the surface, uniform over its area, or as its shape samples it.
    fn sample_point(&self, geometry: &Geometry, u: [f32; 2]) -> Option<SpawnPoint> {
        match geometry.shape(self.shape) {
            Shape::Mesh(mesh) => {
                // A parallelogram is two triangles of the same area.
                let halves = matches!(self.form, EmitterShape::Parallelogram(_));
                let is_second = halves && u[0] >= 0.5;
                let v = if halves { [2.0 * u[0] - f32::from(u8::from(is_second)), u[1]] } else { u };
                let prim = if is_second { PrimId(1) } else { self.prim };
                Some(triangle_point(&mesh.triangle_points(prim), v))
            }
            Shape::Analytic(placed) => {
                let sample = placed.sample_area(u);
                Some(SpawnPoint { p: sample.p, n: sample.n, error: placed.error() })
            }
            Shape::Curves(_) | Shape::Points(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::id::ShapeId;
    use crate::light::Emission;
    use crate::light::test_support::assert_chi_squared;
    use crate::math::Rng;

    const CELLS: usize = 6;

    /// Cell of a number in the unit interval.
    fn cell(x: f64) -> usize {
        ((x * CELLS as f64) as usize).min(CELLS - 1)
    }

    /// A square of side 2 at z = 1 that looks down, one light or two triangles: places are uniform by area, squared
    /// cosines and azimuths uniform, and both sides of two-sided lights have as many rays.
    #[test]
    fn emitted_rays_have_their_density() {
        let positions = vec![[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]];
        let mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]], None, None).unwrap();
        let geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() };
        for two_sided in [false, true] {
            let emission = Emission { two_sided, ..Emission::constant(Rgb::WHITE) };
            let light = AreaLight::for_shape(ShapeId(0), emission, &geometry, &[]).remove(0);
            let (mut places, mut directions, mut backs) = ([0; CELLS * CELLS], [0; CELLS * CELLS], 0);
            let mut random = Rng::new(3);
            let n = 100_000;
            for _ in 0..n {
                let ray = light.sample_emitted(&geometry, random.pair(), random.pair()).unwrap();
                let [x, y] = [ray.point.p.x, ray.point.p.y].map(|x| cell(0.5 * (x + 1.0)));
                places[CELLS * y + x] += 1;
                let d = ray.direction.as_dvec3();
                let azimuth = d.y.atan2(d.x) / std::f64::consts::TAU + 0.5;
                directions[CELLS * cell(azimuth) + cell(d.z * d.z)] += 1;
                backs += u32::from(d.z > 0.0);
                assert_eq!(light.emitted_pdf_per_cos(&geometry, ray.point.n), Some(ray.pdf_per_cos));
                // Radiance over the density is the power.
                let power = ray.radiance.luminance() / ray.pdf_per_cos;
                assert!((f64::from(power) / light.power() - 1.0).abs() < 1e-5, "{power}");
            }
            let even = [1.0 / (CELLS * CELLS) as f64; CELLS * CELLS];
            assert_chi_squared(&places, &even, "places");
            assert_chi_squared(&directions, &even, "directions");
            let back = if two_sided { 0.5 } else { 0.0 };
            assert_chi_squared(&[backs, n - backs], &[back, 1.0 - back], "sides");
        }
    }
}
