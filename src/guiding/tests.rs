use super::*;

use crate::bytes::{ByteReader, ByteWriter};
use crate::math::Rng;
use crate::math::random::hash64;
use crate::sampling::statistics::compare_directions;

fn unit_box() -> Aabb {
    Aabb { min: Vec3::ZERO, max: Vec3::ONE }
}

fn record(p: Vec3, direction: Vec3, light: f32) -> Record {
    Record { p, n: Vec3::Z, direction, light, densities: None }
}

fn random_place(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.unit_f32(), rng.unit_f32(), rng.unit_f32())
}

/// A narrow lobe around one axis on top of a wide one around another.
fn lobes(w: Vec3) -> f32 {
    20.0 * w.dot(Vec3::new(0.6, 0.0, 0.8)).max(0.0).powi(200) + w.y.max(0.0)
}

/// A guide that was shown the lobes `count` times in each of several rounds, in an order that depends on `order` alone.
fn taught(rounds: u32, count: usize, order: u64) -> Guide {
    let mut guide = Guide::new(unit_box(), 1.0);
    for round in 0..rounds {
        let mut rng = Rng::new(u64::from(round));
        let mut records: Vec<Record> = (0..count)
            .map(|_| {
                let direction = rng.direction().as_vec3();
                record(random_place(&mut rng), direction, lobes(direction))
            })
            .collect();
        records.sort_by_key(|r| hash64(u64::from(r.p.x.to_bits()) ^ order));
        for record in &records {
            guide.record(&[*record]);
        }
        guide = guide.refined(1 << round);
    }
    guide
}

fn known_at(guide: &Guide) -> GuideRegion<'_> {
    guide.at(Vec3::splat(0.4), Vec3::Z).unwrap()
}

#[test]
fn samples_follow_the_density_which_integrates_to_one() {
    let guide = taught(5, 40_000, 0);
    for (i, place) in [Vec3::splat(0.1), Vec3::new(0.9, 0.2, 0.6)].into_iter().enumerate() {
        let directions = guide.at(place, Vec3::Z).unwrap().directions;
        assert!(directions.len() > 20, "{}", directions.len());
        let sample = |u: [f32; 4]| {
            let sample = directions.sample([u[0], u[1]]);
            let pdf = directions.pdf(sample.direction);
            // On the border of a cell the direction may round into the next one.
            let agree = (pdf / sample.pdf - 1.0).abs() < 1e-3 || u[2] < 0.01;
            assert!(agree || is_at_border(directions, sample.direction), "{pdf} {}", sample.pdf);
            Some(sample.direction)
        };
        compare_directions(200_000, 10 + i as u32, sample, |w| directions.pdf(w)).check("guide");
    }
}

/// Whether the density changes within rounding of a direction.
fn is_at_border(directions: &DirectionDistribution, w: Vec3) -> bool {
    let pdf = directions.pdf(w);
    let mut rng = Rng::new(1);
    (0..64).any(|_| (directions.pdf((w + 1e-6 * rng.direction().as_vec3()).normalize()) / pdf - 1.0).abs() > 1e-3)
}

#[test]
fn a_known_distribution_is_learned() {
    let guide = taught(6, 60_000, 0);
    let known = known_at(&guide);
    // The share of the light within the narrow lobe's cone, by the guide and by the lobes themselves.
    let mut rng = Rng::new(99);
    let axis = Vec3::new(0.6, 0.0, 0.8);
    let (mut inside, mut light, mut all) = (0.0, 0.0, 0.0);
    let n = 200_000;
    for _ in 0..n {
        let w = rng.direction().as_vec3();
        all += f64::from(lobes(w));
        if w.dot(axis) > 0.97 {
            light += f64::from(lobes(w));
        }
        let chosen = known.directions.sample(rng.pair()).direction;
        inside += f64::from(u8::from(chosen.dot(axis) > 0.97)) / f64::from(n);
    }
    let expected = light / all;
    // Blurred by the sizes of cells.
    assert!(expected > 0.1 && (inside / expected - 1.0).abs() < 0.25, "{inside} {expected}");
    let mean = (all / f64::from(n)) as f32;
    let (peak, uniform) = (lobes(axis) / mean, 4.0 * std::f64::consts::PI as f32);
    let learned = known.directions.pdf(axis) * uniform;
    assert!(peak > 20.0 && learned > 0.4 * peak && learned < 1.5 * peak, "{learned} {peak}");
}

#[test]
fn what_is_learned_does_not_depend_on_the_order() {
    let (a, b) = (taught(4, 20_000, 1), taught(4, 20_000, 2));
    assert_eq!((a.leaves(), a.directional_nodes()), (b.leaves(), b.directional_nodes()));
    let mut rng = Rng::new(3);
    for _ in 0..10_000 {
        let (p, w) = (random_place(&mut rng), rng.direction().as_vec3());
        let pdf = |guide: &Guide| guide.at(p, Vec3::Z).unwrap().directions.pdf(w).to_bits();
        assert_eq!(pdf(&a), pdf(&b));
    }
}

