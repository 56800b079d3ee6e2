//! Vertices on diffuse surfaces, shaded side by side: a row of numbers for each quantity, and loops over rows that the compiler turns into
//! vector code. They call the very functions that a vertex alone is shaded with, so the results are the same bit for bit.

use crate::bsdf::Lambert;
use crate::color::Rgb;
use crate::geometry::{SpawnPoint, SurfaceInteraction, TrianglePoints, interpolated_normal};
use crate::integrator::shading::faces;
use crate::integrator::vertex::Sides;
use crate::light::{LightSample, Receiver, ShadowTarget};
use crate::math::vectorize::{Kernel, vectorize};
use crate::math::{DVec3, Frame, Ray, Vec3};
use crate::sampling::{BATCH, power_heuristic};

/// One number for each vertex.
type Row<T = f32> = [T; BATCH];

#[derive(Clone)]
struct Vectors([Row; 3]);

impl Vectors {
    const ZERO: Self = Self([[0.0; BATCH]; 3]);

    #[inline(always)]
    fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    #[inline(always)]
    fn set(&mut self, i: usize, v: Vec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }

    #[inline(always)]
    fn rgb(&self, i: usize) -> Rgb {
        Rgb::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    #[inline(always)]
    fn set_rgb(&mut self, i: usize, v: Rgb) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.r, v.g, v.b);
    }
}

#[derive(Clone)]
struct Points([Row<f64>; 3]);

impl Points {
    const ZERO: Self = Self([[0.0; BATCH]; 3]);

    #[inline(always)]
    fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    #[inline(always)]
    fn set(&mut self, i: usize, v: DVec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }
}

/// What has become of a ray that a loop was to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// There is none.
    Nothing,
    /// It is there.
    Ray,
    /// The facet hides its direction, which the shading normal sees: to be found by the vertex alone.
    Hidden,
}

impl Found {
    const NOTHING: u32 = 0;
    const RAY: u32 = 1;
    const HIDDEN: u32 = 2;

    fn from(code: u32) -> Self {
        match code {
            Self::NOTHING => Self::Nothing,
            Self::RAY => Self::Ray,
            _ => Self::Hidden,
        }
    }

    #[inline(always)]
    fn code(is_ray: bool, hidden: bool) -> u32 {
        if is_ray {
            Self::RAY
        } else if hidden {
            Self::HIDDEN
        } else {
            Self::NOTHING
        }
    }
}

/// How roulette is played at this bounce.
#[derive(Clone, Copy)]
pub(super) enum Roulette {
    Not,
    ByThroughput,
}

/// Where light sampling ends.
const NO_LIGHT: u32 = 0;
const AT_POINT: u32 = 1;
const AT_INFINITY: u32 = 2;

/// Diffuse vertices side by side. Rows have meaningful numbers up to `count`; what has been filled in follows from the order of the
/// methods.
#[derive(Clone, Default)]
pub(super) struct Lanes {
    count: usize,
    rows: Rows,
    points: LongRows,
}

/// Rows of 32 bits. Those of 64 bits are apart: where all rows of a structure are alike, the compiler sees that they do not overlap.
#[derive(Clone)]
struct Rows {
    // The rays that arrive.
    origin: Vectors,
    direction: Vectors,
    // The triangles they meet.
    corners: [Vectors; 3],
    normals: [Vectors; 3],
    weights: [Row; 2],

    // Where that is.
    t: Row,
    error: Row,
    n_g: Vectors,
    n_s: Vectors,
    is_ahead: Row<u32>,
    /// The normal of the shading frame.
    n: Vectors,
    is_facing: Row<u32>,
    /// The side of `n` on which the ray arrives: 1 or -1.
    side: Row,

    // The path so far, and the surface.
    throughput: Vectors,
    eta_squared: Row,
    albedo: Vectors,

    // Light that was chosen.
    light_at: Row<u32>,
    light_is_delta: Row<u32>,
    light_direction: Vectors,
    light_radiance: Vectors,
    light_pdf: Row,
    target_n: Vectors,
    target_error: Row,
    shadow_found: Row<u32>,
    shadow_origin: Vectors,
    shadow_direction: Vectors,
    shadow_end: Row,
    contribution: Vectors,

    // The next direction.
    u: [Row; 3],
    next_found: Row<u32>,
    next_origin: Vectors,
    next_direction: Vectors,
    next_pdf: Row,
}

#[derive(Clone)]
struct LongRows {
    /// Where the vertices are.
    p: Points,
    /// The points of lights that were chosen.
    target_p: Points,
}

