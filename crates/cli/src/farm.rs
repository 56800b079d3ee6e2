//! `steradian farm`.

use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;
use steradian::internal::farm::{
    Job, SlurmOptions, is_scene_per_frame, openjd_template, slurm_scripts, with_frame_pattern,
};
use steradian::internal::output::{self, FileUses, Format};
use steradian::internal::printable;
use steradian::{Error, Result};

use crate::args::{Cli, FarmCommand, JobArgs, SlurmArgs};
use crate::log::{self, Level};
use crate::text;

/// Options of render that the job's own scripts give.
const OWN: [&str; 8] = ["--shard", "--checkpoint", "--every", "--resume", "--frames", "--output", "-o", "--progress"];

/// Writes a job.
pub fn run(command: &FarmCommand, uses: FileUses) -> Result<()> {
    match command {
        FarmCommand::Slurm(arguments) => slurm(arguments, uses),
        FarmCommand::Openjd(arguments) => text::print_json(&openjd_template(&job(&arguments.job)?)),
    }
}

fn slurm(arguments: &SlurmArgs, mut uses: FileUses) -> Result<()> {
    let job = job(&arguments.job)?;
    let options = SlurmOptions {
        partition: arguments.partition.clone(),
        time: arguments.walltime.clone(),
        cpus: arguments.cpus,
        memory: arguments.mem.clone(),
        further: arguments.sbatch.clone(),
        retries: arguments.retries,
    };
    let scripts = slurm_scripts(&job, &options)?;
    let submit = job.folder.join("submit.sh");
    uses.read(&arguments.job.scene, "the scene")?;
    scripts.iter().try_for_each(|(name, _)| uses.write(&job.folder.join(name), "a script of the job"))?;
    for folder in ["log", "shards"].map(|name| job.folder.join(name)) {
        fs::create_dir_all(&folder).map_err(|e| Error::Output { file: folder, message: e.to_string() })?;
    }
    for (name, script) in scripts {
        let path = job.folder.join(name);
        output::write_atomically(&path, |out| out.write_all(script.as_bytes()).map_err(|e| e.to_string()))?;
        let executable = fs::Permissions::from_mode(0o755);
        fs::set_permissions(&path, executable).map_err(|e| Error::Output { file: path, message: e.to_string() })?;
    }
    if !arguments.submit {
        return text::print(&submit.display().to_string());
    }
    let output = Command::new("bash").arg(&submit).output().map_err(|e| Error::Internal(format!("bash: {e}")))?;
    text::print(String::from_utf8_lossy(&output.stdout).trim_end())?;
    let complaint = String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ");
    if !output.status.success() {
        return Err(Error::Internal(format!("{} could not submit the job: {complaint}", submit.display())));
    }
    if !complaint.is_empty() {
        log::message(Level::Warning, &complaint);
    }
    Ok(())
}

/// The job that the command line describes, its options checked.
fn job(arguments: &JobArgs) -> Result<Job> {
    let per_frame = arguments.frames.is_some() && is_scene_per_frame(&arguments.scene);
    if !per_frame && !arguments.scene.is_file() {
        return Err(Error::Missing { file: arguments.scene.clone(), message: "no such scene".to_owned() });
    }
    let stem = arguments.scene.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
    // A name for queues and folders: no place for a frame's number, no line break, no braces, which are the format's in
    // a template.
    let plain = |c: char| if printable::line(&c.to_string()) != c.to_string() || "{}".contains(c) { '_' } else { c };
    let name: String = stem.replace(['#', '%'], "").trim_matches('.').chars().map(plain).collect();
    let default = [PathBuf::from(format!("{name}.exr"))];
    let outputs = if arguments.output.is_empty() { &default[..] } else { &arguments.output };
    let absolute =
        |path: &Path| std::path::absolute(path).map_err(|e| Error::Usage(format!("{}: {e}", path.display())));
    let output = |path: &PathBuf| {
        Format::from_path(path)?;
        let path = absolute(path)?;
        match (&arguments.frames, path.to_str()) {
            (Some(_), Some(text)) => Ok(PathBuf::from(with_frame_pattern(text))),
            _ => Ok(path),
        }
    };
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(|e| Error::Internal(format!("cannot find this program: {e}")))?,
    };
    let spp = arguments.spp.iter().flat_map(|spp| ["--spp".to_owned(), spp.to_string()]);
    let options: Vec<String> = spp.chain(arguments.options.iter().cloned()).collect();
    check_options(&options)?;
    Ok(Job {
        folder: absolute(&arguments.dir.clone().unwrap_or_else(|| format!("{name}.farm").into()))?,
        name,
        program,
        scene: absolute(&arguments.scene)?,
        outputs: outputs.iter().map(output).collect::<Result<_>>()?,
        shards: arguments.shards,
        frames: arguments.frames.clone(),
        overwrite: arguments.overwrite,
        every: arguments.every,
        options,
    })
}

/// Unknown options of render are found before they fail on every node.
fn check_options(options: &[String]) -> Result<()> {
    let is_own = |option: &&String| OWN.iter().any(|own| *option == own || option.starts_with(&format!("{own}=")));
    if let Some(own) = options.iter().find(is_own) {
        return Err(Error::Usage(format!("{own}: the job gives this option itself")));
    }
    let line = ["steradian", "render", "scene"].into_iter().chain(options.iter().map(String::as_str));
    match Cli::try_parse_from(line) {
        Ok(_) => Ok(()),
        Err(error) => {
            let text = error.to_string();
            Err(Error::Usage(text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned()))
        }
    }
}
