//! A surface while it is refined.

use std::collections::HashMap;

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::edges::{Edges, Faces, NONE};
use super::rules::{Kind, Net};
use super::stitch::Leaves;
use super::{Cage, Refined, Refinement, SHARP, Scheme, UvRule};
use crate::math::DVec3;

/// Items that a thread takes at least.
const AT_ONCE: usize = 512;

/// The channel of points, which all else refers to.
const POINTS: usize = 0;

/// One way to connect the faces: corners with the same vertex share what belongs to it.
struct Channel {
    /// The vertex of each corner.
    corners: Vec<u32>,
    /// Vertices of all levels.
    count: u32,
    /// Vertices on edges by the ends of these, for faces beside finer ones.
    splits: HashMap<[u32; 2], u32>,
}

/// Values of the vertices of a channel.
struct Layer {
    channel: usize,
    kind: Kind,
    values: Vec<DVec3>,
}

/// Faces of one level and all vertices of levels so far. A vertex keeps its number from level to level.
pub struct RefinedSurface {
    scheme: Scheme,
    is_adaptive: bool,
    faces: Faces,
    /// The face of the cage that each face is a part of.
    sources: Vec<u32>,
    /// Whether each face is a part of the result; the others are around those.
    is_real: Vec<bool>,
    channels: Vec<Channel>,
    /// The channel of normals: points, cut along what stays sharp.
    smooth: usize,
    /// Positions at each time, then what else there is.
    layers: Vec<Layer>,
    times: usize,
    has_uvs: bool,
    creases: HashMap<[u32; 2], f32>,
    corners: HashMap<u32, f32>,
    /// Layers on the limit surface, and its normals at each time.
    limits: Vec<Vec<DVec3>>,
    normals: Vec<Vec<DVec3>>,
    leaves: Leaves,
    is_cut_short: bool,
    irregular_edges: usize,
}

/// Numbers for the distinct vertices of a channel that another channel has already, if the two connect faces alike.
fn shared_channel(channels: &mut Vec<Channel>, corners: Vec<u32>) -> usize {
    let alike = |channel: &Channel| {
        let mut forth = HashMap::new();
        let mut back = HashMap::new();
        let mut pairs = channel.corners.iter().zip(&corners);
        pairs.all(|(&a, &b)| *forth.entry(a).or_insert(b) == b && *back.entry(b).or_insert(a) == a)
    };
    if let Some(known) = channels.iter().position(alike) {
        return known;
    }
    let count = corners.iter().max().map_or(0, |&last| last + 1);
    channels.push(Channel { corners, count, splits: HashMap::new() });
    channels.len() - 1
}

/// Values of the vertices that corners have in one channel, by those that they have in another.
fn moved_values(from: &[u32], values: &[DVec3], to: &Channel) -> Vec<DVec3> {
    let mut moved = vec![DVec3::ZERO; to.count as usize];
    for (&old, &new) in from.iter().zip(&to.corners) {
        moved[new as usize] = values[old as usize];
    }
    moved
}

impl RefinedSurface {
    /// The cage itself.
    pub fn new(cage: Cage, how: &Refinement) -> Self {
        let faces = Faces::new(cage.sizes.iter().copied());
        let count = cage.positions.first().map_or(0, Vec::len) as u32;
        let points = Channel { corners: cage.points, count, splits: HashMap::new() };
        let mut surface = Self {
            scheme: how.scheme,
            is_adaptive: how.is_too_long.is_some(),
            sources: (0..faces.len() as u32).collect(),
            is_real: vec![true; faces.len()],
            channels: vec![points],
            smooth: POINTS,
            times: cage.positions.len(),
            layers: cage
                .positions
                .into_iter()
                .map(|values| Layer { channel: POINTS, kind: Kind::Smooth, values })
                .collect(),
            has_uvs: cage.uvs.is_some(),
            creases: cage.creases,
            corners: cage.corners,
            limits: Vec::new(),
            normals: Vec::new(),
            leaves: Leaves::default(),
            is_cut_short: false,
            irregular_edges: 0,
            faces,
        };
        surface.cut(cage.sharp_border_corners);
        if let Some(uvs) = cage.uvs {
            surface.add_uvs(&cage.vertices, &uvs, how.uv_rule);
        }
        for values in cage.linear {
            let channel = shared_channel(&mut surface.channels, cage.vertices.clone());
            let values = moved_values(&cage.vertices, &values, &surface.channels[channel]);
            surface.layers.push(Layer { channel, kind: Kind::Linear, values });
        }
        surface
    }

