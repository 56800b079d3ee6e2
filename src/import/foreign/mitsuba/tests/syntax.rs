//! XML: defaults, includes, references, errors with places.

use super::*;

fn sphere_radius(imported: &Imported) -> f64 {
    match &imported.desc.shapes[0] {
        ShapeDesc::Sphere(sphere) => sphere.radius,
        other => panic!("{other:?}"),
    }
}

const WITH_DEFAULT: &str = concat!(
    r#"<scene version="3.0.0"><default name="r" value="2"/><default name="r" value="3"/>"#,
    "\n",
    r#"<default name="kind" value="perspective"/><sensor type="$kind"/>"#,
    r#"<shape type="sphere"><float name="radius" value="$r"/></shape></scene>"#
);

#[test]
fn the_first_default_counts_unless_the_user_defines_another_value() {
    assert_eq!(sphere_radius(&read_with(WITH_DEFAULT, &[], &[]).unwrap()), 2.0);
    assert_eq!(sphere_radius(&read_with(WITH_DEFAULT, &[("r", "5")], &[]).unwrap()), 5.0);
    let error = read_with(WITH_DEFAULT, &[("q", "5")], &[]).unwrap_err();
    assert!(error.to_string().contains("nothing uses $q"), "{error}");
    let error = read_with(&WITH_DEFAULT.replace("\"$r\"", "\"$kid\""), &[], &[]).unwrap_err().to_string();
    assert!(error.contains("s.xml:2:") && error.contains("$kid has no value (did you mean $kind?)"), "{error}");
}

#[test]
fn values_that_multiply_are_refused() {
    let mut text = "<scene version=\"3.0.0\"><default name=\"a0\" value=\"0123456789\"/>".to_owned();
    for i in 1..40 {
        text += &format!(
            "<default name=\"b{i}\" value=\"$a{0}$a{0}\"/><default name=\"a{i}\" value=\"$b{i}$b{i}\"/>",
            i - 1
        );
    }
    let error = read_with(&(text + "</scene>"), &[], &[]).unwrap_err();
    assert!(error.to_string().contains("too long"), "{error}");
}

#[test]
fn includes_and_paths_lead_to_files() {
    let inner = br#"<scene version="3.0.0"><bsdf type="diffuse" id="m"/></scene>"#;
    let text = format!(
        r#"<scene version="3.0.0"><path value="lib"/><include filename="inner.xml"/>{SENSOR}
<shape type="obj"><string name="filename" value="a.obj"/><ref id="m"/></shape>
<shape type="obj"><string name="filename" value="b.obj"/></shape></scene>"#
    );
    let imported = read_with(&text, &[], &[("lib/inner.xml", inner), ("lib/a.obj", b"v 0 0 0\n")]).unwrap();
    let file = |i: usize| if let ShapeDesc::Mesh(mesh) = &imported.desc.shapes[i] { mesh.file.clone() } else { None };
    assert_eq!(file(0).unwrap(), "lib/a.obj");
    // What is not found keeps its name, for the message.
    assert_eq!(file(1).unwrap(), "b.obj");
    let error = read_with(&text, &[], &[]).unwrap_err();
    assert_eq!(error.kind(), crate::error::ErrorKind::AssetMissing);
    assert!(error.to_string().contains("s.xml:1:"), "{error}");
}

