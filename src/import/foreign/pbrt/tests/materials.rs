//! Materials, textures and light.

use super::*;
use crate::desc::{
    ChannelDesc, ColorDesc, ColorSpaceDesc, LightDesc, MaterialDesc, OpacityDesc, RangedDesc, RoughnessDesc,
    ScalarDesc, SubsurfaceMethodDesc, TextureDesc,
};

/// The material of a scene with one sphere of it.
fn material(text: &str) -> MaterialDesc {
    let imported = world(&format!("{text} Shape \"sphere\""));
    let name = shape(&imported).common().material.unwrap().to_owned();
    imported.desc.materials[&name].clone()
}

fn emission(text: &str) -> [f32; 3] {
    let imported = read(text);
    shape(&imported).common().emission.unwrap().radiance
}

#[test]
fn an_rgb_light_of_one_is_a_pixel_of_one_at_any_unit_exposure() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"float scale\" 2 Shape \"sphere\"";
    assert_eq!(emission(&format!("WorldBegin {light}")), [2.0, 4.0, 6.0]);
    assert_eq!(emission(&format!("Film \"rgb\" \"float iso\" 50 WorldBegin {light}")), [1.0, 2.0, 3.0]);
    let slow = "Camera \"perspective\" \"float shutterclose\" 4 WorldBegin";
    assert_eq!(emission(&format!("{slow} {light}")), [8.0, 16.0, 24.0]);
}

#[test]
fn spectra_of_light_have_luminance_one() {
    let luminance = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    for spectrum in ["\"blackbody L\" 3000", "\"spectrum L\" [300 7 800 7]", "\"spectrum L\" \"stdillum-A\"", ""] {
        let color =
            emission(&format!("WorldBegin AreaLightSource \"diffuse\" {spectrum} \"float scale\" 5 Shape \"sphere\""));
        assert!((luminance(color) - 5.0).abs() < 0.02, "{spectrum}: {color:?}");
    }
    assert_eq!(emission("WorldBegin AreaLightSource \"diffuse\" Shape \"sphere\""), [1.0; 3]);
}

#[test]
fn power_is_that_of_each_shape() {
    let pi = std::f32::consts::PI;
    // A sphere of radius 2 has an area of 16 pi.
    let sphere =
        emission("WorldBegin AreaLightSource \"diffuse\" \"float power\" 10 Shape \"sphere\" \"float radius\" 2");
    assert!(close(sphere, [10.0 / (16.0 * pi * pi); 3]), "{sphere:?}");
    let quad = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 2 0 2 2 0]";
    let both =
        emission(&format!("WorldBegin AreaLightSource \"diffuse\" \"float power\" 10 \"bool twosided\" true {quad}"));
    // One patch of area 4 with two sides, though it is two triangles here.
    assert!(close(both, [10.0 / (2.0 * pi * 4.0); 3]), "{both:?}");
    let triangles = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 2 0 0 0 2 0 2 2 0] \"integer indices\" [0 1 2 2 1 3]";
    let each = emission(&format!("WorldBegin AreaLightSource \"diffuse\" \"float power\" 10 {triangles}"));
    assert!(close(each, [10.0 / (pi * 2.0); 3]), "{each:?}");
}

#[test]
fn lights_without_shape_have_their_power() {
    let pi = std::f32::consts::PI;
    let lights = world(
        "LightSource \"point\" \"float power\" 8 LightSource \"spot\" \"float power\" 8 \"float coneangle\" 60 \
         \"float conedeltaangle\" 60",
    )
    .desc
    .lights;
    let (LightDesc::Point(point), LightDesc::Spot(spot)) = (&lights[0], &lights[1]) else { panic!() };
    assert!(close(point.intensity, [2.0 / pi; 3]));
    // From the axis to 60 degrees: half of 1 - 1/2.
    assert!(close(spot.intensity, [8.0 / (2.0 * pi * 0.25); 3]), "{spot:?}");
    assert_eq!((spot.cutoff_angle_degrees, spot.beam_angle_degrees), (60.0, Some(0.0)));
    let lights = world(
        "LightSource \"infinite\" \"float illuminance\" 6 LightSource \"infinite\" \"rgb L\" [1 2 3] \"float scale\" 2",
    )
    .desc
    .lights;
    let (LightDesc::Environment(a), LightDesc::Environment(b)) = (&lights[0], &lights[1]) else { panic!() };
    assert!(close(a.radiance.unwrap(), [6.0 / pi; 3]) && b.radiance == Some([2.0, 4.0, 6.0]));
}

