//! Which shapes a pixel shows, and how much of it each covers.

use super::ShapeKey;

/// Samples of each pixel by the shape that they show, [`ShapeKey::NONE`] included, in units of coverage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoverageCounts {
    /// By pixel: the shape met first, then for each further one a link to where it is behind the pixels.
    entries: Vec<CoverageEntry>,
    pixels: usize,
}

/// A shape of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct CoverageEntry {
    key: ShapeKey,
    /// Index of the pixel's next entry; 0 if there is none.
    next: u32,
    /// 0 in pixels without samples.
    units: u64,
}

impl CoverageCounts {
    /// Bytes of a pixel that shows one shape.
    pub(super) const PIXEL_BYTES: usize = size_of::<CoverageEntry>();

    /// Empty, for this number of pixels.
    pub fn new(pixels: usize) -> Self {
        Self { entries: vec![CoverageEntry::default(); pixels], pixels }
    }

    /// Adds samples; `units` is above 0.
    #[inline]
    pub fn add(&mut self, pixel: usize, shown: ShapeKey, units: u64) {
        let mut place = pixel;
        loop {
            let entry = &mut self.entries[place];
            if entry.units == 0 {
                entry.key = shown;
            }
            if entry.key == shown {
                entry.units = entry.units.saturating_add(units);
                return;
            }
            if entry.next == 0 {
                break;
            }
            place = entry.next as usize;
        }
        self.entries[place].next = self.entries.len() as u32;
        self.entries.push(CoverageEntry { key: shown, next: 0, units });
    }

    /// Adds all samples of others.
    pub fn merge(&mut self, other: &Self) {
        for pixel in 0..other.pixels {
            other.of(pixel).for_each(|(key, count)| self.add(pixel, key, count));
        }
    }

    /// What a pixel shows, in no particular order.
    pub fn of(&self, pixel: usize) -> impl Iterator<Item = (ShapeKey, u64)> {
        let next = |entry: &&CoverageEntry| (entry.next > 0).then(|| &self.entries[entry.next as usize]);
        let first = Some(&self.entries[pixel]).filter(|entry| entry.units > 0);
        std::iter::successors(first, next).map(|entry| (entry.key, entry.units))
    }
}

/// What each pixel of a picture shows: shapes with the share of the pixel that each covers, the largest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// Where each pixel's entries start, and last where they end.
    starts: Vec<usize>,
    entries: Vec<(ShapeKey, f32)>,
}

impl Default for Coverage {
    fn default() -> Self {
        Self { starts: vec![0], entries: Vec::new() }
    }
}

impl Coverage {
    /// Adds the next pixel: the weight of each shape, that of [`ShapeKey::NONE`] included. A shape may occur several
    /// times.
    pub fn push(&mut self, mut weights: Vec<(ShapeKey, f64)>) {
        let whole: f64 = weights.iter().map(|(_, weight)| weight).sum();
        weights.sort_by_key(|(key, _)| *key);
        weights.dedup_by(|(key, weight), (kept, sum)| {
            let same = key == kept;
            if same {
                *sum += *weight;
            }
            same
        });
        weights.retain(|(key, weight)| *key != ShapeKey::NONE && *weight > 0.0);
        weights.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        self.entries.extend(weights.iter().map(|&(key, weight)| (key, (weight / whole) as f32)));
        self.starts.push(self.entries.len());
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.starts.len() - 1
    }

    /// What a pixel shows: shapes with the share that each covers, above 0, the largest first; among equals in the
    /// order of their keys.
    pub fn of(&self, pixel: usize) -> &[(ShapeKey, f32)] {
        &self.entries[self.starts[pixel]..self.starts[pixel + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_samples_and_sorted() {
        let key = |shape| ShapeKey { instance: ShapeKey::NO_INSTANCE, shape };
        let mut counts = CoverageCounts::new(2);
        for shape in [3, 1, 1, 2] {
            counts.add(0, key(shape), 1);
        }
        let mut other = CoverageCounts::new(2);
        other.add(0, key(2), 1);
        other.add(1, key(9), 2);
        counts.merge(&other);
        counts.add(0, ShapeKey::NONE, 5);
        let weights = |pixel| counts.of(pixel).map(|(key, units)| (key, units as f64)).collect();
        let mut coverage = Coverage::default();
        [0, 1].map(weights).into_iter().for_each(|weights| coverage.push(weights));
        assert_eq!(coverage.of(0), [(key(1), 0.2), (key(2), 0.2), (key(3), 0.1)]);
        assert_eq!(coverage.of(1), [(key(9), 1.0)]);
        assert_eq!(coverage.pixels(), 2);
    }
}
