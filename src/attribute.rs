//! Attributes of meshes: a number or a colour for each vertex or each face, by name.
//!
//! Names are those of Mitsuba 3: `vertex_NAME` or `face_NAME`. The colours of vertices are `vertex_color`.

use crate::id::{AttributeId, PrimId};

/// The name of the colours of vertices.
pub const VERTEX_COLOR: &str = "vertex_color";

/// Whether an attribute of this name has a value for each face; for each vertex otherwise. `None` if it is no name of
/// an attribute.
pub fn is_of_faces(name: &str) -> Option<bool> {
    let of = |prefix: &str| name.strip_prefix(prefix).is_some_and(|rest| !rest.is_empty());
    if of("vertex_") { Some(false) } else { of("face_").then_some(true) }
}

/// The values of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum AttributeValues {
    /// A number each.
    Numbers(Vec<f32>),
    /// A linear colour each.
    Colors(Vec<[f32; 3]>),
}

impl AttributeValues {
    /// How many vertices or faces have one.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Colors(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many numbers each is.
    pub fn channels(&self) -> usize {
        match self {
            Self::Numbers(_) => 1,
            Self::Colors(_) => 3,
        }
    }

    /// All numbers, one after another.
    pub fn numbers(&self) -> &[f32] {
        match self {
            Self::Numbers(values) => values,
            Self::Colors(values) => values.as_flattened(),
        }
    }

    /// One of them; a number as a grey.
    ///
    /// # Panics
    /// If there are fewer values.
    #[inline]
    pub fn get(&self, i: usize) -> [f32; 3] {
        match self {
            Self::Numbers(values) => [values[i]; 3],
            Self::Colors(values) => values[i],
        }
    }

    /// Those with these indices; zero for indices beyond the last one.
    #[must_use]
    pub fn gathered(&self, indices: impl Iterator<Item = u32>) -> Self {
        match self {
            Self::Numbers(values) => {
                Self::Numbers(indices.map(|i| values.get(i as usize).copied().unwrap_or_default()).collect())
            }
            Self::Colors(values) => {
                Self::Colors(indices.map(|i| values.get(i as usize).copied().unwrap_or_default()).collect())
            }
        }
    }

    /// Adds those of another part of the mesh.
    pub fn append(&mut self, other: Self) {
        match (&mut *self, other) {
            (Self::Numbers(values), Self::Numbers(mut others)) => values.append(&mut others),
            (Self::Colors(values), Self::Colors(mut others)) => values.append(&mut others),
            (_, other) => {
                *self = Self::Colors(
                    (0..self.len()).map(|i| self.get(i)).chain((0..other.len()).map(|i| other.get(i))).collect(),
                );
            }
        }
    }
}

/// An attribute of a mesh ready to render.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Its name.
    pub id: AttributeId,
    /// Whether it has a value for each face, else for each vertex.
    pub of_faces: bool,
    /// The values.
    pub values: AttributeValues,
}

/// The attributes of a mesh at a point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttributePoint<'a> {
    /// All of the mesh.
    pub attributes: &'a [Attribute],
    /// The triangle.
    pub prim: PrimId,
    /// Its vertices.
    pub corners: [u32; 3],
    /// Their weights, which sum to 1.
    pub weights: [f32; 3],
}

impl AttributePoint<'_> {
    /// The value of an attribute, between those of the vertices or that of the face; `None` if the mesh does not have
    /// it.
    pub fn value(&self, id: AttributeId) -> Option<[f32; 3]> {
        let attribute = self.attributes.iter().find(|attribute| attribute.id == id)?;
        if attribute.of_faces {
            return Some(attribute.values.get(self.prim.index()));
        }
        let [a, b, c] = self.corners.map(|corner| attribute.values.get(corner as usize));
        let [u, v, w] = self.weights;
        Some([0, 1, 2].map(|i| a[i] * u + b[i] * v + c[i] * w))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_between_those_of_vertices_and_are_constant_on_faces() {
        let attributes = [
            Attribute {
                id: AttributeId(4),
                of_faces: false,
                values: AttributeValues::Numbers(vec![0.0, 9.0, 1.0, 2.0]),
            },
            Attribute {
                id: AttributeId(7),
                of_faces: true,
                values: AttributeValues::Colors(vec![[0.0; 3], [0.25, 0.5, 3.0]]),
            },
        ];
        let point =
            AttributePoint { attributes: &attributes, prim: PrimId(1), corners: [0, 2, 3], weights: [0.5, 0.25, 0.25] };
        assert_eq!(point.value(AttributeId(4)), Some([0.75; 3]));
        assert_eq!(point.value(AttributeId(7)), Some([0.25, 0.5, 3.0]));
        assert_eq!(point.value(AttributeId(5)), None);
    }

    #[test]
    fn names_begin_with_what_they_belong_to() {
        let of = ["vertex_color", "face_temp", "vertex_", "color", "Vertex_a"].map(is_of_faces);
        assert_eq!(of, [Some(false), Some(true), None, None, None]);
    }

    #[test]
    fn parts_of_meshes_are_joined_and_gathered() {
        let mut values = AttributeValues::Numbers(vec![1.0, 2.0]);
        values.append(AttributeValues::Numbers(vec![3.0]));
        assert_eq!(values.gathered([2, 0, 5].into_iter()), AttributeValues::Numbers(vec![3.0, 1.0, 0.0]));
        values.append(AttributeValues::Colors(vec![[4.0, 5.0, 6.0]]));
        assert_eq!((values.len(), values.get(2), values.get(3)), (4, [3.0; 3], [4.0, 5.0, 6.0]));
    }
}
