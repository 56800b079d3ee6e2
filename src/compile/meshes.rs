//! Meshes: buffers from files or the scene itself to placed, checked [`Mesh`]es.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::file_cache::MeshKey;
use super::normals::{self, Smoothing};
use super::{CompileContext, attributes};
use crate::assets::{self, AssetError, MeshData, ObjMaterial};
use crate::attribute::{AttributeValues, VERTEX_COLOR, is_of_faces};
use crate::desc::{AttributeDesc, MeshDesc, MeshShadingDesc, SceneDesc, ShapeDesc, UsedNames};
use crate::error::{Error, Result};
use crate::geometry::{Mesh, MeshError, MeshStep};
use crate::math::{DVec3, Transform, Vec3};

/// A mesh as given, with the material that its file names.
#[derive(Clone)]
pub struct LoadedMesh {
    pub data: MeshData,
    /// Its vertices at later times.
    pub later: Vec<MeshData>,
    pub material: Option<ObjMaterial>,
}

impl LoadedMesh {
    /// The mesh at each time.
    pub fn steps(&self) -> impl Iterator<Item = &MeshData> {
        std::iter::once(&self.data).chain(&self.later)
    }
}

/// The meshes of a scene's files, read in parallel before the shapes are placed one after another.
#[derive(Default)]
pub struct MeshStore {
    loaded: HashMap<String, Result<Vec<LoadedMesh>>>,
    /// The attributes that textures take.
    attributes: BTreeSet<String>,
}

impl MeshStore {
    /// Reads the files of all meshes that are used.
    pub fn read(files: &CompileContext, desc: &SceneDesc, used: &UsedNames) -> Self {
        let meshes = desc.used_shapes(used).filter_map(|(path, shape)| match shape {
            ShapeDesc::Mesh(mesh) if mesh.file.is_some() => Some((path, mesh)),
            _ => None,
        });
        let meshes: Vec<(String, &MeshDesc)> = meshes.collect();
        let attributes = desc.attribute_names(used);
        let loaded =
            meshes.into_par_iter().map(|(path, mesh)| (path.clone(), load(files, &path, mesh, &attributes))).collect();
        Self { loaded, attributes }
    }

    /// The meshes of the shape at `path`: several where an OBJ has several materials.
    pub fn take(&mut self, files: &CompileContext, path: &str, desc: &MeshDesc) -> Result<Vec<LoadedMesh>> {
        self.loaded.remove(path).unwrap_or_else(|| load(files, path, desc, &self.attributes))
    }
}

fn load(files: &CompileContext, path: &str, desc: &MeshDesc, attributes: &BTreeSet<String>) -> Result<Vec<LoadedMesh>> {
    let mut meshes = load_faces(files, path, desc, attributes)?;
    if desc.subdivision.is_none() {
        meshes.iter_mut().for_each(|mesh| mesh.data.faces = Vec::new());
    }
    Ok(meshes)
}

/// The triangles and faces of a mesh without a file.
fn inline_faces(files: &CompileContext, path: &str, desc: &MeshDesc) -> Result<Option<MeshData>> {
    let mut data = MeshData::default();
    match (&desc.triangles, &desc.faces) {
        (Some(triangles), None) => data.triangles.clone_from(triangles),
        (None, Some(faces)) => {
            for (i, face) in faces.iter().enumerate() {
                if face.len() < 3 {
                    let message = format!("a face has three corners or more, not {}", face.len());
                    return Err(files.error(&format!("{path}.faces[{i}]"), message));
                }
                data.push_polygon(face);
            }
        }
        _ => return Ok(None),
    }
    Ok(Some(data))
}