#[test]
fn files_that_include_themselves_are_an_error() {
    let error = read_with(r#"<scene version="3.0.0"><include filename="s.xml"/></scene>"#, &[], &[]).unwrap_err();
    assert!(error.to_string().contains("include each other"), "{error}");
}

#[test]
fn references_may_point_forward_and_have_other_names() {
    let desc = scene(
        r#"<shape type="sphere"><ref id="later"/></shape><bsdf type="dielectric" id="later"/>
        <alias id="later" as="other"/>
        <shape type="sphere"><ref id="other"/></shape>"#,
    );
    assert_eq!(shape(&desc, 0).common().material, Some("later"));
    assert_eq!(shape(&desc, 1).common().material, Some("later"));
}

#[test]
fn mistakes_have_a_place_and_a_suggestion() {
    let cases = [
        (
            "\n<shape type=\"spere\"/>",
            "s.xml:3:1: Mitsuba has no shape of the type \"spere\" (did you mean \"sphere\"?)",
        ),
        ("\n <shpae type=\"sphere\"/>", "s.xml:3:2: unknown element <shpae> (did you mean <shape>?)"),
        (
            "\n<shape type=\"sphere\"><ref id=\"gold\"/></shape><bsdf type=\"diffuse\" id=\"Gold\"/>",
            "s.xml:3:22: nothing has the id \"gold\" (did you mean \"Gold\"?)",
        ),
        ("\n<shape type=\"sphere\"><float name=\"radius\" value=\"x\"/></shape>", "s.xml:3:22: \"x\" is not a number"),
        (
            "\n<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
            "s.xml:3:22: \"radius\" must be a number",
        ),
        (
            "\n<bsdf type=\"diffuse\" id=\"a\"/><bsdf type=\"diffuse\" id=\"a\"/>",
            "s.xml:3:30: the id \"a\" is given twice",
        ),
        (
            "\n<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"1\"/></shape>",
            "\"radius\" is given twice",
        ),
        (
            "\n<shape type=\"sphere\"><transform name=\"to_world\"><tarnslate x=\"1\"/></transform></shape>",
            "did you mean <translate>?",
        ),
        (
            "\n<shape type=\"sphere\"><bsdf type=\"roughdielectric\">\
             <string name=\"int_ior\" value=\"dimond\"/></bsdf></shape>",
            "did you mean \"diamond\"?",
        ),
        (
            "\n<shape type=\"sphere\"><bsdf type=\"conductor\">\
             <string name=\"material\" value=\"Agg\"/></bsdf></shape>",
            "no material named \"Agg\"",
        ),
        ("\n<shape type=\"sphere\">text</shape>", "s.xml:3:22: text outside of elements"),
        ("\n<shape type=\"sphere\"><default name=\"a\" value=\"1\"/></shape>", "can only stand in <scene>"),
        ("\n<shape/>", "s.xml:3:1: <shape> needs the attribute \"type\""),
    ];
    for (body, expected) in cases {
        let message = message(body);
        assert!(message.contains(expected), "{message}\n is not\n{expected}");
    }
}

#[test]
fn what_refers_to_itself_is_an_error() {
    let body = r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf><bsdf type="twosided" id="b"><ref id="a"/></bsdf>
        <shape type="sphere"><ref id="a"/></shape>"#;
    assert!(message(body).contains("refers to itself"));
    let group = r#"<shape type="shapegroup" id="g"><ref id="m"/></shape><shape type="merge" id="m"><ref id="m"/></shape>
        <shape type="instance"><ref id="g"/></shape>"#;
    assert!(message(group).contains("refers to itself"));
    assert!(message(r#"<integrator type="moment" id="i"><ref id="i"/></integrator>"#).contains("refers to itself"));
    // Each is twice a part of the next one.
    let mut doubled = "<bsdf type=\"diffuse\" id=\"b0\"/><shape type=\"disk\"><ref id=\"b60\"/></shape>".to_owned();
    for i in 1..=60 {
        doubled += &format!(
            "<bsdf type=\"blendbsdf\" id=\"b{i}\"><float name=\"weight\" value=\"0.5\"/><ref id=\"b{0}\"/>\
             <ref id=\"b{0}\"/></bsdf>",
            i - 1
        );
    }
    assert!(try_scene(&doubled).is_ok());
}

#[test]
fn damaged_texts_are_errors() {
    let whole = format!(
        "<scene version=\"3.0.0\">{SENSOR}<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/></shape></scene>"
    );
    assert!(read_with(&whole, &[], &[]).is_ok());
    for end in 0..whole.len() {
        let error = read_with(&whole[..end], &[], &[]).unwrap_err().to_string();
        assert!(error.contains("s.xml:"), "{error}");
    }
    let deep = format!("<scene version=\"3.0.0\">{}", "<shape type=\"merge\">".repeat(100_000));
    assert!(read_with(&deep, &[], &[]).is_err());
    let closed =
        format!("<scene version=\"3.0.0\">{}{}</scene>", "<shape type=\"merge\">".repeat(500), "</shape>".repeat(500));
    let error = read_with(&closed, &[], &[]).unwrap_err().to_string();
    assert!(error.contains("nested more than") || error.contains("not valid XML"), "{error}");
    let many = format!("<scene version=\"3.0.0\">{}</scene>", "<a/>".repeat(10_000));
    assert!(read_with(&many, &[], &[]).is_err());
    let entities = "<!DOCTYPE scene [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><scene version=\"3.0.0\">&b;</scene>";
    assert!(read_with(entities, &[], &[]).is_err());
}

#[test]
fn names_of_old_versions_are_understood() {
    let text = r#"<scene version="0.6.0"><sensor type="perspective"><string name="fovAxis" value="y"/>
<float name="fov" value="30"/>
<transform name="toWorld"><lookAt origin="0,0,5" target="0,0,0" up="0,1,0"/></transform></sensor></scene>"#;
    let desc = read_with(text, &[], &[]).unwrap().desc;
    assert_near(desc.camera.vertical_fov_degrees.unwrap(), 30.0);
}

#[test]
fn nothing_is_dropped_in_silence() {
    let unknown = r#"<shape type="sphere"><float name="colour" value="1"/><bsdf type="diffuse">
        <float name="shine" value="1"/></bsdf></shape>"#;
    let names: Vec<String> = notes(unknown).into_iter().map(|(_, name, _)| name).collect();
    assert_eq!(names, ["shine", "colour"]);
    let lacking = r#"<shape type="sdfgrid"/><medium type="homogeneous"/><emitter type="timed_sunsky"/>
        <shape type="sphere"><bsdf type="measured_polarized"/></shape>"#;
    let outcomes = notes(lacking);
    assert_eq!(outcomes.len(), 4, "{outcomes:?}");
    assert!(outcomes.iter().all(|(outcome, ..)| *outcome == Outcome::Ignored));
    assert_eq!(scene(lacking).shapes.len(), 1);
    assert!(try_scene("<shape type=\"sphere\"/>").unwrap().report.is_exact());
}

/// 13 files of 10 includes each, and so on, would be read 10^12 times.
#[test]
fn files_are_included_a_bounded_number_of_times() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |body: &str| format!("<scene version=\"3.0.0\">{body}</scene>");
    for i in 0..12 {
        let includes = format!("<include filename=\"i{}.xml\"/>", i + 1).repeat(10);
        std::fs::write(folder.path().join(format!("i{i}.xml")), scene(&includes)).unwrap();
    }
    std::fs::write(folder.path().join("i12.xml"), scene("")).unwrap();
    let error = super::super::xml::read(&folder.path().join("i0.xml"), &[]).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("includes files more than 1000 times"), "{error}");
}

#[test]
fn elements_have_a_bounded_number_of_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let read = |count: usize| {
        let attributes: String = (0..count).map(|i| format!(" a{i}='x=>y'")).collect();
        let file = folder.path().join("s.xml");
        std::fs::write(
            &file,
            format!(
                "<!-- {} -->\n<scene version=\"3.0.0\">\n<default name=\"a\" value=\"b\"{attributes}/></scene>",
                "= ".repeat(500)
            ),
        )
        .unwrap();
        super::super::xml::read(&file, &[]).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(read(90), Ok(()));
    let error = read(100_000).unwrap_err();
    assert!(error.contains("s.xml:3:1: ") && error.contains("more than 100 attributes"), "{error}");
}
