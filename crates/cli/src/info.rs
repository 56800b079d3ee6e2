//! `steradian info`.

use std::path::Path;

use serde_json::{Map, Value, json};
use steradian::desc::{CameraKindDesc, SceneDesc};
use steradian::internal::assets::{AssetError, list_vdb};
use steradian::internal::compile;
use steradian::internal::compile::Summary;
use steradian::internal::render::{Overrides, Settings, film_bytes_per_pixel};
use steradian::internal::scene::Scene;
use steradian::{Error, Result};

use crate::args::InfoArgs;
use crate::scene;
use crate::text;

/// The file of a scene without outputs, which is never written.
const UNUSED: &str = "unused.exr";

/// Prints what is in a scene, or which grids a file of OpenVDB or NanoVDB has.
pub fn run(arguments: &InfoArgs) -> Result<()> {
    let extension = arguments.scene.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    if extension.is_some_and(|extension| extension == "vdb" || extension == "nvdb") {
        let value = grids(&arguments.scene)?;
        return if arguments.json { text::print_json(&value) } else { text::print(&text::outline(&value)) };
    }
    let imported = scene::load(&arguments.scene, &arguments.import, arguments.verbosity)?;
    let scene = compile::compile_from(&imported.desc, imported.source(&arguments.scene))?;
    let overrides = Overrides { default_outputs: vec![UNUSED.into()], ..Overrides::default() };
    let settings = Settings::new(&imported.desc, &overrides)?;
    let mut value: Value = serde_json::to_value(Summary::new(&scene)).map_err(|e| Error::Internal(e.to_string()))?;
    value["picture"] = picture(&settings);
    value["camera"] = camera(&imported.desc, &scene);
    value["cost"] = cost(&scene, &settings);
    if arguments.json { text::print_json(&value) } else { text::print(&for_people(value)) }
}

/// The grids of a file with the types of their values.
fn grids(file: &Path) -> Result<Value> {
    let grids = list_vdb(file).map_err(|error| match error {
        AssetError::Missing { file, message } => Error::Missing { file, message },
        AssetError::Malformed(message) => Error::Malformed { file: file.into(), message },
    })?;
    let grids: Map<String, Value> = grids.into_iter().map(|(name, kind)| (name, kind.into())).collect();
    Ok(json!({ "grids": grids }))
}

/// Size, samples and algorithm of a render without options.
fn picture(settings: &Settings) -> Value {
    let integrator = serde_json::to_value(settings.integrator).unwrap_or_default();
    let files = settings.outputs.iter().map(|output| output.file.as_str());
    let mut picture = json!({
        "size": settings.size,
        "samples_per_pixel": settings.spp,
        "sampler": settings.sampler,
        "integrator": integrator["type"],
        "outputs": files.filter(|file| *file != UNUSED).collect::<Vec<_>>(),
    });
    if let Some(depth) = integrator.get("max_depth") {
        picture["max_depth"] = depth.clone();
    }
    if pixel_count(settings) != u64::from(settings.size[0]) * u64::from(settings.size[1]) {
        let crop = settings.crop;
        picture["crop"] = json!([crop.x, crop.y, crop.width, crop.height]);
    }
    picture
}

fn pixel_count(settings: &Settings) -> u64 {
    u64::from(settings.crop.width) * u64::from(settings.crop.height)
}

fn camera(desc: &SceneDesc, scene: &Scene) -> Value {
    let camera = &scene.camera;
    let mut value = json!({
        "type": desc.camera.kind,
        "position": camera.render_space().world_point(camera.position()).to_array(),
        "direction": camera.axis().to_array(),
    });
    if desc.camera.kind == CameraKindDesc::Perspective {
        value["vertical_fov_degrees"] = desc.camera.vertical_fov_degrees.unwrap_or(40.0).into();
    }
    value
}

/// What follows from the scene alone: how long a render takes depends on the machine and on where paths go.
fn cost(scene: &Scene, settings: &Settings) -> Value {
    let pixels = pixel_count(settings);
    json!({
        "camera_rays": pixels * u64::from(settings.spp),
        "geometry_bytes": scene.geometry.memory_bytes(),
        "voxel_bytes": scene.media.voxel_bytes(),
        "film_bytes": pixels * film_bytes_per_pixel(scene, settings) as u64,
    })
}

