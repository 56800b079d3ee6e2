//! Channels to write, each with its own pixels.

use std::borrow::Cow;

use exr::prelude::{AnyChannel, FlatSamples, f16};
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;

use crate::film::Crop;
use crate::output::role::Role;

/// A channel to write.
pub struct Plane {
    /// Full name.
    pub name: String,
    /// What it holds.
    pub role: Role,
    /// Its pixels, row by row from the top.
    pub samples: FlatSamples,
}

/// Where values are taken from: pixels whose channels lie side by side.
pub struct SampleSource<'a> {
    /// Full names of the channels, in the order of the data.
    pub names: Vec<String>,
    /// Values, pixel by pixel.
    pub data: Cow<'a, [f32]>,
    /// Stored in 16 bits.
    pub half: bool,
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
    /// The values of one channel out of `stride` in the pixels to store.
    fn values(self, data: &[f32], channel: usize, stride: usize) -> impl Iterator<Item = f32> + '_ {
        let Self { available, written } = self;
        (written.y..written.y + written.height).flat_map(move |y| {
            (written.x..written.x + written.width).map(move |x| {
                if !available.contains(x, y) {
                    return 0.0;
                }
                let pixel = (y - available.y) as usize * available.width as usize + (x - available.x) as usize;
                data.get(pixel * stride + channel).copied().unwrap_or(0.0)
            })
        })
    }
}

/// The channels of all sources, in parallel. Numbers beyond what 16 bits hold become their largest, 65504.
pub fn planes(sources: &[SampleSource], region: Region) -> Vec<Plane> {
    let jobs: Vec<(&SampleSource, usize)> =
        sources.iter().flat_map(|source| (0..source.names.len()).map(move |i| (source, i))).collect();
    jobs.into_par_iter()
        .map(|(source, i)| {
            let name = source.names[i].clone();
            let stride = source.names.len();
            let samples = if region.available == region.written {
                let values = source.data.iter().skip(i).step_by(stride).copied();
                collect(values, source.half)
            } else {
                collect(region.values(&source.data, i, stride), source.half)
            };
            Plane { role: Role::of(&name), name, samples }
        })
        .collect()
}

fn collect(values: impl Iterator<Item = f32>, half: bool) -> FlatSamples {
    if half { FlatSamples::F16(to_half(values.collect())) } else { FlatSamples::F32(values.collect()) }
}

/// The nearest numbers of 16 bits; what is beyond becomes the largest.
pub fn to_half(mut values: Vec<f32>) -> Vec<f16> {
    for value in &mut values {
        *value = value.clamp(-MAX_HALF, MAX_HALF);
    }
    let mut halves = vec![f16::ZERO; values.len()];
    halves.convert_from_f32_slice(&values);
    halves
}

/// The largest number of 16 bits.
const MAX_HALF: f32 = 65504.0;

impl From<Plane> for AnyChannel<FlatSamples> {
    fn from(plane: Plane) -> Self {
        Self { quantize_linearly: plane.role != Role::Color, ..Self::new(plane.name.as_str(), plane.samples) }
    }
}
