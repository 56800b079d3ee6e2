//! What shapes should answer: their exact surfaces, met by rays in arithmetic of about 106 bits.

use std::f64::consts::TAU;

use twofloat::TwoFloat;

use super::geometry::Rng;
use crate::geometry::{Analytic, Disk, Frustum, Profile, Quad, Revolution, ShapeSample, Sphere};
use crate::math::{DMat3, DVec3, Ray, Transform, dvec3};

/// The quotient. That of the crate is good to 53 bits only: it computes a residual without a fused multiply-add. One
/// step of Newton's method gives the rest.
pub fn quotient(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let first = a / b;
    first + (a - first * b) / b.hi()
}

/// The square root; zero of a negative number.
pub fn root(a: TwoFloat) -> TwoFloat {
    if a.hi() <= 0.0 {
        return TwoFloat::from(0.0);
    }
    let first = a.sqrt();
    first + (a - first * first) / (2.0 * first.hi())
}

/// Nearest `f64`.
pub fn value(a: TwoFloat) -> f64 {
    a.hi() + a.lo()
}

/// A point or a vector.
pub type Vector = [TwoFloat; 3];

fn exactly(v: DVec3) -> Vector {
    v.to_array().map(TwoFloat::from)
}

fn plus(a: Vector, b: Vector, factor: TwoFloat) -> Vector {
    std::array::from_fn(|i| a[i] + b[i] * factor)
}

fn dot(a: Vector, b: Vector) -> TwoFloat {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

fn rounded(v: Vector) -> DVec3 {
    DVec3::from_array(v.map(value))
}

/// An affine map with its exact inverse.
pub struct ExactTransform {
    columns: [Vector; 3],
    translation: Vector,
    determinant: TwoFloat,
}

impl ExactTransform {
    /// The map of a transform's numbers.
    pub fn new(transform: &Transform) -> Self {
        let m = &transform.world_from_object;
        let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(exactly);
        Self {
            columns,
            translation: exactly(m.translation),
            determinant: dot(columns[0], cross(columns[1], columns[2])),
        }
    }

    /// A vector from world to object, by Cramer's rule.
    pub fn inverse_vector(&self, v: Vector) -> Vector {
        std::array::from_fn(|i| {
            let normal = cross(self.columns[(i + 1) % 3], self.columns[(i + 2) % 3]);
            quotient(dot(normal, v), self.determinant)
        })
    }

    /// Origin and direction of a ray in object space.
    pub fn inverse_ray(&self, ray: &Ray) -> [Vector; 2] {
        let origin = plus(exactly(ray.origin.as_dvec3()), self.translation, TwoFloat::from(-1.0));
        [self.inverse_vector(origin), self.inverse_vector(exactly(ray.direction.as_dvec3()))]
    }
}

/// The oracle's result for a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// It meets nothing.
    Miss,
    /// It meets the surface here.
    Hit {
        /// Distance in units of the ray's direction.
        t: f64,
        /// The point in the world.
        p: DVec3,
    },
    /// It passes an edge or a silhouette so closely that the digits of `f64` cannot decide.
    Undecidable,
}

/// The surface of a shape.
#[derive(Clone, Copy, Debug)]
enum Surface {
    /// `round (x² + y²) + z_squared z² + z_linear z + constant = 0` between two heights.
    Quadric { round: f64, z_squared: f64, z_linear: f64, constant: f64, z_min: f64, z_max: f64 },
    /// `z = 0` between two radii.
    Ring { inner: f64, outer: f64 },
    /// The rectangle `[0, x] × [0, y]` of `z = 0`.
    Rectangle { x: f64, y: f64 },
}

/// A shape, and the same surface by an equation with exact coefficients.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name of the shape.
    pub name: &'static str,
    /// The shape.
    pub shape: Analytic,
    /// A bound of its coordinates.
    pub size: f64,
    /// From the shape's own axes to those of the equation.
    pub axes: DMat3,
    surface: Surface,
    phi_max: f64,
}

const VALID: &str = "the checks' shapes are valid";

impl Case {
    /// A sphere or a part of it.
    pub fn sphere(name: &'static str, radius: f64, [z_min, z_max]: [f64; 2], phi_max: f64) -> Self {
        let shape = Analytic::Sphere(Sphere::new(radius, z_min, z_max, phi_max).expect(VALID));
        // A sphere is not cut at its poles.
        let widen = |z: f64| if z.abs() == radius { 2.0 * z } else { z };
        let (z_min, z_max) = (widen(z_min), widen(z_max));
        let surface =
            Surface::Quadric { round: 1.0, z_squared: 1.0, z_linear: 0.0, constant: -radius * radius, z_min, z_max };
        Self { name, shape, size: radius, axes: DMat3::IDENTITY, surface, phi_max }
    }

