//! Scenes pay only for what they use.

use super::{Effort, Faults, Outcome, Value, json, luminance, merge, scene};
use crate::accel::{AccelKind, EmbreeAccel, Registered};
use crate::render::Overrides;
use crate::stability::render::{prepare, render_with};

/// A triangle, at rest and without holes, in the world and in an instance.
fn plain() -> Value {
    let triangle = json!({
        "type": "mesh", "material": "grey", "positions": [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]
    });
    scene(json!({
        "sampler": { "spp": 1 },
        "integrator": { "type": "normal" },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.5 } },
        "shapes": [triangle],
        "objects": { "o": { "shapes": [triangle] } },
        "instances": [{ "object": "o", "transform": [{ "translate": [0, 0, -1] }] }]
    }))
}

/// What a scene makes Embree call back for, and the features it has.
fn registered(scene: &Value) -> (Registered, [bool; 5]) {
    let prepared = prepare(scene, &Overrides::default());
    let features = &prepared.scene.features;
    let used = [features.motion, features.analytic_shapes, features.textures, features.media, features.lens];
    (
        EmbreeAccel::new(&prepared.scene.geometry, 1)
            .map_or_else(|_| Registered::default(), |accel| accel.registered()),
        used,
    )
}

/// Rays of one picture beside those of the camera.
fn rays(scene: &Value) -> [u64; 2] {
    let prepared = prepare(scene, &Overrides { threads: Some(1), ..Overrides::default() });
    let result = render_with(&prepared, AccelKind::EMBREE);
    debug_assert!(!luminance(&result.image).is_empty());
    [result.stats.rays.indirect, result.stats.rays.shadow]
}

pub(super) fn r7_pay_for_use(_: Effort) -> Outcome {
    let (nothing, unused) = registered(&plain());
    let mut registering = Faults::NONE;
    registering.add(nothing.filters + nothing.user_geometries + nothing.entered_instances + nothing.time_steps, || {
        format!("{nothing:?}")
    });
    let mut features = Faults::NONE;
    for (is_used, feature) in unused.into_iter().zip(["motion", "analytic shapes", "textures", "media", "lens"]) {
        features.require(!is_used, || feature.to_owned());
    }

    // Each feature alone registers what it needs, and no other does.
    let path = json!([{ "time": 0 }, { "time": 1, "transform": [{ "translate": [1, 0, 0] }] }]);
    let [mut holes, mut analytic, mut moving, mut deforming] = [plain(), plain(), plain(), plain()];
    holes["shapes"][0]["opacity"] = json!(0.5);
    merge(&mut analytic, json!({ "shapes": [{ "type": "sphere", "material": "grey" }] }));
    moving["instances"][0]["motion"] = path;
    deforming["shapes"][0]["deform_positions"] = json!([[[-1, -1, 1], [1, -1, 1], [0, 1, 1]]]);
    let none = Registered::default();
    let cases = [
        (holes, Registered { filters: 1, ..none }),
        (analytic, Registered { user_geometries: 1, ..none }),
        (moving, Registered { entered_instances: 1, ..none }),
        (deforming, Registered { time_steps: 1, ..none }),
    ];
    let mut other = Faults::NONE;
    for (scene, expected) in &cases {
        let found = registered(scene).0;
        other.require(found == *expected, || format!("{found:?} in place of {expected:?}: {scene}"));
    }

    // By chance alone there are no shadow rays, nor towards an even sky; neither normals nor light that is seen
    // directly need a second ray.
    let normals: u64 = rays(&plain()).iter().sum();
    let mut lit = plain();
    lit["lights"] = json!([{ "type": "environment", "radiance": [1, 1, 1] }]);
    let with = |integrator: Value| {
        let mut scene = lit.clone();
        scene["integrator"] = integrator;
        rays(&scene)
    };
    let by_chance = with(json!({ "type": "path", "strategy": "bsdf" }))[1];
    let direct: u64 = with(json!({ "type": "path", "max_depth": 1 })).iter().sum();
    let by_lights = with(json!({ "type": "path", "strategy": "light" }))[1];
    let both = with(json!({ "type": "path" }));
    let (mut shadow, mut further) = (Faults::NONE, Faults::NONE);
    shadow.add(by_chance as usize, || "by chance alone".into());
    shadow.add(both[1] as usize, || "towards an even sky".into());
    further.add(normals as usize, || "for normals".into());
    further.add(direct as usize, || "at depth 1".into());
    Outcome::new()
        .none("filters, callbacks and time steps of triangles at rest", registering)
        .none("features of such a scene that it does not have", features)
        .none("features that register other than they need", other)
        .none("shadow rays by chance alone, and towards an even sky", shadow)
        .none("rays beside the camera's for normals and at depth 1", further)
        .at_least("rays where they are needed", both[0].min(by_lights) as f64, 1.0)
}
