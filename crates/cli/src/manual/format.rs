//! The manual of the scene format, from its JSON Schema.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde_json::{Map, Value};

use super::words::{Types, kind, title_of};
use super::{Page, cell};

/// The pages: file, title and types. What only one page needs is described there, all else on the page of values.
const PAGES: [(&str, &str, &[&str]); 8] = [
    ("shapes", "Shapes", &["ShapeDesc", "ObjectDesc", "InstanceDesc"]),
    ("materials", "Materials", &["MaterialDesc"]),
    ("lights", "Lights", &["LightDesc"]),
    ("cameras", "Cameras", &["CameraDesc"]),
    ("textures", "Textures", &["TextureDesc"]),
    ("media", "Media", &["MediumDesc"]),
    ("settings", "Film, sampler and integrator", &["FilmDesc", "SamplerDesc", "IntegratorDesc"]),
    ("outputs", "Outputs", &["OutputDesc"]),
];
const VALUES: &str = "values";
/// Types with a picture, of each variant if there are variants, and the first word of its file's name.
const PICTURES: [(&str, &str); 4] = [
    ("ShapeDesc", "shape"),
    ("MaterialDesc", "material"),
    ("SubdivisionDesc", "subdivision"),
    ("DisplacementDesc", "displacement"),
];
/// Examples: `# TYPE VARIANT`, or `# TYPE`, and the lines below. They are what the pictures show.
const EXAMPLES: &str = include_str!("examples.txt");

const INTRODUCTION: &str = "\
A scene is a JSON file. `//` and `/* */` comments are allowed, and commas behind the last entry; a list of one entry may
be the entry alone. Unknown keys are errors. The world is right-handed, angles are in degrees, colours are linear
Rec.709 and paths are relative to the scene file.";

/// All pages, of the schema.
pub fn pages(schema: &Value) -> Vec<Page> {
    let none = Map::new();
    let definitions = schema["$defs"].as_object().unwrap_or(&none);
    let types = Types { definitions, homes: homes(definitions) };
    let scene = format!(
        "# The scene file\n\n{}\n\n{INTRODUCTION}\n\n{}",
        schema["description"].as_str().unwrap_or_default(),
        table(&types, schema, &BTreeSet::new(), "scene"),
    );
    let mut pages = vec![page("scene", scene)];
    for (file, title, roots) in PAGES {
        let helpers =
            definitions.keys().filter(|name| types.homes[name.as_str()] == file && !roots.contains(&name.as_str()));
        let sections = roots.iter().copied().chain(helpers.map(String::as_str)).map(|name| section(&types, name, file));
        pages.push(page(file, format!("# {title}\n\n{}", sections.collect::<String>())));
    }
    let values = definitions.keys().filter(|name| types.homes[name.as_str()] == VALUES);
    let sections: String = values.map(|name| section(&types, name, VALUES)).collect();
    pages.push(page(VALUES, format!("# Values\n\nTypes of values that several pages use.\n\n{sections}")));
    pages
}

fn page(name: &str, text: String) -> Page {
    let note = "<!-- Written by `steradian schema --markdown`. -->\n";
    Page { name: format!("{name}.md"), text: format!("{note}\n{}\n", text.trim_end()) }
}

/// The page of each type.
fn homes(definitions: &Map<String, Value>) -> BTreeMap<&str, &'static str> {
    let mut homes: BTreeMap<&str, &'static str> = BTreeMap::new();
    for (file, _, roots) in PAGES {
        let mut reached = BTreeSet::new();
        roots.iter().for_each(|root| reach(definitions, root, &mut reached));
        for name in reached {
            homes.entry(name).and_modify(|home| *home = VALUES).or_insert(file);
        }
    }
    for name in definitions.keys() {
        homes.entry(name).or_insert(VALUES);
    }
    homes
}

/// Adds a type and those that it refers to.
fn reach<'a>(definitions: &'a Map<String, Value>, name: &str, reached: &mut BTreeSet<&'a str>) {
    if let Some((name, definition)) = definitions.get_key_value(name)
        && reached.insert(name)
    {
        references(definition, &mut |reference| reach(definitions, reference, reached));
    }
}

