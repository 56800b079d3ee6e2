//! Scenes: read from files or dictionaries, changed by paths.

use std::path::PathBuf;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};
use steradian::internal::import::{self, ImportOptions};
use steradian::internal::render::Overrides;
use steradian::{Assignment, Renderer};

use crate::convert::{Meshes, from_json, to_json};
use crate::errors::{OrRaise, raise};

/// A scene with the settings of its render. Change it by `scene[path] = value`; `steradian.render` keeps whatever the
/// changes leave as it is.
#[pyclass(name = "Scene", module = "steradian")]
pub struct PyScene {
    /// Taken while it is rendered.
    renderer: Option<Renderer>,
    settings: Map<String, Value>,
}

impl PyScene {
    /// The renderer, to be put back after use.
    pub fn take(&mut self) -> PyResult<Renderer> {
        self.renderer.take().ok_or_else(busy)
    }

    /// Puts the renderer back.
    pub fn put(&mut self, renderer: Renderer) {
        self.renderer = Some(renderer);
    }

    /// The scene's settings with those of one render.
    pub fn merged(&self, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Map<String, Value>> {
        let mut merged = self.settings.clone();
        merged.extend(json_of(settings)?);
        Ok(merged)
    }

    fn renderer(&self) -> PyResult<&Renderer> {
        self.renderer.as_ref().ok_or_else(busy)
    }
}

fn busy() -> PyErr {
    PyRuntimeError::new_err("the scene is being rendered by another thread")
}

fn json_of(settings: Option<&Bound<'_, PyDict>>) -> PyResult<Map<String, Value>> {
    let Some(settings) = settings else { return Ok(Map::new()) };
    match to_json(settings.as_any(), &mut Meshes::default())? {
        Value::Object(map) => Ok(map),
        _ => Ok(Map::new()),
    }
}

/// Sets all settings of a renderer, in place of those before.
pub fn apply(py: Python<'_>, mut renderer: Renderer, mut settings: Map<String, Value>) -> Applied {
    let denoise = settings.remove("denoise").is_some_and(|value| value == Value::Bool(true));
    let library = settings.remove("oidn_library").and_then(|value| value.as_str().map(PathBuf::from));
    let assigned = assignments(&mut settings);
    let overrides = overrides(py, settings);
    renderer = if denoise { renderer.denoise(library) } else { renderer.without_denoise() };
    let result = assigned.or_raise(py).and_then(|assignments| Ok((assignments, overrides?)));
    match result {
        Ok((assignments, overrides)) => {
            let default_outputs = std::mem::take(&mut renderer.overrides_mut().default_outputs);
            let overrides = Overrides { default_outputs, ..overrides };
            (renderer.with_overrides(overrides).without_assignments().assign(&assignments), Ok(()))
        }
        Err(error) => (renderer, Err(error)),
    }
}

/// A renderer, and whether its settings make sense.
pub type Applied = (Renderer, PyResult<()>);

/// `set={"integrator.clamp": 10}`.
fn assignments(settings: &mut Map<String, Value>) -> steradian::Result<Vec<Assignment>> {
    let Some(Value::Object(set)) = settings.remove("set") else { return Ok(Vec::new()) };
    set.into_iter().map(|(key, value)| Assignment::new(&key, value)).collect()
}

fn overrides(py: Python<'_>, mut settings: Map<String, Value>) -> PyResult<Overrides> {
    // The name of an algorithm alone means its default parameters.
    if let Some(Value::String(name)) = settings.get("integrator") {
        let tagged = serde_json::json!({ "type": name });
        settings.insert("integrator".to_owned(), tagged);
    }
    if let Some(layers) = settings.get_mut("layers") {
        let names: Vec<String> = match layers {
            Value::String(name) => vec![name.clone()],
            Value::Array(names) => names.iter().filter_map(|name| name.as_str().map(str::to_owned)).collect(),
            _ => Vec::new(),
        };
        let mut kinds = Vec::new();
        for name in &names {
            for kind in steradian::layers_of(name).or_raise(py)? {
                kinds.push(serde_json::to_value(kind).unwrap_or_default());
            }
        }
        *layers = Value::Array(kinds);
    }
    let fault = |key: &str, message: String| raise(py, "SettingError", &format!("`{key}`: {message}"));
    let mut found = Overrides::default();
    for (key, value) in &settings {
        let single: Map<String, Value> = [(key.clone(), value.clone())].into_iter().collect();
        serde_json::from_value::<Overrides>(Value::Object(single)).map_err(|e| fault(key, e.to_string()))?;
    }
    found.clone_from(&serde_json::from_value(Value::Object(settings)).map_err(|e| fault("settings", e.to_string()))?);
    Ok(found)
}

#[pymethods]
impl PyScene {
    /// The scene's file.
    #[getter]
    fn file(&self) -> PyResult<String> {
        Ok(self.renderer()?.scene_file().display().to_string())
    }

