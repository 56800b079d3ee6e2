//! What the filter cannot take: numbers that are not finite.

use super::oidn::Triple;

/// Replaces every pixel with a channel that is not finite by the mean of its finite neighbours of the eight around it;
/// where there are none, by that of those that were replaced before, from the rim inwards. A picture without a finite
/// pixel becomes 0. The result is the number of pixels replaced.
pub fn replace_non_finite(pixels: &mut [Triple], width: usize) -> u64 {
    let mut bad: Vec<bool> = pixels.iter().map(|pixel| !pixel.iter().all(|v| v.is_finite())).collect();
    let mut left: Vec<usize> = (0..pixels.len()).filter(|i| bad[*i]).collect();
    let count = left.len() as u64;
    while !left.is_empty() {
        // Every pixel of a round is made from earlier rounds alone, so that the order within a round does not matter.
        let made: Vec<(usize, Triple)> =
            left.iter().filter_map(|&i| Some((i, mean_around(pixels, &bad, width, i)?))).collect();
        if made.is_empty() {
            left.iter().for_each(|&i| pixels[i] = [0.0; 3]);
            break;
        }
        for (i, pixel) in made {
            pixels[i] = pixel;
            bad[i] = false;
        }
        left.retain(|i| bad[*i]);
    }
    count
}

/// The mean of the good ones among the eight neighbours.
fn mean_around(pixels: &[Triple], bad: &[bool], width: usize, i: usize) -> Option<Triple> {
    let (mut sum, mut count) = ([0.0f64; 3], 0.0);
    for neighbour in neighbours(i, width, pixels.len()).filter(|j| !bad[*j]) {
        sum.iter_mut().zip(pixels[neighbour]).for_each(|(sum, v)| *sum += f64::from(v));
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|v| (v / count) as f32))
}

/// The pixel itself and those around it.
pub fn neighbours(i: usize, width: usize, pixels: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..=(y + 1).min(pixels / width - 1);
    rows.flat_map(move |row| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |column| row * width + column))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_replaced_by_the_mean_of_finite_neighbours() {
        let mut pixels: Vec<Triple> = (0..9).map(|i| [i as f32, 1.0, -2.0]).collect();
        pixels[4] = [0.0, f32::NAN, 0.0];
        pixels[0] = [f32::INFINITY, 0.0, 0.0];
        let before = pixels.clone();
        assert_eq!(replace_non_finite(&mut pixels, 3), 2);
        // The centre's finite neighbours are 1, 2, 3, 5, 6, 7, 8; those of the corner are 1 and 3.
        assert_eq!(pixels[4], [32.0 / 7.0, 1.0, -2.0]);
        assert_eq!(pixels[0], [2.0, 1.0, -2.0]);
        assert!((0..9).filter(|i| ![0, 4].contains(i)).all(|i| pixels[i] == before[i]));
        assert_eq!(replace_non_finite(&mut pixels, 3), 0);
    }

    #[test]
    fn large_holes_fill_from_the_rim_and_nothing_becomes_black() {
        let (width, height) = (11, 7);
        let mut pixels = vec![[f32::NEG_INFINITY; 3]; width * height];
        pixels[0] = [0.25, 0.5, 4.0];
        assert_eq!(replace_non_finite(&mut pixels, width), (width * height - 1) as u64);
        assert!(pixels.iter().all(|p| *p == [0.25, 0.5, 4.0]), "{pixels:?}");
        let mut none = vec![[f32::NAN; 3]; 6];
        assert_eq!((replace_non_finite(&mut none, 3), none), (6, vec![[0.0; 3]; 6]));
    }
}
