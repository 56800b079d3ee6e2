use std::process::{Command, Output};

use serde_json::Value;

use crate::util::folder::Folder;

fn bench(folder: &Folder, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_steradian");
    let out = folder.path("out");
    Command::new(program)
        .args(["bench", "stability", "--quick", "-q", "--out"])
        .arg(out)
        .args(arguments)
        .output()
        .unwrap()
}

fn report(folder: &Folder) -> Value {
    serde_json::from_slice(&std::fs::read(folder.path("out/stability.json")).unwrap()).unwrap()
}

#[test]
fn an_interrupted_run_is_taken_up() {
    let folder = Folder::new();
    assert_eq!(bench(&folder, &["K2"]).status.code(), Some(0));
    let mut before = report(&folder);
    assert_eq!(before["interrupted"], false);
    before["checks"][0]["seconds"] = Value::from(12_345.0);
    folder.write("out/stability.json", before.to_string());
    let seconds = |index: usize| report(&folder)["checks"][index]["seconds"].as_f64().unwrap();

    assert_eq!(bench(&folder, &["K1", "K2", "--resume"]).status.code(), Some(0));
    assert_eq!(report(&folder)["checks"].as_array().unwrap().len(), 2);
    assert!(seconds(0) < 1000.0 && seconds(1) == 12_345.0);

    // What failed is measured again, and so is everything without `--resume`.
    let mut failed = report(&folder);
    failed["checks"][1]["outcome"]["measures"][0]["bound"] = serde_json::json!({ "at_most": -1.0 });
    folder.write("out/stability.json", failed.to_string());
    bench(&folder, &["K1", "K2", "--resume"]);
    assert!(seconds(1) < 1000.0);
    assert_eq!(report(&folder)["checks"][1]["status"], "passed");
}
