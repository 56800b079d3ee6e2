//! Primitives to triangles: indices, attributes, morph targets and skins.

use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, accessor};

use super::GltfSource;
use super::accessors::{AccessorUse, Column};
use super::skins;
use crate::assets::MeshData;
use crate::error::Result;
use crate::math::{DAffine3, DVec3};

/// What moves the vertices of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Deformation<'a> {
    /// Weights of the morph targets.
    pub weights: &'a [f32],
    /// World from mesh for each joint of a skin.
    pub joints: Option<&'a [DAffine3]>,
}

/// What is to be known of the colours of a primitive's vertices: red, green, blue and alpha.
#[derive(Clone, Copy, Debug)]
pub struct VertexColors {
    pub mean: [f32; 4],
    /// Whether vertices differ in anything but alpha.
    pub differ: bool,
    /// Whether vertices differ in alpha.
    pub differ_in_alpha: bool,
}

/// Triangles of a primitive; only vertices that they use.
#[derive(Debug)]
pub struct Triangles {
    /// Without uv.
    pub data: MeshData,
    /// About the colours of the vertices, if they have any.
    pub colors: Option<VertexColors>,
    /// The vertices of the primitive that are used, and how many it has.
    used: Vec<u32>,
    count: usize,
}

/// Whether a primitive is made of triangles.
pub fn has_triangles(primitive: &Primitive) -> bool {
    !matches!(primitive.mode, Checked::Valid(Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip))
}

/// The accessor of an attribute.
pub fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<accessor::Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

/// Reads the triangles of a primitive; `None` if there are none.
pub fn triangles(
    source: GltfSource,
    path: &str,
    primitive: &Primitive,
    deformation: Deformation,
) -> Result<Option<Triangles>> {
    let Some(positions) = attribute(primitive, Semantic::Positions) else {
        return Err(source.fault(path, "has no positions"));
    };
    let positions =
        source.column(&format!("{path}.attributes.POSITION"), positions, &[Type::Vec3], AccessorUse::Floats)?;
    let count = positions.count();
    let Checked::Valid(mode) = primitive.mode else {
        return Err(source.fault(&format!("{path}.mode"), "is not one of glTF"));
    };
    let reader = PrimitiveReader { source, path, primitive, count };
    let corners = reader.corners()?;
    let mut triangles = assemble(mode, &corners);
    drop(corners);
    if triangles.is_empty() {
        return Ok(None);
    }
    let used = compact(&mut triangles, count);

    let normals = reader.column("NORMAL", Semantic::Normals, &[Type::Vec3], AccessorUse::Floats)?;
    let colors = reader.column("COLOR_0", Semantic::Colors(0), &[Type::Vec3, Type::Vec4], AccessorUse::Floats)?;
    let colors: Option<Vec<[f32; 4]>> = colors.map(|colors| used.iter().map(|&i| color(&colors, i as usize)).collect());
    let mut data = MeshData {
        positions: used.iter().map(|&i| positions.floats(i as usize)).collect(),
        triangles,
        normals: normals.map(|normals| used.iter().map(|&i| normals.floats(i as usize)).collect()),
        uvs: None,
        ..MeshData::default()
    }
    .with_colors(colors.as_ref().map(|colors| colors.iter().map(|&[r, g, b, _]| [r, g, b]).collect()));
    reader.morph(deformation.weights, &used, &mut data)?;
    if let Some(joints) = deformation.joints {
        reader.skin(joints, &used, &mut data)?;
    }
    Ok(Some(Triangles { data, colors: colors.as_deref().map(VertexColors::of), used, count }))
}

impl Triangles {
    /// Reads the uv of one set, if the primitive has it.
    pub fn read_uvs(&mut self, source: GltfSource, path: &str, primitive: &Primitive, set: u32) -> Result<()> {
        let name = format!("TEXCOORD_{set}");
        let reader = PrimitiveReader { source, path, primitive, count: self.count };
        let uvs = reader.column(&name, Semantic::TexCoords(set), &[Type::Vec2], AccessorUse::Floats)?;
        // Their origin is the upper left corner; Steradian's is the lower left one.
        let flipped =
            |uvs: Column| self.used.iter().map(|&i| uvs.floats::<2>(i as usize)).map(|[u, v]| [u, 1.0 - v]).collect();
        self.data.uvs = uvs.map(flipped);
        Ok(())
    }
}

/// Reads the data of a primitive with `count` vertices.
struct PrimitiveReader<'a, 'p> {
    source: GltfSource<'a>,
    path: &'p str,
    primitive: &'p Primitive,
    count: usize,
}

