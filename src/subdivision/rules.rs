//! Where the vertices, edges and faces of one level go in the next.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::edges::{Edges, Faces, NONE};
use super::{SHARP, Scheme};
use crate::math::DVec3;

/// How the values of a channel change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Positions: borders are creases.
    Smooth,
    /// All borders stay where they are.
    FixedBorder,
    /// Linearly over each face.
    Linear,
}

/// What sharpness makes of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexRule {
    Smooth,
    /// On the crease between these two vertices.
    Crease(u32, u32),
    Corner,
}

/// The faces of a level, with the vertices of one channel, and what is sharp.
#[derive(Clone, Copy)]
pub struct Net<'a> {
    pub scheme: Scheme,
    pub kind: Kind,
    pub faces: &'a Faces,
    /// The vertex of each corner.
    pub vertices: &'a [u32],
    pub edges: &'a Edges,
    /// Points of the corners, and sharpness of their edges that are no borders; of the points.
    pub points: &'a [u32],
    pub edge_sharpness: &'a [f32],
    pub point_sharpness: &'a HashMap<u32, f32>,
}

/// A sharp edge at a vertex.
struct SharpEdge {
    edge: u32,
    end: u32,
    sharpness: f32,
    is_border: bool,
}

impl Net<'_> {
    /// The sharpness of the edge from a corner to the next.
    fn sharpness(&self, corner: usize) -> f32 {
        match self.kind {
            Kind::Linear => f32::INFINITY,
            _ if self.edges.twin[corner] == NONE => f32::INFINITY,
            _ => self.edge_sharpness.get(corner).copied().unwrap_or(0.0),
        }
    }

    fn sharp_edges(&self, vertex: u32) -> Vec<SharpEdge> {
        let mut found: Vec<SharpEdge> = Vec::new();
        for &corner in self.edges.corners_at(vertex) {
            let corner = corner as usize;
            let (next, previous) = (self.faces.next(corner), self.faces.previous(corner));
            for (corner, end) in [(corner, next), (previous, previous)] {
                let (edge, sharpness) = (self.edges.of[corner], self.sharpness(corner));
                if sharpness > 0.0 {
                    let is_border = self.edges.twin[corner] == NONE;
                    found.push(SharpEdge { edge, end: self.vertices[end], sharpness, is_border });
                }
            }
        }
        // Most edges are those of two faces.
        found.sort_unstable_by_key(|sharp| sharp.edge);
        found.dedup_by_key(|sharp| sharp.edge);
        found
    }

    fn point_sharpness(&self, vertex: u32) -> f32 {
        if self.point_sharpness.is_empty() {
            return 0.0;
        }
        let point = self.edges.corners_at(vertex).first().map(|&corner| self.points[corner as usize]);
        point.and_then(|point| self.point_sharpness.get(&point)).copied().unwrap_or(0.0)
    }

    /// The rule for a vertex with these sharp edges after all sharpness has gone down by `less`.
    fn rule_of(&self, vertex: u32, sharp: &[SharpEdge], less: f32) -> VertexRule {
        let is_sharp = |sharpness: f32| sharpness >= SHARP || sharpness > less;
        let borders = sharp.iter().filter(|edge| edge.is_border).count();
        let border_allows = if self.kind == Kind::Smooth { matches!(borders, 0 | 2) } else { borders == 0 };
        if self.kind == Kind::Linear || !border_allows || is_sharp(self.point_sharpness(vertex)) {
            return VertexRule::Corner;
        }
        let mut ends = sharp.iter().filter(|edge| is_sharp(edge.sharpness)).map(|edge| edge.end);
        match (ends.next(), ends.next(), ends.next()) {
            (Some(a), Some(b), None) => VertexRule::Crease(a, b),
            (_, _, Some(_)) => VertexRule::Corner,
            _ => VertexRule::Smooth,
        }
    }

    /// The rule for a vertex.
    pub fn rule(&self, vertex: u32) -> VertexRule {
        if self.kind == Kind::Linear {
            return VertexRule::Corner;
        }
        self.rule_of(vertex, &self.sharp_edges(vertex), 0.0)
    }

    /// The sums over the neighbours of a vertex with a closed ring of faces, and over its faces of a value.
    fn ring(&self, vertex: u32, values: &[DVec3], of_face: impl Fn(usize) -> DVec3) -> (f64, DVec3, DVec3) {
        let corners = self.edges.corners_at(vertex);
        let mut sums = (corners.len() as f64, DVec3::ZERO, DVec3::ZERO);
        for &corner in corners {
            sums.1 += values[self.vertices[self.faces.next(corner as usize)] as usize];
            sums.2 += of_face(corner as usize);
        }
        sums
    }

    fn moved_by(&self, rule: VertexRule, vertex: u32, values: &[DVec3], face_points: &[DVec3]) -> DVec3 {
        let at = values[vertex as usize];
        match rule {
            VertexRule::Corner => at,
            VertexRule::Crease(a, b) => at * 0.75 + (values[a as usize] + values[b as usize]) * 0.125,
            VertexRule::Smooth if self.scheme == Scheme::CatmullClark => {
                let (n, ends, faces) = self.ring(vertex, values, |corner| face_points[self.faces.face(corner)]);
                at * ((n - 2.0) / n) + (ends + faces) / (n * n)
            }
            VertexRule::Smooth => {
                let (n, ends, _) = self.ring(vertex, values, |_| DVec3::ZERO);
                let beta = beta(self.scheme, n);
                at * (1.0 - n * beta) + ends * beta
            }
        }
    }

    /// Where a vertex goes.
    pub fn vertex_point(&self, vertex: u32, values: &[DVec3], face_points: &[DVec3]) -> DVec3 {
        if self.kind == Kind::Linear {
            return values[vertex as usize];
        }
        let sharp = self.sharp_edges(vertex);
        let (rule, later) = (self.rule_of(vertex, &sharp, 0.0), self.rule_of(vertex, &sharp, 1.0));
        let moved = self.moved_by(rule, vertex, values, face_points);
        if rule == later {
            return moved;
        }
        // The mean sharpness of what is smooth in the next level.
        let ending = |sharpness: &f32| *sharpness > 0.0 && *sharpness <= 1.0;
        let of_edges = sharp.iter().map(|edge| edge.sharpness);
        let ending: Vec<f32> = of_edges.chain([self.point_sharpness(vertex)]).filter(ending).collect();
        let weight = f64::from(ending.iter().sum::<f32>()) / ending.len().max(1) as f64;
        moved * weight + self.moved_by(later, vertex, values, face_points) * (1.0 - weight)
    }

    /// The new vertex of an edge.
    pub fn edge_point(&self, edge: usize, values: &[DVec3], face_points: &[DVec3]) -> DVec3 {
        let corner = self.edges.first[edge] as usize;
        let value = |corner: usize| values[self.vertices[corner] as usize];
        let ends = value(corner) + value(self.faces.next(corner));
        let sharpness = f64::from(self.sharpness(corner));
        if sharpness >= 1.0 {
            return ends * 0.5;
        }
        let twin = self.edges.twin[corner] as usize;
        let smooth = if self.scheme == Scheme::CatmullClark {
            (ends + (face_points[self.faces.face(corner)] + face_points[self.faces.face(twin)])) * 0.25
        } else {
            ends * 0.375 + (value(self.faces.previous(corner)) + value(self.faces.previous(twin))) * 0.125
        };
        ends * (0.5 * sharpness) + smooth * (1.0 - sharpness)
    }

    /// The new vertex of a face.
    pub fn face_point(&self, face: usize, values: &[DVec3]) -> DVec3 {
        let corners = self.faces.corners(face);
        let count = corners.len() as f64;
        corners.map(|corner| values[self.vertices[corner] as usize]).sum::<DVec3>() / count
    }

    /// Where a vertex of the level is on the limit surface; all faces around it are quadrilaterals or triangles, as the
    /// scheme makes them (Halstead, Kass and DeRose, "Efficient, Fair Interpolation Using Catmull-Clark Surfaces").
    pub fn limit_point(&self, vertex: u32, values: &[DVec3]) -> DVec3 {
        let at = values[vertex as usize];
        match self.rule(vertex) {
            VertexRule::Corner => at,
            VertexRule::Crease(a, b) => (at * 4.0 + (values[a as usize] + values[b as usize])) / 6.0,
            VertexRule::Smooth if self.scheme == Scheme::CatmullClark => {
                let across = |corner: usize| {
                    let corner = self.faces.next(self.faces.next(corner));
                    values[self.vertices[corner] as usize]
                };
                let (n, ends, across) = self.ring(vertex, values, across);
                (at * (n * n) + ends * 4.0 + across) / (n * (n + 5.0))
            }
            VertexRule::Smooth => {
                let (n, ends, _) = self.ring(vertex, values, |_| DVec3::ZERO);
                let weight = 1.0 / (n + 3.0 / (8.0 * beta(self.scheme, n)));
                at * (1.0 - n * weight) + ends * weight
            }
        }
    }
}

/// The weight of each neighbour of a vertex in Loop's scheme.
fn beta(scheme: Scheme, valence: f64) -> f64 {
    match scheme {
        Scheme::LoopWarren if valence == 3.0 => 3.0 / 16.0,
        Scheme::LoopWarren => 3.0 / (8.0 * valence),
        _ => (5.0 / 8.0 - (3.0 / 8.0 + (TAU / valence).cos() / 4.0).powi(2)) / valence,
    }
}
