use std::f64::consts::{PI, TAU};

use super::*;
use crate::light::test_support::assert_chi_squared;
use crate::light::{Light, LightQueries, LightSampleContext, LightSampleRows, LightSet, light_target};
use crate::math::Rng;
use crate::math::rows::{BATCH, DVec3Rows, Vec3Rows};
use crate::sampling::SampleRows;

const WHITE: Emission = Emission::constant(Rgb::WHITE);

fn scene(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Geometry {
    let mesh = Mesh::new(positions.to_vec(), triangles.to_vec(), None, None).unwrap();
    Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() }
}

/// A rectangle at z = 1 that looks down, with x in [-0.3, 0.7] and y in [-0.5, 0.5].
fn ceiling() -> Geometry {
    scene(&[[-0.3, -0.5, 1.0], [-0.3, 0.5, 1.0], [0.7, 0.5, 1.0], [0.7, -0.5, 1.0]], &[[0, 1, 2], [0, 2, 3]])
}

/// Irradiance at `p` on a surface with normal `n`, by a stratified grid of samples from all lights.
pub(super) fn irradiance(lights: &[AreaLight], geometry: &Geometry, p: DVec3, n: DVec3) -> f64 {
    let grid = 300;
    let mut sum = 0.0;
    for light in lights {
        for i in 0..grid * grid {
            let u = [((i % grid) as f32 + 0.5) / grid as f32, ((i / grid) as f32 + 0.5) / grid as f32];
            if let Some(s) = light.sample(geometry, &[], &LightSampleContext { p, n: n.as_vec3() }, u) {
                sum += f64::from(s.radiance.g) * n.dot(s.wi.as_dvec3()).max(0.0) / f64::from(s.pdf);
            }
        }
    }
    sum / f64::from(grid * grid)
}

/// Asserts that shadow targets lie on the light and that its hits have the density of the samples.
pub(super) fn assert_samples_are_hits(geometry: &Geometry, light: &AreaLight, p: DVec3, tolerance: f32) {
    let mut random = Rng::new(7);
    let (mut hits, count) = (0, 2000u32);
    let p = p.as_vec3().as_dvec3();
    for i in 0..count {
        let n = if i.is_multiple_of(2) { Vec3::ZERO } else { random.direction().as_vec3().normalize() };
        let from = LightSampleContext { p, n };
        let Some(s) = light.sample(geometry, &[], &from, random.pair()) else { continue };
        let ray = Ray::new(p.as_vec3(), s.wi);
        let shape = geometry.shape(light.shape);
        // Curved shapes may be met earlier than at the sample: it is then shadowed, or the hit is another point.
        let found = (0..shape.prim_count()).filter_map(|i| shape.intersect_prim(&ray, light.shape, PrimId::new(i)));
        let Some(hit) = found.min_by(|a, b| a.t.total_cmp(&b.t)) else { continue };
        let Some(at) = geometry.interaction(&ray, &hit) else { continue };
        let ShadowTarget::Point(target) = s.target else { panic!("an area light is not at infinity") };
        if (at.p - target.p).length() > 1e-5 * (target.p - p).length() {
            continue;
        }
        // Seen edge-on, the rounding of the direction decides: it moves the point by d / cos, and the cosine by as much
        // on a curved surface.
        let cos = f64::from(at.n_g.dot(s.wi));
        if cos * cos < 4e-3 * (target.p - p).length() {
            continue;
        }
        hits += 1;
        let pdf = light.pdf(geometry, &from, &ray, &at);
        let factor = light.side_factor(&from, target.p);
        let of_any_side = light.pdf(geometry, &LightSampleContext::from_any_side(p), &ray, &at);
        assert!((factor * of_any_side - pdf).abs() <= tolerance * pdf);
        assert!((pdf - s.pdf).abs() <= tolerance * s.pdf, "{pdf} {} at {:?}", s.pdf, at.p);
        assert_eq!(light.radiance(geometry, &[], &at, -s.wi), s.radiance);
    }
    assert!(hits > count / 20, "{hits}");
}

