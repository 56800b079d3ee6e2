//! XML to the tree of plugins: defaults, `$name`, includes, ids and aliases are resolved here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use roxmltree::{Document as Xml, Node, ParsingOptions};

use super::names;
use super::transforms;
use super::tree::{Document, Place, Plugin, PluginId, Property, Spectrum, Value};
use super::values::{self, Fault};
use crate::error::{Error, Result};
use crate::suggestion::did_you_mean;

/// Plugins nested deeper than this are a mistake.
const MAX_DEPTH: usize = 100;

/// Files that include each other deeper than this are a mistake.
const MAX_INCLUDES: usize = 16;

/// Files that a scene includes, each as often as it is included, are at most this many.
const MAX_FILES: usize = 1000;

/// Attributes of an element; the XML parser's time grows with the square of their number.
const MAX_ATTRIBUTES: usize = 100;

/// Tags of plugins.
const CLASSES: [&str; 13] = [
    "scene",
    "integrator",
    "sensor",
    "film",
    "sampler",
    "rfilter",
    "bsdf",
    "emitter",
    "shape",
    "texture",
    "volume",
    "medium",
    "phase",
];

/// Tags of parameters and of what is not a plugin.
const OTHERS: [&str; 14] = [
    "default",
    "alias",
    "include",
    "path",
    "ref",
    "float",
    "integer",
    "boolean",
    "string",
    "vector",
    "point",
    "rgb",
    "spectrum",
    "transform",
];

/// What `$name` makes of an attribute is not longer than this.
const MAX_TEXT: usize = 1 << 17;

/// Reads a scene file and what it includes. `defines` replace defaults.
///
/// # Errors
/// [`Error::Missing`] if a file cannot be read, [`Error::Parse`] for faults in it, [`Error::Usage`] for a define that
/// nothing uses.
pub fn read(path: &Path, defines: &[(String, String)]) -> Result<Document> {
    let mut parser = Parser {
        scene: path.into(),
        document: Document::default(),
        parameters: BTreeMap::new(),
        used: defines.iter().map(|(name, _)| (name.clone(), false)).collect(),
        files: 0,
        opened: 0,
    };
    parser.parameters.extend(defines.iter().cloned());
    let mut root = parser.file(path)?;
    root.id.clear();
    parser.document.plugins.push(root);
    if let Some((name, _)) = parser.used.iter().find(|(_, used)| !**used) {
        let known = parser.parameters.keys().map(String::as_str).filter(|known| known != name);
        let hint = did_you_mean(name, known, ["\"", "\""]);
        return Err(Error::Usage(format!("{}: nothing uses ${name}{hint}", path.display())));
    }
    Ok(parser.document)
}

struct Parser {
    scene: PathBuf,
    document: Document,
    /// Values of `$name`.
    parameters: BTreeMap<String, String>,
    /// Which of the user's values were used.
    used: BTreeMap<String, bool>,
    /// Files that are open.
    files: usize,
    /// Files that have been opened.
    opened: usize,
}

/// The line where a tag begins that has more than [`MAX_ATTRIBUTES`] equals signs outside of quotes, if there is one.
fn crowded_line(text: &str) -> Option<usize> {
    let mut line = 1;
    let mut rest = text;
    while let Some(open) = rest.find('<') {
        line += rest[..open].bytes().filter(|&b| b == b'\n').count();
        rest = &rest[open..];
        // Comments and CDATA sections have no attributes.
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>")].into_iter().find(|(start, _)| rest.starts_with(start));
        let length = match skipped {
            Some((_, end)) => rest.find(end).map_or(rest.len(), |at| at + end.len()),
            None => {
                let (mut quote, mut attributes, mut length) = (None, 0, rest.len());
                for (i, b) in rest.bytes().enumerate() {
                    match (quote, b) {
                        (Some(open), b) if b == open => quote = None,
                        (None, b'"' | b'\'') => quote = Some(b),
                        (None, b'=') => attributes += 1,
                        (None, b'>') => {
                            length = i + 1;
                            break;
                        }
                        _ => {}
                    }
                }
                if attributes > MAX_ATTRIBUTES {
                    return Some(line);
                }
                length
            }
        };
        line += rest[..length].bytes().filter(|&b| b == b'\n').count();
        rest = &rest[length..];
    }
    None
}

