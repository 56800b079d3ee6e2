//! Parallelograms: rectangles that are near are sampled by the solid angle they fill (Ureña, Fajardo, King, "An
//! Area-Preserving Parametrization for Spherical Rectangles"), all others by area and the irradiance from their
//! corners, bilinear in between.

use std::f32::consts::TAU;

use super::EmitterSample;
use crate::light::LightSampleContext;
use crate::math::float::F64_CHAIN_ERROR;
use crate::math::rows::soa;
use crate::math::{DVec3, Vec3, angle_of, sin_cos_turns};
use crate::sampling::{BilinearDensity, Piecewise2d};

soa! {
    /// A parallelogram in the world.
    pub(super) struct ParallelogramRows of Parallelogram {
        corner: DVec3,
        /// Unit vectors along the edges.
        axis_u: DVec3,
        axis_v: DVec3,
        length_u: f64,
        length_v: f64,
        /// Unit normal, towards the front.
        normal: DVec3,
        /// 1 over the area.
        pdf_area: f64,
        /// 1 for rectangles, which are sampled by solid angle where they are near, else 0.
        is_rectangle: f64,
    }
}

/// A parallelogram that emits.
#[derive(Clone, Debug)]
pub(super) struct ParallelogramEmitter {
    pub shape: Parallelogram,
    /// Bound on the error of the surface's position as an accelerator sees it.
    pub error: f32,
    /// Density over the edges by the brightness of a texture; half of the samples are chosen by it.
    pub texels: Option<Box<Piecewise2d>>,
}

/// A point of a parallelogram as seen from another point.
#[derive(Clone, Copy)]
pub(super) struct ParallelogramSample {
    /// The point.
    pub q: DVec3,
    /// Unit direction to it.
    pub wi: DVec3,
    /// Density per solid angle; 0 if nothing is seen from there.
    pub pdf: f64,
}

/// Cosine between edges up to which a parallelogram counts as a rectangle; densities are off by about as much.
const RIGHT_ANGLE: f64 = 1e-5;

/// Below this solid angle the parametrisation loses digits.
const MIN_SOLID_ANGLE: f64 = 1e-6;

/// Up to this ratio of the largest and the smallest squared distance, sampling by area is used: it costs less, and on a
/// coffee maker under three lamps the errors are the same from 4 to 100.
const FAR_RATIO: f64 = 16.0;

/// Least squared distance of a corner over about the largest, for densities by area.
const NEAREST: f32 = 1e-3;

/// Least cosine of arrival from a corner, for the same: where it is below the horizon, what is around may be above.
const LEAST_COSINE: f32 = 0.02;

/// The rectangle as seen from a point: coordinates of its sides along its edges, the distance of its plane, squared
/// distances of its corners.
struct View {
    x0: f64,
    x1: f64,
    y0: f64,
    y1: f64,
    height: f64,
    /// Squared distances of the corners (x0, y0), (x1, y0), (x1, y1) and (x0, y1).
    corners: [f64; 4],
}

impl Parallelogram {
    /// Whether `p` sees the front.
    #[inline(always)]
    fn sees_front(&self, p: DVec3) -> bool {
        self.normal.dot(p - self.corner) > 0.0
    }

    #[inline(always)]
    fn view(&self, p: DVec3) -> View {
        let d = self.corner - p;
        let (x0, y0) = (d.dot(self.axis_u), d.dot(self.axis_v));
        let (x1, y1, height) = (x0 + self.length_u, y0 + self.length_v, d.dot(self.normal).abs());
        let h2 = height * height;
        let corners = [
            product(x0, x0, y0, y0, h2),
            product(x1, x1, y0, y0, h2),
            product(x1, x1, y1, y1, h2),
            product(x0, x0, y1, y1, h2),
        ];
        View { x0, x1, y0, y1, height, corners }
    }

    /// The point at distances from the corner along the edges.
    #[inline(always)]
    fn point(&self, along_u: f64, along_v: f64) -> DVec3 {
        self.corner + self.axis_u * along_u + self.axis_v * along_v
    }

