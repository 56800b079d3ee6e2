//! Tiles as bytes and back, exactly.

use super::FilmTile;
use super::accumulator::SampleMoments;
use super::coverage::CoverageCounts;
use super::sample::ShapeKey;
use super::tile::{DROPPED_KEPT, DroppedSample, InverseVarianceSums};
use crate::bytes::{ByteReader, ByteWriter};

impl FilmTile {
    /// All that the tile holds.
    pub fn save(&self) -> Vec<u8> {
        let mut out = ByteWriter::default();
        self.filtered.save(&mut out);
        self.own.save(&mut out);
        self.weights.save(&mut out);
        out.integers(&self.samples);
        out.integers(&self.nearest.depths.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>());
        out.integers(&self.nearest.samples);
        out.integers(&self.nearest.values.iter().map(|value| value.to_bits()).collect::<Vec<_>>());
        if let Some(coverage) = &self.coverage {
            write_coverage(&mut out, coverage, self.cells.entries());
        }
        if let Some(SampleMoments { groups, sums, squares }) = &self.moments {
            out.integers(groups);
            sums.save(&mut out);
            squares.save(&mut out);
        }
        let of_pixel = |w: &InverseVarianceSums| [w.count, w.variance[0], w.variance[1], w.variance[2]];
        out.floats(self.weighed.iter().map(of_pixel).collect::<Vec<_>>().as_flattened().iter().copied());
        out.long(self.dropped_count);
        out.integers(self.dropped.iter().map(|d| [d.x, d.y, d.sample]).collect::<Vec<_>>().as_flattened());
        out.into_bytes()
    }

    /// Replaces what the tile holds by what [`save`](Self::save) gave for a tile of the same pixels and layers.
    ///
    /// # Errors
    /// What is wrong if the bytes are not those of such a tile; the tile is then of no use.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.read(&mut ByteReader::new(bytes))
            .ok_or_else(|| format!("the tile at {:?} is not what was saved of it", self.origin()))
    }

    fn read(&mut self, data: &mut ByteReader) -> Option<()> {
        self.filtered.load(data)?;
        self.own.load(data)?;
        self.weights = self.weights.load_same(data)?;
        self.samples = data.integers().filter(|list| list.len() == self.samples.len())?;
        let floats = |list: Vec<u32>| list.into_iter().map(f32::from_bits).collect::<Vec<_>>();
        self.nearest.depths = data.integers().map(floats).filter(|list| list.len() == self.nearest.depths.len())?;
        self.nearest.samples = data.integers().filter(|list| list.len() == self.nearest.samples.len())?;
        self.nearest.values = data.integers().map(floats).filter(|list| list.len() == self.nearest.values.len())?;
        if let Some(coverage) = &mut self.coverage {
            *coverage = read_coverage(data, self.cells.entries())?;
        }
        if let Some(SampleMoments { groups, sums, squares }) = &mut self.moments {
            *groups = data.integers().filter(|list| list.len() == groups.len())?;
            *sums = sums.load_same(data)?;
            *squares = squares.load_same(data)?;
        }
        let weighed = data.floats().filter(|list| list.is_empty() || list.len() == 4 * self.samples.len())?;
        let of_pixel = |&[count, r, g, b]: &[f64; 4]| InverseVarianceSums { count, variance: [r, g, b] };
        self.weighed = weighed.as_chunks().0.iter().map(of_pixel).collect();
        self.dropped_count = data.long()?;
        let dropped = data.integers().filter(|list| list.len() <= 3 * DROPPED_KEPT)?;
        self.dropped = dropped.as_chunks().0.iter().map(|&[x, y, sample]| DroppedSample { x, y, sample }).collect();
        data.is_empty().then_some(())
    }
}

fn write_coverage(out: &mut ByteWriter, coverage: &CoverageCounts, entries: usize) {
    let mut values = Vec::new();
    for entry in 0..entries {
        let start = values.len();
        values.push(0);
        for (key, units) in coverage.of(entry) {
            values.extend([key.instance, key.shape, units as u32, (units >> 32) as u32]);
            values[start] += 1;
        }
    }
    out.integers(&values);
}

fn read_coverage(data: &mut ByteReader, entries: usize) -> Option<CoverageCounts> {
    let values = data.integers()?;
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