    /// The scene as a dictionary in the scene format, without what has its default.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &serde_json::to_value(self.renderer()?.scene()).unwrap_or_default())
    }

    /// The settings that replace the scene's.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &Value::Object(self.settings.clone()))
    }

    /// What of another renderer's scene was not mapped exactly, one line each.
    #[getter]
    fn report(&self) -> PyResult<Vec<String>> {
        Ok(self.renderer()?.report().summary())
    }

    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.renderer()?.parameter(path).or_raise(py)?)
    }

    fn __setitem__(&mut self, py: Python<'_>, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut meshes = Meshes::default();
        let value = to_json(value, &mut meshes)?;
        if !meshes.named.is_empty() {
            let message = "meshes of arrays can only be given to load_dict";
            return Err(raise(py, "SceneError", message));
        }
        self.renderer.as_mut().ok_or_else(busy)?.change(path, value).or_raise(py)
    }

    fn __repr__(&self) -> String {
        match &self.renderer {
            None => "<steradian.Scene, being rendered>".to_owned(),
            Some(renderer) => {
                let scene = renderer.scene();
                let (shapes, lights) = (scene.shapes.len(), scene.lights.len());
                format!("<steradian.Scene {}: {shapes} shapes, {lights} lights>", renderer.scene_file().display())
            }
        }
    }

    /// Reads what the scene names and builds the accelerator, which the first render does otherwise.
    fn build(&mut self, py: Python<'_>) -> PyResult<()> {
        let (mut renderer, applied) = apply(py, self.take()?, self.settings.clone());
        let result = applied.and_then(|()| py.detach(|| renderer.load().map(drop)).or_raise(py));
        self.put(renderer);
        result
    }
}

/// Reads a scene: .json, .xml (Mitsuba 3), .pbrt (pbrt-v4), .gltf or .glb.
///
/// defines: values of $name in Mitsuba's scenes. time: seconds into glTF's animations. allow_missing: render without
/// the files that do not exist. All other arguments are settings of the render, as of `steradian.render`.
#[pyfunction]
#[pyo3(signature = (file, *, defines=None, time=0.0, allow_missing=false, **settings))]
pub fn load(
    py: Python<'_>,
    file: PathBuf,
    defines: Option<Bound<'_, PyDict>>,
    time: f64,
    allow_missing: bool,
    settings: Option<Bound<'_, PyDict>>,
) -> PyResult<PyScene> {
    let pairs = defines.map(|defines| {
        defines
            .iter()
            .map(|(key, value)| Ok((key.str()?.to_string(), value.str()?.to_string())))
            .collect::<PyResult<Vec<_>>>()
    });
    let options = ImportOptions { defines: pairs.transpose()?.unwrap_or_default(), time };
    let renderer = py.detach(|| Renderer::open_with(&file, options, allow_missing)).or_raise(py)?;
    checked(py, renderer, settings.as_ref())
}

/// A scene from a dictionary in the scene format. A mesh may have NumPy arrays: "positions" of shape (n, 3),
/// "triangles" of whole numbers of shape (m, 3), and "normals", "uvs", "colors" for each position.
///
/// folder: where the files lie that the scene names. All other arguments are settings of the render, as of
/// `steradian.render`.
#[pyfunction]
#[pyo3(signature = (scene, *, folder=None, **settings))]
pub fn load_dict(
    scene: Bound<'_, PyDict>,
    folder: Option<PathBuf>,
    settings: Option<Bound<'_, PyDict>>,
) -> PyResult<PyScene> {
    let py = scene.py();
    let mut meshes = Meshes::default();
    let value = to_json(scene.as_any(), &mut meshes)?;
    let desc = import::parse_scene(&value.to_string(), "scene".as_ref()).or_raise(py)?;
    let mut renderer = Renderer::from_desc(desc);
    if let Some(folder) = folder {
        renderer = renderer.in_folder(folder);
    }
    for (name, mesh) in meshes.named {
        renderer = renderer.with_mesh(name, mesh);
    }
    checked(py, renderer, settings.as_ref())
}

/// A scene with settings that make sense.
fn checked(py: Python<'_>, renderer: Renderer, settings: Option<&Bound<'_, PyDict>>) -> PyResult<PyScene> {
    let settings = json_of(settings)?;
    let (renderer, applied) = apply(py, renderer, settings.clone());
    applied?;
    renderer.check().or_raise(py)?;
    renderer.settings().or_raise(py)?;
    Ok(PyScene { renderer: Some(renderer), settings })
}

/// The JSON Schema of scenes, as text.
#[pyfunction]
pub fn schema() -> String {
    import::schema()
}
