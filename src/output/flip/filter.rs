//! Filters of vision, each a product of one function of x and one of y or a sum of such.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::color::Plane;

/// A filter that is a product: weights along a row and along a column, of odd lengths, the middle at the pixel.
pub struct Kernel {
    pub across: Vec<f32>,
    pub down: Vec<f32>,
}

/// Sensitivity to contrast as sums of Gaussians `a sqrt(pi / b) exp(-pi² d² / b)` of the angle `d` in degrees:
/// lightness, red against green, yellow against blue.
const SENSITIVITIES: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// Twice the deviation of the detector of edges and points, in degrees.
const DETECTOR_WIDTH: f64 = 0.082;

/// The filters of the three channels; the weights of each channel's kernels together sum to 1.
pub fn sensitivities(pixels_per_degree: f64) -> [Vec<Kernel>; 3] {
    let widest = SENSITIVITIES.iter().flat_map(|channel| channel.iter()).map(|(_, b)| *b).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    SENSITIVITIES.map(|channel| {
        let rows: Vec<(f64, Vec<f64>)> = channel
            .iter()
            .map(|&(a, b)| {
                let row = (-radius..=radius)
                    .map(|x| (-PI * PI * (f64::from(x) / pixels_per_degree).powi(2) / b).exp())
                    .collect();
                (a * (PI / b).sqrt(), row)
            })
            .collect();
        let total: f64 = rows.iter().map(|(height, row)| height * row.iter().sum::<f64>().powi(2)).sum();
        rows.iter()
            .map(|(height, row)| Kernel {
                across: row.iter().map(|w| (w * height / total) as f32).collect(),
                down: row.iter().map(|w| *w as f32).collect(),
            })
            .collect()
    })
}

/// Makes the kernel that finds something along a row, for a number of pixels per degree.
type Detector = fn(f64) -> Kernel;

/// Detectors of edges and of points: the first and second derivative of a Gaussian; positive weights sum to 1, negative
/// ones to -1.
pub const DETECTORS: [Detector; 2] =
    [|ppd| detector(ppd, |x, _| -x), |ppd| detector(ppd, |x, deviation| (x / deviation).powi(2) - 1.0)];

fn detector(pixels_per_degree: f64, factor: impl Fn(f64, f64) -> f64) -> Kernel {
    let deviation = 0.5 * DETECTOR_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let gaussian: Vec<f64> = (-radius..=radius).map(|x| (-0.5 * (f64::from(x) / deviation).powi(2)).exp()).collect();
    let across: Vec<f64> =
        (-radius..=radius).zip(&gaussian).map(|(x, g)| factor(f64::from(x), deviation) * g).collect();
    let sum = |sign: f64| across.iter().filter(|w| **w * sign > 0.0).sum::<f64>().abs();
    let (positive, negative, total) = (sum(1.0), sum(-1.0), gaussian.iter().sum::<f64>());
    Kernel {
        across: across.iter().map(|w| (w / if *w < 0.0 { negative } else { positive }) as f32).collect(),
        down: gaussian.iter().map(|g| (g / total) as f32).collect(),
    }
}

/// Correlates a picture with a product of two filters; beyond its edges stands what is at the edge.
pub fn convolve(source: &Plane, [width, height]: [usize; 2], across: &[f32], down: &[f32]) -> Plane {
    if width == 0 || height == 0 {
        return Plane::new();
    }
    let mut rows = vec![0.0; source.len()];
    rows.par_chunks_mut(width).zip(source.par_chunks(width)).for_each(|(out, row)| {
        let reach = across.len() / 2;
        let padded: Vec<f32> = (0..width + 2 * reach).map(|x| row[x.saturating_sub(reach).min(width - 1)]).collect();
        for (j, weight) in across.iter().enumerate() {
            out.iter_mut().zip(&padded[j..]).for_each(|(out, x)| *out += weight * x);
        }
    });
    let mut columns = vec![0.0; source.len()];
    columns.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (j, weight) in down.iter().enumerate() {
            let y = (y + j).saturating_sub(down.len() / 2).min(height - 1);
            out.iter_mut().zip(&rows[y * width..]).for_each(|(out, x)| *out += weight * x);
        }
    });
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_keep_a_constant_and_detectors_remove_it() {
        let constant = vec![2.0; 30 * 7];
        for kernels in sensitivities(67.0) {
            let sum: f32 = kernels.iter().map(|k| convolve(&constant, [30, 7], &k.across, &k.down)[40]).sum();
            assert!((sum - 2.0).abs() < 1e-5, "{sum}");
        }
        for detector in DETECTORS {
            let Kernel { across, down } = detector(67.0);
            assert!(convolve(&constant, [30, 7], &across, &down).iter().all(|x| x.abs() < 1e-5));
        }
    }

    #[test]
    fn a_point_becomes_the_filter_and_edges_repeat() {
        let mut point = vec![0.0; 5 * 3];
        point[5 + 1] = 1.0;
        let out = convolve(&point, [5, 3], &[1.0, 2.0, 3.0], &[10.0, 20.0, 30.0]);
        assert_eq!(out, [90.0, 60.0, 30.0, 0.0, 0.0, 60.0, 40.0, 20.0, 0.0, 0.0, 30.0, 20.0, 10.0, 0.0, 0.0]);
        assert_eq!(convolve(&vec![1.0, 0.0], [2, 1], &[1.0, 2.0, 3.0], &[1.0]), [3.0, 1.0]);
    }
}
