use super::*;
use crate::Spent;
use crate::accel::{Accelerator, Coherence, EmbreeAccel, EmbreeReplay};
use crate::math::{Ray, Rng, Vec3};
use crate::mesh::sphere_geometry;
use crate::report::Report;

fn picture(size: [u32; 2], mut value: impl FnMut(usize) -> f32) -> Image {
    let data = (0..size[0] as usize * size[1] as usize).flat_map(|i| [value(i); 4]).collect();
    Image::of_color(size, data)
}

fn measured(image: Image, seconds: f64) -> Measured {
    let samples = Some(4 * image.crop.area());
    Measured {
        image,
        seconds,
        process_seconds: None,
        spent: Spent::default(),
        spp: Some(4),
        samples,
        rays: Some(1_000_000),
        dropped: 2,
    }
}

fn against(image: Image, floor: [f64; 3]) -> Reference {
    Reference { image, info: ReferenceInfo::default(), floor }
}

#[test]
fn a_picture_is_judged_as_by_hand() {
    // Two pixels: differences 0.1 and 0.3 from 1 and 2.
    let reference = against(picture([2, 1], |i| [1.0, 2.0][i]), [0.0; 3]);
    let run = judge(&reference, &measured(picture([2, 1], |i| [1.1, 2.3][i]), 0.5), "x").unwrap();
    let relmse = 0.5 * (0.01 / 1.01 + 0.09 / 4.01);
    assert!((run.mse - 0.05).abs() < 1e-6 && (run.relmse - relmse).abs() < 1e-6, "{run:?}");
    assert!((run.efficiency.unwrap() - 2.0 / relmse).abs() < 1e-2 && (run.mean_ratio[1] - 3.4 / 3.0).abs() < 1e-6);
    assert_eq!((run.mrays_per_second, run.msamples_per_second, run.not_finite), (Some(2.0), Some(16e-6), 2));
    let other = judge(&reference, &measured(picture([1, 2], |_| 1.0), 0.5), "x").unwrap_err().to_string();
    assert_eq!(other, "x: the picture has 1x2 pixels, the reference 2x1");
}

/// The noise is known, so that the error is: variance over the square of the mean plus 0.01.
#[test]
fn halves_give_the_error_of_a_reference() {
    let size = [64, 64];
    let mut random = Rng::new(5);
    let mut noisy = || picture(size, |_| 2.0 + random.unit_f32() - 0.5);
    let (mean, floor) = mean_of_halves(&noisy(), &noisy()).unwrap();
    let expected = 1.0 / 12.0 / 4.01;
    // Squares of 4096 differences: their mean is within a tenth in any but one of 10^9 cases.
    assert!((floor[1] / (0.5 * expected) - 1.0).abs() < 0.1, "{floor:?}");
    let run = judge(&against(mean, floor), &measured(noisy(), 1.0), "x").unwrap();
    assert!((run.relmse / expected - 1.0).abs() < 0.2, "{run:?}");
}

#[test]
fn a_replay_finds_what_the_accelerator_finds() {
    let geometry = sphere_geometry(500);
    let accel = EmbreeAccel::new(&geometry, 1).unwrap();
    let mut random = Rng::new(3);
    let mut ray = || {
        let point = Vec3::new(random.unit_f32(), random.unit_f32(), random.unit_f32()) * 4.0 - Vec3::splat(2.0);
        Ray::new(point, Vec3::new(random.unit_f32() - 0.5, random.unit_f32() - 0.5, random.unit_f32() - 0.5))
    };
    let mut rays: Vec<Ray> = (0..1000).map(|_| ray()).collect();
    // Neither is given to Embree; the third only alone.
    rays[3] = Ray::INACTIVE;
    rays[20].origin.x = f32::NAN;
    rays[40].direction = Vec3::new(-1e-30, 0.0, 1.0);
    let mut hits = vec![None; rays.len()];
    accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
    let found = hits.iter().flatten().count() as u64;
    assert!(found > 100);
    for coherence in [None, Some(Coherence::Incoherent)] {
        for any_hit in [false, true] {
            let mut replay = EmbreeReplay::new(&accel);
            rays.chunks(100).for_each(|rays| replay.push(rays, any_hit, coherence));
            // Again and again: tracing leaves the rays as they were.
            assert_eq!((replay.rays(), replay.trace(), replay.trace()), (998, found, found), "{coherence:?} {any_hit}");
        }
    }
}

#[test]
fn pages_hold_names_that_are_markup() {
    let name = "a<b>&\"</script>";
    let options = ErrorOptions {
        scene: name.into(),
        command: "steradian bench error".into(),
        variants: Vec::new(),
        budgets: vec![Budget::Spp(1), Budget::Spp(4)],
        repeats: 1,
        seed: 0,
        reference: Standard::Halves,
        tax: false,
    };
    let mut report = ErrorReport::new(Machine::here(), &options);
    let image = picture([2, 2], |i| i as f32);
    let external = External::new(name, "{spp} {out}", std::path::Path::new("s"), &options.budgets).unwrap();
    let variant = Variant { name: name.into(), subject: Subject::External(external) };
    report.variants = ErrorReport::new(Machine::here(), &ErrorOptions { variants: vec![variant], ..options }).variants;
    report.pictures = Pictures::new(&image).unwrap();
    assert!(report.pictures.fit(10) && !Pictures::new(&picture([4000, 1], |_| 0.0)).unwrap().fit(3000));
    report.pictures.add(0, 1, &image);
    for budget in 0..2 {
        let run = judge(&against(image.clone(), [0.0; 3]), &measured(picture([2, 2], |i| i as f32 + 1.0), 1.0), name)
            .unwrap();
        report.add(0, budget, run);
    }
    report.summarize(&[vec![Blocks::default(), Blocks::default()]]);
    let html = report.html().unwrap();
    assert!(
        html.contains("a&lt;b&gt;&amp;&quot;") && html.matches("</script>").count() == 3 && !html.contains("<b>&\""),
        "{html}"
    );
    assert!(html.contains("\\u003c/script>, 4 spp"));
    assert_eq!(report.sheet().unwrap().rows[0][0], name);
    assert!(report.markdown().contains("| 4 spp |"));
}
