//! Shards: put together they are the picture of one run bit for bit, in every layer, and whatever does not belong
//! together is refused by name.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use steradian::internal::film::{FilmTile, Image, SumPlane};
use steradian::internal::math::Rng;
use steradian::internal::render::{self, Overrides, Shard, StateFile};

use crate::checkpoints::{Kit, scene};
use crate::interrupted::channels;
use crate::participating_media::foggy;

/// Writes shards, and returns their files.
fn written(kit: &Kit, folder: &Path, shards: impl IntoIterator<Item = Shard>) -> Vec<PathBuf> {
    let write = |shard: Shard| {
        let path = folder.join(format!("{}-of-{}.shard", shard.index, shard.count));
        let state = kit.render(shard);
        assert!(state.complete && state.missing(kit.prepared.settings.spp).is_empty());
        StateFile::take(&path).unwrap().replace(|out| state.write(&kit.header(shard), out)).unwrap();
        path
    };
    shards.into_iter().map(write).collect()
}

fn all(count: u32) -> impl Iterator<Item = Shard> {
    (1..=count).map(move |index| Shard { index, count })
}

fn overrides(spp: u32) -> Overrides {
    Overrides { spp: Some(spp), threads: Some(2), ..Overrides::default() }
}

/// Asserts that two pictures have the same bits in every layer, and the same shapes of the same share in every pixel.
#[track_caller]
fn assert_same_bits(a: &Image, b: &Image) {
    let kinds = |image: &Image| image.layers.iter().map(|layer| (layer.kind, layer.group.clone())).collect::<Vec<_>>();
    assert_eq!(kinds(a), kinds(b));
    assert!(a.layers.len() > 20, "{:?}", kinds(a));
    for (layer, other) in a.layers.iter().zip(&b.layers) {
        let differ = layer.data.iter().zip(&other.data).filter(|(x, y)| x.to_bits() != y.to_bits()).count();
        assert_eq!(differ, 0, "{:?} {:?}", layer.kind, layer.group);
    }
    assert!(a.coverage.is_some() && a.coverage == b.coverage);
}

#[test]
fn shards_make_the_picture_of_one_run() {
    let mut rng = Rng::new(1);
    for scene in [scene("blackman_harris"), scene("mitchell"), foggy(6)] {
        let kit = Kit::new(&scene, &overrides(23));
        let whole = kit.render(Shard::WHOLE);
        let image = whole.film.resolve();
        for count in [2, 3 + rng.below(6) as u32, 23] {
            let folder = tempfile::tempdir().unwrap();
            let mut files = written(&kit, folder.path(), all(count));
            for i in (1..files.len()).rev() {
                files.swap(i, rng.below(i + 1));
            }
            let merged = render::merge(&files, false).unwrap();
            assert_same_bits(&merged.state.film.resolve(), &image);
            assert_eq!((merged.state.done, merged.partial, merged.state.rays), (23, None, whole.rays));
            assert_eq!(merged.state.film.dropped_count(), whole.film.dropped_count());
        }
    }
}

