//! What options mean, and which are refused.

use super::*;
use clap::CommandFactory;
use steradian::desc::{AutoDesc, CausticsDesc, ExrProfileDesc, LayerKind};

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
                --caustics photons --bidirectional --guiding --time-limit 1.5 --layers Z,albedo --float \
                --exposure -1.5 --view filmic --exr profile=nuke,owner=a --exr owner=b \
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
        (vec![LayerKind::Z, LayerKind::Albedo], Some(true), Some(-1.5), Some(ViewDesc::Filmic))
    );
    assert_eq!(
        (o.outputs, o.default_outputs),
        (vec!["a.exr".to_owned(), "b.png".to_owned()], vec!["d.exr".to_owned()])
    );
    assert_eq!((o.exr.profile, o.exr.owner), (Some(ExrProfileDesc::Nuke), Some("b".to_owned())));
    assert_eq!(o.bidirectional, Some(AutoDesc::On));
    assert_eq!((o.caustics, o.guiding), (Some(CausticsDesc::Photons), Some(AutoDesc::On)));
    assert!(o.regularize == Some(0.2) && o.no_depth_of_field && o.transparent == Some(true));
    assert_eq!((arguments.verbosity.verbose, arguments.verbosity.quiet), (2, false));
    assert_eq!(render(&["--json", "a.json"]).unwrap().stats, Some("a.json".into()));
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
        "--exr profil=nuke",
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
fn switches_have_opposites() {
    let parsed = |line: &str| {
        let line = ["steradian", "render", "a.json"].into_iter().chain(line.split_whitespace());
        let matches = command_line().try_get_matches_from(line)?;
        match <Cli as clap::FromArgMatches>::from_arg_matches(&matches)?.command {
            Command::Render(arguments) => Ok::<_, clap::Error>(arguments),
            other => panic!("{other:?}"),
        }
    };
    let overrides = |line: &str| parsed(line).map(|arguments: Box<RenderArgs>| arguments.overrides(Vec::new()));
    let two = |line: &str| overrides(line).map(|o| (o.float, o.transparent)).unwrap();
    assert_eq!(two(""), (None, None));
    assert_eq!(two("--float --transparent"), (Some(true), Some(true)));
    assert_eq!(two("--no-float --no-transparent"), (Some(false), Some(false)));
    assert_eq!(two("--no-float --float"), (Some(true), None));
    assert!(overrides("--no-depth-of-field").unwrap().no_depth_of_field);
    assert!(!overrides("--no-depth-of-field --depth-of-field").unwrap().no_depth_of_field);
    assert!(parsed("--no-denoise --denoise").unwrap().denoise.denoise);
    assert!(!parsed("--denoise --no-denoise").unwrap().denoise.denoise);
    let guiding = |line: &str| overrides(line).unwrap().guiding;
    for (line, expected) in [
        ("", None),
        ("--guiding", Some(AutoDesc::On)),
        ("--guiding --spp 3", Some(AutoDesc::On)),
        ("--guiding auto", Some(AutoDesc::Auto)),
        ("--guiding=off", Some(AutoDesc::Off)),
        ("--no-guiding", Some(AutoDesc::Off)),
        ("--guiding --no-guiding", Some(AutoDesc::Off)),
        ("--no-guiding --guiding auto", Some(AutoDesc::Auto)),
    ] {
        assert_eq!(guiding(line), expected, "{line}");
    }
    for wrong in ["--no-spp", "--no-resume"] {
        assert!(parsed(wrong).is_err(), "{wrong}");
    }
}

/// What an option is given: nothing, text, a number, or what the parser makes of it.
fn kind(arg: &clap::Arg) -> String {
    use std::any::TypeId;
    if !arg.get_action().takes_values() {
        return "switch".to_owned();
    }
    let of = |types: &[TypeId]| types.iter().any(|id| arg.get_value_parser().type_id() == *id);
    if of(&[TypeId::of::<String>(), TypeId::of::<PathBuf>()]) {
        "text".to_owned()
    } else if of(&[
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<f32>(),
        TypeId::of::<f64>(),
        TypeId::of::<std::time::Duration>(),
    ]) {
        "number".to_owned()
    } else {
        format!("{:?}", arg.get_value_parser().type_id())
    }
}

/// What the help of an option begins with, before details of the command.
fn meaning(arg: &clap::Arg) -> String {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    let end = [". ", "; ", ": ", ", ", " instead"].iter().filter_map(|mark| help.find(mark)).min();
    help[..end.unwrap_or(help.len())].to_owned()
}

#[test]
fn an_option_means_the_same_in_every_command() {
    fn visit(command: &clap::Command, path: &str, seen: &mut Vec<(String, String, [String; 2])>) {
        for arg in command.get_arguments().filter(|arg| !arg.is_hide_set()) {
            let names =
                [arg.get_long().map(|long| format!("--{long}")), arg.get_short().map(|short| format!("-{short}"))];
            for name in names.into_iter().flatten() {
                seen.push((name, path.to_owned(), [kind(arg), meaning(arg)]));
            }
        }
        for command in command.get_subcommands().filter(|command| !command.is_hide_set()) {
            visit(command, &format!("{path} {}", command.get_name()), seen);
        }
    }
    let mut seen = Vec::new();
    visit(&command_line(), "steradian", &mut seen);
    assert!(seen.len() > 200, "{}", seen.len());
    let mut faults = Vec::new();
    for (i, (name, path, what)) in seen.iter().enumerate() {
        if let Some((_, first, other)) = seen[..i].iter().find(|(before, ..)| before == name)
            && other != what
        {
            faults.push(format!("{name}: {first} {other:?}, {path} {what:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
