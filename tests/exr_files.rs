//! EXR files as users get them: every profile from the command line, read back by other programs where these are
//! installed, checked, and rendered again.

use std::path::Path;
use std::process::{Command, Output};

use exr::meta::MetaData;
use exr::prelude::{FlatImage, FlatSamples, ReadChannels, ReadLayers, read};
use serde_json::Value;
use steradian::internal::output::{self, cryptomatte};

/// A red sphere before a quad from a file, lit by a lamp in a group; everything has a name.
const SCENE: &str = r#"{
    "film": { "width": 40, "height": 30 },
    "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 40 },
    "sampler": { "spp": 16 },
    "materials": { "red clay": { "type": "diffuse", "albedo": [0.8, 0.2, 0.1] },
    "chalk": { "type": "diffuse", "albedo": 0.8 } },
    "shapes": [
        { "type": "sphere", "radius": 1, "name": "равнина", "material": "red clay" },
        { "type": "mesh", "file": "wall.obj", "name": "wall", "material": "chalk" }
    ],
    "lights": [
        { "type": "point", "position": [2, 3, 4], "intensity": [20, 20, 20], "group": "key_light" },
        { "type": "environment", "radiance": [0.1, 0.1, 0.1] }
    ]
}"#;

const WALL: &str = "v -1 -1 -2\nv 1 -1 -2\nv 1 2 -2\nv -1 2 -2\nf 1 2 3 4\n";

const ALL_LAYERS: &str = "Z,N,Ng,P,uv,motion,albedo,diffuse_direct,diffuse_indirect,specular_direct,\
                          specular_indirect,transmission_direct,transmission_indirect,volume_direct,\
                          volume_indirect,emission,background,light_groups,variance,samples,feature_albedo,\
                          feature_normal,object_id,material_id,instance_id,crypto_object,crypto_material,\
                          crypto_asset";

const PROFILES: [&str; 4] = ["default", "nuke", "blender", "multipart"];

/// Runs the program in a folder that holds the scene.
fn run(folder: &Path, arguments: &str) -> Output {
    for (name, text) in [("scene.json", SCENE), ("wall.obj", WALL)] {
        if !folder.join(name).exists() {
            std::fs::write(folder.join(name), text).unwrap();
        }
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap()
}

#[track_caller]
fn run_ok(folder: &Path, arguments: &str) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// All channels of all parts: part, name, samples.
fn channels(path: &Path) -> Vec<(usize, String, FlatSamples)> {
    let file: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let parts = file.layer_data.into_iter().enumerate();
    parts
        .flat_map(|(part, layer)| {
            layer.channel_data.list.into_iter().map(move |c| (part, c.name.to_string(), c.sample_data))
        })
        .collect()
}

fn values(path: &Path, name: &str) -> Vec<f32> {
    let all = channels(path);
    let (.., samples) = all.iter().find(|(_, n, _)| n == name).unwrap_or_else(|| panic!("no channel {name}"));
    samples.values_as_f32().collect()
}

/// Renders the scene as `PROFILE.exr` for each profile.
fn render_profiles(dir: &Path) {
    for profile in PROFILES {
        let extra = if profile == "multipart" { " --exr compression=dwaa,crypto_manifest=sidecar" } else { "" };
        run_ok(
            dir,
            &format!(
                "render scene.json -q -o {profile}.exr --spp 4 --layers {ALL_LAYERS} --exr profile={profile}{extra}"
            ),
        );
    }
}

/// Every profile is clean for its own checks and holds the same picture.
#[test]
fn every_profile_is_clean() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    render_profiles(dir);
    for profile in PROFILES {
        let report = run_ok(dir, &format!("check-exr {profile}.exr --profile {profile} --fail-on-warning"));
        assert!(report.contains("clean"), "{report}");
    }
    for profile in ["nuke", "blender"] {
        assert_eq!(values(&dir.join("default.exr"), "G"), values(&dir.join(format!("{profile}.exr")), "G"));
    }
    assert_eq!(values(&dir.join("default.exr"), "P.X"), values(&dir.join("multipart.exr"), "P.X"));
    assert_eq!(values(&dir.join("default.exr"), "Z"), values(&dir.join("blender.exr"), "Depth.Z"));
}

