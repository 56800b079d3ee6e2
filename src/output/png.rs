//! PNG: 8 bits a channel, for an sRGB display.

use std::io::Write;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::view::code_values;
use super::write_atomically;
use crate::color::Rgb;
use crate::desc::ViewDesc;
use crate::error::{Error, Result};
use crate::film::{Crop, Image, LayerKind};

/// Writes the picture's colour in 8 bits through a view, after `exposure` stops. Colour is premultiplied, so leaving
/// out alpha shows the picture over black. Ordered dithering hides the steps of dark gradients; a value that 8 bits
/// hold exactly is not dithered.
///
/// # Errors
/// [`Error::Output`] if the file cannot be written.
pub fn write_png(path: &Path, image: &Image, exposure: f32, view: ViewDesc) -> Result<()> {
    write_atomically(path, |out| write_bytes(out, image, exposure, view))
}

/// The file that [`write_png`] writes.
///
/// # Errors
/// [`Error::Internal`] if the picture has no pixels.
pub fn encode_png(image: &Image, exposure: f32, view: ViewDesc) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_bytes(&mut bytes, image, exposure, view).map_err(Error::Internal)?;
    Ok(bytes)
}

fn write_bytes(out: impl Write, image: &Image, exposure: f32, view: ViewDesc) -> std::result::Result<(), String> {
    let shown = shown(image);
    let bytes = encode(image, &shown, exposure, view);
    let encoder = PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive);
    encoder.write_image(&bytes, shown.width, shown.height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())
}

/// The part of the data that is to be shown: all but the overscan.
fn shown(image: &Image) -> Crop {
    let o = image.overscan;
    let [width, height] = image.size.map(|side| side - 2 * o);
    image.crop.intersection(&Crop { x: o, y: o, width, height })
}

fn encode(image: &Image, shown: &Crop, exposure: f32, view: ViewDesc) -> Vec<u8> {
    let scale = exposure.exp2();
    let width = image.crop.width.max(1);
    let mut bytes = Vec::with_capacity(shown.area() as usize * 3);
    let pixels = image.layer(LayerKind::Color).map(|layer| layer.pixels()).into_iter().flatten();
    for (i, pixel) in pixels.enumerate() {
        let (x, y) = (image.crop.x + i as u32 % width, image.crop.y + i as u32 / width);
        if !shown.contains(x, y) {
            continue;
        }
        // The place in the full picture, so that a crop equals the same part of the whole.
        let threshold = dither(x - image.overscan, y - image.overscan);
        let light = Rgb::new(pixel[0], pixel[1], pixel[2]) * scale;
        bytes.extend(code_values(view, light).to_array().map(|code| (code * 255.0 + threshold) as u8));
    }
    bytes
}

/// A number in `(0, 1)` for rounding up or down: the additive recurrence on the plastic number's powers, evenly spread
/// over any neighbourhood. It keeps clear of both ends, so that rounding errors do not move exact values.
fn dither(x: u32, y: u32) -> f32 {
    let phase = f64::from(x) * 0.754_877_666_246_692_7 + f64::from(y) * 0.569_840_290_998_053_3;
    (phase.fract() as f32).clamp(1.0 / 256.0, 255.0 / 256.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{linear_from_srgb, srgb_from_linear};

    fn picture(size: [u32; 2], value: impl Fn(u32) -> f32) -> Image {
        let data = (0..size[0] * size[1]).flat_map(|i| [value(i), value(i), value(i), 1.0]).collect();
        Image::of_color(size, data)
    }

    fn encode_all(image: &Image, exposure: f32) -> Vec<u8> {
        encode(image, &shown(image), exposure, ViewDesc::Srgb)
    }

    #[test]
    fn views_are_of_exposed_light_and_srgb_is_the_curve_alone() {
        let image = picture([64, 1], |i| 0.02 * i as f32);
        let bytes = |exposure: f32, view: ViewDesc| encode(&image, &shown(&image), exposure, view);
        for (i, pixel) in bytes(0.0, ViewDesc::Srgb).chunks(3).enumerate() {
            let exact = srgb_from_linear((0.02 * i as f32).min(1.0)) * 255.0;
            assert!(pixel.iter().all(|byte| (f32::from(*byte) - exact).abs() < 1.0), "{i}");
        }
        let half = picture([64, 1], |i| 0.01 * i as f32);
        for (view, name) in ViewDesc::ALL {
            assert_eq!(bytes(-1.0, view), encode(&half, &shown(&half), 0.0, view), "{name}");
        }
        // Middle grey.
        let grey = encode_view(&picture([64, 64], |_| 0.18), ViewDesc::Agx);
        assert!(grey.iter().all(|byte| (127..=128).contains(byte)));
        assert!(
            bytes(0.0, ViewDesc::Agx) != bytes(0.0, ViewDesc::Srgb)
                && bytes(0.0, ViewDesc::Agx) != bytes(0.0, ViewDesc::Filmic)
        );
    }

    fn encode_view(image: &Image, view: ViewDesc) -> Vec<u8> {
        encode(image, &shown(image), 0.0, view)
    }

    #[test]
    fn what_lies_around_the_picture_is_not_shown() {
        let image = Image { overscan: 1, ..picture([4, 3], |i| i as f32) };
        assert_eq!(encode_all(&image, -40.0).len(), 2 * 3);
        let inner = Image { overscan: 1, ..picture([4, 3], |i| if i == 5 || i == 6 { 0.25 } else { 9.0 }) };
        assert_eq!(encode_all(&inner, 0.0), encode_all(&picture([2, 1], |_| 0.25), 0.0));
    }

    #[test]
    fn dithering_keeps_the_mean_and_exposure_is_in_stops() {
        let between = linear_from_srgb(100.3 / 255.0);
        let bytes = encode_all(&picture([64, 64], |_| between), 0.0);
        let mean = bytes.iter().map(|b| f64::from(*b)).sum::<f64>() / bytes.len() as f64;
        assert!((mean - 100.3).abs() < 0.01, "{mean}");
        assert!(bytes.iter().all(|b| (100..=101).contains(b)));
        assert_eq!(encode_all(&picture([8, 8], |_| 0.25), 1.0), encode_all(&picture([8, 8], |_| 0.5), 0.0));
        assert!(encode_all(&picture([8, 8], |_| -1.0), 0.0).iter().all(|b| *b == 0));
        assert!(encode_all(&picture([8, 8], |_| 1e30), 0.0).iter().all(|b| *b == 255));
    }
}