    /// Vertices with the same point and the same uv are one in the channel of uv.
    fn add_uvs(&mut self, vertices: &[u32], uvs: &[DVec3], rule: UvRule) {
        let points = &self.channels[POINTS].corners;
        let mut known = HashMap::new();
        let mut corners = Vec::with_capacity(points.len());
        for (&point, &vertex) in points.iter().zip(vertices) {
            let uv = uvs[vertex as usize];
            let count = known.len() as u32;
            // Adding zero makes a negative zero positive.
            corners.push(*known.entry((point, [uv.x, uv.y].map(|x| (x + 0.0).to_bits()))).or_insert(count));
        }
        let channel = shared_channel(&mut self.channels, corners);
        let values = moved_values(vertices, uvs, &self.channels[channel]);
        let kind = if rule == UvRule::Linear { Kind::Linear } else { Kind::FixedBorder };
        self.layers.push(Layer { channel, kind, values });
    }

    /// Finds the channel of normals, and the points that are no surface or, at will, at borders with one face.
    fn cut(&mut self, sharp_border_corners: bool) {
        let edges = Edges::new(&self.faces, &self.channels[POINTS].corners, self.channels[POINTS].count as usize);
        self.irregular_edges =
            edges.first.iter().filter(|&&c| edges.twin[c as usize] == NONE && edges.is_shared[c as usize]).count();
        let sharpness = self.edge_sharpness();
        let is_cut = |corner: usize| {
            edges.twin[corner] == NONE || sharpness.get(corner).is_some_and(|&sharpness| sharpness >= SHARP)
        };
        let (mut fans, mut count) = (vec![NONE; self.faces.corner_count()], 0);
        for first in 0..fans.len() {
            let mut open = vec![first];
            if fans[first] != NONE {
                continue;
            }
            while let Some(corner) = open.pop() {
                if std::mem::replace(&mut fans[corner], count) == count {
                    continue;
                }
                if !is_cut(corner) {
                    open.push(self.faces.next(edges.twin[corner] as usize));
                }
                if !is_cut(self.faces.previous(corner)) {
                    open.extend(edges.turn(&self.faces, corner));
                }
            }
            count += 1;
        }
        for point in edges.vertices() {
            let around = edges.corners_at(point).iter().map(|&corner| corner as usize);
            let mut at_border =
                around.clone().map(|c| edges.twin[c] == NONE || edges.twin[self.faces.previous(c)] == NONE);
            let first = fans[edges.corners_at(point)[0] as usize];
            let is_split = around.clone().any(|corner| fans[corner] != first);
            let is_cut_off = is_split && !around.clone().any(|c| is_cut(c) || is_cut(self.faces.previous(c)));
            let is_border_corner = sharp_border_corners && around.len() == 1 && at_border.any(|border| border);
            if is_cut_off || is_border_corner {
                self.corners.insert(point, f32::INFINITY);
            }
        }
        self.smooth = shared_channel(&mut self.channels, fans);
    }

