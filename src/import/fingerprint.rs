//! What a scene is, in a few bytes: BLAKE3 hashes of its description and of every file and asset that it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Imported;
use crate::assets::{Hash, file_hashes, files_of_obj, is_obj};
use crate::desc::{FilmDesc, IntegratorDesc, SamplerDesc, SceneDesc};
use crate::error::{Error, Result};

/// Hashes of a scene, each as 64 hexadecimal digits. Two scenes of the same `whole` look the same under the same
/// settings. Files that the world does not use do not count.
///
/// Comments, spaces, and what belongs to the settings of a render (film, sampler, integrator, outputs) do not count,
/// nor do the folder of the scene and the format it was read from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFingerprint {
    /// Of all below.
    pub whole: String,
    /// Of the description.
    pub scene: String,
    /// Of the files and assets that the scene names, by the names it uses; materials and images of OBJ files are among
    /// them.
    pub assets: BTreeMap<String, String>,
}

impl SceneFingerprint {
    fn of(scene: String, assets: BTreeMap<String, String>) -> Self {
        let mut whole = Hash::default();
        whole.text(&scene);
        for (name, hash) in &assets {
            whole.text(name);
            whole.text(hash);
        }
        Self { whole: whole.finish(), scene, assets }
    }

    /// That of another description with the same files, which are not read again.
    ///
    /// # Errors
    /// [`Error::Internal`] if the description cannot be hashed.
    pub fn with_description(&self, desc: &SceneDesc) -> Result<Self> {
        Ok(Self::of(description_hash(desc.clone())?, self.assets.clone()))
    }

    /// What differs from another scene: the description and files, by name.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let names: BTreeSet<&String> = self.assets.keys().chain(other.assets.keys()).collect();
        let files = names.into_iter().filter(|&name| self.assets.get(name) != other.assets.get(name)).cloned();
        (self.scene != other.scene).then(|| "the scene's description".to_owned()).into_iter().chain(files).collect()
    }
}

/// The hashes of a scene that was read from `scene_file`, beside which its files lie. Reads all that are used.
///
/// # Errors
/// [`Error::Missing`] if a file cannot be read.
pub fn scene_fingerprint(imported: &Imported, scene_file: &Path) -> Result<SceneFingerprint> {
    let mut desc = imported.desc.clone();
    let used = desc.files_mut().into_iter().filter(|file| file.is_used);
    let names: BTreeMap<String, String> = used.map(|file| (file.name.clone(), file.path)).collect();
    let scene = description_hash(desc)?;
    let folder = scene_file.parent().unwrap_or(Path::new(""));
    let hashed: Vec<Vec<(String, String)>> = names
        .par_iter()
        .map(|(name, path)| match imported.assets.hash(name) {
            Some(hash) => Ok(vec![(name.clone(), hash)]),
            None => file_hashes(folder, name).map_err(|error| error.at(scene_file, path, &folder.join(name))),
        })
        .collect::<Result<_>>()?;
    let assets: BTreeMap<String, String> = hashed.into_iter().flatten().collect();
    Ok(SceneFingerprint::of(scene, assets))
}

/// The files that a scene is made of beside its own: those that its description names, each with the place, materials
/// and images of OBJ files, and those that were read to import it. Whether they can be read does not matter.
pub fn files_of_scene(imported: &Imported, scene_file: &Path) -> Vec<(PathBuf, String)> {
    let folder = scene_file.parent().unwrap_or(Path::new(""));
    let mut desc = imported.desc.clone();
    let named = desc.files_mut().into_iter().filter(|file| !imported.assets.contains(file.name));
    let named: BTreeMap<PathBuf, String> = named.map(|file| (folder.join(&*file.name), file.path)).collect();
    let of_obj = |(path, place): (&PathBuf, &String)| {
        let files = if is_obj(path) { files_of_obj(path).unwrap_or_default() } else { BTreeSet::new() };
        files.into_iter().map(|file| (file, format!("named by {place}"))).collect::<Vec<_>>()
    };
    let further: Vec<(PathBuf, String)> = named.iter().flat_map(of_obj).collect();
    let imported = imported.files.iter().map(|file| (file.clone(), "a file of the scene".to_owned()));
    imported.chain(further).chain(named).collect()
}