    /// A cylinder, cone or frustum. The products of its measures must be exact.
    pub fn frustum(name: &'static str, [bottom, top]: [f64; 2], height: f64, phi_max: f64) -> Self {
        let shape = Analytic::Frustum(Frustum::new(bottom, top, height, phi_max).expect(VALID));
        let spread = top - bottom;
        let surface = Surface::Quadric {
            round: height * height,
            z_squared: -spread * spread,
            z_linear: -2.0 * bottom * height * spread,
            constant: -bottom * bottom * height * height,
            z_min: 0.0,
            z_max: height,
        };
        Self { name, shape, size: bottom.max(top).max(height), axes: DMat3::IDENTITY, surface, phi_max }
    }

    /// A frustum as a turned line: a cubic about y with its parameter proportional to length.
    pub fn turned_line(name: &'static str, [bottom, top]: [f64; 2], height: f64) -> Self {
        let point = |i: i32| [bottom + (top - bottom) * f64::from(i) / 3.0, height * f64::from(i) / 3.0];
        let profile = Profile::bezier(&[point(0), point(1), point(2), point(3)]).expect(VALID);
        let shape = Analytic::Revolution(Revolution::new(&profile, TAU).expect(VALID));
        Self {
            shape,
            axes: DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X),
            ..Self::frustum(name, [bottom, top], height, TAU)
        }
    }

    /// A disk, a ring or a sector.
    pub fn ring(name: &'static str, [inner, outer]: [f64; 2], phi_max: f64) -> Self {
        let shape = Analytic::Disk(Disk::new(outer, inner, phi_max).expect(VALID));
        Self { name, shape, size: outer, axes: DMat3::IDENTITY, surface: Surface::Ring { inner, outer }, phi_max }
    }

    /// A rectangle.
    pub fn rectangle(name: &'static str, x: f64, y: f64) -> Self {
        let shape = Analytic::Quad(Quad::new(DVec3::ZERO, x * DVec3::X, y * DVec3::Y).expect(VALID));
        Self { name, shape, size: x.max(y), axes: DMat3::IDENTITY, surface: Surface::Rectangle { x, y }, phi_max: TAU }
    }

    /// The angle of the part that is kept.
    pub fn phi_max(&self) -> f64 {
        self.phi_max
    }

    /// Whether a point lies on the inner side of the whole surface; never of a flat one.
    pub fn is_inside(&self, p: DVec3) -> bool {
        match self.surface {
            Surface::Quadric { round, z_squared, z_linear, constant, .. } => {
                round * (p.x * p.x + p.y * p.y) + (z_squared * p.z + z_linear) * p.z + constant < 0.0
            }
            _ => false,
        }
    }

    /// Whether silhouettes can be grazed.
    pub fn is_flat(&self) -> bool {
        !matches!(self.surface, Surface::Quadric { .. })
    }

    /// The point at surface parameters as the shapes' documentation has them, which may leave `[0, 1]` a little.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let (sin, cos) = (u * self.phi_max).sin_cos();
        let around = |rho: f64, z: f64| dvec3(rho * cos, rho * sin, z);
        match (self.surface, &self.shape) {
            (Surface::Quadric { .. }, Analytic::Frustum(frustum)) => {
                let [bottom, top] = frustum.radii();
                around(bottom + (top - bottom) * v, frustum.height() * v)
            }
            (Surface::Quadric { z_min, z_max, .. }, _) => {
                let theta = |z: f64| (z / self.size).clamp(-1.0, 1.0).acos();
                let (sin, cos) = (theta(z_min) + (theta(z_max) - theta(z_min)) * v).sin_cos();
                around(self.size * sin, self.size * cos)
            }
            (Surface::Ring { inner, outer }, _) => around(inner + (outer - inner) * v, 0.0),
            (Surface::Rectangle { x, y }, _) => dvec3(x * u, y * v, 0.0),
        }
    }

    /// A random point of the surface, in the axes of the equation.
    pub fn sample(&self, rng: &mut Rng) -> ShapeSample {
        let sample = self.shape.sample([rng.unit(), rng.unit()]);
        ShapeSample { p: self.axes * sample.p, n: self.axes * sample.n, ..sample }
    }

    /// A point across an edge of the surface, if it has one: inside by `depth`, in units of the parameter.
    pub fn near_edge(&self, rng: &mut Rng, depth: f64) -> Option<DVec3> {
        // An apex is no edge.
        let has_apex = matches!(&self.shape, Analytic::Frustum(frustum) if frustum.radii()[1] == 0.0);
        let across = if has_apex || rng.unit() < 0.5 { depth } else { 1.0 - depth };
        let has_ends = match self.surface {
            Surface::Quadric { z_min, z_max, .. } => self.size >= z_max.max(-z_min),
            _ => true,
        };
        let has_sides = self.phi_max < TAU || matches!(self.surface, Surface::Rectangle { .. });
        match (has_ends, has_sides, rng.unit() < 0.5) {
            (true, true, true) | (true, false, _) => Some(self.point(rng.unit(), across)),
            (true, true, false) | (false, true, _) => Some(self.point(across, rng.unit())),
            (false, false, _) => None,
        }
    }

    /// A point beside the silhouette as seen along `d`, inside by `depth`; `None` if there is none at a height chosen
    /// at random.
    pub fn near_silhouette(&self, rng: &mut Rng, d: DVec3, depth: f64) -> Option<DVec3> {
        let target = self.sample(rng);
        let (rho, n_z) = (target.p.x.hypot(target.p.y), target.n.z);
        let (n_rho, d_rho) = ((1.0 - n_z * n_z).sqrt(), d.x.hypot(d.y));
        let cos = -n_z * d.z / (n_rho * d_rho);
        if self.is_flat() || cos.is_nan() || cos.abs() > 1.0 {
            return None;
        }
        let (sin, cos) = (d.y.atan2(d.x) + cos.acos()).sin_cos();
        Some(dvec3(rho * cos, rho * sin, target.p.z) - dvec3(n_rho * cos, n_rho * sin, n_z) * depth)
    }

    /// Distances at which the whole surface is met, in ascending order; `None` if that cannot be decided.
    fn roots(&self, o: Vector, d: Vector, margin: f64) -> Option<Vec<TwoFloat>> {
        let Surface::Quadric { round, z_squared, z_linear, constant, .. } = self.surface else {
            return Some(if d[2].hi() == 0.0 { Vec::new() } else { vec![quotient(-o[2], d[2])] });
        };
        let a = (d[0] * d[0] + d[1] * d[1]) * round + d[2] * d[2] * z_squared;
        let b = (o[0] * d[0] + o[1] * d[1]) * round + o[2] * d[2] * z_squared + d[2] * (0.5 * z_linear);
        let c = (o[0] * o[0] + o[1] * o[1]) * round + o[2] * o[2] * z_squared + o[2] * z_linear + constant;
        let discriminant = b * b - a * c;
        // As the shape sees it, from the point of the ray closest to it.
        let scale = round * round * dot(d, d).hi() * self.size * self.size;
        if discriminant.hi().abs() < margin * scale {
            return None;
        }
        if discriminant.hi() < 0.0 {
            return Some(Vec::new());
        }
        // Without cancellation: a may be next to nothing.
        let q = if b.hi() >= 0.0 { -b - root(discriminant) } else { root(discriminant) - b };
        let mut roots = vec![quotient(c, q)];
        if a.hi() != 0.0 {
            roots.push(quotient(q, a));
        }
        roots.sort_by(|x, y| x.hi().total_cmp(&y.hi()));
        Some(roots)
    }

    /// How far inside its edges a point of the surface is, relative to its size.
    fn clearance(&self, p: DVec3) -> f64 {
        let size = self.size;
        let (rho, phi) = (p.x.hypot(p.y), p.y.atan2(p.x).rem_euclid(TAU));
        let ends = match self.surface {
            Surface::Quadric { z_min, z_max, .. } => (p.z - z_min).min(z_max - p.z),
            Surface::Ring { inner, outer } => (outer - rho).min(if inner > 0.0 { rho - inner } else { f64::INFINITY }),
            Surface::Rectangle { x, y } => p.x.min(x - p.x).min(p.y).min(y - p.y),
        };
        if self.phi_max >= TAU || matches!(self.surface, Surface::Rectangle { .. }) {
            return ends / size;
        }
        let side = if phi <= self.phi_max { phi.min(self.phi_max - phi) } else { -(phi - self.phi_max).min(TAU - phi) };
        (ends / size).min(side * (rho / size).min(1.0))
    }

    /// What a ray meets first after `t = 0`. Undecidable are rays that pass an edge or a silhouette closer than
    /// `margin`, relative to the size.
    pub fn answer(&self, transform: &ExactTransform, ray: &Ray, margin: f64) -> Answer {
        let [o, d] = transform.inverse_ray(ray);
        let Some(roots) = self.roots(o, d, margin) else { return Answer::Undecidable };
        let length = dot(d, d).hi().sqrt();
        for t in roots {
            let ahead = t.hi() * length / self.size;
            let clearance = self.clearance(rounded(plus(o, d, t))).min(ahead);
            if clearance.abs() < margin {
                return Answer::Undecidable;
            }
            if clearance > 0.0 {
                let p = plus(exactly(ray.origin.as_dvec3()), exactly(ray.direction.as_dvec3()), t);
                return Answer::Hit { t: value(t), p: rounded(p) };
            }
        }
        Answer::Miss
    }
}

