//! Ways to start a ray at a surface, side by side: how often it finds its own face again, and how often it leaks out of
//! a closed box.

use super::{Effort, Outcome, accelerators};
use crate::accel::Accelerator;
use crate::geometry::{Geometry, SurfaceInteraction};
use crate::math::{DMat3, DVec3, Ray, Vec3};
use crate::stability::Plot;
use crate::stability::geometry::{Rng, closest, cube, meshes, ray};

/// A way to start a ray.
#[derive(Clone, Copy, PartialEq)]
enum Scheme {
    /// Moved by the bound of the error, and false hits rejected in `f64`.
    ErrorBound,
    /// Not moved at all.
    None,
    /// A smallest distance in scene units.
    FixedStart,
    /// Some floats away along each axis; near zero, some scene units (Wächter and Binder, "A Fast and Robust Method for
    /// Avoiding Self-Intersection").
    Floats,
    /// Along the normal, in proportion to the largest coordinate and at least some scene units, as Mitsuba does.
    AlongNormal,
}

const SCHEMES: [(Scheme, &str); 5] = [
    (Scheme::ErrorBound, "error bound"),
    (Scheme::None, "none"),
    (Scheme::FixedStart, "from 1e-4 along the ray"),
    (Scheme::Floats, "Waechter-Binder"),
    (Scheme::AlongNormal, "along the normal"),
];

/// The distances that other programs use, in scene units.
const FIXED_DISTANCE: f32 = 1e-4;
const NORMAL_DISTANCE: f32 = 8.94e-5;

/// Each coordinate of `p` moved by 256 floats times that of `n`; below 1/32 by 1/65536 times it.
fn moved_by_floats(p: Vec3, n: Vec3) -> Vec3 {
    let moved = |p: f32, n: f32| {
        if p.abs() < 1.0 / 32.0 {
            return p + n / 65_536.0;
        }
        let floats = (256.0 * n) as i32;
        f32::from_bits(p.to_bits().wrapping_add_signed(if p < 0.0 { -floats } else { floats }))
    };
    Vec3::new(moved(p.x, n.x), moved(p.y, n.y), moved(p.z, n.z))
}

impl Scheme {
    /// The next hit in `direction`, inside of the box.
    fn next(
        self,
        accel: &dyn Accelerator,
        geometry: &Geometry,
        at: &SurfaceInteraction,
        direction: Vec3,
    ) -> Option<u32> {
        if self == Self::ErrorBound {
            return closest(accel, geometry, &at.spawn(direction)).found.map(|found| found.prim.0);
        }
        let (p, n) = (at.p.as_vec3(), if at.n_g.dot(direction) < 0.0 { -at.n_g } else { at.n_g });
        let ray = match self {
            Self::ErrorBound | Self::None => Ray::new(p, direction),
            Self::FixedStart => Ray { t_min: FIXED_DISTANCE, ..Ray::new(p, direction) },
            Self::Floats => Ray::new(moved_by_floats(p, n), direction),
            Self::AlongNormal => Ray::new(p + n * (NORMAL_DISTANCE * (1.0 + p.abs().max_element())), direction),
        };
        accel.intersect(&ray).map(|hit| hit.prim.0)
    }
}

/// Fractions of false hits and of leaks by scheme.
fn rates(rng: &mut Rng, half: f64, distance: f64, count: usize) -> [[f64; 2]; SCHEMES.len()] {
    const BOXES: usize = 4;
    let mut counts = [[0usize; 2]; SCHEMES.len()];
    let mut rays = 0;
    for _ in 0..BOXES {
        let center = DVec3::new(0.8, -0.5, 0.3) * distance;
        let linear: DMat3 = rng.rotation() * half;
        let geometry = meshes(vec![cube(linear, center)]);
        let (_, embree) = &accelerators(&geometry)[0];
        for _ in 0..count / BOXES {
            let Some(si) = closest(&**embree, &geometry, &ray(center, rng.direction())).found else { continue };
            let direction = rng.direction_around(-si.n_g.as_dvec3()).as_vec3();
            rays += 1;
            for ((scheme, _), [again, leaks]) in SCHEMES.iter().zip(&mut counts) {
                match scheme.next(&**embree, &geometry, &si, direction) {
                    None => *leaks += 1,
                    // A face is two triangles.
                    Some(prim) => *again += usize::from(prim / 2 == si.prim.0 / 2),
                }
            }
        }
    }
    counts.map(|count| count.map(|n| n as f64 / f64::from(rays.max(1))))
}

/// A sweep with its four curves for each scheme.
fn sweep(x: &str, points: &[(f64, [[f64; 2]; SCHEMES.len()])]) -> [Plot; 2] {
    [(0, "False hits"), (1, "Leaks")].map(|(kind, what)| Plot {
        caption: format!("{what} of rays in a closed box over its {x}"),
        x: x.to_string(),
        y: "fraction".to_string(),
        floor: 1e-5,
        curves: SCHEMES
            .iter()
            .enumerate()
            .map(|(i, (_, name))| (name.to_string(), points.iter().map(|(x, rates)| (*x, rates[i][kind])).collect()))
            .collect(),
    })
}

pub(super) fn b13_schemes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(13);
    let count = effort.pick(4_000, 200_000);
    let by_scale: Vec<_> =
        (-6..=6).map(|k| 10f64.powi(k)).map(|half| (half, rates(&mut rng, half, 0.0, count))).collect();
    let by_distance: Vec<_> =
        (0..=7).map(|k| 10f64.powi(k)).map(|distance| (distance, rates(&mut rng, 1000.0, distance, count))).collect();

    let worst = |points: &[(f64, [[f64; 2]; SCHEMES.len()])], scheme: usize, kind: usize| {
        points.iter().map(|(_, rates)| rates[scheme][kind]).fold(0f64, f64::max)
    };
    let mut outcome = Outcome::new();
    for (i, (scheme, name)) in SCHEMES.iter().enumerate() {
        let (again, leaks) =
            (worst(&by_scale, i, 0).max(worst(&by_distance, i, 0)), [&by_scale, &by_distance].map(|p| worst(p, i, 1)));
        outcome = if *scheme == Scheme::ErrorBound {
            outcome
                .at_most("error bound: false hits, largest fraction", again, 0.0)
                .at_most("error bound: leaks over size, largest fraction", leaks[0], 0.0)
                // Corners are rounded to 1e-3 of the size there.
                .at_most("error bound: leaks over distance, largest fraction", leaks[1], 5e-4)
        } else {
            outcome
                .record(format!("{name}: false hits, largest fraction"), again)
                .record(format!("{name}: leaks, largest fraction"), leaks[0].max(leaks[1]))
        };
    }
    let [a, b] = sweep("half size", &by_scale);
    let [c, d] = sweep("distance from the world's centre", &by_distance);
    outcome.plot(a).plot(b).plot(c).plot(d)
}
