//! Fresnel's equations for unpolarised light.

/// Reflectance of a dielectric and where the refracted direction goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refraction {
    /// Fraction of the power that is reflected; 1 for total internal reflection.
    pub reflectance: f32,
    /// Cosine of the refracted direction, not negative; 0 for total internal reflection.
    pub cos_t: f32,
}

/// A dielectric seen at `cos_i`, within `[0, 1]`; `eta` is the index of refraction on the far side over that on the
/// near side.
#[inline(always)]
pub fn dielectric(cos_i: f32, eta: f32) -> Refraction {
    // Snell's law; `1 - sin²` is written so that it keeps its digits near the critical angle.
    let eta2 = eta * eta;
    let cos2_t = ((eta2 - 1.0) + cos_i * cos_i) / eta2;
    let is_total = cos2_t <= 0.0;
    let cos_t = if is_total { 0.0 } else { cos2_t.sqrt() };
    let reflectance = dielectric_reflectance(cos_i, cos_t, eta);
    Refraction { reflectance: if is_total { 1.0 } else { reflectance }, cos_t }
}

/// Reflectance of a dielectric for the cosines of incidence and refraction, not both zero.
#[inline(always)]
pub fn dielectric_reflectance(cos_i: f32, cos_t: f32, eta: f32) -> f32 {
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let across = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + across * across)
}

/// Mean reflectance of a dielectric under diffuse light, `2 ∫ F(cos) cos dcos`, for the far side's index over the near
/// side's.
pub fn dielectric_average(eta: f32) -> f32 {
    let eta = f64::from(eta);
    if eta < 1.0 {
        // The same rays cross both ways, compressed by eta² inside.
        return (1.0 - (1.0 - average_from_outside(1.0 / eta)) * eta * eta) as f32;
    }
    average_from_outside(eta) as f32
}

/// [`dielectric_average`] for `eta >= 1`, by the midpoint rule.
fn average_from_outside(eta: f64) -> f64 {
    const STEPS: u32 = 2048;
    let reflectance = |cos: f64| {
        let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
        let p = (eta * cos - cos_t) / (eta * cos + cos_t);
        let s = (cos - eta * cos_t) / (cos + eta * cos_t);
        0.5 * (p * p + s * s)
    };
    (0..STEPS).map(|i| (f64::from(i) + 0.5) / f64::from(STEPS)).map(|cos| 2.0 * cos * reflectance(cos)).sum::<f64>()
        / f64::from(STEPS)
}

/// A conductor's index of refraction, `eta + i k`, in the form that [`ComplexIndex::reflectance`] needs: one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComplexIndex {
    /// `eta² - k²`.
    real_squared: f32,
    /// `(2 eta k)²`.
    cross_squared: f32,
}

impl ComplexIndex {
    /// From the real part and the extinction, relative to the medium outside; both finite and not negative.
    pub fn new(eta: f32, k: f32) -> Self {
        Self { real_squared: (eta - k) * (eta + k), cross_squared: (2.0 * eta * k) * (2.0 * eta * k) }
    }

    /// Mean reflectance under diffuse light, `2 ∫ F(cos) cos dcos`, by the midpoint rule.
    pub fn average(self) -> f32 {
        const STEPS: u16 = 64;
        let cosines = (0..STEPS).map(|step| (f32::from(step) + 0.5) / f32::from(STEPS));
        cosines.map(|cos| 2.0 * cos * self.reflectance(cos)).sum::<f32>() / f32::from(STEPS)
    }

    /// Reflectance at `cos`, within `[0, 1]`, exact for any complex index.
    #[inline(always)]
    pub fn reflectance(&self, cos: f32) -> f32 {
        let cos2 = cos * cos;
        let sin2 = 1.0 - cos2;
        // With (a + ib)² = (eta + ik)² - sin²: the squared modulus a² + b² and 2 a cos.
        let t0 = self.real_squared - sin2;
        let modulus = (t0 * t0 + self.cross_squared).sqrt();
        // Without the cancellation of `modulus + t0` where next to nothing is absorbed beyond the critical angle.
        let twice_a_squared = if t0 < 0.0 { self.cross_squared / (modulus - t0) } else { modulus + t0 };
        let twice_a_cos = (2.0 * twice_a_squared).sqrt() * cos;

        // Perpendicular part; the parallel one is it times (t3 - t4) / (t3 + t4), so that the mean takes one division.
        let t1 = modulus + cos2;
        let t3 = cos2 * modulus + sin2 * sin2;
        let t4 = twice_a_cos * sin2;
        let denominator = (t1 + twice_a_cos) * (t3 + t4);
        ((t1 - twice_a_cos) * t3 / denominator.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snells_law_holds_and_the_critical_angle_reflects_all() {
        for eta in [1.1f32, 1.5, 3.0, 1.0 / 1.5, 0.3] {
            for i in 10..=1000 {
                let cos_i = i as f32 / 1000.0;
                let refraction = dielectric(cos_i, eta);
                let sin2_t = (1.0 - f64::from(cos_i).powi(2)) / f64::from(eta).powi(2);
                if sin2_t >= 1.0 + 1e-6 {
                    assert_eq!(refraction, Refraction { reflectance: 1.0, cos_t: 0.0 });
                } else if sin2_t < 1.0 - 1e-3 {
                    assert!((f64::from(refraction.cos_t) - (1.0 - sin2_t).sqrt()).abs() < 1e-5);
                    // Reversing the path changes nothing but the rounding, which the steep ends amplify.
                    assert!(
                        (dielectric(refraction.cos_t, 1.0 / eta).reflectance - refraction.reflectance).abs() < 1e-3
                    );
                }
                assert!((0.0..=1.0).contains(&refraction.reflectance));
            }
        }
    }
}
