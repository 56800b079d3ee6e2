//! Meshes to trace: two made here, and scans where they are at hand. Each stands on a floor of two triangles.

use std::f32::consts::TAU;
use std::path::PathBuf;

use steradian::internal::assets::read_ply;
use steradian::internal::geometry::{Geometry, Mesh, Shape};
use steradian::internal::id::ShapeId;
use steradian::internal::math::{Aabb, Vec3};

/// A mesh with its floor, and what of it a camera should frame.
pub struct Model {
    /// Short name.
    pub name: &'static str,
    /// One mesh.
    pub geometry: Geometry,
    /// Bounds without the floor.
    pub frame: Aabb,
}

impl Model {
    fn new(name: &'static str, mut positions: Vec<[f32; 3]>, mut triangles: Vec<[u32; 3]>) -> Self {
        let frame =
            positions.iter().fold(Aabb::EMPTY, |all, p| all.union(&Aabb { min: Vec3::from(*p), max: Vec3::from(*p) }));
        let (center, half, first) = (frame.center(), 5.0 * frame.size().max_element(), positions.len() as u32);
        for (x, z) in [(-half, half), (half, half), (half, -half), (-half, -half)] {
            positions.push([center.x + x, frame.min.y, center.z + z]);
        }
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        let mesh = Mesh::new(positions, triangles, None, None).expect("a valid mesh");
        let geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() };
        Self { name, geometry, frame }
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        match &self.geometry.shapes[0] {
            Shape::Mesh(mesh) => mesh,
            _ => unreachable!("models are meshes"),
        }
    }
}

/// A lumpy body with two ears in 8 `cells`² triangles of about one size, as scans have: an octahedron divided and blown
/// up.
pub fn hare(cells: u32) -> Model {
    let surface = |d: Vec3| {
        let ear = |at: Vec3| 0.7 * (-60.0 * (1.0 - d.dot(at.normalize()))).exp();
        let lumps = 0.08 * (5.0 * d.x + 1.0).sin() * (6.0 * d.y).cos() + 0.03 * (17.0 * d.z).sin() * (15.0 * d.x).cos();
        let fur = 0.004 * (90.0 * d.x).sin() * (80.0 * d.y).sin() * (85.0 * d.z).cos();
        d * (1.0 + lumps + fur + ear(Vec3::new(0.35, 1.0, 0.1)) + ear(Vec3::new(-0.35, 1.0, 0.1)))
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..8 {
        let sign = |bit: u32| if face >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corners = [Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2)];
        let first = positions.len() as u32;
        for i in 0..=cells {
            for j in 0..=cells - i {
                let (s, t) = (i as f32 / cells as f32, j as f32 / cells as f32);
                positions.push(
                    surface((corners[0] * (1.0 - s - t) + corners[1] * s + corners[2] * t).normalize()).to_array(),
                );
            }
        }
        // Rows get shorter by one.
        let at = |i: u32, j: u32| first + i * (cells + 1) - i * i.saturating_sub(1) / 2 + j;
        for i in 0..cells {
            for j in 0..cells - i {
                triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if j + 1 < cells - i {
                    triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    Model::new("hare", positions, triangles)
}

/// Hills of 2 `cells`² triangles over the unit square.
pub fn hills(cells: u32) -> Model {
    let height = |x: f32, z: f32| {
        0.05 * (9.0 * x).sin() * (7.0 * z).cos() + 0.01 * (61.0 * x + 13.0 * z).sin() * (53.0 * z).cos()
    };
    let vertex = |i: u32, j: u32| {
        let (x, z) = (i as f32 / cells as f32, j as f32 / cells as f32);
        [x, height(x, z), z]
    };
    let positions = (0..=cells).flat_map(|j| (0..=cells).map(move |i| vertex(i, j))).collect();
    let at = |i: u32, j: u32| j * (cells + 1) + i;
    let cell =
        |i: u32, j: u32| [[at(i, j), at(i + 1, j + 1), at(i + 1, j)], [at(i, j), at(i, j + 1), at(i + 1, j + 1)]];
    let triangles = (0..cells).flat_map(|j| (0..cells).flat_map(move |i| cell(i, j))).collect();
    Model::new("hills", positions, triangles)
}

/// The scans `bunny.ply` and `dragon_res2.ply`, those of them that are in the folder `STERADIAN_SCANS` (default:
/// `scenes/scans`, which `scenes/get_scans.sh` fills).
pub fn scans() -> Vec<Model> {
    let default = || concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/scans").into();
    let folder: PathBuf = std::env::var_os("STERADIAN_SCANS").map_or_else(default, PathBuf::from);
    let scan = |name: &'static str, file: &str| {
        let data = read_ply(&folder.join(file)).ok();
        if data.is_none() {
            eprintln!("{file} is not in {}: left out", folder.display());
        }
        data.map(|data| Model::new(name, data.positions, data.triangles))
    };
    [("bunny", "bunny.ply"), ("dragon", "dragon_res2.ply")]
        .into_iter()
        .filter_map(|(name, file)| scan(name, file))
        .collect()
}

/// A sphere of 8 `cells`² triangles, radius 1, around the origin, without a floor.
pub fn tessellated_sphere(cells: u32) -> Geometry {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for ring in 0..=2 * cells {
        let (sin, cos) = (0.5 * TAU * ring as f32 / (2 * cells) as f32).sin_cos();
        for slice in 0..2 * cells {
            let (s, c) = (TAU * slice as f32 / (2 * cells) as f32).sin_cos();
            positions.push([sin * c, cos, sin * s]);
        }
    }
    let at = |ring: u32, slice: u32| ring * 2 * cells + slice % (2 * cells);
    for ring in 0..2 * cells {
        for slice in 0..2 * cells {
            let [a, b, c, d] = [at(ring, slice), at(ring, slice + 1), at(ring + 1, slice + 1), at(ring + 1, slice)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mesh = Mesh::new(positions, triangles, None, None).expect("a valid mesh");
    Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() }
}
