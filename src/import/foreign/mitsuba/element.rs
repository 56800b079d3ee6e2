//! A plugin while it is read: its parameters by name and type, and what became of each.

use super::names;
use super::tree::{Document, Place, Plugin, PluginId, Property, Value};
use crate::error::Result;
use crate::import::foreign::report::PART_OF_IGNORED;
use crate::import::{Draft, Outcome};
use crate::math::DAffine3;

/// A plugin while it is read. Parameters that are read count as mapped unless something else is reported; those never
/// read are ignored.
#[derive(Debug)]
pub(crate) struct Element<'a> {
    /// The plugin.
    pub plugin: &'a Plugin,
    document: &'a Document,
    outcomes: Vec<Option<(Outcome, String)>>,
    /// The outcome of the plugin as a whole.
    notes: Vec<(Outcome, String)>,
}

impl<'a> Element<'a> {
    /// Starts to read a plugin.
    pub fn new(document: &'a Document, id: PluginId) -> Self {
        let plugin = &document.plugins[id.0];
        Self { plugin, document, outcomes: vec![None; plugin.properties.len()], notes: Vec::new() }
    }

    /// The type.
    pub fn kind(&self) -> &'a str {
        &self.plugin.kind
    }

    /// Where it stands.
    pub fn place(&self) -> &'a Place {
        &self.plugin.place
    }

    /// A parameter by name.
    pub fn take(&mut self, name: &str) -> Option<&'a Property> {
        let at = self.plugin.properties.iter().position(|property| property.name == name)?;
        self.outcomes[at].get_or_insert((Outcome::Mapped, String::new()));
        Some(&self.plugin.properties[at])
    }

    /// A number.
    pub fn float(&mut self, name: &str) -> Result<Option<f64>> {
        self.typed(name, "a number", |value| match value {
            Value::Float(v) => Some(*v),
            Value::Integer(v) => Some(*v as f64),
            _ => None,
        })
    }

    /// A whole number.
    pub fn integer(&mut self, name: &str) -> Result<Option<i64>> {
        self.typed(name, "an integer", |value| if let Value::Integer(v) = value { Some(*v) } else { None })
    }

    /// A whole number from `least` to 2^32 - 1.
    pub fn count(&mut self, name: &str, least: u32) -> Result<Option<u32>> {
        let Some(value) = self.integer(name)? else {
            return Ok(None);
        };
        let count = u32::try_from(value).ok().filter(|&count| count >= least);
        count
            .map(Some)
            .ok_or_else(|| self.place_of(name).error(format!("\"{name}\" must be at least {least}, not {value}")))
    }

    /// Whether something is the case.
    pub fn boolean(&mut self, name: &str, default: bool) -> Result<bool> {
        let given =
            self.typed(name, "a boolean", |value| if let Value::Boolean(v) = value { Some(*v) } else { None })?;
        Ok(given.unwrap_or(default))
    }

    /// A text.
    pub fn text(&mut self, name: &str) -> Result<Option<&'a str>> {
        self.typed(name, "a string", |value| if let Value::Text(v) = value { Some(v.as_str()) } else { None })
    }

    /// The name of a file, relative to the scene's folder.
    pub fn file(&mut self, name: &str, scene: &std::path::Path) -> Result<Option<String>> {
        Ok(self.text(name)?.map(|file| self.document.find_file(scene, file)))
    }

    /// A point or vector.
    pub fn vector(&mut self, name: &str) -> Result<Option<[f64; 3]>> {
        self.typed(name, "a point or vector", |value| if let Value::Vector(v) = value { Some(*v) } else { None })
    }

    /// A transform; the identity if it is not given.
    pub fn transform(&mut self, name: &str) -> Result<DAffine3> {
        let given =
            self.typed(name, "a transform", |value| if let Value::Transform(v) = value { Some(*v) } else { None })?;
        Ok(given.unwrap_or(DAffine3::IDENTITY))
    }

    /// An index of refraction, as a number or the name of a material.
    pub fn index(&mut self, name: &str, default: &str) -> Result<f64> {
        match self.take(name).map(|property| (&property.value, &property.place)) {
            None => names::index(default).map_err(|message| self.place().error(message)),
            Some((Value::Float(v), _)) if *v > 0.0 => Ok(*v),
            Some((Value::Integer(v), _)) if *v > 0 => Ok(*v as f64),
            Some((Value::Text(material), place)) => names::index(material).map_err(|message| place.error(message)),
            Some((_, place)) => {
                Err(place.error(format!("\"{name}\" must be a number above 0 or the name of a material")))
            }
        }
    }

    fn typed<T>(&mut self, name: &str, what: &str, read: impl Fn(&'a Value) -> Option<T>) -> Result<Option<T>> {
        let Some(property) = self.take(name) else {
            return Ok(None);
        };
        read(&property.value).map(Some).ok_or_else(|| property.place.error(format!("\"{name}\" must be {what}")))
    }

    /// Where a parameter stands; the plugin, if it does not exist.
    pub fn place_of(&self, name: &str) -> &'a Place {
        self.plugin
            .properties
            .iter()
            .find(|property| property.name == name)
            .map_or(&self.plugin.place, |property| &property.place)
    }

    /// All plugins of a class in or referred to by it, whatever their names, with their places.
    pub fn all(&mut self, class: &str) -> Result<Vec<(PluginId, &'a Place)>> {
        let mut found = Vec::new();
        for (property, outcome) in self.plugin.properties.iter().zip(&mut self.outcomes) {
            if !matches!(property.value, Value::Plugin(_) | Value::Reference(_)) {
                continue;
            }
            if let Some(id) = self.document.plugin_of(property)?
                && self.document.plugins[id.0].class == class
            {
                outcome.get_or_insert((Outcome::Mapped, String::new()));
                found.push((id, &property.place));
            }
        }
        Ok(found)
    }

    /// The only plugin of a class.
    pub fn one(&mut self, class: &str) -> Result<Option<PluginId>> {
        let found = self.all(class)?;
        match found[..] {
            [] => Ok(None),
            [(id, _)] => Ok(Some(id)),
            [_, (_, place), ..] => Err(place.error(format!("a {} has only one {class}", self.plugin.class))),
        }
    }

    /// Reports a parameter, or the plugin as a whole, as mapped, with a note.
    pub fn mapped(&mut self, name: &str, how: impl Into<String>) {
        self.set(name, Outcome::Mapped, how.into());
    }

    /// Reports how a parameter (or, if there is none of that name, the plugin's default) was approximated.
    pub fn approximated(&mut self, name: &str, how: impl Into<String>) {
        self.set(name, Outcome::Approximated, how.into());
    }

    /// Reports why a parameter was ignored.
    pub fn ignored(&mut self, name: &str, why: impl Into<String>) {
        self.set(name, Outcome::Ignored, why.into());
    }

    fn set(&mut self, name: &str, outcome: Outcome, note: String) {
        match self.plugin.properties.iter().position(|property| !name.is_empty() && property.name == name) {
            Some(at) => self.outcomes[at] = Some((outcome, note)),
            None => self.notes.push((outcome, note)),
        }
    }

    /// As [`Self::ignored`], of all nested plugins of a class that have no outcome yet.
    pub fn ignored_other_plugins(&mut self, class: &str, why: &str) -> Result<()> {
        for (property, outcome) in self.plugin.properties.iter().zip(&mut self.outcomes) {
            if let Some(id) = self.document.plugin_of(property)?
                && self.document.plugins[id.0].class == class
            {
                outcome.get_or_insert_with(|| (Outcome::Ignored, why.into()));
            }
        }
        Ok(())
    }

    /// As [`Self::ignored`], of all nested plugins of a class.
    pub fn ignored_plugins(&mut self, class: &str, why: &str) -> Result<()> {
        for (property, outcome) in self.plugin.properties.iter().zip(&mut self.outcomes) {
            if let Some(id) = self.document.plugin_of(property)?
                && self.document.plugins[id.0].class == class
            {
                *outcome = Some((Outcome::Ignored, why.into()));
            }
        }
        Ok(())
    }

    /// Reports what became of the parameters; of the plugin as a whole, too, unless it has any.
    pub fn finish(self, draft: &mut Draft) {
        let title = self.plugin.title();
        let is_ignored = self.notes.iter().any(|(outcome, _)| *outcome == Outcome::Ignored);
        if self.notes.is_empty() && self.plugin.properties.is_empty() {
            draft.mapped(&self.plugin.place.to_string(), &title, "");
        }
        for (outcome, note) in self.notes {
            draft.note(&self.plugin.place.to_string(), &title, "", outcome, note);
        }
        for (property, outcome) in self.plugin.properties.iter().zip(self.outcomes) {
            let place = property.place.to_string();
            let name = match &property.value {
                Value::Plugin(id) if property.name.is_empty() => self.document.plugins[id.0].class.clone(),
                Value::Reference(id) if property.name.is_empty() => format!("ref {id}"),
                _ => property.name.clone(),
            };
            match outcome {
                Some((outcome, note)) => draft.note(&place, &title, &name, outcome, note),
                None if is_ignored => draft.ignored(&place, &title, &name, PART_OF_IGNORED),
                None => {
                    draft.ignored(&place, &title, &name, format!("unsupported parameter of a {}", self.plugin.kind));
                }
            }
        }
    }
}
