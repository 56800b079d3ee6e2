//! The scenes that come with the program: all of them render, and their README shows them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use steradian::desc::LayerKind;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::LayerSet;
use steradian::internal::render::{Overrides, Settings};
use steradian::internal::{compile, import};

use crate::util::render::{Prepared, pixels, render_with};
use crate::util::root;

/// Pictures in the repository stay small.
const MAX_PICTURE_BYTES: u64 = 100_000;

fn folder() -> PathBuf {
    root().join("scenes")
}

/// The names of the files with this extension in a folder, without it.
fn names(folder: &Path, extension: &str) -> BTreeSet<String> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let stem = |path: PathBuf| path.file_stem().unwrap().to_string_lossy().into_owned();
    paths.filter(|path| path.extension().is_some_and(|e| e == extension)).map(stem).collect()
}

#[test]
fn every_scene_renders_and_with_all_layers_the_same() {
    assert_same_with_layers(names(&folder(), "json").into_iter().filter(|name| name != "scan").collect());
}

#[test]
#[ignore = "needs the scans: scenes/get_scans.sh dragon"]
fn the_scan_renders_and_with_all_layers_the_same() {
    assert_same_with_layers(vec!["scan".to_owned()]);
}

fn assert_same_with_layers(scenes: Vec<String>) {
    let overrides = Overrides {
        spp: Some(1),
        size: Some([40, 40]),
        threads: Some(2),
        layers: vec![LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo],
        outputs: vec!["all.exr".into()],
        ..Overrides::default()
    };
    for name in scenes {
        let path = folder().join(&name).with_extension("json");
        let desc = import::load_scene(&path).unwrap();
        let settings = Settings::new(&desc, &overrides).unwrap();
        let scene = compile::compile(&desc, &path).unwrap();
        let mut prepared = Prepared { scene, settings };
        let all = render_with(&prepared, AccelKind::EMBREE);
        assert_eq!(all.stats.nan_samples, 0, "{name}");
        prepared.settings.layers = LayerSet::COLOR;
        let color = render_with(&prepared, AccelKind::EMBREE);
        assert!(pixels(&all.image).eq(pixels(&color.image)) && all.stats.rays == color.stats.rays, "{name}");
        let lit = pixels(&color.image).filter(|pixel| pixel.iter().any(|c| *c > 0.0)).count();
        assert!(lit >= 400, "{name}: {lit} pixels of 1600 are not black");
    }
}

#[test]
fn the_readme_shows_every_scene_and_every_picture() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    let script = fs::read_to_string(folder().join("render_gallery.sh")).unwrap();
    for scene in names(&folder(), "json") {
        assert!(readme.contains(&format!("`{scene}.json`")), "scenes/README.md does not name {scene}.json");
    }
    let pictures = names(&folder().join("pictures"), "png");
    for picture in &pictures {
        assert!(readme.contains(&format!("(pictures/{picture}.png)")), "scenes/README.md does not show {picture}.png");
        assert!(
            script.lines().any(|line| line.split(' ').next() == Some(picture)),
            "render_gallery.sh does not render {picture}.png"
        );
        let bytes = fs::metadata(folder().join("pictures").join(picture).with_extension("png")).unwrap().len();
        assert!(bytes < MAX_PICTURE_BYTES, "{picture}.png has {bytes} bytes");
    }
    for shown in readme.split("(pictures/").skip(1) {
        let name = shown.split(".png)").next().unwrap();
        assert!(pictures.contains(name), "pictures/{name}.png is missing");
    }
}
