//! Whether accelerators give the same answers.

use rayon::prelude::*;
use serde::Serialize;

use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Shape};
use crate::math::Ray;
use crate::math::float::UNIT_ROUNDOFF;

/// How many disagreements are kept.
const KEPT: usize = 10;

/// How the answers to many rays compare with those of an oracle.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Agreement {
    /// Rays compared.
    pub rays: usize,
    /// The very same answer, bit for bit.
    pub identical: usize,
    /// The same primitive at a distance within the bound of rounding.
    pub within_bound: usize,
    /// Another primitive at a distance within the bound: a ray through a common edge, or coplanar triangles.
    pub ties: usize,
    /// Anything else.
    pub different: usize,
    /// The first disagreements.
    pub first: Vec<Disagreement>,
}

/// A ray to which two accelerators answer differently.
#[derive(Clone, Debug, Serialize)]
pub struct Disagreement {
    /// For `--ray`: origin, direction, `t_min`, `t_max`, time.
    pub ray: String,
    /// The oracle's hit.
    pub expected: String,
    /// The accelerator's hit.
    pub found: String,
}

/// An answer to a ray: the closest hit, or whether there is any.
#[derive(Clone, Copy, Debug)]
pub enum Answer {
    /// The closest hit.
    Closest(Option<Hit>),
    /// Whether there is any hit.
    Any(bool),
}

/// The answers to many rays, with all threads of the current pool.
pub fn answers(accel: &dyn Accelerator, rays: &[Ray], any_hit: bool) -> Vec<Answer> {
    let answer =
        |ray: &Ray| if any_hit { Answer::Any(accel.occluded(ray)) } else { Answer::Closest(accel.intersect(ray)) };
    rays.par_iter().with_min_len(256).map(answer).collect()
}

/// Compares the answers of `accel` with those expected, ray by ray.
pub fn compare(geometry: &Geometry, expected: &[Answer], accel: &dyn Accelerator, rays: &[Ray]) -> Agreement {
    let check = |ray: &Ray, expected: &Answer| {
        let a = match expected {
            Answer::Closest(hit) => *hit,
            Answer::Any(a) => {
                let (a, b) = (*a, accel.occluded(ray));
                let class = if a == b { Class::Identical } else { Class::Different };
                return (class, (a != b).then(|| (occlusion(a), occlusion(b))));
            }
        };
        let b = accel.intersect(ray);
        let class = classify(geometry, ray, a.as_ref(), b.as_ref());
        (class, (class == Class::Different).then(|| (describe(a.as_ref()), describe(b.as_ref()))))
    };
    let chunks: Vec<Agreement> = rays
        .par_chunks(4096)
        .zip(expected.par_chunks(4096))
        .map(|(rays, expected)| {
            let mut sum = Agreement { rays: rays.len(), ..Agreement::default() };
            for (ray, expected) in rays.iter().zip(expected) {
                let (class, answers) = check(ray, expected);
                match class {
                    Class::Identical => sum.identical += 1,
                    Class::WithinBound => sum.within_bound += 1,
                    Class::Tie => sum.ties += 1,
                    Class::Different => sum.different += 1,
                }
                if let (Some((expected, found)), true) = (answers, sum.first.len() < KEPT) {
                    sum.first.push(Disagreement { ray: write_ray(ray), expected, found });
                }
            }
            sum
        })
        .collect();
    chunks.into_iter().fold(Agreement::default(), |mut sum, part| {
        sum.add(part);
        sum
    })
}

impl Agreement {
    /// This and another one together.
    pub fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.identical += other.identical;
        self.within_bound += other.within_bound;
        self.ties += other.ties;
        self.different += other.different;
        self.first.extend(other.first);
        self.first.truncate(KEPT);
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Identical,
    WithinBound,
    Tie,
    Different,
}

fn classify(geometry: &Geometry, ray: &Ray, a: Option<&Hit>, b: Option<&Hit>) -> Class {
    match (a, b) {
        (None, None) => Class::Identical,
        (Some(a), Some(b)) if a == b => Class::Identical,
        (Some(a), Some(b)) if within_bound(geometry, ray, a, b) => {
            if (a.instance, a.shape, a.prim) == (b.instance, b.shape, b.prim) { Class::WithinBound } else { Class::Tie }
        }
        _ => Class::Different,
    }
}

