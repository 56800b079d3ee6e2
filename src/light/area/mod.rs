//! Light from surfaces.

mod emission;
mod emitters;
mod parallelogram;
mod queue;
mod sphere;
mod textured;
mod triangle;

use std::f64::consts::PI;

pub use emission::EmittedRay;
pub(super) use emitters::EmitterScratch;
use parallelogram::ParallelogramEmitter;
pub(super) use queue::AreaQueue;
use sphere::SphereEmitter;
use triangle::TriangleEmitter;
use triangle::triangle_error;
pub(crate) use triangle::triangle_point;

use super::bounds::{EmissionCone, LightBounds, to_positive};
use super::queue::SampleGroup;
use super::{LightSample, LightSampleContext, ShadowTarget};
use crate::color::Rgb;
use crate::geometry::{Analytic, Geometry, Mesh, Shape, SpawnPoint, SurfaceInteraction, TransformedShape};
use crate::id::{PrimId, ShapeId, TextureId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Ray, Vec3};
use crate::texture::{Footprint, Texture};

/// Light emitted by a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance.
    pub radiance: Rgb,
    /// Whether the back emits too.
    pub two_sided: bool,
    /// A texture of the surface that multiplies the radiance.
    pub texture: Option<TextureId>,
    /// How much of the surface is there, if not all of it.
    pub opacity: Option<TextureId>,
}

impl Emission {
    /// The same radiance from every point of the front.
    pub const fn constant(radiance: Rgb) -> Self {
        Self { radiance, two_sided: false, texture: None, opacity: None }
    }

    /// Radiance at a point of the surface.
    #[inline]
    fn at<'a>(&self, textures: &[Texture], point: impl FnOnce() -> Footprint<'a>) -> Rgb {
        match self.texture {
            None => self.radiance,
            Some(id) => self.textured(&textures[id.index()], &point()),
        }
    }

    /// Out of the way of emission without a texture.
    #[cold]
    fn textured(&self, texture: &Texture, point: &Footprint) -> Rgb {
        self.radiance * texture.color_over(point)
    }

    /// Whether all points of the surface emit the same light.
    #[inline]
    fn is_even(&self) -> bool {
        self.texture.is_none() && self.opacity.is_none()
    }

    /// The expected radiance of a point sampled on the surface: rays hit it with the probability of its opacity, so
    /// this is the mean over rays.
    fn expected(&self, textures: &[Texture], point: &Footprint) -> Rgb {
        let coverage = self.opacity.map_or(1.0, |id| textures[id.index()].scalar_over(point));
        self.at(textures, || *point) * coverage
    }
}

/// An emissive analytic shape, one triangle of an emissive mesh, or a mesh of two triangles that make up a
/// parallelogram.
///
/// Whole spheres that are scaled evenly and near rectangles are sampled by the solid angle they fill; everything else
/// by area. Quads with a texture or with holes are sampled by their brightness in half of the cases.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// The shape.
    pub shape: ShapeId,
    /// The triangle, or 0.
    pub prim: PrimId,
    /// What it emits.
    pub emission: Emission,
    /// Mean of the radiance's luminance over the surface; above 0 wherever anything is emitted.
    luminance: f32,
    form: EmitterShape,
}

/// What is computed of the surface once. Meshes may have millions of triangles, so this is small.
#[derive(Clone, Debug)]
enum EmitterShape {
    Sphere(Box<SphereEmitter>),
    Parallelogram(Box<ParallelogramEmitter>),
    /// A triangle of a mesh, which is looked up again.
    Triangle {
        area: f64,
    },
    /// Any analytic shape, by its own sampling; of this world area.
    TransformedShape {
        area: f64,
    },
}

/// A point of an emitter as seen from another point.
struct EmitterSample {
    p: DVec3,
    /// Unit normal, towards the front.
    n: Vec3,
    /// Unit direction to the point.
    wi: Vec3,
    /// Density per solid angle.
    pdf: f32,
}