fn references(value: &Value, add: &mut dyn FnMut(&str)) {
    match value {
        Value::Object(map) => {
            if let Some(reference) = map.get("$ref").and_then(Value::as_str) {
                add(reference.rsplit('/').next().unwrap_or(reference));
            }
            map.values().for_each(|value| references(value, add));
        }
        Value::Array(values) => values.iter().for_each(|value| references(value, add)),
        _ => {}
    }
}

/// The description of a type.
fn section(types: &Types, name: &str, page: &str) -> String {
    let definition = &types.definitions[name];
    let mut text = format!("## {}\n\n{}", title_of(name), paragraphs(definition));
    if let Some(variants) = definition["oneOf"].as_array().filter(|variants| variants.iter().all(|v| tag(v).is_some()))
    {
        let shared = shared_keys(variants);
        if let Some(first) = variants.first().filter(|_| !shared.is_empty()) {
            let all = |key: &str| shared.contains(key);
            let _ = write!(text, "Keys of all of them:\n\n{}", rows(types, first, all, page));
        }
        for variant in variants {
            text.push_str(&variant_section(types, name, variant, &shared, page));
        }
    } else if let Some(choices) = definition["oneOf"].as_array().or_else(|| definition["anyOf"].as_array()) {
        for choice in choices {
            let _ = writeln!(text, "- {}{}", types.words("", choice, page), choice_meaning(choice));
        }
        text.push('\n');
    } else {
        text.push_str(&picture(name, ""));
        text.push_str(&table(types, definition, &BTreeSet::new(), page));
    }
    text + &example(name, "")
}

/// The description of one value of the key `type`.
fn variant_section(types: &Types, name: &str, variant: &Value, shared: &BTreeSet<&str>, page: &str) -> String {
    let tag = tag(variant).unwrap_or_default();
    let text = format!("### `{tag}`\n\n{}{}", paragraphs(variant), picture(name, tag));
    text + &table(types, variant, shared, page) + &example(name, tag)
}

/// The picture of a type's variant, or of a type without variants; empty if it has none.
fn picture(name: &str, tag: &str) -> String {
    let Some((_, kind)) = PICTURES.iter().find(|(pictured, _)| *pictured == name) else { return String::new() };
    let words = [title_of(name), tag.to_owned()].join(" ");
    let file = [*kind, tag].join("_");
    format!("![{}](../pictures/{}.jpg)\n\n", words.trim_end(), file.trim_end_matches('_'))
}

/// The value of the key `type`.
fn tag(variant: &Value) -> Option<&str> {
    variant["properties"]["type"]["const"].as_str()
}

/// Keys that several variants have alike.
fn shared_keys(variants: &[Value]) -> BTreeSet<&str> {
    let (Some(first), true) = (variants.first(), variants.len() > 1) else { return BTreeSet::new() };
    let keys = first["properties"].as_object().into_iter().flatten();
    let is_shared = |(key, value): &(&String, &Value)| {
        *key != "type" && variants.iter().all(|variant| variant["properties"][key.as_str()] == **value)
    };
    keys.filter(is_shared).map(|(key, _)| key.as_str()).collect()
}

/// The table of an object's keys, those of `without` and `type` left out.
fn table(types: &Types, object: &Value, without: &BTreeSet<&str>, page: &str) -> String {
    rows(types, object, |key| !without.contains(key), page)
}

