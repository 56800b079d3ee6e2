//! Meshes to binary PLY files.

use std::io::{Result, Write};

use crate::assets::MeshData;
use crate::attribute::{AttributeValues, is_of_faces};

/// Writes a mesh as a binary little-endian PLY file: x y z (as doubles if they are far from the origin), nx ny nz and u
/// v where the mesh has them, triangles, and attributes such that they are read with their names: colours called
/// `color` as linear r g b, others as `NAME_0` and so on.
///
/// # Errors
/// If writing fails.
pub fn write_ply(mesh: &MeshData, out: &mut impl Write) -> Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    let mut names = vec!["x", "y", "z"];
    names.extend(mesh.normals.iter().flat_map(|_| ["nx", "ny", "nz"]));
    names.extend(mesh.uvs.iter().flat_map(|_| ["u", "v"]));
    let is_far = mesh.origin != [0.0; 3];
    for name in names {
        let kind = if is_far && matches!(name, "x" | "y" | "z") { "double" } else { "float" };
        writeln!(out, "property {kind} {name}")?;
    }
    let [of_vertices, of_faces] = [false, true].map(|of_faces| attributes(mesh, of_faces));
    of_vertices.iter().try_for_each(|(name, values)| declare(name, values, out))?;
    writeln!(out, "element face {}\nproperty list uchar int vertex_indices", mesh.triangles.len())?;
    of_faces.iter().try_for_each(|(name, values)| declare(name, values, out))?;
    writeln!(out, "end_header")?;
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
        write_attributes(&of_vertices, i, out)?;
    }
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|corner| out.write_all(&corner.to_le_bytes()))?;
        write_attributes(&of_faces, i, out)?;
    }
    Ok(())
}

/// The attributes of vertices or of faces, by their names without these words.
fn attributes(mesh: &MeshData, of_faces: bool) -> Vec<(&str, &AttributeValues)> {
    let own = mesh.attributes.iter().filter(|(name, _)| is_of_faces(name) == Some(of_faces));
    own.filter_map(|(name, values)| Some((name.split_once('_')?.1, values))).collect()
}

fn declare(name: &str, values: &AttributeValues, out: &mut impl Write) -> Result<()> {
    if name == "color" && values.channels() == 3 {
        return writeln!(out, "property float r\nproperty float g\nproperty float b");
    }
    (0..values.channels()).try_for_each(|channel| writeln!(out, "property float {name}_{channel}"))
}

fn write_attributes(attributes: &[(&str, &AttributeValues)], i: usize, out: &mut impl Write) -> Result<()> {
    let numbers = attributes
        .iter()
        .flat_map(|(_, values)| values.numbers().iter().skip(i * values.channels()).take(values.channels()));
    numbers.into_iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::read_ply;

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
        let attributes = [
            ("face_color", AttributeValues::Colors(vec![[0.5, 0.25, 7.0], [1.0, 2.0, 3.0]])),
            ("face_temp", AttributeValues::Numbers(vec![-1.0, 2.0])),
            ("vertex_a_b", AttributeValues::Numbers(vec![1.0, 2.0, 3.0, 4.0])),
            ("vertex_tint_color", AttributeValues::Colors(vec![[0.5, 0.1, 0.2]; 4])),
        ];
        for present in 0..16 {
            let (normals, uvs) = (normals.clone().filter(|_| present & 1 > 0), uvs.clone().filter(|_| present & 2 > 0));
            let mut mesh =
                MeshData { normals, uvs, ..plain.clone() }.with_colors(colors.clone().filter(|_| present & 4 > 0));
            if present & 8 > 0 {
                mesh.attributes.extend(attributes.clone().map(|(name, values)| (name.to_owned(), values)));
            }
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("m.ply");
            write_ply(&mesh, &mut std::fs::File::create(&path).unwrap()).unwrap();
            assert_eq!(read_ply(&path).unwrap(), mesh);
        }
    }
}
