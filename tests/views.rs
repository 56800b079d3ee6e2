//! Options of the command line for view and focus.

use std::path::Path;

use serde_json::json;
use steradian::internal::color::srgb_from_linear;
use steradian::internal::film::LayerKind;
use steradian::internal::output::read_exr;

use crate::util::program::{run, stderr_of};

fn run_ok(folder: &Path, arguments: &str) {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr_of(&output));
}

fn colors(file: &Path) -> Vec<f32> {
    read_exr(file).unwrap().layer(LayerKind::Color).unwrap().data.clone()
}

/// A sky of middle grey, far beyond a ball out of focus.
fn write_scene(folder: &Path, lens: bool, output: &str) {
    let mut scene = json!({
        "film": { "width": 24, "height": 16 },
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
        "sampler": { "spp": 4 },
        "shapes": [{ "type": "sphere", "radius": 0.5 }],
        "lights": [{ "type": "environment", "radiance": [0.18, 0.18, 0.18] }],
        "outputs": [
            { "file": "a.exr", "pixel_type": "float" }, serde_json::from_str::<serde_json::Value>(output).unwrap()
        ]
    });
    if lens {
        scene["camera"]["lens"] = json!({ "radius": 0.5, "focus_distance": 1.0 });
    }
    std::fs::write(folder.join("view.json"), scene.to_string()).unwrap();
}

#[test]
fn a_png_has_its_view_and_an_exr_none() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let corner = |file: &str| image::open(dir.join(file)).unwrap().into_rgb8().get_pixel(0, 0).0;
    write_scene(dir, false, r#"{ "file": "a.png" }"#);
    run_ok(dir, "render view.json -q");
    let linear = colors(&dir.join("a.exr"));
    assert!(corner("a.png").iter().all(|code| (127..=128).contains(code)), "AgX: middle grey is a half");

    write_scene(dir, false, r#"{ "file": "a.png", "view": "srgb" }"#);
    run_ok(dir, "render view.json -q");
    assert_eq!(colors(&dir.join("a.exr")), linear);
    let bytes = image::open(dir.join("a.png")).unwrap().into_rgb8();
    for (byte, light) in bytes.pixels().flat_map(|pixel| pixel.0).zip(linear.chunks(4).flat_map(|pixel| &pixel[..3])) {
        assert!((f32::from(byte) - 255.0 * srgb_from_linear(*light)).abs() < 1.0, "{byte} {light}");
    }
    // The command line wins; exposure comes before the view.
    run_ok(dir, "render view.json -q --view agx --exposure 1 -o b.png");
    let stop = 1.0f32 / 16.5;
    let expected = 255.0 * (0.5 + 2.0 * stop / (1.0 + 69.862_79 * stop.powf(3.25)).powf(1.0 / 3.25));
    assert!((f32::from(corner("b.png")[1]) - expected).abs() < 1.0, "{:?} {expected}", corner("b.png"));
    // Normals are data: without a tone curve.
    run_ok(dir, "render view.json -q --integrator normal -o n.exr -o n.png --float");
    let (normal, code) = (colors(&dir.join("n.exr")), image::open(dir.join("n.png")).unwrap().into_rgb8());
    let middle = 8 * 24 + 12;
    assert!(
        (f32::from(code.get_pixel(12, 8).0[2]) - 255.0 * srgb_from_linear(normal[4 * middle + 2].min(1.0))).abs() < 1.0
    );
    assert_eq!(run(dir, "render view.json --view film").status.code(), Some(2));
    write_scene(dir, false, r#"{ "file": "a.png", "view": "film" }"#);
    assert_eq!(run(dir, "render view.json").status.code(), Some(3));
}

#[test]
fn without_depth_of_field_a_lens_is_a_pinhole_and_the_file_remembers() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let render = |lens: bool, options: &str, file: &str| {
        write_scene(dir, lens, r#"{ "file": "a.png" }"#);
        run_ok(dir, &format!("render view.json -q --float -o {file} {options}"));
        colors(&dir.join(file))
    };
    let sharp = render(false, "", "sharp.exr");
    let blurred = render(true, "", "blurred.exr");
    assert!(blurred != sharp && render(true, "--no-depth-of-field", "off.exr") == sharp);
    run_ok(dir, "rerender off.exr -o again.exr -q");
    assert!(colors(&dir.join("again.exr")) == sharp);
    // Samples with a lens and without do not go together.
    run_ok(dir, "render view.json -q --shard 1/2 -o 1.shard");
    run_ok(dir, "render view.json -q --shard 2/2 -o 2.shard --no-depth-of-field");
    let merged = run(dir, "merge 1.shard 2.shard -o p.exr");
    assert!(merged.status.code() == Some(6) && stderr_of(&merged).contains("depth_of_field"), "{}", stderr_of(&merged));
}
