//! A camera and a light for files that have none.

use super::meshes::Placed;
use crate::assets::RgbImage;
use crate::desc::{CameraDesc, DirectionalLightDesc, EnvironmentLightDesc, LightDesc};
use crate::import::Draft;
use crate::math::DVec3;

/// Full vertical angle of view in degrees.
const FOV: f64 = 40.0;

/// Where the camera stands seen from the middle of the scene: in front (+Z), to the right and slightly above.
const BACKWARD: DVec3 = DVec3::new(0.55, 0.38, 0.75);

/// Sets a camera that sees all of the scene.
pub fn add_camera(placed: &Placed, draft: &mut Draft) {
    let how = "the file has no camera: one sees all of the scene from the front, the right and slightly above";
    draft.approximated("nodes", "file", "camera", how);
    let alone = [DVec3::NEG_ONE, DVec3::ONE];
    let corners = if placed.corners.is_empty() { &alone[..] } else { &placed.corners };
    let [min, max] =
        corners.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], p| [min.min(*p), max.max(*p)]);
    let middle = 0.5 * (min + max);
    let backward = BACKWARD.normalize();
    let right = DVec3::Y.cross(backward).normalize();
    let up = backward.cross(right);
    // The least distance from which each corner is within the angles of view.
    let film = &draft.desc.film;
    let tangent = (0.5 * FOV).to_radians().tan();
    let aspect = f64::from(film.width) / f64::from(film.height.max(1));
    let distance = corners.iter().map(|&p| {
        let p = p - middle;
        p.dot(backward) + (p.dot(up).abs() / tangent).max(p.dot(right).abs() / (tangent * aspect))
    });
    let size = (max - min).length();
    let distance = 1.05 * distance.fold(0.0, f64::max).max(1e-3 * size);
    let distance = if distance > 0.0 && distance.is_finite() { distance } else { 1.0 };
    let camera = CameraDesc {
        position: Some((middle + backward * distance).to_array()),
        look_at: Some(middle.to_array()),
        vertical_fov_degrees: Some(FOV),
        ..CameraDesc::default()
    };
    draft.set_camera("the file has no camera", camera);
}

/// Adds a sky and a sun from the upper left.
pub fn add_light(draft: &mut Draft) {
    draft.approximated(
        "nodes",
        "file",
        "lights",
        "the file has no light: a pale sky and a sun from the upper left light the scene",
    );
    let file = draft.keep_environment("sky", sky());
    let place = "the file has no light";
    let sky = EnvironmentLightDesc { radiance: None, file: Some(file), scale: 1.0, transform: None, group: None };
    draft.add_light(place, LightDesc::Environment(sky));
    draft.add_light(
        place,
        LightDesc::Directional(DirectionalLightDesc {
            direction: [0.45, -0.8, -0.5],
            irradiance: [1.5, 1.42, 1.3],
            angular_diameter_degrees: 1.0,
            group: None,
        }),
    );
}

/// White at the horizon, blue above, grey below.
fn sky() -> RgbImage {
    const ROWS: usize = 64;
    let color = |row: usize| {
        let height = (std::f32::consts::PI * (row as f32 + 0.5) / ROWS as f32).cos();
        let mix = |a: [f32; 3], b: [f32; 3], t: f32| std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t);
        let horizon = [0.85, 0.88, 0.92];
        if height > 0.0 {
            mix(horizon, [0.35, 0.5, 0.75], height.sqrt())
        } else {
            mix(horizon, [0.25, 0.24, 0.22], (-4.0 * height).min(1.0))
        }
    };
    RgbImage { width: 2 * ROWS, height: ROWS, pixels: (0..2 * ROWS * ROWS).map(|i| color(i / (2 * ROWS))).collect() }
}
