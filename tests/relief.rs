//! Normal maps, bump maps, smooth normals and what they must not do: leak light, blacken rims, make light of nothing.

use image::{ImageBuffer, Luma, Rgb};
use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::bsdf::Bsdf;
use steradian::internal::geometry::SurfaceInteraction;
use steradian::internal::integrator::World;
use steradian::internal::math::{DVec3, Ray, Vec3, vec3};
use steradian::internal::scene::Scene;
use steradian::internal::texture::Footprint;

use crate::util::folder::Folder;
use crate::util::geometry::Rng;
use crate::util::render::{Estimate, merge, pixels};

/// A scene of shapes with material `m`, whose relief is `relief`.
fn scene_of(shapes: Value, relief: Value) -> Value {
    let mut wall = json!({ "type": "relief", "material": "plain" });
    merge(&mut wall, relief);
    json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": { "position": [0.0, 0.0, 9.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 20.0 },
        "sampler": { "type": "independent", "spp": 64 },
        "textures": { "map": { "type": "image", "file": "map.png", "filter": "nearest" } },
        "materials": { "plain": { "type": "diffuse", "albedo": 1.0 }, "m": wall },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1.0, 1.0, 1.0] }]
    })
}

fn normal_map() -> Value {
    json!({ "normal_map": { "texture": "map" } })
}

/// What a ray meets, and the change of the point with v.
fn meet(scene: &Scene, ray: &Ray) -> Option<(SurfaceInteraction, Vec3)> {
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
    let hit = accel.intersect(ray)?;
    Some((World::new(scene, &*accel).resolve(ray, Some(hit))?, scene.geometry.dp_dv(ray, &hit)))
}

fn look(scene: &Scene, origin: Vec3, direction: Vec3) -> SurfaceInteraction {
    meet(scene, &Ray::new(origin, direction.normalize())).expect("the ray meets the shape").0
}

/// One normal everywhere, as a map of one pixel; exact up to the rounding of 16 bits.
fn save_normal(folder: &Folder, n: [f32; 3]) {
    let codes = n.map(|x| ((0.5 * x + 0.5) * 65_535.0).round() as u16);
    ImageBuffer::from_pixel(1, 1, Rgb(codes)).save(folder.path("map.png")).unwrap();
}

fn square(uvs: Value) -> Value {
    json!({
        "type": "mesh", "material": "m", "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
        "triangles": [[0, 1, 2], [0, 2, 3]],
        "uvs": uvs
    })
}

/// Shapes through (0.4, 0.3, z) above the xy plane or around an axis, with uv.
fn shapes() -> Vec<Value> {
    vec![
        json!({ "type": "quad", "material": "m" }),
        json!({ "type": "quad", "material": "m", "reverse_normal": true }),
        json!({ "type": "sphere", "material": "m" }),
        json!({ "type": "disk", "material": "m" }),
        json!({ "type": "cone", "material": "m" }),
        json!({
            "type": "cylinder", "material": "m", "height": 2,
            "transform": [{ "translate": [0, 0, -1] }, { "rotate": { "axis": [0, 1, 0], "degrees": 70 } }]
        }),
        json!({
            "type": "revolution", "material": "m", "profile": { "bezier": [[0.5, -1], [1.5, -1], [1.5, 1], [0.5, 1]] }
        }),
        json!({ "type": "cube", "material": "m" }),
        square(json!([[0, 0], [1, 0], [1, 1], [0, 1]])),
        square(json!([[1, 0], [0, 0], [0, 1], [1, 1]])),
        square(json!([[0, 0], [0, 1], [1, 1], [1, 0]])),
    ]
}

