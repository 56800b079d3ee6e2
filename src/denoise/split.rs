//! Layers whose sum is another layer, kept so.

use super::oidn::Triple;

/// Scales `groups` so that they add up to `total`, each channel of each pixel in proportion: a group keeps its share.
/// All numbers are at least 0. Where every group is 0 and the total is not, the shares are those of the whole picture,
/// or equal ones if that is 0, too.
pub fn scale_to_sum(total: &[Triple], groups: &mut [&mut [Triple]]) {
    if groups.is_empty() {
        return;
    }
    let mut means: Vec<[f64; 3]> = groups.iter().map(|group| channel_sums(group)).collect();
    for channel in 0..3 {
        let sum: f64 = means.iter().map(|mean| mean[channel]).sum();
        let equal = 1.0 / means.len() as f64;
        means.iter_mut().for_each(|mean| mean[channel] = if sum > 0.0 { mean[channel] / sum } else { equal });
    }
    for (i, total) in total.iter().enumerate() {
        for channel in 0..3 {
            let sum: f64 = groups.iter().map(|group| f64::from(group[i][channel])).sum();
            let total = f64::from(total[channel]);
            for (group, mean) in groups.iter_mut().zip(&means) {
                let share = if sum > 0.0 { f64::from(group[i][channel]) / sum } else { mean[channel] };
                group[i][channel] = (total * share) as f32;
            }
        }
    }
}

fn channel_sums(pixels: &[Triple]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for pixel in pixels {
        sums.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += f64::from(*v));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_add_up_and_keep_their_shares() {
        let total = [[4.0, 1.0, 0.3], [0.5, 0.0, 2.0], [8.0, 8.0, 8.0]];
        let mut a = [[1.0, 0.0, 0.1], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]];
        let mut b = [[1.0, 2.0, 0.3], [3.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        scale_to_sum(&total, &mut [&mut a, &mut b]);
        for i in 0..3 {
            for c in 0..3 {
                let sum = f64::from(a[i][c]) + f64::from(b[i][c]);
                assert!((sum - f64::from(total[i][c])).abs() <= 1e-7 * f64::from(total[i][c]), "{a:?} {b:?}");
            }
        }
        assert_eq!((a[0][0], b[0][0], a[0][1], b[0][1]), (2.0, 2.0, 0.0, 1.0));
        // Nothing to go by: the shares of the whole picture, 1 to 4 in red.
        assert_eq!((a[2][0], b[2][0]), (1.6, 6.4));
    }

    #[test]
    fn groups_of_nothing_share_alike() {
        let (mut a, mut b) = ([[0.0; 3]], [[0.0; 3]]);
        scale_to_sum(&[[3.0, 0.0, 1.0]], &mut [&mut a, &mut b]);
        assert_eq!((a, b), ([[1.5, 0.0, 0.5]], [[1.5, 0.0, 0.5]]));
        scale_to_sum(&[[1.0; 3]], &mut []);
    }
}
