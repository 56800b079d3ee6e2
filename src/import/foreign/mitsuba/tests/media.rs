//! Participating media.

use super::*;
use crate::desc::{CoefficientDesc, PhaseDesc};

const VOLPATH: &str = "<integrator type=\"volpath\"/>";

fn rgb(coefficient: CoefficientDesc) -> [f32; 3] {
    coefficient.to_array()
}

#[test]
fn a_medium_is_within_its_shape() {
    let desc = scene(&format!(
        r#"{VOLPATH}<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior">
        <rgb name="albedo" value="0.5, 0.8, 1"/><float name="sigma_t" value="2"/><float name="scale" value="3"/>
        <phase type="hg"><float name="g" value="0.4"/></phase></medium></shape>"#
    ));
    let MaterialDesc::Dielectric(glass) = material(&desc, 0) else { panic!("{:?}", material(&desc, 0)) };
    let medium = &desc.media[glass.medium.as_ref().unwrap()];
    assert_eq!(medium.phase, PhaseDesc::HenyeyGreenstein { g: 0.4 });
    for (found, expected) in rgb(medium.scattering).into_iter().zip([3.0f32, 4.8, 6.0]) {
        assert!((found - expected).abs() < 1e-5);
    }
    for (found, expected) in rgb(medium.absorption).into_iter().zip([3.0f32, 1.2, 0.0]) {
        assert!((found - expected).abs() < 1e-5);
    }
    assert!(glass.is_medium() && desc.medium.is_none() && desc.shapes[0].common().opacity.is_none());
}

#[test]
fn a_medium_outside_of_all_is_around_everything() {
    let fog = r#"<medium type="homogeneous" id="fog"><volume type="constvolume" name="albedo">
        <float name="value" value="0.9"/></volume><phase type="rayleigh"/></medium>"#;
    let milk = r#"<medium type="homogeneous" id="milk"/>"#;
    let ball = r#"<shape type="sphere"><bsdf type="dielectric"/><ref name="interior" id="milk"/>
        <ref name="exterior" id="fog"/></shape>"#;
    let desc = scene(&format!("{VOLPATH}{fog}{milk}{ball}"));
    assert_eq!(desc.medium.as_deref(), Some("fog"));
    assert_eq!(desc.media["fog"].phase, PhaseDesc::Rayleigh);
    assert_eq!(rgb(desc.media["fog"].scattering), [0.9; 3]);
    assert_eq!(rgb(desc.media["milk"].scattering), [0.75; 3]);
    // Within a box of fog, the box itself says where it is.
    let room = r#"<shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>"#;
    assert_eq!(scene(&format!("{VOLPATH}{fog}{milk}{ball}{room}")).medium, None);
}

#[test]
fn what_is_not_shown_is_said() {
    let text = r#"<shape type="sphere"><medium type="heterogeneous" name="interior"/></shape>"#;
    let notes = notes(&format!("{VOLPATH}{text}"));
    assert!(notes.iter().any(|(outcome, _, note)| *outcome == Outcome::Ignored && note.contains("homogeneous")));
    let opaque = r#"<shape type="sphere"><bsdf type="diffuse"/><medium type="homogeneous" name="interior"/></shape>"#;
    let notes = super::notes(&format!("{VOLPATH}{opaque}"));
    assert!(notes.iter().any(|(_, name, note)| name == "interior" && note.contains("opaque")), "{notes:?}");
}
