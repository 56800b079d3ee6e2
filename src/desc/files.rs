//! The files that a scene names.

use super::{CurvesDesc, LightDesc, MaterialDesc, PointsDesc, SceneDesc, ShapeDesc, TextureDesc, VolumeDesc};

/// A file that a scene names.
#[derive(Debug)]
pub struct NamedFile<'a> {
    /// Where, such as `shapes[2].file`.
    pub path: String,
    /// Its name.
    pub name: &'a mut String,
    /// Whether the world uses it; else the scene can be rendered without.
    pub is_used: bool,
}

impl SceneDesc {
    /// Every name of a file in the scene. A file may be named more than once.
    pub fn files_mut(&mut self) -> Vec<NamedFile<'_>> {
        let used = self.used_names();
        let mut files = Vec::new();
        let shapes = self.shapes.iter_mut().enumerate().map(|(i, shape)| (format!("shapes[{i}]"), shape, true));
        let objects = self.objects.iter_mut().flat_map(|(name, object)| {
            let is_used = used.objects.contains(name);
            object
                .shapes
                .iter_mut()
                .enumerate()
                .map(move |(i, shape)| (format!("objects.{name}.shapes[{i}]"), shape, is_used))
        });
        for (path, shape, is_used) in shapes.chain(objects) {
            if let ShapeDesc::Curves(CurvesDesc { file, .. }) | ShapeDesc::Points(PointsDesc { file, .. }) = shape {
                files.extend(file.as_mut().map(|name| NamedFile { path: format!("{path}.file"), name, is_used }));
            } else if let ShapeDesc::Mesh(mesh) = shape {
                let file = mesh.file.as_mut().map(|file| (format!("{path}.file"), file));
                let later = mesh
                    .deform_files
                    .iter_mut()
                    .enumerate()
                    .map(|(i, file)| (format!("{path}.deform_files[{i}]"), file));
                files.extend(file.into_iter().chain(later).map(|(path, name)| NamedFile { path, name, is_used }));
            }
        }
        for (name, texture) in &mut self.textures {
            if let TextureDesc::Image { file, .. } = texture {
                files.push(NamedFile {
                    path: format!("textures.{name}.file"),
                    name: file,
                    is_used: used.textures.contains(name),
                });
            }
        }
        for (name, material) in &mut self.materials {
            if let MaterialDesc::Measured { file } = material {
                let is_used = used.materials.contains(name);
                files.push(NamedFile { path: format!("materials.{name}.file"), name: file, is_used });
            }
        }
        for (medium, desc) in &mut self.media {
            for (key, part) in desc.volume.iter_mut().flat_map(|volume| volume.parts_mut()) {
                if let VolumeDesc::Grid { file: Some(file), .. } = part {
                    let path = format!("media.{medium}.volume.{key}.file");
                    files.push(NamedFile { path, name: file, is_used: used.media.contains(medium) });
                }
            }
        }
        for (i, light) in self.lights.iter_mut().enumerate() {
            let file = match light {
                LightDesc::Environment(light) => light.file.as_mut(),
                LightDesc::Ies(light) => Some(&mut light.file),
                LightDesc::Point(_) | LightDesc::Spot(_) | LightDesc::Projector(_) | LightDesc::Directional(_) => None,
            };
            files.extend(file.map(|name| NamedFile { path: format!("lights[{i}].file"), name, is_used: true }));
        }
        files
    }
}
