//! Textures on shapes: what a ray through a point of a shape sees of an image.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use image::{ImageBuffer, Luma, Rgb, Rgba};
use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::geometry::SurfaceInteraction;
use steradian::internal::integrator::World;
use steradian::internal::material::{ColorInput, Material, TexturedMaterial};
use steradian::internal::math::{DVec3, Ray, Vec2, vec2};
use steradian::internal::scene::Scene;
use steradian::internal::texture::Texture;

use crate::util::folder::Folder;
use crate::util::render::{merge, pixels};

/// A scene of these shapes; `rest` is merged into it.
fn scene_of(shapes: Value, rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": { "position": [0.0, 0.0, 9.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 20.0 },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1.0, 1.0, 1.0] }]
    });
    merge(&mut scene, rest);
    scene
}

/// The surface that a ray from `origin` towards `target` meets first.
fn look(scene: &Scene, origin: DVec3, target: DVec3) -> Option<SurfaceInteraction> {
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
    World::new(scene, &*accel).in_full().closest(&Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3()))
}

/// The colour of the texture on the diffuse shape that a ray meets.
fn texel(scene: &Scene, at: &SurfaceInteraction) -> steradian::internal::color::Rgb {
    let Material::Textured(varying, _) = scene.material(at.shape) else { panic!("constant") };
    match &**varying {
        TexturedMaterial::Diffuse { albedo: ColorInput::Texture(id), .. } => scene.textures[id.index()].color(at.uv),
        other => panic!("{other:?}"),
    }
}

/// Every shape that makes a full turn, with a function from u, v to a point on it and one near it on the outside.
type Surface = fn(f64, f64) -> [DVec3; 2];

fn full_turns() -> Vec<(Value, Surface)> {
    vec![
        (json!({ "type": "sphere", "radius": 2.0 }), |u, v| {
            let (theta, phi) = (PI * (1.0 - v), TAU * u);
            let n = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            [2.0 * n, 3.0 * n]
        }),
        (json!({ "type": "cylinder", "radius": 2.0, "height": 3.0 }), |u, v| {
            let n = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0);
            [2.0 * n + 3.0 * v * DVec3::Z, 3.0 * n + 3.0 * v * DVec3::Z]
        }),
        (json!({ "type": "cone", "radius": 2.0, "height": 3.0 }), |u, v| {
            let n = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0);
            let p = 2.0 * (1.0 - v) * n + 3.0 * v * DVec3::Z;
            [p, p + 3.0 * n + 2.0 * DVec3::Z]
        }),
        (json!({ "type": "disk", "radius": 2.0, "inner_radius": 0.5 }), |u, v| {
            let p = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0) * (0.5 + 1.5 * v);
            [p, p + DVec3::Z]
        }),
        (json!({ "type": "revolution", "profile": { "bezier": [[2, 0], [2, 1], [2, 2], [2, 3]] } }), |u, v| {
            let n = DVec3::new((TAU * u).sin(), 0.0, (TAU * u).cos());
            [2.0 * n + 3.0 * v * DVec3::Y, 3.0 * n + 3.0 * v * DVec3::Y]
        }),
    ]
}

/// Grey noise.
fn noise(width: u32, height: u32) -> ImageBuffer<Luma<u8>, Vec<u8>> {
    ImageBuffer::from_fn(width, height, |x, y| {
        Luma([(x.wrapping_mul(97) ^ y.wrapping_mul(57)).wrapping_mul(151) as u8])
    })
}

/// Materials with one image, named `image.png`, in linear values.
fn one_image(wrap: &str) -> Value {
    json!({
        "textures": { "image": { "type": "image", "file": "image.png", "color_space": "linear", "wrap": wrap } },
        "materials": { "m": { "type": "diffuse", "albedo": { "texture": "image" } } }
    })
}

fn with_material(mut shape: Value) -> Value {
    shape["material"] = json!("m");
    shape
}

