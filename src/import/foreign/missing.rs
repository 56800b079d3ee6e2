//! Scenes some of whose files are not there: what remains of them without these files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::{Imported, Outcome, ReportEntry};
use crate::desc::{
    ColorDesc, LightDesc, MaterialDesc, MediumDesc, MeshDesc, ScalarDesc, SceneDesc, ShapeDesc, TextureDesc, VolumeDesc,
};

/// The replacement of an image that does not exist.
const GREY: [f32; 3] = [0.5; 3];

impl Imported {
    /// Takes out what refers to files that are not there: meshes, measured lights and environments go, images and
    /// measured materials become grey, media are empty. Each is reported as ignored. `scene` is the scene's file. The
    /// result is how many there were.
    pub fn leave_out_missing(&mut self, scene: &Path) -> usize {
        let folder = scene.parent().unwrap_or(Path::new("")).to_owned();
        let assets = &self.assets;
        let is_missing = |file: &str| !assets.contains(file) && !folder.join(file).is_file();
        let places = Arc::make_mut(&mut self.places);
        let before = self.report.entries.len();
        let mut report = |place: &str, element: &str, file: &str| {
            let (place, element, note) = (place.to_owned(), element.to_owned(), format!("no file {file}"));
            self.report.entries.push(ReportEntry {
                place,
                element,
                parameter: "file".into(),
                outcome: Outcome::Ignored,
                note,
            });
        };

        let mut is_whole = |place: &str, shape: &ShapeDesc| {
            let (kind, missing) = match shape {
                ShapeDesc::Mesh(mesh) => ("shape mesh", files(mesh).find(|file| is_missing(file))),
                ShapeDesc::Curves(curves) => ("shape curves", curves.file.as_deref().filter(|file| is_missing(file))),
                ShapeDesc::Points(points) => ("shape points", points.file.as_deref().filter(|file| is_missing(file))),
                _ => return true,
            };
            missing.inspect(|file| report(place, kind, file)).is_none()
        };
        retain("shapes", &mut self.desc.shapes, places, &mut is_whole);
        for (name, object) in &mut self.desc.objects {
            retain(&format!("objects.{name}.shapes"), &mut object.shapes, places, &mut is_whole);
        }
        retain("lights", &mut self.desc.lights, places, |place, light| {
            let file = match light {
                LightDesc::Environment(light) => light.file.as_deref(),
                LightDesc::Ies(light) => Some(light.file.as_str()),
                LightDesc::Point(_) | LightDesc::Spot(_) | LightDesc::Projector(_) | LightDesc::Directional(_) => None,
            };
            file.filter(|file| is_missing(file)).inspect(|file| report(place, "light", file)).is_none()
        });
        leave_out_contents(&mut self.desc, &is_missing, |path, element, file| {
            report(places.get(path).map_or(path, String::as_str), element, file);
        });
        // Objects that have nothing left take their instances with them.
        let objects = &self.desc.objects;
        let is_empty = |name: &str| {
            objects.get(name).is_some_and(|object| object.shapes.is_empty() && object.instances.is_empty())
        };
        retain("instances", &mut self.desc.instances, places, |_, instance| !is_empty(&instance.object));
        self.report.entries.len() - before
    }
}

/// Makes images and measured materials grey and media empty whose files are missing. Each is reported with its path.
fn leave_out_contents(
    desc: &mut SceneDesc,
    is_missing: &impl Fn(&str) -> bool,
    mut report: impl FnMut(&str, &str, &str),
) {
    for (name, texture) in &mut desc.textures {
        if let TextureDesc::Image { file, .. } = texture
            && is_missing(file)
        {
            report(&format!("textures.{name}"), "texture image", file);
            *texture = TextureDesc::Constant { color: GREY };
        }
    }
    for (name, material) in &mut desc.materials {
        if let MaterialDesc::Measured { file } = material
            && is_missing(file)
        {
            report(&format!("materials.{name}"), "material measured", file);
            *material = MaterialDesc::Diffuse { albedo: ColorDesc::Rgb(GREY), roughness: ScalarDesc::Constant(0.0) };
        }
    }
    for (name, medium) in &mut desc.media {
        let mut is_whole = true;
        for (key, part) in medium.volume.iter_mut().flat_map(|volume| volume.parts_mut()) {
            if let VolumeDesc::Grid { file: Some(file), .. } = part
                && is_missing(file)
            {
                report(&format!("media.{name}"), &format!("medium volume {key}"), file);
                is_whole = false;
            }
        }
        if !is_whole {
            *medium = MediumDesc::default();
        }
    }
}

