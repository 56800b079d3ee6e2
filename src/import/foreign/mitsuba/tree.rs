//! A Mitsuba scene as its file has it: plugins with typed parameters, each with its place.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::error::Error;
use crate::math::DAffine3;
use crate::suggestion::did_you_mean;

/// Where something stands in a file.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// The file.
    pub file: Rc<Path>,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in bytes.
    pub column: usize,
}

impl Place {
    /// An error here.
    pub fn error(&self, message: impl Into<String>) -> Error {
        Error::Parse { file: self.file.to_path_buf(), line: self.line, column: self.column, message: message.into() }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file.display(), self.line, self.column)
    }
}

/// Index of a plugin in a [`Document`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PluginId(pub usize);

/// What a parameter may be.
#[derive(Clone, Debug)]
pub enum Value {
    /// `<float>`.
    Float(f64),
    /// `<integer>`.
    Integer(i64),
    /// `<boolean>`.
    Boolean(bool),
    /// `<string>`.
    Text(String),
    /// `<point>` and `<vector>`.
    Vector([f64; 3]),
    /// `<rgb>`, linear.
    Rgb([f32; 3]),
    /// `<spectrum>` with a value or a file.
    Spectrum(Spectrum),
    /// `<transform>`.
    Transform(DAffine3),
    /// A nested plugin.
    Plugin(PluginId),
    /// `<ref>`: the id of a plugin.
    Reference(String),
}

/// A spectrum as written.
#[derive(Clone, Debug)]
pub(crate) enum Spectrum {
    /// The same at all wavelengths.
    Uniform(f64),
    /// Wavelengths in nanometres, and values there.
    Samples(Vec<[f64; 2]>),
    /// Such samples in a file.
    File(String),
}

/// A parameter of a plugin.
#[derive(Clone, Debug)]
pub struct Property {
    /// Its name; empty for nested plugins without one.
    pub name: String,
    /// Its value.
    pub value: Value,
    /// Where it stands.
    pub place: Place,
}

/// A plugin with its parameters, in the order of the file.
#[derive(Clone, Debug)]
pub struct Plugin {
    /// The tag: `shape`, `bsdf` and so on.
    pub class: String,
    /// The attribute `type`.
    pub kind: String,
    /// The attribute `id`, or nothing.
    pub id: String,
    /// Where it stands.
    pub place: Place,
    /// Its parameters.
    pub properties: Vec<Property>,
}

impl Plugin {
    /// How reports call it.
    pub fn title(&self) -> String {
        if self.id.is_empty() {
            format!("{} {}", self.class, self.kind)
        } else {
            format!("{} {} \"{}\"", self.class, self.kind, self.id)
        }
    }
}

/// A scene file with all that it includes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Document {
    /// All plugins; the last one is the scene.
    pub plugins: Vec<Plugin>,
    /// Plugins by id.
    pub ids: BTreeMap<String, PluginId>,
    /// Other names of ids.
    pub aliases: BTreeMap<String, String>,
    /// Folders in which files are searched, before that of the scene; relative to it.
    pub folders: Vec<PathBuf>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
}

impl Document {
    /// The plugin that a parameter holds or refers to, if it does.
    ///
    /// # Errors
    /// If there is no plugin of that id.
    pub fn plugin_of(&self, property: &Property) -> Result<Option<PluginId>, Error> {
        match &property.value {
            Value::Plugin(id) => Ok(Some(*id)),
            Value::Reference(name) => {
                let target = self.aliases.get(name).unwrap_or(name);
                let found = self.ids.get(target).copied();
                let hint = || did_you_mean(name, self.ids.keys().map(String::as_str), ["\"", "\""]);
                let unknown = || property.place.error(format!("nothing has the id \"{name}\"{}", hint()));
                found.ok_or_else(unknown).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// The path of a file name of the scene, relative to the scene's folder.
    pub fn find_file(&self, scene: &Path, name: &str) -> String {
        let home = scene.parent().unwrap_or(Path::new(""));
        let candidates = self.folders.iter().rev().map(|folder| folder.join(name));
        let found = candidates.into_iter().find(|path| home.join(path).is_file() && !home.join(name).is_file());
        found.map_or_else(|| name.to_owned(), |path| path.to_string_lossy().into_owned())
    }
}