/// A map's normals taken for normals in the world are right on one wall only.
#[test]
fn normal_maps_tilt_along_u_and_v_of_every_shape_wherever_it_stands() {
    let folder = Folder::new();
    let tilt = 0.6f32;
    let transforms = [
        json!([]),
        json!([{ "rotate": { "axis": [1, 2, 3], "degrees": 50 } }]),
        json!([{ "scale": [-1, 1, 1] }, { "rotate": { "axis": [1, 0, 0], "degrees": 20 } }]),
        json!([{ "scale": [2, 1, 0.5] }]),
    ];
    for (map, along_v) in [([tilt, 0.0, 0.8], false), ([0.0, tilt, 0.8], true)] {
        save_normal(&folder, map);
        for shape in shapes() {
            for transform in &transforms {
                for instanced in [false, true] {
                    let mut shape = shape.clone();
                    let mut scene = scene_of(json!([]), normal_map());
                    if instanced {
                        scene["objects"] = json!({ "o": { "shapes": [shape] } });
                        scene["instances"] = json!([{ "object": "o", "transform": transform }]);
                    } else {
                        let own = shape["transform"].as_array().cloned().unwrap_or_default();
                        shape["transform"] = own.into_iter().chain(transform.as_array().cloned().unwrap()).collect();
                        scene["shapes"] = json!([shape]);
                    }
                    let compiled = folder.compile(&scene).unwrap();
                    let (at, dp_dv) = meet(&compiled, &Ray::new(vec3(0.31, 0.17, 5.0), -Vec3::Z))
                        .unwrap_or_else(|| panic!("{scene}"));
                    // The part of the derivative across the other one: what grows u without changing v, seen in the
                    // surface.
                    let (t, b) = (at.dp_du - at.n_g * at.n_g.dot(at.dp_du), dp_dv - at.n_g * at.n_g.dot(dp_dv));
                    let expected = if along_v {
                        at.n_g.cross(t).normalize() * at.n_g.cross(t).dot(b).signum()
                    } else {
                        t.normalize()
                    };
                    let cos = at.n_s.dot(expected);
                    assert!(
                        (cos - tilt).abs() < 2e-4 && (at.n_s.dot(at.n_g) - 0.8).abs() < 2e-4,
                        "{shape} {transform}: {at:?}"
                    );
                    assert!((at.n_s.length() - 1.0).abs() < 1e-5);
                }
            }
        }
    }
}

#[test]
fn a_map_for_directx_has_its_green_downward_and_strength_tilts() {
    let folder = Folder::new();
    save_normal(&folder, [0.0, 0.6, 0.8]);
    let normal = |relief: Value, texture: Value| {
        let mut scene = scene_of(json!([{ "type": "quad", "material": "m" }]), relief);
        merge(&mut scene["textures"]["map"], texture);
        look(&folder.compile(&scene).unwrap(), vec3(0.3, 0.2, 5.0), vec3(0.0, 0.0, -1.0)).n_s
    };
    let near = |n: Vec3, expected: Vec3| assert!((n - expected.normalize()).length() < 1e-4, "{n} {expected}");
    near(normal(normal_map(), json!({})), vec3(0.0, 0.6, 0.8));
    near(normal(json!({ "normal_map": { "texture": "map", "flip_y": true } }), json!({})), vec3(0.0, -0.6, 0.8));
    near(normal(json!({ "normal_map": { "texture": "map", "strength": 2 } }), json!({})), vec3(0.0, 1.2, 0.8));
    near(normal(json!({ "normal_map": { "texture": "map", "strength": 0 } }), json!({})), Vec3::Z);
    // The normals turn with the picture that is turned or mirrored.
    near(normal(normal_map(), json!({ "scale": [1, -3] })), vec3(0.0, -0.6, 0.8));
    near(normal(normal_map(), json!({ "rotation_degrees": 90 })), vec3(0.6, 0.0, 0.8));
}

#[test]
fn a_flat_map_changes_nothing() {
    let folder = Folder::new();
    // 128 is the nearest to the middle that 8 bits have: 0.2 degrees off.
    ImageBuffer::from_pixel(3, 3, Rgb([128u8, 128, 255])).save(folder.path("map.png")).unwrap();
    for shape in shapes() {
        let scene = folder.compile(&scene_of(json!([shape]), normal_map())).unwrap();
        let at = look(&scene, vec3(0.31, 0.17, 5.0), vec3(0.0, 0.0, -1.0));
        assert!(at.n_s.dot(at.n_g) > 1.0 - 4e-5, "{shape}: {at:?}");
    }
}