    /// A point as seen from elsewhere, by area and the irradiance from the corners, on emitters that are `two_sided` or
    /// not, and whether it is to be sampled by solid angle instead. Without branches, as the next, for loops over many
    /// vertices.
    #[inline(always)]
    pub fn sample_by_area(
        &self,
        from: &LightSampleContext,
        u: [f32; 2],
        two_sided: bool,
    ) -> (ParallelogramSample, bool) {
        let p = from.p;
        let view = self.view(p);
        let density = self.irradiance(&view, from);
        let [x, y] = density.sample(u);
        let q = self.point(f64::from(x) * self.length_u, f64::from(y) * self.length_v);
        let toward = q - p;
        let distance_squared = toward.length_squared();
        let distance = distance_squared.sqrt();
        let pdf_area = self.pdf_area * f64::from(density.density([x, y]));
        let pdf = pdf_area * distance_squared * distance / self.normal.dot(toward).abs();
        let is_seen = !view.is_edge_on(self.corner) & (two_sided | self.sees_front(p));
        // A NaN, where both points are one, is no sample either.
        let is_valid = is_seen & (pdf > 0.0) & (pdf < f64::from(f32::MAX));
        let sample = ParallelogramSample { q, wi: toward * (1.0 / distance), pdf: if is_valid { pdf } else { 0.0 } };
        (sample, is_seen & (self.is_rectangle != 0.0) & view.is_near())
    }

    /// A point by solid angle as seen from `p`, of a rectangle of which something is seen from there, or `otherwise` if
    /// the solid angle is too small.
    #[inline(always)]
    pub fn sample_by_solid_angle(&self, p: DVec3, u: [f32; 2], otherwise: &ParallelogramSample) -> ParallelogramSample {
        let view = self.view(p);
        let solid_angle = view.solid_angle();
        let [x, y] = view.sample(solid_angle, u);
        let q = self.point(x - view.x0, y - view.y0);
        let toward = q - p;
        let wi = toward * (1.0 / toward.length());
        let sample = ParallelogramSample { q, wi, pdf: 1.0 / solid_angle };
        if solid_angle > MIN_SOLID_ANGLE { sample } else { *otherwise }
    }

    /// The irradiance that each corner gives, up to a common factor.
    #[inline(always)]
    fn irradiance(&self, view: &View, from: &LightSampleContext) -> BilinearDensity {
        let n = from.n.as_dvec3();
        let height = n.dot(self.corner - from.p);
        let (rise_u, rise_v) = (n.dot(self.axis_u) * self.length_u, n.dot(self.axis_v) * self.length_v);
        let heights = [height, height + rise_u, height + rise_u + rise_v, height + rise_v];
        // At least the largest distance, at most twice it.
        let scale = 1.0 / (view.height + view.reach());
        let from_any_side = from.n == Vec3::ZERO;
        let (mut arriving, mut fourth_powers) = ([0.0; 4], [0.0; 4]);
        for i in 0..4 {
            let square = ((view.corners[i] * scale) * scale) as f32;
            let square = if square > NEAREST { square } else { NEAREST };
            // Distance times cosine.
            let height = (heights[i] * scale) as f32;
            let height = if height > LEAST_COSINE * square { height } else { LEAST_COSINE * square };
            arriving[i] = if from_any_side { square } else { height };
            fourth_powers[i] = square * square;
        }
        // The cosine of emission is a common height over the distance. One fraction over the product of all four.
        let [a, b, c, d] = fourth_powers;
        let (ab, cd) = (a * b, c * d);
        let corners = [arriving[0] * b * cd, arriving[1] * a * cd, arriving[2] * ab * d, arriving[3] * ab * c];
        BilinearDensity { corners }
    }

    /// Density per solid angle with which `sample` finds the point `q`.
    #[inline]
    fn pdf(&self, from: &LightSampleContext, q: DVec3) -> f32 {
        let p = from.p;
        let view = self.view(p);
        if view.is_edge_on(self.corner) {
            return 0.0;
        }
        if self.is_rectangle != 0.0 && view.is_near() {
            let solid_angle = view.solid_angle();
            if solid_angle > MIN_SOLID_ANGLE {
                return (1.0 / solid_angle) as f32;
            }
        }
        let density = self.irradiance(&view, from).density(self.uv(q));
        EmitterSample::pdf_from_area(p, q, self.normal, self.pdf_area * f64::from(density))
    }

    /// Shares of the edges at the point `q` of the surface, in `[0, 1]`.
    #[inline]
    fn uv(&self, q: DVec3) -> [f32; 2] {
        let Self { corner, axis_u, axis_v, length_u, length_v, .. } = *self;
        // With non-perpendicular edges, each coordinate is the area opposite to it.
        let d = q - corner;
        let whole = axis_u.cross(axis_v);
        let (u, v) = (d.cross(axis_v).dot(whole), axis_u.cross(d).dot(whole));
        let scale = 1.0 / whole.length_squared();
        [u * scale / length_u, v * scale / length_v].map(|share| (share as f32).clamp(0.0, 1.0))
    }
}

