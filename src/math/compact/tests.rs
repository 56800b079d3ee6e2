use pulp::x86::{V3, V4};

use super::*;
use crate::math::Rng;

#[test]
fn lanes_are_sorted_by_few_and_by_many_keys() {
    let mut random = Rng::new(6);
    for limit in [1, 3, 64, 65, usize::MAX] {
        for count in [0, 1, 50, BATCH] {
            let keys: Row<u32> = std::array::from_fn(|_| random.below(limit) as u32);
            let mut lanes: Vec<u8> = (0..count as u8).filter(|_| random.below(3) > 0).collect();
            let mut expected = lanes.clone();
            expected.sort_by_key(|&lane| keys[usize::from(lane)]);
            sort_lanes(&mut lanes, &keys);
            assert_eq!(lanes, expected);
        }
    }
}

#[test]
fn chosen_lanes_follow_one_another() {
    let mut random = Rng::new(5);
    let (avx512, avx2) = (V4::try_new().map(Instructions::Avx512), V3::try_new().map(Instructions::Avx2));
    let instructions = [avx512, avx2, Some(Instructions::Scalar)];
    for share in [0, 1, 3, 8, 10] {
        for count in [0, 1, 17, 100, BATCH] {
            let flags: Row<u32> = std::array::from_fn(|_| u32::from(random.below(10) < share));
            let numbers: Row = std::array::from_fn(|i| i as f32);
            let chosen: Vec<usize> = (0..count).filter(|&lane| flags[lane] == 1).collect();
            let lanes = Compaction::equal(&flags, 1, count);
            assert_eq!(lanes.len(), chosen.len());
            assert!((0..BATCH).all(|lane| lanes.contains(lane) == chosen.contains(&lane)));
            assert_eq!(Compaction::different(&flags, 0, count).masks, lanes.masks);
            for instructions in instructions.into_iter().flatten() {
                let masks = lanes_with(instructions, &flags, 1);
                assert!((0..BATCH).all(|lane| (masks[lane / WIDTH] >> (lane % WIDTH) & 1 != 0) == (flags[lane] == 1)));
            }
            for at in [0, 1, 100, BATCH - 1] {
                // With the instructions that the machine has, and without.
                for instructions in instructions.into_iter().flatten() {
                    let lanes = Compaction { instructions, ..lanes };
                    let (mut first, mut second) = ([-1.0; BATCH], [-1.0; BATCH]);
                    lanes.append(&numbers, &mut first, Some(&mut second), at);
                    let (mut first_f64, mut second_f64) = ([-1.0; BATCH], [-1.0; BATCH]);
                    lanes.append(&numbers.map(f64::from), &mut first_f64, Some(&mut second_f64), at);
                    let both = [first, second].concat();
                    assert!(both[..at].iter().all(|x| *x == -1.0));
                    let expected: Vec<f32> = chosen.iter().map(|&lane| lane as f32).collect();
                    assert_eq!(both[at..at + chosen.len()], expected);
                    let both_f64: Vec<f32> = [first_f64, second_f64].concat().iter().map(|x| *x as f32).collect();
                    assert_eq!(both_f64[..at + chosen.len()], both[..at + chosen.len()]);
                }
            }
            for instructions in instructions.into_iter().flatten() {
                let lanes = Compaction { instructions, ..lanes };
                let (mut compacted, mut expanded) = ([0.0; BATCH], [-1.0; BATCH]);
                lanes.compact(&numbers, &mut compacted);
                lanes.expand(&compacted, &mut expanded);
                let mut expanded_f64 = [-1.0; BATCH];
                lanes.expand(&compacted.map(f64::from), &mut expanded_f64);
                let expected: Row = std::array::from_fn(|lane| if lanes.contains(lane) { lane as f32 } else { -1.0 });
                assert_eq!(expanded, expected);
                assert_eq!(expanded_f64, expected.map(f64::from));
            }
            let keys: Row<u32> = std::array::from_fn(|_| random.below(5) as u32);
            let mut groups = Vec::new();
            for (key, group) in lanes.groups(&keys) {
                let expected: Vec<_> = chosen.iter().copied().filter(|&lane| keys[lane] == key).collect();
                assert_eq!((group.lanes().collect::<Vec<_>>(), group.len()), (expected.clone(), expected.len()));
                groups.extend(expected);
            }
            groups.sort_unstable();
            assert_eq!(groups, chosen);
            let list: Vec<u8> = chosen.iter().map(|&lane| lane as u8).collect();
            let listed = Compaction::of(&list);
            assert_eq!((listed.masks, listed.count), (lanes.masks, lanes.count));
        }
    }
}
