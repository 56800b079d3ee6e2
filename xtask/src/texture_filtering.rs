//! Measures ways to look up an image on a plane that reaches to the horizon: the error of a picture at equal samples,
//! and the time of a lookup.
//!
//! `cargo xtask texture_filtering`. A camera one unit above the plane sees it from below its feet to the horizon. Each
//! pixel's samples are those of the renderer's sampler; the reference has 4,096 points per pixel. The ways are
//!
//! - `point`: bilinear where the ray meets the plane;
//! - `stochastic`: bilinear at a random point of the parallelogram that a pixel covers;
//! - `pixel's cone`: in the image's pyramid, over the area where the ray cone of a pixel meets the plane
//!   (Akenine-Möller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing");
//! - `samples' cone`: the same with a cone that is narrower by the root of the samples per pixel, as the renderer does
//!   it;
//! - `longer axis`, `shorter axis`: the same by one axis of that area in place of their geometric mean.
//!
//! The last column is the error that remains at 1,024 samples: what the way blurs.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use steradian::internal::image_data::{ImageData, Samples};
use steradian::internal::math::{Vec2, vec2};
use steradian::internal::sampling::{Sampler, SamplerKind};
use steradian::internal::texture::{Bitmap, Decoding, Footprint, TextureImage};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
/// Tangent of the angle below the horizon at the bottom of the picture, and of half its width.
const LOWEST: f32 = 0.6;
const SIDE: f32 = 0.45;
const TEXELS: usize = 256;
/// Repetitions of the image per unit of the plane.
const TILES: f32 = 0.5;

fn bitmap(texel: impl Fn(usize, usize) -> f32) -> Bitmap {
    let values = (0..TEXELS * TEXELS).map(|i| texel(i % TEXELS, i / TEXELS)).collect();
    let data = ImageData { width: TEXELS, height: TEXELS, channels: 1, samples: Samples::F32(values) };
    Bitmap::new(Arc::new(TextureImage::new(data).expect("a finite image")), Decoding::Linear)
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

/// The axes, in uv, of the ellipse where a ray cone of one pixel meets the plane: the shorter one first.
fn cone_axes(x: f32, y: f32) -> [f32; 2] {
    let down = (y / HEIGHT as f32).max(1e-6) * LOWEST;
    let across = (2.0 * x / WIDTH as f32 - 1.0) * SIDE;
    let length = (1.0 + down * down + across * across).sqrt();
    let (distance, cosine) = (length / down, down / length);
    let spread = LOWEST / HEIGHT as f32 / length;
    [1.0, 1.0 / cosine].map(|stretch| spread * distance * TILES * stretch)
}

#[derive(Clone, Copy)]
enum Way {
    Point,
    Stochastic,
    PixelCone,
    SampleCone,
    LongerAxis,
    ShorterAxis,
}

impl Way {
    const ALL: [(Self, &'static str); 6] = [
        (Self::Point, "point"),
        (Self::Stochastic, "stochastic"),
        (Self::PixelCone, "pixel's cone"),
        (Self::SampleCone, "samples' cone"),
        (Self::LongerAxis, "longer axis"),
        (Self::ShorterAxis, "shorter axis"),
    ];

    /// What a sample at a point of the picture sees; `u` are two more random numbers.
    fn look(self, image: &Bitmap, [x, y]: [f32; 2], u: [f32; 2], samples: u32) -> f32 {
        let uv = uv_at(x, y);
        let over = |area: f32, samples: u32| {
            image.scalar_over(&Footprint { area: area / samples as f32, ..Footprint::point(uv) })
        };
        let [shorter, longer] = cone_axes(x, y);
        match self {
            Self::Point => image.scalar(uv),
            Self::Stochastic => {
                let [dx, dy] = footprint(x, y);
                image.scalar(uv + dx * (u[0] - 0.5) + dy * (u[1] - 0.5))
            }
            Self::PixelCone => over(shorter * longer, 1),
            Self::SampleCone => over(shorter * longer, samples),
            Self::LongerAxis => over(longer * longer, samples),
            Self::ShorterAxis => over(shorter * shorter, samples),
        }
    }
}

fn picture(image: &Bitmap, way: Way, samples: u32) -> Vec<f64> {
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
fn reference(image: &Bitmap) -> Vec<f64> {
    let n = 64;
    let middle = |i: u32| (i as f32 + 0.5) / n as f32;
    let pixel = |i: u32| {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        (0..n * n).map(|k| f64::from(image.scalar(uv_at(x + middle(k % n), y + middle(k / n))))).sum::<f64>()
            / f64::from(n * n)
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

fn relative_mse(reference: &[f64], test: &[f64]) -> f64 {
    reference.iter().zip(test).map(|(r, t)| (t - r) * (t - r) / (r * r + 0.01)).sum::<f64>() / reference.len() as f64
}

pub fn run() {
    let noise = |x: usize, y: usize| {
        let hash = ((x * 73_856_093) ^ (y * 19_349_663)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        0.1 + 0.8 * ((hash >> 40) & 0xffff) as f32 / 65_535.0
    };
    let images =
        [("checker", bitmap(|x, y| if (x / 32 + y / 32) % 2 == 0 { 0.1 } else { 0.9 })), ("noise", bitmap(noise))];
    println!("relMSE against 4,096 points per pixel");
    println!(
        "{:<8} {:<14} {:>8} {:>8} {:>8} {:>8} {:>8} {:>10}",
        "image", "way", "1 spp", "4", "16", "64", "1,024", "ns/lookup"
    );
    for (name, image) in &images {
        let reference = reference(image);
        for (way, label) in Way::ALL {
            let errors = [1, 4, 16, 64, 1024]
                .map(|samples| format!("{:8.5}", relative_mse(&reference, &picture(image, way, samples))));
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
