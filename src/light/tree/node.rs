//! Nodes: bounds of eight children in lanes, and the estimate of what each gives at a point.

use super::{LEAF, NONE, ShadingPoint};
use crate::light::bounds::LightBounds;
use crate::math::Vec3;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Cosines this far beyond the limit still count as reached: `f32` bounds must not cut off what they hold.
const SLACK: f32 = 1e-3;

/// Least value of a cosine that is not cut off.
const LEAST_COSINE: f32 = 1e-3;

/// Near the horizon of a sphere, the mean cosine falls with the square of what is above, the largest in proportion to
/// it: at least this share of the largest counts, for all the light may come from there.
const LEAST_SHARE: f32 = 0.125;

/// Limit of an importance: sums stay finite.
const LARGEST: f32 = f32::MAX * f32::EPSILON;

/// A group is near if its squared distance is below this many times its squared radius. On a room with 320 lights,
/// error times time is least between 1 and 2.
const NEAR: f32 = 1.5;

/// Eight children.
#[derive(Clone, Debug)]
pub(super) struct Node {
    bounds: Bounds<WIDTH>,
    first_node: u32,
}

/// Bounds of children, side by side.
#[derive(Clone, Debug)]
struct Bounds<const N: usize> {
    center: [[f32; N]; 3],
    inverse_radius: [f32; N],
    axis: [[f32; N]; 3],
    /// Cosine and sine of the normals' spread.
    cos_spread: [f32; N],
    sin_spread: [f32; N],
    /// Cosine of the reach of emission, less [`SLACK`].
    cos_reach: [f32; N],
    /// Zero where there is no child. Negative for a child that emits both ways.
    intensity: [f32; N],
    /// A node, or [`LEAF`] and a light.
    child: [u32; N],
}

/// What is known of one child.
#[derive(Clone, Copy)]
pub(super) struct ChildBounds {
    center: Vec3,
    inverse_radius: f32,
    axis: Vec3,
    cos_spread: f32,
    sin_spread: f32,
    cos_reach: f32,
    intensity: f32,
    child: u32,
}

impl Node {
    pub const EMPTY: Self = Self { bounds: Bounds::EMPTY, first_node: NONE };

    /// Sets a child.
    pub fn set(&mut self, slot: usize, bounds: &LightBounds, child: u32) {
        self.bounds.set(slot, bounds, child);
        if child & LEAF == 0 {
            self.first_node = self.first_node.min(child);
        }
    }

    /// A node, or [`LEAF`] and a light.
    #[inline(always)]
    pub fn child(&self, slot: usize) -> u32 {
        self.bounds.child[slot]
    }

    /// How many children there are.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.bounds.child.iter().position(|&child| child == NONE).unwrap_or(WIDTH)
    }

    /// The first of the children that are nodes, one after the other, or none.
    #[inline(always)]
    pub fn first_node(&self) -> u32 {
        self.first_node
    }

    /// What is known of a child.
    #[inline(always)]
    pub fn bounds(&self, slot: usize) -> ChildBounds {
        self.bounds.get(slot)
    }

    /// What each child gives at a point: estimates of the irradiance, up to a common factor; zero only where none can
    /// arrive.
    #[inline(always)]
    pub fn importances(&self, point: ShadingPoint) -> [f32; WIDTH] {
        let mut importances = [0.0; WIDTH];
        self.bounds.weigh(
            |_| point,
            #[inline(always)]
            |i, importance, _| importances[i] = importance,
        );
        importances
    }

    /// Gives the importance of each child of two nodes to `set`, with its index (those of the second after those of the
    /// first) and whether it is a near node: one of which something arrives, and so near that one estimate for all of
    /// it is a poor one. A node alone would wait for one operation after another, and be half of a vector of AVX-512.
    #[inline(always)]
    pub fn weigh_two(nodes: [&Self; 2], [a, b]: [ShadingPoint; 2], set: impl FnMut(usize, f32, bool)) {
        // Not by an index, which would gather.
        Bounds::of_two(nodes.map(|node| &node.bounds)).weigh(
            #[inline(always)]
            |i| if i < WIDTH { a } else { b },
            set,
        );
    }
}

impl<const N: usize> Bounds<N> {
    const EMPTY: Self = Self {
        center: [[0.0; N]; 3],
        inverse_radius: [0.0; N],
        axis: [[0.0; N]; 3],
        cos_spread: [1.0; N],
        sin_spread: [0.0; N],
        cos_reach: [0.0; N],
        intensity: [0.0; N],
        child: [NONE; N],
    };

    fn set(&mut self, slot: usize, bounds: &LightBounds, child: u32) {
        let center = bounds.bounds.center();
        let reach = (bounds.bounds.max - center).max(center - bounds.bounds.min);
        let axis = bounds.cone.axis;
        for k in 0..3 {
            self.center[k][slot] = center[k];
            self.axis[k][slot] = axis[k];
        }
        // Widened by the rounding of the centre and of points near it.
        self.inverse_radius[slot] = 1.0 / (reach.length() + 4.0 * f32::EPSILON * center.abs().max_element());
        (self.sin_spread[slot], self.cos_spread[slot]) = bounds.cone.spread.sin_cos();
        self.cos_reach[slot] = bounds.cone.reach.cos() - SLACK;
        self.intensity[slot] = if bounds.two_sided { -bounds.intensity } else { bounds.intensity };
        self.child[slot] = child;
    }

