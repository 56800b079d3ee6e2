//! Python values to JSON and back; arrays of meshes to buffers.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde_json::{Map, Number, Value};
use steradian::internal::assets::MeshData;

/// Keys of a mesh that may be arrays.
const BUFFERS: [&str; 5] = ["positions", "triangles", "normals", "uvs", "colors"];

/// Meshes that were given as arrays, by the names of files that they stand in for.
#[derive(Default)]
pub struct Meshes {
    pub named: Vec<(String, MeshData)>,
}

/// A Python value as JSON. Arrays become lists, but those of a mesh become buffers in `meshes`.
pub fn to_json(value: &Bound<'_, PyAny>, meshes: &mut Meshes) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(Value::Bool(flag.is_true()));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::String(text.to_string()));
    }
    if let Ok(number) = value.cast::<PyInt>() {
        return match (number.extract::<i64>(), number.extract::<u64>()) {
            (Ok(number), _) => Ok(number.into()),
            (_, Ok(number)) => Ok(number.into()),
            _ => Err(PyValueError::new_err(format!("{number} does not fit 64 bits"))),
        };
    }
    if let Ok(number) = value.cast::<PyFloat>() {
        let number = number.extract::<f64>()?;
        let finite = Number::from_f64(number);
        return finite.map(Value::Number).ok_or_else(|| PyValueError::new_err(format!("{number} is not finite")));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return dict_to_json(dict, meshes);
    }
    if value.cast::<PyList>().is_ok() || value.cast::<PyTuple>().is_ok() {
        let items = value.try_iter()?.map(|item| to_json(&item?, meshes));
        return items.collect::<PyResult<_>>().map(Value::Array);
    }
    // Arrays and scalars of NumPy.
    if value.hasattr("tolist")? {
        return to_json(&value.call_method0("tolist")?, meshes);
    }
    if value.hasattr("__fspath__")? {
        return to_json(&value.call_method0("__fspath__")?, meshes);
    }
    Err(PyTypeError::new_err(format!("{} is no part of a scene", value.get_type().name()?)))
}

fn dict_to_json(dict: &Bound<'_, PyDict>, meshes: &mut Meshes) -> PyResult<Value> {
    let mut map = Map::new();
    let is_mesh = dict.get_item("type")?.is_some_and(|kind| kind.eq("mesh").unwrap_or(false));
    let is_array =
        dict.get_item("positions")?.is_some_and(|array| array.hasattr("__array_interface__").unwrap_or(false));
    let as_buffers = is_mesh && is_array;
    for (key, value) in dict {
        let key = key.cast::<PyString>().map_err(|_| PyTypeError::new_err(format!("the key {key} is no text")))?;
        let key = key.to_string();
        if !(as_buffers && BUFFERS.contains(&key.as_str())) {
            map.insert(key, to_json(&value, meshes)?);
        }
    }
    if as_buffers {
        let name = format!("array_{}.ply", meshes.named.len());
        meshes.named.push((name.clone(), mesh(dict)?));
        map.insert("file".to_owned(), name.into());
    }
    Ok(Value::Object(map))
}

/// The buffers of a mesh, from arrays of shape `(n, 3)`, or `(n, 2)` for uvs.
fn mesh(dict: &Bound<'_, PyDict>) -> PyResult<MeshData> {
    let rows = |key: &str| dict.get_item(key);
    let positions = rows("positions")?.map(|array| doubles(&array, "positions")).transpose()?.unwrap_or_default();
    let Some(triangles) = rows("triangles")? else {
        return Err(PyValueError::new_err("a mesh of arrays needs `triangles` beside `positions`"));
    };
    let vertices = positions.len();
    let (positions, origin) = MeshData::rounded(&positions);
    let mesh = MeshData {
        positions,
        triangles: corners(&triangles, vertices)?,
        normals: rows("normals")?.map(|array| floats::<3>(&array, "normals")).transpose()?,
        uvs: rows("uvs")?.map(|array| floats::<2>(&array, "uvs")).transpose()?,
        origin,
        ..MeshData::default()
    };
    Ok(mesh.with_colors(rows("colors")?.map(|array| floats::<3>(&array, "colors")).transpose()?))
}

/// The bytes of an array of `columns` columns, after a conversion to a type of numbers.
fn bytes<'py>(array: &Bound<'py, PyAny>, name: &str, columns: usize, kind: &str) -> PyResult<Bound<'py, PyBytes>> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (array, kind))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape[1] != columns {
        return Err(PyValueError::new_err(format!("{name} has the shape {shape:?}: expected (n, {columns})")));
    }
    Ok(array.call_method0("tobytes")?.cast_into::<PyBytes>()?)
}

/// Rows of numbers out of bytes, each of `SIZE` bytes.
fn rows<T: Copy, const SIZE: usize, const N: usize>(bytes: &[u8], number: impl Fn([u8; SIZE]) -> T) -> Vec<[T; N]> {
    let numbers: Vec<T> = bytes.as_chunks::<SIZE>().0.iter().map(|bytes| number(*bytes)).collect();
    numbers.as_chunks::<N>().0.to_vec()
}

fn doubles(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    Ok(rows(bytes(array, name, 3, "<f8")?.as_bytes(), f64::from_le_bytes))
}

fn floats<const N: usize>(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f32; N]>> {
    Ok(rows(bytes(array, name, N, "<f4")?.as_bytes(), f32::from_le_bytes))
}

/// Indices, which must be whole numbers of vertices: a conversion to 32 bits would wrap others.
fn corners(array: &Bound<'_, PyAny>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
    let kind: String =
        array.py().import("numpy")?.call_method1("asarray", (array,))?.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["i", "u"].contains(&kind.as_str()) {
        return Err(PyValueError::new_err("triangles must be an array of whole numbers"));
    }
    let wide: Vec<[i64; 3]> = rows(bytes(array, "triangles", 3, "<i8")?.as_bytes(), i64::from_le_bytes);
    let index = |i: i64| u32::try_from(i).ok().filter(|i| (*i as usize) < vertices);
    let row = |(number, row): (usize, &[i64; 3])| match row.map(index) {
        [Some(a), Some(b), Some(c)] => Ok([a, b, c]),
        _ => Err(PyValueError::new_err(format!("triangles[{number}] = {row:?}: the mesh has {vertices} positions"))),
    };
    wide.iter().enumerate().map(row).collect()
}

/// JSON as a Python value.
pub fn from_json<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}

/// Numbers of an array of shape `(height, width, channels)`, with its shape.
pub fn picture(array: &Bound<'_, PyAny>) -> PyResult<([usize; 3], Vec<f32>)> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (array, "<f4"))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let [height, width, channels] = shape[..] else {
        return Err(PyValueError::new_err(format!("a picture has the shape (height, width, channels), not {shape:?}")));
    };
    let bytes = array.call_method0("tobytes")?.cast_into::<PyBytes>()?;
    let numbers = bytes.as_bytes().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    Ok(([height, width, channels], numbers))
}
