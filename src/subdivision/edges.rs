//! Which corners of faces share vertices and edges.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// No corner.
pub const NONE: u32 = u32::MAX;

/// Faces as runs of corners.
#[derive(Clone, Debug, Default)]
pub struct Faces {
    /// Where each face begins, and the end of the last.
    pub starts: Vec<u32>,
    /// The face of each corner.
    of: Vec<u32>,
}

impl Faces {
    /// Faces with these numbers of corners.
    pub fn new(sizes: impl Iterator<Item = u32>) -> Self {
        let mut faces = Self { starts: vec![0], of: Vec::new() };
        for (face, size) in sizes.enumerate() {
            faces.of.resize(faces.of.len() + size as usize, face as u32);
            faces.starts.push(faces.of.len() as u32);
        }
        faces
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of corners.
    pub fn corner_count(&self) -> usize {
        self.of.len()
    }

    /// The corners of a face.
    pub fn corners(&self, face: usize) -> std::ops::Range<usize> {
        self.starts[face] as usize..self.starts[face + 1] as usize
    }

    /// The face of a corner.
    pub fn face(&self, corner: usize) -> usize {
        self.of[corner] as usize
    }

    /// The corner that follows in the face.
    pub fn next(&self, corner: usize) -> usize {
        let corners = self.corners(self.face(corner));
        if corner + 1 == corners.end { corners.start } else { corner + 1 }
    }

    /// The corner that precedes in the face.
    pub fn previous(&self, corner: usize) -> usize {
        let corners = self.corners(self.face(corner));
        if corner == corners.start { corners.end - 1 } else { corner - 1 }
    }
}

/// The edges of faces whose corners have certain vertices. An edge is seen from the corner where it begins.
#[derive(Clone, Debug)]
pub struct Edges {
    /// The edge from each corner to the next of its face.
    pub of: Vec<u32>,
    /// One corner of each edge.
    pub first: Vec<u32>,
    /// The corner of the same edge in the other face; [`NONE`] unless the edge has exactly two faces, wound alike.
    pub twin: Vec<u32>,
    /// Whether the edge of each corner has more than one face.
    pub is_shared: Vec<bool>,
    offsets: Vec<u32>,
    around: Vec<u32>,
}

impl Edges {
    /// The edges where the corners of `faces` have these vertices, all below `count`.
    pub fn new(faces: &Faces, vertices: &[u32], count: usize) -> Self {
        let mut offsets = vec![0u32; count + 1];
        for &vertex in vertices {
            offsets[vertex as usize + 1] += 1;
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut free = offsets.clone();
        let mut around = vec![0u32; vertices.len()];
        for (corner, &vertex) in vertices.iter().enumerate() {
            let place = &mut free[vertex as usize];
            around[*place as usize] = corner as u32;
            *place += 1;
        }
        let corners_at = |v: u32| &around[offsets[v as usize] as usize..offsets[v as usize + 1] as usize];
        let look = |corner: usize| {
            let (from, to) = (vertices[corner], vertices[faces.next(corner)]);
            // The end with fewer faces: at the apex of a fan there may be any number.
            let [at, other] = if corners_at(from).len() < corners_at(to).len() { [from, to] } else { [to, from] };
            let (mut first, mut along, mut back, mut opposite) = (corner as u32, 0, 0, NONE);
            for &c in corners_at(at) {
                let previous = faces.previous(c as usize);
                let out = (vertices[faces.next(c as usize)] == other).then_some(c);
                let into = (vertices[previous] == other).then_some(previous as u32);
                for same in [out, into].into_iter().flatten() {
                    first = first.min(same);
                    if vertices[same as usize] == from {
                        along += 1;
                    } else {
                        (back, opposite) = (back + 1, same);
                    }
                }
            }
            let twin = if along == 1 && back == 1 { opposite } else { NONE };
            (first, twin, along + back > 1)
        };
        let found: Vec<(u32, u32, bool)> = (0..vertices.len()).into_par_iter().with_min_len(1024).map(look).collect();
        let (mut of, mut first) = (Vec::with_capacity(vertices.len()), Vec::new());
        for (corner, &(canonical, ..)) in found.iter().enumerate() {
            let edge = if canonical as usize == corner { first.len() as u32 } else { of[canonical as usize] };
            if canonical as usize == corner {
                first.push(canonical);
            }
            of.push(edge);
        }
        let twin = found.iter().map(|&(_, twin, _)| twin).collect();
        let is_shared = found.iter().map(|&(.., is_shared)| is_shared).collect();
        Self { of, first, twin, is_shared, offsets, around }
    }

    /// The corners at a vertex, ascending.
    pub fn corners_at(&self, vertex: u32) -> &[u32] {
        &self.around[self.offsets[vertex as usize] as usize..self.offsets[vertex as usize + 1] as usize]
    }

    /// The vertices that have corners, ascending.
    pub fn vertices(&self) -> Vec<u32> {
        (0..self.offsets.len() as u32 - 1).filter(|&v| !self.corners_at(v).is_empty()).collect()
    }

    /// The corner at the same vertex that follows counter-clockwise.
    pub fn turn(&self, faces: &Faces, corner: usize) -> Option<usize> {
        let twin = self.twin[faces.previous(corner)];
        (twin != NONE).then_some(twin as usize)
    }
}
