//! Rays with exact hits from arithmetic of 256 bits, as `xtask/src/make_vectors.rs` writes them.

use crate::math::{DVec3, Ray, Vec3};

/// A ray at a quadric or a flat shape.
pub struct ShapeVector {
    /// The ray.
    pub ray: Ray,
    /// The shape's translation.
    pub center: DVec3,
    /// Distance and point of the hit, rounded to `f64`.
    pub hit: Option<(f64, DVec3)>,
    /// One over the cosine between ray and normal; zero on a miss.
    pub condition: f64,
}

/// A ray at a surface of revolution.
pub struct RevolutionVector {
    /// The ray.
    pub ray: Ray,
    /// Distances of all hits, rounded to `f64`.
    pub hits: Vec<f64>,
}

/// Name of the shape and text of its file.
pub const SHAPES: &[(&str, &str)] = &[
    ("sphere", include_str!("vectors/sphere.txt")),
    ("cylinder", include_str!("vectors/cylinder.txt")),
    ("cone", include_str!("vectors/cone.txt")),
    ("frustum", include_str!("vectors/frustum.txt")),
    ("disk", include_str!("vectors/disk.txt")),
    ("ring", include_str!("vectors/ring.txt")),
    ("quad", include_str!("vectors/quad.txt")),
];

/// Name of the profile and text of its file.
pub const PROFILES: &[(&str, &str)] = &[
    ("vase", include_str!("vectors/vase.txt")),
    ("looping", include_str!("vectors/looping.txt")),
    ("ball", include_str!("vectors/ball.txt")),
];

const VALID: &str = "the files of vectors are well formed";

fn f32s<'a>(words: &mut impl Iterator<Item = &'a str>) -> Vec3 {
    let mut next = || f32::from_bits(u32::from_str_radix(words.next().expect(VALID), 16).expect(VALID));
    Vec3::new(next(), next(), next())
}

fn f64_of(word: &str) -> f64 {
    f64::from_bits(u64::from_str_radix(word, 16).expect(VALID))
}

fn lines(text: &str) -> impl Iterator<Item = std::str::SplitWhitespace<'_>> {
    text.lines().filter(|line| !line.starts_with('#')).map(str::split_whitespace)
}

/// How many rays were left out because the digits of `f64` cannot decide them.
pub fn excluded(text: &str) -> usize {
    text.lines().find_map(|line| line.strip_prefix("# excluded ")).and_then(|n| n.parse().ok()).expect(VALID)
}

/// The rays of one of [`SHAPES`].
pub fn shape_vectors(text: &str) -> impl Iterator<Item = ShapeVector> {
    lines(text).map(|mut words| {
        let ray = Ray::new(f32s(&mut words), f32s(&mut words));
        let rest: Vec<&str> = words.collect();
        let point = |at: usize| DVec3::new(f64_of(rest[at]), f64_of(rest[at + 1]), f64_of(rest[at + 2]));
        let hit = (rest.len() > 3).then(|| (f64_of(rest[3]), point(4)));
        ShapeVector {
            ray,
            center: point(0),
            hit,
            condition: rest.get(7).map_or(0.0, |word| word.parse().expect(VALID)),
        }
    })
}

/// The rays of one of [`PROFILES`].
pub fn revolution_vectors(text: &str) -> impl Iterator<Item = RevolutionVector> {
    lines(text).map(|mut words| RevolutionVector {
        ray: Ray::new(f32s(&mut words), f32s(&mut words)),
        hits: words.map(f64_of).collect(),
    })
}
