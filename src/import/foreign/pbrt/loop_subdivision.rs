//! Charles Loop's subdivision of triangle meshes ("Smooth Subdivision Surfaces Based on Triangles"), with vertices
//! moved to the limit surface and its normals at the end.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use crate::assets::MeshData;
use crate::math::DVec3;

/// More triangles than this are not made.
const MAX_TRIANGLES: u64 = 1 << 20;

/// A mesh whose edges belong to one triangle or two, as seen from its vertices.
struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The neighbours of each vertex.
    rings: Vec<Ring>,
}

/// The neighbours of a vertex, in order around it.
struct Ring {
    /// Counter-clockwise; at a boundary from its one edge to the other.
    around: Vec<u32>,
    is_boundary: bool,
}

/// As many of these levels as do not make too many triangles.
pub fn possible_levels(triangles: usize, levels: u32) -> u32 {
    let made = |levels: u32| (triangles as u64).saturating_mul(1 << (2 * levels));
    (0..=levels.min(30)).rev().find(|&levels| made(levels) <= MAX_TRIANGLES).unwrap_or(0)
}

/// Subdivides a mesh, by at most [`possible_levels`]. The error is the reason why it is no surface.
pub fn subdivide(positions: &[[f32; 3]], triangles: &[[u32; 3]], levels: u32) -> Result<MeshData, String> {
    let levels = possible_levels(triangles.len(), levels);
    let positions = positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    let mut surface = Surface::new(positions, triangles.to_vec())?;
    for _ in 0..levels {
        surface = surface.refined()?;
    }
    Ok(surface.limit())
}

impl Surface {
    fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, String> {
        // Of each vertex: the vertex that follows another around it.
        let mut next: Vec<HashMap<u32, u32>> = vec![HashMap::new(); positions.len()];
        for &[a, b, c] in &triangles {
            for [v, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
                let followers = next.get_mut(v as usize).ok_or("an index is not that of a vertex")?;
                if v == from || v == to || from == to || followers.insert(from, to).is_some() {
                    return Err(format!(
                        "the mesh is no surface at vertex {v}: an edge has more than two triangles, or they are wound \
                         differently"
                    ));
                }
            }
        }
        let rings = next.iter().enumerate().map(|(v, followers)| Ring::new(v, followers)).collect::<Result<_, _>>()?;
        Ok(Self { positions, triangles, rings })
    }

