//! Vertices on diffuse surfaces, shaded side by side: a row of numbers for each quantity, and loops over rows that the compiler turns into
//! vector code. They call the very functions that a vertex alone is shaded with, so the results are the same bit for bit.

mod kernels;

use crate::color::Rgb;
use crate::geometry::{Hit, SurfaceInteraction, TrianglePoints};
use crate::light::{LightSample, Receiver, ShadowTarget};
use crate::math::rows::{BATCH, Points, Row, Vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Ray, Vec2, Vec3};
use kernels::{Face, Illuminate, Place, Scatter};

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
    roulette_scale: Row,
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
            roulette_scale: row,
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
    fn push(&mut self, ray: &Ray, throughput: Rgb, roulette_scale: f32, albedo: Rgb) -> usize {
        let lane = self.count;
        self.count += 1;
        self.rows.direction.set(lane, ray.direction);
        self.rows.throughput.set(lane, throughput.to_array().into());
        self.rows.roulette_scale[lane] = roulette_scale;
        self.rows.albedo.set(lane, albedo.to_array().into());
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
        roulette_scale: f32,
        albedo: Rgb,
    ) -> usize {
        let lane = self.push(ray, throughput, roulette_scale, albedo);
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
    pub fn push_known(&mut self, ray: &Ray, at: &SurfaceInteraction, throughput: Rgb, roulette_scale: f32, albedo: Rgb) -> usize {
        let lane = self.push(ray, throughput, roulette_scale, albedo);
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

    /// The place that was found for `hit` of a ray at this time, without parameters.
    pub fn interaction(&self, lane: usize, hit: &Hit, time: f32, smooth: bool) -> SurfaceInteraction {
        let n_g = self.rows.n_g.get(lane);
        SurfaceInteraction {
            p: self.points.p.get(lane),
            t: self.rows.t[lane],
            error: self.rows.error[lane],
            n_g,
            n_s: if smooth { self.rows.n_s.get(lane) } else { n_g },
            dp_du: Vec3::ZERO,
            uv: Vec2::ZERO,
            shape: hit.shape,
            prim: hit.prim,
            instance: hit.instance,
            time,
        }
    }

    /// The surface's albedo.
    pub fn albedo(&self, lane: usize) -> Rgb {
        rgb(&self.rows.albedo, lane)
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
        self.rows.light_radiance.set(lane, sample.radiance.to_array().into());
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
        rgb(&self.rows.contribution, lane)
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
        rgb(&self.rows.throughput, lane)
    }
}

#[inline(always)]
fn rgb(row: &Vectors, lane: usize) -> Rgb {
    Rgb::from(row.get(lane).to_array())
}
