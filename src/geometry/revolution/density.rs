//! Area of a surface of revolution, and the density along the profile with which points are chosen.

use super::segment::{Range, Segment};

/// Intervals of each segment between whose ends the density is linear.
const INTERVALS: usize = 64;

/// Positive nodes and weights of the 8-point Gauss-Legendre rule on `[-1, 1]`.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [0.960_289_856_497_536_2, 0.101_228_536_290_376_26],
];

/// A piecewise linear density along the profile, close to that of area: circumference times length.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Density {
    /// `r |c'|` at the ends of the intervals, `INTERVALS + 1` for each segment.
    weights: Vec<f64>,
    /// Integral from the start of the profile to each interval's end, as a part of the whole.
    cumulative: Vec<f64>,
    /// Integral over the whole profile.
    total: f64,
}

/// A parameter chosen on the profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ProfileSample {
    pub segment: usize,
    pub s: f64,
}

impl Density {
    /// Tabulates the density.
    pub fn new(segments: &[Segment]) -> Self {
        let mut weights = Vec::with_capacity(segments.len() * (INTERVALS + 1));
        let mut cumulative = Vec::with_capacity(segments.len() * INTERVALS);
        let mut total = 0.0;
        for segment in segments {
            let start = weights.len();
            weights.extend((0..=INTERVALS).map(|i| weight(segment, i as f64 / INTERVALS as f64)));
            for pair in weights[start..].windows(2) {
                total += 0.5 * (pair[0] + pair[1]) / INTERVALS as f64;
                cumulative.push(total);
            }
        }
        for x in &mut cumulative {
            *x /= total;
        }
        Self { weights, cumulative, total }
    }

    /// Chooses a parameter; `u` in `[0, 1]`.
    pub fn sample(&self, u: f64) -> ProfileSample {
        let interval = self.cumulative.partition_point(|&x| x <= u).min(self.cumulative.len() - 1);
        let start = if interval == 0 { 0.0 } else { self.cumulative[interval - 1] };
        let width = self.cumulative[interval] - start;
        let fraction = if width > 0.0 { ((u - start) / width).clamp(0.0, 1.0) } else { 0.0 };

        // Inverse of a linear density, without dividing by the difference of its ends.
        let (segment, i) = (interval / INTERVALS, interval % INTERVALS);
        let [w0, w1] = self.ends(segment, i);
        let sum = w0 + (w0 * w0 + fraction * (w1 * w1 - w0 * w0)).max(0.0).sqrt();
        let within = if sum > 0.0 { (fraction * (w0 + w1) / sum).min(1.0) } else { fraction };
        ProfileSample { segment, s: (i as f64 + within) / INTERVALS as f64 }
    }

    /// Density of [`Density::sample`] with respect to area for an angle chosen uniformly in `[0, phi_max]`; `None`
    /// where the surface has no width or the profile stands still, which has probability zero.
    pub fn pdf_area(&self, segments: &[Segment], at: ProfileSample, phi_max: f64) -> Option<f64> {
        let position = at.s * INTERVALS as f64;
        let i = (position as usize).min(INTERVALS - 1);
        let [w0, w1] = self.ends(at.segment, i);
        let linear = w0 + (w1 - w0) * (position - i as f64);
        let pdf = linear / (phi_max * self.total * weight(&segments[at.segment], at.s));
        pdf.is_finite().then_some(pdf)
    }

    fn ends(&self, segment: usize, i: usize) -> [f64; 2] {
        let at = segment * (INTERVALS + 1) + i;
        [self.weights[at], self.weights[at + 1]]
    }
}

/// Distance from the axis times speed: the change of area with the parameter for each radian.
fn weight(segment: &Segment, s: f64) -> f64 {
    segment.r.value(s).max(0.0) * segment.derivative(s).length()
}

/// Integral of a function over a range, by Gauss-Legendre quadrature.
pub(super) fn integral(range: Range, function: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (range.min + range.max), 0.5 * (range.max - range.min));
    GAUSS.iter().map(|[x, w]| half * w * (function(middle - half * x) + function(middle + half * x))).sum()
}

/// Area for each radian (Pappus), by quadrature on small parts of the monotone pieces.
pub(super) fn area_per_radian(segments: &[Segment]) -> f64 {
    const PARTS: usize = 16;
    let piece = |segment: &Segment, range: Range| integral(range, |s| weight(segment, s));
    let mut area = 0.0;
    for segment in segments {
        for pair in segment.knots.windows(2) {
            let width = (pair[1].s - pair[0].s) / PARTS as f64;
            let start = |i: usize| pair[0].s + width * i as f64;
            area += (0..PARTS).map(|i| piece(segment, Range { min: start(i), max: start(i + 1) })).sum::<f64>();
        }
    }
    area
}
