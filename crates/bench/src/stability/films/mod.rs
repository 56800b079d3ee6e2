//! Group M: films.

mod files;
mod filters;

use serde_json::{Value, json};
use statrs::distribution::{ContinuousCDF, Normal};

use files::m7_files;
use filters::{m1_integrals, m2_sampled_filters};

use super::geometry::Rng;
use super::render::{Estimate, not_finite, pixels, prepare, render, render_with};
use super::{Effort, Faults, Outcome, sidak_level};
use crate::accel::AccelKind;
use crate::color::Rgb;
use crate::desc::{FilterDesc, FilterSamplesDesc};
use crate::film::{
    Crop, Film, FilmShape, FilmTile, Filter, Image, LayerKind, LayerSet, LightAovSample, PixelSample, Sample, Splats,
    SurfaceSample, WorldSample,
};
use crate::render::Overrides;

checks! {
    "M1" m1_integrals "integrals of filters":
        "ten filters against closed forms by 256 x 256 midpoints; nothing outside of the radius (pbrt-v4, \
         filters_test)";
    "M2" m2_sampled_filters "samples follow their filter":
        "mass of each half pixel against the filter's integral, negative lobes included, and χ² tests in 16 x 16 \
         cells: what splatting onto 5 x 5 pixels tests where a sample touches one pixel (Mitsuba, test_imageblock)";
    "M3" m3_constants "a constant stays constant":
        "radiance 1 with every filter, tiles of 1, 7 and 64 pixels, crops, one to five samples; and rendered pictures \
         of a white sky";
    "M4" m4_same_bytes "the same bytes for any number of threads and order of tiles":
        "a scene with lens, glass and gold by 1, 2, 3 and 8 threads; tiles filled forward, backward and shuffled; the \
         bytes of PNG files";
    "M5" m5_no_clamping "rare bright samples keep their share":
        "one sample in a million of radiance a million; Pareto samples of exponent 1.8; lights over a thousandth of \
         each pixel";
    "M6" m6_spoilt_samples "samples that are no numbers":
        "NaN and infinities in radiance, alpha, weight and depth, between good samples; negative radiance";
    "M7" m7_files "files come back":
        "EXR of every layer with each compression, floats and halves; all codes of a PNG; sums of a million samples \
         (pbrt-v4, image_test)";
}

fn gray(v: f32) -> PixelSample {
    PixelSample { radiance: Rgb::splat(v), alpha: 1.0 }
}

fn film(shape: FilmShape, tile_size: u32) -> Film {
    Film::new(shape, tile_size).expect("crops of checks fit")
}

fn one_pixel() -> Film {
    film(FilmShape::new([1, 1], Crop::full([1, 1]), LayerSet::COLOR), 16)
}

/// Adds samples of pixels as renders do.
struct Filtering {
    filter: Filter,
    rng: Rng,
    splats: Splats,
}

impl Filtering {
    fn add(&mut self, tile: &mut FilmTile, pixel: usize, sample: u32, value: &PixelSample) {
        let place = self.filter.sample(self.rng.pair());
        if self.filter.is_shared() {
            let at = WorldSample { sample, place, ..tile.world_sample(pixel) };
            tile.splat(&at, value, &self.filter, &mut self.splats);
            tile.flush(pixel, &mut self.splats);
        } else {
            tile.add(pixel, sample, value, place.weight);
        }
    }
}

/// Filters applied in both ways.
fn filters() -> impl Iterator<Item = FilterDesc> {
    [FilterSamplesDesc::Shared, FilterSamplesDesc::Importance].into_iter().flat_map(Filter::examples)
}

/// The mean of these values by a film of one pixel.
fn mean_by_film(values: impl Iterator<Item = f32>) -> f64 {
    let mut film = one_pixel();
    for (i, value) in values.enumerate() {
        film.tiles_mut()[0].add(0, i as u32, &gray(value), 1.0);
    }
    f64::from(film.resolve().pixel(LayerKind::Color, 0, 0).map_or(f32::NAN, |p| p[0]))
}

