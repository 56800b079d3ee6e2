//! Pixels of EXR files, block by block: the memory is that of the channels that are kept and of the blocks being
//! decoded.

use std::collections::HashSet;
use std::io::{Read, Seek};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::reader::{ChunksReader, ParallelBlockDecompressor};
use exr::error::{Error as ExrError, Result as ExrResult};
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::{Vec2, f16};

use crate::error::{Error, Result};
use crate::memory;

/// More pixels than any picture has.
pub const MAX_PIXELS: u64 = 1 << 30;

/// Bytes of blocks that are decoded at a time by more than one thread.
const MOST_IN_PARALLEL: usize = 256 << 20;

/// A channel of a part, by their places in the file's headers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The part.
    pub part: usize,
    /// The channel in the part's list.
    pub channel: usize,
}

/// Consecutive samples of a requested channel, in one row of the picture.
#[derive(Clone, Copy, Debug)]
pub struct ChannelRow<'a> {
    /// Index into the channels requested.
    pub requested: usize,
    /// The first sample's pixel: `y * width + x` in the part's data window.
    pub start: usize,
    sample_type: SampleType,
    bytes: &'a [u8],
}

impl ChannelRow<'_> {
    /// Writes the samples to the items of `to`, one after the other.
    pub fn write<'t, T: 't>(&self, to: impl Iterator<Item = &'t mut T>, convert: impl Fn(f32) -> T) {
        match self.sample_type {
            SampleType::F16 => self
                .bytes
                .as_chunks()
                .0
                .iter()
                .zip(to)
                .for_each(|(b, to)| *to = convert(f16::from_ne_bytes(*b).to_f32())),
            SampleType::F32 => {
                self.bytes.as_chunks().0.iter().zip(to).for_each(|(b, to)| *to = convert(f32::from_ne_bytes(*b)));
            }
            SampleType::U32 => {
                self.bytes
                    .as_chunks()
                    .0
                    .iter()
                    .zip(to)
                    .for_each(|(b, to)| *to = convert(u32::from_ne_bytes(*b) as f32));
            }
        }
    }
}

/// How many pixels a part has.
///
/// # Errors
/// If there are more than [`MAX_PIXELS`].
pub fn pixel_count(header: &Header) -> Result<usize, String> {
    let Vec2(width, height) = header.layer_size;
    match (width as u64).saturating_mul(height as u64) {
        pixels if pixels <= MAX_PIXELS => Ok(pixels as usize),
        _ => Err(format!("{width} x {height} pixels are too many: at most {MAX_PIXELS} in all")),
    }
}

/// Memory for `count` channels of a part of the file `path`: copies of `value`, one for each pixel and channel.
///
/// # Errors
/// [`Error::Malformed`] if there are more than [`MAX_PIXELS`] pixels, [`Error::OutOfMemory`].
pub fn allocate<T: Copy>(path: &Path, header: &Header, channels: usize, value: T) -> Result<Vec<T>> {
    let pixels = pixel_count(header).map_err(|message| Error::Malformed { file: path.to_owned(), message })?;
    let (count, mut samples) = (pixels * channels, Vec::new());
    memory::fallible(|| samples.try_reserve_exact(count)).map_err(|_| out_of_memory(path, count * size_of::<T>()))?;
    samples.resize(count, value);
    Ok(samples)
}

/// Checks that there is memory for all channels of a file, and for `more` bytes a pixel.
///
/// # Errors
/// As [`allocate`].
pub fn check_memory(path: &Path, headers: &[Header], more: usize) -> Result<()> {
    let mut bytes = 0usize;
    for header in headers {
        let pixels = pixel_count(header).map_err(|message| Error::Malformed { file: path.to_owned(), message })?;
        bytes = bytes.saturating_add(pixels.saturating_mul(header.channels.bytes_per_pixel.saturating_add(more)));
    }
    if memory::is_available(bytes) { Ok(()) } else { Err(out_of_memory(path, bytes)) }
}

fn out_of_memory(path: &Path, bytes: usize) -> Error {
    Error::OutOfMemory(format!("the pixels of {} need {} MiB", path.display(), bytes >> 20))
}