/// Whether two hits of `ray` lie at the same distance within rounding. A triangle test in `f32` subtracts the origin
/// from the corners: 4 roundoffs of the largest of these differences, seen along the normal, so over the cosine with
/// it; and each `t` is rounded itself, 16 roundoffs in all. Through an instance the origin is rounded on its way.
pub fn within_bound(geometry: &Geometry, ray: &Ray, a: &Hit, b: &Hit) -> bool {
    let length = f64::from(ray.direction.length());
    let slack = |hit: &Hit| {
        let cosine =
            geometry.interaction(ray, hit).map_or(1.0, |at| f64::from(at.n_g.dot(ray.direction).abs()) / length);
        let instanced = if hit.instance == Hit::NO_INSTANCE { 0.0 } else { f64::from(ray.origin.abs().max_element()) };
        16.0 * UNIT_ROUNDOFF * f64::from(hit.t)
            + 4.0 * UNIT_ROUNDOFF * (reach(geometry, ray, hit) + instanced) / (length * cosine.max(1e-6))
    };
    (f64::from(a.t) - f64::from(b.t)).abs() <= slack(a) + slack(b)
}

/// The largest distance along an axis from the ray's origin to a corner of the triangle hit, in its own space; zero on
/// analytic shapes.
fn reach(geometry: &Geometry, ray: &Ray, hit: &Hit) -> f64 {
    let Shape::Mesh(mesh) = geometry.shape(hit.shape) else { return 0.0 };
    let points = mesh.triangle_points_at(hit.prim, ray.time);
    let origin = if hit.instance == Hit::NO_INSTANCE {
        ray.origin
    } else {
        geometry.instance(hit.instance).object_ray(ray).origin
    };
    let far = [points.a, points.b, points.c].map(|p| (p - origin).abs().max_element());
    f64::from(far[0].max(far[1]).max(far[2]))
}

/// A hit as text.
pub fn describe(hit: Option<&Hit>) -> String {
    let Some(hit) = hit else { return "no hit".into() };
    let instance =
        if hit.instance == Hit::NO_INSTANCE { String::new() } else { format!(" instance {}", hit.instance.0) };
    format!(
        "t {} ({:#010x}) shape {} primitive {}{instance} u {} v {}",
        hit.t,
        hit.t.to_bits(),
        hit.shape.0,
        hit.prim.0,
        hit.u,
        hit.v
    )
}

fn occlusion(occluded: bool) -> String {
    if occluded { "occluded".into() } else { "free".into() }
}

/// A ray as text from which [`parse_ray`] makes the very same ray.
pub fn write_ray(ray: &Ray) -> String {
    let (o, d) = (ray.origin, ray.direction);
    // The shortest decimal that reads back as the same float.
    [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_min, ray.t_max, ray.time].map(|x| format!("{x:?}")).join(",")
}

/// A ray from `ox,oy,oz,dx,dy,dz[,t_min[,t_max[,time]]]`.
///
/// # Errors
/// What is wrong with the text.
pub fn parse_ray(text: &str) -> Result<Ray, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|word| word.trim().parse().map_err(|_| format!("\"{}\" is not a number", word.trim())))
        .collect::<Result<_, _>>()?;
    let [ox, oy, oz, dx, dy, dz, rest @ ..] = numbers.as_slice() else {
        return Err("expected ox,oy,oz,dx,dy,dz and optionally t_min,t_max,time".into());
    };
    if rest.len() > 3 {
        return Err("expected at most nine numbers".into());
    }
    let at = |i: usize, default: f32| rest.get(i).copied().unwrap_or(default);
    let ray = Ray {
        origin: [*ox, *oy, *oz].into(),
        direction: [*dx, *dy, *dz].into(),
        t_min: at(0, 0.0),
        t_max: at(1, f32::INFINITY),
        time: at(2, 0.0),
    };
    if ray.is_valid() {
        Ok(ray)
    } else {
        Err("not a ray: numbers must be finite, the direction not zero, 0 <= t_min <= t_max".into())
    }
}
