//! Linear RGB images, OpenEXR, Radiance HDR and PFM, for environments.

mod pfm;

use std::io::BufReader;
use std::path::Path;

use exr::meta::header::Header;

use super::AssetError;
use crate::file::exr_blocks::{ChannelRow, Place, pixel_count, read_rows};
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

/// Reads the channels R, G and B of the first flat part that has them.
fn read_exr(path: &Path) -> Result<RgbImage, AssetError> {
    let malformed = |e: &dyn std::fmt::Display| AssetError::Malformed(format!("not a readable EXR file: {e}"));
    let source = crate::file::open(path).map_err(|e| AssetError::missing(path, &e))?;
    let headers = read_headers(path).map_err(AssetError::Malformed)?;
    let choose = |(part, header): (usize, &Header)| {
        let [r, g, b] =
            ["R", "G", "B"].map(|name| header.channels.list.iter().position(|channel| channel.name == *name));
        Some([r?, g?, b?].map(|channel| Place { part, channel }))
    };
    let flat = headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let requested = flat.filter_map(choose).next().ok_or_else(|| malformed(&"no channels R, G and B"))?;
    let header = &headers[requested[0].part];
    // The size is checked first: memory is allocated before any pixel is read.
    let mut pixels = vec![[0.0; 3]; pixel_count(header).map_err(|e| malformed(&e))?];
    let keep =
        |row: ChannelRow| row.write(pixels[row.start..].iter_mut().map(|pixel| &mut pixel[row.requested]), |v| v);
    read_rows(BufReader::new(source), &headers, &requested, false, keep).map_err(|e| malformed(&e))?;
    Ok(RgbImage { width: header.layer_size.width(), height: header.layer_size.height(), pixels })
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