impl EmitterSample {
    /// The point `q` with the unit normal `n`, found with a density per area, as seen from `p`; `None` if it is seen
    /// edge-on.
    #[inline]
    fn from_area(p: DVec3, q: DVec3, n: DVec3, pdf_area: f64) -> Option<Self> {
        let (wi, pdf) = Self::direction_and_pdf(p, q, n, pdf_area);
        Self { p: q, n: n.as_vec3(), wi: wi.as_vec3(), pdf: pdf as f32 }.if_valid()
    }

    /// The direction of `q` from `p`, and the density per solid angle for one per area.
    #[inline(always)]
    fn direction_and_pdf(p: DVec3, q: DVec3, n: DVec3, pdf_area: f64) -> (DVec3, f64) {
        let toward = q - p;
        let distance_squared = toward.length_squared();
        let distance = distance_squared.sqrt();
        (toward * (1.0 / distance), pdf_area * distance_squared * distance / n.dot(toward).abs())
    }

    /// `None` without a finite density. A NaN, where both points are one, is no sample either.
    #[inline]
    fn if_valid(self) -> Option<Self> {
        Self::is_density(self.pdf).then_some(self)
    }

    /// Whether a density is positive and finite.
    #[inline(always)]
    fn is_density(pdf: f32) -> bool {
        (pdf > 0.0) & (pdf < f32::INFINITY)
    }

    /// Light of this radiance from the point, which has this error of its position.
    #[inline(always)]
    fn with_radiance(&self, radiance: Rgb, error: f32) -> LightSample {
        let target = ShadowTarget::Point(SpawnPoint { p: self.p, n: self.n, error });
        LightSample { wi: self.wi, radiance, pdf: self.pdf, is_delta: false, target }
    }

    /// The density of [`from_area`](Self::from_area), 0 where that gives nothing.
    #[inline]
    fn pdf_from_area(p: DVec3, q: DVec3, n: DVec3, pdf_area: f64) -> f32 {
        Self::from_area(p, q, n, pdf_area).map_or(0.0, |sample| sample.pdf)
    }
}

impl AreaLight {
    /// The light of one primitive of a shape that stands in the world (not within an object).
    pub fn new(shape: ShapeId, prim: PrimId, emission: Emission, geometry: &Geometry, textures: &[Texture]) -> Self {
        let mut form = match geometry.shape(shape) {
            Shape::Mesh(mesh) => {
                EmitterShape::Triangle { area: TriangleEmitter::new(&mesh.triangle_points(prim)).area() }
            }
            // Through the holes of a sphere its far side is seen, which only sampling by area finds.
            Shape::Analytic(placed) if emission.opacity.is_some() => EmitterShape::by_area(placed),
            Shape::Analytic(placed) => EmitterShape::analytic(placed),
            // They do not emit.
            Shape::Curves(_) | Shape::Points(_) => EmitterShape::Triangle { area: 0.0 },
        };
        let mut luminance = emission.radiance.luminance();
        if !emission.is_even() {
            let brightness = |point: &Footprint| emission.expected(textures, point).luminance();
            luminance = textured::mean(geometry.shape(shape), prim, brightness).max(textured::LEAST_MEAN * luminance);
            if let EmitterShape::Parallelogram(quad) = &mut form {
                quad.texels = textured::density(brightness).map(Box::new);
            }
        }
        Self { shape, prim, emission, luminance, form }
    }

    /// The lights of a shape that stands in the world: one for each triangle of a mesh in their order, or a single one
    /// for an analytic shape and for a mesh of two triangles that make up a parallelogram (without a texture or holes).
    ///
    /// The `single_light` of the scene's surface is to be set if there is only one.
    pub fn for_shape(shape: ShapeId, emission: Emission, geometry: &Geometry, textures: &[Texture]) -> Vec<Self> {
        let first = PrimId(0);
        if let Shape::Mesh(mesh) = geometry.shape(shape) {
            if let Some(form) = EmitterShape::two_triangles(mesh).filter(|_| emission.is_even()) {
                return vec![Self { shape, prim: first, emission, luminance: emission.radiance.luminance(), form }];
            }
            return (0..mesh.triangles().len())
                .map(|i| Self::new(shape, PrimId::new(i), emission, geometry, textures))
                .collect();
        }
        vec![Self::new(shape, first, emission, geometry, textures)]
    }

