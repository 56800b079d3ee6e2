//! Linear RGB images, OpenEXR, Radiance HDR and PFM, for environments.

mod pfm;

use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers, Vec2};

use super::AssetError;
use crate::file::exr_headers::read_headers;

/// Pixels row by row from the top, linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// `width * height` colours.
    pub pixels: Vec<[f32; 3]>,
}

/// Reads an `.exr`, `.hdr` or `.pfm` file.
///
/// # Errors
/// If the file is missing, malformed, or of another kind.
pub fn read_rgb_image(path: &Path) -> Result<RgbImage, AssetError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("exr") => read_exr(path),
        Some("hdr") => read_hdr(path),
        Some("pfm") => pfm::read(path),
        _ => Err(AssetError::Malformed("only .exr, .hdr and .pfm files can be environments".into())),
    }
}

/// More pixels than any environment has; a header that claims more is damaged.
const MAX_PIXELS: u64 = 1 << 30;

fn read_exr(path: &Path) -> Result<RgbImage, AssetError> {
    let malformed = |e: &dyn std::fmt::Display| AssetError::Malformed(format!("not a readable EXR file: {e}"));
    let open = || crate::file::open(path).map_err(|e| AssetError::missing(path, &e));
    open()?;
    // The size is believed only after a look: memory is asked for before any pixel is read.
    for header in &read_headers(path).map_err(|e| malformed(&e))? {
        let size = header.layer_size;
        if size.width() as u64 * size.height() as u64 > MAX_PIXELS {
            return Err(malformed(&format!("{} x {} pixels are too many", size.width(), size.height())));
        }
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().rgba_channels(
        |size: Vec2<usize>, _: &_| RgbImage { width: size.width(), height: size.height(), pixels: vec![[0.0; 3]; size.area()] },
        |image: &mut RgbImage, at: Vec2<usize>, (r, g, b, _a): (f32, f32, f32, f32)| {
            image.pixels[at.y() * image.width + at.x()] = [r, g, b];
        },
    );
    let image = reader.first_valid_layer().all_attributes().from_unbuffered(open()?);
    image.map(|image| image.layer_data.channel_data.pixels).map_err(|e| malformed(&e))
}

fn read_hdr(path: &Path) -> Result<RgbImage, AssetError> {
    let malformed = |e: image::ImageError| AssetError::Malformed(format!("not a readable HDR file: {e}"));
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    let image = image::load_from_memory_with_format(&bytes, image::ImageFormat::Hdr).map_err(malformed)?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = image.into_raw().as_chunks::<3>().0.to_vec();
    Ok(RgbImage { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_formats_keep_rows_and_colours() {
        let folder = tempfile::tempdir().unwrap();
        let pixel = |x: usize, y: usize| [x as f32, y as f32, 0.25];
        let exr = folder.path().join("sky.exr");
        exr::prelude::write_rgb_file(&exr, 3, 2, |x, y| pixel(x, y).into()).unwrap();
        let hdr = folder.path().join("sky.HDR");
        let raw: Vec<image::Rgb<f32>> = (0..6).map(|i| image::Rgb(pixel(i % 3, i / 3))).collect();
        image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&hdr).unwrap()).encode(&raw, 3, 2).unwrap();
        for path in [exr, hdr] {
            let image = read_rgb_image(&path).unwrap();
            assert_eq!((image.width, image.height), (3, 2));
            for (i, p) in image.pixels.iter().enumerate() {
                let expected = pixel(i % 3, i / 3);
                assert!(p.iter().zip(expected).all(|(a, b)| (a - b).abs() <= b / 128.0), "{}: {p:?}", path.display());
            }
        }
    }

    #[test]
    fn damaged_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("whole.exr");
        exr::prelude::write_rgb_file(&path, 8, 8, |x, y| (x as f32, y as f32, 0.5f32)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [0, 3, 40, whole.len() / 2, whole.len() - 1] {
            let cut = folder.path().join("cut.exr");
            std::fs::write(&cut, &whole[..length]).unwrap();
            assert!(matches!(read_rgb_image(&cut), Err(AssetError::Malformed(_))), "{length} bytes");
        }
        let other = folder.path().join("sky.hdr");
        std::fs::write(&other, "#?RADIANCE\n\n-Y 100000 +X 100000\n").unwrap();
        assert!(matches!(read_rgb_image(&other), Err(AssetError::Malformed(_))));
        assert!(matches!(read_rgb_image(folder.path()), Err(AssetError::Malformed(_))));
        assert!(matches!(read_rgb_image(&folder.path().join("none.exr")), Err(AssetError::Missing { .. })));
    }
}
