//! Cameras.

use super::params::Params;
use super::state::{Ctm, Times, World, is_similar, matrix, rotation_and_scale};
use crate::desc::{CameraDesc, CameraKindDesc, KeyframeDesc, LensDesc, TransformDesc};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::math::{DAffine3, DMat3, DVec3};

/// The `Camera` directive and the transform in force there.
#[derive(Clone, Debug)]
pub struct CameraDirective {
    /// Such as `perspective`.
    pub kind: String,
    /// Its parameters.
    pub params: Params,
    /// World to camera.
    pub camera_from_world: Ctm,
}

/// The part of the film that the camera's rays go through: from `min` to `max`, where the shorter side of the picture
/// goes from -1 to 1.
#[derive(Clone, Copy, Debug)]
struct Screen {
    min: [f64; 2],
    max: [f64; 2],
}

impl Screen {
    fn size(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }

    fn read(params: &Params, [width, height]: [u32; 2]) -> Result<Self> {
        let aspect = params.positive_or("frameaspectratio", f64::from(width) / f64::from(height))?;
        let half = if aspect > 1.0 { [aspect, 1.0] } else { [1.0, 1.0 / aspect] };
        let mut screen = Self { min: half.map(|x| -x), max: half };
        if let Some([x0, x1, y0, y1]) = params.array("screenwindow")? {
            screen = Self { min: [x0, y0], max: [x1, y1] };
        }
        if !(screen.size(0) > 0.0 && screen.size(1) > 0.0) {
            return Err(params.error("the screen window is empty or mirrored"));
        }
        Ok(screen)
    }

    /// Sets what does not depend on the kind of camera.
    fn frame(&self, camera: &mut CameraDesc, [width, height]: [u32; 2]) {
        let aspect = (self.size(0) / f64::from(width)) / (self.size(1) / f64::from(height));
        if (aspect - 1.0).abs() > 1e-6 {
            camera.pixel_aspect = Some(aspect);
        }
        let shift: [f64; 2] = std::array::from_fn(|i| 0.5 * (self.min[i] + self.max[i]) / self.size(i));
        if shift.iter().any(|x| x.abs() > 1e-9) {
            camera.shift = Some(shift);
        }
    }
}

/// When the shutter opens and closes.
pub fn shutter(params: Option<&Params>) -> Result<[f64; 2]> {
    let Some(params) = params else { return Ok([0.0, 1.0]) };
    let shutter = [params.number_or("shutteropen", 0.0)?, params.number_or("shutterclose", 1.0)?];
    if shutter[1] <= shutter[0] {
        return Err(params.error("the shutter closes before it has been open"));
    }
    Ok(shutter)
}

/// From camera space to that of pbrt's camera, x to the right, y up, z forward.
fn pbrt_from_camera(kind: &str) -> DMat3 {
    if kind == "spherical" {
        // Columns begin at pbrt's x axis and turn towards z; Steradian's begin at z and turn towards -x.
        DMat3::from_rotation_y(std::f64::consts::FRAC_PI_2)
    } else {
        // Steradian's camera looks backward along z.
        DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))
    }
}

/// Sets a perspective projection; `scale` is that of the camera's transformation.
fn set_perspective(camera: &mut CameraDesc, params: &Params, size: [u32; 2], scale: f64) -> Result<()> {
    let screen = Screen::read(params, size)?;
    let fov = params.number_or("fov", 90.0)?;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(params.error(format!("fov must be above 0 and below 180 degrees, not {fov}")));
    }
    let half_height = (0.5 * fov.to_radians()).tan() * 0.5 * screen.size(1);
    camera.vertical_fov_degrees = Some(2.0 * half_height.atan().to_degrees());
    screen.frame(camera, size);
    let radius = params.number_or("lensradius", 0.0)?;
    let focus = params.positive_or("focaldistance", 1e6)?;
    if radius > 0.0 {
        camera.lens = Some(LensDesc {
            radius: Some(radius * scale),
            f_number: None,
            focal_length: None,
            focus_distance: Some(focus * scale),
            focus_point: None,
            sensor_distance: None,
            sensor_height: None,
            blades: None,
        });
    }
    Ok(())
}

