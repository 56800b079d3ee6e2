//! What is wrong, and where; what is not mapped.

use super::*;

#[test]
fn errors_have_a_line_and_a_column() {
    for (text, place) in [
        ("WorldBegin\n  Shap \"sphere\"", (2, 3)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" [ 1 x ]", (2, 35)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" -1", (2, 16)),
        ("WorldBegin\nShape \"sphere\" \"float radius\"", (2, 16)),
        ("WorldBegin\nShape \"sphere\" \"flat radius\" 1", (2, 16)),
        ("WorldBegin\nShape \"cone\"", (2, 1)),
        ("WorldBegin\nNamedMaterial \"x\"", (2, 1)),
        ("WorldBegin\nMaterial \"diffuse\" \"texture reflectance\" \"x\"", (2, 20)),
        ("WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [1 1]", (2, 20)),
        ("WorldBegin\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 1 1 2 2 2] \"integer indices\" [0 1 3]", (2, 53)),
        ("WorldBegin\nAttributeEnd", (2, 1)),
        ("WorldBegin\nAttributeBegin", (2, 15)),
        ("WorldBegin\nTransform [1 2 3]", (2, 1)),
        ("WorldBegin\nTransform [1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1]", (2, 1)),
        ("WorldBegin\nObjectInstance \"x\"", (2, 1)),
        ("WorldBegin\nObjectBegin \"x\" AttributeEnd", (2, 17)),
        ("WorldBegin\n[", (2, 1)),
        ("WorldBegin\n\"Shape", (2, 1)),
        ("Shape \"sphere\"", (1, 1)),
        ("WorldBegin WorldBegin", (1, 12)),
        ("", (1, 1)),
        ("WorldBegin Translate 1 nan 2", (1, 24)),
        ("Film \"rgb\" \"integer xresolution\" 0 WorldBegin", (1, 1)),
        ("Camera \"perspective\" \"float fov\" 180 WorldBegin", (1, 1)),
        ("Scale 0 1 1 Camera \"perspective\" WorldBegin", (1, 13)),
    ] {
        let error = read_with(text, &[]).unwrap_err();
        assert_eq!(line_and_column(&error), place, "{text}: {error}");
    }
}

#[test]
fn files_that_include_each_other_end() {
    let error = read_with("Include \"s.pbrt\"", &[]).unwrap_err();
    assert!(error.to_string().contains("too many files"), "{error}");
    let error =
        read_with("Include \"a\"", &[("a", b"Include \"b\" Include \"b\""), ("b", b"Include \"a\"")]).unwrap_err();
    assert!(error.to_string().contains("too many files"), "{error}");
    let error = read_with("Include \"none.pbrt\" WorldBegin", &[]).unwrap_err();
    assert!(matches!(&error, Error::Missing { file, .. } if file.ends_with("none.pbrt")), "{error}");
}

#[test]
fn included_files_go_on_where_the_first_stands() {
    let imported =
        read_with("WorldBegin Include \"a.pbrt\" Shape \"sphere\"", &[("a.pbrt", b"Translate 0 2 0")]).unwrap();
    assert_eq!(map(shape(&imported).common().transform).translation.y, 2.0);
    let error = read_with("WorldBegin Include \"a.pbrt\"", &[("a.pbrt", b"\nShap")]).unwrap_err();
    assert!(matches!(&error, Error::Parse { file, line: 2, .. } if file.ends_with("a.pbrt")), "{error}");
}

#[test]
fn missing_spectra_and_skies_are_missing_files() {
    for text in [
        "Material \"diffuse\" \"spectrum reflectance\" \"none.spd\"",
        "LightSource \"infinite\" \"string filename\" \"none.exr\"",
        "Material \"dielectric\" Shape \"plymesh\" \"string filename\" \"none.ply\"",
    ] {
        let error = read_with(&format!("WorldBegin {text}"), &[]).unwrap_err();
        assert!(matches!(error, Error::Missing { .. }), "{text}: {error}");
    }
}

#[test]
fn nesting_is_bounded() {
    let error = read_with(&"AttributeBegin\n".repeat(20_000), &[]).unwrap_err();
    assert!(error.to_string().contains("nested"), "{error}");
}

#[test]
fn spectra_come_from_files() {
    let text = "WorldBegin Material \"diffuse\" \"spectrum reflectance\" \"a.spd\" Shape \"sphere\"";
    let imported = read_with(text, &[("a.spd", b"# grey\n300 0.25\n900 0.25 # end\n")]).unwrap();
    let name = shape(&imported).common().material.unwrap();
    let crate::desc::MaterialDesc::Diffuse { albedo: crate::desc::ColorDesc::Rgb(color), .. } =
        &imported.desc.materials[name]
    else {
        panic!()
    };
    assert!(close(*color, [0.25; 3]), "{color:?}");
}

#[test]
fn the_report_lists_the_outcome_of_each_parameter() {
    let imported = world(
        "Material \"coateddiffuse\" \"rgb reflectance\" [1 2 0.5] \"float thickness\" 0.1 \"float madeup\" 1
         Shape \"sphere\" \"float radius\" 2 Shape \"disk\" \"float radius\" 0
         Shape \"plymesh\" \"string filename\" \"a.ply\" \"float edgelength\" 1",
    );
    assert_eq!(outcome(&imported, "Shape sphere", "radius"), Outcome::Mapped);
    assert_eq!(outcome(&imported, "Material", "reflectance"), Outcome::Approximated);
    assert_eq!(outcome(&imported, "Material", "thickness"), Outcome::Ignored);
    assert_eq!(outcome(&imported, "Material", "madeup"), Outcome::Ignored);
    assert_eq!(outcome(&imported, "Material", ""), Outcome::Approximated);
    assert_eq!(outcome(&imported, "Shape disk", ""), Outcome::Ignored);
    assert_eq!(outcome(&imported, "Shape plymesh", "edgelength"), Outcome::Ignored);
    assert!(imported.places.values().any(|place| place == "s.pbrt:3:10"), "{:?}", imported.places);
}
