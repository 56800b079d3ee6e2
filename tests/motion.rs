use steradian::internal::accel::{AccelKind, build};
use steradian::internal::geometry::{Instance, Mesh, Shape};
use steradian::internal::math::{DVec3, Ray};

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
                    let t = mesh.triangle_points_at(steradian::internal::id::PrimId::new(i), time);
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

#[test]
fn what_turns_about_its_centre_stays_in_place_in_every_accelerator() {
    // A ball away from the origin, and one on a turning arm; by the angle of one and a half turns.
    let centre = [3.0, 1.0, -2.0];
    let turn = json!({ "rotate": { "axis": [1, 2, 2], "degrees": 540 } });
    let in_place = json!([{ "translate": centre.map(|x: f64| -x) }, turn, { "translate": centre }]);
    let scene = json!({
        "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0] },
        "shapes": [
            {
                "type": "sphere", "radius": 0.8, "transform": [{ "translate": centre }],
                "motion": [{ "time": 0 }, { "time": 1, "transform": in_place }]
            },
            {
                "type": "sphere", "radius": 0.5,
                "motion": [
                    { "time": 0, "transform": [{ "translate": [2, 0, 0] }] },
                    {
                        "time": 1,
                        "transform": [{ "translate": [2, 0, 0] }, { "rotate": { "axis": [0, 0, 1], "degrees": 540 } }]
                    }
                ]
            }
        ],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    let scene = Folder::new().compile(&scene).unwrap();
    let accelerators =
        AccelKind::ALL.iter().map(|&(kind, _)| build(kind, &scene.geometry, 1).unwrap()).collect::<Vec<_>>();
    let mut rng = Rng::new(7);
    let mut hits = [0; 2];
    for i in 0..6_000 {
        let time = [0.0, 0.25, 0.5, 0.75, 1.0, rng.unit() as f32][i % 6];
        let angle = (540.0 * f64::from(time)).to_radians();
        let centres = [DVec3::from(centre), 2.0 * DVec3::new(angle.cos(), angle.sin(), 0.0)];
        let k = i / 6 % 2;
        let (middle, radius) = (centres[k], [0.8, 0.5][k]);
        let ray = Ray { time, ..ray_through(middle + 6.0 * rng.direction(), middle + 0.9 * radius * rng.cube()) };
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
        let distance = |i: usize| (centres[i] - origin).cross(direction).length() - [0.8, 0.5][i];
        // Not within rounding of an edge, nor with the other ball on the way.
        if distance(k).abs() < 1e-3 || distance(1 - k) < 1e-3 {
            continue;
        }
        for accelerator in &accelerators {
            let hit = accelerator.intersect(&ray);
            assert_eq!(hit.is_some(), distance(k) < 0.0, "{} {time}", accelerator.description());
            let Some(hit) = hit else { continue };
            let p = scene.geometry.interaction(&ray, &hit).unwrap().p;
            assert!(((p - middle).length() - radius).abs() < 1e-5, "{} {time}: {p}", accelerator.description());
            hits[k] += 1;
        }
    }
    assert!(hits.iter().all(|&hits| hits > 5_000), "{hits:?}");
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
    let card = json!({
        "type": "quad", "material": "black", "origin": [-0.5, -1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 2, 0]
    });
    let path = json!([
        { "time": 0, "transform": [{ "translate": [-1, 0, 0] }] },
        { "time": 1, "transform": [{ "translate": [1, 0, 0] }] }
    ]);
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
            passing_card(
                json!([]),
                json!({ "objects": { "o": { "shapes": [card] } }, "instances": [{ "object": "o", "motion": path }] }),
            ),
        ),
        (
            "shape in an instance",
            passing_card(
                json!([]),
                json!({ "objects": { "o": { "shapes": [moving] } }, "instances": [{ "object": "o" }] }),
            ),
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
            json!({
                "type": "mesh", "positions": triangle, "triangles": [[0, 1, 2]], "deform_positions": [[[0, 0, 0]]]
            }),
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
