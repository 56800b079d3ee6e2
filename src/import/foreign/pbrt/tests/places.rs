//! Transforms, the camera, handedness, fronts.

use super::*;
use crate::desc::{AutoDesc, CameraKindDesc, FilterDesc, IntegratorDesc, LightDesc};

/// Where the camera shows a point of pbrt's world: to the right and up, in units of the distance.
fn seen(imported: &Imported, p: DVec3) -> [f64; 2] {
    let camera = map(imported.desc.camera.transform.as_ref().unwrap());
    let mirror = DVec3::new(if is_mirrored(imported) { -1.0 } else { 1.0 }, 1.0, 1.0);
    let local = camera.inverse().transform_point3(p * mirror);
    [local.x / -local.z, local.y / -local.z]
}

/// Whether the reader mirrored the world: shown by a sphere without transform.
fn is_mirrored(imported: &Imported) -> bool {
    map(shape(imported).common().transform).matrix3.determinant() < 0.0
}

#[test]
fn the_picture_is_not_mirrored_whatever_the_handedness_of_the_world() {
    for (text, mirrored) in [
        ("LookAt 0 0 -5 0 0 0 0 1 0", true),
        ("Scale -1 1 1 LookAt 0 0 -5 0 0 0 0 1 0", false),
        ("Transform [1 0 0 0 0 1 0 0 0 0 -1 0 0 0 5 1]", false),
        ("Translate 0 0 5", true),
    ] {
        let imported = read(&format!("{text}\nCamera \"perspective\" \"float fov\" 90\nWorldBegin Shape \"sphere\""));
        assert_eq!(is_mirrored(&imported), mirrored, "{text}");
        // pbrt itself: camera space has x to the right.
        let pbrt_sees_x = if text.contains("Scale") { -0.2 } else { 0.2 };
        let [x, y] = seen(&imported, DVec3::new(1.0, 0.5, 0.0));
        assert!((x - pbrt_sees_x).abs() < 1e-9 && (y - 0.1).abs() < 1e-9, "{text}: {x} {y}");
        let camera = map(imported.desc.camera.transform.as_ref().unwrap());
        assert!((camera.matrix3.determinant() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_field_of_view_spans_the_shorter_side() {
    let fov = |film: &str, camera: &str| {
        let imported = read(&format!("Film \"rgb\" {film} Camera \"perspective\" {camera} WorldBegin"));
        imported.desc.camera.vertical_fov_degrees.unwrap()
    };
    let wide = "\"integer xresolution\" 200 \"integer yresolution\" 100";
    let high = "\"integer xresolution\" 100 \"integer yresolution\" 200";
    assert!((fov(wide, "\"float fov\" 60") - 60.0).abs() < 1e-9);
    let expected = 2.0 * (2.0 * 30f64.to_radians().tan()).atan().to_degrees();
    assert!((fov(high, "\"float fov\" 60") - expected).abs() < 1e-9);
    assert!((fov(wide, "") - 90.0).abs() < 1e-9);
}

#[test]
fn the_screen_window_shifts_and_stretches() {
    let film = "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100";
    let imported = read(&format!("{film} Camera \"perspective\" \"float screenwindow\" [0 2 -1 1] WorldBegin"));
    let camera = &imported.desc.camera;
    assert_eq!(camera.shift, Some([0.5, 0.0]));
    assert_eq!((camera.pixel_aspect, camera.vertical_fov_degrees), (None, Some(90.0)));
    let imported = read(&format!("{film} Camera \"orthographic\" \"float screenwindow\" [-4 4 -1 1] WorldBegin"));
    let camera = &imported.desc.camera;
    assert_eq!(
        (camera.kind, camera.view_height, camera.pixel_aspect),
        (CameraKindDesc::Orthographic, Some(2.0), Some(4.0))
    );
}

#[test]
fn the_scale_of_the_camera_is_that_of_its_lens() {
    let imported =
        read("Scale 2 2 2 Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 6 WorldBegin");
    let lens = imported.desc.camera.lens.unwrap();
    assert!((lens.radius.unwrap() - 0.5).abs() < 1e-12 && (lens.focus_distance.unwrap() - 3.0).abs() < 1e-12);
}

#[test]
fn the_spherical_camera_turns_as_pbrts_does() {
    let imported = read("Camera \"spherical\" \"string mapping\" \"equirectangular\" WorldBegin Shape \"sphere\"");
    // Its columns turn from x over z; Steradian's from -x over -z. So x is at the left edge, which is +z here, and z,
    // at a quarter, -x here.
    let camera = map(imported.desc.camera.transform.as_ref().unwrap());
    assert!(!is_mirrored(&imported));
    assert!((camera.transform_vector3(DVec3::Z) - DVec3::X).length() < 1e-9);
    assert!((camera.transform_vector3(DVec3::NEG_X) - DVec3::Z).length() < 1e-9);
}

#[test]
fn transforms_act_in_pbrts_order() {
    let of = |text: &str| map(shape(&world(text)).common().transform);
    // The default camera makes the world left-handed: x is negated last.
    let m = of("Translate 1 2 3 Scale 2 2 2 Shape \"sphere\"");
    assert_eq!(m.transform_point3(DVec3::ONE), DVec3::new(-3.0, 4.0, 5.0));
    let m = of("Rotate 90 0 0 1 Shape \"sphere\"");
    assert!((m.transform_point3(DVec3::X) - DVec3::Y).length() < 1e-12);
    let m = of("Transform [2 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1] \
                ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 1 0 0 1] Shape \"sphere\"");
    assert_eq!(m.transform_point3(DVec3::ZERO), DVec3::new(-7.0, 6.0, 7.0));
    let m = of("AttributeBegin Translate 9 9 9 AttributeEnd TransformBegin Scale 3 3 3 TransformEnd Shape \"sphere\"");
    assert_eq!(m.translation, DVec3::ZERO);
    let m = of("Translate 1 0 0 CoordinateSystem \"here\" Identity CoordSysTransform \"here\" Shape \"sphere\"");
    assert_eq!(m.translation, DVec3::new(-1.0, 0.0, 0.0));
    // The camera's own system: 5 in front of the camera.
    let imported = read(
        "LookAt 0 0 -5 0 0 0 0 1 0 Camera \"perspective\" WorldBegin CoordSysTransform \"camera\" Translate 0 0 5 \
         Shape \"sphere\"",
    );
    assert!(map(shape(&imported).common().transform).translation.length() < 1e-12);
}

#[test]
fn fronts_of_quadrics_follow_reverse_orientation_and_handedness() {
    let reversed = |text: &str| shape(&world(text)).common().reverse_normal;
    assert!(!reversed("Shape \"sphere\""));
    assert!(reversed("ReverseOrientation Shape \"sphere\""));
    // pbrt's own normals turn inside out under a mirror; the mirror of the whole world does not count.
    assert!(reversed("Scale -1 1 1 Shape \"sphere\""));
    assert!(!reversed("Scale -1 1 1 ReverseOrientation Shape \"sphere\""));
    // Those of triangles do not.
    let triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]";
    assert!(!reversed(&format!("Scale -1 1 1 {triangle}")));
    assert!(reversed(&format!("ReverseOrientation {triangle}")));
}

#[test]
fn normals_turn_triangles() {
    let text = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \
                \"normal N\" [0 0 -1 0 0 -1 0 0 -1]";
    let imported = world(text);
    let ShapeDesc::Mesh(mesh) = shape(&imported) else { panic!() };
    assert_eq!(mesh.triangles.as_ref().unwrap(), &[[0, 2, 1]]);
}

#[test]
fn moving_things_have_keyframes_without_a_mirror() {
    let imported = world("ActiveTransform EndTime Translate 2 0 0 ActiveTransform All Shape \"sphere\"");
    let common = shape(&imported).common();
    assert_eq!(common.motion.len(), 2);
    let end = map(&common.motion[1].transform) * map(common.transform);
    assert_eq!(end.transform_point3(DVec3::ONE), DVec3::new(-3.0, 1.0, 1.0));
    assert!(common.motion.iter().all(|keyframe| map(&keyframe.transform).matrix3.determinant() > 0.0));
    let imported = world("ActiveTransform EndTime Scale 2 2 2 ActiveTransform All Scale -1 1 1 Shape \"sphere\"");
    assert!(
        shape(&imported).common().motion.iter().all(|keyframe| map(&keyframe.transform).matrix3.determinant() > 0.0)
    );
}

#[test]
fn instances_stand_where_pbrt_puts_them() {
    let imported = world(
        "Translate 0 1 0 ObjectBegin \"o\" Translate 1 0 0 Shape \"sphere\" ObjectEnd
         Translate 0 0 3 ObjectInstance \"o\" ObjectBegin \"none\" ObjectEnd ObjectInstance \"none\"",
    );
    let [instance] = imported.desc.instances.as_slice() else { panic!() };
    let inside = map(imported.desc.objects["o"].shapes[0].common().transform);
    assert_eq!((map(&instance.transform) * inside).translation, DVec3::new(-1.0, 2.0, 3.0));
    assert!(imported.desc.shapes.is_empty());
}

#[test]
fn parts_of_quadrics_are_ours() {
    let of = |text: &str| {
        let imported = world(text);
        let shape = shape(&imported);
        (serde_json::to_value(shape).unwrap(), map(shape.common().transform).translation.z)
    };
    let (sphere, _) = of("Shape \"sphere\" \"float radius\" 2 \"float zmin\" -1 \"float zmax\" 5 \"float phimax\" 90");
    assert_eq!(
        (&sphere["z_min"], &sphere["z_max"], &sphere["phi_max_degrees"]),
        (&(-1.0).into(), &serde_json::Value::Null, &90.0.into())
    );
    let (cylinder, z) = of("Shape \"cylinder\" \"float zmin\" 1 \"float zmax\" 4");
    assert_eq!((&cylinder["height"], z), (&3.0.into(), 1.0));
    let (disk, z) = of("Shape \"disk\" \"float height\" 2 \"float innerradius\" 0.5");
    assert_eq!((&disk["inner_radius"], z), (&0.5.into(), 2.0));
    for nothing in [
        "Shape \"sphere\" \"float radius\" 0",
        "Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 3",
        "Shape \"disk\" \"float innerradius\" 1",
        "Shape \"cylinder\" \"float zmin\" 1",
        "Shape \"sphere\" \"float phimax\" 0",
        "Scale 0 0 0 Shape \"sphere\"",
        "ObjectBegin \"o\" Shape \"sphere\" ObjectEnd Scale 1 1 0 ObjectInstance \"o\"",
    ] {
        let imported = world(nothing);
        assert!(imported.desc.shapes.is_empty() && imported.desc.instances.is_empty(), "{nothing}");
        assert_eq!(imported.report.count(Outcome::Ignored), 1, "{nothing}");
    }
}

#[test]
fn options_are_pbrts_defaults_and_values() {
    let film = &read("WorldBegin").desc;
    assert_eq!((film.film.width, film.film.height, film.sampler.spp), (1280, 720, 16));
    assert_eq!(film.film.filter, FilterDesc::Gaussian { radius: 1.5, sigma: 0.5, samples: None });
    assert!(matches!(film.integrator, IntegratorDesc::Path { max_depth: 6, .. }));
    let text = "Integrator \"path\" \"integer maxdepth\" 0 Sampler \"halton\" \"integer pixelsamples\" 7
        PixelFilter \"triangle\" \"float xradius\" 1 \"float yradius\" 1
        Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 50 \"float cropwindow\" [0.1 0.5 0.5 1]
        \"string filename\" \"a.exr\"
        WorldBegin";
    let desc = read(text).desc;
    assert!(matches!(desc.integrator, IntegratorDesc::Path { max_depth: 1, bidirectional: AutoDesc::Auto, .. }));
    let imported = read("Integrator \"bdpt\" WorldBegin");
    assert!(imported.report.is_exact());
    assert!(matches!(imported.desc.integrator, IntegratorDesc::Path { bidirectional: AutoDesc::On, .. }));
    assert_eq!((desc.sampler.spp, desc.film.filter), (7, FilterDesc::Tent { radius: 1.0, samples: None }));
    assert_eq!((desc.film.crop, desc.outputs[0].file.as_str()), (Some([10, 25, 40, 25]), "a.exr"));
}

#[test]
fn samplers_and_what_changes_the_noise_alone_are_mapped_with_a_note() {
    let imported = read(
        "Sampler \"independent\" \"integer pixelsamples\" 7 \"string randomization\" \"none\"
        Integrator \"path\" \"string lightsampler\" \"power\" WorldBegin",
    );
    assert!(imported.report.is_exact());
    let notes: Vec<_> =
        imported.report.entries.iter().map(|entry| (entry.parameter.as_str(), entry.note.as_str())).collect();
    assert!(notes.iter().any(|(name, note)| name.is_empty() && note.contains("--sampler independent")), "{notes:?}");
    assert!(notes.contains(&("lightsampler", "it changes the noise only")), "{notes:?}");
    assert!(notes.iter().any(|(name, note)| *name == "randomization" && note.contains("Owen")), "{notes:?}");
}

#[test]
fn lights_stand_in_the_mirrored_world() {
    let imported =
        world("Translate 1 0 0 LightSource \"point\" \"point3 from\" [1 2 3] \"rgb I\" [1 2 3] \"float scale\" 2");
    let LightDesc::Point(light) = &imported.desc.lights[0] else { panic!() };
    assert_eq!((light.position, light.intensity), ([-2.0, 2.0, 3.0], [2.0, 4.0, 6.0]));
    let imported = world("LightSource \"distant\" \"point3 from\" [1 1 0] \"point3 to\" [0 0 0] \"rgb L\" [3 3 3]");
    let LightDesc::Directional(light) = &imported.desc.lights[0] else { panic!() };
    assert_eq!((light.direction, light.irradiance), ([1.0, -1.0, 0.0], [3.0; 3]));
}

#[test]
fn byte_order_marks_are_passed_over() {
    let included = "\u{feff}Shape \"sphere\"\n";
    let scene =
        read_with("\u{feff}WorldBegin\nInclude \"a.pbrt\"\nShape \"disk\"\n", &[("a.pbrt", included.as_bytes())])
            .unwrap();
    assert_eq!(scene.desc.shapes.len(), 2);
}
