//! `--guiding auto`: a pilot decides. Where guiding does not pay the picture is that without it bit for bit; where it
//! pays, the same for any number of threads, resumed anywhere, and with more samples added later.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use steradian::desc::AutoDesc;
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::Image;
use steradian::internal::import::SceneFingerprint;
use steradian::internal::math::Rng;
use steradian::internal::render::{self, Overrides, RenderProvenance, RenderState, Settings, Shard, StateFile, Stats};

use crate::checkpoints::{Kit, StopAfter, bits};
use crate::guiding::room_with_shaft;
use crate::util::render::{assert_blocks_agree, block_means};

/// The fewest samples that a pilot is traced for.
const SPP: u32 = 128;

/// Pixels along the sides of pictures: just enough for a pilot.
const SIDE: u32 = 96;

/// Where most light comes by few ways.
fn hard() -> Value {
    let mut scene = room_with_shaft(0.5);
    scene["integrator"]["max_depth"] = json!(4);
    scene["film"]["width"] = json!(SIDE);
    scene["film"]["height"] = json!(SIDE);
    scene
}

/// A sphere under an even sky.
fn easy() -> Value {
    json!({
        "camera": { "position": [0, 1, 4], "look_at": [0, 0, 0] },
        "film": { "width": SIDE, "height": SIDE, "filter": { "type": "box" } },
        "integrator": { "type": "path" },
        "shapes": [
            { "type": "sphere", "radius": 1 },
            { "type": "quad", "origin": [-4, -1, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] }
        ],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    })
}

fn overrides(guiding: AutoDesc, spp: u32) -> Overrides {
    Overrides { guiding: Some(guiding), spp: Some(spp), threads: Some(2), ..Overrides::default() }
}

fn kit(scene: &Value, guiding: AutoDesc, spp: u32) -> Kit {
    Kit::new(scene, &overrides(guiding, spp))
}

fn picture(scene: &Value, overrides: &Overrides) -> Image {
    let kit = Kit::new(scene, overrides);
    kit.render(Shard::WHOLE).picture(&kit.prepared.settings)
}

/// The hard scene without guiding.
fn hard_unguided() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| picture(&hard(), &overrides(AutoDesc::Off, SPP)))
}

#[test]
fn an_easy_scene_keeps_its_bits() {
    let auto = kit(&easy(), AutoDesc::Auto, SPP);
    assert!(auto.prepared.settings.has_guiding_pilot());
    let [auto, off] = [auto, kit(&easy(), AutoDesc::Off, SPP)].map(|kit| kit.render(Shard::WHOLE));
    assert!(bits(&auto.film) == bits(&off.film));
    // The pilot takes rays of its own, few of them.
    let [with, without] = [auto.rays.total(), off.rays.total()].map(|rays| rays as f64);
    assert!(with > without && with < 1.02 * without, "{with} {without}");
}

#[test]
fn a_hard_scene_is_guided_alike_by_any_number_of_threads() {
    let of = |threads| picture(&hard(), &Overrides { threads: Some(threads), ..overrides(AutoDesc::Auto, SPP) });
    let one = of(1);
    assert!(one == of(3));
    assert!(one != *hard_unguided());
}

/// Interrupted before the decision, right after it and later; with more samples than were asked for at first.
#[test]
fn a_resumed_render_has_the_bits_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    for scene in [hard(), easy()] {
        let [first, second] = [SPP, SPP + 21].map(|spp| kit(&scene, AutoDesc::Auto, spp));
        let reference = second.render(Shard::WHOLE);
        let tiles = reference.film.tiles().len();
        let mut rng = Rng::new(11);
        let mut state = first.start(Shard::WHOLE);
        let mut stops = Vec::new();
        for kit in [&first, &second] {
            state.complete = false;
            while !state.complete {
                stops.push(state.done);
                let stop = AtomicBool::new(false);
                // Often while there are few samples.
                let most = 1 + (state.done as usize).pow(2);
                let progress = StopAfter { tiles: (1 + rng.below(most * tiles) as u32).into(), stop: &stop };
                let next = kit.kept(&kit.go_on(state, &progress, &stop), &file);
                state = next;
            }
        }
        assert!(stops.iter().any(|&done| done < 4) && stops.iter().any(|&done| done > 4), "{stops:?}");
        assert!(bits(&state.whole_film()) == bits(&reference.whole_film()));
        assert_eq!(state.rays, reference.rays);
    }
}

/// A state whose stage of guiding its settings rule out.
#[test]
fn states_that_are_guided_against_their_settings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.state");
    let kits = [AutoDesc::Off, AutoDesc::Auto, AutoDesc::On].map(|guiding| kit(&hard(), guiding, SPP));
    let refusal = |written: &Kit, settings: &Kit| {
        let header = settings.header(Shard::WHOLE);
        written.start(Shard::WHOLE).write(&header, std::fs::File::create(&path).unwrap()).unwrap();
        let Kit { prepared, .. } = settings;
        RenderState::read(&path, &header, &prepared.scene, &prepared.settings).err().map(|error| error.to_string())
    };
    let [off, auto, on] = &kits;
    // A pilot may have found that paths are to be guided, or not.
    for (written, settings) in [(off, off), (auto, auto), (on, on), (off, auto), (on, auto)] {
        assert_eq!(refusal(written, settings), None);
    }
    for (written, settings) in [(auto, off), (on, off), (off, on), (auto, on)] {
        let error = refusal(written, settings).unwrap();
        assert!(error.contains("a.state") && error.contains("does not fit its settings"), "{error}");
    }
}

