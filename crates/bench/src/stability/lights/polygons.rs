//! Rectangles, by the solid angle they fill, and triangles.

use super::{Effort, Outcome, TWO_SIDED, Tests, first_light, grid, place, target, transform};
use crate::geometry::{Analytic, Quad};
use crate::light::{AreaLight, LightSampleContext};
use crate::math::{DMat3, DVec3, Ray, Rng};
use crate::stability::geometry::{meshes, triangle};
use crate::{
    geometry::Geometry,
    id::{PrimId, ShapeId},
};

/// Cells of a rectangle along each side.
const CELLS: usize = 12;

/// Parts of a cell along each side, over which a density is averaged.
const PARTS: usize = 8;

/// The rectangle from `corner` along `u` and `v` as a light.
fn quad_light(corner: DVec3, u: DVec3, v: DVec3) -> (Geometry, AreaLight) {
    let quad = Analytic::Quad(Quad::new(corner, u, v).expect("edges that span an area"));
    let geometry = place(quad, transform(DMat3::IDENTITY, DVec3::ZERO));
    let light = AreaLight::for_shape(ShapeId(0), TWO_SIDED, &geometry, &[]).remove(0);
    (geometry, light)
}

/// Solid angle of a triangle seen from the origin (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle").
fn triangle_solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let real = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).abs().atan2(real)
}

/// Solid angle of a parallelogram seen from `p`.
fn quad_solid_angle(p: DVec3, corner: DVec3, u: DVec3, v: DVec3) -> f64 {
    let a = corner - p;
    triangle_solid_angle([a, a + u, a + u + v]) + triangle_solid_angle([a, a + u + v, a + v])
}

/// Irradiance at the origin from a polygon of radiance 1 above the horizon: E = 1/2 sum acos(a·b) n·(a x b) / |a x b|
/// (Lambert).
pub(in crate::stability) fn lambert(corners: &[DVec3], n: DVec3) -> f64 {
    let around = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f64 = around.map(|(a, b)| a.angle_between(*b) * n.dot(a.cross(*b).normalize())).sum();
    (0.5 * sum).abs()
}

/// Density per solid angle of the point `q` of a light as seen from `p`.
fn density(geometry: &Geometry, light: &AreaLight, p: DVec3, q: DVec3) -> f64 {
    let ray = Ray::new(p.as_vec3(), (q - p).normalize().as_vec3());
    let hit = geometry.shape(light.shape).intersect_prim(&ray, light.shape, PrimId(0));
    let at = hit.and_then(|hit| geometry.interaction(&ray, &hit));
    at.map_or(0.0, |at| light.pdf(geometry, &LightSampleContext::from_any_side(p), &ray, &at).into())
}

/// Means over a grid of samples: the inverse density, and the irradiance of radiance 1.
fn means(geometry: &Geometry, light: &AreaLight, p: DVec3, n: DVec3, side: u32) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for s in grid(side).filter_map(|u| light.sample(geometry, &[], &LightSampleContext::from_any_side(p), u)) {
        sums[0] += 1.0 / f64::from(s.pdf);
        sums[1] += n.dot(s.wi.as_dvec3()).max(0.0) / f64::from(s.pdf);
    }
    sums.map(|sum| sum / f64::from(side * side))
}

/// Whether all points of a light are chosen with the same density, as they are by solid angle.
fn has_one_density(geometry: &Geometry, light: &AreaLight, p: DVec3) -> bool {
    let mut densities =
        grid(8).filter_map(|u| light.sample(geometry, &[], &LightSampleContext::from_any_side(p), u)).map(|s| s.pdf);
    let first = densities.next();
    densities.all(|pdf| Some(pdf) == first)
}

/// The irradiance of the rectangle whose closed form is 0.7186889, of others, and of triangles.
fn irradiances(side: u32) -> f64 {
    let mut worst = 0f64;
    let mut compare = |geometry: &Geometry, light: &AreaLight, corners: &[DVec3], n: DVec3| {
        let [_, e] = means(geometry, light, DVec3::ZERO, n, side);
        worst = worst.max((e - lambert(corners, n)).abs());
    };
    for (corner, u, v) in [
        ([-0.3, -0.5, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.5, -2.0, 0.1], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0]),
        ([1.0, 1.0, 8.0], [2.0, 0.0, 0.5], [0.0, 3.0, 0.0]),
    ] {
        let [corner, u, v] = [corner, u, v].map(DVec3::from);
        let (geometry, light) = quad_light(corner, u, v);
        compare(&geometry, &light, &[corner, corner + u, corner + u + v, corner + v], DVec3::Z);
    }
    for corners in
        [[[-0.3, -0.5, 1.0], [0.7, -0.5, 1.0], [0.7, 0.5, 1.2]], [[1.0, 2.0, 0.3], [-2.0, 1.0, 0.5], [0.0, -1.0, 2.0]]]
    {
        let corners = corners.map(DVec3::from);
        let geometry = meshes(vec![triangle(corners[0], corners[1], corners[2])]);
        compare(&geometry, &first_light(&geometry, TWO_SIDED), &corners, DVec3::Z);
    }
    worst
}

