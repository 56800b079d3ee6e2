//! Materials and textures.

use super::*;
use crate::desc::{
    ChannelDesc, ColorDesc, ColorSpaceDesc, OpacityDesc, PhaseDesc, RangedDesc, RoughnessDesc, ScalarDesc,
    SubsurfaceMethodDesc, TextureDesc,
};
use crate::desc::{TextureFilterDesc, WrapDesc, WrapModeDesc};

/// A square with this material, named `m`, and one texture of four pixels.
fn square_of(mut material: Value) -> Asset {
    material["name"] = json!("m");
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(material);
    asset.json["textures"] = json!([{ "source": 0, "sampler": 0, "name": "map" }]);
    asset.json["samplers"] = json!([{}]);
    asset.json["images"] =
        json!([{ "uri": png(2, 2, &[[255, 0, 0, 255], [0, 255, 0, 128], [0, 0, 255, 127], [9, 9, 9, 0]]) }]);
    asset
}

fn look_of(material: Value) -> Imported {
    square_of(material).read()
}

fn constant(desc: &ScalarDesc) -> f32 {
    if let ScalarDesc::Constant(value) = desc { *value } else { panic!("{desc:?}") }
}

/// An image, its channel and its colour space; a factor, if it is a product with one.
fn image<'a>(
    imported: &'a Imported,
    name: &str,
) -> (&'a str, Option<ChannelDesc>, ColorSpaceDesc, Option<&'a ColorDesc>) {
    match &imported.desc.textures[name] {
        TextureDesc::Image { file, channel, color_space, .. } => (file, *channel, *color_space, None),
        TextureDesc::Product { factors } => match factors.as_slice() {
            [ColorDesc::Texture { texture }, factor] => {
                let (file, channel, space, _) = image(imported, texture);
                (file, channel, space, Some(factor))
            }
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

#[test]
fn without_a_material_a_surface_is_rough_white_metal() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(json!({}));
    asset.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let imported = asset.read();
    let desc = principled(&imported, "default");
    assert!(matches!(desc.base_color, ColorDesc::Rgb([1.0, 1.0, 1.0])));
    assert_eq!((constant(&desc.metallic), constant(&desc.roughness)), (1.0, 1.0));
}

#[test]
fn roughness_is_green_metal_is_blue_and_colour_is_srgb() {
    let texture = json!({ "index": 0 });
    let imported = look_of(json!({ "pbrMetallicRoughness": {
        "baseColorTexture": texture, "metallicRoughnessTexture": texture, "roughnessFactor": 0.5,
        "baseColorFactor": [0.5, 1, 1, 1]
    } }));
    let desc = principled(&imported, "m");
    let ColorDesc::Texture { texture: color } = &desc.base_color else { panic!() };
    let (file, channel, space, factor) = image(&imported, color);
    assert_eq!((channel, space), (None, ColorSpaceDesc::Srgb));
    assert!(matches!(factor, Some(ColorDesc::Rgb([0.5, 1.0, 1.0]))));
    assert_eq!(imported.assets.images[file].width, 2);
    let ScalarDesc::Texture { texture: roughness } = &desc.roughness else { panic!() };
    let (_, channel, space, factor) = image(&imported, roughness);
    assert_eq!((channel, space), (Some(ChannelDesc::G), ColorSpaceDesc::Linear));
    assert!(matches!(factor, Some(ColorDesc::Grey(0.5))));
    let ScalarDesc::Texture { texture: metallic } = &desc.metallic else { panic!() };
    assert_eq!(image(&imported, metallic).1, Some(ChannelDesc::B));
    assert_eq!(imported.assets.images.len(), 1);
    assert!(
        imported.report.entries.iter().all(|e| e.outcome == Outcome::Mapped || e.element == "file"),
        "{:?}",
        imported.report
    );
}

#[test]
fn alpha_counts_by_its_mode() {
    let look = |mode: &str, factor: f32, texture: bool| {
        let mut pbr = json!({ "baseColorFactor": [1, 1, 1, factor] });
        if texture {
            pbr["baseColorTexture"] = json!({ "index": 0 });
        }
        let imported = look_of(json!({ "pbrMetallicRoughness": pbr, "alphaMode": mode }));
        let opacity = imported.desc.shapes[0].common().opacity.cloned();
        (imported, opacity)
    };
    assert!(look("OPAQUE", 0.25, true).1.is_none());
    assert!(matches!(look("BLEND", 0.25, false).1, Some(OpacityDesc::Number(0.25))));
    assert!(look("MASK", 0.5, false).1.is_none());
    assert!(matches!(look("MASK", 0.49, false).1, Some(OpacityDesc::Number(0.0))));

    let (imported, opacity) = look("BLEND", 0.5, true);
    let Some(OpacityDesc::Texture { texture, threshold: None }) = opacity else { panic!() };
    let (_, channel, _, factor) = image(&imported, &texture);
    assert_eq!(channel, Some(ChannelDesc::A));
    assert!(matches!(factor, Some(ColorDesc::Grey(0.5))));

    let (imported, opacity) = look("MASK", 0.5, true);
    let Some(OpacityDesc::Texture { texture, threshold: Some(0.5) }) = opacity else { panic!() };
    let (_, channel, _, factor) = image(&imported, &texture);
    assert!(channel == Some(ChannelDesc::A) && matches!(factor, Some(ColorDesc::Grey(0.5))));
    assert_eq!(outcome(&imported, "alphaCutoff"), Some(Outcome::Mapped));
}

#[test]
fn emission_is_factor_times_strength_times_texture() {
    let imported = look_of(json!({
        "emissiveFactor": [1, 0.5, 0], "emissiveTexture": { "index": 0 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } }
    }));
    let emission = imported.desc.shapes[0].common().emission.unwrap();
    assert_eq!((emission.radiance, emission.two_sided), ([4.0, 2.0, 0.0], false));
    assert_eq!(image(&imported, emission.texture.as_ref().unwrap()).2, ColorSpaceDesc::Srgb);
    // That is light enough; without a strength it is a detail.
    assert!(imported.desc.lights.is_empty());
    let imported = look_of(json!({ "emissiveFactor": [1, 1, 1], "doubleSided": true }));
    assert!(imported.desc.shapes[0].common().emission.unwrap().two_sided);
    assert_eq!(imported.desc.lights.len(), 2);
}

#[test]
fn what_is_unlit_shows_its_colour() {
    let imported = look_of(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 1, 1] }, "extensions": { "KHR_materials_unlit": {} }
    }));
    assert_eq!(imported.desc.shapes[0].common().emission.unwrap().radiance, [0.25, 0.5, 1.0]);
    assert!(matches!(imported.desc.materials["m"], MaterialDesc::Diffuse { albedo: ColorDesc::Grey(0.0), .. }));
    assert_eq!(outcome(&imported, "KHR_materials_unlit"), Some(Outcome::Approximated));
}

