//! Whether two sets of renders may be of the same scene.

use super::{Effort, Outcome, PIXELS, Prepared, SIDE, Tests, json, pictures, prepared, room};
use crate::stability::verdict::{estimate, welch};

/// Independent renders of a scene, each a row of pixels.
type Renders = Vec<Vec<f64>>;

fn mean_picture(renders: &Renders) -> Vec<f64> {
    (0..PIXELS).map(|pixel| renders.iter().map(|picture| picture[pixel]).sum::<f64>() / renders.len() as f64).collect()
}

/// What the test finds.
struct Agreement {
    /// Share of pixels whose difference is accepted.
    accepted: f64,
    /// p-value of the mean of the whole picture.
    whole: f64,
    /// p-values of all pixels by sixteenths.
    histogram: Vec<u32>,
}

fn compare(a: &Renders, b: &Renders) -> Agreement {
    // Šidák's level for one false alarm in a hundred pictures, as Mitsuba has it.
    let level = 1.0 - 0.99f64.powf(1.0 / PIXELS as f64);
    let (mut accepted, mut histogram) = (0, vec![0u32; 16]);
    for pixel in 0..PIXELS {
        let [at_a, at_b] =
            [a, b].map(|renders| estimate(&renders.iter().map(|picture| picture[pixel]).collect::<Vec<_>>()));
        let p_value = welch(at_a, a.len(), at_b, b.len(), 0.0);
        accepted += usize::from(p_value > level);
        histogram[((p_value * 16.0) as usize).min(15)] += 1;
    }
    let [all_a, all_b] = [a, b].map(|renders| {
        estimate(&renders.iter().map(|picture| picture.iter().sum::<f64>() / PIXELS as f64).collect::<Vec<_>>())
    });
    Agreement {
        accepted: accepted as f64 / PIXELS as f64,
        whole: welch(all_a, a.len(), all_b, b.len(), 0.0),
        histogram,
    }
}

/// How many renders of how many samples a reference has, and one to be tested.
struct Size {
    spp: u32,
    reference: u64,
    tested: u64,
}

fn size(effort: Effort) -> Size {
    effort.pick(Size { spp: 8, reference: 48, tested: 32 }, Size { spp: 32, reference: 256, tested: 128 })
}

fn reference(effort: Effort) -> (Size, Renders) {
    let size = size(effort);
    let renders = pictures(prepared(&room(), size.spp), 0..size.reference);
    (size, renders)
}

pub(super) fn r1_agreement(effort: Effort) -> Outcome {
    let (size, reference) = reference(effort);
    let scene: Prepared = prepared(&room(), size.spp);
    let tested = pictures(scene, 1000..1000 + size.tested);
    let found = compare(&reference, &tested);
    let mut tests = Tests::new();
    tests.add("whole picture", found.whole);
    tests.counts("p-values of pixels are uniform", &found.histogram, &[PIXELS as f64 / 16.0; 16]);
    let outcome = tests.judge(Outcome::new().at_least("share of pixels accepted", found.accepted, 0.9975));
    outcome.pictures("room", SIDE as usize, &mean_picture(&tested), &mean_picture(&reference))
}

pub(super) fn r3_power(effort: Effort) -> Outcome {
    let (size, reference) = reference(effort);
    let mut brighter = room();
    brighter["shapes"][5]["emission"]["radiance"] = json!([5.05, 4.04, 3.03]);
    let mut whiter = room();
    whiter["materials"]["grey"]["albedo"] = json!(0.505);
    let mut deeper = room();
    deeper["integrator"]["max_depth"] = json!(5);
    let mut outcome = Outcome::new();
    for (what, scene) in
        [("a lamp 1 % brighter", brighter), ("albedo 0.505 in place of 0.5", whiter), ("one segment more", deeper)]
    {
        let found = compare(&reference, &pictures(prepared(&scene, size.spp), 2000..2000 + size.tested));
        outcome = outcome.at_most(format!("p-value of {what}"), found.whole, 1e-6);
    }
    outcome
}
