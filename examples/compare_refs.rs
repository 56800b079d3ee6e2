//! Compares renders of `scenes/` and `benches/scenes/` with independent reference images of the same scenes, block by block.
//!
//! `cargo run --release --example compare_refs -- [REFS] [--spp N] [SCENE...]`: `REFS` (default `../shared/refs`) holds, for each scene
//! (default: cornell, glass, analytic), `SCENE.exr` and its two independent halves `SCENE.half0.exr` and `SCENE.half1.exr`. Two renders of
//! N samples with different seeds give our variance, the halves give the reference's: over blocks of 16 x 16 pixels,
//! z = (ours - reference) / sqrt(both variances). Prints one line per scene and writes the signed difference, in units of its standard
//! deviation, to `target/compare_refs/SCENE.png` (grey: none; a structure there is a bug).

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use steradian::accel::{self, AccelKind};
use steradian::film::Image;
use steradian::render::{self, Overrides, Settings, Silent};
use steradian::{Error, Result, compile, import, output};

const BLOCK: u32 = 16;

struct Arguments {
    references: PathBuf,
    spp: u32,
    scenes: Vec<String>,
}

fn main() -> Result<()> {
    let arguments = parse_arguments()?;
    let out = Path::new("target/compare_refs");
    std::fs::create_dir_all(out).map_err(|e| Error::Output { file: out.into(), message: e.to_string() })?;
    println!("scene      spp    mean ratio r g b (± its standard error)          relMSE    blocks with |z| < 3    largest |z|");
    let mut failed = false;
    for scene in &arguments.scenes {
        failed |= !compare_scene(scene, &arguments, out)?;
    }
    if failed { Err(Error::Internal("a scene disagrees with its reference".into())) } else { Ok(()) }
}

fn parse_arguments() -> Result<Arguments> {
    let mut arguments = Arguments { references: "../shared/refs".into(), spp: 512, scenes: Vec::new() };
    let mut rest = std::env::args().skip(1);
    while let Some(word) = rest.next() {
        if word == "--spp" {
            let value = rest.next().and_then(|n| n.parse().ok());
            arguments.spp = value.ok_or_else(|| Error::Usage("--spp needs a number".into()))?;
        } else if Path::new(&word).is_dir() {
            arguments.references = word.into();
        } else {
            arguments.scenes.push(word);
        }
    }
    if arguments.scenes.is_empty() {
        arguments.scenes = ["cornell", "glass", "analytic"].map(String::from).into();
    }
    Ok(arguments)
}

/// Renders one scene twice and compares; whether it agrees.
fn compare_scene(name: &str, arguments: &Arguments, out: &Path) -> Result<bool> {
    let file = |suffix: &str| arguments.references.join(format!("{name}{suffix}.exr"));
    let reference = output::read_exr(&file(""))?;
    let halves = [output::read_exr(&file(".half0"))?, output::read_exr(&file(".half1"))?];
    let ours = [render_scene(name, arguments.spp, 1)?, render_scene(name, arguments.spp, 2)?];

    let [width, height] = reference.size;
    let (columns, rows) = (width / BLOCK, height / BLOCK);
    let mut z_image = vec![0u8; (columns * rows * 3) as usize];
    let (mut inside, mut largest) = (0u32, 0f64);
    let mut total = [Sums::default(); 3];
    for by in 0..rows {
        for bx in 0..columns {
            for c in 0..3 {
                let sums = block_sums(&reference, &halves, &ours, [bx * BLOCK, by * BLOCK], c);
                let z = sums.z();
                inside += u32::from(z.abs() < 3.0);
                largest = largest.max(z.abs());
                z_image[((by * columns + bx) * 3) as usize + c] = (128.0 + 25.0 * z).clamp(0.0, 255.0) as u8;
                total[c].add(&sums);
            }
        }
    }
    let mean = mean_image(&ours);
    let relmse = relative_mse(&reference, &mean);
    let fraction = f64::from(inside) / f64::from(columns * rows * 3);
    let ratios: Vec<String> = total.iter().map(|t| format!("{:.5} ± {:.5}", t.ratio(), t.ratio_error())).collect();
    println!("{name:<10} {:<6} {}  {relmse:.5}  {:6.2} %  {largest:.2}", 2 * arguments.spp, ratios.join("  "), 100.0 * fraction);

    let picture = out.join(format!("{name}.png"));
    let big = image::imageops::resize(
        &image::RgbImage::from_raw(columns, rows, z_image).ok_or_else(|| Error::Internal("block image".into()))?,
        columns * 8,
        rows * 8,
        image::imageops::FilterType::Nearest,
    );
    big.save(&picture).map_err(|e| Error::Output { file: picture.clone(), message: e.to_string() })?;

    let ratio_fits = total.iter().all(|t| (t.ratio() - 1.0).abs() <= 0.003f64.max(4.0 * t.ratio_error()));
    Ok(fraction >= 0.99 && ratio_fits)
}

