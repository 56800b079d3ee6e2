use super::*;

use crate::color::Rgb;
use crate::desc::{FilterDesc, FilterSamplesDesc};
use crate::film::{
    FilmTile, Filter, LayerKind, LightAov, LightAovRequest, LightAovRows, LightAovSample, PixelSample, Sample,
    SampleBatch, Splats, SurfaceSample, WorldSample,
};
use crate::math::Vec3;

fn gray(v: f32) -> PixelSample {
    PixelSample { radiance: Rgb::splat(v), alpha: 1.0 }
}

fn one_pixel(layers: LayerSet) -> Film {
    Film::new(FilmShape::new([1, 1], Crop::full([1, 1]), layers), 16).unwrap()
}

fn color(film: &Film) -> [f32; 4] {
    film.resolve().pixel(LayerKind::Color, 0, 0).unwrap().try_into().unwrap()
}

/// A step edge through the filter's negative lobe: the mean over many pixels is the filter's integral over the bright
/// side.
#[test]
fn negative_lobes_overshoot_at_an_edge_without_bias() {
    let desc =
        FilterDesc::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0, samples: Some(FilterSamplesDesc::Importance) };
    let filter = Filter::new(&desc);
    let mut film =
        Film::new(FilmShape { filter: desc, ..FilmShape::new([1, 1], Crop::full([1, 1]), LayerSet::COLOR) }, 16)
            .unwrap();
    let edge = -1.0;
    let n = 1024;
    for i in 0..n {
        for j in 0..16 {
            let s = filter.sample([(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / 16.0]);
            film.tiles_mut()[0].add(0, i * 16 + j, &gray(if s.offset.x > edge { 1.0 } else { 0.0 }), s.weight);
        }
    }
    // The integral over [1, 2] of the outer cubic for B = C = 1/3 is -5/288; the whole is 1 in units of half the
    // radius.
    let expected = 1.0 + 5.0 / 288.0;
    let measured = color(&film)[0];
    assert!((f64::from(measured) - expected).abs() < 5e-4, "{measured} {expected}");
}

/// M6: what is not finite is dropped, counted, remembered by its place, and never reaches the picture.
#[test]
fn samples_that_are_not_finite_are_dropped_and_counted() {
    let layers = LayerSet::FULL;
    let mut film = Film::new(FilmShape::new([4, 4], Crop::full([4, 4]), layers), 4).unwrap();
    let tile = &mut film.tiles_mut()[0];
    let pixel = tile.index(2, 1);
    assert!(tile.add(pixel, 0, &gray(0.25), 1.0));
    let mut bad = vec![
        gray(f32::NAN),
        gray(f32::INFINITY),
        gray(f32::NEG_INFINITY),
        PixelSample { alpha: f32::NAN, ..gray(1.0) },
    ];
    bad.push(PixelSample { radiance: Rgb::new(1.0, f32::INFINITY, f32::NEG_INFINITY), ..gray(0.0) });
    for (i, sample) in bad.iter().enumerate() {
        assert!(!tile.add(pixel, i as u32 + 1, sample, 1.0));
    }
    assert!(!tile.add(pixel, 90, &gray(1.0), f32::NAN));
    let bad_depth = SurfaceSample { depth: f32::NAN, ..SurfaceSample::default() };
    assert!(!tile.add(
        pixel,
        91,
        Sample { pixel: &gray(1.0), surface: Some(&bad_depth), light_aovs: LightAovSample::default() },
        1.0
    ));
    let mut bad_aov = LightAovRows::default();
    bad_aov.reset(1, tile.layout.light_aovs);
    bad_aov.add(0, 0, Rgb::new(0.0, f32::NAN, 0.0));
    assert!(!tile.add(pixel, 92, Sample { pixel: &gray(1.0), surface: None, light_aovs: bad_aov.of(0) }, 1.0));
    for i in 0..100 {
        tile.add(0, i, &gray(f32::NAN), 1.0);
    }
    assert_eq!(film.dropped_count(), bad.len() as u64 + 103);
    assert_eq!(film.dropped().len(), DROPPED_KEPT);
    assert_eq!(film.dropped()[0], DroppedSample { x: 2, y: 1, sample: 1 });
    let image = film.resolve();
    assert_eq!(image.pixel(LayerKind::Color, 2, 1), Some(&[0.25, 0.25, 0.25, 1.0][..]));
    assert!(image.layers.iter().all(|layer| layer.data.iter().all(|v| v.is_finite())));
}

