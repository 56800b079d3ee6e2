//! Group L: lights.

mod emitters;
mod polygons;
mod power;
mod selection;
mod sky;
mod spheres;
mod tables;

use super::geometry::transform;
use super::verdict::Tests;
use super::{Effort, Faults, Outcome};
use crate::color::Rgb;
use crate::geometry::{Analytic, Geometry, Shape, TransformedShape};
use crate::id::{PrimId, ShapeId};
use crate::light::{AreaLight, Emission, LightSample, ShadowTarget};
use crate::math::{DMat3, DVec3, Transform};

use emitters::l5_partial_emitters;
use polygons::l6_polygons;
pub(super) use polygons::lambert;
use power::l1_power;
use selection::l8_choice;
use sky::l7_environment_maps;
use spheres::{l2_solid_angles, l3_far_spheres, l4_directions};
use tables::l9_tables;

checks! {
    "L1" l1_power "power of every light":
        "closed forms of points, spots, measured lights, every shape, suns and skies against what flows through a \
         sphere around them (pbrt, lights_test; relative, since powers differ by orders of magnitude)";
    "L2" l2_solid_angles "solid angle of a sphere":
        "mean inverse density on a grid from 1.0001 to 1e7 radii, 1 % above the surface, on it and inside (pbrt-v3, \
         shapes Sphere.SolidAngle)";
    "L3" l3_far_spheres "density towards a far sphere":
        "one over the solid angle by half-angles in f64, without 1 - cos, 1.0001 to 1e7 radii from the centre";
    "L4" l4_directions "directions towards a sphere":
        "10 x 10 grid against the cone's formula and against the hit that a ray finds (Mitsuba 3, test_sphere \
         test05_sample_direct); and random directions in 16 x 16 equal parts of the cone";
    "L5" l5_partial_emitters "partial emitters":
        "disk, ring sector, partial sphere, cylinder, cone, frustum, surface of revolution, triangle and sheared quad, \
         turned and stretched: clips, parts of equal area, the integral of the density over directions without \
         silhouettes, hits of samples";
    "L6" l6_polygons "rectangles and triangles":
        "solid angle by closed form, irradiance by Lambert's formula, cells of a rectangle by their solid angle, from \
         above, aside, far and almost within the plane (pbrt, sampling_test)";
    "L7" l7_environment_maps "environment maps":
        "one texel, a constant in high resolution, 3 x 2, a ramp, a sun, lit poles and a lit seam: cells of the \
         density, all directions together, weights, a ramp, seam and poles (Mitsuba 3, test_envmap)";
    "L8" l8_choice "choice of a light":
        "58 lights of every kind, with a sky and without, by power and by the tree, and 100 points that reach \
         everywhere: sums, probabilities of choices and of pmf, frequencies, the mean of 1 / (n p) (pbrt, \
         lightsamplers_test)";
    "L9" l9_tables "discrete distributions":
        "alias tables and piecewise constant densities with zeros: frequencies, first and last random number, what is \
         left of it (pbrt, sampling_test)";
}

/// White, one side.
const WHITE: Emission = Emission::constant(Rgb::WHITE);

/// White, both sides.
const TWO_SIDED: Emission = Emission { two_sided: true, ..WHITE };

/// One shape in the world.
fn place(shape: Analytic, transform: Transform) -> Geometry {
    super::geometry::world(vec![Shape::Analytic(TransformedShape::new(shape, transform))])
}

/// The light of the world's first primitive.
fn first_light(geometry: &Geometry, emission: Emission) -> AreaLight {
    AreaLight::new(ShapeId(0), PrimId(0), emission, geometry, &[])
}

/// A rotation about a skew axis, with scales along the axes and a translation.
fn skew(scale: [f64; 3]) -> Transform {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.3);
    transform(turn * DMat3::from_diagonal(scale.into()), DVec3::new(0.4, 1.0, -0.7))
}

/// The point of a light that a sample chose.
fn target(sample: &LightSample) -> DVec3 {
    match &sample.target {
        ShadowTarget::Point(target) => target.p,
        ShadowTarget::Infinity => DVec3::INFINITY,
    }
}

/// The points of a regular grid in the unit square, each in the middle of its cell.
fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
    let middle = move |i: u32| (i as f32 + 0.5) / n as f32;
    (0..n * n).map(move |i| [middle(i % n), middle(i / n)])
}

/// Points of a low-discrepancy sequence in the unit cube of four dimensions (Roberts, "The Unreasonable
/// Effectiveness of Quasirandom Sequences").
fn quasi_random(count: u32) -> impl Iterator<Item = [f64; 4]> {
    // The root of x^5 = x + 1.
    const G: f64 = 1.167_303_978_261_418_7;
    (0..count).map(|i| std::array::from_fn(|k| (0.5 + f64::from(i) * G.powi(-(k as i32 + 1))).fract()))
}
