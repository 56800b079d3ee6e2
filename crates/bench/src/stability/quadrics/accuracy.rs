//! Hits of quadrics and flat shapes against the oracle of 106 bits.

use crate::accel::{self, AccelKind, LinearAccel};
use crate::geometry::{Analytic, Geometry, Shape, Sphere, TransformedShape};
use crate::math::float::{F64_CHAIN_ERROR, UNIT_ROUNDOFF};
use crate::math::{Bounds, DMat3, DVec3, Ray, Transform, Vec3};
use crate::stability::geometry::{Rng, closest, transform as moved, world};
use crate::stability::oracle::{Answer, Case, ExactTransform, partial_cases, whole_cases};
use crate::stability::vectors::{SHAPES, ShapeVector, excluded as excluded_of, shape_vectors};
use crate::stability::{Effort, Faults, Outcome, Plot};

/// Distances of origins, in sizes of the shape.
const DISTANCES: [f64; 7] = [3.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
const SCALES: [f64; 7] = [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6];

const EMBREE_BOXES: &str = "Embree tests boxes of user geometry with an error of half a unit in the last place of the \
                            ray's origin; boxes are padded by a unit in the last place of their own bounds, so rays \
                            from afar are lost where they pass the edge of a box more closely than that; the catalogue \
                            requires none";

/// How a ray is made.
#[derive(Clone, Copy)]
struct Setting {
    /// From the origin of the ray to the point aimed at, in sizes of the shape.
    distance: f64,
    /// From the origin of the world to about that point, in the same, less one.
    offset: f64,
    scale: f64,
    /// Whether the shape is turned and stretched unevenly, too.
    is_turned: bool,
}

/// What a ray is aimed at.
#[derive(Clone, Copy)]
enum Aim {
    Anywhere,
    /// A silhouette, or the edge of a flat shape; inside by so much.
    Rim(f64),
    /// An edge; inside by so much.
    Edge(f64),
}

/// A ray with the shape placed such that the ray, which has the digits of `f32`, meets it as it was aimed.
struct Shot {
    ray: Ray,
    transform: Transform,
}

fn shot(rng: &mut Rng, case: &Case, setting: Setting, aim: Aim) -> Shot {
    let unit = case.size * setting.scale;
    loop {
        let stretch = DVec3::new(rng.range(0.5, 2.0), rng.range(0.5, 2.0), rng.range(0.5, 2.0));
        let turned = rng.rotation() * DMat3::from_diagonal(stretch);
        let linear = setting.scale * if setting.is_turned { turned } else { DMat3::IDENTITY };
        let direction = rng.direction();
        let offset = rng.direction() * (1.0 + setting.offset);
        let origin = ((offset - direction * setting.distance) * unit).as_vec3();
        let ray = Ray::new(origin, (direction * rng.magnitude(-1.0, 1.0)).as_vec3());
        let d = ray.direction.as_dvec3();
        let local = match aim {
            Aim::Rim(depth) if !case.is_flat() => case.near_silhouette(rng, linear.inverse() * d, depth * case.size),
            Aim::Rim(depth) | Aim::Edge(depth) => case.near_edge(rng, depth),
            Aim::Anywhere => Some(case.sample(rng).p),
        };
        let Some(local) = local else { continue };
        let target = ray.origin.as_dvec3() + d * (setting.distance * unit / d.length());
        return Shot { ray, transform: moved(linear, target - linear * local) };
    }
}

/// What many rays have shown.
#[derive(Clone, Default)]
struct Tally {
    rays: usize,
    missed: Faults,
    invented: Faults,
    undecidable: usize,
    /// Of the point in `f32`, in units of 2^-24 of its largest coordinate.
    error: f64,
    /// From the tangent plane, in units of the half-ulp box.
    off_surface: f64,
}

impl Tally {
    fn merge(&mut self, other: &Self) {
        self.rays += other.rays;
        self.missed += other.missed.clone();
        self.invented += other.invented.clone();
        self.undecidable += other.undecidable;
        self.error = self.error.max(other.error);
        self.off_surface = self.off_surface.max(other.off_surface);
    }

    /// Judges what was found on a ray by the exact answer; `describe` is of the ray and the shape.
    fn judge(&mut self, found: Option<(DVec3, Vec3)>, answer: Answer, reach: f64, describe: impl FnOnce() -> String) {
        self.rays += 1;
        match (answer, found) {
            (Answer::Undecidable, _) => self.undecidable += 1,
            (Answer::Miss, found) => self.invented.require(found.is_none(), describe),
            (Answer::Hit { .. }, None) => self.missed.require(false, describe),
            (Answer::Hit { p: exact, .. }, Some((p, n))) => {
                let (p, n) = (p.as_vec3().as_dvec3(), n.as_dvec3().normalize());
                // The coordinates of the shape's own numbers round as well.
                let slack = F64_CHAIN_ERROR * reach;
                let unit = UNIT_ROUNDOFF * exact.abs().max_element() + slack;
                self.error = self.error.max((p - exact).abs().max_element() / unit);
                let half_ulp_box = UNIT_ROUNDOFF * n.abs().dot(exact.abs()) + slack;
                self.off_surface = self.off_surface.max((p - exact).dot(n).abs() / half_ulp_box);
            }
        }
    }
}

/// The surface that a ray meets, through an accelerator.
fn compensation(accel: &dyn accel::Accelerator, geometry: &Geometry, ray: &Ray) -> Option<(DVec3, Vec3)> {
    closest(accel, geometry, ray).found.map(|at| (at.p, at.n_g))
}

/// Tallies of the shape alone, through Embree, and through Embree among others; there, of rays that pass the
/// edge of the box so closely that the rounding of their origin is more, apart.
#[derive(Clone, Default)]
struct Tallies {
    alone: Tally,
    embree: Tally,
    among: Tally,
    among_at_rims: Tally,
}

impl Tallies {
    fn merge(&mut self, other: &Self) {
        self.alone.merge(&other.alone);
        self.embree.merge(&other.embree);
        self.among.merge(&other.among);
        self.among_at_rims.merge(&other.among_at_rims);
    }

    /// With the judgements of C1 on them.
    fn judged(self, outcome: Outcome) -> Outcome {
        let share = self.alone.undecidable as f64 / self.alone.rays as f64;
        let lost_at_rims = self.among_at_rims.missed.count as f64 / self.among_at_rims.rays.max(1) as f64;
        let error_through_embree = self.embree.error.max(self.among.error).max(self.among_at_rims.error);
        let outcome = if self.among_at_rims.missed.count == 0 { outcome } else { outcome.short(EMBREE_BOXES) };
        let mut invented = self.embree.invented;
        invented += self.among.invented;
        invented += self.among_at_rims.invented;
        outcome
            .none("missed", self.alone.missed)
            .none("false hits", self.alone.invented)
            .none("missed through Embree", self.embree.missed)
            .none("missed through Embree among others", self.among.missed)
            .at_most(
                "share missed through Embree among others of rays that pass their box by less than 2^-20 of the \
                 distance",
                lost_at_rims,
                0.05,
            )
            .shown_by(&self.among_at_rims.missed)
            .none("false hits through Embree", invented)
            .at_most("error through Embree", error_through_embree, 1.0)
            .at_most("distance from the tangent plane in half-ulp boxes", self.alone.off_surface, 1.0)
            .at_most("share of rays that cannot be decided", share, 1e-3)
            .record("rays", self.alone.rays as f64)
    }
}

/// Spheres behind the start of a ray, so that the accelerator has several boxes.
fn bystanders(ray: &Ray, unit: f64) -> impl Iterator<Item = Shape> + '_ {
    let back = -ray.direction.as_dvec3().normalize();
    (1..=3).map(move |i| {
        let center = ray.origin.as_dvec3() + back * unit * 4.0 * f64::from(i);
        let shape = Analytic::Sphere(Sphere::full(unit).expect("the radius is positive"));
        Shape::Analytic(TransformedShape::new(shape, Transform::from_translation(center)))
    })
}

