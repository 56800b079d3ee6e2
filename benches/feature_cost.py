#!/usr/bin/env python3
"""What the code of features costs a scene that does not use them: instructions of the program as it is against those of one without the feature.

    benches/feature_cost.py [--only media,textures] [--json FILE] [--work FOLDER] [--check]

The sources are copied to a work folder and the feature is taken out there: every place that decides whether a scene uses it is replaced by one where no scene
does, so that the compiler removes what follows. A place that is no longer found ends the run: the list below is then to be updated. Program and
variants are built alike (optimised, incrementally, so without LTO). Instructions are those of callgrind, one thread, 64 x 64 pixels, 8 samples
less those with 2, so that starting, reading and building are not among them. The scene is benches/scenes/cornell.xml: triangles, diffuse surfaces, one rough
metal, one lamp. Needs valgrind and `cargo xtask bench_scenes`. An hour or so; each variant takes a build.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = (2, 8)

# In safe code a place that is never reached still has to be tested for.
NEVER = "unsafe { std::hint::unreachable_unchecked() }"

# Renders a scene as the command line does and prints a digest of the picture.
PROGRAM = """//! Renders SCENE with a number of samples, on one thread.
use std::sync::atomic::AtomicBool;

use steradian::internal::render::{Overrides, Settings, Silent};
use steradian::internal::{accel, compile, import, render};

