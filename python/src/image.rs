//! Pictures: layers as NumPy arrays without copies, files, comparison.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyBytes, PyDict};
use serde_json::Value;
use steradian::desc::{OutputDesc, PixelTypeDesc, ViewDesc};
use steradian::internal::output::{self, RenderInfo, flip};
use steradian::{Image, Layer, Rendering};

use crate::convert::{from_json, picture};
use crate::errors::OrRaise;

/// Where a picture comes from.
pub enum Source {
    /// A render.
    Rendering(Box<Rendering>),
    /// A file or an array, the colour alone; or a render under way.
    Plain(Image),
}

impl Source {
    fn image(&self) -> &Image {
        match self {
            Self::Rendering(rendering) => rendering.image(),
            Self::Plain(image) => image,
        }
    }
}

/// A picture with its layers, each a NumPy array of 32-bit floats with the shape (height, width, channels), without a
/// copy. Row 0 is the top. `image["color"]` is linear red, green, blue and alpha.
#[pyclass(name = "Image", module = "steradian", frozen)]
pub struct PyImage {
    pub source: Arc<Source>,
}

/// The numbers of a layer, for NumPy. They live as long as any array over them.
#[pyclass(name = "Layer", module = "steradian", frozen)]
pub struct PyLayer {
    source: Arc<Source>,
    layer: usize,
}

#[pymethods]
impl PyLayer {
    /// NumPy's array interface, version 3: read-only.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let image = self.source.image();
        let layer = &image.layers[self.layer];
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", "<f4")?;
        interface.set_item("shape", (image.crop.height, image.crop.width, layer.channels()))?;
        interface.set_item("data", (layer.data.as_ptr() as usize, true))?;
        Ok(interface)
    }
}

impl PyImage {
    /// A picture of this source.
    pub fn new(source: Source) -> Self {
        Self { source: Arc::new(source) }
    }

    fn names(&self) -> Vec<String> {
        self.source.image().layers.iter().map(Layer::name).collect()
    }

    fn output(&self, file: String, options: &SaveOptions) -> PyResult<OutputDesc> {
        let mut output = OutputDesc::new(file);
        if let Source::Rendering(rendering) = &*self.source {
            output.layers = rendering.settings().stored_layers();
            output.view = Some(rendering.settings().integrator.view());
        }
        if let Some(name) = &options.view {
            let view = serde_json::from_value::<ViewDesc>(Value::String(name.clone()));
            output.view = Some(view.map_err(|e| PyValueError::new_err(format!("view: {e}")))?);
        }
        output.exposure = options.exposure;
        if options.float {
            output.pixel_type = PixelTypeDesc::Float;
        }
        Ok(output)
    }
}

/// How a file is written.
#[derive(Default)]
struct SaveOptions {
    exposure: f32,
    view: Option<String>,
    float: bool,
}

#[pymethods]
impl PyImage {
    /// Names of the layers, "color" first.
    #[getter]
    fn layers(&self) -> Vec<String> {
        self.names()
    }

    /// Width in pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.source.image().crop.width
    }

    /// Height in pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.source.image().crop.height
    }

    /// (height, width, channels) of the colour.
    #[getter]
    fn shape(&self) -> (u32, u32, usize) {
        (self.height(), self.width(), 4)
    }

    /// Names of a layer's channels, such as ["N.X", "N.Y", "N.Z"].
    fn channels(&self, layer: &str) -> PyResult<Vec<String>> {
        Ok(self.source.image().layers[self.index(layer)?].channel_names())
    }

    /// Time, rays, samples and memory of the render; None of a picture that was read.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &*self.source {
            Source::Rendering(rendering) => from_json(py, &rendering.statistics()),
            Source::Plain(_) => Ok(py.None().into_bound(py)),
        }
    }

    /// A layer of Cryptomatte that the render had: `channels` (names), `data` (an array of shape (height, width,
    /// channels) with an id and a coverage for each of `depth` ranks), and `metadata`, which EXR files need beside it.
    ///
    /// layer: "crypto_object", "crypto_material" or "crypto_asset". depth: an even number, from 2 to 64.
    #[pyo3(signature = (layer, *, depth=6))]
    fn cryptomatte<'py>(&self, py: Python<'py>, layer: &str, depth: u32) -> PyResult<Bound<'py, PyDict>> {
        let Source::Rendering(rendering) = &*self.source else {
            return Err(PyKeyError::new_err("only finished renders have Cryptomatte"));
        };
        let matte = rendering.cryptomatte(layer, depth).or_raise(py)?;
        let bytes: Vec<u8> = matte.data.iter().flat_map(|number| number.to_le_bytes()).collect();
        let data = py.import("numpy")?.call_method1("frombuffer", (PyBytes::new(py, &bytes), "<f4"))?;
        let found = PyDict::new(py);
        let shape = (self.height(), self.width(), matte.channels.len());
        found.set_item("data", data.call_method1("reshape", (shape,))?)?;
        found.set_item("metadata", matte.metadata().into_py_dict(py)?)?;
        found.set_item("channels", matte.channels)?;
        Ok(found)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, layer: &str) -> PyResult<Bound<'py, PyAny>> {
        let layer = PyLayer { source: Arc::clone(&self.source), layer: self.index(layer)? };
        py.import("numpy")?.call_method1("asarray", (layer,))
    }

    fn __contains__(&self, layer: &str) -> bool {
        self.names().iter().any(|name| name == layer)
    }

    fn __len__(&self) -> usize {
        self.source.image().layers.len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.names().into_pyobject(py)?.call_method0("__iter__")
    }

    fn __repr__(&self) -> String {
        format!("<steradian.Image {}x{}: {}>", self.width(), self.height(), self.names().join(", "))
    }

    /// The colour as an array: what `numpy.asarray(image)` is.
    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = self.__getitem__(py, "color")?;
        match (dtype, copy) {
            (Some(dtype), _) => array.call_method1("astype", (dtype,)),
            (None, Some(true)) => array.call_method0("copy"),
            (None, _) => Ok(array),
        }
    }

    /// Writes an .exr file (all layers, linear, with what `steradian render` stores) or a .png file.
    ///
    /// exposure: stops, for PNG. view: "agx", "filmic" or "srgb", for PNG. float: 32-bit floats in place of 16-bit
    /// ones, for EXR.
    #[pyo3(signature = (file, *, exposure=0.0, view=None, float=false))]
    fn save(&self, py: Python<'_>, file: PathBuf, exposure: f32, view: Option<String>, float: bool) -> PyResult<()> {
        let output = self.output(file.to_string_lossy().into_owned(), &SaveOptions { exposure, view, float })?;
        py.detach(|| match &*self.source {
            Source::Rendering(rendering) => rendering.save_as(&output),
            Source::Plain(image) => output::write(&output, image, &RenderInfo::default()),
        })
        .or_raise(py)
    }

    /// The picture as a PNG file in memory, as notebooks show it.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("picture.png");
        self.save(py, file.clone(), 0.0, None, false)?;
        Ok(PyBytes::new(py, &std::fs::read(file)?))
    }
}

