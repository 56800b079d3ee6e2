//! Rougher surfaces for light that comes by narrow lobes.

/// Microfacets have at least an alpha that falls with the number of the sample, at surfaces that a path meets after one
/// that is not ideally smooth: caustics that no path would find but by rare chance become blurred ones. What is lost of
/// their sharpness vanishes as samples are added (Kaplanyan and Dachsbacher, "Path Space Regularization for Holistic
/// and Robust Light Transport").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regularization {
    /// The least alpha for the first sample, within `(0, 1]`.
    pub alpha: f32,
}

impl Regularization {
    /// The least alpha for a sample of a pixel, counted from 0: with the sixth root of their number the squared bias
    /// falls as fast as the variance of what is found through a lobe of two dimensions.
    #[inline]
    pub fn alpha(&self, sample: u32) -> f32 {
        self.alpha * (sample as f32 + 1.0).powf(-1.0 / 6.0)
    }
}
