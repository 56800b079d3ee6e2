//! OBJ files with their MTL: one mesh for each material. Colours behind the positions of vertices are sRGB, as
//! exporters write them.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

use super::mtl_maps::{ObjMaps, take_maps};
use super::obj_check::{check_obj, expand_colors};
use super::{AssetError, MeshData};
use crate::color::linear_from_srgb;
use crate::file;

/// The parameters of an MTL material that are supported.
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
    /// `d`, opacity, or what `Tr` leaves of 1.
    pub opacity: Option<f32>,
    /// `illum`.
    pub illumination: Option<u8>,
    /// Images.
    pub maps: ObjMaps,
}

/// The faces of an OBJ file that share a material.
#[derive(Clone, Debug)]
pub struct ObjMesh {
    /// The mesh.
    pub mesh: MeshData,
    /// Its material, if the file names one.
    pub material: Option<ObjMaterial>,
}

/// Reads an OBJ file; with `materials`, also the MTL files it names, as far as they exist. Polygons become fans;
/// points and lines are left out. Of a file with vertices and no faces the result is one mesh without triangles.
///
/// # Errors
/// If the file is missing or one is malformed, a face refers to what does not exist, or there are neither vertices nor
/// faces.
pub fn read_obj(path: &Path, materials: bool) -> Result<Vec<ObjMesh>, AssetError> {
    // Comments and names in old files may be in any encoding.
    let bytes = file::without_mark(file::read(path).map_err(|e| AssetError::missing(path, &e))?);
    let text = String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned());
    let used = check_obj(&text)?;
    // The parser takes lines of three and more points for faces.
    let text = if used.has_lines { without_lines(&text) } else { text };
    // The parser loses count of colours that only some vertices have.
    let text = if used.colors > 0 && used.colors < used.vertices { without_colors(&text) } else { text };

    // The parser has 32-bit numbers.
    let origin = MeshData::origin_for(&used.bounds, used.first.as_ref());
    let text = if origin == [0.0; 3] { text } else { moved(&text, origin) };

    let folder = path.parent().unwrap_or(Path::new(""));
    let trouble: RefCell<Option<AssetError>> = RefCell::new(None);
    let maps: RefCell<HashMap<String, ObjMaps>> = RefCell::default();
    let missing = Cell::new(false);
    let options = tobj::LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };
    let loaded = tobj::load_obj_buf(&mut text.as_bytes(), &options, |mtl| {
        if !materials {
            return Ok(Default::default());
        }
        let mtl = folder.join(mtl);
        if is_missing(path, &mtl) {
            missing.set(true);
            return Ok(Default::default());
        }
        let parsed = read_mtl(&mtl, &maps)
            .and_then(|text| tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| mtl_fault(&mtl, &e)));
        parsed.map_err(|e| {
            trouble.borrow_mut().get_or_insert(e);
            tobj::LoadError::ReadError
        })
    });
    if let Some(error) = trouble.into_inner() {
        return Err(error);
    }
    let (models, library) = loaded.map_err(|e| AssetError::Malformed(format!("not a valid OBJ file: {e}")))?;
    let library = if materials { library.unwrap_or_default() } else { Vec::new() };
    let maps = maps.into_inner();
    if materials && used.names_a_library && !missing.get() {
        let unknown = |(_, name): &&(usize, String)| !library.iter().any(|m| m.name == *name);
        if let Some((line, name)) = used.materials.iter().find(unknown) {
            return Err(AssetError::Malformed(format!("line {line}: no material named \"{name}\" in the MTL")));
        }
    }
    let library: Vec<ObjMaterial> =
        library.iter().map(|m| from_mtl(m, maps.get(&m.name).cloned().unwrap_or_default())).collect();
    let mut meshes = join_models(&models, &library)?;
    if meshes.is_empty() {
        if used.vertices == 0 {
            return Err(AssetError::Malformed("the file has no vertices and no faces".into()));
        }
        meshes.push(ObjMesh { mesh: MeshData::default(), material: None });
    }
    meshes.iter_mut().for_each(|mesh| mesh.mesh.origin = origin);
    Ok(meshes)
}

/// Whether the MTL of an OBJ does not exist, with a warning.
fn is_missing(obj: &Path, mtl: &Path) -> bool {
    let missing = mtl.try_exists().is_ok_and(|exists| !exists);
    if missing {
        let [obj, mtl] = [obj, mtl].map(Path::display);
        tracing::warn!("{obj}: no MTL file {mtl}: the default material is used in place of its materials");
    }
    missing
}

/// One mesh for each material and set of attributes, in the order of their first faces.
fn join_models(models: &[tobj::Model], library: &[ObjMaterial]) -> Result<Vec<ObjMesh>, AssetError> {
    let mut meshes: Vec<ObjMesh> = Vec::new();
    let mut places = HashMap::new();
    for model in models.iter().filter(|model| !model.mesh.indices.is_empty()) {
        let mesh = from_tobj(&model.mesh);
        let material = model.mesh.material_id.filter(|&id| id < library.len());
        let place = *places.entry((material, mesh.normals.is_some(), mesh.uvs.is_some())).or_insert(meshes.len());
        match meshes.get_mut(place) {
            Some(joined) => joined.mesh.append(mesh)?,
            None => meshes.push(ObjMesh { mesh, material: material.map(|id| library[id].clone()) }),
        }
    }
    Ok(meshes)
}

