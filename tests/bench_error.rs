use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::util::folder::Folder;

const PROGRAM: &str = env!("CARGO_BIN_EXE_steradian");

/// A grey floor below a sky: one bounce, hardly any noise.
fn scene(folder: &Folder) -> String {
    let scene = json!({
        "film": { "width": 24, "height": 16 },
        "camera": { "position": [0, 1, 3], "look_at": [0, 0.3, 0], "vertical_fov_degrees": 40 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.5 } },
        "shapes": [
            { "type": "cube", "material": "grey" },
            { "type": "quad", "material": "grey", "origin": [-5, -1, 5], "edge_u": [10, 0, 0], "edge_v": [0, 0, -10] }
        ],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    folder.write("floor.json", scene.to_string()).to_str().unwrap().to_owned()
}

fn bench(arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(["bench", "error"]).args(arguments).output().unwrap()
}

fn reference(folder: &Folder, scene: &str) -> String {
    let file = folder.path("reference.exr").to_str().unwrap().to_owned();
    let run = Command::new(PROGRAM)
        .args(["render", scene, "--spp", "1024", "--seed", "99", "--float", "-q", "-o", &file])
        .status();
    assert!(run.unwrap().success());
    file
}

#[test]
fn reports_compare_variants_and_programs_in_one_run() {
    let folder = Folder::new();
    let scene = scene(&folder);
    let reference = reference(&folder, &scene);
    let out = folder.path("report");
    let command =
        format!("self='{PROGRAM}' render {{scene}} --spp {{spp}} --seed {{seed}} --float -q -o {{out}} --stats -");
    let arguments = [
        "--reference",
        &reference,
        "--spp",
        "1,16",
        "--repeat",
        "2",
        "--sampler",
        "independent,sobol",
        "--external",
        &command,
    ];
    let run = bench(&[&[scene.as_str()], &arguments[..], &["--tax", "-q", "--out", out.to_str().unwrap()]].concat());
    assert!(run.status.success(), "{run:?}");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();

    let report: Value = serde_json::from_str(&read("error.json")).unwrap();
    let variants = report["variants"].as_array().unwrap();
    let names: Vec<_> = variants.iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["independent", "sobol", "self"]);
    for variant in variants {
        let points = variant["points"].as_array().unwrap();
        let errors: Vec<f64> = points.iter().map(|p| p["relmse"][0].as_f64().unwrap()).collect();
        assert!(errors[0] > 4.0 * errors[1] && errors[1] > 0.0, "{variant}");
        assert!(variant["slope_of_spp"].as_f64().unwrap() < -0.5, "{variant}");
        for point in points {
            // A mean over 384 pixels and two repeats; the interval is one of 95 %, and the false-alarm rate must be far
            // smaller.
            let bias = |key: &str| point["bias"][key].as_f64().unwrap();
            assert!((bias("ratio") - 1.0).abs() < 4.0 * (bias("high") - bias("low")), "{point}");
            let seconds = |key: &str| point[key][0].as_f64().unwrap();
            assert!(seconds("processor_seconds") > 0.0 && seconds("seconds") > 0.0, "{point}");
            assert_eq!((point["not_finite"].as_u64(), point["runs"].as_array().unwrap().len()), (Some(0), 2));
            assert!(point["flip"].as_f64().unwrap() > 0.0 && point["efficiency"][0].as_f64().unwrap() > 0.0, "{point}");
            assert_ne!(point["runs"][0]["seed"], point["runs"][1]["seed"]);
        }
    }
    // The same program with the same seeds makes the same pictures, whichever way it is run.
    let error = |v: usize, p: usize, r: usize| variants[v]["points"][p]["runs"][r]["relmse"].as_f64().unwrap();
    for (point, repeat) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        assert!((error(1, point, repeat) / error(2, point, repeat) - 1.0).abs() < 1e-4);
    }
    let equal = &report["equal_error"];
    assert!(equal["seconds"].as_array().unwrap().iter().all(Value::is_f64), "{equal}");
    let tax = &report["tax"];
    assert!(
        tax["same_hits"] == true && tax["hits"].as_u64().unwrap() > 384 && tax["ratio"][0].as_f64().unwrap() > 0.0,
        "{tax}"
    );

    let csv = read("error.csv");
    assert!(csv.lines().count() == 13 && csv.lines().all(|line| line.split(',').count() == 20), "{csv}");
    let markdown = read("error.md");
    assert!(markdown.contains("| sobol | 16 spp |") && markdown.contains("Shading tax"), "{markdown}");
    let html = read("error.html");
    // The only address is the name of SVG's namespace.
    assert_eq!(html.matches("http").count(), html.matches("http://www.w3.org/2000/svg").count());
    assert!(html.matches("<svg").count() == 3 && html.matches("<canvas>").count() == 3 && html.ends_with("</html>\n"));
    // The reference, and a picture and a FLIP map of each variant, which need no script.
    assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 7);
    let verdict = html.split_once("class=\"verdict\">").unwrap().1.split_once("</p>").unwrap().0;
    assert!(verdict.starts_with("sobol: ") && verdict.contains("as fast as independent to equal error"), "{verdict}");
    assert!(verdict.contains("bias found") && markdown.contains(verdict), "{verdict}");
    let pictures = html.split_once("id=\"pictures\">").unwrap().1.split_once("</script>").unwrap().0;
    let pictures: Value = serde_json::from_str(pictures).unwrap();
    assert_eq!((&pictures["size"], pictures["tests"].as_array().unwrap().len()), (&json!([24, 16]), 6));
    assert_eq!(pictures["tests"][5]["name"], "self, 16 spp");
}

