//! A ray's way through a grid of blocks over the unit cube.

use crate::math::{DAffine3, DVec3, Ray, Vec3};

/// The part of a ray within the unit cube.
#[derive(Clone, Copy, Debug)]
pub struct UnitRay {
    /// Where it enters.
    pub origin: Vec3,
    /// By unit of `t`.
    pub direction: Vec3,
    /// Where it leaves, from where it enters.
    pub end: f32,
    /// The parameter of the ray where it enters.
    pub start: f32,
    /// The length of the ray's own direction.
    pub length: f32,
}

impl UnitRay {
    /// Of `ray` by this map; `None` where it misses.
    pub fn new(ray: &Ray, unit_from_render: &DAffine3) -> Option<Self> {
        let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
        let direction = unit_from_render.transform_vector3(ray.direction.as_dvec3());
        let origin = unit_from_render.transform_point3(ray.origin.as_dvec3()) + direction * t_min;
        let (mut enter, mut leave) = (0.0, t_max - t_min);
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            let (a, b) = (-o / d, (1.0 - o) / d);
            if d != 0.0 {
                enter = a.min(b).max(enter);
                leave = a.max(b).min(leave);
            } else if !(0.0..=1.0).contains(&o) {
                return None;
            }
        }
        let crosses = enter < leave && leave < f64::INFINITY;
        crosses.then(|| Self {
            origin: (origin + direction * enter).clamp(DVec3::ZERO, DVec3::ONE).as_vec3(),
            direction: direction.as_vec3(),
            end: (leave - enter) as f32,
            start: (t_min + enter) as f32,
            length: ray.direction.length(),
        })
    }

    /// The point at `t` from where it enters.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// The part of a ray within one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSegment {
    /// The block, by z, then y, then x.
    pub block: usize,
    /// Where it begins and ends, from where the ray enters the cube.
    pub t: [f32; 2],
}

/// The blocks along a ray, one after the other (Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray
/// Tracing").
#[derive(Clone, Debug)]
pub struct BlockWalk {
    blocks: [usize; 3],
    cell: [usize; 3],
    /// Where the next block begins along each axis, and how far apart these are.
    next: Vec3,
    delta: Vec3,
    is_backward: [bool; 3],
    t: f32,
    end: f32,
}

impl BlockWalk {
    /// Along `ray`, with so many blocks along each axis.
    #[inline]
    pub fn new(ray: &UnitRay, blocks: [usize; 3]) -> Self {
        let (mut cell, mut is_backward) = ([0; 3], [false; 3]);
        let (mut next, mut delta) = (Vec3::INFINITY, Vec3::INFINITY);
        for axis in 0..3 {
            let (n, o, d) = (blocks[axis] as f32, ray.origin[axis], ray.direction[axis]);
            cell[axis] = ((o * n) as usize).min(blocks[axis] - 1);
            is_backward[axis] = d < 0.0;
            if d != 0.0 {
                let edge = cell[axis] + usize::from(d > 0.0);
                next[axis] = (edge as f32 / n - o) / d;
                delta[axis] = 1.0 / (n * d.abs());
            }
        }
        Self { blocks, cell, next, delta, is_backward, t: 0.0, end: ray.end }
    }
}

impl Iterator for BlockWalk {
    type Item = BlockSegment;

    #[inline]
    fn next(&mut self) -> Option<BlockSegment> {
        if self.t >= self.end {
            return None;
        }
        let Vec3 { x, y, z } = self.next;
        let axis = if x <= y && x <= z { 0 } else { 1 + usize::from(z < y) };
        let end = self.next[axis].min(self.end).max(self.t);
        let block = (self.cell[2] * self.blocks[1] + self.cell[1]) * self.blocks[0] + self.cell[0];
        let segment = BlockSegment { block, t: [self.t, end] };
        self.t = end;
        self.next[axis] += self.delta[axis];
        let is_last = if self.is_backward[axis] {
            self.cell[axis] == 0
        } else {
            self.cell[axis] += 1;
            self.cell[axis] >= self.blocks[axis]
        };
        if self.is_backward[axis] && !is_last {
            self.cell[axis] -= 1;
        }
        if is_last {
            self.t = f32::INFINITY;
        }
        Some(segment)
    }
}

#[cfg(test)]
mod tests {
    use super::super::voxels::block_box;
    use super::*;
    use crate::math::{Rng, vec3};

    fn ray(origin: Vec3, direction: Vec3) -> Option<UnitRay> {
        UnitRay::new(&Ray::new(origin, direction), &DAffine3::IDENTITY)
    }

    #[test]
    fn blocks_follow_each_other_and_contain_the_ray() {
        let mut rng = Rng::new(5);
        let blocks = [3, 1, 6];
        let mut found = 0;
        for i in 0..20_000 {
            let origin = (rng.cube() * 2.0).as_vec3();
            let mut direction = rng.direction().as_vec3() * 3.0;
            if i % 5 == 0 {
                direction[i / 5 % 3] = 0.0;
            }
            let Some(ray) = ray(origin, direction) else { continue };
            found += 1;
            let mut t = 0.0;
            for segment in BlockWalk::new(&ray, blocks) {
                assert_eq!(segment.t[0], t);
                t = segment.t[1];
                let [min, max] = block_box(segment.block, blocks);
                let middle = ray.at(0.5 * (segment.t[0] + t));
                assert!((middle.clamp(min, max) - middle).abs().max_element() < 1e-5, "{middle} {min} {max}");
            }
            assert!((ray.end - t).abs() < 1e-5 * ray.end + 1e-6, "{ray:?} {t}");
        }
        assert!(found > 500, "{found}");
    }

    #[test]
    fn the_way_in_and_out_is_that_of_the_cube() {
        let hit = ray(vec3(-2.0, 0.5, 0.25), vec3(2.0, 0.0, 0.0)).unwrap();
        assert_eq!((hit.start, hit.end, hit.origin), (1.0, 0.5, vec3(0.0, 0.5, 0.25)));
        assert!(ray(vec3(-2.0, 1.5, 0.25), vec3(2.0, 0.0, 0.0)).is_none());
        assert!(ray(vec3(2.0, 0.5, 0.25), vec3(2.0, 0.0, 0.0)).is_none());
        let short = Ray { t_min: 0.25, t_max: 0.5, ..Ray::new(vec3(0.5, 0.5, 0.0), Vec3::Z) };
        let inside = UnitRay::new(&short, &DAffine3::IDENTITY).unwrap();
        assert_eq!((inside.start, inside.end, inside.origin.z), (0.25, 0.25, 0.25));
        let nan = Ray::new(vec3(f32::NAN, 0.0, 0.0), Vec3::X);
        assert!(UnitRay::new(&nan, &DAffine3::IDENTITY).is_none_or(|ray| BlockWalk::new(&ray, [2; 3]).count() < 9));
    }
}
