//! Subdivision surfaces of meshes.

use std::collections::HashMap;

use super::meshes::{self, LoadedMesh};
use super::normals::{first_of, shared_vertices};
use super::{Builder, CompileContext};
use crate::assets::MeshData;
use crate::attribute::{AttributeValues, is_of_faces};
use crate::desc::{BoundaryDesc, MeshDesc, SubdivisionDesc, SubdivisionSchemeDesc, SubdivisionUvsDesc};
use crate::error::Result;
use crate::math::{DAffine3, DVec3};
use crate::subdivision::{self, Cage, Refined, Refinement, Scheme, UvRule};

/// More levels than this are not possible.
const MAX_LEVELS: u32 = 16;

/// The largest `max_triangles`: vertices have numbers of 32 bits.
const MOST_TRIANGLES: u64 = 1 << 29;

/// How vertices of a mesh belong together.
pub struct Sharing {
    /// The first vertex with the position of each; all of them are moved together.
    pub points: Vec<usize>,
    /// The first vertex with the normal of each.
    pub normals: Vec<usize>,
}

/// A cage, and the triangles that its faces begin with.
struct Control {
    cage: Cage,
    first_triangles: Vec<u32>,
    /// The point of each vertex.
    shared: Vec<usize>,
}

impl Builder {
    /// Replaces a mesh by its subdivision surface. `places` is where the mesh stands.
    pub(super) fn subdivide(
        &self,
        path: &str,
        mesh: &MeshDesc,
        loaded: &mut LoadedMesh,
        places: &[DAffine3],
    ) -> Result<Option<Sharing>> {
        let Some(desc) = &mesh.subdivision else { return Ok(None) };
        let files = &self.files;
        let place = &format!("{path}.subdivision");
        let levels = check(files, place, desc)?;
        let scheme = match desc.scheme {
            SubdivisionSchemeDesc::CatmullClark => Scheme::CatmullClark,
            SubdivisionSchemeDesc::Loop => Scheme::Loop,
        };
        let mut control = control(files, path, mesh, loaded, scheme)?;
        if control.cage.sizes.is_empty() {
            return Ok(None);
        }
        control.cage.sharp_border_corners = desc.boundary == BoundaryDesc::EdgeAndCorner;
        add_creases(files, place, mesh, desc, &mut control)?;
        let faces = [control.cage.points.len(), control.cage.sizes.len()].map(|count| count as u64);
        let least = if desc.edge_length.is_some() { 0 } else { levels };
        self.check_count(place, desc, scheme, faces, least)?;
        let is_too_long = desc.edge_length.map(|length| self.dicing.limit(length, places, &loaded.data));
        let how = Refinement {
            scheme,
            uv_rule: match desc.uvs {
                SubdivisionUvsDesc::SmoothInside => UvRule::SmoothInside,
                SubdivisionUvsDesc::Linear => UvRule::Linear,
            },
            levels,
            is_too_long: is_too_long.as_ref().map(|limit| limit as _),
            max_triangles: desc.max_triangles,
        };
        let refined = subdivision::refine(control.cage, &how);
        if refined.irregular_edges > 0 {
            let message = format_args!(
                "{} edges have more than two faces, or two that are wound differently: they are sharp",
                refined.irregular_edges
            );
            files.warn(path, message);
        }
        if refined.is_cut_short {
            let message = format_args!(
                "edges are longer than `edge_length`: `max_triangles`, {}, allows no more",
                desc.max_triangles
            );
            files.warn(place, message);
        }
        let (before, after) = (faces[1], refined.triangles.len());
        tracing::info!("{path}: {before} faces are subdivided into {after} triangles");
        Ok(Some(take(loaded, refined, &control.first_triangles)))
    }

