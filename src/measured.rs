//! Measured BRDFs: readers of files fill them, `bsdf` looks them up.

/// Slices of values at the points of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredTable<T> {
    /// Columns and rows, each at least 2.
    pub size: [usize; 2],
    /// By slice, row and column.
    pub values: Vec<T>,
}

/// A BRDF as Dupuy and Jakob measure it ("An Adaptive Parameterization for Efficient Material Acquisition and
/// Rendering", 2018). All values are finite and not negative. Tables have the angle from the normal along their
/// columns, as `sqrt(2 theta / pi)`, and the azimuth from -pi to pi along their rows.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredData {
    /// Azimuths of the outgoing direction in radians, increasing: one or two if they do not matter; else from -pi on
    /// the whole circle, half of it or a quarter.
    pub phi: Vec<f32>,
    /// Angles from the normal of the outgoing direction in radians, increasing within 0 and pi/2.
    pub theta: Vec<f32>,
    /// The distribution of the normals of microfacets; one slice.
    pub ndf: MeasuredTable<f32>,
    /// The area of microfacets as a direction sees them; one slice.
    pub sigma: MeasuredTable<f32>,
    /// The distribution of visible normals, for each of `phi` one slice for each of `theta`.
    pub vndf: MeasuredTable<f32>,
    /// What is reflected, over the unit square that `vndf` is warped to, as are `colors`.
    pub luminance: MeasuredTable<f32>,
    /// The value of the BRDF times the cosine, over `ndf / (4 sigma)` if `jacobian`.
    pub colors: MeasuredTable<[f32; 3]>,
    /// See `colors`.
    pub jacobian: bool,
}

impl MeasuredData {
    /// Whether turning the surface about its normal changes nothing.
    pub fn is_isotropic(&self) -> bool {
        self.phi.len() <= 2
    }
}
