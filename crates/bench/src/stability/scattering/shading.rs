//! Shading normals that differ from the surface's own.

use serde_json::{Value, json};

use super::super::geometry::Rng;
use super::super::render::{Estimate, merge, pixels, probe, render};
use super::super::{Effort, Faults, Outcome};
use crate::integrator::{adapt_shading_normal, terminator_factor};
use crate::math::Vec3;

/// The quad `[-1, 1]^2` at z = 0 whose shading normal leans by an angle towards +x: by a normal map, or by the normals
/// of a mesh's corners.
fn tilted(degrees: f64, by_map: bool, material: Value) -> Value {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let code = [0.5 + 0.5 * sin, 0.5, 0.5 + 0.5 * cos];
    let corners = json!([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]);
    let mut shape =
        json!({ "type": "mesh", "material": "m", "positions": corners, "triangles": [[0, 1, 2], [0, 2, 3]] });
    shape["uvs"] = json!([[0, 0], [1, 0], [1, 1], [0, 1]]);
    let mut relief = json!({ "type": "relief", "material": "plain", "normal_map": { "texture": "map" } });
    if !by_map {
        shape["normals"] = json!([[sin, 0, cos], [sin, 0, cos], [sin, 0, cos], [sin, 0, cos]]);
        relief = material.clone();
    }
    json!({
        "integrator": { "type": "path", "max_depth": 2 },
        "textures": { "map": { "type": "checker", "color0": code, "color1": code } },
        "materials": { "plain": material, "m": relief },
        "shapes": [shape]
    })
}

/// The tilted quad seen from a direction.
fn scene(from: [f64; 3], spp: u32, tilted: Value, lights: Value) -> Value {
    let mut scene = probe(from.map(|x| 9.0 * x), [0.1, 0.2, 0.0], tilted);
    merge(&mut scene, json!({ "film": { "width": 8, "height": 8 }, "sampler": { "spp": spp }, "lights": lights }));
    scene
}

fn white_materials() -> [Value; 3] {
    [
        json!({ "type": "diffuse", "albedo": 1.0 }),
        json!({ "type": "plastic", "albedo": 1.0, "roughness": 0.3 }),
        json!({ "type": "conductor", "eta": [0.001, 0.001, 0.001], "k": [9, 9, 9], "roughness": 0.4 }),
    ]
}

/// Ways to look at the quad: from ahead, with the lean and against it, grazing.
const FROM: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [0.8, 0.1, 0.59], [-0.8, 0.1, 0.59], [0.1, 0.99, 0.1]];

/// Largest radiance under a white sky, less five standard errors of it.
fn furnace(effort: Effort) -> f64 {
    let sky = json!([{ "type": "environment", "radiance": [1, 1, 1] }]);
    let mut largest = 0f64;
    for degrees in effort.pick(&[80.0][..], &[20.0, 50.0, 80.0, 85.0]) {
        for (by_map, material, from) in cases() {
            let shape = tilted(*degrees, by_map, material);
            let Estimate { mean, error } =
                Estimate::of(&render(&scene(from, effort.pick(64, 256), shape, sky.clone())), 1);
            largest = largest.max(mean - 5.0 * error);
        }
    }
    largest
}

fn cases() -> impl Iterator<Item = (bool, Value, [f64; 3])> {
    let kinds = [true, false].into_iter().flat_map(|by_map| white_materials().map(|material| (by_map, material)));
    kinds.flat_map(|(by_map, material)| FROM.map(|from| (by_map, material.clone(), from)))
}

/// Pixels that are not black where all light comes from below the quad but from above the plane of its shading normal.
/// Only with a normal map: vertex normals approximate a smooth surface, which may see below the plane of a facet that
/// nothing covers.
fn leaks() -> Faults {
    let below = json!([{ "type": "directional", "direction": [-0.95, 0, 0.3], "irradiance": [9, 9, 9] }]);
    let lit = |(by_map, material, from)| render(&scene(from, 4, tilted(70.0, by_map, material), below.clone()));
    let mut leaks = Faults::NONE;
    for case in cases().filter(|case| case.0) {
        leaks.add(pixels(&lit(case.clone())).filter(|p| *p != [0.0; 3]).count(), || {
            format!("{} from {:?}", case.1, case.2)
        });
    }
    leaks
}

