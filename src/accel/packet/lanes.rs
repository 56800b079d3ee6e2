//! One packet: rays in the lanes of vector registers, with the closest hits so far.

use pulp::Simd;

use crate::geometry::{PACKET_SIZE, RayPacket};
use crate::math::compact::set_bits;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::Row;
use crate::math::{Aabb, RayRows, Vec3};

/// A vector in each lane.
pub(in crate::accel) type Vector<S> = [<S as Simd>::f32s; 3];

/// Rays that start farther from the middle of the scene than this many times its radius are traced alone.
pub(super) const REACH: f32 = 8.0;

/// Directions whose largest component is outside these limits are traced alone: products of them could leave the range
/// of `f32`.
const DIRECTIONS: [f32; 2] = [1e-9, 1e9];

/// Where a component of a direction is smaller, its reciprocal is that of this number.
const SMALLEST_DIRECTION: f32 = 1e-18;

/// Distances to planes that rays meet at an angle with a smaller sine are computed in `f64`.
const FLAT: f32 = 1e-3;

/// In place of the number of a primitive, where a ray hits nothing.
pub(super) const NONE: u32 = u32::MAX;

/// The numbers of the lanes.
const LANES: [u32; PACKET_SIZE] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// A sphere around the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundingSphere {
    pub center: Vec3,
    pub radius: f32,
}

impl BoundingSphere {
    /// How far surfaces may seem to be from where they are, by rounding, to rays that are not traced alone.
    pub fn rounding(&self) -> f32 {
        (256.0 * UNIT_ROUNDOFF) as f32 * (self.radius * (1.0 + REACH) + self.center.abs().max_element())
    }

    /// Bounds that rays do not miss by rounding.
    pub fn widened(&self, bounds: &Aabb) -> Aabb {
        let margin = Vec3::splat(self.rounding());
        Aabb { min: bounds.min - margin, max: bounds.max + margin }
    }
}

/// The rays of a packet and their closest hits.
pub(super) struct Packet<S: Simd> {
    pub origin: Vector<S>,
    pub direction: Vector<S>,
    /// The origin as seen from the middle of the scene, cross the direction.
    pub moment: Vector<S>,
    /// Bound of the rounding error of distances to edges, times the length of the direction.
    pub edge_error: S::f32s,
    /// Products of the direction and a unit normal up to this mean that the ray is nearly parallel to the plane.
    pub flat: S::f32s,
    /// Reciprocal of the direction, finite.
    reciprocal: Vector<S>,
    /// Minus the origin times the reciprocal.
    scaled_origin: Vector<S>,
    pub t_min: S::f32s,
    pub t_max: S::f32s,
    /// The 1-norm of the direction.
    pub length: S::f32s,
    /// The closest hit is not farther than this; at first the end of the ray, minus infinity in lanes that are not
    /// traced, and in those found occluded.
    pub t: S::f32s,
    /// The closest hit is not nearer than this: less than `t` only on an analytic shape.
    pub t_low: S::f32s,
    /// What is reported as the distance of the closest hit: as `t_low`, but what the shape's interval in `f32` says
    /// even if the distance has been found in `f64`, so that a result does not depend on what else was near.
    pub reported: S::f32s,
    /// The number of the primitive hit, or [`NONE`].
    pub prim: S::u32s,
    /// Whether most rays point towards smaller coordinates, by axis.
    pub is_negative: [bool; 3],
}

/// Hits of a packet's rays on one primitive.
#[derive(Clone, Copy)]
pub(super) struct Offer<S: Simd> {
    /// Distances.
    pub t: S::f32s,
    /// What is reported as distances.
    pub reported: S::f32s,
    /// The number of the primitive.
    pub prim: u32,
}

/// Some of the lanes of a packet, as bits.
#[derive(Clone, Copy)]
pub(super) struct LaneSet(u32);

impl LaneSet {
    /// The lanes that are true.
    #[inline(always)]
    pub fn of<S: Simd>(simd: S, mask: S::m32s) -> Self {
        let mut lanes = [0u32; PACKET_SIZE];
        store_u32s(simd, simd.select_u32s(mask, simd.splat_u32s(1), simd.splat_u32s(0)), &mut lanes);
        Self((0..PACKET_SIZE).fold(0, |set, lane| set | lanes[lane] << lane))
    }

    #[inline(always)]
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }

    #[inline(always)]
    pub fn contains(self, lane: usize) -> bool {
        self.0 >> lane & 1 != 0
    }

    /// The lanes in order.
    #[inline(always)]
    pub fn lanes(self) -> impl Iterator<Item = usize> {
        set_bits(self.0)
    }
}

