//! What the intervals of `f32` decide is what `f64` finds.

use std::f64::consts::TAU;

use pulp::x86::{V3, V4};
use pulp::{Scalar, Simd, WithSimd};

use super::*;
use crate::accel::packet::lanes::{BoundingSphere, LaneSet, Packet};
use crate::geometry::{Disk, Frustum, Quad, SpawnPoint, Sphere};
use crate::math::rows::BATCH;
use crate::math::{DAffine3, Ray, RayRows, Rng, Transform, Vec3};

fn shapes() -> Vec<Analytic> {
    let quad = Quad::new(DVec3::new(0.3, -0.2, 0.1), DVec3::new(1.5, 0.2, 0.3), DVec3::new(-0.1, 0.8, 0.4));
    let mut shapes = vec![Analytic::Quad(quad.unwrap())];
    for phi_max in [2.0, 4.5, TAU, TAU] {
        shapes.push(Analytic::Sphere(Sphere::new(1.5, -1.5, 1.5, phi_max).unwrap()));
        shapes.push(Analytic::Sphere(Sphere::new(1.5, -0.6, 1.2, phi_max).unwrap()));
        shapes.push(Analytic::Disk(Disk::new(1.2, 0.0, phi_max).unwrap()));
        shapes.push(Analytic::Disk(Disk::new(1.2, 0.7, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::cylinder(0.8, 1.7, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::cylinder(0.03, 3.0, phi_max).unwrap()));
        shapes.push(Analytic::Frustum(Frustum::new(0.8, 0.2, 1.7, phi_max).unwrap()));
    }
    shapes
}

/// The shapes at all scales, turned, far from the origin, and stretched.
fn placed(rng: &mut Rng, shape: &Analytic) -> TransformedShape {
    let scale = 10f64.powf(rng.range(-6.0, 6.0));
    let stretch = match rng.below(3) {
        0 => DVec3::ONE,
        1 => DVec3::new(rng.range(0.3, 3.0), rng.range(0.3, 3.0), rng.range(0.3, 3.0)),
        _ => DVec3::new(1.0, 1.0, rng.magnitude(-3.0, 3.0)),
    };
    let turn = if rng.below(3) == 0 { DMat3::IDENTITY } else { rng.rotation() };
    let away = [0.0, 1.0, 10.0, 1e4][rng.below(4)];
    let linear = turn * DMat3::from_diagonal(stretch * scale);
    let place = DAffine3 { matrix3: linear, translation: rng.cube() * (away * scale) };
    TransformedShape::new(shape.clone(), Transform::new(place).unwrap())
}

/// Rays of all kinds at a shape: at its points and its rims, tangents, rays that leave it, and rays that end at it.
fn ray(rng: &mut Rng, placed: &TransformedShape, size: f64) -> Ray {
    let at = |rng: &mut Rng| placed.sample_area([rng.unit_f32(), rng.unit_f32()]);
    let on = at(rng);
    let point = SpawnPoint { p: on.p, n: on.n, error: placed.error() };
    let from = on.p + rng.direction() * size * rng.magnitude(-4.0, 0.5);
    let mut ray = match rng.below(8) {
        0 => point.ray_along(rng.direction().as_vec3()),
        1 => point.ray_along(rng.direction().as_vec3() * rng.magnitude(-3.0, 3.0) as f32),
        2 => {
            let other = at(rng);
            point.ray_to(&SpawnPoint { p: other.p, n: other.n, error: placed.error() })
        }
        3 => {
            let start = SpawnPoint { p: from, n: Vec3::Y, error: 0.0 };
            start.ray_to(&point)
        }
        4 => {
            // A tangent, up to some roundings.
            let along = on.n.as_dvec3().cross(rng.direction()).normalize_or(DVec3::X) * size;
            let beside = on.p + on.n.as_dvec3() * size * rng.range(-1.0, 1.0) * [0.0, 1e-7, 1e-5, 1e-3][rng.below(4)];
            Ray::new((beside - along * rng.range(0.0, 2.0)).as_vec3(), along.as_vec3())
        }
        5 => Ray::new(from.as_vec3(), [Vec3::X, -Vec3::Y, Vec3::Z][rng.below(3)]),
        6 => Ray::new(from.as_vec3(), rng.direction().as_vec3()),
        _ => Ray::new(from.as_vec3(), (on.p - from).as_vec3()),
    };
    if rng.below(4) == 0
        && let Some(hit) = placed.intersect(&ray)
    {
        let t = hit.t as f32;
        let near = [t, t.next_up(), t.next_down(), t * (1.0 + 1e-6), t * (1.0 - 1e-6), 2.0 * t];
        let end = near[rng.below(near.len())].max(0.0);
        *(if rng.below(2) == 0 { &mut ray.t_min } else { &mut ray.t_max }) = end;
    }
    ray
}

struct Decide<'a> {
    shape: &'a PacketShape<'a>,
    sphere: BoundingSphere,
    rays: &'a RayRows,
}

/// Of a ray, whether it is traced alone; and of the closest hit and any hit whether it certainly is one, whether it may
/// be one, and the limits of its distance.
type Decision = (bool, [(bool, bool, [f32; 2]); 2]);

impl WithSimd for Decide<'_> {
    type Output = Vec<Decision>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Decision> {
        let mut all = Vec::new();
        for first in (0..BATCH).step_by(S::F32_LANES) {
            let (packet, alone) = Packet::new(simd, &self.sphere, self.rays, first, BATCH - first);
            let lanes = packet.is_open(simd);
            let both = [
                self.shape.intersect::<S, false>(simd, &packet, lanes),
                self.shape.intersect::<S, true>(simd, &packet, lanes),
            ]
            .map(|hits| {
                let limits = [store(simd, hits.low), store(simd, hits.high)];
                (LaneSet::of(simd, hits.is_hit), LaneSet::of(simd, hits.may_hit), limits)
            });
            for lane in 0..S::F32_LANES {
                let of = both.map(|(hit, may, limits)| {
                    (hit.contains(lane), may.contains(lane), limits.map(|limits| limits[lane]))
                });
                all.push((alone.contains(lane), of));
            }
        }
        all
    }
}