/// Asserts that what flows through a sphere around a light is its power.
pub(super) fn assert_power_flows_out(
    geometry: &Geometry,
    light: &AreaLight,
    center: DVec3,
    radius: f64,
    tolerance: f64,
) {
    let mut random = Rng::new(11);
    let n = 100_000;
    let mut sum = 0.0;
    for _ in 0..n {
        let outward = random.direction();
        if let Some(s) =
            light.sample(geometry, &[], &LightSampleContext::from_any_side(center + outward * radius), random.pair())
        {
            sum += f64::from(s.radiance.luminance()) * -outward.dot(s.wi.as_dvec3()) / f64::from(s.pdf);
        }
    }
    let flux = sum / f64::from(n) * 4.0 * PI * radius * radius;
    assert!((flux / light.power() - 1.0).abs() < tolerance, "{flux} {}", light.power());
}

#[test]
fn a_point_inside_a_sphere_light_is_lit_without_nan() {
    let sphere = SphereEmitter { center: DVec3::new(5.0, 0.0, 1.0), radius: 2.0, inward: true };
    for d in [0.0, 0.5, 0.9, 1.0] {
        let p = sphere.center + DVec3::new(0.0, 0.6, 0.8) * (2.0 * d);
        assert!(sphere.sees_front(p));
        let n = 300;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            let s = sphere.sample(p, u).unwrap();
            assert!(s.pdf.is_finite() && s.wi.is_finite() && (sphere.pdf(p, s.p) / s.pdf - 1.0).abs() < 1e-5);
            sum += 1.0 / f64::from(s.pdf);
        }
        // From the inside the sphere fills all directions, from the surface half of them.
        let exact = if d < 1.0 { 4.0 * PI } else { TAU };
        assert!((sum / f64::from(n * n) / exact - 1.0).abs() < 5e-3, "{d}: {sum}");
    }
    let outward = SphereEmitter { inward: false, ..sphere };
    assert!(!outward.sees_front(outward.center));
}

#[test]
fn a_sphere_light_gives_the_closed_form_irradiance() {
    // E = pi L (R / d)² cos, with the whole sphere above the horizon.
    let light = AreaLight {
        shape: ShapeId(0),
        prim: PrimId(0),
        emission: WHITE,
        luminance: 1.0,
        form: EmitterShape::Sphere(Box::new(SphereEmitter {
            center: DVec3::new(1.2, 0.0, 1.6),
            radius: 0.5,
            inward: false,
        })),
    };
    let e = irradiance(&[light], &Geometry::default(), DVec3::ZERO, DVec3::Z);
    assert!((e / (PI * 0.0625 * 0.8) - 1.0).abs() < 1e-4, "{e}");
}

#[test]
fn a_rectangle_light_gives_lamberts_irradiance() {
    let geometry = ceiling();
    let one = AreaLight::for_shape(ShapeId(0), WHITE, &geometry, &[]);
    let two: Vec<_> = (0..2).map(|i| AreaLight::new(ShapeId(0), PrimId(i), WHITE, &geometry, &[])).collect();
    assert_eq!(one.len(), 1);
    // Lambert's formula for polygons: E = L / 2 sum acos(a·b) n·(a x b) / |a x b|.
    for lights in [&one, &two] {
        let e = irradiance(lights, &geometry, DVec3::ZERO, DVec3::Z);
        assert!((e / 0.718_688_9 - 1.0).abs() < 1e-4, "{e}");
    }
    let from_any_side = |z: f64| LightSampleContext::from_any_side(DVec3::Z * z);
    assert!(one[0].sample(&geometry, &[], &from_any_side(1.5), [0.5; 2]).is_none());
    let edge_on = LightSampleContext::from_any_side(DVec3::new(3.0, 0.0, 1.0));
    assert!(one[0].sample(&geometry, &[], &edge_on, [0.5; 2]).is_none());
    let both = AreaLight { emission: Emission { two_sided: true, ..WHITE }, ..one[0].clone() };
    assert!(both.sample(&geometry, &[], &from_any_side(1.5), [0.5; 2]).is_some());
    assert_eq!(both.power(), 2.0 * one[0].power());
}

