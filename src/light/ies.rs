//! Lights that shine as a luminaire was measured.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use super::bounds::{EmissionCone, LightBounds};
use super::{LightSample, PointLight};
use crate::color::Rgb;
use crate::math::{DVec3, Frame};

/// Intensity by direction: a table over the angle from the nadir and the angle about it, bilinear between.
#[derive(Clone, Debug, PartialEq)]
pub struct IesProfile {
    /// Degrees from the nadir, strictly increasing within `[0, 180]`.
    vertical: Vec<f32>,
    /// Degrees about the nadir, strictly increasing.
    horizontal: Vec<f32>,
    /// By planes.
    intensity: Vec<f32>,
    /// Integral over all directions.
    flux: f64,
}

/// Where an angle lies among others: between an entry and the next.
#[derive(Clone, Copy)]
struct Bracket {
    index: usize,
    within: f32,
}

impl IesProfile {
    /// A table as in photometric files of type C: horizontal angles are a single 0 (the same all around), from 0 to 90
    /// or 180 (mirrored), from 0 to 360, or from 90 to 270 (mirrored); `intensity` has a value for each vertical angle,
    /// one horizontal angle after another.
    ///
    /// `None` if the numbers do not make a table.
    pub fn new(vertical: Vec<f32>, horizontal: Vec<f32>, intensity: Vec<f32>) -> Option<Self> {
        let increases = |angles: &[f32]| angles.windows(2).all(|w| w[0] < w[1]);
        let sound = vertical.len() >= 2
            && !horizontal.is_empty()
            && increases(&vertical)
            && increases(&horizontal)
            && vertical.len().checked_mul(horizontal.len()) == Some(intensity.len())
            && intensity.iter().all(|&i| i >= 0.0 && i.is_finite());
        if !sound {
            return None;
        }
        let mut profile = Self { vertical, horizontal, intensity, flux: 0.0 };
        profile.flux = profile.integrate();
        Some(profile)
    }

    /// Intensity at the angles, in degrees, from the nadir (within `[0, 180]`) and about it (any). Nothing beyond the
    /// vertical angles.
    pub fn intensity(&self, from_nadir: f32, about: f32) -> f32 {
        let (first, last) = (self.vertical[0], self.vertical[self.vertical.len() - 1]);
        if !(first..=last).contains(&from_nadir) {
            return 0.0;
        }
        let row = bracket(&self.vertical, from_nadir);
        let plane = |i: usize| {
            let plane = &self.intensity[i * self.vertical.len()..][..self.vertical.len()];
            let next = (row.index + 1).min(plane.len() - 1);
            plane[row.index] * (1.0 - row.within) + plane[next] * row.within
        };
        let column = bracket(&self.horizontal, self.folded(about));
        let next = (column.index + 1).min(self.horizontal.len() - 1);
        plane(column.index) * (1.0 - column.within) + plane(next) * column.within
    }

    /// The angle about the nadir in the range that was measured.
    fn folded(&self, about: f32) -> f32 {
        let (first, last) = (self.horizontal[0], self.horizontal[self.horizontal.len() - 1]);
        let turn = about.rem_euclid(360.0);
        let folded = if first >= 90.0 {
            // Mirrored in the plane of 90 and 270 degrees.
            if turn < 90.0 {
                180.0 - turn
            } else if turn > 270.0 {
                540.0 - turn
            } else {
                turn
            }
        } else if last <= 90.0 {
            let half = turn.rem_euclid(180.0);
            half.min(180.0 - half)
        } else if last <= 180.0 {
            turn.min(360.0 - turn)
        } else {
            turn
        };
        folded.clamp(first, last)
    }

    /// Exact integral of the bilinear intensity over all directions.
    fn integrate(&self) -> f64 {
        let count = self.vertical.len();
        let plane = |i: usize| {
            let values = &self.intensity[i * count..][..count];
            let cell = |k: usize| {
                let [a, b] = [k, k + 1].map(|k| f64::from(self.vertical[k]).to_radians());
                let [fa, fb] = [k, k + 1].map(|k| f64::from(values[k]));
                // The integral of a linear function times the sine.
                fa * a.cos() - fb * b.cos() + (fb - fa) / (b - a) * (b.sin() - a.sin())
            };
            (0..count - 1).map(cell).sum::<f64>()
        };
        if self.horizontal.len() == 1 {
            return TAU * plane(0);
        }
        let planes: Vec<f64> = (0..self.horizontal.len()).map(plane).collect();
        let range = f64::from(self.horizontal[self.horizontal.len() - 1] - self.horizontal[0]);
        let between =
            |i: usize| 0.5 * (planes[i] + planes[i + 1]) * f64::from(self.horizontal[i + 1] - self.horizontal[i]);
        TAU * (0..planes.len() - 1).map(between).sum::<f64>() / range
    }

