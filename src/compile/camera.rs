//! The camera.

use super::CompileContext;
use super::transforms::Shutter;
use crate::camera::{Blades, Camera, Framing, Lens, Projection, lens_equation};
use crate::desc::{BladesDesc, CameraDesc, CameraKindDesc, KeyframeDesc, LensDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3, Motion, RenderSpace, Transform};

const DEFAULT_FOV_DEGREES: f64 = 40.0;

/// Blades beyond this number cannot be distinguished from a disk.
const MAX_BLADES: u32 = 64;

/// The camera, placed by a rotation and a translation.
pub fn compile(files: &CompileContext, desc: &CameraDesc) -> Result<Camera> {
    refuse_foreign_keys(files, desc)?;
    let fov = desc.vertical_fov_degrees.unwrap_or(DEFAULT_FOV_DEGREES);
    if !(fov > 0.0 && fov < 180.0) {
        return Err(files.error("camera.vertical_fov_degrees", format!("must be above 0 and below 180, not {fov}")));
    }
    let map = placement(files, desc)?;
    let transform = Transform::new(map).ok_or_else(|| files.error("camera.transform", "the transform is singular"))?;
    let projection = match desc.kind {
        CameraKindDesc::Perspective => {
            let half_height = (0.5 * fov.to_radians()).tan();
            let lens = desc.lens.as_ref().map(|lens| compile_lens(files, lens, &transform, half_height)).transpose()?;
            Projection::Perspective { half_height, lens }
        }
        CameraKindDesc::Orthographic => {
            let height = desc
                .view_height
                .ok_or_else(|| files.error("camera", "an orthographic camera needs a `view_height`"))?;
            Projection::Orthographic { half_height: 0.5 * files.positive("camera.view_height", height)? }
        }
        CameraKindDesc::Environment => Projection::Environment,
    };
    if !(desc.near >= 0.0 && desc.near.is_finite()) {
        return Err(files.error("camera.near", format!("must be finite and not negative, not {}", desc.near)));
    }
    let motion = motion(files, &desc.motion, &map, shutter(files, desc)?)?;
    let camera = Camera::new(transform, projection)
        .with_framing(framing(files, desc)?)
        .with_near(desc.near)
        .with_shutter(desc.shutter);
    camera.with_motion(motion).ok_or_else(|| files.error("camera.motion", "the motion is singular"))
}

/// The camera in a render space.
pub fn place_in(files: &CompileContext, desc: &CameraDesc, camera: Camera, space: RenderSpace) -> Result<Camera> {
    let place = if desc.position.is_some() { "camera.position" } else { "camera.transform" };
    let position = camera.position();
    files.reachable(place, position, &space)?;
    camera
        .in_render_space(space)
        .ok_or_else(|| files.error(place, "the camera cannot be placed beside a scene of this size"))
}

/// When the shutter is open.
fn shutter(files: &CompileContext, desc: &CameraDesc) -> Result<Shutter> {
    let [open, close] = desc.shutter;
    if !(open.is_finite() && close.is_finite() && open <= close && (close - open).is_finite()) {
        return Err(files
            .error("camera.shutter", format!("must be finite and not close before it opens, not {:?}", desc.shutter)));
    }
    Ok(desc.shutter.into())
}

/// How the camera moves from where `map` puts it.
fn motion(files: &CompileContext, keyframes: &[KeyframeDesc], map: &DAffine3, shutter: Shutter) -> Result<Motion> {
    for (i, keyframe) in keyframes.iter().enumerate() {
        let path = format!("camera.motion[{i}].transform");
        let step = files.transform(&path, &keyframe.transform, &DAffine3::IDENTITY)?;
        if step.swaps_handedness() || !step.uniform_scale().is_some_and(|scale| (scale - 1.0).abs() < 1e-6) {
            return Err(files.error(&path, "must be a rotation and translation: a camera cannot be scaled"));
        }
    }
    files.motion("camera.motion", keyframes, map, shutter)
}