fn without_lines(text: &str) -> String {
    text.lines().filter(|line| line.split_whitespace().next() != Some("l")).flat_map(|line| [line, "\n"]).collect()
}

fn without_colors(text: &str) -> String {
    let plain = |line: &str| match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["v", x, y, z, _, _, _, ..] => format!("v {x} {y} {z}\n"),
        _ => format!("{line}\n"),
    };
    text.lines().map(plain).collect()
}

/// With all vertices relative to `origin`.
fn moved(text: &str, origin: [f64; 3]) -> String {
    let line = |line: &str| {
        let mut words = line.split_whitespace();
        if words.next() != Some("v") {
            return format!("{line}\n");
        }
        let mut out = String::from("v");
        for (axis, word) in words.enumerate() {
            match (origin.get(axis), word.parse::<f64>()) {
                (Some(origin), Ok(x)) => out.push_str(&format!(" {}", x - origin)),
                _ => out.extend([" ", word]),
            }
        }
        out.push('\n');
        out
    };
    text.lines().map(line).collect()
}

/// The text of an MTL, fit for the parser; its texture maps are added to `maps`.
fn read_mtl(path: &Path, maps: &RefCell<HashMap<String, ObjMaps>>) -> Result<String, AssetError> {
    let bytes = file::without_mark(file::read(path).map_err(|e| AssetError::missing(path, &e))?);
    let folder = path.parent().unwrap_or(Path::new(""));
    let (text, found) = take_maps(&String::from_utf8_lossy(&bytes), folder).map_err(|e| mtl_fault(path, &e))?;
    maps.borrow_mut().extend(found);
    expand_colors(&text).map_err(|e| mtl_fault(path, &e))
}

fn mtl_fault(path: &Path, fault: &dyn Display) -> AssetError {
    AssetError::Malformed(format!("{}: not a valid MTL file: {fault}", path.display()))
}

fn from_mtl(material: &tobj::Material, maps: ObjMaps) -> ObjMaterial {
    let transparency = material.unknown_param.get("Tr").and_then(|text| text.parse::<f32>().ok());
    ObjMaterial {
        name: material.name.clone(),
        diffuse: material.diffuse,
        specular: material.specular,
        emissive: material.emissive,
        shininess: material.shininess,
        ior: material.optical_density,
        opacity: material.dissolve.or(transparency.map(|t| 1.0 - t)),
        illumination: material.illumination_model,
        maps,
    }
}

