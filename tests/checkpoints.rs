//! Renders that go on where they were stopped: the same bits as in one run, and files that are refused by name.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::{Film, LayerKind, LayerSet};
use steradian::internal::import::SceneFingerprint;
use steradian::internal::math::Rng;
use steradian::internal::render::{
    self, Checkpoints, Header, Overrides, Progress, RenderSession, RenderState, Shard, Silent, StateFile,
};

use crate::participating_media::foggy;
use crate::util::render::{Prepared, prepare};

/// Glass, metal, lights of two groups and none, motion, a lens and a filter with negative lobes.
pub fn scene(filter: &str) -> Value {
    json!({
        "film": { "width": 41, "height": 37, "filter": { "type": filter } },
        "camera": { "position": [0, 1.2, 4], "look_at": [0, 0.5, 0], "lens": { "radius": 0.05, "focus_distance": 4 } },
        "sampler": { "spp": 24 },
        "integrator": { "type": "path", "max_depth": 5, "caustics": "paths", "bidirectional": "off" },
        "materials": {
            "grey": { "type": "diffuse" }, "glass": { "type": "dielectric" },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 }
        },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            { "type": "cube", "material": "gold", "transform": [{ "scale": 0.4 }, { "translate": [0.7, 0.4, -0.3] }] },
            { "type": "disk", "emission": { "radiance": [9, 8, 7], "group": "key" },
              "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }] }
        ],
        "lights": [
            { "type": "environment", "radiance": [0.2, 0.3, 0.4] },
            { "type": "point", "position": [2, 3, 1], "intensity": [3, 2, 1], "group": "fill" }
        ]
    })
}

/// A scene that is ready to be rendered in parts, with every layer.
pub struct Kit {
    pub prepared: Prepared,
}

impl Kit {
    pub fn new(scene: &Value, overrides: &Overrides) -> Self {
        let mut prepared = prepare(scene, overrides);
        prepared.settings.layers = LayerSet::FULL;
        Self { prepared }
    }

    pub fn header(&self, shard: Shard) -> Header {
        let scene = SceneFingerprint { whole: "of the test".into(), ..SceneFingerprint::default() };
        Header::new("test.json", scene, &self.prepared.scene, &self.prepared.settings, shard)
    }

    pub fn start(&self, shard: Shard) -> RenderState {
        RenderState::new(&self.prepared.scene, &self.prepared.settings, shard).unwrap()
    }

    pub fn go_on(&self, state: RenderState, progress: &dyn Progress, stop: &AtomicBool) -> RenderState {
        self.go_on_with(state, None, progress, stop)
    }

    fn go_on_with(
        &self,
        state: RenderState,
        checkpoints: Option<&mut Checkpoints>,
        progress: &dyn Progress,
        stop: &AtomicBool,
    ) -> RenderState {
        let Prepared { scene, settings } = &self.prepared;
        let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
        RenderSession { scene, accel: &*accel, settings, progress, stop }.render(state, checkpoints).unwrap().0
    }

    pub fn render(&self, shard: Shard) -> RenderState {
        self.go_on(self.start(shard), &Silent, &AtomicBool::new(false))
    }

    /// The state through a file.
    pub fn kept(&self, state: &RenderState, file: &StateFile) -> RenderState {
        let header = self.header(state.shard);
        file.replace(|out| state.write(&header, out)).unwrap();
        RenderState::read(file.path(), &header, &self.prepared.scene, &self.prepared.settings).unwrap()
    }
}

/// Every bit of a film.
pub fn bits(film: &Film) -> Vec<Vec<u8>> {
    film.tiles().iter().map(steradian::internal::film::FilmTile::save).collect()
}