#[test]
fn bump_maps_have_the_slopes_of_their_heights() {
    let folder = Folder::new();
    // Heights that grow along u by 1 over the square, up to the last texel.
    let ramp = ImageBuffer::from_fn(256, 4, |x, _| Luma([(x as f32 * 65_535.0 / 255.0).round() as u16]));
    ramp.save(folder.path("map.png")).unwrap();
    for (height, filter) in [(0.5, "bilinear"), (-0.25, "bilinear")] {
        for (size, instanced) in [([2.0, 2.0, 0.0], false), ([5.0, 1.0, 0.0], true)] {
            let shape = json!({
                "type": "quad", "material": "m", "origin": [-0.5 * size[0], -0.5 * size[1], 0.0],
                "edge_u": [size[0], 0, 0], "edge_v": [0, size[1], 0]
            });
            let mut scene = scene_of(json!([]), json!({ "bump_map": { "texture": "map", "height": height } }));
            scene["textures"]["map"]["filter"] = json!(filter);
            if instanced {
                scene["objects"] = json!({ "o": { "shapes": [shape] } });
                scene["instances"] = json!([{ "object": "o" }]);
            } else {
                scene["shapes"] = json!([shape]);
            }
            let at = look(&folder.compile(&scene).unwrap(), vec3(0.1, 0.2, 5.0), vec3(0.0, 0.0, -1.0));
            // A height h over the width w: the slope is h / w, times 256 / 255 since the ramp reaches its ends half a
            // texel early.
            let slope = height / size[0] * 256.0 / 255.0;
            let expected = vec3(-slope as f32, 0.0, 1.0).normalize();
            assert!((at.n_s - expected).length() < 1e-4, "{height} {size:?}: {} {expected}", at.n_s);
        }
    }
}

/// Interpolated normals that are not checked against the surface leak light.
#[test]
fn no_light_leaks_into_a_closed_box_whatever_its_normals_say() {
    let folder = Folder::new();
    let mut rng = Rng::new(11);
    let wild = ImageBuffer::from_fn(64, 64, |_, _| {
        let n = rng.direction_around(DVec3::Z);
        Rgb(n.to_array().map(|x| (x * 127.5 + 127.5) as u8))
    });
    wild.save(folder.path("map.png")).unwrap();
    for material in [
        json!({ "type": "diffuse", "albedo": 0.9 }),
        json!({ "type": "mirror" }),
        json!({ "type": "plastic", "roughness": 0.4 }),
    ] {
        for integrator in ["path", "whitted"] {
            let mut scene = scene_of(
                json!([
                    { "type": "cube", "material": "m", "transform": [{ "scale": 3 }] },
                    { "type": "sphere", "material": "m" }
                ]),
                normal_map(),
            );
            scene["materials"]["plain"] = material.clone();
            scene["camera"]["position"] = json!([0.3, 0.2, 2.6]);
            scene["camera"]["vertical_fov_degrees"] = json!(100.0);
            scene["integrator"] = json!({ "type": integrator, "max_depth": 8 });
            scene["sampler"]["spp"] = json!(16);
            let point = json!({ "type": "point", "position": [9, 8, 7], "intensity": [1e4, 1e4, 1e4] });
            scene["lights"].as_array_mut().unwrap().push(point);
            let image = folder.render(&scene);
            assert!(pixels(&image).all(|p| p == [0.0; 3]), "{material} {integrator}");
        }
    }
}

/// No black rims: a mirror with a wild normal map reflects the white sky everywhere, to the last ray.
#[test]
fn a_mirror_with_a_normal_map_loses_nothing_at_its_rim() {
    let folder = Folder::new();
    let bumps = ImageBuffer::from_fn(64, 64, |x, y| {
        let (a, b) = (x as f32 * 0.8, y as f32 * 0.6);
        let n = vec3(0.8 * a.sin(), 0.8 * b.sin(), 0.6).normalize();
        Rgb(n.to_array().map(|x| (x * 127.5 + 127.5) as u8))
    });
    bumps.save(folder.path("map.png")).unwrap();
    for integrator in ["path", "whitted"] {
        let mut scene = scene_of(json!([{ "type": "sphere", "material": "m" }]), normal_map());
        scene["materials"]["plain"] = json!({ "type": "mirror" });
        scene["integrator"] = json!({ "type": integrator, "max_depth": 4 });
        for p in pixels(&folder.render(&scene)) {
            assert!((p[1] - 1.0).abs() < 1e-5, "{integrator}: {p:?}");
        }
    }
}

