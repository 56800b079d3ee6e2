//! The camera.

use super::Files;
use crate::camera::{Camera, Lens};
use crate::desc::{CameraDesc, LensDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3, Transform};

/// The camera, placed by a rotation and a translation.
pub fn compile(files: &Files, desc: &CameraDesc) -> Result<Camera> {
    let fov = desc.vertical_fov_degrees;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(files.error("camera.vertical_fov_degrees", format!("must be above 0 and below 180, not {fov}")));
    }
    let map = placement(files, desc)?;
    let transform = Transform::new(map).ok_or_else(|| files.error("camera.transform", "the transform is singular"))?;
    let lens = desc.lens.as_ref().map(|lens| compile_lens(files, lens, &transform)).transpose()?;
    Ok(Camera::new(transform, fov.to_radians(), lens))
}

fn placement(files: &Files, desc: &CameraDesc) -> Result<DAffine3> {
    match (&desc.transform, desc.position, desc.look_at) {
        (None, Some(position), Some(look_at)) => files.look_at("camera", position, look_at, desc.up.unwrap_or([0.0, 1.0, 0.0])),
        (Some(transform), None, None) if desc.up.is_none() => {
            let map = files.affine("camera.transform", transform)?;
            rigid(&map).ok_or_else(|| files.error("camera.transform", "must be a rotation and translation (a uniform scale is ignored)"))
        }
        (None, None, None) => Err(files.error("camera", "give `position` and `look_at`, or `transform`")),
        (Some(_), ..) => Err(files.error("camera", "give either `transform`, or `position`, `look_at` and `up`")),
        (None, position, _) => {
            let missing = if position.is_none() { "position" } else { "look_at" };
            Err(files.error("camera", format!("`position` and `look_at` go together: there is no `{missing}`")))
        }
    }
}

/// The map without its uniform scale; `None` if it shears, mirrors or is singular.
fn rigid(map: &DAffine3) -> Option<DAffine3> {
    let transform = Transform::new(*map)?;
    let scale = transform.uniform_scale()?;
    (!transform.swaps_handedness()).then(|| DAffine3 {
        matrix3: DMat3::from_cols(map.matrix3.x_axis / scale, map.matrix3.y_axis / scale, map.matrix3.z_axis / scale),
        translation: map.translation,
    })
}

fn compile_lens(files: &Files, desc: &LensDesc, camera: &Transform) -> Result<Lens> {
    let radius = match (desc.radius, desc.f_number, desc.focal_length) {
        (Some(radius), None, None) => files.positive("camera.lens.radius", radius)?,
        (None, Some(f_number), Some(focal_length)) => {
            files.positive("camera.lens.focal_length", focal_length)? / (2.0 * files.positive("camera.lens.f_number", f_number)?)
        }
        _ => return Err(files.error("camera.lens", "give either `radius`, or `f_number` and `focal_length`")),
    };
    let focus_distance = match (desc.focus_distance, desc.focus_point) {
        (Some(distance), None) => files.positive("camera.lens.focus_distance", distance)?,
        (None, Some(point)) => {
            let point: DVec3 = files.vector("camera.lens.focus_point", point)?;
            let depth = -camera.inverse_point(point).z;
            if depth.is_nan() || depth <= 0.0 {
                return Err(files.error("camera.lens.focus_point", "the point lies behind the camera"));
            }
            depth
        }
        _ => return Err(files.error("camera.lens", "give either `focus_distance` or `focus_point`")),
    };
    Ok(Lens { radius, focus_distance })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(json: &str) -> Result<Camera> {
        compile(&Files { scene: "s.json".into() }, &serde_json::from_str(json).unwrap())
    }

    #[test]
    fn both_ways_of_placing_agree() {
        let a = camera(r#"{ "position": [1, 2, 3], "look_at": [4, 1, 0] }"#).unwrap();
        let b = camera(r#"{ "transform": [{ "look_at": { "from": [1, 2, 3], "to": [4, 1, 0] } }] }"#).unwrap();
        assert_eq!(a.position(), b.position());
        assert!((a.axis() - b.axis()).length() < 1e-7);
    }

    #[test]
    fn a_focus_point_gives_its_depth_and_an_f_number_the_radius() {
        let json =
            r#"{ "position": [0, 0, 5], "look_at": [0, 0, 0], "lens": { "f_number": 2, "focal_length": 0.05, "focus_point": [3, 1, 1] } }"#;
        let lens = *camera(json).unwrap().lens().unwrap();
        assert!((lens.focus_distance - 4.0).abs() < 1e-12 && (lens.radius - 0.0125).abs() < 1e-15);
    }

    #[test]
    fn contradictions_are_refused() {
        for bad in [
            r#"{ "position": [0, 0, 5] }"#,
            r#"{ "position": [0, 0, 5], "look_at": [0, 0, 5] }"#,
            r#"{ "position": [0, 5, 0], "look_at": [0, 0, 0] }"#,
            r#"{ "position": [0, 0, 5], "look_at": [0, 0, 0], "transform": [] }"#,
            r#"{ "transform": [{ "scale": [1, 2, 1] }] }"#,
            r#"{ "transform": [{ "scale": [-1, 1, 1] }] }"#,
            r#"{ "vertical_fov_degrees": 0 }"#,
            r#"{ "vertical_fov_degrees": 180 }"#,
            r#"{ "lens": { "radius": 0.1 } }"#,
            r#"{ "lens": { "radius": -0.1, "focus_distance": 1 } }"#,
            r#"{ "lens": { "radius": 0.1, "f_number": 2, "focus_distance": 1 } }"#,
            r#"{ "lens": { "radius": 0.1, "focus_point": [0, 0, 1] } }"#,
        ] {
            assert!(camera(bad).is_err(), "{bad}");
        }
    }
}
