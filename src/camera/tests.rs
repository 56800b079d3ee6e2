use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::math::rows::{BATCH, pair};
use crate::math::{DAffine3, RayRows, Rng};
use crate::sampling::SampleRows;

const PLACE: DVec3 = DVec3::new(1.0, 2.0, 3.0);

fn placed(projection: Projection) -> Camera {
    Camera::new(Transform::from_translation(PLACE), projection)
}

fn camera(lens: Option<Lens>) -> Camera {
    placed(Projection::Perspective { half_height: (0.5 * FRAC_PI_2).tan(), lens })
}

fn direction(camera: &Camera, x: f32, y: f32) -> Vec3 {
    camera.ray(Vec2::new(x, y), [200, 100], [0.5; 2], 0.0).direction
}

#[test]
fn corners_of_a_wide_picture_span_the_field_of_view() {
    assert!((direction(&camera(None), 0.0, 0.0) - Vec3::new(-2.0, 1.0, -1.0).normalize()).length() < 1e-6);
    assert!((direction(&camera(None), 100.0, 50.0) + Vec3::Z).length() < 1e-7);
}

#[test]
fn pictures_that_are_not_square_are_not_stretched() {
    // Steps of a pixel to the right and down are equally long on the picture; one angle on both axes makes them differ
    // by the aspect.
    let on_picture = |x: f32, y: f32| {
        let d = direction(&camera(None), x, y);
        d / -d.z
    };
    let right = on_picture(101.0, 50.0) - on_picture(100.0, 50.0);
    let down = on_picture(100.0, 51.0) - on_picture(100.0, 50.0);
    assert!((right.length() - down.length()).abs() < 1e-6 && (right.length() - 0.02).abs() < 1e-6);
}

#[test]
fn orthographic_rays_are_parallel_and_span_the_height() {
    let camera = placed(Projection::Orthographic { half_height: 1.5 });
    let upper_left = camera.ray(Vec2::ZERO, [200, 100], [0.5; 2], 0.0);
    let lower_right = camera.ray(Vec2::new(200.0, 100.0), [200, 100], [0.5; 2], 0.0);
    assert_eq!((upper_left.direction, lower_right.direction), (-Vec3::Z, -Vec3::Z));
    assert!((upper_left.origin - Vec3::new(1.0 - 3.0, 2.0 + 1.5, 3.0)).length() < 1e-6);
    assert!((lower_right.origin - Vec3::new(1.0 + 3.0, 2.0 - 1.5, 3.0)).length() < 1e-6);
}

