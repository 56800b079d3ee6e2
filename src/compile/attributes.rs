//! Attributes of meshes: which a surface takes, and whether its mesh has them.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::materials::MaterialTable;
use super::prepared::{PreparedEmission, PreparedSurface};
use super::{Builder, meshes};
use crate::attribute::{Attribute, AttributeValues, is_of_faces};
use crate::color::Rgb;
use crate::error::{Error, Result};
use crate::id::{AttributeId, TextureId};

/// An attribute that a surface takes.
struct Taken {
    /// What takes it, for messages.
    by: String,
    id: AttributeId,
    /// Factor on the values, and what they must not exceed with it.
    scale: f32,
    largest: f32,
}

impl MaterialTable {
    /// What textures of a surface take. `material` is what the scene calls its material.
    fn taken(&self, surface: &PreparedSurface, material: Option<&str>) -> Vec<Taken> {
        let PreparedSurface { binding, emission, .. } = surface;
        let of = |id: TextureId, by: &str, largest: f32| {
            let taken = move |(id, scale)| Taken { by: by.to_owned(), id, scale, largest };
            self.textures.get(id).attributes().into_iter().map(taken).collect::<Vec<_>>()
        };
        let found = RefCell::new(Vec::new());
        let by = format!("the material \"{}\"", material.unwrap_or_default());
        self.any_part(binding.material, &|id| {
            let textures = self.materials[id.index()].textures();
            found.borrow_mut().extend(textures.into_iter().flat_map(|texture| of(texture, &by, 1.0)));
            false
        });
        let mut found = found.into_inner();
        found.extend(binding.opacity.into_iter().flat_map(|id| of(id, "the opacity", 1.0)));
        // Products with the radiance stay finite.
        let largest = |radiance: Rgb| f32::MAX / radiance.max_channel().max(1.0);
        found.extend(emission.iter().flat_map(|PreparedEmission { emission, .. }| {
            emission.texture.map_or(Vec::new(), |id| of(id, "the emission", largest(emission.radiance)))
        }));
        found
    }
}

impl Builder {
    /// Rejects a surface that takes attributes which its shape does not have, or with values that make no sense; drops
    /// those that it does not take.
    pub(super) fn check_attributes(
        &self,
        path: &str,
        file: Option<&str>,
        surface: &PreparedSurface,
        material: Option<&str>,
        given: Option<&mut BTreeMap<String, AttributeValues>>,
    ) -> Result<()> {
        let taken = self.materials.taken(surface, material);
        let names = &self.materials.textures.attributes;
        let refuse = |message: String| -> Error { meshes::refusal(&self.files, path, file, message) };
        let mut nothing = BTreeMap::new();
        let given = given.unwrap_or(&mut nothing);
        for Taken { by, id, scale, largest } in &taken {
            let name = &names[id.index()];
            let values = given
                .get(name)
                .ok_or_else(|| refuse(format!("{by} takes the attribute \"{name}\": the shape has none")))?;
            let is_good = |value: &f32| (0.0..=*largest).contains(&(value * scale));
            if let Some(bad) = values.numbers().iter().position(|value| !is_good(value)) {
                let i = bad / values.channels();
                let value = match values {
                    AttributeValues::Numbers(values) => format!("{:?}", values[i]),
                    AttributeValues::Colors(values) => format!("{:?}", values[i]),
                };
                let owner = if is_of_faces(name) == Some(true) { "triangle" } else { "vertex" };
                let times = if *scale == 1.0 { String::new() } else { format!(" times {scale}") };
                let range = if *largest == 1.0 { "within 0 and 1" } else { "finite and not below 0" };
                return Err(refuse(format!(
                    "the attribute \"{name}\" of {owner} {i} is {value}{times}, but must be {range} for {by}"
                )));
            }
        }
        given.retain(|name, _| taken.iter().any(|taken| names[taken.id.index()] == *name));
        Ok(())
    }
}

/// Rejects attributes with more or fewer values than vertices or triangles.
pub fn check_counts(
    attributes: &BTreeMap<String, AttributeValues>,
    vertices: usize,
    triangles: usize,
) -> std::result::Result<(), String> {
    for (name, values) in attributes {
        let (count, what) =
            if is_of_faces(name) == Some(true) { (triangles, "triangles") } else { (vertices, "vertices") };
        if values.len() != count {
            return Err(format!("the attribute \"{name}\": {} for {count} {what}", values.len()));
        }
    }
    Ok(())
}

/// The attributes of a mesh by id, in a mesh with these vertices and triangles of the given one (`None` for all).
pub fn placed(
    attributes: BTreeMap<String, AttributeValues>,
    names: &[String],
    vertices: Option<&[u32]>,
    triangles: Option<&[u32]>,
) -> Vec<Attribute> {
    let place = |(name, values): (String, AttributeValues)| {
        let id = AttributeId::new(names.iter().position(|known| *known == name)?);
        let of_faces = is_of_faces(&name) == Some(true);
        let kept = if of_faces { triangles } else { vertices };
        let values = match kept {
            Some(kept) => values.gathered(kept.iter().copied()),
            None => values,
        };
        Some(Attribute { id, of_faces, values })
    };
    attributes.into_iter().filter_map(place).collect()
}