/// Textures looked up with world points slide over shapes that are moved.
#[test]
fn textures_stay_on_shapes_that_are_moved() {
    let folder = Folder::new();
    let transform = json!([
        { "scale": [1.0, 2.0, 0.5] }, { "rotate": { "axis": [1, 2, 3], "degrees": 70 } }, { "translate": [3, -2, 7] }
    ]);
    for (shape, surface) in full_turns() {
        let mut moved_shape = shape.clone();
        moved_shape["transform"] = transform.clone();
        let at_rest = folder.compile(&scene_of(json!([shape]), json!({}))).unwrap();
        let moved = folder.compile(&scene_of(json!([moved_shape]), json!({}))).unwrap();
        let placed = match &moved.geometry.shapes[0] {
            steradian::internal::geometry::Shape::Analytic(placed) => placed.transform,
            _ => panic!("analytic shapes only"),
        };
        for (u, v) in [(0.1, 0.3), (0.4, 0.7), (0.8, 0.2)] {
            let [p, outside] = surface(u, v);
            let here = look(&at_rest, outside, p).unwrap();
            let there = look(&moved, placed.point(outside), placed.point(p)).unwrap();
            assert!((here.uv - vec2(u as f32, v as f32)).length() < 1e-5, "{shape}: {}", here.uv);
            assert!((here.uv - there.uv).length() < 1e-5, "{shape}: {} {}", here.uv, there.uv);
        }
    }
}

/// UV kept in the triangle that was last hit race between threads.
#[test]
fn a_textured_mesh_is_the_same_on_any_number_of_threads() {
    use crate::util::render::{prepare, render_with};
    use steradian::internal::render::Overrides;
    let mesh = json!([{
        "type": "mesh", "material": "m", "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0.5], [-1, 1, 0]],
        "triangles": [[0, 1, 2], [0, 2, 3]],
        "uvs": [[0, 0], [3, 0], [3, 3], [0, 3]]
    }]);
    let scene = scene_of(
        mesh,
        json!({
            "textures": { "c": { "type": "checker", "scale": [2, 2] } },
            "materials": { "m": { "type": "diffuse", "albedo": { "texture": "c" } } },
            "sampler": { "spp": 16 }
        }),
    );
    let image = |threads| {
        let prepared = prepare(&scene, &Overrides { threads: Some(threads), ..Overrides::default() });
        pixels(&render_with(&prepared, AccelKind::EMBREE).image).map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(image(1), image(4));
}

/// No 0/0 at the origin of a plane, no arccosine beyond 1, no angle at the axis.
#[test]
fn uv_are_numbers_at_poles_axes_and_origins() {
    let folder = Folder::new();
    let shapes = [
        json!({ "type": "sphere" }),
        json!({ "type": "sphere", "z_max": 0.5, "phi_max_degrees": 300 }),
        json!({ "type": "disk" }),
        json!({ "type": "cone" }),
        json!({ "type": "quad" }),
        json!({ "type": "revolution", "profile": { "bezier": [[0, -1], [1.5, -1], [1.5, 1], [0, 1]] } }),
    ];
    for shape in shapes {
        let scene = folder.compile(&scene_of(json!([shape]), json!({}))).unwrap();
        let mut seen = 0;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
            for target in [
                DVec3::ZERO,
                DVec3::new(1e-30, 0.0, 0.0),
                DVec3::new(0.0, -1e-30, 1e-30),
                DVec3::Z,
                DVec3::new(0.0, 0.0, 0.5),
            ] {
                if let Some(at) = look(&scene, target + 4.0 * axis, target) {
                    seen += 1;
                    let valid = (0.0..=1.0).contains(&at.uv.x) && (0.0..=1.0).contains(&at.uv.y);
                    assert!(valid && at.dp_du.is_finite() && at.n_s.is_finite(), "{shape}: {at:?}");
                }
            }
        }
        assert!(seen > 5, "{shape}: {seen}");
    }
}

