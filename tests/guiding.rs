//! Guided paths: the same picture, and the same bits for any number of threads.

use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use steradian::Error;
use steradian::desc::AutoDesc;
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::math::Rng;
use steradian::internal::render::{self, Overrides, RenderResult, RenderState, Shard, Silent, StateFile};

use crate::checkpoints::{self, Kit, StopAfter, bits};
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

fn quad(material: &str, origin: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Value {
    json!({ "type": "quad", "material": material, "origin": origin, "edge_u": u, "edge_v": v })
}

/// The insides of a box of 4 x 2 x 4 with these shapes in it.
fn walls_and(shapes: Vec<Value>) -> Value {
    let walls = vec![
        quad("white", [-2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]),
        quad("white", [-2.0, 2.0, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]),
        quad("white", [-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
        quad("white", [-2.0, 0.0, 2.0], [0.0, 2.0, 0.0], [4.0, 0.0, 0.0]),
        quad("white", [-2.0, 0.0, -2.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0]),
        quad("white", [2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [0.0, 2.0, 0.0]),
    ];
    Value::Array([walls, shapes].concat())
}

/// A room lit through a gap beside a wall: the lamp behind it shines on a stripe of the floor, which lights all else.
fn room() -> Value {
    json!({
        "camera": { "position": [-0.6, 1.0, 1.8], "look_at": [-1.2, 0.8, -1.0], "vertical_fov_degrees": 60 },
        "film": { "width": 72, "height": 72, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 12 },
        "materials": {
            "white": { "type": "diffuse", "albedo": 0.7 },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 }
        },
        "shapes": walls_and(vec![
            quad("white", [0.4, 0.0, -2.0], [0.0, 0.0, 3.7], [0.0, 2.0, 0.0]),
            json!({
                "type": "sphere", "material": "gold", "radius": 0.3, "transform": [{ "translate": [-1.1, 0.3, -0.4] }]
            }),
            json!({
                "type": "quad", "material": "white", "origin": [1.6, 1.8, -1.6], "edge_u": [0.3, 0, 0],
                "edge_v": [0, 0, 0.3], "emission": { "radiance": [90, 80, 60] }
            }),
        ])
    })
}

/// A room with a lamp at the bottom of a shaft of this width, which lights nothing but a spot of the ceiling: only
/// paths that happen to meet it contribute.
pub fn room_with_shaft(width: f64) -> Value {
    let (bottom, height, half) = (0.4, 1.1, 0.5 * width);
    let wall = |x: f64, z: f64, along: [f64; 3]| quad("black", [x, bottom, z], along, [0.0, height, 0.0]);
    json!({
        "camera": { "position": [-1.6, 1.2, 1.7], "look_at": [0.8, 0.2, -1.0], "vertical_fov_degrees": 60 },
        "film": { "width": 240, "height": 240, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 8, "bidirectional": "off" },
        "materials": { "white": { "type": "diffuse", "albedo": 0.6 }, "black": { "type": "diffuse", "albedo": 0 } },
        "shapes": walls_and(vec![
            wall(-half, -half, [2.0 * half, 0.0, 0.0]),
            wall(-half, half, [2.0 * half, 0.0, 0.0]),
            wall(-half, -half, [0.0, 0.0, 2.0 * half]),
            wall(half, -half, [0.0, 0.0, 2.0 * half]),
            json!({
                "type": "quad", "material": "black", "origin": [-half, bottom, -half], "edge_u": [0, 0, 2.0 * half],
                "edge_v": [2.0 * half, 0, 0], "emission": { "radiance": [400, 400, 400] }
            }),
        ])
    })
}

fn run(scene: &Value, guiding: bool, overrides: &Overrides) -> RenderResult {
    let overrides = Overrides { guiding: Some(guiding.into()), ..overrides.clone() };
    let prepared = prepare(scene, &overrides);
    let accel = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1).unwrap();
    render::render(&prepared.scene, &*accel, &prepared.settings, &Silent, &false.into()).unwrap()
}

fn of_seed(guiding: bool, seed: u64, spp: u32) -> Image {
    run(&room(), guiding, &Overrides { seed: Some(seed), spp: Some(spp), ..Overrides::default() }).image
}

/// By Welch's test on blocks of pixels.
#[test]
fn guided_pictures_have_the_same_mean() {
    let blocks = |guiding: bool| -> Vec<Vec<f64>> {
        (0..8).map(|seed| block_means(&of_seed(guiding, seed + 100 * u64::from(guiding), 64))).collect()
    };
    assert_blocks_agree(&blocks(true), &blocks(false), "guided against not");
}

/// Two renders differ by twice the variance of one.
#[test]
fn guiding_lowers_the_error_where_light_is_hard_to_find() {
    let mut scene = room_with_shaft(0.5);
    scene["integrator"]["roulette"] = json!("throughput");
    let difference = |guiding: bool| {
        let image = |seed| {
            let overrides =
                Overrides { seed: Some(seed), spp: Some(32), size: Some([160, 160]), ..Overrides::default() };
            run(&scene, guiding, &overrides).image
        };
        let (a, b) = (image(1), image(2));
        let (a, b) = (a.layer(LayerKind::Color).unwrap(), b.layer(LayerKind::Color).unwrap());
        a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a - b).powi(2) / (f64::from(*b).powi(2) + 0.01)).sum::<f64>()
    };
    let (guided, plain) = (difference(true), difference(false));
    assert!(guided < 0.6 * plain, "{guided} {plain}");
}