#[test]
fn what_is_missing_double_or_foreign_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let kit = Kit::new(&scene("box"), &overrides(8));
    let files = written(&kit, folder.path(), all(4));
    let refusal = |files: &[&PathBuf], partial: bool| {
        let error = render::merge(&files.iter().map(|&file| file.clone()).collect::<Vec<_>>(), partial).unwrap_err();
        assert_eq!(error.kind(), steradian::ErrorKind::Checkpoint, "{error}");
        error.to_string()
    };
    let [a, b, c, d] = &files[..] else { panic!() };
    assert!(refusal(&[c, a], false).contains("shards 1,3 of 4; --partial merges what is there"));
    let copy = folder.path().join("copy.shard");
    std::fs::copy(b, &copy).unwrap();
    let double = refusal(&[a, b, c, d, &copy], true);
    assert!(
        double.contains("copy.shard: shard 2/4 is there twice") && double.contains("2-of-4.shard has it too"),
        "{double}"
    );

    let other = tempfile::tempdir().unwrap();
    let change = |overrides: Overrides, count: u32, expected: &str| {
        let foreign = written(&Kit::new(&scene("box"), &overrides), other.path(), [Shard { index: 2, count }]);
        let refused = refusal(&[a, &foreign[0], c, d], true);
        assert!(refused.contains(&format!("{}: ", foreign[0].display())) && refused.contains(expected), "{refused}");
    };
    change(Overrides { seed: Some(9), ..overrides(8) }, 4, "seed: 9 here, 0 there");
    change(overrides(9), 4, "spp: 9 here, 8 there");
    change(overrides(8), 3, "shards: 3 here, 4 there");
    let settings = Overrides { max_depth: Some(2), ..overrides(8) };
    change(settings, 4, "integrator.max_depth: 2 here, 5 there");

    // A cut and an altered one.
    let bytes = std::fs::read(b).unwrap();
    std::fs::write(&copy, &bytes[..bytes.len() - 100]).unwrap();
    assert!(refusal(&[a, &copy, c, d], true).contains("copy.shard: the file is cut short"));
    let mut altered = bytes.clone();
    let seed = bytes.windows(10).position(|w| w == b"\"seed\":\"0\"").unwrap();
    altered[seed + 8] = b'7';
    std::fs::write(&copy, &altered).unwrap();
    assert!(refusal(&[a, &copy, c, d], true).contains("copy.shard: the file was altered"));
    std::fs::remove_file(&copy).unwrap();
    assert!(matches!(render::merge(&[a.clone(), copy], true), Err(steradian::Error::Missing { .. })));
}

#[test]
fn what_is_there_can_be_merged() {
    let folder = tempfile::tempdir().unwrap();
    let kit = Kit::new(&scene("box"), &overrides(9));
    let files = written(&kit, folder.path(), [1, 3].map(|index| Shard { index, count: 3 }));
    let merged = render::merge(&files, true).unwrap();
    assert_eq!((merged.state.done, merged.partial.as_deref()), (6, Some("shards 1,3 of 3")));
    let mut by_hand = kit.render(Shard { index: 1, count: 3 });
    by_hand.film.merge(&kit.render(Shard { index: 3, count: 3 }).film);
    assert_same_bits(&merged.state.film.resolve(), &by_hand.film.resolve());
    // A shard that was stopped.
    let shard = Shard { index: 2, count: 3 };
    let path = folder.path().join("stopped.shard");
    let mut stopped = kit.start(shard);
    stopped.done = 1;
    StateFile::take(&path).unwrap().replace(|out| stopped.write(&kit.header(shard), out)).unwrap();
    let files = [files, vec![path]].concat();
    let refused = render::merge(&files, false).unwrap_err().to_string();
    assert!(refused.contains("stopped.shard: 1 of 3 samples of shard 2/3"), "{refused}");
    assert_eq!(render::merge(&files, true).unwrap().partial.as_deref(), Some("1 of 3 samples of shard 2/3"));
}

/// Tiles of other pixels or layers, and bytes of anything else, are refused and never a panic.
#[test]
fn tiles_take_only_their_own_bytes() {
    let kit = Kit::new(&scene("mitchell"), &overrides(2));
    let state = kit.render(Shard::WHOLE);
    let tiles = state.film.tiles();
    let load = |tile: &FilmTile, bytes: &[u8]| {
        let mut tile = tile.empty();
        tile.load(bytes).map(|()| tile.save())
    };
    let saved = tiles[0].save();
    assert!(load(&tiles[0], &saved).unwrap() == saved);
    assert!(load(&tiles[1], &saved).is_err());
    let mut rng = Rng::new(2);
    for _ in 0..200 {
        assert!(load(&tiles[0], &saved[..rng.below(saved.len())]).is_err());
        let mut other = saved.clone();
        let place = rng.below(other.len());
        other[place] = rng.bits() as u8;
        // Other numbers are as good; other lengths are not.
        let _ = load(&tiles[0], &other);
    }
}

