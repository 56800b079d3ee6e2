//! A diffuse base under a clear dielectric coat.
//!
//! With `E(w)` the fraction of the light from `w` that the coat reflects (Fresnel's `F` for a smooth coat, the single-scattering albedo of
//! its microfacets for a rough one) and `E_avg` its mean under diffuse light,
//!
//! ```text
//! f = coat + (1 - E(wo)) (1 - E(wi)) / (1 - E_avg) * diffuse / pi
//! ```
//!
//! For a smooth coat `1 - E_avg = eta² (1 - F_internal)`, and this is the linear formula of Mitsuba's `plastic`: light that the coat throws
//! back inside keeps the colour of one scattering. A white base loses nothing, whatever the coat (for an anisotropic one `E` between its axes
//! is approximate: within a hundredth or two unless its alphas differ more than four times), and the base is reciprocal (Kelemen and
//! Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling").

use std::f32::consts::FRAC_1_PI;

use super::fresnel;
use super::microfacet::{MIN_COSINE, reflect};
use super::{BsdfEval, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, sin_cos_turns, vec3};
use crate::sampling::warp;

/// A diffuse base under a clear coat, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Colour of the base, each channel within `[0, 1]`.
    pub diffuse: Rgb,
    /// The coat.
    pub(crate) coat: Coat,
}

/// What does not depend on the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coat {
    /// Index of refraction over that of the outside.
    ior: f32,
    ggx: Ggx,
    /// `1 / (1 - E_avg)`.
    inverse_transmittance: f32,
    /// `E` of a rough coat, in units of 1/65535, at equal steps of the square root of the cosine: it is steepest at grazing angles. An
    /// anisotropic coat has half as many pairs, for directions above the x and the y axis.
    albedo: [u16; NODES],
}

const NODES: usize = 32;

impl Coat {
    fn new(ior: f32, alpha: [f32; 2]) -> Self {
        let mut coat = Self { ior, ggx: Ggx::new(alpha), inverse_transmittance: 1.0, albedo: [0; NODES] };
        let average = if coat.ggx.is_smooth() {
            fresnel::dielectric_average(ior)
        } else {
            let axes = coat.axes();
            for entry in 0..NODES {
                let root = (entry / axes) as f32 / (NODES / axes - 1) as f32;
                coat.albedo[entry] = (coat.integrate_albedo(root * root, entry % axes) * 65_535.0).round() as u16;
            }
            // Of the interpolated table, so that the base conserves energy exactly.
            coat.average_albedo()
        };
        coat.inverse_transmittance = 1.0 / (1.0 - average).max(1e-6);
        coat
    }

    /// `E` under diffuse light.
    fn average_albedo(&self) -> f32 {
        const STEPS: usize = 16 * NODES;
        const AZIMUTHS: usize = 16;
        let mut sum = 0.0;
        for step in 0..STEPS {
            let cos = (step as f32 + 0.5) / STEPS as f32;
            let sin = (1.0 - cos * cos).sqrt();
            for azimuth in 0..AZIMUTHS {
                let (y, x) = sin_cos_turns(0.25 * (azimuth as f32 + 0.5) / AZIMUTHS as f32);
                sum += 2.0 * f64::from(cos * self.albedo(vec3(sin * x, sin * y, cos)));
            }
        }
        (sum / (STEPS * AZIMUTHS) as f64) as f32
    }

    /// Axes that the table tells apart.
    #[inline]
    fn axes(&self) -> usize {
        let [ax, ay] = self.ggx.alpha();
        if ax == ay { 1 } else { 2 }
    }

    /// `E` of a rough coat for a direction above the x (0) or y (1) axis, by quadrature over visible normals.
    fn integrate_albedo(&self, cos: f32, axis: usize) -> f32 {
        // A Fibonacci lattice.
        const POINTS: u32 = 1597;
        const STEP: u32 = 987;
        let cos = cos.max(1e-5);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let o = if axis == 0 { vec3(sin, 0.0, cos) } else { vec3(0.0, sin, cos) };
        let mut sum = 0.0;
        for point in 0..POINTS {
            let u = [(point as f32 + 0.5) / POINTS as f32, ((point * STEP % POINTS) as f32 + 0.5) / POINTS as f32];
            let m = self.ggx.sample_visible_normal(o, u);
            let cos_m = o.dot(m).clamp(0.0, 1.0);
            let i = reflect(o, m, cos_m);
            if i.z > 0.0 {
                sum += fresnel::dielectric(cos_m, self.ior).reflectance * self.ggx.sampled_shadowing(o, i);
            }
        }
        (sum / POINTS as f32).clamp(0.0, 1.0)
    }

