//! Tiles as bytes and back, exactly. Numbers are little endian; every list has its length before it.

use super::FilmTile;
use super::coverage::CoverageCounts;
use super::sample::ShapeKey;
use super::sum::Sums;
use super::tile::{DROPPED_KEPT, DroppedSample, Spread};

impl FilmTile {
    /// All that the tile holds. Not for tiles of samples that count differently, as guided renders have them.
    pub fn save(&self) -> Vec<u8> {
        debug_assert!(self.weighed.is_empty(), "samples that count differently are not kept");
        let mut out = Out::default();
        for sums in [&self.filtered, &self.own] {
            out.sums(&sums.color);
            out.floats(sums.channels.len(), sums.channels.iter().copied());
        }
        out.sums(&self.weights);
        out.integers(&self.samples);
        out.integers(&self.nearest.depths.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>());
        out.integers(&self.nearest.samples);
        out.integers(&self.nearest.values.iter().map(|value| value.to_bits()).collect::<Vec<_>>());
        if let Some(coverage) = &self.coverage {
            out.coverage(coverage, self.cells.entries());
        }
        out.integers(&self.spread.iter().map(|spread| spread.groups).collect::<Vec<_>>());
        out.sums(&self.spread.iter().map(|spread| spread.sums).collect::<Vec<_>>());
        out.sums(&self.spread.iter().map(|spread| spread.squares).collect::<Vec<_>>());
        out.bytes.extend(self.dropped_count.to_le_bytes());
        out.integers(self.dropped.iter().map(|d| [d.x, d.y, d.sample]).collect::<Vec<_>>().as_flattened());
        out.bytes
    }

    /// Replaces what the tile holds by what [`save`](Self::save) gave for a tile of the same pixels and layers.
    ///
    /// # Errors
    /// What is wrong if the bytes are not those of such a tile; the tile is then of no use.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.read(&mut In { bytes }).ok_or_else(|| format!("the tile at {:?} is not what was saved of it", self.origin()))
    }

    fn read(&mut self, data: &mut In) -> Option<()> {
        for sums in [&mut self.filtered, &mut self.own] {
            sums.color = data.sums().filter(|list| list.len() == sums.color.len())?;
            sums.channels = data.floats().filter(|list| list.len() == sums.channels.len())?;
        }
        self.weights = data.sums().filter(|list| list.len() == self.weights.len())?;
        self.samples = data.integers().filter(|list| list.len() == self.samples.len())?;
        let floats = |list: Vec<u32>| list.into_iter().map(f32::from_bits).collect::<Vec<_>>();
        self.nearest.depths = data.integers().map(floats).filter(|list| list.len() == self.nearest.depths.len())?;
        self.nearest.samples = data.integers().filter(|list| list.len() == self.nearest.samples.len())?;
        self.nearest.values = data.integers().map(floats).filter(|list| list.len() == self.nearest.values.len())?;
        if let Some(coverage) = &mut self.coverage {
            *coverage = data.coverage(self.cells.entries())?;
        }
        let spreads = self.spread.len();
        let groups = data.integers().filter(|list| list.len() == spreads)?;
        let sums = data.sums().filter(|list| list.len() == spreads)?;
        let squares = data.sums().filter(|list| list.len() == spreads)?;
        self.spread = groups
            .into_iter()
            .zip(sums.into_iter().zip(squares))
            .map(|(groups, (sums, squares))| Spread { groups, sums, squares })
            .collect();
        self.dropped_count = u64::from_le_bytes(data.array()?);
        let dropped = data.integers().filter(|list| list.len() <= 3 * DROPPED_KEPT)?;
        self.dropped = dropped.as_chunks().0.iter().map(|&[x, y, sample]| DroppedSample { x, y, sample }).collect();
        data.bytes.is_empty().then_some(())
    }
}

#[derive(Default)]
struct Out {
    bytes: Vec<u8>,
}

impl Out {
    fn length(&mut self, length: usize) {
        self.bytes.extend((length as u64).to_le_bytes());
    }

    fn floats(&mut self, count: usize, values: impl Iterator<Item = f64>) {
        self.length(count);
        let start = self.bytes.len();
        self.bytes.resize(start + count * 8, 0);
        let (places, _) = self.bytes[start..].as_chunks_mut();
        places.iter_mut().zip(values).for_each(|(place, value)| *place = value.to_le_bytes());
    }

    fn sums<const N: usize>(&mut self, sums: &[Sums<N>]) {
        self.floats(sums.len() * 2 * N, sums.iter().flat_map(|sum| sum.pairs().into_iter().flatten()));
    }

    fn integers(&mut self, values: &[u32]) {
        self.length(values.len());
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn coverage(&mut self, coverage: &CoverageCounts, entries: usize) {
        let mut values = Vec::new();
        for list in (0..entries).map(|entry| coverage.of(entry)) {
            values.push(list.len() as u32);
            values.extend(list.iter().flat_map(|&(key, units)| [key.instance, key.shape, units as u32, (units >> 32) as u32]));
        }
        self.integers(&values);
    }
}

struct In<'a> {
    bytes: &'a [u8],
}

impl<'a> In<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    /// The bytes of a list of values of `N` bytes.
    fn list<const N: usize>(&mut self) -> Option<&'a [[u8; N]]> {
        let length = usize::try_from(u64::from_le_bytes(self.array()?)).ok()?;
        Some(self.take(length.checked_mul(N)?)?.as_chunks().0)
    }

    fn floats(&mut self) -> Option<Vec<f64>> {
        Some(self.list()?.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
    }

    fn sums<const N: usize>(&mut self) -> Option<Vec<Sums<N>>> {
        let values = self.floats()?;
        let pair = |values: &[f64]| Some(Sums::from_pairs([values.get(..N)?.try_into().ok()?, values.get(N..)?.try_into().ok()?]));
        values.chunks(2 * N).map(pair).collect()
    }

    fn integers(&mut self) -> Option<Vec<u32>> {
        Some(self.list()?.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect())
    }

    fn coverage(&mut self, entries: usize) -> Option<CoverageCounts> {
        let values = self.integers()?;
        let mut rest = values.as_slice();
        let mut counts = CoverageCounts::new(entries);
        for entry in 0..entries {
            let (&length, behind) = rest.split_first()?;
            let (list, behind) = behind.split_at_checked((length as usize).checked_mul(4)?)?;
            for &[instance, shape, low, high] in list.as_chunks().0 {
                // More than any render has would overflow.
                let units = u64::from(low) | u64::from(high) << 32;
                counts.add(entry, ShapeKey { instance, shape }, Some(units).filter(|units| *units < 1 << 60)?);
            }
            rest = behind;
        }
        rest.is_empty().then_some(counts)
    }
}