    /// Radiance leaving the point towards `wo` (unit, away from the surface).
    #[inline]
    pub fn radiance(&self, geometry: &Geometry, textures: &[Texture], at: &SurfaceInteraction, wo: Vec3) -> Rgb {
        let point = || Footprint { attributes: geometry.attributes(at), ..Footprint::point(at.uv) };
        if self.emission.two_sided || at.n_g.dot(wo) > 0.0 { self.emission.at(textures, point) } else { Rgb::BLACK }
    }

    /// Light that arrives from a chosen point of the surface; `None` where the dark side is seen.
    #[inline]
    pub fn sample(
        &self,
        geometry: &Geometry,
        textures: &[Texture],
        from: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        if !self.emission.is_even() {
            return self.sample_textured(geometry, textures, from, u);
        }
        let (sample, error) = self.sample_surface(geometry, from, u)?;
        Some(sample.with_radiance(self.emission.radiance, error))
    }

    /// [`sample`](Self::sample) for emission with a texture or holes.
    #[inline(never)]
    fn sample_textured(
        &self,
        geometry: &Geometry,
        textures: &[Texture],
        from: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let (sample, error) = match &self.form {
            EmitterShape::Parallelogram(quad) => (quad.sample_textured(from, u, self.emission.two_sided)?, quad.error),
            _ => self.sample_surface(geometry, from, u)?,
        };
        let radiance =
            self.emission.expected(textures, &textured::point(geometry.shape(self.shape), self.prim, sample.p, u));
        Some(sample.with_radiance(radiance, error))
    }

