//! Pages of the manual: the scene format from its JSON Schema, the command line from its definition.

mod commands;
mod format;
mod words;

use std::fs;
use std::path::Path;

use steradian::{Error, Result};

pub use commands::pages as command_pages;
pub use format::pages as format_pages;

/// A page: the name of its file and its Markdown.
pub struct Page {
    name: String,
    text: String,
}

/// Writes pages into a folder, which is made if needed.
///
/// # Errors
///
/// [`Error::Output`] for a file or folder that cannot be written.
pub fn write(pages: &[Page], folder: &Path) -> Result<()> {
    let failed = |file: &Path, e: std::io::Error| Error::Output { file: file.to_owned(), message: e.to_string() };
    fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
    for page in pages {
        let file = folder.join(&page.name);
        fs::write(&file, &page.text).map_err(|e| failed(&file, e))?;
    }
    Ok(())
}

/// Text for a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
