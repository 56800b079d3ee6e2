//! Transforms that change over the shutter interval.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::{Bounds, Transform};

/// Intervals into which bounds and checks divide the shutter.
const INTERVALS: u32 = 64;

/// A transform over the shutter interval, whose time runs from 0 to 1: a product of constant maps and keyframed ones,
/// the outermost first.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Constant(DAffine3),
    Keyframed(Vec<Keyframe>),
    /// A rotation about a unit axis through the origin, by angles in radians that are interpolated.
    Turning(DVec3, Vec<Angle>),
}

/// An angle in radians at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Angle {
    time: f64,
    angle: f64,
}

/// A transform at one time: first `stretch`, then `rotation`, then `translation` (Shoemake and Duff, "Matrix Animation
/// and Polar Decomposition"). Each is interpolated by itself, so that what turns keeps its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Keyframe {
    time: f64,
    translation: DVec3,
    rotation: DQuat,
    stretch: DMat3,
}

impl Motion {
    /// A constant map.
    pub fn constant(map: DAffine3) -> Self {
        Self { parts: vec![Part::Constant(map)] }
    }

    /// Passes through each map at its time; before the first and after the last it rests. Times must grow; they may lie
    /// outside of the shutter. `None` if there is no keyframe, a time does not grow, or a map on the way is not finite
    /// or singular.
    pub fn keyframed(keyframes: &[(f64, DAffine3)]) -> Option<Self> {
        let mut list: Vec<Keyframe> = Vec::with_capacity(keyframes.len());
        for &(time, map) in keyframes {
            let previous = list.last();
            if !time.is_finite() || previous.is_some_and(|p| time <= p.time) {
                return None;
            }
            let mut next = Keyframe::new(time, &map)?;
            // Of the two quaternions of a rotation the nearer one: the short way round.
            if previous.is_some_and(|p| p.rotation.dot(next.rotation) < 0.0) {
                next.rotation = -next.rotation;
            }
            list.push(next);
        }
        if list.is_empty() {
            return None;
        }
        let motion = Self { parts: vec![Part::Keyframed(list)] };
        motion.is_regular().then_some(motion)
    }

    /// Turns about a unit axis through the origin, counter-clockwise when looking against it, by an angle in radians at
    /// each time, of any number of turns. `None` if there is no angle, a time does not grow, or a number is not finite.
    pub fn turning(axis: DVec3, angles: &[(f64, f64)]) -> Option<Self> {
        let grow = angles.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let finite = axis.is_finite() && angles.iter().all(|(time, angle)| time.is_finite() && angle.is_finite());
        let list: Vec<_> = angles.iter().map(|&(time, angle)| Angle { time, angle }).collect();
        (grow && finite && !list.is_empty()).then(|| Self { parts: vec![Part::Turning(axis, list)] })
    }

    /// This motion after `inner`: first `inner`, then `self`.
    #[must_use]
    pub fn after(&self, inner: &Self) -> Self {
        let mut parts = self.parts.clone();
        for part in &inner.parts {
            match (parts.last_mut(), part) {
                (Some(Part::Constant(outer)), Part::Constant(map)) => *outer *= *map,
                _ => parts.push(part.clone()),
            }
        }
        Self { parts }
    }

    /// The map if it does not change.
    pub fn as_constant(&self) -> Option<DAffine3> {
        self.parts.iter().try_fold(DAffine3::IDENTITY, |product, part| match part {
            Part::Constant(map) => Some(product * *map),
            Part::Keyframed(list) if list.len() == 1 => Some(product * list[0].map()),
            Part::Turning(axis, list) if list.len() == 1 => Some(product * turned(*axis, list[0].angle)),
            Part::Keyframed(_) | Part::Turning(..) => None,
        })
    }

    /// The map at a time from 0 to 1.
    #[inline]
    pub fn map_at(&self, time: f64) -> DAffine3 {
        self.parts.iter().fold(DAffine3::IDENTITY, |product, part| product * part.at(time))
    }

    /// The transform at a time from 0 to 1.
    pub fn at(&self, time: f64) -> Transform {
        // Regular at all times that were sampled; between them it can fail only by a hair.
        Transform::new(self.map_at(time)).unwrap_or(Transform::IDENTITY)
    }

    /// Bounds of everything within `bounds` over the whole shutter interval; conservative.
    pub fn bounds(&self, bounds: &Bounds) -> Bounds {
        let all = (0..INTERVALS).map(|i| {
            let (from, to) = (f64::from(i) / f64::from(INTERVALS), f64::from(i + 1) / f64::from(INTERVALS));
            self.parts.iter().rev().fold(*bounds, |inner, part| part.bounds(&inner, from, to))
        });
        all.fold(Bounds::EMPTY, |a, b| a.union(&b))
    }

