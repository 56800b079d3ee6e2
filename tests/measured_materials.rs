//! Measured materials: files of `tools/measured_files.py` beside what Mitsuba makes of them, what is refused, copies.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::assets::read_measured;
use steradian::internal::bsdf::Measured;
use steradian::internal::convert::{Originals, write_scene};
use steradian::internal::import::{ImportOptions, read_scene};
use steradian::internal::math::{Vec3, vec3};
use steradian::internal::output::FileUses;

use crate::bad_input::assert_error;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::root;

/// What Mitsuba makes of a file.
struct Expected {
    file: &'static str,
    /// Outgoing and incident directions: angle from the normal and azimuth, in radians.
    wo: [f32; 2],
    wi: [f32; 2],
    /// Red, green, blue and the density.
    eval: [f32; 4],
    /// The second and the first number of a sample, its direction, weight and density; a weight of 0 below the horizon.
    u: [f32; 2],
    sample: [f32; 7],
}

/// Of Mitsuba 3.9.1, `scalar_rgb`: `tools/measured_files.py mitsuba tests/regressions/measured`.
const MITSUBA: [Expected; 16] = [
    Expected {
        file: "isotropic",
        wo: [0.35, 0.3],
        wi: [0.5, -2.5],
        eval: [0.5232455, 0.3488328, 0.1453512, 0.7291617],
        u: [0.2, 0.7],
        sample: [-0.2632997, 0.1900892, 0.9458007, 0.7380056, 0.492004, 0.205002, 0.592069],
    },
    Expected {
        file: "isotropic",
        wo: [0.9, -2.0],
        wi: [0.7, 1.1],
        eval: [0.7524841, 0.504423, 0.2150184, 1.096066],
        u: [0.55, 0.1],
        sample: [0.09103291, 0.8886428, 0.449474, 0.7609719, 0.5146994, 0.2273814, 0.4840028],
    },
    Expected {
        file: "isotropic",
        wo: [1.2, 2.4],
        wi: [1.1, -0.9],
        eval: [0.7998497, 0.5618834, 0.2842561, 1.051363],
        u: [0.93, 0.4],
        sample: [-0.2631241, 0.873522, 0.4095425, 0.7053105, 0.4702073, 0.1959202, 0.03486897],
    },
    Expected {
        file: "isotropic",
        wo: [0.02, 1.0],
        wi: [0.3, 2.0],
        eval: [0.4131069, 0.2754046, 0.1147519, 0.5597764],
        u: [0.4, 0.95],
        sample: [-0.3644879, -0.3038398, 0.8802443, 0.7620258, 0.5080194, 0.2116787, 0.3940839],
    },
    Expected {
        file: "mirrors",
        wo: [0.35, 0.3],
        wi: [0.5, -2.5],
        eval: [0.4995306, 0.3331197, 0.1389736, 0.6311886],
        u: [0.2, 0.7],
        sample: [-0.3266838, -0.2536241, 0.9104684, 0.7275693, 0.485143, 0.2023122, 0.7347837],
    },
    Expected {
        file: "mirrors",
        wo: [0.9, -2.0],
        wi: [0.7, 1.1],
        eval: [0.7423858, 0.5015938, 0.2206699, 0.972136],
        u: [0.55, 0.1],
        sample: [-0.3656885, 0.5537885, 0.7480575, 0.8783878, 0.5919992, 0.2578792, 0.3661369],
    },
    Expected {
        file: "mirrors",
        wo: [1.2, 2.4],
        wi: [1.1, -0.9],
        eval: [0.8916982, 0.6289616, 0.3224355, 1.145247],
        u: [0.93, 0.4],
        sample: [-0.3169237, 0.6175942, 0.7198175, 0.8341099, 0.5561445, 0.2318515, 0.01651092],
    },
    Expected {
        file: "mirrors",
        wo: [0.02, 1.0],
        wi: [0.3, 2.0],
        eval: [0.3530157, 0.2353438, 0.09805993, 0.4050556],
        u: [0.4, 0.95],
        sample: [0.5443575, -0.1022103, 0.832603, 0.7868762, 0.5245842, 0.2185769, 0.4935634],
    },
    Expected {
        file: "half_turn",
        wo: [0.35, 0.3],
        wi: [0.5, -2.5],
        eval: [0.5433278, 0.362818, 0.1522232, 0.7602089],
        u: [0.2, 0.7],
        sample: [-0.4761857, -0.2875239, 0.8310099, 0.7145801, 0.4774203, 0.2007339, 0.7773364],
    },
    Expected {
        file: "half_turn",
        wo: [0.9, -2.0],
        wi: [0.7, 1.1],
        eval: [0.7799587, 0.5210165, 0.2189173, 1.14324],
        u: [0.55, 0.1],
        sample: [-0.2840481, 0.5229955, 0.8036121, 0.7248216, 0.4840136, 0.2030708, 0.3763128],
    },
    Expected {
        file: "half_turn",
        wo: [1.2, 2.4],
        wi: [1.1, -0.9],
        eval: [1.19149, 0.7966933, 0.3360969, 1.749872],
        u: [0.93, 0.4],
        sample: [-0.6351942, 0.09050796, 0.7670307, 1.254166, 0.8361194, 0.3483985, 0.02362408],
    },
    Expected {
        file: "half_turn",
        wo: [0.02, 1.0],
        wi: [0.3, 2.0],
        eval: [0.3307826, 0.2205217, 0.09188407, 0.4011023],
        u: [0.4, 0.95],
        sample: [0.4454493, -0.1231539, 0.8867968, 0.7214924, 0.480995, 0.2004146, 0.4446922],
    },
    Expected {
        file: "whole",
        wo: [0.35, 0.3],
        wi: [0.5, -2.5],
        eval: [0.5952752, 0.3974189, 0.1665865, 1.313139],
        u: [0.2, 0.7],
        sample: [-0.1451288, 0.05411437, 0.9879319, 0.4073384, 0.2720501, 0.1142136, 1.655662],
    },
    Expected {
        file: "whole",
        wo: [0.9, -2.0],
        wi: [0.7, 1.1],
        eval: [0.8696197, 0.5835372, 0.2497744, 2.121824],
        u: [0.55, 0.1],
        sample: [-0.006882114, 0.5974315, 0.8018904, 0.6851885, 0.460103, 0.1975033, 1.054777],
    },
    Expected {
        file: "whole",
        wo: [1.2, 2.4],
        wi: [1.1, -0.9],
        eval: [0.8565795, 0.5729482, 0.2420451, 3.012188],
        u: [0.93, 0.4],
        sample: [0.686898, -0.7119939, -0.1457255, 0.0, 0.0, 0.0, 0.2759183],
    },
    Expected {
        file: "whole",
        wo: [0.02, 1.0],
        wi: [0.3, 2.0],
        eval: [0.2952574, 0.1968383, 0.08201595, 0.3655475],
        u: [0.4, 0.95],
        sample: [-0.2801192, 0.05295937, 0.9585031, 0.5000395, 0.3333597, 0.1389001, 1.071209],
    },
];

