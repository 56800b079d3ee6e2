//! Scenes of any size, made in memory.

use serde_json::{Value, json};

use super::plan::{Case, Subject};
use crate::assets::{Assets, MeshData};
use crate::desc::{InstanceDesc, ScaleDesc, SceneDesc, TransformDesc, TransformStepDesc};
use crate::import::Imported;
use crate::math::Rng;
use crate::mesh::bumpy_sphere_data;
use steradian::{Error, Result};

/// The name of the mesh that a scene is about.
const MESH: &str = "generated.ply";

/// The scene of a case, as if it had been read from a file.
///
/// # Errors
/// None in practice.
pub(super) fn make(case: &Case) -> Result<Imported> {
    let (mut scene, mesh) = match case.subject {
        Subject::Room => (room(), None),
        Subject::Sphere { triangles } => (on_a_floor(json!([mesh_shape(1.0)])), Some(bumpy_sphere_data(triangles))),
        Subject::Lamps { count } => (below_lamps(count), Some(lamps(count))),
        Subject::Instances { triangles, .. } => (on_a_floor(json!([])), Some(bumpy_sphere_data(triangles))),
    };
    scene["film"] = json!({ "width": case.size[0], "height": case.size[1], "filter": { "type": "box" } });
    scene["sampler"] = json!({ "type": "sobol", "spp": case.spp });
    scene["integrator"] = json!({ "type": "path", "max_depth": case.depth, "roulette": "off" });
    let mut desc: SceneDesc = serde_json::from_value(scene).map_err(|e| Error::Internal(e.to_string()))?;
    if let Subject::Instances { count, .. } = case.subject {
        let object: Value = json!({ "shapes": [mesh_shape(1.0)] });
        desc.objects
            .insert("sphere".into(), serde_json::from_value(object).map_err(|e| Error::Internal(e.to_string()))?);
        desc.instances = instances(count);
    }
    let mut assets = Assets::default();
    assets.meshes.extend(mesh.map(|mesh| (MESH.to_owned(), mesh)));
    Ok(Imported {
        desc,
        assets: assets.into(),
        report: Default::default(),
        files: Default::default(),
        places: Default::default(),
    })
}

fn mesh_shape(scale: f64) -> Value {
    json!({ "type": "mesh", "file": MESH, "material": "grey", "transform": [{ "scale": scale }] })
}

/// Shapes on a floor under a sky, with a lamp.
fn on_a_floor(mut shapes: Value) -> Value {
    if let Some(shapes) = shapes.as_array_mut() {
        shapes.push(json!({
            "type": "quad", "material": "grey", "origin": [-20, -20, -1.2], "edge_u": [40, 0, 0],
            "edge_v": [0, 40, 0]
        }));
        shapes.push(
            json!({ "type": "quad", "material": "grey", "origin": [-1, -2, 4], "edge_u": [0, 1, 0], "edge_v": [1, 0, 0],
                            "emission": { "radiance": [20, 18, 15] } }),
        );
    }
    json!({
        "camera": { "position": [0, -3.4, 1.2], "look_at": [0, 0, -0.1], "up": [0, 0, 1], "vertical_fov_degrees": 40 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.6 } },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [0.5, 0.6, 0.8] }]
    })
}