    /// The edges of every channel.
    pub fn edges(&self) -> Vec<Edges> {
        let of = |channel: &Channel| Edges::new(&self.faces, &channel.corners, channel.count as usize);
        self.channels.iter().map(of).collect()
    }

    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// The sharpness of the edge from each corner; empty without creases.
    fn edge_sharpness(&self) -> Vec<f32> {
        if self.creases.is_empty() {
            return Vec::new();
        }
        let points = &self.channels[POINTS].corners;
        let of = |corner: usize| {
            let (a, b) = (points[corner], points[self.faces.next(corner)]);
            self.creases.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0.0)
        };
        (0..points.len()).map(of).collect()
    }

    fn net<'a>(&'a self, layer: &Layer, edges: &'a [Edges], edge_sharpness: &'a [f32]) -> Net<'a> {
        Net {
            scheme: self.scheme,
            kind: layer.kind,
            faces: &self.faces,
            vertices: &self.channels[layer.channel].corners,
            edges: &edges[layer.channel],
            points: &self.channels[POINTS].corners,
            edge_sharpness,
            point_sharpness: &self.corners,
        }
    }

    /// Finds positions and normals on the limit surface for all vertices of faces that are parts of the result.
    pub fn find_limit(&mut self, edges: &[Edges]) {
        let (points, smooth) = (&self.channels[POINTS], &self.channels[self.smooth]);
        let mut is_seen = vec![false; points.count as usize];
        for face in (0..self.faces.len()).filter(|&face| self.is_real[face]) {
            self.faces.corners(face).for_each(|corner| is_seen[points.corners[corner] as usize] = true);
        }
        let normals = &edges[self.smooth];
        let point_of = |vertex: u32| points.corners[normals.corners_at(vertex)[0] as usize];
        let fans: Vec<u32> =
            normals.vertices().into_iter().filter(|&vertex| is_seen[point_of(vertex) as usize]).collect();
        let sharpness = self.edge_sharpness();
        let layers = self.layers.len();
        let places_of = |layer: &Layer| {
            let (net, channel) = (self.net(layer, edges, &sharpness), &edges[layer.channel]);
            let point_of = |vertex: u32| points.corners[channel.corners_at(vertex)[0] as usize];
            let which: Vec<u32> = channel.vertices().into_iter().filter(|&v| is_seen[point_of(v) as usize]).collect();
            let place = |&vertex: &u32| net.limit_point(vertex, &layer.values);
            let values: Vec<DVec3> = which.par_iter().with_min_len(AT_ONCE).map(place).collect();
            (which, values)
        };
        let places: Vec<(Vec<u32>, Vec<DVec3>)> = self.layers.iter().map(places_of).collect();
        let turns_of = |layer: &Layer| {
            let net = self.net(layer, edges, &sharpness);
            let turn = |&v: &u32| net.limit_normal(point_of(v), normals.corners_at(v), normals, &layer.values);
            fans.par_iter().with_min_len(AT_ONCE).map(turn).collect()
        };
        let turns: Vec<Vec<DVec3>> = self.layers[..self.times].iter().map(turns_of).collect();
        let count = smooth.count as usize;
        self.limits.resize(layers, Vec::new());
        self.normals.resize(self.times, Vec::new());
        for (i, (which, values)) in places.into_iter().enumerate() {
            let count = self.channels[self.layers[i].channel].count as usize;
            put(&mut self.limits[i], count, &which, values);
        }
        for (i, values) in turns.into_iter().enumerate() {
            put(&mut self.normals[i], count, &fans, values);
        }
    }

    /// The faces to refine: of the result, those with an edge that is too long; all without a limit.
    pub fn too_long(&self, is_too_long: Option<&(dyn Fn(DVec3, DVec3) -> bool + Sync)>) -> Vec<bool> {
        let Some(is_too_long) = is_too_long else { return self.is_real.clone() };
        let (points, limits) = (&self.channels[POINTS].corners, &self.limits[0]);
        let at = |corner: usize| limits[points[corner] as usize];
        let of = |face: usize| {
            self.is_real[face]
                && self.faces.corners(face).any(|corner| is_too_long(at(corner), at(self.faces.next(corner))))
        };
        (0..self.faces.len()).into_par_iter().with_min_len(AT_ONCE).map(of).collect()
    }

    /// Keeps the faces that are not chosen for refinement. Whether none are left to be refined, because none is chosen
    /// or there would be too many triangles.
    pub fn emit(&mut self, chosen: &[bool], max_triangles: u64) -> bool {
        let count = chosen.iter().filter(|&&chosen| chosen).count() as u64;
        let per_face = if self.scheme == Scheme::CatmullClark { 2 } else { 1 };
        let kept = self.leaves.len() as u64 + self.is_real.iter().filter(|&&real| real).count() as u64 - count;
        let is_cut_short = self.is_adaptive && count > 0 && per_face * (kept + 4 * count) > max_triangles;
        self.is_cut_short |= is_cut_short;
        let is_end = count == 0 || is_cut_short;
        for (face, &is_real) in self.is_real.iter().enumerate() {
            if is_real && (is_end || !chosen[face]) {
                let range = self.faces.corners(face);
                self.leaves
                    .push(self.sources[face], self.channels.iter().map(|channel| &channel.corners[range.clone()]));
            }
        }
        is_end
    }

    /// The faces that are chosen and those around them, refined once.
    pub fn refined(mut self, chosen: &[bool], edges: Vec<Edges>) -> Self {
        let points = &self.channels[POINTS];
        let mut is_near = vec![false; points.count as usize];
        let of = |face: usize| self.faces.corners(face).map(|corner| points.corners[corner] as usize);
        for face in (0..self.faces.len()).filter(|&face| chosen[face]) {
            of(face).for_each(|point| is_near[point] = true);
        }
        let kept: Vec<usize> = (0..self.faces.len()).filter(|&face| of(face).any(|point| is_near[point])).collect();
        let edges = if kept.len() == self.faces.len() {
            self.is_real = chosen.to_vec();
            edges
        } else {
            self.keep(&kept, chosen);
            self.edges()
        };
        let sharpness = self.edge_sharpness();
        let layers: Vec<Layer> =
            self.layers.iter().map(|layer| self.refined_layer(layer, &edges, &sharpness)).collect();
        self.layers = layers;
        self.refine_creases(&edges[POINTS]);
        self.connect(&edges);
        self
    }

    /// Keeps some faces only; of the result are those that are `chosen`.
    fn keep(&mut self, kept: &[usize], chosen: &[bool]) {
        for channel in &mut self.channels {
            channel.corners =
                kept.iter().flat_map(|&face| &channel.corners[self.faces.corners(face)]).copied().collect();
        }
        self.sources = kept.iter().map(|&face| self.sources[face]).collect();
        self.is_real = kept.iter().map(|&face| chosen[face]).collect();
        self.faces = Faces::new(kept.iter().map(|&face| self.faces.corners(face).len() as u32));
    }

    fn refined_layer(&self, layer: &Layer, edges: &[Edges], sharpness: &[f32]) -> Layer {
        let (net, old) = (self.net(layer, edges, sharpness), &layer.values);
        let own = &edges[layer.channel];
        let face_points: Vec<DVec3> = if self.scheme == Scheme::CatmullClark {
            let of = |face| net.face_point(face, old);
            (0..self.faces.len()).into_par_iter().with_min_len(AT_ONCE).map(of).collect()
        } else {
            Vec::new()
        };
        let of_edge = |edge| net.edge_point(edge, old, &face_points);
        let edge_points: Vec<DVec3> = (0..own.first.len()).into_par_iter().with_min_len(AT_ONCE).map(of_edge).collect();
        let vertices = own.vertices();
        let of_vertex = |&vertex: &u32| net.vertex_point(vertex, old, &face_points);
        let moved: Vec<DVec3> = vertices.par_iter().with_min_len(AT_ONCE).map(of_vertex).collect();
        let mut values = old.clone();
        vertices.iter().zip(moved).for_each(|(&vertex, value)| values[vertex as usize] = value);
        values.extend(edge_points);
        values.extend(face_points);
        Layer { channel: layer.channel, kind: layer.kind, values }
    }

    /// Sharpness in the next level.
    fn refine_creases(&mut self, edges: &Edges) {
        let next = |sharpness: f32| if sharpness >= SHARP { sharpness } else { sharpness - 1.0 };
        let points = &self.channels[POINTS];
        let mut creases = HashMap::new();
        for (edge, &corner) in edges.first.iter().enumerate().filter(|_| !self.creases.is_empty()) {
            let ends = [corner as usize, self.faces.next(corner as usize)].map(|corner| points.corners[corner]);
            let sharpness = self.creases.get(&[ends[0].min(ends[1]), ends[0].max(ends[1])]).map(|&s| next(s));
            if let Some(sharpness) = sharpness.filter(|&sharpness| sharpness > 0.0) {
                let middle = points.count + edge as u32;
                creases.extend(ends.map(|end| ([end, middle], sharpness)));
            }
        }
        self.creases = creases;
        self.corners.retain(|_, sharpness| {
            *sharpness = next(*sharpness);
            *sharpness > 0.0
        });
    }

    /// Replaces the faces by those of the next level.
    fn connect(&mut self, edges: &[Edges]) {
        let is_quads = self.scheme == Scheme::CatmullClark;
        let split = self.split_edges(&edges[POINTS]);
        for (channel, edges) in self.channels.iter_mut().zip(edges) {
            let (first_edge, first_face) = (channel.count, channel.count + edges.first.len() as u32);
            let middle = |corner: usize| first_edge + edges.of[corner];
            let mut corners = Vec::with_capacity(4 * channel.corners.len());
            for face in 0..self.faces.len() {
                let range = self.faces.corners(face);
                if is_quads {
                    for corner in range {
                        let before = middle(self.faces.previous(corner));
                        corners.extend([channel.corners[corner], middle(corner), first_face + face as u32, before]);
                    }
                } else {
                    let [a, b, c] = [0, 1, 2].map(|i| channel.corners[range.start + i]);
                    let [ab, bc, ca] = [0, 1, 2].map(|i| middle(range.start + i));
                    corners.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
                }
            }
            for corner in (0..split.len()).filter(|&corner| split[corner]) {
                let ends = [corner, self.faces.next(corner)].map(|corner| channel.corners[corner]);
                channel.splits.insert([ends[0].min(ends[1]), ends[0].max(ends[1])], middle(corner));
            }
            channel.count = first_face + if is_quads { self.faces.len() as u32 } else { 0 };
            channel.corners = corners;
        }
        let parts = |face: usize| if is_quads { self.faces.corners(face).len() } else { 4 };
        let parents: Vec<usize> =
            (0..self.faces.len()).flat_map(|face| std::iter::repeat_n(face, parts(face))).collect();
        self.sources = parents.iter().map(|&face| self.sources[face]).collect();
        self.is_real = parents.iter().map(|&face| self.is_real[face]).collect();
        self.faces = Faces::new(std::iter::repeat_n(if is_quads { 4 } else { 3 }, parents.len()));
    }

    /// The corners at edges of faces of the result, where other faces may remain coarse; none where all are refined.
    fn split_edges(&self, edges: &Edges) -> Vec<bool> {
        if !self.is_adaptive {
            return Vec::new();
        }
        let mut is_split = vec![false; edges.first.len()];
        for face in (0..self.faces.len()).filter(|&face| self.is_real[face]) {
            self.faces.corners(face).for_each(|corner| is_split[edges.of[corner] as usize] = true);
        }
        edges.of.iter().map(|&edge| is_split[edge as usize]).collect()
    }

    /// The faces that were kept, as triangles.
    pub fn finish(self) -> Refined {
        let splits: Vec<&HashMap<[u32; 2], u32>> = self.channels.iter().map(|channel| &channel.splits).collect();
        let (vertices, triangles, faces) = self.leaves.triangulate(&splits);
        let [points, smooth] = [POINTS, self.smooth].map(|channel| vertices.of_channel(channel));
        let gather = |values: &[DVec3], ids: &[u32]| -> Vec<[f32; 3]> {
            ids.iter().map(|&id| values[id as usize].as_vec3().to_array()).collect()
        };
        let placed: Vec<Vec<[f32; 3]>> = self
            .layers
            .iter()
            .zip(&self.limits)
            .map(|(layer, values)| gather(values, &vertices.of_channel(layer.channel)))
            .collect();
        let mut placed = placed.into_iter();
        let positions = placed.by_ref().take(self.times).collect();
        let uvs = if self.has_uvs { placed.next() } else { None };
        Refined {
            positions,
            normals: self.normals.iter().map(|values| gather(values, &smooth)).collect(),
            uvs: uvs.map(|uvs| uvs.into_iter().map(|[u, v, _]| [u, v]).collect()),
            linear: placed.collect(),
            triangles,
            faces,
            points,
            smooth,
            is_cut_short: self.is_cut_short,
            irregular_edges: self.irregular_edges,
        }
    }
}

/// Puts values in their places of a list of this length.
fn put(list: &mut Vec<DVec3>, count: usize, places: &[u32], values: Vec<DVec3>) {
    list.resize(count, DVec3::ZERO);
    places.iter().zip(values).for_each(|(&place, value)| list[place as usize] = value);
}
