//! Meshes to binary PLY files.

use std::io::{Result, Write};

use crate::import::MeshData;

/// Writes a mesh as a binary little-endian PLY file: x y z (as doubles if they are far from the origin), nx ny nz, u v and linear r g b
/// where the mesh has them, and triangles.
///
/// # Errors
/// If writing fails.
pub fn write_ply(mesh: &MeshData, out: &mut impl Write) -> Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    let mut names = vec!["x", "y", "z"];
    names.extend(mesh.normals.iter().flat_map(|_| ["nx", "ny", "nz"]));
    names.extend(mesh.uvs.iter().flat_map(|_| ["u", "v"]));
    names.extend(mesh.colors.iter().flat_map(|_| ["r", "g", "b"]));
    let is_far = mesh.origin != [0.0; 3];
    for name in names {
        let kind = if is_far && matches!(name, "x" | "y" | "z") { "double" } else { "float" };
        writeln!(out, "property {kind} {name}")?;
    }
    writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", mesh.triangles.len())?;
    for (i, position) in mesh.positions.iter().enumerate() {
        if is_far {
            mesh.position(*position).to_array().iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
        }
        let mut write = |values: &[f32]| values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()));
        if !is_far {
            write(position)?;
        }
        mesh.normals.as_ref().map_or(Ok(()), |normals| write(&normals[i]))?;
        mesh.uvs.as_ref().map_or(Ok(()), |uvs| write(&uvs[i]))?;
        mesh.colors.as_ref().map_or(Ok(()), |colors| write(&colors[i]))?;
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|corner| out.write_all(&corner.to_le_bytes()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::read_ply;

    #[test]
    fn meshes_come_back_as_they_were() {
        let plain = MeshData {
            positions: vec![[0.0, 1e-30, -2.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, 3.0, 3.0]],
            triangles: vec![[0, 1, 2], [3, 2, 1]],
            ..MeshData::default()
        };
        let normals = Some(vec![[0.0, 0.0, 1.0]; 4]);
        let uvs = Some(vec![[0.25, 0.5], [1.0, 2.0], [3.0, -4.0], [0.0, 0.0]]);
        let colors = Some(vec![[0.1, 0.7, 1e-9], [1.0, 0.0, 0.3], [0.5; 3], [f32::MIN_POSITIVE, 0.2, 2.5]]);
        for present in 0..8 {
            let (normals, uvs) = (normals.clone().filter(|_| present & 1 > 0), uvs.clone().filter(|_| present & 2 > 0));
            let mesh = MeshData { normals, uvs, colors: colors.clone().filter(|_| present & 4 > 0), ..plain.clone() };
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("m.ply");
            write_ply(&mesh, &mut std::fs::File::create(&path).unwrap()).unwrap();
            assert_eq!(read_ply(&path).unwrap(), mesh);
        }
    }
}
