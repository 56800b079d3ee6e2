//! Measures ways to look up an image on a plane that reaches to the horizon: the error of a picture at equal samples, and the time of a lookup.
//!
//! `cargo run --release --example texture_filtering`. A camera one unit above the plane sees it from below its feet to the horizon. Each pixel's
//! samples are those of the renderer's sampler; the reference has 4,096 points per pixel. The ways are
//!
//! - `point`: bilinear where the ray meets the plane, as the renderer does it;
//! - `stochastic`: bilinear at a random point of the parallelogram that a pixel covers;
//! - `mip`: trilinear in a pyramid, at the level of the ray cone's width across the ray divided by the cosine (Akenine-Möller et al.,
//!   "Texture Level of Detail Strategies for Real-Time Ray Tracing");
//! - `mip / sqrt(n)`: the same with a cone that is narrower by the square root of the samples per pixel.
//!
//! The last column is the error that remains at 1,024 samples: what the way blurs.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use steradian::import::{ImageData, Samples};
use steradian::math::{Vec2, vec2};
use steradian::sampling::{Sampler, SamplerKind};
use steradian::texture::{Bitmap, Decoding, Image};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
/// Tangent of the angle below the horizon at the bottom of the picture, and of half its width.
const LOWEST: f32 = 0.6;
const SIDE: f32 = 0.45;
const TEXELS: usize = 256;
/// Repetitions of the image per unit of the plane.
const TILES: f32 = 0.5;

/// An image and its halves, quarters and so on.
struct Pyramid {
    levels: Vec<Bitmap>,
}

impl Pyramid {
    fn new(texel: impl Fn(usize, usize) -> f32) -> Self {
        let mut side = TEXELS;
        let mut values: Vec<f32> = (0..side * side).map(|i| texel(i % side, i / side)).collect();
        let mut levels = Vec::new();
        loop {
            let data = ImageData { width: side, height: side, channels: 1, samples: Samples::F32(values.clone()) };
            levels.push(Bitmap::new(Arc::new(Image::new(data).expect("a finite image")), Decoding::Linear));
            if side == 1 {
                return Self { levels };
            }
            side /= 2;
            let at = |x: usize, y: usize| values[y * 2 * side + x];
            let mean = |x: usize, y: usize| 0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1));
            values = (0..side * side).map(|i| mean(i % side * 2, i / side * 2)).collect();
        }
    }

    fn bilinear(&self, uv: Vec2) -> f32 {
        self.levels[0].scalar(uv)
    }

    /// For a footprint of this width in uv.
    fn trilinear(&self, uv: Vec2, width: f32) -> f32 {
        let level = (width * TEXELS as f32).log2().clamp(0.0, (self.levels.len() - 1) as f32);
        let below = level as usize;
        let [fine, coarse] = [below, (below + 1).min(self.levels.len() - 1)].map(|level| self.levels[level].scalar(uv));
        fine + (coarse - fine) * (level - below as f32)
    }
}

/// Where the ray through a point of the picture (in pixels) meets the plane, in uv.
fn uv_at(x: f32, y: f32) -> Vec2 {
    let down = (y / HEIGHT as f32).max(1e-6) * LOWEST;
    let across = (2.0 * x / WIDTH as f32 - 1.0) * SIDE;
    vec2(across / down, 1.0 / down) * TILES
}

/// Changes of uv with a pixel along x and y.
fn footprint(x: f32, y: f32) -> [Vec2; 2] {
    let step = 0.5f32.min(0.5 * y);
    [uv_at(x + 0.5, y) - uv_at(x - 0.5, y), (uv_at(x, y + step) - uv_at(x, y - step)) / (2.0 * step)]
}

/// The width of a ray cone of one pixel where it meets the plane, in uv.
fn cone_width(x: f32, y: f32) -> f32 {
    let down = (y / HEIGHT as f32).max(1e-6) * LOWEST;
    let across = (2.0 * x / WIDTH as f32 - 1.0) * SIDE;
    let length = (1.0 + down * down + across * across).sqrt();
    let (distance, cosine) = (length / down, down / length);
    let spread = LOWEST / HEIGHT as f32 / length;
    spread * distance / cosine * TILES
}

