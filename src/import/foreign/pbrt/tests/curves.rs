//! Curves and hair.

use super::*;
use crate::desc::{CurveBasisDesc, CurveKindDesc, CurvesDesc, MaterialDesc};

/// The only shape, which is curves.
fn curves(imported: &Imported) -> &CurvesDesc {
    let ShapeDesc::Curves(curves) = shape(imported) else { panic!("no curves") };
    curves
}

fn strand(text: &str) -> Vec<[f64; 4]> {
    let imported = world(text);
    let [strand] = curves(&imported).strands.as_deref().unwrap() else { panic!("not one strand") };
    strand.clone()
}

fn assert_strand(found: &[[f64; 4]], expected: &[[f64; 4]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let all = found.as_flattened().iter().zip(expected.as_flattened());
    assert!(all.clone().all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
}

#[test]
fn curves_of_each_basis_and_degree_become_cubic_bezier_curves() {
    let cubic =
        strand("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 3 0] \"float width0\" 0.4 \"float width1\" 0.1");
    assert_strand(&cubic, &[[0., 0., 0., 0.2], [1., 0., 0., 0.15], [2., 0., 0., 0.1], [3., 3., 0., 0.05]]);
    // Raised in degree, a quadratic curve has its inner points two thirds of the way to its own.
    let quadratic = strand("Shape \"curve\" \"integer degree\" 2 \"point3 P\" [0 0 0 3 3 0 6 0 0] \"float width\" 2");
    assert_strand(&quadratic, &[[0., 0., 0., 1.], [2., 2., 0., 1.], [4., 2., 0., 1.], [6., 0., 0., 1.]]);
    let spline = "Shape \"curve\" \"string basis\" \"bspline\" \"point3 P\" [0 0 0 6 0 0 12 0 0 18 0 0 24 0 0]";
    assert_strand(
        &strand(spline),
        &[[6., 0., 0., 0.5], [8., 0., 0., 0.5], [10., 0., 0., 0.5], [12., 0., 0., 0.5]]
            .into_iter()
            .chain([[14., 0., 0., 0.5], [16., 0., 0., 0.5], [18., 0., 0., 0.5]])
            .collect::<Vec<_>>(),
    );
    let low = "Shape \"curve\" \"string basis\" \"bspline\" \"integer degree\" 2 \"point3 P\" [0 0 0 6 0 0 12 0 0]";
    assert_strand(&strand(low), &[[3., 0., 0., 0.5], [5., 0., 0., 0.5], [7., 0., 0., 0.5], [9., 0., 0., 0.5]]);
}

#[test]
fn curves_of_one_look_are_one_shape() {
    let hair = "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"string type\" \"cylinder\"\n";
    let imported = world(&hair.repeat(3));
    let joined = curves(&imported);
    assert_eq!(
        (joined.strands.as_ref().unwrap().len(), joined.kind, joined.basis),
        (3, CurveKindDesc::Cylinder, CurveBasisDesc::Bezier)
    );
    let flat = hair.replace("cylinder", "flat");
    let moved = format!("Translate 1 0 0\n{hair}");
    let imported = world(&format!("{hair}{flat}Material \"hair\"\n{flat}{moved}"));
    assert_eq!(imported.desc.shapes.len(), 4);
    let ribbon = world(&hair.replace("cylinder", "ribbon"));
    assert_eq!(outcome(&ribbon, "Shape", "type"), Outcome::Approximated);
    let object = world(&format!("ObjectBegin \"o\"\n{hair}{hair}ObjectEnd\nObjectInstance \"o\""));
    assert_eq!(object.desc.objects["o"].shapes.len(), 1);
}

#[test]
fn what_makes_no_curve_is_an_error() {
    for (parameters, what) in [
        ("", "needs control points"),
        ("\"point3 P\" [0 0 0 1 0 0 2 0 0]", "3 control points"),
        ("\"integer degree\" 4 \"point3 P\" [0 0 0 1 0 0 2 0 0]", "degree"),
        ("\"string basis\" \"hermite\" \"point3 P\" [0 0 0 1 0 0]", "hermite"),
        ("\"string basis\" \"bspline\" \"point3 P\" [0 0 0 1 0 0]", "too few"),
        ("\"string type\" \"round\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]", "round"),
    ] {
        let error = read_with(&format!("WorldBegin\nShape \"curve\" {parameters}"), &[]).unwrap_err().to_string();
        assert!(error.contains(what), "{parameters}: {error}");
    }
}

#[test]
fn hair_has_its_pigments_its_colour_or_its_absorption() {
    let hair = |parameters: &str| {
        let imported = world(&format!("Material \"hair\" {parameters}\nShape \"sphere\""));
        let material = imported.desc.materials.values().find_map(|material| match material {
            MaterialDesc::Hair(hair) => Some((**hair).clone()),
            _ => None,
        });
        material.unwrap()
    };
    let pigments = hair("\"float eumelanin\" 2 \"float pheomelanin\" 0.5 \"float beta_m\" 0.2 \"float beta_n\" 0.4");
    assert_eq!((pigments.eumelanin, pigments.pheomelanin), (Some(2.0), Some(0.5)));
    assert_eq!((pigments.longitudinal_roughness.0, pigments.azimuthal_roughness.0), (0.2, 0.4));
    assert_eq!((pigments.ior.0, pigments.scale_tilt_degrees.0), (1.55, 2.0));
    let absorbing = hair("\"rgb sigma_a\" [1 2 3] \"float alpha\" 3 \"float eta\" 1.4");
    assert!(close(absorbing.sigma_a.unwrap(), [1.0, 2.0, 3.0]));
    assert_eq!((absorbing.ior.0, absorbing.scale_tilt_degrees.0), (1.4, 3.0));
    assert!(hair("\"rgb reflectance\" [0.5 0.2 0.1]").color.is_some());
    assert!(hair("").eumelanin.is_none());
}
