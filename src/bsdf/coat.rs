//! A clear dielectric coat: what it reflects, and how much it leaves to what is below.

use super::energy::table::COAT_NODES as NODES;
use super::energy::{coat_albedo, coat_average};
use super::fresnel;
use super::microfacet::{FacetReflection, Microfacets, reflect};
use super::{BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, sin_cos_turns, vec3};

/// A coat of clear dielectric, smooth or rough, seen from outside; directions are of the upper side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Index of refraction over that of the outside.
    ior: f32,
    ggx: Ggx,
    /// `1 / (1 - E_avg)`, where `E_avg` is what the coat reflects of diffuse light.
    inverse_transmittance: f32,
    /// The albedo `E` of a rough coat, in units of 1/65535, at equal steps of the square root of the cosine: it is steepest at grazing angles.
    /// An anisotropic coat has half as many pairs, for directions above the x and the y axis.
    albedo: [u16; NODES],
}

/// How far from linear the inverse albedo of an anisotropic coat is between its axes: fitted.
const BEND: f32 = 0.35;

impl Coat {
    /// A coat with index of refraction `ior` over the outside, within `[1, 10]`; smooth where [`Ggx::new`] says so. A rough coat costs some
    /// milliseconds here.
    pub fn new(ior: f32, alpha: [f32; 2]) -> Self {
        let mut coat = Self { ior, ggx: Ggx::new(alpha), inverse_transmittance: 1.0, albedo: [0; NODES] };
        let average = if coat.ggx.is_smooth() {
            fresnel::dielectric_average(ior)
        } else {
            let ggx = coat.ggx;
            coat.fill(|cos, axis| integrate_albedo(ior, ggx, cos, axis));
            // Of the interpolated table, so that a base below conserves energy exactly.
            coat.average_albedo()
        };
        coat.inverse_transmittance = 1.0 / (1.0 - average).max(1e-6);
        coat
    }

    /// The same within a microsecond, for parameters that change from point to point: the albedo comes from a table, and is right to a few
    /// thousandths, of an anisotropic coat to a few hundredths.
    pub fn looked_up(ior: f32, alpha: [f32; 2]) -> Self {
        let mut coat = Self { ior, ggx: Ggx::new(alpha), inverse_transmittance: 1.0, albedo: [0; NODES] };
        let alpha = coat.ggx.alpha();
        if !coat.ggx.is_smooth() {
            coat.fill(|cos, axis| coat_albedo(ior, alpha[axis], cos));
        }
        let average = 0.5 * (coat_average(ior, alpha[0]) + coat_average(ior, alpha[1]));
        coat.inverse_transmittance = 1.0 / (1.0 - average).max(1e-6);
        coat
    }

    /// Fills the table with the albedo for a cosine above the x (0) or y (1) axis.
    #[inline]
    fn fill(&mut self, albedo: impl Fn(f32, usize) -> f32) {
        let axes = self.axes();
        self.albedo = std::array::from_fn(|entry| {
            let root = (entry / axes) as f32 / (NODES / axes - 1) as f32;
            (albedo(root * root, entry % axes) * 65_535.0).round() as u16
        });
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
        if self.is_anisotropic() { 2 } else { 1 }
    }

    /// Whether the coat is rougher along one tangent than along the other.
    #[inline]
    pub fn is_anisotropic(&self) -> bool {
        let [ax, ay] = self.ggx.alpha();
        ax != ay
    }

    /// Whether the coat reflects as a mirror.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.ggx.is_smooth()
    }

    /// Index of refraction over that of the outside.
    #[inline]
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// `1 / (1 - E_avg)`.
    #[inline]
    pub(super) fn inverse_transmittance(&self) -> f32 {
        self.inverse_transmittance
    }

    /// The fraction `E` of the light from `w` that the coat reflects.
    #[inline]
    pub(super) fn albedo(&self, w: Vec3) -> f32 {
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
        // Between the axes the inverse is quadratic in the squared sine of the azimuth, about, and the steeper the nearer it is to the smoother.
        let above_y = lookup(1);
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        if x2 + y2 <= 0.0 || above_x.min(above_y) <= 0.0 {
            return above_x.min(above_y);
        }
        let [ax, ay] = self.ggx.alpha();
        let bend = if ax > ay { BEND } else { -BEND };
        let (cos2, sin2) = (x2 / (x2 + y2), y2 / (x2 + y2));
        let towards_y = sin2 - bend * cos2 * sin2;
        above_x * above_y / (above_y + (above_x - above_y) * towards_y)
    }

    /// Reflection by a rough coat, the Fresnel factor included, and the density of [`Coat::sample`].
    #[inline]
    pub(super) fn eval(&self, o: Vec3, i: Vec3) -> (f32, f32) {
        let FacetReflection { value, pdf, cos } = self.ggx.reflection(o, i);
        (fresnel::dielectric(cos, self.ior).reflectance * value, pdf)
    }

    /// A direction that a rough coat reflects `o` to; below the surface now and then.
    #[inline]
    pub(super) fn sample(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        let m = self.ggx.sample_visible_normal(o, u);
        reflect(o, m, o.dot(m))
    }

    /// The reflection of a smooth coat with the given albedo, chosen with the given probability.
    #[inline]
    pub(super) fn mirrored(wo: Vec3, albedo: f32, probability: f32) -> BsdfSample {
        BsdfSample::mirrored(wo, Rgb::splat(albedo / probability), probability)
    }
}

/// Albedo of a rough coat for a direction above the x (0) or y (1) axis, by quadrature over visible normals.
pub(super) fn integrate_albedo(ior: f32, ggx: Ggx, cos: f32, axis: usize) -> f32 {
    // A Fibonacci lattice.
    const POINTS: u32 = 1597;
    const STEP: u32 = 987;
    let cos = cos.max(1e-5);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let o = if axis == 0 { vec3(sin, 0.0, cos) } else { vec3(0.0, sin, cos) };
    let mut sum = 0.0;
    for point in 0..POINTS {
        let u = [(point as f32 + 0.5) / POINTS as f32, ((point * STEP % POINTS) as f32 + 0.5) / POINTS as f32];
        let m = ggx.sample_visible_normal(o, u);
        let cos_m = o.dot(m).clamp(0.0, 1.0);
        let i = reflect(o, m, cos_m);
        if i.z > 0.0 {
            sum += fresnel::dielectric(cos_m, ior).reflectance * ggx.sampled_shadowing(o, i);
        }
    }
    (sum / POINTS as f32).clamp(0.0, 1.0)
}