/// Spheres, cones and flat shapes that are whole.
pub fn whole_cases() -> Vec<Case> {
    vec![
        Case::sphere("sphere", 1.0, [-1.0, 1.0], TAU),
        Case::frustum("cylinder", [1.0, 1.0], 2.0, TAU),
        Case::frustum("cone", [1.0, 0.0], 2.0, TAU),
        Case::frustum("frustum", [0.5, 1.25], 0.75, TAU),
        Case::ring("disk", [0.0, 1.0], TAU),
        Case::ring("ring", [0.25, 1.0], 4.0),
        Case::rectangle("quad", 2.0, 1.5),
    ]
}

/// Frusta as turned lines.
pub fn line_cases() -> Vec<Case> {
    vec![
        Case::turned_line("cylinder as a turned line", [1.0, 1.0], 2.0),
        Case::turned_line("cone as a turned line", [1.0, 0.0], 2.0),
        Case::turned_line("frustum as a turned line", [0.5, 1.25], 0.75),
    ]
}

/// The same shapes cut by heights and angles.
pub fn partial_cases() -> Vec<Case> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let mut cases = Vec::new();
    for phi_max in [0.7, FRAC_PI_2, 2.5, PI, 4.0, 5.5] {
        cases.push(Case::sphere("sphere", 1.0, [-0.5, 0.75], phi_max));
        cases.push(Case::sphere("sphere", 1.0, [0.25, 1.0], phi_max));
        cases.push(Case::frustum("cylinder", [1.0, 1.0], 2.0, phi_max));
        cases.push(Case::frustum("cone", [1.0, 0.0], 1.5, phi_max));
        cases.push(Case::frustum("frustum", [0.25, 1.0], 1.0, phi_max));
        cases.push(Case::ring("ring", [0.25, 1.0], phi_max));
    }
    cases
}

