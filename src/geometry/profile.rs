//! Profile curves of surfaces of revolution: joined cubic Bezier segments in the plane of the axis.

use super::ShapeError;
use crate::math::{DVec2, dvec2};

/// A curve of cubic Bezier segments, each beginning at the very point where the one before ends. `x` is the distance
/// from the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    segments: Vec<[DVec2; 4]>,
}

impl Profile {
    /// Joined cubic Bezier curves from `3n + 1` control points `[x, y]`.
    ///
    /// # Errors
    /// If the number of points is not 3n + 1 with n > 0, or a coordinate is not finite.
    pub fn bezier(points: &[[f64; 2]]) -> Result<Self, ShapeError> {
        if points.len() < 4 || points.len() % 3 != 1 {
            return Err(ShapeError::BezierCount(points.len()));
        }
        check_finite(points)?;
        let segments = (0..points.len() / 3).map(|i| std::array::from_fn(|k| DVec2::from(points[3 * i + k]))).collect();
        Ok(Self { segments })
    }

    /// A uniform cubic B-spline from `n >= 4` control points `[x, y]`, converted to `n - 3` Bezier segments. The curve
    /// reaches an end point only if it is tripled.
    ///
    /// # Errors
    /// If there are fewer than 4 points, or a coordinate is not finite.
    pub fn b_spline(points: &[[f64; 2]]) -> Result<Self, ShapeError> {
        if points.len() < 4 {
            return Err(ShapeError::BSplineCount(points.len()));
        }
        check_finite(points)?;
        let point = |i: usize| DVec2::from(points[i]);
        // The joint at the control point i; both neighbours use the same number.
        let joints: Vec<DVec2> = (1..points.len() - 1)
            .map(|i| blend(&[point(i - 1), point(i), point(i + 1)], [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]))
            .collect();
        let segments = joints
            .windows(2)
            .enumerate()
            .map(|(i, ends)| {
                let (p1, p2) = (point(i + 1), point(i + 2));
                let third = [1.0 / 3.0, 2.0 / 3.0];
                [ends[0], blend(&[p2, p1], third), blend(&[p1, p2], third), ends[1]]
            })
            .collect();
        Ok(Self { segments })
    }

    /// Control points of each segment.
    pub fn segments(&self) -> &[[DVec2; 4]] {
        &self.segments
    }

    /// The point at the parameter `segment + s`, by de Casteljau's algorithm.
    pub fn point(&self, parameter: f64) -> DVec2 {
        let last = self.segments.len() - 1;
        let index = (parameter.max(0.0) as usize).min(last);
        let s = parameter - index as f64;
        let mut c = self.segments[index];
        for level in 1..4 {
            for i in 0..4 - level {
                c[i] = c[i] * (1.0 - s) + c[i + 1] * s;
            }
        }
        c[0]
    }
}

/// A weighted mean that gives a point back unchanged if all points are the same: tripled points on the axis stay there.
fn blend<const N: usize>(points: &[DVec2; N], weights: [f64; N]) -> DVec2 {
    let base = points[N / 2];
    let moved: DVec2 = points.iter().zip(weights).map(|(&p, w)| (p - base) * w).sum();
    let sum = base + moved;
    // Keep what all points have in common exactly.
    let same = |axis: fn(&DVec2) -> f64| points.iter().all(|p| axis(p) == axis(&base));
    dvec2(if same(|p| p.x) { base.x } else { sum.x }, if same(|p| p.y) { base.y } else { sum.y })
}

fn check_finite(points: &[[f64; 2]]) -> Result<(), ShapeError> {
    points.iter().position(|p| !DVec2::from(*p).is_finite()).map_or(Ok(()), |i| Err(ShapeError::ProfilePoint(i)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_counts_and_numbers_are_refused() {
        assert_eq!(Profile::bezier(&[[1.0, 0.0]; 5]), Err(ShapeError::BezierCount(5)));
        assert_eq!(Profile::bezier(&[[1.0, 0.0]]), Err(ShapeError::BezierCount(1)));
        assert_eq!(Profile::b_spline(&[[1.0, 0.0]; 3]), Err(ShapeError::BSplineCount(3)));
        let mut points = [[1.0, 0.0]; 7];
        points[4][1] = f64::NAN;
        assert_eq!(Profile::bezier(&points), Err(ShapeError::ProfilePoint(4)));
    }

    #[test]
    fn tripled_points_are_reached() {
        let points = [[0.0, 0.1], [0.0, 0.1], [0.0, 0.1], [1.0, 0.7], [0.3, 0.9], [0.3, 0.9], [0.3, 0.9]];
        let profile = Profile::b_spline(&points).unwrap();
        assert_eq!(profile.segments()[0][0], dvec2(0.0, 0.1));
        assert_eq!(profile.segments()[3][3], dvec2(0.3, 0.9));
    }
}
