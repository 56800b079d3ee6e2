//! Denoising. Tests that need Intel Open Image Denoise are ignored by default: `cargo test -- --include-ignored`.

use std::path::Path;
use std::process::{Command, Output};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, LayerAttributes, ReadChannels, ReadLayers, Vec2,
    WritableImage, f16,
};
use serde_json::{Value, json};
use steradian::internal::denoise::{
    Denoiser, FEATURE_LAYERS, Feature, FileOptions, Report, denoise_file, denoise_image,
};
use steradian::internal::film::{Image, Layer, LayerInfo, LayerKind};
use steradian::internal::output;

use crate::util::render::{merge, render};

fn denoiser(threads: usize) -> Denoiser {
    Denoiser::open(None, threads).unwrap()
}

fn run(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian"))
        .current_dir(folder)
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Mean of (test - reference)² / (reference² + 0.01), as `steradian compare` has it.
fn relmse(reference: &Image, test: &Image) -> f64 {
    output::compare(reference, test).unwrap().relmse
}

/// A picture of one layer of colour.
fn picture(size: [u32; 2], pixel: impl Fn(u32, u32) -> [f32; 4]) -> Image {
    Image::of_color(size, (0..size[0] * size[1]).flat_map(|i| pixel(i % size[0], i / size[0])).collect())
}

/// A room of coloured walls with a diffuse and a glossy box, lit by two lamps of two groups.
fn room(spp: u32, layers: &[&str]) -> Value {
    let quad = |origin: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str| {
        json!({
            "type": "quad", "origin": origin, "edge_u": u, "edge_v": v, "material": material
        })
    };
    let lamp = |x: f64, radiance: [f64; 3], group: &str| {
        json!({
            "type": "quad", "origin": [x, 1.98, -0.2], "edge_u": [0.4, 0, 0], "edge_v": [0, 0, 0.4],
            "material": "white", "emission": { "radiance": radiance, "group": group }
        })
    };
    let cube = |size: f64, x: f64, z: f64, degrees: f64, material: &str| {
        json!({
            "type": "cube", "material": material,
            "transform": [
                { "scale": [0.3, size, 0.3] }, { "rotate": { "axis": [0, 1, 0], "degrees": degrees } },
                { "translate": [x, size, z] }
            ]
        })
    };
    json!({
        "film": { "width": 64, "height": 64, "filter": { "type": "box" } },
        "camera": { "position": [0, 1, 4.9], "look_at": [0, 1, 0], "vertical_fov_degrees": 30 },
        "sampler": { "spp": spp },
        "materials": {
            "white": { "type": "diffuse", "albedo": [0.725, 0.71, 0.68] },
            "red": { "type": "diffuse", "albedo": [0.63, 0.065, 0.05] },
            "green": { "type": "diffuse", "albedo": [0.14, 0.45, 0.091] },
            "copper": { "type": "conductor", "eta": [0.2, 0.924, 1.102], "k": [3.912, 2.452, 2.142], "alpha": 0.2 }
        },
        "shapes": [
            quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0], "white"),
            quad([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], "white"),
            quad([-1.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], "white"),
            quad([-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0], "red"),
            quad([1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0], "green"),
            cube(0.3, 0.33, 0.37, -17.0, "white"),
            cube(0.6, -0.33, -0.3, 17.0, "copper"),
            lamp(-0.6, [18.4, 14.0, 6.8], "warm"),
            lamp(0.2, [3.0, 5.0, 9.0], "cool")
        ],
        "outputs": [{ "file": "room.exr", "layers": layers }]
    })
}