impl ParallelogramEmitter {
    /// From a corner, two edges and a vector on the front side; `None` if there is no area.
    pub fn new(corner: DVec3, edges: [DVec3; 2], front: DVec3, error: f32) -> Option<Self> {
        let [edge_u, edge_v] = edges;
        let cross = edge_u.cross(edge_v);
        let area = cross.length();
        let (length_u, length_v) = (edge_u.length(), edge_v.length());
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let normal = cross / area;
        let is_rectangle = edge_u.dot(edge_v).abs() <= RIGHT_ANGLE * length_u * length_v;
        let shape = Parallelogram {
            corner,
            axis_u: edge_u / length_u,
            axis_v: edge_v / length_v,
            length_u,
            length_v,
            normal: if normal.dot(front) < 0.0 { -normal } else { normal },
            pdf_area: 1.0 / area,
            is_rectangle: f64::from(u8::from(is_rectangle)),
        };
        Some(Self { shape, error, texels: None })
    }

    pub fn area(&self) -> f64 {
        1.0 / self.shape.pdf_area
    }

    /// Unit normal, towards the front.
    pub fn normal(&self) -> Vec3 {
        self.shape.normal.as_vec3()
    }

    /// A point as seen from elsewhere, whatever the texture; `None` if nothing is seen from there.
    pub fn sample(&self, from: &LightSampleContext, u: [f32; 2], two_sided: bool) -> Option<EmitterSample> {
        let (mut sample, by_solid_angle) = self.shape.sample_by_area(from, u, two_sided);
        if by_solid_angle {
            sample = self.shape.sample_by_solid_angle(from.p, u, &sample);
        }
        let ParallelogramSample { q, wi, pdf } = sample;
        (pdf > 0.0).then(|| EmitterSample { p: q, n: self.normal(), wi: wi.as_vec3(), pdf: pdf as f32 })
    }

    /// A point chosen by the brightness of its texel in half of the cases, by what is seen of the surface in the
    /// others.
    pub fn sample_textured(&self, from: &LightSampleContext, u: [f32; 2], two_sided: bool) -> Option<EmitterSample> {
        let Some(texels) = &self.texels else { return self.sample(from, u, two_sided) };
        let p = from.p;
        let shape = &self.shape;
        if !two_sided && !shape.sees_front(p) {
            return None;
        }
        let mut sample = if u[0] < 0.5 {
            self.sample(from, [2.0 * u[0], u[1]], two_sided)?
        } else {
            let [x, y] = texels.sample([2.0 * u[0] - 1.0, u[1]]).uv;
            let q = shape.point(f64::from(x) * shape.length_u, f64::from(y) * shape.length_v);
            EmitterSample::from_area(p, q, shape.normal, shape.pdf_area)?
        };
        sample.pdf = self.pdf(from, sample.p);
        (sample.pdf > 0.0).then_some(sample)
    }

    /// Density per solid angle with which `sample` finds the point `q`.
    #[inline]
    pub fn pdf(&self, from: &LightSampleContext, q: DVec3) -> f32 {
        let by_size = self.shape.pdf(from, q);
        let Some(texels) = &self.texels else { return by_size };
        let by_texel = f64::from(texels.pdf(self.shape.uv(q))) * self.shape.pdf_area;
        0.5 * (by_size + EmitterSample::pdf_from_area(from.p, q, self.shape.normal, by_texel))
    }
}

/// Product of two vectors to the plane, by coordinates and the squared distance of the plane.
#[inline(always)]
fn product(xa: f64, xb: f64, ya: f64, yb: f64, h2: f64) -> f64 {
    xa * xb + ya * yb + h2
}

impl View {
    /// Distances in the plane to the farthest side along both edges, added.
    #[inline(always)]
    fn reach(&self) -> f64 {
        self.x1.max(-self.x0) + self.y1.max(-self.y0)
    }

    /// Whether the point is in the plane, within the rounding of itself and of the rectangle, whose corner is `corner`:
    /// the surface does not shine on itself, and nothing is seen of it from there.
    #[inline(always)]
    fn is_edge_on(&self, corner: DVec3) -> bool {
        self.height <= F64_CHAIN_ERROR * (self.reach() + corner.abs().max_element())
    }

