//! PNG: 8 bits a channel, sRGB-encoded.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::write_atomically;
use crate::color::srgb_from_linear;
use crate::error::Result;
use crate::film::{Image, LayerKind};

/// Writes the picture's colour as 8-bit sRGB after `exposure` stops. Colour is premultiplied, so leaving out alpha shows the picture over
/// black. Ordered dithering hides the steps of dark gradients; a value that 8 bits hold exactly is not dithered.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) if the file cannot be written.
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<()> {
    let bytes = encode(image, exposure);
    write_atomically(path, |out| {
        let encoder = PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive);
        encoder.write_image(&bytes, image.crop.width, image.crop.height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())
    })
}

fn encode(image: &Image, exposure: f32) -> Vec<u8> {
    let scale = exposure.exp2();
    let width = image.crop.width.max(1);
    let mut bytes = Vec::with_capacity(image.crop.area() as usize * 3);
    let pixels = image.layer(LayerKind::Color).map(|layer| layer.pixels()).into_iter().flatten();
    for (i, pixel) in pixels.enumerate() {
        // The place in the full picture, so that a crop equals the same part of the whole.
        let threshold = dither(image.crop.x + i as u32 % width, image.crop.y + i as u32 / width);
        bytes.extend(pixel[..3].iter().map(|linear| {
            let encoded = srgb_from_linear((linear * scale).clamp(0.0, 1.0));
            (encoded * 255.0 + threshold) as u8
        }));
    }
    bytes
}

/// A number in `(0, 1)` for rounding up or down: the additive recurrence on the plastic number's powers, evenly spread over any
/// neighbourhood. It keeps clear of both ends, lest rounding errors move exact values.
fn dither(x: u32, y: u32) -> f32 {
    let phase = f64::from(x) * 0.754_877_666_246_692_7 + f64::from(y) * 0.569_840_290_998_053_3;
    (phase.fract() as f32).clamp(1.0 / 256.0, 255.0 / 256.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::linear_from_srgb;
    use crate::film::{Crop, Layer};

    fn picture(size: [u32; 2], value: impl Fn(u32) -> f32) -> Image {
        let data = (0..size[0] * size[1]).flat_map(|i| [value(i), value(i), value(i), 1.0]).collect();
        Image { size, crop: Crop::full(size), layers: vec![Layer { kind: LayerKind::Color, data }] }
    }

    #[test]
    fn dithering_keeps_the_mean_and_exposure_is_in_stops() {
        let between = linear_from_srgb(100.3 / 255.0);
        let bytes = encode(&picture([64, 64], |_| between), 0.0);
        let mean = bytes.iter().map(|b| f64::from(*b)).sum::<f64>() / bytes.len() as f64;
        assert!((mean - 100.3).abs() < 0.01, "{mean}");
        assert!(bytes.iter().all(|b| (100..=101).contains(b)));
        assert_eq!(encode(&picture([8, 8], |_| 0.25), 1.0), encode(&picture([8, 8], |_| 0.5), 0.0));
        assert!(encode(&picture([8, 8], |_| -1.0), 0.0).iter().all(|b| *b == 0));
        assert!(encode(&picture([8, 8], |_| 1e30), 0.0).iter().all(|b| *b == 255));
    }
}