/// Numbers rounded, with units; what is asked for first, then what is in the scene, and what it will cost.
fn for_people(mut value: Value) -> String {
    if let Some(map) = value.as_object_mut() {
        map.remove("geometry_bytes");
        map.retain(|_, value| !value.as_array().is_some_and(Vec::is_empty) && !value.is_null());
        if let Some([low, high]) = map.get("bounds").and_then(Value::as_array).map(Vec::as_slice) {
            let bounds = format!("{} to {}", triple(low), triple(high));
            map.insert("bounds".into(), bounds.into());
        }
        if let Some(features) = map.get("features").and_then(Value::as_array) {
            let names: Vec<&str> = features.iter().filter_map(Value::as_str).collect();
            map.insert("features".into(), names.join(", ").into());
        }
    }
    if let [width, height] = value["picture"]["size"].as_array().map_or(&[][..], Vec::as_slice) {
        value["picture"]["size"] = format!("{width} x {height} pixels").into();
    }
    if value["picture"]["outputs"].as_array().is_some_and(Vec::is_empty) {
        value["picture"]["outputs"] = "SCENE.exr and SCENE.png, unless -o is given".into();
    }
    if let Some(angle) = value["camera"]["vertical_fov_degrees"].as_f64() {
        value["camera"]["vertical_fov_degrees"] = rounded(angle).into();
    }
    for key in ["position", "direction"] {
        value["camera"][key] = triple(&value["camera"][key]).into();
    }
    let cost = &value["cost"];
    let number = |key: &str| cost[key].as_u64().unwrap_or(0);
    let voxels = number("voxel_bytes");
    let mut cost = json!({
        "camera_rays": scaled(number("camera_rays"), ["", " thousand", " million", " billion"]),
        "geometry": scaled(number("geometry_bytes"), [" bytes", " kB", " MB", " GB"]),
        "film": scaled(number("film_bytes"), [" bytes", " kB", " MB", " GB"]),
    });
    if voxels > 0 {
        cost["voxels"] = scaled(voxels, [" bytes", " kB", " MB", " GB"]).into();
    }
    value["cost"] = cost;
    let [picture, camera, cost] = ["picture", "camera", "cost"].map(|key| {
        let section = value.as_object_mut().and_then(|map| map.remove(key));
        json!({ key: section })
    });
    [picture, camera, value, cost].map(|section| text::outline(&section)).join("\n")
}

fn triple(value: &Value) -> String {
    let numbers = value.as_array().map_or(&[][..], Vec::as_slice);
    let rounded = numbers.iter().filter_map(Value::as_f64).map(rounded);
    format!("[{}]", rounded.collect::<Vec<_>>().join(", "))
}

/// Four significant digits; what is below a millionth is rounding.
fn rounded(number: f64) -> String {
    if number.abs() < 1e-6 {
        return "0".to_owned();
    }
    let digits = (3.0 - number.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{number:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number in the largest of these units, each 1000 times the one before, in which it is at least 1.
fn scaled(number: u64, units: [&str; 4]) -> String {
    let mut scaled = number as f64;
    let mut unit = 0;
    while scaled >= 1000.0 && unit + 1 < units.len() {
        scaled /= 1000.0;
        unit += 1;
    }
    format!("{}{}", rounded(scaled), units[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_have_units() {
        for (number, text) in
            [(-1.000_000_119, "-1"), (-1.4e-45, "0"), (0.123_456, "0.1235"), (123_456.0, "123456"), (12.5, "12.5")]
        {
            assert_eq!(rounded(number), text);
        }
        let units = [" bytes", " kB", " MB", " GB"];
        assert_eq!(
            [0, 999, 5432, 19_660_800].map(|n| scaled(n, units)),
            ["0 bytes", "999 bytes", "5.432 kB", "19.66 MB"]
        );
    }
}
