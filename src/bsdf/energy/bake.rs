//! Computes the tables.

use super::super::coat::{above_axis, first_encounter};
use super::super::fresnel;
use super::super::microfacet::{Microfacets, reflect};
use super::super::principled::shapes::{self, ClearCoat};
use super::super::{Ggx, SMOOTH_ALPHA};
use super::table::{
    ALPHAS, ASPECTS, Block, CLEAR_COAT, COAT, COAT_AVERAGE, COAT_NODES, COSINES, DIFFUSE, GLASS, GLASS_AVERAGE, IORS,
    MAX_IOR, REFLECTION, REFLECTION_AVERAGE, SCHLICK, SHAPES, SHEEN, TableCoordinate, across, cosine_axis,
    schlick_weight, smoothed,
};
use crate::math::{Vec3, sin_cos_turns, vec3};
use crate::sampling::warp;

/// Where the entries of a block come from.
#[derive(Clone, Copy)]
enum TableValue {
    /// Each from its number.
    Number(fn(usize) -> f32),
    /// Each from its number and the entries of the block before.
    BlockBefore(fn(usize, &[f32]) -> f32),
}

/// The blocks in the order of the file.
const SOURCES: [(Block, TableValue); 10] = [
    (REFLECTION, TableValue::Number(reflection)),
    (REFLECTION_AVERAGE, TableValue::BlockBefore(reflection_average)),
    (SCHLICK, TableValue::Number(schlick)),
    (GLASS, TableValue::Number(glass)),
    (GLASS_AVERAGE, TableValue::BlockBefore(glass_average)),
    (DIFFUSE, TableValue::Number(diffuse)),
    (SHEEN, TableValue::Number(sheen)),
    (CLEAR_COAT, TableValue::Number(clear_coat)),
    (COAT, TableValue::Number(coat)),
    (COAT_AVERAGE, TableValue::BlockBefore(coat_average)),
];

/// Computes the content of `tables.bin`: quadrature over visible normals at every node.
pub fn bake() -> Vec<u8> {
    let (mut file, mut before) = (Vec::new(), Vec::new());
    for (block, source) in SOURCES {
        let values: Vec<f32> = (0..block.len()).map(|entry| value(source, entry, &before)).collect();
        block.encode(&values, &mut file);
        before = values;
    }
    file
}

fn value(source: TableValue, entry: usize, before: &[f32]) -> f32 {
    match source {
        TableValue::Number(f) => f(entry),
        TableValue::BlockBefore(f) => f(entry, before),
    }
}

/// The place of an entry along each of the axes, the last of which changes fastest.
fn places<const N: usize>(mut entry: usize, counts: [usize; N]) -> [usize; N] {
    let mut places = [0; N];
    for (place, count) in places.iter_mut().zip(counts).rev() {
        *place = entry % count;
        entry /= count;
    }
    places
}

fn reflection(entry: usize) -> f32 {
    let [aspect, axis, alpha, cos] = places(entry, [ASPECTS, 2, ALPHAS, COSINES]);
    let alpha = node_alpha(alpha);
    let (minor, cos) = (minor_alpha(alpha, aspect), node_cosine(alpha, cos));
    let (scale, turns) = if axis == 0 { (1.0, 0.0) } else { (alpha / minor, 0.25) };
    // The direction that these microfacets mask as round ones mask `cos`.
    let tangent = (1.0 - cos * cos).sqrt() / cos * scale;
    mean_of_facets([alpha, minor], direction((1.0 + tangent * tangent).sqrt().recip(), turns), |facet| facet.shadowing)
}

fn reflection_average(entry: usize, reflection: &[f32]) -> f32 {
    let [aspect, alpha] = places(entry, [ASPECTS, ALPHAS]);
    root_of_rest(average_of_reflection(reflection, aspect, alpha, node_alpha(alpha)))
}

/// Of Schlick's weight.
fn schlick(entry: usize) -> f32 {
    let [alpha, cos] = places(entry, [ALPHAS, COSINES]);
    let alpha = node_alpha(alpha);
    let cos = node_cosine(alpha, cos);
    mean_of_facets([alpha; 2], direction(cos, 0.0), |f| f.shadowing * schlick_weight(f.cos))
        - schlick_weight(smoothed(cos, alpha))
}

fn glass(entry: usize) -> f32 {
    let [side, alpha, ior, cos] = places(entry, [2, ALPHAS, IORS, COSINES]);
    let (alpha, ior) = (node_alpha(alpha), node_ior(ior));
    glass_albedo(alpha, if side == 0 { ior } else { 1.0 / ior }, node_cosine(alpha, cos))
}