#[test]
fn relief_makes_no_light() {
    let folder = Folder::new();
    let steep = ImageBuffer::from_fn(64, 64, |x, y| {
        let (a, b) = (x as f32 * 1.3, y as f32 * 0.9);
        // Up to 80 degrees.
        let tilt = 80f32.to_radians() * (a.sin() * b.cos()).abs();
        let n = vec3(tilt.sin() * a.cos(), tilt.sin() * a.sin(), tilt.cos());
        Rgb(n.to_array().map(|x| (x * 127.5 + 127.5) as u8))
    });
    steep.save(folder.path("map.png")).unwrap();
    for (material, least) in [
        (json!({ "type": "diffuse", "albedo": 1.0 }), 0.6),
        (json!({ "type": "plastic", "albedo": 1.0, "roughness": 0.3 }), 0.5),
        (json!({ "type": "conductor", "eta": [0.001, 0.001, 0.001], "k": [9, 9, 9], "roughness": 0.4 }), 0.5),
    ] {
        let mut scene = scene_of(json!([{ "type": "sphere", "material": "m" }]), normal_map());
        scene["materials"]["plain"] = material.clone();
        scene["camera"]["vertical_fov_degrees"] = json!(9.0);
        scene["sampler"]["spp"] = json!(256);
        scene["integrator"] = json!({ "type": "path", "max_depth": 2 });
        let Estimate { mean, error } = Estimate::of(&folder.render(&scene), 1);
        assert!(mean <= 1.0 + 5.0 * error && mean >= least, "{material}: {mean} +- {error}");
    }
}

/// A ball of `2 n x n` facets in latitude and longitude with the normals of the sphere.
fn ball(n: u32, shading: &str) -> Value {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for j in 0..=n {
        for i in 0..=2 * n {
            let (theta, phi) = (
                std::f64::consts::PI * f64::from(j) / f64::from(n),
                std::f64::consts::PI * f64::from(i) / f64::from(n),
            );
            positions.push([theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()]);
        }
    }
    let index = |i: u32, j: u32| j * (2 * n + 1) + i;
    for j in 0..n {
        for i in 0..2 * n {
            triangles.push([index(i, j), index(i, j + 1), index(i + 1, j + 1)]);
            triangles.push([index(i, j), index(i + 1, j + 1), index(i + 1, j)]);
        }
    }
    json!({
        "type": "mesh", "material": "plain", "positions": positions, "normals": positions, "triangles": triangles,
        "shading": shading
    })
}

fn lit(shape: Value) -> Value {
    let mut scene = scene_of(json!([shape]), json!({}));
    scene["materials"] = json!({ "plain": { "type": "diffuse", "albedo": 0.8 } });
    scene["textures"] = json!({});
    scene["film"] = json!({ "width": 96, "height": 96, "filter": { "type": "box" } });
    scene["camera"]["vertical_fov_degrees"] = json!(13.0);
    scene["sampler"]["spp"] = json!(16);
    scene["integrator"] = json!({ "type": "path", "max_depth": 2 });
    scene["lights"] = json!([{ "type": "directional", "direction": [-1, -0.4, -0.3], "irradiance": [3, 3, 3] }]);
    scene
}

/// The largest difference between neighbouring pixels of the inner part of a ball's picture, where `counts` is true of
/// both.
fn largest_step(image: &steradian::internal::film::Image, counts: impl Fn(u32, u32) -> bool) -> f32 {
    let at = |x: u32, y: u32| image.rgb(x, y).unwrap()[1];
    let inside = |x: u32, y: u32| (x as f32 - 48.0).hypot(y as f32 - 48.0) < 34.0 && counts(x, y);
    let mut largest = 0f32;
    for (x, y) in (1..95).flat_map(|y| (1..95).map(move |x| (x, y))) {
        for (x2, y2) in [(x + 1, y), (x, y + 1)] {
            if inside(x, y) && inside(x2, y2) {
                largest = largest.max((at(x2, y2) - at(x, y)).abs());
            }
        }
    }
    largest
}

