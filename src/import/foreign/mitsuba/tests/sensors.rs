//! Cameras, films, samplers, integrators.

use super::*;
use crate::desc::{CameraDesc, CameraKindDesc, FilterDesc, IntegratorDesc, PixelTypeDesc, SamplerKindDesc};
use crate::import::ReportEntry;

/// The scene of a sensor with these parameters and a film of 200 x 100.
#[track_caller]
fn sensor(kind: &str, inside: &str) -> Imported {
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="{kind}">{inside}<film type="hdrfilm"><integer name="width" value="200"/>
<integer name="height" value="100"/></film></sensor></scene>"#
    );
    read_with(&text, &[], &[]).unwrap()
}

#[track_caller]
fn camera(kind: &str, inside: &str) -> CameraDesc {
    sensor(kind, inside).desc.camera
}

#[test]
fn the_camera_looks_along_z_with_x_to_the_left() {
    let camera = camera("perspective", "");
    // Steradian's looks along -Z with +X to the right.
    let map = camera.transform.unwrap();
    assert_point(moved(&map, [0.0, 0.0, -1.0]), [0.0, 0.0, 1.0]);
    assert_point(moved(&map, [1.0, 0.0, 0.0]), [-1.0, 0.0, 0.0]);
    assert_point(moved(&map, [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
    assert_eq!(camera.near, 0.01);
}

#[test]
fn steps_of_transforms_act_in_their_order() {
    let inside = r#"<transform name="to_world"><rotate y="1" angle="90"/><translate x="5"/></transform>"#;
    let map = camera("perspective", inside).transform.unwrap();
    assert_point(moved(&map, [0.0; 3]), [5.0, 0.0, 0.0]);
    assert_point(moved(&map, [0.0, 0.0, -1.0]), [6.0, 0.0, 0.0]);
    let lookat = r#"<transform name="to_world"><lookat origin="1,2,3" target="1,2,0" up="0,1,0"/></transform>"#;
    let map = camera("perspective", lookat).transform.unwrap();
    assert_point(moved(&map, [0.0, 0.0, -3.0]), [1.0, 2.0, 0.0]);
    assert_point(moved(&map, [1.0, 0.0, 0.0]), [2.0, 2.0, 3.0]);
}

#[test]
fn every_axis_of_the_field_of_view() {
    let fov = |axis: &str| {
        let axis =
            if axis.is_empty() { String::new() } else { format!("<string name=\"fov_axis\" value=\"{axis}\"/>") };
        (0.5 * camera("perspective", &format!("<float name=\"fov\" value=\"60\"/>{axis}"))
            .vertical_fov_degrees
            .unwrap())
        .to_radians()
        .tan()
    };
    let half = 30f64.to_radians().tan();
    assert_near(fov(""), half / 2.0);
    assert_near(fov("x"), half / 2.0);
    assert_near(fov("larger"), half / 2.0);
    assert_near(fov("y"), half);
    assert_near(fov("smaller"), half);
    assert_near(fov("diagonal"), half / 5f64.sqrt());
    // 50 mm on a film of 36 x 24 mm, by the diagonal.
    let default = camera("perspective", "").vertical_fov_degrees.unwrap();
    assert_near((0.5 * default.to_radians()).tan(), 0.5 * 36f64.hypot(24.0) / 50.0 / 5f64.sqrt());
    let text = "<sensor type=\"perspective\"><float name=\"fov\" value=\"200\"/></sensor>";
    assert!(read_with(&format!("<scene version=\"3.0.0\">{text}</scene>"), &[], &[]).is_err());
}

#[test]
fn a_scale_of_the_camera_is_dropped_or_is_its_size() {
    let scaled = r#"<transform name="to_world"><scale value="3"/></transform>"#;
    let imported = sensor("perspective", scaled);
    assert_point(moved(imported.desc.camera.transform.as_ref().unwrap(), [0.0, 0.0, -1.0]), [0.0, 0.0, 1.0]);
    assert!(!imported.report.is_exact());
    let camera = camera("orthographic", scaled);
    assert_eq!(camera.kind, CameraKindDesc::Orthographic);
    // 2 wide and 1 high, times 3.
    assert_near(camera.view_height.unwrap(), 3.0);
    assert!(camera.vertical_fov_degrees.is_none());
}

#[test]
fn thin_lenses_and_shifts() {
    let lens =
        camera("thinlens", r#"<float name="aperture_radius" value="0.5"/><float name="focus_distance" value="7"/>"#)
            .lens
            .unwrap();
    assert_eq!((lens.radius, lens.focus_distance), (Some(0.5), Some(7.0)));
    let shift = camera(
        "perspective",
        r#"<float name="principal_point_offset_x" value="0.1"/><float name="principal_point_offset_y" value="0.2"/>"#,
    );
    assert_eq!(shift.shift, Some([0.1, -0.2]));
}

#[test]
fn films_and_filters() {
    let film = |inside: &str| {
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\">\
             <film type=\"hdrfilm\">{inside}</film></sensor></scene>"
        );
        read_with(&text, &[], &[]).unwrap().desc
    };
    let desc = film("");
    assert_eq!((desc.film.width, desc.film.height, desc.film.crop), (768, 576, None));
    assert_eq!(desc.film.filter, FilterDesc::Gaussian { radius: 2.0, sigma: 0.5, samples: None });
    let crop = r#"<integer name="crop_offset_x" value="3"/><integer name="crop_offset_y" value="4"/>
        <integer name="crop_width" value="5"/>
        <integer name="crop_height" value="6"/><string name="component_format" value="float32"/>
        <rfilter type="catmullrom"/>"#;
    let desc = film(crop);
    assert_eq!(desc.film.crop, Some([3, 4, 5, 6]));
    assert_eq!(desc.film.filter, FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 0.5, samples: None });
    assert_eq!(desc.outputs[0].pixel_type, PixelTypeDesc::Float);
    assert_eq!(film("<rfilter type=\"box\"/>").film.filter, FilterDesc::Box { radius: 0.5, samples: None });
    assert_eq!(film("<rfilter type=\"tent\"/>").film.filter, FilterDesc::Tent { radius: 1.0, samples: None });
    let mitchell = r#"<rfilter type="mitchell"><float name="B" value="0.25"/><float name="C" value="0.5"/></rfilter>"#;
    assert_eq!(film(mitchell).film.filter, FilterDesc::Mitchell { radius: 2.0, b: 0.25, c: 0.5, samples: None });
}

#[test]
fn samplers_and_integrators() {
    let with = r#"<sampler type="multijitter"><integer name="sample_count" value="9"/>
        <integer name="seed" value="3"/></sampler>"#;
    let sampler = sensor("perspective", with).desc.sampler;
    assert_eq!((sampler.spp, sampler.seed, sampler.kind), (9, 3, SamplerKindDesc::Sobol));
    let independent = sensor("perspective", r#"<sampler type="independent"/>"#);
    assert_eq!((independent.desc.sampler.kind, independent.report.is_exact()), (SamplerKindDesc::Sobol, true));
    let is_noted =
        |entry: &ReportEntry| entry.element == "sampler independent" && entry.note.contains("--sampler independent");
    assert!(independent.report.entries.iter().any(is_noted));
    let integrator = |text: &str| match scene(text).integrator {
        IntegratorDesc::Path { max_depth, rr_depth, .. } => (max_depth, rr_depth),
        other => panic!("{other:?}"),
    };
    assert_eq!(integrator(""), (65_536, None));
    assert_eq!(integrator(r#"<integrator type="path"><integer name="max_depth" value="-1"/></integrator>"#).0, 65_536);
    let inner = r#"<integrator type="moment"><integrator type="path"><integer name="max_depth" value="7"/>
        <integer name="rr_depth" value="9"/></integrator></integrator>"#;
    assert_eq!(integrator(inner), (7, Some(9)));
    assert_eq!(integrator(&inner.replace('9', "5")), (7, None));
    assert_eq!(integrator(r#"<integrator type="direct"/>"#).0, 2);
    let hidden = r#"<integrator type="KIND"><boolean name="hide_emitters" value="true"/></integrator>"#;
    assert!(notes(&hidden.replace("KIND", "path")).is_empty());
    assert!(matches!(
        scene(&hidden.replace("KIND", "direct")).integrator,
        IntegratorDesc::Path { hide_emitters: true, .. }
    ));
    let depth = notes(&hidden.replace("KIND", "depth"));
    assert!(
        depth.iter().any(|(outcome, name, _)| *outcome == Outcome::Ignored && name == "hide_emitters"),
        "{depth:?}"
    );
    assert!(notes(r#"<integrator type="path"><boolean name="hide_emitters" value="false"/></integrator>"#).is_empty());
}
