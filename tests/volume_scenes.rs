//! Scenes with grids of OpenVDB and NanoVDB files: where they are, what is refused, pbrt's media of such files, copies.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::assets::{GridChoice, read_rgb_image, read_vdb};
use steradian::internal::convert::{Originals, write_scene};
use steradian::internal::import::{ImportOptions, read_scene};
use steradian::internal::math::{DVec3, Rng};
use steradian::internal::medium::Coefficients;
use steradian::internal::output::FileUses;
use steradian::internal::scene::Scene;

use crate::bad_input::assert_error;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::program::{run, stderr_of};
use crate::util::root;

/// A folder with a file of the same name.
fn folder_with(files: &[&str]) -> Folder {
    let folder = Folder::new();
    for file in files {
        folder.write(file, std::fs::read(root().join("tests/regressions/vdb").join(file)).unwrap());
    }
    folder
}

fn grid(file: &str) -> Value {
    json!({ "type": "grid", "file": file })
}

/// A medium around everything.
fn scene(volume: &Value) -> Value {
    let mut scene = good_scene();
    set(&mut scene, "media.fog", json!({ "scattering": 1, "emission": 1, "volume": volume }));
    set(&mut scene, "medium", json!("fog"));
    scene
}

/// The coefficients of the medium around everything at a point of the world.
fn at(scene: &Scene, p: DVec3) -> Coefficients {
    let space = scene.camera.render_space();
    let medium = scene.media.surroundings().unwrap();
    let Coefficients { absorption, scattering, emission } =
        scene.media.volume(medium).unwrap().coefficients(medium, space.point(p));
    let [absorption, scattering, emission] = [absorption, scattering, emission].map(|c| c * space.scale() as f32);
    Coefficients { absorption, scattering, emission }
}

/// The octahedron of the files at whole index coordinates, as `tools/vdb_files.py` writes it.
fn voxel([x, y, z]: [i64; 3]) -> f64 {
    let is_inside = (x + 12).abs() + (y + 20).abs() + (z + 11).abs() <= 9;
    if is_inside { (7 * x + 13 * y + 29 * z).rem_euclid(64) as f64 / 64.0 } else { 0.0 }
}

/// Between them.
fn interpolated(index: DVec3) -> f64 {
    let low = index.floor();
    let [x, y, z] = low.to_array().map(|x| x as i64);
    let f = index - low;
    let weight = |d: i64, f: f64| if d == 0 { 1.0 - f } else { f };
    let corners = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2]);
    corners.map(|[a, b, c]| weight(a, f.x) * weight(b, f.y) * weight(c, f.z) * voxel([x + a, y + b, z + c])).sum()
}

#[test]
fn volumes_are_where_their_files_place_them() {
    let folder = folder_with(&["fire.vdb", "fire_zip.nvdb", "turned.vdb"]);
    let mut rng = Rng::new(2);
    let moved = json!({ "density": grid("fire.vdb"), "transform": { "translate": [100, 0, 0] } });
    let boxed = json!({ "density": grid("fire.vdb"), "bounds": [[0, 0, 0], [21, 21, 21]] });
    for (volume, world_from_index) in [
        (json!({ "density": grid("fire.vdb") }), (|p| p * 0.5 + DVec3::new(1.0, 2.0, 3.0)) as fn(DVec3) -> DVec3),
        (json!({ "density": grid("fire_zip.nvdb") }), |p| p * 0.5 + DVec3::new(1.0, 2.0, 3.0)),
        (moved, |p| p * 0.5 + DVec3::new(101.0, 2.0, 3.0)),
        (json!({ "density": grid("turned.vdb") }), |p| DVec3::new(p.z - 1.0, 0.25 * p.x, 0.5 * p.y + 2.0)),
        // The box of the active voxels and one around them, from -22.5 on.
        (boxed, |p| p + DVec3::new(22.5, 30.5, 21.5)),
    ] {
        let compiled = folder.compile(&scene(&volume)).unwrap();
        for _ in 0..200 {
            let index =
                DVec3::new(-22.4, -30.4, -21.4) + 20.8 * (0.5 * rng.cube() + 0.5).clamp(DVec3::ZERO, DVec3::ONE);
            let found = at(&compiled, world_from_index(index)).scattering.g;
            assert!((f64::from(found) - interpolated(index)).abs() < 2e-4, "{volume} {index}: {found}");
        }
    }
}

