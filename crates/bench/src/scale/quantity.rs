//! What is read off a case.

use super::Case;
use super::run::Measured;

/// A cost, a rate or a size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Load,
    Build,
    FirstPixel,
    Render,
    Sample,
    Rate,
    RaysPerSample,
    Accel,
    MeshPerTriangle,
    AccelPerTriangle,
    PeakPerTriangle,
    AccelPerInstance,
    FilmPerPixel,
    RenderPerPixel,
    Peak,
}

impl Quantity {
    /// Its name with its unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load => "load s",
            Self::Build => "build s",
            Self::FirstPixel => "first picture s",
            Self::Render => "render s",
            Self::Sample => "processor ns a sample",
            Self::Rate => "Msamples/s",
            Self::RaysPerSample => "rays a sample",
            Self::Accel => "accelerator bytes",
            Self::MeshPerTriangle => "mesh B a triangle",
            Self::AccelPerTriangle => "accelerator B a triangle",
            Self::PeakPerTriangle => "peak B a triangle",
            Self::AccelPerInstance => "accelerator B an instance",
            Self::FilmPerPixel => "film B a pixel",
            Self::RenderPerPixel => "render B a pixel",
            Self::Peak => "peak MB",
        }
    }

    /// Its value in one run.
    pub fn of(self, case: &Case, run: &Measured) -> Option<f64> {
        let per = |bytes: u64, count: u64| (count > 0).then(|| bytes as f64 / count as f64);
        let pixels = u64::from(case.size[0]) * u64::from(case.size[1]);
        Some(match self {
            Self::Load => run.load_seconds,
            Self::Build => run.build_seconds,
            Self::FirstPixel => run.load_seconds + run.build_seconds + run.first_pass_seconds,
            Self::Render => run.render_seconds,
            Self::Sample => run.processor_seconds * 1e9 / run.samples as f64,
            Self::Rate => run.samples as f64 / run.render_seconds.max(1e-9) * 1e-6,
            Self::RaysPerSample => run.rays as f64 / run.samples as f64,
            Self::Accel => run.accelerator_bytes as f64,
            Self::MeshPerTriangle => per(run.mesh_bytes, run.triangles)?,
            Self::AccelPerTriangle => per(run.accelerator_bytes, run.triangles)?,
            Self::PeakPerTriangle => per(run.peak_bytes()?.saturating_sub(run.memory?.start), run.triangles)?,
            Self::AccelPerInstance => per(run.accelerator_bytes, run.instances)?,
            Self::FilmPerPixel => run.film_bytes_per_pixel as f64,
            Self::RenderPerPixel => {
                let memory = run.memory?;
                per(memory.render.saturating_sub(memory.before_render), pixels)?
            }
            Self::Peak => run.peak_bytes()? as f64 * 1e-6,
        })
    }
}