fn glass_average(entry: usize, glass: &[f32]) -> f32 {
    let [_, alpha, _] = places(entry, [2, ALPHAS, IORS]);
    root_of_rest(average(node_alpha(alpha), &glass[entry * COSINES..][..COSINES]))
}

/// The principled model's diffuse lobe, then its flat one.
fn diffuse(entry: usize) -> f32 {
    let [subsurface, shape, cos] = places(entry, [2, SHAPES, COSINES]);
    let (roughness, cos) = (node_shape(shape), node_cosine(1.0, cos));
    let lobe = if subsurface == 1 { shapes::subsurface } else { shapes::diffuse };
    mean_of_cosines(cos, |o, i| lobe(o, i, roughness))
}

fn sheen(entry: usize) -> f32 {
    mean_of_cosines(node_cosine(1.0, entry), shapes::sheen)
}

fn clear_coat(entry: usize) -> f32 {
    let [shape, cos] = places(entry, [SHAPES, COSINES]);
    clear_coat_albedo(node_shape(shape), node_cosine(1.0, cos))
}

fn coat(entry: usize) -> f32 {
    let [alpha, ior, node] = places(entry, [ALPHAS, IORS, COAT_NODES]);
    let root = node as f32 / (COAT_NODES - 1) as f32;
    first_encounter(node_ior(ior), &Ggx::new([node_alpha(alpha); 2]), above_axis(root * root, 0)).reflected
}

/// Of the table as it is read, linear in the square root of the cosine.
fn coat_average(entry: usize, coat: &[f32]) -> f32 {
    let row = &coat[entry * COAT_NODES..][..COAT_NODES];
    let mean = cosines().map(|(cos, weight)| {
        let at = TableCoordinate::new(cos.sqrt(), COAT_NODES);
        weight * f64::from(row[at.node] + (row[at.node + 1] - row[at.node]) * at.part)
    });
    mean.sum::<f64>() as f32
}

/// Alpha at a node; the first is the limit, where only the ratio of cosine and alpha counts.
fn node_alpha(node: usize) -> f32 {
    let root = node as f32 / (ALPHAS - 1) as f32;
    (root * root).max(1e-3)
}

/// The smaller alpha at a node of the aspect.
fn minor_alpha(alpha: f32, aspect: usize) -> f32 {
    let root = aspect as f32 / (ASPECTS - 1) as f32;
    (alpha * root * root).max(SMOOTH_ALPHA)
}

fn node_ior(node: usize) -> f32 {
    let root = node as f32 / (IORS - 1) as f32;
    let x = root * root * (MAX_IOR - 1.0) / (MAX_IOR + 1.0);
    (1.0 + x) / (1.0 - x)
}

fn node_shape(node: usize) -> f32 {
    node as f32 / (SHAPES - 1) as f32
}

/// The cosine at a node; the first is not quite zero.
fn node_cosine(alpha: f32, node: usize) -> f32 {
    let axis = node as f32 / (COSINES - 1) as f32;
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if cosine_axis(middle as f32, alpha) < axis { &mut low } else { &mut high }) = middle;
    }
    if node == COSINES - 1 { 1.0 } else { (high as f32).max(1e-6) }
}

fn direction(cos: f32, turns: f32) -> Vec3 {
    let (y, x) = sin_cos_turns(turns);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    vec3(sin * x, sin * y, cos)
}

/// A microfacet visible from a direction.
struct Facet {
    /// Its normal.
    m: Vec3,
    /// Cosine between normal and direction.
    cos: f32,
    /// Fraction of what it reflects that is not masked on its way out.
    shadowing: f32,
}

/// Points of a Fibonacci lattice.
fn lattice() -> impl ExactSizeIterator<Item = [f32; 2]> {
    const POINTS: u32 = 4181;
    const STEP: u32 = 2584;
    (0..POINTS).map(|point| [point, point * STEP % POINTS].map(|x| (x as f32 + 0.5) / POINTS as f32))
}

/// Mean over the microfacets visible from `o`.
fn mean_of_facets(alpha: [f32; 2], o: Vec3, f: impl Fn(&Facet) -> f32) -> f32 {
    let ggx = Ggx::new(alpha);
    let facets = lattice().map(|u| {
        let m = ggx.sample_visible_normal(o, u);
        let cos = o.dot(m).clamp(0.0, 1.0);
        let i = reflect(o, m, cos);
        Facet { m, cos, shadowing: if i.z > 0.0 { ggx.g2_over_g1(o, i) } else { 0.0 } }
    });
    mean(facets.map(|facet| f(&facet)))
}

fn mean(values: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = values.len();
    (values.map(f64::from).sum::<f64>() / count as f64) as f32
}

