//! Every reader accepts or refuses each file of `tests/regressions`, and each that fuzzing found, without a panic.

#[path = "../fuzz/harness.rs"]
mod harness;

use crate::util::root;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use flate2::read::GzDecoder;

const KINDS: [&str; 13] = [
    "scene_json",
    "obj",
    "ply",
    "image",
    "mitsuba_xml",
    "pbrt",
    "gltf",
    "config",
    "recipe",
    "strands",
    "volume",
    "vdb",
    "measured",
];

fn check(kind: &str, bytes: &[u8], folder: &Path, file: &Path) {
    let start = Instant::now();
    harness::read(kind, bytes, folder);
    assert!(start.elapsed() < Duration::from_secs(10), "{}", file.display());
}

#[test]
fn every_named_file_is_read_or_refused() {
    let regressions = root().join("tests/regressions");
    let folder = tempfile::tempdir().unwrap();
    for kind in KINDS {
        let files: Vec<_> =
            std::fs::read_dir(regressions.join(kind)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{kind}");
        for file in files {
            check(kind, &std::fs::read(&file).unwrap(), folder.path(), &file);
        }
    }
}

/// `fuzz/corpus.tar.gz` has files `corpus/KIND/NAME`.
#[test]
fn every_file_of_the_corpus_is_read_or_refused() {
    let archive = root().join("fuzz/corpus.tar.gz");
    let folder = tempfile::tempdir().unwrap();
    let mut counts = [0; KINDS.len()];
    for entry in tar::Archive::new(GzDecoder::new(File::open(archive).unwrap())).entries().unwrap() {
        let mut entry = entry.unwrap();
        if entry.header().entry_type().is_dir() {
            continue;
        }
        let file = entry.path().unwrap().into_owned();
        let kind = file.iter().nth(1).unwrap().to_str().unwrap().to_owned();
        let which =
            KINDS.iter().position(|known| *known == kind).unwrap_or_else(|| panic!("{}: no such kind", file.display()));
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        check(&kind, &bytes, folder.path(), &file);
        counts[which] += 1;
    }
    // Recipes, strands, volumes and measured materials have named files only.
    assert!(counts[..KINDS.len() - 5].iter().all(|count| *count > 50), "{counts:?}");
}
