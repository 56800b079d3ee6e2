//! Computes the tables.

use super::super::fresnel;
use super::super::microfacet::reflect;
use super::super::principled::shapes::{self, ClearCoat};
use super::super::{Ggx, SMOOTH_ALPHA};
use super::table::{
    ALPHAS, ASPECTS, CLEAR_COAT, COSINES, DIFFUSE, GLASS, GLASS_AVERAGE, IORS, MAX_IOR, MIRRORS, MIRRORS_AVERAGE, Place, SCHLICK, SHAPES,
    SHEEN, cosine_axis, schlick_weight, smoothed,
};
use crate::math::{Vec3, sin_cos_turns, vec3};
use crate::sampling::warp;

/// Computes the content of `tables.bin`: quadrature over visible normals at every node.
pub fn bake() -> Vec<u8> {
    let mut file = Vec::new();
    let alphas: Vec<f32> = (0..ALPHAS).map(node_alpha).collect();
    let ior: Vec<f32> = (0..IORS).map(node_ior).collect();
    let rows = |f: &dyn Fn(f32, f32) -> f32| table(alphas.iter().flat_map(|&a| row(a).map(move |cos| (a, cos))), f);

    // Mirrors, by aspect and axis.
    let mut mirrors = Vec::new();
    for aspect in 0..ASPECTS {
        for axis in [0, 1] {
            mirrors.extend(rows(&|alpha, cos| {
                let minor = minor_alpha(alpha, aspect);
                let (scale, turns) = if axis == 0 { (1.0, 0.0) } else { (alpha / minor, 0.25) };
                // The direction that these microfacets mask as round ones mask `cos`.
                let tangent = (1.0 - cos * cos).sqrt() / cos * scale;
                mean_of_facets([alpha, minor], direction((1.0 + tangent * tangent).sqrt().recip(), turns), |facet| facet.shadowing)
            }));
        }
    }
    let averages = (0..ASPECTS).flat_map(|aspect| alphas.iter().enumerate().map(move |(i, &alpha)| (aspect, i, alpha)));
    let averages: Vec<f32> = averages.map(|(aspect, i, alpha)| mirrors_average(&mirrors, aspect, i, alpha)).collect();
    MIRRORS.encode(&mirrors, &mut file);
    MIRRORS_AVERAGE.encode(&roots_of_rest(&averages), &mut file);

    // Schlick's weight.
    let weight = |alpha, cos| schlick_weight(smoothed(cos, alpha));
    let values =
        rows(&|alpha, cos| mean_of_facets([alpha; 2], direction(cos, 0.0), |f| f.shadowing * schlick_weight(f.cos)) - weight(alpha, cos));
    SCHLICK.encode(&values, &mut file);

    // Dielectrics.
    let nodes: Vec<(f32, f32)> = alphas.iter().flat_map(|&a| ior.iter().map(move |&n| (a, n))).collect();
    let sides = nodes.iter().map(|&(a, n)| (a, n)).chain(nodes.iter().map(|&(a, n)| (a, 1.0 / n)));
    let glass: Vec<f32> = sides.clone().flat_map(|(alpha, eta)| row(alpha).map(move |cos| glass_albedo(alpha, eta, cos))).collect();
    let averages = sides.zip(glass.chunks(COSINES)).map(|((alpha, _), row)| average(alpha, row));
    GLASS.encode(&glass, &mut file);
    GLASS_AVERAGE.encode(&roots_of_rest(&averages.collect::<Vec<_>>()), &mut file);

    // The principled model's lobes.
    let shape = |i: usize| i as f32 / (SHAPES - 1) as f32;
    let even = || row(1.0);
    let by_shape = |f: fn(f32, f32) -> f32| table((0..SHAPES).flat_map(|i| even().map(move |cos| (shape(i), cos))), &f);
    let diffuse = by_shape(|roughness, cos| mean_of_cosines(cos, |o, i| shapes::diffuse(o, i, roughness)));
    let flat = by_shape(|roughness, cos| mean_of_cosines(cos, |o, i| shapes::flat(o, i, roughness)));
    DIFFUSE.encode(&[diffuse, flat].concat(), &mut file);
    SHEEN.encode(&even().map(|cos| mean_of_cosines(cos, shapes::sheen)).collect::<Vec<_>>(), &mut file);
    CLEAR_COAT.encode(&by_shape(clear_coat_albedo), &mut file);
    file
}

