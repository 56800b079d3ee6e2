//! Volumes of noise: clouds and smoke without a file.

use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};

use crate::math::random::hash64;
use crate::math::{Vec3, vec3};

/// Fractional Brownian motion: octaves of gradient noise (Perlin, "Improving Noise"), each of twice the frequency and
/// half the amplitude of the one before, sampled at the middles of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Voxels along x, y and z.
    pub resolution: [u32; 3],
    /// Cells of the first octave along each axis.
    pub frequency: [f32; 3],
    /// How many octaves.
    pub octaves: u32,
    /// Which of all noises.
    pub seed: u32,
    /// What the noise is added to,
    pub base: f32,
    /// after it was multiplied by this;
    pub amplitude: f32,
    /// what is taken away on the ellipsoid that touches the box from within, and in proportion to the squared distance
    /// from its middle elsewhere.
    pub fade: f32,
}

impl Noise {
    /// The values of the voxels, from 0 to 1, by z, then y, then x.
    pub fn values(&self) -> Vec<f32> {
        let [nx, ny, nz] = self.resolution.map(|n| n as usize);
        let mut values = vec![0.0; nx * ny * nz];
        values.par_iter_mut().with_min_len(1 << 12).enumerate().for_each(|(i, value)| {
            let middle = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
            *value = self.at(vec3(middle(i % nx, nx), middle(i / nx % ny, ny), middle(i / nx / ny, nz)));
        });
        values
    }

    /// The value at a point of the unit cube.
    fn at(&self, p: Vec3) -> f32 {
        let (mut scale, mut amplitude, mut sum) = (Vec3::from(self.frequency), 1.0, 0.0);
        for octave in 0..self.octaves {
            sum += amplitude * gradient_noise(p * scale, hash64(u64::from(self.seed) << 8 | u64::from(octave)));
            (scale, amplitude) = (2.0 * scale, 0.5 * amplitude);
        }
        let distance_squared = (2.0 * p - Vec3::ONE).length_squared();
        (self.base + self.amplitude * sum - self.fade * distance_squared).clamp(0.0, 1.0)
    }
}

/// Gradient noise within about -1 to 1, zero at the corners of cells.
fn gradient_noise(p: Vec3, seed: u64) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let [x, y, z] = cell.to_array().map(|x| x as i64);
    let corner = |dx: u8, dy: u8, dz: u8| {
        let of = |x: i64, d: u8| x.wrapping_add(i64::from(d)) as u64;
        let hash = hash64(of(x, dx) ^ hash64(of(y, dy) ^ hash64(of(z, dz) ^ seed)));
        let d = f - vec3(f32::from(dx), f32::from(dy), f32::from(dz));
        // The edges of a cube, four of them twice.
        let (a, b) = match hash >> 60 {
            0..4 => (d.x, d.y),
            4..8 => (d.x, d.z),
            8..12 => (d.y, d.z),
            12..14 => (d.x, d.y),
            _ => (d.y, d.z),
        };
        let sign = |bit: u64, x: f32| if bit & 1 == 0 { x } else { -x };
        sign(hash >> 32, a) + sign(hash >> 33, b)
    };
    // Zero slope and curvature at the corners.
    let fade = |t: f32| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let (u, v, w) = (fade(f.x), fade(f.y), fade(f.z));
    let row = |dy: u8, dz: u8| mix(corner(0, dy, dz), corner(1, dy, dz), u);
    mix(mix(row(0, 0), row(1, 0), v), mix(row(0, 1), row(1, 1), v), w)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise {
        resolution: [24, 20, 28],
        frequency: [3.0; 3],
        octaves: 3,
        seed: 1,
        base: 0.5,
        amplitude: 0.4,
        fade: 0.0,
    };

    #[test]
    fn noise_is_balanced_continuous_and_another_with_another_seed() {
        let values = NOISE.values();
        assert_eq!(values.len(), 24 * 20 * 28);
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        // About 27 cells of the first octave: the mean is as wide as their mean.
        assert!((mean - 0.5).abs() < 0.05, "{mean}");
        let deviation = values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32;
        assert!(deviation > 0.005, "{deviation}");
        assert_ne!(values, Noise { seed: 2, ..NOISE }.values());
        for i in 0..1000 {
            let p = Vec3::splat(i as f32 / 1000.0);
            assert!((NOISE.at(p) - NOISE.at(p + 1e-4)).abs() < 0.01, "{p}");
        }
    }

    #[test]
    fn corners_of_cells_are_zero_and_fading_takes_away() {
        for i in 0..10u16 {
            assert_eq!(gradient_noise(Vec3::splat(f32::from(i)), 5), 0.0);
        }
        let ball = Noise { amplitude: 0.0, base: 0.75, fade: 1.0, ..NOISE };
        assert_eq!(ball.at(Vec3::splat(0.5)), 0.75);
        assert_eq!(ball.at(vec3(0.75, 0.5, 0.5)), 0.5);
        assert_eq!(ball.at(Vec3::ZERO), 0.0);
    }
}
