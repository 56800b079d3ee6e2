//! Cost as the number of triangles grows.

use std::time::Instant;

use serde::Serialize;

use super::machine::processor_seconds;
use super::{Options, Spent, Watch, median_and_range, mesh::sphere_geometry};
use crate::accel::{self, AccelKind};
use crate::math::{Ray, Vec3};
use steradian::Result;

/// Rays for each number of triangles.
const RAYS: usize = 200_000;

/// Costs over several numbers of triangles.
#[derive(Clone, Debug, Serialize)]
pub struct ScalingReport {
    /// Measured costs.
    pub points: Vec<ScalingPoint>,
    /// By accelerator: slopes of the logarithms of the time per ray and of the time of a build over the logarithm of
    /// the number of triangles.
    pub slopes: Vec<(String, f64, f64)>,
    /// What tracing took.
    pub spent: Spent,
}

/// Cost of one accelerator on a mesh of one size.
#[derive(Clone, Debug, Serialize)]
pub struct ScalingPoint {
    /// The accelerator.
    pub accel: String,
    /// Triangles.
    pub triangles: usize,
    /// Time of a build with all threads, in milliseconds.
    pub build_milliseconds: f64,
    /// Time per ray on one thread, in nanoseconds: the median of the rounds.
    pub nanoseconds_per_ray: f64,
    /// Bytes per triangle.
    pub bytes_per_triangle: f64,
}

/// Rays from around the mesh into it, without coherence.
fn rays() -> Vec<Ray> {
    let point = |i: usize, radius: f32, shift: f32| {
        let (u, v) = ((i as f32 * 0.754_877_7 + shift) % 1.0, (i as f32 * 0.569_840_3 + shift) % 1.0);
        let z = 2.0 * u - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
        Vec3::new(cos, sin, 0.0) * ((1.0 - z * z).max(0.0).sqrt() * radius) + Vec3::Z * (z * radius)
    };
    (0..RAYS)
        .map(|i| {
            let from = point(i, 3.0, 0.0);
            Ray::new(from, (point(i, 1.0, 0.37) - from).normalize())
        })
        .collect()
}

/// Builds and traces meshes of growing size, from `first` to `last` triangles by factors of ten.
///
/// # Errors
/// If an accelerator cannot be built.
pub fn bench_scaling(first: usize, last: usize, options: &Options, watch: &dyn Watch) -> Result<ScalingReport> {
    let rays = rays();
    let (mut points, mut spent): (Vec<ScalingPoint>, _) = (Vec::new(), Spent::default());
    let mut triangles = first.max(100);
    while triangles <= last && !watch.is_stopped() {
        watch.step(&format!("scaling: {triangles} triangles"));
        let geometry = sphere_geometry(triangles);
        let count = geometry.shapes[0].prim_count();
        for &kind in &options.accels {
            let affordable =
                if kind == AccelKind::Linear { (options.linear_tests as usize / count).min(RAYS) } else { RAYS };
            if watch.is_stopped() || affordable < 16 {
                continue;
            }
            watch.step(&format!("scaling: {triangles} triangles, {kind}"));
            let start = Instant::now();
            let accel = accel::build(kind, &geometry, 0)?;
            let build_milliseconds = start.elapsed().as_secs_f64() * 1e3;
            let mut times = Vec::new();
            for round in 0..=options.rounds.min(3) {
                let (start, before) = (Instant::now(), processor_seconds());
                std::hint::black_box(rays[..affordable].iter().filter(|ray| accel.intersect(ray).is_some()).count());
                let seconds = start.elapsed().as_secs_f64();
                spent.add(Spent::new(1, seconds, processor_seconds() - before));
                if round > 0 {
                    times.push(seconds * 1e9 / affordable as f64);
                }
            }
            points.push(ScalingPoint {
                accel: kind.to_string(),
                triangles: count,
                build_milliseconds,
                nanoseconds_per_ray: median_and_range(&times)[0],
                bytes_per_triangle: accel.memory_bytes() as f64 / count as f64,
            });
        }
        triangles *= 10;
    }
    let slope = |name: &str, cost: fn(&ScalingPoint) -> f64| {
        let of_accel: Vec<_> =
            points.iter().filter(|p| p.accel == name).map(|p| (p.triangles as f64, cost(p))).collect();
        fitted_slope(&of_accel)
    };
    let names: Vec<String> = options.accels.iter().map(ToString::to_string).collect();
    let slopes = names.into_iter().filter_map(|name| {
        let of_rays = slope(&name, |p| p.nanoseconds_per_ray)?;
        let of_builds = slope(&name, |p| p.build_milliseconds).unwrap_or(0.0);
        Some((name, of_rays, of_builds))
    });
    let slopes = slopes.collect();
    Ok(ScalingReport { points, slopes, spent })
}

/// A straight line through the logarithms of both coordinates, by least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The exponent of the power law.
    pub slope: f64,
    /// Standard error of the slope, from what the points lie off the line; none for two points, which are always on it.
    pub standard_error: Option<f64>,
}

/// Fits a power law; `None` for fewer than two points.
pub fn fit(points: &[(f64, f64)]) -> Option<Fit> {
    let logs: Vec<_> = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let sxx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let sxy: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    if logs.len() < 2 || !(sxx > 0.0) {
        return None;
    }
    let slope = sxy / sxx;
    let off: f64 = logs.iter().map(|p| (p.1 - my - slope * (p.0 - mx)).powi(2)).sum();
    let standard_error = (logs.len() > 2).then(|| (off / (n - 2.0) / sxx).sqrt());
    Some(Fit { slope, standard_error })
}

/// The slope of [`fit`].
pub fn fitted_slope(points: &[(f64, f64)]) -> Option<f64> {
    fit(points).map(|fit| fit.slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_has_its_exponent_as_slope() {
        let points: Vec<_> = [1e3, 1e4, 1e5].iter().map(|x: &f64| (*x, 7.0 * x.powf(0.25))).collect();
        assert!((fitted_slope(&points).unwrap() - 0.25).abs() < 1e-12);
        assert!(fitted_slope(&points[..1]).is_none());
        let exact = fit(&points).unwrap().standard_error.unwrap();
        assert!(exact < 1e-12 && fit(&points[..2]).unwrap().standard_error.is_none());
        // Three logarithms off a line by 1, -2 and 1 times ln 2: the sum of squares is 6 (ln 2)², that of x is 2 (ln
        // 10)².
        let off: Vec<_> = points.iter().zip([2.0, 0.25, 2.0]).map(|((x, y), factor)| (*x, y * factor)).collect();
        let expected = 3f64.sqrt() * 2f64.ln() / 10f64.ln();
        assert!((fit(&off).unwrap().standard_error.unwrap() - expected).abs() < 1e-12);
    }
}
