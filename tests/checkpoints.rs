//! Renders that go on where they were stopped: the same bits as in one run, and files that are refused by name.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use steradian::accel::{self, AccelKind};
use steradian::film::{Film, LayerSet};
use steradian::import::SceneFingerprint;
use steradian::math::Rng;
use steradian::render::{
    self, Checkpoints, Header, Overrides, Progress, RenderSession, RenderState, Shard, Silent, StateFile,
};

use crate::util::program::{Running, Signal};
use crate::util::render::{Prepared, prepare};

/// Glass, metal, lights of two groups and none, motion, a lens and a filter with negative lobes.
pub fn scene(filter: &str) -> Value {
    json!({
        "film": { "width": 41, "height": 37, "filter": { "type": filter } },
        "camera": { "position": [0, 1.2, 4], "look_at": [0, 0.5, 0], "lens": { "radius": 0.05, "focus_distance": 4 } },
        "sampler": { "spp": 24 },
        "integrator": { "type": "path", "max_depth": 5 },
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
    film.tiles().iter().map(steradian::film::FilmTile::save).collect()
}

fn spp(spp: u32) -> Overrides {
    Overrides { spp: Some(spp), threads: Some(2), ..Overrides::default() }
}

#[test]
fn a_resumed_render_has_the_bits_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = StateFile::take(&folder.path().join("a.state")).unwrap();
    let mut rng = Rng::new(3);
    for filter in ["box", "mitchell"] {
        let scene = scene(filter);
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
            assert!(bits(&state.film) == bits(&reference.film), "{filter}: {first}, {second}");
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
        goes_on_in_the_middle(&Kit::new(&large, &Overrides { threads: Some(1), guiding: Some(guiding), ..spp(2) }));
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
    assert!(state.done == 0 && state.tiles_ahead > 0 && !state.complete, "{}", state.tiles_ahead);
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

// What follows runs the program.

const SLOW: &str = "render scene.json --checkpoint a.state --threads 2 --spp 64 --size 96x72 --layers \
                    Z,N,albedo,variance,samples --float -q -o a.exr";

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command.current_dir(folder).args(line.split_whitespace()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

#[track_caller]
fn assert_code(output: &Output, code: i32, part: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(code) && text.contains(part), "{:?}: {text}", output.status);
}

/// Waits until there is a file that is newer than `than`.
fn wait_for(path: &Path, than: Option<std::time::SystemTime>) {
    let start = Instant::now();
    while std::fs::metadata(path).ok().and_then(|m| m.modified().ok()) <= than {
        assert!(start.elapsed() < Duration::from_secs(60), "no new {}", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn folder_with_scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene("mitchell");
    scene["outputs"] =
        json!([{ "file": "x.exr", "layers": ["Z", "N", "albedo", "variance", "samples"], "pixel_type": "float" }]);
    std::fs::write(folder.path().join("scene.json"), scene.to_string()).unwrap();
    folder
}

/// The channels of an EXR file with the bits of their pixels.
pub fn channels(path: &Path) -> Vec<(String, Vec<u32>)> {
    let file = exr::prelude::read_all_flat_layers_from_file(path).unwrap();
    let channels = file.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
    channels
        .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().map(f32::to_bits).collect()))
        .collect()
}

fn same_pictures(folder: &Path, a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|name| channels(&folder.join(name)));
    assert!(a.len() > 10, "{}", a.len());
    a == b
}

#[test]
fn killed_renders_go_on_and_leave_no_trace() {
    let folder = folder_with_scene();
    let folder = folder.path();
    assert_code(&run(folder, &SLOW.replace("a.state", "b.state").replace("a.exr", "b.exr")), 0, "");
    let mut rng = Rng::new(11);
    for kill in 0..3 {
        let mut child = Running::start(&mut command(folder, &format!("{SLOW} --every 0.05 --resume")));
        let there = std::fs::metadata(folder.join("a.state")).ok().and_then(|m| m.modified().ok());
        wait_for(&folder.join("a.state"), there);
        std::thread::sleep(Duration::from_millis(rng.below(60) as u64));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(Header::read(&folder.join("a.state")).unwrap().done > kill, "no headway");
    }
    assert_code(&run(folder, &format!("{SLOW} --resume")), 0, "");
    assert!(same_pictures(folder, "a.exr", "b.exr"));
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["a.exr", "a.state", "b.exr", "b.state", "scene.json"]);
    // More samples continue from what is there.
    assert_code(&run(folder, &format!("{} --resume", SLOW.replace("64 ", "80 "))), 0, "");
    assert_code(
        &run(folder, &SLOW.replace("64 ", "80 ").replace("a.state", "c.state").replace("a.exr", "c.exr")),
        0,
        "",
    );
    assert!(same_pictures(folder, "a.exr", "c.exr") && !same_pictures(folder, "b.exr", "c.exr"));
}

#[test]
fn signals_are_answered() {
    let folder = folder_with_scene();
    let folder = folder.path();
    let endless = "render scene.json --checkpoint a.state --resume --every 1000 --spp 2000000000 -q -o a.exr";
    let done = || Header::read(&folder.join("a.state")).unwrap().done;
    let mut before = 0;
    for (signal, code) in [(Signal::TERM, 143), (Signal::INT, 130)] {
        let there = std::fs::metadata(folder.join("a.state")).ok().and_then(|m| m.modified().ok());
        let child = Running::start(&mut command(folder, endless));
        // From its lock file on, the program listens to SIGUSR1; the signal is repeated, for it may come before that.
        wait_for(&folder.join(".a.state.lock"), None);
        child.signal(Signal::USR1);
        wait_for(&folder.join("a.state"), there);
        let requested = done();
        assert!(requested > before);
        child.signal(signal);
        assert_code(&child.output(), code, "");
        before = done();
        assert!(before >= requested && folder.join("a.exr").exists());
    }
}

#[test]
fn faults_of_checkpoints_have_their_codes() {
    let folder = folder_with_scene();
    let folder = folder.path();
    let line = "render scene.json --size 24x20 -q -o a.exr --checkpoint";
    assert_code(&run(folder, &format!("{line} a.state --spp 2")), 0, "");
    let whole = std::fs::read(folder.join("a.state")).unwrap();
    std::fs::write(folder.join("other"), "no checkpoint").unwrap();
    let cases = [
        ("a.state --spp 2", 2, "--resume continues it"),
        ("other", 2, "the file exists"),
        ("other --resume", 6, "this is not a checkpoint"),
        ("scene.json --resume", 2, "scene.json (the scene) and scene.json (--checkpoint)"),
        ("missing/a.state", 5, "there is no folder missing"),
        ("/proc/a.state", 5, "no file can be created"),
        ("a.state --resume --spp 2 --seed 4", 6, "seed: 0 in the checkpoint, 4 requested"),
        ("a.state --resume --spp 1", 6, "2 samples already"),
        ("a.state --every x", 2, "--every"),
    ];
    for (rest, code, part) in cases {
        assert_code(&run(folder, &format!("{line} {rest}")), code, part);
        assert!(std::fs::read(folder.join("a.state")).unwrap() == whole, "{rest}");
    }
    std::fs::write(folder.join("cut.state"), &whole[..whole.len() / 2]).unwrap();
    assert_code(&run(folder, &format!("{line} cut.state --resume")), 6, "cut.state: the file is cut short");
    let mut altered = whole.clone();
    altered[whole.len() / 2] ^= 4;
    std::fs::write(folder.join("altered.state"), &altered).unwrap();
    assert_code(&run(folder, &format!("{line} altered.state --resume")), 6, "altered.state: the file was altered");
    // Another writer.
    let file = StateFile::take(&folder.join("a.state")).unwrap();
    assert_code(&run(folder, &format!("{line} a.state --resume")), 5, "a.state: another process");
    drop(file);
    // Nothing is lost with the scene.
    std::fs::rename(folder.join("scene.json"), folder.join("gone.json")).unwrap();
    assert_code(&run(folder, &format!("{line} a.state --resume")), 4, "scene.json");
    assert!(std::fs::read(folder.join("a.state")).unwrap() == whole);
}
