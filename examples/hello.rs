//! Renders a scene file to an EXR file: `cargo run --release --example hello -- scenes/cornell.json cornell.exr`.

use steradian::Renderer;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(scene), Some(picture)) = (words.next(), words.next()) else {
        return Err("usage: hello SCENE PICTURE".into());
    };
    // Steradian's own JSON, Mitsuba 3 XML, pbrt-v4 or glTF, by the file's extension.
    Renderer::open(scene)?.spp(16).render()?.save(picture)?;
    Ok(())
}
