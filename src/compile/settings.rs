//! Checks of the render settings: film, sampler, camera, integrator and outputs.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::faults::Faults;
use super::{Builder, CompileContext, FileCache, camera};
use crate::assets::SceneSource;
use crate::camera::Camera;
use crate::desc::{
    CameraDesc, FilmDesc, FilterDesc, IntegratorDesc, MAX_FILTER_RADIUS, MAX_SIDE, OutputDesc, SceneDesc,
};
use crate::error::{Error, Result};
use crate::film::Crop;
use crate::output::find_output_fault;

/// A scene whose render settings are checked, before anything is read that it names.
#[derive(Debug)]
pub struct CheckedScene<'a> {
    pub(super) desc: &'a SceneDesc,
    pub(super) files: CompileContext,
    pub(super) camera: Camera,
}

impl<'a> CheckedScene<'a> {
    /// Checks the numbers of film, sampler, camera, integrator and outputs of a scene that was read from a file of any
    /// kind; errors name the places in that file. Only if there is a fault, names and files are checked too.
    ///
    /// # Errors
    /// [`Error::Scene`] with the key of a number that makes no sense,
    /// or [`Error::Several`] with all faults of the scene.
    pub fn new(desc: &'a SceneDesc, source: SceneSource) -> Result<Self> {
        Self::check(desc, source.into())
    }

    /// As [`new`](Self::new), for a scene that is compiled again and again: files are read once.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_cache(desc: &'a SceneDesc, source: SceneSource, cache: Arc<FileCache>) -> Result<Self> {
        Self::check(desc, CompileContext { source, cache: Some(cache) })
    }

    fn check(desc: &'a SceneDesc, files: CompileContext) -> Result<Self> {
        let mut faults = Faults::default();
        faults.keep(check_film(&files, &desc.film));
        if desc.sampler.spp == 0 {
            faults.keep::<()>(Err(files.error("sampler.spp", "must be at least 1")));
        }
        faults.keep(check_integrator(&files, &desc.integrator));
        faults.keep(check_outputs(&files, &desc.outputs));
        let camera = faults.keep(camera::compile(&files, &desc.camera));
        match (faults.is_empty(), camera) {
            (true, Some(camera)) => Ok(Self { desc, files, camera }),
            (_, camera) => Err(all_faults(desc, &files, camera, faults)),
        }
    }
}

/// The faults of settings, and with them those of everything else.
fn all_faults(desc: &SceneDesc, files: &CompileContext, camera: Option<Camera>, mut faults: Faults) -> Error {
    let camera = camera.map_or_else(|| camera::compile(files, &CameraDesc::at([0.0, 0.0, 1.0], [0.0; 3])), Ok);
    if let Some(camera) = faults.keep(camera) {
        // The size may be a fault; surfaces are diced for a small picture.
        let film = FilmDesc { width: 64, height: 64, ..FilmDesc::default() };
        let desc = SceneDesc { film, ..desc.clone() };
        Builder::read(&desc, files.clone(), &camera, &mut faults);
    }
    faults.into_result().err().unwrap_or_else(|| Error::Internal("a fault without a message".into()))
}

/// Checks the numbers of a film and an integrator that `file` holds without a scene.
///
/// # Errors
/// As [`CheckedScene::new`].
pub fn check_film_and_integrator(film: &FilmDesc, integrator: &IntegratorDesc, file: &Path) -> Result<()> {
    let files = CompileContext::new(file);
    check_film(&files, film)?;
    check_integrator(&files, integrator)
}

