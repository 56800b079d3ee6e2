//! Curves and hair.

use super::*;
use crate::desc::{CurveBasisDesc, CurveKindDesc, HairDesc};

#[test]
fn curves_are_read_from_their_file() {
    for (kind, basis) in [("bsplinecurve", CurveBasisDesc::BSpline), ("linearcurve", CurveBasisDesc::Linear)] {
        let desc = scene(&format!(
            r#"<shape type="{kind}"><string name="filename" value="hair.txt"/><transform name="to_world">
<translate x="1"/></transform><bsdf type="hair"/></shape>"#
        ));
        let [ShapeDesc::Curves(curves)] = desc.shapes.as_slice() else { panic!("not one shape of curves") };
        assert_eq!((curves.file.as_deref(), curves.basis), (Some("hair.txt"), basis));
        assert_eq!((curves.kind, curves.transform.0.len()), (CurveKindDesc::Round, 1));
        assert!(matches!(desc.materials[curves.material.as_deref().unwrap()], MaterialDesc::Hair(_)));
    }
    assert!(message(r#"<shape type="bsplinecurve"/>"#).contains("filename"));
    let shining = r#"<shape type="linearcurve"><string name="filename" value="a.txt"/><emitter type="area"/></shape>"#;
    assert!(notes(shining).iter().any(|(outcome, ..)| *outcome == Outcome::Ignored));
}

fn hair(parameters: &str) -> HairDesc {
    let desc = scene(&format!(r#"<shape type="sphere"><bsdf type="hair">{parameters}</bsdf></shape>"#));
    let hair = desc.materials.values().find_map(|material| match material {
        MaterialDesc::Hair(hair) => Some((**hair).clone()),
        _ => None,
    });
    hair.unwrap()
}

#[test]
fn hair_has_mitsubas_defaults() {
    let default = hair("");
    assert_eq!((default.eumelanin, default.pheomelanin, default.sigma_a), (Some(1.3), Some(0.2), None));
    assert_eq!((default.longitudinal_roughness.0, default.azimuthal_roughness.0), (0.3, 0.3));
    assert!((default.ior.0 - 1.55 / 1.000_277).abs() < 1e-3 && default.scale_tilt_degrees.0 == 2.0);
    let given = hair(
        r#"<float name="longitudinal_roughness" value="0.1"/><float name="azimuthal_roughness" value="0.2"/>
<float name="scale_tilt" value="3"/><float name="int_ior" value="1.4"/><float name="ext_ior" value="1"/>
<rgb name="sigma_a" value="1,2,3"/>"#,
    );
    assert_eq!((given.sigma_a, given.eumelanin), (Some([1.0, 2.0, 3.0]), None));
    assert_eq!((given.longitudinal_roughness.0, given.azimuthal_roughness.0), (0.1, 0.2));
    assert_eq!((given.ior.0, given.scale_tilt_degrees.0), (1.4, 3.0));
}
