//! The GGX distribution and its visible normals.

use super::*;
use crate::math::sin_cos_turns;
use crate::sampling::statistics::{compare_directions, random_points};

/// Heitz, "Sampling the GGX Distribution of Visible Normals": the same density by another construction.
fn sample_by_disk(ggx: &Ggx, o: Vec3, u: [f32; 2]) -> Vec3 {
    let [ax, ay] = ggx.alpha();
    let w = vec3(ax * o.x, ay * o.y, o.z).normalize();
    let across = w.truncate().length_squared();
    let t1 = if across > 0.0 { vec3(-w.y, w.x, 0.0) / across.sqrt() } else { Vec3::X };
    let t2 = w.cross(t1);
    let (sin, cos) = sin_cos_turns(u[1]);
    let (p1, p2) = (u[0].sqrt() * cos, u[0].sqrt() * sin);
    let s = 0.5 * (1.0 + w.z);
    let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * p2;
    let n = t1 * p1 + t2 * p2 + w * (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
    vec3(ax * n.x, ay * n.y, n.z.max(0.0)).normalize()
}

#[test]
fn visible_normals_follow_their_density_as_another_sampler_does() {
    for alpha in ALPHAS {
        let ggx = Ggx::new(alpha);
        for cos in [1.0, 0.6, 0.05] {
            let o = direction(cos, 0.15);
            let pdf = |m: Vec3| ggx.visible_normal_pdf(o, m);
            let name = format!("{alpha:?} {cos}");
            compare_directions(50_000, 1, |u| Some(ggx.sample_visible_normal(o, [u[0], u[1]])), pdf).check(&name);
            compare_directions(50_000, 2, |u| Some(sample_by_disk(&ggx, o, [u[0], u[1]])), pdf).check(&name);
        }
    }
}

#[test]
fn visible_normals_face_the_viewer_at_every_alpha_and_angle() {
    for alpha in [[1e-4; 2], [1e-3; 2], [0.05; 2], [1.0; 2], [1.0, 1e-4], [0.1, 0.9]] {
        let ggx = Ggx::new(alpha);
        for cos in [1.0, 0.5, 1e-2, 1e-3, 1e-4, 1e-6] {
            let o = direction(cos, 0.1);
            let (mut behind, count) = (0, 20_000);
            for u in random_points(3, count) {
                let m = ggx.sample_visible_normal(o, [u[0], u[1]]);
                assert!(m.is_finite() && (m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0, "{alpha:?} {cos} {m:?}");
                // A normal seen from its edge may turn away by rounding.
                assert!(o.dot(m) > -2e-7, "{alpha:?} {cos} {m:?}");
                behind += u32::from(o.dot(m) <= 0.0);
            }
            assert!(behind <= count / 2000, "{alpha:?} {cos}: {behind}");
        }
    }
}

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
            assert!((ggx.sampled_shadowing(o, i) * g1 - g2).abs() < 1e-5 * g2);
        }
    }
}
