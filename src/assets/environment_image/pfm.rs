//! Portable float maps: `PF` or `Pf`, width, height and a scale whose sign gives the byte order, then rows of floats
//! from the bottom.

use std::path::Path;

use super::{AssetError, RgbImage};

/// Reads a file.
pub fn read(path: &Path) -> Result<RgbImage, AssetError> {
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    parse(&bytes).ok_or_else(|| AssetError::Malformed("not a readable PFM file".into()))
}

fn parse(bytes: &[u8]) -> Option<RgbImage> {
    let mut rest = bytes;
    let mut word = || {
        let start = rest.iter().position(|c| !c.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace)?;
        let word = std::str::from_utf8(&rest[start..start + length]).ok()?;
        // One white space ends the header.
        rest = &rest[start + length + 1..];
        Some(word)
    };
    let channels = match word()? {
        "PF" => 3usize,
        "Pf" => 1,
        _ => return None,
    };
    let (width, height) = (word()?.parse::<usize>().ok()?, word()?.parse::<usize>().ok()?);
    let scale = word()?.parse::<f32>().ok().filter(|scale| scale.is_finite() && *scale != 0.0)?;
    let count = width.checked_mul(height)?.checked_mul(channels)?;
    if count == 0 || rest.len() < count.checked_mul(4)? {
        return None;
    }
    let value = |i: usize| {
        let bytes: [u8; 4] = std::array::from_fn(|k| rest[4 * i + k]);
        scale.abs() * if scale < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let pixel = |row: usize, column: usize| {
        let first = ((height - 1 - row) * width + column) * channels;
        std::array::from_fn(|k| value(first + k.min(channels - 1)))
    };
    let pixels = (0..width * height).map(|i| pixel(i / width, i % width)).collect();
    Some(RgbImage { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, values: &[f32], little: bool) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        values.iter().for_each(|v| bytes.extend(if little { v.to_le_bytes() } else { v.to_be_bytes() }));
        bytes
    }

    #[test]
    fn rows_begin_at_the_bottom_in_both_byte_orders() {
        let values: Vec<f32> = (0..12).map(|i| i as f32).collect();
        for (scale, little) in [("-1", true), ("1", false)] {
            let image = parse(&file(&format!("PF\n2 2\n{scale}\n"), &values, little)).unwrap();
            assert_eq!((image.width, image.height), (2, 2));
            assert_eq!(image.pixels, [[6.0, 7.0, 8.0], [9.0, 10.0, 11.0], [0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        }
        assert_eq!(parse(&file("Pf 1 1 -2.0\n", &[0.5], true)).unwrap().pixels, [[1.0; 3]]);
    }

    #[test]
    fn damaged_files_are_refused() {
        for header in [
            "",
            "PF",
            "PF\n2 2\n-1\n",
            "PG\n1 1\n-1\n",
            "PF\n0 1\n-1\n",
            "PF 99999999999 99999999999 -1\n",
            "PF 1 1 0\n",
            "PF 1 1 nan\n",
        ] {
            assert!(parse(&file(header, &[0.0; 5], true)).is_none(), "{header}");
        }
    }
}