#[test]
fn grids_of_unlike_boxes_stay_aligned() {
    let folder = folder_with(&["fire.vdb", "several.vdb", "turned.vdb"]);
    let fire = json!({
        "density": grid("fire.vdb"), "temperature": grid("fire.vdb"), "temperature_scale": 2000
    });
    let compiled = folder.compile(&scene(&fire)).unwrap();
    let world = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * 0.5 + DVec3::new(1.0, 2.0, 3.0);
    // The heat is an octahedron of radius 3 around (-10, -18, -9) within the smoke.
    let heat = |p: [i64; 3]| if (p[0] + 10).abs() + (p[1] + 18).abs() + (p[2] + 9).abs() <= 3 { voxel(p) } else { 0.0 };
    let mut glowing = 0;
    for i in 0..7 * 7 * 7 {
        let p = [i % 7 - 13, i / 7 % 7 - 21, i / 49 - 12];
        let [x, y, z] = p.map(|x| x as f64);
        let found = at(&compiled, world(x, y, z));
        // Below 1,000 K or so nothing is left in `f32` to compare.
        let is_hot = heat(p) > 0.5 && voxel(p) > 0.0;
        assert!((f64::from(found.scattering.r) - voxel(p)).abs() < 2e-4, "{p:?} {found:?}");
        assert!(!is_hot || found.emission.r > 1e-3, "{p:?} {found:?}");
        assert!(heat(p) > 0.0 || found.emission.r < 1e-6, "{p:?} {found:?}");
        glowing += u32::from(is_hot);
    }
    assert!(glowing > 10, "{glowing}");
    // The box is that of both: as large as that of the smoke alone.
    let alone = folder.compile(&scene(&json!({ "density": grid("fire.vdb") }))).unwrap();
    assert!(alone.media.voxel_bytes() == 4 * 21 * 21 * 21 && compiled.media.voxel_bytes() > alone.media.voxel_bytes());
    let turned = json!({ "density": grid("fire.vdb"), "emission": grid("turned.vdb") });
    let place = "media.fog.volume.emission: ";
    assert_error(
        &folder,
        &scene(&turned),
        ErrorKind::Scene,
        &[place, "other axes than that of media.fog.volume.density"],
    );
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = folder_with(&["fire.vdb", "several.vdb", "colours.vdb", "masks.vdb", "level_set.vdb"]);
    folder.write("bad.vdb", "no volume");
    folder.write("short.nvdb", "NanoVDB0");
    let with = |mut grid: Value, key: &str, value: Value| {
        grid[key] = value;
        json!({ "density": grid })
    };
    let density = "media.fog.volume.density";
    for (volume, expected) in [
        (with(grid("fire.vdb"), "grid", json!("smoke")), &["no grid named \"smoke\"", "\"temperature\" (float)"][..]),
        (with(grid("fire.vdb"), "resolution", json!([21, 21, 21])), &["leave them out"]),
        (with(grid("a.raw"), "grid", json!("density")), &["density.grid: ", ".vdb or .nvdb"]),
        (json!({ "density": grid("several.vdb") }), &["several grids named \"density\"", "\"density[1]\""]),
        (json!({ "density": grid("colours.vdb") }), &["one number a voxel"]),
        (json!({ "density": grid("level_set.vdb") }), &["level_set.vdb", "is a level set"]),
        (json!({ "density": grid("bad.vdb") }), &["bad.vdb", "neither an OpenVDB nor a NanoVDB file"]),
        (json!({ "density": grid("short.nvdb") }), &["short.nvdb", "ends early"]),
    ] {
        assert_error(&folder, &scene(&volume), ErrorKind::Scene, &[&[density], expected].concat());
    }
    assert_error(&folder, &scene(&json!({ "density": grid("gone.vdb") })), ErrorKind::AssetMissing, &["gone.vdb"]);
    // Values below 0 are 0.
    let compiled = folder.compile(&scene(&json!({ "density": grid("masks.vdb") }))).unwrap();
    assert_eq!(at(&compiled, DVec3::new(8.0, 0.0, 0.0)).scattering.g, 0.0);
    assert_eq!(at(&compiled, DVec3::new(57.0, 8.0, 8.0)).scattering.g, 0.25);
}

