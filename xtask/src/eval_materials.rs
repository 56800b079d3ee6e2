//! Values of materials for pairs of directions, to compare with other renderers; `tools/mitsuba_materials.py` does.
//!
//! Reads `{ "materials": [MATERIAL, ...], "pairs": [[WO, WI], ...] }` from standard input, where a material is as in a
//! scene file and directions are unit and local (`z` is the normal), and writes for each material and each pair
//! `[red, green, blue, pdf]` of `f(wo, wi) |cos wi|` as JSON.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};
use steradian::Result;
use steradian::internal::id::ShapeId;
use steradian::internal::math::{Vec2, Vec3};
use steradian::internal::texture::Footprint;
use steradian::internal::{compile, import};

use crate::Outcome;

#[derive(Deserialize)]
struct Request {
    materials: Vec<Value>,
    pairs: Vec<[[f32; 3]; 2]>,
}

pub fn run() -> Outcome {
    let request: Request = serde_json::from_reader(std::io::stdin())?;
    let values: Vec<_> =
        request.materials.iter().map(|material| evaluate(material, &request.pairs)).collect::<Result<_>>()?;
    println!("{}", json!(values));
    Ok(())
}

fn evaluate(material: &Value, pairs: &[[[f32; 3]; 2]]) -> Result<Vec<[f32; 4]>> {
    let path = Path::new("material.json");
    let scene = json!({
        "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "materials": { "m": material },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "shapes": [{ "type": "sphere", "material": "m" }]
    });
    let scene = compile::compile(&import::parse_scene(&scene.to_string(), path)?, path)?;
    let bsdf = scene.material(ShapeId::new(0)).bsdf(&scene.textures, || Footprint::point(Vec2::ZERO));
    let values = pairs.iter().map(|pair| {
        let [wo, wi] = pair.map(Vec3::from_array);
        let eval = bsdf.eval(wo, wi);
        [eval.value.r, eval.value.g, eval.value.b, eval.pdf]
    });
    Ok(values.collect())
}