/// Numbers of single precision over a number of decades, split and added up again in any order: of one sign or of both,
/// and in pairs that cancel.
#[test]
fn sums_do_not_depend_on_how_their_terms_are_split() {
    let mut rng = Rng::new(4);
    for (decades, signed, cancelling) in
        [(10.0, false, false), (36.0, false, false), (75.0, false, false), (75.0, true, false), (10.0, true, true)]
    {
        for _ in 0..2000 {
            let mut term = || {
                let size = (rng.unit() * 10f64.powf(decades * (rng.unit() - 0.5))) as f32;
                f64::from(if signed && rng.below(2) == 0 { -size } else { size })
            };
            let mut terms: Vec<f64> = (0..50).map(|_| term()).collect();
            if cancelling {
                (0..24).for_each(|i| terms[49 - i] = -terms[i]);
            }
            let sum = |terms: &[f64]| {
                let mut sum = SumPlane::<1>::new(1);
                terms.iter().for_each(|&x| sum.add(0, [x]));
                sum
            };
            let mut parts: Vec<SumPlane<1>> = terms.chunks(1 + rng.below(50)).map(sum).collect();
            let mut merged = SumPlane::new(1);
            while !parts.is_empty() {
                merged.merge(&parts.swap_remove(rng.below(parts.len())), 1.0);
            }
            assert_eq!(
                merged.values(0)[0].to_bits(),
                sum(&terms).values(0)[0].to_bits(),
                "{decades}, {signed}, {cancelling}: {terms:?}"
            );
        }
    }
}

// What follows runs the program.

fn run(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(folder).args(line.split_whitespace()).output().unwrap()
}

#[track_caller]
fn assert_code(output: &Output, code: i32, part: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(code) && text.contains(part), "{:?}: {text}", output.status);
}

#[test]
fn the_program_splits_and_merges() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut scene = scene("mitchell");
    let layers = ["Z", "N", "albedo", "variance", "samples", "light_groups", "diffuse_direct"];
    scene["outputs"] = serde_json::json!([
        { "file": "x.exr", "layers": layers, "pixel_type": "float" }, { "file": "x.png", "exposure": 1 }
    ]);
    std::fs::write(folder.join("scene.json"), scene.to_string()).unwrap();
    assert_code(&run(folder, "render scene.json -q"), 0, "");
    for shard in 1..=3 {
        assert_code(
            &run(folder, &format!("render scene.json --shard {shard}/3 -q --checkpoint {shard}.state --resume")),
            0,
            "",
        );
    }
    let merge = "merge scene.3-of-3.shard scene.1-of-3.shard scene.2-of-3.shard";
    assert_code(
        &run(folder, &format!("{merge} -o m.exr -o m.png")),
        0,
        "24 samples per pixel\nwrote m.exr\nwrote m.png",
    );
    let (merged, whole) = (channels(&folder.join("m.exr")), channels(&folder.join("x.exr")));
    assert!(whole.len() > 20 && merged == whole, "{}", whole.len());
    assert!(std::fs::read(folder.join("m.png")).unwrap() == std::fs::read(folder.join("x.png")).unwrap());

    let cases = [
        ("merge scene.3-of-3.shard scene.1-of-3.shard -o p.exr", 6, "shards 1,3 of 3"),
        ("merge scene.3-of-3.shard scene.3-of-3.shard -o p.exr", 6, "is there twice"),
        ("merge scene.3-of-3.shard -o missing/p.exr", 5, "missing"),
        ("merge scene.3-of-3.shard -o p.gif", 2, ".gif"),
        ("merge gone.shard -o p.exr", 4, "gone.shard"),
        ("merge scene.json -o p.exr", 6, "this is not a checkpoint or shard"),
        ("merge", 2, "required"),
        ("render scene.json --shard 4/3", 2, "--shard"),
        ("render scene.json --shard 1/30", 2, "only 24 samples"),
        ("render scene.json --shard 1/3 -o a.exr", 2, "ends with .shard"),
        ("render scene.json --shard 1/3 --target-error 0.1", 2, "--shard: not with --target-error"),
        ("render scene.json --shard 1/3 --guiding", 2, "--shard: not with guiding"),
        ("render scene.json --shard 1/3 -o missing/a.shard", 5, "missing"),
    ];
    for (line, code, part) in cases {
        assert_code(&run(folder, line), code, part);
    }
    let partial = run(folder, "merge scene.3-of-3.shard scene.1-of-3.shard -o p.exr --partial");
    assert_code(&partial, 0, "16 samples per pixel (shards 1,3 of 3)");
    let header = std::fs::read(folder.join("p.exr")).unwrap();
    let holds = |text: &[u8]| header.windows(text.len()).any(|window| window == text);
    assert!(holds(b"steradian/partial") && holds(b"shards 1,3 of 3"));
}