/// A v that jumps from 1 to 0 at poles tears images; u from -1/4 to 3/4 with clamped images smears a quarter of the
/// sphere.
#[test]
fn u_runs_from_0_to_1_once_around_every_shape_and_v_once_along_it() {
    let folder = Folder::new();
    for (shape, surface) in full_turns() {
        let scene = folder.compile(&scene_of(json!([shape]), json!({}))).unwrap();
        let n = 72;
        for i in 0..n {
            let (u, v) = ((f64::from(i) + 0.5) / f64::from(n), 0.05 + 0.9 * f64::from(i * 29 % n) / f64::from(n));
            let [p, outside] = surface(u, v);
            let at = look(&scene, outside, p).unwrap();
            assert!((at.uv - vec2(u as f32, v as f32)).length() < 1e-5, "{shape}: {u} {v} {}", at.uv);
        }
    }
}

#[test]
fn a_repeated_image_has_no_seam_around_any_shape() {
    let folder = Folder::new();
    noise(13, 7).save(folder.path("image.png")).unwrap();
    for (shape, surface) in full_turns() {
        let scene = folder.compile(&scene_of(json!([with_material(shape.clone())]), one_image("repeat"))).unwrap();
        for i in 0..40 {
            let v = 0.05 + 0.9 * f64::from(i) / 40.0;
            let color = |u: f64| {
                let [p, outside] = surface(u, v);
                texel(&scene, &look(&scene, outside, p).unwrap())
            };
            let (before, behind) = (color(1.0 - 1e-5), color(1e-5));
            assert!((before.r - behind.r).abs() < 2e-3, "{shape} at v = {v}: {before:?} {behind:?}");
        }
    }
}

/// A sphere about y with an image bottom up: u = frac((π + atan2(z, x)) / 2π), v = frac((π - acos(y / r)) / π).
#[test]
fn an_image_lies_on_a_sphere_about_y_with_offsets_in_longitude_and_latitude() {
    let folder = Folder::new();
    noise(16, 8).save(folder.path("image.png")).unwrap();
    // Its u runs against ours from half a turn on; the two offsets are angles over a full and over half a turn.
    let (theta, phi) = (0.7, 0.4);
    let mut rest = one_image("repeat");
    merge(&mut rest["textures"]["image"], json!({ "scale": [-1, 1], "offset": [0.5 + theta / TAU, -phi / PI] }));
    let upright = json!([{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }]);
    let shape = json!([{ "type": "sphere", "radius": 2.0, "material": "m", "transform": upright }]);
    let scene = folder.compile(&scene_of(shape, rest)).unwrap();
    let plain = folder.compile(&scene_of(json!([{ "type": "quad", "material": "m" }]), one_image("repeat"))).unwrap();
    let image = &plain.textures[0];
    for i in 0..200 {
        let (y, angle) = (f64::from(i) / 100.0 - 0.995, 2.4 * f64::from(i));
        let r = (1.0 - y * y).sqrt();
        let n = DVec3::new(r * angle.cos(), y, r * angle.sin());
        let u = ((PI + n.z.atan2(n.x) + theta) / TAU).rem_euclid(1.0);
        let v = ((PI - y.acos() - phi) / PI).rem_euclid(1.0);
        let expected = image.scalar(vec2(u as f32, v as f32));
        let seen = texel(&scene, &look(&scene, 5.0 * n, 2.0 * n).unwrap()).r;
        assert!((seen - expected).abs() < 1e-3, "{n}: {seen} {expected}");
    }
}

