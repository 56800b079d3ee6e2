//! The scene `shrine.json`: a gate in a lake between wooded hills, and two meshes that only it needs.

use std::fmt::Write;

use glam::{Vec3 as V, vec3};
use steradian::internal::math::Rng;

use super::plants::Single;
use super::{Mesh, terrain};

/// What the hills of `terrain.ply` are scaled by, and how far their floor lies below the water, which is at y = 0.
const HILLS: [f32; 3] = [20.0, 34.0, 20.0];
const HILLS_AT: [f32; 3] = [12.0, -1.8, 2.0];

/// An island within 1 unit of the axis, about 0.4 units high, which falls below 0 at its shore.
pub fn island(u: f32, v: f32) -> V {
    let (x, z) = (2.2 * (v - 0.5), 2.2 * (u - 0.5));
    let distance = (x * x + z * z).sqrt();
    let shore = 0.8 + 0.12 * (3.0 * x + 1.0).sin() * (2.5 * z + 0.4).cos();
    let mut height = 0.36 * (1.0 - (distance / shore).powi(2)).max(-0.8);
    let (mut amplitude, mut frequency) = (0.03, 5.0);
    for octave in 0..5 {
        let phase = 1.3 * octave as f32;
        let turned = (x * phase.cos() + z * phase.sin(), z * phase.cos() - x * phase.sin());
        height += amplitude * (turned.0 * frequency + phase).sin() * (turned.1 * frequency + 2.0 * phase).sin();
        amplitude *= 0.55;
        frequency *= 1.9;
    }
    vec3(x, height, z)
}

/// The upper beam of the gate, along x: 2 units long, its ends lifted, its section narrower below, closed.
pub fn beam() -> Mesh {
    let mut mesh = Mesh::default();
    let steps = 32;
    for i in 0..=steps {
        let t = 2.0 * i as f32 / steps as f32 - 1.0;
        let lift = 0.075 * t.abs().powf(2.6);
        // The ends lean outward.
        let lean = 0.018 * t.abs().powi(8) * t.signum();
        for (y, z) in [(0.0, -0.05), (0.0, 0.05), (0.1, 0.075), (0.1, -0.075)] {
            mesh.positions.push(vec3(t + lean * y / 0.1, y + lift, z));
        }
    }
    for i in 0..steps {
        for k in 0..4 {
            let (a, b) = (4 * i + k, 4 * i + (k + 1) % 4);
            mesh.polygons.push(vec![a, b, b + 4, a + 4]);
        }
    }
    mesh.polygons.push(vec![3, 2, 1, 0]);
    mesh.polygons.push((4 * steps..4 * steps + 4).collect());
    mesh
}

/// Height of the hills in the world.
fn ground(x: f32, z: f32) -> f32 {
    let u = (z - HILLS_AT[2]) / (20.0 * HILLS[2]) + 0.5;
    let v = (x - HILLS_AT[0]) / (20.0 * HILLS[0]) + 0.5;
    if (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v) {
        terrain(u, v).y * HILLS[1] + HILLS_AT[1]
    } else {
        f32::NEG_INFINITY
    }
}

pub fn scene() -> String {
    include_str!("shrine_template.json").replace("    \"FOREST\"", &forest().join(",\n"))
}

/// Instances of trees on the hills, where the camera or its reflection can see them, no two at the same place.
fn forest() -> Vec<String> {
    let mut rng = Rng::new(21);
    let mut lines = Vec::new();
    let mut places: Vec<V> = Vec::new();
    for _ in 0..60_000 {
        let depth = rng.between(62.0, 250.0);
        let (x, z) = (rng.between(-0.42, 0.42) * (depth + 8.0), 42.0 - depth);
        let y = ground(x, z);
        let spacing = 2.1 + 0.012 * depth;
        let place = vec3(x, y, z);
        if y < 0.7 || places.iter().any(|p| (*p - place).length_squared() < spacing * spacing) {
            continue;
        }
        places.push(place);
        let patch = (0.09 * x + 1.0).sin() * (0.11 * z).cos() + rng.between(-0.5, 0.5);
        let (kind, height) = match patch {
            p if p > 0.75 && y < 14.0 => ("far cherry", rng.between(3.6, 5.2)),
            p if p > 0.1 => ("far broadleaf", rng.between(4.5, 6.5)),
            p if p > -0.15 => ("far maple", rng.between(4.0, 5.5)),
            _ => ("far conifer", rng.between(6.0, 9.5)),
        };
        let mut line = String::new();
        let turn = rng.between(0.0, 360.0).floor();
        let _ = write!(line, "    {{ \"object\": \"{kind}\", \"transform\": [{{ \"scale\": {height:.2} }}, ");
        let _ = write!(line, "{{ \"rotate\": {{ \"axis\": [0, 1, 0], \"degrees\": {turn} }} }}, ");
        let _ = write!(line, "{{ \"translate\": [{x:.2}, {:.2}, {z:.2}] }}] }}", y - 0.1);
        lines.push(line);
    }
    lines
}