    /// The largest vertical angle with light, in radians.
    fn reach(&self) -> f64 {
        let count = self.vertical.len();
        let lit = |k: &usize| self.intensity.iter().skip(*k).step_by(count).any(|&i| i > 0.0);
        // Between a lit angle and the next there still is light.
        let last = (0..count).rev().find(lit).map_or(0, |k| (k + 1).min(count - 1));
        f64::from(self.vertical[last]).to_radians()
    }
}

/// The entries around `x`, which lies within them.
fn bracket(entries: &[f32], x: f32) -> Bracket {
    let index = entries.partition_point(|&e| e <= x).saturating_sub(1);
    match entries.get(index + 1) {
        Some(next) => Bracket { index, within: ((x - entries[index]) / (next - entries[index])).clamp(0.0, 1.0) },
        None => Bracket { index, within: 0.0 },
    }
}

/// A point light with a measured profile.
#[derive(Clone, Debug)]
pub struct IesLight {
    source: PointLight,
    /// x towards the profile's angle 0 about the nadir, y towards 90, z along the nadir.
    frame: Frame,
    profile: Arc<IesProfile>,
}

impl IesLight {
    /// A light whose nadir points along `nadir` (any length but zero), turned about it by `rotation` radians. Without a
    /// turn, the angle 0 is the direction towards +X (+Y if the nadir lies along X), and the angle grows
    /// counter-clockwise for one who looks along the nadir.
    ///
    /// The intensity is `intensity` times that of the profile.
    pub fn new(position: DVec3, nadir: DVec3, rotation: f64, intensity: Rgb, profile: Arc<IesProfile>) -> Self {
        let nadir = nadir.normalize_or_zero();
        let across = |axis: DVec3| (axis - nadir * nadir.dot(axis)).normalize_or_zero();
        let zero = if nadir.x.abs() < 1.0 - 1e-9 { across(DVec3::X) } else { across(DVec3::Y) };
        let (sin, cos) = rotation.sin_cos();
        // Counter-clockwise along the nadir: the frame's y is on the left of x.
        let left = zero.cross(nadir);
        let x = zero * cos + left * sin;
        let frame = Frame { x: x.as_vec3(), y: x.cross(nadir).as_vec3(), z: nadir.as_vec3() };
        Self { source: PointLight { position, intensity }, frame, profile }
    }

    /// The light that arrives at `p`; `None` where there is none.
    pub fn sample(&self, p: DVec3) -> Option<LightSample> {
        let mut sample = self.source.sample(p)?;
        let local = self.frame.to_local(-sample.wi);
        let from_nadir = local.x.hypot(local.y).atan2(local.z).to_degrees().min(180.0);
        let factor = self.profile.intensity(from_nadir, local.y.atan2(local.x).to_degrees());
        sample.radiance *= factor;
        (factor > 0.0).then_some(sample)
    }

