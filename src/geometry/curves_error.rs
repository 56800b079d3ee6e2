//! Why curves or points are rejected.

use super::CurveBasis;

/// Why curves or points are rejected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurvesError {
    /// No strand, or no point.
    #[error("no strands and no points are given")]
    Empty,
    /// A position that is not a finite number.
    #[error("the position of point {0} is not finite, or too large")]
    Position(usize),
    /// A radius that is negative or not finite.
    #[error("the radius of point {point} must be finite and not below 0, not {radius}")]
    Radius {
        /// Which point, from 0.
        point: usize,
        /// What was given.
        radius: f32,
    },
    /// A strand of too few points.
    #[error("strand {strand} has {count} points: {}", needed(*.basis))]
    Points {
        /// Which strand, from 0.
        strand: usize,
        /// How many points it has.
        count: usize,
        /// What they are for.
        basis: CurveBasis,
    },
    /// Strands that do not use up the points.
    #[error("the strands have {counted} points together, but {points} are given")]
    Counts {
        /// The sum of all strands.
        counted: usize,
        /// How many there are.
        points: usize,
    },
    /// As many uv as there are strands are needed.
    #[error("{uvs} root uvs for {strands} strands")]
    Uvs {
        /// How many uv.
        uvs: usize,
        /// How many strands.
        strands: usize,
    },
    /// A uv that is not finite.
    #[error("the root uv of strand {0} is not finite")]
    Uv(usize),
    /// More points or segments than 32-bit numbers count.
    #[error("more than 4294967295 points or segments: use several shapes")]
    TooMany,
}

fn needed(basis: CurveBasis) -> &'static str {
    match basis {
        CurveBasis::Linear => "linear curves need at least 2",
        CurveBasis::Bezier => "Bezier curves need 3n + 1 (4, 7, 10, ...)",
        CurveBasis::BSpline => "B-splines need at least 4",
        CurveBasis::CatmullRom => "Catmull-Rom splines need at least 4",
    }
}