    /// Times at which [`at`](Self::at) may be evaluated to find its range.
    pub fn sample_times() -> impl Iterator<Item = f64> {
        (0..=INTERVALS).map(|i| f64::from(i) / f64::from(INTERVALS))
    }

    fn is_regular(&self) -> bool {
        Self::sample_times().all(|time| Transform::new(self.map_at(time)).is_some())
    }
}

impl Part {
    #[inline]
    fn at(&self, time: f64) -> DAffine3 {
        match self {
            Self::Constant(map) => *map,
            Self::Keyframed(list) => interpolate(list, time),
            Self::Turning(axis, list) => turned(*axis, interpolated_angle(list, time)),
        }
    }

    /// The times of its keyframes.
    fn times(&self) -> Vec<f64> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Keyframed(list) => list.iter().map(|key| key.time).collect(),
            Self::Turning(_, list) => list.iter().map(|key| key.time).collect(),
        }
    }

    /// How far a point within `bounds` can stray from the straight line between its places at two times between which
    /// there is no keyframe.
    fn deviation(&self, bounds: &Bounds, from: f64, to: f64) -> f64 {
        match self {
            Self::Constant(_) => 0.0,
            Self::Keyframed(list) => deviation(list, bounds, from, to),
            Self::Turning(_, list) => {
                let angle = interpolated_angle(list, to) - interpolated_angle(list, from);
                stray(angle * angle * reach(bounds))
            }
        }
    }

    /// Bounds of what is within `bounds`, from one time to another.
    fn bounds(&self, bounds: &Bounds, from: f64, to: f64) -> Bounds {
        if let Self::Constant(map) = self {
            return bounds.transformed(map);
        }
        // Keyframes inside the interval are corners of the path.
        let inside = self.times().into_iter().filter(|&time| from < time && time < to);
        let times: Vec<f64> = std::iter::once(from).chain(inside).chain(std::iter::once(to)).collect();
        let pieces = times.windows(2).map(|pair| {
            let ends = bounds.transformed(&self.at(pair[0])).union(&bounds.transformed(&self.at(pair[1])));
            ends.grown(self.deviation(bounds, pair[0], pair[1]))
        });
        let all = pieces.fold(Bounds::EMPTY, |a, b| a.union(&b));
        match self {
            Self::Turning(axis, _) => {
                let swept = swept(*axis, bounds);
                Bounds { min: all.min.max(swept.min), max: all.max.min(swept.max) }
            }
            _ => all,
        }
    }
}

