//! Mitsuba's cube, and what has to be known of mesh files before they are read.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

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
    let triangles = (0..6).flat_map(|face| [[4 * face, 4 * face + 1, 4 * face + 2], [4 * face + 3, 4 * face, 4 * face + 2]]);
    let mut mesh = MeshDesc::from_file("");
    mesh.file = None;
    mesh.positions = Some(FACES.concat());
    mesh.triangles = Some(triangles.collect());
    mesh.uvs = Some([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].repeat(6));
    mesh.shading = MeshShadingDesc::Flat;
    mesh
}

/// Whether the header of a PLY file or a line of an OBJ file has normals; not if the file cannot be read.
pub fn has_normals(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let has = |line: &[u8], word: &[u8]| line.trim_ascii().starts_with(word);
    let mut lines = BufReader::new(file).split(b'\n').map_while(std::io::Result::ok).peekable();
    if lines.peek().is_some_and(|line| has(line, b"ply")) {
        lines.take_while(|line| !has(line, b"end_header")).any(|line| has(&line, b"property") && line.trim_ascii().ends_with(b" nx"))
    } else {
        lines.any(|line| has(&line, b"vn "))
    }
}
