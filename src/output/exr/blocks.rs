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
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::FlatImage;
use libdeflater::{CompressionLvl, Compressor};
use rayon::prelude::*;

use super::header_order::finish_headers;

/// Of libdeflate's levels from 1 to 12. Higher ones take longer, and files are hardly smaller.
const LEVEL: i32 = 2;

/// Writes a file. Its bytes do not depend on the number of threads.
///
/// # Errors
/// The error of the system or the library.
pub fn write_image(image: &FlatImage, out: &mut BufWriter<&mut File>) -> Result<(), String> {
    let headers = image.layer_data.infer_headers(&image.attributes);
    let layers = image.layer_data.create_writer(&headers);
    exr::block::write(&mut *out, headers, true, |meta, chunks| write_blocks(&meta, &layers, chunks)).map_err(|e| e.to_string())?;
    out.flush().and_then(|()| finish_headers(out.get_mut())).map_err(|e| e.to_string())
}

fn write_blocks(meta: &MetaData, layers: &impl LayersWriter, chunks: &mut (impl ChunksWriter + Send)) -> UnitResult {
    let ordered = Mutex::new(Ordered { chunks, next: 0, waiting: BTreeMap::new() });
    let blocks = enumerate_ordered_header_block_indices(&meta.headers).enumerate();
    // Threads take blocks in order, so that few wait for those before them.
    blocks.par_bridge().try_for_each_init(Zip::new, |zip, (place, (row, index))| {
        let data = layers.extract_uncompressed_block(&meta.headers, index);
        let header = &meta.headers[index.layer];
        let chunk = match header.compression {
            Compression::ZIP1 | Compression::ZIP16 => chunk(header, index, zip.compress(data))?,
            _ => UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)?,
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
            let coordinates = TileCoordinates { tile_index: index.pixel_position / tiles.tile_size, level_index: index.level };
            CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
        }
    };
    Ok(Chunk { layer_index: index.layer, compressed_block })
}

/// OpenEXR's ZIP compression.
struct Zip {
    compressor: Compressor,
    predicted: Vec<u8>,
    compressed: Vec<u8>,
}

impl Zip {
    fn new() -> Self {
        let level = CompressionLvl::new(LEVEL).unwrap_or_default();
        Self { compressor: Compressor::new(level), predicted: Vec::new(), compressed: Vec::new() }
    }

    /// A block's bytes, compressed if that makes them fewer.
    fn compress(&mut self, block: Vec<u8>) -> Vec<u8> {
        predict(&block, &mut self.predicted);
        self.compressed.resize(block.len().saturating_sub(1), 0);
        match self.compressor.zlib_compress(&self.predicted, &mut self.compressed) {
            Ok(length) => self.compressed[..length].to_vec(),
            // No room.
            Err(_) => block,
        }
    }
}

/// The first bytes of all pairs and then the second ones, each less the one before it, plus 128. Blocks have an even
/// number of bytes.
fn predict(block: &[u8], out: &mut Vec<u8>) {
    out.resize(block.len(), 0);
    let pairs = block.as_chunks::<2>().0;
    let (Some(first), Some(last)) = (pairs.first(), pairs.last()) else { return };
    let difference = |byte: u8, before: u8| byte.wrapping_sub(before).wrapping_add(128);
    let (firsts, seconds) = out.split_at_mut(pairs.len());
    // Nothing is before the first one.
    (firsts[0], seconds[0]) = (first[0], difference(first[1], last[0]));
    let neighbours = pairs.iter().zip(&pairs[1..]);
    for ((before, pair), (first, second)) in neighbours.zip(firsts[1..].iter_mut().zip(&mut seconds[1..])) {
        *first = difference(pair[0], before[0]);
        *second = difference(pair[1], before[1]);
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, LineOrder,
        ReadChannels, ReadLayers, SmallVec, Vec2, f16, read,
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
                    assert_eq!((read.layer_data[1].size, read.layer_data[1].encoding), (size, image.layer_data[1].encoding));
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
    fn zip_is_no_longer_than_what_it_holds() {
        let noise: Vec<u8> = (0..1000_u32).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 13) as u8).collect();
        let mut zip = Zip::new();
        for block in [noise, vec![7; 4096], vec![1, 2], Vec::new()] {
            let compressed = zip.compress(block.clone());
            assert!(compressed.len() < block.len() || compressed == block);
        }
        let mut predicted = Vec::new();
        predict(&[1, 2, 3, 5, 8, 13], &mut predicted);
        assert_eq!(predicted, [1, 130, 133, 122, 131, 136]);
    }
}
