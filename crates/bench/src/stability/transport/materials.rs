//! White convex objects in white surroundings.

use super::{Effort, Outcome, PIXELS, Tests, Value, json, mean, scene};

/// How white a material is at its whitest.
#[derive(Clone, Copy, PartialEq)]
enum Whiteness {
    /// All light comes back, to rounding.
    Exact,
    /// All light comes back, to this part of it: energies are tabulated.
    Tabulated(f64),
    /// Some light is lost.
    Lossy,
}

use Whiteness::{Exact, Lossy, Tabulated};

/// The material `m` with further parameters.
fn with(mut m: Value, rest: Value) -> Value {
    super::merge(&mut m, rest);
    json!({ "m": m })
}

fn metal(rest: Value) -> Value {
    with(json!({ "type": "conductor", "eta": [0.01, 0.01, 0.01], "k": [1e4, 1e4, 1e4] }), rest)
}

fn glass(rest: Value) -> Value {
    with(json!({ "type": "dielectric", "ior": 1.5 }), rest)
}

fn principled(rest: Value) -> Value {
    with(json!({ "type": "principled", "base_color": 1.0 }), rest)
}

fn white() -> Value {
    json!({ "type": "diffuse", "albedo": 1.0 })
}

fn mirror() -> Value {
    json!({ "type": "mirror", "reflectance": 1.0 })
}