impl PyImage {
    fn index(&self, layer: &str) -> PyResult<usize> {
        let names = self.names();
        let found = names.iter().position(|name| name == layer);
        found.ok_or_else(|| PyKeyError::new_err(format!("no layer {layer:?}; the picture has {}", names.join(", "))))
    }
}

/// A picture: an Image, an array of shape (height, width, 3 or 4), or the name of an .exr
/// file.
fn image_of(value: &Bound<'_, PyAny>) -> PyResult<Arc<Source>> {
    if let Ok(image) = value.cast::<PyImage>() {
        return Ok(Arc::clone(&image.get().source));
    }
    if value.hasattr("__array_interface__")? {
        return Ok(Arc::new(Source::Plain(image_of_array(value)?)));
    }
    let file = value
        .extract::<PathBuf>()
        .map_err(|_| PyTypeError::new_err("a picture is a steradian.Image, an array, or the name of an .exr file"))?;
    let py = value.py();
    Ok(Arc::new(Source::Plain(py.detach(|| output::read_exr(&file)).or_raise(py)?)))
}

fn image_of_array(array: &Bound<'_, PyAny>) -> PyResult<Image> {
    let ([height, width, channels], data) = picture(array)?;
    let size = [width, height].map(|side| u32::try_from(side).unwrap_or(0));
    if size.contains(&0) {
        return Err(PyValueError::new_err(format!("the picture has {width} x {height} pixels")));
    }
    let data = match channels {
        4 => data,
        3 => data.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 1.0]).collect(),
        _ => return Err(PyValueError::new_err(format!("a picture has 3 or 4 channels, not {channels}"))),
    };
    Ok(Image::of_color(size, data))
}

/// Reads the colour of an .exr file.
#[pyfunction]
pub fn read(py: Python<'_>, file: PathBuf) -> PyResult<PyImage> {
    Ok(PyImage::new(Source::Plain(py.detach(|| output::read_exr(&file)).or_raise(py)?)))
}

/// Writes a picture to an .exr or .png file: an Image, or an array of shape (height, width, 3 or 4) of linear colours.
#[pyfunction]
#[pyo3(signature = (file, image, *, exposure=0.0, view=None, float=false))]
pub fn write(
    file: PathBuf,
    image: &Bound<'_, PyAny>,
    exposure: f32,
    view: Option<String>,
    float: bool,
) -> PyResult<()> {
    let source = image_of(image)?;
    PyImage { source }.save(image.py(), file, exposure, view, float)
}

/// Differences of a picture from its reference; each is an Image, an array or the name of an .exr file.
///
/// mse: mean of (test - reference)². relmse: mean of (test - reference)² / (reference² + 0.01). relmse_trimmed: without
/// the worst thousandth of the pixels. psnr: decibels, None of equal pictures. mean_ratio: the test's mean over the
/// reference's, by channel. flip: mean HDR-FLIP (Andersson et al. 2021).
#[pyfunction]
pub fn compare<'py>(reference: &Bound<'py, PyAny>, test: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = reference.py();
    let (reference, test) = (image_of(reference)?, image_of(test)?);
    let compared = py.detach(|| {
        let (reference, test) = (reference.image(), test.image());
        let comparison = output::compare(reference, test)?;
        Ok((comparison, flip::mean(&flip::hdr_flip(reference, test)?)))
    });
    let (comparison, flip) = compared.or_raise(py)?;
    let mut value = serde_json::to_value(comparison).map_err(|e| PyValueError::new_err(e.to_string()))?;
    value["flip"] = flip.into();
    from_json(py, &value)
}
