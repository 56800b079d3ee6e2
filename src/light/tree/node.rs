//! Nodes: bounds of eight children in lanes, and the estimate of what each gives at a point.

use super::NONE;
use crate::light::bounds::LightBounds;
use crate::math::Vec3;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Cosines this far beyond the limit still count as reached: `f32` bounds must not cut off what they hold.
const SLACK: f32 = 1e-3;

/// Least value of a cosine that is not cut off.
const LEAST_COSINE: f32 = 1e-3;

/// A group is near if its squared distance is below this many times its squared radius. On a room with 320 lights,
/// error times time is least between 1 and 3.
const NEAR: f32 = 2.0;

/// One number of each child.
type Lanes = [f32; WIDTH];

/// Bounds of eight children, side by side.
#[derive(Clone, Debug)]
pub(super) struct Node {
    center: [Lanes; 3],
    radius: Lanes,
    axis: [Lanes; 3],
    /// Cosine and sine of the normals' spread.
    cos_spread: Lanes,
    sin_spread: Lanes,
    /// Cosine of the reach of emission, less [`SLACK`].
    cos_reach: Lanes,
    /// Zero where there is no child. Negative for a child that emits both ways.
    intensity: Lanes,
    /// A node, or [`LEAF`](super::LEAF) and a light.
    child: [u32; WIDTH],
}

/// What the children of a node give at a point.
pub(super) struct Importances {
    /// Estimates of the irradiance, up to a common factor; zero only where none can arrive.
    pub of: [f32; WIDTH],
    /// A bit for each child that is so near that one estimate for all of it is a poor one.
    pub near: u32,
}

impl Node {
    pub const EMPTY: Self = Self {
        center: [[0.0; WIDTH]; 3],
        radius: [0.0; WIDTH],
        axis: [[0.0; WIDTH]; 3],
        cos_spread: [1.0; WIDTH],
        sin_spread: [0.0; WIDTH],
        cos_reach: [0.0; WIDTH],
        intensity: [0.0; WIDTH],
        child: [NONE; WIDTH],
    };

    /// Sets a child.
    pub fn set(&mut self, slot: usize, bounds: &LightBounds, child: u32) {
        let center = bounds.bounds.center();
        let reach = (bounds.bounds.max - center).max(center - bounds.bounds.min);
        let axis = bounds.cone.axis;
        for k in 0..3 {
            self.center[k][slot] = center[k];
            self.axis[k][slot] = axis[k];
        }
        // Widened by the rounding of the centre and of points near it.
        self.radius[slot] = reach.length() + 4.0 * f32::EPSILON * center.abs().max_element();
        (self.sin_spread[slot], self.cos_spread[slot]) = bounds.cone.spread.sin_cos();
        self.cos_reach[slot] = bounds.cone.reach.cos() - SLACK;
        self.intensity[slot] = if bounds.two_sided { -bounds.intensity } else { bounds.intensity };
        self.child[slot] = child;
    }

    /// A node, or [`LEAF`](super::LEAF) and a light.
    #[inline(always)]
    pub fn child(&self, slot: usize) -> u32 {
        self.child[slot]
    }

    /// What each child gives at `p` on a surface with the normal `n`, or (if that is zero) from any side.
    #[inline(always)]
    pub fn importances(&self, p: Vec3, n: Vec3) -> Importances {
        let (mut of, mut near) = ([0.0; WIDTH], [0; WIDTH]);
        let from_any_side = n == Vec3::ZERO;
        for i in 0..WIDTH {
            (of[i], near[i]) = self.importance(i, p, n, from_any_side);
        }
        Importances { of, near: (0..WIDTH).fold(0, |bits, i| bits | near[i] << i) }
    }

    /// Of one child, without branches.
    #[inline(always)]
    fn importance(&self, i: usize, p: Vec3, n: Vec3, from_any_side: bool) -> (f32, u32) {
        let [x, y, z] = [self.center[0][i] - p.x, self.center[1][i] - p.y, self.center[2][i] - p.z];
        let (radius, intensity) = (self.radius[i], self.intensity[i]);
        let distance_squared = larger(x * x + y * y + z * z, f32::MIN_POSITIVE);
        let inverse_distance = 1.0 / distance_squared.sqrt();

        // The sine of the angle that the child's bounding sphere fills; inside of it all angles do.
        let sin_bound = smaller(radius * inverse_distance, 1.0);
        let cos_squared_bound = 1.0 - sin_bound * sin_bound;
        // An upper limit of cos(angle - bound) without roots: the bound's cosine lies between its square and 1.
        let widened = |cos: f32| smaller(larger(cos, cos * cos_squared_bound) + sin_bound, 1.0);
        let kept = |cos: f32, limit: f32| if cos < limit { 0.0 } else { larger(cos, LEAST_COSINE) };

        // The angle between emission and the nearest normal.
        let cos_axis = (x * self.axis[0][i] + y * self.axis[1][i] + z * self.axis[2][i]) * -inverse_distance;
        let cos_axis = if intensity < 0.0 { cos_axis.abs() } else { cos_axis };
        let sin_axis = larger(1.0 - cos_axis * cos_axis, 0.0).sqrt();
        let cos_normal = cos_axis * self.cos_spread[i] + sin_axis * self.sin_spread[i];
        let cos_normal = if cos_axis >= self.cos_spread[i] { 1.0 } else { cos_normal };
        let emission = kept(widened(cos_normal), self.cos_reach[i]);

        // The angle between arrival and the receiver's normal.
        let cos_arrival = (x * n.x + y * n.y + z * n.z) * inverse_distance;
        let arrival = kept(widened(if from_any_side { 1.0 } else { cos_arrival }), -SLACK);

        let radius_squared = radius * radius;
        let near = u32::from(distance_squared < NEAR * radius_squared);
        (intensity.abs() * emission * arrival / larger(distance_squared, 0.5 * radius_squared), near)
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