fn table(nodes: impl Iterator<Item = (f32, f32)>, f: &dyn Fn(f32, f32) -> f32) -> Vec<f32> {
    nodes.map(|(a, b)| f(a, b)).collect()
}

/// Alpha at a node; the first stands for the limit, where only the ratio of cosine and alpha counts.
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

/// The cosines at the nodes of a row; the first is not quite zero.
fn row(alpha: f32) -> impl Iterator<Item = f32> {
    (0..COSINES).map(move |node| {
        let axis = node as f32 / (COSINES - 1) as f32;
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if cosine_axis(middle as f32, alpha) < axis { &mut low } else { &mut high }) = middle;
        }
        if node == COSINES - 1 { 1.0 } else { (high as f32).max(1e-6) }
    })
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
        Facet { m, cos, shadowing: if i.z > 0.0 { ggx.sampled_shadowing(o, i) } else { 0.0 } }
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
        let crossing = if i.z < 0.0 { ggx.sampled_shadowing(o, vec3(i.x, i.y, -i.z)) } else { 0.0 };
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

/// Square roots of what averages lack of 1: they keep their digits where nearly nothing is lost.
fn roots_of_rest(averages: &[f32]) -> Vec<f32> {
    averages.iter().map(|average| (1.0 - average).max(0.0).sqrt()).collect()
}

/// Steps of the quadrature over cosines.
const STEPS: usize = 2048;

/// Cosines and their weights under diffuse light, dense at grazing: 2 cos dcos with cos = t^4.
fn cosines() -> impl Iterator<Item = (f32, f64)> {
    (0..STEPS).map(|step| (step as f64 + 0.5) / STEPS as f64).map(|t| (t.powi(4) as f32, 8.0 * t.powi(7) / STEPS as f64))
}

/// The row of a table at a cosine.
fn between(row: &[f32], alpha: f32, cos: f32) -> f32 {
    let at = Place::of_cosine(cos, alpha);
    row[at.node] + (row[at.node + 1] - row[at.node]) * at.part
}

/// Mean of a row under diffuse light.
fn average(alpha: f32, row: &[f32]) -> f32 {
    1.0 - cosines().map(|(cos, weight)| weight * f64::from(1.0 - between(row, alpha, cos))).sum::<f64>() as f32
}

/// Mean over all directions of the table of mirrors at one node of aspect and alpha, as it is read.
fn mirrors_average(mirrors: &[f32], aspect: usize, node: usize, alpha: f32) -> f32 {
    const AZIMUTHS: usize = 32;
    let minor = minor_alpha(alpha, aspect);
    let rows = [0, 1].map(|axis| &mirrors[((2 * aspect + axis) * ALPHAS + node) * COSINES..]);
    let mut lost = 0.0;
    for (cos, weight) in cosines() {
        for azimuth in 0..AZIMUTHS {
            let (y, x) = sin_cos_turns(0.25 * (azimuth as f32 + 0.5) / AZIMUTHS as f32);
            let run_squared = (1.0 - cos * cos) * (x * x + y * y * (minor / alpha).powi(2));
            let masked_as = cos / (cos * cos + run_squared).sqrt();
            let [along, across] = rows.map(|row| between(row, alpha, masked_as));
            lost += weight * f64::from(1.0 - (along + (across - along) * y * y));
        }
    }
    1.0 - (lost / AZIMUTHS as f64) as f32
}