    /// Solid angle of the rectangle, to `f32` precision at any size: Van Oosterom and Strackee's formula for both of
    /// its triangles, whose half-angles add up as the arguments of complex numbers, so that nothing cancels.
    #[inline(always)]
    fn solid_angle(&self) -> f64 {
        let View { x0, x1, y0, y1, height, corners } = *self;
        let h2 = height * height;
        let [l00, l10, l11, l01] = [corners[0].sqrt(), corners[1].sqrt(), corners[2].sqrt(), corners[3].sqrt()];
        // Both triangles have the same volume with the point; they share the diagonal from 00 to 11.
        let volume = height * (x1 - x0) * (y1 - y0);
        let diagonal = product(x0, x1, y0, y1, h2);
        let lower =
            l00 * l10 * l11 + product(x0, x1, y0, y0, h2) * l11 + diagonal * l10 + product(x1, x1, y0, y1, h2) * l00;
        let upper =
            l00 * l11 * l01 + diagonal * l01 + product(x0, x0, y0, y1, h2) * l11 + product(x1, x0, y1, y1, h2) * l00;
        let imaginary = volume * (lower + upper);
        let real = lower * upper - volume * volume;
        // Scaled into the range of f32.
        let scale = 1.0 / imaginary.abs().max(real.abs());
        2.0 * f64::from(angle_of((imaginary * scale) as f32, (real * scale) as f32))
    }

    /// Whether the rectangle is near enough to be sampled by solid angle.
    #[inline(always)]
    fn is_near(&self) -> bool {
        // Along each axis the rectangle reaches from 0 or the nearer side to the farther side.
        let (near_x, near_y) = (self.x0.max(-self.x1).max(0.0), self.y0.max(-self.y1).max(0.0));
        let nearest = near_x * near_x + near_y * near_y + self.height * self.height;
        let [a, b, c, d] = self.corners;
        a.max(b).max(c.max(d)) >= FAR_RATIO * nearest
    }

    /// A point distributed uniformly by solid angle.
    #[inline(always)]
    fn sample(&self, solid_angle: f64, u: [f32; 2]) -> [f64; 2] {
        let View { x0, x1, y0, y1, height, corners } = *self;
        let h2 = height * height;
        let (l00, l01) = (corners[0].sqrt(), corners[3].sqrt());

        // Cosines of the side planes' normals with the plane's normal; the sines are the height times the reciprocals.
        let (r_x0, r_y0, r_y1) =
            (1.0 / (x0 * x0 + h2).sqrt(), 1.0 / (y0 * y0 + h2).sqrt(), 1.0 / (y1 * y1 + h2).sqrt());
        let (b_x0, b_y0, b_y1) = (x0 * r_x0, y0 * r_y0, y1 * r_y1);

        // The inner angles at the corners (x0, y1) and (x0, y0), between the planes of the sides that meet there.
        let (cos_2, cos_3) = (b_y1 * b_x0, -b_x0 * b_y0);
        let (sin_2, sin_3) = (height * l01 * r_y1 * r_x0, height * l00 * r_x0 * r_y0);
        // k = 2 pi minus both.
        let cos_k = cos_2 * cos_3 - sin_2 * sin_3;
        let sin_k = -(sin_2 * cos_3 + cos_2 * sin_3);

        // The angle a = k + u S, by half-angles so that small ones keep their digits.
        let (s, c) = sin_cos_turns(u[0] * solid_angle as f32 * (0.5 / TAU));
        let (s, c) = (f64::from(s), f64::from(c));
        let norm = 1.5 - 0.5 * (s * s + c * c);
        let (s, c) = (s * norm, c * norm);
        let (sin_u, cos_u) = (2.0 * s * c, 1.0 - 2.0 * s * s);
        let cos_a = cos_k * cos_u - sin_k * sin_u;
        let sin_a = sin_k * cos_u + cos_k * sin_u;

        // x: the side plane that cuts off the solid angle u S. Its cosine is 1 / sqrt(f² + b²).
        let f = (-cos_a * b_y0 - b_y1) / sin_a;
        let s_y0 = height * r_y0;
        let excess = f * f - s_y0 * s_y0;
        let x = if excess > 0.0 { (height / excess.sqrt()).copysign(f) } else { f64::INFINITY.copysign(f) };
        let x = x.max(x0).min(x1);

        // y: uniform in the sine of the elevation. In f32: it rounds the choice of the point, not the point.
        let (d2, y0, y1) = ((x * x + h2) as f32, y0 as f32, y1 as f32);
        let (lower, upper) = (y0 / (d2 + y0 * y0).sqrt(), y1 / (d2 + y1 * y1).sqrt());
        let sine = lower + u[1] * (upper - lower);
        let y = f64::from(sine * (d2 / ((1.0 - sine) * (1.0 + sine))).sqrt());
        // A NaN (the sine is 1) takes the limit too.
        [x, if y < self.y1 { y.max(self.y0) } else { self.y1 }]
    }
}
