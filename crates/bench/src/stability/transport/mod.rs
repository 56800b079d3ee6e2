//! Group I: light transport against closed forms.

mod drift;
mod furnaces;
mod irradiance;
mod layers;
mod materials;
mod strategies;

use serde_json::{Value, json};

use super::render::{Estimate, merge, pixels, prepare, render, render_with};
use super::verdict::Tests;
use super::{Effort, Faults, Outcome};

use drift::i12_drift;
use furnaces::{i1_furnaces, i2_depth, i11_seen_directly};
use irradiance::{i4_disk, i5_quad, i6_sphere, i8_slab};
use layers::{i9_alpha, i10_motion};
use materials::i3_white_furnace;
use strategies::i7_strategies;

checks! {
    "I1" i1_furnaces "furnaces":
        "closed sphere of albedo 1/2 that emits 1/2, or with one or four point lights of pi in all: radiance 1, with \
         every sampler and camera, 32 x 32 pixels (pbrt, integrators_test)";
    "I2" i2_depth "depth":
        "the same sphere with up to k = 1 to 8 and 64 segments: 1 - 2^-k, with roulette from the first bounce and \
         without, by every strategy";
    "I3" i3_white_furnace "white convex objects in white surroundings":
        "sphere, or cube, of every material at its whitest under a sky of radiance 1: it vanishes (Heitz), within what \
         docs/materials.md says of tabulated energies";
    "I4" i4_disk "disk light":
        "irradiance by Walsh's formula on the axis and off it, by light sampling, by scattering and by both";
    "I5" i5_quad "quad light":
        "irradiance by Lambert's formula, a quad, two triangles and a sheared quad, by every strategy";
    "I6" i6_sphere "sphere light":
        "irradiance pi L (R / d)² cos, a sphere, one scaled and mirrored, one in two parts, one overhead, by every \
         strategy";
    "I7" i7_strategies "multiple importance sampling":
        "metal of four roughnesses under lamps of two sizes (Veach's plates): the three strategies agree (Welch), and \
         the variance of both together is at most 1.1 times the lesser one, or half of the squared mean more (F-test)";
    "I8" i8_slab "dielectric slab":
        "n = 1.5, all orders of reflection: 1/13 comes back, 12/13 pass, and together they are all there is";
    "I9" i9_alpha "layers of opacity one half":
        "1 to 6 meshes before a sky: 2^-n, by every accelerator and with Embree's spatial splits; nothing along the \
         diagonal where two triangles meet";
    "I10" i10_motion "motion":
        "a card that moves its own width within the shutter's time, as a shape, an instance and a mesh that deforms: a \
         triangle of coverage; with two equal steps, the picture at rest";
    "I11" i11_seen_directly "lights seen directly":
        "quad, sphere, disk and sky, depth 1, 2 and 8: exactly their radiance (Mitsuba 3, test_integrators test02)";
    "I12" i12_drift "drift of a long mean":
        "16 pixels of the furnace at 1, 10, ... samples a pixel (to 1e6 in full): distance from 1, and from the sum \
         without rounding";
}

/// Width and height of pictures whose mean is judged: a whole tile, none of whose paths is wasted.
const SIDE: u32 = 32;

/// Pixels of such a picture.
const PIXELS: usize = (SIDE * SIDE) as usize;

/// A scene with a number of samples per pixel, seen through a narrow angle from 6 along z by default.
fn scene(spp: u32, rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": SIDE, "height": SIDE, "filter": { "type": "box" } },
        "camera": { "position": [0.0, 0.0, 6.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 12.0 },
        "sampler": { "type": "independent", "spp": spp },
    });
    merge(&mut scene, rest);
    scene
}

/// The mean of one channel of a scene's picture.
fn mean(scene: &Value, channel: usize) -> Estimate {
    Estimate::of(&render(scene), channel)
}

/// The three strategies.
const STRATEGIES: [&str; 3] = ["mis", "light", "bsdf"];

/// The scene with a strategy.
fn with_strategy(scene: &Value, strategy: &str) -> Value {
    let mut scene = scene.clone();
    scene["integrator"]["strategy"] = json!(strategy);
    scene
}
