//! Writes `crates/bench/src/stability/vectors`: rays at shapes with their exact hits, found in arithmetic of 256 bits.
//!
//! A line of a quadric's or a flat shape's file, all numbers as the hexadecimal bits of their floats: origin and
//! direction (`f32`), the shape's translation (`f64`), and of a hit the distance and the point, rounded to `f64`, and
//! in decimals the condition of the point: one over the cosine between ray and normal. Of a surface of revolution:
//! origin, direction, and the distances of all hits in order.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use steradian::internal::geometry::{Profile, Revolution};
use steradian::internal::math::{DVec3, Ray, Rng, Vec3};
use steradian_bench::stability::oracle::{Case, whole_cases};

use crate::{Outcome, root};

type Big = FBig<HalfEven, 2>;

/// Rays of each file.
const QUADRIC_RAYS: usize = 500;
const REVOLUTION_RAYS: usize = 300;

/// Rays that pass what decides closer than this are left out, and counted.
const UNDECIDABLE: f64 = 1e-12;

fn big(x: f64) -> Big {
    Big::try_from(x).expect("finite").with_precision(256).value()
}

fn rounded(x: &Big) -> f64 {
    x.to_f64().value()
}

/// `round (x² + y²) + z_squared z² + z_linear z + constant = 0`, or the plane `z = 0`.
struct Equation {
    coefficients: Option<[f64; 4]>,
    /// Whether a point of the surface belongs to the shape, by a margin relative to its size.
    clearance: fn([f64; 3]) -> f64,
}

fn equation(name: &str) -> Equation {
    let all = |_: [f64; 3]| f64::INFINITY;
    match name {
        "sphere" => Equation { coefficients: Some([1.0, 1.0, 0.0, -1.0]), clearance: all },
        "cylinder" => Equation { coefficients: Some([1.0, 0.0, 0.0, -1.0]), clearance: |[_, _, z]| z.min(2.0 - z) },
        // rho = 1 - z / 2
        "cone" => Equation { coefficients: Some([1.0, -0.25, 1.0, -1.0]), clearance: |[_, _, z]| z.min(2.0 - z) },
        // rho = 1/2 + z
        "frustum" => Equation { coefficients: Some([1.0, -1.0, -1.0, -0.25]), clearance: |[_, _, z]| z.min(0.75 - z) },
        "disk" => Equation { coefficients: None, clearance: |[x, y, _]| 1.0 - x.hypot(y) },
        "ring" => Equation {
            coefficients: None,
            clearance: |[x, y, _]| {
                let (rho, phi) = (x.hypot(y), y.atan2(x).rem_euclid(TAU));
                let side = if phi <= 4.0 { phi.min(4.0 - phi) } else { -(phi - 4.0).min(TAU - phi) };
                (1.0 - rho).min(rho - 0.25).min(side * rho)
            },
        },
        _ => Equation { coefficients: None, clearance: |[x, y, _]| x.min(2.0 - x).min(y).min(1.5 - y) },
    }
}

struct Found {
    t: Big,
    p: [Big; 3],
    condition: f64,
}

/// The first hit; `Err` if it cannot be decided.
fn first_hit(equation: &Equation, ray: &Ray, center: DVec3) -> Result<Option<Found>, ()> {
    let numbers = |v: DVec3| v.to_array().map(big);
    let (origin, d, center) = (numbers(ray.origin.as_dvec3()), numbers(ray.direction.as_dvec3()), numbers(center));
    let o: [Big; 3] = std::array::from_fn(|i| &origin[i] - &center[i]);
    let mut roots = Vec::new();
    if let Some(coefficients) = equation.coefficients {
        let [k, m, l, constant] = coefficients.map(big);
        let a = &k * (&d[0] * &d[0] + &d[1] * &d[1]) + &m * &d[2] * &d[2];
        let half_b = &k * (&o[0] * &d[0] + &o[1] * &d[1]) + &m * &o[2] * &d[2] + big(0.5) * &l * &d[2];
        let c = &k * (&o[0] * &o[0] + &o[1] * &o[1]) + &m * &o[2] * &o[2] + &l * &o[2] + constant;
        let discriminant = &half_b * &half_b - &a * c;
        let scale = ray.direction.as_dvec3().length_squared();
        if rounded(&discriminant).abs() < UNDECIDABLE * scale || rounded(&a).abs() < UNDECIDABLE * scale {
            return Err(());
        }
        if rounded(&discriminant) < 0.0 {
            return Ok(None);
        }
        let root = discriminant.sqrt();
        roots.extend([(-&half_b - &root) / &a, (-&half_b + &root) / &a]);
        roots.sort_by(|x, y| x.partial_cmp(y).expect("numbers"));
    } else if rounded(&d[2]) != 0.0 {
        roots.push(-&o[2] / &d[2]);
    }
    for t in roots {
        let local: [Big; 3] = std::array::from_fn(|i| &o[i] + &d[i] * &t);
        let q = [rounded(&local[0]), rounded(&local[1]), rounded(&local[2])];
        let clearance = (equation.clearance)(q).min(rounded(&t));
        if clearance.abs() < UNDECIDABLE {
            return Err(());
        }
        if clearance > 0.0 {
            let n = equation
                .coefficients
                .map_or(DVec3::Z, |[k, m, l, _]| DVec3::new(k * q[0], k * q[1], m * q[2] + 0.5 * l));
            let condition = 1.0 / n.normalize().dot(ray.direction.as_dvec3().normalize()).abs();
            let p = std::array::from_fn(|i| &origin[i] + &d[i] * &t);
            return Ok(Some(Found { t, p, condition }));
        }
    }
    Ok(None)
}

