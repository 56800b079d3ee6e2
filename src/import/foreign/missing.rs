//! Scenes some of whose files are not there: what remains of them without these files.

use std::path::Path;

use super::{Imported, Outcome, ReportEntry};
use crate::desc::{LightDesc, MeshDesc, ShapeDesc, TextureDesc};

/// What stands for an image that is not there.
const GREY: [f32; 3] = [0.5; 3];

impl Imported {
    /// Takes out what refers to files that are not there: meshes, measured lights and environments go, images become grey. Each is
    /// reported as ignored. `scene` is the scene's file. The result is how many there were.
    pub fn leave_out_missing(&mut self, scene: &Path) -> usize {
        let folder = scene.parent().unwrap_or(Path::new("")).to_owned();
        let assets = &self.assets;
        let is_missing = |file: &str| !assets.contains(file) && !folder.join(file).is_file();
        let mut found: Vec<(String, &str, String)> = Vec::new();

        let mut keep = |path: String, shape: &ShapeDesc| match shape {
            ShapeDesc::Mesh(mesh) => match files(mesh).find(|file| is_missing(file)) {
                Some(file) => {
                    found.push((path, "shape mesh", file.to_owned()));
                    false
                }
                None => true,
            },
            _ => true,
        };
        let mut i = 0;
        self.desc.shapes.retain(|shape| {
            i += 1;
            keep(format!("shapes[{}]", i - 1), shape)
        });
        for (name, object) in &mut self.desc.objects {
            let mut i = 0;
            object.shapes.retain(|shape| {
                i += 1;
                keep(format!("objects.{name}.shapes[{}]", i - 1), shape)
            });
        }
        for (name, texture) in &mut self.desc.textures {
            if let TextureDesc::Image { file, .. } = texture
                && is_missing(file)
            {
                found.push((format!("textures.{name}"), "texture image", file.clone()));
                *texture = TextureDesc::Constant { color: GREY };
            }
        }
        let mut i = 0;
        self.desc.lights.retain(|light| {
            i += 1;
            let file = match light {
                LightDesc::Environment(light) => light.file.as_deref(),
                LightDesc::Ies(light) => Some(light.file.as_str()),
                LightDesc::Point(_) | LightDesc::Spot(_) | LightDesc::Directional(_) => None,
            };
            let missing = file.filter(|file| is_missing(file));
            found.extend(missing.map(|file| (format!("lights[{}]", i - 1), "light", file.to_owned())));
            missing.is_none()
        });
        // Objects that have nothing left take their instances with them.
        let objects = &self.desc.objects;
        let is_empty = |name: &str| objects.get(name).is_some_and(|object| object.shapes.is_empty() && object.instances.is_empty());
        self.desc.instances.retain(|instance| !is_empty(&instance.object));

        let count = found.len();
        for (path, element, file) in found {
            let place = self.places.get(&path).cloned().unwrap_or(path);
            let note = format!("there is no file {file}");
            self.report.entries.push(ReportEntry {
                place,
                element: element.into(),
                parameter: "file".into(),
                outcome: Outcome::Ignored,
                note,
            });
        }
        count
    }
}

fn files(mesh: &MeshDesc) -> impl Iterator<Item = &str> {
    mesh.file.iter().chain(&mesh.deform_files).map(String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{ImportOptions, read_scene};

    #[test]
    fn only_what_is_missing_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.json");
        std::fs::write(folder.path().join("here.ply"), "ply").unwrap();
        let scene = r#"{ "camera": {}, "textures": { "t": { "type": "image", "file": "no.png" }, "u": { "type": "checker" } },
            "shapes": [{ "type": "mesh", "file": "no.ply" }, { "type": "mesh", "file": "here.ply" }, { "type": "sphere" }],
            "objects": { "o": { "shapes": [{ "type": "mesh", "file": "no.obj" }] } }, "instances": [{ "object": "o" }],
            "lights": [{ "type": "environment", "file": "no.exr" }, { "type": "environment", "radiance": [1, 1, 1] }] }"#;
        std::fs::write(&path, scene).unwrap();
        let mut imported = read_scene(&path, &ImportOptions::default()).unwrap();
        assert_eq!(imported.leave_out_missing(&path), 4);
        assert_eq!((imported.desc.shapes.len(), imported.desc.lights.len(), imported.desc.instances.len()), (2, 1, 0));
        assert!(matches!(imported.desc.textures["t"], TextureDesc::Constant { color: GREY }));
        assert_eq!(imported.report.count(Outcome::Ignored), 4);
        assert_eq!(imported.leave_out_missing(&path), 0);
    }
}
