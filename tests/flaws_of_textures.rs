//! Known flaws of renderers in textures and surfaces: each test fails on the flawed formula.

use image::{ImageBuffer, Rgb};
use serde_json::{Value, json};
use steradian::desc::ViewDesc;
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::bsdf::Bsdf;
use steradian::internal::color::linear_from_srgb;
use steradian::internal::geometry::SurfaceInteraction;
use steradian::internal::integrator::World;
use steradian::internal::math::{Ray, Vec3, vec3};
use steradian::internal::output;
use steradian::internal::scene::Scene;
use steradian::internal::texture::Footprint;

use crate::util::folder::Folder;
use steradian::internal::math::random::Rng;

/// A scene of shapes with material `m` and a camera that sees the square from -1 to 1.
fn scene_of(shapes: Value, material: Value) -> Value {
    json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": {
            "position": [0, 0, 9], "look_at": [0, 0, 0],
            "vertical_fov_degrees": 2.0 * (1.0f64 / 9.0).atan().to_degrees()
        },
        "sampler": { "spp": 1 },
        "textures": { "image": { "type": "image", "file": "image.png", "filter": "nearest" } },
        "materials": { "m": material },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    })
}

fn square() -> Value {
    json!({ "type": "quad", "material": "m", "origin": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0] })
}

/// What a ray meets, and the change of the point with v.
fn meet(scene: &Scene, ray: &Ray) -> Option<(SurfaceInteraction, Vec3)> {
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
    let hit = accel.intersect(ray)?;
    Some((World::new(scene, &*accel).in_full().resolve(ray, Some(hit))?, scene.geometry.dp_dv(ray, &hit)))
}

/// The scattering where a ray along -z meets the scene.
fn bsdf_at(scene: &Scene, x: f32, y: f32) -> Bsdf {
    let ray = Ray::new(vec3(x, y, 5.0), -Vec3::Z);
    let (at, _) = meet(scene, &ray).expect("the ray meets a shape");
    scene.bsdf(&at, ray.direction, || Footprint::point(at.uv)).into_owned()
}

/// Codes of the base colour taken for light; or the curve applied to roughness too.
#[test]
fn the_base_colour_is_linearised_and_roughness_is_not() {
    let folder = Folder::new();
    let code = 150u8;
    ImageBuffer::from_pixel(1, 1, Rgb([code; 3])).save(folder.path("image.png")).unwrap();
    let compile = |base_color: Value, roughness: Value| {
        let material = json!({ "type": "principled", "base_color": base_color, "roughness": roughness });
        folder.compile(&scene_of(json!([square()]), material)).unwrap()
    };
    let value = f32::from(code) / 255.0;
    let texture = json!({ "texture": "image" });
    let textured = compile(texture.clone(), texture);
    let constant = compile(json!(linear_from_srgb(value)), json!(value));
    let (wo, wi) = (vec3(0.3, 0.1, 0.9).normalize(), vec3(-0.5, 0.2, 0.6).normalize());
    let [a, b] = [textured, constant].map(|scene| bsdf_at(&scene, 0.1, 0.2).eval(wo, wi).value);
    assert!((a - b).to_array().iter().all(|d| d.abs() < 1e-5 * b.r), "{a:?} {b:?}");
}

/// A triangle that has a material of its own, or a sphere whose material hides that of its class, ignores the scene's
/// value.
#[test]
fn triangles_spheres_and_instances_keep_the_type_of_their_material() {
    type Is = fn(&Bsdf) -> bool;
    let materials: [(Value, Is); 5] = [
        (json!({ "type": "diffuse" }), |bsdf| matches!(bsdf, Bsdf::Lambert(_))),
        (json!({ "type": "mirror" }), |bsdf| matches!(bsdf, Bsdf::Mirror(_))),
        (json!({ "type": "conductor", "metal": "gold" }), |bsdf| matches!(bsdf, Bsdf::Conductor(_))),
        (json!({ "type": "dielectric" }), |bsdf| matches!(bsdf, Bsdf::Dielectric(_))),
        (json!({ "type": "principled" }), |bsdf| matches!(bsdf, Bsdf::Principled(_))),
    ];
    let folder = Folder::new();
    let triangle = json!({
        "type": "mesh", "material": "m", "positions": [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]
    });
    for (material, is) in materials {
        for shape in [triangle.clone(), json!({ "type": "sphere", "material": "m" }), square()] {
            for instanced in [false, true] {
                let mut scene = scene_of(json!([]), material.clone());
                scene["textures"] = json!({});
                if instanced {
                    scene["objects"] = json!({ "o": { "shapes": [shape] } });
                    scene["instances"] = json!([{ "object": "o" }]);
                } else {
                    scene["shapes"] = json!([shape]);
                }
                let bsdf = bsdf_at(&folder.compile(&scene).unwrap(), 0.1, 0.1);
                assert!(is(&bsdf), "{material} on {shape}: {bsdf:?}");
            }
        }
    }
}

