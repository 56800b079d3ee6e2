//! Strands of fur and grass, in the binary form that `docs/curves.md` describes.

use glam::{Vec3 as V, vec3};
use steradian::math::Rng;

/// Strands of equal numbers of control points.
struct Strands {
    points: Vec<[f32; 4]>,
    each: u32,
}

impl Strands {
    fn bytes(&self) -> Vec<u8> {
        let (points, each) = (self.points.len() as u32, self.each);
        let mut bytes = b"STRANDS1".to_vec();
        let numbers = [points / each, points].into_iter().chain((0..points / each).map(|_| each));
        numbers.for_each(|n| bytes.extend(n.to_le_bytes()));
        self.points.as_flattened().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes
    }
}

fn direction(rng: &mut Rng) -> V {
    rng.cube().normalize().as_vec3()
}

/// Fur on a ball of radius 0.5 about the origin, hanging a little: control points of B-splines.
pub fn fur() -> Vec<u8> {
    const COUNT: usize = 3_500;
    let mut rng = Rng::new(3);
    let mut strands = Strands { points: Vec::new(), each: 6 };
    for _ in 0..COUNT {
        let (root, curl) = (direction(&mut rng), 0.12 * direction(&mut rng));
        let length = 0.38 + 0.12 * rng.unit_f32();
        for i in 0..6 {
            let t = (i as f32 - 1.0) / 3.0;
            let p = root * (0.49 + length * t) + (curl - vec3(0.0, 0.16, 0.0)) * t * t;
            strands.points.push([p.x, p.y, p.z, 0.006 * (1.1 - 0.6 * t)]);
        }
    }
    strands.bytes()
}

/// A tuft of blades of grass of height 0.4 that stand on y = 0: Bezier curves.
pub fn tuft() -> Vec<u8> {
    const COUNT: usize = 260;
    let mut rng = Rng::new(4);
    let mut strands = Strands { points: Vec::new(), each: 4 };
    for _ in 0..COUNT {
        let lean = direction(&mut rng);
        let foot = vec3(rng.unit_f32() - 0.5, 0.0, rng.unit_f32() - 0.5);
        let height = 0.25 + 0.15 * rng.unit_f32();
        for (up, out, radius) in [(0.0, 0.0, 0.009), (0.4, 0.02, 0.009), (0.8, 0.15, 0.006), (0.95, 0.35, 0.0)] {
            let p = foot + vec3(lean.x * out, 1.0, lean.z * out) * vec3(height * 1.2, height * up, height * 1.2);
            strands.points.push([p.x, p.y, p.z, radius]);
        }
    }
    strands.bytes()
}