/// Tiles of a given size in world units, from the origin on in both directions.
#[test]
fn tiles_on_a_plane_have_their_size_in_the_world() {
    let folder = Folder::new();
    noise(4, 4).save(folder.path("image.png")).unwrap();
    let (size, tile) = (20.0, 0.8);
    let mut rest = one_image("repeat");
    // The corner of the plane lies at -10, so that the origin is 10 / 0.8 tiles away from it.
    merge(
        &mut rest["textures"]["image"],
        json!({ "filter": "nearest", "scale": [size / tile, size / tile], "offset": [-12.5, -12.5] }),
    );
    let quad = json!([{
        "type": "quad", "origin": [-10, -10, 0], "edge_u": [size, 0, 0], "edge_v": [0, size, 0], "material": "m"
    }]);
    let scene = folder.compile(&scene_of(quad, rest)).unwrap();
    let plain = folder.compile(&scene_of(json!([{ "type": "quad", "material": "m" }]), one_image("repeat"))).unwrap();
    for i in 0..60 {
        let p = DVec3::new(0.05 + 0.317 * f64::from(i) - 9.0, 8.0 - 0.271 * f64::from(i), 0.0);
        let tile_uv = Vec2::new((p.x / tile).rem_euclid(1.0) as f32, (p.y / tile).rem_euclid(1.0) as f32);
        let texel_of = |uv: Vec2| (uv * 4.0).floor() / 4.0 + 0.125;
        let expected = plain.textures[0].scalar(texel_of(tile_uv));
        let seen = texel(&scene, &look(&scene, p + DVec3::Z, p).unwrap()).r;
        assert!((seen - expected).abs() < 1e-6, "{p}: {seen} {expected}");
    }
}

/// Pictures taken for linear; one integrator mirrors them, the other does not.
#[test]
fn an_8_bit_picture_reflects_what_it_shows_and_stands_upright_in_every_integrator() {
    let folder = Folder::new();
    // Half of the light is the code 188; red bottom left, green bottom right, blue top left, grey top right.
    let picture = ImageBuffer::from_fn(2, 2, |x, y| match (x, y) {
        (0, 1) => Rgb([188u8, 0, 0]),
        (1, 1) => Rgb([0, 188, 0]),
        (0, 0) => Rgb([0, 0, 188]),
        _ => Rgb([188, 188, 188]),
    });
    picture.save(folder.path("image.png")).unwrap();
    let half = 0.5029;
    for integrator in [
        json!({ "type": "path", "max_depth": 2, "strategy": "bsdf" }),
        json!({ "type": "whitted", "ambient": [1, 1, 1] }),
    ] {
        let ambient = integrator["type"] == "whitted";
        let mut scene = scene_of(
            json!([{ "type": "quad", "material": "m" }]),
            json!({
                "textures": { "image": { "type": "image", "file": "image.png", "filter": "nearest" } },
                "materials": { "m": { "type": "diffuse", "albedo": { "texture": "image" } } },
                "sampler": { "spp": 64 },
                "integrator": integrator
            }),
        );
        if ambient {
            scene["lights"] = json!([]);
        }
        let image = folder.render(&scene);
        let at = |x: u32, y: u32| image.rgb(x, y).unwrap();
        for (x, y, expected) in
            [(5, 10, [half, 0.0, 0.0]), (10, 10, [0.0, half, 0.0]), (5, 5, [0.0, 0.0, half]), (10, 5, [half; 3])]
        {
            let seen = at(x, y);
            assert!(seen.iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-3), "{x} {y}: {seen:?} {expected:?}");
        }
    }
}

/// Not only three channels and widths that are powers of two.
#[test]
fn images_of_any_size_and_number_of_channels_are_textures() {
    let folder = Folder::new();
    let save = |width: u32, height: u32, channels: u32| {
        let path = folder.path("image.png");
        match channels {
            1 => ImageBuffer::from_pixel(width, height, Luma([51u8])).save(path),
            3 => ImageBuffer::from_pixel(width, height, Rgb([51u8; 3])).save(path),
            16 => ImageBuffer::from_pixel(width, height, Luma([51u16 * 257])).save(path),
            _ => ImageBuffer::from_pixel(width, height, Rgba([51u8, 51, 51, 7])).save(path),
        }
        .unwrap();
    };
    for (width, height) in [(1, 1), (3, 5), (17, 2), (64, 64)] {
        for channels in [1, 3, 4, 16] {
            save(width, height, channels);
            let scene =
                folder.compile(&scene_of(json!([{ "type": "quad", "material": "m" }]), one_image("repeat"))).unwrap();
            let at = look(&scene, DVec3::new(0.3, 0.4, 2.0), DVec3::new(0.3, 0.4, 0.0)).unwrap();
            assert!((texel(&scene, &at).g - 0.2).abs() < 1e-6, "{width} {height} {channels}");
        }
    }
}

