//! Nodes: bounds of eight children in lanes, and the estimate of what each gives at a point.

use super::NONE;
use crate::light::bounds::LightBounds;
use crate::math::{Vec3, Vec4};

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Cosines this far beyond the limit still count as reached: `f32` bounds must not cut off what they hold.
const SLACK: f32 = 1e-3;

/// Least value of a cosine that is not cut off.
const LEAST_COSINE: f32 = 1e-3;

/// A group is near if its squared distance is below this many times its squared radius. On a room with 320 lights, error times time is
/// least between 1 and 3.
const NEAR: f32 = 2.0;

/// One number of each child.
type Lanes = [Vec4; WIDTH / 4];

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
        center: [[Vec4::ZERO; WIDTH / 4]; 3],
        radius: [Vec4::ZERO; WIDTH / 4],
        axis: [[Vec4::ZERO; WIDTH / 4]; 3],
        cos_spread: [Vec4::ONE; WIDTH / 4],
        sin_spread: [Vec4::ZERO; WIDTH / 4],
        cos_reach: [Vec4::ZERO; WIDTH / 4],
        intensity: [Vec4::ZERO; WIDTH / 4],
        child: [NONE; WIDTH],
    };

    /// Sets a child.
    pub fn set(&mut self, slot: usize, bounds: &LightBounds, child: u32) {
        let (half, lane) = (slot / 4, slot % 4);
        let center = bounds.bounds.center();
        let reach = (bounds.bounds.max - center).max(center - bounds.bounds.min);
        let axis = bounds.cone.axis;
        for k in 0..3 {
            self.center[k][half][lane] = center[k];
            self.axis[k][half][lane] = axis[k];
        }
        // Widened by the rounding of the centre and of points near it.
        self.radius[half][lane] = reach.length() + 4.0 * f32::EPSILON * center.abs().max_element();
        (self.sin_spread[half][lane], self.cos_spread[half][lane]) = bounds.cone.spread.sin_cos();
        self.cos_reach[half][lane] = bounds.cone.reach.cos() - SLACK;
        self.intensity[half][lane] = if bounds.two_sided { -bounds.intensity } else { bounds.intensity };
        self.child[slot] = child;
    }

    /// A node, or [`LEAF`](super::LEAF) and a light.
    #[inline]
    pub fn child(&self, slot: usize) -> u32 {
        self.child[slot]
    }

    /// What each child gives at `p` on a surface with the normal `n`, or (if that is zero) from any side.
    #[inline]
    pub fn importances(&self, p: Vec3, n: Vec3) -> Importances {
        let mut out = Importances { of: [0.0; WIDTH], near: 0 };
        for half in 0..WIDTH / 4 {
            let (of, near) = self.half_importances(half, p, n);
            out.of[4 * half..][..4].copy_from_slice(&of.to_array());
            out.near |= near << (4 * half);
        }
        out
    }

    #[inline(always)]
    fn half_importances(&self, half: usize, p: Vec3, n: Vec3) -> (Vec4, u32) {
        let [x, y, z] = [0, 1, 2].map(|k| self.center[k][half] - p[k]);
        let (radius, intensity) = (self.radius[half], self.intensity[half]);
        let distance_squared = (x * x + y * y + z * z).max(Vec4::splat(f32::MIN_POSITIVE));
        let inverse_distance = sqrt(distance_squared).recip();

        // The sine of the angle that the child's bounding sphere fills; inside of it all angles do.
        let sin_bound = (radius * inverse_distance).min(Vec4::ONE);
        let cos_squared_bound = Vec4::ONE - sin_bound * sin_bound;
        // An upper limit of cos(angle - bound) without roots: the bound's cosine lies between its square and 1.
        let widened = |cos: Vec4| (cos.max(cos * cos_squared_bound) + sin_bound).min(Vec4::ONE);
        let kept = |cos: Vec4, limit: Vec4| Vec4::select(cos.cmplt(limit), Vec4::ZERO, cos.max(Vec4::splat(LEAST_COSINE)));

        // The angle between emission and the nearest normal.
        let [ax, ay, az] = self.axis.map(|axis| axis[half]);
        let cos_axis = (x * ax + y * ay + z * az) * -inverse_distance;
        let cos_axis = Vec4::select(intensity.cmplt(Vec4::ZERO), cos_axis.abs(), cos_axis);
        let sin_axis = sqrt((Vec4::ONE - cos_axis * cos_axis).max(Vec4::ZERO));
        let cos_normal = cos_axis * self.cos_spread[half] + sin_axis * self.sin_spread[half];
        let cos_normal = Vec4::select(cos_axis.cmpge(self.cos_spread[half]), Vec4::ONE, cos_normal);
        let emission = kept(widened(cos_normal), self.cos_reach[half]);

        // The angle between arrival and the receiver's normal.
        let cos_arrival = if n == Vec3::ZERO { Vec4::ONE } else { (x * n.x + y * n.y + z * n.z) * inverse_distance };
        let arrival = kept(widened(cos_arrival), Vec4::splat(-SLACK));

        let radius_squared = radius * radius;
        let near = distance_squared.cmplt(NEAR * radius_squared).bitmask();
        (intensity.abs() * emission * arrival / distance_squared.max(0.5 * radius_squared), near)
    }
}

/// Written so that the compiler takes four roots at once.
#[inline(always)]
fn sqrt(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(f32::sqrt))
}