/// As many numbers, from `first` on, as there are lanes.
#[inline(always)]
pub(in crate::accel) fn load<S: Simd>(_: S, row: &[f32], first: usize) -> S::f32s {
    S::as_simd_f32s(&row[first..first + S::F32_LANES]).0[0]
}

/// Writes the numbers of all lanes to the start of `to`, which has room for them.
#[inline(always)]
pub(in crate::accel) fn store_f32s<S: Simd>(_: S, values: S::f32s, to: &mut [f32]) {
    S::as_mut_simd_f32s(&mut to[..S::F32_LANES]).0[0] = values;
}

/// As [`store_f32s`].
#[inline(always)]
pub(super) fn store_u32s<S: Simd>(_: S, values: S::u32s, to: &mut [u32]) {
    S::as_mut_simd_u32s(&mut to[..S::F32_LANES]).0[0] = values;
}

/// Whether any lane is set.
#[inline(always)]
pub(super) fn any<S: Simd>(simd: S, mask: S::m32s) -> bool {
    simd.first_true_m32s(mask) < S::F32_LANES
}

/// A vector in all lanes.
#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, v: Vec3) -> Vector<S> {
    [simd.splat_f32s(v.x), simd.splat_f32s(v.y), simd.splat_f32s(v.z)]
}

#[inline(always)]
pub(super) fn subtract<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [simd.sub_f32s(a[0], b[0]), simd.sub_f32s(a[1], b[1]), simd.sub_f32s(a[2], b[2])]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> S::f32s {
    simd.mul_add_f32s(a[2], b[2], simd.mul_add_f32s(a[1], b[1], simd.mul_f32s(a[0], b[0])))
}

/// [`dot`], added to `sum`.
#[inline(always)]
pub(super) fn add_dot<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>, sum: S::f32s) -> S::f32s {
    simd.mul_add_f32s(a[2], b[2], simd.mul_add_f32s(a[1], b[1], simd.mul_add_f32s(a[0], b[0], sum)))
}

#[inline(always)]
fn cross<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    let s = simd;
    [
        s.negate_mul_add_f32s(a[2], b[1], s.mul_f32s(a[1], b[2])),
        s.negate_mul_add_f32s(a[0], b[2], s.mul_f32s(a[2], b[0])),
        s.negate_mul_add_f32s(a[1], b[0], s.mul_f32s(a[0], b[1])),
    ]
}

/// `a + t b`.
#[inline(always)]
pub(super) fn add_scaled<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>, t: S::f32s) -> Vector<S> {
    [simd.mul_add_f32s(b[0], t, a[0]), simd.mul_add_f32s(b[1], t, a[1]), simd.mul_add_f32s(b[2], t, a[2])]
}

/// The absolute values of the components.
#[inline(always)]
pub(super) fn absolute<S: Simd>(simd: S, v: Vector<S>) -> Vector<S> {
    [simd.abs_f32s(v[0]), simd.abs_f32s(v[1]), simd.abs_f32s(v[2])]
}

/// The 1-norm.
#[inline(always)]
pub(super) fn absolute_sum<S: Simd>(simd: S, v: Vector<S>) -> S::f32s {
    let [x, y, z] = absolute(simd, v);
    simd.add_f32s(simd.add_f32s(x, y), z)
}

/// Whether `low <= a <= high`; false for a NaN.
#[inline(always)]
pub(super) fn within<S: Simd>(simd: S, a: S::f32s, low: S::f32s, high: S::f32s) -> S::m32s {
    simd.and_m32s(simd.greater_than_or_equal_f32s(a, low), simd.less_than_or_equal_f32s(a, high))
}

/// Vectors of a row from `first` on.
#[inline(always)]
pub(in crate::accel) fn load_vector<S: Simd>(simd: S, rows: &[Row; 3], first: usize) -> Vector<S> {
    [load(simd, &rows[0], first), load(simd, &rows[1], first), load(simd, &rows[2], first)]
}

/// The reciprocal of components of directions, finite.
#[inline(always)]
fn reciprocal<S: Simd>(simd: S, d: S::f32s) -> S::f32s {
    let smallest = simd.splat_f32s(SMALLEST_DIRECTION);
    let is_small = simd.less_than_f32s(simd.abs_f32s(d), smallest);
    simd.div_f32s(simd.splat_f32s(1.0), simd.select_f32s(is_small, smallest, d))
}

/// Whether more than half of the numbers are negative.
#[inline(always)]
fn most_are_negative<S: Simd>(simd: S, d: S::f32s) -> bool {
    let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
    let ones = simd.select_f32s(simd.less_than_f32s(d, zero), one, zero);
    simd.reduce_sum_f32s(ones) > 0.5 * S::F32_LANES as f32
}