#[test]
fn guided_pictures_do_not_depend_on_threads() {
    let images: Vec<Image> = [1, 2, 3]
        .map(|threads| {
            let overrides = Overrides {
                threads: Some(threads),
                guiding: Some(AutoDesc::On),
                spp: Some(24),
                ..Overrides::default()
            };
            render_with(&prepare(&room(), &overrides), AccelKind::EMBREE).image
        })
        .into();
    assert!(images.windows(2).all(|pair| pair[0] == pair[1]));
    assert_ne!(images[0], of_seed(false, 0, 24));
}

#[test]
fn crops_limits_and_layers_hold() {
    let crop = run(&room(), true, &Overrides { crop: Some([30, 17, 13, 9]), spp: Some(16), ..Overrides::default() });
    assert_eq!((crop.stats.samples, crop.image.crop.area()), (16 * 13 * 9, 13 * 9));
    let limited = run(&room(), true, &Overrides { time_limit: Some(0.05), spp: Some(1 << 20), ..Overrides::default() });
    assert!(limited.stats.time_limited && limited.stats.spp_done >= 1 && limited.stats.spp_done < 1 << 20);
    for spp in [1, 2, 3, 7] {
        assert_eq!(run(&room(), true, &Overrides { spp: Some(spp), ..Overrides::default() }).stats.spp_done, spp);
    }
    let mut layered = room();
    layered["outputs"] = json!([{ "file": "unused.exr", "layers": ["Z", "N", "albedo", "samples", "variance"] }]);
    let [guided, plain] =
        [true, false].map(|guiding| run(&layered, guiding, &Overrides { spp: Some(16), ..Overrides::default() }).image);
    for kind in [LayerKind::Z, LayerKind::N, LayerKind::Samples] {
        assert_eq!(guided.layer(kind), plain.layer(kind), "{kind:?}");
    }
    // Samples count for the albedo as they do for the picture: it is the same but where it varies within the filter.
    let [width, height] = plain.size;
    let albedo = |image: &Image, x: u32, y: u32| image.pixel(LayerKind::Albedo, x, y).unwrap()[1];
    let mut even = 0;
    for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        if around.into_iter().all(|(i, j)| (albedo(&plain, i, j) - albedo(&plain, x, y)).abs() < 1e-6) {
            even += 1;
            assert!((albedo(&guided, x, y) - albedo(&plain, x, y)).abs() < 1e-5, "{x} {y}");
        }
    }
    assert!(even > width * height / 2, "{even}");
    assert!(guided.layer(LayerKind::Variance).unwrap().data.iter().all(|v| v.is_finite() && *v >= 0.0));
}

/// Under an even sky there is nothing to learn, and guiding ends: later samples are those of other renders.
#[test]
fn scenes_without_lamps_stay_what_they_are() {
    let mut open = room();
    open["shapes"] = json!([open["shapes"][0].clone()]);
    open["lights"] = json!([{ "type": "environment", "radiance": [1, 1, 1] }]);
    let [guided, plain] =
        [true, false].map(|guiding| run(&open, guiding, &Overrides { spp: Some(32), ..Overrides::default() }));
    let means = [&guided.image, &plain.image].map(|image| block_means(image).iter().sum::<f64>());
    assert!((means[0] / means[1] - 1.0).abs() < 0.01, "{means:?}");
}

#[test]
fn what_guiding_cannot_do_is_refused() {
    let refusal = |scene: &Value, overrides: &Overrides| {
        let desc = serde_json::from_value(scene.clone()).unwrap();
        match render::Settings::new(&desc, overrides) {
            Err(Error::Setting { message, .. }) => message,
            other => panic!("{other:?}"),
        }
    };
    let on = Overrides { guiding: Some(AutoDesc::On), ..Overrides::default() };
    assert!(refusal(&room(), &Overrides { target_error: Some(0.01), ..on.clone() }).starts_with("`target_error`"));
    let mut normals = room();
    normals["integrator"] = json!({ "type": "normal" });
    assert!(refusal(&normals, &on).starts_with("`guiding`"));
    let prepared = prepare(&room(), &on);
    let accel = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1).unwrap();
    let error = render::replay(&prepared.scene, &*accel, &prepared.settings, [1, 1], 0).unwrap_err();
    assert!(error.to_string().contains("`guiding`"), "{error}");
}

fn kit(scene: &Value, spp: u32) -> Kit {
    Kit::new(
        scene,
        &Overrides { guiding: Some(AutoDesc::On), spp: Some(spp), threads: Some(2), ..Overrides::default() },
    )
}