fn render_scene(name: &str, spp: u32, seed: u64) -> Result<Image> {
    let folders = ["scenes", "benches/scenes"].map(|folder| Path::new(folder).join(format!("{name}.json")));
    let path = folders.iter().find(|path| path.exists()).unwrap_or(&folders[0]);
    let desc = import::load_scene(path)?;
    let settings = Settings::new(&desc, &Overrides { spp: Some(spp), seed: Some(seed), ..Overrides::default() })?;
    let scene = compile::compile(&desc, path)?;
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, settings.threads)?;
    Ok(render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.image)
}

/// Sums over pixels of means and of variances of the means.
#[derive(Clone, Copy, Default)]
struct Sums {
    ours: f64,
    reference: f64,
    our_variance: f64,
    reference_variance: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.ours += other.ours;
        self.reference += other.reference;
        self.our_variance += other.our_variance;
        self.reference_variance += other.reference_variance;
    }

    fn z(&self) -> f64 {
        let deviation = (self.our_variance + self.reference_variance).sqrt();
        if deviation > 0.0 { (self.ours - self.reference) / deviation } else { 0.0 }
    }

    fn ratio(&self) -> f64 {
        self.ours / self.reference
    }

    fn ratio_error(&self) -> f64 {
        (self.our_variance + self.reference_variance).sqrt() / self.reference
    }
}

/// Sums over one block. Pixels are independent, so the variance of the sum is the sum of the pixels' variances, each from the difference of
/// two independent halves: (a - b)² / 4 estimates the variance of (a + b) / 2.
fn block_sums(reference: &Image, halves: &[Image; 2], ours: &[Image; 2], origin: [u32; 2], channel: usize) -> Sums {
    let mut sums = Sums::default();
    for y in origin[1]..origin[1] + BLOCK {
        for x in origin[0]..origin[0] + BLOCK {
            let at = |image: &Image| f64::from(color(image, x, y)[channel]);
            let (a, b) = (at(&ours[0]), at(&ours[1]));
            sums.ours += 0.5 * (a + b);
            sums.our_variance += 0.25 * (a - b) * (a - b);
            let (a, b) = (at(&halves[0]), at(&halves[1]));
            sums.reference += at(reference);
            sums.reference_variance += 0.25 * (a - b) * (a - b);
        }
    }
    sums
}

/// Black where the picture has no colour.
fn color(image: &Image, x: u32, y: u32) -> [f32; 3] {
    image.rgb(x, y).unwrap_or_default()
}

fn mean_image(images: &[Image; 2]) -> Vec<[f64; 3]> {
    let [width, height] = images[0].size;
    let pixel = |x, y| std::array::from_fn(|c| 0.5 * (f64::from(color(&images[0], x, y)[c]) + f64::from(color(&images[1], x, y)[c])));
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

/// Mean over pixels and channels of (test - reference)² / (reference² + 0.01).
fn relative_mse(reference: &Image, test: &[[f64; 3]]) -> f64 {
    let [width, height] = reference.size;
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            for (r, t) in color(reference, x, y).iter().zip(test[(y * width + x) as usize]) {
                let r = f64::from(*r);
                sum += (t - r) * (t - r) / (r * r + 0.01);
            }
        }
    }
    sum / f64::from(width * height * 3)
}
