#!/usr/bin/env python3
"""Samples per second and peak memory beside Mitsuba 3 on the same scene files.

    benches/peers.py [--scenes cornell,glass,bunny_x] [--spp 16,64] [--rounds 3] [--variants scalar_rgb,llvm_ad_rgb]
                     [--steradian target/release/steradian] [--mitsuba mitsuba]

Both trace paths from the camera: no photons, no connections. Renderers take turns, each with all processors (taskset limits them). Each renders with
both numbers of samples; the rate comes from the difference of the two times, so that starting, reading and building are not in it. Prints medians over
the rounds in Msamples/s, peak memory in MB, and the median of the rates' ratios within a round.
Needs `cargo build --release`, `cargo xtask bench_scenes` and `pip install mitsuba` (DRJIT_LIBLLVM_PATH set for the llvm variants if need be).
Without Mitsuba only Steradian is measured. Figures of a busy machine mean nothing.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Mitsuba's integrator `path` has neither photons nor connections.
PATHS = ["--caustics", "paths", "--bidirectional", "off"]


def measured(command):
    """Seconds and peak megabytes of a process."""
    with tempfile.TemporaryFile() as messages:
        start = time.monotonic()
        process = subprocess.Popen([str(word) for word in command], stdout=messages, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.monotonic() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            messages.seek(0)
            sys.exit(f"{' '.join(map(str, command))}\n{messages.read().decode()[-2000:]}")
    return seconds, usage.ru_maxrss / 1000


def rate(command, pixels, spp):
    """Msamples per second, and peak megabytes."""
    (few, _), (many, memory) = [measured(command(samples)) for samples in spp]
    if many <= few:
        sys.exit("the times of few and many samples do not differ; raise --spp")
    return pixels * (spp[1] - spp[0]) / (many - few) / 1e6, memory


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="cornell,glass,bunny_x")
    parser.add_argument("--spp", default="16,64", help="two numbers of samples per pixel")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--variants", default="scalar_rgb,llvm_ad_rgb", help="variants of Mitsuba")
    parser.add_argument("--steradian", default=str(ROOT / "target/release/steradian"))
    parser.add_argument("--mitsuba", default="mitsuba")
    arguments = parser.parse_args()
    spp = sorted(int(word) for word in arguments.spp.split(","))
    if len(spp) != 2 or spp[0] == spp[1]:
        parser.error("--spp takes two different numbers")
    if not shutil.which(arguments.steradian):
        sys.exit(f"peers.py: {arguments.steradian} is missing: cargo build --release")
    variants = [name for name in arguments.variants.split(",") if name]
    if not shutil.which(arguments.mitsuba):
        print(f"peers.py: {arguments.mitsuba} is missing (pip install mitsuba): Steradian alone", file=sys.stderr)
        variants = []
    print("| scene | Steradian | " + "".join(f"Mitsuba {name} | ratio | " for name in variants))
    print("|---|---|" + "---|---|" * len(variants))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "picture.exr"
        for name in arguments.scenes.split(","):
            scene = ROOT / f"benches/scenes/{name}.xml"
            text = scene.read_text()
            missing = [file for file in re.findall(r'filename" value="([^"]+)"', text) if not (scene.parent / file).exists()]
            if missing:
                sys.exit(f"peers.py: {scene.parent / missing[0]} is missing: cargo xtask bench_scenes")
            width, height = (int(re.search(rf'"{side}" value="(\d+)"', text)[1]) for side in ("width", "height"))
            commands = [lambda n: [arguments.steradian, "render", scene, "--spp", n, "-q", "-o", out, *PATHS]]
            for variant in variants:
                commands.append(lambda n, variant=variant: [arguments.mitsuba, "-m", variant, "-D", f"spp={n}", "-o", out, scene])
            rounds = [[rate(command, width * height, spp) for command in commands] for _ in range(arguments.rounds)]
            cells = []
            for which in range(len(commands)):
                rates, memory = zip(*(results[which] for results in rounds))
                cells.append(f"{statistics.median(rates):.2f}, {max(memory):.0f} MB")
                if which:
                    cells.append(f"{statistics.median(results[0][0] / results[which][0] for results in rounds):.2f}")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
