//! Other processes that a benchmark starts.

use std::fs::File;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};

/// Characters of a failed command's messages that are shown.
const TAIL: usize = 400;

/// Between two looks at whether a command has ended: a hundredth of the shortest that is worth measuring.
const PERIOD: Duration = Duration::from_millis(2);

/// A process that has ended by itself.
pub struct Ended {
    pub status: ExitStatus,
    /// Seconds from its start to its end.
    pub seconds: f64,
    /// Processor seconds of it and of all it waited for, to a hundredth.
    pub processor_seconds: f64,
    /// What it wrote to standard output.
    pub stdout: String,
    /// The end of what it wrote to standard error, in one line.
    pub stderr: String,
}

/// Runs a command, with a text on its standard input; `None` if `stop` came first, after which nothing of it runs.
pub fn run(command: &mut Command, input: Option<&str>, stop: &AtomicBool) -> Result<Option<Ended>, String> {
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for its files: {e}"))?;
    let [input_file, output_file, error_file] = ["stdin", "stdout", "stderr"].map(|name| folder.path().join(name));
    let fault = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    let create = |path: &Path| File::create(path).map_err(|e| fault(path, e));
    let stdin = match input {
        None => Stdio::null(),
        Some(text) => {
            create(&input_file)?.write_all(text.as_bytes()).map_err(|e| fault(&input_file, e))?;
            File::open(&input_file).map_err(|e| fault(&input_file, e))?.into()
        }
    };
    let (start, before) = (Instant::now(), processor_seconds_of_children());
    let mut child = command
        // Of its own, so that all of it can be ended.
        .process_group(0)
        .stdin(stdin)
        .stdout(create(&output_file)?)
        .stderr(create(&error_file)?)
        .spawn()
        .map_err(|e| format!("it cannot be started: {e}"))?;
    let Some(status) = wait(&mut child, stop).map_err(|e| e.to_string())? else { return Ok(None) };
    let seconds = start.elapsed().as_secs_f64();
    let processor_seconds = processor_seconds_of_children() - before;
    let text = |path: &Path| String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned();
    Ok(Some(Ended { status, seconds, processor_seconds, stdout: text(&output_file), stderr: tail(&text(&error_file)) }))
}

/// Processor seconds of all processes that this one has waited for; 0 where the system does not provide it.
fn processor_seconds_of_children() -> f64 {
    // Fields 16 and 17 of proc_pid_stat(5), the 14th and 15th after the name, in ticks.
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace();
    let ticks: u64 = fields.skip(13).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    ticks as f64 / rustix::param::clock_ticks_per_second() as f64
}

/// Waits for the end; `None` if `stop` came first.
fn wait(child: &mut Child, stop: &AtomicBool) -> std::io::Result<Option<ExitStatus>> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if stop.load(Ordering::Relaxed) {
            // It may have ended in between, which is as well.
            let _ = kill_process_group(Pid::from_child(child), Signal::TERM);
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(PERIOD);
    }
}

/// The end of a text, in one line.
fn tail(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let line = words.join(" ");
    let skipped = line.chars().count().saturating_sub(TAIL);
    let end: String = line.chars().skip(skipped).collect();
    if end.is_empty() { "(nothing)".into() } else { end }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_reads_its_input_and_returns_its_status() {
        let work = "cat; echo no >&2; i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done; exit 3";
        let ended = run(Command::new("sh").args(["-c", work]), Some("a text"), &AtomicBool::new(false));
        let ended = ended.unwrap().unwrap();
        assert!(ended.processor_seconds > 0.0, "{}", ended.processor_seconds);
        assert_eq!((ended.status.code(), ended.stdout.as_str(), ended.stderr.as_str()), (Some(3), "a text", "no"));
        assert_eq!(tail(&"ab ".repeat(1000)).chars().count(), TAIL);
    }

    #[test]
    fn a_stopped_command_ends_with_all_it_started() {
        let folder = tempfile::tempdir().unwrap();
        let (started, grandchild) = (folder.path().join("started"), folder.path().join("pid"));
        let stop = AtomicBool::new(false);
        let ended = std::thread::scope(|scope| {
            scope.spawn(|| {
                let start = Instant::now();
                while !started.exists() && start.elapsed() < Duration::from_secs(60) {
                    std::thread::sleep(PERIOD);
                }
                stop.store(true, Ordering::Relaxed);
            });
            run(
                Command::new("sh").args(["-c", "sleep 300 & echo $! >pid; touch started; wait"]).current_dir(&folder),
                None,
                &stop,
            )
        });
        assert!(ended.unwrap().is_none() && started.exists());
        // Whoever takes over an orphan reaps it later; until then it is a zombie.
        let pid = std::fs::read_to_string(grandchild).unwrap();
        let is_running =
            || std::fs::read_to_string(format!("/proc/{}/stat", pid.trim())).is_ok_and(|stat| !stat.contains(") Z "));
        let start = Instant::now();
        while is_running() {
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(PERIOD);
        }
    }
}
