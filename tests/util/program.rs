//! The program as its users and scripts start it.

use std::path::Path;
use std::process::{Command, Output};

/// A small scene.
pub const SCENE: &str = r#"{
    "film": { "width": 24, "height": 16 },
    "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
    // Said in the scene, though it is the default.
    "sampler": { "spp": 2, "seed": 0 },
    "shapes": [{ "type": "sphere", "radius": 1 }],
    "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
}"#;

/// A command in a folder that holds `scene.json`, clear of the user's own configuration.
pub fn steradian(folder: &Path, arguments: &str) -> Command {
    std::fs::write(folder.join("scene.json"), SCENE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command.current_dir(folder).args(arguments.split_whitespace()).env("XDG_CONFIG_HOME", folder.join("config"));
    for variable in ["NO_COLOR", "CLICOLOR_FORCE", "SLURM_CPUS_PER_TASK", "CUE_THREADS"] {
        command.env_remove(variable);
    }
    command
}

pub fn run(folder: &Path, arguments: &str) -> Output {
    steradian(folder, arguments).output().unwrap()
}

/// What the program said on stderr.
pub fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
