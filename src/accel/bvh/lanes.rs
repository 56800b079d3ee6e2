//! Eight boxes and four triangles at once: with AVX2 where available, and in plain Rust with the same results.

use std::arch::x86_64::{__m256d, __m256i, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _CMP_NEQ_UQ, _CMP_NLE_UQ};

use pulp::x86::V3;

use super::build::BLOCK;
use super::wide::{Block, Child, Entry, WIDTH, WideNode};
use crate::accel::tree::SlabRay;
use crate::geometry::{Shear, TriangleHit, TriangleRay};
use crate::math::DVec3;
use crate::math::compact::ORDER_OF_8;

/// A [`SlabRay`] with the rows of a node that it meets first and last.
#[derive(Clone, Copy)]
pub(super) struct WideRay {
    slab: SlabRay,
    near: [usize; 3],
}

impl WideRay {
    #[inline(always)]
    pub fn new(slab: SlabRay) -> Self {
        let near = [0, 1, 2].map(|axis| 2 * axis + usize::from(slab.is_negative(axis)));
        Self { slab, near }
    }
}

/// Which triangles of a block are hit, where.
#[repr(align(32))]
pub(super) struct BlockHits {
    pub mask: u32,
    t: [f64; BLOCK],
    /// The edge functions of the second and third corner, and the sum of all three.
    edges: [[f64; BLOCK]; 3],
}

impl BlockHits {
    pub const NONE: Self = Self { mask: 0, t: [0.0; BLOCK], edges: [[0.0; BLOCK]; 3] };

    /// The hit on the triangle in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> TriangleHit {
        let [v, w, determinant] = [0, 1, 2].map(|i| self.edges[i][lane]);
        TriangleHit { t: self.t[lane] as f32, u: (v / determinant) as f32, v: (w / determinant) as f32 }
    }
}

/// One instruction set.
pub(super) trait SimdIsa: Copy {
    /// The children that the ray may meet within `[t_min, t_max]` as bits, and where it enters each: of others, the NaN
    /// whose bits are all set.
    fn enter(self, node: &WideNode, ray: &WideRay, t_min: f32, t_max: f32) -> (u32, [f32; WIDTH]);

    /// The children that are entered, in an order as [`WideNode::orders`] has them, then others; and how many are.
    fn ordered(self, enter: [f32; WIDTH], order: u32, children: &[Child; WIDTH]) -> ([Entry; WIDTH], u32);

    /// [`TriangleRay::intersect`] for each triangle, with the very same operations.
    fn intersect(self, block: &Block, ray: &TriangleRay) -> BlockHits;
}

/// Plain Rust.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl SimdIsa for Portable {
    #[inline(always)]
    fn enter(self, node: &WideNode, ray: &WideRay, t_min: f32, t_max: f32) -> (u32, [f32; WIDTH]) {
        let (mut enter, mut leave) = ([t_min; WIDTH], [t_max; WIDTH]);
        let slab = &ray.slab;
        for axis in 0..3 {
            let (near, far) = (&node.planes[ray.near[axis]], &node.planes[ray.near[axis] ^ 1]);
            for i in 0..WIDTH {
                let near = (near[i] - slab.near_origin[axis]) * slab.near_reciprocal[axis];
                let far = (far[i] - slab.far_origin[axis]) * slab.far_reciprocal[axis];
                enter[i] = if near > enter[i] { near } else { enter[i] };
                leave[i] = if far < leave[i] { far } else { leave[i] };
            }
        }
        let mut mask = 0;
        for i in 0..WIDTH {
            if enter[i] <= leave[i] {
                mask |= 1 << i;
            } else {
                enter[i] = f32::from_bits(u32::MAX);
            }
        }
        (mask, enter)
    }

    #[inline(always)]
    fn ordered(self, enter: [f32; WIDTH], order: u32, children: &[Child; WIDTH]) -> ([Entry; WIDTH], u32) {
        let (mut entries, mut count) = ([Entry::NONE; WIDTH], 0);
        for slot in (0..WIDTH).map(|i| order as usize >> (3 * i) & 7) {
            if enter[slot].is_sign_positive() {
                entries[count] = Entry::new(enter[slot], children[slot]);
                count += 1;
            }
        }
        (entries, count as u32)
    }

    #[inline(always)]
    fn intersect(self, block: &Block, ray: &TriangleRay) -> BlockHits {
        let mut hits = BlockHits::NONE;
        let (axes, shear) = (ray.axes(), &ray.shear);
        for lane in 0..BLOCK {
            let corner = |c: usize| DVec3::from(axes.map(|axis| f64::from(block.corners[c][axis][lane])));
            let edges = shear.edges([corner(0), corner(1), corner(2)]);
            if edges.is_outside() {
                continue;
            }
            let (determinant, t) = (edges.determinant(), edges.distance(shear.dz));
            let inside = determinant != 0.0 && ray.t_min <= t && t <= ray.t_max;
            hits.mask |= u32::from(inside) << lane;
            hits.t[lane] = t;
            for (row, value) in hits.edges.iter_mut().zip([edges.v, edges.w, determinant]) {
                row[lane] = value;
            }
        }
        hits
    }
}