#[test]
fn no_record_can_poison_the_guide() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, f32::MAX, f32::MIN_POSITIVE, 1e-42];
    let mut guide = Guide::new(unit_box(), 1.0);
    let mut rng = Rng::new(5);
    for round in 0..4 {
        for i in 0..20_000 {
            let direction = rng.direction().as_vec3();
            guide.record(&[record(random_place(&mut rng), direction, lobes(direction))]);
            let x = bad[i % bad.len()];
            guide.record(&[record(Vec3::new(x, 0.5, x), direction, 1.0)]);
            guide.record(&[Record { densities: Some([x, 1.0]), ..record(Vec3::splat(0.5), direction, x) }]);
            guide.record(&[record(Vec3::splat(0.5), Vec3::new(x, 0.0, 0.0) / x, 1.0)]);
        }
        guide = guide.refined(1 << round);
    }
    for _ in 0..10_000 {
        let p = if rng.unit() < 0.5 { Vec3::splat(0.5) } else { random_place(&mut rng) };
        let GuideRegion { directions, bsdf_sampling_fraction } = guide.at(p, Vec3::Z).unwrap();
        let sample = directions.sample(rng.pair());
        assert!(sample.direction.is_finite() && sample.pdf > 0.0 && sample.pdf.is_finite(), "{sample:?}");
        assert!((0.0..=1.0).contains(&bsdf_sampling_fraction));
    }
    for x in bad {
        assert!(
            guide
                .at(Vec3::splat(x), Vec3::new(x, 0.0, 0.0))
                .is_none_or(|known| known.directions.pdf(Vec3::Z).is_finite())
        );
    }
    // Neither can boxes that are none.
    for bounds in [
        Aabb { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) },
        Aabb { min: Vec3::ONE, max: Vec3::ONE },
    ] {
        let guide = Guide::new(bounds, 1.0);
        guide.record(&[record(Vec3::ONE, Vec3::X, 1.0)]);
        assert!(guide.refined(1).at(Vec3::ZERO, Vec3::Z).unwrap().directions.pdf(Vec3::X) > 0.0);
    }
}

#[test]
fn nothing_known_is_said_and_brightness_may_come_later() {
    let guide = Guide::new(unit_box(), 0.0);
    guide.record(&[record(Vec3::splat(0.5), Vec3::X, 1.0)]);
    let mut guide = guide.refined(1);
    assert!(!guide.has_radiance_scale() && guide.at(Vec3::splat(0.5), Vec3::Z).is_none());
    guide.set_typical(1.0);
    guide.record(&[record(Vec3::splat(0.5), Vec3::X, 1.0)]);
    assert!(guide.has_radiance_scale() && guide.refined(2).at(Vec3::splat(0.5), Vec3::Z).is_some());
}

#[test]
fn memory_is_bounded() {
    let mut guide = taught(1, 200_000, 0);
    for _ in 0..3 {
        // After no samples at all, any record is too many for a leaf.
        guide = guide.refined(0);
    }
    assert!(guide.leaves() > MAX_LEAVES / 2 && guide.leaves() <= MAX_LEAVES, "{}", guide.leaves());
    assert!(guide.directional_nodes() <= MAX_NODES, "{}", guide.directional_nodes());
    assert!(size_of::<Record>() <= 56);
}

#[test]
fn shares_follow_what_explains_the_light() {
    for (densities, expected) in [([0.01, 1.0], 0.3), ([1.0, 0.01], 0.9), ([1.0, 1.0], BSDF_SAMPLING_FRACTION)] {
        let (guide, mut rng) = (Guide::new(unit_box(), 1.0), Rng::new(1));
        for _ in 0..100 {
            guide.record(&[Record { densities: Some(densities), ..record(random_place(&mut rng), Vec3::X, 1.0) }]);
        }
        assert_eq!(guide.refined(1).at(Vec3::splat(0.5), Vec3::Z).unwrap().bsdf_sampling_fraction, expected);
    }
}

fn saved(guide: &Guide) -> Vec<u8> {
    let mut out = ByteWriter::default();
    guide.write(&mut out);
    out.into_bytes()
}

fn read(bytes: &[u8]) -> Option<Guide> {
    let mut data = ByteReader::new(bytes);
    let mut guide = Guide::read(&mut data).filter(|_| data.is_empty())?;
    guide.set_bounds(unit_box());
    Some(guide)
}

#[test]
fn guides_come_back_from_bytes_and_go_on_learning_alike() {
    for guide in [Guide::new(unit_box(), 1.0), taught(1, 30_000, 0), taught(5, 30_000, 0)] {
        let bytes = saved(&guide);
        let back = read(&bytes).unwrap();
        assert!(saved(&back) == bytes && saved(&guide.clone()) == bytes);
        let mut rng = Rng::new(8);
        for _ in 0..20_000 {
            let direction = rng.direction().as_vec3();
            let record = record(random_place(&mut rng), direction, lobes(direction));
            guide.record(&[record]);
            back.record(&[record]);
        }
        assert!(saved(&guide.refined(40)) == saved(&back.refined(40)));
    }
}

/// Whatever is taken can be sampled, and learns.
#[test]
fn bytes_that_are_no_guide_are_refused() {
    let bytes = saved(&taught(2, 3000, 0));
    let mut rng = Rng::new(6);
    for _ in 0..200 {
        assert!(read(&bytes[..rng.below(bytes.len())]).is_none());
    }
    assert!(read(&[&bytes[..], &[0]].concat()).is_none());
    let mut refused = 0;
    for _ in 0..2000 {
        let mut other = bytes.clone();
        for _ in 0..1 + rng.below(3) {
            let place = rng.below(other.len());
            other[place] = rng.bits() as u8;
        }
        let Some(guide) = read(&other) else {
            refused += 1;
            continue;
        };
        for _ in 0..20 {
            let (p, direction) = (random_place(&mut rng), rng.direction().as_vec3());
            if let Some(region) = guide.at(p, direction) {
                let _ = region.directions.pdf(region.directions.sample(rng.pair()).direction);
            }
            guide.record(&[Record { n: direction, ..record(p, direction, 1.0) }]);
        }
        let _ = guide.refined(3);
    }
    assert!(refused > 100, "{refused}");
}