/// A closed room with a lamp and two boxes, brightly painted: no path ends before its depth.
fn room() -> Value {
    let wall = |material: &str, origin: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]| {
        json!({
            "type": "quad", "material": material, "origin": origin, "edge_u": edge_u, "edge_v": edge_v
        })
    };
    let block = |at: [f64; 3], degrees: f64, size: [f64; 3]| {
        json!({
            "type": "cube", "material": "white",
            "transform": [
                { "scale": size }, { "rotate": { "axis": [0, 1, 0], "degrees": degrees } }, { "translate": at }
            ]
        })
    };
    json!({
        "camera": { "position": [0, 1, 0.98], "look_at": [0, 1, -1], "vertical_fov_degrees": 80 },
        "materials": {
            "white": { "type": "diffuse", "albedo": 0.8 },
            "red": { "type": "diffuse", "albedo": [0.8, 0.1, 0.1] },
            "green": { "type": "diffuse", "albedo": [0.1, 0.8, 0.1] }
        },
        "shapes": [
            wall("white", [-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]),
            wall("white", [-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]),
            wall("white", [-1.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            wall("white", [1.0, 0.0, 1.0], [-2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            wall("red", [-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0]),
            wall("green", [1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]),
            block([-0.35, 0.6, -0.3], 20.0, [0.28, 0.6, 0.28]),
            block([0.35, 0.28, 0.2], -18.0, [0.28, 0.28, 0.28]),
            {
                "type": "quad", "material": "white", "origin": [-0.25, 1.98, -0.25], "edge_u": [0.5, 0, 0],
                "edge_v": [0, 0, 0.5], "emission": { "radiance": [15, 13, 10] }
            }
        ]
    })
}

/// A hilly floor below many lamps, which emit as much light together however many they are.
fn below_lamps(count: usize) -> Value {
    let radiance = 10.0 * lamp_cells(count).pow(2) as f64 / count as f64;
    json!({
        "camera": { "position": [0, -5, 3.5], "look_at": [0, 0, 0], "up": [0, 0, 1], "vertical_fov_degrees": 40 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.6 } },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, -4, 0], "edge_u": [8, 0, 0], "edge_v": [0, 8, 0] },
            { "type": "sphere", "material": "grey", "radius": 0.8, "transform": [{ "translate": [0, 0, 0.8] }] },
            {
                "type": "mesh", "file": MESH, "material": "grey",
                "emission": { "radiance": [radiance, radiance, radiance] }
            }
        ]
    })
}

/// Cells along a side of the square in which the lamps lie.
fn lamp_cells(count: usize) -> usize {
    count.isqrt() + usize::from(!is_square(count))
}

fn is_square(count: usize) -> bool {
    count.isqrt().pow(2) == count
}

/// Triangles that look down, one in each cell of a square of side 4.
fn lamps(count: usize) -> MeshData {
    let cells = lamp_cells(count);
    let side = 4.0 / cells as f32;
    let mut mesh = MeshData::default();
    for i in 0..count {
        let (x, y) = (-2.0 + side * (i % cells) as f32, -2.0 + side * (i / cells) as f32);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[x, y, 2.2], [x, y + 0.4 * side, 2.2], [x + 0.4 * side, y, 2.2]]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Spheres of random size and turn, in a heap that fills the same space however many they are.
fn instances(count: usize) -> Vec<InstanceDesc> {
    let mut rng = Rng::new(1);
    let cells = (1..).find(|n: &usize| n.pow(3) >= count).unwrap_or(1);
    let cell = 2.2 / cells as f64;
    let mut place = |i: usize| {
        let corner = [i % cells, i / cells % cells, i / cells / cells].map(|n| -1.1 + cell * (n as f64 + 0.5));
        let steps = vec![
            TransformStepDesc::Rotate {
                axis: [rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), 1.5],
                degrees: rng.range(0.0, 360.0),
            },
            TransformStepDesc::Scale(ScaleDesc::Uniform(cell * rng.range(0.3, 0.5))),
            TransformStepDesc::Translate(corner),
        ];
        InstanceDesc { object: "sphere".into(), name: None, transform: TransformDesc(steps), motion: Vec::new() }
    };
    (0..count).map(&mut place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_look_down_and_give_off_as_much_light_however_many_they_are() {
        for count in [1, 2, 10, 100, 1000] {
            let mesh = lamps(count);
            assert_eq!(mesh.triangles.len(), count);
            let area: f32 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| crate::math::Vec3::from(mesh.positions[i as usize]));
                    let cross = (b - a).cross(c - a);
                    assert!(cross.z < 0.0);
                    0.5 * cross.length()
                })
                .sum();
            let scene = below_lamps(count);
            let radiance = scene["shapes"][2]["emission"]["radiance"][0].as_f64().unwrap();
            assert!(
                (f64::from(area) * radiance / (10.0 * 16.0 * 0.08) - 1.0).abs() < 1e-4,
                "{count}: {area} {radiance}"
            );
        }
    }
}
