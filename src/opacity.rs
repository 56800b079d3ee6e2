//! Opacity: surfaces with holes, as a number or a texture says.

use crate::geometry::{Coverage, Hit, Shape};
use crate::id::ShapeId;
use crate::math::Ray;
use crate::texture::{Footprint, Texture};

/// How much of each shape is there.
#[derive(Debug)]
pub struct Opacity {
    by_shape: Vec<Option<Texture>>,
}

impl Opacity {
    /// The opacity of each shape by [`ShapeId`], as the [number](Texture::scalar_over) of a texture from 0 to 1; `None` for all of it.
    pub fn new(by_shape: Vec<Option<Texture>>) -> Self {
        Self { by_shape }
    }
}

impl Coverage for Opacity {
    #[inline]
    fn has_holes(&self, shape: ShapeId) -> bool {
        self.by_shape[shape.index()].is_some()
    }

    fn coverage(&self, shape: &Shape, ray: &Ray, hit: &Hit) -> f32 {
        let Some(texture) = &self.by_shape[hit.shape.index()] else { return 1.0 };
        let point = match shape {
            Shape::Mesh(mesh) => {
                Footprint { attributes: mesh.attributes_at(hit.prim, hit.u, hit.v), ..Footprint::point(mesh.uv(hit.prim, hit.u, hit.v)) }
            }
            Shape::Analytic(placed) => match placed.interaction(ray, hit) {
                Some(at) => Footprint::point(at.uv),
                // A rounding artefact, which the integrator looks past.
                None => return 1.0,
            },
        };
        texture.scalar_over(&point)
    }
}
