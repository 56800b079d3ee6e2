//! The camera as matrices of picture files: for row vectors, a point stands before its matrix.

use super::{Camera, Projection};
use crate::math::Vec3;

type Rows = [[f64; 4]; 4];

impl Camera {
    /// World to camera as OpenEXR has it when the shutter opens: camera space has +X right, +Y up and +Z forward.
    pub fn world_to_camera(&self) -> [[f32; 4]; 4] {
        rounded(self.world_to_view())
    }

    /// World to a picture of `size` pixels as OpenEXR has it when the shutter opens: after division by the fourth
    /// component, x and y go from 0 to 1 over the picture, y downwards, and z grows with the depth: 1 - 1 / depth with
    /// perspective, the depth without. `None` for environment cameras, which no matrix describes.
    pub fn world_to_ndc(&self, size: [u32; 2]) -> Option<[[f32; 4]; 4]> {
        let [width, height] = size.map(f64::from);
        let [right, up] = self.framing.shift;
        let (x, y) = (0.5 - right, 0.5 + up);
        let scales = |half_height: f64| {
            let scale_y = 0.5 / half_height;
            (scale_y * height / (width * self.framing.pixel_aspect), -scale_y)
        };
        let view_to_ndc = match self.projection {
            Projection::Perspective { half_height, .. } => {
                let (scale_x, scale_y) = scales(half_height);
                [[scale_x, 0.0, 0.0, 0.0], [0.0, scale_y, 0.0, 0.0], [x, y, 1.0, 1.0], [0.0, 0.0, -1.0, 0.0]]
            }
            Projection::Orthographic { half_height } => {
                let (scale_x, scale_y) = scales(self.render_space().world_length(half_height));
                [[scale_x, 0.0, 0.0, 0.0], [0.0, scale_y, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [x, y, 0.0, 1.0]]
            }
            Projection::Environment => return None,
        };
        Some(rounded(product(self.world_to_view(), view_to_ndc)))
    }

    fn world_to_view(&self) -> Rows {
        let (forward, up) = (self.axis(), self.up());
        let axes = [forward.cross(up), up, forward].map(Vec3::as_dvec3);
        let position = self.render_space().world_point(self.position());
        let mut rows = [[0.0; 4]; 4];
        for (column, axis) in axes.iter().enumerate() {
            for (row, component) in axis.to_array().into_iter().enumerate() {
                rows[row][column] = component;
            }
            rows[3][column] = -axis.dot(position);
        }
        rows[3][3] = 1.0;
        rows
    }
}

/// First `a`, then `b`.
fn product(a: Rows, b: Rows) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| (0..4).map(|i| a[row][i] * b[i][column]).sum()))
}

fn rounded(rows: Rows) -> [[f32; 4]; 4] {
    // Adding zero makes a negative zero positive.
    rows.map(|row| row.map(|x| x as f32 + 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Framing;
    use crate::math::{DAffine3, DVec3, Transform, Vec2};

    fn place() -> DAffine3 {
        let turn = DAffine3::from_rotation_y(0.7) * DAffine3::from_rotation_x(-0.4);
        DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)) * turn
    }

    fn mapped(p: DVec3, rows: [[f32; 4]; 4]) -> [f64; 4] {
        let point = [p.x, p.y, p.z, 1.0];
        std::array::from_fn(|j| (0..4).map(|i| point[i] * f64::from(rows[i][j])).sum())
    }

    #[test]
    fn points_before_the_camera_have_positive_depth_and_the_right_side_is_right() {
        let camera = Camera::new(Transform::new(place()).unwrap(), Projection::Environment);
        // Camera space looks along -Z with +X right; OpenEXR's looks along +Z.
        for p in [DVec3::new(0.0, 0.0, -5.0), DVec3::new(1.0, 0.0, -1.0), DVec3::new(0.0, 1.0, -2.0)] {
            let measured = mapped(place().transform_point3(p), camera.world_to_camera());
            let expected = [p.x, p.y, -p.z];
            assert!(measured.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{measured:?} {expected:?}");
        }
        assert_eq!(camera.world_to_ndc([2, 2]), None);
    }

    /// A point of any ray of the camera is mapped to where the ray left the picture.
    #[test]
    fn rays_end_where_the_picture_shows_them() {
        let size = [64, 36];
        let framing = Framing { pixel_aspect: 1.3, shift: [0.1, -0.2] };
        for projection in
            [Projection::Perspective { half_height: 0.4, lens: None }, Projection::Orthographic { half_height: 2.5 }]
        {
            let camera = Camera::new(Transform::new(place()).unwrap(), projection).with_framing(framing);
            let matrix = camera.world_to_ndc(size).unwrap();
            let mut last = f64::NEG_INFINITY;
            for (film, distance) in
                [(Vec2::new(0.0, 0.0), 1.5), (Vec2::new(60.5, 10.25), 3.0), (Vec2::new(32.0, 36.0), 9.0)]
            {
                let ray = camera.ray(film, size, [0.5; 2], 0.0);
                let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * distance;
                let [x, y, z, w] = mapped(p, matrix);
                let expected = [f64::from(film.x) / 64.0, f64::from(film.y) / 36.0];
                assert!(
                    (x / w - expected[0]).abs() < 1e-5 && (y / w - expected[1]).abs() < 1e-5,
                    "{} {} {expected:?}",
                    x / w,
                    y / w
                );
                assert!(z / w > last);
                last = z / w;
            }
        }
    }
}
