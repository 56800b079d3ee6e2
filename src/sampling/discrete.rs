//! Discrete distributions.

use std::hint::select_unpredictable;

use crate::math::float::ONE_MINUS_EPSILON;

/// An index chosen by an [`AliasTable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteSample {
    /// The entry.
    pub index: usize,
    /// What is left of the random number, uniform in `[0, 1)`. A table of n entries uses up log2(n) of its 24 bits.
    pub u: f32,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Up to here a random number within the bin chooses the bin's own entry, from here on `alias`.
    own: f32,
    alias: u32,
    /// Probability of the bin's own entry over all bins.
    pmf: f32,
}

/// Chooses an index in proportion to its weight in constant time (Vose, "A Linear Algorithm for Generating Random
/// Numbers with a Given Distribution").
#[derive(Clone, Debug)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

impl AliasTable {
    /// A table of the given weights; `None` if one is negative or not finite, or if all are zero.
    pub fn new(weights: &[f64]) -> Option<Self> {
        if weights.len() >= u32::MAX as usize || !weights.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return None;
        }
        // Scaled by the largest weight first, no sum overflows.
        let largest = weights.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return None;
        }
        let total: f64 = weights.iter().map(|w| w / largest).sum();
        let pmf = |w: f64| w / largest / total;
        let mut bins: Vec<Bin> =
            weights.iter().enumerate().map(|(i, &w)| Bin { own: 1.0, alias: i as u32, pmf: pmf(w) as f32 }).collect();

        // Entries below the mean are filled up to it by entries above.
        let mut height: Vec<f64> = weights.iter().map(|&w| pmf(w) * weights.len() as f64).collect();
        let (mut below, mut above): (Vec<usize>, Vec<usize>) = (0..weights.len()).partition(|&i| height[i] < 1.0);
        while let (Some(&giver), Some(taker)) = (above.last(), below.pop()) {
            bins[taker].own = height[taker] as f32;
            bins[taker].alias = giver as u32;
            height[giver] -= 1.0 - height[taker];
            if height[giver] < 1.0 {
                above.pop();
                below.push(giver);
            }
        }

        // Rounding can leave an entry without a giver: it keeps its whole bin, unless its weight is zero.
        let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))?;
        for i in below {
            if weights[i] == 0.0 {
                bins[i].own = 0.0;
                bins[i].alias = heaviest as u32;
            }
        }
        Some(Self { bins })
    }

    /// The number of entries.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether there are no entries; never so.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// An entry with probability [`pmf`](Self::pmf), never one of weight zero; `u` in `[0, 1)`.
    #[inline]
    pub fn sample(&self, u: f32) -> DiscreteSample {
        if self.bins.len() == 1 {
            return DiscreteSample { index: 0, u };
        }
        let (i, within) = self.bin_at(u);
        let bin = self.bins[i];
        let (index, rest) = if within < bin.own {
            (i, within / bin.own)
        } else {
            (bin.alias as usize, (within - bin.own) / (1.0 - bin.own))
        };
        // A bin of its own entry alone has nothing above: a number rounded up to 1 gives 0 / 0.
        DiscreteSample { index, u: if rest < 1.0 { rest } else { ONE_MINUS_EPSILON } }
    }

    /// The entry of [`sample`](Self::sample) alone, without branches.
    #[inline(always)]
    pub fn index(&self, u: f32) -> usize {
        let (i, within) = self.bin_at(u);
        let bin = self.bins[i];
        select_unpredictable(within < bin.own, i, bin.alias as usize)
    }

    /// A bin, and where in it `u` is.
    #[inline(always)]
    fn bin_at(&self, u: f32) -> (usize, f32) {
        // `u` represents the 2^-24 wide interval that begins with it; the middle keeps the rounding of the bins' limits
        // free of bias.
        let x = (f64::from(u) + 0.5 / f64::from(1 << 24)) * self.bins.len() as f64;
        let i = (x as usize).min(self.bins.len() - 1);
        (i, (x - i as f64) as f32)
    }

    /// The probability of an entry.
    #[inline]
    pub fn pmf(&self, index: usize) -> f32 {
        self.bins[index].pmf
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of each entry over an even grid of 2^20 numbers, and the mean of what is left of them.
    fn shares(table: &AliasTable) -> (Vec<f64>, f64) {
        let n = 1u32 << 20;
        let mut count = vec![0u32; table.len()];
        let mut left = 0.0;
        for i in 0..n {
            let s = table.sample(i as f32 / n as f32);
            assert!((0.0..1.0).contains(&s.u) && s.index == table.index(i as f32 / n as f32));
            count[s.index] += 1;
            left += f64::from(s.u);
        }
        (count.iter().map(|&c| f64::from(c) / f64::from(n)).collect(), left / f64::from(n))
    }

    #[test]
    fn entries_are_chosen_in_proportion_to_weight() {
        for weights in [
            vec![1.0],
            vec![1.0, 2.0, 3.0, 4.0],
            vec![1e-12, 1e12, 5e11],
            vec![0.0, 0.3, 0.0, 0.7, 0.0],
            vec![1e300; 7],
        ] {
            let table = AliasTable::new(&weights).unwrap();
            let (shares, left) = shares(&table);
            let largest = weights.iter().copied().fold(0.0, f64::max);
            let total: f64 = weights.iter().map(|w| w / largest).sum();
            let mut sum = 0.0;
            for (i, w) in weights.iter().enumerate() {
                let exact = w / largest / total;
                assert!((f64::from(table.pmf(i)) - exact).abs() <= 1e-7 * exact, "{weights:?}");
                // Each bin limit is off by half a step of the grid at most.
                assert!(
                    (shares[i] - exact).abs() < weights.len() as f64 * 2f64.powi(-20),
                    "{weights:?} {i}: {} {exact}",
                    shares[i]
                );
                sum += f64::from(table.pmf(i));
            }
            assert!((sum - 1.0).abs() < 1e-6 && (left - 0.5).abs() < 1e-3, "{left}");
        }
    }

    #[test]
    fn large_tables_select_with_the_probability_they_state() {
        // Every number that f32 can represent: the share of each entry is exact.
        let weights: Vec<f64> =
            (0..1000).map(|i| f64::from(i % 17) * f64::from(i % 31) + if i == 500 { 1e5 } else { 0.0 }).collect();
        let table = AliasTable::new(&weights).unwrap();
        let mut count = vec![0u32; weights.len()];
        for i in 0..1u32 << 24 {
            count[table.sample(i as f32 / (1u32 << 24) as f32).index] += 1;
        }
        for (i, &c) in count.iter().enumerate() {
            let share = f64::from(c) / f64::from(1 << 24);
            assert!((share - f64::from(table.pmf(i))).abs() < 1e-6, "{i}: {share} {}", table.pmf(i));
        }
    }

    #[test]
    fn entries_of_weight_zero_are_never_chosen() {
        for weights in [vec![0.0, 1.0], vec![1.0, 0.0], vec![0.0, 0.1, 0.1, 0.1, 0.0, 0.3, 0.0], vec![0.0, 1e-300, 0.0]]
        {
            let table = AliasTable::new(&weights).unwrap();
            let grid = (0..1 << 16).map(|i| i as f32 / 65536.0).chain([0.0, f32::MIN_POSITIVE, ONE_MINUS_EPSILON]);
            for u in grid {
                assert!(weights[table.sample(u).index] > 0.0, "{weights:?} {u}");
            }
        }
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        for weights in [&[][..], &[0.0], &[0.0, 0.0], &[1.0, -1.0], &[f64::NAN], &[f64::INFINITY, 1.0]] {
            assert!(AliasTable::new(weights).is_none(), "{weights:?}");
        }
    }
}