/// The tools of OpenEXR and OpenImageIO find attributes and channels where they belong, and equal pictures.
#[test]
#[ignore = "needs exrheader, oiiotool and idiff: apt install openexr openimageio-tools"]
fn other_programs_read_every_profile() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    render_profiles(dir);
    for profile in PROFILES {
        let header = text(&Command::new("exrheader").arg(dir.join(format!("{profile}.exr"))).output().unwrap().stdout);
        let interop = "colorInteropID (type string): \"lin_rec709_scene\"";
        for expected in [interop, "worldToNDC (type m44f)", "cryptomatte/3ae39a5/name", "steradian/settings"] {
            assert!(header.contains(expected), "{profile}: {expected}");
        }
    }
    // R, G, B, A, Z first: alpha is channel 3, depth channel 4.
    let info =
        text(&Command::new("oiiotool").args(["--info", "-v"]).arg(dir.join("default.exr")).output().unwrap().stdout);
    let list = info.lines().find_map(|line| line.trim().strip_prefix("channel list: ")).unwrap_or_default();
    assert!(list.starts_with("R (half), G (half), B (half), A (half), Z"), "{list}");
    assert!(list.contains("N.X (half), N.Y (half), N.Z (half)") && list.contains("light_key_light.R"), "{list}");
    // Each picture, whose layers have the same names but for motion.
    for file in ["default", "nuke"] {
        let colour = format!("{file}.exr --ch R,G,B,A,Z,N.X,N.Y,N.Z -o {file}_few.exr");
        assert!(Command::new("oiiotool").args(colour.split(' ')).current_dir(dir).status().unwrap().success());
    }
    let same = Command::new("idiff").args(["default_few.exr", "nuke_few.exr"]).current_dir(dir).output().unwrap();
    assert!(same.status.success(), "{}", text(&same.stdout));
}

/// What covers a pixel adds up to its alpha, and names lead to the right pixels.
#[test]
fn mattes_cover_what_they_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    run_ok(
        folder.path(),
        "render scene.json -q -o a.exr --float --layers crypto_object,crypto_material,object_id --transparent",
    );
    let alpha = values(&path, "A");
    let planes: Vec<Vec<f32>> =
        (0..12).map(|i| values(&path, &cryptomatte::channel_name("CryptoObject", i / 4, i % 4))).collect();
    let matte = |name: &str, pixel: usize| -> f32 {
        planes.chunks_exact(2).filter(|pair| pair[0][pixel] == cryptomatte::id(name)).map(|pair| pair[1][pixel]).sum()
    };
    let mut partial = 0;
    for (pixel, alpha) in alpha.iter().enumerate() {
        let [sphere, wall] = ["равнина", "wall"].map(|name| matte(name, pixel));
        assert!((sphere + wall - alpha).abs() < 1e-6, "{pixel}: {sphere} {wall} {alpha}");
        partial += usize::from(sphere > 0.0 && sphere < 1.0);
    }
    let centre = 15 * 40 + 20;
    assert_eq!(matte("равнина", centre), 1.0);
    assert!(matte("wall", 2 * 40 + 20) > 0.99);
    assert!(partial > 20, "{partial}");
    assert_eq!(values(&path, "CryptoMaterial00.r")[centre], cryptomatte::id("red clay"));
    let [object, wall, nothing] = [centre, 2 * 40 + 20, 0].map(|pixel| values(&path, "object_id.id")[pixel]);
    assert_eq!((object > 0.0, wall > 0.0, object != wall, nothing), (true, true, true, 0.0));
}

#[test]
fn windows_are_those_of_crops_and_overscan() {
    let folder = tempfile::tempdir().unwrap();
    let window = |arguments: &str| {
        run_ok(folder.path(), &format!("render scene.json -q -o a.exr --spp 1 {arguments}"));
        let header = MetaData::read_from_file(folder.path().join("a.exr"), false).unwrap().headers.remove(0);
        let (data, display) = (header.data_window(), header.shared_attributes.display_window);
        assert_eq!((display.position.0, display.position.1, display.size.0, display.size.1), (0, 0, 40, 30));
        let original = header.own_attributes.original_data_window.map(|w| (w.position.0, w.size.0));
        (data.position.0, data.position.1, data.size.0, data.size.1, original)
    };
    assert_eq!(window("--crop 5,6,20,10"), (5, 6, 20, 10, None));
    assert_eq!(window("--crop 5,6,20,10 --exr uncropped=true"), (0, 0, 40, 30, Some((5, 20))));
    assert_eq!(window("--overscan 4"), (-4, -4, 48, 38, None));
    assert_eq!(window("--overscan 4 --exr uncropped=true"), (0, 0, 40, 30, Some((-4, 48))));
}

