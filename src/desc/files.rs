//! The files that a scene names.

use super::{LightDesc, SceneDesc, ShapeDesc, TextureDesc};

impl SceneDesc {
    /// Every name of a file in the scene, with its place, such as `shapes[2].file`. A file may be named more than once.
    pub fn files_mut(&mut self) -> Vec<(String, &mut String)> {
        let mut names = Vec::new();
        let shapes = self.shapes.iter_mut().enumerate().map(|(i, shape)| (format!("shapes[{i}]"), shape));
        let objects = self.objects.iter_mut().flat_map(|(name, object)| {
            object.shapes.iter_mut().enumerate().map(move |(i, shape)| (format!("objects.{name}.shapes[{i}]"), shape))
        });
        for (path, shape) in shapes.chain(objects) {
            if let ShapeDesc::Mesh(mesh) = shape {
                names.extend(mesh.file.as_mut().map(|file| (format!("{path}.file"), file)));
                names.extend(mesh.deform_files.iter_mut().enumerate().map(|(i, file)| (format!("{path}.deform_files[{i}]"), file)));
            }
        }
        for (name, texture) in &mut self.textures {
            if let TextureDesc::Image { file, .. } = texture {
                names.push((format!("textures.{name}.file"), file));
            }
        }
        for (i, light) in self.lights.iter_mut().enumerate() {
            let file = match light {
                LightDesc::Environment(light) => light.file.as_mut(),
                LightDesc::Ies(light) => Some(&mut light.file),
                LightDesc::Point(_) | LightDesc::Spot(_) | LightDesc::Directional(_) => None,
            };
            names.extend(file.map(|file| (format!("lights[{i}].file"), file)));
        }
        names
    }
}