fn m3_constants(effort: Effort) -> Outcome {
    let mut filtering =
        Filtering { filter: Filter::new(&FilterDesc::default()), rng: Rng::new(3), splats: Splats::default() };
    let (mut worst, mut short) = (0f64, Faults::NONE);
    let error = |image: &Image| image.layers[0].data.iter().map(|v| f64::from((v - 1.0).abs())).fold(0.0, f64::max);
    for (desc, tile_size) in filters().flat_map(|desc| [1, 7, 64].map(|size| (desc, size))) {
        filtering.filter = Filter::new(&desc);
        for crop in [Crop::full([20, 13]), Crop { x: 3, y: 5, width: 11, height: 7 }] {
            for _ in 0..effort.pick(1, 40) {
                let mut film =
                    film(FilmShape { filter: desc, ..FilmShape::new([20, 13], crop, LayerSet::COLOR) }, tile_size);
                for tile in film.tiles_mut() {
                    for pixel in 0..tile.size().iter().product::<u32>() as usize {
                        for sample in 0..(1 + pixel as u32 % 5) {
                            filtering.add(tile, pixel, sample, &gray(1.0));
                        }
                    }
                }
                let image = film.resolve();
                short.require(image.layers[0].data.len() == crop.area() as usize * 4, || format!("{desc:?}, {crop:?}"));
                worst = worst.max(error(&image));
            }
        }
    }
    let mut rendered = 0f64;
    for filter in ["box", "tent", "gaussian", "blackman_harris", "mitchell"] {
        for crop in [json!(null), json!([5, 3, 17, 30])] {
            let mut scene = json!({
                "film": { "width": 40, "height": 35, "filter": { "type": filter } }, "sampler": { "spp": 3 },
                "camera": { "position": [0, 0, 0], "look_at": [0, 0, -1] },
                "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
            });
            if !crop.is_null() {
                scene["film"]["crop"] = crop;
            }
            let image = render(&scene);
            rendered = image.layers[0]
                .pixels()
                .flat_map(|p| &p[..3])
                .map(|v| f64::from((v - 1.0).abs()))
                .fold(rendered, f64::max);
        }
    }
    Outcome::new().at_most("error of films", worst, 2e-6).none("pictures without all of their pixels", short).at_most(
        "error of rendered skies",
        rendered,
        2e-6,
    )
}

