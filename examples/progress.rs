//! Shows progress and stops a render early: `cargo run --release --example progress -- scenes/cornell.json`.

use steradian::Renderer;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = std::env::args().nth(1).ok_or("usage: progress SCENE")?;
    let renderer = Renderer::open(scene)?.spp(64);
    let stop = renderer.stop_handle();
    let mut renderer = renderer.on_progress(move |share| {
        eprint!("\r{:3.0} %", 100.0 * share);
        if share >= 0.5 {
            // The pass under way is finished; the picture has the samples taken so far.
            stop.stop();
        }
    });
    let rendering = renderer.render()?;
    eprintln!();
    let ([width, height], stats) = (rendering.image().size, rendering.stats());
    println!("{width} x {height} pixels, {} samples per pixel", stats.spp_done);
    Ok(())
}
