#!/usr/bin/env python3
"""What each layer costs: time of rendering and size of the file, against the picture alone.

    benches/layer_cost.py [--scene SCENE]... [--spp N] [--rounds N] [--binary FILE] [--only LAYERS]

Rendering with a layer and without it take turns, and the ratio of each pair is taken; the table has the medians. Time is that of the render loop, in
processor seconds of all threads (both from the program's `--stats`); files are EXR, ZIP, with their default types. The last line has all layers.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def layers_of(binary):
    """The names of `--layers`."""
    text = subprocess.run([binary, "render", "--help"], capture_output=True, text=True, check=True).stdout
    part = text[text.index("--layers <LAYERS>"):]
    values = part[part.index("[possible values:") + len("[possible values:"):part.index("]")]
    return [name.strip() for name in values.split(",")]


def render(binary, scene, spp, layers, folder):
    """Processor seconds of rendering, and bytes of the file."""
    out, stats = folder / "a.exr", folder / "a.json"
    command = [binary, "render", scene, "--spp", str(spp), "-q", "-o", out, "--stats", stats]
    if layers:
        command += ["--layers", ",".join(layers)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return processor, json.loads(stats.read_text())["render_seconds"], out.stat().st_size


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", action="append", default=[])
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--binary", default=str(ROOT / "target/release/steradian"))
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    names = layers_of(arguments.binary)
    wanted = [name for name in arguments.only.split(",") if name]
    sets = [[name] for name in names if not wanted or name in wanted] + [names]
    for scene in arguments.scene or [str(ROOT / "scenes/knot.json")]:
        print(f"\n{Path(scene).name}, {arguments.spp} samples per pixel, {arguments.rounds} rounds, load {os.getloadavg()[0]:.1f}\n")
        print("| layer | processor time of the program | render loop | file |\n|---|---|---|---|")
        with tempfile.TemporaryDirectory() as folder:
            for layers in sets:
                ratios = []
                for _ in range(arguments.rounds):
                    alone = render(arguments.binary, scene, arguments.spp, [], Path(folder))
                    with_layers = render(arguments.binary, scene, arguments.spp, layers, Path(folder))
                    ratios.append([b / a for a, b in zip(alone, with_layers)])
                medians = [statistics.median(column) for column in zip(*ratios)]
                name = layers[0] if len(layers) == 1 else "all"
                print(f"| {name} | {medians[0]:.3f} | {medians[1]:.3f} | {medians[2]:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