/// Writes a file with another header, its checksum made right again.
fn with_header(file: &Path, to: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let bytes = std::fs::read(file).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut header = serde_json::from_slice(&bytes[16..16 + length]).unwrap();
    change(&mut header);
    let header = header.to_string();
    let mut out =
        [&bytes[..12], &(header.len() as u32).to_le_bytes(), header.as_bytes(), &bytes[16 + length..bytes.len() - 32]]
            .concat();
    out.extend(blake3::hash(&out).as_bytes());
    std::fs::write(to, out).unwrap();
}

#[test]
fn headers_that_make_no_sense_are_refused() {
    use serde_json::json;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("scene.json"), scene("box").to_string()).unwrap();
    assert_code(&run(folder, "render scene.json -q --size 24x16 --spp 2 --shard 1/2 -o a.shard"), 0, "");
    let huge = 4_000_000_000_u32;
    let cases: [(&str, serde_json::Value, &str); 9] = [
        ("/shard/count", json!(0), "no shard 1 of 0"),
        ("/shard/index", json!(0), "no shard 0 of 2"),
        ("/shard/index", json!(3), "no shard 3 of 2"),
        ("/film/layers/0", json!("beauté\u{1b}"), "unknown layer"),
        ("/film/crop", json!([1, 0, huge, 16]), "not within"),
        ("/film/crop", json!([0, 0, 0, 0]), "a.shard"),
        ("/film/size", json!([0, 0]), "not within"),
        ("/film/overscan", json!(12), "not within"),
        ("/done", json!(huge), "samples per pixel are done"),
    ];
    for (place, value, part) in cases {
        with_header(&folder.join("a.shard"), &folder.join("altered_a.shard"), |header| {
            *header.pointer_mut(place).unwrap() = value.clone();
        });
        let output = run(folder, "merge altered_a.shard --partial -o a.exr");
        assert_code(&output, 6, part);
        assert!(
            !String::from_utf8_lossy(&output.stderr).contains("\u{1b}") && !folder.join("a.exr").exists(),
            "{place}"
        );
    }
    with_header(&folder.join("a.shard"), &folder.join("large.shard"), |header| {
        header["film"]["size"] = json!([huge, huge]);
        header["film"]["crop"] = json!([0, 0, huge, huge]);
    });
    assert_code(&run(folder, "merge large.shard --partial -o a.exr"), 6, "a part is missing");
    // A name out of the shard does not leave the folder.
    with_header(&folder.join("a.shard"), &folder.join("outside.shard"), |header| {
        header["outputs"][0]["file"] = json!("../out.exr");
    });
    assert_code(&run(folder, "merge outside.shard --partial"), 2, "-o");
    assert_code(&run(folder, "merge outside.shard --partial -o a.exr"), 0, "wrote a.exr");
}