/// Keys that mean nothing to this type of camera.
fn refuse_foreign_keys(files: &CompileContext, desc: &CameraDesc) -> Result<()> {
    use CameraKindDesc::{Environment, Orthographic, Perspective};
    let keys: [(&str, bool, &[CameraKindDesc]); 5] = [
        ("vertical_fov_degrees", desc.vertical_fov_degrees.is_some(), &[Perspective]),
        ("lens", desc.lens.is_some(), &[Perspective]),
        ("view_height", desc.view_height.is_some(), &[Orthographic]),
        ("shift", desc.shift.is_some(), &[Perspective, Orthographic]),
        ("pixel_aspect", desc.pixel_aspect.is_some(), &[Perspective, Orthographic]),
    ];
    for (key, given, kinds) in keys {
        if given && !kinds.contains(&desc.kind) {
            let kind = match desc.kind {
                Perspective => "a perspective",
                Orthographic => "an orthographic",
                Environment => "an environment",
            };
            return Err(files.error(&format!("camera.{key}"), format!("means nothing to {kind} camera")));
        }
    }
    Ok(())
}

fn framing(files: &CompileContext, desc: &CameraDesc) -> Result<Framing> {
    let pixel_aspect = files.within("camera.pixel_aspect", desc.pixel_aspect.unwrap_or(1.0), 0.01, 100.0)?;
    let shift = desc.shift.unwrap_or_default();
    for share in shift {
        files.within("camera.shift", share, -10.0, 10.0)?;
    }
    Ok(Framing { pixel_aspect, shift })
}

