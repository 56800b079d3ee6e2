//! How much diffuse light plastics reflect in Mitsuba and pbrt, against ours.
//!
//! Below a coat, their base reflects `r / (1 - r' R) T(wi) T(wo) / (eta² pi)`: `T` is the light that the coat's microfacets let through at
//! the first meeting, `R` the share of diffuse light inside that they throw back, and `r'` is `r`, or 1 for the linear model. Ours reflects
//! `r (1 - E(wi)) (1 - E(wo)) / ((1 - E_avg) pi)` with `E` the light that they reflect, which for a smooth coat is the linear model, and for a
//! rough one has the light that Mitsuba loses between microfacets. The mean over all directions is made the same here.

/// The means of a coat's microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Share of diffuse light inside that is thrown back inside.
    internal: f64,
    /// What our base must be multiplied by.
    gain: f64,
}

impl Coat {
    /// A coat of index of refraction `ior` and GGX alpha, 0 for a smooth one.
    pub fn new(ior: f64, alpha: f64) -> Self {
        if alpha < 1e-3 {
            let reflected = mean(|cosine| fresnel(cosine, ior).reflected);
            let internal = 1.0 - (1.0 - reflected) / (ior * ior);
            return Self { internal, gain: 1.0 - internal };
        }
        let outside = [0, 1].map(|k| mean(|cosine| microfacets(cosine, ior, alpha)[k]));
        let internal = mean(|cosine| microfacets(cosine, 1.0 / ior, alpha)[0]);
        Self { internal, gain: outside[1].powi(2) / ((1.0 - outside[0]) * ior * ior) }
    }

    /// The base of ours that looks like a base of Mitsuba's of reflectance `r`.
    pub fn base(&self, r: f32, nonlinear: bool) -> f32 {
        let again = if nonlinear { f64::from(r) } else { 1.0 };
        (f64::from(r) * self.gain / (1.0 - again * self.internal)).min(1.0) as f32
    }
}

/// The mean of a function of the cosine under diffuse light.
fn mean(f: impl Fn(f64) -> f64) -> f64 {
    // Midpoints in the squared cosine, by which diffuse light is uniform.
    const STEPS: usize = 48;
    (0..STEPS).map(|i| f(((i as f64 + 0.5) / STEPS as f64).sqrt())).sum::<f64>() / STEPS as f64
}

struct Fresnel {
    reflected: f64,
    /// Cosine on the other side; 0 for total reflection.
    cosine: f64,
}

/// Fresnel's equations for unpolarised light that meets a medium of relative index `ior`.
fn fresnel(cosine: f64, ior: f64) -> Fresnel {
    let squared = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
    if squared <= 0.0 {
        return Fresnel { reflected: 1.0, cosine: 0.0 };
    }
    let inside = squared.sqrt();
    let s = (cosine - ior * inside) / (cosine + ior * inside);
    let p = (ior * cosine - inside) / (ior * cosine + inside);
    Fresnel { reflected: 0.5 * (s * s + p * p), cosine: inside }
}

/// What GGX microfacets reflect and let through at the first meeting of light at this cosine.
fn microfacets(cosine: f64, ior: f64, alpha: f64) -> [f64; 2] {
    const STEPS: usize = 24;
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let mut sums = [0.0; 2];
    for i in 0..STEPS * STEPS {
        let u = [i / STEPS, i % STEPS].map(|k| (k as f64 + 0.5) / STEPS as f64);
        let m = visible_normal([sine, 0.0, cosine], alpha, u);
        let dot = sine * m[0] + cosine * m[2];
        let Fresnel { reflected, cosine: inside } = fresnel(dot, ior);
        let up = 2.0 * dot * m[2] - cosine;
        if up > 0.0 {
            sums[0] += reflected * masking(up, alpha);
        }
        // The z of the refracted direction, which leaves downward.
        let down = cosine / ior - (dot / ior - inside) * m[2];
        if reflected < 1.0 && down > 0.0 {
            sums[1] += (1.0 - reflected) * masking(down, alpha);
        }
    }
    sums.map(|sum| sum / (STEPS * STEPS) as f64)
}

/// Smith's masking function.
fn masking(cosine: f64, alpha: f64) -> f64 {
    let tan2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt())
}

/// A normal of GGX as seen from `w` (Heitz, "Sampling the GGX Distribution of Visible Normals").
fn visible_normal(w: [f64; 3], alpha: f64, u: [f64; 2]) -> [f64; 3] {
    let length = (alpha * w[0]).hypot(w[2]);
    // The direction stretched; it stays in the xz plane, and the tangents are y and the one upward.
    let (x, z) = (alpha * w[0] / length, w[2] / length);
    let (r, phi) = (u[0].sqrt(), std::f64::consts::TAU * u[1]);
    let (a, b) = (r * phi.cos(), r * phi.sin());
    let s = 0.5 * (1.0 + z);
    let b = (1.0 - s) * (1.0 - a * a).max(0.0).sqrt() + s * b;
    let c = (1.0 - a * a - b * b).max(0.0).sqrt();
    let n = [c * x - b * z, a, (c * z + b * x).max(1e-9)];
    let m = [alpha * n[0], alpha * n[1], n[2]];
    let length = m.iter().map(|v| v * v).sum::<f64>().sqrt();
    m.map(|v| v / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_linear_coat_changes_nothing() {
        let coat = Coat::new(1.5, 0.0);
        // Known value of the internal diffuse Fresnel reflectance.
        assert!((coat.internal - 0.5963).abs() < 1e-3, "{}", coat.internal);
        for r in [0.0, 0.3, 1.0] {
            assert!((coat.base(r, false) - r).abs() < 1e-6);
        }
    }

    #[test]
    fn colours_deepen_within_a_nonlinear_coat() {
        let coat = Coat::new(1.5, 0.0);
        assert!((coat.base(1.0, true) - 1.0).abs() < 1e-6);
        assert!((coat.base(0.5, true) - 0.2876).abs() < 1e-3);
    }

    #[test]
    fn a_rough_coat_tends_to_a_smooth_one_and_loses_light() {
        let [smooth, nearly, rough] = [0.0, 0.002, 0.4].map(|alpha| Coat::new(1.5, alpha));
        assert!((nearly.internal - smooth.internal).abs() < 5e-3 && (nearly.base(0.5, false) - 0.5).abs() < 5e-3, "{nearly:?}");
        assert!(rough.base(0.5, false) < 0.48, "{rough:?}");
    }
}