/// Asserts that a render of box-filtered pixels keeps its bits when it is stopped and resumed many times, that three
/// shards make the same picture, and that the samples of a pixel, replayed one by one, have its mean.
#[track_caller]
pub fn assert_resumed_split_and_replayed(scene: &Value, overrides: &Overrides) {
    let kit = Kit::new(scene, overrides);
    let whole = kit.render(Shard::WHOLE);
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let mut rng = Rng::new(3);
    let mut state = kit.start(Shard::WHOLE);
    while !state.complete {
        let stop = AtomicBool::new(false);
        let progress = StopAfter { tiles: (1 + rng.below(5) as u32).into(), stop: &stop };
        state = kit.kept(&kit.go_on(state, &progress, &stop), &file);
    }
    assert!(bits(&state.film) == bits(&whole.film));

    let shards = (1..=3).map(|index| Shard { index, count: 3 });
    let paths = shards.map(|shard| {
        let path = folder.path().join(format!("{}.shard", shard.index));
        kit.kept(&kit.render(shard), &StateFile::take(&path).unwrap());
        path
    });
    let paths: Vec<_> = paths.collect();
    let merged = render::merge(&paths, false).unwrap();
    assert!(merged.state.film.resolve() == whole.film.resolve());

    let accel = accel::build(AccelKind::EMBREE, &kit.prepared.scene.geometry, 1).unwrap();
    let replay =
        |sample| render::replay(&kit.prepared.scene, &*accel, &kit.prepared.settings, [17, 20], sample).unwrap().pixel;
    let single = Kit::new(scene, &Overrides { crop: Some([17, 20, 1, 1]), ..overrides.clone() });
    let spp = kit.prepared.settings.spp;
    let mean = (0..spp).map(|i| f64::from(replay(i).radiance.r)).sum::<f64>() / f64::from(spp);
    let of_crop = single.render(Shard::WHOLE).film.resolve().pixel(LayerKind::Color, 17, 20).unwrap()[0];
    assert_eq!(whole.film.resolve().pixel(LayerKind::Color, 17, 20).unwrap()[0], of_crop);
    assert!((mean / f64::from(of_crop) - 1.0).abs() < 1e-5, "{mean} {of_crop}");
}

fn spp(spp: u32) -> Overrides {
    Overrides { spp: Some(spp), threads: Some(2), ..Overrides::default() }
}

#[test]
fn a_resumed_render_has_the_bits_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let mut rng = Rng::new(3);
    for (name, scene) in [("box", scene("box")), ("mitchell", scene("mitchell")), ("fog", foggy(6))] {
        let whole = Kit::new(&scene, &spp(24));
        let reference = whole.render(Shard::WHOLE);
        assert!(reference.complete);
        let image = reference.film.resolve();
        for _ in 0..4 {
            // Up to a number of samples, then to a larger one, then to the end: each time through a file.
            let first = 1 + rng.below(12) as u32;
            let second = first + 1 + rng.below(23 - first as usize) as u32;
            let mut state = whole.start(Shard::WHOLE);
            for target in [first, second, 24] {
                let part = Kit::new(&scene, &spp(target));
                state = part.kept(&part.go_on(state, &Silent, &AtomicBool::new(false)), &file);
                assert_eq!(state.done, target);
            }
            assert!(bits(&state.film) == bits(&reference.film), "{name}: {first}, {second}");
            assert_eq!((state.rays, state.film.dropped()), (reference.rays, reference.film.dropped()));
            assert!(state.film.resolve() == image);
        }
    }
}

/// Stops a render after a number of tiles.
pub struct StopAfter<'a> {
    pub tiles: AtomicU32,
    pub stop: &'a AtomicBool,
}

impl Progress for StopAfter<'_> {
    fn tile_done(&self, _: u64) {
        if self.tiles.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_resumed_render_with_a_target_error_has_the_bits_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let overrides = Overrides {
        target_error: Some(5e-3),
        spp: Some(96),
        size: Some([16, 12]),
        threads: Some(2),
        ..Overrides::default()
    };
    let kit = Kit::new(&scene("mitchell"), &overrides);
    let reference = kit.render(Shard::WHOLE);
    let mut rng = Rng::new(5);
    for _ in 0..2 {
        let mut state = kit.start(Shard::WHOLE);
        let mut runs = 0;
        loop {
            let stop = AtomicBool::new(false);
            let progress = StopAfter { tiles: (1 + rng.below(4) as u32).into(), stop: &stop };
            state = kit.kept(&kit.go_on(state, &progress, &stop), &file);
            runs += 1;
            assert!(runs < 100, "no headway");
            if state.complete {
                break;
            }
        }
        assert!(runs > 1 && bits(&state.film) == bits(&reference.film) && state.done == reference.done, "{runs}");
    }
}

