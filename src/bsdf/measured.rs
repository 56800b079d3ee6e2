//! Measured reflection (Dupuy and Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and
//! Rendering", 2018).
//!
//! For each outgoing direction of a table, the unit square is warped to the distribution of visible normals and then
//! to the half vectors between both directions; what is reflected is stored over that square, where it varies little.
//! Light is sampled by its luminance there. Between the outgoing directions, tables are interpolated: densities then
//! are means of densities, which are sampled exactly.

use std::f32::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_2, PI, TAU};
use std::fmt;
use std::sync::Arc;

use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::measured::{MeasuredData, MeasuredTable};
use crate::sampling::{BilinearTable, BilinearWarp, SliceMix};

/// A measured BRDF, the same on both sides.
#[derive(Clone, PartialEq)]
pub struct Measured(Arc<Tables>);

#[derive(PartialEq)]
struct Tables {
    phi: Vec<f32>,
    theta: Vec<f32>,
    symmetry: Symmetry,
    ndf: BilinearTable<f32>,
    sigma: BilinearTable<f32>,
    vndf: BilinearWarp,
    luminance: BilinearWarp,
    colors: BilinearTable<Rgb>,
    jacobian: bool,
    /// What is reflected, by slice.
    albedo: Vec<Rgb>,
}

/// Which outgoing directions a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Symmetry {
    /// Those of one plane: turning the surface changes nothing.
    Isotropic,
    /// All.
    None,
    /// Those of `y <= 0`: half a turn changes nothing.
    HalfTurn,
    /// Those of `x <= 0` and `y <= 0`: both axes are mirrors.
    Mirrors,
}

/// The least Jacobian of the map from the unit square to half vectors, as of Mitsuba.
const MIN_JACOBIAN: f32 = 1e-6;

/// The least area of microfacets.
const MIN_SIGMA: f32 = 1e-6;

/// Samples along each axis by which the albedo is estimated.
const ALBEDO_SAMPLES: usize = 16;

/// What depends on the outgoing direction alone.
struct View {
    /// That direction, among those of the file.
    o: Vec3,
    /// Factors on x, y and z that lead there, and back.
    flip: Vec3,
    /// The azimuth that azimuths of half vectors are relative to.
    azimuth: f32,
    mix: SliceMix,
}

fn table<T>(table: MeasuredTable<T>) -> BilinearTable<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    BilinearTable::new(table.size, table.values)
}

impl Measured {
    /// The BRDF of a file's tables.
    ///
    /// # Panics
    /// If a table has no whole slices.
    pub fn new(data: MeasuredData) -> Self {
        let symmetry = Symmetry::of(&data);
        let MeasuredData { phi, theta, ndf, sigma, vndf, luminance, colors, jacobian } = data;
        let colors = MeasuredTable { size: colors.size, values: colors.values.into_iter().map(Rgb::from).collect() };
        let mut tables = Tables {
            phi,
            theta,
            symmetry,
            ndf: table(ndf),
            sigma: table(sigma),
            vndf: BilinearWarp::new(table(vndf)),
            luminance: BilinearWarp::new(table(luminance)),
            colors: table(colors),
            jacobian,
            albedo: Vec::new(),
        };
        let outgoing = tables.phi.iter().flat_map(|&phi| tables.theta.iter().map(move |&theta| direction(theta, phi)));
        tables.albedo = outgoing.map(|wo| tables.estimated_albedo(wo)).collect();
        Self(Arc::new(tables))
    }

    /// Value and density.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 { BsdfEval::default() } else { self.0.eval(&self.0.view(wo), wi) }
    }

    /// A half vector by what is reflected.
    pub fn sample(&self, wo: Vec3, _u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z == 0.0 { None } else { self.0.sample(&self.0.view(wo), u) }
    }

    /// The lobes.
    pub fn flags(&self) -> BsdfFlags {
        let anisotropic =
            if self.0.symmetry == Symmetry::Isotropic { BsdfFlags::empty() } else { BsdfFlags::ANISOTROPIC };
        BsdfFlags::REFLECTION | BsdfFlags::GLOSSY | anisotropic
    }

    /// What is reflected, by estimates at the directions of the tables.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.0.view(wo).mix.mean(|slice| self.0.albedo[slice])
    }
}

impl fmt::Debug for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tables { phi, theta, symmetry, jacobian, albedo, .. } = &*self.0;
        let mut text = f.debug_struct("Measured");
        text.field("phi", phi).field("theta", theta).field("symmetry", symmetry).field("jacobian", jacobian);
        text.field("albedo", albedo).finish_non_exhaustive()
    }
}

