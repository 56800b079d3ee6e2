//! Participating media.

use super::*;
use crate::desc::{MaterialDesc, PhaseDesc};

const SMOKE: &str = r#"MakeNamedMedium "smoke" "string type" "homogeneous" "rgb sigma_a" [1 2 3]
    "rgb sigma_s" [4 5 6] "float scale" 0.5 "float g" 0.25
"#;

#[test]
fn an_interface_between_media_is_invisible() {
    let found = world(&format!("{SMOKE}Material \"interface\"\nMediumInterface \"smoke\" \"\"\nShape \"sphere\""));
    let medium = &found.desc.media["smoke"];
    assert_eq!(medium.absorption.to_array(), [0.5, 1.0, 1.5]);
    assert_eq!(medium.scattering.to_array(), [2.0, 2.5, 3.0]);
    assert_eq!(medium.phase, PhaseDesc::HenyeyGreenstein { g: 0.25 });
    let name = shape(&found).common().material.unwrap();
    let MaterialDesc::Dielectric(glass) = &found.desc.materials[name] else { panic!("{found:?}") };
    assert_eq!(glass.medium.as_deref(), Some("smoke"));
    assert_eq!(found.desc.medium, None);
}

#[test]
fn the_medium_of_the_camera_is_around_everything() {
    let text = format!("{SMOKE}MediumInterface \"\" \"smoke\"\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"");
    assert_eq!(read(&text).desc.medium.as_deref(), Some("smoke"));
    // Path tracing without volumes shows none.
    assert_eq!(read(&format!("Integrator \"path\"\n{text}")).desc.medium, None);
}

#[test]
fn grids_and_unknown_media_are_left_out_and_said() {
    let grid = "MakeNamedMedium \"cloud\" \"string type\" \"uniformgrid\"\n";
    let found = world(&format!("{grid}MediumInterface \"cloud\" \"fog\"\nMaterial \"dielectric\"\nShape \"sphere\""));
    assert_eq!(outcome(&found, "MakeNamedMedium", ""), Outcome::Ignored);
    assert_eq!(outcome(&found, "Shape", "MediumInterface"), Outcome::Ignored);
    assert!(found.desc.media.is_empty() && found.desc.medium.is_none());
}
