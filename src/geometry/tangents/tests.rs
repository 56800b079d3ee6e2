use std::f32::consts::TAU;

use crate::geometry::{Detail, Geometry, Hit, Instance, Mesh, MeshStep, Shape, SurfaceInteraction};
use crate::id::{InstanceId, ObjectId, PrimId, ShapeId};
use crate::math::{DAffine3, DVec3, Ray, Transform, Vec3};

/// A square in the plane z = 0 whose uv are x and y times the given factors.
fn square(factors: [f32; 2]) -> Mesh {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions = corners.map(|[x, y]| [x, y, 0.0]).to_vec();
    let uvs = corners.map(|[x, y]| [x * factors[0], y * factors[1]]).to_vec();
    Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]], None, Some(uvs)).unwrap().with_tangents()
}

fn hit(prim: usize) -> Hit {
    Hit { t: 1.0, u: 0.25, v: 0.25, shape: ShapeId(0), prim: PrimId::new(prim), instance: Hit::NO_INSTANCE }
}

/// What a ray against the normal of a triangle meets, and the change of the point with v.
fn look_at(mesh: &Mesh, prim: usize, time: f32) -> (SurfaceInteraction, Vec3) {
    let points = mesh.triangle_points_at(PrimId::new(prim), time);
    let (p, n) = ((points.a * 2.0 + points.b + points.c) * 0.25, points.cross().normalize().as_vec3());
    mesh.interaction_and_dp_dv(Detail::Full, &Ray { time, ..Ray::new(p + n, -n) }, &hit(prim)).unwrap()
}

#[test]
fn tangents_follow_u_and_bitangents_v_whatever_the_image_does() {
    for factors in [[1.0, 1.0], [-2.0, 1.0], [1.0, -0.5], [-1.0, -1.0]] {
        let mesh = square(factors);
        assert!(mesh.has_tangents());
        for prim in 0..2 {
            let (at, dp_dv) = look_at(&mesh, prim, 0.0);
            let (u, v) = (Vec3::X * factors[0].signum(), Vec3::Y * factors[1].signum());
            assert!((at.dp_du - u).length() < 1e-6 && (dp_dv - v).length() < 1e-6, "{factors:?} {at:?}");
        }
    }
}

#[test]
fn tangents_turn_smoothly_around_a_cylinder() {
    let n = 16;
    let ring = |z: f32| (0..=n).map(move |i| (z, TAU * i as f32 / n as f32));
    let vertices: Vec<(f32, f32)> = ring(0.0).chain(ring(1.0)).collect();
    let positions = vertices.iter().map(|(z, phi)| [phi.cos(), phi.sin(), *z]).collect();
    let normals = vertices.iter().map(|(_, phi)| [phi.cos(), phi.sin(), 0.0]).collect();
    let uvs = vertices.iter().map(|(z, phi)| [phi / TAU, *z]).collect();
    let row = n + 1;
    let triangles = (0..n).flat_map(|i| [[i, i + 1, row + i + 1], [i, row + i + 1, row + i]]).collect();
    let mesh = Mesh::new(positions, triangles, Some(normals), Some(uvs)).unwrap().with_tangents();
    for prim in 0..2 * n as usize {
        let (at, dp_dv) = look_at(&mesh, prim, 0.0);
        let around = Vec3::Z.cross(at.n_s).normalize();
        assert!(at.dp_du.normalize().dot(around) > 0.999, "{prim}: {at:?}");
        assert!(dp_dv.normalize().dot(Vec3::Z) > 0.999, "{prim}: {at:?}");
    }
}

#[test]
fn instances_keep_the_directions_of_u_and_v_mirrored_ones_too() {
    let shape = Shape::Mesh(square([1.0, 1.0]));
    for scale in [DVec3::new(2.0, 3.0, 1.0), DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -2.0, -1.0)] {
        let map = DAffine3::from_scale(scale);
        let instance = Instance::new(ObjectId(0), Transform::new(map).unwrap());
        let geometry = Geometry { shapes: vec![shape.clone()], instances: vec![instance], ..Geometry::default() };
        let toward = DVec3::new(0.5, 0.25, 0.0) * scale;
        let ray = Ray::new((toward + DVec3::Z).as_vec3(), -Vec3::Z);
        let hit = Hit { instance: InstanceId(0), u: 0.25, v: 0.25, ..hit(0) };
        let (at, dp_dv) = (geometry.interaction(&ray, &hit).unwrap(), geometry.dp_dv(&ray, &hit));
        let (u, v) = (at.dp_du.normalize(), dp_dv.normalize());
        assert!((u - Vec3::X * scale.x.signum() as f32).length() < 1e-6, "{scale}: {u}");
        assert!((v - Vec3::Y * scale.y.signum() as f32).length() < 1e-6, "{scale}: {v}");
    }
}

#[test]
fn a_deforming_mesh_has_the_tangents_of_its_time() {
    let mesh = square([1.0, 1.0]);
    // A quarter turn about z: halfway along straight lines it is an eighth.
    let turned = mesh.positions().iter().map(|[x, y, z]| [-y, *x, *z]).collect();
    let mesh = mesh.deforming(vec![MeshStep { positions: turned, normals: None }]).unwrap().with_tangents();
    for (time, u) in [(0.0, Vec3::X), (0.5, Vec3::new(1.0, 1.0, 0.0).normalize()), (1.0, Vec3::Y)] {
        let (at, dp_dv) = look_at(&mesh, 0, time);
        assert!((at.dp_du.normalize() - u).length() < 1e-6, "{time}: {at:?}");
        assert!((dp_dv.normalize() - Vec3::Z.cross(u)).length() < 1e-6, "{time}: {at:?}");
    }
}

#[test]
fn uv_without_directions_leave_the_edges() {
    let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = Mesh::new(positions, vec![[0, 1, 2]], None, Some(vec![[0.5, 0.5]; 3])).unwrap().with_tangents();
    let (at, dp_dv) = look_at(&mesh, 0, 0.0);
    assert!(at.dp_du.is_finite() && dp_dv.is_finite() && at.n_s == at.n_g, "{at:?}");
}