#[test]
fn alpha_is_the_root_of_the_roughness_unless_it_is_not_remapped() {
    let alpha = |text: &str| match material(&format!("Material \"conductor\" {text}")) {
        MaterialDesc::Conductor { alpha, multiscatter: false, .. } => alpha,
        other => panic!("{other:?}"),
    };
    assert!(alpha("").is_none());
    assert!(matches!(alpha("\"float roughness\" 0.25"), Some(RoughnessDesc::Isotropic(a)) if a == 0.5));
    assert!(matches!(
        alpha("\"float roughness\" 0.25 \"bool remaproughness\" false"),
        Some(RoughnessDesc::Isotropic(a)) if a == 0.25
    ));
    let uneven = alpha("\"float uroughness\" 0.25 \"float vroughness\" 0.04");
    assert!(matches!(uneven, Some(RoughnessDesc::Anisotropic([u, v])) if u == 0.5 && v == 0.2));
    let textured = "Texture \"t\" \"float\" \"checkerboard\" Material \"conductor\" \"texture uroughness\" \"t\" \
                    \"float vroughness\" 0.04";
    let MaterialDesc::Conductor { alpha: Some(RoughnessDesc::Axes { u, v }), .. } = material(textured) else {
        panic!()
    };
    assert!(matches!((u, v), (ScalarDesc::Texture { .. }, ScalarDesc::Constant(v)) if (v - 0.2).abs() < 1e-6));
    // Smooth below 0.001, of alpha.
    assert!(alpha("\"float roughness\" 0.0009 \"bool remaproughness\" false").is_none());
    assert!(alpha("\"float roughness\" 0.0009").is_some());
}

#[test]
fn metals_are_copper_or_what_they_reflect() {
    let MaterialDesc::Conductor { eta, .. } = material("Material \"conductor\"") else { panic!() };
    assert_eq!(eta, Some([0.1337, 0.9552, 1.2142]));
    let MaterialDesc::Conductor { eta, k, .. } = material("Material \"conductor\" \"rgb reflectance\" [0.5 0.25 0]")
    else {
        panic!()
    };
    for (eta, (k, expected)) in eta.unwrap().into_iter().zip(k.unwrap().into_iter().zip([0.5, 0.25, 0.0f32])) {
        let reflectance = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((reflectance - expected).abs() < 1e-6);
    }
}

#[test]
fn glass_has_an_index_by_number_or_by_name() {
    let MaterialDesc::Dielectric(glass) = material("Material \"dielectric\" \"float eta\" 1.3") else { panic!() };
    assert!(
        matches!(glass.ior, RangedDesc::Constant(ior) if ior == 1.3) && glass.abbe.is_none() && !glass.multiscatter
    );
    let MaterialDesc::Dielectric(glass) = material("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\"") else {
        panic!()
    };
    assert!(matches!(glass.ior, RangedDesc::Constant(ior) if ior == 1.5168) && glass.abbe == Some(64.17));
}

#[test]
fn colours_below_coats_deepen() {
    let plastic = |text: &str| match material(&format!("Material \"coateddiffuse\" {text}")) {
        MaterialDesc::Plastic(plastic) => plastic,
        other => panic!("{other:?}"),
    };
    let constant = plastic("\"rgb reflectance\" [0.578596 1 0] \"float roughness\" 0.04");
    assert!(
        constant.nonlinear
            && !constant.multiscatter
            && matches!(constant.albedo, ColorDesc::Rgb(base) if close(base, [0.578596, 1.0, 0.0]))
    );
    assert!(plastic("\"float uroughness\" 0.04 \"float vroughness\" 0.1").multiscatter);
}

#[test]
fn coated_metals_are_two_materials() {
    let imported = world(
        "Material \"coatedconductor\" \"spectrum conductor.eta\" \"metal-Al-eta\" \"float interface.roughness\" 0.04 \
         Shape \"sphere\"",
    );
    let name = shape(&imported).common().material.unwrap();
    let MaterialDesc::Coated { base, alpha: Some(RoughnessDesc::Isotropic(alpha)), .. } =
        &imported.desc.materials[name]
    else {
        panic!()
    };
    assert_eq!(*alpha, 0.2);
    let MaterialDesc::Conductor { eta: Some(eta), .. } = &imported.desc.materials[base] else { panic!() };
    assert!((eta[0] - 1.4286 / 1.5).abs() < 1e-6);
}

