//! Headers of EXR files, and whether a file can hold what they claim: memory is not allocated by a header alone.

use std::path::Path;

use exr::compression::Compression;
use exr::meta::MetaData;
use exr::meta::header::Header;

/// Bytes that a block takes at least: its place in the table of offsets, its coordinate, its size.
const BLOCK_BYTES: u64 = 16;

/// How many bytes of pixels a byte of a file can at most become. Run lengths make 128 of 2, deflate at most 1032 of
/// one, and what the other methods leave out is bounded by the size of their smallest codes.
fn most_per_byte(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => 1032,
        // 24 of 32 bits are kept, and deflated.
        Compression::PXR24 => 2 * 1032,
        // 4 x 4 numbers of 16 bits in 3 bytes; 32-bit numbers stay as they are.
        Compression::B44 | Compression::B44A => 11,
        // One number for 8 x 8, deflated.
        _ => 4 * 64 * 1032,
    }
}

/// Checks the headers of a file against its length in bytes.
///
/// # Errors
/// If the file is too short for the pixels that a header claims.
pub fn check_claims(headers: &[Header], bytes: u64) -> Result<(), String> {
    let mut blocks = 0u64;
    for header in headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let channels = header.channels.bytes_per_pixel as u64;
        // Levels and subsampled channels hold less: a quarter is below all of them.
        let pixels = (width as u64).saturating_mul(height as u64).saturating_mul(channels) / 4;
        blocks = blocks.saturating_add(header.chunk_count as u64);
        let holds = bytes.saturating_mul(most_per_byte(header.compression));
        if !header.deep && (pixels > holds || blocks.saturating_mul(BLOCK_BYTES) > bytes) {
            return Err(format!("it claims {width} x {height} pixels, more than {bytes} bytes can hold"));
        }
    }
    Ok(())
}

/// Why headers cannot be read.
pub fn header_fault(error: &exr::error::Error) -> String {
    let message = error.to_string();
    if message.contains("file identifier missing") { "not an EXR file".to_owned() } else { message }
}

/// The headers of an EXR file, whose claims are checked.
///
/// # Errors
/// As [`check_claims`], and the library's; a file that cannot be opened is one.
pub fn read_headers(path: &Path) -> Result<Vec<Header>, String> {
    let file = super::open(path).map_err(|e| e.to_string())?;
    let bytes = file.limit();
    let headers = MetaData::read_from_unbuffered(file, false).map_err(|e| header_fault(&e))?.headers;
    check_claims(&headers, bytes)?;
    Ok(headers.into_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};

    fn write(path: &Path, size: (usize, usize), compression: Compression) {
        let channels = SpecificChannels::rgb(|_| (0.0f32, 0.0f32, 0.0f32));
        let encoding = Encoding { compression, ..Encoding::FAST_LOSSLESS };
        Image::from_layer(Layer::new(size, LayerAttributes::default(), encoding, channels))
            .write()
            .to_file(path)
            .unwrap();
    }

    #[test]
    fn other_files_are_no_exr_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        for bytes in [&b"\x89PNG\r\n"[..], b"hello, world"] {
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read_headers(&path).unwrap_err(), "not an EXR file");
        }
    }

    #[test]
    fn honest_files_pass_and_files_that_claim_more_than_they_hold_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.exr");
        for compression in [
            Compression::Uncompressed,
            Compression::RLE,
            Compression::ZIP1,
            Compression::ZIP16,
            Compression::PIZ,
            Compression::PXR24,
            Compression::B44,
            Compression::B44A,
        ] {
            // Black compresses best.
            write(&file, (700, 500), compression);
            assert!(read_headers(&file).is_ok(), "{compression:?}");
            let bytes = std::fs::read(&file).unwrap();
            // The data window's and the display window's far corner, each after its attribute's name, type and size.
            let mut damaged = bytes.clone();
            for at in 0..damaged.len() - 16 {
                if damaged[at..].starts_with(&[0, 0, 0, 0, 0, 0, 0, 0, 0xbb, 2, 0, 0, 0xf3, 1, 0, 0]) {
                    damaged[at + 8..at + 16].copy_from_slice(&[0xff, 0xff, 0, 0, 0xff, 0xff, 0, 0]);
                }
            }
            assert_ne!(bytes, damaged);
            std::fs::write(&file, damaged).unwrap();
            assert!(read_headers(&file).unwrap_err().contains("65536 x 65536"), "{compression:?}");
        }
    }
}
