//! Compares renders of `scenes/` and `benches/scenes/` with independent reference images of the same scenes, block by
//! block.
//!
//! `cargo xtask compare_refs REFS [--spp N] [SCENE...]`: the folder `REFS` holds `SCENE.exr` for each scene (default:
//! cornell, glass, analytic; a name in one of the two folders, or the path of a scene file) and, of some, two
//! independent halves `SCENE.half0.exr` and `SCENE.half1.exr`. Mitsuba 3 makes references of `benches/scenes/*.xml`:
//! `mitsuba -m llvm_ad_rgb -D spp=1024 -D seed=1 -o REFS/cornell.half0.exr benches/scenes/cornell.xml`.
//!
//! Two renders of N samples with different seeds give our variance, the halves give the reference's; without halves the
//! differences between the two pictures, from pixel to pixel of a block, give both together. Over blocks of 16 x 16
//! pixels, z = (ours - reference) / sqrt(variances).
//!
//! Prints one line per scene: means, relMSE, relMSE without the worst thousandth of the pixels, blocks with |z| < 3,
//! ratio of the medians over blocks of their medians (for references with fireflies). Writes the signed difference, in
//! units of its standard deviation, to `target/compare_refs/SCENE.png` (grey: none; a structure there is a bug).

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::Image;
use steradian::internal::import::{self, ImportOptions};
use steradian::internal::render::{self, Overrides, Settings, Silent};
use steradian::internal::{compile, output};
use steradian::{Error, Result};

use crate::{Outcome, root};

const BLOCK: u32 = 16;

/// What conventions may change under a sky where there is no noise: the rows of an environment reach from pole to pole
/// either with their edges, as ours, or with their centres. Then each of 1,024 rows, and a sun on them, is larger by
/// 1/1023.
const SKY_CONVENTIONS: f64 = 1e-3;

struct Arguments {
    references: PathBuf,
    spp: u32,
    scenes: Vec<String>,
}

pub fn run(words: Vec<String>) -> Outcome {
    let arguments = parse_arguments(words)?;
    let out = &root().join("target/compare_refs");
    std::fs::create_dir_all(out).map_err(|e| Error::Output { file: out.into(), message: e.to_string() })?;
    println!(
        "scene      spp    mean ratio r g b (± its standard error)    relMSE  trimmed    |z| < 3  largest |z|  medians"
    );
    let mut failed = false;
    for scene in &arguments.scenes {
        failed |= !compare_scene(scene, &arguments, out)?;
    }
    if failed { Err("a scene disagrees with its reference".into()) } else { Ok(()) }
}

