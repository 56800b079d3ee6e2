//! Job scripts for Slurm.

use super::job::{Job, quote, quote_path};
use crate::error::{Error, Result};
use crate::printable;

/// The resources requested from Slurm.
#[derive(Clone, Debug, Default)]
pub struct SlurmOptions {
    /// `--partition`.
    pub partition: Option<String>,
    /// `--time`, of each shard.
    pub time: Option<String>,
    /// `--cpus-per-task`, of each shard.
    pub cpus: Option<u32>,
    /// `--mem`, of each shard.
    pub memory: Option<String>,
    /// Further options of `sbatch`, such as `--account=show`.
    pub further: Vec<String>,
    /// How often a shard is rendered again after it has failed by itself. Lost nodes do not count.
    pub retries: u32,
}

/// A script: its name and its text.
pub type Script = (&'static str, String);

/// The scripts of a job, for its folder: `render.sh` for the array of shards, `merge.sh` for the job that waits for
/// them, and `submit.sh`, which submits both for every frame.
///
/// A task whose node is lost, which is preempted or reaches its time limit is queued again and goes on from its
/// checkpoint; one that fails by itself is rendered again some times, unless its exit code marks a permanent failure.
///
/// # Errors
/// [`Error::Usage`] if what stands in a directive for `sbatch`, which is a comment of the shell, has a control
/// character such as a line break.
pub fn slurm_scripts(job: &Job, options: &SlurmOptions) -> Result<[Script; 3]> {
    check_directives(job, options)?;
    // In names of logs, `%` begins a pattern.
    let folder = job.folder.to_string_lossy().replace('%', "%%");
    let log = |kind: &str| quote(&format!("{folder}/log/{kind}"));
    let words = |words: &[String]| words.iter().map(|word| quote(word)).collect::<Vec<_>>().join(" ");
    let render = [
        ("SBATCH", sbatch(options, true)),
        ("LOG", log("%x-%A_%a.log")),
        ("OPTIONS", words(&job.options)),
        ("RETRIES", options.retries.to_string()),
        ("EVERY", job.every.to_string()),
    ];
    let merge = [("SBATCH", sbatch(options, false)), ("LOG", log("%x-%j.log"))];
    let overwrite = if job.overwrite { "1" } else { "" };
    let submit = [("SUBMIT", calls(job)), ("SUMMARY", summary(job)), ("OVERWRITE", overwrite.to_owned())];
    Ok([
        ("render.sh", fill(include_str!("slurm/render.sh"), job, &render)),
        ("merge.sh", fill(include_str!("slurm/merge.sh"), job, &merge)),
        ("submit.sh", fill(include_str!("slurm/submit.sh"), job, &submit)),
    ])
}

/// A line break would end the comment, and what follows would be a command.
fn check_directives(job: &Job, options: &SlurmOptions) -> Result<()> {
    let folder = job.folder.to_string_lossy();
    let named = [("the job's name", Some(&*job.name)), ("--dir", Some(&*folder))];
    let optional = [("--partition", &options.partition), ("--walltime", &options.time), ("--mem", &options.memory)];
    let optional = optional.into_iter().map(|(what, text)| (what, text.as_deref()));
    let further = options.further.iter().map(|text| ("--sbatch", Some(text.as_str())));
    let odd = |text: &&str| printable::line(text) != **text;
    match named.into_iter().chain(optional).chain(further).find_map(|(what, text)| Some((what, text.filter(odd)?))) {
        Some((what, text)) => {
            Err(Error::Usage(format!("{what}: {text:?} has characters that cannot stand in a job script")))
        }
        None => Ok(()),
    }
}

/// The script with every `@NAME@` replaced, in one pass, so that nothing within a value is taken for a name.
fn fill(script: &str, job: &Job, values: &[(&str, String)]) -> String {
    let value = |name: &str| match name {
        "JOB" => Some(quote(&job.name)),
        "PROGRAM" => Some(quote_path(&job.program)),
        "SCENE" => Some(quote_path(&job.scene)),
        "FOLDER" => Some(quote_path(&job.folder)),
        "SHARDS" => Some(job.shards.to_string()),
        _ => values.iter().find(|(known, _)| *known == name).map(|(_, value)| value.clone()),
    };
    let mut out = String::with_capacity(script.len() * 2);
    let mut rest = script;
    while let Some((before, after)) = rest.split_once('@') {
        out.push_str(before);
        match after.split_once('@').and_then(|(name, after)| value(name).map(|value| (value, after))) {
            Some((value, after)) => {
                out.push_str(&value);
                rest = after;
            }
            None => {
                out.push('@');
                rest = after;
            }
        }
    }
    out + rest
}

/// Lines for `sbatch` at the head of a script.
fn sbatch(options: &SlurmOptions, shard: bool) -> String {
    let line = |name: &str, value: &str| format!("#SBATCH --{name}={}", quote(value));
    let mut lines: Vec<String> = options.partition.iter().map(|name| line("partition", name)).collect();
    if shard {
        lines.extend(options.time.iter().map(|time| line("time", time)));
        lines.extend(options.cpus.iter().map(|cpus| line("cpus-per-task", &cpus.to_string())));
    }
    lines.extend(options.memory.iter().map(|memory| line("mem", memory)));
    lines.extend(options.further.iter().map(|option| format!("#SBATCH {option}")));
    lines.join("\n")
}

/// A call of `submit` for each frame.
fn calls(job: &Job) -> String {
    let call = |frame: Option<i64>| {
        let number = frame.map_or("''".to_owned(), |frame| frame.to_string());
        let outputs: Vec<String> = job.outputs_of_frame(frame).iter().map(|output| quote_path(output)).collect();
        format!("submit {number} {}", outputs.join(" "))
    };
    match &job.frames {
        None => call(None),
        Some(frames) => frames.numbers().iter().map(|frame| call(Some(*frame))).collect::<Vec<_>>().join("\n"),
    }
}

/// What the job is, for the eye.
fn summary(job: &Job) -> String {
    let frames = job.frames.as_ref().map_or(String::new(), |frames| format!(", frames {}", frames.ranges('x')));
    format!("{}: {} shards{frames}", printable::line(&job.name), job.shards)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job() -> Job {
        Job {
            name: "room".to_owned(),
            program: "/opt/steradian".into(),
            scene: "/show/my room.json".into(),
            outputs: vec!["/show/room.####.exr".into(), "/show/it's.%02d.png".into()],
            folder: "/show/room.farm".into(),
            shards: 4,
            frames: Some("1-3x2".parse().unwrap()),
            overwrite: false,
            every: 30,
            options: vec!["--spp".to_owned(), "64".to_owned(), "--layers=Z,N".to_owned()],
        }
    }

    #[test]
    fn scripts_hold_the_requested_options() {
        let options = SlurmOptions {
            partition: Some("farm".to_owned()),
            time: Some("2:00:00".to_owned()),
            cpus: Some(8),
            memory: Some("16G".to_owned()),
            further: vec!["--account=show".to_owned()],
            retries: 2,
        };
        let [(_, render), (_, merge), (_, submit)] = slurm_scripts(&job(), &options).unwrap();
        for line in [
            "#SBATCH --partition=farm",
            "#SBATCH --time=2:00:00",
            "#SBATCH --cpus-per-task=8",
            "#SBATCH --mem=16G",
            "#SBATCH --account=show",
            "#SBATCH --requeue",
            "#SBATCH --signal=B:USR1@120",
            "#SBATCH --output=/show/room.farm/log/%x-%A_%a.log",
            "scene='/show/my room.json'",
            "options=(--spp 64 --layers=Z,N)",
            "retries=2",
        ] {
            assert!(render.lines().any(|l| l == line), "{line}\n{render}");
        }
        assert!(render.contains("--every 30 --resume"));
        assert!(merge.contains("#SBATCH --mem=16G") && !merge.contains("--cpus-per-task"));
        assert!(
            submit.contains("submit 1 /show/room.0001.exr '/show/it'\\''s.01.png'\nsubmit 3 /show/room.0003.exr"),
            "{submit}"
        );
        // Every place is filled, and what precedes the directives is comments: Slurm stops reading them at the first
        // command.
        for script in [&render, &merge, &submit] {
            let left = script.split('@').find(|part| part.len() > 2 && part.chars().all(|c| c.is_ascii_uppercase()));
            assert_eq!(left, None, "{script}");
        }
        for script in [&render, &merge] {
            let first_command = script.lines().position(|line| !line.is_empty() && !line.starts_with('#')).unwrap();
            let last_directive =
                script.lines().collect::<Vec<_>>().iter().rposition(|line| line.starts_with("#SBATCH")).unwrap();
            assert!(last_directive < first_command);
        }
    }

    #[test]
    fn nothing_ends_the_comment_of_a_directive() {
        let strange = "a\ntouch x";
        let refused = |job: &Job, options: &SlurmOptions| match slurm_scripts(job, options) {
            Err(Error::Usage(message)) => message,
            other => panic!("{other:?}"),
        };
        let none = SlurmOptions::default();
        let some = || Some(strange.to_owned());
        assert!(refused(&Job { name: strange.into(), ..job() }, &none).contains("the job's name"));
        assert!(refused(&Job { folder: strange.into(), ..job() }, &none).contains("--dir"));
        assert!(refused(&job(), &SlurmOptions { partition: some(), ..none.clone() }).contains("--partition"));
        assert!(refused(&job(), &SlurmOptions { time: some(), ..none.clone() }).contains("--walltime"));
        assert!(refused(&job(), &SlurmOptions { memory: some(), ..none.clone() }).contains("--mem"));
        assert!(
            refused(&job(), &SlurmOptions { further: vec![strange.to_owned()], ..none.clone() }).contains("--sbatch")
        );
        let percent = Job { folder: "/a%j".into(), ..job() };
        assert!(slurm_scripts(&percent, &none).unwrap()[0].1.contains("#SBATCH --output=/a%%j/log/%x-%A_%a.log\n"));
    }

    #[test]
    fn values_are_not_searched_for_names() {
        let strange = Job { scene: "/a@SHARDS@b.json".into(), frames: None, overwrite: true, ..job() };
        let [(_, render), _, (_, submit)] = slurm_scripts(&strange, &SlurmOptions::default()).unwrap();
        assert!(render.contains("scene=/a@SHARDS@b.json"));
        assert!(submit.contains("submit '' '/show/room.####.exr'") && submit.contains("overwrite=1"), "{submit}");
    }
}