/// Retains the entries of a list for which `keep` is true, and the places of what is kept in step with it. `keep` is
/// given the place of each, or its path.
fn retain<T>(
    path: &str,
    list: &mut Vec<T>,
    places: &mut BTreeMap<String, String>,
    mut keep: impl FnMut(&str, &T) -> bool,
) {
    let (mut index, mut kept) = (0, 0);
    list.retain(|item| {
        let own_path = format!("{path}[{index}]");
        let place = places.remove(&own_path);
        let is_kept = keep(place.as_deref().unwrap_or(&own_path), item);
        index += 1;
        if is_kept {
            places.extend(place.map(|place| (format!("{path}[{kept}]"), place)));
            kept += 1;
        }
        is_kept
    });
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
        let scene = r#"{ "camera": {}, "textures": { "t": { "type": "image", "file": "no.png" },
            "u": { "type": "checker" } },
            "shapes": [{ "type": "mesh", "file": "no.ply" }, { "type": "mesh", "file": "here.ply" },
            { "type": "sphere" }],
            "objects": { "o": { "shapes": [{ "type": "mesh", "file": "no.obj" }] } }, "instances": [{ "object": "o" }],
            "materials": { "a": { "type": "measured", "file": "no.bsdf" },
            "b": { "type": "measured", "file": "here.ply" } },
            "media": { "m": { "scattering": 1, "volume": { "density": { "type": "grid", "file": "no.vdb" },
            "albedo": { "type": "grid", "file": "no.raw", "resolution": [1, 1, 1] } } },
            "n": { "scattering": 1, "volume": { "density": { "type": "grid", "file": "here.ply" } } } },
            "lights": [{ "type": "environment", "file": "no.exr" },
            { "type": "environment", "radiance": [1, 1, 1] }] }"#;
        std::fs::write(&path, scene).unwrap();
        let mut imported = read_scene(&path, &ImportOptions::default()).unwrap();
        assert_eq!(imported.leave_out_missing(&path), 7);
        assert_eq!((imported.desc.shapes.len(), imported.desc.lights.len(), imported.desc.instances.len()), (2, 1, 0));
        assert!(matches!(imported.desc.textures["t"], TextureDesc::Constant { color: GREY }));
        assert_eq!(imported.report.count(Outcome::Ignored), 7);
        assert!(matches!(imported.desc.materials["a"], MaterialDesc::Diffuse { .. }));
        assert!(matches!(imported.desc.materials["b"], MaterialDesc::Measured { .. }));
        assert!(imported.desc.media["m"].volume.is_none() && imported.desc.media["n"].volume.is_some());
        assert_eq!(imported.desc.media["m"].scattering.to_array(), [0.0; 3]);
        let notes: Vec<_> = imported.report.entries.iter().map(|entry| (&*entry.element, &*entry.note)).collect();
        assert!(notes.contains(&("medium volume density", "no file no.vdb")), "{notes:?}");
        assert!(notes.contains(&("medium volume albedo", "no file no.raw")), "{notes:?}");
        assert_eq!(imported.leave_out_missing(&path), 0);
    }

    #[test]
    fn places_stay_with_what_they_belong_to() {
        let mut places: BTreeMap<String, String> =
            (0..4).map(|i| (format!("shapes[{i}]"), format!("line {i}"))).collect();
        places.insert("lights[0]".into(), "line 9".into());
        let mut list = vec![0, 1, 2, 3];
        retain("shapes", &mut list, &mut places, |place, item| {
            assert_eq!(place, format!("line {item}"));
            item % 2 == 1
        });
        assert_eq!(list, [1, 3]);
        let places: Vec<_> = places.iter().map(|(path, place)| (path.as_str(), place.as_str())).collect();
        assert_eq!(places, [("lights[0]", "line 9"), ("shapes[0]", "line 1"), ("shapes[1]", "line 3")]);
    }
}
