//! Mitsuba's cube, and what has to be known of mesh files before they are read.

use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::assets::{MeshData, read_obj, read_ply};
use crate::desc::{MeshDesc, MeshShadingDesc};

/// Mitsuba's cube `[-1, 1]³`, with its uv.
pub fn cube() -> MeshDesc {
    // Corners of each face, from the one with u = 0, v = 1 to those at (1, 1), (1, 0) and (0, 0).
    const FACES: [[[f32; 3]; 4]; 6] = [
        [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]],
        [[1.0, 1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
        [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
        [[1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]],
        [[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]],
        [[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]],
    ];
    let triangles =
        (0..6).flat_map(|face| [[4 * face, 4 * face + 1, 4 * face + 2], [4 * face + 3, 4 * face, 4 * face + 2]]);
    let mut mesh = MeshDesc::from_file("");
    mesh.file = None;
    mesh.positions = Some(FACES.concat().into_iter().map(|p| p.map(f64::from)).collect());
    mesh.triangles = Some(triangles.collect());
    mesh.uvs = Some([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].repeat(6));
    mesh.shading = MeshShadingDesc::Flat;
    mesh
}

/// The mesh of an OBJ or PLY file if it is one, has no uv and can be read.
pub fn without_uvs(path: &Path) -> Option<MeshData> {
    let is_obj = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    if has(path, &[" u", " s", " texture_u"], b"vt ") {
        return None;
    }
    let mut meshes = if is_obj {
        read_obj(path, false).ok()?.into_iter().map(|part| part.mesh).collect()
    } else {
        vec![read_ply(path).ok()?]
    };
    meshes.pop().filter(|mesh| meshes.is_empty() && mesh.uvs.is_none())
}

/// Whether an OBJ file has uv, but no normals.
pub fn smooths_over_seams(path: &Path) -> bool {
    !has(path, &[], b"vn ") && has(path, &[], b"vt ")
}

/// Whether the header of a PLY file or a line of an OBJ file has normals; not if the file cannot be read.
pub fn has_normals(path: &Path) -> bool {
    has(path, &[" nx"], b"vn ")
}

/// Whether the header of a PLY file has a property whose line ends in one of these, or a line of an OBJ file begins so.
fn has(path: &Path, endings: &[&str], word: &[u8]) -> bool {
    let Ok(source) = crate::file::open(path).and_then(|file| crate::file::skip_mark(BufReader::new(file))) else {
        return false;
    };
    let begins = |line: &[u8], word: &[u8]| line.trim_ascii().starts_with(word);
    let mut lines = source.split(b'\n').map_while(std::io::Result::ok).peekable();
    if lines.peek().is_some_and(|line| begins(line, b"ply")) {
        let ends = |line: &[u8]| endings.iter().any(|ending| line.trim_ascii().ends_with(ending.as_bytes()));
        lines.take_while(|line| !begins(line, b"end_header")).any(|line| begins(&line, b"property") && ends(&line))
    } else {
        lines.any(|line| begins(&line, word))
    }
}