#[test]
fn mixes_name_their_parts_and_interfaces_vanish() {
    let imported = world(
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" \"conductor\"
         MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 0.25
         NamedMaterial \"m\" Shape \"sphere\" Material \"interface\" Shape \"sphere\"",
    );
    let MaterialDesc::Mix { materials, .. } = &imported.desc.materials[shape(&imported).common().material.unwrap()]
    else {
        panic!()
    };
    assert_eq!(materials, &["a", "b"]);
}

#[test]
fn diffuse_transmission_gains_no_light() {
    let text = "Material \"diffusetransmission\" \"rgb reflectance\" [0.8 0 0] \"rgb transmittance\" [0.8 0.1 0] \
                \"float scale\" 1";
    let MaterialDesc::DiffuseTransmission { reflectance: ColorDesc::Rgb(r), transmittance: ColorDesc::Rgb(t) } =
        material(text)
    else {
        panic!()
    };
    assert!(close(r, [0.5, 0.0, 0.0]) && close(t, [0.5, 0.0625, 0.0]));
}

#[test]
fn textures_keep_their_two_kinds_apart() {
    let imported = world(
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"c.png\" \"float uscale\" 2 \"float vdelta\" 0.5
         Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"m.png\" \"string encoding\" \"linear\"
         Texture \"half\" \"spectrum\" \"scale\" \"texture tex\" \"t\" \"float scale\" 0.5
         Material \"diffuse\" \"texture reflectance\" \"half\"
         Shape \"sphere\" \"texture alpha\" \"t\"",
    );
    let common = shape(&imported).common();
    let MaterialDesc::Diffuse { albedo: ColorDesc::Texture { texture }, .. } =
        &imported.desc.materials[common.material.unwrap()]
    else {
        panic!()
    };
    let TextureDesc::Product { factors } = &imported.desc.textures[texture] else { panic!() };
    assert!(matches!(&factors[..], [ColorDesc::Texture { .. }, ColorDesc::Rgb([0.5, 0.5, 0.5])]));
    let TextureDesc::Image { scale, offset, color_space, channel, .. } = &imported.desc.textures["t"] else { panic!() };
    assert_eq!((*scale, *offset, *color_space, *channel), ([2.0, 1.0], [0.0, 0.5], ColorSpaceDesc::Srgb, None));
    let Some(OpacityDesc::Texture { texture, .. }) = common.opacity else { panic!() };
    let TextureDesc::Image { file, color_space, channel, .. } = &imported.desc.textures[texture] else { panic!() };
    assert_eq!((file.as_str(), *color_space, *channel), ("m.png", ColorSpaceDesc::Linear, None));
}

#[test]
fn numbers_of_images_are_alpha_where_it_matters() {
    let channel = |pixels: &[u8], color: image::ColorType| {
        let mut png = std::io::Cursor::new(Vec::new());
        image::write_buffer_with_format(&mut png, pixels, 2, 1, color, image::ImageFormat::Png).unwrap();
        let text = "WorldBegin Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"m.png\"";
        let imported = read_with(text, &[("m.png", png.get_ref())]).unwrap();
        let TextureDesc::Image { channel, .. } = imported.desc.textures["t"] else { panic!() };
        (channel, outcome(&imported, "Texture", "filename"))
    };
    use image::ColorType::{L8, Rgb8, Rgba8};
    assert_eq!(channel(&[1, 2, 3, 4, 5, 6, 7, 255], Rgba8), (Some(ChannelDesc::A), Outcome::Approximated));
    assert_eq!(channel(&[1, 1, 1, 255, 5, 5, 5, 255], Rgba8), (Some(ChannelDesc::R), Outcome::Mapped));
    assert_eq!(channel(&[1, 2, 3, 5, 5, 5], Rgb8), (None, Outcome::Approximated));
    assert_eq!(channel(&[1, 2], L8), (Some(ChannelDesc::R), Outcome::Mapped));
}