impl<S: Simd> Packet<S> {
    /// `count` rays of rows from `first` on, and those of them that are to be traced alone: rays that start far from
    /// the scene, or are not valid.
    #[inline(always)]
    pub fn new(simd: S, sphere: &BoundingSphere, rays: &RayRows, first: usize, count: usize) -> (Self, LaneSet) {
        let s = simd;
        let (origin, direction) = (load_vector(s, &rays.origin.0, first), load_vector(s, &rays.direction.0, first));
        let (t_min, t_max) = (load(s, &rays.t_min, first), load(s, &rays.t_max, first));
        let (zero, one) = (s.splat_f32s(0.0), s.splat_f32s(1.0));
        let from_center = subtract(s, origin, splat(s, sphere.center));
        let (distance, length) = (absolute_sum(s, from_center), absolute_sum(s, direction));

        // Of six products, three have directions and moments of edges (within the radius) and three moments of rays and
        // directions of edges. Each factor was rounded, those of the moment of the ray from a rounded difference: at
        // most 7 roundings of the first kind, 10 of the second.
        let factor = s.splat_f32s((16.0 * UNIT_ROUNDOFF) as f32);
        let edge_error = s.mul_f32s(s.mul_f32s(factor, length), s.add_f32s(distance, s.splat_f32s(sphere.radius)));

        let is_near = s.less_than_or_equal_f32s(distance, s.splat_f32s(REACH * sphere.radius));
        let is_usual = within(s, length, s.splat_f32s(DIRECTIONS[0]), s.splat_f32s(DIRECTIONS[1]));
        let is_timely = s.and_m32s(within(s, t_min, zero, t_max), within(s, load(s, &rays.time, first), zero, one));
        let is_fit = s.and_m32s(s.and_m32s(is_near, is_usual), is_timely);
        let is_present = s.less_than_u32s(s.partial_load_u32s(&LANES[..S::F32_LANES]), s.splat_u32s(count as u32));
        let is_left_out = s.and_m32s(is_present, s.not_m32s(is_fit));
        let left_out = if any(s, is_left_out) { LaneSet::of(s, is_left_out) } else { LaneSet(0) };

        let reciprocal = [reciprocal(s, direction[0]), reciprocal(s, direction[1]), reciprocal(s, direction[2])];
        let t = s.select_f32s(s.and_m32s(is_fit, is_present), t_max, s.splat_f32s(f32::NEG_INFINITY));
        let packet = Self {
            origin,
            direction,
            moment: cross(s, from_center, direction),
            edge_error,
            flat: s.mul_f32s(length, s.splat_f32s(FLAT)),
            reciprocal,
            scaled_origin: [
                s.neg_f32s(s.mul_f32s(origin[0], reciprocal[0])),
                s.neg_f32s(s.mul_f32s(origin[1], reciprocal[1])),
                s.neg_f32s(s.mul_f32s(origin[2], reciprocal[2])),
            ],
            t_min,
            t_max,
            length,
            t,
            t_low: t,
            reported: t,
            prim: s.splat_u32s(NONE),
            is_negative: [
                most_are_negative(s, direction[0]),
                most_are_negative(s, direction[1]),
                most_are_negative(s, direction[2]),
            ],
        };
        (packet, left_out)
    }

    /// The rays that may meet the box before their closest hits.
    #[inline(always)]
    pub fn enter(&self, simd: S, bounds: &Aabb) -> S::m32s {
        let s = simd;
        let (mut near, mut far) = (self.t_min, self.t);
        for axis in 0..3 {
            // The error of the sum of two products is that of coordinates, which the boxes allow for.
            let (reciprocal, origin) = (self.reciprocal[axis], self.scaled_origin[axis]);
            let a = s.mul_add_f32s(s.splat_f32s(bounds.min[axis]), reciprocal, origin);
            let b = s.mul_add_f32s(s.splat_f32s(bounds.max[axis]), reciprocal, origin);
            near = s.max_f32s(near, s.min_f32s(a, b));
            far = s.min_f32s(far, s.max_f32s(a, b));
        }
        s.less_than_or_equal_f32s(near, far)
    }

    /// The rays that may still hit something.
    #[inline(always)]
    pub fn is_open(&self, simd: S) -> S::m32s {
        simd.less_than_or_equal_f32s(self.t_min, self.t)
    }