/// A uv of 100 does not mean "no uv"; uv projected to a plane would be 0/0 for triangles upright to it.
#[test]
fn triangles_show_their_part_of_the_image_however_they_stand() {
    let folder = Folder::new();
    noise(32, 32).save(folder.path("image.png")).unwrap();
    let uvs = [[100.0, 100.0], [100.5, 100.0], [100.5, 100.5], [100.0, 100.5]];
    for (e, f) in [(DVec3::X, DVec3::Y), (DVec3::X, DVec3::Z), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)] {
        let corners = [DVec3::ZERO, e, e + f, f].map(|p| p.to_array());
        let mesh = json!([{
            "type": "mesh", "material": "m", "positions": corners, "triangles": [[0, 1, 2], [0, 2, 3]], "uvs": uvs
        }]);
        let scene = folder.compile(&scene_of(mesh, one_image("repeat"))).unwrap();
        for (s, t) in [(0.1, 0.05), (0.7, 0.4), (0.2, 0.9), (0.5, 0.5)] {
            let p = s * e + t * f;
            let at = look(&scene, p + e.cross(f), p).unwrap();
            assert!((at.uv - vec2(100.0 + 0.5 * s as f32, 100.0 + 0.5 * t as f32)).length() < 2e-5, "{}", at.uv);
            let expected = scene.textures[0].color(vec2(0.5 * s as f32, 0.5 * t as f32));
            assert!((texel(&scene, &at).r - expected.r).abs() < 5e-3);
        }
    }
}

#[test]
fn a_file_is_read_once_however_it_is_named_and_used() {
    let folder = Folder::new();
    noise(8, 8).save(folder.path("image.png")).unwrap();
    let image = |file: &str| json!({ "type": "image", "file": file });
    let mut scene = scene_of(json!([{ "type": "sphere" }]), json!({}));
    scene["textures"] = json!({ "a": image("image.png"), "b": image("./image.png") });
    let compiled = folder.compile(&scene).unwrap();
    let images: Vec<_> = compiled
        .textures
        .iter()
        .filter_map(|texture| match texture {
            Texture::Bitmap(bitmap) => Some(Arc::clone(&bitmap.image)),
            _ => None,
        })
        .collect();
    assert!(images.len() >= 2 && images.iter().all(|image| Arc::ptr_eq(image, &images[0])));
}

#[test]
fn products_multiply_images_and_tints() {
    let folder = Folder::new();
    ImageBuffer::from_pixel(2, 2, Rgb([51u8, 102, 255])).save(folder.path("image.png")).unwrap();
    let mut rest = one_image("repeat");
    rest["textures"]["tint"] = json!({ "type": "constant", "color": [0.5, 0.5, 0.25] });
    rest["textures"]["tinted"] =
        json!({ "type": "product", "factors": [{ "texture": "image" }, { "texture": "tint" }, 0.5, [1, 0.5, 1]] });
    rest["materials"]["m"]["albedo"]["texture"] = json!("tinted");
    let scene = folder.compile(&scene_of(json!([{ "type": "quad", "material": "m" }]), rest)).unwrap();
    let color = texel(&scene, &look(&scene, DVec3::Z, DVec3::ZERO).unwrap());
    for (seen, expected) in color.to_array().into_iter().zip([0.05, 0.05, 0.125]) {
        assert!((seen - expected).abs() < 1e-6, "{color:?}");
    }
}