#[test]
fn a_state_of_another_render_is_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let kit = Kit::new(&scene("box"), &spp(4));
    let state = kit.render(Shard::WHOLE);
    file.replace(|out| state.write(&kit.header(Shard::WHOLE), out)).unwrap();
    let refusal = |scene: &Value, overrides: &Overrides, change: fn(&mut Header)| {
        let other = Kit::new(scene, overrides);
        let mut header = other.header(Shard::WHOLE);
        change(&mut header);
        let error =
            RenderState::read(file.path(), &header, &other.prepared.scene, &other.prepared.settings).unwrap_err();
        assert_eq!(error.kind(), steradian::ErrorKind::Checkpoint);
        error.to_string()
    };
    let cases: [(&str, Overrides); 5] = [
        ("seed: 0 in the checkpoint, 3 requested", Overrides { seed: Some(3), ..spp(4) }),
        ("size: 41,37 in the checkpoint, 40,37 requested", Overrides { size: Some([40, 37]), ..spp(4) }),
        ("crop: 0,0,41,37 in the checkpoint, 1,2,3,4 requested", Overrides { crop: Some([1, 2, 3, 4]), ..spp(4) }),
        ("integrator.max_depth: 5 in the checkpoint, 6 requested", Overrides { max_depth: Some(6), ..spp(4) }),
        ("pixels have 4 samples already, 3 requested", spp(3)),
    ];
    for (message, overrides) in cases {
        let refused = refusal(&scene("box"), &overrides, |_| {});
        assert!(refused.contains(message) && refused.contains("a.state: "), "{refused}");
    }
    let refused = refusal(&scene("tent"), &spp(4), |_| {});
    assert!(refused.contains("filter.type: box in the checkpoint, tent requested"), "{refused}");
    let refused = refusal(&scene("box"), &spp(4), |header| {
        header.scene.whole = "of another".into();
        header.scene.assets.insert("bunny.ply".into(), "0".into());
    });
    assert!(refused.contains("scene: not the same bunny.ply"), "{refused}");
    let refused = refusal(&scene("box"), &spp(4), |header| header.program = "steradian 99".into());
    assert!(refused.contains(", steradian 99 requested"), "{refused}");
    let refused = refusal(&scene("box"), &spp(4), |header| header.shard = Shard { index: 1, count: 2 });
    assert!(refused.contains("shard: 1/1 in the checkpoint, 1/2 requested"), "{refused}");
}

/// Other values for a serialized field, some of which its type takes.
fn others(value: &Value) -> Vec<Value> {
    let names = ["independent", "linear", "mis", "light", "Z"].map(Value::from);
    match value {
        Value::Null => vec![json!(0.5)],
        Value::Bool(on) => vec![json!(!on)],
        Value::Number(number) if number.as_u64() == Some(0) => vec![json!(1)],
        Value::Number(number) if number.is_u64() => vec![json!(number.as_u64().unwrap() - 1)],
        Value::Number(number) => vec![json!(number.as_f64().unwrap() + 1.0)],
        Value::Array(list) if list.first().is_some_and(Value::is_string) => vec![json!(["Z"])],
        Value::Array(list) => vec![list.iter().map(|item| others(item).swap_remove(0)).collect()],
        _ => names.to_vec(),
    }
}

/// Every way to change one field of serialized settings, with the field's name: new fields are included.
fn changed_settings(settings: &Value) -> Vec<(String, Value)> {
    let mut changed = Vec::new();
    for (name, value) in settings.as_object().unwrap() {
        let variants: Vec<(String, Value)> = match value {
            Value::Object(object) => {
                let other_kind = ["tent", "depth"].map(|kind| ("type".to_owned(), json!({ "type": kind })));
                let other_fields = object.iter().filter(|(key, _)| *key != "type").flat_map(|(key, field)| {
                    let with =
                        |other| Value::Object(object.clone().into_iter().chain([(key.clone(), other)]).collect());
                    others(field).into_iter().map(move |other| (key.clone(), with(other)))
                });
                let fields = other_kind.into_iter().chain(other_fields);
                fields.map(|(key, object)| (format!("{name}.{key}"), object)).collect()
            }
            value => others(value).into_iter().map(|other| (name.clone(), other)).collect(),
        };
        changed.extend(variants.into_iter().filter(|(_, other)| other != value).map(|(field, other)| {
            let all = settings.as_object().unwrap().clone();
            (field, Value::Object(all.into_iter().chain([(name.clone(), other)]).collect()))
        }));
    }
    changed
}

/// Whatever setting the picture depends on differs: neither is a checkpoint continued nor are shards merged, and the
/// setting is named.
#[test]
fn every_setting_that_differs_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let kit = Kit::new(&scene("box"), &spp(4));
    let shards = [1, 2].map(|index| Shard { index, count: 2 });
    let state = StateFile::take(&folder.path().join("a.state")).unwrap();
    let files = [1, 2].map(|index| StateFile::take(&folder.path().join(format!("{index}.shard"))).unwrap());
    state.replace(|out| kit.render(Shard::WHOLE).write(&kit.header(Shard::WHOLE), out)).unwrap();
    let shard = kit.render(shards[0]);
    files[0].replace(|out| shard.write(&kit.header(shards[0]), out)).unwrap();
    let serialized = serde_json::to_value(&kit.prepared.settings).unwrap();
    let mut found = std::collections::BTreeSet::new();
    for (name, value) in changed_settings(&serialized) {
        let Ok(settings) = serde_json::from_value::<render::Settings>(value) else { continue };
        let prepared =
            Prepared { settings: render::Settings { threads: 1, ..settings }, ..prepare(&scene("box"), &spp(4)) };
        let other = Kit { prepared };
        let refused = RenderState::read(
            state.path(),
            &other.header(Shard::WHOLE),
            &other.prepared.scene,
            &other.prepared.settings,
        );
        let resumed = refused.unwrap_err().to_string();
        files[1].replace(|out| shard.write(&other.header(shards[1]), out)).unwrap();
        let merged = render::merge(&files.each_ref().map(|file| file.path().to_owned()), true).unwrap_err().to_string();
        for refused in [resumed, merged] {
            assert!(refused.contains("another") && refused.contains(&format!("{name}: ")), "{name}: {refused}");
        }
        found.insert(name.split('.').next().unwrap().to_owned());
    }
    // Some of the changes make sense for every field.
    assert_eq!(found.iter().collect::<Vec<_>>(), serialized.as_object().unwrap().keys().collect::<Vec<_>>());
    let skipped = ["outputs", "threads", "time_limit"];
    assert!(skipped.iter().all(|name| !found.contains(*name)));
}

