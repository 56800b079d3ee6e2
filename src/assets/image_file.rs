//! Images for textures: PNG, JPEG, TGA, Radiance HDR and OpenEXR, with the numbers as they stand in the file.

use std::io::Cursor;
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use half::f16;
use image::{DynamicImage, ImageFormat, ImageReader};

use super::AssetError;
use super::jpeg_check::is_whole_jpeg;
use crate::file::exr_blocks::{ChannelRow, Place, read_rows};
use crate::file::exr_headers::{check_claims, header_fault};
use crate::image_data::{ImageData, Samples};

/// More pixels than any texture has; a header that claims more is damaged, or means harm.
pub(super) const MAX_PIXELS: u64 = 1 << 28;

/// Reads an image file, of the format of its first bytes (TGA, which has no magic number: of its extension).
///
/// # Errors
/// If the file is missing, malformed, cut short, of another kind, or has more than 2^28 pixels or none.
pub fn read_image(path: &Path) -> Result<ImageData, AssetError> {
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    read_bytes(&bytes, path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga")))
}

/// As [`read_image`], for a file that is a part of another: PNG, JPEG, HDR or EXR.
///
/// # Errors
/// As [`read_image`].
pub fn read_image_bytes(bytes: &[u8]) -> Result<ImageData, AssetError> {
    read_bytes(bytes, false)
}

fn read_bytes(bytes: &[u8], is_tga: bool) -> Result<ImageData, AssetError> {
    if bytes.is_empty() {
        return Err(AssetError::Malformed("the file is empty".into()));
    }
    match image::guess_format(bytes) {
        Ok(ImageFormat::OpenExr) => read_exr(bytes),
        Ok(ImageFormat::Jpeg) if !is_whole_jpeg(bytes) => {
            Err(AssetError::Malformed("the JPEG file is cut short".into()))
        }
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr)) => read_with(bytes, format),
        _ if is_tga => read_with(bytes, ImageFormat::Tga),
        _ => Err(AssetError::Malformed("not a PNG, JPEG, TGA, HDR or EXR image".into())),
    }
}

/// Rejects sizes that no image has, before memory is allocated.
pub(super) fn check_size(width: usize, height: usize) -> Result<(), String> {
    let pixels = (width as u64).saturating_mul(height as u64);
    match pixels {
        0 => Err(format!("an image of {width} x {height} pixels has nothing in it")),
        _ if pixels > MAX_PIXELS => Err(format!("{width} x {height} pixels are too many: at most {MAX_PIXELS} in all")),
        _ => Ok(()),
    }
}

/// The most pixels that a byte of a file can encode, where the format has a bound: a header alone never leads to a
/// large allocation.
fn pixels_per_byte(format: ImageFormat) -> u64 {
    match format {
        // Deflate makes at most 1,032 bytes of one, and a byte may hold eight pixels.
        ImageFormat::Png => 8 * 1032,
        // A block of 8 x 8 pixels takes at least a bit.
        ImageFormat::Jpeg => 8 * 64,
        // A run of 128 pixels takes at least two bytes.
        ImageFormat::Tga => 64,
        _ => u64::MAX,
    }
}

fn read_with(bytes: &[u8], format: ImageFormat) -> Result<ImageData, AssetError> {
    let name = format.extensions_str().first().unwrap_or(&"").to_uppercase();
    let malformed = |e: &dyn std::fmt::Display| AssetError::Malformed(format!("not a readable {name} image: {e}"));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The size is checked below; four floats a pixel are the most that a decoder needs.
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(16 * MAX_PIXELS);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| malformed(&e))?;
    let (width, height) = image::ImageDecoder::dimensions(&decoder);
    check_size(width as usize, height as usize).map_err(AssetError::Malformed)?;
    if u64::from(width) * u64::from(height) > pixels_per_byte(format).saturating_mul(bytes.len() as u64) {
        let message =
            format!("the image claims {width} x {height} pixels, more than {} bytes of {name} can hold", bytes.len());
        return Err(AssetError::Malformed(message));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|e| malformed(&e))?;
    let (channels, samples) = match image {
        DynamicImage::ImageLuma8(i) => (1, Samples::U8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Samples::U8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Samples::U8(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, Samples::U8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Samples::U16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, in_half_if_exact(i.into_raw())),
        DynamicImage::ImageRgba32F(i) => (4, in_half_if_exact(i.into_raw())),
        other => (4, Samples::U8(other.into_rgba8().into_raw())),
    };
    Ok(ImageData { width: width as usize, height: height as usize, channels, samples })
}

/// In 16 bits if none of the numbers changes: those of an HDR file have 8 digits.
fn in_half_if_exact(samples: Vec<f32>) -> Samples {
    if samples.iter().all(|&v| f16::from_f32(v).to_f32().to_bits() == v.to_bits()) {
        Samples::F16(samples.into_iter().map(f16::from_f32).collect())
    } else {
        Samples::F32(samples)
    }
}

/// Reads the channels of the first flat part: R, G and B, or Y, or the only one, and alpha.
fn read_exr(bytes: &[u8]) -> Result<ImageData, AssetError> {
    let malformed = |e: &dyn std::fmt::Display| AssetError::Malformed(format!("not a readable EXR image: {e}"));
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| AssetError::Malformed(header_fault(&e)))?
        .headers;
    check_claims(&headers, bytes.len() as u64).map_err(|e| malformed(&e))?;
    let part = headers.iter().position(|header| !header.deep).ok_or_else(|| malformed(&"deep data is unsupported"))?;
    let (all, size) = (&headers[part].channels.list, headers[part].layer_size);
    check_size(size.width(), size.height()).map_err(AssetError::Malformed)?;

    let find = |name: &str| all.iter().position(|channel| channel.name.to_string().eq_ignore_ascii_case(name));
    let mut chosen = match (find("R"), find("G"), find("B"), find("Y")) {
        (Some(r), Some(g), Some(b), _) => vec![r, g, b],
        (.., Some(y)) => vec![y],
        _ if all.len() == 1 => vec![0],
        _ => {
            return Err(AssetError::Malformed(
                "the EXR image has several channels, but neither R, G and B nor Y".into(),
            ));
        }
    };
    chosen.extend(find("A"));
    let requested: Vec<Place> = chosen.iter().map(|&channel| Place { part, channel }).collect();
    let (width, height, channels) = (size.width(), size.height(), chosen.len());
    let read = |keep: &mut dyn FnMut(ChannelRow)| {
        read_rows(Cursor::new(bytes), &headers, &requested, false, keep).map_err(|e| malformed(&e))
    };
    let samples = if chosen.iter().all(|&channel| all[channel].sample_type == SampleType::F16) {
        let mut out = vec![f16::ZERO; width * height * channels];
        read(&mut |row| {
            row.write(out[channels * row.start + row.requested..].iter_mut().step_by(channels), f16::from_f32);
        })?;
        Samples::F16(out)
    } else {
        let mut out = vec![0.0; width * height * channels];
        read(&mut |row| row.write(out[channels * row.start + row.requested..].iter_mut().step_by(channels), |v| v))?;
        in_half_if_exact(out)
    };
    Ok(ImageData { width, height, channels, samples })
}

#[cfg(test)]
mod tests;
