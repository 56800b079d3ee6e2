use std::f64::consts::{FRAC_PI_3, PI, TAU};

use super::tests::{assert_power_flows_out, assert_samples_are_hits, irradiance, queued_words, words};
use super::*;
use crate::geometry::{Disk, Frustum, Quad, Sphere};
use crate::light::queue::{LightSampleOutput, SampleGroup};
use crate::light::{
    Light, LightContext, LightQueries, LightSampleContext, LightSampleRows, LightSet, MisCompensation, comes_from_front,
};
use crate::math::rows::{BATCH, DVec3Rows, Vec3Rows};
use crate::math::{DAffine3, DMat3, Rng, Transform};
use crate::sampling::SampleRows;

const WHITE: Emission = Emission::constant(Rgb::WHITE);
const TWO_SIDED: Emission = Emission { two_sided: true, ..WHITE };

fn place(shape: Analytic, map: DAffine3) -> Geometry {
    let placed = TransformedShape::new(shape, Transform::new(map).unwrap());
    Geometry { shapes: vec![Shape::Analytic(placed)], world: vec![ShapeId(0)], ..Geometry::default() }
}

fn light(geometry: &Geometry, emission: Emission) -> AreaLight {
    AreaLight::new(ShapeId(0), PrimId(0), emission, geometry, &[])
}

fn sphere() -> Analytic {
    Analytic::Sphere(Sphere::full(0.5).unwrap())
}

/// A rotation about a skew axis, with scales along the axes and a translation.
fn skew(scale: [f64; 3]) -> DAffine3 {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.3);
    DAffine3 { matrix3: turn * DMat3::from_diagonal(scale.into()), translation: DVec3::new(0.4, 1.0, -0.7) }
}

/// Every analytic emitter that is not whole, and ways to place it.
fn partial() -> Vec<(&'static str, Analytic)> {
    vec![
        ("disk", Analytic::Disk(Disk::new(1.0, 0.0, TAU).unwrap())),
        ("ring sector", Analytic::Disk(Disk::new(1.0, 0.4, 4.0).unwrap())),
        ("partial sphere", Analytic::Sphere(Sphere::new(1.0, -0.2, 0.7, 5.0).unwrap())),
        ("cylinder", Analytic::Frustum(Frustum::cylinder(0.6, 1.5, 3.0).unwrap())),
        ("cone", Analytic::Frustum(Frustum::new(0.8, 0.0, 1.2, TAU).unwrap())),
        ("frustum", Analytic::Frustum(Frustum::new(0.8, 0.3, 1.2, 2.0).unwrap())),
        ("quad", Analytic::Quad(Quad::new(DVec3::new(-0.5, -0.3, 0.2), DVec3::new(1.0, 0.2, 0.0), DVec3::Y).unwrap())),
    ]
}

#[test]
fn a_placed_sphere_gives_the_closed_form_irradiance() {
    let map = DAffine3 { matrix3: skew([2.0, 2.0, -2.0]).matrix3, translation: DVec3::new(1.2, 0.0, 1.6) };
    let geometry = place(Analytic::Sphere(Sphere::full(0.25).unwrap()), map);
    let light = light(&geometry, WHITE);
    // E = pi L (R / d)² cos.
    let e = irradiance(std::slice::from_ref(&light), &geometry, DVec3::ZERO, DVec3::Z);
    assert!((e / (PI * 0.0625 * 0.8) - 1.0).abs() < 1e-4, "{e}");
    assert!((light.power() / (4.0 * PI * PI * 0.25) - 1.0).abs() < 1e-6);
    assert_samples_are_hits(&geometry, &light, DVec3::ZERO, 1e-4);
    assert_samples_are_hits(&geometry, &light, DVec3::new(1.2, 0.3, 2.2), 1e-4);
    assert!(
        light.sample(&geometry, &[], &LightSampleContext::from_any_side(DVec3::new(1.2, 0.1, 1.5)), [0.5; 2]).is_none()
    );
}

#[test]
fn a_sphere_turned_inside_out_lights_its_inside() {
    let mut geometry = place(sphere(), skew([3.0; 3]));
    if let Shape::Analytic(placed) = &mut geometry.shapes[0] {
        placed.reverse_normal = true;
    }
    let light = light(&geometry, WHITE);
    for p in [[0.4, 1.0, -0.7], [0.2, 0.4, 0.1]] {
        // Radiance 1 from everywhere.
        let e = irradiance(std::slice::from_ref(&light), &geometry, p.into(), DVec3::new(0.6, 0.0, 0.8));
        assert!((e / PI - 1.0).abs() < 1e-3, "{e}");
        assert_samples_are_hits(&geometry, &light, p.into(), 1e-4);
    }
    assert!(light.sample(&geometry, &[], &LightSampleContext::from_any_side(DVec3::splat(9.0)), [0.5; 2]).is_none());
}