/// A Python interpreter that has every module but LuxCore's, and renders by copying a picture.
fn interpreter(folder: &Folder, picture: &str) -> String {
    let program = format!(
        "#!/bin/sh\nif [ \"$1\" = -c ]; then case \"$2\" in *pyluxcore*) exit 1 ;; *) exit 0 ;; esac; fi\n\
         grep -q 'scene.cycles.device' || exit 9\n\
         while [ $# -gt 1 ]; do [ \"$1\" = --out ] && out=$2; shift; done\n\
         cp '{picture}' \"$out\"; echo '{{\"render_seconds\": 0.5, \"processor_seconds\": 0.75}}'\n"
    );
    let file = folder.write("python", program);
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn other_renderers_run_by_their_python_modules() {
    let folder = Folder::new();
    let scene = scene(&folder);
    let reference = reference(&folder, &scene);
    let python = interpreter(&folder, &reference);
    let named = |peer: &str, file: &str| format!("{peer}={}", folder.write(file, "").to_str().unwrap());
    let (cycles, luxcore) = (named("cycles", "floor.glb"), named("luxcore", "floor.cfg"));
    let arguments = ["--reference", &reference, "--spp", "4", "--repeat", "1", "--python", &python, "--json", "-q"];
    let run = bench(&[&[scene.as_str(), "--peers", "--peer", &cycles], &arguments[..]].concat());
    assert!(run.status.success(), "{run:?}");
    let report: Value = serde_json::from_slice(&run.stdout).unwrap();
    let names: Vec<_> = report["variants"].as_array().unwrap().iter().map(|v| v["name"].as_str().unwrap()).collect();
    // --peers adds none: Mitsuba and LuxCore do not read this scene.
    assert_eq!(names, ["steradian", "cycles"]);
    let run = &report["variants"][1]["points"][0]["runs"][0];
    assert_eq!((&run["seconds"], &run["processor_seconds"], &run["relmse"]), (&json!(0.5), &json!(0.75), &json!(0.0)));
    let run = bench(&[&[scene.as_str(), "--peers"], &arguments[..]].concat());
    assert!(String::from_utf8_lossy(&run.stderr).contains("has no renderer that reads"), "{run:?}");
    for (peer, message) in [
        (luxcore.as_str(), "has no module pyluxcore"),
        ("cycles", "is not a scene that it reads (.blend, .gltf, .glb)"),
        ("cycles=missing.glb", "missing.glb: file not found"),
        ("blender", "expected mitsuba, cycles or luxcore"),
    ] {
        let run = bench(&[&[scene.as_str(), "--peer", peer], &arguments[..]].concat());
        let text = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(2) && text.contains(message), "{peer}: {text}");
    }
}

#[test]
fn two_renders_stand_in_for_a_reference() {
    let folder = Folder::new();
    let run = bench(&[&scene(&folder), "--times", "0.05", "--repeat", "1", "--json", "-q"]);
    assert!(run.status.success(), "{run:?}");
    let report: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!(report["reference"]["file"].is_null() && report["reference"]["noise_relmse"].as_f64().unwrap() > 0.0);
    let point = &report["variants"][0]["points"][0];
    assert!(point["spp"].as_f64().unwrap() >= 1.0 && point["seconds"][0].as_f64().unwrap() > 0.0, "{point}");
    let table = bench(&[&scene(&folder), "--spp", "1", "--repeat", "1", "-q"]);
    assert!(String::from_utf8(table.stdout).unwrap().contains("No reference was given"));
}

#[test]
fn mistakes_are_named() {
    let folder = Folder::new();
    let scene = scene(&folder);
    let reference = reference(&folder, &scene);
    let failing = "broken=echo no such scene >&2; exit 7; {spp} {out}";
    let small = ["--reference", &reference, "--spp", "1"];
    let cases: [(&[&str], i32, &str); 9] = [
        (&["missing.json"], 4, "missing.json"),
        (&[&scene, "--reference", "missing.exr"], 4, "missing.exr"),
        (&[&scene, "--reference", &reference, "--size", "48x32"], 2, "reference has 24x16 pixels"),
        (&[&scene, "--spp", "1,0"], 2, "--spp"),
        (&[&scene, "--times", "0"], 2, "--times"),
        (&[&scene, "--external", "x=render {scene} {out}"], 2, "{spp}"),
        (&[&[scene.as_str()], &small[..], &["--external", failing]].concat(), 1, "--external broken: exit status: 7"),
        (&[&[scene.as_str()], &small[..], &["--external", "idle=true {spp} {out}"]].concat(), 1, "it wrote no {out}"),
        (&[&scene, "--spp", "1", "--tax", "--accel", "bvh"], 2, "--tax"),
    ];
    for (arguments, code, message) in cases {
        let run = bench(arguments);
        let error = String::from_utf8(run.stderr).unwrap();
        assert!(run.status.code() == Some(code) && error.contains(message), "{arguments:?}: {:?} {error}", run.status);
    }
    let run = bench(&[&[scene.as_str()], &small[..], &["--external", failing]].concat());
    assert!(String::from_utf8(run.stderr).unwrap().contains("no such scene"));
}
