//! `steradian info`.

use serde_json::Value;
use steradian::compile::Summary;
use steradian::{Error, Result, compile, import};

use crate::args::InfoArgs;
use crate::text;

/// Prints what is in a scene.
pub fn run(arguments: &InfoArgs) -> Result<()> {
    let desc = import::load_scene(&arguments.scene)?;
    let scene = compile::compile(&desc, &arguments.scene)?;
    let value: Value = serde_json::to_value(Summary::new(&scene)).map_err(|e| Error::Internal(e.to_string()))?;
    if arguments.json { text::print_json(&value) } else { text::print(&text::outline(&value)) }
}