/// Points that see the rectangle from (-1, -0.5, 0) to (2, 1.5, 0) from above, from aside, from far, and from almost
/// within it.
const POINTS: [[f64; 3]; 10] = [
    [0.3, 0.4, 1.0],
    [0.3, 0.4, 0.02],
    [5.0, -7.0, 3.0],
    [40.0, 3.0, 0.5],
    [0.0, 0.0, 300.0],
    [-1.0, -0.5, 0.1],
    [2.1, 0.0, 1e-3],
    [0.3, 0.4, 1e-12],
    [-1.0, 0.4, 1e-8],
    [1.5, 1.5, 1e-5],
];

/// Relative errors of the mean inverse densities of squares seen on their axis, by solid angle and by area.
fn squares() -> [f64; 2] {
    // On the axis: 4 atan(a² / (h sqrt(2 a² + h²))), a face of a cube from its middle among them: a sixth of the
    // sphere.
    let (mut sizes, mut by_area) = (0f64, 0f64);
    for size in [1e-9, 1e-3, 1.0, 2.0, 1e3, 1e9] {
        let (geometry, light) = quad_light(DVec3::new(-0.5 * size, -0.5 * size, 1.0), DVec3::X * size, DVec3::Y * size);
        let a = 0.5 * size;
        let exact = 4.0 * (a * a / (2.0 * a * a + 1.0).sqrt()).atan();
        let error = (means(&geometry, &light, DVec3::ZERO, DVec3::Z, 100)[0] / exact - 1.0).abs();
        if has_one_density(&geometry, &light, DVec3::ZERO) {
            sizes = sizes.max(error);
        } else {
            by_area = by_area.max(error);
        }
    }
    [sizes, by_area]
}

pub(super) fn l6_polygons(effort: Effort) -> Outcome {
    let (corner, u, v) = (DVec3::new(-1.0, -0.5, 0.0), DVec3::X * 3.0, DVec3::Y * 2.0);
    let (geometry, light) = quad_light(corner, u, v);
    let (mut tests, mut rng) = (Tests::new(), Rng::new(3));
    let (mut densities, mut inverses) = (0f64, 0f64);
    for p in POINTS.map(DVec3::from) {
        let whole = quad_solid_angle(p, corner, u, v);
        let [mean, _] = means(&geometry, &light, p, DVec3::Z, effort.pick(100, 1000));
        inverses = inverses.max((mean / whole - 1.0).abs());

        let by_solid_angle = has_one_density(&geometry, &light, p);
        let n = effort.pick(30_000, 3_000_000);
        let mut counts = vec![0u32; CELLS * CELLS];
        for _ in 0..n {
            let Some(s) = light.sample(&geometry, &[], &LightSampleContext::from_any_side(p), rng.pair()) else {
                continue;
            };
            if by_solid_angle {
                densities = densities.max((f64::from(s.pdf) * whole - 1.0).abs());
            }
            let d = target(&s) - corner;
            let [i, j] = [d.y / 2.0, d.x / 3.0].map(|x| ((x * CELLS as f64) as usize).min(CELLS - 1));
            counts[i * CELLS + j] += 1;
        }
        let share = |columns: usize, k: usize| {
            let (u, v) = (u / columns as f64, v / columns as f64);
            let at = corner + u * (k % columns) as f64 + v * (k / columns) as f64;
            let pdf = if by_solid_angle { 1.0 / whole } else { density(&geometry, &light, p, at + 0.5 * (u + v)) };
            quad_solid_angle(p, at, u, v) * pdf
        };
        let cell = |k: usize| {
            // The density by solid angle is the same everywhere in a cell, that by area is not.
            let parts = if by_solid_angle { 1 } else { PARTS };
            let first = k / CELLS * parts * CELLS * parts + k % CELLS * parts;
            let part = |i: usize| share(CELLS * parts, first + i / parts * CELLS * parts + i % parts);
            f64::from(n) * (0..parts * parts).map(part).sum::<f64>()
        };
        tests.counts(&format!("from {p}"), &counts, &(0..CELLS * CELLS).map(cell).collect::<Vec<_>>());
    }

    let [sizes, by_area] = squares();
    let outcome = Outcome::new()
        .at_most("error of the irradiance of radiance 1", irradiances(effort.pick(300, 1000)), 1e-3)
        .at_most("relative error of the density by solid angle", densities, 1e-6)
        .at_most("relative error of the mean inverse density", inverses, 1e-3)
        .at_most("relative error for large squares, by solid angle", sizes, 1e-6)
        .at_most("relative error for small squares, by area", by_area, 1e-3);
    tests.judge(outcome)
}
