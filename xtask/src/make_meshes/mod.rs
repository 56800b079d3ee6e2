//! Makes meshes of `scenes/` (a knot of 72,000 triangles and a coarse one of 1,920, a terrain of 131,072, a vase of
//! 320, plants, an island, the beams of a gate), a sky, and the scene `shrine.json`, in which more than a thousand of
//! the plants stand.
//!
//! `cargo xtask make_meshes` overwrites them, byte for byte the same.

mod plants;
mod shrine;

use std::error::Error;
use std::f32::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use exr::prelude::*;
use glam::{Vec3 as V, vec3};

use crate::{Outcome, root};

pub fn run() -> Outcome {
    let scenes = root().join("scenes");
    fs::create_dir_all(scenes.join("meshes"))?;
    fs::create_dir_all(scenes.join("textures"))?;
    fs::write(scenes.join("meshes/knot.ply"), ply(&grid(600, 60, true, knot)))?;
    fs::write(scenes.join("meshes/terrain.ply"), ply(&grid(256, 256, false, terrain)))?;
    let coarse = Mesh { normals: Vec::new(), ..grid(96, 10, true, knot) };
    fs::write(scenes.join("meshes/coarse_knot.ply"), ply(&coarse))?;
    fs::write(scenes.join("meshes/vase.ply"), ply(&grid(8, 20, false, vase)))?;
    let tree = plants::tree();
    fs::write(scenes.join("meshes/tree_wood.ply"), ply(&tree.wood))?;
    fs::write(scenes.join("meshes/tree_leaves.ply"), ply(&tree.leaves))?;
    fs::write(scenes.join("meshes/crown.ply"), ply(&plants::crown()))?;
    fs::write(scenes.join("meshes/conifer.ply"), ply(&plants::conifer()))?;
    fs::write(
        scenes.join("meshes/island.ply"),
        ply(&Mesh { normals: Vec::new(), ..grid(72, 72, false, shrine::island) }),
    )?;
    fs::write(scenes.join("meshes/gate_beam.ply"), ply(&shrine::beam()))?;
    fs::write(scenes.join("shrine.json"), shrine::scene())?;
    write_sky(&scenes.join("textures/sky.exr"))?;
    Ok(())
}

/// A mesh of polygons; `normals` and `corners` are empty or as many as `positions`.
#[derive(Default)]
pub struct Mesh {
    pub positions: Vec<V>,
    pub normals: Vec<V>,
    /// u and v, which are 0 or 1.
    pub corners: Vec<[u8; 2]>,
    pub polygons: Vec<Vec<u32>>,
}

