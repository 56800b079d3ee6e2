//! Renders a scene file to an EXR file: `cargo run --release --example hello -- scenes/cornell.json cornell.exr`.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use steradian::desc::OutputDesc;
use steradian::import::{self, ImportOptions};
use steradian::output::{self, RenderInfo};
use steradian::render::{self, Overrides, Settings, Silent};
use steradian::{accel, compile};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(scene_file), Some(picture)) = (words.next(), words.next()) else {
        return Err("usage: hello SCENE PICTURE".into());
    };
    let scene_file = Path::new(&scene_file);

    // Steradian's own JSON, Mitsuba 3 XML, pbrt-v4 or glTF, by the file's extension.
    let imported = import::read_scene(scene_file, &ImportOptions::default())?;
    let settings =
        Settings::new(&imported.desc, &Overrides { spp: Some(16), outputs: vec![picture], ..Overrides::default() })?;
    let scene = compile::compile_from(&imported.desc, imported.source(scene_file))?;
    let accel = accel::build(settings.accel, &scene.geometry, settings.threads)?;
    let rendered = render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?;
    for OutputDesc { file, .. } in &settings.outputs {
        output::write(&OutputDesc::new(file), &rendered.image, &RenderInfo::default())?;
    }
    Ok(())
}