fn load_faces(
    files: &CompileContext,
    path: &str,
    desc: &MeshDesc,
    attributes: &BTreeSet<String>,
) -> Result<Vec<LoadedMesh>> {
    for (key, times) in [("deform_files", desc.deform_files.len()), ("deform_positions", desc.deform_positions.len())] {
        if times >= Mesh::MAX_STEPS {
            let message = format!("{times} further times: there can be {}", Mesh::MAX_STEPS - 1);
            return Err(files.error(&format!("{path}.{key}"), message));
        }
    }
    match (&desc.file, &desc.positions, inline_faces(files, path, desc)?) {
        (Some(file), None, None)
            if desc.triangles.is_none()
                && desc.faces.is_none()
                && desc.normals.is_none()
                && desc.uvs.is_none()
                && desc.colors.is_none()
                && desc.attributes.is_empty()
                && desc.deform_positions.is_empty() =>
        {
            let mut meshes = load_file(files, &format!("{path}.file"), file, desc.material.is_none(), attributes)?;
            for (i, file) in desc.deform_files.iter().enumerate() {
                let place = format!("{path}.deform_files[{i}]");
                let later = load_file(files, &place, file, desc.material.is_none(), &BTreeSet::new())?;
                if later.len() != meshes.len()
                    || meshes.iter().zip(&later).any(|(a, b)| a.data.triangles != b.data.triangles)
                {
                    return Err(files.error(&place, "the triangles are not those of `file`: only positions may differ"));
                }
                for (mesh, later) in meshes.iter_mut().zip(later) {
                    mesh.later.push(later.data);
                }
            }
            Ok(meshes)
        }
        (None, Some(positions), Some(faces)) if desc.deform_files.is_empty() => {
            let data = MeshData { attributes: inline_attributes(files, path, desc)?, ..faces };
            Ok(vec![load_inline(desc, positions, data)])
        }
        _ => Err(files.error(
            path,
            "a mesh needs either `file`, or `positions` and `triangles` or `faces` (with optional `normals`, `uvs`, \
             `colors` and `attributes`)",
        )),
    }
}

/// A mesh without a file, given its faces and attributes.
fn load_inline(desc: &MeshDesc, positions: &[[f64; 3]], given: MeshData) -> LoadedMesh {
    let (positions, origin) = MeshData::rounded(positions);
    let data = MeshData { positions, normals: desc.normals.clone(), uvs: desc.uvs.clone(), origin, ..given };
    let at = |positions: &Vec<[f64; 3]>| {
        let (positions, origin) = MeshData::rounded(positions);
        MeshData { positions, origin, attributes: BTreeMap::new(), ..data.clone() }
    };
    let later = desc.deform_positions.iter().map(at).collect();
    LoadedMesh { data, later, material: None }
}

/// The attributes of a mesh without a file, its colours among them.
fn inline_attributes(files: &CompileContext, path: &str, desc: &MeshDesc) -> Result<BTreeMap<String, AttributeValues>> {
    let mut attributes = BTreeMap::new();
    for (name, values) in &desc.attributes {
        let place = format!("{path}.attributes.{name}");
        if is_of_faces(name).is_none() {
            return Err(files.error(&place, "the name of an attribute begins with vertex_ or face_"));
        }
        if name == VERTEX_COLOR && desc.colors.is_some() {
            return Err(files.error(&place, "`colors` are this attribute: give one of the two"));
        }
        let values = match values {
            AttributeDesc::Numbers(values) => AttributeValues::Numbers(values.clone()),
            AttributeDesc::Colors(values) => AttributeValues::Colors(values.clone()),
        };
        attributes.insert(name.clone(), values);
    }
    attributes.extend(desc.colors.clone().map(|colors| (VERTEX_COLOR.to_owned(), AttributeValues::Colors(colors))));
    Ok(attributes)
}

fn load_file(
    files: &CompileContext,
    place: &str,
    file: &str,
    with_materials: bool,
    attributes: &BTreeSet<String>,
) -> Result<Vec<LoadedMesh>> {
    let plain = |data, material| LoadedMesh { data, later: Vec::new(), material };
    if let Some(data) = files.source.assets.meshes.get(file) {
        return Ok(vec![plain(data.clone(), None)]);
    }
    let asset = files.source.asset(file);
    let key = MeshKey { asset: asset.clone(), with_materials, attributes: attributes.clone() };
    if let Some(kept) = files.cache.as_ref().and_then(|cache| cache.mesh(&key)) {
        return Ok(kept);
    }
    let extension = asset.extension().map(|e| e.to_string_lossy().to_lowercase());
    let loaded = match extension.as_deref() {
        Some("ply") => assets::read_ply_attributes(&asset, Some(attributes)).map(|data| vec![plain(data, None)]),
        Some("obj") => assets::read_obj(&asset, with_materials)
            .map(|meshes| meshes.into_iter().map(|mesh| plain(mesh.mesh, mesh.material)).collect()),
        _ => Err(AssetError::Malformed("meshes are .obj or .ply files".into())),
    };
    let loaded = loaded.map_err(|e| files.asset_error(place, &asset, e))?;
    if let Some(cache) = &files.cache {
        cache.keep_mesh(key, &loaded);
    }
    Ok(loaded)
}