/// A ray from 3 to 1e6 away, every other one within 1e-1 to 1e-6 of a silhouette or an edge, and the translation that
/// makes it so.
fn aimed(rng: &mut Rng, case: &Case, i: usize) -> Option<(Ray, DVec3)> {
    let direction = rng.direction();
    let distance = rng.magnitude(3f64.log10(), 6.0);
    let origin = (rng.direction() - direction * distance).as_vec3();
    let ray = Ray::new(origin, (direction * rng.magnitude(-1.0, 1.0)).as_vec3());
    let d = ray.direction.as_dvec3();
    let depth = rng.magnitude(-6.0, -1.0) * if rng.unit() < 0.3 { -1.0 } else { 1.0 };
    let local = match i % 4 {
        0 | 2 => case.sample(rng).p,
        1 => case.near_silhouette(rng, d, depth).or_else(|| case.near_edge(rng, depth))?,
        _ => case.near_edge(rng, depth).or_else(|| case.near_silhouette(rng, d, depth))?,
    };
    Some((ray, ray.origin.as_dvec3() + d * (distance / d.length()) - local))
}

fn hex32(text: &mut String, v: Vec3) {
    for x in v.to_array() {
        let _ = write!(text, "{:08x} ", x.to_bits());
    }
}

fn hex64(text: &mut String, values: impl IntoIterator<Item = f64>) {
    for x in values {
        let _ = write!(text, "{:016x} ", x.to_bits());
    }
}

fn quadric_file(case: &Case, seed: u64) -> String {
    let mut rng = Rng::new(seed);
    let equation = equation(case.name);
    let (mut text, mut written, mut excluded) = (String::new(), 0, 0);
    while written < QUADRIC_RAYS {
        let Some((ray, center)) = aimed(&mut rng, case, written) else { continue };
        let Ok(hit) = first_hit(&equation, &ray, center) else {
            excluded += 1;
            continue;
        };
        hex32(&mut text, ray.origin);
        hex32(&mut text, ray.direction);
        hex64(&mut text, center.to_array());
        if let Some(hit) = hit {
            hex64(&mut text, [&hit.t, &hit.p[0], &hit.p[1], &hit.p[2]].map(rounded));
            let _ = write!(text, "{:.3e}", hit.condition);
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
        written += 1;
    }
    format!("# excluded {excluded}\n{text}")
}

type Polynomial = Vec<Big>;

fn at(p: &[Big], s: &Big) -> Big {
    p.iter().rev().fold(big(0.0), |sum, c| sum * s + c)
}

fn product(a: &[Big], b: &[Big]) -> Polynomial {
    let mut c = vec![big(0.0); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            c[i + j] = &c[i + j] + x * y;
        }
    }
    c
}

fn sum(a: &[Big], b: &[Big]) -> Polynomial {
    let get = |p: &[Big], i: usize| p.get(i).cloned().unwrap_or_else(|| big(0.0));
    (0..a.len().max(b.len())).map(|i| get(a, i) + get(b, i)).collect()
}

fn times(p: &[Big], factor: &Big) -> Polynomial {
    p.iter().map(|c| c * factor).collect()
}

/// Parameters in `[0, 1]` where the sign changes, by those of the derivative. Zero counts as positive.
fn roots(p: &[Big]) -> Vec<Big> {
    if p.len() < 2 {
        return Vec::new();
    }
    let derivative: Polynomial = p.iter().enumerate().skip(1).map(|(i, c)| c * big(i as f64)).collect();
    let mut ends = vec![big(0.0)];
    ends.extend(roots(&derivative));
    ends.push(big(1.0));
    let zero = big(0.0);
    let positive = |s: &Big| at(p, s) >= zero;
    let between = |pair: &[Big]| {
        let (mut lo, mut hi) = (pair[0].clone(), pair[1].clone());
        let positive_at_lo = positive(&lo);
        if positive_at_lo == positive(&hi) {
            return None;
        }
        for _ in 0..150 {
            let middle = (&lo + &hi) * big(0.5);
            if positive(&middle) == positive_at_lo { lo = middle } else { hi = middle }
        }
        Some(lo)
    };
    ends.windows(2).filter_map(between).collect()
}