#[test]
fn the_environment_camera_sees_what_an_environment_light_shows() {
    let camera = placed(Projection::Environment);
    for (x, y, expected) in [
        (100.0, 50.0, -Vec3::Z),
        (150.0, 50.0, Vec3::X),
        (50.0, 50.0, -Vec3::X),
        (0.0, 50.0, Vec3::Z),
        (200.0, 50.0, Vec3::Z),
        (70.0, 0.0, Vec3::Y),
        (30.0, 100.0, -Vec3::Y),
    ] {
        assert!((direction(&camera, x, y) - expected).length() < 1e-6, "{x} {y}");
    }
    // Beyond the pole the picture goes on at the opposite azimuth.
    assert!((direction(&camera, 20.0, -5.0) - direction(&camera, 120.0, 5.0)).length() < 1e-6);
    // Each row fills the solid angle of its band: the cosine of the polar angle is that of the row.
    assert!((direction(&camera, 37.0, 25.0).y - std::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
}

#[test]
fn pixels_twice_as_wide_show_twice_the_width() {
    for projection in
        [Projection::Perspective { half_height: 1.0, lens: None }, Projection::Orthographic { half_height: 1.0 }]
    {
        let wide = placed(projection).with_framing(Framing { pixel_aspect: 2.0, ..Framing::default() });
        // A picture of half the pixels across shows the same.
        let a = wide.ray(Vec2::new(20.0, 30.0), [100, 100], [0.5; 2], 0.0);
        let b = placed(projection).ray(Vec2::new(40.0, 30.0), [200, 100], [0.5; 2], 0.0);
        assert!((a.direction - b.direction).length() < 1e-6 && (a.origin - b.origin).length() < 1e-6, "{projection:?}");
    }
}

#[test]
fn a_shifted_picture_is_a_part_of_a_larger_one() {
    for projection in
        [Projection::Perspective { half_height: 1.0, lens: None }, Projection::Orthographic { half_height: 1.0 }]
    {
        let shifted = placed(projection).with_framing(Framing { shift: [0.25, -0.5], ..Framing::default() });
        let a = shifted.ray(Vec2::new(20.0, 30.0), [200, 100], [0.5; 2], 0.0);
        let b = placed(projection).ray(Vec2::new(20.0 + 50.0, 30.0 + 50.0), [200, 100], [0.5; 2], 0.0);
        assert!((a.direction - b.direction).length() < 1e-6 && (a.origin - b.origin).length() < 1e-6, "{projection:?}");
    }
}

#[test]
fn nothing_nearer_than_the_near_limit_is_seen() {
    let lens = Lens { radius: 0.1, focus_distance: 2.0, blades: None };
    for projection in [
        Projection::Perspective { half_height: 1.0, lens: None },
        Projection::Perspective { half_height: 1.0, lens: Some(lens) },
        Projection::Orthographic { half_height: 1.0 },
        Projection::Environment,
    ] {
        let (whole, clipped) = (placed(projection), placed(projection).with_near(0.75));
        for u in [[0.1, 0.2], [0.8, 0.6]] {
            let film = Vec2::new(20.0, 30.0);
            let (a, b) = (whole.ray(film, [200, 100], u, 0.0), clipped.ray(film, [200, 100], u, 0.0));
            assert!((a.direction - b.direction).length() < 1e-6);
            assert!((clipped.depth(b.origin.as_dvec3(), 0.0) - 0.75).abs() < 1e-6, "{projection:?}");
            let along = (b.origin - a.origin).normalize();
            assert!((along - a.direction).length() < 1e-5, "{projection:?}");
        }
    }
}

#[test]
fn depth_is_measured_along_the_axis_or_from_an_environment_camera() {
    let p = PLACE + DVec3::new(3.0, 4.0, -12.0);
    assert!((camera(None).depth(p, 0.0) - 12.0).abs() < 1e-6);
    assert!((placed(Projection::Orthographic { half_height: 1.0 }).depth(p, 0.0) - 12.0).abs() < 1e-6);
    assert!((placed(Projection::Environment).depth(p, 0.0) - 13.0).abs() < 1e-6);
}

#[test]
fn times_fill_the_shutter_interval() {
    let open = camera(None).with_shutter([0.25, 0.75]);
    assert_eq!((open.shutter(), open.time(0.0), open.time(0.5)), ([0.25, 0.75], 0.0, 0.5));
    let instant = camera(None).with_shutter([0.25, 0.25]);
    assert_eq!(instant.time(0.5), 0.0);
}

#[test]
fn a_camera_that_turns_looks_along_its_turned_axis_at_each_time() {
    let base = DAffine3::from_translation(PLACE);
    let turn = Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_rotation_y(2.0))]).unwrap();
    for lens in [None, Some(Lens { radius: 0.2, focus_distance: 3.0, blades: None })] {
        let moving = camera(lens).with_motion(turn.after(&Motion::constant(base))).unwrap();
        assert!(moving.is_moving() && moving.position() == PLACE);
        for time in [0.0, 0.3, 1.0] {
            let there = DAffine3::from_rotation_y(2.0 * f64::from(time)) * base;
            let still = Camera::new(Transform::new(there).unwrap(), *moving.projection());
            let film = Vec2::new(30.0, 20.0);
            let (a, b) = (moving.ray(film, [200, 100], [0.2, 0.7], time), still.ray(film, [200, 100], [0.2, 0.7], 0.0));
            assert!(
                (a.origin - b.origin).length() < 1e-6 && (a.direction - b.direction).length() < 1e-6 && a.time == time
            );
            let p = DVec3::new(0.5, -7.0, 2.0);
            assert!((moving.depth(p, time) - still.depth(p, 0.0)).abs() < 1e-5);
        }
    }
    let rest = camera(None).with_motion(Motion::constant(base)).unwrap();
    assert!(!rest.is_moving());
}

#[test]
fn time_is_drawn_only_while_the_shutter_is_open() {
    assert_eq!(camera(None).time(0.3), 0.3);
    assert_eq!(camera(None).with_shutter([2.0, 2.0]).time(0.3), 0.0);
}

#[test]
fn rays_of_batches_are_those_of_single_points() {
    let lens = Lens { radius: 0.1, focus_distance: 2.0, blades: None };
    let mut rng = Rng::new(1);
    // The first is the centre of the picture and of the lens.
    let numbers: Vec<[f32; 4]> =
        (0..BATCH).map(|i| if i == 0 { [0.5; 4] } else { std::array::from_fn(|_| rng.unit_f32()) }).collect();
    let size = [200, 100];
    let film = [0, 1].map(|k| std::array::from_fn(|i| numbers[i][k] * size[k] as f32));
    for (lens, near) in [(None, 0.0), (None, 0.75), (Some(lens), 0.0), (Some(lens), 0.75)] {
        let camera = camera(lens).with_near(near);
        let mut rays = RayRows::default();
        let picture = camera.perspective(size).unwrap();
        camera.perspective_rays(&picture, &film, &SampleRows::new(&numbers), &mut rays, BATCH);
        for (i, [_, _, u, v]) in numbers.iter().copied().enumerate() {
            assert_eq!(rays.get(i), camera.ray(Vec2::from(pair(&film, i)), size, [u, v], 0.0), "{lens:?} {near} {i}");
        }
    }
    let blades = Some(Blades { count: 5, rotation: 0.0 });
    assert!(camera(Some(Lens { blades, ..lens })).perspective(size).is_none());
    assert!(placed(Projection::Environment).perspective(size).is_none());
}
