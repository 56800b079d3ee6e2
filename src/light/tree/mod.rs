//! A tree over lights that chooses one in proportion to what about arrives at a point (Conty Estevez and Kulla, "Importance Sampling of
//! Many Lights with Adaptive Tree Splitting"), with eight children a node: each choice compares eight bounds at once, the tree is a third
//! as deep as a binary one, and products of few estimates are better estimates.

mod build;
#[cfg(test)]
mod tests;

use super::bounds::LightBounds;
use crate::math::{DVec3, Vec3, Vec4};

/// Children of a node.
const WIDTH: usize = 8;

/// No child, no parent.
const NONE: u32 = u32::MAX;

/// Marks a child that is a light.
const LEAF: u32 = 1 << 31;

/// Cosines this far below the limit still count as reached: `f32` bounds must not cut off what they hold.
const SLACK: f32 = 1e-3;

/// Least value of a cosine that is not cut off.
const LEAST_COSINE: f32 = 1e-2;

/// Where light is to arrive.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point.
    pub p: DVec3,
    /// Unit normal of the side that light must reach; zero where it may come from either side.
    pub n: Vec3,
}

/// A light chosen by the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TreeChoice {
    /// Index of the light.
    pub light: u32,
    /// Probability of the choice.
    pub pmf: f32,
}

/// One number of each child.
type Lanes = [Vec4; WIDTH / 4];

/// Bounds of eight children, side by side.
#[derive(Clone, Debug)]
struct Node {
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
    /// A node, or [`LEAF`] and a light.
    child: [u32; WIDTH],
}

/// Place of a light or a node: which child of which node it is.
#[derive(Clone, Copy, Debug)]
struct Place {
    node: u32,
    slot: u32,
}

/// The tree.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// By node; the root's is [`NONE`].
    node_places: Vec<Place>,
    /// By light; [`NONE`] for those that are not in the tree.
    light_places: Vec<Place>,
}

impl Node {
    const EMPTY: Self = Self {
        center: [[Vec4::ZERO; 2]; 3],
        radius: [Vec4::ZERO; 2],
        axis: [[Vec4::ZERO; 2]; 3],
        cos_spread: [Vec4::ONE; 2],
        sin_spread: [Vec4::ZERO; 2],
        cos_reach: [Vec4::ZERO; 2],
        intensity: [Vec4::ZERO; 2],
        child: [NONE; WIDTH],
    };

