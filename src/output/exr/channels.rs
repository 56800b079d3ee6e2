//! Channels to write: their samples are read from layers line by line, so that no channel is copied as a whole.

use std::borrow::Cow;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude::{AnyChannel, FlatSamples, Vec2, f16};
use half::slice::HalfFloatSliceExt;

use crate::film::Crop;
use crate::output::role::Role;

/// Samples that are converted to 16 bits at once.
const CONVERTED: usize = 128;

/// The largest number of 16 bits.
const MAX_HALF: f32 = 65504.0;

/// The samples of a channel, to be written line by line.
pub trait LineSamples: Sync {
    /// Writes consecutive samples of a line to `bytes`, which are zero, in little-endian order; the first of them has
    /// the index `first` in the data window.
    fn write_line(&self, first: usize, bytes: &mut [u8]);
}

impl LineSamples for FlatSamples {
    fn write_line(&self, first: usize, bytes: &mut [u8]) {
        match self {
            Self::F16(samples) => write_samples(samples[first..].iter().copied(), f16::to_le_bytes, bytes),
            Self::F32(samples) => write_samples(samples[first..].iter().copied(), f32::to_le_bytes, bytes),
            Self::U32(samples) => write_samples(samples[first..].iter().copied(), u32::to_le_bytes, bytes),
        }
    }
}

fn write_samples<T, const N: usize>(
    samples: impl Iterator<Item = T>,
    to_bytes: impl Fn(T) -> [u8; N],
    bytes: &mut [u8],
) {
    bytes.as_chunks_mut().0.iter_mut().zip(samples).for_each(|(bytes, sample)| *bytes = to_bytes(sample));
}

/// Which part of a picture is stored, and around it black.
#[derive(Clone, Copy)]
pub struct Region {
    /// The pixels that there are.
    pub available: Crop,
    /// The pixels to store.
    pub written: Crop,
}

impl Region {
    /// The available ones of `count` pixels of a row to store, the first of which has the index `first`.
    fn available_of(&self, first: usize, count: usize) -> AvailablePixels {
        let Self { available, written } = self;
        let (x, y) = (first % written.width as usize, first / written.width as usize);
        let row = Crop { x: written.x + x as u32, y: written.y + y as u32, width: count as u32, height: 1 };
        let part = row.intersection(available);
        if part.area() == 0 {
            return AvailablePixels { before: 0, start: 0, count: 0 };
        }
        let start = (part.y - available.y) as usize * available.width as usize + (part.x - available.x) as usize;
        AvailablePixels { before: (part.x - row.x) as usize, start, count: part.width as usize }
    }
}

/// Pixels of a row that there are.
struct AvailablePixels {
    /// Pixels of the row before them.
    before: usize,
    /// The index of the first among all available pixels.
    start: usize,
    count: usize,
}

/// A layer to write: pixels whose channels lie side by side.
pub struct InterleavedLayer<'a> {
    /// Full names of the channels, in the order of the data.
    pub names: Vec<String>,
    /// Values, pixel by pixel.
    pub data: Cow<'a, [f32]>,
    /// Stored in 16 bits.
    pub half: bool,
}

impl InterleavedLayer<'_> {
    /// The channels of the layer.
    pub fn channels(&self, region: Region) -> impl Iterator<Item = FileChannel<'_>> {
        self.names.iter().enumerate().map(move |(channel, name)| FileChannel {
            name,
            role: Role::of(name),
            samples: LayerSamples { data: &self.data, channel, stride: self.names.len(), half: self.half, region },
        })
    }
}

/// A channel to write.
pub struct FileChannel<'a> {
    /// Full name.
    pub name: &'a str,
    /// What it holds.
    pub role: Role,
    /// Its samples.
    pub samples: LayerSamples<'a>,
}

impl<'a> From<FileChannel<'a>> for AnyChannel<LayerSamples<'a>> {
    fn from(channel: FileChannel<'a>) -> Self {
        Self { quantize_linearly: channel.role != Role::Color, ..Self::new(channel.name, channel.samples) }
    }
}

/// The samples of one channel of a layer.
#[derive(Clone, Copy)]
pub struct LayerSamples<'a> {
    data: &'a [f32],
    /// Which of the channels of a pixel.
    channel: usize,
    /// How many channels a pixel has.
    stride: usize,
    /// Stored in 16 bits.
    half: bool,
    region: Region,
}

impl LineSamples for LayerSamples<'_> {
    fn write_line(&self, first: usize, bytes: &mut [u8]) {
        let size = self.sample_type().bytes_per_sample();
        let AvailablePixels { before, start, count } = self.region.available_of(first, bytes.len() / size);
        let bytes = &mut bytes[before * size..][..count * size];
        let pixels = &self.data[start * self.stride..][..count * self.stride];
        match self.stride {
            1 => self.write(pixels.iter().copied(), bytes),
            2 => self.write(pixels.as_chunks::<2>().0.iter().map(|pixel| pixel[self.channel]), bytes),
            3 => self.write(pixels.as_chunks::<3>().0.iter().map(|pixel| pixel[self.channel]), bytes),
            4 => self.write(pixels.as_chunks::<4>().0.iter().map(|pixel| pixel[self.channel]), bytes),
            stride => self.write(pixels.chunks_exact(stride).map(|pixel| pixel[self.channel]), bytes),
        }
    }
}

impl LayerSamples<'_> {
    #[inline(always)]
    fn write(&self, mut values: impl Iterator<Item = f32>, bytes: &mut [u8]) {
        if !self.half {
            return write_samples(values, f32::to_le_bytes, bytes);
        }
        let mut floats = [0.0; CONVERTED];
        for bytes in bytes.chunks_mut(2 * CONVERTED) {
            floats.iter_mut().zip(&mut values).take(bytes.len() / 2).for_each(|(float, value)| *float = value);
            write_samples(to_half(floats).into_iter(), f16::to_le_bytes, bytes);
        }
    }
}

/// The nearest numbers of 16 bits; what is beyond becomes the largest, 65504.
pub fn to_half<const N: usize>(values: [f32; N]) -> [f16; N] {
    let mut halves = [f16::ZERO; N];
    halves.convert_from_f32_slice(&values.map(|value| value.clamp(-MAX_HALF, MAX_HALF)));
    halves
}

/// For compressions of the library, which takes lines, too.
impl<'a> WritableSamples<'_> for LayerSamples<'a> {
    type Writer = LayerLines<'a>;

    fn sample_type(&self) -> SampleType {
        LayerSamples::sample_type(self)
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&self, header: &Header) -> LayerLines<'a> {
        LayerLines { samples: *self, size: header.layer_size }
    }
}

impl LayerSamples<'_> {
    fn sample_type(&self) -> SampleType {
        if self.half { SampleType::F16 } else { SampleType::F32 }
    }
}

/// The lines of a channel.
pub struct LayerLines<'a> {
    samples: LayerSamples<'a>,
    size: Vec2<usize>,
}

impl SamplesWriter for LayerLines<'_> {
    fn extract_line(&self, line: LineRefMut) {
        let start = line.location.position;
        self.samples.write_line(start.y() * self.size.x() + start.x(), line.value);
    }
}