fn placement(files: &CompileContext, desc: &CameraDesc) -> Result<DAffine3> {
    match (&desc.transform, desc.position, desc.look_at) {
        (None, Some(position), Some(look_at)) => {
            files.look_at("camera", position, look_at, desc.up.unwrap_or([0.0, 1.0, 0.0]))
        }
        (Some(transform), None, None) if desc.up.is_none() => {
            let map = files.affine("camera.transform", transform)?;
            rigid(&map).ok_or_else(|| {
                files.error("camera.transform", "must be a rotation and translation (a uniform scale is ignored)")
            })
        }
        (None, None, None) => Err(files.error("camera", "give `position` and `look_at`, or `transform`")),
        (Some(_), ..) => Err(files.error("camera", "give either `transform`, or `position`, `look_at` and `up`")),
        (None, position, _) => {
            let missing = if position.is_none() { "position" } else { "look_at" };
            Err(files.error("camera", format!("`position` and `look_at` go together: no `{missing}`")))
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

fn compile_lens(files: &CompileContext, desc: &LensDesc, camera: &Transform, half_height: f64) -> Result<Lens> {
    let positive =
        |key: &str, value: Option<f64>| value.map(|v| files.positive(&format!("camera.lens.{key}"), v)).transpose();
    let (radius, f_number) = (positive("radius", desc.radius)?, positive("f_number", desc.f_number)?);
    let focal_length = positive("focal_length", desc.focal_length)?;
    let focus = focus_distance(files, desc, camera)?;
    let sensor =
        match (positive("sensor_distance", desc.sensor_distance)?, positive("sensor_height", desc.sensor_height)?) {
            (Some(_), Some(_)) => {
                return Err(files.error("camera.lens", "give either `sensor_distance` or `sensor_height`"));
            }
            (None, Some(height)) => Some(height / (2.0 * half_height)),
            (distance, None) => distance,
        };

    // Any two of focal length, sensor distance and focus distance give the third.
    let (focal_length, focus_distance) = match (focal_length, sensor, focus) {
        (Some(_), Some(_), Some(_)) => {
            let message = "`focal_length`, the sensor and the focus are one too many: two of them give the third by \
                           the lens equation";
            return Err(files.error("camera.lens", message));
        }
        (Some(f), Some(a), None) => {
            let b = lens_equation(f, a).filter(|b| b.is_finite());
            let b = b.ok_or_else(|| {
                files.error(
                    "camera.lens",
                    format!("nothing is in focus: the sensor's distance {a} must be above the focal length {f}"),
                )
            })?;
            (Some(f), b)
        }
        (None, Some(a), Some(b)) => (Some(1.0 / (1.0 / a + 1.0 / b)), b),
        (f, None, Some(b)) => (f, b),
        (_, _, None) => {
            let message =
                "give `focus_distance` or `focus_point`, or `focal_length` with `sensor_distance` or `sensor_height`";
            return Err(files.error("camera.lens", message));
        }
    };
    let radius = match (radius, f_number, focal_length) {
        (Some(radius), None, _) => radius,
        (None, Some(n), Some(f)) => f / (2.0 * n),
        (None, Some(_), None) => {
            return Err(
                files.error("camera.lens", "`f_number` needs `focal_length`, or a sensor from which to find it")
            );
        }
        _ => return Err(files.error("camera.lens", "give either `radius` or `f_number`")),
    };
    let blades = desc.blades.map(|blades| compile_blades(files, &blades)).transpose()?;
    Ok(Lens { radius, focus_distance, blades })
}

fn compile_blades(files: &CompileContext, desc: &BladesDesc) -> Result<Blades> {
    if !(3..=MAX_BLADES).contains(&desc.count) {
        let message = format!("must be from 3 to {MAX_BLADES}, not {}", desc.count);
        return Err(files.error("camera.lens.blades.count", message));
    }
    if !desc.rotation_degrees.is_finite() {
        return Err(files.error("camera.lens.blades.rotation_degrees", "the angle is not finite"));
    }
    Ok(Blades { count: desc.count, rotation: desc.rotation_degrees.to_radians() })
}

/// The focus if it is given.
fn focus_distance(files: &CompileContext, desc: &LensDesc, camera: &Transform) -> Result<Option<f64>> {
    match (desc.focus_distance, desc.focus_point) {
        (None, None) => Ok(None),
        (Some(distance), None) => files.positive("camera.lens.focus_distance", distance).map(Some),
        (None, Some(point)) => {
            let point: DVec3 = files.vector("camera.lens.focus_point", point)?;
            let depth = -camera.inverse_point(point).z;
            if depth.is_nan() || depth <= 0.0 {
                return Err(files.error("camera.lens.focus_point", "the point lies behind the camera"));
            }
            Ok(Some(depth))
        }
        (Some(_), Some(_)) => Err(files.error("camera.lens", "give either `focus_distance` or `focus_point`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(json: &str) -> Result<Camera> {
        compile(&CompileContext::new("s.json"), &serde_json::from_str(json).unwrap())
    }

    fn lens(json: &str) -> Lens {
        *camera(&format!(
            r#"{{ "position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 90, "lens": {json} }}"#
        ))
        .unwrap()
        .lens()
        .unwrap()
    }

    #[test]
    fn both_ways_of_placing_agree() {
        let a = camera(r#"{ "position": [1, 2, 3], "look_at": [4, 1, 0] }"#).unwrap();
        let b = camera(r#"{ "transform": [{ "look_at": { "from": [1, 2, 3], "to": [4, 1, 0] } }] }"#).unwrap();
        assert_eq!(a.position(), b.position());
        assert!((a.axis() - b.axis()).length() < 1e-7 && (a.up() - b.up()).length() < 1e-7);
        assert!(matches!(a.projection(), Projection::Perspective { lens: None, .. }));
    }

    #[test]
    fn a_focus_point_gives_its_depth() {
        assert!((lens(r#"{ "radius": 1, "focus_point": [3, 1, 1] }"#).focus_distance - 4.0).abs() < 1e-12);
    }

    #[test]
    fn an_aperture_of_f_number_n_has_the_radius_f_over_2n() {
        // Not 2 f / N, which is four times as large.
        let given = lens(r#"{ "f_number": 2, "focal_length": 0.05, "focus_distance": 4 }"#);
        assert!((given.radius - 0.0125).abs() < 1e-15);
        // The focal length of the lens that the picture is taken with: 90 degrees on a sensor 0.1 high are 0.05 from
        // sensor to lens.
        let derived = lens(r#"{ "f_number": 2, "sensor_height": 0.1, "focus_distance": 4 }"#);
        let f = 1.0 / (1.0 / 0.05 + 1.0 / 4.0);
        assert!((derived.radius - f / 4.0).abs() < 1e-15 && derived.focus_distance == 4.0);
    }

    #[test]
    fn the_lens_equation_gives_the_focus() {
        for sensor in [r#""sensor_distance": 0.0505"#, r#""sensor_height": 0.101"#] {
            let lens = lens(&format!(r#"{{ "radius": 0.01, "focal_length": 0.05, {sensor} }}"#));
            assert!((1.0 / lens.focus_distance + 1.0 / 0.0505 - 1.0 / 0.05).abs() < 1e-9, "{lens:?}");
        }
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
