//! Chunks of Blosc 1, whose format is that of c-blosc's `README_CHUNK_FORMAT.rst`: a header of 16 bytes, then either
//! the bytes as they are, or the places of blocks. A block is one stream or, without a flag and if it is large enough,
//! one for each byte of a value; a stream is its length and LZ4, or as long as its contents and not compressed.
//! The bytes of values may be shuffled: the first of all, then the second of all.

use super::cursor::Cursor;

const HEADER: usize = 16;

/// The version of the format that all of Blosc 1 writes.
const VERSION: u8 = 2;

const SHUFFLED: u8 = 1;
const STORED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const NEVER_SPLIT: u8 = 16;

/// What has compressed the streams: LZ4 of the list in the upper three bits of the flags.
const LZ4: u8 = 1;
const COMPRESSORS: [&str; 5] = ["BloscLZ", "LZ4", "Snappy", "Zlib", "Zstd"];

/// Blocks of more bytes a value, or fewer values, are one stream.
const MOST_STREAMS: usize = 16;
const FEWEST_VALUES: usize = 128;

/// Decompresses a chunk of exactly `out.len()` bytes; `scratch` is for its use.
pub fn decompress(chunk: &[u8], out: &mut [u8], scratch: &mut Vec<u8>) -> Result<(), String> {
    let mut header = Cursor::new(chunk);
    let [version, _, flags, value_bytes] = header.array()?;
    let [length, block_length, chunk_length] = [header.u32()?, header.u32()?, header.u32()?].map(|n| n as usize);
    if version != VERSION {
        return Err(format!("a Blosc chunk has version {version}, only {VERSION} is supported"));
    }
    if length != out.len() || chunk_length != chunk.len() {
        let (found, needed) = (chunk.len(), out.len());
        return Err(format!("a Blosc chunk of {found} bytes for {needed} claims to be {chunk_length} for {length}"));
    }
    if flags & STORED != 0 {
        let bytes = chunk.get(HEADER..HEADER + length).ok_or("a Blosc chunk ends early")?;
        out.copy_from_slice(bytes);
        return Ok(());
    }
    if flags & BITS_SHUFFLED != 0 {
        return Err("a Blosc chunk has shuffled bits, which is not supported".into());
    }
    let compressor = flags >> 5;
    if compressor != LZ4 {
        let name = COMPRESSORS.get(compressor as usize).unwrap_or(&"an unknown algorithm");
        return Err(format!("a Blosc chunk is compressed by {name}, only LZ4 is supported"));
    }
    let value_bytes = value_bytes as usize;
    if length > 0 && (value_bytes == 0 || block_length == 0) {
        return Err("a Blosc chunk has values or blocks of 0 bytes".into());
    }
    let is_shuffled = flags & SHUFFLED != 0 && value_bytes > 1;
    for block in out.chunks_mut(block_length.max(1)) {
        let start = header.u32()? as usize;
        let is_split = flags & NEVER_SPLIT == 0
            && block.len() == block_length
            && value_bytes <= MOST_STREAMS
            && block_length / value_bytes >= FEWEST_VALUES;
        let streams = if is_split { value_bytes } else { 1 };
        let input = chunk.get(start..).ok_or("a block of a Blosc chunk begins beyond its end")?;
        if is_shuffled {
            scratch.resize(block.len(), 0);
            read_block(input, streams, scratch)?;
            unshuffle(scratch, value_bytes, block);
        } else {
            read_block(input, streams, block)?;
        }
    }
    Ok(())
}

/// Reads the streams of a block.
fn read_block(input: &[u8], streams: usize, out: &mut [u8]) -> Result<(), String> {
    if !out.len().is_multiple_of(streams) {
        return Err(format!("a block of {} bytes in a Blosc chunk cannot have {streams} streams", out.len()));
    }
    let mut input = Cursor::new(input);
    let length = out.len() / streams;
    for part in out.chunks_exact_mut(length) {
        let compressed = input.u32()? as usize;
        let bytes = input.take(compressed)?;
        if compressed == length {
            part.copy_from_slice(bytes);
        } else if lz4_flex::block::decompress_into(bytes, part).ok() != Some(length) {
            return Err("the LZ4 stream of a Blosc chunk is damaged".into());
        }
    }
    Ok(())
}