    /// `E` for a direction of the upper side.
    #[inline]
    fn albedo(&self, w: Vec3) -> f32 {
        if self.ggx.is_smooth() {
            return fresnel::dielectric(w.z.min(1.0), self.ior).reflectance;
        }
        let axes = self.axes();
        let last = NODES / axes - 1;
        let at = w.z.sqrt() * last as f32;
        let node = (at as usize).min(last - 1);
        let part = (at - node as f32).min(1.0);
        let lookup = |axis: usize| {
            let (before, after) = (f32::from(self.albedo[node * axes + axis]), f32::from(self.albedo[(node + 1) * axes + axis]));
            (before + (after - before) * part) * (1.0 / 65_535.0)
        };
        let above_x = lookup(0);
        if axes == 1 {
            return above_x;
        }
        // Between the axes the inverse is linear in the squared sine, about: a little too high, so that no light is gained.
        let above_y = lookup(1);
        let sum = w.x * w.x * above_y + w.y * w.y * above_x;
        if sum > 0.0 { above_x * above_y * (w.x * w.x + w.y * w.y) / sum } else { above_x }
    }
}

impl Plastic {
    /// A base of colour `diffuse` under a coat with index of refraction `ior` over the outside, at least 1; smooth where [`Ggx::new`] says
    /// so. A rough coat costs some milliseconds here.
    pub fn new(diffuse: Rgb, ior: f32, alpha: [f32; 2]) -> Self {
        Self { diffuse, coat: Coat::new(ior, alpha) }
    }

    /// Probability of choosing the coat: by what the lobes scatter.
    #[inline]
    fn coat_probability(&self, coat_albedo: f32) -> f32 {
        let base = (1.0 - coat_albedo) * self.diffuse.mean();
        let sum = coat_albedo + base;
        if sum > 0.0 { coat_albedo / sum } else { 0.0 }
    }

    /// Base and rough coat for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 {
            return BsdfEval::default();
        }
        self.eval_upper(vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()))
    }

    #[inline]
    fn eval_upper(&self, o: Vec3, i: Vec3) -> BsdfEval {
        let coat = &self.coat;
        let (coat_o, coat_i) = (coat.albedo(o), coat.albedo(i));
        let probability = self.coat_probability(coat_o);
        let cosine_pdf = FRAC_1_PI * i.z;
        let value = self.diffuse * ((1.0 - coat_o) * (1.0 - coat_i) * coat.inverse_transmittance * cosine_pdf);
        let pdf = (1.0 - probability) * cosine_pdf;
        if coat.ggx.is_smooth() {
            return BsdfEval { value, pdf };
        }
        let facet = coat.ggx.reflection(o, i);
        let reflectance = fresnel::dielectric(facet.cos, coat.ior).reflectance;
        BsdfEval { value: value + Rgb::splat(reflectance * facet.value), pdf: pdf + probability * facet.pdf }
    }

    /// A direction from the coat or the base, chosen by what they scatter.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let coat = &self.coat;
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let coat_albedo = coat.albedo(o);
        let probability = self.coat_probability(coat_albedo);
        let mut wi = if u_lobe < probability {
            if coat.ggx.is_smooth() {
                return Some(BsdfSample::mirrored(wo, Rgb::splat(coat_albedo / probability), probability));
            }
            let m = coat.ggx.sample_visible_normal(o, u);
            reflect(o, m, o.dot(m))
        } else {
            warp::cosine_hemisphere(u)
        };
        if wi.z <= 0.0 {
            return None;
        }
        let BsdfEval { value, pdf } = self.eval_upper(o, wi);
        if pdf <= 0.0 {
            return None;
        }
        wi.z = wi.z.copysign(wo.z);
        Some(BsdfSample { wi, weight: value / pdf, pdf, is_delta: false, is_transmission: false, eta: 1.0 })
    }

    /// Whether the coat is rougher along one tangent than along the other.
    pub fn is_anisotropic(&self) -> bool {
        self.coat.ggx.alpha()[0] != self.coat.ggx.alpha()[1]
    }

    /// Never: the base is diffuse.
    #[inline]
    pub fn is_delta(&self) -> bool {
        false
    }

    /// What coat and base reflect together.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let coat = self.coat.albedo(vec3(wo.x, wo.y, wo.z.abs()));
        Rgb::splat(coat) + self.diffuse * (1.0 - coat)
    }
}