#[test]
fn data_is_that_of_the_nearest_sample_and_albedo_is_a_mean() {
    let surface = |depth, x: f32, n: Vec3, albedo| SurfaceSample {
        depth,
        position: Vec3::new(x, 0.0, 1.0),
        normal: n,
        albedo: Rgb::splat(albedo),
        visible_shape: crate::film::ShapeKey { instance: 0, shape: 0 },
        ..Default::default()
    };
    let mut film = Film::new(FilmShape::new([2, 1], Crop::full([2, 1]), LayerSet::FULL), 8).unwrap();
    let tile = &mut film.tiles_mut()[0];
    let (near, far) = (surface(2.0, 1.0, Vec3::X, 0.5), surface(4.0, 3.0, Vec3::Y, 0.7));
    let miss = (PixelSample::default(), SurfaceSample { motion: [5.0, 6.0], ..SurfaceSample::default() });
    for (pixel, samples) in [(0, [(gray(1.0), far), miss, (gray(1.0), near)].as_slice()), (1, &[miss])] {
        for (i, (value, surface)) in (0..).zip(samples) {
            assert!(tile.add(
                pixel,
                i,
                Sample { pixel: value, surface: Some(surface), light_aovs: LightAovSample::default() },
                1.0
            ));
        }
    }
    let image = film.resolve();
    let at = |kind, x| image.pixel(kind, x, 0).unwrap().to_vec();
    assert_eq!(at(LayerKind::Z, 0), [2.0]);
    assert_eq!(at(LayerKind::P, 0), [1.0, 0.0, 1.0]);
    assert_eq!(at(LayerKind::N, 0), [1.0, 0.0, 0.0]);
    assert_eq!((at(LayerKind::Motion, 0), at(LayerKind::Motion, 1)), (vec![0.0; 2], vec![5.0, 6.0]));
    assert!((at(LayerKind::Albedo, 0)[0] - 0.4).abs() < 1e-7);
    assert!((at(LayerKind::Color, 0)[3] - 2.0 / 3.0).abs() < 1e-7);
    assert_eq!(
        (at(LayerKind::Z, 1), at(LayerKind::N, 1), at(LayerKind::P, 1)),
        (vec![1e10], vec![0.0; 3], vec![0.0; 3])
    );
}

#[test]
fn tiles_lie_on_the_full_pictures_grid() {
    let crop = Crop { x: 15, y: 17, width: 10, height: 20 };
    let film = Film::new(FilmShape::new([40, 40], crop, LayerSet::COLOR), 16).unwrap();
    let origins: Vec<_> = film.tiles().iter().map(FilmTile::origin).collect();
    assert_eq!(origins, [[0, 16], [16, 16], [0, 32], [16, 32]]);
    assert_eq!(film.tiles()[3].size(), [16, 8]);
    assert_eq!(film.tiles().iter().map(|tile| tile.active().area()).sum::<u64>(), crop.area());
    let unused = |tile: &FilmTile| {
        tile.nearest.values.is_empty() && tile.filtered.averages.is_empty() && tile.weights.is_empty()
    };
    assert!(film.tiles().iter().all(unused));
}

#[test]
fn impossible_films_are_refused() {
    let wide = Crop { x: 8, y: 0, width: 3, height: 1 };
    assert!(matches!(Film::new(FilmShape::new([10, 10], wide, LayerSet::COLOR), 16), Err(Error::Usage(_))));
    let huge = [2_000_000_000, 2_000_000_000];
    assert!(matches!(
        Film::new(FilmShape::new(huge, Crop::full(huge), LayerSet::COLOR), 16),
        Err(Error::OutOfMemory(_))
    ));
}

