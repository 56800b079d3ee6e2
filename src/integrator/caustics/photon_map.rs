//! Photons, found by place.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::color::Rgb;
use crate::id::LightId;
use crate::math::Vec3;
use crate::math::random::hash64;

/// Light that arrives at a surface after one delta lobe or more.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// Unit geometric normal there, of either side.
    pub n: Vec3,
    /// Unit direction to where the light comes from.
    pub wi: Vec3,
    /// Power times the number of photons traced.
    pub power: Rgb,
    /// Density with which photons arrive, per area and solid angle, over the cosine of `wi` and `n`; choices between
    /// lobes left out.
    pub density: f32,
    /// The light that it comes from.
    pub light: LightId,
    /// Delta lobes on its way.
    pub scatterings: u32,
}

/// Photons in the cells of a grid, of which a hash table has those that are not empty.
#[derive(Debug)]
pub struct PhotonMap {
    /// By bucket.
    photons: Vec<Photon>,
    /// By bucket, its first photon, and the number of photons.
    starts: Vec<u32>,
    radius: f32,
    traced: u32,
}

impl PhotonMap {
    /// The photons that arrived of `traced` ones, to be gathered within a positive `radius`.
    pub fn new(photons: &[Photon], traced: u32, radius: f32) -> Self {
        let buckets = (2 * photons.len()).next_power_of_two();
        let mut map = Self { photons: Vec::new(), starts: Vec::new(), radius, traced };
        let bucket = |photon: &Photon| bucket(map.cell(photon.p), buckets);
        let mut order: Vec<(u32, u32)> =
            photons.par_iter().enumerate().map(|(i, photon)| (bucket(photon), i as u32)).collect();
        order.par_sort_unstable();
        let mut starts = vec![0; buckets + 1];
        for &(bucket, _) in &order {
            starts[bucket as usize + 1] += 1;
        }
        for i in 0..buckets {
            starts[i + 1] += starts[i];
        }
        map.photons = order.iter().map(|&(_, i)| photons[i as usize]).collect();
        map.starts = starts;
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

    /// Visits the photons around a point of a surface with the unit geometric normal `n`.
    #[inline]
    pub fn for_each_near(&self, p: Vec3, n: Vec3, mut visit: impl FnMut(&Photon)) {
        let buckets = self.starts.len() - 1;
        let ([x0, y0, z0], [x1, y1, z1]) = (self.cell(p - self.radius), self.cell(p + self.radius));
        for z in z0..=z1 {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let bucket = bucket([x, y, z], buckets) as usize;
                    for photon in &self.photons[self.starts[bucket] as usize..self.starts[bucket + 1] as usize] {
                        // Cells share buckets.
                        if self.is_near(photon, p, n) && self.cell(photon.p) == [x, y, z] {
                            visit(photon);
                        }
                    }
                }
            }
        }
    }

    /// Whether a photon has arrived within the radius of a point, on a surface that is about the same there.
    #[inline]
    fn is_near(&self, photon: &Photon, p: Vec3, n: Vec3) -> bool {
        let d = photon.p - p;
        d.length_squared() < self.radius * self.radius
            && d.dot(n).abs() < 0.5 * self.radius
            && photon.n.dot(n).abs() > 0.7
    }

    /// Cells are as wide as what is gathered.
    #[inline]
    fn cell(&self, p: Vec3) -> [i32; 3] {
        (p * (0.5 / self.radius)).to_array().map(|x| x.floor() as i32)
    }
}

/// The bucket of a cell, of a power of two.
#[inline]
fn bucket([x, y, z]: [i32; 3], buckets: usize) -> u32 {
    let [x, y, z] = [x, y, z].map(|x| u64::from(x as u32));
    (hash64(hash64(x << 32 | y) ^ z) & (buckets as u64 - 1)) as u32
}
