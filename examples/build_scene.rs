//! Builds a scene in code, without any file, and prints a pixel: `cargo run --release --example build_scene`.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use steradian::desc::{
    CameraDesc, ColorDesc, EnvironmentLightDesc, FilmDesc, LightDesc, MaterialDesc, QuadDesc, SamplerDesc, ScalarDesc,
    SceneDesc, ShapeDesc, SphereDesc,
};
use steradian::render::{self, Overrides, Settings, Silent};
use steradian::{accel, compile};

fn scene() -> SceneDesc {
    let red = MaterialDesc::Diffuse { albedo: ColorDesc::Rgb([0.7, 0.1, 0.05]), roughness: ScalarDesc::Constant(0.0) };
    let ball = SphereDesc { material: Some("red".into()), ..SphereDesc::new(1.0, None, None, 360.0) };
    let floor = QuadDesc::new([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]);
    let sky =
        EnvironmentLightDesc { radiance: Some([0.8, 0.9, 1.0]), file: None, scale: 1.0, transform: None, group: None };
    SceneDesc {
        film: FilmDesc { width: 64, height: 48, ..FilmDesc::default() },
        camera: CameraDesc {
            position: Some([0.0, 1.0, 6.0]),
            look_at: Some([0.0, 0.0, 0.0]),
            vertical_fov_degrees: Some(35.0),
            ..CameraDesc::default()
        },
        sampler: SamplerDesc { spp: 16, ..SamplerDesc::default() },
        materials: [("red".to_owned(), red)].into(),
        shapes: vec![ShapeDesc::Sphere(ball), ShapeDesc::Quad(floor)],
        lights: vec![LightDesc::Environment(sky)],
        ..SceneDesc::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let desc = scene();
    // Meshes and images would be looked up beside this file; errors name it.
    let scene = compile::compile(&desc, Path::new("scene"))?;
    let settings =
        Settings::new(&desc, &Overrides { default_outputs: vec!["scene.exr".into()], ..Overrides::default() })?;
    let accel = accel::build(settings.accel, &scene.geometry, settings.threads)?;
    let image = render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.image;
    println!("linear RGB in the middle: {:?}", image.rgb(image.size[0] / 2, image.size[1] / 2));
    Ok(())
}