#[test]
fn nanovdb_media_of_pbrt_have_density_and_temperature() {
    let folder = folder_with(&["fire_zip.nvdb", "blosc.nvdb", "several_zip.nvdb"]);
    let read = |text: &str| {
        let medium = format!("WorldBegin\nMakeNamedMedium \"fire\" \"string type\" \"nanovdb\" {text}\n");
        let shape = "MediumInterface \"fire\" \"\"\nMaterial \"interface\"\nShape \"sphere\"";
        read_scene(&folder.write("s.pbrt", format!("{medium}{shape}")), &ImportOptions::default())
    };
    let found = read("\"string filename\" \"blosc.nvdb\" \"rgb sigma_a\" [1 2 3] \"float scale\" 2").unwrap();
    let medium = serde_json::to_value(&found.desc.media["fire"]).unwrap();
    let density = json!({ "type": "grid", "file": "blosc.nvdb", "grid": "density" });
    let volume = &medium["volume"];
    assert_eq!((&volume["density"], volume.get("bounds"), volume.get("emission")), (&density, None, None));
    assert_eq!((&medium["absorption"], &medium["scattering"]), (&json!([2.0, 4.0, 6.0]), &json!([2.0, 2.0, 2.0])));

    let text = "\"string filename\" \"fire_zip.nvdb\" \"float temperaturescale\" 4000 \"float temperaturecutoff\" 0.25 \
                \"float Lescale\" 2";
    let found = read(text).unwrap();
    let medium = serde_json::to_value(&found.desc.media["fire"]).unwrap();
    assert_eq!(medium["emission"], json!([1.0, 1.0, 1.0]));
    let glow = &found.assets.volumes[medium["volume"]["emission"]["file"].as_str().unwrap()];
    let choice = GridChoice { name: Some("temperature"), default: "" };
    let heat = read_vdb(&folder.path("fire_zip.nvdb"), choice).unwrap();
    assert_eq!((glow.resolution, glow.channels), ([21; 3], 3));
    let mut bright = 0;
    for (i, color) in glow.values.as_chunks::<3>().0.iter().enumerate() {
        let p = [i % 21, i / 21 % 21, i / 441].map(|x| x as i64);
        // The temperature's box begins at (-14, -22, -13), that of the density at (-22, -30, -21).
        let q = p.map(|x| x - 8);
        let is_inside = q.iter().all(|x| (0..9).contains(x));
        let number = if is_inside { ((q[2] * 9 + q[1]) * 9 + q[0]) as usize } else { 0 };
        let kelvin = (heat.voxels.values[number] - 0.25) * 4000.0;
        // Up to 100 K nothing is emitted, and little more than that is nothing in `f32`.
        assert!(color[0] == 0.0 || kelvin > 100.0, "{p:?} {kelvin} {color:?}");
        assert!(color[0] > 0.0 || kelvin < 500.0, "{p:?} {kelvin} {color:?}");
        assert!(color.iter().all(|c| *c <= 2.5), "{color:?}");
        bright += usize::from(color[0] > 0.0);
    }
    assert!(bright > 10, "{bright}");
    for (text, expected) in
        [("", "filename"), ("\"string filename\" \"several_zip.nvdb\"", "several grids named \"density\"")]
    {
        let error = read(text).err().unwrap().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn media_without_their_files_are_empty_where_that_is_allowed() {
    let folder = Folder::new();
    let ball = |density: &Value| {
        json!({ "film": { "width": 4, "height": 4 }, "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0] },
            "sampler": { "spp": 1 }, "lights": [{ "type": "environment", "radiance": [0.5, 0.5, 0.5] }],
            "media": { "fog": { "absorption": 9, "emission": 5, "volume": { "density": density } } },
            "materials": { "m": { "type": "dielectric", "ior": 1, "medium": "fog" } },
            "shapes": [{ "type": "sphere", "radius": 5, "material": "m" }] })
    };
    for (name, file) in [("a", "gone.vdb"), ("b", "gone.nvdb"), ("c", "gone.vol"), ("d", "gone.raw")] {
        let mut density = grid(file);
        if name == "d" {
            density["resolution"] = json!([2, 2, 2]);
        }
        folder.write(&format!("{name}.json"), ball(&density).to_string());
    }
    let xml = r#"<scene version="3.0.0"><integrator type="volpath"/><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
        <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter><shape type="sphere">
        <float name="radius" value="5"/><bsdf type="null"/><medium type="heterogeneous" name="interior">
        <volume type="gridvolume" name="sigma_t"><string name="filename" value="gone.vol"/></volume>
        </medium></shape></scene>"#;
    folder.write("e.xml", xml);
    let pbrt = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nCamera \"perspective\"\nWorldBegin\n\
                LightSource \"infinite\" \"rgb L\" [0.5 0.5 0.5]\nMakeNamedMedium \"m\" \"string type\" \"nanovdb\" \
                \"string filename\" \"gone.nvdb\" \"rgb sigma_a\" [9 9 9]\nMediumInterface \"m\" \"\"\n\
                Material \"interface\"\nShape \"sphere\" \"float radius\" 5\n";
    folder.write("f.pbrt", pbrt);
    for name in ["a.json", "b.json", "c.json", "d.json", "e.xml", "f.pbrt"] {
        let output = run(folder.path("").as_path(), &format!("render {name} --spp 1 -o a.exr"));
        let words = stderr_of(&output);
        assert_eq!(output.status.code(), Some(4), "{name}: {words}");
        assert!(words.contains("gone."), "{name}: {words}");
        let output = run(folder.path("").as_path(), &format!("render {name} --spp 1 -o a.exr --allow-missing"));
        let words = stderr_of(&output);
        assert!(output.status.success() && words.contains("no file gone."), "{name}: {words}");
        let pixel = read_rgb_image(&folder.path("a.exr")).unwrap().pixels[5];
        assert!(pixel.iter().all(|c| (c - 0.5).abs() < 1e-3), "{name}: {pixel:?}");
    }
}

#[test]
fn copies_of_scenes_have_their_volume_files() {
    let folder = folder_with(&["fire.vdb", "fire_zip.nvdb"]);
    let volume = json!({ "density": grid("fire.vdb"), "temperature": grid("fire_zip.nvdb") });
    let path = folder.write("scene.json", scene(&volume).to_string());
    let imported = read_scene(&path, &ImportOptions::default()).unwrap();
    std::fs::create_dir(folder.path("copy")).unwrap();
    let target = folder.path("copy/scene.json");
    write_scene(&imported, &path, &target, Originals::Copy, FileUses::default()).unwrap();
    let copied = read_scene(&target, &ImportOptions::default()).unwrap();
    let mut desc = copied.desc;
    let names: Vec<String> = desc.files_mut().iter().map(|file| file.name.clone()).collect();
    assert_eq!(names.len(), 2);
    for name in names {
        assert!(folder.path("copy").join(&name).is_file(), "{name}");
    }
    folder.write("fire.vdb", "a secret");
    let error = write_scene(&imported, &path, &target, Originals::Copy, FileUses::default()).unwrap_err();
    assert!(error.to_string().contains("this is no VDB file"), "{error}");
}
