//! Short forms: one entry where a list is expected, one number for all entries of a short list. Objects, for which
//! serde would accept lists too.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A list, or its only entry: the schema of [`one_or_more`].
pub struct OneOrMore<T>(PhantomData<T>);

impl<T: JsonSchema> JsonSchema for OneOrMore<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("OneOrMore_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<T>();
        json_schema!({ "anyOf": [{ "type": "array", "items": one }, one] })
    }
}

/// Reads a list, or its only entry.
pub fn one_or_more<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    struct Entries<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a list")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, entries: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(entries))
        }

        fn visit_map<A: MapAccess<'de>>(self, entry: A) -> Result<Self::Value, A::Error> {
            T::deserialize(MapAccessDeserializer::new(entry)).map(|entry| vec![entry])
        }

        fn visit_str<E: Error>(self, entry: &str) -> Result<Self::Value, E> {
            T::deserialize(entry.into_deserializer()).map(|entry| vec![entry])
        }
    }

    deserializer.deserialize_any(Entries(PhantomData))
}

/// `N` numbers, or one for all: a grey, or the same scale along u and v.
pub struct Spread<const N: usize>([f32; N]);

impl<const N: usize> JsonSchema for Spread<N> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Spread_{N}").into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": "number", "format": "float" });
        json_schema!({ "anyOf": [{ "type": "array", "items": number, "minItems": N, "maxItems": N }, number] })
    }
}

impl<'de, const N: usize> Deserialize<'de> for Spread<N>
where
    [f32; N]: Deserialize<'de>,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Numbers<const N: usize>;

        impl<'de, const N: usize> Visitor<'de> for Numbers<N>
        where
            [f32; N]: Deserialize<'de>,
        {
            type Value = [f32; N];

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                match N {
                    3 => f.write_str("a colour: [red, green, blue], or one number for grey"),
                    _ => write!(f, "a list of {N} numbers, or one number for all"),
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, numbers: A) -> Result<Self::Value, A::Error> {
                <[f32; N]>::deserialize(SeqAccessDeserializer::new(numbers))
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
                Ok([number as f32; N])
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                Ok([number as f32; N])
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
                Ok([number as f32; N])
            }
        }

        deserializer.deserialize_any(Numbers).map(Self)
    }
}

/// Reads [`Spread`].
pub fn spread<'de, D: Deserializer<'de>, const N: usize>(deserializer: D) -> Result<[f32; N], D::Error>
where
    [f32; N]: Deserialize<'de>,
{
    Spread::deserialize(deserializer).map(|Spread(numbers)| numbers)
}

/// Reads [`Spread`] for a key that may be absent.
pub fn spread_option<'de, D: Deserializer<'de>, const N: usize>(deserializer: D) -> Result<Option<[f32; N]>, D::Error>
where
    [f32; N]: Deserialize<'de>,
{
    Ok(Option::<Spread<N>>::deserialize(deserializer)?.map(|Spread(numbers)| numbers))
}

/// Reads the keys of an object, in braces alone: serde takes a list for the values of the keys in their order.
pub fn object<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<T, D::Error> {
    struct Keys<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for Keys<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a map")
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map))
        }
    }

    deserializer.deserialize_map(Keys(PhantomData))
}

/// Reads [`object`] for a key that may be absent.
pub fn object_option<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    struct InBraces<T>(T);

    impl<'de, T: Deserialize<'de>> Deserialize<'de> for InBraces<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            object(deserializer).map(Self)
        }
    }

    Ok(Option::<InBraces<T>>::deserialize(deserializer)?.map(|InBraces(object)| object))
}

#[cfg(test)]
mod tests {
    use super::super::SceneDesc;
    use serde_json::{Value, json};

    fn read(scene: Value) -> Value {
        let scene: SceneDesc = serde_json::from_value(scene).unwrap();
        serde_json::to_value(scene).unwrap()
    }

    #[test]
    fn one_entry_is_read_as_a_list_of_one() {
        let mesh = json!({ "type": "mesh", "file": "a.ply", "deform_files": ["b.ply"], "material": "m",
                           "transform": [{ "scale": 2.0 }], "motion": [{ "time": 0.0 }] });
        let short_mesh = json!({ "type": "mesh", "file": "a.ply", "deform_files": "b.ply", "material": "m",
                                 "transform": { "scale": 2 }, "motion": { "time": 0 } });
        let sun = json!({ "type": "directional", "direction": [0, -1, 0], "irradiance": [3, 3, 3] });
        let short_sun = json!({ "type": "directional", "direction": [0, -1, 0], "irradiance": 3 });
        let tree = json!({ "object": "tree", "transform": [{ "translate": [1, 2, 3] }] });
        let short_tree = json!({ "object": "tree", "transform": { "translate": [1, 2, 3] } });
        let long = read(json!({
            "camera": {}, "shapes": [mesh], "lights": [sun], "instances": [tree],
            "objects": { "tree": { "shapes": [mesh], "instances": [tree] } },
            "outputs": [{ "file": "a.exr", "layers": ["albedo"] }]
        }));
        let short = read(json!({
            "camera": {}, "shapes": short_mesh, "lights": short_sun, "instances": short_tree,
            "objects": { "tree": { "shapes": short_mesh, "instances": short_tree } },
            "outputs": { "file": "a.exr", "layers": "albedo" }
        }));
        assert_eq!(long, short);
    }

    #[test]
    fn an_output_may_be_its_file_alone() {
        let outputs = |written: Value| read(json!({ "camera": {}, "outputs": written }))["outputs"].clone();
        let long = outputs(json!([{ "file": "a.exr" }, { "file": "b.png" }]));
        assert_eq!(outputs(json!(["a.exr", { "file": "b.png" }])), long);
        assert_eq!(outputs(json!(["a.exr", "b.png"])), long);
        assert_eq!(outputs(json!("a.exr")), outputs(json!([{ "file": "a.exr" }])));
        for wrong in [json!([7]), json!([["a.exr"]]), json!([{ "layers": ["Z"] }])] {
            assert!(serde_json::from_value::<SceneDesc>(json!({ "camera": {}, "outputs": wrong })).is_err());
        }
    }

    #[test]
    fn one_number_stands_for_all() {
        let with = |grey: Value, scale: Value| {
            read(json!({
                "camera": {},
                "integrator": { "type": "whitted", "ambient": grey },
                "textures": {
                    "c": { "type": "checker", "color0": grey, "color1": grey, "scale": scale },
                    "i": { "type": "image", "file": "i.png", "scale": scale },
                    "k": { "type": "constant", "color": grey }
                },
                "materials": {
                    "m": { "type": "conductor", "eta": grey, "k": grey },
                    "g": { "type": "dielectric", "absorption": { "color": grey } }
                },
                "shapes": [{ "type": "quad", "emission": { "radiance": grey } }],
                "lights": [
                    { "type": "point", "position": [0, 1, 0], "intensity": grey },
                    { "type": "environment", "radiance": grey }
                ]
            }))
        };
        assert_eq!(with(json!(1), json!(2.5)), with(json!([1, 1, 1]), json!([2.5, 2.5])));
        assert_eq!(with(json!(0.5), json!(-1)), with(json!([0.5, 0.5, 0.5]), json!([-1, -1])));
    }
}
