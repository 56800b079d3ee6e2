//! `steradian denoise`.

use std::path::{Path, PathBuf};

use steradian::internal::denoise::{Denoiser, FileOptions, Report, denoise_file};
use steradian::internal::film::Filter;
use steradian::internal::output::{self, FileUses, Format};
use steradian::{Error, Result};

use crate::args::DenoiseArgs;
use crate::log::{self, Level};
use crate::text;

/// Denoises a file, or every frame of a sequence.
pub fn run(arguments: &DenoiseArgs, mut uses: FileUses) -> Result<()> {
    let tasks = tasks(arguments)?;
    for task in &tasks {
        uses.read(&task.input, "a noisy picture")?;
        uses.write(&task.output, "a denoised picture")?;
        task.also.iter().try_for_each(|path| uses.write(path, "--output"))?;
        task.check()?;
    }
    let denoiser = Denoiser::open(arguments.oidn.oidn_library.as_deref(), arguments.threads)?;
    let options = FileOptions {
        albedo: arguments.albedo.clone(),
        normal: arguments.normal.clone(),
        without_features: arguments.no_features,
    };
    for task in &tasks {
        let report = denoise_file(&denoiser, &task.input, &task.output, &options)?;
        if !task.also.is_empty() {
            let image = output::read_exr(&task.output)?;
            task.also
                .iter()
                .try_for_each(|path| output::write_png(path, &image, arguments.exposure, arguments.view))?;
        }
        let input = task.input.display();
        if shares_samples(&task.input) {
            let message = "its pixels share samples, and a denoiser takes such noise for texture: render with \
                           --denoise, or with \"samples\": \"importance\" in film.filter";
            log::message(Level::Warning, &format!("{input}: {message}"));
        }
        warnings(&report).iter().for_each(|warning| log::message(Level::Warning, &format!("{input}: {warning}")));
        log::message(Level::Note, &format!("wrote {}: {}", task.output.display(), summary(&report)));
        if arguments.json {
            let mut value = report.statistics(denoiser.library());
            value["input"] = task.input.display().to_string().into();
            value["output"] = task.output.display().to_string().into();
            text::print_json(&value)?;
        }
    }
    Ok(())
}

/// Whether a file's recipe has a pixel filter that shares samples.
fn shares_samples(file: &Path) -> bool {
    let filter =
        output::read_settings(file).ok().and_then(|provenance| provenance.pointer("/settings/filter").cloned());
    filter.and_then(|filter| serde_json::from_value(filter).ok()).is_some_and(|desc| Filter::new(&desc).is_shared())
}

/// What was done, for people.
pub fn summary(report: &Report) -> String {
    let layers = if report.layers.len() == 1 { String::new() } else { format!(", {} layers", report.layers.len()) };
    format!("{}{layers}, {:.2} s", report.attribute(), report.seconds)
}

/// Warnings about a picture.
pub fn warnings(report: &Report) -> Vec<String> {
    let mut lines = report.notes.clone();
    let pixels = |count: u64| if count == 1 { "1 pixel was".to_owned() } else { format!("{count} pixels were") };
    if report.cleaned > 0 {
        lines.push(format!("{} not finite and made from those around before denoising", pixels(report.cleaned)));
    }
    if report.negative > 0 {
        lines.push(format!("{} negative; the denoiser takes that for 0", pixels(report.negative)));
    }
    lines
}

/// One file.
#[derive(Debug, PartialEq)]
struct Task {
    input: PathBuf,
    output: PathBuf,
    also: Vec<PathBuf>,
}

impl Task {
    /// A slip in a name is found before the work, not after it.
    fn check(&self) -> Result<()> {
        for (path, format) in
            [(&self.output, Format::Exr)].into_iter().chain(self.also.iter().map(|path| (path, Format::Png)))
        {
            if Format::from_path(path)? != format {
                let expected =
                    if format == Format::Exr { "an .exr file, which holds all layers" } else { "a .png file" };
                return Err(Error::Usage(format!("output {} is to be {expected}", path.display())));
            }
            output::check_writable(path)?;
        }
        Ok(())
    }
}

/// The files to denoise: one, or all that are there of a sequence, by their numbers.
fn tasks(arguments: &DenoiseArgs) -> Result<Vec<Task>> {
    let whole = |path: &Path| Pattern::new(path).is_none();
    let (input, others) = (&arguments.input, [&arguments.output].into_iter().chain(&arguments.also));
    let Some(pattern) = Pattern::new(input) else {
        return Ok(vec![Task { input: input.clone(), output: arguments.output.clone(), also: arguments.also.clone() }]);
    };
    if let Some(other) = others.into_iter().find(|path| whole(path)) {
        return Err(Error::Usage(format!(
            "{} names a sequence, so {} needs #### for the frame, too",
            input.display(),
            other.display()
        )));
    }
    let frames = pattern.frames()?;
    if frames.is_empty() {
        return Err(Error::Missing { file: input.clone(), message: "no frame of this sequence".to_owned() });
    }
    let fill =
        |path: &Path, frame: u64| Pattern::new(path).map_or_else(|| path.to_owned(), |pattern| pattern.file(frame));
    let task = |frame| Task {
        input: pattern.file(frame),
        output: fill(&arguments.output, frame),
        also: arguments.also.iter().map(|path| fill(path, frame)).collect(),
    };
    Ok(frames.into_iter().map(task).collect())
}

/// A file name with a run of `#` for the frame's number.
struct Pattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    fn new(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let start = name.find('#')?;
        let digits = name[start..].chars().take_while(|c| *c == '#').count();
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Some(Self { folder, before: name[..start].to_owned(), digits, after: name[start + digits..].to_owned() })
    }

    fn file(&self, frame: u64) -> PathBuf {
        self.folder.join(format!("{}{frame:0width$}{}", self.before, self.after, width = self.digits))
    }

    /// The frames that are there, in order.
    fn frames(&self) -> Result<Vec<u64>> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let entries =
            folder.read_dir().map_err(|e| Error::Missing { file: folder.to_owned(), message: e.to_string() })?;
        let number = |name: &str| {
            let digits = name.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
            let frame: u64 = digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok())??;
            // 7 and 007 are not both frame 7 of a sequence.
            (format!("{frame:0width$}", width = self.digits) == digits).then_some(frame)
        };
        let mut frames: Vec<u64> = entries.flatten().filter_map(|entry| number(entry.file_name().to_str()?)).collect();
        frames.sort_unstable();
        Ok(frames)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_is_what_is_there_of_it() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.0002.exr", "a.0010.exr", "a.00003.exr", "a.12345.exr", "a.x.exr", "b.0001.exr", "a.0002.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let pattern = Pattern::new(&folder.path().join("a.####.exr")).unwrap();
        assert_eq!(pattern.frames().unwrap(), [2, 10, 12345]);
        assert_eq!(pattern.file(10), folder.path().join("a.0010.exr"));
        assert!(Pattern::new(Path::new("a.exr")).is_none());
    }
}
