//! Emitters.

use super::*;
use crate::desc::LightDesc;

#[track_caller]
fn light(body: &str) -> LightDesc {
    scene(body).lights.into_iter().next().unwrap()
}

#[test]
fn point_spot_and_directional_lights() {
    let LightDesc::Point(point) = light(
        r#"<emitter type="point"><point name="position" value="1 2 3"/><rgb name="intensity" value="4 5 6"/>
        </emitter>"#,
    ) else {
        panic!()
    };
    assert_eq!((point.position, point.intensity), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    let spot = r#"<emitter type="spot"><transform name="to_world"><lookat origin="0,3,0" target="0,0,0" up="0,0,1"/>
        </transform><float name="cutoff_angle" value="30"/></emitter>"#;
    let LightDesc::Spot(spot) = light(spot) else { panic!() };
    assert_point(spot.position, [0.0, 3.0, 0.0]);
    assert_point(spot.look_at, [0.0, 2.0, 0.0]);
    assert_eq!((spot.cutoff_angle_degrees, spot.beam_angle_degrees, spot.intensity), (30.0, Some(22.5), [1.0; 3]));
    let LightDesc::Directional(sun) = light(
        r#"<emitter type="directional"><vector name="direction" value="0 -1 0"/><float name="irradiance" value="2"/>
        </emitter>"#,
    ) else {
        panic!()
    };
    assert_eq!((sun.direction, sun.irradiance), ([0.0, -1.0, 0.0], [2.0; 3]));
    let LightDesc::Directional(sun) = light(
        r#"<emitter type="directional"><transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>"#,
    ) else {
        panic!()
    };
    assert_point(sun.direction, [0.0, -1.0, 0.0]);
}

#[test]
fn environments_begin_behind() {
    let LightDesc::Environment(map) = light(
        r#"<emitter type="envmap"><string name="filename" value="a.exr"/><float name="scale" value="2"/></emitter>"#,
    ) else {
        panic!()
    };
    assert_eq!((map.file.as_deref(), map.scale), (Some("a.exr"), 2.0));
    // Mitsuba's first column, behind the camera here (+Z), is -Z; a quarter further is +X, here -X.
    let transform = map.transform.unwrap();
    assert_point(moved(&transform, [0.0, 0.0, 1.0]), [0.0, 0.0, -1.0]);
    assert_point(moved(&transform, [-1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    assert_point(moved(&transform, [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
    let turned = r#"<emitter type="envmap"><string name="filename" value="a.exr"/><transform name="to_world">
        <rotate x="1" angle="90"/><scale value="2"/></transform></emitter>"#;
    let LightDesc::Environment(map) = light(turned) else { panic!() };
    assert_point(moved(&map.transform.unwrap(), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
    assert!(!notes(turned).is_empty());
}

#[test]
fn other_images_become_environments() {
    let mut png = std::io::Cursor::new(Vec::new());
    let mut image = image::RgbImage::new(2, 1);
    image.put_pixel(1, 0, image::Rgb([255, 188, 0]));
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}<emitter type="envmap"><string name="filename" value="a.png"/></emitter>
        </scene>"#
    );
    let imported = read_with(&text, &[], &[("a.png", png.get_ref())]).unwrap();
    let map = imported.assets.environments.values().next().unwrap();
    assert_eq!((map.width, map.height, map.pixels[1][0], map.pixels[1][2]), (2, 1, 1.0, 0.0));
    assert!((map.pixels[1][1] - 0.5).abs() < 5e-3);
    assert_eq!(read_with(&text, &[], &[]).unwrap_err().kind(), crate::error::ErrorKind::AssetMissing);
}

#[test]
fn area_lights_belong_to_shapes() {
    let desc =
        scene(r#"<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="1 2 3"/></emitter></shape>"#);
    let emission = desc.shapes[0].common().emission.unwrap();
    assert_eq!((emission.radiance, emission.two_sided), ([1.0, 2.0, 3.0], false));
    let textured = r#"<shape type="rectangle"><emitter type="area"><texture type="bitmap" name="radiance">
        <string name="filename" value="a.exr"/></texture></emitter></shape>"#;
    let desc = scene(textured);
    assert_eq!(desc.shapes[0].common().emission.unwrap().texture.as_deref(), Some("a"));
    assert!(message("<emitter type=\"area\"/>").contains("can only stand in a shape"));
}

#[test]
fn emitted_spectra_are_seen_as_they_are() {
    let intensity = |spectrum: &str| match light(&format!("<emitter type=\"point\">{spectrum}</emitter>")) {
        LightDesc::Point(point) => point.intensity,
        other => panic!("{other:?}"),
    };
    let near = |a: [f32; 3], b: [f32; 3]| {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.004 * b), "{a:?} is not {b:?}");
    };
    // As Mitsuba has them: equal energy is warmer than white, and a plain number is white.
    near(intensity(r#"<spectrum name="intensity" value="0.5"/>"#), [0.602397, 0.474146, 0.454458]);
    near(
        intensity(r#"<spectrum name="intensity" value="400:0, 500:8, 600:15.6, 700:18.4"/>"#),
        [20.7108, 10.8546, 2.77115],
    );
    assert_eq!(intensity(r#"<float name="intensity" value="2"/>"#), [2.0; 3]);
    assert_eq!(
        intensity(r#"<spectrum name="intensity" type="d65"><float name="scale" value="3"/></spectrum>"#),
        [3.0; 3]
    );
    let warm =
        intensity(r#"<spectrum name="intensity" type="blackbody"><float name="temperature" value="3000"/></spectrum>"#);
    assert!(warm[0] > warm[1] && warm[1] > warm[2] && warm[1] > 100.0, "{warm:?}");
}

#[test]
fn a_sky_is_an_image_and_a_sun_and_is_reported() {
    let text = r#"<emitter type="sunsky"><vector name="sun_direction" value="0 0.6 0.8"/>
        <float name="sky_scale" value="2"/></emitter>"#;
    let imported = try_scene(text).unwrap();
    assert_eq!((imported.assets.environments.len(), imported.desc.lights.len()), (1, 2));
    let LightDesc::Environment(sky) = &imported.desc.lights[0] else { panic!() };
    // The zenith is +Z.
    assert_point(moved(sky.transform.as_ref().unwrap(), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
    let LightDesc::Directional(sun) = &imported.desc.lights[1] else { panic!() };
    assert_point(sun.direction, [0.0, -0.6, -0.8]);
    assert!(
        notes(text).iter().any(|(outcome, _, note)| *outcome == Outcome::Approximated && note.contains("Preetham"))
    );
}

#[test]
fn spots_and_projectors_throw_pictures() {
    let picture = |name: &str| {
        format!(r#"<texture type="bitmap" name="{name}"><string name="filename" value="a.png"/></texture>"#)
    };
    let place = r#"<transform name="to_world"><lookat origin="0,3,0" target="0,0,0" up="0,0,1"/></transform>"#;
    let spot = format!(r#"<emitter type="spot">{place}{}</emitter>"#, picture("texture"));
    let LightDesc::Spot(thrown) = light(&spot) else { panic!() };
    // Mitsuba's pictures of spots stand on their heads.
    assert_eq!(thrown.texture.as_deref(), Some("a"));
    assert_point(thrown.up.unwrap(), [0.0, 0.0, -1.0]);
    assert!(notes(&spot).is_empty());
    let grey =
        r#"<emitter type="spot"><rgb name="intensity" value="2 4 6"/><rgb name="texture" value="0.5"/></emitter>"#;
    let LightDesc::Spot(tinted) = light(grey) else { panic!() };
    assert_eq!((tinted.texture, tinted.intensity), (None, [1.0, 2.0, 3.0]));

    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(30, 20).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let read = |more: &str| {
        let text = format!(
            r#"<scene version="3.0.0">{SENSOR}<emitter type="projector">{place}{}{more}
            <float name="scale" value="3"/></emitter></scene>"#,
            picture("irradiance")
        );
        let imported = read_with(&text, &[], &[("a.png", png.get_ref())]).unwrap();
        assert!(imported.report.is_exact());
        match imported.desc.lights.into_iter().next() {
            Some(LightDesc::Projector(projector)) => projector,
            other => panic!("{other:?}"),
        }
    };
    let across = read(r#"<float name="fov" value="90"/>"#);
    assert_eq!(
        (across.texture.as_deref(), across.irradiance, across.aspect),
        (Some("a"), [3.0 * std::f32::consts::PI; 3], Some(1.5))
    );
    assert_point(across.position, [0.0, 3.0, 0.0]);
    assert_point(across.look_at, [0.0, 2.0, 0.0]);
    assert_point(across.up.unwrap(), [0.0, 0.0, 1.0]);
    assert_near((0.5 * across.vertical_fov_degrees.to_radians()).tan(), 1.0 / 1.5);
    let down = read(r#"<float name="fov" value="90"/><string name="fov_axis" value="y"/>"#);
    assert_near(down.vertical_fov_degrees, 90.0);
    let even = r#"<emitter type="projector"><rgb name="irradiance" value="1 2 3"/><float name="scale" value="2"/>
        <float name="fov" value="60"/></emitter>"#;
    let LightDesc::Projector(plain) = light(even) else { panic!() };
    assert_eq!((plain.texture, plain.irradiance), (None, [1.0, 2.0, 3.0].map(|c| c * (2.0 * std::f32::consts::PI))));
}

#[test]
fn what_is_unsupported_is_named_with_what_becomes_of_it() {
    let light = r#"<emitter type="timed_sunsky"><float name="end_year" value="3"/></emitter>"#;
    assert_eq!(
        notes(light),
        [(Outcome::Ignored, String::new(), "unsupported emitter: its light is left out".to_owned())]
    );
    let shape = r#"<shape type="sdfgrid"><string name="filename" value="a.vol"/><bsdf type="diffuse"/></shape>"#;
    assert_eq!(
        notes(shape),
        [(Outcome::Ignored, String::new(), "unsupported shape: it is left out of the picture".to_owned())]
    );
    for (kind, what) in [
        (r#"<bsdf type="measured_polarized"><string name="filename" value="a.pbsdf"/></bsdf>"#, "unsupported BSDF"),
        (r#"<bsdf type="diffuse"><texture type="volume" name="reflectance"/></bsdf>"#, "unsupported texture"),
        (r#"<emitter type="directionalarea"/>"#, "unsupported emitter of a shape"),
        (r#"<medium type="homogeneous" name="interior"/>"#, "participating media"),
    ] {
        let text = format!("<shape type=\"sphere\">{kind}</shape>");
        let report = try_scene(&text).unwrap().report;
        let lines = report.summary();
        assert!(lines.len() == 1 && lines[0].contains(what) && lines[0].contains("s.xml:2:"), "{lines:?}");
    }
}