fn main() -> steradian::Result<()> {
    let words: Vec<String> = std::env::args().collect();
    let scene = std::path::Path::new(&words[1]);
    let imported = import::read_scene(scene, &import::ImportOptions::default())?;
    let (size, spp) = (Some([64, 64]), words[2].parse().ok());
    let default_outputs = vec!["unused.exr".into()];
    let settings = Settings::new(&imported.desc, &Overrides { size, spp, threads: Some(1), default_outputs, ..Overrides::default() })?;
    let scene = compile::compile_from(&imported.desc, imported.source(scene))?;
    let accel = accel::build(settings.accel, &scene.geometry, 1)?;
    let image = render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.image;
    let values = image.layers.iter().flat_map(|layer| &layer.data);
    println!("{:x}", values.fold(0u64, |hash, value| (hash ^ u64::from(value.to_bits())).wrapping_mul(0x100_0000_01b3).rotate_left(29)));
    Ok(())
}
"""


def flag(name):
    """Every reader of a flag of `Features` finds it down."""
    return ("src/{scene.rs,integrator,render,geometry,light}", rf"(?:\b\w+\.)*\bfeatures\.{name}\b", "false")


# Feature: (what decides whether a scene uses it, its places: files, pattern, replacement).
FEATURES = {
    "textures": (
        "`Material::Constant`; `Features::filtered_textures`",
        [
            ("src/scene.rs", r"Cow::Owned\(material\.bsdf\(&self\.textures, footprint\)\)", "{ let _ = footprint; " + NEVER + " }"),
            ("src/light/area/mod.rs", r"Some\(id\) => self\.textured\(&textures\[id\.index\(\)\], &point\(\)\),", "Some(_) => { let _ = (textures, point); " + NEVER + " }"),
            ("src/integrator/path/materials.rs", r"Material::Textured\(\.\.\) => vertices\.textured\.push\(lane as u8\),", "Material::Textured(..) => " + NEVER + ","),
            ("src/integrator/path/materials.rs", r"0\.\.vertices\.textured\.len\(\)", "0..0"),
            ("src/integrator/render_context.rs", r"= self\.cone_share\?;", "= None::<f32>?;"),
            ("src/integrator/path/wave.rs", r"cones\.get\(path\)", "None::<&RayCone>"),
        ],
    ),
    "mesh attributes": ("`Features::attributes`", [flag("attributes")]),
    "cut-outs": (
        "`AlphaMasks::is_empty`; a filter of the meshes that have holes",
        [
            ("src/geometry/cutout.rs", r"self\.0\.is_none\(\)", "true"),
            ("src/geometry/cutout.rs", r"self\.0\.as_ref\(\)\.is_some_and\(\|mask\| mask\.has_holes\(shape\)\)", "{ let _ = shape; false }"),
            ("src/geometry/cutout.rs", r"Some\(mask\) if mask\.has_holes\(hit\.shape\) =>", "Some(mask) if false && mask.has_holes(hit.shape) =>"),
            ("src/light/area/mod.rs", r"self\.texture\.is_none\(\) && self\.opacity\.is_none\(\)", "self.texture.is_none()"),
        ],
    ),
    "motion blur": (
        "`Features::motion`; `Mesh::is_deforming`, `Camera::motion`",
        [
            flag("motion"),
            ("src/geometry/mesh.rs", r"!self\.later\.is_empty\(\)", "false"),
            ("src/camera/mod.rs", r"Some\(motion\) => moved\(motion, time, origin, direction\)", "Some(_) => " + NEVER),
            ("src/geometry/instance.rs", r"Some\(motion\) => Cow::Owned\(motion\.at\(f64::from\(time\)\)\)", "Some(_) => { let _ = time; " + NEVER + " }"),
        ],
    ),
    "depth of field": (
        "the camera's lens",
        [("src/camera/mod.rs", r"Some\(lens\) => \{\s*let on_lens[^}]*\}", "Some(_) => { let _ = lens_u; " + NEVER + " }")],
    ),
    "user geometry": (
        "`Features::analytic_shapes`, `Shape::Analytic`",
        [
            flag("analytic_shapes"),
            ("src/geometry/mod.rs", r"Self::Analytic\(placed\) => placed\.interaction_with\(detail, ray, hit\),", "Self::Analytic(_) => " + NEVER + ","),
        ],
    ),
    "curves and points": (
        "`Shape::Curves`, `Shape::Points`",
        [("src/geometry/mod.rs", r"Self::Curves\(_\) \| Self::Points\(_\) => self\.many_interaction_and_dp_dv\(detail, ray, hit\)\.map\(.*\),", "Self::Curves(_) | Self::Points(_) => " + NEVER + ",")],
    ),
    "instances": (
        "the instance in a hit",
        [
            ("src/geometry/mod.rs", r"if hit\.instance == Hit::NO_INSTANCE \{\s*self\.shape\(hit\.shape\)\.interaction\(detail, ray, hit\)\s*\} else \{[^}]*\}", "self.shape(hit.shape).interaction(detail, ray, hit)"),
            ("src/accel/embree/mod.rs", r"if raw\.instance == INVALID", "if true"),
        ],
    ),
    "normal and bump maps": ("`Features::normal_perturbations`", [flag("normal_perturbations")]),
    "smooth normals": ("`Features::shading_normals`", [flag("shading_normals")]),
    "environment": (
        "`LightSet::at_infinity`; `Features::environment`",
        [
            flag("environment"),
            ("src/light/set.rs", r"&self\.at_infinity\n", "&[]\n"),
            ("src/light/set.rs", r"match &self\.mis_compensated \{", "match &None::<LightDistribution> {"),
        ],
    ),
    "light tree": ("`LightSet::selection`", [("src/light/set.rs", r"(?<=if let Some\(tree\) = )&self\.tree|(?<=match )&self\.tree|(?<=match \()&self\.tree", "&None::<Box<LightTree>>")]),
    "media": ("`Features::media`", [flag("media")]),
    "anisotropy": ("`Features::anisotropic`, `Features::parameters`", [flag("anisotropic"), flag("parameters")]),
    "layers beside the colour": (
        "`Context::wants_surfaces` and the like, `LayerSet`",
        [
            ("src/integrator/path/mod.rs", r"self\.config\.surface_aovs != SurfaceAovs::default\(\)", "false"),
            ("src/integrator/path/mod.rs", r"self\.config\.light_aovs\.by_scattering \|\| self\.config\.surface_aovs\.features", "false"),
            ("src/integrator/path/mod.rs", r"self\.light_aovs\.count\(\) > 0", "false"),
            ("src/film/tile.rs", r"self\.layout\.beside_color\(\)", "false"),
        ],
    ),
    "variance": ("`FilmTile::tracks_variance`", [("src/film/tile.rs", r"self\.moments\.is_some\(\)", "false")]),
    "filters with negative lobes": ("the filter's weight", [("src/film/tile.rs", r"self\.layout\.signed", "false")]),
    "photons": (
        "`PassContext::caustics`",
        [
            ("src/integrator/path/wave.rs", r"context\.pass\.caustics\.is_some\(\)", "false"),
            ("src/integrator/path/caustics.rs", r"= context\.pass\.caustics else", "= None::<&Caustics> else"),
        ],
    ),
    "light paths": (
        "`PassContext::light_paths`",
        [
            ("src/integrator/path/wave.rs", r"context\.pass\.light_paths\.is_some\(\)", "false"),
            ("src/integrator/path/mod.rs", r"!wave\.connections\.is_empty\(\)", "false"),
            ("src/integrator/path/{connection_mis.rs,connections.rs}", r"= context\.pass\.light_paths else", "= None::<&crate::integrator::LightPaths> else"),
        ],
    ),
    "specular reflections of emitters and splitting": (
        "`Context::emitter_prims`",
        [("src/integrator/path/mod.rs", r"specular_direct::emitters\(config, pass\)", "{ let _ = pass; None::<&EmitterPrims> }")],
    ),
    "guiding": (
        "`Guidance`",
        [
            ("src/integrator/path/mod.rs", r"let regions = guide\.map\(\|guide\| Regions::find\(guide, &wave\.vertices\)\);", "let _ = guide; let regions = None::<Regions>;"),
            ("src/integrator/path/scatter.rs", r"guidance\.learner\.is_some\(\) \|\| guidance\.has_moments", "false && guidance.has_moments"),
        ],
    ),
    "clamping": ("the clamp of `path`", [("src/integrator/path/mod.rs", r"self\.clamp == f32::INFINITY \|\|", "true ||")]),
}
# What a scene uses it cannot do without.
# Scenes with large meshes are no use: reading them and building over them varies by more than a feature costs.
USED = {"cornell": []}
TOGETHER = "all at once"


def run(command, **options):
    return subprocess.run([str(word) for word in command], text=True, capture_output=True, **options)


def copy_sources(work):
    """A copy of what rendering needs, newer than whatever was built before: without the benchmarks and the command line, which take time to build."""
    for name in ["Cargo.lock", "build.rs", "ffi"]:
        if not (work / name).exists():
            (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, work / name)
    shutil.rmtree(work / "src", ignore_errors=True)
    shutil.copytree(ROOT / "src", work / "src")
    (work / "src/main.rs").write_text(PROGRAM)
    manifest = (ROOT / "Cargo.toml").read_text()
    manifest = re.sub(r"(?ms)^\[(\[bin\]\]|\[test\]\]|workspace\]|dev-dependencies\]|profile[^\n]*\]).*?(?=^\[|\Z)", "", manifest)
    if not (work / "Cargo.toml").exists() or (work / "Cargo.toml").read_text() != manifest:
        (work / "Cargo.toml").write_text(manifest)


def files_of(work, where):
    """The Rust files that a place names: one file, or `folder/{file.rs,folder,...}`."""
    base, _, names = where.partition("{")
    for path in [work / base / name for name in names.rstrip("}").split(",")] if names else [work / base]:
        yield from [path] if path.is_file() else sorted(path.rglob("*.rs"))


def take_out(work, feature):
    for where, pattern, replacement in FEATURES[feature][1]:
        count = 0
        for path in files_of(work, where):
            text = path.read_text()
            patched, n = re.subn(pattern, lambda _: replacement, text)
            if n:
                path.write_text(patched)
            count += n
        if count == 0:
            sys.exit(f"{feature}: {where} has no longer what decides it: {pattern}")


def build(work):
    # Incremental, so that only what a patch reaches is compiled again.
    environment = dict(os.environ, CARGO_INCREMENTAL="1", CARGO_TARGET_DIR=str(work / "target"))
    built = run(["cargo", "build", "--release"], cwd=work, env=environment)
    if built.returncode:
        sys.exit(built.stderr[-4000:])
    return work / "target/release/steradian"


def instructions(program, scene, spp):
    """Instructions of one render, and the digest of its picture."""
    # One thread everywhere: threads that wait for work count too.
    environment = dict(os.environ, RAYON_NUM_THREADS="1")
    done = run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={os.devnull}", program, scene, str(spp)], env=environment)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        sys.exit(done.stderr[-4000:])
    return int(found.group(1)), done.stdout


def measure(program, scene):
    """Instructions of the samples alone, and the hash of the picture."""
    (few, _), (many, picture) = [instructions(program, scene, spp) for spp in SAMPLES]
    return many - few, picture


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path(os.environ.get("TMPDIR", "/tmp")) / "steradian-feature-cost")
    parser.add_argument("--only", type=lambda text: text.split(","), help="features, by comma")
    parser.add_argument("--json", type=Path, help="figures as JSON")
    parser.add_argument("--check", action="store_true", help="only take out every feature and have the compiler check what is left")
    arguments = parser.parse_args()
    names = arguments.only or [TOGETHER, *FEATURES]
    unknown = [name for name in names if name not in FEATURES and name != TOGETHER]
    if unknown:
        parser.error(f"no such feature: {', '.join(unknown)}; there are {', '.join(FEATURES)}")
    work = arguments.work
    work.mkdir(parents=True, exist_ok=True)
    used_somewhere = {feature for used in USED.values() for feature in used}
    scenes = {name: ROOT / f"benches/scenes/{name}.xml" for name in USED}
    if arguments.check:
        copy_sources(work)
        for feature in FEATURES:
            take_out(work, feature)
        checked = run(["cargo", "check", "--target-dir", work / "check"], cwd=work)
        sys.exit(checked.stderr[-6000:] if checked.returncode else 0)
    if not (ROOT / "benches/scenes/meshes/floor.ply").exists():
        sys.exit("feature_cost.py: the meshes of benches/scenes are missing: cargo xtask bench_scenes")
    if not shutil.which("valgrind"):
        sys.exit("feature_cost.py: valgrind is missing (Debian: apt-get install valgrind)")

    copy_sources(work)
    program = build(work)
    whole = {name: measure(program, scene) for name, scene in scenes.items()}
    figures = {"whole program": {name: count for name, (count, _) in whole.items()}}
    print("| feature | what decides | " + " | ".join(f"{name}: cost of the unused code" for name in scenes) + " |\n|---|---|" + "---|" * len(scenes), flush=True)
    again = [f"{100 * (whole[name][0] / measure(program, scene)[0] - 1):+.2f} %" for name, scene in scenes.items()]
    print("| (the same program again) | | " + " | ".join(again) + " |", flush=True)
    for feature in names:
        copy_sources(work)
        for part in [f for f in FEATURES if f not in used_somewhere] if feature == TOGETHER else [feature]:
            take_out(work, part)
        program = build(work)
        cells = []
        for name, scene in scenes.items():
            if feature in USED[name]:
                cells.append("used")
                continue
            count, picture = measure(program, scene)
            same = "" if picture == whole[name][1] else " (another picture)"
            figures.setdefault(feature, {})[name] = count
            cells.append(f"{100 * (whole[name][0] / count - 1):+.2f} %{same}")
        decides = FEATURES[feature][0] if feature in FEATURES else ""
        print(f"| {feature} | {decides} | " + " | ".join(cells) + " |", flush=True)
        if arguments.json:
            arguments.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
