//! Shapes, their uv and their sides.

use super::*;
use crate::desc::{ColorDesc, MeshDesc, MeshShadingDesc, SmoothByDesc, TextureDesc};

#[track_caller]
fn mesh(desc: &SceneDesc, i: usize) -> &MeshDesc {
    match shape(desc, i) {
        ShapeDesc::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

/// The scale and offset of the image on a shape of this kind.
#[track_caller]
fn image(shape: &str, to_uv: &str) -> ([f32; 2], f64, [f32; 2]) {
    let bitmap = format!(
        r#"<bsdf type="diffuse"><texture type="bitmap" name="reflectance">
        <string name="filename" value="a.png"/>{to_uv}</texture></bsdf>"#
    );
    let desc = scene(&shape.replace("BSDF", &bitmap));
    match desc.textures.values().next().unwrap() {
        TextureDesc::Image { scale, rotation_degrees, offset, .. } => (*scale, *rotation_degrees, *offset),
        other => panic!("{other:?}"),
    }
}

const RECTANGLE: &str = r#"<shape type="rectangle">BSDF</shape>"#;

#[test]
fn images_have_their_origin_at_the_top_left() {
    // Where v is Mitsuba's, images are mirrored; where it is one minus that, they are not.
    let upright = ([1.0, 1.0], 0.0, [0.0, 0.0]);
    let mirrored = ([1.0, -1.0], 0.0, [0.0, 1.0]);
    assert_eq!(image(RECTANGLE, ""), mirrored);
    assert_eq!(image(r#"<shape type="cube">BSDF</shape>"#, ""), mirrored);
    assert_eq!(image(r#"<shape type="cylinder">BSDF</shape>"#, ""), mirrored);
    // Mitsuba's v of a sphere begins at +z, Steradian's at -z.
    assert_eq!(image(r#"<shape type="sphere">BSDF</shape>"#, ""), upright);
    // Of a disk Mitsuba's u is the radius, Steradian's the angle.
    let (scale, degrees, _) = image(r#"<shape type="disk">BSDF</shape>"#, "");
    assert_near(degrees.abs(), 90.0);
    assert_near(f64::from(scale[0] * scale[1]), 1.0);
    let mesh = |kind: &str, flip: &str| {
        let flip = if flip.is_empty() {
            String::new()
        } else {
            format!("<boolean name=\"flip_tex_coords\" value=\"{flip}\"/>")
        };
        image(&format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"a.{kind}\"/>{flip}BSDF</shape>"), "")
    };
    // Mitsuba turns the v of OBJ files over, not that of PLY files.
    assert_eq!(mesh("obj", ""), upright);
    assert_eq!(mesh("obj", "false"), mirrored);
    assert_eq!(mesh("ply", ""), mirrored);
    assert_eq!(mesh("ply", "true"), upright);
}

#[test]
fn transforms_of_uv_act_before_the_image_is_looked_up() {
    // At (u, v), Mitsuba looks at column 2 u + 0.25 and at row 3 v from the top: at 1 - 3 v from the bottom.
    let to_uv = r#"<transform name="to_uv"><scale x="2" y="3"/><translate x="0.25"/></transform>"#;
    assert_eq!(image(RECTANGLE, to_uv), ([2.0, -3.0], 0.0, [0.25, 1.0]));
    // From u towards v and downward in the image: clockwise for us.
    let turned = r#"<transform name="to_uv"><scale x="2" y="3"/><rotate z="1" angle="30"/></transform>"#;
    let (scale, degrees, _) = image(RECTANGLE, turned);
    assert_near(f64::from(scale[0]), 2.0);
    assert_near(f64::from(scale[1]), -3.0);
    assert_near(degrees, -30.0);
    let sheared = r#"<shape type="rectangle"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
<string name="filename" value="a.png"/>
<transform name="to_uv"><rotate z="1" angle="30"/><scale x="2" y="3"/></transform></texture></bsdf></shape>"#;
    assert!(notes(sheared).iter().any(|(_, _, note)| note.contains("shears")));
}

#[test]
fn shapes_without_a_bsdf_are_grey_in_front_and_black_if_they_emit() {
    let desc = scene(
        r#"<shape type="rectangle"/><shape type="rectangle"><emitter type="area"/></shape>
<shape type="rectangle"><bsdf type="diffuse"/><emitter type="area"/></shape>"#,
    );
    let front_albedo = |i: usize| {
        let mut material = &desc.materials[shape(&desc, i).common().material.unwrap()];
        if let MaterialDesc::TwoSided { front, .. } = material {
            material = &desc.materials[front];
        }
        match material {
            MaterialDesc::Diffuse { albedo: ColorDesc::Grey(albedo), .. } => *albedo,
            MaterialDesc::Diffuse { albedo: ColorDesc::Rgb([red, ..]), .. } => *red,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!([front_albedo(0), front_albedo(1), front_albedo(2)], [0.5, 0.0, 0.5]);
}

#[test]
fn one_texture_on_different_shapes_becomes_two() {
    let desc = scene(
        r#"<bsdf type="diffuse" id="m"><texture type="bitmap" name="reflectance">
<string name="filename" value="a.png"/></texture></bsdf>
<shape type="rectangle"><ref id="m"/></shape><shape type="sphere"><ref id="m"/></shape><shape type="cube">
<ref id="m"/></shape>"#,
    );
    assert_eq!(desc.textures.len(), 2);
    let name = |i: usize| shape(&desc, i).common().material;
    assert!(name(0) != name(1) && name(0) == name(2));
}

#[test]
fn meshes_without_uv_have_barycentric_ones_where_textures_need_them() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\n\
               property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let read = |file: &str, color: &str, text: &str| {
        let scene = format!(
            r#"<scene version="3.0.0">{SENSOR}<shape type="{}"><string name="filename" value="{file}"/>
            <bsdf type="diffuse">{color}</bsdf></shape></scene>"#,
            &file[2..]
        );
        read_with(&scene, &[], &[(file, text.as_bytes())]).unwrap()
    };
    let checker = r#"<texture type="checkerboard" name="reflectance"/>"#;
    // The v of OBJ files is one minus Mitsuba's.
    let uvs =
        [("m.ply", ply, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), ("m.obj", obj, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]])];
    for (file, text, corners) in uvs {
        let imported = read(file, checker, text);
        let desc = mesh(&imported.desc, 0);
        let data = &imported.assets.meshes[desc.file.as_ref().unwrap()];
        assert_eq!(data.uvs, Some(corners.repeat(2)), "{file}");
        assert_eq!((data.positions.len(), &data.triangles[1], desc.smooth_by), (6, &[3, 4, 5], SmoothByDesc::Position));
        assert_eq!(data.positions[3..], [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert!(
            imported.report.entries.iter().any(|entry| entry.parameter == "uv" && entry.outcome == Outcome::Mapped)
        );
        let plain = read(file, "", text);
        assert_eq!((plain.assets.meshes.len(), mesh(&plain.desc, 0).file.as_deref()), (0, Some(file)));
    }
    let by = |file: &str, text: &str| mesh(&read(file, "", text).desc, 0).smooth_by;
    assert_eq!((by("m.ply", ply), by("m.obj", obj)), (SmoothByDesc::Index, SmoothByDesc::Position));
    let with_uv = obj.replace("f 1 2 3 4", "vt 0 0\nf 1/1 2/1 3/1 4/1");
    assert_eq!(mesh(&read("m.obj", checker, &with_uv).desc, 0).file.as_deref(), Some("m.obj"));
}

#[test]
fn checkers_keep_their_colours_where_v_is_turned_over() {
    let checker = |shape: &str, scale: &str| {
        let texture = format!(
            r#"<texture type="checkerboard" name="reflectance"><float name="color0" value="0.1"/>
<float name="color1" value="0.9"/>
<transform name="to_uv"><scale value="{scale}"/></transform></texture>"#
        );
        let desc = scene(&format!("<shape type=\"{shape}\"><bsdf type=\"diffuse\">{texture}</bsdf></shape>"));
        desc.textures.into_values().next().unwrap()
    };
    let parts = |texture| match texture {
        TextureDesc::Checker { color0, scale, .. } => (color0[0], scale),
        other => panic!("{other:?}"),
    };
    assert_eq!(parts(checker("rectangle", "4")), (0.1, [4.0, 4.0]));
    // Our v is one minus Mitsuba's: 4 - 4 v, and whole periods make no difference; half ones swap the colours.
    assert_eq!(parts(checker("sphere", "4")), (0.1, [4.0, -4.0]));
    assert_eq!(parts(checker("sphere", "4.5")), (0.9, [4.5, -4.5]));
    assert!(matches!(checker("sphere", "4.2"), TextureDesc::Image { .. }));
}

#[test]
fn spheres_and_cylinders_have_their_own_places() {
    let desc = scene(
        r#"<shape type="sphere"><point name="center" x="1"/><float name="radius" value="2"/><transform name="to_world">
<scale value="3"/></transform></shape>
<shape type="cylinder"><point name="p0" value="1,0,0"/><point name="p1" value="1,0,5"/>
<float name="radius" value="0.5"/></shape>"#,
    );
    let ShapeDesc::Sphere(sphere) = shape(&desc, 0) else { panic!() };
    assert_eq!(sphere.radius, 2.0);
    assert_point(moved(&sphere.transform, [0.0; 3]), [3.0, 0.0, 0.0]);
    let ShapeDesc::Cylinder(cylinder) = shape(&desc, 1) else { panic!() };
    assert_eq!((cylinder.radius, cylinder.height), (0.5, 5.0));
    assert_point(moved(&cylinder.transform, [0.0, 0.0, 5.0]), [1.0, 0.0, 5.0]);
    // A negative radius turns a sphere inside out.
    let inward = scene(r#"<shape type="sphere"><float name="radius" value="-2"/></shape>"#);
    let ShapeDesc::Sphere(sphere) = shape(&inward, 0) else { panic!() };
    assert_eq!((sphere.radius, sphere.reverse_normal), (2.0, true));
    for nothing in [
        r#"<shape type="sphere"><float name="radius" value="0"/></shape>"#,
        r#"<shape type="cylinder"><point name="p1" value="0,0,0"/></shape>"#,
        r#"<shape type="rectangle"><transform name="to_world"><scale x="1" y="0" z="1"/></transform></shape>"#,
    ] {
        assert!(scene(nothing).shapes.is_empty(), "{nothing}");
        assert!(notes(nothing).iter().any(|(outcome, ..)| *outcome == Outcome::Ignored), "{nothing}");
    }
}

#[test]
fn normals_of_meshes_are_smooth_unless_the_faces_are_wanted() {
    let desc = scene(
        r#"<shape type="ply"><string name="filename" value="a.ply"/></shape>
<shape type="ply"><string name="filename" value="a.ply"/><boolean name="face_normals" value="true"/></shape>
<shape type="obj"><string name="filename" value="a.obj"/><boolean name="flip_normals" value="true"/></shape>"#,
    );
    assert_eq!(mesh(&desc, 0).shading, MeshShadingDesc::Smooth);
    assert_eq!(mesh(&desc, 1).shading, MeshShadingDesc::Flat);
    assert!(mesh(&desc, 2).reverse_normal && !mesh(&desc, 0).reverse_normal);
    // The material of an OBJ file itself does not count.
    assert!(mesh(&desc, 2).material.is_some());
}

#[test]
fn mirrored_shapes_are_inside_out_where_mitsubas_are() {
    let mirror = r#"<transform name="to_world"><scale x="-1"/></transform>"#;
    let reversed = |shape: &str| scene(&shape.replace("MIRROR", mirror)).shapes[0].common().reverse_normal;
    assert!(reversed(r#"<shape type="sphere">MIRROR</shape>"#));
    assert!(!reversed(r#"<shape type="rectangle">MIRROR</shape>"#));
    assert!(!reversed(r#"<shape type="cube">MIRROR</shape>"#));
    assert!(reversed(
        r#"<shape type="ply"><string name="filename" value="a.ply"/>
        <boolean name="face_normals" value="true"/>MIRROR</shape>"#
    ));
    let with = |header: &str| {
        let text = format!(
            r#"<scene version="3.0.0">{SENSOR}<shape type="ply"><string name="filename" value="a.ply"/>{mirror}</shape>
            </scene>"#
        );
        let imported = read_with(&text, &[], &[("a.ply", header.as_bytes())]).unwrap();
        imported.desc.shapes[0].common().reverse_normal
    };
    assert!(with("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n"));
    assert!(!with("ply\nformat ascii 1.0\nelement vertex 3\nproperty float nx\nend_header\n"));
}

#[test]
fn instances_place_groups() {
    let imported = try_scene(
        r#"<shape type="shapegroup" id="g"><shape type="sphere"/><shape type="merge">
<shape type="disk"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="3"/></transform></shape>
<shape type="instance" id="second"><ref id="g"/></shape>"#,
    )
    .unwrap();
    let desc = &imported.desc;
    assert_eq!((desc.shapes.len(), desc.instances.len(), desc.objects["g"].shapes.len()), (0, 2, 2));
    assert_eq!(desc.instances[1].name.as_deref(), Some("second"));
    assert_point(moved(&desc.instances[0].transform, [0.0; 3]), [3.0, 0.0, 0.0]);
    assert!(message("<shape type=\"instance\"/>").contains("needs a shapegroup"));
    assert!(imported.places["instances[1]"].ends_with("s.xml:4:80") || imported.places.contains_key("instances[1]"));
}

#[test]
fn serialized_meshes_are_kept() {
    let file = super::super::serialized::tests::file(2, false);
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}<shape type="serialized"><string name="filename" value="a.serialized"/>
<integer name="shape_index" value="1"/></shape></scene>"#
    );
    let imported = read_with(&text, &[], &[("a.serialized", &file)]).unwrap();
    let name = mesh(&imported.desc, 0).file.clone().unwrap();
    assert_eq!(imported.assets.meshes[&name].positions[0], [1.0, 0.0, 0.0]);
    let error = read_with(&text.replace("value=\"1\"", "value=\"2\""), &[], &[("a.serialized", &file)]).unwrap_err();
    assert!(error.to_string().contains("2 meshes"), "{error}");
    assert_eq!(read_with(&text, &[], &[]).unwrap_err().kind(), crate::error::ErrorKind::AssetMissing);
}

#[test]
fn mitsubas_cube_looks_outward() {
    let cube = super::super::meshes::cube();
    let positions = cube.positions.unwrap();
    for t in cube.triangles.unwrap() {
        let [a, b, c] = t.map(|i| crate::math::DVec3::from(positions[i as usize]));
        assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
    }
}