#[test]
fn subsurface_is_a_random_walk() {
    let principled = |rest: &str| {
        let MaterialDesc::Principled(desc) = material(&format!("Material \"subsurface\" {rest}")) else { panic!() };
        assert_eq!(desc.subsurface_method, SubsurfaceMethodDesc::RandomWalk);
        assert!(matches!(desc.subsurface, ScalarDesc::Constant(1.0)));
        let radius = desc.subsurface_radius.unwrap().to_array();
        (*desc, radius)
    };
    let (desc, radius) = principled(
        "\"rgb reflectance\" [0.8 0.5 0.2] \"rgb mfp\" [1 0.5 0.25] \"float scale\" 2 \"float roughness\" 0.0625",
    );
    let ColorDesc::Rgb(color) = desc.base_color else { panic!() };
    assert!(close(color, [0.8, 0.5, 0.2]) && close(radius, [2.0, 1.0, 0.5]));
    assert!(matches!(desc.ior, Some(RangedDesc::Constant(1.33))) && desc.subsurface_anisotropy.is_none());
    let ScalarDesc::Constant(roughness) = desc.roughness else { panic!() };
    assert!(close([roughness], [0.5]));
    // Of coefficients: the mean free path of reduced scattering, and a colour that is white without absorption.
    let (desc, radius) = principled("\"rgb sigma_a\" [1 0 3] \"rgb sigma_s\" [2 2 2] \"float g\" 0.5");
    let ColorDesc::Rgb(color) = desc.base_color else { panic!() };
    assert!(close(radius, [0.5, 1.0, 0.25]) && color[1] == 1.0 && color[2] < color[0] && color[0] < 0.5, "{color:?}");
    assert_eq!(desc.subsurface_anisotropy, Some(0.5));
    // Measured media; milk where nothing is given.
    let (_, skin) = principled("\"string name\" \"Skin1\"");
    assert!(close(skin, [1.0 / 0.772, 1.0 / 1.05, 1.0 / 1.49]));
    assert_eq!(principled("").1, principled("\"string name\" \"Wholemilk\"").1);
    let unknown = world("Material \"subsurface\" \"string name\" \"Tofu\" Shape \"sphere\"");
    assert_eq!(outcome(&unknown, "Material", "name"), Outcome::Approximated);
}

#[test]
fn constants_are_folded() {
    let text = "Texture \"a\" \"spectrum\" \"constant\" \"rgb value\" [0.2 0.4 0.6]
        Texture \"m\" \"spectrum\" \"mix\" \"texture tex1\" \"a\" \"rgb tex2\" [1 1 1] \"float amount\" 0.5
        Material \"diffuse\" \"texture reflectance\" \"m\"";
    let MaterialDesc::Diffuse { albedo: ColorDesc::Rgb(color), .. } = material(text) else { panic!() };
    assert!(close(color, [0.6, 0.7, 0.8]));
}

#[test]
fn a_square_of_the_checkerboard_is_one_unit_wide() {
    let text = "Texture \"c\" \"spectrum\" \"checkerboard\" \"float uscale\" 8 \"float vscale\" 4
        \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 1 0]
        Material \"diffuse\" \"texture reflectance\" \"c\" Shape \"sphere\"";
    let TextureDesc::Checker { color0, color1, scale } = world(text).desc.textures["c"].clone() else { panic!() };
    assert_eq!((color0, color1, scale), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [4.0, 2.0]));
}

