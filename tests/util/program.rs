//! The program as its users and scripts start it.

use std::ops::{Deref, DerefMut};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

pub use rustix::process::Signal;
use rustix::process::{Pid, kill_process, kill_process_group};

/// A small scene.
pub const SCENE: &str = r#"{
    "film": { "width": 24, "height": 16 },
    "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
    // Given in the scene, though it is the default.
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

/// What the program printed to stderr.
pub fn stderr_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A process in a group of its own. When it is dropped, as in a test that fails, it and what it started are ended: by
/// SIGTERM, which programs pass on to groups they made themselves, then by SIGKILL.
pub struct Running {
    /// `None` once its output is collected.
    child: Option<Child>,
}

impl Running {
    pub fn start(command: &mut Command) -> Self {
        Self { child: Some(command.process_group(0).spawn().unwrap()) }
    }

    /// Sends a signal to the process alone.
    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(self), signal).unwrap();
    }

    /// Waits for the end; what it wrote to pipes nobody reads.
    pub fn output(mut self) -> Output {
        self.child.take().unwrap().wait_with_output().unwrap()
    }
}

impl Deref for Running {
    type Target = Child;

    fn deref(&self) -> &Child {
        self.child.as_ref().unwrap()
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        self.child.as_mut().unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let Some(child) = &mut self.child else { return };
        let (group, start) = (Pid::from_child(child), Instant::now());
        // Pipes that are full would keep the process from ending.
        drop((child.stdin.take(), child.stdout.take(), child.stderr.take()));
        // An error means that nothing of the group is left.
        let _ = kill_process_group(group, Signal::TERM);
        while matches!(child.try_wait(), Ok(None)) && start.elapsed() < Duration::from_secs(1) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = kill_process_group(group, Signal::KILL);
        let _ = child.wait();
    }
}

#[test]
fn no_process_outlives_its_test() {
    let folder = tempfile::tempdir().unwrap();
    let mut pids = Vec::new();
    // The first ignores SIGTERM, as does what it starts.
    for line in ["trap '' TERM; sleep 300 & echo $! >pid; wait", "sleep 300 & echo $! >pid; wait"] {
        let running = Running::start(Command::new("sh").args(["-c", line]).current_dir(&folder));
        let start = Instant::now();
        let pid = loop {
            match std::fs::read_to_string(folder.path().join("pid")) {
                Ok(text) if text.ends_with('\n') => break text.trim().to_owned(),
                _ => assert!(start.elapsed() < Duration::from_secs(60)),
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        std::fs::remove_file(folder.path().join("pid")).unwrap();
        pids.extend([running.id().to_string(), pid]);
    }
    // Whoever takes over an orphan reaps it later; until then it is a zombie.
    let is_running =
        |pid: &String| std::fs::read_to_string(format!("/proc/{pid}/stat")).is_ok_and(|stat| !stat.contains(") Z "));
    let start = Instant::now();
    while pids.iter().any(is_running) {
        assert!(start.elapsed() < Duration::from_secs(60), "{pids:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