impl<'a> PrimitiveReader<'a, '_> {
    /// An attribute that has an element for each vertex, if the primitive has it.
    fn column(
        &self,
        name: &str,
        semantic: Semantic,
        types: &[Type],
        accessor_use: AccessorUse,
    ) -> Result<Option<Column<'a>>> {
        let Self { source, path, primitive, count } = *self;
        let Some(index) = attribute(primitive, semantic) else { return Ok(None) };
        let place = format!("{path}.attributes.{name}");
        let column = source.column(&place, index, types, accessor_use)?;
        if column.count() != count {
            return Err(
                source.fault(&place, format!("has {} elements, but there are {count} positions", column.count()))
            );
        }
        Ok(Some(column))
    }

    /// The vertices in the order in which they are used.
    fn corners(&self) -> Result<Vec<u32>> {
        let Self { source, path, primitive, count } = *self;
        let path = format!("{path}.indices");
        let Some(index) = primitive.indices else {
            let count =
                u32::try_from(count).map_err(|_| source.fault(&path, "more vertices than 32-bit numbers can name"))?;
            return Ok((0..count).collect());
        };
        let indices = source.column(&path, index, &[Type::Scalar], AccessorUse::Indices)?;
        let corners: Vec<u32> = (0..indices.count()).map(|i| indices.indices::<1>(i)[0]).collect();
        match corners.iter().position(|&i| i as usize >= count) {
            Some(at) => {
                Err(source.fault(&path, format!("index {at} is {}, but there are {count} vertices", corners[at])))
            }
            None => Ok(corners),
        }
    }

    /// Moves vertices and normals by the morph targets.
    fn morph(&self, weights: &[f32], used: &[u32], data: &mut MeshData) -> Result<()> {
        let Self { source, path, primitive, count } = *self;
        let targets = primitive.targets.as_deref().unwrap_or_default();
        for (t, (target, &weight)) in targets.iter().zip(weights).enumerate() {
            if weight == 0.0 {
                continue;
            }
            for (name, index, moved) in [
                ("POSITION", target.positions, Some(&mut data.positions)),
                ("NORMAL", target.normals, data.normals.as_mut()),
            ] {
                let (Some(index), Some(moved)) = (index, moved) else { continue };
                let place = format!("{path}.targets[{t}].{name}");
                let steps = source.column(&place, index, &[Type::Vec3], AccessorUse::Floats)?;
                if steps.count() != count {
                    return Err(source
                        .fault(&place, format!("has {} elements, but there are {count} positions", steps.count())));
                }
                for (value, &i) in moved.iter_mut().zip(used) {
                    let step = steps.floats::<3>(i as usize);
                    *value = std::array::from_fn(|k| value[k] + weight * step[k]);
                }
            }
        }
        Ok(())
    }

    /// Moves vertices and normals to where joints carry them.
    fn skin(&self, joints: &[DAffine3], used: &[u32], data: &mut MeshData) -> Result<()> {
        let Self { source, path, primitive, .. } = *self;
        let mut sets = Vec::new();
        for set in 0.. {
            if attribute(primitive, Semantic::Joints(set)).is_none() {
                break;
            }
            let indices =
                self.column(&format!("JOINTS_{set}"), Semantic::Joints(set), &[Type::Vec4], AccessorUse::Indices)?;
            let weights =
                self.column(&format!("WEIGHTS_{set}"), Semantic::Weights(set), &[Type::Vec4], AccessorUse::Floats)?;
            let (Some(indices), Some(weights)) = (indices, weights) else {
                return Err(source.fault(path, format!("has JOINTS_{set}, but not WEIGHTS_{set}")));
            };
            sets.push((indices, weights));
        }
        for (v, &i) in used.iter().enumerate() {
            let i = i as usize;
            let carried = sets
                .iter()
                .flat_map(|(indices, weights)| indices.indices::<4>(i).into_iter().zip(weights.floats::<4>(i)));
            let carried: Vec<(usize, f64)> =
                carried.map(|(joint, weight)| (joint as usize, f64::from(weight))).collect();
            if let Some((joint, _)) = carried.iter().find(|(joint, weight)| *weight > 0.0 && *joint >= joints.len()) {
                return Err(source.fault(path, format!("vertex {i} hangs on joint {joint} of {}", joints.len())));
            }
            let Some(map) = skins::blend(joints, carried.into_iter()) else { continue };
            let place = |p: [f32; 3]| DVec3::from(p.map(f64::from));
            if let Some(p) = data.positions.get_mut(v) {
                *p = map.transform_point3(place(*p)).as_vec3().to_array();
            }
            if let Some(n) = data.normals.as_mut().and_then(|normals| normals.get_mut(v)) {
                // The cofactors turn normals as the inverse transpose does, and are there for every matrix.
                let m = &map.matrix3;
                let (x, y, z) = (m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
                let n0 = place(*n);
                let turned = (x * n0.x + y * n0.y + z * n0.z) * m.determinant().signum();
                *n = turned.normalize_or_zero().as_vec3().to_array();
            }
        }
        Ok(())
    }
}

/// Triangles from a list of corners; what is left over at its end is no triangle.
fn assemble(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => corners.as_chunks::<3>().0.to_vec(),
        // Every other triangle of a strip is wound the other way round.
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => match corners {
            [first, rest @ ..] => rest.windows(2).map(|w| [*first, w[0], w[1]]).collect(),
            [] => Vec::new(),
        },
        _ => Vec::new(),
    }
}

/// Renumbers corners so that vertices which no triangle uses are left out; the result is what is left of `count`.
fn compact(triangles: &mut [[u32; 3]], count: usize) -> Vec<u32> {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    if used.len() < count {
        for corner in triangles.iter_mut().flatten() {
            *corner = used.partition_point(|i| i < corner) as u32;
        }
    }
    used
}

/// The colour of a vertex, clamped as the format has it.
fn color(colors: &Column, i: usize) -> [f32; 4] {
    let [r, g, b, a] = colors.floats::<4>(i);
    [r, g, b, if colors.width() < 4 { 1.0 } else { a }].map(|c| c.clamp(0.0, 1.0))
}

impl VertexColors {
    fn of(colors: &[[f32; 4]]) -> Self {
        let mut sum = [0.0f64; 4];
        for color in colors {
            sum.iter_mut().zip(color).for_each(|(sum, c)| *sum += f64::from(*c));
        }
        let differ = |k: usize| colors.iter().any(|color| Some(color[k]) != colors.first().map(|first| first[k]));
        Self {
            mean: sum.map(|sum| (sum / colors.len().max(1) as f64) as f32),
            differ: (0..3).any(differ),
            differ_in_alpha: differ(3),
        }
    }
}