    /// The product of rays and the unit `direction` of a line with a `moment`: the distance to it, times lengths and
    /// sines.
    #[inline(always)]
    pub fn side(&self, simd: S, direction: Vec3, moment: Vec3) -> S::f32s {
        add_dot(simd, self.moment, splat(simd, direction), dot(simd, self.direction, splat(simd, moment)))
    }

    /// Takes hits at `t` on a primitive where they are the closest so far; of hits at one distance, that on the first
    /// primitive. Where `t` is within the interval of the closest hit, `exact` finds its distance: it takes lanes,
    /// numbers of primitives and rays. Without analytic `SHAPES` there are no intervals.
    #[inline(always)]
    pub fn offer<const ANY: bool, const SHAPES: bool>(
        &mut self,
        simd: S,
        is_hit: S::m32s,
        hit: Offer<S>,
        exact: impl Fn(LaneSet, &[u32; PACKET_SIZE], &RayPacket) -> [f32; PACKET_SIZE],
    ) {
        let s = simd;
        let Offer { t, reported, prim } = hit;
        let prim = s.splat_u32s(prim);
        let is_valid =
            s.and_m32s(s.greater_than_or_equal_f32s(t, self.t_min), s.less_than_f32s(t, s.splat_f32s(f32::INFINITY)));
        let is_hit = s.and_m32s(is_hit, is_valid);
        if SHAPES && !ANY {
            let is_unclear = s.and_m32s(s.less_than_f32s(self.t_low, self.t), within(s, t, self.t_low, self.t));
            let is_unclear = s.and_m32s(is_unclear, is_hit);
            if any(s, is_unclear) {
                let mut prims = [NONE; PACKET_SIZE];
                store_u32s(s, self.prim, &mut prims);
                let rays = RayPacket { t_max: store(s, self.t_max), ..self.rays(s) };
                let distances = exact(LaneSet::of(s, is_unclear), &prims, &rays);
                let distances = load(s, &distances, 0);
                self.t = s.select_f32s(is_unclear, distances, self.t);
                self.t_low = s.select_f32s(is_unclear, distances, self.t_low);
            }
        }
        let is_first = s.and_m32s(s.equal_f32s(t, self.t), s.less_than_u32s(prim, self.prim));
        let is_taken = s.and_m32s(is_hit, s.or_m32s(s.less_than_f32s(t, self.t), is_first));
        let end = if ANY { s.splat_f32s(f32::NEG_INFINITY) } else { t };
        self.t = s.select_f32s(is_taken, end, self.t);
        if SHAPES {
            self.t_low = s.select_f32s(is_taken, end, self.t_low);
            self.reported = s.select_f32s(is_taken, reported, self.reported);
        }
        self.prim = s.select_u32s(is_taken, prim, self.prim);
    }

    /// Takes hits between the distances `low` and `high` on a primitive where they are closer than all so far. The
    /// result is where that is not clear.
    #[inline(always)]
    pub fn offer_interval<const ANY: bool>(
        &mut self,
        simd: S,
        is_hit: S::m32s,
        [low, high]: [S::f32s; 2],
        prim: u32,
    ) -> S::m32s {
        let s = simd;
        let is_taken = if ANY { is_hit } else { s.and_m32s(is_hit, s.less_than_f32s(high, self.t_low)) };
        let is_unclear = s.and_m32s(s.and_m32s(is_hit, s.not_m32s(is_taken)), s.less_than_or_equal_f32s(low, self.t));
        let end = s.splat_f32s(f32::NEG_INFINITY);
        self.t = s.select_f32s(is_taken, if ANY { end } else { high }, self.t);
        self.t_low = s.select_f32s(is_taken, if ANY { end } else { low }, self.t_low);
        self.reported = s.select_f32s(is_taken, low, self.reported);
        self.prim = s.select_u32s(is_taken, s.splat_u32s(prim), self.prim);
        is_unclear
    }

    /// The rays up to their closest hits, in rows.
    #[inline(always)]
    pub fn rays(&self, simd: S) -> RayPacket {
        let (o, d) = (&self.origin, &self.direction);
        RayPacket {
            origin: [store(simd, o[0]), store(simd, o[1]), store(simd, o[2])],
            t_min: store(simd, self.t_min),
            direction: [store(simd, d[0]), store(simd, d[1]), store(simd, d[2])],
            t_max: store(simd, self.t),
        }
    }
}

/// The numbers of all lanes, at the start of as many as the largest packet has.
#[inline(always)]
pub(super) fn store<S: Simd>(simd: S, values: S::f32s) -> [f32; PACKET_SIZE] {
    let mut out = [0.0; PACKET_SIZE];
    store_f32s(simd, values, &mut out);
    out
}