#[test]
fn an_absent_library_or_another_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    std::fs::write(root.join("other.so"), "no library").unwrap();
    std::fs::create_dir(root.join("empty")).unwrap();
    for (library, words) in [
        ("missing.so", "no such file"),
        ("other.so", "cannot serve as Open Image Denoise"),
        ("empty", "pip install pyoidn"),
    ] {
        let failed = run(root, &format!("denoise a.exr b.exr --oidn-library {library}"));
        assert_eq!(failed.status.code(), Some(4), "{}", stderr(&failed));
        assert!(stderr(&failed).contains(words) && stderr(&failed).lines().count() == 1, "{}", stderr(&failed));
    }
    // A library, but another one: the C library itself.
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let libc = maps.split_whitespace().find(|word| word.contains("/libc.so")).unwrap();
    let failed = run(root, &format!("denoise a.exr b.exr --oidn-library {libc}"));
    assert_eq!(failed.status.code(), Some(4));
    assert!(stderr(&failed).contains("it is not Open Image Denoise 2: it has no oidnNewDevice"), "{}", stderr(&failed));
    // A render misses it before it begins.
    std::fs::write(root.join("scene.json"), room(1 << 20, &[]).to_string()).unwrap();
    let failed = run(root, "render scene.json --denoise --oidn-library empty");
    assert_eq!(failed.status.code(), Some(4), "{}", stderr(&failed));
    for arguments in [
        "denoise a.exr b.png",
        "denoise a.exr b.exr -o c.exr",
        "denoise a.####.exr b.exr",
        "denoise a.exr b.exr --no-features --albedo x",
    ] {
        assert_eq!(run(root, arguments).status.code(), Some(2), "{arguments}");
    }
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn constant_pictures_stay_and_faulty_pixels_are_made_from_their_neighbours() {
    let denoiser = denoiser(2);
    for level in [0.01f32, 1.0, 300.0] {
        let mut image = picture([64, 48], |_, _| [level, level * 0.5, level * 0.25, 1.0]);
        let report = denoise_image(&denoiser, &mut image).unwrap();
        assert_eq!((report.cleaned, report.negative), (0, 0));
        // The network is off by up to two fifths in corners, and by a third of a hundredth away from edges.
        let edge = |i: usize| i % 64 < 8 || i % 64 >= 56 || !(8..40).contains(&(i / 64));
        for (_, pixel) in image.layers[0].pixels().enumerate().filter(|(i, _)| !edge(*i)) {
            for (v, expected) in pixel.iter().zip([level, level * 0.5, level * 0.25, 1.0]) {
                assert!((v - expected).abs() <= 0.02 * expected, "{pixel:?} of {level}");
            }
        }
    }
    let faulty = |x: u32, y: u32| {
        if (x, y) == (20, 20) {
            [f32::NAN, 1.0, 1.0, 1.0]
        } else if x == 0 {
            [f32::INFINITY; 4]
        } else if y == 0 {
            [-1.0, 1.0, 1.0, 1.0]
        } else {
            [1.0; 4]
        }
    };
    let mut image = picture([64, 48], faulty);
    let report = denoise_image(&denoiser, &mut image).unwrap();
    // Infinite alpha is counted apart from infinite colour.
    assert_eq!((report.cleaned, report.negative), (1 + 48 + 48, 63));
    assert!(image.layers[0].data.iter().all(|v| v.is_finite() && *v >= 0.0));
    assert!((image.rgb(20, 20).unwrap()[0] - 1.0).abs() < 0.05, "{:?}", image.rgb(20, 20));
    assert!(image.layer(LayerKind::Noisy).unwrap().data[(20 * 64 + 20) * 4].is_nan());
    let black = &mut picture([32, 32], |_, _| [0.0; 4]);
    denoise_image(&denoiser, black).unwrap();
    assert!(black.layers[0].data.iter().all(|v| *v == 0.0));
}

