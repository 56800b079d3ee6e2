//! BSDFs and textures.

use super::*;
use crate::desc::{
    ColorDesc, ColorSpaceDesc, DistributionDesc, OpacityDesc, RangedDesc, RoughnessDesc, ScalarDesc, TextureDesc,
    TextureFilterDesc,
};

const BITMAP: &str = r#"<texture type="bitmap" name="NAME"><string name="filename" value="a.png"/>MORE</texture>"#;

fn bitmap(name: &str, more: &str) -> String {
    BITMAP.replace("NAME", name).replace("MORE", more)
}

#[track_caller]
fn ior(ior: &RangedDesc) -> f64 {
    if let RangedDesc::Constant(v) = ior { f64::from(*v) } else { panic!() }
}

#[test]
fn backs_are_black_unless_both_sides_are_wanted() {
    let back = |bsdf: &str| {
        let desc = scene(&format!("<shape type=\"sphere\">{bsdf}</shape>"));
        match &desc.materials[desc.shapes[0].common().material.unwrap()] {
            MaterialDesc::TwoSided { back, .. } => Some(desc.materials[back].clone()),
            _ => None,
        }
    };
    let is_black = |m: Option<MaterialDesc>| {
        matches!(
            m, Some(MaterialDesc::Diffuse { albedo: ColorDesc::Grey(v), .. }) if v == 0.0
        )
    };
    for kind in ["diffuse", "conductor", "roughconductor", "plastic", "roughplastic", "principled"] {
        assert!(is_black(back(&format!("<bsdf type=\"{kind}\"/>"))), "{kind}");
        assert!(back(&format!("<bsdf type=\"twosided\"><bsdf type=\"{kind}\"/></bsdf>")).is_none(), "{kind}");
    }
    assert!(is_black(back("")), "a shape without a bsdf");
    let glass = r#"<bsdf type="principled"><float name="spec_trans" value="0.5"/></bsdf>"#;
    for bsdf in
        ["<bsdf type=\"dielectric\"/>", "<bsdf type=\"thindielectric\"/>", "<bsdf type=\"principledthin\"/>", glass]
    {
        assert!(back(bsdf).is_none(), "{bsdf}");
    }
    let two = r#"<bsdf type="twosided"><bsdf type="plastic"/><bsdf type="diffuse">
        <rgb name="reflectance" value="1 0 0"/></bsdf></bsdf>"#;
    assert!(matches!(back(two), Some(MaterialDesc::Diffuse { albedo: ColorDesc::Rgb([1.0, 0.0, 0.0]), .. })));
    // Relief and holes keep the black back.
    let wrapped = format!(
        "<bsdf type=\"mask\">{}<bsdf type=\"bumpmap\">{}<bsdf type=\"diffuse\"/></bsdf></bsdf>",
        bitmap("opacity", ""),
        bitmap("b", "")
    );
    assert!(is_black(back(&wrapped)));
}

