//! Blocks of a file, compressed on all threads and written in order. Those of `zip` and `zips` are compressed here: the
//! library's deflate takes two to three times as long. Bytes of numbers are taken to be in little-endian order, as on
//! all machines that Embree runs on.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::sync::{Mutex, PoisonError};

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::compression::Compression;
use exr::error::{Result as ExrResult, UnitResult};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::image::write::samples::WritableSamples;
use exr::meta::attribute::ChannelDescription;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{AnyChannels, Image, Layer, Layers};
use libdeflater::{CompressionLvl, Compressor};
use rayon::prelude::*;

use super::channels::LineSamples;
use super::header_order::finish_headers;
use crate::math::vectorize::vectorize;

/// Of libdeflate's levels from 1 to 12. Higher ones take longer, and files are hardly smaller.
const LEVEL: i32 = 1;

/// Writes a file. Its bytes do not depend on the number of threads.
///
/// # Errors
/// The error of the system or the library.
pub fn write_image<'s, S: LineSamples + WritableSamples<'s>>(
    image: &'s Image<Layers<AnyChannels<S>>>,
    out: &mut BufWriter<&mut File>,
) -> Result<(), String> {
    let headers = image.layer_data.infer_headers(&image.attributes);
    let layers = image.layer_data.create_writer(&headers);
    exr::block::write(&mut *out, headers, true, |meta, chunks| write_blocks(&meta, &image.layer_data, &layers, chunks))
        .map_err(|e| e.to_string())?;
    out.flush().and_then(|()| finish_headers(out.get_mut())).map_err(|e| e.to_string())
}

fn write_blocks<S: LineSamples>(
    meta: &MetaData,
    parts: &[Layer<AnyChannels<S>>],
    layers: &impl LayersWriter,
    chunks: &mut (impl ChunksWriter + Send),
) -> UnitResult {
    let ordered = Mutex::new(Ordered { chunks, next: 0, waiting: BTreeMap::new() });
    let blocks = enumerate_ordered_header_block_indices(&meta.headers).enumerate();
    // Threads take blocks in order, so that few wait for those before them.
    blocks.par_bridge().try_for_each_init(Zip::new, |zip, (place, (row, index))| {
        let data = || layers.extract_uncompressed_block(&meta.headers, index);
        let header = &meta.headers[index.layer];
        let chunk = match header.compression {
            Compression::ZIP1 | Compression::ZIP16 => {
                zip.predict(&parts[index.layer], header, index);
                chunk(header, index, zip.compress().unwrap_or_else(data))?
            }
            _ => UncompressedBlock { index, data: data() }.compress_to_chunk(&meta.headers)?,
        };
        ordered.lock().unwrap_or_else(PoisonError::into_inner).write(place, RowChunk { row, chunk })
    })
}

/// Writes chunks in order, in whatever order they come.
struct Ordered<'a, W> {
    chunks: &'a mut W,
    next: usize,
    waiting: BTreeMap<usize, RowChunk>,
}

/// A chunk with its index in its part.
struct RowChunk {
    row: usize,
    chunk: Chunk,
}

impl<W: ChunksWriter> Ordered<'_, W> {
    fn write(&mut self, place: usize, chunk: RowChunk) -> UnitResult {
        self.waiting.insert(place, chunk);
        while let Some(RowChunk { row, chunk }) = self.waiting.remove(&self.next) {
            self.chunks.write_chunk(row, chunk)?;
            self.next += 1;
        }
        Ok(())
    }
}

/// A compressed block with its place.
fn chunk(header: &Header, index: BlockIndex, compressed_pixels_le: Vec<u8>) -> ExrResult<Chunk> {
    let compressed_block = match header.blocks {
        BlockDescription::ScanLines => {
            let y = index.pixel_position.to_i32().y() + header.own_attributes.layer_position.y();
            CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate: y, compressed_pixels_le })
        }
        BlockDescription::Tiles(tiles) => {
            let coordinates =
                TileCoordinates { tile_index: index.pixel_position / tiles.tile_size, level_index: index.level };
            CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
        }
    };
    Ok(Chunk { layer_index: index.layer, compressed_block })
}

