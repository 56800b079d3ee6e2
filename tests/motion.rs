use steradian::accel::{AccelKind, build};
use steradian::geometry::{Instance, Mesh, Shape};
use steradian::math::Ray;

use serde_json::{Value, json};

use crate::util::folder::Folder;
use crate::util::geometry::{Rng, ids, ray_through};
use crate::util::render::{AssertIs, Estimate, probe, render};
use crate::util::scenes::moving_scene;

fn rays(rng: &mut Rng, count: usize) -> Vec<Ray> {
    let time = |rng: &mut Rng, i: usize| [0.0, 0.4, 0.5, 1.0, rng.unit() as f32][i % 5];
    (0..count).map(|i| Ray { time: time(rng, i), ..ray_through(5.0 * rng.cube(), 2.0 * rng.cube()) }).collect()
}

#[test]
fn at_each_time_a_moving_scene_is_one_at_rest() {
    let mut rng = Rng::new(82);
    let geometry = moving_scene(&mut rng);
    let moving = build(AccelKind::EMBREE, &geometry, 1).unwrap();
    for time in [0.0f32, 0.2, 0.4, 0.75, 1.0] {
        let mut frozen = geometry.clone();
        for instance in &mut frozen.instances {
            *instance = Instance::new(instance.object, *instance.transform_at(time));
        }
        for shape in &mut frozen.shapes {
            if let Shape::Mesh(mesh) = shape
                && mesh.is_deforming()
            {
                let points = (0..mesh.triangles().len()).flat_map(|i| {
                    let t = mesh.triangle_points_at(steradian::id::PrimId::new(i), time);
                    [t.a, t.b, t.c].map(|p| p.to_array())
                });
                let positions: Vec<_> = points.collect();
                let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                *mesh = Mesh::new(positions, triangles, None, None).unwrap();
            }
        }
        let still = build(AccelKind::EMBREE, &frozen, 1).unwrap();
        let (mut hits, mut different) = (0, 0);
        for ray in rays(&mut rng, 3_000) {
            let ray = Ray { time, ..ray };
            let (a, b) = (moving.intersect(&ray), still.intersect(&ray));
            hits += usize::from(a.is_some());
            different += usize::from(a.map(|h| ids(&h)) != b.map(|h| ids(&h)));
            let (Some(a), Some(b)) = (a, b) else { continue };
            if ids(&a) != ids(&b) {
                continue;
            }
            let (a, b) = (geometry.interaction(&ray, &a).unwrap(), frozen.interaction(&ray, &b).unwrap());
            assert!((a.p - b.p).length() < 1e-5 && (a.n_g - b.n_g).length() < 1e-3, "{a:?} {b:?}");
            assert_eq!(a.time, time);
            assert_eq!(a.spawn(a.n_g).time, time);
        }
        assert!(hits > 300 && different <= 2, "{time}: {different} of {hits}");
    }
}

/// A black card that passes before a white sky, in the middle of the picture for half of the time.
fn passing_card(shapes: Value, rest: Value) -> Value {
    let mut scene = json!({
        "materials": { "black": { "type": "diffuse", "albedo": 0 } },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "shapes": shapes,
    });
    crate::util::render::merge(&mut scene, rest);
    let mut scene = probe([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], scene);
    scene["camera"]["up"] = json!([0, 1, 0]);
    scene
}

#[test]
fn a_card_is_seen_as_long_as_it_is_there() {
    let card = json!({ "type": "quad", "material": "black", "origin": [-0.5, -1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 2, 0] });
    let path = json!([{ "time": 0, "transform": [{ "translate": [-1, 0, 0] }] }, { "time": 1, "transform": [{ "translate": [1, 0, 0] }] }]);
    let mut moving = card.clone();
    moving["motion"] = path.clone();
    let ball = json!({ "type": "sphere", "material": "black", "radius": 0.5, "motion": path });
    let deforming = json!({
        "type": "mesh", "material": "black", "triangles": [[0, 1, 2], [0, 2, 3]],
        "positions": [[-1.5, -1, 0], [-0.5, -1, 0], [-0.5, 1, 0], [-1.5, 1, 0]],
        "deform_positions": [[[0.5, -1, 0], [1.5, -1, 0], [1.5, 1, 0], [0.5, 1, 0]]],
    });
    let scenes = [
        ("shape", passing_card(json!([moving]), json!({}))),
        ("sphere", passing_card(json!([ball]), json!({}))),
        ("deforming mesh", passing_card(json!([deforming]), json!({}))),
        (
            "instance",
            passing_card(json!([]), json!({ "objects": { "o": { "shapes": [card] } }, "instances": [{ "object": "o", "motion": path }] })),
        ),
        (
            "shape in an instance",
            passing_card(json!([]), json!({ "objects": { "o": { "shapes": [moving] } }, "instances": [{ "object": "o" }] })),
        ),
    ];
    for (what, scene) in scenes {
        Estimate::of(&render(&scene), 1).assert_is(0.5, what);
    }
}

#[test]
fn what_cannot_move_is_refused_with_its_place() {
    let still = json!({ "time": 0.5 });
    let flat = json!({ "time": 1, "transform": [{ "scale": [1, 0, 1] }] });
    let mirrored = json!({ "time": 1, "transform": [{ "scale": [1, -1, 1] }] });
    let shifted = json!({ "time": 1, "transform": [{ "translate": [1, 0, 0] }] });
    let lamp = json!({ "radiance": [1, 1, 1] });
    let triangle = json!([[0, 0, 0], [1, 0, 0], [0, 1, 0]]);
    let cases = [
        (json!({ "type": "sphere", "motion": [still, flat] }), "shapes[0].motion[1].transform", "singular"),
        (json!({ "type": "sphere", "motion": [still, mirrored] }), "shapes[0].motion", "singular"),
        (json!({ "type": "sphere", "motion": [still, still] }), "shapes[0].motion[1].time", "grow"),
        (json!({ "type": "sphere", "motion": [still, shifted], "emission": lamp }), "shapes[0].motion", "light"),
        (
            json!({ "type": "mesh", "positions": triangle, "triangles": [[0, 1, 2]], "deform_positions": [[[0, 0, 0]]] }),
            "shapes[0]",
            "1 for 3 vertices",
        ),
        (
            json!({ "type": "mesh", "positions": triangle, "triangles": [[0, 1, 2]], "deform_files": ["a.obj"] }),
            "shapes[0]",
            "a mesh needs either",
        ),
    ];
    for (shape, place, message) in cases {
        let error = Folder::new().compile(&passing_card(json!([shape]), json!({}))).unwrap_err().to_string();
        assert!(error.contains(place) && error.contains(message), "{error}");
    }
}
