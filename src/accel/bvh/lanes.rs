//! Eight boxes and four triangles at once: with AVX2 where available, and in plain Rust with the same results.

use std::arch::x86_64::{__m256d, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _CMP_NEQ_UQ};

use pulp::x86::V3;

use super::build::BLOCK;
use super::wide::{Block, WIDTH, WideNode};
use crate::accel::tree::SlabRay;
use crate::geometry::TriangleRay;

/// A [`SlabRay`] with the rows of a node that it meets first and last.
#[derive(Clone, Copy)]
pub(super) struct WideRay {
    slab: SlabRay,
    near: [usize; 3],
}

impl WideRay {
    #[inline(always)]
    pub fn new(slab: SlabRay) -> Self {
        let near = [0, 1, 2].map(|axis| 2 * axis + usize::from(slab.negative[axis]));
        Self { slab, near }
    }
}

/// Which triangles of a block are hit, where.
pub(super) struct BlockHits {
    pub mask: u32,
    pub t: [f64; BLOCK],
    pub u: [f64; BLOCK],
    pub v: [f64; BLOCK],
}

/// One instruction set.
pub(super) trait SimdIsa: Copy {
    /// The children that the ray may meet within `[t_min, t_max]` as bits, and where it enters each.
    fn enter(self, node: &WideNode, ray: &WideRay, t_min: f32, t_max: f32) -> (u32, [f32; WIDTH]);

    /// [`TriangleRay::intersect`] for each triangle, with the very same operations; `None` if no lane passes the edge
    /// tests.
    fn intersect(self, block: &Block, ray: &TriangleRay) -> Option<BlockHits>;
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
        let mask = (0..WIDTH).fold(0, |mask, i| mask | u32::from(enter[i] <= leave[i]) << i);
        (mask, enter)
    }

    #[inline(always)]
    fn intersect(self, block: &Block, ray: &TriangleRay) -> Option<BlockHits> {
        let mut hits = BlockHits { mask: 0, t: [0.0; BLOCK], u: [0.0; BLOCK], v: [0.0; BLOCK] };
        for lane in 0..BLOCK {
            let corner = |c: usize| {
                let at = |axis: usize| f64::from(block.corners[c][axis][lane]) - ray.origin[axis];
                let z = at(ray.kz);
                (at(ray.kx) - ray.sx * z, at(ray.ky) - ray.sy * z, z)
            };
            let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (corner(0), corner(1), corner(2));
            let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
            if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
                continue;
            }
            let determinant = u + v + w;
            let t = (u * az + v * bz + w * cz) / (determinant * ray.dz);
            let inside = determinant != 0.0 && ray.t_min <= t && t <= ray.t_max;
            hits.mask |= u32::from(inside) << lane;
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, v / determinant, w / determinant);
        }
        (hits.mask != 0).then_some(hits)
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
        let mask = x._mm256_movemask_ps(x._mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave));
        (mask as u32, pulp::cast(enter))
    }

    #[inline(always)]
    fn intersect(self, block: &Block, ray: &TriangleRay) -> Option<BlockHits> {
        let x = self.avx;
        let origin = [ray.kx, ray.ky, ray.kz].map(|axis| ray.origin[axis]);
        let a = Corner::new(self, &block.corners[0], ray, origin);
        let b = Corner::new(self, &block.corners[1], ray, origin);
        let c = Corner::new(self, &block.corners[2], ray, origin);
        let (u, v, w) = (c.cross(self, &b), a.cross(self, &c), b.cross(self, &a));
        let zero = x._mm256_setzero_pd();
        // Lanes with a NaN pass or not; they fail the test of the interval.
        let lowest = x._mm256_min_pd(u, x._mm256_min_pd(v, w));
        let highest = x._mm256_max_pd(u, x._mm256_max_pd(v, w));
        let outside =
            x._mm256_and_pd(x._mm256_cmp_pd::<_CMP_LT_OQ>(lowest, zero), x._mm256_cmp_pd::<_CMP_GT_OQ>(highest, zero));
        let candidates = !x._mm256_movemask_pd(outside) & 15;
        if candidates == 0 {
            return None;
        }
        let determinant = x._mm256_add_pd(x._mm256_add_pd(u, v), w);
        let sum =
            x._mm256_add_pd(x._mm256_add_pd(x._mm256_mul_pd(u, a.z), x._mm256_mul_pd(v, b.z)), x._mm256_mul_pd(w, c.z));
        let t = x._mm256_div_pd(sum, x._mm256_mul_pd(determinant, x._mm256_set1_pd(ray.dz)));
        let inside = x._mm256_and_pd(
            x._mm256_cmp_pd::<_CMP_LE_OQ>(x._mm256_set1_pd(ray.t_min), t),
            x._mm256_cmp_pd::<_CMP_LE_OQ>(t, x._mm256_set1_pd(ray.t_max)),
        );
        let regular = x._mm256_cmp_pd::<_CMP_NEQ_UQ>(determinant, zero);
        let mask = (candidates & x._mm256_movemask_pd(x._mm256_and_pd(inside, regular))) as u32;
        if mask == 0 {
            return None;
        }
        Some(BlockHits {
            mask,
            t: pulp::cast(t),
            u: pulp::cast(x._mm256_div_pd(v, determinant)),
            v: pulp::cast(x._mm256_div_pd(w, determinant)),
        })
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
    fn new(simd: V3, corner: &[[f32; BLOCK]; 3], ray: &TriangleRay, origin: [f64; 3]) -> Self {
        let s = simd.avx;
        let x = s._mm256_sub_pd(s._mm256_cvtps_pd(pulp::cast(corner[ray.kx])), s._mm256_set1_pd(origin[0]));
        let y = s._mm256_sub_pd(s._mm256_cvtps_pd(pulp::cast(corner[ray.ky])), s._mm256_set1_pd(origin[1]));
        let z = s._mm256_sub_pd(s._mm256_cvtps_pd(pulp::cast(corner[ray.kz])), s._mm256_set1_pd(origin[2]));
        Self {
            x: s._mm256_sub_pd(x, s._mm256_mul_pd(s._mm256_set1_pd(ray.sx), z)),
            y: s._mm256_sub_pd(y, s._mm256_mul_pd(s._mm256_set1_pd(ray.sy), z)),
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
