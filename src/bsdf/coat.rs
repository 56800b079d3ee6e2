//! A clear dielectric coat: what it reflects, and how much it leaves to what is below.

use super::dielectric::refract;
use super::energy::table::COAT_NODES as NODES;
use super::energy::{coat_albedo, coat_average};
use super::fresnel;
use super::microfacet::{FacetReflection, Microfacets, reflect};
use super::{BsdfFlags, Ggx};
use crate::math::{Vec3, sin_cos_turns, vec3};

/// A coat of clear dielectric with microfacets distributed by `D`, smooth or rough, seen from outside; directions are
/// of the upper side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat<D = Ggx> {
    /// Index of refraction over that of the outside.
    ior: f32,
    facets: D,
    /// Share of diffuse light below the coat that it reflects back down.
    internal: f32,
    /// What a rough coat does not let through, its albedo `E` where nothing is lost, in units of 1/65535, at equal
    /// steps of the square root of the cosine: it is steepest at grazing angles. An anisotropic coat has half as many
    /// pairs, for directions above the x and the y axis.
    reflected: [u16; NODES],
}

/// How far from linear the inverse albedo of an anisotropic coat is between its axes: fitted.
const BEND: f32 = 0.35;

impl Coat<Ggx> {
    /// A coat with index of refraction `ior` over the outside, within `[1, 10]`, that loses no light; smooth where
    /// [`Ggx::new`] is. A rough coat costs some milliseconds here.
    pub fn new(ior: f32, alpha: [f32; 2]) -> Self {
        let ggx = Ggx::new(alpha);
        if ggx.is_smooth() {
            return Self::smooth(ior, ggx);
        }
        let mut coat = Self { ior, facets: ggx, internal: 0.0, reflected: [0; NODES] };
        coat.fill(|cos, axis| first_encounter(ior, &ggx, above_axis(cos, axis)).reflected);
        // Of the interpolated table, so that a base below conserves energy exactly.
        coat.internal = internal_reflectance(ior, coat.average_albedo());
        coat
    }

    /// The same within a microsecond, for parameters that change from point to point: the albedo comes from a table,
    /// and is right to a few thousandths, of an anisotropic coat to a few hundredths.
    pub fn looked_up(ior: f32, alpha: [f32; 2]) -> Self {
        let ggx = Ggx::new(alpha);
        let alpha = ggx.alpha();
        let average = 0.5 * (coat_average(ior, alpha[0]) + coat_average(ior, alpha[1]));
        let mut coat = Self { ior, facets: ggx, internal: internal_reflectance(ior, average), reflected: [0; NODES] };
        if !ggx.is_smooth() {
            coat.fill(|cos, axis| coat_albedo(ior, alpha[axis], cos));
        }
        coat
    }
}

impl<D: Microfacets> Coat<D> {
    /// A coat of which nothing but the index of refraction counts.
    fn smooth(ior: f32, facets: D) -> Self {
        Self {
            ior,
            facets,
            internal: internal_reflectance(ior, fresnel::dielectric_average(ior)),
            reflected: [0; NODES],
        }
    }

    /// A coat that loses the light that its microfacets scatter several times, whatever side it comes from. `mean` is
    /// the mean of a function of the cosine under diffuse light. Costs some milliseconds.
    pub fn single_scattering(ior: f32, facets: D, mean: fn(&dyn Fn(f32) -> f32) -> f32) -> Self {
        if facets.is_smooth() {
            return Self::smooth(ior, facets);
        }
        let internal = mean(&|cos| first_encounter(1.0 / ior, &facets, above_axis(cos, 0)).reflected);
        let mut coat = Self { ior, facets, internal, reflected: [0; NODES] };
        coat.fill(|cos, axis| 1.0 - first_encounter(ior, &facets, above_axis(cos, axis)).transmitted);
        coat
    }

