//! Files that fuzzing found worth keeping: every reader takes or refuses them, and none panics.

#[path = "../fuzz/harness.rs"]
mod harness;

use std::path::Path;
use std::time::{Duration, Instant};

#[test]
fn every_file_is_read_or_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let folder = tempfile::tempdir().unwrap();
    for kind in ["scene_json", "obj", "ply", "image", "mitsuba_xml", "pbrt", "gltf", "recipe"] {
        let files: Vec<_> = std::fs::read_dir(corpus.join(kind)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{kind}");
        for file in files {
            let start = Instant::now();
            harness::read(kind, &std::fs::read(&file).unwrap(), folder.path());
            assert!(start.elapsed() < Duration::from_secs(10), "{}", file.display());
        }
    }
}
