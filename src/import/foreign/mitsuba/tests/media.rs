//! Participating media.

use super::*;
use crate::assets::{VolumeData, vol_bytes};
use crate::desc::{CoefficientDesc, PhaseDesc, VolumeDesc};

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
    let text = r#"<shape type="sphere"><medium type="homogeneous" name="interior"><phase type="tabphase"/></medium>
        </shape>"#;
    let notes = notes(&format!("{VOLPATH}{text}"));
    assert!(notes.iter().any(|(outcome, _, note)| *outcome == Outcome::Ignored && note.contains("isotropic")));
    let opaque = r#"<shape type="sphere"><bsdf type="diffuse"/><medium type="homogeneous" name="interior"/></shape>"#;
    let notes = super::notes(&format!("{VOLPATH}{opaque}"));
    assert!(notes.iter().any(|(_, name, note)| name == "interior" && note.contains("opaque")), "{notes:?}");
}

#[test]
fn grids_and_mixed_phase_functions_are_read() {
    let bytes =
        |channels: u32| vol_bytes(&VolumeData::new([2, 1, 1], channels, vec![0.5; 2 * channels as usize]).unwrap());
    let (density, albedo) = (bytes(1), bytes(3));
    let grid = |name: &str, file: &str, more: &str| {
        format!(
            r#"<volume type="gridvolume" name="{name}"><string name="filename" value="{file}"/>
            <transform name="to_world"><translate x="3"/></transform>{more}</volume>"#
        )
    };
    let read = |medium: &str| {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"/>{VOLPATH}<shape type="sphere"><bsdf type="null"/>
            <medium type="heterogeneous" name="interior" id="smoke">{medium}</medium></shape></scene>"#
        );
        let files = [("density.vol", &density[..]), ("albedo.vol", &albedo[..]), ("bad.vol", &b"VOX"[..])];
        read_with(&text, &[], &files)
    };
    let phases = r#"<phase type="blendphase"><float name="weight" value="0.25"/><phase type="rayleigh"/>
        <phase type="hg"><float name="g" value="0.5"/></phase></phase><float name="scale" value="4"/>"#;
    let both = grid("sigma_t", "density.vol", "") + &grid("albedo", "albedo.vol", "") + phases;
    let medium = &read(&both).unwrap().desc.media["smoke"];
    assert_eq!(rgb(medium.scattering), [4.0; 3]);
    assert_eq!(rgb(medium.absorption), [0.0; 3]);
    let mix = vec![PhaseDesc::Rayleigh, PhaseDesc::HenyeyGreenstein { g: 0.5 }];
    assert_eq!(medium.phase, PhaseDesc::Mix { phases: mix, weights: vec![0.75, 0.25] });
    let volume = medium.volume.as_ref().unwrap();
    let file = |volume: &Option<VolumeDesc>| match volume {
        Some(VolumeDesc::Grid { file: Some(file), .. }) => file.clone(),
        _ => panic!("{volume:?}"),
    };
    assert_eq!((file(&volume.density), file(&volume.albedo)), ("density.vol".into(), "albedo.vol".into()));
    assert_eq!((volume.bounds, matrix(&volume.transform)[0][3]), (None, 3.0));
    // A constant volume is no grid; a sigma_t of colours is a factor on both.
    let constant = r#"<volume type="constvolume" name="albedo"><float name="value" value="0.5"/></volume>"#;
    let medium = &read(&(grid("sigma_t", "albedo.vol", "") + constant)).unwrap().desc.media["smoke"];
    let volume = medium.volume.as_ref().unwrap();
    assert_eq!((rgb(medium.scattering), rgb(medium.absorption)), ([0.5; 3], [0.5; 3]));
    assert_eq!((file(&volume.scattering), file(&volume.absorption)), ("albedo.vol".into(), "albedo.vol".into()));
    assert!(volume.density.is_none() && volume.albedo.is_none());
    assert!(read(constant).unwrap().desc.media["smoke"].volume.is_none());
    // A file that is not there is named when the scene is compiled, unless what needs it is left out.
    let mut missing = read(&grid("sigma_t", "gone.vol", "")).unwrap();
    assert_eq!(missing.leave_out_missing(std::path::Path::new("s.xml")), 1);
    assert!(missing.desc.media["smoke"].volume.is_none());
    // Faults have their place.
    assert!(read(&grid("sigma_t", "bad.vol", "")).err().unwrap().to_string().contains("no .vol file"));
    let one = r#"<phase type="blendphase"><float name="weight" value="0.25"/><phase type="rayleigh"/></phase>"#;
    assert!(read(one).err().unwrap().to_string().contains("two phase functions"));
    let loops =
        r#"<phase type="blendphase" id="p"><float name="weight" value="0.5"/><ref id="p"/><ref id="p"/></phase>"#;
    assert!(read(loops).err().unwrap().to_string().contains("refers to itself"));
}
