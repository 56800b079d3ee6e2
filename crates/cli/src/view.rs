//! `steradian view`.

use std::path::Path;
use std::process::{Command, Stdio};

use steradian::internal::live::{Compared, Preview, PreviewOptions, Snapshot};
use steradian::internal::output::read_exr_layers;
use steradian::{Error, Result};

use crate::args::ViewArgs;
use crate::interrupt::Interrupt;
use crate::text;

/// Serves the page of one or two pictures until Ctrl-C.
pub fn run(arguments: &ViewArgs) -> Result<()> {
    let snapshot = Snapshot::of_file(read_exr_layers(&arguments.file)?);
    let compared = arguments.other.as_ref().map(|file| compared(file, &arguments.file, &snapshot)).transpose()?;
    let interrupt = Interrupt::default();
    interrupt.listen_to_stop()?;
    let options = PreviewOptions { port: arguments.port, ..PreviewOptions::default() };
    let preview = Preview::of_picture(&options, name(&arguments.file), snapshot, compared)?;
    text::print(&preview.url())?;
    if !arguments.no_open {
        open(&preview.url());
    }
    interrupt.wait();
    Ok(())
}

/// The picture to compare with, which has the size of the first.
fn compared(file: &Path, first: &Path, shown: &Snapshot) -> Result<Compared> {
    let other = Snapshot::of_file(read_exr_layers(file)?);
    let [[w, h], [width, height]] = [other.size(), shown.size()];
    if [w, h] != [width, height] {
        return Err(Error::Usage(format!(
            "{}: the picture has {w}x{h} pixels, {} has {width}x{height}: pictures of one size can be compared",
            file.display(),
            first.display()
        )));
    }
    Ok(Compared::new(name(file), other))
}

fn name(file: &Path) -> String {
    file.file_name().map_or_else(|| "picture".into(), |name| name.to_string_lossy().into_owned())
}

/// Opens the page in the user's browser; where that fails, the address has been printed.
fn open(url: &str) {
    let null = Stdio::null;
    let _ = Command::new("xdg-open").arg(url).stdin(null()).stdout(null()).stderr(null()).spawn();
}