#[test]
fn a_quad_light_gives_lamberts_irradiance() {
    let quad = Analytic::Quad(Quad::new(DVec3::new(-0.3, -0.5, 0.0), DVec3::Y, DVec3::X).unwrap());
    let geometry = place(quad, DAffine3::from_translation(DVec3::Z));
    let light = light(&geometry, WHITE);
    let e = irradiance(std::slice::from_ref(&light), &geometry, DVec3::ZERO, DVec3::Z);
    assert!((e / 0.718_688_9 - 1.0).abs() < 1e-4, "{e}");
    assert!(
        light.sample(&geometry, &[], &LightSampleContext::from_any_side(DVec3::new(0.0, 0.0, 2.0)), [0.5; 2]).is_none()
    );
}

/// No sample that is seen from the front has its own shape in the way, from near and far, within and without, from the
/// shape itself, towards either side.
#[test]
fn shapes_that_shadow_rays_may_skip_do_not_hide_their_samples() {
    let mut rng = Rng::new(11);
    let (mut skipped, mut count) = (Vec::new(), 0);
    for (name, shape) in partial().into_iter().chain([("sphere", sphere())]) {
        for (scale, is_reversed) in [([1.0; 3], false), ([-2.0; 3], true), ([1.0, 1.7, 0.6], false)] {
            let mut geometry = place(shape.clone(), skew(scale));
            if let Shape::Analytic(placed) = &mut geometry.shapes[0] {
                placed.reverse_normal = is_reversed;
            }
            for emission in [WHITE, TWO_SIDED] {
                let light = light(&geometry, emission);
                let Some(id) = light.end_shape(&geometry) else { continue };
                skipped.push(name);
                for k in 0..2_000 {
                    let distance = 0.03 * 10f64.powi(k % 7);
                    let mut start = DVec3::new(0.4, 1.0, -0.7) + rng.direction() * distance;
                    let mut n = rng.direction().as_vec3();
                    let mut u = || [rng.unit_f32(), rng.unit_f32()];
                    if let (6, Shape::Analytic(placed)) = (k % 7, geometry.shape(id)) {
                        let own = placed.sample_area(u());
                        (start, n) = (own.p, own.n);
                    }
                    let from = SpawnPoint { p: start, n, error: 1e-6 };
                    let context = LightSampleContext::from_any_side(start);
                    let Some(sample) = light.sample(&geometry, &[], &context, u()) else { continue };
                    let ShadowTarget::Point(end) = sample.target else { panic!("{name} is at infinity") };
                    let ray = from.ray_to(&end);
                    if !comes_from_front(ray.direction, sample.wi, end.n) {
                        continue;
                    }
                    count += 1;
                    assert!(geometry.shape(id).intersect_prim(&ray, id, PrimId(0)).is_none(), "{name} {ray:?}");
                }
            }
        }
    }
    skipped.dedup();
    assert!(count > 15_000, "{count}");
    assert_eq!(skipped, ["disk", "ring sector", "quad", "sphere"]);
}

