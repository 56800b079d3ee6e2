//! One scene in every size and every place.

use serde_json::{Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Effort, Faults, Outcome};
use crate::accel::AccelKind;
use crate::film::Image;
use crate::math::float::UNIT_ROUNDOFF;
use crate::render::Overrides;
use crate::stability::render::{block_means, pixels, prepare, render_with};
use crate::stability::{Plot, sidak_level};

const WIDTH: u32 = 48;
const HEIGHT: u32 = 48;

/// Everything a renderer's tolerances could be about, `s` times as large and moved by `offset`; lights give the same
/// irradiance.
fn scene(s: f64, offset: [f64; 3]) -> Value {
    let along = |p: [f64; 3]| p.map(|x| x * s);
    let at = |p: [f64; 3]| [0, 1, 2].map(|k| offset[k] + p[k] * s);
    json!({
        "film": { "width": WIDTH, "height": HEIGHT, "filter": { "type": "box" } },
        "camera": {
            "position": at([0.3, 1.4, 4.0]), "look_at": at([0.0, 0.45, 0.0]), "vertical_fov_degrees": 40,
            "lens": { "radius": 0.03 * s, "focus_distance": 4.0 * s }
        },
        "sampler": { "type": "independent", "spp": 8 },
        "integrator": { "type": "path", "max_depth": 5 },
        "materials": {
            "grey": { "type": "diffuse", "albedo": 0.6 }, "glass": { "type": "dielectric", "ior": 1.5 },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 }
        },
        "shapes": [
            {
                "type": "quad", "material": "grey", "origin": at([-4.0, 0.0, 4.0]), "edge_u": along([8.0, 0.0, 0.0]),
                "edge_v": along([0.0, 0.0, -8.0])
            },
            {
                "type": "sphere", "material": "glass", "radius": 0.5 * s,
                "transform": [{ "translate": at([-0.7, 0.5, 0.3]) }]
            },
            {
                "type": "cone", "material": "grey", "radius": 0.4 * s, "height": 0.9 * s,
                "transform": [
                    { "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "translate": at([0.2, 0.0, -0.9]) }
                ]
            },
            {
                "type": "mesh", "material": "grey", "triangles": [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
                "positions": [
                    at([-1.6, 0.02, -0.8]), at([-0.9, 0.02, -0.5]), at([-1.2, 0.02, -1.4]), at([-1.2, 0.9, -0.9])
                ]
            },
            { "type": "disk", "radius": 0.4 * s, "emission": { "radiance": [9, 8, 7] },
              "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": at([0.0, 2.5, 0.0]) }] }
        ],
        "objects": { "block": { "shapes": [{ "type": "cube", "material": "gold" }] } },
        "instances": [{
            "object": "block",
            "transform": [
                { "scale": 0.35 * s }, { "rotate": { "axis": [0, 1, 0], "degrees": 30 } },
                { "translate": at([0.8, 0.36, 0.4]) }
            ]
        }],
        "lights": [
            { "type": "environment", "radiance": [0.2, 0.3, 0.4] },
            { "type": "point", "position": at([-1.5, 1.5, 1.5]), "intensity": [1.5 * s * s, 1.5 * s * s, 1.5 * s * s] }
        ]
    })
}

fn picture(s: f64, kind: AccelKind, seed: u64) -> Image {
    picture_at(s, [0.0; 3], kind, seed)
}

fn picture_at(s: f64, offset: [f64; 3], kind: AccelKind, seed: u64) -> Image {
    let overrides = Overrides { threads: Some(2), seed: Some(seed), ..Overrides::default() };
    render_with(&prepare(&scene(s, offset), &overrides), kind).image
}

/// Root mean square difference of pixels, over the mean.
fn difference(a: &Image, b: &Image) -> f64 {
    let (mut squares, mut sum) = (0.0, 0.0);
    for (p, q) in pixels(a).zip(pixels(b)) {
        squares += p.iter().zip(q).map(|(p, q)| f64::from(p - q).powi(2)).sum::<f64>();
        sum += q.iter().map(|&q| f64::from(q)).sum::<f64>();
    }
    let count = 3.0 * f64::from(WIDTH * HEIGHT);
    (squares / count).sqrt() / (sum / count)
}

/// The pixels of a picture that are not those of another.
fn differing_pixels(found: &Image, expected: &Image, what: &str) -> Faults {
    let mut differing = Faults::NONE;
    for (i, (p, q)) in (0u32..).zip(pixels(found).zip(pixels(expected))) {
        let [x, y] = [i % found.size[0], i / found.size[0]];
        differing.require(p == q, || format!("{what}: pixel ({x}, {y}) is {p:?} in place of {q:?}"));
    }
    differing
}