/// The picture of a file is rendered again bit for bit, and what has changed is named.
#[test]
fn a_file_is_rendered_again() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let options =
        "--spp 5 --seed 7 --crop 3,4,30,20 --max-depth 3 --layers Z,albedo,crypto_object --float --exr crypto_depth=4";
    run_ok(dir, &format!("render scene.json -q -o a.exr -o a.png --stats stats.json --threads 2 {options}"));
    let quiet = run(dir, "rerender a.exr -o b.exr -q --threads 1");
    assert!(quiet.status.success() && quiet.stderr.is_empty() && quiet.stdout.is_empty(), "{}", text(&quiet.stderr));
    assert_eq!(channels(&dir.join("a.exr")), channels(&dir.join("b.exr")));
    // And again from the second.
    run_ok(dir, "rerender b.exr -q -o b2.exr");
    assert_eq!(channels(&dir.join("a.exr")), channels(&dir.join("b2.exr")));
    assert_ne!(channels(&dir.join("a.exr")).len(), 4);

    std::fs::write(dir.join("wall.obj"), WALL.replace("v 1 2 -2", "v 1 1 -2")).unwrap();
    let refused = run(dir, "rerender a.exr -o c.exr -q");
    assert_eq!(refused.status.code(), Some(6), "{}", text(&refused.stderr));
    assert!(
        text(&refused.stderr).contains("wall.obj") && text(&refused.stderr).contains("--allow-changed"),
        "{}",
        text(&refused.stderr)
    );
    assert!(!dir.join("c.exr").exists());
    run_ok(dir, "rerender a.exr -o c.exr -q --allow-changed");
    assert_ne!(channels(&dir.join("a.exr")), channels(&dir.join("c.exr")));

    std::fs::write(dir.join("wall.obj"), WALL).unwrap();
    std::fs::write(dir.join("scene.json"), SCENE.replace("\"radius\": 1", "\"radius\": 0.5")).unwrap();
    let refused = run(dir, "rerender a.exr -o c.exr -q");
    assert!(text(&refused.stderr).contains("description"), "{}", text(&refused.stderr));
    std::fs::remove_file(dir.join("scene.json")).unwrap();
    std::fs::write(dir.join("moved.json"), SCENE).unwrap();
    run_ok(dir, "rerender a.exr -o d.exr -q --scene moved.json");
    assert_eq!(channels(&dir.join("a.exr")), channels(&dir.join("d.exr")));
}

#[test]
fn checks_have_their_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    run_ok(dir, "render scene.json -q -o a.exr --spp 1 --layers Z");
    std::fs::write(dir.join("broken.exr"), "no picture").unwrap();
    let bytes = |name: &str, change: fn(&mut Vec<u8>)| {
        let mut bytes = std::fs::read(dir.join("a.exr")).unwrap();
        change(&mut bytes);
        std::fs::write(dir.join(name), bytes).unwrap();
    };
    // An unknown colour space is worth a warning, a matrix that is not affine an error.
    bytes("warning.exr", |bytes| replace(bytes, b"lin_rec709_scene", b"lin_rec709_seene"));
    bytes("error.exr", |bytes| {
        // The last column of the first row is no zero.
        let name = b"worldToCamera\0m44f\0";
        let start = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
        bytes[start + 12..start + 16].copy_from_slice(&5.0f32.to_le_bytes());
    });
    for (arguments, code) in [
        ("check-exr a.exr", 0),
        ("check-exr a.exr --profile nuke", 0),
        ("check-exr warning.exr", 0),
        ("check-exr error.exr a.exr", 1),
        ("check-exr warning.exr a.exr --fail-on-warning", 1),
        ("check-exr broken.exr", 3),
        ("check-exr missing.exr", 4),
        ("check-exr", 2),
        ("rerender broken.exr -o new.exr", 3),
        ("rerender a.exr", 2),
        ("render scene.json -o b.exr --layers N --exr compression=dwaa", 2),
        ("render scene.json -o b.exr --layers crypto_object --exr crypto_depth=5", 2),
        ("render scene.json -o b.png --exr uncropped=true", 2),
    ] {
        let output = run(dir, arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {}{}", text(&output.stdout), text(&output.stderr));
    }
    let many = text(&run(dir, "check-exr error.exr a.exr error.exr a.exr").stdout);
    assert!(
        many.starts_with("2 files: clean")
            && many.contains("error matrix-rows: 2 times in 1 of 4 files\n    error.exr:"),
        "{many}"
    );
    let json: Value = serde_json::from_str(&run_ok(dir, "check-exr warning.exr --json")).unwrap();
    assert_eq!(json[0]["findings"][0]["rule"], "color-id");
    assert_eq!(json[0]["findings"][0]["severity"], "warning");
    let refused = text(&run(dir, "render scene.json -o b.exr --layers N --exr compression=dwaa").stderr);
    assert!(refused.contains("layer N") && refused.contains("multipart"), "{refused}");
    // A picture of others without our attribute is no recipe.
    let plain = output::write_exr(
        &dir.join("plain.exr"),
        &steradian::internal::film::Image::of_color([1, 1], vec![1.0; 4]),
        &steradian::desc::OutputDesc::new("plain.exr"),
        &output::RenderInfo::default(),
    );
    plain.unwrap();
    assert_eq!(run(dir, "rerender plain.exr -o new.exr").status.code(), Some(3));
}

fn replace(bytes: &mut [u8], from: &[u8], to: &[u8]) {
    let place = bytes.windows(from.len()).position(|window| window == from).unwrap();
    bytes[place..place + to.len()].copy_from_slice(to);
}
