//! Other renderers, started by a command.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;

use serde_json::Value;

use super::plan::{Budget, Measured};
use crate::Spent;
use crate::child::{self, Ended};
use crate::output::read_exr;
use steradian::{Error, Result};

/// A command that renders the scene into an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct External {
    name: String,
    template: String,
    scene: PathBuf,
    /// What the command reads from standard input.
    input: Option<&'static str>,
    /// The option that named it, for messages.
    option: &'static str,
}

impl External {
    /// A command with `{out}`, `{spp}` or `{seconds}`, and optionally `{scene}` and `{seed}`, for the shell.
    ///
    /// # Errors
    /// [`Error::Usage`] if it lacks one that `budgets` need.
    pub fn new(name: &str, template: &str, scene: &Path, budgets: &[Budget]) -> Result<Self> {
        let needs = |word: &str, why: &str| {
            if template.contains(word) {
                Ok(())
            } else {
                Err(Error::Usage(format!("--external {name}: the command has no {word}, {why}")))
            }
        };
        needs("{out}", "the EXR file that it shall write")?;
        match budgets.first() {
            Some(Budget::Seconds(_)) => needs("{seconds}", "the time that it may take, of --times")?,
            _ => needs("{spp}", "the samples per pixel, of --spp")?,
        }
        let (name, template, scene) = (name.to_owned(), template.to_owned(), scene.to_owned());
        Ok(Self { name, template, scene, input: None, option: "--external" })
    }

    /// A command that reads a script from standard input and takes the scene and the options `--spp`, `--seed` and
    /// `--out`.
    pub(super) fn script(name: &str, words: &[String], script: &'static str, scene: &Path) -> Self {
        let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
        let template = format!("{} --spp {{spp}} --seed {{seed}} --out {{out}} {{scene}}", words.join(" "));
        Self { name: name.to_owned(), template, scene: scene.to_owned(), input: Some(script), option: "--peer" }
    }

    /// Runs the command; `None` if interrupted.
    pub(super) fn run(&self, budget: Budget, seed: u64, stop: &AtomicBool) -> Result<Option<Measured>> {
        let failed = |message: String| Error::Internal(format!("{} {}: {message}", self.option, self.name));
        let folder = tempfile::tempdir().map_err(|e| failed(format!("no folder for its files: {e}")))?;
        let out = folder.path().join("out.exr");
        let line = self.line(&out, budget, seed);
        let ended = child::run(Command::new("sh").args(["-c", &line]), self.input, stop).map_err(failed)?;
        let Some(Ended { status, seconds: process_seconds, processor_seconds, stdout, stderr }) = ended else {
            return Ok(None);
        };
        if !status.success() || !out.exists() {
            let what = if status.success() { "it wrote no {out}".to_owned() } else { status.to_string() };
            return Err(failed(format!("{what}; command: {line}; its messages end in: {stderr}")));
        }
        let image = read_exr(&out).map_err(|e| failed(e.to_string()))?;
        let printed = PrintedStatistics::in_text(&stdout);
        let spp = printed.spp.or(if let Budget::Spp(spp) = budget { Some(spp) } else { None });
        Ok(Some(Measured {
            seconds: printed.seconds.unwrap_or(process_seconds),
            process_seconds: Some(process_seconds),
            // How many threads it started is not known: the share of their time is not judged.
            spent: Spent {
                processor_seconds: printed.processor_seconds.unwrap_or(processor_seconds),
                ..Spent::default()
            },
            spp,
            samples: spp.map(|spp| u64::from(spp) * image.crop.area()),
            rays: None,
            dropped: 0,
            image,
        }))
    }

    /// The command, its words for the shell filled in.
    fn line(&self, out: &Path, budget: Budget, seed: u64) -> String {
        let quote = |path: &Path| quoted(&path.to_string_lossy());
        let line = match budget {
            Budget::Spp(spp) => self.template.replace("{spp}", &spp.to_string()),
            Budget::Seconds(seconds) => self.template.replace("{seconds}", &seconds.to_string()),
        };
        line.replace("{seed}", &seed.to_string()).replace("{scene}", &quote(&self.scene)).replace("{out}", &quote(out))
    }
}

/// One word for the shell.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Statistics that a renderer prints to standard output as JSON.
#[derive(Debug, Default, PartialEq)]
struct PrintedStatistics {
    /// Seconds of the render without what comes before.
    seconds: Option<f64>,
    /// Processor seconds of the same.
    processor_seconds: Option<f64>,
    /// Samples per pixel done.
    spp: Option<u32>,
}