/// The hash of the description without the settings of a render.
fn description_hash(mut desc: SceneDesc) -> Result<String> {
    desc.schema = None;
    desc.comment = None;
    desc.film = FilmDesc::default();
    desc.sampler = SamplerDesc::default();
    desc.integrator = IntegratorDesc::default();
    desc.outputs = Vec::new();
    let text = serde_json::to_string(&desc)
        .map_err(|e| Error::Internal(format!("the scene cannot be written as JSON: {e}")))?;
    let mut hash = Hash::default();
    hash.text(&text);
    Ok(hash.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::MeshData;
    use crate::attribute::AttributeValues;
    use crate::import::{Draft, ImportOptions, read_scene};

    /// The hashes of a scene in a folder with a mesh and an image.
    fn fingerprint(folder: &Path, scene: &str) -> SceneFingerprint {
        let path = folder.join("scene.json");
        std::fs::write(&path, scene).unwrap();
        scene_fingerprint(&read_scene(&path, &ImportOptions::default()).unwrap(), &path).unwrap()
    }

    const SCENE: &str = r#"{ "camera": {}, "sampler": { "spp": 4 }, "shapes": [{ "type": "mesh", "file": "m/a.obj" },
        { "type": "sphere" }] }"#;

    #[test]
    fn what_a_scene_shows_counts_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("m")).unwrap();
        std::fs::write(folder.path().join("m/a.obj"), "mtllib a.mtl\nv 0 0 0\n").unwrap();
        std::fs::write(folder.path().join("m/a.mtl"), "newmtl a\nmap_Kd -s 2 2 1 a.png\nbump gone.png\n").unwrap();
        std::fs::write(folder.path().join("m/a.png"), "picture").unwrap();
        let first = fingerprint(folder.path(), SCENE);
        assert_eq!(first.assets.keys().collect::<Vec<_>>(), ["m/a.mtl", "m/a.obj", "m/a.png"]);
        assert_eq!(first.assets["m/a.png"], blake3::hash(b"picture").to_hex().to_string());

        let settings = SCENE.replace("\"spp\": 4", "\"spp\": 9, /* more */ \"seed\": 3").replace("{}", "{ }");
        assert_eq!(fingerprint(folder.path(), &settings), first);
        let other = fingerprint(folder.path(), &SCENE.replace("sphere", "disk"));
        assert_eq!(first.differences(&other), ["the scene's description"]);
        assert_ne!(first.whole, other.whole);

        std::fs::write(folder.path().join("m/a.png"), "pictures").unwrap();
        let other = fingerprint(folder.path(), SCENE);
        assert_eq!(first.differences(&other), ["m/a.png"]);
        assert_ne!(first.whole, other.whole);

        // What nothing uses need not be there.
        let unused = r#""textures": { "t": { "type": "image", "file": "gone.png" } },
            "objects": { "o": { "shapes": [{ "type": "mesh", "file": "gone.ply" }] } }, "camera""#;
        assert_eq!(fingerprint(folder.path(), &SCENE.replace("\"camera\"", unused)).assets, other.assets);

        std::fs::remove_file(folder.path().join("m/a.obj")).unwrap();
        let imported = read_scene(&folder.path().join("scene.json"), &ImportOptions::default()).unwrap();
        let error = scene_fingerprint(&imported, &folder.path().join("scene.json")).unwrap_err();
        assert!(matches!(
            &error,
            Error::Missing { file, message } if file.ends_with("m/a.obj") && message.contains("shapes[0].file")
        ));
    }

    #[test]
    fn assets_without_files_count() {
        let hash = |change: &dyn Fn(&mut MeshData)| {
            let mut imported = Draft::default().finish();
            let mut mesh = MeshData {
                positions: vec![[0.0; 3], [1.0, 2.0, 3.0]],
                triangles: vec![[0, 1, 1]],
                ..MeshData::default()
            };
            change(&mut mesh);
            std::sync::Arc::make_mut(&mut imported.assets).meshes.insert("a.ply".into(), mesh);
            let shape = serde_json::from_str(r#"{ "type": "mesh", "file": "a.ply" }"#).unwrap();
            imported.desc.shapes.push(shape);
            scene_fingerprint(&imported, Path::new("s.gltf")).unwrap().assets["a.ply"].clone()
        };
        let same = hash(&|_| {});
        assert_eq!(hash(&|_| {}), same);
        assert_ne!(hash(&|mesh| mesh.positions[1][2] = 3.5), same);
        assert_ne!(hash(&|mesh| mesh.normals = Some(vec![])), same);
        let attribute = |name: &str, values: &AttributeValues| {
            hash(&|mesh| drop(mesh.attributes.insert(name.into(), values.clone())))
        };
        let (number, color) = (AttributeValues::Numbers(vec![0.5; 3]), AttributeValues::Colors(vec![[0.5; 3]]));
        let hashes =
            [attribute("vertex_a", &number), attribute("vertex_a", &color), attribute("vertex_b", &number), same];
        assert!((0..4).all(|i| !hashes[..i].contains(&hashes[i])));
    }
}
