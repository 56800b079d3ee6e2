//! Renders with `--guide`: as those without guiding they are split, cropped, replayed and rendered again.

use std::path::Path;

use serde_json::json;
use steradian::internal::film::LayerKind;
use steradian::internal::output::read_exr;

use crate::guiding::room_with_shaft;
use crate::util::program::{run, stderr_of};

/// A folder with a room as `room.json` and guides for it in `a.state` and `b.state`.
fn trained() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut room = room_with_shaft(0.3);
    room["film"] = json!({ "width": 192, "height": 192, "filter": { "type": "box" } });
    std::fs::write(folder.path().join("room.json"), room.to_string()).unwrap();
    for (name, spp) in [("a", 16), ("b", 8)] {
        run_ok(folder.path(), &format!("render room.json --guiding --spp {spp} --checkpoint {name}.state -o t.exr"));
    }
    folder
}

#[track_caller]
fn run_ok(folder: &Path, arguments: &str) -> String {
    let output = run(folder, &format!("{arguments} -q"));
    assert!(output.status.success(), "{arguments}: {}", stderr_of(&output));
    String::from_utf8(output.stdout).unwrap()
}

/// The exit code of a command that fails, after a check of its message.
#[track_caller]
fn refused(folder: &Path, arguments: &str, expected: &str) -> i32 {
    let output = run(folder, arguments);
    let message = stderr_of(&output);
    assert!(message.contains(expected), "{arguments}: {message}");
    output.status.code().unwrap()
}

fn pixels(folder: &Path, name: &str) -> Vec<f32> {
    read_exr(&folder.join(name)).unwrap().layer(LayerKind::Color).unwrap().data.clone()
}

#[test]
fn renders_with_a_trained_guide_are_split_cropped_and_replayed() {
    let folder = trained();
    let dir = folder.path();
    run_ok(dir, "render room.json --guide a.state --spp 7 --float --threads 2 -o whole.exr");
    let whole = pixels(dir, "whole.exr");
    run_ok(dir, "render room.json --spp 7 --float -o plain.exr");
    assert_ne!(whole, pixels(dir, "plain.exr"));
    for shard in 1..=3 {
        run_ok(
            dir,
            &format!("render room.json --guide a.state --spp 7 --float --threads 1 --shard {shard}/3 -o {shard}.shard"),
        );
    }
    run_ok(dir, "merge 3.shard 1.shard 2.shard -o merged.exr");
    assert!(pixels(dir, "merged.exr") == whole);

    // More samples after a checkpoint.
    run_ok(dir, "render room.json --guide a.state --spp 2 --float --checkpoint c.state -o c.exr");
    run_ok(dir, "render room.json --guide a.state --spp 7 --float --checkpoint c.state --resume -o c.exr");
    assert!(pixels(dir, "c.exr") == whole);

    run_ok(dir, "render room.json --guide a.state --spp 7 --float --crop 33,20,9,4 -o crop.exr");
    let row = |y: usize| whole[4 * (192 * y + 33)..][..4 * 9].to_vec();
    assert!(pixels(dir, "crop.exr") == (20..24).flat_map(row).collect::<Vec<_>>());

    run_ok(dir, "render room.json --guide a.state --spp 1 --float -o one.exr");
    let replayed = run_ok(dir, "render room.json --guide a.state --pixel 40,50 --sample 0");
    let one = &pixels(dir, "one.exr")[4 * (192 * 50 + 40)..][..3];
    assert!(replayed.contains(&format!("radiance  {} {} {}\n", one[0], one[1], one[2])), "{replayed} {one:?}");

    run_ok(dir, "render room.json --guide a.state --target-error 10 --float -o adaptive.exr");
}