fn glass_albedo(alpha: f32, eta: f32, cos: f32) -> f32 {
    let (ggx, o) = (Ggx::new([alpha; 2]), direction(cos, 0.0));
    mean_of_facets([alpha; 2], o, |facet| {
        let refraction = fresnel::dielectric(facet.cos, eta);
        let i = facet.m * (facet.cos / eta - refraction.cos_t) - o / eta;
        let crossing = if i.z < 0.0 { ggx.g2_over_g1(o, vec3(i.x, i.y, -i.z)) } else { 0.0 };
        refraction.reflectance * facet.shadowing + (1.0 - refraction.reflectance) * crossing
    })
}

/// Integral over the cosine hemisphere of a lobe that carries its cosine.
fn mean_of_cosines(cos: f32, lobe: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let o = direction(cos, 0.0);
    mean(lattice().map(|u| {
        let i = warp::cosine_hemisphere(u);
        if i.z > 0.0 { lobe(o, i) / warp::cosine_hemisphere_pdf(i.z) } else { 0.0 }
    }))
}

fn clear_coat_albedo(gloss: f32, cos: f32) -> f32 {
    let (coat, o) = (ClearCoat::new(gloss), direction(cos, 0.0));
    mean(lattice().map(|u| {
        let i = coat.sample(o, u);
        let (value, pdf) = if i.z > 0.0 { coat.eval(o, i) } else { (0.0, 1.0) };
        if pdf > 0.0 { value / pdf } else { 0.0 }
    }))
}

/// Square root of what an average lacks of 1: it keeps its digits where nearly nothing is lost.
fn root_of_rest(average: f32) -> f32 {
    (1.0 - average).max(0.0).sqrt()
}

/// Steps of the quadrature over cosines.
const STEPS: usize = 2048;

/// Cosines and their weights under diffuse light, dense at grazing: 2 cos dcos with cos = t^4.
fn cosines() -> impl Iterator<Item = (f32, f64)> {
    (0..STEPS)
        .map(|step| (step as f64 + 0.5) / STEPS as f64)
        .map(|t| (t.powi(4) as f32, 8.0 * t.powi(7) / STEPS as f64))
}

/// The row of a table at a cosine.
fn between(row: &[f32], alpha: f32, cos: f32) -> f32 {
    let at = TableCoordinate::of_cosine(cos, alpha);
    row[at.node] + (row[at.node + 1] - row[at.node]) * at.part
}

/// Mean of a row under diffuse light.
fn average(alpha: f32, row: &[f32]) -> f32 {
    1.0 - cosines().map(|(cos, weight)| weight * f64::from(1.0 - between(row, alpha, cos))).sum::<f64>() as f32
}

/// Mean over all directions of the table of reflection at one node of aspect and alpha, as it is read.
fn average_of_reflection(reflection: &[f32], aspect: usize, node: usize, alpha: f32) -> f32 {
    const AZIMUTHS: usize = 32;
    let minor = minor_alpha(alpha, aspect);
    let rows = [0, 1].map(|axis| &reflection[((2 * aspect + axis) * ALPHAS + node) * COSINES..]);
    let mut lost = 0.0;
    for (cos, weight) in cosines() {
        for azimuth in 0..AZIMUTHS {
            let (y, x) = sin_cos_turns(0.25 * (azimuth as f32 + 0.5) / AZIMUTHS as f32);
            let run_squared = (1.0 - cos * cos) * (x * x + y * y * (minor / alpha).powi(2));
            let masked_as = cos / (cos * cos + run_squared).sqrt();
            let [along, beyond] = rows.map(|row| between(row, alpha, masked_as));
            lost += weight * f64::from(1.0 - (along + (beyond - along) * across(x * x, y * y, minor / alpha)));
        }
    }
    1.0 - (lost / AZIMUTHS as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_what_the_code_computes() {
        // Some entries of every block, spread over it by a prime, baked again: equal to two steps of their 16 bits,
        // which leaves room for another machine's logarithm. A block of averages is computed from the committed block
        // before it; most hold roots of small numbers, which must be as close themselves.
        let mut before = Vec::new();
        for (number, (block, source)) in SOURCES.into_iter().enumerate() {
            let committed: Vec<f32> = (0..block.len()).map(|entry| block.at(entry)).collect();
            for i in 0..24 {
                let entry = (i * 7919 + 311 * number) % block.len();
                let (fresh, old) = (value(source, entry, &before), committed[entry]);
                let scale = if matches!(source, TableValue::BlockBefore(_)) { (fresh + old).min(1.0) } else { 1.0 };
                assert!(
                    (fresh - old).abs() * scale <= 2.0 * block.step(),
                    "block {number}, entry {entry}: {fresh} {old}"
                );
            }
            before = committed;
        }
    }
}
