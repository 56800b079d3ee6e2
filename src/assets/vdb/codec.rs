//! Compressed bytes of known length.

use flate2::{Decompress, FlushDecompress, Status};

use super::blosc;

/// How bytes are compressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Codec {
    None,
    Zip,
    Blosc,
}

/// Decompresses, with buffers that are used again.
#[derive(Default)]
pub struct Decoder {
    zlib: Option<Decompress>,
    shuffled: Vec<u8>,
}

impl Decoder {
    /// Exactly `out.len()` bytes of what is compressed to all of `bytes`.
    pub fn decompress(&mut self, codec: Codec, bytes: &[u8], out: &mut [u8]) -> Result<(), String> {
        match codec {
            Codec::None if bytes.len() == out.len() => out.copy_from_slice(bytes),
            Codec::None => return Err(format!("{} bytes are given for {}", bytes.len(), out.len())),
            Codec::Blosc => blosc::decompress(bytes, out, &mut self.shuffled)?,
            Codec::Zip => {
                let zlib = self.zlib.get_or_insert_with(|| Decompress::new(true));
                zlib.reset(true);
                let status = zlib.decompress(bytes, out, FlushDecompress::Finish);
                if status.ok() != Some(Status::StreamEnd) || zlib.total_out() != out.len() as u64 {
                    return Err("a zlib stream is damaged".into());
                }
            }
        }
        Ok(())
    }
}

/// The most bytes that so many can be decompressed to: a code of deflate, of at least two bits, makes at most 258
/// bytes, and a byte of LZ4 for at most 255.
pub fn most_decompressed(codec: Codec, bytes: u64) -> u64 {
    match codec {
        Codec::None => bytes,
        Codec::Zip | Codec::Blosc => bytes.saturating_mul(1032),
    }
}
