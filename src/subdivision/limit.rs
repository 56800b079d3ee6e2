//! Normals of the limit surface.

use std::f64::consts::{PI, TAU};

use super::Scheme;
use super::edges::{Edges, NONE};
use super::rules::{Net, VertexRule};
use crate::math::DVec3;

/// What is around a point, counter-clockwise: the ends of edges, and what is across each face (with triangles, nothing
/// but the ends).
struct Fan {
    ends: Vec<DVec3>,
    across: Vec<DVec3>,
}

impl Net<'_> {
    /// The unit normal of the limit surface at a vertex of `normals`, a channel in which faces are not connected across
    /// sharp edges; zero where there is none.
    pub fn limit_normal(&self, vertex: u32, corners: &[u32], normals: &Edges, values: &[DVec3]) -> DVec3 {
        let at = values[vertex as usize];
        let normal = match self.rule(vertex) {
            VertexRule::Smooth => {
                let start = self.edges.corners_at(vertex)[0] as usize;
                self.smooth_normal(&self.fan(start, self.edges, values))
            }
            VertexRule::Crease(a, b) => {
                let start = corners.iter().map(|&c| c as usize).find(|&c| normals.twin[c] == NONE);
                let fan = start.map(|start| (start, self.fan(start, normals, values)));
                let is_side = |start: usize, fan: &Fan| {
                    let first = self.vertices[self.faces.next(start)];
                    let end = |v: u32| fan.ends.last() == Some(&values[v as usize]);
                    fan.across.len() == corners.len() && (first == a && end(b) || first == b && end(a))
                };
                match fan {
                    Some((start, fan)) if is_side(start, &fan) => self.crease_normal(at, &fan),
                    _ => self.mean_normal(at, corners, values),
                }
            }
            VertexRule::Corner => self.mean_normal(at, corners, values),
        };
        normal.normalize_or_zero()
    }

    /// The faces around a corner's vertex from the corner on, to a border of `edges` or all around.
    fn fan(&self, start: usize, edges: &Edges, values: &[DVec3]) -> Fan {
        let value = |corner: usize| values[self.vertices[corner] as usize];
        let mut fan = Fan { ends: Vec::new(), across: Vec::new() };
        let mut corner = start;
        loop {
            let next = self.faces.next(corner);
            fan.ends.push(value(next));
            fan.across.push(value(self.faces.next(next)));
            match edges.turn(self.faces, corner) {
                Some(turned) if turned == start => return fan,
                Some(turned) => corner = turned,
                None => {
                    fan.ends.push(value(self.faces.previous(corner)));
                    return fan;
                }
            }
        }
    }

    /// The mean of the planes of the faces at a vertex, for where the surface has no plane of its own.
    fn mean_normal(&self, at: DVec3, corners: &[u32], values: &[DVec3]) -> DVec3 {
        let edge = |corner: usize| values[self.vertices[corner] as usize] - at;
        let of = |&c: &u32| edge(self.faces.next(c as usize)).cross(edge(self.faces.previous(c as usize)));
        corners.iter().map(of).sum()
    }

    fn smooth_normal(&self, fan: &Fan) -> DVec3 {
        let n = fan.ends.len();
        let step = TAU / n as f64;
        // Of an edge between two faces: how much more it counts than what is across them.
        let edge = 1.0 + step.cos() + (0.5 * step).cos() * (2.0 * (9.0 + step.cos())).sqrt();
        let tangent = |wave: fn(f64) -> f64| {
            let term = |i: usize| {
                let (here, next) = (wave(step * i as f64), wave(step * (i + 1) as f64));
                if self.scheme == Scheme::CatmullClark {
                    fan.ends[i] * (edge * here) + fan.across[i] * (here + next)
                } else {
                    fan.ends[i] * here
                }
            };
            (0..n).map(term).sum::<DVec3>()
        };
        tangent(f64::cos).cross(tangent(f64::sin))
    }

    /// On one side of a crease (Biermann, Levin and Zorin, "Piecewise Smooth Subdivision Surfaces with Normal
    /// Control").
    fn crease_normal(&self, at: DVec3, fan: &Fan) -> DVec3 {
        let last = fan.ends.len() - 1;
        let (ends, inner) = (fan.ends[0] + fan.ends[last], 1..last);
        let step = PI / last as f64;
        let wave = |i: usize| (step * i as f64).sin();
        let across = if last == 1 {
            ends - at * 2.0
        } else if self.scheme == Scheme::CatmullClark {
            let ratio = (1.0 + step.cos()) / step.sin();
            let of_edges = inner.map(|i| fan.ends[i] * (4.0 * wave(i))).sum::<DVec3>();
            let of_faces = (0..last).map(|i| fan.across[i] * (wave(i) + wave(i + 1))).sum::<DVec3>();
            at * (4.0 * ratio * (step.cos() - 1.0)) - ends * (ratio * (1.0 + 2.0 * step.cos())) + of_edges + of_faces
        } else {
            match last {
                2 => fan.ends[1] - at,
                3 => (fan.ends[1] + fan.ends[2]) * 2.0 - ends - at * 2.0,
                _ => {
                    let of_edges = inner.map(|i| fan.ends[i] * wave(i)).sum::<DVec3>();
                    of_edges * (2.0 - 2.0 * step.cos()) - ends * step.sin()
                }
            }
        };
        (fan.ends[0] - fan.ends[last]).cross(across)
    }
}