/// Whether a ray passes a box farther inside than 2^-20 of the coordinates of its origin.
fn passes_inside(bounds: Bounds, ray: &Ray) -> bool {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let inner = bounds.grown(-16.0 * UNIT_ROUNDOFF * o.abs().max_element());
    let (a, b) = ((inner.min - o) / d, (inner.max - o) / d);
    inner.min.cmplt(inner.max).all() && a.min(b).max_element() < a.max(b).min_element()
}

fn compare(rng: &mut Rng, case: &Case, setting: Setting, rays: usize, aim: impl Fn(&mut Rng) -> Aim) -> Tallies {
    let unit = case.size * setting.scale;
    let margin = F64_CHAIN_ERROR * (1.0 + setting.offset);
    let mut tallies = Tallies::default();
    for i in 0..rays {
        let aim = aim(rng);
        let Shot { ray, transform } = shot(rng, case, setting, aim);
        let answer = case.answer(&ExactTransform::new(&transform), &ray, margin);
        let m = transform.world_from_object;
        let placed = TransformedShape::new(case.shape.clone(), moved(m.matrix3 * case.axes, m.translation));
        let reach = placed.bounds().min.abs().max(placed.bounds().max.abs()).max_element();
        let is_inside = passes_inside(placed.bounds(), &ray);
        let describe = || format!("{} at {m:?}: {ray:?}", case.name);
        let mut geometry = world(vec![Shape::Analytic(placed)]);
        tallies.alone.judge(compensation(&LinearAccel::new(&geometry), &geometry, &ray), answer, reach, describe);
        // Building is dear.
        if i % 4 == 0 {
            let embree = accel::build(AccelKind::EMBREE, &geometry, 1).expect("Embree builds");
            tallies.embree.judge(compensation(&*embree, &geometry, &ray), answer, reach, describe);
            drop(embree);
            let placed = geometry.shapes.swap_remove(0);
            geometry = world(std::iter::once(placed).chain(bystanders(&ray, unit)).collect());
            let embree = accel::build(AccelKind::EMBREE, &geometry, 1).expect("Embree builds");
            let tally = if is_inside { &mut tallies.among } else { &mut tallies.among_at_rims };
            tally.judge(compensation(&*embree, &geometry, &ray), answer, reach, describe);
        }
    }
    tallies
}