#[test]
fn attributes_are_defaults_of_later_directives() {
    let imported = world("AttributeBegin Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" AttributeEnd");
    assert_eq!(serde_json::to_value(shape(&imported)).unwrap()["radius"], 3.0);
}

#[test]
fn the_default_material_has_no_name() {
    assert!(shape(&world("Shape \"sphere\"")).common().material.is_none());
}

#[test]
fn textured_meshes_without_uv_get_pbrts() {
    let text = "Texture \"c\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"c\"
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"integer indices\" [0 1 2 2 1 3]";
    let imported = world(text);
    let ShapeDesc::Mesh(mesh) = shape(&imported) else { panic!() };
    assert_eq!((mesh.uvs.as_ref().unwrap().len(), mesh.positions.as_ref().unwrap().len()), (6, 6));
}

#[test]
fn a_goniometric_light_has_a_profile() {
    // Bright in the middle, which is the image's z: the light's y, here turned towards z.
    let is_bright = |i: usize| (16..48).contains(&(i % 64)) && (16..48).contains(&(i / 64));
    let pixels: Vec<u8> = (0..64 * 64).map(|i| if is_bright(i) { 255 } else { 0 }).collect();
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, &pixels, 64, 64, image::ColorType::L8, image::ImageFormat::Png).unwrap();
    let found = read_with(
        "WorldBegin Translate 1 2 3 Rotate 90 1 0 0 LightSource \"goniometric\" \"string filename\" \"lamp.png\" \
         \"rgb I\" [1 2 3] \"float power\" 5",
        &[("lamp.png", png.get_ref())],
    )
    .unwrap();
    let LightDesc::Ies(ies) = &found.desc.lights[0] else { panic!("{:?}", found.desc.lights) };
    assert!(ies.look_at.is_none() && ies.rotation_degrees == 0.0);
    let profile = &found.assets.profiles[&ies.file];
    let at = |towards: DVec3| {
        let (theta, phi) = ((-towards.y).acos().to_degrees(), (-towards.z).atan2(towards.x).to_degrees());
        let nearest = |angles: &[f32], angle: f64| {
            let distance = |i: &usize| (f64::from(angles[*i]) - angle.rem_euclid(360.0)).abs();
            (0..angles.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
        };
        let column = nearest(&profile.horizontal, phi) * profile.vertical.len();
        profile.candela[column + nearest(&profile.vertical, theta)]
    };
    for (direction, expected) in [
        (DVec3::Z, 1.0),
        (DVec3::new(0.3, 0.3, 0.9), 1.0),
        (DVec3::NEG_Z, 0.0),
        (DVec3::X, 0.0),
        (DVec3::Y, 0.0),
        (DVec3::NEG_Y, 0.0),
    ] {
        assert_eq!(at(direction.normalize()), expected, "{direction}");
    }
    // A quarter of all directions is bright.
    assert!((ies.intensity[0] * std::f32::consts::PI / 5.0 - 1.0).abs() < 1e-5, "{ies:?}");
}

#[test]
fn a_projection_is_a_projector() {
    // Twice as wide as high: the angle is that from the lower to the upper edge.
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, &[9, 9], 2, 1, image::ColorType::L8, image::ImageFormat::Png).unwrap();
    let imported = read_with(
        "WorldBegin Translate 1 2 3 LightSource \"projection\" \"string filename\" \"slide.png\" \"float fov\" 40 \
         \"float scale\" 2",
        &[("slide.png", png.get_ref())],
    )
    .unwrap();
    let LightDesc::Projector(light) = &imported.desc.lights[0] else { panic!() };
    assert_eq!((light.irradiance, light.aspect), ([2.0; 3], Some(2.0)));
    assert!((light.vertical_fov_degrees - 40.0).abs() < 1e-9);
    let [from, to] = [light.position, light.look_at].map(DVec3::from);
    assert!(
        ((to - from).length() - 1.0).abs() < 1e-9
            && light.up.is_some_and(|up| DVec3::from(up).dot(to - from).abs() < 1e-9)
    );
    let TextureDesc::Image { file, .. } = &imported.desc.textures[light.texture.as_ref().unwrap()] else { panic!() };
    assert_eq!(file, "slide.png");
}

#[test]
fn skies_are_turned_with_their_transform() {
    // A 2 x 2 equal-area image, one quarter of which is bright: x > 0, y > 0, all z.
    let mut pfm = b"PF\n2 2\n-1\n".to_vec();
    // Rows from the bottom: the last row of the image is y > 0.
    for value in [0.0f32, 1.0, 0.0, 0.0] {
        pfm.extend([value; 3].iter().flat_map(|x| x.to_le_bytes()));
    }
    let imported = read_with(
        "Scale -1 1 1 Camera \"perspective\" WorldBegin LightSource \"infinite\" \"string filename\" \"sky.pfm\" \
         \"float scale\" 2",
        &[("sky.pfm", &pfm)],
    )
    .unwrap();
    let LightDesc::Environment(light) = &imported.desc.lights[0] else { panic!() };
    let sky = &imported.assets.environments[light.file.as_ref().unwrap()];
    assert_eq!((sky.width, sky.height, light.scale), (4, 2, 2.0));
    let turn = map(light.transform.as_ref().unwrap()).matrix3;
    // Columns of the image: their middles are at the angles of -x+z, -x-z, x-z, x+z in its own space.
    let bright = (0..4).find(|&column| sky.pixels[column][0] > 0.9).unwrap();
    let d = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]][bright];
    let d = turn * DVec3::new(d[0], 0.0, d[1]);
    assert!((d - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-9, "{d}");
}

#[test]
fn measured_materials_are_those_of_their_files() {
    let found = material("Material \"measured\" \"string filename\" \"coin.bsdf\"");
    assert!(matches!(&found, MaterialDesc::Measured { file } if file == "coin.bsdf"), "{found:?}");
    let error = read_with("WorldBegin Material \"measured\" Shape \"sphere\"", &[]).err().unwrap().to_string();
    assert!(error.contains("needs a filename"), "{error}");
}
