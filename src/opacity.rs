//! Opacity: surfaces with holes, by a number or a texture.

use crate::geometry::{AlphaMask, Detail, Hit, Mesh, Shape};
use crate::id::{PrimId, ShapeId};
use crate::math::{Ray, Vec2};
use crate::texture::{Footprint, SolidTable, Solidity, Texture};

/// How much of each shape is there.
#[derive(Debug)]
pub struct Opacity {
    by_shape: Vec<Option<Holes>>,
}

/// The opacity of a shape.
#[derive(Debug)]
struct Holes {
    texture: Texture,
    /// Of meshes whose texture is an image.
    image: Option<ImageHoles>,
}

/// An image of opacity on a mesh: most hits are decided by what is kept of the triangle in one place, and two bits of
/// the image.
#[derive(Debug)]
struct ImageHoles {
    table: SolidTable,
    /// Of each triangle, the [place](SolidTable::place) of its first corner and the differences to those of the others.
    places: Vec<[Vec2; 3]>,
}

impl Opacity {
    /// The opacity of each shape by [`ShapeId`], as the [number](Texture::scalar_over) of a texture from 0 to 1; `None`
    /// for all of it.
    pub fn new(shapes: &[Shape], by_shape: Vec<Option<Texture>>) -> Self {
        let holes = |(shape, texture): (&Shape, Option<Texture>)| {
            let texture = texture?;
            let image = match shape {
                Shape::Mesh(mesh) => SolidTable::new(&texture).map(|table| ImageHoles::new(mesh, table)),
                Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => None,
            };
            Some(Holes { texture, image })
        };
        Self { by_shape: shapes.iter().zip(by_shape).map(holes).collect() }
    }
}

impl AlphaMask for Opacity {
    #[inline]
    fn has_holes(&self, shape: ShapeId) -> bool {
        self.by_shape[shape.index()].is_some()
    }

    fn alpha(&self, shape: &Shape, ray: &Ray, hit: &Hit) -> f32 {
        let Some(Holes { texture, image }) = &self.by_shape[hit.shape.index()] else { return 1.0 };
        let solidity = image.as_ref().map_or(Solidity::Mixed, |image| image.at(hit));
        match solidity {
            Solidity::Solid => return 1.0,
            Solidity::Hole => return 0.0,
            Solidity::Mixed => {}
        }
        let point = match shape {
            Shape::Mesh(mesh) => Footprint {
                attributes: mesh.attributes_at(hit.prim, hit.u, hit.v),
                ..Footprint::point(mesh.uv(hit.prim, hit.u, hit.v))
            },
            _ => match shape.interaction(Detail::Full, ray, hit) {
                Some(at) => Footprint::point(at.uv),
                // A rounding artefact, which the integrator looks past.
                None => return 1.0,
            },
        };
        texture.scalar_over(&point)
    }
}

impl ImageHoles {
    fn new(mesh: &Mesh, table: SolidTable) -> Self {
        let of_triangle = |i: usize| {
            let at = |u: f32, v: f32| table.place(mesh.uv(PrimId::new(i), u, v));
            let corner = at(0.0, 0.0);
            [corner, at(1.0, 0.0) - corner, at(0.0, 1.0) - corner]
        };
        let places = (0..mesh.triangles().len()).map(of_triangle).collect();
        Self { table, places }
    }

    #[inline(always)]
    fn at(&self, hit: &Hit) -> Solidity {
        let [corner, along_u, along_v] = self.places[hit.prim.index()];
        self.table.at(corner + along_u * hit.u + along_v * hit.v)
    }
}
