//! What batch systems and shells expect: progress, logs, colours, configuration, manual pages.

use serde_json::Value;

use crate::util::program::{SCENE, run, stderr_of, steradian};

#[test]
fn every_format_has_whole_lines_and_ends_with_all() {
    let folder = tempfile::tempdir().unwrap();
    for (format, all, last) in [
        ("human", "Progress: 100%", ""),
        ("plain", "Progress: 100%", ""),
        ("openjd", "openjd_progress: 100.0", ""),
        ("alf", "ALF_PROGRESS 100%", ""),
        ("deadline", "Progress: 100%", ""),
        ("afanasy", "PROGRESS: 100%", "[ PARSER FINISHED SUCCESS ]\n"),
    ] {
        let output =
            run(folder.path(), &format!("render scene.json -o a.exr --spp 64 --target-error 0.01 --progress {format}"));
        let text = stderr_of(&output);
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(text.ends_with(&format!("\n{all}\n{last}")) && !text.contains(['\r', '\x1b']), "{format}: {text:?}");
        assert!(!text.contains("Error"), "{text}");
        // The files are printed before all is done.
        let place = |what: &str| text.find(what).unwrap_or(usize::MAX);
        assert!(place("wrote a.exr") < place(all), "{text}");
        assert!(output.stdout.is_empty());
    }
    let output = run(folder.path(), "render scene.json -o a.exr -q --progress alf");
    assert_eq!(stderr_of(&output), "ALF_PROGRESS 100%\n");
    assert_eq!(stderr_of(&run(folder.path(), "render scene.json -o a.exr -q")), "");
}

#[test]
fn failures_are_reported_in_the_farms_words() {
    let folder = tempfile::tempdir().unwrap();
    for (format, line) in [
        ("deadline", "Error: missing.json: "),
        ("openjd", "openjd_fail: missing.json: "),
        ("afanasy", "[ PARSER ERROR ] missing.json: "),
    ] {
        let output = run(folder.path(), &format!("render missing.json --progress {format}"));
        assert_eq!(output.status.code(), Some(4));
        assert!(
            stderr_of(&output).lines().any(|l| l.starts_with(line)) && !stderr_of(&output).contains("100%"),
            "{}",
            stderr_of(&output)
        );
    }
}

#[test]
fn messages_are_json_and_go_to_files_by_option() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "render scene.json -o a.exr --progress json --log-file log.txt");
    let values: Vec<Value> = stderr_of(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(
        values.iter().any(|v| v["message"] == "wrote a.exr" && v["level"] == "note" && v["time"].is_string()),
        "{values:?}"
    );
    let progress: Vec<&Value> = values.iter().filter(|v| v["event"] == "progress").collect();
    assert_eq!(progress.last().unwrap()["percent"], 100.0);
    assert_eq!(values.last().unwrap()["event"], "success");

    // Another run adds to the file, whatever it prints to stderr; each line has its time, level and text.
    assert_eq!(
        stderr_of(&run(folder.path(), "render scene.json -o b.exr -q --log-format text --log-file log.txt")),
        ""
    );
    let log = std::fs::read_to_string(folder.path().join("log.txt")).unwrap();
    let lines: Vec<&str> = log.lines().collect();
    assert!(lines.iter().any(|line| line.contains("wrote a.exr")));
    assert!(
        lines.iter().any(|line| line.ends_with("Z note: wrote b.exr"))
            && lines.iter().any(|line| line.contains("Z info: BVH, packets of rays")),
        "{log}"
    );

    let output = run(folder.path(), "render missing.json --log-format json");
    let value: Value = serde_json::from_str(stderr_of(&output).trim()).unwrap();
    assert_eq!((&value["level"], output.status.code()), (&Value::from("error"), Some(4)));
    assert_eq!(run(folder.path(), "render scene.json --log-file missing/log.txt").status.code(), Some(5));
}

#[test]
fn colours_are_shown_only_where_they_are_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let colored = |arguments: &str, variables: &[(&str, &str)]| {
        let mut command = steradian(folder.path(), arguments);
        stderr_of(&command.envs(variables.iter().copied()).output().unwrap()).contains('\x1b')
    };
    let both = [("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")];
    for arguments in ["render missing.json", "render --nonsense"] {
        assert!(!colored(arguments, &[]), "{arguments}");
        assert!(colored(&format!("--color always {arguments}"), &[]), "{arguments}");
        assert!(colored(arguments, &[("CLICOLOR_FORCE", "1")]), "{arguments}");
        assert!(!colored(arguments, &both), "{arguments}");
        assert!(!colored(&format!("{arguments} --color=never"), &[("CLICOLOR_FORCE", "1")]), "{arguments}");
    }
}