#[test]
fn hits_have_the_density_of_samples() {
    let rectangle = ceiling();
    let skewed = scene(&[[0.0, 0.0, 2.0], [0.5, 1.0, 2.0], [1.5, 1.0, 2.5], [1.0, 0.0, 2.5]], &[[0, 1, 2], [0, 2, 3]]);
    for geometry in [rectangle, skewed] {
        let mut lights = AreaLight::for_shape(ShapeId(0), WHITE, &geometry, &[]);
        assert_eq!(lights.len(), 1);
        lights.extend((0..2).map(|i| AreaLight::new(ShapeId(0), PrimId(i), WHITE, &geometry, &[])));
        for light in &lights {
            for p in [DVec3::ZERO, DVec3::new(0.2, 0.1, 0.9), DVec3::new(7.0, -5.0, -2.0)] {
                assert_samples_are_hits(&geometry, light, p, 1e-4);
            }
            assert_power_flows_out(&geometry, light, DVec3::new(0.2, 0.0, 1.0), 6.0, 0.03);
        }
    }
}

/// All numbers of the sample of an area light.
pub(super) fn words(sample: &LightSample) -> (Vec3, Rgb, f32, DVec3, Vec3, f32) {
    let ShadowTarget::Point(target) = sample.target else { panic!("an area light at infinity") };
    (sample.wi, sample.radiance, sample.pdf, target.p, target.n, target.error)
}

/// The same of a sample in rows whose light was chosen with a probability of a half.
pub(super) fn queued_words(
    samples: &LightSampleRows,
    target_p: &DVec3Rows,
    lane: usize,
) -> Option<(Vec3, Rgb, f32, DVec3, Vec3, f32)> {
    (samples.target[lane] == light_target::POINT).then(|| {
        assert_eq!(samples.is_delta[lane], 0);
        (
            samples.direction.get(lane),
            samples.radiance.get(lane),
            2.0 * samples.pdf[lane],
            target_p.get(lane),
            samples.target_n.get(lane),
            samples.target_error[lane],
        )
    })
}

#[test]
fn queued_samples_have_the_bits_of_single_ones() {
    let geometry = ceiling();
    let skewed = scene(&[[0.0, 0.0, 2.0], [0.5, 1.0, 2.0], [1.5, 1.0, 2.5], [1.0, 0.0, 2.5]], &[[0, 1, 2], [0, 2, 3]]);
    let two_sided = Emission { two_sided: true, ..WHITE };
    let mut lights = AreaLight::for_shape(ShapeId(0), WHITE, &geometry, &[]);
    lights.extend(AreaLight::for_shape(ShapeId(0), two_sided, &geometry, &[]));
    lights.extend(AreaLight::for_shape(ShapeId(0), WHITE, &skewed, &[]));
    let mut random = Rng::new(13);
    let mut queue = AreaQueue::default();
    let set = LightSet::new(lights.iter().cloned().map(Light::Area).collect(), &geometry);
    let (mut points, mut normals, mut ids) = (DVec3Rows::ZERO, Vec3Rows::ZERO, [0; BATCH]);
    for count in [1, 16, 100, BATCH] {
        let mut normal =
            |i: usize| if i.is_multiple_of(3) { Vec3::ZERO } else { random.direction().as_vec3().normalize() };
        let normal_of: Vec<_> = (0..count).map(&mut normal).collect();
        let vertices: Vec<_> =
            (0..count).map(|_| (random.below(lights.len()), random.cube() * 3.0, random.pair())).collect();
        let numbers = SampleRows::new(&vertices.iter().map(|(_, _, [u, v])| [0.0, *u, *v, 0.0]).collect::<Vec<_>>());
        // One in eight is not queued.
        let is_queued = |lane: usize| lane % 8 != 3;
        for (lane, (i, p, _)) in vertices.iter().enumerate() {
            points.set(lane, *p);
            normals.set(lane, normal_of[lane]);
            ids[lane] = *i as u32;
        }
        let lanes: Vec<u8> = (0..count as u8).filter(|&lane| is_queued(usize::from(lane))).collect();
        queue.queue(&set, &lanes, &ids);
        let (mut samples, mut target_p) = (LightSampleRows::default(), DVec3Rows::ZERO);
        queue.sample(
            &LightQueries { count, points: &points, normals: &normals, u: &numbers },
            &[0.5; BATCH],
            &mut samples,
            &mut target_p,
        );
        let mut sampled = 0;
        for (lane, (i, p, u)) in vertices.iter().enumerate() {
            let found = queued_words(&samples, &target_p, lane);
            let alone = lights[*i].sample(&geometry, &[], &LightSampleContext { p: *p, n: normal_of[lane] }, *u);
            assert_eq!(found, alone.as_ref().map(words).filter(|_| is_queued(lane)), "{i} {p} {u:?}");
            sampled += usize::from(found.is_some());
        }
        assert!(sampled >= count / 4);
    }
}

