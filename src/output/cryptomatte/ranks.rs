//! What covers a pixel, largest first, in pairs of id and coverage.

/// Fills a pixel's ranks: pairs of id and coverage, the largest coverage first. Entries of the same id are added up,
/// what covers nothing or has no id is left out, what no rank is left for is dropped, and ranks that nothing is left
/// for are zero. `entries` is used up.
pub fn fill_ranks(entries: &mut Vec<(u32, f32)>, ranks: &mut [f32]) {
    entries.retain(|(bits, coverage)| *bits != 0 && *coverage > 0.0);
    entries.sort_by_key(|(bits, _)| *bits);
    entries.dedup_by(|later, kept| {
        let same = later.0 == kept.0;
        if same {
            kept.1 += later.1;
        }
        same
    });
    // Stable: equal coverages stay in the order of their ids.
    entries.sort_by(|a, b| b.1.total_cmp(&a.1));
    ranks.fill(0.0);
    for (rank, (bits, coverage)) in ranks.chunks_exact_mut(2).zip(entries.drain(..)) {
        rank[0] = f32::from_bits(bits);
        rank[1] = coverage.min(1.0);
    }
    entries.clear();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::cryptomatte::hash::{id, id_bits};

    fn ranks(entries: &[(&str, f32)], depth: usize) -> Vec<f32> {
        let mut entries: Vec<(u32, f32)> = entries.iter().map(|(name, coverage)| (id_bits(name), *coverage)).collect();
        let mut out = vec![f32::NAN; 2 * depth];
        fill_ranks(&mut entries, &mut out);
        out
    }

    #[test]
    fn the_largest_coverage_comes_first() {
        assert_eq!(ranks(&[("a", 0.25), ("b", 0.5)], 4), [id("b"), 0.5, id("a"), 0.25, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(ranks(&[], 2), [0.0; 4]);
    }

    #[test]
    fn equal_names_merge_before_they_are_ranked() {
        assert_eq!(ranks(&[("a", 0.25), ("b", 0.375), ("a", 0.25)], 2), [id("a"), 0.5, id("b"), 0.375]);
    }

    #[test]
    fn what_finds_no_rank_is_dropped() {
        let many = [("a", 0.1), ("b", 0.4), ("c", 0.3), ("d", 0.2)];
        assert_eq!(ranks(&many, 2), [id("b"), 0.4, id("c"), 0.3]);
        let mut entries = vec![(0, 0.5), (id_bits("a"), 0.0), (id_bits("b"), 0.5)];
        let mut out = [1.0; 4];
        fill_ranks(&mut entries, &mut out);
        assert_eq!((out, entries.len()), ([id("b"), 0.5, 0.0, 0.0], 0));
    }

    #[test]
    fn ties_do_not_depend_on_the_order() {
        assert_eq!(ranks(&[("a", 0.5), ("b", 0.5)], 2), ranks(&[("b", 0.5), ("a", 0.5)], 2));
    }
}