/// An XML file with the starts of its lines.
struct XmlFile {
    path: Rc<Path>,
    lines: Vec<usize>,
    /// Whether names are those of Mitsuba 0.6, such as `toWorld`.
    camel_case: bool,
}

impl XmlFile {
    fn place(&self, node: Node) -> Place {
        let offset = node.range().start;
        let line = self.lines.partition_point(|&start| start <= offset).max(1);
        Place { file: Rc::clone(&self.path), line, column: offset - self.lines.get(line - 1).copied().unwrap_or(0) + 1 }
    }

    /// A name of this file as Mitsuba 3 has it.
    fn name(&self, name: String) -> String {
        if !self.camel_case {
            return name;
        }
        let snake = name.chars().flat_map(|c| [c.is_ascii_uppercase().then_some('_'), Some(c.to_ascii_lowercase())]);
        snake.flatten().collect()
    }
}

impl Parser {
    /// The scene of a file.
    fn file(&mut self, path: &Path) -> Result<Plugin> {
        let read = if self.files == 0 { crate::file::read_stream } else { crate::file::read };
        let bytes = read(path).map_err(|e| Error::Missing { file: path.into(), message: e.to_string() })?;
        self.document.files.push(path.to_owned());
        let file: Rc<Path> = path.into();
        let text = String::from_utf8(bytes).map_err(|e| {
            let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|&&b| b == b'\n').count();
            let column = 1 + valid.iter().rev().take_while(|&&b| b != b'\n').count();
            Place { file: Rc::clone(&file), line, column }.error("the file is not UTF-8")
        })?;
        // An element of Mitsuba's takes more than ten characters; memory follows the number of elements.
        let nodes_limit = u32::try_from(100 + text.len() / 6).unwrap_or(u32::MAX);
        if let Some(line) = crowded_line(&text) {
            let message = format!("an element has more than {MAX_ATTRIBUTES} attributes");
            return Err(Place { file: Rc::clone(&file), line, column: 1 }.error(message));
        }
        let options = ParsingOptions { nodes_limit, ..ParsingOptions::default() };
        let xml = Xml::parse_with_options(text.trim_start_matches('\u{feff}'), options).map_err(|e| {
            let at = e.pos();
            Place { file: Rc::clone(&file), line: at.row as usize, column: at.col as usize }
                .error(format!("not valid XML: {e}"))
        })?;
        let starts = xml.input_text().bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1);
        let lines = std::iter::once(0).chain(starts).collect();
        let root = xml.root_element();
        let version = root.attribute("version").unwrap_or("3.0.0");
        let camel_case =
            version.split('.').next().is_some_and(|major| matches!(major.trim().parse::<u32>(), Ok(0 | 1)));
        let source = XmlFile { path: file, lines, camel_case };
        if root.tag_name().name() != "scene" {
            return Err(source.place(root).error(format!("expected <scene>, found <{}>", root.tag_name().name())));
        }
        self.files += 1;
        if self.files > MAX_INCLUDES {
            return Err(source.place(root).error(format!("files include each other more than {MAX_INCLUDES} deep")));
        }
        self.opened += 1;
        if self.opened > MAX_FILES {
            return Err(source.place(root).error(format!("the scene includes files more than {MAX_FILES} times")));
        }
        let scene = self.plugin(&source, root, "scene".into(), 0)?;
        self.files -= 1;
        Ok(scene)
    }

    /// An attribute with `$name` replaced.
    fn attribute(&mut self, source: &XmlFile, node: Node, name: &str) -> Result<Option<String>> {
        node.attribute(name).map(|text| self.substitute(source, node, text)).transpose()
    }

    fn needed(&mut self, source: &XmlFile, node: Node, name: &str) -> Result<String> {
        let missing =
            || source.place(node).error(format!("<{}> needs the attribute \"{name}\"", node.tag_name().name()));
        self.attribute(source, node, name)?.ok_or_else(missing)
    }

    fn substitute(&mut self, source: &XmlFile, node: Node, text: &str) -> Result<String> {
        let mut result = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            result.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            let name = &rest[..end];
            // A name may be followed by more text: the longest one that is known counts.
            let ends = name.char_indices().map(|(i, c)| i + c.len_utf8()).rev();
            let found = ends.into_iter().find_map(|end| self.parameters.get_key_value(&name[..end]));
            let Some((known, value)) = found else {
                let hint = did_you_mean(name, self.parameters.keys().map(String::as_str), ["$", ""]);
                return Err(source.place(node).error(format!("${name} has no value{hint}")));
            };
            result.push_str(value);
            if result.len() > MAX_TEXT {
                return Err(source.place(node).error("the values of $names are too long"));
            }
            if let Some(used) = self.used.get_mut(known) {
                *used = true;
            }
            rest = &rest[known.len()..];
        }
        result.push_str(rest);
        Ok(result)
    }

    /// A plugin and what it contains; contained ones are added to the document.
    fn plugin(&mut self, source: &XmlFile, node: Node, kind: String, depth: usize) -> Result<Plugin> {
        let place = source.place(node);
        if depth > MAX_DEPTH {
            return Err(place.error(format!("elements are nested more than {MAX_DEPTH} deep")));
        }
        let class = node.tag_name().name();
        let id = self.attribute(source, node, "id")?.unwrap_or_default();
        let mut properties = Vec::new();
        for child in node.children() {
            if child.is_text() && child.text().is_some_and(|text| !text.trim().is_empty()) {
                return Err(source.place(child).error("text outside of elements"));
            }
            if child.is_element() {
                self.child(source, child, class, &mut properties, depth + 1)?;
            }
        }
        // The scene's names are those of plugins, which nothing uses.
        let mut names = BTreeSet::new();
        let mut named = properties.iter().filter(|property| class != "scene" && !property.name.is_empty());
        if let Some(property) = named.find(|property| !names.insert(property.name.as_str())) {
            return Err(property.place.error(format!("the parameter \"{}\" is given twice", property.name)));
        }
        Ok(Plugin { class: class.into(), kind, id, place, properties })
    }

    fn child(
        &mut self,
        source: &XmlFile,
        node: Node,
        outer: &str,
        properties: &mut Vec<Property>,
        depth: usize,
    ) -> Result<()> {
        let tag = node.tag_name().name();
        let place = source.place(node);
        match tag {
            "default" | "alias" | "include" | "path" if outer != "scene" => {
                return Err(place.error(format!("<{tag}> can only stand in <scene>")));
            }
            "default" => {
                let name = self.needed(source, node, "name")?;
                let value = self.needed(source, node, "value")?;
                self.parameters.entry(name).or_insert(value);
                return Ok(());
            }
            "alias" => {
                let (id, name) = (self.needed(source, node, "id")?, self.needed(source, node, "as")?);
                let target = self.document.aliases.get(&id).cloned().unwrap_or(id);
                self.document.aliases.insert(name, target);
                return Ok(());
            }
            "path" => {
                let folder = self.needed(source, node, "value")?;
                self.document.folders.push(folder.into());
                return Ok(());
            }
            "include" => return self.include(source, node, properties),
            _ => {}
        }
        let name = self.attribute(source, node, "name")?.map(|name| source.name(name)).unwrap_or_default();
        let Some(value) = self.value(source, node)? else {
            if tag == "spectrum" || CLASSES.contains(&tag) && tag != "scene" {
                return self.nested(source, node, name, properties, depth);
            }
            let hint = did_you_mean(tag, CLASSES.into_iter().chain(OTHERS), ["<", ">"]);
            return Err(place.error(format!("unknown element <{tag}>{hint}")));
        };
        if name.is_empty() && !matches!(value, Value::Reference(_)) {
            return Err(place.error(format!("<{tag}> needs the attribute \"name\"")));
        }
        properties.push(Property { name, value, place });
        Ok(())
    }

    /// The value of a property; `None` for other elements.
    fn value(&mut self, source: &XmlFile, node: Node) -> Result<Option<Value>> {
        let place = source.place(node);
        let fault = |message: Fault| place.error(message);
        Ok(Some(match node.tag_name().name() {
            "ref" => Value::Reference(self.needed(source, node, "id")?),
            "transform" => {
                let mut read = |node: Node, name: &str| self.attribute(source, node, name);
                Value::Transform(transforms::compose(node, &mut read, &|node, message| {
                    source.place(node).error(message)
                })?)
            }
            "vector" | "point" => Value::Vector(self.vector(source, node)?),
            "spectrum" if node.attribute("value").is_some() => {
                let text = self.needed(source, node, "value")?;
                let is_list = text.contains(':');
                Value::Spectrum(if is_list {
                    Spectrum::Samples(values::samples(&text).map_err(fault)?)
                } else {
                    Spectrum::Uniform(values::number(&text).map_err(fault)?)
                })
            }
            "spectrum" if node.attribute("filename").is_some() => {
                Value::Spectrum(Spectrum::File(self.needed(source, node, "filename")?))
            }
            "float" => Value::Float(values::number(&self.needed(source, node, "value")?).map_err(fault)?),
            "integer" => Value::Integer(values::integer(&self.needed(source, node, "value")?).map_err(fault)?),
            "boolean" => Value::Boolean(values::boolean(&self.needed(source, node, "value")?).map_err(fault)?),
            "string" => Value::Text(self.needed(source, node, "value")?),
            "rgb" => Value::Rgb(values::rgb(&self.needed(source, node, "value")?).map_err(fault)?),
            _ => return Ok(None),
        }))
    }

    /// A plugin in a plugin.
    fn nested(
        &mut self,
        source: &XmlFile,
        node: Node,
        name: String,
        properties: &mut Vec<Property>,
        depth: usize,
    ) -> Result<()> {
        let place = source.place(node);
        let kind = self.needed(source, node, "type")?;
        names::check(node.tag_name().name(), &kind).map_err(|message| place.error(message))?;
        let plugin = self.plugin(source, node, kind, depth)?;
        let id = PluginId(self.document.plugins.len());
        if !plugin.id.is_empty() && self.document.ids.insert(plugin.id.clone(), id).is_some() {
            return Err(place.error(format!("the id \"{}\" is given twice", plugin.id)));
        }
        self.document.plugins.push(plugin);
        properties.push(Property { name, value: Value::Plugin(id), place });
        Ok(())
    }

    fn include(&mut self, source: &XmlFile, node: Node, properties: &mut Vec<Property>) -> Result<()> {
        let name = self.needed(source, node, "filename")?;
        let file = self.document.find_file(&self.scene, &name);
        let path = self.scene.parent().unwrap_or(Path::new("")).join(file);
        let included = self.file(&path).map_err(|e| match e {
            Error::Missing { file, message } if file == path => {
                Error::Missing { file, message: format!("{message} (included at {})", source.place(node)) }
            }
            other => other,
        })?;
        properties.extend(included.properties);
        Ok(())
    }

    /// `value`, or `x`, `y` and `z`.
    fn vector(&mut self, source: &XmlFile, node: Node) -> Result<[f64; 3]> {
        let mut read = |node: Node, name: &str| self.attribute(source, node, name);
        transforms::vector(node, 0.0, &mut read, &|node, message| source.place(node).error(message))
    }
}