impl Default for Rows {
    fn default() -> Self {
        let (row, bits, vectors) = ([0.0; BATCH], [0; BATCH], Vectors::ZERO);
        let three = || [(); 3].map(|()| Vectors::ZERO);
        Self {
            origin: vectors.clone(),
            direction: vectors.clone(),
            corners: three(),
            normals: three(),
            weights: [row; 2],
            t: row,
            error: row,
            n_g: vectors.clone(),
            n_s: vectors.clone(),
            is_ahead: bits,
            n: vectors.clone(),
            is_facing: bits,
            side: row,
            throughput: vectors.clone(),
            eta_squared: row,
            albedo: vectors.clone(),
            light_at: bits,
            light_is_delta: bits,
            light_direction: vectors.clone(),
            light_radiance: vectors.clone(),
            light_pdf: row,
            target_n: vectors.clone(),
            target_error: row,
            shadow_found: bits,
            shadow_origin: vectors.clone(),
            shadow_direction: vectors.clone(),
            shadow_end: row,
            contribution: vectors.clone(),
            u: [row; 3],
            next_found: bits,
            next_origin: vectors.clone(),
            next_direction: vectors,
            next_pdf: row,
        }
    }
}

impl Default for LongRows {
    fn default() -> Self {
        Self { p: Points::ZERO, target_p: Points::ZERO }
    }
}

impl Lanes {
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// How many vertices there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A new vertex, of a path with this throughput and product of relative indices, on a surface of this albedo.
    #[inline(always)]
    fn push(&mut self, ray: &Ray, throughput: Rgb, eta_squared: f32, albedo: Rgb) -> usize {
        let lane = self.count;
        self.count += 1;
        self.rows.direction.set(lane, ray.direction);
        self.rows.throughput.set_rgb(lane, throughput);
        self.rows.eta_squared[lane] = eta_squared;
        self.rows.albedo.set_rgb(lane, albedo);
        (self.rows.light_at[lane], self.rows.shadow_found[lane]) = (NO_LIGHT, Found::NOTHING);
        lane
    }

    /// A vertex where `ray` meets a triangle, for [`place`](Self::place).
    #[inline(always)]
    pub fn push_triangle(
        &mut self,
        ray: &Ray,
        points: &TrianglePoints,
        smooth: Option<([Vec3; 3], [f32; 2])>,
        throughput: Rgb,
        eta_squared: f32,
        albedo: Rgb,
    ) -> usize {
        let lane = self.push(ray, throughput, eta_squared, albedo);
        self.rows.origin.set(lane, ray.origin);
        for (corner, p) in self.rows.corners.iter_mut().zip([points.a, points.b, points.c]) {
            corner.set(lane, p);
        }
        if let Some((normals, weights)) = smooth {
            for (row, n) in self.rows.normals.iter_mut().zip(normals) {
                row.set(lane, n);
            }
            (self.rows.weights[0][lane], self.rows.weights[1][lane]) = (weights[0], weights[1]);
        }
        lane
    }

    /// A vertex at a place that is known.
    pub fn push_known(&mut self, ray: &Ray, at: &SurfaceInteraction, throughput: Rgb, eta_squared: f32, albedo: Rgb) -> usize {
        let lane = self.push(ray, throughput, eta_squared, albedo);
        self.points.p.set(lane, at.p);
        (self.rows.t[lane], self.rows.error[lane]) = (at.t, at.error);
        self.rows.n_g.set(lane, at.n_g);
        self.rows.n_s.set(lane, at.n_s);
        lane
    }

    /// Finds where the triangles are met that have been pushed so far.
    pub fn place(&mut self, smooth: bool) {
        if smooth {
            vectorize(Place::<true>(self));
        } else {
            vectorize(Place::<false>(self));
        }
    }

    /// Whether a triangle is met at all.
    pub fn is_ahead(&self, lane: usize) -> bool {
        self.rows.is_ahead[lane] != 0
    }

    /// Finds the normals of the shading frames; `turn` makes those that are not the shading normal, of the direction back and the shading
    /// and the geometric normal.
    pub fn face(&mut self, smooth: bool, turn: impl Fn(Vec3, Vec3, Vec3) -> Vec3) {
        if smooth {
            vectorize(Face::<true>(self));
            for lane in 0..self.count {
                if self.rows.is_facing[lane] == 0 {
                    let back = -self.rows.direction.get(lane);
                    let n = turn(back, self.rows.n_s.get(lane), self.rows.n_g.get(lane));
                    self.rows.n.set(lane, n);
                    self.rows.side[lane] = 1f32.copysign(n.dot(back));
                }
            }
        } else {
            vectorize(Face::<false>(self));
        }
    }

    /// The point and the side of it that light must reach.
    #[inline(always)]
    pub fn receiver(&self, lane: usize) -> Receiver {
        Receiver { p: self.points.p.get(lane), n: self.rows.n.get(lane) * self.rows.side[lane] }
    }

    /// Distance along the ray that arrives.
    pub fn t(&self, lane: usize) -> f32 {
        self.rows.t[lane]
    }

