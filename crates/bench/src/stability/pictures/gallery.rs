//! Samples that are no numbers, and pixels far too bright, in the scenes that come with the program.

use std::fs;
use std::path::Path;

use super::{Effort, Faults, Outcome, luminance};
use crate::accel::AccelKind;
use crate::film::Image;
use crate::render::{Overrides, Settings};
use crate::stability::render::{Prepared, not_finite, render_with};
use crate::{compile, import};
use steradian::{ErrorKind, Result};

/// Scenes without files beside them.
const BUILT_IN: [(&str, &str); 3] = [
    ("cornell", include_str!("../../../scenes/cornell.json")),
    ("glass", include_str!("../../../scenes/glass.json")),
    ("phi_max", include_str!("../../../scenes/phi_max.json")),
];

/// How many times the median of its surroundings a firefly is.
const FIREFLY: f64 = 20.0;

/// What the pictures of a scene hold.
#[derive(Default)]
struct Found {
    /// Samples that were dropped, and numbers of the picture that are not finite.
    invalid: Faults,
    /// Pixels that are fireflies in one picture and not in the other, which has another seed: what both show is a lamp.
    fireflies: usize,
    pixels: usize,
    /// Whether there are mirrors or smooth glass: light that they gather is found by chance alone.
    caustics: bool,
}

/// Whether each pixel is a firefly among the 24 around it.
fn fireflies(image: &Image) -> Vec<bool> {
    let [width, height] = image.size.map(|side| side as usize);
    let light = luminance(image);
    let is_firefly = |i: usize| {
        let (x, y) = (i % width, i / width);
        let mut around: Vec<f64> = Vec::with_capacity(25);
        for row in y.saturating_sub(2)..(y + 3).min(height) {
            around.extend(&light[row * width + x.saturating_sub(2)..row * width + (x + 3).min(width)]);
        }
        around.sort_by(f64::total_cmp);
        // Of an odd number or the upper of both middle ones; a black surrounding has no fireflies but what is seen
        // directly.
        let median = around[around.len() / 2];
        median > 0.0 && light[i] > FIREFLY * median
    };
    (0..width * height).map(is_firefly).collect()
}

fn examine(desc: &crate::desc::SceneDesc, path: &Path, effort: Effort) -> Result<Found> {
    let (side, spp) = effort.pick((32, 16), (64, 64));
    let scene = compile::compile(desc, path)?;
    let overrides =
        Overrides { size: Some([side; 2]), spp: Some(spp), threads: Some(2), seed: Some(1), ..Overrides::default() };
    let mut prepared = Prepared { scene, settings: Settings::new(desc, &overrides)? };
    let caustics = prepared.scene.features.delta_materials;
    let mut found = Found { pixels: (side * side) as usize, caustics, ..Found::default() };
    let mut bright: Vec<Vec<bool>> = Vec::new();
    for seed in [1, 2] {
        prepared.settings.seed = seed;
        let result = render_with(&prepared, AccelKind::EMBREE);
        let dropped = &result.stats.dropped;
        found.invalid.add(result.stats.nan_samples as usize, || format!("seed {seed}: {:?}", dropped.first()));
        found.invalid += not_finite(&result.image);
        bright.push(fireflies(&result.image));
    }
    found.fireflies = bright[0].iter().zip(&bright[1]).filter(|(a, b)| a != b).count();
    Ok(found)
}

/// What was found in each scene, by its name.
type Scenes = Vec<(String, Result<Found>)>;

/// The scenes of the folder `scenes`, if it is there, but those whose meshes a script would have to fetch.
fn from_folder(effort: Effort) -> Scenes {
    let entries = fs::read_dir("scenes").into_iter().flatten().flatten();
    let mut paths: Vec<_> =
        entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "json")).collect();
    paths.sort();
    let name = |path: &Path| path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let found = |path: &Path| import::load_scene(path).and_then(|desc| examine(&desc, path, effort));
    let is_there = |found: &Result<Found>| !matches!(found, Err(e) if e.kind() == ErrorKind::AssetMissing);
    paths.iter().map(|path| (name(path), found(path))).filter(|(_, found)| is_there(found)).collect()
}

fn built_in(effort: Effort) -> Scenes {
    let path = Path::new("scene.json");
    let found = |text: &str| import::parse_scene(text, path).and_then(|desc| examine(&desc, path, effort));
    BUILT_IN.iter().map(|(name, text)| ((*name).to_owned(), found(text))).collect()
}

/// The scenes that were rendered, those that were not, and what is not finite in the pictures.
fn sorted(scenes: Scenes) -> (Vec<(String, Found)>, Faults, Faults) {
    let (mut rendered, mut failed, mut invalid) = (Vec::new(), Faults::NONE, Faults::NONE);
    for (name, found) in scenes {
        match found {
            Ok(found) => {
                let first = found.invalid.first.as_deref().unwrap_or_default();
                invalid.add(found.invalid.count, || format!("{name}: {first}"));
                rendered.push((name, found));
            }
            Err(error) => failed.add(1, || format!("{name}: {error}")),
        }
    }
    (rendered, failed, invalid)
}

pub(super) fn r8_gallery(effort: Effort) -> Outcome {
    let mut scenes = if effort == Effort::Full { from_folder(effort) } else { Vec::new() };
    let from_folder = scenes.len();
    if scenes.is_empty() {
        scenes = built_in(effort);
    }
    let (scenes, failed, invalid) = sorted(scenes);
    let share = |found: &Found| found.fireflies as f64 / found.pixels as f64;
    let mut outcome = Outcome::new()
        .at_least("scenes rendered", scenes.len() as f64, BUILT_IN.len() as f64)
        .none("scenes that end in an error", failed)
        .record("of them from the folder scenes", from_folder as f64)
        .none("samples and pixels that are not finite", invalid);
    // What R5 leaves out of its error too: a thousandth.
    for (caustics, what) in [(false, "without mirrors and smooth glass"), (true, "with them")] {
        let shares: Vec<f64> =
            scenes.iter().filter(|(_, found)| found.caustics == caustics).map(|(_, found)| share(found)).collect();
        let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
        let what = format!("share of pixels that are fireflies, {} scenes {what}", shares.len());
        outcome = if caustics { outcome.record(what, mean) } else { outcome.at_most(what, mean, 1e-3) };
    }
    for (name, found) in scenes.iter().filter(|(_, found)| found.fireflies > 0) {
        outcome = outcome.record(format!("fireflies of {} pixels of {name}", found.pixels), found.fireflies as f64);
    }
    outcome
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian::Error;

    #[test]
    fn scenes_that_fail_and_numbers_that_are_not_finite_are_counterexamples() {
        let image = Image::of_color([2, 1], vec![1.0, 1.0, 1.0, 1.0, 0.5, f32::NAN, 0.0, 1.0]);
        let bad = Found { invalid: not_finite(&image), ..Found::default() };
        let scenes = [("good", Ok(Found::default())), ("none", Err(Error::Usage("no file".into()))), ("bad", Ok(bad))];
        let (rendered, failed, invalid) = sorted(scenes.map(|(name, found)| (name.to_owned(), found)).into());
        assert_eq!((rendered.len(), failed.count, invalid.count), (2, 1, 1));
        assert_eq!(failed.first.as_deref(), Some("none: no file"));
        assert_eq!(invalid.first.as_deref(), Some("bad: number 5 of layer Color is NaN"));
    }
}
