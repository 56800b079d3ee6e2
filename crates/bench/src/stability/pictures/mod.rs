//! Group R: pictures.

mod agreement;
mod convergence;
mod gallery;
mod needs;

use serde_json::{Value, json};

use super::render::{Prepared, merge, pixels, prepare, render_with};
use super::verdict::Tests;
use super::{Effort, Faults, Outcome};
use crate::accel::AccelKind;
use crate::film::Image;
use crate::render::Overrides;

use agreement::{r1_agreement, r3_power};
use convergence::r5_convergence;
use gallery::r8_gallery;
use needs::r7_pay_for_use;

checks! {
    "R1" r1_agreement "independent renders of one scene agree":
        "a room of 32 x 32 pixels, mean and variance by renders with other seeds: each pixel by Welch's test, 99.75 % \
         of them within Šidák's level of 1 %, p-values uniform, the whole picture (Mitsuba 3, test_renders; against \
         other renders of Steradian: Mitsuba's are compared by xtask/src/compare_refs)";
    "R3" r3_power "power of that test":
        "the same room with a lamp 1 % brighter, one material 1 % whiter, paths one segment longer: each must be \
         rejected";
    "R5" r5_convergence "error against samples":
        "relative squared error of the room for 1, 2, 4, ... samples a pixel against many Sobol samples: falls as 1 / \
         n (with and without the largest thousandth of pixels)";
    "R7" r7_pay_for_use "nothing is paid for that is not used":
        "what triangles at rest without holes and each feature alone register with Embree, and rays of pictures that \
         need no second one";
    "R8" r8_gallery "gallery":
        "every scene of the folder scenes if it is there, else cornell, glass and phi_max, small, with two seeds: \
         numbers that are not finite, pixels above 20 times the median of the 24 around them in one of both pictures";
}

/// Width and height of pictures: one tile.
const SIDE: u32 = 32;

/// Pixels of a picture.
const PIXELS: usize = (SIDE * SIDE) as usize;

/// A scene seen from 6 along z.
fn scene(rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": SIDE, "height": SIDE, "filter": { "type": "box" } },
        "camera": { "position": [0.0, 0.0, 6.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 30.0 },
    });
    merge(&mut scene, rest);
    scene
}

/// A room with a lamp that fills its ceiling, and two balls; paths of up to four segments.
fn room() -> Value {
    let wall = |origin: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        json!({
            "type": "quad", "material": "grey", "origin": origin, "edge_u": u, "edge_v": v
        })
    };
    let mut lamp = wall([-1.0, 1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    lamp["emission"] = json!({ "radiance": [5, 4, 3] });
    scene(json!({
        "camera": { "position": [0.0, 0.0, 4.5] },
        "integrator": { "type": "path", "max_depth": 4 },
        "materials": {
            "grey": { "type": "diffuse", "albedo": 0.5 },
            "metal": { "type": "conductor", "metal": "copper", "alpha": 0.3 },
            "clay": { "type": "plastic", "albedo": [0.6, 0.4, 0.3], "alpha": 0.2 }
        },
        "shapes": [
            wall([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]),
            wall([-1.0, -1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            wall([-1.0, -1.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0]),
            wall([1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]),
            {
                "type": "sphere", "material": "metal", "radius": 0.4, "transform": [{ "translate": [-0.4, -0.6, -0.2] }]
            },
            lamp,
            { "type": "sphere", "material": "clay", "radius": 0.35, "transform": [{ "translate": [0.45, -0.65, 0.2] }] }
        ]
    }))
}

/// A scene with a number of samples per pixel.
fn prepared(scene: &Value, spp: u32) -> Prepared {
    prepare(scene, &Overrides { threads: Some(2), spp: Some(spp), ..Overrides::default() })
}

/// The green channel of a picture.
fn luminance(image: &Image) -> Vec<f64> {
    pixels(image).map(|p| f64::from(p[1])).collect()
}

/// A picture for each seed.
fn pictures(mut prepared: Prepared, seeds: impl IntoIterator<Item = u64>) -> Vec<Vec<f64>> {
    let render = |seed| {
        prepared.settings.seed = seed;
        luminance(&render_with(&prepared, AccelKind::EMBREE).image)
    };
    seeds.into_iter().map(render).collect()
}