    fn set(&mut self, slot: usize, bounds: &LightBounds, child: u32) {
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

    /// Estimates of the irradiance that each child gives at `p`, up to a common factor; zero only where none can arrive.
    #[inline]
    fn importances(&self, p: Vec3, n: Vec3) -> [f32; WIDTH] {
        let mut out = [0.0; WIDTH];
        for half in 0..WIDTH / 4 {
            out[4 * half..][..4].copy_from_slice(&self.half_importances(half, p, n).to_array());
        }
        out
    }

    #[inline(always)]
    fn half_importances(&self, half: usize, p: Vec3, n: Vec3) -> Vec4 {
        let [x, y, z] = [0, 1, 2].map(|k| self.center[k][half] - p[k]);
        let (radius, intensity) = (self.radius[half], self.intensity[half]);
        let distance_squared = (x * x + y * y + z * z).max(Vec4::splat(f32::MIN_POSITIVE));
        let inverse_distance = sqrt(distance_squared).recip();

        // The sine of the angle that the child's bounding sphere fills; inside of it all angles do.
        let sin_bound = (radius * inverse_distance).min(Vec4::ONE);
        let cos_squared_bound = Vec4::ONE - sin_bound * sin_bound;
        // An upper limit of cos(angle - bound) without roots: the bound's cosine lies between its square and 1.
        let widened = |cos: Vec4| (cos.max(cos * cos_squared_bound) + sin_bound).min(Vec4::ONE);

        // The angle between emission and the nearest normal.
        let [ax, ay, az] = self.axis.map(|axis| axis[half]);
        let cos_axis = (x * ax + y * ay + z * az) * -inverse_distance;
        let cos_axis = Vec4::select(intensity.cmplt(Vec4::ZERO), cos_axis.abs(), cos_axis);
        let sin_axis = sqrt((Vec4::ONE - cos_axis * cos_axis).max(Vec4::ZERO));
        let cos_normal = cos_axis * self.cos_spread[half] + sin_axis * self.sin_spread[half];
        let cos_normal = Vec4::select(cos_axis.cmpge(self.cos_spread[half]), Vec4::ONE, cos_normal);
        let cos_emission = widened(cos_normal);
        let emission = Vec4::select(cos_emission.cmplt(self.cos_reach[half]), Vec4::ZERO, cos_emission.max(Vec4::splat(LEAST_COSINE)));

        // The angle between arrival and the receiver's normal; without a normal the cosine is 0.
        let cos_arrival = (x * n.x + y * n.y + z * n.z) * inverse_distance;
        let cos_arrival = widened(cos_arrival);
        let cos_arrival = if n == Vec3::ZERO { Vec4::ONE } else { cos_arrival };
        let arrival = Vec4::select(cos_arrival.cmplt(Vec4::splat(-SLACK)), Vec4::ZERO, cos_arrival.max(Vec4::splat(LEAST_COSINE)));

        intensity.abs() * emission * arrival / distance_squared.max(0.5 * radius * radius)
    }
}

#[inline(always)]
fn sqrt(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(f32::sqrt))
}

impl LightTree {
    /// A light, `u` in `[0, 1)`; `None` where nothing arrives.
    #[inline]
    pub fn choose(&self, from: &Receiver, u: f64) -> Option<TreeChoice> {
        let (p, n) = (from.p.as_vec3(), from.n);
        let (mut u, mut pmf, mut node) = (u, 1.0, 0u32);
        loop {
            let current = &self.nodes[node as usize];
            let importances = current.importances(p, n);
            let total: f32 = importances.iter().sum();
            if !(total > 0.0 && total < f32::INFINITY) {
                return None;
            }
            let (slot, rest) = pick(&importances, u * f64::from(total))?;
            u = rest;
            pmf *= importances[slot] / total;
            let child = current.child[slot];
            if child & LEAF != 0 {
                return Some(TreeChoice { light: child & !LEAF, pmf });
            }
            node = child;
        }
    }

    /// The probability with which [`choose`](Self::choose) finds a light.
    #[inline]
    pub fn pmf(&self, from: &Receiver, light: u32) -> f32 {
        let (p, n) = (from.p.as_vec3(), from.n);
        let mut place = self.light_places[light as usize];
        if place.node == NONE {
            return 0.0;
        }
        let mut pmf = 1.0;
        while place.node != NONE {
            let importances = self.nodes[place.node as usize].importances(p, n);
            let total: f32 = importances.iter().sum();
            if !(total > 0.0 && total < f32::INFINITY) {
                return 0.0;
            }
            pmf *= importances[place.slot as usize] / total;
            place = self.node_places[place.node as usize];
        }
        pmf
    }
}

/// The entry in which `x` falls, from 0 to the sum of all, and where in it, in `[0, 1)`. Never an entry of zero.
#[inline]
fn pick(entries: &[f32; WIDTH], x: f64) -> Option<(usize, f64)> {
    let mut lower = 0.0;
    let mut found = None;
    for (i, &entry) in entries.iter().enumerate() {
        let entry = f64::from(entry);
        if entry > 0.0 && (found.is_none() || x >= lower) {
            found = Some((i, (x - lower) / entry));
        }
        lower += entry;
    }
    // Rounding of the sum may leave a little more than the last entry.
    found.map(|(i, within)| (i, within.clamp(0.0, 1.0 - f64::EPSILON)))
}
