//! Changes of a compiled scene that leave everything else as it is.

use super::{CompileContext, camera};
use crate::assets::SceneSource;
use crate::desc::{SceneDesc, ShapeDesc};
use crate::error::Result;
use crate::scene::Scene;

/// Places the camera of `desc` in a scene that was compiled from the same description with another camera. The result
/// is whether that is all: `false` leaves the scene as it was, because shapes depend on the camera (planes reach beyond
/// it, motion is that while its shutter is open), and the scene is to be compiled again.
///
/// # Errors
/// [`Error::Scene`](crate::Error::Scene) with the key of the camera that makes no sense.
pub fn change_camera(scene: &mut Scene, desc: &SceneDesc, source: SceneSource) -> Result<bool> {
    let files = CompileContext::from(source);
    let camera = camera::compile(&files, &desc.camera)?;
    let has_planes = desc.shapes.iter().any(|shape| matches!(shape, ShapeDesc::Plane(_)));
    if has_planes || camera.shutter() != scene.camera.shutter() {
        return Ok(false);
    }
    let camera = camera::place_in(&files, &desc.camera, camera, *scene.camera.render_space())?;
    scene.features.lens = camera.lens().is_some();
    scene.features.motion = scene.geometry.is_moving() || camera.is_moving();
    scene.camera = camera;
    Ok(true)
}