/// Flag, environment, project, user, scene, built-in: each applies where those before it have no value.
#[test]
fn options_come_from_the_strongest_place() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("steradian.toml");
    let user = folder.path().join("config/steradian/config.toml");
    std::fs::create_dir_all(user.parent().unwrap()).unwrap();
    let spp = |arguments: &str, variable: Option<(&str, &str)>| -> u64 {
        let mut command = steradian(folder.path(), &format!("render scene.json -q -o a.exr --stats - {arguments}"));
        let output = command.envs(variable).output().unwrap();
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["spp"].as_u64().unwrap()
    };
    assert_eq!(spp("", None), 2);
    std::fs::write(&user, "spp = 3\nseed = 5").unwrap();
    assert_eq!(spp("", None), 3);
    std::fs::write(&project, "# ours\nspp = 4\n").unwrap();
    assert_eq!(spp("", None), 4);
    assert_eq!(spp("", Some(("STERADIAN_SPP", "5"))), 5);
    assert_eq!(spp("--spp 6", Some(("STERADIAN_SPP", "5"))), 6);

    let show = run(folder.path(), "config show --json scene.json");
    let shown: Value = serde_json::from_slice(&show.stdout).unwrap();
    let origin = |key: &str| shown[key]["origin"].as_str().unwrap_or_default().to_owned();
    assert!(origin("spp").ends_with("steradian.toml:2") && origin("seed").ends_with("config.toml:2"), "{shown:#}");
    assert_eq!((&shown["spp"]["value"], &shown["size"]["value"]), (&"4".into(), &"24x16".into()));
    assert_eq!((origin("size").as_str(), origin("max-depth").as_str()), ("scene: scene.json", "built-in"));
    let text = run(folder.path(), "config show --origin scene.json");
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.lines().any(|line| line.starts_with("spp ") && line.ends_with("steradian.toml:2")), "{text}");

    // The project's file lies beside the scene, not above it.
    std::fs::create_dir(folder.path().join("shot")).unwrap();
    std::fs::write(folder.path().join("shot/scene.json"), SCENE).unwrap();
    let output = run(folder.path(), "render shot/scene.json -q -o a.exr --stats -");
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap()["spp"], 3);
}

/// Keys of EXR outputs come from several places, each key from the strongest; switches of files can be switched off.
#[test]
fn keys_of_exr_files_and_switches_come_from_the_strongest_place() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let file = "float = true\n[exr]\nowner = \"file\"\ncomments = \"of the file, all of it\"\ncompression = \"piz\"\n";
    std::fs::write(dir.join("steradian.toml"), file).unwrap();
    let mut command = steradian(dir, "render scene.json -q -o a.exr --exr compression=rle --no-float");
    assert!(command.env("STERADIAN_EXR", "owner=environment").status().unwrap().success());
    let meta = exr::meta::MetaData::read_from_file(dir.join("a.exr"), false).unwrap();
    let header = &meta.headers[0];
    let text = |text: &Option<exr::meta::attribute::Text>| text.as_ref().unwrap().to_string();
    assert_eq!(text(&header.own_attributes.owner), "environment");
    assert!(text(&header.own_attributes.comments).starts_with("of the file, all of it"));
    assert_eq!(header.compression, exr::compression::Compression::RLE);
    let red = header.channels.list.iter().find(|channel| channel.name == *"R").unwrap();
    assert_eq!(red.sample_type, exr::meta::attribute::SampleType::F16);
    let show = run(dir, "config show --json scene.json");
    let shown: Value = serde_json::from_slice(&show.stdout).unwrap();
    assert_eq!((&shown["exr.owner"]["value"], &shown["exr.compression"]["value"]), (&"file".into(), &"piz".into()));

    // A switch that is off in a file is off, whatever the scene has.
    std::fs::write(dir.join("steradian.toml"), "float = false\n").unwrap();
    std::fs::write(
        dir.join("float.json"),
        SCENE.replacen('{', "{ \"outputs\": { \"file\": \"b.exr\", \"pixel_type\": \"float\" },", 1),
    )
    .unwrap();
    let type_of = |options: &str| {
        assert!(run(dir, &format!("render float.json -q {options}")).status.success());
        let meta = exr::meta::MetaData::read_from_file(dir.join("b.exr"), false).unwrap();
        meta.headers[0].channels.list.iter().find(|channel| channel.name == *"R").unwrap().sample_type
    };
    assert_eq!(type_of(""), exr::meta::attribute::SampleType::F16);
    assert_eq!(type_of("--float"), exr::meta::attribute::SampleType::F32);
    std::fs::remove_file(dir.join("steradian.toml")).unwrap();
    assert_eq!(type_of(""), exr::meta::attribute::SampleType::F32);
}

#[test]
fn unknown_keys_are_errors_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("steradian.toml"), "spp = 4\n\nthread = 2\n").unwrap();
    for command in ["render scene.json", "config show scene.json"] {
        let output = run(folder.path(), command);
        assert_eq!(output.status.code(), Some(2));
        let text = stderr_of(&output);
        assert!(
            text.contains("steradian.toml:3: \"thread\" is no option of render (did you mean \"threads\"?)"),
            "{text}"
        );
    }
}

#[test]
fn farms_say_how_many_processors_a_task_has() {
    let folder = tempfile::tempdir().unwrap();
    for (variable, arguments, threads) in [
        ("SLURM_CPUS_PER_TASK", "", 3),
        ("CUE_THREADS", "", 3),
        ("SLURM_CPUS_PER_TASK", "--threads 2", 2),
        ("STERADIAN_THREADS", "", 3),
    ] {
        let mut command = steradian(folder.path(), &format!("render scene.json -o a.exr --stats - -v {arguments}"));
        let output = command.env(variable, "3").output().unwrap();
        assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap()["threads"], threads, "{variable}");
        assert_eq!(
            stderr_of(&output).contains(&format!("threads = 3 (environment: {variable})")),
            threads == 3,
            "{}",
            stderr_of(&output)
        );
    }
}

#[test]
fn every_command_has_its_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let page = String::from_utf8(run(folder.path(), "man").stdout).unwrap();
    assert!(page.contains(".TH") && page.contains("steradian"), "{page}");
    assert!(run(folder.path(), "man --dir man").status.success());
    for name in ["steradian.1", "steradian-render.1", "steradian-farm-slurm.1", "steradian-config-show.1"] {
        assert!(folder.path().join("man").join(name).exists(), "{name}");
    }
    for shell in ["bash", "zsh", "fish"] {
        assert!(
            String::from_utf8_lossy(&run(folder.path(), &format!("completions {shell}")).stdout).contains("progress"),
            "{shell}"
        );
    }
}
