//! Scattering along paths that start at lights (adjoint BSDFs: Veach 1997, chapter 5).

use super::Context;
use super::block::Vertices;
use super::direct::shadowing;
use crate::color::Rgb;
use crate::integrator::vertex::HemisphereTest;

/// How the sampled direction of a vertex scatters the flux of a path from a light.
pub(super) struct AdjointScattering {
    /// The flux that goes on.
    pub flux: Rgb,
    /// The density with which a path from the camera chooses the direction back; 0 for delta lobes.
    pub reversed_pdf: f32,
}

/// The test of the sampled direction and the direction back.
fn hemisphere_test(vertices: &Vertices, lane: usize) -> HemisphereTest {
    let Vertices { rows, scatter, .. } = vertices;
    let cos = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    HemisphereTest::new([rows.wo.0[2][lane], scatter.wi.0[2][lane]], [rows.cos_geometric[lane], cos])
}

/// Whether a path the other way can be scattered likewise: not where the direction is below the facet.
pub(super) fn is_reversible(vertices: &Vertices, lane: usize) -> bool {
    hemisphere_test(vertices, lane).agrees()
}

/// Scatters the flux that arrives at a vertex in the sampled direction, if that is reversible.
pub(super) fn scatter(context: &Context, vertices: &Vertices, lane: usize) -> AdjointScattering {
    let Vertices { rows, scatter, .. } = vertices;
    let test = hemisphere_test(vertices, lane);
    if !test.agrees() {
        return AdjointScattering { flux: Rgb::BLACK, reversed_pdf: 0.0 };
    }
    let flux = rows.throughput.get(lane);
    if scatter.is_delta[lane] != 0 {
        let factor = scatter.rr_factor[lane] * shading_ratio(vertices, lane);
        return AdjointScattering { flux: flux * scatter.weight.get(lane) * factor, reversed_pdf: 0.0 };
    }
    let (wi, out) = (rows.wo.get(lane), scatter.wi.get(lane));
    let cos_out = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    let toward = vertices.reversed_eval(context.scene, lane, out);
    let factor = shadowing::<true>(test, [rows.cos_geometric[lane], wi.z, rows.cos_normals[lane]]);
    let weight = (cos_out / (rows.cos_geometric[lane] * scatter.pdf[lane])).abs() * factor;
    AdjointScattering { flux: flux * toward.value * weight, reversed_pdf: toward.pdf }
}

/// By how much a delta lobe changes the product of solid angle and projected area of a beam, from `wo` to the sampled
/// direction: nothing but for refraction, and for shading normals.
pub(super) fn beam_ratio(vertices: &Vertices, lane: usize) -> f32 {
    shading_ratio(vertices, lane) / vertices.scatter.rr_factor[lane]
}

/// [`beam_ratio`] without refraction: the correction of shading normals for adjoint paths (Veach 1997, section 5.3).
fn shading_ratio(vertices: &Vertices, lane: usize) -> f32 {
    let Vertices { rows, scatter, .. } = vertices;
    let cos = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    let ratio = (cos * rows.wo.0[2][lane]) / (rows.cos_geometric[lane] * scatter.wi.0[2][lane]);
    if ratio.is_finite() { ratio.abs() } else { 0.0 }
}
