//! Which properties of a PLY element are attributes, by the rules of Mitsuba 3's reader.

use std::collections::BTreeSet;

use ply_rs_bw::ply::{ElementDef, PropertyDef, PropertyType};

use crate::attribute::AttributeValues;

/// Last letters of the properties of one attribute, in their order; the second is for colours.
const ENDINGS: [&str; 4] = ["xyzw", "rgba", "0123", "1234"];

/// Properties that are something else.
const RESERVED: [&str; 20] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "u",
    "v",
    "s",
    "t",
    "texture_u",
    "texture_v",
    "r",
    "g",
    "b",
    "a",
    "red",
    "green",
    "blue",
    "alpha",
];

/// What the properties of an attribute are called while the file is read: no name of a file has this character.
const MARK: &str = "\n";

/// An attribute of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// With what it belongs to: `vertex_NAME` or `face_NAME`.
    pub name: String,
    /// One or three, one behind the other in the file.
    properties: Vec<String>,
}

impl Column {
    /// Nothing yet.
    pub fn values(&self) -> AttributeValues {
        if self.properties.len() == 1 {
            AttributeValues::Numbers(Vec::new())
        } else {
            AttributeValues::Colors(Vec::new())
        }
    }
}

/// The attributes of an element, those in `requested` or (without it) all: consecutive numbers whose names differ in a
/// last letter behind an underscore, one or three of them. Of several with the same name, the first.
pub fn columns(element: &ElementDef, prefix: &str, requested: Option<&BTreeSet<String>>) -> Vec<Column> {
    struct Group<'a> {
        stem: &'a str,
        endings: &'static str,
        properties: Vec<String>,
    }
    let mut groups: Vec<Group> = Vec::new();
    let mut is_open = false;
    for (name, property) in &element.properties {
        let parts = name.rsplit_once('_').filter(|(stem, ending)| !stem.is_empty() && ending.len() == 1);
        let is_number = matches!(property.data_type, PropertyType::Scalar(_)) && !RESERVED.contains(&name.as_str());
        let Some((stem, ending)) = parts.filter(|_| is_number) else {
            is_open = false;
            continue;
        };
        if let Some(group) = groups.last_mut().filter(|group| is_open && group.stem == stem)
            && group.endings.get(group.properties.len()..).is_some_and(|rest| rest.starts_with(ending))
        {
            group.properties.push(name.clone());
            continue;
        }
        let endings = ENDINGS.into_iter().find(|endings| endings.starts_with(ending));
        is_open = endings.is_some() && !groups.iter().any(|group| group.stem == stem);
        if let Some(endings) = endings.filter(|_| is_open) {
            groups.push(Group { stem, endings, properties: vec![name.clone()] });
        }
    }
    let column = |group: Group| {
        let color = if group.endings == ENDINGS[1] { "_color" } else { "" };
        Column { name: format!("{prefix}{}{color}", group.stem), properties: group.properties }
    };
    let mut found: Vec<Column> = Vec::new();
    for column in groups.into_iter().filter(|group| matches!(group.properties.len(), 1 | 3)).map(column) {
        if requested.is_none_or(|requested| requested.contains(&column.name))
            && !found.iter().any(|other| other.name == column.name)
        {
            found.push(column);
        }
    }
    found
}

/// The element with the properties of these attributes marked, for [`is_marked`].
pub fn marked(element: &ElementDef, columns: &[Column]) -> ElementDef {
    let mut element = element.clone();
    if columns.is_empty() {
        return element;
    }
    let marked = |name: String| {
        let is_column = columns.iter().any(|column| column.properties.contains(&name));
        if is_column { format!("{MARK}{name}") } else { name }
    };
    element.properties = std::mem::take(&mut element.properties)
        .into_iter()
        .map(|(name, property)| {
            let name = marked(name);
            (name.clone(), PropertyDef::new(name, property.data_type))
        })
        .collect();
    element
}

/// Whether a property is one of an attribute.
pub fn is_marked(name: &str) -> bool {
    name.starts_with(MARK)
}

/// Adds the numbers of one vertex or face, in the order of the file, to the values of the attributes; those that are
/// missing are 0.
pub fn push(columns: &mut [(Column, AttributeValues)], numbers: &[f32], times: usize) {
    let mut numbers = numbers.iter().copied();
    let mut next = || numbers.next().unwrap_or_default();
    for (_, values) in columns {
        match values {
            AttributeValues::Numbers(values) => values.extend(std::iter::repeat_n(next(), times)),
            AttributeValues::Colors(values) => values.extend(std::iter::repeat_n([next(), next(), next()], times)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ply_rs_bw::ply::ScalarType;

    fn found(names: &[&str]) -> Vec<(String, usize)> {
        let mut element = ElementDef::new("vertex".into());
        for name in names {
            element
                .properties
                .insert((*name).into(), PropertyDef::new((*name).into(), PropertyType::Scalar(ScalarType::Float)));
        }
        columns(&element, "vertex_", None).into_iter().map(|column| (column.name, column.properties.len())).collect()
    }

    /// What Mitsuba 3.9.1 makes of the same properties.
    #[test]
    fn attributes_have_mitsubas_names() {
        let one = |name: &str, channels: usize| vec![(name.to_owned(), channels)];
        assert_eq!(found(&["x", "y", "z", "color_0", "color_1", "color_2"]), one("vertex_color", 3));
        assert_eq!(found(&["color_r", "color_g", "color_b"]), one("vertex_color_color", 3));
        assert_eq!(found(&["foo_bar_x", "foo_bar_y", "foo_bar_z"]), one("vertex_foo_bar", 3));
        assert_eq!(found(&["foo_1", "foo_2", "foo_3"]), one("vertex_foo", 3));
        assert_eq!(found(&["temp_0", "foo", "temp_1"]), one("vertex_temp", 1));
        for none in [
            &["temp"][..],
            &["temp_0", "temp_1"],
            &["a_0", "a_1", "a_2", "a_3"],
            &["r", "g", "b"],
            &["texture_u"],
            &["a_q"],
            &["_0"],
        ] {
            assert_eq!(found(none), [], "{none:?}");
        }
        let two = found(&["a_0", "a_1", "a_2", "b_0", "b_1", "b_2"]);
        assert_eq!(two, [("vertex_a".into(), 3), ("vertex_b".into(), 3)]);
    }
}
