//! One cubic segment of a curve and where rays meet it.
//!
//! A round curve is the envelope of the spheres along it. A ray enters the sphere at the parameter `u` at the distance
//! `t(u)`; it meets the surface where `t(u)` has a local minimum. The segment is halved in the ray's own space, as in
//! Nakamaru and Ohno, "Ray Tracing for Curves Primitive", until what remains is nearly straight; there the minimum is
//! found by intersecting the tangent cone again and again, as in Reshetov and Luebke, "Phantom Ray-Hair Intersector". A
//! flat curve is met where the ray passes it within its radius.

use crate::math::float::{UNIT_ROUNDOFF, round_up};
use crate::math::{DVec3, DVec4, Ray, Vec3};

/// The curve's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// A tube.
    Round,
    /// A ribbon that faces each ray.
    Flat,
    /// As [`Flat`](Self::Flat), with the normals of a tube.
    Cylinder,
}

/// A span is nearly straight if it deviates from its chord by no more than this share of its radius.
const FLATNESS: f64 = 0.25;

/// Spans are halved this many times at most: the deviation is then the `4^-MAX_DEPTH` part.
const MAX_DEPTH: u32 = 12;

/// Minima are accepted this far beyond the ends of a span, relative to its length, so that none is lost between two.
const MARGIN: f64 = 1e-7;

/// Steps are repeated until they are shorter than this part of the span.
const PRECISION: f64 = 1e-10;

/// Steps at most; those of bisection among them leave less than [`PRECISION`].
const MAX_STEPS: u32 = 48;

/// Steps at most from a hit of another intersector to the exact one.
const MAX_REFINEMENTS: u32 = 12;

/// The two differ by less than this many radii.
const REFINED: f64 = 0.1;

/// A hit closer than this many radii is that of the ribbon that the ray starts on, which faces another ray.
const FLAT_START: f64 = 2.0;

/// The largest change of the radius by length with which a curve is slender.
const MAX_SLOPE: f64 = 0.15;

/// Its square is far from the limits of `f32`.
const MIN_SIZE: f64 = 1e-9;

/// Bernstein-Bezier control points, `w` is the radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment(pub [DVec4; 4]);

/// A ray's space: the origin at that of the ray, `z` along it.
pub(super) struct RaySpace {
    pub origin: DVec3,
    /// Unit and perpendicular.
    axes: [DVec3; 3],
    /// Of the ray's direction.
    pub length: f64,
}

impl RaySpace {
    pub fn new(ray: &Ray) -> Self {
        let direction = ray.direction.as_dvec3();
        let length = direction.length();
        let z = direction / length;
        let x = z.any_orthonormal_vector();
        Self { origin: ray.origin.as_dvec3(), axes: [x, z.cross(x), z], length }
    }

    /// The ray's unit direction.
    pub fn direction(&self) -> DVec3 {
        self.axes[2]
    }

    fn vector(&self, v: DVec4) -> DVec4 {
        let xyz = v.truncate();
        DVec4::new(self.axes[0].dot(xyz), self.axes[1].dot(xyz), self.axes[2].dot(xyz), v.w)
    }

    fn point(&self, p: DVec4) -> DVec4 {
        self.vector(p - self.origin.extend(0.0))
    }
}

/// Which of several hits is wanted; distances are lengths.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pick {
    /// The first within an interval.
    First { min: f64, max: f64 },
    /// The one closest to a distance.
    Nearest(f64),
}

/// A hit: the distance as a length, and the parameter within `[0, 1]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentHit {
    pub distance: f64,
    pub u: f64,
}

impl Pick {
    /// `hit`, if it is wanted rather than `old`.
    pub fn better(self, old: Option<SegmentHit>, hit: SegmentHit) -> Option<SegmentHit> {
        let is_better = match self {
            Self::First { min, max } => {
                hit.distance >= min && hit.distance <= max && old.is_none_or(|old| hit.distance < old.distance)
            }
            Self::Nearest(wanted) => {
                old.is_none_or(|old| (hit.distance - wanted).abs() < (old.distance - wanted).abs())
            }
        };
        if is_better { Some(hit) } else { old }
    }
}

impl Segment {
    /// The largest radius.
    pub fn max_radius(&self) -> f64 {
        self.0.iter().fold(0.0, |most, p| most.max(p.w))
    }

    /// A bound of the distance of the segment from its chord: an eighth of that of the second derivative.
    fn deviation(&self) -> f64 {
        let [a, b, c, d] = self.0;
        let second = |p: DVec4, q: DVec4, r: DVec4| (p - 2.0 * q + r).truncate().length_squared();
        0.75 * second(a, b, c).max(second(b, c, d)).sqrt()
    }