/// A mesh over a grid of `nu` x `nv` cells from a surface over the unit square; a closed one joins its ends in both
/// directions.
pub fn grid(nu: u32, nv: u32, closed: bool, surface: impl Fn(f32, f32) -> V) -> Mesh {
    let (rows, columns) = if closed { (nu, nv) } else { (nu + 1, nv + 1) };
    let mut mesh = Mesh::default();
    for i in 0..rows {
        for j in 0..columns {
            let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
            let h = 1e-3;
            let du = surface(u + h, v) - surface(u - h, v);
            let dv = surface(u, v + h) - surface(u, v - h);
            mesh.positions.push(surface(u, v));
            mesh.normals.push(du.cross(dv).normalize());
        }
    }
    let index = |i: u32, j: u32| i % rows * columns + j % columns;
    for i in 0..nu {
        for j in 0..nv {
            let (a, b, c, d) = (index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
            mesh.polygons.push(vec![a, b, c]);
            mesh.polygons.push(vec![a, c, d]);
        }
    }
    mesh
}

/// A trefoil tube with a spiral groove, about 1 unit high, standing on y = 0.
pub fn knot(u: f32, v: f32) -> V {
    let center = |t: f32| {
        let (a, b) = (2.0 * TAU * t, 3.0 * TAU * t);
        let r = 0.34 + 0.13 * b.cos();
        vec3(r * a.cos(), 0.5 + r * a.sin(), 0.16 * b.sin())
    };
    let h = 1e-3;
    let tangent = (center(u + h) - center(u - h)).normalize();
    let side = tangent.cross(V::Z).normalize();
    let up = side.cross(tangent);
    let angle = TAU * v;
    let groove = 1.0 + 0.12 * (5.0 * angle + 36.0 * TAU * u).sin();
    center(u) + (side * angle.cos() + up * angle.sin()) * (0.075 * groove)
}

/// The vase of `scenes/revolution.json`: its profile of two Bezier curves, turned about y.
fn vase(u: f32, v: f32) -> V {
    const PROFILE: [[f32; 2]; 7] =
        [[0.26, 0.0], [0.62, 0.1], [0.66, 0.6], [0.36, 0.86], [0.2, 1.0], [0.2, 1.16], [0.33, 1.3]];
    let (first, t) = if u < 0.5 { (0, 2.0 * u) } else { (3, 2.0 * u - 1.0) };
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    let at = |axis: usize| (0..4).map(|k| weights[k] * PROFILE[first + k][axis]).sum::<f32>();
    let angle = TAU * v;
    vec3(at(0) * angle.cos(), at(1), at(0) * angle.sin())
}

/// Rolling hills over 20 x 20 units, flat in the middle.
fn terrain(u: f32, v: f32) -> V {
    let (x, z) = (20.0 * (v - 0.5), 20.0 * (u - 0.5));
    let mut height = 0.0;
    let (mut amplitude, mut frequency) = (0.8, 0.35);
    for octave in 0..7 {
        let phase = octave as f32 * 1.7;
        let turned = (x * phase.cos() + z * phase.sin(), z * phase.cos() - x * phase.sin());
        height += amplitude * (turned.0 * frequency + phase).sin() * (turned.1 * frequency + 2.0 * phase).sin();
        amplitude *= 0.5;
        frequency *= 2.03;
    }
    let distance = (x * x + z * z).sqrt();
    let rise = ((distance - 1.5) / 3.0).clamp(0.0, 1.0);
    vec3(x, height * rise * rise * (3.0 - 2.0 * rise), z)
}

/// Binary little-endian PLY.
pub fn ply(mesh: &Mesh) -> Vec<u8> {
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    header += "property float x\nproperty float y\nproperty float z\n";
    if !mesh.normals.is_empty() {
        header += "property float nx\nproperty float ny\nproperty float nz\n";
    }
    if !mesh.corners.is_empty() {
        header += "property uchar u\nproperty uchar v\n";
    }
    header += &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.polygons.len());
    let mut out = header.into_bytes();
    for (i, p) in mesh.positions.iter().enumerate() {
        let n = mesh.normals.get(i).map(V::to_array);
        for x in p.to_array().into_iter().chain(n.into_iter().flatten()) {
            out.extend(x.to_le_bytes());
        }
        out.extend(mesh.corners.get(i).into_iter().flatten());
    }
    for polygon in &mesh.polygons {
        out.push(polygon.len() as u8);
        for i in polygon {
            out.extend(i.to_le_bytes());
        }
    }
    out
}

/// A clear sky as a lat-long image: blue above, pale at the horizon, a glow around a sun at 35 degrees, dark earth
/// below.
fn write_sky(path: &Path) -> std::result::Result<(), Box<dyn Error>> {
    let (width, height) = (512, 256);
    let sun = vec3(-0.55, 0.573_576, 0.607).normalize();
    let texel = |x: usize, y: usize| {
        let (theta, phi) = (PI * (y as f32 + 0.5) / height as f32, TAU * ((x as f32 + 0.5) / width as f32 - 0.5));
        let direction = vec3(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        let up = direction.y;
        let color = if up < 0.0 {
            vec3(0.10, 0.09, 0.08)
        } else {
            let haze = (1.0 - up).powi(5);
            let blue = vec3(0.16, 0.34, 0.80) * (0.55 + 0.45 * up);
            let glow = direction.dot(sun).max(0.0);
            blue * (1.0 - haze)
                + vec3(0.80, 0.86, 0.95) * haze
                + vec3(1.0, 0.85, 0.6) * (0.5 * glow.powi(16) + 6.0 * glow.powi(400))
        };
        let half = f16::from_f32;
        (half(color.x), half(color.y), half(color.z))
    };
    let channels = SpecificChannels::rgb(|p: Vec2<usize>| texel(p.x(), p.y()));
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::FAST_LOSSLESS };
    let layer = Layer::new((width, height), LayerAttributes::default(), encoding, channels);
    // Threads would write its blocks in any order.
    Image::from_layer(layer).write().non_parallel().to_file(path)?;
    Ok(())
}