/// Bounds of what is within `bounds` and turns about a unit axis through the origin, however often: it stays at its
/// height along the axis and as far from it as it is.
fn swept(axis: DVec3, bounds: &Bounds) -> Bounds {
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let (mut low, mut high, mut distance) = (f64::INFINITY, f64::NEG_INFINITY, 0f64);
    for corner in (0..8).map(corner) {
        let height = axis.dot(corner);
        (low, high) = (low.min(height), high.max(height));
        distance = distance.max((corner - axis * height).length());
    }
    let across = (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
    let extent = axis.abs() * (0.5 * (high - low)) + across * distance + reach(bounds) * 1e-12;
    let middle = axis * (0.5 * (low + high));
    Bounds { min: middle - extent, max: middle + extent }
}

/// Distance from the origin of the farthest point within `bounds`.
fn reach(bounds: &Bounds) -> f64 {
    bounds.min.abs().max(bounds.max.abs()).length()
}

/// How far a path can stray from a straight line: an eighth of the largest acceleration times the square of the time;
/// doubled, for rounding.
fn stray(acceleration_by_squared_time: f64) -> f64 {
    0.25 * acceleration_by_squared_time
}

/// The rotation about a unit axis by an angle in radians.
#[inline]
fn turned(axis: DVec3, angle: f64) -> DAffine3 {
    DAffine3::from_axis_angle(axis, angle)
}

#[inline]
fn interpolated_angle(list: &[Angle], time: f64) -> f64 {
    let next = list.partition_point(|key| key.time <= time);
    if next == 0 {
        return list[0].angle;
    }
    let a = list[next - 1];
    list.get(next).map_or(a.angle, |b| a.angle + (b.angle - a.angle) * ((time - a.time) / (b.time - a.time)))
}

/// [`Part::deviation`] of keyframes.
fn deviation(list: &[Keyframe], bounds: &Bounds, from: f64, to: f64) -> f64 {
    let next = list.partition_point(|key| key.time <= from);
    if next == 0 || next == list.len() {
        return 0.0;
    }
    let (a, b) = (&list[next - 1], &list[next]);
    let duration = b.time - a.time;
    let angular_speed = 2.0 * a.rotation.dot(b.rotation).abs().min(1.0).acos() / duration;
    let corner = reach(bounds);
    // Frobenius norms bound how far a matrix moves a vector.
    let norm = |m: &DMat3| (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt();
    let radius = norm(&a.stretch).max(norm(&b.stretch)) * corner;
    let stretch_speed = norm(&(b.stretch - a.stretch)) * corner / duration;
    let acceleration = angular_speed * (angular_speed * radius + 2.0 * stretch_speed);
    let step = to - from;
    stray(step * step * acceleration)
}

#[inline]
fn interpolate(list: &[Keyframe], time: f64) -> DAffine3 {
    let next = list.partition_point(|key| key.time <= time);
    if next == 0 {
        return list[0].map();
    }
    if next == list.len() {
        return list[next - 1].map();
    }
    let (a, b) = (&list[next - 1], &list[next]);
    let s = (time - a.time) / (b.time - a.time);
    let translation = a.translation.lerp(b.translation, s);
    let rotation = if a.rotation == b.rotation { a.rotation } else { slerp(a.rotation, b.rotation, s) };
    let stretch = a.stretch * (1.0 - s) + b.stretch * s;
    DAffine3 { matrix3: DMat3::from_quat(rotation) * stretch, translation }
}

/// Spherical interpolation with constant speed; the arguments' dot product is not negative.
#[inline]
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let angle = a.dot(b).min(1.0).acos();
    let sine = angle.sin();
    if sine < 1e-8 {
        return a.lerp(b, s);
    }
    (a * (((1.0 - s) * angle).sin() / sine) + b * ((s * angle).sin() / sine)).normalize()
}

impl Keyframe {
    /// `None` if the map is singular or not finite.
    fn new(time: f64, map: &DAffine3) -> Option<Self> {
        Transform::new(*map)?;
        let m = map.matrix3;
        // A reflection goes into the stretch.
        let side = m.determinant().signum();
        let rotation = polar_rotation(&(m * side));
        let stretch = rotation.transpose() * m;
        Some(Self { time, translation: map.translation, rotation: DQuat::from_mat3(&rotation).normalize(), stretch })
    }

    fn map(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_quat(self.rotation) * self.stretch, translation: self.translation }
    }
}

