//! Denoising with Intel Open Image Denoise, a library that is loaded at run time if it is needed.
//!
//! Albedo and normals are denoised first if they are noisy, each by a filter of its own; the picture is denoised with
//! the help of both, linear and without a limit; alpha and parts of the picture (light groups, kinds of light) go
//! through filters of their own with the same two. See `docs/denoise.md`.

mod clean;
mod file;
mod image;
mod layers;
mod locate;
mod noise;
mod oidn;
mod prepared;
mod split;

pub use file::{FileOptions, denoise_file};
pub use image::{FEATURE_LAYERS, add_features, denoise_image};
pub use locate::{FILE_NAME, ProcessEnvironment, VARIABLE};

use std::path::Path;

use crate::error::Result;
use oidn::Device;

/// The library, ready to work.
pub struct Denoiser {
    device: Device,
}

impl Denoiser {
    /// Opens the library: the file or folder `named`, else the one that the environment variable [`VARIABLE`] names,
    /// else the system's, else that of Python's package `pyoidn`. Works with `threads` threads; 0 means all.
    ///
    /// # Errors
    /// [`Error::Missing`](crate::Error::Missing) if there is no library that can be used: where was looked, and how to
    /// get it.
    pub fn open(named: Option<&Path>, threads: usize) -> Result<Self> {
        let device = locate::open_first(named, &ProcessEnvironment::of_process(), |file| Device::open(file, threads))?;
        Ok(Self { device })
    }

    /// The library's version, such as 2.5.1.
    pub fn version(&self) -> String {
        self.device.version()
    }

    /// The library's file, or its bare name if the system found it.
    pub fn library(&self) -> &Path {
        self.device.file()
    }
}

/// How a feature was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Feature {
    /// Not at all: there is none, or it is 0 everywhere.
    #[default]
    None,
    /// As it is, free of noise.
    Clean,
    /// After a filter of its own.
    Prefiltered,
}

/// What denoising did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// The library's version.
    pub version: String,
    /// How albedo was used.
    pub albedo: Feature,
    /// How normals were used.
    pub normal: Feature,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Pixels that were not finite and were made from their neighbours before, counted in each layer.
    pub cleaned: u64,
    /// Pixels of the picture with a negative channel, which counts as 0.
    pub negative: u64,
    /// Names of the layers denoised, the picture first.
    pub layers: Vec<String>,
    /// What could not be done as one would expect.
    pub notes: Vec<String>,
}

impl Report {
    /// The attribute of EXR files with the parameters of their denoising.
    pub const ATTRIBUTE: &str = "steradian/denoised";

    /// The value of [`Report::ATTRIBUTE`], such as `OIDN 2.5.1, albedo clean, normal prefiltered`.
    pub fn attribute(&self) -> String {
        let used = |name: &str, feature| match feature {
            Feature::None => None,
            Feature::Clean => Some(format!("{name} clean")),
            Feature::Prefiltered => Some(format!("{name} prefiltered")),
        };
        let used: Vec<String> =
            [used("albedo", self.albedo), used("normal", self.normal)].into_iter().flatten().collect();
        let features = if used.is_empty() { "without albedo and normal".to_owned() } else { used.join(", ") };
        format!("OIDN {}, {features}", self.version)
    }
}
