//! Faces of several levels to triangles without cracks.

use std::collections::HashMap;

use arrayvec::ArrayVec;

/// Channels at most: points, normals, uv and what is linear.
const MAX_CHANNELS: usize = 4;

/// The numbers of a vertex in all channels.
type Ids = ArrayVec<u32, MAX_CHANNELS>;

/// The side of a face in the coordinates in which it is cut into triangles.
const SIDE: i64 = 1 << 24;

/// Faces that are not refined any more: all of them quadrilaterals or all triangles.
#[derive(Default)]
pub struct Leaves {
    /// The corners of all faces, by channel.
    corners: Vec<Vec<u32>>,
    sources: Vec<u32>,
}

/// The vertices of the result: their numbers in each channel.
#[derive(Default)]
pub struct Vertices {
    ids: Vec<Ids>,
    /// The newest vertex of each point, and of each vertex the one before it.
    newest: Vec<u32>,
    older: Vec<u32>,
}

/// No vertex.
const NONE: u32 = u32::MAX;

/// A vertex at the border of a face: its numbers, and where it is in the face.
#[derive(Clone)]
struct Place {
    ids: Ids,
    at: [i64; 2],
}

impl Vertices {
    /// The number of each vertex in one channel.
    pub fn of_channel(&self, channel: usize) -> Vec<u32> {
        self.ids.iter().map(|ids| ids[channel]).collect()
    }

    fn number(&mut self, ids: &Ids) -> u32 {
        let point = ids[0] as usize;
        if point >= self.newest.len() {
            self.newest.resize(point + 1, NONE);
        }
        let mut vertex = self.newest[point];
        while vertex != NONE {
            if self.ids[vertex as usize] == *ids {
                return vertex;
            }
            vertex = self.older[vertex as usize];
        }
        self.ids.push(ids.clone());
        self.older.push(self.newest[point]);
        self.newest[point] = self.ids.len() as u32 - 1;
        self.newest[point]
    }
}

impl Leaves {
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Adds a face by its corners in each channel.
    pub fn push<'a>(&mut self, source: u32, channels: impl Iterator<Item = &'a [u32]>) {
        for (i, corners) in channels.enumerate() {
            match self.corners.get_mut(i) {
                Some(all) => all.extend(corners),
                None => self.corners.push(corners.to_vec()),
            }
        }
        self.sources.push(source);
    }

    /// The triangles and the face of the cage of each. `splits` has the vertices on edges by their ends, by channel.
    pub fn triangulate(&self, splits: &[&HashMap<[u32; 2], u32>]) -> (Vertices, Vec<[u32; 3]>, Vec<u32>) {
        let (mut vertices, mut triangles, mut sources) = (Vertices::default(), Vec::new(), Vec::new());
        let size = self.corners.first().map_or(0, Vec::len) / self.len().max(1);
        let square = [[0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]];
        let places = if size == 4 { &square[..] } else { &[square[0], square[1], square[3]] };
        let mut border = Vec::new();
        for (face, &source) in self.sources.iter().enumerate() {
            let corner = |i: usize| {
                let ids = self.corners.iter().map(|corners| corners[size * face + i % size]).collect();
                Place { ids, at: places[i % size] }
            };
            border.clear();
            for i in 0..size {
                let (from, to) = (corner(i), corner(i + 1));
                border.push(from.clone());
                split(&from, &to, splits, &mut border);
            }
            let numbers: Vec<u32> = border.iter().map(|place| vertices.number(&place.ids)).collect();
            let before = triangles.len();
            if border.len() == size {
                triangles.extend((2..size).map(|i| [numbers[0], numbers[i - 1], numbers[i]]));
            } else {
                cut(border.iter().map(|place| place.at).zip(numbers).collect(), &mut triangles);
            }
            sources.resize(sources.len() + triangles.len() - before, source);
        }
        (vertices, triangles, sources)
    }
}

/// Adds the vertices that finer faces have on an edge, in order.
fn split(from: &Place, to: &Place, splits: &[&HashMap<[u32; 2], u32>], border: &mut Vec<Place>) {
    let middle = |(channel, splits): (usize, &&HashMap<[u32; 2], u32>)| {
        let (a, b) = (from.ids[channel], to.ids[channel]);
        splits.get(&[a.min(b), a.max(b)]).copied()
    };
    let Some(ids) = splits.iter().enumerate().map(middle).collect::<Option<Ids>>() else { return };
    let middle = Place { ids, at: [0, 1].map(|i| (from.at[i] + to.at[i]) / 2) };
    split(from, &middle, splits, border);
    border.push(middle.clone());
    split(&middle, to, splits, border);
}

/// Cuts a convex polygon with vertices on its sides into triangles with an area, at the shortest diagonals first.
fn cut(mut border: Vec<([i64; 2], u32)>, triangles: &mut Vec<[u32; 3]>) {
    let area = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let mut rest: i64 = (2..border.len()).map(|i| area(border[0].0, border[i - 1].0, border[i].0)).sum();
    while border.len() > 3 {
        let count = border.len();
        let around = |i: usize| [(i + count - 1) % count, i, (i + 1) % count];
        let length = |i: usize| {
            let [(a, _), _, (c, _)] = around(i).map(|i| border[i]);
            (a[0] - c[0]).pow(2) + (a[1] - c[1]).pow(2)
        };
        let of = |i: usize| {
            let [(a, _), (b, _), (c, _)] = around(i).map(|i| border[i]);
            area(a, b, c)
        };
        // A triangulation of all vertices has an ear whose removal leaves an area.
        let ears = (0..count).filter(|&i| of(i) > 0 && of(i) < rest);
        let Some(ear) = ears.min_by_key(|&i| length(i)) else { break };
        rest -= of(ear);
        triangles.push(around(ear).map(|i| border[i].1));
        border.remove(ear);
    }
    if let [(_, a), (_, b), (_, c)] = border[..] {
        triangles.push([a, b, c]);
    }
}