fn rows(types: &Types, object: &Value, shows: impl Fn(&str) -> bool, page: &str) -> String {
    let required: Vec<&str> = object["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let keys = object["properties"].as_object().into_iter().flatten();
    let mut keys: Vec<_> = keys.filter(|(key, value)| value["const"].is_null() && shows(key)).collect();
    keys.sort_by_key(|(key, _)| !required.contains(&key.as_str()));
    if keys.is_empty() {
        return String::new();
    }
    let mut text = "| name | type | default | meaning |\n|---|---|---|---|\n".to_owned();
    for (key, value) in keys {
        let description = value["description"].as_str().unwrap_or_default();
        let (meaning, stated) = without_default(&cell(description));
        let default = match stated {
            _ if required.contains(&key.as_str()) => "required".to_owned(),
            Some(stated) => stated,
            None => default_of(value),
        };
        let _ = writeln!(text, "| `{key}` | {} | {default} | {meaning} |", cell(&types.words(key, value, page)));
    }
    text + "\n"
}

/// A meaning and the default at its end: "Radius. Default: 1." is "Radius." and "1".
fn without_default(meaning: &str) -> (String, Option<String>) {
    let Some((before, after)) = meaning.split_once("Default: ") else { return (meaning.to_owned(), None) };
    let (default, rest) = after.split_once(". ").unwrap_or((after.trim_end_matches('.'), ""));
    (format!("{before}{rest}").trim_end().to_owned(), Some(default.to_owned()))
}

/// The default of the schema.
fn default_of(value: &Value) -> String {
    match &value["default"] {
        Value::Null if kind(value) == "boolean" => "false".to_owned(),
        Value::Null => "-".to_owned(),
        Value::Object(_) => "see there".to_owned(),
        default => plain(default),
    }
}

/// A value as it would be written: numbers of 32 bits without the digits of 64.
fn plain(value: &Value) -> String {
    match value {
        #[expect(clippy::cast_possible_truncation, reason = "the nearest number of 32 bits is meant")]
        Value::Number(number) => {
            number.as_f64().map_or_else(|| number.to_string(), |number| (number as f32).to_string())
        }
        Value::Array(values) => format!("[{}]", values.iter().map(plain).collect::<Vec<_>>().join(", ")),
        Value::String(text) => format!("`{text}`"),
        _ => value.to_string(),
    }
}

/// A description's paragraphs.
fn paragraphs(value: &Value) -> String {
    value["description"].as_str().map_or_else(String::new, |text| format!("{}\n\n", text.trim()))
}

/// What one of several forms of a value means, with its keys.
fn choice_meaning(choice: &Value) -> String {
    let mut text = choice["description"].as_str().map_or_else(String::new, |text| format!(": {}", cell(text)));
    key_meanings(choice, &mut text);
    text
}

fn key_meanings(object: &Value, text: &mut String) {
    for (key, value) in object["properties"].as_object().into_iter().flatten() {
        if let Some(meaning) = value["description"].as_str() {
            let _ = write!(text, " `{key}`: {}", cell(meaning));
        }
        key_meanings(value, text);
    }
}

/// The example of a type or a variant of it.
fn example(name: &str, tag: &str) -> String {
    let title = format!("{name} {tag}");
    let blocks = EXAMPLES.split("\n# ").filter_map(|block| block.split_once('\n'));
    let found = blocks.map(|(head, body)| (head.trim(), body.trim())).find(|(head, _)| *head == title.trim());
    found.map_or_else(String::new, |(_, body)| format!("```json\n{body}\n```\n\n"))
}

#[cfg(test)]
mod tests {
    use super::super::words::name_of;
    use super::*;

    #[test]
    fn defaults_stand_in_their_column() {
        assert_eq!(without_default("Radius. Default: 1.5."), ("Radius.".to_owned(), Some("1.5".to_owned())));
        let (meaning, default) = without_default("Share. Default: 1, or that of an MTL. Not with `emission`.");
        assert_eq!(
            (meaning.as_str(), default.as_deref()),
            ("Share. Not with `emission`.", Some("1, or that of an MTL"))
        );
        assert_eq!(default_of(&serde_json::json!({ "default": [0.400_000_005_960_464_5, 1.0] })), "[0.4, 1]");
    }

    #[test]
    fn types_have_names_of_the_field() {
        assert_eq!([name_of("ColorDesc"), name_of("NormalMapDesc")], ["colour", "normal map"]);
        assert_eq!(title_of("ColorSpaceDesc"), "Colour space");
    }

    #[test]
    fn every_type_of_the_lists_has_an_example() {
        let schema: Value = serde_json::from_str(&steradian::internal::import::schema()).unwrap();
        for name in ["ShapeDesc", "MaterialDesc", "LightDesc", "TextureDesc"] {
            for tag in schema["$defs"][name]["oneOf"].as_array().unwrap().iter().filter_map(tag) {
                assert_ne!(example(name, tag), "", "{name} {tag}");
            }
        }
    }
}
