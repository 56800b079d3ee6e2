//! Plants: a tree with leaf cards, a crown and a conifer for the distance.

use std::f32::consts::TAU;

use glam::{Vec3 as V, vec3};
use steradian::internal::math::Rng;

use super::Mesh;

/// Random numbers in single precision, as meshes have it.
pub trait Single {
    /// Uniform in `[low, high)`.
    fn between(&mut self, low: f32, high: f32) -> f32;

    /// Uniform on the unit sphere.
    fn outward(&mut self) -> V;
}

impl Single for Rng {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit_f32()
    }

    fn outward(&mut self) -> V {
        let (y, angle) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let r = (1.0 - y * y).sqrt();
        vec3(r * angle.cos(), y, r * angle.sin())
    }
}

/// A tree about 6 units high with its root at the origin.
#[derive(Default)]
pub struct Tree {
    pub wood: Mesh,
    /// Cards whose uv is the unit square, with the stalk in the middle of the lower edge.
    pub leaves: Mesh,
}

pub fn tree() -> Tree {
    let mut tree = Tree::default();
    let trunk = Branch {
        start: V::new(0.0, -0.2, 0.0),
        direction: vec3(0.08, 1.0, 0.03).normalize(),
        length: 1.7,
        radius: 0.2,
        order: 0,
    };
    grow(&mut tree, &mut Rng::new(11), &trunk);
    tree
}

struct Branch {
    start: V,
    direction: V,
    length: f32,
    radius: f32,
    /// 0 for the trunk.
    order: u32,
}

const LAST_ORDER: u32 = 5;

fn grow(tree: &mut Tree, rng: &mut Rng, branch: &Branch) {
    // A bent tube that tapers towards its children.
    let steps = 4;
    let mut spine = vec![branch.start];
    let mut direction = branch.direction;
    for _ in 0..steps {
        direction = (direction + 0.16 * rng.outward() + vec3(0.0, 0.02, 0.0)).normalize();
        spine.push(*spine.last().unwrap() + direction * (branch.length / steps as f32));
    }
    tube(&mut tree.wood, &spine, branch.radius, 0.72 * branch.radius, (9 - branch.order).max(4));

    if branch.order + 2 > LAST_ORDER {
        let count = if branch.order == LAST_ORDER { 15 } else { 5 };
        for _ in 0..count {
            let at = rng.between(0.2, steps as f32);
            let i = (at as usize).min(steps - 1);
            let point = spine[i].lerp(spine[i + 1], at - i as f32);
            leaf(&mut tree.leaves, rng, point, direction);
        }
    }
    if branch.order == LAST_ORDER {
        return;
    }
    let count = if branch.order == 0 { 4 } else { 3 };
    let turn = rng.between(0.0, TAU);
    let side = direction.any_orthonormal_vector();
    let other = direction.cross(side);
    for k in 0..count {
        let around = turn + TAU * (k as f32 + rng.between(-0.25, 0.25)) / count as f32;
        let spread = if k == 0 && branch.order > 0 { rng.between(0.05, 0.25) } else { rng.between(0.55, 0.95) };
        let outward = side * around.cos() + other * around.sin();
        // Twigs droop a little, boughs rise.
        let lift = if branch.order < 2 { 0.18 } else { -0.06 };
        let child = Branch {
            start: *spine.last().unwrap(),
            direction: (direction * spread.cos() + outward * spread.sin() + vec3(0.0, lift, 0.0)).normalize(),
            length: branch.length * rng.between(0.62, 0.82),
            radius: branch.radius * rng.between(0.52, 0.66),
            order: branch.order + 1,
        };
        grow(tree, rng, &child);
    }
}

