//! Keyframes: transforms as written at several times become one motion.

use super::CompileContext;
use super::transforms::Shutter;
use crate::desc::{KeyframeDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::math::{DAffine3, DVec3, Motion};

/// The steps in one place of the lists of all keyframes; `None` where a keyframe lacks it.
type Column<'a> = Vec<Option<&'a TransformStepDesc>>;

impl CompileContext {
    /// The motion of keyframes after `map`, its times as shares of the shutter interval; just `map` if there are none.
    pub(super) fn motion(
        &self,
        path: &str,
        keyframes: &[KeyframeDesc],
        map: &DAffine3,
        shutter: Shutter,
    ) -> Result<Motion> {
        let constant = Motion::constant(*map);
        if keyframes.is_empty() {
            return Ok(constant);
        }
        let mut list = Vec::with_capacity(keyframes.len());
        for (i, keyframe) in keyframes.iter().enumerate() {
            let path = format!("{path}[{i}]");
            let map = self
                .transform(&format!("{path}.transform"), &keyframe.transform, &DAffine3::IDENTITY)?
                .world_from_object;
            let (time, previous) =
                (shutter.share(keyframe.time), list.last().map_or(f64::NEG_INFINITY, |(time, _)| *time));
            if !time.is_finite() || time <= previous {
                return Err(
                    self.error(&format!("{path}.time"), "times must be finite and grow from keyframe to keyframe")
                );
            }
            list.push((time, map));
        }
        let lists: Vec<&TransformDesc> = keyframes.iter().map(|keyframe| &keyframe.transform).collect();
        let motion = match columns(&lists) {
            Some(columns) => {
                let times: Vec<f64> = list.iter().map(|(time, _)| *time).collect();
                let mut motion = Some(Motion::constant(DAffine3::IDENTITY));
                for column in &columns {
                    let step = self.interpolated(path, &times, column)?;
                    motion = motion.zip(step).map(|(motion, step)| step.after(&motion));
                }
                motion
            }
            None => {
                let pivot = DAffine3::from_translation(self.pivot(path, &lists)?);
                list.iter_mut().for_each(|(_, map)| *map *= pivot);
                Motion::keyframed(&list).map(|motion| motion.after(&Motion::constant(pivot.inverse())))
            }
        };
        let singular = "the motion passes through a singular transform (does one keyframe mirror the shape?)";
        let motion = motion.ok_or_else(|| self.error(path, singular))?;
        let motion = if shutter.close > shutter.open { motion } else { Motion::constant(motion.map_at(0.0)) };
        Ok(motion.after(&constant))
    }

    /// The motion of one step; `None` if it is singular on its way.
    fn interpolated(&self, path: &str, times: &[f64], column: &Column) -> Result<Option<Motion>> {
        let map = |step: &Option<&TransformStepDesc>| step.map_or(Ok(DAffine3::IDENTITY), |step| self.step(path, step));
        let maps = column.iter().map(map).collect::<Result<Vec<DAffine3>>>()?;
        if let Some(angles) = angles(column) {
            let list: Vec<_> =
                times.iter().copied().zip(angles.degrees.iter().map(|degrees| degrees.to_radians())).collect();
            let still = angles.degrees.windows(2).all(|pair| pair[0] == pair[1]);
            return Ok(if still { Some(Motion::constant(maps[0])) } else { Motion::turning(angles.axis, &list) });
        }
        if maps.windows(2).all(|pair| pair[0] == pair[1]) {
            return Ok(Some(Motion::constant(maps[0])));
        }
        Ok(Motion::keyframed(&times.iter().copied().zip(maps).collect::<Vec<_>>()))
    }

    /// The point that the steps before the first rotation move to the origin: the centre of rotation. The origin if
    /// keyframes disagree.
    fn pivot(&self, path: &str, lists: &[&TransformDesc]) -> Result<DVec3> {
        let mut pivot: Option<DVec3> = None;
        for list in lists {
            let shifts = |step: &TransformStepDesc| {
                matches!(step, TransformStepDesc::Translate(_) | TransformStepDesc::Scale(_))
            };
            let Some(turn) = list.0.iter().position(|step| !shifts(step)) else { continue };
            let before = self.affine(path, &TransformDesc(list.0[..turn].to_vec()))?;
            let point = before.inverse().translation;
            if pivot.is_some_and(|pivot| (pivot - point).length() > 1e-9 * (1.0 + point.length())) {
                return Ok(DVec3::ZERO);
            }
            pivot = Some(point);
        }
        Ok(pivot.unwrap_or(DVec3::ZERO))
    }
}

/// Rotations about one axis.
struct Angles {
    axis: DVec3,
    degrees: Vec<f64>,
}

/// The angles of a column of rotations about one axis.
fn angles(column: &Column) -> Option<Angles> {
    let mut found: Option<DVec3> = None;
    let mut degrees = Vec::with_capacity(column.len());
    for step in column {
        degrees.push(match step {
            None => 0.0,
            Some(TransformStepDesc::Rotate { axis, degrees }) => {
                let axis = DVec3::from(*axis).normalize();
                let cosine = axis.dot(*found.get_or_insert(axis));
                // Within rounding of the same axis, or of the opposite one.
                if cosine.abs() < 1.0 - 1e-12 {
                    return None;
                }
                degrees * cosine.signum()
            }
            Some(_) => return None,
        });
    }
    found.map(|axis| Angles { axis, degrees })
}

/// The steps of all lists side by side, if they are of the same kinds in the same order. A rotation or a scale that a
/// list lacks changes nothing there.
fn columns<'a>(lists: &[&'a TransformDesc]) -> Option<Vec<Column<'a>>> {
    let longest = lists.iter().max_by_key(|list| list.0.len())?;
    let mut columns: Vec<Column> = vec![Vec::with_capacity(lists.len()); longest.0.len()];
    for list in lists {
        let mut steps = list.0.iter().peekable();
        for (column, pattern) in columns.iter_mut().zip(&longest.0) {
            let same = |step: &&TransformStepDesc| std::mem::discriminant(*step) == std::mem::discriminant(pattern);
            let step = steps.next_if(same);
            if step.is_none() && !matches!(pattern, TransformStepDesc::Rotate { .. } | TransformStepDesc::Scale(_)) {
                return None;
            }
            column.push(step);
        }
        if steps.next().is_some() {
            return None;
        }
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPEN: Shutter = Shutter { open: 0.0, close: 1.0 };

    fn motion(json: &str) -> Motion {
        let keyframes: Vec<KeyframeDesc> = serde_json::from_str(json).unwrap();
        CompileContext::new("s.json").motion("m", &keyframes, &DAffine3::IDENTITY, OPEN).unwrap()
    }

    #[track_caller]
    fn assert_path(motion: &Motion, point: DVec3, place: impl Fn(f64) -> DVec3) {
        for i in 0..=20 {
            let time = f64::from(i) / 20.0;
            let found = motion.map_at(time).transform_point3(point);
            assert!((found - place(time)).length() < 1e-12, "{time}: {found} {}", place(time));
        }
    }

    fn around_y(degrees: f64) -> DAffine3 {
        DAffine3::from_rotation_y(degrees.to_radians())
    }

    const TURN: &str = r#"{ "translate": [-3, -1, 2] }, { "rotate": { "axis": [0, 2, 0], "degrees": 120 } },
        { "translate": [3, 1, -2] }"#;

    #[test]
    fn what_turns_about_a_point_turns_in_place() {
        let still = r#"{ "translate": [-3, -1, 2] }, { "translate": [3, 1, -2] }"#;
        let zero = TURN.replace("120", "0");
        for first in ["", still, &zero] {
            let motion = motion(&format!(
                r#"[{{ "time": 0, "transform": [{first}] }}, {{ "time": 1, "transform": [{TURN}] }}]"#
            ));
            let pivot = DVec3::new(3.0, 1.0, -2.0);
            assert_path(&motion, pivot, |_| pivot);
            assert_path(&motion, pivot + DVec3::X, |time| pivot + around_y(120.0 * time).transform_vector3(DVec3::X));
        }
    }

    #[test]
    fn steps_are_interpolated_one_by_one() {
        // Two spins while half an orbit goes by and the size doubles.
        let at = |spin: i32, size: i32, orbit: i32, axis: &str| {
            format!(
                r#"[{{ "scale": {size} }}, {{ "rotate": {{ "axis": [0, 1, 0], "degrees": {spin} }} }},
                    {{ "translate": [5, 0, 0] }},
                    {{ "rotate": {{ "axis": {axis}, "degrees": {orbit} }} }}]"#
            )
        };
        let (first, last) = (at(0, 1, 0, "[0, 1, 0]"), at(720, 2, -180, "[0, -3, 0]"));
        let motion =
            motion(&format!(r#"[{{ "time": 0, "transform": {first} }}, {{ "time": 1, "transform": {last} }}]"#));
        let orbit = |time: f64| around_y(180.0 * time);
        assert_path(&motion, DVec3::ZERO, |time| orbit(time).transform_point3(5.0 * DVec3::X));
        assert_path(&motion, DVec3::Z, |time| {
            let spun = around_y(720.0 * time).transform_vector3(DVec3::Z) * (1.0 + time);
            orbit(time).transform_point3(5.0 * DVec3::X + spun)
        });
    }

    #[test]
    fn other_keyframes_are_interpolated_as_matrices() {
        // The point about which the matrices turn goes straight; the rotation is even.
        let turn = r#"{ "matrix": [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]] }"#;
        let motion = motion(&format!(
            r#"[{{ "time": 0, "transform": [{{ "translate": [1, 0, 0] }}] }},
                {{ "time": 1, "transform": [{turn}, {{ "translate": [0, 4, 0] }}, {{ "scale": 2 }}] }}]"#
        ));
        let center = |time: f64| DVec3::new(1.0 - time, 8.0 * time, 0.0);
        assert_path(&motion, DVec3::ZERO, center);
        assert_path(&motion, DVec3::X, |time| {
            center(time) + around_y(90.0 * time).transform_vector3(DVec3::X) * (1.0 + time)
        });
    }

    #[test]
    fn a_shutter_that_is_open_for_no_time_sees_no_motion() {
        let keyframes: Vec<KeyframeDesc> =
            serde_json::from_str(&format!(r#"[{{ "time": 0 }}, {{ "time": 2, "transform": [{TURN}] }}]"#)).unwrap();
        let shutter = Shutter { open: 1.0, close: 1.0 };
        let motion = CompileContext::new("s.json").motion("m", &keyframes, &DAffine3::IDENTITY, shutter).unwrap();
        let map = motion.as_constant().unwrap();
        let seen = map.transform_vector3(DVec3::X) - around_y(60.0).transform_vector3(DVec3::X);
        assert!(seen.length() < 1e-12, "{map:?}");
    }
}