/// The rotation nearest to a regular matrix with positive determinant, by Newton's iteration (Higham, "Computing the
/// Polar Decomposition").
fn polar_rotation(m: &DMat3) -> DMat3 {
    // Scaled to determinant 1, the iteration converges from anywhere; quadratically at the end.
    let mut q = *m * m.determinant().cbrt().recip();
    for _ in 0..100 {
        let next = (q + q.inverse().transpose()) * 0.5;
        let change = next - q;
        q = next;
        if change.x_axis.length() + change.y_axis.length() + change.z_axis.length() < 1e-15 {
            break;
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: DAffine3, b: DAffine3) -> bool {
        let d = a.matrix3 - b.matrix3;
        let size = d.x_axis.length() + d.y_axis.length() + d.z_axis.length() + (a.translation - b.translation).length();
        size < 1e-12
    }

    #[test]
    fn keyframes_are_passed_through_and_held() {
        let a = DAffine3::from_rotation_x(0.3) * DAffine3::from_scale(DVec3::new(1.0, 2.0, -0.5));
        let b = DAffine3::from_rotation_z(2.0) * DAffine3::from_scale(DVec3::new(2.0, 1.0, -1.5));
        let motion = Motion::keyframed(&[(0.25, a), (0.75, b)]).unwrap();
        for (time, map) in [(0.0, a), (0.25, a), (0.75, b), (1.0, b)] {
            assert!(close(motion.map_at(time), map), "{time}");
        }
        assert!(motion.as_constant().is_none());
        assert!(close(Motion::keyframed(&[(0.5, a)]).unwrap().as_constant().unwrap(), a));
    }

    #[test]
    fn a_turning_body_keeps_its_shape_and_turns_evenly() {
        let motion = Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_rotation_y(3.0))]).unwrap();
        for i in 0..=20 {
            let time = f64::from(i) / 20.0;
            assert!(close(motion.map_at(time), DAffine3::from_rotation_y(3.0 * time)), "{time}");
        }
    }

    #[test]
    fn products_follow_their_parts() {
        let turn = Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_rotation_y(1.0))]).unwrap();
        let shift = DAffine3::from_translation(DVec3::X);
        let orbit = turn.after(&Motion::constant(shift));
        assert!(close(orbit.map_at(0.5), DAffine3::from_rotation_y(0.5) * shift));
        assert!(close(Motion::constant(shift).after(&turn).map_at(0.5), shift * DAffine3::from_rotation_y(0.5)));
    }

    #[test]
    fn turns_are_counted_and_held() {
        let axis = DVec3::new(1.0, -2.0, 2.0) / 3.0;
        let motion = Motion::turning(axis, &[(0.25, -1.0), (0.5, 19.0), (0.75, 20.0)]).unwrap();
        for (time, angle) in [(0.0, -1.0), (0.25, -1.0), (0.375, 9.0), (0.5, 19.0), (0.6875, 19.75), (1.0, 20.0)] {
            assert!(close(motion.map_at(time), DAffine3::from_axis_angle(axis, angle)), "{time}");
        }
        assert!(motion.as_constant().is_none());
        assert!(close(
            Motion::turning(axis, &[(3.0, 2.0)]).unwrap().as_constant().unwrap(),
            DAffine3::from_axis_angle(axis, 2.0)
        ));
        for bad in [&[][..], &[(0.0, 1.0), (0.0, 2.0)], &[(f64::NAN, 1.0)], &[(0.0, f64::INFINITY)]] {
            assert!(Motion::turning(axis, bad).is_none(), "{bad:?}");
        }
    }

    #[test]
    fn what_cannot_be_interpolated_is_refused() {
        let i = DAffine3::IDENTITY;
        assert!(Motion::keyframed(&[]).is_none());
        assert!(Motion::keyframed(&[(0.5, i), (0.5, i)]).is_none());
        assert!(Motion::keyframed(&[(f64::NAN, i)]).is_none());
        assert!(Motion::keyframed(&[(0.0, i), (1.0, DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0)))]).is_none());
        // A mirror image cannot be reached without passing through a plane.
        assert!(Motion::keyframed(&[(0.0, i), (1.0, DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)))]).is_none());
    }

    #[test]
    fn bounds_hold_every_point_at_every_time() {
        // A fixed sequence in place of random numbers.
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24) * 2.0 - 1.0
        };
        for _ in 0..40 {
            let mut map = || {
                let axis = DVec3::new(next(), next(), next()).normalize();
                DAffine3::from_translation(DVec3::new(next(), next(), next()) * 3.0)
                    * DAffine3::from_axis_angle(axis, next() * 3.0)
                    * DAffine3::from_scale(DVec3::new(1.5 + next(), 1.5 + next(), 1.5 + next()))
            };
            let Some(inner) = Motion::keyframed(&[(0.1, map()), (0.37, map()), (0.9, map())]) else { continue };
            let Some(outer) = Motion::keyframed(&[(-0.2, map()), (1.3, map())]) else { continue };
            let cube = Bounds { min: DVec3::new(-1.0, -0.5, 0.2), max: DVec3::new(0.4, 0.7, 1.0) };
            let axis = DVec3::new(next(), next(), next()).normalize();
            let turning = |turns: f64| {
                Motion::turning(axis, &[(-0.1, 0.0), (0.6, turns * next()), (1.0, turns * next())]).unwrap()
            };
            let [some, many] = [4.0, 400.0].map(turning);
            let pivot = DAffine3::from_translation(DVec3::new(2.0, 1.0, -3.0));
            let about = Motion::constant(pivot).after(&many).after(&Motion::constant(pivot.inverse()));
            // In a product the outer motion turns the inner one's boxes, which makes them larger; so do many turns in
            // each interval.
            let motions = [(inner.clone(), 1.05), (outer.after(&inner), 3.0), (some, 1.05), (about, 1.5)];
            for (motion, tightness) in motions {
                let bounds = motion.bounds(&cube);
                let mut reach = Bounds::EMPTY;
                for i in 0..=2000 {
                    let map = motion.map_at(f64::from(i) / 2000.0);
                    for corner in 0..8 {
                        let pick = |axis: usize| if corner >> axis & 1 == 0 { cube.min[axis] } else { cube.max[axis] };
                        reach = reach.extended(map.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
                    }
                }
                assert!(bounds.min.cmple(reach.min).all() && bounds.max.cmpge(reach.max).all(), "{bounds:?} {reach:?}");
                let slack = (bounds.max - bounds.min) / (reach.max - reach.min);
                assert!(slack.max_element() < tightness, "bounds are too loose: {slack}");
            }
        }
    }
}
