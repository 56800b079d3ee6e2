//! `steradian rerender`, and what files keep for it.

use std::path::{Path, PathBuf};

use clap::Parser;
use steradian::desc::OutputDesc;
use steradian::import::scene_fingerprint;
use steradian::output::{self, Format};
use steradian::render::{Recipe, Settings};
use steradian::{Error, Result};

use crate::args::{Cli, Command, RenderArgs, RerenderArgs};
use crate::frames::{self, Shot};

/// A picture to be made again.
#[derive(Clone, Debug)]
pub struct Repeat {
    /// How it was made, with what is wanted otherwise.
    pub recipe: Recipe,
    /// The file that tells of it.
    pub file: PathBuf,
    /// Whether a changed scene will do.
    pub allow_changed: bool,
}

/// Renders a picture again; the result is the exit code.
pub fn run(arguments: &RerenderArgs) -> Result<u8> {
    let mut recipe = Recipe::from_value(output::read_settings(&arguments.file)?, &arguments.file)?;
    let mut render = parse(&recipe, &arguments.file)?;
    let file = arguments.output.clone().unwrap_or_else(|| arguments.file.to_string_lossy().into_owned());
    let format = Format::from_path(Path::new(&file))?;
    if let Some(output) = recipe.output.as_mut().filter(|_| format == Format::Exr) {
        output.file = file;
    } else {
        recipe.output = Some(OutputDesc { view: Some(recipe.settings.integrator.view()), ..OutputDesc::new(file) });
    }
    recipe.settings.spp = arguments.spp.unwrap_or(recipe.settings.spp);
    render.scene = scene_file(arguments, &recipe);
    render.threads = arguments.threads.or(render.threads);
    render.verbosity.quiet = arguments.quiet;
    render.repeat = Some(Box::new(Repeat { recipe, file: arguments.file.clone(), allow_changed: arguments.allow_changed }));
    frames::run(&render)
}

/// The arguments that the picture was rendered with, without those that do not concern the picture.
fn parse(recipe: &Recipe, file: &Path) -> Result<RenderArgs> {
    let malformed = |message: String| Error::Malformed { file: file.to_owned(), message };
    let parse = |words: &[String]| match Cli::try_parse_from(std::iter::once("steradian").chain(words.iter().map(String::as_str))) {
        Ok(Cli { command: Command::Render(arguments), .. }) => Ok(*arguments),
        Ok(_) => Err(malformed("its arguments are not those of a render".to_owned())),
        Err(error) => Err(malformed(format!("its arguments are of another version: {}", error.kind()))),
    };
    let plain = parse(&["render".to_owned(), recipe.scene_file.to_string_lossy().into_owned()])?;
    let RenderArgs { state, live, mut sequence, verbosity, json, time_limit, .. } = plain;
    if let Some(frame) = recipe.frame {
        sequence.frames = Some(frame.to_string().parse().map_err(|_| malformed(format!("there is no frame {frame}")))?);
        sequence.overwrite = true;
    }
    let given = parse(&recipe.arguments)?;
    sequence.fps = given.sequence.fps;
    // Options of both kinds of files need one to apply to; the recipe's output takes their place.
    let output = ["a.exr", "a.png"].map(str::to_owned).to_vec();
    Ok(RenderArgs { state, live, sequence, verbosity, json, time_limit, output, pixel: None, sample: None, ..given })
}

/// Where the scene is: where the user says, or at its name, from here or from where it was rendered.
fn scene_file(arguments: &RerenderArgs, recipe: &Recipe) -> PathBuf {
    let named = arguments.scene.clone().unwrap_or_else(|| recipe.scene_file.clone());
    if arguments.scene.is_some() || named.exists() { named } else { recipe.folder.join(named) }
}

/// How the picture that is about to be rendered is made, if a file will tell; settings of a picture to be made again are set to what they were.
pub fn prepare(arguments: &RenderArgs, shot: &Shot, settings: &mut Settings) -> Result<Option<Recipe>> {
    let tells = settings.outputs.iter().any(|output| Format::from_path(Path::new(&output.file)).is_ok_and(|f| f == Format::Exr));
    if arguments.pixel.is_some() || (arguments.repeat.is_none() && !tells) {
        return Ok(None);
    }
    let scene = scene_fingerprint(&shot.imported, &shot.scene)?;
    let Some(repeat) = &arguments.repeat else {
        let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
        return Ok(Some(Recipe { frame: shot.frame, ..Recipe::new(&shot.scene, scene, settings, words) }));
    };
    let changed = repeat.recipe.scene.differences(&scene);
    if !changed.is_empty() && !repeat.allow_changed {
        let message = format!("the picture shows another scene: not the same {} (--allow-changed goes on)", changed.join(", "));
        return Err(Error::Checkpoint { file: repeat.file.clone(), message });
    }
    repeat.recipe.apply(settings)?;
    let (program, folder) = (concat!("steradian ", env!("CARGO_PKG_VERSION")).to_owned(), std::env::current_dir().unwrap_or_default());
    Ok(Some(Recipe { program, folder, scene, scene_file: shot.scene.clone(), output: None, ..repeat.recipe.clone() }))
}
