//! Every BSDF against statistics and closed forms.

mod beckmann;
mod coated;
mod diffuse;
mod energy;
mod hair;
mod limits;
mod measured;
mod microfacet;
mod phase;
mod principled;
mod rows;
mod sampling;
mod single;
mod split;

use super::*;
use crate::math::vec3;

/// Alphas from sharp to fully rough, one of them anisotropic.
const ALPHAS: [[f32; 2]; 5] = [[0.05; 2], [0.15; 2], [0.5; 2], [1.0; 2], [0.3, 0.1]];

/// A direction by its cosine and azimuth in turns; negative cosines look at the inside.
fn direction(cos: f32, turns: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).sqrt();
    let (y, x) = crate::math::sin_cos_turns(turns);
    vec3(sin * x, sin * y, cos)
}

/// A gold-like metal.
fn gold(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Conductor(Conductor::new(Rgb::new(0.18, 0.42, 1.37), Rgb::new(3.42, 2.35, 1.77), alpha, Rgb::WHITE))
}

/// A metal that reflects all.
fn perfect_metal(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Conductor(Conductor::new(Rgb::BLACK, Rgb::WHITE, alpha, Rgb::WHITE))
}

fn glass(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Dielectric(Dielectric::new(1.5, alpha))
}

/// The same with Beckmann's microfacets.
fn beckmann_gold(alpha: [f32; 2]) -> Bsdf {
    let gold = Conductor::new(Rgb::new(0.18, 0.42, 1.37), Rgb::new(3.42, 2.35, 1.77), [0.0; 2], Rgb::WHITE);
    Bsdf::Beckmann(SingleScatteringBsdf::Conductor(gold.with_facets(Beckmann::new(alpha), Rgb::WHITE)))
}

fn beckmann_glass(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(Dielectric::with_facets(1.5, alpha, Beckmann::new)))
}

fn separable_gold(alpha: [f32; 2]) -> Bsdf {
    let gold = Conductor::new(Rgb::new(0.18, 0.42, 1.37), Rgb::new(3.42, 2.35, 1.77), [0.0; 2], Rgb::WHITE);
    Bsdf::SeparableGgx(SingleScatteringBsdf::Conductor(gold.with_facets(SeparableGgx::new(alpha), Rgb::WHITE)))
}

fn separable_glass(alpha: [f32; 2]) -> Bsdf {
    let glass = Dielectric::with_facets(1.5, alpha, SeparableGgx::new);
    Bsdf::SeparableGgx(SingleScatteringBsdf::Dielectric(glass.tinted(Rgb::new(0.9, 0.8, 1.0), Rgb::new(0.5, 0.7, 0.9))))
}

/// Plastic below a coat that loses light.
fn lossy_plastic<D: Microfacets>(facets: D, nonlinear: bool) -> SingleScatteringBsdf<D> {
    let coat = Coat::single_scattering(1.5, facets, diffuse_mean);
    SingleScatteringBsdf::Plastic(Plastic {
        diffuse: Rgb::new(0.1, 0.2, 0.7),
        coat,
        tint: Rgb::new(1.0, 0.5, 0.9),
        nonlinear,
    })
}

fn white_plastic(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Plastic(Plastic::new(Rgb::WHITE, 1.5, alpha))
}

fn blue_plastic(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Plastic(Plastic::new(Rgb::new(0.1, 0.2, 0.7), 1.5, alpha))
}

/// Every kind at every alpha, all but deltas, with a name.
fn rough_bsdfs() -> Vec<(String, Bsdf)> {
    let mut all = vec![("lambert".to_owned(), Bsdf::Lambert(Lambert { albedo: Rgb::new(0.2, 0.5, 0.9) }))];
    for alpha in ALPHAS {
        all.push((format!("conductor {alpha:?}"), gold(alpha)));
        all.push((format!("dielectric {alpha:?}"), glass(alpha)));
        all.push((format!("plastic {alpha:?}"), blue_plastic(alpha)));
        all.push((format!("beckmann conductor {alpha:?}"), beckmann_gold(alpha)));
        all.push((format!("beckmann dielectric {alpha:?}"), beckmann_glass(alpha)));
        all.push((format!("separable conductor {alpha:?}"), separable_gold(alpha)));
        all.push((format!("separable dielectric {alpha:?}"), separable_glass(alpha)));
    }
    all.push(("beckmann plastic".to_owned(), Bsdf::Beckmann(lossy_plastic(Beckmann::new([0.2; 2]), true))));
    all.push(("separable plastic".to_owned(), Bsdf::SeparableGgx(lossy_plastic(SeparableGgx::new([0.4; 2]), false))));
    all
}
