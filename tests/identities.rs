//! What shapes, materials and instances are called.

use serde_json::{Value, json};
use steradian::internal::compile;
use steradian::internal::film::ShapeKey;
use steradian::internal::scene::Scene;

use crate::util::folder::Folder;

/// A key of the scene by what is placed: `None` for no instance.
fn key(instance: Option<u32>, shape: u32) -> ShapeKey {
    ShapeKey { instance: instance.unwrap_or(u32::MAX), shape }
}

/// Object, material and asset.
fn names(scene: &Scene, instance: Option<u32>, shape: u32) -> [String; 3] {
    let (identities, key) = (&scene.identities, key(instance, shape));
    [identities.object(key).into_owned(), identities.material(key).to_owned(), identities.asset(key).into_owned()]
}

fn scene() -> Value {
    json!({
        "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 60 },
        "materials": { "red": { "type": "diffuse", "albedo": [1, 0, 0] } },
        "shapes": [
            { "type": "sphere", "material": "red", "name": "ball" },
            { "type": "sphere" },
            { "type": "mesh", "file": "models/two.obj" },
            {
                "type": "quad", "name": "slider",
                "motion": [{ "time": 0 }, { "time": 1, "transform": [{ "translate": [1, 0, 0] }] }]
            },
            { "type": "disk", "name": "quad_5" },
            { "type": "quad" }
        ],
        "objects": {
            "lamp": {
                "shapes": [
                    { "type": "sphere", "name": "bulb", "emission": { "radiance": [1, 1, 1] } }, { "type": "cylinder" }
                ]
            },
            "room": { "shapes": [{ "type": "cube", "material": "red" }],
                      "instances": [{ "object": "lamp", "name": "left" }, { "object": "lamp" }] }
        },
        "instances": [{ "object": "lamp" }, { "object": "room", "name": "hall" }, { "object": "room" }],
        "lights": [{ "type": "point", "position": [0, 4, 0], "intensity": [1, 1, 1] }]
    })
}

#[test]
fn everything_has_a_name() {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("models")).unwrap();
    std::fs::write(folder.path("models/two.mtl"), "newmtl gold\nKd 1 1 0\nnewmtl lead\nKd 0.2 0.2 0.2\n").unwrap();
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gold\nf 1 2 3\nusemtl lead\nf 3 2 1\n";
    std::fs::write(folder.path("models/two.obj"), format!("mtllib two.mtl\n{faces}")).unwrap();
    let scene = folder.compile(&scene()).unwrap();

    let mut shapes: Vec<[String; 3]> = scene.geometry.world.iter().map(|id| names(&scene, None, id.0)).collect();
    for (i, instance) in scene.geometry.instances.iter().enumerate() {
        let object = scene.geometry.object(instance.object);
        shapes.extend(object.shapes.iter().map(|shape| names(&scene, Some(i as u32), shape.0)));
    }
    shapes.sort();
    let mut expected = [
        ["ball", "red", "ball"],
        ["sphere_1", "default", "sphere_1"],
        ["two_2", "gold", "two"],
        ["two_2", "lead", "two"],
        ["slider", "default", "slider"],
        ["quad_5", "default", "quad_5"],
        // The name that it would have is taken.
        ["quad_5_", "default", "quad_5_"],
        ["lamp_0", "default", "lamp"],
        ["lamp_0", "default", "lamp"],
        ["hall", "red", "room"],
        ["room_2", "red", "room"],
        ["hall/left", "default", "room"],
        ["hall/left", "default", "room"],
        ["hall/lamp_1", "default", "room"],
        ["hall/lamp_1", "default", "room"],
        ["room_2/left", "default", "room"],
        ["room_2/left", "default", "room"],
        ["room_2/lamp_1", "default", "room"],
        ["room_2/lamp_1", "default", "room"],
    ];
    expected.sort_unstable();
    assert_eq!(shapes, expected);
    assert_eq!(names(&scene, None, 1_000), [""; 3]);
}

#[test]
fn names_of_many_shapes_take_little_memory() {
    let spheres: Vec<Value> =
        (0..20_000).map(|i| json!({ "type": "sphere", "transform": [{ "translate": [i, 0, 0] }] })).collect();
    let instances: Vec<Value> =
        (0..10_000).map(|i| json!({ "object": "o", "transform": [{ "translate": [i, 3, 0] }] })).collect();
    let mut scene = scene();
    scene["shapes"] = json!(spheres);
    scene["objects"] = json!({ "o": { "shapes": [{ "type": "sphere" }] } });
    scene["instances"] = json!(instances);
    let desc = serde_json::from_value(scene).unwrap();
    let scene = compile::compile(&desc, std::path::Path::new("scene.json")).unwrap();
    assert_eq!(names(&scene, None, 19_999)[0], "sphere_19999");
    assert_eq!(names(&scene, Some(9_999), 20_000)[0], "o_9999");
    let bytes = scene.identities.memory_bytes();
    assert!(bytes < 20_000 * 24 + 10_000 * 24 + 1_000, "{bytes}");
    assert!(10 * bytes < scene.geometry.memory_bytes(), "{bytes} of {}", scene.geometry.memory_bytes());
}
