//! Builds a scene in code, without any file, changes it, and prints a pixel of both pictures:
//! `cargo run --release --example build_scene`.

use steradian::Renderer;
use steradian::desc::{CameraDesc, LightDesc, MaterialDesc, SceneDesc, ShapeDesc};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = SceneDesc::default()
        .with_camera(CameraDesc::at([0.0, 1.0, 6.0], [0.0, 0.0, 0.0]).with_fov(35.0))
        .with_material("ball", MaterialDesc::diffuse([0.7, 0.1, 0.05]))
        .with_shape(ShapeDesc::sphere(1.0).with_material("ball"))
        .with_shape(ShapeDesc::quad([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]))
        .with_light(LightDesc::environment([0.8, 0.9, 1.0]));
    let mut renderer = Renderer::from_desc(scene).size(64, 48).spp(16);
    println!("red: {:?}", renderer.render()?.image().rgb(32, 24));

    // The accelerator is kept.
    renderer.set_material("ball", MaterialDesc::metal("gold", 0.2));
    println!("gold: {:?}", renderer.render()?.image().rgb(32, 24));
    Ok(())
}