/// OpenEXR's ZIP compression.
struct Zip {
    compressor: Compressor,
    /// The pair before a line, then the line.
    line: Vec<u8>,
    /// The first bytes of all pairs of a block and then the second ones, each less the one before it, plus 128.
    predicted: Vec<u8>,
    compressed: Vec<u8>,
}

impl Zip {
    fn new() -> Self {
        let level = CompressionLvl::new(LEVEL).unwrap_or_default();
        Self { compressor: Compressor::new(level), line: Vec::new(), predicted: Vec::new(), compressed: Vec::new() }
    }

    /// Predicts the bytes of a block, a line of a channel at a time, so that these stay in the cache.
    fn predict<S: LineSamples>(&mut self, part: &Layer<AnyChannels<S>>, header: &Header, index: BlockIndex) {
        let (corner, size) = (index.pixel_position, index.pixel_size);
        let pairs = header.channels.bytes_per_pixel / 2 * size.area();
        self.predicted.resize(2 * pairs, 0);
        let (firsts, seconds) = self.predicted.split_at_mut(pairs);
        // Nothing is before the first byte of all.
        self.line.clear();
        self.line.extend([128, 0]);
        let mut start = 0;
        for y in corner.y()..corner.y() + size.y() {
            let line = y * part.size.x() + corner.x();
            for (channel, ChannelDescription { sample_type, .. }) in
                part.channel_data.list.iter().zip(&header.channels.list)
            {
                self.line.resize(2 + size.x() * sample_type.bytes_per_sample(), 0);
                channel.sample_data.write_line(line, &mut self.line[2..]);
                let end = start + self.line.len() / 2 - 1;
                vectorize!(subtract_pairs(&self.line, &mut firsts[start..end], &mut seconds[start..end]));
                let last = self.line.len() - 2;
                self.line.copy_within(last.., 0);
                self.line.truncate(2);
                start = end;
            }
        }
        // The first of the second bytes comes after the last of the first ones.
        if let Some(second) = seconds.first_mut() {
            *second = second.wrapping_sub(self.line[0]);
        }
    }

    /// The block, compressed; `None` if that does not make it shorter.
    fn compress(&mut self) -> Option<Vec<u8>> {
        self.compressed.resize(self.predicted.len().saturating_sub(1), 0);
        let length = self.compressor.zlib_compress(&self.predicted, &mut self.compressed).ok()?;
        Some(self.compressed[..length].to_vec())
    }
}

