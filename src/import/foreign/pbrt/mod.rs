//! pbrt-v4 scenes.

use std::path::Path;

use super::{ImportOptions, Imported};
use crate::error::{Error, Result};

/// Reads a pbrt file.
pub fn read(path: &Path, _options: &ImportOptions) -> Result<Imported> {
    Err(Error::Usage(format!("{}: not read yet", path.display())))
}