/// AVX2, without fused multiply-add: that would round otherwise.
impl SimdIsa for V3 {
    #[inline(always)]
    fn enter(self, node: &WideNode, ray: &WideRay, t_min: f32, t_max: f32) -> (u32, [f32; WIDTH]) {
        let x = self.avx;
        let slab = &ray.slab;
        let mut enter = x._mm256_set1_ps(t_min);
        let mut leave = x._mm256_set1_ps(t_max);
        for axis in 0..3 {
            let near = pulp::cast(node.planes[ray.near[axis]]);
            let far = pulp::cast(node.planes[ray.near[axis] ^ 1]);
            let near = x._mm256_mul_ps(
                x._mm256_sub_ps(near, x._mm256_set1_ps(slab.near_origin[axis])),
                x._mm256_set1_ps(slab.near_reciprocal[axis]),
            );
            let far = x._mm256_mul_ps(
                x._mm256_sub_ps(far, x._mm256_set1_ps(slab.far_origin[axis])),
                x._mm256_set1_ps(slab.far_reciprocal[axis]),
            );
            // The second operand wins over a NaN.
            enter = x._mm256_max_ps(near, enter);
            leave = x._mm256_min_ps(far, leave);
        }
        let missed = x._mm256_cmp_ps::<_CMP_NLE_UQ>(enter, leave);
        (!x._mm256_movemask_ps(missed) as u32 & 255, pulp::cast(x._mm256_or_ps(enter, missed)))
    }

