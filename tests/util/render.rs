//! Renders scenes written as JSON values and gathers statistics of the picture.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use steradian::accel::{self, AccelKind};
use steradian::film::Image;
use steradian::render::{self, Overrides, RenderResult, Settings, Silent};
use steradian::scene::Scene;
use steradian::{compile, import};

/// A compiled scene with its settings.
pub struct Prepared {
    pub scene: Scene,
    pub settings: Settings,
}

/// Compiles a scene given as JSON.
pub fn prepare(scene: &Value, overrides: &Overrides) -> Prepared {
    let path = Path::new("test.json");
    let desc = import::parse_scene(&scene.to_string(), path).unwrap();
    let settings = Settings::new(&desc, overrides).unwrap();
    let scene = compile::compile(&desc, path).unwrap();
    Prepared { scene, settings }
}

/// Renders a scene with two threads.
pub fn render_with(prepared: &Prepared, kind: AccelKind) -> RenderResult {
    let accel = accel::build(kind, &prepared.scene.geometry, 2).unwrap();
    render::render(&prepared.scene, &*accel, &prepared.settings, &Silent, &AtomicBool::new(false)).unwrap()
}

/// Renders a scene given as JSON through Embree.
pub fn render(scene: &Value) -> Image {
    render_with(&prepare(scene, &Overrides { threads: Some(2), ..Overrides::default() }), AccelKind::EMBREE).image
}

/// A scene with a camera at `position` looking at `look_at` through a very narrow angle, so that all pixels see nearly one point.
pub fn probe(position: [f64; 3], look_at: [f64; 3], rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": { "position": position, "look_at": look_at, "up": [0.1, 1.0, 0.2], "vertical_fov_degrees": 0.01 },
        "sampler": { "type": "independent", "spp": 1024 },
    });
    merge(&mut scene, rest);
    scene
}

/// Puts the keys of `from` into `into`, object by object.
pub fn merge(into: &mut Value, from: Value) {
    match (into, from) {
        (Value::Object(into), Value::Object(from)) => {
            for (key, value) in from {
                merge(into.entry(key).or_insert(Value::Null), value);
            }
        }
        (into, from) => *into = from,
    }
}

/// Mean over the pixels of a picture with the standard error of that mean.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    /// Of one colour channel.
    pub fn of(image: &Image, channel: usize) -> Self {
        let values: Vec<f64> = pixels(image).map(|p| f64::from(p[channel])).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// Asserts that the mean agrees with `expected`: 5.5 standard errors (two-sided false-alarm rate 4e-8 for a normal mean, below 1e-6 with
    /// 255 degrees of freedom), or the relative rounding bound where there is no noise.
    #[track_caller]
    pub fn assert_is(&self, expected: f64, what: &str) {
        let bound = 5.5 * self.error + 1e-5 * expected.abs();
        assert!((self.mean - expected).abs() <= bound, "{what}: {} +- {}, expected {expected}", self.mean, self.error);
    }
}

/// The colours of a picture, row by row.
pub fn pixels(image: &Image) -> impl Iterator<Item = [f32; 3]> + '_ {
    let [width, height] = image.size;
    (0..height).flat_map(move |y| (0..width).filter_map(move |x| image.rgb(x, y)))
}