#[derive(Clone, Copy)]
enum Way {
    Point,
    Stochastic,
    Mip,
    NarrowMip,
}

impl Way {
    const ALL: [(Self, &'static str); 4] =
        [(Self::Point, "point"), (Self::Stochastic, "stochastic"), (Self::Mip, "mip"), (Self::NarrowMip, "mip / sqrt(n)")];

    /// What a sample at a point of the picture sees; `u` are two more random numbers.
    fn look(self, image: &Pyramid, [x, y]: [f32; 2], u: [f32; 2], samples: u32) -> f32 {
        let uv = uv_at(x, y);
        match self {
            Self::Point => image.bilinear(uv),
            Self::Stochastic => {
                let [dx, dy] = footprint(x, y);
                image.bilinear(uv + dx * (u[0] - 0.5) + dy * (u[1] - 0.5))
            }
            Self::Mip => image.trilinear(uv, cone_width(x, y)),
            Self::NarrowMip => image.trilinear(uv, cone_width(x, y) / (samples as f32).sqrt()),
        }
    }
}

fn picture(image: &Pyramid, way: Way, samples: u32) -> Vec<f64> {
    let sampler = Sampler::new(SamplerKind::Sobol, 1);
    let pixel = |i: u32| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        let seed = sampler.pixel(x, y);
        let one = |sample: u32| {
            let u = sampler.sample_4d(seed, sample, 0);
            f64::from(way.look(image, [x as f32 + u[0], y as f32 + u[1]], [u[2], u[3]], samples))
        };
        (0..samples).map(one).sum::<f64>() / f64::from(samples)
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// The mean of 64 x 64 points of each pixel.
fn reference(image: &Pyramid) -> Vec<f64> {
    let n = 64;
    let middle = |i: u32| (i as f32 + 0.5) / n as f32;
    let pixel = |i: u32| {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        (0..n * n).map(|k| f64::from(image.bilinear(uv_at(x + middle(k % n), y + middle(k / n))))).sum::<f64>() / f64::from(n * n)
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

fn relative_mse(reference: &[f64], test: &[f64]) -> f64 {
    reference.iter().zip(test).map(|(r, t)| (t - r) * (t - r) / (r * r + 0.01)).sum::<f64>() / reference.len() as f64
}

fn main() {
    let noise = |x: usize, y: usize| {
        let hash = ((x * 73_856_093) ^ (y * 19_349_663)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        0.1 + 0.8 * ((hash >> 40) & 0xffff) as f32 / 65_535.0
    };
    let images = [("checker", Pyramid::new(|x, y| if (x / 32 + y / 32) % 2 == 0 { 0.1 } else { 0.9 })), ("noise", Pyramid::new(noise))];
    println!("relMSE against 4,096 points per pixel");
    println!("{:<8} {:<14} {:>8} {:>8} {:>8} {:>8} {:>8} {:>10}", "image", "way", "1 spp", "4", "16", "64", "1,024", "ns/lookup");
    for (name, image) in &images {
        let reference = reference(image);
        for (way, label) in Way::ALL {
            let errors = [1, 4, 16, 64, 1024].map(|samples| format!("{:8.5}", relative_mse(&reference, &picture(image, way, samples))));
            let start = Instant::now();
            let lookups = 2_000_000u32;
            let mut sum = 0.0;
            for i in 0..lookups {
                let t = (i as f32 * 0.618_034).fract();
                sum += way.look(image, [96.0 * (i as f32 * 0.754_877).fract(), 64.0 * t], [t, 1.0 - t], 1);
            }
            black_box(sum);
            let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / f64::from(lookups);
            println!("{name:<8} {label:<14} {} {nanoseconds:10.1}", errors.join(" "));
        }
    }
}
