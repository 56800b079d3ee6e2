//! A job template of Open Job Description, version 2023-09.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::job::{Job, quote};

/// The template as JSON: a step of shards (and frames), and one that merges each frame when all shards are rendered.
/// Whoever submits it may change the number of shards, the frames, the program, and the folder of shards and
/// checkpoints.
///
/// A task that is cancelled gets two minutes to write its checkpoint.
pub fn openjd_template(job: &Job) -> Value {
    // Paths are strings: the specification requires defaults of type PATH to be relative to the template.
    let text = |name: &str, value: &str, what: &str| {
        json!({
            "name": name, "type": "STRING", "default": value, "description": what
        })
    };
    let mut parameters = vec![
        text("Scene", &job.scene.to_string_lossy(), "The scene"),
        text("Work", &job.folder.to_string_lossy(), "The folder of shards and checkpoints"),
        text("Program", &job.program.to_string_lossy(), "The program steradian"),
        json!({
            "name": "Shards", "type": "INT", "default": job.shards, "minValue": 1,
            "description": "Into how many shards a picture is split"
        }),
    ];
    let outputs: Vec<String> = (1..=job.outputs.len()).map(|i| format!("Output{i}")).collect();
    let output = |(i, output): (usize, &PathBuf)| text(&outputs[i], &output.to_string_lossy(), "A picture to write");
    parameters.extend(job.outputs.iter().enumerate().map(output));
    let mut space = vec![json!({ "name": "Shard", "type": "INT", "range": "1-{{Param.Shards}}" })];
    let frames = job.frames.as_ref().map(|frames| {
        parameters.push(text("Frames", &frames.ranges(':'), "The frames"));
        json!({ "name": "Frame", "type": "INT", "range": "{{Param.Frames}}" })
    });
    space.extend(frames.clone());
    let merge_space = frames.map(|frame| json!({ "taskParameterDefinitions": [frame] }));
    let mut merge = json!({
        "name": "Merge",
        "dependencies": [{ "dependsOn": "Render" }],
        "script": script(&merge_script(job), &outputs),
    });
    if let Some(space) = merge_space {
        merge["parameterSpace"] = space;
    }
    json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": job.name,
        "parameterDefinitions": parameters,
        "steps": [
            {
                "name": "Render", "parameterSpace": { "taskParameterDefinitions": space },
                "script": script(&render_script(job), &[])
            },
            merge,
        ],
    })
}

/// An action that runs a text with bash. Numbers are filled in, but strings come as arguments, so that nothing in them
/// is a command: program, scene, folder of the work, and `further`.
fn script(text: &str, further: &[String]) -> Value {
    let strings = ["Program", "Scene", "Work"].into_iter().chain(further.iter().map(String::as_str));
    let args: Vec<String> = std::iter::once("{{Task.File.Run}}".to_owned())
        .chain(strings.map(|name| format!("{{{{Param.{name}}}}}")))
        .collect();
    json!({
        "embeddedFiles": [{ "name": "Run", "type": "TEXT", "filename": "run.sh", "data": text }],
        "actions": {
            "onRun": {
                "command": "bash",
                "args": args,
                "cancelation": { "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 120 },
            },
        },
    })
}

/// What a script begins with.
const HEAD: &str = "set -eu\nprogram=$1 scene=$2 work=$3\nshift 3\n";

/// Names of a shard's files, without their extension, and of the option that names the frame.
fn place(job: &Job, frame: &str) -> String {
    let frame = if job.frames.is_some() { frame } else { "" };
    format!("\"$work/shards/{frame}\"")
}

const FRAME: &str = "frame{{Task.Param.Frame}}.";

/// An option as the shell reads it back, without two braces next to each other, which would be the template's.
fn quote_option(option: &str) -> String {
    quote(option).replace('{', "{''")
}

fn render_script(job: &Job) -> String {
    let options: Vec<String> = job.options.iter().map(|option| quote_option(option)).collect();
    let frames = if job.frames.is_some() { " --frames={{Task.Param.Frame}}" } else { "" };
    let (name, pattern) = (place(job, FRAME), place(job, "frame#."));
    let part = "{{Task.Param.Shard}}-of-{{Param.Shards}}";
    [
        format!("{HEAD}part={name}{part}"),
        "mkdir -p \"$work/shards\"".to_owned(),
        "[ ! -e \"$part.shard\" ] || exit 0".to_owned(),
        format!("exec \"$program\" render \"$scene\"{frames} {} \\", options.join(" ")),
        format!("    --shard {{{{Task.Param.Shard}}}}/{{{{Param.Shards}}}} -o {pattern}{part}.shard \\"),
        format!("    --checkpoint {pattern}{part}.checkpoint --every {} --resume --progress openjd\n", job.every),
    ]
    .join("\n")
}

fn merge_script(job: &Job) -> String {
    let name = place(job, FRAME);
    let fill = if job.frames.is_some() {
        // `####` and `%04d` become the number.
        "    hashes=${output//[!#]/}\n    [ -z \"$hashes\" ] || output=${output/\"$hashes\"/%0${#hashes}d}\n    \
         case $output in *%*d*) printf -v output \"$output\" {{Task.Param.Frame}} ;; esac\n"
    } else {
        ""
    };
    format!(
        "{HEAD}parts=()\nfor ((i = 1; i <= {{{{Param.Shards}}}}; i++)); do \
         parts+=({name}$i-of-{{{{Param.Shards}}}}.shard); done\n\
         outputs=()\nfor output in \"$@\"; do\n{fill}    outputs+=(-o \"$output\")\ndone\n\
         \"$program\" merge \"${{parts[@]}}\" \"${{outputs[@]}}\"\nrm -f \"${{parts[@]}}\" {name}*.checkpoint\n"
    )
}
