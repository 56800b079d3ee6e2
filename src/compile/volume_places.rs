//! Where volumes are: in a box that the scene gives, or where their files place them.

use super::CompileContext;
use super::volumes::Part;
use crate::assets::{GridChoice, VdbGrid, VolumeData, read_vdb};
use crate::desc::{MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::medium::Border;

/// How far, in voxels, axes of grids may lead apart that count as the same.
const MAX_TURN: f64 = 1e-3;

/// The box of a volume.
pub(super) struct Placement {
    /// The map of the unit cube to the box.
    pub world_from_unit: DAffine3,
    /// From the world of files that place their voxels, if there are any.
    unit_from_files: Option<DAffine3>,
}

impl Placement {
    /// The box that the scene gives, or the smallest around what files place, or the unit cube.
    pub fn new<'a>(
        files: &CompileContext,
        path: &str,
        desc: &MediumVolumeDesc,
        parts: impl Iterator<Item = &'a Part>,
    ) -> Result<Self> {
        let files_from_unit = placed_box(files, parts)?;
        let bounds = format!("{path}.bounds");
        let into_box = match (desc.bounds, files_from_unit) {
            (Some([a, b]), _) => {
                let [a, b] = [files.position(&bounds, a)?, files.position(&bounds, b)?];
                DAffine3 { matrix3: DMat3::from_diagonal((b - a).abs()), translation: a.min(b) }
            }
            (None, Some(map)) => map,
            (None, None) => DAffine3::IDENTITY,
        };
        let map = files.affine(&format!("{path}.transform"), &desc.transform)? * into_box;
        let determinant = map.matrix3.determinant().abs();
        let is_sound = determinant > 0.0 && determinant.is_finite() && map.inverse().is_finite();
        if !is_sound || map.transform_vector3(DVec3::ONE).length() as f32 == 0.0 {
            return Err(files.error(&bounds, "the box is flat, or its transform flattens it or is not finite"));
        }
        Ok(Self { world_from_unit: map, unit_from_files: files_from_unit.map(|map| map.inverse()) })
    }

    /// The two corners of the voxels in the unit cube, if their file places them.
    pub fn within_unit(&self, part: &Part) -> Option<[DVec3; 2]> {
        let map = self.unit_from_files? * part.world_from_voxels?;
        let [low, high] = [map.translation, map.transform_point3(size(&part.data))];
        Some([low.max(DVec3::ZERO), high.min(DVec3::ONE)])
    }
}

fn size(data: &VolumeData) -> DVec3 {
    DVec3::from(data.resolution.map(f64::from))
}

/// The world of files by the unit cube, which becomes the smallest box, along the axes of voxels, around all that files
/// place.
fn placed_box<'a>(files: &CompileContext, parts: impl Iterator<Item = &'a Part>) -> Result<Option<DAffine3>> {
    let mut first: Option<(&Part, DAffine3)> = None;
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for part in parts {
        let Some(world_from_voxels) = part.world_from_voxels else { continue };
        let (leader, world_from_box) = *first.get_or_insert((part, world_from_voxels));
        let map = world_from_box.inverse() * world_from_voxels;
        let diagonal = DVec3::new(map.matrix3.x_axis.x, map.matrix3.y_axis.y, map.matrix3.z_axis.z);
        let turned = (map.matrix3 - DMat3::from_diagonal(diagonal)) * DMat3::from_diagonal(size(&part.data));
        let furthest = turned.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if !(furthest <= MAX_TURN && diagonal.min_element() > 0.0) {
            let message = format!("the grid has other axes than that of {}: use media of their own", leader.path);
            return Err(files.error(&part.path, message));
        }
        (min, max) = (min.min(map.translation), max.max(map.translation + diagonal * size(&part.data)));
    }
    let Some((leader, world_from_box)) = first else { return Ok(None) };
    let map = world_from_box * DAffine3 { matrix3: DMat3::from_diagonal(max - min), translation: min };
    for corner in [DVec3::ZERO, DVec3::ONE] {
        files.position(&leader.path, map.transform_point3(corner).to_array())?;
    }
    Ok(Some(map))
}

impl Part {
    /// A grid of a file of OpenVDB or NanoVDB, whose values below 0 become 0.
    pub fn read_vdb(
        files: &CompileContext,
        path: String,
        desc: &VolumeDesc,
        name: &str,
        choice: GridChoice,
    ) -> Result<Self> {
        if let VolumeDesc::Grid { resolution: Some(_), .. } | VolumeDesc::Grid { channels: Some(_), .. } = desc {
            return Err(files.error(&path, "`resolution` and `channels` are those of the file: leave them out"));
        }
        let asset = files.source.asset(name);
        let VdbGrid { voxels: mut data, world_from_voxels, .. } =
            read_vdb(&asset, choice).map_err(|e| files.asset_error(&format!("{path}.file"), &asset, e))?;
        // Simulations overshoot.
        let (mut count, mut least) = (0, 0.0f32);
        for value in data.values.iter_mut().filter(|value| **value < 0.0) {
            (count, least) = (count + 1, least.min(*value));
            *value = 0.0;
        }
        if count > 0 {
            files.warn(&path, format_args!("{count} of its values are below 0, the least {least}: taken as 0"));
        }
        Ok(Self { path, data, border: Border::Clamp, world_from_voxels: Some(world_from_voxels) })
    }
}
