//! Participating media.

use super::*;
use crate::desc::{BorderDesc, MaterialDesc, PhaseDesc, VolumeDesc};
use crate::spectrum::Spectrum;

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
fn presets_are_measured_media() {
    let found = world(
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Marble\" \"float scale\" 10\n\
         Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\"",
    );
    let medium = &found.desc.media["m"];
    assert!(close(medium.absorption.to_array(), [0.021, 0.041, 0.071]));
    assert!(close(medium.scattering.to_array(), [21.9, 26.2, 30.0]));
}

#[test]
fn the_medium_of_the_camera_is_around_everything() {
    let text = format!("{SMOKE}MediumInterface \"\" \"smoke\"\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"");
    assert_eq!(read(&text).desc.medium.as_deref(), Some("smoke"));
    // Path tracing without volumes shows none.
    assert_eq!(read(&format!("Integrator \"path\"\n{text}")).desc.medium, None);
}

#[test]
fn unknown_media_are_left_out_and_said() {
    let grid = "MakeNamedMedium \"cloud\" \"string type\" \"cloud\"\n";
    let found = world(&format!("{grid}MediumInterface \"cloud\" \"fog\"\nMaterial \"dielectric\"\nShape \"sphere\""));
    assert_eq!(outcome(&found, "MakeNamedMedium", ""), Outcome::Ignored);
    assert!(found.report.entries.iter().any(|entry| entry.note.contains("rgbgrid and nanovdb")));
    assert_eq!(outcome(&found, "Shape", "MediumInterface"), Outcome::Ignored);
    assert!(found.desc.media.is_empty() && found.desc.medium.is_none());
}

fn file(volume: &Option<VolumeDesc>) -> &str {
    match volume {
        Some(VolumeDesc::Grid { file: Some(file), border: BorderDesc::Zero, .. }) => file,
        _ => panic!("{volume:?}"),
    }
}

#[test]
fn grids_become_volumes() {
    let grid = |more: &str| {
        let text = format!(
            "Translate 5 0 0\nMakeNamedMedium \"fire\" \"string type\" {more} \"integer nx\" 2 \"integer ny\" 1 \
             \"integer nz\" 1 \"point3 p0\" [-1 -2 -3] \"point3 p1\" [1 2 3] \"float scale\" 2\n"
        );
        world(&format!("{text}MediumInterface \"fire\" \"\"\nMaterial \"interface\"\nShape \"sphere\""))
    };
    let found =
        grid(r#""uniformgrid" "rgb sigma_a" [1 2 3] "float density" [0.5 7] "rgb Le" [1 1 2] "float Lescale" [3 4]"#);
    let medium = &found.desc.media["fire"];
    assert_eq!((medium.absorption.to_array(), medium.scattering.to_array()), ([2.0, 4.0, 6.0], [2.0; 3]));
    assert_eq!(medium.emission.to_array(), [2.0, 4.0, 12.0]);
    let volume = medium.volume.as_ref().unwrap();
    assert_eq!(volume.bounds, Some([[-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]]));
    assert!(!volume.transform.is_empty());
    assert_eq!(found.assets.volumes[file(&volume.density)].values, [0.5, 7.0]);
    assert_eq!(found.assets.volumes[file(&volume.emission)].values, [3.0, 4.0]);
    // Of 2,000 K (and 50 K, which is dark): half of Planck's law over its largest value.
    let found = grid(
        r#""uniformgrid" "float density" [1 1] "float temperature" [1050 75] "float temperatureoffset" 50
            "float temperaturescale" 2 "float Lescale" 0.5"#,
    );
    let medium = &found.desc.media["fire"];
    assert_eq!(medium.emission.to_array(), [2.0; 3]);
    let glow = &found.assets.volumes[file(&medium.volume.as_ref().unwrap().emission)];
    let planck = Spectrum::Blackbody(2000.0).emission();
    assert_eq!((glow.channels, &glow.values[3..]), (3, &[0.0; 3][..]));
    assert!(glow.values.iter().zip(planck).all(|(found, c)| (found - 0.5 * c).abs() < 1e-6 && c > 0.0), "{glow:?}");
    let found = grid(r#""rgbgrid" "rgb sigma_s" [1 2 3 4 5 6]"#);
    let volume = found.desc.media["fire"].volume.as_ref().unwrap();
    let scattering = &found.assets.volumes[file(&volume.scattering)];
    assert_eq!((scattering.channels, &scattering.values[..]), (3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0][..]));
    assert!(volume.absorption.is_none() && volume.density.is_none());
}

#[test]
fn malformed_grids_are_refused() {
    for (grid, expected) in [
        (r#""uniformgrid" "integer nx" 2 "float density" [1]"#, "2 values"),
        (r#""uniformgrid" "integer nx" -2 "float density" [1]"#, "above 0"),
        (r#""uniformgrid" "integer nx" 100000 "float density" [1]"#, "16384"),
        (r#""uniformgrid" "integer nx" 1"#, "density"),
        (r#""uniformgrid" "float density" 1 "float temperature" 9 "float Lescale" [1 2]"#, "as many as"),
        (r#""rgbgrid" "integer nx" 1"#, "sigma_a"),
        (r#""rgbgrid" "rgb sigma_a" [1 2]"#, "left over"),
    ] {
        let text = format!("WorldBegin\nMakeNamedMedium \"m\" \"string type\" {grid}\n");
        let error = read_with(&text, &[]).err().unwrap().to_string();
        assert!(error.contains(expected), "{grid}: {error}");
    }
}