#[test]
fn hits_of_partial_emitters_have_the_density_of_samples() {
    for (name, shape) in partial().into_iter().chain([("sphere", sphere())]) {
        for scale in [[1.0; 3], [-2.0; 3], [1.0, 1.7, 0.6]] {
            let geometry = place(shape.clone(), skew(scale));
            let light = light(&geometry, TWO_SIDED);
            for p in [DVec3::new(2.0, 3.0, 2.0), DVec3::new(-20.0, 3.0, 30.0)] {
                assert_samples_are_hits(&geometry, &light, p, 1e-4);
            }
            if name != "sphere" {
                assert_power_flows_out(&geometry, &light, DVec3::new(0.4, 1.0, -0.7), 12.0, 0.03);
            }
            let one_sided = AreaLight { emission: WHITE, ..light.clone() };
            assert_power_flows_out(&geometry, &one_sided, DVec3::new(0.4, 1.0, -0.7), 12.0, 0.03);
            assert!((2.0 * one_sided.power() / light.power() - 1.0).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn the_area_of_a_stretched_surface_is_that_of_the_surface() {
    // A cylinder stretched into an elliptic one: circumference by Ramanujan's second formula, which is exact to 1e-5
    // here.
    let map = DAffine3::from_scale(DVec3::new(1.5, 1.0, 2.0));
    let geometry = place(Analytic::Frustum(Frustum::cylinder(1.0, 1.0, TAU).unwrap()), map);
    let h = (0.5f64 / 2.5).powi(2);
    let exact = 2.0 * PI * 2.5 * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    assert!((light(&geometry, WHITE).area() / exact - 1.0).abs() < 1e-3);
    // Half an even turn keeps area.
    let geometry = place(Analytic::Disk(Disk::new(2.0, 1.0, FRAC_PI_3).unwrap()), DAffine3::from_rotation_y(0.3));
    assert!((light(&geometry, WHITE).area() / (0.5 * FRAC_PI_3 * 3.0) - 1.0).abs() < 1e-5);
}

#[test]
fn emitters_sampled_together_have_the_bits_of_those_sampled_alone() {
    let mut shapes = partial();
    shapes.push(("sphere", sphere()));
    let maps = [skew([1.0, 2.0, 0.5]), skew([0.7; 3])];
    let placed = shapes.iter().flat_map(|(_, shape)| {
        maps.map(|map| Shape::Analytic(TransformedShape::new(shape.clone(), Transform::new(map).unwrap())))
    });
    let geometry = Geometry { shapes: placed.collect(), ..Geometry::default() };
    let lights: Vec<_> = (0..geometry.shapes.len())
        .flat_map(|i| {
            [WHITE, TWO_SIDED].map(|emission| AreaLight::new(ShapeId::new(i), PrimId(0), emission, &geometry, &[]))
        })
        .filter(|light| matches!(light.form, EmitterShape::Sphere(_) | EmitterShape::TransformedShape { .. }))
        .collect();
    let mut random = Rng::new(31);
    let mut queue = EmitterScratch::default();
    let set = LightSet::new(lights.iter().cloned().map(Light::Area).collect(), &geometry);
    let context = LightContext { geometry: &geometry, textures: &[], lights: &set, compensation: MisCompensation::Off };
    let (mut points, mut ids) = (DVec3Rows::ZERO, [0; BATCH]);
    let mut sampled = 0;
    for kinds in [1, 2, 4, 4, 4, 4, lights.len()] {
        let first = random.below(lights.len());
        let vertices: Vec<_> = (0..BATCH)
            .map(|_| ((first + random.below(kinds)) % lights.len(), random.cube() * 5.0 - 2.0, random.pair()))
            .collect();
        let numbers = SampleRows::new(&vertices.iter().map(|(_, _, [u, v])| [0.0, *u, *v, 0.0]).collect::<Vec<_>>());
        for (lane, (i, p, _)) in vertices.iter().enumerate() {
            points.set(lane, *p);
            ids[lane] = *i as u32;
        }
        let lanes_of = |group| -> Vec<u8> {
            (0..BATCH as u8).filter(|&lane| lights[vertices[usize::from(lane)].0].sample_group() == group).collect()
        };
        let [spheres, others] = [SampleGroup::Spheres, SampleGroup::Shapes].map(lanes_of);
        let (mut samples, mut target_p) = (LightSampleRows::default(), DVec3Rows::ZERO);
        let out = &mut LightSampleOutput { pmfs: &[0.5; BATCH], samples: &mut samples, target_p: &mut target_p };
        let queries = LightQueries { count: BATCH, points: &points, normals: &Vec3Rows::ZERO, u: &numbers };
        queue.sample_spheres(&spheres, &ids, &context, &queries, out);
        queue.sample_shapes(&others, &ids, &context, &queries, out);
        let is_sampled: Vec<_> =
            (0..BATCH as u8).map(|lane| spheres.contains(&lane) || others.contains(&lane)).collect();
        for (lane, (i, p, u)) in vertices.iter().enumerate() {
            let alone = lights[*i].sample(&geometry, &[], &LightSampleContext::from_any_side(*p), *u);
            let found = queued_words(&samples, &target_p, lane);
            assert_eq!(found, alone.as_ref().map(words).filter(|_| is_sampled[lane]), "{i} {p} {u:?}");
            sampled += usize::from(found.is_some());
        }
    }
    assert!(sampled > BATCH);
}
