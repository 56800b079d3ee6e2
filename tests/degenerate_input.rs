//! Rays and instances at the end of what is one; the stability checks of group E have what is none.

use serde_json::{Value, json};
use steradian::internal::accel::{AccelKind, Accelerator, EmbreeAccel, build};
use steradian::internal::compile;
use steradian::internal::geometry::Shape;
use steradian::internal::import::{ImportOptions, read_scene};
use steradian::internal::math::{DMat3, DVec3, Ray, Vec3};
use steradian::internal::render::{Overrides, Settings};

use crate::util::folder::Folder;
use crate::util::geometry::{Rng, cube, instances, placed_analytic_shapes, soup, transform};
use crate::util::render::{Prepared, pixels, render_with};
use crate::util::scenes::all_answers;

/// A valid ray.
const GOOD: Ray =
    Ray { origin: Vec3::new(0.1, 0.2, 0.3), t_min: 0.0, direction: Vec3::Z, t_max: f32::INFINITY, time: 0.0 };

#[test]
fn an_instance_beyond_f32_is_an_error_and_a_small_one_is_not() {
    let scaled = |scale: f64| {
        instances(
            vec![Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO))],
            &[transform(DMat3::IDENTITY * scale, DVec3::ZERO)],
        )
    };
    for scale in [1e-16, 1e-30, 1e16, 1e30] {
        let message = EmbreeAccel::new(&scaled(scale), 1).err().expect("no inverse in f32").to_string();
        assert!(message.contains("instance 0"), "{message}");
    }
    for scale in [1e-10, 1e-4, 1e4, 1e10] {
        let geometry = scaled(scale);
        let accel = EmbreeAccel::new(&geometry, 1).unwrap();
        let hit = accel.intersect(&Ray::new(Vec3::ZERO, Vec3::X)).expect("from inside");
        assert!((f64::from(hit.t) / scale - 1.0).abs() < 1e-5, "{scale} {hit:?}");
    }
}