#[test]
fn indices_of_refraction_are_relative() {
    let glass = |inside: &str| match front(&format!("<bsdf type=\"dielectric\">{inside}</bsdf>")) {
        MaterialDesc::Dielectric(glass) => ior(&glass.ior),
        other => panic!("{other:?}"),
    };
    assert_near(glass(""), 1.5046 / 1.000277);
    assert_near(glass(r#"<string name="int_ior" value="Diamond"/><float name="ext_ior" value="1"/>"#), 2.419);
    assert_near(glass(r#"<float name="int_ior" value="1"/><string name="ext_ior" value="water"/>"#), 1.0 / 1.333);
    let MaterialDesc::Plastic(plastic) = front("<bsdf type=\"plastic\"/>") else { panic!() };
    assert_near(ior(&plastic.ior), 1.49 / 1.000277);
}

#[test]
fn metals_by_name_index_and_mirror() {
    let metal = |inside: &str| match front(&format!("<bsdf type=\"roughconductor\">{inside}</bsdf>")) {
        MaterialDesc::Conductor { eta, k, alpha, multiscatter, .. } => {
            (eta.unwrap(), k.unwrap(), alpha.unwrap(), multiscatter)
        }
        other => panic!("{other:?}"),
    };
    let (eta, _, alpha, multiscatter) = metal(r#"<string name="material" value="Au"/>"#);
    assert_eq!(eta[0], 0.143);
    // Alpha is alpha itself, and light that is scattered twice is lost.
    assert!(matches!(alpha, RoughnessDesc::Isotropic(a) if a == 0.1) && !multiscatter);
    let (eta, k, alpha, _) = metal(
        r#"<rgb name="eta" value="1 2 3"/><float name="k" value="4"/><float name="alpha_u" value="0.2"/>
        <float name="alpha_v" value="0.3"/>"#,
    );
    assert_eq!((eta, k), ([1.0, 2.0, 3.0], [4.0; 3]));
    assert!(matches!(alpha, RoughnessDesc::Anisotropic([0.2, 0.3])));
    let mirror = r#"<bsdf type="conductor"><string name="material" value="none"/>
        <float name="specular_reflectance" value="0.9"/></bsdf>"#;
    assert!(matches!(front(mirror), MaterialDesc::Mirror { reflectance: ColorDesc::Grey(v) } if v == 0.9));
    assert!(matches!(front("<bsdf type=\"conductor\"/>"), MaterialDesc::Mirror { reflectance: ColorDesc::Grey(1.0) }));
    assert_eq!(metal("").0, [1e-6; 3]);
}

#[test]
fn beckmann_is_the_default_of_rough_surfaces() {
    let rough = |kind: &str, more: &str| format!(r#"<bsdf type="{kind}">{more}</bsdf>"#);
    let of = |bsdf: &str| match front(bsdf) {
        MaterialDesc::Conductor { distribution, .. } => distribution,
        MaterialDesc::Dielectric(glass) => glass.distribution,
        MaterialDesc::Plastic(plastic) => plastic.distribution,
        other => panic!("{other:?}"),
    };
    let ggx = r#"<string name="distribution" value="ggx"/>"#;
    for kind in ["roughconductor", "roughdielectric", "roughplastic"] {
        assert_eq!(
            (of(&rough(kind, "")), of(&rough(kind, ggx))),
            (DistributionDesc::Beckmann, DistributionDesc::GgxSeparable),
            "{kind}"
        );
        assert!(notes(&format!("<shape type=\"sphere\">{}</shape>", rough(kind, ""))).is_empty(), "{kind}");
    }
}

#[test]
fn each_alpha_has_its_texture() {
    let text =
        format!(r#"<bsdf type="roughconductor">{}<float name="alpha_v" value="0.3"/></bsdf>"#, bitmap("alpha_u", ""));
    let MaterialDesc::Conductor { alpha: Some(RoughnessDesc::Axes { u, v }), .. } = front(&text) else { panic!() };
    assert!(matches!((u, v), (ScalarDesc::Texture { .. }, ScalarDesc::Constant(v)) if v == 0.3));
}

#[test]
fn plastics_are_as_written() {
    let plastic = |kind: &str, more: &str| match front(&format!(r#"<bsdf type="{kind}">{more}</bsdf>"#)) {
        MaterialDesc::Plastic(plastic) => plastic,
        other => panic!("{other:?}"),
    };
    let plain = plastic("plastic", "");
    assert!(!plain.nonlinear && plain.alpha.is_none() && matches!(plain.albedo, ColorDesc::Grey(v) if v == 0.5));
    assert!(matches!(plain.coat_tint, ColorDesc::Grey(v) if v == 1.0));
    let more = r#"<boolean name="nonlinear" value="true"/><rgb name="specular_reflectance" value="0.1 0.2 0.3"/>"#;
    let rough = plastic("roughplastic", &format!(r#"<string name="distribution" value="ggx"/>{more}"#));
    assert!(rough.nonlinear && rough.distribution == DistributionDesc::GgxSeparable && !rough.multiscatter);
    assert!(matches!(rough.coat_tint, ColorDesc::Rgb(color) if color == [0.1, 0.2, 0.3]));
    assert_eq!(plastic("roughplastic", "").distribution, DistributionDesc::Beckmann);
}

#[test]
fn glass_has_colours_at_its_surface() {
    let colors = r#"<rgb name="specular_reflectance" value="0.1 0.2 0.3"/>
        <rgb name="specular_transmittance" value="0.4 0.5 0.6"/>"#;
    for kind in ["dielectric", "roughdielectric", "thindielectric"] {
        let (reflection, transmission) = match front(&format!(r#"<bsdf type="{kind}">{colors}</bsdf>"#)) {
            MaterialDesc::Dielectric(glass) => (glass.reflection_tint, glass.transmission_tint),
            MaterialDesc::ThinDielectric { reflection_tint, transmission_tint, .. } => {
                (reflection_tint, transmission_tint)
            }
            other => panic!("{other:?}"),
        };
        assert!(matches!(reflection, ColorDesc::Rgb(color) if color == [0.1, 0.2, 0.3]), "{kind}");
        assert!(matches!(transmission, ColorDesc::Rgb(color) if color == [0.4, 0.5, 0.6]), "{kind}");
    }
}

#[test]
fn principled_surfaces_have_mitsubas_defaults() {
    let MaterialDesc::Principled(p) = front("<bsdf type=\"principled\"/>") else { panic!() };
    let zero = |s: &ScalarDesc| matches!(s, ScalarDesc::Constant(v) if *v == 0.0);
    assert!(zero(&p.clearcoat_gloss) && zero(&p.sheen_tint) && zero(&p.transmission) && !p.multiscatter && !p.thin);
    assert!(matches!(p.specular, Some(ScalarDesc::Constant(v)) if v == 0.5) && p.ior.is_none());
    let MaterialDesc::Principled(p) = front(r#"<bsdf type="principled"><float name="eta" value="1.4"/></bsdf>"#) else {
        panic!()
    };
    assert!(p.specular.is_none() && (ior(p.ior.as_ref().unwrap()) - 1.4).abs() < 1e-6);
    let thin = r#"<bsdf type="principledthin"><float name="diff_trans" value="1.5"/></bsdf>"#;
    let MaterialDesc::Principled(p) = front(thin) else { panic!() };
    // Mitsuba's go up to 2; without specular transmission it has no highlights.
    assert!(p.thin && matches!(p.diffuse_transmission, ScalarDesc::Constant(v) if v == 0.75));
    assert_eq!(ior(p.ior.as_ref().unwrap()), 1.0);
    let mixed = r#"<bsdf type="principledthin"><float name="spec_trans" value="0.25"/></bsdf>"#;
    assert!(matches!(front(mixed), MaterialDesc::Mix { amount: ScalarDesc::Constant(v), .. } if v == 0.25));
}

#[test]
fn attributes_of_meshes_are_colours_of_vertices() {
    let attribute = |name: &str, more: &str| {
        format!(
            r#"<bsdf type="diffuse"><texture type="mesh_attribute" name="reflectance">
            <string name="name" value="{name}"/>{more}</texture></bsdf>"#
        )
    };
    let shape = |bsdf: &str| format!(r#"<shape type="ply"><string name="filename" value="m.ply"/>{bsdf}</shape>"#);
    let desc = scene(&shape(&attribute("vertex_color", "")));
    let is_attribute = |desc: &SceneDesc, expected: &str, factor: f32| {
        matches!(
            desc.textures.values().collect::<Vec<_>>()[..],
            [TextureDesc::MeshAttribute { name, scale }] if name == expected && *scale == factor
        )
    };
    assert!(is_attribute(&desc, "vertex_color", 1.0));
    let scaled = scene(&shape(&attribute("vertex_color", r#"<float name="scale" value="0.5"/>"#)));
    assert!(is_attribute(&scaled, "vertex_color", 0.5));
    assert!(is_attribute(&scene(&shape(&attribute("face_temp", ""))), "face_temp", 1.0));
    assert!(message(&shape(&attribute("temp", ""))).contains("vertex_ or face_"));
    let hole = r#"<bsdf type="mask"><texture type="mesh_attribute" name="opacity">
        <string name="name" value="vertex_a"/></texture><bsdf type="diffuse"/></bsdf>"#;
    assert!(matches!(
        scene(&shape(hole)).shapes[0].common().opacity,
        Some(OpacityDesc::Texture { texture, .. }) if texture == "vertex_a"
    ));
    let light = r#"<emitter type="area"><texture type="mesh_attribute" name="radiance">
        <string name="name" value="vertex_color"/></texture></emitter>"#;
    assert_eq!(scene(&shape(light)).shapes[0].common().emission.unwrap().texture.as_deref(), Some("vertex_color"));
    assert!(notes(&shape(light)).is_empty());
}

#[test]
fn masks_and_null_are_holes_of_the_shape() {
    let opacity = |bsdf: &str| {
        let desc = scene(&format!("<shape type=\"sphere\">{bsdf}</shape>"));
        (desc.shapes[0].common().opacity.cloned(), desc.textures)
    };
    assert!(matches!(opacity(r#"<bsdf type="null"/>"#).0, Some(OpacityDesc::Number(v)) if v == 0.0));
    let mask = r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="diffuse"/></bsdf>"#;
    assert!(matches!(opacity(mask).0, Some(OpacityDesc::Number(v)) if v == 0.25));
    let (textured, textures) =
        opacity(&format!("<bsdf type=\"mask\">{}<bsdf type=\"diffuse\"/></bsdf>", bitmap("opacity", "")));
    // The luminance counts, not the alpha that the image may have: the product of one factor is no image.
    let Some(OpacityDesc::Texture { texture, .. }) = textured else { panic!() };
    assert!(matches!(textures[&texture], TextureDesc::Product { .. }));
    // What emits light has no holes here.
    let lamp = r#"<shape type="sphere"><bsdf type="null"/><emitter type="area"/></shape>"#;
    assert!(scene(lamp).shapes[0].common().opacity.is_none());
    assert!(!notes(lamp).is_empty());
}

#[test]
fn images_are_srgb_unless_raw_or_floats() {
    let texture = |more: &str, file: &str| {
        let text = bitmap("reflectance", more).replace("a.png", file);
        let desc = scene(&format!("<shape type=\"sphere\"><bsdf type=\"diffuse\">{text}</bsdf></shape>"));
        match desc.textures.into_values().next().unwrap() {
            TextureDesc::Image { color_space, filter, .. } => (color_space, filter),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(texture("", "a.png"), (ColorSpaceDesc::Srgb, TextureFilterDesc::Bilinear));
    assert_eq!(texture(r#"<boolean name="raw" value="true"/>"#, "a.png").0, ColorSpaceDesc::Linear);
    assert_eq!(texture("", "a.EXR").0, ColorSpaceDesc::Linear);
    assert_eq!(texture(r#"<string name="filter_type" value="nearest"/>"#, "a.png").1, TextureFilterDesc::Nearest);
    assert!(
        message(&format!(
            "<shape type=\"sphere\"><bsdf type=\"diffuse\">{}</bsdf></shape>",
            bitmap("reflectance", r#"<string name="wrap_mode" value="fold"/>"#)
        ))
        .contains("neither repeat")
    );
}

#[test]
fn blends_and_reliefs_consist_of_others() {
    let blend = r#"<bsdf type="blendbsdf"><float name="weight" value="0.3"/><bsdf type="diffuse"/>
        <bsdf type="plastic"/></bsdf>"#;
    let MaterialDesc::Mix { amount: ScalarDesc::Constant(v), .. } = front(blend) else { panic!() };
    assert_eq!(v, 0.3);
    assert!(
        message("<shape type=\"sphere\"><bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/></bsdf></shape>")
            .contains("needs 2 bsdfs")
    );
    let bump = format!(
        "<bsdf type=\"bumpmap\"><float name=\"scale\" value=\"0.5\"/>{}<bsdf type=\"diffuse\"/></bsdf>",
        bitmap("x", "")
    );
    let MaterialDesc::Relief { bump_map: Some(map), .. } = front(&bump) else { panic!() };
    assert_eq!(map.height, 0.5);
    let normal = format!("<bsdf type=\"normalmap\">{}<bsdf type=\"diffuse\"/></bsdf>", bitmap("normalmap", ""));
    assert!(matches!(front(&normal), MaterialDesc::Relief { normal_map: Some(_), .. }));
    // Green is up on all shapes, whichever way their images are.
    let flips = |shape: &str| match material(&scene(&format!("<shape type=\"{shape}\">{normal}</shape>")), 0) {
        MaterialDesc::Relief { normal_map: Some(map), .. } => map.flip_y,
        other => panic!("{other:?}"),
    };
    assert!(flips("rectangle") && !flips("sphere"));
    // Normals are never sRGB.
    assert_eq!(notes(&format!("<shape type=\"sphere\">{normal}</shape>"))[0].1, "raw");
}

#[test]
fn parts_and_textures_may_be_references() {
    let shared = format!(
        r#"{}<bsdf type="diffuse" id="d"><rgb name="reflectance" value="1 0 0"/></bsdf><bsdf type="plastic" id="p"/>"#,
        bitmap("t", "").replace("name=", "id=").replacen("id=\"filename\"", "name=\"filename\"", 1)
    );
    let nested =
        |bsdf: &str| scene(&format!("{shared}<shape type=\"sphere\"><bsdf type=\"twosided\">{bsdf}</bsdf></shape>"));
    let is_red = |desc: &SceneDesc, name: &str| {
        matches!(
            &desc.materials[name], MaterialDesc::Diffuse { albedo: ColorDesc::Rgb(c), .. } if *c == [1.0, 0.0, 0.0]
        )
    };
    for (bsdf, texture) in [("normalmap", "normalmap"), ("bumpmap", "arbitrary")] {
        for part in
            ["<ref id=\"d\"/>", "<ref name=\"bsdf\" id=\"d\"/>", "<bsdf type=\"twosided\"><ref id=\"d\"/></bsdf>"]
        {
            let desc = nested(&format!("<bsdf type=\"{bsdf}\"><ref name=\"{texture}\" id=\"t\"/>{part}</bsdf>"));
            let MaterialDesc::Relief { material: inner, normal_map, bump_map } = material(&desc, 0) else {
                panic!("{bsdf} {part}")
            };
            assert!(is_red(&desc, &inner), "{bsdf} {part}");
            assert_eq!(normal_map.map(|map| map.texture).or(bump_map.map(|map| map.texture)).as_deref(), Some("t"));
        }
    }
    let desc = nested("<bsdf type=\"blendbsdf\"><ref name=\"weight\" id=\"t\"/><ref id=\"p\"/><ref id=\"d\"/></bsdf>");
    let MaterialDesc::Mix { materials, amount: ScalarDesc::Texture { texture } } = material(&desc, 0) else { panic!() };
    assert_eq!((materials[0].as_str(), is_red(&desc, &materials[1]), texture.as_str()), ("p", true, "t"));
    let desc = nested("<bsdf type=\"mask\"><ref name=\"opacity\" id=\"t\"/><ref id=\"d\"/></bsdf>");
    assert!(is_red(&desc, desc.shapes[0].common().material.unwrap()));
    assert!(matches!(desc.shapes[0].common().opacity, Some(OpacityDesc::Texture { .. })));
    assert!(
        message("<shape type=\"sphere\"><bsdf type=\"bumpmap\"><ref id=\"x\"/></bsdf></shape>")
            .contains("nothing has the id")
    );
}

#[test]
fn where_a_number_is_needed_checkers_have_the_other_colour() {
    // As in Mitsuba 3.9.
    let checker = r#"<texture type="checkerboard" name="NAME"><float name="color0" value="0.1"/>
        <float name="color1" value="0.9"/></texture>"#;
    let first = |bsdf: &str| match scene(&format!("<shape type=\"rectangle\">{bsdf}</shape>"))
        .textures
        .into_values()
        .next()
        .unwrap()
    {
        TextureDesc::Checker { color0, .. } => color0[0],
        other => panic!("{other:?}"),
    };
    assert_eq!(first(&format!("<bsdf type=\"diffuse\">{}</bsdf>", checker.replace("NAME", "reflectance"))), 0.1);
    assert_eq!(first(&format!("<bsdf type=\"roughconductor\">{}</bsdf>", checker.replace("NAME", "alpha"))), 0.9);
}

#[test]
fn spectra_become_colours() {
    let color = |spectrum: &str| match front(&format!("<bsdf type=\"diffuse\">{spectrum}</bsdf>")) {
        MaterialDesc::Diffuse { albedo: ColorDesc::Rgb(color), .. } => color,
        MaterialDesc::Diffuse { albedo: ColorDesc::Grey(v), .. } => [v; 3],
        other => panic!("{other:?}"),
    };
    assert_eq!(color(r#"<spectrum name="reflectance" value="0.3"/>"#), [0.3; 3]);
    // As Mitsuba has it.
    let expected = [0.648611, 0.369724, 0.12023];
    let found = color(r#"<spectrum name="reflectance" value="400:0.1, 500:0.2, 600:0.6, 700:0.4"/>"#);
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.003), "{found:?}");
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}<shape type="sphere"><bsdf type="diffuse">
        <spectrum name="reflectance" filename="a.spd"/></bsdf></shape></scene>"#
    );
    assert!(read_with(&text, &[], &[("a.spd", b"400 0.5\n700 0.5\n")]).is_ok());
    assert!(read_with(&text, &[], &[("a.spd", b"400\n")]).unwrap_err().to_string().contains("line 1"));
}
