//! Linear RGB images, OpenEXR and Radiance HDR, for environments.

use std::path::Path;

use super::AssetError;

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

/// Reads an `.exr` or `.hdr` file.
///
/// # Errors
/// If the file is missing, malformed, or of another kind.
pub fn read_rgb_image(path: &Path) -> Result<RgbImage, AssetError> {
    std::fs::File::open(path).map_err(|e| AssetError::missing(path, &e))?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("exr") => read_exr(path),
        Some("hdr") => read_hdr(path),
        _ => Err(AssetError::Malformed("only .exr and .hdr files can be environments".into())),
    }
}

fn read_exr(path: &Path) -> Result<RgbImage, AssetError> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| RgbImage { width: size.width(), height: size.height(), pixels: vec![[0.0; 3]; size.area()] },
        |image: &mut RgbImage, at, (r, g, b, _a): (f32, f32, f32, f32)| image.pixels[at.y() * image.width + at.x()] = [r, g, b],
    );
    image.map(|image| image.layer_data.channel_data.pixels).map_err(|e| AssetError::Malformed(format!("not a readable EXR file: {e}")))
}

fn read_hdr(path: &Path) -> Result<RgbImage, AssetError> {
    let malformed = |e: image::ImageError| AssetError::Malformed(format!("not a readable HDR file: {e}"));
    let reader = image::ImageReader::open(path).map_err(|e| AssetError::missing(path, &e))?;
    let image = reader.decode().map_err(malformed)?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = image.into_raw().as_chunks::<3>().0.to_vec();
    Ok(RgbImage { width, height, pixels })
}
