//! Compares choosing lights by a tree with choosing them by power, at equal time.
//!
//! `cargo xtask light_choice [SCENE.json] [--spp N] [--rounds N]` renders the scene in turns with either choice, each
//! time with two seeds. Prints of each choice the seconds, the noise (variance of a pixel over the square of its mean,
//! averaged over the picture, from the difference of the two pictures; the worst thousandth of the pixels left out) and
//! the noise times the seconds, against those by power. Medians over the rounds.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::Image;
use steradian::internal::light::{LightSelection, LightSet};
use steradian::internal::render::{self, Overrides, Settings, Silent};
use steradian::internal::{compile, import};
use steradian::{Error, Result};

use crate::{Outcome, root};

/// Choices in the order in which they take turns; the first is the measure.
const CHOICES: [(LightSelection, &str); 2] = [(LightSelection::Power, "power"), (LightSelection::Tree, "tree")];

struct Arguments {
    scene: PathBuf,
    spp: u32,
    rounds: u32,
}

/// One turn of one choice.
#[derive(Clone, Copy)]
struct Turn {
    seconds: f64,
    noise: f64,
}

pub fn run(words: Vec<String>) -> Outcome {
    let arguments = parse_arguments(words)?;
    let desc = import::load_scene(&arguments.scene)?;
    let mut scene = compile::compile(&desc, &arguments.scene)?;
    let threads = Settings::new(&desc, &Overrides::default())?.threads;
    let lights = scene.lights.lights().to_vec();
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, threads)?;

    let mut turns: [Vec<Turn>; 2] = Default::default();
    for round in 0..arguments.rounds {
        for (which, (selection, _)) in CHOICES.into_iter().enumerate() {
            scene.lights = LightSet::with_selection(lights.clone(), &scene.geometry, selection);
            let start = Instant::now();
            let mut pictures = Vec::new();
            for half in 0..2 {
                let seed = u64::from(2 * round + half + 1);
                let settings = Settings::new(
                    &desc,
                    &Overrides { spp: Some(arguments.spp), seed: Some(seed), ..Overrides::default() },
                )?;
                pictures.push(render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.image);
            }
            turns[which]
                .push(Turn { seconds: start.elapsed().as_secs_f64(), noise: noise(&pictures[0], &pictures[1]) });
        }
    }
    let median = |which: usize, of: fn(&Turn) -> f64| {
        let mut values: Vec<f64> = turns[which].iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!("choice     seconds     noise   noise x seconds    (the same, over those of power)");
    for (which, (_, name)) in CHOICES.into_iter().enumerate() {
        let of =
            |which| [median(which, |t| t.seconds), median(which, |t| t.noise), median(which, |t| t.seconds * t.noise)];
        let ([s, v, p], [s0, v0, p0]) = (of(which), of(0));
        println!("{name:<8} {s:9.2} {v:9.5} {p:9.4}    {:.3}  {:.3}  {:.3}", s / s0, v / v0, p / p0);
    }
    Ok(())
}

fn parse_arguments(words: Vec<String>) -> Result<Arguments> {
    let mut arguments = Arguments { scene: root().join("scenes/many_lights.json"), spp: 16, rounds: 5 };
    let mut rest = words.into_iter();
    while let Some(word) = rest.next() {
        let mut number = || {
            let value = rest.next().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
            value.ok_or_else(|| Error::Usage(format!("{word} needs a positive number")))
        };
        match word.as_str() {
            "--spp" => arguments.spp = number()?,
            "--rounds" => arguments.rounds = number()?,
            _ => arguments.scene = word.into(),
        }
    }
    Ok(arguments)
}

/// Mean over pixels and channels of the relative variance, without the worst thousandth.
fn noise(a: &Image, b: &Image) -> f64 {
    let pixels = (0..a.size[1]).flat_map(|y| (0..a.size[0]).map(move |x| [x, y]));
    let mut all: Vec<f64> = pixels
        .map(|[x, y]| {
            let (p, q) = (a.rgb(x, y).unwrap_or_default(), b.rgb(x, y).unwrap_or_default());
            let relative = |c: usize| {
                let (p, q) = (f64::from(p[c]), f64::from(q[c]));
                0.5 * (p - q) * (p - q) / (0.25 * (p + q) * (p + q) + 1e-2)
            };
            (relative(0) + relative(1) + relative(2)) / 3.0
        })
        .collect();
    all.sort_by(f64::total_cmp);
    let kept = all.len() - all.len() / 1000;
    all[..kept].iter().sum::<f64>() / kept as f64
}
