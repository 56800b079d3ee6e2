//! Stored values of one principled material: changes that no law of physics would notice.

use super::super::{Effort, Outcome};
use super::materials::direction;
use crate::bsdf::{Principled, PrincipledParameters};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};

/// Every lobe has its part.
fn material() -> Principled {
    Principled::new(&PrincipledParameters {
        base_color: Rgb::new(0.8, 0.3, 0.1),
        metallic: 0.3,
        roughness: 0.4,
        anisotropic: 0.5,
        ior: 1.5,
        specular_tint: 0.4,
        sheen: 0.5,
        sheen_tint: 0.7,
        clearcoat: 0.6,
        clearcoat_gloss: 0.3,
        subsurface: 0.5,
        transmission: 0.4,
        ..PrincipledParameters::default()
    })
}

/// Twenty pairs of directions, of which every fourth crosses the surface near the direction of refraction.
fn pairs() -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..20u16).map(|i| {
        let k = f32::from(i);
        let wo = direction((0.95 - 0.045 * k) * if i % 5 == 4 { -1.0 } else { 1.0 }, 0.07 * k);
        if i % 4 == 3 {
            return (wo, vec3(0.1 - 0.65 * wo.x, -0.65 * wo.y, -wo.z.signum()).normalize());
        }
        (wo, direction((0.1 + 0.043 * k) * wo.z.signum(), 0.5 + 0.09 * k))
    })
}

/// Red, green and blue of the value, and the density, as `f64` for the pairs in order.
fn values() -> Vec<[f64; 4]> {
    let bsdf = material();
    let at = |(wo, wi)| {
        let eval = bsdf.eval(wo, wi);
        [eval.value.r, eval.value.g, eval.value.b, eval.pdf].map(f64::from)
    };
    pairs().map(at).collect()
}

/// What [`values`] was; when it shall change, `cargo test --lib values_to_store -- --ignored` prints what to put here.
const STORED: [[f64; 4]; 20] = [
    [0.01982982, 0.008749234, 0.003900396, 0.02613699],
    [0.02099278, 0.009347246, 0.004029058, 0.0233989],
    [0.02280937, 0.01038117, 0.004320845, 0.02397883],
    [0.8324261, 0.5097548, 0.2943071, 3.498811],
    [0.09970628, 0.06241367, 0.04685698, 0.1216867],
    [0.05448532, 0.02219333, 0.009363562, 0.04810381],
    [0.0480559, 0.01822807, 0.006801103, 0.0403465],
    [5.712495, 3.498175, 2.019672, 23.57447],
    [0.05877881, 0.02213698, 0.007962744, 0.04970123],
    [0.08411614, 0.03951206, 0.02217294, 0.08049535],
    [0.07420571, 0.02801286, 0.01010356, 0.06171732],
    [0.1376819, 0.0843126, 0.0486779, 0.5432321],
    [0.07741071, 0.02854634, 0.009767919, 0.06373909],
    [0.08247015, 0.03043363, 0.01040916, 0.06969571],
    [0.08816952, 0.03321586, 0.01156051, 0.07673065],
    [0.00844384, 0.005170775, 0.002985348, 0.0308328],
    [0.09709092, 0.03960421, 0.01401066, 0.09022586],
    [0.08747644, 0.0382583, 0.01324501, 0.08409356],
    [0.08331052, 0.03883829, 0.01343407, 0.08377405],
    [0.0, 0.0, 0.0, 0.0],
];

pub(super) fn g12_frozen(_effort: Effort) -> Outcome {
    let errors = values().into_iter().zip(STORED).flat_map(|(found, stored)| {
        let error = |(a, b): (f64, f64)| if a == b { 0.0 } else { (a - b).abs() / b.abs() };
        found.into_iter().zip(stored).map(error)
    });
    Outcome::new().at_most("largest relative difference of value and density", errors.fold(0.0, f64::max), 1e-5)
}

#[cfg(test)]
mod tests {
    #[test]
    #[ignore = "prints the table that the check compares with"]
    fn values_to_store() {
        let rows: Vec<String> = super::values().iter().map(|row| format!("    {row:?},")).collect();
        panic!("\n{}", rows.join("\n"));
    }
}
