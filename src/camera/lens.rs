//! Thin lenses.

use std::f64::consts::TAU;

use crate::math::{DVec2, DVec3};
use crate::sampling::warp;

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, in world units, above 0; with blades, that of the circle through the polygon's corners.
    pub radius: f64,
    /// Distance along the view axis of the plane in focus, above 0.
    pub focus_distance: f64,
    /// Blades that make the aperture a regular polygon; a disk without them.
    pub blades: Option<Blades>,
}

/// The blades of an aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blades {
    /// Corners of the polygon, at least 3.
    pub count: u32,
    /// Angle of the first corner in radians, counter-clockwise from the camera's right as the camera sees it.
    pub rotation: f64,
}

impl Lens {
    /// A point of the aperture, uniform by area; `u` in the unit square.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> DVec2 {
        match &self.blades {
            None => self.on_disk(u),
            Some(blades) => blades.sample(u) * self.radius,
        }
    }

    /// [`sample`](Self::sample) of an aperture without blades.
    #[inline(always)]
    pub fn on_disk(&self, u: [f32; 2]) -> DVec2 {
        warp::concentric_disk(u).as_dvec2() * self.radius
    }

    /// Origin and direction, in the camera's space, of the ray from a point of the aperture to the point in focus that
    /// a pinhole would see `toward` a point at z = -1.
    #[inline(always)]
    pub fn through(&self, point: DVec2, toward: DVec3) -> (DVec3, DVec3) {
        let on_lens = point.extend(0.0);
        (on_lens, toward * self.focus_distance - on_lens)
    }
}

impl Blades {
    /// A point of the polygon whose corners lie on the unit circle, uniform by area.
    fn sample(&self, u: [f32; 2]) -> DVec2 {
        let count = f64::from(self.count);
        let scaled = f64::from(u[0]) * count;
        let side = scaled.floor().min(count - 1.0);
        // A triangle from the centre to each side.
        let [b, c] = warp::uniform_triangle([(scaled - side) as f32, u[1]]).map(|b| b as f32);
        let corner = |k: f64| DVec2::from_angle(self.rotation + TAU * k / count);
        corner(side) * f64::from(b) + corner(side + 1.0) * f64::from(c)
    }
}

/// The third of `1 / focal_length = 1 / sensor_distance + 1 / focus_distance` from the focal length and one of the
/// distances; `None` if nothing is in focus: the distance given is not above the focal length.
pub fn lens_equation(focal_length: f64, distance: f64) -> Option<f64> {
    (distance > focal_length).then(|| focal_length * distance / (distance - focal_length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lens_equation_is_its_own_inverse() {
        let b = lens_equation(0.05, 0.051).unwrap();
        assert!((1.0 / 0.051 + 1.0 / b - 1.0 / 0.05).abs() < 1e-9 && (b - 2.55).abs() < 1e-9);
        assert!((lens_equation(0.05, b).unwrap() - 0.051).abs() < 1e-12);
        assert!(lens_equation(0.05, 0.05).is_none() && lens_equation(0.05, 0.01).is_none());
    }

    /// Share of an even grid of points within a given share of the radius.
    fn share_within(lens: &Lens, radius: f64) -> f64 {
        let n = 512;
        let grid = (0..n * n).map(|i| [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32]);
        grid.filter(|&u| lens.sample(u).length() <= radius * lens.radius).count() as f64 / f64::from(n * n)
    }

    #[test]
    fn the_disk_is_sampled_by_area_and_not_by_radius() {
        // A radius of u R (without the root) puts half of the points within half of the radius.
        let lens = Lens { radius: 0.3, focus_distance: 1.0, blades: None };
        for r in [0.25, 0.5, 0.75] {
            assert!((share_within(&lens, r) - r * r).abs() < 2e-3, "{r}");
        }
    }

    #[test]
    fn polygons_are_sampled_by_area() {
        for count in [3, 5, 6, 9] {
            let blades = Blades { count, rotation: 0.4 };
            let lens = Lens { radius: 0.3, focus_distance: 1.0, blades: Some(blades) };
            let (n, side) = (f64::from(count), TAU / f64::from(count));
            let inner = (0.5 * side).cos();
            let area = 0.5 * n * side.sin();
            // The inscribed circle, and half of it.
            let pi = std::f64::consts::PI;
            assert!((share_within(&lens, inner) - pi * inner * inner / area).abs() < 3e-3, "{count}");
            assert!((share_within(&lens, 0.5 * inner) - 0.25 * pi * inner * inner / area).abs() < 3e-3, "{count}");

            // Each side of the polygon bounds the points, and some come close to each corner.
            let mut near_corner = vec![0; count as usize];
            let grid = 256;
            for i in 0..grid * grid {
                let p = lens.sample([((i % grid) as f32 + 0.5) / grid as f32, ((i / grid) as f32 + 0.5) / grid as f32])
                    / lens.radius;
                for k in 0..count {
                    let toward_side = DVec2::from_angle(blades.rotation + side * (f64::from(k) + 0.5));
                    assert!(p.dot(toward_side) <= inner + 1e-6);
                    let corner = DVec2::from_angle(blades.rotation + side * f64::from(k));
                    near_corner[k as usize] += usize::from((p - corner).length() < 0.1);
                }
            }
            assert!(near_corner.iter().all(|&c| c > 20), "{count}: {near_corner:?}");
        }
    }
}