/// Smooth normals are used once they are computed.
#[test]
fn a_coarse_smooth_ball_is_shaded_like_a_round_one() {
    let folder = Folder::new();
    let round = folder.render(&lit(json!({ "type": "sphere", "material": "plain" })));
    let smooth = folder.render(&lit(ball(12, "smooth")));
    let flat = folder.render(&lit(ball(12, "flat")));
    // The outline of the coarse ball lies up to 2 % within the round one of 47 pixels: only where both are is shading
    // compared.
    let mean = |image: &steradian::internal::film::Image| {
        let inside = |x: u32, y: u32| (x as f32 + 0.5 - 48.0).hypot(y as f32 + 0.5 - 48.0) < 45.0;
        let values = (0..96 * 96)
            .map(|i| (i % 96, i / 96))
            .filter(|&(x, y)| inside(x, y))
            .map(|(x, y)| image.rgb(x, y).unwrap()[1]);
        values.map(f64::from).sum::<f64>()
    };
    let ratio = mean(&smooth) / mean(&round);
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    // Where all facets face the light, smooth shading has the slopes of the round ball, flat shading its steps from
    // facet to facet.
    let full_light = 0.8 * 3.0 / std::f32::consts::PI;
    let bright = |x: u32, y: u32| round.rgb(x, y).unwrap()[1] > 0.37 * full_light;
    let [of_round, of_smooth, of_flat] = [&round, &smooth, &flat].map(|image| largest_step(image, bright));
    assert!(of_smooth < 1.8 * of_round && of_flat > 3.0 * of_round, "{of_round} {of_smooth} {of_flat}");
    // At the terminator a facet that turns away is dark: a step of what the normal at its corner still sees, which
    // shrinks with the facets.
    for n in [12u8, 96] {
        let image = folder.render(&lit(ball(n.into(), "smooth")));
        let half_facet = (0.5 * 2f32.sqrt() * 180.0 / f32::from(n)).to_radians();
        let (step, least) = (largest_step(&image, |_, _| true), largest_step(&round, |_, _| true));
        assert!(step < least + full_light * half_facet.sin(), "{n}: {step} {least}");
    }
}

#[test]
fn creases_are_edges_and_what_is_flatter_is_smooth() {
    let folder = Folder::new();
    let cube = json!({
        "type": "mesh", "material": "plain", "shading": "smooth",
        "positions": [
            [-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]
        ],
        "triangles": [
            [4, 5, 6], [4, 6, 7], [1, 0, 3], [1, 3, 2], [5, 1, 2], [5, 2, 6], [0, 4, 7], [0, 7, 3], [7, 6, 2],
            [7, 2, 3], [0, 1, 5], [0, 5, 4]
        ]
    });
    let normal = |shape: &Value| {
        let mut scene = scene_of(json!([shape]), json!({}));
        scene["materials"].as_object_mut().unwrap().remove("m");
        scene["textures"] = json!({});
        look(&folder.compile(&scene).unwrap(), vec3(0.9, 0.8, 5.0), vec3(0.0, 0.0, -1.0)).n_s
    };
    assert!(normal(&cube).z < 0.8, "smooth all over: {}", normal(&cube));
    let mut creased = cube.clone();
    creased["crease_angle_degrees"] = json!(60);
    assert!((normal(&creased) - Vec3::Z).length() < 1e-6);
    creased["crease_angle_degrees"] = json!(90);
    assert!((normal(&creased) - normal(&cube)).length() < 1e-6);
    // Given normals count, unless they are to be computed.
    let mut given = cube;
    given["normals"] = json!([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]]);
    assert!((normal(&given) - Vec3::Z).length() < 1e-6);
    given["shading"] = json!("computed");
    assert!(normal(&given).z < 0.8);
    given["normal_weight"] = json!("area");
    assert!(normal(&given).z < 0.85);
}