fn check_film(files: &CompileContext, film: &FilmDesc) -> Result<()> {
    for (key, value) in [("film.width", film.width), ("film.height", film.height)] {
        if value == 0 || value > MAX_SIDE {
            return Err(files.error(key, format!("must be from 1 to {MAX_SIDE}, not {value}")));
        }
    }
    if let Some([x, y, width, height]) = film.crop
        && !(Crop { x, y, width, height }).fits([film.width, film.height])
    {
        let message =
            format!("[{x}, {y}, {width}, {height}] must have an area and lie within {} x {}", film.width, film.height);
        return Err(files.error("film.crop", message));
    }
    let most = film.width.min(film.height);
    if film.overscan > most {
        return Err(files.error(
            "film.overscan",
            format!("must be at most the picture's shorter side, {most}, not {}", film.overscan),
        ));
    }
    if film.overscan > 0 && film.crop.is_some() {
        return Err(
            files.error("film.overscan", "a crop leaves nothing around the picture: give one of `crop` and `overscan`")
        );
    }
    match film.filter {
        FilterDesc::Gaussian { sigma, .. } => {
            files.positive("film.filter.sigma", f64::from(sigma))?;
        }
        FilterDesc::Mitchell { b, c, .. } => {
            files.within("film.filter.b", f64::from(b), 0.0, 1.0)?;
            files.within("film.filter.c", f64::from(c), 0.0, 1.0)?;
        }
        _ => {}
    }
    let radius = film.filter.radius();
    if !(radius > 0.0 && radius <= MAX_FILTER_RADIUS) {
        let message = format!("must be above 0 and at most {MAX_FILTER_RADIUS} pixels, not {radius}");
        return Err(files.error("film.filter.radius", message));
    }
    Ok(())
}

fn check_integrator(files: &CompileContext, integrator: &IntegratorDesc) -> Result<()> {
    match *integrator {
        IntegratorDesc::Path { max_depth: 0, .. } => {
            return Err(files.error("integrator.max_depth", "must be at least 1"));
        }
        IntegratorDesc::Path { rr_depth: Some(0), .. } => {
            return Err(files.error("integrator.rr_depth", "must be at least 1"));
        }
        IntegratorDesc::Path { light_samples: Some(count), .. } if !(1..=64).contains(&count) => {
            return Err(files.error("integrator.light_samples", format!("must be from 1 to 64, not {count}")));
        }
        IntegratorDesc::Path { clamp: Some(clamp), .. } => {
            files.positive("integrator.clamp", f64::from(clamp))?;
        }
        IntegratorDesc::Whitted { max_depth, ambient, .. } => {
            if max_depth == 0 || max_depth > 64 {
                return Err(files.error("integrator.max_depth", format!("must be from 1 to 64, not {max_depth}")));
            }
            files.emitted("integrator.ambient", ambient)?;
        }
        IntegratorDesc::AmbientOcclusion { distance: Some(distance) } => {
            files.positive("integrator.distance", f64::from(distance))?;
        }
        _ => {}
    }
    Ok(())
}

fn check_outputs(files: &CompileContext, outputs: &[OutputDesc]) -> Result<()> {
    let mut written = HashMap::new();
    for (i, output) in outputs.iter().enumerate() {
        let path = format!("outputs[{i}]");
        check_output(files, &path, output)?;
        if let Some(first) = written.insert(output.file.as_str(), i) {
            return Err(files
                .error(&format!("{path}.file"), format!("\"{}\" is the file of outputs[{first}] too", output.file)));
        }
    }
    Ok(())
}

fn check_output(files: &CompileContext, path: &str, output: &OutputDesc) -> Result<()> {
    let extension = Path::new(&output.file).extension().map(|e| e.to_string_lossy().to_lowercase());
    if !matches!(extension.as_deref(), Some("exr" | "png")) {
        return Err(files.error(&format!("{path}.file"), format!("\"{}\" must end in .exr or .png", output.file)));
    }
    if !output.exposure.is_finite() {
        return Err(files.error(&format!("{path}.exposure"), "is not finite"));
    }
    let fault = if extension.as_deref() == Some("exr") { find_output_fault(output) } else { None };
    fault.map_or(Ok(()), |fault| Err(files.error(&format!("{path}.{}", fault.key), fault.message)))
}