#[cfg(test)]
mod tests {
    use dashu_float::FBig;
    use dashu_float::round::mode::HalfEven;

    use super::*;

    type Big = FBig<HalfEven, 2>;

    fn big(a: TwoFloat) -> Big {
        let part = |x: f64| Big::try_from(x).unwrap().with_precision(256).value();
        part(a.hi()) + part(a.lo())
    }

    fn relative_error(found: TwoFloat, exact: &Big) -> f64 {
        ((big(found) - exact) / exact).to_f64().value().abs()
    }

    #[test]
    fn quotients_and_roots_have_a_hundred_bits() {
        let mut rng = Rng::new(1);
        let mut own = 0f64;
        for _ in 0..2_000 {
            let mut number = || {
                let high = rng.magnitude(-6.0, 6.0);
                TwoFloat::new_add(high, high * 1e-17 * rng.range(-1.0, 1.0))
            };
            let (a, b) = (number(), number());
            let ratio = big(a) / big(b);
            assert!(relative_error(quotient(a, b), &ratio) < 1e-31, "{a} {b}");
            assert!(relative_error(root(a), &big(a).sqrt()) < 1e-31, "{a}");
            assert!(relative_error(a * b, &(big(a) * big(b))) < 1e-31, "{a} {b}");
            own = own.max(relative_error(a / b, &ratio));
        }
        assert!(own > 1e-25, "the crate's quotient is good enough: {own:e}");
    }
}
