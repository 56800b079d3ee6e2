//! A folder of scene files and assets that lasts as long as a test.

use std::path::PathBuf;

use serde_json::{Value, json};
use steradian::Result;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::Image;
use steradian::internal::render::{Overrides, Settings};
use steradian::internal::scene::Scene;
use steradian::internal::{compile, import};

use super::render::{Prepared, render_with};

/// A temporary folder.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    /// Where a file of this name lies, or would.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Compiles a scene and renders it through Embree.
    pub fn render(&self, scene: &Value) -> Image {
        let path = self.write("scene.json", scene.to_string());
        let desc = import::load_scene(&path).unwrap();
        let settings = Settings::new(&desc, &Overrides { threads: Some(2), ..Overrides::default() }).unwrap();
        let scene = compile::compile(&desc, &path).unwrap();
        render_with(&Prepared { scene, settings }, AccelKind::EMBREE).image
    }

    /// Writes `scene.json`, loads and compiles it.
    pub fn compile(&self, scene: &Value) -> Result<Scene> {
        let path = self.write("scene.json", serde_json::to_string_pretty(scene).unwrap());
        compile::compile(&import::load_scene(&path)?, &path)
    }
}

/// A scene with one of everything, without fault.
pub fn good_scene() -> Value {
    json!({
        "film": { "width": 64, "height": 32, "crop": [8, 8, 16, 16], "filter": { "type": "gaussian" } },
        "camera": {
            "position": [0, 1, 5], "look_at": [0, 1, 0], "up": [0, 1, 0], "vertical_fov_degrees": 30,
            "lens": { "radius": 0.1, "focus_distance": 4 }
        },
        "integrator": { "type": "path" },
        "sampler": { "spp": 4 },
        "textures": {
            "tiles": { "type": "checker", "scale": [2, 2] }, "grey": { "type": "constant", "color": [0.5, 0.5, 0.5] }
        },
        "materials": {
            "Gold": { "type": "conductor", "metal": "gold", "roughness": 0.3 },
            "tiled": { "type": "diffuse", "albedo": { "texture": "tiles" } },
            "glass": { "type": "dielectric", "ior": 1.5 },
            "paint": { "type": "plastic", "albedo": [0.1, 0.2, 0.3], "alpha": [0.1, 0.2] },
            "mirror": { "type": "mirror", "reflectance": { "texture": "grey" } }
        },
        "shapes": [
            { "type": "sphere", "material": "Gold", "transform": [{ "translate": [0, 1, 0] }] },
            {
                "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]],
                "emission": { "radiance": [1, 1, 1] }
            },
            { "type": "quad", "material": "tiled" },
            { "type": "disk" },
            { "type": "cylinder" },
            { "type": "cone" },
            { "type": "revolution", "profile": { "bezier": [[1, 0], [1, 1], [1, 2], [1, 3]] } },
            { "type": "cube", "material": "paint" }
        ],
        "objects": {
            "lamp": {
                "shapes": [
                    { "type": "disk", "material": "glass" }, { "type": "sphere", "emission": { "radiance": [1, 2, 3] } }
                ]
            },
            "pair": {
                "instances": [{ "object": "lamp" }, { "object": "lamp", "transform": [{ "translate": [2, 0, 0] }] }]
            }
        },
        "instances": [{ "object": "pair", "transform": [{ "scale": 2 }] }],
        "lights": [
            { "type": "point", "position": [0, 5, 0], "intensity": [1, 1, 1] },
            { "type": "spot", "position": [0, 5, 0], "look_at": [0, 0, 0], "intensity": [1, 1, 1] },
            {
                "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1], "angular_diameter_degrees": 0.5
            },
            { "type": "environment", "radiance": [0.1, 0.1, 0.1] }
        ],
        "outputs": [{ "file": "out.exr", "layers": ["Z", "albedo"] }]
    })
}

/// Sets what `path` names, such as `shapes[3].radius`; a null takes it away.
pub fn set(scene: &mut Value, path: &str, value: Value) {
    let path = path.replace('[', ".[");
    let mut node = &mut *scene;
    for part in path.split('.').filter(|part| !part.is_empty()) {
        node = match part.strip_prefix('[').and_then(|p| p.strip_suffix(']')) {
            Some(index) => {
                if node.is_null() {
                    *node = json!([]);
                }
                let (list, index) = (node.as_array_mut().unwrap(), index.parse::<usize>().unwrap());
                if list.len() <= index {
                    list.resize(index + 1, Value::Null);
                }
                &mut list[index]
            }
            None => &mut node[part],
        };
    }
    *node = value;
    drop_nulls(scene);
}

fn drop_nulls(node: &mut Value) {
    match node {
        Value::Object(map) => {
            map.retain(|_, value| !value.is_null());
            map.values_mut().for_each(drop_nulls);
        }
        Value::Array(list) => list.iter_mut().for_each(drop_nulls),
        _ => {}
    }
}