    /// Whether the curve runs along its chord all the way, and the radius, above 0, changes by less than 0.15 of the
    /// length: an envelope of spheres is then a tube of disks, as far as second orders (1.2 %) do not count.
    pub fn is_slender(&self) -> bool {
        let [a, b, c, d] = self.0;
        let chord = (d - a).truncate();
        let Some(along) = chord.try_normalize() else { return false };
        let advances = |p: DVec4, q: DVec4| (q - p).truncate().dot(along);
        let least = advances(a, b).min(advances(b, c)).min(advances(c, d));
        let steps = [b - a, c - b, d - c].map(|step| step.w.abs());
        let is_sized = chord.length() > MIN_SIZE && self.max_radius() > MIN_SIZE;
        is_sized && least > 0.0 && steps.iter().all(|&step| step < MAX_SLOPE * least)
    }

    /// The point and its derivative.
    #[inline]
    pub fn at(&self, u: f64) -> [DVec4; 2] {
        let [a, b, c, d] = self.0;
        let (ab, bc, cd) = (a.lerp(b, u), b.lerp(c, u), c.lerp(d, u));
        let (abc, bcd) = (ab.lerp(bc, u), bc.lerp(cd, u));
        [abc.lerp(bcd, u), 3.0 * (bcd - abc)]
    }

    fn halves(&self) -> [Self; 2] {
        let [a, b, c, d] = self.0;
        let (ab, bc, cd) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d));
        let (abc, bcd) = (0.5 * (ab + bc), 0.5 * (bc + cd));
        let middle = 0.5 * (abc + bcd);
        [Self([a, ab, abc, middle]), Self([middle, bcd, cd, d])]
    }

    /// The segment in a ray's space.
    pub fn in_space(&self, space: &RaySpace) -> Self {
        // Not by `map`, which is a call.
        let [a, b, c, d] = self.0;
        Self([space.point(a), space.point(b), space.point(c), space.point(d)])
    }

    /// Where a ray meets the tube of the segment, given in the ray's space, next to the parameter `u` and the distance
    /// that another intersector has found; `None` if steps from there lead elsewhere.
    pub fn refine(&self, mut u: f64, distance: f64) -> Option<SegmentHit> {
        for _ in 0..MAX_REFINEMENTS {
            let [p, derivative] = self.at(u);
            let step = round_step(p, derivative);
            if step.abs() <= PRECISION {
                let mut search = Search { kind: CurveKind::Round, pick: Pick::Nearest(distance), best: None };
                search.offer(p + derivative * step, u + step);
                return search.best.filter(|hit| (hit.distance - distance).abs() < REFINED * p.w);
            }
            u += step;
            if !(0.0..=1.0).contains(&u) {
                return None;
            }
        }
        None
    }

    /// Where a ray meets the segment, given in the ray's space.
    pub fn find(&self, kind: CurveKind, pick: Pick) -> Option<SegmentHit> {
        let mut search = Search { kind, pick, best: None };
        search.halve(self, 0.0, MAX_DEPTH);
        search.best
    }
}

/// The line of a segment's chord, and a bound of the distance of the surface from it, in `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Capsule {
    first: Vec3,
    chord: Vec3,
    reach: f32,
}

impl Capsule {
    pub fn new(segment: &Segment) -> Self {
        let (first, last) = (segment.0[0].truncate(), segment.0[3].truncate());
        let rounding = 4.0 * UNIT_ROUNDOFF * first.abs().max(last.abs()).max_element();
        Self {
            first: first.as_vec3(),
            chord: (last - first).as_vec3(),
            reach: round_up(segment.max_radius() + segment.deviation() + rounding),
        }
    }

    /// Whether the line of a ray passes so close to that of the chord that it may meet the segment. Most rays that
    /// meet the bounds of a segment pass it by. What is too large for `f32` passes.
    #[inline(always)]
    pub fn may_be_met(&self, ray: &Ray) -> bool {
        let from = self.first - ray.origin;
        let normal = ray.direction.cross(self.chord);
        // The roundings of the products: some 16 of each term.
        let terms = (from.length_squared() * ray.direction.length_squared() * self.chord.length_squared()).sqrt();
        let reach = self.reach * normal.length() * 1.000_001 + 2e-6 * terms;
        let passes_by = from.dot(normal).abs() > reach;
        !passes_by
    }
}

struct Search {
    kind: CurveKind,
    pick: Pick,
    best: Option<SegmentHit>,
}