/// Largest step of the radiance of a leaning white quad from one height of the light to the next, times the number of
/// heights, over the radiance at full light: a hard edge anywhere would give that number, a slope one of the order of
/// the slope of the cosine.
fn steepest(effort: Effort) -> f64 {
    let heights = effort.pick(32, 256u32);
    let mut last: Option<f64> = None;
    let mut steepest = 0f64;
    for i in 0..=heights {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * (1.1 * f64::from(i) / f64::from(heights) - 0.1)).sin_cos();
        let light = json!([{ "type": "directional", "direction": [-cos, 0, -sin], "irradiance": [1, 1, 1] }]);
        let shape = tilted(40.0, true, json!({ "type": "diffuse", "albedo": 1.0 }));
        let current = std::f64::consts::PI * Estimate::of(&render(&scene(FROM[0], 1, shape, light)), 1).mean;
        steepest = steepest.max(last.map_or(0.0, |last| (current - last).abs()) * f64::from(heights));
        last = Some(current);
    }
    steepest
}

/// Steps over which the slope of the terminator's factor is taken.
const COARSE: u32 = 2_000;

/// Values of the terminator's factor outside of [0, 1], or smaller for more light, and its largest slope.
fn factor(effort: Effort) -> (Faults, f64) {
    let steps = effort.pick(2_000, 100_000u32);
    let (mut wrong, mut slope) = (Faults::NONE, 0f64);
    for cos_normals in [0.01f32, 0.17, 0.5, 0.9, 1.0] {
        let (mut last, mut last_coarse) = (0.0, 0.0);
        for i in 0..=steps {
            // The factor depends on the cosine to the surface over this product.
            let part = 1.2 * i as f32 / steps as f32 - 0.1;
            let factor = terminator_factor(part * 0.8 * cos_normals, 0.8, cos_normals);
            wrong.require((0.0..=1.0).contains(&factor) && factor >= last - 1e-6, || {
                format!("{factor:?} after {last:?}, cosine of the normals {cos_normals}, part {part:?}")
            });
            last = factor;
            // Over steps so coarse that the rounding of the factor does not count.
            if i % (steps / COARSE) == 0 {
                slope = slope.max(f64::from(factor - last_coarse) * f64::from(COARSE) / 1.2);
                last_coarse = factor;
            }
        }
    }
    (wrong, slope)
}

/// Mirror reflections that leave through the surface, for random normals and directions.
fn reflected_below(effort: Effort) -> Faults {
    let mut rng = Rng::new(11);
    let random = |rng: &mut Rng| rng.direction().as_vec3();
    let mut below = Faults::NONE;
    for _ in 0..effort.pick(200_000, 5_000_000) {
        let (back, mut n_s) = (random(&mut rng), random(&mut rng));
        n_s.z = n_s.z.abs();
        let n = adapt_shading_normal(back, n_s, Vec3::Z);
        let reflected = 2.0 * back.dot(n) * n - back;
        below.require(reflected.z * back.z > 0.0 && back.dot(n) * back.z > 0.0, || format!("{back} off {n_s}"));
    }
    below
}

pub(super) fn g11_shading_normals(effort: Effort) -> Outcome {
    let (wrong, slope) = factor(effort);
    Outcome::new()
        .at_most("largest radiance under a white sky, less 5 standard errors", furnace(effort), 1.01)
        .none("pixels that are lit from below", leaks())
        .none("mirror reflections through the surface", reflected_below(effort))
        .none("terminator factors out of [0, 1] or not monotone", wrong)
        // The polynomial g + g^2 - g^3 is steepest at g = 1/3, by 4/3; a little more for rounding.
        .at_most("slope of the terminator factor", slope, 1.34)
        // The cosine to the leaning normal changes by at most 1.1 pi / 2 over all heights, and the factor by 4/3 in g,
        // which the sine of the height moves at 1 / (cos 40 cos 50) next to the terminator.
        .at_most(
            "change of the radiance with the height of the light",
            steepest(effort),
            1.1 * std::f64::consts::FRAC_PI_2 * 2.8,
        )
}