/// Films whose samples count differently: the mean is the weighted one, the variance that of a weighted mean, all else
/// is as of one film.
#[test]
fn merged_films_weigh_their_samples() {
    let layers: LayerSet = [LayerKind::Variance, LayerKind::Samples].into_iter().collect();
    let film = |values: &[f32]| {
        let mut film = one_pixel(layers);
        for (i, &v) in (0..).zip(values) {
            let tile = &mut film.tiles_mut()[0];
            assert!(tile.add(0, i, &gray(v), 1.0));
            tile.add_moments(0, [f64::from(v); 3]);
        }
        film
    };
    let (a, b) = (film(&[1.0, 3.0]), film(&[2.0, 4.0, 6.0, 8.0]));
    let mut merged = one_pixel(layers);
    merged.tiles_mut()[0].merge_inverse_variance(&a.tiles()[0], 1.0);
    assert_eq!(color(&merged)[0], 2.0);
    assert_eq!(merged.resolve().pixel(LayerKind::Variance, 0, 0), a.resolve().pixel(LayerKind::Variance, 0, 0));
    merged.tiles_mut()[0].merge_inverse_variance(&b.tiles()[0], 3.0);
    // Two samples that count once and four that count three times.
    assert!((color(&merged)[0] - (4.0 + 3.0 * 20.0) / 14.0).abs() < 1e-6, "{:?}", color(&merged));
    let of = |film: &Film| film.tiles()[0].group_statistics(0).unwrap().1[0];
    let expected = (4.0 * of(&a) + 144.0 * of(&b)) / 196.0;
    let image = merged.resolve();
    assert!((f64::from(image.pixel(LayerKind::Variance, 0, 0).unwrap()[0]) - expected).abs() < 1e-6);
    assert_eq!(image.pixel(LayerKind::Samples, 0, 0).unwrap(), [6.0]);
}

/// A film of 70 x 40 pixels, tiles of 32, filled with noise by a shared filter.
fn shared(desc: FilterDesc, crop: Crop, block_size: Option<u32>, samples: impl Fn(u32, u32) -> u32) -> Film {
    let size = [70, 40];
    let shape = FilmShape { filter: desc, block_size, ..FilmShape::new(size, crop, LayerSet::FULL) };
    let mut film = Film::new(shape, 32).unwrap();
    let (filter, mut splats) = (Filter::new(&desc), Splats::default());
    for tile in film.tiles_mut() {
        let active = tile.active();
        for (x, y) in active.pixels() {
            let mut rng = crate::math::Rng::new(u64::from(x * 1000 + y));
            let pixel = tile.index(x, y);
            for sample in 0..samples(x, y) {
                let place = filter.sample([rng.unit_f32(), rng.unit_f32()]);
                let value = gray(x as f32 + 100.0 * y as f32 + 10.0 * rng.unit_f32());
                let at = WorldSample { sample, place, ..tile.world_sample(pixel) };
                assert!(tile.splat(&at, &value, &filter, &mut splats));
                tile.flush(pixel, &mut splats);
            }
        }
    }
    film
}

/// Against a direct sum over all samples and pixels: shared samples give the weighted mean, whatever tiles and blocks
/// there are.
#[test]
fn shared_samples_give_the_weighted_mean_across_tiles_and_blocks() {
    for desc in Filter::examples(FilterSamplesDesc::Shared) {
        let filter = Filter::new(&desc);
        if !filter.is_shared() || filter.is_signed() {
            continue;
        }
        for block_size in [None, Some(4)] {
            let count = |x: u32, y: u32| if block_size.is_some() { 1 + (x / 4 + y / 4) % 3 } else { 2 };
            let film = shared(desc, Crop::full([70, 40]), block_size, count);
            let image = film.resolve();
            for (px, py) in [(0, 0), (31, 17), (32, 31), (33, 32), (69, 39), (12, 5)] {
                let (mut sum, mut whole) = (0.0, 0.0);
                for (x, y) in film.sampled().pixels() {
                    let mut rng = crate::math::Rng::new(u64::from(x * 1000 + y));
                    for _ in 0..count(x, y) {
                        let offset = filter.sample([rng.unit_f32(), rng.unit_f32()]).offset;
                        let value = f64::from(x as f32 + 100.0 * y as f32 + 10.0 * rng.unit_f32());
                        let at = [(x as f32, px), (y as f32, py)].map(|(x, p)| x - (p + film.grid().offset) as f32);
                        let weight =
                            filter.evaluate(crate::math::Vec2::new(at[0], at[1]) + offset) / f64::from(count(x, y));
                        sum += weight * value;
                        whole += weight;
                    }
                }
                let found = f64::from(image.rgb(px, py).unwrap()[1]);
                assert!((found - sum / whole).abs() < 2e-6 * 4000.0, "{desc:?} {px},{py}: {found} {}", sum / whole);
            }
        }
    }
}

