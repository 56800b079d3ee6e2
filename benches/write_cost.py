#!/usr/bin/env python3
"""What compressing an EXR file with all layers costs in processor time: rendering with a compression and without one take turns.

    benches/write_cost.py [--binary FILE]... [--scene SCENE] [--size WxH] [--spp N] [--rounds N] [--compression NAME]

With several binaries they take turns too. The table has medians of processor seconds of all threads, of the program and of what it takes longer
than with uncompressed files; what rendering itself varies by is in them, so the figures of a simple scene with few samples have the least error. Files go to TMPDIR.
"""

import argparse
import os
import resource
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def processor_seconds(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--binary", action="append", default=[])
    parser.add_argument("--scene", default=str(ROOT / "scenes/cornell.json"))
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--spp", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--compression", default="zip")
    arguments = parser.parse_args()
    binaries = arguments.binary or [str(ROOT / "target/release/steradian")]
    print(f"{Path(arguments.scene).name}, {arguments.size}, {arguments.spp} spp, {arguments.compression}, load {os.getloadavg()[0]:.1f}\n")
    print("| pixels | binary | program | compression | MB |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "a.exr"
        for pixels, options in [("half", []), ("float", ["--float"])]:
            times = {binary: [] for binary in binaries}
            sizes = {}
            for _ in range(arguments.rounds):
                for binary in binaries:
                    def render(compression):
                        command = [binary, "render", arguments.scene, "--size", arguments.size, "--spp", arguments.spp, "--layers", "all"]
                        return processor_seconds([*command, *options, "--compression", compression, "-q", "-o", out])
                    plain = render("none")
                    times[binary].append((whole := render(arguments.compression), whole - plain))
                    sizes[binary] = out.stat().st_size
            for binary in binaries:
                whole, difference = (statistics.median(column) for column in zip(*times[binary]))
                print(f"| {pixels} | {Path(binary).name} | {whole:.2f} s | {difference:.2f} s | {sizes[binary] / 1e6:.1f} |", flush=True)


if __name__ == "__main__":
    main()
