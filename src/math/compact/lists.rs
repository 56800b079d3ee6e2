//! Lists of lanes.

use crate::math::rows::{BATCH, Row};

/// The places of bits that are set, in order.
#[inline(always)]
pub fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (place < 32).then_some(place)
    })
}

/// Replaces `lanes` by the chosen ones of the first `count`, without branches.
#[inline(always)]
pub fn collect_lanes(lanes: &mut Vec<u8>, count: usize, is_chosen: impl FnMut(usize) -> bool) {
    filter_lanes(lanes, 0..count.min(BATCH) as u8, is_chosen);
}

/// Replaces `lanes` by the chosen ones of at most [`BATCH`] others, without branches.
#[inline(always)]
pub fn filter_lanes(lanes: &mut Vec<u8>, from: impl Iterator<Item = u8>, mut is_chosen: impl FnMut(usize) -> bool) {
    lanes.resize(BATCH, 0);
    let mut chosen = 0;
    for lane in from {
        lanes[chosen % BATCH] = lane;
        chosen += usize::from(is_chosen(usize::from(lane) % BATCH));
    }
    lanes.truncate(chosen);
}

/// Sorts `lanes` by their keys. Those of one key are in ascending order, and stay so.
pub fn sort_lanes(lanes: &mut [u8], keys: &Row<u32>) {
    const BINS: usize = 64;
    let key = |lane: u8| keys[usize::from(lane) % BATCH];
    // Counting sort, where there are few keys.
    let (mut counts, mut bits, mut sorted) = ([0u8; BINS], 0, [0u8; BATCH]);
    for &lane in &*lanes {
        bits |= key(lane);
        counts[key(lane) as usize % BINS] += 1;
    }
    if bits >= BINS as u32 || lanes.len() > BATCH {
        lanes.sort_unstable_by_key(|&lane| u64::from(key(lane)) << 8 | u64::from(lane));
        return;
    }
    let mut first = 0;
    for count in &mut counts[..=bits as usize] {
        (*count, first) = (first, first + *count);
    }
    for &lane in &*lanes {
        let place = &mut counts[key(lane) as usize % BINS];
        sorted[usize::from(*place) % BATCH] = lane;
        *place += 1;
    }
    lanes.copy_from_slice(&sorted[..lanes.len()]);
}
