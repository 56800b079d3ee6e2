//! Curves, points and hair as users give them.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::geometry::Shape;
use steradian::internal::math::Rng;
use steradian::internal::render::{self, Overrides};

use crate::bad_input::{assert_error, assert_faults};
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{AssertIs, Estimate, merge, pixels, prepare, probe, render, render_with};

/// Strands that stand on a ball of radius 1/2 in all directions, of six control points each.
fn ball(count: usize, radius: f64) -> Value {
    let mut rng = Rng::new(7);
    let strand = |_| {
        let root = rng.cube().normalize();
        let bend = 0.3 * rng.cube();
        let points = (0..6).map(|i| {
            let t = f64::from(i - 1) / 3.0;
            let p = root * (0.5 + 0.4 * t) + bend * t * t;
            json!([p.x, p.y, p.z, radius])
        });
        Value::Array(points.collect())
    };
    Value::Array((0..count).map(strand).collect())
}

fn hairy(material: &Value, rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": { "position": [0, 0.3, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 30 },
        "sampler": { "spp": 16 },
        "materials": { "hair": material },
        "shapes": [{ "type": "curves", "material": "hair", "strands": ball(300, 0.01) }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    merge(&mut scene, rest);
    scene
}

#[test]
fn white_hair_in_a_furnace_cannot_be_seen() {
    for kind in ["round", "flat", "cylinder"] {
        let mut scene = hairy(
            &json!({ "type": "hair", "sigma_a": 0 }),
            json!({ "integrator": { "type": "path", "max_depth": 512, "rr_depth": 512, "strategy": "bsdf" } }),
        );
        scene["shapes"][0]["kind"] = json!(kind);
        let image = render(&scene);
        // By directions of the hair alone nothing is random: each weighs 1.
        let off = pixels(&image).flatten().map(|value| (value - 1.0).abs()).fold(0.0, f32::max);
        assert!(off < 2e-3, "{kind}: {off}");
        scene["integrator"]["strategy"] = json!("mis");
        Estimate::of(&render(&scene), 0).assert_is(1.0, kind);
    }
}

#[test]
fn a_straight_curve_looks_like_a_cylinder() {
    let scene = |shape: Value| {
        probe(
            [0.3, 0.5, 3.0],
            [0.0, 0.5, 0.0],
            json!({
                "film": { "width": 48, "height": 48, "filter": { "type": "box" } },
                "camera": { "vertical_fov_degrees": 30 },
                "integrator": { "type": "path", "max_depth": 3 },
                "sampler": { "spp": 64 },
                "materials": { "red": { "type": "diffuse", "albedo": [0.7, 0.2, 0.1] } },
                "shapes": [shape],
                "lights": [{ "type": "directional", "direction": [-1, -1, -2], "irradiance": [3, 3, 3] }]
            }),
        )
    };
    let curve = scene(json!({ "type": "curves", "material": "red", "basis": "linear",
        "strands": [[[0, -0.3, 0, 0.2], [0, 0.4, 0, 0.2], [0, 1.2, 0, 0.2]]] }));
    // The cylinder has an inside, which is behind the front for all rays here.
    let cylinder = scene(json!({ "type": "cylinder", "material": "red", "radius": 0.2, "height": 1.5,
        "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "translate": [0, -0.3, 0] }] }));
    let (a, b) = (render(&curve), render(&cylinder));
    let differing = pixels(&a).zip(pixels(&b)).filter(|(a, b)| (a[0] - b[0]).abs() > 0.02 * b[0].max(0.05)).count();
    let lit = pixels(&a).filter(|pixel| pixel[0] > 0.1).count();
    assert!(lit > 150 && differing * 100 <= lit, "{differing} of {lit}");
}

#[test]
fn curves_and_points_are_the_same_for_any_threads_accelerator_and_replay() {
    let mut scene = hairy(
        &json!({ "type": "hair", "eumelanin": 0.4, "azimuthal_roughness": 0.2 }),
        json!({ "integrator": { "type": "path", "max_depth": 12, "rr_depth": 5 }, "sampler": { "spp": 4 },
            "lights": [{ "type": "directional", "direction": [-1, -2, -1], "irradiance": 2 }] }),
    );
    let shapes = scene["shapes"].as_array_mut().unwrap();
    shapes.push(json!({ "type": "points", "centers": [[0, 0, 0], [0.3, 0.8, 0.1]], "radii": [0.5, 0.1] }));
    shapes.push(json!({ "type": "curves", "kind": "flat", "strands": ball(20, 0.03),
        "motion": [{ "time": 0 }, { "time": 1, "transform": [{ "translate": [0.3, 0, 0] }] }] }));
    let with = |threads, kind| {
        let prepared = prepare(&scene, &Overrides { threads: Some(threads), ..Overrides::default() });
        render_with(&prepared, kind).image
    };
    let image = with(1, AccelKind::EMBREE);
    assert!(with(3, AccelKind::EMBREE) == image);
    for name in ["bvh", "kdtree", "octree", "linear", "packets"] {
        let other = with(2, name.parse().unwrap());
        let differing = pixels(&image).zip(pixels(&other)).filter(|(a, b)| a != b).count();
        // Instances are entered in f32 by Embree, where they do not move.
        assert!(differing <= 6, "{name}: {differing}");
    }
    let prepared = prepare(&scene, &Overrides { spp: Some(1), ..Overrides::default() });
    let image = render_with(&prepared, AccelKind::EMBREE).image;
    let accel = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1).unwrap();
    for pixel in [[12, 11], [8, 13], [15, 6]] {
        let sample = render::replay(&prepared.scene, &*accel, &prepared.settings, pixel, 0).unwrap();
        assert_eq!(sample.pixel.radiance.to_array(), image.rgb(pixel[0], pixel[1]).unwrap(), "{pixel:?}");
    }
}

#[test]
fn strands_have_colours() {
    let strands = json!([
        [[-1, 0.5, 0, 0.3], [0, 0.5, 0, 0.3], [1, 0.5, 0, 0.3]],
        [[-1, -0.5, 0, 0.3], [0, -0.5, 0, 0.3], [1, -0.5, 0, 0.3]]
    ]);
    let seen = |colors: Value, y: f64, x: f64| {
        let mut scene = probe(
            [x, y, 3.0],
            [x, y, 0.0],
            json!({
                "integrator": { "type": "path", "max_depth": 2 },
                "textures": { "colors": { "type": "vertex_color" } },
                "materials": { "dyed": { "type": "diffuse", "albedo": { "texture": "colors" } } },
                "shapes": [{
                    "type": "curves", "basis": "linear", "material": "dyed", "strands": strands, "colors": colors
                }],
                "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
            }),
        );
        scene["integrator"]["strategy"] = json!("bsdf");
        render(&scene).rgb(0, 0).unwrap()
    };
    let by_strand = json!([[0.8, 0, 0], [0, 0.4, 0]]);
    assert!((seen(by_strand.clone(), 0.5, 0.5)[0] - 0.8).abs() < 1e-3);
    assert!((seen(by_strand, -0.5, 0.5)[1] - 0.4).abs() < 1e-3);
    let by_point = json!([[0, 0, 0], [0.4, 0, 0], [0.8, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]);
    assert!((seen(by_point, 0.5, 0.5)[0] - 0.6).abs() < 1e-2);
}

#[test]
fn files_of_strands_and_points_are_read() {
    let folder = Folder::new();
    folder.write("hair.txt", "0 0 0 0.1\n0 1 0 0.1\n\n1 0 0 0.1\n1 1 0 0.1\n1 2 0 0.05\n");
    folder.write("bad.txt", "0 0 0 0.1\n0 1 0\n");
    folder.write(
        "dots.ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
         property float radius_x\nend_header\n0 0 0 0.5\n2 0 0 0.25\n",
    );
    let mut scene = good_scene();
    set(
        &mut scene,
        "shapes[0]",
        json!({ "type": "curves", "file": "hair.txt", "basis": "linear", "radius_scale": 2,
        "transform": [{ "scale": 3 }, { "translate": [0, 1, 0] }] }),
    );
    set(&mut scene, "shapes[1]", json!({ "type": "points", "file": "dots.ply", "radius": 2 }));
    let compiled = folder.compile(&scene).unwrap();
    let Shape::Curves(curves) = &compiled.geometry.shapes[0] else { panic!("no curves") };
    assert_eq!((curves.strand_count(), curves.prim_count(), curves.point_count()), (2, 3, 5));
    let Shape::Points(points) = &compiled.geometry.shapes[1] else { panic!("no points") };
    assert_eq!(points.prim_count(), 2);
    set(&mut scene, "shapes[0].file", json!("bad.txt"));
    assert_error(&folder, &scene, ErrorKind::Scene, &["shapes[0].file", "bad.txt", "line 2"]);
    set(&mut scene, "shapes[0].file", json!("none.txt"));
    assert_error(&folder, &scene, ErrorKind::AssetMissing, &["shapes[0].file", "none.txt"]);
}

#[test]
fn what_curves_points_and_hair_cannot_be() {
    let strand = json!([[[0, 0, 0, 0.1], [1, 0, 0, 0.1], [2, 0, 0, 0.1], [3, 0, 0, 0.1]]]);
    let curves = |key: &str, value: Value| {
        let mut shape = json!({ "type": "curves", "strands": strand });
        shape[key] = value;
        shape
    };
    let points = |key: &str, value: Value| {
        let mut shape = json!({ "type": "points", "centers": [[0, 0, 0]] });
        shape[key] = value;
        shape
    };
    let hair = |key: &str, value: Value| {
        let mut material = json!({ "type": "hair" });
        material[key] = value;
        material
    };
    assert_faults(&[
        ("shapes[0]", json!({ "type": "curves" }), "shapes[0]", "`file` or `strands`"),
        ("shapes[0]", curves("strands", json!([])), "shapes[0]", "no strands"),
        ("shapes[0]", curves("strands", json!([[[0, 0, 0, 1]]])), "shapes[0]", "strand 0 has 1 points"),
        (
            "shapes[0]",
            curves("strands", json!([[[0, 0, 0, -1], [1, 0, 0, 1], [2, 0, 0, 1], [3, 0, 0, 1]]])),
            "shapes[0]",
            "radius of point 0",
        ),
        ("shapes[0]", curves("radius_scale", json!(0)), "shapes[0].radius_scale", "above 0"),
        ("shapes[0]", curves("colors", json!([[1, 1, 1], [0, 0, 0]])), "shapes[0].colors", "2 for 1 strands"),
        ("shapes[0]", curves("root_uvs", json!([])), "shapes[0]", "0 root uvs"),
        ("shapes[0]", curves("emission", json!({ "radiance": 1 })), "shapes[0].emission", "cannot emit"),
        ("shapes[0]", curves("reverse_normal", json!(true)), "shapes[0].reverse_normal", "no other side"),
        (
            "shapes[0]",
            curves("transform", json!([{ "scale": [1, 2, 1] }])),
            "shapes[0].transform",
            "same along all axes",
        ),
        ("shapes[0]", points("centers", json!([])), "shapes[0]", "no points"),
        ("shapes[0]", points("radii", json!([1, 2])), "shapes[0].radii", "2 for 1 centers"),
        ("shapes[0]", points("radii", json!([-1])), "shapes[0]", "radius of point 0"),
        ("shapes[0]", points("emission", json!({ "radiance": 1 })), "shapes[0].emission", "cannot emit"),
        ("materials.paint", hair("ior", json!(1)), "materials.paint.ior", "above 1"),
        ("materials.paint", hair("azimuthal_roughness", json!(1.5)), "materials.paint.azimuthal_roughness", "1.5"),
        ("materials.paint", hair("sigma_a", json!([-1, 0, 0])), "materials.paint.sigma_a", "-1"),
        ("materials.paint", json!({ "type": "hair", "sigma_a": 1, "color": 0.5 }), "materials.paint", "one of `color`"),
    ]);
}

#[test]
fn half_a_million_hairs_fit_into_a_gigabyte() {
    const COUNT: usize = 4_000;
    let scene = hairy(&json!({ "type": "hair" }), json!({ "shapes": [] }));
    let mut scene = scene;
    scene["shapes"] = json!([{ "type": "curves", "material": "hair", "strands": ball(COUNT, 0.002) }]);
    let geometry = prepare(&scene, &Overrides::default()).scene.geometry;
    let accel = accel::build(AccelKind::EMBREE, &geometry, 2).unwrap();
    let bytes = (geometry.memory_bytes() + accel.memory_bytes()) / COUNT * 500_000;
    assert!(bytes < 1_000_000_000, "{bytes}");
}
