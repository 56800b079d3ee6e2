//! OBJ files with their MTL: one mesh for each material.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::{AssetError, MeshData};

/// What an MTL says of a material that is used here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjMaterial {
    /// Name.
    pub name: String,
    /// `Kd`, diffuse colour.
    pub diffuse: Option<[f32; 3]>,
    /// `Ks`, specular colour.
    pub specular: Option<[f32; 3]>,
    /// `Ke`, emitted radiance.
    pub emissive: Option<[f32; 3]>,
    /// `Ns`, Phong exponent.
    pub shininess: Option<f32>,
    /// `Ni`, index of refraction.
    pub ior: Option<f32>,
    /// `d`, opacity.
    pub opacity: Option<f32>,
    /// `illum`.
    pub illumination: Option<u8>,
}

/// A mesh of an OBJ file with the material of its faces.
#[derive(Clone, Debug)]
pub struct ObjMesh {
    /// The `o` or `g` it belongs to.
    pub name: String,
    /// The mesh.
    pub mesh: MeshData,
    /// Its material, if the file names one.
    pub material: Option<ObjMaterial>,
}

/// Reads an OBJ file; with `materials`, also the MTL files it names.
///
/// # Errors
/// If a file is missing or malformed, a face refers to what does not exist, or there are no faces.
pub fn read_obj(path: &Path, materials: bool) -> Result<Vec<ObjMesh>, AssetError> {
    let file = std::fs::File::open(path).map_err(|e| AssetError::missing(path, &e))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let missing: RefCell<Option<(PathBuf, std::io::Error)>> = RefCell::new(None);
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let mut reader = std::io::BufReader::with_capacity(1 << 20, file);
    let loaded = tobj::load_obj_buf(&mut reader, &options, |mtl| {
        if !materials {
            return Ok(Default::default());
        }
        let mtl = folder.join(mtl);
        match std::fs::File::open(&mtl) {
            Ok(file) => tobj::load_mtl_buf(&mut std::io::BufReader::new(file)),
            Err(e) => {
                missing.borrow_mut().get_or_insert((mtl, e));
                Err(tobj::LoadError::OpenFileFailed)
            }
        }
    });
    if let Some((file, error)) = missing.into_inner() {
        return Err(AssetError::missing(&file, &error));
    }
    let malformed = |what: &str, e: &tobj::LoadError| AssetError::Malformed(format!("not a valid {what} file: {e}"));
    let (models, library) = loaded.map_err(|e| malformed("OBJ", &e))?;
    let library = if materials { library.map_err(|e| malformed("MTL", &e))? } else { Vec::new() };

    let mut meshes = Vec::new();
    for model in models {
        if model.mesh.indices.is_empty() {
            continue;
        }
        let material = model.mesh.material_id.and_then(|id| library.get(id)).map(from_mtl);
        meshes.push(ObjMesh { name: model.name, mesh: from_tobj(&model.mesh), material });
    }
    if meshes.is_empty() {
        return Err(AssetError::Malformed("the file has no faces".into()));
    }
    Ok(meshes)
}

fn from_mtl(material: &tobj::Material) -> ObjMaterial {
    ObjMaterial {
        name: material.name.clone(),
        diffuse: material.diffuse,
        specular: material.specular,
        emissive: material.emissive,
        shininess: material.shininess,
        ior: material.optical_density,
        opacity: material.dissolve,
        illumination: material.illumination_model,
    }
}

/// An attribute is kept only where every vertex has it.
fn from_tobj(mesh: &tobj::Mesh) -> MeshData {
    let triples = |flat: &[f32]| -> Vec<[f32; 3]> { flat.as_chunks::<3>().0.to_vec() };
    let positions = triples(&mesh.positions);
    let normals = triples(&mesh.normals);
    let uvs = mesh.texcoords.as_chunks::<2>().0.to_vec();
    MeshData {
        normals: (normals.len() == positions.len()).then_some(normals),
        uvs: (uvs.len() == positions.len()).then_some(uvs),
        positions,
        triangles: mesh.indices.as_chunks::<3>().0.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

    #[test]
    fn materials_split_the_mesh() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder, "m.mtl", "newmtl a\nKd 0.1 0.2 0.3\nnewmtl b\nKe 1 2 3\n");
        let text = format!("mtllib m.mtl\n{QUAD}usemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf -4 -3 -2\n");
        let meshes = read_obj(&write(&folder, "q.obj", &text), true).unwrap();
        assert_eq!(meshes.len(), 2);
        assert_eq!(meshes[0].mesh.triangles.len(), 2);
        assert!(meshes[0].mesh.uvs.is_some());
        assert_eq!(meshes[0].material.as_ref().unwrap().diffuse, Some([0.1, 0.2, 0.3]));
        assert_eq!(meshes[1].material.as_ref().unwrap().emissive, Some([1.0, 2.0, 3.0]));
    }

    #[test]
    fn a_missing_mtl_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(&folder, "q.obj", &format!("mtllib gone.mtl\n{QUAD}usemtl a\nf 1 2 3\n"));
        assert!(matches!(read_obj(&path, true), Err(AssetError::Missing { file, .. }) if file.ends_with("gone.mtl")));
        assert!(read_obj(&path, false).is_ok());
    }

    #[test]
    fn malformed_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        for text in ["", "v 0 0 0\nf 1 2 3\n", "v 0 0 x\n", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\n", "v 0 0 0\nf 0 0 0\n", "f 1 2 3\n"] {
            let path = write(&folder, "bad.obj", text);
            assert!(matches!(read_obj(&path, true), Err(AssetError::Malformed(_))), "{text:?}");
        }
        assert!(matches!(read_obj(&folder.path().join("none.obj"), true), Err(AssetError::Missing { .. })));
    }
}
