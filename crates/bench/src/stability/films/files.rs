//! Picture files.

use std::path::Path;

use half::f16;
use image::RgbImage;

use super::{Effort, Faults, Outcome, bytes, mean_by_film};
use crate::color::linear_from_srgb;
use crate::desc::{CompressionDesc, LayerKind, OutputDesc, PixelTypeDesc, ViewDesc};
use crate::film::{Crop, Image, Layer, LayerInfo};
use crate::output::{RenderInfo, read_exr, write_exr, write_png};
use crate::stability::geometry::Rng;

const COMPRESSIONS: [CompressionDesc; 5] =
    [CompressionDesc::Zip, CompressionDesc::Zips, CompressionDesc::Piz, CompressionDesc::Rle, CompressionDesc::None];

/// A cropped picture of every layer, with numbers of all sizes that a half holds or rounds.
fn picture(rng: &mut Rng) -> Image {
    let crop = Crop { x: 3, y: 2, width: 33, height: 21 };
    let mut number = || (rng.magnitude(-9.0, 6.0) * rng.range(-1.0, 1.0).signum()) as f32;
    let mut layer = |info: &'static LayerInfo| {
        let values = crop.area() as usize * info.channels.len();
        Layer::new(info.kind, (0..values).map(|_| number()).collect())
    };
    Image { size: [40, 30], crop, layers: LayerInfo::ALL.iter().map(&mut layer).collect(), ..Image::default() }
}

/// The pictures, each with its number of threads, that end in a PNG of other bytes than the first. (An EXR holds the
/// render time.)
pub(super) fn differing_files(images: &[(usize, Image)]) -> Faults {
    let Ok(folder) = tempfile::tempdir() else { return images.len().into() };
    let written = |image: &Image| {
        let path = folder.path().join("a.png");
        write_png(&path, image, 0.0, ViewDesc::Srgb).ok()?;
        std::fs::read(&path).ok()
    };
    let first = written(&images[0].1);
    let mut faults = Faults::NONE;
    for (threads, image) in images {
        faults.require(first.is_some() && written(image) == first, || format!("{threads} threads"));
    }
    faults
}

/// How many numbers of a colour layer come back otherwise than as `expected`.
fn changed(written: &Image, read: &Image, expected: impl Fn(f32) -> f32) -> usize {
    if (read.size, read.crop) != (written.size, written.crop) || read.layers.is_empty() {
        return written.layers[0].data.len();
    }
    read.layers[0]
        .data
        .iter()
        .zip(&written.layers[0].data)
        .filter(|(read, written)| read.to_bits() != expected(**written).to_bits())
        .count()
}

/// To the nearest half; beyond the largest of them, that.
fn halved(x: f32) -> f32 {
    f16::from_f32(x).to_f32().clamp(f16::MIN.to_f32(), f16::MAX.to_f32())
}

/// Codes of a PNG of all codes that come back as others.
fn changed_codes(folder: &Path) -> Faults {
    let path = folder.join("ramp.png");
    let ramp = |i: u32| linear_from_srgb((i % 256) as f32 / 255.0);
    let size = [256, 9];
    let data = (0..size[0] * size[1]).flat_map(|i| [ramp(i), ramp(i + 85), ramp(i + 170), 1.0]).collect();
    let image = Image::of_color(size, data);
    let written = write_png(&path, &image, 0.0, ViewDesc::Srgb).map_err(|e| e.to_string());
    match written.and_then(|()| image::open(&path).map_err(|e| e.to_string())) {
        Ok(read) => differing_codes(&read.into_rgb8()),
        Err(message) => Faults { count: 256, first: Some(message) },
    }
}

/// Pixels that have not the codes of their column.
fn differing_codes(read: &RgbImage) -> Faults {
    let mut faults = Faults::NONE;
    for (x, y, pixel) in read.enumerate_pixels() {
        let expected = [0, 85, 170].map(|shift| ((x + shift) % 256) as u8);
        faults.require(pixel.0 == expected, || format!("pixel ({x}, {y}) is {:?} in place of {expected:?}", pixel.0));
    }
    faults
}

/// The relative error of a film's mean of a million numbers from that of a compensated sum.
fn error_of_sums(rng: &mut Rng) -> f64 {
    let values: Vec<f32> = (0..1_000_000).map(|_| (rng.unit() * 1e3f64.powf(rng.unit())) as f32).collect();
    let (mut exact, mut compensation) = (0f64, 0f64);
    for v in &values {
        let y = f64::from(*v) - compensation;
        let t = exact + y;
        compensation = (t - exact) - y;
        exact = t;
    }
    let mean = exact / values.len() as f64;
    (mean_by_film(values.into_iter()) / mean - 1.0).abs()
}

pub(super) fn m7_files(effort: Effort) -> Outcome {
    let Ok(folder) = tempfile::tempdir() else { return Outcome::new() };
    let path = folder.path().join("a.exr");
    let mut rng = Rng::new(7);
    let [mut floats, mut halves, mut again, mut lost] = [const { Faults::NONE }; 4];
    for _ in 0..effort.pick(2, 50) {
        let image = picture(&mut rng);
        for (compression, pixel_type) in
            COMPRESSIONS.into_iter().flat_map(|c| [(c, PixelTypeDesc::Float), (c, PixelTypeDesc::Half)])
        {
            let layers = vec![LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo];
            let desc = OutputDesc { layers, pixel_type, compression: Some(compression), ..OutputDesc::new("a.exr") };
            let describe = || format!("{compression:?}, {pixel_type:?}");
            let written = write_exr(&path, &image, &desc, &RenderInfo::default());
            let Ok(read) = written.and_then(|()| read_exr(&path)) else {
                lost.require(false, describe);
                continue;
            };
            if pixel_type == PixelTypeDesc::Float {
                floats.add(changed(&image, &read, |x| x), describe);
            } else {
                halves.add(changed(&image, &read, halved), describe);
                // A picture of halves is written as it was read.
                let twice = write_exr(&path, &read, &desc, &RenderInfo::default()).and_then(|()| read_exr(&path));
                again.require(twice.map(|image| bytes(&image)).ok() == Some(bytes(&read)), describe);
            }
        }
    }
    Outcome::new()
        .none("files that cannot be written or read", lost)
        .none("floats that change", floats)
        .none("halves that are not the nearest", halves)
        .none("pictures of halves that change when written again", again)
        .none("codes of a PNG that change", changed_codes(folder.path()))
        .at_most("relative error of the mean of a million samples", error_of_sums(&mut rng), 1e-7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_code_is_the_counterexample() {
        let code = |x: u32| [0, 85, 170].map(|shift| ((x + shift) % 256) as u8);
        let mut picture = RgbImage::from_fn(256, 9, |x, _| image::Rgb(code(x)));
        assert_eq!(differing_codes(&picture).count, 0);
        picture.get_pixel_mut(7, 3).0[1] += 1;
        let faults = differing_codes(&picture);
        let expected = "pixel (7, 3) is [7, 93, 177] in place of [7, 92, 177]";
        assert_eq!((faults.count, faults.first.as_deref()), (1, Some(expected)));
    }
}