/// Half the squared difference of two renders is the variance of one. Errors without the thousandth of the pixels where
/// they are largest: over 24 guides their ratio was 0.524 with a standard deviation of 0.023, whereas rare bright
/// pixels make that of all errors vary by 0.07.
#[test]
fn a_trained_guide_lowers_the_error_and_keeps_the_mean() {
    let folder = trained();
    let dir = folder.path();
    let statistics = |options: &str| {
        for seed in [1, 2] {
            run_ok(dir, &format!("render room.json {options} --spp 16 --float --seed {seed} -o {seed}.exr"));
        }
        let (a, b) = (pixels(dir, "1.exr"), pixels(dir, "2.exr"));
        let mean = a.iter().chain(&b).map(|v| f64::from(*v)).sum::<f64>() / (a.len() + b.len()) as f64;
        let differences = a.iter().zip(&b).map(|(a, b)| f64::from(a - b).powi(2));
        let mut errors = differences.collect::<Vec<_>>();
        errors.sort_by(f64::total_cmp);
        let typical = errors[..errors.len() - errors.len() / 1000].iter().sum::<f64>();
        (mean, typical, errors.iter().sum::<f64>())
    };
    let (guided, plain) = (statistics("--guide a.state"), statistics(""));
    assert!(guided.1 < 0.7 * plain.1, "{guided:?} {plain:?}");
    // The standard error of each mean by the differences of its pixels, which are independent.
    let deviation = (guided.2 + plain.2).sqrt() / (2.0 * 192.0 * 192.0 * 4.0);
    assert!((guided.0 - plain.0).abs() < 5.0 * deviation, "{guided:?} {plain:?} {deviation}");
}

#[test]
fn the_guide_is_part_of_what_a_picture_depends_on() {
    let folder = trained();
    let dir = folder.path();
    let render = "render room.json --spp 4 --float";
    run_ok(dir, &format!("{render} --guide a.state -o a.exr"));
    assert_eq!(refused(dir, "rerender a.exr -o again.exr", "--guide: the picture was rendered with a guide"), 2);
    assert_eq!(refused(dir, "rerender a.exr --guide b.state -o again.exr", "b.state: it holds another guide"), 6);
    run_ok(dir, "rerender a.exr --guide a.state -o again.exr");
    assert!(pixels(dir, "again.exr") == pixels(dir, "a.exr"));

    run_ok(dir, &format!("{render} --guide a.state --shard 1/2 -o 1.shard"));
    run_ok(dir, &format!("{render} --guide b.state --shard 2/2 -o 2.shard"));
    assert_eq!(refused(dir, "merge 1.shard 2.shard -o m.exr", "guide.digest: "), 6);
}

#[test]
fn files_that_hold_no_guide_are_refused() {
    let folder = trained();
    let dir = folder.path();
    run_ok(dir, "render room.json --spp 2 --checkpoint p.state -o t.exr");
    assert_eq!(refused(dir, "render room.json --guide p.state", "p.state: it is the state of a render without"), 6);
    assert_eq!(refused(dir, "render room.json --guide none.state", "none.state"), 4);
    assert_eq!(refused(dir, "render room.json --guide room.json", "room.json"), 6);
    let bytes = std::fs::read(dir.join("a.state")).unwrap();
    std::fs::write(dir.join("cut.state"), &bytes[..bytes.len() / 2]).unwrap();
    assert_eq!(refused(dir, "render room.json --guide cut.state", "cut.state"), 6);
    assert_eq!(refused(dir, "render room.json --guide a.state --stats a.state", "a.state"), 2);
    assert_eq!(refused(dir, "render room.json --guide a.state --integrator normal", "--guide"), 2);
    assert!(std::fs::read(dir.join("a.state")).unwrap() == bytes);

    // Under an even sky there is nothing to learn.
    let open = json!({
        "camera": { "position": [0, 1, 4], "look_at": [0, 0, 0] },
        "film": { "width": 64, "height": 64 },
        "shapes": [{ "type": "sphere", "radius": 1 }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
    });
    std::fs::write(dir.join("open.json"), open.to_string()).unwrap();
    run_ok(dir, "render open.json --guiding --spp 32 --checkpoint o.state -o t.exr");
    assert_eq!(refused(dir, "render open.json --guide o.state", "o.state: guiding did not pay"), 6);
}
