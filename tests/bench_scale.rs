use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::util::folder::Folder;
use crate::util::program::{Running, Signal};

const PROGRAM: &str = env!("CARGO_BIN_EXE_steradian");

const SWEEPS: [&str; 8] = ["resolution", "spp", "triangles", "instances", "lights", "depth", "layers", "threads"];

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(["bench", "scale", "--quick"]).args(arguments);
    command
}

fn bench(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

fn value(point: &Value, name: &str) -> f64 {
    let values = point["values"].as_array().unwrap();
    values.iter().find(|v| v["name"] == name).unwrap_or_else(|| panic!("{name}: {point}"))["value"][0].as_f64().unwrap()
}

#[test]
fn every_sweep_has_its_costs_and_their_slopes() {
    let folder = Folder::new();
    let out = folder.path("scale");
    let small = [
        "--repeat",
        "1",
        "--size",
        "32x32",
        "--spp",
        "1",
        "--triangles",
        "2e4",
        "--lights",
        "40",
        "--instances",
        "30",
        "--threads",
        "2",
        "-q",
        "--out",
        out.to_str().unwrap(),
    ];
    let run = bench(&small);
    assert!(run.status.success(), "{run:?}");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let report: Value = serde_json::from_str(&read("scale.json")).unwrap();
    assert_eq!(report["interrupted"], false);
    let sweeps = report["sweeps"].as_array().unwrap();
    assert_eq!(sweeps.iter().map(|s| s["name"].as_str().unwrap()).collect::<Vec<_>>(), SWEEPS);
    let points = |name: &str| sweeps.iter().find(|s| s["name"] == name).unwrap()["points"].as_array().unwrap();
    for sweep in sweeps {
        let points = sweep["points"].as_array().unwrap();
        for point in points {
            assert!(point["failure"].is_null() && point["runs"].as_array().unwrap().len() == 1, "{point}");
            let run = &point["runs"][0];
            assert!(run["samples"].as_u64() > Some(0) && run["rays"].as_u64() >= run["samples"].as_u64(), "{point}");
            // What was held during the render includes the film.
            let memory = &run["memory"];
            assert!(memory["render"].as_u64() >= memory["before_render"].as_u64(), "{point}");
        }
        let slopes = sweep["slopes"].as_array().unwrap();
        assert!(slopes.len() >= 2 && slopes.iter().all(|s| s["slope"].is_f64()), "{sweep}");
        assert!(points.len() < 3 || slopes.iter().all(|s| s["standard_error"].is_f64()), "{sweep}");
    }

    // The scenes match their sweep.
    let counted = |name: &str, what: &str| -> Vec<u64> {
        points(name).iter().map(|p| p["runs"][0][what].as_u64().unwrap()).collect()
    };
    assert_eq!(counted("triangles", "triangles"), [1_000, 10_000, 20_000]);
    assert_eq!(counted("instances", "instances"), [1, 10, 30]);
    assert_eq!(counted("instances", "triangles"), [2_000; 3]);
    assert_eq!(counted("lights", "lights"), [1, 10, 40]);
    assert_eq!(counted("resolution", "samples"), [64, 256, 1024, 4096, 16384]);
    assert_eq!(counted("spp", "samples"), [64, 256, 1024, 4096]);
    // In a closed room a path of `n` segments has a ray and a shadow ray for each but the last, nearly always.
    let rays: Vec<f64> = points("depth").iter().map(|p| value(p, "rays a sample")).collect();
    assert!(rays[0] == 1.0 && rays[5] > 45.0 && rays.windows(2).all(|pair| pair[0] < pair[1]), "{rays:?}");

    // Bounds that a change must not break unnoticed: 6 bytes of positions and 12 of corners, and what Embree holds.
    let largest = points("triangles").last().unwrap();
    assert!(value(largest, "mesh B a triangle") < 18.5, "{largest}");
    assert!(value(largest, "accelerator B a triangle") < 90.0, "{largest}");
    let instance = points("instances").last().unwrap();
    assert!(value(instance, "accelerator B an instance") < 20_000.0, "{instance}");
    // Every sum has 12 bytes; light AOVs and other averages are counted though they may be black.
    let film: Vec<f64> = points("layers").iter().map(|p| value(p, "film B a pixel")).collect();
    assert_eq!(film, [52.0, 64.0, 76.0, 88.0, 124.0, 200.0]);

    let csv = read("scale.csv");
    assert!(csv.lines().count() == 33 && csv.lines().all(|line| line.split(',').count() == 28), "{csv}");
    let markdown = read("scale.md");
    assert!(markdown.contains("| triangles | build s |") && markdown.contains("times one thread"), "{markdown}");
    let html = read("scale.html");
    // The only address is the name of SVG's namespace.
    assert_eq!(html.matches("http").count(), html.matches("http://www.w3.org/2000/svg").count());
    assert!(html.matches("<svg").count() == SWEEPS.len() && html.ends_with("</html>\n"));
}

#[test]
fn an_interrupted_run_reports_what_there_is() {
    let mut command = command(&["spp", "resolution", "--size", "64x64", "--repeat", "500", "--json", "-q"]);
    let mut child = Running::start(command.stdout(Stdio::piped()));
    std::thread::sleep(Duration::from_secs(2));
    child.signal(Signal::INT);
    assert!(child.try_wait().unwrap().is_none());
    let run = child.output();
    assert_eq!(run.status.code(), Some(130));
    let report: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!(report["interrupted"] == true && report["sweeps"].as_array().unwrap().len() == 2, "{report}");
}

#[test]
fn mistakes_are_named() {
    for (arguments, code, message) in [
        (vec!["colour"], 2, "possible values: resolution, spp"),
        (vec!["--triangles", "0"], 2, "--triangles"),
        (vec!["--out", "/proc/no"], 5, "/proc/no"),
        (vec!["--accel", "quadtree"], 2, "quadtree"),
    ] {
        let run = bench(&arguments);
        let error = String::from_utf8(run.stderr).unwrap();
        assert!(run.status.code() == Some(code) && error.contains(message), "{arguments:?}: {:?} {error}", run.status);
    }
    let run = Command::new(PROGRAM).args(["bench", "scale-case"]).stdin(Stdio::null()).output().unwrap();
    assert!(run.status.code() == Some(2), "{run:?}");
}
