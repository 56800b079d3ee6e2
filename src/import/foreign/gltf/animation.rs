//! Animations, evaluated at one moment.

use std::collections::{BTreeMap, BTreeSet};

use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation, Property, Sampler};
use gltf::json::validation::Checked;

use super::GltfSource;
use super::accessors::{AccessorUse, Column};
use super::nodes::unit;
use crate::error::Result;
use crate::import::Draft;
use crate::math::{DQuat, DVec3};

/// What animations give nodes in place of their own properties.
#[derive(Debug, Default)]
pub(crate) struct Motion {
    pub translations: BTreeMap<usize, DVec3>,
    pub rotations: BTreeMap<usize, DQuat>,
    pub scales: BTreeMap<usize, DVec3>,
    pub weights: BTreeMap<usize, Vec<f32>>,
}

/// All animations at a time in seconds. Where several move the same property of a node the first counts: what a file
/// has as one animation for each of its parts moves together, and of several for the same parts one is seen.
pub fn evaluate(source: GltfSource, time: f64, draft: &mut Draft) -> Result<Motion> {
    let mut motion = Motion::default();
    let mut taken: BTreeSet<(usize, u8)> = BTreeSet::new();
    for (a, animation) in source.root.animations.iter().enumerate() {
        let element = format!("animation \"{}\"", animation.name.as_deref().unwrap_or("unnamed"));
        for (c, channel) in animation.channels.iter().enumerate() {
            let path = format!("animations[{a}].channels[{c}]");
            let Checked::Valid(property) = channel.target.path else { continue };
            let node = channel.target.node.value();
            if !taken.insert((node, property as u8)) {
                draft.ignored(&path, &element, "channel", "an animation before it moves the same");
                continue;
            }
            let sampler = animation.samplers.get(channel.sampler.value());
            let sampler = sampler.ok_or_else(|| source.fault(&format!("{path}.sampler"), "no such sampler"))?;
            let curve = Curve::new(source, &path, sampler, value_type(property))?;
            motion.set(node, property, &curve, time).ok_or_else(|| source.fault(&path, "does not give a rotation"))?;
            draft.mapped(&path, &element, "channel");
        }
    }
    Ok(motion)
}

/// The elements of the values of a property.
fn value_type(property: Property) -> Type {
    match property {
        Property::Translation | Property::Scale => Type::Vec3,
        Property::Rotation => Type::Vec4,
        Property::MorphTargetWeights => Type::Scalar,
    }
}

impl Motion {
    /// Sets a property of a node to its value at a time; `None` if that is no rotation.
    fn set(&mut self, node: usize, property: Property, curve: &Curve, time: f64) -> Option<()> {
        let at = curve.moment(time);
        let vector =
            |at: &Moment| DVec3::from_array(curve.blend(at, 0, |column, i| column.floats::<3>(i).map(f64::from)));
        match property {
            Property::Translation => {
                self.translations.insert(node, vector(&at));
            }
            Property::Scale => {
                self.scales.insert(node, vector(&at));
            }
            Property::Rotation => {
                self.rotations.insert(node, curve.rotation(&at)?);
            }
            Property::MorphTargetWeights => {
                let width = curve.values.count() / curve.slots().max(1);
                let weights =
                    (0..width).map(|k| curve.blend(&at, k, |column, i| column.floats::<1>(i).map(f64::from))[0] as f32);
                self.weights.insert(node, weights.collect());
            }
        }
        Some(())
    }
}

/// Values over time.
struct Curve<'a> {
    times: Column<'a>,
    values: Column<'a>,
    interpolation: Interpolation,
    /// Values for each time: the morph targets, else 1.
    width: usize,
}

/// A place between two keyframes.
struct Moment {
    before: usize,
    after: usize,
    /// From 0 to 1.
    share: f64,
    /// Seconds from one to the other.
    length: f64,
}

impl<'a> Curve<'a> {
    fn new(source: GltfSource<'a>, path: &str, sampler: &Sampler, type_: Type) -> Result<Self> {
        let times = source.column(&format!("{path}: input"), sampler.input, &[Type::Scalar], AccessorUse::Floats)?;
        let values = source.column(&format!("{path}: output"), sampler.output, &[type_], AccessorUse::Floats)?;
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(source.fault(path, "the interpolation is not one of glTF"));
        };
        let mut curve = Self { times, values, interpolation, width: 1 };
        let (slots, count) = (curve.slots(), curve.values.count());
        if type_ == Type::Scalar && slots > 0 {
            curve.width = count / slots;
        }
        if slots == 0 || curve.width == 0 || curve.width.checked_mul(slots) != Some(count) {
            return Err(source.fault(path, format!("has {} times, but {count} values", curve.times.count())));
        }
        let mut last = f64::NEG_INFINITY;
        for i in 0..curve.times.count() {
            let time = curve.time(i);
            if !(time > last && time.is_finite()) {
                return Err(source
                    .fault(path, format!("time {i} of {} does not come after the one before", curve.times.count())));
            }
            last = time;
        }
        Ok(curve)
    }

    /// Groups of values: one for each time, three with tangents.
    fn slots(&self) -> usize {
        self.times.count().saturating_mul(if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 })
    }

    fn time(&self, i: usize) -> f64 {
        f64::from(self.times.floats::<1>(i)[0])
    }

    /// Before the first and after the last keyframe nothing changes.
    fn moment(&self, time: f64) -> Moment {
        let count = self.times.count();
        let (mut low, mut high) = (0, count);
        while low < high {
            let middle = low.midpoint(high);
            if self.time(middle) <= time { low = middle + 1 } else { high = middle }
        }
        if low == 0 || low >= count {
            let at = low.saturating_sub(1);
            return Moment { before: at, after: at, share: 0.0, length: 0.0 };
        }
        let (start, end) = (self.time(low - 1), self.time(low));
        Moment { before: low - 1, after: low, share: (time - start) / (end - start), length: end - start }
    }

    /// The value `k` of those at a moment, number by number.
    fn blend<const N: usize>(&self, at: &Moment, k: usize, value: impl Fn(&Column, usize) -> [f64; N]) -> [f64; N] {
        let at_key = |key: usize, slot: usize| {
            let group = if self.interpolation == Interpolation::CubicSpline { 3 * key + slot } else { key };
            value(&self.values, group * self.width + k)
        };
        let s = at.share;
        let before = at_key(at.before, 1);
        if s == 0.0 || self.interpolation == Interpolation::Step {
            return before;
        }
        let after = at_key(at.after, 1);
        match self.interpolation {
            Interpolation::CubicSpline => {
                let (leaving, arriving) = (at_key(at.before, 2), at_key(at.after, 0));
                let (s2, s3) = (s * s, s * s * s);
                std::array::from_fn(|i| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * before[i]
                        + at.length * (s3 - 2.0 * s2 + s) * leaving[i]
                        + (3.0 * s2 - 2.0 * s3) * after[i]
                        + at.length * (s3 - s2) * arriving[i]
                })
            }
            _ => std::array::from_fn(|i| before[i] + (after[i] - before[i]) * s),
        }
    }

    fn rotation(&self, at: &Moment) -> Option<DQuat> {
        let value = |column: &Column, i: usize| column.floats::<4>(i).map(f64::from);
        if self.interpolation != Interpolation::Linear {
            return unit(DQuat::from_array(self.blend(at, 0, value)));
        }
        let key = |i: usize| unit(DQuat::from_array(value(&self.values, i)));
        // The short way round.
        Some(key(at.before)?.slerp(key(at.after)?, at.share))
    }
}