/// What may differ if work is divided otherwise.
fn lively_scene() -> Value {
    json!({
        "film": { "width": 75, "height": 50 },
        "camera": { "position": [0, 1.2, 4], "look_at": [0, 0.5, 0], "lens": { "radius": 0.05, "focus_distance": 4 } },
        "sampler": { "spp": 7 },
        "materials": {
            "glass": { "type": "dielectric" }, "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 }
        },
        "shapes": [
            { "type": "quad", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            { "type": "cube", "material": "gold", "transform": [{ "scale": 0.4 }, { "translate": [0.7, 0.4, -0.3] }] }
        ],
        "lights": [
            { "type": "environment", "radiance": [0.2, 0.3, 0.4] },
            { "type": "point", "position": [1, 3, 1], "intensity": [5, 5, 5] }
        ]
    })
}

/// The bytes of a picture's numbers.
fn bytes(image: &Image) -> Vec<u8> {
    image.layers.iter().flat_map(|layer| layer.data.iter().flat_map(|v| v.to_le_bytes())).collect()
}

/// A film whose tiles are filled in this order, each sample in that of its index.
fn filled(order: &[usize], desc: &FilterDesc) -> Film {
    let mut film =
        film(FilmShape { filter: *desc, ..FilmShape::new([40, 30], Crop::full([40, 30]), LayerSet::FULL) }, 8);
    let mut filtering = Filtering { filter: Filter::new(desc), rng: Rng::new(0), splats: Splats::default() };
    for &tile in order {
        // Films of shared samples have more.
        let Some(tile) = film.tiles_mut().get_mut(tile) else { continue };
        let [x, y] = tile.origin();
        filtering.rng = Rng::new(u64::from(x * 64 + y));
        for sample in 0..5 {
            for pixel in 0..tile.size().iter().product::<u32>() as usize {
                let value = gray((filtering.rng.magnitude(-3.0, 3.0)) as f32);
                filtering.add(tile, pixel, sample, &value);
            }
        }
    }
    film
}

fn m4_same_bytes(effort: Effort) -> Outcome {
    let spp = effort.pick(7, 64);
    let of = |threads: usize| {
        let overrides = Overrides { threads: Some(threads), spp: Some(spp), ..Overrides::default() };
        render_with(&prepare(&lively_scene(), &overrides), AccelKind::EMBREE).image
    };
    let alone = of(1);
    let differ = Faults::of(
        &[2, 3, 8],
        |&threads| usize::from(bytes(&of(threads)) != bytes(&alone)),
        |threads| format!("{threads} threads"),
    );

    let [of_lobes, shared] = [Filter::EXAMPLES[8], Filter::examples(FilterSamplesDesc::Shared)[8]];
    let tiles: Vec<usize> = (0..filled(&[], &shared).tiles().len()).collect();
    let pictures = |order: &[usize]| [&of_lobes, &shared].map(|desc| bytes(&filled(order, desc).resolve()));
    let expected = pictures(&tiles);
    let mut rng = Rng::new(4);
    let mut orders = vec![tiles.iter().rev().copied().collect::<Vec<_>>()];
    for _ in 0..effort.pick(10, 1_000) {
        let mut order = tiles.clone();
        order.sort_by_cached_key(|_| rng.bits());
        orders.push(order);
    }
    let shuffled = Faults::of(&orders, |order| usize::from(pictures(order) != expected), |order| format!("{order:?}"));
    let files = files::differing_files(&[1, 2, 8].map(|threads| (threads, of(threads))));
    Outcome::new()
        .none("numbers of threads with other bits than one thread", differ)
        .none("orders of tiles with other bits", shuffled)
        .none("files of other bytes", files)
}

fn m5_no_clamping(effort: Effort) -> Outcome {
    let rare = mean_by_film((0..1_000_000).map(|i| if i == 123_456 { 1e6 } else { 0.0 }));

    // Without variance; what the film makes of it must be the mean of the same numbers.
    let mut rng = Rng::new(5);
    let mut heavy = 0f64;
    for _ in 0..effort.pick(100, 5_000) {
        let values: Vec<f32> = (0..2_000).map(|_| (1.0 - rng.unit()).powf(-1.0 / 1.8) as f32).collect();
        let exact = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        heavy = heavy.max((mean_by_film(values.into_iter()) / exact - 1.0).abs());
    }

    // In each pixel a light over a thousandth of it.
    let (share, radiance) = (1e-3, 1e5);
    let side = f64::sqrt(share) / 32.0;
    let light = |i: u32| {
        let [x, y] = [i % 32, i / 32].map(|k| (f64::from(k) + 0.4) / 32.0 - 0.5);
        json!({
            "type": "quad", "origin": [x, y, 0], "edge_u": [side, 0, 0], "edge_v": [0, side, 0],
            "emission": { "radiance": [radiance, radiance, radiance] }
        })
    };
    let spp = effort.pick(256, 8_192);
    let image = render(&json!({
        "film": { "width": 32, "height": 32, "filter": { "type": "box" } },
        "sampler": { "type": "independent", "spp": spp },
        "integrator": { "type": "path", "max_depth": 1 },
        "camera": { "type": "orthographic", "position": [0, 0, 1], "look_at": [0, 0, 0], "view_height": 1 },
        "shapes": (0..1024).map(light).collect::<Vec<_>>()
    }));
    let Estimate { mean, .. } = Estimate::of(&image, 0);
    let deviation = radiance * (share * (1.0 - share) / (1024.0 * f64::from(spp))).sqrt();
    let z = (mean - share * radiance) / deviation;
    let p_value = Normal::new(0.0, 1.0).map_or(0.0, |law| 2.0 * law.sf(z.abs()));
    Outcome::new()
        .at_most("error of one bright sample in a million", (rare - 1.0).abs(), 0.0)
        .at_most("relative error of means of Pareto samples", heavy, 1e-6)
        .record("mean of lights of mean 100", mean)
        .at_least("p-value of that mean", p_value, sidak_level(1))
}

fn m6_spoilt_samples(effort: Effort) -> Outcome {
    let mut rng = Rng::new(6);
    let spoilt = |rng: &mut Rng| {
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][rng.below(3)];
        let good = SurfaceSample::default();
        match rng.below(4) {
            0 => (gray(bad), good, 1.0),
            1 => (PixelSample { alpha: bad, ..gray(1.0) }, good, 1.0),
            2 => (gray(1.0), SurfaceSample { depth: bad, ..good }, 1.0),
            _ => (gray(1.0), good, bad),
        }
    };
    let mut film = film(FilmShape::new([8, 8], Crop::full([8, 8]), LayerSet::FULL), 4);
    let (mut bad, mut taken, mut refused) = (0u64, Faults::NONE, Faults::NONE);
    for tile in film.tiles_mut() {
        for pixel in 0..16 {
            for sample in 0..effort.pick(50, 20_000) {
                if rng.below(4) == 0 {
                    let (value, surface, weight) = spoilt(&mut rng);
                    let value =
                        Sample { pixel: &value, surface: Some(&surface), light_aovs: LightAovSample::default() };
                    bad += 1;
                    let is_taken = tile.add(pixel, sample, value, weight);
                    taken.require(!is_taken, || format!("{value:?} of weight {weight}"));
                } else {
                    let is_taken = tile.add(pixel, sample, &gray(0.25), 1.0);
                    refused.require(is_taken, || format!("pixel {pixel}, sample {sample}"));
                }
            }
        }
    }
    let image = film.resolve();
    let found: Vec<_> = pixels(&image).enumerate().collect();
    let wrong = Faults::of(&found, |(_, p)| usize::from(*p != [0.25; 3]), |(i, p)| format!("pixel {i}: {p:?}"));
    let first = film.dropped().first().copied();
    let mut misplaced = Faults::NONE;
    misplaced.require(first.is_some_and(|d| d.x < 8 && d.y < 8), || format!("{first:?}"));
    let mut miscounted = Faults::NONE;
    let dropped = film.dropped_count();
    miscounted.add(dropped.abs_diff(bad) as usize, || format!("{dropped} of {bad} are counted"));
    Outcome::new()
        .record("spoilt samples", bad as f64)
        .none("spoilt samples taken", taken)
        .none("good samples refused", refused)
        .none("difference of the count of dropped samples", miscounted)
        .none("numbers of the picture that are not finite", not_finite(&image))
        .none("pixels that are not the mean of their good samples", wrong)
        .none("first dropped samples without a place to replay", misplaced)
        .record("mean of samples -1 and 3, kept as they are", mean_by_film([-1.0, 3.0].into_iter()))
        .short(
            "negative samples are kept, where the catalogue requires them to be dropped: images of an environment may \
             hold negative numbers, as those from wide gamuts do, and a mean without them would be biased",
        )
}