/// The largest y taken for the largest x, and the like.
#[test]
fn bounds_do_not_mix_up_their_axes() {
    let folder = Folder::new();
    let (min, max) = (vec3(-1.0, -20.0, -300.0), vec3(4000.0, 5.0, 60.0));
    // Each corner is extreme along one axis alone.
    let positions = json!([[-1, 1, 2], [1, -20, 3], [2, 3, -300], [4000, 2, 1], [3, 5, 2], [5, 4, 60]]);
    let mesh = json!({ "type": "mesh", "positions": positions, "triangles": [[0, 1, 2], [3, 4, 5]] });
    let bounds = folder.compile(&json!({ "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0] }, "shapes": [mesh],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }] }));
    let bounds = bounds.unwrap().geometry.bounds();
    assert!(
        (bounds.min - min).abs().max_element() < 1e-3 && (bounds.max - max).abs().max_element() < 1e-2,
        "{bounds:?}"
    );
}

/// Derivatives that exist on one kind of shape only, or are solved with the wrong component.
#[test]
fn derivatives_by_uv_are_those_of_every_shape() {
    let folder = Folder::new();
    let turn = json!([{ "scale": [1, 2, 0.7] }, { "rotate": { "axis": [1, 2, 3], "degrees": 40 } }]);
    let mut rng = Rng::new(5);
    for shape in [
        json!({ "type": "quad", "origin": [-1, -1, 0.1], "edge_u": [2, 0.3, 0], "edge_v": [0.2, 2, 0.5] }),
        json!({ "type": "sphere" }),
        json!({ "type": "disk", "inner_radius": 0.05 }),
        json!({ "type": "cone", "height": 0.7 }),
        json!({
            "type": "cylinder", "radius": 0.8, "height": 2,
            "transform": [{ "translate": [0, 0, -1] }, { "rotate": { "axis": [0, 1, 0], "degrees": 70 } }]
        }),
        json!({ "type": "revolution", "profile": { "bezier": [[0.5, -1], [1.5, -1], [1.5, 1], [0.5, 1]] } }),
        json!({
            "type": "mesh", "positions": [[-1, -1, 0], [1, -1, 0.2], [0, 1, 0.4]], "triangles": [[0, 1, 2]],
            "uvs": [[0.1, 0.7], [0.9, 0.2], [0.4, 0.1]]
        }),
    ] {
        let mut shape = shape.clone();
        let own = shape["transform"].as_array().cloned().unwrap_or_default();
        shape["transform"] = own.into_iter().chain(turn.as_array().cloned().unwrap()).collect();
        let mut scene = scene_of(json!([shape]), json!({ "type": "diffuse" }));
        scene["shapes"][0]["material"] = json!("m");
        scene["textures"] = json!({});
        let scene = folder.compile(&scene).unwrap();
        let mut compared = 0;
        for _ in 0..200 {
            let (x, y) = (rng.range(-0.6, 0.6) as f32, rng.range(-0.6, 0.6) as f32);
            let step = 2e-3;
            let look = |x: f32, y: f32| meet(&scene, &Ray::new(vec3(x, y, 5.0), -Vec3::Z));
            let Some((at, dp_dv)) = look(x, y) else { continue };
            for (dx, dy) in [(step, 0.0), (0.0, step)] {
                let (Some((after, _)), Some((before, _))) = (look(x + dx, y + dy), look(x - dx, y - dy)) else {
                    continue;
                };
                let duv = after.uv - before.uv;
                let dp = (after.p - before.p).as_vec3();
                // Away from seams, rims and edges, where a step is far longer than its projection.
                if duv.abs().max_element() > 0.1 || dp.length() > 5.0 * step {
                    continue;
                }
                let linear = at.dp_du * duv.x + dp_dv * duv.y;
                assert!((linear - dp).length() < 0.03 * dp.length(), "{shape} at {x} {y}: {linear} {dp}");
                compared += 1;
            }
        }
        assert!(compared > 40, "{shape}: {compared}");
    }
}

/// A PNG without the sRGB curve is too dark, and a picture that is shown as it is comes back with other codes.
#[test]
fn the_codes_of_a_picture_come_back_in_a_png_of_it() {
    let folder = Folder::new();
    let codes = [0u8, 3, 17, 60, 128, 188, 230, 255];
    ImageBuffer::from_fn(8, 1, |x, _| Rgb([codes[x as usize]; 3])).save(folder.path("image.png")).unwrap();
    let mut scene = scene_of(json!([square()]), json!({ "type": "diffuse", "albedo": { "texture": "image" } }));
    scene["integrator"] = json!({ "type": "whitted", "ambient": [1, 1, 1] });
    scene["lights"] = json!([]);
    let path = folder.path("seen.png");
    output::write_png(&path, &folder.render(&scene), 0.0, ViewDesc::Srgb).unwrap();
    let seen = image::open(&path).unwrap().into_rgb8();
    for (i, code) in codes.into_iter().enumerate() {
        let pixel = seen.get_pixel(2 * i as u32, 5).0;
        assert!(pixel.iter().all(|c| c.abs_diff(code) <= 1), "{pixel:?} for {code}");
    }
}

/// Only the first shape of an OBJ file, or none at all if there are several.
#[test]
fn an_obj_may_have_any_number_of_shapes() {
    let folder = Folder::new();
    for count in [1, 2, 5] {
        let shape = |i: usize| format!("o shape{i}\nv {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -3 -2 -1\n");
        folder.write("shapes.obj", (0..count).map(shape).collect::<String>());
        let scene = folder.compile(&json!({
            "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0] },
            "shapes": [{ "type": "mesh", "file": "shapes.obj" }],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }));
        let scene = scene.unwrap();
        let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
        let mut ray = Ray::new(vec3(-1.0, 0.25, 0.25), Vec3::X);
        let mut met = 0;
        while let Some(hit) = accel.intersect(&ray) {
            met += 1;
            ray.t_min = hit.t + 0.1;
        }
        assert_eq!(met, count);
    }
}
