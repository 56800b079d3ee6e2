//! Tiles as bytes and back, exactly.

use super::FilmTile;
use super::coverage::CoverageCounts;
use super::sample::ShapeKey;
use super::sum::Sums;
use super::tile::{DROPPED_KEPT, DroppedSample, InverseVarianceSums, SampleMoments};
use crate::bytes::{ByteReader, ByteWriter};

impl FilmTile {
    /// All that the tile holds.
    pub fn save(&self) -> Vec<u8> {
        let mut out = ByteWriter::default();
        for sums in [&self.filtered, &self.own] {
            write_sums(&mut out, &sums.color);
            out.floats(sums.channels.iter().copied());
        }
        write_sums(&mut out, &self.weights);
        out.integers(&self.samples);
        out.integers(&self.nearest.depths.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>());
        out.integers(&self.nearest.samples);
        out.integers(&self.nearest.values.iter().map(|value| value.to_bits()).collect::<Vec<_>>());
        if let Some(coverage) = &self.coverage {
            write_coverage(&mut out, coverage, self.cells.entries());
        }
        out.integers(&self.spread.iter().map(|spread| spread.groups).collect::<Vec<_>>());
        write_sums(&mut out, &self.spread.iter().map(|spread| spread.sums).collect::<Vec<_>>());
        write_sums(&mut out, &self.spread.iter().map(|spread| spread.squares).collect::<Vec<_>>());
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
        self.read(&mut ByteReader::new(bytes)).ok_or_else(|| format!("the tile at {:?} is not what was saved of it", self.origin()))
    }

    fn read(&mut self, data: &mut ByteReader) -> Option<()> {
        for sums in [&mut self.filtered, &mut self.own] {
            sums.color = read_sums(data).filter(|list| list.len() == sums.color.len())?;
            sums.channels = data.floats().filter(|list| list.len() == sums.channels.len())?;
        }
        self.weights = read_sums(data).filter(|list| list.len() == self.weights.len())?;
        self.samples = data.integers().filter(|list| list.len() == self.samples.len())?;
        let floats = |list: Vec<u32>| list.into_iter().map(f32::from_bits).collect::<Vec<_>>();
        self.nearest.depths = data.integers().map(floats).filter(|list| list.len() == self.nearest.depths.len())?;
        self.nearest.samples = data.integers().filter(|list| list.len() == self.nearest.samples.len())?;
        self.nearest.values = data.integers().map(floats).filter(|list| list.len() == self.nearest.values.len())?;
        if let Some(coverage) = &mut self.coverage {
            *coverage = read_coverage(data, self.cells.entries())?;
        }
        let spreads = self.spread.len();
        let groups = data.integers().filter(|list| list.len() == spreads)?;
        let sums = read_sums(data).filter(|list| list.len() == spreads)?;
        let squares = read_sums(data).filter(|list| list.len() == spreads)?;
        self.spread = groups
            .into_iter()
            .zip(sums.into_iter().zip(squares))
            .map(|(groups, (sums, squares))| SampleMoments { groups, sums, squares })
            .collect();
        let weighed = data.floats().filter(|list| list.is_empty() || list.len() == 4 * self.samples.len())?;
        let of_pixel = |&[count, r, g, b]: &[f64; 4]| InverseVarianceSums { count, variance: [r, g, b] };
        self.weighed = weighed.as_chunks().0.iter().map(of_pixel).collect();
        self.dropped_count = data.long()?;
        let dropped = data.integers().filter(|list| list.len() <= 3 * DROPPED_KEPT)?;
        self.dropped = dropped.as_chunks().0.iter().map(|&[x, y, sample]| DroppedSample { x, y, sample }).collect();
        data.is_empty().then_some(())
    }
}

fn write_sums<const N: usize>(out: &mut ByteWriter, sums: &[Sums<N>]) {
    let pairs: Vec<[[f64; N]; 2]> = sums.iter().map(Sums::pairs).collect();
    out.floats(pairs.as_flattened().as_flattened().iter().copied());
}

fn read_sums<const N: usize>(data: &mut ByteReader) -> Option<Vec<Sums<N>>> {
    let values = data.floats()?;
    let pair = |values: &[f64]| Some(Sums::from_pairs([values.get(..N)?.try_into().ok()?, values.get(N..)?.try_into().ok()?]));
    values.chunks(2 * N).map(pair).collect()
}

fn write_coverage(out: &mut ByteWriter, coverage: &CoverageCounts, entries: usize) {
    let mut values = Vec::new();
    for list in (0..entries).map(|entry| coverage.of(entry)) {
        values.push(list.len() as u32);
        values.extend(list.iter().flat_map(|&(key, units)| [key.instance, key.shape, units as u32, (units >> 32) as u32]));
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
