//! Instances look as what they place does.

use serde_json::{Value, json};
use steradian::internal::accel::{AccelKind, BvhOptions, Coherence, HybridOptions, build};
use steradian::internal::film::LayerKind;
use steradian::internal::math::DVec3;

use crate::util::geometry::{Rng, instances, meshes, placed_analytic_shapes, soup, transform};
use crate::util::render::render;
use crate::util::scenes::test_rays;

/// A wavy sheet with normals and uv.
fn sheet() -> Value {
    const SIDE: usize = 8;
    let at = |i: usize| -1.0 + 2.0 * i as f64 / SIDE as f64;
    let vertices = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| [at(i), at(j)]));
    let vertices: Vec<[f64; 2]> = vertices.collect();
    let positions: Vec<_> = vertices.iter().map(|[x, y]| [*x, *y, 0.3 * (3.0 * x).sin() * y]).collect();
    let normals: Vec<_> = vertices
        .iter()
        .map(|[x, y]| DVec3::new(-0.9 * (3.0 * x).cos() * y, -0.3 * (3.0 * x).sin(), 1.0).normalize().to_array())
        .collect();
    let corner = |i: usize, j: usize| j * (SIDE + 1) + i;
    let triangles: Vec<_> = (0..SIDE * SIDE)
        .flat_map(|k| {
            let (i, j) = (k % SIDE, k / SIDE);
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    json!({
        "type": "mesh", "material": "tiles", "positions": positions, "normals": normals, "uvs": vertices,
        "triangles": triangles
    })
}

fn scene(shapes: &Value, more: &Value) -> Value {
    let mut scene = json!({
        "film": { "width": 64, "height": 64, "filter": { "type": "box" } },
        "camera": { "position": [0.5, 1, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 40 },
        "sampler": { "spp": 4 },
        "integrator": { "type": "path", "max_depth": 4, "roulette": "off" },
        "outputs": [{ "file": "unused.exr", "layers": ["P", "N", "Ng", "uv"] }],
        "textures": { "t": { "type": "checker", "color0": [0.8, 0.3, 0.1], "color1": [0.1, 0.2, 0.7] } },
        "materials": { "tiles": { "type": "diffuse", "albedo": { "texture": "t" } } },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "shapes": shapes
    });
    scene.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    scene
}

/// Rounding alone differs: of 4,096 pixels, few have samples at an edge of the mesh or of a tile.
#[test]
fn instanced_meshes_look_as_meshes_in_the_world_do() {
    for transform in [
        json!([{ "scale": 1.2 }, { "rotate": { "axis": [1, 2, 0.5], "degrees": 40 } }, { "translate": [0.2, 0, 0] }]),
        json!([{ "scale": [-1, 1, 1] }, { "rotate": { "axis": [0, 1, 0], "degrees": 200 } }]),
    ] {
        let mut placed = sheet();
        placed["transform"] = transform.clone();
        let in_world = render(&scene(&json!([placed]), &json!({})));
        let object = json!({ "o": { "shapes": [sheet()] } });
        let more = json!({ "objects": object, "instances": [{ "object": "o", "transform": transform }] });
        let instanced = render(&scene(&json!([]), &more));
        for kind in [LayerKind::Color, LayerKind::P, LayerKind::N, LayerKind::Ng, LayerKind::Uv] {
            let (a, b) = (in_world.layer(kind).unwrap(), instanced.layer(kind).unwrap());
            let is_other = |(a, b): &(&[f32], &[f32])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-3);
            let different = a.pixels().zip(b.pixels()).filter(is_other).count();
            assert!(different < 40, "{}: {different}", a.name());
            assert!(a.pixels().any(|p| p[0] != 0.0), "{}: black", a.name());
        }
    }
}

/// Rays go in and out of many instances, some of shapes that are no triangles, on their way.
#[test]
fn batches_through_overlapping_instances_equal_single_rays_bit_for_bit() {
    let mut rng = Rng::new(31);
    let mut shapes = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    shapes.extend(meshes(vec![soup(&mut rng, 500, 0.1)]).shapes);
    let placements: Vec<_> = (0..60).map(|_| transform(rng.rotation() * (0.3 + rng.unit()), rng.cube())).collect();
    let geometry = instances(shapes, &placements);
    let rays = test_rays(&mut rng, &geometry, 4_000);
    for kind in [AccelKind::Bvh(BvhOptions::default()), AccelKind::Hybrid(HybridOptions { bvh: true })] {
        let accel = build(kind, &geometry, 1).unwrap();
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
        accel.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
        let mut count = 0;
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!((hits[i], occluded[i]), (accel.intersect(ray), accel.occluded(ray)), "{kind}: {ray:?}");
            count += usize::from(hits[i].is_some());
        }
        assert!(count > 1_000, "{count}");
    }
}
