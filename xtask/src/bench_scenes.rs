//! Makes `benches/scenes/meshes`, the meshes of the scenes in `benches/scenes`: a Cornell box, a tessellated sphere, a
//! ground, and `bunny.ply` and `dragon.ply`. The latter two are the scans in `scenes/scans` (`bunny.ply`,
//! `dragon_res2.ply`; see `scenes/get_scans.sh`) if they are there, else generated meshes of as many triangles.
//!
//! `cargo xtask bench_scenes` overwrites them.

use std::f32::consts::{PI, TAU};
use std::fs;

use glam::{Vec3 as V, vec3};
use steradian::internal::assets::read_ply;

use crate::make_meshes::{Mesh, grid, knot, ply};
use crate::{Outcome, root};

pub fn run() -> Outcome {
    let folder = root().join("benches/scenes/meshes");
    fs::create_dir_all(&folder)?;
    let flat = [
        ("floor", quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])),
        ("ceiling", quad([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0])),
        ("back", quad([-1.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0])),
        ("left", quad([-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0])),
        ("right", quad([1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0])),
        ("lamp", quad([-0.25, 1.98, -0.2], [0.5, 0.0, 0.0], [0.0, 0.0, 0.4])),
        ("small_lamp", quad([-0.1, 1.98, -0.1], [0.2, 0.0, 0.0], [0.0, 0.0, 0.2])),
        ("short_box", upright_box(0.6, -17.0, [0.33, 0.37])),
        ("tall_box", upright_box(1.2, 17.0, [-0.33, -0.3])),
        ("ground", quad([-20.0, 0.0, 20.0], [40.0, 0.0, 0.0], [0.0, 0.0, -40.0])),
    ];
    for (name, mesh) in flat {
        fs::write(folder.join(name).with_extension("ply"), ply(&mesh))?;
    }
    fs::write(folder.join("sphere.ply"), ply(&sphere(96, 191)))?;
    for (name, scan, cells) in [("bunny", "bunny", [366, 95]), ("dragon", "dragon_res2", [1125, 90])] {
        let file = root().join("scenes/scans").join(scan).with_extension("ply");
        let (mesh, origin) = if file.is_file() {
            let data = read_ply(&file)?;
            (standing(&data.positions, &data.triangles), "scan")
        } else {
            (grid(cells[0], cells[1], true, knot), "generated; scenes/get_scans.sh fetches the scan")
        };
        println!("{name}.ply: {} triangles ({origin})", mesh.polygons.len());
        fs::write(folder.join(name).with_extension("ply"), ply(&mesh))?;
    }
    Ok(())
}

/// A parallelogram with the normal `u` x `v`.
fn quad(origin: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let [o, u, v] = [origin, u, v].map(V::from);
    Mesh {
        positions: vec![o, o + u, o + u + v, o + v],
        polygons: vec![vec![0, 1, 2], vec![0, 2, 3]],
        ..Mesh::default()
    }
}

/// A box of 0.6 x `height` x 0.6 on the floor, turned about the vertical by `degrees`.
fn upright_box(height: f32, degrees: f32, at: [f32; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    let (sin, cos) = degrees.to_radians().sin_cos();
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            // Counter-clockwise as seen from outside; vertices are not shared between faces.
            let first = mesh.positions.len() as u32;
            for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut corner = [0.0; 3];
                (corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (side, side * s, t);
                let p = V::from(corner) * vec3(0.3, 0.5 * height, 0.3) + 0.5 * height * V::Y;
                mesh.positions.push(vec3(cos * p.x + sin * p.z + at[0], p.y, cos * p.z - sin * p.x + at[1]));
            }
            mesh.polygons.extend([vec![first, first + 1, first + 2], vec![first, first + 2, first + 3]]);
        }
    }
    mesh
}

/// The unit sphere with smooth normals, in `rings` x `slices` cells.
fn sphere(rings: u32, slices: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for ring in 0..=rings {
        let (sin, cos) = (PI * ring as f32 / rings as f32).sin_cos();
        for slice in 0..slices {
            let (s, c) = (TAU * slice as f32 / slices as f32).sin_cos();
            mesh.positions.push(vec3(sin * c, cos, -sin * s));
        }
    }
    mesh.normals.clone_from(&mesh.positions);
    let at = |ring: u32, slice: u32| ring * slices + slice % slices;
    for ring in 0..rings {
        for slice in 0..slices {
            let [a, b, c, d] = [at(ring, slice), at(ring + 1, slice), at(ring + 1, slice + 1), at(ring, slice + 1)];
            // At the poles one side of the cell has no length.
            if ring + 1 < rings {
                mesh.polygons.push(vec![a, b, c]);
            }
            if ring > 0 {
                mesh.polygons.push(vec![a, c, d]);
            }
        }
    }
    mesh
}

/// A scan scaled to the height 1, on y = 0 above the origin, with normals averaged over the faces around each vertex by
/// area.
fn standing(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
    let points = || positions.iter().map(|p| V::from(*p));
    let (low, high) = points().fold((V::MAX, V::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let foot = vec3(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    let positions: Vec<V> = points().map(|p| (p - foot) / (high.y - low.y)).collect();
    let mut normals = vec![V::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        for i in triangle {
            normals[*i as usize] += (b - a).cross(c - a);
        }
    }
    let normals = normals.iter().map(|n| n.try_normalize().unwrap_or(V::Y)).collect();
    Mesh { positions, normals, corners: Vec::new(), polygons: triangles.iter().map(|t| t.to_vec()).collect() }
}