/// How a mesh is placed.
#[derive(Clone, Copy)]
pub struct Placement<'a> {
    /// Where the mesh came from.
    pub file: Option<&'a str>,
    pub transform: &'a Transform,
    pub shading: MeshShadingDesc,
    pub smoothing: Smoothing,
    pub reverse_normal: bool,
    /// Whether the mesh emits light.
    pub emits: bool,
    /// Names of attributes by their ids.
    pub attributes: &'a [String],
}

/// The error about a mesh, in its file if it has one.
pub fn refusal(files: &CompileContext, path: &str, file: Option<&str>, message: String) -> Error {
    match file {
        Some(file) => {
            files.asset_error(&format!("{path}.file"), &files.source.asset(file), AssetError::Malformed(message))
        }
        None => files.error(path, message),
    }
}

/// Checks that lists are as long as others require.
fn check_counts(data: &MeshData) -> Result<(), String> {
    let count = data.positions.len();
    if let Some((triangle, index)) = out_of_range(data) {
        return Err(MeshError::Index { triangle, index, count }.to_string());
    }
    if let Some(uvs) = data.uvs.as_ref().filter(|uvs| uvs.len() != count) {
        return Err(MeshError::Count { what: "uvs", count: uvs.len(), vertices: count }.to_string());
    }
    attributes::check_counts(&data.attributes, count, data.triangles.len())
}

/// Checks what is computed with before a mesh is placed.
pub fn check_buffers(data: &MeshData, later: &[MeshData]) -> Result<(), String> {
    check_counts(data)?;
    if let Some(i) = data.uvs.iter().flatten().position(|uv| !uv.iter().all(|x| x.is_finite())) {
        return Err(MeshError::Uv(i).to_string());
    }
    let vertices = data.positions.len();
    if let Some(normals) = data.normals.as_ref().filter(|normals| normals.len() != vertices) {
        return Err(MeshError::Count { what: "normals", count: normals.len(), vertices }.to_string());
    }
    for step in std::iter::once(data).chain(later) {
        if step.positions.len() != vertices {
            let count = step.positions.len();
            return Err(MeshError::Count { what: "positions at a later time", count, vertices }.to_string());
        }
        if let Some(i) = step.positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(MeshError::Position(i).to_string());
        }
    }
    Ok(())
}

