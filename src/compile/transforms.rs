//! Transforms: steps in the order written become one map.

use super::CompileContext;
use crate::desc::{ScaleDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3, Transform};

/// When the camera's shutter is open, in the time of the scene's keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shutter {
    /// When it opens.
    pub open: f64,
    /// When it closes, not before.
    pub close: f64,
}

impl From<[f64; 2]> for Shutter {
    fn from([open, close]: [f64; 2]) -> Self {
        Self { open, close }
    }
}

impl Shutter {
    /// A time of the scene as a share of the interval, or from its opening on if it has no length.
    pub fn share(&self, time: f64) -> f64 {
        let length = self.close - self.open;
        (time - self.open) / if length > 0.0 { length } else { 1.0 }
    }
}

impl CompileContext {
    /// The product of the steps: the first acts first.
    pub(super) fn affine(&self, path: &str, desc: &TransformDesc) -> Result<DAffine3> {
        let mut map = DAffine3::IDENTITY;
        for (i, step) in desc.0.iter().enumerate() {
            map = self.step(&format!("{path}[{i}]"), step)? * map;
        }
        Ok(map)
    }

    /// [`Self::affine`] after `outer`, rejected if it cannot be inverted.
    pub(super) fn transform(&self, path: &str, desc: &TransformDesc, outer: &DAffine3) -> Result<Transform> {
        let map = *outer * self.affine(path, desc)?;
        Transform::new(map).ok_or_else(|| self.error(path, super::SINGULAR))
    }

    /// The map of one step.
    pub(super) fn step(&self, path: &str, step: &TransformStepDesc) -> Result<DAffine3> {
        Ok(match step {
            TransformStepDesc::Translate(offset) => {
                DAffine3::from_translation(self.vector(&format!("{path}.translate"), *offset)?)
            }
            TransformStepDesc::Rotate { axis, degrees } => {
                let axis = self.direction(&format!("{path}.rotate.axis"), *axis)?;
                if !degrees.is_finite() {
                    return Err(self.error(&format!("{path}.rotate.degrees"), "the angle is not finite"));
                }
                DAffine3::from_mat3(rotation(axis, *degrees))
            }
            TransformStepDesc::Scale(scale) => {
                let factors = match *scale {
                    ScaleDesc::Uniform(s) => [s; 3],
                    ScaleDesc::PerAxis(s) => s,
                };
                DAffine3::from_scale(self.vector(&format!("{path}.scale"), factors)?)
            }
            TransformStepDesc::LookAt { from, to, up } => self.look_at(&format!("{path}.look_at"), *from, *to, *up)?,
            TransformStepDesc::Matrix(rows) => {
                let path = format!("{path}.matrix");
                if rows[3] != [0.0, 0.0, 0.0, 1.0] {
                    return Err(self.error(&path, format!("the last row must be 0 0 0 1, not {:?}", rows[3])));
                }
                let column = |c: usize| self.vector(&path, [rows[0][c], rows[1][c], rows[2][c]]);
                DAffine3 { matrix3: DMat3::from_cols(column(0)?, column(1)?, column(2)?), translation: column(3)? }
            }
        })
    }

    /// The map that takes the origin to `from` and -Z towards `to`, with +Y towards `up`.
    pub(super) fn look_at(&self, path: &str, from: [f64; 3], to: [f64; 3], up: [f64; 3]) -> Result<DAffine3> {
        let origin = self.position(path, from)?;
        let z = origin - self.position(path, to)?;
        let z = z.try_normalize().ok_or_else(|| self.error(path, "looks at the very point it stands on"))?;
        let up = self.direction(&format!("{path}.up"), up)?;
        let x = up.cross(z);
        // Sines below this leave no digit of the direction that `up` should give.
        if x.length() < 1e-12 {
            return Err(self.error(path, "the up vector is parallel to the view direction"));
        }
        let x = x.normalize();
        Ok(DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: origin })
    }
}

/// Rotation about a unit axis; multiples of a right angle are exact.
fn rotation(axis: DVec3, degrees: f64) -> DMat3 {
    let quarter = degrees / 90.0;
    if quarter.fract() == 0.0 {
        let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarter.rem_euclid(4.0) as usize];
        let DVec3 { x, y, z } = axis;
        let t = 1.0 - cos;
        return DMat3::from_cols(
            DVec3::new(t * x * x + cos, t * x * y + sin * z, t * x * z - sin * y),
            DVec3::new(t * x * y - sin * z, t * y * y + cos, t * y * z + sin * x),
            DVec3::new(t * x * z + sin * y, t * y * z - sin * x, t * z * z + cos),
        );
    }
    DMat3::from_axis_angle(axis, degrees.to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> CompileContext {
        CompileContext::new("s.json")
    }

    fn affine(json: &str) -> Result<DAffine3> {
        files().affine("t", &serde_json::from_str(json).unwrap())
    }

    #[test]
    fn the_first_step_acts_first() {
        let turn_then_move = r#"[{ "rotate": { "axis": [0, 0, 1], "degrees": 90 } }, { "translate": [1, 0, 0] }]"#;
        let move_then_turn = r#"[{ "translate": [1, 0, 0] }, { "rotate": { "axis": [0, 0, 2], "degrees": 90 } }]"#;
        assert_eq!(affine(turn_then_move).unwrap().transform_point3(DVec3::X), DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(affine(move_then_turn).unwrap().transform_point3(DVec3::ZERO), DVec3::Y);
    }

    #[test]
    fn rotations_are_the_same_by_both_ways() {
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        for degrees in [-90.0, 0.0, 90.0, 180.0, 270.0, 450.0f64] {
            let difference = rotation(axis, degrees) - DMat3::from_axis_angle(axis, degrees.to_radians());
            assert!(difference.to_cols_array().iter().all(|d| d.abs() < 1e-14), "{degrees}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let singular: TransformDesc = serde_json::from_str(r#"[{ "scale": [1, 0, 1] }]"#).unwrap();
        assert!(files().transform("t", &singular, &DAffine3::IDENTITY).unwrap_err().to_string().contains("singular"));
        for bad in [
            r#"[{ "rotate": { "axis": [0, 0, 0], "degrees": 90 } }]"#,
            r#"[{ "look_at": { "from": [0, 0, 0], "to": [0, 5, 0] } }]"#,
            r#"[{ "look_at": { "from": [1, 1, 1], "to": [1, 1, 1] } }]"#,
            r#"[{ "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]] }]"#,
        ] {
            assert!(affine(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn look_at_turns_minus_z_to_the_target() {
        let map = affine(r#"[{ "look_at": { "from": [1, 2, 3], "to": [5, 2, 3] } }]"#).unwrap();
        assert!((map.transform_vector3(-DVec3::Z) - DVec3::X).length() < 1e-15);
        assert!((map.transform_vector3(DVec3::Y) - DVec3::Y).length() < 1e-15);
        assert_eq!(map.transform_point3(DVec3::ZERO), DVec3::new(1.0, 2.0, 3.0));
    }
}
