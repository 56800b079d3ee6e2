use std::process::{Command, Output};

use serde_json::Value;

use crate::util::folder::Folder;

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).args(["bench", "accel"]).args(arguments).output().unwrap()
}

fn scene() -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/cornell.json").to_owned()
}

#[test]
fn reports_hold_every_accelerator_on_the_same_rays() {
    let folder = Folder::new();
    let out = folder.write("here", "").with_file_name("report");
    let out = out.to_str().unwrap();
    let run = bench(&[
        &scene(),
        "--rays",
        "400",
        "--rounds",
        "1",
        "--threads",
        "1,2",
        "--scaling",
        "1e3..1e4",
        "--out",
        out,
        "-q",
    ]);
    assert!(run.status.success(), "{run:?}");
    let read = |name: &str| std::fs::read_to_string(format!("{out}/{name}")).unwrap();
    let report: Value = serde_json::from_str(&read("accel.json")).unwrap();
    let scene = &report["scenes"][0];
    let kinds: Vec<_> = scene["rays"].as_array().unwrap().iter().map(|k| k[0].as_str().unwrap()).collect();
    assert_eq!(kinds, ["camera", "shadow", "first_bounce", "deep_bounce", "ambient_occlusion"]);
    let accels = scene["accels"].as_array().unwrap();
    let names: Vec<_> = accels.iter().map(|a| a["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["embree", "bvh", "kdtree", "octree", "linear", "packets", "hybrid"]);
    for accel in accels {
        let own = !["embree", "packets", "hybrid"].iter().any(|name| accel["name"] == *name);
        for kind in accel["kinds"].as_array().unwrap() {
            let agreement = &kind["agreement"];
            assert_eq!(agreement["different"], 0, "{accel}");
            assert!(agreement["rays"].as_u64().unwrap() > 100, "{accel}");
            assert!(!own || agreement["identical"] == agreement["rays"], "{accel}");
            let rates = kind["rates"].as_array().unwrap();
            assert!(
                rates.len() >= 2 && rates.iter().all(|r| r["mrays_per_second"][0].as_f64().unwrap() > 0.0),
                "{accel}"
            );
        }
        assert_eq!(
            accel["structure"].is_null(),
            ["embree", "linear", "hybrid"].iter().any(|name| accel["name"] == *name)
        );
    }
    let csv = read("accel.csv");
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().count() > 40 && columns == 19, "{columns}");
    assert!(read("accel.md").contains("| bvh |"));
    let html = read("accel.html");
    // The only address is the name of SVG's namespace.
    assert_eq!(html.matches("http").count(), html.matches("http://www.w3.org/2000/svg").count());
    assert!(html.matches("<svg").count() == 4 && html.ends_with("</html>\n"));
    // Nodes visited, of every accelerator whose structure is open.
    assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 4);
    assert!(html.contains("answers agree with the oracle"), "{html}");
}

#[test]
fn one_ray_is_answered_by_each() {
    let run = bench(&[&scene(), "--ray=0,1.1,4.9,0.01,0,-1", "--accel", "linear,bvh,embree"]);
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success() && text.lines().count() == 3, "{text}");
    let answers: Vec<_> = text.lines().map(|line| line.split_once("t ").unwrap().1).collect();
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn mistakes_are_named() {
    for (arguments, code, message) in [
        (vec![], 2, "name a scene"),
        (vec!["missing.json"], 4, "missing.json"),
        (vec!["a.json", "--accel", "embree,quadtree"], 2, "quadtree"),
        (vec!["a.json", "--rays", "0"], 2, "--rays"),
        (vec!["--scaling", "1e7..1e3"], 2, "such as 1e3..1e7"),
        (vec![scene().leak(), "--ray=1,2,3"], 2, "--ray"),
        (vec![scene().leak(), "--out", "/proc/no"], 5, "/proc/no"),
    ] {
        let run = bench(&arguments);
        let error = String::from_utf8(run.stderr).unwrap();
        assert!(run.status.code() == Some(code) && error.contains(message), "{arguments:?}: {:?} {error}", run.status);
    }
}