fn tube(mesh: &mut Mesh, spine: &[V], first_radius: f32, last_radius: f32, sides: u32) {
    let base = mesh.positions.len() as u32;
    for (i, &center) in spine.iter().enumerate() {
        let along = (spine[(i + 1).min(spine.len() - 1)] - spine[i.saturating_sub(1)]).normalize();
        let side = along.cross(vec3(0.31, 0.05, 0.95)).normalize();
        let other = along.cross(side);
        let radius = first_radius + (last_radius - first_radius) * i as f32 / (spine.len() - 1) as f32;
        for k in 0..sides {
            let angle = TAU * k as f32 / sides as f32;
            mesh.positions.push(center + (side * angle.cos() + other * angle.sin()) * radius);
        }
    }
    for i in 0..spine.len() as u32 - 1 {
        for k in 0..sides {
            let (a, b) = (base + i * sides + k, base + i * sides + (k + 1) % sides);
            mesh.polygons.push(vec![a, b, b + sides, a + sides]);
        }
    }
}

fn leaf(mesh: &mut Mesh, rng: &mut Rng, stalk: V, twig: V) {
    let along = (0.5 * twig + 0.8 * rng.outward() + vec3(0.0, -0.1, 0.0)).normalize();
    let side = along.cross((rng.outward() + vec3(0.0, 1.2, 0.0)).normalize()).normalize() * rng.between(0.085, 0.14);
    let length = along * (2.0 * side.length());
    card(mesh, [stalk - side, stalk + side, stalk + side + length, stalk - side + length]);
}

fn card(mesh: &mut Mesh, points: [V; 4]) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(points);
    mesh.corners.extend([[0, 0], [1, 0], [1, 1], [0, 1]]);
    mesh.polygons.push((base..base + 4).collect());
}

/// The crown of a tree for the distance, about 1 unit high: leaves as small facets, without holes.
pub fn crown() -> Mesh {
    let mut mesh = Mesh::default();
    let mut rng = Rng::new(5);
    for _ in 0..9 {
        let puff = vec3(rng.between(-0.26, 0.26), rng.between(0.4, 0.82), rng.between(-0.26, 0.26));
        let radius = rng.between(0.14, 0.24);
        for _ in 0..75 {
            let outward = rng.outward();
            let point = puff + outward * radius * rng.between(0.75, 1.05) * vec3(1.1, 0.85, 1.1);
            let side = outward.cross(rng.outward()).normalize() * rng.between(0.02, 0.045);
            let up = (outward + 0.6 * rng.outward()).normalize().cross(side);
            facet(&mut mesh, [point - side, point + up, point + side, point - up]);
        }
    }
    tube(&mut mesh, &[vec3(0.0, -0.1, 0.0), vec3(0.01, 0.5, 0.0)], 0.03, 0.02, 5);
    mesh
}

/// A conifer for the distance, about 1 unit high: whorls of drooping branches.
pub fn conifer() -> Mesh {
    let mut mesh = Mesh::default();
    let mut rng = Rng::new(3);
    let whorls = 17;
    for w in 0..whorls {
        let t = w as f32 / whorls as f32;
        let reach = 0.24 * (1.0 - t).powf(0.8) + 0.015;
        let branches = 5 + (7.0 * (1.0 - t)) as i32;
        for b in 0..branches {
            let angle = TAU * (b as f32 + rng.between(-0.35, 0.35)) / branches as f32 + w as f32;
            let outward = vec3(angle.cos(), 0.0, angle.sin());
            let side = vec3(-angle.sin(), 0.0, angle.cos());
            let root = vec3(0.0, 0.14 + 0.84 * t + rng.between(-0.01, 0.01), 0.0);
            let length = reach * rng.between(0.75, 1.1);
            let tip = root + outward * length - V::Y * (0.28 * length);
            // Three blades: the middle one and one to each side.
            for (turn, share) in [(0.0, 1.0), (0.5, 0.72), (-0.5, 0.72)] {
                let end = root.lerp(tip, share) + side * (turn * length * 0.7) - V::Y * (0.1 * length);
                let middle = root.lerp(end, 0.55) + V::Y * (0.06 * length);
                let half = side * (0.13 * length);
                facet(&mut mesh, [root, middle - half, end, middle + half]);
            }
        }
    }
    tube(&mut mesh, &[vec3(0.0, -0.1, 0.0), vec3(0.0, 0.98, 0.0)], 0.022, 0.003, 5);
    mesh
}

fn facet(mesh: &mut Mesh, points: [V; 4]) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(points);
    mesh.polygons.push((base..base + 4).collect());
}