#[test]
fn normal_maps_are_relief_with_their_scale() {
    let imported = look_of(json!({ "normalTexture": { "index": 0, "scale": 0.5 } }));
    let name = imported.desc.shapes[0].common().material.unwrap();
    let MaterialDesc::Relief { material, normal_map: Some(map), bump_map: None } = &imported.desc.materials[name]
    else {
        panic!()
    };
    assert_eq!((material.as_str(), map.strength, map.flip_y), ("m", 0.5, false));
    assert_eq!(image(&imported, &map.texture).2, ColorSpaceDesc::Linear);
}

#[test]
fn samplers_say_what_is_between_pixels_and_beyond_edges() {
    let look = |sampler: Value| {
        let mut asset = square_of(json!({ "normalTexture": { "index": 0 } }));
        asset.json["samplers"] = json!([sampler]);
        let imported = asset.read();
        let TextureDesc::Image { filter, wrap, .. } = imported.desc.textures["map"] else { panic!() };
        (filter, wrap)
    };
    assert_eq!(look(json!({})), (TextureFilterDesc::Trilinear, WrapDesc::default()));
    let sampler = json!({ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 });
    assert_eq!(
        look(sampler),
        (TextureFilterDesc::Nearest, WrapDesc::Each([WrapModeDesc::Clamp, WrapModeDesc::Mirror]))
    );
    let sampler = json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 });
    assert_eq!(look(sampler), (TextureFilterDesc::Bilinear, WrapDesc::Both(WrapModeDesc::Clamp)));
    assert_eq!(look(json!({ "magFilter": 9729, "minFilter": 9987 })).0, TextureFilterDesc::Trilinear);
}