    /// For the choice of a light.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        let flux = self.power();
        let reach = self.profile.reach();
        let solid_angle = 2.0 * TAU * (0.5 * reach).sin().powi(2);
        let cone = EmissionCone { axis: self.frame.z, spread: reach.min(PI) as f32, reach: 0.0 };
        (flux > 0.0).then(|| LightBounds::at_point(self.source.position, cone, flux / solid_angle))
    }

    /// Emitted power, as luminance.
    pub fn power(&self) -> f64 {
        self.profile.flux * f64::from(self.source.intensity.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(vertical: &[f32], horizontal: &[f32], intensity: &[f32]) -> IesProfile {
        IesProfile::new(vertical.to_vec(), horizontal.to_vec(), intensity.to_vec()).unwrap()
    }

    #[test]
    fn intensities_are_bilinear_between_the_angles_measured() {
        let p = profile(
            &[0.0, 40.0, 90.0],
            &[0.0, 90.0, 180.0, 360.0],
            &[8.0, 4.0, 0.0, 8.0, 2.0, 0.0, 8.0, 6.0, 2.0, 8.0, 4.0, 0.0],
        );
        for (theta, phi, expected) in [
            (0.0, 77.0, 8.0),
            (40.0, 0.0, 4.0),
            (20.0, 0.0, 6.0),
            (40.0, 45.0, 3.0),
            (20.0, 45.0, 5.5),
            (65.0, 0.0, 2.0),
            (90.0, 180.0, 2.0),
            (40.0, 270.0, 5.0),
            (40.0, -90.0, 5.0),
            (90.1, 180.0, 0.0),
        ] {
            assert!((p.intensity(theta, phi) - expected).abs() < 1e-5, "{theta} {phi}: {}", p.intensity(theta, phi));
        }
    }

    #[test]
    fn what_was_not_measured_is_mirrored() {
        let (vertical, around) = ([0.0, 90.0], [0.0, 30.0, 90.0]);
        let quadrant = profile(&vertical, &around, &[1.0, 2.0, 1.0, 5.0, 1.0, 8.0]);
        for phi in [30.0, 150.0, 210.0, 330.0, -30.0] {
            assert!((quadrant.intensity(90.0, phi) - 5.0).abs() < 1e-5, "{phi}");
        }
        let half = profile(&vertical, &[0.0, 180.0], &[1.0, 2.0, 1.0, 6.0]);
        assert!((half.intensity(90.0, 45.0) - 3.0).abs() < 1e-5 && (half.intensity(90.0, 315.0) - 3.0).abs() < 1e-5);
        let other_half = profile(&vertical, &[90.0, 270.0], &[1.0, 2.0, 1.0, 6.0]);
        assert!(
            (other_half.intensity(90.0, 135.0) - 3.0).abs() < 1e-5
                && (other_half.intensity(90.0, 45.0) - 3.0).abs() < 1e-5
        );
        assert!((other_half.intensity(90.0, 300.0) - other_half.intensity(90.0, 240.0)).abs() < 1e-5);
        let all_around = profile(&vertical, &[0.0], &[1.0, 2.0]);
        assert_eq!(all_around.intensity(90.0, 123.0), 2.0);
    }

    #[test]
    fn power_is_the_integral_of_intensity() {
        let tables = [
            profile(&[0.0, 180.0], &[0.0], &[3.0, 3.0]),
            profile(&[0.0, 30.0, 90.0], &[0.0], &[5.0, 3.0, 0.0]),
            profile(&[0.0, 60.0], &[0.0, 90.0], &[2.0, 1.0, 2.0, 7.0]),
            profile(&[90.0, 120.0, 180.0], &[0.0, 100.0, 360.0], &[2.0, 1.0, 4.0, 2.0, 7.0, 4.0, 2.0, 1.0, 4.0]),
        ];
        assert!((tables[0].flux / (12.0 * PI) - 1.0).abs() < 1e-6);
        for table in tables {
            let light = IesLight::new(DVec3::ZERO, -DVec3::Y, 0.3, Rgb::WHITE, Arc::new(table.clone()));
            let n = 1000;
            let mut sum = 0.0;
            for i in 0..n {
                let cos = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                let sin = (1.0 - cos * cos).sqrt();
                for j in 0..n {
                    let (s, c) = (TAU * (f64::from(j) + 0.5) / f64::from(n)).sin_cos();
                    sum += light.sample(DVec3::new(sin * c, cos, sin * s)).map_or(0.0, |s| f64::from(s.radiance.g));
                }
            }
            let flux = sum / f64::from(n * n) * 4.0 * PI;
            assert!((flux / light.power() - 1.0).abs() < 2e-3, "{flux} {}", light.power());
        }
    }

    #[test]
    fn a_hanging_light_turns_counter_clockwise_seen_from_above() {
        // Only towards the angle 90 from 0: without a turn 0 is +X, and counter-clockwise from above (with +X to the
        // right, +Z towards us) is -Z.
        let table = Arc::new(profile(
            &[0.0, 180.0],
            &[0.0, 45.0, 90.0, 135.0, 360.0],
            &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        ));
        let lit = |rotation: f64, p: DVec3| {
            let light = IesLight::new(DVec3::ZERO, -DVec3::Y, rotation, Rgb::WHITE, table.clone());
            light.sample(p).map_or(0.0, |s| s.radiance.g)
        };
        assert!(lit(0.0, -DVec3::Z) > 0.99 && lit(0.0, DVec3::Z) == 0.0 && lit(0.0, DVec3::X) == 0.0);
        assert!(lit(0.5 * PI, -DVec3::X) > 0.99);
        let aside = IesLight::new(DVec3::ZERO, DVec3::X, 0.0, Rgb::WHITE, table.clone());
        assert!(aside.sample(DVec3::Y.cross(DVec3::X)).is_some_and(|s| s.radiance.g > 0.99));
    }

    #[test]
    fn numbers_that_make_no_table_are_refused() {
        assert!(IesProfile::new(vec![0.0], vec![0.0], vec![1.0]).is_none());
        assert!(IesProfile::new(vec![0.0, 90.0], vec![0.0], vec![1.0]).is_none());
        assert!(IesProfile::new(vec![90.0, 0.0], vec![0.0], vec![1.0; 2]).is_none());
        assert!(IesProfile::new(vec![0.0, 90.0], vec![0.0], vec![1.0, f32::NAN]).is_none());
    }
}
