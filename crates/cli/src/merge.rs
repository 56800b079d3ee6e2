//! `steradian merge`.

use std::path::{Component, Path};

use steradian::desc::OutputDesc;
use steradian::internal::farm::check_single_name;
use steradian::internal::film::Image;
use steradian::internal::output::{self, FileUses, Format, RenderInfo, RenderStatistics};
use steradian::internal::render::{self, Header};
use steradian::{Error, Result};

use crate::args::MergeArgs;
use crate::log::{self, Level};
use crate::text::counted;

/// Merges shards and writes the picture.
pub fn run(arguments: &MergeArgs, mut uses: FileUses) -> Result<()> {
    let first = arguments.shards.first().ok_or_else(|| Error::Usage("no shards to merge".into()))?;
    let outputs = outputs(&Header::read(first)?, &arguments.output)?;
    arguments.shards.iter().try_for_each(|path| uses.read(path, "a shard"))?;
    outputs.iter().flat_map(output::files_of_output).try_for_each(|path| uses.write(&path, "output"))?;
    for output in &outputs {
        output::check_writable(Path::new(&output.file))?;
    }
    let merged = render::merge(&arguments.shards, arguments.partial)?;
    let image = Image { overscan: merged.state.film.shape().overscan, ..merged.state.film.resolve() };
    let (rays, nan_samples) = (merged.state.rays.total(), merged.state.film.dropped_count());
    let info = RenderInfo {
        statistics: merged.header.info.statistics.map(|statistics| RenderStatistics {
            rays,
            nan_samples,
            ..statistics
        }),
        samples_per_pixel: merged.state.done,
        render_seconds: merged.state.seconds,
        partial: merged.partial.clone(),
        ..merged.header.info
    };
    for output in &outputs {
        output::write(output, &image, &info)?;
    }
    let partial = merged.partial.map_or(String::new(), |partial| format!(" ({partial})"));
    let [width, height] = [image.crop.width, image.crop.height];
    log::message(
        Level::Note,
        &format!(
            "{width}x{height} pixels, {} per pixel{partial}",
            counted(u64::from(info.samples_per_pixel), "sample")
        ),
    );
    outputs.iter().for_each(|output| log::message(Level::Note, &format!("wrote {}", output.file)));
    Ok(())
}

/// The files to write: with the names of the command line, but else as the render was to write files of that kind.
fn outputs(header: &Header, names: &[String]) -> Result<Vec<OutputDesc>> {
    if names.is_empty() {
        header.outputs.iter().try_for_each(|output| check_plain(&output.file))?;
        return Ok(header.outputs.clone());
    }
    names.iter().try_for_each(|name| check_single_name(name))?;
    let like = |name: &String| -> Result<OutputDesc> {
        let format = Format::from_path(Path::new(name))?;
        let known = header
            .outputs
            .iter()
            .find(|output| Format::from_path(Path::new(&output.file)).is_ok_and(|other| other == format));
        Ok(OutputDesc { file: name.clone(), ..known.cloned().unwrap_or_else(|| OutputDesc::new(name.clone())) })
    };
    names.iter().map(like).collect()
}

/// Names out of a shard, which may come from anywhere, are those of files in the working folder.
fn check_plain(name: &str) -> Result<()> {
    let mut components = Path::new(name).components();
    match (components.next(), components.next()) {
        (Some(Component::Normal(only)), None) if only == name => Ok(()),
        _ => Err(Error::Usage(format!(
            "the shards name the output {name:?}, which is not in the working folder; name the file to write with -o"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian::desc::LayerKind;

    #[test]
    fn files_have_the_layers_of_the_render() {
        let of_render = vec![OutputDesc { layers: vec![LayerKind::Z], ..OutputDesc::new("a.exr") }];
        let header = Header { outputs: of_render, ..Header::default() };
        let named = outputs(&header, &["b.EXR".to_owned(), "c.png".to_owned()]).unwrap();
        assert_eq!((named[0].file.as_str(), named[0].layers.as_slice()), ("b.EXR", &[LayerKind::Z][..]));
        assert_eq!((named[1].file.as_str(), named[1].layers.len()), ("c.png", 0));
        assert_eq!(outputs(&header, &[]).unwrap()[0].file, "a.exr");
        assert!(matches!(outputs(&header, &["d.jpg".to_owned()]), Err(Error::Usage(_))));
        for name in ["/pictures/a.exr", "../a.exr", "b/a.exr", "./a.exr", "..", ""] {
            let header = Header { outputs: vec![OutputDesc::new(name)], ..Header::default() };
            assert!(matches!(outputs(&header, &[]), Err(Error::Usage(message)) if message.contains("-o")), "{name}");
            assert!(outputs(&header, &["/pictures/b.exr".to_owned()]).is_ok());
        }
    }
}