/// The first and the second bytes of all pairs but the first, each less the one before it, plus 128.
#[inline(always)]
fn subtract_pairs(bytes: &[u8], firsts: &mut [u8], seconds: &mut [u8]) {
    let pairs = bytes.as_chunks::<2>().0;
    for (i, (first, second)) in firsts.iter_mut().zip(seconds).enumerate() {
        let ([a, b], [c, d]) = (pairs[i], pairs[i + 1]);
        *first = c.wrapping_sub(a).wrapping_add(128);
        *second = d.wrapping_sub(b).wrapping_add(128);
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::{
        AnyChannel, Blocks, Encoding, FlatImage, FlatSamples, ImageAttributes, IntegerBounds, LayerAttributes,
        LineOrder, ReadChannels, ReadLayers, SmallVec, Vec2, f16, read,
    };

    use super::*;
    use crate::file::write_atomically;

    /// Two parts of any bits and of smooth numbers, of all types.
    fn picture(size: Vec2<usize>, compression: Compression, blocks: Blocks) -> FlatImage {
        let random = |i: usize| (i as u32 ^ 0x9e37).wrapping_mul(0x85eb_ca6b).rotate_left(13).wrapping_mul(0xc2b2_ae35);
        let part = |name: &str| {
            let places = || 0..size.area();
            let channels = [
                AnyChannel::new("id", FlatSamples::U32(places().map(random).collect())),
                AnyChannel::new("half", FlatSamples::F16(places().map(|i| f16::from_bits(random(i) as u16)).collect())),
                AnyChannel::new("float", FlatSamples::F32(places().map(|i| f32::from_bits(random(i))).collect())),
                AnyChannel::new("smooth", FlatSamples::F32(places().map(|i| (i / 7) as f32).collect())),
            ];
            let attributes = LayerAttributes { layer_position: Vec2(-3, 5), ..LayerAttributes::named(name) };
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()))
        };
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
        Image { attributes, layer_data: SmallVec::from_vec(vec![part("a"), part("b")]) }
    }

    /// What the library reads of a file, and the file.
    fn written(image: &FlatImage) -> (FlatImage, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_atomically(&path, |out| write_image(image, out)).unwrap();
        let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        (reader.from_file(&path).unwrap(), std::fs::read(path).unwrap())
    }

    fn bits(image: &FlatImage) -> Vec<(String, Vec<u32>)> {
        let channels = image.layer_data.iter().flat_map(|part| &part.channel_data.list);
        let bits = |samples: &FlatSamples| match samples {
            FlatSamples::F16(samples) => samples.iter().map(|v| v.to_bits().into()).collect(),
            FlatSamples::F32(samples) => samples.iter().map(|v| v.to_bits()).collect(),
            FlatSamples::U32(samples) => samples.clone(),
        };
        channels.map(|channel| (channel.name.to_string(), bits(&channel.sample_data))).collect()
    }

    #[test]
    fn every_bit_comes_back() {
        for size in [Vec2(1, 1), Vec2(17, 33), Vec2(4097, 3)] {
            for compression in [Compression::ZIP16, Compression::ZIP1, Compression::RLE] {
                for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 32))] {
                    let image = picture(size, compression, blocks);
                    let (read, _) = written(&image);
                    assert!(bits(&read) == bits(&image), "{size:?} {compression} {blocks:?}");
                    assert_eq!(
                        (read.layer_data[1].size, read.layer_data[1].encoding),
                        (size, image.layer_data[1].encoding)
                    );
                    assert_eq!(read.layer_data[1].attributes.layer_position, Vec2(-3, 5));
                }
            }
        }
    }

    #[test]
    fn bytes_do_not_depend_on_threads() {
        for compression in [Compression::ZIP16, Compression::ZIP1, Compression::PIZ] {
            let image = picture(Vec2(65, 130), compression, Blocks::ScanLines);
            let files = [1, 2, 7].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| written(&image).1)
            });
            assert!(files[0] == files[1] && files[0] == files[2], "{compression}");
        }
    }

    #[test]
    fn zip_is_shorter_than_what_it_holds() {
        let noise = (0..1000_u32).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 13) as u8).collect();
        for predicted in [noise, vec![7; 4096], vec![1, 2], Vec::new()] {
            let mut zip = Zip { predicted, ..Zip::new() };
            let compressed = zip.compress();
            assert!(compressed.is_none_or(|block| block.len() < zip.predicted.len()));
        }
    }

    #[test]
    fn bytes_are_predicted_from_those_before_across_lines_and_channels() {
        let image = picture(Vec2(2, 3), Compression::ZIP16, Blocks::ScanLines);
        let index = BlockIndex { layer: 0, pixel_position: Vec2(0, 1), pixel_size: Vec2(2, 2), level: Vec2(0, 0) };
        let headers = image.layer_data.infer_headers(&image.attributes);
        let block = image.layer_data.create_writer(&headers).extract_uncompressed_block(&headers, index);
        let split: Vec<u8> = block.iter().step_by(2).chain(block[1..].iter().step_by(2)).copied().collect();
        let predicted = split.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]).wrapping_add(128));
        let mut zip = Zip::new();
        zip.predict(&image.layer_data[0], &headers[0], index);
        assert_eq!(zip.predicted, std::iter::once(split[0]).chain(predicted).collect::<Vec<_>>());
    }
}
