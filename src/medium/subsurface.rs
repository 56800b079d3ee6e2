//! Scattering below the surface of a material: the medium whose half-space has a given colour.
//!
//! Light that enters a half-space diffusely leaves it with the albedo `A(s) = (1 - s)(1 - 0.139 s) / (1 + 1.17 s)`,
//! where `s² = (1 - a) / (1 - a g)`, `a` is the albedo of a single scattering and `g` its mean cosine (van de Hulst,
//! "Multiple Light Scattering"). This is inverted here, as by Kulla and Conty ("Revisiting Physically Based Shading at
//! Imageworks"); the fit of Chiang, Kutz and Burley ("Practical and Controllable Subsurface Scattering for Production
//! Path Tracing") is close to it, but loses 7 % where the colour is white, and has no `g`.

use super::Medium;
use crate::bsdf::{Phase, PhaseLobe};
use crate::color::Rgb;

/// How light is scattered below the surface of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subsurface {
    /// By channel, the mean way after which light has lost its direction: 1 over absorption and reduced scattering,
    /// `(1 - g)` times the scattering. Above 0.
    pub radius: Rgb,
    /// The mean cosine `g` of a single scattering, within `(-1, 1)`.
    pub anisotropy: f32,
}

impl Subsurface {
    /// The medium below a surface of this colour, with radii of at least `least`.
    pub fn medium(&self, color: Rgb, least: f32) -> Medium {
        let reduced = self.radius.map(|radius| 1.0 / radius.max(least));
        let squared = color.map(|color| similarity(color).powi(2));
        Medium {
            absorption: squared * reduced,
            scattering: (Rgb::WHITE - squared) * reduced / (1.0 - self.anisotropy),
            phase: Phase::from(PhaseLobe::HenyeyGreenstein { g: self.anisotropy }),
            ..Medium::clear(0)
        }
    }
}

/// The albedo of a half-space under diffuse light, by its coefficients of absorption and of reduced scattering.
pub fn half_space_albedo(absorption: f32, reduced_scattering: f32) -> f32 {
    let s = if absorption > 0.0 { (absorption / (absorption + reduced_scattering)).sqrt() } else { 0.0 };
    (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
}

/// `s` of the half-space with this albedo, within `[0, 1]`.
fn similarity(albedo: f32) -> f32 {
    let b = 1.139 + 1.17 * albedo;
    2.0 * (1.0 - albedo) / (b + (b * b - 0.556 * (1.0 - albedo)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Albedo of a half-space of isotropic single scattering `a` under diffuse light: `1 - 2 sqrt(1 - a)` times the
    /// first moment of Chandrasekhar's H, by iteration.
    fn exact_albedo(a: f64) -> f64 {
        const N: usize = 400;
        // Nodes closer together near 0, where H is steep.
        let nodes: Vec<(f64, f64)> = (0..N)
            .map(|i| {
                let x = (i as f64 + 0.5) / N as f64;
                (x * x, 2.0 * x / N as f64)
            })
            .collect();
        let mut h = vec![1.0; N];
        for _ in 0..2000 {
            let next: Vec<f64> = nodes
                .iter()
                .map(|&(mu, _)| {
                    let sum: f64 = nodes.iter().zip(&h).map(|(&(x, w), h)| w * x * h / (mu + x)).sum();
                    1.0 / ((1.0 - a).sqrt() + 0.5 * a * sum)
                })
                .collect();
            h = next;
        }
        let moment: f64 = nodes.iter().zip(&h).map(|(&(x, w), h)| w * x * h).sum();
        1.0 - 2.0 * (1.0 - a).sqrt() * moment
    }

    #[test]
    fn a_half_space_has_the_albedo_that_was_asked_for() {
        let isotropic = Subsurface { radius: Rgb::splat(0.3), anisotropy: 0.0 };
        for i in 0..=20 {
            let albedo = i as f32 / 20.0;
            let medium = isotropic.medium(Rgb::splat(albedo), 0.0);
            let single = f64::from(medium.scattering.r) / f64::from(medium.extinction().r);
            let exact = exact_albedo(single);
            assert!((exact - f64::from(albedo)).abs() < 3e-3, "{albedo}: {exact}");
            assert!((medium.extinction().r * 0.3 - 1.0).abs() < 1e-6);
            assert!((half_space_albedo(medium.absorption.r, medium.scattering.r) - albedo).abs() < 1e-5);
        }
        assert_eq!(similarity(1.0), 0.0);
        assert_eq!(similarity(0.0), 1.0);
    }

    #[test]
    fn the_radius_is_that_of_reduced_scattering() {
        for anisotropy in [-0.8, -0.3, 0.5, 0.9] {
            let medium =
                Subsurface { radius: Rgb::new(2.0, 0.5, 0.1), anisotropy }.medium(Rgb::new(0.9, 0.4, 0.0), 0.3);
            let reduced = medium.absorption + medium.scattering * (1.0 - anisotropy);
            for (reduced, radius) in reduced.to_array().into_iter().zip([2.0, 0.5, 0.3]) {
                assert!((reduced * radius - 1.0).abs() < 1e-5, "{anisotropy}: {reduced} {radius}");
            }
        }
    }
}