    /// Lets a vertex look at light, chosen with this probability.
    #[inline(always)]
    pub fn set_light(&mut self, lane: usize, sample: &LightSample, pmf: f32) {
        self.rows.light_is_delta[lane] = u32::from(sample.is_delta);
        self.rows.light_direction.set(lane, sample.wi);
        self.rows.light_radiance.set_rgb(lane, sample.radiance);
        self.rows.light_pdf[lane] = sample.pdf * pmf;
        match &sample.target {
            ShadowTarget::Point(target) => {
                self.rows.light_at[lane] = AT_POINT;
                self.points.target_p.set(lane, target.p);
                self.rows.target_n.set(lane, target.n);
                self.rows.target_error[lane] = target.error;
            }
            ShadowTarget::Infinity => self.rows.light_at[lane] = AT_INFINITY,
        }
    }

    /// Finds the shadow rays and what they bring.
    pub fn illuminate(&mut self) {
        vectorize(Illuminate(self));
    }

    /// The shadow ray of a vertex; its time is that of the path.
    #[inline(always)]
    pub fn shadow_ray(&self, lane: usize) -> (Found, Ray) {
        let ray =
            Ray { t_max: self.rows.shadow_end[lane], ..Ray::new(self.rows.shadow_origin.get(lane), self.rows.shadow_direction.get(lane)) };
        (Found::from(self.rows.shadow_found[lane]), ray)
    }

    /// What the shadow ray brings.
    #[inline(always)]
    pub fn contribution(&self, lane: usize) -> Rgb {
        self.rows.contribution.rgb(lane)
    }

    /// Random numbers of a vertex: a direction (two) and roulette (one).
    #[inline(always)]
    pub fn set_numbers(&mut self, lane: usize, u: [f32; 3]) {
        for (row, u) in self.rows.u.iter_mut().zip(u) {
            row[lane] = u;
        }
    }

    /// Finds the rays that go on.
    pub fn scatter(&mut self, roulette: Roulette) {
        match roulette {
            Roulette::Not => vectorize(Scatter::<false>(self)),
            Roulette::ByThroughput => vectorize(Scatter::<true>(self)),
        }
    }

    /// The ray that goes on from a vertex; its time is that of the path.
    #[inline(always)]
    pub fn next_ray(&self, lane: usize) -> (Found, Ray) {
        (Found::from(self.rows.next_found[lane]), Ray::new(self.rows.next_origin.get(lane), self.rows.next_direction.get(lane)))
    }

    /// Density of the next direction.
    #[inline(always)]
    pub fn next_pdf(&self, lane: usize) -> f32 {
        self.rows.next_pdf[lane]
    }

    /// The path's throughput after scattering.
    #[inline(always)]
    pub fn throughput(&self, lane: usize) -> Rgb {
        self.rows.throughput.rgb(lane)
    }
}

/// Where rays start from a vertex.
#[inline(always)]
fn start(rows: &Rows, points: &LongRows, i: usize) -> SpawnPoint {
    SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] }
}

struct Place<'a, const SMOOTH: bool>(&'a mut Lanes);

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

struct Face<'a, const SMOOTH: bool>(&'a mut Lanes);

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

struct Illuminate<'a>(&'a mut Lanes);

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
        let eval = Lambert { albedo: rows.albedo.rgb(i) }.eval(wo, wi);
        let pdf = rows.light_pdf[i];
        let weight = if rows.light_is_delta[i] != 0 { 1.0 } else { power_heuristic(pdf, eval.pdf) };
        let contribution = rows.throughput.rgb(i) * eval.value * rows.light_radiance.rgb(i) * (weight / pdf);
        rows.contribution.set_rgb(i, contribution);
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

struct Scatter<'a, const ROULETTE: bool>(&'a mut Lanes);

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
        let lambert = Lambert { albedo: rows.albedo.rgb(i) };
        let sample = lambert.direction(wo, [rows.u[0][i], rows.u[1][i]]);
        let direction = frame.to_world(sample.wi);
        let sides = Sides::new([wo.z, sample.wi.z], [back.dot(n_g), direction.dot(n_g)]);

        let mut throughput = rows.throughput.rgb(i) * lambert.albedo;
        let mut goes_on = sample.is_valid;
        if ROULETTE {
            let survival = throughput.max_channel() * rows.eta_squared[i];
            let plays = survival < 1.0;
            goes_on &= !plays | (rows.u[2][i] < survival);
            throughput *= if plays { 1.0 / survival } else { 1.0 };
        }
        goes_on &= !throughput.is_black();
        rows.throughput.set_rgb(i, throughput);
        rows.next_pdf[i] = sample.pdf;
        let ray = start(rows, points, i).ray_along(direction);
        rows.next_origin.set(i, ray.origin);
        rows.next_direction.set(i, direction);
        rows.next_found[i] = Found::code(goes_on & sides.agree(), goes_on & sides.hidden());
    }
}
