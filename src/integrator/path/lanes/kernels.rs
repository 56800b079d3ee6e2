//! The loops over rows.
//!
//! Rows of 32 and of 64 bits come as separate parameters: the compiler then knows that they do not overlap.

use super::{AT_POINT, Found, Lanes, LongRows, NO_LIGHT, Rows, rgb};
use crate::bsdf::Lambert;
use crate::geometry::{SpawnPoint, TrianglePoints, interpolated_normal};
use crate::integrator::shading::faces;
use crate::integrator::vertex::Sides;
use crate::math::rows::BATCH;
use crate::math::vectorize::Kernel;
use crate::math::{Frame, Vec3};
use crate::sampling::power_heuristic;

/// Where rays start from a vertex.
#[inline(always)]
fn start(rows: &Rows, points: &LongRows, i: usize) -> SpawnPoint {
    SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] }
}

pub(super) struct Place<'a, const SMOOTH: bool>(pub &'a mut Lanes);

impl<const SMOOTH: bool> Kernel for Place<'_, SMOOTH> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lanes { count, rows, points } = self.0;
        place::<SMOOTH>(rows, points, *count);
    }
}

#[inline(always)]
fn place<const SMOOTH: bool>(rows: &mut Rows, points: &mut LongRows, count: usize) {
    for i in 0..count.min(BATCH) {
        let [a, b, c] = &rows.corners;
        let place = TrianglePoints { a: a.get(i), b: b.get(i), c: c.get(i) }.place(rows.origin.get(i), rows.direction.get(i));
        points.p.set(i, place.p);
        rows.t[i] = place.t as f32;
        rows.error[i] = place.error;
        rows.is_ahead[i] = u32::from(place.is_ahead());
        rows.n_g.set(i, place.n_g);
        if SMOOTH {
            let [a, b, c] = &rows.normals;
            let weights = [rows.weights[0][i], rows.weights[1][i]];
            let n_s = interpolated_normal([a.get(i), b.get(i), c.get(i)], weights, place.n_g).0;
            rows.n_s.set(i, n_s);
        }
    }
}

pub(super) struct Face<'a, const SMOOTH: bool>(pub &'a mut Lanes);

impl<const SMOOTH: bool> Kernel for Face<'_, SMOOTH> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lanes { count, rows, .. } = self.0;
        face::<SMOOTH>(rows, *count);
    }
}

#[inline(always)]
fn face<const SMOOTH: bool>(rows: &mut Rows, count: usize) {
    for i in 0..count.min(BATCH) {
        let (back, n_g) = (-rows.direction.get(i), rows.n_g.get(i));
        let n = if SMOOTH { rows.n_s.get(i) } else { n_g };
        if SMOOTH {
            rows.is_facing[i] = u32::from(faces(back, n, n_g));
        }
        rows.n.set(i, n);
        rows.side[i] = 1f32.copysign(n.dot(back));
    }
}

pub(super) struct Illuminate<'a>(pub &'a mut Lanes);

impl Kernel for Illuminate<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lanes { count, rows, points } = self.0;
        illuminate(rows, points, *count);
    }
}

#[inline(always)]
fn illuminate(rows: &mut Rows, points: &mut LongRows, count: usize) {
    for i in 0..count.min(BATCH) {
        let (back, n_g, direction) = (-rows.direction.get(i), rows.n_g.get(i), rows.light_direction.get(i));
        let frame = Frame::from_normal(rows.n.get(i));
        let (wo, wi) = (frame.to_local(back), frame.to_local(direction));
        let sides = Sides::new([wo.z, wi.z], [back.dot(n_g), direction.dot(n_g)]);
        let eval = Lambert { albedo: rgb(&rows.albedo, i) }.eval(wo, wi);
        let pdf = rows.light_pdf[i];
        let weight = if rows.light_is_delta[i] != 0 { 1.0 } else { power_heuristic(pdf, eval.pdf) };
        let contribution = rgb(&rows.throughput, i) * eval.value * rgb(&rows.light_radiance, i) * (weight / pdf);
        rows.contribution.set(i, contribution.to_array().into());
        let is_lit = rows.light_at[i] != NO_LIGHT;
        rows.shadow_found[i] = Found::code(is_lit & sides.agree() & !contribution.is_black(), is_lit & sides.hidden());

        let start = start(rows, points, i);
        let target = SpawnPoint { p: points.target_p.get(i), n: rows.target_n.get(i), error: rows.target_error[i] };
        let (near, far) = (start.ray_to(&target), start.ray_along(direction));
        let is_near = rows.light_at[i] == AT_POINT;
        let choose = |a: Vec3, b: Vec3| {
            let choose = |a: f32, b: f32| if is_near { a } else { b };
            Vec3::new(choose(a.x, b.x), choose(a.y, b.y), choose(a.z, b.z))
        };
        rows.shadow_origin.set(i, choose(near.origin, far.origin));
        rows.shadow_direction.set(i, choose(near.direction, far.direction));
        rows.shadow_end[i] = if is_near { near.t_max } else { far.t_max };
    }
}

pub(super) struct Scatter<'a, const ROULETTE: bool>(pub &'a mut Lanes);

impl<const ROULETTE: bool> Kernel for Scatter<'_, ROULETTE> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lanes { count, rows, points } = self.0;
        scatter::<ROULETTE>(rows, points, *count);
    }
}

#[inline(always)]
fn scatter<const ROULETTE: bool>(rows: &mut Rows, points: &mut LongRows, count: usize) {
    for i in 0..count.min(BATCH) {
        let (back, n_g) = (-rows.direction.get(i), rows.n_g.get(i));
        let frame = Frame::from_normal(rows.n.get(i));
        let wo = frame.to_local(back);
        let lambert = Lambert { albedo: rgb(&rows.albedo, i) };
        let sample = lambert.direction(wo, [rows.u[0][i], rows.u[1][i]]);
        let direction = frame.to_world(sample.wi);
        let sides = Sides::new([wo.z, sample.wi.z], [back.dot(n_g), direction.dot(n_g)]);

        let mut throughput = rgb(&rows.throughput, i) * lambert.albedo;
        let mut goes_on = sample.is_valid;
        if ROULETTE {
            let survival = throughput.max_channel() * rows.roulette_scale[i];
            let plays = survival < 1.0;
            goes_on &= !plays | (rows.u[2][i] < survival);
            throughput *= if plays { 1.0 / survival } else { 1.0 };
        }
        goes_on &= !throughput.is_black();
        rows.throughput.set(i, throughput.to_array().into());
        rows.next_pdf[i] = sample.pdf;
        let ray = start(rows, points, i).ray_along(direction);
        rows.next_origin.set(i, ray.origin);
        rows.next_direction.set(i, direction);
        rows.next_found[i] = Found::code(goes_on & sides.agree(), goes_on & sides.hidden());
    }
}