fn measured(file: &str) -> Measured {
    Measured::new(read_measured(&root().join(format!("tests/regressions/measured/{file}.bsdf"))).unwrap())
}

fn direction([theta, phi]: [f32; 2]) -> Vec3 {
    let ((sin, cos), (y, x)) = (theta.sin_cos(), phi.sin_cos());
    vec3(sin * x, sin * y, cos)
}

#[track_caller]
fn assert_close(found: &[f32], expected: &[f32], what: &str) {
    let is_close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs() + 2e-4);
    assert!(is_close && found.len() == expected.len(), "{what}: {found:?}, {expected:?}");
}

#[test]
fn values_densities_and_samples_are_those_of_mitsuba() {
    for Expected { file, wo, wi, eval, u, sample } in MITSUBA {
        let (bsdf, wo) = (measured(file), direction(wo));
        let found = bsdf.eval(wo, direction(wi));
        let [r, g, b] = found.value.to_array();
        assert_close(&[r, g, b, found.pdf], &eval, file);
        let [x, y, z, r, g, b, pdf] = sample;
        match bsdf.sample(wo, 0.5, u) {
            None => assert!(z < 0.0 && r == 0.0, "{file} {wo:?} {u:?}"),
            Some(found) => {
                assert_close(&found.wi.to_array(), &[x, y, z], file);
                assert_close(&found.weight.to_array(), &[r, g, b], file);
                assert_close(&[found.pdf], &[pdf], file);
            }
        }
    }
}

