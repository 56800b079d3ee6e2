//! Vectors (from glam), rays, boxes, frames, transforms, roots and the one home of tolerances.

mod aabb;
pub mod bernstein;
pub mod compact;
mod cone;
mod exponential;
pub mod float;
mod frame;
mod motion;
pub mod prefetch;
pub mod random;
mod ray;
mod render_space;
mod roots;
pub mod rows;
mod transform;
mod trig;
pub mod vectorize;

pub use aabb::{Aabb, Bounds};
pub use cone::RayCone;
pub use exponential::{exp_of, ln_of};
pub use frame::Frame;
pub use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4, dvec2, dvec3, vec2, vec3};
pub use motion::Motion;
pub use random::Rng;
pub use ray::{Ray, RayF64, RayRows};
pub use render_space::RenderSpace;
pub use roots::{
    Bracket, Quadratic, bisect, difference_of_products, newton_in_bracket, quadratic_roots, solve_quadratic,
};
pub use transform::Transform;
pub use trig::{angle_of, sin_cos_eighth, sin_cos_turns, unit_circle};
