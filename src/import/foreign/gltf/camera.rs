//! The first camera of the scene.

use gltf::json::camera::{Camera, Type};
use gltf::json::validation::Checked;

use super::GltfSource;
use super::meshes::transform;
use super::nodes::{Pose, Tree, label};
use crate::desc::{CameraDesc, CameraKindDesc};
use crate::error::Result;
use crate::import::Draft;
use crate::math::{DAffine3, DMat3, DVec3};

/// Width of the picture in pixels, and its height where the file gives no aspect ratio.
const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

/// Sets camera and film from the first camera among the scene's nodes; whether there is one.
pub fn add(source: GltfSource, tree: &Tree, pose: &Pose, draft: &mut Draft) -> Result<bool> {
    (draft.desc.film.width, draft.desc.film.height) = (WIDTH, HEIGHT);
    let mut found = false;
    for &i in &tree.shown {
        let Some((node, index)) = source.root.nodes.get(i).and_then(|node| Some((node, node.camera?))) else {
            continue;
        };
        let path = format!("nodes[{i}]");
        if found {
            draft.ignored(&path, &label(node, i), "camera", "the first camera of the scene is used");
            continue;
        }
        found = true;
        let place = format!("cameras[{}]", index.value());
        let camera = source.root.get(index).ok_or_else(|| source.fault(&path, "no such camera"))?;
        let mut desc = lens(source, &place, camera, draft)?;
        let upright = upright(&pose.world[i]).ok_or_else(|| source.fault(&path, "the camera is scaled to nothing"))?;
        desc.transform = Some(transform(&upright));
        draft.mapped(&path, &label(node, i), "camera");
        draft.set_camera(&path, desc);
    }
    Ok(found)
}

/// What a camera sees, and the shape of the picture.
fn lens(source: GltfSource, place: &str, camera: &Camera, draft: &mut Draft) -> Result<CameraDesc> {
    let within = |name: &str, value: f32, most: f64| {
        let value = f64::from(value);
        let is_sound = value > 0.0 && value < most;
        if is_sound { Ok(value) } else { Err(source.fault(&format!("{place}.{name}"), format!("cannot be {value}"))) }
    };
    let mut desc = CameraDesc::default();
    let (near, aspect) = match (camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(Type::Orthographic), _, Some(lens)) => {
            // A mirrored picture has no camera here; the sign of a magnitude is dropped.
            let [x, y] = [
                within("orthographic.xmag", lens.xmag.abs(), f64::MAX)?,
                within("orthographic.ymag", lens.ymag.abs(), f64::MAX)?,
            ];
            desc.kind = CameraKindDesc::Orthographic;
            desc.view_height = Some(2.0 * y);
            draft.mapped(place, "camera", "orthographic");
            (lens.znear, Some(x / y))
        }
        (_, Some(lens), _) => {
            desc.vertical_fov_degrees = Some(within("perspective.yfov", lens.yfov, std::f64::consts::PI)?.to_degrees());
            draft.mapped(place, "camera", "perspective");
            (
                lens.znear,
                lens.aspect_ratio.map(|aspect| within("perspective.aspectRatio", aspect, f64::MAX)).transpose()?,
            )
        }
        _ => return Err(source.fault(place, "has no lens of its type")),
    };
    if !(near >= 0.0 && near.is_finite()) {
        return Err(source.fault(&format!("{place}.znear"), format!("cannot be {near}")));
    }
    desc.near = f64::from(near);
    if camera.orthographic.is_some() || camera.perspective.as_ref().is_some_and(|lens| lens.zfar.is_some()) {
        draft.ignored(place, "camera", "zfar", "what is far away is seen");
    }
    if let Some(aspect) = aspect {
        let height = (f64::from(WIDTH) / aspect).round().clamp(1.0, 16.0 * f64::from(WIDTH));
        draft.desc.film.height = height as u32;
    }
    Ok(desc)
}

/// A camera's place and directions without scale and shear.
fn upright(world: &DAffine3) -> Option<DAffine3> {
    let z = world.matrix3.z_axis.try_normalize()?;
    let x = world.matrix3.y_axis.cross(z).try_normalize()?;
    Some(DAffine3 { matrix3: DMat3::from_cols(x, DVec3::cross(z, x), z), translation: world.translation })
}