/// Films of textures that are filtered for a number of samples cannot get more of them.
#[test]
fn more_samples_are_refused_where_textures_depend_on_their_number() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let filtered = |samples: u32| {
        let mut kit = Kit::new(&scene("box"), &spp(samples));
        kit.prepared.scene.features.filtered_textures = true;
        kit
    };
    let few = filtered(2);
    file.replace(|out| few.render(Shard::WHOLE).write(&few.header(Shard::WHOLE), out)).unwrap();
    let more = filtered(4);
    let read =
        RenderState::read(file.path(), &more.header(Shard::WHOLE), &more.prepared.scene, &more.prepared.settings);
    let refused = read.unwrap_err().to_string();
    assert!(refused.contains("that textures are filtered for: 2 in the checkpoint, 4 requested"), "{refused}");
}

/// Copies the first checkpoint, once it is there.
struct Keep<'a> {
    from: &'a Path,
    to: &'a Path,
}

impl Progress for Keep<'_> {
    fn tile_done(&self, _: u64) {
        if self.from.exists() && !self.to.exists() {
            std::fs::copy(self.from, self.to).unwrap();
        }
    }
}

#[test]
fn a_state_in_the_middle_of_a_sample_goes_on() {
    let mut large = scene("box");
    large["film"]["width"] = json!(330);
    large["film"]["height"] = json!(330);
    large["integrator"] = json!({ "type": "path", "max_depth": 2 });
    // One thread: none looks at the file while another copies it.
    for guiding in [false, true] {
        goes_on_in_the_middle(&Kit::new(
            &large,
            &Overrides { threads: Some(1), guiding: Some(guiding.into()), ..spp(2) },
        ));
    }
}

fn goes_on_in_the_middle(kit: &Kit) {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (folder.path().join("a.state"), folder.path().join("copy.state"));
    let header = kit.header(Shard::WHOLE);
    let mut checkpoints = Checkpoints::new(
        StateFile::take(&path).unwrap(),
        header.clone(),
        Duration::from_secs(1000),
        AtomicBool::new(true).into(),
    );
    let progress = Keep { from: &path, to: &copy };
    let whole = kit.go_on_with(kit.start(Shard::WHOLE), Some(&mut checkpoints), &progress, &AtomicBool::new(false));
    let state = RenderState::read(&copy, &header, &kit.prepared.scene, &kit.prepared.settings).unwrap();
    assert!(state.done == 0 && state.tiles_in_partial_pass > 0 && !state.complete, "{}", state.tiles_in_partial_pass);
    let resumed = kit.go_on(state, &Silent, &AtomicBool::new(false));
    assert!(resumed.complete && bits(&resumed.film) == bits(&whole.film) && resumed.rays == whole.rays);
}

/// Counts warnings.
#[derive(Default)]
struct Warnings(std::sync::Mutex<Vec<String>>);

impl Progress for Warnings {
    fn warn(&self, message: &str) {
        self.0.lock().unwrap().push(message.to_owned());
    }
}

#[test]
fn a_checkpoint_that_cannot_be_written_is_reported_and_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let kit = Kit::new(&scene("box"), &spp(6));
    let file = StateFile::take(&inner.join("a.state")).unwrap();
    let mut checkpoints =
        Checkpoints::new(file, kit.header(Shard::WHOLE), Duration::ZERO, AtomicBool::new(false).into());
    std::fs::remove_dir_all(&inner).unwrap();
    let warnings = Warnings::default();
    let state = kit.go_on_with(kit.start(Shard::WHOLE), Some(&mut checkpoints), &warnings, &AtomicBool::new(false));
    assert!(bits(&state.film) == bits(&kit.render(Shard::WHOLE).film));
    let warnings = warnings.0.into_inner().unwrap();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("a.state: ") && warnings[0].contains("the render goes on"), "{warnings:?}");
}