impl Search {
    /// Searches a span that begins at the parameter `u`; with `depth` halvings left, it has the `2^(depth - MAX_DEPTH)`
    /// part of the parameters.
    fn halve(&mut self, span: &Segment, u: f64, depth: u32) {
        let radius = span.max_radius();
        let [a, b, c, d] = span.0;
        let (low, high) = (a.min(b).min(c.min(d)) - radius, a.max(b).max(c.max(d)) + radius);
        if low.x > 0.0 || low.y > 0.0 || high.x < 0.0 || high.y < 0.0 {
            return;
        }
        if let Pick::First { min, max } = self.pick {
            let max = self.best.map_or(max, |best| best.distance.min(max));
            if low.z > max || high.z < min {
                return;
            }
        }
        if depth == 0 || span.deviation() <= FLATNESS * radius {
            self.solve(span, u, depth);
            return;
        }
        let [first, second] = span.halves();
        let half = 0.5 / f64::from(1 << (MAX_DEPTH - depth));
        self.halve(&first, u, depth - 1);
        self.halve(&second, u + half, depth - 1);
    }

    /// Searches a nearly straight span: the steps towards the minimum, within what is left between two that lead there
    /// from both sides.
    fn solve(&mut self, span: &Segment, u: f64, depth: u32) {
        let (mut low, mut high) = (-MARGIN, 1.0 + MARGIN);
        let mut s = 0.5;
        for _ in 0..MAX_STEPS {
            let [p, dp] = span.at(s);
            let step = if self.kind == CurveKind::Round { round_step(p, dp) } else { flat_step(p, dp) };
            if step.abs() <= PRECISION {
                let share = 1.0 / f64::from(1 << (MAX_DEPTH - depth));
                return self.offer(p + dp * step, (u + (s + step) * share).clamp(0.0, 1.0));
            }
            // False for a NaN.
            let leads_on = if step > 0.0 { s < high } else { step < 0.0 && s > low };
            if !leads_on {
                return;
            }
            let (old_low, old_high) = (low, high);
            if step > 0.0 {
                low = s;
            } else {
                high = s;
            }
            let next = s + step;
            s = if next > low && next < high {
                next
            } else if next >= high && old_high > 1.0 && step > 0.0 {
                old_high
            } else if next <= low && old_low < 0.0 && step < 0.0 {
                old_low
            } else {
                0.5 * (low + high)
            };
        }
    }

    /// Takes the hit at a point of the curve with its radius, if the ray passes within it.
    fn offer(&mut self, p: DVec4, u: f64) {
        let below = p.w * p.w - (p.x * p.x + p.y * p.y);
        if below < 0.0 || p.w == 0.0 {
            return;
        }
        let distance = if self.kind == CurveKind::Round { p.z - below.sqrt() } else { p.z };
        if self.kind == CurveKind::Round || distance > FLAT_START * p.w {
            self.best = self.pick.better(self.best, SegmentHit { distance, u });
        }
    }
}

/// The change of the parameter to where the distance to the tangent cone is smallest; to where the cone comes closest
/// to a ray that misses it. `p` is a point of the curve and `d` its derivative, in the ray's space.
///
/// With the squared half chord `D(s) = a s² + 2 b s + c` in the sphere at `s`, the distance `z(s) - sqrt(D(s))` is
/// smallest where `z' sqrt(D) = a s + b =: w`, so `w² (z'² - a) = z'² (b² - a c)`.
fn round_step(p: DVec4, d: DVec4) -> f64 {
    let a = d.w * d.w - (d.x * d.x + d.y * d.y);
    let b = p.w * d.w - (p.x * d.x + p.y * d.y);
    let c = p.w * p.w - (p.x * p.x + p.y * p.y);
    let discriminant = b * b - a * c;
    let spread = d.z * d.z - a;
    if spread <= 0.0 || (discriminant < 0.0 && a >= 0.0) {
        // Spheres within each other, or one cone around the whole ray: on towards the larger ones.
        return if c > 0.0 { (b / c.sqrt() - d.z).signum() } else { b.signum() };
    }
    if discriminant < 0.0 {
        return -b / a;
    }
    let w = d.z * (discriminant / spread).sqrt();
    if w * b > 0.0 { (b * b - c * d.z * d.z) / (spread * (w + b)) } else { (w - b) / a }
}

/// As [`round_step`], to where the tangent comes closest to the ray.
fn flat_step(p: DVec4, d: DVec4) -> f64 {
    -(p.x * d.x + p.y * d.y) / (d.x * d.x + d.y * d.y)
}

/// Where a ray meets the sphere at a joint, given in the ray's space with the derivatives of the segments that end and
/// begin there, if it is first hit there: on a corner of the curve, the sphere shows.
pub(super) fn joint_hit(p: DVec4, before: DVec4, after: DVec4) -> Option<f64> {
    let below = p.w * p.w - (p.x * p.x + p.y * p.y);
    let half_chord = below.sqrt();
    let slope = |d: DVec4| d.z * half_chord - (p.w * d.w - (p.x * d.x + p.y * d.y));
    // False for the NaN of a ray that passes by.
    (p.w > 0.0 && slope(before) <= 0.0 && slope(after) >= 0.0).then_some(p.z - half_chord)
}
