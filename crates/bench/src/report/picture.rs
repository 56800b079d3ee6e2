//! Small pictures within pages.

use ::base64::Engine;
use ::base64::engine::general_purpose::STANDARD;

use crate::color::linear_from_srgb;
use crate::desc::ViewDesc;
use crate::film::{Image, LayerKind};
use crate::output::encode_png;
use steradian::Result;

/// A picture with its name.
#[derive(Clone, Debug)]
pub struct Picture {
    pub name: String,
    /// The file.
    pub png: Vec<u8>,
}

/// RFC 4648.
pub fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// A picture of `size` pixels, row by row from the top, made smaller by means of whole blocks until no side is longer
/// than `side`.
fn shrink(size: [u32; 2], side: u32, pixel: impl Fn(usize) -> [f32; 3]) -> Image {
    let [width, height] = size;
    let block = width.max(height).div_ceil(side).max(1);
    let small = size.map(|side| (side / block).max(1));
    let mut data = Vec::new();
    for (y, x) in (0..small[1]).flat_map(|y| (0..small[0]).map(move |x| (y, x))) {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for y in (y * block..(y + 1) * block).take_while(|y| *y < height) {
            for x in (x * block..(x + 1) * block).take_while(|x| *x < width) {
                let value = pixel((y * width + x) as usize);
                sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
                count += 1.0;
            }
        }
        data.extend(sum.map(|sum| sum / count).into_iter().chain([1.0]));
    }
    Image::of_color(small, data)
}

/// A picture of values from 0 (black) by red and yellow to 1 (white), no side of which is longer than `side`.
///
/// # Errors
/// If it cannot be encoded.
pub fn heat(name: String, size: [u32; 2], side: u32, value: impl Fn(usize) -> f32) -> Result<Picture> {
    let mut image = shrink(size, side, |i| [value(i); 3]);
    for pixel in image.layers.iter_mut().flat_map(|layer| layer.data.chunks_exact_mut(4)) {
        let x = pixel[0];
        let codes = [2.2 * x, 2.2 * x - 0.8, 3.0 * x - 2.0];
        pixel.iter_mut().zip(codes).for_each(|(value, code)| *value = linear_from_srgb(code.clamp(0.0, 1.0)));
    }
    Ok(Picture { name, png: encode_png(&image, 0.0, ViewDesc::Srgb)? })
}

/// A picture's colour, no side of which is longer than `side`.
///
/// # Errors
/// If it cannot be encoded.
pub fn thumbnail(name: String, image: &Image, side: u32) -> Result<Picture> {
    let pixels: Vec<&[f32]> = image.layer(LayerKind::Color).map_or(Vec::new(), |layer| layer.pixels().collect());
    let size = [image.crop.width, image.crop.height];
    let small = shrink(size, side, |i| pixels.get(i).map_or([0.0; 3], |pixel| [pixel[0], pixel[1], pixel[2]]));
    Ok(Picture { name, png: encode_png(&small, 0.0, ViewDesc::default())? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(picture: &Picture) -> image::RgbImage {
        image::load_from_memory(&picture.png).unwrap().to_rgb8()
    }

    #[test]
    fn thumbnails_are_means_and_heat_goes_from_black_to_white() {
        let light = |i: u32| if i % 4 < 2 { 0.0 } else { 1e4 };
        let data = (0..16).flat_map(|i| [light(i), light(i), light(i), 1.0]).collect();
        let small = decode(&thumbnail("x".into(), &Image::of_color([4, 4], data), 2).unwrap());
        assert_eq!((small.dimensions(), small.get_pixel(0, 1).0), ((2, 2), [0; 3]));
        assert!(small.get_pixel(1, 0).0.iter().all(|code| *code > 250), "{small:?}");
        let map = decode(&heat("x".into(), [3, 1], 9, |i| [0.0, 0.36, 2.0][i]).unwrap());
        assert_eq!((map.get_pixel(0, 0).0, map.get_pixel(2, 0).0), ([0; 3], [255; 3]));
        let [r, g, b] = map.get_pixel(1, 0).0;
        assert!(r > 195 && g < 5 && b < 5, "{map:?}");
    }
}
