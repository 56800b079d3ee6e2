//! What options mean, and which are refused.

use super::*;
use clap::CommandFactory;
use steradian::desc::{CausticsDesc, LayerKind};

fn render(arguments: &[&str]) -> Result<RenderArgs, clap::Error> {
    let line = ["steradian", "render", "a.json"].iter().chain(arguments);
    match Cli::try_parse_from(line)?.command {
        Command::Render(arguments) => Ok(*arguments),
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_definition_is_sound() {
    Cli::command().debug_assert();
}

#[test]
fn every_option_reaches_the_overrides() {
    let line = "-o a.exr -o b.png --spp 5 --size 20x10 --crop 1,2,3,4 --threads 2 --seed 9 --integrator path \
                --accel linear --sampler independent --max-depth 3 --strategy light --clamp 2.5 --regularize 0.2 \
                --caustics photons --guiding --time-limit 1.5 --layers Z,albedo --float --exposure -1.5 \
                --view filmic \
                --no-depth-of-field --transparent -vv";
    let arguments = render(&line.split_whitespace().collect::<Vec<_>>()).unwrap();
    let o = arguments.overrides(vec!["d.exr".to_owned()]);
    assert_eq!(
        (o.spp, o.size, o.crop, o.threads, o.seed),
        (Some(5), Some([20, 10]), Some([1, 2, 3, 4]), Some(2), Some(9))
    );
    assert_eq!(
        (o.accel, o.sampler, o.strategy),
        (Some(AccelKind::Linear), Some(SamplerKindDesc::Independent), Some(StrategyDesc::Light))
    );
    assert_eq!(
        (o.integrator, o.max_depth, o.clamp, o.time_limit),
        (Some(IntegratorDesc::default()), Some(3), Some(2.5), Some(1.5))
    );
    assert_eq!(
        (o.layers, o.float, o.exposure, o.view),
        (vec![LayerKind::Z, LayerKind::Albedo], true, Some(-1.5), Some(ViewDesc::Filmic))
    );
    assert_eq!(
        (o.outputs, o.default_outputs),
        (vec!["a.exr".to_owned(), "b.png".to_owned()], vec!["d.exr".to_owned()])
    );
    assert_eq!((o.caustics, o.guiding), (Some(CausticsDesc::Photons), Some(true)));
    assert!(o.regularize == Some(0.2) && o.no_depth_of_field && o.transparent);
    assert_eq!((arguments.verbosity.verbose, arguments.verbosity.quiet), (2, false));
}

#[test]
fn all_layers_are_those_of_the_scene_format() {
    let layers =
        |line: &str| render(&line.split_whitespace().collect::<Vec<_>>()).unwrap().overrides(Vec::new()).layers;
    let all = layers("--layers all");
    assert!(all.len() > 20 && all.contains(&LayerKind::CryptoAsset) && layers("--layers Z,all").len() == all.len() + 1);
}

#[test]
fn wrong_options_are_refused() {
    for line in [
        "--spp -1",
        "--size 20",
        "--size 20x",
        "--crop 1,2,3",
        "--layers Z,Q",
        "--integrator pathh",
        "--pixel 1,2",
        "--sample 3",
        "--guiding yes",
        "-q -v",
        "--nonsense",
    ] {
        let error = render(&line.split_whitespace().collect::<Vec<_>>()).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{line}");
    }
    let message = render(&["--integrator", "pathh"]).unwrap_err().to_string();
    assert!(message.contains("ambient_occlusion") && message.contains("'path'"), "{message}");
}

#[test]
fn guiding_is_a_switch() {
    let guiding = |line: &str| {
        render(&line.split_whitespace().collect::<Vec<_>>()).map(|arguments| arguments.overrides(Vec::new()).guiding)
    };
    assert_eq!(guiding("").unwrap(), None);
    assert_eq!(guiding("--guiding").unwrap(), Some(true));
    assert_eq!(guiding("--guiding -q").unwrap(), Some(true));
    assert_eq!(guiding("--guiding").unwrap(), Some(true));
    assert_eq!(guiding("--no-guiding").unwrap(), Some(false));
    assert_eq!(guiding("--no-guiding").unwrap(), Some(false));
    assert!(guiding("--guiding --no-guiding").is_err() && guiding("--guiding maybe").is_err());
}