    /// Refuses more levels than the number of triangles allows.
    fn check_count(
        &self,
        place: &str,
        desc: &SubdivisionDesc,
        scheme: Scheme,
        [corners, faces]: [u64; 2],
        levels: u32,
    ) -> Result<()> {
        let count = |levels| subdivision::triangle_count(scheme, corners, faces, levels);
        if count(levels) <= desc.max_triangles {
            return Ok(());
        }
        let most = desc.max_triangles;
        let allowed = (0..levels).rev().find(|&levels| count(levels) <= most);
        let advice = allowed.map_or(String::new(), |levels| format!(", which allows {levels} levels"));
        let message = format!(
            "{levels} levels make {} triangles of {faces} faces: `max_triangles` is {most}{advice}",
            count(levels)
        );
        Err(self.files.error(place, message))
    }
}

/// Checks the numbers; the result is the most levels.
fn check(files: &CompileContext, place: &str, desc: &SubdivisionDesc) -> Result<u32> {
    if let Some(length) = desc.edge_length {
        files.positive(&format!("{place}.edge_length"), length)?;
    }
    let levels = desc.levels.unwrap_or(if desc.edge_length.is_some() { 10 } else { 2 });
    if levels > MAX_LEVELS {
        return Err(files.error(&format!("{place}.levels"), format!("must be from 0 to {MAX_LEVELS}, not {levels}")));
    }
    if !(1..=MOST_TRIANGLES).contains(&desc.max_triangles) {
        let message = format!("must be from 1 to {MOST_TRIANGLES}, not {}", desc.max_triangles);
        return Err(files.error(&format!("{place}.max_triangles"), message));
    }
    Ok(levels)
}

/// The cage of a mesh, without faces that have no area because a vertex occurs twice.
fn control(
    files: &CompileContext,
    path: &str,
    mesh: &MeshDesc,
    loaded: &LoadedMesh,
    scheme: Scheme,
) -> Result<Control> {
    let data = &loaded.data;
    let refuse = |message: String| meshes::refusal(files, path, mesh.file.as_deref(), message);
    meshes::check_buffers(data, &loaded.later).map_err(refuse)?;
    let steps: Vec<&[[f32; 3]]> = loaded.steps().map(|step| step.positions.as_slice()).collect();
    let shared = shared_vertices(&steps, mesh.smooth_by);
    let origin = DVec3::from(data.origin);
    let positions = |step: &MeshData| step.positions.iter().map(|&p| step.position(p) - origin).collect();
    let mut cage = Cage {
        positions: loaded.steps().map(positions).collect(),
        uvs: data
            .uvs
            .as_ref()
            .map(|uvs| uvs.iter().map(|&[u, v]| DVec3::new(f64::from(u), f64::from(v), 0.0)).collect()),
        linear: of_vertices(data).map(wide).collect(),
        ..Cage::default()
    };
    let is_fans = scheme == Scheme::CatmullClark && !data.faces.is_empty();
    let (sizes, corners) = if is_fans {
        (data.faces.clone(), data.face_corners())
    } else {
        (vec![3; data.triangles.len()], data.triangles.as_flattened().to_vec())
    };
    let (mut first_triangles, mut triangle, mut rest) = (Vec::new(), 0, corners.as_slice());
    let mut dropped = 0;
    for &size in &sizes {
        let (face, others) = rest.split_at(size as usize);
        let points: Vec<u32> = face.iter().map(|&vertex| shared[vertex as usize] as u32).collect();
        let mut sorted = points.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            dropped += 1;
        } else {
            cage.sizes.push(size);
            cage.points.extend(points);
            cage.vertices.extend(face);
            first_triangles.push(triangle);
        }
        triangle += size - 2;
        rest = others;
    }
    if dropped > 0 {
        let message = format_args!("{dropped} of {} faces have a vertex twice and were dropped", sizes.len());
        files.warn(path, message);
    }
    Ok(Control { cage, first_triangles, shared })
}

fn of_vertices(data: &MeshData) -> impl Iterator<Item = &AttributeValues> {
    data.attributes.iter().filter(|(name, _)| is_of_faces(name) != Some(true)).map(|(_, values)| values)
}

fn wide(values: &AttributeValues) -> Vec<DVec3> {
    match values {
        AttributeValues::Numbers(values) => values.iter().map(|&value| DVec3::splat(f64::from(value))).collect(),
        AttributeValues::Colors(values) => values.iter().map(|value| DVec3::from(value.map(f64::from))).collect(),
    }
}

