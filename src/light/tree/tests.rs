use super::*;
use crate::color::Rgb;
use crate::geometry::{Analytic, Disk, Geometry, Mesh, Quad, Shape, Sphere, TransformedShape};
use crate::id::{LightId, ShapeId};
use crate::light::set::LightChoiceRows;
use crate::light::{
    AreaLight, Emission, Environment, IesLight, IesProfile, Light, LightQueries, LightSelection, LightSet,
    MisCompensation, PointLight, SpotLight,
};
use crate::math::rows::{BATCH, DVec3Rows, Vec3Rows};
use crate::math::{DAffine3, Rng, Transform};
use crate::sampling::SampleRows;

const CLOUD: usize = 40;

/// Lights of every kind that is not at infinity, of sizes and powers that differ by orders of magnitude, and lights at
/// infinity if `sky`.
fn cloud(seed: u64, sky: bool) -> (Geometry, LightSet) {
    let mut random = Rng::new(seed);
    let mut next = move || f64::from(random.unit_f32());
    let mut place = || DVec3::new(next(), next(), next()) * 4.0 - 2.0;
    let mut geometry = Geometry::default();
    let mut lights = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..CLOUD {
        let (p, q) = (place(), place());
        let power = (0.5 * q.x * 4.0).exp() as f32;
        let emission = Emission { two_sided: i % 3 == 0, ..Emission::constant(Rgb::new(power, 0.5 * power, power)) };
        let turn = DAffine3::from_axis_angle(q.normalize(), 3.0 * p.y)
            * DAffine3::from_scale(DVec3::splat(0.02 + 0.2 * q.z.abs()));
        let transform = Transform::new(DAffine3::from_translation(p) * turn).unwrap();
        let analytic = match i % 4 {
            0 => Analytic::Quad(Quad::new(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y).unwrap()),
            1 => Analytic::Sphere(Sphere::new(0.5, -0.5, 0.5, std::f64::consts::TAU).unwrap()),
            2 => Analytic::Disk(Disk::new(0.7, 0.2, 4.0).unwrap()),
            _ => {
                triangles
                    .extend([p, p + 0.1 * q, p + 0.1 * DVec3::new(q.y, -q.x, q.z)].map(|v| v.as_vec3().to_array()));
                continue;
            }
        };
        geometry.shapes.push(Shape::Analytic(TransformedShape::new(analytic, transform)));
        let shape = ShapeId::new(geometry.shapes.len() - 1);
        geometry.world.push(shape);
        lights.extend(AreaLight::for_shape(shape, emission, &geometry, &[]).into_iter().map(Light::Area));
    }
    let corners = (0..triangles.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    geometry.shapes.push(Shape::Mesh(Mesh::new(triangles, corners, None, None).unwrap()));
    let shape = ShapeId::new(geometry.shapes.len() - 1);
    geometry.world.push(shape);
    let mesh = AreaLight::for_shape(shape, Emission::constant(Rgb::WHITE), &geometry, &[]);
    lights.extend(mesh.into_iter().map(Light::Area));
    for i in 0..6 {
        let (p, q) = (place(), place());
        let intensity = Rgb::splat(0.01 * (i + 1) as f32);
        lights.push(Light::Point(PointLight { position: p, intensity }));
        lights.push(Light::Spot(Box::new(SpotLight::new(
            p,
            q,
            intensity,
            0.2 * f64::from(i),
            0.3 + 0.5 * f64::from(i),
        ))));
        let profile =
            IesProfile::new(vec![0.0, 30.0 + 25.0 * i as f32], vec![0.0, 180.0], vec![1.0, 2.0, 3.0, 0.0]).unwrap();
        lights.push(Light::Ies(Box::new(IesLight::new(p, q, 0.4, intensity, profile.into()))));
    }
    lights.push(Light::Point(PointLight { position: DVec3::ZERO, intensity: Rgb::BLACK }));
    if sky {
        lights.push(Light::Environment(Environment::Constant(Rgb::splat(0.1))));
    }
    let set = LightSet::with_selection(lights, &geometry, LightSelection::Tree);
    assert_eq!(set.selection(), LightSelection::Tree);
    (geometry, set)
}

/// Receivers near and far, with a side and without.
fn receivers(seed: u64, count: usize) -> Vec<LightSampleContext> {
    let mut random = Rng::new(seed);
    let receiver = |i: usize| {
        let p = random.direction() * f64::from(random.unit_f32()) * if i.is_multiple_of(5) { 50.0 } else { 3.0 };
        let n = if i.is_multiple_of(4) { Vec3::ZERO } else { random.direction().as_vec3().normalize() };
        LightSampleContext { p, n }
    };
    (0..count).map(receiver).collect()
}

fn pmfs(set: &LightSet, from: &LightSampleContext) -> Vec<f64> {
    (0..set.lights().len()).map(|i| f64::from(set.pmf(LightId::new(i), from, MisCompensation::Off))).collect()
}

#[test]
fn whatever_can_shine_somewhere_can_be_chosen_there() {
    let (geometry, set) = cloud(6, true);
    let mut random = Rng::new(7);
    let (mut shining, mut excluded) = (0, 0);
    for from in receivers(8, 300) {
        for (light, pmf) in set.lights().iter().zip(pmfs(&set, &from)) {
            let mut arrives = false;
            for _ in 0..16 {
                let Some(s) = light.sample(&geometry, &[], &from, random.pair(), MisCompensation::Off) else {
                    continue;
                };
                arrives |= s.radiance.luminance() > 0.0 && (from.n == Vec3::ZERO || s.wi.dot(from.n) > 0.0);
            }
            assert!(pmf > 0.0 || !arrives, "{from:?} {light:?}");
            shining += usize::from(arrives);
            excluded += usize::from(pmf == 0.0);
        }
    }
    // The test means something only if both happen often.
    assert!(shining > 5_000 && excluded > 2_000, "{shining} {excluded}");
}

#[test]
fn near_lights_are_preferred_to_strong_ones_far_away() {
    let point =
        |x: f64, intensity: f32| Light::Point(PointLight { position: DVec3::X * x, intensity: Rgb::splat(intensity) });
    let mut lights: Vec<Light> = (0..20).map(|i| point(f64::from(i), 1.0)).collect();
    lights.push(point(100.0, 50.0));
    let set = LightSet::new(lights, &Geometry::default());
    assert_eq!(set.selection(), LightSelection::Tree);
    for i in 0..20 {
        let from = LightSampleContext { p: DVec3::new(f64::from(i), 0.1, 0.0), n: Vec3::ZERO };
        // 100 from the light at hand, less than 3.3 from all others together.
        assert!(set.pmf(LightId::new(i as usize), &from, MisCompensation::Off) > 0.9, "{i}");
    }
}

#[test]
fn any_arrangement_of_lights_makes_a_tree_of_bounded_size() {
    type Arrangement = (&'static str, fn(f64) -> DVec3);
    let arrangements: [Arrangement; 4] = [
        ("one point", |_| DVec3::ONE),
        ("a line", |i| DVec3::X * i),
        ("growing gaps", |i| DVec3::Y * (i / 100.0).exp2()),
        ("a plane", |i| DVec3::new((i * 0.618).fract(), 0.0, (i * 0.755).fract())),
    ];
    for (name, place) in arrangements {
        let n = 5_000;
        let lights: Vec<Option<_>> = (0..n)
            .map(|i| PointLight { position: place(f64::from(i)), intensity: Rgb::splat(1.0 + (i % 7) as f32) }.bounds())
            .collect();
        let tree = LightTree::new(&lights).unwrap();
        assert!(tree.memory_bytes() < 150 * n as usize, "{name}: {} bytes", tree.memory_bytes());
        let from = LightSampleContext { p: DVec3::new(0.3, 0.2, 0.1), n: Vec3::ZERO };
        let sum: f64 = (0..n as u32).map(|i| f64::from(tree.pmf(&from, i))).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{name}: {sum}");
        for i in 0..1000 {
            let choice = tree.choose(&from, f64::from(i) / 1000.0).unwrap();
            assert!(choice.pmf > 0.0, "{name}");
        }
    }
    assert!(LightTree::new(&[None, None]).is_none());
}

#[test]
fn choices_of_rows_are_those_of_single_vertices() {
    let mut random = Rng::new(21);
    let (mut with_choice, mut without) = (0, 0);
    for (count, sky) in [(1, false), (2, false), (3, true), (8, false), (8, true), (9, true), (60, false), (300, true)]
    {
        let (geometry, all) = cloud(count, sky);
        let lights = all.lights();
        let mut chosen: Vec<_> = (0..count as usize).map(|_| lights[random.below(lights.len() - 1)].clone()).collect();
        chosen.extend(lights.last().filter(|_| sky).cloned());
        let set = LightSet::with_selection(chosen, &geometry, LightSelection::Tree);
        let receivers = receivers(count, BATCH);
        let (mut points, mut normals) = (DVec3Rows::ZERO, Vec3Rows::ZERO);
        for (lane, from) in receivers.iter().enumerate() {
            points.set(lane, from.p);
            normals.set(lane, from.n);
        }
        let numbers: Vec<_> = (0..BATCH).map(|_| [random.unit_f32(), 0.0, 0.0, random.unit_f32()]).collect();
        let u = SampleRows::new(&numbers);
        for lanes in [1, 17, BATCH] {
            let queries = LightQueries { count: lanes, points: &points, normals: &normals, u: &u };
            let (mut scratch, mut choices) = (LightTreeScratch::default(), LightChoiceRows::default());
            set.choose_rows(&queries, |_| true, MisCompensation::Off, &mut scratch, &mut choices);
            for (lane, (from, [u, _, _, digits])) in receivers.iter().zip(&numbers).enumerate().take(lanes) {
                let alone = set.choose(from, [*u, *digits], MisCompensation::Off);
                let found = Some((choices.light[lane], choices.pmf[lane])).filter(|found| found.1 > 0.0);
                assert_eq!(found, alone.map(|choice| (choice.id.0, choice.pmf)), "{count} {lane} {from:?}");
                if let Some(choice) = alone {
                    let pmf = set.pmf(choice.id, from, MisCompensation::Off);
                    // Factors in another order.
                    let tolerance = if count > 8 { 4.0 * f32::EPSILON * pmf } else { 0.0 };
                    assert!((choice.pmf - pmf).abs() <= tolerance, "{count} {lane} {from:?} {choice:?} {pmf}");
                }
                with_choice += usize::from(alone.is_some());
                without += usize::from(alone.is_none());
            }
        }
    }
    assert!(with_choice > 500 && without > 20, "{with_choice} {without}");
}