    /// A point of the surface, chosen without regard to a texture, and the error of its position; `None` where the
    /// dark side is seen.
    #[inline(always)]
    fn sample_surface(
        &self,
        geometry: &Geometry,
        from: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<(EmitterSample, f32)> {
        let p = from.p;
        let both = self.emission.two_sided;
        Some(match &self.form {
            EmitterShape::Sphere(sphere) if both || sphere.sees_front(p) => (sphere.sample(p, u)?, 0.0),
            EmitterShape::Parallelogram(quad) => (quad.sample(from, u, both)?, quad.error),
            EmitterShape::Triangle { .. } => self.sample_triangle(geometry, p, u)?,
            EmitterShape::TransformedShape { .. } => {
                let Shape::Analytic(placed) = geometry.shape(self.shape) else { return None };
                let point = placed.sample_area(u);
                let sample = EmitterSample::from_area(p, point.p, point.n.as_dvec3(), point.pdf_area)?;
                if !both && sample.wi.dot(sample.n) >= 0.0 {
                    return None;
                }
                (sample, 0.0)
            }
            _ => return None,
        })
    }

    /// A point of a triangle and its error; out of the way of rectangles and spheres.
    #[inline(never)]
    fn sample_triangle(&self, geometry: &Geometry, p: DVec3, u: [f32; 2]) -> Option<(EmitterSample, f32)> {
        let triangle = self.triangle(geometry)?;
        let seen = self.emission.two_sided || triangle.sees_front(p);
        Some((triangle.sample(p, u).filter(|_| seen)?, triangle.error))
    }

    /// The triangle of a mesh.
    #[inline]
    fn triangle(&self, geometry: &Geometry) -> Option<TriangleEmitter> {
        match geometry.shape(self.shape) {
            Shape::Mesh(mesh) => Some(TriangleEmitter::new(&mesh.triangle_points(self.prim))),
            Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => None,
        }
    }

    /// As [`Light::end_shape`](super::Light::end_shape): a shape that is flat, or a whole sphere, of which only
    /// points that are seen are sampled.
    pub(super) fn end_shape(&self, geometry: &Geometry) -> Option<ShapeId> {
        let Shape::Analytic(placed) = geometry.shape(self.shape) else { return None };
        let is_flat = matches!(placed.shape, Analytic::Quad(_) | Analytic::Disk(_));
        (is_flat || matches!(self.form, EmitterShape::Sphere(_))).then_some(self.shape)
    }

    /// With which lights it is sampled for many vertices at once.
    pub(super) fn sample_group(&self) -> SampleGroup {
        match &self.form {
            _ if !self.emission.is_even() => SampleGroup::Alone,
            EmitterShape::Parallelogram(_) => SampleGroup::Parallelograms,
            EmitterShape::Sphere(sphere) if !sphere.inward && !self.emission.two_sided => SampleGroup::Spheres,
            EmitterShape::TransformedShape { .. } => SampleGroup::Shapes,
            EmitterShape::Sphere(_) | EmitterShape::Triangle { .. } => SampleGroup::Alone,
        }
    }

    /// Density per solid angle with which [`sample`](Self::sample) would have chosen the direction of `ray` (unit),
    /// which starts at the same point and hit this light at `at`; zero on the dark side.
    #[inline]
    pub fn pdf(&self, geometry: &Geometry, from: &LightSampleContext, ray: &Ray, at: &SurfaceInteraction) -> f32 {
        if !self.emission.two_sided && at.n_g.dot(ray.direction) >= 0.0 {
            return 0.0;
        }
        match &self.form {
            EmitterShape::Sphere(sphere) => sphere.pdf(from.p, at.p),
            EmitterShape::Parallelogram(quad) => quad.pdf(from, at.p),
            EmitterShape::Triangle { area } => {
                EmitterSample::pdf_from_area(from.p, at.p, at.n_g.as_dvec3(), 1.0 / area)
            }
            EmitterShape::TransformedShape { .. } => {
                let Shape::Analytic(placed) = geometry.shape(self.shape) else { return 0.0 };
                // Where the normal does not determine the density, the hit itself does.
                let pdf_area = placed.pdf_area_from_normal(at.n_g).or_else(|| placed.pdf_area(ray));
                pdf_area.map_or(0.0, |pdf_area| EmitterSample::pdf_from_area(from.p, at.p, at.n_g.as_dvec3(), pdf_area))
            }
        }
    }

    /// The density with which the point `q` is [sampled](Self::sample), over that for light from any side.
    pub fn side_factor(&self, from: &LightSampleContext, q: DVec3) -> f32 {
        let EmitterShape::Parallelogram(quad) = &self.form else { return 1.0 };
        let of_any_side = quad.pdf(&LightSampleContext::from_any_side(from.p), q);
        if of_any_side > 0.0 { quad.pdf(from, q) / of_any_side } else { 1.0 }
    }

    /// Area of the surface, in the world.
    pub fn area(&self) -> f64 {
        match &self.form {
            EmitterShape::Sphere(sphere) => sphere.area(),
            EmitterShape::Parallelogram(quad) => quad.area(),
            EmitterShape::Triangle { area } | EmitterShape::TransformedShape { area } => *area,
        }
    }

    /// For the choice of a light.
    pub(super) fn bounds(&self, geometry: &Geometry) -> Option<LightBounds> {
        let shape = geometry.shape(self.shape);
        let (bounds, normal) = match &self.form {
            EmitterShape::Sphere(_) => (shape.bounds(), None),
            EmitterShape::Parallelogram(quad) => (shape.bounds(), Some(quad.normal())),
            EmitterShape::Triangle { .. } => {
                (shape.prim_bounds(self.prim), self.triangle(geometry).map(|triangle| triangle.normal()))
            }
            EmitterShape::TransformedShape { .. } => (shape.bounds(), flat_normal(shape)),
        };
        let cone = normal.map_or(EmissionCone::SPHERE, EmissionCone::flat);
        // Of a closed convex surface, a quarter of the area is seen from far away.
        let seen = self.area() * if normal.is_some() { 1.0 } else { 0.25 };
        let intensity = seen * f64::from(self.luminance);
        let two_sided = self.emission.two_sided && normal.is_some();
        (intensity > 0.0).then(|| LightBounds { bounds, cone, two_sided, intensity: to_positive(intensity) })
    }

    /// Emitted power, as luminance.
    pub fn power(&self) -> f64 {
        let sides = if self.emission.two_sided { 2.0 } else { 1.0 };
        sides * PI * self.area() * f64::from(self.luminance)
    }
}

impl EmitterShape {
    fn analytic(placed: &TransformedShape) -> Self {
        match (&placed.shape, placed.transform.uniform_scale()) {
            (Analytic::Sphere(sphere), Some(scale)) if sphere.is_full() => Self::Sphere(Box::new(SphereEmitter {
                center: placed.transform.point(DVec3::ZERO),
                radius: sphere.radius() * scale,
                inward: placed.reverse_normal,
            })),
            _ => Self::by_area(placed),
        }
    }

