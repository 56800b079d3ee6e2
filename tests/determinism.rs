//! The same picture bit for bit for any number of threads (also M4 of the catalogue of stability) and any crop; every
//! sample can be replayed.

use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::render::{self, Overrides};

use crate::util::render::{prepare, render_with};

fn scene() -> Value {
    json!({
        "film": { "width": 50, "height": 35 },
        "camera": { "position": [0, 1.2, 4], "look_at": [0, 0.5, 0], "lens": { "radius": 0.05, "focus_distance": 4 } },
        "sampler": { "spp": 7 },
        "materials": {
            "grey": { "type": "diffuse" }, "glass": { "type": "dielectric" },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 }
        },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            { "type": "cube", "material": "gold", "transform": [{ "scale": 0.4 }, { "translate": [0.7, 0.4, -0.3] }] },
            {
                "type": "disk", "emission": { "radiance": [9, 8, 7] },
                "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }]
            }
        ],
        "lights": [{ "type": "environment", "radiance": [0.2, 0.3, 0.4] }]
    })
}

/// Anisotropic materials read the derivatives of the parametrisation, which not every vertex of a block has.
#[test]
fn any_number_of_threads_gives_the_same_bits_with_anisotropic_materials() {
    let mut scene = scene();
    scene["film"] = json!({ "width": 100, "height": 70 });
    scene["materials"]["glass"] = json!({ "type": "conductor", "metal": "gold", "roughness": [0.1, 0.6] });
    scene["materials"]["gold"] = json!({ "type": "diffuse" });
    scene["shapes"][0] = json!({ "type": "cube", "material": "grey", "transform": [{ "scale": [4, 0.1, 4] }] });
    let image = |threads| {
        let overrides = Overrides { threads: Some(threads), ..Overrides::default() };
        render_with(&prepare(&scene, &overrides), AccelKind::EMBREE).image
    };
    let alone = image(1);
    assert!([2, 3, 8].into_iter().all(|threads| image(threads) == alone));
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let whole = render_with(&prepare(&scene(), &Overrides::default()), AccelKind::EMBREE).image;
    let crop = Overrides { crop: Some([13, 9, 22, 11]), ..Overrides::default() };
    let part = render_with(&prepare(&scene(), &crop), AccelKind::EMBREE).image;
    for y in 0..11 {
        for x in 0..22 {
            assert_eq!(part.rgb(x + 13, y + 9).unwrap(), whole.rgb(x + 13, y + 9).unwrap(), "{x} {y}");
        }
    }
}

#[test]
fn a_replayed_sample_is_the_one_in_the_picture() {
    let mut scene = scene();
    scene["film"]["filter"] = json!({ "type": "tent", "samples": "importance" });
    let one = |spp| prepare(&scene, &Overrides { spp: Some(spp), ..Overrides::default() });
    let prepared = one(1);
    let image = render_with(&prepared, AccelKind::EMBREE).image;
    let accel = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1).unwrap();
    for pixel in [[0, 0], [20, 17], [49, 34], [25, 20]] {
        let sample = render::replay(&prepared.scene, &*accel, &prepared.settings, pixel, 0).unwrap();
        assert_eq!(sample.pixel.radiance.to_array(), image.rgb(pixel[0], pixel[1]).unwrap(), "{pixel:?}");
    }
    // Later samples: the sum of the replayed ones is the picture.
    let prepared = one(7);
    let image = render_with(&prepared, AccelKind::EMBREE).image;
    let mean = (0..7)
        .map(|s| {
            f64::from(
                render::replay(&prepared.scene, &*accel, &prepared.settings, [20, 17], s).unwrap().pixel.radiance.g,
            )
        })
        .sum::<f64>()
        / 7.0;
    assert_eq!(image.rgb(20, 17).unwrap()[1], mean as f32);
}

#[test]
fn embree_and_the_oracle_give_the_same_picture() {
    let prepared = prepare(&scene(), &Overrides::default());
    let (a, b) = (render_with(&prepared, AccelKind::EMBREE).image, render_with(&prepared, AccelKind::Linear).image);
    let (mut different, mut total) = (0, 0);
    for y in 0..35 {
        for x in 0..50 {
            let (p, q) = (a.rgb(x, y).unwrap(), b.rgb(x, y).unwrap());
            total += 1;
            different += usize::from(p.iter().zip(&q).any(|(p, q)| (p - q).abs() > 1e-3 * p.abs().max(q.abs())));
        }
    }
    assert!(different * 100 <= total, "{different} of {total} pixels differ");
}

#[test]
fn seeds_give_different_noise() {
    let image = |seed| {
        render_with(&prepare(&scene(), &Overrides { seed: Some(seed), ..Overrides::default() }), AccelKind::EMBREE)
            .image
    };
    assert_ne!(image(1), image(2));
}