    #[inline(always)]
    fn get(&self, slot: usize) -> ChildBounds {
        let vector = |rows: &[[f32; N]; 3]| Vec3::new(rows[0][slot], rows[1][slot], rows[2][slot]);
        ChildBounds {
            center: vector(&self.center),
            inverse_radius: self.inverse_radius[slot],
            axis: vector(&self.axis),
            cos_spread: self.cos_spread[slot],
            sin_spread: self.sin_spread[slot],
            cos_reach: self.cos_reach[slot],
            intensity: self.intensity[slot],
            child: self.child[slot],
        }
    }

    #[inline(always)]
    fn weigh(&self, point: impl Fn(usize) -> ShadingPoint, mut set: impl FnMut(usize, f32, bool)) {
        for i in 0..N {
            let (importance, is_near_node) = self.get(i).importance(point(i));
            set(i, importance, is_near_node);
        }
    }
}

impl Bounds<{ 2 * WIDTH }> {
    #[inline(always)]
    fn of_two([a, b]: [&Bounds<WIDTH>; 2]) -> Self {
        Self {
            center: [0, 1, 2].map(|k| both(a.center[k], b.center[k])),
            inverse_radius: both(a.inverse_radius, b.inverse_radius),
            axis: [0, 1, 2].map(|k| both(a.axis[k], b.axis[k])),
            cos_spread: both(a.cos_spread, b.cos_spread),
            sin_spread: both(a.sin_spread, b.sin_spread),
            cos_reach: both(a.cos_reach, b.cos_reach),
            intensity: both(a.intensity, b.intensity),
            child: both(a.child, b.child),
        }
    }
}

#[inline(always)]
fn both<T: Copy + Default>(a: [T; WIDTH], b: [T; WIDTH]) -> [T; 2 * WIDTH] {
    let mut both = [T::default(); 2 * WIDTH];
    both[..WIDTH].copy_from_slice(&a);
    both[WIDTH..].copy_from_slice(&b);
    both
}

impl ChildBounds {
    /// What the child gives, as [`Node::weigh_two`] has it; without branches.
    #[inline(always)]
    pub fn importance(&self, ShadingPoint { p, n }: ShadingPoint) -> (f32, bool) {
        let [x, y, z] = [self.center.x - p.x, self.center.y - p.y, self.center.z - p.z];
        let (inverse_radius, intensity) = (self.inverse_radius, self.intensity);
        let distance_squared = larger(x * x + y * y + z * z, f32::MIN_POSITIVE);
        let distance = distance_squared.sqrt();
        let inverse_distance = 1.0 / distance;

        // The sine of the angle that the child's bounding sphere fills; inside of it all angles do.
        let inverse_sin_bound = larger(distance * inverse_radius, 1.0);
        let sin_bound = 1.0 / inverse_sin_bound;
        // The mean of the cosine over that sphere, of which a part may be below the horizon.
        let mean = |cos: f32| {
            let above = larger(cos + sin_bound, 0.0);
            let partial = above * (above * inverse_sin_bound * (0.25 - 0.5 * LEAST_SHARE) + LEAST_SHARE);
            larger(if cos >= sin_bound { cos } else { partial }, LEAST_COSINE)
        };

        // The angle between emission and the nearest normal.
        let cos_axis = (x * self.axis.x + y * self.axis.y + z * self.axis.z) * -inverse_distance;
        let cos_axis = if intensity < 0.0 { cos_axis.abs() } else { cos_axis };
        let sin_axis = larger(1.0 - cos_axis * cos_axis, 0.0).sqrt();
        let cos_normal = cos_axis * self.cos_spread + sin_axis * self.sin_spread;
        let cos_normal = if cos_axis >= self.cos_spread { 1.0 } else { cos_normal };
        // An upper limit of cos(angle - bound) without roots: the bound's cosine lies between its square and 1.
        let nearest = smaller(larger(cos_normal, cos_normal * (1.0 - sin_bound * sin_bound)) + sin_bound, 1.0);
        let emission = if nearest < self.cos_reach { 0.0 } else { mean(cos_normal) };

        // The angle between arrival and the receiver's normal.
        let cos_arrival = (x * n.x + y * n.y + z * n.z) * inverse_distance;
        let cos_arrival = if n == Vec3::ZERO { 1.0 } else { cos_arrival };
        let arrival = if cos_arrival + sin_bound < -SLACK { 0.0 } else { mean(cos_arrival) };

        let inverse_radius_squared = inverse_radius * inverse_radius;
        let inverse_square = smaller(inverse_distance * inverse_distance, 2.0 * inverse_radius_squared);
        let importance = smaller(intensity.abs() * emission * arrival * inverse_square, LARGEST);
        let is_near = distance_squared * inverse_radius_squared < NEAR;
        (importance, is_near & (importance > 0.0) & (self.child & LEAF == 0))
    }
}

/// The larger number, without regard to NaN: one instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller number, without regard to NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