fn parse_arguments(words: Vec<String>) -> Result<Arguments> {
    let mut rest = words.into_iter();
    let references =
        rest.next().ok_or_else(|| Error::Usage("compare_refs needs the folder of the reference images".into()))?.into();
    let mut arguments = Arguments { references, spp: 512, scenes: Vec::new() };
    while let Some(word) = rest.next() {
        if word == "--spp" {
            let value = rest.next().and_then(|n| n.parse().ok());
            arguments.spp = value.ok_or_else(|| Error::Usage("--spp needs a number".into()))?;
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
fn compare_scene(scene: &str, arguments: &Arguments, out: &Path) -> Result<bool> {
    let name = &*Path::new(scene).file_stem().unwrap_or_default().to_string_lossy();
    let file = |suffix: &str| arguments.references.join(format!("{name}{suffix}.exr"));
    let reference = output::read_exr(&file(""))?;
    let has_halves = file(".half0").exists();
    let halves =
        if has_halves { Some([output::read_exr(&file(".half0"))?, output::read_exr(&file(".half1"))?]) } else { None };
    let (first, has_sky) = render_scene(scene, arguments.spp, 1)?;
    let ours = [first, render_scene(scene, arguments.spp, 2)?.0];
    let allowance = if has_sky { SKY_CONVENTIONS } else { 0.0 };

    let [width, height] = reference.size;
    let (columns, rows) = (width / BLOCK, height / BLOCK);
    let mut z_image = vec![0u8; (columns * rows * 3) as usize];
    let (mut inside, mut largest) = (0u32, 0f64);
    let mut medians = Vec::with_capacity((columns * rows * 3) as usize);
    let mut total = [Sums::default(); 3];
    for by in 0..rows {
        for bx in 0..columns {
            for c in 0..3 {
                let sums = block_sums(&reference, halves.as_ref(), &ours, [bx * BLOCK, by * BLOCK], c);
                let z = sums.z(allowance);
                inside += u32::from(z.abs() < 3.0);
                largest = largest.max(z.abs());
                z_image[((by * columns + bx) * 3) as usize + c] = (128.0 + 25.0 * z).clamp(0.0, 255.0) as u8;
                total[c].add(&sums);
                medians.push(sums.medians);
            }
        }
    }
    let mean = mean_image(&ours);
    let [relmse, trimmed] = relative_mse(&reference, &mean);
    let fraction = f64::from(inside) / f64::from(columns * rows * 3);
    let ratios: Vec<String> = total.iter().map(|t| format!("{:.5} ± {:.5}", t.ratio(), t.ratio_error())).collect();
    let (our_median, their_median) = (median(medians.iter().map(|m| m[0])), median(medians.iter().map(|m| m[1])));
    println!(
        "{name:<10} {:<6} {}  {relmse:.5}  {trimmed:.5}  {:6.2} %  {largest:.2}  {:.4}",
        2 * arguments.spp,
        ratios.join("  "),
        100.0 * fraction,
        our_median / their_median
    );

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

/// The picture, and whether there is a sky.
fn render_scene(name: &str, spp: u32, seed: u64) -> Result<(Image, bool)> {
    let known = ["scenes/NAME.json", "benches/scenes/NAME.json", "benches/scenes/NAME.xml"]
        .map(|file| root().join(file.replace("NAME", name)));
    let own = Path::new(name);
    let path = if own.is_file() { own } else { known.iter().find(|path| path.exists()).unwrap_or(&known[0]) };
    let imported = import::read_scene(path, &ImportOptions::default())?;
    let settings =
        Settings::new(&imported.desc, &Overrides { spp: Some(spp), seed: Some(seed), ..Overrides::default() })?;
    let scene = compile::compile_from(&imported.desc, imported.source(path))?;
    let accel = accel::build(AccelKind::EMBREE, &scene.geometry, settings.threads)?;
    let image = render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.image;
    Ok((image, scene.features.environment))
}

/// Sums over pixels of means and of variances of the means.
#[derive(Clone, Copy, Default)]
struct Sums {
    ours: f64,
    reference: f64,
    /// Of the difference between the two.
    variance: f64,
    /// Of our pixels and of the reference's.
    medians: [f64; 2],
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.ours += other.ours;
        self.reference += other.reference;
        self.variance += other.variance;
    }

    /// The difference in standard deviations, of which `allowance` as a part of the reference is one more.
    fn z(&self, allowance: f64) -> f64 {
        let deviation = self.variance.sqrt().hypot(allowance * self.reference);
        if deviation > 0.0 { (self.ours - self.reference) / deviation } else { 0.0 }
    }

    fn ratio(&self) -> f64 {
        self.ours / self.reference
    }

    fn ratio_error(&self) -> f64 {
        self.variance.sqrt() / self.reference
    }
}

/// Sums over one block. Pixels are independent, so the variance of the sum is the sum of the pixels' variances, each
/// from the difference of two independent halves: (a - b)² / 4 estimates the variance of (a + b) / 2. Without halves of
/// the reference it is the variance of the differences between ours and the reference over the pixels of the block.
fn block_sums(
    reference: &Image,
    halves: Option<&[Image; 2]>,
    ours: &[Image; 2],
    origin: [u32; 2],
    channel: usize,
) -> Sums {
    let mut sums = Sums::default();
    let at = |image: &Image, [x, y]: [u32; 2]| f64::from(color(image, x, y)[channel]);
    let half_difference = |images: &[Image; 2], pixel| (0.5 * (at(&images[0], pixel) - at(&images[1], pixel))).powi(2);
    let pixels: Vec<[u32; 2]> = (0..BLOCK * BLOCK).map(|i| [origin[0] + i % BLOCK, origin[1] + i / BLOCK]).collect();
    let values: Vec<[f64; 2]> =
        pixels.iter().map(|&pixel| [0.5 * (at(&ours[0], pixel) + at(&ours[1], pixel)), at(reference, pixel)]).collect();
    for [our, their] in &values {
        sums.ours += our;
        sums.reference += their;
    }
    sums.variance = if let Some(halves) = halves {
        pixels.iter().map(|&pixel| half_difference(ours, pixel) + half_difference(halves, pixel)).sum()
    } else {
        let count = values.len() as f64;
        let mean = (sums.ours - sums.reference) / count;
        values.iter().map(|[our, their]| (our - their - mean).powi(2)).sum::<f64>() * count / (count - 1.0)
    };
    sums.medians = [0, 1].map(|which| median(values.iter().map(|pair| pair[which])));
    sums
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Black where the picture has no colour.
fn color(image: &Image, x: u32, y: u32) -> [f32; 3] {
    image.rgb(x, y).unwrap_or_default()
}

fn mean_image(images: &[Image; 2]) -> Vec<[f64; 3]> {
    let [width, height] = images[0].size;
    let pixel = |x, y| {
        std::array::from_fn(|c| 0.5 * (f64::from(color(&images[0], x, y)[c]) + f64::from(color(&images[1], x, y)[c])))
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

/// Mean over pixels and channels of (test - reference)² / (reference² + 0.01), of all pixels and without the worst
/// thousandth.
fn relative_mse(reference: &Image, test: &[[f64; 3]]) -> [f64; 2] {
    let [width, _] = reference.size;
    let error = |(i, pixel): (usize, &[f64; 3])| {
        let their = color(reference, i as u32 % width, i as u32 / width).map(f64::from);
        their.iter().zip(pixel).map(|(r, t)| (t - r) * (t - r) / (r * r + 0.01)).sum::<f64>() / 3.0
    };
    let mut errors: Vec<f64> = test.iter().enumerate().map(error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    [mean(&errors), mean(&errors[..errors.len() - errors.len() / 1000])]
}
