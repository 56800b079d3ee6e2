//! Photons, found by place.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::color::Rgb;
use crate::id::LightId;
use crate::math::Vec3;
use crate::math::float::floor;

/// Light that arrives at a surface after scattering by delta or near-specular lobes.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// Unit geometric normal there, on the side of `wi`.
    pub n: Vec3,
    /// Unit direction to where the light comes from.
    pub wi: Vec3,
    /// Power times the number of photons traced.
    pub power: Rgb,
    /// Density with which photons arrive, per area and solid angle, over the cosine of `wi` and `n`; choices between
    /// lobes left out. At near-specular lobes it is multiplied by the density of the photon's direction over that with
    /// which paths from the camera find the light there (the root of the sum of the squares of all strategies).
    /// Infinite for delta lights by delta lobes, which such paths never meet.
    pub density: f32,
    /// The light that it comes from.
    pub light: LightId,
    /// Scatterings on its way.
    pub scatterings: u32,
    /// Height above it of the apex from which its disc is projected, over the radius of the disc.
    pub height: f32,
}

impl Photon {
    /// The kernel of the density estimate, 1 on a plane: the area of the disc over that of its projection, at the point
    /// `d` radii from the photon, of a surface with the unit normal `n`. So a curved surface or a slope, whose area is
    /// larger, gathers no more than a plane.
    #[inline]
    fn kernel(&self, d: Vec3, n: Vec3) -> f32 {
        let from_apex = d - self.n * self.height;
        let depth = -from_apex.dot(self.n);
        let per_depth = 1.0 / depth;
        let squared_scale = (self.height * per_depth).powi(2);
        let across = from_apex.length_squared() - depth * depth;
        let is_projected = depth > 0.0 && across * squared_scale < 1.0;
        if is_projected { from_apex.dot(n).abs() * per_depth * squared_scale } else { 0.0 }
    }
}

/// Photons by the cells of a grid from which they can be gathered, each in all of them. Cells share buckets by a hash:
/// the distance decides what is gathered.
#[derive(Debug)]
pub struct PhotonMap {
    photons: Vec<Photon>,
    /// By bucket.
    references: Vec<PhotonReference>,
    /// By bucket, its first reference; one more than there are buckets, whose number is a power of two.
    starts: Vec<u32>,
    radius: f32,
    traced: u32,
}

/// A photon in a bucket, with its point.
#[derive(Clone, Copy, Debug)]
pub struct PhotonReference {
    p: Vec3,
    photon: u32,
}

/// Whether something gathers what is at the distance `d` from it, where its surface has the unit normal `n`.
#[inline]
pub(super) fn is_around(d: Vec3, n: Vec3, radius: f32) -> bool {
    d.length_squared() < radius * radius && d.dot(n).abs() < 0.5 * radius
}

/// Whether two surfaces with these unit normals are about the same.
#[inline]
pub(super) fn is_about_parallel(n: Vec3, other: Vec3) -> bool {
    n.dot(other).abs() > 0.7
}

/// The width of a cell over the radius.
const CELL_WIDTH: f32 = 4.0;

/// References of a photon, about.
const REFERENCES: usize = 4;

impl PhotonMap {
    /// The photons that arrived of `traced` ones, to be gathered within a positive `radius`.
    pub fn new(photons: Vec<Photon>, traced: u32, radius: f32) -> Self {
        let buckets = (REFERENCES * photons.len()).next_power_of_two();
        let mut map = Self { photons, references: Vec::new(), starts: vec![0; buckets + 1], radius, traced };
        let mut keys: Vec<_> = map
            .photons
            .par_iter()
            .enumerate()
            .flat_map_iter(|(i, photon)| {
                map.buckets_of(photon).into_iter().map(move |bucket| (bucket as u32, i as u32))
            })
            .collect();
        keys.par_sort_unstable();
        for &(bucket, _) in &keys {
            map.starts[bucket as usize + 1] += 1;
        }
        for bucket in 0..buckets {
            map.starts[bucket + 1] += map.starts[bucket];
        }
        map.references =
            keys.iter().map(|&(_, i)| PhotonReference { p: map.photons[i as usize].p, photon: i }).collect();
        map
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// The number of photons traced times the area within which they are gathered.
    #[inline]
    pub fn gathered_area(&self) -> f32 {
        self.traced as f32 * PI * self.radius * self.radius
    }

    /// Those that may be near a point.
    #[inline]
    pub fn candidates(&self, p: Vec3) -> &[PhotonReference] {
        let bucket = self.bucket(self.cell(p));
        &self.references[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }

    /// The photons among the candidates of a point that are around it, where a surface has the unit geometric normal
    /// `n`, with their kernels.
    #[inline]
    pub fn near<'a>(
        &'a self,
        candidates: &'a [PhotonReference],
        p: Vec3,
        n: Vec3,
    ) -> impl Iterator<Item = (&'a Photon, f32)> {
        let per_radius = 1.0 / self.radius;
        candidates.iter().filter_map(move |reference| {
            if !is_around(reference.p - p, n, self.radius) {
                return None;
            }
            let photon = &self.photons[reference.photon as usize];
            if !is_about_parallel(photon.n, n) {
                return None;
            }
            let kernel = photon.kernel((p - reference.p) * per_radius, n);
            (kernel > 0.0).then_some((photon, kernel))
        })
    }

    /// The buckets of the cells from which a photon can be gathered, each once.
    fn buckets_of(&self, photon: &Photon) -> Vec<usize> {
        let ([x0, y0, z0], [x1, y1, z1]) = (self.cell(photon.p - self.radius), self.cell(photon.p + self.radius));
        let mut buckets = Vec::with_capacity(REFERENCES);
        for z in z0..=z1 {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let bucket = self.bucket([x, y, z]);
                    if !buckets.contains(&bucket) {
                        buckets.push(bucket);
                    }
                }
            }
        }
        buckets
    }

    #[inline]
    fn cell(&self, p: Vec3) -> [i32; 3] {
        let scaled = p * (1.0 / (CELL_WIDTH * self.radius));
        [floor(scaled.x) as i32, floor(scaled.y) as i32, floor(scaled.z) as i32]
    }

    #[inline]
    fn bucket(&self, [x, y, z]: [i32; 3]) -> usize {
        let mixed = (x as u32).wrapping_mul(0x9e37_79b1)
            ^ (y as u32).wrapping_mul(0x85eb_ca77)
            ^ (z as u32).wrapping_mul(0xc2b2_ae3d);
        (u64::from(mixed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & (self.starts.len() - 2)
    }
}
