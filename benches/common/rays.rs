//! Rays as a path tracer sends them: from a camera, one diffuse bounce on, and from there to a light.

use steradian::internal::accel::{Accelerator, Coherence};
use steradian::internal::geometry::SpawnPoint;
use steradian::internal::math::{Ray, Rng, Vec3};

use super::models::Model;

/// Rays of one kind.
pub struct RaySet {
    /// Short name.
    pub name: &'static str,
    /// Whether any hit will do.
    pub any: bool,
    /// Whether neighbours belong together.
    pub coherence: Coherence,
    /// In the order of pixels.
    pub rays: Vec<Ray>,
}

/// Camera rays, diffuse bounces and shadow rays of a picture of `resolution`² pixels, a multiple of 4.
pub fn ray_sets(model: &Model, accel: &dyn Accelerator, resolution: usize) -> Vec<RaySet> {
    let camera = camera_rays(model, resolution);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    let (center, size) = (model.frame.center().as_dvec3(), f64::from(model.frame.size().max_element()));
    let mut random = Rng::new(7);
    for ray in &camera {
        let Some(si) = accel.intersect(ray).and_then(|hit| model.geometry.interaction(ray, &hit)) else { continue };
        let n = if si.n_g.dot(ray.direction) < 0.0 { si.n_g } else { -si.n_g };
        bounce.push(si.spawn(random.cosine_around(n.as_dvec3()).as_vec3()));
        // A light of a tenth of the model's size, above and beside it.
        let on_light = center
            + size * steradian::internal::math::DVec3::new(0.8 + 0.1 * random.unit(), 1.5, 0.5 + 0.1 * random.unit());
        shadow.push(si.spawn_to(&SpawnPoint { p: on_light, n: Vec3::ZERO, error: 0.0 }));
    }
    vec![
        RaySet { name: "camera", any: false, coherence: Coherence::Coherent, rays: camera },
        RaySet { name: "bounce", any: false, coherence: Coherence::Incoherent, rays: bounce },
        RaySet { name: "shadow", any: true, coherence: Coherence::Coherent, rays: shadow },
    ]
}

/// Blocks of 4 by 4 pixels in order, with the model filling the picture.
fn camera_rays(model: &Model, resolution: usize) -> Vec<Ray> {
    let (center, size) = (model.frame.center(), model.frame.size().max_element());
    let eye = center + Vec3::new(0.5, 0.7, 1.6) * size;
    let forward = (center - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let blocks = resolution / 4;
    let pixel = |n: usize| {
        let (block, within) = (n / 16, n % 16);
        let (x, y) = (block % blocks * 4 + within % 4, block / blocks * 4 + within / 4);
        let at = |p: usize| (p as f32 + 0.5) / resolution as f32 - 0.5;
        Ray::new(eye, (forward + 0.7 * (right * at(x) - up * at(y))).normalize())
    };
    (0..blocks * blocks * 16).map(pixel).collect()
}