/// Every number of threads gives the same bits.
#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn the_result_does_not_depend_on_threads() {
    let (one, two) = (denoiser(1), denoiser(2));
    let noisy = render(&room(2, &["feature_albedo", "feature_normal"]));
    let [mut a, mut b] = [noisy.clone(), noisy];
    denoise_image(&one, &mut a).unwrap();
    denoise_image(&two, &mut b).unwrap();
    assert!(a.layers[0].data == b.layers[0].data);
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn features_are_denoised_only_if_they_are_noisy() {
    let denoiser = denoiser(2);
    let uses = |camera: Value| {
        let mut scene = room(16, &["feature_albedo", "feature_normal"]);
        let film = json!({ "width": 512, "height": 256 });
        merge(&mut scene, json!({ "film": film, "integrator": { "type": "path", "max_depth": 2 }, "camera": camera }));
        let report = denoise_image(&denoiser, &mut render(&scene)).unwrap();
        [report.albedo, report.normal]
    };
    assert_eq!(uses(json!({})), [Feature::Clean; 2]);
    assert_eq!(uses(json!({ "lens": { "radius": 0.3, "focus_distance": 2 } })), [Feature::Prefiltered; 2]);
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn the_error_of_a_room_halves_and_more_and_groups_still_sum() {
    let denoiser = denoiser(2);
    let kinds: Vec<&str> = LayerInfo::ALL
        .iter()
        .filter(|info| matches!(info.source, steradian::internal::film::LayerSource::LightAov(_)))
        .map(|info| info.name)
        .collect();
    let parts = kinds.len();
    let layers: Vec<&str> =
        ["feature_albedo", "feature_normal", "light_groups", "variance"].into_iter().chain(kinds).collect();
    let (reference, noisy) = (render(&room(4096, &["light_groups"])), render(&room(16, &layers)));
    let mut image = noisy.clone();
    let report = denoise_image(&denoiser, &mut image).unwrap();
    let (before, after) = (relmse(&reference, &noisy), relmse(&reference, &image));
    eprintln!(
        "relative squared error {before:.5} noisy, {after:.5} denoised in {:.2} s: {}",
        report.seconds,
        report.attribute()
    );
    assert!(after <= 0.5 * before, "{before} {after}");
    assert!(report.attribute().ends_with("albedo prefiltered, normal prefiltered"), "{}", report.attribute());

    // What was: the original, and every layer that is no part of the light.
    assert_eq!(image.layer(LayerKind::Noisy).unwrap().data, noisy.layers[0].data);
    for kind in FEATURE_LAYERS.into_iter().chain([LayerKind::Variance]) {
        assert_eq!(image.layer(kind), noisy.layer(kind));
    }
    let is_group = |layer: &&Layer| layer.kind == LayerKind::LightGroups;
    let is_part = |layer: &&Layer| {
        matches!(LayerInfo::of(layer.kind).source, steradian::internal::film::LayerSource::LightAov(_))
    };
    let sums =
        [image.layers.iter().filter(is_group).collect::<Vec<_>>(), image.layers.iter().filter(is_part).collect()];
    assert_eq!(sums.each_ref().map(Vec::len), [3, parts]);
    assert_eq!(report.layers.len(), 1 + 3 + parts);
    for parts in sums {
        for (i, pixel) in image.layers[0].pixels().enumerate() {
            for (c, &total) in pixel[..3].iter().enumerate() {
                let sum: f64 = parts.iter().map(|part| f64::from(part.data[3 * i + c])).sum();
                let total = f64::from(total);
                assert!((sum - total).abs() <= 1e-6 * total + 1e-30, "pixel {i}: {sum} {total}");
            }
        }
    }
    // The groups are denoised, not merely scaled: each is nearer to its own reference.
    for (i, layer) in reference.layers.iter().enumerate().filter(|(_, layer)| layer.kind == LayerKind::LightGroups) {
        let alone = |image: &Image| {
            let group = image.layers.iter().find(|l| l.group == layer.group).unwrap();
            Image::of_color(image.size, group.pixels().flat_map(|p| [p[0], p[1], p[2], 1.0]).collect())
        };
        let [truth, noisy, denoised] = [&reference, &noisy, &image].map(alone);
        if truth.layers[0].data.iter().step_by(4).any(|v| *v > 0.0) {
            assert!(relmse(&truth, &denoised) <= 0.6 * relmse(&truth, &noisy), "{i} {:?}", layer.group);
        }
    }
}

/// A checkered wall behind the camera, seen in a mirror; very noisy with the strategy `bsdf`.
fn mirror(spp: u32, strategy: &str) -> Value {
    let mut scene = room(spp, &["feature_albedo", "feature_normal"]);
    merge(
        &mut scene,
        json!({
            "camera": { "position": [0, 1, 0.9], "look_at": [0, 1, 0], "vertical_fov_degrees": 28 },
            "integrator": { "type": "path", "max_depth": 3, "strategy": strategy },
            "sampler": { "type": "independent" },
            "materials": {
                "mirror": { "type": "mirror", "reflectance": 0.9 },
                "tiles": { "type": "diffuse", "albedo": { "texture": "tiles" } }
            },
            "textures": {
                "tiles": { "type": "checker", "color0": [0.5, 0.5, 0.5], "color1": [0.25, 0.25, 0.25], "scale": [8, 8] }
            }
        }),
    );
    let shapes = scene["shapes"].as_array_mut().unwrap();
    shapes.truncate(0);
    shapes.extend([
        json!({
            "type": "quad", "origin": [-1, 0, -1], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0], "material": "mirror"
        }),
        json!({ "type": "quad", "origin": [1, 0, 1], "edge_u": [-2, 0, 0], "edge_v": [0, 2, 0], "material": "tiles" }),
        json!({ "type": "quad", "origin": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2], "material": "white" }),
        json!({ "type": "quad", "origin": [-1, 0, 1], "edge_u": [0, 0, -2], "edge_v": [0, 2, 0], "material": "red" }),
        json!({
            "type": "quad", "origin": [-0.4, 1.98, -0.4], "edge_u": [0.8, 0, 0], "edge_v": [0, 0, 0.4],
            "material": "white", "emission": { "radiance": [10, 10, 10] }
        }),
    ]);
    scene
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn features_keep_what_a_mirror_shows_sharp() {
    let denoiser = denoiser(2);
    let (reference, noisy) = (render(&mirror(512, "mis")), render(&mirror(16, "bsdf")));
    let [mut with, mut without] = [noisy.clone(), noisy.clone()];
    without.layers.retain(|layer| !FEATURE_LAYERS.contains(&layer.kind));
    denoise_image(&denoiser, &mut with).unwrap();
    let report = denoise_image(&denoiser, &mut without).unwrap();
    assert!(report.attribute().ends_with("without albedo and normal"));
    let errors = [&noisy, &without, &with].map(|image| relmse(&reference, image));
    eprintln!(
        "relative squared errors: noisy {:.5}, without features {:.5}, with {:.5}",
        errors[0], errors[1], errors[2]
    );
    assert!(errors[2] < 0.5 * errors[1] && errors[1] < errors[0], "{errors:?}");
}