#[test]
fn each_light_has_its_own_area() {
    let mut geometry = ceiling();
    let small = scene(&[[0.0, 0.0, 2.0], [0.0, 0.1, 2.0], [0.1, 0.1, 2.0], [0.1, 0.0, 2.0]], &[[0, 1, 2], [0, 2, 3]]);
    geometry.shapes.extend(small.shapes);
    let [large, small] = [0, 1].map(|i| AreaLight::for_shape(ShapeId(i), WHITE, &geometry, &[]).remove(0));
    assert!((large.area() - 1.0).abs() < 1e-6 && (small.area() - 0.01).abs() < 1e-8);
    assert!((small.power() / (0.01 * PI) - 1.0).abs() < 1e-5);
}

#[test]
fn only_parallelograms_are_single_lights() {
    let corners =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.2, 1.1, 0.0], [1.0, 1.0, 1e-3]];
    let count =
        |triangles: &[[u32; 3]]| AreaLight::for_shape(ShapeId(0), WHITE, &scene(&corners, triangles), &[]).len();
    for rotation in 0..3 {
        let turned = |t: [u32; 3]| [t[rotation], t[(rotation + 1) % 3], t[(rotation + 2) % 3]];
        assert_eq!(count(&[[0, 1, 2], turned([0, 2, 3])]), 1);
        assert_eq!(count(&[turned([0, 1, 3]), [1, 2, 3]]), 1);
        // The second looks the other way, or the corners are none of a parallelogram.
        assert_eq!(count(&[[0, 1, 2], turned([0, 3, 2])]), 2);
        assert_eq!(count(&[[0, 1, 3], turned([1, 4, 3])]), 2);
        assert_eq!(count(&[[0, 1, 3], turned([1, 5, 3])]), 2);
        assert_eq!(count(&[[0, 1, 2], turned([0, 1, 2])]), 2);
    }
    assert_eq!(count(&[[0, 1, 2]]), 1);
    assert_eq!(count(&[[0, 1, 2], [0, 2, 3], [0, 1, 4]]), 3);
}

#[test]
fn triangles_without_area_give_no_light() {
    let geometry = scene(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[[0, 1, 2], [0, 0, 1]]);
    for light in AreaLight::for_shape(ShapeId(0), WHITE, &geometry, &[]) {
        let both = AreaLight { emission: Emission { two_sided: true, ..WHITE }, ..light };
        assert!(
            both.sample(&geometry, &[], &LightSampleContext::from_any_side(DVec3::new(0.3, 0.2, 1.0)), [0.3, 0.6])
                .is_none()
        );
        assert_eq!(both.power(), 0.0);
    }
}

#[test]
fn a_point_almost_in_a_rectangle_sees_it_evenly() {
    let quad = ParallelogramEmitter::new(DVec3::new(-1.0, -0.5, 0.0), [DVec3::X * 3.0, DVec3::Y * 2.0], DVec3::Z, 0.0)
        .unwrap();
    // Above the inside the rectangle fills a hemisphere, above an edge half of it, above a corner a quarter.
    for (x, y, from, to) in
        [(0.3, 0.4, -PI, PI), (-1.0, 0.4, -0.5 * PI, 0.5 * PI), (-1.0, -0.5, 0.0, 0.5 * PI), (1.5, 1.5, -PI, 0.0)]
    {
        for height in [1e-12, 1e-8, 1e-5] {
            let p = DVec3::new(x, y, height);
            let (mut counts, mut random) = (vec![0u32; 256], Rng::new(3));
            for _ in 0..30_000 {
                let s = quad.sample(&LightSampleContext::from_any_side(p), random.pair(), true).unwrap();
                assert!((f64::from(s.pdf) * (to - from) - 1.0).abs() < 1e-4);
                let d = (s.p - p).normalize();
                let (i, j) = ((-d.z * 16.0) as usize, ((d.y.atan2(d.x) - from) / (to - from) * 16.0) as usize);
                counts[i.min(15) * 16 + j.min(15)] += 1;
            }
            assert_chi_squared(&counts, &[1.0 / 256.0; 256], &format!("rectangle from {p}"));
        }
    }
}