    fn refined(&self) -> Result<Self, String> {
        let mut positions: Vec<DVec3> = (0..self.positions.len()).map(|v| self.even(v)).collect();
        let mut opposite: HashMap<[u32; 2], Vec<u32>> = HashMap::with_capacity(3 * self.triangles.len() / 2);
        for &[a, b, c] in &self.triangles {
            for [from, to, across] in [[a, b, c], [b, c, a], [c, a, b]] {
                opposite.entry([from.min(to), from.max(to)]).or_default().push(across);
            }
        }
        let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(opposite.len());
        let mut triangles = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let mut middle = |from: u32, to: u32| {
                let edge = [from.min(to), from.max(to)];
                *middles.entry(edge).or_insert_with(|| {
                    let ends = self.at(from) + self.at(to);
                    let across: &[u32] = opposite.get(&edge).map_or(&[], Vec::as_slice);
                    positions.push(match across {
                        [c, d] => ends * (3.0 / 8.0) + (self.at(*c) + self.at(*d)) / 8.0,
                        _ => ends * 0.5,
                    });
                    (positions.len() - 1) as u32
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Self::new(positions, triangles)
    }

    fn at(&self, vertex: u32) -> DVec3 {
        self.positions.get(vertex as usize).copied().unwrap_or_default()
    }

    /// The weighted mean of a vertex and its neighbours: `1 - n beta` of itself and `beta` of each.
    fn weighted(&self, vertex: usize, beta: impl Fn(usize) -> f64, boundary: f64) -> DVec3 {
        let (p, ring) = (self.positions[vertex], &self.rings[vertex]);
        match ring.around.as_slice() {
            [] => p,
            [first, .., last] if ring.is_boundary => {
                p * (1.0 - 2.0 * boundary) + (self.at(*first) + self.at(*last)) * boundary
            }
            around => {
                let beta = beta(around.len());
                p * (1.0 - around.len() as f64 * beta) + around.iter().map(|&i| self.at(i)).sum::<DVec3>() * beta
            }
        }
    }

    /// Where an old vertex goes.
    fn even(&self, vertex: usize) -> DVec3 {
        self.weighted(vertex, beta, 1.0 / 8.0)
    }

    /// The mesh on the limit surface.
    fn limit(&self) -> MeshData {
        let gamma = |valence: usize| 1.0 / (valence as f64 + 3.0 / (8.0 * beta(valence)));
        let limits: Vec<DVec3> = (0..self.positions.len()).map(|v| self.weighted(v, gamma, 1.0 / 5.0)).collect();
        let on_limit = Self { positions: limits, triangles: Vec::new(), rings: Vec::new() };
        let normals =
            self.rings.iter().enumerate().map(|(v, ring)| on_limit.normal(v, ring).as_vec3().to_array()).collect();
        let positions = on_limit.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        MeshData { positions, triangles: self.triangles.clone(), normals: Some(normals), ..MeshData::default() }
    }

    /// From the tangents of Loop's scheme along and across the ring.
    fn normal(&self, vertex: usize, ring: &Ring) -> DVec3 {
        let (p, n) = (self.positions[vertex], ring.around.len());
        let ring_at = |i: usize| ring.around.get(i).map_or(p, |&v| self.at(v));
        let (s, t) = if !ring.is_boundary {
            let angle = |i: usize| TAU * i as f64 / n as f64;
            let s = (0..n).map(|i| ring_at(i) * angle(i).cos()).sum::<DVec3>();
            (s, (0..n).map(|i| ring_at(i) * angle(i).sin()).sum::<DVec3>())
        } else {
            let s = ring_at(n.saturating_sub(1)) - ring_at(0);
            let t = match n {
                0 | 1 => DVec3::ZERO,
                2 => ring_at(0) + ring_at(1) - 2.0 * p,
                3 => ring_at(1) - p,
                4 => -ring_at(0) + 2.0 * ring_at(1) + 2.0 * ring_at(2) - ring_at(3) - 2.0 * p,
                _ => {
                    let theta = PI / (n - 1) as f64;
                    let ends = (ring_at(0) + ring_at(n - 1)) * theta.sin();
                    let inner = (1..n - 1)
                        .map(|i| ring_at(i) * ((2.0 * theta.cos() - 2.0) * (i as f64 * theta).sin()))
                        .sum::<DVec3>();
                    -(ends + inner)
                }
            };
            // From one edge of the boundary to the other is backward around the inner part.
            (-s, t)
        };
        s.cross(t).normalize_or_zero()
    }
}

impl Ring {
    fn new(vertex: usize, followers: &HashMap<u32, u32>) -> Result<Self, String> {
        let Some((&any, _)) = followers.iter().min() else {
            return Ok(Self { around: Vec::new(), is_boundary: false });
        };
        // A boundary begins with the neighbour that follows no other.
        let targets: std::collections::HashSet<u32> = followers.values().copied().collect();
        let start = followers.keys().copied().filter(|from| !targets.contains(from)).min();
        let mut around = vec![start.unwrap_or(any)];
        while let Some(&to) = around.last().and_then(|last| followers.get(last)) {
            if to == around[0] {
                break;
            }
            if around.len() > followers.len() {
                return Err(format!("the mesh is no surface at vertex {vertex}"));
            }
            around.push(to);
        }
        let is_boundary = start.is_some();
        if around.len() != followers.len() + usize::from(is_boundary) {
            return Err(format!("the mesh is no surface at vertex {vertex}: parts of it meet there in a point"));
        }
        Ok(Self { around, is_boundary })
    }
}

/// The weight of each neighbour of an old vertex (Warren's).
fn beta(valence: usize) -> f64 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f64) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let positions = vec![[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
        let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        (positions, triangles)
    }

    #[test]
    fn a_closed_surface_becomes_round_and_its_normals_point_outward() {
        let (positions, triangles) = octahedron();
        let mesh = subdivide(&positions, &triangles, 3).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (512, 258));
        for (p, n) in mesh.positions.iter().zip(mesh.normals.as_ref().unwrap()) {
            let (p, n) = (DVec3::from(p.map(f64::from)), DVec3::from(n.map(f64::from)));
            assert!(p.normalize().dot(n) > 0.9, "{p} {n}");
        }
        // The limit at a corner of valence 4: gamma = 1 / (4 + 3 / (8 * 3 / 32)) = 1/8, so half of it and nothing of
        // its neighbours.
        let corner = subdivide(&positions, &triangles, 0).unwrap().positions[0];
        assert!((corner[0] - 0.5).abs() < 1e-6 && corner[1].abs() < 1e-6, "{corner:?}");
    }

    #[test]
    fn the_limit_does_not_depend_on_the_level() {
        let (positions, triangles) = octahedron();
        let [a, b] = [0, 2].map(|levels| subdivide(&positions, &triangles, levels).unwrap().positions[4]);
        assert!((a[2] - b[2]).abs() < 1e-6, "{a:?} {b:?}");
    }

    #[test]
    fn an_open_surface_keeps_its_plane_and_its_side() {
        let positions: Vec<[f32; 3]> = (0..9).map(|i| [(i % 3) as f32, (i / 3) as f32, 2.0]).collect();
        let mut triangles = Vec::new();
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let at = |i: u32, j: u32| 3 * j + i;
            triangles.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
        }
        let mesh = subdivide(&positions, &triangles, 2).unwrap();
        assert!(mesh.positions.iter().all(|p| (p[2] - 2.0).abs() < 1e-6));
        for (p, n) in mesh.positions.iter().zip(mesh.normals.as_ref().unwrap()) {
            assert!(n[2] > 0.99, "{p:?} {n:?}");
        }
    }

    #[test]
    fn what_is_no_surface_or_too_much_is_refused() {
        let (positions, triangles) = octahedron();
        assert_eq!([0, 3, 8, 9, u32::MAX].map(|levels| possible_levels(triangles.len(), levels)), [0, 3, 8, 8, 8]);
        assert_eq!(possible_levels(1 << 21, 3), 0);
        assert!(subdivide(&positions, &[[0, 1, 2], [0, 1, 3]], 1).is_err());
        assert!(subdivide(&positions, &[[0, 0, 1]], 1).is_err());
        assert!(subdivide(&positions, &[[0, 1, 9]], 1).is_err());
        // Two triangles that touch in a vertex.
        assert!(subdivide(&positions, &[[0, 1, 2], [0, 3, 4]], 1).is_err());
    }
}