/// A file of 16-bit colour, 32-bit depth, features by names of pbrt and an attribute of someone else's.
fn foreign_file(path: &Path) -> FlatImage {
    let size = Vec2(40, 30);
    let noise = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1009) as f32 / 1009.0;
    let half = |name: &str, k: usize| {
        AnyChannel::new(name, FlatSamples::F16((0..size.area()).map(|i| f16::from_f32(noise(i, k))).collect()))
    };
    let float = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; size.area()]));
    let mut list: Vec<_> = ["R", "G", "B", "A"].iter().enumerate().map(|(k, name)| half(name, k)).collect();
    list.extend([float("Z", f32::INFINITY), float("Albedo.R", 0.5), float("Albedo.G", 0.5), float("Albedo.B", 0.5)]);
    list.extend([float("Ns.X", 0.0), float("Ns.Y", 0.0), float("Ns.Z", 1.0), float("u", 0.25)]);
    list.push(AnyChannel::new("id", FlatSamples::U32((0..size.area() as u32).collect())));
    let mut attributes = LayerAttributes { layer_position: Vec2(-4, 7), ..LayerAttributes::default() };
    attributes.other.insert("shot".into(), exr::prelude::attribute::AttributeValue::Text("12b".into()));
    let layer = exr::prelude::Layer::new(
        size,
        attributes,
        Encoding::SMALL_FAST_LOSSLESS,
        AnyChannels::sort(list.into_iter().collect()),
    );
    let image = FlatImage::from_layers(
        exr::prelude::ImageAttributes::with_size(Vec2(64, 48)),
        exr::prelude::SmallVec::from_iter([layer]),
    );
    image.write().to_file(path).unwrap();
    read(path)
}

