//! Reports: JSON, CSV, Markdown, and one page of HTML that needs no network.

pub(super) mod csv;
pub(super) mod html;
pub(super) mod markdown;
pub(super) mod plot;
mod reports;

use std::path::Path;

use serde::Serialize;

use super::{Machine, ScalingReport, SceneReport};
use steradian::{Error, Result};

/// Everything a benchmark of accelerators has found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Where it ran.
    pub machine: Machine,
    /// The command that ran it.
    pub command: String,
    /// One for each scene.
    pub scenes: Vec<SceneReport>,
    /// Cost over the number of triangles, if requested.
    pub scaling: Option<ScalingReport>,
}

impl Report {
    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// One line for each scene, accelerator, kind of ray, mode and number of threads.
    pub fn csv(&self) -> String {
        csv::write(self)
    }

    /// Tables for a README or a note.
    pub fn markdown(&self) -> String {
        markdown::write(self)
    }

    /// One page with plots.
    ///
    /// # Errors
    /// If a plot cannot be drawn.
    pub fn html(&self) -> Result<String> {
        html::write(self)
    }

    /// Writes `accel.json`, `accel.csv`, `accel.md` and `accel.html` into a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_to(&self, folder: &Path) -> Result<()> {
        let files = [
            ("accel.json", self.json()?),
            ("accel.csv", self.csv()),
            ("accel.md", self.markdown()),
            ("accel.html", self.html()?),
        ];
        write_files(folder, &files)
    }
}

/// Writes texts into a folder, which is made if it does not exist.
///
/// # Errors
/// [`Error::Output`] naming the file.
pub(super) fn write_files(folder: &Path, files: &[(&str, String)]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.into(), message: e.to_string() })?;
    for (name, text) in files {
        crate::output::write_atomically(&folder.join(name), |out| {
            std::io::Write::write_all(out, text.as_bytes()).map_err(|e| e.to_string())
        })?;
    }
    Ok(())
}