impl Symmetry {
    fn of(data: &MeasuredData) -> Self {
        let range = data.phi.last().copied().unwrap_or(0.0) - data.phi.first().copied().unwrap_or(0.0);
        match (TAU / range).round() {
            _ if data.is_isotropic() => Self::Isotropic,
            4.0 => Self::Mirrors,
            2.0 => Self::HalfTurn,
            _ => Self::None,
        }
    }
}

impl Tables {
    fn view(&self, wo: Vec3) -> View {
        // Where the file has x or y at most 0, 0 itself is left alone.
        let to_negative = |x: f32| if x > 0.0 { -1.0 } else { 1.0 };
        let (x, y) = match self.symmetry {
            Symmetry::Isotropic | Symmetry::None => (1.0, 1.0),
            Symmetry::HalfTurn => (to_negative(wo.y), to_negative(wo.y)),
            Symmetry::Mirrors => (to_negative(wo.x), to_negative(wo.y)),
        };
        let flip = vec3(x, y, 1f32.copysign(wo.z));
        let o = wo * flip;
        let phi = azimuth(o);
        let azimuth = if self.symmetry == Symmetry::Isotropic { phi } else { 0.0 };
        View { o, flip, azimuth, mix: SliceMix::between([&self.phi, &self.theta], [phi, elevation(o)]) }
    }

    fn eval(&self, view: &View, wi: Vec3) -> BsdfEval {
        let View { o, flip, azimuth: turned, mix } = view;
        let sum = *o + wi * *flip;
        let length = sum.length();
        if length <= 0.0 {
            return BsdfEval::default();
        }
        let m = sum / length;
        let place = square(m, azimuth(m) - turned);
        let (uniform, visible) = self.vndf.invert(mix, place);
        // Of the unit square over that of half vectors, and of these over that of directions.
        let jacobian = (2.0 * PI * PI * place[0] * m.x.hypot(m.y)).max(MIN_JACOBIAN) * 4.0 * o.dot(m);
        let pdf = visible * self.luminance.density(mix, uniform) / jacobian;
        let value = self.colors.at(mix, uniform) * self.scale(*o, place);
        if pdf.is_finite() { BsdfEval { value, pdf } } else { BsdfEval::default() }
    }

    /// The factor on colours.
    fn scale(&self, o: Vec3, place: [f32; 2]) -> f32 {
        if !self.jacobian {
            return 1.0;
        }
        let sigma = self.sigma.at(&SliceMix::FIRST, square(o, azimuth(o)));
        if sigma < MIN_SIGMA { 0.0 } else { self.ndf.at(&SliceMix::FIRST, place) / (4.0 * sigma) }
    }

    fn sample(&self, view: &View, u: [f32; 2]) -> Option<BsdfSample> {
        let View { o, flip, azimuth, mix } = view;
        let [x, y] = self.vndf.sample(mix, self.luminance.sample(mix, u));
        let m = direction(x * x * FRAC_PI_2, (2.0 * y - 1.0) * PI + azimuth);
        let i = m * (2.0 * o.dot(m)) - *o;
        if i.z <= 0.0 {
            return None;
        }
        let wi = i * *flip;
        self.eval(view, wi).sampled(wi)
    }

    fn estimated_albedo(&self, wo: Vec3) -> Rgb {
        const N: usize = ALBEDO_SAMPLES;
        let view = self.view(vec3(wo.x, wo.y, wo.z.max(1e-3)).normalize());
        let middle = |k: usize| (k as f32 + 0.5) / N as f32;
        let samples = (0..N * N).filter_map(|k| self.sample(&view, [middle(k % N), middle(k / N)]));
        samples.fold(Rgb::BLACK, |sum, sample| sum + sample.weight) / (N * N) as f32
    }
}

/// A direction of which the angle from the normal and the azimuth are given.
fn direction(theta: f32, phi: f32) -> Vec3 {
    let ((sin, cos), (y, x)) = (theta.sin_cos(), phi.sin_cos());
    vec3(sin * x, sin * y, cos)
}

/// The angle from the normal, exact near it too.
fn elevation(w: Vec3) -> f32 {
    w.x.hypot(w.y).atan2(w.z)
}

fn azimuth(w: Vec3) -> f32 {
    w.y.atan2(w.x)
}

/// Where tables have a direction of an azimuth.
fn square(w: Vec3, azimuth: f32) -> [f32; 2] {
    let turns = azimuth * (0.5 * FRAC_1_PI) + 0.5;
    [(elevation(w) * FRAC_2_PI).sqrt(), turns - turns.floor()]
}
