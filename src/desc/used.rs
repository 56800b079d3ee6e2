//! What of a scene is used: what its world shows, and what that refers to.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::Value;

use super::{MeshDesc, SceneDesc, ShapeDesc, TextureDesc};

/// Names of objects, materials, textures and media that the world uses, directly or through others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UsedNames {
    /// Objects with an instance in the world.
    pub objects: BTreeSet<String>,
    /// Materials of shapes that are used, and what these consist of.
    pub materials: BTreeSet<String>,
    /// Textures of those materials and shapes, and of lights.
    pub textures: BTreeSet<String>,
    /// Media of those materials, and what is around everything.
    pub media: BTreeSet<String>,
}

impl SceneDesc {
    /// What the world uses. A word that happens to be a name counts as that name: what is used is never missing here,
    /// and what is missing is never used.
    pub fn used_names(&self) -> UsedNames {
        let mut used = UsedNames::default();
        let mut instances: Vec<_> = self.instances.iter().collect();
        while let Some(instance) = instances.pop() {
            if let Some((name, object)) = self.objects.get_key_value(&instance.object)
                && used.objects.insert(name.clone())
            {
                instances.extend(&object.instances);
            }
        }
        let objects = self.objects.iter().filter(|(name, _)| used.objects.contains(*name));
        let shapes: Vec<&ShapeDesc> =
            self.shapes.iter().chain(objects.flat_map(|(_, object)| &object.shapes)).collect();
        for shape in shapes {
            let common = shape.common();
            common.material.into_iter().for_each(|name| self.use_name(name, &mut used));
            common.emission.into_iter().for_each(|emission| self.use_words(emission, &mut used));
            common.opacity.into_iter().for_each(|opacity| self.use_words(opacity, &mut used));
            if let ShapeDesc::Mesh(MeshDesc { displacement: Some(displacement), .. }) = shape {
                self.use_name(&displacement.texture, &mut used);
            }
        }
        self.lights.iter().for_each(|light| self.use_words(light, &mut used));
        used.media.extend(self.medium.clone());
        used
    }

    /// The attributes of meshes that the textures among these take.
    pub fn attribute_names(&self, used: &UsedNames) -> BTreeSet<String> {
        let name = |texture: &TextureDesc| match texture {
            TextureDesc::VertexColor => Some("vertex_color".to_owned()),
            TextureDesc::MeshAttribute { name, .. } => Some(name.clone()),
            _ => None,
        };
        self.textures
            .iter()
            .filter(|(name, _)| used.textures.contains(*name))
            .filter_map(|(_, texture)| name(texture))
            .collect()
    }

    /// Adds what a word names, and what that refers to.
    fn use_name(&self, word: &str, used: &mut UsedNames) {
        if let Some(material) = self.materials.get(word)
            && used.materials.insert(word.to_owned())
        {
            self.use_words(material, used);
        }
        if self.media.contains_key(word) {
            used.media.insert(word.to_owned());
        }
        if let Some(texture) = self.textures.get(word)
            && used.textures.insert(word.to_owned())
        {
            self.use_words(texture, used);
        }
    }

    /// Adds what the words of a description name.
    fn use_words(&self, desc: &impl Serialize, used: &mut UsedNames) {
        let mut open = vec![serde_json::to_value(desc).unwrap_or_default()];
        while let Some(value) = open.pop() {
            match value {
                Value::String(word) => self.use_name(&word, used),
                Value::Array(values) => open.extend(values),
                // A type is no name.
                Value::Object(keys) => {
                    open.extend(keys.into_iter().filter(|(key, _)| key != "type").map(|(_, value)| value));
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_world_shows_is_used() {
        let desc: SceneDesc = serde_json::from_str(
            r#"{ "camera": {},
            "textures": {
                "a": { "type": "constant", "color": [0, 0, 0] },
                "b": { "type": "product", "factors": [{ "texture": "c" }] },
                "c": { "type": "checker" }, "d": { "type": "checker" }, "e": { "type": "checker" },
                "f": { "type": "checker" },
                "g": { "type": "checker" }, "h": { "type": "checker" },
                "diffuse": { "type": "checker" }
            },
            "materials": {
                "top": { "type": "mix", "materials": ["x", "y"], "amount": { "texture": "a" } },
                "x": { "type": "diffuse", "albedo": { "texture": "b" } }, "y": { "type": "plastic" },
                "z": { "type": "diffuse", "albedo": { "texture": "d" } }
            },
            "lights": [{ "type": "spot", "position": [0, 0, 0], "look_at": [0, 0, 1], "intensity": [1, 1, 1],
            "texture": "g" }],
            "shapes": [{ "type": "quad", "emission": { "radiance": [1, 1, 1], "texture": "e" } },
                { "type": "mesh", "displacement": { "texture": "h" } }],
            "objects": {
                "outer": { "instances": [{ "object": "inner" }] },
                "inner": { "shapes": [{ "type": "sphere", "material": "top", "opacity": { "texture": "f" } }] },
                "idle": { "shapes": [{ "type": "sphere", "material": "z" }], "instances": [{ "object": "idle" }] }
            },
            "instances": [{ "object": "outer" }, { "object": "none" }] }"#,
        )
        .unwrap();
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let expected = UsedNames {
            objects: names(&["inner", "outer"]),
            materials: names(&["top", "x", "y"]),
            textures: names(&["a", "b", "c", "e", "f", "g", "h"]),
            media: BTreeSet::new(),
        };
        assert_eq!(desc.used_names(), expected);
    }
}