#[test]
fn what_is_decided_in_f32_is_what_f64_finds() {
    let mut rng = Rng::new(51);
    let (mut decided, mut count) = (0, 0);
    for shape in shapes() {
        for _ in 0..if cfg!(miri) { 1 } else { 150 } {
            let placed = placed(&mut rng, &shape);
            let bounds = placed.bounds().padded();
            let packet_shape = PacketShape::new(&placed, 0, bounds);
            let radius = (0.5 * bounds.size()).length();
            let sphere = BoundingSphere { center: bounds.center(), radius: radius * [1.0, 30.0][rng.below(2)] };
            let rays: Vec<_> = (0..BATCH).map(|_| ray(&mut rng, &placed, f64::from(radius))).collect();
            let rows = RayRows::of(&rays);
            let decide = || Decide { shape: &packet_shape, sphere, rays: &rows };
            let decisions = decide().with_simd(Scalar::new());
            for (ray, (_, both)) in rays.iter().zip(&decisions).filter(|(_, (alone, _))| !alone) {
                let exact = placed.intersect(ray);
                for (any, &(is_hit, may_hit, [low, high])) in both.iter().enumerate() {
                    let is_right = match exact {
                        Some(_) if is_hit && any == 1 => true,
                        Some(hit) if is_hit => f64::from(low) <= hit.t && hit.t <= f64::from(high) && low >= ray.t_min,
                        Some(_) => may_hit,
                        None => !is_hit,
                    };
                    assert!(is_right, "{any} {placed:?} {ray:?} {exact:?} {is_hit} {may_hit} {low} {high}");
                    decided += usize::from(!may_hit);
                    count += 1;
                }
            }
            // Of rays that are traced alone nothing is used.
            let used = |decisions: &[Decision]| {
                let used: Vec<_> = decisions.iter().filter(|(alone, _)| !alone).collect();
                format!("{used:?}")
            };
            let expected = used(&decisions);
            if let Some(simd) = V3::try_new() {
                assert_eq!(used(&decide().with_simd(simd)), expected);
            }
            if let Some(simd) = V4::try_new() {
                assert_eq!(used(&decide().with_simd(simd)), expected);
            }
        }
    }
    assert!(3 * decided > count, "{decided} of {count}");
}