/// Half of the rays within 1e-1 to 1e-6 of a rim, on either side.
fn half_at_rims(rng: &mut Rng) -> Aim {
    if rng.unit() < 0.5 {
        return Aim::Anywhere;
    }
    let depth = rng.magnitude(-6.0, -1.0);
    Aim::Rim(if rng.unit() < 0.3 { -depth } else { depth })
}

/// The errors of a sphere or quadric in naive `f32` arithmetic, as a curve over `xs`.
fn naive_curve(settings: &dyn Fn(f64) -> Setting, xs: &[f64], case: &Case, rays: usize) -> (String, Vec<(f64, f64)>) {
    let mut rng = Rng::new(32);
    let points = xs.iter().map(|&x| (x, naive_error(&mut rng, case, settings(x), rays))).collect();
    (format!("{}, naive f32", case.name), points)
}

fn error_plot(caption: &str, x: &str, curves: Vec<(String, Vec<(f64, f64)>)>) -> Plot {
    let y = "largest error of the point / (2^-24 max|p|)".into();
    Plot { caption: caption.into(), x: x.into(), y, floor: 1e-3, curves }
}

pub(super) fn c1_hit_accuracy(effort: Effort) -> Outcome {
    let rays = effort.pick(60, 3_000);
    let mut rng = Rng::new(31);
    let mut all = Tallies::default();
    let mut outcome = Outcome::new();
    let (mut by_distance, mut by_scale) = (Vec::new(), Vec::new());
    let cases = whole_cases();
    for case in &cases {
        let mut worst = 0f64;
        let mut run = |settings: &[Setting]| {
            let mut alone = Tally::default();
            for &setting in settings {
                let found = compare(&mut rng, case, setting, rays, half_at_rims);
                alone.merge(&found.alone);
                all.merge(&found);
            }
            worst = worst.max(alone.error);
            alone.error
        };
        let base = Setting { distance: 10.0, offset: 0.0, scale: 1.0, is_turned: false };
        let variants = |s: Setting| {
            [
                s,
                Setting { is_turned: true, ..s },
                Setting { offset: 1e3, ..s },
                Setting { offset: 1e3, is_turned: true, ..s },
            ]
        };
        let distances = DISTANCES.map(|distance| (distance, run(&variants(Setting { distance, ..base }))));
        let scales = SCALES.map(|scale| {
            (scale, run(&[Setting { scale, ..base }, Setting { scale, is_turned: true, offset: 1e3, distance: 1e4 }]))
        });
        outcome = outcome.at_most(format!("{}: error of the point in 2^-24 max|p|", case.name), worst, 1.0);
        by_distance.push((case.name.to_string(), distances.to_vec()));
        by_scale.push((case.name.to_string(), scales.to_vec()));
    }
    let naive = |settings: &dyn Fn(f64) -> Setting, xs: &[f64], case: &Case| {
        naive_curve(settings, xs, case, effort.pick(300, 5_000))
    };
    for case in &cases[..2] {
        let base = Setting { distance: 10.0, offset: 0.0, scale: 1.0, is_turned: false };
        by_distance.push(naive(&|distance| Setting { distance, ..base }, &DISTANCES, case));
        by_scale.push(naive(&|scale| Setting { scale, ..base }, &SCALES, case));
    }
    all.judged(outcome)
        .plot(error_plot("Error of hits by distance", "distance of the origin / size", by_distance))
        .plot(error_plot("Error of hits by scale", "size of the shape", by_scale))
}

