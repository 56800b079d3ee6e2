//! `steradian info`.

use serde_json::Value;
use steradian::compile::Summary;
use steradian::{Error, Result, compile};

use crate::args::InfoArgs;
use crate::scene;
use crate::text;

/// Prints what is in a scene.
pub fn run(arguments: &InfoArgs) -> Result<()> {
    let imported = scene::load(&arguments.scene, &arguments.import, arguments.verbosity)?;
    let scene = compile::compile_from(&imported.desc, imported.source(&arguments.scene))?;
    let value: Value = serde_json::to_value(Summary::new(&scene)).map_err(|e| Error::Internal(e.to_string()))?;
    if arguments.json { text::print_json(&value) } else { text::print(&text::outline(&value)) }
}