/// Puts the bytes of each value together; what remains is as it was.
fn unshuffle(shuffled: &[u8], value_bytes: usize, out: &mut [u8]) {
    let count = shuffled.len() / value_bytes;
    let (whole, rest) = shuffled.split_at(count * value_bytes);
    if value_bytes == 4 {
        let (values, _) = out.as_chunks_mut::<4>();
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| &whole[i * count..(i + 1) * count]);
        for ((((value, a), b), c), d) in values.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value = [*a, *b, *c, *d];
        }
    } else {
        for (i, value) in out.chunks_exact_mut(value_bytes).enumerate() {
            value.iter_mut().zip(whole[i..].iter().step_by(count)).for_each(|(byte, from)| *byte = *from);
        }
    }
    out[count * value_bytes..].copy_from_slice(rest);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(flags: u8, value_bytes: u8, lengths: [u32; 2], body: &[u8]) -> Vec<u8> {
        let mut chunk = vec![VERSION, 1, flags, value_bytes];
        let all = [lengths[0], lengths[1], (HEADER + body.len()) as u32];
        chunk.extend(all.into_iter().flat_map(u32::to_le_bytes));
        chunk.extend(body);
        chunk
    }

    fn read(chunk: &[u8], length: usize) -> Result<Vec<u8>, String> {
        let mut out = vec![0; length];
        decompress(chunk, &mut out, &mut Vec::new()).map(|()| out)
    }

    fn stream(bytes: &[u8]) -> Vec<u8> {
        [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
    }

    #[test]
    fn stored_bytes_and_blocks_are_read() {
        assert_eq!(read(&chunk(STORED | SHUFFLED, 4, [5, 5], b"abcde"), 5).unwrap(), b"abcde");
        // Two blocks, the second one short; streams as long as what they stand for are not compressed.
        let places = [24u32, 32].map(u32::to_le_bytes).concat();
        let body = [places, stream(b"wxyz"), stream(b"!")].concat();
        assert_eq!(read(&chunk(LZ4 << 5, 1, [5, 4], &body), 5).unwrap(), b"wxyz!");
        assert_eq!(read(&chunk(LZ4 << 5, 4, [0, 0], &[]), 0).unwrap(), b"");
    }

    #[test]
    fn split_and_shuffled_blocks_are_put_together() {
        // 128 values of 2 bytes, one stream for each byte, and a leftover of 3 bytes in one stream. A run of LZ4: one
        // literal, a copy of 122 bytes from 1 back (4 + 15 + 103), and 5 literals at its end.
        let run = |byte: u8| stream(&[0x1f, byte, 1, 0, 103, 0x50, byte, byte, byte, byte, byte]);
        let places = [24u32, 24 + 30].map(u32::to_le_bytes).concat();
        let body = [places, run(b'a'), run(b'b'), stream(b"ace")].concat();
        let expected = [b"ab".repeat(128), b"ace".to_vec()].concat();
        assert_eq!(read(&chunk(LZ4 << 5 | SHUFFLED, 2, [259, 256], &body), 259).unwrap(), expected);
        let mut out = [0; 10];
        unshuffle(b"aeBFcgDHxy", 4, &mut out);
        assert_eq!(&out, b"aBcDeFgHxy");
        let mut out = [0; 7];
        unshuffle(b"adBEcfx", 3, &mut out);
        assert_eq!(&out, b"aBcdEfx");
    }

    #[test]
    fn damaged_chunks_are_refused() {
        let places = 20u32.to_le_bytes().to_vec();
        let body = [places, stream(&[0x1f, b'a', 1, 0, 103, 0x50, 1, 2, 3, 4, 5])].concat();
        let good = chunk(LZ4 << 5, 4, [128, 128], &body);
        assert!(read(&good, 128).is_ok());
        for length in 0..good.len() {
            assert!(read(&good[..length], 128).is_err(), "{length}");
        }
        for (at, byte, expected) in [
            (0, 1, "version 1"),
            (2, 0x24, "shuffled bits"),
            (2, 0x80, "Zstd"),
            (2, 0xe0, "unknown"),
            (3, 0, "0 bytes"),
            (4, 127, "claims"),
            (8, 0, "0 bytes"),
            (12, 0, "claims"),
            (16, 200, "beyond its end"),
            (20, 200, "ends early"),
            (26, 2, "damaged"),
        ] {
            let mut bad = good.clone();
            bad[at] = byte;
            let error = read(&bad, 128).unwrap_err();
            assert!(error.contains(expected), "{at}: {error}");
        }
    }
}
