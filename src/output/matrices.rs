//! Matrices of metadata, for row vectors.

use glam::{DMat4, DVec4};

/// A matrix that maps row vectors: the point stands before it, the translation in its last row.
#[derive(Clone, Copy, Debug)]
pub struct Matrix(DMat4);

impl Matrix {
    /// From rows, one after another.
    pub fn from_flat(rows: [f32; 16]) -> Self {
        // Rows of a matrix for row vectors are columns of one for column vectors.
        Self(DMat4::from_cols_array(&rows.map(f64::from)))
    }

    /// Whether the last column is 0, 0, 0, 1: only then are points mapped to points without a division.
    pub fn is_affine(&self) -> bool {
        self.0.row(3).abs_diff_eq(DVec4::W, 1e-6)
    }
}

/// Where a point on the view axis, one to its right and one above it lie on the picture; `None` if a matrix is
/// singular.
pub fn centre_and_axes(world_to_camera: &Matrix, world_to_ndc: &Matrix) -> Option<[[f64; 2]; 3]> {
    let camera_to_ndc = world_to_ndc.0 * world_to_camera.0.inverse();
    let place = |x: f64, y: f64| {
        let p = camera_to_ndc * DVec4::new(x, y, 1.0, 1.0);
        [p.x / p.w, p.y / p.w]
    };
    let places = [place(0.0, 0.0), place(0.01, 0.0), place(0.0, 0.01)];
    places.as_flattened().iter().all(|x| x.is_finite()).then_some(places)
}