    /// Fills the table with the albedo for a cosine above the x (0) or y (1) axis.
    #[inline]
    fn fill(&mut self, albedo: impl Fn(f32, usize) -> f32) {
        let axes = self.axes();
        self.reflected = std::array::from_fn(|entry| {
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

    /// Axes of the table.
    #[inline]
    fn axes(&self) -> usize {
        if self.is_anisotropic() { 2 } else { 1 }
    }

    /// Its lobe.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        self.facets.flags() | BsdfFlags::REFLECTION
    }

    /// Whether the coat is rougher along one tangent than along the other.
    #[inline]
    pub fn is_anisotropic(&self) -> bool {
        let [ax, ay] = self.facets.alpha();
        ax != ay
    }

    /// Whether the coat reflects as a mirror.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    /// Alpha along both tangents.
    pub(super) fn alpha(&self) -> [f32; 2] {
        self.facets.alpha()
    }

    /// The same coat with another roughness of what it reflects; how much it lets through stays.
    pub(super) fn with_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { facets: D::with_alpha(alpha), ..*self }
    }

    /// Index of refraction over that of the outside.
    #[inline]
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// What crosses the coat upwards of diffuse light below it, after `reflectance` of what the coat throws back has
    /// been reflected again, any number of times: `1 / (ior² (1 - reflectance R))`. With `reflectance` 1 and a coat
    /// that loses nothing, `1 / (1 - E_avg)`.
    #[inline(always)]
    pub(super) fn interreflection(&self, reflectance: f32) -> f32 {
        1.0 / (self.ior * self.ior * (1.0 - reflectance * self.internal)).max(1e-6)
    }

    /// The fraction of the light from `w` that the coat does not let through, which is what it reflects but for losses.
    #[inline]
    pub(super) fn albedo(&self, w: Vec3) -> f32 {
        match (self.is_smooth(), self.is_anisotropic()) {
            (true, _) => self.smooth_albedo(w),
            (false, false) => self.isotropic_albedo(w),
            (false, true) => self.anisotropic_albedo(w),
        }
    }

    /// [`albedo`](Self::albedo) of a smooth coat.
    #[inline(always)]
    pub(super) fn smooth_albedo(&self, w: Vec3) -> f32 {
        fresnel::dielectric(w.z.min(1.0), self.ior).reflectance
    }

    /// [`albedo`](Self::albedo) of a rough isotropic coat.
    #[inline(always)]
    pub(super) fn isotropic_albedo(&self, w: Vec3) -> f32 {
        self.look_up::<1>(w.z, 0)
    }

    fn anisotropic_albedo(&self, w: Vec3) -> f32 {
        let [above_x, above_y] = [self.look_up::<2>(w.z, 0), self.look_up::<2>(w.z, 1)];
        // Between the axes the inverse is quadratic in the squared sine of the azimuth, about, and the steeper the
        // nearer it is to the smoother.
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        if x2 + y2 <= 0.0 || above_x.min(above_y) <= 0.0 {
            return above_x.min(above_y);
        }
        let [ax, ay] = self.facets.alpha();
        let bend = if ax > ay { BEND } else { -BEND };
        let (cos2, sin2) = (x2 / (x2 + y2), y2 / (x2 + y2));
        let towards_y = sin2 - bend * cos2 * sin2;
        above_x * above_y / (above_y + (above_x - above_y) * towards_y)
    }

    /// The table between its nodes, for a cosine above one of its axes.
    #[inline(always)]
    fn look_up<const AXES: usize>(&self, cos: f32, axis: usize) -> f32 {
        let last = NODES / AXES - 1;
        let at = cos.sqrt() * last as f32;
        let node = (at as i32).clamp(0, last as i32 - 1) as usize;
        let part = (at - node as f32).min(1.0);
        let (before, after) =
            (f32::from(self.reflected[node * AXES + axis]), f32::from(self.reflected[(node + 1) * AXES + axis]));
        (before + (after - before) * part) * (1.0 / 65_535.0)
    }

    /// Reflection by a rough coat, the Fresnel factor included, and the density of [`Coat::sample`].
    #[inline(always)]
    pub(super) fn eval(&self, o: Vec3, i: Vec3) -> (f32, f32) {
        let FacetReflection { value, pdf, cos } = self.facets.reflection(o, i);
        (fresnel::dielectric(cos, self.ior).reflectance * value, pdf)
    }

    /// A direction that a rough coat reflects `o` to; below the surface now and then.
    #[inline(always)]
    pub(super) fn sample(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        let m = self.facets.sample_visible_normal(o, u);
        reflect(o, m, o.dot(m))
    }
}

/// Share of diffuse light below a coat that it reflects back down, where it reflects `average` of diffuse light from
/// above and loses nothing: light crosses both ways alike, compressed by `ior²` below.
fn internal_reflectance(ior: f32, average: f32) -> f32 {
    1.0 - (1.0 - average) / (ior * ior)
}

/// The direction with a cosine above the x (0) or y (1) axis.
pub(super) fn above_axis(cos: f32, axis: usize) -> Vec3 {
    let cos = cos.max(1e-5);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    if axis == 0 { vec3(sin, 0.0, cos) } else { vec3(0.0, sin, cos) }
}

/// Where light goes that meets the microfacets of a dielectric once.
#[derive(Clone, Copy, Debug)]
pub(super) struct FirstEncounter {
    /// Fraction that is reflected and not masked.
    pub reflected: f32,
    /// Fraction that is refracted and not masked.
    pub transmitted: f32,
}

/// Light from the upper `o`, for the index of refraction `eta` beyond the surface over that on this side, by quadrature
/// over visible normals.
pub(super) fn first_encounter(eta: f32, facets: &impl Microfacets, o: Vec3) -> FirstEncounter {
    // A Fibonacci lattice.
    const POINTS: u32 = 1597;
    const STEP: u32 = 987;
    let (mut reflected, mut transmitted) = (0.0, 0.0);
    for point in 0..POINTS {
        let u = [(point as f32 + 0.5) / POINTS as f32, ((point * STEP % POINTS) as f32 + 0.5) / POINTS as f32];
        let m = facets.sample_visible_normal(o, u);
        let cos_m = o.dot(m).clamp(0.0, 1.0);
        let refraction = fresnel::dielectric(cos_m, eta);
        let up = reflect(o, m, cos_m);
        if up.z > 0.0 {
            reflected += refraction.reflectance * facets.g2_over_g1(o, up);
        }
        let down = refract(o, m, cos_m, refraction.cos_t, eta);
        if down.z < 0.0 {
            transmitted += (1.0 - refraction.reflectance) * facets.g2_over_g1(o, vec3(down.x, down.y, -down.z));
        }
    }
    FirstEncounter {
        reflected: (reflected / POINTS as f32).clamp(0.0, 1.0),
        transmitted: (transmitted / POINTS as f32).clamp(0.0, 1.0),
    }
}

/// The mean of a function of the cosine under diffuse light, by the midpoint rule in the cosine.
pub fn diffuse_mean(f: &dyn Fn(f32) -> f32) -> f32 {
    const STEPS: usize = 64;
    let cosines = (0..STEPS).map(|step| (step as f32 + 0.5) / STEPS as f32);
    2.0 * cosines.map(|cos| cos * f(cos)).sum::<f32>() / STEPS as f32
}

/// [`diffuse_mean`] as Mitsuba 3 computes it for `roughplastic`: 64 cosines from 0 to 1, both ends included, weighted
/// alike. It is about 1/64 too small, so that colours below rough coats are up to 2.4 % darker than below smooth ones.
pub fn mitsuba_diffuse_mean(f: &dyn Fn(f32) -> f32) -> f32 {
    const NODES: usize = 64;
    let cosines = (0..NODES).map(|node| (node as f32 / (NODES - 1) as f32).max(1e-6));
    2.0 * cosines.map(|cos| cos * f(cos)).sum::<f32>() / NODES as f32
}