    /// What does not depend on a part of the surface being hidden by another.
    fn by_area(placed: &TransformedShape) -> Self {
        let Analytic::Quad(quad) = &placed.shape else { return Self::TransformedShape { area: placed_area(placed) } };
        let map = &placed.transform;
        let front = placed.sample_area([0.5; 2]).n.as_dvec3();
        let edges = [quad.edge_u(), quad.edge_v()].map(|edge| map.vector(edge));
        ParallelogramEmitter::new(map.point(quad.origin()), edges, front, 0.0)
            .map_or(Self::TransformedShape { area: 0.0 }, |quad| Self::Parallelogram(Box::new(quad)))
    }

    /// Two triangles that share an edge, look to the same side and make up a parallelogram.
    fn two_triangles(mesh: &Mesh) -> Option<Self> {
        if mesh.triangles().len() != 2 {
            return None;
        }
        let (first, second) = (mesh.triangle_points(PrimId(0)), mesh.triangle_points(PrimId(1)));
        let (corners, others) = ([first.a, first.b, first.c], [second.a, second.b, second.c]);

        // The corner that the second triangle does not have, and the shared edge, run in opposite orders if both look
        // to the same side.
        let lone = (0..3).find(|&i| !others.contains(&corners[i]))?;
        let (corner, next, last) = (corners[lone], corners[(lone + 1) % 3], corners[(lone + 2) % 3]);
        let back = (0..3).find(|&i| others[i] == last && others[(i + 1) % 3] == next)?;
        let opposite = others[(back + 2) % 3];

        // Closed up to the rounding of its corners, which counts as an error of the surface.
        let (origin, far) = (corner.as_dvec3(), opposite.as_dvec3());
        let (edge_u, edge_v) = (next.as_dvec3() - origin, last.as_dvec3() - origin);
        let gap = (origin + edge_u + edge_v - far).abs().max_element();
        let largest =
            [origin, far, next.as_dvec3(), last.as_dvec3()].iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        if gap > 4.0 * UNIT_ROUNDOFF * largest {
            return None;
        }
        let error = triangle_error(&first).max(triangle_error(&second)) + gap as f32;
        ParallelogramEmitter::new(origin, [edge_u, edge_v], first.cross(), error)
            .map(|quad| Self::Parallelogram(Box::new(quad)))
    }
}

/// Unit normal of a flat shape, towards its front.
fn flat_normal(shape: &Shape) -> Option<Vec3> {
    match shape {
        Shape::Analytic(placed) if matches!(placed.shape, Analytic::Disk(_) | Analytic::Quad(_)) => {
            Some(placed.sample_area([0.5; 2]).n)
        }
        _ => None,
    }
}

/// World area of any analytic shape: where the transform keeps angles that of the shape, else the mean of its inverse
/// density.
pub(crate) fn placed_area(placed: &TransformedShape) -> f64 {
    if let Some(scale) = placed.transform.uniform_scale() {
        return placed.shape.area() * scale * scale;
    }
    let n = 64;
    let middle = |i: u32| (i as f32 + 0.5) / n as f32;
    let sum: f64 = (0..n * n).map(|i| 1.0 / placed.sample_area([middle(i % n), middle(i / n)]).pdf_area).sum();
    let area = sum / f64::from(n * n);
    if area.is_finite() { area } else { 0.0 }
}

#[cfg(test)]
mod analytic_tests;
#[cfg(test)]
mod tests;