#[test]
fn the_set_of_uv_is_that_of_the_textures() {
    let first = look_of(json!({ "normalTexture": { "index": 0 } }));
    assert_eq!(mesh(&first, 0).uvs.as_ref().unwrap()[1], [1.0, 0.0]);
    let second = look_of(json!({ "normalTexture": { "index": 0, "texCoord": 1 } }));
    assert_eq!(mesh(&second, 0).uvs.as_ref().unwrap()[1], [0.25, 0.75]);
    assert_eq!(outcome(&second, "texCoord"), None);
    let moved = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1, "scale": [2, 2] } } });
    let moved = look_of(json!({ "normalTexture": moved }));
    assert_eq!(mesh(&moved, 0).uvs.as_ref().unwrap()[1], [0.25, 0.75]);
    let TextureDesc::Image { scale, offset, .. } = moved.desc.textures["map"] else { panic!() };
    // The lower left corner, v = 0 from below, is v = 2 from above, and so -1 from below.
    assert_eq!((scale, offset), ([2.0, 2.0], [0.0, -1.0]));
    let mixed = look_of(json!({
        "normalTexture": { "index": 0, "texCoord": 1 }, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }
    }));
    assert_eq!(outcome(&mixed, "texCoord"), Some(Outcome::Approximated));
}

#[test]
fn a_mesh_without_uv_shows_one_colour() {
    let mut asset = square_of(json!({ "normalTexture": { "index": 0 } }));
    asset.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().retain(|key, _| key == "POSITION");
    let imported = asset.read();
    assert_eq!(mesh(&imported, 0).uvs.as_ref().unwrap()[..], [[0.0, 1.0]; 4]);
    assert_eq!(outcome(&imported, "TEXCOORD"), Some(Outcome::Approximated));
}

#[test]
fn colours_of_vertices_multiply_the_base_colour() {
    let colors = [[1.0f32, 0.0, 0.25], [1.0, 1.0, 0.25], [0.0, 1.0, 0.25], [0.0, 2.0, 0.25]];
    let colored = |material: Value, colors: &[[f32; 3]]| {
        let mut asset = square_of(material);
        let colors = asset.floats(colors);
        asset.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        asset.read()
    };
    let factors = |imported: &Imported| match &principled(imported, "m").base_color {
        ColorDesc::Texture { texture } => match &imported.desc.textures[texture] {
            TextureDesc::Product { factors } => factors.clone(),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    let imported = colored(json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 1, 1, 1] } }), &colors);
    let [ColorDesc::Texture { texture }, ColorDesc::Rgb([0.5, 1.0, 1.0])] = &factors(&imported)[..] else { panic!() };
    assert!(matches!(imported.desc.textures[texture], TextureDesc::VertexColor));
    assert_eq!(mesh(&imported, 0).colors(), Some(&colors.map(|c| c.map(|c| c.min(1.0)))[..]));
    assert_eq!(outcome(&imported, "COLOR_0"), Some(Outcome::Mapped));

    let textured = colored(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }), &colors);
    assert!(matches!(&factors(&textured)[..], [ColorDesc::Texture { .. }, ColorDesc::Texture { .. }]));
    let plain = colored(json!({}), &colors);
    assert!(matches!(&principled(&plain, "m").base_color, ColorDesc::Texture { texture } if texture == "vertex_color"));

    // One colour for all is a factor.
    let even =
        colored(json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 1, 1, 1] } }), &[[0.5, 0.25, 1.0]; 4]);
    assert!(matches!(principled(&even, "m").base_color, ColorDesc::Rgb([0.25, 0.25, 1.0])));
    assert_eq!((mesh(&even, 0).colors(), outcome(&even, "COLOR_0")), (None, Some(Outcome::Mapped)));

    let unlit = colored(json!({ "extensions": { "KHR_materials_unlit": {} } }), &colors);
    assert_eq!((mesh(&unlit, 0).colors(), outcome(&unlit, "COLOR_0")), (None, Some(Outcome::Approximated)));
    assert_eq!(unlit.desc.shapes[0].common().emission.unwrap().radiance, [0.5, 0.75, 0.25]);
}