/// An attribute is kept only where every vertex has it.
fn from_tobj(mesh: &tobj::Mesh) -> MeshData {
    let triples = |flat: &[f32]| -> Vec<[f32; 3]> { flat.as_chunks::<3>().0.to_vec() };
    let positions = triples(&mesh.positions);
    let normals = triples(&mesh.normals);
    let uvs = mesh.texcoords.as_chunks::<2>().0.to_vec();
    let colors: Vec<[f32; 3]> =
        mesh.vertex_color.as_chunks::<3>().0.iter().map(|color| color.map(linear_from_srgb)).collect();
    let colors = (colors.len() == positions.len()).then_some(colors);
    let mut data = MeshData {
        normals: (normals.len() == positions.len()).then_some(normals),
        uvs: (uvs.len() == positions.len()).then_some(uvs),
        positions,
        ..MeshData::default()
    };
    if mesh.face_arities.is_empty() {
        data.triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    }
    let mut rest = mesh.indices.as_slice();
    for &size in &mesh.face_arities {
        let (corners, others) = rest.split_at(size as usize);
        data.push_polygon(corners);
        rest = others;
    }
    data.with_colors(colors)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn write(folder: &tempfile::TempDir, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

    #[test]
    fn materials_split_the_mesh_and_groups_do_not() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder, "m.mtl", "newmtl a\nKd 0.1 0.2 0.3\nnewmtl b\nKe 1 2 3\nKd 0.5\nTr 0.25\n");
        let text = format!(
            "mtllib m.mtl\n{QUAD}g one\nusemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf -4 -3 -2\ng two\nusemtl a\n\
             f 1/1 2/2 3/3\n"
        );
        let meshes = read_obj(&write(&folder, "q.obj", &text), true).unwrap();
        assert_eq!(meshes.len(), 2);
        assert_eq!(meshes[0].mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
        assert_eq!(meshes[0].mesh.uvs.as_ref().unwrap()[6], [1.0, 1.0]);
        assert_eq!(meshes[0].material.as_ref().unwrap().diffuse, Some([0.1, 0.2, 0.3]));
        let b = meshes[1].material.as_ref().unwrap();
        assert_eq!((b.emissive, b.diffuse, b.opacity), (Some([1.0, 2.0, 3.0]), Some([0.5; 3]), Some(0.75)));
        assert_eq!(read_obj(&folder.path().join("q.obj"), false).unwrap().len(), 2);
    }

    #[test]
    fn a_byte_order_mark_hides_no_line() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder, "m.mtl", "\u{feff}newmtl a\nKd 0.1 0.2 0.3\n");
        let meshes =
            read_obj(&write(&folder, "q.obj", format!("\u{feff}{QUAD}mtllib m.mtl\nusemtl a\nf 1 2 3 4\n")), true)
                .unwrap();
        assert_eq!(
            (meshes[0].mesh.positions.len(), meshes[0].material.as_ref().unwrap().diffuse),
            (4, Some([0.1, 0.2, 0.3]))
        );
    }

    #[test]
    fn lines_and_points_are_no_faces() {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("# caf\u{e9}\n{QUAD}l 1 2 3 4\np 1\nl 1 2\nf 1 2 3\nf 1 2\n");
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let meshes = read_obj(&write(&folder, "q.obj", latin), true).unwrap();
        assert_eq!(meshes[0].mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn colours_of_vertices_are_decoded_and_all_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let colored = "v 0 0 0 1 0 0.2\nv 1 0 0 0 1 0.2\nv 1 1 0 0 0 1\n";
        let mesh = |text: &str| read_obj(&write(&folder, "q.obj", text), true).unwrap().remove(0).mesh;
        let blue = linear_from_srgb(0.2);
        let mixed = mesh(&format!("{colored}f 3 1 2\n"));
        assert_eq!(mixed.colors(), Some(&[[0.0, 0.0, 1.0], [1.0, 0.0, blue], [0.0, 1.0, blue]][..]));
        for some in [format!("{colored}v 0 1 0\n"), format!("v 0 1 0\n{colored}")] {
            let mesh = mesh(&format!("{some}f 1 2 3 4\n"));
            assert_eq!((mesh.colors(), mesh.positions.len()), (None, 4));
        }
        assert_eq!(mesh("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").colors(), None);
    }

    #[test]
    fn without_its_mtl_an_obj_has_no_materials() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(&folder, "q.obj", format!("mtllib gone.mtl\n{QUAD}usemtl a\nf 1 2 3\n"));
        let meshes = read_obj(&path, true).unwrap();
        assert_eq!((meshes.len(), meshes[0].mesh.triangles.len()), (1, 1));
        assert_eq!(meshes[0].material, None);
        assert!(read_obj(&path, false).is_ok());
    }

    #[test]
    fn malformed_materials_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(&folder, "q.obj", format!("mtllib m.mtl\n{QUAD}usemtl a\nf 1 2 3\n"));
        for (mtl, part) in [
            ("newmtl a\nKd 0.1 0.2\n", "line 2"),
            ("newmtl a\nKd spectral x.rfl\n", "line 2"),
            ("newmtl a\nKd\n", "line 2"),
            ("newmtl a\nNs x\n", "MTL"),
            ("newmtl b\nKd 0 0 0\n", "no material named \"a\""),
            ("newmtl\n", "MTL"),
            ("", "no material named \"a\""),
        ] {
            write(&folder, "m.mtl", mtl);
            let error = read_obj(&path, true).unwrap_err().to_string();
            assert!(error.contains(part), "{mtl:?}: {error}");
        }
    }

    #[test]
    fn malformed_files_are_errors_with_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let three = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
        for (text, part) in [
            (String::new(), "no faces"),
            ("v 0 0 0\nf 1 2 3\n".into(), "line 2: a face refers to vertex 3, but there are only 1"),
            ("v 0 0 x\n".into(), "line 1"),
            ("v 0 0\n".into(), "line 1"),
            (format!("{three}f 0 1 2\n"), "line 4"),
            (format!("{three}f 1 2 -4\n"), "line 4"),
            (format!("{three}f 1 2 x\n"), "line 4"),
            (format!("{three}f 1/1/1/1 2 3\n"), "line 4"),
            (format!("{three}vt 0 0\nf 1/2 2/1 3/1\n"), "line 5: a face refers to uv 2, but there are only 1"),
            (format!("{three}f 1//1 2//1 3//1\n"), "line 4: a face refers to normal 1, but there are only 0"),
            (format!("{three}f 1 2 99999999999999999999\n"), "line 4"),
            (format!("{three}f 1 2 -9223372036854775808\n"), "line 4"),
        ] {
            let error = read_obj(&write(&folder, "bad.obj", &text), true).unwrap_err();
            assert!(matches!(&error, AssetError::Malformed(message) if message.contains(part)), "{text:?}: {error}");
        }
        assert!(matches!(read_obj(&folder.path().join("none.obj"), true), Err(AssetError::Missing { .. })));
        for text in [three.into(), format!("{three}f 1 2\nl 1 2 3\n")] {
            let meshes = read_obj(&write(&folder, "points.obj", &text), true).unwrap();
            assert_eq!(meshes.iter().map(|mesh| mesh.mesh.triangles.len()).collect::<Vec<_>>(), [0], "{text:?}");
        }
    }
}