/// A material at its whitest; the object has the material `m`.
type Case = (&'static str, Whiteness, Value);

/// Materials from which all light comes back.
fn exact_materials() -> Vec<Case> {
    vec![
        ("diffuse", Exact, json!({ "m": white() })),
        ("rough diffuse", Exact, json!({ "m": { "type": "diffuse", "albedo": 1.0, "roughness": 0.5 } })),
        ("roughest diffuse", Exact, json!({ "m": { "type": "diffuse", "albedo": 1.0, "roughness": 1.0 } })),
        (
            "diffuse transmission",
            Exact,
            json!({ "m": { "type": "diffuse_transmission", "reflectance": 0.5, "transmittance": 0.5 } }),
        ),
        ("mirror", Exact, json!({ "m": mirror() })),
        ("smooth metal", Exact, metal(json!({}))),
        ("glass", Exact, glass(json!({}))),
        ("glass of index 1.0001", Exact, glass(json!({ "ior": 1.0001 }))),
        ("diamond", Exact, glass(json!({ "ior": 2.4 }))),
        ("air in glass", Exact, glass(json!({ "ior": 0.66 }))),
        ("glass as a medium", Exact, glass(json!({ "priority": 1 }))),
        ("dispersive glass", Exact, glass(json!({ "abbe": 30 }))),
        ("pane", Exact, json!({ "m": { "type": "thin_dielectric", "ior": 1.5 } })),
        (
            "mix",
            Exact,
            json!({ "m": { "type": "mix", "materials": ["a", "b"], "amount": 0.3 }, "a": white(), "b": mirror() }),
        ),
        (
            "two sides",
            Exact,
            json!({ "m": { "type": "two_sided", "front": "a", "back": "b" }, "a": white(), "b": mirror() }),
        ),
    ]
}

/// Rough materials, and those that lose light, with the bound of `docs/materials.md`.
fn other_materials() -> Vec<Case> {
    let plastic = |alpha: Value| json!({ "m": { "type": "plastic", "albedo": 1.0, "ior": 1.5, "alpha": alpha } });
    let coated =
        |alpha: Value, base: Value| json!({ "m": { "type": "coated", "base": "b", "alpha": alpha }, "b": base });
    vec![
        ("smooth plastic", Tabulated(0.002), json!({ "m": { "type": "plastic", "albedo": 1.0, "ior": 1.5 } })),
        ("plastic, alpha 0.1", Tabulated(0.002), plastic(json!(0.1))),
        ("plastic, alpha 0.5", Tabulated(0.002), plastic(json!(0.5))),
        ("plastic, anisotropic", Tabulated(0.015), plastic(json!([0.3, 0.1]))),
        ("coated diffuse", Tabulated(0.005), coated(json!(0.2), white())),
        ("coated mirror", Tabulated(0.005), coated(json!(0.2), mirror())),
        ("coated diffuse, anisotropic", Tabulated(0.015), coated(json!([0.3, 0.1]), white())),
        ("metal, alpha 0.05", Tabulated(0.01), metal(json!({ "alpha": 0.05 }))),
        ("metal, alpha 0.5", Tabulated(0.01), metal(json!({ "alpha": 0.5 }))),
        ("metal, alpha 1", Tabulated(0.01), metal(json!({ "alpha": 1.0 }))),
        ("metal, anisotropic", Tabulated(0.02), metal(json!({ "alpha": [0.3, 0.1] }))),
        ("rough glass, alpha 0.1", Tabulated(0.03), glass(json!({ "alpha": 0.1 }))),
        ("rough glass, alpha 0.3", Tabulated(0.03), glass(json!({ "alpha": 0.3 }))),
        ("rough glass, anisotropic", Lossy, glass(json!({ "alpha": [0.3, 0.1] }))),
        ("metal, single scattering", Lossy, metal(json!({ "alpha": 0.5, "multiscatter": false }))),
        ("rough glass, single scattering", Lossy, glass(json!({ "alpha": 0.3, "multiscatter": false }))),
        ("principled", Lossy, principled(json!({}))),
        ("principled metal", Lossy, principled(json!({ "metallic": 1, "roughness": 0.7 }))),
        ("principled glass", Lossy, principled(json!({ "transmission": 1, "roughness": 0.2 }))),
        ("principled cloth", Lossy, principled(json!({ "sheen": 1, "subsurface": 1, "roughness": 1 }))),
        ("principled lacquer", Lossy, principled(json!({ "clearcoat": 1, "specular": 1 }))),
        ("phong", Lossy, json!({ "m": { "type": "phong", "diffuse": 0.5, "specular": 0.5 } })),
        (
            "phong, cosine lobe",
            Lossy,
            json!({ "m": { "type": "phong", "diffuse": 0.5, "specular": 0.5, "lobe": "cosine" } }),
        ),
        ("cook and torrance", Lossy, json!({ "m": { "type": "cook_torrance", "albedo": 1.0, "f0": 1.0 } })),
    ]
}

fn surroundings(spp: u32, materials: &Value, shape: &Value) -> Value {
    scene(
        spp,
        json!({
            "integrator": { "type": "path", "max_depth": 512, "rr_depth": 100 },
            "materials": materials,
            "shapes": [shape],
            "lights": [{ "type": "environment", "radiance": [1.0, 1.0, 1.0] }]
        }),
    )
}

pub(super) fn i3_white_furnace(effort: Effort) -> Outcome {
    let spp = effort.pick(16, 600);
    let sphere = json!({ "type": "sphere", "material": "m" });
    let cube = json!({ "type": "cube", "material": "m",
        "transform": [{ "scale": 0.8 }, { "rotate": { "axis": [1, 1, 0], "degrees": 30 } }] });
    let (mut tests, mut gains) = (Tests::new(), Tests::new());
    let (mut tabulated, mut lossy) = ((0f64, ""), (1f64, ""));
    for (name, whiteness, materials) in exact_materials().into_iter().chain(other_materials()) {
        // Dispersion follows one colour of three.
        let spp = if name == "dispersive glass" { 8 * spp } else { spp };
        let found = mean(&surroundings(spp, &materials, &sphere), 1);
        let slack = match whiteness {
            Exact => 0.0,
            Tabulated(slack) => slack,
            Lossy => {
                if found.mean < lossy.0 {
                    lossy = (found.mean, name);
                }
                // What is missing is no gain; the tables of energies are good to 0.5 %.
                let gain = super::Estimate { mean: found.mean.max(1.0), error: found.error };
                gains.mean(name, gain, PIXELS, 1.0, 0.005);
                continue;
            }
        };
        tests.mean(name, found, PIXELS, 1.0, slack);
        if whiteness == Exact {
            tests.mean(&format!("{name}, cube"), mean(&surroundings(spp, &materials, &cube), 1), PIXELS, 1.0, slack);
        } else if (found.mean - 1.0).abs() > tabulated.0 {
            tabulated = ((found.mean - 1.0).abs(), name);
        }
    }
    let outcome = gains.judge(Outcome::new());
    tests
        .judge_means(outcome, effort.pick(0.03, 0.005))
        .record(format!("largest distance from 1 with tabulated energies ({})", tabulated.1), tabulated.0)
        .record(format!("radiance of the darkest that is not compensated ({})", lossy.1), lossy.0)
        .short(
            "1 ± 4 standard errors is asked of all compensated materials: energies of rough surfaces come from tables, \
             with the slack that docs/materials.md states (plastic 0.2 %, coats 0.5 %, metal 1 %, glass 3 %); \
             anisotropic glass, principled, phong and cook_torrance are not compensated, and only must not gain",
        )
}
