//! Planes without end.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::accel::{AccelKind, build};
use steradian::internal::math::{DVec3, Ray};

use crate::util::folder::Folder;
use crate::util::geometry::Rng;
use crate::util::render::{AssertIs, Estimate, probe, render};

fn scene(shapes: &[Value]) -> Value {
    json!({
        "camera": { "position": [0, 1, 0], "look_at": [0, 1, -1] },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    })
}

#[test]
fn a_plane_is_met_up_to_the_horizon_by_every_accelerator() {
    let ball = json!({ "type": "sphere", "radius": 0.5, "transform": [{ "translate": [0, 0.5, -3] }] });
    let scene = Folder::new().compile(&scene(&[json!({ "type": "plane" }), ball])).unwrap();
    let geometry = &scene.geometry;
    let mut rng = Rng::new(5);
    for (kind, name) in AccelKind::ALL {
        let accel = build(kind, geometry, 1).unwrap();
        for i in 0..2_000 {
            // From steep down to a two-hundredth of a degree, to all sides but the ball's.
            let (down, around) = (10f64.powf(-4.0 * rng.unit()), -0.5 + (std::f64::consts::PI + 1.0) * rng.unit());
            let level = DVec3::new(around.cos(), 0.0, around.sin());
            let towards = |y: f64| Ray::new(DVec3::Y.as_vec3(), (level + y * DVec3::Y).normalize().as_vec3());
            let ray = towards(-down);
            let hit = accel.intersect(&ray).unwrap_or_else(|| panic!("{name}: {down} {around}"));
            let at = geometry.interaction(&ray, &hit).unwrap();
            let direction = ray.direction.as_dvec3();
            let expected = DVec3::Y - direction / direction.y;
            let distance = expected.length();
            assert!(
                (at.p - expected).length() < 1e-9 * distance && at.p.y.abs() < 1e-10,
                "{name} {i}: {} {expected}",
                at.p
            );
            assert!(
                (f64::from(hit.t) - -1.0 / direction.y).abs() < 1e-6 * distance && at.n_g == DVec3::Y.as_vec3(),
                "{name}: {hit:?}"
            );
            // u is +x cross +y, v +y cross u, in units of length.
            let uv = [expected.z, expected.x];
            assert!((0..2).all(|k| (f64::from(at.uv[k]) - uv[k]).abs() < 1e-6 * distance), "{name}: {at:?}");
            // Away from the ball, as flat as it came.
            let onward = (level + 10f64.powf(-5.0 * rng.unit()) * DVec3::Y).normalize().as_vec3();
            assert!(!accel.occluded(&at.spawn(onward)), "{name}: {} {onward}", at.p);
            assert!(accel.intersect(&towards(1e-6)).is_none());
        }
    }
}

#[test]
fn a_plane_reflects_what_falls_on_it() {
    // Under an even sky and a lamp at a height of 2: albedo times (sky + intensity / (pi height²)).
    let mut scene = probe(
        [1.5, 2.5, -1.0],
        [1.0, 0.0, -2.0],
        json!({
            "integrator": { "type": "path", "max_depth": 3 },
            "sampler": { "spp": 128 },
            "materials": { "grey": { "type": "diffuse", "albedo": 0.6 } },
            "shapes": [{ "type": "plane", "material": "grey" }],
            "lights": [
                { "type": "environment", "radiance": [2, 2, 2] },
                { "type": "point", "position": [1, 2, -2], "intensity": [8, 8, 8] }
            ]
        }),
    );
    let expected = 0.6 * (2.0 + 2.0 / std::f64::consts::PI);
    Estimate::of(&render(&scene), 1).assert_is(expected, "from above");
    // The same plane by another point and normal, under a transform that turns its back to the camera.
    scene["shapes"][0] = json!({
        "type": "plane", "material": "grey", "point": [7, -3, 4], "normal": [0, 0, 3],
        "transform": [
            { "translate": [0, 0, -4] }, { "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "scale": [3, 0.5, 2] }
        ]
    });
    Estimate::of(&render(&scene), 1).assert_is(expected, "placed");
}

#[test]
fn what_a_plane_cannot_be_is_refused_with_its_place() {
    let folder = Folder::new();
    let plane = |key: &str, value: Value| {
        let mut plane = json!({ "type": "plane" });
        plane[key] = value;
        scene(&[plane])
    };
    let mut inside = scene(&[json!({ "type": "sphere" })]);
    inside["objects"] = json!({ "o": { "shapes": [{ "type": "plane" }] } });
    inside["instances"] = json!([{ "object": "o" }]);
    for (scene, place, word) in [
        (plane("emission", json!({ "radiance": [1, 1, 1] })), "shapes[0].emission", "use a quad"),
        (plane("motion", json!([{ "time": 0 }])), "shapes[0].motion", "use a quad"),
        (plane("normal", json!([0, 0, 0])), "shapes[0].normal", "zero"),
        (plane("point", json!([1e39, 0, 0])), "shapes[0]", "too large"),
        (inside, "objects.o.shapes[0]", "instances"),
    ] {
        let error = folder.compile(&scene).unwrap_err();
        let message = error.to_string();
        assert!(error.kind() == ErrorKind::Scene && message.contains(place) && message.contains(word), "{message}");
    }
}