impl PrintedStatistics {
    /// In the whole text or in one of its lines: `render_seconds`, `processor_seconds` and `spp`, or an object with
    /// `runs`, whose last has `render_s`, `cpu_s` and `eff_spp`.
    fn in_text(text: &str) -> Self {
        let objects = std::iter::once(text).chain(text.lines().filter(|line| line.starts_with('{')));
        let values = objects.filter_map(|object| serde_json::from_str::<Value>(object).ok());
        values.map(|value| Self::in_value(&value)).find(|printed| printed.seconds.is_some()).unwrap_or_default()
    }

    fn in_value(value: &Value) -> Self {
        let run = value["runs"].as_array().and_then(|runs| runs.last()).unwrap_or(value);
        let first = |value: &Value| value.as_f64().or_else(|| value.get(0).and_then(Value::as_f64));
        let seconds = first(&run["render_s"]).or_else(|| first(&run["render_seconds"]));
        let spp = first(&run["eff_spp"]).or_else(|| first(&run["spp"]));
        let processor_seconds = first(&run["cpu_s"]).or_else(|| first(&run["processor_seconds"]));
        let positive = |seconds: Option<f64>| seconds.filter(|s| s.is_finite() && *s > 0.0);
        Self {
            seconds: positive(seconds),
            processor_seconds: positive(processor_seconds),
            spp: spp.filter(|n| *n >= 1.0).map(|n| n.round() as u32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn external(template: &str) -> Result<External> {
        External::new("x", template, Path::new("it's/a scene.xml"), &[Budget::Spp(4)])
    }

    fn failure(template: &str) -> String {
        match external(template).unwrap().run(Budget::Spp(4), 7, &AtomicBool::new(false)) {
            Err(e) => e.to_string(),
            Ok(_) => panic!("{template} works"),
        }
    }

    #[test]
    fn words_of_the_template_are_filled_in_for_the_shell() {
        let line = external("r {scene} -n{spp} --seed {seed} -o {out}").unwrap().line(
            Path::new("a b/o.exr"),
            Budget::Spp(4),
            7,
        );
        assert_eq!(line, r"r 'it'\''s/a scene.xml' -n4 --seed 7 -o 'a b/o.exr'");
        let timed = External::new("x", "r {seconds} {out}", Path::new("s"), &[Budget::Seconds(0.5)]).unwrap();
        assert_eq!(timed.line(Path::new("o"), Budget::Seconds(0.5), 7), "r 0.5 'o'");
        for (template, missing) in [("r {spp}", "{out}"), ("r {out}", "{spp}")] {
            assert!(external(template).unwrap_err().to_string().contains(missing));
        }
        assert!(
            External::new("x", "r {spp} {out}", Path::new("s"), &[Budget::Seconds(1.0)])
                .unwrap_err()
                .to_string()
                .contains("{seconds}")
        );
    }

    #[test]
    fn failures_name_the_command_and_the_end_of_what_it_said() {
        let message = failure("echo {spp} {out} >/dev/null; echo some trouble >&2; exit 3");
        assert!(message.starts_with("--external x: exit status: 3") && message.ends_with("some trouble"), "{message}");
        let message = failure("true {spp} {out}");
        assert!(message.contains("it wrote no {out}") && message.ends_with("(nothing)"), "{message}");
        assert!(failure("echo nonsense {spp} > {out}").contains("out.exr"));
    }

    #[test]
    fn a_stop_ends_the_command() {
        let stop = AtomicBool::new(true);
        let command = External::new("x", "sleep 1000; echo {spp} {out}", Path::new("s"), &[]).unwrap();
        assert!(command.run(Budget::Spp(1), 0, &stop).unwrap().is_none());
    }

    #[test]
    fn statistics_are_read_from_standard_output() {
        let printed = |seconds, spp| PrintedStatistics {
            seconds: Some(seconds),
            processor_seconds: Some(2.0 * seconds),
            spp: Some(spp),
        };
        assert_eq!(
            PrintedStatistics::in_text("{\"render_seconds\": 1.5,\n\"processor_seconds\": 3, \"spp\": 16}\n"),
            printed(1.5, 16)
        );
        let line = "noise\n{\"load_s\": 1, \"runs\": [{\"render_s\": [9]}, {\"render_s\": [0.25, 0.3], \
                    \"cpu_s\": [0.5], \"eff_spp\": 16.4}]}\n";
        assert_eq!(PrintedStatistics::in_text(line), printed(0.25, 16));
        assert_eq!(PrintedStatistics::in_text("{}\n{ broken"), PrintedStatistics::default());
        assert_eq!(PrintedStatistics::in_text("Rendering 4 s"), PrintedStatistics::default());
    }
}