/// By Welch's test on blocks of pixels, whose false alarms are rarer than one in a million.
#[test]
fn a_guided_picture_has_the_same_mean() {
    let blocks = |guiding, first: u64| -> Vec<Vec<f64>> {
        let picture = |seed| picture(&hard(), &Overrides { seed: Some(seed), ..overrides(guiding, SPP) });
        (first..first + 8).map(|seed| block_means(&picture(seed))).collect()
    };
    let [mut guided, mut plain] = [blocks(AutoDesc::Auto, 1), blocks(AutoDesc::Off, 101)];
    // What is nearly black is lit in few of them.
    let sum = |block: usize| guided.iter().chain(&plain).map(|means| means[block]).sum::<f64>();
    let largest = (0..plain[0].len()).map(sum).fold(0.0, f64::max);
    let is_lit: Vec<bool> = (0..plain[0].len()).map(|block| sum(block) > 0.01 * largest).collect();
    for means in guided.iter_mut().chain(&mut plain) {
        let mut lit = is_lit.iter();
        means.retain(|_| lit.next().is_some_and(|lit| *lit));
    }
    assert!(plain[0].len() > 30, "{}", plain[0].len());
    assert_blocks_agree(&guided, &plain, "guided against not");
}

/// A pilot would depend on the samples of other parts: shards are those of a render without guiding.
#[test]
fn shards_are_not_guided() {
    let folder = tempfile::tempdir().unwrap();
    let mut kit = kit(&hard(), AutoDesc::Auto, SPP);
    let shards = (1..=2).map(|index| Shard { index, count: 2 });
    kit.prepared.settings = kit.prepared.settings.of_shard(Shard { index: 1, count: 2 });
    let paths: Vec<_> = shards
        .map(|shard| {
            let path = folder.path().join(format!("{}.shard", shard.index));
            kit.kept(&kit.render(shard), &StateFile::take(&path).unwrap());
            path
        })
        .collect();
    let merged = render::merge(&paths, false).unwrap();
    assert!(merged.state.picture(&kit.prepared.settings) == *hard_unguided());
    assert!(merged.header.settings.get("integrator.guiding").is_none_or(|guiding| guiding == "off"));
}

#[test]
fn pilots_are_traced_only_where_they_can_pay() {
    let has_pilot = |change: &dyn Fn(&mut Value), overrides: Overrides| {
        let mut scene = hard();
        change(&mut scene);
        Kit::new(&scene, &overrides).prepared.settings.has_guiding_pilot()
    };
    let auto = || overrides(AutoDesc::Auto, SPP);
    let same = |_: &mut Value| {};
    assert!(has_pilot(&same, auto()));
    assert!(!has_pilot(&same, overrides(AutoDesc::Auto, SPP - 1)));
    assert!(!has_pilot(&same, overrides(AutoDesc::On, SPP)));
    // It is the default.
    assert!(has_pilot(&same, Overrides { guiding: None, ..auto() }));
    assert!(!has_pilot(&same, Overrides { target_error: Some(0.01), ..auto() }));
    assert!(!has_pilot(&same, Overrides { size: Some([64, 64]), ..auto() }));
    assert!(!has_pilot(&same, Overrides { max_depth: Some(2), ..auto() }));
    assert!(!has_pilot(&|scene| scene["integrator"]["strategy"] = json!("bsdf"), auto()));
    assert!(!has_pilot(&|scene| scene["integrator"]["caustics"] = json!("photons"), auto()));
    assert!(!has_pilot(&|scene| scene["integrator"] = json!({ "type": "whitted" }), auto()));
}

/// Those before have the same numbers with and without a pilot.
#[test]
fn samples_are_replayed_without_guiding() {
    let [auto, off] = [AutoDesc::Auto, AutoDesc::Off].map(|guiding| {
        let kit = kit(&hard(), guiding, SPP);
        let scene = &kit.prepared.scene;
        let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
        [3, 100].map(|sample| render::replay(scene, &*accel, &kit.prepared.settings, [3, 5], sample).unwrap())
    });
    assert!(auto == off);
}

/// A crop is decided on by its own samples.
#[test]
fn crops_have_pilots_of_their_own() {
    let crop = |threads| {
        let overrides =
            Overrides { crop: Some([10, 21, 71, 67]), threads: Some(threads), ..overrides(AutoDesc::Auto, 2 * SPP) };
        picture(&hard(), &overrides)
    };
    let image = crop(2);
    assert_eq!(image.crop.area(), 71 * 67);
    assert!(image == crop(1));
}

/// What trains guides depends on the samples that a picture is to have, not on those that it got.
#[test]
fn pictures_that_ended_early_are_repeated() {
    for guiding in [AutoDesc::Auto, AutoDesc::On] {
        let mut kit = kit(&hard(), guiding, 2 * SPP);
        let mut state = kit.start(Shard::WHOLE);
        while state.done < 40 {
            let stop = AtomicBool::new(false);
            state = kit.go_on(state, &StopAfter { tiles: 9.into(), stop: &stop }, &stop);
        }
        assert!(state.done < SPP, "{}", state.done);
        let early = state.picture(&kit.prepared.settings);

        let provenance = RenderProvenance::new(
            Path::new("test.json"),
            SceneFingerprint::default(),
            &kit.prepared.settings,
            Vec::new(),
        );
        let provenance = provenance.of_render(&Stats { spp_done: state.done, ..Stats::default() });
        let layers = kit.prepared.settings.layers;
        kit.prepared.settings = Settings { layers, ..provenance.settings(2) };
        let again = kit.render(Shard::WHOLE);
        assert!(again.done == state.done && again.picture(&kit.prepared.settings) == early, "{guiding:?}");
        kit.prepared.settings.planned_spp = None;
        assert!(kit.render(Shard::WHOLE).picture(&kit.prepared.settings) != early, "{guiding:?}");
    }
}