/// Moves a mesh to its place and checks it. A mirrored mesh is wound the other way round, so that its front stays the
/// front. Triangles without area are dropped with a warning. `None`, with a warning too, if no triangles are left.
pub fn place(
    files: &CompileContext,
    path: &str,
    data: MeshData,
    later: Vec<MeshData>,
    placement: Placement,
) -> Result<Option<Mesh>> {
    let refuse = |error: MeshError| refusal(files, path, placement.file, error.to_string());
    let count = data.positions.len();
    check_counts(&data).map_err(|message| refusal(files, path, placement.file, message))?;
    let transform = placement.transform;
    let is_identity = *transform == Transform::IDENTITY;
    let place_positions = |mut positions: Vec<[f32; 3]>, origin: [f64; 3]| {
        if !is_identity || origin != [0.0; 3] {
            for p in &mut positions {
                *p = transform.point(DVec3::from(p.map(f64::from)) + DVec3::from(origin)).as_vec3().to_array();
            }
        }
        positions
    };
    let positions = place_positions(data.positions, data.origin);
    let by_face = data.attributes.keys().any(|name| is_of_faces(name) == Some(true));
    let mut faces = Faces::new(data.triangles, by_face);
    if transform.swaps_handedness() != placement.reverse_normal {
        faces.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    // What deforms may get an area later.
    let is_kept = |t: &[u32; 3]| !later.is_empty() || has_area(t.map(|i| Vec3::from(positions[i as usize])));
    if !faces.drop_degenerate(files, path, is_kept) {
        return Ok(None);
    }
    if placement.emits {
        faces.drop_coincident(files, path, &positions);
    }
    let Faces { mut triangles, numbers } = faces;

    let mut steps = vec![MeshStep { positions, normals: data.normals }];
    for step in later {
        if step.positions.len() != count {
            return Err(refuse(MeshError::Count {
                what: "positions at a later time",
                count: step.positions.len(),
                vertices: count,
            }));
        }
        steps.push(MeshStep { positions: place_positions(step.positions, step.origin), normals: step.normals });
    }
    let mut uvs = data.uvs;
    let vertices = find_normals(&mut steps, &mut triangles, placement);
    if let Some(vertices) = &vertices {
        uvs = uvs.map(|uvs| vertices.iter().map(|&v| uvs[v as usize]).collect());
    }
    let attributes = attributes::placed(data.attributes, placement.attributes, vertices.as_deref(), numbers.as_deref());
    let mut steps = steps.into_iter();
    let MeshStep { positions, normals } = steps.next().unwrap_or_default();
    let mesh = Mesh::new(positions, triangles, normals, uvs).map_err(refuse)?.with_attributes(attributes);
    let later: Vec<MeshStep> = steps.collect();
    let mesh = if later.is_empty() { mesh } else { mesh.deforming(later).map_err(refuse)? };
    Ok(Some(mesh))
}

/// Gives a placed mesh the normals of its shading, at each of its times; splits vertices at creases, and then returns
/// the original index of each.
fn find_normals(steps: &mut [MeshStep], triangles: &mut Vec<[u32; 3]>, placement: Placement) -> Option<Vec<u32>> {
    let given = steps.iter().all(|step| step.normals.is_some());
    let computed = match placement.shading {
        MeshShadingDesc::Smooth => !given,
        MeshShadingDesc::Computed => true,
        MeshShadingDesc::Auto | MeshShadingDesc::Flat => false,
    };
    let Smoothing { weight, crease_cosine, by } = placement.smoothing;
    match crease_cosine.filter(|_| computed) {
        Some(cosine) => {
            let positions: Vec<&[[f32; 3]]> = steps.iter().map(|step| step.positions.as_slice()).collect();
            let split = normals::split(&positions, triangles, weight, by, cosine);
            for (step, normals) in steps.iter_mut().zip(split.normals) {
                let positions = split.vertices.iter().map(|&v| step.positions[v as usize]).collect();
                *step = MeshStep { positions, normals: Some(normals) };
            }
            *triangles = split.triangles;
            Some(split.vertices)
        }
        None => {
            for step in steps {
                let given = step.normals.take();
                step.normals = match placement.shading {
                    _ if computed => Some(normals::smooth(&step.positions, triangles, weight, by)),
                    MeshShadingDesc::Flat => None,
                    _ => given.map(|normals| place_normals(normals, placement.transform, placement.reverse_normal)),
                };
            }
            None
        }
    }
}

/// The triangles of a mesh, with the numbers that they have in its file where attributes go by them.
struct Faces {
    triangles: Vec<[u32; 3]>,
    numbers: Option<Vec<u32>>,
}

impl Faces {
    fn new(triangles: Vec<[u32; 3]>, numbered: bool) -> Self {
        let numbers = numbered.then(|| (0..triangles.len() as u32).collect());
        Self { triangles, numbers }
    }

    /// Keeps the triangles of which something is true, and their numbers.
    fn retain(&mut self, mut is_kept: impl FnMut(&[u32; 3]) -> bool) {
        let Some(numbers) = &mut self.numbers else { return self.triangles.retain(is_kept) };
        let kept: Vec<bool> = self.triangles.iter().map(&mut is_kept).collect();
        let mut of_triangles = kept.iter();
        self.triangles.retain(|_| of_triangles.next() == Some(&true));
        let mut of_numbers = kept.iter();
        numbers.retain(|_| of_numbers.next() == Some(&true));
    }

    /// Drops triangles without area, with a warning; false, with a warning too, if none are left.
    fn drop_degenerate(&mut self, files: &CompileContext, path: &str, has_area: impl FnMut(&[u32; 3]) -> bool) -> bool {
        let before = self.triangles.len();
        self.retain(has_area);
        let dropped = before - self.triangles.len();
        if self.triangles.is_empty() {
            let why = if before == 0 {
                "the mesh has no triangles".into()
            } else {
                format!("all {before} triangles of the mesh have no area")
            };
            files.warn(path, format_args!("{why}: the shape is skipped"));
        } else if dropped > 0 {
            files.warn(path, format_args!("{dropped} of {before} triangles have no area and were dropped"));
        }
        !self.triangles.is_empty()
    }

    /// Of triangles of an emitter that are in one place, keeps the first, with a warning: which of them a ray meets,
    /// and so which side shines, is otherwise left to the accelerator.
    fn drop_coincident(&mut self, files: &CompileContext, path: &str, positions: &[[f32; 3]]) {
        let before = self.triangles.len();
        let mut places = HashSet::with_capacity(before);
        self.retain(|t| {
            // Adding zero makes a negative zero positive.
            let mut corners = t.map(|i| positions[i as usize].map(|x| (x + 0.0).to_bits()));
            corners.sort_unstable();
            places.insert(corners)
        });
        let dropped = before - self.triangles.len();
        if dropped > 0 {
            let file = files.source.file.display();
            tracing::warn!(
                "{file}: {path}: {dropped} of {before} triangles lie where others of the emitter do and were dropped \
                 (for both sides: emission.two_sided)"
            );
        }
    }
}

fn out_of_range(data: &MeshData) -> Option<(usize, u32)> {
    let count = data.positions.len();
    let bad = |(i, t): (usize, &[u32; 3])| t.iter().find(|&&v| v as usize >= count).map(|&v| (i, v));
    data.triangles.iter().enumerate().find_map(bad)
}

/// Whether three corners span an area; NaN counts as area, so that the mesh is rejected for it and not merely thinned.
fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

fn place_normals(mut normals: Vec<[f32; 3]>, transform: &Transform, reverse: bool) -> Vec<[f32; 3]> {
    let sign = if reverse { -1.0 } else { 1.0 };
    for n in &mut normals {
        let moved = transform.normal(DVec3::from(n.map(f64::from))) * sign;
        // Zero and NaN stay as they are; the first falls back to the flat normal, the second is rejected.
        *n = if moved.length_squared() > 0.0 { moved.normalize().as_vec3().to_array() } else { *n };
    }
    normals
}

/// The cube `[-1, 1]³`: two triangles a face, with uv on each.
pub fn cube() -> MeshData {
    let mut mesh = MeshData { uvs: Some(Vec::new()), ..MeshData::default() };
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let first = mesh.positions.len() as u32;
            for (u, v) in [(0.0f32, 0.0f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                let mut p = [0.0; 3];
                p[axis] = side;
                p[(axis + 1) % 3] = (2.0 * u - 1.0) * side;
                p[(axis + 2) % 3] = 2.0 * v - 1.0;
                mesh.positions.push(p);
                mesh.uvs.get_or_insert_default().push([u, v]);
            }
            mesh.push_polygon(&[first, first + 1, first + 2, first + 3]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubes_faces_look_outward() {
        let cube = cube();
        assert_eq!(cube.triangles.len(), 12);
        for t in &cube.triangles {
            let [a, b, c] = t.map(|i| Vec3::from(cube.positions[i as usize]));
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }

    #[test]
    fn of_coincident_triangles_of_an_emitter_the_first_is_kept() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 1.0, -0.0], [1.0, 1.0, 0.0]];
        // The same, turned, turned over, and with another vertex at the same place; the last shares an edge alone.
        let mut faces = Faces::new(vec![[0, 1, 2], [1, 2, 0], [2, 1, 0], [3, 1, 0], [1, 4, 2]], true);
        faces.drop_coincident(&CompileContext::new("s.json"), "shapes[0]", &positions);
        assert_eq!((faces.triangles, faces.numbers), (vec![[0, 1, 2], [1, 4, 2]], Some(vec![0, 4])));
    }
}