fn read(path: &Path) -> FlatImage {
    exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap()
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn everything_else_of_a_file_stays() {
    let denoiser = denoiser(2);
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.exr"), folder.path().join("out.exr"));
    let before = foreign_file(&input);
    let report = denoise_file(&denoiser, &input, &output, &FileOptions::default()).unwrap();
    assert!(
        report.attribute().ends_with("albedo prefiltered, normal prefiltered") && report.notes.is_empty(),
        "{report:?}"
    );
    let mut after = read(&output);
    let (old, new) = (&before.layer_data[0], &mut after.layer_data[0]);
    let denoised = new.attributes.other.remove(&exr::prelude::Text::from(Report::ATTRIBUTE)).unwrap();
    assert_eq!(denoised, exr::prelude::attribute::AttributeValue::Text(report.attribute().as_str().into()));
    assert_eq!(
        (&new.attributes, new.encoding, new.size, &after.attributes),
        (&old.attributes, old.encoding, old.size, &before.attributes)
    );
    let find = |list: &[AnyChannel<FlatSamples>], name: &str| {
        list.iter().find(|c| c.name == *name).unwrap_or_else(|| panic!("{name}")).clone()
    };
    let list = &new.channel_data.list;
    assert_eq!(list.len(), old.channel_data.list.len() + 4);
    for channel in &old.channel_data.list {
        let name = channel.name.to_string();
        let same = find(list, &name).sample_data == channel.sample_data;
        let colour = ["R", "G", "B", "A"].contains(&name.as_str());
        assert_eq!(same, !colour, "{name}");
        if colour {
            assert!(matches!(find(list, &name).sample_data, FlatSamples::F16(_)));
            assert_eq!(find(list, &format!("noisy.{name}")).sample_data, channel.sample_data);
        }
    }
    let again = denoise_file(&denoiser, &output, &input, &FileOptions::default()).unwrap_err();
    assert!(again.to_string().contains("denoised already"), "{again}");
}

#[test]
#[ignore = "needs Open Image Denoise: pip install pyoidn"]
fn the_program_denoises_renders_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    std::fs::write(root.join("room.json"), room(4, &[]).to_string()).unwrap();
    let done = run(root, "render room.json --denoise --crop 8,8,48,40 -o a.exr -o a.png --stats stats.json");
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    let stats: Value = serde_json::from_str(&std::fs::read_to_string(root.join("stats.json")).unwrap()).unwrap();
    assert!(
        stats["denoise"]["seconds"].as_f64().unwrap() > 0.0 && stats["denoise"]["layers"] == json!(["color"]),
        "{stats}"
    );
    let file = read(&root.join("a.exr"));
    let names: Vec<String> = file.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "noisy.A", "noisy.B", "noisy.G", "noisy.R"]);
    assert!(file.layer_data[0].attributes.other.contains_key(&exr::prelude::Text::from(Report::ATTRIBUTE)));

    // The same in two steps, through files of 32 bits.
    assert!(run(root, "render room.json --denoise --float -o one.exr").status.success());
    assert!(
        run(root, "render room.json --float --layers feature_albedo,feature_normal,light_groups -o n.0003.exr")
            .status
            .success()
    );
    let done = run(root, "denoise n.####.exr d.####.exr -o d.####.png --json");
    assert!(done.status.success() && root.join("d.0003.png").exists(), "{}", stderr(&done));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["layers"], json!(["color", "light_cool", "light_default", "light_warm"]));
    let [one, two] = ["one.exr", "d.0003.exr"].map(|name| output::read_exr(&root.join(name)).unwrap());
    assert!(one.layers[0].data == two.layers[0].data);
}