/// Distances of all hits of a ray with a profile turned about y.
fn all_hits(points: &[[f64; 2]], ray: &Ray) -> Vec<f64> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (o, d) = ([o.z, o.x, o.y].map(big), [d.z, d.x, d.y].map(big));
    let a = &d[0] * &d[0] + &d[1] * &d[1];
    let b = &o[0] * &d[0] + &o[1] * &d[1];
    let c = &o[0] * &o[0] + &o[1] * &o[1];
    let is_level = d[2] == big(0.0);
    let mut hits = Vec::new();
    for segment in 0..points.len() / 3 {
        let cubic = |k: usize| -> Polynomial {
            let q: Vec<Big> = (0..4).map(|i| big(points[3 * segment + i][k])).collect();
            let three = big(3.0);
            vec![
                q[0].clone(),
                &three * (&q[1] - &q[0]),
                &three * (&q[2] - big(2.0) * &q[1] + &q[0]),
                &q[3] - &three * &q[2] + &three * &q[1] - &q[0],
            ]
        };
        let (r, above) = (cubic(0), sum(&cubic(1), &[-&o[2]]));
        if is_level {
            for s in roots(&above) {
                let r = at(&r, &s);
                let half_squared = &b * &b - &a * (&c - &r * &r);
                if half_squared >= big(0.0) {
                    let half = half_squared.sqrt();
                    hits.extend([(-&b - &half) / &a, (-&b + &half) / &a]);
                }
            }
            continue;
        }
        let d_squared = &d[2] * &d[2];
        let mut f = sum(&times(&product(&r, &r), &d_squared), &[-(&d_squared * &c)]);
        f = sum(&f, &times(&product(&above, &above), &-&a));
        f = sum(&f, &times(&above, &-(big(2.0) * &b * &d[2])));
        hits.extend(roots(&f).iter().map(|s| at(&above, s) / &d[2]));
    }
    let mut hits: Vec<f64> = hits.iter().map(rounded).filter(|t| *t >= 0.0).collect();
    hits.sort_by(f64::total_cmp);
    hits
}

const ROUND: f64 = 0.552_284_749_8;
/// The profiles by the names of their files.
const PROFILES: &[(&str, &[[f64; 2]])] = &[
    ("vase", &[[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]]),
    ("looping", &[[0.2, -0.8], [2.5, 1.2], [0.1, 1.4], [1.2, -0.7], [1.6, -1.2], [0.3, 0.4], [0.5, 1.0]]),
    ("ball", &[[0.0, -1.0], [ROUND, -1.0], [1.0, -ROUND], [1.0, 0.0], [1.0, ROUND], [ROUND, 1.0], [0.0, 1.0]]),
];

fn revolution_file(points: &[[f64; 2]], seed: u64) -> String {
    let mut rng = Rng::new(seed);
    let shape = Revolution::new(&Profile::bezier(points).expect("valid"), TAU).expect("valid");
    let (mut text, mut written, mut excluded) = (String::new(), 0, 0);
    while written < REVOLUTION_RAYS {
        let target = shape.sample([rng.unit(), rng.unit()]);
        let mut direction = rng.direction();
        let mut through = target.p + rng.cube() * 0.2;
        match written % 5 {
            1 => {
                direction = target.n.cross(direction).normalize();
                through = target.p + target.n * rng.magnitude(-6.0, -1.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            }
            2 => direction.y = rng.magnitude(-9.0, -2.0),
            3 => direction.y = 0.0,
            4 => direction = (DVec3::Y + direction * rng.magnitude(-9.0, -1.0)).normalize(),
            _ => {}
        }
        let ray = Ray::new((through - direction * rng.magnitude(0.5, 2.0)).as_vec3(), direction.as_vec3());
        let hits = all_hits(points, &ray);
        // Pairs so close that f64 cannot distinguish them from one tangency.
        if hits.windows(2).any(|pair| pair[1] - pair[0] < 1e-6) {
            excluded += 1;
            continue;
        }
        hex32(&mut text, ray.origin);
        hex32(&mut text, ray.direction);
        hex64(&mut text, hits);
        text.truncate(text.trim_end().len());
        text.push('\n');
        written += 1;
    }
    format!("# excluded {excluded}\n{text}")
}

pub fn run() -> Outcome {
    let folder = root().join("crates/bench/src/stability/vectors");
    for (i, case) in whole_cases().iter().enumerate() {
        std::fs::write(folder.join(format!("{}.txt", case.name)), quadric_file(case, i as u64))?;
    }
    for (i, (name, points)) in PROFILES.iter().enumerate() {
        std::fs::write(folder.join(format!("{name}.txt")), revolution_file(points, 100 + i as u64))?;
    }
    Ok(())
}