/// The largest error of the textbook's formulas in `f32`, in the units of [`Tally::error`]; of rays that they hit at
/// all.
fn naive_error(rng: &mut Rng, case: &Case, setting: Setting, rays: usize) -> f64 {
    let mut worst = 0f64;
    for _ in 0..rays {
        let aim = half_at_rims(rng);
        let Shot { ray, transform } = shot(rng, case, setting, aim);
        let Answer::Hit { p: exact, .. } = case.answer(&ExactTransform::new(&transform), &ray, 1e-8) else { continue };
        let o = ray.origin - transform.world_from_object.translation.as_vec3();
        let d = ray.direction;
        let radius = (case.size.min(1.0) * setting.scale) as f32;
        let flat = |v: Vec3| if matches!(case.shape, Analytic::Sphere(_)) { v } else { Vec3::new(v.x, v.y, 0.0) };
        let (a, b, c) =
            (flat(d).length_squared(), 2.0 * flat(o).dot(flat(d)), flat(o).length_squared() - radius * radius);
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            continue;
        }
        // The root next to the exact one: a test of accuracy, not of clips.
        let p = [-1f32, 1.0].map(|sign| ray.at((-b + sign * discriminant.sqrt()) / (2.0 * a)).as_dvec3());
        let error = p.iter().map(|p| (*p - exact).abs().max_element()).fold(f64::INFINITY, f64::min);
        worst = worst.max(error / (UNIT_ROUNDOFF * exact.abs().max_element()));
    }
    worst
}

/// What [`compare_with_oracle`] has found.
pub struct Agreement {
    /// Missed and false hits.
    pub wrong: Faults,
    /// Largest error of a point, in 2^-24 of its largest coordinate.
    pub error: f64,
    /// Share of rays that cannot be decided.
    pub undecidable: f64,
}

/// Rays as in C1 at distances of 3 to 1e6, by the shape alone and through Embree.
pub fn compare_with_oracle(cases: &[Case], rays: usize, seed: u64) -> Agreement {
    let mut rng = Rng::new(seed);
    let mut all = Tally::default();
    for case in cases {
        for distance in DISTANCES {
            for is_turned in [false, true] {
                let setting = Setting { distance, offset: 0.0, scale: 1.0, is_turned };
                let found = compare(&mut rng, case, setting, rays, half_at_rims);
                all.merge(&found.alone);
                all.merge(&found.embree);
            }
        }
    }
    all.missed += all.invented;
    Agreement { wrong: all.missed, error: all.error, undecidable: all.undecidable as f64 / all.rays as f64 }
}