/// Marks what is sharp.
fn add_creases(
    files: &CompileContext,
    place: &str,
    mesh: &MeshDesc,
    desc: &SubdivisionDesc,
    control: &mut Control,
) -> Result<()> {
    let creases = desc.creases.iter().map(|crease| ("creases", &crease.vertices, crease.sharpness));
    let corners = desc.corners.iter().map(|corner| ("corners", &corner.vertices, corner.sharpness));
    let mut edges = HashMap::new();
    if !desc.creases.is_empty() {
        let mut start = 0;
        for &size in &control.cage.sizes {
            let face = &control.cage.points[start..start + size as usize];
            let ends = face.iter().zip(face.iter().cycle().skip(1));
            edges.extend(ends.map(|(&a, &b)| ([a.min(b), a.max(b)], ())));
            start += size as usize;
        }
    }
    let is_obj = mesh.file.as_ref().is_some_and(|file| file.to_lowercase().ends_with(".obj"));
    for (i, (key, vertices, sharpness)) in creases.enumerate().chain(corners.enumerate()) {
        let place = format!("{place}.{key}[{i}]");
        if is_obj {
            let message = "an OBJ numbers positions, not vertices: use a PLY file, or `positions` and `faces`";
            return Err(files.error(&place, message));
        }
        if !(sharpness >= 0.0 && sharpness.is_finite()) {
            let message = format!("must be finite and not below 0, not {sharpness}");
            return Err(files.error(&format!("{place}.sharpness"), message));
        }
        if key == "creases" && vertices.len() < 2 {
            return Err(files.error(&format!("{place}.vertices"), "a crease has two vertices or more"));
        }
        let point = |&vertex: &u32| {
            let point = control.shared.get(vertex as usize).map(|&point| point as u32);
            let count = control.shared.len();
            let message = || format!("no vertex {vertex}: there are only {count}");
            point.ok_or_else(|| files.error(&format!("{place}.vertices"), message()))
        };
        let points = vertices.iter().map(point).collect::<Result<Vec<u32>>>()?;
        if key == "corners" {
            control.cage.corners.extend(points.into_iter().map(|point| (point, sharpness)));
            continue;
        }
        for (pair, ends) in points.windows(2).zip(vertices.windows(2)) {
            let edge = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            if !edges.contains_key(&edge) {
                let message = format!("no face has an edge from vertex {} to vertex {}", ends[0], ends[1]);
                return Err(files.error(&format!("{place}.vertices"), message));
            }
            control.cage.creases.insert(edge, sharpness);
        }
    }
    Ok(())
}

/// Puts a refined mesh in the place of its cage.
fn take(loaded: &mut LoadedMesh, refined: Refined, first_triangles: &[u32]) -> Sharing {
    let data = &mut loaded.data;
    let mut linear = refined.linear.into_iter();
    for (name, values) in &mut data.attributes {
        if is_of_faces(name) == Some(true) {
            *values = values.gathered(refined.faces.iter().map(|&face| first_triangles[face as usize]));
        } else if let Some(fine) = linear.next() {
            *values = match values {
                AttributeValues::Numbers(_) => AttributeValues::Numbers(fine.iter().map(|value| value[0]).collect()),
                AttributeValues::Colors(_) => AttributeValues::Colors(fine),
            };
        }
    }
    (data.triangles, data.faces, data.uvs) = (refined.triangles, Vec::new(), refined.uvs);
    let origin = data.origin;
    let steps = refined.positions.into_iter().zip(refined.normals);
    for (step, (positions, normals)) in std::iter::once(data).chain(&mut loaded.later).zip(steps) {
        (step.positions, step.normals, step.origin) = (positions, Some(normals), origin);
    }
    for step in &mut loaded.later {
        (step.triangles, step.faces, step.uvs) = (Vec::new(), Vec::new(), None);
    }
    Sharing { points: first_of(refined.points.into_iter()), normals: first_of(refined.smooth.into_iter()) }
}