/// Which part of a mix a ray meets and whose normals it sees are one choice, on two-sided surfaces and in mixes of
/// mixes too.
#[test]
fn a_part_of_a_mix_keeps_its_relief() {
    let folder = Folder::new();
    save_normal(&folder, [0.6, 0.0, 0.8]);
    let materials = json!({
        "tilted": { "type": "relief", "material": "mirror", "normal_map": { "texture": "map" } },
        "mirror": { "type": "mirror" },
        "m": { "type": "mix", "materials": ["plain", "inner"] },
        "inner": { "type": "mix", "materials": ["tilted", "plain"] },
        "sides": { "type": "two_sided", "front": "tilted", "back": "plain" }
    });
    for shape in [json!({ "type": "quad", "material": "m" }), square(json!([[0, 0], [1, 0], [1, 1], [0, 1]]))] {
        let mut scene = scene_of(json!([shape]), json!({}));
        merge(&mut scene["materials"], materials.clone());
        scene["materials"]["m"] = materials["m"].clone();
        let compiled = folder.compile(&scene).unwrap();
        let accel = accel::build(AccelKind::EMBREE, &compiled.geometry, 1).unwrap();
        let world = World::new(&compiled, &*accel);
        let mut rng = Rng::new(3);
        let mut tilted = 0;
        for _ in 0..4_000 {
            let direction = vec3(rng.range(-0.2, 0.2) as f32, rng.range(-0.2, 0.2) as f32, -1.0).normalize();
            let at = world.closest(&Ray::new(vec3(0.3, 0.2, 1.0), direction)).unwrap();
            let is_mirror = matches!(*compiled.bsdf(&at, direction, || Footprint::point(at.uv)), Bsdf::Mirror(_));
            assert_eq!(is_mirror, at.n_s.dot(at.n_g) < 0.9, "{at:?}");
            tilted += usize::from(is_mirror);
        }
        // A quarter of 4,000: 7 standard deviations, false alarms below 1e-11.
        assert!((tilted as f64 - 1_000.0).abs() < 7.0 * (4_000.0f64 * 0.25 * 0.75).sqrt(), "{tilted}");
    }

    let mut scene = scene_of(json!([{ "type": "quad", "material": "sides" }]), json!({}));
    merge(&mut scene["materials"], materials.clone());
    scene["materials"]["m"] = materials["m"].clone();
    let compiled = folder.compile(&scene).unwrap();
    let sides = [1.0f32, -1.0].map(|z| look(&compiled, vec3(0.3, 0.2, z), vec3(0.0, 0.0, -z)));
    assert!((sides[0].n_s.dot(sides[0].n_g) - 0.8).abs() < 1e-3 && sides[1].n_s == sides[1].n_g, "{sides:?}");
}

#[test]
fn a_relief_on_what_has_one_within_is_refused() {
    let folder = Folder::new();
    save_normal(&folder, [0.0, 0.0, 1.0]);
    let mut scene = scene_of(json!([{ "type": "quad", "material": "m" }]), normal_map());
    scene["materials"]["m"]["material"] = json!("mixed");
    scene["materials"]["mixed"] = json!({ "type": "mix", "materials": ["plain", "inner"] });
    scene["materials"]["inner"] = json!({ "type": "relief", "material": "plain", "normal_map": { "texture": "map" } });
    let message = folder.compile(&scene).unwrap_err().to_string();
    assert!(message.contains("materials.m.material") && message.contains("relief of its own"), "{message}");
    let mut coated = scene.clone();
    coated["materials"]["m"] = json!({ "type": "coated", "base": "inner" });
    let message = folder.compile(&coated).unwrap_err().to_string();
    assert!(message.contains("materials.m.base") && message.contains("relief of its own"), "{message}");
    scene["materials"]["inner"]["material"] = json!("m");
    let message = folder.compile(&scene).unwrap_err().to_string();
    assert!(message.contains("consists of itself"), "{message}");
}