pub(super) fn c7_partial_shapes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(33);
    let mut all = Tallies::default();
    let mut normals = 0f64;
    for case in partial_cases() {
        for (distance, is_turned) in [(3.0, false), (1e3, false), (1e6, false), (10.0, true)] {
            let setting = Setting { distance, offset: 0.0, scale: 1.0, is_turned };
            let found = compare(&mut rng, &case, setting, effort.pick(150, 7_000), |rng| {
                let depth = rng.magnitude(-7.0, -1.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
                [Aim::Anywhere, Aim::Edge(depth), Aim::Edge(depth), Aim::Rim(depth)][rng.below(4)]
            });
            all.alone.merge(&found.alone);
            all.embree.merge(&found.embree);
        }
        if let Analytic::Sphere(_) = case.shape {
            for _ in 0..100 {
                let sample = case.shape.sample([rng.unit(), rng.unit()]);
                normals = normals.max(sample.n.cross(sample.p).length() / sample.p.length());
            }
        }
    }
    let wrong = [&all.alone, &all.embree].map(|tally| {
        let mut wrong = tally.missed.clone();
        wrong += tally.invented.clone();
        wrong
    });
    let [alone, embree] = wrong;
    Outcome::new()
        .none("hit or missed otherwise than exactly", alone)
        .none("the same through Embree", embree)
        .at_most("error of the point in 2^-24 max|p|", all.alone.error, 1.0)
        .at_most("sine between normal and radius of spheres", normals, 1e-6)
        .at_most("share of rays that cannot be decided", all.alone.undecidable as f64 / all.alone.rays as f64, 1e-3)
        .record("rays", all.alone.rays as f64)
}

pub(super) fn c13_stored_vectors(_: Effort) -> Outcome {
    let (mut shapes, mut distance, mut oracle, mut oracle_error) = (Tally::default(), 0f64, Faults::NONE, 0f64);
    let (mut excluded, mut worst_condition) = (0, 0f64);
    for case in whole_cases() {
        let Some((_, text)) = SHAPES.iter().find(|(name, _)| *name == case.name) else { continue };
        excluded += excluded_of(text);
        for vector in shape_vectors(text) {
            let ShapeVector { ray, center, hit, condition } = vector;
            let at = Transform::from_translation(center);
            let answer = hit.map_or(Answer::Miss, |(t, p)| Answer::Hit { t, p });
            let geometry = world(vec![Shape::Analytic(TransformedShape::new(case.shape.clone(), at))]);
            let found = closest(&LinearAccel::new(&geometry), &geometry, &ray).found;
            let reach = center.abs().max_element() + case.size;
            let describe = || format!("{} at {center}: {ray:?}", case.name);
            shapes.judge(found.map(|at| (at.p, at.n_g)), answer, reach, describe);
            worst_condition = worst_condition.max(condition);
            if let (Some(found), Some((t, _))) = (found, hit) {
                let slack = F64_CHAIN_ERROR * reach * condition / ray.direction.as_dvec3().length();
                distance = distance.max((f64::from(found.t) - t).abs() / (UNIT_ROUNDOFF * t + slack));
            }
            match (case.answer(&ExactTransform::new(&at), &ray, 0.0), hit) {
                (Answer::Hit { t, p }, Some((exact_t, exact_p))) => {
                    oracle_error = oracle_error
                        .max((t / exact_t - 1.0).abs())
                        .max((p - exact_p).abs().max_element() / exact_p.abs().max_element());
                }
                (Answer::Miss, None) => {}
                _ => oracle.require(false, describe),
            }
        }
    }
    Outcome::new()
        .none("missed", shapes.missed)
        .none("false hits", shapes.invented)
        .at_most("error of the point in 2^-24 max|p|", shapes.error, 1.0)
        .at_most("error of the distance in 2^-24 t", distance, 1.0)
        .none("other answers of the oracle of 106 bits", oracle)
        .at_most("relative error of that oracle in 2^-53", oracle_error * 2f64.powi(53), 2.0)
        .at_most("share of rays left out as undecidable", excluded as f64 / (excluded + shapes.rays) as f64, 1e-3)
        .record("largest condition of a point", worst_condition)
        .record("rays", shapes.rays as f64)
}