/// Smallest p-value of Welch's test over the blocks of two sets of pictures.
fn welch(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let moments = |runs: &[Vec<f64>], block: usize| {
        let n = runs.len() as f64;
        let mean = runs.iter().map(|r| r[block]).sum::<f64>() / n;
        // The sky has no noise, but its pixels are rounded.
        let rounding = (UNIT_ROUNDOFF * mean).powi(2);
        (mean, (runs.iter().map(|r| (r[block] - mean).powi(2)).sum::<f64>() / (n - 1.0) + rounding) / n)
    };
    let p_value = |block: usize| {
        let ((ma, va), (mb, vb)) = (moments(a, block), moments(b, block));
        let freedom = (va + vb).powi(2) / (va * va / (a.len() as f64 - 1.0) + vb * vb / (b.len() as f64 - 1.0));
        let t = (ma - mb) / (va + vb).sqrt();
        StudentsT::new(0.0, 1.0, freedom).map_or(0.0, |student| 2.0 * student.sf(t.abs()))
    };
    (0..a[0].len()).map(p_value).fold(1.0, f64::min)
}

pub(super) fn e7_scenes_of_every_size(effort: Effort) -> Outcome {
    let exponents: Vec<i32> = effort.pick(vec![-15, -9, -3, 15], (-16..=16).filter(|k| *k != 0).collect());
    let runs = effort.pick(5, 12);
    let (mut smallest, mut largest, mut inexact) = (1f64, 0f64, Faults::NONE);
    let mut curves = Vec::new();
    let mut tests = 0;
    for name in ["embree", "bvh"] {
        let Ok(kind) = name.parse() else { continue };
        let blocks =
            |s: f64, first: u64| (0..runs).map(|i| block_means(&picture(s, kind, first + i))).collect::<Vec<_>>();
        let (expected, same_seed) = (blocks(1.0, 1), picture(1.0, kind, 1));
        let noise = difference(&picture(1.0, kind, 2), &same_seed);
        let (mut curve, mut level) = (Vec::new(), Vec::new());
        for &k in &exponents {
            let s = 10f64.powi(k);
            let found = blocks(s, 100 * (k + 20) as u64);
            smallest = smallest.min(welch(&found, &expected));
            tests += expected[0].len();
            let relative = difference(&picture(s, kind, 1), &same_seed);
            largest = largest.max(relative / noise);
            curve.push((s, relative));
            level.push((s, noise));
        }
        for s in [-50, -30, 30, 50].map(|k| 2f64.powi(k)) {
            inexact += differing_pixels(&picture(s, kind, 1), &same_seed, &format!("{name}, scale {s:e}"));
        }
        curves.push((format!("{name}, the same random numbers"), curve));
        if curves.len() == 1 {
            curves.push(("other random numbers (noise)".into(), level));
        }
    }
    Outcome::new()
        .at_least(format!("smallest p-value of {tests} Welch tests"), smallest, sidak_level(tests))
        // A hundredth of the noise's power.
        .at_most("difference with the same random numbers, over the noise", largest, 0.1)
        // Scaling by a power of two changes no digit.
        .none("pixels that differ in a bit at scales 2^-50, 2^-30, 2^30 and 2^50", inexact)
        .plot(Plot {
            caption: "Difference of a picture of 8 samples per pixel from that at scale 1".into(),
            x: "scale".into(),
            y: "RMS difference over the mean".into(),
            floor: 1e-9,
            curves,
        })
}

pub(super) fn e11_scenes_in_every_place(effort: Effort) -> Outcome {
    let exponents: Vec<i32> = effort.pick(vec![5, 8, 11], (4..=11).collect());
    let mut largest = 0f64;
    let mut curves = Vec::new();
    for name in ["embree", "bvh"] {
        let Ok(kind) = name.parse() else { continue };
        let expected = picture(1.0, kind, 1);
        let noise = difference(&picture(1.0, kind, 2), &expected);
        let mut curve = Vec::new();
        for &k in &exponents {
            let far = 10f64.powi(k);
            let relative = difference(&picture_at(1.0, [0.9 * far, 0.0, -0.7 * far], kind, 1), &expected);
            largest = largest.max(relative / noise);
            curve.push((far, relative));
        }
        curves.push((format!("{name}, the same random numbers"), curve));
    }
    Outcome::new()
        // A hundredth of the noise's power.
        .at_most("difference with the same random numbers, over the noise", largest, 0.1)
        .plot(Plot {
            caption: "Difference of a picture of 8 samples per pixel from that at the origin".into(),
            x: "distance from the origin, in widths of a shape".into(),
            y: "RMS difference over the mean".into(),
            floor: 1e-9,
            curves,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_pixel_is_the_counterexample() {
        let expected = Image::of_color([3, 2], vec![1.0; 24]);
        let mut found = expected.clone();
        assert_eq!(differing_pixels(&found, &expected, "bvh").count, 0);
        found.layers[0].data[4 * 5 + 2] = 1f32.next_up();
        let faults = differing_pixels(&found, &expected, "bvh");
        let text = "bvh: pixel (2, 1) is [1.0, 1.0, 1.0000001] in place of [1.0, 1.0, 1.0]";
        assert_eq!((faults.count, faults.first.as_deref()), (1, Some(text)));
    }
}