/// Renders until a tile of a random pass is done; the state is what a file has kept of it.
fn part(kit: &Kit, state: RenderState, tiles: usize, file: &StateFile) -> RenderState {
    let stop = AtomicBool::new(false);
    let progress = StopAfter { tiles: (1 + tiles as u32).into(), stop: &stop };
    kit.kept(&kit.go_on(state, &progress, &stop), file)
}

/// Interrupted while the guide learns, at the ends of iterations and within them, and after guiding has ended.
#[test]
fn a_resumed_guided_render_has_the_bits_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let mut rng = Rng::new(7);
    for scene in [room(), checkpoints::scene("mitchell")] {
        let kit = kit(&scene, 37);
        let reference = kit.render(Shard::WHOLE);
        assert!(reference.complete && reference.done == 37);
        let tiles = reference.film.tiles().len();
        let mut interruptions = std::collections::BTreeSet::new();
        for passes in [1, 2, 3, 5] {
            let mut state = kit.start(Shard::WHOLE);
            while !state.complete {
                state = part(&kit, state, rng.below(passes * tiles), &file);
                interruptions.insert(state.done);
            }
            assert!(bits(&state.film) == bits(&reference.film), "{passes}");
            assert_eq!((state.rays, state.film.dropped()), (reference.rays, reference.film.dropped()));
            assert!(state.film.resolve() == reference.film.resolve());
        }
        assert!(interruptions.len() > 5, "{interruptions:?}");
    }
}

/// What is there of a guided render is a picture of the same brightness, from its checkpoint too; the number of samples
/// is part of what it is.
#[test]
fn an_interrupted_guided_render_has_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let kit = kit(&room(), 64);
    let mut state = kit.start(Shard::WHOLE);
    while state.done < 5 {
        state = part(&kit, state, 0, &file);
    }
    let picture = state.picture(&kit.prepared.settings);
    let plain = run(&room(), false, &Overrides { spp: Some(64), ..Overrides::default() }).image;
    let means = [&picture, &plain].map(|image| block_means(image).iter().sum::<f64>());
    assert!((means[0] / means[1] - 1.0).abs() < 0.2, "{means:?}");
    let merged = render::merge(&[file.path().to_owned()], true).unwrap();
    assert_eq!(merged.state.done, state.done);
    assert!(merged.state.film.resolve() == state.whole_film().resolve());

    let more = self::kit(&room(), 65);
    let refused =
        RenderState::read(file.path(), &more.header(Shard::WHOLE), &more.prepared.scene, &more.prepared.settings)
            .unwrap_err();
    assert!(refused.to_string().contains("spp: 64 in the checkpoint, 65 requested"), "{refused}");
}

/// The last block of a state, which has the guide.
fn with_guide(state: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let length = |at: usize| u64::from_le_bytes(state[at..at + 8].try_into().unwrap()) as usize;
    let end = state.len() - 40;
    let mut at = 16 + u32::from_le_bytes(state[12..16].try_into().unwrap()) as usize;
    while at + 8 + length(at) < end {
        at += 8 + length(at);
    }
    let mut guide = state[at + 8..end].to_vec();
    change(&mut guide);
    let mut out = [&state[..at], &(guide.len() as u64).to_le_bytes(), &guide, &state[end..end + 8]].concat();
    out.extend(blake3::hash(&out).as_bytes());
    out
}

/// States come from anywhere: guides that no render can have learned are refused, and none that is taken is a panic.
#[test]
fn damaged_guides_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let mut small = room();
    small["film"] = json!({ "width": 12, "height": 12 });
    let kit = kit(&small, 16);
    let mut state = kit.start(Shard::WHOLE);
    while state.done < 5 {
        state = part(&kit, state, 0, &file);
    }
    let bytes = std::fs::read(file.path()).unwrap();
    let read = |bytes: &[u8]| {
        let path = folder.path().join("b.state");
        std::fs::write(&path, bytes).unwrap();
        RenderState::read(&path, &kit.header(Shard::WHOLE), &kit.prepared.scene, &kit.prepared.settings)
    };
    assert!(read(&with_guide(&bytes, |_| {})).is_ok());
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let error = read(&with_guide(&bytes, change)).unwrap_err();
        assert_eq!(error.kind(), steradian::ErrorKind::Checkpoint);
        assert!(error.to_string().contains("b.state: the guide is not what was saved of it"), "{error}");
    };
    refused(&Vec::clear);
    refused(&|guide| guide.push(0));
    // Samples that have a weight: as many as no iteration ends with.
    refused(&|guide| guide[8] = 3);
    refused(&|guide| guide[8..16].fill(255));
    let mut rng = Rng::new(4);
    for _ in 0..50 {
        let cut = rng.below(10_000);
        refused(&|guide| guide.truncate(cut % guide.len()));
    }
    let mut taken = 0;
    for _ in 0..60 {
        let (place, value) = (rng.bits() as usize, rng.bits() as u8);
        let changed = with_guide(&bytes, |guide| {
            let place = place % guide.len();
            guide[place] = value;
        });
        if let Ok(state) = read(&changed) {
            taken += 1;
            assert!(taken > 6 || kit.go_on(state, &Silent, &AtomicBool::new(false)).complete);
        }
    }
}