    #[inline(always)]
    fn ordered(self, enter: [f32; WIDTH], order: u32, children: &[Child; WIDTH]) -> ([Entry; WIDTH], u32) {
        let x = self.avx2;
        // A permutation looks at the lowest three bits.
        let shifts = pulp::cast([0, 3, 6, 9, 12, 15, 18, 21]);
        let order = x._mm256_srlv_epi32(self.avx._mm256_set1_epi32(order as i32), shifts);
        let in_order = x._mm256_permutevar8x32_ps(pulp::cast(enter), order);
        let mask = !self.avx._mm256_movemask_ps(in_order) as usize % 256;
        let chosen = x._mm256_cvtepu8_epi32(pulp::cast([ORDER_OF_8[mask], 0]));
        let distances: __m256i = pulp::cast(x._mm256_permutevar8x32_ps(in_order, chosen));
        let slots = x._mm256_permutevar8x32_epi32(order, chosen);
        let children = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| children[i].bits());
        let children = x._mm256_permutevar8x32_epi32(pulp::cast(children), slots);
        let low = x._mm256_unpacklo_epi32(distances, children);
        let high = x._mm256_unpackhi_epi32(distances, children);
        let halves: [u64; WIDTH] = pulp::cast([
            x._mm256_permute2x128_si256::<0x20>(low, high),
            x._mm256_permute2x128_si256::<0x31>(low, high),
        ]);
        ([0, 1, 2, 3, 4, 5, 6, 7].map(|i| Entry(halves[i])), mask.count_ones())
    }

    #[inline(always)]
    fn intersect(self, block: &Block, ray: &TriangleRay) -> BlockHits {
        let x = self.avx;
        let (axes, shear) = (ray.axes(), &ray.shear);
        let a = Corner::new(self, &block.corners[0], axes, shear);
        let b = Corner::new(self, &block.corners[1], axes, shear);
        let c = Corner::new(self, &block.corners[2], axes, shear);
        let (u, v, w) = (c.cross(self, &b), a.cross(self, &c), b.cross(self, &a));
        let zero = x._mm256_setzero_pd();
        // Lanes with a NaN pass or not; they fail the test of the interval.
        let lowest = x._mm256_min_pd(u, x._mm256_min_pd(v, w));
        let highest = x._mm256_max_pd(u, x._mm256_max_pd(v, w));
        let outside =
            x._mm256_and_pd(x._mm256_cmp_pd::<_CMP_LT_OQ>(lowest, zero), x._mm256_cmp_pd::<_CMP_GT_OQ>(highest, zero));
        let candidates = !x._mm256_movemask_pd(outside) & 15;
        let determinant = x._mm256_add_pd(x._mm256_add_pd(u, v), w);
        let sum =
            x._mm256_add_pd(x._mm256_add_pd(x._mm256_mul_pd(u, a.z), x._mm256_mul_pd(v, b.z)), x._mm256_mul_pd(w, c.z));
        let t = x._mm256_div_pd(sum, x._mm256_mul_pd(determinant, x._mm256_set1_pd(shear.dz)));
        let inside = x._mm256_and_pd(
            x._mm256_cmp_pd::<_CMP_LE_OQ>(x._mm256_set1_pd(ray.t_min), t),
            x._mm256_cmp_pd::<_CMP_LE_OQ>(t, x._mm256_set1_pd(ray.t_max)),
        );
        let regular = x._mm256_cmp_pd::<_CMP_NEQ_UQ>(determinant, zero);
        let mask = (candidates & x._mm256_movemask_pd(x._mm256_and_pd(inside, regular))) as u32;
        BlockHits { mask, t: pulp::cast(t), edges: pulp::cast([v, w, determinant]) }
    }
}

/// One corner of four triangles in the ray's sheared space.
#[derive(Clone, Copy)]
struct Corner {
    x: __m256d,
    y: __m256d,
    z: __m256d,
}

impl Corner {
    #[inline(always)]
    fn new(simd: V3, corner: &[[f32; BLOCK]; 3], axes: [usize; 3], shear: &Shear) -> Self {
        let s = simd.avx;
        let [x, y, z] = [0, 1, 2].map(|i| s._mm256_cvtps_pd(pulp::cast(corner[axes[i]])));
        let x = s._mm256_sub_pd(x, s._mm256_set1_pd(shear.origin.x));
        let y = s._mm256_sub_pd(y, s._mm256_set1_pd(shear.origin.y));
        let z = s._mm256_sub_pd(z, s._mm256_set1_pd(shear.origin.z));
        Self {
            x: s._mm256_sub_pd(x, s._mm256_mul_pd(s._mm256_set1_pd(shear.sx), z)),
            y: s._mm256_sub_pd(y, s._mm256_mul_pd(s._mm256_set1_pd(shear.sy), z)),
            z,
        }
    }

    /// `self.x other.y - self.y other.x`.
    #[inline(always)]
    fn cross(&self, simd: V3, other: &Self) -> __m256d {
        let s = simd.avx;
        s._mm256_sub_pd(s._mm256_mul_pd(self.x, other.y), s._mm256_mul_pd(self.y, other.x))
    }
}