#[test]
fn glass_is_thin_without_a_thickness_and_a_medium_where_it_absorbs() {
    let glass = |volume: Value| {
        look_of(json!({
            "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.25 },
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_ior": { "ior": 1.33 },
                "KHR_materials_volume": volume
            }
        }))
    };
    let thin = glass(json!({ "attenuationDistance": 1, "attenuationColor": [0.5, 0.5, 0.5] }));
    let desc = principled(&thin, "m");
    assert!(desc.thin && matches!(desc.ior, Some(RangedDesc::Constant(1.33))) && constant(&desc.transmission) == 1.0);
    let solid = glass(json!({ "thicknessFactor": 1 }));
    assert!(!principled(&solid, "m").thin);
    let tinted = glass(json!({ "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 0, 1] }));
    let MaterialDesc::Dielectric(medium) = &tinted.desc.materials["m"] else { panic!() };
    let absorption = medium.absorption.unwrap();
    assert_eq!((absorption.color, absorption.distance), ([0.5, 1e-4, 1.0], 2.0));
    assert!(matches!(medium.roughness, Some(RoughnessDesc::Isotropic(0.25))));
    assert_eq!(outcome(&tinted, "KHR_materials_volume"), Some(Outcome::Mapped));
}

#[test]
fn what_scatters_within_glass_is_its_medium() {
    // The albedo of a single scattering by the extension's formula.
    let single = |c: f64| 1.0 - (4.09712 + 4.20863 * c - (9.59217 + 41.6808 * c + 17.7126 * c * c).sqrt()).powi(2);
    let colors = [0.8, 0.3, 1.0];
    let body = |more: Value| {
        let mut extensions = json!({
            "KHR_materials_volume": {
                "thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.5, 0.25, 0.9]
            },
            "KHR_materials_volume_scatter": { "multiscatterColor": colors, "scatterAnisotropy": 0.5 }
        });
        extensions.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        look_of(json!({ "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": extensions }))
    };
    let milk = body(json!({ "KHR_materials_transmission": { "transmissionFactor": 1 } }));
    let MaterialDesc::Dielectric(glass) = &milk.desc.materials["m"] else { panic!() };
    assert!(glass.absorption.is_none());
    let medium = &milk.desc.media[glass.medium.as_ref().unwrap()];
    assert!(matches!(medium.phase, PhaseDesc::HenyeyGreenstein { g: 0.5 }));
    let extinction = [0.5f64, 0.25, 0.9].map(|c| -c.ln() / 0.5);
    for channel in 0..3 {
        let [absorption, scattering] = [medium.absorption, medium.scattering].map(|c| f64::from(c.to_array()[channel]));
        assert!(((absorption + scattering) / extinction[channel] - 1.0).abs() < 1e-5, "{channel}: {medium:?}");
        assert!((scattering / extinction[channel] - single(colors[channel])).abs() < 1e-4, "{channel}: {medium:?}");
    }
    assert_eq!(outcome(&milk, "KHR_materials_volume_scatter"), Some(Outcome::Mapped));

    let wax = body(json!({ "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.75 } }));
    let desc = principled(&wax, "m");
    assert_eq!((constant(&desc.subsurface), desc.subsurface_anisotropy), (0.75, Some(0.5)));
    assert!(matches!(desc.subsurface_method, SubsurfaceMethodDesc::RandomWalk));
    assert!(matches!(desc.base_color, ColorDesc::Rgb([0.8, 0.3, 1.0])));
    let radii = desc.subsurface_radius.unwrap().to_array();
    for channel in 0..3 {
        let reduced = extinction[channel] * (1.0 - 0.5 * single(colors[channel]));
        assert!((f64::from(radii[channel]) * reduced - 1.0).abs() < 1e-4, "{channel}: {radii:?}");
    }
    assert_eq!(outcome(&wax, "KHR_materials_diffuse_transmission"), Some(Outcome::Approximated));

    let opaque = body(json!({}));
    assert!(opaque.desc.media.is_empty() && principled(&opaque, "m").subsurface_radius.is_none());
    assert_eq!(outcome(&opaque, "KHR_materials_volume_scatter"), Some(Outcome::Ignored));
}

#[test]
fn a_clear_coat_is_a_dielectric_layer_of_its_strength() {
    let imported = look_of(json!({ "extensions": {
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 }
    } }));
    let MaterialDesc::Mix { materials: [plain, coated], amount } = &imported.desc.materials["m"] else { panic!() };
    assert_eq!(constant(amount), 0.5);
    principled(&imported, plain);
    let MaterialDesc::Coated { base, ior, roughness, .. } = &imported.desc.materials[coated] else { panic!() };
    assert_eq!(base, plain);
    assert!(matches!((ior, roughness), (RangedDesc::Constant(1.5), Some(RoughnessDesc::Isotropic(0.25)))));
    assert_eq!(outcome(&imported, "KHR_materials_clearcoat"), Some(Outcome::Mapped));
}

#[test]
fn anisotropy_keeps_both_widths() {
    let imported = look_of(json!({
        "pbrMetallicRoughness": { "roughnessFactor": 0.5 },
        "extensions": { "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 } }
    }));
    let desc = principled(&imported, "m");
    let alpha = constant(&desc.roughness).powi(2);
    let aspect = (1.0 - 0.9 * constant(&desc.anisotropic)).sqrt();
    // mix(0.25, 1, 0.25) along u and 0.25 across.
    assert!((alpha / aspect - 0.4375).abs() < 1e-5 && (alpha * aspect - 0.25).abs() < 1e-5);
    assert_eq!(outcome(&imported, "KHR_materials_anisotropy"), Some(Outcome::Mapped));
}

#[test]
fn specular_factors_are_reflectance_ahead() {
    let specular = |extensions: Value| {
        let imported = look_of(json!({ "extensions": extensions }));
        let desc = principled(&imported, "m");
        let ior = |ior: f32| ((ior - 1.0) / (ior + 1.0)).powi(2);
        match (&desc.specular, &desc.ior) {
            (Some(specular), None) => 0.08 * constant(specular),
            (None, Some(RangedDesc::Constant(value))) => ior(*value),
            other => panic!("{other:?}"),
        }
    };
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a} {b}");
    close(specular(json!({})), 0.04);
    close(specular(json!({ "KHR_materials_ior": { "ior": 2.0 } })), 1.0 / 9.0);
    close(specular(json!({ "KHR_materials_specular": { "specularFactor": 0.5 } })), 0.02);
    close(specular(json!({ "KHR_materials_specular": { "specularColorFactor": [5, 5, 5] } })), 0.2);
}

#[test]
fn what_cannot_be_shown_is_said() {
    let imported = look_of(json!({
        "occlusionTexture": { "index": 0 }, "extensions": { "KHR_materials_iridescence": { "iridescenceFactor": 1 } }
    }));
    assert_eq!(outcome(&imported, "occlusionTexture"), Some(Outcome::Ignored));
    assert_eq!(outcome(&imported, "KHR_materials_iridescence"), Some(Outcome::Ignored));
    assert!(!imported.report.is_exact());
}

#[test]
fn broken_images_and_indices_are_errors() {
    let mut asset = square_of(json!({ "normalTexture": { "index": 0 } }));
    asset.json["images"][0]["uri"] = json!("data:image/png,%89PNG");
    assert!(asset.try_read().unwrap_err().to_string().contains("images[0]"));
    asset.json["images"][0] = json!({ "name": "nothing" });
    assert!(asset.try_read().unwrap_err().to_string().contains("has neither `uri` nor `bufferView`"));
    asset.json["materials"][0] = json!({ "extensions": { "KHR_materials_clearcoat": {
        "clearcoatFactor": 1, "clearcoatTexture": { "index": 7 } } } });
    let message = asset.try_read().unwrap_err().to_string();
    assert!(
        message.contains("materials[0].extensions.KHR_materials_clearcoat.clearcoatTexture: no textures[7]"),
        "{message}"
    );
}