/// Where pixels have different numbers of samples, each is normalised by its own: with weights of either sign, too.
#[test]
fn importance_sampled_pixels_do_not_depend_on_the_samples_of_others() {
    for desc in Filter::EXAMPLES {
        let filter = Filter::new(&desc);
        let picture = |block_size: Option<u32>, others: u32| {
            let shape =
                FilmShape { filter: desc, block_size, ..FilmShape::new([8, 8], Crop::full([8, 8]), LayerSet::COLOR) };
            let mut film = Film::new(shape, 8).unwrap();
            for (pixel, count) in [(9, 5), (60, others)] {
                let mut rng = crate::math::Rng::new(pixel as u64);
                for sample in 0..count {
                    let place = filter.sample([rng.unit_f32(), rng.unit_f32()]);
                    film.tiles_mut()[0].add(pixel, sample, &gray(rng.unit_f32()), place.weight);
                }
            }
            film.resolve().rgb(1, 1).unwrap()
        };
        assert_eq!(picture(Some(4), 500), picture(None, 1), "{desc:?}");
    }
}

/// A crop is a part of the whole, films of parts of the samples sum to the film of all, and states come back: all bit
/// for bit.
#[test]
fn crops_merges_and_states_of_shared_samples_have_the_same_bits() {
    for desc in Filter::examples(FilterSamplesDesc::Shared).into_iter().filter(|desc| Filter::new(desc).is_shared()) {
        let whole = shared(desc, Crop::full([70, 40]), None, |_, _| 3);
        let image = whole.resolve();
        let crop = Crop { x: 30, y: 33, width: 36, height: 7 };
        let part = shared(desc, crop, None, |_, _| 3).resolve();
        for kind in [LayerKind::Color, LayerKind::Samples] {
            assert!(crop.pixels().all(|(x, y)| part.pixel(kind, x, y) == image.pixel(kind, x, y)), "{desc:?}");
        }
        let mut loaded = Film::new(whole.shape().clone(), 32).unwrap();
        for (to, from) in loaded.tiles_mut().iter_mut().zip(whole.tiles()) {
            let mut tile = from.empty();
            tile.load(&from.save()).unwrap();
            to.merge(&tile);
        }
        assert_eq!(loaded.resolve(), image, "{desc:?}");
    }
}

/// Batches are summed one average after the other, and have the bits of their samples added one by one; what is not
/// finite is dropped.
#[test]
fn batches_have_the_bits_of_single_samples() {
    let request = LightAovRequest { by_scattering: true, light_groups: 2 };
    let size = [8, 8];
    let shape = FilmShape {
        light_groups: vec!["a".into(), "b".into()],
        ..FilmShape::new(size, Crop::full(size), LayerSet::FULL)
    };
    for bad in [None, Some(3), Some(40)] {
        let (mut alone, mut together) = (Film::new(shape.clone(), 8).unwrap(), Film::new(shape.clone(), 8).unwrap());
        let mut rng = crate::math::Rng::new(5);
        for sample in 0..5 {
            let mut batch = SampleBatch::default();
            batch.reset(64, true, request);
            for i in 0..64 {
                let mut color = || Rgb::new(rng.unit_f32(), rng.unit_f32(), rng.unit_f32());
                batch.pixels[i] = PixelSample { radiance: color(), alpha: 1.0 };
                batch.surfaces[i] = SurfaceSample {
                    albedo: color(),
                    feature_albedo: color(),
                    depth: color().r,
                    ..SurfaceSample::default()
                };
                batch.surfaces[i].visible_shape.shape = (color().r * 3.0) as u32;
                // The others stay black.
                batch.light_aovs.add(i, 2 * (i % 3), color());
                batch.light_aovs.add(i, LightAov::COUNT + 1, color());
            }
            match bad {
                Some(3) => batch.light_aovs.add(3, 1, Rgb::splat(f32::NAN)),
                Some(pixel) => batch.surfaces[pixel].uv[1] = f32::INFINITY,
                None => {}
            }
            let one = &mut alone.tiles_mut()[0];
            let placed = |i: u32| WorldSample { slot: i, sample, ..one.world_sample(63 - i as usize) };
            let all: Vec<_> = (0..64).map(placed).collect();
            for &WorldSample { slot, pixel, sample, place, .. } in &all {
                if one.add(pixel as usize, sample, batch.sample(slot as usize), place.weight) {
                    one.add_moments(pixel as usize, batch.radiance(slot as usize));
                }
            }
            together.tiles_mut()[0].add_batch(&batch, &all, &mut Vec::new());
        }
        let (alone, together) = (&alone.tiles()[0], &together.tiles()[0]);
        assert!(alone.save() == together.save(), "{bad:?}");
        assert_eq!(together.dropped_count, if bad.is_some() { 5 } else { 0 });
        assert_eq!(together.filtered.averages.iter().filter(|plane| plane.is_empty()).count(), 9);
    }
}