/// Reads the largest level of flat parts and gives each row of the channels `requested` to `keep`, in no particular
/// order but each sample once. The parts without requested channels are decoded too, so that damage is found, if
/// `every_part` is set. `headers` are those that the places come from.
///
/// # Errors
/// The library's, for files that are malformed, cut short, or use what it does not support.
pub fn read_rows(
    source: impl Read + Seek,
    headers: &[Header],
    requested: &[Place],
    every_part: bool,
    mut keep: impl FnMut(ChannelRow),
) -> ExrResult<()> {
    let reader = exr::block::read(source, false)?;
    let shape = |headers: &[Header]| {
        headers.iter().map(|header| (header.layer_size, header.channels.list.len())).collect::<Vec<_>>()
    };
    if shape(reader.headers()) != shape(headers) {
        return Err(ExrError::Invalid("the file changed while it was read".into()));
    }
    // Which of `requested` a channel is, by part and channel; none for parts that are passed over.
    let mut uses: Vec<Vec<Vec<usize>>> =
        headers.iter().map(|header| vec![Vec::new(); header.channels.list.len()]).collect();
    for (i, place) in requested.iter().enumerate() {
        uses[place.part][place.channel].push(i);
    }
    let is_read = |part: usize, level: Vec2<usize>| {
        level == Vec2(0, 0) && (every_part || requested.iter().any(|place| place.part == part))
    };
    let chunks = reader.filter_chunks(false, |_, _, block| is_read(block.layer, block.level))?;

    let mut seen = HashSet::new();
    let mut insert = |meta: &MetaData, block: UncompressedBlock| {
        let (part, header) = (block.index.layer, &meta.headers[block.index.layer]);
        // As many blocks are read as there are: none of them twice, so none is missing.
        if !is_read(part, block.index.level) || !seen.insert((part, block.index.pixel_position)) {
            return Err(ExrError::Invalid("the table of offsets leads to the same block twice".into()));
        }
        for line in block.lines(&header.channels) {
            let at = line.location;
            for &requested in &uses[part][at.channel] {
                let start = at.position.y() * header.layer_size.width() + at.position.x();
                keep(ChannelRow {
                    requested,
                    start,
                    sample_type: header.channels.list[at.channel].sample_type,
                    bytes: line.value,
                });
            }
        }
        Ok(())
    };
    let meta = chunks.meta_data().clone();
    let most = headers.iter().map(Header::max_block_byte_size).max().unwrap_or(0).max(1);
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(MOST_IN_PARALLEL / most);
    if threads < 2 {
        return chunks.sequential_decompressor(false).try_for_each(|block| insert(&meta, block?));
    }
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    match ParallelBlockDecompressor::new_with_thread_pool(chunks, false, pool) {
        Ok(mut blocks) => blocks.try_for_each(|block| insert(&meta, block?)),
        Err(chunks) => chunks.sequential_decompressor(false).try_for_each(|block| insert(&meta, block?)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::exr_headers::read_headers;
    use exr::compression::Compression;
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, ImageAttributes, Layer, LineOrder, WritableImage,
    };
    use std::io::Cursor;

    const SIZE: Vec2<usize> = Vec2(37, 50);

    /// The sample of a channel at a pixel, in 16 bits too.
    fn sample(part: usize, channel: usize, pixel: usize) -> f32 {
        (part * 300 + channel * 5 + pixel % 500) as f32
    }

    /// Parts of 40 layers with four channels each: halves, floats and numbers in turn.
    fn write(path: &Path, compression: Compression, blocks: Blocks) {
        let channel = |part: usize, i: usize| {
            let values = (0..SIZE.area()).map(|pixel| sample(part, i, pixel));
            let samples = match i % 3 {
                0 => FlatSamples::F16(values.map(f16::from_f32).collect()),
                1 => FlatSamples::F32(values.collect()),
                _ => FlatSamples::U32(values.map(|v| v as u32).collect()),
            };
            AnyChannel::new(format!("layer{:03}.{}", i / 4, ["A", "B", "G", "R"][i % 4]).as_str(), samples)
        };
        let layer = |part: usize| {
            let attributes = exr::prelude::LayerAttributes::named(if part == 0 { "a" } else { "b" });
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            Layer::new(SIZE, attributes, encoding, AnyChannels::sort((0..160).map(|i| channel(part, i)).collect()))
        };
        let image = Image::from_layers(ImageAttributes::with_size(SIZE), vec![layer(0), layer(1)]);
        image.write().to_file(path).unwrap();
    }

    #[test]
    fn wanted_channels_are_kept_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let requested = [(1, 3), (0, 11), (1, 100), (1, 3)].map(|(part, channel)| Place { part, channel });
        for (compression, blocks) in [
            (Compression::ZIP16, Blocks::ScanLines),
            (Compression::Uncompressed, Blocks::ScanLines),
            (Compression::PIZ, Blocks::Tiles(Vec2(16, 8))),
        ] {
            write(&path, compression, blocks);
            let headers = read_headers(&path).unwrap();
            let mut kept = vec![vec![f32::NAN; SIZE.area()]; requested.len()];
            let mut count = 0;
            let source = crate::file::open(&path).unwrap();
            read_rows(source, &headers, &requested, false, |row| {
                let to = &mut kept[row.requested][row.start..];
                row.write(to.iter_mut().inspect(|_| count += 1), |v| v);
            })
            .unwrap();
            // Four of 320 channels.
            assert_eq!(count, requested.len() * SIZE.area());
            for (place, kept) in requested.iter().zip(kept) {
                let expected: Vec<f32> =
                    (0..SIZE.area()).map(|pixel| sample(place.part, place.channel, pixel)).collect();
                assert!(kept == expected, "{compression:?} {place:?}");
            }
        }
    }

    #[test]
    fn damage_is_found_in_wanted_parts_or_in_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, Compression::ZIP16, Blocks::ScanLines);
        let headers = read_headers(&path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let read = |bytes: &[u8], part: usize, every_part: bool| {
            let mut count = 0;
            read_rows(Cursor::new(bytes), &headers, &[Place { part, channel: 0 }], every_part, |_| count += 1)
                .map(|()| count)
        };
        // The second part comes last.
        let cut = &whole[..whole.len() - 1];
        assert_eq!(read(cut, 0, false).unwrap(), SIZE.height());
        assert!(read(cut, 0, true).is_err() && read(cut, 1, false).is_err() && read(&whole, 0, true).is_ok());
        // The first entry of the table of offsets in place of the second.
        let blocks = headers[0].chunk_count + headers[1].chunk_count;
        let table = (0..whole.len()).find(|&at| whole[at..at + 8] == ((at + 8 * blocks) as u64).to_le_bytes()).unwrap();
        let mut twice = whole.clone();
        twice.copy_within(table..table + 8, table + 8);
        let error = read(&twice, 0, false).unwrap_err().to_string();
        assert!(error.contains("same block twice"), "{error}");
        assert_eq!(read(&twice, 1, false).unwrap(), SIZE.height());
        let other = [headers[0].clone()];
        assert!(read_rows(Cursor::new(&whole), &other, &[], true, |_| ()).unwrap_err().to_string().contains("changed"));
    }

    #[test]
    fn pictures_that_are_too_large_are_one_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, Compression::ZIP16, Blocks::ScanLines);
        let mut headers = read_headers(&path).unwrap();
        assert_eq!(allocate(&path, &headers[0], 3, 0.5f32).unwrap(), vec![0.5; 3 * SIZE.area()]);
        check_memory(&path, &headers, 60).unwrap();
        headers[1].layer_size = Vec2(1 << 15, 1 << 15);
        assert_eq!(pixel_count(&headers[1]), Ok(1 << 30));
        for error in [
            check_memory(&path, &headers, 1 << 24).unwrap_err(),
            allocate(&path, &headers[1], 1 << 24, 0.0f32).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(
                matches!(error, Error::OutOfMemory(_)) && text.contains("a.exr need ") && text.ends_with(" MiB"),
                "{text}"
            );
        }
        headers[1].layer_size = Vec2(1 << 15, (1 << 15) + 1);
        for error in
            [check_memory(&path, &headers, 0).unwrap_err(), allocate(&path, &headers[1], 1, 0.0f32).unwrap_err()]
        {
            assert!(
                matches!(&error, Error::Malformed { message, .. } if message.contains("32768 x 32769 pixels are too \
                                                                                       many")),
                "{error}"
            );
        }
    }
}
