//! Opacity: surfaces with holes, by a number or a texture.

use std::collections::HashMap;

use crate::geometry::{AlphaMask, Detail, Hit, Mesh, Shape};
use crate::id::{PrimId, ShapeId};
use crate::math::{Ray, Vec2};
use crate::texture::{Footprint, SolidTable, Solidity, Texture};

/// Places are kept once where at least so many triangles, on average, share each.
const MIN_TRIANGLES_PER_PLACE: usize = 4;

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
    /// The [place](SolidTable::place) of a triangle's first corner and the differences to those of the others: of each
    /// triangle, or with `numbers` each that occurs.
    places: Vec<[Vec2; 3]>,
    /// Of each triangle, the number of its places, where many triangles share them, as those of leaves do: what is read
    /// at random then stays in the nearest caches.
    numbers: Option<Vec<u32>>,
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
        let places: Vec<_> = (0..mesh.triangles().len()).map(of_triangle).collect();
        match distinct(&places) {
            Some((places, numbers)) => Self { table, places, numbers: Some(numbers) },
            None => Self { table, places, numbers: None },
        }
    }

    #[inline(always)]
    fn at(&self, hit: &Hit) -> Solidity {
        let number = self.numbers.as_ref().map_or(hit.prim.index(), |numbers| numbers[hit.prim.index()] as usize);
        let [corner, along_u, along_v] = self.places[number];
        self.table.at(corner + along_u * hit.u + along_v * hit.v)
    }
}

/// The places that occur, and of each triangle the number of its own; `None` if too few triangles share them.
fn distinct(places: &[[Vec2; 3]]) -> Option<(Vec<[Vec2; 3]>, Vec<u32>)> {
    let (mut number_of, mut found, mut numbers) = (HashMap::new(), Vec::new(), Vec::new());
    for place in places {
        let number = *number_of.entry(place.map(|v| v.to_array().map(f32::to_bits))).or_insert(found.len() as u32);
        if number as usize == found.len() {
            if MIN_TRIANGLES_PER_PLACE * (found.len() + 1) > places.len() {
                return None;
            }
            found.push(*place);
        }
        numbers.push(number);
    }
    Some((found, numbers))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::image_data::{ImageData, Samples};
    use crate::math::Rng;
    use crate::texture::{Bitmap, Decoding, TextureImage};

    /// Cards of two triangles with texture coordinates of one of so many kinds.
    fn cards(count: usize, kinds: usize) -> Mesh {
        let (mut positions, mut triangles, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..count {
            let first = positions.len() as u32;
            let at = (i % kinds) as f32 * 0.37;
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                positions.push([u, v, i as f32]);
                uvs.push([u + at, v - at]);
            }
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        Mesh::new(positions, triangles, None, Some(uvs)).unwrap()
    }

    #[test]
    fn triangles_that_share_places_are_as_solid_as_their_texture() {
        let mut rng = Rng::new(5);
        let samples = (0..64 * 64).map(|_| if rng.unit_f32() < 0.5 { 0 } else { 255 }).collect();
        let image = ImageData { width: 64, height: 64, channels: 1, samples: Samples::U8(samples) };
        let bitmap = Bitmap::new(Arc::new(TextureImage::new(image).unwrap()), Decoding::Linear);
        for (kinds, is_shared) in [(1, true), (10, true), (40, false)] {
            let shape = Shape::Mesh(cards(40, kinds));
            let opacity = Opacity::new(std::slice::from_ref(&shape), vec![Some(Texture::Bitmap(bitmap.clone()))]);
            let holes = opacity.by_shape[0].as_ref().unwrap();
            assert_eq!(holes.image.as_ref().unwrap().numbers.is_some(), is_shared, "{kinds}");
            let Shape::Mesh(mesh) = &shape else { panic!("a mesh") };
            let mut decided = 0;
            for i in 0..80 * 100 {
                let (prim, u) = (PrimId(i % 80), 0.5 * rng.unit_f32());
                let hit =
                    Hit { t: 1.0, u, v: 0.5 * rng.unit_f32(), shape: ShapeId(0), prim, instance: Hit::NO_INSTANCE };
                let alpha = opacity.alpha(&shape, &Ray::INACTIVE, &hit);
                let expected = holes.texture.scalar(mesh.uv(prim, hit.u, hit.v));
                // Texture coordinates round differently: by 1e-6 of 64 texels.
                assert!((alpha - expected).abs() < 1e-3, "{kinds}: {hit:?} {alpha} {expected}");
                decided += u32::from(alpha == 0.0 || alpha == 1.0);
            }
            assert!(decided > 500, "{kinds}: {decided}");
        }
    }
}