/// Sets the projection of a camera; `scale` is that of its transformation.
fn set_projection(
    draft: &mut Draft,
    camera: &mut CameraDesc,
    directive: &CameraDirective,
    size: [u32; 2],
    scale: f64,
) -> Result<()> {
    let params = &directive.params;
    match directive.kind.as_str() {
        "perspective" => set_perspective(camera, params, size, scale)?,
        "orthographic" => {
            let screen = Screen::read(params, size)?;
            camera.kind = CameraKindDesc::Orthographic;
            camera.view_height = Some(screen.size(1) * scale);
            screen.frame(camera, size);
            if params.number_or("lensradius", 0.0)? > 0.0 {
                params.ignore("lensradius", "orthographic cameras have no lens");
            }
            params.number("focaldistance")?;
        }
        "spherical" => {
            camera.kind = CameraKindDesc::Environment;
            if params.string("mapping")?.unwrap_or("equalarea") != "equirectangular" {
                let how = "an equirectangular picture in place of an equal-area one";
                draft.approximated(&params.place, &params.element, "mapping", how);
                params.approximate("mapping", how);
            }
        }
        "realistic" => {
            camera.vertical_fov_degrees = Some(40.0);
            draft.approximated(&params.place, &params.element, "", "lens systems become a pinhole of 40 degrees");
            for name in ["lensfile", "aperturediameter", "focusdistance", "aperture"] {
                params.ignore(name, "lens systems are not known");
            }
        }
        other => return Err(params.error(format!("unknown camera \"{other}\""))),
    }
    Ok(())
}

/// Sets the camera; the result is the map from its world to Steradian's.
pub fn set_camera(draft: &mut Draft, directive: &CameraDirective, size: [u32; 2], times: Times) -> Result<World> {
    let params = &directive.params;
    let Some(world_from_camera) = directive.camera_from_world.inverse() else {
        return Err(params.error("the camera's transform is singular"));
    };
    // What remains of a reflection is taken out of the whole world.
    let pbrt_from_camera = pbrt_from_camera(&directive.kind);
    let world =
        World { mirrored: world_from_camera.swaps_handedness() != (pbrt_from_camera.determinant() < 0.0), times };
    let maps = world_from_camera.0.map(|map| world.mirror() * map * DAffine3::from_mat3(pbrt_from_camera));

    let mut rigid = [DAffine3::IDENTITY; 2];
    let mut scale = 1.0;
    for (rigid, map) in rigid.iter_mut().zip(&maps).rev() {
        let Some((rotation, factor)) = rotation_and_scale(&map.matrix3) else {
            return Err(params.error("the camera's transform is singular"));
        };
        if rotation.determinant() < 0.0 {
            return Err(params.error("the camera is mirrored while it moves"));
        }
        if !is_similar(&map.matrix3) {
            draft.approximated(&params.place, &params.element, "transform", "without its shear and uneven scale");
        }
        *rigid = DAffine3 { matrix3: rotation, translation: map.translation };
        scale = factor;
    }

    let mut camera = CameraDesc { shutter: shutter(Some(params))?, ..CameraDesc::default() };
    if world_from_camera.is_moving() {
        let keyframe = |i: usize| KeyframeDesc { time: times.0[i], transform: matrix(&rigid[i]) };
        camera.transform = Some(TransformDesc::default());
        camera.motion = vec![keyframe(0), keyframe(1)];
    } else {
        camera.transform = Some(matrix(&rigid[0]));
    }
    set_projection(draft, &mut camera, directive, size, scale)?;
    params.report(draft);
    draft.set_camera(&params.place, camera);
    Ok(world)
}
