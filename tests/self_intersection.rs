//! Rays that leave a triangle do not find it again, however large or small it is; more of it is in group B of the
//! stability catalogue.

use steradian::internal::accel::EmbreeAccel;
use steradian::internal::id::PrimId;

use crate::util::geometry::{Rng, closest, meshes, ray_through, triangle};

#[test]
fn a_triangle_of_any_size_is_not_hit_again() {
    let mut rng = Rng::new(1);
    let (mut rays, mut again) = (0, 0);
    for _ in 0..200 {
        let size = rng.magnitude(-8.0, 8.0);
        let mesh = triangle(rng.cube() * size, rng.cube() * size, rng.cube() * size);
        let points = mesh.triangle_points(PrimId(0));
        let [a, b, c] = [points.a, points.b, points.c].map(steradian::internal::math::Vec3::as_dvec3);
        let geometry = meshes(vec![mesh]);
        let accel = EmbreeAccel::new(&geometry, 1).expect("Embree builds");
        for _ in 0..100 {
            let [u, v, w] = rng.barycentric();
            let target = a * u + b * v + c * w;
            let Some(si) = closest(&accel, &geometry, &ray_through(target + rng.direction() * size, target)).found
            else {
                continue;
            };
            rays += 1;
            again += usize::from(closest(&accel, &geometry, &si.spawn(rng.direction().as_vec3())).found.is_some());
        }
    }
    assert!(rays > 15_000, "{rays}");
    assert_eq!(again, 0);
}