/// A scene whose sphere is of a measured material.
fn scene(file: &str) -> Value {
    let mut scene = good_scene();
    set(&mut scene, "materials.coin", json!({ "type": "measured", "file": file }));
    set(&mut scene, "shapes[0].material", json!("coin"));
    scene
}

/// A folder with a file of the same name.
fn folder_with(file: &str) -> Folder {
    let folder = Folder::new();
    folder.write(file, std::fs::read(root().join("tests/regressions/measured").join(file)).unwrap());
    folder
}

#[test]
fn scenes_have_measured_materials() {
    let folder = folder_with("mirrors.bsdf");
    let anisotropic = folder.compile(&scene("mirrors.bsdf")).unwrap();
    assert!(anisotropic.features.anisotropic);
    assert_error(&folder, &scene("gone.bsdf"), ErrorKind::AssetMissing, &["gone.bsdf", "materials.coin.file"]);
    folder.write("bad.bsdf", "tensor_file\0\u{1}");
    assert_error(&folder, &scene("bad.bsdf"), ErrorKind::Scene, &["bad.bsdf", "materials.coin.file", "header"]);
    // What nothing uses is not read.
    let mut unused = good_scene();
    set(&mut unused, "materials.coin", json!({ "type": "measured", "file": "gone.bsdf" }));
    folder.compile(&unused).unwrap();
}

#[test]
fn white_light_from_everywhere_is_what_the_tables_reflect() {
    let folder = folder_with("isotropic.bsdf");
    let scene = json!({
        "film": { "width": 24, "height": 24 },
        "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 1 },
        "sampler": { "spp": 64 }, "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "materials": { "m": { "type": "measured", "file": "isotropic.bsdf" } },
        "shapes": [{ "type": "sphere", "material": "m" }]
    });
    let picture = folder.render(&scene);
    // Nearly all of the middle of the sphere is seen from ahead.
    let expected = measured("isotropic").albedo(Vec3::Z).to_array();
    let pixels = (0..24 * 24).map(|k| picture.rgb(k % 24, k / 24).unwrap());
    for (c, expected) in expected.into_iter().enumerate() {
        let mean = pixels.clone().map(|pixel| pixel[c]).sum::<f32>() / (24.0 * 24.0);
        assert!((mean - expected).abs() < 0.01 && mean < 1.0, "{mean} {expected}");
    }
}

#[test]
fn files_of_mitsubas_scenes_are_read_and_copied() {
    let folder = folder_with("isotropic.bsdf");
    let text = r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/><shape type="sphere">
        <bsdf type="measured" id="coin"><string name="filename" value="isotropic.bsdf"/></bsdf></shape></scene>"#;
    let path = folder.write("s.xml", text);
    let imported = read_scene(&path, &ImportOptions::default()).unwrap();
    assert_eq!(
        serde_json::to_value(&imported.desc.materials["coin"]).unwrap(),
        json!({ "type": "measured", "file": "isotropic.bsdf" })
    );
    // Mitsuba's is black from behind.
    let front = imported.desc.shapes[0].common().material.unwrap();
    let sides = serde_json::to_value(&imported.desc.materials[front]).unwrap();
    assert_eq!((&sides["type"], &sides["front"]), (&json!("two_sided"), &json!("coin")));
    assert_eq!(imported.report.count(steradian::Outcome::Ignored), 0);

    std::fs::create_dir(folder.path("copy")).unwrap();
    let target = folder.path("copy/scene.json");
    write_scene(&imported, &path, &target, Originals::Copy, FileUses::default()).unwrap();
    let mut copied = read_scene(&target, &ImportOptions::default()).unwrap().desc;
    let names: Vec<String> = copied.files_mut().iter().map(|file| file.name.clone()).collect();
    assert!(names.len() == 1 && folder.path("copy").join(&names[0]).is_file(), "{names:?}");
    folder.write("isotropic.bsdf", "a secret");
    let error = write_scene(&imported, &path, &target, Originals::Copy, FileUses::default()).unwrap_err();
    assert!(error.to_string().contains("this is no BSDF file"), "{error}");
    let nameless = text.replace(r#"<string name="filename" value="isotropic.bsdf"/>"#, "");
    let error = read_scene(&folder.write("t.xml", nameless), &ImportOptions::default()).err().unwrap();
    assert!(error.to_string().contains("needs \"filename\""), "{error}");
}