#[test]
fn meshes_without_area_are_skipped() {
    let folder = Folder::new();
    let (points, flat) = ("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\n", "f 1 2 3\n");
    folder.write("points.obj", points);
    folder.write("flat.obj", format!("{points}{flat}"));
    folder.write("partly.obj", format!("mtllib m.mtl\n{points}usemtl a\n{flat}usemtl b\nf 1 2 4\n"));
    folder.write("m.mtl", "newmtl a\nKd 1 1 1\nKe 1 1 1\nnewmtl b\nKd 1 1 1\n");
    folder.write(
        "cloud.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
         0 0 0\n",
    );
    let inline = |triangles: Value| {
        json!({
            "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [3, 0, 0]], "triangles": triangles
        })
    };
    let file = |name: &str| json!({ "type": "mesh", "file": name });
    let with = |mut shape: Value, key: &str, value: Value| {
        shape[key] = value;
        shape
    };
    let lamp = json!({ "radiance": [1, 1, 1] });
    let motion = json!([{ "time": 0 }, { "time": 1, "transform": [{ "translate": [1, 0, 0] }] }]);
    let sphere = json!({ "type": "sphere" });
    let nothing = [
        inline(json!([])),
        inline(json!([[0, 1, 2], [0, 1, 1]])),
        file("points.obj"),
        file("flat.obj"),
        file("cloud.ply"),
    ];
    let lamps = nothing.clone().map(|shape| with(shape, "emission", lamp.clone()));
    let moving = nothing.clone().map(|shape| with(shape, "motion", motion.clone()));
    let with_all = |others: &[Value]| [&nothing[..], &lamps, &moving, others].concat();
    let scene = json!({
        "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0] },
        "shapes": with_all(&[sphere.clone(), file("partly.obj")]),
        "objects": { "mixed": { "shapes": with_all(&[sphere]) }, "empty": { "shapes": with_all(&[]) } },
        "instances": [{ "object": "mixed", "transform": [{ "translate": [3, 0, 0] }] }, { "object": "empty" }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    let scene = folder.compile(&scene).unwrap();
    // Two spheres and a triangle, of which one sphere is an instance's; no light but the sky.
    let geometry = &scene.geometry;
    assert_eq!(
        (geometry.shapes.len(), geometry.world.len(), geometry.objects.len(), geometry.instances.len()),
        (3, 2, 1, 1)
    );
    assert_eq!(scene.lights.lights().len(), 1);
    for (kind, name) in AccelKind::ALL {
        let accel = build(kind, geometry, 1).unwrap();
        let hits = |x: f32| accel.intersect(&Ray::new(Vec3::new(x, 0.5, 9.0), -Vec3::Z)).is_some();
        assert_eq!([hits(0.0), hits(3.0), hits(6.0)], [true, true, false], "{name}");
    }
}

#[test]
fn imported_scenes_are_rendered_without_what_has_no_area() {
    let folder = Folder::new();
    folder.write("empty.obj", "v 0 0 0\n");
    let pbrt = folder.write(
        "s.pbrt",
        r#"Film "rgb" "integer xresolution" 8 "integer yresolution" 8 WorldBegin
        AttributeBegin AreaLightSource "diffuse" "rgb L" [1 1 1]
        Shape "trianglemesh" "point3 P" [0 0 1 1 0 1 2 0 1] "integer indices" [0 1 2] AttributeEnd
        AttributeBegin Scale 0 0 0 Shape "sphere" AttributeEnd
        Shape "sphere" "float radius" 0"#,
    );
    let mitsuba = folder.write(
        "s.xml",
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/>
        <integer name="height" value="8"/></film></sensor>
        <shape type="obj"><string name="filename" value="empty.obj"/><emitter type="area">
        <rgb name="radiance" value="1"/></emitter></shape>
        <shape type="cylinder"><float name="radius" value="0"/></shape></scene>"#,
    );
    for path in [pbrt, mitsuba] {
        let imported = read_scene(&path, &ImportOptions::default()).unwrap();
        let overrides = Overrides { spp: Some(1), threads: Some(1), ..Overrides::default() };
        let settings = Settings::new(&imported.desc, &overrides).unwrap();
        let scene = compile::compile_from(&imported.desc, imported.source(&path)).unwrap();
        assert_eq!((scene.geometry.shapes.len(), scene.lights.lights().len()), (0, 0), "{}", path.display());
        // What is left is dark, in those renderers too.
        for (kind, name) in AccelKind::ALL {
            let prepared = Prepared { scene: scene.clone(), settings: settings.clone() };
            assert!(pixels(&render_with(&prepared, kind).image).all(|pixel| pixel == [0.0; 3]), "{name}");
        }
    }
}

/// A ray whose numbers have random signs and exponents, among them zeros and denormals, so often that lanes of a packet
/// disagree in all.
fn wild_ray(rng: &mut Rng) -> Ray {
    let mut number = |low: f64, high: f64| {
        let magnitude = match rng.below(8) {
            0 => 0.0,
            1 => 1e-45,
            2 => 1e-20,
            3 => 1.0,
            _ => 10f64.powf(rng.range(low, high)) as f32,
        };
        if rng.unit() < 0.5 { -magnitude } else { magnitude }
    };
    let mut vector = |low, high| Vec3::new(number(low, high), number(low, high), number(low, high));
    Ray { origin: vector(-45.0, 18.2), direction: vector(-45.0, 18.2), ..GOOD }
}

#[test]
fn no_valid_ray_ends_the_process() {
    let mut rng = Rng::new(21);
    let turned = |rng: &mut Rng| transform(rng.rotation() * 10f64.powf(rng.range(-6.0, 6.0)), rng.cube());
    let placements: Vec<_> =
        (0..9).map(|_| turned(&mut rng)).chain([transform(DMat3::IDENTITY, DVec3::ZERO)]).collect();
    let mut shapes = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    shapes.push(Shape::Mesh(soup(&mut rng, 301, 0.3)));
    for geometry in [crate::util::geometry::world(shapes.clone()), instances(shapes, &placements)] {
        let accel = EmbreeAccel::new(&geometry, 1).unwrap();
        let rays: Vec<Ray> = (0..64_000).map(|_| wild_ray(&mut rng)).collect();
        assert!(rays.iter().filter(|ray| ray.is_valid()).count() > 50_000);
        let answers = all_answers(&accel, &rays);
        // A tiny component in one lane misleads no other. At distances above 1e20 single rays themselves are lost now
        // and then.
        for packets in &answers[1..] {
            let differing = answers[0].0.iter().zip(&packets.0).filter(|(a, b)| a.is_some() != b.is_some()).count();
            let shadows = answers[0].1.iter().zip(&packets.1).filter(|(a, b)| a != b).count();
            assert!(differing.max(shadows) * 2000 <= rays.len(), "{differing} {shadows} of {}", rays.len());
        }
    }
}
