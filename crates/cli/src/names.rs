//! Names of enum variants, taken from the types that the scene format is made of, so that the command line and the
//! format cannot differ.

use std::fmt;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use schemars::JsonSchema;
use serde::de::value::{MapDeserializer, StrDeserializer};
use serde::de::{Deserialize, DeserializeOwned, Error, IntoDeserializer};
use serde_json::Value;
use steradian::desc::LayerKind;

/// The names that deserialisation accepts, caught from its complaint about one it does not.
#[derive(Debug)]
struct Names(&'static [&'static str]);

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

impl std::error::Error for Names {}

impl Error for Names {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self(&[])
    }

    fn unknown_variant(_: &str, expected: &'static [&'static str]) -> Self {
        Self(expected)
    }

    fn unknown_field(_: &str, expected: &'static [&'static str]) -> Self {
        Self(expected)
    }
}

fn from_name<T: DeserializeOwned>(name: &str) -> Result<T, Names> {
    let name: StrDeserializer<'_, Names> = name.into_deserializer();
    T::deserialize(name)
}

fn from_type<T: DeserializeOwned>(name: &str) -> Result<T, Names> {
    T::deserialize(MapDeserializer::new([("type", name)].into_iter()))
}

fn names<T>(parse: impl Fn(&str) -> Result<T, Names>) -> &'static [&'static str] {
    parse("?").err().map_or(&[], |Names(names)| names)
}

/// Parses an enum whose variants are plain names.
pub fn plain<T: DeserializeOwned + JsonSchema + Clone + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    described::<T>(names(from_name::<T>)).try_map(|name| from_name::<T>(&name))
}

/// Layers by their names, or all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layers {
    All,
    One(LayerKind),
}

impl Layers {
    pub fn list(self) -> Vec<LayerKind> {
        match self {
            Self::All => names(from_name::<LayerKind>).iter().filter_map(|name| from_name(name).ok()).collect(),
            Self::One(layer) => vec![layer],
        }
    }
}

/// Parses the name of a layer, or `all`.
pub fn layers() -> impl TypedValueParser<Value = Layers> {
    let all = PossibleValue::new("all").help("All of these");
    PossibleValuesParser::new(values::<LayerKind>(names(from_name::<LayerKind>)).into_iter().chain([all]))
        .try_map(|name| if name == "all" { Ok(Layers::All) } else { from_name::<LayerKind>(&name).map(Layers::One) })
}

/// Parses an enum whose variants are objects with a `type`; everything else has its default.
pub fn tagged<T: for<'de> Deserialize<'de> + JsonSchema + Clone + Send + Sync + 'static>()
-> impl TypedValueParser<Value = T> {
    described::<T>(names(from_type::<T>)).try_map(|name| from_type::<T>(&name))
}

fn described<T: JsonSchema>(names: &'static [&'static str]) -> PossibleValuesParser {
    PossibleValuesParser::new(values::<T>(names))
}

/// Values with the first sentence of what the scene format says of each.
fn values<T: JsonSchema>(names: &'static [&'static str]) -> Vec<PossibleValue> {
    let schema = serde_json::to_value(schemars::schema_for!(T)).unwrap_or_default();
    let variants = schema["oneOf"].as_array().cloned().unwrap_or_default();
    let about = |name: &str| {
        let is_named = |variant: &&Value| variant["const"] == name || variant["properties"]["type"]["const"] == name;
        let text = variants.iter().find(is_named)?["description"].as_str()?.replace('\n', " ");
        let end = text.find(". ").map_or(text.len(), |end| end + 1);
        Some(text[..end].trim_end_matches('.').to_owned())
    };
    names.iter().map(|name| PossibleValue::new(*name).help(about(name).unwrap_or_default())).collect()
}

/// A key with its description, and its values with theirs if it has only some.
type DescribedKey = (&'static str, String, Vec<(String, String)>);

/// The keys of `T`, as the scene format describes them in `D`.
pub fn keys<D: JsonSchema, T: DeserializeOwned>() -> Vec<DescribedKey> {
    let schema = serde_json::to_value(schemars::schema_for!(D)).unwrap_or_default();
    let unknown: MapDeserializer<'_, _, Names> = MapDeserializer::new([("?", "")].into_iter());
    let names = T::deserialize(unknown).err().map_or(&[][..], |Names(names)| names);
    let described = |name: &&'static str| {
        let key = &schema["properties"][*name];
        let about = key["description"].as_str().unwrap_or_default().replace('\n', " ");
        let about = about.trim_start_matches("EXR: ").trim_end_matches('.').to_owned();
        // Optional keys have the reference within "anyOf".
        let reference = key["$ref"].as_str().or_else(|| key["anyOf"][0]["$ref"].as_str());
        let variants = reference.and_then(|place| schema.pointer(place.trim_start_matches('#'))?["oneOf"].as_array());
        let text = |value: &Value| value.as_str().unwrap_or_default().trim_end_matches('.').to_owned();
        let variant = |value: &Value| (text(&value["const"]), text(&value["description"]));
        (*name, about, variants.map_or_else(Vec::new, |variants| variants.iter().map(variant).collect()))
    };
    names.iter().map(described).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian::desc::{IntegratorDesc, SamplerKindDesc};
    use steradian::internal::film::LayerInfo;

    #[test]
    fn every_value_has_a_description() {
        let of = |values: Vec<PossibleValue>| values.into_iter().map(|v| v.get_help().unwrap().to_string()).collect();
        let all: Vec<Vec<String>> = vec![
            of(values::<LayerKind>(names(from_name::<LayerKind>))),
            of(values::<SamplerKindDesc>(names(from_name::<SamplerKindDesc>))),
            of(values::<IntegratorDesc>(names(from_type::<IntegratorDesc>))),
        ];
        assert!(all.iter().flatten().all(|help| !help.is_empty()), "{all:?}");
        assert_eq!(all[0][1], "Shading normal in world space; zero where nothing was hit");
    }

    #[test]
    fn keys_have_descriptions_and_values() {
        let keys = keys::<steradian::desc::OutputDesc, steradian::ExrOverrides>();
        let names: Vec<_> = keys.iter().map(|(name, ..)| *name).collect();
        assert_eq!(names[..4], ["profile", "compression", "dwa_level", "uncropped"]);
        assert!(keys.iter().all(|(_, about, values)| {
            !about.is_empty() && values.iter().all(|(value, about)| !value.is_empty() && !about.is_empty())
        }));
        let count: Vec<_> = keys.iter().map(|(.., values)| values.len()).collect();
        assert_eq!(count, [4, 7, 0, 0, 0, 2, 0, 0]);
    }

    #[test]
    fn names_are_those_of_the_scene_format() {
        // All of the film's, but the picture itself and what denoisers add.
        let of_film = LayerInfo::ALL.iter().map(|info| info.name).filter(|name| !["color", "noisy"].contains(name));
        assert_eq!(names(from_name::<LayerKind>), of_film.collect::<Vec<_>>());
        assert_eq!(names(from_name::<SamplerKindDesc>), ["sobol", "independent"]);
        let integrators = names(from_type::<IntegratorDesc>);
        assert_eq!(integrators[..3], ["path", "whitted", "normal"]);
        for name in integrators {
            let value = serde_json::to_value(from_type::<IntegratorDesc>(name).unwrap()).unwrap();
            assert_eq!(value["type"], *name);
        }
        assert_eq!(from_type::<IntegratorDesc>("path").unwrap(), IntegratorDesc::default());
    }
}
