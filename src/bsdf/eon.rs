//! Rough diffuse reflection: the Oren-Nayar model of Fujii with the light that its facets reflect several times
//! (Portsmouth, Kutz and Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF"), sampled by their clipped
//! linearly transformed cosine.

use std::f32::consts::{FRAC_1_PI, PI};

use super::microfacet::MIN_COSINE;
use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Vec3, sin_cos_turns, vec3};

/// Rough diffuse reflection on both sides. A white one loses nothing at any roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eon {
    /// Fraction of light that one reflection leaves, each channel within `[0, 1]`.
    pub albedo: Rgb,
    /// Roughness within `[0, 1]`; 0 is ideal diffuse reflection.
    pub roughness: f32,
}

/// Of the energy of one reflection: `1/2 - 2/(3 pi)` and `2/3 - 28/(15 pi)`.
const ENERGY: f32 = 0.5 - 2.0 / (3.0 * PI);
const AVERAGE_ENERGY: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// The transformation of the cosine lobe, around the plane of the outgoing direction.
struct Transformed {
    a: f32,
    b: f32,
    c: f32,
    d: f32,
    /// Share of the hemisphere that the clipped lobe covers.
    share: f32,
    /// Unit vector along the outgoing direction's part in the surface.
    x: [f32; 2],
}

impl Transformed {
    #[inline]
    fn new(o: Vec3, r: f32) -> Self {
        let mu = o.z.min(1.0);
        let a = 1.0 + r * (0.303_392 + (-0.518_982 + 0.111_709 * mu) * mu + (-0.276_266 + 0.335_918 * mu) * r);
        let b = r * (-1.164_07 + 1.158_59 * mu + (0.150_815 - 0.150_105 * mu) * r) / (mu * mu * mu - 1.435_45);
        let c = 1.0 + (0.200_13 + (-0.506_373 + 0.261_777 * mu) * mu) * r;
        let d = (0.540_852 + (-1.016_25 + 0.475_392 * mu) * mu) * r / (-1.074_3 + mu * (0.072_562_8 + mu));
        let length = o.truncate().length();
        let x = if length > 0.0 { [o.x / length, o.y / length] } else { [1.0, 0.0] };
        Self { a, b, c, d, share: 0.5 * (1.0 + 1.0 / (d * d + 1.0).sqrt()), x }
    }

    /// Density of [`Transformed::sample`] on the upper side.
    #[inline]
    fn pdf(&self, i: Vec3) -> f32 {
        let Self { a, b, c, d, share, x } = *self;
        let (along, across) = (x[0] * i.x + x[1] * i.y, x[0] * i.y - x[1] * i.x);
        let determinant = c * (a - b * d);
        let h = vec3(c * (along - b * i.z), (a - b * d) * across, -c * (d * along - a * i.z));
        let length_squared = h.length_squared();
        let ratio = determinant / length_squared;
        ratio * ratio * h.z.max(0.0) * FRAC_1_PI / share
    }

    #[inline]
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let Self { a, b, c, d, share, x } = *self;
        let radius = u[0].sqrt();
        let (sin, cos) = sin_cos_turns(u[1]);
        let y = radius * sin;
        let edge = (1.0 - y * y).max(0.0).sqrt();
        let along = -(edge + (radius * cos - edge) * share);
        let z = (1.0 - (along * along + y * y)).max(0.0).sqrt();
        let w = vec3(a * along + b * z, c * y, d * along + z).normalize();
        vec3(x[0] * w.x - x[1] * w.y, x[1] * w.x + x[0] * w.y, w.z)
    }
}

impl Eon {
    /// Fraction that one reflection leaves for a white surface, at a cosine.
    #[inline]
    fn single_albedo(&self, mu: f32) -> f32 {
        let scale = 1.0 / (1.0 + ENERGY * self.roughness);
        let mu = mu.clamp(1e-6, 1.0);
        let sin = (1.0 - mu * mu).sqrt();
        let g = sin * (mu.acos() - sin * mu) + (2.0 / 3.0) * ((sin / mu) * (1.0 - sin * sin * sin) - sin);
        (scale * (1.0 + self.roughness * FRAC_1_PI * g)).min(1.0)
    }

    /// Mean of [`Eon::single_albedo`] under diffuse light.
    #[inline]
    fn average_albedo(&self) -> f32 {
        (1.0 + AVERAGE_ENERGY * self.roughness) / (1.0 + ENERGY * self.roughness)
    }

    /// Colour of light reflected more than once.
    #[inline]
    fn multiple(&self) -> Rgb {
        let average = self.average_albedo();
        self.albedo.map(|rho| rho * rho * average / (1.0 - rho * (1.0 - average)))
    }

    /// Probability of the uniform lobe.
    #[inline]
    fn uniform_probability(&self, mu: f32) -> f32 {
        self.roughness.powf(0.1) * (0.162_925 + mu * (-0.372_058 + (0.538_233 - 0.290_822 * mu) * mu))
    }

    /// Reflection for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 || wo.z.abs().min(wi.z.abs()) <= MIN_COSINE {
            return BsdfEval::default();
        }
        self.eval_upper(vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()))
    }

    #[inline]
    fn eval_upper(&self, o: Vec3, i: Vec3) -> BsdfEval {
        let s = o.x * i.x + o.y * i.y;
        let facing = if s > 0.0 { s / o.z.max(i.z) } else { s };
        let once = (1.0 + self.roughness * facing) / (1.0 + ENERGY * self.roughness);
        let missing_energy =
            (1.0 - self.single_albedo(o.z)) * (1.0 - self.single_albedo(i.z)) / (1.0 - self.average_albedo()).max(1e-7);
        let value = (self.albedo * once + self.multiple() * missing_energy) * (FRAC_1_PI * i.z);
        let uniform = self.uniform_probability(o.z.min(1.0));
        let pdf = uniform * 0.5 * FRAC_1_PI + (1.0 - uniform) * Transformed::new(o, self.roughness).pdf(i);
        BsdfEval { value, pdf }
    }

    /// A direction on the side of `wo`.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let i = if u_lobe < self.uniform_probability(o.z.min(1.0)) {
            let (sin, cos) = sin_cos_turns(u[1]);
            let radius = (1.0 - u[0] * u[0]).max(0.0).sqrt();
            vec3(radius * cos, radius * sin, u[0])
        } else {
            Transformed::new(o, self.roughness).sample(u)
        };
        if i.z <= MIN_COSINE {
            return None;
        }
        self.eval_upper(o, i).sampled(vec3(i.x, i.y, i.z.copysign(wo.z)))
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::DIFFUSE | BsdfFlags::REFLECTION
    }

    /// What is reflected once and more often.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let once = self.single_albedo(wo.z.abs());
        self.albedo * once + self.multiple() * (1.0 - once)
    }
}
