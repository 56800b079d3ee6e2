//! The GGX distribution and its visible normals.

use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

#[test]
fn projected_normals_cover_the_surface_once() {
    // ∫ D(m) cos m dm = 1, and ∫ D(m) max(0, o·m) G1 dm = cos o, by uniform sampling of slopes' radius.
    for alpha in ALPHAS {
        let ggx = Ggx::new(alpha);
        let uniform = compare_directions(
            10_000,
            4,
            |u| Some(ggx.sample_visible_normal(Vec3::Z, [u[0], u[1]])),
            |m| {
                if m.z > 0.0 { ggx.normal_density(m) * m.z } else { 0.0 }
            },
        );
        uniform.check(&format!("{alpha:?}"));
    }
}

#[test]
fn shadowing_is_a_fraction_and_its_parts_agree() {
    for alpha in ALPHAS {
        let ggx = Ggx::new(alpha);
        for u in random_points(6, 1000) {
            let (o, i) = (direction(u[0].max(1e-6), u[1]), direction(u[2].max(1e-6), u[3]));
            let (g1, g2) = (ggx.g1(o), ggx.g2(o, i));
            assert!((0.0..=1.000_001).contains(&g1) && g2 <= g1 * 1.000_001 && g2 >= g1 * ggx.g1(i) * 0.999_99);
            assert!((ggx.g2_over_g1(o, i) * g1 - g2).abs() < 1e-5 * g2);
        }
    }
}
